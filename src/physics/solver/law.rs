//! Constitutive laws: impulse, cost and curvature of contact points and scalar constraints as
//! functions of their velocity.

use wide::f64x4;

use super::{
    lanes::{PointPack, Vec3x4},
    problem::ScalarConstraint,
};
use softvt_geometry::Mat3;

/// Impulses and costs of a pack of contact points at their velocities; zero for separated points.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ContactResponse {
    /// Impulses on `a`, N s.
    pub impulse: Vec3x4,
    /// Costs, J.
    pub cost: f64x4,
    /// Normal parts of the impulses, N s.
    pub normal: f64x4,
    /// Mask of the points at which friction is at its bound.
    pub is_slipping: f64x4,
    /// Stretch `z` of the tangential springs, m.
    stretch: Vec3x4,
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

    /// Response of points at relative velocities `v`; `None` if all of them are separated and carried no normal impulse
    /// in the previous pass.
    ///
    /// Normal: the spring at the end of the step with dissipation, `γ = dt k (−gap − (dt + τ) v_n)₊`. Tangent: with
    /// `z = s + (dt + τ) v_t` the spring `−dt k_t z`, cut off at the lagged bound `μ γ_n` (a Huber cost in `z`). Bonded
    /// points have the same springs without the cut-offs.
    #[inline(always)]
    pub(super) fn contact(&self, points: &PointPack, v: Vec3x4) -> Option<ContactResponse> {
        let [dt, dt_plus_tau, inverse] = [self.dt, self.dt_plus_tau, self.inverse].map(f64x4::splat);
        let (n, bound) = (points.normal, points.friction_bound);
        let vn = n.dot(v);
        let depth = (-points.gap - dt_plus_tau * vn).fast_max(points.least_depth);
        let is_bound = bound.simd_gt(f64x4::ZERO);
        if !(depth.simd_gt(f64x4::ZERO) | is_bound).any() {
            return None;
        }
        let normal = dt * points.stiffness * depth;
        let mut response = ContactResponse {
            impulse: n * normal,
            cost: f64x4::HALF * normal * depth * inverse,
            normal,
            is_slipping: f64x4::ZERO,
            stretch: Vec3x4::default(),
        };
        if is_bound.any() {
            response.stretch = points.offset + (v - n * vn) * dt_plus_tau;
            self.apply_friction(&mut response, dt * points.shear_stiffness, bound);
        }
        Some(response)
    }

    /// Adds friction: tangential springs of stiffness `c` (N s/m) whose impulses are at most `bound` (N s).
    #[inline(always)]
    fn apply_friction(&self, response: &mut ContactResponse, c: f64x4, bound: f64x4) {
        let (z, inverse) = (response.stretch, f64x4::splat(self.inverse));
        let square = z.dot(z);
        let is_sticking = (c * c * square).simd_le(bound * bound);
        let size = square.sqrt();
        response.impulse = response.impulse - z * is_sticking.select(c, bound / size);
        let sticking_cost = f64x4::HALF * c * square;
        let slipping_cost = bound * (size - f64x4::HALF * bound / c);
        response.cost += is_sticking.select(sticking_cost, slipping_cost) * inverse;
        response.is_slipping = !is_sticking & bound.simd_gt(f64x4::ZERO);
    }

    /// Hessian of the cost with respect to the velocity of the point in one lane, at a response of its pack, kg; `None`
    /// for a separated point.
    pub(super) fn curvature(
        &self,
        points: &PointPack,
        response: &ContactResponse,
        lane: usize,
    ) -> Option<Mat3> {
        let of = |lanes: f64x4| lanes.to_array()[lane];
        let bound = of(points.friction_bound);
        let is_pressed = of(response.normal) > 0.0 || bound.is_infinite();
        if !is_pressed && bound <= 0.0 {
            return None;
        }
        let n = points.normal.lane(lane);
        let onto_normal = n * n.transpose();
        let mut curvature = Mat3::zeros();
        if is_pressed {
            curvature = onto_normal * (self.dt * of(points.stiffness) * self.dt_plus_tau);
        }
        if bound <= 0.0 {
            return Some(curvature);
        }
        let plane = Mat3::identity() - onto_normal;
        Some(if response.is_slipping.to_bitmask() >> lane & 1 == 1 {
            let stretch = response.stretch.lane(lane);
            let size = stretch.norm();
            let direction = stretch / size;
            curvature + (plane - direction * direction.transpose()) * (bound * self.dt_plus_tau / size)
        } else {
            curvature + plane * (self.dt * of(points.shear_stiffness) * self.dt_plus_tau)
        })
    }
}

/// The segments of the force law of a scalar constraint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LinearSegment {
    /// At the smallest force.
    Lower,
    /// Between the limits, linear in the velocity.
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
    use crate::solver::ContactPoint;
    use proptest::prelude::*;
    use softvt_geometry::Vec3;

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
            previous_normal_impulse in 0.0f64..5e-3, is_bonded: bool,
        ) {
            let (law, v) = (ContactLaw::new(1.0 / 60.0, 0.01), Vec3::from(v));
            let separated = point(1.0, [0.0; 2], 0.0);
            // The second of three points; the fourth lane is empty.
            let touching = ContactPoint { is_bonded, ..point(gap, offset, previous_normal_impulse) };
            let (lane, pack) = (1, PointPack::new(&[separated, touching, separated], [4, 0]));
            let response = |v: &Vec3| law.contact(&pack, Vec3x4::splat(v)).unwrap_or_default();
            let at = response(&v);
            for other in [0, 2, 3] {
                let impulse = at.impulse.lane(other);
                prop_assert!(impulse == Vec3::zeros() && at.cost.to_array()[other] == 0.0, "{at:?}");
            }
            let spring = 250.0 / 60.0 * (Vec3::new(offset[0], offset[1], 2.0 * gap) + v.component_mul(&Vec3::new(1.0, 1.0, 2.0)) * law.dt_plus_tau);
            prop_assert!(!is_bonded || (at.impulse.lane(lane) + spring).norm() < 1e-12, "{at:?}");
            let curvature = law.curvature(&pack, &at, lane).unwrap_or_default();
            let cost = |response: &ContactResponse| response.cost.to_array()[lane];
            let kind = |response: &ContactResponse| {
                (response.normal.to_array()[lane] > 0.0, response.is_slipping.to_bitmask() >> lane & 1)
            };
            let e = 1e-6;
            for i in 0..3 {
                let moved = |s: f64| response(&(v + Vec3::ith(i, s)));
                let (up, down) = (moved(e), moved(-e));
                prop_assert!(((cost(&up) - cost(&down)) / (2.0 * e) + at.impulse.lane(lane)[i]).abs() < 1e-6);
                let slope = (up.impulse - down.impulse).lane(lane) / (2.0 * e);
                let is_kink = kind(&up) != kind(&down);
                prop_assert!(is_kink || (slope + curvature.column(i)).norm() < 1e-3, "{slope} {curvature}");
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
