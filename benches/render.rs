//! CPU time of a picture, on a settled scene of a suite with a robot of plain boxes and cylinders, whose hand and objects move
//! from picture to picture.
//!
//! `cargo bench --bench render` prints milliseconds of this thread a picture beside the goals: each of [`PICTURES`] states is drawn
//! [`ROUNDS`] times, its fastest time on the processor counts, and the mean over the states is printed. Words after `--`
//! choose lines that contain one of them.
//! `cargo bench --bench render -- --png DIR` also writes the pictures there, one scene a task.

use std::{path::PathBuf, sync::Arc};

use cpu_time::ThreadTime;
use softvt::{
    benchmark::{Plan, seed::Split},
    geometry::{Pose, Quat, Vec3, shape::Shape},
    physics::{Params, world::Frame},
    robot::{RobotSpec, Side, pads, panda},
    rollout::{Kind, RestCache, Simulation},
    scene::{Body, Camera, Layer, Lighting, Mask, Visual},
    script,
    sensing::camera::{FrameView, Model, Mount, Scratch, Stage, Thing, render},
};

/// Runs of which the fastest counts, and pictures of a run: the states that are drawn in turn.
const ROUNDS: usize = 8;
const PICTURES: usize = 16;
/// How far the robot above its base and the soft objects go from one state to the next, m.
const STEP_M: f64 = 1e-3;
/// The suite that is drawn.
const SUITE: &str = "suites/spatial_soft.lua";

/// A scene's stage and its states: at rest, and then moving a little.
struct Set {
    stage: Stage,
    frames: Vec<(Frame, Pose)>,
}

impl Set {
    fn new(loaded: &script::Loaded, suite: &str, task: usize) -> Self {
        let request = script::EpisodeRequest {
            suite: suite.to_owned(),
            task,
            episode: 0,
            base_seed: 0,
            split: Split::Validation,
            shifts: Vec::new(),
        };
        let scene = script::Episode::open(loaded, &request).expect("the suite opens").scene;
        let robot = RobotSpec::default();
        let mut sim = Simulation::new(Arc::new(scene), &Params::default(), &robot, &RestCache::default())
            .expect("the scene builds");
        (0..60).for_each(|_| sim.step().expect("the scene rests"));
        let frames = (0..PICTURES).map(|i| moved(&sim, STEP_M * i as f64)).collect();
        let mut things = robot_things(&sim);
        things.extend(objects(&sim));
        things.push(floor());
        let stage = Stage::new(things, Lighting::default()).expect("the default light is good");
        Self { stage, frames }
    }

    fn view(&self, picture: usize) -> FrameView<'_> {
        let (frame, hand_w) = &self.frames[picture % PICTURES];
        FrameView::of(frame, Some(*hand_w))
    }
}

/// The state with the robot above its base and the soft objects moved by `by` metres, and the hand's frame.
fn moved(sim: &Simulation, by: f64) -> (Frame, Pose) {
    let mut frame = sim.world.snapshot(&[]);
    let shift = Pose::translation(0.0, by, -0.5 * by);
    frame.links[sim.rig.tree].iter_mut().skip(1).for_each(|link| *link = shift * *link);
    frame.nodes.iter_mut().flatten().for_each(|node| node.x += 0.3 * by);
    let hand_w = frame.links[sim.rig.tree][panda::HAND_LINK] * panda::hand_in_link();
    (frame, hand_w)
}

fn objects(sim: &Simulation) -> Vec<Thing> {
    let draw = |(i, object): (usize, &softvt::rollout::Handle)| {
        let mut visuals = object.asset.visuals.clone();
        if object.bounds.size().max() > 1.0 {
            visuals = vec![wood()];
        }
        let model = Model::of_shape(&object.name, &object.asset.shape, &visuals).expect("it has a skin");
        let (model, mount) = match object.kind {
            Kind::Soft(body) => {
                let mesh = &sim.world.soft[body].body.rest.mesh;
                (model.embedded(&object.name, mesh).expect("the skin lies in the voxels"), Mount::Soft(body))
            }
            Kind::Rigid(body) => (model, Mount::Rigid(body)),
            Kind::Static => (model, Mount::Fixed(object.start_w)),
        };
        let ground = matches!(object.asset.body, Body::Static) && object.bounds.size().max() > 1.0;
        Thing {
            name: object.name.clone(),
            object: i as u16 + 1,
            model: Arc::new(model),
            mount,
            casts_shadow: !ground,
        }
    };
    sim.objects.iter().enumerate().map(draw).collect()
}

fn wood() -> Visual {
    let layer = |mask, albedo, roughness, opacity| Layer { mask, albedo, roughness, opacity, relief_m: 0.0 };
    let noise = |size_m, from, to, seed| Mask::Noise { size_m, octaves: 4, from, to, seed };
    Visual::plain([0.46, 0.30, 0.17], 0.45, 0.0)
        .with(layer(Mask::Boards { length_m: 0.9, width_m: 0.11, seed: 4 }, [0.60, 0.42, 0.26], 0.5, 0.6))
        .with(layer(noise([0.35, 0.006, 0.05], 0.45, 0.8, 1), [0.30, 0.17, 0.085], 0.5, 0.55))
        .with(layer(noise([0.12, 0.0025, 0.05], 0.5, 0.9, 2), [0.24, 0.13, 0.06], 0.5, 0.4))
        .with(layer(
            Mask::Seams { length_m: 0.9, width_m: 0.11, gap_m: 1.2e-3 },
            [0.12, 0.07, 0.04],
            0.8,
            0.8,
        ))
}

fn floor() -> Thing {
    let shape = Shape::Box { half: Vec3::new(4.0, 4.0, 0.05) };
    let mask = Mask::Noise { size_m: [0.5; 3], octaves: 3, from: 0.3, to: 0.8, seed: 9 };
    let layer = Layer { mask, albedo: [0.40, 0.41, 0.42], roughness: 0.8, opacity: 0.5, relief_m: 0.0 };
    let visual = Visual::plain([0.46, 0.47, 0.48], 0.7, 0.0).with(layer);
    Thing {
        name: "floor".to_owned(),
        object: 100,
        model: Arc::new(Model::of_shape("floor", &shape, &[visual]).expect("a box")),
        mount: Mount::Fixed(Pose::translation(0.0, 0.0, -0.95)),
        casts_shadow: false,
    }
}

fn robot_things(sim: &Simulation) -> Vec<Thing> {
    let white = Visual::plain([0.82, 0.83, 0.85], 0.35, 0.0);
    let dark = Visual::plain([0.06, 0.06, 0.07], 0.4, 0.0);
    let mut things = Vec::new();
    let mut add = |shape: Shape, visual: &Visual, mount: Mount| {
        let name = format!("robot {}", things.len());
        let model = Arc::new(Model::of_shape(&name, &shape, std::slice::from_ref(visual)).expect("a solid"));
        things.push(Thing { name, object: 200, model, mount, casts_shadow: true });
    };
    let tree = sim.rig.tree;
    let capsule = |length: f64| Shape::Capsule { radius: 0.06, half_length: 0.5 * length };
    let along = [(0, -0.15, 0.18), (2, -0.1, 0.2), (4, -0.18, 0.2)];
    for (link, z, length) in along {
        add(capsule(length), &white, Mount::Link { tree, link, offset: Pose::translation(0.0, 0.0, z) });
    }
    for link in [1, 3, 5] {
        let across = Pose::from_parts(Vec3::zeros().into(), Quat::identity());
        add(capsule(0.09), &white, Mount::Link { tree, link, offset: across });
    }
    for part in pads::hand_boxes() {
        let shape = Shape::Box { half: part.half.add_scalar(-8e-3) };
        let shape = Shape::Rounded { shape: Arc::new(shape), radius: 8e-3 };
        add(shape, &white, Mount::Link { tree, link: panda::HAND_LINK, offset: part.pose });
    }
    for side in Side::BOTH {
        for part in pads::finger_boxes(side) {
            let mount = Mount::Link { tree, link: panda::finger_link(side), offset: part.pose };
            add(Shape::Box { half: part.half }, &dark, mount);
        }
    }
    let base = sim.rig.base_w * Pose::translation(0.0, 0.0, 0.07);
    add(Shape::Cylinder { radius: 0.09, half_height: 0.07 }, &white, Mount::Fixed(base));
    things
}

fn report(set: &Set, name: &str, goal_ms: f64, camera: &Camera, mut scratch: Scratch) {
    let chosen: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let png = std::env::args().any(|word| word == "--png");
    if !(png || chosen.is_empty() || chosen.iter().any(|word| name.contains(word.as_str()))) {
        return;
    }
    let mut shoot = |picture: usize| {
        let start = ThreadTime::now();
        render(&set.stage, &set.view(picture), camera, &mut scratch).expect("the camera is good");
        1e3 * start.elapsed().as_secs_f64()
    };
    let first = shoot(0);
    let mut fastest = [f64::INFINITY; PICTURES];
    for _ in 0..ROUNDS {
        fastest.iter_mut().enumerate().for_each(|(i, least)| *least = least.min(shoot(i)));
    }
    let least = fastest.iter().sum::<f64>() / PICTURES as f64;
    let reached = if least <= goal_ms { "yes" } else { "no" };
    println!("{name:<28} {goal_ms:>6.0} {least:>9.2}   {reached:<5} {first:>8.1}");
}

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let folder = words.iter().position(|w| w == "--png").and_then(|i| words.get(i + 1)).map(PathBuf::from);
    let suite = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(SUITE);
    let loaded = script::load(&suite, &[]).expect("the suite loads");
    let Plan::Suite(suite) = &loaded.plan else { panic!("{SUITE} is no suite") };
    let name = suite.name.clone();
    let set = Set::new(&loaded, &name, 0);
    let (third, wrist) = (Camera::third_person_table(), Camera::wrist());
    let large = third.clone().with_edge(1024);
    println!("CPU milliseconds a picture, one thread");
    println!("{:<28} {:>6} {:>9}   {:<5} {:>8}", "picture", "goal", "measured", "met", "first");
    report(&set, "third person 224, cached", 3.0, &third, Scratch::default());
    report(&set, "third person 224, uncached", 4.0, &third, Scratch::uncached());
    report(&set, "wrist 224", 4.0, &wrist, Scratch::default());
    report(&set, "third person 1024, cached", 25.0, &large, Scratch::default());
    report(&set, "third person 1024, uncached", 60.0, &large, Scratch::uncached());
    report(&set, "wrist 512", 20.0, &wrist.clone().with_edge(512), Scratch::default());
    let Some(folder) = folder else { return };
    for task in [0, 2, 4, 6, 8] {
        let set = Set::new(&loaded, &name, task);
        for (camera, edge) in [(&third, 1024), (&third, 224), (&wrist, 512), (&wrist, 224)] {
            let camera = camera.clone().with_edge(edge);
            let picture =
                render(&set.stage, &set.view(0), &camera, &mut Scratch::default()).expect("a picture");
            let path = folder.join(format!("{task}_{}_{edge}.png", camera.name));
            picture.into_image().save(&path).expect("the folder can be written");
        }
    }
}
