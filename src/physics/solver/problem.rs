//! The data of one solve.

use super::law::Scalar;
use crate::geometry::Vec3;

/// A block of generalised velocity.
#[derive(Clone, Debug, Default)]
pub struct Block {
    /// Number of velocities.
    pub dim: usize,
    /// Symmetric positive definite `A`, column-major, lower triangle, side `dim`.
    pub matrix: Vec<f64>,
    /// Right-hand side: the free motion solves `A v = rhs`.
    pub rhs: Vec<f64>,
    /// Start value, and the solution afterwards.
    pub v: Vec<f64>,
    /// Says what the velocities mean: two blocks with the same identity and size are the same one in two steps.
    pub identity: u64,
}

/// The motion of a rigid frame as a linear function of a block's velocity.
#[derive(Clone, Debug)]
pub struct Screw {
    /// The block.
    pub block: usize,
    /// 6 × dim, column-major: linear velocity of the frame's origin, then angular velocity, world.
    pub jacobian: Vec<f64>,
    /// The frame's origin, m, world.
    pub origin: Vec3,
}

/// One side of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Endpoint {
    /// Something whose velocity is known; it is in the points' `drift`.
    Known,
    /// A weighted mean of up to eight 3-vectors of a block.
    Nodes {
        /// The block.
        block: usize,
        /// First velocity index of each.
        at: [u32; 8],
        /// How many are used.
        count: usize,
    },
    /// A point of a rigid frame.
    Screw(usize),
}

/// Contact samples between the same two endpoints.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// The side that the normal points to.
    pub a: Endpoint,
    /// The side that the normal points away from.
    pub b: Endpoint,
    /// First point.
    pub first: usize,
    /// One past the last point.
    pub last: usize,
}

/// One contact sample. Its relative velocity is `v_a − v_b − drift`.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Weights of `a`'s nodes.
    pub weights_a: [f64; 8],
    /// Weights of `b`'s nodes.
    pub weights_b: [f64; 8],
    /// Where it is, m, world (for the arms to screws).
    pub p: Vec3,
    /// Unit normal from `b` to `a`.
    pub normal: Vec3,
    /// Known part of `b`'s velocity (or of `a`'s, negated), m/s.
    pub drift: Vec3,
    /// Normal stiffness, N/m.
    pub stiffness: f64,
    /// Tangential stiffness, N/m.
    pub shear_stiffness: f64,
    /// Gap at the start of the step, m (negative is overlap).
    pub gap: f64,
    /// Tangential offset from the stick anchor at the start of the step, m.
    pub offset: Vec3,
    /// Friction coefficient in force during this step.
    pub mu: f64,
    /// Normal impulse of the pass before, N s; the friction bound is `mu` times it.
    pub lagged: f64,
    /// Result: normal impulse, N s.
    pub normal_impulse: f64,
    /// Result: tangential impulse on `a`, N s.
    pub shear_impulse: Vec3,
    /// Result: relative velocity, m/s.
    pub velocity: Vec3,
    /// Result: whether the friction bound was reached.
    pub slipping: bool,
}

/// A whole problem; buffers are reused between steps.
#[derive(Clone, Debug, Default)]
pub struct Problem {
    /// Time step, s.
    pub dt: f64,
    /// Dissipation time of the contact springs, s.
    pub tau: f64,
    /// Blocks.
    pub blocks: Vec<Block>,
    /// Rigid frames that points refer to.
    pub screws: Vec<Screw>,
    /// Patches.
    pub patches: Vec<Patch>,
    /// Points of all patches.
    pub points: Vec<Point>,
    /// Scalar rows.
    pub scalars: Vec<Scalar>,
}

impl Problem {
    /// Forgets everything but the allocations.
    pub fn clear(&mut self, dt: f64, tau: f64) {
        self.dt = dt;
        self.tau = tau;
        self.blocks.clear();
        self.screws.clear();
        self.patches.clear();
        self.points.clear();
        self.scalars.clear();
    }

    /// The block that an endpoint moves with.
    pub fn block_of(&self, end: &Endpoint) -> Option<usize> {
        match end {
            Endpoint::Known => None,
            Endpoint::Nodes { block, .. } => Some(*block),
            Endpoint::Screw(screw) => Some(self.screws[*screw].block),
        }
    }
}
