//! Replies as profiles code them.

use rmpv::Value;

use super::{
    Action, ActionChunk, PolicyError, ToolCommand,
    profile::{ACTION_LEN, ActionEncoding, ActionUnits, PoseEncoding},
    wire::{entry, kind, names, numbers},
};
use crate::geometry::Vec3;

/// The most actions of one reply; a longer one is a mistake.
pub const LONGEST: usize = 10_000;

/// The chunk of a reply with the entry `actions` (or `action`): rows of at least seven numbers, or one row.
///
/// # Errors
/// The reply is no such thing: [`PolicyError::Reply`]; it holds a number that is not finite: [`PolicyError::Action`].
pub fn chunk(reply: &Value, code: &ActionEncoding) -> Result<ActionChunk, PolicyError> {
    let wrong = |what: String| PolicyError::Reply(format!("the policy's reply {what}"));
    if reply.as_map().is_none() {
        return Err(wrong(format!("is {}; expected a map with the entry actions", kind(reply))));
    }
    let actions = entry(reply, "actions")
        .or_else(|| entry(reply, "action"))
        .ok_or_else(|| wrong(format!("has no entry actions; it has {}", names(reply))))?;
    let (shape, found) =
        numbers(actions).map_err(|what| wrong(format!("has {what} as actions; expected numbers")))?;
    rows(&shape, &found, code)
}

/// The chunk of an array of numbers.
///
/// # Errors
/// As [`chunk`].
pub fn rows(shape: &[usize], found: &[f64], code: &ActionEncoding) -> Result<ActionChunk, PolicyError> {
    let wrong = |what: &str| {
        PolicyError::Reply(format!(
            "the policy's reply has actions of shape {shape:?}: {what}; expected (horizon, {ACTION_LEN} or more)"
        ))
    };
    let (horizon, width) = match *shape {
        [width] => (1, width),
        [horizon, width] | [1, horizon, width] => (horizon, width),
        _ => return Err(wrong("not rows of actions")),
    };
    match (horizon, width) {
        (0, _) => return Err(wrong("no action at all")),
        (LONGEST.., _) => return Err(wrong("too many")),
        (_, ..ACTION_LEN) => return Err(wrong("too few numbers an action")),
        _ if code.length.is_some_and(|length| length != width) => {
            let length = code.length.unwrap_or_default();
            return Err(wrong(&format!("the profile says {length} numbers an action")));
        }
        _ => {}
    }
    let commands: Result<Vec<ToolCommand>, PolicyError> =
        found.chunks_exact(width).map(|row| command(&row[..ACTION_LEN], code)).collect();
    Ok(ActionChunk { commands: commands? })
}

/// What seven numbers command.
///
/// # Errors
/// One of them is not finite.
pub fn command(row: &[f64], code: &ActionEncoding) -> Result<ToolCommand, PolicyError> {
    let [_, _, _, _, _, _, gripper] = row else {
        return Err(PolicyError::Reply(format!(
            "an action has {} numbers; expected {ACTION_LEN}",
            row.len()
        )));
    };
    if row.iter().any(|number| !number.is_finite()) {
        return Err(PolicyError::Action(format!("the action {row:?} holds a number that is not finite")));
    }
    let ActionUnits { scale, offset } = code.units.unwrap_or(ActionUnits::SAME);
    let [x, y, z, rx, ry, rz] = std::array::from_fn(|i| scale[i] * row[i] + offset[i]);
    let (first, second) = (Vec3::new(x, y, z), Vec3::new(rx, ry, rz));
    let closure = code.gripper.closure(*gripper);
    // robosuite's controller cuts what is beyond −1..=1 off too.
    let step = |whole, translation_m: f64, rotation_rad: f64| ToolCommand::Step {
        whole,
        translation_b: first.map(|x| x.clamp(-1.0, 1.0)) * translation_m,
        rotation_b: second.map(|x| x.clamp(-1.0, 1.0)) * rotation_rad,
        closure,
    };
    Ok(match code.pose {
        PoseEncoding::Absolute => {
            ToolCommand::Pose(Action { position_b: first, axis_angle_b: second, closure })
        }
        PoseEncoding::Delta { translation_m, rotation_rad } => step(true, translation_m, rotation_rad),
        PoseEncoding::DeltaOsc { translation_m, rotation_rad } => step(false, translation_m, rotation_rad),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        npy::NpyArray,
        policy::{profile::Profile, wire::pack_array},
    };

    fn read(value: Value) -> Result<ActionChunk, PolicyError> {
        chunk(&value, &Profile::named("visuo_tactile").unwrap().actions)
    }

    fn reply(shape: Vec<usize>, fill: f32) -> Value {
        let count = shape.iter().product();
        let actions = pack_array(NpyArray::from_f32(shape, vec![fill; count]), true);
        Value::Map(vec![("actions".into(), actions)])
    }

    #[test]
    fn padded_replies_are_cut_to_seven_numbers_an_action() {
        let chunk = read(reply(vec![50, 32], 0.25)).unwrap();
        assert_eq!(chunk.commands.len(), 50);
        let quarter = Vec3::repeat(0.25);
        let expected = Action { position_b: quarter, axis_angle_b: quarter, closure: 0.25 };
        assert_eq!(chunk.commands[49], ToolCommand::Pose(expected));
        assert_eq!(read(reply(vec![7], 0.1)).unwrap().commands.len(), 1);
        assert_eq!(read(reply(vec![1, 4, 7], 0.1)).unwrap().commands.len(), 4);
    }

    #[test]
    fn what_is_no_chunk_is_told() {
        for (value, words) in [
            (reply(vec![0, 7], 0.0), "no action at all"),
            (reply(vec![10, 6], 0.0), "[10, 6]: too few numbers"),
            (reply(vec![2, 3, 7], 0.0), "not rows"),
            (Value::from("hi"), "is text"),
            (Value::Map(vec![("state".into(), 1.into())]), "no entry actions; it has state"),
            (Value::Map(vec![("actions".into(), "x".into())]), "has text as actions"),
        ] {
            match read(value) {
                Err(PolicyError::Reply(message)) => assert!(message.contains(words), "{message}"),
                other => panic!("{words}: {other:?}"),
            }
        }
        for bad in [f32::NAN, f32::INFINITY] {
            assert!(matches!(read(reply(vec![2, 7], bad)), Err(PolicyError::Action(_))));
        }
    }

    #[test]
    fn liberos_steps_are_scaled_and_cut_off() {
        let code = Profile::named("libero").unwrap().actions;
        let step = command(&[1.0, -9.0, 0.5, 0.0, 0.0, 2.0, 1.0], &code).unwrap();
        let expected = ToolCommand::Step {
            whole: false,
            translation_b: Vec3::new(0.05, -0.05, 0.025),
            rotation_b: Vec3::new(0.0, 0.0, 0.5),
            closure: 1.0,
        };
        assert_eq!(step, expected);
    }

    #[test]
    fn other_units_are_scaled_and_moved_before_they_are_read() {
        let mut code = Profile::named("visuo_tactile").unwrap().actions;
        // Millimetres from a point half a metre in front of the base, degrees.
        let (mm, degree) = (1e-3, 1.0_f64.to_radians());
        code.units = Some(ActionUnits {
            scale: [mm, mm, mm, degree, degree, degree],
            offset: [0.5, 0.0, 0.1, 0.0, 0.0, 0.0],
        });
        let ToolCommand::Pose(action) = command(&[20.0, -30.0, 0.0, 180.0, 0.0, 0.0, 1.0], &code).unwrap()
        else {
            panic!("a pose");
        };
        assert!((action.position_b - Vec3::new(0.52, -0.03, 0.1)).norm() < 1e-12);
        assert!((action.axis_angle_b - Vec3::new(std::f64::consts::PI, 0.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn a_profile_that_says_how_long_actions_are_takes_no_others() {
        let code = ActionEncoding { length: Some(32), ..Profile::named("visuo_tactile").unwrap().actions };
        assert_eq!(rows(&[2, 32], &[0.25; 64], &code).unwrap().commands.len(), 2);
        match rows(&[2, 7], &[0.25; 14], &code) {
            Err(PolicyError::Reply(message)) => assert!(message.contains("32 numbers"), "{message}"),
            other => panic!("{other:?}"),
        }
    }
}
