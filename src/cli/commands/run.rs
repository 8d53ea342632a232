//! `softvt FILE.lua`: the plan of a script.

use std::path::{Path, PathBuf};

use clap::Parser;

use crate::{
    args::{PolicyArgs, RunFlags, ScriptArgs},
    error::{CliError, Exit},
    output::{print, print_json, print_table, terminal_format},
};
use softvt_benchmark::Plan;
use softvt_policy::profile::Profile;
use softvt_report::{
    commands::next_commands,
    condition_table::{ConditionTable, compares_policies, controllers_table, table},
    styled_text::TerminalFormat,
    terminal,
};
use softvt_runner::{
    ConfiguredScript, RunConfig, SuiteResult, conditions,
    experiment::{self, ExperimentOutput},
    plan_noun, run_suites,
    suite_selection::{check_folders, next_run_dir},
};
use softvt_runs::{stored_run, summary::SuiteSummary};
use softvt_script::ExperimentRow;

/// A safety-aware visuo-tactile manipulation benchmark for soft objects, on an ordinary CPU
#[derive(Clone, Debug, Parser)]
#[command(
    name = "softvt",
    version,
    override_usage = "softvt [OPTIONS] <FILE.lua>\n       softvt <COMMAND>",
    subcommand_negates_reqs = true,
    args_conflicts_with_subcommands = true,
    after_help = "softvt FILE.lua --help also lists the options of that script. docs/cli.md is the reference.\n\
                  Exit codes: 0 success, 1 internal error (bug), 2 invalid input, 3 policy or connection failed, \
                  99 --require not met, 130 interrupted."
)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub script: ScriptArgs,
    #[command(flatten)]
    policy: PolicyArgs,
    #[command(flatten)]
    flags: RunFlags,
}

/// Runs the plan of a script: suites, conditions or an experiment.
pub(super) fn run(args: RunArgs) -> Result<(), CliError> {
    let (json, requirements) = (args.flags.json, args.flags.requirements.clone());
    let details = args.flags.details;
    let format = terminal_format(details);
    let config = RunConfig { is_numbered: true, ..args.flags.apply(args.script.config()?) };
    let run = config.load()?.with_policy(&args.policy.options())?;
    let ConfiguredScript { config, script: loaded } = &run;
    if !(requirements.is_empty() || matches!(loaded.plan, Plan::Suite(_) | Plan::Suites { .. })) {
        return Err(config.no_effect("requirements", plan_noun(&loaded.plan)).into());
    }
    if let Some(code) = config.policy.gripper {
        let profile = config.policy.profile().map(|Profile { name, .. }| format!(" (profile {name})"));
        notice!("gripper: {}{}", code.name(), profile.unwrap_or_default());
    }
    match &loaded.plan {
        plan @ (Plan::Suite(_) | Plan::Suites { .. }) => {
            let is_list = matches!(plan, Plan::Suites { .. });
            let results = run_suites(&run, |_| ())?;
            let failed = results.iter().find_map(SuiteResult::refusal_of_all_actions);
            let folders: Vec<PathBuf> = results.iter().filter_map(|result| result.folder.clone()).collect();
            let summaries: Vec<SuiteSummary> = results.into_iter().map(|result| result.summary).collect();
            match &summaries[..] {
                [summary] if json && !is_list => print_json(summary),
                summaries if json => print_json(&summaries),
                summaries => {
                    summaries
                        .iter()
                        .try_for_each(|summary| print_table(&terminal::table(summary, format)))?;
                    print_next_commands(&folders);
                    Ok(())
                }
            }?;
            if let Some(message) = failed {
                return Err(CliError::new(Exit::Policy, message));
            }
            let of_suite =
                |summary| requirements.iter().filter_map(move |requirement| requirement.unmet(summary));
            match summaries.iter().flat_map(of_suite).collect::<Vec<String>>() {
                unmet if unmet.is_empty() => Ok(()),
                unmet => Err(CliError::new(Exit::RequirementNotMet, unmet.join("\n"))),
            }
        }
        Plan::Conditions { name, suites, .. } => {
            check_folders(config, &loaded.plan)?;
            let out = config.out.clone().unwrap_or_else(|| next_run_dir(config, name));
            run_conditions(&run, suites.len(), &out, (!json).then_some(format))
        }
        Plan::Experiment { columns, .. } => experiment::run(&run, |output| -> Result<(), CliError> {
            match output {
                ExperimentOutput::Rows(rows) if json => {
                    rows.iter().try_for_each(|row| out!("{}\n", serde_json::json!(row)))
                }
                ExperimentOutput::Rows(rows) => print_rows(rows, columns, details),
                ExperimentOutput::Text(_) if json => Ok(()),
                ExperimentOutput::Text(text) => out!("{text}\n"),
            }
        }),
    }
}

/// Says on standard error what to do next: the report of the runs, and a view of the worst episode of the first
/// run that has one.
fn print_next_commands(folders: &[PathBuf]) {
    let Some(parent) = folders.first().and_then(|folder| folder.parent()) else { return };
    let mut runs = folders.iter().filter_map(|folder| stored_run::load(folder).ok()).flatten().peekable();
    let Some(commands) = runs.peek().map(next_commands) else { return };
    match folders {
        [_] => notice!("next: {}", commands[0]),
        _ => notice!("next: softvt report {}", parent.display()),
    }
    if let Some(view) = runs.find_map(|run| next_commands(&run).into_iter().nth(1)) {
        notice!("next: {view}");
    }
}

/// Runs suites under conditions and prints their tables, or JSON without a format. Policies are side by side once all
/// have run, other conditions after each suite.
fn run_conditions(
    run: &ConfiguredScript,
    suites: usize,
    out: &Path,
    format: Option<TerminalFormat>,
) -> Result<(), CliError> {
    let print_last = |tables: &[ConditionTable]| -> Result<(), CliError> {
        let Some(format) = format else { return Ok(()) };
        match tables.last() {
            Some(last) if !compares_policies(tables) => print_table(&table(last, format)),
            Some(_) if tables.len() == suites => print_table(&controllers_table(tables, format)),
            _ => Ok(()),
        }
    };
    let tables = conditions::run(run, out, print_last)?;
    if format.is_none() {
        print_json(&conditions::document(run, &tables))?;
    }
    notice!("{}", out.join(conditions::FILE).display());
    Ok(())
}

/// Largest number of rows that are printed without `--details`.
const SHORT_TABLE: usize = 40;

/// Prints rows as a table, unless it is long and the details are not asked for.
fn print_rows(rows: &[ExperimentRow], columns: &[String], details: bool) -> Result<(), CliError> {
    if rows.len() > SHORT_TABLE && !details {
        notice!("{} rows: --details prints them, --out DIR writes them", rows.len());
        return Ok(());
    }
    print(experiment::table(rows, columns))
}
