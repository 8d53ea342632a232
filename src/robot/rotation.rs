//! Conventions for rotations in files and actions: quaternions with w ≥ 0, and rotation vectors (axis times angle).

use softvt_geometry::{Quat, Vec3};

/// Canonical quaternion of a rotation: w ≥ 0, and at w = 0 a positive first non-zero component, so that equal half
/// turns have equal components.
pub fn canonical(rotation: &Quat) -> Quat {
    let q = rotation.quaternion();
    let first = [q.w, q.i, q.j, q.k].into_iter().find(|part| *part != 0.0);
    if first.is_some_and(|part| part < 0.0) { Quat::new_unchecked(-q) } else { *rotation }
}

/// Rotation vector of a rotation: unit axis times angle (rad), 0 ≤ angle ≤ π. The angle is computed with atan2, which
/// is accurate near 0 and π, where acos is not.
pub fn axis_angle(rotation: &Quat) -> Vec3 {
    let q = canonical(rotation);
    let axis = q.imag();
    let sine = axis.norm();
    // Below this sine and angle are equal to the last bit, and the quotient could divide by zero.
    if sine < 1e-9 { axis * 2.0 } else { axis * (2.0 * sine.atan2(q.w) / sine) }
}

/// Rotation of a rotation vector (rad, any length), with w ≥ 0.
pub fn from_axis_angle(vector: &Vec3) -> Quat {
    canonical(&Quat::from_scaled_axis(*vector))
}

/// Rotation vector (rad) that turns `from` into `to`, in the frame that both are given in.
pub fn error(from: &Quat, to: &Quat) -> Vec3 {
    axis_angle(&(to * from.inverse()))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;

    fn any_axis() -> impl Strategy<Value = Vec3> {
        let part = -1.0..1.0_f64;
        (part.clone(), part.clone(), part)
            .prop_map(|(x, y, z)| Vec3::new(x, y, z))
            .prop_filter("an axis of non-zero length", |axis| axis.norm() > 1e-3)
            .prop_map(|axis| axis.normalize())
    }

    /// Angles in [0, π], denser towards both ends.
    fn any_angle() -> impl Strategy<Value = f64> {
        let near = (-14.0..0.0_f64).prop_map(|power| 10.0_f64.powf(power));
        prop_oneof![0.0..PI, near.clone(), near.prop_map(|gap| PI - gap), Just(0.0), Just(PI)]
    }

    proptest! {
        #[test]
        fn rotation_vectors_survive_a_round_trip(axis in any_axis(), angle in any_angle()) {
            let there = from_axis_angle(&(axis * angle));
            prop_assert!(there.w >= 0.0);
            let back = axis_angle(&there);
            prop_assert!(back.norm() <= PI + 1e-15);
            // At a half turn both signs of the axis are the same rotation.
            let same = (back - axis * angle).norm() < 1e-14 + 1e-13 * angle;
            let opposite = PI - angle < 1e-12 && (back + axis * angle).norm() < 1e-11;
            prop_assert!(same || opposite, "{axis} {angle} {back}");
        }

        #[test]
        fn both_quaternions_of_a_rotation_have_one_canonical_form(axis in any_axis(), angle in any_angle()) {
            let one = Quat::from_scaled_axis(axis * angle);
            let other = Quat::new_unchecked(-one.into_inner());
            prop_assert_eq!(canonical(&one).into_inner(), canonical(&other).into_inner());
            prop_assert_eq!(axis_angle(&one), axis_angle(&other));
        }

        #[test]
        fn the_error_rotates_one_orientation_into_the_other(a in any_axis(), b in any_axis(), angle in any_angle()) {
            let from = Quat::from_scaled_axis(b);
            let to = Quat::from_scaled_axis(a * angle) * from;
            let turned = from_axis_angle(&error(&from, &to)) * from;
            prop_assert!(turned.angle_to(&to) < 1e-7 && (turned.to_rotation_matrix().matrix()
                - to.to_rotation_matrix().matrix()).norm() < 1e-13);
        }
    }
}
