//! Requests of clients and their validation.

use std::fmt::Display;

use rmpv::Value;

use super::{
    config::{RequestError, ServerConfig},
    state::{ActionRow, EpisodeState},
};
use softvt_benchmark::Suite;
use softvt_common::episode_id::{EpisodeId, EpisodeSplit};
use softvt_policy::msgpack::{NumberArray, entry, kind, names, numbers};

/// Maximum number of actions of one step, which bounds the time until its response.
const MAX_STEP_ACTIONS: usize = 1000;
/// Maximum number of actions of a state; longer than any episode.
const MAX_STATE_ACTIONS: usize = 50_000;
/// Maximum number of characters of a client's own text in an error message.
const MAX_QUOTED_CHARS: usize = 80;
/// 2^53: from here on not every whole number is a double.
const MAX_EXACT: f64 = 9_007_199_254_740_992.0;

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Request {
    Reset(EpisodeId),
    /// Execute actions, at least one.
    Step(Vec<ActionRow>),
    /// Render the image of a camera or a finger.
    Render {
        /// Name of a camera, or `left` or `right`; `None` for the scene's first camera.
        camera: Option<String>,
        /// Width, pixels; `None` for the camera's own.
        width: Option<usize>,
        /// Height, pixels; `None` for the camera's own.
        height: Option<usize>,
    },
    Cameras,
    GetState,
    SetState(Box<EpisodeState>),
    Close,
}

const TYPES: &str = "reset, step, render, cameras, get_state, set_state, close";

impl Request {
    pub(super) fn read(message: &Value, config: &ServerConfig) -> Result<Self, RequestError> {
        if !message.is_map() {
            let what = kind(message);
            bail!("the message is {what}; expected a map with a type of {TYPES}");
        }
        let Some(what) = entry(message, "type") else {
            let has = shortened(&names(message));
            bail!("the message has no type; expected one of {TYPES}; it has {has}");
        };
        let what =
            text(what).ok_or_else(|| format!("the type is {}; expected one of {TYPES}", kind(what)))?;
        let fields = |known: &[&str]| {
            let all: Vec<&str> = ["type"].iter().chain(known).copied().collect();
            RequestFields::new(&what, message, &all)
        };
        match what.as_str() {
            "reset" => Ok(Self::Reset(episode_id(&fields(&EPISODE_FIELDS)?, config)?)),
            "step" => step(&fields(&["action", "actions"])?, config),
            "render" => {
                let fields = fields(&["camera", "width", "height"])?;
                let edge = |name| Ok::<_, RequestError>(fields.integer(name, 1 << 16)?.map(|n| n as usize));
                Ok(Self::Render {
                    camera: fields.text("camera")?,
                    width: edge("width")?,
                    height: edge("height")?,
                })
            }
            "cameras" => fields(&[]).map(|_| Self::Cameras),
            "get_state" => fields(&[]).map(|_| Self::GetState),
            "set_state" => state(&fields(&["state"])?, config),
            "close" => fields(&[]).map(|_| Self::Close),
            other => Err(format!("type {:?} is unknown; expected one of {TYPES}", shortened(other)).into()),
        }
    }
}

const EPISODE_FIELDS: [&str; 5] = ["suite", "task", "episode", "seed", "split"];

fn episode_id(fields: &RequestFields, config: &ServerConfig) -> Result<EpisodeId, RequestError> {
    let suite = fields.text("suite")?;
    let suite = config.suite(suite.as_deref()).map_err(|error| fields.error(error))?;
    let task = fields.required("task", fields.integer("task", u64::from(u32::MAX))?)? as usize;
    let episode = fields.required("episode", fields.integer("episode", u64::from(u32::MAX))?)? as u32;
    let base_seed = fields.integer("seed", u64::MAX)?.unwrap_or(config.seed);
    if config.has_secret_seed && base_seed != config.seed {
        return Err(fields.error("seed: the seed of this server is secret; leave it out"));
    }
    let split = match fields.text("split")? {
        None => config.split,
        Some(name) => name
            .parse::<EpisodeSplit>()
            .map_err(|error| fields.error(format_args!("split is {:?}; {error}", shortened(&name))))?,
    };
    if !suite.tasks.iter().any(|known| known.id == task) {
        let tasks = task_list(suite);
        return Err(fields.error(format_args!("task {task}: suite {} has the {tasks}", suite.name)));
    }
    Ok(EpisodeId { suite: suite.name.clone(), task, episode, base_seed, split })
}

/// The tasks of a suite that are served, for messages.
fn task_list(suite: &Suite) -> String {
    let ids: Vec<usize> = suite.tasks.iter().map(|task| task.id).collect();
    let last = ids.len().saturating_sub(1);
    if ids.iter().copied().eq(0..ids.len()) {
        return format!("tasks 0 to {last}");
    }
    let ids: Vec<String> = ids.iter().map(ToString::to_string).collect();
    format!("served tasks {}", ids.join(", "))
}

fn step(fields: &RequestFields, config: &ServerConfig) -> Result<Request, RequestError> {
    let value = match (fields.get("action"), fields.get("actions")) {
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => return Err(fields.error("it has neither action nor actions")),
        (Some(_), Some(_)) => return Err(fields.error("it has both action and actions; expected one")),
    };
    let rows = action_rows(fields, value, config, MAX_STEP_ACTIONS)?;
    if rows.is_empty() {
        return Err(fields.error("actions is empty; expected at least one action"));
    }
    Ok(Request::Step(rows))
}

/// An array of shape (n) or (horizon, n), n being the numbers of an action.
fn action_rows(
    fields: &RequestFields,
    value: &Value,
    config: &ServerConfig,
    most: usize,
) -> Result<Vec<ActionRow>, RequestError> {
    let own = config.profile.actions.numbers();
    let expected = format!("expected shape ({own}) or (horizon, {own}), horizon up to {most}");
    let NumberArray { shape, values } =
        numbers(value).map_err(|error| fields.error(format_args!("the actions are {error}; {expected}")))?;
    match *shape.as_slice() {
        [0] => return Ok(Vec::new()),
        [0, width] if width == own => return Ok(Vec::new()),
        [width] if width == own => {}
        [horizon, width] if width == own && horizon <= most => {}
        _ => return Err(fields.error(format_args!("the actions have the shape {shape:?}; {expected}"))),
    }
    let rows: Vec<ActionRow> = values.chunks_exact(own).map(<[f64]>::to_vec).collect();
    match rows.iter().position(|row| row.iter().any(|number| !number.is_finite())) {
        None => Ok(rows),
        Some(at) => {
            Err(fields
                .error(format_args!("action {at} is {:?}: it holds a number that is not finite", rows[at])))
        }
    }
}

fn state(fields: &RequestFields, config: &ServerConfig) -> Result<Request, RequestError> {
    let value = fields.required("state", fields.get("state"))?;
    if !value.is_map() {
        let kind = kind(value);
        return Err(fields.error(format_args!("state is {kind}; expected the state of a get_state response")));
    }
    let known: Vec<&str> = EPISODE_FIELDS.into_iter().chain(["actions", "code", "made_by"]).collect();
    let inner = RequestFields::new("set_state: state", value, &known)?;
    for (name, own, what) in [
        ("code", config.action_code(), "its actions are encoded differently: another profile or gripper"),
        ("made_by", config.fingerprint.clone(), "its scripts, shifts, settings or version differ"),
    ] {
        if inner.text(name)?.is_some_and(|theirs| theirs != own) {
            return Err(inner.error(format_args!("it comes from another server: {what}")));
        }
    }
    let actions = inner.required("actions", inner.get("actions"))?;
    let actions = action_rows(&inner, actions, config, MAX_STATE_ACTIONS)?;
    Ok(Request::SetState(Box::new(EpisodeState { id: episode_id(&inner, config)?, actions })))
}

struct RequestFields<'a> {
    /// Prefix of error messages.
    context: &'a str,
    map: &'a Value,
}

impl<'a> RequestFields<'a> {
    /// Wraps the fields of a map.
    fn new(context: &'a str, map: &'a Value, known: &[&str]) -> Result<Self, RequestError> {
        let fields = Self { context, map };
        for (key, _) in map.as_map().into_iter().flatten() {
            let name = text(key).unwrap_or_else(|| "that is not text".to_owned());
            if !known.contains(&name.as_str()) {
                let name = shortened(&name);
                let known = known.join(", ");
                return Err(fields.error(format_args!("there is no field {name:?}; expected one of {known}")));
            }
        }
        Ok(fields)
    }

    fn error(&self, what: impl Display) -> RequestError {
        RequestError::Invalid(format!("{}: {what}", self.context))
    }

    /// Value of a field, `None` if it is absent or nil.
    fn get(&self, name: &str) -> Option<&'a Value> {
        entry(self.map, name).filter(|value| !value.is_nil())
    }

    fn required<T>(&self, name: &str, value: Option<T>) -> Result<T, RequestError> {
        value.ok_or_else(|| self.error(format_args!("missing field {name}")))
    }

    fn text(&self, name: &str) -> Result<Option<String>, RequestError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let found = text(value);
        found.map(Some).ok_or_else(|| self.error(format_args!("{name} is {}; expected text", kind(value))))
    }

    /// A whole number from 0 to `most`: an integer, or a number or numpy scalar without a fraction.
    fn integer(&self, name: &str, most: u64) -> Result<Option<u64>, RequestError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let found = value.as_u64().or_else(|| {
            let NumberArray { shape, values } = numbers(value).ok()?;
            let number = *values.first()?;
            let fits = shape.is_empty() && number.fract() == 0.0 && (0.0..MAX_EXACT).contains(&number);
            fits.then_some(number as u64)
        });
        let fits = found.filter(|number| *number <= most);
        let error =
            || self.error(format_args!("{name} is {}; expected a whole number in 0..{most}", quote(value)));
        fits.map(Some).ok_or_else(error)
    }
}

/// Text of msgpack's type str or bin.
fn text(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => text.as_str().map(str::to_owned),
        Value::Binary(bytes) => String::from_utf8(bytes.clone()).ok(),
        _ => None,
    }
}

/// The beginning of a client's own text, for messages.
fn shortened(text: &str) -> String {
    let cut = text.char_indices().nth(MAX_QUOTED_CHARS);
    cut.map_or_else(|| text.to_owned(), |(at, _)| format!("{}…", &text[..at]))
}

fn quote(value: &Value) -> String {
    match value {
        Value::Integer(_) | Value::F32(_) | Value::F64(_) | Value::Boolean(_) => value.to_string(),
        Value::String(_) | Value::Binary(_) => format!("{:?}", shortened(&text(value).unwrap_or_default())),
        other => kind(other).to_owned(),
    }
}
