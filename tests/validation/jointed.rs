//! Bodies on joints against closed forms, and bodies on and in articulated objects.

use nalgebra::Unit;
use softvt::{
    geometry::{Mat3, Pose, Vec3, mass::mass_properties, shape::Shape},
    physics::{
        ArticulationId, LinkId, RigidId, World,
        joints::{JointKind, JointTree, Link},
    },
};

use crate::{
    rigid::{MU, drift},
    solids::{GRAVITY, cuboid, floor, friction, rigid, run, tilted, world},
};

/// Mass of the jointed part, kg.
const MASS: f64 = 0.6;
/// Length of the rod that swings, m.
const ROD: f64 = 0.4;

fn link(kind: JointKind, (lower, upper): (f64, f64), damping: f64, dry: f64) -> Link {
    Link {
        name: "part".into(),
        parent: None,
        placement: Pose::identity(),
        kind,
        mass: MASS,
        com: Vec3::zeros(),
        inertia: Mat3::identity() * 1e-3,
        lower,
        upper,
        velocity_limit: f64::INFINITY,
        effort_limit: f64::INFINITY,
        friction: dry,
        damping,
    }
}

fn jointed(mut world: World, link: Link, q: f64) -> World {
    let tree = JointTree { links: vec![link], base_w: Pose::identity() };
    world.add_articulation("furniture", tree, &[q], vec![None], true);
    world
}

/// A thin rod on a hinge, `angle` rad from hanging.
fn pendulum(angle: f64) -> World {
    let hinge = JointKind::Revolute(Unit::new_normalize(Vec3::y()));
    let across = MASS * ROD * ROD / 12.0;
    let rod = Link {
        com: Vec3::z() * (-0.5 * ROD),
        inertia: Mat3::from_diagonal(&Vec3::new(across, across, 1e-3 * across)),
        ..link(hinge, (-3.0, 3.0), 0.0, 0.0)
    };
    jointed(world(), rod, angle)
}

/// Period of a rod on a hinge that swings by `angle` (rad) to either side, over 2π √(2L/3g) / agm(1, cos(angle/2)),
/// Gauss's form of the exact period.
pub fn period(angle: f64) -> f64 {
    let mut world = pendulum(angle);
    let dt = world.params.dt;
    let (mut crossings, mut last) = (Vec::new(), angle);
    while crossings.len() < 21 {
        world.step().expect("a step that converges");
        let q = world.articulations()[0].state.q[0];
        if (q < 0.0) != (last < 0.0) {
            crossings.push(world.time() - dt * q / (q - last));
        }
        last = q;
    }
    let found = (crossings[20] - crossings[0]) / 10.0;
    let (mut a, mut g) = (1.0, (0.5 * angle).cos());
    for _ in 0..8 {
        (a, g) = (0.5 * (a + g), f64::sqrt(a * g));
    }
    found / (2.0 * std::f64::consts::PI * (2.0 * ROD / (3.0 * GRAVITY)).sqrt() / a)
}

/// Largest gain of energy in a step, and change of a swing's largest energy within 20 s, of a rod on a hinge, of its
/// energy over hanging. Positions are those at the ends of steps and velocities those within them, so the energy is
/// that of the middle of a step.
pub fn swing(angle: f64) -> [f64; 2] {
    let mut world = pendulum(angle);
    let energy = |before: f64, world: &World| {
        let state = &world.articulations()[0].state;
        let middle = 0.5 * (before + state.q[0]);
        MASS * ROD * ROD / 6.0 * state.v[0].powi(2) + 0.5 * MASS * GRAVITY * ROD * (1.0 - middle.cos())
    };
    let mut seen: Vec<f64> = Vec::new();
    for _ in 0..1200 {
        let before = world.articulations()[0].state.q[0];
        world.step().expect("a step that converges");
        seen.push(energy(before, &world));
    }
    let gain = seen.windows(2).map(|pair| (pair[1] - pair[0]) / seen[0]).fold(f64::NEG_INFINITY, f64::max);
    let most = |steps: &[f64]| steps.iter().copied().fold(0.0, f64::max);
    [gain, most(&seen[1080..]) / most(&seen[..120]) - 1.0]
}

/// A drawer that slides along x, with damping (N s/m) and dry friction (N).
fn drawer(world: World, damping: f64, dry: f64) -> World {
    let slide = JointKind::Prismatic(Unit::new_normalize(Vec3::x()));
    jointed(world, link(slide, (0.0, 0.15), damping, dry), 0.02)
}

/// Steps of the drawer that is pushed, s.
pub const STEPS: [f64; 2] = [1.0 / 60.0, 1.0 / 960.0];

/// Way of a drawer pushed with `speed` (m/s) until damping and friction stop it, and that of the closed form
/// m/c (v − F/c ln(1 + c v/F)), m.
pub fn stopping(speed: f64, dt: f64) -> [f64; 2] {
    let (damping, dry) = (1.2, 0.8);
    let mut world = drawer(world(), damping, dry);
    world.params.dt = dt;
    world.articulation_mut(ArticulationId::new(0)).state.v[0] = speed;
    run(&mut world, 1.0);
    let way = world.articulations()[0].state.q[0] - 0.02;
    [way, MASS / damping * (speed - dry / damping * (1.0 + damping * speed / dry).ln())]
}

/// Speed of a damped drawer that slides down a slope, over (m g sin − F) / c.
pub fn terminal() -> f64 {
    let (slope, damping, dry) = (0.3f64, 40.0, 0.5);
    let mut world = drawer(tilted(slope), damping, dry);
    run(&mut world, 0.5);
    world.articulations()[0].state.v[0] / ((MASS * GRAVITY * slope.sin() - dry) / damping)
}

/// Creep of a drawer in 10 s at 95 % of its friction, m.
pub fn creep() -> f64 {
    let slope = 0.3f64;
    let mut world = drawer(tilted(slope), 0.0, MASS * GRAVITY * slope.sin() / 0.95);
    run(&mut world, 0.5);
    let before = world.articulations()[0].state.q[0];
    run(&mut world, 10.0);
    (world.articulations()[0].state.q[0] - before).abs()
}

/// Largest overshoot of a drawer that runs into its end at 1 m/s, and the final distance from the end, m.
pub fn stop() -> [f64; 2] {
    let mut world = drawer(world(), 0.0, 0.2);
    world.articulation_mut(ArticulationId::new(0)).state.v[0] = 1.0;
    let mut most = f64::NEG_INFINITY;
    for _ in 0..120 {
        world.step().expect("a step that converges");
        most = most.max(world.articulations()[0].state.q[0] - 0.15);
    }
    [most, (world.articulations()[0].state.q[0] - 0.15).abs()]
}

/// A vessel of revolution: foot, rim and height, mm.
fn vessel(foot: f64, rim: f64, height: f64) -> Shape {
    let wall = 4.5;
    let corners = [
        [0.0, 0.0],
        [foot, 0.0],
        [rim, height],
        [rim - wall, height],
        [foot - 0.4 * wall, 1.2 * wall],
        [0.0, 1.2 * wall],
    ];
    Shape::lathe(corners.map(|[r, z]| [1e-3 * r, 1e-3 * z]).to_vec()).expect("a vessel")
}

/// A bowl of 107 mm.
fn bowl() -> Shape {
    vessel(27.0, 53.5, 48.0)
}

fn add(world: &mut World, shape: &Shape, at: Pose) -> RigidId {
    rigid(world, shape, mass_properties(shape, 1500.0).mass, at, friction(MU.0, MU.1))
}

/// Drift over 5 s of a bowl on a ramekin on a floor, after a second of settling.
pub fn bowl_on_ramekin() -> [f64; 2] {
    let mut world = world();
    floor(&mut world, friction(MU.0, MU.1));
    add(&mut world, &vessel(33.0, 44.5, 42.0), Pose::identity());
    // Its side widens from 27 to 53.5 mm over 48 mm, so it hangs in the inner rim, 40 mm wide, by 23.5 mm.
    let inside = 40.0 - 27.0;
    let height = 42.0 - inside * 48.0 / 26.5;
    add(&mut world, &bowl(), Pose::translation(1e-3, 0.0, 1e-3 * height + 5e-4));
    run(&mut world, 1.0);
    drift(&mut world, 5.0)
}

/// Motion of a bowl in an open drawer.
#[derive(Debug)]
pub struct Carried {
    /// Drift over 5 s at rest, m and rad.
    pub drift: [f64; 2],
    /// Lag behind a drawer that is pushed by 30 mm, m.
    pub behind: f64,
}

/// A drawer of boxes with a bowl in it, at rest and pushed.
pub fn bowl_in_drawer() -> Carried {
    let board = |size: [f64; 3], at: [f64; 3]| cuboid(size[0], size[1], size[2]).translated(Vec3::from(at));
    let shape = board([0.2, 0.2, 0.005], [0.0, 0.0, 0.0025])
        .union(board([0.005, 0.2, 0.05], [-0.0975, 0.0, 0.03]))
        .union(board([0.005, 0.2, 0.05], [0.0975, 0.0, 0.03]))
        .union(board([0.19, 0.005, 0.05], [0.0, 0.0975, 0.03]))
        .union(board([0.19, 0.005, 0.05], [0.0, -0.0975, 0.03]));
    let mut world = drawer(world(), 6.0, 1.2);
    let link = LinkId { articulation: ArticulationId::new(0), index: 0 };
    world.add_shape("drawer", link, Pose::identity(), &shape, friction(MU.0, MU.1));
    let body = add(&mut world, &bowl(), Pose::translation(0.03, 0.02, 0.005));
    run(&mut world, 1.0);
    let drift = drift(&mut world, 5.0);
    let place =
        |world: &World| (world.rigid(body).state.pose_w.translation.x, world.articulations()[0].state.q[0]);
    let before = place(&world);
    // 2 N beyond friction and damping for as long as it takes; the tray speeds up at less than the bowl's friction can.
    while world.articulations()[0].state.q[0] < before.1 + 0.03 {
        world.articulation_mut(ArticulationId::new(0)).state.v[0] += 2.0 / MASS * world.params.dt;
        world.step().expect("a step that converges");
    }
    run(&mut world, 1.0);
    let after = place(&world);
    Carried { drift, behind: ((after.0 - before.0) - (after.1 - before.1)).abs() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rod_on_a_hinge_swings_with_the_period_of_the_closed_form_and_keeps_its_energy() {
        for angle in [0.1, 0.5, 1.2] {
            let ratio = period(angle);
            assert!((ratio - 1.0).abs() < 1e-3, "{angle} rad: {ratio}");
            let [gain, change] = swing(angle);
            assert!(gain < 1e-3 && change.abs() < 1e-3, "{angle} rad: {gain} {change}");
        }
    }

    #[test]
    fn a_drawer_stops_and_slides_as_damping_and_friction_say() {
        for speed in [0.3, 0.5] {
            // The way is first-order in the step; docs/validation.md says so.
            let [coarse, fine] = STEPS.map(|dt| {
                let [way, exact] = stopping(speed, dt);
                way / exact - 1.0
            });
            assert!(fine.abs() < 5e-3, "{speed} m/s: off by {fine} at 960 Hz");
            assert!(coarse.abs() < 0.02, "{speed} m/s: off by {coarse} at 60 Hz, {fine} at 960 Hz");
        }
        assert!((terminal() - 1.0).abs() < 1e-4, "{}", terminal());
    }

    #[test]
    fn a_drawer_that_friction_holds_does_not_creep() {
        assert!(creep() < 1e-6, "{} m in 10 s", creep());
    }

    #[test]
    fn a_drawer_stops_at_its_end() {
        let [beyond, rest] = stop();
        assert!(beyond < 1e-3 && rest < 1e-3, "{beyond} m beyond, rests {rest} m from it");
    }

    #[test]
    fn a_bowl_stands_still_on_a_ramekin_and_in_a_drawer_and_goes_with_it() {
        let [moved, turned] = bowl_on_ramekin();
        assert!(moved < 1e-5 && turned < 1e-4, "moved {moved} m, turned {turned} rad");
        let carried = bowl_in_drawer();
        assert!(carried.drift[0] < 1e-5 && carried.drift[1] < 1e-4, "{carried:?}");
        assert!(carried.behind < 1e-4, "{carried:?}");
    }
}
