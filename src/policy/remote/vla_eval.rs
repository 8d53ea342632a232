//! Version 1 of the protocol of the harness vla-eval: maps with type, payload, seq and timestamp.
//!
//! Both sides send `hello`. The messages that start and end an episode have no response; an observation is
//! answered by an action of the same seq. An observation has images in `images`, numbers in `states`, and
//! the prompt in `task_description`.

use std::time::Instant;

use rmpv::Value;

use super::connection::PolicyConnection;
use crate::{
    ActionChunk, EpisodeBrief, Observation, PolicyError, QueryId, decode,
    encode::content,
    msgpack::{entry, map, names},
    profile::{ObservationSource, Profile},
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
    let value = connection.receive(deadline)?;
    let (kind, payload) = parts(connection, &value)?;
    if kind != "hello" {
        return Err(connection.server.error(&format!("answered hello with {kind:?}")));
    }
    match entry(payload, "protocol_version").and_then(Value::as_u64) {
        Some(VERSION) | None => super::check_action_codes(&connection.server, payload),
        Some(other) => {
            let what = format!("uses version {other} of vla-eval's protocol; expected {VERSION}");
            Err(connection.server.error(&what))
        }
    }
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
        let value = connection.receive(deadline)?;
        let (kind, payload) = parts(connection, &value)?;
        let answered = entry(&value, "seq").and_then(Value::as_u64);
        match kind {
            "error" => {
                let text = entry(payload, "error").and_then(Value::as_str).unwrap_or("no reason given");
                return Err(connection.server.error(&format!("reported an error: {text}")));
            }
            "action" if answered == Some(connection.seq) => {
                return decode::chunk(payload, &connection.server.profile.actions);
            }
            // The response to an earlier message.
            "action" if answered.is_some_and(|answered| answered < connection.seq) => {}
            other => {
                return Err(connection.server.error(&format!("answered an observation with {other:?}")));
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

/// Type and payload of a message.
fn parts<'a>(connection: &PolicyConnection, value: &'a Value) -> Result<(&'a str, &'a Value), PolicyError> {
    let kind = entry(value, "type").and_then(Value::as_str);
    kind.zip(entry(value, "payload")).ok_or_else(|| {
        let has = names(value);
        connection.server.error(&format!(
            "sent a message that is not of vla-eval's protocol: it has {has}, not type and payload"
        ))
    })
}
