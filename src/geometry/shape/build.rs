//! Building shapes by chaining.

use std::sync::Arc;

use super::{Axis, Pose, Profile, Relief, Shape, ShapeError, Vec3};
use crate::geometry::Quat;

impl Shape {
    /// A box with these full edge lengths, m.
    pub fn cuboid(size: Vec3) -> Self {
        Self::Box { half: 0.5 * size }
    }

    /// A wedge in a box of these full edge lengths (m), its apex at `apex` (−1…1) of the half width.
    ///
    /// # Errors
    /// If the triangle encloses nothing or a number is not finite.
    pub fn wedge(size: Vec3, apex: f64) -> Result<Self, ShapeError> {
        let half = 0.5 * size;
        let section = Profile::flat(vec![[-half.x, -half.z], [half.x, -half.z], [apex * half.x, half.z]])?;
        Ok(Self::Prism { section: Arc::new(section), half_length: half.y })
    }

    /// A polygon (x, z), drawn out to `length` (m) along y.
    ///
    /// # Errors
    /// As [`Profile::flat`].
    pub fn prism(corners: Vec<[f64; 2]>, length: f64) -> Result<Self, ShapeError> {
        Ok(Self::Prism { section: Arc::new(Profile::flat(corners)?), half_length: 0.5 * length })
    }

    /// A profile of corners (r, z), m, revolved about the z axis.
    ///
    /// # Errors
    /// As [`Profile::revolved`].
    pub fn lathe(corners: Vec<[f64; 2]>) -> Result<Self, ShapeError> {
        Ok(Self::Lathe(Arc::new(Profile::revolved(corners)?)))
    }

    /// The shape moved by `pose`; moves in a row become one.
    pub fn placed(self, pose: Pose) -> Self {
        match self {
            Self::Placed { shape, pose: inner } => Self::Placed { shape, pose: pose * inner },
            shape => Self::Placed { shape: Arc::new(shape), pose },
        }
    }

    /// The shape moved by `offset`, m.
    pub fn translated(self, offset: Vec3) -> Self {
        self.placed(Pose::translation(offset.x, offset.y, offset.z))
    }

    /// The shape turned about the origin.
    pub fn rotated(self, turn: Quat) -> Self {
        self.placed(Pose::from_parts(Vec3::zeros().into(), turn))
    }

    /// The shape stretched by factors along the axes.
    pub fn scaled(self, scale: Vec3) -> Self {
        Self::Scaled { shape: Arc::new(self), scale }
    }

    /// The shape grown by `radius` (m), with rounded edges.
    pub fn rounded(self, radius: f64) -> Self {
        Self::Rounded { shape: Arc::new(self), radius }
    }

    /// The wall of `thickness` (m) under the surface.
    pub fn shell(self, thickness: f64) -> Self {
        Self::Shell { shape: Arc::new(self), thickness }
    }

    /// This or `other`.
    pub fn union(self, other: Self) -> Self {
        match self {
            Self::Union(mut parts) => {
                parts.push(other);
                Self::Union(parts)
            }
            first => Self::Union(vec![first, other]),
        }
    }

    /// This and `other`.
    pub fn intersect(self, other: Self) -> Self {
        Self::Intersect(vec![self, other])
    }

    /// This without `cut`.
    pub fn subtract(self, cut: Self) -> Self {
        Self::Subtract { from: Arc::new(self), cut: Arc::new(cut) }
    }

    /// This or `other`, with a fillet of width `blend`, m.
    pub fn smooth_union(self, other: Self, blend: f64) -> Self {
        Self::SmoothUnion { parts: vec![self, other], blend }
    }

    /// This without `cut`, the edge rounded over a width `blend`, m.
    pub fn smooth_subtract(self, cut: Self, blend: f64) -> Self {
        Self::SmoothSubtract { from: Arc::new(self), cut: Arc::new(cut), blend }
    }

    /// The shape twisted about an axis by `rate`, rad/m.
    pub fn twisted(self, axis: Axis, rate: f64) -> Self {
        Self::Twist { shape: Arc::new(self), axis, rate }
    }

    /// The shape, straight along one axis, bent with `curvature` (1/m) towards another.
    pub fn bent(self, along: Axis, towards: Axis, curvature: f64) -> Self {
        Self::Bend { shape: Arc::new(self), along, towards, curvature }
    }

    /// The shape with another relief on it.
    pub fn displaced(self, relief: Relief) -> Self {
        match self {
            Self::Displace { shape, mut reliefs } => {
                reliefs.push(relief);
                Self::Displace { shape, reliefs }
            }
            shape => Self::Displace { shape: Arc::new(shape), reliefs: vec![relief] },
        }
    }

    /// The shape with a material id, everywhere or within a region.
    pub fn painted(self, material: u16, region: Option<Self>) -> Self {
        Self::Paint { shape: Arc::new(self), material, region: region.map(Arc::new) }
    }
}
