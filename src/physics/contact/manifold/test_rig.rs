//! Tests of the manifolds in motion, by an explicit penalty integrator that shares nothing with the real solver.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::tests::{BALL, BOX, CAN, meet, support};
use super::*;
use crate::rigid::{RigidState, advance, torque_free_rotation};
use softvt_geometry::{Mat3, Pose, Quat};

const GRAVITY: f64 = 9.81;
const DT: f64 = 2e-5;
/// Contact modulus, Pa/m, and the share of critical damping of a body on one point.
const MODULUS: f64 = 1e9;
const DAMPING: f64 = 0.3;

/// A body on a plane tilted by `slope` about the world's y axis: gravity turns, the plane stays.
struct Incline {
    body: RigidState,
    primitive: Primitive,
    gravity: Vec3,
    friction: f64,
    springs: BTreeMap<u32, Vec3>,
}

fn inertia(primitive: &Primitive, mass: f64) -> Mat3 {
    let diagonal = match *primitive {
        Primitive::Box { half } => {
            let square = half.component_mul(&half);
            Vec3::new(square.y + square.z, square.x + square.z, square.x + square.y) / 3.0
        }
        Primitive::Sphere { radius } => Vec3::repeat(0.4 * radius * radius),
        Primitive::Cylinder { radius, half_height } => {
            let side = 0.25 * radius * radius + half_height * half_height / 3.0;
            Vec3::new(side, side, 0.5 * radius * radius)
        }
        _ => Vec3::repeat(1e-4),
    };
    Mat3::from_diagonal(&(diagonal * mass))
}

impl Incline {
    fn new(primitive: Primitive, turn: Quat, slope: f64, friction: f64) -> Self {
        let mass = 0.3;
        let mut pose = Pose::from_parts(nalgebra::Translation3::identity(), turn);
        pose.translation.vector.z = -support(&primitive, &pose, &-Vec3::z()).z;
        let body =
            RigidState::new(&pose, Vec3::zeros(), mass, inertia(&primitive, mass)).expect("a real body");
        let gravity = Vec3::new(slope.sin(), 0.0, -slope.cos()) * GRAVITY;
        Self { body, primitive, gravity, friction, springs: BTreeMap::new() }
    }

    /// Force at one contact point: a damped normal spring and a tangential one stretched by the material's velocity,
    /// bounded by Coulomb's law.
    fn force(&mut self, point: &ManifoldPoint, springs: &mut BTreeMap<u32, Vec3>) -> Vec3 {
        let stiffness = MODULUS * point.area;
        let damping = DAMPING * 2.0 * (stiffness * self.body.mass).sqrt();
        let v = self.body.velocity_at(&point.position_w);
        let v_n = v.dot(&point.normal_w);
        let normal = (-stiffness * point.gap - damping * v_n).max(0.0);
        if point.gap >= 0.0 || normal == 0.0 {
            return Vec3::zeros();
        }
        let v_t = v - point.normal_w * v_n;
        let stretch = self.springs.get(&point.feature).copied().unwrap_or_default() + v_t * DT;
        let wanted = -stretch * (0.5 * stiffness) - v_t * (0.3 * damping);
        let bound = self.friction * normal;
        let (tangential, stretch) = if wanted.norm() > bound {
            let slipping = wanted * (bound / wanted.norm());
            (slipping, -slipping / (0.5 * stiffness))
        } else {
            (wanted, stretch)
        };
        springs.insert(point.feature, stretch);
        point.normal_w * normal + tangential
    }

    fn step(&mut self) {
        let points = meet(&Primitive::Plane, &Pose::identity(), &self.primitive, &self.body.pose_w, 0.001);
        let (mut force, mut torque) = (self.gravity * self.body.mass, Vec3::zeros());
        let mut springs = BTreeMap::new();
        for point in &points {
            let f = self.force(point, &mut springs);
            force += f;
            torque += (point.position_w - self.body.pose_w.translation.vector).cross(&f);
        }
        self.springs = springs;
        let spin = torque_free_rotation(&self.body, DT);
        let inverse = self.body.inertia_w().try_inverse().expect("a real inertia");
        let (v, w) = (self.body.v + force * (DT / self.body.mass), spin.end_w + inverse * torque * DT);
        advance(&mut self.body, v, w, &spin, DT);
    }

    fn run(&mut self, seconds: f64) {
        (0..(seconds / DT) as usize).for_each(|_| self.step());
    }
}

/// True if a body on the incline tips over its lower edge. Gravity turns from flat to `slope` over a quarter of a
/// second, so that only statics decides.
fn tips(primitive: Primitive, turn: Quat, slope: f64) -> bool {
    let mut scene = Incline::new(primitive, turn, 0.0, 5.0);
    let (ramp, start) = (12_500, scene.body.pose_w.rotation);
    for k in 0..ramp + 20_000 {
        let now = slope * (f64::from(k) / f64::from(ramp)).min(1.0);
        scene.gravity = Vec3::new(now.sin(), 0.0, -now.cos()) * GRAVITY;
        scene.step();
    }
    scene.body.pose_w.rotation.angle_to(&start) > 0.05
}

fn about_z(angle: f64) -> Quat {
    Quat::from_scaled_axis(Vec3::z() * angle)
}

#[test]
fn a_block_rests_without_creeping_and_slides_at_the_coulomb_rate() {
    let mut held = Incline::new(BOX, Quat::identity(), 0.25, 0.6);
    held.run(0.2);
    let before = held.body.pose_w;
    held.run(0.3);
    let moved = (held.body.pose_w.translation.vector - before.translation.vector).norm();
    assert!(moved < 1e-6 && held.body.pose_w.rotation.angle_to(&before.rotation) < 1e-6, "moved {moved} m");
    let (slope, mu) = (0.4f64, 0.3);
    let low = Primitive::Box { half: Vec3::new(0.05, 0.05, 0.01) };
    let mut sliding = Incline::new(low, Quat::identity(), slope, mu);
    sliding.run(0.1);
    let v0 = sliding.body.v.x;
    sliding.run(0.3);
    let acceleration = (sliding.body.v.x - v0) / 0.3;
    let expected = GRAVITY * (slope.sin() - mu * slope.cos());
    assert!((acceleration / expected - 1.0).abs() < 0.002, "{acceleration} instead of {expected}");
}

#[test]
fn boxes_and_cans_tip_within_three_tenths_of_a_degree_of_the_closed_form() {
    let box_angle = (0.03f64 / 0.05).atan();
    let can_angle = (0.033f64 / 0.05).atan();
    let margin = 0.3f64.to_radians();
    // For the can along a rim point and, the worst heading, half-way between two.
    let worst = PI / f64::from(feature::RIM_POINTS);
    for (primitive, turn, angle) in [
        (BOX, Quat::identity(), box_angle),
        (CAN, Quat::identity(), can_angle),
        (CAN, about_z(worst), can_angle),
        (CAN, about_z(0.4 * worst), can_angle),
    ] {
        assert!(!tips(primitive, turn, angle - margin), "{primitive:?} tips too early");
        assert!(tips(primitive, turn, angle + margin), "{primitive:?} does not tip");
    }
}

#[test]
fn a_sphere_and_a_can_roll_from_rest_down_half_a_degree() {
    let slope = 0.5f64.to_radians();
    let lying = Quat::from_scaled_axis(Vec3::x() * (0.5 * PI));
    // v̇ = g sin θ / (1 + I/(m r²)): 5/7 for a solid ball, 2/3 for a solid cylinder.
    for (primitive, turn, share) in [(BALL, Quat::identity(), 5.0 / 7.0), (CAN, lying, 2.0 / 3.0)] {
        let mut scene = Incline::new(primitive, turn, slope, 0.5);
        scene.run(0.1);
        let v0 = scene.body.v.x;
        scene.run(0.5);
        let acceleration = (scene.body.v.x - v0) / 0.5;
        let expected = share * GRAVITY * slope.sin();
        assert!(
            (acceleration / expected - 1.0).abs() < 0.005,
            "{primitive:?}: {acceleration} instead of {expected}"
        );
        assert!(scene.body.v.y.abs() < 1e-9, "drifts sideways at {} m/s", scene.body.v.y);
    }
}
