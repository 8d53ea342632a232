//! Edge functions, planes and bounding boxes of eight triangles at a time.

use wide::bytemuck::cast;

use super::{NO_TRIANGLE, ScreenCorners};
use crate::camera::math::{LANES, f32x8};

/// The buffer that triangles are drawn into.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrawTarget {
    /// Position of its first unit: a pixel of an image or a texel of a shadow map.
    pub(crate) origin: [f32; 2],
    /// Width and height, units.
    pub(crate) size: [usize; 2],
    /// Distance of the outermost samples of a unit from its border, units.
    pub(crate) inset: f32,
}

/// Coverage of a buffer by a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum Coverage {
    #[default]
    None,
    Partial,
    Full,
}

/// Edge function a x + b y + c; points inside have values above `threshold`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EdgeFunction {
    pub(crate) a: f32,
    pub(crate) b: f32,
    pub(crate) c: f32,
    /// Zero, or just below zero if points exactly on the edge belong to this triangle (top-left rule).
    pub(crate) threshold: f32,
}

/// A triangle ready to be drawn. Coordinates are relative to the origin of the buffer.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TriangleSetup {
    pub(crate) id: u32,
    pub(crate) coverage: Coverage,
    pub(crate) edges: [EdgeFunction; 3],
    /// The plane w + dw_dx x + dw_dy y.
    pub(crate) w: f32,
    pub(crate) dw_dx: f32,
    pub(crate) dw_dy: f32,
    /// Range of w of the corners.
    pub(crate) min_w: f32,
    pub(crate) max_w: f32,
    /// Columns and rows with samples in the bounding box, as half-open ranges.
    pub(crate) columns: [usize; 2],
    pub(crate) rows: [usize; 2],
}

impl TriangleSetup {
    /// w at a point, within the range of the corners.
    pub(crate) fn w_at(&self, [x, y]: [f32; 2]) -> f32 {
        (self.w + (self.dw_dy * y + self.dw_dx * x)).clamp(self.min_w, self.max_w)
    }
}

/// Eight triangles, by attribute.
#[derive(Clone, Debug)]
pub(crate) struct TriangleBlock {
    id: [u32; LANES],
    coverage: [Coverage; LANES],
    a: [[f32; LANES]; 3],
    b: [[f32; LANES]; 3],
    c: [[f32; LANES]; 3],
    threshold: [[f32; LANES]; 3],
    w: [f32; LANES],
    dw_dx: [f32; LANES],
    dw_dy: [f32; LANES],
    min_w: [f32; LANES],
    max_w: [f32; LANES],
    /// Column and row of the first unit, and the end of the last one.
    from: [[u32; LANES]; 2],
    to: [[u32; LANES]; 2],
}

impl TriangleBlock {
    /// Sets up to eight triangles up, each given by its corners and its id.
    ///
    /// Corners run clockwise in an image whose y axis points down; other triangles face away, and nothing covers them.
    #[inline(always)]
    pub(crate) fn new<'a>(
        triangles: impl Iterator<Item = (&'a ScreenCorners, u32)>,
        target: &DrawTarget,
    ) -> Self {
        let mut id = [NO_TRIANGLE; LANES];
        // By corner and coordinate. Unused lanes have no area.
        let mut corners = [[[0.0; LANES]; 3]; 3];
        for (lane, (of, own_id)) in triangles.take(LANES).enumerate() {
            id[lane] = own_id;
            for corner in 0..3 {
                for axis in 0..3 {
                    corners[corner][axis][lane] = of[corner][axis];
                }
            }
        }
        let corners = corners.map(|corner| corner.map(f32x8::new));
        let [a, b, c] = &corners;
        let (bx, by, bw) = (b[0] - a[0], b[1] - a[1], b[2] - a[2]);
        let (cx, cy, cw) = (c[0] - a[0], c[1] - a[1], c[2] - a[2]);
        let area = bx * cy - cx * by;
        let has_area = area.simd_gt(f32x8::ZERO);
        let (dw_dx, dw_dy) = ((bw * cy - cw * by) / area, (bx * cw - cx * bw) / area);
        let origin = target.origin.map(f32x8::splat);
        let w = a[2] + dw_dx * (origin[0] - a[0]) + dw_dy * (origin[1] - a[1]);
        let edges = [0, 1, 2].map(|i| edge_functions(&corners[i], &corners[(i + 1) % 3], &origin));
        let low = |axis: usize| corners[0][axis].fast_min(corners[1][axis]).fast_min(corners[2][axis]);
        let high = |axis: usize| corners[0][axis].fast_max(corners[1][axis]).fast_max(corners[2][axis]);
        let size = target.size.map(|n| f32x8::splat(n as f32));
        let (mut is_apart, mut is_full) = (!has_area, has_area);
        for e in &edges {
            let (x, y) = (e.a * size[0], e.b * size[1]);
            let (zero, most, least) = (f32x8::ZERO, f32x8::fast_max, f32x8::fast_min);
            is_apart |= (e.c + most(x, zero) + most(y, zero)).simd_lt(zero);
            is_full &= (e.c + least(x, zero) + least(y, zero)).simd_gt(zero);
        }
        let span = |axis: usize| {
            let start = f32x8::splat(target.origin[axis]);
            let (first, last) = (f32x8::splat(target.inset), f32x8::splat(1.0 - target.inset));
            let within = |x: f32x8| cast(x.fast_max(f32x8::ZERO).fast_min(size[axis]).fast_trunc_int());
            let from: [u32; LANES] = within((low(axis) - start - last).ceil());
            let to: [u32; LANES] = within((high(axis) - start - first).floor() + f32x8::ONE);
            [from, to]
        };
        let [columns, rows] = [span(0), span(1)];
        let (is_apart, is_full) = (is_apart.to_bitmask(), is_full.to_bitmask());
        let coverage = std::array::from_fn(|lane| {
            let is_empty = columns[0][lane] >= columns[1][lane] || rows[0][lane] >= rows[1][lane];
            match (is_empty || is_apart >> lane & 1 == 1, is_full >> lane & 1 == 1) {
                (true, _) => Coverage::None,
                (false, true) => Coverage::Full,
                (false, false) => Coverage::Partial,
            }
        });
        Self {
            id,
            coverage,
            a: edges.map(|e| e.a.to_array()),
            b: edges.map(|e| e.b.to_array()),
            c: edges.map(|e| e.c.to_array()),
            threshold: edges.map(|e| e.threshold.to_array()),
            w: w.to_array(),
            dw_dx: dw_dx.to_array(),
            dw_dy: dw_dy.to_array(),
            min_w: low(2).to_array(),
            max_w: high(2).to_array(),
            from: [columns[0], rows[0]],
            to: [columns[1], rows[1]],
        }
    }

    /// True if any triangle covers all of the buffer.
    pub(crate) fn any_full(&self) -> bool {
        self.coverage.contains(&Coverage::Full)
    }

    /// The triangles that cover anything, in their order.
    #[inline(always)]
    pub(crate) fn triangles(&self) -> impl Iterator<Item = TriangleSetup> + '_ {
        let covers = |lane: &usize| self.coverage[*lane] != Coverage::None;
        (0..LANES).filter(covers).map(|lane| self.triangle(lane))
    }

    #[inline(always)]
    fn triangle(&self, lane: usize) -> TriangleSetup {
        let edge = |i: usize| EdgeFunction {
            a: self.a[i][lane],
            b: self.b[i][lane],
            c: self.c[i][lane],
            threshold: self.threshold[i][lane],
        };
        let range = |axis: usize| [self.from[axis][lane] as usize, self.to[axis][lane] as usize];
        TriangleSetup {
            id: self.id[lane],
            coverage: self.coverage[lane],
            edges: [edge(0), edge(1), edge(2)],
            w: self.w[lane],
            dw_dx: self.dw_dx[lane],
            dw_dy: self.dw_dy[lane],
            min_w: self.min_w[lane],
            max_w: self.max_w[lane],
            columns: range(0),
            rows: range(1),
        }
    }
}

/// One edge function for each of eight triangles.
#[derive(Clone, Copy)]
struct EdgeFunctions {
    a: f32x8,
    b: f32x8,
    c: f32x8,
    threshold: f32x8,
}

/// The edge functions of edges between two corners. They are wrong by less than the rounding of the corners' positions.
#[inline(always)]
fn edge_functions(from: &[f32x8; 3], to: &[f32x8; 3], origin: &[f32x8; 2]) -> EdgeFunctions {
    // Both triangles of an edge compute it from the same end and differ in the sign only, so they round alike.
    let is_flipped = from[0].simd_gt(to[0]) | (from[0].simd_eq(to[0]) & from[1].simd_gt(to[1]));
    let end = |axis: usize| is_flipped.select(to[axis], from[axis]);
    let other_end = |axis: usize| is_flipped.select(from[axis], to[axis]);
    let (px, py) = (end(0), end(1));
    let (a, b) = (py - other_end(1), other_end(0) - px);
    let c = a * (origin[0] - px) + b * (origin[1] - py);
    let signed = |x: f32x8| is_flipped.select(-x, x);
    let (a, b, c) = (signed(a), signed(b), signed(c));
    let zero = f32x8::ZERO;
    let owns_edge = a.simd_gt(zero) | (a.simd_eq(zero) & b.simd_gt(zero));
    let threshold = owns_edge.select(f32x8::splat(-f32::MIN_POSITIVE), zero);
    EdgeFunctions { a, b, c, threshold }
}
