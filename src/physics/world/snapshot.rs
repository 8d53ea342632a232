//! Observation of a world: copies of its state, contact forces and energies.

use super::{
    BodyContact, World, contact_points::SpringUpdate, rigid_contacts::PointKey, state::ContactSummary,
};
use crate::{
    fem::rigid_motion,
    ids::{BodyId, ColliderId, ContactPartner, LinkId, RigidId, SoftId},
    joints::{kinetic_energy, potential_energy},
    solver::ContactPoint,
};
use softvt_geometry::{Pose, Vec3};

/// An immutable copy of the state after a step: all that images and tactile sensors are computed from.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldSnapshot {
    /// Step, counted from 1.
    pub step: u64,
    /// Time, s.
    pub time: f64,
    /// Node positions of each soft body, m, world.
    pub nodes: Vec<Vec<Vec3>>,
    /// Object frames of the rigid bodies, world.
    pub rigid: Vec<Pose>,
    /// Joint coordinates of each articulation, rad or m.
    pub joints: Vec<Vec<f64>>,
    /// Link frames of each articulation, world.
    pub links: Vec<Vec<Pose>>,
    /// Contact patches of the requested colliders.
    pub patches: Vec<ContactPatch>,
}

impl WorldSnapshot {
    /// Node positions of a soft body, m, world.
    pub fn soft(&self, id: SoftId) -> &[Vec3] {
        &self.nodes[id.index()]
    }

    /// Object frame of a rigid body, world.
    pub fn rigid(&self, id: RigidId) -> &Pose {
        &self.rigid[id.index()]
    }

    /// Link frame, world.
    pub fn link(&self, id: LinkId) -> &Pose {
        &self.links[id.articulation.index()][id.index]
    }
}

/// All contacts of one collider, in the collider's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPatch {
    /// Collider to which the points belong.
    pub collider: ColliderId,
    /// Its points with a normal impulse.
    pub points: Vec<PatchPoint>,
}

/// The nodes of a soft body that carry one of its contact samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleSupport {
    /// Sample group of the body: a face or an element of its mesh.
    pub group: usize,
    /// Weights of the group's nodes.
    pub weights: [f64; 8],
}

/// One point of a contact patch. Tractions are means over the step.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchPoint {
    /// The surface that the collider touches.
    pub partner: ContactPartner,
    /// The sample of the other side, if that is a soft body.
    pub face: Option<SampleSupport>,
    /// Position in the collider's frame, m.
    pub p_p: Vec3,
    /// Area that the point represents, m², as far as the collider covers it.
    pub area: f64,
    /// Gap, m; negative is overlap.
    pub gap: f64,
    /// Unit normal out of the collider, in its frame.
    pub normal_p: Vec3,
    /// Normal traction, Pa.
    pub pressure: f64,
    /// Shear traction on the other side, in the collider's frame, Pa.
    pub shear_p: Vec3,
    /// Friction coefficient of the pair in this step: dynamic if the two slide on each other, else static.
    pub mu: f64,
    /// True if friction is at its bound.
    pub is_slipping: bool,
}

/// A point of the patch of a collider.
#[derive(Clone, Debug)]
pub(super) struct ColliderPoint {
    pub collider: ColliderId,
    /// Its identity from step to step, if the other side is a collider.
    pub key: Option<PointKey>,
    pub point: PatchPoint,
}

/// Energies of a world, J. Those of soft bodies are at the time of their velocities: with average acceleration, the
/// middle of the last step or part of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy {
    /// Kinetic energy of all bodies, J.
    pub kinetic: f64,
    /// Elastic, of soft bodies.
    pub elastic: f64,
    /// Gravitational, zero at the world's origin.
    pub potential: f64,
}

impl Energy {
    /// Sum of the three, J.
    pub fn total(&self) -> f64 {
        self.kinetic + self.elastic + self.potential
    }
}

/// A solved point as one of its two sides experiences it.
#[derive(Clone, Copy)]
struct SidePoint<'a> {
    point: &'a ContactPoint,
    /// Distance slipped before this step, m.
    slip_distance: f64,
    /// 1 for the side that the normal points to, −1 for the other.
    sign: f64,
    dt: f64,
}

impl World {
    /// A copy of the state, with the contact patches of `colliders`.
    pub fn snapshot(&self, colliders: &[ColliderId]) -> WorldSnapshot {
        WorldSnapshot {
            step: self.step,
            time: self.time(),
            nodes: self.soft.iter().map(|s| s.state.x.clone()).collect(),
            rigid: self.rigid.iter().map(|r| r.state.object_w()).collect(),
            joints: self.articulations.iter().map(|a| a.state.q.as_slice().to_vec()).collect(),
            links: self.articulations.iter().map(|a| a.poses.clone()).collect(),
            patches: colliders.iter().map(|&id| self.patch(id)).collect(),
        }
    }

    /// Contact patch of a collider in the last step; with a body that sleeps, in the last step in which it was awake.
    pub fn patch(&self, collider: ColliderId) -> ContactPatch {
        let mut points = match self.means.points() {
            [] => self.solved_points(|own, _| own == collider),
            means => means.iter().filter(|own| own.collider == collider).cloned().collect(),
        };
        points.retain(|own| !self.are_resting(collider, own.point.partner));
        let rests =
            |own: &&ColliderPoint| own.collider == collider && self.are_resting(collider, own.point.partner);
        points.extend(self.resting.iter().filter(rests).cloned());
        ContactPatch { collider, points: points.into_iter().map(|own| own.point).collect() }
    }

    /// True if neither side of a contact is solved for.
    pub(super) fn are_resting(&self, collider: ColliderId, partner: ContactPartner) -> bool {
        let partner = match partner {
            ContactPartner::Collider(id) => self.collider(id).parent,
            ContactPartner::Soft(id) => id.into(),
        };
        self.is_known(self.collider(collider).parent) && self.is_known(partner)
    }

    /// The solved points of colliders that press, of each pair of collider and partner that is `wanted`.
    pub(super) fn solved_points(
        &self,
        wanted: impl Fn(ColliderId, ContactPartner) -> bool,
    ) -> Vec<ColliderPoint> {
        let (soft, solid) = self.problem.points.split_at(self.rows.len().min(self.problem.points.len()));
        let mut points = Vec::new();
        for (row, point) in self.rows.iter().zip(soft) {
            let (ContactPartner::Collider(own), partner) = (row.partner, row.soft.into()) else { continue };
            if point.normal_impulse > 0.0 && wanted(own, partner) {
                let model = &self.soft(row.soft).state.model;
                let area = model.samples[row.sample].surface.area * row.coverage;
                let face = SampleSupport { group: row.group, weights: point.weights_a };
                let point = self.patch_point(own, partner, Some(face), point, 1.0, area);
                points.push(ColliderPoint { collider: own, key: None, point });
            }
        }
        for solved in self.rigid_contacts.pressing(solid) {
            let PointKey { a, b, .. } = solved.key;
            for (own, other, sign) in [(a, b, -1.0), (b, a, 1.0)] {
                if wanted(own, other.into()) {
                    let point = self.patch_point(own, other.into(), None, solved.point, sign, solved.area);
                    points.push(ColliderPoint { collider: own, key: Some(solved.key), point });
                }
            }
        }
        points
    }

    /// A solved point in the frame of a collider; `sign` is 1 if its impulse acts on `partner`, −1 if on the collider.
    fn patch_point(
        &self,
        collider: ColliderId,
        partner: ContactPartner,
        face: Option<SampleSupport>,
        point: &ContactPoint,
        sign: f64,
        area: f64,
    ) -> PatchPoint {
        let pose = &self.motions[collider.index()].pose;
        let share = self.problem.dt * area;
        PatchPoint {
            partner,
            face,
            p_p: pose.inverse_transform_point(&point.p.into()).coords,
            area,
            gap: point.gap,
            normal_p: pose.rotation.inverse_transform_vector(&point.normal) * sign,
            pressure: point.normal_impulse / share,
            shear_p: pose.rotation.inverse_transform_vector(&point.shear_impulse) * (sign / share),
            mu: point.mu,
            is_slipping: point.is_slipping,
        }
    }

    /// Contact of `body` with `partner` in the last step in which the body was awake; zero without a contact.
    ///
    /// Contacts are recorded for free bodies only: that of anything else is zero. [`patch`](Self::patch) has those of
    /// a collider with bodies of every kind.
    pub fn contact(&self, body: impl Into<BodyId>, partner: impl Into<ContactPartner>) -> ContactSummary {
        let partner = partner.into();
        let found = self.contacts(body).iter().find(|contact| contact.partner == partner);
        found.map_or(ContactSummary::default(), |contact| contact.summary)
    }

    /// Contact of a soft or free rigid `body` with another body: with all of its colliders, or with the surface of a
    /// soft one. The other body may be [`BodyId::World`], for all fixed solids. Zero for a `body` of another kind.
    pub fn contact_with(&self, body: impl Into<BodyId>, other: impl Into<BodyId>) -> ContactSummary {
        let other = other.into();
        let belongs = |partner: ContactPartner| match partner {
            ContactPartner::Collider(id) => self.collider(id).parent == other,
            ContactPartner::Soft(id) => other == BodyId::Soft(id),
        };
        let of_other = self.contacts(body).iter().filter(|contact| belongs(contact.partner));
        of_other.map(|contact| contact.summary).fold(ContactSummary::default(), ContactSummary::joined)
    }

    /// All contacts of `body` in the last step in which it was awake; empty for anything but free bodies.
    pub fn contacts(&self, body: impl Into<BodyId>) -> &[BodyContact] {
        match body.into() {
            BodyId::Soft(id) => &self.soft(id).contacts,
            BodyId::Rigid(id) => &self.rigid(id).contacts,
            BodyId::World | BodyId::Kinematic(_) | BodyId::Link(_) => &[],
        }
    }

    /// Sums up the solved points for each free body that is awake; a sleeping one keeps its last contacts.
    pub(super) fn record_contacts(&mut self) {
        self.soft.iter_mut().filter(|s| !s.sleep.is_asleep).for_each(|s| s.contacts.clear());
        self.rigid.iter_mut().filter(|r| !r.sleep.is_asleep).for_each(|r| r.contacts.clear());
        let dt = self.params.dt;
        let Self { soft, rigid, rows, problem, colliders, rigid_contacts, .. } = self;
        let mut record = |body: BodyId, partner: ContactPartner, point: SidePoint| {
            let (is_asleep, contacts) = match body {
                BodyId::Soft(id) => (soft[id.index()].is_asleep(), &mut soft[id.index()].contacts),
                BodyId::Rigid(id) => (rigid[id.index()].is_asleep(), &mut rigid[id.index()].contacts),
                BodyId::World | BodyId::Kinematic(_) | BodyId::Link(_) => return,
            };
            if !is_asleep {
                add_point(contacts, partner, point);
            }
        };
        for (row, point) in rows.iter().zip(&problem.points).filter(|(_, point)| point.normal_impulse > 0.0) {
            let on = |sign: f64| SidePoint { point, slip_distance: row.slip_distance, sign, dt };
            record(row.soft.into(), row.partner, on(1.0));
            let other = match row.partner {
                ContactPartner::Soft(other) => other.into(),
                ContactPartner::Collider(id) => colliders[id.index()].parent,
            };
            record(other, row.soft.into(), on(-1.0));
        }
        for solved in rigid_contacts.pressing(&problem.points[rows.len()..]) {
            let PointKey { a, b, .. } = solved.key;
            for (side, other, sign) in [(a, b, 1.0), (b, a, -1.0)] {
                let point = SidePoint { point: solved.point, slip_distance: solved.slip_distance, sign, dt };
                record(colliders[side.index()].parent, other.into(), point);
            }
        }
    }

    /// Energies of soft bodies, rigid bodies, and the articulations on which gravity acts.
    pub fn energy(&self) -> Energy {
        let since = if self.params.average_acceleration { 0.5 * self.last_dt } else { 0.0 };
        let mut energy = Energy { kinetic: 0.0, elastic: 0.0, potential: 0.0 };
        for soft in &self.soft {
            let mut then = soft.state.clone();
            rigid_motion::advance(&mut then, -since);
            then.update_elastic(0.0);
            energy.kinetic += soft.state.kinetic_energy();
            energy.elastic += then.elastic_energy;
            energy.potential -= then.model.total_mass() * self.gravity.dot(&then.centre());
        }
        for rigid in &self.rigid {
            energy.kinetic += rigid.state.kinetic_energy();
            energy.potential += rigid.state.potential_energy(&self.gravity);
        }
        for articulation in self.articulations.iter().filter(|articulation| articulation.has_gravity) {
            let (tree, poses) = (&articulation.tree, &articulation.poses);
            energy.kinetic += kinetic_energy(tree, poses, articulation.state.v.as_slice());
            energy.potential += potential_energy(tree, poses, &self.gravity);
        }
        energy
    }
}

/// Adds a point to the contact of a body with `partner`.
fn add_point(contacts: &mut Vec<BodyContact>, partner: ContactPartner, side: SidePoint) {
    let at = contacts.iter().position(|contact| contact.partner == partner).unwrap_or_else(|| {
        contacts.push(BodyContact { partner, summary: ContactSummary::default() });
        contacts.len() - 1
    });
    let SidePoint { point, slip_distance, sign, dt } = side;
    let sum = &mut contacts[at].summary;
    let force = point.normal_impulse / dt;
    sum.points += 1;
    sum.slipping_points += usize::from(point.is_slipping);
    let mean =
        |before: f64, value: f64| (before * sum.normal_force + value * force) / (sum.normal_force + force);
    (sum.slip_distance, sum.slip_speed) = (
        mean(sum.slip_distance, slip_distance),
        mean(sum.slip_speed, SpringUpdate::new(point, dt).slipped / dt),
    );
    sum.normal_force += force;
    sum.force_w += sign * (point.normal * point.normal_impulse + point.shear_impulse) / dt;
    sum.friction_capacity += point.mu * force;
}
