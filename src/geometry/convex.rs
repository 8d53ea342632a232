//! Closest points and penetration of two convex shapes, by the GJK and EPA of parry.

use parry3d_f64::{
    math as parry,
    query::{details, gjk::GJKResult, gjk::VoronoiSimplex},
    shape::{Cuboid, Cylinder, Segment, SupportMap},
};

use super::{
    Pose, Vec3,
    parry::{from_parry, pose_to_parry, to_parry},
};

/// A convex shape centred on the origin of its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConvexShape {
    /// A box with these half extents, m.
    Box(Vec3),
    /// A cylinder along z.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Half the height, m.
        half_height: f64,
    },
    /// A segment along z with this half length, m.
    Segment(f64),
}

/// Closest points of two separated shapes, or the end points of the least penetration of two overlapping ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoints {
    /// Point on the surface of the first shape, world, m.
    pub a_w: Vec3,
    /// Point on the surface of the second shape, world, m.
    pub b_w: Vec3,
    /// Unit normal from the first to the second shape, world.
    pub n_w: Vec3,
}

/// Closest points of `a` and `b`; `None` if they are farther apart than `max_distance` (m) or the search fails.
pub fn closest_points(
    a: &ConvexShape,
    pose_a: &Pose,
    b: &ConvexShape,
    pose_b: &Pose,
    max_distance: f64,
) -> Option<ClosestPoints> {
    let (frame_a, frame_b) = (pose_a * parry_frame(a), pose_b * parry_frame(b));
    let relative = pose_to_parry(&frame_a.inv_mul(&frame_b));
    let (map_a, map_b) = (support_map(a), support_map(b));
    let found = details::contact_support_map_support_map_with_params(
        &relative,
        &*map_a,
        &*map_b,
        max_distance,
        &mut VoronoiSimplex::new(),
        None,
    );
    let GJKResult::ClosestPoints(on_a, on_b, normal) = found else { return None };
    let point = |p: parry::Vector| frame_a * nalgebra::Point3::from(from_parry(p));
    let n_w = frame_a.rotation * from_parry(normal);
    Some(ClosestPoints { a_w: point(on_a).coords, b_w: point(on_b).coords, n_w: n_w.try_normalize(0.0)? })
}

/// Frame of parry's shape in the frame of `piece`: parry's cylinders are along y, those of [`ConvexShape`] along z.
fn parry_frame(piece: &ConvexShape) -> Pose {
    let rotation = match piece {
        ConvexShape::Cylinder { .. } => Vec3::x() * std::f64::consts::FRAC_PI_2,
        ConvexShape::Box(_) | ConvexShape::Segment(_) => Vec3::zeros(),
    };
    Pose::new(Vec3::zeros(), rotation)
}

fn support_map(piece: &ConvexShape) -> Box<dyn SupportMap> {
    match *piece {
        ConvexShape::Box(half) => Box::new(Cuboid::new(to_parry(&half))),
        ConvexShape::Cylinder { radius, half_height } => Box::new(Cylinder::new(half_height, radius)),
        ConvexShape::Segment(half) => {
            let end = parry::Vector::new(0.0, 0.0, half);
            Box::new(Segment::new(-end, end))
        }
    }
}
