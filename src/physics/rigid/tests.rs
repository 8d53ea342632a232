use super::*;

const GRAVITY: Vec3 = Vec3::new(0.0, 0.0, -9.81);

/// A brick of 3:2:1 with its object frame off its centre of mass.
fn brick() -> RigidState {
    let (mass, size): (f64, _) = (0.6, Vec3::new(0.12, 0.08, 0.04));
    let moment = |a: f64, b: f64| mass / 12.0 * (a * a + b * b);
    let inertia = Mat3::from_diagonal(&Vec3::new(
        moment(size.y, size.z),
        moment(size.x, size.z),
        moment(size.x, size.y),
    ));
    let pose = Pose::new(Vec3::new(0.3, -0.2, 0.5), Vec3::new(0.4, -0.7, 0.2));
    RigidState::new(&pose, Vec3::new(0.01, 0.02, -0.03), mass, inertia).expect("a real brick")
}

fn drift(body: &mut RigidState, dt: f64, steps: usize) {
    for _ in 0..steps {
        let spin = torque_free_rotation(body, dt);
        let v = body.v;
        advance(body, v, spin.end_w, &spin, dt);
    }
}

#[test]
fn tumbling_about_the_middle_axis_keeps_momentum_and_energy() {
    // The unstable axis: the brick flips over and over (Dzhanibekov), the hardest torque-free motion.
    for (dt, speed) in [(1.0 / 60.0, 8.0), (1.0 / 240.0, 8.0), (1.0 / 60.0, 400.0)] {
        let mut body = brick();
        body.w = body.pose_w.rotation * Vec3::new(0.01, 1.0, 0.02) * speed;
        let (energy, momentum) = (body.kinetic_energy(), body.inertia_w() * body.w);
        for _ in 0..1200 {
            drift(&mut body, dt, 1);
            assert!(
                (body.kinetic_energy() / energy - 1.0).abs() < 1e-10,
                "energy {}",
                body.kinetic_energy() / energy
            );
            let lost = (body.inertia_w() * body.w - momentum).norm() / momentum.norm();
            assert!(lost < 1e-10, "angular momentum moved by {lost}");
        }
    }
}

#[test]
fn the_middle_axis_flips_and_the_others_do_not() {
    let flips = |axis: Vec3| {
        let mut body = brick();
        let axis_o = axis.normalize();
        body.w = body.pose_w.rotation * (axis_o + Vec3::new(0.01, 0.01, 0.01)) * 8.0;
        (0..600).any(|_| {
            drift(&mut body, 1.0 / 60.0, 1);
            (body.pose_w.rotation.inverse() * body.w).dot(&axis_o) < 0.0
        })
    };
    assert_eq!([Vec3::x(), Vec3::y(), Vec3::z()].map(flips), [false, true, false]);
}

#[test]
fn a_symmetric_top_precesses_at_the_closed_form_rate() {
    // Body-frame precession of the transverse spin: (I_z − I_x)/I_x · ω_z (Goldstein, Classical Mechanics, 5.6).
    let (transverse, axial) = (2e-4, 3e-4);
    let inertia = Mat3::from_diagonal(&Vec3::new(transverse, transverse, axial));
    let mut body = RigidState::new(&Pose::identity(), Vec3::zeros(), 0.5, inertia).expect("a real top");
    body.w = Vec3::new(1.0, 0.0, 5.0);
    let (dt, steps) = (1.0 / 240.0, 240);
    drift(&mut body, dt, steps);
    let omega = body.pose_w.rotation.inverse() * body.w;
    let turned = omega.y.atan2(omega.x);
    let expected = (axial - transverse) / transverse * 5.0;
    assert!((turned - expected).abs() < 1e-3, "{turned} instead of {expected} rad after 1 s");
    assert!((omega.z - 5.0).abs() < 1e-10);
}

#[test]
fn free_fall_matches_the_closed_form_of_the_scheme_and_turns_about_the_centre_of_mass() {
    let mut body = brick();
    body.v = Vec3::new(0.4, 0.0, 1.0);
    body.w = Vec3::new(0.0, 0.0, 3.0);
    let (start, dt, steps) = (body.pose_w.translation.vector, 1.0 / 60.0, 60);
    for _ in 0..steps {
        let spin = torque_free_rotation(&body, dt);
        let v = body.v + GRAVITY * dt;
        advance(&mut body, v, spin.end_w, &spin, dt);
    }
    // Symplectic Euler falls by g dt²·n(n+1)/2, an excess of g t dt/2 over the parabola.
    let time = dt * steps as f64;
    let expected = start + Vec3::new(0.4, 0.0, 1.0) * time + GRAVITY * (0.5 * time * (time + dt));
    assert!((body.pose_w.translation.vector - expected).norm() < 1e-12);
}

#[test]
fn a_turn_by_contact_torque_is_the_exponential_of_the_new_velocity() {
    let mut body = brick();
    let spin = torque_free_rotation(&body, 0.01);
    let before = body.pose_w.rotation;
    advance(&mut body, Vec3::zeros(), Vec3::new(0.0, 2.0, 0.0), &spin, 0.01);
    let turn = (body.pose_w.rotation * before.inverse()).scaled_axis();
    assert!((turn - Vec3::new(0.0, 0.02, 0.0)).norm() < 1e-14);
}

#[test]
fn the_object_frame_and_the_momenta_refer_to_the_right_points() {
    let mut body = brick();
    let object_w = Pose::new(Vec3::new(0.3, -0.2, 0.5), Vec3::new(0.4, -0.7, 0.2));
    assert!((body.object_w().to_homogeneous() - object_w.to_homogeneous()).norm() < 1e-14);
    body.v = Vec3::new(0.1, 0.2, 0.3);
    body.w = Vec3::new(1.0, -2.0, 0.5);
    let com = body.pose_w.translation.vector;
    assert_eq!(body.velocity_at(&com), body.v);
    assert!((body.momentum() - body.v * 0.6).norm() < 1e-15);
    let orbital = com.cross(&body.momentum());
    assert!((body.angular_momentum() - orbital - body.inertia_w() * body.w).norm() < 1e-15);
    assert!((body.potential_energy(&GRAVITY) - 0.6 * 9.81 * com.z).abs() < 1e-12);
}

#[test]
fn bodies_that_cannot_exist_are_refused_by_value() {
    let with = |mass: f64, inertia| RigidState::new(&Pose::identity(), Vec3::zeros(), mass, inertia);
    assert_eq!(with(-1.0, Mat3::identity()), Err(RigidError::Mass(-1.0)));
    assert!(matches!(with(f64::NAN, Mat3::identity()), Err(RigidError::Mass(_))));
    let lopsided = Mat3::from_diagonal(&Vec3::new(1.0, 1.0, 2.5));
    assert_eq!(with(1.0, lopsided), Err(RigidError::Inertia([1.0, 1.0, 2.5])));
    assert!(matches!(with(1.0, Mat3::from_element(f64::NAN)), Err(RigidError::Inertia(_))));
}
