//! The tree of shapes: the type, its builders and its size.

use std::sync::Arc;

use super::{
    displacement::Displacement, error::ShapeError, mesh_solid::MeshSolid, polygon::Polygon, warp::Axis,
};
use crate::geometry::{
    Pose, Quat, Vec3,
    mesh::{Mesh, MeshError},
};

/// A solid, described by its signed distance in the object frame (m; negative inside).
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A box centred on the origin.
    Box {
        /// Half extents, m.
        half: Vec3,
    },
    /// A sphere centred on the origin.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// An axis-aligned ellipsoid centred on the origin.
    Ellipsoid {
        /// Semi-axes, m.
        radii: Vec3,
    },
    /// A capsule about the z axis, centred on the origin.
    Capsule {
        /// Radius, m.
        radius: f64,
        /// Half the length of the straight part, m; the total length is `2 (half_length + radius)`.
        half_length: f64,
    },
    /// A flat-ended cylinder about the z axis, centred on the origin.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Half the height, m.
        half_height: f64,
    },
    /// A torus about the z axis, centred on the origin.
    Torus {
        /// Radius of the circle at the middle of the tube, m.
        major: f64,
        /// Radius of the tube, m; less than `major`.
        minor: f64,
    },
    /// A polygon in the plane (x, z), drawn out along y, centred on y = 0; a wedge is one with three corners.
    Prism {
        /// The cross-section.
        section: Arc<Polygon>,
        /// Half the length along y, m.
        half_length: f64,
    },
    /// A profile in the half-plane (r, z), revolved about the z axis.
    Lathe(Arc<Polygon>),
    /// A closed, outward-oriented triangle mesh.
    Mesh(Arc<MeshSolid>),
    /// A shape moved rigidly.
    Placed {
        /// What is moved.
        shape: Arc<Shape>,
        /// Frame of `shape` in this one.
        pose: Pose,
    },
    /// A shape stretched along the axes.
    Scaled {
        /// What is stretched.
        shape: Arc<Shape>,
        /// Factors along x, y, z; all positive.
        scale: Vec3,
    },
    /// A shape grown outwards, which rounds its convex edges.
    Rounded {
        /// What is grown.
        shape: Arc<Shape>,
        /// Growth, m.
        radius: f64,
    },
    /// The skin of a shape: what lies within `thickness` under its surface.
    Shell {
        /// What is hollowed.
        shape: Arc<Shape>,
        /// Thickness of the wall, m.
        thickness: f64,
    },
    /// What lies in any of the parts.
    Union(Vec<Shape>),
    /// What lies in all of the parts.
    Intersect(Vec<Shape>),
    /// What lies in `from` and not in `cut`.
    Subtract {
        /// What is cut.
        from: Arc<Shape>,
        /// What is taken away.
        cut: Arc<Shape>,
    },
    /// A union whose seams are filled by a fillet (quadratic polynomial blend).
    SmoothUnion {
        /// What is joined, blended one after the other.
        parts: Vec<Shape>,
        /// Width of the blend, m; the seam rises by at most a quarter of it a part.
        blend: f64,
    },
    /// A subtraction whose edge is rounded.
    SmoothSubtract {
        /// What is cut.
        from: Arc<Shape>,
        /// What is taken away.
        cut: Arc<Shape>,
        /// Width of the blend, m.
        blend: f64,
    },
    /// A shape twisted about an axis through the origin.
    Twist {
        /// What is twisted.
        shape: Arc<Shape>,
        /// Axis of the twist.
        axis: Axis,
        /// Turn along the axis, rad/m.
        rate: f64,
    },
    /// A shape along one axis, bent into an arc towards another; the origin stays.
    Bend {
        /// What is bent.
        shape: Arc<Shape>,
        /// The axis that becomes an arc.
        along: Axis,
        /// The axis on which the centre of the arc lies; not `along`.
        towards: Axis,
        /// Curvature of the arc, 1/m.
        curvature: f64,
    },
    /// A shape whose surface is raised or lowered.
    Displace {
        /// What is displaced.
        shape: Arc<Shape>,
        /// Height fields, added up.
        reliefs: Vec<Displacement>,
    },
    /// A shape, all or part of it, with another material.
    Paint {
        /// What is painted.
        shape: Arc<Shape>,
        /// Material id.
        material: u16,
        /// Where; everywhere if absent.
        region: Option<Arc<Shape>>,
    },
}

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
        let section = Polygon::flat(vec![[-half.x, -half.z], [half.x, -half.z], [apex * half.x, half.z]])?;
        Ok(Self::Prism { section: Arc::new(section), half_length: half.y })
    }

    /// A polygon (x, z), drawn out to `length` (m) along y.
    ///
    /// # Errors
    /// As [`Polygon::flat`].
    pub fn prism(corners: Vec<[f64; 2]>, length: f64) -> Result<Self, ShapeError> {
        Ok(Self::Prism { section: Arc::new(Polygon::flat(corners)?), half_length: 0.5 * length })
    }

    /// A profile of corners (r, z), m, revolved about the z axis.
    ///
    /// # Errors
    /// As [`Polygon::revolved`].
    pub fn lathe(corners: Vec<[f64; 2]>) -> Result<Self, ShapeError> {
        Ok(Self::Lathe(Arc::new(Polygon::revolved(corners)?)))
    }

    /// The solid bounded by a closed mesh. Vertices at one place are merged; a mesh that is inside out is inverted.
    ///
    /// # Errors
    /// If the mesh is empty, not finite, open, not manifold, or flat.
    pub fn from_mesh(mesh: Mesh) -> Result<Self, MeshError> {
        Ok(Self::Mesh(Arc::new(MeshSolid::new(mesh)?)))
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
    pub fn displaced(self, relief: Displacement) -> Self {
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

/// Transforms a point of the outer frame to the frame that `pose` places.
pub(super) fn to_local(pose: &Pose, p_o: &Vec3) -> Vec3 {
    pose.rotation.inverse_transform_vector(&(p_o - pose.translation.vector))
}

/// Size of a shape's tree, shared parts counted as often as they occur: what every walk of it costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeSize {
    /// Shapes in it, itself included.
    pub nodes: usize,
    /// Shapes above one another, itself included.
    pub depth: usize,
    /// Primitives that one exact distance looks at, about: an intersection in an intersection is projected on anew at every
    /// step of the outer one.
    pub work: f64,
}

/// How often a combination looks at its parts near its surface: for itself, for the nearest one, and where that leads.
const LOOKS: f64 = 3.0;

impl Shape {
    /// The shapes that this one is made of.
    fn parts(&self) -> Vec<&Self> {
        match self {
            Self::Placed { shape, .. }
            | Self::Scaled { shape, .. }
            | Self::Rounded { shape, .. }
            | Self::Shell { shape, .. }
            | Self::Twist { shape, .. }
            | Self::Bend { shape, .. }
            | Self::Displace { shape, .. } => vec![shape],
            Self::Paint { shape, region, .. } => {
                [Some(shape), region.as_ref()].into_iter().flatten().map(AsRef::as_ref).collect()
            }
            Self::Subtract { from, cut } | Self::SmoothSubtract { from, cut, .. } => vec![from, cut],
            Self::Union(parts) | Self::Intersect(parts) | Self::SmoothUnion { parts, .. } => {
                parts.iter().collect()
            }
            Self::Box { .. }
            | Self::Sphere { .. }
            | Self::Ellipsoid { .. }
            | Self::Capsule { .. }
            | Self::Cylinder { .. }
            | Self::Torus { .. }
            | Self::Prism { .. }
            | Self::Lathe(_)
            | Self::Mesh(_) => Vec::new(),
        }
    }

    /// Size of its tree.
    pub fn tree_size(&self) -> TreeSize {
        let own = match self {
            Self::Displace { reliefs, .. } => reliefs.len().max(1),
            _ => 1,
        };
        let exact = matches!(self, Self::Union(_) | Self::Intersect(_) | Self::Subtract { .. });
        let sum = |sum: TreeSize, part: TreeSize| TreeSize {
            nodes: sum.nodes + part.nodes,
            depth: sum.depth.max(part.depth),
            work: sum.work + part.work,
        };
        let none = TreeSize { nodes: 0, depth: 0, work: 0.0 };
        let parts = self.parts().into_iter().map(Self::tree_size).fold(none, sum);
        let region = match self {
            Self::Paint { region: Some(region), .. } => region.tree_size().work,
            _ => 0.0,
        };
        TreeSize {
            nodes: parts.nodes + own,
            depth: parts.depth + 1,
            work: (parts.work - region).max(1.0) * if exact { LOOKS } else { 1.0 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn shared_parts_count_as_often_as_they_occur() {
        let size = |shape: &Shape| {
            let TreeSize { nodes, depth, .. } = shape.tree_size();
            (nodes, depth)
        };
        let ball = Shape::Sphere { radius: 0.01 };
        let pair = ball.clone().subtract(ball.clone());
        assert_eq!(size(&pair), (3, 2));
        let two = pair.clone().subtract(pair).painted(1, Some(ball.clone()));
        assert_eq!(size(&two), (9, 4));
        let row = (0..50).fold(ball.clone(), |row, _| row.union(ball.clone()));
        assert_eq!(size(&row), (52, 2));
        let moved = (0..50).fold(ball, |moved, _| moved.translated(Vec3::x()));
        assert_eq!(size(&moved), (2, 2));
    }

    #[test]
    fn cuts_in_cuts_multiply_and_one_cut_of_many_does_not() {
        let ball = Shape::Sphere { radius: 0.01 };
        let one_by_one = (0..10).fold(ball.clone(), |rest, _| rest.subtract(ball.clone()));
        let holes = (0..9).fold(ball.clone(), |holes, _| holes.union(ball.clone()));
        let at_once = ball.subtract(holes);
        assert!(one_by_one.tree_size().work > 3_f64.powi(10));
        assert!(at_once.tree_size().work < 100.0);
    }
}
