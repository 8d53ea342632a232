//! Policies that run in another process and answer over a websocket.

mod connection;
mod vla_eval;

use std::{
    sync::{Arc, Mutex},
    time::Instant,
};

use rmpv::Value;

use self::connection::PolicyConnection;
pub use self::connection::{PolicyServer, ServerProtocol};
use super::{
    ActionChunk, EpisodeBrief, Observation, Policy, PolicyError, QueryId, SensorStreams, decode, encode,
    msgpack::{entry, kind},
    profile::{GripCode, PoseEncoding, Profile},
};
use softvt_benchmark::CONTROL_DT;
use softvt_common::parallel::lock;

/// Pool of connections to one policy server: one per running episode, reused by later episodes.
#[derive(Debug)]
pub struct PolicyConnections {
    server: PolicyServer,
    idle: Mutex<Vec<PolicyConnection>>,
}

impl PolicyConnections {
    /// A pool without connections, which are opened on demand.
    pub fn new(server: PolicyServer) -> Self {
        Self { server, idle: Mutex::new(Vec::new()) }
    }

    /// Checks that the server can be reached and speaks the protocol. The connection is kept for the first episode.
    ///
    /// # Errors
    /// The address is invalid, the server cannot be reached, or its greeting is wrong.
    pub fn check(&self) -> Result<(), PolicyError> {
        let connection = self.take()?;
        self.put(connection);
        Ok(())
    }

    /// Takes an idle connection, or opens one. Idle ones may have been closed meanwhile: servers do so if pings stay
    /// unanswered, for example while tasks are prepared.
    fn take(&self) -> Result<PolicyConnection, PolicyError> {
        let idle = || lock(&self.idle).pop();
        while let Some(mut connection) = idle() {
            if connection.is_open()? {
                return Ok(connection);
            }
        }
        let deadline = self.server.deadline();
        let mut connection = PolicyConnection::open(&self.server, deadline)?;
        match self.server.protocol {
            ServerProtocol::Openpi => greet_openpi(&mut connection, deadline)?,
            ServerProtocol::VlaEval => vla_eval::greet(&mut connection, deadline)?,
        }
        Ok(connection)
    }

    fn put(&self, connection: PolicyConnection) {
        lock(&self.idle).push(connection);
    }
}

#[derive(Debug)]
pub struct RemotePolicy {
    connections: Arc<PolicyConnections>,
    /// `None` before the first episode and after a failure.
    connection: Option<PolicyConnection>,
    query: QueryId,
}

impl RemotePolicy {
    /// A policy that takes its connection from a pool when an episode begins.
    pub fn new(connections: Arc<PolicyConnections>) -> Self {
        Self { connections, connection: None, query: QueryId::default() }
    }
}

impl Policy for RemotePolicy {
    fn name(&self) -> &str {
        &self.connections.server.url
    }

    fn streams(&self) -> SensorStreams {
        self.connections.server.profile.streams()
    }

    fn reset(&mut self, brief: &EpisodeBrief) -> Result<(), PolicyError> {
        let mut connection = self.connections.take()?;
        if self.connections.server.protocol == ServerProtocol::VlaEval {
            let deadline = connection.server.deadline();
            vla_eval::start(&mut connection, brief, deadline)?;
        }
        self.connection = Some(connection);
        self.query = QueryId::first(brief);
        Ok(())
    }

    fn observes_every_step(&self) -> bool {
        let asks = self.connection.as_ref().is_some_and(|connection| connection.observes_every_step);
        asks || self.connections.server.profile.observe_every_step
    }

    fn observe(&mut self, observation: &Observation) -> Result<(), PolicyError> {
        let Some(connection) = &mut self.connection else { return Ok(()) };
        self.query.step = step_of(observation);
        let query = QueryId { wants_actions: false, ..self.query.clone() };
        // Its reply says nothing.
        let sent = ask_openpi(connection, observation, &query).map(drop);
        if sent.is_err() {
            self.connection = None;
        }
        sent
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        let protocol = self.connections.server.protocol;
        let mut current = self.connection.take();
        // openpi's servers keep no state of an episode: the connection can be replaced between two requests. Those that
        // observe every step do.
        if protocol == ServerProtocol::Openpi
            && !self.observes_every_step()
            && let Some(connection) = &mut current
            && !connection.is_open()?
        {
            current = None;
        }
        let mut connection = current.map_or_else(|| self.connections.take(), Ok)?;
        self.query.step = step_of(observation);
        let chunk = match protocol {
            ServerProtocol::Openpi => ask_openpi(&mut connection, observation, &self.query)
                .and_then(|reply| decode::chunk(&reply, &connection.server.profile.actions)),
            ServerProtocol::VlaEval => vla_eval::infer(&mut connection, observation, &self.query),
        };
        self.query.query += 1;
        // After a failure a response may still be on its way: the connection is not used again.
        if matches!(chunk, Ok(_) | Err(PolicyError::Action(_))) {
            self.connection = Some(connection);
        }
        chunk
    }

    fn finish(&mut self) -> Result<(), PolicyError> {
        let Some(mut connection) = self.connection.take() else { return Ok(()) };
        let deadline = connection.server.deadline();
        match self.connections.server.protocol {
            // The reply that the last actions came from may have been that to an earlier observation.
            ServerProtocol::Openpi => connection.expect_silence(deadline)?,
            ServerProtocol::VlaEval if vla_eval::end(&mut connection, deadline).is_err() => return Ok(()),
            ServerProtocol::VlaEval => {}
        }
        self.connections.put(connection);
        Ok(())
    }
}

/// The control step of an observation, from 0.
fn step_of(observation: &Observation) -> u32 {
    (observation.time_s / CONTROL_DT).round() as u32
}

/// openpi's protocol: receives the metadata that the server sends first.
fn greet_openpi(connection: &mut PolicyConnection, deadline: Instant) -> Result<(), PolicyError> {
    let metadata = connection.receive(deadline, "did not send its first message, the metadata,")?;
    if metadata.as_map().is_none() {
        let what = format!("sent {} first; openpi servers send a map of metadata", kind(&metadata));
        return Err(connection.server.error(what));
    }
    connection.observes_every_step = match entry(&metadata, "observe_every_step") {
        None | Some(Value::Nil) => false,
        Some(Value::Boolean(every_step)) => *every_step,
        Some(other) => {
            let stated = kind(other);
            let what = format!("has {stated} as observe_every_step in its metadata; expected true or false");
            return Err(connection.server.error(what));
        }
    };
    expect_action_codes(&connection.server, &metadata)
}

/// Compares the entries `gripper`, `pose`, `units` and `rotation` of a server's metadata, which state the meaning of
/// its actions, with those of the profile.
fn expect_action_codes(server: &PolicyServer, metadata: &Value) -> Result<(), PolicyError> {
    let Profile { name, actions, .. } = &server.profile;
    let (codes, poses) = (GripCode::ALL.map(GripCode::name), PoseEncoding::NAMES);
    let stated = |key| entry(metadata, key).filter(|value| !value.is_nil());
    let bytes =
        |value: &Value| value.as_str().map(str::as_bytes).or(value.as_slice()).unwrap_or_default().to_vec();
    for (key, known, own, what) in [
        ("gripper", codes.as_slice(), actions.gripper.code.name(), "the grip code"),
        ("pose", poses.as_slice(), actions.pose.name(), "actions of pose"),
    ] {
        let Some(stated) = stated(key) else { continue };
        let code = bytes(stated);
        let problem = match known.iter().find(|known| known.as_bytes() == code) {
            Some(code) if *code == own => continue,
            Some(code) => format!(
                "states {what} {code} in its metadata, and the profile {name} reads {own}: choose one that reads {code}"
            ),
            None => {
                let (known, stated) = (known.join(", "), stated.to_string());
                format!("states {stated:.80} in the entry {key} of its metadata; expected one of {known}")
            }
        };
        return Err(server.error(problem));
    }
    // A profile with units converts what the server answers.
    for (key, others, own) in
        [("units", OTHER_UNITS, "m and rad"), ("rotation", OTHER_ROTATIONS, "axis_angle, in rad")]
    {
        let stated = stated(key).map(bytes).filter(|_| actions.units.is_none()).unwrap_or_default();
        if others.split(' ').any(|other| stated.trim_ascii().eq_ignore_ascii_case(other.as_bytes())) {
            let stated = String::from_utf8_lossy(&stated);
            return Err(server.error(format_args!(
                "states {stated:?} in the entry {key} of its metadata, and softvt reads {own}: convert them there, or \
                 choose a profile with units"
            )));
        }
    }
    Ok(())
}

/// Units of length and angle that are not softvt's, as servers may state them.
const OTHER_UNITS: &str =
    "mm millimeter millimeters cm centimeter centimeters inch inches deg degree degrees";
/// Codes of rotations that are not softvt's, as servers may state them.
const OTHER_ROTATIONS: &str =
    "deg degree degrees euler euler_xyz rpy quat quaternion quaternion_xyzw quaternion_wxyz rot6d";

/// openpi's protocol: sends an observation and receives its reply.
fn ask_openpi(
    connection: &mut PolicyConnection,
    observation: &Observation,
    query: &QueryId,
) -> Result<Value, PolicyError> {
    let deadline = connection.server.deadline();
    connection.send(&encode::openpi(observation, &connection.server.profile, query), deadline)?;
    let response = connection.receive(deadline, "did not answer")?;
    connection.expect_silence(deadline)?;
    Ok(response)
}

#[cfg(test)]
mod tests;
