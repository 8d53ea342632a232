//! Options of an export, and constants of the two layouts.

use std::path::PathBuf;

use clap::ValueEnum;

use softvt_policy::profile::{GripCode, JOINT_NAMES, POSE_NAMES};

/// Version of LeRobot's dataset layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LeRobotVersion {
    /// One table per episode; used by openpi and SoftVTBench.
    #[value(name = "lerobot-v2.1", help = None::<&str>)]
    V21,
    /// Many episodes per table; LeRobot's own since 0.4, with the keys of its own policies.
    #[value(name = "lerobot-v3.0", help = None::<&str>)]
    V30,
}

/// Meaning of the motion in the actions of an export, and of the state of the arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ArmControl {
    /// Tool poses: position and axis-angle.
    #[default]
    #[value(help = None::<&str>)]
    Pose,
    /// Joint positions.
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

    /// Names of the numbers of a motion.
    pub(super) fn motion_names(self) -> &'static [&'static str] {
        match self {
            Self::Pose => &POSE_NAMES,
            Self::Joints => &JOINT_NAMES,
        }
    }

    /// Length of the state and of an action: those of the arm, and one of the gripper.
    pub(super) fn vector_length(self) -> usize {
        self.motion_names().len() + 1
    }
}

/// Options of an export.
#[derive(Clone, Debug)]
pub struct ExportConfig {
    /// Folder of a finished recording.
    pub data: PathBuf,
    /// Output folder; must not exist or be empty.
    pub out: PathBuf,
    /// Version of the format.
    pub version: LeRobotVersion,
    /// Motion of the actions, and state of the arm.
    pub control: ArmControl,
    /// Code of the last number of an action; `None` for that of the recording, or continuous.
    pub gripper: Option<GripCode>,
    /// Tasks to export, each an index or part of a prompt; empty for all.
    pub tasks: Vec<String>,
    /// Number of threads. The files do not depend on it.
    pub threads: usize,
}

/// Size of an exported dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExportSummary {
    /// Demonstrations.
    pub episodes: usize,
    /// Rows of all episodes.
    pub frames: usize,
    /// Distinct prompts.
    pub tasks: usize,
}

/// Files per folder.
pub(super) const CHUNK: usize = 1000;
/// Largest table of version 3.0, MB of 2²⁰ bytes, unless a single episode is larger.
pub(super) const MAX_TABLE_MB: usize = 100;

impl LeRobotVersion {
    /// Version in `info.json`.
    pub(super) fn code(self) -> &'static str {
        match self {
            Self::V21 => "v2.1",
            Self::V30 => "v3.0",
        }
    }

    /// Key of a feature whose name in openpi's and SoftVTBench's data is `name`: v3.0 has those that LeRobot's own
    /// policies look for.
    pub(super) fn key(self, name: &'static str) -> &'static str {
        match (self, name) {
            (Self::V21, _) => name,
            (Self::V30, "image") => "observation.images.third_person",
            (Self::V30, "wrist_image") => "observation.images.wrist",
            (Self::V30, "tactile_image") => "observation.images.tactile_image",
            (Self::V30, "state") => "observation.state",
            (Self::V30, "tactile_marker_motion") => "observation.tactile_marker_motion",
            (Self::V30, "joint_torques") => "observation.joint_torques",
            (Self::V30, "actions") => "action",
            // Those that LeRobot adds to every dataset.
            (Self::V30, _) => name,
        }
    }

    /// LeRobot's name of the image of a step.
    pub(super) fn image_name(self, step: usize) -> String {
        match self {
            Self::V21 => format!("frame_{step:06}.png"),
            Self::V30 => format!("frame-{step:06}.png"),
        }
    }

    /// Template of the paths of tables, as a Python format string.
    pub(super) fn data_path(self) -> &'static str {
        match self {
            Self::V21 => "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
            Self::V30 => "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        }
    }
}
