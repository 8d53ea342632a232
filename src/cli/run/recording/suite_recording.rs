//! Recording of one suite: rounds of attempts, the files of the good ones, and one merged file per task.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::ErrorKind,
    path::{Path, PathBuf},
};

use serde_json::{Value, json};

use super::{RecordingConfig, dataset_error, summary};
use crate::{
    benchmark::{Suite, Task},
    cli::{
        error::{CliError, Exit},
        output::Progress,
        run::{
            demo_selection::{START_FAILED, attempt_line, due, rejection},
            grip_recorder::GripLog,
            policy::ControllerFactory,
            run_manifest::{self, RunManifest},
            selection::{EpisodeJob, path_component},
            suite_run::SuiteRun,
        },
    },
    dataset::{
        Demonstration,
        card::rejection_counts,
        demonstration_writer::DemonstrationWriter,
        layout::{self, TaskPaths, VIDEO_STREAMS},
        merge_parts,
    },
    evaluation::{
        episode_id::Split,
        record::{EpisodeRecord, Origin},
    },
    files::{self, FileError},
    parallel,
    policy::{ChunkedPolicy, builtin::RecordedPolicy},
    report::{
        actions,
        run_folder::{RunFolder, SUMMARY},
    },
    rollout::{EpisodeError, FinishedEpisode, SettleError, cancel},
    scene::InitialState,
    script::LoadedScript,
    text::counted,
};

/// The attempts at each task, and which of them become demonstrations.
#[derive(Clone, Debug)]
pub(crate) enum AttemptPlan {
    /// The first `demos` good ones per task, of at most `max_attempts`.
    First { demos: u32, max_attempts: u32 },
    /// All good ones of these attempts, by task.
    All(BTreeMap<usize, BTreeSet<u32>>),
}

impl AttemptPlan {
    /// All attempts at a task that may be needed.
    fn attempts(&self, task: usize) -> Vec<u32> {
        match self {
            Self::First { max_attempts, .. } => (0..*max_attempts).collect(),
            Self::All(all) => all.get(&task).into_iter().flatten().copied().collect(),
        }
    }

    /// Attempts to run next. `finished` maps each finished attempt to true if it is good.
    fn due(&self, task: usize, finished: &BTreeMap<u32, bool>) -> Vec<u32> {
        match self {
            Self::First { demos, max_attempts } => due(finished, *demos, *max_attempts),
            Self::All(_) => self.attempts(task).into_iter().filter(|i| !finished.contains_key(i)).collect(),
        }
    }

    /// Demonstrations that each task must have. `None` if any number is enough.
    fn required_demos(&self) -> Option<usize> {
        match self {
            Self::First { demos, .. } => Some(*demos as usize),
            Self::All(_) => None,
        }
    }

    /// Episodes per task, as `run.json` counts them.
    fn episodes(&self) -> u32 {
        match self {
            Self::First { demos, .. } => *demos,
            Self::All(all) => all.values().map(BTreeSet::len).max().unwrap_or_default() as u32,
        }
    }
}

/// A suite that is being recorded.
pub(crate) struct SuiteRecording<'a> {
    config: &'a RecordingConfig,
    root: PathBuf,
    /// The attempts.
    pub(super) run: SuiteRun<'a>,
    pub(super) tasks: Vec<&'a Task>,
    /// Name of the suite as a path component.
    pub(super) folder_name: String,
    plan: AttemptPlan,
    grip_log: GripLog,
    manifest: Value,
    /// Environment arguments of the HDF5 files, in robomimic's form.
    environment: Value,
    /// Records of the finished attempts.
    pub(super) records: Vec<EpisodeRecord>,
}

impl<'a> SuiteRecording<'a> {
    /// Prepares the tasks of a suite. `customize` selects the controllers, and where the intent to grip is recorded.
    ///
    /// # Errors
    /// A setting or scene that is not valid.
    pub(crate) fn new(
        config: &'a RecordingConfig,
        loaded: &'a LoadedScript,
        suite: &'a Suite,
        tasks: Vec<&'a Task>,
        plan: AttemptPlan,
        customize: impl FnOnce(&mut SuiteRun<'a>, &GripLog) -> Result<(), CliError>,
    ) -> Result<Self, CliError> {
        let root = config.root();
        let folder_name = path_component(&config.run.suite_name(suite));
        let attempts = |task: &'a Task| {
            plan.attempts(task.id).into_iter().map(move |episode| EpisodeJob { task, episode })
        };
        let jobs = tasks.iter().flat_map(|task| attempts(task)).collect();
        let dir = layout::attempts(&root, &folder_name);
        let mut run = SuiteRun::new(&config.run, loaded, suite, jobs, dir)?;
        run.split = Split::Demonstration;
        run.renders_episodes = true;
        let grip_log = GripLog::default();
        customize(&mut run, &grip_log)?;
        run.prepare(&tasks)?;
        let manifest = json!(RunManifest::new(&run, &tasks, plan.episodes()));
        let environment = json!({ "env_name": "softvt", "type": 2, "env_kwargs": manifest });
        Ok(Self {
            config,
            root,
            run,
            tasks,
            folder_name,
            plan,
            grip_log,
            manifest,
            environment,
            records: Vec::new(),
        })
    }

    /// Records all tasks of the suite.
    ///
    /// # Errors
    /// The folder contains other attempts, an attempt or a file fails, or too few attempts are good.
    /// Finished attempts are kept.
    pub(super) fn record(&mut self) -> Result<(), CliError> {
        let (mut folder, records) = RunFolder::resume(&self.run.out).map_err(CliError::input)?;
        self.run.check_records(&folder, &records)?;
        run_manifest::write(&folder, &self.manifest)?;
        self.records = records;
        let outcome = self.run_rounds(&mut folder);
        if outcome.is_err() && self.records.is_empty() {
            // The same command must work once the error is fixed, and there is nothing to keep.
            folder.discard().map_err(CliError::input)?;
            return outcome;
        }
        self.records.sort_by_key(|record| record.header.id.index());
        folder.write_in_order(&self.records).map_err(CliError::input)?;
        let kept = self.records.iter().filter(|record| rejection(record).is_none()).count();
        let kept =
            format!("{} in {}; continue with --resume", counted(kept, "demonstration"), self.root.display());
        let interrupted = || Err(CliError::interrupted(format!("interrupted; {kept}")));
        match outcome {
            Err(error) if error.exit == Exit::Interrupted => interrupted(),
            Err(error) => Err(error.with_line(&kept)),
            Ok(()) if cancel::requested() => interrupted(),
            Ok(()) => {
                self.check_demo_counts()?;
                let result = self.run.summarize(self.records.clone());
                files::write_json(&self.run.out.join(SUMMARY), &result.summary).map_err(CliError::input)
            }
        }
    }

    /// Runs attempts until every task has its demonstrations or has used up its attempts.
    fn run_rounds(&mut self, folder: &mut RunFolder) -> Result<(), CliError> {
        loop {
            let jobs: Vec<EpisodeJob> = self
                .tasks
                .iter()
                .flat_map(|task| self.due(task.id).into_iter().map(|episode| EpisodeJob { task, episode }))
                .collect();
            if !jobs.is_empty() {
                self.run_attempts(&jobs, folder)?;
            }
            for task in &self.tasks {
                let kept = self.kept(task.id).len();
                let is_complete = match self.plan.required_demos() {
                    Some(required) => kept == required,
                    None => self.due(task.id).is_empty(),
                };
                if kept > 0 && is_complete {
                    self.merge_task(task.id)?;
                }
            }
            if jobs.is_empty() || cancel::requested() {
                return Ok(());
            }
        }
    }

    fn due(&self, task: usize) -> Vec<u32> {
        let attempts = self.records.iter().filter(|record| record.header.id.task == task);
        let finished =
            attempts.map(|record| (record.header.id.episode, rejection(record).is_none())).collect();
        self.plan.due(task, &finished)
    }

    /// Attempts at a task that became demonstrations, in order.
    pub(super) fn kept(&self, task: usize) -> Vec<&EpisodeRecord> {
        let is_kept = |record: &&EpisodeRecord| record.header.id.task == task && rejection(record).is_none();
        let mut kept: Vec<_> = self.records.iter().filter(is_kept).collect();
        kept.sort_by_key(|record| record.header.id.episode);
        kept
    }

    fn run_attempts(&mut self, jobs: &[EpisodeJob<'a>], folder: &mut RunFolder) -> Result<(), CliError> {
        let mut progress = Progress::new(jobs.len(), &self.folder_name);
        let mut records = std::mem::take(&mut self.records);
        let recording = &*self;
        let outcome = parallel::run(
            jobs.len(),
            self.config.run.threads,
            cancel::requested,
            |index| recording.record_attempt(jobs[index]),
            |_, finished| {
                let index = finished.record.header.id.index();
                let path = actions::path(&recording.run.out, index);
                actions::write(&path, &finished.actions).map_err(CliError::input)?;
                folder.append(&finished.record).map_err(CliError::input)?;
                progress.tick(&attempt_line(&finished.record));
                records.push(finished.record);
                Ok(())
            },
        );
        progress.finish();
        self.records = records;
        outcome
    }

    /// Runs an attempt and, if it is good, writes the files of its demonstration.
    fn record_attempt(&self, job: EpisodeJob<'a>) -> Result<FinishedEpisode, CliError> {
        let mut finished = self.run_attempt(job)?;
        let recorded_grip = parallel::lock(&self.grip_log).remove(&job.index());
        let states = finished.recording.take();
        let Some(mut states) = states.filter(|_| rejection(&finished.record).is_none()) else {
            return Ok(finished);
        };
        let commanded_grip = || finished.actions.iter().map(|action| action.closure > 0.5).collect();
        let mut is_holding: Vec<bool> = recorded_grip.unwrap_or_else(commanded_grip);
        // The recorded grip can have fewer entries than there are steps, or more. The last one continues.
        is_holding.resize(finished.actions.len(), is_holding.last().copied().unwrap_or_default());
        let demonstration = Demonstration::new(&finished, &states, is_holding, self.config.with_privileged);
        let (paths, attempt) = (self.paths(job.task.id), job.episode);
        let writer = DemonstrationWriter {
            hdf5: paths.part(attempt, "hdf5"),
            videos: VIDEO_STREAMS.map(|video| paths.part(attempt, &format!("{video}.mp4"))),
            preview: paths.part(attempt, "preview.mp4"),
            store_images: self.config.images_in_hdf5,
            environment: &self.environment,
        };
        writer.write(&mut states, demonstration, cancel::requested).map_err(dataset_error)?;
        Ok(finished)
    }

    /// Simulates an attempt. One that cannot start from the state of its foreign demonstration becomes a failed attempt
    /// from the state of the layout.
    fn run_attempt(&self, job: EpisodeJob<'a>) -> Result<FinishedEpisode, CliError> {
        let run = &self.run;
        let origin = run.origins.get(&job.index());
        let error = match (run.run_episode_from(job, origin, true, &run.controllers)?, origin) {
            (Ok(finished), _) => return Ok(finished),
            (Err(error), Some(origin))
                if is_start_error(&error) && origin.start != InitialState::default() =>
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
        let layout_start = origin.map(|origin| Origin { start: InitialState::default(), ..origin.clone() });
        run.run_episode_from(job, layout_start.as_ref(), true, &failing)?
            .map_err(|error| run.episode_error(&error))
    }

    /// Paths of the files of a task.
    pub(super) fn paths(&self, task: usize) -> TaskPaths {
        TaskPaths { root: self.root.clone(), suite: self.folder_name.clone(), task }
    }

    /// Merges the demonstrations of a task into one file, unless it exists, and removes their parts.
    fn merge_task(&self, task: usize) -> Result<(), CliError> {
        let paths = self.paths(task);
        if !paths.hdf5().is_file() {
            let kept = self.kept(task);
            for (demo, record) in kept.iter().enumerate() {
                for file in paths.video_moves(record.header.id.episode, demo) {
                    self.move_part(&file.part, &file.target)?;
                }
            }
            let parts: Vec<PathBuf> = kept.iter().map(|r| paths.part(r.header.id.episode, "hdf5")).collect();
            merge_parts(&parts, &paths.hdf5(), &self.environment).map_err(dataset_error)?;
        }
        match std::fs::remove_dir_all(paths.parts()) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(dataset_error(FileError::io("remove", &paths.parts())(error)))
            }
            _ => Ok(()),
        }
    }

    /// Moves a part to its final path, unless an interrupted recording has done so already.
    fn move_part(&self, part: &Path, path: &Path) -> Result<(), CliError> {
        if !part.is_file() && path.is_file() {
            return Ok(());
        }
        files::create_parent(path).and_then(|()| files::rename(part, path)).map_err(dataset_error)
    }

    /// Checks that every task has its demonstrations.
    ///
    /// # Errors
    /// The tasks that have too few, with the reasons for which attempts were not kept.
    fn check_demo_counts(&self) -> Result<(), CliError> {
        let Some(required) = self.plan.required_demos() else { return Ok(()) };
        let short = self.tasks.iter().filter(|task| self.kept(task.id).len() < required).map(|task| {
            let count = summary::count(self, task);
            format!(
                "{}: task {}: {} of {} after {} ({})",
                self.folder_name,
                task.id,
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
        Err(CliError::input(format!(
            "{}: {}\nthe good ones are in {}; continue with --resume and more --attempts, or fix the expert",
            self.config.run.file.display(),
            short.join("\n"),
            self.root.display()
        )))
    }
}

/// True if an episode failed before its first step.
fn is_start_error(error: &EpisodeError) -> bool {
    match error {
        EpisodeError::Build(_) => true,
        EpisodeError::Settle { source, .. } => !matches!(source, SettleError::Interrupted),
        _ => false,
    }
}
