//! The samples of a tile: four per pixel for its colour, and one at its centre for its depth and object.

use wide::{bytemuck::cast, u32x8};

use super::{
    NO_TRIANGLE,
    setup::{Coverage, DrawTarget, TriangleSetup},
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
    /// The samples of the colours: row by row, pixel by pixel, each with its four samples; empty if they are not asked
    /// for.
    colours: SamplePlane,
    /// The samples of depth and object at the centres, row by row; empty if they are not asked for.
    centres: SamplePlane,
    /// First row drawn to, and the end of the last one.
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

    fn copy_from(&mut self, other: &Self) {
        self.w.clone_from(&other.w);
        self.ids.clone_from(&other.ids);
    }

    fn clear(&mut self, range: std::ops::Range<usize>, w: f32) {
        self.w[range.clone()].fill(w);
        self.ids[range].fill(NO_TRIANGLE);
    }

    /// Draws a triangle into eight samples from index `at` on, where it is nearer than what is there and `is_inside`.
    #[inline(always)]
    fn draw(&mut self, at: usize, w: f32x8, id: u32, is_inside: impl FnOnce() -> f32x8) {
        let old = self.w.get_mut(at..).and_then(|w| w.first_chunk_mut::<LANES>());
        let ids = self.ids.get_mut(at..).and_then(|ids| ids.first_chunk_mut::<LANES>());
        let (Some(old), Some(ids)) = (old, ids) else { return };
        let is_visible = w.simd_gt(f32x8::new(*old)) & is_inside();
        if is_visible.any() {
            *old = is_visible.select(w, f32x8::new(*old)).to_array();
            let mask: u32x8 = cast(is_visible);
            *ids = mask.select(u32x8::splat(id), u32x8::new(*ids)).to_array();
        }
    }
}

/// A linear function of eight samples of a chunk: its values for a chunk at the origin, and its slope.
#[derive(Clone, Copy)]
struct Linear {
    values: f32x8,
    dx: f32,
    dy: f32,
    at_origin: f32,
}

impl Linear {
    #[inline(always)]
    fn new(at_origin: f32, dx: f32, dy: f32, [x, y]: [f32x8; 2]) -> Self {
        Self { values: f32x8::splat(dx) * x + f32x8::splat(dy) * y, dx, dy, at_origin }
    }

    /// The value at the start of a row.
    #[inline(always)]
    fn row(&self, y: f32) -> f32 {
        self.at_origin + self.dy * y
    }

    /// The values of the chunk at column `x` of the row whose value at the start is `row`.
    #[inline(always)]
    fn at(&self, row: f32, x: f32) -> f32x8 {
        self.values + f32x8::splat(row + self.dx * x)
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

    /// Copies the samples of a background. Its centres are left out if they are not asked for here.
    pub(crate) fn copy_from(&mut self, background: &Self) {
        self.colours.copy_from(&background.colours);
        if self.has_centres() {
            self.centres.copy_from(&background.centres);
        }
        self.drawn_rows = [0, TILE_EDGE];
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
        let offsets = [CHUNK_X, CHUNK_Y];
        let edges = t.edges.map(|e| Linear::new(e.c, e.a, e.b, offsets));
        let thresholds = t.edges.map(|e| f32x8::splat(e.threshold));
        let plane = Linear::new(t.w, t.dw_dx, t.dw_dy, offsets);
        let (min_w, max_w) = (f32x8::splat(t.min_w), f32x8::splat(t.max_w));
        let chunks = t.columns[0] / PIXELS_PER_CHUNK..t.columns[1].div_ceil(PIXELS_PER_CHUNK);
        let first_x = (chunks.start * PIXELS_PER_CHUNK) as f32;
        let mut y = t.rows[0] as f32;
        for row in t.rows[0]..t.rows[1] {
            let row_edges = edges.map(|edge| edge.row(y));
            let row_w = plane.row(y);
            y += 1.0;
            let mut x = first_x;
            for chunk in chunks.clone() {
                // The plane of w, extrapolated to samples outside the triangle's edges, is clamped to the corners'
                // range.
                let w = plane.at(row_w, x).fast_max(min_w).fast_min(max_w);
                let at = (row * TILE_EDGE + chunk * PIXELS_PER_CHUNK) * SAMPLES_PER_PIXEL;
                let inside = |i: usize| edges[i].at(row_edges[i], x).simd_gt(thresholds[i]);
                if t.coverage == Coverage::Full {
                    self.colours.draw(at, w, t.id, || f32x8::splat(f32::from_bits(u32::MAX)));
                } else {
                    self.colours.draw(at, w, t.id, || inside(0) & inside(1) & inside(2));
                }
                x += PIXELS_PER_CHUNK as f32;
            }
        }
    }

    /// Draws a triangle at the centres only, if there are samples.
    pub(crate) fn draw_centres(&mut self, t: &TriangleSetup) {
        if !self.has_centres() {
            return;
        }
        self.drawn_rows = [self.drawn_rows[0].min(t.rows[0]), self.drawn_rows[1].max(t.rows[1])];
        let offsets = [LANE_INDEX + f32x8::HALF, f32x8::HALF];
        let edges = t.edges.map(|e| Linear::new(e.c, e.a, e.b, offsets));
        let plane = Linear::new(t.w, t.dw_dx, t.dw_dy, offsets);
        for row in t.rows[0]..t.rows[1] {
            for column in (t.columns[0] / LANES * LANES..t.columns[1]).step_by(LANES) {
                let (x, y) = (column as f32, row as f32);
                let w = plane.at(plane.row(y), x).fast_max(f32x8::splat(t.min_w));
                let inside =
                    |i: usize| edges[i].at(edges[i].row(y), x).simd_gt(f32x8::splat(t.edges[i].threshold));
                self.centres.draw(row * TILE_EDGE + column, w.fast_min(f32x8::splat(t.max_w)), t.id, || {
                    inside(0) & inside(1) & inside(2)
                });
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
