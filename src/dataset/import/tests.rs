//! Small files in foreign layouts, and the demonstrations read from them.

use std::{fs, path::PathBuf};

use serde_json::{Value, json};

use super::{libero::goals, mujoco::MujocoModel, *};
use crate::hdf5::{ChunkedSteps, write_file};
use softvt_benchmark::CONTROL_DT;
use softvt_geometry::{Pose, Quat, Vec3};
use softvt_policy::{Action, EncodedGrip, GripTarget, NumberType, ToolCommand, ToolMotion};
use softvt_robot::{IkSpec, ik::DiffIk, rotation};
use softvt_runs::record::EpisodeRecord;

const STEPS: usize = 6;
const START: [f64; 7] = [0.0, -0.161, 0.0, -2.4446, 0.0, 2.2268, 0.78];

/// Joint angles at step k of an arm that swings.
fn joints(k: usize) -> [f64; 7] {
    std::array::from_fn(|i| START[i] + 0.03 * (i as f64 + 1.0) * (0.7 * k as f64).sin())
}

fn tool(k: usize) -> Pose {
    DiffIk::new(&IkSpec::default(), START, CONTROL_DT).tool_pose(&joints(k))
}

/// Action at step k.
fn share(k: usize) -> [f64; 7] {
    let x = k as f64;
    [0.5 * x.sin(), -0.3, 0.1 * x, 0.2, -0.4 * x.cos(), 0.1, if k < 3 { -1.0 } else { 1.0 }]
}

type Damage = fn(&mut FileBuilder);

struct FileBuilder {
    folder: tempfile::TempDir,
    environment: Value,
    about: Vec<(&'static str, String)>,
    demo: Vec<(&'static str, String)>,
    /// Name, shape per step, values.
    data: Vec<(String, Vec<usize>, Vec<f64>)>,
}

impl FileBuilder {
    fn new(environment: Value) -> Self {
        let folder = tempfile::tempdir().unwrap();
        Self { folder, environment, about: Vec::new(), demo: Vec::new(), data: Vec::new() }
    }

    /// LIBERO: observations after each action, states before it.
    fn libero() -> Self {
        let kwargs =
            json!({ "robots": ["Panda"], "control_freq": 20, "controller_configs": { "type": "OSC_POSE" } });
        let mut file =
            Self::new(json!({ "env_name": "Libero_Floor_Manipulation", "type": 1, "env_kwargs": kwargs }));
        file.each("actions", |k| share(k).to_vec());
        file.each("obs/joint_states", |k| joints(k + 1).to_vec());
        let site =
            |k: usize| Pose::translation(-0.6, 0.0, 0.0) * tool(k + 1) * Pose::translation(0.0, 0.0, -0.0069);
        file.each("obs/ee_pos", |k| site(k).translation.vector.as_slice().to_vec());
        file.each("obs/ee_ori", |k| rotation::axis_angle(&site(k).rotation).as_slice().to_vec());
        file.each("states", |k| [&[0.05 * k as f64], &joints(k)[..], &[0.04, -0.04], &[0.0; 9]].concat());
        file
    }

    /// SoftVTBench, whose tool point is 3.6 mm farther out.
    fn softvtbench() -> Self {
        let mut file = Self::new(json!({ "env_name": "Isaac", "type": 2 }));
        let seen = |k: usize| tool(k) * Pose::translation(0.0, 0.0, 0.0036);
        let finger = |k: usize| if k < 3 { 0.04 } else { 0.03 };
        let pressed = |k: usize| if k < 4 { 0.0 } else { 2.0 };
        file.each("actions", |k| {
            let (at, turn) = (seen(k).translation.vector, rotation::axis_angle(&seen(k).rotation));
            [at.as_slice(), turn.as_slice(), &[finger(k)], &[0.0, 0.0, pressed(k)], &[0.0, 0.0, pressed(k)]]
                .concat()
        });
        file.each("obs/eef_pose", |k| {
            let (at, q) = (seen(k).translation.vector, rotation::canonical(&seen(k).rotation));
            vec![at.x, at.y, at.z, q.w, q.i, q.j, q.k]
        });
        file.each("obs/arm_joint_pos", |k| joints(k).to_vec());
        file.each("obs/gripper_pos", |k| vec![finger(k); 2]);
        file.demo.push(("language", "Pick up the  CUP.".to_owned()));
        file
    }

    fn each(&mut self, name: &str, row: impl Fn(usize) -> Vec<f64>) {
        let width = row(0).len();
        self.put(name, &[width], (0..STEPS).flat_map(row).collect());
    }

    fn put(&mut self, name: &str, row: &[usize], numbers: Vec<f64>) {
        self.data.retain(|(known, ..)| known != name);
        self.data.push((name.to_owned(), row.to_vec(), numbers));
    }

    fn numbers(&mut self, name: &str) -> &mut Vec<f64> {
        &mut self.data.iter_mut().find(|(known, ..)| known == name).expect("an array").2
    }

    fn without(mut self, name: &str) -> Self {
        self.data.retain(|(known, ..)| !known.starts_with(name));
        self
    }

    fn write(&self) -> PathBuf {
        let path = self.folder.path().join("pick_up_the_cup_demo.hdf5");
        write_file(&path, &self.environment, STEPS, 1, |writer| {
            for (name, text) in &self.about {
                writer.group("data").unwrap().set_attr_string(name, text).unwrap();
            }
            for (name, text) in &self.demo {
                writer.group("data/demo_0").unwrap().set_attr_string(name, text).unwrap();
            }
            for (name, row, numbers) in &self.data {
                let steps = numbers.len() / row.iter().product::<usize>();
                let length = ChunkedSteps { steps, per_chunk: steps };
                let data =
                    writer.create_dataset(&format!("data/demo_0/{name}"), NumberType::F64, length, row, 8)?;
                data.write_raw(numbers).unwrap();
            }
            Ok(())
        })
        .unwrap();
        path
    }

    fn read(&self) -> (ForeignFormat, ForeignDemo) {
        let read = read(&self.write()).unwrap();
        (read.format, read.demos.into_iter().next().unwrap())
    }

    fn refusal(&self) -> String {
        let message = read(&self.write()).unwrap_err().to_string();
        assert!(message.contains("pick_up_the_cup_demo.hdf5: /data"), "{message}");
        message
    }
}

fn poses(demo: &ForeignDemo) -> Vec<Action> {
    let pose = |command: &ToolCommand| match (command.motion, command.grip) {
        (
            ToolMotion::Pose { position_b, axis_angle_b },
            EncodedGrip::Target(GripTarget::Closure(closure)),
        ) => Action::new(position_b, axis_angle_b, closure),
        _ => panic!("a pose and a closure"),
    };
    demo.commands.iter().map(pose).collect()
}

/// Distance of a command from the goal of robosuite's controller at step k, computed with matrices.
fn off(command: &Action, tool: &Pose, k: usize) -> f64 {
    let [x, y, z, a, b, c, _] = share(k);
    let at = tool.translation.vector + Vec3::new(x, y, z) * 0.05;
    let spin = Vec3::new(a, b, c) * 0.5;
    // Rodrigues' formula, premultiplied: the axes are those of the base.
    let (angle, cross) = (spin.norm(), (spin / spin.norm()).cross_matrix());
    let turned =
        softvt_geometry::Mat3::identity() + cross * angle.sin() + cross * cross * (1.0 - angle.cos());
    let expected = turned * tool.rotation.to_rotation_matrix().into_inner();
    let got = rotation::from_axis_angle(&command.axis_angle_b).to_rotation_matrix().into_inner();
    (command.position_b - at).norm() + (expected - got).norm()
}

#[test]
fn liberos_steps_become_the_goals_of_its_controller() {
    let file = FileBuilder::libero();
    let (format, demo) = file.read();
    assert_eq!(
        (format, demo.task.prompts.clone()),
        (ForeignFormat::Libero, vec!["pick up the cup".to_owned()])
    );
    // The states are from before each action, the observations from after it.
    for (k, action) in poses(&demo).iter().enumerate() {
        assert!(off(action, &tool(k), k) < 1e-9, "step {k}");
        assert_eq!(action.closure(), f64::from(u8::from(k >= 3)));
    }
    assert_eq!(demo.gripper_closed, [false, false, false, true, true, true]);
    assert_eq!(
        demo.initial_condition,
        InitialCondition::OtherSimulator { joints: Some(joints(0)), objects: Vec::new() }
    );
    // Without states, the observations are assumed to be LIBERO's: the first is from after the first action.
    let (_, demo) = file.without("states").read();
    for (k, action) in poses(&demo).iter().enumerate() {
        assert!(off(action, &tool(k.max(1)), k) < 1e-9, "step {k}");
    }
}

#[test]
fn observations_from_before_each_action_are_recognised_by_the_states() {
    let mut file = FileBuilder::libero().without("obs/ee");
    file.each("obs/joint_states", |k| joints(k).to_vec());
    let (_, demo) = file.read();
    poses(&demo).iter().enumerate().for_each(|(k, action)| assert!(off(action, &tool(k), k) < 1e-9));
}

#[test]
fn without_joints_the_recorded_tool_is_transformed_to_our_frames() {
    let (_, demo) = FileBuilder::libero().without("obs/joint").without("states").read();
    for (k, action) in poses(&demo).iter().enumerate() {
        assert!(off(action, &tool(k.max(1)), k) < 1e-9, "step {k}");
    }
    let mut lost = FileBuilder::libero().without("obs/joint").without("states");
    lost.each("obs/ee_pos", |_| vec![3.0, 0.0, 1.0]);
    assert!(lost.refusal().contains("the robot's position is not known"));
    // Without poses, steps stay relative and follow robosuite's spring.
    let (_, demo) = FileBuilder::libero().without("obs/").without("states").read();
    let ToolMotion::Delta { full: false, translation_b, rotation_b, .. } = demo.commands[1].motion else {
        panic!("no step")
    };
    let [x, _, _, _, b, _, _] = share(1);
    assert!((translation_b.x - 0.05 * x).abs() < 1e-15 && (rotation_b.y - 0.5 * b).abs() < 1e-15);
    assert_eq!(
        demo.initial_condition,
        InitialCondition::OtherSimulator { joints: None, objects: Vec::new() }
    );
}

#[test]
fn robomimics_observations_are_from_before_each_action() {
    let mut file = FileBuilder::libero().without("obs/ee").without("obs/joint");
    file.each("obs/robot0_joint_pos", |k| joints(k).to_vec());
    file.each("obs/robot0_eef_pos", |k| tool(k).translation.vector.as_slice().to_vec());
    let quaternion = |k: usize| rotation::canonical(&tool(k).rotation).coords;
    file.each("obs/robot0_eef_quat", |k| quaternion(k).as_slice().to_vec());
    let (_, demo) = file.read();
    poses(&demo).iter().enumerate().for_each(|(k, action)| assert!(off(action, &tool(k), k) < 1e-9));
}

#[test]
fn a_goal_without_rotation_keeps_the_last_goals_orientation() {
    let tool = [tool(0), tool(1), tool(2)];
    let step = |turn: Vec3| ToolCommand {
        motion: ToolMotion::Delta {
            full: false,
            translation_b: Vec3::x(),
            rotation_b: turn,
            is_clamped: false,
        },
        grip: EncodedGrip::Target(GripTarget::Closure(0.0)),
    };
    let found = goals(&tool, &[step(Vec3::zeros()), step(Vec3::z() * 0.1), step(Vec3::zeros())]);
    let turned = |k: usize| match found[k].motion {
        ToolMotion::Pose { axis_angle_b, .. } => rotation::from_axis_angle(&axis_angle_b),
        other => panic!("{other:?}"),
    };
    let spun = Quat::from_axis_angle(&Vec3::z_axis(), 0.1) * tool[1].rotation;
    assert!(turned(0).angle_to(&tool[0].rotation) < 1e-9);
    assert!(turned(1).angle_to(&spun) < 1e-9 && turned(2).angle_to(&spun) < 1e-9);
}

const MODEL: &str = r#"<mujoco><default><joint type="free"/></default><!-- <body name="no"/> --><worldbody>
  <body name="robot0_base" pos="-0.6 0 0.1"><body name="robot0_link1"><joint name="j1" axis="0 0 1"/>
    <body name="robot0_link2"><joint name="j2" type='hinge'/></body></body></body>
  <body name="cup_1_main" pos="9 9 9"><geom type="box"/><body name="cup_1_inner"/><freejoint name="cup_1_joint0"/></body>
  <body name="stove_1_main" pos="0.1 0.2 0.3" quat="0 0 0 2"><geom/></body>
  <body name="ball"><joint type="ball"/></body>
</worldbody></mujoco>"#;

#[test]
fn object_poses_are_read_from_a_mujoco_state_by_its_model() {
    let model = MujocoModel::read(MODEL).unwrap();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let positions = [0.1, 0.2, 0.4, -0.3, 0.5, half, 0.0, 0.0, half, 1.0, 0.0, 0.0, 0.0];
    let state = [&[0.0], &positions[..], &[0.0; 2 + 6 + 3]].concat();
    let objects = model.object_poses(&state).unwrap();
    let named = |name: &str| objects.iter().find(|object| object.name == name).unwrap();
    let cup = named("cup_1");
    assert!((cup.pose.translation.vector - Vec3::new(1.0, -0.3, 0.4)).norm() < 1e-12 && cup.in_base);
    assert!((cup.pose.rotation * Vec3::x() - Vec3::y()).norm() < 1e-12);
    assert!((named("stove_1").pose.rotation * Vec3::x() + Vec3::x()).norm() < 1e-12);
    assert_eq!(model.object_poses(&state[1..]), None, "a state of another model");
    assert_eq!(MujocoModel::read("<mujoco/>"), None);
}

#[test]
fn softvtbenchs_poses_are_transformed_from_its_tool_to_ours() {
    let file = FileBuilder::softvtbench();
    let (format, mut demo) = file.read();
    assert_eq!(format, ForeignFormat::SoftVtBench);
    assert_eq!(demo.task.prompts[0], "Pick up the  CUP.");
    for (k, action) in poses(&demo).iter().enumerate() {
        let away = action.position_b - tool(k).translation.vector;
        let turned = rotation::from_axis_angle(&action.axis_angle_b).angle_to(&tool(k).rotation);
        assert!(away.norm() < 1e-9 && turned < 1e-7, "step {k}: {away}");
        assert!((action.closure() - if k < 3 { 0.0 } else { 0.25 }).abs() < 1e-12);
    }
    assert_eq!(demo.gripper_closed, [false, false, false, false, true, true]);
    // The measured closure of fingers stopped by a rigid object implies no force.
    demo.close_fully_on_rigid_object();
    let percent: Vec<f64> = poses(&demo).iter().map(|a| (100.0 * a.closure()).round()).collect();
    assert_eq!(percent, [0.0, 0.0, 0.0, 25.0, 100.0, 100.0]);
}

#[test]
fn softvtbenchs_objects_are_those_of_the_initial_state() {
    let mut file = FileBuilder::softvtbench();
    file.put("initial_state/articulation/robot/root_pose", &[7], vec![-0.66, 0.0, 0.912, 1.0, 0.0, 0.0, 0.0]);
    file.put("initial_state/articulation/robot/joint_position", &[9], [&START[..], &[0.04; 2]].concat());
    file.put("initial_state/rigid_object/plate_1/root_pose", &[7], vec![0.04, 0.1, 0.9, 1.0, 0.0, 0.0, 0.0]);
    let nodes = vec![0.0, 0.0, 0.9, 0.2, 0.0, 0.9, 0.1, 0.3, 0.93];
    file.put("initial_state/deformable_object/soft_bun/nodal_position", &[3, 3], nodes);
    let InitialCondition::OtherSimulator { joints, objects } = file.read().1.initial_condition else {
        panic!("an episode")
    };
    assert_eq!(joints, Some(START));
    let at = |i: usize| objects[i].pose.translation.vector;
    assert_eq!(
        (objects[0].name.as_str(), objects[1].name.as_str(), objects.len()),
        ("plate_1", "soft_bun", 2)
    );
    assert!((at(0) - Vec3::new(0.7, 0.1, -0.012)).norm() < 1e-12 && !objects[0].is_soft);
    assert!((at(1) - Vec3::new(0.76, 0.1, -0.002)).norm() < 1e-12 && objects[1].is_soft);
}

#[test]
fn errors_name_the_key() {
    const ROBOT: &str = "initial_state/articulation/robot";
    const KWARGS: &str = "env_kwargs";
    let libero: [(Damage, &str); 13] = [
        (|m| m.demo.push(("model_file", "<mujoco/>".to_owned())), "model_file: not a MuJoCo model"),
        (|m| m.demo.push(("model_file", MODEL.to_owned())), "states: expected the shape (6, "),
        (
            |m| m.numbers("actions")[37] = 1.4,
            "actions: step 5, number 2: 1.4, expected a fraction of a step in -1..1",
        ),
        (|m| m.numbers("actions")[0] = f64::NAN, "actions: step 0, number 0: NaN is not finite"),
        (|m| m.each("obs/joint_states", |_| vec![0.0; 6]), "6 joints per step; a Panda has 7"),
        (|m| m.each("obs/joint_states", |_| vec![0.0; 7]), "joint 4 is at 0 rad, outside of a Panda's"),
        (
            |m| m.put("obs/joint_states", &[7], vec![0.0; 7]),
            "obs/joint_states: expected the shape (6, 7), got [1, 7]",
        ),
        (
            |m| m.each("obs/ee_pos", |k| vec![0.1 * k as f64, 0.0, 0.0]),
            "not where the joint angles put the tool",
        ),
        (|m| m.data.retain(|(name, ..)| name != "obs/ee_ori"), "obs/ee_ori: it is missing"),
        (|m| m.environment[KWARGS]["robots"] = json!(["Sawyer"]), "the robot is Sawyer"),
        (|m| m.environment[KWARGS]["control_freq"] = json!(10), "10 control steps per second; expected 20"),
        (
            |m| m.environment[KWARGS]["controller_configs"]["type"] = json!("JOINT_POSITION"),
            "the controller is JOINT_POSITION",
        ),
        (
            |m| m.environment[KWARGS]["controller_configs"]["output_max"] = json!([1, 2, 3, 4, 5, 6]),
            "output_max",
        ),
    ];
    let softvtbench: [(Damage, &str); 12] = [
        (
            |m| m.each("actions", |k| [&[1e3 * tool(k).translation.x, 0.0, 0.0], &[0.0; 4][..]].concat()),
            "° from obs/eef_pose: expected absolute poses",
        ),
        (|m| m.each("actions", |k| [tool(k).translation.vector.as_slice(), &[0.0; 4]].concat()), "and 1"),
        (|m| m.put(&format!("{ROBOT}/joint_position"), &[8], vec![0.0; 8]), "is it another robot?"),
        (|m| m.put(&format!("{ROBOT}/joint_position"), &[9], vec![f64::NAN; 9]), "NaN is not finite"),
        (|m| m.put(&format!("{ROBOT}/joint_position"), &[9], vec![100.0; 9]), "outside of a Panda's"),
        (
            |m| m.put(&format!("{ROBOT}/root_pose"), &[7], vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
            "another order than w x y z",
        ),
        (
            |m| m.numbers("obs/eef_pose").chunks_mut(7).for_each(|row| row[3..].rotate_left(1)),
            "° away from where the joint angles have the tool",
        ),
        (
            |m| m.numbers("obs/eef_pose").chunks_mut(7).for_each(|row| row[0] -= 0.66),
            "mm from where obs/arm_joint_pos puts the tool: expected poses in the robot's base frame",
        ),
        (|m| m.numbers("actions")[6] = 0.3, "number 6: 0.3, expected a finger's"),
        (|m| m.numbers("obs/eef_pose")[3] = 2.0, "not a unit quaternion w x y z"),
        (|m| m.about.push(("robot_type", "UR10e".to_owned())), "the robot is UR10e"),
        (
            |m| m.each("obs/arm_joint_pos", |k| joints(k)[..6].to_vec()),
            "obs/arm_joint_pos: 6 joints per step; a Panda has 7: is it another robot?",
        ),
    ];
    let of_libero = libero.into_iter().map(|case| (FileBuilder::libero(), case));
    let of_softvtbench = softvtbench.into_iter().map(|case| (FileBuilder::softvtbench(), case));
    for (mut file, (damage, words)) in of_libero.chain(of_softvtbench) {
        damage(&mut file);
        let message = file.refusal();
        assert!(message.contains(words), "{words}: {message}");
    }
}

#[test]
fn an_own_demonstration_whose_language_was_edited_is_refused() {
    let record = include_str!("../../../tests/data/episode_record.json");
    let mut record: EpisodeRecord = serde_json::from_str(record).unwrap();
    record.header.id.split = EpisodeSplit::Demonstration;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("own.hdf5");
    let environment = json!({ "env_name": "softvt" });
    write_file(&path, &environment, STEPS, 1, |writer| writer.write_attributes(0, &record)).unwrap();
    let file = rust_hdf5::H5File::open_rw(&path).unwrap();
    let demo = file.root_group().group("data").unwrap().group("demo_0").unwrap();
    demo.set_attr_string("language", "do another thing").unwrap();
    file.close().unwrap();
    let message = read(&path).unwrap_err().to_string();
    assert!(
        message.contains("attribute language: \"do another thing\", and metadata_json says"),
        "{message}"
    );
}

#[test]
fn files_that_hold_no_demonstrations_are_reported() {
    let file = FileBuilder::libero();
    let whole = fs::read(file.write()).unwrap();
    let path = file.folder.path().join("x.hdf5");
    let message = || read(&path).unwrap_err().to_string();
    for length in [whole.len() / 2, 20] {
        fs::write(&path, &whole[..length]).unwrap();
        assert!(message().contains("x.hdf5"), "{}", message());
    }
    let mut other = FileBuilder::new(Value::Null);
    other.each("actions", |_| vec![0.0; 7]);
    assert!(other.refusal().contains("unknown format"));
}

#[test]
fn quaternions_in_another_order_are_detected_with_and_without_joints() {
    let file = |order: fn(Quat) -> [f64; 4], joints: bool| {
        let mut file = FileBuilder::libero().without("obs/ee").without("states");
        file.each("obs/robot0_joint_pos", |k| self::joints(k).to_vec());
        let site =
            |k: usize| Pose::translation(-0.6, 0.0, 0.0) * tool(k) * Pose::translation(0.0, 0.0, -0.0069);
        file.each("obs/robot0_eef_pos", |k| site(k).translation.vector.as_slice().to_vec());
        file.each("obs/robot0_eef_quat", |k| order(site(k).rotation).to_vec());
        let file = file.without("obs/joint");
        if joints { file } else { file.without("obs/robot0_joint") }
    };
    for joints in [true, false] {
        file(|q| [q.i, q.j, q.k, q.w], joints).read();
        let message = file(|q| [q.w, q.i, q.j, q.k], joints).refusal();
        assert!(message.contains("robot0_eef_quat") && message.contains("another order"), "{message}");
    }
}

#[test]
fn a_deeply_nested_model_does_not_overflow_the_stack() {
    let deep = "<body>".repeat(200_000);
    let model = MujocoModel::read(&format!("<mujoco><worldbody>{deep}</worldbody></mujoco>")).unwrap();
    assert_eq!(model.state_width(), 1);
    let deep = "<body pos='0 0 1'>".repeat(200_000);
    let text =
        format!("<mujoco><worldbody>{deep}<body name='robot0_base' pos='1 0 0'/></worldbody></mujoco>");
    assert_eq!(
        MujocoModel::read(&text).unwrap().base_w.unwrap().translation.vector,
        Vec3::new(1.0, 0.0, 200_000.0)
    );
}
