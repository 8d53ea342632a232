//! The episodes of one suite: their limits, their runs, their files.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    sync::Arc,
};

use super::{
    Failure,
    args::{Run, Video},
    code,
    drivers::Drivers,
    files::{self, Calibrated, make_folder},
    info::{self, RunInfo},
    progress::Progress,
    recorded::{Replayed, recorded},
};
use crate::{
    benchmark::{Suite, Task, seed::Split, settings::Settings},
    evaluation::{record::EpisodeRecord, safety::Limit, summary::Summary, thresholds::Thresholds},
    policy::{Streams, TaskBrief},
    report::{
        actions,
        film::{self, Caption, FilmError},
        interchange::{self, DebugFrame, DebugShape},
        run_folder::{EPISODES, RUN, RunFolder, RunFolderError, SUMMARY, replace},
    },
    rollout::{
        BuildError, ControlError, Controller, Episode, EpisodeError, EpisodeSpec, Finished, Looks, RestCache,
        ScoreFrame, SenseError, Senses, Simulation, Which, batch, check_senses, stop, target_asset,
    },
    scene::{Asset, Body, Scene},
    script::{self, Loaded},
};

/// Why a first look at a scene fails.
#[derive(Debug, thiserror::Error)]
enum Trial {
    #[error(transparent)]
    Build(#[from] BuildError),
    #[error(transparent)]
    Sense(#[from] SenseError),
}

/// One suite under way.
pub(super) struct Batch<'a> {
    pub run: &'a Run,
    loaded: &'a Loaded,
    pub suite: &'a Suite,
    /// Name in results.
    name: String,
    settings: Settings,
    jobs: Vec<(&'a Task, u32)>,
    limits: BTreeMap<String, Option<Limit>>,
    /// The thresholds in use as one file of SoftVTBench's form.
    released: Thresholds,
    /// SHA-256 of every file that the results depend on.
    pub sources: BTreeMap<String, String>,
    /// Whose actions are carried out once more.
    replayed: Option<Replayed>,
    cache: RestCache,
    looks: Looks,
    pub out: PathBuf,
    /// Whether rollouts are drawn.
    pub films: bool,
    /// Whether whoever drives sees the true forces at the pads.
    force_observed: bool,
    pub drive: Drive,
}

impl<'a> Batch<'a> {
    /// `jobs` of a suite, to be kept in `out`.
    ///
    /// # Errors
    /// A setting or shift that the suite does not have, or a value out of its range.
    pub fn new(
        run: &'a Run,
        loaded: &'a Loaded,
        suite: &'a Suite,
        (jobs, out): (Vec<(&'a Task, u32)>, PathBuf),
    ) -> Result<Self, Failure> {
        let wrong = |flag: &str, e: String| Failure::input(format!("{}: {flag}: {e}", run.file.display()));
        let settings = suite.settings.with_all(&run.set).map_err(|e| wrong("--set", e))?;
        for (name, value) in &run.shifts {
            script::check_shift(&suite.shifts, name, *value).map_err(|e| wrong("--shift", e.to_string()))?;
        }
        let replayed = recorded(run, suite, &jobs)?;
        let drivers = Drivers::new(&run.policy, &suite.name, run.twin)?;
        let mut sources = loaded.bundle.hashes();
        sources.extend(run.policy.sources());
        let made_by = format!("softvt {}", env!("CARGO_PKG_VERSION"));
        Ok(Self {
            run,
            loaded,
            suite,
            name: run.name_of(suite),
            settings,
            jobs,
            limits: BTreeMap::new(),
            released: Thresholds::new(0.5, Vec::new(), made_by),
            sources,
            replayed,
            cache: RestCache::default(),
            looks: Looks::default(),
            out,
            films: run.video.is_some(),
            force_observed: false,
            drive: Box::new(move |opened, brief| drivers.drive(opened, brief)),
        })
    }

    /// The same with what was made of assets for other suites.
    pub fn sharing(mut self, cache: &RestCache, looks: &Looks) -> Self {
        (self.cache, self.looks) = (cache.clone(), looks.clone());
        self
    }

    /// An episode as its layout, the shifts and the run make it.
    fn open(&self, task: &Task, episode: u32) -> Result<script::Episode, Failure> {
        let mut opened =
            script::Episode::open(self.loaded, &self.request(task, episode)).map_err(Failure::input)?;
        if self.run.twin {
            (opened.scene, opened.nominal) = (opened.scene.rigid_twin(), opened.nominal.rigid_twin());
        }
        Ok(opened)
    }

    fn brief(&self, task: &Task, episode: u32) -> TaskBrief {
        TaskBrief { suite: self.name.clone(), task: task.id, prompt: task.prompt.clone(), episode }
    }

    /// Which episode of a task it is.
    pub fn request(&self, task: &Task, episode: u32) -> script::EpisodeRequest {
        script::EpisodeRequest {
            suite: self.suite.name.clone(),
            task: task.id,
            episode: u64::from(episode),
            base_seed: self.run.seed,
            split: Split::Validation,
            shifts: self.run.shifts.clone(),
        }
    }

    /// Reads the thresholds of the targets of all tasks, and looks once at whatever will be looked at in the first episode of
    /// each: what is wrong with a scene's senses is told before anything runs.
    ///
    /// # Errors
    /// A layout, a threshold file, a camera, the light or a tactile sensor that is wrong.
    pub fn prepare(&mut self, tasks: &[&Task]) -> Result<(), Failure> {
        for task in tasks {
            let first = self.jobs.iter().find(|(of, _)| of.id == task.id).map_or(0, |(_, episode)| *episode);
            let opened = self.open(task, first)?;
            self.learn_limit(target_asset(&opened.nominal, task).cloned())?;
            let scene = Arc::new(opened.scene.clone());
            let streams = (self.drive)(opened, self.brief(task, first))?.streams();
            self.force_observed |= streams.force;
            self.try_out(scene, streams).map_err(|error| self.trial_failure(error, task, first))?;
        }
        Ok(())
    }

    /// Reads the threshold of a task's target, if it is a soft one whose threshold is not known yet.
    ///
    /// # Errors
    /// A threshold file that is wrong.
    pub fn learn_limit(&mut self, target: Option<Arc<Asset>>) -> Result<(), Failure> {
        let soft = target.filter(|asset| matches!(asset.body, Body::Soft(_)));
        if let Some(asset) = soft.filter(|asset| !self.limits.contains_key(&asset.name)) {
            let limit = self.find_limit(&asset)?;
            self.limits.insert(asset.name.clone(), limit);
        }
        Ok(())
    }

    /// Builds the first scene of a task, and looks for all that can be wrong with it before anything moves.
    ///
    /// # Errors
    /// What is wrong.
    pub fn examine(&self, task: &Task, scene: Scene) -> Result<(), Failure> {
        let scene = Arc::new(if self.run.twin { scene.rigid_twin() } else { scene });
        let settings = &self.settings;
        let look = || -> Result<(), Trial> {
            check_senses(&scene, &settings.tactile, &self.looks)?;
            let sim = Simulation::new(scene.clone(), &settings.physics, &settings.robot, &self.cache)?;
            Ok(Senses::new(&sim, &settings.tactile, &self.looks).stand_outside(&Senses::frame(&sim))?)
        };
        look().map_err(|error| self.trial_failure(error, task, 0))
    }

    fn trial_failure(&self, error: Trial, task: &Task, episode: u32) -> Failure {
        self.episode_failure(&match error {
            Trial::Build(error) => EpisodeError::Build(error),
            Trial::Sense(source) => EpisodeError::Sense { task: task.id, episode, source },
        })
    }

    /// Looks once at what a policy asks for, and a film shows, of a scene in which nothing has moved yet.
    fn try_out(&self, scene: Arc<Scene>, mut streams: Streams) -> Result<(), Trial> {
        let settings = &self.settings;
        check_senses(&scene, &settings.tactile, &self.looks)?;
        if self.films {
            streams.touch = true;
            streams.cameras.extend(scene.cameras.iter().map(|camera| camera.name.clone()));
        }
        if streams.cameras.is_empty() && !streams.touch {
            return Ok(());
        }
        let sim = Simulation::new(scene, &settings.physics, &settings.robot, &self.cache)?;
        let mut senses = Senses::new(&sim, &settings.tactile, &self.looks);
        Ok(senses.try_out(&Senses::frame(&sim), &streams)?)
    }

    /// Takes over the limits of another batch of the same suite, whose layouts are the same.
    pub fn share_limits(&mut self, other: &Self) {
        self.limits.clone_from(&other.limits);
        self.released.clone_from(&other.released);
        self.sources.clone_from(&other.sources);
    }

    fn find_limit(&mut self, asset: &Asset) -> Result<Option<Limit>, Failure> {
        let name = &asset.name;
        let cure = format!("its episodes cannot count as safe; softvt scripts/calibrate.lua --asset {name}");
        match files::calibrated(&self.run.file, asset)? {
            Calibrated::Never => crate::message::tell(&format!(
                "softvt: {name} is not calibrated (assets/calibration/{name}.json): {cure}"
            )),
            Calibrated::Another(path) => {
                crate::message::tell(&format!(
                    "softvt: {path} is about another {name} (its shape, material or friction differ): {cure}"
                ));
            }
            Calibrated::Yes { limit, file, path, text } => {
                self.sources.insert(path, script::sha256(text.as_bytes()));
                self.released.merge(*file);
                return Ok(limit);
            }
        }
        Ok(None)
    }

    /// The limit of an object as its layout made it in this episode, whatever a shift makes of it then.
    fn limit_of(&self, asset: &Asset) -> Option<Limit> {
        let limit = self.limits.get(&asset.name).copied().flatten()?;
        let known = self.released.fingerprints.get(&asset.name);
        known.is_none_or(|known| *known == asset.fingerprint()).then_some(limit)
    }

    /// Writes down what is needed to repeat the run; if it stands there already, it must be the same.
    ///
    /// # Errors
    /// The file cannot be written, or is that of another run.
    pub fn write_info(&self, folder: &RunFolder, tasks: &[&Task], episodes: u32) -> Result<(), Failure> {
        let info = self.info(tasks, episodes)?;
        info::write(folder, &info)
    }

    /// Whether the run in the folder is this one.
    ///
    /// # Errors
    /// Its `run.json` cannot be read.
    pub fn is_of(&self, tasks: &[&Task], episodes: u32) -> Result<bool, Failure> {
        info::is_of(&self.out, &self.info(tasks, episodes)?)
    }

    fn info(&self, tasks: &[&Task], episodes: u32) -> Result<RunInfo<'_>, Failure> {
        let options =
            self.loaded.options.iter().map(|o| (o.name.clone(), format!("{:?}", o.value))).collect();
        let info = RunInfo {
            softvt: env!("CARGO_PKG_VERSION"),
            script: self.loaded.main.clone(),
            suite: &self.suite.name,
            twin: self.run.twin.then_some("rigid"),
            policy: self.run.policy.name(),
            profile: self.run.policy.profile(),
            policy_file: self.run.policy.file(),
            replayed: self.replayed.as_ref(),
            replan: self.run.policy.replan(),
            privileged: self.run.policy.is_privileged(),
            seed: self.run.seed,
            split: Split::Validation.name(),
            tasks: tasks.iter().map(|t| t.id).collect(),
            episodes,
            shard: self.run.shard.map(|shard| shard.to_string()),
            shifts: &self.run.shifts,
            options,
            arguments: &self.run.script_words,
            set: &self.run.set,
            settings: &self.settings,
            sources: self.sources.clone(),
            thresholds: self.limits.iter().map(|(a, l)| (a.clone(), l.map(|l| l.tau_pct()))).collect(),
            force_observed: self.force_observed,
        };
        Ok(info)
    }

    /// Runs the episodes that are not `done` and sums all up.
    ///
    /// # Errors
    /// A script, policy or file that fails, or an interrupt; finished episodes are kept.
    pub fn go(&self, mut folder: RunFolder, done: Vec<EpisodeRecord>) -> Result<Summary, Failure> {
        let mut records = done;
        let left = self.left(&records);
        let outcome = self.run_episodes(&left, &mut folder, &mut records);
        let kept = format!("{} of {} episodes are in {}", records.len(), self.jobs.len(), self.out.display());
        let interrupted = || {
            Failure::interrupted(format!(
                "interrupted; {kept}; go on with --resume --out {}",
                self.out.display()
            ))
        };
        match outcome {
            // What failed before the end was asked for is what went wrong, however long others took to end.
            Err(failure) if failure.code == code::INTERRUPTED => return Err(interrupted()),
            Err(failure) if records.is_empty() => {
                // Nothing would be lost, and the same command must work once the mistake is mended.
                folder.discard().map_err(folder_failure)?;
                return Err(failure);
            }
            Err(failure) => {
                return Err(Failure { message: format!("{}\n{kept}", failure.message), ..failure });
            }
            Ok(()) if stop::requested() => return Err(interrupted()),
            Ok(()) => {}
        }
        records.sort_by_key(|r| (r.identity.task, r.identity.episode));
        folder.put_in_order(&records).map_err(folder_failure)?;
        let summary = Summary::of(&self.name, self.run.policy.name(), &records);
        interchange::write_scores(&self.out, &records, &self.released).map_err(folder_failure)?;
        // The last of all: a folder with a summary is finished.
        folder.write_json(SUMMARY, &summary).map_err(folder_failure)?;
        crate::message::tell(&format!("softvt: {}", self.out.display()));
        Ok(summary)
    }

    /// Refuses episodes of another run, or one that is there twice.
    ///
    /// # Errors
    /// The first such line of the folder's `episodes.jsonl`.
    pub fn check_done(&self, folder: &RunFolder, done: &[EpisodeRecord]) -> Result<(), Failure> {
        let path = folder.path().join(EPISODES).display().to_string();
        if !done.is_empty() && folder.read(RUN).map_err(folder_failure)?.is_none() {
            return Err(Failure::input(format!(
                "{path}: there is no {RUN} beside it, so that nobody knows what it is of"
            )));
        }
        let wanted: BTreeSet<_> = self.jobs.iter().map(|(task, episode)| (task.id, *episode)).collect();
        let mut seen = BTreeSet::new();
        for (i, record) in done.iter().enumerate() {
            let id = &record.identity;
            let own =
                id.suite == self.name && id.seed == self.run.seed && id.policy == self.run.policy.name();
            let place = (id.task, id.episode);
            let wrong = match () {
                () if !own || !wanted.contains(&place) => "is of another run",
                () if !seen.insert(place) => "is there twice",
                () => continue,
            };
            let line = i + 1;
            return Err(Failure::input(format!(
                "{path}:{line}: task {} episode {} {wrong}",
                id.task, id.episode
            )));
        }
        Ok(())
    }

    /// The jobs that are not done.
    pub fn left(&self, done: &[EpisodeRecord]) -> Vec<usize> {
        let done: BTreeSet<_> = done.iter().map(|r| (r.identity.task, r.identity.episode)).collect();
        (0..self.jobs.len()).filter(|&job| !done.contains(&(self.jobs[job].0.id, self.jobs[job].1))).collect()
    }

    /// Runs jobs; an episode's line is written after all its other files, so that whoever is listed is whole.
    fn run_episodes(
        &self,
        left: &[usize],
        folder: &mut RunFolder,
        records: &mut Vec<EpisodeRecord>,
    ) -> Result<(), Failure> {
        let mut progress = Progress::new(left.len(), &self.name);
        let outcome = batch::run(
            left.len(),
            self.run.threads,
            &stop::FLAG,
            |index| {
                let job = left[index];
                let mut finished = self.episode(job, self.may_show(job))?;
                let drawn = self.write_video(&mut finished);
                Ok((finished, drawn))
            },
            |_, (finished, drawn)| {
                self.write_trace(&finished)?;
                self.write_debug_log(&finished)?;
                let id = &finished.record.identity;
                let actions_path = actions::path(&self.out, id.task, id.episode);
                actions::write(&actions_path, &finished.actions).map_err(folder_failure)?;
                folder.append(&finished.record).map_err(folder_failure)?;
                progress.tick(&line(&finished.record));
                // The episode counts whether or not it can be drawn.
                if let Err(failure) = drawn {
                    crate::message::tell(&format!(
                        "softvt: no video of {}: {}",
                        line(&finished.record),
                        failure.message
                    ));
                }
                records.push(finished.record);
                Ok(())
            },
        );
        progress.finish();
        outcome
    }

    /// Whether a job's rollout may have to be drawn.
    fn may_show(&self, job: usize) -> bool {
        match &self.run.video {
            None => false,
            Some(Video::Episodes(chosen)) => chosen.contains(&self.jobs[job].1),
            Some(Video::All | Video::Failed) => true,
        }
    }

    /// The video of an episode, if it was asked for.
    fn write_video(&self, finished: &mut Finished) -> Result<(), Failure> {
        let (record, Some(mut film)) = (&finished.record, finished.film.take()) else { return Ok(()) };
        if self.run.video == Some(Video::Failed) && record.verdict.safety {
            return Ok(());
        }
        let id = &record.identity;
        let path = self.out.join(format!("video/task_{:03}/episode_{:05}.mp4", id.task, id.episode));
        make_folder(path.parent().unwrap_or(&self.out))?;
        film::write_video(&mut film, &Caption::of(record), &path, stop::requested).map_err(film_failure)
    }

    /// Runs one job; with `film` what is needed to draw it is kept.
    ///
    /// # Errors
    /// A script, the scene or whoever drives fails.
    pub fn episode(&self, job: usize, film: bool) -> Result<Finished, Failure> {
        let (task, episode) = self.jobs[job];
        let opened = self.open(task, episode)?;
        let limit = target_asset(&opened.nominal, task).and_then(|asset| self.limit_of(asset));
        let which = Which {
            suite: &self.name,
            episode,
            seed: self.run.seed,
            split: Split::Validation,
            policy: self.run.policy.name(),
        };
        let scenes = (&opened.nominal, opened.scene.clone());
        let mut spec = EpisodeSpec {
            limit,
            film,
            trace: self.run.trace,
            ..EpisodeSpec::new(&which, task, scenes, &self.settings)
        };
        spec.identity.privileged = self.run.policy.is_privileged();
        let driver = (self.drive)(opened, self.brief(task, episode))?;
        let mut driver = batch::Stoppable { driver, stop: &stop::FLAG };
        let started = Episode::start(spec, &self.cache, &self.looks).map_err(|e| self.episode_failure(&e))?;
        started.run(&mut driver).map_err(|e| self.episode_failure(&e))
    }

    fn episode_failure(&self, error: &EpisodeError) -> Failure {
        let code = match error {
            // What fails after the end was asked for may fail because of that.
            _ if stop::requested() => code::INTERRUPTED,
            EpisodeError::Control { source: ControlError::Policy(_), .. } => code::POLICY,
            _ => code::INPUT,
        };
        let message = match (error, error.place()) {
            // It says which file and line itself.
            (EpisodeError::Build(BuildError::At { .. }), _) => error.to_string(),
            (_, Some(place)) => format!("{place}: {error}"),
            (_, None) => format!("{}: {error}", self.run.file.display()),
        };
        Failure { code, message }
    }

    /// SoftVTBench's log of every control step, which its own scorer reads.
    fn write_debug_log(&self, finished: &Finished) -> Result<(), Failure> {
        let identity = &finished.record.identity;
        let frame = |(step, frame): (usize, &ScoreFrame)| {
            let measured = finished.reference.as_ref().zip(frame.deformation.as_ref());
            let shape = DebugShape::new(&identity.asset, measured);
            DebugFrame::new(identity, step as u32, frame.success_now, shape)
        };
        let frames: Vec<DebugFrame> = finished.frames.iter().enumerate().map(frame).collect();
        interchange::write_debug_log(&self.out, identity, &frames).map(|_| ()).map_err(folder_failure)
    }

    fn write_trace(&self, finished: &Finished) -> Result<(), Failure> {
        if self.run.trace.is_none() {
            return Ok(());
        }
        let id = &finished.record.identity;
        let dir = self.out.join(format!("trace/task_{:03}", id.task));
        make_folder(&dir)?;
        let mut text = String::new();
        for step in &finished.trace {
            text += &serde_json::to_string(step).map_err(Failure::input)?;
            text.push('\n');
        }
        replace(&dir.join(format!("episode_{:05}.jsonl", id.episode)), &text).map_err(folder_failure)
    }
}

/// Makes whoever drives an episode.
pub type Drive = Box<dyn Fn(script::Episode, TaskBrief) -> Result<Box<dyn Controller>, Failure> + Sync>;

/// A film that could not be made.
pub(super) fn film_failure(error: FilmError) -> Failure {
    match error {
        FilmError::Interrupted => Failure::interrupted("interrupted"),
        other => Failure::input(other),
    }
}

pub(super) fn folder_failure(error: RunFolderError) -> Failure {
    Failure::input(error)
}

/// One episode in one line.
fn line(record: &EpisodeRecord) -> String {
    let v = &record.verdict;
    let d = v.d_peak.map_or(String::new(), |d| format!(", D {d:.2} %"));
    let outcome = match (record.outcome.is_valid(), v.safety, v.goal) {
        (false, _, _) => "invalid",
        (_, true, _) => "safe",
        (_, false, true) => "goal, not safe",
        _ => "failed",
    };
    let reason = record.stats.gave_up.as_ref().map_or(String::new(), |reason| format!("; gave up: {reason}"));
    format!(
        "task {} episode {}: {outcome}{d}, {:.1} s{reason}",
        record.identity.task, record.identity.episode, record.stats.time_s
    )
}

#[cfg(test)]
#[path = "batch_tests.rs"]
mod tests;
