//! `softvt.conditions`: every suite as it is (the reference) and under each condition, one run folder each, and their
//! comparison.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde_json::{Value, json};

use crate::{
    config::{ConfiguredScript, RunConfig},
    error::RunError,
    evaluate::{is_finished, run_suite},
    policy::{PolicyConfig, PolicyOptions, PolicySource},
    suite_run::{PreparedRun, SuiteRun},
    suite_selection::{check_episodes, path_component, select_episodes, select_tasks},
};
use softvt_benchmark::{Condition, ObjectType, Plan, REFERENCE, Suite, Task, settings::Settings};
use softvt_common::{episode_id::EpisodeSplit, files, text};
use softvt_report::condition_table::{ConditionOutcome, ConditionRow, ConditionTable};
use softvt_runs::{
    run_folder::RunFolder,
    summary::{MethodMarks, method_label},
};
use softvt_script::LoadedScript;

/// Name of the file with the comparison of all suites, in the folder above all runs.
pub const FILE: &str = "conditions.json";

/// A suite under one condition, or the reference.
struct ConditionCase {
    condition: Condition,
    /// Folder of the run, relative to that of all runs.
    folder: String,
    /// The configuration with the shifts and settings of the condition after those of the command line.
    config: RunConfig,
    /// The reason for which the condition does not apply to the suite.
    not_applicable: Option<String>,
    /// True if the condition applies, but sets what the suite has without it.
    is_neutral: bool,
}

/// Runs every suite of a script as it is and under each of its conditions, into folders below `out`. All scenes and
/// folders are checked before the first episode runs. `on_suite` is called with the tables so far after each suite.
/// Returns the table of each suite.
///
/// # Errors
/// A script without conditions, a condition that does not fit a suite, a folder that contains a run, or an episode that
/// fails. Finished runs are kept.
pub fn run<E: From<RunError>>(
    run: &ConfiguredScript,
    out: &Path,
    mut on_suite: impl FnMut(&[ConditionTable]) -> Result<(), E>,
) -> Result<Vec<ConditionTable>, E> {
    let ConfiguredScript { config, script: loaded } = run;
    let (suites, conditions) = conditions_of(run)?;
    check_episodes(config, suites)?;
    let cases = cases_of_suites(config, suites, conditions)?;
    let mut prepared = Vec::new();
    for (suite, cases) in suites.iter().zip(&cases) {
        prepared.push(prepare_runs(loaded, suite, cases, &select_tasks(config, suite)?, out)?);
    }
    let mut tables = Vec::new();
    for ((suite, cases), runs) in suites.iter().zip(&cases).zip(prepared) {
        let compared = compare_conditions(config, suite, cases, runs, out)?;
        tables.push(compared);
        on_suite(&tables)?;
    }
    files::write_json(&out.join(FILE), &document(run, &tables)).map_err(RunError::from)?;
    Ok(tables)
}

/// The suites and the conditions of a script.
fn conditions_of(
    ConfiguredScript { config, script }: &ConfiguredScript,
) -> Result<(&[Suite], &[Condition]), RunError> {
    match &script.plan {
        Plan::Conditions { suites, conditions, .. } => Ok((suites, conditions)),
        _ => Err(config.error("the script returned no conditions")),
    }
}

/// Checks that every condition can be applied to every suite, on the first task of each.
///
/// # Errors
/// A script without conditions; the first condition or scene that is not valid.
pub fn check(run: &ConfiguredScript) -> Result<(), RunError> {
    let ConfiguredScript { config, script: loaded } = run;
    let (suites, conditions) = conditions_of(run)?;
    for (suite, cases) in suites.iter().zip(cases_of_suites(config, suites, conditions)?) {
        let first: Vec<&Task> = suite.tasks.iter().take(1).collect();
        prepare_runs(loaded, suite, &cases, &first, Path::new(""))?;
    }
    Ok(())
}

fn cases_of_suites(
    config: &RunConfig,
    suites: &[Suite],
    conditions: &[Condition],
) -> Result<Vec<Vec<ConditionCase>>, RunError> {
    let cases_of = |suite| condition_cases(config, suite, conditions, suites.len() > 1);
    let cases: Vec<Vec<ConditionCase>> = suites.iter().map(cases_of).collect::<Result<_, _>>()?;
    // The reference is the first.
    for (at, condition) in (1..).zip(conditions) {
        if cases.iter().all(|cases| cases[at].is_neutral) {
            return Err(config.error(format_args!(
                "the condition {:?} sets what {} without it; leave it out, or give other values",
                condition.name,
                if suites.len() == 1 { "the suite has" } else { "the suites have" }
            )));
        }
    }
    Ok(cases)
}

/// The reference and all conditions of a suite, in folders below one of the suite if there are several suites.
fn condition_cases(
    config: &RunConfig,
    suite: &Suite,
    conditions: &[Condition],
    has_suite_folder: bool,
) -> Result<Vec<ConditionCase>, RunError> {
    let object_type = if config.rigid_twin { ObjectType::Rigid } else { suite.object_type };
    let parent = match has_suite_folder {
        true => format!("{}/", path_component(&config.suite_name(suite))),
        false => String::new(),
    };
    let reference = Condition {
        name: REFERENCE.to_owned(),
        shift: Vec::new(),
        set: Vec::new(),
        policy: None,
        replay: false,
        only: None,
        rigid_twin: false,
    };
    let mut cases: Vec<ConditionCase> = Vec::new();
    for condition in std::iter::once(&reference).chain(conditions) {
        let folder = format!("{parent}{}", path_component(&condition.name));
        if let Some(same) = cases.iter().find(|case| case.folder == folder) {
            return Err(config.error(format_args!(
                "the conditions {:?} and {:?} share the folder {folder}; rename one",
                same.condition.name, condition.name
            )));
        }
        // A change by the run would not hold in a condition that sets the same.
        let shifts = config.shifts.iter().map(|shift| ("shifts", &shift.name, shift.value.to_string()));
        let settings = config.settings.iter().map(|(path, value)| ("settings", path, value.clone()));
        let is_set = |name: &String| {
            let mut shifts = condition.shift.iter().map(|shift| &shift.name);
            shifts.any(|own| own == name) || condition.set.iter().any(|(own, _)| own == name)
        };
        if let Some((field, name, value)) = shifts.chain(settings).find(|(_, name, _)| is_set(name)) {
            let message = format!("condition {:?} sets it too; leave it out", condition.name);
            return Err(config.error_of(field, format!("{name}={value}"), message));
        }
        let mut changed = config.clone();
        changed.shifts.extend(condition.shift.iter().cloned());
        changed.settings.extend(condition.set.iter().cloned());
        if let Some(name) = &condition.policy {
            changed.policy = PolicyConfig::named(name)
                .map_err(|error| config.error(format_args!("condition {:?}: {error}", condition.name)))?;
        }
        if condition.rigid_twin {
            changed.rigid_twin = true;
        }
        let mut not_applicable = not_applicable(condition, object_type);
        // Settings of the command line are checked with the reference.
        if not_applicable.is_none() && suite.settings.with_all(&config.settings).is_ok() {
            suite.settings.with_all(&changed.settings).map_err(|error| {
                let place = format!("suite {}, condition {:?}", suite.name, condition.name);
                config.error(format_args!("set: {error}")).within(&place)
            })?;
        }
        let is_neutral = condition.name != REFERENCE
            && not_applicable.is_none()
            && Effect::of(config, suite).is_some_and(|own| Effect::of(&changed, suite) == Some(own));
        if is_neutral {
            not_applicable = Some("the suite has the same values without it".to_owned());
        }
        let condition = condition.clone();
        cases.push(ConditionCase { condition, folder, config: changed, not_applicable, is_neutral });
    }
    Ok(cases)
}

/// Values that a configuration changes in a suite.
#[derive(PartialEq)]
struct Effect<'a> {
    /// The shifts that differ from their defaults; of one that is given twice, the last value.
    shifts: BTreeMap<&'a str, f64>,
    settings: Settings,
    policy: &'a str,
    rigid_twin: bool,
}

impl<'a> Effect<'a> {
    /// `None` if a setting is not valid.
    fn of(config: &'a RunConfig, suite: &Suite) -> Option<Self> {
        let default_of = |name: &str| suite.shifts.iter().find(|s| s.name == name).map(|s| s.default);
        let mut shifts: BTreeMap<&str, f64> =
            config.shifts.iter().map(|shift| (shift.name.as_str(), shift.value)).collect();
        shifts.retain(|name, value| default_of(name) != Some(*value));
        let settings = suite.settings.with_all(&config.settings).ok()?;
        Some(Self { shifts, settings, policy: &config.policy.name, rigid_twin: config.rigid_twin })
    }
}

fn not_applicable(condition: &Condition, object_type: ObjectType) -> Option<String> {
    if condition.rigid_twin && object_type == ObjectType::Rigid {
        return Some("its objects are rigid already".to_owned());
    }
    match condition.only? {
        only if only == object_type => None,
        ObjectType::Deformable => Some("it applies to suites of deformable objects only".to_owned()),
        ObjectType::Rigid => Some("it applies to suites of rigid objects only".to_owned()),
    }
}

/// Prepares a run of every case that applies, without running an episode.
fn prepare_runs<'a>(
    loaded: &'a LoadedScript,
    suite: &'a Suite,
    cases: &'a [ConditionCase],
    tasks: &[&'a Task],
    out: &Path,
) -> Result<Vec<Option<PreparedRun<'a>>>, RunError> {
    let mut runs: Vec<Option<PreparedRun>> = Vec::new();
    for case in cases {
        if case.not_applicable.is_some() {
            runs.push(None);
            continue;
        }
        let in_case = |error: RunError| match case.condition.name == REFERENCE {
            true => error,
            false => error.within(&format!("suite {}, condition {:?}", suite.name, case.condition.name)),
        };
        let dir: PathBuf = out.join(&case.folder);
        // A finished run is left unchanged, and an interrupted one is continued on request.
        if !(case.config.resume || is_finished(&dir)) {
            RunFolder::check_vacant(&dir).map_err(|error| case.config.error(error))?;
        }
        let jobs = select_episodes(&case.config, suite, tasks);
        let run =
            SuiteRun::new(&case.config, loaded, suite, jobs, EpisodeSplit::Validation).map_err(in_case)?;
        let run = SuiteRun { out: Some(dir), ..run };
        let prepared = match runs.first() {
            Some(Some(reference)) => run.prepare_like(reference),
            _ => run.prepare(),
        };
        runs.push(Some(prepared.map_err(in_case)?));
    }
    Ok(runs)
}

fn compare_conditions(
    config: &RunConfig,
    suite: &Suite,
    cases: &[ConditionCase],
    runs: Vec<Option<PreparedRun>>,
    out: &Path,
) -> Result<ConditionTable, RunError> {
    let mut marks = MethodMarks { privileged: config.policy.privileged, ..MethodMarks::default() };
    let mut reference = None;
    let mut rows = Vec::new();
    for (case, run) in cases.iter().zip(runs) {
        let mut outcome = None;
        let repeating;
        if let Some(mut run) = run {
            if case.condition.replay {
                // The reference is the first, and always applies.
                let policy = PolicySource::Run(out.join(&cases[0].folder));
                let policy = PolicyConfig::load(&PolicyOptions { policy, ..PolicyOptions::default() })?;
                repeating = RunConfig { policy, ..case.config.clone() };
                run = with_config(&run, &repeating)?;
            }
            let (name, number) = (text::escape_control(&case.condition.name), rows.len() + 1);
            config.notice(format_args!("{}, {name} ({number} of {})", suite.name, cases.len()));
            let result = run_suite(&run, &mut |_| ())?;
            outcome = Some(ConditionOutcome::new(case.folder.clone(), &result.records, reference.as_deref()));
            reference.get_or_insert(result.records);
            marks.force_observed |= result.summary.force_observed;
            marks.replayed |= result.summary.replayed && !case.condition.replay;
            marks.privileged |= result.summary.privileged;
        }
        rows.push(ConditionRow {
            condition: case.condition.name.clone(),
            rigid_twin: case.condition.rigid_twin,
            shift: case.condition.shift.clone(),
            set: case.condition.set.clone(),
            policy: case.condition.policy.clone(),
            replay: case.condition.replay,
            blind: case.config.policy.is_blind_bound(),
            outcome,
            not_applicable: case.not_applicable.clone(),
        });
    }
    let deformable = suite.object_type == ObjectType::Deformable && !config.rigid_twin;
    let policy = method_label(&config.policy.name, marks);
    Ok(ConditionTable { suite: config.suite_name(suite), policy, deformable, rows })
}

/// The same run with another configuration.
fn with_config<'a>(run: &PreparedRun<'a>, config: &'a RunConfig) -> Result<PreparedRun<'a>, RunError> {
    let again = SuiteRun::new(config, run.loaded, run.suite, run.jobs.clone(), run.split)?;
    SuiteRun { out: run.out.clone(), ..again }.prepare_like(run)
}

pub fn document(
    ConfiguredScript { config, script: loaded }: &ConfiguredScript,
    tables: &[ConditionTable],
) -> Value {
    let changes = config.changes();
    let mut document = json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "script": loaded.sources.main,
        "policy": config.policy.name,
        "seed": changes.seed,
        "suites": tables,
    });
    if let Some(hash) = changes.seed_hash {
        document["seed_hash"] = json!(hash);
    }
    document
}
