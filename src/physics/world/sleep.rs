//! Sleeping: a body that rests costs nothing until something that moves comes near.

use super::World;
use crate::{
    geometry::{Vec3, shape::Aabb},
    physics::contact::{Mover, Partner},
};

/// Speed above which a link or a prescribed frame wakes what it touches, m/s (and rad/s at a lever of 1 m).
const STIRRING: f64 = 1e-5;
/// Distance at which it does, m.
const NEAR: f64 = 3e-3;

impl World {
    /// Wakes bodies near others that move.
    pub(super) fn wake(&mut self) {
        if !self.soft.iter().any(|s| s.asleep) && !self.rigid.iter().any(|r| r.asleep) {
            return;
        }
        let stirring = self.stirring();
        for soft in self.soft.iter_mut().filter(|s| s.asleep) {
            let Some(around) = Aabb::around(&soft.body.x) else { continue };
            let around = around.grown(NEAR);
            if stirring.iter().any(|(_, bounds)| overlap(&around, bounds)) {
                soft.asleep = false;
                soft.slow_for = 0.0;
            }
        }
        for index in 0..self.rigid.len() {
            if !self.rigid[index].asleep {
                continue;
            }
            let mover = Mover::Rigid(index);
            let mut own = self.colliders.iter().zip(&self.moving).filter(|(c, _)| c.mover == mover);
            let near = own.any(|(collider, moving)| {
                let around = collider.bounds.moved(&moving.pose).grown(NEAR);
                stirring.iter().any(|(by, bounds)| *by != Some(mover) && overlap(&around, bounds))
            });
            let body = &self.rigid[index].body;
            // Somebody may have given it a push.
            if near || body.v != Vec3::zeros() || body.w != Vec3::zeros() {
                let rigid = &mut self.rigid[index];
                (rigid.asleep, rigid.slow_for) = (false, 0.0);
            }
        }
    }

    /// Everything that moves: its mover, if it is a collider, and its bounds.
    fn stirring(&self) -> Vec<(Option<Mover>, Aabb)> {
        let colliders = (0..self.colliders.len()).filter(|&id| self.stirs(id)).map(|id| {
            let collider = &self.colliders[id];
            (Some(collider.mover), collider.bounds.moved(&self.moving[id].pose))
        });
        let soft = (0..self.soft.len())
            .filter(|&index| self.is_lively(index))
            .filter_map(|index| Some((None, Aabb::around(&self.soft[index].body.x)?)));
        colliders.chain(soft).collect()
    }

    /// Whether a collider moves fast enough to wake others.
    fn stirs(&self, id: usize) -> bool {
        let moving = &self.moving[id];
        let least = match self.colliders[id].mover {
            Mover::Static => f64::INFINITY,
            Mover::Kinematic(_) | Mover::Link { .. } => STIRRING,
            Mover::Rigid(_) => self.params.sleep_speed,
        };
        moving.linear.norm() + moving.angular.norm() > least
    }

    /// Whether a body that touches a collider must stay awake. What a driven link holds does so even if it is still: the
    /// link needs its force at every step, and so does the sensor on it.
    fn keeps_awake(&self, id: usize) -> bool {
        matches!(self.colliders[id].mover, Mover::Link { .. }) || self.stirs(id)
    }

    /// Whether a soft body moves fast enough to wake others.
    fn is_lively(&self, soft: usize) -> bool {
        let soft = &self.soft[soft];
        !soft.asleep && soft.body.max_speed() > self.params.sleep_speed
    }

    /// Lets bodies fall asleep that have been slow, and touched nothing lively, for long enough.
    pub(super) fn fall_asleep(&mut self) {
        if !self.params.sleeping {
            return;
        }
        let (dt, after) = (self.params.dt, self.params.sleep_after);
        for index in 0..self.soft.len() {
            if self.soft[index].asleep {
                continue;
            }
            let (touches, stirred) = self.company_of_soft(index);
            let moved = stirred || self.is_lively(index);
            let soft = &mut self.soft[index];
            soft.slow_for = if moved { 0.0 } else { soft.slow_for + dt };
            if soft.slow_for >= after && touches {
                soft.asleep = true;
                soft.body.v.iter_mut().for_each(|v| *v = Vec3::zeros());
            }
        }
        for index in 0..self.rigid.len() {
            if self.rigid[index].asleep {
                continue;
            }
            let (touches, stirred) = self.company_of_rigid(index);
            let rigid = &mut self.rigid[index];
            let moved = stirred || rigid.body.v.norm() + rigid.body.w.norm() > self.params.sleep_speed;
            rigid.slow_for = if moved { 0.0 } else { rigid.slow_for + dt };
            if rigid.slow_for >= after && touches {
                rigid.asleep = true;
                (rigid.body.v, rigid.body.w) = (Vec3::zeros(), Vec3::zeros());
            }
        }
    }

    /// Whether a soft body touches anything, and anything that moves.
    fn company_of_soft(&self, index: usize) -> (bool, bool) {
        let mut company = (false, false);
        for row in &self.rows {
            let partner = match Partner::of(row.partner) {
                _ if row.soft == index => Partner::of(row.partner),
                Partner::Soft(other) if other == index => Partner::Soft(row.soft),
                _ => continue,
            };
            company.0 = true;
            company.1 |= match partner {
                Partner::Collider(id) => self.keeps_awake(id),
                Partner::Soft(other) => self.is_lively(other),
            };
        }
        company
    }

    /// The same for a rigid body.
    fn company_of_rigid(&self, index: usize) -> (bool, bool) {
        let mut company = (false, false);
        for id in self.touching(index) {
            company = (true, company.1 || self.keeps_awake(id));
        }
        for row in &self.rows {
            let Partner::Collider(id) = Partner::of(row.partner) else { continue };
            if self.colliders[id].mover == Mover::Rigid(index) {
                company = (true, company.1 || self.is_lively(row.soft));
            }
        }
        company
    }
}

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    (0..3).all(|i| a.min[i] <= b.max[i] && b.min[i] <= a.max[i])
}
