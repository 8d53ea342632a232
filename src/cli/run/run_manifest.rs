//! `run.json`: everything needed to repeat a run.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::{
    benchmark::{Task, settings::Settings},
    cli::{
        error::CliError,
        run::{
            recorded_policy::ReplaySource,
            suite_run::{SuiteRun, folder_failure},
        },
    },
    dataset::card::Imported,
    policy::profile::Profile,
    report::run_folder::{RUN, RunFolder},
};

/// Everything needed to repeat a run.
#[derive(Serialize)]
pub(crate) struct RunManifest<'a> {
    pub softvt: &'a str,
    pub script: String,
    pub suite: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub twin: Option<&'a str>,
    pub policy: &'a str,
    /// What a policy behind a network gets, and what its numbers mean.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<&'a Profile>,
    /// The file of a policy in Lua; its SHA-256 is among the sources.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub policy_file: Option<&'a str>,
    /// Whose actions were carried out once more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replayed: Option<&'a ReplaySource>,
    /// The files of foreign demonstrations that are re-executed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imported: Option<&'a [Imported]>,
    /// Actions of a chunk that are carried out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replan: Option<usize>,
    pub privileged: bool,
    pub seed: u64,
    pub split: &'a str,
    pub tasks: Vec<usize>,
    pub episodes: u32,
    /// The part of the run that this is, such as 2/8.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shard: Option<String>,
    pub shifts: &'a [(String, f64)],
    pub options: BTreeMap<String, String>,
    /// What was typed of the script's own options.
    pub arguments: &'a [String],
    /// What was typed behind --set.
    pub set: &'a [(String, String)],
    pub settings: &'a Settings,
    pub sources: BTreeMap<String, String>,
    pub thresholds: BTreeMap<String, Option<f64>>,
    /// Whether the policy sees the true forces at the pads.
    pub force_observed: bool,
}

impl<'a> RunManifest<'a> {
    /// That of a batch that is prepared.
    pub(crate) fn of(batch: &'a SuiteRun, tasks: &[&Task], episodes: u32) -> Self {
        let run = batch.run;
        let options = batch.loaded.options.iter();
        Self {
            softvt: env!("CARGO_PKG_VERSION"),
            script: batch.loaded.main.clone(),
            suite: &batch.suite.name,
            twin: run.twin.then_some("rigid"),
            policy: run.policy.name(),
            profile: run.policy.profile(),
            policy_file: run.policy.file(),
            replayed: batch.replayed.as_ref(),
            imported: Some(&batch.imported[..]).filter(|files| !files.is_empty()),
            replan: run.policy.replan(),
            privileged: batch.is_privileged(),
            seed: run.seed,
            split: batch.split.name(),
            tasks: tasks.iter().map(|t| t.id).collect(),
            episodes,
            shard: run.shard.map(|shard| shard.to_string()),
            shifts: &run.shifts,
            options: options.map(|o| (o.name.clone(), format!("{:?}", o.value))).collect(),
            arguments: &run.script_words,
            set: &run.set,
            settings: &batch.settings,
            sources: batch.sources.clone(),
            thresholds: batch.limits.iter().map(|(a, l)| (a.clone(), l.map(|l| l.tau_pct()))).collect(),
            force_observed: batch.force_observed,
        }
    }
}

/// Writes it down; if it stands there already, it must be the same.
///
/// # Errors
/// The file cannot be written, or is that of another run.
pub(crate) fn write(folder: &RunFolder, info: &impl Serialize) -> Result<(), CliError> {
    let Some(known) = folder.read(RUN).map_err(folder_failure)? else {
        return crate::files::write_json(&folder.path().join(RUN), info).map_err(CliError::input);
    };
    let path = folder.path().join(RUN).display().to_string();
    let known: Value = serde_json::from_str(&known)
        .map_err(|e| CliError::input(format!("{path}: not that of a run: {e}")))?;
    match difference(&known, &json!(info)) {
        None => Ok(()),
        Some(what) => Err(CliError::input(format!(
            "{path} is of another run: {what}; resume it with what it was started with, or give another folder with --out"
        ))),
    }
}

/// Whether it stands in a folder.
///
/// # Errors
/// The file is there and cannot be read.
pub(crate) fn is_of(dir: &Path, info: &RunManifest) -> Result<bool, CliError> {
    let path = dir.join(RUN);
    let text = std::fs::read_to_string(&path)
        .map_err(|e| CliError::input(format!("cannot read {}: {e}", path.display())))?;
    Ok(serde_json::from_str::<Value>(&text).is_ok_and(|known| known == json!(info)))
}

/// Letters of the longest value that is told whole: a hash is.
const TOLD: usize = 80;
/// Letters before the first difference of longer ones.
const BEFORE: usize = 16;

/// Two values that differ, each short, with that in which they differ.
fn told(a: &Value, b: &Value) -> [String; 2] {
    let [a, b] = [a, b].map(|value| value.to_string().chars().collect::<Vec<char>>());
    let same = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
    let from = if a.len().max(b.len()) <= TOLD { 0 } else { same.saturating_sub(BEFORE) };
    [a, b].map(|letters| {
        let head = if from > 0 { "…" } else { "" };
        let tail = if letters.len() > from + TOLD { "…" } else { "" };
        let shown: String = letters.into_iter().skip(from).take(TOLD).collect();
        format!("{head}{shown}{tail}")
    })
}

/// Where two documents differ first, with both values.
pub(crate) fn difference(known: &Value, now: &Value) -> Option<String> {
    let (Value::Object(a), Value::Object(b)) = (known, now) else {
        return (known != now).then(|| told(known, now).join(" then, ") + " now");
    };
    let names: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    names.into_iter().find_map(|name| {
        let of = |map: &Map<String, Value>| map.get(name).cloned().unwrap_or(Value::Null);
        let inner = difference(&of(a), &of(b))?;
        // Below the first level the names make a path.
        let is_path = of(a).is_object() && of(b).is_object();
        Some(if is_path { format!("{name}.{inner}") } else { format!("{name}: {inner}") })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_difference_is_named_by_its_path() {
        let a = json!({ "seed": 0, "settings": { "physics": { "dt": 0.0166 } }, "shifts": [] });
        assert_eq!(difference(&a, &a.clone()), None);
        let b = json!({ "seed": 0, "settings": { "physics": { "dt": 0.01 } }, "shifts": [] });
        assert_eq!(difference(&a, &b).unwrap(), "settings.physics.dt: 0.0166 then, 0.01 now");
        let c = json!({ "seed": 0, "settings": { "physics": { "dt": 0.0166 } } });
        assert_eq!(difference(&a, &c).unwrap(), "shifts: [] then, null now");
    }

    #[test]
    fn what_differs_is_shown_however_late_it_comes() {
        let hash = |last: char| "0123456789abcdef".repeat(4)[..63].to_owned() + &last.to_string();
        let (a, b) = (json!({ "x.lua": hash('1') }), json!({ "x.lua": hash('2') }));
        let told = difference(&a, &b).unwrap();
        assert!(told.contains(&hash('1')) && told.contains(&hash('2')), "{told}");
        let list = |last: usize| json!({ "tasks": (0..100).chain([last]).collect::<Vec<_>>() });
        let told = difference(&list(777), &list(888)).unwrap();
        assert_eq!(told, "tasks: …,95,96,97,98,99,777] then, …,95,96,97,98,99,888] now");
        let long = |letter: &str| json!({ "a": "x".repeat(300) + letter + &"y".repeat(300) });
        let told = difference(&long("1"), &long("2")).unwrap();
        assert!(told.contains("x1y") && told.contains("x2y") && told.chars().count() < 200, "{told}");
    }
}
