//! Comparison of a policy's answers with demonstrations: what is wrong with them is named.

use std::{path::Path, sync::Arc};

use softvt::{
    dataset::TaskFile,
    geometry::Vec3,
    policy::{Action, ActionChunk, Observation, Policy, PolicyError, SensorStreams, ToolCommand},
    robot::rotation,
    runner::{
        PolicyConfig, SilentObserver,
        policy_check::{PolicyCheck, check_policy},
        replay::demos_of,
    },
};

use super::dataset_recording::Recording;
use crate::support::{Project, SPATIAL_SOFT};

/// Changes an answer: the recorded action, and the position and orientation of the tool when it is executed.
type Change = fn(Action, Vec3, softvt::geometry::Quat) -> Action;

/// Answers with the recorded actions of a demonstration, changed.
struct Memory {
    actions: Vec<Action>,
    step: usize,
    stride: usize,
    change: Change,
}

/// Number of actions per answer.
const CHUNK: usize = 8;

impl Policy for Memory {
    fn name(&self) -> &str {
        "memory"
    }

    fn streams(&self) -> SensorStreams {
        SensorStreams::default()
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        let robot = &observation.robot;
        let orientation_b = rotation::from_axis_angle(&robot.ee_axis_angle_b);
        let last = self.actions.len() - 1;
        let command = |k: usize| -> ToolCommand {
            let action = self.actions[(self.step + k * self.stride).min(last)];
            (self.change)(action, robot.ee_position_b, orientation_b).into()
        };
        let commands = (0..CHUNK).map(command).collect();
        self.step += CHUNK;
        Ok(ActionChunk { commands })
    }
}

fn check(dataset: &Path, stride: usize, change: Change) -> PolicyCheck {
    let demo = &demos_of(dataset).expect("a dataset")[0];
    let actions = TaskFile::open(&demo.file).and_then(|file| file.actions(demo.demo)).expect("actions");
    check_answers(dataset, actions, stride, change)
}

/// As [`check`], with the joint positions of the recorded actions, changed.
fn check_joints(dataset: &Path, change: fn([f64; 7]) -> [f64; 7]) -> PolicyCheck {
    let demo = &demos_of(dataset).expect("a dataset")[0];
    let file = TaskFile::open(&demo.file).expect("a file");
    let (actions, joints) = (file.actions(demo.demo), file.joint_commands(demo.demo));
    let actions = actions.expect("actions").into_iter().zip(joints.expect("joint positions"));
    let actions = actions.map(|(action, joints)| Action::of_joints(change(joints), action.grip)).collect();
    check_answers(dataset, actions, 1, |action, _, _| action)
}

fn check_answers(dataset: &Path, actions: Vec<Action>, stride: usize, change: Change) -> PolicyCheck {
    let start = move |_: &_| -> Box<dyn Policy> {
        Box::new(Memory { actions: actions.clone(), step: 0, stride, change })
    };
    let policy = PolicyConfig::of("memory", start).expect("a name");
    check_policy(&policy, dataset, 1, &(Arc::new(SilentObserver) as _))
        .unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn what_is_wrong_with_answers_is_named() {
    let project = Project::new(&[]);
    Recording::new(project.run(SPATIAL_SOFT).tasks(&[3]), 1, "data").with(|o| o.has_images = false).record();
    let dataset = project.path("data");
    let same = check(&dataset, 1, |action, _, _| action);
    assert_eq!(same.findings, [""; 0], "{same:?}");
    assert!(same.translation.error.is_some_and(|error| error < 1e-9), "{same:?}");
    assert!(same.grip.correlation.is_some_and(|r| r > 0.999) && same.answers > 5, "{same:?}");
    let cases: [(&str, usize, Change); 6] = [
        ("gripper: the answers are inverted", 1, |a, _, _| {
            Action::new(a.position_b, a.axis_angle_b, 1.0 - a.closure())
        }),
        ("these look like millimetres", 1, |a, tool, _| Action {
            position_b: tool + 1e3 * (a.position_b - tool),
            ..a
        }),
        ("(x, y, z) of the answers are (y, −x, z)", 1, |a, tool, _| {
            let d = a.position_b - tool;
            Action { position_b: tool + Vec3::new(d.y, -d.x, d.z), ..a }
        }),
        ("in the frame of the robot's base", 1, |a, _, _| Action {
            position_b: a.position_b + Vec3::new(0.5, 0.0, 0.2),
            ..a
        }),
        ("these look like 10 Hz", 2, |a, _, _| a),
        ("do not follow the demonstrations", 1, |a, tool, _| Action {
            position_b: tool + 0.02 * (1e5 * a.position_b).map(f64::sin),
            ..a
        }),
    ];
    let same = check_joints(&dataset, |joints| joints);
    assert_eq!(same.findings, [""; 0], "{same:?}");
    assert!(same.translation.error.is_some_and(|error| error < 2e-3), "{same:?}");
    let degrees = check_joints(&dataset, |joints| joints.map(f64::to_degrees));
    assert!(degrees.findings.iter().any(|f| f.contains("these look like degrees")), "{degrees:?}");
    for (expected, stride, change) in cases {
        let found = check(&dataset, stride, change);
        assert!(found.findings.iter().any(|finding| finding.contains(expected)), "{expected}: {found:#?}");
        assert!(found.text().contains(expected));
    }
}

#[test]
fn a_policy_without_answers_cannot_be_compared() {
    let project = Project::new(&[]);
    Recording::new(project.run(SPATIAL_SOFT).tasks(&[3]), 1, "data").with(|o| o.has_images = false).record();
    let noop = PolicyConfig::named("noop").expect("built in");
    let refused = check_policy(&noop, &project.path("data"), 1, &(Arc::new(SilentObserver) as _));
    let message = refused.err().map(|error| error.to_string());
    assert!(message.is_some_and(|text| text.contains("only policy servers")), "of a built-in policy");
}
