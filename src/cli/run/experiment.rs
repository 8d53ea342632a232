//! Run of an experiment: its points on threads, its rows in the order of the points, its files at the end.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use serde::Serialize;
use serde_json::Value;

use crate::{
    error::CliError,
    output::{Progress, eprint_notice, print, text_columns},
    run::{config::RunConfig, run_manifest},
};
use softvt_benchmark::Plan;
use softvt_common::cancel;
use softvt_common::{
    files::{self, replace},
    parallel,
    text::counted,
};
use softvt_report::run_folder::{RUN, RunFolder};
use softvt_script::{Experiment, ExperimentInput, ExperimentRow, LoadedScript, OptionSpec};

/// The rows of an experiment, one JSON object per line.
const ROWS: &str = "rows.jsonl";

/// `run.json` of an experiment.
#[derive(Serialize)]
struct ExperimentManifest<'a> {
    /// Version of softvt.
    softvt: &'a str,
    script: &'a str,
    experiment: &'a str,
    points: usize,
    seed: u64,
    /// Values of all options of the script.
    options: BTreeMap<String, String>,
    /// Options of the script as they were typed.
    arguments: &'a [String],
    /// Arguments of `--set`: the settings that are not those of the script.
    set: &'a [(String, String)],
    /// SHA-256 of files by name.
    sources: BTreeMap<String, String>,
}

/// Runs all points of the experiment that a script returned, and prints its rows. With `--out` the rows and the files of
/// the script are written into that folder.
///
/// # Errors
/// The script fails or tells a problem, a setting or the seed changes nothing, or a file cannot be written.
pub(crate) fn run(config: &RunConfig, loaded: &LoadedScript) -> Result<(), CliError> {
    let Plan::Experiment { name, points, columns, has_finish } = &loaded.plan else {
        return Err(config.error("the script returned no experiment"));
    };
    let (points, out) = (*points, config.flags.out.as_deref());
    if let Some(dir) = out {
        RunFolder::check_new(dir).map_err(|error| config.error(error))?;
    }
    let input = ExperimentInput::new(config.settings.clone(), config.script.seed);
    let input = Arc::new(input.map_err(|error| config.error(error))?);
    if *has_finish && out.is_none() {
        refuse_changed_project_files(config, loaded)?;
    }
    // Opening an experiment runs the whole script, so each thread takes an idle one before it opens another.
    let idle: Mutex<Vec<Experiment>> = Mutex::default();
    let take = || match parallel::lock(&idle).pop() {
        Some(experiment) => Ok(experiment),
        None => Experiment::open_with(loaded, &input),
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
        print_rows(config, &rows, columns)?;
        return Err(CliError::interrupted(format!(
            "interrupted; the rows of {done} of {points} points are above; no file was written"
        )));
    }
    outcome?;
    input.check_used().map_err(|error| config.error(error))?;
    // The rows are kept if finish fails.
    print_rows(config, &rows, columns)?;
    if let Some(dir) = out {
        files::write_json_lines(&dir.join(ROWS), &rows)?;
    }
    let finish = take()?.finish(&rows)?;
    if let Some(text) = finish.text.filter(|_| !config.flags.json) {
        print(&format!("{text}\n"))?;
    }
    let base = out.map(Path::to_owned).unwrap_or_default();
    if let Some((reserved, _)) =
        finish.files.iter().find(|(path, _)| out.is_some() && [RUN, ROWS].contains(&path.as_str()))
    {
        return Err(config.error(format!("finish.files: {reserved} is written by softvt; give another path")));
    }
    finish.files.iter().try_for_each(|(relative, bytes)| write(&base, relative, bytes))?;
    let outcome = finish.problem.map_or(Ok(()), |problem| Err(config.error(problem)));
    let Some(dir) = out else { return outcome };
    let options = loaded.options.iter();
    let manifest = ExperimentManifest {
        softvt: env!("CARGO_PKG_VERSION"),
        script: &loaded.sources.main,
        experiment: name,
        points,
        seed: config.script.seed,
        options: options.map(|option| (option.name.clone(), format!("{:?}", option.value))).collect(),
        arguments: &config.script.options,
        set: &config.settings,
        sources: loaded.sources.bundle.hashes(),
    };
    run_manifest::write_new(dir, &manifest)?;
    outcome
}

/// Refuses to write files into the project that were made with changed settings, another seed or an option that says so:
/// they would be taken for the nominal ones, such as the calibration of an asset.
fn refuse_changed_project_files(config: &RunConfig, loaded: &LoadedScript) -> Result<(), CliError> {
    let setting = config.settings.first().map(|(path, _)| format!("--set {path}"));
    let seed = || (config.script.seed != 0).then(|| "--seed".to_owned());
    let changed = |option: &&OptionSpec| option.needs_out && option.value != option.default;
    let option = || loaded.options.iter().find(changed).map(|o| format!("{} {}", o.flag(), o.value));
    let Some(flag) = setting.or_else(seed).or_else(option) else { return Ok(()) };
    Err(config.error(format!(
        "{flag}: give --out DIR: this experiment can write files, and those made with it must not replace the files of \
         the project"
    )))
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
///
/// # Errors
/// As [`print`].
fn print_rows(config: &RunConfig, rows: &[ExperimentRow], columns: &[String]) -> Result<(), CliError> {
    if config.flags.json {
        return rows.iter().try_for_each(|row| print(&format!("{}\n", serde_json::json!(row))));
    }
    if rows.is_empty() {
        return Ok(());
    }
    let all: BTreeSet<&String> = rows.iter().flat_map(|row| row.keys()).collect();
    let columns: Vec<&String> =
        if columns.is_empty() { all.into_iter().collect() } else { columns.iter().collect() };
    let header = columns.iter().map(ToString::to_string).collect();
    let cells = rows.iter().map(|row| columns.iter().map(|column| format_cell(row.get(*column))).collect());
    let lines: Vec<Vec<String>> = std::iter::once(header).chain(cells).collect();
    print(&text_columns(&lines, |_| true))
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
