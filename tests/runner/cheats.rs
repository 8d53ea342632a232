//! Ways to Safety Success that are not earned, one test each: none succeeds, or tables name it. The robot does nothing.

use softvt::report::{styled_text::TerminalFormat, terminal};

use crate::support::{Project, SOLIDS};

/// A suite of one task in which the layout adds a floor and what `add` adds, from line 5 on. The goal is on line 7.
fn project(add: &str, goal: &str) -> Project {
    let text = format!(
        r#"local solids = require "solids"
local box = softvt.shape.box
local layout = softvt.layout("cheat", function(scene)
  scene:add {{ name = "floor", asset = solids.floor, position = {{ 0, 0, 0 }} }}
  {add}
end)
return softvt.suite {{ name = "cheat", object_type = "rigid", tasks_differ_in = "spatial", episodes = 1, tasks = {{
  softvt.task {{ prompt = "cheat", layout = layout, budget_steps = 20, goal = {goal} }},
}} }}
"#
    );
    Project::new(&[("x.lua", &text), SOLIDS])
}

/// The message with which both the check and a run refuse a suite.
fn refusal(add: &str, goal: &str) -> String {
    let project = project(add, goal);
    let run = project.run("x.lua").policy("noop");
    let (check, run) = (project.message(run.clone().check()), run.error());
    assert_eq!(check, run);
    run
}

/// Runs a suite that is accepted, and checks that its episode reaches no goal.
fn fails(add: &str, goal: &str) {
    let project = project(add, goal);
    project.run("x.lua").check().expect("accepted");
    let verdict = project.run("x.lua").policy("noop").record().verdict;
    assert!(!verdict.goal && !verdict.safety, "{verdict:#?}");
}

const ON_SLAB: &str = r#"softvt.on { object = "cube", target = "slab" }"#;
const IN_CUP: &str = r#"softvt.inside { object = "cube", target = "cup" }"#;

/// Adds a cup of 140 × 140 × 100 mm; `shape` is an expression.
fn cup(shape: &str, hints: &str, at: &str) -> String {
    format!(
        "scene:add {{ name = \"cup\", {at}, asset = softvt.asset {{ name = \"cup\", hints = {{ {hints} }}, \
         body = softvt.rigid {{ density = 500 }}, shape = {shape} }} }}"
    )
}

const UPRIGHT: &str = "box { size = { 0.14, 0.14, 0.10 } }:subtract(box { size = { 0.12, 0.12, 0.10 } }:translate(0, 0, 0.012)):grounded()";
const UPSIDE_DOWN: &str = "box { size = { 0.14, 0.14, 0.10 } }:subtract(box { size = { 0.12, 0.12, 0.10 } }:translate(0, 0, -0.012)):grounded()";
const CUBE: &str = r#"scene:add { name = "cube", asset = solids.cube, at = { 0, -0.1 } } "#;

#[test]
fn the_object_starts_at_the_goal() {
    let add = r#"scene:add { name = "slab", asset = solids.slab, at = { 0, 0.1 } } scene:add { name = "cube", asset = solids.cube, at = { 0, 0.1 }, on = "slab" }"#;
    assert_eq!(
        refusal(add, ON_SLAB),
        "x.lua:5: task 0, episode 0: the goal already holds at the start, before the robot moves: cube on slab; change the \
         layout or the goal"
    );
}

#[test]
fn the_goal_is_the_table() {
    let message = refusal(CUBE, r#"softvt.on { object = "cube", target = "floor" }"#);
    assert!(
        message.contains("the goal already holds at the start, before the robot moves: cube on floor"),
        "{message}"
    );
}

#[test]
fn the_object_starts_in_the_container() {
    let add = cup(UPRIGHT, "", "at = { 0, -0.1 }");
    let add = format!(
        "{add} scene:add {{ name = \"cube\", asset = solids.cube, position = {{ 0, -0.1, 0.0125 }} }}"
    );
    let message = refusal(&add, IN_CUP);
    assert!(
        message.contains("the goal already holds at the start, before the robot moves: cube in cup"),
        "{message}"
    );
}

#[test]
fn the_object_falls_to_the_goal_while_the_scene_settles() {
    let add = r#"scene:add { name = "slab", asset = solids.slab, at = { 0, 0.1 } } scene:add { name = "cube", asset = solids.cube, position = { 0, 0.1, 0.1 } }"#;
    let message = refusal(add, ON_SLAB);
    assert!(message.contains("the goal already holds at the start"), "{message}");
}

#[test]
fn gravity_does_not_point_down() {
    let above = r#"scene:add { name = "slab", asset = solids.slab, at = { 0, 0.1 } } scene:add { name = "cube", asset = solids.cube, position = { 0, 0.1, 0.3 } } "#;
    for gravity in ["{ 0, 0, 0 }", "{ 0, 0, 9.81 }", "{ 9.81, 0, 0 }"] {
        assert_eq!(
            refusal(&format!("{above} scene.gravity = {gravity}"), ON_SLAB),
            format!(
                "x.lua:5: task 0: scene.gravity = {gravity} does not point down, and a goal judges what carries cube; give it a z \
                 below 0"
            )
        );
    }
}

#[test]
fn the_container_is_upside_down_over_the_object() {
    let add = format!("{CUBE}{}", cup(UPSIDE_DOWN, "wall_m = 0.01", "at = { 0, -0.1 }"));
    assert_eq!(
        refusal(&add, IN_CUP),
        "x.lua:5: task 0: goal.target cup has no cavity, and softvt.inside needs one: a floor and walls all around, upright \
         as the asset is declared; use softvt.on, or a container"
    );
}

#[test]
fn the_container_has_a_second_hollow_over_the_object() {
    // Open above and below, with a floor in between.
    let shape = "box { size = { 0.14, 0.14, 0.16 } }:subtract(box { size = { 0.12, 0.12, 0.08 } }:translate(0, 0, 0.045)):subtract(box { size = { 0.12, 0.12, 0.08 } }:translate(0, 0, -0.045)):grounded()";
    fails(&format!("{CUBE}{}", cup(shape, "", "at = { 0, -0.1 }")), IN_CUP);
}

#[test]
fn the_container_lies_on_its_side_over_the_object() {
    let shape = UPRIGHT.replace(":grounded()", ":rotate { axis = \"x\", angle = math.pi / 2 }:grounded()");
    let message = refusal(&format!("{CUBE}{}", cup(&shape, "", "at = { 0, 0.1 }")), IN_CUP);
    assert!(message.contains("has no cavity"), "{message}");
}

#[test]
fn the_container_has_no_floor() {
    let ring = "box { size = { 0.14, 0.14, 0.05 } }:subtract(box { size = { 0.12, 0.12, 0.1 } }):grounded()";
    let add = format!("{CUBE}{}", cup(ring, "", "at = { 0, -0.1 }"));
    assert!(refusal(&add, IN_CUP).contains("has no cavity"));
    fails(&add, r#"softvt.on { object = "cube", target = "cup" }"#);
}

#[test]
fn a_hint_widens_the_container() {
    for wall in ["-5", "5", "-1e300"] {
        fails(&format!("{CUBE}{}", cup(UPRIGHT, &format!("wall_m = {wall}"), "at = { 0, 0.2 }")), IN_CUP);
    }
}

#[test]
fn the_object_is_its_own_goal() {
    let message = refusal(CUBE, r#"softvt.on { object = "cube", target = "cube" }"#);
    assert!(message.contains("which is the object itself"), "{message}");
}

#[test]
fn the_object_never_moves() {
    let message = refusal(CUBE, r#"softvt.on { object = "floor", target = "cube" }"#);
    assert!(message.contains("\"floor\" never moves"), "{message}");
}

#[test]
fn a_goal_that_counts_its_calls_is_reached_without_contact_and_named() {
    let add = r#"scene:add { name = "slab", asset = solids.slab, at = { 0, 0.1 } } scene:add { name = "cube", asset = solids.cube, at = { 0, -0.1 } }"#;
    let goal = r#"softvt.predicate { name = "counted", holds = (function() local n = 0 return function() n = n + 1 return n > 8 end end)() }, object = "cube""#;
    let project = project(add, goal);
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
