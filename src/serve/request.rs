//! What a client may ask.

use rmpv::Value;

use super::{
    catalog::{EpisodeId, ServerConfig, split_named},
    fields::{Fields, short, text},
    state::State,
};
use crate::policy::{
    profile::ACTION_LEN,
    wire::{entry, kind, names, numbers},
};

/// Seven numbers in the code of the profile.
pub(super) type Row = [f64; ACTION_LEN];

/// The most actions of one request: a longer one would keep its client waiting for minutes without a word.
const LONGEST: usize = 1000;
/// The most actions of a state: longer than any episode.
const LONGEST_STATE: usize = 50_000;

/// A request.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Request {
    /// Begin an episode.
    Reset(EpisodeId),
    /// Carry out actions, at least one.
    Step(Vec<Row>),
    /// Draw what a camera or a finger sees.
    Render {
        /// Name of a camera, or `left` or `right`; the scene's first camera if none.
        camera: Option<String>,
        /// Width and height, pixels; its own if none.
        size: [Option<usize>; 2],
    },
    /// Say where the episode stands.
    GetState,
    /// Go back to where an episode stood.
    SetState(Box<State>),
    /// End the connection.
    Close,
}

/// Kinds of requests, for messages.
const KINDS: &str = "reset, step, render, get_state, set_state, close";

impl Request {
    /// Reads a message.
    ///
    /// # Errors
    /// It is no request; a message for people.
    pub(super) fn read(message: &Value, offer: &ServerConfig) -> Result<Self, String> {
        let Some(map) = message.as_map() else {
            return Err(format!("the message is {}; expected a map with a type of {KINDS}", kind(message)));
        };
        let Some(what) = entry(message, "type") else {
            return Err(format!(
                "the message has no type; expected one of {KINDS}; it has {}",
                short(&names(message))
            ));
        };
        let what =
            text(what).ok_or_else(|| format!("the type is {}; expected one of {KINDS}", kind(what)))?;
        let fields = |known: &[&str]| {
            let all: Vec<&str> = ["type"].iter().chain(known).copied().collect();
            Fields::new(&what, map, &all)
        };
        match what.as_str() {
            "reset" => Ok(Self::Reset(wanted(&fields(&WANTED)?, offer)?)),
            "step" => step(&fields(&["action", "actions"])?),
            "render" => {
                let fields = fields(&["camera", "width", "height"])?;
                let edge = |name| Ok::<_, String>(fields.whole(name, 1 << 16)?.map(|n| n as usize));
                Ok(Self::Render { camera: fields.text("camera")?, size: [edge("width")?, edge("height")?] })
            }
            "get_state" => fields(&[]).map(|_| Self::GetState),
            "set_state" => state(&fields(&["state"])?, offer),
            "close" => fields(&[]).map(|_| Self::Close),
            other => Err(format!("type {:?}: there is none; expected one of {KINDS}", short(other))),
        }
    }
}

/// The fields that name an episode.
const WANTED: [&str; 5] = ["suite", "task", "episode", "seed", "split"];

fn wanted(fields: &Fields, offer: &ServerConfig) -> Result<EpisodeId, String> {
    let told = |what: String| fields.wrong(&what);
    let suite = fields.text("suite")?;
    let suite = offer.suite(suite.as_deref()).map_err(told)?.name.clone();
    let task = fields.need("task", fields.whole("task", u64::from(u32::MAX))?)? as usize;
    let episode = fields.need("episode", fields.whole("episode", u64::from(u32::MAX))?)? as u32;
    let seed = fields.whole("seed", u64::MAX)?.unwrap_or(offer.seed);
    let split = match fields.text("split")? {
        None => offer.split,
        Some(name) => split_named(&name).map_err(|e| told(format!("split is {:?}; {e}", short(&name))))?,
    };
    let wanted = EpisodeId { suite, task, episode, seed, split };
    offer.task(&wanted).map_err(told)?;
    Ok(wanted)
}

fn step(fields: &Fields) -> Result<Request, String> {
    let value = match (fields.get("action"), fields.get("actions")) {
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => return Err(fields.wrong("it has neither action nor actions")),
        (Some(_), Some(_)) => return Err(fields.wrong("it has both action and actions; expected one")),
    };
    let rows = rows(value, LONGEST).map_err(|what| fields.wrong(&what))?;
    if rows.is_empty() {
        return Err(fields.wrong("actions is empty; expected at least one action"));
    }
    Ok(Request::Step(rows))
}

/// Rows of seven numbers, or one.
fn rows(value: &Value, most: usize) -> Result<Vec<Row>, String> {
    let expected = format!("expected shape ({ACTION_LEN}) or (horizon, {ACTION_LEN}), horizon up to {most}");
    let (shape, found) = numbers(value).map_err(|what| format!("the actions are {what}; {expected}"))?;
    match *shape.as_slice() {
        [ACTION_LEN] => {}
        [0] | [0, ACTION_LEN] => return Ok(Vec::new()),
        [horizon, ACTION_LEN] if horizon <= most => {}
        _ => return Err(format!("the actions have the shape {shape:?}; {expected}")),
    }
    let rows: Vec<Row> = found.as_chunks::<ACTION_LEN>().0.to_vec();
    match rows.iter().position(|row| row.iter().any(|number| !number.is_finite())) {
        None => Ok(rows),
        Some(at) => Err(format!("action {at} is {:?}: it holds a number that is not finite", rows[at])),
    }
}

fn state(fields: &Fields, offer: &ServerConfig) -> Result<Request, String> {
    let value = fields.need("state", fields.get("state"))?;
    let map = value.as_map().ok_or_else(|| {
        fields.wrong(&format!("state is {}; expected what get_state answered", kind(value)))
    })?;
    let known: Vec<&str> = WANTED.into_iter().chain(["actions", "code", "made_by"]).collect();
    let inner = Fields::new("set_state: state", map, &known)?;
    for (name, own, what) in [
        ("code", offer.code(), "an action means something else there: another profile or gripper"),
        ("made_by", offer.made_by.clone(), "its scripts, shifts, settings or version differ"),
    ] {
        if inner.text(name)?.is_some_and(|theirs| theirs != own) {
            return Err(inner.wrong(&format!("it comes from a server that is not like this one: {what}")));
        }
    }
    let actions = inner.need("actions", inner.get("actions"))?;
    let actions = rows(actions, LONGEST_STATE).map_err(|what| inner.wrong(&what))?;
    Ok(Request::SetState(Box::new(State { wanted: wanted(&inner, offer)?, actions })))
}
