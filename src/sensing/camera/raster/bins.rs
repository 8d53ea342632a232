//! Triangles in view, sorted into tiles of the image.

use super::{
    NO_TRIANGLE, ScreenCorners,
    samples::{TILE_EDGE, TileSamples},
    setup::{Coverage, TriangleBlock, TriangleSetup},
};
use crate::camera::{
    lens::{Lens, ScreenVertex},
    math::{LANES, V3, higher, lower},
};

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
        // False for NaN too.
        let faces_camera = area > 0.0;
        if !faces_camera {
            return;
        }
        let high = |axis: usize| higher(higher(a[axis], b[axis]), c[axis]);
        let low = |axis: usize| lower(lower(a[axis], b[axis]), c[axis]);
        let [right, bottom] = [high(0), high(1)];
        let [left, top] = [low(0), low(1)];
        let is_outside = right < 0.0
            || bottom < 0.0
            || left > lens.width as f32
            || top > lens.height as f32
            || high(2) < 1.0 / lens.far;
        if !is_outside {
            // Conversions to integers saturate.
            let tile = |x: f32, axis: usize| {
                ((x * (1.0 / TILE_EDGE as f32)) as u16).min(self.tile_counts[axis] as u16 - 1)
            };
            let tiles = [[tile(left, 0), tile(right, 0)], [tile(top, 1), tile(bottom, 1)]];
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

    /// The rows of a tile at `top` that the bounding boxes of its triangles overlap.
    pub(crate) fn rows(&self, tile: usize, top: f32) -> std::ops::Range<usize> {
        let range = self.starts[tile] as usize..self.starts[tile + 1] as usize;
        let (mut first, mut last) = (f32::MAX, f32::MIN);
        for [_, y, _] in self.sorted[range].iter().flat_map(|&index| self.triangles[index as usize].corners) {
            (first, last) = (lower(first, y), higher(last, y));
        }
        // Conversions to integers saturate.
        ((first - top) as usize).min(TILE_EDGE)..((last - top) as usize).saturating_add(1).min(TILE_EDGE)
    }

    /// Draws the triangles of a tile with the corner `origin` in their order, without those hidden by one that covers
    /// the whole tile. If that one alone remains and `centres_suffice`, draws only its samples at the centres, if there
    /// are any, and returns its id. `blocks` is working memory.
    pub(crate) fn draw_tile(
        &self,
        tile: usize,
        origin: [f32; 2],
        samples: &mut TileSamples,
        blocks: &mut Vec<TriangleBlock>,
        centres_suffice: bool,
    ) -> Option<u32> {
        let target = TileSamples::target(origin);
        let range = self.starts[tile] as usize..self.starts[tile + 1] as usize;
        blocks.clear();
        blocks.extend(self.sorted[range].chunks(LANES).map(|some| {
            let triangles = some.iter().map(|&index| &self.triangles[index as usize]);
            TriangleBlock::new(triangles.map(|t| (&t.corners, t.id)), &target)
        }));
        let covering = || blocks.iter().filter(|block| block.any_full());
        let is_full = |t: &TriangleSetup| t.coverage == Coverage::Full;
        let (mut cover_id, mut cover_w) = (NO_TRIANGLE, None);
        for t in covering().flat_map(TriangleBlock::triangles).filter(is_full) {
            let size = TILE_EDGE as f32;
            let tile_corners = [[0.0; 2], [size, 0.0], [0.0, size], [size; 2]];
            let min_w = tile_corners.into_iter().map(|corner| t.w_at(corner)).fold(f32::MAX, f32::min);
            if cover_w.is_none_or(|nearest| min_w > nearest) {
                (cover_id, cover_w) = (t.id, Some(min_w));
            }
        }
        let threshold = cover_w.unwrap_or(0.0);
        let is_visible = |t: &TriangleSetup| t.id == cover_id || t.max_w >= threshold;
        let visible = || blocks.iter().flat_map(TriangleBlock::triangles).filter(is_visible);
        if centres_suffice && cover_w.is_some() && visible().nth(1).is_none() {
            visible().for_each(|t| samples.draw_centres(&t));
            return Some(cover_id);
        }
        visible().for_each(|t| samples.draw(&t));
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_geometry::Pose;
    use softvt_scene::Camera;

    #[test]
    fn the_rows_of_a_triangle_stay_in_its_tile_however_far_it_reaches() {
        let camera = Camera { pose: Pose::identity(), ..Camera::third_person_table() };
        let lens = Lens::new(&camera, None).expect("a good camera");
        let rows_of = |low: f32, high: f32| {
            let mut bins = TileBins::default();
            bins.clear(&lens);
            // One metre ahead; y points up.
            let [top, bottom] = [low, high].map(|row| (112.0 - row) / lens.focal);
            let corners = [V3::new(-0.05, top, -1.0), V3::new(0.05, top, -1.0), V3::new(0.0, bottom, -1.0)];
            bins.add(&lens, &corners, &[[0, 2, 1]], 0);
            bins.sort();
            // The fourth tile of the second row of tiles.
            bins.rows(10, 32.0)
        };
        assert_eq!(rows_of(40.5, 50.5), 8..19);
        assert_eq!(rows_of(40.5, 1e30), 8..32);
        assert_eq!(rows_of(-1e30, 1e30), 0..32);
    }
}
