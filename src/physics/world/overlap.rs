//! How deep bodies are in each other where they stand, for scenes that cannot be.

use super::{World, rigid_rows::Pair};
use crate::{
    geometry::{Aabb, Pose, Quat, Vec3},
    physics::{contact::Collider, fem::SoftBody},
};

/// Two things that overlap.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlap {
    /// Names of the colliders or soft bodies.
    pub names: [String; 2],
    /// How far the deepest point is under the other's surface, m.
    pub depth: f64,
}

impl World {
    /// All pairs that overlap by more than `tolerance` (m), of which at least one can move, as everything stands now.
    pub fn overlaps(&mut self, tolerance: f64) -> Vec<Overlap> {
        self.place_colliders();
        let mut found = self.solid_overlaps();
        for (index, soft) in self.soft.iter().enumerate() {
            for (id, collider) in self.colliders.iter().enumerate() {
                let depth =
                    sunk(&soft.body, &self.moving[id].pose, &collider.bounds, &|p| field(collider, p));
                found.push(Overlap { names: [soft.name.clone(), collider.name.clone()], depth });
            }
            for other in &self.soft[index + 1..] {
                let depth = soft_depth(&soft.body, other).max(soft_depth(&other.body, soft));
                found.push(Overlap { names: [soft.name.clone(), other.name.clone()], depth });
            }
        }
        found.retain(|overlap| overlap.depth > tolerance);
        found
    }

    fn solid_overlaps(&self) -> Vec<Overlap> {
        let mut pairs = Vec::new();
        self.near_pairs(&mut pairs);
        let overlap = |&Pair { a, b, .. }: &Pair| {
            let (a, b) = (a.min(b), a.max(b));
            let [first, second] = [&self.colliders[a], &self.colliders[b]];
            let (solid_a, solid_b) = (first.solid.as_ref()?, second.solid.as_ref()?);
            let depth = solid_a.depth(&self.moving[a].pose, solid_b, &self.moving[b].pose);
            Some(Overlap { names: [first.name.clone(), second.name.clone()], depth })
        };
        pairs.iter().filter_map(overlap).collect()
    }
}

/// Signed distance of a collider's surface, m.
fn field(collider: &Collider, p: &Vec3) -> f64 {
    collider.surface.contact(p, &Vec3::zeros(), 0.0).phi
}

/// How deep the deepest sample of a soft body is under another's surface, m.
fn soft_depth(body: &SoftBody, other: &super::Soft) -> f64 {
    let Some(surface) = &other.surface else { return 0.0 };
    sunk(body, &object_w(&other.body), &surface.bounds(), &|p| surface.contact(p, &Vec3::zeros(), 0.0).phi)
}

/// Where the object frame of a soft body is, as if it were rigid.
fn object_w(body: &SoftBody) -> Pose {
    let mean = |nodes: &[Vec3]| nodes.iter().sum::<Vec3>() / nodes.len() as f64;
    let turn = Quat::from_matrix(&body.frame);
    Pose::from_parts((mean(&body.x) - turn * mean(&body.rest.mesh.nodes)).into(), turn)
}

/// How deep the deepest sample of `body` is in a field with bounds `bounds` in the frame `pose`, m; 0 if none is.
fn sunk(body: &SoftBody, pose: &Pose, bounds: &Aabb, field: &dyn Fn(&Vec3) -> f64) -> f64 {
    let mut depth = 0.0;
    for group in &body.rest.groups {
        for sample in &body.rest.samples[group.first..group.last] {
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
