//! Experts that give up leave their reason in the record and in the results.

use crate::support::Small;

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
        assert_eq!(record["outcome"]["kind"], "timeout", "the last command stayed to the end");
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
