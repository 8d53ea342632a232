//! Sleeping: a body that rests costs nothing until something that moves comes near.

use super::World;
use crate::{
    geometry::{Aabb, Vec3},
    physics::contact::{Mover, Partner},
};

/// Speed above which a link or a prescribed frame wakes what it touches, m/s (and rad/s at a lever of 1 m).
const STIRRING: f64 = 1e-5;
/// Distance at which it does, m.
const NEAR: f64 = 3e-3;

impl World {
    /// Wakes bodies near others that move.
    pub(super) fn wake(&mut self) {
        let (soft, rigid) = (self.soft.iter().any(|s| s.asleep), self.rigid.iter().any(|r| r.asleep));
        if !soft && !rigid && !self.trees.iter().any(|t| t.asleep) {
            return;
        }
        let stirring = self.stirring();
        for soft in self.soft.iter_mut().filter(|s| s.asleep) {
            let Some(around) = Aabb::from_points(&soft.body.x) else { continue };
            let around = around.loosened(NEAR);
            if stirring.iter().any(|(_, bounds)| around.intersects(bounds)) {
                soft.asleep = false;
                soft.slow_for = 0.0;
            }
        }
        for index in 0..self.rigid.len() {
            if !self.rigid[index].asleep {
                continue;
            }
            let near = self.is_near(&stirring, |mover| mover == Mover::Rigid(index));
            let body = &self.rigid[index].body;
            // Somebody may have given it a push.
            if near || body.v != Vec3::zeros() || body.w != Vec3::zeros() {
                let rigid = &mut self.rigid[index];
                (rigid.asleep, rigid.slow_for) = (false, 0.0);
            }
        }
        for index in 0..self.trees.len() {
            if !self.trees[index].asleep {
                continue;
            }
            let near = self.is_near(&stirring, is_link_of(index));
            let tree = &mut self.trees[index];
            if near || tree.is_driven() || tree.state.v.iter().any(|&v| v != 0.0) {
                (tree.asleep, tree.slow_for) = (false, 0.0);
            }
        }
    }

    /// Whether any collider on movers that are `own` is near something else that stirs.
    fn is_near(&self, stirring: &[(Option<Mover>, Aabb)], own: impl Fn(Mover) -> bool) -> bool {
        let mut mine = self.colliders.iter().zip(&self.moving).filter(|(c, _)| own(c.mover));
        mine.any(|(collider, moving)| {
            let around = collider.bounds.transformed(&moving.pose).loosened(NEAR);
            stirring.iter().any(|(by, bounds)| !by.is_some_and(&own) && around.intersects(bounds))
        })
    }

    /// Everything that moves: its mover, if it is a collider, and its bounds.
    fn stirring(&self) -> Vec<(Option<Mover>, Aabb)> {
        let colliders = (0..self.colliders.len()).filter(|&id| self.stirs(id)).map(|id| {
            let collider = &self.colliders[id];
            (Some(collider.mover), collider.bounds.transformed(&self.moving[id].pose))
        });
        let soft = (0..self.soft.len())
            .filter(|&index| self.is_lively(index))
            .filter_map(|index| Some((None, Aabb::from_points(&self.soft[index].body.x)?)));
        colliders.chain(soft).collect()
    }

    /// Whether a collider moves fast enough to wake others.
    fn stirs(&self, id: usize) -> bool {
        let moving = &self.moving[id];
        let least = match self.colliders[id].mover {
            Mover::Static => f64::INFINITY,
            Mover::Kinematic(_) => STIRRING,
            Mover::Link { tree, .. } if self.trees[tree].is_driven() => STIRRING,
            Mover::Rigid(_) | Mover::Link { .. } => self.params.sleep_speed,
        };
        moving.linear.norm() + moving.angular.norm() > least
    }

    /// Whether a body that touches a collider must stay awake. What a driven link holds does so even if it is still: the
    /// link needs its force at every step, and so does the sensor on it.
    fn keeps_awake(&self, id: usize) -> bool {
        let driven = match self.colliders[id].mover {
            Mover::Link { tree, .. } => self.trees[tree].is_driven(),
            _ => false,
        };
        driven || self.stirs(id)
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
            let (touches, stirred) = self.company_of(|mover| mover == Mover::Rigid(index));
            let rigid = &mut self.rigid[index];
            let moved = stirred || rigid.body.v.norm() + rigid.body.w.norm() > self.params.sleep_speed;
            rigid.slow_for = if moved { 0.0 } else { rigid.slow_for + dt };
            if rigid.slow_for >= after && touches {
                rigid.asleep = true;
                (rigid.body.v, rigid.body.w) = (Vec3::zeros(), Vec3::zeros());
            }
        }
        for index in 0..self.trees.len() {
            if self.trees[index].asleep || self.trees[index].is_driven() {
                continue;
            }
            let stirred = self.company_of(is_link_of(index)).1;
            let tree = &mut self.trees[index];
            let moved = stirred || tree.state.v.amax() > self.params.sleep_speed;
            tree.slow_for = if moved { 0.0 } else { tree.slow_for + dt };
            if tree.slow_for >= after {
                tree.asleep = true;
                tree.state.v.fill(0.0);
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

    /// The same for a rigid body or a joint tree, by its movers.
    fn company_of(&self, own: impl Fn(Mover) -> bool) -> (bool, bool) {
        let mut company = (false, false);
        for id in self.touching(&own) {
            company = (true, company.1 || self.keeps_awake(id));
        }
        for row in &self.rows {
            let Partner::Collider(id) = Partner::of(row.partner) else { continue };
            if own(self.colliders[id].mover) {
                company = (true, company.1 || self.is_lively(row.soft));
            }
        }
        company
    }
}

/// Whether a mover is a link of a tree.
fn is_link_of(index: usize) -> impl Fn(Mover) -> bool {
    move |mover| matches!(mover, Mover::Link { tree, .. } if tree == index)
}
