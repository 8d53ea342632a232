//! The press test of `scripts/calibrate.lua` on objects of the user.

use crate::support::{Project, Run, files};

/// Options of a press that is as short as possible.
const SHORT: &str = "--step-mm=1 --within-mm=0.5";
/// The scripts read the assets of the project in which they are.
const CALIBRATE: (&str, &str) = ("scripts/calibrate.lua", include_str!("../../scripts/calibrate.lua"));
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

/// A project with a small brick of coarse voxels, whose material has the given fields besides.
fn brick(material: &str) -> Project {
    let text = format!(
        "return softvt.asset {{\n  name = 'brick',\n  \
         shape = softvt.shape.box {{ size = {{ 0.04, 0.03, 0.024 }} }}:round(0.003):grounded(),\n  \
         body = softvt.soft {{ youngs_pa = 4e4, poisson = 0.3, density = 300, resolution = 4, grasp_spacing = 0.003, {material} }},\n}}\n"
    );
    Project::new(&[("assets/brick.lua", &text), CALIBRATE, CHECK])
}

#[test]
fn the_limit_is_the_objects_own_and_its_calibration_repeats_bit_for_bit() {
    let project = brick("collapse_strain = 0.12, damage_strain = 0.3");
    let calibrated = |out: &str, threads| {
        let (_, outcome) = quick(&project, out).threads(threads).experiment();
        let text = outcome.expect("a limit");
        assert!(text.contains("pressed until 5 % of the volume was beyond the stable strain 0.12"), "{text}");
        ["json", "sweep.jsonl", "svg", "txt"]
            .map(|end| project.text(&format!("{out}/assets/calibration/brick.{end}")))
    };
    let first = calibrated("first", 1);
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
    assert_eq!(calibrated("second", 2), first);
}

#[test]
fn a_material_without_strains_is_calibrated_with_a_warning() {
    let (_, outcome) = quick(&brick(""), "run").experiment();
    let text = outcome.expect("a limit");
    assert!(text.contains("censored: the press ended early"), "{text}");
    assert!(text.contains("State collapse_strain in its softvt.soft"), "{text}");
}

#[test]
fn a_limit_that_rounds_to_nothing_is_no_result() {
    let project = brick("");
    let stiff = project.text("assets/brick.lua").replace("4e4", "4e10");
    project.write("assets/brick.lua", stiff.as_bytes());
    let run = quick(&project, "run");
    let message = run.experiment().1.expect_err("no limit");
    assert!(
        message.contains("brick: τ is ") && message.contains("outside of the usual range 300..10000000 Pa"),
        "{message}"
    );
    assert!(!project.path("run/assets/calibration/brick.json").exists());
}

#[test]
fn a_strain_out_of_range_is_refused() {
    for (strain, got) in
        [("collapse_strain = 0", "0"), ("damage_strain = 1.5", "1.5"), ("damage_strain = -0.1", "-0.1")]
    {
        let message = refusal(&quick(&brick(strain), "run"));
        assert!(message.starts_with("assets/brick.lua:4: asset.body"), "{message}");
        assert!(message.contains("above 0") && message.ends_with(&format!("got {got}")), "{message}");
    }
}

#[test]
fn an_asset_that_is_too_thin_is_refused_at_its_own_line() {
    let project = brick("collapse_strain = 0.12");
    let flat = project.text("assets/brick.lua").replace("0.03, 0.024 } }:round(0.003)", "0.03, 0.004 } }");
    project.write("assets/brick.lua", flat.as_bytes());
    let message = refusal(&quick(&project, "run"));
    assert!(
        message.starts_with("assets/brick.lua:3: world:soft: asset brick: it is 4 mm thick"),
        "{message}"
    );
}

#[test]
fn assets_without_a_window_are_told_with_the_files_of_all_assets() {
    let project = brick("collapse_strain = 0.002");
    let sound = project.text("assets/brick.lua").replace("0.002", "0.12").replace("'brick'", "'sound'");
    let wide = sound.replace("'sound'", "'wide'").replace("0.04, 0.03, 0.024", "0.09, 0.085, 0.024");
    let sagging = sound.replace("'sound'", "'sagging'").replace("4e4", "4e2").replace("0.12", "0.004");
    for (name, text) in [("sound", &sound), ("wide", &wide), ("sagging", &sagging)] {
        project.write(&format!("assets/{name}.lua"), text.as_bytes());
    }
    let run = project.run(CALIBRATE.0).options(SHORT).options("--asset=brick,sound,wide,sagging").out("run");
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
        assert!(message.contains(part), "{part}: {message}");
    }
    assert!(!message.contains("sound:"), "{message}");
    for name in ["brick", "sound", "wide", "sagging"] {
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
fn the_place_of_the_shape_and_the_step_of_the_physics_do_not_change_the_limit() {
    let limit = |place: &str, dt: Option<f64>| {
        let project = brick("collapse_strain = 0.12");
        let moved = project.text("assets/brick.lua").replace(":grounded()", place);
        project.write("assets/brick.lua", moved.as_bytes());
        let run = quick(&project, "run");
        dt.map_or(run.clone(), |dt| run.set("physics.dt", dt)).rows();
        let file = project.json("run/assets/calibration/brick.json");
        file["thresholds"]["brick"]["tau"].as_f64().expect("a limit")
    };
    let nominal = limit(":grounded()", None);
    assert!((limit(":grounded():translate(0.006, 0.004, 0)", None) / nominal - 1.0).abs() < 1e-3);
    let fine = limit(":grounded()", Some(0.01));
    assert!((fine / nominal - 1.0).abs() < 0.02, "{fine} and {nominal}");
}

#[test]
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
    assert_ne!(d_ref("resolution_6"), d_ref("resolution_12"));
    assert_eq!((&row("loose_outside")["held"], &row("tight_inside")["held"]), (&0.into(), &1.into()));
    for (words, part) in [
        ("--part=numerics --trials=3", "--trials does nothing with --part numerics"),
        ("--part=ends --step-mm=2", "--step-mm does nothing with --part ends"),
        ("--trials=3", "--trials 3: give an output folder"),
    ] {
        let message = refusal(&check(words));
        assert!(message.contains(part), "{words}: {message}");
    }
    let softer = project.text("assets/brick.lua").replace("4e4", "1e4");
    project.write("assets/brick.lua", softer.as_bytes());
    let message = refusal(&all().out("stale"));
    assert!(
        message.contains("brick has no calibrated window, or one of another shape, material"),
        "{message}"
    );
}

#[test]
fn the_calibration_of_a_finer_mesh_changes_no_draw() {
    let project = brick("collapse_strain = 0.12");
    let suite = r#"
local brick = require "assets.brick"
local floor = softvt.asset { name = "floor", shape = softvt.shape.box { size = { 1, 1, 0.05 } }:translate(0, 0, -0.025), body = softvt.static {} }
local layout = softvt.layout("one", function(scene)
  scene:add { name = "floor", asset = floor, position = { 0, 0, 0 } }
  scene:add { name = "brick", asset = brick, at = { 0, 0.1 } }
  scene:add { name = "post", asset = floor, position = { 0, 2, 0 } }
end)
return softvt.suite { name = "one", object_type = "deformable", tasks_differ_in = "spatial", episodes = 4, tasks = { softvt.task {
  prompt = "wait", layout = layout, goal = softvt.on { object = "brick", target = "post" }, budget_steps = 1 } },
  vary = softvt.variation { name = "test", size = { 0.9, 1.1 }, stiffness = { 1, 1 }, density = { 1, 1 }, friction = { 1, 1 },
    colour = 0, light = { 1, 1 }, camera_offset = 0, camera_rotation = 0, hidden = { aeration = { 0.5, 2.5 }, staling = { 1, 6 },
    filling = { 1, 4 }, coating = { 0.2, 1.5 }, window_ratio = { 1.2, 3 } } } }"#;
    project.write("x.lua", suite.as_bytes());
    let reference = "assets/draws/brick.json";
    let calibrate = |out: &str| {
        quick(&project, out).rows();
        for (path, bytes) in files(&project.path(&format!("{out}/assets"))) {
            project.write(&format!("assets/{path}"), &bytes);
        }
        project.path(&format!("{out}/{reference}")).exists()
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
    assert!(calibrate("first"), "a reference of the first calibration");
    let (instances, ratios) = drawn("coarse");
    assert!(project.json("coarse/run.json")["sources"].to_string().contains(reference));
    let finer = project.text("assets/brick.lua").replace("resolution = 4", "resolution = 5");
    project.write("assets/brick.lua", finer.as_bytes());
    assert!(!calibrate("second"), "the reference of the first stays");
    let (again, other_ratios) = drawn("fine");
    assert_eq!(again, instances);
    assert_ne!(other_ratios, ratios);
    std::fs::remove_file(project.path(reference)).expect("removed");
    let message = project.run("x.lua").policy("noop").error();
    assert!(message.contains("no draw reference (assets/draws/brick.json)"), "{message}");
}

#[test]
fn a_calibration_refuses_what_does_nothing_and_what_would_replace_the_limits() {
    let project = brick("collapse_strain = 0.12");
    for (words, part) in [
        ("--sweep-protocol=hand --step-mm=1", "--step-mm does nothing with --sweep-protocol hand"),
        ("--trials=3", "--trials does nothing with --sweep-protocol press"),
        ("--sweep-protocol=hand", "--sweep-protocol hand: give an output folder"),
        ("--kappa=0.3", "--kappa 0.3: give an output folder"),
        ("--asset=brick,brick", "--asset names brick twice"),
        ("--asset=table", "table is not soft"),
        ("--asset=bricks", "calibrate: --asset bricks: no assets/bricks.lua in "),
    ] {
        let asset = if words.contains("--asset") { "" } else { "--asset=brick" };
        let message = refusal(&project.run(CALIBRATE.0).options(asset).options(words));
        assert!(message.contains(part), "{words}: {message}");
    }
    let slow = project
        .text("assets/brick.lua")
        .replace("name = 'brick',", "name = 'brick', hints = { carry_pace = 0 },");
    project.write("assets/brick.lua", slow.as_bytes());
    let message = refusal(&quick(&project, "slow"));
    assert!(
        message.contains("the hint carry_pace of brick: expected a number in 0..1, above 0, got 0"),
        "{message}"
    );
}

#[test]
fn an_object_that_falls_over_before_the_press_is_told_so() {
    let project = brick("collapse_strain = 0.002");
    let upright = "softvt.shape.box { size = { 0.04, 0.03, 0.024 } }:round(0.003)";
    let leaning = "softvt.shape.box { size = { 0.02, 0.02, 0.05 } }:rotate({ axis = 'y', angle = 0.6 })";
    let text = project.text("assets/brick.lua");
    assert!(text.contains(upright), "{text}");
    project.write("assets/brick.lua", text.replace(upright, leaning).as_bytes());
    let message = quick(&project, "run").experiment().1.expect_err("no window");
    assert!(
        message.contains("brick: no safe window: ") && message.contains(": it falls over by "),
        "{message}"
    );
    assert!(
        message.contains("model it as it comes to rest") && !message.contains("more friction"),
        "{message}"
    );
}
