//! Goals of several predicates: what holds, what was met, and refused goals.

use insta::assert_snapshot;
use softvt::evaluation::verdict::{Outcome, Verdict};

use crate::support::{Project, SOLIDS};

/// A chest whose tray is at the height of the fingers, with a block that the expert pushes to the middle of the tray.
/// The goal is in line 11.
fn project(goal: &str) -> Project {
    let text = format!(
        r#"local solids = require "solids"
local slab = softvt.shape.box {{ size = {{ 0.06, 0.2, 0.01 }} }}
local tray = {{ name = "tray", shape = slab:translate(0, 0, 0.02), density = 500, joint = softvt.slider {{ axis = {{ 0, -1, 0 }}, lower = 0, upper = 0.08, damping = 2, friction = 1 }} }}
local chest = softvt.asset {{ name = "chest", shape = slab:grounded(), body = softvt.articulated {{ parts = {{ tray }} }} }}
local layout = softvt.layout("one", function(scene)
  local x, y = table.unpack(solids.shelf_at)
  scene:add {{ name = "floor", asset = solids.floor, position = {{ 0, 0, 0 }} }}
  scene:add {{ name = "chest", asset = chest, position = {{ x, y, 0.24 }} }}
  scene:add {{ name = "block", asset = solids.cube, position = solids.cube_at }}
end)
local on, goal = softvt.on {{ object = "block", target = "chest.tray" }}, function(on) return {goal} end
local task = softvt.task {{ prompt = "push", layout = layout, budget_steps = 40, goal = goal(on),
  expert = function(arm) solids.push(arm) arm:wait(1) end }}
return softvt.suite {{ name = "one", object_type = "rigid", tasks_differ_in = "spatial", episodes = 1, tasks = {{ task }} }}
"#
    );
    Project::new(&[("x.lua", &text), SOLIDS])
}

fn verdict(goal: &str) -> Verdict {
    project(goal).run("x.lua").record().verdict
}

/// Name of each part of the goal and whether it was met, in one line.
fn parts(verdict: &Verdict) -> String {
    let part = |part: &softvt::evaluation::verdict::GoalPart| {
        let word = match (part.holds, part.met_s) {
            (true, Some(_)) => "holds",
            (false, Some(_)) => "was met",
            _ => "never",
        };
        format!("{}: {word}", part.name)
    };
    verdict.goal_parts.iter().map(part).collect::<Vec<_>>().join(", ")
}

#[test]
fn a_goal_combines_predicates_and_its_parts_are_recorded() {
    let closed = r#"softvt.closed { joint = "chest.tray" }"#;
    let all = verdict(&format!(
        "softvt.all {{ on, {closed}, softvt.none {{ softvt.opened {{ joint = 'chest.tray' }} }} }}"
    ));
    assert!(all.goal && all.safety);
    assert_eq!(all.targets.len(), 1);
    assert_snapshot!(parts(&all), @"block on chest.tray: holds, chest.tray closed: holds, chest.tray open: never");
    let sequence = verdict("softvt.sequence { on, softvt.opened { joint = 'chest.tray', share = 0.5 } }");
    assert!(!sequence.goal);
    assert_snapshot!(parts(&sequence), @"block on chest.tray: holds, chest.tray open: never");
    let any = verdict("softvt.any { on, softvt.turned { joint = 'chest.tray', range = { 0.05, 0.08 } } }");
    assert!(any.goal);
    let single = verdict("on");
    assert!(single.goal && single.goal_parts.is_empty());
}

#[test]
fn a_prompt_of_an_episode_is_recorded_beside_that_of_the_task() {
    let project = project("on");
    let text = project.text("x.lua").replace(
        "return softvt.suite",
        "task.episode_prompt = function(scene, rng)
  return ('push %s, please %d'):format(scene.objects[3].name, rng:int(1, 1000000))
end
return softvt.suite",
    );
    project.write("x.lua", text.as_bytes());
    let run = project.run("x.lua").episodes(2).out("run").finish();
    let records: Vec<_> = project.stored("run").expect("a run").remove(0).records;
    for record in &records {
        assert!(record.header.prompt.starts_with("push block, please "), "{}", record.header.prompt);
        assert_eq!(record.header.task_prompt.as_deref(), Some("push"));
    }
    assert_ne!(records[0].header.prompt, records[1].header.prompt);
    assert_eq!(run.results[0].summary.by_task[0].prompt, "push");
    assert!(project.is_reproduced("run", "0/1"));
}

#[test]
fn relations_are_seen_from_the_base_of_the_robot_and_need_the_hand_away() {
    // The cube is pushed along x to the middle of the tray.
    let met = |goal: &str| verdict(&format!("softvt.all {{ on, {goal} }}")).goal;
    assert!(met("softvt.near { object = 'block', target = 'chest', distance = 0.05 }"));
    assert!(!met("softvt.near { object = 'block', target = 'floor', distance = 0.01 }"));
    assert!(met("softvt.upright { object = 'block' }"));
    assert!(met(
        "softvt.predicate { name = 'high', holds = function(scene) return scene:object('block').centre[3] > 0.2 end }"
    ));
}

#[test]
fn a_goal_that_holds_before_the_robot_moves_is_refused() {
    let error = |goal: &str| project(goal).run("x.lua").error();
    assert_snapshot!(error("softvt.all { softvt.closed { joint = 'chest.tray' }, softvt.upright { object = 'block' } }"), @"x.lua:9: task 0, episode 0: the goal already holds at the start, before the robot moves: chest.tray closed and block upright; change the layout or the goal");
    assert_snapshot!(error("softvt.none { on }"), @"x.lua:9: task 0, episode 0: the goal already holds at the start, before the robot moves: not (block on chest.tray); change the layout or the goal");
}

#[test]
fn wrong_goals_are_refused_at_their_line() {
    let error = |goal: &str| project(goal).run("x.lua").error();
    assert_snapshot!(error("softvt.all {}"), @"x.lua:11: all: expected at least one goal; write softvt.all { a, b }");
    assert_snapshot!(error("softvt.all { on, 5 }"), @"x.lua:11: softvt.all: goals[2]: expected the result of one of softvt.on{…}, softvt.inside{…}, softvt.stacked{…}, softvt.opened{…}, softvt.closed{…}, softvt.turned{…}, softvt.near{…}, softvt.beside{…}, softvt.upright{…}, softvt.predicate{…}, softvt.all{…}, softvt.any{…}, softvt.none{…}, softvt.sequence{…}, got 5");
    assert_snapshot!(error("softvt.all { on, chest }"), @"x.lua:11: softvt.all: goals[2]: expected the result of one of softvt.on{…}, softvt.inside{…}, softvt.stacked{…}, softvt.opened{…}, softvt.closed{…}, softvt.turned{…}, softvt.near{…}, softvt.beside{…}, softvt.upright{…}, softvt.predicate{…}, softvt.all{…}, softvt.any{…}, softvt.none{…}, softvt.sequence{…}, got a table");
    assert_snapshot!(error("softvt.opened { joint = 'chest.tray' }"), @"x.lua:12: task.object: missing; the goal names no object, and the deformation and grip of one are judged: give its scene name");
    assert_snapshot!(error("softvt.all { on, softvt.opened { joint = 'chest.try' } }"), @r#"x.lua:11: task.goal.joint: unknown joint "chest.try"; did you mean "chest.tray"?"#);
    assert_snapshot!(error("softvt.all { on, softvt.none { softvt.any { on } } }"), @r#"x.lua:12: task.goal: can never be met: "block on chest.tray" must hold and must not hold"#);
    assert_snapshot!(error("softvt.stacked { objects = { 'block', 'chest', 'block' } }"), @r#"x.lua:11: task.goal.objects[3]: "block" is there already; give each once"#);
    assert_snapshot!(error("softvt.stacked { objects = { 'chest', 'blok' } }"), @r#"x.lua:11: task.goal.objects: unknown object "blok"; did you mean "block"?"#);
    assert_snapshot!(error("softvt.all { softvt.stacked { objects = { 'chest', 'block' } }, softvt.on { object = 'chest', target = 'block' } }"), @"x.lua:12: task.goal: can never be met: block, chest rest on each other in a circle");
    assert_snapshot!(error("softvt.near { object = 'chest.tray', target = 'block' }"), @r#"x.lua:11: task.goal.object: "chest.tray" is a part of chest, which stays on its joint; name an object whose body is softvt.soft or softvt.rigid"#);
    assert_snapshot!(error("softvt.all { on, softvt.turned { joint = 'chest.tray', range = { 2, 3 } } }"), @"x.lua:8: task 0: goal.range is beyond the limits of chest.tray, 0..0.08");
    assert_snapshot!(error("softvt.all { on, softvt.turned { joint = 'chest.tray', range = { 2, 1 } } }"), @"x.lua:11: task.goal.range: the lowest value, 2, is above the highest, 1; swap them");
    let at_once = |other: &str| {
        error(&format!(
            "softvt.all {{ on, softvt.opened {{ joint = 'chest.tray', share = 0.75 }}, {other} }}"
        ))
    };
    assert_snapshot!(at_once("softvt.turned { joint = 'chest.tray', range = { 0, 0.02 } }"), @r#"x.lua:12: task.goal: can never be met: "chest.tray turned to 0.06..0.08" and "chest.tray turned to 0..0.02" cannot hold at once"#);
    assert_snapshot!(error("softvt.near { object = 'block', target = 'chest', distance = 0 }"), @"x.lua:11: task.goal.distance: expected metres in 0.001..1.5, got 0");
    assert_snapshot!(error("softvt.left_of { object = 'block', target = 'chest', distance = 8 }"), @"x.lua:11: task.goal.distance: expected metres in 0..1.5, got 8");
    assert_snapshot!(error("softvt.left_of { object = 'block', target = 'chest', side = 'right_of' }"), @"x.lua:11: task.goal.side: softvt.left_of is this side already; leave side out, or write softvt.beside");
    assert_snapshot!(error("softvt.stacked { objects = { 'block' } }"), @"x.lua:11: task.goal.objects: expected at least 2, got 1");
    assert_snapshot!(error("softvt.left_of { object = 'block' }"), @"x.lua:11: task.goal.target: missing; expected a string that is not empty");
    assert_snapshot!(error("softvt.near { object = 'block', target = 'block' }"), @r#"x.lua:11: task.goal.target: is "block", which is the object itself; name what it must reach"#);
}

#[test]
fn a_function_of_a_goal_that_fails_ends_the_episode_and_says_where() {
    let predicate = |body: &str| {
        format!("softvt.all {{ on, softvt.predicate {{ name = 'x', holds = function(scene) {body} end }} }}")
    };
    let at_start = |body: &str| project(&predicate(body)).run("x.lua").error();
    assert_snapshot!(at_start("error 'no'"), @"x.lua: task 0, episode 0: x.lua:11: no");
    assert_snapshot!(at_start("return 1"), @r#"x.lua: task 0, episode 0: x.lua:11: the predicate "x" returned 1; return true or false"#);
    assert_snapshot!(at_start("return scene:object('blck').yaw > 0"), @r#"x.lua: task 0, episode 0: x.lua:11: scene: unknown object "blck"; did you mean "block"?"#);
    let drawn = at_start("return math.random() < 2");
    assert!(
        drawn.ends_with(
            "x.lua:11: math.random in a function of the state; its value must follow from its arguments"
        ),
        "{drawn}"
    );
    let read = "return scene:object('block').centre[1] < 1 and scene:object('block').joint == nil";
    assert!(project(&predicate(read)).run("x.lua").record().verdict.goal);
    let late = format!(
        "(function() local calls = 0 return {} end)()",
        predicate("calls = calls + 1 if calls > 3 then error 'late' end return false")
    );
    let record = project(&late).run("x.lua").record();
    let Outcome::Error { message } = record.outcome else { panic!("{:?}", record.outcome) };
    assert!(message.ends_with("x.lua:11: late"), "{message}");
}
