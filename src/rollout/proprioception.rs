//! Where the robot and the objects are in a kept state, as numbers.

use super::sensors::SensorSuite;
use crate::{
    benchmark::control::CONTROL_DT,
    geometry::{Pose, Vec3},
    physics::{BodyId, world::Frame},
    robot::{ik::DiffIk, panda::ARM_DOFS},
};

/// What the robot measures of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proprioception {
    /// Tool in the base frame.
    pub tool_b: Pose,
    /// Arm joint angles, rad.
    pub joints: [f64; ARM_DOFS],
    /// Positions of the left and right finger, m: 0 (shut) to 0.04.
    pub fingers: [f64; 2],
}

/// Where a thing is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BodyConfiguration<'a> {
    /// Nodes of a soft body, m, world.
    Nodes(&'a [Vec3]),
    /// Object frame of a rigid one, world.
    Pose(Pose),
}

impl SensorSuite {
    /// The robot in a state.
    pub fn proprioception(&self, frame: &Frame) -> Proprioception {
        let q = &frame.joints[self.articulation.index()];
        let joints = std::array::from_fn(|i| q[i]);
        Proprioception {
            tool_b: DiffIk::new(&self.robot.ik, joints, CONTROL_DT).tool_pose(&joints),
            joints,
            fingers: [q[ARM_DOFS], q[ARM_DOFS + 1]],
        }
    }

    /// All that can move in the scene, by name, in its order.
    pub fn body_configurations<'a>(
        &'a self,
        frame: &'a Frame,
    ) -> impl Iterator<Item = (&'a str, BodyConfiguration<'a>)> {
        self.parts.iter().filter_map(|part| {
            let state = match part.body {
                BodyId::Soft(body) => BodyConfiguration::Nodes(frame.soft(body)),
                BodyId::Rigid(body) => BodyConfiguration::Pose(*frame.rigid(body)),
                BodyId::Link(link) => BodyConfiguration::Pose(frame.link(link) * part.offset),
                BodyId::World | BodyId::Kinematic(_) => return None,
            };
            Some((part.name.as_str(), state))
        })
    }
}
