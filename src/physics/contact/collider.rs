//! Colliders: surfaces that contact samples can meet, and what carries them.

use std::{fmt::Debug, sync::Arc};

use serde::{Deserialize, Serialize};

use super::solid::Solid;
use crate::geometry::{
    Aabb, Pose, Vec3,
    shape::{Contact, Shape},
};

/// A solid's surface as contact samples feel it, in its own frame.
pub trait Surface: Debug + Send + Sync {
    /// Contact of a square sample of edge `spacing` (m) at `p` whose own outward normal is `facing`.
    fn contact(&self, p: &Vec3, facing: &Vec3, spacing: f64) -> Contact;
    /// A box around the solid.
    fn bounds(&self) -> Aabb;
    /// How other rigid colliders meet it; without a solid, only soft bodies feel it.
    fn solid(&self) -> Option<Solid> {
        None
    }
}

impl Surface for Shape {
    fn contact(&self, p: &Vec3, facing: &Vec3, spacing: f64) -> Contact {
        Self::contact(self, p, facing, spacing)
    }

    fn bounds(&self) -> Aabb {
        Self::bounds(self)
    }

    fn solid(&self) -> Option<Solid> {
        Some(Solid::new(self))
    }
}

/// Index of a collider in its world.
pub type ColliderId = usize;

/// What carries a collider.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mover {
    /// Nothing: part of the world.
    Static,
    /// A kinematic frame, by index: its motion is prescribed.
    Kinematic(usize),
    /// A free rigid body, by index (its object frame).
    Rigid(usize),
    /// A link of a joint tree.
    Link {
        /// Tree index.
        tree: usize,
        /// Link index in the tree.
        link: usize,
    },
}

/// Coulomb friction coefficients of a surface. A pair of surfaces takes the larger of each coefficient.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Friction {
    /// Static coefficient.
    pub static_mu: f64,
    /// Dynamic coefficient, not above the static one.
    pub dynamic_mu: f64,
}

impl Default for Friction {
    /// 0.6 / 0.5: every object and surface except the gel pads.
    fn default() -> Self {
        Self { static_mu: 0.6, dynamic_mu: 0.5 }
    }
}

impl Friction {
    /// The coefficients of a pair.
    pub fn with(&self, other: &Self) -> Self {
        Self {
            static_mu: self.static_mu.max(other.static_mu),
            dynamic_mu: self.dynamic_mu.max(other.dynamic_mu),
        }
    }
}

/// Stiffness of a surface layer per area, Pa/m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Normal.
    pub normal: f64,
    /// Tangential.
    pub shear: f64,
}

impl Layer {
    /// Two layers in series.
    pub fn in_series(&self, other: &Self) -> Self {
        let series = |a: f64, b: f64| 1.0 / (1.0 / a + 1.0 / b);
        Self { normal: series(self.normal, other.normal), shear: series(self.shear, other.shear) }
    }
}

/// A surface somewhere in the world.
#[derive(Clone, Debug)]
pub struct Collider {
    /// Name, for messages and logs.
    pub name: String,
    /// What carries it.
    pub mover: Mover,
    /// Its frame in that of its mover.
    pub pose_in_mover: Pose,
    /// Its surface.
    pub surface: Arc<dyn Surface>,
    /// Its friction.
    pub friction: Friction,
    /// Its compliance.
    pub layer: Layer,
    /// Its bounds, in its own frame.
    pub bounds: Aabb,
    /// The joint tree that it is part of without moving with one of its links: the fixed base of a piece of furniture. It
    /// never touches the links of that tree.
    pub base_of: Option<usize>,
    /// How other rigid colliders meet it, if they can.
    pub solid: Option<Arc<Solid>>,
}

impl Collider {
    /// A collider of `surface` at `pose_in_mover` on `mover`.
    pub fn new(
        name: &str,
        (mover, pose_in_mover): (Mover, Pose),
        surface: Arc<dyn Surface>,
        friction: Friction,
        layer: Layer,
    ) -> Self {
        let bounds = surface.bounds();
        let solid = surface.solid().map(Arc::new);
        Self {
            name: name.to_owned(),
            mover,
            pose_in_mover,
            surface,
            friction,
            layer,
            bounds,
            base_of: None,
            solid,
        }
    }

    /// The same as the fixed base of joint tree `tree`.
    #[must_use]
    pub fn as_base_of(mut self, tree: usize) -> Self {
        self.base_of = Some(tree);
        self
    }
}
