//! The shipped assets: size, material, mass, meshes, samples and stability; and the start states of the Spatial-Soft
//! suite.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
    sync::Arc,
};

use softvt::{
    benchmark::{Goal, Placement, Plan, settings::Settings},
    episode_id::{EpisodeId, EpisodeSplit},
    geometry::{
        Pose, Vec3,
        mass::mass_properties,
        samples::{SampleSpec, surface_samples},
        voxel::{VoxelSpec, voxel_mesh},
    },
    rollout::{AssetCache, Sensors, Simulation},
    scene::{Asset, Body, EXPERT_HINTS, Mask, Scene},
    script::{self, EpisodeSetup, LoadedScript, SceneChanges},
};

/// Reference data of a soft asset.
struct SoftReference {
    name: &'static str,
    /// Extents along x, y, z.
    size_mm: [f64; 3],
    youngs_kpa: f64,
    poisson: f64,
    /// kg/m³.
    density: f64,
}

const fn soft(
    name: &'static str,
    size_mm: [f64; 3],
    youngs_kpa: f64,
    poisson: f64,
    density: f64,
) -> SoftReference {
    SoftReference { name, size_mm, youngs_kpa, poisson, density }
}

const SOFT: [SoftReference; 17] = [
    soft("spiral_roll", [58.0, 47.0, 40.0], 60.0, 0.35, 240.0),
    soft("steamed_bun", [66.0, 62.0, 44.0], 25.0, 0.30, 180.0),
    soft("twisted_stick", [120.0, 31.0, 28.0], 75.0, 0.36, 280.0),
    soft("long_roll", [120.0, 44.0, 38.0], 35.0, 0.32, 200.0),
    soft("small_ridged_roll", [62.0, 44.0, 34.0], 110.0, 0.38, 320.0),
    soft("sesame_bun", [64.0, 62.0, 42.0], 45.0, 0.34, 220.0),
    soft("croissant", [95.0, 46.0, 36.0], 160.0, 0.36, 260.0),
    soft("curved_layered", [88.0, 60.0, 36.0], 130.0, 0.38, 340.0),
    soft("braided_roll", [110.0, 48.0, 38.0], 90.0, 0.37, 300.0),
    soft("golden_bun", [60.0, 60.0, 42.0], 220.0, 0.36, 380.0),
    soft("oval_loaf", [84.0, 59.0, 44.0], 180.0, 0.37, 350.0),
    soft("yellow_roll", [70.0, 50.0, 46.0], 55.0, 0.34, 230.0),
    soft("cube", [56.0, 56.0, 56.0], 40.0, 0.40, 200.0),
    soft("cylinder", [53.0, 53.0, 60.0], 50.0, 0.40, 200.0),
    soft("wedge", [64.0, 50.0, 40.0], 50.0, 0.40, 220.0),
    soft("capsule", [78.0, 44.0, 44.0], 30.0, 0.40, 200.0),
    soft("sphere", [57.0, 57.0, 57.0], 60.0, 0.40, 200.0),
];
/// Largest difference between an extent of an asset and its reference, m.
const SIZE_TOLERANCE: f64 = 0.5e-3;

fn suite() -> LoadedScript {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("suites/spatial_soft.lua");
    script::load(&path, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn scene(loaded: &LoadedScript, task: usize, episode: u32) -> Scene {
    let Plan::Suite(suite) = &loaded.plan else { panic!("{:?}", loaded.plan) };
    let id =
        EpisodeId { suite: suite.name.clone(), task, episode, base_seed: 0, split: EpisodeSplit::Validation };
    EpisodeSetup::open(loaded, &id, &SceneChanges::default()).unwrap_or_else(|e| panic!("{e}")).scene
}

/// Assets by name, including the table.
fn assets(names: &[&str]) -> BTreeMap<String, Arc<Asset>> {
    let alone: Vec<&[&str]> = names.iter().map(std::slice::from_ref).collect();
    let objects = stacks(&alone).into_iter().flat_map(|scene| scene.objects);
    objects.map(|object| (object.asset.name.clone(), object.asset)).collect()
}

fn soft_assets() -> BTreeMap<String, Arc<Asset>> {
    assets(&SOFT.each_ref().map(|reference| reference.name))
}

#[test]
fn soft_assets_have_their_reference_size_and_material_and_rest_on_zero() {
    let assets = soft_assets();
    for SoftReference { name, size_mm, youngs_kpa, poisson, density } in SOFT {
        let asset = &assets[name];
        let bounds = asset.shape.bounds();
        let off = bounds.size() - Vec3::from(size_mm) * 1e-3;
        assert!(off.amax() < SIZE_TOLERANCE, "{name}: {:?} mm", bounds.size() * 1e3);
        assert!(bounds.min.z.abs() < SIZE_TOLERANCE, "{name}: lowest at {} m", bounds.min.z);
        assert!(bounds.centre().xy().amax() < SIZE_TOLERANCE, "{name}: centre at {:?}", bounds.centre());
        let Body::Soft(soft) = &asset.body else { panic!("{name} is not soft") };
        assert_eq!(
            (soft.elastic.youngs_pa(), soft.elastic.poisson(), soft.elastic.density()),
            (youngs_kpa * 1e3, poisson, density),
            "{name}"
        );
        assert_eq!((asset.friction.static_mu, asset.friction.dynamic_mu), (0.6, 0.5), "{name}");
    }
    assert!(assets["table"].shape.bounds().max.z.abs() < 1e-12);
}

#[test]
fn the_surface_hint_of_the_plate_is_its_height() {
    let plate = &assets(&["plate"])["plate"];
    let hint = plate.hints["surface_m"];
    for r in [0.0, 0.02, 0.04, 0.055] {
        let down = plate.shape.ray(&Vec3::new(r, 0.0, 0.1), &-Vec3::z(), 0.2).expect("a plate without holes");
        assert!((0.1 - down - hint).abs() < 1e-4, "at {r} m: {}", 0.1 - down);
    }
}

#[test]
fn soft_assets_have_voxel_meshes_and_closed_samplings() {
    let assets = soft_assets();
    for SoftReference { name, .. } in SOFT {
        let asset = &assets[name];
        let Body::Soft(soft) = &asset.body else { panic!("{name} is not soft") };
        let mesh = voxel_mesh(&asset.shape, &VoxelSpec { resolution: soft.resolution }).expect(name);
        let samples = surface_samples(&asset.shape, &mesh, &SampleSpec::default());
        // The oriented area of a closed surface vanishes.
        let area: f64 = samples.iter().map(|s| s.area).sum();
        let sum: Vec3 = samples.iter().map(|s| s.n_o * s.area).sum();
        assert!(sum.norm() < 0.01 * area, "{name}: {sum:?} of {area}");
        let off = samples.iter().map(|s| asset.shape.distance(&s.p_o).abs()).fold(0.0, f64::max);
        assert!(off < 0.3e-3, "{name}: a sample lies {off} m off the surface");
        let layers = asset.visuals.iter().flat_map(|visual| &visual.layers);
        let colours = asset.visuals.len() + layers.filter(|layer| layer.opacity > 0.0).count();
        assert!(colours >= 3, "{name} has {colours} colours");
    }
}

/// Bits of the node positions of all soft bodies after settling.
fn at_rest(scene: Scene, cache: &AssetCache) -> Vec<[u64; 3]> {
    let mut sim = Simulation::new(Arc::new(scene), &Default::default(), cache).expect("builds");
    sim.settle().unwrap_or_else(|e| panic!("{e}"));
    let bodies = sim.world.soft_bodies().iter();
    bodies.flat_map(|soft| soft.state.x.iter().map(|x| x.map(f64::to_bits).into())).collect()
}

#[test]
fn scenery_does_not_change_the_simulation() {
    let cache = AssetCache::default();
    let seen = scene(&suite(), 0, 0);
    let mut bare = seen.clone();
    bare.objects.retain(|object| object.asset.body != Body::Scenery);
    assert!(bare.objects.len() + 5 < seen.objects.len(), "the scene has scenery around the table");
    assert!(at_rest(seen, &cache) == at_rest(bare, &cache));
}

#[test]
fn layouts_settle_and_both_tasks_of_a_pair_share_their_start_state() {
    let loaded = suite();
    let cache = AssetCache::default();
    let settled = |task: usize| at_rest(scene(&loaded, task, 1), &cache);
    let mut seen = Vec::new();
    for pair in 0..5 {
        let state = settled(2 * pair);
        assert!(state == settled(2 * pair + 1), "pair {pair}");
        assert!(!seen.contains(&state), "two pairs with one state");
        seen.push(state);
    }
}

#[test]
fn left_and_right_are_as_in_the_image_and_prompts_name_the_goal() {
    let loaded = suite();
    let Plan::Suite(suite) = &loaded.plan else { panic!("{:?}", loaded.plan) };
    let (settings, cache) = (Settings::default(), AssetCache::default());
    assert_eq!(suite.tasks.len(), 10);
    for task in &suite.tasks {
        let Goal::On(Placement { object, target, .. }) = &task.goal else { panic!("task {}", task.id) };
        assert!(task.prompt.starts_with(&format!("pick up the {object} ")), "{}", task.prompt);
        assert_eq!(target, "plate");
        let scene = Arc::new(scene(&loaded, task.id, 0));
        let sim = Simulation::new(scene, &settings, &cache).expect("it builds");
        let mut senses = Sensors::new(&sim, &settings.tactile, &cache);
        let camera = senses.camera("third_person").expect("there").clone();
        let picture = senses.render(&Sensors::frame(&sim), &camera).expect("drawn");
        let column = |name: &str| {
            let id = sim.objects.iter().position(|o| o.name == name).expect("placed") as u16 + 1;
            let of = picture.segmentation.iter().enumerate().filter(|(_, s)| **s == id);
            let (sum, count) = of.fold((0, 0), |(sum, n), (at, _)| (sum + at % picture.width, n + 1));
            assert!(count > 50, "task {}: {name} fills {count} pixels", task.id);
            sum as f64 / f64::from(count)
        };
        assert!(column("left") < 100.0 && column("right") > 124.0, "task {}", task.id);
        assert!(column("left") < column("plate") && column("plate") < column("right"));
    }
}

/// Reference data of a rigid asset.
struct RigidReference {
    name: &'static str,
    /// Extents along x, y, z.
    size_mm: [f64; 3],
    /// 100 kg/m³ times the volume of the bounding box, as in LIBERO.
    mass_g: f64,
}

const fn rigid(name: &'static str, size_mm: [f64; 3], mass_g: f64) -> RigidReference {
    RigidReference { name, size_mm, mass_g }
}

const RIGID: [RigidReference; 15] = [
    rigid("alphabet_soup", [62.0, 62.0, 76.0], 29.2),
    rigid("basket", [170.0, 157.0, 142.0], 379.0),
    rigid("bbq_sauce", [47.0, 29.0, 107.0], 14.6),
    rigid("black_bowl", [107.0, 107.0, 51.0], 58.4),
    rigid("butter", [76.0, 40.0, 17.0], 5.2),
    rigid("chocolate_pudding", [80.0, 46.0, 27.0], 9.9),
    rigid("cookies", [62.0, 83.0, 19.0], 9.8),
    rigid("cream_cheese", [81.0, 43.0, 18.0], 6.3),
    rigid("ketchup", [56.0, 37.0, 146.0], 30.3),
    rigid("milk", [53.0, 53.0, 131.0], 36.8),
    rigid("orange_juice", [53.0, 53.0, 131.0], 36.8),
    rigid("plate", [138.0, 138.0, 19.0], 36.2),
    rigid("ramekin", [89.0, 89.0, 42.0], 33.3),
    rigid("salad_dressing", [53.0, 36.0, 146.0], 27.9),
    rigid("tomato_sauce", [62.0, 62.0, 76.0], 29.2),
];
/// One scene per stack of assets: each asset lies on the one before, the first on the table.
fn stacks(stacks: &[&[&str]]) -> Vec<Scene> {
    let folder = tempfile::tempdir().expect("a folder");
    let list: Vec<String> =
        stacks.iter().map(|names| format!("{{ \"{}\" }}", names.join("\", \""))).collect();
    let text = include_str!("data/stacks.lua").replace("STACKS", &list.join(", "));
    let path = folder.path().join("stacks.lua");
    std::fs::write(&path, text).expect("is written");
    let loaded = script::load(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
    (0..stacks.len()).map(|task| scene(&loaded, task, 0)).collect()
}

#[test]
fn the_hints_of_experts_are_those_that_the_standard_experts_read() {
    let mut read = BTreeSet::new();
    for entry in std::fs::read_dir("scripts/experts").expect("is a folder") {
        let text = std::fs::read_to_string(entry.expect("is readable").path()).expect("is text");
        let names = text.split("hints.").skip(1);
        read.extend(names.map(|rest| {
            rest.split(|c: char| c != '_' && !c.is_alphanumeric()).next().unwrap_or("").to_owned()
        }));
    }
    let known = EXPERT_HINTS.map(str::to_owned);
    assert_eq!(read, BTreeSet::from(known));
}

fn rigid_assets() -> Vec<Arc<Asset>> {
    let scenes = stacks(&RIGID.each_ref().map(|reference| std::slice::from_ref(&reference.name)));
    scenes.into_iter().map(|scene| scene.objects[1].asset.clone()).collect()
}

#[test]
fn rigid_assets_have_their_reference_size_and_mass_and_rest_on_zero() {
    for (asset, RigidReference { name, size_mm, mass_g }) in rigid_assets().iter().zip(RIGID) {
        let bounds = asset.shape.bounds();
        assert!(
            (bounds.size() - Vec3::from(size_mm) * 1e-3).amax() < SIZE_TOLERANCE,
            "{name}: {:?}",
            bounds.size()
        );
        assert!(bounds.min.z.abs() < SIZE_TOLERANCE, "{name}: lowest at {} m", bounds.min.z);
        assert!(bounds.centre().xy().amax() < SIZE_TOLERANCE, "{name}: centre at {:?}", bounds.centre());
        let Body::Rigid { density } = asset.body else { panic!("{name} is not rigid") };
        let mass = 1e3 * mass_properties(&asset.shape, density).mass;
        assert!((mass / mass_g - 1.0).abs() < 0.03, "{name}: {mass} g for {mass_g} g");
        assert_eq!((asset.friction.static_mu, asset.friction.dynamic_mu), (0.6, 0.5), "{name}");
    }
}

#[test]
fn packages_show_their_name() {
    fn collect_text(mask: &Mask, words: &mut Vec<String>) {
        match mask {
            Mask::Text { decal } => words.push(decal.line.text.to_lowercase()),
            Mask::Product { masks } => masks.iter().for_each(|mask| collect_text(mask, words)),
            Mask::Inverse { mask } => collect_text(mask, words),
            _ => {}
        }
    }
    let bare = ["basket", "black_bowl", "plate", "ramekin"];
    for asset in rigid_assets().iter().filter(|asset| !bare.contains(&asset.name.as_str())) {
        let mut words = Vec::new();
        let layers = asset.visuals.iter().flat_map(|visual| &visual.layers);
        layers.for_each(|layer| collect_text(&layer.mask, &mut words));
        // Packages show a part of the name, or all of it on several lines.
        let shown = asset.name.split('_').filter(|part| words.iter().any(|word| word.contains(part))).count();
        assert!(shown > 0, "{}: {words:?}", asset.name);
    }
}

#[test]
fn bowl_basket_and_ramekin_are_hollow_with_walls_of_4_mm() {
    let assets = rigid_assets();
    let of = |name: &str| assets.iter().find(|asset| asset.name == name).expect("an asset");
    for (name, at, inside) in [("black_bowl", 0.04, 0.04), ("basket", 0.05, 0.06), ("ramekin", 0.03, 0.036)] {
        let shape = &of(name).shape;
        assert!(shape.distance(&Vec3::new(0.0, 0.0, at)) > 0.01, "{name} is hollow");
        for turn in [0.0_f64, 0.4, 0.8, 1.3, 2.0, 4.0] {
            let direction = Vec3::new(turn.cos(), turn.sin(), 0.0);
            let from = Vec3::z() * at;
            // Small steps, since walls are thin and distances are of first order away from the surface.
            let wall = (0..2000).map(|step| 1e-4 * f64::from(step));
            let wall: Vec<f64> = wall.filter(|r| shape.distance(&(from + direction * *r)) < 0.0).collect();
            let (inner, outer) = (wall[0], wall[wall.len() - 1]);
            assert!(inner > inside, "{name}: inner radius {inner} m");
            assert!(outer - inner > 4e-3 * 0.95, "{name}: a wall of {} m", outer - inner);
        }
    }
}

#[test]
fn rigid_assets_stay_at_rest_alone_and_stacked() {
    let alone = RIGID.each_ref().map(|reference| std::slice::from_ref(&reference.name));
    let mut all: Vec<&[&str]> = alone.to_vec();
    all.extend([["ramekin", "black_bowl"].as_slice(), &["cookies", "black_bowl"], &["plate", "black_bowl"]]);
    for (scene, names) in stacks(&all).into_iter().zip(all) {
        let upright: Vec<f64> = scene.objects.iter().map(|object| object.pose_w.translation.z).collect();
        let mut sim =
            Simulation::new(Arc::new(scene), &Default::default(), &AssetCache::default()).expect("builds");
        sim.settle().unwrap_or_else(|e| panic!("{names:?}: {e}"));
        let settled: Vec<Pose> = sim.objects.iter().map(|object| sim.pose(object)).collect();
        for _ in 0..120 {
            sim.step().unwrap_or_else(|e| panic!("{names:?}: {e}"));
        }
        for ((object, before), start) in sim.objects.iter().zip(&settled).zip(upright) {
            let after = sim.pose(object);
            let moved = (after.translation.vector - before.translation.vector).norm();
            let turned = after.rotation.angle_to(&before.rotation);
            assert!(
                moved < 5e-5 && turned < 1e-3,
                "{names:?}: {} moved {moved} m, {turned} rad",
                object.name
            );
            // A bowl sinks into a ramekin and into the well of a plate; all other heights stay.
            let sunk = start - after.translation.z;
            let limit = if ["ramekin", "plate"].contains(&names[0]) { 0.014 } else { 5e-4 };
            assert!((-1e-4..limit).contains(&sunk), "{names:?}: {} sank by {sunk} m", object.name);
            assert!((after.rotation * Vec3::z()).z > 0.9999, "{names:?}: {} tilts", object.name);
        }
    }
}

#[test]
fn the_floor_is_static_with_its_top_at_zero() {
    let floor = stacks(&[&["floor"]]).remove(0).objects.remove(1).asset;
    assert!(floor.shape.bounds().max.z.abs() < 1e-12 && floor.body == Body::Static);
}

#[test]
fn calibrations_belong_to_the_shipped_soft_assets() {
    let assets = soft_assets();
    for SoftReference { name, .. } in SOFT {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("assets/calibration/{name}.json"));
        let text = std::fs::read_to_string(path).expect("a calibration");
        assert!(
            text.contains(&format!("\"{}\"", assets[name].fingerprint())),
            "the calibration of {name} is of another asset"
        );
    }
}
