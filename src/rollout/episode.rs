//! One episode: settle, then observe, act, step and judge until it ends.

use std::{collections::BTreeMap, sync::Arc};

use image::RgbImage;

use super::{
    action_check::{check_action, far_command},
    asset_cache::AssetCache,
    controller::Controller,
    disturbance::Disturbance,
    episode_error::EpisodeError,
    evidence::EvidenceCollector,
    goal_in_scene::{GoalInScene, StatePredicate},
    metric::{MeasuredMetric, MetricValues},
    observation_history::ObservationHistory,
    robot_instance::ArmCommand,
    sensor_noise::SensorSeed,
    sensors::{SensingError, Sensors, StateDeformation, StateRecording, check_sensors},
    simulation::{Simulation, placed_at, state_hash},
    trace::StepTrace,
};
use softvt_common::cancel;

use softvt_benchmark::{
    Task,
    seed::{EpisodeSeed, SecretSeed},
    settings::Settings,
    steps_per_control,
};
use softvt_common::episode_id::EpisodeId;
use softvt_evaluation::{
    deformation::ReferenceShape,
    judge::{ControlStepScore, Judge, JudgeConfig},
    safety::DeformationLimit,
    stage::TaskStage,
    verdict::{InvalidReason, Outcome, Verdict},
};
use softvt_geometry::Pose;
use softvt_physics::{
    BodyId,
    world::{StepFailure, WorldSnapshot},
};
use softvt_policy::{Action, Observation, PolicyError, RobotState, SensorStreams};
use softvt_robot::{Side, ik::ArmAngles, rotation};
use softvt_runs::{
    actions,
    record::{EpisodeHeader, EpisodeRecord, RolloutStats},
};
use softvt_scene::{Asset, Body, Camera, Scene};
use softvt_sensing::{camera::RenderScene, tactile::TactileReading};

/// Specification of an episode: task, scene and parameters. The controller
/// is passed to [`Episode::run`](super::Episode::run).
#[derive(Clone, Debug)]
pub struct EpisodeSpec {
    pub header: EpisodeHeader,
    pub task: Task,
    /// The scene, before settling.
    pub scene: Arc<Scene>,
    /// Deformation limits of the soft objects by name in the scene; an object without one was never calibrated.
    pub limits: BTreeMap<String, DeformationLimit>,
    pub settings: Settings,
    /// True to keep all states, from which images can be rendered after the episode.
    pub record_states: bool,
    pub record_trace: bool,
    /// True if traces hold the node positions of soft bodies.
    pub trace_nodes: bool,
    /// Functions of the script that the goal asks for
    /// ([`Goal::Predicate`](softvt_benchmark::Goal::Predicate)), in the order of the goal.
    pub predicates: Vec<Arc<dyn StatePredicate>>,
    pub metrics: Vec<MeasuredMetric>,
    pub secret: Option<SecretSeed>,
}

impl EpisodeSpec {
    /// An episode of `task` in `scene`, without a limit, recording or trace. `nominal` is the scene before any shift;
    /// the header names the asset that is the target there.
    pub fn new(
        id: EpisodeId,
        policy: &str,
        task: &Task,
        nominal: &Scene,
        scene: Scene,
        settings: &Settings,
    ) -> Self {
        let target = target_asset(nominal, task);
        let header = EpisodeHeader {
            id,
            prompt: task.prompt.clone(),
            task_prompt: None,
            layout: task.layout.clone(),
            policy: policy.to_owned(),
            privileged: false,
            replayed: false,
            soft: target.is_some_and(|asset| matches!(asset.body, Body::Soft(_))),
            asset: target.map_or(String::new(), |asset| asset.name.clone()),
            variation: None,
            origin: None,
        };
        Self {
            header,
            task: task.clone(),
            scene: Arc::new(scene),
            limits: BTreeMap::new(),
            settings: settings.clone(),
            record_states: false,
            record_trace: false,
            trace_nodes: false,
            predicates: Vec::new(),
            metrics: Vec::new(),
            secret: None,
        }
    }

    fn sense_error(&self, source: SensingError) -> EpisodeError {
        EpisodeError::Sense { task: self.task.id, episode: self.header.id.episode, source }
    }
}

/// Asset of a task's target in a scene.
pub fn target_asset<'a>(scene: &'a Scene, task: &Task) -> Option<&'a Arc<Asset>> {
    let name = &task.object;
    scene.objects.iter().find(|object| object.name == *name).map(|object| &object.asset)
}

#[derive(Debug)]
pub struct FinishedEpisode {
    pub record: EpisodeRecord,
    /// One entry per control step, if requested.
    pub trace: Vec<StepTrace>,
    /// One entry per control step: the input of other scoring rules.
    pub scores: Vec<ControlStepScore>,
    pub actions: Vec<Action>,
    /// Joint positions that each action means, rad: those that it commands, or those of inverse kinematics when the
    /// robot responds to it, without a disturbance. Those of actions to which it no longer responds repeat the last.
    pub joint_commands: Vec<ArmAngles>,
    /// Settled shape of a soft target.
    pub reference: Option<ReferenceShape>,
    /// States of the episode, if requested.
    pub recording: Option<StateRecording>,
    /// The text of [`Controller::unended`], if the budget has ended the episode. Not a part of the record.
    pub unended: Option<String>,
}

/// An episode in progress.
///
/// [`run`](Self::run) executes it with a [`Controller`]. A caller that drives it itself calls [`begin`](Self::begin)
/// once, then [`observe`](Self::observe) and [`step`](Self::step) at 20 Hz until [`outcome`](Self::outcome) is
/// present. A clone continues independently and gives byte-identical results.
#[derive(Clone)]
pub struct Episode {
    spec: EpisodeSpec,
    outcome: Option<Outcome>,
    pub sim: Simulation,
    evidence: EvidenceCollector,
    judge: Judge,
    target: usize,
    start_hold: Action,
    physics_steps: u64,
    newton_steps: u64,
    /// Counts and extremes so far.
    stats: RolloutStats,
    /// In the order of the metrics.
    metric_values: Vec<MetricValues>,
    metric_error: Option<String>,
    trace: Vec<StepTrace>,
    actions: Vec<Action>,
    /// Joint positions that the actions mean, rad; fewer than actions if the robot responds late.
    joint_commands: Vec<ArmAngles>,
    disturbance: Disturbance,
    sensors: Sensors,
    history: ObservationHistory,
    recorded: Option<Vec<RecordedState>>,
    streams: SensorStreams,
}

/// A state that is kept for the recording.
#[derive(Clone)]
struct RecordedState {
    frame: WorldSnapshot,
    robot: RobotState,
    stage: Option<TaskStage>,
}

impl Episode {
    /// Builds the scene and lets it settle. The settled state is the reference of deformation.
    ///
    /// # Errors
    /// The sensors or objects of the scene are invalid, it does not come to rest, or the goal names an unknown object.
    pub fn start(spec: EpisodeSpec, cache: &AssetCache) -> Result<Self, EpisodeError> {
        check_sensors(&spec.scene, &spec.settings.tactile, cache)
            .map_err(|source| spec.sense_error(source))?;
        let mut sim = Simulation::new(spec.scene.clone(), &spec.settings, cache)?;
        let goal = GoalInScene::find(&spec.task, &sim, cache, &spec.predicates)?;
        let target = goal.targets[0];
        sim.settle().map_err(|source| EpisodeError::Settle {
            layout: spec.task.layout.clone(),
            episode: spec.header.id.episode,
            source,
        })?;
        let evidence = EvidenceCollector::new(&sim, goal, &spec.settings.criteria);
        let judge = settled_judge(&spec, &sim, &evidence);
        let mut settled = evidence.clone();
        let settled = settled.collect(&sim, 0.0, true).map_err(|message| EpisodeError::Control {
            task: spec.task.id,
            episode: spec.header.id.episode,
            source: PolicyError::Script(message),
        })?;
        if judge.holds_at_start(&settled) {
            return Err(EpisodeError::GoalHolds {
                task: spec.task.id,
                episode: spec.header.id.episode,
                goal: spec.task.goal.clone(),
                placed_at: placed_at(&spec.scene, &spec.task.object),
            });
        }
        let tool = sim.robot.tool_b(&sim.world);
        let start_hold = Action::new(tool.translation.vector, rotation::axis_angle(&tool.rotation), 0.0);
        let seed = EpisodeSeed::new(&spec.header.id, &spec.task.layout).with_secret(spec.secret.as_ref());
        let disturbance = Disturbance::new(&spec.settings.robot.disturbance, &seed);
        let sensors = Sensors::new(&sim, &spec.settings.tactile, cache).with_seed(SensorSeed::new(&seed));
        let recorded = spec.record_states.then(Vec::new);
        let metric_values = vec![MetricValues::default(); spec.metrics.len()];
        Ok(Self {
            spec,
            sim,
            evidence,
            judge,
            target,
            start_hold,
            physics_steps: 0,
            newton_steps: 0,
            stats: RolloutStats::default(),
            metric_values,
            metric_error: None,
            trace: Vec::new(),
            actions: Vec::new(),
            joint_commands: Vec::new(),
            disturbance,
            sensors,
            history: ObservationHistory::default(),
            recorded,
            streams: SensorStreams::default(),
            outcome: None,
        })
    }

    /// Runs the episode with a controller until the goal is reached, the step budget is exhausted, or
    /// the state is invalid.
    ///
    /// # Errors
    /// The controller fails with an error that is not confined to the episode, a sensor stream cannot be computed, or
    /// the process is [cancelled](softvt_common::cancel).
    pub fn run(self, controller: &mut dyn Controller) -> Result<FinishedEpisode, EpisodeError> {
        self.run_watched(controller, &mut |_| Ok(()))
    }

    /// As [`run`](Self::run), and calls `watch` in the settled state and after each control step. `watch` must not
    /// change the state; [`PolicyError::Interrupted`] ends the run.
    pub fn run_watched(
        mut self,
        controller: &mut dyn Controller,
        watch: &mut dyn FnMut(&mut Self) -> Result<(), PolicyError>,
    ) -> Result<FinishedEpisode, EpisodeError> {
        let mut action = self.start_hold;
        let streams = controller.streams();
        self.begin(streams.clone());
        watch(&mut self).map_err(|source| self.control_error(source))?;
        while self.outcome.is_none() {
            let requested = if controller.wants_observation() { &streams } else { &SensorStreams::default() };
            let observation = self.observe(requested)?;
            if cancel::requested() {
                return Err(self.control_error(PolicyError::Interrupted));
            }
            match controller.act(&self.sim, &observation) {
                Ok(Some(next)) => action = next,
                Ok(None) => {}
                Err(PolicyError::Action(message)) => {
                    self.outcome = Some(Outcome::Error { message });
                    break;
                }
                Err(source) => return Err(self.control_error(source)),
            }
            self.step(&action);
            if let Some(message) = self.take_metric_error() {
                return Err(self.control_error(PolicyError::Script(message)));
            }
            watch(&mut self).map_err(|source| self.control_error(source))?;
        }
        // A controller that has given up commands nothing more; its last command stays.
        let is_far = matches!(self.outcome, Some(Outcome::Error { .. }))
            && self.stats.far_commands == self.stats.steps;
        if is_far && controller.gave_up().is_some() {
            self.outcome = Some(Outcome::Budget);
        }
        controller.finish().map_err(|source| self.control_error(source))?;
        let mut finished = self.finish(controller.gave_up().map(str::to_owned));
        finished.record.stats.notes = controller.notes();
        if finished.record.outcome == Outcome::Budget {
            finished.unended = controller.unended();
        }
        Ok(finished)
    }

    /// Starts the episode. `streams` are those that any later observation may request; their history is kept.
    pub fn begin(&mut self, streams: SensorStreams) {
        self.streams = streams;
        self.record_state();
        self.outcome = self.regular_outcome();
    }

    /// Executes one control step. Returns the outcome once the episode has ended; further steps then have no effect.
    pub fn step(&mut self, action: &Action) -> Option<&Outcome> {
        if self.outcome.is_none() {
            self.outcome = self.advance(action);
        }
        self.outcome.as_ref()
    }

    pub fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }

    fn advance(&mut self, action: &Action) -> Option<Outcome> {
        if let Err(message) = check_action(action, self.spec.settings.robot.gripper.effort) {
            return Some(Outcome::Error { message });
        }
        self.actions.push(*action);
        if let Some(far) = far_command(&self.sim.robot.tool_b(&self.sim.world), action) {
            self.stats.far_commands += 1;
            self.stats.first_far_command.get_or_insert(far);
        }
        self.stats.clamped_grips += u32::from((action.closure() - 0.5).abs() > 0.5 + CLOSURE_ROUNDING);
        self.stats.clamped_steps += u32::from(action.is_clamped);
        if let Err(outcome) = self.control_step(action) {
            return Some(outcome);
        }
        self.record_state();
        self.regular_outcome()
    }

    /// The outcome of a valid state, if it ends the episode.
    fn regular_outcome(&self) -> Option<Outcome> {
        if self.judge.is_goal_reached() {
            return Some(Outcome::Completed);
        }
        let stats = &self.stats;
        if stats.steps < self.spec.task.budget_steps {
            return None;
        }
        match stats.first_far_command.filter(|_| stats.far_commands == stats.steps) {
            Some(first) => {
                let expected = match self.actions.last().is_some_and(|action| action.joints.is_some()) {
                    true => {
                        "joint positions in rad, within the limits of the joints and near the present ones"
                    }
                    false => "positions in m and axis-angles in rad, in the robot's base frame",
                };
                let steps = stats.steps;
                let message =
                    format!("all {steps} commands were out of reach, first: {first}; expected {expected}");
                Some(Outcome::Error { message })
            }
            None => Some(Outcome::Budget),
        }
    }

    fn control_error(&self, source: PolicyError) -> EpisodeError {
        EpisodeError::Control { task: self.spec.task.id, episode: self.spec.header.id.episode, source }
    }

    /// The current observation with the requested streams.
    pub fn observe(&mut self, streams: &SensorStreams) -> Result<Observation, EpisodeError> {
        let proprioceptive = Observation {
            time_s: self.time(),
            robot: self.sim.robot.state(&self.sim.world, self.sensors.seed()),
            prompt: self.spec.task.prompt.clone(),
            ..Observation::default()
        };
        let observation = self.history.observe(&mut self.sensors, proprioceptive, streams);
        observation.map_err(|source| self.spec.sense_error(source))
    }

    /// Renders the current image of a camera, in its own or another size (pixels). It is not part of an observation
    /// and does not change the record.
    ///
    /// # Errors
    /// The scene has no camera of that name, or the size is invalid.
    pub fn render_camera(
        &mut self,
        camera: &str,
        width: Option<usize>,
        height: Option<usize>,
    ) -> Result<RgbImage, SensingError> {
        let own = self.sensors.camera(camera)?.clone();
        let camera =
            Camera { width: width.unwrap_or(own.width), height: height.unwrap_or(own.height), ..own.clone() };
        let frame = Sensors::frame(&self.sim);
        let image = if camera == own {
            self.sensors.render_rgb(&frame, &camera)?
        } else {
            self.sensors.render_once(&frame, &camera)?
        };
        Ok(image.into_rgb_image())
    }

    pub fn render_scene(&mut self) -> Result<&RenderScene, SensingError> {
        self.sensors.render_scene()
    }

    pub fn spec(&self) -> &EpisodeSpec {
        &self.spec
    }

    /// The target in `sim.objects`.
    pub fn target(&self) -> usize {
        self.target
    }

    /// The objects that the task moves, in the order of the verdict's targets.
    pub fn targets(&self) -> &[usize] {
        &self.evidence.goal().targets
    }

    /// The last action; `None` before the first.
    pub fn last_action(&self) -> Option<&Action> {
        self.actions.last()
    }

    /// Current poses of the scene's cameras, base frame, in their order.
    pub fn cameras_b(&self) -> Vec<Pose> {
        let b_from_w = self.sim.robot.base_w.inverse();
        let cameras_w = self.sensors.cameras_w(&Sensors::frame(&self.sim));
        cameras_w.into_iter().map(|camera_w| b_from_w * camera_w).collect()
    }

    /// Renders the current tactile image of a finger. It does not change the record.
    pub fn render_tactile(&mut self, side: Side) -> Result<RgbImage, SensingError> {
        Ok(self.tactile_reading(side)?.image)
    }

    /// The present reading of a tactile sensor. It does not change the record.
    pub fn tactile_reading(&mut self, side: Side) -> Result<TactileReading, SensingError> {
        self.sensors.tactile_reading(&Sensors::frame(&self.sim), side)
    }

    /// Keeps the state for later observations and for the recording.
    fn record_state(&mut self) {
        if self.streams == SensorStreams::default() && self.recorded.is_none() {
            return;
        }
        let frame = Sensors::frame(&self.sim);
        let robot = self.sim.robot.state(&self.sim.world, self.sensors.seed());
        if let Some(recorded) = &mut self.recorded {
            recorded.push(RecordedState { frame: frame.clone(), robot, stage: self.judge.stage() });
        }
        self.history.push(frame, robot, self.streams.past_steps);
    }

    fn time(&self) -> f64 {
        self.physics_steps as f64 * self.spec.settings.physics.dt
    }

    fn control_step(&mut self, action: &Action) -> Result<(), Outcome> {
        let (pose_b, joints) = (action.pose_b(), action.joints);
        let arm = ArmCommand { pose_b, executed_b: self.disturbance.apply(&pose_b), joints };
        self.joint_commands.extend(self.sim.robot.command(&mut self.sim.world, arm, action.grip));
        self.stats.steps += 1;
        let physics_steps = steps_per_control(self.spec.settings.physics.dt);
        for step in 1..=physics_steps {
            self.physics_steps += 1;
            self.sim.step().map_err(|failure| self.invalid(&failure))?;
            let (solver, stats) = (self.sim.world.solver_stats(), &mut self.stats);
            self.newton_steps += u64::from(solver.newton_steps);
            stats.newton_max = stats.newton_max.max(solver.max_newton_steps);
            if let BodyId::Soft(index) = self.sim.objects[self.target].body {
                let det_f = self.sim.world.soft(index).state.min_det_f().det_f;
                stats.min_det_f = Some(stats.min_det_f.unwrap_or(f64::INFINITY).min(det_f));
            }
            let time = self.time();
            let evidence = self.evidence.collect(&self.sim, time, step == physics_steps);
            self.judge.observe(&evidence.map_err(|message| Outcome::Error { message })?);
        }
        if self.spec.record_trace || !self.spec.metrics.is_empty() {
            let trace = self.trace();
            for (metric, values) in self.spec.metrics.iter().zip(&mut self.metric_values) {
                match metric.function.value(&self.sim, &trace) {
                    Ok(value) => value.into_iter().for_each(|value| values.add(value)),
                    Err(message) => {
                        self.metric_error.get_or_insert(message);
                    }
                }
            }
            if self.spec.record_trace {
                self.trace.push(trace);
            }
        }
        Ok(())
    }

    fn invalid(&self, failure: &StepFailure) -> Outcome {
        let (reason, node) = match failure {
            StepFailure::Diverged { .. } => (InvalidReason::NotConverged, None),
            StepFailure::NotFinite { node, .. } => (InvalidReason::NotFinite, Some(*node as u32)),
            StepFailure::Indefinite { .. } => (InvalidReason::Indefinite, None),
            StepFailure::SpeedLimitExceeded { node, .. } => {
                (InvalidReason::TooFast, node.map(|node| node as u32))
            }
            StepFailure::ForceLimitExceeded { .. } => (InvalidReason::TooHard, None),
            StepFailure::Inverted { body, element, .. } => {
                let soft = self.sim.world.soft_bodies().iter().find(|s| s.name == *body);
                (InvalidReason::Inverted, soft.map(|s| s.state.model.mesh.elements[*element][0]))
            }
        };
        Outcome::Invalid { reason, step: self.physics_steps, node }
    }

    /// The verdict so far. An episode that has not ended is judged as if its budget were spent.
    pub fn verdict(&self) -> Verdict {
        self.judge.finish(self.outcome.as_ref().unwrap_or(&Outcome::Budget))
    }

    /// The current state as an entry of a trace.
    pub fn trace(&self) -> StepTrace {
        let dropped = self.judge.first_drop().is_some();
        StepTrace::new(
            &self.sim,
            &self.evidence,
            self.target,
            self.stats.steps,
            self.time(),
            dropped,
            self.spec.trace_nodes,
        )
    }

    /// Counts of commands so far.
    pub fn stats(&self) -> &RolloutStats {
        &self.stats
    }

    /// The first error of a metric's function since the last call; the metric has no value of that step.
    pub fn take_metric_error(&mut self) -> Option<String> {
        self.metric_error.take()
    }

    /// The metrics so far, by name; `None` for those without a value.
    pub fn metrics(&self) -> BTreeMap<String, Option<f64>> {
        let pairs = self.spec.metrics.iter().zip(&self.metric_values);
        pairs.map(|(of, values)| (of.metric.name.clone(), values.reduced(of.metric.over))).collect()
    }

    /// The record so far. `gave_up` is the reason why the controller aborted, if it did.
    pub fn record(&self, gave_up: Option<String>) -> EpisodeRecord {
        let stats = RolloutStats {
            time_s: self.time(),
            min_det_f: self.stats.min_det_f.filter(|det_f| det_f.is_finite()),
            newton_mean: self.newton_steps as f64 / self.physics_steps.max(1) as f64,
            force_observed: self.streams.force,
            camera_inside: self.history.camera_inside,
            gave_up,
            metrics: self.metrics(),
            actions_sha256: actions::sha256(&self.actions),
            state_hash: state_hash(&self.sim),
            ..self.stats.clone()
        };
        let outcome = self.outcome.clone().unwrap_or(Outcome::Budget);
        EpisodeRecord { header: self.spec.header.clone(), outcome, verdict: self.verdict(), stats }
    }

    /// Ends the episode: its record with what belongs to it. `gave_up` is as for [`record`](Self::record).
    pub fn finish(self, gave_up: Option<String>) -> FinishedEpisode {
        let record = self.record(gave_up);
        let reference = self.evidence.reference(self.target).cloned();
        let scores = self.judge.scores().to_vec();
        let recording = self.recorded.map(|states| {
            let robot = states.iter().map(|state| state.robot).collect();
            let stages = states.iter().map(|state| state.stage).collect();
            let frames = states.into_iter().map(|state| state.frame).collect();
            let targets = &record.verdict.targets;
            let settled = targets.iter().map(|target| (target.soft.then_some(0.0), target.tau));
            let in_step = |score: &ControlStepScore| {
                let d_pct = score.targets.iter().map(|worst| worst.deformation.map(|d| d.rms_pct));
                StateDeformation::worst(d_pct.zip(targets.iter().map(|target| target.tau)))
            };
            let settled = StateDeformation::worst(settled);
            let deformation = std::iter::once(settled).chain(scores.iter().map(in_step)).collect();
            let (sensors, target) = (self.sensors, self.target);
            StateRecording { sensors, frames, robot, target, deformation, stages }
        });
        let (actions, mut joint_commands) = (self.actions, self.joint_commands);
        let last = joint_commands.last().copied().unwrap_or_else(|| self.sim.robot.q(&self.sim.world));
        joint_commands.resize(actions.len(), last);
        FinishedEpisode {
            record,
            trace: self.trace,
            scores,
            actions,
            joint_commands,
            reference,
            recording,
            unended: None,
        }
    }
}

const CLOSURE_ROUNDING: f64 = 1e-6;

/// The judge of an episode, for its settled state.
fn settled_judge(spec: &EpisodeSpec, sim: &Simulation, evidence: &EvidenceCollector) -> Judge {
    let [targets, others] = evidence.settled(sim, &spec.limits);
    Judge::new(JudgeConfig {
        criteria: spec.settings.criteria.clone(),
        workspace: spec.scene.workspace,
        goal: evidence.goal().goal.clone(),
        predicates: evidence.goal().judged(),
        targets,
        others,
        dt_s: spec.settings.physics.dt,
        steps_per_control: steps_per_control(spec.settings.physics.dt),
        max_steps: spec.task.budget_steps as usize * steps_per_control(spec.settings.physics.dt) as usize,
    })
}
