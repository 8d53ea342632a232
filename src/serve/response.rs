//! Responses to clients.

use std::{collections::BTreeMap, fmt::Display};

use rmpv::Value;
use serde_json::{Map, json};

use super::{
    config::{RequestError, ServerConfig},
    spaces,
    state::LiveEpisode,
};
use softvt_benchmark::{CONTROL_DT, Task};
use softvt_common::npy::NpyArray;
use softvt_evaluation::verdict::Outcome;
use softvt_policy::{
    Observation,
    encode::content,
    msgpack::{map, pack_array},
    profile::{Profile, ProfileInput},
};
use softvt_robot::rotation;
use softvt_rollout::ObjectInstance;

const PROTOCOL: u32 = 1;
/// Field of a record that depends on how often the client requested images, not on its actions.
const OBSERVATION_DEPENDENT: &str = "camera_inside";

#[derive(Clone, Copy, Debug)]
pub(super) struct StepResult {
    pub count: usize,
    /// True if the finished episode was recorded; `None` before its end, and if the server records nothing.
    pub recorded: Option<bool>,
}

pub(super) fn typed(kind: &str, entries: impl IntoIterator<Item = (&'static str, Value)>) -> Value {
    map([("type", Value::from(kind))].into_iter().chain(entries))
}

/// The response to a request that cannot be executed.
pub(super) fn error(message: &dyn Display) -> Value {
    typed("error", [("error", message.to_string().into())])
}

/// The first message to every client: suites, tasks, and the spaces of observations and actions. `first` is the first
/// observation of the first episode; it gives the shapes.
pub fn hello(config: &ServerConfig, first: &Observation) -> Value {
    let suites = config.suites.iter().map(|suite| {
        let task = |task: &Task| {
            json!({ "task": task.id, "prompt": task.prompt, "budget_steps": task.budget_steps })
        };
        let tasks: Vec<_> = suite.tasks.iter().map(task).collect();
        json!({ "name": suite.name, "episodes": suite.episodes, "tasks": tasks })
    });
    let about = json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "protocol": PROTOCOL,
        "suites": suites.collect::<Vec<_>>(),
        "profile": config.profile.name,
        "pose": config.profile.actions.pose.name(),
        "gripper": config.profile.actions.gripper.code.name(),
        "privileged": config.privileged,
        "seed": config.seed,
        "split": config.split.name(),
        "records": config.recorder.is_some(),
        "control_hz": 1.0 / CONTROL_DT,
    });
    let Value::Map(mut entries) = from_json(&about) else { return typed("hello", []) };
    entries.push(("observation_space".into(), spaces::observation(config, first)));
    entries.push(("action_space".into(), spaces::action(&config.profile.actions, config.effort_n)));
    let kind = (Value::from("type"), Value::from("hello"));
    Value::Map(std::iter::once(kind).chain(entries).collect())
}

/// The current observation, reward and info of an episode. `executed` is what a step did.
pub(super) fn transition(
    kind: &str,
    live: &mut LiveEpisode,
    config: &ServerConfig,
    executed: Option<StepResult>,
) -> Result<Value, RequestError> {
    let observation = live.observe(config)?;
    let succeeded = live.has_succeeded();
    let reward = if executed.is_some() && succeeded { 1.0 } else { 0.0 };
    let truncated = live.episode.outcome().is_some() && !succeeded;
    Ok(typed(
        kind,
        [
            ("observation", encoded(&observation, &config.profile)),
            ("reward", Value::F64(reward)),
            ("terminated", succeeded.into()),
            ("truncated", truncated.into()),
            ("info", info(live, config, &observation, executed)),
        ],
    ))
}

fn encoded(observation: &Observation, profile: &Profile) -> Value {
    let entry = |input: &ProfileInput| {
        Some((input.shortest_key().into(), content(observation, input, None)?.into_value(true)))
    };
    Value::Map(profile.inputs.iter().filter_map(entry).collect())
}

/// The cameras of the scene by name: size in pixels, intrinsic matrix, and pose in the base frame as a matrix (4, 4),
/// its axes as in OpenGL.
pub(super) fn cameras(live: &LiveEpisode) -> Value {
    let cameras = &live.episode.sim.scene.cameras;
    let entries = cameras.iter().zip(live.episode.cameras_b()).map(|(camera, camera_b)| {
        let matrix = |edge, rows: Vec<f64>| pack_array(NpyArray::from_f64(vec![edge, edge], rows), true);
        let entry = map([
            ("width", camera.width.into()),
            ("height", camera.height.into()),
            ("intrinsic", matrix(3, camera.intrinsic().as_flattened().to_vec())),
            // nalgebra iterates over columns.
            ("pose_b", matrix(4, camera_b.to_homogeneous().transpose().iter().copied().collect())),
        ]);
        (camera.name.as_str(), entry)
    });
    typed("cameras", [("cameras", map(entries))])
}

/// Scene data of clients with access to the true state: the goal, the pose of the robot's base in the world, and
/// the names of all objects by their number in segmentations, from 1.
fn scene(live: &LiveEpisode, config: &ServerConfig) -> serde_json::Value {
    let id = &live.state.id;
    let mut tasks =
        config.suites.iter().filter(|suite| suite.name == id.suite).flat_map(|suite| &suite.tasks);
    let sim = &live.episode.sim;
    let position: [f64; 3] = sim.robot.base_w.translation.vector.into();
    let q = rotation::canonical(&sim.robot.base_w.rotation);
    let fixed = sim.objects.iter().filter(|object| !object.body.is_free() && object.part.is_none());
    let at = |object: &ObjectInstance| -> [f64; 3] { sim.pose(object).translation.vector.into() };
    let fixed: BTreeMap<&str, [f64; 3]> = fixed.map(|object| (object.name.as_str(), at(object))).collect();
    let task = tasks.find(|task| task.id == id.task);
    json!({
        "goal": task.map(|task| &task.goal),
        "object": task.map(|task| &task.object),
        "base_position_w": position,
        "base_quaternion_w": [q.w, q.i, q.j, q.k],
        "fixed_positions_w": fixed,
        "objects": sim.objects.iter().map(|object| &object.name).collect::<Vec<_>>(),
    })
}

/// Unless clients are privileged: what any policy can know, and whether the goal was reached.
fn info(
    live: &LiveEpisode,
    config: &ServerConfig,
    observation: &Observation,
    executed: Option<StepResult>,
) -> Value {
    let mut info = Map::new();
    let mut put = |name: &str, value| info.insert(name.to_owned(), value);
    put("task", json!(live.state.id.task));
    put("episode", json!(live.state.id.episode));
    put("prompt", json!(observation.prompt));
    put("step", json!(live.state.actions.len()));
    put("time_s", json!(observation.time_s));
    put("success", json!(live.has_succeeded()));
    put("far_commands", json!(live.episode.stats().far_commands));
    put("clamped_grips", json!(live.episode.stats().clamped_grips));
    put("clamped_steps", json!(live.episode.stats().clamped_steps));
    if let Some(StepResult { count, recorded }) = executed {
        put("carried_out", json!(count));
        if let Some(recorded) = recorded {
            put("recorded", json!(recorded));
        }
    }
    if config.privileged {
        if executed.is_none() {
            put("scene", scene(live, config));
        }
        put("state", json!(live.episode.trace()));
        put("verdict", json!(live.episode.verdict()));
    }
    if let Some(outcome) = live.episode.outcome() {
        put("record", record(live, config, outcome));
    }
    from_json(&serde_json::Value::Object(info))
}

fn record(live: &LiveEpisode, config: &ServerConfig, outcome: &Outcome) -> serde_json::Value {
    if !config.privileged {
        let kind = json!(outcome)["kind"].clone();
        let steps = live.state.actions.len();
        return json!({ "goal": live.has_succeeded(), "outcome": { "kind": kind }, "steps": steps });
    }
    let mut record = json!(live.episode.record(None));
    if let Some(record) = record.as_object_mut() {
        record.remove(OBSERVATION_DEPENDENT);
    }
    record
}

/// Converts JSON to msgpack. Numbers keep their bits.
fn from_json(json: &serde_json::Value) -> Value {
    use serde_json::Value as Json;
    match json {
        Json::Null => Value::Nil,
        Json::Bool(on) => Value::Boolean(*on),
        Json::String(text) => Value::from(text.as_str()),
        Json::Array(items) => Value::Array(items.iter().map(from_json).collect()),
        Json::Object(object) => map(object.iter().map(|(key, value)| (key.as_str(), from_json(value)))),
        Json::Number(number) => match (number.as_u64(), number.as_i64()) {
            (Some(whole), _) => Value::from(whole),
            (None, Some(whole)) => Value::from(whole),
            (None, None) => Value::F64(number.as_f64().unwrap_or(f64::NAN)),
        },
    }
}
