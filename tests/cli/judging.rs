//! Judging of rigid and soft targets on rigid and soft supports.

use serde_json::Value;

use crate::support::{Project, SOLIDS};

/// A rigid block in the mirrored layout of the standard suite, written as a user would.
const BLOCKS: &str = r#"
local pick_place, layouts = require "experts.pick_place", require "layouts.spatial_soft"
return softvt.suite {
  name = "blocks", object_type = "rigid", variation = "spatial", episodes = 2,
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
    let output = project.succeeds("blocks.lua --out run --json --trace");
    for e in project.lines("run/episodes.jsonl") {
        assert!(e["goal"] == true && e["no_drop"] == true && e["safety"] == true, "{e:#}");
        assert!(e["deformation_ok"].is_null() && e["d_peak"].is_null() && e["tau"].is_null(), "{e:#}");
        assert_eq!(e["no_slip"], true, "{e:#}");
        assert!(e["mean_pad_force_n"].as_f64().is_some_and(|f| f > 0.5), "{e:#}");
    }
    let summary: Value = serde_json::from_str(&output.out).expect("JSON");
    assert_eq!(summary["safety_success_rate"]["rate"], 100.0);
    let binary = project.succeeds("blocks.lua --policy expert-binary --out binary --json");
    let summary: Value = serde_json::from_str(&binary.out).expect("JSON");
    assert_eq!(summary["safety_success_rate"]["rate"], 100.0, "a rigid block bears a binary gripper");
    project.succeeds("blocks.lua --policy noop --out noop");
    for e in project.lines("noop/episodes.jsonl") {
        assert!(e["goal"] == false && e["no_drop"] == true, "{e:#}");
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
return softvt.suite {{ name = "stack", object_type = "deformable", variation = "spatial", episodes = 1, tasks = {{ task "lower", task "far" }} }}
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
        project.succeeds("x.lua --out run");
        let episodes = project.lines("run/episodes.jsonl");
        let goals: Vec<&Value> = episodes.iter().map(|e| &e["goal"]).collect();
        assert_eq!(goals, [true, false], "{upper} on {lower}: {episodes:#?}");
        assert!(episodes.iter().all(|e| e["no_drop"] == true), "{upper} on {lower}: {episodes:#?}");
        // Harm of the target to a soft support is recorded, also if the support is not the goal.
        for e in &episodes {
            assert_eq!(e["d_peak_other"].is_number(), lower == "soft", "{upper} on {lower}: {e:#}");
            assert_eq!(
                e["others_ok"],
                if lower == "soft" { Value::Null } else { true.into() },
                "no limit: {e:#}"
            );
        }
        assert!(episodes[0]["failed_stage"].is_null() && episodes[1]["failed_stage"] == "grasp");
    }
}

/// The calibration of a cube with a fingerprint.
fn calibration(fingerprint: &str) -> String {
    format!(
        r#"{{"schema_version":1,"protocol_id":"softvtbench-v1","metric_id":"fem_rms_rigid_aligned_bbox_pct_v1",
        "calibration":{{"method":"compression_sweep","definition":"d","kappa":0.5,"sources":[],"generated_at":"x"}},
        "thresholds":{{"cube":{{"tau":1.0,"d_ref":2.0,"kappa":0.5,"n_stable_trials":3}}}},
        "fingerprints":{{"cube":"{fingerprint}"}}}}"#
    )
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
    let suite = r#"return softvt.suite { name = "one", object_type = "deformable", variation = "spatial", episodes = 2, tasks = {
  softvt.task { prompt = "push", layout = layout, goal = softvt.on { object = "cube", target = "shelf" }, budget_steps = 24,
    expert = function(arm) solids.push(arm) arm:wait(1) end },
}, shifts = { softvt.shift { name = "soft", default = 1, apply = function(scene, x)
  scene:object "cube".youngs_pa = x * scene:object "cube".youngs_pa
end } } }"#;
    [("who.lua", format!("{layout}{who}")), ("x.lua", format!("{layout}{suite}"))]
}

fn safe(project: &Project, words: &str) -> Vec<bool> {
    project.succeeds(&format!("x.lua --out run {words}"));
    let safe = project.lines("run/episodes.jsonl").iter().map(|e| e["safety"] == true).collect();
    std::fs::remove_dir_all(project.path("run")).expect("removed");
    safe
}

#[test]
fn limits_apply_only_to_the_calibrated_object() {
    let project = Project::new(&[SOLIDS]);
    cubes("2e4").iter().for_each(|(path, text)| project.write(path, text.as_bytes()));
    let row: Value = serde_json::from_str(&project.succeeds("who.lua --json").out).expect("a row");
    let fingerprint = row["fingerprint"].as_str().expect("a text");
    project.write("assets/calibration/cube.json", calibration(fingerprint).as_bytes());
    assert_eq!(safe(&project, ""), [true, true]);
    assert_eq!(safe(&project, "--shift soft=0.5"), [true, true], "limits stay nominal");
    // One stiffness in the first episode and others later, under one name.
    let vary = cubes("rng:uniform(0, 1) < 2 and 2e4 * (1 + episode)");
    project.write("x.lua", vary[1].1.as_bytes());
    assert_eq!(safe(&project, ""), [false, false]);
    let other = cubes("3e4");
    project.write("x.lua", other[1].1.as_bytes());
    assert_eq!(safe(&project, ""), [false, false]);
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
return softvt.suite {{ name = "one", object_type = "deformable", variation = "spatial", episodes = 4, tasks = {{ task(drawn), task(changed) }} }}
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
    for line in project.succeeds("who.lua --json").out.lines() {
        let row: Value = serde_json::from_str(line).expect("a row");
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
    let output = project.succeeds("x.lua --out run");
    let episodes = project.lines("run/episodes.jsonl");
    assert!(episodes.iter().all(|e| e["tau"] == 1.0 && e["safety"] == true), "{episodes:#?}");
    let assets: std::collections::BTreeSet<&str> =
        episodes.iter().filter_map(|e| e["asset"].as_str()).collect();
    assert_eq!(assets.len(), 2, "both assets are drawn: {assets:?}");
    assert!(!output.err.contains("calibrat") && !output.err.contains("limit"), "{}", output.err);
    assert_eq!(project.json("run/run.json")["thresholds"], serde_json::json!({ "cube": 1.0, "small": 1.0 }));
}

#[test]
fn another_object_has_no_limit_and_check_and_run_say_so() {
    let project = calibrated("if u > 0.5 then cube.poisson = 0.4 end");
    let warning = "no limit for object \"cube\": it has Poisson's ratio 0.4 instead of 0.3 of asset \"cube\"";
    let check = project.succeeds("check x.lua");
    let line = check.err.lines().find(|line| line.contains(warning)).expect("a warning of the check");
    assert!(line.starts_with("softvt: task 1 episode "), "{line}");
    let run = project.succeeds("x.lua --out run");
    assert!(run.err.contains(line), "{}", run.err);
    let episodes = project.lines("run/episodes.jsonl");
    let judged = |task: u64| episodes.iter().filter(|e| e["task"] == task && e["tau"] == 1.0).count();
    assert_eq!(judged(0), 4);
    assert!((1..4).contains(&judged(1)), "{episodes:#?}");
}
