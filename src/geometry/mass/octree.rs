//! Integrals over shapes with walls so thin that a lattice of samples misses them.
//!
//! An octree is refined wherever the surface may be, down to leaves that are half as wide as the walls. The share of a
//! leaf inside of the shape follows from the signed distance at its centre: exact for planes parallel to the sides of
//! leaves, and without bias for others, since it is odd in that distance.

use super::MassProperties;
use crate::{
    Mat3, Vec3, hex8,
    shape::{Shape, SignedDistance},
};

/// Width of leaves as a share of the thickness of walls: below 1/√3, so that no leaf reaches beyond both sides of one.
const LEAF: f64 = 0.5;
/// Largest number of leaves along an edge of the octree, which bounds the time.
const MAX_LEAVES: f64 = 1024.0;
/// Factor on the half diagonal of a cell within which its centre is from the surface, if any of it is in the cell:
/// signed distances may be too large.
const REACH: f64 = 2.0;

/// A cell of the octree.
struct Cell {
    centre: Vec3,
    edge: f64,
}

/// Mass properties at 1 kg/m³ of a shape whose walls are about `wall` m thick.
pub(super) fn integrate(shape: &Shape, wall: f64) -> MassProperties {
    let bounds = shape.loose_bounds();
    let largest = bounds.size().max();
    let leaf = (LEAF * wall).max(largest / MAX_LEAVES);
    let levels = (largest / leaf).log2().ceil().max(0.0) as i32;
    let root = Cell { centre: bounds.centre(), edge: leaf * 2_f64.powi(levels) };
    let (mut volume, mut first, mut second) = (0.0, Vec3::zeros(), Mat3::zeros());
    let mut cells = vec![root];
    while let Some(Cell { centre, edge }) = cells.pop() {
        let SignedDistance { distance, normal } = shape.first_order(&centre);
        let is_uniform = distance.abs() > REACH * 0.5 * 3_f64.sqrt() * edge;
        if !is_uniform && edge > 1.5 * leaf {
            let child = |corner: usize| Cell {
                centre: centre + (hex8::corner(corner) - Vec3::repeat(0.5)) * (0.5 * edge),
                edge: 0.5 * edge,
            };
            cells.extend((0..8).map(child));
            continue;
        }
        let width = edge * normal.lp_norm(1);
        let share =
            if is_uniform { f64::from(distance < 0.0) } else { (0.5 - distance / width).clamp(0.0, 1.0) };
        if share > 0.0 {
            let mass = share * edge.powi(3);
            let from_root = centre - bounds.centre();
            volume += mass;
            first += from_root * mass;
            second += (from_root * from_root.transpose() + Mat3::identity() * (edge * edge / 12.0)) * mass;
        }
    }
    MassProperties::of_moments(volume, first, second, bounds.centre())
}
