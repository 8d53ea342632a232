//! Articulated objects of the benchmark: the cabinet with its drawers, and the stove with its knob.

use std::sync::Arc;

use softvt::{
    episode_id::{EpisodeId, EpisodeSplit},
    geometry::Vec3,
    physics::{BodyId, ContactPartner, LinkId, world::JointDrive},
    robot::tactile::TactileSpec,
    rollout::{AssetCache, ObjectInstance, Sensors, Simulation, state_hash},
    scene::{Asset, Camera, Scene},
    script::{self, EpisodeSetup, SceneChanges},
};

/// A cabinet facing −y with its top drawer open, a bowl of 107 mm in the drawer, and a stove.
const SUITE: &str = r#"
local table_top, cabinet, stove = require "assets.table", require "assets.wooden_cabinet", require "assets.flat_stove"
local bowl = softvt.asset {
  name = "bowl", body = softvt.rigid { density = 1500 },
  shape = softvt.shape.lathe { corners = {
    { 0, 0 }, { 0.027, 0 }, { 0.0535, 0.048 }, { 0.049, 0.048 }, { 0.025, 0.005 }, { 0, 0.005 },
  } },
}
local layout = softvt.layout("kitchen", function(scene)
  scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
  scene:add { name = "cabinet", asset = cabinet, at = { 0, 0.2 }, joints = { top_drawer = 0.12 } }
  scene:add { name = "stove", asset = stove, at = { 0, -0.3 }, joints = { knob = 1 } }
  scene:add { name = "bowl", asset = bowl, at = { 0, 0.2 - 0.0805 - 0.06 }, on = "cabinet.top_drawer" }
end)
return softvt.suite { name = "kitchen", object_type = "rigid", tasks_differ_in = "spatial", tasks = { softvt.task {
  prompt = "wait", layout = layout, goal = softvt.on { object = "bowl", target = "stove" },
} } }
"#;

fn scene() -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("kitchen.lua");
    std::fs::write(&path, SUITE).expect("written");
    let loaded = script::load(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
    let id = EpisodeId {
        suite: "kitchen".into(),
        task: 0,
        episode: 0,
        base_seed: 0,
        split: EpisodeSplit::Validation,
    };
    EpisodeSetup::open(&loaded, &id, &SceneChanges::default()).unwrap_or_else(|e| panic!("{e}")).scene
}

/// The simulation of the scene, settled.
fn settled() -> Simulation {
    let sim = Simulation::new(Arc::new(scene()), &Default::default(), &AssetCache::default());
    let mut sim = sim.unwrap_or_else(|e| panic!("{e}"));
    sim.settle().unwrap_or_else(|e| panic!("{e}"));
    sim
}

fn run(sim: &mut Simulation, seconds: f64) {
    (0..(60.0 * seconds) as usize).for_each(|_| sim.step().expect("a step that converges"));
}

fn object<'a>(sim: &'a Simulation, name: &str) -> &'a ObjectInstance {
    sim.object(name).unwrap_or_else(|| panic!("no {name}"))
}

/// The link of a part.
fn link(sim: &Simulation, name: &str) -> LinkId {
    let BodyId::Link(link) = object(sim, name).body else { panic!("{name} is not a part") };
    link
}

/// Pushes a joint at a speed (m/s or rad/s) with at most `effort` (N or N m), like a finger.
fn push(sim: &mut Simulation, link: LinkId, target_velocity: f64, effort: f64) {
    let articulation = sim.world.articulation_mut(link.articulation);
    articulation.drives_mut()[link.index] =
        Some(JointDrive { kp: 0.0, kd: 1e3, target: 0.0, target_velocity, effort });
}

/// Size of an asset with all joints at 0, m.
fn size(asset: &Asset) -> Vec3 {
    let parts = asset.parts().iter().map(|part| part.asset.shape.bounds());
    let all = parts.fold(asset.shape.bounds(), |mut all, next| {
        (all.min, all.max) = (all.min.inf(&next.min), all.max.sup(&next.max));
        all
    });
    assert!(all.centre().xy().norm() < 1e-6 && all.min.z.abs() < 1e-6, "{all:?}");
    all.size()
}

#[test]
fn articulated_objects_have_the_sizes_of_libero() {
    let scene = scene();
    for (index, expected) in [(1, Vec3::new(0.255, 0.221, 0.218)), (2, Vec3::new(0.19, 0.19, 0.07))] {
        let asset = &scene.objects[index].asset;
        assert!((size(asset) - expected).amax() < 5e-4, "{}: {:?}", asset.name, size(asset));
    }
}

#[test]
fn a_bowl_rests_in_an_open_drawer_and_all_bodies_fall_asleep() {
    let mut sim = settled();
    run(&mut sim, 1.0);
    let drawer = object(&sim, "cabinet.top_drawer");
    assert!((sim.joint(drawer).expect("a joint") - 0.12).abs() < 1e-5);
    let bowl = object(&sim, "bowl");
    let weight = 9.81 * sim.world.rigid_bodies()[0].state.mass;
    let carried = sim.contact(bowl, ContactPartner::Collider(drawer.colliders[0])).force_w.z;
    assert!((carried / weight - 1.0).abs() < 0.01, "the drawer carries {carried} of {weight} N");
    let [cabinet, stove] = ["cabinet.top_drawer", "stove.knob"].map(|name| link(&sim, name).articulation);
    assert!(sim.world.rigid_bodies()[0].is_asleep(), "the bowl");
    assert!(
        sim.world.articulation(cabinet).is_asleep() && sim.world.articulation(stove).is_asleep(),
        "cabinet and stove"
    );
    assert!(!sim.world.articulation(sim.robot.articulation).is_asleep(), "the robot");
}

#[test]
fn a_pushed_drawer_carries_its_bowl_and_moves_in_images() {
    let mut sim = settled();
    let link = link(&sim, "cabinet.top_drawer");
    let mut senses = Sensors::new(&sim, &TactileSpec::default(), &AssetCache::default());
    let camera = Camera { width: 160, height: 160, ..Camera::third_person_table() };
    let drawer = 1 + sim.objects.iter().position(|o| o.name == "cabinet.top_drawer").expect("a part") as u16;
    let mut column = |sim: &Simulation| {
        let seen = senses.render(&Sensors::frame(sim), &camera).expect("an image").segmentation;
        let columns = seen.iter().enumerate().filter(|(_, id)| **id == drawer).map(|(i, _)| (i % 160) as f64);
        let count = columns.clone().count();
        assert!(count > 50, "{count} pixels of the drawer");
        columns.sum::<f64>() / count as f64
    };
    let (before, seen) = (sim.centre(object(&sim, "bowl")), column(&sim));
    // Push the drawer closed, slowly enough for the friction of the bowl, whose limit is 0.5 × 9.81 m/s².
    for step in 1..=36 {
        push(&mut sim, link, f64::max(-0.02 * f64::from(step), -0.15), 20.0);
        run(&mut sim, 1.0 / 60.0);
    }
    sim.world.articulation_mut(link.articulation).drives_mut()[link.index] = None;
    run(&mut sim, 1.0);
    let moved = 0.12 - sim.world.articulation(link.articulation).state.q[link.index];
    let along = sim.centre(object(&sim, "bowl")) - before;
    assert!(moved > 0.04, "pushed by {moved} m");
    assert!((along.y - moved).abs() < 2e-3 && along.x.abs() < 1e-3, "{moved} m, the bowl by {along:?}");
    // Image right is +y.
    assert!(column(&sim) > seen + 3.0, "{} after {seen}", column(&sim));
}

#[test]
fn a_knob_turns_within_its_limits_and_stops() {
    let mut sim = settled();
    let link = link(&sim, "stove.knob");
    let set = sim.world.articulation(link.articulation).state.q[link.index];
    assert!((set - 1.0).abs() < 1e-6, "friction keeps the knob where it was set: {set}");
    push(&mut sim, link, 4.0, 1.0);
    run(&mut sim, 2.0);
    sim.world.articulation_mut(link.articulation).drives_mut()[link.index] = None;
    run(&mut sim, 1.0);
    let q = sim.world.articulation(link.articulation).state.q[link.index];
    assert!((1.4 * std::f64::consts::PI..=1.5 * std::f64::consts::PI + 1e-3).contains(&q), "{q} rad");
    assert!(sim.world.articulation(link.articulation).is_asleep());
}

#[test]
fn repeated_simulations_are_bit_identical() {
    let final_hash = || {
        let mut sim = settled();
        let link = link(&sim, "cabinet.top_drawer");
        sim.world.articulation_mut(link.articulation).state.v[link.index] = -0.3;
        run(&mut sim, 0.5);
        state_hash(&sim)
    };
    assert_eq!(final_hash(), final_hash());
}
