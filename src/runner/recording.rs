//! Recording of datasets: attempts at demonstrations, of which the good ones are kept.
//!
//! Attempts are numbered. The dataset depends only on their numbers and outcomes, not on the order in which they
//! finish. All files of an attempt are complete before its line is in `attempts/<suite>/episodes.jsonl`, and the file
//! of a task is merged from them, so an interrupted recording can be continued.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use serde_json::{Value, json};

use crate::{
    config::RunConfig,
    episode_list::{EpisodeJob, EpisodeList},
    error::RunError,
    evaluate::{RunLog, SimulatedEpisode},
    policy::ControllerFactory,
    suite_run::{PreparedRun, SuiteRun},
    suite_selection::path_component,
};
use softvt_benchmark::{CONTROL_HZ, Suite, Task};
use softvt_common::{
    cancel,
    episode_id::{EpisodeIndex, EpisodeSplit},
    files, parallel,
    text::counted,
};
use softvt_dataset::{
    OptionalStream,
    card::{DatasetCard, KeptOutcome, TaskCount, rejection_counts},
    demonstration_writer::DemonstrationWriter,
    layout::{self, DATASET, MANIFEST, PARTS, RECORDING, TaskPaths, VIDEO_STREAMS},
    manifest::{self, ManifestEntry},
    merge_parts,
};
use softvt_evaluation::verdict::Outcome;
use softvt_policy::{builtin::RecordedPolicy, profile::GripCode};
use softvt_rollout::{ChunkedPolicy, EpisodeError, FinishedEpisode, SettleError};
use softvt_runs::{
    actions,
    json_difference::json_difference,
    manifest::RunManifest,
    record::{DemonstrationOrigin, EpisodeRecord},
    run_folder::remove_folder_if_present,
};
use softvt_scene::InitialStateOverride;
use softvt_script::LoadedScript;

/// Prefix of the error of an attempt that could not start from the state of its demonstration.
const START_FAILED: &str = "cannot reproduce the initial state: ";

#[derive(Clone, Debug)]
pub struct RecordingOptions {
    /// Output folder: a new one, or with `resume` that of an interrupted recording.
    pub out: PathBuf,
    /// True if images go into the HDF5 files too; they are in the videos anyway.
    pub has_images: bool,
    /// True to add the true state: node positions, deformation, contacts, forces.
    pub has_privileged: bool,
    pub streams: BTreeSet<OptionalStream>,
    pub resume: bool,
    /// Outcome that an attempt must have to be kept.
    pub keep: KeptOutcome,
    /// Grip code of exports that name none.
    pub gripper: Option<GripCode>,
}

/// Per attempt and control step: true if the gripper is intended to hold.
pub type HoldingLog = Arc<Mutex<BTreeMap<EpisodeIndex, Vec<bool>>>>;

/// A suite that is being recorded: rounds of attempts, the files of the good ones, and one merged file per task.
pub struct SuiteRecording<'a> {
    options: &'a RecordingOptions,
    run: PreparedRun<'a>,
    tasks: Vec<&'a Task>,
    /// Name of the suite as a path component.
    folder_name: String,
    /// Demonstrations that each task must have: its first good attempts. `None` to keep all good attempts.
    demos: Option<u32>,
    grip_log: HoldingLog,
    manifest: RunManifest,
    /// Environment arguments of the HDF5 files, in robomimic's form.
    environment: Value,
}

impl RecordingOptions {
    /// Adds the options that not every request has.
    pub(crate) fn describe(&self, request: &mut Value) {
        if !self.streams.is_empty() {
            request["streams"] = json!(self.streams);
        }
        if !self.keep.is_safe() {
            request["keep"] = json!(self.keep);
        }
    }
}

impl<'a> SuiteRecording<'a> {
    /// Prepares a recording of at most the attempts `jobs`. `customize` gives the run its controllers, which record
    /// the intent to grip.
    ///
    /// # Errors
    /// A setting or scene that is not valid, or a secret seed.
    pub fn new(
        config: &'a RunConfig,
        options: &'a RecordingOptions,
        loaded: &'a LoadedScript,
        suite: &'a Suite,
        jobs: EpisodeList<'a>,
        demos: Option<u32>,
        customize: impl FnOnce(SuiteRun<'a>, &HoldingLog) -> Result<SuiteRun<'a>, RunError>,
    ) -> Result<Self, RunError> {
        if config.secret.is_some() {
            let message =
                "a recording has no secret seed: demonstrations would show the episodes of a judged run";
            return Err(config.error(message));
        }
        let folder_name = path_component(&config.suite_name(suite));
        let run = SuiteRun {
            out: Some(layout::attempts(&options.out, &folder_name)),
            renders_episodes: true,
            // The streams of contact, slip and drop come from the trace.
            records_trace: true,
            ..SuiteRun::new(config, loaded, suite, jobs, EpisodeSplit::Demonstration)?
        };
        let grip_log = HoldingLog::default();
        let run = customize(run, &grip_log)?.prepare()?;
        let tasks = run.jobs.tasks();
        let attempts = tasks.iter().map(|task| run.jobs.episodes_of(task.id).count());
        let episodes = demos.unwrap_or(attempts.max().unwrap_or_default() as u32);
        let manifest = run.manifest(episodes);
        let recorded = RunManifest { folder: None, ..manifest.clone() };
        let environment = json!({ "env_name": "softvt", "type": 2, "env_kwargs": recorded });
        Ok(Self { options, run, tasks, folder_name, demos, grip_log, manifest, environment })
    }

    /// Records all tasks of the suite, and returns the records of all attempts.
    fn record(&self) -> Result<Vec<EpisodeRecord>, RunError> {
        let mut log = RunLog::open(&self.run, &self.manifest, true)?;
        let (outcome, out) = (self.run_rounds(&mut log), &self.options.out);
        let kept = |log: &RunLog| {
            let kept = log.records.iter().filter(|record| self.is_kept(record)).count();
            format!("{} in {}", counted(kept, "demonstration"), out.display())
        };
        let mut log = log.end(outcome, kept, out)?;
        log.sort()?;
        self.check_demo_counts(&log.records)?;
        log.write_summary()?;
        Ok(log.records)
    }

    /// Runs attempts until every task has its demonstrations or has used up its attempts.
    fn run_rounds(&self, log: &mut RunLog) -> Result<(), RunError> {
        let dir = self.run.artifacts().dir;
        let write_actions = |finished: &FinishedEpisode| {
            let path = actions::path(dir, finished.record.header.id.index());
            Ok(actions::write(&path, &finished.actions)?)
        };
        let list = self.run.config.job_list(&format!("recording {}", self.folder_name));
        loop {
            let due = |task: &'a Task| {
                self.due(&log.records, task.id).into_iter().map(move |episode| EpisodeJob { task, episode })
            };
            let jobs = EpisodeList::listed(self.tasks.iter().flat_map(|task| due(task)));
            if !jobs.is_empty() {
                let record =
                    |job| Ok(SimulatedEpisode { finished: self.record_attempt(job)?, rendered: Ok(()) });
                let line = |record: &EpisodeRecord| attempt_line(record, self.options.keep);
                log.run_jobs(&list, &jobs, record, write_actions, line)?;
            }
            self.merge_tasks(&log.records)?;
            if jobs.is_empty() || cancel::requested() {
                return Ok(());
            }
        }
    }

    fn is_kept(&self, record: &EpisodeRecord) -> bool {
        rejection(record, self.options.keep).is_none()
    }

    fn due(&self, records: &[EpisodeRecord], task: usize) -> Vec<u32> {
        let attempts = self.run.jobs.episodes_of(task);
        let finished = records.iter().filter(|record| record.header.id.task == task);
        let finished = finished.map(|record| (record.header.id.episode, self.is_kept(record))).collect();
        due(&attempts.collect::<Vec<_>>(), &finished, self.demos.map_or(usize::MAX, |demos| demos as usize))
    }

    /// Runs an attempt and, if it is good, writes the files of its demonstration.
    fn record_attempt(&self, job: EpisodeJob) -> Result<FinishedEpisode, RunError> {
        let mut finished = self.run_attempt(job)?;
        let recorded_grip = parallel::lock(&self.grip_log).remove(&job.index());
        let states = finished.recording.take();
        let Some(mut states) = states.filter(|_| self.is_kept(&finished.record)) else {
            return Ok(finished);
        };
        let commanded_grip = || finished.actions.iter().map(|action| action.closure() > 0.5).collect();
        let mut is_holding: Vec<bool> = recorded_grip.unwrap_or_else(commanded_grip);
        // The recorded grip can have fewer entries than there are steps, or more. The last one continues.
        is_holding.resize(finished.actions.len(), is_holding.last().copied().unwrap_or_default());
        let (paths, attempt) = (self.paths(job.task.id), job.episode);
        let writer = DemonstrationWriter {
            hdf5: paths.part(attempt, "hdf5"),
            videos: VIDEO_STREAMS.map(|video| paths.part(attempt, &format!("{video}.mp4"))),
            preview: paths.part(attempt, "preview.mp4"),
            store_images: self.options.has_images,
            has_privileged: self.options.has_privileged,
            streams: &self.options.streams,
            environment: &self.environment,
        };
        writer.write(&finished, &mut states, &is_holding, cancel::requested)?;
        Ok(finished)
    }

    /// Simulates an attempt. One that cannot start from the state of its foreign demonstration becomes a failed attempt
    /// from the state of the layout.
    fn run_attempt(&self, job: EpisodeJob) -> Result<FinishedEpisode, RunError> {
        let run = &self.run;
        let origin = run.import.origins.get(&job.index());
        let error = match (run.simulate(job, origin, true, &run.controllers, &mut |_| Ok(()))?, origin) {
            (Ok(finished), _) => return Ok(finished),
            (Err(error), Some(origin))
                if is_start_error(&error) && origin.start != InitialStateOverride::default() =>
            {
                error
            }
            (Err(error), _) => return Err(run.episode_error(&error)),
        };
        let ending = format!("{START_FAILED}{error}");
        let failing: ControllerFactory = Box::new(move |_, brief| {
            let policy = RecordedPolicy::new(Vec::new(), Some(ending.clone()));
            Ok(Box::new(ChunkedPolicy::new(Box::new(policy), brief, 1)))
        });
        let layout_start = origin
            .map(|origin| DemonstrationOrigin { start: InitialStateOverride::default(), ..origin.clone() });
        run.simulate(job, layout_start.as_ref(), true, &failing, &mut |_| Ok(()))?
            .map_err(|error| run.episode_error(&error))
    }

    fn paths(&self, task: usize) -> TaskPaths {
        TaskPaths { root: self.options.out.clone(), suite: self.folder_name.clone(), task }
    }

    /// Merges the demonstrations of the tasks that have them all, tasks at the same time.
    fn merge_tasks(&self, records: &[EpisodeRecord]) -> Result<(), RunError> {
        let complete = |task: &&Task| {
            let kept = kept(records, task.id, self.options.keep);
            let is_complete = match self.demos {
                Some(required) => kept.len() == required as usize,
                None => self.due(records, task.id).is_empty(),
            };
            (!kept.is_empty() && is_complete).then_some((task.id, kept))
        };
        let complete: Vec<_> = self.tasks.iter().filter_map(complete).collect();
        let merge = |job: usize| {
            let (task, kept) = &complete[job];
            self.merge_task(*task, kept)
        };
        // Also after a request to stop: what is complete stays.
        parallel::run(complete.len(), self.run.config.thread_count(), || false, merge, |_, ()| Ok(()))
    }

    /// Merges the demonstrations of a task into one file, unless it exists, and removes their parts.
    fn merge_task(&self, task: usize, kept: &[&EpisodeRecord]) -> Result<(), RunError> {
        let paths = self.paths(task);
        if !paths.hdf5().is_file() {
            for (demo, record) in kept.iter().enumerate() {
                for file in paths.video_moves(record.header.id.episode, demo) {
                    move_part(&file.part, &file.target)?;
                }
            }
            let parts: Vec<PathBuf> = kept.iter().map(|r| paths.part(r.header.id.episode, "hdf5")).collect();
            merge_parts(&parts, &paths.hdf5(), &self.environment)?;
        }
        Ok(remove_folder_if_present(&paths.parts())?)
    }

    /// Checks that every task has its demonstrations.
    fn check_demo_counts(&self, records: &[EpisodeRecord]) -> Result<(), RunError> {
        let Some(required) = self.demos.map(|demos| demos as usize) else { return Ok(()) };
        let short =
            self.tasks.iter().map(|task| self.count(task, records)).filter(|count| count.demos < required);
        let short = short.map(|count| {
            format!(
                "{}: task {}: {} of {} after {} ({})",
                self.folder_name,
                count.task,
                count.demos,
                counted(required, "demonstration"),
                counted(count.attempts, "attempt"),
                rejection_counts(&count.rejected)
            )
        });
        let short: Vec<String> = short.collect();
        if short.is_empty() {
            return Ok(());
        }
        Err(self.run.config.error(format_args!(
            "{}\nthe good ones are in {}; resume it with more attempts, or fix the expert",
            short.join("\n"),
            self.options.out.display()
        )))
    }

    /// Counts of a task, without the sizes of its files.
    fn count(&self, task: &Task, records: &[EpisodeRecord]) -> TaskCount {
        let kept = kept(records, task.id, self.options.keep);
        let attempts = || records.iter().filter(|record| record.header.id.task == task.id);
        let mut rejected = BTreeMap::new();
        for reason in attempts().filter_map(|record| rejection(record, self.options.keep)) {
            *rejected.entry(reason).or_insert(0) += 1;
        }
        TaskCount {
            suite: self.folder_name.clone(),
            task: task.id,
            prompt: task.prompt.clone(),
            asset: attempts().next().map_or(String::new(), |record| record.header.asset.clone()),
            demos: kept.len(),
            samples: kept.iter().map(|record| record.stats.steps as usize).sum(),
            attempts: attempts().count(),
            rejected,
            hdf5_bytes: 0,
            video_bytes: 0,
        }
    }
}

/// Moves a part to its final path, unless an interrupted recording has done so already.
fn move_part(part: &Path, path: &Path) -> Result<(), RunError> {
    if !part.is_file() && path.is_file() {
        return Ok(());
    }
    files::create_parent(path)?;
    Ok(files::rename(part, path)?)
}

/// Attempts at a task that became demonstrations, in order.
fn kept(records: &[EpisodeRecord], task: usize, keep: KeptOutcome) -> Vec<&EpisodeRecord> {
    let is_kept =
        |record: &&EpisodeRecord| record.header.id.task == task && rejection(record, keep).is_none();
    let mut kept: Vec<_> = records.iter().filter(is_kept).collect();
    kept.sort_by_key(|record| record.header.id.episode);
    kept
}

/// True if an episode failed before its first step.
fn is_start_error(error: &EpisodeError) -> bool {
    match error {
        EpisodeError::Build(_) => true,
        EpisodeError::Settle { source, .. } => !matches!(source, SettleError::Interrupted),
        _ => false,
    }
}

/// The attempts to run next, so that the first `demos` good ones are found whatever the order in which attempts
/// finish. `finished` maps each finished attempt to true if it is good.
fn due(attempts: &[u32], finished: &BTreeMap<u32, bool>, demos: usize) -> Vec<u32> {
    let mut end = 0;
    loop {
        let missing = attempts[..end].iter().copied().filter(|attempt| !finished.contains_key(attempt));
        let missing: Vec<u32> = missing.collect();
        let good = attempts[..end].iter().filter(|attempt| finished.get(attempt) == Some(&true)).count();
        if !missing.is_empty() || good >= demos || end == attempts.len() {
            return missing;
        }
        end = end.saturating_add(demos - good).min(attempts.len());
    }
}

/// The reason for which an attempt is not kept. `None` if it is.
fn rejection(record: &EpisodeRecord, keep: KeptOutcome) -> Option<String> {
    let verdict = &record.verdict;
    let reason = match &record.outcome {
        _ if verdict.safety || (keep == KeptOutcome::Goal && verdict.goal) => return None,
        Outcome::Invalid { reason, .. } => return Some(format!("invalid ({reason})")),
        Outcome::Error { message } if message.starts_with(START_FAILED) => "could not start",
        Outcome::Error { .. } => "ended by an error",
        _ if record.stats.gave_up.is_some() => "given up",
        _ if !verdict.goal => "goal not reached",
        _ if !verdict.no_drop => "dropped",
        _ if record.is_within_limits() == Some(false) => "deformed too much",
        _ if verdict.slip_ok == Some(false) => "slipped in the hand",
        _ if record.lacks_limit() => "without a known limit of deformation",
        _ => "not safe",
    };
    Some(reason.to_owned())
}

/// Formats an attempt as one line of progress.
fn attempt_line(record: &EpisodeRecord, keep: KeptOutcome) -> String {
    let id = &record.header.id;
    let result = match (rejection(record, keep), &record.outcome) {
        (None, _) => "kept".to_owned(),
        (Some(reason), Outcome::Error { message }) => format!("not kept: {reason} ({message})"),
        (Some(reason), _) => format!("not kept: {reason}"),
    };
    format!("task {} attempt {}: {result}, {:.1} s simulated", id.task, id.episode, record.stats.time_s)
}

pub struct RecordingSummary {
    pub tasks: Vec<TaskCount>,
    pub manifest: PathBuf,
}

impl RecordingSummary {
    pub fn text(&self) -> String {
        let line = |task: &TaskCount| {
            format!(
                "{} task {}: {} from {}, {}, {:.1} MB; not kept: {}\n",
                task.suite,
                task.task,
                counted(task.demos, "demonstration"),
                counted(task.attempts, "attempt"),
                counted(task.samples, "step"),
                (task.hdf5_bytes + task.video_bytes) as f64 / 1e6,
                rejection_counts(&task.rejected)
            )
        };
        self.tasks.iter().map(line).collect()
    }
}

/// Records a dataset. `request` describes it in `recording.json`; `prepare` returns its prepared suites. Returns `None`
/// if the folder contains this very dataset already.
///
/// # Errors
/// The folder contains something else, an attempt or a file fails, or too few attempts are good.
pub fn record_all<'a>(
    options: &'a RecordingOptions,
    request: &Value,
    prepare: impl FnOnce() -> Result<Vec<SuiteRecording<'a>>, RunError>,
) -> Result<Option<RecordingSummary>, RunError> {
    let root = &options.out;
    if check_folder(root, options.resume, request)? {
        return Ok(None);
    }
    let missing = files::missing_folders(root);
    // Preparation takes long, so a folder that cannot be written to is reported first.
    let prepared = files::create_writable_folder(root).map_err(RunError::from).and_then(|()| prepare());
    let suites = prepared.inspect_err(|_| files::remove_empty_folders(&missing))?;
    files::write_json(&root.join(RECORDING), request)?;
    let mut records = Vec::new();
    for suite in &suites {
        records.push(suite.record().inspect_err(|_| remove_if_empty(root, &missing))?);
    }
    write_summary(options, &suites, &records).map(Some)
}

/// Checks that a dataset can be recorded into a folder. Returns true if it contains this very recording, complete.
fn check_folder(root: &Path, resume: bool, request: &Value) -> Result<bool, RunError> {
    let path = root.join(RECORDING);
    let refuse = |message: String| Err(RunError::of_setting("out", root.display(), message));
    if !path.is_file() {
        let found = fs::read_dir(root).ok().and_then(|mut entries| entries.next()?.ok());
        return match found {
            None => Ok(false),
            Some(entry) => refuse(format!(
                "the folder contains {} but no softvt recording; nothing was written; select a new folder",
                entry.file_name().to_string_lossy()
            )),
        };
    }
    let stored: Value = serde_json::from_str(&files::read_text(&path)?)
        .map_err(|e| RunError::input(format_args!("{} is not a softvt recording: {e}", path.display())))?;
    if let Some(difference) = json_difference(&stored, request) {
        return refuse(format!(
            "the folder contains another recording ({difference}); select a new folder, or use its original arguments"
        ));
    }
    let is_complete = root.join(DATASET).is_file();
    if !resume && !is_complete {
        let interrupted = RunError::of_setting(
            "out",
            root.display(),
            "the folder contains an interrupted recording; select a new folder for another",
        );
        return Err(RunError { resumable: Some(root.to_owned()), ..interrupted });
    }
    Ok(is_complete)
}

/// Removes a recording that has no attempts, and the folders that were `missing` before it.
fn remove_if_empty(root: &Path, missing: &[PathBuf]) {
    let attempts = root.join(layout::ATTEMPTS);
    // Fails for a folder that is not empty. Then recording.json must stay, since it says what the attempts are of.
    let _ = fs::remove_dir(&attempts);
    let is_gone = fs::symlink_metadata(&attempts).is_err_and(|error| error.kind() == ErrorKind::NotFound);
    if is_gone {
        let _ = fs::remove_dir_all(root.join(PARTS));
        let _ = fs::remove_file(root.join(RECORDING));
        files::remove_empty_folders(missing);
    }
}

fn write_summary(
    options: &RecordingOptions,
    suites: &[SuiteRecording],
    records: &[Vec<EpisodeRecord>],
) -> Result<RecordingSummary, RunError> {
    let root = &options.out;
    let (mut entries, mut tasks) = (Vec::new(), Vec::new());
    let size = |path: &Path| fs::metadata(path).map_or(0, |metadata| metadata.len());
    for (suite, records) in suites.iter().zip(records) {
        for task in &suite.tasks {
            let paths = suite.paths(task.id);
            let kept = kept(records, task.id, options.keep).into_iter().enumerate();
            let new: Vec<ManifestEntry> =
                kept.map(|(demo, record)| ManifestEntry::new(&paths, demo, record)).collect();
            let videos = new.iter().flat_map(|entry| entry.video_files.values());
            let video_bytes = videos.map(|file| size(&root.join(file))).sum();
            tasks.push(TaskCount {
                hdf5_bytes: size(&paths.hdf5()),
                video_bytes,
                ..suite.count(task, records)
            });
            entries.extend(new);
        }
    }
    if entries.is_empty() {
        let reasons: Vec<String> = tasks
            .iter()
            .map(|task| format!("{} task {}: {}", task.suite, task.task, rejection_counts(&task.rejected)))
            .collect();
        return Err(RunError::input(format_args!(
            "no demonstration was kept: {}; all attempts are in {}/attempts",
            reasons.join("; "),
            root.display()
        )));
    }
    manifest::write(root, &entries)?;
    let _ = fs::remove_dir(root.join(PARTS));
    let card = DatasetCard {
        softvt: env!("CARGO_PKG_VERSION").to_owned(),
        fps: CONTROL_HZ,
        has_images: options.has_images,
        has_privileged: options.has_privileged,
        streams: options.streams.clone(),
        keep: options.keep,
        gripper: options.gripper,
        imported: suites.first().map(|suite| suite.run.import.files.clone()).unwrap_or_default(),
        tasks,
    };
    card.write(root)?;
    Ok(RecordingSummary { tasks: card.tasks, manifest: root.join(MANIFEST) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs attempts that are kept if `good` is true of their number. Returns their numbers and how many were kept. If
    /// `interrupted`, only the last attempt of each round finishes.
    fn record(good: impl Fn(u32) -> bool, demos: u32, max: u32, interrupted: bool) -> (BTreeSet<u32>, usize) {
        let (attempts, mut done) = ((0..max).collect::<Vec<_>>(), BTreeMap::new());
        loop {
            let mut next = due(&attempts, &done, demos as usize);
            if next.is_empty() {
                let kept = done.values().filter(|good| **good).count();
                return (done.into_keys().collect(), kept);
            }
            if interrupted {
                next = next.split_off(next.len() - 1);
            }
            done.extend(next.into_iter().map(|attempt| (attempt, good(attempt))));
        }
    }

    #[test]
    fn attempts_depend_only_on_the_outcomes_of_earlier_ones() {
        let good = |attempt: u32| !attempt.is_multiple_of(3);
        let (run, kept) = record(good, 10, 100, false);
        assert_eq!(run, (0..15).collect(), "attempt 14 is the tenth good one");
        assert_eq!(kept, 10);
        assert_eq!(record(good, 10, 100, true), (run, kept));
        assert_eq!(record(|_| true, 7, 100, false), ((0..7).collect(), 7));
    }

    #[test]
    fn attempts_stop_at_their_maximum() {
        assert_eq!(record(|_| false, 5, 12, false), ((0..12).collect(), 0));
        assert_eq!(record(|attempt| attempt == 3, 2, 8, true), ((0..8).collect(), 1));
    }
}
