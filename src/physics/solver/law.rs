//! The laws of the rows: impulse, cost and curvature as functions of the row's velocity.

use super::problem::ContactPoint;
use crate::geometry::{Mat3, Vec3};

/// What a contact point answers to a velocity.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConstraintResponse {
    /// Impulse on `a`, N s.
    pub impulse: Vec3,
    /// Cost, J.
    pub cost: f64,
    /// Normal part of the impulse, N s.
    pub normal: f64,
    /// Whether friction is at its bound.
    pub is_slipping: bool,
    /// Stretch `z` of the tangential spring, m.
    stretch: Vec3,
}

/// The law of contact for one step length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Law {
    dt: f64,
    span: f64,
    per_span: f64,
}

impl Law {
    /// The law for steps of `dt` and a dissipation time of `dissipation_time`, s.
    pub(super) fn new(dt: f64, dissipation_time: f64) -> Self {
        Self { dt, span: dt + dissipation_time, per_span: 1.0 / (dt + dissipation_time) }
    }

    /// ConstraintResponse of a point at relative velocity `v`; `None` if it is open and nothing of the last pass is left to rub.
    ///
    /// Normal: the spring at the end of the step with dissipation, `γ = dt k (−φ − (dt + τ) v_n)₊`. Tangent: with
    /// `z = s + (dt + τ) v_t` the spring `−dt k_t z`, cut off at the previous_normal_impulse bound `μ γ_n` (a Huber cost in `z`).
    #[inline]
    pub(super) fn contact(&self, point: &ContactPoint, v: &Vec3) -> Option<ConstraintResponse> {
        let n = &point.normal;
        let vn = n.dot(v);
        let depth = -point.gap - self.span * vn;
        let bound = point.mu * point.previous_normal_impulse;
        if depth <= 0.0 && bound <= 0.0 {
            return None;
        }
        let depth = depth.max(0.0);
        let normal = self.dt * point.stiffness * depth;
        let mut answer = ConstraintResponse {
            impulse: n * normal,
            cost: 0.5 * normal * depth * self.per_span,
            normal,
            is_slipping: false,
            stretch: Vec3::zeros(),
        };
        if bound > 0.0 {
            answer.stretch = point.offset + (v - n * vn) * self.span;
            self.rub(&mut answer, self.dt * point.shear_stiffness, bound);
        }
        Some(answer)
    }

    #[inline]
    fn rub(&self, answer: &mut ConstraintResponse, c: f64, bound: f64) {
        let z = answer.stretch;
        let square = z.norm_squared();
        if c * c * square <= bound * bound {
            answer.impulse -= z * c;
            answer.cost += 0.5 * c * square * self.per_span;
        } else {
            let size = square.sqrt();
            answer.impulse -= z * (bound / size);
            answer.cost += bound * self.per_span * (size - 0.5 * bound / c);
            answer.is_slipping = true;
        }
    }

    /// Curvature of the cost at an answer of this point, kg.
    pub(super) fn curvature(&self, point: &ContactPoint, answer: &ConstraintResponse) -> Mat3 {
        let n = &point.normal;
        let onto_normal = n * n.transpose();
        let mut curvature = Mat3::zeros();
        if answer.normal > 0.0 {
            curvature = onto_normal * (self.dt * point.stiffness * self.span);
        }
        let bound = point.mu * point.previous_normal_impulse;
        if bound <= 0.0 {
            return curvature;
        }
        let plane = Mat3::identity() - onto_normal;
        if answer.is_slipping {
            let size = answer.stretch.norm();
            let direction = answer.stretch / size;
            curvature + (plane - direction * direction.transpose()) * (bound * self.span / size)
        } else {
            curvature + plane * (self.dt * point.shear_stiffness * self.span)
        }
    }
}

/// A row on one velocity of one block.
#[derive(Clone, Copy, Debug)]
pub struct ScalarConstraint {
    /// The block.
    pub block: usize,
    /// Index of the velocity in the block.
    pub index: usize,
    /// Spring stiffness (N/m or N m/rad).
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
pub enum LinearSegment {
    /// At the least force.
    Least,
    /// Between the two.
    Inside,
    /// At the greatest force.
    Greatest,
}

impl ScalarConstraint {
    /// Force without the range.
    fn free(&self, dt: f64, v: f64) -> f64 {
        self.stiffness * self.error + self.damping * self.target_velocity
            - (self.stiffness * dt + self.damping) * v
    }

    /// The segment that acts at velocity `v`.
    pub fn segment(&self, dt: f64, v: f64) -> LinearSegment {
        match self.free(dt, v) {
            free if free <= self.min_force => LinearSegment::Least,
            free if free >= self.max_force => LinearSegment::Greatest,
            _ => LinearSegment::Inside,
        }
    }

    /// Slope and curvature of the cost at `v` if it went on there as on `segment`.
    pub fn on(&self, segment: LinearSegment, dt: f64, v: f64) -> (f64, f64) {
        match segment {
            LinearSegment::Least => (-dt * self.min_force, 0.0),
            LinearSegment::Greatest => (-dt * self.max_force, 0.0),
            LinearSegment::Inside => (-dt * self.free(dt, v), dt * (self.stiffness * dt + self.damping)),
        }
    }

    /// Force at velocity `v`: `clamp(k (e − dt v) + d (v_t − v), range)`, and its cost.
    pub fn answer(&self, dt: f64, v: f64) -> (f64, f64) {
        let gain = self.stiffness * dt + self.damping;
        let free = self.free(dt, v);
        let force = free.clamp(self.min_force, self.max_force);
        // d(cost)/dv = −dt force; outside of the range the cost goes on linearly.
        let cost = if gain > 0.0 {
            dt / gain * (0.5 * force * force + force * (free - force))
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
            let (law, v, p) = (Law::new(1.0 / 60.0, 0.01), Vec3::from(v), point(gap, offset, previous_normal_impulse));
            let open = ConstraintResponse {
                impulse: Vec3::zeros(), cost: 0.0, normal: 0.0, is_slipping: false, stretch: Vec3::zeros(),
            };
            let answer = |v: &Vec3| law.contact(&p, v).unwrap_or(open);
            let at = answer(&v);
            let curvature = law.curvature(&p, &at);
            let e = 1e-6;
            for i in 0..3 {
                let moved = |s: f64| answer(&(v + Vec3::ith(i, s)));
                let (up, down) = (moved(e), moved(-e));
                prop_assert!(((up.cost - down.cost) / (2.0 * e) + at.impulse[i]).abs() < 1e-6);
                let kink = (up.normal > 0.0) != (down.normal > 0.0) || up.is_slipping != down.is_slipping;
                let slope = (up.impulse - down.impulse) / (2.0 * e);
                prop_assert!(kink || (slope + curvature.column(i)).norm() < 1e-3, "{slope} {curvature}");
            }
        }

        #[test]
        fn a_scalar_row_is_the_gradient_of_its_cost(v in -2.0f64..2.0, error in -0.1f64..0.1) {
            let row = ScalarConstraint {
                block: 0, index: 0, stiffness: 2000.0, damping: 100.0, error, target_velocity: 0.1, min_force: -70.0, max_force: 70.0, force: 0.0,
            };
            let (dt, e) = (1.0 / 60.0, 1e-6);
            let slope = (row.answer(dt, v + e).1 - row.answer(dt, v - e).1) / (2.0 * e);
            prop_assert!((slope + dt * row.answer(dt, v).0).abs() < 1e-5);
            let (on_piece, _) = row.on(row.segment(dt, v), dt, v);
            prop_assert!((on_piece + dt * row.answer(dt, v).0).abs() < 1e-12);
        }
    }
}
