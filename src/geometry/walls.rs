//! Thickness of the walls of shapes.

use super::{Vec3, shape::Shape};

/// Lines along each edge of a side of the bounding box, along which the thickness of walls is measured.
const LINES: usize = 12;
/// Smallest step along a line, as a share of the thickness that is looked for.
const MIN_STEP: f64 = 0.05;
/// Share of the length of all lines inside of the shape that thin walls must have to matter.
const SHARE: f64 = 0.01;

/// The part of a line that is inside of a shape.
#[derive(Clone, Copy)]
struct Chord {
    length: f64,
    /// Thickness of the wall that it passes, if both sides are parallel.
    thickness: f64,
}

/// Thickness of the walls that lines parallel to the axes pass within less than `most`, m; `None` if they hold at most
/// a hundredth of the volume. A lattice of this width has a point in all other walls, on every line along some axis.
pub fn wall_below(shape: &Shape, most: f64) -> Option<f64> {
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
