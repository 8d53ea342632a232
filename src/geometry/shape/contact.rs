//! Contact queries of surface samples against shapes, with partial coverage at sharp edges.

use super::{
    combine::SignedDistance,
    primitive,
    tree::{Shape, to_local},
};
use crate::Vec3;

/// Contact of a surface sample with a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleContact {
    /// Signed distance, m; negative inside.
    pub gap: f64,
    /// Outward unit normal of the shape.
    pub normal: Vec3,
    /// Share of the sample's patch that covers the face, 0..=1.
    pub coverage: f64,
}

/// Smallest cosine between a face normal and the opposite of the sample's normal at which the sample contacts the face.
const FACING: f64 = 0.3;
/// Difference of these cosines within which a sample contacts two faces.
const FACING_BAND: f64 = 0.25;
/// Depth (m) down to which a sample contacts a face, or [`MAX_DEPTH_RATIO`] times the depth under the nearest face if
/// that is more. A sample on an edge that slides along a wall faces the far end of the wall without being near it.
const MAX_DEPTH: f64 = 4e-3;
/// See [`MAX_DEPTH`].
const MAX_DEPTH_RATIO: f64 = 3.0;

/// One flat or round face of a sharp-edged shape, relative to a query point.
struct SupportFace {
    gap: f64,
    normal: Vec3,
    /// Distance of the point inside of the edges of the face, in each direction, m.
    inside: [f64; 2],
    /// Half the thickness of the shape under the face, m. Deeper points are nearer to the far side.
    depth: f64,
}

impl Shape {
    /// Contact of a square sample of edge `spacing` (m) at `p_o`. `facing_o` is the outward normal of the body that
    /// carries the sample, in this shape's frame; zero if unknown.
    ///
    /// Boxes and cylinders have sharp edges. A sample contacts the face that it faces, up to half a spacing beyond the
    /// edge, with the covered share of its patch; one that faces two of them alike contacts a plane between them. The
    /// total over a field of samples is therefore continuous as an edge
    /// moves, and a deep sample near an edge does not switch to the adjacent face. All other shapes return
    /// [`Shape::distance_and_normal`] with full coverage.
    pub fn contact(&self, p_o: &Vec3, facing_o: &Vec3, spacing: f64) -> SampleContact {
        match self {
            Self::Box { half } => sharp(box_faces(p_o, half), facing_o, spacing)
                .unwrap_or_else(|| full(primitive::cuboid(p_o, half))),
            Self::Cylinder { radius, half_height } => {
                sharp(cylinder_faces(p_o, *radius, *half_height), facing_o, spacing)
                    .unwrap_or_else(|| full(primitive::cylinder(p_o, *radius, *half_height)))
            }
            Self::Placed { shape, pose } => {
                let facing = pose.rotation.inverse_transform_vector(facing_o);
                let contact = shape.contact(&to_local(pose, p_o), &facing, spacing);
                SampleContact { normal: pose.rotation * contact.normal, ..contact }
            }
            Self::Paint { shape, .. } => shape.contact(p_o, facing_o, spacing),
            Self::Union(parts) => union(parts, p_o, facing_o, spacing),
            _ => full(self.refined(p_o)),
        }
    }
}

fn full(SignedDistance { distance: gap, normal }: SignedDistance) -> SampleContact {
    SampleContact { gap, normal, coverage: 1.0 }
}

/// Contact with the face that the sample faces most directly, among those that it covers; `None` if it covers none.
///
/// Faces that it faces nearly as directly take part (a plane through their common edge, between them). So the direction
/// of the contact turns continuously with the sample. With one face alone, it would jump by 90° as a sample that wraps
/// around an edge passes 45°; light nodes of soft bodies were seen to alternate between the two.
fn sharp<const N: usize>(faces: [SupportFace; N], facing: &Vec3, spacing: f64) -> Option<SampleContact> {
    let nearest = -faces.iter().fold(f64::NEG_INFINITY, |least, face| least.max(face.gap));
    let deepest = MAX_DEPTH.max(MAX_DEPTH_RATIO * nearest);
    // Most samples face one face only, so the shares of the others are not computed.
    let shares = faces.each_ref().map(|face| {
        let alignment = -facing.dot(&face.normal);
        let limit = face.depth.min(deepest);
        let is_faced = alignment > FACING && face.gap >= -limit;
        if !is_faced {
            return None;
        }
        let coverage = covered(face.inside[0], spacing) * covered(face.inside[1], spacing);
        let depth = (2.0 * (1.0 + face.gap / limit)).clamp(1e-6, 1.0);
        (coverage > 0.0).then_some((alignment, coverage, depth))
    });
    let mut met = faces.iter().zip(&shares).filter_map(|(face, share)| Some((face, share.as_ref()?)));
    if let (Some((face, &(_, coverage, _))), None) = (met.next(), met.next()) {
        return Some(SampleContact { gap: face.gap, normal: face.normal, coverage });
    }
    let most = shares.iter().flatten().fold(FACING, |most, (alignment, ..)| most.max(*alignment));
    let (mut total, mut gap, mut normal, mut coverage) = (0.0, 0.0, Vec3::zeros(), 0.0);
    for (face, share) in faces.iter().zip(shares) {
        let Some((alignment, covered, depth)) = share else { continue };
        let weight = (1.0 - (most - alignment) / FACING_BAND).max(0.0) * depth;
        total += weight;
        gap += weight * face.gap;
        normal += face.normal * weight;
        coverage += weight * covered;
    }
    let length = normal.norm();
    (total > 0.0).then(|| SampleContact {
        gap: gap / length,
        normal: normal / length,
        coverage: coverage / total,
    })
}

/// Covered share, along one direction, of a patch with its centre `inside` m within the edge.
fn covered(inside: f64, spacing: f64) -> f64 {
    (inside / spacing + 0.5).clamp(0.0, 1.0)
}

fn box_faces(p: &Vec3, half: &Vec3) -> [SupportFace; 3] {
    let inside = half - p.abs();
    std::array::from_fn(|axis| {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        SupportFace {
            gap: -inside[axis],
            normal: Vec3::ith(axis, if p[axis] < 0.0 { -1.0 } else { 1.0 }),
            inside: [inside[i], inside[j]],
            depth: half[axis],
        }
    })
}

fn cylinder_faces(p: &Vec3, radius: f64, half_height: f64) -> [SupportFace; 2] {
    let r = primitive::length(p.x, p.y);
    let cap = SupportFace {
        gap: p.z.abs() - half_height,
        normal: Vec3::z() * if p.z < 0.0 { -1.0 } else { 1.0 },
        inside: [radius - r, f64::INFINITY],
        depth: half_height,
    };
    let side = SupportFace {
        gap: r - radius,
        normal: if r > 1e-12 { Vec3::new(p.x / r, p.y / r, 0.0) } else { Vec3::x() },
        inside: [half_height - p.z.abs(), f64::INFINITY],
        depth: radius,
    };
    [cap, side]
}

/// Contact with the deepest part. Flush parts add up their coverage, so that a patch on a seam is covered fully.
fn union(parts: &[Shape], p: &Vec3, facing: &Vec3, spacing: f64) -> SampleContact {
    let mut best = SampleContact { gap: f64::INFINITY, normal: Vec3::z(), coverage: 1.0 };
    for part in parts {
        // A sample may contact a face from half a spacing beyond its edge.
        if part.is_farther(p, best.gap + spacing) {
            continue;
        }
        let contact = part.contact(p, facing, spacing);
        let flush =
            (contact.gap - best.gap).abs() < 1e-3 * spacing && contact.normal.dot(&best.normal) > 0.999;
        if flush {
            best.coverage = (best.coverage + contact.coverage).min(1.0);
        } else if contact.gap < best.gap {
            best = contact;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contact_of_a_sample_that_turns_around_an_edge_turns_with_it() {
        let block = Shape::cuboid(Vec3::new(0.02, 0.02, 0.1));
        // 1 mm deep under one face, 1.5 mm under the other; both depths are within reach of the edge between them.
        let p = Vec3::new(0.009, 0.0085, 0.0);
        let at = |degrees: f64| {
            let angle = degrees.to_radians();
            block.contact(&p, &Vec3::new(-angle.cos(), -angle.sin(), 0.0), 7.5e-4)
        };
        for degrees in [0.0, 20.0, 34.0] {
            let (x, y) = (at(degrees), at(90.0 - degrees));
            assert!((x.normal - Vec3::x()).norm() < 1e-12 && (x.gap + 1e-3).abs() < 1e-12, "{x:?}");
            assert!((y.normal - Vec3::y()).norm() < 1e-12 && (y.gap + 1.5e-3).abs() < 1e-12, "{y:?}");
        }
        for tenth in 0..900 {
            let (now, next) = (at(f64::from(tenth) / 10.0), at(f64::from(tenth + 1) / 10.0));
            let turn = now.normal.dot(&next.normal).clamp(-1.0, 1.0).acos().to_degrees();
            assert!(turn < 1.0, "{turn}° at {}°", f64::from(tenth) / 10.0);
            assert!((now.gap - next.gap).abs() < 2e-5 && (now.coverage - next.coverage).abs() < 1e-12);
        }
        // Halfway, the contact is the plane through the edge, half between the faces.
        let middle = at(45.0);
        assert!((middle.normal - Vec3::new(1.0, 1.0, 0.0).normalize()).norm() < 1e-12);
        assert!((middle.gap + 2.5e-3 / 2f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn an_edge_sliding_along_a_wall_does_not_contact_the_far_end() {
        let wall = Shape::cuboid(Vec3::new(0.01, 0.6, 0.6));
        // Half a millimetre inside the broad side of the wall, facing along the wall in both directions.
        for z in [-0.2, -0.03, -0.001, 0.001, 0.03, 0.2] {
            for facing in [Vec3::z(), -Vec3::z()] {
                let contact = wall.contact(&Vec3::new(0.0045, 0.0, z), &facing, 7.5e-4);
                assert!(
                    (contact.gap + 5e-4).abs() < 1e-12 && contact.normal == Vec3::x(),
                    "{contact:?} at {z}"
                );
            }
        }
    }
}
