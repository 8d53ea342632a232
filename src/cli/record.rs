//! `softvt record`: expert demonstrations of the tasks of a suite, those kept that are safe and reach the goal.
//!
//! Attempts are numbered; the first that are good, in the order of their numbers, are the demonstrations, whoever finished
//! first. An attempt's files are whole before its line stands in `attempts/<suite>/episodes.jsonl`, and a task's file is put
//! together from them, so that a recording that was broken off goes on where it was.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde_json::{Value, json};

use super::{
    Failure,
    args::Run,
    attempts::{due, line, rejected},
    batch::{Batch, folder_failure},
    code,
    evaluate::{chosen, own_folders, plain},
    grips::{Grips, note_grips},
    info::{self, RunInfo, difference},
    print,
    progress::Progress,
};
use crate::{
    benchmark::{Plan, Suite, Task, seed::Split},
    dataset::{
        DatasetError, Demonstration, assemble,
        card::{Card, TaskCount, reasons},
        files,
        layout::{self, DATASET, MANIFEST, PARTS, RECORDING, TaskPlace, VIDEOS},
        manifest::{self, Entry},
        recorder::{Recorder, rate},
    },
    evaluation::record::EpisodeRecord,
    report::{
        actions,
        run_folder::{RunFolder, SUMMARY, write_json},
    },
    rollout::{Finished, batch, stop},
    script::{self, Loaded},
};

/// What to record.
#[derive(Clone, Debug)]
pub struct Record {
    /// Script, tasks, seed, threads, settings and folder.
    pub run: Run,
    /// Demonstrations a task.
    pub demos: u32,
    /// Most attempts a task.
    pub attempts: u32,
    /// Whether pictures go into the HDF5 files.
    pub pictures: bool,
    /// Whether the true state is kept.
    pub privileged: bool,
}

/// A suite that is being recorded.
struct Session<'a> {
    record: &'a Record,
    root: &'a Path,
    batch: Batch<'a>,
    tasks: Vec<&'a Task>,
    suite: String,
    grips: Grips,
    environment: Value,
    records: Vec<EpisodeRecord>,
}

/// Records what the command line asks for.
///
/// # Errors
/// The script is no suite, the folder holds something else, an attempt or a file fails, too few attempts are good.
pub fn run(record: &Record) -> Result<(), Failure> {
    let run = &record.run;
    let root = run.out.clone().unwrap_or_default();
    let loaded = script::load(&run.file, &run.script_words).map_err(Failure::input)?;
    let suites = suites_of(run, &loaded.plan)?;
    let names: Vec<String> = suites.iter().map(|suite| run.name_of(suite)).collect();
    let recording = json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "demos": record.demos,
        "pictures": record.pictures,
        "privileged": record.privileged,
        "suites": names,
    });
    if check_folder(&root, run.resume, &recording)? {
        crate::message::tell(&format!("softvt: {} is finished already", root.display()));
        return Ok(());
    }
    let mut sessions = Vec::new();
    for suite in &suites {
        sessions.push(Session::new(record, &loaded, suite, &root)?);
    }
    let text = format!("{recording:#}\n");
    files::write(&root.join(RECORDING), text.as_bytes()).map_err(failure)?;
    for session in &mut sessions {
        session.go().inspect_err(|_| take_back(&root))?;
    }
    finish(&sessions, &root)
}

/// Takes back what was written of a recording without any attempt; the folder itself goes too if nothing else is in it.
fn take_back(root: &Path) {
    let attempts = root.join(layout::ATTEMPTS);
    // Folders with something in them stay, and then it is known what they are of.
    let _ = std::fs::remove_dir(&attempts);
    if !attempts.exists() {
        let _ = std::fs::remove_dir_all(root.join(PARTS));
        let _ = std::fs::remove_file(root.join(RECORDING));
        let _ = std::fs::remove_dir(root);
    }
}

fn suites_of<'a>(run: &Run, plan: &'a Plan) -> Result<Vec<&'a Suite>, Failure> {
    match plan {
        Plan::Suite(suite) => Ok(vec![suite]),
        Plan::Suites { suites } => {
            own_folders(run, suites)?;
            Ok(suites.iter().collect())
        }
        _ => Err(Failure::input(format!(
            "{}: softvt record needs a suite, or a list of suites; name a file that returns softvt.suite",
            run.file.display()
        ))),
    }
}

/// Whether the folder holds this very recording, finished.
///
/// # Errors
/// It holds another, or something else, or this one and it is not to go on.
fn check_folder(root: &Path, resume: bool, recording: &Value) -> Result<bool, Failure> {
    let dir = root.display();
    let path = root.join(RECORDING);
    if !path.is_file() {
        let found = std::fs::read_dir(root).ok().and_then(|mut entries| entries.next()?.ok());
        return match found {
            None => Ok(false),
            Some(entry) => Err(Failure::input(format!(
                "--out {dir}: it holds {} and no recording of softvt; nothing was written; give a new folder",
                entry.file_name().to_string_lossy()
            ))),
        };
    }
    let known: Value = serde_json::from_str(&files::read_text(&path).map_err(failure)?)
        .map_err(|e| Failure::input(format!("{}: no recording of softvt: {e}", path.display())))?;
    if let Some(what) = difference(&known, recording) {
        return Err(Failure::input(format!(
            "--out {dir}: it holds another recording ({what}); give a new folder, or what it was started with"
        )));
    }
    if !resume && !root.join(DATASET).is_file() {
        return Err(Failure::input(format!(
            "--out {dir}: it holds a recording that was broken off; go on with it by --resume, or give a new folder"
        )));
    }
    Ok(root.join(DATASET).is_file())
}

impl<'a> Session<'a> {
    fn new(
        record: &'a Record,
        loaded: &'a Loaded,
        suite: &'a Suite,
        root: &'a Path,
    ) -> Result<Self, Failure> {
        let run = &record.run;
        let name = plain(&run.name_of(suite));
        let tasks = chosen(run, suite)?;
        let jobs = tasks.iter().flat_map(|task| (0..record.attempts).map(move |attempt| (*task, attempt)));
        let mut batch = Batch::new(run, loaded, suite, (jobs.collect(), layout::attempts(root, &name)))?;
        batch.split = Split::Demonstration;
        batch.films = true;
        let grips = Grips::default();
        note_grips(run, &mut batch, &grips);
        batch.prepare(&tasks)?;
        let info = RunInfo::of(&batch, &tasks, record.demos);
        let environment = json!({ "env_name": "softvt", "type": 2, "env_kwargs": info });
        Ok(Self { record, root, batch, tasks, suite: name, grips, environment, records: Vec::new() })
    }

    /// Records all tasks of the suite.
    fn go(&mut self) -> Result<(), Failure> {
        let (mut folder, done) = RunFolder::resume(&self.batch.out).map_err(folder_failure)?;
        self.batch.check_done(&folder, &done)?;
        info::write(&folder, &RunInfo::of(&self.batch, &self.tasks, self.record.demos))?;
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
            Err(failure) if failure.code == code::INTERRUPTED => {
                Err(Failure::interrupted(format!("interrupted; {go_on}")))
            }
            Err(failure) => Err(Failure { message: format!("{}\n{go_on}", failure.message), ..failure }),
            Ok(()) if stop::requested() => Err(Failure::interrupted(format!("interrupted; {go_on}"))),
            Ok(()) => {
                self.enough()?;
                let done = self.batch.summed_up(self.records.clone());
                write_json(&self.batch.out.join(SUMMARY), &done.summary).map_err(folder_failure)
            }
        }
    }

    /// Attempts until every task has its demonstrations or has used up its attempts.
    fn rounds(&mut self, folder: &mut RunFolder) -> Result<(), Failure> {
        loop {
            let jobs: Vec<(usize, u32)> = (0..self.tasks.len())
                .flat_map(|at| self.due(self.tasks[at].id).into_iter().map(move |attempt| (at, attempt)))
                .collect();
            if !jobs.is_empty() {
                self.attempts(&jobs, folder)?;
            }
            for task in self.tasks.clone() {
                if self.kept(task.id).len() == self.record.demos as usize {
                    self.put_together(task)?;
                }
            }
            if jobs.is_empty() || stop::requested() {
                return Ok(());
            }
        }
    }

    /// Attempts at a task that are needed whatever comes of them, and not done: as many as there are demonstrations missing.
    fn due(&self, task: usize) -> Vec<u32> {
        let of_task = self.records.iter().filter(|r| r.identity.task == task);
        let done: BTreeMap<u32, bool> =
            of_task.map(|r| (r.identity.episode, rejected(r).is_none())).collect();
        due(&done, self.record.demos, self.record.attempts)
    }

    /// Attempts of a task that became demonstrations, in order.
    fn kept(&self, task: usize) -> Vec<&EpisodeRecord> {
        let good = |r: &&EpisodeRecord| r.identity.task == task && rejected(r).is_none();
        let mut kept: Vec<_> = self.records.iter().filter(good).collect();
        kept.sort_by_key(|r| r.identity.episode);
        kept
    }

    fn attempts(&mut self, jobs: &[(usize, u32)], folder: &mut RunFolder) -> Result<(), Failure> {
        let mut progress = Progress::new(jobs.len(), &self.suite);
        let mut records = std::mem::take(&mut self.records);
        let session = &*self;
        let outcome = batch::run(
            jobs.len(),
            self.record.run.threads,
            &stop::FLAG,
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
    fn attempt(&self, (at, attempt): (usize, u32)) -> Result<Finished, Failure> {
        let task = self.tasks[at];
        let job = at * self.record.attempts as usize + attempt as usize;
        let mut finished = self.batch.episode(job, true, &self.batch.drive)?;
        let noted = self.grips.lock().ok().and_then(|mut all| all.remove(&(task.id, attempt)));
        let Some(mut film) = finished.film.take().filter(|_| rejected(&finished.record).is_none()) else {
            return Ok(finished);
        };
        let shut = noted.unwrap_or_else(|| finished.actions.iter().map(|a| a.closure > 0.5).collect());
        let demonstration = Demonstration::new(&finished, &film, shut, self.record.privileged);
        let place = self.place(task);
        let recorder = Recorder {
            hdf5: place.part(attempt, "hdf5"),
            videos: VIDEOS.map(|video| place.part(attempt, &format!("{video}.mp4"))),
            preview: place.part(attempt, "preview.mp4"),
            pictures: self.record.pictures,
            environment: &self.environment,
        };
        recorder.write(&mut film, demonstration, stop::requested).map_err(failure)?;
        Ok(finished)
    }

    fn place(&self, task: &Task) -> TaskPlace {
        TaskPlace { root: self.root.to_owned(), suite: self.suite.clone(), task: task.id }
    }

    /// Makes the file of a task that has all its demonstrations, unless it is there; its parts go then.
    fn put_together(&self, task: &Task) -> Result<(), Failure> {
        let place = self.place(task);
        if !place.hdf5().is_file() {
            let kept = self.kept(task.id);
            for (demo, record) in kept.iter().enumerate() {
                for (part, film) in place.films(record.identity.episode, demo) {
                    self.take_over(&part, &film)?;
                }
            }
            let parts: Vec<PathBuf> = kept.iter().map(|r| place.part(r.identity.episode, "hdf5")).collect();
            assemble(&parts, &place.hdf5(), &self.environment).map_err(failure)?;
        }
        match std::fs::remove_dir_all(place.parts()) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(failure(DatasetError::io("remove", &place.parts())(error)))
            }
            _ => Ok(()),
        }
    }

    /// Moves a part to its place, unless that was done before the recording was broken off.
    fn take_over(&self, part: &Path, into: &Path) -> Result<(), Failure> {
        if !part.is_file() && into.is_file() {
            return Ok(());
        }
        files::make_folder(into.parent().unwrap_or(self.root)).map_err(failure)?;
        std::fs::rename(part, into).map_err(|error| failure(DatasetError::io("move into place", part)(error)))
    }

    /// Whether every task has its demonstrations.
    ///
    /// # Errors
    /// Which have not, and why.
    fn enough(&self) -> Result<(), Failure> {
        let short = |task: &&&Task| self.kept(task.id).len() < self.record.demos as usize;
        let told: Vec<String> = self
            .tasks
            .iter()
            .filter(short)
            .map(|task| {
                let count = self.count(task, 0, 0);
                format!(
                    "{}: task {}: {} of {} demonstrations after {} attempts ({})",
                    self.suite,
                    task.id,
                    count.demos,
                    self.record.demos,
                    count.attempts,
                    reasons(&count.rejected)
                )
            })
            .collect();
        if told.is_empty() {
            return Ok(());
        }
        Err(Failure::input(format!(
            "{}: {}\nwhat is good is kept in {}; go on with --resume and more --attempts, or mend the expert",
            self.record.run.file.display(),
            told.join("\n"),
            self.root.display()
        )))
    }

    fn count(&self, task: &Task, hdf5_bytes: u64, video_bytes: u64) -> TaskCount {
        let kept = self.kept(task.id);
        let mut rejects = BTreeMap::new();
        let of_task = || self.records.iter().filter(|r| r.identity.task == task.id);
        for reason in of_task().filter_map(rejected) {
            *rejects.entry(reason).or_insert(0) += 1;
        }
        TaskCount {
            suite: self.suite.clone(),
            task: task.id,
            prompt: task.prompt.clone(),
            asset: of_task().next().map_or(String::new(), |r| r.identity.asset.clone()),
            demos: kept.len(),
            samples: kept.iter().map(|r| r.stats.steps as usize).sum(),
            attempts: of_task().count(),
            rejected: rejects,
            hdf5_bytes,
            video_bytes,
        }
    }
}

/// Writes what is about the whole data set, and says what there is.
fn finish(sessions: &[Session], root: &Path) -> Result<(), Failure> {
    let (mut entries, mut tasks) = (Vec::new(), Vec::new());
    let size = |path: &Path| std::fs::metadata(path).map_or(0, |meta| meta.len());
    for session in sessions {
        for task in &session.tasks {
            let place = session.place(task);
            let new = session.kept(task.id).into_iter().enumerate().map(|(k, r)| Entry::new(&place, k, r));
            let new: Vec<Entry> = new.collect();
            let videos = new.iter().flat_map(|entry| entry.video_files.values());
            let video_bytes = videos.map(|file| size(&root.join(file))).sum();
            tasks.push(session.count(task, size(&place.hdf5()), video_bytes));
            entries.extend(new);
        }
    }
    manifest::write(root, &entries).map_err(failure)?;
    let _ = std::fs::remove_dir(root.join(PARTS));
    let (pictures, privileged) =
        sessions.first().map_or((false, false), |s| (s.record.pictures, s.record.privileged));
    let softvt = env!("CARGO_PKG_VERSION").to_owned();
    let card = Card { softvt, fps: rate(), pictures, privileged, tasks };
    card.write(root).map_err(failure)?;
    for task in &card.tasks {
        print(&format!(
            "{} task {}: {} demonstrations of {} attempts, {} steps, {:.1} MB; not kept: {}\n",
            task.suite,
            task.task,
            task.demos,
            task.attempts,
            task.samples,
            (task.hdf5_bytes + task.video_bytes) as f64 / 1e6,
            reasons(&task.rejected)
        ));
    }
    print(&format!("{}\n", root.join(MANIFEST).display()));
    Ok(())
}

fn failure(error: DatasetError) -> Failure {
    match error {
        DatasetError::Interrupted => Failure::interrupted("interrupted"),
        other => Failure::input(other),
    }
}
