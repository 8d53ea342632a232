//! Version 1 of the protocol of the harness vla-eval: maps with type, payload, seq and timestamp.
//!
//! Both sides send `hello`. The messages that start and end an episode have no response; an observation is
//! answered by an action of the same seq. An observation has images in `images`, numbers in `states`, and
//! the prompt in `task_description`.

use std::{fmt, time::Instant};

use rmpv::Value;

use super::connection::{PolicyConnection, PolicyServer};
use crate::{
    ActionChunk, EpisodeBrief, Observation, PolicyError, QueryId, decode,
    encode::content,
    msgpack::{entry, map, names},
    profile::{GripCode, GripperValues, ObservationSource, PoseEncoding, Profile},
};

const VERSION: u64 = 1;

pub(super) fn greet(connection: &mut PolicyConnection, deadline: Instant) -> Result<(), PolicyError> {
    let version = concat!("softvt ", env!("CARGO_PKG_VERSION"));
    let hello = map([
        ("harness_version", Value::from(version)),
        ("protocol_version", Value::from(VERSION)),
        ("benchmark", Value::from("softvt")),
    ]);
    send(connection, "hello", hello, deadline)?;
    let value = connection.receive(deadline, "did not answer")?;
    let (kind, payload) = parts(connection, &value)?;
    if kind != "hello" {
        return Err(connection.server.error(format_args!("answered hello with {kind:?}")));
    }
    match entry(payload, "protocol_version").and_then(Value::as_u64) {
        Some(VERSION) | None => {
            super::expect_action_codes(&connection.server, payload)?;
            expect_action_spec(&connection.server, payload)
        }
        Some(other) => {
            let what = format!("uses version {other} of vla-eval's protocol; expected {VERSION}");
            Err(connection.server.error(what))
        }
    }
}

/// Checks what the entry `action_spec` of a server states of its actions, in the words of vla-eval's
/// specs. Unknown formats pass.
pub(super) fn expect_action_spec(server: &PolicyServer, hello: &Value) -> Result<(), PolicyError> {
    let Profile { name, actions, .. } = &server.profile;
    let Some(spec) = entry(hello, "action_spec") else { return Ok(()) };
    let format = |part: &str| entry(entry(spec, part)?, "format").and_then(Value::as_str);
    let refuse = |what: fmt::Arguments| Err(server.error(format_args!("states {what} in its action_spec")));
    let (own, is_absolute) = (actions.pose.name(), actions.pose == PoseEncoding::Absolute);
    let is_delta = matches!(actions.pose, PoseEncoding::Delta { .. } | PoseEncoding::DeltaOsc { .. });
    let position = format("position");
    let needed = match position {
        Some("absolute_xyz") if !is_absolute => Some("\"absolute\""),
        Some("delta_xyz") if !is_delta => Some("\"delta\" or \"delta_osc\""),
        _ => None,
    };
    if let (Some(position), Some(needed)) = (position, needed) {
        return refuse(format_args!(
            "positions as {position}, and the profile {name} reads actions of pose {own}: choose a profile with pose = {needed}"
        ));
    }
    let rotation = format("rotation").unwrap_or_default();
    let is_other_rotation = match rotation {
        "quaternion_xyzw" | "rot6d_interleaved" => true,
        // Of a small rotation, Euler angles are its axis-angle.
        "euler_xyz" => is_absolute,
        _ => false,
    };
    if is_other_rotation {
        return refuse(format_args!(
            "rotations as {rotation}, and softvt reads axis_angle: convert them there"
        ));
    }
    let GripperValues { open, closed, code, .. } = actions.gripper;
    let range = entry(spec, "gripper").and_then(|gripper| entry(gripper, "range")).and_then(Value::as_array);
    let range = range.and_then(|range| match &range[..] {
        [low, high] => Some([low.as_f64()?, high.as_f64()?]),
        _ => None,
    });
    let is_reversed = match format("gripper") {
        Some("binary_close_negative") => closed > open,
        Some("binary_close_positive" | "binary_close_01") => closed < open,
        _ => false,
    };
    let is_other_range = range.is_some_and(|range| {
        // Some servers send 32 bits.
        let own = [open.min(closed), open.max(closed)];
        range.iter().zip(own).any(|(stated, own)| (stated - own).abs() > 1e-6)
    });
    if code != GripCode::Force && (is_reversed || is_other_range) {
        let gripper = format("gripper").unwrap_or_default();
        let range = range.map_or(String::new(), |[low, high]| format!(" from {low} to {high}"));
        return refuse(format_args!(
            "the gripper as {gripper}{range}, and the profile {name} reads {open} as open and {closed} as closed: choose or \
             write a profile with these values"
        ));
    }
    Ok(())
}

pub(super) fn start(
    connection: &mut PolicyConnection,
    brief: &EpisodeBrief,
    deadline: Instant,
) -> Result<(), PolicyError> {
    let mut task = vec![("name", Value::from(brief.prompt.as_str()))];
    match &brief.alias {
        Some(alias) => task.push(("id", Value::from(alias.as_str()))),
        None => task.extend([
            ("suite", Value::from(brief.suite.as_str())),
            ("task_id", Value::from(brief.task as u64)),
            ("episode_idx", Value::from(brief.episode)),
        ]),
    }
    send(connection, "episode_start", map([("task", map(task))]), deadline)
}

pub(super) fn end(connection: &mut PolicyConnection, deadline: Instant) -> Result<(), PolicyError> {
    send(connection, "episode_end", Value::Map(Vec::new()), deadline)
}

pub(super) fn infer(
    connection: &mut PolicyConnection,
    observation: &Observation,
    query: &QueryId,
) -> Result<ActionChunk, PolicyError> {
    let payload = encoded(observation, &connection.server.profile, query);
    let deadline = connection.server.deadline();
    send(connection, "observation", payload, deadline)?;
    loop {
        let value = connection.receive(deadline, "did not answer")?;
        let (kind, payload) = parts(connection, &value)?;
        let answered = entry(&value, "seq").and_then(Value::as_u64);
        match kind {
            "error" => {
                let text = entry(payload, "error").and_then(Value::as_str).unwrap_or("no reason given");
                return Err(connection.server.error(format_args!("reported an error: {text}")));
            }
            "action" if answered == Some(connection.seq) => {
                return decode::chunk(payload, &connection.server.profile.actions);
            }
            // The response to an earlier message.
            "action" if answered.is_some_and(|answered| answered < connection.seq) => {}
            other => {
                return Err(connection.server.error(format_args!("answered an observation with {other:?}")));
            }
        }
    }
}

/// Encodes an observation: images under the names of their cameras, other entries under the first of their keys.
fn encoded(observation: &Observation, profile: &Profile, query: &QueryId) -> Value {
    let (mut images, mut rest) = (Vec::new(), Vec::new());
    for input in &profile.inputs {
        let entry = content(observation, input, Some(query)).map(|content| content.into_value(false));
        let Some(value) = entry else { continue };
        let key = |name: &str| name.rsplit('/').next().unwrap_or(name).to_owned();
        let own = input.keys.first().map_or(String::new(), |name| key(name));
        match &input.source {
            ObservationSource::Camera { camera, .. } if camera == "third_person" => {
                images.push(("agentview".to_owned(), value))
            }
            ObservationSource::Camera { camera, .. } => images.push((camera.clone(), value)),
            ObservationSource::TactileImage { .. } | ObservationSource::Tactile { .. } => {
                images.push((own, value))
            }
            ObservationSource::State { .. } => rest.push(("states".to_owned(), value)),
            ObservationSource::Prompt => rest.push(("task_description".to_owned(), value)),
            ObservationSource::Depth { .. }
            | ObservationSource::Segmentation { .. }
            | ObservationSource::MarkerMotion
            | ObservationSource::Force
            | ObservationSource::Query
            | ObservationSource::QuerySeed => rest.push((own, value)),
        }
    }
    rest.insert(0, ("images".to_owned(), map(images)));
    map(rest)
}

fn send(
    connection: &mut PolicyConnection,
    kind: &str,
    payload: Value,
    deadline: Instant,
) -> Result<(), PolicyError> {
    connection.seq += 1;
    let message = map([
        ("type", Value::from(kind)),
        ("payload", payload),
        ("seq", Value::from(connection.seq)),
        // The field is required but not used; the time of day would make messages differ between runs.
        ("timestamp", Value::F64(0.0)),
    ]);
    connection.send(&message, deadline)
}

fn parts<'a>(connection: &PolicyConnection, value: &'a Value) -> Result<(&'a str, &'a Value), PolicyError> {
    let kind = entry(value, "type").and_then(Value::as_str);
    kind.zip(entry(value, "payload")).ok_or_else(|| {
        let has = names(value);
        connection.server.error(format_args!(
            "sent a message that is not of vla-eval's protocol: it has {has}, not type and payload"
        ))
    })
}
