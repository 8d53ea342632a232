//! Simple polygons: cross-sections of prisms and profiles of lathes, with exact signed distances.

use serde::Serialize;

use super::validate::ShapeError;

/// A simple closed polygon with counter-clockwise corners, m: (x, z) for a prism, (r, z) with r ≥ 0 for a lathe.
/// Its serialised names are part of fingerprints of assets.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Polygon {
    points: Vec<[f64; 2]>,
    #[serde(skip)]
    edges: Vec<Edge>,
}

/// Edge from `start` to `start + span`.
#[derive(Clone, Debug, PartialEq)]
struct Edge {
    start: [f64; 2],
    span: [f64; 2],
    inverse_square: f64,
    /// True for an edge on the axis of revolution, which is not part of the surface.
    on_axis: bool,
}

impl Polygon {
    /// A profile of revolution from its corners (r, z), m, in either direction. The last corner is joined to the first.
    ///
    /// # Errors
    /// If there are fewer than three corners, a coordinate is not finite, r < 0, neighbouring corners coincide, edges
    /// cross, or the area is 0.
    pub fn revolved(points: Vec<[f64; 2]>) -> Result<Self, ShapeError> {
        if let Some(index) =
            points.iter().position(|p| !(p[0] >= 0.0 && p[0].is_finite() && p[1].is_finite()))
        {
            return Err(ShapeError::ProfilePoint { index, r: points[index][0], z: points[index][1] });
        }
        Self::closed(points, true)
    }

    /// A cross-section from its corners (x, z), m, in either direction. The last corner is joined to the first.
    ///
    /// # Errors
    /// As for [`Polygon::revolved`], but coordinates may be negative.
    pub fn flat(points: Vec<[f64; 2]>) -> Result<Self, ShapeError> {
        if let Some(index) = points.iter().position(|p| !(p[0].is_finite() && p[1].is_finite())) {
            return Err(ShapeError::ProfilePoint { index, r: points[index][0], z: points[index][1] });
        }
        Self::closed(points, false)
    }

    fn closed(mut points: Vec<[f64; 2]>, revolved: bool) -> Result<Self, ShapeError> {
        if points.len() < 3 {
            return Err(ShapeError::ProfileSize { corners: points.len() });
        }
        let area = twice_area(&points);
        if area.abs() <= 1e-14 || !area.is_finite() {
            return Err(ShapeError::ProfileArea);
        }
        if area < 0.0 {
            points.reverse();
        }
        let edges: Vec<Edge> = (0..points.len())
            .map(|i| Edge::new(points[i], points[(i + 1) % points.len()], revolved))
            .collect();
        if let Some(index) = edges.iter().position(|edge| !edge.inverse_square.is_finite()) {
            return Err(ShapeError::ProfileRepeat { r: points[index][0], z: points[index][1] });
        }
        if crosses_itself(&edges) {
            return Err(ShapeError::ProfileCrossing);
        }
        Ok(Self { points, edges })
    }

    /// The corners, counter-clockwise.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// The edges that are part of the surface (not on the axis of revolution), as pairs of end points.
    pub(crate) fn walls(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2])> + '_ {
        self.edges
            .iter()
            .filter(|edge| !edge.on_axis)
            .map(|e| (e.start, [e.start[0] + e.span[0], e.start[1] + e.span[1]]))
    }

    /// Cuts the polygon by a square grid of edge `spacing` (m); returns the centroid and area of the part in each cell.
    pub(crate) fn cells(&self, spacing: f64) -> Vec<([f64; 2], f64)> {
        let extreme = |axis: usize, worst: f64, pick: fn(f64, f64) -> f64| {
            self.points.iter().map(|p| p[axis]).fold(worst, pick)
        };
        let low = [0, 1].map(|axis| extreme(axis, f64::INFINITY, f64::min));
        let size = [0, 1].map(|axis| extreme(axis, f64::NEG_INFINITY, f64::max) - low[axis]);
        let count = size.map(|edge| (edge / spacing - 1e-9).ceil().max(1.0));
        let edge = [size[0] / count[0], size[1] / count[1]];
        let mut cells = Vec::new();
        for column in 0..count[0] as usize {
            let left = low[0] + column as f64 * edge[0];
            let strip = clip(&clip(&self.points, 0, left, 1.0), 0, left + edge[0], -1.0);
            for row in 0..count[1] as usize {
                let bottom = low[1] + row as f64 * edge[1];
                let cell = clip(&clip(&strip, 1, bottom, 1.0), 1, bottom + edge[1], -1.0);
                cells.extend(centroid(&cell).filter(|(_, area)| *area > 1e-9 * edge[0] * edge[1]));
            }
        }
        cells
    }

    /// Exact signed distance at `p`, m, and its gradient.
    pub(super) fn distance(&self, p: [f64; 2]) -> (f64, [f64; 2]) {
        let mut best = f64::INFINITY;
        let mut nearest = (&self.edges[0], [0.0; 2]);
        let mut inside = false;
        for edge in &self.edges {
            let w = [p[0] - edge.start[0], p[1] - edge.start[1]];
            if (w[1] >= 0.0) != (w[1] >= edge.span[1]) {
                let left = edge.span[0] * w[1] - edge.span[1] * w[0];
                inside ^= (edge.span[1] > 0.0) == (left > 0.0);
            }
            if edge.on_axis {
                continue;
            }
            let t = ((w[0] * edge.span[0] + w[1] * edge.span[1]) * edge.inverse_square).clamp(0.0, 1.0);
            let gap = [w[0] - t * edge.span[0], w[1] - t * edge.span[1]];
            let square = gap[0] * gap[0] + gap[1] * gap[1];
            if square < best {
                best = square;
                nearest = (edge, gap);
            }
        }
        let sign = if inside { -1.0 } else { 1.0 };
        let length = best.sqrt();
        if length < 1e-12 {
            let (edge, _) = nearest;
            let scale = edge.inverse_square.sqrt();
            return (0.0, [edge.span[1] * scale, -edge.span[0] * scale]);
        }
        (sign * length, nearest.1.map(|g| sign * g / length))
    }
}

impl Edge {
    fn new(a: [f64; 2], b: [f64; 2], revolved: bool) -> Self {
        let span = [b[0] - a[0], b[1] - a[1]];
        let on_axis = revolved && a[0] < 1e-9 && b[0] < 1e-9;
        Self { start: a, span, inverse_square: 1.0 / (span[0] * span[0] + span[1] * span[1]), on_axis }
    }

    /// Positive for points to the left of the edge, negative for points to the right.
    fn side(&self, p: [f64; 2]) -> f64 {
        self.span[0] * (p[1] - self.start[1]) - self.span[1] * (p[0] - self.start[0])
    }
}

/// Twice the signed area (shoelace formula).
fn twice_area(points: &[[f64; 2]]) -> f64 {
    (0..points.len())
        .map(|i| {
            let (a, b) = (points[i], points[(i + 1) % points.len()]);
            a[0] * b[1] - a[1] * b[0]
        })
        .sum()
}

/// The part of a polygon with `side · (p[axis] − at) ≥ 0` (Sutherland & Hodgman 1974).
fn clip(points: &[[f64; 2]], axis: usize, at: f64, side: f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::with_capacity(points.len() + 2);
    for (i, a) in points.iter().enumerate() {
        let b = &points[(i + 1) % points.len()];
        let (high_a, high_b) = (side * (a[axis] - at), side * (b[axis] - at));
        if high_a >= 0.0 {
            kept.push(*a);
        }
        if (high_a >= 0.0) != (high_b >= 0.0) {
            let t = high_a / (high_a - high_b);
            kept.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
        }
    }
    kept
}

/// Centroid and area of a polygon; `None` if the area is 0.
fn centroid(points: &[[f64; 2]]) -> Option<([f64; 2], f64)> {
    let origin = points.first()?;
    let (mut twice, mut moment) = (0.0, [0.0; 2]);
    for pair in points.windows(2) {
        let [a, b] = [pair[0], pair[1]].map(|p| [p[0] - origin[0], p[1] - origin[1]]);
        let cross = a[0] * b[1] - a[1] * b[0];
        twice += cross;
        moment = [0, 1].map(|k| moment[k] + cross * (a[k] + b[k]) / 3.0);
    }
    (twice > 0.0).then(|| ([origin[0] + moment[0] / twice, origin[1] + moment[1] / twice], 0.5 * twice))
}

/// True if two edges that are not neighbours cross.
fn crosses_itself(edges: &[Edge]) -> bool {
    let end = |e: &Edge| [e.start[0] + e.span[0], e.start[1] + e.span[1]];
    (0..edges.len()).any(|i| {
        (i + 1..edges.len()).any(|j| {
            let (a, b) = (&edges[i], &edges[j]);
            a.side(b.start) * a.side(end(b)) < 0.0 && b.side(a.start) * b.side(end(a)) < 0.0
        })
    })
}
