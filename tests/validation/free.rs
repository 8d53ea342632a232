//! A free soft body: energy and momentum without contact.

use softvt::{
    geometry::Vec3,
    physics::{KinematicId, SoftId, fem::FemState},
};

use crate::support::{Body, Scene, Squeeze};

/// Energy and momentum of a free body over a flight.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// Largest energy at the end of a step over that at the start, less 1.
    pub largest_gain: f64,
    /// Final over initial energy.
    pub kept: f64,
    /// Relative changes of linear and angular momentum.
    pub momentum_change: f64,
    pub spin_change: f64,
}

/// A thrown body: spin in rad/s, stretch at the start, stiffness damping in s.
#[derive(Clone, Copy, Debug)]
pub struct Throw {
    pub body: Body,
    pub spin: f64,
    pub stretch: f64,
    pub beta: f64,
}

/// The throws of the tables and tests.
pub fn throws() -> Vec<Throw> {
    let cube = Throw { body: Body::Cube { size: 0.05 }, spin: 0.0, stretch: 0.0, beta: 2e-3 };
    let capsule = Throw { body: Body::Capsule { radius: 0.02, length: 0.07 }, ..cube };
    vec![
        Throw { stretch: 0.1, ..cube },
        Throw { stretch: 0.1, beta: 0.0, ..cube },
        Throw { spin: 2.0, ..cube },
        Throw { spin: 6.0, stretch: 0.05, ..cube },
        Throw { spin: 30.0, stretch: 0.1, beta: 0.0, ..cube },
        Throw { spin: 10.0, ..capsule },
        Throw { spin: 30.0, stretch: 0.1, ..capsule },
    ]
}

/// Flies a body for two seconds without gravity.
pub fn flight(throw: &Throw) -> Flight {
    let options = Squeeze { body: throw.body, grounded: false, beta: throw.beta, ..Squeeze::default() };
    let mut scene = Scene::new(&options);
    let world = &mut scene.world;
    for (pad, away) in [-10.0, 10.0].into_iter().enumerate() {
        let pad = KinematicId::new(pad);
        let mut pose = world.kinematic(pad).pose;
        pose.translation.vector.x += away;
        world.place_kinematic(pad, pose);
    }
    let centre = world.soft(SoftId::new(0)).state.centre();
    let w = Vec3::new(0.3, 1.0, 0.2).normalize() * throw.spin;
    world.set_soft_motion(SoftId::new(0), |x, v| {
        let r = *x - centre;
        *x += Vec3::new(r.x, -r.y, 10.0 * r.x * r.y) * throw.stretch;
        *v = w.cross(&r) + Vec3::new(0.1, 0.0, 0.05);
    });
    let body = &world.soft(SoftId::new(0)).state;
    let (drift, spin) = (body.velocity(), spin_of(body));
    let start = world.energy().total();
    let (mut last, mut largest_gain) = (start, f64::NEG_INFINITY);
    for _ in 0..120 {
        world.step().expect("a step without contact");
        last = world.energy().total();
        largest_gain = largest_gain.max(last / start - 1.0);
    }
    let body = &world.soft_bodies()[0].state;
    Flight {
        largest_gain,
        kept: last / start,
        momentum_change: (body.velocity() - drift).norm() / drift.norm(),
        spin_change: (spin_of(body) - spin).norm() / spin.norm().max(1e-6),
    }
}

/// Angular momentum about the centre of mass, kg m²/s.
fn spin_of(body: &FemState) -> Vec3 {
    let (centre, drift) = (body.centre(), body.velocity());
    let parts = body.x.iter().zip(&body.v).zip(&body.model.mass);
    parts.map(|((x, v), m)| (x - centre).cross(&(v - drift)) * *m).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_step_of_a_free_body_gains_energy_and_its_momentum_stays() {
        for throw in throws() {
            let flight = flight(&throw);
            assert!(flight.largest_gain < 1e-3, "{throw:?}: {flight:?}");
            assert!(flight.momentum_change < 1e-9, "{throw:?}: {flight:?}");
            assert!(flight.spin_change < 1e-6, "{throw:?}: {flight:?}");
        }
    }

    #[test]
    fn a_body_that_only_turns_keeps_its_energy_and_angular_momentum() {
        for throw in throws().into_iter().filter(|t| t.stretch == 0.0) {
            let flight = flight(&throw);
            let kept = (flight.kept - 1.0).abs() < 1e-6 && flight.spin_change < 1e-9;
            assert!(kept, "{throw:?}: {flight:?}");
        }
    }
}
