//! Connected islands of a problem, and the factors kept for them between steps.

use super::{
    factor::{Factor, Precision},
    problem::{BlockIdentity, ContactProblem, ScalarConstraint},
    secant::SecantPairs,
};
use crate::sparse::NotPositiveDefinite;
use softvt_geometry::union_find::UnionFind;

/// Cost of a factorization in Newton steps with an existing factor: constant part, and part per velocity.
///
/// A factorization needs `n³/3` operations, a step reads `n²/2` numbers a few times; measured with
/// 150 to 2000 velocities.
const FACTOR_COST_IN_STEPS: [f64; 2] = [5.0, 1.0 / 200.0];
/// Steps of a pass that refactoring would not avoid.
const UNAVOIDABLE_STEPS: u32 = 4;
/// Number of islands whose factors are kept.
const MAX_CACHED_FACTORS: usize = 6;

/// The blocks, clusters and constraints of one connected island.
#[derive(Default)]
pub(super) struct Island {
    /// Blocks, ascending.
    pub blocks: Vec<usize>,
    /// Contact clusters between them.
    pub clusters: Vec<usize>,
    /// Scalar constraints on these blocks.
    pub constraints: Vec<usize>,
    /// Total number of velocities.
    pub size: usize,
}

impl Island {
    /// The scalar constraints, with the index of the velocity of each in the vectors of the island.
    pub(super) fn scalars<'a>(
        &'a self,
        problem: &'a ContactProblem,
    ) -> impl Iterator<Item = (usize, &'a ScalarConstraint)> {
        let constraints = self.constraints.iter().map(|&index| &problem.constraints[index]);
        constraints.map(|constraint| (problem.blocks[constraint.block].offset + constraint.index, constraint))
    }

    /// Cost of a factorization, in Newton steps with an existing factor.
    pub(super) fn factor_cost(&self) -> f64 {
        let [constant, per_velocity] = FACTOR_COST_IN_STEPS;
        constant + per_velocity * self.size as f64
    }

    /// Size of the constrained block: the number of velocities from the first one with a scalar constraint to the end.
    pub(super) fn constrained_size(&self, problem: &ContactProblem) -> usize {
        self.size - self.scalars(problem).map(|(at, _)| at).min().unwrap_or(self.size)
    }
}

/// Splits a problem into islands of blocks that clusters connect.
pub(super) fn islands(problem: &ContactProblem) -> Vec<Island> {
    let mut connected = UnionFind::new(problem.blocks.len());
    for cluster in &problem.clusters {
        if let (Some(a), Some(b)) = (problem.block_of(&cluster.a), problem.block_of(&cluster.b)) {
            connected.union(a, b);
        }
    }
    let mut islands: Vec<Island> = Vec::new();
    let mut of_root = vec![usize::MAX; problem.blocks.len()];
    for block in 0..problem.blocks.len() {
        let r = connected.find(block);
        if of_root[r] == usize::MAX {
            of_root[r] = islands.len();
            islands.push(Island::default());
        }
        islands[of_root[r]].blocks.push(block);
        islands[of_root[r]].size += problem.blocks[block].dim;
    }
    for (index, cluster) in problem.clusters.iter().enumerate() {
        if let Some(block) = problem.block_of(&cluster.a).or(problem.block_of(&cluster.b)) {
            islands[of_root[connected.find(block)]].clusters.push(index);
        }
    }
    for (index, scalar) in problem.constraints.iter().enumerate() {
        islands[of_root[connected.find(scalar.block)]].constraints.push(index);
    }
    islands.retain(|island| island.size > 0);
    islands
}

/// A factored Hessian of an island.
#[derive(Clone, Debug, Default)]
struct CachedFactor {
    /// Identity and size of each block.
    key: Vec<(BlockIdentity, usize)>,
    /// Cholesky factor down to the constrained block, whose Schur complement it holds; column-major.
    factor: Factor,
    is_valid: bool,
    secant: SecantPairs,
    /// Steps of the first pass that ended with this factor.
    first_steps: Option<u32>,
    /// Steps of later passes beyond that number, or beyond [`UNAVOIDABLE_STEPS`].
    excess_steps: u32,
}

/// Factored Hessians of islands, the most recently used first; the first one is *current*.
#[derive(Clone, Debug, Default)]
pub(super) struct FactorCache {
    entries: Vec<CachedFactor>,
    /// Factor of the constrained block.
    constrained: Vec<f64>,
}

impl FactorCache {
    /// Selects the factor of an island as the current one. True if it is worth using.
    ///
    /// A factor whose excess steps cost as much as a new one is discarded. So the total cost is never more than twice
    /// the least possible, however slowly single passes converge with it.
    pub(super) fn select(&mut self, problem: &ContactProblem, island: &Island) -> bool {
        let found = self.entries.iter().position(|entry| entry.is_of(problem, island));
        if let Some(found) = found {
            self.entries[..=found].rotate_right(1);
            let entry = &self.entries[0];
            return entry.is_valid && f64::from(entry.excess_steps) < island.factor_cost();
        }
        if self.entries.len() < MAX_CACHED_FACTORS {
            self.entries.push(CachedFactor::default());
        }
        self.entries.rotate_right(1);
        let entry = &mut self.entries[0];
        entry.key.clear();
        entry.key.extend(island.blocks.iter().map(|&b| (problem.blocks[b].identity, problem.blocks[b].dim)));
        entry.is_valid = false;
        entry.secant.clear();
        false
    }

    /// Factors a Hessian down to the constrained block and makes the result the current factor.
    ///
    /// # Errors
    /// It is not positive definite in this precision.
    pub(super) fn factor(
        &mut self,
        problem: &ContactProblem,
        island: &Island,
        hessian: &[f64],
        precision: Precision,
    ) -> Result<(), NotPositiveDefinite> {
        let entry = &mut self.entries[0];
        let head = island.size - island.constrained_size(problem);
        let factored = entry.factor.set(hessian, island.size, head, precision);
        entry.is_valid = factored.is_ok();
        (entry.first_steps, entry.excess_steps) = (None, 0);
        entry.secant.clear();
        factored
    }

    /// Records that a pass converged after `steps` with the current factor.
    pub(super) fn record_pass(&mut self, steps: u32) {
        let entry = &mut self.entries[0];
        let first = *entry.first_steps.get_or_insert(steps);
        entry.excess_steps += steps.saturating_sub(first.min(UNAVOIDABLE_STEPS));
    }

    /// Solves in place with the current factor, its corrections, and `stiffness` added to the diagonal
    /// of the constrained block.
    pub(super) fn solve(&mut self, island: &Island, stiffness: &[f64], b: &mut [f64]) {
        let CachedFactor { factor, secant, .. } = &mut self.entries[0];
        let constrained = &mut self.constrained;
        secant.solve(stiffness, b, |b| factor.solve(island.size, stiffness, b, constrained));
    }

    /// Precision of the current factor.
    pub(super) fn precision(&self) -> Precision {
        self.entries[0].factor.precision
    }

    /// Corrections of the current factor.
    pub(super) fn corrections(&mut self) -> &mut SecantPairs {
        &mut self.entries[0].secant
    }
}

impl CachedFactor {
    /// True if the factor belongs to these blocks.
    fn is_of(&self, problem: &ContactProblem, island: &Island) -> bool {
        let is_same = |(key, &b): (&(BlockIdentity, usize), &usize)| {
            *key == (problem.blocks[b].identity, problem.blocks[b].dim)
        };
        self.key.len() == island.blocks.len() && self.key.iter().zip(&island.blocks).all(is_same)
    }
}
