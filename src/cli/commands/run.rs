//! `softvt FILE.lua`: the plan of a script.

use std::path::Path;

use clap::Parser;

use crate::{
    args::{PolicyArgs, Request, RunFlags, ScriptArgs},
    error::{CliError, Exit},
    output::{eprint_notice, print, print_json},
    plan_flags,
};
use softvt_benchmark::Plan;
use softvt_policy::profile::Profile;
use softvt_records::{requirement::Requirement, summary::SuiteSummary};
use softvt_report::{
    condition_table::{ConditionTable, compares_policies, controllers_table, table},
    terminal,
};
use softvt_runner::{
    ConfiguredScript, Runner, SuiteResult, conditions,
    experiment::{self, ExperimentOutput},
    selection::{check_distinct_out_dirs, check_parent_folder, next_run_dir},
};
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
///
/// # Errors
/// The script, a flag, the folder or the policy is not valid, or an episode fails.
pub(super) fn run(args: RunArgs) -> Result<(), CliError> {
    let (json, requirements) = (args.flags.json, args.flags.requirements.clone());
    let request = Request::new(args.script)?.with(|config| args.flags.apply(config));
    let run = request.load_plan(plan_flags::RUN, &args.policy)?;
    let ConfiguredScript { config, script: loaded } = &run;
    if let Some(code) = config.policy.gripper {
        let profile = config.policy.profile().map(|Profile { name, .. }| format!(" (profile {name})"));
        eprint_notice(format!("gripper: {}{}", code.name(), profile.unwrap_or_default()));
    }
    match &loaded.plan {
        plan @ (Plan::Suite(_) | Plan::Suites { .. }) => {
            let is_list = matches!(plan, Plan::Suites { .. });
            let results = Runner::new(&run).numbered().run(|_| ())?;
            let failed = results.iter().find_map(SuiteResult::refusal_of_all_actions);
            let summaries: Vec<SuiteSummary> = results.into_iter().map(|result| result.summary).collect();
            match &summaries[..] {
                [summary] if json && !is_list => print_json(summary),
                summaries if json => print_json(&summaries),
                summaries => summaries.iter().try_for_each(|summary| print(&terminal::table(summary))),
            }?;
            match failed {
                Some(message) => Err(CliError::new(Exit::Policy, message)),
                None => check_requirements(&requirements, &summaries),
            }
        }
        Plan::Conditions { name, suites, .. } => {
            check_distinct_out_dirs(config, suites)?;
            check_parent_folder(config)?;
            let out = config.out.clone().unwrap_or_else(|| next_run_dir(config, name));
            run_conditions(&run, suites.len(), &out, json)
        }
        Plan::Experiment { columns, .. } => experiment::run(&run, |output| -> Result<(), CliError> {
            match output {
                ExperimentOutput::Rows(rows) => print_rows(rows, columns, json),
                ExperimentOutput::Text(_) if json => Ok(()),
                ExperimentOutput::Text(text) => print(&format!("{text}\n")),
            }
        }),
    }
}

/// Runs suites under conditions and prints their tables: policies side by side once all have run, other conditions
/// after each suite.
fn run_conditions(run: &ConfiguredScript, suites: usize, out: &Path, json: bool) -> Result<(), CliError> {
    let print_last = |tables: &[ConditionTable]| -> Result<(), CliError> {
        match tables.last() {
            _ if json => Ok(()),
            Some(last) if !compares_policies(tables) => print(&table(last)),
            Some(_) if tables.len() == suites => print(&controllers_table(tables)),
            _ => Ok(()),
        }
    };
    let tables = conditions::run(run, out, print_last)?;
    if json {
        print_json(&conditions::document(run, &tables))?;
    }
    eprint_notice(out.join(conditions::FILE).display());
    Ok(())
}

/// Checks all requirements on all suites.
///
/// # Errors
/// The requirements that are not met.
fn check_requirements(requirements: &[Requirement], summaries: &[SuiteSummary]) -> Result<(), CliError> {
    let of_suite = |summary| requirements.iter().filter_map(move |requirement| requirement.unmet(summary));
    let unmet: Vec<String> = summaries.iter().flat_map(of_suite).collect();
    if unmet.is_empty() { Ok(()) } else { Err(CliError::new(Exit::RequirementNotMet, unmet.join("\n"))) }
}

/// Prints rows as JSON lines or as a table.
///
/// # Errors
/// As [`print`].
fn print_rows(rows: &[ExperimentRow], columns: &[String], json: bool) -> Result<(), CliError> {
    match json {
        true => rows.iter().try_for_each(|row| print(&format!("{}\n", serde_json::json!(row)))),
        false => print(&experiment::table(rows, columns)),
    }
}
