//! `softvt serve`: episodes of suites for clients to drive.

use crate::cli::run::config::RunConfig;
use std::{io::ErrorKind, path::PathBuf};

use serde_json::json;

use crate::{
    benchmark::{Plan, Suite},
    cli::{
        args::Serve,
        error::CliError,
        output::print,
        run::{policy::PolicyConfig, suite_run::SuiteRun},
    },
    policy::Observation,
    rollout::cancel,
    script::{self, EpisodeRequest, Loaded},
    serve::{self, EpisodeId, ServedSuite, Server, ServerConfig},
};

/// Serves the suites of a script until the end is asked for.
///
/// # Errors
/// The script has no suite, its first episode cannot be shown, the address cannot be had; at the end, that it was asked for.
pub(crate) fn run(serve: &Serve) -> Result<(), CliError> {
    let loaded = script::load(&serve.run.file, &serve.run.script_words).map_err(CliError::input)?;
    let suites = suites_of(serve, &loaded)?;
    let run = RunConfig { policy: PolicyConfig::client(), ..serve.run.clone() };
    let door = open(serve)?;
    let batches = batches(serve, &run, &loaded, &suites)?;
    let offer = offer(serve, &loaded, &suites, &batches);
    let hello = serve::hello(&offer, &first_look(serve, &offer)?);
    let address = door.address().map_err(|e| CliError::input(format!("{}: {e}", serve.host)))?;
    print(&format!("ws://{address}\n"));
    serve::serve(&door, &offer, hello, serve.seats, &cancel::FLAG);
    Err(CliError::interrupted("interrupted"))
}

fn suites_of<'a>(serve: &Serve, loaded: &'a Loaded) -> Result<Vec<&'a Suite>, CliError> {
    let suites: Vec<&Suite> = match &loaded.plan {
        Plan::Suite(suite) => vec![suite],
        Plan::Suites { suites } => suites.iter().collect(),
        _ => Vec::new(),
    };
    if suites.iter().any(|suite| !suite.tasks.is_empty()) {
        return Ok(suites);
    }
    let file = serve.run.file.display();
    let message = format!(
        "{file}: softvt serve serves suites, and this is none; name a file that returns softvt.suite"
    );
    Err(CliError::input(message))
}

fn open(serve: &Serve) -> Result<Server, CliError> {
    let Serve { host, port, .. } = serve;
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    Server::open(bare, *port).map_err(|error| {
        CliError::input(match error.kind() {
            ErrorKind::AddrInUse => {
                format!("--port {port}: somebody listens at {host} there already; name another, or 0 for a free one")
            }
            ErrorKind::PermissionDenied => {
                format!("--port {port}: the system keeps it for itself; name one above 1023")
            }
            _ => format!("--host {host}: cannot listen there: {error}"),
        })
    })
}

/// What is needed to start the episodes of each suite.
fn batches<'a>(
    serve: &Serve,
    run: &'a RunConfig,
    loaded: &'a Loaded,
    suites: &[&'a Suite],
) -> Result<Vec<SuiteRun<'a>>, CliError> {
    let mut batches: Vec<SuiteRun<'a>> = Vec::new();
    for suite in suites {
        let mut batch = SuiteRun::new(run, loaded, suite, (Vec::new(), PathBuf::new()))?;
        // Nobody else is told the limits.
        if serve.privileged {
            batch.learn_limits(&suite.tasks)?;
        }
        batches.push(batch);
    }
    Ok(batches)
}

fn offer<'a>(
    serve: &'a Serve,
    loaded: &Loaded,
    suites: &[&'a Suite],
    batches: &'a [SuiteRun<'a>],
) -> ServerConfig<'a> {
    let run = &serve.run;
    let all: Vec<ServedSuite> =
        suites.iter().map(|suite| ServedSuite { name: run.name_of(suite), suite }).collect();
    let open = move |wanted: &EpisodeId| {
        let found = batches.iter().find(|batch| run.name_of(batch.suite) == wanted.suite);
        let batch = found.ok_or_else(|| format!("suite {:?}: there is none", wanted.suite))?;
        let task = batch.suite.tasks.iter().find(|task| task.id == wanted.task);
        let task = task.ok_or_else(|| format!("task {}: there is none", wanted.task))?;
        let request = EpisodeRequest {
            suite: batch.suite.name.clone(),
            task: wanted.task,
            episode: u64::from(wanted.episode),
            base_seed: wanted.seed,
            split: wanted.split,
            shifts: run.shifts.clone(),
        };
        batch.begin(task, &request).map_err(|failure| failure.message)
    };
    ServerConfig {
        suites: all,
        profile: serve.profile.clone(),
        privileged: serve.privileged,
        seed: run.seed,
        split: serve.split,
        made_by: made_by(run, loaded),
        open: Box::new(open),
    }
}

/// All that decides how an episode goes, but which it is and what is done in it.
fn made_by(run: &RunConfig, loaded: &Loaded) -> String {
    let all = json!([
        env!("CARGO_PKG_VERSION"),
        loaded.bundle.hashes(),
        run.script_words,
        run.shifts,
        run.set,
        run.twin
    ]);
    script::sha256(all.to_string().as_bytes())
}

/// What a client sees at the start of the first episode: what is wrong with a scene or its senses is told before anyone comes.
fn first_look(serve: &Serve, offer: &ServerConfig) -> Result<Observation, CliError> {
    let first = offer.suites.iter().find_map(|one| Some((one, one.suite.tasks.first()?)));
    let (one, task) = first.ok_or_else(|| CliError::input("there is no task to serve"))?;
    let (seed, split) = (serve.run.seed, serve.split);
    let wanted = EpisodeId { suite: one.name.clone(), task: task.id, episode: 0, seed, split };
    let mut episode = (offer.open)(&wanted).map_err(CliError::input)?;
    let streams = offer.profile.streams();
    episode.begin(streams.clone());
    episode.observe(&streams).map_err(|e| CliError::input(format!("{}: {e}", serve.run.file.display())))
}
