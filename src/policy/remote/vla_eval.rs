//! The protocol of the harness vla-eval, version 1: maps of type, payload, seq and timestamp.
//!
//! Both sides say hello; an episode starts and ends with a message that is not answered; an observation is answered by an
//! action of the same seq. An observation has pictures in `images`, numbers in `states`, the prompt in `task_description`.

use rmpv::Value;

use super::PolicyConnection;
use crate::policy::{
    ActionChunk, Observation, PolicyError, TaskBrief, decode,
    encode::content,
    profile::{InputSource, Profile},
    wire::{entry, names},
};

const VERSION: u64 = 1;

/// Says hello.
pub(super) fn greet(connection: &mut PolicyConnection) -> Result<(), PolicyError> {
    let version = concat!("softvt ", env!("CARGO_PKG_VERSION"));
    let hello = map([
        ("harness_version", Value::from(version)),
        ("protocol_version", Value::from(VERSION)),
        ("benchmark", Value::from("softvt")),
    ]);
    send(connection, "hello", hello)?;
    let (kind, payload) = receive(connection)?;
    if kind != "hello" {
        return Err(connection.socket.wrong(&format!("answered hello with {kind:?}")));
    }
    match entry(&payload, "protocol_version").and_then(Value::as_u64) {
        Some(VERSION) | None => Ok(()),
        Some(other) => Err(connection
            .socket
            .wrong(&format!("speaks version {other} of vla-eval's protocol; expected {VERSION}"))),
    }
}

/// Starts an episode.
pub(super) fn start(connection: &mut PolicyConnection, brief: &TaskBrief) -> Result<(), PolicyError> {
    let task = map([
        ("name", Value::from(brief.prompt.as_str())),
        ("suite", Value::from(brief.suite.as_str())),
        ("task_id", Value::from(brief.task as u64)),
        ("episode_idx", Value::from(brief.episode)),
    ]);
    send(connection, "episode_start", map([("task", task)]))
}

/// Ends an episode.
pub(super) fn end(connection: &mut PolicyConnection) -> Result<(), PolicyError> {
    send(connection, "episode_end", map([]))
}

/// Asks for a chunk.
pub(super) fn infer(
    connection: &mut PolicyConnection,
    observation: &Observation,
    profile: &Profile,
) -> Result<ActionChunk, PolicyError> {
    send(connection, "observation", observed(observation, profile))?;
    let seq = connection.seq;
    loop {
        let value = connection.socket.receive()?;
        let (kind, payload) = parts(connection, &value)?;
        let answers = entry(&value, "seq").and_then(Value::as_u64);
        match kind {
            "error" => {
                let text = entry(payload, "error").and_then(Value::as_str).unwrap_or("no reason given");
                return Err(connection.socket.wrong(&format!("failed; it says: {text}")));
            }
            "action" if answers == Some(seq) => return decode::chunk(payload, &profile.actions),
            // What was said to an earlier message.
            "action" if answers.is_some_and(|answered| answered < seq) => {}
            other => return Err(connection.socket.wrong(&format!("answered an observation with {other:?}"))),
        }
    }
}

/// An observation: pictures by their cameras, the rest under the first of their keys.
fn observed(observation: &Observation, profile: &Profile) -> Value {
    let (mut images, mut rest) = (Vec::new(), Vec::new());
    for input in &profile.inputs {
        let Some(value) = content(observation, &input.source).map(|content| content.into_value(false)) else {
            continue;
        };
        let key = |name: &str| name.rsplit('/').next().unwrap_or(name).to_owned();
        let own = input.keys.first().map_or(String::new(), |name| key(name));
        match &input.source {
            InputSource::Camera { camera, .. } if camera == "third_person" => {
                images.push(("agentview".to_owned(), value))
            }
            InputSource::Camera { camera, .. } => images.push((camera.clone(), value)),
            InputSource::TactileImage { .. } | InputSource::Tactile { .. } => images.push((own, value)),
            InputSource::State { .. } => rest.push(("states".to_owned(), value)),
            InputSource::Prompt => rest.push(("task_description".to_owned(), value)),
            InputSource::MarkerMotion | InputSource::Force => rest.push((own, value)),
        }
    }
    rest.insert(0, ("images".to_owned(), named(images)));
    named(rest)
}

fn named(entries: Vec<(String, Value)>) -> Value {
    Value::Map(entries.into_iter().map(|(key, value)| (Value::from(key), value)).collect())
}

fn map<const N: usize>(entries: [(&str, Value); N]) -> Value {
    Value::Map(entries.into_iter().map(|(key, value)| (Value::from(key), value)).collect())
}

fn send(connection: &mut PolicyConnection, kind: &str, payload: Value) -> Result<(), PolicyError> {
    connection.seq += 1;
    let message = map([
        ("type", Value::from(kind)),
        ("payload", payload),
        ("seq", Value::from(connection.seq)),
        // The receiver wants the field and does not use it; no clock gets into what we send.
        ("timestamp", Value::F64(0.0)),
    ]);
    connection.socket.send(&message)
}

fn receive(connection: &mut PolicyConnection) -> Result<(String, Value), PolicyError> {
    let value = connection.socket.receive()?;
    let (kind, payload) = parts(connection, &value)?;
    Ok((kind.to_owned(), payload.clone()))
}

fn parts<'a>(connection: &PolicyConnection, value: &'a Value) -> Result<(&'a str, &'a Value), PolicyError> {
    let kind = entry(value, "type").and_then(Value::as_str);
    kind.zip(entry(value, "payload")).ok_or_else(|| {
        let has = names(value);
        connection
            .socket
            .wrong(&format!("sent no message of vla-eval's protocol: it has {has}, not type and payload"))
    })
}
