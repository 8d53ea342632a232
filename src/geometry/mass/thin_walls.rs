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

/// Lines along each edge of a side of the bounding box, along which the thickness of walls is measured.
const LINES: usize = 12;
/// Smallest step along a line, as a share of the thickness that is looked for.
const MIN_STEP: f64 = 0.05;
/// Share of the length of all lines inside of the shape that thin walls must have to matter.
const SHARE: f64 = 0.01;
/// Width of leaves as a share of the thickness of walls: below 1/√3, so that no leaf reaches beyond both sides of one.
const LEAF: f64 = 0.5;
/// Largest number of leaves along an edge of the octree, which bounds the time.
const MAX_LEAVES: f64 = 1024.0;
/// Factor on the half diagonal of a cell within which its centre is from the surface, if any of it is in the cell:
/// signed distances may be too large.
const REACH: f64 = 2.0;

/// The part of a line that is inside of a shape.
#[derive(Clone, Copy)]
struct Chord {
    length: f64,
    /// Thickness of the wall that it passes, if both sides are parallel.
    thickness: f64,
}

/// Thickness of the walls that lines parallel to the axes pass within less than `most`, m; `None` if they hold at most
/// a hundredth of the volume. A lattice of this width has a point in all other walls, on every line along some axis.
pub(super) fn wall_below(shape: &Shape, most: f64) -> Option<f64> {
    (0..3).filter_map(|axis| wall_along(shape, axis, most)).reduce(f64::min)
}

fn wall_along(shape: &Shape, axis: usize, most: f64) -> Option<f64> {
    let mut chords = chords_along(shape, axis, MIN_STEP * most);
    chords.sort_by(|a, b| a.length.total_cmp(&b.length));
    let total: f64 = chords.iter().map(|chord| chord.length).sum();
    let mut thin: Vec<Chord> = chords.into_iter().take_while(|chord| chord.length < most).collect();
    if thin.iter().map(|chord| chord.length).sum::<f64>() <= SHARE * total {
        return None;
    }
    // Grazed rims and edges, which are thinner still, do not count.
    thin.sort_by(|a, b| a.thickness.total_cmp(&b.thickness));
    let mut sum = 0.0;
    let counts = |chord: &Chord| {
        sum += chord.length;
        sum > 0.5 * SHARE * total
    };
    thin.into_iter().find(counts).map(|chord| chord.thickness)
}

/// The chords of lines parallel to an axis, to `min_step` m.
fn chords_along(shape: &Shape, axis: usize, min_step: f64) -> Vec<Chord> {
    let bounds = shape.loose_bounds();
    let (size, u, v) = (bounds.size(), (axis + 1) % 3, (axis + 2) % 3);
    let mut chords = Vec::new();
    for line in 0..LINES * LINES {
        let share = |index: usize| (index as f64 + 0.5) / LINES as f64;
        let mut p = bounds.min;
        p[u] += size[u] * share(line % LINES);
        p[v] += size[v] * share(line / LINES);
        let mut entered: Option<Vec3> = None;
        while p[axis] < bounds.max[axis] {
            let distance = shape.distance(&p);
            if let Some(from) = entered.filter(|_| distance >= 0.0) {
                let length = p[axis] - from[axis];
                let cosine = shape.first_order(&from).normal[axis].abs();
                chords.push(Chord { length, thickness: length * cosine });
                entered = None;
            } else if entered.is_none() && distance < 0.0 {
                entered = Some(p);
            }
            p[axis] += distance.abs().max(min_step);
        }
        chords.extend(entered.map(|from| {
            let length = bounds.max[axis] - from[axis];
            Chord { length, thickness: length }
        }));
    }
    chords
}

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
