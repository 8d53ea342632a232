//! Projects that tests of the binary and of the library share.

use super::{Project, Small};

/// A rigid cube on a shelf. A push reaches the goal.
pub const PUSHED_CUBE: &str = r#"
local solids = require "solids"
local layout = softvt.layout("one", function(scene)
  local x, y, z = table.unpack(solids.cube_at)
  scene:add { name = "floor", asset = solids.floor, position = { 0, 0, 0 } }
  scene:add { name = "shelf", asset = solids.shelf, position = solids.shelf_at }
  scene:add { name = "cube", asset = solids.cube, position = { x + 0.005 * math.random(), y, z } }
  scene:add { name = "other", asset = solids.cube, position = { x, -0.15, z } }
end)
local function task(prompt)
  return softvt.task { prompt = prompt, layout = layout, goal = softvt.on { object = "cube", target = "shelf" }, budget_steps = 30,
    expert = function(arm, scene) solids.push(arm) arm:wait(1) end }
end
return softvt.suite { name = "one", object_type = "rigid", tasks_differ_in = "spatial", episodes = 1,
  tasks = { task "wait", task "wait longer" } }
"#;

/// A rigid cube on a shelf, or on the floor in some attempts. A push reaches the goal in the former.
pub const MISPLACED_CUBE: &str = r#"
local solids = require "solids"
local layout = softvt.layout("one", function(scene)
  local beside = math.random() < 0.4
  scene:add { name = "floor", asset = solids.floor, position = { 0, 0, 0 } }
  scene:add { name = "shelf", asset = solids.shelf, position = solids.shelf_at }
  scene:add { name = "cube", asset = solids.cube, position = beside and { 0, 0.35, 0 } or solids.cube_at }
end)
return softvt.suite { name = "one", object_type = "rigid", tasks_differ_in = "spatial", episodes = 1, tasks = {
  softvt.task { prompt = "wait", layout = layout, goal = softvt.on { object = "cube", target = "shelf" }, budget_steps = 30,
    expert = function(arm, scene) solids.push(arm) arm:wait(1) end },
} }
"#;

/// Twelve control steps of a cube on a floor.
pub fn policy_project(policy: &str) -> Project {
    let project = Small { task: "budget_steps = 12", ..Small::default() }.project();
    project.write("p.lua", policy.as_bytes());
    project
}

/// A policy that moves at random, depending on its observation, in chunks of three.
pub const WANDERS: &str = "local n = 0
return softvt.policy { name = 'wanders', observes = { tactile = true, cameras = { 'wrist' } }, replan = 2,
  reset = function(task) n = task.episode end,
  act = function(obs)
    n = n + 1
    local light, list = obs:camera('wrist'):mean()[1] / 255, {}
    for i = 1, 3 do
      list[i] = { position = { obs.position[1] + 0.01 * math.random(), obs.position[2], obs.position[3] - 0.001 * n * light },
                  axis_angle = obs.axis_angle, closure = 0.1 * math.random() }
    end
    return list
  end }
";

/// The small suite with shifts, under the given conditions.
pub fn conditions_project(conditions: &str, object_type: &str) -> Project {
    let small = Small { expert: "arm:close_to(1, { rate = 2 })", ..Small::default() };
    let shifts = "local shifts = require \"shifts\"\n";
    let declared = "shifts = shifts.soft, episodes = 2,";
    let mut text = small
        .text()
        .replacen("episodes = 1,", declared, 1)
        .replace("\"deformable\"", &format!("\"{object_type}\""));
    if object_type == "rigid" {
        text = text.replace("softvt.soft { youngs_pa = 2e4, poisson = 0.3,", "softvt.rigid {");
    }
    let plan = format!(
        "return softvt.conditions {{ name = \"trial\", suites = {{ require \"suites.one\" }}, conditions = {{\n{conditions}\n}} }}\n"
    );
    Project::new(&[("suites/one.lua", &format!("{shifts}{text}")), ("suites/trial.lua", &plan)])
}

/// Two shifts, one for soft objects only, and a setting.
pub const CONDITIONS: &str = "{ name = \"heavy x2\", shift = { mass = 2 } },
  { name = \"same\", shift = { mass = 1, light = 0.5 } },
  { name = \"hard\", shift = { stiffness = 2 }, only = \"deformable\" },
  { name = \"weak\", set = { [\"robot.gripper.effort\"] = 3 } },";
