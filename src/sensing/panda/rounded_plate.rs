//! Plates with rounded outlines and rounded edges, as few triangles: rings, caps, cases.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::geometry::{Pose, Vec3, mesh::Mesh};

/// Rings along each rounded edge, and along a wide one, m.
const RINGS: [usize; 2] = [2, 4];
const WIDE: f64 = 5e-3;

/// A convex polygon (counter-clockwise; one point makes a circle) grown by `round` and raised to `half` on either side of
/// z = 0, its edges rounded by `edge`, all m.
#[derive(Clone, Debug)]
pub(super) struct RoundedPlate {
    pub corners: Vec<[f64; 2]>,
    pub round: f64,
    pub half: f64,
    pub edge: f64,
    /// Pieces of a whole turn.
    pub turns: usize,
}

impl RoundedPlate {
    /// Triangles, placed by `pose`.
    pub(super) fn mesh(&self, pose: &Pose) -> Mesh {
        let count = RINGS[usize::from(self.edge >= WIDE)];
        let edge = |k: usize| {
            let angle = FRAC_PI_2 * k as f64 / count as f64;
            (self.round - self.edge * (1.0 - angle.sin()), self.half - self.edge * (1.0 - angle.cos()))
        };
        // From the lower cap up: (growth, z) of each ring.
        let lower = (0..=count).map(|k| (edge(k).0, -edge(k).1));
        let rings: Vec<(f64, f64)> = lower.chain((0..=count).rev().map(edge)).collect();
        let mut points: Vec<Vec3> = Vec::new();
        for (growth, z) in &rings {
            points.extend(self.outline(*growth).into_iter().map(|[x, y]| Vec3::new(x, y, *z)));
        }
        let count = points.len() / rings.len();
        let at = |ring: usize, j: usize| (ring * count + j % count) as u32;
        let mut triangles = Vec::new();
        for ring in 0..rings.len() - 1 {
            for j in 0..count {
                let [a, b, c, d] = [at(ring, j), at(ring, j + 1), at(ring + 1, j + 1), at(ring + 1, j)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        let top = rings.len() - 1;
        for j in 1..count - 1 {
            triangles.push([at(0, 0), at(0, j + 1), at(0, j)]);
            triangles.push([at(top, 0), at(top, j), at(top, j + 1)]);
        }
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            (b - a).cross(&(c - a)).norm()
        };
        triangles.retain(|t| area(t) > 1e-12);
        let vertices = points.iter().map(|p| pose.transform_point(&(*p).into()).coords).collect();
        Mesh { vertices, triangles, uvs: Vec::new() }
    }

    /// The polygon grown by `growth`: an arc at each corner, from the normal of one side to that of the next.
    fn outline(&self, growth: f64) -> Vec<[f64; 2]> {
        let n = self.corners.len();
        let mut out = Vec::new();
        for i in 0..n {
            let [before, here, after] =
                [self.corners[(i + n - 1) % n], self.corners[i], self.corners[(i + 1) % n]];
            let normal = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).atan2(b[1] - a[1]);
            let (from, turn) = if n == 1 {
                (0.0, TAU * (1.0 - 1.0 / self.turns as f64))
            } else {
                let (from, to) = (normal(before, here), normal(here, after));
                (from, (to - from).rem_euclid(TAU))
            };
            let steps = ((turn / TAU * self.turns as f64).ceil() as usize).max(1);
            out.extend((0..=steps).map(|k| {
                let (sin, cos) = (from + turn * k as f64 / steps as f64).sin_cos();
                [here[0] + growth * cos, here[1] + growth * sin]
            }));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume by the divergence theorem; positive where the triangles face outwards.
    fn volume(mesh: &Mesh) -> f64 {
        mesh.triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }

    #[test]
    fn a_round_pillow_is_a_cylinder_and_a_square_one_a_box_each_less_its_edges() {
        let placed = Pose::translation(0.1, -0.2, 0.3);
        let round = RoundedPlate { corners: vec![[0.0; 2]], round: 0.05, half: 0.02, edge: 1e-6, turns: 256 }
            .mesh(&placed);
        let expected = std::f64::consts::PI * 0.05 * 0.05 * 0.04;
        assert!((volume(&round) / expected - 1.0).abs() < 1e-3, "{}", volume(&round));
        let corners = vec![[-0.03, -0.02], [0.03, -0.02], [0.03, 0.02], [-0.03, 0.02]];
        let square = RoundedPlate { corners, round: 1e-6, half: 0.01, edge: 1e-6, turns: 8 }.mesh(&placed);
        assert!((volume(&square) / (0.06 * 0.04 * 0.02) - 1.0).abs() < 1e-3, "{}", volume(&square));
    }
}
