//! Actions that are joint positions: recorded ones lead to the same states, and bad ones are counted.

use softvt::{
    dataset::{TaskFile, check, manifest},
    policy::Action,
    runner::{DemoCount, PolicyOptions, PolicySource, record},
};

use super::dataset_recording::{Recording, is_reproduced};
use crate::support::{PUSHED_CUBE, Project, SOLIDS, Small, assert_contains};

/// A policy in Lua that commands the joint positions of actions.
fn policy_of(actions: &[Action], joints: &[[f64; 7]]) -> String {
    let row = |(action, joints): (&Action, &[f64; 7])| {
        let numbers = joints.map(|x| format!("{x:?}")).join(", ");
        format!("  {{ joints = {{ {numbers} }}, closure = {:?} }},\n", action.closure())
    };
    let rows: String = actions.iter().zip(joints).map(row).collect();
    format!(
        "local rows = {{\n{rows}}}\nlocal step = 0\nreturn softvt.policy {{ name = 'joints', act = function(obs)\n  \
         step = math.min(step + 1, #rows)\n  return rows[step]\nend }}\n"
    )
}

#[test]
fn an_episode_recorded_in_joint_positions_is_repeated_by_them() {
    let project = Project::new(&[("x.lua", PUSHED_CUBE), SOLIDS]);
    let of_expert = Recording::new(project.run("x.lua").tasks(&[0]), 1, "expert");
    let of_expert = of_expert.with(|options| options.has_images = false);
    of_expert.record();
    let expert = manifest::read(&project.path("expert")).expect("a manifest").swap_remove(0);
    let file = TaskFile::open(&project.path("expert").join(&expert.hdf5_path)).expect("a file");
    let (actions, joints) = (file.actions(0).expect("actions"), file.joint_commands(0).expect("joints"));
    assert!(actions.iter().all(|action| action.joints.is_none()), "the expert commands poses");
    project.write("joints.lua", policy_of(&actions, &joints).as_bytes());

    let by_joints = of_expert.clone().with(|options| options.out = project.path("joints"));
    let policy = || PolicyOptions::new(PolicySource::Lua(project.path("joints.lua")));
    let loaded = by_joints.run.load().expect("a suite");
    let count = DemoCount { demos: 1, attempts: Some(expert.episode + 1) };
    record(&loaded, |_| policy(), count, &by_joints.options).unwrap_or_else(|error| panic!("{error}"));
    let repeated = manifest::read(&project.path("joints")).expect("a manifest").swap_remove(0);
    assert_eq!((repeated.episode, repeated.num_samples), (expert.episode, expert.num_samples));
    assert_eq!(repeated.state_hash, expert.state_hash);

    // The recording says that joint positions were commanded, and is reproduced by them.
    let data = project.path("joints");
    let file = TaskFile::open(&data.join(&repeated.hdf5_path)).expect("a file");
    let recorded = file.actions(0).expect("actions");
    assert!(recorded.iter().zip(&joints).all(|(action, joints)| action.joints == Some(*joints)));
    assert_eq!(file.record(0).expect("a record").stats.far_commands, 0);
    assert_eq!(check::folder(&data).expect("a dataset").problems, [""; 0]);
    assert!(is_reproduced(&data));
}

#[test]
fn joint_positions_outside_of_their_limits_are_clamped_and_counted() {
    let project = Small { task: "budget_steps = 10", ..Small::default() }.project();
    let policy = |factor: &str| {
        format!(
            "return softvt.policy {{ name = 'p', act = function(obs)\n  local joints = {{}}\n  \
             for i = 1, 7 do joints[i] = {factor} * obs.joints[i] end\n  return {{ joints = joints, closure = 0 }}\nend }}\n"
        )
    };
    project.write("hold.lua", policy("1").as_bytes());
    project.write("degrees.lua", policy("180 / math.pi").as_bytes());
    project.write("nan.lua", policy("0 / 0").as_bytes());
    let run = |name: &str| {
        let record = project.run("x.lua").policy(&format!("{name}.lua")).out(name).record();
        (format!("{:?}", record.outcome), record.stats)
    };
    let (_, held) = run("hold");
    assert_eq!((held.steps, held.far_commands), (10, 0));
    assert!(project.is_reproduced("hold", "0/0"));
    let (outcome, degrees) = run("degrees");
    assert_eq!((degrees.steps, degrees.far_commands), (10, 10));
    assert_contains(&outcome, "all 10 commands were out of reach, first: joint");
    assert!(project.is_reproduced("degrees", "0/0"));
    let (outcome, refused) = run("nan");
    assert_contains(&outcome, "holds a number that is not finite");
    assert_eq!(refused.steps, 0);
}
