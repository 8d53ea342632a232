//! The world: all bodies and colliders, and the step that moves them.
//!
//! A [`World`] owns soft bodies, free rigid bodies, articulations, kinematic frames and colliders. `add_*` puts an
//! object in and returns its [identifier](super::ids). [`World::step`] advances everything by [`PhysicsParams::dt`].
//! Units are SI; positions, velocities and forces are in the world frame unless a name says otherwise.
//!
//! A soft cube falls on the ground and comes to rest. Two jaws then squeeze it by a fifth, and the force on one is
//! read:
//!
//! ```
//! use softvt_geometry::{Pose, Vec3, shape::Shape};
//! use softvt_physics::{World, fem::ElasticMaterial};
//! use softvt_physics::world::{FixedBuilder, KinematicBuilder, SoftBodyBuilder};
//!
//! let bread = ElasticMaterial::new(3e4, 0.0, 250.0)?;
//! let jaw = Shape::cuboid(Vec3::new(0.01, 0.08, 0.04));
//! let mut world = World::with_gravity();
//! world.insert(FixedBuilder::ground());
//! let cube = world.insert(SoftBodyBuilder::new(Shape::cuboid(Vec3::repeat(0.05)), bread).at(0.0, 0.0, 0.03))?;
//! let jaw_at = |side| KinematicBuilder::new(jaw.clone()).at(0.031 * side, 0.0, 0.025);
//! let jaws = [-1.0, 1.0].map(|side| (side, world.insert(jaw_at(side))));
//! world.run(1.0)?;
//! assert!((world.soft(cube).state.centre().z - 0.025).abs() < 1e-3);
//!
//! for step in 1..=60 {
//!     let reach = 0.031 - 0.006 * f64::from(step) / 60.0;
//!     jaws.iter().for_each(|(side, jaw)| world.move_kinematic(*jaw, Pose::translation(reach * side, 0.0, 0.025)));
//!     world.step()?;
//! }
//! // Without lateral strain the stress is uniform: E A ε = 3e4 × 0.05 × 0.04 × 0.2 = 12 N, and more at the edges.
//! let force = world.contact_with(cube, jaws[0].1).normal_force;
//! assert!((12.0..15.0).contains(&force), "{force} N");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assemble;
mod assembly;
mod attachment;
mod build;
mod builders;
mod contact_points;
mod divergence;
mod integrate;
mod penetration;
mod rigid_contacts;
mod sleep;
mod snapshot;
mod soft_contacts;
mod state;
mod step_means;
mod substeps;

use crate::{
    contact::{Collider, ColliderMotion, DetectionLimits, LayerState},
    ids::{
        ArticulationId, AttachmentId, BodyId, ColliderId, ContactPartner, KinematicId, LinkId, RigidId,
        SoftId,
    },
    params::PhysicsParams,
    solver::{ContactProblem, Solver, SolverStats},
};
use softvt_geometry::{GroupedAabb, Pose, Vec3};

pub use attachment::{AttachError, Attachment};
pub use builders::{BodyBuilder, FixedBuilder, KinematicBuilder, RigidBodyBuilder, SoftBodyBuilder};
pub use penetration::Penetration;
pub use snapshot::{ContactPatch, Energy, PatchPoint, SampleSupport, WorldSnapshot};
pub use state::{Articulation, BodyContact, ContactSummary, JointDrive, KinematicFrame, RigidBody, SoftBody};

/// Why a step is invalid. The world must not be used afterwards; nothing is repaired silently.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StepFailure {
    /// The contact solve did not converge.
    #[error(
        "contact solve did not converge at step {step} (residual {residual_ratio:.1e} times the tolerance)"
    )]
    Diverged {
        /// Step, counted from 1.
        step: u64,
        /// Residual of the last iteration over the tolerance.
        residual_ratio: f64,
    },
    /// A node position is NaN or infinite.
    #[error("node {node} of {body} is not finite at step {step}")]
    NotFinite {
        /// Step, counted from 1.
        step: u64,
        /// Name of the body.
        body: String,
        /// Index of the node.
        node: usize,
    },
    /// The velocity system of a soft body is not positive definite.
    #[error("the system of {body} is not positive definite at step {step}")]
    Indefinite {
        /// Step, counted from 1.
        step: u64,
        /// Name of the body.
        body: String,
    },
    /// A body is faster than [`PhysicsParams::max_speed`].
    #[error("{body} moves at {speed:.1} m/s at step {step}, above the limit of {limit} m/s")]
    SpeedLimitExceeded {
        /// Step, counted from 1.
        step: u64,
        /// Name of the body.
        body: String,
        /// Index of the node, for a soft body.
        node: Option<usize>,
        /// Speed, m/s.
        speed: f64,
        /// The limit, m/s.
        limit: f64,
    },
    /// Contact forces on a soft body exceed what momentum change and material stress can balance.
    #[error(
        "contact force on {body} is {force:.1e} N at step {step}; its mass and stress allow at most {limit:.1e} N"
    )]
    ForceLimitExceeded {
        /// Step, counted from 1.
        step: u64,
        /// Name of the body.
        body: String,
        /// Sum of the normal forces on it, N.
        force: f64,
        /// The limit, N.
        limit: f64,
    },
    /// An element was inverted for longer than [`PhysicsParams::max_inverted_time`].
    #[error("inverted: element {element} of {body} has been inside out for over {seconds} s at step {step}")]
    Inverted {
        /// Step, counted from 1.
        step: u64,
        /// Name of the body.
        body: String,
        /// Index of the element.
        element: usize,
        /// The limit, s.
        seconds: f64,
    },
}

impl StepFailure {
    /// Name of the body at which the failure was found, if there is one.
    pub fn body(&self) -> Option<&str> {
        match self {
            Self::Diverged { .. } => None,
            Self::NotFinite { body, .. }
            | Self::Indefinite { body, .. }
            | Self::SpeedLimitExceeded { body, .. }
            | Self::ForceLimitExceeded { body, .. }
            | Self::Inverted { body, .. } => Some(body),
        }
    }
}

/// All bodies and colliders of a scene, their state, and the buffers of the step.
///
/// Objects are added, never removed, so that identifiers stay valid. A clone is an independent world that continues
/// identically: a step depends on nothing else, and its results are the same bits on every machine.
#[derive(Clone, Debug, Default)]
pub struct World {
    /// Parameters. They may be changed between steps.
    pub params: PhysicsParams,
    /// Gravity, m/s². It may be changed between steps.
    pub gravity: Vec3,
    step: u64,
    /// Length of the last step or part of one, s; 0 before the first.
    last_dt: f64,
    /// Largest length of the parts of the last step, s; 0 before the first.
    part_dt: f64,
    soft: Vec<SoftBody>,
    rigid: Vec<RigidBody>,
    articulations: Vec<Articulation>,
    kinematic: Vec<KinematicFrame>,
    colliders: Vec<Collider>,
    /// State of the elastic layer of each collider.
    layers: Vec<Option<LayerState>>,
    attachments: Vec<Attachment>,
    assemblies: Vec<assembly::Assembly>,
    stats: SolverStats,
    // Data of the current step, in buffers that are reused.
    motions: Vec<ColliderMotion>,
    problem: ContactProblem,
    solver: Solver,
    blocks: assemble::BlockMap,
    candidates: soft_contacts::Candidates,
    rows: Vec<soft_contacts::SoftRow>,
    rigid_contacts: rigid_contacts::RigidContacts,
    means: step_means::StepMeans,
    moving: Vec<GroupedAabb>,
    // State of sleep.
    /// Parameters and gravity of the last step.
    inputs: (PhysicsParams, Vec3),
    /// Points of colliders whose two sides rest, of the step in which the second fell asleep.
    resting: Vec<snapshot::ColliderPoint>,
}

impl World {
    /// An empty world with gravity in m/s².
    pub fn new(params: PhysicsParams, gravity: Vec3) -> Self {
        Self { params, gravity, ..Self::default() }
    }

    /// An empty world with default parameters and [`STANDARD_GRAVITY`](crate::STANDARD_GRAVITY).
    pub fn with_gravity() -> Self {
        Self::new(PhysicsParams::default(), crate::STANDARD_GRAVITY)
    }

    /// Adds a body that a builder describes, and returns its identifier.
    pub fn insert<B: BodyBuilder>(&mut self, body: B) -> B::Output {
        body.insert(self)
    }

    /// Advances everything by `seconds`, rounded to whole steps.
    ///
    /// # Errors
    /// As [`World::step`].
    pub fn run(&mut self, seconds: f64) -> Result<(), StepFailure> {
        (0..(seconds / self.params.dt).round() as u64).try_for_each(|_| self.step())
    }

    /// Advances everything by one time step of [`PhysicsParams::dt`].
    ///
    /// # Errors
    /// [`StepFailure`]: the state must not be used afterwards.
    pub fn step(&mut self) -> Result<(), StepFailure> {
        self.begin_step();
        let parts = self.step_parts();
        if parts == 1 && self.solve()? { self.finish_step() } else { self.step_in_parts(parts.max(2)) }
    }

    /// Wakes what is disturbed, and finds what may touch in the whole step.
    fn begin_step(&mut self) {
        self.step += 1;
        self.update_collider_motions();
        self.wake_disturbed();
        self.count_steps_awake();
        self.find_candidates();
        self.means.clear();
    }

    /// Finds what may touch in a step of the present length.
    fn find_candidates(&mut self) {
        self.detect_soft_collider();
        self.detect_soft_soft();
        self.mark_attached();
    }

    /// Solves a step whose candidates are known; false if it must be divided.
    fn solve(&mut self) -> Result<bool, StepFailure> {
        self.assemble()?;
        let solved = self.solver.solve(&mut self.problem);
        self.stats = solved
            .map_err(|f| StepFailure::Diverged { step: self.step, residual_ratio: f.residual_ratio })?;
        self.complete();
        let is_short = !self.strains_too_far();
        if !is_short {
            self.part_dt = 0.5 * self.params.dt;
            self.means.add_stats(&self.stats);
        }
        Ok(is_short)
    }

    /// Integrates a step that is solved.
    fn finish_step(&mut self) -> Result<(), StepFailure> {
        self.integrate();
        self.last_dt = self.params.dt;
        self.record_contacts();
        self.record_bonds();
        self.update_soft_history();
        self.update_rigid_history();
        self.update_layers();
        self.put_resting_to_sleep();
        self.check_state()
    }

    /// Number of steps taken.
    pub fn step_count(&self) -> u64 {
        self.step
    }

    /// Simulated time, s.
    pub fn time(&self) -> f64 {
        self.step as f64 * self.params.dt
    }

    /// Iteration counts of the last step.
    pub fn solver_stats(&self) -> SolverStats {
        self.stats
    }

    /// All soft bodies, in the order of their identifiers.
    pub fn soft_bodies(&self) -> &[SoftBody] {
        &self.soft
    }

    /// All free rigid bodies, in the order of their identifiers.
    pub fn rigid_bodies(&self) -> &[RigidBody] {
        &self.rigid
    }

    /// All articulations, in the order of their identifiers.
    pub fn articulations(&self) -> &[Articulation] {
        &self.articulations
    }

    /// All colliders, in the order of their identifiers.
    pub fn colliders(&self) -> &[Collider] {
        &self.colliders
    }

    /// The soft body with this id.
    pub fn soft(&self, id: SoftId) -> &SoftBody {
        &self.soft[id.index()]
    }

    /// Changes the position (m) and velocity (m/s) of each node of a soft body, both in the world
    /// frame. Wakes all bodies.
    pub fn set_soft_motion(&mut self, id: SoftId, mut change: impl FnMut(&mut Vec3, &mut Vec3)) {
        self.wake_all();
        let body = &mut self.soft[id.index()].state;
        body.x.iter_mut().zip(&mut body.v).for_each(|(x, v)| change(x, v));
        body.update_elastic(0.0);
    }

    /// A free rigid body.
    pub fn rigid(&self, id: RigidId) -> &RigidBody {
        &self.rigid[id.index()]
    }

    /// A free rigid body, to change its state. Wakes all bodies.
    pub fn rigid_mut(&mut self, id: RigidId) -> &mut RigidBody {
        self.wake_all();
        &mut self.rigid[id.index()]
    }

    /// The articulation with this id.
    pub fn articulation(&self, id: ArticulationId) -> &Articulation {
        &self.articulations[id.index()]
    }

    /// An articulation, to change its state or drives. Wakes all bodies, unless it is driven: a driven one keeps
    /// those near it awake.
    pub fn articulation_mut(&mut self, id: ArticulationId) -> &mut Articulation {
        if !self.articulation(id).is_driven() {
            self.wake_all();
        }
        &mut self.articulations[id.index()]
    }

    /// Link frame of a link after the last step, world.
    pub fn link_pose(&self, id: LinkId) -> &Pose {
        &self.articulation(id.articulation).poses[id.index]
    }

    /// Pose of a body in the world: the mean pose of a soft body, the object frame of a rigid one, the frame of a link
    /// or of a kinematic body, the identity for the world itself.
    pub fn pose(&self, body: impl Into<BodyId>) -> Pose {
        match body.into() {
            BodyId::Soft(id) => self.soft(id).state.mean_pose(),
            BodyId::Rigid(id) => self.rigid(id).state.object_w(),
            BodyId::Link(id) => *self.link_pose(id),
            BodyId::Kinematic(id) => self.kinematic(id).pose,
            BodyId::World => Pose::identity(),
        }
    }

    /// Mass of a soft or free rigid body, kg; `None` for links, kinematic bodies and the world.
    pub fn mass(&self, body: impl Into<BodyId>) -> Option<f64> {
        match body.into() {
            BodyId::Soft(id) => Some(self.soft(id).state.model.total_mass()),
            BodyId::Rigid(id) => Some(self.rigid(id).state.mass),
            BodyId::Link(_) | BodyId::Kinematic(_) | BodyId::World => None,
        }
    }

    /// True if a body, or the articulation of a link, rests and is not integrated until something moves it.
    pub fn is_asleep(&self, body: impl Into<BodyId>) -> bool {
        match body.into() {
            BodyId::Soft(id) => self.soft(id).is_asleep(),
            BodyId::Rigid(id) => self.rigid(id).is_asleep(),
            BodyId::Link(id) => self.articulation(id.articulation).is_asleep(),
            BodyId::World | BodyId::Kinematic(_) => false,
        }
    }

    /// The kinematic frame with this id.
    pub fn kinematic(&self, id: KinematicId) -> &KinematicFrame {
        &self.kinematic[id.index()]
    }

    /// The collider with this id.
    pub fn collider(&self, id: ColliderId) -> &Collider {
        &self.colliders[id.index()]
    }

    /// The attachment with this id.
    pub fn attachment(&self, id: AttachmentId) -> &Attachment {
        &self.attachments[id.index()]
    }

    /// Name of a collider or soft body.
    pub fn partner_name(&self, partner: ContactPartner) -> &str {
        match partner {
            ContactPartner::Collider(id) => &self.collider(id).name,
            ContactPartner::Soft(id) => &self.soft(id).name,
        }
    }

    fn detection_limits(&self) -> DetectionLimits {
        DetectionLimits { dt: self.params.dt, margin: self.params.margin, reach: assemble::RETAIN_DISTANCE }
    }
}
