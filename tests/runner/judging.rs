//! Judging of rigid and soft targets on rigid and soft supports.

use std::collections::BTreeSet;

use softvt::{
    evaluation::{
        calibration::{CalibrationMeasurements, Envelope, SweepProtocol, SweepRow},
        stage::TaskStage,
        thresholds::ThresholdFile,
        verdict::Verdict,
    },
    report::{styled_text::TerminalFormat, terminal},
    runner::TraceDetail,
};

use crate::support::{Finished, Project, Run, SOLIDS, Small, assert_contains};

#[test]
fn rigid_targets_need_no_deformation_limit() {
    let project = Project::of("blocks.lua");
    project.write("assets/block.lua", include_bytes!("../data/block.lua"));
    let result = project.run("x.lua").out("run").trace(TraceDetail::State).finish().result();
    assert_eq!(result.records.len(), 2);
    for record in &result.records {
        let verdict = &record.verdict;
        assert!(verdict.goal && verdict.no_drop && verdict.safety && verdict.no_slip, "{verdict:#?}");
        assert_eq!(
            (verdict.object().deformation_ok, verdict.object().d_peak, verdict.object().tau),
            (None, None, None)
        );
        assert!(verdict.object().mean_pad_force_n > 0.5, "{verdict:#?}");
    }
    assert_eq!(result.summary.scores.safety_success_rate.rate, None, "no soft target was judged");
    for record in project.run("x.lua").policy("expert-binary").records() {
        assert!(record.verdict.safety, "a rigid block bears a binary gripper: {:#?}", record.verdict);
    }
    for record in project.run("x.lua").policy("noop").records() {
        assert!(!record.verdict.goal && record.verdict.no_drop, "{:#?}", record.verdict);
    }
}

#[test]
fn objects_are_supported_by_what_they_rest_on() {
    for (upper, lower) in [
        ("soft", "soft"),
        ("soft", "rigid"),
        ("soft", "static"),
        ("rigid", "soft"),
        ("rigid", "rigid"),
        ("rigid", "static"),
    ] {
        let project = Project::of("stack.lua");
        project.replace("x.lua", "UPPER", upper);
        project.replace("x.lua", "LOWER", lower);
        let verdicts = project.run("x.lua").records().into_iter().map(|record| record.verdict);
        let verdicts: Vec<_> = verdicts.collect();
        let goals: Vec<bool> = verdicts.iter().map(|verdict| verdict.goal).collect();
        assert_eq!(goals, [true, false], "{upper} on {lower}: {verdicts:#?}");
        assert!(verdicts.iter().all(|verdict| verdict.no_drop), "{upper} on {lower}: {verdicts:#?}");
        // Harm of the target to a soft support is recorded, also if the support is not the goal.
        for verdict in &verdicts {
            assert_eq!(verdict.d_peak_other.is_some(), lower == "soft", "{upper} on {lower}: {verdict:#?}");
            let expected = (lower != "soft").then_some(true);
            assert_eq!(verdict.others_ok, expected, "no limit: {verdict:#?}");
        }
        assert_eq!((verdicts[0].failed_stage, verdicts[1].failed_stage), (None, Some(TaskStage::Grasp)));
    }
}

/// The calibration of a cube with a fingerprint, from one squeeze.
fn calibration(fingerprint: &str) -> String {
    let squeeze = SweepRow {
        width_mm: 38.0,
        closure: None,
        d_pct: 2.0,
        d_v1_pct: None,
        force_n: 1.0,
        strain_p95: None,
        min_det_f: 0.6,
        node_speed_m_s: 0.0,
        both_pads: true,
        slip_mm: 0.0,
        stable: true,
    };
    let scans = CalibrationMeasurements {
        protocol: SweepProtocol::Hand,
        sweep: vec![squeeze],
        ..CalibrationMeasurements::default()
    };
    let mut file = ThresholdFile::new(0.5, Vec::new(), "x".to_owned());
    assert!(file.insert("cube", Envelope::new(scans, 0.5)));
    file.fingerprints.insert("cube".to_owned(), fingerprint.to_owned());
    file.to_text()
}

#[test]
fn limits_apply_only_to_the_calibrated_object() {
    let project = |stiffness: &str, plan: &str| {
        let project = Project::of("pushed_cube.lua");
        project.replace("x.lua", "STIFFNESS", stiffness);
        project.replace("x.lua", "PLAN", plan);
        project
    };
    let rows = project("2e4", "who").run("x.lua").rows();
    let limit = calibration(rows[0]["fingerprint"].as_str().expect("a text"));
    let safe = |stiffness: &str, change: fn(Run) -> Run| -> Vec<bool> {
        let project = project(stiffness, "suite");
        project.write("assets/calibration/cube.json", limit.as_bytes());
        change(project.run("x.lua")).records().iter().map(|record| record.verdict.safety).collect()
    };
    assert_eq!(safe("2e4", |run| run), [true, true]);
    assert_eq!(safe("2e4", |run| run.shift("soft", 0.5)), [true, true], "limits stay nominal");
    // One stiffness in the first episode and others later, under one name.
    assert_eq!(safe("rng:uniform(0, 1) < 2 and 2e4 * (1 + episode)", |run| run), [false, false]);
    assert_eq!(safe("3e4", |run| run), [false, false]);
}

/// A suite of soft cubes, with calibrations of the assets `cube` and `small`. Layout `drawn` places one of the two;
/// layout `changed` runs `change` on a cube.
fn calibrated(change: &str) -> Project {
    let project = Project::of("cubes.lua");
    project.replace("x.lua", "-- CHANGE", change);
    project.write("who.lua", project.text("x.lua").replace("return suite", "return who").as_bytes());
    for row in project.run("who.lua").rows() {
        let [asset, fingerprint] = ["asset", "fingerprint"].map(|key| row[key].as_str().expect("a text"));
        let text = calibration(fingerprint).replace("\"cube\":", &format!("\"{asset}\":"));
        project.write(&format!("assets/calibration/{asset}.json"), text.as_bytes());
    }
    project
}

#[test]
fn a_limit_holds_for_every_instance_of_its_asset() {
    let project = calibrated(
        "cube.youngs_pa = 2e4 * (1 + u) cube.density = 200 + 100 * u cube.static_mu = 0.9 cube.dynamic_mu = 0.7 + 0.1 * u",
    );
    let finished = project.run("x.lua").out("run").finish();
    let messages = finished.messages.clone();
    let records = finished.records();
    let is_safe = |verdict: &Verdict| verdict.object().tau == Some(1.0) && verdict.safety;
    assert!(records.iter().all(|record| is_safe(&record.verdict)), "{records:#?}");
    let assets: BTreeSet<&str> = records.iter().map(|record| record.header.asset.as_str()).collect();
    assert_eq!(assets.len(), 2, "both assets are drawn: {assets:?}");
    assert!(!messages.contains("calibrat") && !messages.contains("no limit"), "{messages}");
    assert_eq!(project.json("run/run.json")["thresholds"], serde_json::json!({ "cube": 1.0, "small": 1.0 }));
}

#[test]
fn another_object_has_no_limit_and_check_and_run_say_so() {
    let project = calibrated("if u > 0.5 then cube.poisson = 0.4 end");
    let warning = "no limit for object \"cube\": it has Poisson's ratio 0.4 instead of 0.3 of asset \"cube\"";
    let check = project.run("x.lua");
    check.clone().check().expect("valid");
    let told = check.told();
    let line = told.lines().find(|line| line.contains(warning)).expect("a warning of the check");
    assert!(line.starts_with("task 1 episode "), "{line}");
    let Finished { results, messages } = project.run("x.lua").finish();
    assert_contains(&messages, line);
    let judged = |task: usize| {
        let of_task = results[0].records.iter().filter(|record| record.header.id.task == task);
        of_task.filter(|record| record.verdict.object().tau == Some(1.0)).count()
    };
    assert_eq!(judged(0), 4);
    assert!((1..4).contains(&judged(1)), "{:#?}", results[0].records);
}

/// A suite with a soft cube that has the name of a calibrated object, and the calibration of that object.
fn impostor(fingerprint: &str) -> Project {
    let project = Small::default().project();
    project.write("assets/calibration/cube.json", calibration(fingerprint).as_bytes());
    project
}

#[test]
fn limits_of_other_versions_are_ignored() {
    let told = |project: &Project| project.run("x.lua").policy("noop").out("run").finish().messages;
    let project = impostor("0123456789abcdef");
    let messages = told(&project);
    let other = "assets/calibration/cube.json was computed for a different version of \"cube\"";
    assert_contains(&messages, other);
    let mut file = project.json("assets/calibration/cube.json");
    file.as_object_mut().expect("a document").remove("fingerprints");
    let project = Small::default().project();
    project.write("assets/calibration/cube.json", file.to_string().as_bytes());
    let messages = told(&project);
    assert_contains(&messages, other);
    let project = Small::default().project();
    let who = "return softvt.experiment { name = 'who', grid = { x = { 1 } }, run = function()
      return { fingerprint = softvt.simulate { layout = layout }:measure 'cube'.fingerprint } end }\n";
    let text = project.text("x.lua");
    let (scene, _) = text.split_once("return softvt.suite").expect("a suite");
    project.write("who.lua", format!("{scene}{who}").as_bytes());
    let rows = project.run("who.lua").rows();
    let project = impostor(rows[0]["fingerprint"].as_str().expect("a text"));
    let messages = told(&project);
    assert!(!messages.contains("different version"), "{messages}");
    assert_eq!(project.json("run/run.json")["thresholds"]["cube"], 1.0);
}

#[test]
fn a_goal_that_counts_its_calls_is_reached_without_contact_and_named() {
    let suite = r#"local solids = require "solids"
local calls = 0
local layout = softvt.layout("cheat", function(scene)
  scene:add { name = "floor", asset = solids.floor, position = { 0, 0, 0 } }
  scene:add { name = "cube", asset = solids.cube, at = { 0, -0.1 } }
end)
local goal = softvt.predicate { name = "counted", holds = function() calls = calls + 1 return calls > 8 end }
return softvt.suite { name = "cheat", object_type = "rigid", tasks_differ_in = "spatial", episodes = 1, tasks = {
  softvt.task { prompt = "cheat", layout = layout, object = "cube", budget_steps = 20, goal = goal } } }"#;
    let project = Project::new(&[("x.lua", suite), SOLIDS]);
    let result = project.run("x.lua").policy("noop").out("run").finish().result();
    let verdict = &result.records[0].verdict;
    assert!(verdict.goal && verdict.goal_untouched, "{verdict:#?}");
    let told = "the goal was reached in 1 episode without contact of the robot with a target (first: task 0 episode 0)";
    let table = terminal::table(&result.summary, TerminalFormat::PLAIN);
    let words: Vec<&str> = table.split_whitespace().collect();
    assert!(words.join(" ").contains(told), "{table}");
    let report = project.report(&["run"]);
    assert_eq!(report.warnings, [format!("run: {told}")]);
    assert!(report.html.contains(told));
}
