//! Search for bodies that overlap, to reject impossible initial states.

use super::{SoftBody, World, rigid_contacts::ColliderPair};
use crate::{
    contact::{Collider, CollisionGeometry},
    fem::FemState,
    ids::{ColliderId, ContactPartner, SoftId},
};
use softvt_geometry::{Aabb, Pose, Vec3, convex::Placed};

/// Two bodies that overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Penetration {
    /// The colliders or soft bodies.
    pub bodies: [ContactPartner; 2],
    /// Distance of the deepest point from the other's surface, m.
    pub depth: f64,
}

impl World {
    /// All pairs that overlap by more than `tolerance` (m), of which at least one can move, in the current state.
    pub fn penetrations(&mut self, tolerance: f64) -> Vec<Penetration> {
        self.update_collider_motions();
        let mut found = self.collider_penetrations();
        for (index, soft) in self.soft.iter().enumerate() {
            let id = SoftId::new(index);
            for (at, (collider, motion)) in self.colliders.iter().zip(&self.motions).enumerate() {
                let depth = depth_in_collider(&soft.state, &motion.pose, collider);
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

/// Depth of the deepest sample of a soft body in a collider at `pose` in the world, m.
fn depth_in_collider(body: &FemState, pose: &Pose, collider: &Collider) -> f64 {
    let field = |p: &Vec3| collider.surface.contact(p, &Vec3::zeros(), 0.0).gap;
    depth_in_field(body, pose, &collider.bounds, &field)
}

/// Depth of the deepest sample of a soft body under another's surface, m.
fn depth_in_soft(body: &FemState, other: &SoftBody) -> f64 {
    let Some(surface) = &other.surface else { return 0.0 };
    let field = |p: &Vec3| surface.contact(p, &Vec3::zeros(), 0.0).gap;
    depth_in_field(body, &other.state.mean_pose(), &surface.bounds(), &field)
}

/// Depth of the deepest sample of `body` in a field within `bounds` in the frame `pose`, m; 0 if all are outside.
fn depth_in_field(body: &FemState, pose: &Pose, bounds: &Aabb, field: &dyn Fn(&Vec3) -> f64) -> f64 {
    let mut depth = 0.0;
    for group in &body.model.groups {
        for sample in &body.model.samples[group.first..group.last] {
            let nodes = group.nodes[..group.count].iter().map(|&node| &body.x[node as usize]);
            let p_w = nodes.zip(&sample.weights).map(|(x, w)| x * *w).sum::<Vec3>();
            let p = pose.inverse_transform_point(&p_w.into()).coords;
            if bounds.contains(&p) {
                depth = f64::max(depth, -field(&p));
            }
        }
    }
    depth
}
