//! Bounding boxes of shapes.

use super::{
    combine::SignedDistance,
    displacement::SurfaceRelief,
    tree::{Shape, to_local, without_parts},
    warp::Axis,
};
use crate::{Aabb, Vec3};

/// Cells along the longest edge in the search for the extreme points of a composite shape.
const CELLS: f64 = 40.0;
/// Step of the first pass of that search, cells.
const COARSE: usize = 3;

impl Shape {
    /// The tight bounding box.
    ///
    /// Exact for primitives, and for placements, scalings, roundings and unions of them. For other shapes the extreme
    /// points are searched on the surface, to about 1 µm. This takes milliseconds, so callers should cache the result.
    pub fn bounds(&self) -> Aabb {
        self.closed_bounds().unwrap_or_else(|| self.search_bounds())
    }

    /// The tight bounding box, where it has a closed form, which takes microseconds.
    pub fn closed_bounds(&self) -> Option<Aabb> {
        let exact = |axis: usize, sign: f64| self.support(&Vec3::ith(axis, sign)).map(|s| s * sign);
        let corner = |sign: f64| Some(Vec3::new(exact(0, sign)?, exact(1, sign)?, exact(2, sign)?));
        Some(Aabb { min: corner(-1.0)?, max: corner(1.0)? })
    }

    /// True if a cheap test proves that the shape is more than `reach` (m) away from `p`; false leaves it open.
    pub fn is_farther(&self, p: &Vec3, reach: f64) -> bool {
        let reach = reach.max(0.0);
        let beyond = |across2: f64, radius: f64| across2 > (radius + reach).powi(2);
        match self {
            Self::Box { half } => (p.abs() - half).max() > reach,
            Self::Sphere { radius } => beyond(p.norm_squared(), *radius),
            Self::Cylinder { radius, half_height } => {
                p.z.abs() - half_height > reach || beyond(p.xy().norm_squared(), *radius)
            }
            Self::Placed { shape, pose } => shape.is_farther(&to_local(pose, p), reach),
            Self::Paint { shape, .. } => shape.is_farther(p, reach),
            Self::Union(parts) => parts.iter().all(|part| part.is_farther(p, reach)),
            _ => false,
        }
    }

    /// Largest value of `p · direction` over the shape, where a closed form is known.
    fn support(&self, direction: &Vec3) -> Option<f64> {
        let across = direction.x.hypot(direction.y);
        match self {
            Self::Box { half } => Some(half.dot(&direction.abs())),
            Self::Sphere { radius } => Some(radius * direction.norm()),
            Self::Ellipsoid { radii } => Some(radii.component_mul(direction).norm()),
            Self::Capsule { radius, half_length } => {
                Some(half_length * direction.z.abs() + radius * direction.norm())
            }
            Self::Cylinder { radius, half_height } => Some(radius * across + half_height * direction.z.abs()),
            Self::Torus { major, minor } => Some(major * across + minor * direction.norm()),
            Self::Prism { section, half_length } => section
                .points()
                .iter()
                .map(|p| p[0] * direction.x + p[1] * direction.z)
                .max_by(f64::total_cmp)
                .map(|flat| flat + half_length * direction.y.abs()),
            Self::Lathe(profile) => {
                profile.points().iter().map(|p| p[0] * across + p[1] * direction.z).max_by(f64::total_cmp)
            }
            Self::Mesh(solid) => {
                solid.mesh().vertices.iter().map(|v| v.dot(direction)).max_by(f64::total_cmp)
            }
            Self::Placed { shape, pose } => shape
                .support(&pose.rotation.inverse_transform_vector(direction))
                .map(|s| s + pose.translation.vector.dot(direction)),
            Self::Scaled { shape, scale } => shape.support(&scale.component_mul(direction)),
            Self::Rounded { shape, radius } => {
                shape.support(direction).map(|s| s + radius * direction.norm())
            }
            Self::Union(parts) => parts
                .iter()
                .map(|part| part.support(direction))
                .try_fold(f64::NEG_INFINITY, |most, s| Some(most.max(s?))),
            Self::Shell { shape, .. } | Self::Paint { shape, .. } => shape.support(direction),
            _ => None,
        }
    }

    /// A box that contains the shape and its [bounds](Self::bounds); not tight, but fast.
    pub fn loose_bounds(&self) -> Aabb {
        match self {
            Self::Placed { shape, pose } => shape.loose_bounds().transformed(pose),
            Self::Scaled { shape, scale } => {
                let inner = shape.loose_bounds();
                Aabb { min: inner.min.component_mul(scale), max: inner.max.component_mul(scale) }
            }
            Self::Rounded { shape, radius } => shape.loose_bounds().loosened(*radius),
            Self::Shell { shape, .. } | Self::Paint { shape, .. } => shape.loose_bounds(),
            Self::Union(parts) => joined(parts),
            Self::Intersect(parts) => parts
                .iter()
                .map(Self::loose_bounds)
                .reduce(|a, b| Aabb {
                    min: a.min.sup(&b.min),
                    max: a.max.inf(&b.max).sup(&a.min.sup(&b.min)),
                })
                .unwrap_or(Aabb::from_half_extents(Vec3::zeros())),
            Self::Subtract { from, .. } | Self::SmoothSubtract { from, .. } => from.loose_bounds(),
            // Each blend raises the seam by at most a quarter of its width, in first-order distance.
            Self::SmoothUnion { parts, blend } => joined(parts).loosened(0.5 * blend * parts.len() as f64),
            Self::Twist { shape, axis, .. } => twisted(&shape.loose_bounds(), *axis),
            Self::Bend { shape, along, towards, curvature } => {
                bent(&shape.loose_bounds(), *along, *towards, *curvature)
            }
            Self::Displace { shape, reliefs } => shape
                .loose_bounds()
                .loosened(1.5 * reliefs.iter().map(SurfaceRelief::max_height).sum::<f64>()),
            without_parts!() => self.bounds(),
        }
    }

    /// Projects grid points near the surface on it, and moves the extreme ones along the surface to the extrema.
    fn search_bounds(&self) -> Aabb {
        let reach = self.loose_bounds();
        let cell = reach.size().max() / CELLS;
        let count = reach.size().map(|edge| (edge / cell).ceil() as usize + 1);
        let grid = |index: usize| {
            let step = [index % count.x, index / count.x % count.y, index / count.x / count.y];
            (step, reach.min + Vec3::from(step.map(|k| k as f64)) * cell)
        };
        let near = |p: &Vec3| {
            let is_near = self.distance(p).abs() <= 1.5 * cell;
            is_near.then(|| self.project(p, 2.0 * cell)).flatten()
        };
        let total = count.x * count.y * count.z;
        // A part of the points bounds the extremes from below, so that most others need no projection.
        let mut least = [f64::NEG_INFINITY; 6];
        for (step, p) in (0..total).map(grid) {
            if step.iter().all(|k| k % COARSE == 0)
                && let Some(q) = near(&p)
            {
                (0..6).for_each(|side| least[side] = least[side].max(outward(side).dot(&q)));
            }
        }
        let mut extremes: [Option<Vec3>; 6] = [None; 6];
        for (_, p) in (0..total).map(grid) {
            // The projection of a point is at most two cells away.
            if (0..6).all(|side| outward(side).dot(&p) + 2.0 * cell < least[side]) {
                continue;
            }
            let Some(q) = near(&p) else { continue };
            for (side, extreme) in extremes.iter_mut().enumerate() {
                let height = |v: &Vec3| outward(side).dot(v);
                if extreme.is_none_or(|e| height(&q) > height(&e)) {
                    *extreme = Some(q);
                    least[side] = least[side].max(height(&q));
                }
            }
        }
        let mut found = Aabb { min: reach.centre(), max: reach.centre() };
        for (side, extreme) in extremes.into_iter().enumerate() {
            if let Some(start) = extreme {
                let top = self.ascend(start, &outward(side), cell);
                let corner = if side % 2 == 0 { &mut found.min } else { &mut found.max };
                corner[side / 2] = top[side / 2];
            }
        }
        found
    }

    /// Projects `p` iteratively on the surface; `None` if the result is farther than `reach` (m) from `p`.
    pub(crate) fn project(&self, p: &Vec3, reach: f64) -> Option<Vec3> {
        let mut q = *p;
        for _ in 0..8 {
            let SignedDistance { distance, normal } = self.first_order(&q);
            q -= normal * distance;
            if distance.abs() < 1e-9 {
                break;
            }
        }
        ((q - p).norm() <= reach && self.distance(&q).abs() < 1e-6).then_some(q)
    }

    /// Moves along the surface from `start` to a local maximum in `direction`.
    fn ascend(&self, start: Vec3, direction: &Vec3, cell: f64) -> Vec3 {
        let (mut at, mut step) = (start, cell);
        while step > 1e-7 {
            let normal = self.first_order(&at).normal;
            let slope = direction - normal * normal.dot(direction);
            let next = (slope.norm() > 1e-9)
                .then(|| self.project(&(at + slope.normalize() * step), 2.0 * step))
                .flatten()
                .filter(|q| (q - at).dot(direction) > 0.0);
            match next {
                Some(q) => at = q,
                None => step *= 0.5,
            }
        }
        at
    }
}

fn outward(side: usize) -> Vec3 {
    Vec3::ith(side / 2, if side.is_multiple_of(2) { -1.0 } else { 1.0 })
}

fn joined(parts: &[Shape]) -> Aabb {
    parts
        .iter()
        .map(Shape::loose_bounds)
        .reduce(|a, b| a.merged(&b))
        .unwrap_or(Aabb::from_half_extents(Vec3::zeros()))
}

/// Bounds of a twisted box: a twist preserves distances from the axis.
fn twisted(inner: &Aabb, axis: Axis) -> Aabb {
    let far = inner.min.abs().sup(&inner.max.abs());
    let k = axis.index();
    let radius = far[(k + 1) % 3].hypot(far[(k + 2) % 3]);
    let mut outer = Aabb::from_half_extents(Vec3::repeat(radius));
    (outer.min[k], outer.max[k]) = (inner.min[k], inner.max[k]);
    outer
}

/// Bounds of a bent box: of the images of sample points on its inner and outer face, with a margin for
/// the bulge between them.
fn bent(inner: &Aabb, along: Axis, towards: Axis, curvature: f64) -> Aabb {
    if curvature.abs() < 1e-9 {
        return *inner;
    }
    let (i, k) = (along.index(), towards.index());
    let radius = 1.0 / curvature;
    let steps = 64;
    let mut outer: Option<Aabb> = None;
    for step in 0..=steps {
        let angle =
            (inner.min[i] + (inner.max[i] - inner.min[i]) * f64::from(step) / f64::from(steps)) / radius;
        for level in [inner.min[k], inner.max[k]] {
            let (mut low, mut high) = (inner.min, inner.max);
            low[i] = (radius - level) * angle.sin();
            low[k] = radius - (radius - level) * angle.cos();
            (high[i], high[k]) = (low[i], low[k]);
            let point = Aabb { min: low, max: high };
            outer = Some(outer.map_or(point, |sofar| sofar.merged(&point)));
        }
    }
    outer.map_or(*inner, |found| found.loosened(0.01 * found.size().max()))
}
