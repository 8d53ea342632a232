//! The press test of `scripts/calibrate.lua` on objects of the user.

use std::sync::OnceLock;

use crate::support::{Project, Run, assert_contains, files};

/// Options of a press that is as short as possible.
const SHORT: &str = "--step-mm=1 --within-mm=0.5";
/// The scripts read the assets of the project in which they are.
const CALIBRATE: (&str, &str) = ("scripts/calibrate.lua", include_str!("../../scripts/calibrate.lua"));
const BRICK: (&str, &str) = ("assets/brick.lua", include_str!("../data/brick.lua"));
/// Strains of the material of the brick.
const STRAINS: &str = "collapse_strain = 0.12, damage_strain = 0.3";
const CHECK: (&str, &str) =
    ("scripts/check_calibration.lua", include_str!("../../scripts/check_calibration.lua"));

/// The short calibration of the brick, into a folder of the project.
fn quick<'a>(project: &'a Project, out: &str) -> Run<'a> {
    project.run(CALIBRATE.0).options(SHORT).options("--asset=brick").out(out)
}

/// The message with which an experiment is refused.
fn refusal(run: &Run) -> String {
    let (rows, outcome) = run.experiment();
    assert!(rows.is_empty(), "{rows:?}");
    outcome.expect_err("a refusal")
}

/// A project with the brick of `tests/data/brick.lua`, whose material has the given fields besides.
fn brick(material: &str) -> Project {
    let project = Project::new(&[BRICK, CALIBRATE, CHECK]);
    project.replace(BRICK.0, "{}", &format!("{{ {material} }}"));
    project
}

/// The short calibration of a brick with both strains, on one thread, in the folder `run`. Tests share it.
fn calibrated() -> &'static Project {
    static CALIBRATED: OnceLock<Project> = OnceLock::new();
    CALIBRATED.get_or_init(|| {
        let project = Project::shared("calibration", &[BRICK, CALIBRATE, CHECK]);
        project.replace(BRICK.0, "{}", &format!("{{ {STRAINS} }}"));
        let (_, outcome) = quick(&project, "run").threads(1).experiment();
        assert_contains(
            outcome.expect("a limit"),
            "pressed until 5 % of the volume was beyond the stable strain 0.12",
        );
        project
    })
}

/// The limit in a folder with a calibration of the brick.
fn limit(project: &Project, out: &str) -> f64 {
    let file = project.json(&format!("{out}/assets/calibration/brick.json"));
    file["thresholds"]["brick"]["tau"].as_f64().expect("a limit")
}

#[test]
fn the_limit_is_the_objects_own_and_its_calibration_repeats_bit_for_bit() {
    let files = |project: &Project| {
        ["json", "sweep.jsonl", "svg", "txt"]
            .map(|end| project.text(&format!("run/assets/calibration/brick.{end}")))
    };
    let first = files(calibrated());
    let file: serde_json::Value = serde_json::from_str(&first[0]).expect("JSON");
    assert_eq!((&file["schema_version"], &file["calibration"]["protocol"]), (&2.into(), &"press".into()));
    let envelope = &file["envelopes"]["brick"];
    assert!(envelope["censored"].is_null(), "{envelope}");
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or_else(|| panic!("a number: {value}"));
    let window = &envelope["window"];
    let extent = number(&window["width_lower_mm"]) - number(&window["width_at_tau_mm"]);
    assert!(extent > 0.2 && number(&envelope["width_contact_mm"]) <= 36.0, "{window}");
    assert!(number(&window["force_at_tau_n"]) > number(&window["force_lower_n"]), "{window}");
    let variants = envelope["variants"].as_array().expect("presses of variants");
    assert!(
        variants.len() == 7
            && variants.iter().all(|variant| variant["rows"].as_array().is_some_and(|rows| rows.len() > 5))
    );
    let second = brick(STRAINS);
    quick(&second, "run").threads(2).rows();
    assert_eq!(files(&second), first);
}

#[test]
fn assets_without_a_window_are_told_with_the_files_of_all_assets() {
    let project = brick("collapse_strain = 0.004");
    let text = project.text("assets/brick.lua");
    let wide = text.replace("\"brick\"", "\"wide\"").replace("0.04, 0.03, 0.024", "0.09, 0.085, 0.024");
    // Its own weight strains it by 0.002.
    let sagging = text.replace("\"brick\"", "\"sagging\"").replace("0.004", "0.001");
    for (name, text) in [("wide", &wide), ("sagging", &sagging)] {
        project.write(&format!("assets/{name}.lua"), text.as_bytes());
    }
    let run = project.run(CALIBRATE.0).options(SHORT).options("--asset=brick,wide,sagging").out("run");
    let (rows, outcome) = run.experiment();
    assert!(!rows.is_empty());
    let message = outcome.expect_err("assets without a window");
    for part in [
        "brick: no safe window: ",
        ", and D passes τ at ",
        "give it more friction",
        "wide: no safe window: no hold trial was run, and there is no τ (the press ended early: it is 91 mm wide",
        "sagging: no safe window: no hold trial was run, and there is no τ (the press ended early: 5 % of the volume",
    ] {
        assert_contains(&message, part);
    }
    for name in ["brick", "wide", "sagging"] {
        assert!(project.path(&format!("run/assets/calibration/{name}.svg")).exists(), "{name}");
    }
    let reason = |name: &str| {
        let file = project.json(&format!("run/assets/calibration/{name}.json"));
        file["envelopes"][name]["censored"].as_str().unwrap_or_default().to_owned()
    };
    assert!(reason("wide").contains("91 mm wide where the fingers grasp it"), "{}", reason("wide"));
    assert!(
        reason("sagging").contains("beyond the stable strain before the pads touch"),
        "{}",
        reason("sagging")
    );
    assert!(!project.text("run/assets/calibration/wide.txt").contains("lower bound"));
}

#[test]
#[ignore = "slow: two calibrations, with presses on a fine mesh"]
fn the_place_of_the_shape_and_the_step_of_the_physics_do_not_change_the_limit() {
    let nominal = limit(calibrated(), "run");
    let moved = brick(STRAINS);
    moved.replace(BRICK.0, ":grounded()", ":grounded():translate(0.006, 0.004, 0)");
    quick(&moved, "run").rows();
    assert!((limit(&moved, "run") / nominal - 1.0).abs() < 1e-3);
    let fine = brick(STRAINS);
    quick(&fine, "run").set("physics.dt", 0.01).rows();
    let fine = limit(&fine, "run");
    assert!((fine / nominal - 1.0).abs() < 0.02, "{fine} and {nominal}");
}

#[test]
#[ignore = "slow: 20 s of presses; the other tests calibrate by one step"]
fn any_step_and_accuracy_end_a_calibration() {
    // Widths are multiples of 0.01 mm, which these are not.
    let project = brick("collapse_strain = 0.05");
    for (out, options) in
        [("a", "--step-mm=0.625 --within-mm=0.5"), ("b", "--step-mm=0.833 --within-mm=0.01")]
    {
        project.run(CALIBRATE.0).options("--asset=brick").options(options).out(out).rows();
    }
}

#[test]
#[ignore = "slow: a calibration and eight presses on fine meshes"]
fn a_calibration_is_checked_for_the_object_that_was_calibrated() {
    let project = brick("collapse_strain = 0.12");
    // 5 % of the window are 0.1 mm.
    project.run(CALIBRATE.0).options("--step-mm=1 --within-mm=0.05 --asset=brick").out("run").rows();
    let file = "assets/calibration/brick.json";
    project.write(file, project.text(&format!("run/{file}")).as_bytes());
    let check = |options: &str| project.run(CHECK.0).options("--asset=brick").options(options);
    let all = || check("--trials=1 --expert-trials=1 --step-mm=1");
    let rows = all().out("checked").rows();
    let row = |check: &str| {
        rows.iter().find(|row| row["check"] == check).unwrap_or_else(|| panic!("{check}: {rows:?}"))
    };
    // Both ends are tried with the displacements of the calibration and with those of the expert's grasps.
    for check in ["loose_inside", "loose_outside", "tight_inside", "tight_outside"] {
        let spreads: Vec<_> =
            rows.iter().filter(|row| row["check"] == check).map(|row| row["spread_mm"].as_f64()).collect();
        assert_eq!(spreads, [Some(0.25), Some(1.5)], "{check}");
    }
    let d_ref = |check: &str| row(check)["d_ref_pct"].as_f64().expect("D_ref");
    assert!((d_ref("half_step") / d_ref("nominal") - 1.0).abs() < 0.05);
    assert!((d_ref("finer") / d_ref("nominal") - 1.0).abs() < 0.05);
    let force = |check: &str| row(check)["force_end_n"].as_f64().expect("a force");
    assert!((force("nominal") / force("converged") - 1.0).abs() < 0.2);
    assert_eq!((&row("loose_outside")["held"], &row("tight_inside")["held"]), (&0.into(), &1.into()));
    let softer = project.text("assets/brick.lua").replace("4e4", "1e4");
    project.write("assets/brick.lua", softer.as_bytes());
    assert_contains(
        refusal(&all().out("stale")),
        "brick has no calibrated window, or one of another shape, material",
    );
}

#[test]
fn the_calibration_of_a_finer_mesh_changes_no_draw() {
    let project = brick(STRAINS);
    project.write("x.lua", include_bytes!("../data/drawn_bricks.lua"));
    let reference = "assets/draws/brick.json";
    let take = |from: &Project| {
        for (path, bytes) in files(&from.path("run/assets")) {
            project.write(&format!("assets/{path}"), &bytes);
        }
    };
    let drawn = |out: &str| -> (Vec<_>, Vec<f64>) {
        let records = project.run("x.lua").policy("noop").out(out).records();
        let of_run = records.into_iter().map(|record| {
            let mut one = record.header.variation.expect("varied").objects["brick"];
            let hidden = one.hidden.as_mut().expect("hidden");
            let ratio = std::mem::replace(&mut hidden.window_ratio, 0.0);
            (one, ratio)
        });
        of_run.unzip()
    };
    take(calibrated());
    assert!(project.path(reference).exists(), "a reference of the first calibration");
    let (instances, ratios) = drawn("coarse");
    assert!(project.json("coarse/run.json")["sources"].to_string().contains(reference));
    project.replace(BRICK.0, "resolution = 4", "resolution = 5");
    quick(&project, "run").rows();
    assert!(!project.path("run").join(reference).exists(), "the reference of the first stays");
    take(&project);
    let (again, other_ratios) = drawn("fine");
    assert_eq!(again, instances);
    assert_ne!(other_ratios, ratios);
    std::fs::remove_file(project.path(reference)).expect("removed");
    assert_contains(
        project.run("x.lua").policy("noop").error(),
        "no draw reference (assets/draws/brick.json)",
    );
}
