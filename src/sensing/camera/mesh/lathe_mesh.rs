//! Triangles of a revolved profile: clean rings where a skin's cells would be ragged.

use std::f64::consts::TAU;

use crate::geometry::{Vec3, mesh::Mesh, shape::Polygon};

/// Corners are drawn rounded over so much of the edges beside them, m; the surface moves by less than a fifth of it.
const ROUNDED: f64 = 1e-3;
/// SurfaceSamples that round a corner.
const POINTS: usize = 3;
/// Steps along and around a revolved profile, in cells: what is painted on it follows the rings.
const TURNED: [f64; 2] = [0.75, 2.2];

/// Nearer to the axis than this is on it, m.
const ON_AXIS: f64 = 1e-9;

/// The rings of a revolved profile, about `cell` (m) wide.
pub(crate) fn lathed(profile: &Polygon, cell: f64) -> Mesh {
    let widest = profile.points().iter().map(|p| p[0]).fold(0.0, f64::max);
    let turns = (TAU * widest / (TURNED[1] * cell)).ceil() as usize;
    turned(profile, TURNED[0] * cell, turns.clamp(24, 400))
}

/// The profile revolved about z in `turns` pieces, its edges cut to at most `step`, m.
fn turned(profile: &Polygon, step: f64, turns: usize) -> Mesh {
    let ring = cut(&rounded(profile.points()), step);
    let mut vertices = Vec::new();
    // First vertex of each ring of vertices; one on the axis is a single vertex.
    let firsts: Vec<u32> = ring
        .iter()
        .map(|&[r, z]| {
            let first = vertices.len() as u32;
            let pieces = if r < ON_AXIS { 1 } else { turns };
            vertices.extend((0..pieces).map(|k| {
                let (sin, cos) = (TAU * k as f64 / turns as f64).sin_cos();
                Vec3::new(r * cos, r * sin, z)
            }));
            first
        })
        .collect();
    let at = |i: usize, k: usize| {
        if ring[i][0] < ON_AXIS { firsts[i] } else { firsts[i] + (k % turns) as u32 }
    };
    let mut triangles = Vec::new();
    for i in 0..ring.len() {
        let j = (i + 1) % ring.len();
        let axial = [i, j].map(|i| ring[i][0] < ON_AXIS);
        for k in 0..turns {
            let [a, b, c, d] = [at(i, k), at(i, k + 1), at(j, k + 1), at(j, k)];
            if !axial[0] {
                triangles.push([a, b, if axial[1] { d } else { c }]);
            }
            if !axial[1] {
                triangles.push([a, c, d]);
            }
        }
    }
    Mesh { vertices, triangles, uvs: Vec::new() }
}

/// By a root alone, which every machine rounds alike.
fn distance(p: [f64; 2], q: [f64; 2]) -> f64 {
    let [x, y] = [q[0] - p[0], q[1] - p[1]];
    (x * x + y * y).sqrt()
}

/// The polygon with its corners rounded (quadratic Bézier arcs), but for those on the axis.
fn rounded(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let n = points.len();
    let towards = |p: [f64; 2], q: [f64; 2]| {
        let length = distance(p, q);
        let share = ROUNDED.min(0.4 * length) / length;
        [p[0] + (q[0] - p[0]) * share, p[1] + (q[1] - p[1]) * share]
    };
    let mut out = Vec::new();
    for i in 0..n {
        let (before, here, after) = (points[(i + n - 1) % n], points[i], points[(i + 1) % n]);
        if here[0] < ON_AXIS {
            out.push(here);
            continue;
        }
        let (from, to) = (towards(here, before), towards(here, after));
        out.extend((0..=POINTS).map(|k| {
            let t = k as f64 / POINTS as f64;
            let [a, b, c] = [(1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t];
            std::array::from_fn(|axis| a * from[axis] + b * here[axis] + c * to[axis])
        }));
    }
    out
}

/// The polygon with points between, so that no edge is longer than `step`, m.
fn cut(points: &[[f64; 2]], step: f64) -> Vec<[f64; 2]> {
    let mut out = Vec::new();
    for (i, &a) in points.iter().enumerate() {
        let b = points[(i + 1) % points.len()];
        let on_axis = a[0] < ON_AXIS && b[0] < ON_AXIS;
        let length = distance(a, b);
        let pieces = if on_axis { 1 } else { (length / step).ceil().max(1.0) as usize };
        out.extend((0..pieces).map(|k| {
            let t = k as f64 / pieces as f64;
            [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
        }));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_profile_is_closed_faces_outwards_and_encloses_its_volume() {
        let profile =
            Polygon::revolved(vec![[0.0, 0.0], [0.05, 0.0], [0.05, 0.02], [0.0, 0.02]]).expect("a profile");
        let mesh = turned(&profile, 2e-3, 128);
        let volume: f64 = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum();
        let expected = std::f64::consts::PI * 0.05 * 0.05 * 0.02;
        assert!((volume / expected - 1.0).abs() < 2e-3, "{volume} {expected}");
        let mut edges = std::collections::BTreeMap::new();
        for t in &mesh.triangles {
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|&balance| balance == 0), "every edge is passed once each way");
    }
}
