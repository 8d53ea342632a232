//! Manifolds of a sphere with any primitive and of two capsules, by distances to points and segments.

use super::{ManifoldPoint, NON_MATERIAL, POINT_AREA, Placed, Primitive};
use softvt_geometry::{Pose, Vec3};

/// Distance by which the closest points of two capsules must be closer than the interpolated gaps at the ends to
/// count in full, m.
const CLOSEST_FADE_M: f64 = 1e-4;

/// The closest point of a sphere.
pub(super) fn sphere(
    a: &Placed<Primitive>,
    radius: f64,
    sphere_w: &Pose,
    margin: f64,
    out: &mut Vec<ManifoldPoint>,
) {
    let centre_w = sphere_w.translation.vector;
    let centre_a = (a.pose.inverse() * nalgebra::Point3::from(centre_w)).coords;
    let SurfaceDistance { distance, normal } = SurfaceDistance::new(&a.shape, &centre_a);
    let (gap, normal_w) = (distance - radius, a.pose.rotation * normal);
    if gap < margin {
        let position_w = centre_w - normal_w * (radius + 0.5 * gap);
        out.push(ManifoldPoint { position_w, normal_w, gap, area: POINT_AREA, feature: NON_MATERIAL });
    }
}

/// Signed distance to a primitive, and the outward unit normal there.
pub(super) struct SurfaceDistance {
    /// m; negative inside.
    pub distance: f64,
    pub normal: Vec3,
}

impl SurfaceDistance {
    /// Of the point `p`, in the primitive's frame; exact.
    pub(super) fn new(primitive: &Primitive, p: &Vec3) -> Self {
        match *primitive {
            Primitive::Plane => Self { distance: p.z, normal: Vec3::z() },
            Primitive::Box { half } => {
                let Self { distance, normal } = Self::to_octant(&(p.abs() - half));
                Self { distance, normal: normal.component_mul(&p.map(|x| 1f64.copysign(x))) }
            }
            Primitive::Cylinder { radius, half_height } => {
                let radial = Vec3::new(p.x, p.y, 0.0).try_normalize(0.0).unwrap_or(Vec3::x());
                let excess = Vec3::new(radial.dot(p) - radius, f64::NEG_INFINITY, p.z.abs() - half_height);
                let Self { distance, normal: n } = Self::to_octant(&excess);
                Self { distance, normal: radial * n.x + Vec3::z() * n.z.copysign(p.z) }
            }
            Primitive::Capsule { radius, half_height } => {
                Self::to_ball(&(p - Vec3::z() * p.z.clamp(-half_height, half_height)), radius)
            }
            Primitive::Sphere { radius } => Self::to_ball(p, radius),
        }
    }

    /// To a ball about the origin.
    fn to_ball(p: &Vec3, radius: f64) -> Self {
        let distance = p.norm();
        Self { distance: distance - radius, normal: if distance > 0.0 { p / distance } else { Vec3::x() } }
    }

    /// To the octant of negative coordinates, whose corner is the origin.
    fn to_octant(p: &Vec3) -> Self {
        let outside = p.sup(&Vec3::zeros());
        let distance = outside.norm();
        if distance > 0.0 {
            return Self { distance, normal: outside / distance };
        }
        let axis = p.imax();
        Self { distance: p[axis], normal: Vec3::ith(axis, 1.0) }
    }
}

/// Two capsules: the four end spheres against the other's core, and the closest pair of the cores between the ends.
///
/// Each is a true gap of the two bodies. The closest pair is undefined where the cores are parallel, so it counts
/// only as far as it is closer than the gaps at the ends, interpolated.
pub(super) fn capsules(
    a: &Placed<Primitive>,
    b: &Placed<Primitive>,
    margin: f64,
    out: &mut Vec<ManifoldPoint>,
) {
    let Primitive::Capsule { radius: ra, half_height: ha } = a.shape else { return };
    let Primitive::Capsule { radius: rb, half_height: hb } = b.shape else { return };
    let (core_a, core_b) = (core(&a.pose, ha), core(&b.pose, hb));
    let mut push = |on_a: Vec3, on_b: Vec3, weight: f64, feature: u32| {
        let SurfaceDistance { distance, normal: normal_w } = SurfaceDistance::to_ball(&(on_b - on_a), 0.0);
        let gap = distance - ra - rb;
        if gap < margin && weight > 0.0 {
            let position_w = on_a + normal_w * (ra + 0.5 * gap);
            let (area, feature) = (POINT_AREA * weight, NON_MATERIAL | feature);
            out.push(ManifoldPoint { position_w, normal_w, gap, area, feature });
        }
        gap
    };
    let ends_a = [0, 1].map(|i| push(core_a[i], on_segment(&core_b, &core_a[i]).0, 1.0, i as u32));
    let ends_b = [0, 1].map(|i| push(on_segment(&core_a, &core_b[i]).0, core_b[i], 1.0, 2 + i as u32));
    let (on_a, on_b) = between_segments(&core_a, &core_b);
    let gap = (on_b - on_a).norm() - ra - rb;
    let straight = |ends: [f64; 2], t: f64| ends[0] + (ends[1] - ends[0]) * t;
    let (along_a, along_b) = (on_segment(&core_a, &on_a).1, on_segment(&core_b, &on_b).1);
    let closer = straight(ends_a, along_a).min(straight(ends_b, along_b)) - gap;
    push(on_a, on_b, (closer / CLOSEST_FADE_M).clamp(0.0, 1.0), 4);
}

fn core(pose: &Pose, half_height: f64) -> [Vec3; 2] {
    let half = pose.rotation * Vec3::z() * half_height;
    [pose.translation.vector - half, pose.translation.vector + half]
}

/// The point of a segment closest to `p`, and its place 0..=1 along it.
fn on_segment(segment: &[Vec3; 2], p: &Vec3) -> (Vec3, f64) {
    let along = segment[1] - segment[0];
    let length2 = along.norm_squared();
    let t = if length2 > 0.0 { (along.dot(&(p - segment[0])) / length2).clamp(0.0, 1.0) } else { 0.5 };
    (segment[0] + along * t, t)
}

/// The closest points of two segments (Ericson, Real-Time Collision Detection, 2005, 5.1.9).
fn between_segments(a: &[Vec3; 2], b: &[Vec3; 2]) -> (Vec3, Vec3) {
    let (along_a, along_b, apart) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let (aa, ab, bb) = (along_a.norm_squared(), along_a.dot(&along_b), along_b.norm_squared());
    let det = aa * bb - ab * ab;
    let t = if det > 1e-12 * aa * bb {
        ((ab * along_b.dot(&apart) - bb * along_a.dot(&apart)) / det).clamp(0.0, 1.0)
    } else {
        0.5
    };
    let on_b = on_segment(b, &(a[0] + along_a * t)).0;
    (on_segment(a, &on_b).0, on_b)
}
