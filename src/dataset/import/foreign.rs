//! Demonstrations of other programs, as read from their files.

use std::path::PathBuf;

use softvt_geometry::Pose;
use softvt_policy::{EncodedGrip, GripTarget, ToolCommand};
use softvt_scene::InitialStateOverride;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForeignFormat {
    /// Relative steps for robosuite's controller, as stored by robomimic and LIBERO.
    Libero,
    /// Absolute poses, as stored by SoftVTBench.
    SoftVtBench,
    Softvt,
}

impl ForeignFormat {
    /// Name in messages and records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Libero => "robomimic/LIBERO",
            Self::SoftVtBench => "SoftVTBench",
            Self::Softvt => "softvt",
        }
    }
}

#[derive(Clone, Debug)]
pub struct ForeignFile {
    pub path: PathBuf,
    pub sha256: String,
    pub format: ForeignFormat,
    pub demos: Vec<ForeignDemo>,
}

/// A demonstration converted to commands for softvt's robot.
///
/// `commands`, `gripper_closed` and `is_stopped_by_object` have one entry per control step.
#[derive(Clone, Debug, PartialEq)]
pub struct ForeignDemo {
    /// Name of its group, such as `demo_3`.
    pub name: String,
    pub task: ForeignTask,
    pub commands: Vec<ToolCommand>,
    /// True while the gripper is commanded to hold.
    pub gripper_closed: Vec<bool>,
    /// True while the gripper holds an object and the recorded closure is the measured one, limited by that object.
    pub is_stopped_by_object: Vec<bool>,
    pub initial_condition: InitialCondition,
    /// Data the commands were computed from, for the dataset card.
    pub command_source: &'static str,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct ForeignTask {
    pub suite: Option<String>,
    /// Task index in the suite.
    pub id: Option<usize>,
    /// Spellings of the instruction, most reliable first.
    pub prompts: Vec<String>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum InitialCondition {
    OtherSimulator {
        /// Joint angles of the arm, rad, if they are recorded.
        joints: Option<[f64; 7]>,
        objects: Vec<ForeignObjectPose>,
    },
    SoftvtEpisode {
        seed: u64,
        /// Index in the split of demonstrations.
        attempt: u32,
        start: InitialStateOverride,
    },
}

/// Pose of an object in the scene of another simulator.
#[derive(Clone, Debug, PartialEq)]
pub struct ForeignObjectPose {
    pub name: String,
    /// Its pose, in the frame that `in_base` tells.
    pub pose: Pose,
    /// True if `pose` is in the robot's base frame, else in that simulator's world frame, whose x and y are assumed
    /// to coincide with softvt's.
    pub in_base: bool,
    /// True for a soft body, whose orientation is unknown.
    pub is_soft: bool,
}

impl ForeignDemo {
    /// Commands full closure in steps in which the recorded fingers were stopped by the object.
    ///
    /// Replaying the measured closure squeezes a soft object as far as it was squeezed, but exerts no force
    /// on a rigid one.
    pub fn close_fully_on_rigid_object(&mut self) {
        let stopped =
            self.commands.iter_mut().zip(&self.is_stopped_by_object).filter(|(_, stopped)| **stopped);
        for (command, _) in stopped {
            command.grip = EncodedGrip::Target(GripTarget::Closure(1.0));
        }
    }
}
