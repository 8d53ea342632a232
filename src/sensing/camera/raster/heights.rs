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
    /// First column drawn to, and the end of the last one.
    pub(crate) drawn_columns: [usize; 2],
}

impl HeightBuffer {
    /// A buffer of `edge` × `edge` texels of this height.
    pub(crate) fn new(edge: usize, height: f32) -> Self {
        Self {
            edge,
            heights: vec![height; edge * Self::stride_of(edge)],
            drawn_rows: [edge, 0],
            drawn_columns: [edge, 0],
        }
    }

    /// Length of a row in memory, of a buffer of this edge.
    pub(crate) const fn stride_of(edge: usize) -> usize {
        edge + LANES
    }

    /// Length of a row in memory.
    pub(crate) fn stride(&self) -> usize {
        Self::stride_of(self.edge)
    }

    /// Clears the rows and columns that were drawn to.
    pub(crate) fn clear(&mut self, height: f32) {
        let ([from, to], [first, last]) = (self.drawn_rows, self.drawn_columns);
        // Texels are written eight at a time.
        let (first, end) = (first / LANES * LANES, last.next_multiple_of(LANES));
        for row in from..to {
            let start = row * self.stride();
            self.heights[start + first..start + end].fill(height);
        }
        (self.drawn_rows, self.drawn_columns) = ([self.edge, 0], [self.edge, 0]);
    }

    /// Draws triangles where nothing higher was drawn before. Their corners are columns, rows and heights, and run
    /// clockwise where the rows point down; other triangles face away and are skipped.
    pub(crate) fn draw(&mut self, triangles: impl Iterator<Item = ScreenCorners>) {
        let target = DrawTarget { origin: [0.0; 2], size: [self.edge; 2], inset: 0.5 };
        let mut some = [ScreenCorners::default(); LANES];
        let mut count = 0;
        let mut draw = |some: &[ScreenCorners]| {
            let block = TriangleBlock::new(some.iter().map(|corners| (corners, 0)), &target);
            block.triangles().for_each(|t| self.draw_triangle(&t));
        };
        for corners in triangles {
            some[count] = corners;
            count += 1;
            if count == LANES {
                draw(&some);
                count = 0;
            }
        }
        draw(&some[..count]);
    }

    #[inline(always)]
    fn draw_triangle(&mut self, t: &TriangleSetup) {
        self.drawn_rows = [self.drawn_rows[0].min(t.rows[0]), self.drawn_rows[1].max(t.rows[1])];
        let [first, last] = self.drawn_columns;
        self.drawn_columns = [first.min(t.columns[0]), last.max(t.columns[1])];
        let stride = self.stride();
        let edges = t.edges.map(|e| (f32x8::splat(e.a), f32x8::splat(e.threshold)));
        let (slope, min, max) = (f32x8::splat(t.dw_dx), f32x8::splat(t.min_w), f32x8::splat(t.max_w));
        // Chunks start at multiples of eight, so that a load never spans two recent stores (no store forwarding stall).
        let first = t.columns[0] / LANES * LANES;
        let first_step = f32x8::splat(first as f32) + LANE_INDEX;
        let mut y = t.rows[0] as f32 - 0.5;
        for row in t.rows[0]..t.rows[1] {
            let x = 0.5;
            y += 1.0;
            let row_edges = t.edges.map(|e| f32x8::splat(e.c + (e.b * y + e.a * x)));
            let row_height = f32x8::splat(t.w + (t.dw_dy * y + t.dw_dx * x));
            let texels = self
                .heights
                .get_mut(row * stride + first..row * stride + t.columns[1].next_multiple_of(LANES));
            let mut step = first_step;
            for old in texels.unwrap_or_default().as_chunks_mut::<LANES>().0 {
                let height = (row_height + slope * step).fast_max(min).fast_min(max);
                let mut is_higher = height.simd_gt(f32x8::new(*old));
                if t.coverage == Coverage::Partial {
                    let inside = |i: usize| (row_edges[i] + edges[i].0 * step).simd_gt(edges[i].1);
                    is_higher &= inside(0) & inside(1) & inside(2);
                }
                if is_higher.any() {
                    *old = is_higher.select(height, f32x8::new(*old)).to_array();
                }
                step += f32x8::splat(LANES as f32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cleared_buffer_is_as_a_new_one() {
        let new = HeightBuffer::new(64, -1.0);
        let mut used = new.clone();
        let triangles = [
            [[20.3, 9.0, 0.1], [45.8, 11.0, 0.2], [30.0, 40.0, 0.3]],
            [[50.0, 3.0, 1.0], [63.9, 4.0, 1.0], [60.0, 30.0, 2.0]],
        ];
        used.draw(triangles.into_iter());
        assert_eq!((used.drawn_rows, used.drawn_columns), ([3, 40], [20, 64]));
        let is_drawn = |i: usize| used.heights[i] > -1.0;
        assert!(is_drawn(20 * used.stride() + 30) && !is_drawn(20 * used.stride() + 10));
        used.clear(-1.0);
        assert_eq!(used.heights, new.heights);
        assert_eq!((used.drawn_rows, used.drawn_columns), (new.drawn_rows, new.drawn_columns));
    }
}
