//! Experts that give up leave their reason in the record and in the results.

use softvt::{
    evaluation::verdict::Outcome,
    report::{styled_text::TerminalFormat, terminal},
    runner::SuiteResult,
};

use crate::support::{Project, Small};

#[test]
fn the_reason_of_give_up_is_recorded() {
    let project = Small { expert: "arm:wait(0.1) arm:give_up('too slippery')", ..Small::default() }.project();
    let finished = project.run("x.lua").episodes(2).finish();
    let line = "task 0 episode 0: ○ goal missed, D 0.00 %, 2.0 s simulated; gave up: too slippery";
    assert!(finished.messages.contains(line), "{}", finished.messages);
    let SuiteResult { summary, records, .. } = finished.result();
    let list =
        "expert gave up in 2 episodes:\n  task 0 episode 0: too slippery\n  task 0 episode 1: too slippery\n";
    let table = terminal::table(&summary, TerminalFormat::PLAIN.with_details());
    assert!(table.contains(list), "{table}");
    for (episode, record) in (0..).zip(&records) {
        assert_eq!(
            (record.header.id.episode, record.stats.gave_up.as_deref()),
            (episode, Some("too slippery"))
        );
        assert_eq!(record.outcome, Outcome::Budget, "the last command stayed to the end");
    }
    assert_eq!(summary.gave_up[1].reason, "too slippery");
}

#[test]
fn without_give_up_there_is_no_reason() {
    let project = Small::default().project();
    let finished = project.run("x.lua").out("run").finish();
    assert!(!finished.messages.contains("gave up"), "{}", finished.messages);
    assert!(
        !terminal::table(&finished.result().summary, TerminalFormat::PLAIN.with_details())
            .contains("gave up")
    );
    assert!(project.lines("run/episodes.jsonl")[0].get("gave_up").is_none());
    assert!(project.json("run/summary.json").get("gave_up").is_none());
}

#[test]
fn an_expert_that_has_not_ended_is_told_with_its_line() {
    let told = |expert: &'static str| {
        let project = Small { expert, ..Small::default() }.project();
        let finished = project.run("x.lua").out("run").finish();
        let record = project.lines("run/episodes.jsonl")[0].to_string();
        assert!(!record.contains("had not ended"), "{record}");
        let line = project.text("x.lua").lines().position(|line| line.contains("arm:wait(60)"));
        (finished.messages, line.map_or(0, |index| index + 1))
    };
    let (messages, line) = told("arm:wait(0.1)\n arm:wait(60)");
    let end = format!("2.0 s simulated; the expert had not ended: it was at x.lua:{line}\n");
    assert!(messages.contains(&end), "{end}{messages}");
    let (messages, _) = told("while true do pcall(arm.wait, arm, 60) end");
    assert!(messages.contains("2.0 s simulated; the expert had not ended\n"), "{messages}");
    let (messages, _) = told("arm:wait(0.1)");
    assert!(!messages.contains("had not ended"), "{messages}");
}

#[test]
fn an_object_too_wide_for_the_hand_is_given_up_before_the_approach() {
    let wide =
        Small { shape: "softvt.shape.box { size = { 0.12, 0.1, 0.04 } }:grounded()", ..Small::default() };
    let expert = "expert = require('experts.pick_place') { object = 'cube', target = 'post' } }";
    let text = wide.text().replace("expert = function(arm, scene) arm:wait(1) end }", expert);
    let project = Project::new(&[("x.lua", &text)]);
    let record = project.run("x.lua").record();
    let reason = "cube is 100 mm wide where the fingers grasp it, and the gripper opens 80 mm";
    assert_eq!((record.stats.gave_up.as_deref(), &record.outcome), (Some(reason), &Outcome::Budget));
    assert!(
        record.verdict.object().d_peak.is_some_and(|d| d < 0.1),
        "the hand never touched it: {record:#?}"
    );
}

/// A suite in which the expert places a soft cube that the layout has changed.
fn slippery(change: &str, budget: u32) -> Project {
    let suite = format!(
        "local pick_place, arrange = require 'experts.pick_place', require 'layouts.arrange'
        local table_top, plate, cube = require 'assets.table', require 'assets.plate', require 'assets.cube'
        local layout = softvt.layout('l', function(scene, rng)
          scene:add {{ name = 'table', asset = table_top, position = {{ 0, 0, 0 }} }}
          arrange.add(scene, rng, {{ {{ name = 'plate', asset = plate, at = {{ 0.04, 0.12 }} }},
            {{ name = 'left', asset = cube, at = {{ -0.08, -0.08 }} }} }}, 0.02)
          {change}
        end)
        return softvt.suite {{ name = 'slippery', object_type = 'deformable', tasks_differ_in = 'spatial', episodes = 1, tasks = {{
          softvt.task {{ prompt = 'p', layout = layout, goal = softvt.on {{ object = 'left', target = 'plate' }},
            expert = pick_place {{ object = 'left', target = 'plate' }}, budget_steps = {budget} }} }} }}"
    );
    Project::new(&[("x.lua", &suite)])
}

#[test]
fn a_grip_that_the_hand_does_not_have_ends_the_episode_alone() {
    let reason = |coating: f64| {
        let change = format!("scene:object('left').coating = {coating}");
        slippery(&change, 200).run("x.lua").record().stats.gave_up.expect("a reason")
    };
    assert_eq!(reason(0.001), "left needs a force of 248 N on each pad, which the hand does not have");
    assert_eq!(reason(0.0045), "left needs a width of -7.7 mm, which the hand does not have");
    let held = slippery("", 12).run("x.lua").record();
    assert_eq!((held.stats.gave_up, held.outcome), (None, Outcome::Budget));
}

#[test]
fn hints_beyond_the_object_end_no_run() {
    for hint in ["grasp_height_m = 0.2", "grasp_offset_m = 0.5", "grasp_width_m = -0.2"] {
        let text = Small::default().text();
        let expert = "expert = require('experts.pick_place') { object = 'cube', target = 'post' } }";
        let text = text.replace("expert = function(arm, scene) arm:wait(1) end }", expert);
        let with_hint =
            text.replacen("name = \"cube\",", &format!("name = \"cube\", hints = {{ {hint} }},"), 1);
        assert_ne!(with_hint, text, "{text}");
        let record = Project::new(&[("x.lua", &with_hint)]).run("x.lua").record();
        assert!(!matches!(record.outcome, Outcome::Error { .. }), "{hint}: {:?}", record.outcome);
    }
}

#[test]
fn notes_of_an_expert_are_in_its_record() {
    let project = Small { expert: "arm:note('grip_width_mm', 31.5)", ..Small::default() }.project();
    assert_eq!(project.run("x.lua").out("run").record().stats.notes["grip_width_mm"], 31.5);
    assert!(project.is_reproduced("run", "0/0"));
}

#[test]
fn an_expert_that_asks_for_nothing_possible_says_so_at_once() {
    let reason = |expert: &'static str| {
        let project = Small { expert, ..Small::default() }.project();
        project.relative(project.run("x.lua").record().stats.gave_up.expect("a reason"))
    };
    let far = reason("arm:move_to(softvt.pose { position = { 40, 20, 200 } })");
    assert!(
        far.starts_with("x.lua:12: unreachable pose: the tool gets no nearer to (40.000, 20.000, 200.000) m")
            && far.ends_with("; positions are in metres"),
        "{far}"
    );
    let idle = reason("return");
    let expected =
        "x.lua:12: the expert ended without a command; it is called once and returns when the task is done";
    assert_eq!(idle, expected);
}
