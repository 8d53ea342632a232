//! Poses, and orientations and directions from numbers of any size.

use nalgebra::Quaternion;

use super::scene::YAW;
use crate::schema::{Range, Type, check::MIN_LENGTH, class, functions};
use softvt_geometry::{Pose, Quat, Vec3};
use softvt_robot::rotation;

/// Angles up to a full turn, rad. Larger ones are given in degrees by mistake.
pub(crate) const ANGLES: Range = Range::closed(-FULL_TURN, FULL_TURN);
#[expect(clippy::approx_constant, reason = "messages show it")]
const FULL_TURN: f64 = 6.2832;

/// Share of the way between two poses. Sums of steps may be rounded to a little more than 1.
const SHARE: Range = Range::closed(0.0, 1.0);
const MAX_SHARE_ERROR: f64 = 1e-6;

/// Divides the numbers by the largest magnitude, so that no square over- or underflows. `None` if that is too
/// small or not finite.
fn normalized_to_max<const N: usize>(numbers: [f64; N]) -> Option<[f64; N]> {
    let largest =
        numbers.iter().fold(0.0, |max: f64, x| if x.is_nan() { f64::NAN } else { max.max(x.abs()) });
    (largest.is_finite() && largest >= MIN_LENGTH).then(|| numbers.map(|x| x / largest))
}

/// The unit vector along a vector of any length.
pub(crate) fn unit_direction(numbers: [f64; 3]) -> Option<Vec3> {
    normalized_to_max(numbers).map(|numbers| Vec3::from(numbers).normalize())
}

/// A direction of any length. The length is kept where it can be computed with, so that scripts can write the
/// components one by one; else it is 1.
pub(crate) fn direction(numbers: [f64; 3]) -> Option<Vec3> {
    let unit = unit_direction(numbers)?;
    let largest = numbers.iter().fold(0.0, |max: f64, x| max.max(x.abs()));
    Some(if (1e-6..1e6).contains(&largest) { Vec3::from(numbers) } else { unit })
}

/// The rotation of a quaternion w, x, y, z of any length but 0.
pub(crate) fn rotation_from_wxyz(numbers: [f64; 4]) -> Option<Quat> {
    normalized_to_max(numbers).map(|[w, x, y, z]| Quat::new_normalize(Quaternion::new(w, x, y, z)))
}

/// A quaternion as w, x, y, z with w ≥ 0.
pub(crate) fn wxyz(rotation: &Quat) -> [f64; 4] {
    let q = rotation::canonical(rotation);
    [q.w, q.i, q.j, q.k]
}

/// The rotation of the hand pointing straight down, turned by `yaw` (rad) about the vertical: its x axis is along
/// (cos yaw, sin yaw).
fn downward(yaw: f64) -> Quat {
    Quat::from_axis_angle(&Vec3::z_axis(), yaw) * Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI)
}

const POSITION: Type = Type::vector(3, "m, world");

functions! {
    FUNCTIONS {
        /// Returns a pose in the world frame: `softvt.pose { position = { 0.4, 0, 0.2 }, yaw = math.pi / 2 }`. Without
        /// a quaternion the hand points straight down.
        fn pose(lua) takes spec "softvt.PoseSpec" {
            /// Position of the pose.
            position: [f64; 3] = POSITION;
            /// Rotation of the downward hand about the vertical, by default 0.
            yaw: Option<f64> = YAW;
            /// Orientation instead of yaw.
            quaternion: Option<[f64; 4]> = Type::Quaternion("");
        } -> ["softvt.Pose"] {
            if yaw.is_some() && quaternion.is_some() {
                bail!(lua, "softvt.pose: quaternion gives the whole orientation, also the yaw; give one of them");
            }
            let yaw = yaw.unwrap_or_default();
            let rotation = quaternion.and_then(rotation_from_wxyz).unwrap_or_else(|| downward(yaw));
            LuaPose(Pose::from_parts(Vec3::from(position).into(), rotation))
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct LuaPose(pub Pose);

class! {
    /// An immutable pose in the world frame.
    LuaPose: "softvt.Pose" {
        label(_) { "pose".to_owned() }
        text(this) {
            let at = this.0.translation.vector;
            format!("pose({:.4}, {:.4}, {:.4})", at.x, at.y, at.z)
        }
        fields {
            /// Position along x, m.
            x: "number" { get(_, this) { this.0.translation.x } }
            /// Position along y, m.
            y: "number" { get(_, this) { this.0.translation.y } }
            /// Position along z, m.
            z: "number" { get(_, this) { this.0.translation.z } }
            /// Position x, y, z, m.
            position: "number[]" or "a pose never changes: make another with softvt.pose{…}, or with translated" {
                get(_, this) { this.0.translation.vector }
            }
            /// Orientation as quaternion w, x, y, z with w ≥ 0.
            quaternion: "number[]" or "a pose never changes: make another with softvt.pose{…}, or with rotated" {
                get(_, this) { wxyz(&this.0.rotation) }
            }
        }
        methods {
            /// Returns the pose moved by an offset in the world frame, m.
            fn translated(_, this, offset: [f64; 3] = Type::vector(3, "m")) -> ["softvt.Pose"] {
                let mut pose = this.0;
                pose.translation.vector += Vec3::from(offset);
                LuaPose(pose)
            }
            /// Returns the same orientation at another position, m.
            fn at(_, this, position: [f64; 3] = POSITION) -> ["softvt.Pose"] {
                LuaPose(Pose::from_parts(Vec3::from(position).into(), this.0.rotation))
            }
            /// Returns the same position, rotated by an angle about the world's vertical, rad.
            fn rotated(_, this, angle: f64 = YAW) -> ["softvt.Pose"] {
                let rotation = Quat::from_axis_angle(&Vec3::z_axis(), angle);
                LuaPose(Pose::from_parts(this.0.translation, rotation * this.0.rotation))
            }
            /// Returns a pose between this one (at a share of 0) and another (at 1).
            fn interpolate(lua, this, other: LuaPose, share: f64) -> ["softvt.Pose"] {
                if !(-MAX_SHARE_ERROR..=1.0 + MAX_SHARE_ERROR).contains(&share) {
                    let (expected, got) = (SHARE.describe(), SHARE.show_outside(share));
                    bail!(lua, "pose:interpolate: expected a share{expected}, got {got}");
                }
                let at = this.0.translation.vector.lerp(&other.0.translation.vector, share);
                // Between opposite orientations the shortest rotation is not unique, and slerp undefined.
                let rotation = this.0.rotation.try_slerp(&other.0.rotation, share, 1e-12);
                LuaPose(Pose::from_parts(at.into(), rotation.unwrap_or(other.0.rotation)))
            }
            /// Returns the position in the world of a point of this pose's frame, m.
            fn transform(lua, this, point: [f64; 3] = Type::vector(3, "m, frame of the pose")) -> ["number[]"] {
                let at = this.0 * nalgebra::Point3::from(point);
                lua.create_sequence_from(at.coords.iter().copied())?
            }
            /// Returns the distance to another pose, m, and the angle between the orientations, rad.
            fn distance(_, this, other: LuaPose) -> ["number", "number"] {
                let metres = (this.0.translation.vector - other.0.translation.vector).norm();
                (metres, this.0.rotation.angle_to(&other.0.rotation))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_of_any_representable_length_are_normalized() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        for size in [1e-8, 1.0, 1e200, f64::MAX] {
            let rotation = rotation_from_wxyz([size, 0.0, 0.0, -size]).expect("a rotation");
            assert!(
                (rotation.w - half).abs() < 1e-15 && (rotation.k + half).abs() < 1e-15,
                "{size}: {rotation:?}"
            );
            let direction = unit_direction([size, -size, 0.0]).expect("a direction");
            assert!((direction - Vec3::new(half, -half, 0.0)).norm() < 1e-15, "{size}: {direction:?}");
        }
        for nothing in [0.0, 1e-300, f64::NAN, f64::INFINITY] {
            assert!(rotation_from_wxyz([nothing, 0.0, 0.0, 0.0]).is_none());
            assert!(unit_direction([0.0, nothing, 0.0]).is_none());
        }
        assert!(rotation_from_wxyz([1.0, f64::NAN, 0.0, 0.0]).is_none(), "a NaN next to a number");
    }
}
