//! Run of an experiment: its points on threads, its rows in the order of the points, its files at the end.

use std::{collections::BTreeSet, path::PathBuf, sync::Arc};

use serde_json::Value;

use crate::{
    config::{ConfiguredScript, RunConfig},
    error::RunError,
};
use softvt_benchmark::Plan;
use softvt_common::{
    cancel,
    files::replace,
    table::{Column, Table},
    text::{counted, is_misspelt, significant, unknown_name},
};
use softvt_runs::{
    experiment_folder::{ExperimentFolder, ExperimentRow, FinishedPoint, RESERVED},
    manifest::{ExperimentManifest, VERSION, working_folder},
};
use softvt_script::{Experiment, ExperimentInput, ExperimentInputError, LoadedScript, OptionSpec};

/// Results of an experiment, as they become known.
pub enum ExperimentOutput<'a> {
    /// The rows of all points, in order; after an interrupt those of the finished points.
    Rows(&'a [ExperimentRow]),
    /// The text of its `finish` function.
    Text(&'a str),
}

/// Smallest number in a table that is shown with five decimals; smaller ones have three significant digits.
const MIN_DECIMAL: f64 = 1e-3;

/// Rows as text, in these columns or in those of all rows; empty without rows.
pub fn table(rows: &[ExperimentRow], columns: &[String]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let all: BTreeSet<&String> = rows.iter().flat_map(|row| row.keys()).collect();
    let columns: Vec<&String> =
        if columns.is_empty() { all.into_iter().collect() } else { columns.iter().collect() };
    let column = |name| Column::number(name, move |row: &ExperimentRow| cell(row.get(name)));
    Table::new(rows, columns.into_iter().map(column)).text()
}

fn cell(value: Option<&Value>) -> String {
    match value {
        None | Some(Value::Null) => "-".to_owned(),
        Some(Value::String(text)) => text.clone(),
        Some(Value::Number(number)) => number.as_f64().map_or(number.to_string(), |x| match x.abs() {
            0.0 | MIN_DECIMAL.. => format!("{x:.5}").trim_end_matches('0').trim_end_matches('.').to_owned(),
            _ => significant(x, 3),
        }),
        Some(other) => other.to_string(),
    }
}

/// Runs all points of the experiment that a script returned, or of an interrupted one the others. With an output
/// folder, the rows and the files of the script are written into it; without one, the files of the script are written
/// below the working folder.
pub fn run<E: From<RunError>>(
    ConfiguredScript { config, script: loaded }: &ConfiguredScript,
    mut on_output: impl FnMut(ExperimentOutput) -> Result<(), E>,
) -> Result<(), E> {
    let Plan::Experiment { name, points, has_finish, columns, .. } = &loaded.plan else {
        return Err(config.error("the script returned no experiment").into());
    };
    let (points, out) = (*points, config.out.as_deref());
    let input = Arc::new(input(config)?);
    if *has_finish && out.is_none() {
        refuse_changed_project_files(config, loaded)?;
    }
    // Each point runs the script again: its changes of variables do not reach other points.
    let open = || Experiment::open_with(loaded, &input).map_err(RunError::from);
    let manifest = manifest(config, loaded, name, points);
    let opened = out.map(|dir| ExperimentFolder::open(dir, &manifest, config.resume)).transpose();
    let (mut folder, finished) = opened.map_err(|error| config.error(error))?.unzip();
    let mut finished = finished.unwrap_or_default();
    let left: Vec<usize> = (0..points).filter(|point| !finished.contains_key(point)).collect();
    let run_point = |job: usize| {
        let (experiment, point) = (open()?, left[job]);
        // Before the script can change its point.
        let parameters = experiment.parameters(point);
        let rows = experiment.run(point).map_err(|error| {
            let parameters = serde_json::to_string(&parameters).unwrap_or_default();
            RunError::from(error).within(&format!("point {point} {parameters}"))
        })?;
        // A script can catch the error of an interrupt and return a row that is not valid.
        if cancel::requested() {
            return Err(RunError::interrupted("interrupted"));
        }
        Ok(FinishedPoint { point, parameters, rows })
    };
    let list = config.job_list(&format!("running {name}"));
    let outcome = config.run_jobs(&list, left.len(), run_point, |_, found: FinishedPoint| {
        let line = format!("point {}: {}", found.point, counted(found.rows.len(), "row"));
        if let Some(folder) = &mut folder {
            folder.add(&found)?;
        }
        finished.insert(found.point, found);
        Ok(line)
    });
    drop(list);
    let finished: Vec<FinishedPoint> = finished.into_values().collect();
    let rows: Vec<ExperimentRow> = finished.iter().flat_map(|point| point.rows.clone()).collect();
    if cancel::requested() {
        on_output(ExperimentOutput::Rows(&rows))?;
        let done = format!("interrupted; the rows of {} of {points} points are above", finished.len());
        let Some(dir) = out else {
            return Err(RunError::interrupted(format_args!("{done}; no file was written")).into());
        };
        return Err(RunError { resumable: Some(dir.into()), ..RunError::interrupted(done) }.into());
    }
    // Settings or a seed that no point used, or rows that lack something; points of an earlier process may have used
    // what these did not.
    let refused = (left.len() == points).then(|| {
        let unused = input.check_used().err().map(|error| input_error(config, &error));
        unused.or_else(|| problem_of(&rows, columns).map(|problem| config.error(problem)))
    });
    let refused = refused.flatten();
    if (outcome.is_err() && finished.is_empty()) || (outcome.is_ok() && refused.is_some()) {
        folder.take().map_or(Ok(()), ExperimentFolder::discard).map_err(RunError::from)?;
    }
    outcome?;
    refused.map_or(Ok(()), Err)?;
    // The rows are kept if finish fails.
    on_output(ExperimentOutput::Rows(&rows))?;
    if let Some(folder) = &mut folder {
        folder.write_rows(&finished, columns).map_err(RunError::from)?;
    }
    let finish = open()?.finish(&rows).map_err(RunError::from)?;
    if let Some(text) = &finish.text {
        on_output(ExperimentOutput::Text(text))?;
    }
    finish.files.iter().try_for_each(|(path, bytes)| write(config, path, bytes))?;
    Ok(finish.problem.map_or(Ok(()), |problem| Err(config.error(problem)))?)
}

/// Columns or rows that all points lack.
fn problem_of(rows: &[ExperimentRow], columns: &[String]) -> Option<String> {
    if rows.is_empty() {
        return Some(
            "experiment.run: no point returned a row; return a table with a key per column".to_owned(),
        );
    }
    let known: BTreeSet<&str> = rows.iter().flat_map(|row| row.keys().map(String::as_str)).collect();
    let is_unknown = |column: &&String| !known.contains(column.as_str());
    if let Some(first) = columns.first().filter(|_| columns.iter().all(|column| is_unknown(&column))) {
        let unknown = unknown_name("column", first, known.iter().copied());
        return Some(format!("experiment.columns: no row has any of them: {unknown}"));
    }
    // Rows of some options lack some columns.
    let left_out = |name: &&&str| !columns.iter().any(|column| column == **name);
    columns.iter().filter(is_unknown).find_map(|column| {
        let meant = known.iter().filter(left_out).find(|name| is_misspelt(column, name))?;
        Some(format!("experiment.columns: no row has {column:?}; did you mean {meant:?}?"))
    })
}

fn manifest(config: &RunConfig, loaded: &LoadedScript, name: &str, points: usize) -> ExperimentManifest {
    let options = loaded.options.iter();
    ExperimentManifest {
        softvt: VERSION.to_owned(),
        script: loaded.sources.main.clone(),
        experiment: name.to_owned(),
        points,
        seed: config.base_seed(),
        options: options.map(|option| (option.name.clone(), format!("{:?}", option.value))).collect(),
        arguments: config.options.clone(),
        set: config.settings.clone(),
        sources: loaded.sources.bundle.hashes(),
        folder: working_folder(),
    }
}

/// Checks the settings of a run for an experiment without running it.
///
/// # Errors
/// A setting does not exist, has a value out of its range, or concerns the judge.
pub fn check(config: &RunConfig) -> Result<(), RunError> {
    input(config).map(|_| ())
}

fn input(config: &RunConfig) -> Result<ExperimentInput, RunError> {
    ExperimentInput::new(config.settings.clone(), config.base_seed())
        .map_err(|error| input_error(config, &error))
}

fn input_error(config: &RunConfig, error: &ExperimentInputError) -> RunError {
    config.error_of(error.input, &error.path, error)
}

/// Refuses to write files into the project that were made with changed settings, another seed or an option that says
/// so: they would be taken for the nominal ones, such as the calibration of an asset.
fn refuse_changed_project_files(config: &RunConfig, loaded: &LoadedScript) -> Result<(), RunError> {
    let message = "give an output folder: this experiment can write files, and those made with it must not replace the files \
                   of the project";
    if let Some((path, _)) = config.settings.first() {
        return Err(config.error_of("settings", path, message));
    }
    if config.base_seed() != 0 {
        return Err(config.error_of("seed", config.base_seed(), message));
    }
    let changed = |option: &&OptionSpec| option.needs_out && option.value != option.default;
    match loaded.options.iter().find(changed) {
        None => Ok(()),
        Some(option) => Err(config.error(format_args!("{} {}: {message}", option.flag(), option.value))),
    }
}

/// Writes a file of the script into the output folder, or below the working folder. Refuses to follow symbolic links,
/// which could lead out of the folder, and names of files of softvt, also where the case of names does not count.
fn write(config: &RunConfig, relative: &str, bytes: &[u8]) -> Result<(), RunError> {
    let first = relative.split('/').next().unwrap_or_default();
    if config.out.is_some() && RESERVED.iter().any(|name| first.eq_ignore_ascii_case(name)) {
        return Err(
            config.error(format_args!("finish.files: {relative} is written by softvt; give another path"))
        );
    }
    let base = config.out.clone().unwrap_or_default();
    let path = base.join(relative);
    let between = path.ancestors().skip(1).take_while(|folder| *folder != base);
    if let Some(link) = between.into_iter().find(|folder| folder.is_symlink()) {
        return Err(RunError::input(format_args!(
            "{}: {} is a link; files of scripts are written into real folders only",
            path.display(),
            PathBuf::from(link).display()
        )));
    }
    replace(&path, bytes)?;
    config.notice(format_args!("wrote {}", path.display()));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn small_numbers_keep_three_digits() {
        for (number, text) in [
            (3e-6, "0.000003"),
            (1.7e-9, "1.7e-9"),
            (-1.23456e-4, "-0.000123"),
            (0.0, "0"),
            (12.25, "12.25"),
            (0.001234567, "0.00123"),
        ] {
            assert_eq!(cell(Some(&json!(number))), text, "{number}");
        }
    }
}
