//! A silicone beam that is clamped at one end and released from its straight shape, alone and with a load at the tip,
//! against the recordings in `tests/reference/measured`.

use serde::Deserialize;
use softvt::{
    geometry::{Mat3, Pose, Vec3, shape::Shape},
    physics::{
        BodyId, PhysicsParams, World, fem::ElasticMaterial, rigid::RigidState, world::SoftBodyBuilder,
    },
};

use crate::bodies::GRAVITY;

/// Free length and side of the beam, m.
const LENGTH: f64 = 0.1;
const SIDE: f64 = 0.03;
/// Mean height of the markers above the axis of the beam, m.
const MARKERS: f64 = 7e-3;
/// Voxels across the beam in the tables.
pub const ACROSS: usize = 6;
/// Duration of a run, s.
const DURATION: f64 = 5.0;

/// A recording, and the run that it is compared with.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub name: &'static str,
    file: &'static str,
    /// Mass on the upper edge of the tip, kg.
    pub load: f64,
}

/// The beam alone and with 52 g.
pub const CASES: [Case; 2] = [
    Case { name: "alone", file: "beam_gravity_V2_a", load: 0.0 },
    Case { name: "with 52 g", file: "beam_load52_V2_a", load: 0.052 },
];

/// Loss factor with which the damping ratios are those of the recordings.
const LOSS_FACTOR: f64 = 0.085;

/// Damping of a run, with implicit Euler or, for the loss factor, average acceleration.
#[derive(Clone, Copy, Debug)]
pub enum Law {
    /// β of the benchmark.
    Default,
    /// β with which a Kelvin–Voigt material has the recorded damping ratio at the recorded frequency.
    Dashpot,
    LossFactor,
}

impl Law {
    /// Its β, s.
    pub fn beta(self, case: &Case) -> Option<f64> {
        let Swing { frequency, zeta, .. } = case.recorded();
        match self {
            Self::Default => Some(5e-3),
            Self::Dashpot => Some(zeta / (std::f64::consts::PI * frequency)),
            Self::LossFactor => None,
        }
    }
}

#[derive(Deserialize)]
struct Recording {
    t_s: Vec<f64>,
    tip_mm: Vec<f64>,
}

/// Motion of a tip after its release.
#[derive(Clone, Copy, Debug)]
pub struct Swing {
    /// Depth of rest below the height of release, mm.
    pub sag_mm: f64,
    /// Frequency without damping, Hz.
    pub frequency: f64,
    /// Damping ratio by the logarithmic decrement.
    pub zeta: f64,
}

impl Swing {
    /// Measures a swing that starts at `start_mm`. Rest is the mean of the last second, and the decrement is that of
    /// the first two periods, or of those half periods whose amplitude is above 0.2 % of the sag.
    fn new(start_mm: f64, t: &[f64], height_mm: &[f64]) -> Self {
        let end = t.last().expect("samples") - 1.0;
        let last: Vec<f64> = t.iter().zip(height_mm).filter(|(t, _)| **t > end).map(|(_, z)| *z).collect();
        let rest = last.iter().sum::<f64>() / last.len() as f64;
        let sag_mm = start_mm - rest;
        let mut turns: Vec<(f64, f64)> = Vec::new();
        for (t, z) in t.windows(3).zip(height_mm.windows(3)) {
            if turns.len() == 5 || (z[1] - z[0]) * (z[2] - z[1]) > 0.0 || z[2] == z[1] {
                continue;
            }
            // The vertex of the parabola through three samples.
            let (bend, slope) = (0.5 * (z[0] + z[2]) - z[1], 0.5 * (z[2] - z[0]));
            let shift = -0.5 * slope / bend;
            let amplitude = z[1] + 0.5 * slope * shift - rest;
            if amplitude.abs() > 2e-3 * sag_mm {
                turns.push((t[1] + shift * (t[1] - t[0]), amplitude.abs()));
            }
        }
        let [(first, from), .., (until, to)] = turns[..] else { panic!("fewer than two turns") };
        let half_periods = (turns.len() - 1) as f64;
        let decrement = (from / to).ln() / half_periods;
        let zeta = decrement / (decrement * decrement + std::f64::consts::PI.powi(2)).sqrt();
        let damped = 0.5 * half_periods / (until - first);
        Self { sag_mm, frequency: damped / (1.0 - zeta * zeta).sqrt(), zeta }
    }
}

impl Case {
    /// The recorded swing.
    pub fn recorded(&self) -> Swing {
        let root = env!("CARGO_MANIFEST_DIR");
        let path = format!("{root}/tests/reference/measured/{}.json", self.file);
        let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
        let Recording { t_s, tip_mm } = serde_json::from_str(&text).expect("a recording");
        let release = t_s.iter().position(|t| *t >= 0.0).expect("a release");
        let start = tip_mm[..release].iter().sum::<f64>() / release as f64;
        Swing::new(start, &t_s[release..], &tip_mm[release..])
    }

    /// The swing of the simulated beam with `across` voxels across, at `rate`, Hz.
    pub fn simulated(&self, across: usize, rate: f64, law: Law) -> Swing {
        let beta = law.beta(self);
        let params = PhysicsParams {
            dt: 1.0 / rate,
            rayleigh_stiffness: beta.unwrap_or(0.0),
            average_acceleration: beta.is_none(),
            sleeping: false,
            ..PhysicsParams::default()
        };
        let loss_factor = if beta.is_none() { LOSS_FACTOR } else { 0.0 };
        let mut world = World::new(params.clone(), -GRAVITY * Vec3::z());
        let silicone = ElasticMaterial::new(263_824.0, 0.499, 1070.0).expect("valid");
        let silicone = silicone.with_loss_factor(loss_factor).expect("valid");
        let beam = Shape::cuboid(Vec3::new(LENGTH, SIDE, SIDE));
        // The longest edge is ten thirds of the others.
        let beam = SoftBodyBuilder::new(beam, silicone).resolution((10 * across).div_ceil(3));
        let beam = world.insert(beam).expect("a beam");
        let slab = |x: f64, z: f64, size: Vec3| Shape::cuboid(size).translated(Vec3::new(x, 0.0, z));
        let end = slab(-0.5 * LENGTH, 0.0, Vec3::new(1e-3, 2.0 * SIDE, 2.0 * SIDE));
        world.attach(beam, &end, BodyId::World).expect("an end face");
        if self.load > 0.0 {
            let edge = slab(0.5 * LENGTH, 0.5 * SIDE, Vec3::new(1e-3, 2.0 * SIDE, 1e-3));
            let place = Pose::translation(0.5 * LENGTH, 0.0, 0.5 * SIDE);
            // As a ball of 10 mm.
            let inertia = Mat3::identity() * (0.4 * self.load * 25e-6);
            let load = RigidState::new(&place, Vec3::zeros(), self.load, inertia).expect("a body");
            let load = world.add_rigid("load", load);
            world.attach(beam, &edge, load).expect("an edge");
        }
        let tip = |world: &World| {
            let body = &world.soft(beam).state;
            let nodes = body.model.mesh.nodes.iter().zip(&body.x);
            let nodes = nodes.filter(|(rest, _)| rest.x > 0.5 * LENGTH - 1e-6);
            let mean = |part: &dyn Fn(&Vec3) -> bool| {
                let (sum, count) = nodes
                    .clone()
                    .filter(|(rest, _)| part(rest))
                    .fold((Vec3::zeros(), 0), |(sum, count), (_, x)| (sum + x, count + 1));
                sum / f64::from(count)
            };
            let up = mean(&|rest| rest.z > 0.5 * SIDE - 1e-6) - mean(&|rest| rest.z < 1e-6 - 0.5 * SIDE);
            1e3 * (mean(&|_| true) + up.normalize() * MARKERS).z
        };
        let start = tip(&world);
        // The release is a turn: height before it is that after it.
        let (mut t, mut height) = (vec![-params.dt, 0.0], vec![start; 2]);
        for _ in 0..(DURATION * rate) as usize {
            world.step().expect("a step");
            t.push(world.time());
            height.push(tip(&world));
        }
        Swing::new(start, &t, &height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_beam_swings_as_recorded_at_any_step() {
        for case in CASES {
            let recorded = case.recorded();
            for (across, rate) in [(ACROSS, 60.0), (ACROSS, 120.0)] {
                let found = case.simulated(across, rate, Law::LossFactor);
                let off = |value: f64, recorded: f64| (value / recorded - 1.0).abs();
                let is_close = off(found.sag_mm, recorded.sag_mm) < 0.05
                    && off(found.frequency, recorded.frequency) < if rate > 60.0 { 0.05 } else { 0.07 }
                    && off(found.zeta, recorded.zeta) < 0.2;
                assert!(is_close, "{} at {rate} Hz: {found:?}, recorded {recorded:?}", case.name);
            }
        }
    }

    #[test]
    fn implicit_euler_damps_the_beam_too_much_but_lets_it_sag_alike() {
        for case in CASES {
            let recorded = case.recorded();
            let [slow, fast] =
                [(60.0, Law::Default), (240.0, Law::Dashpot)].map(|(rate, law)| case.simulated(3, rate, law));
            assert!(slow.zeta > fast.zeta && fast.zeta > recorded.zeta, "{}: {slow:?}, {fast:?}", case.name);
            assert!((slow.sag_mm / fast.sag_mm - 1.0).abs() < 1e-4, "{}: {slow:?}, {fast:?}", case.name);
        }
    }
}
