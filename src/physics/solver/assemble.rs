//! Velocities of points and the gather and scatter between points and blocks.

use super::problem::{ContactPoint, ContactProblem, Endpoint};
use crate::geometry::{Mat3, Vec3};

/// Rows of a cluster's local system: up to two endpoints of eight nodes.
const MAX_LOCAL: usize = 48;

/// ClusterHessian Hessian of a cluster: the endpoints' own coordinates (3 a node, 6 a frame), dense.
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

fn size_of(end: &Endpoint) -> usize {
    match end {
        Endpoint::Known => 0,
        Endpoint::Nodes { count, .. } => 3 * count,
        Endpoint::Frame(_) => 6,
    }
}

/// Velocities of an endpoint's own coordinates, gathered once a cluster.
pub(super) fn gather(problem: &ContactProblem, offsets: &[usize], end: &Endpoint, v: &[f64]) -> [Vec3; 8] {
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
pub(super) fn velocity(
    problem: &ContactProblem,
    end: &Endpoint,
    u: &[Vec3; 8],
    weights: &[f64; 8],
    p: &Vec3,
) -> Vec3 {
    match end {
        Endpoint::Known => Vec3::zeros(),
        // Faces have four nodes, voxels eight: with the number known, the sums are unrolled.
        Endpoint::Nodes { count: 4, .. } => mean::<4>(u, weights),
        Endpoint::Nodes { .. } => mean::<8>(u, weights),
        Endpoint::Frame(frame) => u[0] + u[1].cross(&(p - problem.frames[*frame].origin)),
    }
}

#[inline]
fn mean<const N: usize>(u: &[Vec3; 8], weights: &[f64; 8]) -> Vec3 {
    (1..N).fold(u[0] * weights[0], |sum, i| sum + u[i] * weights[i])
}

/// Adds an impulse at a point to the forces on an endpoint's own coordinates (the transpose of [`velocity`]).
#[inline]
pub(super) fn pull(
    problem: &ContactProblem,
    end: &Endpoint,
    force: &mut [Vec3; 8],
    weights: &[f64; 8],
    (p, impulse): (&Vec3, &Vec3),
) {
    match end {
        Endpoint::Known => {}
        Endpoint::Nodes { count: 4, .. } => (0..4).for_each(|i| force[i] += impulse * weights[i]),
        Endpoint::Nodes { .. } => (0..8).for_each(|i| force[i] += impulse * weights[i]),
        Endpoint::Frame(frame) => {
            force[0] += impulse;
            force[1] += (p - problem.frames[*frame].origin).cross(impulse);
        }
    }
}

/// Adds `sign` times the forces on an endpoint's own coordinates to the gradient (the transpose of [`gather`]).
pub(super) fn spread(
    problem: &ContactProblem,
    offsets: &[usize],
    end: &Endpoint,
    (sign, force): (f64, &[Vec3; 8]),
    gradient: &mut [f64],
) {
    match end {
        Endpoint::Known => {}
        Endpoint::Nodes { block, at, count } => {
            for (f, at) in force.iter().zip(&at[..*count]) {
                let start = offsets[*block] + *at as usize;
                gradient[start..start + 3].iter_mut().zip(f.iter()).for_each(|(g, f)| *g += sign * f);
            }
        }
        Endpoint::Frame(frame) => {
            let frame = &problem.frames[*frame];
            let start = offsets[frame.block];
            for (column, g) in frame.jacobian.chunks_exact(6).zip(&mut gradient[start..]) {
                let along = Vec3::new(column[0], column[1], column[2]).dot(&force[0]);
                *g += sign * (along + Vec3::new(column[3], column[4], column[5]).dot(&force[1]));
            }
        }
    }
}

/// The 3 × 3 pieces by which an endpoint's coordinates move a point: `w I` for nodes, `I` and `−[r]×` for a frame.
fn pieces(
    problem: &ContactProblem,
    end: &Endpoint,
    weights: &[f64; 8],
    p: &Vec3,
    out: &mut [Piece; 8],
) -> usize {
    match end {
        Endpoint::Known => 0,
        Endpoint::Nodes { count, .. } => {
            (0..*count).for_each(|i| out[i] = Piece::Scale(weights[i]));
            *count
        }
        Endpoint::Frame(frame) => {
            out[0] = Piece::Scale(1.0);
            out[1] = Piece::Arm(p - problem.frames[*frame].origin);
            2
        }
    }
}

#[derive(Clone, Copy)]
enum Piece {
    Scale(f64),
    Arm(Vec3),
}

impl Piece {
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
    /// Empties the local system for a cluster between `a` and `b`.
    pub(super) fn start(&mut self, a: &Endpoint, b: &Endpoint) {
        self.size_a = size_of(a);
        self.size = self.size_a + size_of(b);
        for column in 0..self.size {
            self.hessian[column * MAX_LOCAL..column * MAX_LOCAL + self.size].fill(0.0);
        }
    }

    /// Adds one point's curvature.
    pub(super) fn add(
        &mut self,
        problem: &ContactProblem,
        a: &Endpoint,
        b: &Endpoint,
        point: &ContactPoint,
        curvature: &Mat3,
    ) {
        let mut left = [Piece::Scale(0.0); 8];
        let mut right = [Piece::Scale(0.0); 8];
        let na = pieces(problem, a, &point.weights_a, &point.p, &mut left);
        let nb = pieces(problem, b, &point.weights_b, &point.p, &mut right);
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

    /// Adds the local system to the island's Hessian (side `n`, lower triangle).
    pub(super) fn scatter(&self, map: &DofMap, hessian: &mut [f64], n: usize) {
        map.scatter_matrix(|r, c| self.hessian[r.min(c) * MAX_LOCAL + r.max(c)], hessian, n);
    }
}

/// How a cluster's local coordinates read the island's velocities: each coordinate is a sparse row.
#[derive(Clone, Debug, Default)]
pub(super) struct DofMap {
    /// Per local coordinate: (island index, coefficient).
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
