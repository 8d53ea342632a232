//! Height map of the surfaces over a pad: the lower side of the touching bodies, rasterised from below.

use std::ops::RangeInclusive;

use super::gel::Gel;
use softvt_geometry::Vec3;

/// Surface of a touching body in the pad frame.
#[derive(Clone, Copy, Debug)]
pub struct SkinMesh<'a> {
    /// Vertices, m, pad frame.
    pub vertices: &'a [Vec3],
    /// Vertex indices of the triangles, counter-clockwise seen from outside the body.
    pub triangles: &'a [[u32; 3]],
}

/// Height above the apex beyond which triangles are skipped, m: no gripper pushes a pad in that far.
const MAX_HEIGHT: f64 = 6e-3;

/// Points of a fine height map per cell of the gel's grid along each axis; odd, so that one is the cell's centre.
pub(super) const FINE: usize = 3;

/// Height of the lowest surface (m above the apex plane; infinite without one) on the grid of the gel or on
/// one that is finer.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct HeightMap {
    pub(in super::super) columns: usize,
    pub(in super::super) rows: usize,
    /// Points per cell of the gel's grid along each axis; odd.
    points_per_cell: usize,
    /// Distance of neighbouring points, m.
    pub(in super::super) cell: f64,
    /// Heights, row by row.
    pub(in super::super) height: Vec<f32>,
}

impl HeightMap {
    /// Height map of `skins` over the pad of `gel`, with `points_per_cell` points per cell of its grid along each
    /// axis, an odd number.
    pub(super) fn new(gel: &Gel, skins: &[SkinMesh], points_per_cell: usize) -> Self {
        let (columns, rows) = (points_per_cell * gel.columns, points_per_cell * gel.rows);
        let cell = gel.cell / points_per_cell as f64;
        let height = vec![f32::INFINITY; columns * rows];
        let mut map = Self { columns, rows, points_per_cell, cell, height };
        let floor = -gel.pad.thickness;
        for skin in skins {
            let vertex = |v: u32| skin.vertices.get(v as usize);
            for triangle in skin.triangles {
                if let [Some(a), Some(b), Some(c)] = triangle.map(vertex)
                    && (a.z < MAX_HEIGHT || b.z < MAX_HEIGHT || c.z < MAX_HEIGHT)
                    && (a.z > floor || b.z > floor || c.z > floor)
                {
                    map.draw([a, b, c]);
                }
            }
        }
        map
    }

    /// Height above the undeformed gel at the centre of each of its cells, m; infinite where no skin is.
    pub(super) fn gaps(&self, gel: &Gel) -> Vec<f32> {
        let gap = |(c, dome): (usize, &f32)| {
            let n = self.points_per_cell;
            let [i, j] = [c % gel.columns, c / gel.columns].map(|cell| n * cell + n / 2);
            let gap = self.height[j * self.columns + i] - dome;
            if gap.is_nan() { f32::INFINITY } else { gap }
        };
        gel.dome.iter().enumerate().map(gap).collect()
    }

    /// Lowers the map to one triangle, unless its outer side faces away from the gel.
    fn draw(&mut self, corners: [&Vec3; 3]) {
        // In units of cells, with the first centre at 0.
        let half = [0.5 * (self.columns - 1) as f64, 0.5 * (self.rows - 1) as f64];
        let [a, b, c] = corners.map(|p| [p.x / self.cell + half[0], p.y / self.cell + half[1], p.z]);
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        if area >= 0.0 || !area.is_finite() {
            return;
        }
        let Some(columns) = index_range(self.columns, [a[0], b[0], c[0]]) else { return };
        let Some(rows) = index_range(self.rows, [a[1], b[1], c[1]]) else { return };
        let slope = [
            ((b[2] - a[2]) * (c[1] - a[1]) - (c[2] - a[2]) * (b[1] - a[1])) / area,
            ((c[2] - a[2]) * (b[0] - a[0]) - (b[2] - a[2]) * (c[0] - a[0])) / area,
        ];
        let edges = [(a, b), (b, c), (c, a)].map(|(p, q)| {
            let x_per_row = (q[0] - p[0]) / (q[1] - p[1]);
            Edge { x_at_row_0: p[0] - x_per_row * p[1], x_per_row, rise: q[1] - p[1] }
        });
        for j in rows {
            let y = j as f64;
            // A little beyond the edges, so that no point is missed between two neighbouring triangles.
            let (mut from, mut to) = (*columns.start() as f64 - 1e-6, *columns.end() as f64 + 1e-6);
            for edge in &edges {
                let x = edge.x_at_row_0 + edge.x_per_row * y;
                if edge.rise > 0.0 {
                    from = from.max(x - 1e-6);
                } else if edge.rise < 0.0 {
                    to = to.min(x + 1e-6);
                }
            }
            if from > to {
                continue;
            }
            let (first, last) = (from.ceil() as usize, to.floor() as usize);
            let start = a[2] + slope[0] * -a[0] + slope[1] * (y - a[1]);
            let row = self.height.get_mut(j * self.columns + first..=j * self.columns + last);
            for (i, height) in (first as u32..).zip(row.unwrap_or_default()) {
                *height = height.min((start + slope[0] * f64::from(i)) as f32);
            }
        }
    }
}

/// Edge of a triangle as a line over the rows of the map.
struct Edge {
    x_at_row_0: f64,
    x_per_row: f64,
    /// Rows from its start to its end; its sign gives the side on which the triangle is.
    rise: f64,
}

/// Whole numbers below `count` within the interval of three values; `None` for an empty range.
fn index_range(count: usize, of: [f64; 3]) -> Option<RangeInclusive<usize>> {
    // Comparisons take fewer instructions than `f64::min` and `f64::max`.
    let (mut low, mut high) = (of[0], of[0]);
    for value in [of[1], of[2]] {
        low = if value < low { value } else { low };
        high = if value > high { value } else { high };
    }
    let (low, high) = (low.ceil().max(0.0), high.floor().min((count - 1) as f64));
    (low <= high).then_some(low as usize..=high as usize)
}
