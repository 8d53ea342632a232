//! `softvt watch`: episodes on a local web page.

use std::{
    path::PathBuf,
    sync::{Arc, atomic::Ordering},
};

use clap::Args;

use crate::{
    QUIET_INTERRUPT,
    args::{PolicyArgs, ScriptArgs, load_one_run, parse_count, parse_folder, select_one_task},
    error::CliError,
    output::Console,
};
use softvt_common::{episode_id::EpisodeSplit, text::hex};
use softvt_runner::{
    ConfiguredScript, Observer, RunConfig, replay::recorded_config, stored_folder::enter_for_run,
    suite_selection::suites_of,
};
use softvt_runs::stored_run::StoredRun;
use softvt_watch::{Program, Selection, Watch};

/// Show episodes on a local web page, while they are simulated and afterwards
///
/// The page has the scene to look around in, both tactile pictures, and what the judge measures. A script that is
/// saved again starts anew. With a run folder, the page shows its episodes by their recorded actions.
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt watch [OPTIONS] <FILE.lua|RUN>")]
pub(crate) struct WatchArgs {
    #[command(flatten)]
    pub(super) script: ScriptArgs,
    #[command(flatten)]
    policy: PolicyArgs,
    /// The first task: its index or part of its prompt
    #[arg(long, value_name = "TASK", default_value = "0")]
    task: String,
    /// The first episode of the task
    #[arg(long, value_name = "N", default_value = "0")]
    episode: u32,
    /// Port of the page; 0 for any free port
    #[arg(long, value_name = "PORT", default_value = "0")]
    port: u16,
    /// Record the episodes that are driven from the page in a run folder: docs/watch.md
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    out: Option<PathBuf>,
    /// Episodes per task of the run in --out [default: set by the suite]
    #[arg(long, value_name = "N", requires = "out", value_parser = parse_count::<u32>)]
    episodes: Option<u32>,
}

/// Serves the page until the process is interrupted.
pub(super) fn run(args: WatchArgs) -> Result<(), CliError> {
    let file = &args.script.file;
    if !file.exists() && file.extension().is_none_or(|extension| extension != "lua") {
        let message = "no such file or folder; give a Lua file or a run folder";
        return Err(CliError::input(message).prefixed(file.display()));
    }
    let program = match file.is_dir() {
        true => recorded_program(&args)?,
        false => script_program(&args)?,
    };
    let watch = Watch::listen(args.port, token()?).map_err(|error| {
        CliError::input(format_args!("--port {}: {error}; choose another, or 0 for any free port", args.port))
    })?;
    out!("{}\n", watch.url())?;
    QUIET_INTERRUPT.store(true, Ordering::Relaxed);
    watch.run(program);
    Err(CliError::interrupted(""))
}

fn script_program(args: &WatchArgs) -> Result<Program, CliError> {
    let run = args.script.clone().config()?.load()?.with_policy(&args.policy.options())?;
    let ConfiguredScript { config, script } = run;
    let [suite, ..] = suites_of(&script.plan) else {
        let message = "it has no suite to watch; name a file that returns softvt.suite or a list of suites";
        return Err(config.error(message).into());
    };
    let chosen = RunConfig { tasks: vec![args.task.clone()], ..config.clone() };
    let task = select_one_task(&chosen, suite)?;
    let selection =
        Selection { suite: suite.name.clone(), task: task.id, episode: args.episode, ..Selection::default() };
    let config =
        RunConfig { out: args.out.clone(), resume: args.out.is_some(), episodes: args.episodes, ..config };
    Ok(Program { config, selection, split: EpisodeSplit::Validation })
}

/// The program of a stored run, whose actions are repeated.
fn recorded_program(args: &WatchArgs) -> Result<Program, CliError> {
    let dir = &args.script.file;
    let user = format!("the run {}", dir.display());
    let given = RunConfig { out: args.out.clone(), episodes: args.episodes, ..args.script.clone().config()? };
    given.check_read(&RunConfig::of(dir), &user)?;
    given.check_no_policy(&args.policy.options(), &user)?;
    let stored = load_one_run(dir)?;
    let observer: Arc<dyn Observer> = Arc::new(Console::default());
    let stored = StoredRun { dir: enter_for_run(&stored, &*observer)?, ..stored };
    let config = recorded_config(&stored, None, observer)?;
    let task = match args.task.parse() {
        Ok(task) => task,
        Err(_) => return Err(CliError::input("--task: expected the index of a task of the run")),
    };
    let episodes = || stored.records.iter().map(|record| &record.header.id).filter(|id| id.task == task);
    if !episodes().any(|id| id.episode == args.episode) {
        let recorded: Vec<String> = episodes().map(|id| id.episode.to_string()).collect();
        let message = match recorded.is_empty() {
            true => format!("the run has no episode of task {task}"),
            false => format!(
                "the run has no episode {} of task {task}; it has {}",
                args.episode,
                recorded.join(", ")
            ),
        };
        return Err(CliError::input(message).prefixed(dir.display()));
    }
    let suite = stored.manifest.suite.clone();
    let selection = Selection { suite, task, episode: args.episode, ..Selection::default() };
    Ok(Program { config, selection, split: stored.manifest.split })
}

fn token() -> Result<String, CliError> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes)
        .map_err(|error| CliError::input(format_args!("no random numbers: {error}")))?;
    Ok(hex(&bytes))
}
