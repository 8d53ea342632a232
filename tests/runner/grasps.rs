//! Grasps: forces of the pads and of the tactile sensors, on objects of all kinds.

use serde_json::Value;
use softvt::{runner::TraceDetail, script::ExperimentRow};

use crate::support::{Project, Small};

/// A number of a row.
fn number(row: &ExperimentRow, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("{key} in {row:?}"))
}

/// Numbers of a list.
fn numbers(list: &Value) -> Vec<f64> {
    list.as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
}

#[test]
fn an_expert_sees_parts_and_joints() {
    let output = Project::of("open_chest.lua").run("x.lua").error();
    assert!(output.ends_with("x.lua:36: all seen"), "{output}");
}

#[test]
fn pad_forces_are_the_normal_forces_at_all_contacts_of_a_pad() {
    let rows = Project::of("handle.lua").run("x.lua").rows();
    let text = serde_json::to_string(&rows).expect("JSON");
    assert!(!text.contains("[-0.0,"), "{text}");
    let case = |name: &str| rows.iter().find(|row| row["case"] == name).expect("both cases");
    for side in 0..2 {
        let row = case("grip");
        let force = numbers(&row["arm"])[side];
        assert!(force > 1.0, "both pads hold the bar: {row:?}");
        // Each pad touches the handle alone.
        assert_eq!(numbers(&row["handle"])[side], force, "{row:?}");
        assert_eq!(numbers(&row["on"])[side], force, "{row:?}");
        // The normals of a bar of 4.5 mm radius, 0.4 mm deep in the gel, are within 25° of the pressing direction, and
        // the shear has a part along it.
        let pressing = -numbers(&row["gel"][side])[2];
        assert!((force / pressing - 1.0).abs() < 0.05, "{row:?}");
    }
    let row = case("edge");
    let side =
        (0..2).max_by(|a, b| numbers(&row["arm"])[*a].total_cmp(&numbers(&row["arm"])[*b])).unwrap_or(0);
    let (force, gel) = (numbers(&row["arm"])[side], numbers(&row["gel"][side]));
    assert!(force > 1.0 && numbers(&row["on"])[side] == force, "{row:?}");
    // Without friction the force on the gel is the vector sum of the normal forces, here of nearly one direction.
    let resultant = gel.iter().map(|component| component * component).sum::<f64>().sqrt();
    assert!(resultant <= force && force < 1.02 * resultant, "{row:?}");
    // The direction is oblique: the component along the pad's axis is much smaller.
    assert!(force > 1.5 * -gel[2], "{row:?}");
}

#[test]
fn the_pads_press_with_the_commanded_force() {
    let project = Small { task: "budget_steps = 230", ..Small::default() }.project();
    project.write("force.lua", include_bytes!("../data/three_newtons.lua"));
    project.run("x.lua").policy("force.lua").out("run").trace(TraceDetail::State).record();
    let trace = project.lines("run/trace/task_000/episode_00000.jsonl");
    let force = |step: usize| -> [f64; 2] {
        std::array::from_fn(|side| trace[step]["pad_force_n"][side].as_f64().expect("a force"))
    };
    for (from, to, expected) in [(110, 125, 3.0), (145, 158, 3.0), (190, 218, 5.0)] {
        for step in from..to {
            let [left, right] = force(step);
            let mean = 0.5 * (left + right);
            assert!(
                (mean / expected - 1.0).abs() < 0.03,
                "step {step}: {left} N and {right} N of {expected} N"
            );
        }
    }
    let most = (60..160).map(|step| 0.5 * force(step).iter().sum::<f64>()).fold(0.0, f64::max);
    // The bound of the gripper's own tests: a tenth of the force, and 0.1 N.
    assert!(most < 1.1 * 3.0 + 0.1, "overshoot: {most} N");
    assert_eq!(force(228), [0.0; 2], "opened");
    assert!(project.is_reproduced("run", "0/0"));
}

#[test]
fn the_pads_press_with_the_force_of_a_grasp_on_average() {
    let rows = Project::of("grip_force.lua").run("x.lua").rows();
    assert_eq!(rows.len(), 3);
    for row in &rows {
        assert!((number(row, "ratio") - 1.0).abs() < 0.04 && number(row, "most") < 1.06, "{rows:?}");
    }
    assert!(number(&rows[1], "unequal") > 0.1, "the table holds the object back: {rows:?}");
}

#[test]
fn standard_objects_rest_and_do_not_turn_inside_out_in_a_shut_hand() {
    let rows = Project::of("shut_hand.lua").run("x.lua").rows();
    assert_eq!(rows.len(), 3);
    for row in rows {
        let [speed, change, det_f, force] =
            ["mm_s", "change_pct", "det_f", "force_n"].map(|key| number(&row, key));
        // Single outer nodes ring.
        assert!(speed < 50.0 && change < 0.1 && det_f > 0.1 && force > 10.0, "{row:?}");
    }
}

#[test]
fn objects_that_are_placed_for_stacking_are_centred() {
    let records = Project::of("towers.lua").run("x.lua").records();
    assert_eq!(records.len(), 4);
    for record in records {
        let offset_mm = record.stats.notes["offset_mm"];
        assert!(record.verdict.goal, "{record:?}");
        match record.header.id.task {
            0 => assert!(offset_mm < 0.2, "{offset_mm} mm"),
            _ => assert!(offset_mm > 0.2, "without the option: {offset_mm} mm"),
        }
    }
}

#[test]
fn an_object_that_settles_tilted_is_gripped_as_it_lies() {
    for record in Project::of("tilted.lua").run("x.lua").records() {
        assert!(record.verdict.goal, "{record:#?}");
    }
}

#[test]
fn a_turned_grasp_is_as_gentle_as_a_straight_one() {
    let grasp = |post_x: &str| {
        let project = Project::of("between_posts.lua");
        project.replace("x.lua", "POST_X", post_x);
        let record = project.run("x.lua").record();
        assert!(record.verdict.safety, "{record:?}");
        let share =
            record.verdict.object().d_peak.expect("measured") / record.verdict.object().tau.expect("a limit");
        (share, record.stats.notes["grip_width_mm"])
    };
    let (straight, turned) = (grasp("0.06"), grasp("0.022"));
    // The loaf is longer along the closing direction of the turned hand.
    assert!(turned.1 > straight.1 + 1.0, "widths {straight:?} {turned:?} mm");
    assert!(straight.0 < 0.8 && turned.0 < 0.9, "D/τ {straight:?} {turned:?}");
}

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
fn blocks_press_without_drift() {
    for (body, closure, density) in [
        ("softvt.rigid { density = 1700 }", "0.53", 1700.0),
        ("softvt.soft { youngs_pa = 8e4, poisson = 0.35, density = 900 }", "0.58", 900.0),
    ] {
        check(&rows(body, closure, "nil"), 0.06 * 0.04 * 0.05 * density * 9.81);
    }
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
