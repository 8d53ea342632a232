//! Articulated objects in a suite: goals that name a part, experts that read joints, and refused definitions.

use insta::assert_snapshot;
use serde_json::Value;

use crate::support::{Project, SOLIDS};

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
return softvt.suite {{ name = "one", object_type = "rigid", tasks_differ_in = "spatial", episodes = 1, tasks = {{
  softvt.task {{ prompt = "wait", layout = layout, budget_steps = 40, goal = softvt.on {{ object = "block", target = "{target}" }},
    expert = function(arm, scene) {expert} end }},
}} }}
"#
    );
    Project::new(&[("x.lua", &text)])
}

const TRAY: &str =
    "softvt.slider { axis = { 0, -1, 0 }, lower = 0, upper = 0.08, damping = 2, friction = 1 }";

/// A chest whose tray is at the height of the fingers, with a block that a push moves to the middle of the tray.
fn goal(target: &str) -> bool {
    let text = format!(
        r#"local solids = require "solids"
local slab = softvt.shape.box {{ size = {{ 0.06, 0.2, 0.01 }} }}
local chest = softvt.asset {{ name = "chest", shape = slab:grounded(), body = softvt.articulated {{ parts = {{ {{ name = "tray", shape = slab:translate(0, 0, 0.02), density = 500,
  joint = {TRAY} }} }} }} }}
local layout = softvt.layout("one", function(scene)
  local x, y = table.unpack(solids.shelf_at)
  scene:add {{ name = "floor", asset = solids.floor, position = {{ 0, 0, 0 }} }}
  scene:add {{ name = "chest", asset = chest, position = {{ x, y, 0.24 }} }}
  scene:add {{ name = "block", asset = solids.cube, position = solids.cube_at }}
end)
return softvt.suite {{ name = "one", object_type = "rigid", tasks_differ_in = "spatial", episodes = 1, tasks = {{
  softvt.task {{ prompt = "push", layout = layout, budget_steps = 40, goal = softvt.on {{ object = "block", target = "{target}" }},
    expert = function(arm) solids.push(arm) arm:wait(1) end }},
}} }}
"#
    );
    let project = Project::new(&[("x.lua", &text), SOLIDS]);
    project.run("x.lua").record().verdict.goal
}

#[test]
fn goals_can_name_a_part() {
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
    let project = suite(TRAY, "chest", expert);
    let output = project.run("x.lua").error();
    assert!(output.ends_with("x.lua:21: all seen"), "{output}");
    let project = suite(TRAY, "chest", "scene:part('chest', 'tra')");
    assert_snapshot!(project.run("x.lua").error(), @r#"x.lua: task 0, episode 0: x.lua:14: scene: unknown part "tra"; did you mean "tray"?"#);
}

#[test]
fn invalid_joints_and_parts_are_refused() {
    let refusal = |joint, target| suite(joint, target, "arm:wait(1)").run("x.lua").error();
    assert_snapshot!(refusal("softvt.slider { axis = { 0, -1, 0 }, lower = 0 }", "chest"), @"x.lua:5: slider.upper: missing; expected metres");
    assert_snapshot!(refusal(TRAY, "chest.drawer"), @r#"x.lua:13: task.goal.target: unknown object "chest.drawer"; did you mean "chest.tray"?"#);
}

/// Forces of the pads on the handle of a drawer of the standard cabinet. Point `grip`: both pads hold the bar. Point
/// `edge`: the hand comes wide open, so that the lower finger stops at the handle below and the edge of a pad meets the
/// bar obliquely; nothing has friction.
const HANDLE: &str = r#"local floor = softvt.asset { name = "floor", shape = softvt.shape.box { size = { 2, 2, 0.05 } }:translate(0, 0, -0.025), body = softvt.static {} }
local wooden_cabinet = require "assets.wooden_cabinet"
local function layout(name, has_friction)
  return softvt.layout(name, function(scene)
    scene:add { name = "floor", asset = floor, position = { 0, 0, 0 } }
    scene:add { name = "cabinet", asset = wooden_cabinet, at = { 0, 0.25 } }
    for _, object in ipairs(scene.objects) do
      if not has_friction then object.dynamic_mu, object.static_mu = 0, 0 end
    end
  end)
end
local FRICTIONLESS = { robot = { pads = { static_mu = 0, dynamic_mu = 0 } } }
local CASES = {
  grip = { scene = { layout = layout("rough", true) }, opening = 0.5 },
  edge = { scene = { layout = layout("smooth", false), settings = FRICTIONLESS }, opening = 0 },
}
return softvt.experiment {
  name = "handle", grid = { case = { "grip", "edge" } },
  run = function(point)
    local case, row = CASES[point.case], { case = point.case }
    local sim = softvt.simulate(case.scene)
    assert(sim:drive(function(arm, scene)
      local cabinet, drawer = scene:object "cabinet", scene:part("cabinet", "top_drawer")
      local x, y = cabinet.centre[1], 0.25 - drawer.hints.handle_out_m
      -- The fingers point forward, above and below the bar.
      local grip = softvt.pose { position = { x, y, drawer.hints.handle_height_m }, quaternion = { 0.7071, -0.7071, 0, 0 } }
      arm:close_to(case.opening)
      arm:move_to(grip:translated { 0, -0.08, 0 }, { speed = 0.3 })
      arm:move_to(grip, { speed = 0.1 })
      arm:close_to(0.95)
      arm:wait(1)
      row.arm = { arm.force[1], arm.force[2] }
    end))
    row.on = { 0, 0 }
    for _, name in ipairs { "floor", "cabinet", "cabinet.top_drawer", "cabinet.middle_drawer", "cabinet.bottom_drawer" } do
      local on = sim:measure(name).pad_force
      row.on = { row.on[1] + on[1], row.on[2] + on[2] }
    end
    row.handle = sim:measure "cabinet.top_drawer".pad_force
    row.gel = { sim:tactile "left".force, sim:tactile "right".force }
    return row
  end,
}
"#;

/// Numbers of a list.
fn numbers(list: &Value) -> Vec<f64> {
    list.as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
}

#[test]
fn pad_forces_are_the_normal_forces_at_all_contacts_of_a_pad() {
    let rows = Project::new(&[("handle.lua", HANDLE)]).run("handle.lua").rows();
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
        // The normals of a bar of 4.5 mm radius, 0.4 mm deep in the gel, are within 25° of the pressing direction.
        let pressing = -numbers(&row["gel"][side])[2];
        assert!(force >= pressing && force < 1.03 * pressing, "{row:?}");
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
