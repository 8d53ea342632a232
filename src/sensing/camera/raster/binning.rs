//! The triangles that a camera sees, sorted into the tiles of its image.

use crate::sensing::camera::{
    V3,
    lens::Lens,
    raster::sample_buffer::{NONE, cover},
    render::tile::Triangles,
};

/// Pixels along an edge of a tile: its samples stay in the processor's nearest cache.
pub(crate) const TILE: usize = 32;

/// A triangle in the image.
#[derive(Clone, Copy, Debug)]
struct Shown {
    /// Corners, clockwise: pixels from the top left, and reciprocal depth.
    at: [[f32; 3]; 3],
    id: u32,
    /// First and last tile along each axis.
    tiles: [[u16; 2]; 2],
}

/// A point of the image; in front of the near plane if not behind it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Pixels from the top left.
    pub x: f32,
    pub y: f32,
    /// Reciprocal depth.
    pub w: f32,
    /// In the camera frame.
    pub view: V3,
}

/// Triangles by tile.
#[derive(Debug, Default)]
pub(crate) struct TileBins {
    seen: Vec<Seen>,
    shown: Vec<Shown>,
    /// First of each tile's part of `sorted`, and the end of all.
    starts: Vec<u32>,
    sorted: Vec<u32>,
    tiles: [usize; 2],
}

impl TileBins {
    /// Forgets all triangles.
    pub(crate) fn clear(&mut self, lens: &Lens) {
        self.shown.clear();
        self.tiles = [lens.width.div_ceil(TILE), lens.height.div_ceil(TILE)];
    }

    /// Adds the triangles that face the camera; their numbers are `first_id` and on.
    pub(crate) fn add(&mut self, lens: &Lens, positions: &[V3], triangles: &[[u32; 3]], first_id: u32) {
        let mut seen = std::mem::take(&mut self.seen);
        seen.clear();
        seen.extend(positions.iter().map(|p| lens.see(p)));
        let ahead = |s: &Seen| -s.view.z >= lens.near;
        let all_ahead = seen.iter().all(ahead);
        for (id, t) in (first_id..).zip(triangles) {
            let corners = t.map(|v| &seen[v as usize]);
            if all_ahead || corners.iter().all(|s| ahead(s)) {
                self.push(lens, corners.map(|s| [s.x, s.y, s.w]), id);
            } else if corners.iter().any(|s| ahead(s)) {
                self.push_cut(lens, &corners, id);
            }
        }
        self.seen = seen;
    }

    /// The part of a triangle that is ahead of the near plane (Sutherland & Hodgman 1974, one plane).
    fn push_cut(&mut self, lens: &Lens, corners: &[&Seen; 3], id: u32) {
        let ahead = |s: &Seen| -s.view.z >= lens.near;
        let mut kept: Vec<Seen> = Vec::with_capacity(4);
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            if ahead(a) {
                kept.push(*a);
            }
            if ahead(a) != ahead(b) {
                let t = (-lens.near - a.view.z) / (b.view.z - a.view.z);
                kept.push(lens.project(a.view + (b.view - a.view) * t));
            }
        }
        for i in 2..kept.len() {
            self.push(lens, [kept[0], kept[i - 1], kept[i]].map(|s| [s.x, s.y, s.w]), id);
        }
    }

    fn push(&mut self, lens: &Lens, [a, b, c]: [[f32; 3]; 3], id: u32) {
        // Counter-clockwise from outside is clockwise where y runs down, and the other way round.
        let area = (c[0] - a[0]) * (b[1] - a[1]) - (b[0] - a[0]) * (c[1] - a[1]);
        let high = |axis: usize| a[axis].max(b[axis]).max(c[axis]);
        let low = |axis: usize| a[axis].min(b[axis]).min(c[axis]);
        let outside = high(0) < 0.0
            || high(1) < 0.0
            || low(0) > lens.width as f32
            || low(1) > lens.height as f32
            || high(2) < 1.0 / lens.far;
        if area > 0.0 && !outside {
            // Conversions saturate.
            let tile =
                |x: f32, axis: usize| ((x * (1.0 / TILE as f32)) as u16).min(self.tiles[axis] as u16 - 1);
            let tiles = [0, 1].map(|axis| [tile(low(axis), axis), tile(high(axis), axis)]);
            self.shown.push(Shown { at: [a, c, b], id, tiles });
        }
    }

    /// Sorts the triangles into tiles, each in the order in which they were added.
    pub(crate) fn sort(&mut self) {
        let [columns, rows] = self.tiles;
        let range = |[from, to]: [u16; 2]| usize::from(from)..usize::from(to) + 1;
        self.starts.clear();
        self.starts.resize(columns * rows + 2, 0);
        for shown in &self.shown {
            for y in range(shown.tiles[1]) {
                range(shown.tiles[0]).for_each(|x| self.starts[y * columns + x + 2] += 1);
            }
        }
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        let all = self.starts[self.starts.len() - 1] as usize;
        self.sorted.clear();
        self.sorted.resize(all, 0);
        for (number, shown) in (0_u32..).zip(&self.shown) {
            for y in range(shown.tiles[1]) {
                for x in range(shown.tiles[0]) {
                    let next = &mut self.starts[y * columns + x + 1];
                    self.sorted[*next as usize] = number;
                    *next += 1;
                }
            }
        }
    }

    /// Whether any triangle can touch a tile.
    pub(crate) fn touches(&self, tile: usize) -> bool {
        self.starts[tile] < self.starts[tile + 1]
    }

    /// Tiles across and down.
    pub(crate) fn tiles(&self) -> [usize; 2] {
        self.tiles
    }

    /// Corners and numbers of the triangles of a tile.
    fn of_tile(&self, tile: usize) -> impl ExactSizeIterator<Item = (&[[f32; 3]; 3], u32)> {
        let part = self.starts[tile] as usize..self.starts[tile + 1] as usize;
        self.sorted[part].iter().map(|&number| {
            let shown = &self.shown[number as usize];
            (&shown.at, shown.id)
        })
    }

    /// What is left of a tile's triangles, in their order, without those behind one that covers all of it; and whether it
    /// is that one alone.
    pub(crate) fn visible(&self, tile: usize, origin: [f32; 2], left: &mut Triangles) -> bool {
        let size = TILE as f32;
        let around = |at: &[[f32; 3]; 3]| {
            [0, 1].into_iter().all(|axis| {
                let [a, b, c] = at.map(|corner| corner[axis] - origin[axis]);
                a.min(b).min(c) <= 0.0 && a.max(b).max(c) >= size
            })
        };
        let mut front: Option<(u32, f32)> = None;
        for (at, id) in self.of_tile(tile).filter(|(at, _)| around(at)) {
            let least = cover(at, origin, size);
            if let Some(least) = least.filter(|least| front.is_none_or(|(_, nearest)| *least > nearest)) {
                front = Some((id, least));
            }
        }
        let (first, nearest) = front.unwrap_or((NONE, 0.0));
        left.clear();
        let before = |at: &[[f32; 3]; 3]| at[0][2].max(at[1][2]).max(at[2][2]) >= nearest;
        let kept = self.of_tile(tile).filter(|(at, id)| *id == first || before(at));
        left.extend(kept.map(|(at, id)| (id, *at)));
        front.is_some() && left.len() == 1
    }
}
