//! Plates with rounded outlines and edges, in few triangles: discs, caps and cases.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::geometry::{Pose, Vec3, mesh::Mesh};

/// Segments across a rounded edge, and across one at least [`WIDE_EDGE`] wide.
const EDGE_SEGMENTS: usize = 2;
const WIDE_EDGE_SEGMENTS: usize = 4;
/// Width of a wide edge, m.
const WIDE_EDGE: f64 = 5e-3;

/// A convex polygon offset outwards, extruded along z and rounded at its edges. Lengths are in m.
#[derive(Clone, Debug)]
pub(super) struct RoundedPlate {
    /// Counter-clockwise; a single point makes a disc.
    pub(super) corners: Vec<[f64; 2]>,
    /// Offset of the outline from the polygon, which rounds its corners.
    pub(super) outset: f64,
    pub(super) half_height: f64,
    /// Radius of the rounded edges.
    pub(super) edge: f64,
    /// Segments of a full turn.
    pub(super) segments: usize,
}

/// A horizontal section of a plate.
#[derive(Clone, Copy)]
struct Ring {
    outset: f64,
    z: f64,
}

impl RoundedPlate {
    /// Triangulates the plate at `pose`.
    pub(super) fn mesh(&self, pose: &Pose) -> Mesh {
        let edge_segments = if self.edge >= WIDE_EDGE { WIDE_EDGE_SEGMENTS } else { EDGE_SEGMENTS };
        let upper_ring = |k: usize| {
            let angle = FRAC_PI_2 * k as f64 / edge_segments as f64;
            Ring {
                outset: self.outset - self.edge * (1.0 - angle.sin()),
                z: self.half_height - self.edge * (1.0 - angle.cos()),
            }
        };
        // From the bottom up.
        let lower = (0..=edge_segments).map(upper_ring).map(|ring| Ring { z: -ring.z, ..ring });
        let rings: Vec<Ring> = lower.chain((0..=edge_segments).rev().map(upper_ring)).collect();
        let mut points: Vec<Vec3> = Vec::new();
        for ring in &rings {
            points.extend(self.outline(ring.outset).into_iter().map(|[x, y]| Vec3::new(x, y, ring.z)));
        }
        let count = points.len() / rings.len();
        let vertex = |ring: usize, j: usize| (ring * count + j % count) as u32;
        let mut triangles = Vec::new();
        for ring in 0..rings.len() - 1 {
            for j in 0..count {
                let [a, b] = [vertex(ring, j), vertex(ring, j + 1)];
                let [c, d] = [vertex(ring + 1, j + 1), vertex(ring + 1, j)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        let top = rings.len() - 1;
        for j in 1..count - 1 {
            triangles.push([vertex(0, 0), vertex(0, j + 1), vertex(0, j)]);
            triangles.push([vertex(top, 0), vertex(top, j), vertex(top, j + 1)]);
        }
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            (b - a).cross(&(c - a)).norm()
        };
        triangles.retain(|t| area(t) > 1e-12);
        let vertices = points.iter().map(|p| pose.transform_point(&(*p).into()).coords).collect();
        Mesh { vertices, triangles, uvs: Vec::new() }
    }

    /// The polygon offset by `outset`: an arc at each corner, from the normal of one side to that of the next.
    fn outline(&self, outset: f64) -> Vec<[f64; 2]> {
        let n = self.corners.len();
        let mut outline = Vec::new();
        for i in 0..n {
            let [previous, corner, next] =
                [self.corners[(i + n - 1) % n], self.corners[i], self.corners[(i + 1) % n]];
            let normal_angle = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).atan2(b[1] - a[1]);
            let (start, turn) = if n == 1 {
                (0.0, TAU * (1.0 - 1.0 / self.segments as f64))
            } else {
                let (from, to) = (normal_angle(previous, corner), normal_angle(corner, next));
                (from, (to - from).rem_euclid(TAU))
            };
            let steps = ((turn / TAU * self.segments as f64).ceil() as usize).max(1);
            outline.extend((0..=steps).map(|k| {
                let (sin, cos) = (start + turn * k as f64 / steps as f64).sin_cos();
                [corner[0] + outset * cos, corner[1] + outset * sin]
            }));
        }
        outline
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plates_enclose_the_volumes_of_a_cylinder_and_a_box() {
        let placed = Pose::translation(0.1, -0.2, 0.3);
        let disc = RoundedPlate {
            corners: vec![[0.0; 2]],
            outset: 0.05,
            half_height: 0.02,
            edge: 1e-6,
            segments: 256,
        };
        let volume = disc.mesh(&placed).volume();
        let expected = std::f64::consts::PI * 0.05 * 0.05 * 0.04;
        assert!((volume / expected - 1.0).abs() < 1e-3, "{volume}");
        let corners = vec![[-0.03, -0.02], [0.03, -0.02], [0.03, 0.02], [-0.03, 0.02]];
        let plate = RoundedPlate { corners, outset: 1e-6, half_height: 0.01, edge: 1e-6, segments: 8 };
        let volume = plate.mesh(&placed).volume();
        assert!((volume / (0.06 * 0.04 * 0.02) - 1.0).abs() < 1e-3, "{volume}");
    }
}
