//! `softvt init`: editor stubs for a folder of scripts, and a project skeleton.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use crate::error::CliError;
use softvt_common::files;
use softvt_script::{
    embedded,
    stubs::{LUARC, STUB_FILE, stubs},
};

/// Write editor stubs for Lua scripts; `init task` creates a project skeleton
#[derive(Args, Debug)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct InitArgs {
    /// Folder to write to
    #[arg(default_value = ".")]
    dir: PathBuf,
    #[command(subcommand)]
    command: Option<InitCommand>,
}

#[derive(Debug, Subcommand)]
enum InitCommand {
    /// Create a project skeleton: a commented suite, its object and the editor stubs
    Task {
        /// Folder to write to
        #[arg(default_value = ".")]
        dir: PathBuf,
    },
}

struct TemplateFile {
    path: &'static str,
    /// Its source in the embedded library.
    source: &'static str,
}

const SUITE: TemplateFile =
    TemplateFile { path: "suites/my_suite.lua", source: "scripts/templates/my_suite.lua" };
const OBJECT: TemplateFile =
    TemplateFile { path: "assets/my_object.lua", source: "scripts/templates/my_object.lua" };

pub(super) fn run(args: &InitArgs) -> Result<(), CliError> {
    match &args.command {
        None => write_stubs(&args.dir),
        Some(InitCommand::Task { dir }) => write_skeleton(dir),
    }
}

/// Writes the stubs, and the settings of the Lua language server unless there are some.
fn write_stubs(dir: &Path) -> Result<(), CliError> {
    write(&dir.join(STUB_FILE), stubs().as_bytes())?;
    let settings = dir.join(".luarc.json");
    if settings.exists() {
        return out!("kept {}\n", settings.display());
    }
    write(&settings, LUARC.as_bytes())
}

/// Writes a commented suite with one task, its object and the stubs. Writes nothing if a file exists.
fn write_skeleton(dir: &Path) -> Result<(), CliError> {
    let template = [SUITE, OBJECT];
    let files: Vec<(PathBuf, &[u8])> =
        template.iter().filter_map(|file| Some((dir.join(file.path), embedded(file.source)?))).collect();
    if let Some((existing, _)) = files.iter().find(|(path, _)| path.exists()) {
        bail!("{} already exists; rename it, or select another folder", existing.display());
    }
    files.iter().try_for_each(|(path, text)| write(path, text))?;
    write_stubs(dir)?;
    let suite = dir.join(SUITE.path);
    let suite = suite.strip_prefix(".").unwrap_or(&suite).display();
    out!("now: softvt check {suite}, softvt {suite}; next: docs/write-a-task.md\n")
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    files::replace(path, bytes)?;
    out!("wrote {}\n", path.display())
}
