//! [`LeRobotVersion`], and constants of the two layouts.

use crate::export::features::Feature;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeRobotVersion {
    /// One table per episode; used by openpi and SoftVTBench.
    V21,
    /// Many episodes per table; LeRobot's own since 0.4, with the keys of its own policies.
    V30,
}

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

    /// Key of a feature; `None` if LeRobot's data do not have it.
    pub(super) fn key(self, feature: &Feature) -> Option<&'static str> {
        match self {
            _ if feature.lerobot.is_empty() => None,
            Self::V21 => Some(feature.name),
            Self::V30 => Some(feature.lerobot),
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
