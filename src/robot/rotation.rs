//! Conventions for rotations in files and actions: quaternions with w ≥ 0, and rotation vectors (axis times angle).

use std::f64::consts::{PI, TAU};

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

/// Rotation vector (rad) of a hand that points straight down. The first vector of an episode is the nearest one to it,
/// so that episodes do not differ by the sign of a half turn.
pub const POINTING_DOWN: Vec3 = Vec3::new(PI, 0.0, 0.0);

/// Of all vectors of the rotation of `vector` (rad), which are 2π apart along its axis, the nearest one to `reference`.
/// `vector` itself is returned bit for bit if it is that one.
///
/// Applied along an episode, each time with the vector before, it gives vectors that are continuous where
/// [`axis_angle`] changes sign at half a turn.
pub fn nearest(vector: Vec3, reference: &Vec3) -> Vec3 {
    let angle = vector.norm();
    // Without an angle there is no axis.
    if angle < 1e-9 {
        return vector;
    }
    let axis = vector / angle;
    let turns = ((axis.dot(reference) - angle) / TAU).round();
    if turns == 0.0 { vector } else { vector + axis * (turns * TAU) }
}

/// The [`nearest`] vectors along an episode, from [`POINTING_DOWN`] on.
pub fn continuous(vectors: impl IntoIterator<Item = Vec3>) -> impl Iterator<Item = Vec3> {
    vectors.into_iter().scan(POINTING_DOWN, |before, vector| {
        *before = nearest(vector, before);
        Some(*before)
    })
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
        fn rotation_vectors_are_continuous_where_the_angle_passes_half_a_turn(
            axis in any_axis(), start in -0.2..0.2_f64, step in -0.3..0.3_f64,
        ) {
            let turns: Vec<Quat> = (0..60)
                .map(|k| {
                    let tilt = start + 0.01 * (f64::from(k) * step).sin();
                    let down = Quat::from_scaled_axis(Vec3::z() * (0.05 * f64::from(k))) * from_axis_angle(&POINTING_DOWN);
                    Quat::from_scaled_axis(axis * tilt) * down
                })
                .collect();
            let vectors: Vec<Vec3> = continuous(turns.iter().map(axis_angle)).collect();
            prop_assert!((vectors[0] - POINTING_DOWN).norm() < 0.6, "{}", vectors[0]);
            for (vector, turn) in vectors.iter().zip(&turns) {
                prop_assert!(from_axis_angle(vector).angle_to(turn) < 1e-7);
            }
            for pair in vectors.windows(2) {
                prop_assert!((pair[1] - pair[0]).norm() < 0.3, "{} {}", pair[0], pair[1]);
            }
        }

        #[test]
        fn a_vector_that_is_the_nearest_one_keeps_its_bits(axis in any_axis(), angle in any_angle()) {
            let vector = axis * angle;
            prop_assert_eq!(nearest(vector, &vector), vector);
            let other = vector - axis * TAU;
            prop_assume!(angle > 1e-6);
            prop_assert!((nearest(vector, &other) - other).norm() < 1e-12);
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
