//! Bodies by themselves: the element, extremes and free flight.

use crate::{
    beam::{self, CASES, Law},
    element, extremes, free,
    page::{Report, header, heading, short},
    rows::rows,
};

pub fn element(report: &mut Report) {
    heading(
        "Element",
        "Forces of the body itself. Cantilever 100 × 20 × 20 mm under its own weight, tip over Timoshenko's.",
    );
    let (inner, energy) = element::patch();
    println!("Patch test: inner force {inner:.1e} of the boundary's, energy off by {energy:.1e}.");
    report.claim("patch test: inner force and energy", [inner, energy], 1e-9);
    for n in [2, 4] {
        let (youngs, across) = element::bar(n);
        println!(
            "Bar, {n} voxels across: E = {youngs:.6} Pa of 30000, side force {across:.1e} of the end's."
        );
        report.claim(&format!("bar of {n} voxels: E and ν"), [youngs / 3e4 - 1.0, across], 1e-9);
    }
    let turns = [0.3, 1.0, 2.5, std::f64::consts::PI].map(element::rigid_motion);
    println!(
        "Rigid motion up to half a turn: largest force {:.1e} E h².\n",
        turns.into_iter().fold(0.0, f64::max)
    );
    report.claim("rigid motion: force over E h²", turns, 1e-11);
    header("ν | voxels across | ours | reference");
    for reference in rows("elements").iter().filter(|r| r.text("test") == "cantilever") {
        let (nu, n) = (reference.number("nu"), reference.number("n_across"));
        let ratio = element::cantilever(n as usize, nu);
        let expected = reference.number("ratio");
        row!("{nu} | {n} | {ratio:.5} | {expected:.5}");
        let what = format!("cantilever ν {nu}, {n} across, against the reference");
        report.claim(&what, [ratio / expected - 1.0], 1e-4);
    }
}

pub fn extremes(report: &mut Report) {
    heading("Extremes", "");
    let crushed = extremes::crushed();
    let failure =
        crushed.failure.as_ref().map_or("reaches its end".to_owned(), |failure| format!("fails: {failure}"));
    println!(
        "Gap 11 mm at 10 kPa: largest D {:.2} %, least det F {:.3}, the run {failure}.",
        crushed.d_peak_pct, crushed.min_det_f
    );
    let stiff = extremes::stiff();
    println!(
        "\n1 MPa at gap 48 mm: hold force {:.3} N, ripple {:.1e}, creep {:.1e} mm/s.\n",
        stiff.force_hold_n, stiff.ripple, stiff.creep_mm_per_s
    );
    report.claim("1 MPa: ripple of the force", [stiff.ripple], 1e-3);
    header(
        "thrown body | spin rad/s | stretch | β s | largest energy over that at the start, less 1 | energy kept in 2 s | change of angular momentum",
    );
    for throw in free::throws() {
        let flight = free::flight(&throw);
        let body = format!("{:?}", throw.body);
        let (body, gain, change) =
            (body.split(' ').next().unwrap_or_default(), flight.largest_gain, short(flight.spin_change));
        let free::Throw { spin, stretch, beta, .. } = throw;
        row!("{body} | {spin} | {stretch} | {beta} | {} | {:.6} | {change}", short(gain), flight.kept);
        let what = format!("free flight at {spin} rad/s, stretch {stretch}: gain");
        report.claim(&what, [gain.max(0.0)], 1e-3);
        report.claim("free flight: change of momentum", [flight.momentum_change], 1e-9);
        report.claim("free flight: change of angular momentum", [flight.spin_change], 1e-6);
    }
}

/// Steps per second and law of the runs of the silicone beam.
const BEAM_RUNS: [(f64, Law); 6] = [
    (60.0, Law::Default),
    (60.0, Law::Dashpot),
    (240.0, Law::Dashpot),
    (60.0, Law::LossFactor),
    (120.0, Law::LossFactor),
    (240.0, Law::LossFactor),
];

pub fn silicone_beam(report: &mut Report) {
    heading(
        "Silicone beam",
        "A beam of 30 × 30 × 100 mm (264 kPa, ν 0.499, 1070 kg/m³), one end clamped, is released from its straight shape, against a recording of a \
         real one (`tests/reference/measured`). 6 voxels across; the load is on the upper edge of the tip. Implicit Euler with β = ζ/(π f) of the \
         recording or that of the benchmark, 5 ms; average acceleration with a loss factor of 0.085, fitted to the damping ratios.",
    );
    header("beam | steps per second | damping | sag mm | frequency Hz | damping ratio ζ");
    for case in CASES {
        let recorded = case.recorded();
        let name = case.name;
        let print = |rate: &str, law: &str, swing: &beam::Swing| {
            let beam::Swing { sag_mm, frequency, zeta } = swing;
            row!("{name} | {rate} | {law} | {sag_mm:.2} | {frequency:.2} | {zeta:.3}");
        };
        print("recorded", "", &recorded);
        for (rate, law) in BEAM_RUNS {
            let swing = case.simulated(beam::ACROSS, rate, law);
            let damping = match law.beta(&case) {
                Some(beta) => format!("β {:.2} ms", 1e3 * beta),
                None => "loss factor".into(),
            };
            print(&rate.to_string(), &damping, &swing);
            if law.beta(&case).is_some() {
                continue;
            }
            let what = format!("silicone beam {name}, {rate} Hz");
            report.claim(&format!("{what}: sag"), [swing.sag_mm / recorded.sag_mm - 1.0], 0.05);
            report.claim(&format!("{what}: frequency"), [swing.frequency / recorded.frequency - 1.0], 0.05);
            report.claim(&format!("{what}: ζ"), [swing.zeta / recorded.zeta - 1.0], 0.2);
        }
    }
}
