//! Contacts of soft bodies: their samples against colliders and against the deformed surfaces of other soft bodies.

use super::{
    World,
    contact_points::{SlidingPairs, SpringUpdate, SurfaceContact},
};
use crate::{
    contact::{
        BodyBounds, ContactCandidate, ContactRecord, DeformedSdf, SdfCandidate, detect, detect_soft,
        may_touch,
    },
    fem::FemState,
    ids::{ColliderId, ContactPartner, SoftId},
    solver::{ContactCluster, ContactPoint, Endpoint},
};
use softvt_geometry::{Mat3, Vec3};

/// Candidates of a step, in the order in which they become contact points.
#[derive(Clone, Debug, Default)]
pub(super) struct Candidates {
    collider: Vec<SoftColliderCandidate>,
    soft: Vec<SoftSoftCandidate>,
}

impl Candidates {
    /// True if a soft body may touch anything in this step.
    pub(super) fn involves(&self, id: SoftId) -> bool {
        self.pairs().any(|(soft, partner)| soft == id || partner == id.into())
    }

    /// The pairs of surfaces that may touch in this step, once per point.
    pub(super) fn pairs(&self) -> impl Iterator<Item = (SoftId, ContactPartner)> {
        let with_colliders = self.collider.iter().map(|c| (c.soft, c.collider.into()));
        with_colliders.chain(self.soft.iter().map(|c| (c.soft, c.other.into())))
    }
}

/// A sample of a soft body near a collider.
#[derive(Clone, Copy, Debug)]
struct SoftColliderCandidate {
    soft: SoftId,
    collider: ColliderId,
    candidate: ContactCandidate,
}

/// A sample of soft body `soft` near soft body `other`.
#[derive(Clone, Copy, Debug)]
struct SoftSoftCandidate {
    soft: SoftId,
    other: SoftId,
    candidate: SdfCandidate,
}

/// History of a contact point of a soft body during a step, parallel to the problem's points.
#[derive(Clone, Copy, Debug)]
pub(super) struct SoftRow {
    pub soft: SoftId,
    /// Sample group of the body.
    pub group: usize,
    /// Sample of the body.
    pub sample: usize,
    /// Covered share of the sample's area, 0..=1.
    pub coverage: f64,
    pub partner: ContactPartner,
    /// Distance slipped before this step, m.
    pub slip_distance: f64,
    anchor: Vec3,
    /// Maps small vectors of the world to the frame of the anchor.
    to_anchor: Mat3,
}

impl SoftRow {
    /// The pair of surfaces.
    fn pair(&self) -> (SoftId, ContactPartner) {
        (self.soft, self.partner)
    }
}

impl World {
    /// Advances the clock of each soft body that is awake.
    pub(super) fn count_steps_awake(&mut self) {
        self.soft.iter_mut().filter(|soft| !soft.is_asleep()).for_each(|soft| soft.steps_awake += 1);
    }

    /// Largest speed at which a sample of a soft body approaches what it will reach in this step, m/s. Of another soft
    /// body, the motion of the centre counts.
    pub(super) fn approach(&self, id: SoftId) -> f64 {
        let body = &self.soft(id).state;
        let speed = |group: usize, sample: usize, normal: &Vec3, gap: f64, other: &Vec3| {
            let speed = normal.dot(&(other - body.sample_velocity(group, sample)));
            if speed * self.params.dt > gap { speed } else { 0.0 }
        };
        let solid = self.candidates.collider.iter().filter(|found| found.soft == id).map(|found| {
            let (at, motion) = (&found.candidate, &self.motions[found.collider.index()]);
            speed(at.group, at.sample, &at.normal, at.gap, &motion.velocity(&at.p))
        });
        let soft = self.candidates.soft.iter().filter(|found| found.soft == id).map(|found| {
            let at = &found.candidate;
            speed(
                at.group,
                at.sample,
                &at.contact.normal,
                at.contact.gap,
                &self.soft(found.other).state.velocity(),
            )
        });
        solid.chain(soft).fold(0.0, f64::max)
    }

    /// Keeps the candidates that may touch in a step of the present length, after a search for those of a longer one.
    pub(super) fn shorten_candidates(&mut self) {
        let limits = self.detection_limits();
        let mut candidates = std::mem::take(&mut self.candidates);
        let may_touch = |soft: SoftId, group, sample, normal: &Vec3, gap: f64, other: &Vec3| {
            let own = self.soft(soft).state.sample_velocity(group, sample);
            gap < limits.margin.max(limits.approach_distance(normal.dot(&(other - own))))
        };
        candidates.collider.retain(|found| {
            let (at, motion) = (&found.candidate, &self.motions[found.collider.index()]);
            may_touch(found.soft, at.group, at.sample, &at.normal, at.gap, &motion.velocity(&at.p))
        });
        candidates.soft.retain(|found| {
            let (at, other) = (&found.candidate, &self.soft(found.other).state);
            let nodes = &other.model.mesh.elements[at.contact.element as usize];
            let other = nodes.iter().zip(at.contact.weights).map(|(&node, w)| other.v[node as usize] * w);
            let (normal, gap) = (&at.contact.normal, at.contact.gap);
            may_touch(found.soft, at.group, at.sample, normal, gap, &other.sum())
        });
        self.candidates = candidates;
    }

    /// Finds samples near colliders, and marks the nodes that must be retained in the reduced systems.
    pub(super) fn detect_soft_collider(&mut self) {
        self.candidates.collider.clear();
        let limits = self.detection_limits();
        let (mut found, mut bounds) = (Vec::new(), BodyBounds::default());
        let attachments = &self.attachments;
        for (index, soft) in self.soft.iter_mut().enumerate().filter(|(_, s)| !s.sleep.is_asleep) {
            let (system, body, step) = (&mut soft.system, &soft.state, soft.steps_awake);
            bounds.update(body);
            for (id, (collider, motion)) in self.colliders.iter().zip(&self.motions).enumerate() {
                found.clear();
                let mut mark = |group: usize| {
                    let group = &body.model.groups[group];
                    group.nodes[..group.count].iter().for_each(|&node| system.mark(node, step));
                };
                detect(body, &bounds, collider, motion, limits, &mut found, &mut mark);
                let (soft, parent) = (SoftId::new(index), collider.parent);
                let attached = attachments.iter().filter(|to| to.is_between(soft, parent));
                attached.for_each(|to| found.retain(|candidate| !to.has_group(candidate.group)));
                found.iter().for_each(|candidate| mark(candidate.group));
                let collider = ColliderId::new(id);
                let found =
                    found.iter().map(|&candidate| SoftColliderCandidate { soft, collider, candidate });
                self.candidates.collider.extend(found);
            }
        }
    }

    /// Finds samples near other soft bodies, and marks the nodes of both.
    pub(super) fn detect_soft_soft(&mut self) {
        let mut candidates = std::mem::take(&mut self.candidates.soft);
        candidates.clear();
        let limits = self.detection_limits();
        let (mut found, mut marked) = (Vec::new(), Vec::new());
        for other in self.soft_ids() {
            let target = self.soft(other);
            let Some(surface) = &target.surface else { continue };
            let mut field = None;
            for id in self.soft_ids() {
                let soft = self.soft(id);
                let is_still = soft.is_asleep() && target.is_asleep();
                if id == other || is_still || !may_touch(&soft.state, &target.state, limits) {
                    continue;
                }
                let field = field.get_or_insert_with(|| DeformedSdf::new(&target.state, &**surface));
                found.clear();
                let elements = &target.state.model.mesh.elements;
                detect_soft(&soft.state, field, limits, &mut found, &mut |group, element| {
                    let group = &soft.state.model.groups[group];
                    marked.extend(group.nodes[..group.count].iter().map(|&node| (id, node)));
                    marked.extend(elements[element as usize].iter().map(|&node| (other, node)));
                });
                // Points between the same endpoints form one cluster.
                found.sort_by_key(|found| (found.group, found.contact.element));
                let found = found.iter().map(|&candidate| SoftSoftCandidate { soft: id, other, candidate });
                candidates.extend(found);
            }
        }
        self.candidates.soft = candidates;
        for (id, node) in marked {
            let soft = &mut self.soft[id.index()];
            if !soft.sleep.is_asleep {
                soft.system.mark(node, soft.steps_awake);
            }
        }
    }

    /// Adds the contacts found by [`World::detect_soft_collider`] to the problem.
    pub(super) fn add_soft_collider_contacts(&mut self) {
        let candidates = std::mem::take(&mut self.candidates.collider);
        let key = |c: &SoftColliderCandidate| (c.soft, c.collider, c.candidate.group);
        for same in candidates.chunk_by(|a, b| key(a) == key(b)) {
            let (soft, collider, group) = key(&same[0]);
            let Some(block) = self.blocks.soft(soft) else { break };
            let a = self.group_endpoint(soft, group, block);
            let b = self.body_endpoint(self.collider(collider).parent);
            let first = self.problem.points.len();
            let pose = self.motions[collider.index()].pose;
            let to_anchor = pose.rotation.inverse().to_rotation_matrix().into_inner();
            same.iter().for_each(|candidate| self.push_soft_collider(candidate, &b, &to_anchor));
            self.problem.clusters.push(ContactCluster { a, b, first, last: self.problem.points.len() });
        }
        self.candidates.collider = candidates;
    }

    /// Adds one contact; `to_anchor` turns the world into the collider's frame.
    fn push_soft_collider(&mut self, found: &SoftColliderCandidate, b: &Endpoint, to_anchor: &Mat3) {
        let SoftColliderCandidate { soft: id, collider, candidate } = *found;
        let partner = ContactPartner::Collider(collider);
        let (soft, motion) = (self.soft(id), &self.motions[collider.index()]);
        let sample = &soft.state.model.samples[candidate.sample];
        let p_in_collider = motion.pose.inverse_transform_point(&candidate.p.into()).coords;
        let known = soft.history.get(candidate.sample, partner, soft.steps_awake).copied();
        let mut record = known.unwrap_or(ContactRecord::first(partner, p_in_collider));
        let area = sample.surface.area * candidate.coverage;
        let traction = || {
            let impulse =
                motion.pose.rotation * record.shear_impulse + candidate.normal * record.normal_impulse;
            -impulse * (self.growth() / (self.params.dt * area))
        };
        let (stiffness, rest) = self.surface_at(collider, &candidate.p, &candidate.normal, traction);
        if known.is_none() {
            // The surface is touched where it has moved to.
            record.anchor -= motion.pose.rotation.inverse_transform_vector(&rest);
        }
        let anchor_w = (motion.pose * nalgebra::Point3::from(record.anchor)).coords;
        let collider = self.collider(collider);
        let surface = SurfaceContact {
            p: candidate.p,
            normal: candidate.normal,
            gap: candidate.gap,
            area,
            stretch: candidate.p - anchor_w,
            rest,
            previous_normal_impulse: record.normal_impulse * self.growth(),
            is_sliding: record.is_sliding,
        };
        let (friction, stiffness) =
            (collider.friction.with(&soft.friction), stiffness.in_series(&soft.stiffness));
        let is_known = *b == Endpoint::Known;
        let point = ContactPoint {
            weights_a: sample.weights,
            drift: if is_known { motion.velocity(&candidate.p) } else { Vec3::zeros() },
            ..surface.contact_point(&friction, &stiffness)
        };
        let row = SoftRow {
            soft: id,
            group: candidate.group,
            sample: candidate.sample,
            coverage: candidate.coverage,
            partner,
            anchor: record.anchor,
            slip_distance: record.slip_distance,
            to_anchor: *to_anchor,
        };
        self.problem.points.push(point);
        self.rows.push(row);
    }

    /// Adds the contacts found by [`World::detect_soft_soft`] to the problem.
    pub(super) fn add_soft_soft_contacts(&mut self) {
        let candidates = std::mem::take(&mut self.candidates.soft);
        let key = |c: &SoftSoftCandidate| (c.soft, c.other, c.candidate.group, c.candidate.contact.element);
        for same in candidates.chunk_by(|a, b| key(a) == key(b)) {
            let first = self.problem.points.len();
            same.iter().for_each(|candidate| self.push_soft_soft(candidate));
            let (soft, other, group, element) = key(&same[0]);
            let a = self.blocks.soft(soft).map(|block| self.group_endpoint(soft, group, block));
            let b = self.blocks.soft(other).map(|block| self.element_endpoint(other, element, block));
            self.problem.clusters.push(ContactCluster {
                a: a.unwrap_or(Endpoint::Known),
                b: b.unwrap_or(Endpoint::Known),
                first,
                last: self.problem.points.len(),
            });
        }
        self.candidates.soft = candidates;
    }

    fn push_soft_soft(&mut self, found: &SoftSoftCandidate) {
        let (a, b) = (self.soft(found.soft), self.soft(found.other));
        let SdfCandidate { group, sample, p, contact } = found.candidate;
        let partner = ContactPartner::Soft(found.other);
        // The clock of a sleeping body does not advance.
        let now = a.steps_awake + u64::from(a.is_asleep());
        let record = a.history.get(sample, partner, now).copied();
        let held = record.and_then(|record| Some((record, p - world_position(&b.state, &record.anchor)?)));
        let (record, stretch) =
            held.unwrap_or((ContactRecord::first(partner, contact.surface_o), Vec3::zeros()));
        // Both surfaces are sampled, so each carries half, unless only one of the two has a field.
        let share = if a.surface.is_some() { 0.5 } else { 1.0 };
        let data = &a.state.model.samples[sample];
        let surface = SurfaceContact {
            p,
            normal: contact.normal,
            gap: contact.gap,
            area: data.surface.area * contact.coverage * share,
            stretch,
            rest: Vec3::zeros(),
            previous_normal_impulse: record.normal_impulse * self.growth(),
            is_sliding: record.is_sliding,
        };
        let point = ContactPoint {
            weights_a: data.weights,
            weights_b: contact.weights,
            ..surface.contact_point(&a.friction.with(&b.friction), &a.stiffness.in_series(&b.stiffness))
        };
        let row = SoftRow {
            soft: found.soft,
            group,
            sample,
            coverage: contact.coverage,
            partner,
            anchor: record.anchor,
            slip_distance: record.slip_distance,
            to_anchor: contact.inverse_gradient,
        };
        self.problem.points.push(point);
        self.rows.push(row);
    }

    /// Updates anchors and impulses of the samples that touched.
    pub(super) fn update_soft_history(&mut self) {
        let dt = self.params.dt;
        let points = self.rows.iter().zip(&self.problem.points);
        let sliding = SlidingPairs::new(points.clone().map(|(row, point)| (row.pair(), point)));
        for (row, point) in points {
            if point.normal_impulse <= 0.0 {
                continue;
            }
            let soft = &mut self.soft[row.soft.index()];
            let mut record = ContactRecord {
                partner: Some(row.partner),
                step: soft.steps_awake,
                anchor: row.anchor,
                normal_impulse: point.normal_impulse,
                shear_impulse: row.to_anchor * point.shear_impulse,
                is_sliding: sliding.contains(row.pair()),
                slip_distance: row.slip_distance,
            };
            let SpringUpdate { stretch, slipped } = SpringUpdate::new(point, dt);
            if slipped > 0.0 {
                record.anchor += row.to_anchor * (stretch.try_normalize(0.0).unwrap_or_default() * slipped);
                record.slip_distance += slipped;
            }
            soft.history.put(row.sample, record);
        }
    }
}

/// Current world position of a point of the rest configuration (object frame, m).
fn world_position(body: &FemState, p_o: &Vec3) -> Option<Vec3> {
    let mesh = &body.model.mesh;
    let at = mesh.locate(p_o)?;
    let nodes = &mesh.elements[at.element as usize];
    Some(at.weights().iter().zip(nodes).map(|(w, &node)| body.x[node as usize] * *w).sum())
}
