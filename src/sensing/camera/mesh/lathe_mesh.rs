//! Triangulates surfaces of revolution as rings, where the cells of a general surface mesher would be ragged.

use std::f64::consts::TAU;

use crate::geometry::{Vec3, mesh::Mesh, shape::Polygon};

/// Length along each edge over which a corner is drawn rounded, m. The surface moves by less than a fifth of it.
const CORNER_LENGTH: f64 = 1e-3;
/// Segments of a rounded corner.
const CORNER_SEGMENTS: usize = 3;
/// Edge lengths of the mesh in cells. Rings are close along the profile, since painted patterns usually follow them.
const STEP_ALONG: f64 = 0.75;
const STEP_AROUND: f64 = 2.2;

/// Points closer to the axis than this lie on it, m.
const ON_AXIS: f64 = 1e-9;

/// Triangulates a profile revolved about z, with edges about `cell` long, m.
pub(crate) fn lathe_mesh(profile: &Polygon, cell: f64) -> Mesh {
    let max_radius = profile.points().iter().map(|p| p[0]).fold(0.0, f64::max);
    let sectors = (TAU * max_radius / (STEP_AROUND * cell)).ceil() as usize;
    revolve(profile, STEP_ALONG * cell, sectors.clamp(24, 400))
}

/// Revolves a profile in `sectors` steps; its edges are divided to at most `step`, m.
fn revolve(profile: &Polygon, step: f64, sectors: usize) -> Mesh {
    let outline = subdivide(&round_corners(profile.points()), step);
    let mut vertices = Vec::new();
    // First vertex of each ring; a ring on the axis is a single vertex.
    let ring_starts: Vec<u32> = outline
        .iter()
        .map(|&[r, z]| {
            let start = vertices.len() as u32;
            let count = if r < ON_AXIS { 1 } else { sectors };
            vertices.extend((0..count).map(|k| {
                let (sin, cos) = (TAU * k as f64 / sectors as f64).sin_cos();
                Vec3::new(r * cos, r * sin, z)
            }));
            start
        })
        .collect();
    let is_on_axis = |i: usize| outline[i][0] < ON_AXIS;
    let vertex = |i: usize, k: usize| {
        if is_on_axis(i) { ring_starts[i] } else { ring_starts[i] + (k % sectors) as u32 }
    };
    let mut triangles = Vec::new();
    for i in 0..outline.len() {
        let j = (i + 1) % outline.len();
        for k in 0..sectors {
            let [a, b, c, d] = [vertex(i, k), vertex(i, k + 1), vertex(j, k + 1), vertex(j, k)];
            if !is_on_axis(i) {
                triangles.push([a, b, if is_on_axis(j) { d } else { c }]);
            }
            if !is_on_axis(j) {
                triangles.push([a, c, d]);
            }
        }
    }
    Mesh { vertices, triangles, uvs: Vec::new() }
}

/// Distance by a square root, which rounds alike on every machine; `hypot` does not.
fn distance(p: [f64; 2], q: [f64; 2]) -> f64 {
    let [x, y] = [q[0] - p[0], q[1] - p[1]];
    (x * x + y * y).sqrt()
}

/// Rounds the corners of a polygon by quadratic Bézier arcs, except those on the axis.
fn round_corners(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let n = points.len();
    let towards = |p: [f64; 2], q: [f64; 2]| {
        let length = distance(p, q);
        let share = CORNER_LENGTH.min(0.4 * length) / length;
        [p[0] + (q[0] - p[0]) * share, p[1] + (q[1] - p[1]) * share]
    };
    let mut rounded = Vec::new();
    for i in 0..n {
        let (previous, corner, next) = (points[(i + n - 1) % n], points[i], points[(i + 1) % n]);
        if corner[0] < ON_AXIS {
            rounded.push(corner);
            continue;
        }
        let (from, to) = (towards(corner, previous), towards(corner, next));
        rounded.extend((0..=CORNER_SEGMENTS).map(|k| {
            let t = k as f64 / CORNER_SEGMENTS as f64;
            let [a, b, c] = [(1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t];
            std::array::from_fn(|axis| a * from[axis] + b * corner[axis] + c * to[axis])
        }));
    }
    rounded
}

/// Divides the edges of a polygon to at most `step`, m, except those on the axis.
fn subdivide(points: &[[f64; 2]], step: f64) -> Vec<[f64; 2]> {
    let mut divided = Vec::new();
    for (i, &a) in points.iter().enumerate() {
        let b = points[(i + 1) % points.len()];
        let is_on_axis = a[0] < ON_AXIS && b[0] < ON_AXIS;
        let pieces = if is_on_axis { 1 } else { (distance(a, b) / step).ceil().max(1.0) as usize };
        divided.extend((0..pieces).map(|k| {
            let t = k as f64 / pieces as f64;
            [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
        }));
    }
    divided
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_revolved_profile_is_closed_faces_outwards_and_encloses_its_volume() {
        let profile =
            Polygon::revolved(vec![[0.0, 0.0], [0.05, 0.0], [0.05, 0.02], [0.0, 0.02]]).expect("a profile");
        let mesh = revolve(&profile, 2e-3, 128);
        let volume = mesh.volume();
        let expected = std::f64::consts::PI * 0.05 * 0.05 * 0.02;
        assert!((volume / expected - 1.0).abs() < 2e-3, "{volume} {expected}");
        let mut edges = std::collections::BTreeMap::new();
        for t in &mesh.triangles {
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|&balance| balance == 0), "each edge occurs once in each direction");
    }
}
