//! CPU time of a picture, on a settled scene of a suite with a robot of plain boxes and cylinders.
//!
//! `cargo bench --bench render` prints milliseconds of this thread a picture: the mean of the fastest of [`ROUNDS`] runs.
//! `cargo bench --bench render -- --png DIR` also writes the pictures there, one scene a task.

use std::{path::PathBuf, sync::Arc, time::Instant};

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

/// Runs of which the fastest counts, and pictures of a run.
const ROUNDS: usize = 3;
const PICTURES: usize = 20;
/// The suite that is drawn.
const SUITE: &str = "suites/spatial_soft.lua";

/// A scene at rest and its stage.
struct Set {
    stage: Stage,
    frame: Frame,
    hand_w: Pose,
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
        let frame = sim.world.snapshot(&[]);
        let hand_w = frame.links[sim.rig.tree][panda::HAND_LINK] * panda::hand_in_link();
        let mut things = robot_things(&sim);
        things.extend(objects(&sim));
        things.push(floor());
        let stage = Stage::new(things, Lighting::default()).expect("the default light is good");
        Self { stage, frame, hand_w }
    }

    fn view(&self) -> FrameView<'_> {
        FrameView::of(&self.frame, Some(self.hand_w))
    }
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

/// CPU time of this thread where the system tells it (Linux), else the wall clock, s.
fn seconds(start: &Instant) -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = text.and_then(|t| t.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

fn report(set: &Set, name: &str, camera: &Camera, mut scratch: Scratch) {
    let start = Instant::now();
    let mut shoot = |pictures: usize| {
        let begun = seconds(&start);
        for _ in 0..pictures {
            render(&set.stage, &set.view(), camera, &mut scratch).expect("the camera is good");
        }
        1e3 * (seconds(&start) - begun) / pictures as f64
    };
    let first = shoot(1);
    // The system's clock of a thread may tick only every 4 ms: runs are long beside that.
    let rounds: Vec<f64> = (0..ROUNDS).map(|_| shoot(PICTURES)).collect();
    let least = rounds.iter().copied().fold(f64::INFINITY, f64::min);
    println!("{name:<34} {least:7.2}   first {first:7.2}");
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
    println!("CPU milliseconds a picture, one thread");
    report(&set, "third person 224, cached", &third, Scratch::default());
    report(&set, "third person 224, uncached", &third, Scratch::uncached());
    report(&set, "wrist 224", &wrist, Scratch::default());
    report(&set, "third person 1024, cached", &third.clone().with_edge(1024), Scratch::default());
    report(&set, "third person 1024, uncached", &third.clone().with_edge(1024), Scratch::uncached());
    report(&set, "wrist 512", &wrist.clone().with_edge(512), Scratch::default());
    let Some(folder) = folder else { return };
    for task in [0, 2, 4, 6, 8] {
        let set = Set::new(&loaded, &name, task);
        for (camera, edge) in [(&third, 1024), (&third, 224), (&wrist, 512), (&wrist, 224)] {
            let camera = camera.clone().with_edge(edge);
            let picture =
                render(&set.stage, &set.view(), &camera, &mut Scratch::default()).expect("a picture");
            let path = folder.join(format!("{task}_{}_{edge}.png", camera.name));
            picture.write_png(&path).expect("the folder can be written");
        }
    }
}
