//! Held bodies: creep, fall, turns and shakes. Sleeping is off everywhere.

use softvt::geometry::{Pose, Quat, Vec3};

use crate::support::{GRAVITY, Scene, Squeeze, quintic};

/// Pad force that the reference gives for a hold at gap 48 mm, N.
const HOLD_48: f64 = 1.148170;

/// A cube gripped in mid-air without gravity.
fn gripped(options: &Squeeze) -> Scene {
    let options = Squeeze { grounded: false, ..*options };
    let mut scene = Scene::new(&options);
    let steps = (options.lift_at() / options.dt).ceil() as usize;
    for _ in 0..steps {
        scene.step(&Pose::identity()).expect("a step while closing");
    }
    scene
}

/// Steps for `seconds` with gravity going smoothly to `gravity` and the hand at `hand(time since the start)`; what was
/// seen last, and whether a pad ever slid as a whole.
fn carry(
    scene: &mut Scene,
    seconds: f64,
    gravity: f64,
    hand: impl Fn(f64) -> Pose,
) -> (crate::support::Seen, bool) {
    let dt = scene.options.dt;
    let before = -scene.world.gravity.z;
    let mut slid = false;
    let steps = (seconds / dt).round() as usize;
    let mut last = None;
    for step in 1..=steps {
        let t = step as f64 * dt;
        scene.world.gravity = -Vec3::z() * (before + (gravity - before) * quintic(t / seconds));
        let seen = scene.step(&hand(t)).expect("a step while holding");
        slid |= seen.sliding;
        last = Some(seen);
    }
    (last.expect("at least one step"), slid)
}

fn still(_: f64) -> Pose {
    Pose::identity()
}

/// The grasp at gap 48 mm whose friction carries `share` of what it could, roughly; see [`Creep::share`] for exactly.
fn loaded(share: f64) -> Squeeze {
    let weight = 300.0 * 0.05f64.powi(3) * GRAVITY;
    Squeeze { friction: weight / (2.0 * HOLD_48 * share), ..Squeeze::default() }.gap_mm(48.0)
}

/// Creep of a held cube.
#[derive(Clone, Copy, Debug)]
pub struct Creep {
    /// Weight over friction capacity at the end.
    pub share: f64,
    /// Creep over five seconds, mm.
    pub creep_mm: f64,
}

/// A cube held for five seconds at about `share` of its friction capacity, from one second after the load came.
pub fn creep(share: f64) -> Creep {
    let mut scene = gripped(&loaded(share));
    carry(&mut scene, 0.5, GRAVITY, still);
    let (from, _) = carry(&mut scene, 1.0, GRAVITY, still);
    let (to, _) = carry(&mut scene, 5.0, GRAVITY, still);
    Creep { share: scene.weight() / to.capacity, creep_mm: 1e3 * (to.moved_h - from.moved_h).norm() }
}

/// Fall of an overloaded cube.
#[derive(Clone, Copy, Debug)]
pub struct Fall {
    /// Acceleration between 0.2 and 0.3 s, m/s².
    pub acceleration: f64,
    /// g (1 − capacity/load), m/s².
    pub expected: f64,
}

/// Force of pads that cover whole faces of the cube and hold nothing back sideways, N: the bar `E A` in series with
/// the two contact layers.
fn covering_force(options: &Squeeze, layer: f64) -> f64 {
    let edge = options.body.width();
    edge * edge * (edge - options.gap) / (edge / options.youngs_pa + 2.0 / layer)
}

/// A cube between pads so large that its contact never changes as it slides, held at half of g and then let fall with
/// `load` times its friction capacity as weight.
pub fn fall(load: f64) -> Fall {
    let mut options = Squeeze { pad: 0.6, grounded: false, ..Squeeze::default() }.gap_mm(48.0);
    let probe = Scene::new(&options);
    let layer =
        probe.world.rigid_surface_stiffness().in_series(&probe.world.soft_bodies()[0].stiffness).normal;
    options.friction = probe.weight() / (2.0 * covering_force(&options, layer) * load);
    let mut scene = gripped(&options);
    carry(&mut scene, 0.5, 0.5 * GRAVITY, still);
    scene.world.gravity = -GRAVITY * Vec3::z();
    let mut speed = |seconds: f64| {
        carry(&mut scene, seconds, GRAVITY, still);
        -scene.world.soft_bodies()[0].state.velocity().z
    };
    let (from, to) = (speed(0.2), speed(0.1));
    Fall { acceleration: (to - from) / 0.1, expected: GRAVITY * (1.0 - 1.0 / load) }
}

/// Slip of a held cube during a motion of the hand.
#[derive(Clone, Copy, Debug)]
pub struct Carried {
    /// Weight over friction capacity before.
    pub share: f64,
    /// Displacement of its centre in the hand by the motion, mm.
    pub shift_mm: f64,
    /// True if all samples of a pad slid at once.
    pub slid: bool,
}

fn carried(seconds: f64, hand: impl Fn(f64) -> Pose) -> Carried {
    let mut scene = gripped(&loaded(0.6));
    carry(&mut scene, 0.5, GRAVITY, still);
    let (before, _) = carry(&mut scene, 0.5, GRAVITY, still);
    let (_, slid) = carry(&mut scene, seconds, GRAVITY, hand);
    let (after, _) = carry(&mut scene, 0.5, GRAVITY, still);
    Carried {
        share: scene.weight() / before.capacity,
        shift_mm: 1e3 * (after.moved_h - before.moved_h).norm(),
        slid,
    }
}

/// The hand turns by 90° about `axis` in one second, waits for half a second, and turns back.
pub fn turned(axis: Vec3) -> Carried {
    carried(2.5, |t| {
        let share = quintic(t) - quintic(t - 1.5);
        Pose::from_parts(
            Vec3::zeros().into(),
            Quat::from_scaled_axis(axis * share * std::f64::consts::FRAC_PI_2),
        )
    })
}

/// The hand shakes along `axis` with 2 m/s² at 2 Hz for two seconds after one of swelling.
pub fn shaken(axis: Vec3) -> Carried {
    let rate = 2.0 * std::f64::consts::TAU;
    carried(4.0, |t| {
        let swell = quintic(t) * quintic(4.0 - t);
        Pose::from(nalgebra::Translation3::from(axis * (2.0 / (rate * rate) * swell * (rate * t).sin())))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_body_does_not_creep_at_16_to_90_per_cent_of_its_capacity() {
        for share in [0.16, 0.4, 0.6, 0.8, 0.9] {
            let creep = creep(share);
            assert!((creep.share / share - 1.0).abs() < 0.05, "wanted {share}: {creep:?}");
            assert!(creep.creep_mm < 0.01, "{creep:?}");
        }
    }

    #[test]
    fn an_overloaded_body_falls_with_what_friction_leaves_of_gravity() {
        for load in [1.05, 1.5] {
            let fall = fall(load);
            assert!((fall.acceleration / fall.expected - 1.0).abs() < 0.05, "{fall:?}");
        }
    }

    #[test]
    fn a_grasp_at_60_per_cent_of_its_capacity_survives_quarter_turns_of_the_hand() {
        for axis in [Vec3::x(), Vec3::y()] {
            let carried = turned(axis);
            assert!((0.55..0.63).contains(&carried.share), "{carried:?}");
            assert!(!carried.slid && carried.shift_mm < 0.1, "about {axis:?}: {carried:?}");
        }
    }

    #[test]
    fn a_grasp_at_60_per_cent_of_its_capacity_survives_shaking_on_each_axis() {
        for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
            let carried = shaken(axis);
            assert!(!carried.slid && carried.shift_mm < 0.1, "along {axis:?}: {carried:?}");
        }
    }
}
