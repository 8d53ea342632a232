//! Run of an experiment: its points on threads, its rows in the order of the points, its files at the end.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::Mutex,
};

use serde_json::Value;

use crate::{
    error::CliError,
    output::{Progress, eprint_notice, print, text_columns},
    run::config::RunConfig,
};
use softvt_common::{files::replace, parallel, text::counted};
use softvt_rollout::cancel;
use softvt_script::{Experiment, ExperimentRow, LoadedScript};

/// Runs all points of an experiment and prints its rows.
///
/// # Errors
/// The script fails, or a file cannot be written.
pub(crate) fn run(
    config: &RunConfig,
    loaded: &LoadedScript,
    name: &str,
    points: usize,
    columns: &[String],
) -> Result<(), CliError> {
    // Opening an experiment runs the whole script, so each thread takes an idle one before it opens another.
    let idle: Mutex<Vec<Experiment>> = Mutex::default();
    let take = || match parallel::lock(&idle).pop() {
        Some(experiment) => Ok(experiment),
        None => Experiment::open(loaded),
    };
    let mut rows: Vec<Vec<ExperimentRow>> = vec![Vec::new(); points];
    let mut progress = Progress::new(points, name);
    let outcome = parallel::run(
        points,
        config.threads(),
        cancel::requested,
        |point| {
            let experiment = take()?;
            let rows = experiment.run(point)?;
            // A script can catch the error of an interrupt and return a row that is not valid.
            if cancel::requested() {
                return Err(CliError::interrupted("interrupted"));
            }
            parallel::lock(&idle).push(experiment);
            Ok(rows)
        },
        |point, found| {
            progress.tick(&format!("point {point}: {}", counted(found.len(), "row")));
            rows[point] = found;
            Ok(())
        },
    );
    drop(progress);
    let done = rows.iter().filter(|rows| !rows.is_empty()).count();
    let rows: Vec<ExperimentRow> = rows.into_iter().flatten().collect();
    if cancel::requested() {
        print_rows(config, &rows, columns);
        return Err(CliError::interrupted(format!(
            "interrupted; the rows of {done} of {points} points are above; no file was written"
        )));
    }
    outcome?;
    let finish = take()?.finish(&rows)?;
    print_rows(config, &rows, columns);
    if let Some(text) = finish.text.filter(|_| !config.flags.json) {
        print(&format!("{text}\n"));
    }
    let base = config.flags.out.clone().unwrap_or_default();
    finish.files.iter().try_for_each(|(relative, bytes)| write(&base, relative, bytes))
}

/// Writes a file of the script under `base`. Refuses to follow symbolic links, which could lead out of the folder.
fn write(base: &Path, relative: &str, bytes: &[u8]) -> Result<(), CliError> {
    let path = base.join(relative);
    let between = path.ancestors().skip(1).take_while(|folder| *folder != base);
    if let Some(link) = between.into_iter().find(|folder| folder.is_symlink()) {
        return Err(CliError::input(format!(
            "{}: {} is a link; files of scripts are written into real folders only",
            path.display(),
            PathBuf::from(link).display()
        )));
    }
    replace(&path, bytes)?;
    eprint_notice(format!("wrote {}", path.display()));
    Ok(())
}

/// Prints rows as JSON lines or as a table.
fn print_rows(config: &RunConfig, rows: &[ExperimentRow], columns: &[String]) {
    if config.flags.json {
        rows.iter().for_each(|row| print(&format!("{}\n", serde_json::json!(row))));
        return;
    }
    if rows.is_empty() {
        return;
    }
    let all: BTreeSet<&String> = rows.iter().flat_map(|row| row.keys()).collect();
    let columns: Vec<&String> =
        if columns.is_empty() { all.into_iter().collect() } else { columns.iter().collect() };
    let header = columns.iter().map(ToString::to_string).collect();
    let cells = rows.iter().map(|row| columns.iter().map(|column| format_cell(row.get(*column))).collect());
    let lines: Vec<Vec<String>> = std::iter::once(header).chain(cells).collect();
    print(&text_columns(&lines, |_| true));
}

fn format_cell(value: Option<&Value>) -> String {
    match value {
        None | Some(Value::Null) => "-".to_owned(),
        Some(Value::String(text)) => text.clone(),
        Some(Value::Number(number)) => number.as_f64().map_or(number.to_string(), |x| {
            format!("{x:.5}").trim_end_matches('0').trim_end_matches('.').to_owned()
        }),
        Some(other) => other.to_string(),
    }
}
