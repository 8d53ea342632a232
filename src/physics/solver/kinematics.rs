//! Kinematics of contact points: maps between velocities of blocks, of endpoints and of points, and their transposes.
//!
//! An endpoint has *local coordinates*: three velocities per node, or linear and angular velocity of a frame. Points
//! are linear in them, so gradient and Hessian of a cluster are summed in local coordinates first and scattered once.

use wide::f64x4;

use super::{
    lanes::{PointPack, Vec3x4},
    problem::{ContactCluster, ContactPoint, ContactProblem, Endpoint},
};
use softvt_geometry::{Mat3, Vec3};

/// Largest number of local coordinates of a cluster: two endpoints of eight nodes.
const MAX_LOCAL: usize = 48;

/// Hessian of a cluster in local coordinates (3 per node, 6 per frame), dense.
#[derive(Clone, Debug)]
pub(super) struct ClusterHessian {
    size_a: usize,
    size: usize,
    /// Column-major lower triangle of side `MAX_LOCAL`.
    hessian: Vec<f64>,
}

impl Default for ClusterHessian {
    fn default() -> Self {
        Self { size_a: 0, size: 0, hessian: vec![0.0; MAX_LOCAL * MAX_LOCAL] }
    }
}

/// Number of local coordinates.
fn local_size(end: &Endpoint) -> usize {
    match end {
        Endpoint::Known => 0,
        Endpoint::Nodes { count, .. } => 3 * count,
        Endpoint::Frame(_) => 6,
    }
}

/// Velocities of an endpoint's local coordinates, or impulses on them: one vector per node, or the linear and the
/// angular part of a frame.
type LocalVectors = [Vec3; 8];

impl ContactProblem {
    /// Velocities of an endpoint's local coordinates.
    fn endpoint_velocities(&self, end: &Endpoint, v: &[f64]) -> LocalVectors {
        let mut u = [Vec3::zeros(); 8];
        match end {
            Endpoint::Known => {}
            Endpoint::Nodes { block, at, count } => {
                for (u, at) in u.iter_mut().zip(&at[..*count]) {
                    *u = Vec3::from_column_slice(&v[self.blocks[*block].offset + *at as usize..][..3]);
                }
            }
            Endpoint::Frame(frame) => {
                let frame = &self.frames[*frame];
                let start = self.blocks[frame.block].offset;
                for (column, v) in frame.jacobian.chunks_exact(6).zip(&v[start..]) {
                    u[0] += Vec3::new(column[0], column[1], column[2]) * *v;
                    u[1] += Vec3::new(column[3], column[4], column[5]) * *v;
                }
            }
        }
        u
    }

    /// Velocities of the endpoints of a cluster, where `v` are those of its island.
    pub(super) fn cluster_motion(&self, cluster: &ContactCluster, v: &[f64]) -> ClusterMotion {
        ClusterMotion {
            a: EndpointMotion::new(self, &cluster.a, v),
            b: EndpointMotion::new(self, &cluster.b, v),
        }
    }

    /// Adds `sign` times the impulses on an endpoint's local coordinates to the gradient:
    /// the transpose of [`Self::endpoint_velocities`].
    fn scatter_impulses(&self, end: &Endpoint, sign: f64, lanes: &[Vec3x4; 8], gradient: &mut [f64]) {
        let local = |i: usize| lanes[i].sum();
        match end {
            Endpoint::Known => {}
            Endpoint::Nodes { block, at, count } => {
                for (i, at) in at[..*count].iter().enumerate() {
                    let start = self.blocks[*block].offset + *at as usize;
                    gradient[start..start + 3]
                        .iter_mut()
                        .zip(local(i).iter())
                        .for_each(|(g, f)| *g += sign * f);
                }
            }
            Endpoint::Frame(frame) => {
                let frame = &self.frames[*frame];
                let (start, linear, angular) = (self.blocks[frame.block].offset, local(0), local(1));
                for (column, g) in frame.jacobian.chunks_exact(6).zip(&mut gradient[start..]) {
                    let along = Vec3::new(column[0], column[1], column[2]).dot(&linear);
                    *g += sign * (along + Vec3::new(column[3], column[4], column[5]).dot(&angular));
                }
            }
        }
    }

    /// The 3×3 Jacobian blocks from an endpoint's local coordinates to a point, and their number.
    fn jacobian_blocks(&self, end: &Endpoint, weights: &[f64; 8], p: &Vec3) -> ([JacobianBlock; 8], usize) {
        let mut blocks = weights.map(JacobianBlock::Scale);
        let count = match end {
            Endpoint::Known => 0,
            Endpoint::Nodes { count, .. } => *count,
            Endpoint::Frame(frame) => {
                blocks[0] = JacobianBlock::Scale(1.0);
                blocks[1] = JacobianBlock::Arm(p - self.frames[*frame].origin);
                2
            }
        };
        (blocks, count)
    }
}

/// Motion of an endpoint, of which points take the velocities.
#[derive(Clone, Copy, Debug)]
pub(super) enum EndpointMotion {
    Known,
    /// Velocities of the four nodes of a face. They are apart from the eight of a voxel, so that the sums are unrolled.
    Face([Vec3; 4]),
    Voxel(LocalVectors),
    Frame {
        linear: Vec3,
        angular: Vec3,
        origin: Vec3,
    },
}

impl EndpointMotion {
    fn new(problem: &ContactProblem, end: &Endpoint, v: &[f64]) -> Self {
        let u = problem.endpoint_velocities(end, v);
        match end {
            Endpoint::Known => Self::Known,
            Endpoint::Nodes { count: 4, .. } => Self::Face([u[0], u[1], u[2], u[3]]),
            Endpoint::Nodes { .. } => Self::Voxel(u),
            Endpoint::Frame(frame) => {
                Self::Frame { linear: u[0], angular: u[1], origin: problem.frames[*frame].origin }
            }
        }
    }

    /// Velocities of points at `p` with these weights of the nodes.
    #[inline(always)]
    fn velocity(&self, weights: &[f64x4; 8], p: Vec3x4) -> Vec3x4 {
        match self {
            Self::Known => Vec3x4::default(),
            Self::Face(u) => weighted_sum(u, weights),
            Self::Voxel(u) => weighted_sum(u, weights),
            Self::Frame { linear, angular, origin } => {
                Vec3x4::splat(linear) + Vec3x4::splat(angular).cross(p - Vec3x4::splat(origin))
            }
        }
    }

    /// Adds impulses at points to the impulses on the local coordinates: the transpose of [`Self::velocity`].
    #[inline(always)]
    fn add_impulse(&self, local: &mut [Vec3x4; 8], weights: &[f64x4; 8], p: Vec3x4, impulse: Vec3x4) {
        match self {
            Self::Known => {}
            Self::Face(_) => (0..4).for_each(|i| local[i] += impulse * weights[i]),
            Self::Voxel(_) => (0..8).for_each(|i| local[i] += impulse * weights[i]),
            Self::Frame { origin, .. } => {
                local[0] += impulse;
                local[1] += (p - Vec3x4::splat(origin)).cross(impulse);
            }
        }
    }
}

#[inline(always)]
fn weighted_sum<const N: usize>(u: &[Vec3; N], weights: &[f64x4; 8]) -> Vec3x4 {
    (1..N).fold(Vec3x4::splat(&u[0]) * weights[0], |sum, i| sum + Vec3x4::splat(&u[i]) * weights[i])
}

/// Motion of the two endpoints of a cluster.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClusterMotion {
    a: EndpointMotion,
    b: EndpointMotion,
}

impl ClusterMotion {
    /// Relative velocities of a pack of its points.
    #[inline(always)]
    pub(super) fn velocities(&self, points: &PointPack) -> Vec3x4 {
        let on_a = self.a.velocity(&points.weights_a, points.p);
        on_a - self.b.velocity(&points.weights_b, points.p) - points.drift
    }
}

/// Impulses on the local coordinates of the two endpoints of a cluster, by lane of the points.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ClusterImpulses {
    a: [Vec3x4; 8],
    b: [Vec3x4; 8],
}

impl ClusterImpulses {
    /// Adds the impulses of a pack of points on `a`; those on `b` are opposite.
    #[inline(always)]
    pub(super) fn add(&mut self, motion: &ClusterMotion, points: &PointPack, impulse: Vec3x4) {
        motion.a.add_impulse(&mut self.a, &points.weights_a, points.p, impulse);
        motion.b.add_impulse(&mut self.b, &points.weights_b, points.p, impulse);
    }

    /// Subtracts the impulses on both endpoints from the gradient.
    pub(super) fn scatter(&self, problem: &ContactProblem, cluster: &ContactCluster, gradient: &mut [f64]) {
        problem.scatter_impulses(&cluster.a, -1.0, &self.a, gradient);
        problem.scatter_impulses(&cluster.b, 1.0, &self.b, gradient);
    }
}

/// A 3×3 block of the Jacobian from local coordinates to a point.
#[derive(Clone, Copy)]
enum JacobianBlock {
    /// `w I`: a node of weight `w`, or the origin of a frame.
    Scale(f64),
    /// `−[r]×`: the angular velocity of a frame at the lever arm `r`, m.
    Arm(Vec3),
}

impl JacobianBlock {
    /// `G · L`.
    fn after(&self, g: &Mat3) -> Mat3 {
        match self {
            Self::Scale(w) => g * *w,
            Self::Arm(r) => -(g * r.cross_matrix()),
        }
    }

    /// `Lᵀ · M`.
    fn before(&self, m: &Mat3) -> Mat3 {
        match self {
            Self::Scale(w) => m * *w,
            Self::Arm(r) => r.cross_matrix() * m,
        }
    }
}

impl ClusterHessian {
    /// Empties the Hessian for a cluster.
    pub(super) fn start(&mut self, cluster: &ContactCluster) {
        self.size_a = local_size(&cluster.a);
        self.size = self.size_a + local_size(&cluster.b);
        for column in 0..self.size {
            self.hessian[column * MAX_LOCAL..column * MAX_LOCAL + self.size].fill(0.0);
        }
    }

    /// Adds the curvature of one point of a cluster.
    pub(super) fn add(
        &mut self,
        problem: &ContactProblem,
        cluster: &ContactCluster,
        point: &ContactPoint,
        m: &Mat3,
    ) {
        let (left, na) = problem.jacobian_blocks(&cluster.a, &point.weights_a, &point.p);
        let (right, nb) = problem.jacobian_blocks(&cluster.b, &point.weights_b, &point.p);
        for j in 0..na {
            let column = left[j].after(m);
            (j..na).for_each(|i| self.add_block(3 * i, 3 * j, &left[i].before(&column)));
            (0..nb).for_each(|i| self.add_block(self.size_a + 3 * i, 3 * j, &-right[i].before(&column)));
        }
        for j in 0..nb {
            let column = right[j].after(m);
            (j..nb).for_each(|i| {
                self.add_block(self.size_a + 3 * i, self.size_a + 3 * j, &right[i].before(&column))
            });
        }
    }

    fn add_block(&mut self, row: usize, column: usize, m: &Mat3) {
        for c in 0..3 {
            let start = (column + c) * MAX_LOCAL + row;
            self.hessian[start..start + 3].iter_mut().zip(m.column(c).iter()).for_each(|(h, m)| *h += m);
        }
    }
}

/// Jacobian from an island's velocities to the local coordinates of a cluster: one sparse row per coordinate.
#[derive(Clone, Debug, Default)]
pub(super) struct DofMap {
    /// (Index in the island, coefficient) of the nonzero entries.
    rows: Vec<Vec<(u32, f64)>>,
    used: usize,
}

impl DofMap {
    /// Sets the map for a cluster.
    pub(super) fn set(&mut self, problem: &ContactProblem, cluster: &ContactCluster) {
        self.used = 0;
        self.push(problem, &cluster.a);
        self.push(problem, &cluster.b);
    }

    fn next(&mut self) -> &mut Vec<(u32, f64)> {
        if self.used == self.rows.len() {
            self.rows.push(Vec::new());
        }
        self.used += 1;
        let row = &mut self.rows[self.used - 1];
        row.clear();
        row
    }

    fn push(&mut self, problem: &ContactProblem, end: &Endpoint) {
        match end {
            Endpoint::Known => {}
            Endpoint::Nodes { block, at, count } => {
                for (start, i) in at[..*count].iter().flat_map(|start| (0..3).map(move |i| (*start, i))) {
                    let index = problem.blocks[*block].offset as u32 + start + i;
                    self.next().push((index, 1.0));
                }
            }
            Endpoint::Frame(frame) => {
                let frame = &problem.frames[*frame];
                for row in 0..6 {
                    let start = problem.blocks[frame.block].offset;
                    let entries = frame.jacobian.iter().skip(row).step_by(6).enumerate();
                    self.next().extend(
                        entries.filter(|(_, j)| **j != 0.0).map(|(column, j)| ((start + column) as u32, *j)),
                    );
                }
            }
        }
    }

    /// Adds the Hessian of the cluster to the island's (side `n`, lower triangle).
    pub(super) fn scatter(&self, cluster: &ClusterHessian, hessian: &mut [f64], n: usize) {
        for c in 0..self.used {
            for r in 0..self.used {
                let value = cluster.hessian[r.min(c) * MAX_LOCAL + r.max(c)];
                for (column, jc) in &self.rows[c] {
                    for (row, jr) in self.rows[r].iter().filter(|(row, _)| row >= column) {
                        hessian[*column as usize * n + *row as usize] += jr * jc * value;
                    }
                }
            }
        }
    }
}
