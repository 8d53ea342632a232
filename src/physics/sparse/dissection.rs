//! Nested dissection of a voxel lattice (George 1973): planes of nodes separate it into halves that are not coupled.
//!
//! On lattices of hundreds to thousands of nodes, of which few are retained, this needs half of the operations of
//! approximate minimum degree, since a plane is the smallest separator of a lattice.

/// Parts with at most this many nodes are not split further.
const LEAF: usize = 8;

/// Sorts `nodes` into elimination order: both halves first, then the plane between them.
/// `places` are lattice coordinates.
pub(super) fn order(nodes: &mut [u32], places: &[[i32; 3]]) {
    if nodes.len() <= LEAF {
        return;
    }
    let place = |node: u32, axis: usize| places[node as usize][axis];
    let range = |axis: usize| {
        let all = nodes.iter().map(|&node| place(node, axis));
        all.fold((i32::MAX, i32::MIN), |(min, max), at| (min.min(at), max.max(at)))
    };
    let extents = [0, 1, 2].map(range);
    let width = |axis: usize| extents[axis].1 - extents[axis].0;
    let axis = (0..3).rev().max_by_key(|&axis| width(axis)).unwrap_or(0);
    let (min, max) = extents[axis];
    if max - min < 2 {
        return;
    }
    let mut along: Vec<i32> = nodes.iter().map(|&node| place(node, axis)).collect();
    along.sort_unstable();
    // The plane through the median leaves about half of the nodes on either side, and at least one on each.
    let plane = along[along.len() / 2].clamp(min + 1, max - 1);
    // A stable sort, so that the order does not depend on the sorting algorithm.
    nodes.sort_by_key(|&node| match place(node, axis).cmp(&plane) {
        std::cmp::Ordering::Less => 0,
        std::cmp::Ordering::Greater => 1,
        std::cmp::Ordering::Equal => 2,
    });
    let low = nodes.partition_point(|&node| place(node, axis) < plane);
    let high = low + nodes[low..].partition_point(|&node| place(node, axis) > plane);
    let (halves, separator) = nodes.split_at_mut(high);
    let (low, high) = halves.split_at_mut(low);
    [low, high, separator].into_iter().for_each(|part| order(part, places));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_split_leaves_two_uncoupled_halves() {
        let places: Vec<[i32; 3]> = (0..7 * 5 * 4).map(|i| [i % 7, i / 7 % 5, i / 35]).collect();
        let mut nodes: Vec<u32> = (0..places.len() as u32).collect();
        order(&mut nodes, &places);
        let x = |node: &u32| places[*node as usize][0];
        assert!(nodes[..60].iter().all(|node| x(node) < 3));
        assert!(nodes[60..120].iter().all(|node| x(node) > 3));
        assert!(nodes[120..].iter().all(|node| x(node) == 3));
        nodes.sort_unstable();
        assert!(nodes.iter().enumerate().all(|(i, &node)| i as u32 == node), "each node once");
    }
}
