//! The world: all bodies, and the step that moves them.

mod assemble;
mod bounds;
mod build;
mod energy;
mod frame;
mod integrate;
mod overlap;
mod points;
mod rigid_rows;
mod sleep;
mod sliding;
mod soft_rows;

use std::sync::Arc;

use crate::{
    geometry::{Mat3, Pose, Vec3},
    physics::{
        contact::{Candidate, Collider, ColliderId, Friction, Layer, Memory, Moving, Partner, Surface},
        fem::{SoftBody, system::System},
        joints::{self, Tree, TreeState},
        params::Params,
        rigid::RigidBody,
        solver::{Problem, Solver, Stats},
    },
};

pub use frame::{ContactPatch, Frame, Movable, PatchPoint, Presser, Touch};
pub use overlap::Overlap;

/// A soft body in the world.
#[derive(Clone, Debug)]
pub struct Soft {
    /// Name, for messages and logs.
    pub name: String,
    /// The body.
    pub body: SoftBody,
    /// Friction of its surface.
    pub friction: Friction,
    /// Compliance of its surface.
    pub layer: Layer,
    /// Its surface at rest, object frame, as other soft bodies feel it; without one they do not.
    pub surface: Option<Arc<dyn Surface>>,
    /// Whether it sleeps: it neither moves nor costs anything until something touches it.
    pub asleep: bool,
    /// Least det F of its filled elements after the last step, and where.
    pub min_det_f: (f64, usize),
    /// What touched it in the last step in which it was awake, by [`Partner::id`](crate::physics::contact::Partner::id).
    pub touches: Vec<(u32, Touch)>,
    system: System,
    memory: Memory,
    /// Steps taken awake; memory and kept nodes count in these.
    steps: u64,
    slow_for: f64,
    inverted_for: f64,
}

/// A free rigid body in the world.
#[derive(Clone, Debug)]
pub struct Rigid {
    /// Name, for messages and logs.
    pub name: String,
    /// The body.
    pub body: RigidBody,
    /// Whether it sleeps: it stands still, as if it were part of the world, until something stirs near it.
    pub asleep: bool,
    /// What touched it in the last step in which it was awake, by [`Partner::id`](crate::physics::contact::Partner::id).
    pub touches: Vec<(u32, Touch)>,
    slow_for: f64,
}

/// A PD drive on one joint: force `clamp(kp (target − q) + kd (target_velocity − v), ±effort)`, solved with everything else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Stiffness, N m/rad or N/m.
    pub kp: f64,
    /// Damping, N m s/rad or N s/m.
    pub kd: f64,
    /// Target position, rad or m.
    pub target: f64,
    /// Target velocity, rad/s or m/s.
    pub target_velocity: f64,
    /// Effort limit, N m or N.
    pub effort: f64,
    /// Force of the last step, N m or N.
    pub force: f64,
}

/// Dry friction of a joint as a stiff spring that gives way at the friction: a joint that sticks does not creep.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bristle {
    /// Where the spring is free, rad or m.
    from: f64,
    /// Its stiffness in the last step, N m/rad or N/m.
    stiffness: f64,
}

/// A joint tree in the world.
#[derive(Clone, Debug)]
pub struct Articulation {
    /// Name, for messages and logs.
    pub name: String,
    /// The mechanism.
    pub tree: Tree,
    /// Its coordinates and velocities.
    pub state: TreeState,
    /// One drive a joint, if it has one.
    pub drives: Vec<Option<Drive>>,
    /// Whether gravity acts on its links (off for an arm whose controller compensates it).
    pub gravity: bool,
    /// Whether it sleeps: its links stand still, as if they were part of the world, until something stirs near them. One
    /// with a drive never does.
    pub asleep: bool,
    slow_for: f64,
    /// Dry friction of each joint.
    bristles: Vec<Bristle>,
    poses: Vec<Pose>,
    scratch: joints::Scratch,
}

impl Articulation {
    /// Link frames in the world.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// Whether any joint has a drive.
    pub fn is_driven(&self) -> bool {
        self.drives.iter().any(Option::is_some)
    }
}

/// A frame whose motion is prescribed.
#[derive(Clone, Copy, Debug)]
pub struct Kinematic {
    /// Where it is.
    pub pose: Pose,
    /// Where it will be after the next step.
    pub next: Pose,
}

/// Why a step could not be taken; the run is invalid from then on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StepFailure {
    /// The contact solve did not converge.
    #[error("contact solve did not converge at step {step} (residual {excess:.1e} times the tolerance)")]
    Diverged {
        /// Step, counted from 1.
        step: u64,
        /// Residual over tolerance.
        excess: f64,
    },
    /// A position is not a number any more.
    #[error("node {node} of {body} is not finite at step {step}")]
    NotFinite {
        /// Step, counted from 1.
        step: u64,
        /// Body name.
        body: String,
        /// Node index.
        node: usize,
    },
    /// The velocity system of a body is not positive definite.
    #[error("the system of {body} is not positive definite at step {step}")]
    Indefinite {
        /// Step, counted from 1.
        step: u64,
        /// Body name.
        body: String,
    },
    /// Something is faster than anything in a scene can be.
    #[error("{body} moves at {speed:.1} m/s at step {step}, beyond the {most} m/s of a valid state")]
    TooFast {
        /// Step, counted from 1.
        step: u64,
        /// Body name.
        body: String,
        /// The node, of a soft body.
        node: Option<usize>,
        /// Its speed, m/s.
        speed: f64,
        /// [`Params::most_speed`].
        most: f64,
    },
    /// A soft body is touched with a force that neither its momentum nor its stress explains.
    #[error(
        "{body} is touched with {force:.1e} N at step {step}, beyond the {most:.1e} N that its mass and stress explain"
    )]
    TooHard {
        /// Step, counted from 1.
        step: u64,
        /// Body name.
        body: String,
        /// Sum of the normal forces on it, N.
        force: f64,
        /// What is the most, N.
        most: f64,
    },
    /// An element stayed inverted.
    #[error("inverted: element {element} of {body} has been inside out for over {seconds} s at step {step}")]
    Inverted {
        /// Step, counted from 1.
        step: u64,
        /// Body name.
        body: String,
        /// Element index.
        element: usize,
        /// The tolerated time, s.
        seconds: f64,
    },
}

impl StepFailure {
    /// Name of the body that it was seen at, if there is one.
    pub fn body(&self) -> Option<&str> {
        match self {
            Self::Diverged { .. } => None,
            Self::NotFinite { body, .. }
            | Self::Indefinite { body, .. }
            | Self::TooFast { body, .. }
            | Self::TooHard { body, .. }
            | Self::Inverted { body, .. } => Some(body),
        }
    }
}

/// What a row of the problem is about.
#[derive(Clone, Copy, Debug)]
struct RowOf {
    soft: usize,
    candidate: Candidate,
    partner: u32,
    anchor: Vec3,
    travel: f64,
    /// Takes small vectors of the world to the frame of the anchor.
    pull: Mat3,
}

/// All bodies of a scene and how they stand.
#[derive(Clone, Debug, Default)]
pub struct World {
    /// Parameters.
    pub params: Params,
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Steps taken.
    pub step: u64,
    /// Soft bodies.
    pub soft: Vec<Soft>,
    /// Free rigid bodies.
    pub rigid: Vec<Rigid>,
    /// Joint trees.
    pub trees: Vec<Articulation>,
    /// Prescribed frames.
    pub kinematic: Vec<Kinematic>,
    /// What the last solve took.
    pub stats: Stats,
    colliders: Vec<Collider>,
    moving: Vec<Moving>,
    problem: Problem,
    solver: Solver,
    rows: Vec<RowOf>,
    candidates: Vec<(usize, ColliderId, Candidate)>,
    pressing: Vec<soft_rows::Press>,
    rigid_contacts: rigid_rows::RigidContacts,
    layout: assemble::Layout,
}

impl World {
    /// Advances everything by one time step.
    ///
    /// # Errors
    /// [`StepFailure`]: the state is then void, nothing is repaired behind the caller's back.
    pub fn step(&mut self) -> Result<(), StepFailure> {
        self.step += 1;
        self.place_colliders();
        self.wake();
        self.detect();
        self.detect_pressing();
        self.assemble()?;
        let solved = self.solver.solve(&mut self.problem);
        self.stats = solved.map_err(|f| StepFailure::Diverged { step: self.step, excess: f.excess })?;
        self.integrate();
        self.remember();
        self.remember_rigid();
        self.fall_asleep();
        self.check()
    }

    /// Seconds since the start.
    pub fn time(&self) -> f64 {
        self.step as f64 * self.params.dt
    }

    /// Name of a partner of a [`Touch`].
    pub fn partner_name(&self, partner: u32) -> &str {
        match Partner::of(partner) {
            Partner::Collider(id) => &self.colliders[id].name,
            Partner::Soft(index) => &self.soft[index].name,
        }
    }

    /// The colliders, by id.
    pub fn colliders(&self) -> &[Collider] {
        &self.colliders
    }
}

impl Soft {
    /// How many nodes the contact solve keeps at present.
    pub fn kept(&self) -> usize {
        self.system.kept().len()
    }

    /// How often the body's system was factored.
    pub fn refills(&self) -> u64 {
        self.system.refills
    }
}
