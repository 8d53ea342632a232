//! Building blocks of the drawn robot. Those that stay plain are meshed exactly, those that grow together by their field.

use std::sync::Arc;

use nalgebra::{Quaternion, Unit};

use super::rounded_plate::RoundedPlate;
use crate::{
    geometry::{Pose, Quat, Vec3, shape::Shape},
    sensing::camera::RenderSolid,
};

/// Pieces of a turn around large drums and around small ones.
const TURNS: [usize; 2] = [36, 20];
/// Drums of a smaller radius are small, m.
const SMALL: f64 = 0.025;
/// Pieces of a turn around the corners of blocks and slabs.
const CORNER_TURNS: usize = 16;

/// The frame at the middle of two points whose z axis points from one to the other, and half their distance.
fn between(from: [f64; 3], to: [f64; 3]) -> (Pose, f64) {
    let (from, to) = (Vec3::from(from), Vec3::from(to));
    let span = to - from;
    let turn = Quat::rotation_between(&Vec3::z(), &span)
        .unwrap_or_else(|| Quat::from_axis_angle(&Unit::new_unchecked(Vec3::x()), std::f64::consts::PI));
    (Pose::from_parts((0.5 * (from + to)).into(), turn), 0.5 * span.norm())
}

/// A capsule of `radius` between two points, m.
pub(super) fn limb(from: [f64; 3], to: [f64; 3], radius: f64) -> Shape {
    let (pose, half_length) = between(from, to);
    Shape::Capsule { radius, half_length }.placed(pose)
}

/// A cylinder of `radius` from one point to another whose edges are rounded by `edge`, m.
pub(super) fn drum(from: [f64; 3], to: [f64; 3], radius: f64, edge: f64) -> Shape {
    let (pose, half) = between(from, to);
    Shape::Cylinder { radius: radius - edge, half_height: half - edge }.rounded(edge).placed(pose)
}

/// A [`drum`] that stands for itself.
pub(super) fn ring(from: [f64; 3], to: [f64; 3], radius: f64, edge: f64, visual: usize) -> RenderSolid {
    let (pose, half) = between(from, to);
    let turns = TURNS[usize::from(radius < SMALL)];
    let mesh = RoundedPlate { corners: vec![[0.0; 2]], round: radius, half, edge, turns }.mesh(&pose);
    RenderSolid::with_mesh(drum(from, to, radius, edge), mesh, visual)
}

/// A box of these half extents about `centre` whose edges are rounded by `edge`, m.
pub(super) fn block(centre: [f64; 3], half: [f64; 3], edge: f64) -> Shape {
    let inner = Shape::Box { half: Vec3::from(half).add_scalar(-edge) };
    inner.rounded(edge).translated(Vec3::from(centre))
}

/// A box in the frame `pose` of these half extents that stands for itself; its outline in x and y is rounded by `corner`,
/// its edges in z by `edge`, m.
pub(super) fn case(pose: &Pose, half: [f64; 3], corner: f64, edge: f64, visual: usize) -> RenderSolid {
    let [x, y] = [half[0] - corner, half[1] - corner];
    let corners = vec![[-x, -y], [x, -y], [x, y], [-x, y]];
    let pillow = RoundedPlate { corners, round: corner, half: half[2], edge, turns: CORNER_TURNS };
    RenderSolid::with_mesh(block([0.0; 3], half, edge).placed(*pose), pillow.mesh(pose), visual)
}

/// A convex polygon (y, z) drawn out to `half` on either side of x = 0, outline and edges rounded by `edge`, m, in `pose`.
pub(super) fn slab(pose: &Pose, corners: &[[f64; 2]], half: f64, edge: f64, visual: usize) -> RenderSolid {
    // x, y, z become y, z, x.
    let cycle =
        Pose::from_parts(Vec3::zeros().into(), Quat::new_unchecked(Quaternion::new(0.5, 0.5, 0.5, 0.5)));
    let pillow = RoundedPlate { corners: corners.to_vec(), round: edge, half, edge, turns: 2 * CORNER_TURNS };
    let mesh = pillow.mesh(&(pose * cycle));
    let (low, high) = corners.iter().fold(([f64::MAX; 2], [f64::MIN; 2]), |(low, high), c| {
        (std::array::from_fn(|i| low[i].min(c[i])), std::array::from_fn(|i| high[i].max(c[i])))
    });
    let middle = [0.0, 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
    let extent = [half, 0.5 * (high[0] - low[0]) + edge, 0.5 * (high[1] - low[1]) + edge];
    RenderSolid::with_mesh(block(middle, extent, edge).placed(*pose), mesh, visual)
}

/// Shapes grown together with fillets of `blend`, m.
pub(super) fn blended(parts: Vec<Shape>, blend: f64) -> Shape {
    Shape::SmoothUnion { parts, blend }
}

/// A shape without what lies below z = 0.
pub(super) fn flat_below(shape: Shape) -> Shape {
    let below = Shape::Box { half: Vec3::repeat(0.5) }.translated(Vec3::new(0.0, 0.0, -0.5));
    Shape::Subtract { from: Arc::new(shape), cut: Arc::new(below) }
}
