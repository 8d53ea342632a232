//! Free rigid bodies against closed forms: fall, slopes, tipping, rolling, stacks, collisions.

use std::f64::consts::PI;

use softvt::{
    geometry::{Pose, Vec3, shape::Shape},
    physics::{RigidId, World},
};

use crate::solids::{
    GRAVITY, at, cuboid, floor, friction, gravity, rigid, rounded_box, rounded_can, run, tilt, tilted,
    turned, world,
};

/// Friction of what stands or rolls on a floor.
pub const MU: (f64, f64) = (0.6, 0.5);
/// Friction of the sliding block, whose two coefficients differ more.
pub const SLIDING: (f64, f64) = (0.6, 0.4);

fn can() -> Shape {
    Shape::Cylinder { radius: 0.033, half_height: 0.05 }
}

fn on_floor(shape: &Shape, pose: Pose) -> (World, RigidId) {
    let mut world = world();
    floor(&mut world, friction(MU.0, MU.1));
    let body = rigid(&mut world, shape, 0.3, pose, friction(MU.0, MU.1));
    (world, body)
}

fn position(world: &World, body: RigidId) -> Vec3 {
    world.rigid(body).state.pose_w.translation.vector
}

/// Relative errors of speed and way after a free fall of one second.
pub fn fall() -> [f64; 2] {
    let mut world = world();
    let body = rigid(&mut world, &cuboid(0.05, 0.06, 0.07), 0.3, Pose::identity(), friction(MU.0, MU.1));
    world.rigid_mut(body).state.w = Vec3::new(1.0, 2.0, 3.0);
    run(&mut world, 1.0);
    let way = -position(&world, body).z;
    // The velocity is that of the middle of the last step.
    let at = 1.0 - 0.5 * world.params.dt;
    [-world.rigid(body).state.v.z / (GRAVITY * at) - 1.0, way / (0.5 * GRAVITY) - 1.0]
}

/// Acceleration along x between 0.2 s and 0.5 s.
fn acceleration(mut world: World, body: RigidId) -> f64 {
    run(&mut world, 0.2);
    let before = world.rigid(body).state.v.x;
    run(&mut world, 0.3);
    (world.rigid(body).state.v.x - before) / 0.3
}

/// A block on a slope that has grown to `angle` (rad), and its acceleration over that of dynamic friction; and how far
/// it creeps in 5 s, m.
pub struct Slide {
    pub acceleration: f64,
    pub crept: f64,
}

/// A block on a slope of `angle`, rad.
pub fn slide(angle: f64) -> Slide {
    let slope = || {
        let mut world = world();
        floor(&mut world, friction(SLIDING.0, SLIDING.1));
        let shape = cuboid(0.1, 0.1, 0.02);
        let body = rigid(&mut world, &shape, 0.3, at(0.0, 0.0, 0.01), friction(0.0, 0.0));
        tilt(&mut world, angle, 0.5);
        (world, body)
    };
    let (mut held, body) = slope();
    let before = position(&held, body);
    run(&mut held, 5.0);
    let crept = (position(&held, body) - before).norm();
    let (world, body) = slope();
    let expected = GRAVITY * (angle.sin() - SLIDING.1 * angle.cos());
    Slide { acceleration: acceleration(world, body) / expected, crept }
}

/// Acceleration of a ball and of a lying can from rest on half a degree, over the closed forms.
pub fn rolls() -> [f64; 2] {
    let slope = 0.5f64.to_radians();
    let lying = turned(at(0.0, 0.0, 0.033), Vec3::x() * (0.5 * PI));
    let bodies = [(Shape::Sphere { radius: 0.03 }, at(0.0, 0.0, 0.03), 5.0 / 7.0), (can(), lying, 2.0 / 3.0)];
    bodies.map(|(shape, pose, share)| {
        let mut world = tilted(slope);
        floor(&mut world, friction(MU.0, MU.1));
        let body = rigid(&mut world, &shape, 0.3, pose, friction(MU.0, MU.1));
        acceleration(world, body) / (share * GRAVITY * slope.sin())
    })
}

/// A body on a rough slope.
pub struct Standing {
    pub name: &'static str,
    shape: Shape,
    pose: Pose,
    /// Angle at which it tips, rad.
    pub tips_at: f64,
}

/// Edge of the rounded boxes, m.
const EDGE: f64 = 0.048;

/// A box and a can, which is turned so that different samples of its rim carry it, and both with rounded edges, which
/// tip over the outline of the flat that they rest on.
pub fn standing() -> Vec<Standing> {
    let headed = |angle: f64| turned(at(0.0, 0.0, 0.05), Vec3::z() * angle);
    let tall = cuboid(0.06, 0.08, 0.1);
    let rounded = |name, shape, height: f64, slope: f64| Standing {
        name,
        shape,
        pose: at(0.0, 0.0, 0.5 * height),
        tips_at: slope.atan(),
    };
    let can_at = |name, turn| Standing { name, shape: can(), pose: headed(turn), tips_at: 0.66f64.atan() };
    vec![
        Standing { name: "box 60 × 80 × 100 mm", shape: tall, pose: headed(0.0), tips_at: 0.6f64.atan() },
        can_at("can ⌀66 × 100 mm", 0.0),
        can_at("the same, turned by 7.5°", PI / 24.0),
        can_at("the same, turned by 2.9°", 0.05),
        rounded(
            "box of 48 mm, edges rounded by 4.8 mm",
            rounded_box(Vec3::repeat(EDGE), 0.1 * EDGE),
            EDGE,
            0.8,
        ),
        rounded(
            "box of 48 mm, edges rounded by 21.6 mm",
            rounded_box(Vec3::repeat(EDGE), 0.45 * EDGE),
            EDGE,
            0.1,
        ),
        rounded("can ⌀66 × 100 mm, edges rounded by 6 mm", rounded_can(0.033, 0.1, 0.006), 0.1, 0.54),
    ]
}

impl Standing {
    /// True if it tips over its lower edge when the slope grows slowly from zero to `angle`, rad.
    fn tips(&self, angle: f64) -> bool {
        let mut world = world();
        floor(&mut world, friction(5.0, 5.0));
        let body = rigid(&mut world, &self.shape, 0.3, self.pose, friction(0.0, 0.0));
        tilt(&mut world, angle, 1.5);
        world.rigid(body).state.pose_w.rotation.angle_to(&self.pose.rotation) > 0.05
    }

    /// The angle at which it tips, rad, to a fiftieth of a degree; within two degrees of the closed form.
    pub fn found(&self) -> f64 {
        let (mut low, mut high) = (self.tips_at - 2f64.to_radians(), self.tips_at + 2f64.to_radians());
        while high - low > 0.02f64.to_radians() {
            let middle = 0.5 * (low + high);
            if self.tips(middle) { high = middle } else { low = middle }
        }
        0.5 * (low + high)
    }
}

/// Largest displacement (m) and rotation (rad) of any body within `seconds`.
pub fn drift(world: &mut World, seconds: f64) -> [f64; 2] {
    let before: Vec<Pose> = world.rigid_bodies().iter().map(|r| r.state.pose_w).collect();
    run(world, seconds);
    let moved = world.rigid_bodies().iter().zip(&before).map(|(rigid, before)| {
        let now = rigid.state.pose_w;
        let way = (now.translation.vector - before.translation.vector).norm();
        [way, now.rotation.angle_to(&before.rotation)]
    });
    moved.fold([0.0; 2], |most, next| [most[0].max(next[0]), most[1].max(next[1])])
}

/// Drift of five boxes on each other over 10 s. A little askew, so that they are no special case.
pub fn stack() -> [f64; 2] {
    stack_of(&cuboid(0.05, 0.05, 0.05))
}

/// The same for boxes whose edges are rounded by 5 mm.
pub fn rounded_stack() -> [f64; 2] {
    stack_of(&rounded_box(Vec3::repeat(0.05), 0.005))
}

fn stack_of(shape: &Shape) -> [f64; 2] {
    let pose = |i: usize| {
        let shift = [0.0, 3e-3, -2e-3, 2e-3, -1e-3][i];
        turned(at(shift, -0.5 * shift, 0.025 + 0.05 * i as f64), Vec3::z() * (20.0 * shift))
    };
    let mut world = world();
    floor(&mut world, friction(MU.0, MU.1));
    (0..5).for_each(|i| {
        rigid(&mut world, shape, 0.3, pose(i), friction(MU.0, MU.1));
    });
    run(&mut world, 1.0);
    drift(&mut world, 10.0)
}

/// Change of momentum and energy by a collision of two free boxes.
#[derive(Debug)]
pub struct Collision {
    /// Momentum and angular momentum, relative.
    pub momentum: f64,
    pub spin: f64,
    /// Energy after over before.
    pub energy: f64,
}

/// Two boxes that meet off their centres, with friction.
fn colliding() -> World {
    let mut world = World::new(world().params, Vec3::zeros());
    let shape = cuboid(0.05, 0.06, 0.07);
    let tilt = turned(at(0.12, 0.01, -0.01), Vec3::new(0.3, 0.2, 0.5));
    let a = rigid(&mut world, &shape, 0.3, Pose::identity(), friction(MU.0, MU.1));
    let b = rigid(&mut world, &shape, 0.5, tilt, friction(MU.0, MU.1));
    let first = &mut world.rigid_mut(a).state;
    (first.v, first.w) = (Vec3::new(1.0, 0.2, 0.1), Vec3::new(0.0, 1.0, 2.0));
    world.rigid_mut(b).state.v = Vec3::new(-0.5, 0.0, 0.0);
    world
}

pub fn collision() -> Collision {
    let mut world = colliding();
    let sums = |world: &World| {
        let bodies = world.rigid_bodies().iter().map(|r| &r.state);
        let linear = bodies.clone().map(|b| b.momentum()).sum::<Vec3>();
        (linear, bodies.map(|b| b.angular_momentum()).sum::<Vec3>())
    };
    let ((linear, angular), energy) = (sums(&world), world.energy().total());
    run(&mut world, 0.5);
    let (linear_now, angular_now) = sums(&world);
    Collision {
        momentum: (linear_now - linear).norm() / linear.norm(),
        spin: (angular_now - angular).norm() / angular.norm(),
        energy: world.energy().total() / energy,
    }
}

/// Largest gain of energy in one step, of the energy at the start (potential: over the floor), by scene.
pub fn largest_gains() -> Vec<(&'static str, f64)> {
    let block = cuboid(0.05, 0.06, 0.07);
    let tumbling = || {
        let (mut world, body) = on_floor(&block, turned(at(0.0, 0.0, 0.3), Vec3::new(0.4, 0.3, 0.2)));
        world.rigid_mut(body).state.w = Vec3::new(4.0, 3.0, 1.0);
        world.rigid_mut(body).state.v = Vec3::x() * 0.5;
        world
    };
    let rolling = || {
        let (mut world, _) = on_floor(&Shape::Sphere { radius: 0.03 }, at(0.0, 0.0, 0.03));
        world.gravity = gravity(0.05);
        world.rigid_mut(RigidId::new(0)).state.v = -Vec3::x();
        world.rigid_mut(RigidId::new(0)).state.w = -Vec3::y() / 0.03;
        world
    };
    let tipping = || on_floor(&cuboid(0.03, 0.03, 0.2), turned(at(0.0, 0.0, 0.105), Vec3::y() * 0.2)).0;
    let rounded = || {
        let mut world = world();
        floor(&mut world, friction(MU.0, MU.1));
        let shape = rounded_box(Vec3::new(0.05, 0.06, 0.07), 0.012);
        let pose = turned(at(0.0, 0.0, 0.3), Vec3::new(0.4, 0.3, 0.2));
        let body = rigid(&mut world, &shape, 0.3, pose, friction(MU.0, MU.1));
        let state = &mut world.rigid_mut(body).state;
        (state.w, state.v) = (Vec3::new(4.0, 3.0, 1.0), Vec3::x() * 0.5);
        world
    };
    let scenes: [(&str, &dyn Fn() -> World); 5] = [
        ("two boxes collide", &colliding),
        ("a turning box falls and tumbles", &tumbling),
        ("a ball rolls up a slope and back", &rolling),
        ("a tall box falls over", &tipping),
        ("a box with rounded edges falls and tumbles", &rounded),
    ];
    scenes.into_iter().map(|(name, make)| (name, largest_gain(make()))).collect()
}

fn largest_gain(mut world: World) -> f64 {
    let start = world.energy().total();
    let (mut before, mut last, mut most) = (world.energy(), None, f64::NEG_INFINITY);
    for step in 0..180 {
        world.step().expect("a step that converges");
        // Velocities are those of the middle of the steps, so kinetic energy at the end of one is a mean.
        let after = world.energy();
        let now = before.total() + 0.5 * (after.kinetic - before.kinetic);
        // The first is not one: the given velocities are those at the start.
        if let Some(last) = last.filter(|_| step > 1) {
            most = most.max((now - last) / start);
        }
        (before, last) = (after, Some(now));
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_falling_body_has_the_speed_and_the_way_of_the_closed_form() {
        let [speed, way] = fall();
        assert!(speed.abs() < 1e-7 && way.abs() < 1e-6, "{speed} {way}");
    }

    #[test]
    fn a_block_sticks_below_the_static_angle_and_slides_above_it_with_dynamic_friction() {
        let held = slide(SLIDING.0.atan() - 0.02);
        assert!(held.crept < 1e-6, "crept {} m in 5 s", held.crept);
        for angle in [SLIDING.0.atan() + 0.02, 0.8] {
            let ratio = slide(angle).acceleration;
            assert!((ratio - 1.0).abs() < 0.01, "{angle}: {ratio}");
        }
    }

    #[test]
    fn balls_and_cans_roll_from_rest_on_half_a_degree() {
        assert!(rolls().iter().all(|ratio| (ratio - 1.0).abs() < 0.01), "{:?}", rolls());
    }

    #[test]
    fn boxes_and_cans_tip_within_three_tenths_of_a_degree_of_their_angle() {
        for body in standing() {
            let off = (body.found() - body.tips_at).to_degrees();
            assert!(off.abs() < 0.3, "{}: {off}°", body.name);
        }
    }

    #[test]
    fn a_stack_of_five_boxes_does_not_move_for_ten_seconds() {
        for [moved, turned] in [stack(), rounded_stack()] {
            assert!(moved < 1e-6 && turned < 1e-5, "moved {moved} m, turned {turned} rad");
        }
    }

    #[test]
    fn a_collision_keeps_momentum_and_makes_no_energy() {
        let collision = collision();
        assert!(collision.momentum < 1e-6 && collision.spin < 0.01, "{collision:?}");
        assert!(collision.energy < 0.9, "they met: {collision:?}");
    }

    #[test]
    fn no_step_gains_energy() {
        for (name, gain) in largest_gains() {
            // In an impact, the mean of the kinetic energies before and after stands for that at the end of the step.
            assert!(gain < 2e-3, "{name}: {gain}");
        }
    }
}
