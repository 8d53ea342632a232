//! Materials of a shape: lookup at a point, and the shape without them.

use std::sync::Arc;

use super::{
    mesh_solid::MeshPoint,
    tree::{Shape, to_local, without_parts},
    warp,
};
use crate::Vec3;

impl Shape {
    /// Material id at a point on or near the surface; 0 where the shape is not painted.
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
            without_parts!() => 0,
        }
    }

    /// The point of a mesh at a point on or near the surface; `None` where the surface is not that of a mesh.
    pub fn mesh_point(&self, p_o: &Vec3) -> Option<MeshPoint<'_>> {
        match self {
            Self::Mesh(solid) => Some(solid.nearest(p_o)),
            Self::Placed { shape, pose } => shape.mesh_point(&to_local(pose, p_o)),
            Self::Scaled { shape, scale } => {
                let found = shape.mesh_point(&p_o.component_div(scale))?;
                Some(MeshPoint { uv_per_m: found.uv_per_m / scale.product().cbrt(), ..found })
            }
            Self::Twist { shape, axis, rate } => shape.mesh_point(&warp::untwist(p_o, *axis, *rate).0),
            Self::Bend { shape, along, towards, curvature } => {
                shape.mesh_point(&warp::unbend(p_o, *along, *towards, *curvature).0)
            }
            Self::Rounded { shape, .. }
            | Self::Shell { shape, .. }
            | Self::Displace { shape, .. }
            | Self::Paint { shape, .. } => shape.mesh_point(p_o),
            Self::Union(parts) | Self::Intersect(parts) | Self::SmoothUnion { parts, .. } => {
                nearest_part(parts, p_o)?.mesh_point(p_o)
            }
            Self::Subtract { from, .. } | Self::SmoothSubtract { from, .. } => from.mesh_point(p_o),
            _ => None,
        }
    }

    /// The same solid without materials: equal for shapes that differ only in paint.
    pub fn unpainted(&self) -> Self {
        let arc = |shape: &Arc<Self>| Arc::new(shape.unpainted());
        let all = |parts: &[Self]| parts.iter().map(Self::unpainted).collect();
        match self {
            Self::Paint { shape, .. } => shape.unpainted(),
            // Merges placements that were separated by paint.
            Self::Placed { shape, pose } => shape.unpainted().placed(*pose),
            Self::Scaled { shape, scale } => Self::Scaled { shape: arc(shape), scale: *scale },
            Self::Rounded { shape, radius } => Self::Rounded { shape: arc(shape), radius: *radius },
            Self::Shell { shape, thickness } => Self::Shell { shape: arc(shape), thickness: *thickness },
            Self::Union(parts) => Self::Union(all(parts)),
            Self::Intersect(parts) => Self::Intersect(all(parts)),
            Self::Subtract { from, cut } => Self::Subtract { from: arc(from), cut: arc(cut) },
            Self::SmoothUnion { parts, blend } => Self::SmoothUnion { parts: all(parts), blend: *blend },
            Self::SmoothSubtract { from, cut, blend } => {
                Self::SmoothSubtract { from: arc(from), cut: arc(cut), blend: *blend }
            }
            Self::Twist { shape, axis, rate } => Self::Twist { shape: arc(shape), axis: *axis, rate: *rate },
            Self::Bend { shape, along, towards, curvature } => {
                Self::Bend { shape: arc(shape), along: *along, towards: *towards, curvature: *curvature }
            }
            Self::Displace { shape, reliefs } => {
                Self::Displace { shape: arc(shape), reliefs: reliefs.clone() }
            }
            without_parts!() => self.clone(),
        }
    }

    /// The largest material id that [`Shape::material`] can return.
    pub fn highest_material(&self) -> u16 {
        let (own, parts) = match self {
            Self::Paint { shape, material, .. } => (*material, vec![&**shape]),
            Self::Subtract { from, .. } | Self::SmoothSubtract { from, .. } => (0, vec![&**from]),
            _ => (0, self.children()),
        };
        parts.into_iter().map(Self::highest_material).fold(own, u16::max)
    }
}

/// The part with the surface nearest to `p_o`; the first of several at the same distance.
fn nearest_part<'a>(parts: &'a [Shape], p_o: &Vec3) -> Option<&'a Shape> {
    parts
        .iter()
        .map(|part| (part.distance(p_o).abs(), part))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, part)| part)
}
