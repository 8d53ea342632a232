//! `softvt.conditions`: suites as they are, then under each condition, each in a run folder of its own; and the table.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::{
    benchmark::{Condition, ObjectType, REFERENCE, Suite, Task},
    cli::{
        error::CliError,
        output::print,
        run::config::RunConfig,
        run::selection::{path_component, select_episodes, select_tasks},
        run::suite_run::{is_finished, run_suite},
        run::{calibration::make_folder, suite_run::SuiteRun},
    },
    evaluation::summary::method_label,
    report::{
        condition_table::{ConditionOutcome, ConditionRow, ConditionTable, table},
        run_folder::RunFolder,
    },
    script::Loaded,
    text,
};

/// The comparison of all suites, in the folder of all runs.
const FILE: &str = "conditions.json";

/// `conditions.json`.
#[derive(Serialize)]
struct ConditionsFile<'a> {
    softvt: &'a str,
    script: &'a str,
    policy: &'a str,
    seed: u64,
    suites: &'a [ConditionTable],
}

/// A suite under one condition, or as it is.
struct ConditionCase {
    name: String,
    shift: Vec<(String, f64)>,
    set: Vec<(String, String)>,
    /// Its folder, from that of all.
    folder: String,
    /// The command line with the condition's shifts and settings after its own.
    run: RunConfig,
    not_applicable: Option<String>,
}

/// Runs every suite as it is and under every condition, and prints a table a suite. All that can be wrong without running
/// is found before anything runs.
///
/// # Errors
/// A condition that a suite does not know, a folder that holds a run, or an episode that fails; finished runs are kept.
pub(crate) fn run(
    run: &RunConfig,
    loaded: &Loaded,
    (suites, conditions): (&[Suite], &[Condition]),
    out: &Path,
) -> Result<(), CliError> {
    let cases: Vec<Vec<ConditionCase>> = suites
        .iter()
        .map(|suite| cases(run, suite, conditions, suites.len() > 1))
        .collect::<Result<_, _>>()?;
    let mut ready = Vec::new();
    for (suite, cases) in suites.iter().zip(&cases) {
        let tasks = select_tasks(run, suite)?;
        ready.push((prepared(loaded, suite, (cases, &tasks), out)?, tasks));
    }
    let mut compared = Vec::new();
    for ((suite, cases), (batches, tasks)) in suites.iter().zip(&cases).zip(ready) {
        let rows = compare(run, suite, (cases, batches), &tasks)?;
        if !run.json {
            print(&table(&rows));
        }
        compared.push(rows);
    }
    write(run, loaded, &compared, out)
}

/// Whether every condition can be applied to every suite; the first task of each is built.
///
/// # Errors
/// The first thing that is wrong.
pub(crate) fn check(
    run: &RunConfig,
    loaded: &Loaded,
    (suites, conditions): (&[Suite], &[Condition]),
) -> Result<(), CliError> {
    for suite in suites {
        let first: Vec<&Task> = suite.tasks.iter().take(1).collect();
        let cases = cases(run, suite, conditions, false)?;
        prepared(loaded, suite, (&cases, &first), Path::new(""))?;
    }
    let names: Vec<&str> = conditions.iter().map(|condition| condition.name.as_str()).collect();
    print(&format!("conditions: {REFERENCE}, {}\n", text::escape_control(&names.join(", "))));
    Ok(())
}

fn cases(
    run: &RunConfig,
    suite: &Suite,
    conditions: &[Condition],
    level: bool,
) -> Result<Vec<ConditionCase>, CliError> {
    let kind = if run.twin { ObjectType::Rigid } else { suite.object_type };
    let above = if level { format!("{}/", path_component(&run.name_of(suite))) } else { String::new() };
    let mut found = vec![ConditionCase {
        name: REFERENCE.to_owned(),
        shift: Vec::new(),
        set: Vec::new(),
        folder: format!("{above}{REFERENCE}"),
        run: run.clone(),
        not_applicable: None,
    }];
    for condition in conditions {
        let folder = format!("{above}{}", path_component(&condition.name));
        if let Some(same) = found.iter().find(|case| case.folder == folder) {
            let message = format!(
                "{}: the conditions {:?} and {:?} would share the folder {folder}; rename one",
                run.file.display(),
                same.name,
                condition.name
            );
            return Err(CliError::input(message));
        }
        let mut changed = run.clone();
        changed.shifts.extend(condition.shift.iter().cloned());
        changed.set.extend(condition.set.iter().cloned());
        found.push(ConditionCase {
            name: condition.name.clone(),
            shift: condition.shift.clone(),
            set: condition.set.clone(),
            folder,
            run: changed,
            not_applicable: not_applicable(condition.only, kind),
        });
    }
    Ok(found)
}

fn not_applicable(only: Option<ObjectType>, kind: ObjectType) -> Option<String> {
    match only? {
        only if only == kind => None,
        ObjectType::Deformable => Some("nothing that is judged deforms".to_owned()),
        ObjectType::Rigid => Some("it is for rigid objects".to_owned()),
    }
}

/// A batch for every case that applies; nothing has run yet.
fn prepared<'a>(
    loaded: &'a Loaded,
    suite: &'a Suite,
    (cases, tasks): (&'a [ConditionCase], &[&'a Task]),
    out: &Path,
) -> Result<Vec<Option<SuiteRun<'a>>>, CliError> {
    let mut batches: Vec<Option<SuiteRun>> = Vec::new();
    for case in cases {
        if case.not_applicable.is_some() {
            batches.push(None);
            continue;
        }
        let named = |failure: CliError| match case.name == REFERENCE {
            true => failure,
            false => failure.within(&format!("suite {}, condition {:?}", suite.name, case.name)),
        };
        let dir: PathBuf = out.join(&case.folder);
        // One that is finished is left alone, one that was broken off goes on if that is asked for.
        if !(case.run.resume || is_finished(&dir)) {
            RunFolder::check(&dir)
                .map_err(|e| CliError::input(format!("{}: {e}", case.run.file.display())))?;
        }
        let jobs = select_episodes(&case.run, suite, tasks);
        let mut batch = SuiteRun::new(&case.run, loaded, suite, (jobs, dir)).map_err(named)?;
        if let Some(Some(reference)) = batches.first() {
            batch.share_limits(reference);
        }
        batch.prepare(tasks).map_err(named)?;
        batches.push(Some(batch));
    }
    Ok(batches)
}

fn compare(
    run: &RunConfig,
    suite: &Suite,
    (cases, batches): (&[ConditionCase], Vec<Option<SuiteRun>>),
    tasks: &[&Task],
) -> Result<ConditionTable, CliError> {
    let (mut reference, mut forces) = (None, false);
    let mut rows = Vec::new();
    for (case, batch) in cases.iter().zip(batches) {
        let mut outcome = None;
        if let Some(batch) = batch {
            let name = text::escape_control(&case.name);
            text::eprint_line(&format!(
                "softvt: {}, {name} ({} of {})",
                suite.name,
                rows.len() + 1,
                cases.len()
            ));
            let done = run_suite(&batch, tasks)?;
            outcome = Some(ConditionOutcome::new(case.folder.clone(), &done.records, reference.as_deref()));
            reference.get_or_insert(done.records);
            forces |= done.summary.force_observed;
        }
        rows.push(ConditionRow {
            condition: case.name.clone(),
            shift: case.shift.clone(),
            set: case.set.clone(),
            outcome,
            not_applicable: case.not_applicable.clone(),
        });
    }
    let deformable = suite.object_type == ObjectType::Deformable && !run.twin;
    let policy = method_label(run.policy.name(), run.policy.is_privileged(), forces);
    Ok(ConditionTable { suite: run.name_of(suite), policy, deformable, rows })
}

fn write(run: &RunConfig, loaded: &Loaded, compared: &[ConditionTable], out: &Path) -> Result<(), CliError> {
    let document = ConditionsFile {
        softvt: env!("CARGO_PKG_VERSION"),
        script: &loaded.main,
        policy: run.policy.name(),
        seed: run.seed,
        suites: compared,
    };
    let text = format!("{:#}\n", serde_json::json!(document));
    make_folder(out)?;
    let path = out.join(FILE);
    crate::files::replace(&path, &text).map_err(CliError::input)?;
    if run.json {
        print(&text);
    }
    text::eprint_line(&format!("softvt: {}", path.display()));
    Ok(())
}
