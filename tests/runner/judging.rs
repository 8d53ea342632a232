//! Judging of rigid and soft targets on rigid and soft supports.

use std::collections::BTreeSet;

use softvt::{
    evaluation::{
        calibration::{CalibrationMeasurements, Envelope, SweepProtocol, SweepRow},
        stage::TaskStage,
        thresholds::ThresholdFile,
        verdict::Verdict,
    },
    runner::TraceDetail,
};

use crate::support::{Finished, Project, Run, SOLIDS, Small};

/// A rigid block in the mirrored layout of the standard suite, written as a user would.
const BLOCKS: &str = r#"
local pick_place, layouts = require "experts.pick_place", require "layouts.spatial_soft"
return softvt.suite {
  name = "blocks", object_type = "rigid", tasks_differ_in = "spatial", episodes = 2,
  tasks = { softvt.task {
    prompt = "put the left block on the plate",
    layout = layouts.pair("block", 2),
    goal = softvt.on { object = "left", target = "plate", hold_s = 0.4 },
    expert = pick_place { object = "left", target = "plate" },
  } },
}
"#;

/// 0.2 kg.
const BLOCK: &str = r#"
return softvt.asset {
  name = "block",
  shape = softvt.shape.box { size = { 0.045, 0.045, 0.05 } }:grounded(),
  body = softvt.rigid { density = 2000 },
}
"#;

#[test]
fn rigid_targets_need_no_deformation_limit() {
    let project = Project::new(&[("blocks.lua", BLOCKS), ("assets/block.lua", BLOCK)]);
    let result = project.run("blocks.lua").out("run").trace(TraceDetail::State).finish().result();
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
    assert_eq!(result.summary.scores.safety_success_rate.rate, Some(100.0));
    let binary = project.run("blocks.lua").policy("expert-binary").finish().result();
    let rate = binary.summary.scores.safety_success_rate.rate;
    assert_eq!(rate, Some(100.0), "a rigid block bears a binary gripper");
    for record in project.run("blocks.lua").policy("noop").records() {
        assert!(!record.verdict.goal && record.verdict.no_drop, "{:#?}", record.verdict);
    }
}

/// A suite in which a push moves `upper` to the middle of `lower`, on which it rests, on a pillar.
fn stack(upper: &str, lower: &str) -> String {
    format!(
        r#"
local soft, rigid, static = softvt.soft {{ youngs_pa = 3e4, poisson = 0.3, density = 300 }}, softvt.rigid {{ density = 300 }}, softvt.static {{}}
local solids = require "solids"
local x, y, z = table.unpack(solids.shelf_at)
local layout = softvt.layout("stack", function(scene)
  scene:add {{ name = "floor", asset = solids.floor, position = {{ 0, 0, 0 }} }}
  scene:add {{ name = "pillar", asset = solids.solid("pillar", {{ 0.06, 0.14, 0.225 }}, static), position = solids.shelf_at }}
  scene:add {{ name = "lower", asset = solids.solid("lower", {{ 0.06, 0.14, 0.04 }}, {lower}), position = {{ x, y, 0.225 }} }}
  scene:add {{ name = "upper", asset = solids.solid("upper", {{ 0.04, 0.04, 0.04 }}, {upper}), position = {{ x, y + 0.034, 0.2651 }} }}
  scene:add {{ name = "far", asset = solids.solid("far", {{ 0.04, 0.04, 0.04 }}, rigid), position = {{ 0, -0.2, 0 }} }}
end)
local function task(on)
  return softvt.task {{ prompt = on, layout = layout, goal = softvt.on {{ object = "upper", target = on }}, budget_steps = 24,
    expert = function(arm) solids.push(arm) arm:wait(1) end }}
end
return softvt.suite {{ name = "stack", object_type = "deformable", tasks_differ_in = "spatial", episodes = 1, tasks = {{ task "lower", task "far" }} }}
"#
    )
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
        let project = Project::new(&[("x.lua", &stack(upper, lower)), SOLIDS]);
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

/// A suite with a cube of the given stiffness (Pa), a shift of it, and an experiment that returns its fingerprint.
fn cubes(stiffness: &str) -> [(&'static str, String); 2] {
    let layout = format!(
        r#"
local solids = require "solids"
local layout = softvt.layout("one", function(scene, rng)
  local episode = rng:uniform(0, 1)
  local cube = softvt.asset {{ name = "cube", shape = softvt.shape.box {{ size = {{ 0.04, 0.04, 0.04 }} }}:grounded(),
    body = softvt.soft {{ youngs_pa = {stiffness}, poisson = 0.3, density = 300 }} }}
  scene:add {{ name = "floor", asset = solids.floor, position = {{ 0, 0, 0 }} }}
  scene:add {{ name = "shelf", asset = solids.shelf, position = solids.shelf_at }}
  scene:add {{ name = "cube", asset = cube, position = solids.cube_at }}
end)
"#
    );
    let who = r#"return softvt.experiment { name = "who", grid = { x = { 1 } }, run = function()
  return { fingerprint = softvt.simulate { layout = layout }:measure "cube".fingerprint }
end }"#;
    let suite = r#"return softvt.suite { name = "one", object_type = "deformable", tasks_differ_in = "spatial", episodes = 2, tasks = {
  softvt.task { prompt = "push", layout = layout, goal = softvt.on { object = "cube", target = "shelf" }, budget_steps = 24,
    expert = function(arm) solids.push(arm) arm:wait(1) end },
}, shifts = { softvt.shift { name = "soft", default = 1, apply = function(scene, x)
  scene:object "cube".youngs_pa = x * scene:object "cube".youngs_pa
end } } }"#;
    [("who.lua", format!("{layout}{who}")), ("x.lua", format!("{layout}{suite}"))]
}

fn safe(run: Run) -> Vec<bool> {
    run.records().iter().map(|record| record.verdict.safety).collect()
}

#[test]
fn limits_apply_only_to_the_calibrated_object() {
    let project = Project::new(&[SOLIDS]);
    cubes("2e4").iter().for_each(|(path, text)| project.write(path, text.as_bytes()));
    let rows = project.run("who.lua").rows();
    let fingerprint = rows[0]["fingerprint"].as_str().expect("a text");
    project.write("assets/calibration/cube.json", calibration(fingerprint).as_bytes());
    assert_eq!(safe(project.run("x.lua")), [true, true]);
    assert_eq!(safe(project.run("x.lua").shift("soft", 0.5)), [true, true], "limits stay nominal");
    // One stiffness in the first episode and others later, under one name.
    let vary = cubes("rng:uniform(0, 1) < 2 and 2e4 * (1 + episode)");
    project.write("x.lua", vary[1].1.as_bytes());
    assert_eq!(safe(project.run("x.lua")), [false, false]);
    let other = cubes("3e4");
    project.write("x.lua", other[1].1.as_bytes());
    assert_eq!(safe(project.run("x.lua")), [false, false]);
}

/// A suite of soft cubes, with calibrations of the assets `cube` and `small`. Layout `drawn` places one of the two;
/// layout `changed` runs `change` on a cube.
fn calibrated(change: &str) -> Project {
    let library = r#"
local function cube(name, edge)
  return softvt.asset { name = name, shape = softvt.shape.box { size = { edge, edge, edge } }:grounded(),
    body = softvt.soft { youngs_pa = 2e4, poisson = 0.3, density = 300 } }
end
return { cube = cube("cube", 0.04), small = cube("small", 0.03) }
"#;
    let suite = format!(
        r#"
local assets, solids = require "cubes", require "solids"
local function layout(name, place)
  return softvt.layout(name, function(scene, rng)
    scene:add {{ name = "floor", asset = solids.floor, position = {{ 0, 0, 0 }} }}
    scene:add {{ name = "shelf", asset = solids.shelf, position = solids.shelf_at }}
    place(scene, rng:uniform(0, 1))
  end)
end
local function add(scene, asset) scene:add {{ name = "cube", asset = assets[asset], position = solids.cube_at }} end
local drawn = layout("drawn", function(scene, u) add(scene, u < 0.5 and "cube" or "small") end)
local changed = layout("changed", function(scene, u) add(scene, "cube") local cube = scene:object "cube" {change} end)
local function task(layout)
  return softvt.task {{ prompt = layout.name, layout = layout, goal = softvt.on {{ object = "cube", target = "shelf" }}, budget_steps = 24,
    expert = function(arm) solids.push(arm) arm:wait(1) end }}
end
return softvt.suite {{ name = "one", object_type = "deformable", tasks_differ_in = "spatial", episodes = 4, tasks = {{ task(drawn), task(changed) }} }}
"#
    );
    let who = r#"
local assets, solids = require "cubes", require "solids"
return softvt.experiment { name = "who", grid = { asset = { "cube", "small" } }, run = function(point)
  local layout = softvt.layout("one", function(scene)
    scene:add { name = "floor", asset = solids.floor, position = { 0, 0, 0 } }
    scene:add { name = "cube", asset = assets[point.asset], at = { 0, 0.1 } }
  end)
  return { asset = point.asset, fingerprint = softvt.simulate { layout = layout }:measure "cube".fingerprint }
end }"#;
    let project = Project::new(&[("cubes.lua", library), ("x.lua", &suite), ("who.lua", who), SOLIDS]);
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
    assert!(messages.contains(line), "{messages}");
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
    assert!(messages.contains(other), "{messages}");
    let mut file = project.json("assets/calibration/cube.json");
    file.as_object_mut().expect("a document").remove("fingerprints");
    let project = Small::default().project();
    project.write("assets/calibration/cube.json", file.to_string().as_bytes());
    let messages = told(&project);
    let unknown = "assets/calibration/cube.json has no fingerprint of \"cube\", so that it may be of a different version";
    assert!(messages.contains(unknown), "{messages}");
    let script = r#"return softvt.experiment { name = "who", grid = { x = { 1 } }, run = function()
  local cube = softvt.asset { name = "cube", shape = softvt.shape.box { size = { 0.04, 0.04, 0.04 } }:grounded(),
    body = softvt.soft { youngs_pa = 2e4, poisson = 0.3, density = 300 } }
  local floor = softvt.asset { name = "floor", shape = softvt.shape.box { size = { 1, 1, 0.05 } }:translate(0, 0, -0.025), body = softvt.static {} }
  local sim = softvt.simulate { layout = softvt.layout("one", function(scene)
    scene:add { name = "floor", asset = floor, position = { 0, 0, 0 } }
    scene:add { name = "cube", asset = cube, at = { 0, 0.1 } } end) }
  return { fingerprint = sim:measure "cube".fingerprint }
end }
"#;
    let project = Project::new(&[("who.lua", script)]);
    let rows = project.run("who.lua").rows();
    let project = impostor(rows[0]["fingerprint"].as_str().expect("a text"));
    let messages = told(&project);
    assert!(!messages.contains("different version"), "{messages}");
    assert_eq!(project.json("run/run.json")["thresholds"]["cube"], 1.0);
}
