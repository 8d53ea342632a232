//! Contact manifolds: contact points of two rigid bodies as pure functions of their poses.
//!
//! Two convex [`Primitive`]s meet in [`manifold`]. A contact normal is found by separating axes, and the
//! features of both that face each other (a face, a side line) are projected along it; the corners of their
//! overlap become the points. The gap of each point is exact at its position, so that corners and rims support
//! a tipping body where its real edge is, and round bodies touch at a moving lowest point and roll. General
//! shapes meet through `field::SurfaceInSdf`.
//!
//! # Why not parry's manifolds
//! The contact forces here are pressures times areas, so every point needs the area that it represents, and a small
//! change of pose must change the sum of forces little: points have to fade in and out. Parry's contact manifolds
//! give neither areas nor continuous weights.

use softvt_geometry::{
    Vec3,
    convex::{Placed, Primitive},
};

mod clip;
mod feature;
mod feature_extraction;
mod feature_overlap;
pub(super) mod field;
mod field_probe;
mod flat_region;
mod lowest_points;
mod separating_axis;
mod sphere_capsule;

#[cfg(test)]
mod test_rig;
#[cfg(test)]
mod tests;

pub use feature_extraction::SurfaceFeatures;
pub(super) use feature_extraction::primitives;

/// One point where two bodies touch or nearly touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ManifoldPoint {
    /// Position, half-way between the two surfaces, m, world.
    pub(crate) position_w: Vec3,
    /// Unit normal from the first body to the second, world.
    pub(crate) normal_w: Vec3,
    /// Gap along the normal, m; negative is overlap.
    pub(crate) gap: f64,
    /// Area that the point represents, m². The points of a flat patch share its area; a point or line contact has
    /// [`POINT_AREA`] per point. Areas fade in and out, so that a small change of pose changes forces little.
    pub(crate) area: f64,
    /// Identifies the two features that meet; constant from step to step while they stay
    /// the same. See [`NON_MATERIAL`].
    pub(crate) feature: u32,
}

/// Flag in `feature` for a point that is not a material point of either body, such as the lowest point of
/// a sphere or rim.
///
/// Its tangential spring must be stretched by the *velocity* of the touching material, since the motion of the point
/// itself is not slip: a rolling ball does not slip.
pub(crate) const NON_MATERIAL: u32 = 1 << 31;

/// Area of a point contact and of either end of a line contact, m². With the contact modulus of stiff solids (1e9
/// Pa/m) this is 1e6 N/m, hence 10 µm under 10 N. A tenth of it makes a can of 0.3 kg tip 0.4° too early, because the
/// rim that carries it sinks in.
pub(crate) const POINT_AREA: f64 = 1e-3;

/// Position in the order of types; the manifold of each pair of types is implemented for one order only.
fn rank(primitive: &Primitive) -> u8 {
    match primitive {
        Primitive::Plane => 0,
        Primitive::Box { .. } => 1,
        Primitive::Cylinder { .. } => 2,
        Primitive::Capsule { .. } => 3,
        Primitive::Sphere { .. } => 4,
    }
}

/// Appends to `out` the contact points of `a` and `b` whose gap is below `margin` (m).
///
/// Swapping the two flips the normals and changes nothing else, except the feature identifiers of two
/// primitives of one type.
pub(crate) fn manifold(
    a: &Placed<Primitive>,
    b: &Placed<Primitive>,
    margin: f64,
    out: &mut Vec<ManifoldPoint>,
) {
    if rank(&a.shape) > rank(&b.shape) {
        let start = out.len();
        manifold(b, a, margin, out);
        return out[start..].iter_mut().for_each(|point| point.normal_w = -point.normal_w);
    }
    match (a.shape, b.shape) {
        (Primitive::Plane, Primitive::Plane) => {}
        (Primitive::Plane, Primitive::Box { half }) => {
            feature_overlap::plane_box(&a.pose, &half, &b.pose, margin, out);
        }
        (_, Primitive::Sphere { radius }) => sphere_capsule::sphere(a, radius, &b.pose, margin, out),
        (Primitive::Capsule { .. }, Primitive::Capsule { .. }) => sphere_capsule::capsules(a, b, margin, out),
        _ => feature_overlap::features(a, b, margin, out),
    }
}
