//! The true state in the form in which the judge evaluates it.

use std::collections::BTreeMap;

use super::{
    goal_in_scene::GoalInScene,
    simulation::{ObjectInstance, Simulation},
};
use softvt_evaluation::{
    deformation::{Deformation, ReferenceShape},
    evidence::{
        BodyEvidence, CrushedShares, Evidence, GoalEvidence, GripEvidence, GripperEvidence, PadEvidence,
    },
    goal::GoalRegion,
    judge::OtherBody,
    safety::DeformationLimit,
};
use softvt_geometry::{Pose, Vec3};
use softvt_physics::{
    BodyId, ContactPartner,
    fem::{StrainLimits, StrainMeter},
    world::ContactSummary,
};
use softvt_robot::gripper::target_width;
use softvt_scene::{Body, SoftMaterial};

/// Collects the evidence of an episode: the target, its goal, the other movable objects, and their settled shapes.
#[derive(Clone, Debug)]
pub(super) struct EvidenceCollector {
    target: usize,
    goal: usize,
    region: GoalRegion,
    /// Share of its weight that must act on what carries an object.
    support_share: f64,
    /// Movable objects that are not the target.
    others: Vec<usize>,
    references: Vec<Option<ReferenceShape>>,
    /// Deformation of each object in the last evidence; `None` if it is rigid or cannot be measured.
    deformations: Vec<Option<Deformation>>,
    bodies: Vec<BodyEvidence>,
    crushed: Option<StrainMeter>,
}

impl EvidenceCollector {
    /// Takes the current, settled state as the reference of deformation.
    pub(super) fn new(sim: &Simulation, goal: &GoalInScene, support_share: f64) -> Self {
        let &GoalInScene { object: target, target: goal, region } = goal;
        let is_other = |i: &usize| *i != target && sim.objects[*i].body.is_free();
        let references: Vec<_> = sim
            .objects
            .iter()
            .map(|object| match object.body {
                BodyId::Soft(index) => {
                    let body = &sim.world.soft(index).state;
                    ReferenceShape::new(&body.x, &body.model.mass).ok().map(|shape| shape.along(&body.frame))
                }
                _ => None,
            })
            .collect();
        let others: Vec<usize> = (0..sim.objects.len()).filter(is_other).collect();
        let bodies = Vec::with_capacity(others.len());
        let crushed = match (sim.objects[target].body, &sim.objects[target].asset.body) {
            (BodyId::Soft(index), Body::Soft(SoftMaterial { collapse_strain, damage_strain, .. })) => {
                let limits = StrainLimits { collapse: *collapse_strain, damage: *damage_strain };
                Some(StrainMeter::new(&sim.world.soft(index).state.model, limits))
            }
            _ => None,
        };
        let deformations = deformations(&references, sim).collect();
        Self { target, goal, region, support_share, others, references, deformations, bodies, crushed }
    }

    /// The other movable objects as they settled, with their deformation limits by name.
    pub(super) fn other_bodies(
        &self,
        sim: &Simulation,
        limits: &BTreeMap<String, DeformationLimit>,
    ) -> Vec<OtherBody> {
        let other = |&index: &usize| {
            let object = &sim.objects[index];
            OtherBody {
                name: object.name.clone(),
                is_goal: index == self.goal,
                is_soft: matches!(object.body, BodyId::Soft(_)),
                limit: limits.get(&object.name).copied(),
                lowest_z_w: lowest(sim, object),
            }
        };
        self.others.iter().map(other).collect()
    }

    /// Deformation of an object in the last evidence, 0 before the first; `None` if it is rigid or cannot be measured.
    pub(super) fn deformation(&self, object: usize) -> Option<Deformation> {
        self.deformations[object]
    }

    /// Settled shape of an object.
    pub(super) fn reference(&self, object: usize) -> Option<&ReferenceShape> {
        self.references[object].as_ref()
    }

    /// The evidence of the last physics step.
    pub(super) fn collect<'a>(&'a mut self, sim: &Simulation, time_s: f64) -> Evidence<'a> {
        self.deformations.clear();
        self.deformations.extend(deformations(&self.references, sim));
        let mut bodies = std::mem::take(&mut self.bodies);
        bodies.clear();
        bodies.extend(self.others.iter().map(|&i| self.body(sim, i)));
        self.bodies = bodies;
        let target = &sim.objects[self.target];
        let crushed = match (&mut self.crushed, target.body) {
            (Some(meter), BodyId::Soft(index)) => {
                meter.update(&sim.world.soft(index).state);
                CrushedShares { collapsed: meter.collapsed_share(), damaged: meter.damaged_share() }
            }
            _ => CrushedShares::default(),
        };
        let goal = &sim.objects[self.goal];
        let goal_w = foot_pose(sim, goal);
        let carriers = self.carriers(sim, &goal_w);
        let from_goal = carriers.iter().map(|&carrier| carried(sim, carrier, self.target)).sum::<f64>();
        let from_robot = sim
            .robot
            .body
            .iter()
            .map(|&c| sim.contact(target, ContactPartner::Collider(c)).normal_force)
            .sum::<f64>();
        let of_robot = sim.robot.pads.iter().chain(&sim.robot.body);
        let load_w: Vec3 = of_robot.map(|&c| sim.contact(target, ContactPartner::Collider(c)).force_w).sum();
        Evidence {
            time_s,
            hand_w: sim.robot.hand_w(&sim.world),
            gripper: GripperEvidence {
                width_m: sim.robot.width(&sim.world),
                commanded_width_m: target_width(sim.robot.closure()),
            },
            pads: sim.pad_contacts(target).map(|contact| PadEvidence {
                normal_force_n: contact.normal_force,
                // A sleeping body keeps the contacts with which it fell asleep.
                slip_speed_m_s: if sim.is_asleep(target) { 0.0 } else { contact.slip_speed },
            }),
            robot_force_n: from_robot,
            grip: GripEvidence {
                load_n: load_w,
                axis_w: sim.robot.grip_axis_w(&sim.world),
                dynamic_mu: sim.pad_friction(target).dynamic_mu,
            },
            target: self.body(sim, self.target),
            crushed,
            goal: GoalEvidence { pose_w: goal_w, support_force_n: from_goal },
            others: &self.bodies,
        }
    }

    /// Indices of the objects whose support of the target counts: the one at the goal and, for a container, the objects
    /// in it that it carries, directly or by one another.
    fn carriers(&self, sim: &Simulation, goal_w: &Pose) -> Vec<usize> {
        let mut carriers = vec![self.goal];
        if !matches!(self.region, GoalRegion::Inside { .. }) {
            return carriers;
        }
        let is_in = |&&index: &&usize| {
            index != self.goal && self.region.contains(goal_w, &sim.centre(&sim.objects[index]), 0.0)
        };
        let mut rest: Vec<usize> = self.others.iter().filter(is_in).copied().collect();
        while let Some(place) = rest.iter().position(|&index| {
            let upward: f64 = carriers.iter().map(|&carrier| carried(sim, carrier, index)).sum();
            upward >= self.support_share * sim.weight(&sim.objects[index])
        }) {
            carriers.push(rest.remove(place));
        }
        carriers
    }

    fn body(&self, sim: &Simulation, index: usize) -> BodyEvidence {
        let object = &sim.objects[index];
        let is_robot = |partner| matches!(partner, ContactPartner::Collider(c) if sim.robot.pads.contains(&c) || sim.robot.body.contains(&c));
        let (mut support, mut from_robot) = (0.0, 0.0);
        for contact in sim.world.contacts(object.body) {
            match is_robot(contact.partner) {
                true => from_robot += contact.summary.normal_force,
                false => support += upward(&contact.summary),
            }
        }
        BodyEvidence {
            centre_w: sim.centre(object),
            lowest_z_w: lowest(sim, object),
            support_force_n: support,
            robot_force_n: from_robot,
            deformation: self.deformations[index],
        }
    }
}

/// Deformation of each object from its reference.
fn deformations<'a>(
    references: &'a [Option<ReferenceShape>],
    sim: &'a Simulation,
) -> impl Iterator<Item = Option<Deformation>> + 'a {
    sim.objects.iter().zip(references).map(|(object, reference)| {
        let BodyId::Soft(index) = object.body else { return None };
        reference.as_ref()?.measure(&sim.world.soft(index).state.x).ok()
    })
}

/// Contact partners that an object consists of: its colliders, or its soft body.
fn partners(object: &ObjectInstance) -> impl Iterator<Item = ContactPartner> + '_ {
    let soft = match object.body {
        BodyId::Soft(index) => Some(ContactPartner::Soft(index)),
        _ => None,
    };
    object.colliders.iter().map(|&c| ContactPartner::Collider(c)).chain(soft)
}

/// Upward force of one object on another, N; both are indices.
fn carried(sim: &Simulation, carrier: usize, object: usize) -> f64 {
    let object = &sim.objects[object];
    partners(&sim.objects[carrier]).map(|partner| upward(&sim.contact(object, partner))).sum()
}

/// Pose of the frame of an object at its foot, world.
pub(super) fn foot_pose(sim: &Simulation, object: &ObjectInstance) -> Pose {
    sim.pose(object) * Pose::from(object.foot_o())
}

/// Upward part of a force, N.
fn upward(contact: &ContactSummary) -> f64 {
    contact.force_w.z.max(0.0)
}

/// Height of the lowest point of an object, m.
pub(super) fn lowest(sim: &Simulation, object: &ObjectInstance) -> f64 {
    match object.body {
        BodyId::Soft(index) => {
            let body = &sim.world.soft(index).state;
            body.x.iter().map(|x: &Vec3| x.z).fold(f64::INFINITY, f64::min)
        }
        _ => object.bounds.transformed(&sim.pose(object)).min.z,
    }
}
