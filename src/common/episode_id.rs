//! Identification of episodes.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// Identifies an episode among all episodes of all suites. Two runs of the same id have the same initial state, as long
/// as the script and the shifts of the run are the same.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct EpisodeId {
    pub suite: String,
    pub task: usize,
    /// Index of the episode in its split.
    pub episode: u32,
    /// Seed of the run; all random numbers of its episodes derive from it.
    #[serde(rename = "seed")]
    pub base_seed: u64,
    /// List of episodes that `episode` counts in.
    pub split: EpisodeSplit,
}

impl EpisodeId {
    pub fn index(&self) -> EpisodeIndex {
        EpisodeIndex { task: self.task, episode: self.episode }
    }
}

/// Position of an episode in a run of a suite. Suite, base seed and split of an [`EpisodeId`] are properties of the
/// run; within it this pair suffices as a key and names the files of the episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct EpisodeIndex {
    pub task: usize,
    /// Index of the episode in its split.
    pub episode: u32,
}

impl fmt::Display for EpisodeIndex {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "task {} episode {}", self.task, self.episode)
    }
}

/// Which seeds an episode draws from. Two splits have no episode in common.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EpisodeSplit {
    /// Episodes for recording demonstrations.
    Demonstration,
    /// Trials of calibrations and other experiments.
    Experiment,
    /// Episodes for evaluating policies.
    #[default]
    Validation,
}

/// A name is not that of a split.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected {}", EpisodeSplit::ALL.map(EpisodeSplit::name).join(", "))]
pub struct UnknownSplit;

impl FromStr for EpisodeSplit {
    type Err = UnknownSplit;

    fn from_str(name: &str) -> Result<Self, UnknownSplit> {
        Self::ALL.into_iter().find(|split| split.name() == name).ok_or(UnknownSplit)
    }
}

impl EpisodeSplit {
    pub const ALL: [Self; 3] = [Self::Validation, Self::Demonstration, Self::Experiment];

    pub fn name(self) -> &'static str {
        match self {
            Self::Validation => "validation",
            Self::Demonstration => "demonstration",
            Self::Experiment => "experiment",
        }
    }
}
