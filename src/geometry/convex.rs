//! Convex primitives, and their closest points or penetration by the GJK and EPA of parry.

use parry3d_f64::{
    math as parry,
    query::{details, gjk::GJKResult, gjk::VoronoiSimplex},
    shape::{Cuboid, Cylinder, Segment, SupportMap},
};

use super::{
    Pose, Vec3,
    parry::{from_parry, pose_to_parry, to_parry},
};

/// A convex primitive in its own frame, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Primitive {
    /// The half-space z ≤ 0.
    Plane,
    /// A box centred on the origin.
    Box {
        /// Half extents, m.
        half: Vec3,
    },
    /// A cylinder along z, centred on the origin.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Half of its height, m.
        half_height: f64,
    },
    /// A capsule along z, centred on the origin.
    Capsule {
        /// Radius, m.
        radius: f64,
        /// Half of the length of its core segment (the total is 2 (half_height + radius)), m.
        half_height: f64,
    },
    /// A sphere centred on the origin.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
}

/// A shape and the pose of its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed<T> {
    /// The shape, in its own frame.
    pub shape: T,
    /// Its frame, in the frame of the context.
    pub pose: Pose,
}

/// Closest points of two separated shapes, or the end points of the least penetration of two overlapping ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoints {
    /// Point on the surface of the first shape, world, m.
    pub on_a_w: Vec3,
    /// Point on the surface of the second shape, world, m.
    pub on_b_w: Vec3,
    /// Unit normal from the first to the second shape, world.
    pub normal_w: Vec3,
}

/// A primitive as a convex core with a layer around it.
struct RoundedConvex {
    core: Box<dyn SupportMap>,
    /// Frame of the core: parry's cylinders are along y, those of [`Primitive`] along z.
    frame: Pose,
    /// Thickness of the layer, m.
    radius: f64,
}

impl Placed<Primitive> {
    fn core(&self) -> Option<RoundedConvex> {
        let (mut rotation, mut layer) = (Vec3::zeros(), 0.0);
        let core: Box<dyn SupportMap> = match self.shape {
            Primitive::Box { half } => Box::new(Cuboid::new(to_parry(&half))),
            Primitive::Cylinder { radius, half_height } => {
                rotation = Vec3::x() * std::f64::consts::FRAC_PI_2;
                Box::new(Cylinder::new(half_height, radius))
            }
            Primitive::Capsule { radius, half_height } => {
                layer = radius;
                let end = parry::Vector::new(0.0, 0.0, half_height);
                Box::new(Segment::new(-end, end))
            }
            Primitive::Plane | Primitive::Sphere { .. } => return None,
        };
        Some(RoundedConvex { core, frame: self.pose * Pose::new(Vec3::zeros(), rotation), radius: layer })
    }
}

/// Closest points of two boxes, cylinders or capsules; `None` if they are farther apart than `max_distance` (m), if the
/// search fails, or for other primitives.
pub fn closest_points(
    a: &Placed<Primitive>,
    b: &Placed<Primitive>,
    max_distance: f64,
) -> Option<ClosestPoints> {
    let (a, b) = (a.core()?, b.core()?);
    let found = details::contact_support_map_support_map_with_params(
        &pose_to_parry(&a.frame.inv_mul(&b.frame)),
        &*a.core,
        &*b.core,
        max_distance + a.radius + b.radius,
        &mut VoronoiSimplex::new(),
        None,
    );
    let GJKResult::ClosestPoints(on_a, on_b, normal) = found else { return None };
    let point = |p: parry::Vector| (a.frame * nalgebra::Point3::from(from_parry(p))).coords;
    let normal_w = (a.frame.rotation * from_parry(normal)).try_normalize(0.0)?;
    Some(ClosestPoints {
        on_a_w: point(on_a) + normal_w * a.radius,
        on_b_w: point(on_b) - normal_w * b.radius,
        normal_w,
    })
}
