//! What stands over the pad: the lower side of the touching skins as a height map.

use super::gel::Gel;
use crate::geometry::Vec3;

/// A touching body's skin, pad frame: vertices in m, triangles counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Vertices, m, pad frame.
    pub vertices: &'a [Vec3],
    /// Triangles.
    pub triangles: &'a [[u32; 3]],
}

/// Points of the height map a cell of the gel's grid along each axis; odd, so that one is the cell's centre.
pub(super) const FINE: usize = 3;
/// Skin higher than this above the apex is left out, m: no force a gripper has pushes a pad that far.
const REACH: f64 = 6e-3;

/// Heights of the lowest skin, `FINE` × finer than the gel's grid, m above the apex plane; infinite where there is none.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Relief {
    pub columns: usize,
    pub rows: usize,
    pub cell: f64,
    pub height: Vec<f32>,
}

impl Relief {
    /// Draws the skins from below, nearest last.
    pub(super) fn of(gel: &Gel, surfaces: &[Surface]) -> Self {
        let (columns, rows) = (FINE * gel.columns, FINE * gel.rows);
        let cell = gel.cell / FINE as f64;
        let mut relief = Self { columns, rows, cell, height: vec![f32::INFINITY; columns * rows] };
        let floor = -gel.pad.thickness;
        for surface in surfaces {
            let vertex = |v: u32| surface.vertices.get(v as usize).copied();
            for triangle in surface.triangles {
                if let [Some(a), Some(b), Some(c)] = triangle.map(vertex)
                    && a.z.max(b.z).max(c.z) > floor
                    && a.z.min(b.z).min(c.z) < REACH
                {
                    relief.draw([a, b, c]);
                }
            }
        }
        relief
    }

    /// The height at the centre of the coarse cell (i, j).
    pub(super) fn at_cell(&self, i: usize, j: usize) -> f32 {
        self.height[(FINE * j + FINE / 2) * self.columns + FINE * i + FINE / 2]
    }

    /// Lowers the map by one triangle, unless its outside looks away from the gel.
    fn draw(&mut self, corners: [Vec3; 3]) {
        // In units of cells, with the first centre at 0.
        let half = [0.5 * (self.columns - 1) as f64, 0.5 * (self.rows - 1) as f64];
        let [a, b, c] = corners.map(|p| [p.x / self.cell + half[0], p.y / self.cell + half[1], p.z]);
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        if area >= 0.0 || !area.is_finite() {
            return;
        }
        let Some((low_x, high_x)) = span(self.columns, [a[0], b[0], c[0]]) else { return };
        let Some((low_y, high_y)) = span(self.rows, [a[1], b[1], c[1]]) else { return };
        let slope = [
            ((b[2] - a[2]) * (c[1] - a[1]) - (c[2] - a[2]) * (b[1] - a[1])) / area,
            ((c[2] - a[2]) * (b[0] - a[0]) - (b[2] - a[2]) * (c[0] - a[0])) / area,
        ];
        // Where an edge is at y = 0, how far it goes along x a row, and which side of it is inside.
        let edges = [(a, b), (b, c), (c, a)].map(|(p, q)| {
            let lean = (q[0] - p[0]) / (q[1] - p[1]);
            (p[0] - lean * p[1], lean, q[1] - p[1])
        });
        for j in low_y..=high_y {
            let y = j as f64;
            // A little beyond the edges, so that no point falls between two neighbours.
            let (mut from, mut to) = (low_x as f64 - 1e-6, high_x as f64 + 1e-6);
            for (at, lean, rise) in edges {
                let x = at + lean * y;
                if rise > 0.0 {
                    from = from.max(x - 1e-6);
                } else if rise < 0.0 {
                    to = to.min(x + 1e-6);
                }
            }
            if from > to {
                continue;
            }
            let (first, last) = (from.ceil() as usize, to.floor() as usize);
            let start = a[2] + slope[0] * -a[0] + slope[1] * (y - a[1]);
            let line = &mut self.height[j * self.columns..(j + 1) * self.columns];
            for (i, height) in line.iter_mut().enumerate().take(last + 1).skip(first) {
                *height = height.min((start + slope[0] * i as f64) as f32);
            }
        }
    }
}

/// Whole numbers within the interval of three, as far as they are below `count`.
fn span(count: usize, of: [f64; 3]) -> Option<(usize, usize)> {
    let low = of[0].min(of[1]).min(of[2]).ceil().max(0.0);
    let high = of[0].max(of[1]).max(of[2]).floor().min((count - 1) as f64);
    (low <= high).then_some((low as usize, high as usize))
}
