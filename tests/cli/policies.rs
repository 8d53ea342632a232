//! Flags of policies, what is printed of them, and exit codes of policies that fail.

use crate::support::fixtures::{WANDERS, policy_project};

#[test]
fn a_policy_that_answers_nothing_valid_ends_with_its_exit_code() {
    let project = policy_project(
        "return softvt.policy { name = 'p', act = function(obs)\n\
         return { position = obs.position, axis_angle = obs.axis_angle, closure = 0/0 } end }",
    );
    let only = project.softvt("x.lua --policy p.lua --episodes 1 --threads 1 --out only");
    assert_eq!(only.code, 3, "{}", only.err);
    assert!(
        only.err.contains("no episode is valid: the policy's actions were refused in 1 episode, first: "),
        "{}",
        only.err
    );
    assert!(only.out.contains("task 0 episode 0: invalid: the action"), "{}", only.out);
    project.succeeds("report only --out page");
    let page = project.text("page/report.html");
    assert!(page.contains("not finite") && !page.contains("dropped at"), "nothing was dropped");
}

#[test]
fn a_failing_policy_is_reported_with_what_is_kept() {
    let project = policy_project(
        "local episode\nreturn softvt.policy { name = 'p', reset = function(t) episode = t.episode end, act = function(obs)\n\
         if episode == 1 then error 'lost' end\n\
         return { position = obs.position, axis_angle = obs.axis_angle, closure = 0 } end }",
    );
    let message = project.refusal("x.lua --policy p.lua --episodes 2 --threads 1 --out run");
    assert!(message.contains("p.lua:3: lost") && message.contains("1 of 2 episodes are in run"), "{message}");
}

#[test]
fn the_grip_code_of_a_run_is_printed() {
    let act = "act = function(obs) return { position = obs.position, axis_angle = obs.axis_angle, closure = 0.6 } end }";
    let project = policy_project(&format!("return softvt.policy {{ name = 'p', {act}"));
    project.write(
        "binary.lua",
        format!("return softvt.policy {{ name = 'p', gripper = 'binary', {act}").as_bytes(),
    );
    for (out, words, code) in [
        ("a", "p.lua", None),
        ("b", "binary.lua", Some("binary")),
        ("c", "p.lua --gripper binary", Some("binary")),
        ("d", "binary.lua --gripper continuous", Some("continuous")),
    ] {
        let output = project.succeeds(&format!("x.lua --policy {words} --out {out}"));
        let printed = output.err.lines().find_map(|line| line.strip_prefix("softvt: gripper: "));
        assert_eq!(printed, code, "{words}: {}", output.err);
    }
}

#[test]
fn a_policy_cannot_be_privileged_in_its_episodes_alone() {
    let body = "act = function(obs) print('granted: ' .. tostring((pcall(softvt.soft, { youngs_pa = 1e4, poisson = 0.3, density = 300 }))))
return { position = obs.position, axis_angle = obs.axis_angle, closure = 0 } end";
    // The message about a missing module differed between loading and episodes.
    let project = policy_project(&format!(
        "local _, why = pcall(require, 'no_such_module')
local in_episode = tostring(why):find('was not loaded', 1, true) ~= nil
return softvt.policy {{ name = 'flip', privileged = in_episode, {body} }}"
    ));
    let output = project.succeeds("x.lua --policy p.lua --threads 1 --out run");
    assert!(output.err.contains("granted: false") && !output.err.contains("granted: true"), "{}", output.err);
    assert_eq!(project.json("run/run.json")["privileged"], false);
}

#[test]
fn a_policy_that_is_run_as_a_script_is_refused() {
    let message = policy_project(WANDERS).refusal("p.lua");
    assert!(
        message.contains("which is not a plan; run a suite, and give this file as its policy"),
        "{message}"
    );
}
