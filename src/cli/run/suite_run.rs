//! A run of one suite: its deformation limits, its episodes and their files.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    sync::Arc,
};

use crate::{
    benchmark::{ShiftValue, Suite, Task, settings::Settings},
    cli::{
        args::TraceDetail,
        error::{CliError, Exit},
        output::{Progress, notice},
        run::{
            calibration::{self, Calibration},
            config::RunConfig,
            episode_artifacts::EpisodeArtifacts,
            policy::ControllerFactory,
            recorded_policy::{ReplaySource, find_replay_source},
            resimulate,
            run_manifest::{self, RunManifest},
            selection::EpisodeJob,
        },
    },
    dataset::card::Imported,
    evaluation::{
        episode_id::{EpisodeId, EpisodeIndex, Split},
        record::{EpisodeRecord, Origin, Outcome},
        safety::{DeformationLimit, NOMINAL_KAPPA},
        summary::SuiteSummary,
        thresholds::ThresholdFile,
    },
    files, parallel,
    policy::{TaskBrief, remote::PolicyConnections},
    report::{
        run_folder::{EPISODES, RUN, RunFolder, SUMMARY},
        softvtbench_files,
    },
    rollout::{
        AssetCache, BuildError, Cancellable, ControlError, Episode, EpisodeError, EpisodeSpec,
        FinishedEpisode, SensorAssets, cancel, target_asset,
    },
    scene::{Asset, Body},
    script::{self, EpisodeSetup, LoadedScript},
    text::counted,
};

/// A suite with everything that its episodes need.
///
/// [`SuiteRun::prepare`] checks the scenes and reads the limits. [`run_suite`] then runs all episodes into the folder;
/// other commands run single episodes with [`SuiteRun::run_episode`].
pub(crate) struct SuiteRun<'a> {
    pub config: &'a RunConfig,
    pub loaded: &'a LoadedScript,
    pub suite: &'a Suite,
    /// Name in results.
    pub name: String,
    pub settings: Settings,
    pub jobs: Vec<EpisodeJob<'a>>,
    /// Deformation limits by asset. `None` if no squeeze of the calibration was stable, or without a calibration.
    pub limits: BTreeMap<String, Option<DeformationLimit>>,
    /// The calibrations in use, merged into a file in the format of SoftVTBench.
    thresholds: ThresholdFile,
    /// SHA-256 of every file that the results depend on, by name.
    pub sources: BTreeMap<String, String>,
    /// The recorded run whose actions are repeated.
    pub replay_source: Option<ReplaySource>,
    pub assets: AssetCache,
    pub sensor_assets: SensorAssets,
    /// Folder of the run.
    pub out: PathBuf,
    /// True if any episode may be rendered.
    pub renders_episodes: bool,
    /// True if the policy observes the true forces on the pads.
    pub force_observed: bool,
    pub split: Split,
    pub connections: Option<Arc<PolicyConnections>>,
    /// Demonstrations of other simulators that the episodes re-execute.
    pub origins: BTreeMap<EpisodeIndex, Origin>,
    /// Files of those demonstrations.
    pub imported: Vec<Imported>,
    pub controllers: ControllerFactory,
}

/// The episodes of a finished run, in order, with their summary.
pub(crate) struct SuiteResult {
    pub summary: SuiteSummary,
    pub records: Vec<EpisodeRecord>,
}

impl<'a> SuiteRun<'a> {
    /// A run of `jobs` into the folder `out`. Nothing is run or written yet.
    ///
    /// # Errors
    /// A setting or shift that does not exist, or whose value is out of range; recorded actions that do not fit.
    pub(crate) fn new(
        config: &'a RunConfig,
        loaded: &'a LoadedScript,
        suite: &'a Suite,
        jobs: Vec<EpisodeJob<'a>>,
        out: PathBuf,
    ) -> Result<Self, CliError> {
        let refuse =
            |flag: &str, error: String| CliError::input(error).prefixed(flag).prefixed(config.file.display());
        let settings =
            suite.settings.with_all(&config.settings).map_err(|e| refuse("--set", e.to_string()))?;
        for ShiftValue { name, value } in &config.shifts {
            script::check_shift(&suite.shifts, name, *value).map_err(|e| refuse("--shift", e.to_string()))?;
        }
        let replay_source = find_replay_source(config, suite, &jobs)?;
        let connections = config.policy.connections();
        let mut sources = loaded.bundle.hashes();
        sources.extend(config.policy.sources());
        let generated_by = format!("softvt {}", env!("CARGO_PKG_VERSION"));
        Ok(Self {
            config,
            loaded,
            suite,
            name: config.suite_name(suite),
            settings,
            jobs,
            limits: BTreeMap::new(),
            thresholds: ThresholdFile::new(NOMINAL_KAPPA, Vec::new(), generated_by),
            sources,
            force_observed: replay_source.as_ref().is_some_and(|source| source.force_observed),
            replay_source,
            assets: AssetCache::default(),
            sensor_assets: SensorAssets::default(),
            out,
            renders_episodes: config.video.is_some(),
            split: Split::Validation,
            controllers: config.policy.controller_factory(
                connections.clone(),
                &suite.name,
                config.is_rigid_twin,
            ),
            connections,
            origins: BTreeMap::new(),
            imported: Vec::new(),
        })
    }

    /// Shares prepared assets with runs of other suites.
    pub(crate) fn with_assets(self, assets: &AssetCache, sensor_assets: &SensorAssets) -> Self {
        Self { assets: assets.clone(), sensor_assets: sensor_assets.clone(), ..self }
    }

    /// Builds the scene of an episode: its layout, the shifts, and the rigid twin if requested.
    pub(crate) fn open_episode(&self, id: &EpisodeId) -> Result<EpisodeSetup, CliError> {
        let opened = EpisodeSetup::open(self.loaded, id, &self.config.shifts);
        let mut opened = opened.map_err(CliError::input)?;
        if self.config.is_rigid_twin {
            (opened.scene, opened.nominal) = (opened.scene.rigid_twin(), opened.nominal.rigid_twin());
        }
        Ok(opened)
    }

    pub(crate) fn brief(&self, task: &Task, episode: u32) -> TaskBrief {
        TaskBrief { suite: self.name.clone(), task: task.id, prompt: task.prompt.clone(), episode }
    }

    /// True if the policy has access to ground-truth state, or had it when its actions were recorded.
    pub(crate) fn is_privileged(&self) -> bool {
        self.config.policy.is_privileged()
            || self.replay_source.as_ref().is_some_and(|source| source.privileged)
    }

    /// Id of an episode of the run. The suite has its name in the script, which may differ from that in results.
    pub(crate) fn episode_id(&self, task: &Task, episode: u32) -> EpisodeId {
        EpisodeId {
            suite: self.suite.name.clone(),
            task: task.id,
            episode,
            base_seed: self.config.seed,
            split: self.split,
        }
    }

    /// Reads the deformation limits of the targets of tasks, without any other preparation.
    ///
    /// # Errors
    /// A layout or a calibration file that is not valid.
    pub(crate) fn read_limits(&mut self, tasks: &[Task]) -> Result<(), CliError> {
        tasks.iter().try_for_each(|task| {
            let opened = self.open_episode(&self.episode_id(task, 0))?;
            self.read_limit(target_asset(&opened.nominal, task).cloned())
        })
    }

    /// Reads the deformation limit of a target, if it is soft and its limit is not known yet.
    ///
    /// # Errors
    /// A calibration file that is not valid.
    pub(crate) fn read_limit(&mut self, target: Option<Arc<Asset>>) -> Result<(), CliError> {
        let soft = target.filter(|asset| matches!(asset.body, Body::Soft(_)));
        if let Some(asset) = soft.filter(|asset| !self.limits.contains_key(&asset.name)) {
            let limit = self.calibrated_limit(&asset)?;
            self.limits.insert(asset.name.clone(), limit);
        }
        Ok(())
    }

    /// Copies the limits of another run of the same suite, whose layouts are the same.
    pub(crate) fn copy_limits(&mut self, other: &Self) {
        self.limits.clone_from(&other.limits);
        self.thresholds.clone_from(&other.thresholds);
        self.sources.clone_from(&other.sources);
    }

    fn calibrated_limit(&mut self, asset: &Asset) -> Result<Option<DeformationLimit>, CliError> {
        let name = &asset.name;
        let fix =
            format!("its episodes cannot be judged safe; run: softvt scripts/calibrate.lua --asset {name}");
        match calibration::find(&self.config.file, asset)? {
            Calibration::Missing => {
                notice(format!("{name} is not calibrated (no assets/calibration/{name}.json): {fix}"));
                Ok(None)
            }
            Calibration::OtherVersion { path } => {
                notice(format!(
                    "{path} was computed for a different version of {name:?} (its shape, material or friction \
                     differ): {fix}"
                ));
                Ok(None)
            }
            Calibration::Found { limit, file, relative_path, text } => {
                self.sources.insert(relative_path, script::sha256(text.as_bytes()));
                self.thresholds.merge(*file);
                Ok(limit)
            }
        }
    }

    /// The limit of an object as the layout of this episode made it, before any shift.
    fn limit_of(&self, asset: &Asset) -> Option<DeformationLimit> {
        let limit = self.limits.get(&asset.name).copied().flatten()?;
        // A layout may change the object in single episodes; the calibration is not about that one.
        let calibrated = self.thresholds.fingerprints.get(&asset.name);
        calibrated.is_none_or(|calibrated| *calibrated == asset.fingerprint()).then_some(limit)
    }

    /// Runs the episodes that are not in `records`, writes all files and summarizes.
    ///
    /// # Errors
    /// A script, policy or file that fails, or an interrupt. Finished episodes are kept.
    pub(crate) fn run_all(
        &self,
        mut folder: RunFolder,
        mut records: Vec<EpisodeRecord>,
    ) -> Result<SuiteResult, CliError> {
        let remaining = self.remaining(&records);
        let outcome = match resimulate::restore_artifacts(self, &records) {
            Ok(()) => self.run_episodes(&remaining, &mut folder, &mut records),
            failed => failed,
        };
        let out = self.out.display();
        let kept = format!("{} of {} are in {out}", records.len(), counted(self.jobs.len(), "episode"));
        let interrupted =
            || CliError::interrupted(format!("interrupted; {kept}; continue with --resume --out {out}"));
        match outcome {
            // An error from before the interrupt has its own exit code and is reported as it is.
            Err(error) if error.exit == Exit::Interrupted => return Err(interrupted()),
            Err(error) if records.is_empty() => {
                // The same command must work once the error is fixed, and there is nothing to keep.
                folder.discard().map_err(CliError::input)?;
                return Err(error);
            }
            Err(error) => return Err(error.with_line(&kept)),
            Ok(()) if cancel::requested() => return Err(interrupted()),
            Ok(()) => {}
        }
        records.sort_by_key(|record| record.header.id.index());
        folder.write_in_order(&records).map_err(CliError::input)?;
        softvtbench_files::write_scores(&self.out, &records, &self.thresholds).map_err(CliError::input)?;
        let result = self.summarize(records);
        // Last, since a folder with a summary counts as finished.
        files::write_json(&self.out.join(SUMMARY), &result.summary).map_err(CliError::input)?;
        notice(out);
        Ok(result)
    }

    pub(crate) fn summarize(&self, records: Vec<EpisodeRecord>) -> SuiteResult {
        let summary = SuiteSummary::of(&self.name, self.config.policy.name(), &records);
        SuiteResult { summary, records }
    }

    /// True if a finished run lacks nothing: no episode, and no file of one.
    fn is_complete(&self, records: &[EpisodeRecord]) -> bool {
        let artifacts = self.artifacts();
        self.remaining(records).is_empty()
            && softvtbench_files::has_scores(&self.out)
            && records.iter().all(|record| artifacts.missing(record).is_empty())
    }

    /// Files of the episodes, other than their lines in `episodes.jsonl`.
    pub(crate) fn artifacts(&self) -> EpisodeArtifacts<'_> {
        EpisodeArtifacts::new(self.config, &self.out)
    }

    /// Checks that all records are episodes of this run, each at most once.
    ///
    /// # Errors
    /// The first line of `episodes.jsonl` that is not.
    pub(crate) fn check_records(
        &self,
        folder: &RunFolder,
        records: &[EpisodeRecord],
    ) -> Result<(), CliError> {
        let path = folder.path().join(EPISODES).display().to_string();
        if !records.is_empty() && folder.read(RUN).map_err(CliError::input)?.is_none() {
            return Err(CliError::input(format!(
                "{path}: there is no {RUN} next to it, so its run is not known"
            )));
        }
        let requested: BTreeSet<_> = self.jobs.iter().map(EpisodeJob::index).collect();
        let mut seen = BTreeSet::new();
        for (number, record) in records.iter().enumerate() {
            let (config, header) = (self.config, &record.header);
            let (id, index) = (&header.id, header.id.index());
            let is_own =
                id.suite == self.name && id.base_seed == config.seed && header.policy == config.policy.name();
            let problem = if !is_own || !requested.contains(&index) {
                "belongs to another run"
            } else if !seen.insert(index) {
                "occurs twice"
            } else {
                continue;
            };
            return Err(CliError::input(format!("{path}:{}: {index} {problem}", number + 1)));
        }
        Ok(())
    }

    /// Positions in `jobs` of the episodes that are not in `records`.
    fn remaining(&self, records: &[EpisodeRecord]) -> Vec<usize> {
        let finished: BTreeSet<_> = records.iter().map(|record| record.header.id.index()).collect();
        (0..self.jobs.len()).filter(|&job| !finished.contains(&self.jobs[job].index())).collect()
    }

    fn run_episodes(
        &self,
        remaining: &[usize],
        folder: &mut RunFolder,
        records: &mut Vec<EpisodeRecord>,
    ) -> Result<(), CliError> {
        let artifacts = self.artifacts();
        let mut progress = Progress::new(remaining.len(), &self.name);
        let outcome = parallel::run(
            remaining.len(),
            self.config.threads,
            cancel::requested,
            |index| {
                let job = self.jobs[remaining[index]];
                let keep_states = artifacts.may_render(job.episode);
                let mut finished = self.run_episode(job, keep_states, &self.controllers)?;
                let rendered = artifacts.render(&mut finished);
                Ok((finished, rendered))
            },
            |_, (finished, rendered)| {
                // The line comes after all other files, so that every listed episode is complete.
                artifacts.write(&finished)?;
                folder.append(&finished.record).map_err(CliError::input)?;
                progress.tick(&episode_line(&finished.record));
                report_unrendered(&finished, rendered);
                records.push(finished.record);
                Ok(())
            },
        );
        progress.finish();
        outcome
    }

    /// Runs one episode, from the start of its foreign demonstration if it has one. With `keep_states` the
    /// result can be rendered.
    ///
    /// # Errors
    /// The script, the scene or the controller fails.
    pub(crate) fn run_episode(
        &self,
        job: EpisodeJob<'_>,
        keep_states: bool,
        controllers: &ControllerFactory,
    ) -> Result<FinishedEpisode, CliError> {
        let origin = self.origins.get(&job.index());
        self.run_episode_from(job, origin, keep_states, controllers)?.map_err(|e| self.episode_error(&e))
    }

    /// Runs one episode from the start of a foreign demonstration, or from that of the layout.
    ///
    /// # Errors
    /// The script or the controller does not start. The inner result: the scene is not valid, or the episode fails.
    pub(crate) fn run_episode_from(
        &self,
        job: EpisodeJob<'_>,
        origin: Option<&Origin>,
        keep_states: bool,
        controllers: &ControllerFactory,
    ) -> Result<Result<FinishedEpisode, EpisodeError>, CliError> {
        let (spec, opened) = self.spec(job.task, &self.episode_id(job.task, job.episode), origin)?;
        let mut controller = Cancellable(controllers(opened, self.brief(job.task, job.episode))?);
        let spec = EpisodeSpec { record_states: keep_states, ..spec };
        let started = Episode::start(spec, &self.assets, &self.sensor_assets);
        Ok(started.and_then(|started| started.run(&mut controller)))
    }

    /// Starts an episode for an external client: settled, without a controller.
    ///
    /// # Errors
    /// The script or the scene fails.
    pub(crate) fn start_episode(&self, task: &Task, id: &EpisodeId) -> Result<Episode, CliError> {
        let (spec, _) = self.spec(task, id, None)?;
        Episode::start(spec, &self.assets, &self.sensor_assets).map_err(|e| self.episode_error(&e))
    }

    /// The specification of an episode, and the script's episode for the controller.
    fn spec(
        &self,
        task: &Task,
        id: &EpisodeId,
        origin: Option<&Origin>,
    ) -> Result<(EpisodeSpec, EpisodeSetup), CliError> {
        let mut opened = self.open_episode(id)?;
        if let Some(origin) = origin {
            origin.start.apply(&mut opened.scene);
        }
        let limit = target_asset(&opened.nominal, task).and_then(|asset| self.limit_of(asset));
        let id = EpisodeId { suite: self.name.clone(), ..id.clone() };
        let (policy, scene) = (self.config.policy.name(), opened.scene.clone());
        let mut spec = EpisodeSpec::new(id, policy, task, &opened.nominal, scene, &self.settings);
        spec.header.privileged = self.is_privileged();
        spec.header.origin = origin.cloned().map(Box::new);
        let record_trace = self.config.trace.is_some();
        let trace_nodes = self.config.trace == Some(TraceDetail::Nodes);
        Ok((EpisodeSpec { limit, record_trace, trace_nodes, ..spec }, opened))
    }

    /// Converts the error of an episode, with its place in the script.
    pub(crate) fn episode_error(&self, error: &EpisodeError) -> CliError {
        let exit = match error {
            // An error after the interrupt may be its consequence.
            _ if cancel::requested() => Exit::Interrupted,
            EpisodeError::Control { source: ControlError::Policy(_), .. } => Exit::Policy,
            _ => Exit::Input,
        };
        let message = match (error, error.place()) {
            // The message of this one begins with file and line.
            (EpisodeError::Build(BuildError::At { .. }), _) => error.to_string(),
            (_, Some(place)) => format!("{place}: {error}"),
            (_, None) => format!("{}: {error}", self.config.file.display()),
        };
        CliError { exit, message }
    }
}

/// Runs the episodes of a prepared suite into its folder. Episodes that are there already are kept.
///
/// # Errors
/// The folder contains another run, or one that may not be resumed; an episode fails.
pub(crate) fn run_suite(run: &SuiteRun, tasks: &[&Task]) -> Result<SuiteResult, CliError> {
    let config = run.config;
    let manifest = RunManifest::new(run, tasks, config.episodes.unwrap_or(run.suite.episodes));
    // The same command again on a finished folder changes nothing, even without --resume.
    let finished = is_finished(&run.out) && run_manifest::is_in(&run.out, &manifest)?;
    let opened = match config.resume || finished {
        true => RunFolder::resume(&run.out),
        false => RunFolder::create(&run.out).map(|folder| (folder, Vec::new())),
    };
    let (folder, records) = opened.map_err(|error| CliError::input(error).prefixed(config.file.display()))?;
    run.check_records(&folder, &records)?;
    run_manifest::write(&folder, &manifest)?;
    if finished && run.is_complete(&records) {
        notice(format!("{} is already complete", run.out.display()));
        return Ok(run.summarize(records));
    }
    run.run_all(folder, records)
}

/// True if a folder contains a finished run.
pub(crate) fn is_finished(dir: &Path) -> bool {
    dir.join(SUMMARY).is_file() && dir.join(RUN).is_file()
}

/// Reports an episode whose video could not be written. The episode counts nevertheless.
pub(crate) fn report_unrendered(finished: &FinishedEpisode, rendered: Result<(), CliError>) {
    if let Err(error) = rendered {
        notice(format!("no video of {}: {error}", finished.record.header.id.index()));
    }
}

/// Formats an episode as one line of progress.
pub(crate) fn episode_line(record: &EpisodeRecord) -> String {
    let verdict = &record.verdict;
    let d = verdict.d_peak.map_or(String::new(), |d| format!(", D {d:.2} %"));
    let outcome = match &record.outcome {
        Outcome::Invalid { reason, .. } => format!("invalid ({reason}){d}"),
        Outcome::Error { message } => format!("invalid ({message}){d}"),
        _ if verdict.safety => format!("safe{d}"),
        _ if verdict.goal => match (verdict.deformation_ok, verdict.d_peak, verdict.tau) {
            (Some(false), Some(d), Some(tau)) => format!("goal reached, unsafe (D {d:.2} % > τ {tau:.2} %)"),
            _ => format!("goal reached, unsafe{d}"),
        },
        _ => format!("failed{d}"),
    };
    let stats = &record.stats;
    let reason = stats.gave_up.as_ref().map_or(String::new(), |reason| format!("; gave up: {reason}"));
    format!("{}: {outcome}, {:.1} s{reason}", record.header.id.index(), stats.time_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        benchmark::Plan,
        cli::run::policy::PolicyConfig,
        policy::{Action, ActionChunk, ChunkedPolicy, Observation, Policy, PolicyError, SensorStreams},
        rollout::Controller,
    };

    /// Requests the true forces, holds still, and fails without them.
    struct ForceObserver;

    impl Policy for ForceObserver {
        fn name(&self) -> &str {
            "force_observer"
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

    fn force_observer(_: EpisodeSetup, brief: TaskBrief) -> Result<Box<dyn Controller>, CliError> {
        Ok(Box::new(ChunkedPolicy::new(Box::new(ForceObserver), brief, 1)))
    }

    #[test]
    fn every_file_of_a_run_records_whether_the_policy_observed_true_forces() {
        let config = RunConfig::new("suites/spatial_soft.lua".into(), PolicyConfig::expert());
        let loaded = script::load(&config.file, &[]).expect("it loads");
        let Plan::Suite(suite) = &loaded.plan else { panic!("a suite") };
        let mut suite = suite.clone();
        suite.tasks.truncate(1);
        suite.tasks[0].budget_steps = 3;
        let tasks: Vec<&Task> = suite.tasks.iter().collect();
        let root = tempfile::tempdir().expect("a folder");
        for (out, observed) in [("without", false), ("with", true)] {
            let dir = root.path().join(out);
            let jobs = vec![EpisodeJob { task: tasks[0], episode: 0 }];
            let mut run = SuiteRun::new(&config, &loaded, &suite, jobs, dir.clone()).expect("valid");
            if observed {
                run.controllers = Box::new(force_observer);
            }
            run.prepare(&tasks).expect("the scenes are valid");
            let folder = RunFolder::create(&dir).expect("a folder");
            run_manifest::write(&folder, &RunManifest::new(&run, &tasks, 1)).expect("written");
            run.run_all(folder, Vec::new()).expect("it runs");
            for file in [RUN, EPISODES, SUMMARY] {
                let text = std::fs::read_to_string(dir.join(file)).expect("written");
                let value: serde_json::Value = serde_json::from_str(&text).expect("one document");
                assert_eq!(value["force_observed"], observed, "{out}/{file}");
            }
        }
    }
}
