//! The forty tasks of the benchmark: prompts, object placement and its variation, disjoint splits, no overlaps. Scenes
//! are opened but not simulated.

use std::{collections::BTreeSet, path::Path};

use softvt::{
    benchmark::{Goal, Placement, Plan, ShiftValue, Suite, Task},
    episode_id::{EpisodeId, EpisodeSplit},
    geometry::{Pose, Vec3, shape::Shape},
    scene::{Body, Object, Scene, part_poses},
    script::{self, EpisodeSetup, LoadedScript, SceneChanges},
};

/// Episodes per task at the scale of the paper.
const EPISODES: u32 = 50;
/// Nominal start configuration of the arm, rad (from the released code of SoftVTBench).
const START_Q: [f64; 7] = [-0.01988, -0.18734, 0.00767, -2.40340, 0.00496, 2.24534, 0.79485];

/// Object phrases of the Object-Soft prompts in the paper, which uses "soft pastry" for four objects.
const SOFT_OBJECTS: [&str; 10] = [
    "pale cream round steamed-bun pastry",
    "soft pastry",
    "soft pastry",
    "soft pastry",
    "orange round bun pastry with sesame speckles",
    "soft pastry",
    "soft cube",
    "soft cylinder",
    "soft wedge",
    "soft capsule",
];
/// Object phrases of the Spatial-Soft prompts, with sides.
const SOFT_PLACES: [&str; 10] = [
    "right white spiral pastry with ridged frosting",
    "left white spiral pastry with ridged frosting",
    "right pale cream round steamed-bun pastry with black eyes",
    "left pale cream round steamed-bun pastry with black eyes",
    "left small dark brown oval pastry",
    "right small dark brown oval pastry",
    "left long golden braided pastry with orange stripes",
    "right long golden braided pastry with orange stripes",
    "right orange round bun pastry with sesame speckles",
    "left orange round bun pastry with sesame speckles",
];
/// Target and distractors of LIBERO's object suite, in the order of its files.
const GROCERIES: [[&str; 6]; 10] = [
    ["alphabet_soup", "salad_dressing", "cream_cheese", "milk", "tomato_sauce", "butter"],
    ["cream_cheese", "alphabet_soup", "milk", "tomato_sauce", "butter", "orange_juice"],
    ["salad_dressing", "ketchup", "alphabet_soup", "cream_cheese", "milk", "tomato_sauce"],
    ["bbq_sauce", "chocolate_pudding", "ketchup", "salad_dressing", "alphabet_soup", "cream_cheese"],
    ["ketchup", "bbq_sauce", "salad_dressing", "alphabet_soup", "cream_cheese", "milk"],
    ["tomato_sauce", "milk", "butter", "orange_juice", "chocolate_pudding", "bbq_sauce"],
    ["butter", "tomato_sauce", "orange_juice", "chocolate_pudding", "bbq_sauce", "ketchup"],
    ["milk", "cream_cheese", "tomato_sauce", "butter", "orange_juice", "chocolate_pudding"],
    ["chocolate_pudding", "orange_juice", "bbq_sauce", "ketchup", "salad_dressing", "alphabet_soup"],
    ["orange_juice", "butter", "chocolate_pudding", "bbq_sauce", "ketchup", "salad_dressing"],
];
/// Places of the bowl in LIBERO's spatial suite.
const RELATIONS: [&str; 10] = [
    "between the plate and the ramekin",
    "next to the ramekin",
    "from table center",
    "on the cookie box",
    "in the top drawer of the wooden cabinet",
    "on the ramekin",
    "next to the cookie box",
    "on the stove",
    "next to the plate",
    "on the wooden cabinet",
];

fn load(name: &str) -> LoadedScript {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("suites/{name}.lua"));
    script::load(&path, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn suite(loaded: &LoadedScript) -> &Suite {
    let Plan::Suite(suite) = &loaded.plan else { panic!("{:?}", loaded.plan) };
    suite
}

fn open(loaded: &LoadedScript, task: usize, episode: u32, split: EpisodeSplit) -> Scene {
    let suite = suite(loaded).name.clone();
    let id = EpisodeId { suite, task, episode, base_seed: 0, split };
    EpisodeSetup::open(loaded, &id, &SceneChanges::default()).unwrap_or_else(|e| panic!("{e}")).scene
}

fn object<'a>(scene: &'a Scene, name: &str) -> &'a Object {
    scene.objects.iter().find(|o| o.name == name).unwrap_or_else(|| panic!("no {name}"))
}

/// Objects that collide, except table and floor.
fn colliding_objects(scene: &Scene) -> impl Iterator<Item = &Object> {
    let ground = ["table", "floor"];
    scene.objects.iter().filter(move |o| o.asset.body != Body::Scenery && !ground.contains(&o.name.as_str()))
}

#[test]
fn prompts_are_those_of_the_paper_and_match_the_goals() {
    let prompts = |name: &str, expected: fn(usize) -> String| {
        let loaded = load(name);
        let tasks: &[Task] = &suite(&loaded).tasks;
        assert_eq!(tasks.len(), 10, "{name}");
        for (k, task) in tasks.iter().enumerate() {
            assert_eq!(task.prompt, expected(k), "{name}");
            let (word, Placement { object: what, target, .. }) = match &task.goal {
                Goal::On(of) => ("on", of),
                Goal::Inside(of) => ("in", of),
                other => panic!("{name} {k}: {other:?}"),
            };
            let place = format!("{word} the {target}");
            assert!(task.prompt.ends_with(&place), "{name} {k}: {target}");
            let scene = open(&loaded, k, 0, EpisodeSplit::Validation);
            let soft = matches!(object(&scene, what).asset.body, Body::Soft(_));
            assert_eq!(soft, name.ends_with("soft"), "{name} {k}");
            assert_ne!(object(&scene, target).asset.body, Body::Static, "{name} {k}: the target can move");
        }
        tasks.iter().map(|task| task.prompt.clone()).collect::<Vec<_>>()
    };
    let mut all =
        prompts("object_soft", |k| format!("pick up the {} and place it in the basket", SOFT_OBJECTS[k]));
    all.extend(prompts("spatial_soft", |k| {
        format!("pick up the {} and place it on the plate", SOFT_PLACES[k])
    }));
    all.extend(prompts("object_rigid", |k| {
        format!("pick up the {} and place it in the basket", GROCERIES[k][0].replace('_', " "))
    }));
    all.extend(prompts("spatial_rigid", |k| {
        format!("pick up the black bowl {} and place it on the plate", RELATIONS[k])
    }));
    assert_eq!(all.len(), 40);
    let paper = "pick up the soft pastry and place it in the basket";
    let different: BTreeSet<&String> = all.iter().collect();
    let repeated = all.iter().filter(|prompt| *prompt == paper).count();
    assert_eq!(
        (different.len(), repeated),
        (37, 4),
        "only the prompt that the paper repeats occurs more than once"
    );
}

#[test]
fn object_suites_have_the_distractors_of_libero() {
    let (rigid, soft) = (load("object_rigid"), load("object_soft"));
    for (k, [target, distractors @ ..]) in GROCERIES.iter().enumerate() {
        for (loaded, target) in [(&rigid, *target), (&soft, &suite(&soft).tasks[k].object)] {
            let scene = open(loaded, k, 0, EpisodeSplit::Validation);
            let found: BTreeSet<&str> = colliding_objects(&scene).map(|o| o.asset.name.as_str()).collect();
            let expected: BTreeSet<&str> = distractors.iter().copied().chain([target, "basket"]).collect();
            assert_eq!(found, expected, "{} {k}", suite(loaded).name);
            assert_eq!(colliding_objects(&scene).count(), 7, "{} {k}", suite(loaded).name);
        }
    }
}

/// Lowest and highest value.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

/// Start region of an object over the episodes.
struct StartRegion {
    /// Centre, m.
    centre: [f64; 2],
    /// Largest deviation in x and y, m.
    max_offset: f64,
    /// Largest deviation of the yaw from its mean, rad.
    max_yaw: f64,
    /// Share of each range that must be covered.
    share: f64,
}

/// Checks that poses cover a region and do not leave it.
fn check_region(name: &str, poses: &[Pose], region: &StartRegion) {
    let (low, high) = range(poses.iter().map(|p| p.rotation.euler_angles().2));
    let ranges = [
        ("x", range(poses.iter().map(|p| p.translation.x - region.centre[0])), region.max_offset),
        ("y", range(poses.iter().map(|p| p.translation.y - region.centre[1])), region.max_offset),
        ("yaw", (low - 0.5 * (low + high), high - 0.5 * (low + high)), region.max_yaw),
    ];
    for (what, (low, high), most) in ranges {
        let inside = low >= -most - 1e-9 && high <= most + 1e-9;
        let covered = high - low >= region.share * 2.0 * most;
        assert!(inside && covered, "{name} {what}: {low:.4} to {high:.4} of ±{most:.4}");
    }
}

fn poses(scenes: &[Scene], name: &str) -> Vec<Pose> {
    scenes.iter().map(|scene| object(scene, name).pose_w).collect()
}

/// Checks that the start configurations of the arm vary with σ = 0.02 rad per joint.
fn check_arm_variation(scenes: &[Scene]) {
    let off: Vec<f64> = scenes.iter().flat_map(|s| (0..7).map(|i| s.start_q[i] - START_Q[i])).collect();
    let sigma = (off.iter().map(|x| x * x).sum::<f64>() / off.len() as f64).sqrt();
    // 350 draws: the standard error of σ is 4 %.
    assert!((sigma - 0.02).abs() < 0.0025, "arm: σ {sigma} rad");
}

/// Checks that the poses over all tasks, each relative to the centre of its task's region, cover a common region.
fn check_common_region(name: &str, all: &[Vec<Pose>], places: &[[f64; 2]], region: StartRegion) {
    let moved = all.iter().zip(places).flat_map(|(poses, at)| {
        let back = Vec3::new(-at[0], -at[1], 0.0);
        poses.iter().map(move |pose| Pose::from_parts((pose.translation.vector + back).into(), pose.rotation))
    });
    check_region(name, &moved.collect::<Vec<_>>(), &region);
}

#[test]
fn soft_targets_on_the_floor_start_within_20_mm_and_30_degrees() {
    let loaded = load("object_soft");
    let (mut all, mut middles, mut arms) = (Vec::new(), Vec::new(), Vec::new());
    for (k, task) in suite(&loaded).tasks.iter().enumerate() {
        let scenes: Vec<Scene> =
            (0..STANDARD as u32).map(|episode| open(&loaded, k, episode, EpisodeSplit::Validation)).collect();
        all.push(poses(&scenes, &task.object));
        middles.push(if FAR.contains(&k) { [-0.12, -0.24] } else { [0.05, -0.10] });
        arms.extend(scenes);
    }
    let region = |max_yaw| StartRegion { centre: [0.0; 2], max_offset: 0.020, max_yaw, share: 0.85 };
    check_common_region("targets", &all, &middles, region(30f64.to_radians()));
    check_arm_variation(&arms);
}

/// Tasks of LIBERO's object suite with the target in the far start region.
const FAR: [usize; 5] = [0, 4, 6, 7, 8];

/// Episodes per task in the standard fifty of a suite.
const STANDARD: usize = 5;

#[test]
fn both_objects_of_a_pair_start_within_20_mm_and_30_degrees() {
    let loaded = load("spatial_soft");
    for task in [0, 2, 4, 6, 8] {
        let scenes: Vec<Scene> =
            (0..60).map(|episode| open(&loaded, task, episode, EpisodeSplit::Validation)).collect();
        for side in ["left", "right"] {
            let poses = poses(&scenes, side);
            let middle = |axis: usize| {
                let (low, high) = range(poses.iter().map(|p| p.translation.vector[axis]));
                0.5 * (low + high)
            };
            let max_yaw = 30f64.to_radians();
            // 60 uniform draws cover less than 0.9 of the range with a probability of about 1 %.
            let region =
                StartRegion { centre: [middle(0), middle(1)], max_offset: 0.020, max_yaw, share: 0.9 };
            check_region(side, &poses, &region);
        }
        check_arm_variation(&scenes);
    }
}

#[test]
fn rigid_objects_start_in_the_regions_of_libero() {
    let standard = |loaded: &LoadedScript, task: usize| -> Vec<Scene> {
        (0..STANDARD as u32).map(|episode| open(loaded, task, episode, EpisodeSplit::Validation)).collect()
    };
    let loaded = load("object_rigid");
    let others = [[-0.15, 0.06], [0.10, -0.20], [0.15, 0.03], [-0.20, -0.08]];
    let (near, far) = ([0.05, -0.10], [-0.12, -0.24]);
    let (mut targets, mut groceries, mut baskets, mut arms) = Default::default();
    let (mut own_places, mut places): (Vec<[f64; 2]>, Vec<[f64; 2]>) = Default::default();
    for (k, [target, first, rest @ ..]) in GROCERIES.iter().enumerate() {
        let scenes = standard(&loaded, k);
        let (own, other) = if FAR.contains(&k) { (far, near) } else { (near, far) };
        for (name, at) in [(*first, other)].into_iter().chain(rest.iter().copied().zip(others)) {
            Vec::push(&mut groceries, poses(&scenes, name));
            places.push(at);
        }
        Vec::push(&mut targets, poses(&scenes, target));
        own_places.push(own);
        Vec::extend(&mut baskets, poses(&scenes, "basket"));
        Vec::extend(&mut arms, scenes);
    }
    let region = |centre, max_offset| StartRegion { centre, max_offset, max_yaw: 0.0, share: 0.85 };
    check_common_region("targets", &targets, &own_places, region([0.0; 2], 0.025));
    check_common_region("distractors", &groceries, &places, region([0.0; 2], 0.025));
    check_region("basket", &baskets, &region([0.0, 0.26], 0.010));
    check_arm_variation(&arms);
    let loaded = load("spatial_rigid");
    let scenes: Vec<Scene> = (0..10).flat_map(|k| standard(&loaded, k)).collect();
    for (name, at) in [("plate", [0.06, 0.20]), ("cookies", [0.07, 0.03]), ("ramekin", [-0.20, 0.20])] {
        check_region(name, &poses(&scenes, name), &region(at, 0.010));
    }
    let cabinet = StartRegion { max_yaw: 0.03, ..region([0.03, -0.27], 0.010) };
    check_region("cabinet", &poses(&scenes, "cabinet"), &cabinet);
    check_region("stove", &poses(&scenes, "stove"), &region([-0.41, -0.14], 0.010));
    check_arm_variation(&scenes);
}

#[test]
fn the_target_bowl_is_where_the_prompt_says() {
    let loaded = load("spatial_rigid");
    for (k, place) in RELATIONS.iter().enumerate() {
        for episode in 0..10 {
            let scene = open(&loaded, k, episode, EpisodeSplit::Validation);
            let at = |name: &str| object(&scene, name).pose_w.translation.vector;
            let (bowl, other) = (at("bowl"), at("other_bowl"));
            let across = |a: Vec3, b: Vec3| (a - b).xy().norm();
            let on = |name: &str| across(bowl, at(name)) < 0.10 && bowl.z > 0.01;
            let beside = |name: &str| {
                let rest = ["plate", "cookies", "ramekin", "cabinet", "stove"].into_iter();
                let nearest = rest.min_by(|a, b| across(bowl, at(a)).total_cmp(&across(bowl, at(b))));
                nearest == Some(name) && bowl.z.abs() < 1e-9
            };
            let right = match *place {
                "between the plate and the ramekin" => {
                    let (from, to) = (at("ramekin").xy(), at("plate").xy());
                    let share = (bowl.xy() - from).dot(&(to - from)) / (to - from).norm_squared();
                    let aside = (bowl.xy() - from - (to - from) * share).norm();
                    (0.3..0.7).contains(&share) && aside < 0.05
                }
                "next to the ramekin" => beside("ramekin"),
                "next to the cookie box" => beside("cookies"),
                "next to the plate" => beside("plate"),
                "from table center" => bowl.xy().norm() < 0.1 && bowl.z.abs() < 1e-9,
                "on the cookie box" => on("cookies"),
                "on the ramekin" => on("ramekin"),
                "on the stove" => on("stove"),
                "on the wooden cabinet" => on("cabinet") && bowl.z > 0.2,
                _ => {
                    let cabinet = object(&scene, "cabinet");
                    cabinet.joints.iter().any(|joint| *joint > 0.1)
                        && bowl.z > 0.1
                        && across(bowl, other) > 0.1
                }
            };
            assert!(right, "{place}, episode {episode}: {bowl:?}");
        }
    }
}

#[test]
fn splits_have_disjoint_start_states() {
    for name in ["object_soft", "spatial_soft", "object_rigid", "spatial_rigid"] {
        let loaded = load(name);
        let states = |split| -> BTreeSet<Vec<u64>> {
            (0..EPISODES / 2)
                .map(|episode| {
                    let scene = open(&loaded, 0, episode, split);
                    let places = colliding_objects(&scene)
                        .flat_map(|o| o.pose_w.translation.vector.as_slice().to_vec());
                    places.chain(scene.start_q).map(f64::to_bits).collect()
                })
                .collect()
        };
        let (validation, demonstration) =
            (states(EpisodeSplit::Validation), states(EpisodeSplit::Demonstration));
        assert_eq!(
            (validation.len() as u32, demonstration.len() as u32),
            (EPISODES / 2, EPISODES / 2),
            "{name}"
        );
        assert!(validation.is_disjoint(&demonstration), "{name}");
    }
}

/// A placed shape with its bounds, which are expensive to compute.
struct PlacedShape<'a> {
    shape: &'a Shape,
    pose: Pose,
    low: Vec3,
    high: Vec3,
}

/// The shape of an object, and those of its parts.
fn placed_shapes(object: &Object) -> Vec<PlacedShape<'_>> {
    let parts = object.asset.parts();
    let placed = parts.iter().zip(part_poses(parts, &object.joints));
    let parts = placed.map(|(part, pose)| (&part.asset.shape, object.pose_w * pose));
    let all = std::iter::once((&object.asset.shape, object.pose_w)).chain(parts);
    all.map(|(shape, pose)| {
        let bounds = shape.bounds();
        PlacedShape { shape, pose, low: bounds.min, high: bounds.max }
    })
    .collect()
}

/// Largest depth (m) in `b` of the points of a grid in `a`; 0 if there is no overlap.
fn depth(a: &PlacedShape, b: &PlacedShape) -> f64 {
    const CELLS: usize = 16;
    let to_b = b.pose.inverse() * a.pose;
    let at = |index: usize| (index as f64 + 0.5) / CELLS as f64;
    let mut deepest: f64 = 0.0;
    for cell in 0..CELLS.pow(3) {
        let share = Vec3::new(at(cell % CELLS), at(cell / CELLS % CELLS), at(cell / CELLS / CELLS));
        let point = a.low + (a.high - a.low).component_mul(&share);
        let seen = (to_b * nalgebra::Point3::from(point)).coords;
        if (0..3).all(|axis| (b.low[axis]..b.high[axis]).contains(&seen[axis])) {
            let inside = -b.shape.distance(&seen);
            deepest = deepest.max(if inside > deepest { inside.min(-a.shape.distance(&point)) } else { 0.0 });
        }
    }
    deepest
}

#[test]
fn objects_do_not_overlap_at_the_start() {
    for name in ["object_soft", "spatial_soft", "object_rigid", "spatial_rigid"] {
        let loaded = load(name);
        for task in 0..10 {
            let scene = open(&loaded, task, 0, EpisodeSplit::Validation);
            let all: Vec<(&str, Vec<PlacedShape>)> =
                colliding_objects(&scene).map(|o| (o.name.as_str(), placed_shapes(o))).collect();
            for (i, (first, a)) in all.iter().enumerate() {
                for (second, b) in &all[i + 1..] {
                    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| depth(a, b).max(depth(b, a))));
                    let most = pairs.fold(0.0, f64::max);
                    // Stacked objects touch.
                    assert!(most < 2e-4, "{name} {task}: {first} overlaps {second} by {most} m");
                }
            }
        }
    }
}

#[test]
fn a_mass_shift_scales_the_mass_of_all_moving_bodies_and_nothing_else() {
    for (name, task) in [("spatial_rigid", 4), ("object_soft", 0)] {
        let loaded = load(name);
        let shifted = |shifts: &[(&str, f64)]| {
            let shifts: Vec<ShiftValue> =
                shifts.iter().map(|(name, value)| ((*name).to_owned(), *value).into()).collect();
            let suite = suite(&loaded).name.clone();
            let split = EpisodeSplit::Validation;
            let id = EpisodeId { suite, task, episode: 0, base_seed: 0, split };
            EpisodeSetup::open(&loaded, &id, &SceneChanges { shifts, ..SceneChanges::default() })
                .unwrap_or_else(|e| panic!("{e}"))
        };
        let EpisodeSetup { scene: heavy, nominal, .. } = shifted(&[("mass", 2.5)]);
        let mut moving = 0;
        for (before, after) in nominal.objects.iter().zip(&heavy.objects) {
            let parts = before.asset.parts().iter().zip(after.asset.parts());
            let parts = parts.map(|(a, b)| (Some(a.mass()), Some(b.mass()), b.asset.mass()));
            let whole = (before.asset.mass(), after.asset.mass(), after.asset.mass());
            for (light, heavy, same) in parts.chain([whole]) {
                assert_eq!((heavy, light.is_some()), (same, heavy.is_some()), "{}", before.name);
                let Some((light, heavy)) = light.zip(heavy) else { continue };
                assert!((heavy / light / 2.5 - 1.0).abs() < 1e-12, "{}: {light} kg, {heavy} kg", before.name);
                moving += 1;
            }
            assert_eq!(before.asset.shape, after.asset.shape);
        }
        assert!(moving >= 7, "{name}: {moving}");
        let EpisodeSetup { scene: same, nominal, .. } = shifted(&[("mass", 1.0), ("light", 1.0)]);
        assert_eq!(same, nominal);
    }
}
