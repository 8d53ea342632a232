//! Collects the results of runs into `docs/results/results.jsonl`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;
use softvt::runs::{manifest::RunManifest, record::EpisodeRecord, summary::SuiteSummary};

use crate::rows::{ROWS, Rate, Row, json_of, read};

/// The final state of the golden episode, which stands for the physics of this version: `softvt doctor` computes it.
pub fn physics(root: &Path) -> Result<String, String> {
    let path = root.join("assets/golden.json");
    text(&json_of::<Value>(&path)?, "state_hash", &path)
}

/// The published rates, as `softvt bench --out` writes them.
pub fn rates(root: &Path) -> Result<Value, String> {
    json_of(&root.join("assets/rates.json"))
}

/// Adds the runs of a folder, made with the physics of this version. A row replaces the one of the same
/// script, suite and controller.
pub fn add(root: &Path, folder: &Path) -> Result<(), String> {
    let (runs, physics) = (runs(folder)?, physics(root)?);
    if runs.is_empty() {
        return Err(format!(
            "{}: no finished run: neither conditions.json nor summary.json",
            folder.display()
        ));
    }
    let mut rows = if root.join(ROWS).is_file() { read(root)? } else { Vec::new() };
    for (folder, controller) in runs {
        let row = row(&folder, controller, &physics)?;
        let is_same = |known: &Row| {
            (&known.script, &known.suite) == (&row.script, &row.suite) && known.controller == row.controller
        };
        match rows.iter().position(is_same) {
            Some(place) => rows[place] = row,
            None => {
                let last =
                    rows.iter().rposition(|known| (&known.script, &known.suite) == (&row.script, &row.suite));
                rows.insert(last.map_or(rows.len(), |last| last + 1), row);
            }
        }
    }
    let lines: Result<Vec<String>, _> =
        rows.iter().map(|row| serde_json::to_string(row).map(|line| line + "\n")).collect();
    let path = root.join(ROWS);
    path.parent().map_or(Ok(()), fs::create_dir_all).map_err(|error| error.to_string())?;
    fs::write(&path, lines.map_err(|error| error.to_string())?.concat())
        .map_err(|error| format!("{ROWS}: {error}"))
}

/// The finished runs of a folder, each with the name of its controller if its condition states one: those of
/// conditions, in their order, or those in the folder and one folder below.
fn runs(folder: &Path) -> Result<Vec<(PathBuf, Option<String>)>, String> {
    let conditions = folder.join("conditions.json");
    if !conditions.is_file() {
        let mut found: Vec<PathBuf> = vec![folder.to_owned()];
        found.extend(
            fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok).map(|entry| entry.path()),
        );
        found.retain(|path| path.join("summary.json").is_file() && path.join("run.json").is_file());
        found.sort();
        return Ok(found.into_iter().map(|folder| (folder, None)).collect());
    }
    let file: Value = json_of(&conditions)?;
    let suites = file["suites"].as_array().into_iter().flatten();
    let rows = suites.flat_map(|suite| suite["rows"].as_array().into_iter().flatten());
    let run = |row: &Value| {
        let inside = row["outcome"]["folder"].as_str()?;
        // The reference is the policy of the command.
        let name = row["condition"].as_str().filter(|_| row["policy"].is_string()).map(str::to_owned);
        Some((folder.join(inside), name))
    };
    Ok(rows.filter_map(run).collect())
}

/// The row of a run.
fn row(folder: &Path, controller: Option<String>, physics: &str) -> Result<Row, String> {
    let manifest = RunManifest::read(folder).map_err(|error| error.to_string())?;
    let path = folder.join("episodes.jsonl");
    let lines = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let records: Vec<EpisodeRecord> = lines
        .lines()
        .map(|line| serde_json::from_str(line).map_err(|error| format!("{}: {error}", path.display())))
        .collect::<Result<_, _>>()?;
    let suite = records.first().map_or("", |record| &record.header.id.suite);
    let summary = SuiteSummary::from_records(suite, &manifest.policy, &records);
    let rate = |of: softvt::evaluation::statistics::Rate| Rate {
        rate: of.rate.map(rounded),
        wilson95: of.wilson95.map(|ends| ends.map(rounded)),
    };
    Ok(Row {
        script: manifest.script,
        controller: controller.unwrap_or(summary.policy),
        tasks: summary.by_task.len(),
        episodes: summary.scores.episodes,
        invalid: summary.scores.invalid,
        goal: rate(summary.scores.goal_success_rate),
        no_drop: rate(summary.scores.no_drop_rate),
        safety: rate(summary.scores.safety_success_rate),
        d_over_tau: median(&records, |record| record.verdict.object().ratio()),
        grip_ratio: median(&records, |record| record.verdict.object().grip_ratio),
        goal_time_s: median(&records, |record| record.verdict.goal_time_s),
        softvt: manifest.softvt,
        seed: manifest.seed,
        physics: physics.to_owned(),
        suite: summary.suite,
    })
}

/// A number to four decimals, which is enough for the tables.
fn rounded(value: f64) -> f64 {
    (1e4 * value).round() / 1e4
}

/// Median of a quantity over the records that have it.
fn median(records: &[EpisodeRecord], value: fn(&EpisodeRecord) -> Option<f64>) -> Option<f64> {
    let mut found: Vec<f64> = records.iter().filter_map(value).filter(|value| value.is_finite()).collect();
    found.sort_by(f64::total_cmp);
    let middle = found.len() / 2;
    let (low, high) = (found.get(found.len().checked_sub(1)? / 2)?, found.get(middle)?);
    Some(rounded(0.5 * (low + high)))
}

fn text(value: &Value, key: &str, at: &Path) -> Result<String, String> {
    value[key].as_str().map(str::to_owned).ok_or_else(|| format!("{}: no {key}", at.display()))
}
