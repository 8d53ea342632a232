//! Validity of the benchmark on small suites: policies and objects that must fail do so, for the right reason.

use serde_json::Value;

use crate::support::{Project, SPATIAL_SOFT};

/// Episodes of two tasks of different pairs.
fn episodes(words: &str) -> Vec<Value> {
    let project = Project::new(&[]);
    project.succeeds(&format!("{SPATIAL_SOFT} --task 0,9 --episodes 1 --out run {words}"));
    let episodes = project.lines("run/episodes.jsonl");
    assert_eq!(episodes.len(), 2);
    episodes
}

fn number(episode: &Value, key: &str) -> f64 {
    episode[key].as_f64().unwrap_or_else(|| panic!("{key} is not a number in {episode}"))
}

fn all(episodes: &[Value], key: &str, value: bool) -> bool {
    episodes.iter().all(|e| e[key] == value)
}

#[test]
fn noop_and_random_never_succeed() {
    for policy in ["noop", "random"] {
        let episodes = episodes(&format!("--policy {policy}"));
        assert!(all(&episodes, "goal", false) && all(&episodes, "safety", false), "{policy}: {episodes:?}");
        assert!(episodes.iter().all(|e| e["outcome"]["kind"] == "budget"), "{policy}: {episodes:?}");
    }
}

#[test]
fn stiffer_objects_deform_less() {
    let soft = episodes("");
    assert!(all(&soft, "safety", true), "{soft:?}");
    let stiff = episodes("--shift stiffness=10");
    assert!(all(&stiff, "goal", true), "{stiff:?}");
    for (soft, stiff) in soft.iter().zip(&stiff) {
        assert!(number(stiff, "d_peak") < 0.5 * number(soft, "d_peak"), "{soft}\n{stiff}");
        assert_eq!(soft["tau"], stiff["tau"], "the threshold stays nominal");
    }
}

#[test]
fn a_binary_gripper_reaches_the_goal_unsafely() {
    let (careful, binary) = (episodes(""), episodes("--policy expert-binary"));
    for (careful, binary) in careful.iter().zip(&binary) {
        assert!(number(binary, "d_peak") > number(careful, "d_peak"), "{careful}\n{binary}");
    }
    assert!(all(&binary, "goal", true) && all(&binary, "safety", false), "{binary:?}");
}

#[test]
fn nothing_is_carried_without_friction() {
    let none = "--shift friction=0 --set robot.pads.static_mu=0 --set robot.pads.dynamic_mu=0";
    let episodes = episodes(none);
    assert!(all(&episodes, "goal", false), "{episodes:?}");
}

#[test]
fn weak_fingers_carry_nothing() {
    let episodes = episodes("--set robot.gripper.effort=0.2");
    assert!(all(&episodes, "goal", false), "{episodes:?}");
}
