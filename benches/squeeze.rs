//! CPU time of a squeeze: a soft cube on a table is gripped by two flat pads, lifted and held.
//!
//! `cargo bench --bench squeeze` prints CPU seconds of this thread per simulated second, by phase, the best of
//! [`ROUNDS`] runs: other load on the machine lengthens the wall clock, not this.
//! `cargo bench --bench squeeze -- "gap 42"` runs the cases whose names contain the words.

use cpu_time::ThreadTime;
use softvt::{
    geometry::{Pose, Vec3, mass::mass_properties, samples::SampleSpec, shape::Shape},
    physics::{
        BodyId, ColliderId, KinematicId, PhysicsParams, SoftId, World,
        contact::Friction,
        fem::{ElasticMaterial, FemModel},
    },
};

/// Runs of which the fastest counts.
const ROUNDS: usize = 5;
const EDGE: f64 = 0.05;
const PAD_HALF: Vec3 = Vec3::new(5e-3, 11e-3, 11e-3);
/// Clearance of each pad before it closes, m, and its closing speed, m/s.
const CLEARANCE: f64 = 2e-3;
const CLOSING: f64 = 0.04;
const SETTLE: f64 = 0.1;
const GRIP: f64 = 0.25;
const LIFT: f64 = 1.0;
const HOLD: f64 = 0.5;
const RISE: f64 = 0.1;

/// One squeeze.
struct Case {
    name: &'static str,
    gap: f64,
    resolution: usize,
    dt: f64,
}

/// The scene and the indices that drive it.
struct Scene {
    world: World,
    body: SoftId,
    pads: [(KinematicId, ColliderId, f64); 2],
    gap: f64,
}

/// CPU seconds of the phases on the table, lifting, holding; forces before and after the lift; what the solver did.
#[derive(Clone, Copy, Default)]
struct Outcome {
    cpu: [f64; 3],
    simulated: [f64; 3],
    newton: u32,
    newton_max: u32,
    factored: u32,
    factorizations: u64,
    force_grip: f64,
    force_hold: f64,
}

impl Scene {
    fn new(case: &Case, sleeping: bool) -> Self {
        let shape = Shape::Box { half: Vec3::repeat(0.5 * EDGE) };
        let material = ElasticMaterial::new(3e4, 0.4, 300.0).expect("valid");
        let volume = mass_properties(&shape, 1.0).mass;
        let model = FemModel::from_shape(&shape, volume, material, case.resolution, &SampleSpec::default());
        let model = model.expect("a cube has a mesh");
        let params =
            PhysicsParams { rayleigh_stiffness: 2e-3, sleeping, dt: case.dt, ..PhysicsParams::default() };
        let mut world = World::new(params, Vec3::new(0.0, 0.0, -9.81));
        let grip = Friction::new(1.2, 1.2);
        let body =
            world.add_soft("cube", model, None, &Pose::translation(0.0, 0.0, 0.5 * EDGE), Friction::NONE);
        let table = Shape::Box { half: Vec3::new(0.5, 0.5, 0.05) };
        world.add_shape("table", BodyId::World, Pose::translation(0.0, 0.0, -0.05), &table, grip);
        let pads = [-1.0, 1.0].map(|side| {
            let frame = world.add_kinematic(pad_pose(side, 0.5 * EDGE + CLEARANCE, 0.0));
            let pad = Shape::Box { half: PAD_HALF };
            (frame, world.add_shape("pad", frame, Pose::identity(), &pad, grip), side)
        });
        Self { world, body, pads, gap: case.gap }
    }

    /// Seconds at which the pads have closed and gripped, have lifted, and the run ends.
    fn ends(&self) -> [f64; 3] {
        let closed = SETTLE + (0.5 * EDGE + CLEARANCE - 0.5 * self.gap) / CLOSING;
        [closed + GRIP, closed + GRIP + LIFT, closed + GRIP + LIFT + HOLD]
    }

    /// One step of the prescribed motion.
    fn step(&mut self) {
        let time = self.world.time() + self.world.params.dt;
        let open = 0.5 * EDGE + CLEARANCE;
        let x = (open - CLOSING * (time - SETTLE).max(0.0)).max(0.5 * self.gap);
        let s = ((time - self.ends()[0]) / LIFT).clamp(0.0, 1.0);
        let z = RISE * s * s * s * (10.0 + s * (6.0 * s - 15.0));
        for (frame, _, side) in self.pads {
            self.world.move_kinematic(frame, pad_pose(side, x, z));
        }
        self.world.step().expect("the squeeze is well behaved");
    }

    fn force(&self) -> f64 {
        self.world.contact(self.body, self.pads[0].1).normal_force
    }

    fn run(mut self) -> Outcome {
        let mut out = Outcome::default();
        let mut begun = 0.0;
        for (phase, end) in self.ends().into_iter().enumerate() {
            let start = ThreadTime::now();
            while self.world.time() + 0.5 * self.world.params.dt < end {
                self.step();
                out.newton += self.world.solver_stats().newton_steps;
                out.factored += self.world.solver_stats().factorizations;
                out.newton_max = out.newton_max.max(self.world.solver_stats().max_newton_steps);
            }
            out.cpu[phase] = start.elapsed().as_secs_f64();
            out.simulated[phase] = self.world.time() - begun;
            begun = self.world.time();
            if phase == 0 {
                out.force_grip = self.force();
            }
        }
        out.force_hold = self.force();
        out.factorizations = self.world.soft(self.body).factorizations();
        out
    }
}

fn pad_pose(side: f64, x: f64, z: f64) -> Pose {
    Pose::translation(side * (x + PAD_HALF.x), 0.0, 0.5 * EDGE + z)
}

fn report(case: &Case) {
    let rounds: Vec<Outcome> = (0..ROUNDS).map(|_| Scene::new(case, false).run()).collect();
    let least = |value: &dyn Fn(&Outcome) -> f64| rounds.iter().map(value).fold(f64::INFINITY, f64::min);
    let phase = |i: usize| least(&|o: &Outcome| o.cpu[i] / o.simulated[i]);
    let total = least(&|o: &Outcome| o.cpu.iter().sum::<f64>() / o.simulated.iter().sum::<f64>());
    let o = &rounds[0];
    println!(
        "{:<28} {total:.4}  table {:.4} lift {:.4} hold {:.4}  newton {} (most {}) factored {} refills {}  force {:.4} {:.4} N",
        case.name,
        phase(0),
        phase(1),
        phase(2),
        o.newton,
        o.newton_max,
        o.factored,
        o.factorizations,
        o.force_grip,
        o.force_hold,
    );
}

/// CPU time of a body asleep on the table, with the pads at rest next to it.
fn report_asleep(case: &Case) {
    let mut scene = Scene::new(case, true);
    let seconds = |s: f64| (s / case.dt) as usize;
    for _ in 0..seconds(3.0) {
        scene.world.step().expect("a resting cube is well behaved");
    }
    assert!(scene.world.soft(scene.body).is_asleep(), "the cube should sleep after 3 s at rest");
    let start = ThreadTime::now();
    (0..seconds(200.0)).for_each(|_| scene.world.step().expect("a sleeping cube is well behaved"));
    println!("{:<28} {:.6}", "asleep", start.elapsed().as_secs_f64() / 200.0);
}

fn main() {
    // Arguments select cases by part of their name.
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let is_selected = |name: &str| words.is_empty() || words.iter().any(|word| name.contains(word));
    println!("CPU seconds per simulated second");
    let cube = Case { name: "cube, gap 42", gap: 0.042, resolution: 6, dt: 1.0 / 60.0 };
    let cases = [
        Case { ..cube },
        Case { name: "cube, gap 48", gap: 0.048, ..cube },
        Case { name: "cube, gap 30", gap: 0.030, ..cube },
        Case { name: "cube, gap 42, 240 Hz", dt: 1.0 / 240.0, ..cube },
        Case { name: "cube, gap 42, resolution 12", resolution: 12, ..cube },
    ];
    cases.iter().filter(|case| is_selected(case.name)).for_each(report);
    if is_selected("asleep") {
        report_asleep(&cube);
    }
}
