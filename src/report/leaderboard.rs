//! One JSON row per run, for leaderboards.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::run_summary::RunSummary;
use softvt_common::digest::sha256_hex;
use softvt_runs::{
    manifest::{RunManifest, in_project},
    summary::SuiteSummary,
};

/// The results of one run, and all that they depend on: docs/results.md lists the fields.
fn row(RunSummary { run, summary, method }: &RunSummary) -> Value {
    let SuiteSummary { scores, .. } = summary;
    let manifest = &run.manifest;
    json!({
        "benchmark": "softvt",
        "version": manifest.softvt,
        "suite": summary.suite,
        "needs": manifest.needs,
        "policy": summary.policy,
        "method": method,
        "privileged": summary.privileged,
        "replayed": summary.replayed,
        "force_observed": summary.force_observed,
        "seed": manifest.seed,
        "seed_hash": manifest.seed_hash,
        "split": manifest.split,
        "shifts": manifest.shifts,
        "settings_changed": manifest.set,
        "sources_sha256": sources_sha256(manifest),
        "modified": Some(&manifest.modified).filter(|files| !files.is_empty()),
        "repeated_episodes": summary.repeated_episodes.len(),
        "goals_untouched": summary.goals_untouched.len(),
        "partial": run.is_partial(),
        "tasks": summary.by_task.len(),
        "episodes": scores.episodes,
        "invalid": scores.invalid,
        "goal": scores.goal_success_rate,
        "no_drop": scores.no_drop_rate,
        "safety": scores.safety_success_rate,
        "dsr": scores.dsr,
        "contact_safety": scores.contact_safety_rate,
        "metric_id": manifest.metric_id,
        "d_peak_median": scores.deformation.median,
        "grip_ratio_median": scores.grip_ratio.median,
    })
}

/// SHA-256 of the names and hashes of all files but the policy's.
fn sources_sha256(RunManifest { sources, policy_file, .. }: &RunManifest) -> String {
    let sources = sources.iter().filter(|(name, _)| Some(*name) != policy_file.as_ref());
    let sources: BTreeMap<&str, &String> = sources.map(|(name, hash)| (in_project(name), hash)).collect();
    sha256_hex(json!(sources).to_string())
}

/// The rows of runs as JSON lines, in their order.
pub fn rows(runs: &[RunSummary]) -> String {
    runs.iter().map(|run| row(run).to_string() + "\n").collect()
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::{
        run_summary::{summarize_runs, tests::stored},
        sample_record,
    };

    #[test]
    fn a_row_says_what_a_result_depends_on() {
        let runs = summarize_runs(vec![stored("a", "pi", vec![sample_record()])]);
        let text = rows(&runs);
        let row: Value = serde_json::from_str(text.trim_end()).unwrap();
        assert_eq!(
            (&row["benchmark"], &row["policy"], &row["episodes"]),
            (&"softvt".into(), &"pi".into(), &1.into())
        );
        assert_eq!(
            (&row["seed"], &row["seed_hash"], &row["partial"]),
            (&11.into(), &Value::Null, &false.into())
        );
        assert_eq!(row["goal"]["rate"], 100.0);
        assert_eq!(text.lines().count(), 1);
    }

    #[test]
    fn a_run_without_an_episode_is_as_privileged_as_its_policy() {
        for policy in ["expert", "pi"] {
            let row = rows(&summarize_runs(vec![stored("a", policy, Vec::new())]));
            let row: Value = serde_json::from_str(&row).unwrap();
            assert_eq!((&row["privileged"], &row["episodes"]), (&(policy == "expert").into(), &0.into()));
            assert_eq!(row["method"] == policy, policy == "pi", "{row}");
        }
    }
}
