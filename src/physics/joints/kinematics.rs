//! Kinematics of a joint tree: link poses, velocities and Jacobians.

use nalgebra::DMatrix;

use super::{JointKind, JointTree};
use softvt_geometry::{Pose, Vec3};

/// Velocity of a link in world coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkVelocity {
    /// Velocity of the link frame's origin, m/s.
    pub linear: Vec3,
    /// Angular velocity, rad/s.
    pub angular: Vec3,
}

impl LinkVelocity {
    /// Velocity of the material point at `p_w` of a link whose frame is `pose_w`, m/s.
    pub fn at(&self, pose_w: &Pose, p_w: &Vec3) -> Vec3 {
        self.linear + self.angular.cross(&(p_w - pose_w.translation.vector))
    }
}

/// Forward kinematics: link frames in the world at joint coordinates `q` (one per link).
pub fn forward(tree: &JointTree, q: &[f64]) -> Vec<Pose> {
    let mut poses: Vec<Pose> = Vec::with_capacity(tree.dofs());
    for (link, &q) in tree.links.iter().zip(q) {
        let parent = link.parent.map_or(tree.base_w, |parent| poses[parent]);
        let mut pose = parent * link.placement * link.kind.motion(q);
        // A product of many unit quaternions drifts from unit length, and the pose would then scale what it transforms.
        pose.rotation.renormalize();
        poses.push(pose);
    }
    poses
}

/// Velocities of all links at joint speeds `v`.
pub fn velocities(tree: &JointTree, poses: &[Pose], v: &[f64]) -> Vec<LinkVelocity> {
    let mut out: Vec<LinkVelocity> = Vec::with_capacity(tree.dofs());
    for (index, link) in tree.links.iter().enumerate() {
        let origin = poses[index].translation.vector;
        let (mut linear, mut angular) = match link.parent {
            Some(parent) => (out[parent].at(&poses[parent], &origin), out[parent].angular),
            None => (Vec3::zeros(), Vec3::zeros()),
        };
        let unit = unit_joint_velocity(tree, poses, index, &origin);
        linear += unit.linear * v[index];
        angular += unit.angular * v[index];
        out.push(LinkVelocity { linear, angular });
    }
    out
}

/// The 6×n Jacobian from joint speeds to the velocity of a link: three rows of the linear velocity of its origin,
/// three of the angular velocity, world.
pub fn jacobian(tree: &JointTree, poses: &[Pose], link: usize) -> DMatrix<f64> {
    point_jacobian(tree, poses, link, &poses[link].translation.vector)
}

/// As [`jacobian`], but of the material point of `link` that is at `p_w` (world, m).
pub fn point_jacobian(tree: &JointTree, poses: &[Pose], link: usize, p_w: &Vec3) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(6, tree.dofs());
    let mut at = Some(link);
    while let Some(index) = at {
        let unit = unit_joint_velocity(tree, poses, index, p_w);
        out.fixed_view_mut::<3, 1>(0, index).copy_from(&unit.linear);
        out.fixed_view_mut::<3, 1>(3, index).copy_from(&unit.angular);
        at = tree.links[index].parent;
    }
    out
}

/// Velocity of the point at `p_w` (m, world) of link `index` for unit speed of its joint.
pub(super) fn unit_joint_velocity(
    tree: &JointTree,
    poses: &[Pose],
    index: usize,
    p_w: &Vec3,
) -> LinkVelocity {
    match tree.links[index].kind {
        JointKind::Revolute(axis) => {
            let axis = poses[index].rotation * axis.into_inner();
            let linear = axis.cross(&(p_w - poses[index].translation.vector));
            LinkVelocity { linear, angular: axis }
        }
        JointKind::Prismatic(axis) => {
            LinkVelocity { linear: poses[index].rotation * axis.into_inner(), angular: Vec3::zeros() }
        }
    }
}
