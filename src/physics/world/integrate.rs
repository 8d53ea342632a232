//! Update of the state from the solved velocities.

use super::World;
use crate::{
    fem::rigid_motion::{self, RigidVelocity},
    joints, rigid,
};
use softvt_geometry::Vec3;

impl World {
    /// Finds the solved velocities of all nodes.
    pub(super) fn complete(&mut self) {
        for (soft, block) in self.soft.iter_mut().zip(&self.blocks.soft) {
            let Some(block) = block else { continue };
            let block = &mut self.problem.blocks[*block];
            soft.system.complete(&block.v);
            soft.system.return_matrix(std::mem::take(&mut block.matrix));
        }
    }

    /// Sets the velocities at the end of the step and moves everything.
    pub(super) fn integrate(&mut self) {
        let dt = self.params.dt;
        let blocks = self.blocks.soft.iter().zip(&self.blocks.rigid_parts);
        for (soft, (block, rigid_part)) in self.soft.iter_mut().zip(blocks) {
            if block.is_none() {
                continue;
            }
            let body = &mut soft.state;
            body.v.copy_from_slice(soft.system.solved());
            if self.blocks.flight(soft.assembly).is_some() {
                continue;
            }
            if let Some(rigid) = rigid_part {
                let rest = RigidVelocity::with_momenta(body, body.momenta());
                body.v.iter_mut().zip(&body.x).for_each(|(v, x)| *v += rigid.at(x) - rest.at(x));
            }
            rigid_motion::advance(body, dt);
            body.update_elastic(dt);
        }
        for (i, rigid) in self.rigid.iter_mut().enumerate() {
            let Some(block) = self.blocks.rigid[i] else { continue };
            let v = &self.problem.blocks[block].v;
            let (linear, angular) = (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]));
            if self.blocks.flight(rigid.assembly).is_some() {
                (rigid.state.v, rigid.state.w) = (linear, angular);
                continue;
            }
            rigid::advance(&mut rigid.state, linear, angular, &self.blocks.torque_free_rotations[i], dt);
        }
        self.advance_flights();
        for (articulation, block) in self.articulations.iter_mut().zip(&self.blocks.articulations) {
            let Some(block) = block else { continue };
            let state = &mut articulation.state;
            state.v.copy_from_slice(&self.problem.blocks[*block].v);
            let drives = articulation.drives.iter().zip(&mut articulation.drive_forces).enumerate();
            for (joint, (drive, force)) in drives {
                let law = drive.map(|drive| drive.constraint(*block, joint, state.q[joint]));
                *force = law.map_or(0.0, |law| law.force_at(dt, state.v[joint]));
            }
            articulation.last_drives.clone_from(&articulation.drives);
            state.q.axpy(dt, &state.v, 1.0);
            let joints = articulation.friction.iter_mut().zip(&articulation.tree.links);
            for ((friction, link), q) in joints.zip(state.q.iter()) {
                let stretch = link.friction / friction.stiffness;
                friction.anchor = friction.anchor.clamp(q - stretch, q + stretch);
            }
            articulation.poses = joints::forward(&articulation.tree, state.q.as_slice());
        }
        self.kinematic.iter_mut().for_each(|k| k.pose = k.next);
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        PhysicsParams, World,
        contact::Friction,
        fem::{ElasticMaterial, FemModel, FemState},
        world::SoftBodyBuilder,
    };
    use softvt_geometry::{Pose, Vec3, samples::SampleSpec, shape::Shape};

    fn angular_momentum(body: &FemState) -> Vec3 {
        let centre = body.centre();
        let nodes = body.x.iter().zip(&body.v).zip(&body.model.mass);
        nodes.map(|((x, v), m)| (x - centre).cross(v) * *m).sum()
    }

    /// A ball with partly filled voxels that is strained by `stretch` and thrown with a spin of 20 rad/s.
    fn thrown(stretch: f64, params: PhysicsParams) -> (World, crate::SoftId) {
        let material = ElasticMaterial::new(3e4, 0.4, 300.0).expect("valid");
        let ball = Shape::Sphere { radius: 0.025 };
        let model = FemModel::from_shape(&ball, 6.5e-5, material, 4, &SampleSpec::default()).expect("a ball");
        let mut world = World::new(params, Vec3::new(0.0, 0.0, -9.81));
        let id = world.add_soft("ball", model, None, &Pose::translation(0.3, 0.0, 2.0), Friction::NONE);
        let centre = world.soft(id).state.centre();
        world.set_soft_motion(id, |x, v| {
            let r = *x - centre;
            *x += Vec3::new(r.x, -r.y, 10.0 * r.x * r.y) * stretch;
            *v = Vec3::new(5.0, 19.0, 3.0).cross(&r) + Vec3::new(0.1, 0.0, 0.05);
        });
        (world, id)
    }

    #[test]
    fn a_body_in_flight_keeps_its_momenta_with_average_acceleration() {
        let params = PhysicsParams { average_acceleration: true, ..PhysicsParams::default() };
        let (mut world, id) = thrown(0.2, params);
        let start = world.soft(id).state.clone();
        (0..15).for_each(|_| world.step().expect("a step without contact"));
        let end = &world.soft(id).state;
        let change =
            (angular_momentum(end) - angular_momentum(&start)).norm() / angular_momentum(&start).norm();
        assert!(change < 1e-10, "{change}");
        let t = world.time();
        let centre = start.centre() + start.velocity() * t - Vec3::z() * (0.5 * 9.81 * t * t);
        assert!((end.centre() - centre).norm() < 1e-11, "{} m, exact {centre}", end.centre());
    }

    #[test]
    fn a_body_that_swings_never_gains_energy_with_average_acceleration() {
        for (beta, rate) in [(0.0, 60.0), (0.0, 240.0), (2e-3, 60.0), (2e-3, 240.0)] {
            let params = PhysicsParams {
                dt: 1.0 / rate,
                rayleigh_stiffness: beta,
                average_acceleration: true,
                ..PhysicsParams::default()
            };
            let (mut world, id) = thrown(1e-3, params);
            world.gravity = Vec3::zeros();
            world.set_soft_motion(id, |_, v| *v = Vec3::zeros());
            // The energy that average acceleration keeps: elastic at the middle of the last step, and that of the
            // velocities with the part of (c + e)/2 that is above dt/4. It falls by dt (c − e) wᵀK w with w = (v₀ +
            // v)/2.
            let above = 2.0 * (f64::max(0.28, 0.5 * rate * beta) - 0.25);
            let energy = |world: &World| {
                let state = &world.soft(id).state;
                let [start, middle, end] = [1.0, 0.5, 0.0].map(|back| {
                    let mut state = state.clone();
                    state.x.iter_mut().zip(&state.v).for_each(|(x, v)| *x -= v * (back / rate));
                    state.update_elastic(0.0);
                    state.elastic_energy
                });
                state.kinetic_energy() + middle + above * (start + end - 2.0 * middle)
            };
            world.step().expect("a step without contact");
            let start = energy(&world);
            let mut last = start;
            for _ in 0..(0.1 * rate) as usize {
                world.step().expect("a step without contact");
                let now = energy(&world);
                assert!(now < last + 1e-3 * start, "β {beta}, {rate} Hz: {now} J after {last}");
                last = now;
            }
        }
    }

    #[test]
    fn a_strained_body_that_is_let_go_never_exceeds_its_energy_in_flight() {
        // Slender, stiff and nearly incompressible: turns of its voxels in a step strain it most.
        for (poisson, spin, stretch, beta) in [
            (0.3, 0.0, 0.03, 2e-3),
            (0.49, 0.0, 0.03, 2e-3),
            (0.49, 10.0, 0.1, 2e-3),
            (0.49, 0.0, 0.3, 0.0),
            (0.49, 30.0, 0.03, 0.0),
        ] {
            let params = PhysicsParams { rayleigh_stiffness: beta, ..PhysicsParams::default() };
            let mut world = World::new(params, Vec3::zeros());
            let rubber = ElasticMaterial::new(3e5, poisson, 300.0).expect("valid");
            let beam = Shape::cuboid(Vec3::new(0.2, 0.02, 0.02));
            let id = world.insert(SoftBodyBuilder::new(beam, rubber).resolution(8)).expect("a beam");
            let w = Vec3::new(0.3, 1.0, 0.2).normalize() * spin;
            world.set_soft_motion(id, |x, v| {
                *v = w.cross(x);
                *x += Vec3::new(0.0, -x.y, 5.0 * x.x * x.y) * stretch;
            });
            let start = world.energy().total();
            for step in 0..240 {
                world.step().expect("a step without contact");
                let now = world.energy().total() / start;
                assert!(
                    now < 1.001,
                    "ν {poisson}, {spin} rad/s, strain {stretch}, β {beta}: {now} at step {step}"
                );
            }
        }
    }

    #[test]
    fn mass_proportional_damping_slows_every_motion_of_a_body_in_flight_alike() {
        let (mut world, id) = thrown(0.2, PhysicsParams { rayleigh_mass: 2.5, ..PhysicsParams::default() });
        let start = angular_momentum(&world.soft(id).state);
        (0..15).for_each(|_| world.step().expect("a step without contact"));
        let end = angular_momentum(&world.soft(id).state);
        // Velocities are those of the middle of the steps.
        let (kept, expected) = (end.norm() / start.norm(), libm::exp(-2.5 * 14.5 / 60.0));
        assert!((kept / expected - 1.0).abs() < 0.02, "{kept} of the momentum, expected {expected}");
        assert!((end / kept - start).norm() < 1e-11 * start.norm(), "{end:?} after {start:?}");
    }
}
