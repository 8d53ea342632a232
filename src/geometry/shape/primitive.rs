//! Signed distances and normals of the primitives; exact except for the ellipsoid.

use super::{combine::SignedDistance, polygon::Polygon};
use crate::Vec3;

/// The unit vector of `v`; the x axis where it is undefined (the centre of a sphere, the axis of a cylinder).
fn unit_or_x(v: Vec3, length: f64) -> Vec3 {
    if length > 1e-12 { v / length } else { Vec3::x() }
}

pub(super) fn cuboid(p: &Vec3, half: &Vec3) -> SignedDistance {
    let q = p.abs() - half;
    let signed = |axis: usize, size: f64| if p[axis] < 0.0 { -size } else { size };
    let outside = q.sup(&Vec3::zeros());
    let length = outside.norm();
    if length > 1e-12 {
        let normal = Vec3::from_fn(|axis, _| signed(axis, outside[axis] / length));
        return SignedDistance::new(length, normal);
    }
    let axis = q.imax();
    SignedDistance::new(q[axis], Vec3::ith(axis, signed(axis, 1.0)))
}

pub(super) fn sphere(p: &Vec3, radius: f64) -> SignedDistance {
    let length = p.norm();
    SignedDistance::new(length - radius, unit_or_x(*p, length))
}

/// First-order distance `f / |∇f|` of `f = |p / radii| − 1`.
pub(super) fn ellipsoid(p: &Vec3, radii: &Vec3) -> SignedDistance {
    let unit = p.component_div(radii);
    let length = unit.norm();
    if length < 1e-9 {
        return SignedDistance::new(-radii.min(), Vec3::ith(radii.imin(), 1.0));
    }
    let gradient = unit.component_div(radii) / length;
    let slope = gradient.norm();
    SignedDistance::new((length - 1.0) / slope, gradient / slope)
}

/// Length of a vector in the plane. IEEE square roots are correctly rounded on every platform; `hypot` is not.
pub(super) fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

pub(super) fn capsule(p: &Vec3, radius: f64, half_length: f64) -> SignedDistance {
    sphere(&Vec3::new(p.x, p.y, p.z - p.z.clamp(-half_length, half_length)), radius)
}

/// The intersection of a cross-section and the slab between two ends, whose normals are perpendicular.
fn extruded(section: SignedDistance, slab: SignedDistance) -> SignedDistance {
    if section.distance > 0.0 && slab.distance > 0.0 {
        let edge = length(section.distance, slab.distance);
        let normal = (section.normal * section.distance + slab.normal * slab.distance) / edge;
        return SignedDistance::new(edge, normal);
    }
    if section.distance > slab.distance { section } else { slab }
}

pub(super) fn cylinder(p: &Vec3, radius: f64, half_height: f64) -> SignedDistance {
    let r = length(p.x, p.y);
    let (side, cap) = (r - radius, p.z.abs() - half_height);
    let radial = unit_or_x(Vec3::new(p.x, p.y, 0.0), r);
    let up = Vec3::z() * if p.z < 0.0 { -1.0 } else { 1.0 };
    extruded(SignedDistance::new(side, radial), SignedDistance::new(cap, up))
}

pub(super) fn torus(p: &Vec3, major: f64, minor: f64) -> SignedDistance {
    let r = length(p.x, p.y);
    let radial = unit_or_x(Vec3::new(p.x, p.y, 0.0), r);
    let arm = radial * (r - major) + Vec3::z() * p.z;
    let length = arm.norm();
    SignedDistance::new(length - minor, unit_or_x(arm, length))
}

pub(super) fn prism(p: &Vec3, section: &Polygon, half_length: f64) -> SignedDistance {
    let (flat, gradient) = section.distance([p.x, p.z]);
    let side = p.y.abs() - half_length;
    let across = Vec3::new(gradient[0], 0.0, gradient[1]);
    let along = Vec3::y() * if p.y < 0.0 { -1.0 } else { 1.0 };
    extruded(SignedDistance::new(flat, across), SignedDistance::new(side, along))
}

pub(super) fn lathe(p: &Vec3, profile: &Polygon) -> SignedDistance {
    let r = length(p.x, p.y);
    let (distance, gradient) = profile.distance([r, p.z]);
    let normal = unit_or_x(Vec3::new(p.x, p.y, 0.0), r) * gradient[0] + Vec3::z() * gradient[1];
    SignedDistance::new(distance, normal)
}
