//! Rows of `docs/results/results.jsonl`: one per script, suite and controller.

use std::{collections::BTreeMap, fs, path::Path};

use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// File of the rows, in the order of the tables.
pub const ROWS: &str = "docs/results/results.jsonl";
/// Descriptions of the controllers, by name.
const LABELS: &str = "docs/results/labels.json";

/// A rate with its interval, %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// The rate; null where it does not apply.
    pub rate: Option<f64>,
    /// Wilson interval, 95 %.
    pub wilson95: Option<[f64; 2]>,
}

/// Results of a controller in a suite. Medians are over the episodes in which they are defined.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub script: String,
    pub suite: String,
    pub controller: String,
    pub tasks: usize,
    pub episodes: usize,
    pub invalid: usize,
    pub goal: Rate,
    pub no_drop: Rate,
    pub safety: Rate,
    pub d_over_tau: Option<f64>,
    pub grip_ratio: Option<f64>,
    pub goal_time_s: Option<f64>,
    pub softvt: String,
    pub seed: u64,
    /// Final state of the golden episode in the version that made the run.
    pub physics: String,
}

pub fn read(root: &Path) -> Result<Vec<Row>, String> {
    let text = fs::read_to_string(root.join(ROWS)).map_err(|error| format!("{ROWS}: {error}"))?;
    text.lines().map(|line| serde_json::from_str(line).map_err(|error| format!("{ROWS}: {error}"))).collect()
}

/// Descriptions of the controllers.
pub fn labels(root: &Path) -> Result<BTreeMap<String, String>, String> {
    json_of(&root.join(LABELS))
}

/// Reads a JSON file.
pub fn json_of<T: DeserializeOwned>(path: &Path) -> Result<T, String> {
    let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))
}
