//! Running an experiment: points on threads, rows in the order of points, files at the end.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::Mutex,
};

use crate::{
    cli::{
        error::CliError,
        output::{Progress, print},
        run::calibration::make_folder,
        run::config::RunConfig,
    },
    files::replace,
    parallel,
    rollout::cancel,
    script::{Experiment, Loaded, Row},
};

/// Runs all points of an experiment and prints its rows.
///
/// # Errors
/// The script fails, or a file cannot be written.
pub(crate) fn run(
    run: &RunConfig,
    loaded: &Loaded,
    name: &str,
    points: usize,
    columns: &[String],
) -> Result<(), CliError> {
    // Machines are not shared between threads but used again: opening one runs the whole script.
    let idle: Mutex<Vec<Experiment>> = Mutex::default();
    let take = || idle.lock().unwrap_or_else(|p| p.into_inner()).pop();
    let mut rows: Vec<Vec<Row>> = vec![Vec::new(); points];
    let mut progress = Progress::new(points, name);
    let outcome = parallel::run(
        points,
        run.threads,
        cancel::requested,
        |point| {
            let machine = match take() {
                Some(machine) => machine,
                None => Experiment::open(loaded).map_err(CliError::input)?,
            };
            let rows = machine.run(point).map_err(CliError::input)?;
            // What was cut short may have caught its errors and gone on to a row that is not one.
            if cancel::requested() {
                return Err(CliError::interrupted("interrupted"));
            }
            idle.lock().unwrap_or_else(|p| p.into_inner()).push(machine);
            Ok(rows)
        },
        |point, found| {
            progress.tick(&format!("point {point}: {} rows", found.len()));
            rows[point] = found;
            Ok(())
        },
    );
    progress.finish();
    let done = rows.iter().filter(|rows| !rows.is_empty()).count();
    let rows: Vec<Row> = rows.into_iter().flatten().collect();
    if cancel::requested() {
        show(run, &rows, columns);
        let message =
            format!("interrupted; the rows of {done} of {points} points are above, no file was written");
        return Err(CliError::interrupted(message));
    }
    outcome?;
    let machine = match take() {
        Some(machine) => machine,
        None => Experiment::open(loaded).map_err(CliError::input)?,
    };
    let finish = machine.finish(&rows).map_err(CliError::input)?;
    show(run, &rows, columns);
    if let Some(text) = finish.text.filter(|_| !run.json) {
        print(&format!("{text}\n"));
    }
    let base = run.out.clone().unwrap_or_default();
    finish.files.iter().try_for_each(|(relative, bytes)| write(&base, relative, bytes))
}

/// Writes a file of the script under `base`; a link on its way could lead anywhere, so none is followed.
fn write(base: &Path, relative: &str, bytes: &[u8]) -> Result<(), CliError> {
    let path = &base.join(relative);
    let between = path.ancestors().skip(1).take_while(|folder| *folder != base);
    if let Some(link) = between.into_iter().find(|folder| folder.is_symlink()) {
        let message = format!(
            "{}: {} is a link; files are written into real folders only",
            path.display(),
            link.display()
        );
        return Err(CliError::input(message));
    }
    let folder = path.parent().map(PathBuf::from).unwrap_or_default();
    if !folder.as_os_str().is_empty() {
        make_folder(&folder)?;
    }
    replace(path, bytes).map_err(CliError::input)?;
    crate::text::eprint_line(&format!("softvt: wrote {}", path.display()));
    Ok(())
}

/// Rows as JSON lines or as a table.
fn show(run: &RunConfig, rows: &[Row], columns: &[String]) {
    if run.json {
        rows.iter().for_each(|row| print(&format!("{}\n", serde_json::json!(row))));
        return;
    }
    let all: BTreeSet<&String> = rows.iter().flat_map(|row| row.keys()).collect();
    let columns: Vec<&String> =
        if columns.is_empty() { all.into_iter().collect() } else { columns.iter().collect() };
    let cell = |row: &Row, column: &String| match row.get(column) {
        None | Some(serde_json::Value::Null) => "-".to_owned(),
        Some(serde_json::Value::String(text)) => text.clone(),
        Some(serde_json::Value::Number(n)) => n.as_f64().map_or(n.to_string(), |x| {
            format!("{x:.5}").trim_end_matches('0').trim_end_matches('.').to_owned()
        }),
        Some(other) => other.to_string(),
    };
    let width = |column: &String| {
        rows.iter().map(|row| cell(row, column).chars().count()).chain([column.len()]).max().unwrap_or(0)
    };
    let line = |cells: Vec<String>| {
        let padded: Vec<String> =
            cells.iter().zip(&columns).map(|(text, column)| format!("{text:>0$}", width(column))).collect();
        format!("{}\n", padded.join("  "))
    };
    if !rows.is_empty() {
        print(&line(columns.iter().map(|c| c.to_string()).collect()));
    }
    for row in rows {
        print(&line(columns.iter().map(|c| cell(row, c)).collect()));
    }
}
