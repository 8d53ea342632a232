//! Constitutive laws: impulse, cost and curvature of contact points and scalar constraints as
//! functions of their velocity.

use super::problem::{ContactPoint, ScalarConstraint};
use softvt_geometry::{Mat3, Vec3};

/// Impulse and cost of a contact point at a velocity.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactResponse {
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
    /// Normal: the spring at the end of the step with dissipation, `γ = dt k (−gap − (dt + τ) v_n)₊`. Tangent: with
    /// `z = s + (dt + τ) v_t` the spring `−dt k_t z`, cut off at the lagged bound `μ γ_n` (a Huber cost in `z`).
    #[inline]
    pub(super) fn contact(&self, point: &ContactPoint, v: &Vec3) -> Option<ContactResponse> {
        let n = &point.normal;
        let vn = n.dot(v);
        let depth = -point.gap - self.dt_plus_tau * vn;
        let bound = point.mu * point.previous_normal_impulse;
        if depth <= 0.0 && bound <= 0.0 {
            return None;
        }
        let depth = depth.max(0.0);
        let normal = self.dt * point.stiffness * depth;
        let mut response = ContactResponse {
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
    fn apply_friction(&self, response: &mut ContactResponse, c: f64, bound: f64) {
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
    pub(super) fn curvature(&self, point: &ContactPoint, response: &ContactResponse) -> Mat3 {
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

/// The segments of the force law of a scalar constraint.
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

    /// Slope of the cost at `v`, with `segment` continued beyond its ends.
    pub(super) fn slope(&self, segment: LinearSegment, dt: f64, v: f64) -> f64 {
        match segment {
            LinearSegment::Lower => -dt * self.min_force,
            LinearSegment::Upper => -dt * self.max_force,
            LinearSegment::Linear => -dt * self.unlimited(dt, v),
        }
    }

    /// Curvature of the cost on `segment`.
    pub(super) fn curvature(&self, segment: LinearSegment, dt: f64) -> f64 {
        if segment == LinearSegment::Linear { dt * (self.stiffness * dt + self.damping) } else { 0.0 }
    }

    /// Force at velocity `v`: `clamp(k (e − dt v) + d (v_t − v), min, max)`.
    pub(crate) fn force_at(&self, dt: f64, v: f64) -> f64 {
        self.unlimited(dt, v).clamp(self.min_force, self.max_force)
    }

    /// Cost at velocity `v`.
    pub(super) fn cost(&self, dt: f64, v: f64) -> f64 {
        let gain = self.stiffness * dt + self.damping;
        let (unlimited, force) = (self.unlimited(dt, v), self.force_at(dt, v));
        // d(cost)/dv = −dt force; outside of the limits the cost continues linearly.
        if gain > 0.0 {
            dt / gain * (0.5 * force * force + force * (unlimited - force))
        } else {
            -dt * force * v
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point(gap: f64, offset: [f64; 2], previous_normal_impulse: f64) -> ContactPoint {
        ContactPoint {
            normal: Vec3::z(),
            stiffness: 500.0,
            shear_stiffness: 250.0,
            gap,
            offset: Vec3::new(offset[0], offset[1], 0.0),
            mu: 1.2,
            previous_normal_impulse,
            ..ContactPoint::default()
        }
    }

    proptest! {
        #[test]
        fn impulse_is_minus_the_gradient_and_curvature_its_derivative(
            v in prop::array::uniform3(-0.1f64..0.1), gap in -1e-3f64..1e-3, offset in prop::array::uniform2(-1e-3f64..1e-3),
            previous_normal_impulse in 0.0f64..5e-3,
        ) {
            let (law, v, p) = (ContactLaw::new(1.0 / 60.0, 0.01), Vec3::from(v), point(gap, offset, previous_normal_impulse));
            let open = ContactResponse {
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
                block: 0, index: 0, stiffness: 2000.0, damping: 100.0, error, target_velocity: 0.1, min_force: -70.0, max_force: 70.0,
            };
            let (dt, e) = (1.0 / 60.0, 1e-6);
            let slope = (row.cost(dt, v + e) - row.cost(dt, v - e)) / (2.0 * e);
            prop_assert!((slope + dt * row.force_at(dt, v)).abs() < 1e-5);
            let on_piece = row.slope(row.segment(dt, v), dt, v);
            prop_assert!((on_piece + dt * row.force_at(dt, v)).abs() < 1e-12);
        }
    }
}
