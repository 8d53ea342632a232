//! Held bodies: friction, creep and the time step.

use softvt::geometry::Vec3;

use crate::{
    drives, friction,
    page::{Report, header, heading, percent, short, yes},
    time_step, verdicts,
};

pub fn friction(report: &mut Report) {
    heading(
        "Friction",
        "A cube held at gap 48 mm with the weight at a share of the friction capacity: creep over 5 s.",
    );
    header("weight / capacity | creep mm");
    for share in [0.16, 0.4, 0.6, 0.8, 0.9] {
        let creep = friction::creep(share);
        row!("{:.4} | {}", creep.share, short(creep.creep_mm));
        report.claim(&format!("creep at {share} of capacity, mm"), [creep.creep_mm], 0.01);
    }
    println!(
        "\nBetween pads so large that the contact stays the same, capacity in closed form: acceleration between 0.2 and 0.3 s.\n"
    );
    header("weight / capacity | m/s² | g (1 − capacity/load) | ");
    for load in [1.05, 1.5] {
        let fall = friction::fall(load);
        let error = fall.acceleration / fall.expected - 1.0;
        row!("{load} | {:.4} | {:.4} | {}", fall.acceleration, fall.expected, percent(error));
        report.claim(&format!("fall at {load} of capacity"), [error], 0.05);
    }
    println!(
        "\nAt 60 % of capacity: the hand turns by 90° in 1 s and back, or shakes with 2 m/s² at 2 Hz.\n"
    );
    header("motion | axis | weight / capacity | shift in the hand mm | pad slid");
    for (name, axis) in [("x", Vec3::x()), ("y", Vec3::y()), ("z", Vec3::z())] {
        let mut print = |motion: &str, c: friction::Carried| {
            row!("{motion} | {name} | {} | {} | {}", short(c.share), short(c.shift_mm), yes(c.slid));
            let shift_mm = if c.slid { f64::INFINITY } else { c.shift_mm };
            report.claim(&format!("{motion} {name}: shift, mm"), [shift_mm], 0.1);
        };
        if name != "z" {
            print("turn about", friction::turned(axis));
        }
        print("shake along", friction::shaken(axis));
    }
}

pub fn time_step(report: &mut Report) {
    heading(
        "Time step",
        "Equilibria at 60, 120 and 240 Hz do not depend on it. Average acceleration adds next to no damping. The step of implicit Euler, the \
         integrator through 0.3.0 (`physics.average_acceleration=false`), damps motion as stiffness-proportional damping of one step does.",
    );
    header("squeeze | F grip | F hold | D hold %");
    for (name, options, bound) in time_step::cases() {
        let runs = time_step::refined(&options);
        let columns = [
            runs.each_ref().map(|o| o.force_grip_n),
            runs.each_ref().map(|o| o.force_hold_n),
            runs.each_ref().map(|o| o.d_hold_pct),
        ];
        let cells = columns.map(|c| c.map(|v| format!("{v:.5}")).join(", "));
        row!("{name} | {}", cells.join(" | "));
        let changes = columns.iter().flat_map(|c| c.map(|v| v / c[2] - 1.0));
        report.claim(&format!("{name}: 60 to 240 Hz"), changes, bound);
    }
    moving(report);
    hand(report);
    turned(report);
}

/// Prints the acceleration of the hand along a planned path.
fn hand(report: &mut Report) {
    let path = drives::path_acceleration();
    println!(
        "\nPeak acceleration of the hand along a lift by 0.1 m in 1.2 s, which is commanded at 20 Hz; that of the path is {path:.3} m/s².\n"
    );
    header("physics steps per second | m/s² | over the path");
    let found = drives::RATES.map(drives::hand_acceleration);
    for (rate, found) in drives::RATES.iter().zip(found) {
        row!("{rate} | {found:.3} | {:.2}", found / path);
    }
    report.claim("acceleration of the hand, 60 to 480 Hz", found.map(|a| a / found[3] - 1.0), 0.2);
    let over_path = found.map(|a| a / path - 1.0);
    report.claim("acceleration of the hand over that of the path, less 1", over_path, 1.0);
}

/// Prints the verdicts at other time steps and on another mesh.
fn turned(report: &mut Report) {
    println!(
        "\nVerdicts at other time steps, and of the same actions on a mesh 1.5 times as fine, with the same limits (`softvt \
         scripts/verdict_checks.lua`; *turned*: other than in the reference).\n"
    );
    header("suite | controller | condition | episodes | Goal % | Safety % | Goal turned | Safety turned");
    for one in verdicts::verdicts() {
        let run = format!("{} | {} | {} | {}", one.suite, one.controller, one.condition, one.episodes);
        row!("{run} | {:.1} | {:.1} | {} | {}", one.goal, one.safety, one.goal_turned, one.safety_turned);
        if one.condition != "reference" {
            let claim = format!("Safety turned: {}, {}, {}", one.suite, one.controller, one.condition);
            report.claim(&claim, [one.turned()], one.bound());
        }
    }
}

/// Prints what depends on the step: the swing of a lifted body, and the speed of a rolling one.
fn moving(report: &mut Report) {
    println!(
        "\nPeak of D over D at rest of a long body (capsule of 40 × 160 mm, 30 kPa) that is lifted by 0.1 m in 0.4 s. Speed after an impact over \
         that before, of a soft ball of 50 mm (30 kPa) that falls by 0.1 m, by the height that it reaches. Speed of such a ball after 3 s on a slope, m/s; a rigid one has {:.2} \
         and {:.2}. At {} Hz, with β = 5 ms.\n",
        time_step::rolled_rigid(3f64.to_radians()),
        time_step::rolled_rigid(6f64.to_radians()),
        time_step::RATES.map(|rate| rate.to_string()).join(", ")
    );
    header("motion | implicit Euler | average acceleration");
    let mut motion = |name: &str, motion: &dyn Fn(f64, bool) -> f64, bound: f64| {
        let [euler, average] =
            [false, true].map(|average| time_step::RATES.map(|rate| motion(rate, average)));
        let cells = |found: [f64; 3]| found.map(|value| format!("{value:.3}")).join(", ");
        row!("{name} | {} | {}", cells(euler), cells(average));
        let changes = |found: [f64; 3]| found.map(|value| value / found[2] - 1.0);
        report.claim(&format!("{name}: 60 to 240 Hz"), changes(average), bound);
    };
    let rolled = |degrees: f64| move |rate, average| time_step::rolled(rate, average, degrees.to_radians());
    motion("long body, lifted", &time_step::lifted, 0.03);
    motion("ball, restitution", &time_step::restitution, 0.15);
    motion("ball on 3°", &rolled(3.0), 0.15);
    motion("ball on 6°", &rolled(6.0), 0.15);
}
