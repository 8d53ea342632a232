//! Grids of nodes over a rectangle around the origin, between which values are bilinear.

/// Nodes at equal distances along x and y, centred on the origin. Values are stored row by row, x fastest.
#[derive(Clone, Copy, Debug)]
pub struct BilinearGrid {
    /// Number of nodes along x, at least 2.
    pub columns: usize,
    /// Number of nodes along y, at least 2.
    pub rows: usize,
    /// Distance of neighbours, m.
    pub spacing: f64,
}

impl BilinearGrid {
    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.columns * self.rows
    }

    /// The four nodes around a point (m) with its shares of them, which sum to 1. A point outside of the grid has the
    /// shares of the nearest one on its edge.
    pub fn around(&self, x: f64, y: f64) -> [(usize, f64); 4] {
        let along = |x: f64, count: usize| {
            let last = (count - 1) as f64;
            let at = (x / self.spacing + 0.5 * last).clamp(0.0, last);
            let first = at.floor().min(last - 1.0);
            (first as usize, at - first)
        };
        let ((i, u), (j, v)) = (along(x, self.columns), along(y, self.rows));
        let node = |a: usize, b: usize| (j + b) * self.columns + i + a;
        [
            (node(0, 0), (1.0 - u) * (1.0 - v)),
            (node(1, 0), u * (1.0 - v)),
            (node(0, 1), (1.0 - u) * v),
            (node(1, 1), u * v),
        ]
    }
}
