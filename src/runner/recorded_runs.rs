//! Repetition of the actions of a recorded run, as a policy.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::{episode_list::EpisodeList, error::RunError};
use softvt_common::{
    episode_id::{EpisodeIndex, EpisodeSplit},
    files::FileError,
    text::hex,
};
use softvt_policy::{Action, EpisodeBrief};
use softvt_runs::{
    actions,
    manifest::ReplaySource,
    run_folder::EPISODES,
    stored_run::{self, StoredRun},
};

/// The runs in a folder, at most one of each suite.
#[derive(Debug)]
pub(crate) struct RecordedRuns {
    dir: PathBuf,
    runs: Vec<StoredRun>,
}

impl RecordedRuns {
    /// Reads a run folder, or all run folders in a folder.
    pub(crate) fn load(dir: &Path) -> Result<Self, RunError> {
        let runs = stored_run::load(dir).map_err(|error| RunError::of_setting("policy", "", error))?;
        Ok(Self { dir: dir.to_owned(), runs })
    }

    fn run_of(&self, suite: &str, is_twin: bool) -> Option<&StoredRun> {
        self.runs.iter().find(|run| run.manifest.suite == suite && is_rigid_twin(run) == is_twin)
    }

    /// The run of a suite whose actions the policy repeats.
    pub(crate) fn replay_source(
        &self,
        suite: &str,
        is_twin: bool,
        base_seed: u64,
        split: EpisodeSplit,
        requested: &EpisodeList,
    ) -> Result<ReplaySource, RunError> {
        let run = self.run_of(suite, is_twin).ok_or_else(|| {
            let available: Vec<String> =
                self.runs.iter().map(|run| suite_label(&run.manifest.suite, is_rigid_twin(run))).collect();
            let (suite, available) = (suite_label(suite, is_twin), available.join(", "));
            let message = format!("no run of suite {suite}; available: {available}");
            RunError::of_setting("policy", self.dir.display(), message)
        })?;
        let refuse = |message: String| Err(RunError::of_setting("policy", run.dir.display(), message));
        let manifest = &run.manifest;
        for (what, other, own) in [
            ("seed", manifest.seed.to_string(), base_seed.to_string()),
            ("split", manifest.split.name().to_owned(), split.name().to_owned()),
        ] {
            if other != own {
                return refuse(format!("its {what} is {other}, that of this run {own}"));
            }
        }
        let recorded = run.records.iter().map(|record| record.header.id.index());
        let has_actions = |index: &EpisodeIndex| actions::path(&run.dir, *index).is_file();
        let missing = requested.without(recorded.filter(has_actions));
        if let Some(first) = missing.iter().next() {
            return refuse(format!(
                "it lacks {} of the {} requested episodes (first: {}); select available tasks and episodes",
                missing.len(),
                requested.len(),
                first.index()
            ));
        }
        for record in run.records.iter().filter(|record| requested.find(record.header.id.index()).is_some()) {
            actions::read_checked(&run.dir, record)?;
        }
        Ok(ReplaySource {
            run: run.dir.display().to_string(),
            policy: manifest.policy.clone(),
            privileged: manifest.is_privileged(),
            force_observed: manifest.force_observed,
            sha256: digest(run)?,
        })
    }

    pub(crate) fn actions(
        &self,
        suite: &str,
        is_twin: bool,
        brief: &EpisodeBrief,
    ) -> Result<Vec<Action>, RunError> {
        let found = self.run_of(suite, is_twin).and_then(|run| Some((run, run.record(brief.index())?)));
        let Some((run, record)) = found else {
            let message = format!("no run has {} of suite {suite}", brief.index());
            return Err(RunError::of_setting("policy", self.dir.display(), message));
        };
        Ok(actions::read_checked(&run.dir, record)?)
    }
}

fn suite_label(suite: &str, is_twin: bool) -> String {
    format!("{suite}{}", if is_twin { " (rigid twin)" } else { "" })
}

fn is_rigid_twin(run: &StoredRun) -> bool {
    run.manifest.twin.is_some()
}

/// SHA-256 of the list of episodes and of the actions of each, in the order of the list.
fn digest(run: &StoredRun) -> Result<String, FileError> {
    let mut hash = Sha256::new();
    let list = run.dir.join(EPISODES);
    let actions = run.records.iter().map(|r| actions::path(&run.dir, r.header.id.index()));
    for path in std::iter::once(list).chain(actions) {
        let bytes = std::fs::read(&path).map_err(FileError::io("read", &path))?;
        // Lengths separate the files, so that no two sequences of files have the same input.
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(&bytes);
    }
    Ok(hex(&hash.finalize()))
}
