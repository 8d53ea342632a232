//! The hidden state as the judge wants it.

use super::simulation::{ObjectInstance, Simulation};
use crate::{
    evaluation::{
        deformation::{Deformation, ReferenceShape},
        evidence::{BodyEvidence, Evidence, GoalEvidence, GripperEvidence, PadEvidence},
    },
    geometry::{Pose, Vec3},
    physics::{BodyId, ContactPartner, world::ContactSummary},
    robot::gripper::target_width,
};

/// Who is the target, where it must go, who else could move, and their settled shapes.
#[derive(Clone, Debug)]
pub struct EvidenceCollector {
    target: usize,
    place: usize,
    others: Vec<usize>,
    references: Vec<Option<ReferenceShape>>,
    bodies: Vec<BodyEvidence>,
}

impl EvidenceCollector {
    /// Takes the settled state as the deformation reference.
    pub fn new(sim: &Simulation, target: usize, place: usize) -> Self {
        let movable = |i: &usize| *i != target && sim.objects[*i].body.is_free();
        let references = sim
            .objects
            .iter()
            .map(|object| match object.body {
                BodyId::Soft(index) => {
                    let body = &sim.world.soft(index).state;
                    ReferenceShape::new(&body.x, &body.model.mass).ok()
                }
                _ => None,
            })
            .collect();
        let others = (0..sim.objects.len()).filter(movable).filter(|i| *i != place).collect();
        Self { target, place, others, references, bodies: Vec::new() }
    }

    /// Lowest points of the other movable bodies, m.
    pub fn others_lowest(&self, sim: &Simulation) -> Vec<f64> {
        self.others.iter().map(|&i| lowest(sim, &sim.objects[i])).collect()
    }

    /// Deformation of an object now; `None` if it is rigid or cannot be measured.
    pub fn deformation(&self, sim: &Simulation, object: usize) -> Option<Deformation> {
        let BodyId::Soft(index) = sim.objects[object].body else { return None };
        self.references[object].as_ref()?.measure(&sim.world.soft(index).state.x).ok()
    }

    /// The settled shape of an object.
    pub fn reference(&self, object: usize) -> Option<&ReferenceShape> {
        self.references[object].as_ref()
    }

    /// The evidence of the step that just ended.
    pub fn collect<'a>(&'a mut self, sim: &Simulation, time_s: f64) -> Evidence<'a> {
        let dt = sim.world.params.dt;
        self.bodies = self.others.iter().map(|&i| self.body(sim, i)).collect();
        let target = &sim.objects[self.target];
        let place = &sim.objects[self.place];
        let from_place = partners(place).map(|partner| upward(&sim.contact(target, partner))).sum::<f64>();
        let from_robot = sim
            .robot
            .body
            .iter()
            .map(|&c| sim.contact(target, ContactPartner::Collider(c)).normal_force)
            .sum::<f64>();
        Evidence {
            time_s,
            hand_w: sim.robot.hand_w(&sim.world),
            gripper: GripperEvidence {
                width_m: sim.robot.width(&sim.world),
                commanded_width_m: target_width(sim.robot.closure()),
            },
            pads: sim.pad_contacts(target).map(|touch| PadEvidence {
                normal_impulse_ns: touch.normal_force * dt,
                travel_m: touch.travel,
            }),
            robot_impulse_ns: from_robot * dt,
            target: self.body(sim, self.target),
            goal: GoalEvidence {
                pose_w: sim.pose(place) * Pose::from(place.foot_o()),
                support_impulse_ns: from_place * dt,
            },
            others: &self.bodies,
        }
    }

    fn body(&self, sim: &Simulation, index: usize) -> BodyEvidence {
        let object = &sim.objects[index];
        let robot = |partner| matches!(partner, ContactPartner::Collider(c) if sim.robot.pads.contains(&c) || sim.robot.body.contains(&c));
        let others = sim.world.contacts(object.body).iter().filter(|contact| !robot(contact.partner));
        let support: f64 = others.map(|contact| upward(&contact.summary)).sum();
        BodyEvidence {
            centre_w: sim.centre(object),
            lowest_z_w: lowest(sim, object),
            support_impulse_ns: support * sim.world.params.dt,
            deformation: self.deformation(sim, index),
        }
    }
}

/// What an object is to those that it touches: its colliders, or a soft body.
fn partners(object: &ObjectInstance) -> impl Iterator<Item = ContactPartner> + '_ {
    let soft = match object.body {
        BodyId::Soft(index) => Some(ContactPartner::Soft(index)),
        _ => None,
    };
    object.colliders.iter().map(|&c| ContactPartner::Collider(c)).chain(soft)
}

/// Upward part of a force, N.
fn upward(touch: &ContactSummary) -> f64 {
    touch.force_w.z.max(0.0)
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
