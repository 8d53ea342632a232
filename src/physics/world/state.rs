//! State of the objects in a world.

use std::sync::Arc;

use crate::{
    contact::{ContactHistory, ContactSurface, Friction, SurfaceStiffness},
    fem::{FemState, system::VelocitySystem},
    ids::ContactPartner,
    joints::{JointState, JointTree},
    params::PhysicsParams,
    rigid::RigidState,
    solver::ScalarConstraint,
};
use softvt_geometry::{Pose, Vec3};

/// Contact of one body with one partner, summed over the contact points. Forces and speed are means over the step; the
/// rest is that of the last part in which the two touched, if the step was divided.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactSummary {
    /// Number of points that press.
    pub points: usize,
    /// Of those, points at the friction bound.
    pub slipping_points: usize,
    /// Sum of the normal forces, N.
    pub normal_force: f64,
    /// Force on the body, N, world.
    pub force_w: Vec3,
    /// Sum of the friction bounds μ f_n, N: the largest shear force that the patch can hold.
    pub friction_capacity: f64,
    /// Force-weighted mean distance slipped since first contact, m. It changes as well when points join
    /// or leave the patch.
    pub slip_distance: f64,
    /// Force-weighted mean distance that the points slid in the last step over its length, m/s.
    pub slip_speed: f64,
}

impl ContactSummary {
    /// Both contacts as one.
    pub(super) fn joined(self, other: Self) -> Self {
        let normal_force = self.normal_force + other.normal_force;
        let mean = |a: f64, b: f64| match normal_force > 0.0 {
            true => (self.normal_force * a + other.normal_force * b) / normal_force,
            false => 0.0,
        };
        Self {
            points: self.points + other.points,
            slipping_points: self.slipping_points + other.slipping_points,
            normal_force,
            force_w: self.force_w + other.force_w,
            friction_capacity: self.friction_capacity + other.friction_capacity,
            slip_distance: mean(self.slip_distance, other.slip_distance),
            slip_speed: mean(self.slip_speed, other.slip_speed),
        }
    }

    /// Adds a part of a step, which lasts for a share of it.
    pub(super) fn add_part(&mut self, part: &Self, share: f64) {
        *self = Self {
            normal_force: self.normal_force + share * part.normal_force,
            force_w: self.force_w + share * part.force_w,
            friction_capacity: self.friction_capacity + share * part.friction_capacity,
            slip_speed: self.slip_speed + share * part.slip_speed,
            ..*part
        };
    }

    /// Shear force, N; exact if all normals of the patch agree.
    pub fn shear(&self) -> f64 {
        (self.force_w.norm_squared() - self.normal_force.powi(2)).max(0.0).sqrt()
    }
}

/// Contact of a body with one partner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyContact {
    /// The collider or soft body on the other side.
    pub partner: ContactPartner,
    /// Sums over the contact points, as seen by the body.
    pub summary: ContactSummary,
}

/// A finite-element soft body of a [`World`](super::World).
#[derive(Clone, Debug)]
pub struct SoftBody {
    /// Name, for messages and logs.
    pub name: String,
    /// Node positions and velocities; [`World::set_soft_motion`](super::World::set_soft_motion) changes them.
    pub state: FemState,
    /// Friction of its surface.
    pub friction: Friction,
    /// Contact stiffness of its surface.
    pub stiffness: SurfaceStiffness,
    pub(super) surface: Option<Arc<dyn ContactSurface>>,
    /// Index of the assembly to which it belongs.
    pub(super) assembly: Option<usize>,
    pub(super) sleep: SleepState,
    pub(super) contacts: Vec<BodyContact>,
    /// Factored velocity system, reduced to the nodes in contact.
    pub(crate) system: VelocitySystem,
    pub(super) history: ContactHistory,
    /// Steps taken awake: the clock of `history` and of the retained nodes, which stops during sleep.
    pub(super) steps_awake: u64,
    pub(super) inverted_time: f64,
}

impl SoftBody {
    /// Number of factorisations of its velocity system so far.
    pub fn factorizations(&self) -> u64 {
        self.system.factorizations
    }

    /// True while it sleeps: it is skipped until something near it moves or anything is changed.
    pub fn is_asleep(&self) -> bool {
        self.sleep.is_asleep
    }
}

/// A free rigid body of a [`World`](super::World).
#[derive(Clone, Debug)]
pub struct RigidBody {
    /// Name, for messages and logs.
    pub name: String,
    /// Pose, velocity and mass properties. Pose and velocity may be set between steps.
    pub state: RigidState,
    /// Index of the assembly to which it belongs.
    pub(super) assembly: Option<usize>,
    pub(super) sleep: SleepState,
    pub(super) contacts: Vec<BodyContact>,
}

impl RigidBody {
    /// True while it sleeps: it is then treated as part of the world until something near it moves
    /// or anything is changed.
    pub fn is_asleep(&self) -> bool {
        self.sleep.is_asleep
    }
}

/// Sleep of a body and the time that leads to it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SleepState {
    pub is_asleep: bool,
    /// Time for which the body has been slow and undisturbed, s.
    pub slow_time: f64,
}

impl SleepState {
    /// Counts a step at whose end an awake body has this speed (m/s, rad/s); true if it may fall asleep.
    pub(super) fn is_due(&mut self, speed: f64, params: &PhysicsParams) -> bool {
        self.slow_time = if speed <= params.sleep_speed { self.slow_time + params.dt } else { 0.0 };
        !self.is_asleep && self.slow_time >= params.sleep_delay
    }

    pub(super) fn wake(&mut self) {
        *self = Self::default();
    }
}

/// A PD drive on one joint, solved implicitly with everything else.
///
/// Its force is `clamp(kp (target − q) + kd (target_velocity − v), ±effort)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointDrive {
    /// Stiffness, N m/rad or N/m.
    pub kp: f64,
    /// Damping, N m s/rad or N s/m.
    pub kd: f64,
    /// Target position at the end of the step, rad or m.
    pub target: f64,
    /// Target velocity, rad/s or m/s.
    pub target_velocity: f64,
    /// Effort limit, N m or N.
    pub effort: f64,
}

impl JointDrive {
    /// Its force law for the solver: on velocity `index` of a block, with the joint at `q` at the start of the step.
    pub(super) fn constraint(&self, block: usize, index: usize, q: f64) -> ScalarConstraint {
        ScalarConstraint {
            stiffness: self.kp,
            damping: self.kd,
            error: self.target - q,
            target_velocity: self.target_velocity,
            min_force: -self.effort,
            max_force: self.effort,
            ..ScalarConstraint::free(block, index)
        }
    }
}

/// Dry friction of a joint as a stiff spring whose force is limited to the friction: a joint that
/// sticks does not creep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct JointFriction {
    /// Joint coordinate at which the spring is free, rad or m.
    pub anchor: f64,
    /// Stiffness in the last step, N m/rad or N/m.
    pub stiffness: f64,
    /// Length of that step, s; 0 before the first.
    pub dt: f64,
}

impl JointFriction {
    /// Sets the stiffness for a step of `dt`. Where the length of steps changes, the spring of a joint at `q` keeps its
    /// force.
    pub(super) fn set_stiffness(&mut self, stiffness: f64, dt: f64, q: f64) {
        if self.dt > 0.0 && self.dt != dt {
            self.anchor = q + (self.anchor - q) * (self.stiffness / stiffness);
        }
        (self.stiffness, self.dt) = (stiffness, dt);
    }
}

/// An articulation of a [`World`](super::World): a tree of links and joints with a fixed base.
#[derive(Clone, Debug)]
pub struct Articulation {
    /// Name, for messages and logs.
    pub name: String,
    /// Joint coordinates and velocities. Writable between steps; their number must not change.
    pub state: JointState,
    pub(super) tree: JointTree,
    pub(super) drives: Vec<Option<JointDrive>>,
    /// The drives in the last step or part of one.
    pub(super) last_drives: Vec<Option<JointDrive>>,
    pub(super) drive_forces: Vec<f64>,
    pub(super) has_gravity: bool,
    /// Index of the assembly to which its links belong.
    pub(super) assembly: Option<usize>,
    pub(super) sleep: SleepState,
    pub(super) friction: Vec<JointFriction>,
    pub(super) poses: Vec<Pose>,
}

impl Articulation {
    /// Links and joints of the mechanism.
    pub fn tree(&self) -> &JointTree {
        &self.tree
    }

    /// Link frames in the world after the last step.
    pub fn poses(&self) -> &[Pose] {
        &self.poses
    }

    /// The drive of each joint, if it has one.
    pub fn drives(&self) -> &[Option<JointDrive>] {
        &self.drives
    }

    /// The drive of each joint, to change targets and gains or to add and remove drives.
    pub fn drives_mut(&mut self) -> &mut [Option<JointDrive>] {
        &mut self.drives
    }

    /// Force of the drive of each joint in the last step, N m or N; 0 for a joint without one.
    pub fn drive_forces(&self) -> &[f64] {
        &self.drive_forces
    }

    /// Moves the target of each drive by a share of the way from its last place to its end.
    pub(super) fn move_targets(&mut self, ends: &[Option<JointDrive>], share: f64) {
        let drives = self.drives.iter_mut().zip(&self.last_drives).zip(ends);
        for ((drive, last), end) in drives {
            if let (Some(drive), Some(last), Some(end)) = (drive, last, end) {
                drive.target = last.target + (end.target - last.target) * share;
            }
        }
    }

    /// True if any joint has a drive.
    pub fn is_driven(&self) -> bool {
        self.drives.iter().any(Option::is_some)
    }

    /// True while it sleeps: its links are then treated as part of the world until something near them moves or
    /// anything is changed. A driven articulation never sleeps.
    pub fn is_asleep(&self) -> bool {
        self.sleep.is_asleep
    }
}

/// A frame whose motion is prescribed.
#[derive(Clone, Copy, Debug)]
pub struct KinematicFrame {
    /// Pose now, world.
    pub pose: Pose,
    /// Pose after the next step, world.
    pub next: Pose,
}
