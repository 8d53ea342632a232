//! The tree of shapes: the type, its builders and its size.

use std::sync::Arc;

use serde::Serialize;

use super::{
    displacement::SurfaceRelief, mesh_solid::MeshSolid, polygon::Polygon, validate::ShapeError, warp::Axis,
};
use crate::{
    Pose, Quat, Vec3,
    mesh::{Mesh, MeshError},
};

/// A solid, defined by its signed distance in the object frame (m; negative inside).
///
/// Shapes are built by chaining (`Shape::cuboid(size).rounded(r).translated(v)`) and share their parts. The
/// constructors accept any numbers; [`Shape::validate`] checks the tree.
///
/// Fingerprints of assets hash the serialised tree, so the names of variants and fields are part of file formats.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
    /// A polygon in the plane (x, z), extruded along y, centred on y = 0.
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
    /// A rigidly transformed shape.
    Placed {
        /// Shape in its own frame.
        shape: Arc<Shape>,
        /// Frame of the inner shape in this frame.
        pose: Pose,
    },
    /// A shape scaled along the axes.
    Scaled {
        /// Shape before it is scaled.
        shape: Arc<Shape>,
        /// Factors along x, y, z; all positive.
        scale: Vec3,
    },
    /// A shape offset outwards, which rounds its convex edges.
    Rounded {
        /// Shape whose surface is offset.
        shape: Arc<Shape>,
        /// Offset, m.
        radius: f64,
    },
    /// A hollow shape: all points up to `thickness` below the surface.
    Shell {
        /// Shape whose surface is the outer side.
        shape: Arc<Shape>,
        /// Thickness of the wall, m.
        thickness: f64,
    },
    /// All points in at least one part.
    Union(Vec<Shape>),
    /// All points in every part.
    Intersect(Vec<Shape>),
    /// All points in `from` but not in `cut`.
    Subtract {
        /// Shape that keeps what is outside of `cut`.
        from: Arc<Shape>,
        /// Shape that is cut out of `from`.
        cut: Arc<Shape>,
    },
    /// A union with filleted seams (quadratic polynomial blend).
    SmoothUnion {
        /// Parts, blended in order.
        parts: Vec<Shape>,
        /// Width of the blend, m; each part raises the seam by at most a quarter of it.
        blend: f64,
    },
    /// A difference with rounded edges.
    SmoothSubtract {
        /// Shape that keeps what is outside of `cut`.
        from: Arc<Shape>,
        /// Shape that is cut out of `from`.
        cut: Arc<Shape>,
        /// Width of the blend, m.
        blend: f64,
    },
    /// A shape twisted about an axis through the origin.
    Twist {
        /// Shape before it is twisted.
        shape: Arc<Shape>,
        /// Axis of the twist.
        axis: Axis,
        /// Twist angle per length, rad/m.
        rate: f64,
    },
    /// A shape whose axis is bent into an arc; the origin is fixed.
    Bend {
        /// Shape before it is bent.
        shape: Arc<Shape>,
        /// The axis that becomes an arc.
        along: Axis,
        /// The axis on which the centre of the arc lies; differs from `along`.
        towards: Axis,
        /// Curvature of the arc, 1/m.
        curvature: f64,
    },
    /// A shape with a displaced surface.
    Displace {
        /// Shape without the height fields.
        shape: Arc<Shape>,
        /// Height fields; their heights add up.
        reliefs: Vec<SurfaceRelief>,
    },
    /// A shape with another material, everywhere or in a region.
    Paint {
        /// Shape whose surface gets the material.
        shape: Arc<Shape>,
        /// Id of the visual material.
        material: u16,
        /// Region with the material; `None` for everywhere.
        region: Option<Arc<Shape>>,
    },
}

/// The pattern of the shapes that have no parts. A match that lists it in place of `_` does not compile once a shape
/// with parts is added.
macro_rules! without_parts {
    () => {
        Self::Box { .. }
            | Self::Sphere { .. }
            | Self::Ellipsoid { .. }
            | Self::Capsule { .. }
            | Self::Cylinder { .. }
            | Self::Torus { .. }
            | Self::Prism { .. }
            | Self::Lathe(_)
            | Self::Mesh(_)
    };
}
pub(super) use without_parts;

impl Shape {
    /// A box with edge lengths `size`, m.
    pub fn cuboid(size: Vec3) -> Self {
        Self::Box { half: 0.5 * size }
    }

    /// A wedge inscribed in a box with edge lengths `size` (m): a triangular prism along y with its apex at x =
    /// `apex` (in half widths, −1..=1).
    ///
    /// # Errors
    /// If the triangle has no area or a number is not finite.
    pub fn wedge(size: Vec3, apex: f64) -> Result<Self, ShapeError> {
        let half = 0.5 * size;
        let section = Polygon::flat(vec![[-half.x, -half.z], [half.x, -half.z], [apex * half.x, half.z]])?;
        Ok(Self::Prism { section: Arc::new(section), half_length: half.y })
    }

    /// A polygon with corners (x, z), m, extruded to `length` (m) along y.
    ///
    /// # Errors
    /// If the polygon is invalid, see [`Polygon::flat`].
    pub fn prism(corners: Vec<[f64; 2]>, length: f64) -> Result<Self, ShapeError> {
        Ok(Self::Prism { section: Arc::new(Polygon::flat(corners)?), half_length: 0.5 * length })
    }

    /// A solid of revolution about the z axis, from the corners (r, z), m, of its profile.
    ///
    /// # Errors
    /// If the polygon is invalid, see [`Polygon::revolved`].
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

    /// The shape transformed by `pose`. Consecutive placements are merged into one.
    pub fn placed(self, pose: Pose) -> Self {
        match self {
            Self::Placed { shape, pose: inner } => Self::Placed { shape, pose: pose * inner },
            shape => Self::Placed { shape: Arc::new(shape), pose },
        }
    }

    /// The shape translated by `offset`, m.
    pub fn translated(self, offset: Vec3) -> Self {
        self.placed(Pose::translation(offset.x, offset.y, offset.z))
    }

    /// The shape rotated about the origin.
    pub fn rotated(self, turn: Quat) -> Self {
        self.placed(Pose::from_parts(Vec3::zeros().into(), turn))
    }

    /// The shape scaled by positive factors along the axes.
    pub fn scaled(self, scale: Vec3) -> Self {
        Self::Scaled { shape: Arc::new(self), scale }
    }

    /// The shape offset outwards by `radius` (m), which rounds its convex edges.
    pub fn rounded(self, radius: f64) -> Self {
        Self::Rounded { shape: Arc::new(self), radius }
    }

    /// The wall of the shape, from its surface to `thickness` (m) below.
    pub fn shell(self, thickness: f64) -> Self {
        Self::Shell { shape: Arc::new(self), thickness }
    }

    /// The union with `other`.
    pub fn union(self, other: Self) -> Self {
        match self {
            Self::Union(mut parts) => {
                parts.push(other);
                Self::Union(parts)
            }
            first => Self::Union(vec![first, other]),
        }
    }

    /// The intersection with `other`.
    pub fn intersect(self, other: Self) -> Self {
        Self::Intersect(vec![self, other])
    }

    /// The difference with `cut`.
    pub fn subtract(self, cut: Self) -> Self {
        Self::Subtract { from: Arc::new(self), cut: Arc::new(cut) }
    }

    /// The union with `other`, with a fillet of width `blend`, m.
    pub fn smooth_union(self, other: Self, blend: f64) -> Self {
        Self::SmoothUnion { parts: vec![self, other], blend }
    }

    /// The difference with `cut`, with edges rounded over a width `blend`, m.
    pub fn smooth_subtract(self, cut: Self, blend: f64) -> Self {
        Self::SmoothSubtract { from: Arc::new(self), cut: Arc::new(cut), blend }
    }

    /// The shape twisted about an axis by `rate`, rad/m.
    pub fn twisted(self, axis: Axis, rate: f64) -> Self {
        Self::Twist { shape: Arc::new(self), axis, rate }
    }

    /// The shape with its axis `along` bent into an arc of `curvature` (1/m) towards another axis.
    pub fn bent(self, along: Axis, towards: Axis, curvature: f64) -> Self {
        Self::Bend { shape: Arc::new(self), along, towards, curvature }
    }

    /// The shape with an additional displacement.
    pub fn displaced(self, relief: SurfaceRelief) -> Self {
        match self {
            Self::Displace { shape, mut reliefs } => {
                reliefs.push(relief);
                Self::Displace { shape, reliefs }
            }
            shape => Self::Displace { shape: Arc::new(shape), reliefs: vec![relief] },
        }
    }

    /// The shape with a material id, everywhere or in a region.
    pub fn painted(self, material: u16, region: Option<Self>) -> Self {
        Self::Paint { shape: Arc::new(self), material, region: region.map(Arc::new) }
    }
}

/// Transforms a point of the outer frame to the frame that `pose` places.
pub(super) fn to_local(pose: &Pose, p_o: &Vec3) -> Vec3 {
    pose.rotation.inverse_transform_vector(&(p_o - pose.translation.vector))
}

/// Size of the tree of a shape, which bounds the cost of traversals and queries. Shared parts count
/// every time they occur.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeTreeSize {
    /// Number of nodes, including the root.
    pub nodes: usize,
    /// Approximate memory, bytes.
    pub bytes: usize,
    /// Depth, including the root.
    pub depth: usize,
    /// Approximate number of primitives evaluated per exact distance. Nested combinations multiply: each step of the
    /// outer search repeats the inner one.
    pub work: f64,
}

/// Evaluations of each part per distance to a combination near its surface: the point itself, the foot point on the
/// nearest part, and the refined foot point.
const EVALUATIONS: f64 = 3.0;

/// Memory of a corner of a profile with its edge, and of a triangle of a solid.
const BYTES_PER_CORNER: usize = 128;
const BYTES_PER_TRIANGLE: usize = 400;

impl Shape {
    pub(super) fn children(&self) -> Vec<&Self> {
        match self {
            Self::Placed { shape, .. }
            | Self::Scaled { shape, .. }
            | Self::Rounded { shape, .. }
            | Self::Shell { shape, .. }
            | Self::Twist { shape, .. }
            | Self::Bend { shape, .. }
            | Self::Displace { shape, .. } => vec![shape],
            Self::Paint { shape, region, .. } => region.iter().chain([shape]).map(AsRef::as_ref).collect(),
            Self::Subtract { from, cut } | Self::SmoothSubtract { from, cut, .. } => vec![from, cut],
            Self::Union(parts) | Self::Intersect(parts) | Self::SmoothUnion { parts, .. } => {
                parts.iter().collect()
            }
            without_parts!() => Vec::new(),
        }
    }

    /// Returns the size of the tree.
    pub fn tree_size(&self) -> ShapeTreeSize {
        let own = match self {
            Self::Displace { reliefs, .. } => reliefs.len().max(1),
            _ => 1,
        };
        let content = match self {
            Self::Prism { section, .. } => BYTES_PER_CORNER * section.points().len(),
            Self::Lathe(profile) => BYTES_PER_CORNER * profile.points().len(),
            Self::Mesh(solid) => BYTES_PER_TRIANGLE * solid.mesh().triangles.len(),
            _ => 0,
        };
        let exact = matches!(self, Self::Union(_) | Self::Intersect(_) | Self::Subtract { .. });
        let mut size =
            ShapeTreeSize { nodes: own, bytes: own * size_of::<Self>() + content, depth: 0, work: 0.0 };
        for part in self.children().into_iter().map(Self::tree_size) {
            size.nodes += part.nodes;
            size.bytes += part.bytes;
            size.depth = size.depth.max(part.depth);
            size.work += part.work;
        }
        let region = match self {
            Self::Paint { region: Some(region), .. } => region.tree_size().work,
            _ => 0.0,
        };
        size.depth += 1;
        size.work = (size.work - region).max(1.0) * if exact { EVALUATIONS } else { 1.0 };
        size
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    #[test]
    fn shared_parts_count_every_time_they_occur() {
        let size = |shape: &Shape| {
            let ShapeTreeSize { nodes, depth, .. } = shape.tree_size();
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
    fn nested_cuts_multiply_the_work_and_one_union_of_cuts_does_not() {
        let ball = Shape::Sphere { radius: 0.01 };
        let one_by_one = (0..10).fold(ball.clone(), |rest, _| rest.subtract(ball.clone()));
        let holes = (0..9).fold(ball.clone(), |holes, _| holes.union(ball.clone()));
        let at_once = ball.subtract(holes);
        assert!(one_by_one.tree_size().work > 3_f64.powi(10));
        assert!(at_once.tree_size().work < 100.0);
    }
}
