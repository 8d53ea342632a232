//! Building blocks of the robot's meshes. Plain ones get exact meshes; blended ones are meshed
//! from their distance field.

use std::sync::Arc;

use nalgebra::{Quaternion, Unit};

use super::rounded_plate::RoundedPlate;
use crate::{
    geometry::{Pose, Quat, Vec3, shape::Shape},
    sensing::camera::RenderSolid,
};

/// Segments of a full turn around cylinders.
const CYLINDER_SEGMENTS: usize = 36;
/// Segments of a full turn around cylinders of a radius below `SMALL_RADIUS`.
const SMALL_CYLINDER_SEGMENTS: usize = 20;
const SMALL_RADIUS: f64 = 0.025;
/// Segments of a full turn around the corners of boxes and plates.
const CORNER_SEGMENTS: usize = 16;

/// The frame midway between two points with its z axis from one to the other, and half their distance.
fn between(from: [f64; 3], to: [f64; 3]) -> (Pose, f64) {
    let (from, to) = (Vec3::from(from), Vec3::from(to));
    let span = to - from;
    let turn = Quat::rotation_between(&Vec3::z(), &span)
        .unwrap_or_else(|| Quat::from_axis_angle(&Unit::new_unchecked(Vec3::x()), std::f64::consts::PI));
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

/// A convex polygon (y, z) extruded to `half` on both sides of x = 0, with outline and edges rounded by
/// `edge`, m, in `pose`.
pub(super) fn plate_solid(
    pose: &Pose,
    corners: &[[f64; 2]],
    half: f64,
    edge: f64,
    visual: usize,
) -> RenderSolid {
    // Maps x, y, z to y, z, x.
    let cycle =
        Pose::from_parts(Vec3::zeros().into(), Quat::new_unchecked(Quaternion::new(0.5, 0.5, 0.5, 0.5)));
    let plate = RoundedPlate {
        corners: corners.to_vec(),
        outset: edge,
        half_height: half,
        edge,
        segments: 2 * CORNER_SEGMENTS,
    };
    let mesh = plate.mesh(&(pose * cycle));
    let (low, high) = corners.iter().fold(([f64::MAX; 2], [f64::MIN; 2]), |(low, high), c| {
        (std::array::from_fn(|i| low[i].min(c[i])), std::array::from_fn(|i| high[i].max(c[i])))
    });
    let middle = [0.0, 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
    let extent = [half, 0.5 * (high[0] - low[0]) + edge, 0.5 * (high[1] - low[1]) + edge];
    RenderSolid::with_mesh(rounded_box(middle, extent, edge).placed(*pose), mesh, visual)
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
