//! Data of one solve.

use crate::ids::BodyId;
use softvt_geometry::Vec3;

/// A block of generalised velocities with its own momentum equation `A v = r` (a *clique* of Drake's SAP).
///
/// `A` is the velocity system of one body: for a soft body the Schur complement on its retained nodes, for a rigid
/// body its 6×6 inertia, for an articulation its mass matrix. It must be symmetric positive definite; the solver does
/// not check this, but fails to converge otherwise.
#[derive(Clone, Debug, Default)]
pub(crate) struct VelocityBlock {
    /// Number of velocities of the block.
    pub dim: usize,
    /// `A`, `dim × dim`, column-major. Only the lower triangle is read.
    pub matrix: Vec<f64>,
    /// `r`, `dim` momenta: without contact the solution is `A⁻¹ r`.
    pub rhs: Vec<f64>,
    /// Initial guess, and the solution afterwards; `dim` velocities.
    pub v: Vec<f64>,
    /// Meaning of the velocities.
    pub identity: BlockIdentity,
    /// Index of its first velocity in the vectors of its island; set by the solver.
    pub offset: usize,
}

/// Meaning of the velocities of a block. Blocks of equal identity and size in two problems describe the same
/// coordinates, and a factored Hessian is kept from one to the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct BlockIdentity {
    /// The body that moves; an articulation is named by its first link.
    pub body: BodyId,
    /// Number of times that the body has changed its coordinates.
    pub version: u64,
}

/// Jacobian of a rigid frame: its motion as a linear function of the velocities of one block.
#[derive(Clone, Debug)]
pub(crate) struct FrameJacobian {
    /// Index of the block that moves the frame.
    pub block: usize,
    /// `6 × dim`, column-major: linear velocity of the frame's origin, then angular velocity, world.
    pub jacobian: Vec<f64>,
    /// The frame's origin, m, world.
    pub origin: Vec3,
}

/// One side of a contact cluster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Endpoint {
    /// A body whose velocity is known; it is part of the points' `drift`.
    Known,
    /// A weighted mean of up to eight nodes of a block; each point has the weights, `weights_a` or `weights_b`.
    Nodes {
        /// Index of the soft body's block.
        block: usize,
        /// Index of the first of three velocities of each node.
        at: [u32; 8],
        /// Number of nodes used: 4 for a face, 8 for a voxel.
        count: usize,
    },
    /// Points of a rigid frame, by its index in [`ContactProblem::frames`].
    Frame(usize),
}

impl Endpoint {
    /// Number of nodes that points have weights of.
    pub(super) fn node_count(&self) -> usize {
        match self {
            Self::Nodes { count, .. } => *count,
            Self::Known | Self::Frame(_) => 0,
        }
    }
}

/// Contact points between the same two endpoints.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactCluster {
    /// The side that the normals point to.
    pub a: Endpoint,
    /// The side that the normals point away from.
    pub b: Endpoint,
    /// Index of the first of its points.
    pub first: usize,
    /// One past the last point.
    pub last: usize,
}

/// One contact point. Its relative velocity is `v_a − v_b − drift`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ContactPoint {
    /// Weights of `a`'s nodes.
    pub weights_a: [f64; 8],
    /// Weights of `b`'s nodes.
    pub weights_b: [f64; 8],
    /// Position, m, world.
    pub p: Vec3,
    /// Unit normal from `b` to `a`, world.
    pub normal: Vec3,
    /// Known part of `b`'s velocity (or of `a`'s, negated), m/s, world.
    pub drift: Vec3,
    /// Normal stiffness, N/m.
    pub stiffness: f64,
    /// Tangential stiffness, N/m.
    pub shear_stiffness: f64,
    /// Gap at the start of the step, m; negative is overlap.
    pub gap: f64,
    /// Tangential offset from the stick anchor at the start of the step, m, world.
    pub offset: Vec3,
    /// Friction coefficient of this step.
    pub mu: f64,
    /// True if the two sides are bonded: the point also pulls, and its tangential spring has no bound.
    pub is_bonded: bool,
    /// Normal impulse of the previous pass, N s; the friction bound is `mu` times it. At the start of a solve an
    /// estimate from the last step.
    pub previous_normal_impulse: f64,
    /// Result: normal impulse, N s.
    pub normal_impulse: f64,
    /// Result: tangential impulse on `a`, N s, world.
    pub shear_impulse: Vec3,
    /// Result: relative velocity, m/s, world.
    pub velocity: Vec3,
    /// Result: true if the friction bound was reached.
    pub is_slipping: bool,
}

/// A spring–damper with a force limit on one velocity of one block: a joint drive, a stop, a speed limit, dry friction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScalarConstraint {
    /// Index of the block with the velocity.
    pub block: usize,
    /// Index of the velocity in the block.
    pub index: usize,
    /// Stiffness (N/m or N m/rad).
    pub stiffness: f64,
    /// Damping (N s/m or N m s/rad).
    pub damping: f64,
    /// Target minus position at the start of the step (m or rad).
    pub error: f64,
    /// Target velocity (m/s or rad/s) of the damping.
    pub target_velocity: f64,
    /// Smallest force (N or N m); 0 for a lower stop.
    pub min_force: f64,
    /// Largest force (N or N m); 0 for an upper stop.
    pub max_force: f64,
}

impl ScalarConstraint {
    /// A constraint without force limits that exerts no force yet.
    pub(crate) fn free(block: usize, index: usize) -> Self {
        Self {
            block,
            index,
            stiffness: 0.0,
            damping: 0.0,
            error: 0.0,
            target_velocity: 0.0,
            min_force: f64::NEG_INFINITY,
            max_force: f64::INFINITY,
        }
    }
}

/// A whole problem; its buffers are reused between steps.
#[derive(Clone, Debug, Default)]
pub(crate) struct ContactProblem {
    /// Time step, s.
    pub dt: f64,
    /// Dissipation time of the contact springs, s.
    pub dissipation_time: f64,
    /// Blocks without coupling, other than by contacts.
    pub blocks: Vec<VelocityBlock>,
    /// Jacobians of the rigid frames that endpoints refer to.
    pub frames: Vec<FrameJacobian>,
    /// Groups of points between the same two endpoints.
    pub clusters: Vec<ContactCluster>,
    /// Points of all clusters.
    pub points: Vec<ContactPoint>,
    /// Constraints on single velocities.
    pub constraints: Vec<ScalarConstraint>,
}

impl ContactProblem {
    /// Empties the problem, keeping its allocations.
    pub(crate) fn clear(&mut self, dt: f64, dissipation_time: f64) {
        self.dt = dt;
        self.dissipation_time = dissipation_time;
        self.blocks.clear();
        self.frames.clear();
        self.clusters.clear();
        self.points.clear();
        self.constraints.clear();
    }

    /// The velocities of a block, or values that belong to them, in a vector of its island.
    pub(super) fn range(&self, block: usize) -> std::ops::Range<usize> {
        let VelocityBlock { offset, dim, .. } = self.blocks[block];
        offset..offset + dim
    }

    /// The block that an endpoint moves with.
    pub(super) fn block_of(&self, end: &Endpoint) -> Option<usize> {
        match end {
            Endpoint::Known => None,
            Endpoint::Nodes { block, .. } => Some(*block),
            Endpoint::Frame(frame) => Some(self.frames[*frame].block),
        }
    }
}
