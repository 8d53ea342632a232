//! The samples of a tile: four per pixel for its colour, and one at its centre for its depth and object.

use wide::{bytemuck::cast, u32x8};

use super::{
    NO_TRIANGLE,
    setup::{Coverage, DrawTarget, EdgeFunction, TriangleSetup},
};
use crate::camera::math::{LANE_INDEX, LANES, f32x8};

/// Edge of a tile, pixels: the samples of a tile fit in the first-level cache.
pub(crate) const TILE_EDGE: usize = 32;

/// Number of samples of a pixel that share its colour.
pub(crate) const SAMPLES_PER_PIXEL: usize = 4;
/// Their positions within the pixel. Each has a row and a column of its own, so edges of every slope are antialiased.
pub(crate) const SAMPLE_OFFSETS: [[f32; 2]; SAMPLES_PER_PIXEL] =
    [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];
/// Distance of the outermost samples from the border of the pixel.
const INSET: f32 = 0.125;

/// Number of pixels that eight samples belong to.
const PIXELS_PER_CHUNK: usize = LANES / SAMPLES_PER_PIXEL;
/// Minimum width, chunks, of triangles for which the span of each row is found first.
const MIN_WIDE_CHUNKS: usize = 4;
/// Maximum slope, columns per row, of the edges that bound spans.
const MAX_SPAN_SLOPE: f32 = 1e3;
/// Relative rounding error of spans and edge functions: 32 ulp.
const SPAN_ROUNDING: f32 = 32.0 * f32::EPSILON;
/// Position of each of the eight samples of two neighbouring pixels.
const CHUNK_X: f32x8 = f32x8::new(chunk_offsets(0));
const CHUNK_Y: f32x8 = f32x8::new(chunk_offsets(1));

const fn chunk_offsets(axis: usize) -> [f32; LANES] {
    let mut offsets = [0.0; LANES];
    let mut lane = 0;
    while lane < LANES {
        let pixel = if axis == 0 { lane / SAMPLES_PER_PIXEL } else { 0 };
        offsets[lane] = pixel as f32 + SAMPLE_OFFSETS[lane % SAMPLES_PER_PIXEL][axis];
        lane += 1;
    }
    offsets
}

/// The samples of a tile. Each keeps the greatest reciprocal depth drawn there and the id of its triangle.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileSamples {
    /// The samples of the colours: row by row, pixel by pixel, each with its four samples; empty if they
    /// are not asked for.
    colours: SamplePlane,
    /// The samples of depth and object at the centres, row by row; empty if they are not asked for.
    centres: SamplePlane,
    /// First row drawn to or copied, and the end of the last one.
    drawn_rows: [usize; 2],
}

#[derive(Clone, Debug, Default)]
struct SamplePlane {
    w: Vec<f32>,
    ids: Vec<u32>,
}

impl SamplePlane {
    fn new(len: usize, w: f32) -> Self {
        Self { w: vec![w; len], ids: vec![NO_TRIANGLE; len] }
    }

    fn copy_from(&mut self, other: &Self, range: std::ops::Range<usize>) {
        self.w[range.clone()].copy_from_slice(&other.w[range.clone()]);
        self.ids[range.clone()].copy_from_slice(&other.ids[range]);
    }

    fn clear(&mut self, range: std::ops::Range<usize>, w: f32) {
        self.w[range.clone()].fill(w);
        self.ids[range].fill(NO_TRIANGLE);
    }

    /// Reciprocal depths and ids in a range of eights of samples.
    #[inline(always)]
    fn chunks(&mut self, range: std::ops::Range<usize>) -> impl Iterator<Item = SampleChunk<'_>> {
        let w = self.w.get_mut(range.start * LANES..range.end * LANES).unwrap_or_default();
        let ids = self.ids.get_mut(range.start * LANES..range.end * LANES).unwrap_or_default();
        let chunks = w.as_chunks_mut().0.iter_mut().zip(ids.as_chunks_mut().0);
        chunks.map(|(w, ids)| SampleChunk { w, ids })
    }
}

/// Eight neighbouring samples of a plane.
struct SampleChunk<'a> {
    w: &'a mut [f32; LANES],
    ids: &'a mut [u32; LANES],
}

impl SampleChunk<'_> {
    /// Draws triangle `id` where it is nearer than what is there and `is_inside`.
    #[inline(always)]
    fn draw(&mut self, w: f32x8, id: u32, is_inside: impl FnOnce() -> f32x8) {
        let old = f32x8::new(*self.w);
        let is_visible = w.simd_gt(old) & is_inside();
        if is_visible.any() {
            *self.w = is_visible.select(w, old).to_array();
            let mask: u32x8 = cast(is_visible);
            *self.ids = mask.select(u32x8::splat(id), u32x8::new(*self.ids)).to_array();
        }
    }
}

/// A linear function of the position of samples. Both triangles of an edge evaluate it alike, up to the sign.
#[derive(Clone, Copy)]
struct ChunkPlane {
    /// Change per column of pixels.
    slope: f32x8,
    /// Change from the start of a row to the samples in it.
    in_row: f32x8,
    dy: f32,
    at_origin: f32,
}

impl ChunkPlane {
    #[inline(always)]
    fn new(at_origin: f32, dx: f32, dy: f32) -> Self {
        Self { slope: f32x8::splat(dx), in_row: f32x8::splat(dy) * CHUNK_Y, dy, at_origin }
    }

    /// The values at column 0 of the row that starts at `y`.
    #[inline(always)]
    fn row(&self, y: f32) -> f32x8 {
        self.in_row + f32x8::splat(self.at_origin + self.dy * y)
    }
}

/// A triangle, to be evaluated at the samples of chunks.
struct ChunkPlanes {
    edges: [ChunkPlane; 3],
    thresholds: [f32x8; 3],
    w: ChunkPlane,
    /// Lowest and highest w of the corners.
    range: [f32x8; 2],
    id: u32,
    is_full: bool,
}

impl ChunkPlanes {
    #[inline(always)]
    fn new(t: &TriangleSetup) -> Self {
        Self {
            edges: t.edges.map(|e| ChunkPlane::new(e.c, e.a, e.b)),
            thresholds: t.edges.map(|e| f32x8::splat(e.threshold)),
            w: ChunkPlane::new(t.w, t.dw_dx, t.dw_dy),
            range: [t.min_w, t.max_w].map(f32x8::splat),
            id: t.id,
            is_full: t.coverage == Coverage::Full,
        }
    }
}

impl TriangleSetup {
    /// Chunks in which a triangle may cover samples, in eight rows from `first` on: the first one, and the end
    /// of the last one.
    #[inline(always)]
    fn chunk_spans(&self, first: usize) -> [[i32; LANES]; 2] {
        let y = LANE_INDEX + f32x8::splat(first as f32 + 0.5);
        let edge = TILE_EDGE as f32;
        let (mut low, mut high) = (f32x8::ZERO, f32x8::splat(edge - 1.0));
        for e in &self.edges {
            // Edges along a row bound nothing.
            let is_steep = e.b.abs() < MAX_SPAN_SLOPE * e.a.abs();
            let inverse = if is_steep { -1.0 / e.a } else { 0.0 };
            let (at_origin, slope) = (e.c * inverse, e.b * inverse);
            let rounding = SPAN_ROUNDING * (edge + at_origin.abs() + edge * slope.abs());
            let reach = (0.5 - INSET) * slope.abs() + rounding;
            let bound = |bounds: bool, reach: f32, none: f32| f32x8::splat(if bounds { reach } else { none });
            let crossing = y * f32x8::splat(slope) + f32x8::splat(at_origin);
            low = low.fast_max(crossing + bound(is_steep && e.a > 0.0, -reach, f32::NEG_INFINITY));
            high = high.fast_min(crossing + bound(is_steep && e.a < 0.0, reach, f32::INFINITY));
        }
        let per_pixel = f32x8::splat(1.0 / PIXELS_PER_CHUNK as f32);
        let to = (high * per_pixel + f32x8::ONE).fast_max(f32x8::ZERO);
        let from = low.fast_min(f32x8::splat(edge)) * per_pixel;
        [from, to].map(|x| x.fast_trunc_int().to_array())
    }
}

impl TileSamples {
    /// The tile whose first pixel is `origin`.
    pub(crate) fn target(origin: [f32; 2]) -> DrawTarget {
        DrawTarget { origin, size: [TILE_EDGE; 2], inset: INSET }
    }

    /// Samples cleared to `w`.
    pub(crate) fn new(w: f32, has_colours: bool, has_centres: bool) -> Self {
        let pixels = TILE_EDGE * TILE_EDGE;
        Self {
            colours: SamplePlane::new(if has_colours { SAMPLES_PER_PIXEL * pixels } else { 0 }, w),
            centres: SamplePlane::new(if has_centres { pixels } else { 0 }, w),
            drawn_rows: [TILE_EDGE, 0],
        }
    }

    /// True if there are samples at the centres.
    pub(crate) fn has_centres(&self) -> bool {
        !self.centres.w.is_empty()
    }

    /// Clears the rows that were drawn to.
    pub(crate) fn clear(&mut self, w: f32) {
        let [from, to] = self.drawn_rows.map(|row| row * TILE_EDGE);
        if from < to {
            if !self.colours.w.is_empty() {
                self.colours.clear(SAMPLES_PER_PIXEL * from..SAMPLES_PER_PIXEL * to, w);
            }
            if self.has_centres() {
                self.centres.clear(from..to, w);
            }
        }
        self.drawn_rows = [TILE_EDGE, 0];
    }

    /// Copies some rows of the samples of a background. Its centres are left out if they are not asked for here.
    pub(crate) fn copy_rows(&mut self, background: &Self, rows: std::ops::Range<usize>) {
        let [from, to] = [rows.start, rows.end].map(|row| row * TILE_EDGE);
        self.colours.copy_from(&background.colours, SAMPLES_PER_PIXEL * from..SAMPLES_PER_PIXEL * to);
        if self.has_centres() {
            self.centres.copy_from(&background.centres, from..to);
        }
        self.drawn_rows = [rows.start, rows.end];
    }

    /// The rows that were drawn to or copied.
    pub(crate) fn rows(&self) -> std::ops::Range<usize> {
        self.drawn_rows[0]..self.drawn_rows[1].max(self.drawn_rows[0])
    }

    /// Draws a triangle where no nearer one was drawn before.
    #[inline(always)]
    pub(crate) fn draw(&mut self, t: &TriangleSetup) {
        if !self.colours.w.is_empty() {
            self.draw_colours(t);
        }
        self.draw_centres(t);
    }

    #[inline(always)]
    fn draw_colours(&mut self, t: &TriangleSetup) {
        self.drawn_rows = [self.drawn_rows[0].min(t.rows[0]), self.drawn_rows[1].max(t.rows[1])];
        let planes = ChunkPlanes::new(t);
        let chunks = t.columns[0] / PIXELS_PER_CHUNK..t.columns[1].div_ceil(PIXELS_PER_CHUNK);
        if t.coverage == Coverage::Full || chunks.len() < MIN_WIDE_CHUNKS {
            (t.rows[0]..t.rows[1]).for_each(|row| self.draw_row(&planes, row, chunks.clone()));
            return;
        }
        for first in (t.rows[0]..t.rows[1]).step_by(LANES) {
            let [from, to] = t.chunk_spans(first);
            for (row, (from, to)) in (first..t.rows[1]).zip(from.into_iter().zip(to)) {
                let span = chunks.start.max(from as usize)..chunks.end.min(to as usize);
                self.draw_row(&planes, row, span);
            }
        }
    }

    /// Draws some chunks of a row of the colours.
    #[inline(always)]
    fn draw_row(&mut self, planes: &ChunkPlanes, row: usize, chunks: std::ops::Range<usize>) {
        let ChunkPlanes { edges, thresholds, w: plane, range: [min_w, max_w], id, is_full } = planes;
        let (at, y) = (row * (TILE_EDGE / PIXELS_PER_CHUNK), row as f32);
        let (row_edges, row_w) = (edges.map(|edge| edge.row(y)), plane.row(y));
        let mut x = CHUNK_X + f32x8::splat((chunks.start * PIXELS_PER_CHUNK) as f32);
        for mut chunk in self.colours.chunks(at + chunks.start..at + chunks.end) {
            // The plane of w, extrapolated to samples outside the triangle's edges, is clamped to the corners' range.
            let w = (row_w + plane.slope * x).fast_max(*min_w).fast_min(*max_w);
            let inside = |i: usize| (row_edges[i] + edges[i].slope * x).simd_gt(thresholds[i]);
            if *is_full {
                chunk.draw(w, *id, || f32x8::splat(f32::from_bits(u32::MAX)));
            } else {
                chunk.draw(w, *id, || inside(0) & inside(1) & inside(2));
            }
            x += f32x8::splat(PIXELS_PER_CHUNK as f32);
        }
    }

    /// Draws a triangle at the centres only, if there are samples.
    pub(crate) fn draw_centres(&mut self, t: &TriangleSetup) {
        if !self.has_centres() {
            return;
        }
        self.drawn_rows = [self.drawn_rows[0].min(t.rows[0]), self.drawn_rows[1].max(t.rows[1])];
        let chunks = t.columns[0] / LANES..t.columns[1].div_ceil(LANES);
        for row in t.rows[0]..t.rows[1] {
            let at = row * (TILE_EDGE / LANES);
            let y = f32x8::splat(row as f32 + 0.5);
            let mut x = LANE_INDEX + f32x8::splat((chunks.start * LANES) as f32 + 0.5);
            for mut chunk in self.centres.chunks(at + chunks.start..at + chunks.end) {
                let value =
                    |c: f32, dx: f32, dy: f32| f32x8::splat(c) + f32x8::splat(dy) * y + f32x8::splat(dx) * x;
                let w = value(t.w, t.dw_dx, t.dw_dy).fast_max(f32x8::splat(t.min_w));
                let is_inside = |e: &EdgeFunction| value(e.c, e.a, e.b).simd_gt(f32x8::splat(e.threshold));
                let [a, b, c] = &t.edges;
                chunk.draw(w.fast_min(f32x8::splat(t.max_w)), t.id, || {
                    is_inside(a) & is_inside(b) & is_inside(c)
                });
                x += f32x8::splat(LANES as f32);
            }
        }
    }

    /// Triangle ids of the samples of eight pixels from the pixel (x, y) on, four for each pixel.
    #[inline(always)]
    pub(crate) fn colour_ids(&self, x: usize, y: usize) -> [u32; SAMPLES_PER_PIXEL * LANES] {
        let at = SAMPLES_PER_PIXEL * (y * TILE_EDGE + x);
        self.colours.ids[at..].first_chunk().copied().unwrap_or([NO_TRIANGLE; SAMPLES_PER_PIXEL * LANES])
    }

    /// Triangle ids and reciprocal depths at the centres of eight pixels from the pixel (x, y) on.
    pub(crate) fn centres(&self, x: usize, y: usize) -> ([u32; LANES], f32x8) {
        let at = y * TILE_EDGE + x;
        let ids = self.centres.ids[at..].first_chunk().copied().unwrap_or([NO_TRIANGLE; LANES]);
        (ids, f32x8::new(self.centres.w[at..].first_chunk().copied().unwrap_or_default()))
    }
}

#[cfg(test)]
mod tests {
    use super::{super::setup::TriangleBlock, *};

    #[test]
    fn spans_leave_out_no_sample_that_a_triangle_covers() {
        // Pseudo-random corners, up to 1e4 px outside the tile, many of them at samples, and nearly level edges.
        let mut seed = 1_u32;
        let mut random = |reach: f32, step: f32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let at = 16.0 + reach * (seed as f32 / u32::MAX as f32 - 0.5);
            if step > 0.0 { (at / step).round() * step } else { at }
        };
        let mut drawn = 0;
        for i in 0..6000 {
            let (reach, step) = ([40.0, 400.0, 2e4][i % 3], [0.0, 0.125, 0.25, 1.0][i / 3 % 4]);
            let height = if i % 2 == 0 { reach } else { 4.0 };
            let corners = [0, 1, 2].map(|_| [random(reach, step), random(height, step), 1.0]);
            let block = TriangleBlock::new([(&corners, 7)].into_iter(), &TileSamples::target([0.0; 2]));
            for t in block.triangles() {
                let [mut by_spans, mut by_rows] = [0, 1].map(|_| TileSamples::new(0.0, true, false));
                by_spans.draw(&t);
                let chunks = t.columns[0] / PIXELS_PER_CHUNK..t.columns[1].div_ceil(PIXELS_PER_CHUNK);
                for row in t.rows[0]..t.rows[1] {
                    by_rows.draw_row(&ChunkPlanes::new(&t), row, chunks.clone());
                }
                assert_eq!(by_spans.colours.ids, by_rows.colours.ids, "{corners:?}");
                drawn += by_rows.colours.ids.iter().filter(|id| **id == 7).count();
            }
        }
        assert!(drawn > 200_000, "{drawn} samples");
    }
}
