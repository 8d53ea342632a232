//! Features of a primitive that face a direction: a flat face, a side line.

use std::f64::consts::TAU;

use super::{NON_MATERIAL, Placed, Primitive};
use softvt_geometry::{Pose, Vec3};

/// Number of points that represent a rim in flat contact. The circle is at most 0.9 % outside of their polygon, which
/// changes a tipping angle by less than 0.25°.
pub(super) const RIM_POINTS: u32 = 24;
/// Tilt (sine) up to which a cap carries in full as a face.
const CAP_FULL_TILT: f64 = 0.05;
/// Tilt (sine) from which only the lowest point of its rim can touch.
const CAP_MAX_TILT: f64 = 0.1;
/// Tilt (sine) of the cap from which a side line counts in full; for a flat cap its position is undefined.
const LINE_FULL_TILT: f64 = 1e-3;
/// Identifier of a side line among the features of a primitive; its ends have the next two.
const LINE: u32 = 128;

/// A corner of a face.
pub(super) struct FaceCorner {
    /// Position, m, world.
    pub position_w: Vec3,
    /// Identifier of the corner.
    pub feature: u32,
    /// Identifier of the edge to the next corner.
    pub edge: u32,
}

/// A flat, convex face, its corners counter-clockwise about `normal`.
pub(super) struct Face {
    /// Corners; empty for a half-space.
    pub corners: Vec<FaceCorner>,
    /// Outward unit normal, world.
    pub normal: Vec3,
    /// A point on it, world, m.
    pub origin: Vec3,
    /// Weight of the area, 0..=1.
    pub weight: f64,
}

/// A line along a primitive's side.
pub(super) struct Line {
    /// Ends, world, m.
    pub ends: [Vec3; 2],
    /// Identifiers of the ends.
    pub end_features: [u32; 2],
    /// Identifier of the line.
    pub feature: u32,
    /// Weight of the area, 0..=1.
    pub weight: f64,
}

/// The features of a primitive that face a direction.
pub(super) struct FacingFeatures {
    /// A flat face, if there is one.
    pub face: Option<Face>,
    /// A side line, if there is one.
    pub line: Option<Line>,
}

/// The features of `primitive` that face `direction` (unit, world).
pub(super) fn facing_features(
    Placed { shape, pose }: &Placed<Primitive>,
    direction: &Vec3,
) -> FacingFeatures {
    match *shape {
        Primitive::Plane => {
            let normal = pose.rotation * Vec3::z();
            let face = Face { corners: Vec::new(), normal, origin: pose.translation.vector, weight: 1.0 };
            FacingFeatures { face: Some(face), line: None }
        }
        Primitive::Box { half } => {
            FacingFeatures { face: Some(box_face(&half, pose, direction)), line: None }
        }
        Primitive::Cylinder { radius, half_height } => {
            cylinder_features(radius, half_height, pose, direction)
        }
        Primitive::Capsule { radius, half_height } => {
            let line = side_line(pose, &(direction * radius), half_height, 1.0);
            FacingFeatures { face: None, line: Some(line) }
        }
        Primitive::Sphere { .. } => FacingFeatures { face: None, line: None },
    }
}

fn box_face(half: &Vec3, pose: &Pose, direction: &Vec3) -> Face {
    let d = pose.rotation.inverse() * direction;
    let axis = d.iamax();
    let (sign, u, v) = (d[axis].signum(), (axis + 1) % 3, (axis + 2) % 3);
    let turn: [(f64, f64); 4] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let corner = |k: usize| {
        let (cu, cv) = turn[k % 4];
        let mut side = Vec3::zeros();
        (side[axis], side[u], side[v]) = (sign, cu, cv * sign);
        side
    };
    let id = |side: &Vec3| (0..3).map(|i| u32::from(side[i] > 0.0) << i).sum::<u32>();
    let corners = (0..4)
        .map(|k| {
            let (from, to) = (corner(k), corner(k + 1));
            let along = if from[u] == to[u] { v } else { u };
            FaceCorner {
                position_w: (pose * nalgebra::Point3::from(half.component_mul(&from))).coords,
                feature: id(&from),
                edge: 8 + id(&from.inf(&to)) * 3 + along as u32,
            }
        })
        .collect();
    let normal = pose.rotation * Vec3::ith(axis, sign);
    let origin = pose.translation.vector + normal * half[axis];
    Face { corners, normal, origin, weight: 1.0 }
}

/// The cap of a cylinder whose axis is nearly along the direction, and the line through the foremost
/// points of both rims.
fn cylinder_features(radius: f64, half_height: f64, pose: &Pose, direction: &Vec3) -> FacingFeatures {
    let d = pose.rotation.inverse() * direction;
    let sine = d.x.hypot(d.y);
    let cap_weight = ((CAP_MAX_TILT - sine) / (CAP_MAX_TILT - CAP_FULL_TILT)).clamp(0.0, 1.0);
    let face = (cap_weight > 0.0).then(|| cap(radius, half_height.copysign(d.z), pose, cap_weight));
    let line = (sine > 0.0).then(|| {
        let foremost = pose.rotation * Vec3::new(d.x, d.y, 0.0) * (radius / sine);
        side_line(pose, &foremost, half_height, (sine / LINE_FULL_TILT).min(1.0))
    });
    FacingFeatures { face, line }
}

fn cap(radius: f64, z: f64, pose: &Pose, weight: f64) -> Face {
    let base = if z > 0.0 { 32 } else { 0 };
    let corners = (0..RIM_POINTS)
        .map(|k| {
            // Counter-clockwise about the outward normal, which is −z below.
            let k = if z > 0.0 { k } else { RIM_POINTS - 1 - k };
            let (sin, cos) = (TAU * f64::from(k) / f64::from(RIM_POINTS)).sin_cos();
            let position_w = pose * nalgebra::Point3::new(radius * cos, radius * sin, z);
            FaceCorner { position_w: position_w.coords, feature: base + k, edge: 64 + base + k }
        })
        .collect();
    let normal = pose.rotation * Vec3::z() * z.signum();
    Face { corners, normal, origin: pose.translation.vector + pose.rotation * Vec3::z() * z, weight }
}

/// The line along a primitive's axis, translated by `offset`. It is not material: it moves over the surface
/// as the primitive rolls.
fn side_line(pose: &Pose, offset: &Vec3, half_height: f64, weight: f64) -> Line {
    let half = pose.rotation * Vec3::z() * half_height;
    let centre = pose.translation.vector + offset;
    let feature = NON_MATERIAL | LINE;
    Line { ends: [centre - half, centre + half], end_features: [feature + 1, feature + 2], feature, weight }
}
