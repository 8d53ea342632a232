//! Triangles into samples. Edge functions are evaluated alike for both triangles of an edge, so that there are neither
//! gaps nor double hits between them (Pineda, A Parallel Algorithm for Polygon Rasterization, 1988).

/// No triangle.
pub(super) const NONE: u32 = u32::MAX;

/// A rectangle of samples: the greatest `w` at each, and whose it is.
#[derive(Clone, Debug, Default)]
pub(super) struct Samples {
    pub width: usize,
    pub height: usize,
    /// Reciprocal depth, or height towards the light.
    pub w: Vec<f32>,
    /// Number of the triangle, or [`NONE`]; empty if nobody asks.
    pub id: Vec<u32>,
    /// Rows that something was drawn to, from and to.
    pub rows: [usize; 2],
}

impl Samples {
    /// Empty samples of this size at `w`.
    pub fn reset(&mut self, width: usize, height: usize, w: f32, with_ids: bool) {
        if (self.width, self.height) != (width, height) || self.id.is_empty() == with_ids {
            *self = Self { width, height, ..Self::default() };
            self.w.resize(width * height, w);
            self.id.resize(if with_ids { width * height } else { 0 }, NONE);
        } else {
            let [from, to] = self.rows;
            if from < to {
                self.w[from * width..to * width].fill(w);
                if with_ids {
                    self.id[from * width..to * width].fill(NONE);
                }
            }
        }
        self.rows = [height, 0];
    }

    /// Draws a triangle (x, y in samples from the top left, w) where nothing is nearer, also not in `before`. Its
    /// corners run clockwise as seen in an image with y down if `turn` is 1, and the other way if −1; others face away.
    pub fn draw<const IDS: bool>(
        &mut self,
        mut at: [[f32; 3]; 3],
        turn: f32,
        id: u32,
        before: Option<&[f32]>,
    ) {
        let [a, b, c] = at;
        let area = turn * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]));
        if area.is_nan() || area <= 0.0 {
            return;
        }
        if turn < 0.0 {
            at.swap(1, 2);
        }
        let span = |axis: usize, most: usize| {
            let low = at[0][axis].min(at[1][axis]).min(at[2][axis]);
            let high = at[0][axis].max(at[1][axis]).max(at[2][axis]);
            // The samples are at halves; conversions saturate.
            let from = (low - 0.5).ceil().max(0.0) as usize;
            let to = ((high - 0.5).floor() + 1.0).max(0.0) as usize;
            (from, to.min(most))
        };
        let (y0, y1) = span(1, self.height);
        let (x0, x1) = span(0, self.width);
        if y0 >= y1 || x0 >= x1 {
            return;
        }
        let edges = [edge(&at[0], &at[1]), edge(&at[1], &at[2]), edge(&at[2], &at[0])];
        let plane = plane(&at);
        self.rows = [self.rows[0].min(y0), self.rows[1].max(y1)];
        for y in y0..y1 {
            let e = edges.each_ref().map(|edge| edge.row(y as f64 + 0.5));
            let (from, to) = narrowed(&edges, &e, x0, x1);
            let w_row = (plane[2] + plane[1] * (y as f64 + 0.5)) as f32;
            let line = y * self.width;
            for x in from..to {
                let s = x as f32 + 0.5;
                if edges[0].inside(e[0], s) & edges[1].inside(e[1], s) & edges[2].inside(e[2], s) {
                    let w = w_row + plane[0] as f32 * s;
                    let i = line + x;
                    if w > self.w[i] && before.is_none_or(|before| w > before[i]) {
                        self.w[i] = w;
                        if IDS {
                            self.id[i] = id;
                        }
                    }
                }
            }
        }
    }
}

/// The line through two corners: positive inside.
struct Edge {
    a: f32,
    b: f64,
    c: f64,
    /// Whether points exactly on it belong to this side.
    owns: bool,
}

fn edge(from: &[f32; 3], to: &[f32; 3]) -> Edge {
    // One order for both triangles of an edge, and the sign after.
    let flipped = (from[0], from[1]) > (to[0], to[1]);
    let (p, q) = if flipped { (to, from) } else { (from, to) };
    let sign = if flipped { -1.0 } else { 1.0 };
    let (a, b) = (f64::from(p[1]) - f64::from(q[1]), f64::from(q[0]) - f64::from(p[0]));
    let c = -(a * f64::from(p[0]) + b * f64::from(p[1]));
    let (a, b, c) = (sign * a, sign * b, sign * c);
    Edge { a: a as f32, b, c, owns: a > 0.0 || (a == 0.0 && b > 0.0) }
}

impl Edge {
    fn row(&self, y: f64) -> f32 {
        (self.b * y + self.c) as f32
    }

    #[inline(always)]
    fn inside(&self, row: f32, x: f32) -> bool {
        let e = row + self.a * x;
        e > 0.0 || (e == 0.0 && self.owns)
    }
}

/// The part of x0..x1 in which a row can be inside all edges, a sample wider than needed.
fn narrowed(edges: &[Edge; 3], rows: &[f32; 3], x0: usize, x1: usize) -> (usize, usize) {
    if x1 - x0 < 6 {
        return (x0, x1);
    }
    let (mut from, mut to) = (x0 as f32, x1 as f32);
    for (edge, row) in edges.iter().zip(rows) {
        let cross = -row / edge.a - 0.5;
        if edge.a > 0.0 {
            from = from.max(cross - 1.5);
        } else if edge.a < 0.0 {
            to = to.min(cross + 2.5);
        }
    }
    (from.max(x0 as f32) as usize, to.max(0.0).min(x1 as f32) as usize)
}

/// w = p0 x + p1 y + p2 through three corners.
fn plane(at: &[[f32; 3]; 3]) -> [f64; 3] {
    let [a, b, c] = at.map(|v| v.map(f64::from));
    let (bx, by, bw) = (b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    let (cx, cy, cw) = (c[0] - a[0], c[1] - a[1], c[2] - a[2]);
    let det = bx * cy - cx * by;
    let gx = (bw * cy - cw * by) / det;
    let gy = (bx * cw - cx * bw) / det;
    [gx, gy, a[2] - gx * a[0] - gy * a[1]]
}
