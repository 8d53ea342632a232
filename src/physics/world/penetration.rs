//! Search for bodies that overlap, to reject impossible initial states and motions.

use super::{KinematicFrame, SoftBody, World, rigid_contacts::ColliderPair};
use crate::{
    contact::{Collider, CollisionGeometry},
    fem::{FemModel, FemState},
    ids::{BodyId, ColliderId, ContactPartner, SoftId},
};
use softvt_geometry::{Aabb, Pose, Quat, Vec3, convex::Placed};

/// Two bodies that overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Penetration {
    /// The colliders or soft bodies.
    pub bodies: [ContactPartner; 2],
    /// Distance of the deepest point from the other's surface, m.
    pub depth: f64,
}

/// A collider of a kinematic frame that moved through a soft body, or into it, in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// The collider that moved.
    pub collider: ColliderId,
    /// The soft body in its way.
    pub body: SoftId,
    /// Longest way of a corner of the collider's bounds in the step, m.
    pub distance: f64,
    /// Half of the body's thickness, m. Shorter ways are not checked.
    pub limit: f64,
}

/// What a [`Sweep`] is found from: the state before a step.
#[derive(Clone, Debug)]
pub struct SweepStart {
    frames: Vec<KinematicFrame>,
    /// Node positions of each soft body, world, m.
    nodes: Vec<Vec<Vec3>>,
}

impl World {
    /// All pairs that overlap by more than `tolerance` (m), of which at least one can move, in the current state.
    pub fn penetrations(&mut self, tolerance: f64) -> Vec<Penetration> {
        self.update_collider_motions();
        let mut found = self.collider_penetrations();
        for (index, soft) in self.soft.iter().enumerate() {
            let id = SoftId::new(index);
            for (at, (collider, motion)) in self.colliders.iter().zip(&self.motions).enumerate() {
                let depth = depth_in_collider(&soft.state.model, &soft.state.x, &motion.pose, collider);
                found.push(Penetration { bodies: [id.into(), ColliderId::new(at).into()], depth });
            }
            for (at, other) in self.soft.iter().enumerate().skip(index + 1) {
                let depth = depth_in_soft(&soft.state, other).max(depth_in_soft(&other.state, soft));
                found.push(Penetration { bodies: [id.into(), SoftId::new(at).into()], depth });
            }
        }
        found.retain(|penetration| penetration.depth > tolerance);
        found
    }

    /// The state from which [`sweep_since`](Self::sweep_since) finds sweeps of the next step; `None` if no kinematic
    /// collider moves far enough in it.
    pub fn sweep_start(&self) -> Option<SweepStart> {
        let is_far = |collider: &Collider| {
            let BodyId::Kinematic(frame) = collider.parent else { return false };
            let distance = longest_way(self.kinematic(frame), collider);
            self.soft.iter().any(|soft| distance > half_thickness(&soft.state.x))
        };
        self.colliders.iter().any(is_far).then(|| SweepStart {
            frames: self.kinematic.clone(),
            nodes: self.soft.iter().map(|soft| soft.state.x.clone()).collect(),
        })
    }

    /// The first kinematic collider that the step since `start` moved by more than half of the thickness of a soft body
    /// and, on the way, more than `tolerance` (m) deeper into that body: contact acts along the normals at the start of
    /// a step, so that it misses surfaces that are farther than that.
    pub fn sweep_since(&self, start: &SweepStart, tolerance: f64) -> Option<Sweep> {
        /// Poses per limit at which the collider is compared with the body.
        const POSES_PER_LIMIT: f64 = 8.0;
        let sweep = |at: usize, collider: &Collider, body: usize| {
            let BodyId::Kinematic(frame) = collider.parent else { return None };
            let (frame, before) = (&start.frames[frame.index()], &start.nodes[body]);
            let (distance, limit) = (longest_way(frame, collider), half_thickness(before));
            if distance <= limit {
                return None;
            }
            let FemState { model, x: after, .. } = &self.soft[body].state;
            let depth = |share: f64| {
                let x: Vec<Vec3> = before.iter().zip(after).map(|(a, b)| a.lerp(b, share)).collect();
                depth_in_collider(model, &x, &(between(frame, share) * collider.pose_in_parent), collider)
            };
            let count = (POSES_PER_LIMIT * distance / limit).ceil();
            let least = depth(0.0) + tolerance;
            let is_deeper = (1..=count as usize).any(|k| depth(k as f64 / count) > least);
            is_deeper.then(|| Sweep {
                collider: ColliderId::new(at),
                body: SoftId::new(body),
                distance,
                limit,
            })
        };
        let mut colliders = self.colliders.iter().enumerate();
        colliders.find_map(|(at, collider)| (0..self.soft.len()).find_map(|body| sweep(at, collider, body)))
    }

    fn collider_penetrations(&self) -> Vec<Penetration> {
        let mut pairs = Vec::new();
        self.near_pairs(&mut pairs);
        let penetration = |&ColliderPair { a, b, .. }: &ColliderPair| {
            let (a, b) = (a.min(b), a.max(b));
            let placed = |id: ColliderId| {
                let shape = self.collider(id).collision_geometry.as_deref()?;
                Some(Placed { shape, pose: self.motions[id.index()].pose })
            };
            let depth = CollisionGeometry::depth(placed(a)?, placed(b)?);
            Some(Penetration { bodies: [a.into(), b.into()], depth })
        };
        pairs.iter().filter_map(penetration).collect()
    }
}

/// Half of the smallest extent of a body along an axis, m.
fn half_thickness(nodes: &[Vec3]) -> f64 {
    Aabb::from_points(nodes).map_or(0.0, |bounds| 0.5 * bounds.size().min())
}

/// Longest way of a corner of a collider's bounds in the next step of its frame, m.
fn longest_way(frame: &KinematicFrame, collider: &Collider) -> f64 {
    let Aabb { min, max } = collider.bounds;
    let corner = |i: usize| Vec3::from_fn(|axis, _| if i >> axis & 1 == 0 { min[axis] } else { max[axis] });
    let way = |i: usize| {
        let corner = collider.pose_in_parent * nalgebra::Point3::from(corner(i));
        (frame.next * corner - frame.pose * corner).norm()
    };
    (0..8).map(way).fold(0.0, f64::max)
}

/// Pose of a frame after a share (0..=1) of its next step.
fn between(frame: &KinematicFrame, share: f64) -> Pose {
    let KinematicFrame { pose, next } = frame;
    let turn = (next.rotation * pose.rotation.inverse()).scaled_axis();
    let position = pose.translation.vector.lerp(&next.translation.vector, share);
    Pose::from_parts(position.into(), Quat::from_scaled_axis(share * turn) * pose.rotation)
}

/// Depth of the deepest sample of a soft body with nodes at `x` in a collider at `pose` in the world, m.
fn depth_in_collider(model: &FemModel, x: &[Vec3], pose: &Pose, collider: &Collider) -> f64 {
    let field = |p: &Vec3| collider.surface.contact(p, &Vec3::zeros(), 0.0).gap;
    depth_in_field(model, x, pose, &collider.bounds, &field)
}

/// Depth of the deepest sample of a soft body under another's surface, m.
fn depth_in_soft(body: &FemState, other: &SoftBody) -> f64 {
    let Some(surface) = &other.surface else { return 0.0 };
    let field = |p: &Vec3| surface.contact(p, &Vec3::zeros(), 0.0).gap;
    depth_in_field(&body.model, &body.x, &other.state.mean_pose(), &surface.bounds(), &field)
}

/// Depth of the deepest sample of `body` in a field within `bounds` in the frame `pose`, m; 0 if all are outside.
fn depth_in_field(
    model: &FemModel,
    x: &[Vec3],
    pose: &Pose,
    bounds: &Aabb,
    field: &dyn Fn(&Vec3) -> f64,
) -> f64 {
    let mut depth = 0.0;
    for group in &model.groups {
        for sample in &model.samples[group.first..group.last] {
            let nodes = group.nodes[..group.count].iter().map(|&node| &x[node as usize]);
            let p_w = nodes.zip(&sample.weights).map(|(x, w)| x * *w).sum::<Vec3>();
            let p = pose.inverse_transform_point(&p_w.into()).coords;
            if bounds.contains(&p) {
                depth = f64::max(depth, -field(&p));
            }
        }
    }
    depth
}
