//! One episode from the settled scene to the verdict.

use image::RgbImage;

use super::{
    asset_cache::AssetCache,
    build::BuildError,
    command::{check_action, is_far},
    controller::{ControlError, Controller},
    evidence::EvidenceCollector,
    judging::judge,
    observation_history::Recent,
    sensor_assets::SensorAssets,
    sensor_check::check_sensors,
    sensors::{SensingError, SensorSuite, StateRecording},
    settle::SettleError,
    simulation::Simulation,
    spec::EpisodeSpec,
    state_hash::state_hash,
    trace::StepTrace,
};
use crate::{
    benchmark::{Goal, control::steps_per_control},
    evaluation::{
        deformation::{Deformation, ReferenceShape},
        judge::Judge,
        record::{EpisodeRecord, Outcome, RolloutStats, Verdict},
    },
    geometry::Pose,
    physics::{
        BodyId,
        world::{Frame, StepFailure},
    },
    policy::{Action, Observation, SensorStreams},
    robot::{Side, rotation},
};

/// A finished episode.
#[derive(Debug)]
pub struct FinishedEpisode {
    /// The record.
    pub record: EpisodeRecord,
    /// One entry a control step, if asked for.
    pub trace: Vec<StepTrace>,
    /// One entry a control step: what another scorer needs.
    pub frames: Vec<ScoreFrame>,
    /// What was commanded in each control step.
    pub actions: Vec<Action>,
    /// Settled shape of a soft target.
    pub reference: Option<ReferenceShape>,
    /// What is needed to draw the rollout, if asked for.
    pub recording: Option<StateRecording>,
}

/// What another scorer needs to know of a control step.
#[derive(Clone, Debug)]
pub struct ScoreFrame {
    /// Whether the goal had been reached: held for long enough.
    pub success_now: bool,
    /// The target's worst deformation over the physics steps of the control step; `None` if it is not known.
    pub deformation: Option<Deformation>,
}

/// The scene cannot be run; the user's to mend.
#[derive(Debug, thiserror::Error)]
pub enum EpisodeError {
    /// An object cannot be made.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The scene does not come to rest.
    #[error("layout {layout}, episode {episode}: {source}")]
    Settle {
        /// Layout name.
        layout: String,
        /// Episode index.
        episode: u32,
        /// What happened.
        source: SettleError,
    },
    /// The goal names an object that is not in the scene.
    #[error("task {task}: goal.{role} names {name:?}, but layout {layout} places {have}")]
    NoObject {
        /// Task index.
        task: usize,
        /// "object" or "target".
        role: &'static str,
        /// The name.
        name: String,
        /// Layout name.
        layout: String,
        /// Names in the scene.
        have: String,
    },
    /// Something cannot be sensed.
    #[error("task {task}, episode {episode}: {source}")]
    Sense {
        /// Task index.
        task: usize,
        /// Episode index.
        episode: u32,
        /// What happened.
        source: SensingError,
    },
    /// Whoever drives failed.
    #[error("task {task}, episode {episode}: {source}")]
    Control {
        /// Task index.
        task: usize,
        /// Episode index.
        episode: u32,
        /// What happened.
        source: ControlError,
    },
}

impl EpisodeSpec {
    fn sense_error(&self, source: SensingError) -> EpisodeError {
        EpisodeError::Sense { task: self.task.id, episode: self.identity.episode, source }
    }
}

impl EpisodeError {
    /// `file:line` of what is wrong, where that is known and the message does not name it itself.
    pub fn place(&self) -> Option<&str> {
        match self {
            Self::Settle { source, .. } => source.place(),
            _ => None,
        }
    }
}

/// An episode in progress. A copy of it goes on as it would itself, to the same bytes.
#[derive(Clone)]
pub struct Episode {
    spec: EpisodeSpec,
    /// How it ended, if it has.
    outcome: Option<Outcome>,
    /// The running scene.
    pub sim: Simulation,
    evidence: EvidenceCollector,
    judge: Judge,
    target: usize,
    start_hold: Action,
    steps: u32,
    physics_steps: u64,
    newton: (u64, u32),
    min_det_f: f64,
    trace: Vec<StepTrace>,
    frames: Vec<ScoreFrame>,
    actions: Vec<Action>,
    sensors: SensorSuite,
    recent: Recent,
    recorded: Option<RecordedStates>,
    /// What is looked at.
    streams: SensorStreams,
    far_commands: u32,
}

/// What a film keeps while it is being taken.
#[derive(Clone, Default)]
struct RecordedStates {
    frames: Vec<Frame>,
    d_pct: Vec<Option<f64>>,
}

impl Episode {
    /// Builds and settles the scene; the settled state is the deformation reference.
    ///
    /// # Errors
    /// The scene cannot be sensed or built or does not come to rest, or the goal names nothing in it.
    pub fn start(
        spec: EpisodeSpec,
        cache: &AssetCache,
        sensor_assets: &SensorAssets,
    ) -> Result<Self, EpisodeError> {
        check_sensors(&spec.scene, &spec.tactile, sensor_assets)
            .map_err(|source| spec.sense_error(source))?;
        let mut sim = Simulation::new(spec.scene.clone(), &spec.params, &spec.robot, cache)?;
        let (object, place, hold_s) = match &spec.task.goal {
            Goal::On { object, target, hold_s } | Goal::In { object, target, hold_s } => {
                (object, target, *hold_s)
            }
        };
        let find = |role, name: &str| {
            sim.objects.iter().position(|o| o.name == name).ok_or_else(|| EpisodeError::NoObject {
                task: spec.task.id,
                role,
                name: name.to_owned(),
                layout: spec.task.layout.clone(),
                have: sim.objects.iter().map(|o| o.name.as_str()).collect::<Vec<_>>().join(", "),
            })
        };
        let (target, place) = (find("object", object)?, find("target", place)?);
        sim.settle().map_err(|source| EpisodeError::Settle {
            layout: spec.task.layout.clone(),
            episode: spec.identity.episode,
            source,
        })?;
        let evidence = EvidenceCollector::new(&sim, target, place);
        let judge = judge(&spec, &sim, &evidence, (target, place), hold_s);
        let tool = sim.robot.tool_b(&sim.world);
        let start_hold = Action {
            position_b: tool.translation.vector,
            axis_angle_b: rotation::axis_angle(&tool.rotation),
            closure: 0.0,
        };
        let sensors = SensorSuite::new(&sim, &spec.tactile, sensor_assets);
        let recorded = spec.record_states.then(RecordedStates::default);
        Ok(Self {
            spec,
            sim,
            evidence,
            judge,
            target,
            start_hold,
            steps: 0,
            physics_steps: 0,
            newton: (0, 0),
            min_det_f: f64::INFINITY,
            trace: Vec::new(),
            frames: Vec::new(),
            actions: Vec::new(),
            sensors,
            recent: Recent::default(),
            recorded,
            streams: SensorStreams::default(),
            far_commands: 0,
            outcome: None,
        })
    }

    /// Runs to the goal, the end of the budget, or an invalid state.
    ///
    /// # Errors
    /// Whoever drives failed.
    pub fn run(mut self, controller: &mut dyn Controller) -> Result<FinishedEpisode, EpisodeError> {
        let mut action = self.start_hold;
        let streams = controller.streams();
        self.begin(streams.clone());
        while self.outcome.is_none() {
            let looked_at = if controller.wants_observation() { &streams } else { &SensorStreams::default() };
            let observation = self.observe(looked_at)?;
            match controller.act(&self.sim, &observation) {
                Ok(Some(wanted)) => action = wanted,
                Ok(None) => {}
                Err(ControlError::Action(message)) => {
                    self.outcome = Some(Outcome::Error { message });
                    break;
                }
                Err(source) => return Err(self.control_error(source)),
            }
            self.step(&action);
        }
        controller.finish();
        Ok(self.finish(controller.gave_up().map(str::to_owned)))
    }

    /// Says once, before the first step, what will be looked at: that much of the past is kept.
    pub fn begin(&mut self, streams: SensorStreams) {
        self.streams = streams;
        self.remember(self.evidence.reference(self.target).map(|_| 0.0));
        self.outcome = self.ending();
    }

    /// Carries out one control step and says how the episode has ended, if it has. One that has ended moves no more.
    pub fn step(&mut self, action: &Action) -> Option<&Outcome> {
        if self.outcome.is_none() {
            self.outcome = self.advance(action);
        }
        self.outcome.as_ref()
    }

    /// How it ended, if it has.
    pub fn outcome(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }

    fn advance(&mut self, action: &Action) -> Option<Outcome> {
        if let Err(message) = check_action(action) {
            return Some(Outcome::Error { message });
        }
        self.actions.push(*action);
        self.far_commands += u32::from(is_far(&self.sim.robot.tool_b(&self.sim.world), action));
        if let Err(failure) = self.control_step(action) {
            return Some(self.invalid(&failure));
        }
        self.remember(self.frames.last().and_then(|frame| frame.deformation.as_ref()).map(|d| d.rms_pct));
        self.ending()
    }

    /// How a state that can be trusted ends the episode, if it does.
    fn ending(&self) -> Option<Outcome> {
        if self.judge.is_goal_reached() {
            return Some(Outcome::Completed);
        }
        (self.steps >= self.spec.task.budget_steps).then_some(Outcome::Timeout)
    }

    fn control_error(&self, source: ControlError) -> EpisodeError {
        EpisodeError::Control { task: self.spec.task.id, episode: self.spec.identity.episode, source }
    }

    /// What a policy sees now, through those `streams` that are watched.
    ///
    /// # Errors
    /// A stream cannot be made.
    pub fn observe(&mut self, streams: &SensorStreams) -> Result<Observation, EpisodeError> {
        let tool = self.sim.robot.tool_b(&self.sim.world);
        let blind = Observation {
            time_s: self.time(),
            ee_position_b: tool.translation.vector,
            ee_axis_angle_b: rotation::axis_angle(&tool.rotation),
            joints: self.sim.robot.q(&self.sim.world),
            gripper_width_m: self.sim.robot.width(&self.sim.world),
            closure: self.sim.robot.closure(),
            prompt: self.spec.task.prompt.clone(),
            cameras: Vec::new(),
            touch: None,
            forces: None,
            force_history: Vec::new(),
        };
        let seen = self.recent.observe(&mut self.sensors, blind, streams);
        seen.map_err(|source| self.spec.sense_error(source))
    }

    /// What a camera of the scene sees now, in its own size or another (width and height, pixels). It is for onlookers: the
    /// record does not count it as a look of the policy's.
    ///
    /// # Errors
    /// There is no such camera, or it has no picture of that size.
    pub fn render_camera(
        &mut self,
        camera: &str,
        width: Option<usize>,
        height: Option<usize>,
    ) -> Result<RgbImage, SensingError> {
        let mut camera = self.sensors.camera(camera)?.clone();
        camera.width = width.unwrap_or(camera.width);
        camera.height = height.unwrap_or(camera.height);
        Ok(self.sensors.render(&SensorSuite::frame(&self.sim), &camera)?.into_rgb_image())
    }

    /// What a finger's sensor sees now, for onlookers too.
    ///
    /// # Errors
    /// As [`SensorSuite::tactile_reading`].
    pub fn render_tactile(&mut self, side: Side) -> Result<RgbImage, SensingError> {
        Ok(self.sensors.tactile_reading(&SensorSuite::frame(&self.sim), side)?.image)
    }

    /// Keeps what may be looked at later: for the sensors and for the film.
    fn remember(&mut self, d_pct: Option<f64>) {
        if self.streams == SensorStreams::default() && self.recorded.is_none() {
            return;
        }
        let frame = SensorSuite::frame(&self.sim);
        if let Some(recorded) = &mut self.recorded {
            recorded.frames.push(frame.clone());
            recorded.d_pct.push(d_pct);
        }
        self.recent.push(frame);
    }

    fn time(&self) -> f64 {
        self.physics_steps as f64 * self.spec.params.dt
    }

    fn control_step(&mut self, action: &Action) -> Result<(), StepFailure> {
        let rotation = rotation::from_axis_angle(&action.axis_angle_b);
        let pose_b = Pose::from_parts(action.position_b.into(), rotation);
        self.sim.robot.command(&mut self.sim.world, &pose_b, action.closure);
        self.steps += 1;
        let mut worst: Option<Deformation> = None;
        for _ in 0..steps_per_control(self.spec.params.dt) {
            self.physics_steps += 1;
            self.sim.step()?;
            let stats = self.sim.world.stats();
            self.newton =
                (self.newton.0 + u64::from(stats.newton_steps), self.newton.1.max(stats.max_newton_steps));
            if let BodyId::Soft(index) = self.sim.objects[self.target].body {
                self.min_det_f = self.min_det_f.min(self.sim.world.soft(index).min_det_f().det_f);
            }
            let time = self.time();
            let evidence = self.evidence.collect(&self.sim, time);
            let now = evidence.target.deformation;
            self.judge.observe(&evidence);
            worst = worst.into_iter().chain(now).max_by(|a, b| a.rms_pct.total_cmp(&b.rms_pct));
        }
        self.frames.push(ScoreFrame { success_now: self.judge.is_goal_reached(), deformation: worst });
        if self.spec.trace.is_some() {
            self.trace.push(self.trace());
        }
        Ok(())
    }

    fn invalid(&self, failure: &StepFailure) -> Outcome {
        let (reason, node) = match failure {
            StepFailure::Diverged { .. } => ("not_converged", None),
            StepFailure::NotFinite { node, .. } => ("not_finite", Some(*node as u32)),
            StepFailure::Indefinite { .. } => ("indefinite", None),
            StepFailure::SpeedLimitExceeded { node, .. } => ("too_fast", node.map(|node| node as u32)),
            StepFailure::ForceLimitExceeded { .. } => ("too_hard", None),
            StepFailure::Inverted { body, element, .. } => {
                let soft = self.sim.world.soft_bodies().iter().find(|s| s.name == *body);
                ("inverted", soft.map(|s| s.state.model.mesh.elements[*element][0]))
            }
        };
        Outcome::Invalid { reason: reason.to_owned(), step: self.physics_steps, node }
    }

    /// What is said of it up to now; one that has not ended is judged as if its time were up.
    pub fn verdict(&self) -> Verdict {
        self.judge.clone().finish(self.outcome.as_ref().unwrap_or(&Outcome::Timeout))
    }

    /// The present state, as a run would write it down.
    pub fn trace(&self) -> StepTrace {
        let at = (self.steps, self.time());
        let dropped = self.judge.first_drop().is_some();
        StepTrace::new(&self.sim, &self.evidence, self.target, at, dropped, self.spec.trace == Some(true))
    }

    /// Its record, as far as it has come.
    pub fn record(&self, gave_up: Option<String>) -> EpisodeRecord {
        let soft = matches!(self.sim.objects[self.target].body, BodyId::Soft(_));
        let stats = RolloutStats {
            steps: self.steps,
            time_s: self.time(),
            min_det_f: (soft && self.min_det_f.is_finite()).then_some(self.min_det_f),
            newton_mean: self.newton.0 as f64 / self.physics_steps.max(1) as f64,
            newton_max: self.newton.1,
            force_observed: self.streams.force,
            camera_inside: self.recent.inside,
            far_commands: self.far_commands,
            gave_up,
            state_hash: state_hash(&self.sim),
        };
        let outcome = self.outcome.clone().unwrap_or(Outcome::Timeout);
        EpisodeRecord { identity: self.spec.identity.clone(), outcome, verdict: self.verdict(), stats }
    }

    fn finish(self, gave_up: Option<String>) -> FinishedEpisode {
        let record = self.record(gave_up);
        let recording = self.recorded.map(|RecordedStates { frames, d_pct }| StateRecording {
            sensors: self.sensors,
            frames,
            d_pct,
        });
        let reference = self.evidence.reference(self.target).cloned();
        FinishedEpisode {
            record,
            trace: self.trace,
            frames: self.frames,
            actions: self.actions,
            reference,
            recording,
        }
    }
}
