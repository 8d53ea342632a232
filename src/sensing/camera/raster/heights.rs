//! The texels of a shadow map: the greatest height drawn at the centre of each.

use super::{
    ScreenCorners,
    setup::{Coverage, DrawTarget, TriangleBlock, TriangleSetup},
};
use crate::camera::math::{LANE_INDEX, LANES, f32x8};

/// A square of heights.
#[derive(Clone, Debug)]
pub(crate) struct HeightBuffer {
    edge: usize,
    /// Height towards the light. Rows are [`LANES`] longer than `edge`, since texels are written eight at a time.
    pub(crate) heights: Vec<f32>,
    /// First row drawn to, and the end of the last one.
    pub(crate) drawn_rows: [usize; 2],
}

impl HeightBuffer {
    /// A buffer of `edge` × `edge` texels of this height.
    pub(crate) fn new(edge: usize, height: f32) -> Self {
        Self { edge, heights: vec![height; edge * (edge + LANES)], drawn_rows: [edge, 0] }
    }

    /// Length of a row in memory.
    pub(crate) fn stride(&self) -> usize {
        self.edge + LANES
    }

    /// Clears the rows that were drawn to.
    pub(crate) fn clear(&mut self, height: f32) {
        let [from, to] = self.drawn_rows.map(|row| row * self.stride());
        if from < to {
            self.heights[from..to].fill(height);
        }
        self.drawn_rows = [self.edge, 0];
    }

    /// Draws triangles where nothing higher was drawn before. Their corners are columns, rows and heights, and run
    /// clockwise where the rows point down; other triangles face away and are skipped.
    pub(crate) fn draw(&mut self, triangles: &[ScreenCorners]) {
        let target = DrawTarget { origin: [0.0; 2], size: [self.edge; 2], inset: 0.5 };
        for some in triangles.chunks(LANES) {
            let block = TriangleBlock::new(some.iter().map(|corners| (corners, 0)), &target);
            block.triangles().for_each(|t| self.draw_triangle(&t));
        }
    }

    #[inline(always)]
    fn draw_triangle(&mut self, t: &TriangleSetup) {
        self.drawn_rows = [self.drawn_rows[0].min(t.rows[0]), self.drawn_rows[1].max(t.rows[1])];
        let stride = self.stride();
        let edges = t.edges.map(|e| (f32x8::splat(e.a), f32x8::splat(e.threshold)));
        let (slope, min, max) = (f32x8::splat(t.dw_dx), f32x8::splat(t.min_w), f32x8::splat(t.max_w));
        for row in t.rows[0]..t.rows[1] {
            let (x, y) = (0.5, row as f32 + 0.5);
            let row_edges = t.edges.map(|e| f32x8::splat(e.c + (e.b * y + e.a * x)));
            let row_height = f32x8::splat(t.w + (t.dw_dy * y + t.dw_dx * x));
            // Chunks start at multiples of eight, so that a load never spans two recent stores (no store forwarding
            // stall).
            for column in (t.columns[0] / LANES * LANES..t.columns[1]).step_by(LANES) {
                let step = f32x8::splat(column as f32) + LANE_INDEX;
                let texels = self.heights.get_mut(row * stride + column..);
                let Some(old) = texels.and_then(|texels| texels.first_chunk_mut::<LANES>()) else { break };
                let height = (row_height + slope * step).fast_max(min).fast_min(max);
                let mut is_higher = height.simd_gt(f32x8::new(*old));
                if t.coverage == Coverage::Partial {
                    let inside = |i: usize| (row_edges[i] + edges[i].0 * step).simd_gt(edges[i].1);
                    is_higher &= inside(0) & inside(1) & inside(2);
                }
                if is_higher.any() {
                    *old = is_higher.select(height, f32x8::new(*old)).to_array();
                }
            }
        }
    }
}
