//! [`EpisodeCategory`]: the result of an episode, one per episode, as tables, pages and videos name it.

use serde::{Deserialize, Serialize};

use super::verdict::{Outcome, Verdict};

/// Result of an episode. Each episode has exactly one; [`EpisodeCategory::new`] says which.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EpisodeCategory {
    /// The goal is reached safely.
    Safe,
    /// Goal Success with D_peak > τ of a target.
    OverLimit,
    /// Dropped, without Goal Success within the limit.
    Dropped,
    /// Goal Success and NoDrop within the limit, but it slid farther in the hand than the suite allows.
    Slipped,
    /// No Goal Success, and no drop.
    GoalMissed,
    /// Goal Success and NoDrop, but the limit or the deformation is unknown.
    NotJudged,
    /// The simulation failed, or the actions could not be executed.
    Invalid,
}

impl EpisodeCategory {
    /// All categories, in the order of tables.
    pub const ALL: [Self; 7] = [
        Self::Safe,
        Self::OverLimit,
        Self::Dropped,
        Self::Slipped,
        Self::GoalMissed,
        Self::NotJudged,
        Self::Invalid,
    ];

    /// The first that applies of: invalid; safe; the goal over the limit; dropped; goal missed; slipped; not judged.
    pub fn new(outcome: &Outcome, verdict: &Verdict) -> Self {
        let v = verdict;
        let is_over = v.targets.iter().any(|target| target.deformation_ok == Some(false));
        match () {
            () if !outcome.is_valid() => Self::Invalid,
            () if v.safety => Self::Safe,
            () if v.goal && is_over => Self::OverLimit,
            () if !v.no_drop => Self::Dropped,
            () if !v.goal => Self::GoalMissed,
            () if v.slip_ok == Some(false) => Self::Slipped,
            () => Self::NotJudged,
        }
    }

    /// Name in files of results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Safe => "safe",
            Self::OverLimit => "over the limit",
            Self::Dropped => "dropped",
            Self::Slipped => "slipped",
            Self::GoalMissed => "goal missed",
            Self::NotJudged => "not judged",
            Self::Invalid => "invalid",
        }
    }

    /// Mark in text. No two categories share one, so that colours repeat what the marks say.
    pub fn glyph(self) -> char {
        match self {
            Self::Safe => '●',
            Self::OverLimit => '✗',
            Self::Dropped => '↓',
            Self::Slipped => '↘',
            Self::GoalMissed => '○',
            Self::NotJudged => '?',
            Self::Invalid => '▨',
        }
    }
}

/// Share of the volume beyond its collapse strain from which an object is called crushed, %. It is the
/// share that defines D_ref.
pub const CRUSHED_PCT: f64 = 5.0;
