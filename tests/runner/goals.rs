//! Goals of several predicates: what holds, and what was met.

use insta::assert_snapshot;
use softvt::evaluation::verdict::Verdict;

use crate::support::{Project, SOLIDS};

/// The chest of the module `tray` with a goal, in which `on` is the block on the tray.
fn project(goal: &str) -> Project {
    let suite = format!("local tray = require 'tray'\nlocal on = tray.on\nreturn tray.suite({goal})\n");
    Project::new(&[("x.lua", &suite), ("tray.lua", include_str!("../fixtures/tray.lua")), SOLIDS])
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
    project.replace(
        "tray.lua",
        "prompt = \"push\",",
        "prompt = \"push\", episode_prompt = function(scene, rng)
  return ('push %s, please %d'):format(scene.objects[3].name, rng:int(1, 1000000))
end,",
    );
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
fn a_goal_can_name_a_part() {
    assert!(!verdict("softvt.on { object = 'block', target = 'chest' }").goal, "the base does not carry it");
}
