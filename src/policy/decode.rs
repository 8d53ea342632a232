//! Decoding of action chunks as profiles define them.

use std::fmt;

use rmpv::Value;

use super::{
    ActionChunk, EncodedAction, PolicyError, ToolCommand, ToolMotion,
    msgpack::{NumberArray, entry, kind, names, numbers},
    profile::{ActionEncoding, PoseEncoding},
};
use softvt_geometry::Vec3;

/// Number of actions from which on a chunk is rejected as a mistake.
pub const MAX_CHUNK_LEN: usize = 10_000;

/// Length to which openpi's models pad actions (`action_dim` in its `pi0_config.py`).
pub const PADDED_ACTION_LEN: usize = 32;

/// Largest number of characters of a server's error in a message.
const MAX_ERROR_CHARS: usize = 500;

/// True for what a server sends that has no error: nil, false, a zero, or an empty text, list or map.
fn is_nothing(error: &Value) -> bool {
    error.is_nil()
        || error.as_bool() == Some(false)
        || error.as_f64() == Some(0.0)
        || error.as_str() == Some("")
        || error.as_array().is_some_and(Vec::is_empty)
        || error.as_map().is_some_and(Vec::is_empty)
}

/// Decodes a response: a map whose entry `actions` (or `action`) has the shape (horizon, n), (1, horizon, n) or
/// (n). Without a length in the profile, n is 7, or 8 for joint positions, or 32 with padding.
///
/// ```
/// use rmpv::Value;
/// use softvt_policy::{EncodedGrip, GripTarget, ToolMotion, decode, msgpack::map, profile::Profile};
///
/// let libero = Profile::named("libero").expect("a built-in profile");
/// // A step of +5 cm along x at most; the gripper's value 1 means closed.
/// let row = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].map(Value::from).to_vec();
/// let chunk = decode::chunk(&map([("actions", Value::Array(row))]), &libero.actions)?;
/// let ToolMotion::Delta { translation_b, .. } = chunk.commands[0].motion else { unreachable!() };
/// assert_eq!(translation_b.x, 0.05);
/// assert_eq!(chunk.commands[0].grip, EncodedGrip::Target(GripTarget::Closure(1.0)));
/// # Ok::<(), softvt_policy::PolicyError>(())
/// ```
///
/// # Errors
/// [`PolicyError::Response`] if the response has another form, [`PolicyError::Action`] if a number is not finite.
pub fn chunk(response: &Value, encoding: &ActionEncoding) -> Result<ActionChunk, PolicyError> {
    let refused = |what: fmt::Arguments| PolicyError::Response(what.to_string());
    if response.as_map().is_none() {
        let kind = kind(response);
        return Err(refused(format_args!("is {kind}; expected a map with the entry actions")));
    }
    if let Some(error) = entry(response, "error").filter(|error| !is_nothing(error)) {
        let text = error.as_str().map_or_else(|| error.to_string(), str::to_owned);
        return Err(refused(format_args!("reports an error: {text:.MAX_ERROR_CHARS$}")));
    }
    let actions = entry(response, "actions").or_else(|| entry(response, "action"));
    let actions =
        actions.ok_or_else(|| refused(format_args!("has no entry actions; it has {}", names(response))))?;
    let NumberArray { shape, values } = numbers(actions)
        .map_err(|error| refused(format_args!("has {error} as actions; expected numbers")))?;
    let own = encoding.numbers();
    let wrong = |problem: fmt::Arguments| {
        Err(refused(format_args!(
            "has actions of shape {shape:?}: {problem}; expected ({own}), (horizon, {own}) or (1, horizon, {own})"
        )))
    };
    let (horizon, width) = match shape[..] {
        [width] => (1, width),
        [horizon, width] | [1, horizon, width] => (horizon, width),
        _ => return wrong(format_args!("not rows of actions")),
    };
    match (horizon, width, encoding.length) {
        (0, ..) => return wrong(format_args!("no action at all")),
        (MAX_CHUNK_LEN.., ..) => return wrong(format_args!("too many")),
        (_, width, _) if width < own => return wrong(format_args!("too few numbers per action")),
        (_, width, Some(length)) if length != width => {
            return wrong(format_args!("the profile requires {length} numbers per action"));
        }
        // Eight numbers may be a position, a quaternion and a gripper, or joint positions and a gripper: those that are
        // padding have to be known.
        (_, width, None) if ![own, PADDED_ACTION_LEN].contains(&width) => {
            return wrong(format_args!(
                "{width} numbers per action are neither {own} nor the {PADDED_ACTION_LEN} of openpi's padding; if the \
                 others are padding, a profile states length = {width}"
            ));
        }
        _ => {}
    }
    ActionChunk::decode(values.chunks_exact(width).map(|row| &row[..own]), encoding)
}

impl ActionChunk {
    /// Decodes actions without padding, and keeps their numbers.
    ///
    /// # Errors
    /// As [`EncodedAction::new`].
    pub fn decode(
        rows: impl IntoIterator<Item = impl AsRef<[f64]>>,
        encoding: &ActionEncoding,
    ) -> Result<Self, PolicyError> {
        let encode = |row| EncodedAction::new(AsRef::as_ref(&row), encoding);
        let encoded: Vec<EncodedAction> = rows.into_iter().map(encode).collect::<Result<_, _>>()?;
        Ok(Self { commands: encoded.iter().map(|action| action.command(encoding)).collect(), encoded })
    }
}

/// Excess of a number of a displacement over its range −1..=1 up to which it is clamped without being counted.
const STEP_OVERSHOOT: f64 = 0.2;

impl EncodedAction {
    /// # Errors
    /// [`PolicyError::Action`] if a number is not finite, [`PolicyError::Response`] if there are more or fewer than
    /// [`ActionEncoding::numbers`].
    pub fn new(row: &[f64], encoding: &ActionEncoding) -> Result<Self, PolicyError> {
        if row.iter().any(|number| !number.is_finite()) {
            return Err(PolicyError::Action(format!("the action {row:?} holds a number that is not finite")));
        }
        let (own, count) = (encoding.numbers(), row.len());
        match row.split_last().filter(|_| count == own) {
            Some((grip, motion)) => Ok(Self { motion: motion.to_vec(), grip: *grip }),
            None => Err(PolicyError::Response(format!("has an action of {count} numbers; expected {own}"))),
        }
    }

    /// The command; robosuite's controller clips displacements to −1..=1 as well.
    pub fn command(&self, encoding: &ActionEncoding) -> ToolCommand {
        ToolCommand { motion: self.motion_within(encoding, 1.0), grip: encoding.gripper.command(self.grip) }
    }

    /// The motion with displacements beyond −1..=1 in full: a scale that is wrong shows in them.
    pub fn unclamped_motion(&self, encoding: &ActionEncoding) -> ToolMotion {
        self.motion_within(encoding, f64::INFINITY)
    }

    fn motion_within(&self, encoding: &ActionEncoding, limit: f64) -> ToolMotion {
        let si = |i: usize| match &encoding.units {
            Some(units) => units.to_si(i, self.motion[i]),
            None => self.motion[i],
        };
        let (linear, angular) = (|| Vec3::from_fn(|i, _| si(i)), || Vec3::from_fn(|i, _| si(3 + i)));
        let delta = |full, translation_m: f64, rotation_rad: f64| ToolMotion::Delta {
            full,
            translation_b: linear().map(|x| x.clamp(-limit, limit)) * translation_m,
            rotation_b: angular().map(|x| x.clamp(-limit, limit)) * rotation_rad,
            is_clamped: (0..6).any(|i| si(i).abs() > 1.0 + STEP_OVERSHOOT),
        };
        match encoding.pose {
            PoseEncoding::Joints => ToolMotion::Joints(std::array::from_fn(si)),
            PoseEncoding::Absolute => ToolMotion::Pose { position_b: linear(), axis_angle_b: angular() },
            PoseEncoding::Delta { translation_m, rotation_rad } => delta(true, translation_m, rotation_rad),
            PoseEncoding::DeltaOsc { translation_m, rotation_rad } => {
                delta(false, translation_m, rotation_rad)
            }
        }
    }
}

/// Decodes the numbers of an action without padding.
///
/// # Errors
/// As [`EncodedAction::new`].
pub fn command(row: &[f64], encoding: &ActionEncoding) -> Result<ToolCommand, PolicyError> {
    Ok(EncodedAction::new(row, encoding)?.command(encoding))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Action, EncodedGrip, GripTarget,
        msgpack::pack_array,
        profile::{ActionUnits, Profile},
    };
    use softvt_common::npy::NpyArray;

    fn read(value: Value) -> Result<ActionChunk, PolicyError> {
        chunk(&value, &Profile::named("visuo_tactile").unwrap().actions)
    }

    fn reply(shape: Vec<usize>, fill: f32) -> Value {
        let count = shape.iter().product();
        let actions = pack_array(NpyArray::from_f32(shape, vec![fill; count]), true);
        Value::Map(vec![("actions".into(), actions)])
    }

    #[test]
    fn padded_actions_are_cut_to_seven_numbers() {
        let chunk = read(reply(vec![50, 32], 0.25)).unwrap();
        assert_eq!(chunk.commands.len(), 50);
        let quarter = Vec3::repeat(0.25);
        assert_eq!(chunk.commands[49], Action::new(quarter, quarter, 0.25).into());
        assert_eq!(read(reply(vec![7], 0.1)).unwrap().commands.len(), 1);
        assert_eq!(read(reply(vec![1, 4, 7], 0.1)).unwrap().commands.len(), 4);
    }

    #[test]
    fn replies_of_another_form_are_refused() {
        let with = |key: &str, value: Value| {
            let Value::Map(mut entries) = reply(vec![7], 0.1) else { panic!("a map") };
            entries.push((key.into(), value));
            Value::Map(entries)
        };
        assert!(read(with("error", Value::Nil)).is_ok() && read(with("state", 1.into())).is_ok());
        for (value, words) in [
            (reply(vec![0, 7], 0.0), "no action at all"),
            (reply(vec![10, 6], 0.0), "[10, 6]: too few numbers"),
            (reply(vec![2, 3, 7], 0.0), "not rows"),
            (reply(vec![10, 8], 0.0), "8 numbers per action are neither 7 nor the 32"),
            (reply(vec![8], 0.0), "a profile states length = 8"),
            (Value::from("hi"), "is text"),
            (Value::Map(vec![("state".into(), 1.into())]), "no entry actions; it has state"),
            (Value::Map(vec![("actions".into(), "x".into())]), "has text as actions"),
            (with("error", "model failed".into()), "reports an error: model failed"),
        ] {
            match read(value) {
                Err(PolicyError::Response(message)) => assert!(message.contains(words), "{message}"),
                other => panic!("{words}: {other:?}"),
            }
        }
        for bad in [f32::NAN, f32::INFINITY] {
            assert!(matches!(read(reply(vec![2, 7], bad)), Err(PolicyError::Action(_))));
        }
    }

    #[test]
    fn liberos_displacements_are_scaled_and_clipped() {
        let code = Profile::named("libero").unwrap().actions;
        let delta = command(&[1.0, -9.0, 0.5, 0.0, 0.0, 2.0, 1.0], &code).unwrap();
        let motion = ToolMotion::Delta {
            full: false,
            translation_b: Vec3::new(0.05, -0.05, 0.025),
            rotation_b: Vec3::new(0.0, 0.0, 0.5),
            is_clamped: true,
        };
        assert_eq!(delta, ToolCommand { motion, grip: EncodedGrip::Target(GripTarget::Closure(1.0)) });
        let full = EncodedAction::new(&[1.0, -9.0, 0.5, 0.0, 0.0, 2.0, 1.0], &code).unwrap();
        let full = full.unclamped_motion(&code);
        let ToolMotion::Delta { translation_b, rotation_b, .. } = full else { panic!("{full:?}") };
        assert_eq!((translation_b.y, rotation_b.z), (-9.0 * 0.05, 2.0 * 0.5));
    }

    #[test]
    fn units_are_converted_before_decoding() {
        let mut code = Profile::named("visuo_tactile").unwrap().actions;
        // Millimetres from a point half a metre in front of the base, and degrees.
        let (mm, degree) = (1e-3, 1.0_f64.to_radians());
        code.units = Some(ActionUnits {
            scale: vec![mm, mm, mm, degree, degree, degree],
            offset: vec![0.5, 0.0, 0.1, 0.0, 0.0, 0.0],
        });
        let decoded = command(&[20.0, -30.0, 0.0, 180.0, 0.0, 0.0, 1.0], &code).unwrap();
        let ToolMotion::Pose { position_b, axis_angle_b } = decoded.motion else { panic!("a pose") };
        assert!((position_b - Vec3::new(0.52, -0.03, 0.1)).norm() < 1e-12);
        assert!((axis_angle_b - Vec3::new(std::f64::consts::PI, 0.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn joint_positions_have_eight_numbers_and_may_be_in_degrees() {
        let mut code = Profile::named("vision_joints").unwrap().actions;
        let padded = chunk(&reply(vec![2, 32], 0.25), &code).unwrap();
        let one = chunk(&reply(vec![8], 0.25), &code).unwrap();
        let grip = EncodedGrip::Target(GripTarget::Closure(0.25));
        for command in [padded.commands[1], one.commands[0]] {
            assert_eq!(command, ToolCommand { motion: ToolMotion::Joints([0.25; 7]), grip });
        }
        match chunk(&reply(vec![10, 7], 0.25), &code) {
            Err(PolicyError::Response(message)) => {
                assert!(
                    message.contains("too few numbers per action; expected (8), (horizon, 8)"),
                    "{message}"
                );
            }
            other => panic!("{other:?}"),
        }
        assert!(matches!(chunk(&reply(vec![8], f32::NAN), &code), Err(PolicyError::Action(_))));
        code.units = Some(ActionUnits { scale: vec![1.0_f64.to_radians(); 7], offset: vec![0.0; 7] });
        let decoded = command(&[180.0, 0.0, 0.0, 0.0, 0.0, 0.0, -90.0, 0.0], &code).unwrap();
        let ToolMotion::Joints(joints) = decoded.motion else { panic!("{decoded:?}") };
        assert!((joints[0] - std::f64::consts::PI).abs() < 1e-12);
        assert!((joints[6] + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }

    #[test]
    fn a_profile_with_a_length_refuses_actions_of_another_length() {
        let code = ActionEncoding { length: Some(32), ..Profile::named("visuo_tactile").unwrap().actions };
        assert_eq!(chunk(&reply(vec![2, 32], 0.25), &code).unwrap().commands.len(), 2);
        let eight = ActionEncoding { length: Some(8), ..code.clone() };
        assert_eq!(chunk(&reply(vec![2, 8], 0.25), &eight).unwrap().commands.len(), 2);
        match chunk(&reply(vec![2, 7], 0.25), &code) {
            Err(PolicyError::Response(message)) => assert!(message.contains("32 numbers"), "{message}"),
            other => panic!("{other:?}"),
        }
    }
}
