//! A suite with everything that its episodes need: settings, deformation limits, assets and controllers.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::Deref,
    path::{Path, PathBuf},
    sync::Arc,
};

use crate::{
    config::{RunConfig, TraceDetail},
    episode_artifacts::EpisodeArtifacts,
    episode_list::{EpisodeJob, EpisodeList},
    error::{RunError, RunErrorCause},
    limits::{CalibrationFiles, Calibrations, LimitScan, SceneLimits},
    policy::{ControllerFactory, DeclaredStreams, PolicyConfig},
    recorded_runs::RecordedRuns,
    suite_selection::{select_episodes, select_tasks},
};
use softvt_benchmark::{ObjectType, ShiftValue, Suite, Task, settings::Settings};
use softvt_common::{
    cancel,
    episode_id::{EpisodeId, EpisodeIndex, EpisodeSplit},
    parallel,
    text::unknown_name,
};
use softvt_policy::{EpisodeBrief, PolicyError, SensorStreams, remote::PolicyConnections};
use softvt_rollout::{
    AssetCache, Episode, EpisodeError, EpisodeSpec, FinishedEpisode, SceneBuildError, Sensors, Simulation,
    StatePredicate, check_goal, check_sensors, cost_warning, ineffective_friction,
};
use softvt_runs::{
    manifest::{ImportedFile, ReplaySource},
    record::{DemonstrationOrigin, PRIVILEGED_POLICIES},
};
use softvt_scene::{Body, Camera, Object, Scene};
use softvt_script::{EpisodeSetup, LoadedScript, SceneBuilder, SceneChanges};

/// Episodes per task whose scenes are built before a run, to find all assets and the limits that are missing.
const MAX_SCANNED_EPISODES: usize = 100;

/// Tilt while settling that is reported, and that of an object that has fallen over, degrees.
const MAX_TILT_DEG: f64 = 5.0;
const FALLEN_DEG: f64 = 45.0;

/// A suite with everything that its episodes need: [`SuiteRun::run_episode`] runs single episodes.
///
/// [`SuiteRun::prepare`] checks the scenes and reads the limits. [`run_suites`](super::run_suites) does that, and then
/// runs all episodes of the suite.
pub struct SuiteRun<'a> {
    pub config: &'a RunConfig,
    pub loaded: &'a LoadedScript,
    pub suite: &'a Suite,
    pub name: String,
    /// Settings of the suite with the changes of the run.
    pub settings: Settings,
    pub jobs: EpisodeList<'a>,
    /// Folder of the run, if it has one.
    pub out: Option<PathBuf>,
    pub(crate) split: EpisodeSplit,
    /// Files with the deformation limits of the objects; `None` if these have none, since no verdict is shown.
    pub(crate) calibration_files: Option<Arc<CalibrationFiles>>,
    pub(crate) replay_source: Option<ReplaySource>,
    /// Data derived from the objects, shared by all episodes.
    pub(crate) assets: AssetCache,
    /// True if any episode may be rendered.
    pub(crate) renders_episodes: bool,
    /// True if every control step is recorded.
    pub(crate) records_trace: bool,
    pub(crate) connections: Option<Arc<PolicyConnections>>,
    pub(crate) import: ImportedDemos,
    pub controllers: ControllerFactory,
}

/// Demonstrations of other simulators that the episodes of a run re-execute.
#[derive(Clone, Debug, Default)]
pub(crate) struct ImportedDemos {
    pub origins: BTreeMap<EpisodeIndex, DemonstrationOrigin>,
    pub files: Vec<ImportedFile>,
}

/// A run whose scenes are valid, with the limits of their objects.
pub struct PreparedRun<'a> {
    run: SuiteRun<'a>,
    /// The calibrations of the assets in the scenes of the run.
    pub(crate) calibrations: Calibrations,
    /// SHA-256 of every file that the results depend on, by name.
    pub sources: BTreeMap<String, String>,
    /// True if the policy observes the true forces on the pads.
    pub force_observed: bool,
}

impl<'a> Deref for PreparedRun<'a> {
    type Target = SuiteRun<'a>;

    fn deref(&self) -> &SuiteRun<'a> {
        &self.run
    }
}

impl<'a> SuiteRun<'a> {
    /// A run of the episodes `jobs` of a split, without a folder. Nothing is run yet.
    ///
    /// # Errors
    /// A setting or shift that does not exist, or whose value is out of range; recorded actions that do not fit.
    pub fn new(
        config: &'a RunConfig,
        loaded: &'a LoadedScript,
        suite: &'a Suite,
        jobs: EpisodeList<'a>,
        split: EpisodeSplit,
    ) -> Result<Self, RunError> {
        let settings = suite.settings.with_all(&config.settings);
        let settings = settings.map_err(|error| config.error_of("settings", "", error))?;
        for ShiftValue { name, value } in &config.shifts {
            softvt_script::check_shift(&suite.shifts, name, *value)
                .map_err(|error| config.error_of("shifts", "", error))?;
        }
        let replay_source = find_replay_source(config, suite, &jobs, split)?;
        let connections = config.policy.connections();
        let controllers =
            config.policy.controller_factory(connections.clone(), &suite.name, config.rigid_twin);
        Ok(Self {
            config,
            loaded,
            suite,
            name: config.suite_name(suite),
            settings,
            jobs,
            out: None,
            split,
            calibration_files: Some(Arc::new(CalibrationFiles::new(config))),
            replay_source,
            assets: loaded.sources.assets.clone(),
            renders_episodes: config.video.is_some() || config.mcap.is_some(),
            records_trace: config.trace.is_some(),
            connections,
            import: ImportedDemos::default(),
            controllers,
        })
    }

    /// A run of the tasks and episodes that the configuration selects, into the folder `out` if there is one.
    pub(crate) fn selected(
        config: &'a RunConfig,
        loaded: &'a LoadedScript,
        suite: &'a Suite,
        out: Option<PathBuf>,
    ) -> Result<Self, RunError> {
        let jobs = select_episodes(config, suite, &select_tasks(config, suite)?);
        Ok(Self { out, ..Self::new(config, loaded, suite, jobs, EpisodeSplit::Validation)? })
    }

    /// The same run, of which every episode can be rendered.
    pub fn rendered(self) -> Self {
        Self { renders_episodes: true, ..self }
    }

    /// Builds the scene of an episode with the changes of the run.
    ///
    /// # Errors
    /// The script fails, or a scene is not valid.
    pub fn open_episode(&self, id: &EpisodeId) -> Result<EpisodeSetup, RunError> {
        Ok(EpisodeSetup::open(self.loaded, id, &self.changes())?)
    }

    pub fn changes(&self) -> SceneChanges {
        SceneChanges {
            shifts: self.config.shifts.clone(),
            rigid_twin: self.config.rigid_twin,
            cameras: self.settings.cameras,
        }
    }

    pub(crate) fn brief(&self, task: &Task, episode: u32) -> EpisodeBrief {
        let secret = self.config.secret.as_ref();
        EpisodeBrief {
            suite: self.name.clone(),
            task: task.id,
            prompt: task.prompt.clone(),
            episode,
            seed: self.config.base_seed(),
            alias: secret.map(|secret| secret.episode_name(&self.name, task.id, episode)),
        }
    }

    /// True if the policy has access to ground-truth state, or had it when its actions were recorded; also for the name
    /// of a policy that has.
    pub(crate) fn is_privileged(&self) -> bool {
        let PolicyConfig { privileged, name, .. } = &self.config.policy;
        *privileged
            || PRIVILEGED_POLICIES.contains(&name.as_str())
            || self.replay_source.as_ref().is_some_and(|source| source.privileged)
    }

    /// Id of an episode of the run. The suite has its name in the script, which may differ from that in results.
    pub fn episode_id(&self, task: &Task, episode: u32) -> EpisodeId {
        EpisodeId {
            suite: self.suite.name.clone(),
            task: task.id,
            episode,
            base_seed: self.config.base_seed(),
            split: self.split,
        }
    }

    /// Limits of the objects in the scene of an episode.
    pub(crate) fn limits_of(&self, task: &Task, scene: &Scene) -> Result<SceneLimits, RunError> {
        match &self.calibration_files {
            Some(files) => files.limits_of(scene, &task.targets()),
            None => Ok(SceneLimits::default()),
        }
    }

    /// The same, with messages about objects that have none.
    fn reported_limits(&self, task: &Task, episode: u32, scene: &Scene) -> Result<SceneLimits, RunError> {
        let limits = self.limits_of(task, scene)?;
        if let Some(files) = &self.calibration_files {
            files.report(EpisodeIndex { task: task.id, episode }, &limits);
        }
        Ok(limits)
    }

    /// Builds the scenes of the first episodes of each task, returns the calibrations of their assets, and reports
    /// objects without a limit. A layout that fails ends the scan of its task; the episode itself reports the error.
    pub(crate) fn scan_limits(&self) -> Result<Calibrations, RunError> {
        let Some(files) = &self.calibration_files else { return Ok(Calibrations::default()) };
        let tasks = self.jobs.tasks();
        let mut scan = LimitScan::default();
        parallel::run(
            tasks.len(),
            self.config.thread_count(),
            cancel::requested,
            |job| self.scan_task(tasks[job]),
            |_, found| {
                found.into_iter().for_each(|(index, limits)| scan.add(index, limits));
                Ok(())
            },
        )?;
        scan.report(files);
        Ok(scan.calibrations(files))
    }

    /// Limits in the first episodes of a task. All shards of a run look at the same episodes.
    fn scan_task(&self, task: &Task) -> Result<BTreeMap<EpisodeIndex, SceneLimits>, RunError> {
        let of_task = self.jobs.episodes_of(task.id);
        let episodes: Vec<u32> = match self.config.shard {
            Some(_) => (0..self.config.episodes_of(self.suite)).take(MAX_SCANNED_EPISODES).collect(),
            None => of_task.take(MAX_SCANNED_EPISODES).collect(),
        };
        let (mut found, changes) = (BTreeMap::new(), self.changes());
        // Errors are reported when the episode is run. The episodes of a task share a virtual machine, in their order,
        // so that what it keeps of one for the next does not depend on threads.
        let Ok(builder) = SceneBuilder::open(self.loaded) else { return Ok(found) };
        for episode in episodes {
            let Ok(opened) = builder.build(&self.episode_id(task, episode), &changes) else { break };
            found.insert(EpisodeIndex { task: task.id, episode }, self.limits_of(task, &opened.scene)?);
        }
        Ok(found)
    }

    /// Files of the episodes, other than their lines in `episodes.jsonl`.
    pub(crate) fn artifacts(&self) -> EpisodeArtifacts<'_> {
        let RunConfig { trace, video, mcap, .. } = self.config;
        let dir = self.out.as_deref().unwrap_or(Path::new(""));
        EpisodeArtifacts { dir, trace: *trace, video: video.as_ref(), mcap: mcap.as_ref() }
    }

    /// Runs one episode, from the start of its foreign demonstration if it has one. With `keep_states` the
    /// result can be rendered.
    ///
    /// # Errors
    /// The script, the scene or the controller fails.
    pub fn run_episode(
        &self,
        job: EpisodeJob<'_>,
        keep_states: bool,
        controllers: &ControllerFactory,
    ) -> Result<FinishedEpisode, RunError> {
        let origin = self.import.origins.get(&job.index());
        let run = self.simulate(job, origin, keep_states, controllers, &mut |_| Ok(()))?;
        run.map_err(|error| self.episode_error(&error))
    }

    /// Runs one episode from the start of a foreign demonstration, or from that of the layout, and calls `watch` as
    /// [`Episode::run_watched`] does.
    pub(crate) fn simulate(
        &self,
        job: EpisodeJob<'_>,
        origin: Option<&DemonstrationOrigin>,
        keep_states: bool,
        controllers: &ControllerFactory,
        watch: &mut dyn FnMut(&mut Episode) -> Result<(), PolicyError>,
    ) -> Result<Result<FinishedEpisode, EpisodeError>, RunError> {
        let (spec, opened) = self.spec(job.task, &self.episode_id(job.task, job.episode), origin)?;
        let brief = EpisodeBrief { prompt: opened.prompt.clone(), ..self.brief(job.task, job.episode) };
        let mut controller = controllers(opened, brief)?;
        let spec = EpisodeSpec { record_states: keep_states, ..spec };
        let started = Episode::start(spec, &self.assets);
        Ok(started.and_then(|started| started.run_watched(&mut *controller, watch)))
    }

    /// Runs one episode, and calls `watch` in its settled state and after each control step ([`Episode::run_watched`]).
    pub fn run_episode_watched(
        &self,
        job: EpisodeJob<'_>,
        watch: &mut dyn FnMut(&mut Episode) -> Result<(), PolicyError>,
    ) -> Result<FinishedEpisode, RunError> {
        let run = self.simulate(job, None, false, &self.controllers, watch)?;
        run.map_err(|error| self.episode_error(&error))
    }

    /// Starts an episode for an external client: settled, without a controller.
    pub fn start_episode(&self, task: &Task, id: &EpisodeId) -> Result<Episode, RunError> {
        let (spec, _) = self.spec(task, id, None)?;
        Episode::start(spec, &self.assets).map_err(|e| self.episode_error(&e))
    }

    /// The specification of an episode, and the script's episode for the controller.
    fn spec(
        &self,
        task: &Task,
        id: &EpisodeId,
        origin: Option<&DemonstrationOrigin>,
    ) -> Result<(EpisodeSpec, EpisodeSetup), RunError> {
        let mut opened = self.open_episode(id)?;
        if let Some(origin) = origin {
            origin.start.apply(&mut opened.scene);
        }
        let limits = self.reported_limits(task, id.episode, &opened.scene)?;
        let id = EpisodeId { suite: self.name.clone(), ..id.clone() };
        let (policy, scene) = (&self.config.policy.name, opened.scene.clone());
        let task_prompt = task.prompt_varies.then(|| task.prompt.clone());
        let task = &Task { prompt: opened.prompt.clone(), ..task.clone() };
        let mut spec = EpisodeSpec::new(id, policy, task, &opened.nominal, scene, &self.settings);
        spec.secret.clone_from(&self.config.secret);
        spec.predicates.clone_from(&opened.predicates);
        spec.metrics.clone_from(&opened.metrics);
        spec.header.task_prompt = task_prompt;
        spec.header.privileged = self.is_privileged();
        spec.header.replayed = self.replay_source.is_some();
        spec.header.variation = opened.variation.clone().map(Box::new);
        spec.header.origin = origin.cloned().map(Box::new);
        let record_trace = self.records_trace;
        let trace_nodes = self.config.trace == Some(TraceDetail::Nodes);
        Ok((EpisodeSpec { limits: limits.by_object, record_trace, trace_nodes, ..spec }, opened))
    }

    /// Converts the error of an episode, with its place in the script.
    pub fn episode_error(&self, error: &EpisodeError) -> RunError {
        let cause = match error {
            // An error after the interrupt may be its consequence.
            _ if cancel::requested() => RunErrorCause::Interrupt,
            EpisodeError::Control { source, .. } if source.is_server_fault() => RunErrorCause::Policy,
            _ => RunErrorCause::Input,
        };
        match (RunError::new(cause, error), error, error.place()) {
            // The message of this one begins with file and line.
            (of_episode, EpisodeError::Build(SceneBuildError::At { .. }), _) => of_episode,
            (of_episode, _, Some(place)) => of_episode.at(place),
            (of_episode, _, None) => of_episode.at(self.config.file.display()),
        }
    }

    /// Connects to the policy server, renders once what the policy observes at the start of the first episode of each
    /// task, and reads the deformation limits of all objects.
    ///
    /// # Errors
    /// A layout, calibration file, camera, light or tactile sensor that is not valid; a server that cannot be reached.
    pub fn prepare(self) -> Result<PreparedRun<'a>, RunError> {
        self.config.observer.work(&format!("checking the scenes of {}", self.name));
        let force_observed = self.check_first_episodes()?;
        let calibrations = self.scan_limits()?;
        self.config.observer.end();
        Ok(self.prepared(calibrations, force_observed))
    }

    /// As [`Self::prepare`], with the limits of another run of the same suite, whose layouts are the same.
    pub(crate) fn prepare_like(self, other: &PreparedRun) -> Result<PreparedRun<'a>, RunError> {
        let run = Self { calibration_files: other.calibration_files.clone(), ..self };
        let force_observed = run.check_first_episodes()?;
        Ok(run.prepared(other.calibrations.clone(), force_observed))
    }

    /// Tells which objects have no limit, for episodes that are not recorded. Scenes are checked when they are opened.
    #[cfg(feature = "serve")]
    pub(crate) fn prepare_unrecorded(self) -> Result<PreparedRun<'a>, RunError> {
        for task in self.jobs.tasks() {
            let opened = self.open_episode(&self.episode_id(task, 0))?;
            self.reported_limits(task, 0, &opened.scene)?;
        }
        let force_observed = self.observes_recorded_force();
        Ok(self.prepared(Calibrations::default(), force_observed))
    }

    fn prepared(self, calibrations: Calibrations, force_observed: bool) -> PreparedRun<'a> {
        let mut sources = self.loaded.file_hashes();
        sources.extend(self.config.policy.sources.clone());
        sources.extend(calibrations.sources.clone());
        PreparedRun { run: self, calibrations, sources, force_observed }
    }

    /// True if the policy whose actions are repeated observed the true forces on the pads.
    fn observes_recorded_force(&self) -> bool {
        self.replay_source.as_ref().is_some_and(|source| source.force_observed)
    }

    /// Checks the first episode of each task. Returns true if the policy observes the true forces on the pads.
    fn check_first_episodes(&self) -> Result<bool, RunError> {
        let mut has_changed = false;
        let mut warnings = BTreeSet::new();
        let mut force_observed = self.observes_recorded_force();
        for task in self.jobs.tasks() {
            let first = self.jobs.episodes_of(task.id).next().unwrap_or(0);
            let opened = self.open_episode(&self.episode_id(task, first))?;
            has_changed |= opened.is_shifted();
            if self.suite.vary.is_some() || !self.config.shifts.is_empty() {
                warnings.extend(self.ineffective_friction(&opened));
            }
            let scene = Arc::new(opened.scene.clone());
            self.check_declared(task, &opened.nominal, &scene.cameras)?;
            if let Some(connections) = &self.connections {
                connections.check().map_err(policy_failure)?;
            }
            let brief = EpisodeBrief { prompt: opened.prompt.clone(), ..self.brief(task, first) };
            let controller = (self.controllers)(opened, brief)?;
            // A client of `softvt serve` has no controller here.
            let declared = self.config.policy.declared.as_ref();
            let streams = declared.map_or_else(|| controller.streams(), |declared| declared.streams.clone());
            force_observed |= streams.force;
            self.check_streams(scene, streams, task, first).map_err(|error| self.episode_error(&error))?;
        }
        if !has_changed {
            self.refuse_shifts_without_effect()?;
        }
        // One warning suffices: the others repeat it for other objects.
        if let Some(warning) = warnings.first() {
            self.config.notice(format_args!("warning: {warning}"));
        }
        Ok(force_observed)
    }

    /// Warnings about friction that the episode sets without effect.
    pub(crate) fn ineffective_friction(&self, opened: &EpisodeSetup) -> Vec<String> {
        let variation = self.suite.vary.as_ref().zip(opened.variation.as_ref());
        ineffective_friction(&opened.scene, &opened.nominal, variation, self.settings.robot.pads.static_mu)
    }

    /// Refuses shifts that change neither the scene nor the prompt of any task, unless their values
    /// are the nominal ones.
    pub(crate) fn refuse_shifts_without_effect(&self) -> Result<(), RunError> {
        let is_nominal = |shift: &ShiftValue| {
            let declared = self.suite.shifts.iter().find(|declared| declared.name == shift.name);
            declared.is_some_and(|declared| declared.default == shift.value)
        };
        match self.config.shifts.iter().find(|shift| !is_nominal(shift)) {
            None => Ok(()),
            Some(ShiftValue { name, value }) => Err(self.config.error_of(
                "shifts",
                format!("{name}={value}"),
                format!("changes nothing in suite {}; leave it out", self.suite.name),
            )),
        }
    }

    /// Checks the scene of an episode as far as it can be checked before anything moves. It settles only if
    /// the goal may hold at the start. Returns warnings about its cost and its goal.
    ///
    /// # Errors
    /// A scene or sensor that is not valid.
    pub fn check_scene(
        &self,
        task: &Task,
        episode: u32,
        scene: Scene,
        predicates: Vec<Arc<dyn StatePredicate>>,
    ) -> Result<Vec<String>, RunError> {
        self.check_declared(task, &scene, &scene.cameras)?;
        let scene = Arc::new(scene);
        let settings = &self.settings;
        let sense = |source| EpisodeError::Sense { task: task.id, episode, source };
        let check = || -> Result<Vec<String>, EpisodeError> {
            check_sensors(&scene, &settings.tactile, &self.assets).map_err(sense)?;
            let sim = Simulation::new(scene.clone(), settings, &self.assets)?;
            sim.check_support()?;
            let goal = check_goal(task, &sim, &self.assets, &predicates)?;
            if goal.may_hold {
                // The settled scene decides, with masses and contacts that are not approximate.
                let id = self.episode_id(task, episode);
                let spec = EpisodeSpec::new(id, "noop", task, &scene, Scene::clone(&scene), settings);
                let spec = EpisodeSpec { predicates: predicates.clone(), ..spec };
                Episode::start(spec, &self.assets.exact())?;
            }
            let mut sensors = Sensors::new(&sim, &settings.tactile, &self.assets);
            sensors.check_camera_positions(&Sensors::frame(&sim)).map_err(sense)?;
            let held_step = goal.held_step.map(|step| {
                format!(
                    "the first step of its sequence, {step}, holds at the start, so that it asks for nothing; leave it out, or \
                     change the layout"
                )
            });
            Ok(cost_warning(&sim.world).into_iter().chain(held_step).collect())
        };
        check().map_err(|error| self.episode_error(&error))
    }

    /// Lets a scene settle. Returns warnings about objects that tilt.
    pub fn settle_scene(
        &self,
        EpisodeJob { task, episode }: EpisodeJob,
        scene: &Scene,
    ) -> Result<Vec<String>, RunError> {
        let settle = || -> Result<Simulation, EpisodeError> {
            let mut sim = Simulation::new(Arc::new(scene.clone()), &self.settings, &self.assets)?;
            let layout = task.layout.clone();
            sim.settle().map_err(|source| EpisodeError::Settle { layout, episode, source })?;
            Ok(sim)
        };
        let sim = settle().map_err(|error| self.episode_error(&error))?;
        let free = sim.objects.iter().filter(|object| object.body.is_free());
        let tilts = free.map(|object| (&object.name, sim.tilt(object).to_degrees()));
        let warning = |(name, tilt): (&String, f64)| {
            let verb = if tilt > FALLEN_DEG { "falls over" } else { "tilts" };
            format!(
                "object {name}: it {verb} by {tilt:.0}° while it settles; if that is not meant, place it as it lies then"
            )
        };
        Ok(tilts.filter(|(_, tilt)| *tilt > MAX_TILT_DEG).map(warning).collect())
    }

    /// Checks that a scene has the cameras that the file of the policy declares and, in a suite of rigid objects, whose
    /// tables have no deformation, no soft target.
    fn check_declared(&self, task: &Task, scene: &Scene, cameras: &[Camera]) -> Result<(), RunError> {
        let names = task.targets();
        let is_soft_target = |object: &&Object| {
            matches!(object.asset.body, Body::Soft(_)) && names.contains(&object.name.as_str())
        };
        let is_rigid = self.suite.object_type == ObjectType::Rigid && !self.config.rigid_twin;
        if let Some(target) = scene.objects.iter().find(is_soft_target).filter(|_| is_rigid) {
            return Err(RunError::input(format_args!(
                "{}: the target of task {}, {}, is soft, but suite {} has object_type = \"rigid\"; set \
                 \"deformable\"",
                target.placed_at, task.id, target.name, self.suite.name
            )));
        }
        let Some(DeclaredStreams { place, streams }) = &self.config.policy.declared else { return Ok(()) };
        let known = || cameras.iter().map(|camera| camera.name.as_str());
        match streams.cameras.iter().find(|name| !known().any(|camera| camera == *name)) {
            None => Ok(()),
            Some(name) => {
                let unknown = unknown_name("camera", name, known());
                Err(RunError::input(format_args!("{place}: {unknown} (scene of task {})", task.id)))
            }
        }
    }

    /// Renders each stream of the policy and of videos once, in the initial scene.
    fn check_streams(
        &self,
        scene: Arc<Scene>,
        mut streams: SensorStreams,
        task: &Task,
        episode: u32,
    ) -> Result<(), EpisodeError> {
        let settings = &self.settings;
        let sense = |source| EpisodeError::Sense { task: task.id, episode, source };
        check_sensors(&scene, &settings.tactile, &self.assets).map_err(sense)?;
        if self.renders_episodes {
            streams.tactile = true;
            streams.cameras.extend(scene.cameras.iter().map(|camera| camera.name.clone()));
        }
        if streams.cameras.is_empty() && !streams.tactile {
            return Ok(());
        }
        let sim = Simulation::new(scene, settings, &self.assets)?;
        let mut sensors = Sensors::new(&sim, &settings.tactile, &self.assets);
        sensors.compute_once(&Sensors::frame(&sim), &streams).map_err(sense)
    }
}

/// Returns the recorded run whose actions `--policy` repeats, if it names one.
pub(crate) fn find_replay_source(
    config: &RunConfig,
    suite: &Suite,
    jobs: &EpisodeList,
    split: EpisodeSplit,
) -> Result<Option<ReplaySource>, RunError> {
    let source = |recorded: &RecordedRuns| {
        recorded.replay_source(&suite.name, config.rigid_twin, config.base_seed(), split, jobs)
    };
    config.policy.recorded().map(source).transpose()
}

pub(crate) fn policy_failure(error: PolicyError) -> RunError {
    match error {
        PolicyError::Interrupted => RunError::input(error),
        PolicyError::Address { url, problem } => {
            RunError::of_setting("policy", url, format!("{problem}; expected ws://HOST:PORT"))
        }
        other => RunError::new(RunErrorCause::Policy, other),
    }
}
