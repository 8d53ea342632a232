//! The features of a primitive that face a direction: a flat face, a side line.

use std::f64::consts::TAU;

use super::{NON_MATERIAL, Primitive};
use crate::geometry::{Pose, Vec3};

/// Points that stand for a rim in flat contact: the true circle lies at most 0.9 % outside of their polygon, which
/// moves a tipping angle by less than 0.25°.
pub(super) const RIM: u32 = 24;
/// A cap carries as a face below this tilt (sine), and not at all at [`CAP_GONE`]: beyond, its rim's lowest point is
/// all that can touch.
const CAP_WHOLE: f64 = 0.05;
/// See [`CAP_WHOLE`].
const CAP_GONE: f64 = 0.1;
/// A side line counts in full from this tilt (sine) off the cap's flat position, where its place is undefined.
const LINE_WHOLE: f64 = 1e-3;
/// Name of a side line among a primitive's features; its ends are the next two.
const LINE: u32 = 128;

/// A flat, convex face, its corners counter-clockwise about `normal`.
pub(super) struct Face {
    /// Corners, world, m, each with its name and that of the edge to the next; none for a half-space.
    pub corners: Vec<(Vec3, u32, u32)>,
    /// Outward unit normal, world.
    pub normal: Vec3,
    /// A point on it, world, m.
    pub origin: Vec3,
    /// Share of the area that counts, 0..=1.
    pub weight: f64,
}

/// A line along a primitive's side.
pub(super) struct Line {
    /// Ends, world, m.
    pub ends: [Vec3; 2],
    /// Names of the ends.
    pub names: [u32; 2],
    /// Name of the line.
    pub name: u32,
    /// Share of the area that counts, 0..=1.
    pub weight: f64,
}

/// What of a primitive faces a direction.
pub(super) struct Features {
    /// A flat face, if one does.
    pub face: Option<Face>,
    /// A side line, if one does.
    pub line: Option<Line>,
}

/// The features of `primitive` that face `direction` (unit, world).
pub(super) fn facing(primitive: &Primitive, pose: &Pose, direction: &Vec3) -> Features {
    match *primitive {
        Primitive::Plane => {
            let normal = pose.rotation * Vec3::z();
            let face = Face { corners: Vec::new(), normal, origin: pose.translation.vector, weight: 1.0 };
            Features { face: Some(face), line: None }
        }
        Primitive::Box { half } => Features { face: Some(box_face(&half, pose, direction)), line: None },
        Primitive::Cylinder { radius, half_height } => round(radius, half_height, pose, direction),
        Primitive::Capsule { radius, half_height } => {
            let line = side_line(pose, &(direction * radius), half_height, 1.0);
            Features { face: None, line: Some(line) }
        }
        Primitive::Sphere { .. } => Features { face: None, line: None },
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
    let name = |side: &Vec3| (0..3).map(|i| u32::from(side[i] > 0.0) << i).sum::<u32>();
    let corners = (0..4)
        .map(|k| {
            let (from, to) = (corner(k), corner(k + 1));
            let along = if from[u] == to[u] { v } else { u };
            let edge = 8 + name(&from.inf(&to)) * 3 + along as u32;
            ((pose * nalgebra::Point3::from(half.component_mul(&from))).coords, name(&from), edge)
        })
        .collect();
    let normal = pose.rotation * Vec3::ith(axis, sign);
    let origin = pose.translation.vector + normal * half[axis];
    Face { corners, normal, origin, weight: 1.0 }
}

/// A cylinder shows its cap when it stands nearly straight, and the line through the foremost points of both rims.
fn round(radius: f64, half_height: f64, pose: &Pose, direction: &Vec3) -> Features {
    let d = pose.rotation.inverse() * direction;
    let sine = d.x.hypot(d.y);
    let cap_weight = ((CAP_GONE - sine) / (CAP_GONE - CAP_WHOLE)).clamp(0.0, 1.0);
    let face = (cap_weight > 0.0).then(|| cap(radius, half_height.copysign(d.z), pose, cap_weight));
    let line = (sine > 0.0).then(|| {
        let foremost = pose.rotation * Vec3::new(d.x, d.y, 0.0) * (radius / sine);
        side_line(pose, &foremost, half_height, (sine / LINE_WHOLE).min(1.0))
    });
    Features { face, line }
}

fn cap(radius: f64, z: f64, pose: &Pose, weight: f64) -> Face {
    let base = if z > 0.0 { 32 } else { 0 };
    let corners = (0..RIM)
        .map(|k| {
            // Counter-clockwise about the outward normal, which is −z below.
            let k = if z > 0.0 { k } else { RIM - 1 - k };
            let (sin, cos) = (TAU * f64::from(k) / f64::from(RIM)).sin_cos();
            let p_w = pose * nalgebra::Point3::new(radius * cos, radius * sin, z);
            (p_w.coords, base + k, 64 + base + k)
        })
        .collect();
    let normal = pose.rotation * Vec3::z() * z.signum();
    Face { corners, normal, origin: pose.translation.vector + pose.rotation * Vec3::z() * z, weight }
}

/// The line along a primitive's axis, moved by `offset`. It wanders over the material as the primitive rolls.
fn side_line(pose: &Pose, offset: &Vec3, half_height: f64, weight: f64) -> Line {
    let half = pose.rotation * Vec3::z() * half_height;
    let centre = pose.translation.vector + offset;
    let name = NON_MATERIAL | LINE;
    Line { ends: [centre - half, centre + half], names: [name + 1, name + 2], name, weight }
}
