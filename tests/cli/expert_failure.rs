//! Experts that give up leave their reason in the record and in the results.

use crate::support::{Project, Small};

#[test]
fn the_reason_of_give_up_is_recorded() {
    let project = Small { expert: "arm:wait(0.1) arm:give_up('too slippery')", ..Small::default() }.project();
    let output = project.succeeds("x.lua --episodes 2 --out run");
    assert!(
        output.err.contains("task 0 episode 0: failed, D 0.00 %, 2.0 s; gave up: too slippery"),
        "{}",
        output.err
    );
    let list =
        "expert gave up in 2 episodes:\n  task 0 episode 0: too slippery\n  task 0 episode 1: too slippery\n";
    assert!(output.out.contains(list), "{}", output.out);
    for (episode, record) in project.lines("run/episodes.jsonl").iter().enumerate() {
        assert_eq!((&record["episode"], &record["gave_up"]), (&episode.into(), &"too slippery".into()));
        assert_eq!(record["outcome"]["kind"], "budget", "the last command stayed to the end");
    }
    assert_eq!(project.json("run/summary.json")["gave_up"][1]["reason"], "too slippery");
}

#[test]
fn without_give_up_there_is_no_reason() {
    let project = Small::default().project();
    let output = project.succeeds("x.lua --out run");
    assert!(!output.out.contains("gave up") && !output.err.contains("gave up"), "{}", output.out);
    assert!(project.lines("run/episodes.jsonl")[0].get("gave_up").is_none());
    assert!(project.json("run/summary.json").get("gave_up").is_none());
}

#[test]
fn an_object_too_wide_for_the_hand_is_given_up_before_the_approach() {
    let wide =
        Small { shape: "softvt.shape.box { size = { 0.12, 0.1, 0.04 } }:grounded()", ..Small::default() };
    let expert = "expert = require('experts.pick_place') { object = 'cube', target = 'post' } }";
    let text = wide.text().replace("expert = function(arm, scene) arm:wait(1) end }", expert);
    let project = Project::new(&[("x.lua", &text)]);
    project.succeeds("x.lua --out run");
    let record = &project.lines("run/episodes.jsonl")[0];
    let reason = "cube is 100 mm wide where the fingers grasp it, and the gripper opens 80 mm";
    assert_eq!((&record["gave_up"], &record["outcome"]["kind"]), (&reason.into(), &"budget".into()));
    assert!(record["d_peak"].as_f64().is_some_and(|d| d < 0.1), "the hand never touched it: {record}");
}

#[test]
fn notes_of_an_expert_are_in_its_record() {
    let project = Small { expert: "arm:note('grip_width_mm', 31.5)", ..Small::default() }.project();
    project.succeeds("x.lua --out run");
    assert_eq!(project.lines("run/episodes.jsonl")[0]["notes"]["grip_width_mm"], 31.5);
    assert!(project.succeeds("replay run 0/0").out.contains("byte-identical"));
}

#[test]
fn an_expert_that_asks_for_nothing_possible_says_so_at_once() {
    let reason = |expert: &'static str| {
        let project = Small { expert, ..Small::default() }.project();
        project.succeeds("x.lua --out run");
        project.lines("run/episodes.jsonl")[0]["gave_up"].as_str().expect("a reason").to_owned()
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
