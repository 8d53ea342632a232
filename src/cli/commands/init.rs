//! `softvt init`: editor stubs for a folder of scripts, and a suite to start from.

use std::path::{Path, PathBuf};

use crate::{
    cli::{error::CliError, output::print, run::calibration::make_folder},
    files::replace,
    script::{
        embedded,
        stubs::{LUARC, STUB_FILE, stubs},
    },
};

/// A suite and its object to start from: where they go, and where they are in the library.
const TEMPLATE: [(&str, &str); 2] = [
    ("suites/my_suite.lua", "scripts/templates/my_suite.lua"),
    ("assets/my_object.lua", "scripts/templates/my_object.lua"),
];

/// Writes the stubs and the language server's settings into `dir`; an own `.luarc.json` is left alone.
///
/// # Errors
/// A file cannot be written.
pub(crate) fn run(dir: &Path) -> Result<(), CliError> {
    let stub = dir.join(STUB_FILE);
    write(&stub, stubs().as_bytes())?;
    let settings = dir.join(".luarc.json");
    if settings.exists() {
        print(&format!("left {} as it is\n", settings.display()));
        return Ok(());
    }
    write(&settings, LUARC.as_bytes())
}

/// Writes a commented suite of one task and its object into `dir`, with what [`run`] writes.
///
/// # Errors
/// One of them is there already, or cannot be written; nothing is written then.
pub(crate) fn task(dir: &Path) -> Result<(), CliError> {
    let files: Vec<(PathBuf, &[u8])> =
        TEMPLATE.iter().filter_map(|(path, from)| Some((dir.join(path), embedded(from)?))).collect();
    if let Some((there, _)) = files.iter().find(|(path, _)| path.exists()) {
        let message = format!("{} is there already; rename it, or give another folder", there.display());
        return Err(CliError::input(message));
    }
    files.iter().try_for_each(|(path, text)| write(path, text))?;
    run(dir)?;
    let suite = dir.join(TEMPLATE[0].0);
    let suite = suite.strip_prefix(".").unwrap_or(&suite).display();
    print(&format!("now: softvt check {suite}, softvt {suite}; docs/write-a-task.md goes on from there\n"));
    Ok(())
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    make_folder(path.parent().unwrap_or(Path::new(".")))?;
    replace(path, bytes).map_err(CliError::input)?;
    print(&format!("wrote {}\n", path.display()));
    Ok(())
}
