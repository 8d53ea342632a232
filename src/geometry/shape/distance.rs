//! Signed distance, normal and ray casts of every kind of shape.

use super::{
    combine,
    displacement::Displacement,
    primitive,
    tree::{Shape, to_local},
    warp,
};
use crate::geometry::Vec3;

/// Farther than this from the surface a first-order distance is good enough and is not refined, m.
const BAND: f64 = 12e-3;
/// Projections on the surface in a refinement.
const ROUNDS: usize = 4;

/// A step never exceeds this share of the distance: composite distances may be a little too large.
const SAFETY: f64 = 0.8;
/// A point this near is on the surface, m.
const HIT: f64 = 1e-7;

impl Shape {
    /// First-order signed distance at `p_o`, m: right on the surface and in sign, cheaper than
    /// [`Shape::distance_and_normal`] and less exact away from the surface.
    pub fn distance(&self, p_o: &Vec3) -> f64 {
        self.first_order(p_o).0
    }

    /// Signed distance φ (m, negative inside) at `p_o` and the outward unit normal there.
    ///
    /// Exact for the primitives and their rigid placements; within 5 % of the true distance up to 5 mm from the surface
    /// for combinations and warps whose radii of curvature are larger than that.
    pub fn distance_and_normal(&self, p_o: &Vec3) -> (f64, Vec3) {
        match self {
            Self::Placed { shape, pose } => {
                let (distance, normal) = shape.distance_and_normal(&to_local(pose, p_o));
                (distance, pose.rotation * normal)
            }
            Self::Rounded { shape, radius } => {
                let (distance, normal) = shape.distance_and_normal(p_o);
                (distance - radius, normal)
            }
            Self::Shell { shape, thickness } => shell(shape.distance_and_normal(p_o), *thickness),
            Self::Paint { shape, .. } => shape.distance_and_normal(p_o),
            Self::Union(_) | Self::Intersect(_) | Self::Subtract { .. } => self.combined(p_o),
            Self::Scaled { shape, scale } if scale.max() - scale.min() <= 1e-12 * scale.max() => {
                let (distance, normal) = shape.distance_and_normal(&(p_o / scale.x));
                (distance * scale.x, normal)
            }
            Self::Ellipsoid { .. }
            | Self::Scaled { .. }
            | Self::SmoothUnion { .. }
            | Self::SmoothSubtract { .. }
            | Self::Twist { .. }
            | Self::Bend { .. }
            | Self::Displace { .. } => self.refine(p_o),
            _ => self.first_order(p_o),
        }
    }

    /// Distance along the unit vector `direction_o` from `origin_o` to the first surface point, if within `max` m.
    /// A ray that starts inside hits at 0.
    pub fn ray(&self, origin_o: &Vec3, direction_o: &Vec3, max: f64) -> Option<f64> {
        if let Self::Mesh(solid) = self {
            return solid.ray(origin_o, direction_o, max);
        }
        let mut travelled = 0.0;
        for _ in 0..512 {
            let distance = self.distance(&(origin_o + direction_o * travelled));
            if distance < HIT {
                return Some(travelled);
            }
            travelled += distance * SAFETY;
            if travelled > max {
                return None;
            }
        }
        None
    }

    /// [`Shape::distance_and_normal`] of what combines others.
    fn combined(&self, p: &Vec3) -> (f64, Vec3) {
        let (first, normal) = self.first_order(p);
        if first.abs() > BAND {
            return (first, normal);
        }
        match self {
            // Exactness asks every part dozens of times: nested, that would multiply with every level.
            Self::Union(parts) | Self::Intersect(parts) if parts.iter().any(Self::combines) => self.refine(p),
            Self::Subtract { from, cut } if from.combines() || cut.combines() => self.refine(p),
            Self::Union(parts) => combine::invert(combine::intersect_exactly(parts.len(), p, &|part, q| {
                combine::invert(parts[part].distance_and_normal(q))
            })),
            Self::Intersect(parts) => {
                combine::intersect_exactly(parts.len(), p, &|part, q| parts[part].distance_and_normal(q))
            }
            Self::Subtract { from, cut } => combine::intersect_exactly(2, p, &|part, q| match part {
                0 => from.distance_and_normal(q),
                _ => combine::invert(cut.distance_and_normal(q)),
            }),
            _ => (first, normal),
        }
    }

    /// Whether it combines others, wherever it is placed and however painted or rounded.
    fn combines(&self) -> bool {
        match self {
            Self::Union(_) | Self::Intersect(_) | Self::Subtract { .. } => true,
            Self::Placed { shape, .. }
            | Self::Paint { shape, .. }
            | Self::Rounded { shape, .. }
            | Self::Shell { shape, .. } => shape.combines(),
            _ => false,
        }
    }

    /// First-order distance `f/|∇f|` and unit gradient, by the chain rule through the tree.
    pub(in crate::geometry) fn first_order(&self, p: &Vec3) -> (f64, Vec3) {
        match self {
            Self::Box { half } => primitive::cuboid(p, half),
            Self::Sphere { radius } => primitive::sphere(p, *radius),
            Self::Ellipsoid { radii } => primitive::ellipsoid(p, radii),
            Self::Capsule { radius, half_length } => primitive::capsule(p, *radius, *half_length),
            Self::Cylinder { radius, half_height } => primitive::cylinder(p, *radius, *half_height),
            Self::Torus { major, minor } => primitive::torus(p, *major, *minor),
            Self::Prism { section, half_length } => primitive::prism(p, section, *half_length),
            Self::Lathe(profile) => primitive::lathe(p, profile),
            Self::Mesh(solid) => solid.distance_and_normal(p),
            Self::Placed { shape, pose } => {
                let (distance, normal) = shape.first_order(&to_local(pose, p));
                (distance, pose.rotation * normal)
            }
            Self::Scaled { shape, scale } => {
                let (value, normal) = shape.first_order(&p.component_div(scale));
                let gradient = normal.component_div(scale);
                let slope = gradient.norm();
                (value / slope, gradient / slope)
            }
            Self::Paint { shape, .. } => shape.first_order(p),
            _ => self.first_order_composite(p),
        }
    }

    /// [`Shape::first_order`] of the kinds that combine or warp others.
    fn first_order_composite(&self, p: &Vec3) -> (f64, Vec3) {
        match self {
            Self::Rounded { shape, radius } => {
                let (distance, normal) = shape.first_order(p);
                (distance - radius, normal)
            }
            Self::Shell { shape, thickness } => shell(shape.first_order(p), *thickness),
            Self::Union(parts) => unite_near(parts, p),
            Self::Intersect(parts) => fold(parts, |part| part.first_order(p), combine::intersect),
            Self::Subtract { from, cut } => {
                combine::intersect(from.first_order(p), combine::invert(cut.first_order(p)))
            }
            Self::SmoothUnion { parts, blend } => {
                fold(parts, |part| part.first_order(p), |a, b| combine::unite_smoothly(a, b, *blend))
            }
            Self::SmoothSubtract { from, cut, blend } => combine::invert(combine::unite_smoothly(
                combine::invert(from.first_order(p)),
                cut.first_order(p),
                *blend,
            )),
            Self::Twist { shape, axis, rate } => {
                let (straight, jacobian) = warp::untwist(p, *axis, *rate);
                let (value, normal) = shape.first_order(&straight);
                combine::to_first_order(value, jacobian.tr_mul(&normal))
            }
            Self::Bend { shape, along, towards, curvature } => {
                let (straight, jacobian) = warp::unbend(p, *along, *towards, *curvature);
                let (value, normal) = shape.first_order(&straight);
                combine::to_first_order(value, jacobian.tr_mul(&normal))
            }
            Self::Displace { shape, reliefs } => displace(shape.first_order(p), reliefs, p),
            _ => combine::NOWHERE,
        }
    }

    /// Finds the nearest point of the surface by projecting on it and sliding along it in turn; keeps the best.
    fn refine(&self, p: &Vec3) -> (f64, Vec3) {
        let (first, first_normal) = self.first_order(p);
        if first.abs() > BAND {
            return (first, first_normal);
        }
        let mut q = p - first_normal * first;
        let mut best = (first.abs(), first_normal);
        for round in 0..ROUNDS {
            let (off, normal) = self.first_order(&q);
            q -= normal * off;
            let arm = p - q;
            let length = arm.norm();
            if round == 0 || length < best.0 {
                best = (length, normal);
            }
            q += arm - normal * arm.dot(&normal);
        }
        (best.0.copysign(first), best.1)
    }
}

/// The first-order field of a union. A part that is farther than the others are near or deep has no say in it.
fn unite_near(parts: &[Shape], p: &Vec3) -> combine::Field {
    let mut best = combine::NOWHERE;
    for part in parts {
        if !part.is_farther(p, best.0.abs()) {
            let field = part.first_order(p);
            best = if best.0.is_infinite() { field } else { combine::unite(best, field) };
        }
    }
    best
}

/// Folds the fields of parts; nothing is infinitely far away.
fn fold(
    parts: &[Shape],
    field: impl Fn(&Shape) -> combine::Field,
    join: impl Fn(combine::Field, combine::Field) -> combine::Field,
) -> combine::Field {
    parts.iter().map(field).reduce(join).unwrap_or(combine::NOWHERE)
}

fn shell((distance, normal): (f64, Vec3), thickness: f64) -> (f64, Vec3) {
    let middle = distance + 0.5 * thickness;
    (middle.abs() - 0.5 * thickness, if middle < 0.0 { -normal } else { normal })
}

fn displace((distance, normal): (f64, Vec3), reliefs: &[Displacement], p: &Vec3) -> (f64, Vec3) {
    let (mut value, mut gradient) = (distance, normal);
    for relief in reliefs {
        let (height, slope) = relief.height(p);
        value -= height;
        gradient -= slope;
    }
    combine::to_first_order(value, gradient)
}
