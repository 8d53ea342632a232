//! Rigid and soft targets are judged alike, whatever they are put on.

use serde_json::Value;

use crate::support::Project;

/// A rigid block in the mirrored layout of the standard suite, as a user would write it from the reference.
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
fn the_stock_expert_puts_a_rigid_block_on_the_plate_and_it_is_safe_without_a_limit() {
    let project = Project::new(&[("blocks.lua", BLOCKS), ("assets/block.lua", BLOCK)]);
    let said = project.succeeds("blocks.lua --out run --json --trace");
    for e in project.lines("run/episodes.jsonl") {
        assert!(e["goal"] == true && e["no_drop"] == true && e["safety"] == true, "{e:#}");
        assert!(e["deformation_ok"].is_null() && e["d_peak"].is_null() && e["tau"].is_null(), "{e:#}");
        assert_eq!(e["no_slip"], true, "{e:#}");
        assert!(e["mean_pad_force_n"].as_f64().is_some_and(|f| f > 0.5), "{e:#}");
    }
    let summary: Value = serde_json::from_str(&said.out).expect("JSON");
    assert_eq!(summary["safety_success_rate"]["rate"], 100.0);
    let shut = project.succeeds("blocks.lua --policy expert-binary --out shut --json");
    let summary: Value = serde_json::from_str(&shut.out).expect("JSON");
    assert_eq!(summary["safety_success_rate"]["rate"], 100.0, "a rigid block bears a binary gripper");
    project.succeeds("blocks.lua --policy noop --out noop");
    for e in project.lines("noop/episodes.jsonl") {
        assert!(e["goal"] == false && e["no_drop"] == true, "{e:#}");
    }
}

/// A suite in which `upper` lies on `lower` from the start.
fn stack(upper: &str, lower: &str) -> String {
    format!(
        r#"
local soft, rigid, static = softvt.soft {{ youngs_pa = 3e4, poisson = 0.3, density = 300 }}, softvt.rigid {{ density = 300 }}, softvt.static {{}}
local function block(name, edge, body)
  return softvt.asset {{ name = name, shape = softvt.shape.box {{ size = {{ edge, edge, 0.04 }} }}:grounded(), body = body }}
end
local floor = softvt.asset {{ name = "floor", shape = softvt.shape.box {{ size = {{ 1, 1, 0.05 }} }}:translate(0, 0, -0.025), body = static }}
local layout = softvt.layout("stack", function(scene)
  scene:add {{ name = "floor", asset = floor, xyz = {{ 0, 0, 0 }} }}
  scene:add {{ name = "lower", asset = block("lower", 0.06, {lower}), xyz = {{ 0, 0.1, 0 }} }}
  scene:add {{ name = "upper", asset = block("upper", 0.04, {upper}), xyz = {{ 0, 0.1, 0.0401 }} }}
  scene:add {{ name = "far", asset = block("far", 0.04, rigid), xyz = {{ 0, -0.2, 0 }} }}
end)
local function task(on)
  return softvt.task {{ prompt = on, layout = layout, goal = softvt.on {{ object = "upper", target = on }}, budget_steps = 20 }}
end
return softvt.suite {{ name = "stack", object_type = "deformable", variation = "spatial", episodes = 1, tasks = {{ task "lower", task "far" }} }}
"#
    )
}

#[test]
fn whatever_lies_on_whatever_is_carried_by_it_and_by_nothing_else() {
    for (upper, lower) in [
        ("soft", "soft"),
        ("soft", "rigid"),
        ("soft", "static"),
        ("rigid", "soft"),
        ("rigid", "rigid"),
        ("rigid", "static"),
    ] {
        let project = Project::new(&[("x.lua", &stack(upper, lower))]);
        project.succeeds("x.lua --policy noop --out run");
        let episodes = project.lines("run/episodes.jsonl");
        let goals: Vec<&Value> = episodes.iter().map(|e| &e["goal"]).collect();
        assert_eq!(goals, [true, false], "{upper} on {lower}: {episodes:#?}");
        assert!(episodes.iter().all(|e| e["no_drop"] == true), "{upper} on {lower}: {episodes:#?}");
    }
}
