//! Sleeping: a soft body that rests costs nothing until something that moves comes near.

use super::World;
use crate::{geometry::shape::Aabb, physics::contact::Mover};

/// Speed above which a mover wakes what it touches, m/s (and rad/s at a lever of 1 m).
const STIRRING: f64 = 1e-5;
/// Distance at which it does, m.
const NEAR: f64 = 3e-3;

impl World {
    /// Wakes bodies near movers that move.
    pub(super) fn wake(&mut self) {
        for soft in self.soft.iter_mut().filter(|s| s.asleep) {
            let Some(around) = Aabb::around(&soft.body.x) else { continue };
            let around = around.grown(NEAR);
            let stirred = self.colliders.iter().zip(&self.moving).any(|(collider, moving)| {
                collider.mover != Mover::Static
                    && moving.linear.norm() + moving.angular.norm() > STIRRING
                    && overlap(&around, &collider.bounds.moved(&moving.pose))
            });
            if stirred {
                soft.asleep = false;
                soft.slow_for = 0.0;
            }
        }
    }

    /// Lets bodies fall asleep that have been slow for long enough.
    pub(super) fn fall_asleep(&mut self) {
        if !self.params.sleeping {
            return;
        }
        let (dt, speed, after) = (self.params.dt, self.params.sleep_speed, self.params.sleep_after);
        let still: Vec<bool> = self
            .moving
            .iter()
            .zip(&self.colliders)
            .map(|(m, c)| c.mover == Mover::Static || m.linear.norm() + m.angular.norm() <= STIRRING)
            .collect();
        for (index, soft) in self.soft.iter_mut().enumerate().filter(|(_, s)| !s.asleep) {
            let moved = soft.body.max_speed() > speed
                || self.rows.iter().any(|row| row.soft == index && !still[row.partner as usize]);
            soft.slow_for = if moved { 0.0 } else { soft.slow_for + dt };
            let touches = self.rows.iter().any(|row| row.soft == index);
            if soft.slow_for >= after && touches {
                soft.asleep = true;
                soft.body.v.iter_mut().for_each(|v| *v = crate::geometry::Vec3::zeros());
            }
        }
    }
}

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    (0..3).all(|i| a.min[i] <= b.max[i] && b.min[i] <= a.max[i])
}
