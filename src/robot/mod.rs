//! The Franka Panda: kinematics, inertias, differential inverse kinematics, the gripper with its GelSight pads.
//!
//! Frames, all following from the joint coordinates: `hand` as in Franka's own description (z towards the finger
//! tips, y from the right finger to the left one), the `tool` frame (TCP) with the hand's axes at the nominal
//! midpoint of the two gel apexes, and a pad frame on each finger (see [`pads`]).

pub mod clearance;
pub mod gripper;
pub mod ik;
pub mod pads;
pub mod panda;
pub mod rotation;
pub mod spec;

pub use clearance::{Obstacle, clearance};
pub use gripper::{GripperEncoding, GripperError, GripperSetpoint};
pub use ik::{DiffIk, UnreachablePose};
pub use pads::{CollisionBox, PadContact, PadSurface};
pub use spec::{ArmSpec, GripperSpec, IkSpec, PadSpec, RobotSpec, SpecError};

/// A finger, its pad and its tactile sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// `panda_leftfinger`, which opens along +y of the hand.
    Left,
    /// `panda_rightfinger`, which opens along −y of the hand.
    Right,
}

impl Side {
    /// Left, then right: the order of every array over fingers.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// 0 for left, 1 for right.
    pub fn index(self) -> usize {
        self as usize
    }
}
