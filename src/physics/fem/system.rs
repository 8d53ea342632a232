//! The velocity system of a soft body, `A = (1 + α dt) M + dt c K`, reduced to the nodes in contact.
//!
//! With the elastic force `f` at the positions of the start and the other momenta `b`, a step is
//! `A v = b + dt (f + e K v₀ + (c − e) K v_r)`: the tangent acts for the time `c` on the velocities `v` at the end, and
//! for `e` on those at the start, `v₀`. `v_r` is the rigid part of `v₀`, on which `K` of a strained body would act as a
//! brake. Positions follow as `x = x₀ + dt v`, so that contacts act at the end of the step with either scheme:
//! - implicit Euler: `c = dt + β`, `e = 0`, without `v_r`. A mode of angular frequency ω is damped by ω (dt + β) / 2;
//! - average acceleration: `c − e = β` and `c + e = 0.56 dt`, or β if that is larger. This is Newmark's method (1959)
//!   with γ = 1/2 and β = 1/4, with the velocities of the middle of the steps. A mode is damped by ω β / 2, whatever
//!   the step, and its frequency is too low by (ω dt)² / 10. Without contact, the energy of `v` and of the mean of `x₀`
//!   and `x` never grows.
//!
//! `K` includes the Maxwell branches of a material with a loss factor.
//!
//! `K = Σ R K₀ Rᵀ` is assembled and factored in the body's co-rotating frame, so a body that is carried or rotates
//! without changing shape keeps its factor. It is factored again when an element's rotation has changed by
//! `STALE_ROTATION` relative to the body, when the densification of an element has changed, or when a new node comes
//! into contact. The frame itself follows the body in steps of `STALE_FRAME`, so that the matrix of a body that is
//! merely held is not even rotated. A slightly old tangent changes no equilibrium: the elastic force is always
//! evaluated exactly, and `A` only affects the transient.

use super::{
    body::{FemModel, FemState},
    material::ElasticMaterial,
};
use crate::sparse::{BlockMatrix, CholeskyFactor, NotPositiveDefinite, SymbolicFactor};
use nalgebra::MatrixView3;
use softvt_geometry::{Mat3, Vec3};

/// Change of an element's rotation (Frobenius norm, about √2 × radians) beyond which the matrix is factored again.
const STALE_ROTATION: f64 = 0.04;
/// The same relative to √(μ/λ) of the Lamé parameters: in a nearly incompressible body a small turn is a large change
/// of stiffness in the directions in which the volume stayed constant.
const STALE_ROTATION_OF_VOLUME: f64 = 0.22;
/// Mean of the times `c` and `e` of average acceleration over the step. A quarter is the least for which the step is
/// stable; more is a margin for a tangent that is not the present one, and lowers frequencies by (ω dt)² / 67.
const AVERAGE: f64 = 0.28;
/// Least time `c − e` of average acceleration, s: a loss factor of 2 % at 10 Hz, less than that of any soft material.
const LEAST_DAMPING: f64 = 3e-4;
/// Change of the body's rotation (same norm) beyond which the reduced matrix is rotated again.
const STALE_FRAME: f64 = 2e-3;
/// Ratio by which the densification of an element may grow, and by which it may fall, before the
/// matrix is factored again.
const STALE_DENSIFICATION: [f64; 2] = [1.2, 0.6];
/// Curvature of the densification that counts as none in this comparison.
const SMALL_DENSIFICATION: f64 = 0.05;
/// Steps for which a node stays retained after its last contact.
const RETAIN_STEPS: u64 = 4;

/// Coefficients of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StepCoefficients {
    /// Time step, s.
    pub dt: f64,
    /// Factor of the masses in `A`: `1 + α dt`, where a step is as long as the last one.
    pub mass: f64,
    /// `c`, s.
    pub end: f64,
    /// `e`, s.
    pub start: f64,
    /// `c − e`, s, where it acts on `v_r` as well; 0 without.
    pub rigid: f64,
}

impl StepCoefficients {
    /// Implicit Euler with stiffness-proportional damping `beta`, s.
    pub(crate) fn euler(dt: f64, mass: f64, beta: f64) -> Self {
        Self { dt, mass, end: dt + beta, start: 0.0, rigid: 0.0 }
    }

    /// Average acceleration with stiffness-proportional damping `beta`, s; `c + e` is `factor` times that of equal
    /// steps.
    pub(crate) fn average(dt: f64, mass: f64, factor: f64, beta: f64) -> Self {
        let rigid = beta.max(LEAST_DAMPING);
        let start = (AVERAGE * dt * factor - 0.5 * rigid).max(0.0);
        Self { dt, mass, end: start + rigid, start, rigid }
    }
}

/// The factored system of one body.
#[derive(Clone, Debug)]
pub(crate) struct VelocitySystem {
    blocks: Blocks,
    plan: Option<SymbolicFactor>,
    factor: CholeskyFactor,
    /// Element rotations in that frame at the last factorization.
    factored: Vec<Mat3>,
    /// Densification of the elements at the last factorization.
    factored_densification: Vec<f64>,
    /// Rotation of the frame in which the matrix is factored.
    frame: Mat3,
    /// Schur complement in the world frame; empty while it is taken out or out of date.
    schur_w: Vec<f64>,
    coefficients: Option<StepCoefficients>,
    last_used: Vec<u64>,
    retained: Vec<u32>,
    retained_index: Vec<u32>,
    retained_version: u64,
    work: Vec<f64>,
    /// Largest change of an element's rotation with the same factor.
    stale_rotation: f64,
    /// Velocities in the frame, and their products with `A`.
    turned: Vec<Vec3>,
    solved: Vec<Vec3>,
    product: Vec<Vec3>,
    /// Number of factorizations so far.
    pub factorizations: u64,
}

/// The matrix `A`: diagonal blocks and, per pair of neighbours, one block.
#[derive(Clone, Debug)]
struct Blocks {
    /// Lattice coordinates of the nodes.
    places: Vec<[i32; 3]>,
    neighbours: Vec<Vec<u32>>,
    slot: Vec<Vec<u32>>,
    diagonal: Vec<[f64; 9]>,
    off: Vec<[f64; 9]>,
    /// Block of each of the 36 corner pairs of each element: an index into `off`, with [`TRANSPOSED`] set if that
    /// stores the transpose, or the node for a diagonal pair.
    pairs: Vec<[u32; 36]>,
}

/// Flag of a block index.
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

    fn assemble(&mut self, body: &FemState, rotations: &[Mat3], c: &StepCoefficients) {
        let rest = &*body.model;
        self.off.iter_mut().for_each(|b| *b = [0.0; 9]);
        for (block, m) in self.diagonal.iter_mut().zip(&rest.mass) {
            let m = c.mass * m;
            *block = [m, 0.0, 0.0, 0.0, m, 0.0, 0.0, 0.0, m];
        }
        let scale = c.dt * c.end * (1.0 + rest.relaxation.map_or(0.0, |law| law.share));
        for (e, (pairs, r)) in self.pairs.iter().zip(rotations).enumerate() {
            let kind = rest.stiffness_of[e] as usize;
            let k0 = &rest.stiffness[kind];
            let mut dense = [Mat3::zeros(); 36];
            if body.densification[e] > 0.0 {
                let x = std::array::from_fn(|c| body.x[rest.mesh.elements[e][c] as usize]);
                rest.densification.add_tangent(&x, &body.rotation[e], rest.share[kind], &mut dense);
            }
            for (at, (a, b)) in corner_pairs().enumerate() {
                let local = Mat3::from_fn(|i, j| k0[(3 * b + j) * 24 + 3 * a + i]) + dense[at];
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
    /// The system of a body, not factored yet.
    pub(crate) fn new(rest: &FemModel) -> Self {
        let nodes = rest.mesh.nodes.len();
        Self {
            blocks: Blocks::new(rest),
            plan: None,
            factor: CholeskyFactor::default(),
            factored: Vec::new(),
            factored_densification: Vec::new(),
            frame: Mat3::identity(),
            schur_w: Vec::new(),
            coefficients: None,
            last_used: vec![0; nodes],
            retained: Vec::new(),
            retained_index: vec![u32::MAX; nodes],
            retained_version: 0,
            work: vec![0.0; 3 * nodes],
            stale_rotation: stale_rotation(&rest.material),
            turned: Vec::new(),
            solved: vec![Vec3::zeros(); nodes],
            product: Vec::new(),
            factorizations: 0,
        }
    }

    /// Marks a node as possibly in contact at `step` (counted from 1): it is retained for some steps.
    pub(crate) fn mark(&mut self, node: u32, step: u64) {
        self.last_used[node as usize] = step;
    }

    /// Nodes of the reduced system, ascending.
    pub(crate) fn retained(&self) -> &[u32] {
        &self.retained
    }

    /// A number that changes whenever the retained nodes do.
    pub(crate) fn retained_version(&self) -> u64 {
        self.retained_version
    }

    /// Index of a node among the retained ones.
    pub(crate) fn retained_index(&self, node: u32) -> usize {
        self.retained_index[node as usize] as usize
    }

    /// Updates retained nodes and factor for the body and the marks of `step`.
    ///
    /// # Errors
    /// `A` is not positive definite.
    pub(crate) fn update(
        &mut self,
        body: &FemState,
        c: &StepCoefficients,
        step: u64,
    ) -> Result<(), NotPositiveDefinite> {
        let new_plan = self.update_retained(step);
        if new_plan {
            self.plan = None;
        }
        let (blocks, retained) = (&mut self.blocks, &self.retained);
        let plan = self
            .plan
            .get_or_insert_with(|| SymbolicFactor::new(&blocks.neighbours, &blocks.places, retained));
        if new_plan || (body.frame - self.frame).norm_squared() > STALE_FRAME * STALE_FRAME {
            self.frame = body.frame;
            self.schur_w.clear();
        }
        let to_frame = self.frame.transpose();
        let limit = self.stale_rotation;
        let stale = |(r, old): (&Mat3, &Mat3)| (to_frame * r - old).norm_squared() > limit * limit;
        let [growth, fall] = STALE_DENSIFICATION;
        let has_changed = |(now, old): (&f64, &f64)| {
            *now > growth * old + SMALL_DENSIFICATION || *now < fall * old - SMALL_DENSIFICATION
        };
        let fresh = !new_plan
            && self.coefficients == Some(*c)
            && !body.rotation.iter().zip(&self.factored).any(stale)
            && !body.densification.iter().zip(&self.factored_densification).any(has_changed);
        if fresh {
            return Ok(());
        }
        self.schur_w.clear();
        self.factored.clear();
        self.factored.extend(body.rotation.iter().map(|r| to_frame * r));
        self.factored_densification.clone_from(&body.densification);
        blocks.assemble(body, &self.factored, c);
        self.coefficients = Some(*c);
        self.factorizations += 1;
        self.factor.refill(plan, blocks)
    }

    /// Updates the retained nodes; true if they changed.
    fn update_retained(&mut self, step: u64) -> bool {
        let current = |used: &u64| *used == step;
        let missing = self
            .last_used
            .iter()
            .zip(&self.retained_index)
            .any(|(used, at)| current(used) && *at == u32::MAX);
        let live = self.last_used.iter().filter(|u| **u > 0 && **u + RETAIN_STEPS >= step).count();
        let bloated = self.retained.len() > live + live / 4 + 8;
        if !missing && !bloated {
            return false;
        }
        self.retained_version += 1;
        self.retained.clear();
        let recent = |used: u64| used > 0 && used + RETAIN_STEPS >= step;
        self.retained
            .extend((0..self.last_used.len() as u32).filter(|&n| recent(self.last_used[n as usize])));
        self.retained_index.fill(u32::MAX);
        self.retained.iter().enumerate().for_each(|(i, &n)| self.retained_index[n as usize] = i as u32);
        true
    }

    /// Adds `dt K u` to the momenta `b` of a step (N s), with the factored tangent, for a field `u` (m) of velocity
    /// times time, given as a function of the velocity and position of a node; all in world axes.
    pub(crate) fn add_tangent(
        &mut self,
        body: &FemState,
        c: &StepCoefficients,
        u: impl Fn(&Vec3, &Vec3) -> Vec3,
        b: &mut [Vec3],
    ) {
        let q = self.frame;
        // The blocks are those of A.
        let weighted = |(v, x): (&Vec3, &Vec3)| q.tr_mul(&u(v, x)) / c.end;
        self.turned.clear();
        self.turned.extend(body.v.iter().zip(&body.x).map(weighted));
        self.product.clear();
        self.product.resize(b.len(), Vec3::zeros());
        for (node, u) in self.turned.iter().enumerate() {
            self.blocks.column(node as u32, &mut |row, block, is_transposed| {
                let block = MatrixView3::from_slice(block);
                self.product[row as usize] += if is_transposed { block.tr_mul(u) } else { block * u };
            });
        }
        let nodes = self.product.iter().zip(&self.turned).zip(&body.model.mass);
        for (b, ((product, u), m)) in b.iter_mut().zip(nodes) {
            *b += q * (product - u * (c.mass * m));
        }
    }

    /// Takes the reduced matrix of the retained nodes: their Schur complement, column-major,
    /// lower triangle, world frame.
    ///
    /// Returning it by [`VelocitySystem::return_matrix`] saves its computation in the next step.
    pub(crate) fn take_matrix(&mut self) -> Vec<f64> {
        let mut matrix = std::mem::take(&mut self.schur_w);
        if let Some(plan) = self.plan.as_ref().filter(|_| matrix.is_empty()) {
            let side = 3 * plan.retained;
            matrix.resize(side * side, 0.0);
            rotate_blocks(&self.frame, self.factor.schur(), plan.retained, &mut matrix);
        }
        matrix
    }

    /// Returns the unchanged matrix of [`VelocitySystem::take_matrix`].
    pub(crate) fn return_matrix(&mut self, matrix: Vec<f64>) {
        self.schur_w = matrix;
    }

    /// Reduces momenta `b` (per node, N s, world) to the right-hand side of the retained nodes (3 per node).
    pub(crate) fn reduce(&mut self, b: &[Vec3], rhs: &mut [f64]) {
        let Some(plan) = &self.plan else { return };
        for (chunk, &node) in self.work.chunks_exact_mut(3).zip(&plan.order) {
            chunk.copy_from_slice(self.frame.tr_mul(&b[node as usize]).as_slice());
        }
        self.factor.forward(plan, &mut self.work);
        let inner = 3 * (plan.order.len() - plan.retained);
        for (rhs, chunk) in rhs.chunks_exact_mut(3).zip(self.work[inner..].chunks_exact(3)) {
            rhs.copy_from_slice((self.frame * Vec3::from_column_slice(chunk)).as_slice());
        }
    }

    /// Computes the velocities of all nodes from those of the retained ones (m/s, world, 3 per node).
    pub(crate) fn complete(&mut self, retained: &[f64]) {
        let Some(plan) = &self.plan else { return };
        let inner = 3 * (plan.order.len() - plan.retained);
        for (chunk, v) in self.work[inner..].chunks_exact_mut(3).zip(retained.chunks_exact(3)) {
            chunk.copy_from_slice(self.frame.tr_mul(&Vec3::from_column_slice(v)).as_slice());
        }
        self.factor.backward(plan, &mut self.work);
        for (chunk, &node) in self.work.chunks_exact(3).zip(&plan.order) {
            self.solved[node as usize] = self.frame * Vec3::from_column_slice(chunk);
        }
    }

    /// The velocities of all nodes that [`VelocitySystem::complete`] has found, m/s, world.
    pub(crate) fn solved(&self) -> &[Vec3] {
        &self.solved
    }
}

/// Largest change of an element's rotation with the same factor, for a material.
fn stale_rotation(material: &ElasticMaterial) -> f64 {
    let ratio = material.shear_modulus() / material.lame_lambda();
    STALE_ROTATION.min(STALE_ROTATION_OF_VOLUME * ratio.sqrt())
}

/// `Q S Qᵀ` for each 3×3 block of the lower triangle.
fn rotate_blocks(q: &Mat3, s: &[f64], blocks: usize, out: &mut [f64]) {
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
