//! Signed distance, normal and ray casts of every kind of shape.

use super::{
    combine::{SignedDistance, intersect_exactly},
    displacement::SurfaceRelief,
    primitive,
    tree::{Shape, to_local},
    warp,
};
use crate::Vec3;

/// Distance from the surface beyond which a first-order distance is accurate enough and is not refined, m.
const BAND: f64 = 12e-3;
/// Projections on the surface per refinement.
const ROUNDS: usize = 4;

/// Share of the distance that a step of a ray advances. Composite distances may be slightly too large.
const RAY_STEP: f64 = 0.8;
/// Distance below which a ray has hit the surface, m.
const RAY_HIT: f64 = 1e-7;
/// Largest number of steps of a ray.
const MAX_RAY_STEPS: usize = 512;

impl Shape {
    /// First-order signed distance at `p_o`, m; negative inside.
    ///
    /// Its sign is right and it vanishes exactly on the surface. Away from the surface it is cheaper and
    /// less accurate than [`Shape::distance_and_normal`].
    pub fn distance(&self, p_o: &Vec3) -> f64 {
        self.first_order(p_o).distance
    }

    /// Signed distance (m, negative inside) at `p_o`, and the outward unit normal of the nearest surface point.
    ///
    /// Exact for the primitives and their rigid placements. For combinations and warps it is within 5 % of the true
    /// distance up to 5 mm from the surface, where the radii of curvature are larger than that.
    ///
    /// ```
    /// use softvt_geometry::{Vec3, shape::Shape};
    ///
    /// let ball = Shape::Sphere { radius: 0.03 }.translated(Vec3::new(0.1, 0.0, 0.0));
    /// let (distance, normal) = ball.distance_and_normal(&Vec3::new(0.1, 0.0, 0.05));
    /// assert!((distance - 0.02).abs() < 1e-15 && (normal - Vec3::z()).norm() < 1e-15);
    ///
    /// // A cube with the ball cut out of one face.
    /// let cube = Shape::cuboid(Vec3::repeat(0.1)).translated(Vec3::new(0.05, 0.0, 0.0));
    /// assert!(cube.subtract(ball).distance(&Vec3::new(0.09, 0.0, 0.0)) > 0.0);
    /// ```
    pub fn distance_and_normal(&self, p_o: &Vec3) -> (f64, Vec3) {
        let SignedDistance { distance, normal } = self.refined(p_o);
        (distance, normal)
    }

    /// A point near the surface, moved onto it by one Newton step along the gradient.
    pub fn nearest_to_first_order(&self, p_o: &Vec3) -> Vec3 {
        let SignedDistance { distance, normal } = self.first_order(p_o);
        p_o - normal * distance
    }

    /// Distance (m) along the unit vector `direction_o` from `origin_o` to the first surface point, if it is at most
    /// `max` m. A ray that starts inside hits at 0.
    ///
    /// Sphere tracing (Hart, Sphere tracing, 1996); exact for meshes.
    pub fn ray(&self, origin_o: &Vec3, direction_o: &Vec3, max: f64) -> Option<f64> {
        if let Self::Mesh(solid) = self {
            return solid.ray(origin_o, direction_o, max);
        }
        let mut travelled = 0.0;
        for _ in 0..MAX_RAY_STEPS {
            let distance = self.distance(&(origin_o + direction_o * travelled));
            if distance < RAY_HIT {
                return Some(travelled);
            }
            travelled += distance * RAY_STEP;
            if travelled > max {
                return None;
            }
        }
        None
    }

    /// [`Shape::distance_and_normal`] as one value.
    pub(super) fn refined(&self, p: &Vec3) -> SignedDistance {
        match self {
            Self::Placed { shape, pose } => {
                let SignedDistance { distance, normal } = shape.refined(&to_local(pose, p));
                SignedDistance::new(distance, pose.rotation * normal)
            }
            Self::Rounded { shape, radius } => rounded(shape.refined(p), *radius),
            Self::Shell { shape, thickness } => shell(shape.refined(p), *thickness),
            Self::Paint { shape, .. } => shape.refined(p),
            Self::Union(_) | Self::Intersect(_) | Self::Subtract { .. } => self.refine_combination(p),
            Self::Scaled { shape, scale } if scale.max() - scale.min() <= 1e-12 * scale.max() => {
                let SignedDistance { distance, normal } = shape.refined(&(p / scale.x));
                SignedDistance::new(distance * scale.x, normal)
            }
            Self::Ellipsoid { .. }
            | Self::Scaled { .. }
            | Self::SmoothUnion { .. }
            | Self::SmoothSubtract { .. }
            | Self::Twist { .. }
            | Self::Bend { .. }
            | Self::Displace { .. } => self.refine_by_projection(p),
            _ => self.first_order(p),
        }
    }

    /// The refined distance of unions, intersections and differences.
    fn refine_combination(&self, p: &Vec3) -> SignedDistance {
        let first = self.first_order(p);
        if first.distance.abs() > BAND {
            return first;
        }
        match self {
            // The exact search evaluates every part dozens of times, and nesting would multiply that at every level.
            Self::Union(parts) | Self::Intersect(parts) if parts.iter().any(Self::is_combination) => {
                self.refine_by_projection(p)
            }
            Self::Subtract { from, cut } if from.is_combination() || cut.is_combination() => {
                self.refine_by_projection(p)
            }
            Self::Union(parts) => {
                intersect_exactly(parts.len(), p, &|part, q| parts[part].refined(q).inverted()).inverted()
            }
            Self::Intersect(parts) => intersect_exactly(parts.len(), p, &|part, q| parts[part].refined(q)),
            Self::Subtract { from, cut } => intersect_exactly(2, p, &|part, q| match part {
                0 => from.refined(q),
                _ => cut.refined(q).inverted(),
            }),
            _ => first,
        }
    }

    /// True for unions, intersections and differences, also if placed, painted, rounded or hollowed.
    fn is_combination(&self) -> bool {
        match self {
            Self::Union(_) | Self::Intersect(_) | Self::Subtract { .. } => true,
            Self::Placed { shape, .. }
            | Self::Paint { shape, .. }
            | Self::Rounded { shape, .. }
            | Self::Shell { shape, .. } => shape.is_combination(),
            _ => false,
        }
    }

    /// First-order distance `f/|∇f|` and unit gradient, by the chain rule through the tree.
    pub(crate) fn first_order(&self, p: &Vec3) -> SignedDistance {
        match self {
            Self::Box { half } => primitive::cuboid(p, half),
            Self::Sphere { radius } => primitive::sphere(p, *radius),
            Self::Ellipsoid { radii } => primitive::ellipsoid(p, radii),
            Self::Capsule { radius, half_length } => primitive::capsule(p, *radius, *half_length),
            Self::Cylinder { radius, half_height } => primitive::cylinder(p, *radius, *half_height),
            Self::Torus { major, minor } => primitive::torus(p, *major, *minor),
            Self::Prism { section, half_length } => primitive::prism(p, section, *half_length),
            Self::Lathe(profile) => primitive::lathe(p, profile),
            Self::Mesh(solid) => solid.signed_distance(p),
            Self::Placed { shape, pose } => {
                let SignedDistance { distance, normal } = shape.first_order(&to_local(pose, p));
                SignedDistance::new(distance, pose.rotation * normal)
            }
            Self::Scaled { shape, scale } => {
                let SignedDistance { distance, normal } = shape.first_order(&p.component_div(scale));
                let gradient = normal.component_div(scale);
                let slope = gradient.norm();
                SignedDistance::new(distance / slope, gradient / slope)
            }
            Self::Paint { shape, .. } => shape.first_order(p),
            Self::Rounded { shape, radius } => rounded(shape.first_order(p), *radius),
            Self::Shell { shape, thickness } => shell(shape.first_order(p), *thickness),
            Self::Union(parts) => unite_near(parts, p),
            Self::Intersect(parts) => fold(parts, p, SignedDistance::intersect),
            Self::Subtract { from, cut } => from.first_order(p).intersect(cut.first_order(p).inverted()),
            Self::SmoothUnion { parts, blend } => fold(parts, p, |a, b| a.unite_smoothly(b, *blend)),
            Self::SmoothSubtract { from, cut, blend } => {
                from.first_order(p).inverted().unite_smoothly(cut.first_order(p), *blend).inverted()
            }
            Self::Twist { shape, axis, rate } => {
                let (straight, jacobian) = warp::untwist(p, *axis, *rate);
                let SignedDistance { distance, normal } = shape.first_order(&straight);
                SignedDistance::from_gradient(distance, jacobian.tr_mul(&normal))
            }
            Self::Bend { shape, along, towards, curvature } => {
                let (straight, jacobian) = warp::unbend(p, *along, *towards, *curvature);
                let SignedDistance { distance, normal } = shape.first_order(&straight);
                SignedDistance::from_gradient(distance, jacobian.tr_mul(&normal))
            }
            Self::Displace { shape, reliefs } => displaced(shape.first_order(p), reliefs, p),
        }
    }

    /// Finds the nearest surface point by projecting on the surface and sliding along it in turn; keeps the best.
    fn refine_by_projection(&self, p: &Vec3) -> SignedDistance {
        let first = self.first_order(p);
        if first.distance.abs() > BAND {
            return first;
        }
        let mut q = p - first.normal * first.distance;
        let mut best = SignedDistance::new(first.distance.abs(), first.normal);
        for round in 0..ROUNDS {
            let SignedDistance { distance, normal } = self.first_order(&q);
            q -= normal * distance;
            let arm = p - q;
            let length = arm.norm();
            if round == 0 || length < best.distance {
                best = SignedDistance::new(length, normal);
            }
            q += arm - normal * arm.dot(&normal);
        }
        SignedDistance::new(best.distance.copysign(first.distance), best.normal)
    }
}

/// The first-order distance of a union. Parts farther away than the current distance cannot change it and are skipped.
fn unite_near(parts: &[Shape], p: &Vec3) -> SignedDistance {
    let mut best = SignedDistance::EMPTY;
    for part in parts {
        if !part.is_farther(p, best.distance.abs()) {
            let own = part.first_order(p);
            best = if best.distance.is_infinite() { own } else { best.unite(own) };
        }
    }
    best
}

/// Folds the first-order distances of parts; no parts are infinitely far away.
fn fold(
    parts: &[Shape],
    p: &Vec3,
    join: impl Fn(SignedDistance, SignedDistance) -> SignedDistance,
) -> SignedDistance {
    parts.iter().map(|part| part.first_order(p)).reduce(join).unwrap_or(SignedDistance::EMPTY)
}

fn rounded(inner: SignedDistance, radius: f64) -> SignedDistance {
    SignedDistance::new(inner.distance - radius, inner.normal)
}

fn shell(outer: SignedDistance, thickness: f64) -> SignedDistance {
    let middle = outer.distance + 0.5 * thickness;
    SignedDistance::new(
        middle.abs() - 0.5 * thickness,
        if middle < 0.0 { -outer.normal } else { outer.normal },
    )
}

fn displaced(smooth: SignedDistance, reliefs: &[SurfaceRelief], p: &Vec3) -> SignedDistance {
    let (mut value, mut gradient) = (smooth.distance, smooth.normal);
    for relief in reliefs {
        let (height, slope) = relief.height(p);
        value -= height;
        gradient -= slope;
    }
    SignedDistance::from_gradient(value, gradient)
}
