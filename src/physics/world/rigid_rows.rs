//! Rows between rigid colliders: free bodies, links, prescribed frames and the world.
//!
//! A contact point of two solids is seldom a material point of either (a corner of the one below, the crossing of two edges,
//! the lowest point of a ball), so its tangential spring remembers no anchor but how far the touching *material* has
//! moved: the stretch, which grows with the relative velocity and turns with the second body. At rest it holds as an
//! anchor does, and rolling does not stretch it.

use super::{
    World,
    points::{Meeting, slid},
    sliding::Sliding,
};
use crate::{
    geometry::{Aabb, GroupedAabb, Vec3, overlapping_pairs},
    physics::{
        contact::{ContactPoint, Mover, Part},
        solver::{Endpoint, Patch, Point},
    },
};

/// Steps of approach within which a contact point gets a row.
const AHEAD: f64 = 1.5;

/// Names a contact point of a pair of colliders from step to step.
type Key = (usize, usize, Part, u32);

/// What a contact point of two rigid colliders remembers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grip {
    key: Key,
    /// How far the first collider's material is ahead of the second's, in the second's frame, m.
    stretch: Vec3,
    /// Normal impulse of the last step, N s.
    impulse: f64,
    slipping: bool,
    /// How far the two have slid on each other here since they met, m.
    travel: f64,
}

/// Two colliders close enough to touch within the step: the normals point from `b` to `a`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub a: usize,
    pub b: usize,
    margin: f64,
}

/// What rigid contact needs between steps and within one.
#[derive(Clone, Debug, Default)]
pub(super) struct RigidContacts {
    /// By key, ascending.
    grips: Vec<Grip>,
    /// Keys of the rows of this step and how far they have slid before it (m), in the order of their points.
    rows: Vec<(Key, f64)>,
    pairs: Vec<Pair>,
    found: Vec<(Part, ContactPoint)>,
}

impl World {
    /// Rows of all pairs of rigid colliders that are near each other.
    pub(super) fn rigid_patches(&mut self) {
        let mut contacts = std::mem::take(&mut self.rigid_contacts);
        contacts.rows.clear();
        self.near_pairs(&mut contacts.pairs);
        for &pair in &contacts.pairs {
            let (a, b) = (&self.colliders[pair.a], &self.colliders[pair.b]);
            let (Some(solid_a), Some(solid_b)) = (&a.solid, &b.solid) else { continue };
            contacts.found.clear();
            let (pose_a, pose_b) = (&self.moving[pair.a].pose, &self.moving[pair.b].pose);
            solid_b.meet(pose_b, solid_a, pose_a, pair.margin, &mut contacts.found);
            if contacts.found.is_empty() {
                continue;
            }
            let movers = (a.mover, b.mover);
            let ends = (self.endpoint_of(movers.0), self.endpoint_of(movers.1));
            let first = self.problem.points.len();
            for (part, point) in &contacts.found {
                let key = (pair.a, pair.b, *part, point.feature);
                let at = contacts.grips.binary_search_by_key(&key, |grip| grip.key);
                let grip = at.map_or(Grip::fresh(key), |at| contacts.grips[at]);
                self.push_contact(&pair, point, &grip, &ends);
                contacts.rows.push((key, grip.travel));
            }
            let last = self.problem.points.len();
            self.problem.patches.push(Patch { a: ends.0, b: ends.1, first, last });
        }
        self.rigid_contacts = contacts;
    }

    /// Pairs of colliders on different movers, of which at least one is free to move, that may touch within the step.
    pub(super) fn near_pairs(&self, pairs: &mut Vec<Pair>) {
        pairs.clear();
        let ids: Vec<usize> =
            (0..self.colliders.len()).filter(|&i| self.colliders[i].solid.is_some()).collect();
        let boxes: Vec<GroupedAabb> = ids.iter().map(|&id| self.box_of(id)).collect();
        for (i, j) in overlapping_pairs(&boxes) {
            let (i, j) = (ids[i], ids[j]);
            let (a, b) = if self.is_known(j) { (i, j) } else { (j, i) };
            if self.is_known(a) {
                continue;
            }
            let (ma, mb) = (&self.moving[a], &self.moving[b]);
            // The fastest approach of any point of the smaller one.
            let radius = |id: usize| 0.5 * self.colliders[id].bounds.size().norm();
            let smaller = if radius(a) < radius(b) { a } else { b };
            let middle = self.colliders[smaller].bounds.centre();
            let middle_w = (self.moving[smaller].pose * nalgebra::Point3::from(middle)).coords;
            let speed = (ma.velocity(&middle_w) - mb.velocity(&middle_w)).norm()
                + (ma.angular - mb.angular).norm() * radius(smaller);
            pairs.push(Pair { a, b, margin: self.params.margin.max(AHEAD * self.params.dt * speed) });
        }
    }

    /// Where a collider is or may be soon, and with which others it forms one thing.
    fn box_of(&self, id: usize) -> GroupedAabb {
        let (collider, moving) = (&self.colliders[id], &self.moving[id]);
        let bounds = collider.bounds.transformed(&moving.pose);
        let lever = farthest(&bounds, &moving.origin);
        let speed = moving.linear.norm() + moving.angular.norm() * lever;
        let rigid = self.rigid.len() as u32;
        let group = match (collider.mover, collider.base_of) {
            (Mover::Link { tree, .. }, _) | (_, Some(tree)) => 1 + rigid + tree as u32,
            (Mover::Static | Mover::Kinematic(_), None) => 0,
            (Mover::Rigid(index), None) => 1 + index as u32,
        };
        GroupedAabb { bounds: bounds.loosened(self.params.margin.max(AHEAD * self.params.dt * speed)), group }
    }

    /// Whether a collider's motion is known before the solve.
    fn is_known(&self, id: usize) -> bool {
        match self.colliders[id].mover {
            Mover::Static | Mover::Kinematic(_) => true,
            Mover::Rigid(index) => self.rigid[index].asleep,
            Mover::Link { tree, .. } => self.trees[tree].asleep,
        }
    }

    fn push_contact(&mut self, pair: &Pair, point: &ContactPoint, grip: &Grip, ends: &(Endpoint, Endpoint)) {
        let (a, b) = (&self.colliders[pair.a], &self.colliders[pair.b]);
        let moving = &self.moving[pair.b];
        let meeting = Meeting {
            p: point.p_w,
            normal: point.n_w,
            gap: point.phi,
            area: point.area,
            stretch: moving.pose.rotation * grip.stretch,
            impulse: grip.impulse,
            sliding: grip.slipping,
        };
        let drift = if ends.1 == Endpoint::Known { moving.velocity(&point.p_w) } else { Vec3::zeros() };
        let point = meeting.point(&a.friction.with(&b.friction), &a.layer.in_series(&b.layer));
        self.problem.points.push(Point { drift, ..point });
    }

    /// Updates what the points that touched remember. Pairs of which neither side moves keep theirs.
    pub(super) fn remember_rigid(&mut self) {
        let mut contacts = std::mem::take(&mut self.rigid_contacts);
        contacts.grips.retain(|grip| self.is_known(grip.key.0) && self.is_known(grip.key.1));
        let dt = self.params.dt;
        let points = contacts.rows.iter().zip(&self.problem.points[self.rows.len()..]);
        let sliding = Sliding::of(points.clone().map(|((key, _), point)| ((key.0, key.1), point)));
        for ((key, travel), point) in points {
            if point.normal_impulse <= 0.0 {
                continue;
            }
            let (stretch, excess) = slid(point, dt);
            let kept = if excess > 0.0 { stretch * (1.0 - excess / stretch.norm()) } else { stretch };
            contacts.grips.push(Grip {
                key: *key,
                stretch: self.moving[key.1].pose.rotation.inverse_transform_vector(&kept),
                impulse: point.normal_impulse,
                slipping: sliding.slides((key.0, key.1)),
                travel: travel + excess,
            });
        }
        contacts.grips.sort_unstable_by_key(|grip| grip.key);
        self.rigid_contacts = contacts;
    }

    /// What touched the colliders of a body in the last step: the other colliders' ids.
    pub(super) fn touching<'a>(
        &'a self,
        is_own: impl Fn(Mover) -> bool + 'a,
    ) -> impl Iterator<Item = usize> + 'a {
        let of_body = move |id: usize| is_own(self.colliders[id].mover);
        self.rigid_contacts.grips.iter().filter_map(move |grip| match grip.key {
            (a, b, ..) if of_body(a) => Some(b),
            (a, b, ..) if of_body(b) => Some(a),
            _ => None,
        })
    }
}

impl RigidContacts {
    /// The pairs of colliders (first, second), how far they had slid (m) and the solved points, of those that press.
    pub(super) fn points<'a>(
        &'a self,
        solved: &'a [Point],
    ) -> impl Iterator<Item = ((usize, usize), f64, &'a Point)> {
        let pressing = self.rows.iter().zip(solved).filter(|(_, point)| point.normal_impulse > 0.0);
        pressing.map(|((key, travel), point)| ((key.0, key.1), *travel, point))
    }
}

impl Grip {
    fn fresh(key: Key) -> Self {
        Self { key, stretch: Vec3::zeros(), impulse: 0.0, slipping: false, travel: 0.0 }
    }
}

/// Distance of the farthest corner of a box from a point, m.
fn farthest(bounds: &Aabb, from: &Vec3) -> f64 {
    (bounds.min - from).abs().sup(&(bounds.max - from).abs()).norm()
}
