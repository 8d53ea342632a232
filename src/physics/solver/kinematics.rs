//! Kinematics of contact points: maps between velocities of blocks, of endpoints and of points, and their transposes.
//!
//! An endpoint has *local coordinates*: three velocities per node, or linear and angular velocity of a frame. Points
//! are linear in them, so gradient and Hessian of a cluster are summed in local coordinates first and scattered once.

use super::problem::{ContactCluster, ContactPoint, ContactProblem, Endpoint};
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
pub(super) type LocalVectors = [Vec3; 8];

impl ContactProblem {
    /// Velocities of an endpoint's local coordinates.
    pub(super) fn endpoint_velocities(&self, end: &Endpoint, v: &[f64]) -> LocalVectors {
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

    /// Velocity of the point at `p` of an endpoint.
    #[inline]
    fn point_velocity(&self, end: &Endpoint, u: &LocalVectors, weights: &[f64; 8], p: &Vec3) -> Vec3 {
        match end {
            Endpoint::Known => Vec3::zeros(),
            // Faces have four nodes, voxels eight: with constant counts, the sums are unrolled.
            Endpoint::Nodes { count: 4, .. } => mean::<4>(u, weights),
            Endpoint::Nodes { .. } => mean::<8>(u, weights),
            Endpoint::Frame(frame) => u[0] + u[1].cross(&(p - self.frames[*frame].origin)),
        }
    }

    /// The points of a cluster with their relative velocities, where `v` are the velocities of its island.
    #[inline]
    pub(super) fn point_velocities<'a>(
        &'a self,
        cluster: &'a ContactCluster,
        v: &[f64],
    ) -> impl Iterator<Item = (&'a ContactPoint, Vec3)> + use<'a> {
        let ua = self.endpoint_velocities(&cluster.a, v);
        let ub = self.endpoint_velocities(&cluster.b, v);
        self.points[cluster.first..cluster.last].iter().map(move |point| {
            let on_a = self.point_velocity(&cluster.a, &ua, &point.weights_a, &point.p);
            (point, on_a - self.point_velocity(&cluster.b, &ub, &point.weights_b, &point.p) - point.drift)
        })
    }

    /// Adds an impulse at a point to the impulses on an endpoint's local coordinates: the transpose of
    /// [`Self::point_velocity`].
    #[inline]
    pub(super) fn add_point_impulse(
        &self,
        end: &Endpoint,
        local: &mut LocalVectors,
        weights: &[f64; 8],
        p: &Vec3,
        impulse: &Vec3,
    ) {
        match end {
            Endpoint::Known => {}
            Endpoint::Nodes { count: 4, .. } => (0..4).for_each(|i| local[i] += impulse * weights[i]),
            Endpoint::Nodes { .. } => (0..8).for_each(|i| local[i] += impulse * weights[i]),
            Endpoint::Frame(frame) => {
                local[0] += impulse;
                local[1] += (p - self.frames[*frame].origin).cross(impulse);
            }
        }
    }

    /// Adds `sign` times the impulses on an endpoint's local coordinates to the gradient:
    /// the transpose of [`Self::endpoint_velocities`].
    pub(super) fn scatter_impulses(
        &self,
        end: &Endpoint,
        sign: f64,
        local: &LocalVectors,
        gradient: &mut [f64],
    ) {
        match end {
            Endpoint::Known => {}
            Endpoint::Nodes { block, at, count } => {
                for (f, at) in local.iter().zip(&at[..*count]) {
                    let start = self.blocks[*block].offset + *at as usize;
                    gradient[start..start + 3].iter_mut().zip(f.iter()).for_each(|(g, f)| *g += sign * f);
                }
            }
            Endpoint::Frame(frame) => {
                let frame = &self.frames[*frame];
                let start = self.blocks[frame.block].offset;
                for (column, g) in frame.jacobian.chunks_exact(6).zip(&mut gradient[start..]) {
                    let along = Vec3::new(column[0], column[1], column[2]).dot(&local[0]);
                    *g += sign * (along + Vec3::new(column[3], column[4], column[5]).dot(&local[1]));
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

#[inline]
fn mean<const N: usize>(u: &LocalVectors, weights: &[f64; 8]) -> Vec3 {
    (1..N).fold(u[0] * weights[0], |sum, i| sum + u[i] * weights[i])
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
