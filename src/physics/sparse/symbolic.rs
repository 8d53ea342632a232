//! Structure of a factor: which nodes go when, and where their fronts live.

use super::dissection;

/// The plan of a factorisation for one pattern and one kept set.
#[derive(Clone, Debug)]
pub struct SymbolicFactor {
    /// Node at each position of the elimination order; the kept nodes are last, in ascending order.
    pub order: Vec<u32>,
    /// Position of each node.
    pub position: Vec<u32>,
    /// Fronts in elimination order; the last one is the root and is not eliminated.
    pub(super) fronts: Vec<Front>,
    /// Number of kept nodes.
    pub kept: usize,
    /// Numbers stored by the factor.
    pub(super) factor_len: usize,
    /// Most numbers that updates wait in at once.
    pub(super) stack_len: usize,
    /// Side of the largest front.
    pub(super) largest: usize,
}

/// One dense piece of the elimination.
#[derive(Clone, Debug)]
pub(super) struct Front {
    /// First position eliminated here.
    pub first: usize,
    /// How many nodes are eliminated here.
    pub pivots: usize,
    /// Positions of the front's rows, ascending; the first `pivots` are eliminated.
    pub rows: Vec<u32>,
    /// Children in the order in which they were eliminated.
    pub children: Vec<usize>,
    /// Where each row beyond the pivots lands in the parent's rows.
    pub into_parent: Vec<u32>,
    /// Offset of the panel `L` (3·rows × 3·pivots, column-major) in the factor.
    pub offset: usize,
}

/// Widest share of zeros accepted when two fronts are merged.
const MERGE_ZEROS: f64 = 0.1;
/// Fronts with at most this many pivots are merged whatever the zeros.
const MERGE_SMALL: usize = 3;

impl SymbolicFactor {
    /// Analyses the graph `neighbours` (symmetric, without self loops, ascending lists), keeping `keep` (ascending).
    /// `places` are the nodes' places in a lattice in which neighbours are at most one apart along each axis.
    pub fn new(neighbours: &[Vec<u32>], places: &[[i32; 3]], keep: &[u32]) -> Self {
        let order = elimination_order(places, keep);
        let inner = order.len() - keep.len();
        let structure = column_structure(neighbours, &order, inner);
        let order = postorder(&order, &structure, inner);
        let structure = column_structure(neighbours, &order, inner);
        let mut position = vec![0; order.len()];
        order.iter().enumerate().for_each(|(at, &node)| position[node as usize] = at as u32);
        let fronts = build_fronts(&structure, inner, order.len());
        let factor_len = fronts.last().map_or(0, |f| f.offset);
        let stack_len = deepest_stack(&fronts);
        let largest = fronts.iter().map(|f| 3 * f.rows.len()).max().unwrap_or(0);
        Self { order, position, fronts, kept: keep.len(), factor_len, stack_len, largest }
    }
}

/// The nodes that are not kept by nested dissection, then the kept ones.
fn elimination_order(places: &[[i32; 3]], keep: &[u32]) -> Vec<u32> {
    let mut kept = vec![false; places.len()];
    keep.iter().for_each(|&node| kept[node as usize] = true);
    let mut order: Vec<u32> = (0..places.len() as u32).filter(|&n| !kept[n as usize]).collect();
    dissection::order(&mut order, places);
    order.extend_from_slice(keep);
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

/// Groups columns into fronts, links them, and adds the root over the kept positions.
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
    let kept = (inner as u32..total as u32).collect();
    fronts.push(Front {
        first: inner,
        pivots: 0,
        rows: kept,
        children: Vec::new(),
        into_parent: Vec::new(),
        offset,
    });
    link(&mut fronts, &front_of);
    fronts
}

/// Neighbouring columns that are eliminated in one front.
struct Group {
    /// First position.
    first: usize,
    /// How many positions.
    pivots: usize,
    /// Rows below them, ascending.
    below: Vec<u32>,
    /// Blocks stored although they are zero, because of merges.
    zeros: usize,
}

/// Merges the last two groups if the former is a child of the latter and few zeros are stored in all.
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
        let below = &fronts[index].rows[fronts[index].pivots..];
        let into: Vec<u32> = below
            .iter()
            .map(|row| {
                fronts[parent].rows.binary_search(row).expect("a child's rows lie in its parent") as u32
            })
            .collect();
        fronts[index].into_parent = into;
        fronts[parent].children.push(index);
    }
}

/// Most numbers that finished updates occupy while they wait for their parents.
fn deepest_stack(fronts: &[Front]) -> usize {
    let waiting = |f: &Front| (3 * (f.rows.len() - f.pivots)).pow(2);
    let (mut now, mut most) = (0, 0);
    for front in fronts {
        now -= front.children.iter().map(|&c| waiting(&fronts[c])).sum::<usize>();
        now += waiting(front);
        most = most.max(now);
    }
    most
}
