//! Evaluation of a policy on a suite. With a folder, an interrupted run can be continued.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use crate::{
    config::RunConfig,
    episode_list::{EpisodeJob, EpisodeList},
    error::{RunError, RunErrorCause},
    observer::JobList,
    replay::{difference, replay_factory, with_policy_fields},
    stored_scripts::StoredScripts,
    suite_run::PreparedRun,
};
use softvt_common::cancel;
use softvt_common::episode_id::EpisodeIndex;
use softvt_common::{files, parallel, text::counted};
use softvt_evaluation::{category::EpisodeCategory, verdict::Outcome};
use softvt_policy::PolicyError;
use softvt_rollout::{Episode, FinishedEpisode};
use softvt_runs::{
    actions,
    attempts::Attempts,
    manifest::RunManifest,
    record::EpisodeRecord,
    run_folder::{RUN, RunFolder, SUMMARY},
    softvtbench_files,
    summary::SuiteSummary,
};

/// The episodes of a finished run, in order, with their summary.
#[derive(Clone, Debug)]
pub struct SuiteResult {
    /// Folder of the run, if it has one.
    pub folder: Option<PathBuf>,
    /// Rates and distributions.
    pub summary: SuiteSummary,
    /// One record per episode, in order of task and episode.
    pub records: Vec<EpisodeRecord>,
}

impl SuiteResult {
    /// Says so if the actions of the policy could be executed in no episode, as those of one that answers NaN.
    pub fn refusal_of_all_actions(&self) -> Option<String> {
        let message = |record: &EpisodeRecord| match &record.outcome {
            Outcome::Error { message } => Some(message.clone()),
            _ => None,
        };
        let first = message(self.records.first()?)?;
        self.records.iter().all(|record| message(record).is_some()).then(|| {
            let count = counted(self.records.len(), "episode");
            format!("no episode is valid: the policy's actions were refused in {count}, first: {first}")
        })
    }
}

/// A simulated episode, and the result of rendering it.
pub(crate) struct SimulatedEpisode {
    pub finished: FinishedEpisode,
    pub rendered: Result<(), RunError>,
}

/// The folder of a run in progress, and the records of its finished episodes.
pub(crate) struct RunLog<'a> {
    run: &'a PreparedRun<'a>,
    folder: RunFolder,
    pub records: Vec<EpisodeRecord>,
    /// Those of a policy outside of softvt.
    pub attempts: Option<Arc<Attempts>>,
}

impl<'a> RunLog<'a> {
    /// Creates the folder of a run, or with `resume` continues it.
    ///
    /// # Errors
    /// The folder is of another run or anything else, or cannot be written.
    pub(crate) fn open(run: &'a PreparedRun, manifest: &RunManifest, resume: bool) -> Result<Self, RunError> {
        let opened = match resume {
            true => RunFolder::resume(&run.out, manifest),
            false => RunFolder::create(&run.out, manifest).map(|folder| (folder, Vec::new())),
        };
        let (folder, records) = opened.map_err(|error| run.config.error(error))?;
        let attempts = match run.config.policy.is_outside() {
            true => Some(Arc::new(Attempts::open(folder.path())?)),
            false => None,
        };
        StoredScripts::new(run.loaded, run.calibration_files.texts()).write(folder.path())?;
        Ok(Self { run, folder, records, attempts })
    }

    /// Runs jobs of a list. Writes the files of each finished episode, and then its line.
    ///
    /// # Errors
    /// A script, policy or file that fails. Finished episodes are kept.
    pub(crate) fn run_jobs<'j>(
        &mut self,
        list: &JobList,
        jobs: &EpisodeList<'j>,
        simulate: impl Fn(EpisodeJob<'j>) -> Result<SimulatedEpisode, RunError> + Sync,
        write: impl Fn(&FinishedEpisode) -> Result<(), RunError>,
        mut line: impl FnMut(&EpisodeRecord) -> String,
    ) -> Result<(), RunError> {
        let (config, simulate) = (self.run.config, |position| simulate(jobs.job(position)));
        config.run_jobs(list, jobs.len(), simulate, |_, SimulatedEpisode { finished, rendered }| {
            let unended = unended_note(&finished);
            let record = self.add(finished, &write)?;
            report_unrendered(config, record.header.id.index(), rendered);
            Ok(line(record) + &unended)
        })
    }

    /// Writes the files of a finished episode, and then its line, so that every listed episode is complete.
    ///
    /// # Errors
    /// A file cannot be written.
    pub(crate) fn add(
        &mut self,
        mut finished: FinishedEpisode,
        write: impl Fn(&FinishedEpisode) -> Result<(), RunError>,
    ) -> Result<&EpisodeRecord, RunError> {
        let index = finished.record.header.id.index();
        finished.record.stats.attempts = self.attempts.as_ref().and_then(|attempts| attempts.several(index));
        write(&finished)?;
        self.folder.append(&finished.record)?;
        self.records.push(finished.record);
        Ok(&self.records[self.records.len() - 1])
    }

    /// Sorts the records and the lines of the folder.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub(crate) fn sort(&mut self) -> Result<(), RunError> {
        self.records.sort_by_key(|record| record.header.id.index());
        Ok(self.folder.write_in_order(&self.records)?)
    }

    /// True if there is neither a record nor an attempt.
    pub(crate) fn is_empty(&self) -> bool {
        self.records.is_empty() && self.attempts.as_ref().is_none_or(|attempts| attempts.is_empty())
    }

    /// Removes the folder. The same command must work once an error is fixed, if there is nothing to keep.
    ///
    /// # Errors
    /// A file cannot be removed.
    pub(crate) fn discard(self) -> Result<(), RunError> {
        Ok(self.folder.discard()?)
    }

    /// Sorts the episodes of a complete evaluation and writes its results.
    ///
    /// # Errors
    /// A file cannot be written.
    pub(crate) fn write_results(&mut self) -> Result<(), RunError> {
        self.sort()?;
        let calibrations = self.run.calibrations.clone();
        softvtbench_files::write_scores(&self.run.out, &self.records, &calibrations.merged.released())?;
        self.write_summary()
    }

    /// Writes the summary. A folder with a summary counts as finished.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn write_summary(&self) -> Result<(), RunError> {
        files::write_json(&self.run.out.join(SUMMARY), &self.summary())?;
        Ok(self.attempts.as_ref().map_or(Ok(()), |attempts| attempts.remove())?)
    }

    /// Summary of the episodes so far.
    pub(crate) fn summary(&self) -> SuiteSummary {
        SuiteSummary::from_records(&self.run.name, &self.run.config.policy.name, &self.records)
    }
}

/// Adds to the outcome of a run what it kept, and reports an interrupt with `hint` on how to continue.
///
/// # Errors
/// The outcome is an error, or the run was interrupted.
pub(crate) fn with_kept(
    outcome: Result<(), RunError>,
    kept: &str,
    resumable: Option<&Path>,
) -> Result<(), RunError> {
    match outcome {
        // An error from before the interrupt has its own exit code and is reported as it is.
        Err(error) if error.cause != RunErrorCause::Interrupt => Err(error.with_line(kept)),
        Ok(()) if !cancel::requested() => Ok(()),
        _ => {
            let resumable = resumable.map(Path::to_owned);
            Err(RunError { resumable, ..RunError::interrupted(format!("interrupted; {kept}")) })
        }
    }
}

/// Runs the episodes of a prepared suite into its folder, and calls `on_episode` for each one that it has run and
/// written, in the order in which they end. Episodes that are there already are kept.
///
/// # Errors
/// The folder contains another run, or one that may not be resumed; a script, policy or file fails; or the run is
/// interrupted. Finished episodes are kept.
pub(crate) fn run_suite(
    run: &PreparedRun,
    on_episode: &mut dyn FnMut(&EpisodeRecord),
) -> Result<SuiteResult, RunError> {
    let config = run.config;
    let manifest = run.manifest(config.episodes_of(run.suite));
    // The same command again on a finished folder changes nothing, even without --resume.
    let finished = is_finished(&run.out) && manifest.is_in(&run.out);
    let mut log = RunLog::open(run, &manifest, config.resume || finished)?;
    let artifacts = run.artifacts();
    let remaining = run.jobs.without(log.records.iter().map(|record| record.header.id.index()));
    let out = run.out.display();
    if finished
        && remaining.is_empty()
        && softvtbench_files::has_scores(&run.out)
        && log.records.iter().all(|record| artifacts.missing(record).is_empty())
    {
        config.notice(format!("{out} is already complete"));
        return Ok(SuiteResult {
            folder: Some(run.out.clone()),
            summary: log.summary(),
            records: log.records,
        });
    }
    let attempts = log.attempts.clone();
    let simulate = |job: EpisodeJob| {
        let mut calls = 0;
        // The second call is that after the first action.
        let mut begin = |_: &mut Episode| {
            calls += 1;
            let begun = attempts.as_ref().filter(|_| calls == 2).map(|attempts| attempts.begin(job.index()));
            begun.unwrap_or(Ok(())).map_err(|error| PolicyError::Script(error.to_string()))
        };
        let (origin, keep_states) = (run.origins.get(&job.index()), artifacts.may_render(job.episode));
        let simulated = run.simulate(job, origin, keep_states, &run.controllers, &mut begin)?;
        let mut finished = simulated.map_err(|error| run.episode_error(&error))?;
        let rendered = artifacts.render(&mut finished);
        Ok(SimulatedEpisode { finished, rendered })
    };
    let outcome = restore_artifacts(run, &log.records).and_then(|()| {
        let line = |record: &EpisodeRecord| {
            on_episode(record);
            config.observer.judged(record.category());
            episode_line(record)
        };
        log.run_jobs(
            &config.job_list(&format!("running {}", run.name)),
            &remaining,
            simulate,
            |finished| artifacts.write(finished),
            line,
        )
    });
    match outcome {
        Err(error) if error.cause != RunErrorCause::Interrupt && log.is_empty() => {
            log.discard()?;
            return Err(error);
        }
        outcome => {
            let kept =
                format!("{} of {} are in {out}", log.records.len(), counted(run.jobs.len(), "episode"));
            with_kept(outcome, &kept, Some(&run.out))?;
        }
    }
    log.write_results()?;
    config.notice(out);
    Ok(SuiteResult { folder: Some(run.out.clone()), summary: log.summary(), records: log.records })
}

/// Runs the episodes of a prepared suite and writes nothing. Calls `on_episode` for each, in the order
/// in which they end.
///
/// # Errors
/// A script or policy fails, or a request to stop.
pub(crate) fn run_episodes(
    run: &PreparedRun,
    on_episode: &mut dyn FnMut(&EpisodeRecord),
) -> Result<SuiteResult, RunError> {
    let (config, mut records) = (run.config, Vec::new());
    let simulate = |position| run.run_episode(run.jobs.job(position), false, &run.controllers);
    config.run_jobs(
        &config.job_list(&format!("running {}", run.name)),
        run.jobs.len(),
        simulate,
        |_, finished: FinishedEpisode| {
            on_episode(&finished.record);
            config.observer.judged(finished.record.category());
            let line = episode_line(&finished.record) + &unended_note(&finished);
            records.push(finished.record);
            Ok(line)
        },
    )?;
    if cancel::requested() {
        return Err(RunError::interrupted("interrupted"));
    }
    records.sort_by_key(|record| record.header.id.index());
    let summary = SuiteSummary::from_records(&run.name, &config.policy.name, &records);
    Ok(SuiteResult { folder: None, summary, records })
}

/// True if a folder contains a finished run.
pub(crate) fn is_finished(dir: &Path) -> bool {
    dir.join(SUMMARY).is_file() && dir.join(RUN).is_file()
}

/// Reports an episode whose video or MCAP file could not be written. The episode counts nevertheless.
fn report_unrendered(config: &RunConfig, index: EpisodeIndex, rendered: Result<(), RunError>) {
    if let Err(error) = rendered {
        config.notice(format!("warning: {index} lacks a file: {error}"));
    }
}

/// The end of the line of an episode whose controller had not ended.
fn unended_note(finished: &FinishedEpisode) -> String {
    finished.unended.as_ref().map_or(String::new(), |unended| format!("; {unended}"))
}

/// Formats an episode as one line of progress.
pub(crate) fn episode_line(record: &EpisodeRecord) -> String {
    let (verdict, category) = (&record.verdict, record.category());
    let name = record.result_and_harm();
    let reason = match &record.outcome {
        Outcome::Invalid { reason, .. } => format!(" ({reason})"),
        Outcome::Error { message } => format!(" ({message})"),
        _ if category == EpisodeCategory::Slipped => format!(" by {:.1} mm", verdict.slip_mm),
        _ => match record.missed_parts() {
            parts if parts.is_empty() => String::new(),
            parts => format!(" ({})", parts.join(", ")),
        },
    };
    let d = record.deformation_in_words().map(|d| format!(", {d}")).unwrap_or_default();
    let outcome = format!("{} {name}{reason}{d}", category.glyph());
    let stats = &record.stats;
    let mut line = format!("{}: {outcome}, {:.1} s simulated", record.header.id.index(), stats.time_s);
    if !verdict.goal && verdict.wrong_instance {
        line += "; another object was lifted first";
    }
    if let Some(reason) = &stats.gave_up {
        line += &format!("; gave up: {reason}");
    }
    // The message of an error says it already.
    if !matches!(record.outcome, Outcome::Error { .. }) {
        stats.command_notes().iter().for_each(|note| line += &format!("; {note}"));
    }
    line
}

/// Restores requested files of finished episodes that are missing: by the recorded actions, or without
/// these by the policy unless it is in another program. Files that cannot be restored are reported; the
/// results of their episodes stay.
///
/// # Errors
/// An episode cannot be run, or a file cannot be written.
pub(crate) fn restore_artifacts(run: &PreparedRun, records: &[EpisodeRecord]) -> Result<(), RunError> {
    let artifacts = run.artifacts();
    let incomplete = records.iter().filter(|record| !artifacts.missing(record).is_empty());
    let has_actions = |record: &EpisodeRecord| artifacts.has_actions(record);
    for record in records {
        let path = actions::path(&run.out, record.header.id.index());
        if let (true, Err(damage)) = (path.is_file(), actions::read_checked(&run.out, record)) {
            run.config.notice(damage);
        }
    }
    let (restorable, lost): (Vec<_>, Vec<_>) =
        incomplete.partition(|record| has_actions(record) || run.config.policy.profile().is_none());
    if let Some(first) = lost.first() {
        run.config.notice(format!(
            "{} finished episodes lack their actions, so their files cannot be restored (first: {}); their results stay",
            lost.len(),
            first.header.id.index()
        ));
    }
    if let Some(path) = restorable.first().and_then(|record| artifacts.missing(record).into_iter().next()) {
        run.config.notice(format!(
            "restoring files of {} (first: {})",
            counted(restorable.len(), "finished episode"),
            path.display()
        ));
    }
    parallel::run(
        restorable.len(),
        run.config.thread_count(),
        cancel::requested,
        |index| {
            let record = restorable[index];
            simulate_again(run, record, has_actions(record))
        },
        |_, simulated| {
            let Some(SimulatedEpisode { finished, rendered }) = simulated else { return Ok(()) };
            artifacts.write(&finished)?;
            report_unrendered(run.config, finished.record.header.id.index(), rendered);
            Ok(())
        },
    )
}

/// Simulates a finished episode again. Returns `None`, after a notice, if the result differs from its record.
fn simulate_again(
    run: &PreparedRun,
    record: &EpisodeRecord,
    has_actions: bool,
) -> Result<Option<SimulatedEpisode>, RunError> {
    let (index, artifacts) = (record.header.id.index(), run.artifacts());
    let Some(job) = run.jobs.find(index) else { return Ok(None) };
    let keep_states = artifacts.may_render(index.episode);
    let mut finished = if has_actions {
        let recorded = actions::read_checked(&run.out, record)?;
        run.run_episode(job, keep_states, &replay_factory(recorded, record))?
    } else {
        run.run_episode(job, keep_states, &run.controllers)?
    };
    finished.record = with_policy_fields(finished.record, record);
    if let Some(difference) = difference(record, &finished.record)? {
        run.config.notice(format!(
            "files of {index} are not restored: the simulation differs from its record ({difference}); its results stay"
        ));
        return Ok(None);
    }
    let rendered = artifacts.render(&mut finished);
    Ok(Some(SimulatedEpisode { finished, rendered }))
}
