//! The episodes of one suite: their limits, their runs, their files.

use crate::cli::run::run_manifest;
use crate::cli::run::run_manifest::RunManifest;
use std::path::Path;
use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    sync::Arc,
};

use crate::{
    benchmark::{Suite, Task, seed::Split, settings::Settings},
    cli::{
        error::{CliError, Exit},
        output::Progress,
        run::config::RunConfig,
        run::{
            calibration::{self, Calibrated},
            episode_artifacts::EpisodeArtifacts,
            policy::ControllerSource,
            recorded_policy::{ReplaySource, recorded},
            resimulate,
        },
    },
    dataset::card::Imported,
    evaluation::{
        record::{EpisodeRecord, Origin},
        safety::{DeformationLimit, NOMINAL_KAPPA},
        summary::SuiteSummary,
        thresholds::ThresholdFile,
    },
    parallel,
    policy::TaskBrief,
    report::{
        run_folder::{EPISODES, RUN, RunFolder, SUMMARY},
        softvtbench_files,
    },
    rollout::{
        AssetCache, BuildError, Cancellable, ControlError, Controller, Episode, EpisodeError, EpisodeRef,
        EpisodeSpec, FinishedEpisode, SensorAssets, cancel, target_asset,
    },
    scene::{Asset, Body},
    script::{self, Loaded},
};

/// One suite under way.
pub(crate) struct SuiteRun<'a> {
    pub run: &'a RunConfig,
    pub loaded: &'a Loaded,
    pub suite: &'a Suite,
    /// Name in results.
    pub name: String,
    pub settings: Settings,
    pub jobs: Vec<(&'a Task, u32)>,
    pub limits: BTreeMap<String, Option<DeformationLimit>>,
    /// The thresholds in use as one file of SoftVTBench's form.
    released: ThresholdFile,
    /// SHA-256 of every file that the results depend on.
    pub sources: BTreeMap<String, String>,
    /// Whose actions are carried out once more.
    pub(crate) replayed: Option<ReplaySource>,
    pub(crate) cache: AssetCache,
    pub(crate) looks: SensorAssets,
    pub out: PathBuf,
    /// Whether rollouts are drawn.
    pub films: bool,
    /// Whether whoever drives sees the true forces at the pads.
    pub force_observed: bool,
    /// Which list its episodes are of.
    pub split: Split,
    pub(crate) drivers: Arc<ControllerSource>,
    /// ForeignFile demonstrations that episodes re-execute, by task and episode.
    pub origins: BTreeMap<(usize, u32), Origin>,
    /// The files that those are from.
    pub imported: Vec<Imported>,
    pub drive: ControllerFactory,
}

impl<'a> SuiteRun<'a> {
    /// `jobs` of a suite, to be kept in `out`.
    ///
    /// # Errors
    /// A setting or shift that the suite does not have, or a value out of its range.
    pub(crate) fn new(
        run: &'a RunConfig,
        loaded: &'a Loaded,
        suite: &'a Suite,
        (jobs, out): (Vec<(&'a Task, u32)>, PathBuf),
    ) -> Result<Self, CliError> {
        let wrong = |flag: &str, e: String| CliError::input(format!("{}: {flag}: {e}", run.file.display()));
        let settings = suite.settings.with_all(&run.set).map_err(|e| wrong("--set", e))?;
        for (name, value) in &run.shifts {
            script::check_shift(&suite.shifts, name, *value).map_err(|e| wrong("--shift", e.to_string()))?;
        }
        let replayed = recorded(run, suite, &jobs)?;
        let force_observed = replayed.as_ref().is_some_and(|replayed| replayed.force_observed);
        let drivers = Arc::new(ControllerSource::new(&run.policy, &suite.name, run.twin));
        let driving = drivers.clone();
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
            released: ThresholdFile::new(NOMINAL_KAPPA, Vec::new(), made_by),
            sources,
            replayed,
            cache: AssetCache::default(),
            looks: SensorAssets::default(),
            out,
            films: run.video.is_some(),
            force_observed,
            split: Split::Validation,
            origins: BTreeMap::new(),
            imported: Vec::new(),
            drivers,
            drive: Box::new(move |opened, brief| driving.drive(opened, brief)),
        })
    }

    /// The same with what was made of assets for other suites.
    pub(crate) fn sharing(mut self, cache: &AssetCache, looks: &SensorAssets) -> Self {
        (self.cache, self.looks) = (cache.clone(), looks.clone());
        self
    }

    /// An episode as its layout, the shifts and the run make it.
    pub(crate) fn open(&self, request: &script::EpisodeRequest) -> Result<script::Episode, CliError> {
        let mut opened = script::Episode::open(self.loaded, request).map_err(CliError::input)?;
        if self.run.twin {
            (opened.scene, opened.nominal) = (opened.scene.rigid_twin(), opened.nominal.rigid_twin());
        }
        Ok(opened)
    }

    pub(crate) fn brief(&self, task: &Task, episode: u32) -> TaskBrief {
        TaskBrief { suite: self.name.clone(), task: task.id, prompt: task.prompt.clone(), episode }
    }

    /// Whether whoever drives sees the true state, or saw it when the actions were recorded.
    pub(crate) fn is_privileged(&self) -> bool {
        self.run.policy.is_privileged() || self.replayed.as_ref().is_some_and(|replayed| replayed.privileged)
    }

    /// Which episode of a task it is.
    pub(crate) fn request(&self, task: &Task, episode: u32) -> script::EpisodeRequest {
        script::EpisodeRequest {
            suite: self.suite.name.clone(),
            task: task.id,
            episode: u64::from(episode),
            base_seed: self.run.seed,
            split: self.split,
            shifts: self.run.shifts.clone(),
        }
    }

    /// Reads the thresholds of the targets of tasks, and does nothing else to prepare them.
    ///
    /// # Errors
    /// A layout or a threshold file that is wrong.
    pub(crate) fn learn_limits(&mut self, tasks: &[Task]) -> Result<(), CliError> {
        tasks.iter().try_for_each(|task| {
            let opened = self.open(&self.request(task, 0))?;
            self.learn_limit(target_asset(&opened.nominal, task).cloned())
        })
    }

    /// Reads the threshold of a task's target, if it is a soft one whose threshold is not known yet.
    ///
    /// # Errors
    /// A threshold file that is wrong.
    pub(crate) fn learn_limit(&mut self, target: Option<Arc<Asset>>) -> Result<(), CliError> {
        let soft = target.filter(|asset| matches!(asset.body, Body::Soft(_)));
        if let Some(asset) = soft.filter(|asset| !self.limits.contains_key(&asset.name)) {
            let limit = self.find_limit(&asset)?;
            self.limits.insert(asset.name.clone(), limit);
        }
        Ok(())
    }

    /// Takes over the limits of another batch of the same suite, whose layouts are the same.
    pub(crate) fn share_limits(&mut self, other: &Self) {
        self.limits.clone_from(&other.limits);
        self.released.clone_from(&other.released);
        self.sources.clone_from(&other.sources);
    }

    fn find_limit(&mut self, asset: &Asset) -> Result<Option<DeformationLimit>, CliError> {
        let name = &asset.name;
        let cure = format!("its episodes cannot count as safe; softvt scripts/calibrate.lua --asset {name}");
        match calibration::calibrated(&self.run.file, asset)? {
            Calibrated::Never => crate::text::eprint_line(&format!(
                "softvt: {name} is not calibrated (assets/calibration/{name}.json): {cure}"
            )),
            Calibrated::Another(path) => {
                crate::text::eprint_line(&format!(
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
    fn limit_of(&self, asset: &Asset) -> Option<DeformationLimit> {
        let limit = self.limits.get(&asset.name).copied().flatten()?;
        let known = self.released.fingerprints.get(&asset.name);
        known.is_none_or(|known| *known == asset.fingerprint()).then_some(limit)
    }

    /// Runs the episodes that are not `done` and sums all up.
    ///
    /// # Errors
    /// A script, policy or file that fails, or an interrupt; finished episodes are kept.
    pub(crate) fn run_all(
        &self,
        mut folder: RunFolder,
        done: Vec<EpisodeRecord>,
    ) -> Result<SuiteResult, CliError> {
        let mut records = done;
        let left = self.left(&records);
        let outcome = match resimulate::make_lost_files(self, &records) {
            Ok(()) => self.run_episodes(&left, &mut folder, &mut records),
            failed => failed,
        };
        let kept = format!("{} of {} episodes are in {}", records.len(), self.jobs.len(), self.out.display());
        let interrupted = || {
            CliError::interrupted(format!(
                "interrupted; {kept}; go on with --resume --out {}",
                self.out.display()
            ))
        };
        match outcome {
            // What failed before the end was asked for is what went wrong, however long others took to end.
            Err(failure) if failure.exit == Exit::Interrupted => return Err(interrupted()),
            Err(failure) if records.is_empty() => {
                // Nothing would be lost, and the same command must work once the mistake is mended.
                folder.discard().map_err(folder_failure)?;
                return Err(failure);
            }
            Err(failure) => {
                return Err(CliError { message: format!("{}\n{kept}", failure.message), ..failure });
            }
            Ok(()) if cancel::requested() => return Err(interrupted()),
            Ok(()) => {}
        }
        records.sort_by_key(|r| (r.identity.task, r.identity.episode));
        folder.put_in_order(&records).map_err(folder_failure)?;
        softvtbench_files::write_scores(&self.out, &records, &self.released).map_err(folder_failure)?;
        let done = self.summed_up(records);
        // The last of all: a folder with a summary is finished.
        crate::files::write_json(&self.out.join(SUMMARY), &done.summary).map_err(CliError::input)?;
        crate::text::eprint_line(&format!("softvt: {}", self.out.display()));
        Ok(done)
    }

    /// Episodes with what they come to.
    pub(crate) fn summed_up(&self, records: Vec<EpisodeRecord>) -> SuiteResult {
        let policy = &self.run.policy;
        let summary = SuiteSummary::of(&self.name, policy.name(), &records);
        SuiteResult { summary, records }
    }

    /// Whether nothing of a finished run is missing: no episode, and no file of one.
    pub(crate) fn is_whole(&self, done: &[EpisodeRecord]) -> bool {
        let files = self.files();
        self.left(done).is_empty()
            && softvtbench_files::has_scores(&self.out)
            && done.iter().all(|record| files.lost(record).is_empty())
    }

    /// The files of its episodes beside their lines.
    pub(crate) fn files(&self) -> EpisodeArtifacts<'_> {
        EpisodeArtifacts::of(self.run, &self.out)
    }

    /// Refuses episodes of another run, or one that is there twice.
    ///
    /// # Errors
    /// The first such line of the folder's `episodes.jsonl`.
    pub(crate) fn check_done(&self, folder: &RunFolder, done: &[EpisodeRecord]) -> Result<(), CliError> {
        let path = folder.path().join(EPISODES).display().to_string();
        if !done.is_empty() && folder.read(RUN).map_err(folder_failure)?.is_none() {
            return Err(CliError::input(format!(
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
            return Err(CliError::input(format!(
                "{path}:{line}: task {} episode {} {wrong}",
                id.task, id.episode
            )));
        }
        Ok(())
    }

    /// The jobs that are not done.
    pub(crate) fn left(&self, done: &[EpisodeRecord]) -> Vec<usize> {
        let done: BTreeSet<_> = done.iter().map(|r| (r.identity.task, r.identity.episode)).collect();
        (0..self.jobs.len()).filter(|&job| !done.contains(&(self.jobs[job].0.id, self.jobs[job].1))).collect()
    }

    /// Runs jobs; an episode's line is written after all its other files, so that whoever is listed is whole.
    fn run_episodes(
        &self,
        left: &[usize],
        folder: &mut RunFolder,
        records: &mut Vec<EpisodeRecord>,
    ) -> Result<(), CliError> {
        let files = self.files();
        let mut progress = Progress::new(left.len(), &self.name);
        let outcome = parallel::run(
            left.len(),
            self.run.threads,
            cancel::requested,
            |index| {
                let job = left[index];
                let mut finished = self.episode(job, files.may_show(self.jobs[job].1), &self.drive)?;
                let drawn = files.draw(&mut finished);
                Ok((finished, drawn))
            },
            |_, (finished, drawn)| {
                files.write(&finished)?;
                folder.append(&finished.record).map_err(folder_failure)?;
                progress.tick(&line(&finished.record));
                tell_undrawn(&finished, drawn);
                records.push(finished.record);
                Ok(())
            },
        );
        progress.finish();
        outcome
    }

    /// Runs one job by `drive`; with `film` what is needed to draw it is kept.
    ///
    /// # Errors
    /// A script, the scene or whoever drives fails.
    pub(crate) fn episode(
        &self,
        job: usize,
        film: bool,
        drive: &ControllerFactory,
    ) -> Result<FinishedEpisode, CliError> {
        let (task, episode) = self.jobs[job];
        let origin = self.origins.get(&(task.id, episode));
        self.episode_from(job, origin, film, drive)?.map_err(|e| self.episode_failure(&e))
    }

    /// The same from the start of a foreign demonstration, or from that of the layout.
    ///
    /// # Errors
    /// A script or whoever drives does not begin; within, what is wrong with the scene or happens on the way.
    pub(crate) fn episode_from(
        &self,
        job: usize,
        origin: Option<&Origin>,
        film: bool,
        drive: &ControllerFactory,
    ) -> Result<Result<FinishedEpisode, EpisodeError>, CliError> {
        let (task, episode) = self.jobs[job];
        let (spec, opened) = self.spec(task, &self.request(task, episode), origin)?;
        let driver = drive(opened, self.brief(task, episode))?;
        let mut driver = Cancellable(driver);
        let started = Episode::start(EpisodeSpec { record_states: film, ..spec }, &self.cache, &self.looks);
        Ok(started.and_then(|started| started.run(&mut driver)))
    }

    /// The settled start of an episode, for somebody else to drive.
    ///
    /// # Errors
    /// A script or the scene fails.
    pub(crate) fn begin(&self, task: &Task, request: &script::EpisodeRequest) -> Result<Episode, CliError> {
        let (spec, _) = self.spec(task, request, None)?;
        Episode::start(spec, &self.cache, &self.looks).map_err(|e| self.episode_failure(&e))
    }

    /// All of an episode but who drives, and what its script made.
    fn spec(
        &self,
        task: &Task,
        request: &script::EpisodeRequest,
        origin: Option<&Origin>,
    ) -> Result<(EpisodeSpec, script::Episode), CliError> {
        let mut opened = self.open(request)?;
        if let Some(origin) = origin {
            origin.start.apply(&mut opened.scene);
        }
        let limit = target_asset(&opened.nominal, task).and_then(|asset| self.limit_of(asset));
        let which = EpisodeRef {
            suite: &self.name,
            episode: request.episode as u32,
            seed: request.base_seed,
            split: request.split,
            policy: self.run.policy.name(),
        };
        let scenes = (&opened.nominal, opened.scene.clone());
        let mut spec = EpisodeSpec::new(&which, task, scenes, &self.settings);
        spec.identity.privileged = self.is_privileged();
        spec.identity.origin = origin.cloned().map(Box::new);
        Ok((EpisodeSpec { limit, trace: self.run.trace, ..spec }, opened))
    }

    pub(crate) fn episode_failure(&self, error: &EpisodeError) -> CliError {
        let exit = match error {
            // What fails after the end was asked for may fail because of that.
            _ if cancel::requested() => Exit::Interrupted,
            EpisodeError::Control { source: ControlError::Policy(_), .. } => Exit::Policy,
            _ => Exit::Input,
        };
        let message = match (error, error.place()) {
            // It says which file and line itself.
            (EpisodeError::Build(BuildError::At { .. }), _) => error.to_string(),
            (_, Some(place)) => format!("{place}: {error}"),
            (_, None) => format!("{}: {error}", self.run.file.display()),
        };
        CliError { exit, message }
    }
}

/// Runs the jobs of a batch that is prepared, into its folder; those that are done there stay.
///
/// # Errors
/// The folder holds another run, or one that is not to be resumed; an episode fails.
pub(crate) fn run_suite(batch: &SuiteRun, tasks: &[&Task]) -> Result<SuiteResult, CliError> {
    let run = batch.run;
    // The same command again on a finished folder changes nothing.
    let episodes = run.episodes.unwrap_or(batch.suite.episodes);
    let info = RunManifest::of(batch, tasks, episodes);
    let finished = is_finished(&batch.out) && run_manifest::is_of(&batch.out, &info)?;
    let opened = match run.resume || finished {
        true => RunFolder::resume(&batch.out),
        false => RunFolder::create(&batch.out).map(|folder| (folder, Vec::new())),
    };
    let (folder, done) = opened.map_err(|e| CliError::input(format!("{}: {e}", run.file.display())))?;
    batch.check_done(&folder, &done)?;
    run_manifest::write(&folder, &info)?;
    if finished && batch.is_whole(&done) {
        crate::text::eprint_line(&format!("softvt: {} is finished already", batch.out.display()));
        return Ok(batch.summed_up(done));
    }
    batch.run_all(folder, done)
}

/// Whether a folder holds a run that came to its end.
pub(crate) fn is_finished(dir: &Path) -> bool {
    dir.join(SUMMARY).is_file() && dir.join(RUN).is_file()
}

/// Makes whoever drives an episode.
pub(crate) type ControllerFactory =
    Box<dyn Fn(script::Episode, TaskBrief) -> Result<Box<dyn Controller>, CliError> + Sync>;

/// The episodes of a run that came to its end, in order, and what they come to.
pub(crate) struct SuiteResult {
    /// What they come to.
    pub summary: SuiteSummary,
    /// The episodes.
    pub records: Vec<EpisodeRecord>,
}

/// An episode counts whether or not it can be drawn.
pub(crate) fn tell_undrawn(finished: &FinishedEpisode, drawn: Result<(), CliError>) {
    if let Err(failure) = drawn {
        let message = format!("softvt: no video of {}: {}", line(&finished.record), failure.message);
        crate::text::eprint_line(&message);
    }
}

pub(crate) fn folder_failure(error: impl std::fmt::Display) -> CliError {
    CliError::input(error)
}

/// One episode in one line.
pub(crate) fn line(record: &EpisodeRecord) -> String {
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
mod tests {
    use super::*;
    use crate::{
        benchmark::Plan,
        cli::{
            args::{self, Command},
            run::run_manifest::{self, RunManifest},
        },
        policy::{Action, ActionChunk, ChunkedPolicy, Observation, Policy, PolicyError, SensorStreams},
        report::run_folder::{EPISODES, RUN},
    };

    /// Asks for the true forces, holds still, and complains if it does not get them.
    struct Feeler;

    impl Policy for Feeler {
        fn name(&self) -> &str {
            "feeler"
        }

        fn streams(&self) -> SensorStreams {
            SensorStreams { force: true, ..SensorStreams::default() }
        }

        fn act(&mut self, seen: &Observation) -> Result<ActionChunk, PolicyError> {
            seen.forces.as_ref().ok_or(PolicyError::Action("no forces".to_owned()))?;
            Ok(Action { position_b: seen.ee_position_b, axis_angle_b: seen.ee_axis_angle_b, closure: 0.0 }
                .into())
        }
    }

    fn feeler(_: script::Episode, brief: TaskBrief) -> Result<Box<dyn Controller>, CliError> {
        Ok(Box::new(ChunkedPolicy::new(Box::new(Feeler), brief, 1)))
    }

    #[test]
    fn every_file_of_a_run_says_whether_the_policy_saw_true_forces() {
        let words = ["softvt", "suites/spatial_soft.lua", "--threads", "1"].map(str::to_owned);
        let Ok(Command::Run(run)) = args::parse(&words) else { panic!("a run") };
        let loaded = script::load(&run.file, &[]).expect("it loads");
        let Plan::Suite(suite) = &loaded.plan else { panic!("a suite") };
        let mut suite = suite.clone();
        suite.tasks.truncate(1);
        suite.tasks[0].budget_steps = 3;
        let tasks: Vec<&Task> = suite.tasks.iter().collect();
        let root = tempfile::tempdir().expect("a folder");
        for (out, felt) in [("blind", false), ("felt", true)] {
            let dir = root.path().join(out);
            let mut batch =
                SuiteRun::new(&run, &loaded, &suite, (vec![(tasks[0], 0)], dir.clone())).expect("made");
            if felt {
                batch.drive = Box::new(feeler);
            }
            batch.prepare(&tasks).expect("nothing is wrong");
            let folder = RunFolder::create(&dir).expect("a folder");
            run_manifest::write(&folder, &RunManifest::of(&batch, &tasks, 1)).expect("written");
            batch.run_all(folder, Vec::new()).expect("it runs");
            for file in [RUN, EPISODES, SUMMARY] {
                let text = std::fs::read_to_string(dir.join(file)).expect("written");
                let value: serde_json::Value = serde_json::from_str(&text).expect("one document");
                assert_eq!(value["force_observed"], felt, "{out}/{file}");
            }
        }
    }
}
