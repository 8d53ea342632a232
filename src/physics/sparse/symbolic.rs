//! Symbolic factorization: elimination order, fronts, and their storage.

use super::dissection;

/// Structure of the factorization for one pattern and one retained set.
#[derive(Clone, Debug)]
pub(crate) struct SymbolicFactor {
    /// Node at each position of the elimination order; the retained nodes are last, in ascending order.
    pub order: Vec<u32>,
    /// Position of each node.
    pub position: Vec<u32>,
    /// Fronts in elimination order; the last one is the root and is not eliminated.
    pub(super) fronts: Vec<Front>,
    /// Number of retained nodes.
    pub retained: usize,
    /// Length of the factor's storage.
    pub(super) factor_len: usize,
    /// Largest length of the stack of pending update matrices.
    pub(super) stack_len: usize,
    /// Side of the largest front.
    pub(super) largest: usize,
}

/// A dense submatrix of the elimination.
#[derive(Clone, Debug)]
pub(super) struct Front {
    /// First position eliminated here.
    pub first: usize,
    /// Number of positions eliminated here.
    pub pivots: usize,
    /// Positions of the front's rows, ascending; the first `pivots` are eliminated.
    pub rows: Vec<u32>,
    /// Children in the order in which they were eliminated.
    pub children: Vec<usize>,
    /// Indices of the rows beyond the pivots in the rows of the parent.
    pub into_parent: Vec<Run>,
    /// Offset of the panel `L` (3·rows × 3·pivots, column-major) in the factor.
    pub offset: usize,
}

/// Adjacent rows of an update matrix that are adjacent in the parent's front too, counted in scalars.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    /// First row in the update matrix.
    pub from: usize,
    /// First row in the parent.
    pub to: usize,
    /// Number of rows of the run.
    pub len: usize,
}

/// Largest share of explicit zeros accepted when two fronts are merged.
const MERGE_ZEROS: f64 = 0.05;
/// Fronts with at most this many pivots are merged regardless of zeros.
const MERGE_SMALL: usize = 3;

impl SymbolicFactor {
    /// Analyses the graph `neighbours` (symmetric, without self loops, ascending lists), retaining the nodes `retained`
    /// (ascending). `places` are lattice coordinates, in which neighbours differ by at most one along each axis.
    pub(crate) fn new(neighbours: &[Vec<u32>], places: &[[i32; 3]], retained: &[u32]) -> Self {
        let order = elimination_order(places, retained);
        let inner = order.len() - retained.len();
        let structure = column_structure(neighbours, &order, inner);
        let order = postorder(&order, &structure, inner);
        let structure = column_structure(neighbours, &order, inner);
        let mut position = vec![0; order.len()];
        order.iter().enumerate().for_each(|(at, &node)| position[node as usize] = at as u32);
        let fronts = build_fronts(&structure, inner, order.len());
        let factor_len = fronts.last().map_or(0, |f| f.offset);
        let stack_len = deepest_stack(&fronts);
        let largest = fronts.iter().map(|f| 3 * f.rows.len()).max().unwrap_or(0);
        Self { order, position, fronts, retained: retained.len(), factor_len, stack_len, largest }
    }
}

/// The nodes to eliminate in nested dissection order, then the retained ones.
fn elimination_order(places: &[[i32; 3]], retained: &[u32]) -> Vec<u32> {
    let mut is_retained = vec![false; places.len()];
    retained.iter().for_each(|&node| is_retained[node as usize] = true);
    let mut order: Vec<u32> = (0..places.len() as u32).filter(|&n| !is_retained[n as usize]).collect();
    dissection::order(&mut order, places);
    order.extend_from_slice(retained);
    order
}

/// Rows below the diagonal of each eliminated column, as ascending positions.
fn column_structure(neighbours: &[Vec<u32>], order: &[u32], inner: usize) -> Vec<Vec<u32>> {
    let mut position = vec![0u32; order.len()];
    order.iter().enumerate().for_each(|(at, &node)| position[node as usize] = at as u32);
    let mut columns: Vec<Vec<u32>> = Vec::with_capacity(inner);
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); order.len()];
    let mut seen = vec![usize::MAX; order.len()];
    for at in 0..inner {
        let mut rows = Vec::new();
        let mut add = |row: u32| {
            if row as usize > at && seen[row as usize] != at {
                seen[row as usize] = at;
                rows.push(row);
            }
        };
        neighbours[order[at] as usize].iter().for_each(|&n| add(position[n as usize]));
        for &child in &children[at] {
            let child: &Vec<u32> = &columns[child];
            child.iter().for_each(|&row| add(row));
        }
        rows.sort_unstable();
        if let Some(&parent) = rows.first() {
            children[parent as usize].push(at);
        }
        columns.push(rows);
    }
    columns
}

/// The same order with every subtree of the elimination tree contiguous.
fn postorder(order: &[u32], structure: &[Vec<u32>], inner: usize) -> Vec<u32> {
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); inner];
    let mut roots = Vec::new();
    for (at, rows) in structure.iter().enumerate() {
        match rows.first() {
            Some(&parent) if (parent as usize) < inner => children[parent as usize].push(at),
            _ => roots.push(at),
        }
    }
    let mut result = Vec::with_capacity(order.len());
    let mut stack: Vec<(usize, bool)> = roots.into_iter().rev().map(|r| (r, false)).collect();
    while let Some((at, done)) = stack.pop() {
        if done {
            result.push(order[at]);
        } else {
            stack.push((at, true));
            stack.extend(children[at].iter().rev().map(|&c| (c, false)));
        }
    }
    result.extend_from_slice(&order[inner..]);
    result
}

/// Groups columns into fronts, links them, and adds the root over the retained positions.
fn build_fronts(structure: &[Vec<u32>], inner: usize, total: usize) -> Vec<Front> {
    let mut groups: Vec<Group> = Vec::new();
    for (at, rows) in structure.iter().enumerate() {
        groups.push(Group { first: at, pivots: 1, below: rows.clone(), zeros: 0 });
        while try_merge(&mut groups) {}
    }
    let mut front_of = vec![groups.len(); total];
    for (index, group) in groups.iter().enumerate() {
        front_of[group.first..group.first + group.pivots].fill(index);
    }
    let mut fronts = Vec::with_capacity(groups.len() + 1);
    let mut offset = 0;
    for Group { first, pivots, below, .. } in groups {
        let rows: Vec<u32> = (first as u32..(first + pivots) as u32).chain(below).collect();
        let size = 9 * rows.len() * pivots;
        fronts.push(Front { first, pivots, rows, children: Vec::new(), into_parent: Vec::new(), offset });
        offset += size;
    }
    let retained = (inner as u32..total as u32).collect();
    fronts.push(Front {
        first: inner,
        pivots: 0,
        rows: retained,
        children: Vec::new(),
        into_parent: Vec::new(),
        offset,
    });
    link(&mut fronts, &front_of);
    fronts
}

/// Adjacent columns that are eliminated in one front (a relaxed supernode).
struct Group {
    first: usize,
    pivots: usize,
    /// Rows below them, ascending.
    below: Vec<u32>,
    /// Explicit zero blocks because of merges.
    zeros: usize,
}

/// Merges the last two groups if the former is a child of the latter and few explicit zeros result.
fn try_merge(groups: &mut Vec<Group>) -> bool {
    let [.., child, parent] = groups.as_slice() else { return false };
    if child.below.first() != Some(&(parent.first as u32)) {
        return false;
    }
    let full = parent.pivots + parent.below.len();
    let zeros = child.zeros + parent.zeros + child.pivots * (full - child.below.len());
    let area = child.pivots * (child.pivots + full) + parent.pivots * full;
    let small = child.pivots <= MERGE_SMALL && parent.pivots <= MERGE_SMALL;
    if zeros as f64 > MERGE_ZEROS * area as f64 && !small {
        return false;
    }
    let (first, pivots) = (child.first, child.pivots + parent.pivots);
    let below = parent.below.clone();
    groups.truncate(groups.len() - 2);
    groups.push(Group { first, pivots, below, zeros });
    true
}

fn link(fronts: &mut [Front], front_of: &[usize]) {
    for index in 0..fronts.len() - 1 {
        let Some(&next) = fronts[index].rows.get(fronts[index].pivots) else { continue };
        let parent = front_of[next as usize];
        let mut into: Vec<Run> = Vec::new();
        for (from, row) in fronts[index].rows[fronts[index].pivots..].iter().enumerate() {
            let to = fronts[parent].rows.binary_search(row).expect("a child's rows lie in its parent");
            match into.last_mut() {
                Some(run) if run.to + run.len == 3 * to => run.len += 3,
                _ => into.push(Run { from: 3 * from, to: 3 * to, len: 3 }),
            }
        }
        fronts[index].into_parent = into;
        fronts[parent].children.push(index);
    }
}

/// Largest length of the update matrices that are pending at one time.
fn deepest_stack(fronts: &[Front]) -> usize {
    let waiting = |f: &Front| (3 * (f.rows.len() - f.pivots)).pow(2);
    let (mut now, mut max) = (0, 0);
    for front in fronts {
        now -= front.children.iter().map(|&c| waiting(&fronts[c])).sum::<usize>();
        now += waiting(front);
        max = max.max(now);
    }
    max
}
