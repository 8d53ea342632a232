//! One episode from the settled scene to the verdict.

use sha2::{Digest, Sha256};

use super::{
    build::BuildError,
    evidence::{Witness, lowest},
    looks::Looks,
    recent::Recent,
    rest_cache::RestCache,
    senses::{Film, SenseError, Senses},
    settle::SettleError,
    simulation::{Handle, Kind, Simulation},
    spec::EpisodeSpec,
    streams::check_senses,
    trace::StepTrace,
};
use crate::{
    benchmark::{Goal, control::steps_per_control},
    evaluation::{
        deformation::{Deformation, Reference},
        goal::Place,
        judge::{Judge, Setup},
        record::{EpisodeRecord, Outcome, RolloutStats},
    },
    geometry::{Pose, Vec3},
    physics::world::{Frame, StepFailure},
    policy::{Action, Chunked, Observation, PolicyError, Streams},
    robot::{ik::REACH, rotation},
    scene::Region,
};

/// What went wrong with whoever drives.
#[derive(Debug, thiserror::Error)]
pub enum ControlError {
    /// A script failed: the user's input.
    #[error("{0}")]
    Script(String),
    /// A policy failed: the server or its answers.
    #[error("{0}")]
    Policy(String),
    /// A policy's answer cannot be carried out; this episode has failed and others may go on.
    #[error("{0}")]
    Action(String),
    /// The run was told to stop.
    #[error("interrupted")]
    Interrupted,
}

/// Whoever drives the robot: a policy behind its observation, or a privileged planner.
pub trait Controller {
    /// What it looks at, when it looks; the same for the whole episode.
    fn streams(&self) -> Streams {
        Streams::default()
    }
    /// Whether it looks in this control step; if not, nothing is sensed for it.
    fn looks(&self) -> bool {
        true
    }
    /// Why it has given up, if it has: the last action stays then.
    fn gave_up(&self) -> Option<&str> {
        None
    }
    /// The action of this control step; `None` to keep the last one.
    ///
    /// # Errors
    /// What went wrong.
    fn act(&mut self, sim: &Simulation, observation: &Observation) -> Result<Option<Action>, ControlError>;
    /// The episode is over.
    fn finish(&mut self) {}
}

/// A policy sees the observation and nothing else.
impl Controller for Chunked<'_> {
    fn streams(&self) -> Streams {
        Chunked::streams(self)
    }

    fn looks(&self) -> bool {
        Chunked::looks(self)
    }

    fn act(&mut self, _sim: &Simulation, observation: &Observation) -> Result<Option<Action>, ControlError> {
        Chunked::act(self, observation).map(Some).map_err(ControlError::from)
    }

    fn finish(&mut self) {
        Chunked::finish(self);
    }
}

impl From<PolicyError> for ControlError {
    fn from(error: PolicyError) -> Self {
        match error {
            PolicyError::Transport(message) | PolicyError::Reply(message) => Self::Policy(message),
            PolicyError::Action(message) => Self::Action(message),
            PolicyError::Script(message) | PolicyError::Address(message) => Self::Script(message),
            PolicyError::Interrupted => Self::Interrupted,
        }
    }
}

/// A finished episode.
#[derive(Debug)]
pub struct Finished {
    /// The record.
    pub record: EpisodeRecord,
    /// One entry a control step, if asked for.
    pub trace: Vec<StepTrace>,
    /// One entry a control step: what another scorer needs.
    pub frames: Vec<ScoreFrame>,
    /// What was commanded in each control step.
    pub actions: Vec<Action>,
    /// Settled shape of a soft target.
    pub reference: Option<Reference>,
    /// What is needed to draw the rollout, if asked for.
    pub film: Option<Film>,
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
        source: SenseError,
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

impl EpisodeError {
    /// `file:line` of what is wrong, where that is known and the message does not name it itself.
    pub fn place(&self) -> Option<&str> {
        match self {
            Self::Settle { source, .. } => source.place(),
            _ => None,
        }
    }
}

/// An episode in progress.
pub struct Episode {
    spec: EpisodeSpec,
    /// The running scene.
    pub sim: Simulation,
    witness: Witness,
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
    senses: Senses,
    recent: Recent,
    reel: Option<Reel>,
    force_observed: bool,
    far_commands: u32,
}

/// What a film keeps while it is being taken.
#[derive(Default)]
struct Reel {
    frames: Vec<Frame>,
    d_pct: Vec<Option<f64>>,
}

impl Episode {
    /// Builds and settles the scene; the settled state is the deformation reference.
    ///
    /// # Errors
    /// The scene cannot be sensed or built or does not come to rest, or the goal names nothing in it.
    pub fn start(spec: EpisodeSpec, cache: &RestCache, looks: &Looks) -> Result<Self, EpisodeError> {
        check_senses(&spec.scene, &spec.tactile, looks).map_err(|source| EpisodeError::Sense {
            task: spec.task.id,
            episode: spec.identity.episode,
            source,
        })?;
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
        let witness = Witness::new(&sim, target, place);
        let judge = judge(&spec, &sim, &witness, (target, place), hold_s);
        let tool = sim.rig.tool_b(&sim.world);
        let start_hold = Action {
            position_b: tool.translation.vector,
            axis_angle_b: rotation::axis_angle(&tool.rotation),
            closure: 0.0,
        };
        let senses = Senses::new(&sim, &spec.tactile, looks);
        let reel = spec.film.then(Reel::default);
        Ok(Self {
            spec,
            sim,
            witness,
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
            senses,
            recent: Recent::default(),
            reel,
            force_observed: false,
            far_commands: 0,
        })
    }

    /// Runs to the goal, the end of the budget, or an invalid state.
    ///
    /// # Errors
    /// Whoever drives failed.
    pub fn run(mut self, controller: &mut dyn Controller) -> Result<Finished, EpisodeError> {
        let mut action = self.start_hold;
        let streams = controller.streams();
        self.force_observed = streams.force;
        self.remember(&streams, self.witness.reference(self.target).map(|_| 0.0));
        let outcome = loop {
            if self.judge.goal_reached() {
                break Outcome::Completed;
            }
            if self.steps >= self.spec.task.budget_steps {
                break Outcome::Timeout;
            }
            let looked_at = if controller.looks() { &streams } else { &Streams::default() };
            let observation = self.observation(looked_at)?;
            match controller.act(&self.sim, &observation) {
                Ok(Some(wanted)) => action = wanted,
                Ok(None) => {}
                Err(ControlError::Action(message)) => break Outcome::Error { message },
                Err(source) => return Err(self.control_error(source)),
            }
            if let Err(message) = check_action(&action) {
                break Outcome::Error { message };
            }
            self.actions.push(action);
            self.far_commands += u32::from(is_far(&observation, &action));
            if let Err(failure) = self.control_step(&action) {
                break self.invalid(&failure);
            }
            self.remember(
                &streams,
                self.frames.last().and_then(|frame| frame.deformation.as_ref()).map(|d| d.rms_pct),
            );
        };
        controller.finish();
        Ok(self.finish(outcome, controller.gave_up().map(str::to_owned)))
    }

    fn control_error(&self, source: ControlError) -> EpisodeError {
        EpisodeError::Control { task: self.spec.task.id, episode: self.spec.identity.episode, source }
    }

    /// What a policy sees now.
    ///
    /// # Errors
    /// A stream cannot be made.
    fn observation(&mut self, streams: &Streams) -> Result<Observation, EpisodeError> {
        let tool = self.sim.rig.tool_b(&self.sim.world);
        let blind = Observation {
            time_s: self.time(),
            ee_position_b: tool.translation.vector,
            ee_axis_angle_b: rotation::axis_angle(&tool.rotation),
            joints: self.sim.rig.q(&self.sim.world),
            gripper_width_m: self.sim.rig.width(&self.sim.world),
            closure: self.sim.rig.closure(),
            prompt: self.spec.task.prompt.clone(),
            cameras: Vec::new(),
            touch: None,
            forces: None,
            force_history: Vec::new(),
        };
        self.recent.observe(&mut self.senses, blind, streams).map_err(|source| EpisodeError::Sense {
            task: self.spec.task.id,
            episode: self.spec.identity.episode,
            source,
        })
    }

    /// Keeps what may be looked at later: for the sensors and for the film.
    fn remember(&mut self, streams: &Streams, d_pct: Option<f64>) {
        if streams == &Streams::default() && self.reel.is_none() {
            return;
        }
        let frame = Senses::frame(&self.sim);
        if let Some(reel) = &mut self.reel {
            reel.frames.push(frame.clone());
            reel.d_pct.push(d_pct);
        }
        self.recent.push(frame);
    }

    fn time(&self) -> f64 {
        self.physics_steps as f64 * self.spec.params.dt
    }

    fn control_step(&mut self, action: &Action) -> Result<(), StepFailure> {
        let rotation = rotation::from_axis_angle(&action.axis_angle_b);
        let pose_b = Pose::from_parts(action.position_b.into(), rotation);
        self.sim.rig.command(&mut self.sim.world, &pose_b, action.closure);
        self.steps += 1;
        let mut worst: Option<Deformation> = None;
        for _ in 0..steps_per_control(self.spec.params.dt) {
            self.physics_steps += 1;
            self.sim.step()?;
            let stats = self.sim.world.stats;
            self.newton = (self.newton.0 + u64::from(stats.newton), self.newton.1.max(stats.newton_max));
            if let Kind::Soft(index) = self.sim.objects[self.target].kind {
                self.min_det_f = self.min_det_f.min(self.sim.world.soft[index].min_det_f.0);
            }
            let time = self.time();
            let evidence = self.witness.evidence(&self.sim, time);
            let now = evidence.target.deformation;
            self.judge.observe(&evidence);
            worst = worst.into_iter().chain(now).max_by(|a, b| a.rms_pct.total_cmp(&b.rms_pct));
        }
        self.frames.push(ScoreFrame { success_now: self.judge.goal_reached(), deformation: worst });
        if let Some(nodes) = self.spec.trace {
            let at = (self.steps, self.time());
            let dropped = self.judge.dropped().is_some();
            self.trace.push(StepTrace::new(&self.sim, &self.witness, self.target, at, dropped, nodes));
        }
        Ok(())
    }

    fn invalid(&self, failure: &StepFailure) -> Outcome {
        let (reason, node) = match failure {
            StepFailure::Diverged { .. } => ("not_converged", None),
            StepFailure::NotFinite { node, .. } => ("not_finite", Some(*node as u32)),
            StepFailure::Indefinite { .. } => ("indefinite", None),
            StepFailure::TooFast { node, .. } => ("too_fast", node.map(|node| node as u32)),
            StepFailure::TooHard { .. } => ("too_hard", None),
            StepFailure::Inverted { body, element, .. } => {
                let soft = self.sim.world.soft.iter().find(|s| s.name == *body);
                ("inverted", soft.map(|s| s.body.rest.mesh.elements[*element][0]))
            }
        };
        Outcome::Invalid { reason: reason.to_owned(), step: self.physics_steps, node }
    }

    fn finish(self, outcome: Outcome, gave_up: Option<String>) -> Finished {
        let soft = matches!(self.sim.objects[self.target].kind, Kind::Soft(_));
        let stats = RolloutStats {
            steps: self.steps,
            time_s: self.physics_steps as f64 * self.spec.params.dt,
            min_det_f: (soft && self.min_det_f.is_finite()).then_some(self.min_det_f),
            newton_mean: self.newton.0 as f64 / self.physics_steps.max(1) as f64,
            newton_max: self.newton.1,
            force_observed: self.force_observed,
            camera_inside: self.recent.inside,
            far_commands: self.far_commands,
            gave_up,
            state_hash: state_hash(&self.sim),
        };
        let film = self.reel.map(|Reel { frames, d_pct }| Film { senses: self.senses, frames, d_pct });
        let reference = self.witness.reference(self.target).cloned();
        let verdict = self.judge.finish(&outcome);
        let record = EpisodeRecord { identity: self.spec.identity, outcome, verdict, stats };
        Finished { record, trace: self.trace, frames: self.frames, actions: self.actions, reference, film }
    }
}

/// Whether a command is farther from the tool than a step of the inverse kinematics looks.
fn is_far(now: &Observation, action: &Action) -> bool {
    let (from, to) = (&now.ee_axis_angle_b, &action.axis_angle_b);
    let turn = rotation::error(&rotation::from_axis_angle(from), &rotation::from_axis_angle(to));
    (action.position_b - now.ee_position_b).norm() > REACH.0 || turn.norm() > REACH.1
}

fn check_action(action: &Action) -> Result<(), String> {
    let numbers = action.position_b.iter().chain(action.axis_angle_b.iter()).chain([&action.closure]);
    let all: Vec<f64> = numbers.copied().collect();
    if all.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    Err(format!("the action {all:?} holds a number that is not finite"))
}

/// The judge of an episode in its settled state.
fn judge(
    spec: &EpisodeSpec,
    sim: &Simulation,
    witness: &Witness,
    (target, place): (usize, usize),
    hold_s: f64,
) -> Judge {
    Judge::new(Setup {
        rules: spec.rules.clone(),
        workspace: spec.scene.workspace,
        place: place_of(&spec.task.goal, &sim.objects[place]),
        hold_s,
        dt_s: spec.params.dt,
        steps_per_control: steps_per_control(spec.params.dt),
        target_weight_n: weight(sim, target),
        soft: matches!(sim.objects[target].kind, Kind::Soft(_)),
        limit: spec.limit,
        target_lowest_z_w: lowest(sim, &sim.objects[target]),
        others_lowest_z_w: witness.others_lowest(sim),
    })
}

/// Where the goal is, from the shape of what it names.
fn place_of(goal: &Goal, place: &Handle) -> Place {
    let bounds = place.bounds;
    match goal {
        Goal::On { .. } => Place::On { radius_m: 0.5 * bounds.size().xy().min() },
        Goal::In { .. } => {
            let wall = place.asset.hints.get("wall_m").copied().unwrap_or(0.0);
            let inset = Vec3::new(wall, wall, 0.0);
            let foot = place.foot_o();
            Place::In { inside: Region { min: bounds.min + inset - foot, max: bounds.max - inset - foot } }
        }
    }
}

fn weight(sim: &Simulation, object: usize) -> f64 {
    let mass = match sim.objects[object].kind {
        Kind::Soft(index) => sim.world.soft[index].body.rest.total_mass(),
        Kind::Rigid(index) => sim.world.rigid[index].body.mass,
        Kind::Link { .. } | Kind::Static => 0.0,
    };
    mass * sim.scene.gravity.norm()
}

/// Hash of all positions, bit for bit.
pub fn state_hash(sim: &Simulation) -> String {
    let mut hash = Sha256::new();
    let mut put = |x: f64| hash.update(x.to_bits().to_le_bytes());
    for soft in &sim.world.soft {
        soft.body.x.iter().flat_map(|x| x.iter()).for_each(|x| put(*x));
    }
    for rigid in &sim.world.rigid {
        rigid.body.pose_w.to_homogeneous().iter().for_each(|x| put(*x));
    }
    for tree in &sim.world.trees {
        tree.state.q.iter().for_each(|x| put(*x));
    }
    hash.finalize().iter().take(8).map(|b| format!("{b:02x}")).collect()
}
