//! What no state of the benchmark's scenes can be: beyond these bounds a step has diverged, even if it calms down afterwards.

use super::{Soft, StepFailure, World};
use crate::physics::fem::Rest;

impl World {
    /// Whether what is awake is as slow, and soft bodies are touched as gently, as anything physical is.
    ///
    /// Forces on rigid bodies are not bounded: between prescribed frames they are whatever the frames ask for. Nor are the
    /// joints' speeds, which are rad/s or m/s; they must be numbers.
    pub(super) fn check_bounds(&self) -> Result<(), StepFailure> {
        let (step, most_speed) = (self.step, self.params.most_speed);
        // What is no number is not slow either.
        let slow = |speed: f64| speed <= most_speed;
        let too_fast = |body: &str, node, speed| StepFailure::TooFast {
            step,
            body: body.to_owned(),
            node,
            speed,
            most: most_speed,
        };
        for soft in self.soft.iter().filter(|soft| !soft.asleep) {
            if let Some(node) = soft.body.v.iter().position(|v| !slow(v.norm())) {
                return Err(too_fast(&soft.name, Some(node), soft.body.v[node].norm()));
            }
            let most = bearable_force(&soft.body.rest, &self.params);
            let force = touching_force(soft);
            if force > most || force.is_nan() {
                return Err(StepFailure::TooHard { step, body: soft.name.clone(), force, most });
            }
        }
        for rigid in self.rigid.iter().filter(|rigid| !rigid.asleep) {
            let speed = rigid.body.v.norm();
            if !slow(speed) || !rigid.body.w.norm().is_finite() {
                return Err(too_fast(&rigid.name, None, speed));
            }
        }
        match self.trees.iter().find(|tree| !tree.state.v.norm().is_finite()) {
            Some(tree) => Err(too_fast(&tree.name, None, tree.state.v.norm())),
            None => Ok(()),
        }
    }
}

/// Sum of the normal forces on a body, N.
fn touching_force(soft: &Soft) -> f64 {
    soft.touches.iter().map(|(_, touch)| touch.normal_force).sum()
}

/// The largest sum of normal forces that a soft body can be touched with, N.
///
/// Contact forces either change its momentum or are carried by its stress. The first part is at most what turns all of its
/// mass round at the largest speed within one step, 2 m v / dt. The second is at most a pressure all over its surface; an
/// upright element is compressed by less than its length, which its constrained modulus M = E (1 − ν) / ((1 + ν)(1 − 2ν))
/// answers with less than M, and within one step the damping with less than M β / dt. Twice that, for shear besides.
fn bearable_force(rest: &Rest, params: &crate::physics::Params) -> f64 {
    let (youngs, nu) = (rest.material.youngs_pa, rest.material.poisson);
    let constrained = youngs * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
    let surface = rest.samples.len() as f64 * rest.spacing * rest.spacing;
    let stopped = 2.0 * rest.total_mass() * params.most_speed / params.dt;
    stopped + 2.0 * constrained * (1.0 + params.beta / params.dt) * surface
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::{
            Mat3, Pose, Vec3,
            samples::{SampleSpec, surface_samples},
            shape::Shape,
            voxel::{VoxelSpec, voxel_mesh},
        },
        physics::{Params, contact::Friction, fem::Material, rigid::RigidBody, world::Touch},
    };

    /// A bun of 50 mm that floats.
    fn floating() -> World {
        let shape = Shape::cuboid(Vec3::repeat(0.05));
        let mesh = voxel_mesh(&shape, &VoxelSpec { resolution: 2 }).expect("a mesh");
        let samples = surface_samples(&shape, &mesh, &SampleSpec::default());
        let material = Material { youngs_pa: 3e4, poisson: 0.4, density: 300.0 };
        let rest = Rest::new(mesh, material, 0.05_f64.powi(3), samples);
        let mut world = World::new(Params::default(), Vec3::zeros());
        let mu = Friction { static_mu: 0.6, dynamic_mu: 0.5 };
        world.add_soft("bun", rest, None, &Pose::identity(), mu);
        world
    }

    #[test]
    fn what_is_faster_than_anything_here_ends_the_run_with_its_name() {
        let mut world = floating();
        world.soft[0].body.v.fill(Vec3::x() * 99.0);
        assert_eq!(world.step(), Ok(()));
        world.soft[0].body.v.fill(Vec3::x() * 101.0);
        let failure = world.step().expect_err("too fast");
        assert!(matches!(failure, StepFailure::TooFast { node: Some(0), .. }), "{failure}");
        assert_eq!(
            failure.to_string(),
            "bun moves at 101.0 m/s at step 2, beyond the 100 m/s of a valid state"
        );
        let mut world = World::new(Params::default(), Vec3::zeros());
        let stone = RigidBody::new(&Pose::identity(), Vec3::zeros(), 0.1, Mat3::identity() * 1e-5);
        let index = world.add_rigid("stone", stone.expect("a body"));
        world.rigid[index].body.v = Vec3::z() * 150.0;
        let failure = world.step().expect_err("too fast");
        assert!(failure.to_string().starts_with("stone moves at 150.0 m/s"), "{failure}");
    }

    #[test]
    fn a_force_that_neither_momentum_nor_stress_explains_ends_the_run_though_all_is_quiet() {
        let mut world = floating();
        assert_eq!(world.step(), Ok(()));
        let most = bearable_force(&world.soft[0].body.rest, &world.params);
        // 37.5 g turned round from 100 m/s within 1/60 s; 64 kPa all over 6 × 25 cm², twice, and 0.3 of it by damping.
        assert!((most / (450.0 + 2.0 * 64286.0 * 1.3 * 0.015) - 1.0).abs() < 0.05, "{most} N");
        let mut touched = |force: f64| {
            let touch = Touch { normal_force: force, ..Touch::default() };
            world.soft[0].touches = vec![(0, touch), (1, touch)];
            world.check_bounds()
        };
        // The fingers' limit of the paper's profile, 200 N each.
        assert_eq!(touched(200.0), Ok(()));
        assert_eq!(touched(0.49 * most), Ok(()));
        assert!(matches!(touched(0.51 * most), Err(StepFailure::TooHard { .. })));
        let failure = touched(2e11).expect_err("too hard");
        assert!(
            failure.to_string().starts_with("bun is touched with 4.0e11 N at step 1, beyond the"),
            "{failure}"
        );
    }
}
