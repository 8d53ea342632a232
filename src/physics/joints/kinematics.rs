//! Where the links are and how they move.

use nalgebra::DMatrix;

use super::{JointKind, JointTree};
use crate::geometry::{Pose, Vec3};

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

/// Link frames in the world at joint coordinates `q` (one per link).
pub fn forward(tree: &JointTree, q: &[f64]) -> Vec<Pose> {
    let mut poses = Vec::with_capacity(tree.dofs());
    forward_into(tree, q, &mut poses);
    poses
}

/// As [`forward`], into a buffer.
pub fn forward_into(tree: &JointTree, q: &[f64], poses: &mut Vec<Pose>) {
    poses.clear();
    for (link, &q) in tree.links.iter().zip(q) {
        let parent = link.parent.map_or(tree.base_w, |parent| poses[parent]);
        let mut pose = parent * link.placement * link.kind.motion(q);
        // A product of many unit quaternions drifts from unit length; a pose that did would scale what it moves.
        pose.rotation.renormalize();
        poses.push(pose);
    }
}

/// Velocities of all links at joint speeds `v`.
pub fn velocities(tree: &JointTree, poses: &[Pose], v: &[f64]) -> Vec<LinkVelocity> {
    let mut out = Vec::with_capacity(tree.dofs());
    velocities_into(tree, poses, v, &mut out);
    out
}

/// As [`velocities`], into a buffer.
pub fn velocities_into(tree: &JointTree, poses: &[Pose], v: &[f64], out: &mut Vec<LinkVelocity>) {
    out.clear();
    for (index, link) in tree.links.iter().enumerate() {
        let origin = poses[index].translation.vector;
        let (mut linear, mut angular) = match link.parent {
            Some(parent) => (out[parent].at(&poses[parent], &origin), out[parent].angular),
            None => (Vec3::zeros(), Vec3::zeros()),
        };
        let (push, turn) = joint_velocity(tree, poses, index, &origin);
        linear += push * v[index];
        angular += turn * v[index];
        out.push(LinkVelocity { linear, angular });
    }
}

/// The 6×n matrix from joint speeds to (velocity of the link's origin, angular velocity), world coordinates, linear
/// rows first.
pub fn jacobian(tree: &JointTree, poses: &[Pose], link: usize) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(6, tree.dofs());
    jacobian_into(tree, poses, link, &mut out);
    out
}

/// As [`jacobian`], into a 6×n matrix.
pub fn jacobian_into(tree: &JointTree, poses: &[Pose], link: usize, out: &mut DMatrix<f64>) {
    point_jacobian_into(tree, poses, link, &poses[link].translation.vector, out);
}

/// As [`jacobian`], but of the material point of `link` that is at `p_w` (world, m).
pub fn point_jacobian(tree: &JointTree, poses: &[Pose], link: usize, p_w: &Vec3) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(6, tree.dofs());
    point_jacobian_into(tree, poses, link, p_w, &mut out);
    out
}

/// As [`point_jacobian`], into a 6×n matrix.
pub fn point_jacobian_into(
    tree: &JointTree,
    poses: &[Pose],
    link: usize,
    p_w: &Vec3,
    out: &mut DMatrix<f64>,
) {
    out.fill(0.0);
    let mut at = Some(link);
    while let Some(index) = at {
        let (push, turn) = joint_velocity(tree, poses, index, p_w);
        out.fixed_view_mut::<3, 1>(0, index).copy_from(&push);
        out.fixed_view_mut::<3, 1>(3, index).copy_from(&turn);
        at = tree.links[index].parent;
    }
}

/// What unit speed of joint `index` gives a point at `p_w` of its link: (velocity, angular velocity), world.
pub(super) fn joint_velocity(tree: &JointTree, poses: &[Pose], index: usize, p_w: &Vec3) -> (Vec3, Vec3) {
    match tree.links[index].kind {
        JointKind::Revolute(axis) => {
            let axis = poses[index].rotation * axis.into_inner();
            (axis.cross(&(p_w - poses[index].translation.vector)), axis)
        }
        JointKind::Prismatic(axis) => (poses[index].rotation * axis.into_inner(), Vec3::zeros()),
    }
}
