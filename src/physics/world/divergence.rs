//! Validity of the state after a step.
//!
//! A step beyond these bounds has diverged, even if it seems to recover later.

use super::{SoftBody, StepFailure, World};
use crate::{PhysicsParams, fem::FemModel};

impl World {
    /// Checks that the state is finite, that no element stays inverted, and that speeds and forces are physical.
    pub(super) fn check_state(&mut self) -> Result<(), StepFailure> {
        let step = self.step;
        let PhysicsParams { dt, max_inverted_time, .. } = self.params;
        for soft in self.soft.iter_mut().filter(|s| !s.sleep.is_asleep) {
            if let Some(node) = soft.state.x.iter().position(|x| !x.iter().all(|c| c.is_finite())) {
                return Err(StepFailure::NotFinite { step, body: soft.name.clone(), node });
            }
            let least = soft.state.min_det_f();
            soft.inverted_time = if least.det_f <= 0.0 { soft.inverted_time + dt } else { 0.0 };
            if soft.inverted_time > max_inverted_time {
                let (body, element) = (soft.name.clone(), least.element);
                return Err(StepFailure::Inverted { step, body, element, seconds: max_inverted_time });
            }
        }
        self.check_bounds()
    }

    /// Checks speeds and contact forces of everything awake.
    ///
    /// Forces on rigid bodies are not bounded, since kinematic frames can squeeze one with any force. Nor are joint
    /// speeds, which are rad/s or m/s; they must be finite.
    fn check_bounds(&self) -> Result<(), StepFailure> {
        let (step, limit) = (self.step, self.params.max_speed);
        // `<=` is false for NaN, so NaN counts as too fast.
        let is_slow = |speed: f64| speed <= limit;
        let too_fast = |body: &str, node, speed| StepFailure::SpeedLimitExceeded {
            step,
            body: body.to_owned(),
            node,
            speed,
            limit,
        };
        for soft in self.soft.iter().filter(|soft| !soft.is_asleep()) {
            if let Some(node) = soft.state.v.iter().position(|v| !is_slow(v.norm())) {
                return Err(too_fast(&soft.name, Some(node), soft.state.v[node].norm()));
            }
            let limit = force_limit(&soft.state.model, &self.params);
            let force = total_normal_force(soft);
            if force > limit || force.is_nan() {
                return Err(StepFailure::ForceLimitExceeded { step, body: soft.name.clone(), force, limit });
            }
        }
        for rigid in self.rigid.iter().filter(|rigid| !rigid.is_asleep()) {
            let speed = rigid.state.v.norm();
            if !is_slow(speed) || !rigid.state.w.norm().is_finite() {
                return Err(too_fast(&rigid.name, None, speed));
            }
        }
        match self.articulations.iter().find(|articulation| !articulation.state.v.norm().is_finite()) {
            Some(articulation) => Err(too_fast(&articulation.name, None, articulation.state.v.norm())),
            None => Ok(()),
        }
    }
}

/// Sum of the normal forces on a body, N.
fn total_normal_force(soft: &SoftBody) -> f64 {
    soft.contacts.iter().map(|contact| contact.summary.normal_force).sum()
}

/// Largest possible sum of normal forces on a soft body, N.
///
/// Contact forces either change the body's momentum or are balanced by its stress. The first part is at most the
/// force that reverses all of its mass at the largest speed within one step, 2 m v / dt. The second is at most a
/// pressure over its whole surface: an upright element is compressed by less than its length, which the constrained
/// modulus M = λ + 2μ turns into less than M, and the damping within one step into less than M
/// β / dt. Twice that allows for shear, and for densification of the whole surface to a volume ratio of 0.13.
fn force_limit(model: &FemModel, params: &PhysicsParams) -> f64 {
    let constrained = model.material.constrained_modulus();
    let surface = model.samples.len() as f64 * model.spacing * model.spacing;
    let inertial = 2.0 * model.total_mass() * params.max_speed / params.dt;
    let viscous = match model.relaxation {
        Some(law) => law.share + law.dashpot / params.dt,
        None => params.rayleigh_stiffness / params.dt,
    };
    inertial + 2.0 * constrained * (1.0 + viscous) * surface
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        contact::Friction,
        fem::ElasticMaterial,
        ids::ColliderId,
        rigid::RigidState,
        world::{BodyContact, ContactSummary},
    };
    use softvt_geometry::{Mat3, Pose, Vec3, samples::SampleSpec, shape::Shape};

    /// A soft cube of 50 mm in free space.
    fn floating() -> World {
        let shape = Shape::cuboid(Vec3::repeat(0.05));
        let material = ElasticMaterial::new(3e4, 0.4, 300.0).expect("valid");
        let model = FemModel::from_shape(&shape, 0.05_f64.powi(3), material, 2, &SampleSpec::default());
        let mut world = World::new(PhysicsParams::default(), Vec3::zeros());
        let mu = Friction::new(0.6, 0.5);
        world.add_soft("bun", model.expect("a mesh"), None, &Pose::identity(), mu);
        world
    }

    #[test]
    fn exceeding_the_speed_limit_fails_with_the_name_of_the_body() {
        let mut world = floating();
        world.soft[0].state.v.fill(Vec3::x() * 99.0);
        assert_eq!(world.step(), Ok(()));
        world.soft[0].state.v.fill(Vec3::x() * 101.0);
        let failure = world.step().expect_err("too fast");
        assert!(matches!(failure, StepFailure::SpeedLimitExceeded { node: Some(0), .. }), "{failure}");
        assert_eq!(failure.to_string(), "bun moves at 101.0 m/s at step 2, above the limit of 100 m/s");
        let mut world = World::new(PhysicsParams::default(), Vec3::zeros());
        let stone = RigidState::new(&Pose::identity(), Vec3::zeros(), 0.1, Mat3::identity() * 1e-5);
        let stone = world.add_rigid("stone", stone.expect("a body"));
        world.rigid_mut(stone).state.v = Vec3::z() * 150.0;
        let failure = world.step().expect_err("too fast");
        assert!(failure.to_string().starts_with("stone moves at 150.0 m/s"), "{failure}");
    }

    #[test]
    fn a_force_beyond_momentum_and_stress_fails_even_at_rest() {
        let mut world = floating();
        assert_eq!(world.step(), Ok(()));
        let most = force_limit(&world.soft[0].state.model, &world.params);
        // 37.5 g turned round from 100 m/s within 1/60 s; 64 kPa all over 6 × 25 cm², twice, and 0.3 of it by damping.
        assert!((most / (450.0 + 2.0 * 64286.0 * 1.3 * 0.015) - 1.0).abs() < 0.05, "{most} N");
        let mut touched = |force: f64| {
            let summary = ContactSummary { normal_force: force, ..ContactSummary::default() };
            let contact = |id| BodyContact { partner: ColliderId::new(id).into(), summary };
            world.soft[0].contacts = vec![contact(0), contact(1)];
            world.check_bounds()
        };
        // The fingers' limit of the paper's profile, 200 N each.
        assert_eq!(touched(200.0), Ok(()));
        assert_eq!(touched(0.49 * most), Ok(()));
        assert!(matches!(touched(0.51 * most), Err(StepFailure::ForceLimitExceeded { .. })));
        let failure = touched(2e11).expect_err("too hard");
        assert!(failure.to_string().starts_with("contact force on bun is 4.0e11 N at step 1;"), "{failure}");
    }
}
