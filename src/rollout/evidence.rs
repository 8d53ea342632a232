//! The true state in the form in which the judge evaluates it.

use std::collections::BTreeMap;

use super::{
    goal_in_scene::{GoalInScene, Subject},
    simulation::{ObjectInstance, Simulation},
};
use softvt_evaluation::{
    criteria::SuccessCriteria,
    deformation::{Deformation, ReferenceShape},
    evidence::{
        BodyEvidence, CrushedShares, Evidence, GripEvidence, GripperEvidence, PadEvidence, PlaceEvidence,
        PredicateEvidence, TargetEvidence,
    },
    goal::GoalRegion,
    judge::JudgedBody,
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

/// Collects the evidence of an episode: the targets, the places of the goal, the other movable objects,
/// and their settled shapes.
#[derive(Clone, Debug)]
pub(super) struct EvidenceCollector {
    goal: GoalInScene,
    /// Share of its weight that must act on what carries an object.
    support_share: f64,
    /// Force above which the robot touches an object, N.
    touch_force_n: f64,
    others: Vec<usize>,
    references: Vec<Option<ReferenceShape>>,
    /// Deformation of each object in the last evidence; `None` if it is rigid or cannot be measured.
    deformations: Vec<Option<Deformation>>,
    /// Strains of each target; `None` if it is rigid.
    crushed: Vec<Option<StrainMeter>>,
    targets: Vec<TargetEvidence>,
    bodies: Vec<BodyEvidence>,
    predicates: Vec<PredicateEvidence>,
}

impl EvidenceCollector {
    /// Takes the current, settled state as the reference of deformation.
    pub(super) fn new(sim: &Simulation, goal: GoalInScene, criteria: &SuccessCriteria) -> Self {
        let references: Vec<_> = sim.objects.iter().map(|object| sim.present_shape(object)).collect();
        let is_other = |i: &usize| !goal.targets.contains(i) && sim.objects[*i].body.is_free();
        Self {
            support_share: criteria.support_share,
            touch_force_n: criteria.touch_force_n,
            others: (0..sim.objects.len()).filter(is_other).collect(),
            deformations: references
                .iter()
                .zip(&sim.objects)
                .map(|(shape, object)| measured(shape.as_ref(), sim, object))
                .collect(),
            references,
            crushed: goal.targets.iter().map(|&target| strain_meter(sim, &sim.objects[target])).collect(),
            targets: Vec::with_capacity(goal.targets.len()),
            bodies: Vec::new(),
            predicates: Vec::with_capacity(goal.predicates.len()),
            goal,
        }
    }

    /// The targets and the other movable objects as they settled, with their deformation limits by name.
    pub(super) fn settled(
        &self,
        sim: &Simulation,
        limits: &BTreeMap<String, DeformationLimit>,
    ) -> [Vec<JudgedBody>; 2] {
        let body = |&index: &usize| {
            let object = &sim.objects[index];
            JudgedBody {
                name: object.name.clone(),
                weight_n: sim.weight(object),
                is_soft: matches!(object.body, BodyId::Soft(_)),
                is_goal: self.goal.is_place(index),
                limit: limits.get(&object.name).copied(),
                lowest_z_w: lowest(sim, object),
            }
        };
        [&self.goal.targets, &self.others].map(|indices| indices.iter().map(body).collect())
    }

    pub(super) fn goal(&self) -> &GoalInScene {
        &self.goal
    }

    /// Deformation of an object in the last evidence, 0 before the first; `None` if it is rigid or cannot be measured.
    pub(super) fn deformation(&self, object: usize) -> Option<Deformation> {
        self.deformations[object]
    }

    pub(super) fn reference(&self, object: usize) -> Option<&ReferenceShape> {
        self.references[object].as_ref()
    }

    /// The evidence of the last physics step. Predicates that are not placements are evaluated in the last physics
    /// step of a control step.
    pub(super) fn collect<'a>(
        &'a mut self,
        sim: &Simulation,
        time_s: f64,
        is_last: bool,
    ) -> Result<Evidence<'a>, String> {
        for ((d, reference), object) in self.deformations.iter_mut().zip(&self.references).zip(&sim.objects) {
            // A sleeping body does not move.
            if d.is_none() || !sim.world.is_asleep(object.body) {
                *d = measured(reference.as_ref(), sim, object);
            }
        }
        let mut bodies = std::mem::take(&mut self.bodies);
        bodies.clear();
        bodies.extend(self.others.iter().map(|&i| self.body(sim, i)));
        self.bodies = bodies;
        let mut targets = std::mem::take(&mut self.targets);
        targets.clear();
        targets.extend((0..self.goal.targets.len()).map(|place| self.target(sim, place)));
        self.targets = targets;
        let mut predicates = std::mem::take(&mut self.predicates);
        predicates.clear();
        for number in 0..self.goal.predicates.len() {
            predicates.push(match self.goal.predicates[number].subject {
                Subject::Rests { target, on, region } => {
                    PredicateEvidence::Place(self.place(sim, self.goal.targets[target], on, &region))
                }
                _ if is_last => {
                    let is_touched = |object| self.is_touched(sim, object);
                    PredicateEvidence::Given(self.goal.holds(number, sim, time_s, is_touched)?)
                }
                _ => PredicateEvidence::Given(false),
            });
        }
        self.predicates = predicates;
        Ok(Evidence {
            time_s,
            hand_w: sim.robot.hand_w(&sim.world),
            gripper: GripperEvidence {
                width_m: sim.robot.width(&sim.world),
                commanded_width_m: target_width(sim.robot.closure()),
            },
            targets: &self.targets,
            others: &self.bodies,
            predicates: &self.predicates,
        })
    }

    /// The target of a place in the list of targets.
    fn target(&mut self, sim: &Simulation, place: usize) -> TargetEvidence {
        let index = self.goal.targets[place];
        let object = &sim.objects[index];
        let crushed = match (&mut self.crushed[place], object.body) {
            (Some(meter), BodyId::Soft(index)) => {
                meter.update(&sim.world.soft(index).state);
                CrushedShares { collapsed: meter.collapsed_share(), damaged: meter.damaged_share() }
            }
            _ => CrushedShares::default(),
        };
        let contact = |&collider| sim.contact(object, ContactPartner::Collider(collider));
        let load_w: Vec3 =
            sim.robot.pads.iter().chain(&sim.robot.body).map(|collider| contact(collider).force_w).sum();
        TargetEvidence {
            body: self.body(sim, index),
            pads: sim.pad_contacts(object).map(|contact| PadEvidence {
                normal_force_n: contact.normal_force,
                // A sleeping body keeps the contacts with which it fell asleep.
                slip_speed_m_s: if sim.is_asleep(object) { 0.0 } else { contact.slip_speed },
            }),
            hand_force_n: sim.robot.body.iter().map(|collider| contact(collider).normal_force).sum::<f64>(),
            grip: GripEvidence {
                load_n: load_w,
                axis_w: sim.robot.grip_axis_w(&sim.world),
                dynamic_mu: sim.pad_friction(object).dynamic_mu,
            },
            crushed,
        }
    }

    /// The place on or in which an object must rest.
    fn place(&self, sim: &Simulation, object: usize, on: usize, region: &GoalRegion) -> PlaceEvidence {
        let pose_w = foot_pose(sim, &sim.objects[on]);
        let carriers = self.carriers(sim, object, on, region, &pose_w);
        let support_force_n = carriers.iter().map(|&carrier| carried(sim, carrier, object)).sum::<f64>();
        PlaceEvidence { pose_w, support_force_n }
    }

    /// Indices of the objects whose support of an object counts: the one at the place and, for a container, the objects
    /// in it that it carries, directly or by one another.
    fn carriers(
        &self,
        sim: &Simulation,
        object: usize,
        on: usize,
        region: &GoalRegion,
        place_w: &Pose,
    ) -> Vec<usize> {
        let mut carriers = vec![on];
        if !matches!(region, GoalRegion::Inside { .. }) {
            return carriers;
        }
        let is_in = |&&index: &&usize| {
            index != on && index != object && region.contains(place_w, &sim.centre(&sim.objects[index]), 0.0)
        };
        let movable = self.others.iter().chain(&self.goal.targets);
        let mut rest: Vec<usize> = movable.filter(is_in).copied().collect();
        rest.sort_unstable();
        while let Some(place) = rest.iter().position(|&index| {
            let upward: f64 = carriers.iter().map(|&carrier| carried(sim, carrier, index)).sum();
            upward >= self.support_share * sim.weight(&sim.objects[index])
        }) {
            carriers.push(rest.remove(place));
        }
        carriers
    }

    /// True if the robot presses on an object.
    fn is_touched(&self, sim: &Simulation, index: usize) -> bool {
        self.body(sim, index).robot_force_n > self.touch_force_n
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

fn strain_meter(sim: &Simulation, object: &ObjectInstance) -> Option<StrainMeter> {
    match (object.body, &object.asset.body) {
        (BodyId::Soft(index), Body::Soft(SoftMaterial { collapse_strain, damage_strain, .. })) => {
            let limits = StrainLimits { collapse: *collapse_strain, damage: *damage_strain };
            Some(StrainMeter::new(&sim.world.soft(index).state.model, limits))
        }
        _ => None,
    }
}

/// The present deformation of an object from its reference; `None` if it is rigid or cannot be measured.
fn measured(
    reference: Option<&ReferenceShape>,
    sim: &Simulation,
    object: &ObjectInstance,
) -> Option<Deformation> {
    let BodyId::Soft(index) = object.body else { return None };
    reference?.measure(&sim.world.soft(index).state.x).ok()
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
