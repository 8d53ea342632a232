//! Policies that run in another process and answer over a websocket.

mod connection;
mod vla_eval;

use std::{
    sync::{Arc, Mutex},
    time::Instant,
};

use rmpv::Value;

use self::connection::PolicyConnection;
pub use self::connection::{PolicyServer, Protocol};
use super::{
    ActionChunk, Observation, Policy, PolicyError, SensorStreams, TaskBrief, decode, encode,
    msgpack::{entry, kind},
    profile::{GripCode, Profile},
};
use softvt_common::parallel::lock;

/// Pool of connections to one policy server: one per running episode, reused by later episodes.
#[derive(Debug)]
pub struct PolicyConnections {
    server: PolicyServer,
    idle: Mutex<Vec<PolicyConnection>>,
}

impl PolicyConnections {
    /// An empty pool.
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
            Protocol::Openpi => greet_openpi(&mut connection, deadline)?,
            Protocol::VlaEval => vla_eval::greet(&mut connection, deadline)?,
        }
        Ok(connection)
    }

    fn put(&self, connection: PolicyConnection) {
        lock(&self.idle).push(connection);
    }
}

/// A policy on a server.
#[derive(Debug)]
pub struct RemotePolicy {
    connections: Arc<PolicyConnections>,
    /// `None` before the first episode and after a failure.
    connection: Option<PolicyConnection>,
}

impl RemotePolicy {
    /// A policy that takes its connection from a pool when an episode begins.
    pub fn new(connections: Arc<PolicyConnections>) -> Self {
        Self { connections, connection: None }
    }
}

impl Policy for RemotePolicy {
    fn name(&self) -> &str {
        &self.connections.server.url
    }

    fn streams(&self) -> SensorStreams {
        self.connections.server.profile.streams()
    }

    fn reset(&mut self, brief: &TaskBrief) -> Result<(), PolicyError> {
        let mut connection = self.connections.take()?;
        if self.connections.server.protocol == Protocol::VlaEval {
            let deadline = connection.server.deadline();
            vla_eval::start(&mut connection, brief, deadline)?;
        }
        self.connection = Some(connection);
        Ok(())
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        let protocol = self.connections.server.protocol;
        let mut current = self.connection.take();
        // openpi's servers keep no state of an episode: the connection can be replaced between two requests.
        if protocol == Protocol::Openpi
            && let Some(connection) = &mut current
            && !connection.is_open()?
        {
            current = None;
        }
        let mut connection = current.map_or_else(|| self.connections.take(), Ok)?;
        let chunk = match protocol {
            Protocol::Openpi => infer_openpi(&mut connection, observation),
            Protocol::VlaEval => vla_eval::infer(&mut connection, observation),
        };
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
            Protocol::Openpi => connection.check_silence(deadline)?,
            Protocol::VlaEval if vla_eval::end(&mut connection, deadline).is_err() => return Ok(()),
            Protocol::VlaEval => {}
        }
        self.connections.put(connection);
        Ok(())
    }
}

/// openpi's protocol: receives the metadata that the server sends first.
fn greet_openpi(connection: &mut PolicyConnection, deadline: Instant) -> Result<(), PolicyError> {
    let metadata = connection.receive(deadline)?;
    if metadata.as_map().is_none() {
        let what = format!("sent {} first; openpi servers send a map of metadata", kind(&metadata));
        return Err(connection.server.error(&what));
    }
    check_grip_code(&connection.server, &metadata)
}

/// Checks the grip code that a server states in the entry `gripper` of its metadata, if it does.
///
/// # Errors
/// It is not that of the profile.
fn check_grip_code(server: &PolicyServer, metadata: &Value) -> Result<(), PolicyError> {
    let Some(stated) = entry(metadata, "gripper").filter(|value| !value.is_nil()) else { return Ok(()) };
    let bytes = stated.as_str().map(str::as_bytes).or(stated.as_slice()).unwrap_or_default();
    let stated = String::from_utf8_lossy(bytes);
    let Profile { name, actions, .. } = &server.profile;
    let own = actions.gripper.code;
    match GripCode::named(&stated) {
        Some(code) if code == own => Ok(()),
        Some(code) => Err(server.error(&format!(
            "states the grip code {} in its metadata, and the profile {name} reads {}: pass --gripper {}",
            code.name(),
            own.name(),
            code.name()
        ))),
        None => {
            let known = GripCode::ALL.map(GripCode::name).join(", ");
            Err(server.error(&format!(
                "states the grip code {:?} in the entry gripper of its metadata; expected one of {known}",
                stated.chars().take(80).collect::<String>()
            )))
        }
    }
}

/// openpi's protocol: sends an observation and receives a chunk of actions.
fn infer_openpi(
    connection: &mut PolicyConnection,
    observation: &Observation,
) -> Result<ActionChunk, PolicyError> {
    let deadline = connection.server.deadline();
    connection.send(&encode::openpi(observation, &connection.server.profile), deadline)?;
    let response = connection.receive(deadline)?;
    connection.check_silence(deadline)?;
    decode::chunk(&response, &connection.server.profile.actions)
}

#[cfg(test)]
mod tests;
