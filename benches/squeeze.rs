//! CPU time of a squeeze: a soft cube on a table is gripped by two flat pads, lifted and held.
//!
//! `cargo bench --bench squeeze` prints CPU seconds of this thread per simulated second, by phase, the best of
//! [`ROUNDS`] runs: other load on the machine lengthens the wall clock, not this.
//! `cargo bench --bench squeeze -- "gap 42"` runs the cases whose names contain the words.

#[path = "../tests/bodies/mod.rs"]
mod bodies;
#[allow(dead_code)]
#[path = "../tests/validation/support.rs"]
mod support;

use cpu_time::ThreadTime;
use softvt::{geometry::Pose, physics::SoftId};
use support::{LIFT_S, Scene, Squeeze, quintic};

/// Runs of which the fastest counts.
const ROUNDS: usize = 5;

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

fn run(squeeze: &Squeeze) -> Outcome {
    let (mut scene, mut out) = (Scene::new(squeeze), Outcome::default());
    let (lift_at, mut begun, mut hand) = (squeeze.lift_at(), 0.0, Pose::identity());
    let ends = [lift_at, lift_at + LIFT_S, lift_at + LIFT_S + squeeze.hold_s];
    for (phase, end) in ends.into_iter().enumerate() {
        let start = ThreadTime::now();
        while scene.world.time() + 0.5 * squeeze.dt < end {
            let share = (scene.world.time() + squeeze.dt - lift_at) / LIFT_S;
            hand = Pose::translation(0.0, 0.0, squeeze.lift * quintic(share));
            scene.advance(&hand).expect("the squeeze is well behaved");
            let stats = scene.world.solver_stats();
            out.newton += stats.newton_steps;
            out.factored += stats.factorizations;
            out.newton_max = out.newton_max.max(stats.max_newton_steps);
        }
        out.cpu[phase] = start.elapsed().as_secs_f64();
        out.simulated[phase] = scene.world.time() - begun;
        begun = scene.world.time();
        out.force_hold = scene.seen(&hand).force;
        if phase == 0 {
            out.force_grip = out.force_hold;
        }
    }
    out.factorizations = scene.world.soft(SoftId::new(0)).factorizations();
    out
}

fn report(name: &str, squeeze: &Squeeze) {
    let rounds: Vec<Outcome> = (0..ROUNDS).map(|_| run(squeeze)).collect();
    let least = |value: &dyn Fn(&Outcome) -> f64| rounds.iter().map(value).fold(f64::INFINITY, f64::min);
    let phase = |i: usize| least(&|o: &Outcome| o.cpu[i] / o.simulated[i]);
    let total = least(&|o: &Outcome| o.cpu.iter().sum::<f64>() / o.simulated.iter().sum::<f64>());
    let o = &rounds[0];
    println!(
        "{name:<28} {total:.4}  table {:.4} lift {:.4} hold {:.4}  newton {} (most {}) factored {} refills {}  force {:.4} {:.4} N",
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
fn report_asleep(squeeze: &Squeeze) {
    let mut world = Scene::new(squeeze).world;
    world.params.sleeping = true;
    let mut step = || world.step().expect("a resting cube is well behaved");
    let seconds = |s: f64| (s / squeeze.dt) as usize;
    (0..seconds(3.0)).for_each(|_| step());
    let start = ThreadTime::now();
    (0..seconds(200.0)).for_each(|_| step());
    println!("{:<28} {:.6}", "asleep", start.elapsed().as_secs_f64() / 200.0);
    assert!(world.soft(SoftId::new(0)).is_asleep(), "the cube sleeps after 3 s at rest");
}

fn main() {
    // Arguments select cases by part of their name.
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let is_selected = |name: &str| words.is_empty() || words.iter().any(|word| name.contains(word));
    println!("CPU seconds per simulated second");
    let cube = Squeeze::default();
    let cases = [
        ("cube, gap 42", cube),
        ("cube, gap 48", cube.gap_mm(48.0)),
        ("cube, gap 30", cube.gap_mm(30.0)),
        ("cube, gap 42, 240 Hz", Squeeze { dt: 1.0 / 240.0, ..cube }),
        ("cube, gap 42, resolution 12", Squeeze { resolution: 12, ..cube }),
    ];
    cases.iter().filter(|(name, _)| is_selected(name)).for_each(|(name, squeeze)| report(name, squeeze));
    if is_selected("asleep") {
        report_asleep(&cube);
    }
}
