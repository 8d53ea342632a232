//! Contact manifolds: contact points of two rigid bodies as pure functions of their poses.
//!
//! Two convex [`Primitive`]s meet in [`manifold`]. A contact normal is found by separating axes, and the
//! features of both that face each other (a face, a side line) are projected along it; the corners of their
//! overlap become the points. The gap of each point is exact at its position, so that corners and rims support
//! a tipping body where its real edge is, and round bodies touch at a moving lowest point and roll. General
//! shapes meet through `field::SurfaceInField`.
//!
//! # Why not parry's manifolds
//! The contact forces here are pressures times areas, so every point needs the area that it represents, and a small
//! change of pose must change the sum of forces little: points have to fade in and out. Parry's contact manifolds
//! give neither areas nor continuous weights.

use crate::geometry::{Pose, Vec3};

mod clip;
mod closest_points;
mod feature;
mod feature_extraction;
mod feature_overlap;
pub(super) mod field;
mod field_probe;
mod flat_region;
mod separating_axis;
mod sphere_capsule;

#[cfg(test)]
mod test_rig;
#[cfg(test)]
mod tests;

pub(super) use feature_extraction::{SurfaceFeatures, primitives, surface_features};

/// A convex primitive in its own frame, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Primitive {
    /// The half-space z ≤ 0.
    Plane,
    /// A box centred on the origin.
    Box {
        /// Half extents, m.
        half: Vec3,
    },
    /// A cylinder along z, centred on the origin.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Half of its height, m.
        half_height: f64,
    },
    /// A capsule along z, centred on the origin.
    Capsule {
        /// Radius, m.
        radius: f64,
        /// Half of the length of its core segment (the total is 2 (half_height + radius)), m.
        half_height: f64,
    },
    /// A sphere centred on the origin.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
}

/// One point where two bodies touch or nearly touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ManifoldPoint {
    /// Position, half-way between the two surfaces, m, world.
    pub p_w: Vec3,
    /// Unit normal from the first body to the second, world.
    pub n_w: Vec3,
    /// Gap along the normal, m; negative is overlap.
    pub phi: f64,
    /// Area that the point represents, m². The points of a flat patch share its area; a point or line contact has
    /// [`POINT_AREA`] per point. Areas fade in and out, so that a small change of pose changes forces little.
    pub area: f64,
    /// Identifies the two features that meet; constant from step to step while they stay
    /// the same. See [`NON_MATERIAL`].
    pub feature: u32,
}

/// Flag in `feature` for a point that is not a material point of either body, such as the lowest point of
/// a sphere or rim.
///
/// Its tangential spring must be stretched by the *velocity* of the touching material, since the motion of the point
/// itself is not slip: a rolling ball does not slip.
pub const NON_MATERIAL: u32 = 1 << 31;

/// Area of a point contact and of either end of a line contact, m². With the contact modulus of stiff solids (1e9
/// Pa/m) this is 1e6 N/m, hence 10 µm under 10 N. A tenth of it makes a can of 0.3 kg tip 0.4° too early, because the
/// rim that carries it sinks in.
pub const POINT_AREA: f64 = 1e-3;

impl Primitive {
    /// Position in the order of types; the manifold of each pair of types is implemented for one order only.
    fn rank(&self) -> u8 {
        match self {
            Self::Plane => 0,
            Self::Box { .. } => 1,
            Self::Cylinder { .. } => 2,
            Self::Capsule { .. } => 3,
            Self::Sphere { .. } => 4,
        }
    }
}

/// Appends to `out` the contact points of `a` and `b` whose gap is below `margin` (m).
///
/// Swapping the two flips the normals and changes nothing else, except the feature identifiers of two
/// primitives of one type.
pub fn manifold(
    a: &Primitive,
    pose_a: &Pose,
    b: &Primitive,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<ManifoldPoint>,
) {
    let start = out.len();
    if a.rank() <= b.rank() {
        return ordered(a, pose_a, b, pose_b, margin, out);
    }
    ordered(b, pose_b, a, pose_a, margin, out);
    out[start..].iter_mut().for_each(|point| point.n_w = -point.n_w);
}

/// [`manifold`] of a pair in rank order.
fn ordered(
    a: &Primitive,
    pose_a: &Pose,
    b: &Primitive,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<ManifoldPoint>,
) {
    match (*a, *b) {
        (Primitive::Plane, Primitive::Plane) => {}
        (Primitive::Plane, Primitive::Box { half }) => {
            feature_overlap::plane_box(pose_a, &half, pose_b, margin, out);
        }
        (_, Primitive::Sphere { radius }) => sphere_capsule::sphere(a, pose_a, radius, pose_b, margin, out),
        (Primitive::Capsule { .. }, Primitive::Capsule { .. }) => {
            sphere_capsule::capsules(a, pose_a, b, pose_b, margin, out);
        }
        _ => feature_overlap::features(a, pose_a, b, pose_b, margin, out),
    }
}
