//! Conversions to and from parry's vector types, which stay inside of `geometry`.

use parry3d_f64::math;

use super::{Pose, Vec3};

pub(super) fn to_parry(v: &Vec3) -> math::Vector {
    math::Vector::new(v.x, v.y, v.z)
}

pub(super) fn from_parry(v: math::Vector) -> Vec3 {
    Vec3::new(v.x, v.y, v.z)
}

pub(super) fn pose_to_parry(pose: &Pose) -> math::Pose {
    let (t, q) = (pose.translation.vector, pose.rotation.quaternion());
    math::Pose::from_parts(to_parry(&t), math::Rotation::from_xyzw(q.i, q.j, q.k, q.w))
}
