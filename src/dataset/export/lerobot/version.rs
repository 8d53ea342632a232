//! [`LeRobotVersion`], and constants of the two layouts.

/// Version of LeRobot's dataset layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeRobotVersion {
    /// One table per episode; used by openpi and SoftVTBench.
    V21,
    /// Many episodes per table; LeRobot's own since 0.4, with the keys of its own policies.
    V30,
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
