//! Squeezes: against the static reference, the converged truth and the peers, and the lightest that hold.

use crate::{
    light,
    page::{Report, header, heading, percent, short, yes},
    rows::{self, rows},
    statics::{self, Compared},
    support::{Outcome, Squeeze, run},
    truth,
};

pub fn statics(report: &mut Report) {
    heading(
        "Static squeeze",
        "Ours is the end of the moving squeeze, the reference a static equilibrium. If friction cannot hold, both are of \
         sticking pads. *Capacity error*: of the hold force, over the force whose friction just carries the weight.",
    );
    header(
        "body | res. | E kPa | pad mm | offset mm | gap mm | F grip | ref. | F hold | ref. |  | D hold % | ref. |  | capacity error",
    );
    for group in ["cube", "cube_12", "pads", "round", "variants"] {
        let compared = statics::compare(group, |_| true);
        compared.iter().for_each(print_compared);
        let firm = |c: &&Compared| c.row.number("capacity_over_weight") > 5.0;
        let errors = compared.iter().filter(firm).flat_map(|c| [c.errors()[2], c.errors()[3]]);
        let grip = compared.iter().filter(firm).flat_map(|c| [c.errors()[0], c.errors()[1]]);
        report.claim(&format!("{group}: force and D of firm grasps before the lift"), grip, 0.02);
        report.claim(&format!("{group}: force and D of firm grasps, held"), errors, 0.02);
        // A lift needs 6 % more than the weight: grasps nearer to their capacity do not hold.
        let light = |c: &&Compared| {
            let capacity = c.row.number("capacity_over_weight");
            (0.5..5.0).contains(&capacity) && !(1.0..1.06).contains(&capacity)
        };
        let errors = compared.iter().filter(light).map(Compared::capacity_error);
        report.claim(&format!("{group}: light grasps, on the scale of capacity"), errors, 0.03);
        let errors = compared.iter().filter(firm).map(Compared::capacity_error);
        report.unbounded(&format!("{group}: firm grasps, on the scale of capacity"), errors);
    }
}

fn print_compared(c: &Compared) {
    let [_, _, force, d] = c.errors();
    let n = |key: &str| c.row.number(key);
    let body = format!("{} | {} | {}", c.row.text("shape"), n("resolution"), 1e-3 * n("youngs_pa"));
    let offset = format!("{}, {}", c.row.offset_mm(0), c.row.offset_mm(1));
    let grip = format!("{:.4} | {:.4}", c.ours.force_grip_n, n("force_grip_n"));
    let hold = format!("{:.4} | {:.4} | {}", c.ours.force_hold_n, n("force_hold_n"), percent(force));
    let d = format!("{:.4} | {:.4} | {}", c.ours.d_hold_pct, n("d_hold_pct"), percent(d));
    let (pad, gap, capacity) = (n("pad_mm"), n("gap_mm"), percent(c.capacity_error()));
    row!("{body} | {pad} | {offset} | {gap} | {grip} | {hold} | {d} | {capacity}");
}

/// The truth of a pad, from the finest rows.
fn truth_of(pad_mm: f64, offset_mm: f64) -> (f64, f64) {
    let all = rows("truth");
    let is = |r: &&rows::Row| {
        r.number("pad_mm") == pad_mm && (r.number("pad_offset_y_mm") - offset_mm).abs() < 1e-3
    };
    let best =
        all.iter().filter(is).min_by(|a, b| a.number("first_cell_mm").total_cmp(&b.number("first_cell_mm")));
    best.map_or((f64::NAN, f64::NAN), |r| (r.number("stiffness_n_per_m"), r.number("d_pct_per_mm_7cubed")))
}

pub fn truth(report: &mut Report) {
    heading(
        "Converged truth",
        "Small-strain stiffness between sticking pads (closing of 0.2 mm, no gravity) and D on the 7³ nodes, against meshes \
         graded to convergence: 620 N/m and 0.212 %/mm for centred 22 mm pads, rows of `truth.jsonl` for others. Drake \
         and MuJoCo at 343 nodes and 2 ms are 34 to 41 % too stiff. An offset of 4.1667 mm is half a voxel of resolution 6.",
    );
    header("resolution | pad mm | offset mm | N/m | truth |  | D %/mm | truth | ");
    for (resolution, bound) in [(6, 0.15), (12, 0.15), (18, 0.06), (24, 0.06)] {
        let errors = truth_row(resolution, 22.0, 0.0, truth::TRUTH);
        report.claim(&format!("resolution {resolution} against converged truth"), errors, bound);
    }
    for resolution in [6, 12] {
        for (pad, offset) in [(18.0, 0.0), (20.0, 0.0), (24.0, 0.0), (22.0, 4.1667)] {
            let errors = truth_row(resolution, pad, offset, truth_of(pad, offset));
            let what =
                format!("resolution {resolution}, pads of {pad} mm at {offset} mm, against converged truth");
            report.claim(&what, errors, 0.15);
        }
    }
    for (name, moved) in [("wider", false), ("moved", true)] {
        let force = |i: i32| {
            let x = 0.1 * f64::from(i);
            let (pad, offset) = if moved { (22.0, [x, 0.0]) } else { (22.0 + x, [0.0; 2]) };
            truth::small_strain(6, pad, offset).0
        };
        let forces: Vec<f64> = (0..=20).map(force).collect();
        let changes = forces.windows(2).map(|p| p[1] / p[0] - 1.0);
        report.claim(&format!("pad {name} by 0.1 mm: change of force"), changes, 0.03);
    }
}

fn truth_row(resolution: usize, pad: f64, offset: f64, truth: (f64, f64)) -> [f64; 2] {
    let ours = truth::small_strain(resolution, pad, [offset, 0.0]);
    let errors = [ours.0 / truth.0 - 1.0, ours.1 / truth.1 - 1.0];
    let stiffness = format!("{:.1} | {:.1} | {}", ours.0, truth.0, percent(errors[0]));
    let d = format!("{:.4} | {:.4} | {}", ours.1, truth.1, percent(errors[1]));
    row!("{resolution} | {pad} | {offset} | {stiffness} | {d}");
    errors
}

pub fn peers() {
    heading(
        "Beside the peers",
        "The same squeeze in Drake (linear corotated, 1080 tetrahedra, 2 ms) and MuJoCo (flex, St. Venant–Kirchhoff, same tetrahedra, \
         2 ms), measured outside softvt (`tests/reference/rows/peers.jsonl`); ours at 60 Hz, same 343 nodes. *least det*: det F or \
         volume ratio. [performance.md](performance.md#beside-other-simulators) has other simulators, and MuJoCo at other \
         settings.",
    );
    header("gap mm | who | holds | F grip | F hold | D hold % | creep mm/s | least det");
    let all = rows("peers");
    for ours in all.iter().filter(|r| r.text("peer") == "drake") {
        let gap = ours.number("gap_mm");
        peer_row(gap, "softvt", &run(&Squeeze::default().gap_mm(gap)));
        for r in all.iter().filter(|r| r.number("gap_mm") == gap) {
            let n = |key: &str| r.number(key);
            let outcome = Outcome {
                holds: r.flag("holds"),
                force_grip_n: n("force_grip_n"),
                force_hold_n: n("force_hold_n"),
                d_hold_pct: n("d_hold_pct"),
                creep_mm_per_s: n("creep_mm_per_s"),
                min_det_f: n("min_volume_ratio"),
                ..Outcome::default()
            };
            peer_row(gap, r.text("peer"), &outcome);
        }
    }
}

fn peer_row(gap: f64, who: &str, o: &Outcome) {
    let Outcome { force_grip_n: grip, force_hold_n: hold, d_hold_pct: d, min_det_f: det, .. } = o;
    let (holds, creep) = (yes(o.holds), short(o.creep_mm_per_s));
    row!("{gap} | {who} | {holds} | {grip:.3} | {hold:.3} | {d:.3} | {creep} | {det:.3}");
}

pub fn light(report: &mut Report) {
    heading(
        "Light grasps",
        "*Ratio*: 2 μ F / m(g + 0.577 m/s²) with the reference's static force off the table; a grasp holds exactly where it is \
         above 1. At 49.8 mm Drake and MuJoCo hold what friction cannot carry.",
    );
    header("gap mm | ratio | Hz | holds | F hold | D peak / D hold | force ripple");
    let (mut wrong, mut overshoot, mut ripple) = (0.0, Vec::new(), Vec::new());
    for (gap, rate) in light::GAPS.into_iter().flat_map(|gap| [(gap, 60.0), (gap, 120.0)]) {
        let (ratio, ours) = (light::capacity_ratio(gap), light::grasp(gap, 1.0 / rate));
        let peak = ours.d_peak_pct / ours.d_hold_pct;
        if ours.holds {
            overshoot.push(peak);
            ripple.push(ours.ripple);
        }
        if (ratio - 1.0f64).abs() > 0.03 && ours.holds != (ratio > 1.0) {
            wrong += 1.0;
        }
        let held = |value: String| if ours.holds { value } else { "–".to_owned() };
        let [force, ripple] = [ours.force_hold_n, ours.ripple].map(|value| held(short(value)));
        let (holds, peak) = (yes(ours.holds), held(format!("{peak:.3}")));
        row!("{gap} | {ratio:.3} | {rate} | {holds} | {force} | {peak} | {ripple}");
    }
    report.claim("light grasps: wrong verdicts", [wrong], 0.0);
    report.claim("light grasps: D peak over D hold", overshoot, 1.1);
    report.claim("light grasps: ripple of the force", ripple, 1e-3);
}
