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
use softvt_common::{cancel, episode_id::EpisodeIndex, files, parallel, text::counted};
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

/// The records of a run in progress and, if it has one, its folder.
pub(crate) struct RunLog<'a> {
    run: &'a PreparedRun<'a>,
    folder: Option<RunFolder>,
    pub records: Vec<EpisodeRecord>,
    /// Attempts of a policy outside of softvt.
    pub attempts: Option<Arc<Attempts>>,
}

impl<'a> RunLog<'a> {
    /// Creates the folder of a run that has one, or with `resume` continues it.
    pub(crate) fn open(run: &'a PreparedRun, manifest: &RunManifest, resume: bool) -> Result<Self, RunError> {
        let Some(dir) = &run.out else {
            return Ok(Self { run, folder: None, records: Vec::new(), attempts: None });
        };
        let opened = match resume {
            true => RunFolder::resume(dir, manifest),
            false => RunFolder::create(dir, manifest).map(|folder| (folder, Vec::new())),
        };
        let (folder, records) = opened.map_err(|error| run.config.error(error))?;
        let attempts = run.config.policy.is_outside().then(|| Attempts::open(dir)).transpose()?;
        let calibrations = run.calibration_files.as_ref().map(|files| files.texts());
        StoredScripts::new(run.loaded, calibrations.unwrap_or_default()).write(dir)?;
        Ok(Self { run, folder: Some(folder), records, attempts: attempts.map(Arc::new) })
    }

    /// Runs jobs of a list. Writes the files of each finished episode, and then its line.
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
            // The controller had more to do.
            let unended = finished.unended.as_ref().map_or(String::new(), |unended| format!("; {unended}"));
            let record = self.add(finished, &write)?;
            report_unrendered(config, record.header.id.index(), rendered);
            Ok(line(record) + &unended)
        })
    }

    /// Writes the files of a finished episode, and then its line, so that every listed episode is complete.
    pub(crate) fn add(
        &mut self,
        mut finished: FinishedEpisode,
        write: impl Fn(&FinishedEpisode) -> Result<(), RunError>,
    ) -> Result<&EpisodeRecord, RunError> {
        let index = finished.record.header.id.index();
        finished.record.stats.attempts = self.attempts.as_ref().and_then(|attempts| attempts.several(index));
        if let Some(folder) = &mut self.folder {
            write(&finished)?;
            folder.append(&finished.record)?;
        }
        self.records.push(finished.record);
        Ok(&self.records[self.records.len() - 1])
    }

    /// Sorts the records and the lines of the folder.
    pub(crate) fn sort(&mut self) -> Result<(), RunError> {
        self.records.sort_by_key(|record| record.header.id.index());
        Ok(self.folder.as_mut().map_or(Ok(()), |folder| folder.write_in_order(&self.records))?)
    }

    /// True if there is neither a record nor an attempt.
    pub(crate) fn is_empty(&self) -> bool {
        self.records.is_empty() && self.attempts.as_ref().is_none_or(|attempts| attempts.is_empty())
    }

    pub(crate) fn discard(self) -> Result<(), RunError> {
        Ok(self.folder.map_or(Ok(()), RunFolder::discard)?)
    }

    /// Ends the jobs: after an error, a folder without anything to keep is removed, so that the same command works
    /// once the error is fixed; otherwise the error says what `kept` describes.
    pub(crate) fn end(
        self,
        outcome: Result<(), RunError>,
        kept: impl FnOnce(&Self) -> String,
        resumable: &Path,
    ) -> Result<Self, RunError> {
        match outcome {
            Err(error) if error.cause != RunErrorCause::Interrupt && self.is_empty() => {
                self.discard()?;
                Err(error)
            }
            outcome => with_kept(outcome, &kept(&self), Some(resumable)).map(|()| self),
        }
    }

    /// Sorts the episodes of a complete evaluation and writes its results, if it has a folder.
    pub(crate) fn write_results(&mut self) -> Result<(), RunError> {
        self.sort()?;
        let Some(dir) = &self.run.out else { return Ok(()) };
        softvtbench_files::write_scores(dir, &self.records, &self.run.calibrations.merged.released())?;
        self.write_summary()
    }

    /// Writes the summary. A folder with a summary counts as finished.
    pub(crate) fn write_summary(&self) -> Result<(), RunError> {
        if let Some(dir) = &self.run.out {
            files::write_json(&dir.join(SUMMARY), &self.summary())?;
        }
        Ok(self.attempts.as_ref().map_or(Ok(()), |attempts| attempts.remove())?)
    }

    pub(crate) fn summary(&self) -> SuiteSummary {
        SuiteSummary::from_records(&self.run.name, &self.run.config.policy.name, &self.records)
    }

    fn into_result(self) -> SuiteResult {
        SuiteResult { folder: self.run.out.clone(), summary: self.summary(), records: self.records }
    }
}

/// Adds to the outcome of a run what it kept, and reports an interrupt with `hint` on how to continue.
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
            Err(RunError { resumable, ..RunError::interrupted(format_args!("interrupted; {kept}")) })
        }
    }
}

/// Runs the episodes of a prepared suite, into its folder if it has one, and calls `on_episode` for each one that it
/// has run, in the order in which they end. Episodes that are in the folder already are kept.
pub(crate) fn run_suite(
    run: &PreparedRun,
    on_episode: &mut dyn FnMut(&EpisodeRecord),
) -> Result<SuiteResult, RunError> {
    let config = run.config;
    let manifest = run.manifest(config.episodes_of(run.suite));
    // The same command again on a finished folder changes nothing, even without --resume.
    let finished = run.out.as_deref().filter(|out| is_finished(out) && manifest.is_in(out));
    let mut log = RunLog::open(run, &manifest, config.resume || finished.is_some())?;
    let artifacts = run.artifacts();
    let remaining = run.jobs.without(log.records.iter().map(|record| record.header.id.index()));
    let is_whole = |out: &&Path| {
        remaining.is_empty()
            && softvtbench_files::has_scores(out)
            && log.records.iter().all(|record| artifacts.missing(record).is_empty())
    };
    if let Some(out) = finished.filter(is_whole) {
        config.notice(format_args!("{} is already complete", out.display()));
        return Ok(log.into_result());
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
        let (origin, keep_states) = (run.import.origins.get(&job.index()), artifacts.may_render(job.episode));
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
        let list = config.job_list(&format!("running {}", run.name));
        log.run_jobs(&list, &remaining, simulate, |finished| artifacts.write(finished), line)
    });
    match &run.out {
        Some(out) => {
            let all = counted(run.jobs.len(), "episode");
            let kept = |log: &RunLog| format!("{} of {all} are in {}", log.records.len(), out.display());
            log = log.end(outcome, kept, out)?;
            log.write_results()?;
            config.notice(out.display());
        }
        None => {
            outcome?;
            if cancel::requested() {
                return Err(RunError::interrupted("interrupted"));
            }
            log.sort()?;
        }
    }
    Ok(log.into_result())
}

/// True if a folder contains a finished run.
pub(crate) fn is_finished(dir: &Path) -> bool {
    dir.join(SUMMARY).is_file() && dir.join(RUN).is_file()
}

/// Reports an episode whose video or MCAP file could not be written. The episode counts nevertheless.
fn report_unrendered(config: &RunConfig, index: EpisodeIndex, rendered: Result<(), RunError>) {
    if let Err(error) = rendered {
        config.notice(format_args!("warning: {index} lacks a file: {error}"));
    }
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
pub(crate) fn restore_artifacts(run: &PreparedRun, records: &[EpisodeRecord]) -> Result<(), RunError> {
    let artifacts = run.artifacts();
    let incomplete = records.iter().filter(|record| !artifacts.missing(record).is_empty());
    let has_actions = |record: &EpisodeRecord| artifacts.has_actions(record);
    for record in records {
        let path = actions::path(artifacts.dir, record.header.id.index());
        if let (true, Err(damage)) = (path.is_file(), actions::read_checked(artifacts.dir, record)) {
            run.config.notice(damage);
        }
    }
    let (restorable, lost): (Vec<_>, Vec<_>) =
        incomplete.partition(|record| has_actions(record) || run.config.policy.profile().is_none());
    if let Some(first) = lost.first() {
        run.config.notice(format_args!(
            "{} finished episodes lack their actions, so their files cannot be restored (first: {}); their results stay",
            lost.len(),
            first.header.id.index()
        ));
    }
    if let Some(path) = restorable.first().and_then(|record| artifacts.missing(record).into_iter().next()) {
        run.config.notice(format_args!(
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
        let recorded = actions::read_checked(artifacts.dir, record)?;
        run.run_episode(job, keep_states, &replay_factory(recorded, record))?
    } else {
        run.run_episode(job, keep_states, &run.controllers)?
    };
    finished.record = with_policy_fields(finished.record, record);
    if let Some(difference) = difference(record, &finished.record)? {
        run.config.notice(format_args!(
            "files of {index} are not restored: the simulation differs from its record ({difference}); its results stay"
        ));
        return Ok(None);
    }
    let rendered = artifacts.render(&mut finished);
    Ok(Some(SimulatedEpisode { finished, rendered }))
}
