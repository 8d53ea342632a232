//! Ambient occlusion: the fraction of the sky visible from a surface point.
//!
//! An object's own occlusion is evaluated once per vertex from its distance field. Occlusion by other objects, which
//! may move, is approximated per point by one ellipsoid per object.

use crate::camera::math::{V3, Vec3x8, f32x8};
use softvt_geometry::{Vec3, shape::Shape};

/// Radius of influence of an occluder, in radii of the occluder.
const INFLUENCE_RADII: f32 = 2.6;

/// Fraction of the sky left visible by the object itself at `p` on its surface with normal `n`, object frame.
///
/// Samples the distance field along the normal up to `reach`, m (Evans, Fast Approximations for Global Illumination on
/// Dynamic Scenes, SIGGRAPH course 2006).
pub(crate) fn self_visibility(shape: &Shape, p: &V3, n: &V3, reach: f64) -> f32 {
    let (p, n): (Vec3, Vec3) = (p.cast(), n.cast());
    let occlusion: f64 = (1..=4)
        .map(|i| {
            let h = reach * f64::from(i) / 4.0;
            (1.0 - shape.distance(&(p + n * h)) / h).clamp(0.0, 1.0) * 0.5_f64.powi(i)
        })
        .sum();
    (1.0 - 1.1 * occlusion).clamp(0.15, 1.0) as f32
}

/// An axis-aligned ellipsoid that stands for an object when it hides part of the sky from others.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OcclusionEllipsoid {
    /// Index of the object in the scene; it does not occlude itself here.
    object: usize,
    centre: V3,
    radii: V3,
    /// Square of the distance beyond which occlusion is neglected, m².
    influence2: f32,
}

impl OcclusionEllipsoid {
    /// The ellipsoid inscribed in the bounding box `[low, high]` of an object, world.
    pub(crate) fn from_bounds(object: usize, [low, high]: &[V3; 2]) -> Self {
        let radii = ((high - low) * 0.5).add_scalar(1e-4);
        let influence = INFLUENCE_RADII * radii.max();
        Self { object, centre: (low + high) * 0.5, radii, influence2: influence * influence }
    }

    /// True if the ellipsoid occludes any point of the box `[low, high]`.
    pub(crate) fn affects(&self, [low, high]: &[V3; 2]) -> bool {
        let nearest = self.centre.sup(low).inf(high);
        (nearest - self.centre).norm_squared() < self.influence2
    }
}

/// Fraction of the sky left visible by `occluders` at points `p` of normals `n`; `object` is the object of each point.
///
/// Quilez, Sphere Ambient Occlusion, 2006, in the space in which each ellipsoid is a ball.
#[inline(always)]
pub(crate) fn sky_visibility(occluders: &[OcclusionEllipsoid], p: Vec3x8, n: Vec3x8, object: f32x8) -> f32x8 {
    let mut visibility = f32x8::ONE;
    for occluder in occluders {
        let d = Vec3x8::splat(&occluder.centre) - p;
        let d2 = d.dot(d);
        let is_near = d2.simd_lt(f32x8::splat(occluder.influence2))
            & object.simd_ne(f32x8::splat(occluder.object as f32));
        if !is_near.any() {
            continue;
        }
        let q = d.component_mul(Vec3x8::splat(&occluder.radii.map(|r| 1.0 / r)));
        // Normals transform by the inverse transpose, here the radii.
        let normal = n.component_mul(Vec3x8::splat(&occluder.radii));
        let (q2, n2) = (q.dot(q), normal.dot(normal));
        let cosine = (normal.dot(q) / (q2 * n2).fast_max(f32x8::splat(1e-18)).sqrt()).fast_max(f32x8::ZERO);
        let fade = f32x8::ONE - d2 * f32x8::splat(1.0 / occluder.influence2);
        let occlusion = f32x8::splat(0.75) * cosine * fade / q2.fast_max(f32x8::ONE);
        visibility *= f32x8::ONE - (is_near & occlusion);
    }
    visibility
}
