//! One suite of a data set in the making: rounds of attempts, the files of the good ones, and of every task one file.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use serde_json::{Value, json};

use crate::{
    benchmark::{Suite, Task, seed::Split},
    cli::{
        error::{CliError, Exit},
        output::Progress,
        run::selection::path_component,
        run::{
            demo_selection::{NO_START, due, line, rejected},
            grip_recorder::GripLog,
            recording::{RecordingConfig, failure, finish::count},
            run_manifest::{self, RunManifest},
            suite_run::{ControllerFactory, SuiteRun, folder_failure},
        },
    },
    dataset::{
        DatasetError, Demonstration,
        card::rejection_counts,
        demonstration_writer::DemonstrationWriter,
        layout::{self, TaskPaths, VIDEO_STREAMS},
        merge_parts,
    },
    evaluation::record::{EpisodeRecord, Origin},
    parallel,
    policy::{ChunkedPolicy, recorded::RecordedPolicy},
    report::{
        actions,
        run_folder::{RunFolder, SUMMARY},
    },
    rollout::{EpisodeError, FinishedEpisode, SettleError, cancel},
    scene::InitialState,
    script::Loaded,
};

/// How many attempts there are, and how many become demonstrations.
#[derive(Clone, Debug)]
pub(crate) enum AttemptPlan {
    /// The first good ones of so many attempts at most.
    First {
        /// Demonstrations a task.
        demos: u32,
        /// Most attempts a task.
        attempts: u32,
    },
    /// All good ones of these attempts, by task.
    All(BTreeMap<usize, BTreeSet<u32>>),
}

impl AttemptPlan {
    /// The attempts at a task that there may be.
    fn attempts(&self, task: usize) -> Vec<u32> {
        match self {
            Self::First { attempts, .. } => (0..*attempts).collect(),
            Self::All(all) => all.get(&task).into_iter().flatten().copied().collect(),
        }
    }

    /// The attempts that are needed whatever comes of them; `done` says of each that is done whether it is good.
    fn due(&self, task: usize, done: &BTreeMap<u32, bool>) -> Vec<u32> {
        match self {
            Self::First { demos, attempts } => due(done, *demos, *attempts),
            Self::All(_) => self.attempts(task).into_iter().filter(|i| !done.contains_key(i)).collect(),
        }
    }

    /// Demonstrations that a task must have; none is known if all good attempts are.
    fn least(&self) -> Option<usize> {
        match self {
            Self::First { demos, .. } => Some(*demos as usize),
            Self::All(_) => None,
        }
    }

    /// As `run.json` counts the episodes of a task.
    fn episodes(&self) -> u32 {
        match self {
            Self::First { demos, .. } => *demos,
            Self::All(all) => all.values().map(BTreeSet::len).max().unwrap_or_default() as u32,
        }
    }
}

/// A suite that is being recorded.
pub(crate) struct SuiteRecording<'a> {
    output: &'a RecordingConfig,
    root: PathBuf,
    /// Its attempts.
    pub(crate) batch: SuiteRun<'a>,
    /// Its tasks.
    pub(crate) tasks: Vec<&'a Task>,
    /// Its name, as part of a path.
    pub(crate) suite: String,
    wanted: AttemptPlan,
    grips: GripLog,
    info: Value,
    environment: Value,
    /// Attempts that are done.
    pub(crate) records: Vec<EpisodeRecord>,
}

impl<'a> SuiteRecording<'a> {
    /// Makes the tasks of a suite ready; `fit` says who drives, and notes when the gripper is meant to hold.
    ///
    /// # Errors
    /// A setting or scene that is wrong.
    pub(crate) fn new(
        output: &'a RecordingConfig,
        (loaded, suite): (&'a Loaded, &'a Suite),
        (tasks, wanted): (Vec<&'a Task>, AttemptPlan),
        fit: impl FnOnce(&mut SuiteRun<'a>, &GripLog) -> Result<(), CliError>,
    ) -> Result<Self, CliError> {
        let run = &output.run;
        let root = run.out.clone().unwrap_or_default();
        let name = path_component(&run.name_of(suite));
        let of_task =
            |task: &'a Task| wanted.attempts(task.id).into_iter().map(move |attempt| (task, attempt));
        let jobs = tasks.iter().flat_map(|task| of_task(task)).collect();
        let mut batch = SuiteRun::new(run, loaded, suite, (jobs, layout::attempts(&root, &name)))?;
        batch.split = Split::Demonstration;
        batch.films = true;
        let grips = GripLog::default();
        fit(&mut batch, &grips)?;
        batch.prepare(&tasks)?;
        let info = json!(RunManifest::of(&batch, &tasks, wanted.episodes()));
        let environment = json!({ "env_name": "softvt", "type": 2, "env_kwargs": info });
        Ok(Self {
            output,
            root,
            batch,
            tasks,
            suite: name,
            wanted,
            grips,
            info,
            environment,
            records: Vec::new(),
        })
    }

    /// Records all tasks of the suite.
    ///
    /// # Errors
    /// The folder holds other attempts, an attempt or a file fails, or too few are good; what is finished stays.
    pub(crate) fn go(&mut self) -> Result<(), CliError> {
        let (mut folder, done) = RunFolder::resume(&self.batch.out).map_err(folder_failure)?;
        self.batch.check_done(&folder, &done)?;
        run_manifest::write(&folder, &self.info)?;
        self.records = done;
        let outcome = self.rounds(&mut folder);
        if outcome.is_err() && self.records.is_empty() {
            // Nothing would be lost, and the same command must work once the mistake is mended.
            folder.discard().map_err(folder_failure)?;
            return outcome;
        }
        self.records.sort_by_key(|r| (r.identity.task, r.identity.episode));
        folder.put_in_order(&self.records).map_err(folder_failure)?;
        let kept = self.records.iter().filter(|r| rejected(r).is_none()).count();
        let go_on = format!("{kept} demonstrations are in {}; go on with --resume", self.root.display());
        match outcome {
            Err(failure) if failure.exit == Exit::Interrupted => {
                Err(CliError::interrupted(format!("interrupted; {go_on}")))
            }
            Err(failure) => Err(CliError { message: format!("{}\n{go_on}", failure.message), ..failure }),
            Ok(()) if cancel::requested() => Err(CliError::interrupted(format!("interrupted; {go_on}"))),
            Ok(()) => {
                self.enough()?;
                let done = self.batch.summed_up(self.records.clone());
                crate::files::write_json(&self.batch.out.join(SUMMARY), &done.summary)
                    .map_err(CliError::input)
            }
        }
    }

    /// Attempts until every task has its demonstrations or has used up its attempts.
    fn rounds(&mut self, folder: &mut RunFolder) -> Result<(), CliError> {
        loop {
            let due = |task: &&Task| {
                self.due(task.id).into_iter().map(|attempt| (task.id, attempt)).collect::<Vec<_>>()
            };
            let jobs: Vec<(usize, u32)> = self.tasks.iter().flat_map(due).collect();
            if !jobs.is_empty() {
                self.attempts(&jobs, folder)?;
            }
            for task in &self.tasks {
                let kept = self.kept(task.id).len();
                if kept > 0 && self.wanted.least().map_or(self.due(task.id).is_empty(), |least| kept == least)
                {
                    self.put_together(task.id)?;
                }
            }
            if jobs.is_empty() || cancel::requested() {
                return Ok(());
            }
        }
    }

    /// Attempts at a task that are needed whatever comes of them, and not done.
    fn due(&self, task: usize) -> Vec<u32> {
        let of_task = self.records.iter().filter(|r| r.identity.task == task);
        let done = of_task.map(|r| (r.identity.episode, rejected(r).is_none())).collect();
        self.wanted.due(task, &done)
    }

    /// Attempts of a task that became demonstrations, in order.
    pub(crate) fn kept(&self, task: usize) -> Vec<&EpisodeRecord> {
        let good = |r: &&EpisodeRecord| r.identity.task == task && rejected(r).is_none();
        let mut kept: Vec<_> = self.records.iter().filter(good).collect();
        kept.sort_by_key(|r| r.identity.episode);
        kept
    }

    fn attempts(&mut self, jobs: &[(usize, u32)], folder: &mut RunFolder) -> Result<(), CliError> {
        let mut progress = Progress::new(jobs.len(), &self.suite);
        let mut records = std::mem::take(&mut self.records);
        let session = &*self;
        let outcome = parallel::run(
            jobs.len(),
            self.output.run.threads,
            cancel::requested,
            |index| session.attempt(jobs[index]),
            |_, finished| {
                let id = &finished.record.identity;
                let path = actions::path(&session.batch.out, id.task, id.episode);
                actions::write(&path, &finished.actions).map_err(folder_failure)?;
                folder.append(&finished.record).map_err(folder_failure)?;
                progress.tick(&line(&finished.record));
                records.push(finished.record);
                Ok(())
            },
        );
        progress.finish();
        self.records = records;
        outcome
    }

    /// Runs an attempt and, if it is good, writes its files.
    fn attempt(&self, (task, attempt): (usize, u32)) -> Result<FinishedEpisode, CliError> {
        let mut finished = self.run((task, attempt))?;
        let noted = self.grips.lock().ok().and_then(|mut all| all.remove(&(task, attempt)));
        let Some(mut film) = finished.recording.take().filter(|_| rejected(&finished.record).is_none())
        else {
            return Ok(finished);
        };
        let mut shut = noted.unwrap_or_else(|| finished.actions.iter().map(|a| a.closure > 0.5).collect());
        // What was noted may be of fewer steps than were taken, the hand staying as it was, or of more.
        shut.resize(finished.actions.len(), shut.last().copied().unwrap_or_default());
        let demonstration = Demonstration::new(&finished, &film, shut, self.output.privileged);
        let place = self.place(task);
        let recorder = DemonstrationWriter {
            hdf5: place.part(attempt, "hdf5"),
            videos: VIDEO_STREAMS.map(|video| place.part(attempt, &format!("{video}.mp4"))),
            preview: place.part(attempt, "preview.mp4"),
            store_images: self.output.pictures,
            environment: &self.environment,
        };
        recorder.write(&mut film, demonstration, cancel::requested).map_err(failure)?;
        Ok(finished)
    }

    /// Simulates an attempt. One that cannot start as a foreign demonstration says is one that has failed.
    fn run(&self, place: (usize, u32)) -> Result<FinishedEpisode, CliError> {
        let batch = &self.batch;
        let job = batch.jobs.iter().position(|(task, attempt)| (task.id, *attempt) == place);
        let job = job.ok_or_else(|| CliError::internal("an attempt that is none of the recording"))?;
        let origin = batch.origins.get(&place);
        let error = match (batch.episode_from(job, origin, true, &batch.drive)?, origin) {
            (Ok(finished), _) => return Ok(finished),
            (Err(error), Some(origin)) if no_start(&error) && origin.start != InitialState::default() => {
                error
            }
            (Err(error), _) => return Err(batch.episode_failure(&error)),
        };
        let ending = format!("{NO_START}{error}");
        let refused: ControllerFactory = Box::new(move |_, brief| {
            Ok(Box::new(ChunkedPolicy::new(
                Box::new(RecordedPolicy::new(Vec::new(), Some(ending.clone()))),
                brief,
                1,
            )))
        });
        let nowhere = origin.map(|origin| Origin { start: InitialState::default(), ..origin.clone() });
        batch.episode_from(job, nowhere.as_ref(), true, &refused)?.map_err(|e| batch.episode_failure(&e))
    }

    /// Where the files of a task are.
    pub(crate) fn place(&self, task: usize) -> TaskPaths {
        TaskPaths { root: self.root.clone(), suite: self.suite.clone(), task }
    }

    /// Makes the file of a task that has all its demonstrations, unless it is there; its parts go then.
    fn put_together(&self, task: usize) -> Result<(), CliError> {
        let place = self.place(task);
        if !place.hdf5().is_file() {
            let kept = self.kept(task);
            for (demo, record) in kept.iter().enumerate() {
                for file in place.video_moves(record.identity.episode, demo) {
                    self.take_over(&file.part, &file.target)?;
                }
            }
            let parts: Vec<PathBuf> = kept.iter().map(|r| place.part(r.identity.episode, "hdf5")).collect();
            merge_parts(&parts, &place.hdf5(), &self.environment).map_err(failure)?;
        }
        match std::fs::remove_dir_all(place.parts()) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(failure(DatasetError::io("remove", &place.parts())(error)))
            }
            _ => Ok(()),
        }
    }

    /// Moves a part to its place, unless that was done before the recording was broken off.
    fn take_over(&self, part: &Path, into: &Path) -> Result<(), CliError> {
        if !part.is_file() && into.is_file() {
            return Ok(());
        }
        crate::files::create_folder(into.parent().unwrap_or(&self.root)).map_err(failure)?;
        std::fs::rename(part, into).map_err(|error| failure(DatasetError::io("move into place", part)(error)))
    }

    /// Whether every task has its demonstrations.
    ///
    /// # Errors
    /// Which have not, and why.
    fn enough(&self) -> Result<(), CliError> {
        let Some(least) = self.wanted.least() else { return Ok(()) };
        let short = |task: &&&Task| self.kept(task.id).len() < least;
        let told = |task: &&Task| {
            let count = count(self, task);
            format!(
                "{}: task {}: {} of {least} demonstrations after {} attempts ({})",
                self.suite,
                task.id,
                count.demos,
                count.attempts,
                rejection_counts(&count.rejected)
            )
        };
        let told: Vec<String> = self.tasks.iter().filter(short).map(told).collect();
        if told.is_empty() {
            return Ok(());
        }
        Err(CliError::input(format!(
            "{}: {}\nwhat is good is kept in {}; go on with --resume and more --attempts, or mend the expert",
            self.output.run.file.display(),
            told.join("\n"),
            self.root.display()
        )))
    }
}

/// Whether an episode could not even start.
fn no_start(error: &EpisodeError) -> bool {
    match error {
        EpisodeError::Build(_) => true,
        EpisodeError::Settle { source, .. } => !matches!(source, SettleError::Interrupted),
        _ => false,
    }
}
