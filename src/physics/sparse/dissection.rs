//! Nested dissection of a voxel lattice (George 1973): planes of nodes split it in halves that do not touch.
//!
//! On lattices of some hundred to some thousand nodes with few kept ones this needs half of the operations that
//! approximate minimum degree does, since a plane is the smallest separator that there is.

/// Parts with at most this many nodes are not split further.
const LEAF: usize = 8;

/// Puts `nodes` in an elimination order: both halves first, then the plane between them.
pub(super) fn order(nodes: &mut [u32], places: &[[i32; 3]]) {
    if nodes.len() <= LEAF {
        return;
    }
    let place = |node: u32, axis: usize| places[node as usize][axis];
    let range = |axis: usize| {
        let all = nodes.iter().map(|&node| place(node, axis));
        all.fold((i32::MAX, i32::MIN), |(least, most), at| (least.min(at), most.max(at)))
    };
    let extents = [0, 1, 2].map(range);
    let width = |axis: usize| extents[axis].1 - extents[axis].0;
    let axis = (0..3).rev().max_by_key(|&axis| width(axis)).unwrap_or(0);
    let (least, most) = extents[axis];
    if most - least < 2 {
        return;
    }
    let mut along: Vec<i32> = nodes.iter().map(|&node| place(node, axis)).collect();
    along.sort_unstable();
    // The plane through the median has about half of the nodes on either side, and both sides have some.
    let plane = along[along.len() / 2].clamp(least + 1, most - 1);
    // Stable, so that the order does not depend on how the sort is done.
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
    fn the_first_split_leaves_two_halves_that_do_not_touch() {
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
