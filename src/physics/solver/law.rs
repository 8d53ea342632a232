//! Constitutive laws: impulse, cost and curvature of contact points and scalar constraints as
//! functions of their velocity.

use super::problem::ContactPoint;
use crate::geometry::{Mat3, Vec3};

/// Impulse and cost of a contact point at a velocity.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConstraintResponse {
    /// Impulse on `a`, N s.
    pub impulse: Vec3,
    /// Cost, J.
    pub cost: f64,
    /// Normal part of the impulse, N s.
    pub normal: f64,
    /// True if friction is at its bound.
    pub is_slipping: bool,
    /// Stretch `z` of the tangential spring, m.
    stretch: Vec3,
}

/// The contact law for one step length.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactLaw {
    dt: f64,
    /// `dt + τ`, s.
    dt_plus_tau: f64,
    /// `1 / (dt + τ)`, 1/s.
    inverse: f64,
}

impl ContactLaw {
    /// The law for steps of `dt` and the dissipation time τ of the springs, s.
    pub(super) fn new(dt: f64, dissipation_time: f64) -> Self {
        Self { dt, dt_plus_tau: dt + dissipation_time, inverse: 1.0 / (dt + dissipation_time) }
    }

    /// Response of a point at relative velocity `v`; `None` if the point is separated and carried no normal impulse
    /// in the previous pass.
    ///
    /// Normal: the spring at the end of the step with dissipation, `γ = dt k (−φ − (dt + τ) v_n)₊`. Tangent: with
    /// `z = s + (dt + τ) v_t` the spring `−dt k_t z`, cut off at the lagged bound `μ γ_n` (a Huber cost in `z`).
    #[inline]
    pub(super) fn contact(&self, point: &ContactPoint, v: &Vec3) -> Option<ConstraintResponse> {
        let n = &point.normal;
        let vn = n.dot(v);
        let depth = -point.gap - self.dt_plus_tau * vn;
        let bound = point.mu * point.previous_normal_impulse;
        if depth <= 0.0 && bound <= 0.0 {
            return None;
        }
        let depth = depth.max(0.0);
        let normal = self.dt * point.stiffness * depth;
        let mut response = ConstraintResponse {
            impulse: n * normal,
            cost: 0.5 * normal * depth * self.inverse,
            normal,
            is_slipping: false,
            stretch: Vec3::zeros(),
        };
        if bound > 0.0 {
            response.stretch = point.offset + (v - n * vn) * self.dt_plus_tau;
            self.apply_friction(&mut response, self.dt * point.shear_stiffness, bound);
        }
        Some(response)
    }

    /// Adds friction: a tangential spring of stiffness `c` (N s/m) whose impulse is at most `bound` (N s).
    #[inline]
    fn apply_friction(&self, response: &mut ConstraintResponse, c: f64, bound: f64) {
        let z = response.stretch;
        let square = z.norm_squared();
        if c * c * square <= bound * bound {
            response.impulse -= z * c;
            response.cost += 0.5 * c * square * self.inverse;
        } else {
            let size = square.sqrt();
            response.impulse -= z * (bound / size);
            response.cost += bound * self.inverse * (size - 0.5 * bound / c);
            response.is_slipping = true;
        }
    }

    /// Hessian of the cost with respect to the velocity at a response of this point, kg.
    pub(super) fn curvature(&self, point: &ContactPoint, response: &ConstraintResponse) -> Mat3 {
        let n = &point.normal;
        let onto_normal = n * n.transpose();
        let mut curvature = Mat3::zeros();
        if response.normal > 0.0 {
            curvature = onto_normal * (self.dt * point.stiffness * self.dt_plus_tau);
        }
        let bound = point.mu * point.previous_normal_impulse;
        if bound <= 0.0 {
            return curvature;
        }
        let plane = Mat3::identity() - onto_normal;
        if response.is_slipping {
            let size = response.stretch.norm();
            let direction = response.stretch / size;
            curvature + (plane - direction * direction.transpose()) * (bound * self.dt_plus_tau / size)
        } else {
            curvature + plane * (self.dt * point.shear_stiffness * self.dt_plus_tau)
        }
    }
}

/// A spring–damper with a force limit on one velocity of one block: a joint drive, a stop, a speed limit, dry friction.
#[derive(Clone, Copy, Debug)]
pub struct ScalarConstraint {
    /// The block.
    pub block: usize,
    /// Index of the velocity in the block.
    pub index: usize,
    /// Stiffness (N/m or N m/rad).
    pub stiffness: f64,
    /// Damping (N s/m or N m s/rad).
    pub damping: f64,
    /// Target minus position at the start of the step (m or rad).
    pub error: f64,
    /// Target velocity (m/s or rad/s) of the damping.
    pub target_velocity: f64,
    /// Smallest force (N or N m); 0 for a lower stop.
    pub min_force: f64,
    /// Largest force (N or N m); 0 for an upper stop.
    pub max_force: f64,
    /// Result: the force (N or N m).
    pub force: f64,
}

/// The segments of a scalar row's law: at its least force, on its line, at its greatest force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LinearSegment {
    /// At the smallest force.
    Lower,
    /// Between the limits.
    Linear,
    /// At the largest force.
    Upper,
}

impl ScalarConstraint {
    /// Force without limits.
    fn unlimited(&self, dt: f64, v: f64) -> f64 {
        self.stiffness * self.error + self.damping * self.target_velocity
            - (self.stiffness * dt + self.damping) * v
    }

    /// The segment that is active at velocity `v`.
    pub(super) fn segment(&self, dt: f64, v: f64) -> LinearSegment {
        match self.unlimited(dt, v) {
            force if force <= self.min_force => LinearSegment::Lower,
            force if force >= self.max_force => LinearSegment::Upper,
            _ => LinearSegment::Linear,
        }
    }

    /// Slope and curvature of the cost at `v`, with `segment` continued beyond its ends.
    pub(super) fn derivatives(&self, segment: LinearSegment, dt: f64, v: f64) -> (f64, f64) {
        match segment {
            LinearSegment::Lower => (-dt * self.min_force, 0.0),
            LinearSegment::Upper => (-dt * self.max_force, 0.0),
            LinearSegment::Linear => (-dt * self.unlimited(dt, v), dt * (self.stiffness * dt + self.damping)),
        }
    }

    /// Force at velocity `v`, `clamp(k (e − dt v) + d (v_t − v), min, max)`, and its cost.
    pub(super) fn force_and_cost(&self, dt: f64, v: f64) -> (f64, f64) {
        let gain = self.stiffness * dt + self.damping;
        let unlimited = self.unlimited(dt, v);
        let force = unlimited.clamp(self.min_force, self.max_force);
        // d(cost)/dv = −dt force; outside of the limits the cost continues linearly.
        let cost = if gain > 0.0 {
            dt / gain * (0.5 * force * force + force * (unlimited - force))
        } else {
            -dt * force * v
        };
        (force, cost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point(gap: f64, offset: [f64; 2], previous_normal_impulse: f64) -> ContactPoint {
        ContactPoint {
            weights_a: [0.0; 8],
            weights_b: [0.0; 8],
            p: Vec3::zeros(),
            normal: Vec3::z(),
            drift: Vec3::zeros(),
            stiffness: 500.0,
            shear_stiffness: 250.0,
            gap,
            offset: Vec3::new(offset[0], offset[1], 0.0),
            mu: 1.2,
            previous_normal_impulse,
            normal_impulse: 0.0,
            shear_impulse: Vec3::zeros(),
            velocity: Vec3::zeros(),
            is_slipping: false,
        }
    }

    proptest! {
        #[test]
        fn impulse_is_minus_the_gradient_and_curvature_its_derivative(
            v in prop::array::uniform3(-0.1f64..0.1), gap in -1e-3f64..1e-3, offset in prop::array::uniform2(-1e-3f64..1e-3),
            previous_normal_impulse in 0.0f64..5e-3,
        ) {
            let (law, v, p) = (ContactLaw::new(1.0 / 60.0, 0.01), Vec3::from(v), point(gap, offset, previous_normal_impulse));
            let open = ConstraintResponse {
                impulse: Vec3::zeros(), cost: 0.0, normal: 0.0, is_slipping: false, stretch: Vec3::zeros(),
            };
            let response = |v: &Vec3| law.contact(&p, v).unwrap_or(open);
            let at = response(&v);
            let curvature = law.curvature(&p, &at);
            let e = 1e-6;
            for i in 0..3 {
                let moved = |s: f64| response(&(v + Vec3::ith(i, s)));
                let (up, down) = (moved(e), moved(-e));
                prop_assert!(((up.cost - down.cost) / (2.0 * e) + at.impulse[i]).abs() < 1e-6);
                let kink = (up.normal > 0.0) != (down.normal > 0.0) || up.is_slipping != down.is_slipping;
                let slope = (up.impulse - down.impulse) / (2.0 * e);
                prop_assert!(kink || (slope + curvature.column(i)).norm() < 1e-3, "{slope} {curvature}");
            }
        }

        #[test]
        fn a_scalar_force_is_the_gradient_of_its_cost(v in -2.0f64..2.0, error in -0.1f64..0.1) {
            let row = ScalarConstraint {
                block: 0, index: 0, stiffness: 2000.0, damping: 100.0, error, target_velocity: 0.1, min_force: -70.0, max_force: 70.0, force: 0.0,
            };
            let (dt, e) = (1.0 / 60.0, 1e-6);
            let slope = (row.force_and_cost(dt, v + e).1 - row.force_and_cost(dt, v - e).1) / (2.0 * e);
            prop_assert!((slope + dt * row.force_and_cost(dt, v).0).abs() < 1e-5);
            let (on_piece, _) = row.derivatives(row.segment(dt, v), dt, v);
            prop_assert!((on_piece + dt * row.force_and_cost(dt, v).0).abs() < 1e-12);
        }
    }
}
