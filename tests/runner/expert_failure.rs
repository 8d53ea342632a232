//! Experts that give up leave their reason in the record and in the results.

use softvt::{evaluation::verdict::Outcome, runner::SuiteResult};

use crate::support::Small;

#[test]
fn the_reason_of_give_up_is_recorded() {
    let project = Small { expert: "arm:wait(0.1) arm:give_up('too slippery')", ..Small::default() }.project();
    let SuiteResult { summary, records, .. } = project.run("x.lua").episodes(2).finish().result();
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
fn notes_of_an_expert_are_in_its_record() {
    let project = Small { expert: "arm:note('grip_width_mm', 31.5)", ..Small::default() }.project();
    assert_eq!(project.run("x.lua").out("run").record().stats.notes["grip_width_mm"], 31.5);
    assert!(project.is_reproduced("run", "0/0"));
}

#[test]
fn an_expert_may_catch_an_unreachable_pose() {
    let expert = "pcall(arm.move_to, arm, softvt.pose { position = { 2, 0, 0.3 } }) arm:wait(5)";
    let project = Small { expert, ..Small::default() }.project();
    let record = project.run("x.lua").record();
    assert!(record.stats.gave_up.is_none() && !record.verdict.goal, "{record:#?}");
    assert_eq!(record.stats.far_commands, 0, "nothing out of reach was sent");
}

#[test]
fn fast_motions_within_reach_are_accepted() {
    let way = "for _, y in ipairs { -0.3, 0.3, -0.3 } do\n\
               arm:move_to(softvt.pose { position = { 0.05, y, 0.2 }, yaw = y }, { speed = 3, angular_speed = 6 })\nend";
    let project = Small { expert: way, task: "budget_steps = 120", ..Small::default() }.project();
    assert_eq!(project.run("x.lua").record().stats.gave_up, None);
}

#[test]
fn a_failed_first_episode_leaves_no_folder() {
    let project = Small { at: "position = { 0, 0.8, 0.1 }", ..Small::default() }.project();
    project.run("x.lua").out("run").error();
    assert!(!project.path("run").exists());
    project.write("x.lua", Small::default().text().as_bytes());
    project.run("x.lua").out("run").record();
}
