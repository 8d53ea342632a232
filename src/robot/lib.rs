//! The Franka Emika Panda with GelSight Mini finger tips: kinematics, inertias, differential inverse kinematics,
//! gripper, gel pads, and the settings of the tactile sensors ([`tactile`]).
//!
//! Frames, all functions of the joint coordinates: `hand` as in Franka's own description (z towards the finger tips, y
//! from the right finger to the left one); the `tool` frame (TCP), with the hand's axes, at the nominal midpoint of the
//! two gel apexes; a pad frame on each finger (see [`pads`]).
#![warn(missing_docs, unreachable_pub)]

pub mod arm;
pub mod clearance;
pub mod gripper;
pub mod ik;
pub mod pads;
pub mod panda;
pub mod rotation;
pub mod spec;
pub mod tactile;

pub use arm::ArmSetpoint;
pub use clearance::{Clearance, Obstacle, clearance};
pub use gripper::{GripTarget, GripperSetpoint};
pub use ik::{DiffIk, UnreachablePose};
pub use pads::{CollisionBox, PadSurface};
pub use spec::{ArmSpec, DisturbanceSpec, GripperSpec, IkSpec, PadSpec, RobotSpec, Side, WidthSensorSpec};
