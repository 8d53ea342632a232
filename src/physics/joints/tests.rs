use nalgebra::{DVector, Unit};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use softvt_geometry::{Mat3, Pose, Quat, Vec3};

const GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -9.81);

fn vector(rng: &mut ChaCha8Rng, reach: f64) -> Vec3 {
    Vec3::from_fn(|_, _| rng.random_range(-reach..reach))
}

fn pose(rng: &mut ChaCha8Rng) -> Pose {
    Pose::from_parts(vector(rng, 0.4).into(), Quat::from_scaled_axis(vector(rng, 2.0)))
}

/// A branching tree with both kinds of joint about arbitrary axes.
fn any_tree(seed: u64) -> JointTree {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let parents = [None, Some(0), Some(1), Some(1), Some(3), None, Some(5)];
    let mut link = |(index, parent): (usize, Option<usize>)| {
        let axis = Unit::new_normalize(vector(&mut rng, 1.0));
        let turn = Quat::from_scaled_axis(vector(&mut rng, 2.0)).to_rotation_matrix();
        let inertia =
            turn.matrix() * Mat3::from_diagonal(&Vec3::new(0.02, 0.03, 0.04)) * turn.matrix().transpose();
        Link {
            name: format!("link{index}"),
            parent,
            placement: pose(&mut rng),
            kind: if index % 3 == 1 { JointKind::Prismatic(axis) } else { JointKind::Revolute(axis) },
            mass: rng.random_range(0.5..2.0),
            com: vector(&mut rng, 0.2),
            inertia: (inertia + inertia.transpose()) * 0.5,
            lower: -3.0,
            upper: 3.0,
            velocity_limit: 1.0,
            effort_limit: 1.0,
            friction: 0.0,
            damping: 0.0,
        }
    };
    let links = parents.into_iter().enumerate().map(&mut link).collect();
    let tree = JointTree { links, base_w: pose(&mut rng) };
    tree.validate().expect("a possible mechanism");
    tree
}

fn numbers(seed: u64, n: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| rng.random_range(-1.5..1.5)).collect()
}

fn shifted(q: &[f64], index: usize, by: f64) -> Vec<f64> {
    let mut q = q.to_vec();
    q[index] += by;
    q
}

/// Double pendulum of point masses on massless rods in the x–z plane, angles from the downward vertical, relative.
fn double_pendulum(masses: [f64; 2], lengths: [f64; 2]) -> JointTree {
    let link = |index: usize| Link {
        name: format!("rod{index}"),
        parent: index.checked_sub(1),
        placement: if index == 0 { Pose::identity() } else { Pose::translation(0.0, 0.0, -lengths[0]) },
        kind: JointKind::Revolute(-Vec3::y_axis()),
        mass: masses[index],
        com: Vec3::new(0.0, 0.0, -lengths[index]),
        inertia: Mat3::zeros(),
        lower: -10.0,
        upper: 10.0,
        velocity_limit: 10.0,
        effort_limit: 10.0,
        friction: 0.0,
        damping: 0.0,
    };
    JointTree { links: vec![link(0), link(1)], base_w: Pose::translation(0.3, -0.2, 1.0) }
}

#[test]
fn mass_matrix_is_symmetric_positive_definite_and_gives_the_kinetic_energy() {
    for seed in 0..8 {
        let tree = any_tree(seed);
        let poses = forward(&tree, &numbers(seed + 100, tree.dofs()));
        let mass = mass_matrix(&tree, &poses);
        assert_eq!(mass, mass.transpose());
        assert!(mass.clone().cholesky().is_some());
        let v = numbers(seed + 200, tree.dofs());
        let v_vector = DVector::from_column_slice(&v);
        let energy = 0.5 * v_vector.dot(&(&mass * &v_vector));
        let expected = kinetic_energy(&tree, &poses, &v);
        assert!((energy - expected).abs() < 1e-12 * expected, "{energy} {expected}");
    }
}

#[test]
fn bias_is_the_derivative_of_the_lagrangian() {
    let step = 1e-5;
    for seed in 0..4 {
        let tree = any_tree(seed);
        let n = tree.dofs();
        let (q, v) = (numbers(seed + 300, n), numbers(seed + 400, n));
        let gravity = Vec3::new(1.0, -2.0, -9.0);
        // T is quadratic in v, so ∂T/∂vᵢ = T(v + eᵢ) − T(v) − T(eᵢ) exactly.
        let momentum = |q: &[f64], i: usize| {
            let poses = forward(&tree, q);
            let unit = shifted(&vec![0.0; n], i, 1.0);
            kinetic_energy(&tree, &poses, &shifted(&v, i, 1.0))
                - kinetic_energy(&tree, &poses, &v)
                - kinetic_energy(&tree, &poses, &unit)
        };
        let lagrangian = |q: &[f64]| {
            let poses = forward(&tree, q);
            kinetic_energy(&tree, &poses, &v) - potential_energy(&tree, &poses, &gravity)
        };
        let along = |by: f64| -> Vec<f64> { q.iter().zip(&v).map(|(q, v)| q + by * v).collect() };
        let found = bias(&tree, &forward(&tree, &q), &v, &gravity);
        for i in 0..n {
            let rate = (momentum(&along(step), i) - momentum(&along(-step), i)) / (2.0 * step);
            let slope =
                (lagrangian(&shifted(&q, i, step)) - lagrangian(&shifted(&q, i, -step))) / (2.0 * step);
            assert!((found[i] - (rate - slope)).abs() < 1e-7, "joint {i}: {} {}", found[i], rate - slope);
        }
    }
}

#[test]
fn jacobian_is_the_derivative_of_the_link_pose() {
    let step = 1e-6;
    let tree = any_tree(5);
    let q = numbers(6, tree.dofs());
    let poses = forward(&tree, &q);
    for link in 0..tree.dofs() {
        let found = jacobian(&tree, &poses, link);
        for joint in 0..tree.dofs() {
            let ahead = forward(&tree, &shifted(&q, joint, step))[link];
            let behind = forward(&tree, &shifted(&q, joint, -step))[link];
            let linear = (ahead.translation.vector - behind.translation.vector) / (2.0 * step);
            let angular = (ahead.rotation * behind.rotation.inverse()).scaled_axis() / (2.0 * step);
            assert!((found.fixed_view::<3, 1>(0, joint) - linear).norm() < 1e-8);
            assert!((found.fixed_view::<3, 1>(3, joint) - angular).norm() < 1e-8);
        }
    }
}

#[test]
fn link_velocities_are_the_jacobian_times_the_joint_speeds() {
    let tree = any_tree(9);
    let poses = forward(&tree, &numbers(10, tree.dofs()));
    let v = numbers(11, tree.dofs());
    let v_vector = DVector::from_column_slice(&v);
    for (link, velocity) in velocities(&tree, &poses, &v).iter().enumerate() {
        let p_w = poses[link].translation.vector + Vec3::new(0.1, -0.3, 0.2);
        let expected = point_jacobian(&tree, &poses, link, &p_w) * &v_vector;
        assert!((velocity.at(&poses[link], &p_w) - expected.fixed_rows::<3>(0)).norm() < 1e-12);
        assert!((velocity.angular - expected.fixed_rows::<3>(3)).norm() < 1e-12);
    }
}

#[test]
fn double_pendulum_matches_its_closed_form() {
    let (m, l) = ([1.3, 0.7], [0.5, 0.8]);
    let tree = double_pendulum(m, l);
    for (q, v) in [([0.4, -1.1], [0.9, 2.0]), ([2.0, 0.3], [-1.0, 0.5])] {
        let poses = forward(&tree, &q);
        let (mass, found) = (mass_matrix(&tree, &poses), bias(&tree, &poses, &v, &GRAVITY));
        // Craig, Introduction to Robotics, 1986, §6.8, with angles from the downward vertical.
        let (c2, s2) = (q[1].cos(), q[1].sin());
        let m11 = l[1].powi(2) * m[1] + 2.0 * l[0] * l[1] * m[1] * c2 + l[0].powi(2) * (m[0] + m[1]);
        let m12 = l[1].powi(2) * m[1] + l[0] * l[1] * m[1] * c2;
        let expected = [m11, m12, m12, l[1].powi(2) * m[1]];
        assert!(mass.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-13), "{mass}");
        let whirl = m[1] * l[0] * l[1] * s2;
        let sag = m[1] * l[1] * 9.81 * (q[0] + q[1]).sin();
        let b0 = -whirl * v[1] * (2.0 * v[0] + v[1]) + (m[0] + m[1]) * l[0] * 9.81 * q[0].sin() + sag;
        let b1 = whirl * v[0] * v[0] + sag;
        assert!((found[0] - b0).abs() < 1e-12 && (found[1] - b1).abs() < 1e-12, "{found} {b0} {b1}");
    }
}

fn rates(tree: &JointTree, q: &DVector<f64>, v: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
    let poses = forward(tree, q.as_slice());
    let load = -bias(tree, &poses, v.as_slice(), &GRAVITY);
    let acceleration = mass_matrix(tree, &poses).cholesky().expect("positive definite").solve(&load);
    (v.clone(), acceleration)
}

fn rk4(tree: &JointTree, state: &mut JointState, dt: f64) {
    let (q, v) = (&state.q, &state.v);
    let (q1, v1) = rates(tree, q, v);
    let (q2, v2) = rates(tree, &(q + &q1 * (dt / 2.0)), &(v + &v1 * (dt / 2.0)));
    let (q3, v3) = rates(tree, &(q + &q2 * (dt / 2.0)), &(v + &v2 * (dt / 2.0)));
    let (q4, v4) = rates(tree, &(q + &q3 * dt), &(v + &v3 * dt));
    state.q += (q1 + q2 * 2.0 + q3 * 2.0 + q4) * (dt / 6.0);
    state.v += (v1 + v2 * 2.0 + v3 * 2.0 + v4) * (dt / 6.0);
}

#[test]
fn free_motion_conserves_energy() {
    let tree = any_tree(3);
    let mut state = JointState::at_rest(&numbers(31, tree.dofs()));
    let energy = |state: &JointState| {
        let poses = forward(&tree, state.q.as_slice());
        let kinetic = kinetic_energy(&tree, &poses, state.v.as_slice());
        (kinetic, kinetic + potential_energy(&tree, &poses, &GRAVITY))
    };
    let (_, start) = energy(&state);
    for _ in 0..2000 {
        rk4(&tree, &mut state, 2.5e-4);
    }
    let (kinetic, end) = energy(&state);
    assert!(kinetic > 1.0, "it must move for the test to mean anything: {kinetic} J");
    assert!((end - start).abs() < 1e-7 * kinetic, "{start} → {end} J, {kinetic} J of it kinetic");
}

#[test]
fn welding_a_body_leaves_the_energy_of_the_pair() {
    let mut tree = any_tree(4);
    let poses = forward(&tree, &numbers(41, tree.dofs()));
    let v = numbers(42, tree.dofs());
    let frame =
        Pose::from_parts(Vec3::new(0.1, 0.2, -0.1).into(), Quat::from_scaled_axis(Vec3::new(0.3, 1.0, -0.4)));
    let (com, inertia) = (Vec3::new(0.05, 0.0, 0.02), Mat3::from_diagonal(&Vec3::new(0.01, 0.02, 0.015)));
    let alone = |tree: &JointTree, poses: &[Pose]| {
        let mut only = tree.clone();
        only.links.iter_mut().enumerate().filter(|(i, _)| *i != 4).for_each(|(_, link)| {
            link.mass = 0.0;
            link.inertia = Mat3::zeros();
        });
        kinetic_energy(&only, poses, &v)
    };
    let mut placed = poses.clone();
    placed[4] = poses[4] * frame;
    // The welded body's own energy: same link velocity, taken at its own frame.
    let link = velocities(&tree, &poses, &v)[4];
    let com_w = placed[4].transform_point(&com.into()).coords;
    let spin = placed[4].rotation.inverse_transform_vector(&link.angular);
    let own = 0.5 * (0.9 * link.at(&poses[4], &com_w).norm_squared() + spin.dot(&(inertia * spin)));
    let before = alone(&tree, &poses);
    tree.links[4].weld(0.9, &com, &inertia, &frame);
    let after = alone(&tree, &poses);
    assert!((after - before - own).abs() < 1e-12 * after, "{before} + {own} = {after}");
}

#[test]
fn impossible_mechanisms_are_named() {
    let tree = any_tree(1);
    let spoilt = |change: fn(&mut Link)| {
        let mut tree = tree.clone();
        change(&mut tree.links[2]);
        tree.validate().expect_err("must be refused").to_string()
    };
    assert!(spoilt(|link| link.mass = -1.0).starts_with("link link2: mass is -1 kg"));
    assert!(spoilt(|link| link.parent = Some(2)).contains("parents must precede link 2"));
    assert!(spoilt(|link| link.lower = 4.0).contains("lower limit 4 lies above"));
    assert!(spoilt(|link| link.damping = f64::NAN).contains("negative"));
    let thin = |link: &mut Link| link.inertia = Mat3::from_diagonal(&Vec3::new(0.01, 0.01, 0.03));
    assert!(spoilt(thin).contains("belong to no body"));
}
