//! The grip code force in an episode: the pads press on a soft cube with the force that the policy commands.

use softvt::{policy::profile::GripCode, runner::TraceDetail};

use crate::support::Small;

#[test]
fn the_pads_press_with_the_commanded_force() {
    let project = Small { task: "budget_steps = 230", ..Small::default() }.project();
    project.write("force.lua", include_bytes!("../data/three_newtons.lua"));
    project.run("x.lua").policy("force.lua").out("run").trace(TraceDetail::State).record();
    let trace = project.lines("run/trace/task_000/episode_00000.jsonl");
    let force = |step: usize| -> [f64; 2] {
        std::array::from_fn(|side| trace[step]["pad_force_n"][side].as_f64().expect("a force"))
    };
    for (from, to, expected) in [(110, 125, 3.0), (145, 158, 3.0), (190, 218, 5.0)] {
        for step in from..to {
            let [left, right] = force(step);
            let mean = 0.5 * (left + right);
            assert!(
                (mean / expected - 1.0).abs() < 0.03,
                "step {step}: {left} N and {right} N of {expected} N"
            );
        }
    }
    let most = (60..160).map(|step| 0.5 * force(step).iter().sum::<f64>()).fold(0.0, f64::max);
    // The bound of the gripper's own tests: a tenth of the force, and 0.1 N.
    assert!(most < 1.1 * 3.0 + 0.1, "overshoot: {most} N");
    assert_eq!(force(228), [0.0; 2], "opened");
    assert!(project.is_reproduced("run", "0/0"));
}

#[test]
fn the_grip_code_of_a_lua_policy_is_its_own_or_that_of_the_run() {
    // 0.6 is closed in the code binary.
    let policy = |declared: &str| {
        format!(
            "return softvt.policy {{ name = 'p', {declared} act = function(obs)
  return {{ position = obs.position, axis_angle = obs.axis_angle, closure = 0.6 }} end }}"
        )
    };
    let project = Small { task: "budget_steps = 10", ..Small::default() }.project();
    project.write("plain.lua", policy("").as_bytes());
    project.write("binary.lua", policy("gripper = 'binary',").as_bytes());
    for (name, policy, given, code, closure) in [
        ("a", "plain.lua", None, None, 0.6),
        ("b", "binary.lua", None, Some("binary"), 1.0),
        ("c", "plain.lua", Some(GripCode::Binary), Some("binary"), 1.0),
        ("d", "binary.lua", Some(GripCode::Continuous), Some("continuous"), 0.6),
    ] {
        let run = project.run("x.lua").policy(policy).with_policy(|policy| policy.gripper = given);
        run.trace(TraceDetail::State).out(name).record();
        assert_eq!(project.json(&format!("{name}/run.json"))["gripper"].as_str(), code, "{name}");
        let trace = project.lines(&format!("{name}/trace/task_000/episode_00000.jsonl"));
        assert_eq!(trace[3]["closure"].as_f64(), Some(closure), "{name}: {}", trace[3]);
    }
}
