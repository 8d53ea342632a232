//! Composable signed-distance shapes.
//!
//! A [`Shape`] is a tree: primitives at the leaves, placements, combinations and warps above them. Every node knows its
//! signed distance with the outward unit normal ([`Shape::distance_and_normal`]), exact where the node allows it and
//! otherwise found by projecting on the surface.

use std::sync::Arc;

use super::{Pose, Vec3, mesh::MeshSolid};

mod bounds;
mod build;
mod check;
mod combine;
mod contact;
mod field;
mod plain;
mod primitive;
mod profile;
mod ray;
mod relief;
mod tree;
mod warp;

pub use check::ShapeError;
pub use contact::Contact;
pub use profile::Profile;
pub use relief::{Bumps, Mask, Relief, Ridges};
pub use tree::TreeSize;

/// A coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// First axis.
    X,
    /// Second axis.
    Y,
    /// Third axis.
    Z,
}

impl Axis {
    /// 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Its unit vector.
    pub fn unit(self) -> Vec3 {
        Vec3::ith(self.index(), 1.0)
    }
}

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
        section: Arc<Profile>,
        /// Half the length along y, m.
        half_length: f64,
    },
    /// A profile in the half-plane (r, z), revolved about the z axis.
    Lathe(Arc<Profile>),
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
        reliefs: Vec<Relief>,
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
    /// Material id at a point on or near the surface; 0 where nothing is painted.
    pub fn material(&self, p_o: &Vec3) -> u16 {
        match self {
            Self::Placed { shape, pose } => shape.material(&to_local(pose, p_o)),
            Self::Scaled { shape, scale } => shape.material(&p_o.component_div(scale)),
            Self::Twist { shape, axis, rate } => shape.material(&warp::untwist(p_o, *axis, *rate).0),
            Self::Bend { shape, along, towards, curvature } => {
                shape.material(&warp::unbend(p_o, *along, *towards, *curvature).0)
            }
            Self::Rounded { shape, .. } | Self::Shell { shape, .. } | Self::Displace { shape, .. } => {
                shape.material(p_o)
            }
            Self::Union(parts) | Self::Intersect(parts) | Self::SmoothUnion { parts, .. } => {
                nearest_part(parts, p_o).map_or(0, |part| part.material(p_o))
            }
            Self::Subtract { from, .. } | Self::SmoothSubtract { from, .. } => from.material(p_o),
            Self::Paint { shape, material, region } => {
                if region.as_ref().is_none_or(|region| region.distance(p_o) < 0.0) {
                    *material
                } else {
                    shape.material(p_o)
                }
            }
            _ => 0,
        }
    }
}

/// The part whose surface is nearest to `p_o`, the first of equals.
fn nearest_part<'a>(parts: &'a [Shape], p_o: &Vec3) -> Option<&'a Shape> {
    parts
        .iter()
        .map(|part| (part.distance(p_o).abs(), part))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, part)| part)
}

/// A point of this frame in the frame that `pose` places.
fn to_local(pose: &Pose, p_o: &Vec3) -> Vec3 {
    pose.rotation.inverse_transform_vector(&(p_o - pose.translation.vector))
}
