//! Policies that need no one: the two baselines that must fail.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Action, ActionChunk, Observation, Policy, PolicyError};
use crate::geometry::Vec3;

/// Stays where it is with the gripper open.
#[derive(Debug, Default)]
pub struct NoopPolicy {
    hold: Option<(Vec3, Vec3)>,
}

impl Policy for NoopPolicy {
    fn name(&self) -> &str {
        "noop"
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        let (position_b, axis_angle_b) =
            *self.hold.get_or_insert((observation.ee_position_b, observation.ee_axis_angle_b));
        Ok(Action { position_b, axis_angle_b, closure: 0.0 }.into())
    }
}

/// Largest move of a control step along each axis, m.
const STRIDE: f64 = 0.02;

/// Wanders at random over the table, opening and closing.
#[derive(Debug)]
pub struct RandomPolicy {
    rng: ChaCha8Rng,
    closure: f64,
    hold: Option<Vec3>,
}

impl RandomPolicy {
    /// A walk from `seed`.
    pub fn new(seed: u64) -> Self {
        Self { rng: ChaCha8Rng::seed_from_u64(seed), closure: 0.0, hold: None }
    }

    fn uniform(&mut self) -> f64 {
        // 53 random bits, as a number in [0, 1).
        (self.rng.random::<u64>() >> 11) as f64 / (1u64 << 53) as f64
    }
}

impl Policy for RandomPolicy {
    fn name(&self) -> &str {
        "random"
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        let axis_angle_b = *self.hold.get_or_insert(observation.ee_axis_angle_b);
        let stride = Vec3::from_fn(|_, _| STRIDE * (2.0 * self.uniform() - 1.0));
        let mut position_b = observation.ee_position_b + stride;
        // Above the table top and below the shoulder; elsewhere a wall of wood would stop the walk.
        position_b.z = position_b.z.clamp(0.03, 0.5);
        if self.uniform() < 0.05 {
            self.closure = self.uniform();
        }
        Ok(Action { position_b, axis_angle_b, closure: self.closure }.into())
    }
}
