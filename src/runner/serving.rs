//! The suites of a script as a server offers them to clients.

use std::{net::TcpListener, sync::Arc};

use serde_json::json;

use crate::{
    config::{ConfiguredScript, RunConfig},
    error::RunError,
    served_runs::ServedRuns,
    suite_run::{PreparedRun, SuiteRun},
    suite_selection::{check_folders, no_suites, run_dir, suites_of},
};
use softvt_benchmark::{Plan, Suite};
use softvt_common::{
    cancel::CancelFlag,
    digest::sha256_hex,
    episode_id::{EpisodeId, EpisodeSplit},
};
use softvt_policy::Observation;
use softvt_runs::summary::SuiteSummary;
use softvt_script::LoadedScript;
use softvt_serve::{AccessRules, RequestError, ServerConfig};

/// A server that clients can reach.
pub struct SuiteServer {
    pub listener: TcpListener,
    pub access: AccessRules,
    /// List of episodes for clients that do not name one.
    pub split: EpisodeSplit,
    /// Largest number of clients at a time.
    pub max_clients: usize,
    pub cancel: Arc<CancelFlag>,
}

impl SuiteServer {
    /// Serves the suites of a script until its end is requested. With an output folder, episodes are recorded. Calls
    /// `on_ready` once the first observation is rendered. Returns the results of the recorded runs, and why the server
    /// ended: a file that could not be written, or an interrupt.
    ///
    /// # Errors
    /// A script without a task, a suite, scene or sensor that is not valid, or a folder that holds something else.
    pub fn serve<E: From<RunError>>(
        self,
        run: &ConfiguredScript,
        on_ready: impl FnOnce() -> Result<(), E>,
    ) -> Result<(Vec<SuiteSummary>, Result<(), RunError>), E> {
        let ConfiguredScript { config, script: loaded } = run;
        if suites_of(&loaded.plan).iter().all(|suite| suite.tasks.is_empty()) {
            return Err(no_suites(config).into());
        }
        let runs = prepare_served(run, self.split)?;
        // Declared here, since the configuration of the server borrows it.
        let served;
        let mut server = server_config(run, &runs, self.access)?;
        config.observer.work("rendering the first observation");
        let first = first_observation(config, &server)?;
        config.observer.end();
        let open = || ServedRuns::open(config, &runs, self.cancel.clone());
        served = config.out.as_ref().map(|_| open()).transpose()?;
        server.recorder = served.as_ref().map(ServedRuns::recorder);
        let hello = softvt_serve::hello(&server, &first);
        on_ready()?;
        softvt_serve::serve(&self.listener, &server, hello, self.max_clients, &self.cancel);
        drop(server);
        Ok(served.map_or_else(|| (Vec::new(), Err(RunError::interrupted(""))), ServedRuns::finish))
    }
}

/// The suites with all that their episodes need. Their scenes are checked, completely so if episodes are recorded.
fn prepare_served<'a>(
    ConfiguredScript { config, script: loaded }: &'a ConfiguredScript,
    split: EpisodeSplit,
) -> Result<Vec<PreparedRun<'a>>, RunError> {
    let suites = suites_of(&loaded.plan);
    let is_list = matches!(loaded.plan, Plan::Suites { .. });
    if config.out.is_some() {
        check_folders(config, &loaded.plan)?;
    }
    let mut runs = Vec::new();
    for suite in suites {
        let out = run_dir(config, suite, is_list);
        let has_folder = out.is_some();
        let mut run = SuiteRun { split, ..SuiteRun::selected(config, loaded, suite, out)? };
        // Without a folder, only privileged clients receive the limits.
        run.calibration_files = run.calibration_files.filter(|_| config.policy.privileged || has_folder);
        runs.push(if has_folder { run.prepare()? } else { run.prepare_unrecorded()? });
    }
    Ok(runs)
}

/// Configuration of a server of prepared runs, which records nothing.
fn server_config<'a>(
    ConfiguredScript { config, script: loaded }: &'a ConfiguredScript,
    runs: &'a [PreparedRun<'a>],
    access: AccessRules,
) -> Result<ServerConfig<'a>, RunError> {
    let start_episode = |id: &EpisodeId| {
        let found = runs.iter().find(|run| run.name == id.suite);
        let run = found.ok_or_else(|| format!("unknown suite {:?}", id.suite))?;
        let task = run.suite.tasks.iter().find(|task| task.id == id.task);
        let task = task.ok_or_else(|| format!("unknown task {}", id.task))?;
        let id = EpisodeId { suite: run.suite.name.clone(), ..id.clone() };
        run.start_episode(task, &id).map_err(|error| RequestError::Invalid(error.to_string()))
    };
    let profile = config.policy.profile().ok_or_else(|| RunError::input("there is no profile to serve"))?;
    Ok(ServerConfig {
        suites: runs.iter().map(served_suite).collect(),
        profile: profile.clone(),
        effort_n: runs.iter().map(|run| run.settings.robot.gripper.effort).fold(f64::INFINITY, f64::min),
        privileged: config.policy.privileged,
        seed: config.base_seed(),
        has_secret_seed: config.secret.is_some(),
        split: runs.first().map_or(EpisodeSplit::Validation, |run| run.split),
        fingerprint: provenance_hash(config, loaded),
        access,
        start_episode: Box::new(start_episode),
        recorder: None,
    })
}

/// The first observation of the first episode. It reports invalid scenes and sensors before a client connects.
fn first_observation(config: &RunConfig, server: &ServerConfig) -> Result<Observation, RunError> {
    let first = server.suites.iter().find_map(|suite| Some((suite, suite.tasks.first()?)));
    let (suite, task) = first.ok_or_else(|| RunError::input("there is no task to serve"))?;
    let id = EpisodeId {
        suite: suite.name.clone(),
        task: task.id,
        episode: 0,
        base_seed: server.seed,
        split: server.split,
    };
    let mut episode = (server.start_episode)(&id).map_err(RunError::input)?;
    let streams = server.profile.streams();
    episode.begin(streams.clone());
    episode.observe(&streams).map_err(|error| config.error(error))
}

/// A suite as clients see it: its name in results, the selected tasks, and the number of episodes of a run.
fn served_suite(run: &PreparedRun) -> Suite {
    let tasks = run.jobs.tasks().into_iter().cloned().collect();
    Suite { name: run.name.clone(), tasks, episodes: run.config.episodes_of(run.suite), ..run.suite.clone() }
}

/// Hash of all that determines an episode, except its index and the actions of the client.
fn provenance_hash(config: &RunConfig, loaded: &LoadedScript) -> String {
    let all = json!([env!("CARGO_PKG_VERSION"), loaded.file_hashes(), config.changes().hash()]);
    sha256_hex(all.to_string())
}
