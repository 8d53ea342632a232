//! Contact points between rigid primitives, as pure functions of their poses.
//!
//! Two *primitives* ([`Primitive`]) meet in [`manifold`]: a contact normal is found, the feature of each primitive that faces
//! the other (a face, a side line) is projected along it, and the overlap's corners become the points. Every point's
//! gap is exact at its place, so corners and rims carry a tipping body where its real edge is, and round bodies touch
//! at the moving lowest point and roll. General shapes meet through [`field::Skin`],
//! and compliant skins meet hard shapes through [`gel::gel_vs_shape`].

use crate::geometry::{Pose, Vec3};

mod clip;
mod closest_points;
mod feature;
mod feature_extraction;
mod feature_overlap;
pub mod field;
mod flat_region;
pub mod gel;
mod plane;
mod separating_axis;
mod sphere_capsule;

#[cfg(test)]
mod field_tests;
#[cfg(test)]
mod test_rig;
#[cfg(test)]
mod tests;

pub use feature_extraction::{Ring, SkinSamples, primitives, skin_samples};
pub use flat_region::FlatSample;

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
    /// Half-way between the two surfaces, world, m.
    pub p_w: Vec3,
    /// Unit normal from the first body to the second, world.
    pub n_w: Vec3,
    /// Gap along the normal, m; negative where they overlap.
    pub phi: f64,
    /// Area that the point stands for, m². The points of a flat patch share its area; a line or point contact has
    /// [`POINT_AREA`] a point. Areas fade in and out, so that a small change of pose changes forces a little.
    pub area: f64,
    /// Names the features that meet; the same from step to step while they stay the same. See [`NON_MATERIAL`].
    pub feature: u32,
}

impl ManifoldPoint {
    /// Whether the point travels over the material as the bodies roll ([`NON_MATERIAL`]).
    pub fn is_moving(&self) -> bool {
        self.feature & NON_MATERIAL != 0
    }
}

/// Set in the `feature` of a point that is no material point of either body (the lowest point of a sphere or rim).
/// Its tangential spring must be stretched by the *velocity* of the touching material, since the way of the point
/// itself is no slip: a rolling ball has none.
pub const NON_MATERIAL: u32 = 1 << 31;

/// Area of a point contact and of either end of a line contact, m²: with the contact modulus of stiff solids
/// (1e9 Pa/m) 1e6 N/m, hence 10 µm under 10 N. A tenth of it makes a can of 0.3 kg tip 0.4° too early, because the
/// rim that carries it gives way.
pub const POINT_AREA: f64 = 1e-3;

impl Primitive {
    /// The order in which pairs are computed, so that each pair is written once.
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
/// Swapping the two flips the normals and nothing else, but for the names of the features of two primitives of a kind.
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
        (Primitive::Plane, Primitive::Box { half }) => plane::corners(pose_a, &half, pose_b, margin, out),
        (_, Primitive::Sphere { radius }) => sphere_capsule::sphere(a, pose_a, radius, pose_b, margin, out),
        (Primitive::Capsule { .. }, Primitive::Capsule { .. }) => {
            sphere_capsule::capsules(a, pose_a, b, pose_b, margin, out)
        }
        _ => feature_overlap::features(a, pose_a, b, pose_b, margin, out),
    }
}
