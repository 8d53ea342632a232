//! What a client is told.

use image::RgbImage;
use rmpv::Value;
use serde_json::{Map, json};

use super::{catalog::ServerConfig, live_episode::LiveEpisode, space};
use crate::{
    benchmark::control::CONTROL_DT,
    evaluation::record::Outcome,
    npy::NpyArray,
    policy::{
        Observation,
        encode::content,
        profile::{Profile, ProfileInput},
        wire::pack_array,
    },
};

/// Number of the protocol: another one would not be understood.
const PROTOCOL: u32 = 1;
/// Of a record: it depends on how often the client looked, not on what it did.
const UNSTEADY: &str = "camera_inside";

/// An entry of a map.
pub(super) fn pair(name: &str, value: Value) -> (Value, Value) {
    (Value::from(name), value)
}

/// An answer of a kind.
pub(super) fn plain(kind: &str, entries: Vec<(Value, Value)>) -> Value {
    Value::Map(std::iter::once(pair("type", kind.into())).chain(entries).collect())
}

/// What is said instead of an answer.
pub(super) fn error(message: &str) -> Value {
    plain("error", vec![pair("error", message.into())])
}

/// The first message: what there is, what is seen and what is done.
///
/// `first` is what the client will see at the start of the first episode.
pub fn hello(offer: &ServerConfig, first: &Observation) -> Value {
    let suites = offer.suites.iter().map(|one| {
        let tasks =
            one.suite.tasks.iter().map(
                |task| json!({ "task": task.id, "prompt": task.prompt, "budget_steps": task.budget_steps }),
            );
        json!({ "name": one.name, "episodes": one.suite.episodes, "tasks": tasks.collect::<Vec<_>>() })
    });
    let about = json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "protocol": PROTOCOL,
        "suites": suites.collect::<Vec<_>>(),
        "profile": offer.profile.name,
        "privileged": offer.privileged,
        "seed": offer.seed,
        "split": offer.split.name(),
        "control_hz": 1.0 / CONTROL_DT,
    });
    let Value::Map(mut entries) = of_json(&about) else { return plain("hello", Vec::new()) };
    entries.push(pair("observation_space", space::observation(offer, first)));
    entries.push(pair("action_space", space::action(&offer.profile.actions)));
    plain("hello", entries)
}

/// Where the episode stands: what is seen and what can be said of it. `carried_out` is how many actions a step was.
///
/// # Errors
/// Something cannot be sensed; a message for people.
pub(super) fn stands(
    kind: &str,
    running: &mut LiveEpisode,
    offer: &ServerConfig,
    carried_out: Option<usize>,
) -> Result<Value, String> {
    let seen = running.observe(offer).map_err(|e| e.to_string())?;
    let outcome = running.episode.outcome();
    let reward = if carried_out.is_some() && running.succeeded() { 1.0 } else { 0.0 };
    let truncated = outcome.is_some() && !running.succeeded();
    Ok(plain(
        kind,
        vec![
            pair("observation", observation(&seen, &offer.profile)),
            pair("reward", Value::F64(reward)),
            pair("terminated", running.succeeded().into()),
            pair("truncated", truncated.into()),
            pair("info", info(running, offer, &seen, carried_out)),
        ],
    ))
}

/// A picture as an array, uint8 (height, width, 3).
pub(super) fn picture(picture: RgbImage) -> Value {
    let shape = vec![picture.height() as usize, picture.width() as usize, 3];
    pack_array(NpyArray::from_bytes(shape, picture.into_raw()), true)
}

/// The one key of an entry that a profile sends under several.
pub(super) fn key(input: &ProfileInput) -> &str {
    input.keys.iter().min_by_key(|key| key.len()).map_or("", String::as_str)
}

fn observation(seen: &Observation, profile: &Profile) -> Value {
    let entry = |input: &ProfileInput| Some(pair(key(input), content(seen, &input.source)?.into_value(true)));
    Value::Map(profile.inputs.iter().filter_map(entry).collect())
}

/// Without the right to the true state: what any policy could know, and whether the goal was reached.
fn info(
    running: &LiveEpisode,
    offer: &ServerConfig,
    seen: &Observation,
    carried_out: Option<usize>,
) -> Value {
    let outcome = running.episode.outcome();
    let mut info = Map::new();
    let mut put = |name: &str, value| info.insert(name.to_owned(), value);
    put("task", json!(running.state.wanted.task));
    put("episode", json!(running.state.wanted.episode));
    put("step", json!(running.state.actions.len()));
    put("time_s", json!(seen.time_s));
    put("success", json!(running.succeeded()));
    if let Some(count) = carried_out {
        put("carried_out", json!(count));
    }
    if offer.privileged {
        put("state", json!(running.episode.trace()));
        put("verdict", json!(running.episode.verdict()));
    }
    if let Some(outcome) = outcome {
        put("record", record(running, offer, outcome));
    }
    of_json(&serde_json::Value::Object(info))
}

fn record(running: &LiveEpisode, offer: &ServerConfig, outcome: &Outcome) -> serde_json::Value {
    if !offer.privileged {
        let kind = json!(outcome)["kind"].clone();
        let steps = running.state.actions.len();
        return json!({ "goal": running.succeeded(), "outcome": { "kind": kind }, "steps": steps });
    }
    let mut record = json!(running.episode.record(None));
    if let Some(record) = record.as_object_mut() {
        record.remove(UNSTEADY);
    }
    record
}

/// JSON as msgpack: numbers keep their bits.
fn of_json(json: &serde_json::Value) -> Value {
    use serde_json::Value as Json;
    match json {
        Json::Null => Value::Nil,
        Json::Bool(on) => Value::Boolean(*on),
        Json::String(text) => Value::from(text.as_str()),
        Json::Array(items) => Value::Array(items.iter().map(of_json).collect()),
        Json::Object(map) => Value::Map(map.iter().map(|(k, v)| pair(k, of_json(v))).collect()),
        Json::Number(number) => match (number.as_u64(), number.as_i64()) {
            (Some(whole), _) => Value::from(whole),
            (None, Some(whole)) => Value::from(whole),
            (None, None) => Value::F64(number.as_f64().unwrap_or(f64::NAN)),
        },
    }
}
