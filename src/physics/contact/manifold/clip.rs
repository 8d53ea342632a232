//! Clipping of convex polygons and lines in the plane, with feature identifiers that survive small changes.

/// A corner of a convex polygon, counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    /// Position in the plane, m.
    pub p: [f64; 2],
    /// Identifier of the corner.
    pub feature: u32,
    /// Identifier of the edge to the next corner.
    pub edge: u32,
}

/// Distance outside of the other polygon up to which a corner counts as inside, m: flush stacked boxes keep the same
/// corners despite rounding of their poses.
const SNAP_M: f64 = 1e-6;

/// Identifier of the crossing of an edge of the first body with one of the second; distinct from those of corners.
pub(super) fn crossing(edge_a: u32, edge_b: u32) -> u32 {
    const NON_MATERIAL: u32 = super::NON_MATERIAL;
    (edge_a | edge_b) & NON_MATERIAL | 2 << 28 | (edge_a & 0xfff) << 12 | edge_b & 0xfff
}

/// Twice the signed area of the triangle o, p, q, m².
pub(super) fn turn(o: &[f64; 2], p: &[f64; 2], q: &[f64; 2]) -> f64 {
    (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0])
}

/// The overlap of two convex counter-clockwise polygons (Sutherland & Hodgman, Comm. ACM 17, 1974); empty
/// if they are apart.
pub(super) fn overlap(a: &[Corner], b: &[Corner]) -> Vec<Corner> {
    // With each corner, whether its outgoing edge is one of b's, and the index of that edge: they identify new corners.
    let mut kept: Vec<(Corner, bool, usize)> = a.iter().enumerate().map(|(i, &c)| (c, false, i)).collect();
    for j in 0..b.len() {
        let (from, to) = (b[j].p, b[(j + 1) % b.len()].p);
        let snap = SNAP_M * (to[0] - from[0]).hypot(to[1] - from[1]);
        let height = |c: &Corner| turn(&from, &to, &c.p);
        let mut next = Vec::with_capacity(kept.len() + 1);
        for i in 0..kept.len() {
            let (here, of_b, index) = kept[i];
            let there = kept[(i + 1) % kept.len()].0;
            let (h0, h1) = (height(&here), height(&there));
            let (in0, in1) = (h0 >= -snap, h1 >= -snap);
            if in0 {
                next.push(kept[i]);
            }
            if in0 == in1 {
                continue;
            }
            let p = between(&here.p, &there.p, (h0 / (h0 - h1)).clamp(0.0, 1.0));
            let feature = if of_b { corner_of(b, index, j) } else { crossing(here.edge, b[j].edge) };
            next.push(if in0 {
                (Corner { p, feature, edge: b[j].edge }, true, j)
            } else {
                (Corner { p, feature, edge: here.edge }, of_b, index)
            });
        }
        kept = next;
    }
    kept.into_iter().map(|(corner, ..)| corner).collect()
}

/// The corner of `b` between its edges `i` and `j`.
fn corner_of(b: &[Corner], i: usize, j: usize) -> u32 {
    if (i + 1) % b.len() == j { b[j].feature } else { b[i].feature }
}

pub(super) fn between(p: &[f64; 2], q: &[f64; 2], t: f64) -> [f64; 2] {
    [p[0] + (q[0] - p[0]) * t, p[1] + (q[1] - p[1]) * t]
}

/// An end of a clipped line.
#[derive(Clone, Copy)]
pub(super) struct ClippedEnd {
    /// Position along the line, 0..=1.
    pub t: f64,
    /// Index of the polygon's edge that clips here, if one does.
    pub edge: Option<usize>,
}

/// The part of the line `ends` inside of a convex counter-clockwise polygon. `None` if the line is outside by
/// more than `slack` (m).
pub(super) fn clip_line(ends: &[[f64; 2]; 2], polygon: &[Corner], slack: f64) -> Option<[ClippedEnd; 2]> {
    let length = |p: &[f64; 2], q: &[f64; 2]| (q[0] - p[0]).hypot(q[1] - p[1]);
    let (mut first, mut last) = (ClippedEnd { t: 0.0, edge: None }, ClippedEnd { t: 1.0, edge: None });
    for j in 0..polygon.len() {
        let (from, to) = (polygon[j].p, polygon[(j + 1) % polygon.len()].p);
        let (h0, h1) = (turn(&from, &to, &ends[0]), turn(&from, &to, &ends[1]));
        let allowed = -slack * length(&from, &to);
        if h0 < allowed && h1 < allowed {
            return None;
        }
        // An end within the slack counts as on the edge.
        if h0 < allowed {
            let cut = if h1 > 0.0 { h0 / (h0 - h1) } else { 1.0 };
            first = if cut > first.t { ClippedEnd { t: cut, edge: Some(j) } } else { first };
        } else if h1 < allowed {
            let cut = if h0 > 0.0 { h0 / (h0 - h1) } else { 0.0 };
            last = if cut < last.t { ClippedEnd { t: cut, edge: Some(j) } } else { last };
        }
    }
    ((first.t - last.t) * length(&ends[0], &ends[1]) <= slack).then_some([first, last])
}

/// Twice the signed area of a polygon, m²; positive if counter-clockwise.
pub(super) fn area2(polygon: &[Corner]) -> f64 {
    (1..polygon.len().max(2) - 1).map(|i| turn(&polygon[0].p, &polygon[i].p, &polygon[i + 1].p)).sum()
}

/// Share of each corner in the perimeter of a polygon: half of the two edges that meet there. If a corner splits in
/// two, so does its share.
pub(super) fn shares(polygon: &[Corner]) -> Vec<f64> {
    let count = polygon.len();
    let length = |i: usize| {
        let (p, q) = (polygon[i % count].p, polygon[(i + 1) % count].p);
        (q[0] - p[0]).hypot(q[1] - p[1])
    };
    let outline: f64 = (0..count).map(length).sum();
    (0..count).map(|i| 0.5 * (length(i + count - 1) + length(i)) / outline).collect()
}
