//! The forty tasks: prompts, who stands where and how far that varies, splits apart, and nothing in anything else. Scenes are
//! opened, not simulated.

use std::{collections::BTreeSet, path::Path};

use softvt::{
    benchmark::{Goal, Plan, Suite, Task, seed::Split},
    geometry::{Pose, Vec3, shape::Shape},
    scene::{Body, Object, Scene, part_poses},
    script::{self, Episode, EpisodeRequest, Loaded},
};

/// Episodes of the large protocol.
const EPISODES: u64 = 50;
/// The nominal start pose of the arm, rad (facts of the released code).
const START_Q: [f64; 7] = [-0.01988, -0.18734, 0.00767, -2.40340, 0.00496, 2.24534, 0.79485];

/// What the paper prints for Object-Soft; it calls four of its pastries just that.
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
/// Spatial-Soft's, with their sides.
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
/// LIBERO's object suite: target and distractors in the order of its files.
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
/// LIBERO's spatial suite: where the bowl is.
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

fn load(name: &str) -> Loaded {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("suites/{name}.lua"));
    script::load(&path, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn suite(loaded: &Loaded) -> &Suite {
    let Plan::Suite(suite) = &loaded.plan else { panic!("{:?}", loaded.plan) };
    suite
}

fn open(loaded: &Loaded, task: usize, episode: u64, split: Split) -> Scene {
    let suite = suite(loaded).name.clone();
    let request = EpisodeRequest { suite, task, episode, base_seed: 0, split, shifts: Vec::new() };
    Episode::open(loaded, &request).unwrap_or_else(|e| panic!("{e}")).scene
}

fn object<'a>(scene: &'a Scene, name: &str) -> &'a Object {
    scene.objects.iter().find(|o| o.name == name).unwrap_or_else(|| panic!("no {name}"))
}

/// What is more than a picture and less than the ground.
fn things(scene: &Scene) -> impl Iterator<Item = &Object> {
    let ground = ["table", "floor"];
    scene.objects.iter().filter(move |o| o.asset.body != Body::Scenery && !ground.contains(&o.name.as_str()))
}

#[test]
fn forty_tasks_have_the_prompts_of_the_paper_and_ask_for_what_they_say() {
    let prompts = |name: &str, says: fn(usize) -> String| {
        let loaded = load(name);
        let tasks: &[Task] = &suite(&loaded).tasks;
        assert_eq!(tasks.len(), 10, "{name}");
        for (k, task) in tasks.iter().enumerate() {
            assert_eq!(task.prompt, says(k), "{name}");
            let (Goal::On { object: what, target, .. } | Goal::In { object: what, target, .. }) = &task.goal;
            let inside = matches!(task.goal, Goal::In { .. });
            let place = if inside { format!("in the {target}") } else { format!("on the {target}") };
            assert!(task.prompt.ends_with(&place), "{name} {k}: {target}");
            let scene = open(&loaded, k, 0, Split::Validation);
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
        "no prompt stands twice but the one that the paper repeats"
    );
}

#[test]
fn object_suites_have_the_same_distractors_task_by_task_and_they_are_liberos() {
    let (rigid, soft) = (load("object_rigid"), load("object_soft"));
    for (k, [target, distractors @ ..]) in GROCERIES.iter().enumerate() {
        for (loaded, target) in [(&rigid, *target), (&soft, suite(&soft).tasks[k].goal.object())] {
            let scene = open(loaded, k, 0, Split::Validation);
            let found: BTreeSet<&str> = things(&scene).map(|o| o.asset.name.as_str()).collect();
            let expected: BTreeSet<&str> = distractors.iter().copied().chain([target, "basket"]).collect();
            assert_eq!(found, expected, "{} {k}", suite(loaded).name);
            assert_eq!(things(&scene).count(), 7, "{} {k}", suite(loaded).name);
        }
    }
}

/// How far one number goes over the episodes: its lowest and highest value.
fn ends(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

/// Where an object stands over the episodes must fill a region about `at` (m), `reach` (m) either way, and turn by `turn`
/// (rad) either way about `yaw`. `share` of each range must be covered, and nothing may lie beyond it.
struct Region {
    at: [f64; 2],
    reach: f64,
    turn: f64,
    share: f64,
}

fn fills(name: &str, poses: &[Pose], region: &Region) -> Result<(), String> {
    let yaw = poses.iter().map(|p| p.rotation.euler_angles().2);
    let (low, high) = ends(yaw);
    let ranges = [
        ("x", ends(poses.iter().map(|p| p.translation.x - region.at[0])), region.reach),
        ("y", ends(poses.iter().map(|p| p.translation.y - region.at[1])), region.reach),
        ("yaw", (low - 0.5 * (low + high), high - 0.5 * (low + high)), region.turn),
    ];
    for (what, (low, high), most) in ranges {
        let inside = low >= -most - 1e-9 && high <= most + 1e-9;
        if !inside || high - low < region.share * 2.0 * most {
            return Err(format!("{name} {what}: {low:.4} to {high:.4} of ±{most:.4}"));
        }
    }
    Ok(())
}

fn poses(scenes: &[Scene], name: &str) -> Vec<Pose> {
    scenes.iter().map(|scene| object(scene, name).pose_w).collect()
}

/// The arm starts elsewhere each time, σ 0.02 rad a joint.
fn arm_varies(scenes: &[Scene]) -> Result<(), String> {
    let off: Vec<f64> = scenes.iter().flat_map(|s| (0..7).map(|i| s.start_q[i] - START_Q[i])).collect();
    let sigma = (off.iter().map(|x| x * x).sum::<f64>() / off.len() as f64).sqrt();
    // 350 draws: the standard error of σ is 4 %.
    if (sigma - 0.02).abs() < 0.0025 { Ok(()) } else { Err(format!("arm: σ {sigma} rad")) }
}

/// All poses that one thing takes over tasks, each from the middle of its own region: the whole of it must be used.
fn together(name: &str, all: &[Vec<Pose>], places: &[[f64; 2]], region: Region) {
    let moved = all.iter().zip(places).flat_map(|(poses, at)| {
        let back = Vec3::new(-at[0], -at[1], 0.0);
        poses.iter().map(move |pose| Pose::from_parts((pose.translation.vector + back).into(), pose.rotation))
    });
    fills(name, &moved.collect::<Vec<_>>(), &region).unwrap_or_else(|e| panic!("{e}"));
}

/// Those of Spatial-Soft are in `tests/assets.rs`.
#[test]
fn soft_targets_on_the_floor_start_anywhere_within_20_mm_and_30_degrees_over_the_fifty_standard_episodes() {
    let loaded = load("object_soft");
    let (mut all, mut middles, mut arms) = (Vec::new(), Vec::new(), Vec::new());
    for (k, task) in suite(&loaded).tasks.iter().enumerate() {
        let scenes: Vec<Scene> =
            (0..STANDARD as u64).map(|episode| open(&loaded, k, episode, Split::Validation)).collect();
        all.push(poses(&scenes, task.goal.object()));
        middles.push(if FAR.contains(&k) { [-0.12, -0.24] } else { [0.05, -0.10] });
        arms.extend(scenes);
    }
    let region = |turn| Region { at: [0.0; 2], reach: 0.020, turn, share: 0.85 };
    together("targets", &all, &middles, region(30f64.to_radians()));
    arm_varies(&arms).unwrap_or_else(|e| panic!("{e}"));
}

/// Tasks of LIBERO's object suite whose target stands on its first slot.
const FAR: [usize; 5] = [0, 4, 6, 7, 8];

/// Episodes a task of the standard fifty of a suite.
const STANDARD: usize = 5;

#[test]
fn rigid_things_start_anywhere_in_liberos_regions_over_the_fifty_standard_episodes() {
    let standard = |loaded: &Loaded, task: usize| -> Vec<Scene> {
        (0..STANDARD as u64).map(|episode| open(loaded, task, episode, Split::Validation)).collect()
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
    let region = |at, reach| Region { at, reach, turn: 0.0, share: 0.85 };
    together("targets", &targets, &own_places, region([0.0; 2], 0.025));
    together("distractors", &groceries, &places, region([0.0; 2], 0.025));
    fills("basket", &baskets, &region([0.0, 0.26], 0.010)).unwrap_or_else(|e| panic!("{e}"));
    arm_varies(&arms).unwrap_or_else(|e| panic!("{e}"));
    let loaded = load("spatial_rigid");
    let scenes: Vec<Scene> = (0..10).flat_map(|k| standard(&loaded, k)).collect();
    for (name, at) in [("plate", [0.06, 0.20]), ("cookies", [0.07, 0.03]), ("ramekin", [-0.20, 0.20])] {
        fills(name, &poses(&scenes, name), &region(at, 0.010)).unwrap_or_else(|e| panic!("{e}"));
    }
    let cabinet = Region { turn: 0.03, ..region([0.03, -0.27], 0.010) };
    fills("cabinet", &poses(&scenes, "cabinet"), &cabinet).unwrap_or_else(|e| panic!("{e}"));
    fills("stove", &poses(&scenes, "stove"), &region([-0.41, -0.14], 0.010))
        .unwrap_or_else(|e| panic!("{e}"));
    arm_varies(&scenes).unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn the_bowl_that_is_meant_stands_where_the_prompt_says() {
    let loaded = load("spatial_rigid");
    for (k, place) in RELATIONS.iter().enumerate() {
        for episode in 0..10 {
            let scene = open(&loaded, k, episode, Split::Validation);
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
fn episodes_of_another_split_start_from_other_states() {
    for name in ["object_soft", "spatial_soft", "object_rigid", "spatial_rigid"] {
        let loaded = load(name);
        let states = |split| -> BTreeSet<Vec<u64>> {
            (0..EPISODES / 2)
                .map(|episode| {
                    let scene = open(&loaded, 0, episode, split);
                    let places = things(&scene).flat_map(|o| o.pose_w.translation.vector.as_slice().to_vec());
                    places.chain(scene.start_q).map(f64::to_bits).collect()
                })
                .collect()
        };
        let (validation, demonstration) = (states(Split::Validation), states(Split::Demonstration));
        assert_eq!(
            (validation.len() as u64, demonstration.len() as u64),
            (EPISODES / 2, EPISODES / 2),
            "{name}"
        );
        assert!(validation.is_disjoint(&demonstration), "{name}");
    }
}

/// A solid in the world, with the corners of its bounding box in its own frame, which take long to find.
struct Solid<'a> {
    shape: &'a Shape,
    pose: Pose,
    low: Vec3,
    high: Vec3,
}

/// Base and parts of furniture, or the one solid that an object is.
fn solids(object: &Object) -> Vec<Solid<'_>> {
    let parts = object.asset.parts();
    let placed = parts.iter().zip(part_poses(parts, &object.joints));
    let parts = placed.map(|(part, pose)| (&part.asset.shape, object.pose_w * pose));
    let all = std::iter::once((&object.asset.shape, object.pose_w)).chain(parts);
    all.map(|(shape, pose)| {
        let bounds = shape.bounds();
        Solid { shape, pose, low: bounds.min, high: bounds.max }
    })
    .collect()
}

/// How deep a point of `a` on a grid lies in `b`, m; 0 if none does.
fn depth(a: &Solid, b: &Solid) -> f64 {
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
fn nothing_stands_in_anything_else_at_the_start() {
    for name in ["object_soft", "spatial_soft", "object_rigid", "spatial_rigid"] {
        let loaded = load(name);
        for task in 0..10 {
            let scene = open(&loaded, task, 0, Split::Validation);
            let all: Vec<(&str, Vec<Solid>)> = things(&scene).map(|o| (o.name.as_str(), solids(o))).collect();
            for (i, (first, a)) in all.iter().enumerate() {
                for (second, b) in &all[i + 1..] {
                    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| depth(a, b).max(depth(b, a))));
                    let most = pairs.fold(0.0, f64::max);
                    // What is put on something touches it.
                    assert!(most < 2e-4, "{name} {task}: {first} is {most} m in {second}");
                }
            }
        }
    }
}

#[test]
fn a_mass_shift_makes_all_that_moves_heavier_parts_of_furniture_too_and_nothing_else() {
    for (name, task) in [("spatial_rigid", 4), ("object_soft", 0)] {
        let loaded = load(name);
        let shifted = |shifts: &[(&str, f64)]| {
            let shifts = shifts.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
            let suite = suite(&loaded).name.clone();
            let split = Split::Validation;
            let request = EpisodeRequest { suite, task, episode: 0, base_seed: 0, split, shifts };
            Episode::open(&loaded, &request).unwrap_or_else(|e| panic!("{e}"))
        };
        let Episode { scene: heavy, nominal, .. } = shifted(&[("mass", 2.5)]);
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
        let Episode { scene: same, nominal, .. } = shifted(&[("mass", 1.0), ("light", 1.0)]);
        assert_eq!(same, nominal);
    }
}
