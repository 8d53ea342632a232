//! Colliders: surfaces of everything but soft bodies, attached to a body or to the world.

use std::{fmt::Debug, sync::Arc};

use serde::{Deserialize, Serialize};

use super::{layer::ElasticLayer, solid::CollisionGeometry};
use crate::ids::{ArticulationId, BodyId};
use softvt_common::range::Range;
use softvt_geometry::{
    Aabb, Pose, Vec3,
    shape::{SampleContact, Shape},
};

/// The surface of a solid in its own frame, m. [`Shape`] implements it.
pub trait ContactSurface: Debug + Send + Sync {
    /// Signed distance, outward normal and coverage for a square sample of edge `spacing` (m) at `p`
    /// with outward normal `facing`. The search for contacts skips samples around one that is far away, so an
    /// approximate distance of up to 5 mm must not exceed the true one by more than a quarter.
    fn contact(&self, p: &Vec3, facing: &Vec3, spacing: f64) -> SampleContact;
    /// True if a cheap test proves that the solid is more than `reach` (m) away from `p`; false leaves it open.
    fn is_farther(&self, _p: &Vec3, _reach: f64) -> bool {
        false
    }
    /// A box around the solid.
    fn bounds(&self) -> Aabb;
    /// Geometry for contact with other colliders. Without it, the surface touches soft bodies only.
    fn collision_geometry(&self) -> Option<CollisionGeometry> {
        None
    }
}

impl ContactSurface for Shape {
    fn contact(&self, p: &Vec3, facing: &Vec3, spacing: f64) -> SampleContact {
        Self::contact(self, p, facing, spacing)
    }

    fn is_farther(&self, p: &Vec3, reach: f64) -> bool {
        Self::is_farther(self, p, reach)
    }

    fn bounds(&self) -> Aabb {
        Self::bounds(self)
    }

    fn collision_geometry(&self) -> Option<CollisionGeometry> {
        Some(CollisionGeometry::new(self))
    }
}

/// Coulomb friction coefficients of a surface. A pair of surfaces takes the larger of each, unless one is coated.
/// Its serialised names are part of fingerprints of assets.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Friction {
    /// Coefficient of a surface that sticks.
    pub static_mu: f64,
    /// Coefficient of a surface that slides, not above the static one.
    pub dynamic_mu: f64,
    /// True for a layer on the surface, such as flour, oil or glaze: it separates the surfaces, so that its
    /// coefficients are those of any pair.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub coated: bool,
}

impl Default for Friction {
    /// [`Friction::STANDARD`].
    fn default() -> Self {
        Self::STANDARD
    }
}

impl Friction {
    /// Friction of every object and surface that states no other.
    pub const STANDARD: Self = Self::new(0.6, 0.5);
    /// Range of a coefficient.
    pub const COEFFICIENT: Range = Range::closed(0.0, 10.0);
    /// No friction at all.
    pub const NONE: Self = Self::new(0.0, 0.0);

    /// Dynamic over static coefficient of a coating: that of the pads.
    const COATING_RATIO: f64 = 0.8;

    /// A surface without a coating.
    pub const fn new(static_mu: f64, dynamic_mu: f64) -> Self {
        Self { static_mu, dynamic_mu, coated: false }
    }

    /// A coated surface, by the static coefficient of the coating.
    pub const fn coated(static_mu: f64) -> Self {
        Self { static_mu, dynamic_mu: Self::COATING_RATIO * static_mu, coated: true }
    }

    /// The coefficients of a pair: those of the coating, the more slippery one if both are coated, and without a
    /// coating the larger ones.
    pub fn with(&self, other: &Self) -> Self {
        let pick: fn(f64, f64) -> f64 = match (self.coated, other.coated) {
            (true, false) => return *self,
            (false, true) => return *other,
            (true, true) => f64::min,
            (false, false) => f64::max,
        };
        Self {
            static_mu: pick(self.static_mu, other.static_mu),
            dynamic_mu: pick(self.dynamic_mu, other.dynamic_mu),
            coated: self.coated,
        }
    }
}

/// Stiffness of a surface per area, Pa/m: contact is a bed of springs in both directions. Those of an elastic layer
/// have rest positions that move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceStiffness {
    /// In the normal direction.
    pub normal: f64,
    /// In the tangential directions.
    pub shear: f64,
}

impl SurfaceStiffness {
    /// Displacement of springs along a unit normal and across it by a traction (Pa), m.
    pub(crate) fn compliance(&self, traction: &Vec3, normal: &Vec3) -> Vec3 {
        let pressed = normal * normal.dot(traction);
        pressed / self.normal + (traction - pressed) / self.shear
    }

    /// Two surfaces pressed on each other: springs in series.
    pub fn in_series(&self, other: &Self) -> Self {
        let series = |a: f64, b: f64| 1.0 / (1.0 / a + 1.0 / b);
        Self { normal: series(self.normal, other.normal), shear: series(self.shear, other.shear) }
    }
}

/// A surface attached to a body, a kinematic frame or the world.
#[derive(Clone, Debug)]
pub struct Collider {
    /// Name, for messages and logs.
    pub name: String,
    /// The body that carries it; never a soft body.
    pub parent: BodyId,
    /// Collider frame in the parent's frame (the object frame of a rigid body, the link frame of a link).
    pub pose_in_parent: Pose,
    /// The surface that samples of soft bodies touch.
    pub surface: Arc<dyn ContactSurface>,
    /// Friction of the surface.
    pub friction: Friction,
    /// Stiffness of the surface, where it has no layer.
    pub stiffness: SurfaceStiffness,
    /// The elastic layer that the surface is, in the collider's frame.
    pub layer: Option<Arc<ElasticLayer>>,
    /// Bounds in the collider's frame.
    pub bounds: Aabb,
    /// The articulation whose fixed base this is, such as the corpus of a chest of drawers. It never
    /// touches that articulation's links.
    pub base_of: Option<ArticulationId>,
    /// Geometry for contact with other colliders; without it, only soft bodies touch the collider.
    pub collision_geometry: Option<Arc<CollisionGeometry>>,
}

impl Collider {
    /// A collider of `surface` at `pose_in_parent` on `parent`.
    pub fn new(
        name: &str,
        parent: impl Into<BodyId>,
        pose_in_parent: Pose,
        surface: Arc<dyn ContactSurface>,
        friction: Friction,
        stiffness: SurfaceStiffness,
    ) -> Self {
        let bounds = surface.bounds();
        let collision_geometry = surface.collision_geometry().map(Arc::new);
        Self {
            name: name.to_owned(),
            parent: parent.into(),
            pose_in_parent,
            surface,
            friction,
            stiffness,
            layer: None,
            bounds,
            base_of: None,
            collision_geometry,
        }
    }

    /// The same collider, of an elastic layer.
    #[must_use]
    pub fn with_layer(mut self, layer: Arc<ElasticLayer>) -> Self {
        self.layer = Some(layer);
        self
    }

    /// The same collider as the fixed base of `articulation`.
    #[must_use]
    pub fn as_base_of(mut self, articulation: ArticulationId) -> Self {
        self.base_of = Some(articulation);
        self
    }
}
