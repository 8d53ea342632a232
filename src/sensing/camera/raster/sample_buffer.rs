//! Triangles into samples, eight samples at once. Edge functions are evaluated alike for both triangles of an edge, so that
//! there are neither gaps nor double hits between them (Pineda, A Parallel Algorithm for Polygon Rasterization, 1988).

use wide::{bytemuck::cast, u32x8};

use crate::sensing::camera::simd::{F8, LANES, STEPS};

/// No triangle.
pub(crate) const NONE: u32 = 0x7FFF_FFFF;

/// Rows of samples a pixel of a camera: four that share its colour, and its middle, which has its depth and object.
pub(crate) const ROWS: usize = 5;
/// The row of the middle.
pub(crate) const MIDDLE: usize = 2;
/// Where the sample of each row of a pixel lies: no two are above one another or side by side, so that edges of every
/// slope get all shades between in and out.
pub(crate) const PLACES: [[f32; 2]; ROWS] =
    [[0.375, 0.125], [0.875, 0.375], [0.5, 0.5], [0.125, 0.625], [0.625, 0.875]];

/// A rectangle of samples in `PER_UNIT` rows a unit, each row with a sample a unit: the greatest `w` at each, and whose it is.
#[derive(Clone, Debug, Default)]
pub(crate) struct SampleBuffer<const PER_UNIT: usize> {
    /// Units across; rows are [`LANES`] longer, since eight are always written.
    pub columns: usize,
    /// Rows of samples.
    pub rows: usize,
    /// Reciprocal depth, or height towards the light.
    pub w: Vec<f32>,
    /// Number of the triangle, or [`NONE`]; empty if nobody asks.
    pub id: Vec<u32>,
    /// Rows that something was drawn to, from and to.
    pub touched: [usize; 2],
}

/// Place of a row's first sample, units.
#[inline(always)]
fn place<const PER_UNIT: usize>(row: usize) -> [f32; 2] {
    if PER_UNIT == 1 {
        return [0.5, row as f32 + 0.5];
    }
    let [x, y] = PLACES[row % ROWS];
    [x, (row / ROWS) as f32 + y]
}

impl<const PER_UNIT: usize> SampleBuffer<PER_UNIT> {
    /// Empty samples at `w`; `units` high.
    pub(crate) fn new(columns: usize, units: usize, w: f32, with_ids: bool) -> Self {
        let rows = units * PER_UNIT;
        let all = rows * (columns + LANES);
        let id = vec![NONE; if with_ids { all } else { 0 }];
        Self { columns, rows, w: vec![w; all], id, touched: [rows, 0] }
    }

    /// Length of a row in memory.
    pub(crate) fn stride(&self) -> usize {
        self.columns + LANES
    }

    /// Empties what was drawn to.
    pub(crate) fn clear(&mut self, w: f32) {
        let [from, to] = self.touched.map(|row| row * self.stride());
        if from < to {
            self.w[from..to].fill(w);
            if !self.id.is_empty() {
                self.id[from..to].fill(NONE);
            }
        }
        self.touched = [self.rows, 0];
    }

    /// Draws a triangle (x, y in units from the top left, w) where nothing is nearer. Its corners run clockwise as seen
    /// in an image with y down; others face away. `origin` is the place of the first unit.
    #[inline(always)]
    pub(crate) fn draw<const IDS: bool>(&mut self, at: &[[f32; 3]; 3], origin: [f32; 2], id: u32) {
        self.draw_rows::<IDS, 0, 1>(at, origin, id);
    }

    /// The same for every `STEP`th row, from `FIRST` on.
    pub(crate) fn draw_rows<const IDS: bool, const FIRST: usize, const STEP: usize>(
        &mut self,
        at: &[[f32; 3]; 3],
        origin: [f32; 2],
        id: u32,
    ) {
        let Some(span) = Span::of::<PER_UNIT>(at, origin, [self.columns, self.rows]) else { return };
        let Some(setup) = Setup::of(at, origin) else { return };
        let size = [self.columns as f32, (self.rows / PER_UNIT) as f32];
        let Some(whole) = setup.covers(size) else { return };
        self.touched = [self.touched[0].min(span.rows[0]), self.touched[1].max(span.rows[1])];
        let stride = self.stride();
        let edges = setup.edges.map(|e| (F8::splat(e.a), F8::splat(e.least)));
        let (gx, least, most) = (F8::splat(setup.gx), F8::splat(setup.least), F8::splat(setup.most));
        let start = span.rows[0].next_multiple_of(STEP) + FIRST;
        for row in (start..span.rows[1]).step_by(STEP) {
            let [x, y] = place::<PER_UNIT>(row);
            let starts = setup.edges.map(|e| F8::splat(e.c + (e.b * y + e.a * x)));
            let w_row = F8::splat(setup.w + (setup.gy * y + setup.gx * x));
            // At multiples of eight, so that what was just written is read whole.
            let mut column = span.columns[0] / LANES * LANES;
            while column < span.columns[1] {
                let step = F8::splat(column as f32) + STEPS;
                let at = row * stride + column;
                column += LANES;
                let Some(old) = self.w.get_mut(at..).and_then(|w| w.first_chunk_mut::<LANES>()) else {
                    break;
                };
                let w = (w_row + gx * step).fast_max(least).fast_min(most);
                let mut take = w.simd_gt(F8::new(*old));
                if !whole {
                    let inside = |i: usize| (starts[i] + edges[i].0 * step).simd_gt(edges[i].1);
                    take &= inside(0) & inside(1) & inside(2);
                }
                if !take.any() {
                    continue;
                }
                *old = take.select(w, F8::new(*old)).to_array();
                if let (true, Some(ids)) =
                    (IDS, self.id.get_mut(at..).and_then(|id| id.first_chunk_mut::<LANES>()))
                {
                    let mask: u32x8 = cast(take);
                    *ids = mask.select(u32x8::splat(id), u32x8::new(*ids)).to_array();
                }
            }
        }
    }
}

/// The least w of a triangle in a square of an edge `size`, if it covers all of it.
pub(crate) fn cover(at: &[[f32; 3]; 3], origin: [f32; 2], size: f32) -> Option<f32> {
    let setup = Setup::of(at, origin)?;
    let corners = [[0.0; 2], [size, 0.0], [0.0, size], [size; 2]]
        .map(|[x, y]| (setup.w + (setup.gy * y + setup.gx * x)).clamp(setup.least, setup.most));
    setup.covers([size; 2])?.then(|| corners.into_iter().fold(f32::MAX, f32::min))
}

/// The rows and columns of samples that a triangle can touch.
struct Span {
    rows: [usize; 2],
    columns: [usize; 2],
}

impl Span {
    #[inline(always)]
    fn of<const PER_UNIT: usize>(at: &[[f32; 3]; 3], origin: [f32; 2], size: [usize; 2]) -> Option<Self> {
        let range = |axis: usize| {
            let low = at[0][axis].min(at[1][axis]).min(at[2][axis]) - origin[axis];
            let high = at[0][axis].max(at[1][axis]).max(at[2][axis]) - origin[axis];
            (low, high)
        };
        let [[left, top], [right, bottom]] =
            if PER_UNIT == 1 { [[0.5; 2]; 2] } else { [[0.125; 2], [0.875; 2]] };
        // Whole units that have samples between; conversions saturate.
        let between = |low: f32, high: f32, most: usize| {
            let (from, to) = (low.ceil().max(0.0) as usize, (high.floor() + 1.0).max(0.0) as usize);
            [from, to.min(most)]
        };
        let (low, high) = range(0);
        let columns = between(low - right, high - left, size[0]);
        let (low, high) = range(1);
        let [from, to] = between(low - bottom, high - top, size[1] / PER_UNIT);
        let mut rows = [from * PER_UNIT, to * PER_UNIT];
        while rows[0] < rows[1] && place::<PER_UNIT>(rows[0])[1] < low {
            rows[0] += 1;
        }
        while rows[0] < rows[1] && place::<PER_UNIT>(rows[1] - 1)[1] > high {
            rows[1] -= 1;
        }
        (rows[0] < rows[1] && columns[0] < columns[1]).then_some(Self { rows, columns })
    }
}

/// The line through two corners, a x + b y + c; inside where it is above `least`.
#[derive(Clone, Copy)]
struct Edge {
    a: f32,
    b: f32,
    c: f32,
    /// 0 or just below: whether points exactly on the line belong to this side.
    least: f32,
}

/// A triangle's edges and its w = w + gx x + gy y, clamped to what its corners have.
struct Setup {
    edges: [Edge; 3],
    w: f32,
    gx: f32,
    gy: f32,
    least: f32,
    most: f32,
}

impl Setup {
    /// None if it faces away or has no area.
    fn of(at: &[[f32; 3]; 3], origin: [f32; 2]) -> Option<Self> {
        let [a, b, c] = at.map(|v| v.map(f64::from));
        let (bx, by, bw) = (b[0] - a[0], b[1] - a[1], b[2] - a[2]);
        let (cx, cy, cw) = (c[0] - a[0], c[1] - a[1], c[2] - a[2]);
        let area = bx * cy - cx * by;
        if area.is_nan() || area <= 0.0 {
            return None;
        }
        let (gx, gy) = ((bw * cy - cw * by) / area, (bx * cw - cx * bw) / area);
        let origin = origin.map(f64::from);
        let w = a[2] + gx * (origin[0] - a[0]) + gy * (origin[1] - a[1]);
        let edge = |i: usize| edge(&at[i], &at[(i + 1) % 3], origin);
        Some(Self {
            edges: [edge(0), edge(1), edge(2)],
            w: w as f32,
            gx: gx as f32,
            gy: gy as f32,
            least: at[0][2].min(at[1][2]).min(at[2][2]),
            most: at[0][2].max(at[1][2]).max(at[2][2]),
        })
    }

    /// Whether a rectangle from the origin lies wholly inside; none if wholly outside.
    fn covers(&self, size: [f32; 2]) -> Option<bool> {
        let mut whole = true;
        for e in &self.edges {
            let (x, y) = (e.a * size[0], e.b * size[1]);
            if e.c + x.max(0.0) + y.max(0.0) < 0.0 {
                return None;
            }
            whole &= e.c + x.min(0.0) + y.min(0.0) > 0.0;
        }
        Some(whole)
    }
}

fn edge(from: &[f32; 3], to: &[f32; 3], origin: [f64; 2]) -> Edge {
    // One order for both triangles of an edge, and the sign after.
    let flipped = (from[0], from[1]) > (to[0], to[1]);
    let (p, q) = if flipped { (to, from) } else { (from, to) };
    let sign = if flipped { -1.0 } else { 1.0 };
    let (px, py) = (f64::from(p[0]), f64::from(p[1]));
    let (a, b) = (py - f64::from(q[1]), f64::from(q[0]) - px);
    let c = a * (origin[0] - px) + b * (origin[1] - py);
    let (a, b, c) = (sign * a, sign * b, sign * c);
    let owns = a > 0.0 || (a == 0.0 && b > 0.0);
    Edge { a: a as f32, b: b as f32, c: c as f32, least: if owns { -f32::MIN_POSITIVE } else { 0.0 } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_of_one_edge_neither_overlap_nor_leave_a_gap() {
        // A fan around a point, over all of the square; odd numbers, so that edges pass through samples too.
        for middle in [[13.0, 17.5], [7.3, 21.9], [16.375, 16.125]] {
            let rim = [[-3.0, -3.0], [16.0, -3.0], [40.0, -3.0], [40.0, 16.0], [40.0, 40.0], [-3.0, 40.0]];
            let mut hits = vec![0; 32 * ROWS * (32 + LANES)];
            for i in 0..rim.len() {
                let mut samples = SampleBuffer::<ROWS>::new(32, 32, 0.0, true);
                let [a, b] = [rim[i], rim[(i + 1) % rim.len()]].map(|[x, y]| [x, y, 1.0]);
                samples.draw::<true>(&[[middle[0], middle[1], 1.0], a, b], [0.0; 2], 7);
                hits.iter_mut().zip(&samples.id).for_each(|(hits, id)| *hits += i32::from(*id == 7));
            }
            for row in hits.chunks(32 + LANES) {
                assert!(row[..32].iter().all(|h| *h == 1), "{middle:?}: {row:?}");
            }
        }
    }

    #[test]
    fn a_triangle_covers_as_many_samples_as_its_area_has() {
        let mut samples = SampleBuffer::<ROWS>::new(32, 32, 0.0, true);
        samples.draw::<true>(&[[2.2, 3.1, 1.0], [29.7, 8.4, 1.0], [11.5, 30.3, 1.0]], [0.0; 2], 1);
        let area = 0.5 * (27.5 * 27.2 - 9.3 * 5.3);
        let count = samples.id.iter().filter(|id| **id == 1).count() as f32 / ROWS as f32;
        assert!((count - area).abs() < 2.0, "{count} pixels, {area} expected");
    }
}
