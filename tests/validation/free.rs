//! A free soft body: energy and momentum without contact.

use softvt::{geometry::Vec3, physics::Params};

use crate::support::{Scene, Squeeze};

/// How a free body's energy went.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// Largest gain of a step, of the initial energy.
    pub largest_gain: f64,
    /// Final over initial energy.
    pub kept: f64,
    /// Relative change of the linear momentum.
    pub momentum_change: f64,
}

/// A cube that starts stretched, spinning at `spin` rad/s and drifting, for two seconds without gravity.
pub fn flight(spin: f64, stretch: f64, beta: f64) -> Flight {
    let options = Squeeze { grounded: false, beta, ..Squeeze::default() };
    let mut scene = Scene::new(&options);
    let world = &mut scene.world;
    world.params = Params { beta, sleeping: false, ..Params::default() };
    world.kinematic.iter_mut().enumerate().for_each(|(i, k)| {
        k.pose.translation.vector.x += if i == 0 { -10.0 } else { 10.0 };
        k.next = k.pose;
    });
    let body = &mut world.soft[0].body;
    let centre = body.centre();
    let w = Vec3::new(0.3, 1.0, 0.2).normalize() * spin;
    for (x, v) in body.x.iter_mut().zip(&mut body.v) {
        let r = *x - centre;
        *x += Vec3::new(stretch * r.x, -stretch * r.y, 10.0 * stretch * r.x * r.y);
        *v = w.cross(&r) + Vec3::new(0.1, 0.0, 0.05);
    }
    body.update_elastic();
    let momentum = body.velocity();
    let start = world.energy().total();
    let (mut last, mut largest_gain) = (start, f64::NEG_INFINITY);
    for _ in 0..120 {
        world.step().expect("a step without contact");
        let now = world.energy().total();
        largest_gain = largest_gain.max((now - last) / start);
        last = now;
    }
    let change = (world.soft[0].body.velocity() - momentum).norm() / momentum.norm();
    Flight { largest_gain, kept: last / start, momentum_change: change }
}

/// The flights of the tables and tests: spin in rad/s, stretch, stiffness damping in s.
pub const FLIGHTS: [(f64, f64, f64); 5] =
    [(0.0, 0.1, 2e-3), (0.0, 0.1, 0.0), (6.0, 0.05, 2e-3), (30.0, 0.1, 2e-3), (30.0, 0.1, 0.0)];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_step_of_a_free_body_gains_energy_and_its_momentum_stays() {
        for (spin, stretch, beta) in FLIGHTS {
            let flight = flight(spin, stretch, beta);
            assert!(flight.largest_gain < 1e-3, "spin {spin}, stretch {stretch}, β {beta}: {flight:?}");
            assert!(flight.momentum_change < 1e-9, "spin {spin}, stretch {stretch}, β {beta}: {flight:?}");
        }
    }
}
