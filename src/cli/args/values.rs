//! Types of single values, with their parsers.

use std::{fmt, path::PathBuf, str::FromStr};

use clap::ValueEnum;

/// Parses a count of at least one.
pub(super) fn parse_count(word: &str) -> Result<u32, String> {
    let count = word.parse().ok().filter(|count| *count > 0);
    count.ok_or_else(|| format!("expected a whole number of at least 1 and at most {}", u32::MAX))
}

/// Parses the path of an output folder.
pub(super) fn parse_folder(word: &str) -> Result<PathBuf, String> {
    if word.trim().is_empty() {
        return Err("expected a folder; \".\" is the working folder".to_owned());
    }
    Ok(word.into())
}

pub(super) fn parse_seed(word: &str) -> Result<u64, String> {
    word.parse().map_err(|_| format!("expected a whole number in 0..{}", u64::MAX))
}

/// Detail of `--trace`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum TraceDetail {
    State,
    Nodes,
}

/// Episodes of a run that become videos.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum VideoSelection {
    /// All that are not safe.
    Failed,
    All,
    /// These episodes of each task.
    Episodes(Vec<u32>),
}

impl FromStr for VideoSelection {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        Ok(match word {
            "failed" => Self::Failed,
            "all" => Self::All,
            list => {
                let episodes: Result<_, _> = list.split(',').map(str::parse).collect();
                Self::Episodes(
                    episodes.map_err(|_| "expected failed, all, or episodes such as 0,3".to_owned())?,
                )
            }
        })
    }
}

/// One of `count` parts of a run, numbered from 1: every `count`-th episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    /// True if the shard contains the `job`-th episode of the whole run, counted from 0.
    pub(crate) fn contains(&self, job: usize) -> bool {
        job % self.count == self.index - 1
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let parts = word.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, count)) if (1..=count).contains(&index) => Ok(Self { index, count }),
            _ => Err("expected I/N with I in 1..N, such as 2/8".to_owned()),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// An episode of a run, or a demonstration of a dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EpisodeSelector {
    /// Line number in `episodes.jsonl` or in the manifest, from 0.
    Line(usize),
    /// `TASK/EPISODE`.
    Episode { task: usize, episode: u32 },
}

impl FromStr for EpisodeSelector {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let pair = word.split_once('/').and_then(|(task, episode)| {
            Some(Self::Episode { task: task.parse().ok()?, episode: episode.parse().ok()? })
        });
        let found = pair.or_else(|| word.parse().ok().map(Self::Line));
        found.ok_or_else(|| {
            "expected TASK/EPISODE such as 3/0, or a line number of episodes.jsonl, from 0".to_owned()
        })
    }
}

/// A condition on the results of a suite, such as `safety>=0.9`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Requirement {
    /// As it was typed.
    pub text: String,
    pub metric: RequiredMetric,
    pub operator: RequirementOperator,
    /// Rates are shares of 1.
    pub bound: f64,
}

/// A result that `--require` can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RequiredMetric {
    Goal,
    NoDrop,
    DeformationOk,
    Safety,
    GoalSafetyGap,
    MedianDeformation,
    P95Deformation,
    InvalidEpisodes,
}

impl RequiredMetric {
    const ALL: [Self; 8] = [
        Self::Goal,
        Self::NoDrop,
        Self::DeformationOk,
        Self::Safety,
        Self::GoalSafetyGap,
        Self::MedianDeformation,
        Self::P95Deformation,
        Self::InvalidEpisodes,
    ];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Goal => "goal",
            Self::NoDrop => "no_drop",
            Self::DeformationOk => "deformation_ok",
            Self::Safety => "safety",
            Self::GoalSafetyGap => "gap",
            Self::MedianDeformation => "d_median",
            Self::P95Deformation => "d_p95",
            Self::InvalidEpisodes => "invalid",
        }
    }

    /// True for shares of 1; false for deformations in percent and for counts.
    fn is_rate(self) -> bool {
        !matches!(self, Self::MedianDeformation | Self::P95Deformation | Self::InvalidEpisodes)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RequirementOperator {
    AtLeast,
    AtMost,
    Above,
    Below,
}

impl RequirementOperator {
    /// The longer signs first, since `>` is a prefix of `>=`.
    const SIGNS: [(&str, Self); 4] =
        [(">=", Self::AtLeast), ("<=", Self::AtMost), (">", Self::Above), ("<", Self::Below)];
}

impl FromStr for Requirement {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let names = || RequiredMetric::ALL.map(RequiredMetric::name).join(", ");
        let split = RequirementOperator::SIGNS
            .iter()
            .find_map(|(sign, operator)| word.split_once(sign).map(|(name, bound)| (name, *operator, bound)));
        let (name, operator, bound) = split.ok_or_else(|| {
            format!("expected a comparison such as \"safety>=0.9\"; metrics are {}", names())
        })?;
        let name = name.trim();
        let metric = RequiredMetric::ALL.into_iter().find(|metric| metric.name() == name);
        let metric = metric.ok_or_else(|| format!("unknown metric {name:?}; metrics are {}", names()))?;
        let bound = bound.trim();
        let (number, unit) = bound.strip_suffix('%').map_or((bound, 1.0), |number| (number, 0.01));
        let value: Option<f64> = number.trim().parse().ok().filter(|value: &f64| value.is_finite());
        let value = value.ok_or_else(|| format!("expected a number after the sign, got {bound:?}"))?;
        if metric.is_rate() && !(-1.0..=1.0).contains(&(unit * value)) {
            return Err(format!("{name} is a share of 1, got {bound}; write 0.9 or 90%"));
        }
        Ok(Self { text: word.to_owned(), metric, operator, bound: unit * value })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_partition_the_episodes() {
        let shards: Vec<Shard> = (1..=3).map(|i| format!("{i}/3").parse().unwrap()).collect();
        for job in 0..20 {
            assert_eq!(shards.iter().filter(|shard| shard.contains(job)).count(), 1);
        }
        for word in ["0/3", "4/3", "1", "a/b", "1/0", "-1/3"] {
            assert!(word.parse::<Shard>().is_err(), "{word}");
        }
        assert_eq!(shards[1].to_string(), "2/3");
    }

    #[test]
    fn unknown_metrics_and_numbers_are_refused() {
        for (word, words) in [
            ("saftey>=1", "unknown metric \"saftey\""),
            ("safety", "expected a comparison"),
            ("safety>=high", "expected a number"),
            ("safety>=NaN", "got \"NaN\""),
            ("safety>=", "got \"\""),
            ("no_drop>=90", "a share of 1, got 90"),
        ] {
            let error = word.parse::<Requirement>().expect_err(words);
            assert!(error.contains(words), "{error}");
        }
    }
}
