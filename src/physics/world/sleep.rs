//! Sleep: a body at rest costs nothing until something near it moves or anything is changed.

use super::{RigidBody, World, assemble::RETAIN_DISTANCE};
use crate::ids::{ArticulationId, BodyId, ColliderId, LinkId, SoftId};
use softvt_geometry::{Aabb, GroupedAabb, Vec3};

impl World {
    /// Wakes all bodies: something was changed from outside.
    pub(super) fn wake_all(&mut self) {
        self.soft.iter_mut().for_each(|soft| soft.sleep.wake());
        self.rigid.iter_mut().for_each(|rigid| rigid.sleep.wake());
        self.articulations.iter_mut().for_each(|articulation| articulation.sleep.wake());
    }

    /// Wakes bodies near others that move, and all if parameters or gravity were changed.
    ///
    /// Near is within the distance at which contacts are detected. It grows with speed, so a body is awake in the first
    /// step in which something fast can touch it.
    pub(super) fn wake_disturbed(&mut self) {
        if self.inputs.0 != self.params || self.inputs.1 != self.gravity {
            self.inputs = (self.params.clone(), self.gravity);
            self.wake_all();
        }
        let mut moving = std::mem::take(&mut self.moving);
        moving.clear();
        let colliders = self.collider_ids().filter(|&id| self.is_collider_moving(id));
        moving.extend(colliders.map(|id| self.swept_box(id)));
        let soft = self.soft_ids().filter(|&id| self.soft(id).state.max_speed() > self.params.sleep_speed);
        moving.extend(soft.filter_map(|id| self.swept_soft_box(id)));
        let is_disturbed = |own: GroupedAabb| {
            moving.iter().any(|other| other.group != own.group && other.bounds.intersects(&own.bounds))
        };
        for id in self.soft_ids() {
            if self.swept_soft_box(id).is_some_and(is_disturbed) {
                self.soft[id.index()].sleep.wake();
            }
        }
        for id in self.collider_ids() {
            match self.collider(id).parent {
                BodyId::Rigid(body) if is_disturbed(self.swept_box(id)) => {
                    self.rigid[body.index()].sleep.wake();
                }
                BodyId::Link(link) if is_disturbed(self.swept_box(id)) => {
                    self.articulations[link.articulation.index()].sleep.wake();
                }
                _ => {}
            }
        }
        self.moving = moving;
        self.wake_assemblies();
        let mut resting = std::mem::take(&mut self.resting);
        resting.retain(|own| self.are_resting(own.collider, own.point.partner));
        self.resting = resting;
    }

    /// Bounds of a soft body over the step.
    fn swept_soft_box(&self, id: SoftId) -> Option<GroupedAabb> {
        let body = &self.soft(id).state;
        let distance = self.contact_margin(body.max_speed()).max(RETAIN_DISTANCE);
        let bounds = Aabb::from_points(&body.x)?.loosened(distance + 0.5 * body.model.max_spacing());
        Some(GroupedAabb { bounds, group: u32::MAX - id.index() as u32 })
    }

    /// True if a collider keeps bodies near it awake. A driven link does even while both are still: the link needs the
    /// body's force in every step, and so does the sensor on it.
    fn is_collider_moving(&self, id: ColliderId) -> bool {
        let motion = &self.motions[id.index()];
        let speed = motion.linear.norm() + motion.angular.norm();
        match self.collider(id).parent {
            BodyId::World | BodyId::Soft(_) => false,
            BodyId::Kinematic(_) => speed > 0.0,
            BodyId::Link(link) if self.articulation(link.articulation).is_driven() => true,
            BodyId::Rigid(_) | BodyId::Link(_) => speed > self.params.sleep_speed,
        }
    }

    /// Puts bodies to sleep that touch something, and for long enough were slow and not near anything that moves.
    pub(super) fn put_resting_to_sleep(&mut self) {
        if !self.params.sleeping {
            return;
        }
        for id in self.soft_ids() {
            let soft = &mut self.soft[id.index()];
            let is_due = soft.sleep.is_due(soft.state.max_speed(), &self.params);
            if is_due && soft.assembly.is_none() && self.touches(id.into()) {
                self.put_to_sleep(id.into());
            }
        }
        for id in self.rigid_ids() {
            let rigid = &mut self.rigid[id.index()];
            let speed = rigid.state.v.norm() + rigid.state.w.norm();
            let is_due = rigid.sleep.is_due(speed, &self.params);
            if is_due && rigid.assembly.is_none() && self.touches(id.into()) {
                self.put_to_sleep(id.into());
            }
        }
        for index in 0..self.articulations.len() {
            let articulation = &mut self.articulations[index];
            let is_due = !articulation.is_driven()
                && articulation.sleep.is_due(articulation.state.v.amax(), &self.params);
            if is_due && articulation.assembly.is_none() {
                self.put_to_sleep(LinkId { articulation: ArticulationId::new(index), index: 0 }.into());
            }
        }
        self.put_assemblies_to_sleep();
        let fallen = self.solved_points(|collider, partner| self.are_resting(collider, partner));
        self.resting.extend(fallen);
    }

    /// True if a soft or rigid body touched anything in the last step.
    pub(super) fn touches(&self, body: BodyId) -> bool {
        match body {
            BodyId::Soft(id) => self.rows.iter().any(|row| row.soft == id || row.partner == id.into()),
            BodyId::Rigid(id) => self.is_touching(id),
            BodyId::World | BodyId::Kinematic(_) | BodyId::Link(_) => false,
        }
    }

    /// Puts a body, or the articulation of a link, to sleep.
    pub(super) fn put_to_sleep(&mut self, body: BodyId) {
        let sleep = match body {
            BodyId::Soft(id) => {
                let soft = &mut self.soft[id.index()];
                soft.state.v.fill(Vec3::zeros());
                &mut soft.sleep
            }
            BodyId::Rigid(id) => {
                let RigidBody { state, sleep, .. } = &mut self.rigid[id.index()];
                (state.v, state.w) = (Vec3::zeros(), Vec3::zeros());
                sleep
            }
            BodyId::Link(id) => {
                let articulation = &mut self.articulations[id.articulation.index()];
                articulation.state.v.fill(0.0);
                &mut articulation.sleep
            }
            BodyId::World | BodyId::Kinematic(_) => return,
        };
        sleep.is_asleep = true;
    }
}
