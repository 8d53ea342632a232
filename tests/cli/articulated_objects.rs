//! Articulated objects in a suite: goals that name a part, experts that read joints, and refused definitions.

use insta::assert_snapshot;

use crate::support::Project;

/// A chest of one tray, open by 50 mm, with a block in it. Line 5 is the joint, 14 the expert.
fn suite(joint: &str, target: &str, expert: &str) -> Project {
    let text = format!(
        r#"local floor = softvt.asset {{ name = "floor", shape = softvt.shape.box {{ size = {{ 1, 1, 0.05 }} }}:translate(0, 0, -0.025), body = softvt.static {{}} }}
local block = softvt.asset {{ name = "block", shape = softvt.shape.box {{ size = {{ 0.03, 0.03, 0.03 }} }}:grounded(), body = softvt.rigid {{ density = 500 }} }}
local slab = softvt.shape.box {{ size = {{ 0.1, 0.1, 0.01 }} }}
local chest = softvt.asset {{ name = "chest", shape = slab:grounded(), body = softvt.articulated {{ parts = {{ {{ name = "tray", shape = slab:translate(0, 0, 0.02), density = 500,
  joint = {joint} }} }} }} }}
local layout = softvt.layout("one", function(scene)
  scene:add {{ name = "floor", asset = floor, position = {{ 0, 0, 0 }} }}
  scene:add {{ name = "chest", asset = chest, at = {{ 0, 0.1 }}, joints = {{ tray = 0.05 }} }}
  scene:add {{ name = "block", asset = block, at = {{ 0, 0.03 }}, on = "chest.tray" }}
  assert(scene:object("chest").joints.tray == 0.05)
end)
return softvt.suite {{ name = "one", object_type = "rigid", variation = "spatial", episodes = 1, tasks = {{
  softvt.task {{ prompt = "wait", layout = layout, budget_steps = 40, goal = softvt.on {{ object = "block", target = "{target}" }},
    expert = function(arm, scene) {expert} end }},
}} }}
"#
    );
    Project::new(&[("x.lua", &text)])
}

const TRAY: &str =
    "softvt.slider { axis = { 0, -1, 0 }, lower = 0, upper = 0.08, damping = 2, friction = 1 }";

#[test]
fn goals_can_name_a_part() {
    let goal = |target: &str| {
        let project = suite(TRAY, target, "arm:wait(1)");
        project.succeeds("x.lua --policy noop --out run");
        let lines = project.lines("run/episodes.jsonl");
        assert_eq!(lines.len(), 1);
        lines[0]["goal"].as_bool().expect("a verdict")
    };
    assert!(goal("chest.tray"));
    assert!(!goal("chest"), "the base does not carry it");
}

#[test]
fn an_expert_sees_parts_and_joints() {
    let expert = r#"
      local chest = scene:object "chest"
      assert(math.abs(chest.joints.tray - 0.05) < 1e-5 and chest.joint == nil)
      local tray = scene:part("chest", "tray")
      assert(tray.name == "tray" and tray.joint == chest.joints.tray and chest.parts.tray.joint == tray.joint)
      assert(math.abs(tray.centre[2] - 0.05) < 1e-5 and math.abs(tray.size[1] - 0.1) < 1e-9)
      assert(#scene:objects() == 3, "parts are no objects of their own")
      error "all seen""#;
    let project = suite(TRAY, "chest.tray", expert);
    let output = project.refusal("x.lua --out run");
    assert!(output.ends_with("x.lua:21: all seen"), "{output}");
    let project = suite(TRAY, "chest.tray", "scene:part('chest', 'tra')");
    assert_snapshot!(project.refusal("x.lua --out run"), @r#"x.lua: task 0, episode 0: x.lua:14: scene: unknown part "tra"; did you mean "tray"?"#);
}

#[test]
fn invalid_joints_and_parts_are_refused() {
    let refusal = |joint, target| suite(joint, target, "arm:wait(1)").refusal("x.lua --out run");
    assert_snapshot!(refusal("softvt.slider { axis = { 0, -1, 0 }, lower = 0 }", "chest"), @"x.lua:5: slider.upper: missing; expected metres");
    assert_snapshot!(refusal(TRAY, "chest.drawer"), @r#"x.lua:13: task.goal.target: unknown object "chest.drawer"; did you mean "chest.tray"?"#);
}

/// Grips the handle of a drawer of the standard cabinet and reads the forces.
const HANDLE: &str = r#"local floor = softvt.asset { name = "floor", shape = softvt.shape.box { size = { 2, 2, 0.05 } }:translate(0, 0, -0.025), body = softvt.static {} }
local wooden_cabinet = require "assets.wooden_cabinet"
local layout = softvt.layout("handle", function(scene)
  scene:add { name = "floor", asset = floor, position = { 0, 0, 0 } }
  scene:add { name = "cabinet", asset = wooden_cabinet, at = { 0, 0.25 } }
end)
return softvt.experiment {
  name = "handle", grid = { closure = { 0.95 } },
  run = function(point)
    local sim, row = softvt.simulate { layout = layout }, nil
    assert(sim:drive(function(arm, scene)
      local cabinet, drawer = scene:object "cabinet", scene:part("cabinet", "top_drawer")
      local x, y = cabinet.centre[1], 0.25 - drawer.hints.handle_out_m
      -- The fingers point forward, above and below the bar.
      local grip = softvt.pose { position = { x, y, drawer.hints.handle_height_m }, quaternion = { 0.7071, -0.7071, 0, 0 } }
      arm:move_to(grip:translated { 0, -0.08, 0 }, { speed = 0.3 })
      arm:move_to(grip, { speed = 0.1 })
      arm:close_to(point.closure)
      arm:wait(1)
      row = { width_mm = 1e3 * arm.width, left = arm.force[1], right = arm.force[2] }
    end))
    local on = sim:measure "cabinet.top_drawer".pad_force
    row.on_left, row.on_right = on[1], on[2]
    row.felt_left, row.felt_right = -sim:tactile "left".force[3], -sim:tactile "right".force[3]
    return row
  end,
}
"#;

#[test]
fn forces_on_a_drawers_handle_are_measured() {
    let output = Project::new(&[("handle.lua", HANDLE)]).succeeds("handle.lua --json");
    let row: serde_json::Value = serde_json::from_str(output.out.trim()).expect("a row");
    let number = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key} in {row}"));
    // In this pose the drawer rests against the right pad alone.
    assert!(number("right") > 1.0 && number("felt_right") > 1.0, "{row}");
    for side in ["left", "right"] {
        assert_eq!(number(&format!("on_{side}")), number(side), "{side}: {row}");
    }
}
