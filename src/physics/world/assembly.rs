//! Assemblies: bodies that attachments join. They sleep and wake together, and fly as one body.

use super::{World, state::SleepState, substeps::mass_ratio};
use crate::{
    fem::rigid_motion::RigidVelocity,
    ids::{ArticulationId, BodyId, ContactPartner, LinkId, RigidId, SoftId},
    rigid::{RigidState, torque_free_rotation},
};
use softvt_geometry::{Mat3, Pose, Quat, Vec3, union_find::UnionFind};

/// Bodies that attachments join, directly or through others.
#[derive(Clone, Debug, Default)]
pub(super) struct Assembly {
    /// Soft bodies, rigid bodies and articulations, each of these by its first link.
    members: Vec<BodyId>,
    /// True if it is attached to the world, a kinematic frame or a link.
    is_anchored: bool,
}

/// A node or a rigid body of an assembly.
#[derive(Clone, Copy)]
struct Part {
    mass: f64,
    /// Mass that the velocity system has, with the mass-proportional damping of a step, kg.
    damped_mass: f64,
    x: Vec3,
    v: Vec3,
    inertia: Mat3,
    w: Vec3,
}

/// A part whose motion is changed; rotation and angular velocity (rad/s, world) are of rigid bodies.
struct PartMotion<'a> {
    x: &'a mut Vec3,
    v: &'a mut Vec3,
    turning: Option<(&'a mut Quat, &'a mut Vec3)>,
}

/// Mass (kg) and inertia (kg m²) of parts, and their momenta, about their common centre.
struct Aggregate {
    mass: f64,
    centre: Vec3,
    momentum: Vec3,
    angular_momentum: Vec3,
    inertia: Mat3,
}

impl Aggregate {
    /// Sums parts of these masses and linear momenta.
    fn new(
        parts: impl Iterator<Item = Part> + Clone,
        mass: impl Fn(&Part) -> f64,
        momentum: impl Fn(&Part) -> Vec3,
    ) -> Self {
        let total = parts.clone().map(|part| mass(&part)).sum::<f64>();
        let centre = parts.clone().map(|part| part.x * mass(&part)).sum::<Vec3>() / total;
        let mut sums = Self {
            mass: total,
            centre,
            momentum: Vec3::zeros(),
            angular_momentum: Vec3::zeros(),
            inertia: Mat3::zeros(),
        };
        for part in parts {
            let (r, p) = (part.x - centre, momentum(&part));
            sums.momentum += p;
            sums.angular_momentum += r.cross(&p) + part.inertia * part.w;
            let square = Mat3::from_diagonal_element(r.norm_squared()) - r * r.transpose();
            sums.inertia += square * mass(&part) + part.inertia;
        }
        sums
    }

    /// The rigid motion with these momenta.
    fn motion(&self) -> RigidVelocity {
        let angular =
            self.inertia.try_inverse().map_or(Vec3::zeros(), |inverse| inverse * self.angular_momentum);
        RigidVelocity { centre: self.centre, linear: self.momentum / self.mass, angular }
    }
}

impl World {
    /// Finds the assemblies of all attachments.
    pub(super) fn update_assemblies(&mut self) {
        let (soft, solid) = (self.soft.len(), self.soft.len() + self.rigid.len());
        let mut joined = UnionFind::new(solid + self.articulations.len());
        for attachment in &self.attachments {
            match attachment.to {
                BodyId::Rigid(id) => joined.union(attachment.soft.index(), soft + id.index()),
                BodyId::Link(id) => joined.union(attachment.soft.index(), solid + id.articulation.index()),
                BodyId::World | BodyId::Kinematic(_) | BodyId::Soft(_) => {}
            }
        }
        let mut of_root = vec![None; solid + self.articulations.len()];
        self.assemblies.clear();
        for attachment in &self.attachments {
            let assembly = *of_root[joined.find(attachment.soft.index())].get_or_insert_with(|| {
                self.assemblies.push(Assembly::default());
                self.assemblies.len() - 1
            });
            self.assemblies[assembly].is_anchored |= !matches!(attachment.to, BodyId::Rigid(_));
        }
        for index in 0..of_root.len() {
            let Some(assembly) = of_root[joined.find(index)] else { continue };
            let member = if index < soft {
                self.soft[index].assembly = Some(assembly);
                SoftId::new(index).into()
            } else if index < solid {
                self.rigid[index - soft].assembly = Some(assembly);
                RigidId::new(index - soft).into()
            } else {
                self.articulations[index - solid].assembly = Some(assembly);
                LinkId { articulation: ArticulationId::new(index - solid), index: 0 }.into()
            };
            self.assemblies[assembly].members.push(member);
        }
    }

    /// Index of the assembly of a body.
    fn assembly_of(&self, body: BodyId) -> Option<usize> {
        match body {
            BodyId::World | BodyId::Kinematic(_) => None,
            BodyId::Soft(id) => self.soft(id).assembly,
            BodyId::Rigid(id) => self.rigid(id).assembly,
            BodyId::Link(id) => self.articulation(id.articulation).assembly,
        }
    }

    fn sleep_of(&mut self, body: BodyId) -> Option<&mut SleepState> {
        match body {
            BodyId::World | BodyId::Kinematic(_) => None,
            BodyId::Soft(id) => Some(&mut self.soft[id.index()].sleep),
            BodyId::Rigid(id) => Some(&mut self.rigid[id.index()].sleep),
            BodyId::Link(id) => Some(&mut self.articulations[id.articulation.index()].sleep),
        }
    }

    /// Wakes the assemblies that have a member awake, or that a moving frame carries.
    pub(super) fn wake_assemblies(&mut self) {
        for index in 0..self.assemblies.len() {
            let assembly = std::mem::take(&mut self.assemblies[index]);
            let is_moved = self.attachments.iter().any(|attachment| match attachment.to {
                BodyId::Kinematic(id) if self.soft(attachment.soft).assembly == Some(index) => {
                    self.kinematic(id).next != self.kinematic(id).pose
                }
                _ => false,
            });
            let is_awake = assembly.members.iter().any(|&member| !self.is_asleep(member));
            for &member in assembly.members.iter().filter(|_| is_moved || is_awake) {
                if let Some(sleep) = self.sleep_of(member).filter(|sleep| is_moved || sleep.is_asleep) {
                    sleep.wake();
                }
            }
            self.assemblies[index] = assembly;
        }
    }

    /// Puts assemblies to sleep that are anchored or touch something, if each member has been slow for long enough.
    pub(super) fn put_assemblies_to_sleep(&mut self) {
        for index in 0..self.assemblies.len() {
            let assembly = std::mem::take(&mut self.assemblies[index]);
            let delay = self.params.sleep_delay;
            let is_due = assembly.members.iter().all(|&member| {
                let is_driven =
                    matches!(member, BodyId::Link(id) if self.articulation(id.articulation).is_driven());
                !is_driven
                    && self.sleep_of(member).is_some_and(|sleep| !sleep.is_asleep && sleep.slow_time >= delay)
            });
            let rests = |world: &Self| assembly.members.iter().any(|&member| world.touches(member));
            if is_due && (assembly.is_anchored || rests(self)) {
                assembly.members.iter().for_each(|&member| self.put_to_sleep(member));
            }
            self.assemblies[index] = assembly;
        }
    }

    /// True if an assembly neither is anchored nor may touch a body outside of it in this step.
    fn is_in_flight(&self, index: usize) -> bool {
        let assembly = &self.assemblies[index];
        let is_asleep = assembly.members.iter().any(|&member| self.is_asleep(member));
        let body = |partner| match partner {
            ContactPartner::Collider(id) => self.collider(id).parent,
            ContactPartner::Soft(id) => id.into(),
        };
        let crosses = |a, b| (self.assembly_of(a) == Some(index)) != (self.assembly_of(b) == Some(index));
        let mut soft = self.candidates.pairs();
        let mut rigid = self.rigid_contacts.pairs().iter();
        !(assembly.is_anchored
            || is_asleep
            || soft.any(|(soft, partner)| crosses(soft.into(), body(partner)))
            || rigid.any(|pair| crosses(body(pair.a.into()), body(pair.b.into()))))
    }

    /// Finds the rigid motion of each assembly in flight at the end of the step, without internal forces.
    pub(super) fn find_flights(&mut self) {
        let mut flights = std::mem::take(&mut self.blocks.flights);
        flights.clear();
        let gain = self.gravity * (self.params.dt / mass_ratio(&self.params, self.last_dt));
        flights.extend((0..self.assemblies.len()).map(|index| {
            let momentum = |part: &Part| (part.v + gain) * part.mass;
            let parts = || Aggregate::new(self.parts(index), |part| part.damped_mass, momentum);
            self.is_in_flight(index).then(|| parts().motion())
        }));
        self.blocks.flights = flights;
    }

    /// The nodes and rigid bodies of an assembly.
    fn parts(&self, index: usize) -> impl Iterator<Item = Part> + Clone {
        let damping =
            1.0 + self.params.rayleigh_mass * self.params.dt / mass_ratio(&self.params, self.last_dt);
        let members = self.assemblies[index].members.iter();
        let nodes = members.clone().filter_map(|member| member.soft()).flat_map(move |id| {
            let body = &self.soft(id).state;
            let nodes = body.x.iter().zip(&body.v).zip(&body.model.mass);
            nodes.map(move |((x, v), mass)| Part {
                mass: *mass,
                damped_mass: damping * mass,
                x: *x,
                v: *v,
                inertia: Mat3::zeros(),
                w: Vec3::zeros(),
            })
        });
        let rigid = members.filter_map(|member| match member {
            BodyId::Rigid(id) => {
                let body = &self.rigid(*id).state;
                let (mass, x) = (body.mass, body.pose_w.translation.vector);
                Some(Part { mass, damped_mass: mass, x, v: body.v, inertia: body.inertia_w(), w: body.w })
            }
            _ => None,
        });
        nodes.chain(rigid)
    }

    fn change_parts(&mut self, index: usize, mut change: impl FnMut(PartMotion)) {
        for member in &self.assemblies[index].members {
            match *member {
                BodyId::Soft(id) => {
                    let body = &mut self.soft[id.index()].state;
                    let nodes = body.x.iter_mut().zip(&mut body.v);
                    nodes.for_each(|(x, v)| change(PartMotion { x, v, turning: None }));
                }
                BodyId::Rigid(id) => {
                    let body = &mut self.rigid[id.index()].state;
                    let (x, rotation) = (&mut body.pose_w.translation.vector, &mut body.pose_w.rotation);
                    change(PartMotion { x, v: &mut body.v, turning: Some((rotation, &mut body.w)) });
                }
                BodyId::World | BodyId::Kinematic(_) | BodyId::Link(_) => {}
            }
        }
    }

    /// Moves the assemblies in flight, whose bodies have the solved deviations from the rigid motion of the flight as
    /// their velocities.
    ///
    /// This is [`rigid_motion::advance`](crate::fem::rigid_motion::advance) for several bodies: the rigid part of their
    /// common motion follows the arc, and linear and angular momentum are exact.
    pub(super) fn advance_flights(&mut self) {
        for index in 0..self.assemblies.len() {
            let Some(flight) = self.blocks.flights[index] else { continue };
            self.advance_flight(index, &flight);
        }
    }

    fn advance_flight(&mut self, index: usize, flight: &RigidVelocity) {
        let dt = self.params.dt;
        let momentum = |part: &Part| part.v * part.damped_mass;
        // Momenta of the deviations, which are zero but for the rounding and the tangent of strained bodies.
        let rest = Aggregate::new(self.parts(index), |part| part.damped_mass, momentum).motion();
        self.change_parts(index, |PartMotion { x, v, turning }| {
            *v += flight.at(x) - rest.at(x);
            if let Some((_, w)) = turning {
                *w += flight.angular - rest.angular;
            }
        });
        let sums =
            |world: &Self| Aggregate::new(world.parts(index), |part| part.mass, |part| part.v * part.mass);
        let start = sums(self);
        let RigidVelocity { centre, linear, angular } = start.motion();
        let free = RigidState {
            pose_w: Pose::identity(),
            com_o: Vec3::zeros(),
            v: linear,
            w: angular,
            mass: start.mass,
            inertia_o: start.inertia,
        };
        let turn = torque_free_rotation(&free, dt).turn;
        let end = centre + linear * dt;
        self.change_parts(index, |PartMotion { x, v, turning }| {
            let r = *x - centre;
            let straining = *v - linear - angular.cross(&r);
            *x = end + turn * (r + straining * dt);
            *v = linear + turn * straining;
            if let Some((rotation, w)) = turning {
                let own = *w - angular;
                *rotation =
                    Quat::new_normalize((turn * Quat::from_scaled_axis(own * dt) * *rotation).into_inner());
                *w = turn * own;
            }
        });
        // The angular momentum about the common centre.
        let now = sums(self);
        let missing = Aggregate {
            angular_momentum: start.angular_momentum - now.angular_momentum,
            momentum: start.momentum - now.momentum,
            ..now
        };
        let missing = missing.motion();
        self.change_parts(index, |PartMotion { x, v, turning }| {
            *v += missing.at(x);
            if let Some((_, w)) = turning {
                *w += missing.angular;
            }
        });
        let flown = self.soft.iter_mut().filter(|soft| soft.assembly == Some(index));
        flown.for_each(|soft| soft.state.update_elastic(dt));
    }
}
