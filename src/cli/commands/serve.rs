//! `softvt serve`: episodes of suites for external clients.

use std::{io::ErrorKind, path::PathBuf};

use serde_json::json;

use crate::{
    benchmark::{Plan, Suite},
    cli::{
        args::ServeArgs,
        error::CliError,
        output::print,
        run::{
            config::RunConfig,
            policy::{PolicyConfig, load_profile_of},
            suite_run::SuiteRun,
        },
    },
    evaluation::episode_id::EpisodeId,
    policy::Observation,
    rollout::cancel,
    script::{self, LoadedScript},
    serve::{self, RequestError, ServedSuite, Server, ServerConfig},
};

/// Serves the suites of a script until the process is interrupted.
///
/// # Errors
/// The script has no suite, its first episode cannot be rendered, or the address is not available; in
/// the end, the interrupt.
pub(crate) fn run(args: &ServeArgs) -> Result<(), CliError> {
    let config =
        RunConfig { policy: PolicyConfig::external("client"), ..RunConfig::of_script(&args.script)? };
    let (profile, _) = load_profile_of(&args.policy)?;
    let loaded = script::load(&config.file, &config.script_options).map_err(CliError::input)?;
    let suites = served_suites(&config, &loaded)?;
    let server = open_server(args)?;
    let runs = suite_runs(args, &config, &loaded, &suites)?;
    let served: Vec<ServedSuite> =
        suites.iter().map(|suite| ServedSuite { name: config.suite_name(suite), suite }).collect();
    let start_episode = |id: &EpisodeId| {
        let found = runs.iter().find(|run| run.name == id.suite);
        let run = found.ok_or_else(|| format!("unknown suite {:?}", id.suite))?;
        let task = run.suite.tasks.iter().find(|task| task.id == id.task);
        let task = task.ok_or_else(|| format!("unknown task {}", id.task))?;
        let id = EpisodeId { suite: run.suite.name.clone(), ..id.clone() };
        run.start_episode(task, &id).map_err(|error| RequestError(error.message))
    };
    let server_config = ServerConfig {
        suites: served,
        profile,
        privileged: args.privileged,
        seed: config.seed,
        split: args.split,
        fingerprint: provenance_hash(&config, &loaded),
        start_episode: Box::new(start_episode),
    };
    let hello = serve::hello(&server_config, &first_observation(&config, &server_config)?);
    let address = server.address().map_err(|error| CliError::input(error).prefixed(&args.host))?;
    print(&format!("ws://{address}\n"));
    serve::serve(&server, &server_config, hello, usize::from(args.threads), &cancel::FLAG);
    Err(CliError::interrupted("interrupted"))
}

fn served_suites<'a>(config: &RunConfig, loaded: &'a LoadedScript) -> Result<Vec<&'a Suite>, CliError> {
    let suites: Vec<&Suite> = match &loaded.plan {
        Plan::Suite(suite) => vec![suite],
        Plan::Suites { suites } => suites.iter().collect(),
        Plan::Conditions { .. } | Plan::Experiment { .. } => Vec::new(),
    };
    if suites.iter().any(|suite| !suite.tasks.is_empty()) {
        return Ok(suites);
    }
    Err(CliError::input(format!(
        "{}: softvt serve needs a suite or a list of suites; name a file that returns softvt.suite",
        config.file.display()
    )))
}

fn open_server(args: &ServeArgs) -> Result<Server, CliError> {
    let ServeArgs { host, port, .. } = args;
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    Server::open(bare, *port).map_err(|error| {
        CliError::input(match error.kind() {
            ErrorKind::AddrInUse => {
                format!("--port {port}: already in use at {host}; choose another, or 0 for any free port")
            }
            ErrorKind::PermissionDenied => {
                format!("--port {port}: reserved by the system; choose one above 1023")
            }
            _ => format!("--host {host}: cannot listen on this address: {error}"),
        })
    })
}

/// A run of each suite without episodes, from which episodes are started on request.
fn suite_runs<'a>(
    args: &ServeArgs,
    config: &'a RunConfig,
    loaded: &'a LoadedScript,
    suites: &[&'a Suite],
) -> Result<Vec<SuiteRun<'a>>, CliError> {
    let mut runs = Vec::new();
    for suite in suites.iter().copied() {
        let mut run = SuiteRun::new(config, loaded, suite, Vec::new(), PathBuf::new())?;
        // Only privileged clients receive the limits.
        if args.privileged {
            run.read_limits(&suite.tasks)?;
        }
        runs.push(run);
    }
    Ok(runs)
}

/// Hash of all that determines an episode, except its index and the actions of the client.
fn provenance_hash(config: &RunConfig, loaded: &LoadedScript) -> String {
    let all = json!([
        env!("CARGO_PKG_VERSION"),
        loaded.bundle.hashes(),
        config.script_options,
        config.shifts,
        config.settings,
        config.is_rigid_twin
    ]);
    script::sha256(all.to_string().as_bytes())
}

/// The first observation of the first episode. It reports invalid scenes and sensors before a client connects.
fn first_observation(config: &RunConfig, server: &ServerConfig) -> Result<Observation, CliError> {
    let first = server.suites.iter().find_map(|served| Some((served, served.suite.tasks.first()?)));
    let (served, task) = first.ok_or_else(|| CliError::input("there is no task to serve"))?;
    let id = EpisodeId {
        suite: served.name.clone(),
        task: task.id,
        episode: 0,
        base_seed: server.seed,
        split: server.split,
    };
    let mut episode = (server.start_episode)(&id).map_err(CliError::input)?;
    let streams = server.profile.streams();
    episode.begin(streams.clone());
    episode.observe(&streams).map_err(|error| CliError::input(error).prefixed(config.file.display()))
}
