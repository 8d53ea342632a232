//! Tactile readings of a grasp: zero before it, gravity after lifting, and no drift in between.

use softvt::script::ExperimentRow;

use crate::support::Project;

fn rows(body: &str, closure: &str, settings: &str) -> Vec<ExperimentRow> {
    let project = Project::of("tactile_hold.lua");
    for (word, value) in [("BODY", body), ("CLOSURE", closure), ("SETTINGS", settings)] {
        project.replace("x.lua", word, value);
    }
    project.run("x.lua").rows()
}

#[test]
fn markers_follow_a_stuck_motion_by_the_shares_that_the_documentation_states() {
    let page =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/tactile.md")).expect("a page");
    let rows = Project::of("markers_follow.lua").run("x.lua").rows();
    for row in &rows {
        let start = format!("| {} |", row["shape"].as_str().expect("a text"));
        let stated = page.lines().find(|line| line.starts_with(&start)).expect("a row of the page");
        let stated: Vec<&str> = stated.split('|').skip(2).map(str::trim).collect();
        for (motion, stated) in ["sideways", "along", "twist"].into_iter().zip(stated) {
            let percent: f64 = stated.trim_end_matches(" %").parse().expect("a percentage");
            let found = 100.0 * number(row, motion);
            assert!(
                (found - percent).abs() < 2.0,
                "{start} {motion}: {found} %, and the page states {stated}"
            );
        }
    }
    assert_eq!(rows.len(), 2);
}

fn number(row: &ExperimentRow, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("{key} in {row:?}"))
}

/// Rows of a stage, left and right.
fn stage<'a>(rows: &'a [ExperimentRow], when: &str) -> [&'a ExperimentRow; 2] {
    let of: Vec<&ExperimentRow> = rows.iter().filter(|row| row["when"] == when).collect();
    [of[0], of[1]]
}

fn check(rows: &[ExperimentRow], weight_n: f64) {
    for row in stage(rows, "open") {
        assert_eq!((number(row, "most"), number(row, "depth_mm")), (0.0, 0.0), "nothing touches: {row:?}");
    }
    let (gripped, lifted, held) = (stage(rows, "gripped"), stage(rows, "lifted"), stage(rows, "held"));
    let mut carried = 0.0;
    for side in 0..2 {
        assert!(number(gripped[side], "depth_mm") > 0.01 && number(gripped[side], "most") > 0.1);
        let pull = |row: &ExperimentRow| row["force"][0].as_f64().expect("a number");
        carried -= pull(held[side]);
        // Gravity acts along the fingers towards their tips: to the left in both images.
        let moved = number(lifted[side], "x") - number(gripped[side], "x");
        let pulled = pull(lifted[side]) - pull(gripped[side]);
        assert!(pulled < -0.2 * weight_n && moved < 0.3 * pulled, "{moved} px for {pulled} N");
        for key in ["x", "y", "most"] {
            let drift = number(held[side], key) - number(lifted[side], key);
            assert!(drift.abs() < 0.005, "{key} drifts by {drift} px in two seconds");
        }
    }
    assert!((carried / weight_n - 1.0).abs() < 0.01, "{carried} N of {weight_n} N");
}

#[test]
fn rigid_blocks_press_without_drift() {
    let rows = rows("softvt.rigid { density = 1700 }", "0.53", "nil");
    check(&rows, 0.06 * 0.04 * 0.05 * 1700.0 * 9.81);
}

#[test]
fn soft_blocks_press_without_drift() {
    let rows = rows("softvt.soft { youngs_pa = 8e4, poisson = 0.35, density = 900 }", "0.58", "nil");
    check(&rows, 0.06 * 0.04 * 0.05 * 900.0 * 9.81);
}

#[test]
fn the_sensors_model_pitch_and_gel_are_settings() {
    let settings = "{ tactile = { markers = { model = \"fots\" }, view = { pitch = 5e-5 }, gel = { shear_modulus = 3e5 } } }";
    let stiff = rows("softvt.rigid { density = 1700 }", "0.53", settings);
    let plain = rows("softvt.rigid { density = 1700 }", "0.53", "nil");
    let (stiff, plain) = (stage(&stiff, "held")[0].clone(), stage(&plain, "held")[0].clone());
    assert!(number(&stiff, "depth_mm") < 0.9 * number(&plain, "depth_mm"));
    assert!(stiff["x"] != plain["x"] && stiff["mean"] != plain["mean"]);
}
