//! Runs of a server: one folder per suite, with the episodes that clients step to their end.

use std::{
    collections::BTreeSet,
    path::Path,
    sync::{Arc, Mutex},
};

use crate::{
    config::RunConfig,
    error::RunError,
    evaluate::{RunLog, episode_line, restore_artifacts, with_kept},
    suite_run::PreparedRun,
};
use softvt_common::{
    cancel::{self, CancelFlag},
    episode_id::{EpisodeId, EpisodeIndex},
    parallel::lock,
    text::counted,
};
use softvt_rollout::FinishedEpisode;
use softvt_runs::summary::SuiteSummary;
use softvt_serve::{EpisodeRecorder, RequestError};

pub struct ServedRuns<'a> {
    config: &'a RunConfig,
    runs: Vec<ServedRun<'a>>,
    /// The first error of writing a file. The server ends then.
    failure: Mutex<Option<RunError>>,
    cancel: Arc<CancelFlag>,
}

struct ServedRun<'a> {
    run: &'a PreparedRun<'a>,
    /// Episodes that were in the folder when the server started.
    resumed: BTreeSet<EpisodeIndex>,
    log: Mutex<RunLog<'a>>,
}

impl<'a> ServedRuns<'a> {
    /// Creates the folders of prepared runs, or opens them where [`RunConfig::resume`] is set. A file that cannot be
    /// written requests the end of the server by `cancel`.
    ///
    /// # Errors
    /// A folder holds another run or anything else, or cannot be written. No empty folder is left then.
    pub fn open(
        config: &'a RunConfig,
        runs: &'a [PreparedRun<'a>],
        cancel: Arc<CancelFlag>,
    ) -> Result<Self, RunError> {
        let mut opened = Self { config, runs: Vec::new(), failure: Mutex::default(), cancel };
        for run in runs {
            match ServedRun::open(run) {
                Ok(run) => opened.runs.push(run),
                Err(error) => {
                    opened.discard_empty()?;
                    return Err(error);
                }
            }
        }
        Ok(opened)
    }

    /// Interface of the server to the recorded runs.
    pub fn recorder(&self) -> EpisodeRecorder<'_> {
        EpisodeRecorder {
            selects: Box::new(|id| self.find(&id.suite).is_some_and(|run| run.selects(id))),
            begin: Box::new(|id| self.begin(id)),
            record: Box::new(|finished| self.record(finished)),
            report_lost: Box::new(|id, reason| {
                // An interrupt ends all episodes.
                if !cancel::requested() {
                    let (suite, index) = (&id.suite, id.index());
                    self.config.notice(format_args!(
                        "{suite}: {index} will not be recorded: {reason}; a resumed server takes it again"
                    ));
                }
            }),
        }
    }

    fn find(&self, suite: &str) -> Option<&ServedRun<'a>> {
        self.runs.iter().find(|served| served.run.name == suite)
    }

    /// Writes that an attempt at an episode has begun. After an error the server ends.
    fn begin(&self, id: &EpisodeId) -> Result<(), RequestError> {
        let attempts = self.find(&id.suite).and_then(|served| lock(&served.log).attempts.clone());
        let begun = attempts.map_or(Ok(()), |attempts| attempts.begin(id.index()));
        begun.map_err(|error| self.fail(error.into()))
    }

    fn fail(&self, error: RunError) -> RequestError {
        let message = error.to_string();
        lock(&self.failure).get_or_insert(error);
        self.cancel.request();
        RequestError::Record(message)
    }

    /// Writes the files of an episode. After an error the server ends.
    fn record(&self, finished: FinishedEpisode) -> Result<(), RequestError> {
        let suite = &finished.record.header.id.suite;
        let served =
            self.find(suite).ok_or_else(|| RequestError::Record(format!("unknown suite {suite}")))?;
        served.add(finished).map_err(|error| self.fail(error))
    }

    /// Sorts the episodes of the folders. A folder without an episode or attempt is removed, so that the same
    /// command works again. Returns the results of the others, and why the server ended: a file that could not be
    /// written, or an interrupt.
    pub fn finish(self) -> (Vec<SuiteSummary>, Result<(), RunError>) {
        let (config, failure) = (self.config, lock(&self.failure).take());
        let (mut recorded, mut requested, mut summaries) = (0, 0, Vec::new());
        let mut outcome = failure.map_or(Ok(()), Err);
        for served in self.runs {
            let (run, mut log) = (served.run, served.log.into_inner().unwrap_or_else(|log| log.into_inner()));
            recorded += log.records.len();
            requested += run.jobs.len();
            if !log.records.is_empty() {
                summaries.push(log.summary());
            }
            outcome = outcome.and(if log.is_empty() { log.discard() } else { log.sort() });
        }
        if recorded == 0 {
            return (summaries, with_kept(outcome, "no episode was recorded", None));
        }
        let out = config.out.as_deref().unwrap_or(Path::new(""));
        let kept = format!("{recorded} of {} are in {}", counted(requested, "episode"), out.display());
        (summaries, with_kept(outcome, &kept, (recorded < requested).then_some(out)))
    }

    fn discard_empty(self) -> Result<(), RunError> {
        for served in self.runs {
            let log = served.log.into_inner().unwrap_or_else(|log| log.into_inner());
            if log.is_empty() {
                log.discard()?;
            }
        }
        Ok(())
    }
}

impl<'a> ServedRun<'a> {
    fn open(run: &'a PreparedRun<'a>) -> Result<Self, RunError> {
        let config = run.config;
        let manifest = run.manifest(config.episodes_of(run.suite));
        let mut log = RunLog::open(run, &manifest, config.resume)?;
        restore_artifacts(run, &log.records)?;
        let resumed = log.records.iter().map(|record| record.header.id.index()).collect();
        write_if_complete(run, &mut log)?;
        Ok(Self { run, resumed, log: Mutex::new(log) })
    }

    /// True if an episode is one of the run that the folder did not have when the server started.
    fn selects(&self, id: &EpisodeId) -> bool {
        let (run, index) = (self.run, id.index());
        let is_own = id.base_seed == run.config.base_seed() && id.split == run.split;
        is_own && run.jobs.find(index).is_some() && !self.resumed.contains(&index)
    }

    /// Writes the files of an episode, and after the last one those of the whole run.
    fn add(&self, finished: FinishedEpisode) -> Result<(), RunError> {
        let (run, mut log) = (self.run, lock(&self.log));
        let message = episode_line(&finished.record);
        let artifacts = run.artifacts();
        log.add(finished, |finished| artifacts.write(finished))?;
        run.config.notice(format_args!("{} [{}/{}] {message}", run.name, log.records.len(), run.jobs.len()));
        write_if_complete(run, &mut log)
    }
}

/// Writes the results of a run that has all of its episodes.
fn write_if_complete(run: &PreparedRun, log: &mut RunLog) -> Result<(), RunError> {
    let is_complete = !log.records.is_empty() && log.records.len() == run.jobs.len();
    if is_complete { log.write_results() } else { Ok(()) }
}
