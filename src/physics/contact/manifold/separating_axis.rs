//! The contact normal of two convex primitives: the direction in which they are farthest apart.

use super::{Placed, Primitive};
use softvt_geometry::{
    Vec3,
    convex::{self, ClosestPoints},
};

/// Gap by which a refined direction must exceed that of a face or axis to be preferred, m. Directions of faces are
/// exact, refined ones have the rounding of an iteration.
const PREFER_FACES_M: f64 = 1e-6;
/// The same for edge against edge, relative to the gap: nearly parallel edges repeat the direction of a face.
const PREFER_FACES_SHARE: f64 = 0.01;

#[derive(Clone, Copy, Debug)]
pub(super) struct ContactNormal {
    /// Unit, from the first primitive to the second, world.
    pub normal_w: Vec3,
    /// Gap along it, m.
    pub gap: f64,
    /// True if the gap is the distance, false if it is only a lower bound, as for two boxes corner to corner.
    pub is_attained: bool,
    /// The closest points, if an iteration computed them.
    pub closest: Option<ClosestPoints>,
}

/// The contact normal of `a` and `b` in rank order, or `None` if they are at least `margin` (m) apart.
pub(super) fn contact_normal(
    a: &Placed<Primitive>,
    b: &Placed<Primitive>,
    margin: f64,
) -> Option<ContactNormal> {
    let gap_along = |normal_w: &Vec3| normal_w.dot(&(support(b, &-normal_w) - support(a, normal_w)));
    let signed = |axis: &Vec3| {
        let (ahead, behind) = (gap_along(axis), gap_along(&-axis));
        if ahead >= behind { (ahead, *axis) } else { (behind, -axis) }
    };
    let (mut gap, mut normal_w) = if a.shape == Primitive::Plane {
        let normal_w = faces(a)[0];
        (gap_along(&normal_w), normal_w)
    } else {
        faces(a)
            .iter()
            .chain(&faces(b))
            .map(signed)
            .fold((f64::NEG_INFINITY, Vec3::z()), |best, found| if found.0 > best.0 { found } else { best })
    };
    if gap >= margin {
        return None;
    }
    if a.shape == Primitive::Plane {
        return Some(ContactNormal { normal_w, gap, closest: None, is_attained: true });
    }
    let mut to_beat = gap + PREFER_FACES_M + PREFER_FACES_SHARE * gap.abs();
    for edge_a in edges(a) {
        for edge_b in edges(b) {
            let Some(cross) = edge_a.cross(&edge_b).try_normalize(1e-6) else { continue };
            let found = signed(&cross);
            if found.0 > to_beat {
                (gap, normal_w) = found;
                to_beat = gap;
            }
        }
    }
    if gap >= margin {
        return None;
    }
    if matches!((a.shape, b.shape), (Primitive::Box { .. }, Primitive::Box { .. })) {
        return Some(ContactNormal { normal_w, gap, closest: None, is_attained: gap <= 0.0 });
    }
    let closest = convex::closest_points(a, b, margin);
    if let Some(found) = closest {
        let refined = gap_along(&found.normal_w);
        if refined > gap + PREFER_FACES_M {
            (gap, normal_w) = (refined, found.normal_w);
        }
    }
    (gap < margin).then_some(ContactNormal { normal_w, gap, closest, is_attained: true })
}

/// The point of a primitive farthest along `direction` (unit, world).
pub(super) fn support(Placed { shape, pose }: &Placed<Primitive>, direction: &Vec3) -> Vec3 {
    let d = pose.rotation.inverse() * direction;
    let p = match *shape {
        Primitive::Plane => Vec3::zeros(),
        Primitive::Box { half } => half.zip_map(&d, f64::copysign),
        Primitive::Cylinder { radius, half_height } => {
            let radial = Vec3::new(d.x, d.y, 0.0).try_normalize(0.0).unwrap_or(Vec3::x());
            radial * radius + Vec3::z() * half_height.copysign(d.z)
        }
        Primitive::Capsule { radius, half_height } => d * radius + Vec3::z() * half_height.copysign(d.z),
        Primitive::Sphere { radius } => d * radius,
    };
    pose.translation.vector + pose.rotation * p
}

/// Directions of flat faces, world.
fn faces(Placed { shape, pose }: &Placed<Primitive>) -> Vec<Vec3> {
    match shape {
        Primitive::Plane | Primitive::Cylinder { .. } => vec![pose.rotation * Vec3::z()],
        Primitive::Box { .. } => (0..3).map(|axis| pose.rotation * Vec3::ith(axis, 1.0)).collect(),
        Primitive::Capsule { .. } | Primitive::Sphere { .. } => Vec::new(),
    }
}

/// Directions of straight edges and side lines, world.
fn edges(primitive: &Placed<Primitive>) -> Vec<Vec3> {
    match primitive.shape {
        Primitive::Box { .. } => faces(primitive),
        Primitive::Cylinder { .. } | Primitive::Capsule { .. } => {
            vec![primitive.pose.rotation * Vec3::z()]
        }
        Primitive::Plane | Primitive::Sphere { .. } => Vec::new(),
    }
}
