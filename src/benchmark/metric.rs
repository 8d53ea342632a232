//! Metrics of a suite: numbers of each episode in addition to its verdict.

use serde::{Deserialize, Serialize};

/// A number of each episode that a suite measures from the true state. It changes no verdict.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Metric {
    pub name: String,
    /// Reduction of the values of the control steps to one.
    pub over: Reduction,
}

/// Reduction of the values of the control steps of an episode to one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reduction {
    Last,
    Max,
    Min,
    Mean,
}
