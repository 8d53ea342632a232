//! Building blocks of the robot's meshes. Plain ones get exact meshes; blended ones are meshed
//! from their distance field.

use std::{
    f64::consts::{FRAC_PI_2, PI, TAU},
    sync::Arc,
};

use nalgebra::Quaternion;

use crate::camera::RenderSolid;
use softvt_geometry::{Pose, Quat, Vec3, mesh::Mesh, shape::Shape};

/// Segments of a full turn around cylinders.
const CYLINDER_SEGMENTS: usize = 36;
/// Segments of a full turn around cylinders of a radius below `SMALL_RADIUS`.
const SMALL_CYLINDER_SEGMENTS: usize = 20;
const SMALL_RADIUS: f64 = 0.025;
/// Segments of a full turn around the corners of boxes and plates.
const CORNER_SEGMENTS: usize = 16;
/// Segments across a rounded edge, and across one at least [`WIDE_EDGE`] wide.
const EDGE_SEGMENTS: usize = 2;
const WIDE_EDGE_SEGMENTS: usize = 4;
/// Width of a wide edge, m.
const WIDE_EDGE: f64 = 5e-3;

/// The frame midway between two points with its z axis from one to the other, and half their distance.
fn between(from: [f64; 3], to: [f64; 3]) -> (Pose, f64) {
    let (from, to) = (Vec3::from(from), Vec3::from(to));
    let span = to - from;
    let turn = Quat::rotation_between(&Vec3::z(), &span)
        .unwrap_or_else(|| Quat::from_axis_angle(&Vec3::x_axis(), PI));
    (Pose::from_parts((0.5 * (from + to)).into(), turn), 0.5 * span.norm())
}

/// A capsule of `radius` between two points, m.
pub(super) fn capsule(from: [f64; 3], to: [f64; 3], radius: f64) -> Shape {
    let (pose, half_length) = between(from, to);
    Shape::Capsule { radius, half_length }.placed(pose)
}

/// A cylinder of `radius` from one point to another whose edges are rounded by `edge`, m.
pub(super) fn rounded_cylinder(from: [f64; 3], to: [f64; 3], radius: f64, edge: f64) -> Shape {
    let (pose, half) = between(from, to);
    Shape::Cylinder { radius: radius - edge, half_height: half - edge }.rounded(edge).placed(pose)
}

/// A solid in the shape of a [`rounded_cylinder`].
pub(super) fn cylinder_solid(
    from: [f64; 3],
    to: [f64; 3],
    radius: f64,
    edge: f64,
    visual: usize,
) -> RenderSolid {
    let (pose, half) = between(from, to);
    let segments = if radius < SMALL_RADIUS { SMALL_CYLINDER_SEGMENTS } else { CYLINDER_SEGMENTS };
    let mesh = RoundedPlate { corners: vec![[0.0; 2]], outset: radius, half_height: half, edge, segments }
        .mesh(&pose);
    RenderSolid::with_mesh(rounded_cylinder(from, to, radius, edge), mesh, visual)
}

/// A box of these half extents about `centre` whose edges are rounded by `edge`, m.
pub(super) fn rounded_box(centre: [f64; 3], half: [f64; 3], edge: f64) -> Shape {
    let inner = Shape::Box { half: Vec3::from(half).add_scalar(-edge) };
    inner.rounded(edge).translated(Vec3::from(centre))
}

/// A box solid with these half extents in the frame `pose`; its outline in x and y is rounded by `corner`, its edges
/// in z by `edge`, m.
pub(super) fn box_solid(pose: &Pose, half: [f64; 3], corner: f64, edge: f64, visual: usize) -> RenderSolid {
    let [x, y] = [half[0] - corner, half[1] - corner];
    let corners = vec![[-x, -y], [x, -y], [x, y], [-x, y]];
    let plate =
        RoundedPlate { corners, outset: corner, half_height: half[2], edge, segments: CORNER_SEGMENTS };
    RenderSolid::with_mesh(rounded_box([0.0; 3], half, edge).placed(*pose), plate.mesh(pose), visual)
}

/// A convex polygon (y, z) extruded to `half` on both sides of x = 0, with outline and edges rounded by `edge`, m.
pub(super) fn plate_solid(corners: &[[f64; 2]], half: f64, edge: f64, visual: usize) -> RenderSolid {
    // Maps x, y, z to y, z, x.
    let cycle =
        Pose::from_parts(Vec3::zeros().into(), Quat::new_unchecked(Quaternion::new(0.5, 0.5, 0.5, 0.5)));
    let (low, high) = corners.iter().fold(([f64::MAX; 2], [f64::MIN; 2]), |(low, high), c| {
        (std::array::from_fn(|i| low[i].min(c[i])), std::array::from_fn(|i| high[i].max(c[i])))
    });
    let middle = [0.0, 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
    let extent = [half, 0.5 * (high[0] - low[0]) + edge, 0.5 * (high[1] - low[1]) + edge];
    let (corners, segments) = (corners.to_vec(), 2 * CORNER_SEGMENTS);
    let plate = RoundedPlate { corners, outset: edge, half_height: half, edge, segments };
    RenderSolid::with_mesh(rounded_box(middle, extent, edge), plate.mesh(&cycle), visual)
}

/// A union with fillets of `blend`, m.
pub(super) fn blended(parts: Vec<Shape>, blend: f64) -> Shape {
    Shape::SmoothUnion { parts, blend }
}

/// The part of a shape above z = 0.
pub(super) fn flat_below(shape: Shape) -> Shape {
    let below = Shape::Box { half: Vec3::repeat(0.5) }.translated(Vec3::new(0.0, 0.0, -0.5));
    Shape::Subtract { from: Arc::new(shape), cut: Arc::new(below) }
}

/// A convex polygon offset outwards, extruded along z and rounded at its edges. Lengths are in m.
#[derive(Clone, Debug)]
struct RoundedPlate {
    /// Counter-clockwise; a single point makes a disc.
    corners: Vec<[f64; 2]>,
    /// Offset of the outline from the polygon, which rounds its corners.
    outset: f64,
    half_height: f64,
    /// Radius of the rounded edges.
    edge: f64,
    /// Segments of a full turn.
    segments: usize,
}

impl RoundedPlate {
    /// Triangulates the plate at `pose`.
    fn mesh(&self, pose: &Pose) -> Mesh {
        let edge_segments = if self.edge >= WIDE_EDGE { WIDE_EDGE_SEGMENTS } else { EDGE_SEGMENTS };
        // From the bottom up, with the angle of each ring around the rounded edge.
        let lower = (0..=edge_segments).map(|k| (-1.0, k));
        let rings = lower.chain((0..=edge_segments).rev().map(|k| (1.0, k)));
        let mut points: Vec<Vec3> = Vec::new();
        for (side, k) in rings {
            let angle = FRAC_PI_2 * k as f64 / edge_segments as f64;
            let z = side * (self.half_height - self.edge * (1.0 - angle.cos()));
            let outline = self.outline(self.outset - self.edge * (1.0 - angle.sin()));
            points.extend(outline.into_iter().map(|[x, y]| Vec3::new(x, y, z)));
        }
        let ring_count = 2 * (edge_segments + 1);
        let count = points.len() / ring_count;
        let vertex = |ring: usize, j: usize| (ring * count + j % count) as u32;
        let mut triangles = Vec::new();
        for ring in 0..ring_count - 1 {
            for j in 0..count {
                let [a, b] = [vertex(ring, j), vertex(ring, j + 1)];
                let [c, d] = [vertex(ring + 1, j + 1), vertex(ring + 1, j)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        let top = ring_count - 1;
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

    /// The polygon offset by `outset`: an arc at each corner, from the normal of one side to the normal of the next.
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
