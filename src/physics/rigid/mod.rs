//! Free rigid bodies: state, world inertia, torque-free motion, energy and momentum.
//!
//! A step of the world computes the torque-free rotation by [`torque_free_rotation`], solves for the velocities at the
//! end of the step (without torques, the angular velocity is [`TorqueFreeRotation::end_w`]), and then calls
//! [`advance`]. In free flight this conserves the vector of angular momentum and the kinetic energy to rounding, at any
//! step size.

use softvt_geometry::{Mat3, Pose, Quat, Vec3};

#[cfg(test)]
mod tests;

/// Largest rotation per sub-step of torque-free motion, rad: keeps Newton's method within its region of convergence.
const MAX_SUBSTEP_ROTATION: f64 = 0.25;
/// Newton iterations per sub-step; it converges quadratically and needs 3 to 5.
const MAX_NEWTON: usize = 12;

/// Invalid mass properties of a rigid body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigidError {
    /// The mass is not a positive number.
    #[error("a rigid body needs a positive, finite mass, got {0} kg; check its density and shape")]
    Mass(f64),
    /// The inertia is not symmetric positive definite, or breaks the triangle inequality of real bodies.
    #[error(
        "a rigid body needs the inertia of a real solid, got principal moments {0:?} kg m²; check its shape"
    )]
    Inertia([f64; 3]),
}

/// State and mass properties of a free rigid body.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidState {
    /// The centre of mass in the world; the axes are the object's own (not the principal ones).
    pub pose_w: Pose,
    /// Centre of mass in the object frame, m.
    pub com_o: Vec3,
    /// Velocity of the centre of mass, m/s, world.
    pub v: Vec3,
    /// Angular velocity, rad/s, world.
    pub w: Vec3,
    /// Mass, kg.
    pub mass: f64,
    /// Inertia about the centre of mass along the object's axes, kg m².
    pub inertia_o: Mat3,
}

impl RigidState {
    /// A body at rest whose *object frame* is at `object_w`; `com_o` (m) and `inertia_o` (kg m², about the centre of
    /// mass) are in the object frame.
    ///
    /// # Errors
    /// [`RigidError`] if mass or inertia could not belong to a real solid.
    pub fn new(object_w: &Pose, com_o: Vec3, mass: f64, inertia_o: Mat3) -> Result<Self, RigidError> {
        if !(mass > 0.0 && mass.is_finite()) {
            return Err(RigidError::Mass(mass));
        }
        check_inertia(&inertia_o)?;
        let pose_w = object_w * nalgebra::Translation3::from(com_o);
        Ok(Self { pose_w, com_o, v: Vec3::zeros(), w: Vec3::zeros(), mass, inertia_o })
    }

    /// The object frame in the world.
    pub fn object_w(&self) -> Pose {
        self.pose_w * nalgebra::Translation3::from(-self.com_o)
    }

    /// Inertia about the centre of mass along world axes, kg m².
    pub fn inertia_w(&self) -> Mat3 {
        let r = self.pose_w.rotation.to_rotation_matrix();
        r.matrix() * self.inertia_o * r.matrix().transpose()
    }

    /// Velocity of the material point that is at `p_w`, m/s, world.
    pub fn velocity_at(&self, p_w: &Vec3) -> Vec3 {
        self.v + self.w.cross(&(p_w - self.pose_w.translation.vector))
    }

    /// Translational and rotational kinetic energy, J.
    pub fn kinetic_energy(&self) -> f64 {
        0.5 * (self.mass * self.v.norm_squared() + self.w.dot(&(self.inertia_w() * self.w)))
    }

    /// Potential energy in the uniform field `gravity` (m/s², world), J, zero at the world's origin.
    pub fn potential_energy(&self, gravity: &Vec3) -> f64 {
        -self.mass * gravity.dot(&self.pose_w.translation.vector)
    }

    /// Linear momentum, kg m/s, world.
    pub fn momentum(&self) -> Vec3 {
        self.mass * self.v
    }

    /// Angular momentum about the world's origin, kg m²/s, world.
    pub fn angular_momentum(&self) -> Vec3 {
        self.pose_w.translation.vector.cross(&self.momentum()) + self.inertia_w() * self.w
    }
}

/// Checks that the principal moments are positive and none exceeds the sum of the other two (equal for a flat lamina).
fn check_inertia(inertia: &Mat3) -> Result<(), RigidError> {
    let scale = inertia.norm();
    let symmetric = (inertia - inertia.transpose()).norm() <= 1e-9 * scale;
    if !(scale.is_finite() && symmetric) {
        return Err(RigidError::Inertia([inertia[(0, 0)], inertia[(1, 1)], inertia[(2, 2)]]));
    }
    let mut moments = <[f64; 3]>::from(inertia.symmetric_eigenvalues());
    moments.sort_by(f64::total_cmp);
    let real = moments[0] > 0.0 && moments[2] <= (moments[0] + moments[1]) * (1.0 + 1e-6);
    if real { Ok(()) } else { Err(RigidError::Inertia(moments)) }
}

/// Torque-free rotation of a body over one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueFreeRotation {
    /// Angular velocity at the end of the step, rad/s, world.
    pub end_w: Vec3,
    /// Rotation over the step, applied from the left: rotation after = turn · rotation before.
    pub turn: Quat,
}

/// Torque-free rotation over `dt` seconds.
///
/// The implicit midpoint rule on Euler's equations in the body frame, I(ω₁−ω₀) = −dt ω̄×Iω̄, with the attitude turned
/// by the Cayley map of dt ω̄. The first conserves every quadratic invariant, hence energy. With the second, the
/// *vector* of angular momentum is conserved too, because L₁ = cay(−dt ω̄) L₀ (Austin, Krishnaprasad & Wang, "Almost
/// Poisson integration of rigid body systems", J. Comput. Phys. 107, 1993).
pub fn torque_free_rotation(body: &RigidState, dt: f64) -> TorqueFreeRotation {
    let start = body.pose_w.rotation;
    let mut omega = start.inverse() * body.w;
    let substeps = (dt * omega.norm() / MAX_SUBSTEP_ROTATION).ceil().max(1.0);
    let h = dt / substeps;
    let mut rotation = start;
    for _ in 0..substeps as usize {
        let next = midpoint_step(&body.inertia_o, &omega, h);
        rotation *= cayley(&(0.5 * h * (omega + next)));
        omega = next;
    }
    TorqueFreeRotation { end_w: rotation * omega, turn: rotation * start.inverse() }
}

/// Solves I(ω₁−ω₀) + h ω̄×Iω̄ = 0 for ω₁ by Newton's method (body frame).
fn midpoint_step(inertia: &Mat3, omega: &Vec3, h: f64) -> Vec3 {
    let mut next = *omega;
    for _ in 0..MAX_NEWTON {
        let mean = 0.5 * (omega + next);
        let momentum = inertia * mean;
        let residual = inertia * (next - omega) + h * mean.cross(&momentum);
        let slope = inertia + 0.5 * h * (mean.cross_matrix() * inertia - momentum.cross_matrix());
        let Some(change) = slope.lu().solve(&residual) else { break };
        next -= change;
        if change.norm() <= 1e-15 * next.norm() {
            break;
        }
    }
    next
}

/// The rotation (1 + x/2)(1 − x/2)⁻¹ of the cross-product matrix of x: the unit quaternion along (1, x/2).
fn cayley(x: &Vec3) -> Quat {
    Quat::from_quaternion(nalgebra::Quaternion::from_parts(1.0, 0.5 * x))
}

/// Moves `body` to the end of a step of `dt` seconds, where its velocities are `v` and `w` (m/s, rad/s, world).
///
/// The change of the angular velocity by torques and contacts (`w` minus the torque-free one) rotates the body by the
/// exponential map, in addition to the torque-free rotation. The quaternion is renormalised.
pub fn advance(body: &mut RigidState, v: Vec3, w: Vec3, spin: &TorqueFreeRotation, dt: f64) {
    let extra = Quat::from_scaled_axis((w - spin.end_w) * dt);
    body.pose_w.rotation = Quat::new_normalize((extra * spin.turn * body.pose_w.rotation).into_inner());
    body.pose_w.translation.vector += v * dt;
    body.v = v;
    body.w = w;
}
