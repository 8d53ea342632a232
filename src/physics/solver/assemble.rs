//! Kinematics of contact points: maps between velocities of blocks, of endpoints and of points, and their transposes.
//!
//! An endpoint has *local coordinates*: three velocities per node, or linear and angular velocity of a frame. Points
//! are linear in them, so gradient and Hessian of a cluster are summed in local coordinates first and scattered once.

use super::problem::{ContactPoint, ContactProblem, Endpoint};
use crate::geometry::{Mat3, Vec3};

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

/// Velocities of an endpoint's local coordinates.
pub(super) fn endpoint_velocities(
    problem: &ContactProblem,
    offsets: &[usize],
    end: &Endpoint,
    v: &[f64],
) -> [Vec3; 8] {
    let mut u = [Vec3::zeros(); 8];
    match end {
        Endpoint::Known => {}
        Endpoint::Nodes { block, at, count } => {
            for i in 0..*count {
                let start = offsets[*block] + at[i] as usize;
                u[i] = Vec3::new(v[start], v[start + 1], v[start + 2]);
            }
        }
        Endpoint::Frame(frame) => {
            let frame = &problem.frames[*frame];
            let start = offsets[frame.block];
            for (column, v) in frame.jacobian.chunks_exact(6).zip(&v[start..]) {
                u[0] += Vec3::new(column[0], column[1], column[2]) * *v;
                u[1] += Vec3::new(column[3], column[4], column[5]) * *v;
            }
        }
    }
    u
}

/// Velocity of a point on an endpoint.
#[inline]
pub(super) fn point_velocity(
    problem: &ContactProblem,
    end: &Endpoint,
    u: &[Vec3; 8],
    weights: &[f64; 8],
    p: &Vec3,
) -> Vec3 {
    match end {
        Endpoint::Known => Vec3::zeros(),
        // Faces have four nodes, voxels eight: with constant counts, the sums are unrolled.
        Endpoint::Nodes { count: 4, .. } => mean::<4>(u, weights),
        Endpoint::Nodes { .. } => mean::<8>(u, weights),
        Endpoint::Frame(frame) => u[0] + u[1].cross(&(p - problem.frames[*frame].origin)),
    }
}

#[inline]
fn mean<const N: usize>(u: &[Vec3; 8], weights: &[f64; 8]) -> Vec3 {
    (1..N).fold(u[0] * weights[0], |sum, i| sum + u[i] * weights[i])
}

/// Adds an impulse at a point to the impulses on an endpoint's local coordinates: the transpose of [`point_velocity`].
#[inline]
pub(super) fn add_point_impulse(
    problem: &ContactProblem,
    end: &Endpoint,
    local: &mut [Vec3; 8],
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
            local[1] += (p - problem.frames[*frame].origin).cross(impulse);
        }
    }
}

/// Adds `sign` times the impulses on an endpoint's local coordinates to the gradient:
/// the transpose of [`endpoint_velocities`].
pub(super) fn scatter_impulses(
    problem: &ContactProblem,
    offsets: &[usize],
    end: &Endpoint,
    sign: f64,
    local: &[Vec3; 8],
    gradient: &mut [f64],
) {
    match end {
        Endpoint::Known => {}
        Endpoint::Nodes { block, at, count } => {
            for (f, at) in local.iter().zip(&at[..*count]) {
                let start = offsets[*block] + *at as usize;
                gradient[start..start + 3].iter_mut().zip(f.iter()).for_each(|(g, f)| *g += sign * f);
            }
        }
        Endpoint::Frame(frame) => {
            let frame = &problem.frames[*frame];
            let start = offsets[frame.block];
            for (column, g) in frame.jacobian.chunks_exact(6).zip(&mut gradient[start..]) {
                let along = Vec3::new(column[0], column[1], column[2]).dot(&local[0]);
                *g += sign * (along + Vec3::new(column[3], column[4], column[5]).dot(&local[1]));
            }
        }
    }
}

/// Writes the 3×3 Jacobian blocks from an endpoint's local coordinates to a point, and returns their number.
fn jacobian_blocks(
    problem: &ContactProblem,
    end: &Endpoint,
    weights: &[f64; 8],
    p: &Vec3,
    out: &mut [JacobianBlock; 8],
) -> usize {
    match end {
        Endpoint::Known => 0,
        Endpoint::Nodes { count, .. } => {
            (0..*count).for_each(|i| out[i] = JacobianBlock::Scale(weights[i]));
            *count
        }
        Endpoint::Frame(frame) => {
            out[0] = JacobianBlock::Scale(1.0);
            out[1] = JacobianBlock::Arm(p - problem.frames[*frame].origin);
            2
        }
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
    /// Empties the Hessian for a cluster between `a` and `b`.
    pub(super) fn start(&mut self, a: &Endpoint, b: &Endpoint) {
        self.size_a = local_size(a);
        self.size = self.size_a + local_size(b);
        for column in 0..self.size {
            self.hessian[column * MAX_LOCAL..column * MAX_LOCAL + self.size].fill(0.0);
        }
    }

    /// Adds the curvature of one point.
    pub(super) fn add(
        &mut self,
        problem: &ContactProblem,
        a: &Endpoint,
        b: &Endpoint,
        point: &ContactPoint,
        curvature: &Mat3,
    ) {
        let mut left = [JacobianBlock::Scale(0.0); 8];
        let mut right = [JacobianBlock::Scale(0.0); 8];
        let na = jacobian_blocks(problem, a, &point.weights_a, &point.p, &mut left);
        let nb = jacobian_blocks(problem, b, &point.weights_b, &point.p, &mut right);
        for j in 0..na {
            let column = left[j].after(curvature);
            (j..na).for_each(|i| self.add_block(3 * i, 3 * j, &left[i].before(&column)));
            (0..nb).for_each(|i| self.add_block(self.size_a + 3 * i, 3 * j, &-right[i].before(&column)));
        }
        for j in 0..nb {
            let column = right[j].after(curvature);
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

    /// Adds the local Hessian to the island's (side `n`, lower triangle).
    pub(super) fn scatter(&self, map: &DofMap, hessian: &mut [f64], n: usize) {
        map.scatter_matrix(|r, c| self.hessian[r.min(c) * MAX_LOCAL + r.max(c)], hessian, n);
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
    pub(super) fn set(&mut self, problem: &ContactProblem, offsets: &[usize], a: &Endpoint, b: &Endpoint) {
        self.used = 0;
        [a, b].into_iter().for_each(|end| self.push(problem, offsets, end));
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

    fn push(&mut self, problem: &ContactProblem, offsets: &[usize], end: &Endpoint) {
        match end {
            Endpoint::Known => {}
            Endpoint::Nodes { block, at, count } => {
                for (start, i) in at[..*count].iter().flat_map(|start| (0..3).map(move |i| (*start, i))) {
                    let index = offsets[*block] as u32 + start + i;
                    self.next().push((index, 1.0));
                }
            }
            Endpoint::Frame(frame) => {
                let frame = &problem.frames[*frame];
                for row in 0..6 {
                    let start = offsets[frame.block];
                    let entries = frame.jacobian.iter().skip(row).step_by(6).enumerate();
                    self.next().extend(
                        entries.filter(|(_, j)| **j != 0.0).map(|(column, j)| ((start + column) as u32, *j)),
                    );
                }
            }
        }
    }

    fn scatter_matrix(&self, local: impl Fn(usize, usize) -> f64, global: &mut [f64], n: usize) {
        for c in 0..self.used {
            for r in 0..self.used {
                let value = local(r, c);
                for (column, jc) in &self.rows[c] {
                    for (row, jr) in self.rows[r].iter().filter(|(row, _)| row >= column) {
                        global[*column as usize * n + *row as usize] += jr * jc * value;
                    }
                }
            }
        }
    }
}
