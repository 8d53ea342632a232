//! Rasterisation: projected triangles are sorted into screen tiles, then drawn into buffers of samples, eight samples
//! at a time.
//!
//! Edge functions follow Pineda (A Parallel Algorithm for Polygon Rasterization, 1988). The two triangles of an edge
//! evaluate it identically, so there are neither gaps nor double hits between them.

use wide::{bytemuck::cast, u32x8};

use super::{
    lens::{Lens, ScreenVertex},
    math::{LANE_INDEX, LANES, V3, f32x8},
};

/// Corners of a projected triangle, each x, y (pixels from the top left of the image) and reciprocal depth.
pub(crate) type ScreenCorners = [[f32; 3]; 3];

// Sample buffers store one `u32` per sample: a flag for moving objects, the index of the object in the scene and the
// index of the triangle in the object's mesh.

/// Number of bits of a triangle id that hold the index of the triangle in its mesh.
pub(crate) const TRIANGLE_BITS: u32 = 21;
/// Bit set in the ids of triangles of moving objects.
pub(crate) const MOVING_FLAG: u32 = 1 << 31;
/// Id of samples that show no triangle. Its object index is out of range, and its moving flag is clear.
pub(crate) const NO_TRIANGLE: u32 = 0x7FFF_FFFF;

/// Returns the id of the first triangle of an object; the others follow consecutively.
pub(crate) fn first_triangle_id(object: usize, is_moving: bool) -> u32 {
    (object as u32) << TRIANGLE_BITS | if is_moving { MOVING_FLAG } else { 0 }
}

/// Index in the scene of the object that a triangle belongs to.
pub(crate) fn object_index(id: u32) -> usize {
    ((id & !MOVING_FLAG) >> TRIANGLE_BITS) as usize
}

/// Index of a triangle in its mesh.
pub(crate) fn triangle_index(id: u32) -> usize {
    (id & ((1 << TRIANGLE_BITS) - 1)) as usize
}

/// Sample rows per pixel of a camera: four share the colour of the pixel; the centre gives its depth and object.
pub(crate) const ROWS_PER_PIXEL: usize = 5;
/// Index of the centre's row.
pub(crate) const CENTRE_ROW: usize = 2;
/// Position of each row's sample within the pixel. Each has a row and a column of its own, so edges of
/// every slope are antialiased.
pub(crate) const SAMPLE_OFFSETS: [[f32; 2]; ROWS_PER_PIXEL] =
    [[0.375, 0.125], [0.875, 0.375], [0.5, 0.5], [0.125, 0.625], [0.625, 0.875]];

/// The samples of a tile.
pub(crate) type TileSamples = SampleBuffer<ROWS_PER_PIXEL>;

/// A rectangle of samples that keeps, per sample, the greatest `w` drawn there and the id of its triangle.
///
/// Each unit square has `PER_UNIT` rows of one sample: a unit is a pixel of a camera ([`ROWS_PER_PIXEL`]) or a texel
/// of a shadow map (1).
#[derive(Clone, Debug, Default)]
pub(crate) struct SampleBuffer<const PER_UNIT: usize> {
    columns: usize,
    rows: usize,
    /// Reciprocal depth, or height towards the light. Rows are [`LANES`] longer than `columns`, since samples are
    /// written eight at a time.
    pub(crate) w: Vec<f32>,
    /// Triangle ids, or [`NO_TRIANGLE`]; empty in shadow maps.
    pub(crate) ids: Vec<u32>,
    /// First row drawn to, and the end of the last one.
    pub(crate) drawn_rows: [usize; 2],
}

/// Position of a row's first sample, units.
#[inline(always)]
fn first_sample<const PER_UNIT: usize>(row: usize) -> [f32; 2] {
    if PER_UNIT == 1 {
        return [0.5, row as f32 + 0.5];
    }
    let [x, y] = SAMPLE_OFFSETS[row % ROWS_PER_PIXEL];
    [x, (row / ROWS_PER_PIXEL) as f32 + y]
}

impl<const PER_UNIT: usize> SampleBuffer<PER_UNIT> {
    /// An empty buffer of `columns` × `units` unit squares, cleared to `w`.
    pub(crate) fn new(columns: usize, units: usize, w: f32, has_ids: bool) -> Self {
        let rows = units * PER_UNIT;
        let len = rows * (columns + LANES);
        let ids = vec![NO_TRIANGLE; if has_ids { len } else { 0 }];
        Self { columns, rows, w: vec![w; len], ids, drawn_rows: [rows, 0] }
    }

    /// Length of a row in memory.
    pub(crate) fn stride(&self) -> usize {
        self.columns + LANES
    }

    /// Clears the rows that were drawn to.
    pub(crate) fn clear(&mut self, w: f32) {
        let [from, to] = self.drawn_rows.map(|row| row * self.stride());
        if from < to {
            self.w[from..to].fill(w);
            if !self.ids.is_empty() {
                self.ids[from..to].fill(NO_TRIANGLE);
            }
        }
        self.drawn_rows = [self.rows, 0];
    }

    /// Draws a triangle where no nearer one was drawn before.
    ///
    /// Its corners run clockwise in an image whose y axis points down; other triangles face away and are skipped.
    /// `origin` is the position of the buffer's first unit.
    #[inline(always)]
    pub(crate) fn draw(&mut self, corners: &ScreenCorners, origin: [f32; 2], id: u32) {
        self.draw_rows::<0, 1>(corners, origin, id);
    }

    /// As [`draw`](Self::draw), but only into every `STEP`th row from `FIRST` on.
    pub(crate) fn draw_rows<const FIRST: usize, const STEP: usize>(
        &mut self,
        corners: &ScreenCorners,
        origin: [f32; 2],
        id: u32,
    ) {
        let size = [self.columns, self.rows];
        let Some([rows, columns]) = sample_span::<PER_UNIT>(corners, origin, size) else { return };
        let Some(setup) = TriangleSetup::new(corners, origin) else { return };
        let size = [self.columns as f32, (self.rows / PER_UNIT) as f32];
        let coverage = setup.coverage(size);
        if coverage == Coverage::None {
            return;
        }
        self.drawn_rows = [self.drawn_rows[0].min(rows[0]), self.drawn_rows[1].max(rows[1])];
        let stride = self.stride();
        let edges = setup.edges.map(|e| (f32x8::splat(e.a), f32x8::splat(e.threshold)));
        let (dw_dx, min_w, max_w) =
            (f32x8::splat(setup.dw_dx), f32x8::splat(setup.min_w), f32x8::splat(setup.max_w));
        let start = rows[0].next_multiple_of(STEP) + FIRST;
        for row in (start..rows[1]).step_by(STEP) {
            let [x, y] = first_sample::<PER_UNIT>(row);
            let row_edges = setup.edges.map(|e| f32x8::splat(e.c + (e.b * y + e.a * x)));
            let row_w = f32x8::splat(setup.w + (setup.dw_dy * y + setup.dw_dx * x));
            // Chunks start at multiples of eight, so that a load never spans two recent stores
            // (no store forwarding stall).
            let mut column = columns[0] / LANES * LANES;
            while column < columns[1] {
                let step = f32x8::splat(column as f32) + LANE_INDEX;
                let at = row * stride + column;
                column += LANES;
                let Some(old) = self.w.get_mut(at..).and_then(|w| w.first_chunk_mut::<LANES>()) else {
                    break;
                };
                // The plane of w, extrapolated to samples outside the triangle's edges, is clamped
                // to the corners' range.
                let w = (row_w + dw_dx * step).fast_max(min_w).fast_min(max_w);
                let mut is_visible = w.simd_gt(f32x8::new(*old));
                if coverage == Coverage::Partial {
                    let inside = |i: usize| (row_edges[i] + edges[i].0 * step).simd_gt(edges[i].1);
                    is_visible &= inside(0) & inside(1) & inside(2);
                }
                if !is_visible.any() {
                    continue;
                }
                *old = is_visible.select(w, f32x8::new(*old)).to_array();
                if let Some(ids) = self.ids.get_mut(at..).and_then(|ids| ids.first_chunk_mut::<LANES>()) {
                    let mask: u32x8 = cast(is_visible);
                    *ids = mask.select(u32x8::splat(id), u32x8::new(*ids)).to_array();
                }
            }
        }
    }
}

/// Returns the smallest w of a triangle within a square, if it covers the whole square.
fn min_w_if_covering(corners: &ScreenCorners, origin: [f32; 2], size: f32) -> Option<f32> {
    let setup = TriangleSetup::new(corners, origin)?;
    let square = [[0.0; 2], [size, 0.0], [0.0, size], [size; 2]];
    let corner_w =
        square.map(|[x, y]| (setup.w + (setup.dw_dy * y + setup.dw_dx * x)).clamp(setup.min_w, setup.max_w));
    let is_covered = setup.coverage([size; 2]) == Coverage::Full;
    is_covered.then(|| corner_w.into_iter().fold(f32::MAX, f32::min))
}

/// Rows and columns of samples in the bounding box of a triangle, as half-open ranges.
#[inline(always)]
fn sample_span<const PER_UNIT: usize>(
    [a, b, c]: &ScreenCorners,
    origin: [f32; 2],
    size: [usize; 2],
) -> Option<[[usize; 2]; 2]> {
    let range = |axis: usize| {
        let low = a[axis].min(b[axis]).min(c[axis]) - origin[axis];
        let high = a[axis].max(b[axis]).max(c[axis]) - origin[axis];
        [low, high]
    };
    let [first, last] = if PER_UNIT == 1 { [0.5; 2] } else { [0.125, 0.875] };
    // Units with samples between two coordinates. Conversions to integers saturate.
    let units_between = |[low, high]: [f32; 2], count: usize| {
        let (from, to) = ((low - last).ceil().max(0.0), ((high - first).floor() + 1.0).max(0.0));
        [from as usize, (to as usize).min(count)]
    };
    let columns = units_between(range(0), size[0]);
    let mut rows = units_between(range(1), size[1] / PER_UNIT).map(|unit| unit * PER_UNIT);
    let [low, high] = range(1);
    while rows[0] < rows[1] && first_sample::<PER_UNIT>(rows[0])[1] < low {
        rows[0] += 1;
    }
    while rows[0] < rows[1] && first_sample::<PER_UNIT>(rows[1] - 1)[1] > high {
        rows[1] -= 1;
    }
    (rows[0] < rows[1] && columns[0] < columns[1]).then_some([rows, columns])
}

/// Edge function a x + b y + c; points inside have values above `threshold`.
#[derive(Clone, Copy)]
struct EdgeFunction {
    a: f32,
    b: f32,
    c: f32,
    /// Zero, or just below zero if points exactly on the edge belong to this triangle (top-left rule).
    threshold: f32,
}

/// Coverage of a rectangle by a triangle.
#[derive(Clone, Copy, PartialEq)]
enum Coverage {
    None,
    Partial,
    Full,
}

/// Edge functions of a triangle and its plane w + dw_dx x + dw_dy y, relative to the origin of the buffer.
struct TriangleSetup {
    edges: [EdgeFunction; 3],
    w: f32,
    dw_dx: f32,
    dw_dy: f32,
    /// Range of w of the corners.
    min_w: f32,
    max_w: f32,
}

impl TriangleSetup {
    /// Returns `None` if the triangle faces away or has no area.
    fn new(corners: &ScreenCorners, origin: [f32; 2]) -> Option<Self> {
        let [a, b, c] = corners.map(|v| v.map(f64::from));
        let (bx, by, bw) = (b[0] - a[0], b[1] - a[1], b[2] - a[2]);
        let (cx, cy, cw) = (c[0] - a[0], c[1] - a[1], c[2] - a[2]);
        let area = bx * cy - cx * by;
        if area.is_nan() || area <= 0.0 {
            return None;
        }
        let (dw_dx, dw_dy) = ((bw * cy - cw * by) / area, (bx * cw - cx * bw) / area);
        let origin = origin.map(f64::from);
        let w = a[2] + dw_dx * (origin[0] - a[0]) + dw_dy * (origin[1] - a[1]);
        let edge = |i: usize| edge_function(&corners[i], &corners[(i + 1) % 3], origin);
        Some(Self {
            edges: [edge(0), edge(1), edge(2)],
            w: w as f32,
            dw_dx: dw_dx as f32,
            dw_dy: dw_dy as f32,
            min_w: corners[0][2].min(corners[1][2]).min(corners[2][2]),
            max_w: corners[0][2].max(corners[1][2]).max(corners[2][2]),
        })
    }

    /// Coverage of the rectangle of this size at the origin, conservative near corners.
    fn coverage(&self, size: [f32; 2]) -> Coverage {
        let mut coverage = Coverage::Full;
        for e in &self.edges {
            let (x, y) = (e.a * size[0], e.b * size[1]);
            if e.c + x.max(0.0) + y.max(0.0) < 0.0 {
                return Coverage::None;
            }
            let is_inside = e.c + x.min(0.0) + y.min(0.0) > 0.0;
            if !is_inside {
                coverage = Coverage::Partial;
            }
        }
        coverage
    }
}

fn edge_function(from: &[f32; 3], to: &[f32; 3], origin: [f64; 2]) -> EdgeFunction {
    // Both triangles of an edge compute it from the same end and differ in the sign only, so they round alike.
    let is_flipped = (from[0], from[1]) > (to[0], to[1]);
    let (p, q) = if is_flipped { (to, from) } else { (from, to) };
    let sign = if is_flipped { -1.0 } else { 1.0 };
    let (px, py) = (f64::from(p[0]), f64::from(p[1]));
    let (a, b) = (py - f64::from(q[1]), f64::from(q[0]) - px);
    let c = a * (origin[0] - px) + b * (origin[1] - py);
    let (a, b, c) = (sign * a, sign * b, sign * c);
    let owns_edge = a > 0.0 || (a == 0.0 && b > 0.0);
    let threshold = if owns_edge { -f32::MIN_POSITIVE } else { 0.0 };
    EdgeFunction { a: a as f32, b: b as f32, c: c as f32, threshold }
}

/// Edge of a tile, pixels: the samples of a tile fit in the first-level cache.
pub(crate) const TILE_EDGE: usize = 32;

/// A front-facing triangle within the image.
#[derive(Clone, Copy, Debug)]
struct ScreenTriangle {
    /// Clockwise in the image.
    corners: ScreenCorners,
    id: u32,
    /// First and last tile along each axis.
    tiles: [[u16; 2]; 2],
}

/// The triangles in view, by tile.
#[derive(Debug, Default)]
pub(crate) struct TileBins {
    triangles: Vec<ScreenTriangle>,
    /// Start of each tile's range in `sorted`, followed by the end of the last one.
    starts: Vec<u32>,
    /// Indices into `triangles`, grouped by tile.
    sorted: Vec<u32>,
    /// Number of tiles along x and y.
    tile_counts: [usize; 2],
}

impl TileBins {
    /// Removes all triangles and adopts the image size of `lens`.
    pub(crate) fn clear(&mut self, lens: &Lens) {
        self.triangles.clear();
        self.tile_counts = [lens.width.div_ceil(TILE_EDGE), lens.height.div_ceil(TILE_EDGE)];
    }

    /// Adds the triangles of a mesh that face the camera. Their ids are `first_id` and the numbers that follow.
    pub(crate) fn add(&mut self, lens: &Lens, positions: &[V3], triangles: &[[u32; 3]], first_id: u32) {
        let vertices: Vec<ScreenVertex> = positions.iter().map(|p| lens.project(p)).collect();
        let is_ahead = |v: &ScreenVertex| -v.view.z >= lens.near;
        let all_ahead = vertices.iter().all(is_ahead);
        for (id, t) in (first_id..).zip(triangles) {
            let corners = t.map(|v| &vertices[v as usize]);
            if all_ahead || corners.iter().all(|v| is_ahead(v)) {
                self.push(lens, corners.map(|v| [v.x, v.y, v.w]), id);
            } else if corners.iter().any(|v| is_ahead(v)) {
                self.push_clipped(lens, &corners, id);
            }
        }
    }

    /// Clips a triangle at the near plane (Sutherland & Hodgman 1974, for one plane) and adds the rest.
    fn push_clipped(&mut self, lens: &Lens, corners: &[&ScreenVertex; 3], id: u32) {
        let is_ahead = |v: &ScreenVertex| -v.view.z >= lens.near;
        let mut polygon: Vec<ScreenVertex> = Vec::with_capacity(4);
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            if is_ahead(a) {
                polygon.push(*a);
            }
            if is_ahead(a) != is_ahead(b) {
                let t = (-lens.near - a.view.z) / (b.view.z - a.view.z);
                polygon.push(lens.project_view(a.view + (b.view - a.view) * t));
            }
        }
        for i in 2..polygon.len() {
            self.push(lens, [polygon[0], polygon[i - 1], polygon[i]].map(|v| [v.x, v.y, v.w]), id);
        }
    }

    fn push(&mut self, lens: &Lens, [a, b, c]: ScreenCorners, id: u32) {
        // Triangles that are counter-clockwise from outside are clockwise in an image whose y axis points down.
        let area = (c[0] - a[0]) * (b[1] - a[1]) - (b[0] - a[0]) * (c[1] - a[1]);
        let high = |axis: usize| a[axis].max(b[axis]).max(c[axis]);
        let low = |axis: usize| a[axis].min(b[axis]).min(c[axis]);
        let is_outside = high(0) < 0.0
            || high(1) < 0.0
            || low(0) > lens.width as f32
            || low(1) > lens.height as f32
            || high(2) < 1.0 / lens.far;
        if area > 0.0 && !is_outside {
            // Conversions to integers saturate.
            let tile = |x: f32, axis: usize| {
                ((x * (1.0 / TILE_EDGE as f32)) as u16).min(self.tile_counts[axis] as u16 - 1)
            };
            let tiles = [0, 1].map(|axis| [tile(low(axis), axis), tile(high(axis), axis)]);
            self.triangles.push(ScreenTriangle { corners: [a, c, b], id, tiles });
        }
    }

    /// Groups the triangles by tile, each group in the order in which its triangles were added (counting sort).
    pub(crate) fn sort(&mut self) {
        let [columns, rows] = self.tile_counts;
        let range = |[from, to]: [u16; 2]| usize::from(from)..usize::from(to) + 1;
        self.starts.clear();
        self.starts.resize(columns * rows + 2, 0);
        for triangle in &self.triangles {
            for y in range(triangle.tiles[1]) {
                range(triangle.tiles[0]).for_each(|x| self.starts[y * columns + x + 2] += 1);
            }
        }
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        let len = self.starts[self.starts.len() - 1] as usize;
        self.sorted.clear();
        self.sorted.resize(len, 0);
        for (index, triangle) in (0_u32..).zip(&self.triangles) {
            for y in range(triangle.tiles[1]) {
                for x in range(triangle.tiles[0]) {
                    let next = &mut self.starts[y * columns + x + 1];
                    self.sorted[*next as usize] = index;
                    *next += 1;
                }
            }
        }
    }

    /// True if any triangle's bounding box overlaps a tile.
    pub(crate) fn is_occupied(&self, tile: usize) -> bool {
        self.starts[tile] < self.starts[tile + 1]
    }

    fn tile_triangles(&self, tile: usize) -> impl ExactSizeIterator<Item = &ScreenTriangle> {
        let range = self.starts[tile] as usize..self.starts[tile + 1] as usize;
        self.sorted[range].iter().map(|&index| &self.triangles[index as usize])
    }

    /// Draws the triangles of a tile with the corner `origin` in their order, without those hidden by one that covers
    /// the whole tile. If that one alone remains and `centres_suffice`, draws only its samples at pixel centres and
    /// returns its id.
    pub(crate) fn draw_tile(
        &self,
        tile: usize,
        origin: [f32; 2],
        samples: &mut TileSamples,
        centres_suffice: bool,
    ) -> Option<u32> {
        let size = TILE_EDGE as f32;
        // Cheap test before the exact one: the bounding box contains the tile.
        let box_contains_tile = |corners: &ScreenCorners| {
            [0, 1].into_iter().all(|axis| {
                let [a, b, c] = corners.map(|corner| corner[axis] - origin[axis]);
                a.min(b).min(c) <= 0.0 && a.max(b).max(c) >= size
            })
        };
        let (mut cover_id, mut cover_w) = (NO_TRIANGLE, None);
        for triangle in self.tile_triangles(tile).filter(|t| box_contains_tile(&t.corners)) {
            let Some(min_w) = min_w_if_covering(&triangle.corners, origin, size) else { continue };
            if cover_w.is_none_or(|nearest| min_w > nearest) {
                (cover_id, cover_w) = (triangle.id, Some(min_w));
            }
        }
        let threshold = cover_w.unwrap_or(0.0);
        let max_w = |corners: &ScreenCorners| corners[0][2].max(corners[1][2]).max(corners[2][2]);
        let is_visible = |t: &&ScreenTriangle| t.id == cover_id || max_w(&t.corners) >= threshold;
        let visible = || self.tile_triangles(tile).filter(is_visible);
        if centres_suffice && cover_w.is_some() && visible().nth(1).is_none() {
            for t in visible() {
                samples.draw_rows::<CENTRE_ROW, ROWS_PER_PIXEL>(&t.corners, origin, t.id);
            }
            return Some(cover_id);
        }
        visible().for_each(|t| samples.draw(&t.corners, origin, t.id));
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_that_share_an_edge_neither_overlap_nor_leave_a_gap() {
        // A fan around a point that covers the whole square; the coordinates make edges pass through samples too.
        for middle in [[13.0, 17.5], [7.3, 21.9], [16.375, 16.125]] {
            let rim = [[-3.0, -3.0], [16.0, -3.0], [40.0, -3.0], [40.0, 16.0], [40.0, 40.0], [-3.0, 40.0]];
            let mut hits = vec![0; 32 * ROWS_PER_PIXEL * (32 + LANES)];
            for i in 0..rim.len() {
                let mut samples = SampleBuffer::<ROWS_PER_PIXEL>::new(32, 32, 0.0, true);
                let [a, b] = [rim[i], rim[(i + 1) % rim.len()]].map(|[x, y]| [x, y, 1.0]);
                samples.draw(&[[middle[0], middle[1], 1.0], a, b], [0.0; 2], 7);
                hits.iter_mut().zip(&samples.ids).for_each(|(hits, id)| *hits += i32::from(*id == 7));
            }
            for row in hits.chunks(32 + LANES) {
                assert!(row[..32].iter().all(|h| *h == 1), "{middle:?}: {row:?}");
            }
        }
    }

    #[test]
    fn the_number_of_covered_samples_matches_the_area() {
        let mut samples = SampleBuffer::<ROWS_PER_PIXEL>::new(32, 32, 0.0, true);
        samples.draw(&[[2.2, 3.1, 1.0], [29.7, 8.4, 1.0], [11.5, 30.3, 1.0]], [0.0; 2], 1);
        let area = 0.5 * (27.5 * 27.2 - 9.3 * 5.3);
        let count = samples.ids.iter().filter(|id| **id == 1).count() as f32 / ROWS_PER_PIXEL as f32;
        assert!((count - area).abs() < 2.0, "{count} pixels, {area} expected");
    }
}
