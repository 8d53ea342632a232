//! `run.json`: everything needed to repeat a run.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::{error::RunError, recorded_runs::ReplaySource, suite_run::PreparedRun};
use softvt_benchmark::{
    NeededKnowledge, Plan, ShiftValue,
    run_changes::{RunChanges, Twin},
    settings::Settings,
    variation::VariationRanges,
};
use softvt_common::files;
use softvt_dataset::card::ImportedFile;
use softvt_evaluation::deformation::METRIC_ID;
use softvt_policy::profile::{GripCode, Profile};
use softvt_report::{comparison::in_project, run_folder::RUN, stored_run};

/// Content of `run.json`.
#[derive(Serialize)]
pub(crate) struct RunManifest<'a> {
    /// Version of softvt.
    softvt: &'a str,
    script: String,
    suite: &'a str,
    /// True if the script returned more than this suite.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    several_suites: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    twin: Option<Twin>,
    /// Ranges within which the episodes vary, if they do.
    #[serde(skip_serializing_if = "Option::is_none")]
    variation: Option<&'a VariationRanges>,
    /// File of `--vary`.
    #[serde(skip_serializing_if = "Option::is_none")]
    vary: Option<String>,
    /// What a safe grip needs, if the suite states it.
    #[serde(skip_serializing_if = "Option::is_none")]
    needs: Option<NeededKnowledge>,
    /// The suite whose rigid twin this one is.
    #[serde(skip_serializing_if = "Option::is_none")]
    twin_of: Option<&'a str>,
    policy: &'a str,
    /// Profile of a policy server, or of the clients of `softvt serve`.
    #[serde(skip_serializing_if = "Option::is_none")]
    profile: Option<&'a Profile>,
    /// Grip code of the profile.
    #[serde(skip_serializing_if = "Option::is_none")]
    gripper: Option<GripCode>,
    /// True if clients of `softvt serve` have stepped the episodes.
    #[serde(skip_serializing_if = "Option::is_none")]
    served: Option<bool>,
    /// File of a policy in Lua. Its SHA-256 is among the sources.
    #[serde(skip_serializing_if = "Option::is_none")]
    policy_file: Option<&'a str>,
    /// The run whose actions were repeated.
    #[serde(skip_serializing_if = "Option::is_none")]
    replayed: Option<&'a ReplaySource>,
    /// Files of the demonstrations that were re-executed.
    #[serde(skip_serializing_if = "Option::is_none")]
    imported: Option<&'a [ImportedFile]>,
    /// Actions executed from each chunk.
    #[serde(skip_serializing_if = "Option::is_none")]
    replan: Option<usize>,
    privileged: bool,
    /// True if the policy keeps one number constant, by what shows of an object.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    blind: bool,
    seed: u64,
    /// Hash of the secret of a judged run.
    #[serde(skip_serializing_if = "Option::is_none")]
    seed_hash: Option<String>,
    split: &'a str,
    tasks: Vec<usize>,
    /// Episodes per task.
    episodes: u32,
    /// The episodes of each task, if only some are run.
    #[serde(skip_serializing_if = "<[u32]>::is_empty")]
    selected_episodes: &'a [u32],
    /// The part of the run, such as 2/8.
    #[serde(skip_serializing_if = "Option::is_none")]
    shard: Option<String>,
    shifts: Vec<ShiftValue>,
    /// Values of all options of the script.
    options: BTreeMap<String, String>,
    /// Options of the script as they were typed.
    arguments: Vec<String>,
    /// Arguments of `--set`.
    set: Vec<(String, String)>,
    settings: &'a Settings,
    /// SHA-256 of files by name.
    sources: BTreeMap<String, String>,
    /// Those of them that are not as in the library of the binary, by their path there.
    #[serde(skip_serializing_if = "BTreeSet::is_empty")]
    modified: BTreeSet<&'a str>,
    /// Definition of D and of its limits.
    metric_id: &'static str,
    /// τ by asset, %.
    thresholds: BTreeMap<String, Option<f64>>,
    /// True if the policy observes the true forces on the pads.
    force_observed: bool,
}

impl<'a> RunManifest<'a> {
    /// The manifest of a prepared run of `episodes` per task.
    pub(crate) fn new(run: &'a PreparedRun, episodes: u32) -> Self {
        let config = run.config;
        let RunChanges { arguments, shifts, set, twin, vary, seed, seed_hash } = config.changes();
        let options = run.loaded.options.iter();
        Self {
            softvt: env!("CARGO_PKG_VERSION"),
            script: run.loaded.sources.main.clone(),
            suite: &run.suite.name,
            several_suites: !matches!(run.loaded.plan, Plan::Suite(_)),
            twin,
            variation: run.suite.vary.as_ref(),
            vary,
            // Of the suite as it is: neither of its twin, nor with another variation.
            needs: run.suite.needs.filter(|_| config.vary.is_none() && !config.rigid_twin),
            twin_of: run.suite.twin_of.as_deref(),
            policy: &config.policy.name,
            profile: config.policy.profile(),
            gripper: config.policy.gripper,
            served: config.policy.is_client().then_some(true),
            policy_file: config.policy.file.as_deref(),
            replayed: run.replay_source.as_ref(),
            imported: Some(&run.imported[..]).filter(|files| !files.is_empty()),
            replan: config.policy.replan,
            privileged: run.is_privileged(),
            blind: config.policy.is_blind_bound(),
            seed,
            seed_hash,
            split: run.split.name(),
            tasks: run.jobs.tasks().iter().map(|task| task.id).collect(),
            episodes,
            selected_episodes: &config.selected_episodes,
            shard: config.shard.map(|shard| shard.to_string()),
            shifts,
            options: options.map(|option| (option.name.clone(), format!("{:?}", option.value))).collect(),
            arguments,
            set,
            settings: &run.settings,
            sources: run.sources.clone(),
            modified: modified(&run.sources),
            metric_id: METRIC_ID,
            thresholds: run.calibrations.tau_pct.clone(),
            force_observed: run.force_observed,
        }
    }
}

/// The files that the library of the binary has in another version, by their path there.
fn modified(sources: &BTreeMap<String, String>) -> BTreeSet<&str> {
    let is_other = |(name, hash): &(&str, &String)| {
        softvt_script::embedded(name).is_some_and(|own| softvt_script::sha256(own) != **hash)
    };
    sources
        .iter()
        .map(|(name, hash)| (in_project(name), hash))
        .filter(is_other)
        .map(|(name, _)| name)
        .collect()
}

/// A manifest and the folder in which its command ran.
#[derive(Serialize)]
struct LocatedManifest<'a, M> {
    #[serde(flatten)]
    manifest: &'a M,
    /// The working folder, to which the paths of the manifest are relative.
    folder: String,
}

/// Writes the manifest into a run folder that has none.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write_new(dir: &Path, manifest: &impl Serialize) -> Result<(), RunError> {
    let folder = std::env::current_dir().map(|dir| dir.display().to_string()).unwrap_or_default();
    Ok(files::write_json(&dir.join(RUN), &LocatedManifest { manifest, folder })?)
}

/// Writes the manifest into a folder. An existing manifest must be equal.
///
/// # Errors
/// The file cannot be written, or belongs to another run.
pub(crate) fn write_or_compare(dir: &Path, manifest: &impl Serialize) -> Result<(), RunError> {
    let path = dir.join(RUN);
    if !path.exists() {
        return write_new(dir, manifest);
    }
    let stored = files::read_text(&path)?;
    let path = path.display();
    let mut stored: Value = serde_json::from_str(&stored)
        .map_err(|error| RunError::input(format!("{path} is not a valid run file: {error}")))?;
    stored_run::remove_folder(&mut stored);
    let now = comparable(manifest, &mut stored);
    match difference(&stored, &now) {
        None => Ok(()),
        Some(what) => Err(RunError::input(format!(
            "{path} belongs to another run: {what}; resume it with its original arguments, or select another output folder"
        ))),
    }
}

/// True if the folder contains this very manifest.
///
/// # Errors
/// The file cannot be read.
pub(crate) fn is_in(dir: &Path, manifest: &RunManifest) -> Result<bool, RunError> {
    let text = files::read_text(&dir.join(RUN))?;
    Ok(serde_json::from_str::<Value>(&text).is_ok_and(|mut stored| {
        stored_run::remove_folder(&mut stored);
        let now = comparable(manifest, &mut stored);
        stored == now
    }))
}

/// A manifest without `blind`, if the stored one lacks it, as earlier versions did. Removes from both `modified`, which
/// follows from the sources and the binary.
fn comparable(manifest: &impl Serialize, stored: &mut Value) -> Value {
    let mut manifest = json!(manifest);
    for value in [&mut manifest, &mut *stored] {
        value.as_object_mut().and_then(|fields| fields.shift_remove("modified"));
    }
    if let Some(fields) = manifest.as_object_mut().filter(|_| stored["blind"].is_null()) {
        fields.shift_remove("blind");
    }
    manifest
}

/// Longest value that a message shows in full, in characters. A SHA-256 fits.
const MAX_SHOWN_CHARS: usize = 80;
/// Characters shown before the first difference of longer values.
const CONTEXT_CHARS: usize = 16;

/// Formats two different values, shortened around their first difference.
fn shorten(a: &Value, b: &Value) -> [String; 2] {
    let [a, b] = [a, b].map(|value| value.to_string().chars().collect::<Vec<char>>());
    let common = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
    let is_long = a.len().max(b.len()) > MAX_SHOWN_CHARS;
    let start = if is_long { common.saturating_sub(CONTEXT_CHARS) } else { 0 };
    [a, b].map(|chars| {
        let head = if start > 0 { "…" } else { "" };
        let tail = if chars.len() > start + MAX_SHOWN_CHARS { "…" } else { "" };
        let shown: String = chars.into_iter().skip(start).take(MAX_SHOWN_CHARS).collect();
        format!("{head}{shown}{tail}")
    })
}

/// Describes the first difference of two documents: its path and both values.
pub(crate) fn difference(before: &Value, now: &Value) -> Option<String> {
    let (Value::Object(a), Value::Object(b)) = (before, now) else {
        return (before != now).then(|| {
            if is_checksum(before) && is_checksum(now) {
                return "has changed".to_owned();
            }
            let [before, now] = shorten(before, now);
            format!("{before} before, {now} now")
        });
    };
    let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    keys.into_iter().find_map(|key| {
        let value = |map: &Map<String, Value>| map.get(key).cloned().unwrap_or(Value::Null);
        let inner = difference(&value(a), &value(b))?;
        let is_path = value(a).is_object() && value(b).is_object();
        Some(if is_path { format!("{key}.{inner}") } else { format!("{key}: {inner}") })
    })
}

/// True for a SHA-256 in hexadecimal, as those of sources.
fn is_checksum(value: &Value) -> bool {
    value.as_str().is_some_and(|text| text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_differ_from_those_of_the_binary_are_named() {
        let own = |path: &str| softvt_script::sha256(softvt_script::embedded(path).unwrap());
        let other = "0".repeat(64);
        let sources = [
            ("/home/me/softvt/scripts/shifts.lua", own("scripts/shifts.lua")),
            ("../scripts/layouts/floor.lua", other.clone()),
            ("assets/calibration/cube.json", other.clone()),
            ("mine.lua", other),
        ];
        let sources = sources.map(|(name, hash)| (name.to_owned(), hash)).into();
        let named: Vec<&str> = modified(&sources).into_iter().collect();
        assert_eq!(named, ["assets/calibration/cube.json", "scripts/layouts/floor.lua"]);
    }

    #[test]
    fn the_first_difference_is_named_by_its_path() {
        let a = json!({ "seed": 0, "settings": { "physics": { "dt": 0.0166 } }, "shifts": [] });
        assert_eq!(difference(&a, &a.clone()), None);
        let b = json!({ "seed": 0, "settings": { "physics": { "dt": 0.01 } }, "shifts": [] });
        assert_eq!(difference(&a, &b).unwrap(), "settings.physics.dt: 0.0166 before, 0.01 now");
        let c = json!({ "seed": 0, "settings": { "physics": { "dt": 0.0166 } } });
        assert_eq!(difference(&a, &c).unwrap(), "shifts: [] before, null now");
        let source = |digit: &str| json!({ "sources": { "assets/bun.lua": digit.repeat(64) } });
        assert_eq!(difference(&source("a"), &source("b")).unwrap(), "sources.assets/bun.lua: has changed");
    }

    #[test]
    fn a_run_of_an_earlier_version_or_another_binary_may_lack_what_it_did_not_write() {
        let now = json!({ "policy": "drives", "blind": true, "seed": 0, "modified": ["scripts/shifts.lua"] });
        let earlier = json!({ "policy": "drives", "seed": 0 });
        assert_eq!(comparable(&now, &mut earlier.clone()), earlier);
        let (same, mut stored) = (json!({ "policy": "drives", "blind": true, "seed": 0 }), now.clone());
        assert_eq!(comparable(&now, &mut stored), same);
        assert_eq!(stored, same, "the binary may have the modified script by now");
    }

    #[test]
    fn long_values_are_shortened_around_their_difference() {
        let hash = |last: char| "0123456789abcdef".repeat(4)[..59].to_owned() + &last.to_string();
        let (a, b) = (json!({ "x.lua": hash('1') }), json!({ "x.lua": hash('2') }));
        let text = difference(&a, &b).unwrap();
        assert!(text.contains(&hash('1')) && text.contains(&hash('2')), "{text}");
        let list = |last: usize| json!({ "tasks": (0..100).chain([last]).collect::<Vec<_>>() });
        let text = difference(&list(777), &list(888)).unwrap();
        assert_eq!(text, "tasks: …,95,96,97,98,99,777] before, …,95,96,97,98,99,888] now");
        let long = |letter: &str| json!({ "a": "x".repeat(300) + letter + &"y".repeat(300) });
        let text = difference(&long("1"), &long("2")).unwrap();
        assert!(text.contains("x1y") && text.contains("x2y") && text.chars().count() < 200, "{text}");
    }
}
