//! Sleep: a body at rest costs nothing until something moves near it.

use super::World;
use crate::ids::{BodyId, ColliderId, ContactPartner, SoftId};
use softvt_geometry::{Aabb, Vec3};

/// Speed above which a driven link or a kinematic frame wakes bodies near it, m/s (and rad/s at a lever of 1 m).
const WAKING_SPEED: f64 = 1e-5;
/// Distance within which it does, m.
const WAKING_DISTANCE: f64 = 3e-3;

/// Bounds of something that moves.
struct Disturbance {
    /// The body, unless it is soft.
    body: Option<BodyId>,
    bounds: Aabb,
}

/// Contacts of a body as far as sleep depends on them.
#[derive(Clone, Copy, Default)]
struct RestingContact {
    /// True if the body touches anything.
    touches: bool,
    /// True if it touches something that keeps it awake.
    is_disturbed: bool,
}

impl World {
    /// Wakes bodies near others that move.
    pub(super) fn wake_disturbed(&mut self) {
        let soft_asleep = self.soft.iter().any(|s| s.is_asleep());
        let rigid_asleep = self.rigid.iter().any(|r| r.is_asleep());
        if !soft_asleep && !rigid_asleep && !self.articulations.iter().any(|a| a.is_asleep()) {
            return;
        }
        let disturbances = self.disturbances();
        for soft in self.soft.iter_mut().filter(|s| s.sleep.is_asleep) {
            let Some(around) = Aabb::from_points(&soft.state.x) else { continue };
            let around = around.loosened(WAKING_DISTANCE);
            if disturbances.iter().any(|disturbance| around.intersects(&disturbance.bounds)) {
                soft.sleep.wake();
            }
        }
        for id in self.rigid_ids() {
            if !self.rigid(id).is_asleep() {
                continue;
            }
            let is_near = self.is_near(&disturbances, |body| body == BodyId::Rigid(id));
            let state = &self.rigid(id).state;
            // A velocity may have been set from outside.
            if is_near || state.v != Vec3::zeros() || state.w != Vec3::zeros() {
                self.rigid[id.index()].sleep.wake();
            }
        }
        for id in self.articulation_ids() {
            if !self.articulation(id).is_asleep() {
                continue;
            }
            let is_near = self.is_near(&disturbances, |body| body.is_link_of(id));
            let articulation = &mut self.articulations[id.index()];
            if is_near || articulation.is_driven() || articulation.state.v.iter().any(|&v| v != 0.0) {
                articulation.sleep.wake();
            }
        }
    }

    /// True if any collider on bodies that are `own` is near a disturbance that is not.
    fn is_near(&self, disturbances: &[Disturbance], own: impl Fn(BodyId) -> bool) -> bool {
        let mut colliders = self.colliders.iter().zip(&self.motions).filter(|(c, _)| own(c.parent));
        colliders.any(|(collider, motion)| {
            let around = collider.bounds.transformed(&motion.pose).loosened(WAKING_DISTANCE);
            disturbances.iter().any(|disturbance| {
                !disturbance.body.is_some_and(&own) && around.intersects(&disturbance.bounds)
            })
        })
    }

    /// Bounds of everything that moves.
    fn disturbances(&self) -> Vec<Disturbance> {
        let ids = (0..self.colliders.len()).map(ColliderId::new);
        let colliders = ids.filter(|&id| self.is_collider_moving(id)).map(|id| {
            let collider = self.collider(id);
            let bounds = collider.bounds.transformed(&self.motions[id.index()].pose);
            Disturbance { body: Some(collider.parent), bounds }
        });
        let soft = self.soft_ids().filter(|&id| self.is_soft_moving(id)).filter_map(|id| {
            Some(Disturbance { body: None, bounds: Aabb::from_points(&self.soft(id).state.x)? })
        });
        colliders.chain(soft).collect()
    }

    /// True if a collider moves fast enough to wake others.
    fn is_collider_moving(&self, id: ColliderId) -> bool {
        let motion = &self.motions[id.index()];
        let threshold = match self.collider(id).parent {
            BodyId::World | BodyId::Soft(_) => f64::INFINITY,
            BodyId::Kinematic(_) => WAKING_SPEED,
            BodyId::Link(link) if self.articulation(link.articulation).is_driven() => WAKING_SPEED,
            BodyId::Rigid(_) | BodyId::Link(_) => self.params.sleep_speed,
        };
        motion.linear.norm() + motion.angular.norm() > threshold
    }

    /// True if a body that touches a collider must stay awake.
    ///
    /// A driven link keeps a body awake even while both are still: the link needs the body's force in every step, and
    /// so does the sensor on it.
    fn keeps_awake(&self, id: ColliderId) -> bool {
        let is_driven = match self.collider(id).parent {
            BodyId::Link(link) => self.articulation(link.articulation).is_driven(),
            _ => false,
        };
        is_driven || self.is_collider_moving(id)
    }

    /// True if a soft body moves fast enough to wake others.
    fn is_soft_moving(&self, id: SoftId) -> bool {
        let soft = self.soft(id);
        !soft.is_asleep() && soft.state.max_speed() > self.params.sleep_speed
    }

    /// Puts bodies to sleep that were slow, and touched nothing that moves, for long enough.
    pub(super) fn put_resting_to_sleep(&mut self) {
        if !self.params.sleeping {
            return;
        }
        let (dt, delay) = (self.params.dt, self.params.sleep_delay);
        for id in self.soft_ids() {
            if self.soft(id).is_asleep() {
                continue;
            }
            let contact = self.soft_resting_contact(id);
            let moved = contact.is_disturbed || self.is_soft_moving(id);
            let soft = &mut self.soft[id.index()];
            soft.sleep.slow_time = if moved { 0.0 } else { soft.sleep.slow_time + dt };
            if soft.sleep.slow_time >= delay && contact.touches {
                soft.sleep.is_asleep = true;
                soft.state.v.iter_mut().for_each(|v| *v = Vec3::zeros());
            }
        }
        for id in self.rigid_ids() {
            if self.rigid(id).is_asleep() {
                continue;
            }
            let contact = self.rigid_resting_contact(|body| body == BodyId::Rigid(id));
            let rigid = &mut self.rigid[id.index()];
            let moved =
                contact.is_disturbed || rigid.state.v.norm() + rigid.state.w.norm() > self.params.sleep_speed;
            rigid.sleep.slow_time = if moved { 0.0 } else { rigid.sleep.slow_time + dt };
            if rigid.sleep.slow_time >= delay && contact.touches {
                rigid.sleep.is_asleep = true;
                (rigid.state.v, rigid.state.w) = (Vec3::zeros(), Vec3::zeros());
            }
        }
        for id in self.articulation_ids() {
            if self.articulation(id).is_asleep() || self.articulation(id).is_driven() {
                continue;
            }
            let contact = self.rigid_resting_contact(|body| body.is_link_of(id));
            let articulation = &mut self.articulations[id.index()];
            let moved = contact.is_disturbed || articulation.state.v.amax() > self.params.sleep_speed;
            articulation.sleep.slow_time = if moved { 0.0 } else { articulation.sleep.slow_time + dt };
            if articulation.sleep.slow_time >= delay {
                articulation.sleep.is_asleep = true;
                articulation.state.v.fill(0.0);
            }
        }
    }

    /// Contacts of a soft body.
    fn soft_resting_contact(&self, id: SoftId) -> RestingContact {
        let mut contact = RestingContact::default();
        for row in &self.rows {
            let partner = match row.partner {
                partner if row.soft == id => partner,
                ContactPartner::Soft(other) if other == id => row.soft.into(),
                _ => continue,
            };
            contact.touches = true;
            contact.is_disturbed |= match partner {
                ContactPartner::Collider(collider) => self.keeps_awake(collider),
                ContactPartner::Soft(other) => self.is_soft_moving(other),
            };
        }
        contact
    }

    /// Contacts of a rigid body or of the links of an articulation.
    fn rigid_resting_contact(&self, own: impl Fn(BodyId) -> bool) -> RestingContact {
        let mut contact = RestingContact::default();
        for id in self.touching_colliders(&own) {
            contact.touches = true;
            contact.is_disturbed |= self.keeps_awake(id);
        }
        for row in &self.rows {
            let ContactPartner::Collider(id) = row.partner else { continue };
            if own(self.collider(id).parent) {
                contact.touches = true;
                contact.is_disturbed |= self.is_soft_moving(row.soft);
            }
        }
        contact
    }
}
