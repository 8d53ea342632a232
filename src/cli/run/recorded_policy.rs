//! `--policy RUN_DIR`: the actions of a run, carried out once more, and whether it has those that are wanted.

use std::path::{Path, PathBuf};

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::{
    benchmark::{Suite, Task, seed::Split},
    cli::{error::CliError, run::config::RunConfig},
    policy::{Action, TaskBrief},
    report::{
        actions,
        run_folder::EPISODES,
        stored_run::{self, StoredRun},
    },
};

/// The runs in a folder.
#[derive(Debug)]
pub(crate) struct RecordedRuns {
    dir: PathBuf,
    runs: Vec<StoredRun>,
}

/// Which episodes are wanted.
pub(crate) struct RequestedEpisodes<'a> {
    /// The script's name of the suite.
    pub suite: &'a str,
    /// Whether soft objects are made rigid.
    pub twin: bool,
    /// Base seed.
    pub seed: u64,
    /// Which list of episodes.
    pub split: Split,
    /// Tasks and episodes.
    pub jobs: &'a [(usize, u32)],
}

/// Whose actions were carried out, as `run.json` says it.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct ReplaySource {
    /// The folder, as it was typed.
    pub run: String,
    /// Who drove it.
    pub policy: String,
    /// Whether whoever drove it saw the true state.
    pub privileged: bool,
    /// Whether whoever drove it saw the true forces at the pads.
    pub force_observed: bool,
    /// SHA-256 of its episodes and actions.
    pub sha256: String,
}

/// Episodes that a message names.
const TOLD: usize = 3;

/// Whose actions are carried out once more, if any are: they must be those of this very suite, and all there.
///
/// # Errors
/// What differs or is missing.
pub(crate) fn recorded(
    run: &RunConfig,
    suite: &Suite,
    jobs: &[(&Task, u32)],
) -> Result<Option<ReplaySource>, CliError> {
    let Some(runs) = run.policy.recorded() else { return Ok(None) };
    let jobs: Vec<(usize, u32)> = jobs.iter().map(|(task, episode)| (task.id, *episode)).collect();
    let wanted = RequestedEpisodes {
        suite: &suite.name,
        twin: run.twin,
        seed: run.seed,
        split: Split::Validation,
        jobs: &jobs,
    };
    runs.check(&wanted).map(Some)
}

impl RecordedRuns {
    /// Reads the folder of a run, or of several.
    ///
    /// # Errors
    /// It holds none.
    pub(crate) fn load(dir: &Path) -> Result<Self, CliError> {
        let runs = stored_run::load(dir).map_err(|e| CliError::input(format!("--policy: {e}")))?;
        Ok(Self { dir: dir.to_owned(), runs })
    }

    /// The run that episodes are taken from.
    ///
    /// # Errors
    /// It is of another suite, seed, split or twin, or lacks episodes.
    pub(crate) fn check(&self, wanted: &RequestedEpisodes<'_>) -> Result<ReplaySource, CliError> {
        let run = self.of(wanted.suite, wanted.twin).ok_or_else(|| self.no_suite(wanted))?;
        let wrong = |what: String| CliError::input(format!("--policy {}: {what}", run.dir.display()));
        let seed = run.info["seed"].as_u64();
        if seed != Some(wanted.seed) {
            let of = seed.map_or("unknown".to_owned(), |seed| seed.to_string());
            return Err(wrong(format!("it is of seed {of}, and this run of seed {}", wanted.seed)));
        }
        let (split, own) = (run.text("split"), wanted.split.name());
        if split != own {
            return Err(wrong(format!("it is of the split {split}, and this run of {own}")));
        }
        let missing: Vec<String> = wanted
            .jobs
            .iter()
            .filter(|(task, episode)| !has(run, *task, *episode))
            .map(|(task, episode)| format!("task {task} episode {episode}"))
            .collect();
        if !missing.is_empty() {
            let more = missing.len().saturating_sub(TOLD);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let named = missing.iter().take(TOLD).map(String::as_str).collect::<Vec<_>>().join(", ");
            let all = wanted.jobs.len();
            return Err(wrong(format!(
                "it lacks {} of the {all} episodes that are wanted: {named}{more}; name those that it has with --task and \
                 --episodes",
                missing.len()
            )));
        }
        Ok(ReplaySource {
            run: run.dir.display().to_string(),
            policy: run.text("policy").to_owned(),
            privileged: run.is_privileged(),
            force_observed: run.sees_forces(),
            sha256: digest(run).map_err(CliError::input)?,
        })
    }

    fn of(&self, suite: &str, twin: bool) -> Option<&StoredRun> {
        self.runs.iter().find(|run| run.text("suite") == suite && is_twin(run) == twin)
    }

    fn no_suite(&self, wanted: &RequestedEpisodes<'_>) -> CliError {
        let called = |suite: &str, twin: bool| format!("{suite}{}", if twin { " as rigid twin" } else { "" });
        let have: Vec<String> = self.runs.iter().map(|run| called(run.text("suite"), is_twin(run))).collect();
        CliError::input(format!(
            "--policy {}: it holds no run of suite {}; it has {}",
            self.dir.display(),
            called(wanted.suite, wanted.twin),
            have.join(", ")
        ))
    }

    /// What was commanded in an episode.
    ///
    /// # Errors
    /// The actions cannot be read.
    pub(crate) fn actions(
        &self,
        suite: &str,
        twin: bool,
        brief: &TaskBrief,
    ) -> Result<Vec<Action>, CliError> {
        let dir = self.of(suite, twin).map_or(&self.dir, |run| &run.dir);
        actions::read(&actions::path(dir, brief.task, brief.episode)).map_err(CliError::input)
    }
}

fn is_twin(run: &StoredRun) -> bool {
    run.info["twin"].is_string()
}

fn has(run: &StoredRun, task: usize, episode: u32) -> bool {
    let listed = run.records.iter().any(|r| (r.identity.task, r.identity.episode) == (task, episode));
    listed && actions::path(&run.dir, task, episode).is_file()
}

/// SHA-256 of the list of episodes and of the actions of each, in the order of the list.
fn digest(run: &StoredRun) -> Result<String, String> {
    let mut hash = Sha256::new();
    let list = run.dir.join(EPISODES);
    let files = run.records.iter().map(|r| actions::path(&run.dir, r.identity.task, r.identity.episode));
    for path in std::iter::once(list).chain(files) {
        let bytes = std::fs::read(&path).map_err(|e| format!("cannot read {}: {e}", path.display()))?;
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(&bytes);
    }
    Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect())
}
