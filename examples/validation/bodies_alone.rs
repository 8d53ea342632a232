//! Bodies by themselves: the element, extremes and free flight.

use crate::{
    element, extremes, free,
    page::{Report, header, heading, row, short},
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
    header(&["ν", "voxels across", "ours", "reference"]);
    for reference in rows("elements").iter().filter(|r| r.text("test") == "cantilever") {
        let (nu, n) = (reference.number("nu"), reference.number("n_across"));
        let ratio = element::cantilever(n as usize, nu);
        row(&[
            nu.to_string(),
            n.to_string(),
            format!("{ratio:.5}"),
            format!("{:.5}", reference.number("ratio")),
        ]);
        report.claim(
            &format!("cantilever ν {nu}, {n} across, against the reference"),
            [ratio / reference.number("ratio") - 1.0],
            1e-4,
        );
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
    header(&[
        "thrown body",
        "spin rad/s",
        "stretch",
        "β s",
        "largest gain of a step",
        "energy kept in 2 s",
        "change of angular momentum",
    ]);
    for throw in free::throws() {
        let flight = free::flight(&throw);
        row(&[
            format!("{:?}", throw.body).split(' ').next().unwrap_or_default().to_owned(),
            throw.spin.to_string(),
            throw.stretch.to_string(),
            throw.beta.to_string(),
            short(flight.largest_gain),
            format!("{:.6}", flight.kept),
            short(flight.spin_change),
        ]);
        report.claim(
            &format!("free flight at {} rad/s, stretch {}: gain", throw.spin, throw.stretch),
            [flight.largest_gain.max(0.0)],
            1e-3,
        );
        report.claim("free flight: change of momentum", [flight.momentum_change], 1e-9);
        report.claim("free flight: change of angular momentum", [flight.spin_change], 1e-6);
    }
}
