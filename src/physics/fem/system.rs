//! The velocity system of a soft body, `A = (1 + α dt) M + dt (dt + β) K`, reduced to the nodes in contact.
//!
//! `K = Σ R K₀ Rᵀ` is assembled and factored in the body's own turning frame, so a body that is carried or rotates
//! without changing shape keeps its factor; it is refilled when an element's rotation has moved by [`STALE_ROTATION`]
//! against the body, or when a new node comes into contact. The turning frame itself follows in steps of [`STALE_TURN`], so
//! that a body that is merely held needs not even be turned. A slightly old tangent changes no equilibrium: the force
//! is always evaluated exactly, `A` only says how the step answers it.

use super::body::{FemModel, FemState};
use crate::{
    geometry::{Mat3, Vec3},
    physics::sparse::{BlockMatrix, CholeskyFactor, SymbolicFactor},
};

/// Change of an element's rotation (Frobenius norm, about √2 × radians) that makes the factor be refilled.
const STALE_ROTATION: f64 = 0.04;
/// Change of the body's rotation (same norm) that makes the reduced matrix be turned again.
const STALE_TURN: f64 = 2e-3;
/// Steps for which a node stays kept after its last contact.
const KEEP_STEPS: u64 = 10;

/// Coefficients of the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepCoefficients {
    /// Time step, s.
    pub dt: f64,
    /// Mass-proportional damping, 1/s.
    pub rayleigh_mass: f64,
    /// Stiffness-proportional damping, s.
    pub rayleigh_stiffness: f64,
}

/// The factored system of one body.
#[derive(Clone, Debug)]
pub struct VelocitySystem {
    blocks: Blocks,
    plan: Option<SymbolicFactor>,
    factor: CholeskyFactor,
    factored: Vec<Mat3>,
    turn: Mat3,
    /// The Schur complement in the world, empty while it is lent out or has to be turned again.
    turned: Vec<f64>,
    coefficients: Option<StepCoefficients>,
    last_used: Vec<u64>,
    retained: Vec<u32>,
    retained_index: Vec<u32>,
    retained_version: u64,
    work: Vec<f64>,
    /// Factorisations done so far (for profiles and tests).
    pub factorizations: u64,
}

/// The matrix: diagonal blocks and, per node, blocks to its higher neighbours.
#[derive(Clone, Debug)]
struct Blocks {
    /// Places of the nodes in the voxel lattice.
    places: Vec<[i32; 3]>,
    neighbours: Vec<Vec<u32>>,
    slot: Vec<Vec<u32>>,
    diagonal: Vec<[f64; 9]>,
    off: Vec<[f64; 9]>,
    /// ContactRecord of each of the 36 corner pairs of each element; the top bit says "transposed", diagonal pairs hold the node.
    pairs: Vec<[u32; 36]>,
}

const TRANSPOSED: u32 = 1 << 31;

impl BlockMatrix for Blocks {
    fn column(&self, node: u32, visit: &mut dyn FnMut(u32, &[f64; 9], bool)) {
        visit(node, &self.diagonal[node as usize], false);
        for (&other, &slot) in self.neighbours[node as usize].iter().zip(&self.slot[node as usize]) {
            visit(other, &self.off[slot as usize], other < node);
        }
    }
}

impl Blocks {
    fn new(rest: &FemModel) -> Self {
        let nodes = rest.mesh.nodes.len();
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); nodes];
        for element in &rest.mesh.elements {
            for &a in element {
                neighbours[a as usize].extend(element.iter().filter(|&&b| b != a));
            }
        }
        neighbours.iter_mut().for_each(|list| {
            list.sort_unstable();
            list.dedup();
        });
        let mut count = 0;
        let mut slot: Vec<Vec<u32>> = neighbours.iter().map(|list| vec![0; list.len()]).collect();
        for a in 0..nodes {
            for i in 0..neighbours[a].len() {
                let b = neighbours[a][i] as usize;
                if b > a {
                    slot[a][i] = count;
                    let back = neighbours[b].binary_search(&(a as u32)).expect("the graph is symmetric");
                    slot[b][back] = count;
                    count += 1;
                }
            }
        }
        let pairs = rest
            .mesh
            .elements
            .iter()
            .map(|element| {
                let mut out = [0; 36];
                for (at, (a, b)) in corner_pairs().enumerate() {
                    let (i, j) = (element[a], element[b]);
                    out[at] = if a == b {
                        i
                    } else {
                        let list = &neighbours[i as usize];
                        let found = list.binary_search(&j).expect("corners of an element are neighbours");
                        // Stored block is A[high, low]; the pair (a, b) gives A[a, b].
                        slot[i as usize][found] | if i > j { 0 } else { TRANSPOSED }
                    };
                }
                out
            })
            .collect();
        let off = vec![[0.0; 9]; count as usize];
        let place =
            |p: &Vec3| [0, 1, 2].map(|i| ((p[i] - rest.mesh.nodes[0][i]) / rest.mesh.edge).round() as i32);
        let places = rest.mesh.nodes.iter().map(place);
        let diagonal = vec![[0.0; 9]; nodes];
        Self { places: places.collect(), neighbours, slot, diagonal, off, pairs }
    }

    fn assemble(&mut self, rest: &FemModel, rotations: &[Mat3], c: &StepCoefficients) {
        self.off.iter_mut().for_each(|b| *b = [0.0; 9]);
        for (block, m) in self.diagonal.iter_mut().zip(&rest.mass) {
            let m = (1.0 + c.rayleigh_mass * c.dt) * m;
            *block = [m, 0.0, 0.0, 0.0, m, 0.0, 0.0, 0.0, m];
        }
        let scale = c.dt * (c.dt + c.rayleigh_stiffness);
        for (e, (pairs, r)) in self.pairs.iter().zip(rotations).enumerate() {
            let k0 = &rest.stiffness[rest.stiffness_of[e] as usize];
            for (at, (a, b)) in corner_pairs().enumerate() {
                let local = Mat3::from_fn(|i, j| k0[(3 * b + j) * 24 + 3 * a + i]);
                let turned = r * local * r.transpose() * scale;
                let slot = pairs[at];
                if a == b {
                    add(&mut self.diagonal[slot as usize], &turned);
                } else if slot & TRANSPOSED != 0 {
                    add(&mut self.off[(slot & !TRANSPOSED) as usize], &turned.transpose());
                } else {
                    add(&mut self.off[slot as usize], &turned);
                }
            }
        }
    }
}

fn add(block: &mut [f64; 9], m: &Mat3) {
    block.iter_mut().zip(m.as_slice()).for_each(|(b, m)| *b += m);
}

fn corner_pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..8).flat_map(|a| (0..=a).map(move |b| (a, b)))
}

impl VelocitySystem {
    /// An empty system for a body.
    pub fn new(rest: &FemModel) -> Self {
        let nodes = rest.mesh.nodes.len();
        Self {
            blocks: Blocks::new(rest),
            plan: None,
            factor: CholeskyFactor::default(),
            factored: Vec::new(),
            turn: Mat3::identity(),
            turned: Vec::new(),
            coefficients: None,
            last_used: vec![0; nodes],
            retained: Vec::new(),
            retained_index: vec![u32::MAX; nodes],
            retained_version: 0,
            work: vec![0.0; 3 * nodes],
            factorizations: 0,
        }
    }

    /// Marks a node as possibly in contact at `step` (counted from 1).
    pub fn mark(&mut self, node: u32, step: u64) {
        self.last_used[node as usize] = step;
    }

    /// Nodes kept in the reduced system, ascending.
    pub fn retained(&self) -> &[u32] {
        &self.retained
    }

    /// Changes whenever the kept nodes do.
    pub fn retained_version(&self) -> u64 {
        self.retained_version
    }

    /// Index of a node among the kept ones.
    pub fn retained_index(&self, node: u32) -> usize {
        self.retained_index[node as usize] as usize
    }

    /// Brings plan and factor up to date with the body and the marks of `step`. `false` if `A` is not positive definite.
    pub fn prepare(&mut self, body: &FemState, c: &StepCoefficients, step: u64) -> bool {
        let new_plan = self.update_retained(step);
        if new_plan || self.plan.is_none() {
            self.plan =
                Some(SymbolicFactor::new(&self.blocks.neighbours, &self.blocks.places, &self.retained));
        }
        if new_plan || (body.frame - self.turn).norm_squared() > STALE_TURN * STALE_TURN {
            self.turn = body.frame;
            self.turned.clear();
        }
        let to_body = self.turn.transpose();
        let stale =
            |(r, old): (&Mat3, &Mat3)| (to_body * r - old).norm_squared() > STALE_ROTATION * STALE_ROTATION;
        let fresh = !new_plan
            && self.coefficients == Some(*c)
            && !body.rotation.iter().zip(&self.factored).any(stale);
        if fresh {
            return true;
        }
        self.turned.clear();
        self.factored.clear();
        self.factored.extend(body.rotation.iter().map(|r| to_body * r));
        self.blocks.assemble(&body.model, &self.factored, c);
        self.coefficients = Some(*c);
        self.factorizations += 1;
        let Some(plan) = &self.plan else { return false };
        self.factor.refill(plan, &self.blocks)
    }

    /// Updates the kept set; whether it changed.
    fn update_retained(&mut self, step: u64) -> bool {
        let current = |used: &u64| *used == step;
        let missing = self
            .last_used
            .iter()
            .zip(&self.retained_index)
            .any(|(used, at)| current(used) && *at == u32::MAX);
        let live = self.last_used.iter().filter(|u| **u > 0 && **u + KEEP_STEPS >= step).count();
        let bloated = self.retained.len() > live + live / 4 + 8;
        if !missing && !bloated {
            return false;
        }
        self.retained_version += 1;
        self.retained.clear();
        let recent = |used: u64| used > 0 && used + KEEP_STEPS >= step;
        self.retained
            .extend((0..self.last_used.len() as u32).filter(|&n| recent(self.last_used[n as usize])));
        self.retained_index.fill(u32::MAX);
        self.retained.iter().enumerate().for_each(|(i, &n)| self.retained_index[n as usize] = i as u32);
        true
    }

    /// Lends the reduced matrix of the kept nodes (Schur complement, column-major lower, world); [`VelocitySystem::give_back`]
    /// spares the next step from making it anew.
    pub fn take_matrix(&mut self) -> Vec<f64> {
        let mut matrix = std::mem::take(&mut self.turned);
        if let Some(plan) = self.plan.as_ref().filter(|_| matrix.is_empty()) {
            let side = 3 * plan.kept;
            matrix.resize(side * side, 0.0);
            turn_blocks(&self.turn, self.factor.schur(), plan.kept, &mut matrix);
        }
        matrix
    }

    /// Takes the matrix back, unchanged.
    pub fn return_matrix(&mut self, matrix: Vec<f64>) {
        self.turned = matrix;
    }

    /// Reduces momentum `b` (per node, N s, world) to the right-hand side of the kept nodes.
    pub fn reduce(&mut self, b: &[Vec3], rhs: &mut [f64]) {
        let Some(plan) = &self.plan else { return };
        for (chunk, &node) in self.work.chunks_exact_mut(3).zip(&plan.order) {
            chunk.copy_from_slice(self.turn.tr_mul(&b[node as usize]).as_slice());
        }
        self.factor.forward(plan, &mut self.work);
        let inner = 3 * (plan.order.len() - plan.kept);
        for (rhs, chunk) in rhs.chunks_exact_mut(3).zip(self.work[inner..].chunks_exact(3)) {
            rhs.copy_from_slice((self.turn * Vec3::from_column_slice(chunk)).as_slice());
        }
    }

    /// Completes the velocities of all nodes from those of the kept ones (world, 3 a node).
    pub fn complete(&mut self, kept: &[f64], v: &mut [Vec3]) {
        let Some(plan) = &self.plan else { return };
        let inner = 3 * (plan.order.len() - plan.kept);
        for (chunk, kept) in self.work[inner..].chunks_exact_mut(3).zip(kept.chunks_exact(3)) {
            chunk.copy_from_slice(self.turn.tr_mul(&Vec3::from_column_slice(kept)).as_slice());
        }
        self.factor.backward(plan, &mut self.work);
        for (chunk, &node) in self.work.chunks_exact(3).zip(&plan.order) {
            v[node as usize] = self.turn * Vec3::from_column_slice(chunk);
        }
    }
}

/// `Q S Qᵀ` block by block, lower triangle.
fn turn_blocks(q: &Mat3, s: &[f64], blocks: usize, out: &mut [f64]) {
    let n = 3 * blocks;
    for bc in 0..blocks {
        for br in bc..blocks {
            let read = |r: usize, c: usize| {
                let (row, column) = (3 * br + r, 3 * bc + c);
                if row >= column { s[column * n + row] } else { s[row * n + column] }
            };
            let turned = q * Mat3::from_fn(read) * q.transpose();
            for c in 0..3 {
                for r in 0..3 {
                    out[(3 * bc + c) * n + 3 * br + r] = turned[(r, c)];
                }
            }
        }
    }
}
