//! Contacts between colliders: of rigid bodies, links, kinematic frames and the world.
//!
//! A contact point of two solids is seldom a material point of either (a corner of the lower one, the crossing of two
//! edges, the lowest point of a ball). So its tangential spring has no anchor, but stores how far the touching
//! *material* has moved: the stretch, which grows with the relative velocity and turns with the second body. At rest
//! it holds as an anchor does, and rolling does not stretch it.

use super::{
    World,
    contact_points::{SlidingPairs, SpringUpdate, SurfaceContact},
};
use crate::{
    contact::{CollisionGeometry, ContactPairId, DetectionLimits, ManifoldPoint},
    ids::{BodyId, ColliderId, ContactPartner, RigidId},
    solver::{ContactCluster, ContactPoint, Endpoint},
};
use softvt_geometry::{Aabb, GroupedAabb, Vec3, convex::Placed, overlapping_pairs};

/// Identity of a contact point of two colliders from step to step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct PointKey {
    pub a: ColliderId,
    pub b: ColliderId,
    pair: ContactPairId,
    feature: u32,
}

impl PointKey {
    /// The pair of surfaces.
    fn surfaces(&self) -> (ColliderId, ColliderId) {
        (self.a, self.b)
    }
}

/// State of a contact point of two colliders between steps.
#[derive(Clone, Copy, Debug)]
struct PointState {
    key: PointKey,
    /// Distance by which the first collider's material is ahead of the second's, in the second's frame, m.
    stretch: Vec3,
    /// Normal impulse of the last step, N s.
    normal_impulse: f64,
    /// Tangential impulse of the last step on the first collider, in the second's frame, N s.
    shear_impulse: Vec3,
    is_sliding: bool,
    /// Distance slipped since first contact, m.
    slip_distance: f64,
}

impl PointState {
    fn first(key: PointKey) -> Self {
        Self {
            key,
            stretch: Vec3::zeros(),
            normal_impulse: 0.0,
            shear_impulse: Vec3::zeros(),
            is_sliding: false,
            slip_distance: 0.0,
        }
    }
}

/// A contact point of the current problem.
#[derive(Clone, Copy, Debug)]
struct RigidRow {
    key: PointKey,
    /// Area that the point represents, m².
    area: f64,
    /// Motion of the rest position of the springs, m, world.
    rest: Vec3,
    /// Distance slipped before this step, m.
    slip_distance: f64,
}

/// Two colliders close enough to touch within the step; normals point from `b` to `a`.
#[derive(Clone, Copy, Debug)]
pub(super) struct ColliderPair {
    pub a: ColliderId,
    pub b: ColliderId,
    /// Gap below which contact points are created, m.
    margin: f64,
}

/// Contacts between colliders: state between steps, and rows and buffers of the current one.
#[derive(Clone, Debug, Default)]
pub(super) struct RigidContacts {
    /// States of the points, ascending by key.
    states: Vec<PointState>,
    /// In the order of their points, which follow those of soft bodies.
    rows: Vec<RigidRow>,
    pairs: Vec<ColliderPair>,
    found: Vec<(ContactPairId, ManifoldPoint)>,
}

/// A solved point of two colliders that presses.
pub(super) struct PressingPoint<'a> {
    pub key: PointKey,
    /// Area that the point represents, m².
    pub area: f64,
    /// Distance slipped before this step, m.
    pub slip_distance: f64,
    pub point: &'a ContactPoint,
}

impl World {
    /// Finds the pairs of colliders of this step that may touch.
    pub(super) fn find_rigid_pairs(&mut self) {
        let mut pairs = std::mem::take(&mut self.rigid_contacts.pairs);
        self.near_pairs(&mut pairs);
        self.rigid_contacts.pairs = pairs;
    }

    /// Adds the contacts of all pairs of colliders near each other to the problem.
    pub(super) fn add_rigid_contacts(&mut self) {
        let mut contacts = std::mem::take(&mut self.rigid_contacts);
        contacts.rows.clear();
        for &ColliderPair { a, b, margin } in &contacts.pairs {
            let (first, second) = (self.collider(a), self.collider(b));
            let (Some(solid_a), Some(solid_b)) = (&first.collision_geometry, &second.collision_geometry)
            else {
                continue;
            };
            contacts.found.clear();
            let placed = |shape, id: ColliderId| Placed { shape, pose: self.motions[id.index()].pose };
            let (placed_a, placed_b) = (placed(&**solid_a, a), placed(&**solid_b, b));
            CollisionGeometry::find_contacts(placed_b, placed_a, margin, &mut contacts.found);
            if contacts.found.is_empty() {
                continue;
            }
            let parents = (first.parent, second.parent);
            let (end_a, end_b) = (self.body_endpoint(parents.0), self.body_endpoint(parents.1));
            let first = self.problem.points.len();
            for (pair, point) in &contacts.found {
                let key = PointKey { a, b, pair: *pair, feature: point.feature };
                let at = contacts.states.binary_search_by_key(&key, |state| state.key);
                let known = at.ok().map(|at| contacts.states[at]);
                let state = known.unwrap_or(PointState::first(key));
                let rest = self.push_rigid(point, &state, known.is_none(), end_b == Endpoint::Known);
                contacts.rows.push(RigidRow {
                    key,
                    area: point.area,
                    rest,
                    slip_distance: state.slip_distance,
                });
            }
            let last = self.problem.points.len();
            self.problem.clusters.push(ContactCluster { a: end_a, b: end_b, first, last });
        }
        self.rigid_contacts = contacts;
    }

    /// Finds the pairs of colliders on different bodies, of which at least one is free to move, that may
    /// touch within the step.
    pub(super) fn near_pairs(&self, pairs: &mut Vec<ColliderPair>) {
        pairs.clear();
        let ids: Vec<ColliderId> = (0..self.colliders.len())
            .filter(|&i| self.colliders[i].collision_geometry.is_some())
            .map(ColliderId::new)
            .collect();
        let boxes: Vec<GroupedAabb> = ids.iter().map(|&id| self.swept_box(id)).collect();
        for (i, j) in overlapping_pairs(&boxes) {
            let (i, j) = (ids[i], ids[j]);
            let is_known = |id: ColliderId| self.is_known(self.collider(id).parent);
            let (a, b) = if is_known(j) { (i, j) } else { (j, i) };
            if is_known(a) {
                continue;
            }
            let (motion_a, motion_b) = (&self.motions[a.index()], &self.motions[b.index()]);
            // The fastest approach of any point of the smaller one.
            let radius = |id: ColliderId| 0.5 * self.collider(id).bounds.size().norm();
            let smaller = if radius(a) < radius(b) { a } else { b };
            let centre = self.collider(smaller).bounds.centre();
            let centre_w = (self.motions[smaller.index()].pose * nalgebra::Point3::from(centre)).coords;
            let speed = (motion_a.velocity(&centre_w) - motion_b.velocity(&centre_w)).norm()
                + (motion_a.angular - motion_b.angular).norm() * radius(smaller);
            pairs.push(ColliderPair { a, b, margin: self.contact_margin(speed) });
        }
    }

    /// Gap below which two surfaces that approach at `speed` (m/s) may touch within the step, m.
    pub(super) fn contact_margin(&self, speed: f64) -> f64 {
        self.params.margin.max(DetectionLimits::STEPS_AHEAD * self.params.dt * speed)
    }

    /// Bounds of a collider over the step. Colliders of one group belong to one body and never touch each other.
    pub(super) fn swept_box(&self, id: ColliderId) -> GroupedAabb {
        let (collider, motion) = (self.collider(id), &self.motions[id.index()]);
        let bounds = collider.bounds.transformed(&motion.pose);
        let lever = farthest_corner(&bounds, &motion.origin);
        let speed = motion.linear.norm() + motion.angular.norm() * lever;
        let rigid = self.rigid.len() as u32;
        let group = match (collider.parent, collider.base_of) {
            (BodyId::Link(link), _) => 1 + rigid + link.articulation.index() as u32,
            (_, Some(articulation)) => 1 + rigid + articulation.index() as u32,
            (BodyId::World | BodyId::Kinematic(_) | BodyId::Soft(_), None) => 0,
            (BodyId::Rigid(id), None) => 1 + id.index() as u32,
        };
        GroupedAabb { bounds: bounds.loosened(self.contact_margin(speed)), group }
    }

    /// Adds a contact, and returns the motion of the rest position of its springs, m, world.
    fn push_rigid(
        &mut self,
        point: &ManifoldPoint,
        state: &PointState,
        is_first: bool,
        is_b_known: bool,
    ) -> Vec3 {
        let motion = &self.motions[state.key.b.index()];
        let traction = || {
            let impulse = motion.pose.rotation * state.shear_impulse + point.normal_w * state.normal_impulse;
            impulse * (self.growth() / (self.params.dt * point.area))
        };
        let (stiffness_a, rest_a) =
            self.surface_at(state.key.a, &point.position_w, &point.normal_w, traction);
        let (stiffness_b, rest_b) =
            self.surface_at(state.key.b, &point.position_w, &point.normal_w, || -traction());
        let rest = rest_b - rest_a;
        let (a, b) = (self.collider(state.key.a), self.collider(state.key.b));
        let surface = SurfaceContact {
            p: point.position_w,
            normal: point.normal_w,
            gap: point.gap,
            area: point.area,
            // Surfaces are touched where they have moved to.
            stretch: if is_first { rest } else { motion.pose.rotation * state.stretch },
            rest,
            previous_normal_impulse: state.normal_impulse * self.growth(),
            is_sliding: state.is_sliding,
        };
        let drift = if is_b_known { motion.velocity(&point.position_w) } else { Vec3::zeros() };
        // A rigid surface does not yield to a layer.
        let stiffness = match (&a.layer, &b.layer) {
            (Some(_), None) => stiffness_a,
            (None, Some(_)) => stiffness_b,
            _ => stiffness_a.in_series(&stiffness_b),
        };
        let solved = surface.contact_point(&a.friction.with(&b.friction), &stiffness);
        self.problem.points.push(ContactPoint { drift, ..solved });
        rest
    }

    /// Updates the state of the points that touched. Pairs of which neither side moves keep theirs.
    pub(super) fn update_rigid_history(&mut self) {
        let mut contacts = std::mem::take(&mut self.rigid_contacts);
        let is_known = |id: ColliderId| self.is_known(self.collider(id).parent);
        contacts.states.retain(|state| is_known(state.key.a) && is_known(state.key.b));
        let dt = self.params.dt;
        let points = contacts.rows.iter().zip(&self.problem.points[self.rows.len()..]);
        let sliding = SlidingPairs::new(points.clone().map(|(row, point)| (row.key.surfaces(), point)));
        for (row, point) in points {
            if point.normal_impulse <= 0.0 {
                continue;
            }
            let SpringUpdate { stretch, slipped } = SpringUpdate::new(point, dt);
            let kept =
                if slipped > 0.0 { stretch * (1.0 - slipped / stretch.norm()) } else { stretch } + row.rest;
            let rotation = &self.motions[row.key.b.index()].pose.rotation;
            contacts.states.push(PointState {
                key: row.key,
                stretch: rotation.inverse_transform_vector(&kept),
                normal_impulse: point.normal_impulse,
                shear_impulse: rotation.inverse_transform_vector(&point.shear_impulse),
                is_sliding: sliding.contains(row.key.surfaces()),
                slip_distance: row.slip_distance + slipped,
            });
        }
        contacts.states.sort_unstable_by_key(|state| state.key);
        self.rigid_contacts = contacts;
    }

    /// True if a rigid body touched anything in the last step.
    pub(super) fn is_touching(&self, id: RigidId) -> bool {
        let is_own = |collider: ColliderId| self.collider(collider).parent == id.into();
        let is_own_partner = |partner| matches!(partner, ContactPartner::Collider(id) if is_own(id));
        self.rigid_contacts.states.iter().any(|state| is_own(state.key.a) || is_own(state.key.b))
            || self.rows.iter().any(|row| is_own_partner(row.partner))
    }
}

impl RigidContacts {
    /// The pairs of colliders that may touch in this step.
    pub(super) fn pairs(&self) -> &[ColliderPair] {
        &self.pairs
    }

    /// The solved points that press; `solved` are the problem's points between colliders.
    pub(super) fn pressing<'a>(
        &'a self,
        solved: &'a [ContactPoint],
    ) -> impl Iterator<Item = PressingPoint<'a>> {
        let pressing = self.rows.iter().zip(solved).filter(|(_, point)| point.normal_impulse > 0.0);
        pressing.map(|(row, point)| PressingPoint {
            key: row.key,
            area: row.area,
            slip_distance: row.slip_distance,
            point,
        })
    }
}

/// Distance of the farthest corner of a box from a point, m.
fn farthest_corner(bounds: &Aabb, from: &Vec3) -> f64 {
    (bounds.min - from).abs().sup(&(bounds.max - from).abs()).norm()
}
