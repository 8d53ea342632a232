//! The laws of the rows: impulse, cost and curvature as functions of the row's velocity.

use super::problem::Point;
use crate::geometry::{Mat3, Vec3};

/// What a row answers to a velocity.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// Impulse on `a`, N s.
    pub impulse: Vec3,
    /// Cost, J.
    pub cost: f64,
    /// Curvature of the cost, kg.
    pub curvature: Mat3,
    /// Normal part of the impulse, N s.
    pub normal: f64,
    /// Whether friction is at its bound.
    pub slipping: bool,
}

/// Contact law of a point at relative velocity `v`.
///
/// Normal: the spring at the end of the step with dissipation, `γ = dt k (−φ − (dt + τ) v_n)₊`. Tangent: with
/// `z = s + (dt + τ) v_t` the spring `−dt k_t z`, cut off at the lagged bound `μ γ_n` (a Huber cost in `z`).
pub fn contact(point: &Point, dt: f64, tau: f64, v: &Vec3) -> Answer {
    let span = dt + tau;
    let n = &point.normal;
    let vn = n.dot(v);
    let c = dt * point.stiffness;
    let normal = (c * (-point.gap - span * vn)).max(0.0);
    let mut answer = Answer {
        impulse: n * normal,
        cost: 0.5 * normal * normal / (c * span).max(f64::MIN_POSITIVE),
        curvature: Mat3::zeros(),
        normal,
        slipping: false,
    };
    if normal > 0.0 {
        answer.curvature = n * n.transpose() * (c * span);
    }
    let bound = point.mu * point.lagged;
    if bound > 0.0 {
        let z = point.offset + (v - n * vn) * span;
        tangent(&mut answer, &z, n, dt * point.shear_stiffness, span, bound);
    }
    answer
}

fn tangent(answer: &mut Answer, z: &Vec3, n: &Vec3, c: f64, span: f64, bound: f64) {
    let size = z.norm();
    let plane = Mat3::identity() - n * n.transpose();
    if c * size <= bound {
        answer.impulse -= z * c;
        answer.cost += 0.5 * c * size * size / span;
        answer.curvature += plane * (c * span);
    } else {
        let direction = z / size;
        answer.impulse -= direction * bound;
        answer.cost += bound / span * (size - 0.5 * bound / c);
        answer.curvature += (plane - direction * direction.transpose()) * (bound * span / size);
        answer.slipping = true;
    }
}

/// A row on one velocity of one block.
#[derive(Clone, Copy, Debug)]
pub struct Scalar {
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
    /// Least and greatest force (N or N m); a limit stop has one of them at zero.
    pub range: (f64, f64),
    /// Result: the force (N or N m).
    pub force: f64,
}

impl Scalar {
    /// Force at velocity `v`: `clamp(k (e − dt v) + d (v_t − v), range)`, and the slope of its impulse, and its cost.
    pub fn answer(&self, dt: f64, v: f64) -> (f64, f64, f64) {
        let gain = self.stiffness * dt + self.damping;
        let base = self.stiffness * self.error + self.damping * self.target_velocity;
        let free = base - gain * v;
        let force = free.clamp(self.range.0, self.range.1);
        let inside = free > self.range.0 && free < self.range.1;
        // d(cost)/dv = −dt force; outside of the range the cost goes on linearly.
        let cost = if gain > 0.0 {
            dt / gain * (0.5 * force * force + force * (free - force))
        } else {
            -dt * force * v
        };
        (force, if inside { dt * gain } else { 0.0 }, cost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point(gap: f64, offset: [f64; 2], lagged: f64) -> Point {
        Point {
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
            lagged,
            normal_impulse: 0.0,
            shear_impulse: Vec3::zeros(),
            velocity: Vec3::zeros(),
            slipping: false,
        }
    }

    proptest! {
        #[test]
        fn impulse_is_minus_the_gradient_and_curvature_its_derivative(
            v in prop::array::uniform3(-0.1f64..0.1), gap in -1e-3f64..1e-3, offset in prop::array::uniform2(-1e-3f64..1e-3),
            lagged in 0.0f64..5e-3,
        ) {
            let (dt, tau, v, p) = (1.0 / 60.0, 0.01, Vec3::from(v), point(gap, offset, lagged));
            let at = contact(&p, dt, tau, &v);
            let e = 1e-6;
            for i in 0..3 {
                let moved = |s: f64| contact(&p, dt, tau, &(v + Vec3::ith(i, s)));
                let (up, down) = (moved(e), moved(-e));
                prop_assert!(((up.cost - down.cost) / (2.0 * e) + at.impulse[i]).abs() < 1e-6);
                let kink = (up.normal > 0.0) != (down.normal > 0.0) || up.slipping != down.slipping;
                let slope = (up.impulse - down.impulse) / (2.0 * e);
                prop_assert!(kink || (slope + at.curvature.column(i)).norm() < 1e-3, "{slope} {}", at.curvature);
            }
        }

        #[test]
        fn a_scalar_row_is_the_gradient_of_its_cost(v in -2.0f64..2.0, error in -0.1f64..0.1) {
            let row = Scalar {
                block: 0, index: 0, stiffness: 2000.0, damping: 100.0, error, target_velocity: 0.1, range: (-70.0, 70.0), force: 0.0,
            };
            let (dt, e) = (1.0 / 60.0, 1e-6);
            let slope = (row.answer(dt, v + e).2 - row.answer(dt, v - e).2) / (2.0 * e);
            prop_assert!((slope + dt * row.answer(dt, v).0).abs() < 1e-5);
        }
    }
}
