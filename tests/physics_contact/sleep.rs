//! Sleep saves time and changes no result.

use softvt::{
    evaluation::deformation::ReferenceShape,
    geometry::{Pose, Vec3},
    physics::{BodyId, KinematicId, RigidId, SoftId, World},
};

use crate::scene::*;

/// Edge of the cubes, m.
const EDGE: f64 = 0.05;

/// A soft cube at rest on a floor, one at rest on a rigid block, and two fingers next to the first.
struct Still {
    world: World,
    cube: SoftId,
    upper: SoftId,
    block: RigidId,
    fingers: [KinematicId; 2],
}

/// Distance of the fingers from the centre of the cube at the start, m.
const REACH: f64 = 0.15;

fn still(sleeping: bool) -> Still {
    let mut world = world();
    world.params.sleeping = sleeping;
    let grip = friction(0.6, 0.5);
    floor(&mut world, grip);
    let shape = cuboid(EDGE, EDGE, EDGE);
    let rest = fem_model(&shape, crumb(), 5, 4e-3);
    let cube = soft(&mut world, &shape, &rest, at(0.0, 0.0, 0.5 * EDGE), grip);
    let block = rigid(&mut world, &shape, 0.3, at(0.4, 0.0, 0.5 * EDGE), grip);
    let upper = soft(&mut world, &shape, &rest, at(0.4, 0.0, 1.5 * EDGE), grip);
    let fingers = [-1.0, 1.0].map(|side| {
        let finger = world.add_kinematic(at(side * REACH, 0.0, 0.5 * EDGE));
        world.add_shape("finger", finger, Pose::identity(), &cuboid(0.01, 0.02, 0.02), grip);
        finger
    });
    run(&mut world, 2.0);
    let bodies: [BodyId; 3] = [cube.into(), upper.into(), block.into()];
    assert!(bodies.iter().all(|&body| world.is_asleep(body) == sleeping));
    Still { world, cube, upper, block, fingers }
}

/// Peak D of both cubes, %, and where they end, m: with and without sleep.
fn outcomes(act: impl Fn(&mut Still, usize)) -> [[(f64, Vec3); 2]; 2] {
    [true, false].map(|sleeping| {
        let mut still = still(sleeping);
        let cubes = [still.cube, still.upper];
        let rests = cubes.map(|id| {
            let body = &still.world.soft(id).state;
            ReferenceShape::new(&body.x, &body.model.mass).expect("a cube")
        });
        let mut peaks = [0.0_f64; 2];
        for step in 0..60 {
            act(&mut still, step);
            still.world.step().expect("a step that converges");
            for (peak, (id, rest)) in peaks.iter_mut().zip(cubes.iter().zip(&rests)) {
                let d = rest.measure(&still.world.soft(*id).state.x).expect("a cube").rms_pct;
                *peak = peak.max(d);
            }
        }
        [0, 1].map(|i| (peaks[i], still.world.soft(cubes[i]).state.centre()))
    })
}

/// Asserts that sleep changes nothing; `moved` is which of the cubes the change concerns.
fn assert_same(what: &str, moved: [bool; 2], act: impl Fn(&mut Still, usize)) {
    let [asleep, awake] = outcomes(act);
    for ((asleep, awake), moved) in asleep.iter().zip(&awake).zip(moved) {
        // A body at rest keeps less than a thousandth of a per cent of motion below the speed of sleep.
        assert_eq!(awake.0 > 0.05, moved, "{what}: {awake:?}");
        assert!((asleep.0 - awake.0).abs() < 2e-3 * awake.0.max(1.0), "{what}: {asleep:?} {awake:?}");
        assert!((asleep.1 - awake.1).norm() < 2e-5, "{what}: {asleep:?} {awake:?}");
    }
}

#[test]
fn sleeping_changes_no_result_with_a_hand_of_any_speed() {
    for speed in [0.02, 0.1, 0.2, 0.5, 1.0, 1.5, 3.0] {
        assert_same(&format!("{speed} m/s"), [true, false], |still, step| {
            let (way, end) = (speed * (step + 1) as f64 * still.world.params.dt, 0.5 * EDGE + 0.005 - 0.004);
            // Slow fingers start nearer, so that they arrive.
            let from = REACH.min(end + 0.5 * speed);
            for (side, finger) in [-1.0, 1.0].into_iter().zip(still.fingers) {
                if step == 0 && from < REACH {
                    still.world.place_kinematic(finger, at(side * from, 0.0, 0.5 * EDGE));
                }
                still.world.move_kinematic(finger, at(side * (from - way).max(end), 0.0, 0.5 * EDGE));
            }
        });
    }
}

#[test]
fn a_change_from_outside_wakes_what_it_concerns() {
    let once = |change: fn(&mut Still)| {
        move |still: &mut Still, step: usize| {
            if step == 0 {
                change(still)
            }
        }
    };
    assert_same("gravity", [true, true], once(|still| still.world.gravity = Vec3::new(9.0, 0.0, -9.81)));
    assert_same(
        "a raised body",
        [true, false],
        once(|still| {
            still.world.set_soft_motion(still.cube, |x, _| x.z += 0.02);
        }),
    );
    assert_same(
        "a pushed body",
        [true, false],
        once(|still| {
            still.world.set_soft_motion(still.cube, |_, v| v.x = 0.5);
        }),
    );
    assert_same(
        "a support that is gone",
        [false, true],
        once(|still| {
            still.world.rigid_mut(still.block).state.pose_w.translation.vector.x += 0.2;
        }),
    );
    assert_same(
        "a finger that is there at once",
        [true, false],
        once(|still| {
            still.world.place_kinematic(still.fingers[0], at(-0.5 * EDGE - 0.003, 0.0, 0.5 * EDGE));
        }),
    );
    let mut still = still(true);
    still.world.params.rayleigh_stiffness *= 2.0;
    still.world.step().expect("a step that converges");
    assert!(!still.world.is_asleep(still.cube) && !still.world.is_asleep(still.block));
}

#[test]
fn the_patch_of_a_sleeping_body_carries_its_weight() {
    let Still { mut world, block, upper, cube, .. } = still(true);
    let force = |world: &World, id| {
        let patch = world.patch(id);
        patch.points.iter().map(|point| point.pressure * point.area).sum::<f64>()
    };
    let (ground, of_block) = (world.colliders(), world.contact_with(block, BodyId::World));
    let ids: Vec<_> = (0..ground.len()).map(softvt::physics::ColliderId::new).collect();
    let on_floor = of_block.normal_force + world.contact_with(cube, BodyId::World).normal_force;
    assert!(on_floor > 0.5, "{on_floor} N");
    for _ in 0..3 {
        assert!((force(&world, ids[0]) / on_floor - 1.0).abs() < 1e-9, "{}", force(&world, ids[0]));
        let of_upper = world.contact_with(upper, block).normal_force;
        let on_block = of_block.normal_force + of_upper;
        assert!(
            (force(&world, ids[1]) / on_block - 1.0).abs() < 1e-9,
            "{} {on_block}",
            force(&world, ids[1])
        );
        world.step().expect("a step that converges");
    }
    // Awake again, it is counted once.
    world.set_soft_motion(cube, |_, _| {});
    world.step().expect("a step that converges");
    assert!((force(&world, ids[0]) / on_floor - 1.0).abs() < 1e-3, "{}", force(&world, ids[0]));
}
