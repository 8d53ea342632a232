//! Connected islands of a problem, and the factors that they keep between steps.

use super::{newton::FACTOR_COST_IN_STEPS, problem::ContactProblem, secant::Secant};
use crate::{geometry::union_find::UnionFind, physics::sparse::dense};

/// The blocks, clusters and constraints of one connected island.
pub(super) struct Island {
    /// Blocks, ascending.
    pub blocks: Vec<usize>,
    /// Patches that touch them.
    pub clusters: Vec<usize>,
    /// ScalarConstraint rows on them.
    pub constraints: Vec<usize>,
    /// Velocities in all.
    pub size: usize,
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
            islands.push(Island {
                blocks: Vec::new(),
                clusters: Vec::new(),
                constraints: Vec::new(),
                size: 0,
            });
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

/// A factored Hessian and what it belongs to.
#[derive(Clone, Debug, Default)]
struct Entry {
    /// Identity and size of each block.
    key: Vec<(u64, usize)>,
    factor: Vec<f64>,
    sound: bool,
    secant: Secant,
    /// Steps of the first pass that ended with this factor.
    first: Option<u32>,
    /// Steps beyond that many, or beyond [`GOOD_STEPS`], in later passes.
    wasted: u32,
}

/// Factored Hessians by island, the most recently used first.
#[derive(Clone, Debug, Default)]
pub(super) struct Cache {
    entries: Vec<Entry>,
    /// CholeskyFactor of the last velocities' complement.
    tail: Vec<f64>,
}

/// Steps of a pass that no new factor would spare.
const GOOD_STEPS: u32 = 4;
/// Islands whose factors are remembered.
const REMEMBERED: usize = 6;

impl Cache {
    /// Whether there is a factor for the island that is worth its steps; it becomes the current one.
    ///
    /// A factor that has wasted as many steps as a new one costs is given up, so that altogether never more than twice
    /// the least is spent, however long each single pass would rather go on with it.
    pub(super) fn matches(&mut self, problem: &ContactProblem, island: &Island) -> bool {
        let found = self.entries.iter().position(|entry| same(entry, problem, island));
        if let Some(found) = found {
            self.entries[..=found].rotate_right(1);
            let entry = &self.entries[0];
            return entry.sound && f64::from(entry.wasted) < FACTOR_COST_IN_STEPS;
        }
        if self.entries.len() < REMEMBERED {
            self.entries.push(Entry::default());
        }
        self.entries.rotate_right(1);
        let entry = &mut self.entries[0];
        entry.key.clear();
        entry.key.extend(island.blocks.iter().map(|&b| (problem.blocks[b].identity, problem.blocks[b].dim)));
        entry.sound = false;
        entry.secant.clear();
        false
    }

    /// The buffer of the current factor, to be filled anew.
    pub(super) fn take(&mut self, island: &Island) -> Vec<f64> {
        let mut factor = std::mem::take(&mut self.entries[0].factor);
        factor.resize(island.size * island.size, 0.0);
        factor
    }

    /// Puts the factored buffer back.
    pub(super) fn give(&mut self, factor: Vec<f64>, sound: bool) {
        let entry = &mut self.entries[0];
        (entry.factor, entry.sound) = (factor, sound);
        (entry.first, entry.wasted) = (None, 0);
        entry.secant.clear();
    }

    /// Tells that a pass ended after `steps` with the current factor.
    pub(super) fn took(&mut self, steps: u32) {
        let entry = &mut self.entries[0];
        let first = *entry.first.get_or_insert(steps);
        entry.wasted += steps.saturating_sub(first.min(GOOD_STEPS));
    }

    /// Solves in place with the current factor, what was learnt since it was made, and `stiffness` added to the diagonal
    /// of the last velocities, for which the factor was left open.
    pub(super) fn solve(&mut self, island: &Island, stiffness: &[f64], b: &mut [f64]) {
        let (n, t) = (island.size, stiffness.len());
        let (head, tail) = (n - t, &mut self.tail);
        let entry = &self.entries[0];
        tail.clear();
        for (c, stiffness) in stiffness.iter().enumerate() {
            let start = (head + c) * n + head;
            tail.extend_from_slice(&entry.factor[start..start + t]);
            tail[c * t + c] += stiffness;
        }
        // The complement of a positive definite matrix, made stiffer: it has a factor.
        dense::partial_cholesky(tail, t, t);
        entry.secant.solve(stiffness, b, |b| {
            dense::forward(&entry.factor, n, head, b);
            dense::forward(tail, t, t, &mut b[head..]);
            dense::backward(tail, t, t, &mut b[head..]);
            dense::backward(&entry.factor, n, head, b);
        });
    }

    /// Corrects the current factor by a step from (`v0`, `g0`) to (`v`, `g`), of which the changes `others` (index,
    /// amount) are no matter of the factor's.
    pub(super) fn learn(
        &mut self,
        before: (&[f64], &[f64]),
        after: (&[f64], &[f64]),
        others: impl Iterator<Item = (usize, f64)>,
    ) {
        self.entries[0].secant.learn(before, after, others);
    }
}

fn same(entry: &Entry, problem: &ContactProblem, island: &Island) -> bool {
    entry.key.len() == island.blocks.len()
        && entry
            .key
            .iter()
            .zip(&island.blocks)
            .all(|(key, &b)| *key == (problem.blocks[b].identity, problem.blocks[b].dim))
}
