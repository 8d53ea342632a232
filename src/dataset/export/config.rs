//! Options of an export.

use std::path::PathBuf;

use clap::{ValueEnum, builder::PossibleValue};

use super::lerobot::LeRobotVersion;
use softvt_policy::{
    JOINT_NAMES,
    profile::{GripCode, POSE_NAMES},
};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportFormat {
    /// Parquet tables for LeRobot.
    LeRobot(LeRobotVersion),
    /// Episodes in TFRecord files, which TensorFlow Datasets reads.
    Rlds,
}

impl ValueEnum for ExportFormat {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::LeRobot(LeRobotVersion::V21), Self::LeRobot(LeRobotVersion::V30), Self::Rlds]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(match self {
            Self::LeRobot(LeRobotVersion::V21) => "lerobot-v2.1",
            Self::LeRobot(LeRobotVersion::V30) => "lerobot-v3.0",
            Self::Rlds => "rlds",
        }))
    }
}

/// Meaning of the motion in the actions of an export, and of the state of the arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ArmControl {
    /// Tool poses: position and axis-angle.
    #[default]
    #[value(help = None::<&str>)]
    Pose,
    #[value(help = None::<&str>)]
    Joints,
}

impl ArmControl {
    /// Name in files and flags.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Pose => "pose",
            Self::Joints => "joints",
        }
    }

    pub(super) fn motion_names(self) -> &'static [&'static str] {
        match self {
            Self::Pose => &POSE_NAMES,
            Self::Joints => &JOINT_NAMES,
        }
    }
}

#[derive(Clone, Debug)]
pub struct ExportConfig {
    /// Folder of a finished recording.
    pub data: PathBuf,
    /// Output folder; must not exist or be empty.
    pub out: PathBuf,
    pub format: ExportFormat,
    /// Motion of the actions, and state of the arm.
    pub control: ArmControl,
    /// Code of the last number of an action; `None` for that of the recording, or continuous.
    pub gripper: Option<GripCode>,
    /// Tasks to export, each an index or part of a prompt; empty for all.
    pub tasks: Vec<String>,
    /// Number of threads. The files do not depend on it.
    pub threads: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExportSummary {
    pub episodes: usize,
    /// Rows of all episodes.
    pub frames: usize,
    pub tasks: usize,
}
