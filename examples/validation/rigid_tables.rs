//! The section on rigid and articulated bodies.

use crate::{
    jointed,
    page::{Report, header, heading, percent, short},
    rigid,
};

/// Prints the tables of free rigid bodies.
pub fn rigid(report: &mut Report) {
    heading(
        "Rigid and articulated",
        "Bodies of 0.3 kg at 60 Hz, sleeping off, friction 0.6/0.5 unless said; slopes are gravity that leans.",
    );
    let [speed, way] = rigid::fall();
    println!(
        "Free fall of 1 s: speed off by {speed:.1e}, way by {way:.1e}; the speed is that of the middle of the last step.\n"
    );
    report.claim("free fall: speed", [speed], 1e-7);
    report.claim("free fall: way", [way], 1e-6);
    slopes(report);
    let [moved, turned] = rigid::stack();
    println!("Stack of five boxes, 10 s: moved by {moved:.1e} m, turned by {turned:.1e} rad at most.");
    report.claim("stack of five boxes over 10 s: moved, m", [moved], 1e-6);
    let [moved, turned] = rigid::rounded_stack();
    println!(
        "The same with edges rounded by 5 mm: moved by {moved:.1e} m, turned by {turned:.1e} rad at most."
    );
    report.claim("stack of five boxes with rounded edges over 10 s: moved, m", [moved], 1e-6);
    let hit = rigid::collision();
    println!(
        "Two boxes collide off their centres: momentum off by {:.1e}, angular momentum by {}, energy kept {:.0} %.\n",
        hit.momentum,
        percent(hit.spin),
        100.0 * hit.energy
    );
    report.claim("collision: momentum", [hit.momentum], 1e-6);
    report.claim("collision: angular momentum", [hit.spin], 0.01);
    header("largest gain of energy in a step | of the initial energy");
    for (name, gain) in rigid::largest_gains() {
        row!("{name} | {gain:.1e}");
        report.claim(&format!("energy gained in a step: {name}"), [gain.max(0.0)], 1e-3);
    }
}

fn slopes(report: &mut Report) {
    header("on a slope | closed form | found | off by");
    let stick = rigid::SLIDING.0.atan();
    let held = rigid::slide(stick - 0.02);
    row!("a block 0.02 rad below its angle creeps in 5 s | 0 | {:.1e} m | ", held.crept);
    report.claim("block below its static angle: creep in 5 s, m", [held.crept], 1e-6);
    for angle in [stick + 0.02, 0.8] {
        let ratio = rigid::slide(angle).acceleration;
        row!("a block slides at {angle:.2} rad: acceleration | 1 | {ratio:.4} | {}", percent(ratio - 1.0));
        report.claim("sliding block: acceleration", [ratio - 1.0], 0.01);
    }
    for (name, ratio) in ["a ball", "a lying can"].into_iter().zip(rigid::rolls()) {
        row!("{name} rolls from rest at 0.5°: acceleration | 1 | {ratio:.4} | {}", percent(ratio - 1.0));
        report.claim("rolling from rest at 0.5°: acceleration", [ratio - 1.0], 0.01);
    }
    for body in rigid::standing() {
        let (expected, found) = (body.tips_at.to_degrees(), body.found().to_degrees());
        let off = found - expected;
        row!("{} tips | {expected:.2}° | {found:.2}° | {off:+.2}°", body.name);
        report.claim("tipping angle, degrees", [off], 0.3);
    }
    println!();
}

/// Prints the tables of bodies on joints, and of bodies on and in others.
pub fn jointed(report: &mut Report) {
    println!();
    header("on a joint | closed form | found | off by");
    for angle in [0.1, 0.5, 1.2] {
        let ratio = jointed::period(angle);
        let what = format!("period of a rod of 0.4 m that swings by {angle} rad");
        row!("{what} | 1 | {ratio:.5} | {}", percent(ratio - 1.0));
        report.claim("pendulum: period", [ratio - 1.0], 1e-3);
        let [gain, change] = jointed::swing(angle);
        let (left, change_pct) = (1.0 + change, percent(change));
        row!("its energy after 20 s; largest gain in a step | 1; 0 | {left:.5}; {gain:.1e} | {change_pct}");
        report.claim("pendulum: energy gained in a step", [gain.max(0.0)], 1e-3);
        report.claim("pendulum: energy after 20 s", [change], 1e-3);
    }
    for (speed, dt) in [0.3, 0.5].into_iter().flat_map(|speed| jointed::STEPS.map(|dt| (speed, dt))) {
        let [way, exact] = jointed::stopping(speed, dt);
        let (rate, error) = (1.0 / dt, way / exact - 1.0);
        let what = format!("way of a drawer (damping, friction) pushed at {speed} m/s, {rate:.0} Hz, mm");
        row!("{what} | {} | {} | {}", short(1e3 * exact), short(1e3 * way), percent(error));
        let what = format!("drawer pushed at {speed} m/s, {rate:.0} Hz: way until it stops");
        report.claim(&what, [error], if dt > 1e-2 { 0.05 } else { 0.005 });
    }
    let terminal = jointed::terminal();
    row!("its speed down a slope | 1 | {terminal:.6} | {:.1e}", terminal - 1.0);
    report.claim("drawer: speed down a slope", [terminal - 1.0], 1e-4);
    let creep = jointed::creep();
    row!("its creep in 10 s at 95 % of its friction | 0 | {creep:.1e} m | ");
    report.claim("drawer: creep in 10 s at 95 % of its friction, m", [creep], 1e-6);
    let [beyond, rest] = jointed::stop();
    row!("beyond its end at 1 m/s, and at rest | 0 | {:.1e} m, {rest:.1e} m | ", beyond.max(0.0));
    report.claim("drawer: beyond its end, m", [beyond.max(0.0), rest], 1e-3);
    let [moved, turned] = jointed::bowl_on_ramekin();
    println!("\nA bowl on a ramekin, 5 s: moved by {moved:.1e} m, turned by {turned:.1e} rad.");
    let carried = jointed::bowl_in_drawer();
    println!(
        "A bowl in a drawer, 5 s: moved by {:.1e} m, turned by {:.1e} rad; pushed by 30 mm it stays {} mm behind.",
        carried.drift[0],
        carried.drift[1],
        short(1e3 * carried.behind)
    );
    report.claim("bowl on a ramekin and in a drawer: moved, m", [moved, carried.drift[0]], 1e-5);
    report.claim("bowl in a drawer that is pushed: behind, m", [carried.behind], 1e-4);
}
