//! The robot in the world: the Panda as an articulation, its drives, pads and inverse kinematics.

use std::{collections::VecDeque, sync::Arc};

use super::sensor_noise::SensorSeed;
use softvt_geometry::{Pose, Vec3, shape::Shape};
use softvt_physics::{
    ArticulationId, ColliderId, LinkId, World,
    contact::{ElasticLayer, Friction},
    world::JointDrive,
};
use softvt_policy::RobotState;
use softvt_robot::{
    ArmSetpoint, RobotSpec, Side,
    gripper::{self, FingerState, GripTarget, GripperSetpoint},
    ik::{ArmAngles, DiffIk},
    pads::{self, PadSurface},
    panda::{self, ARM_DOFS},
    rotation,
    tactile::GelSpec,
};

/// The robot of a simulation: an articulation with position drives, which follows commands of the tool pose
/// by differential inverse kinematics.
#[derive(Clone, Debug)]
pub struct RobotInstance {
    pub spec: RobotSpec,
    pub articulation: ArticulationId,
    /// Colliders of the left and right gel pad.
    pub pads: [ColliderId; 2],
    pub body: Vec<ColliderId>,
    /// Pose of the base, world.
    pub base_w: Pose,
    ik: DiffIk,
    arm: ArmSetpoint,
    gripper: GripperSetpoint,
    /// Rotation vector of the tool before the last control step, base frame, rad.
    ee_axis_angle_b: Vec3,
    /// Commands that the robot has not responded to yet, oldest first.
    delayed: VecDeque<DelayedCommand>,
}

/// Pose or joint positions of the arm at the end of a control step, as commanded.
#[derive(Clone, Copy, Debug)]
pub struct ArmCommand {
    /// Commanded pose of the tool, base frame.
    pub pose_b: Pose,
    /// The pose that is executed in its place, base frame: another one under a disturbance.
    pub executed_b: Pose,
    /// Joint positions (rad) that are commanded directly; `pose_b` is that of the tool there. `None` for a pose that
    /// inverse kinematics turns into joint positions.
    pub joints: Option<ArmAngles>,
}

impl ArmCommand {
    /// A pose of the tool, base frame, without a disturbance.
    pub fn pose(pose_b: Pose) -> Self {
        Self { pose_b, executed_b: pose_b, joints: None }
    }
}

/// An earlier command of [`RobotInstance::command`].
#[derive(Clone, Copy, Debug)]
struct DelayedCommand {
    arm: ArmCommand,
    grip: GripTarget,
}

impl RobotInstance {
    /// Adds the robot to a world, with joint angles `q` (rad) and the gripper open.
    pub fn new(
        world: &mut World,
        spec: &RobotSpec,
        gel: &GelSpec,
        base_w: &Pose,
        q: &[f64; ARM_DOFS],
        control_dt: f64,
    ) -> Self {
        let tree = panda::tree(*base_w, &spec.gripper);
        let open = gripper::MAX_WIDTH / 2.0;
        let all: Vec<f64> = q.iter().copied().chain([open, open]).collect();
        let drive =
            |kp, kd, target, effort| Some(JointDrive { kp, kd, target, target_velocity: 0.0, effort });
        let drives = all
            .iter()
            .zip(&tree.links)
            .enumerate()
            .map(|(joint, (&q, link))| {
                if joint < ARM_DOFS {
                    drive(spec.arm.kp, spec.arm.kd, q, link.effort_limit)
                } else {
                    drive(spec.gripper.kp, spec.gripper.kd, q, spec.gripper.effort)
                }
            })
            .collect();
        let articulation = world.add_articulation("panda", tree, &all, drives, false);
        let layer = PadSurface::default().layer(gel);
        let pads = Side::BOTH.map(|side| add_pad(world, spec, &layer, articulation, side));
        let mut body = Vec::new();
        for side in Side::BOTH {
            let link = panda::finger_link(side);
            body.extend(
                pads::finger_boxes(side)
                    .map(|b| add_box(world, LinkId { articulation, index: link }, b.half, b.pose)),
            );
        }
        let hand = LinkId { articulation, index: panda::HAND_LINK };
        body.extend(panda::hand_boxes().map(|b| add_box(world, hand, b.half, b.pose)));
        Self {
            articulation,
            pads,
            body,
            base_w: *base_w,
            ik: DiffIk::new(&spec.ik, *q, control_dt),
            arm: ArmSetpoint::new(*q, control_dt),
            gripper: GripperSetpoint::new(&spec.gripper, gripper::MAX_WIDTH),
            ee_axis_angle_b: rotation::POINTING_DOWN,
            delayed: VecDeque::with_capacity(spec.latency as usize + 1),
            spec: spec.clone(),
        }
    }

    /// Commands where arm and gripper should be at the end of a control step. The robot responds in the next control
    /// step, or `spec.latency` steps later; until then it follows the earlier commands.
    ///
    /// Returns the joint positions (rad) that the command to which it now responds means, without a disturbance: those
    /// that it commands, or those of inverse kinematics. `None` while there is no such command.
    pub fn command(&mut self, world: &mut World, arm: ArmCommand, grip: GripTarget) -> Option<ArmAngles> {
        self.ee_axis_angle_b = self.ee_axis_angle_b(world);
        self.delayed.push_back(DelayedCommand { arm, grip });
        if self.delayed.len() <= self.spec.latency as usize {
            return None;
        }
        let DelayedCommand { arm, grip } = self.delayed.pop_front()?;
        let ArmCommand { pose_b, executed_b, joints } = arm;
        let (q, is_disturbed) = (self.q(world), executed_b != pose_b);
        let commanded = joints.unwrap_or_else(|| self.ik.preview(&q, &pose_b));
        let target = match joints {
            None => self.ik.step(&q, &executed_b),
            Some(joints) if is_disturbed => self.ik.step_joints(&q, &self.ik.moved(&joints, &executed_b)),
            Some(joints) => self.ik.step_joints(&q, &joints),
        };
        self.arm.command(target);
        self.gripper.command(grip);
        Some(commanded)
    }

    /// Advances the targets of all drives by one physics step; called before the step.
    pub fn advance(&mut self, world: &mut World) {
        let (dt, width) = (world.params.dt, self.width(world));
        let articulation = world.articulation_mut(self.articulation);
        let fingers = &articulation.drive_forces()[ARM_DOFS..];
        // The fingers close towards smaller joint coordinates.
        let closing_force = -fingers.iter().sum::<f64>() / fingers.len() as f64;
        self.gripper.advance(dt, FingerState { width, closing_force });
        let fingers = [self.gripper.finger_target(); 2];
        let targets = self.arm.advance(dt).into_iter().chain(fingers);
        articulation.drives_mut().iter_mut().flatten().zip(targets).for_each(|(drive, q)| drive.target = q);
    }

    /// Arm joint angles, rad.
    pub fn q(&self, world: &World) -> [f64; ARM_DOFS] {
        std::array::from_fn(|i| world.articulation(self.articulation).state.q[i])
    }

    /// Pose of the tool (TCP) in the base frame.
    pub fn tool_b(&self, world: &World) -> Pose {
        self.ik.tool_pose(&self.q(world))
    }

    /// Rotation vector of the tool, base frame, rad: of those of its rotation the nearest one to that before the last
    /// control step, so that it is continuous along an episode.
    pub fn ee_axis_angle_b(&self, world: &World) -> Vec3 {
        rotation::nearest(rotation::axis_angle(&self.tool_b(world).rotation), &self.ee_axis_angle_b)
    }

    /// Origin of the hand frame, m, world.
    pub fn hand_w(&self, world: &World) -> Vec3 {
        (world.articulation(self.articulation).poses()[panda::HAND_LINK] * panda::hand_in_link())
            .translation
            .vector
    }

    /// Direction in which the fingers close, a unit vector, world.
    pub fn grip_axis_w(&self, world: &World) -> Vec3 {
        let hand_w = world.articulation(self.articulation).poses()[panda::HAND_LINK] * panda::hand_in_link();
        hand_w.rotation * Vec3::y()
    }

    /// Exact gripper width, m.
    pub fn width(&self, world: &World) -> f64 {
        let q = &world.articulation(self.articulation).state.q;
        gripper::width([q[ARM_DOFS], q[ARM_DOFS + 1]])
    }

    /// Measurements of the robot's own sensors. `seed` is that of the errors of its width sensor.
    pub fn state(&self, world: &World, seed: SensorSeed) -> RobotState {
        let (width, tool_b) = (self.width(world), self.tool_b(world));
        let articulation = world.articulation(self.articulation);
        RobotState {
            ee_position_b: tool_b.translation.vector,
            ee_rotation_b: tool_b.rotation,
            ee_axis_angle_b: self.ee_axis_angle_b(world),
            joints: self.q(world),
            joint_velocities: std::array::from_fn(|i| articulation.state.v[i]),
            joint_torques: std::array::from_fn(|i| articulation.drive_forces()[i]),
            fingers_m: std::array::from_fn(|i| articulation.state.q[ARM_DOFS + i]),
            gripper_width_m: width,
            sensed_width_m: seed.sensed_width(&self.spec.width_sensor, width, world.step_count()),
            closure: self.closure(),
        }
    }

    /// Closure of the last command that the robot has responded to, 0..=1; 1 for a grip force.
    pub fn closure(&self) -> f64 {
        self.gripper.closure()
    }

    /// Arm joint angles, rad, for a tool pose.
    ///
    /// # Errors
    /// The pose is out of reach; the error holds the distance to the nearest reachable pose.
    pub fn solve_ik(
        &self,
        world: &World,
        pose_b: &Pose,
    ) -> Result<[f64; ARM_DOFS], softvt_robot::ik::UnreachablePose> {
        self.ik.solve(&self.q(world), pose_b)
    }
}

fn add_pad(
    world: &mut World,
    spec: &RobotSpec,
    layer: &Arc<ElasticLayer>,
    articulation: ArticulationId,
    side: Side,
) -> ColliderId {
    let link = LinkId { articulation, index: panda::finger_link(side) };
    let friction = Friction::new(spec.pads.static_mu, spec.pads.dynamic_mu);
    let name = if side == Side::Left { "left pad" } else { "right pad" };
    world.add_collider(PadSurface::default().collider(
        name,
        link.into(),
        pads::pad_pose_in_finger(side),
        friction,
        layer,
    ))
}

fn add_box(world: &mut World, link: LinkId, half: Vec3, pose: Pose) -> ColliderId {
    // Steel and plastic: the default friction of rigid objects.
    world.add_shape("gripper", link, pose, &Shape::Box { half }, Friction::default())
}
