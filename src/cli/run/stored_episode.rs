//! Re-simulation of an episode of a stored run by its recorded actions.

use std::path::PathBuf;

use serde_json::{Value, json};

use crate::{
    benchmark::{Plan, Suite},
    cli::{
        error::CliError,
        run::{
            config::RunConfig,
            policy::PolicyConfig,
            resimulate::{replay_factory, with_policy_fields},
            selection::{EpisodeJob, select_tasks},
            suite_run::SuiteRun,
        },
    },
    evaluation::{episode_id::Split, record::EpisodeRecord},
    policy::Action,
    report::stored_run::StoredRun,
    script,
};

/// Simulates an episode of a stored run again. The policy fields of the result are copied from `record`.
///
/// # Errors
/// The scripts have changed since, or the episode cannot be run.
pub(crate) fn simulate(
    stored: &StoredRun,
    record: &EpisodeRecord,
    recorded: Vec<Action>,
) -> Result<EpisodeRecord, CliError> {
    let index = record.header.id.index();
    let config = RunConfig { tasks: vec![index.task.to_string()], ..stored_config(stored)? };
    let loaded = script::load(&config.file, &config.script_options).map_err(CliError::input)?;
    let suite = stored_suite(&loaded.plan, &config, stored)?;
    let tasks = select_tasks(&config, suite)?;
    let job = EpisodeJob { task: tasks[0], episode: index.episode };
    let mut run = SuiteRun::new(&config, &loaded, suite, vec![job], PathBuf::new())?;
    run.split = stored_split(stored)?;
    run.controllers = replay_factory(recorded, record);
    run.origins.extend(record.header.origin.iter().map(|origin| (index, (**origin).clone())));
    run.prepare(&tasks)?;
    check_sources(stored, &run)?;
    Ok(with_policy_fields(run.run_episode(job, false, &run.controllers)?.record, record))
}

fn stored_split(stored: &StoredRun) -> Result<Split, CliError> {
    let name = stored.text("split");
    name.parse().map_err(|_| CliError::input(format!("{}: unknown split {name:?}", stored.dir.display())))
}

/// The configuration of a stored run, with a policy whose actions come from elsewhere.
fn stored_config(stored: &StoredRun) -> Result<RunConfig, CliError> {
    let info = &stored.manifest;
    let missing = |field: &str| {
        let dir = stored.dir.display();
        CliError::input(format!("{dir}/run.json has no valid field {field:?}; it is of another version"))
    };
    let texts = |value: &Value| -> Option<Vec<String>> {
        value.as_array()?.iter().map(|text| text.as_str().map(str::to_owned)).collect()
    };
    let settings = info["set"].as_array().and_then(|pairs| {
        pairs.iter().map(|pair| texts(pair)?.try_into().ok().map(|[a, b]: [String; 2]| (a, b))).collect()
    });
    let shifts = serde_json::from_value(info["shifts"].clone()).ok();
    Ok(RunConfig {
        script_options: texts(&info["arguments"]).ok_or_else(|| missing("arguments"))?,
        seed: info["seed"].as_u64().ok_or_else(|| missing("seed"))?,
        is_rigid_twin: info["twin"].is_string(),
        settings: settings.ok_or_else(|| missing("set"))?,
        shifts: shifts.ok_or_else(|| missing("shifts"))?,
        ..RunConfig::new(PathBuf::from(stored.text("script")), PolicyConfig::external("replay"))
    })
}

fn stored_suite<'a>(plan: &'a Plan, config: &RunConfig, stored: &StoredRun) -> Result<&'a Suite, CliError> {
    let suites: Vec<&Suite> = match plan {
        Plan::Suite(suite) => vec![suite],
        Plan::Suites { suites } => suites.iter().collect(),
        Plan::Conditions { .. } | Plan::Experiment { .. } => Vec::new(),
    };
    let name = stored.text("suite");
    let suite = suites.into_iter().find(|suite| suite.name == name);
    suite.ok_or_else(|| CliError::input(format!("{} no longer has a suite {name:?}", config.file.display())))
}

/// Checks that scripts and thresholds are those of the stored run.
fn check_sources(stored: &StoredRun, run: &SuiteRun) -> Result<(), CliError> {
    let now = json!(run.sources);
    let before = stored.manifest["sources"].as_object().into_iter().flatten();
    let changed: Vec<&str> = before
        .filter(|(name, hash)| now.get(name.as_str()).is_some_and(|current| current != *hash))
        .map(|(name, _)| name.as_str())
        .collect();
    if changed.is_empty() {
        return Ok(());
    }
    Err(CliError::input(format!(
        "{}: {} changed since the run; restore the earlier version, or run again",
        stored.dir.display(),
        changed.join(", ")
    )))
}
