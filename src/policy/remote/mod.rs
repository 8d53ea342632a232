//! Policies that answer over a network.

mod openpi;
mod socket;
mod vla_eval;

use std::{
    sync::{Arc, Mutex, PoisonError, atomic::AtomicBool},
    time::Duration,
};

use super::{ActionChunk, Observation, Policy, PolicyError, SensorStreams, TaskBrief, profile::Profile};
use socket::Socket;

/// How a server talks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Protocol {
    /// openpi's: metadata first, then an observation for a chunk of actions.
    #[default]
    Openpi,
    /// The evaluation harness vla-eval's: messages with types and numbers.
    VlaEval,
}

/// Where a server is and how it is spoken to.
#[derive(Clone, Debug)]
pub struct PolicyServer {
    /// `ws://host:port`, with a path or not.
    pub url: String,
    /// What is said.
    pub protocol: Protocol,
    /// Which keys and units.
    pub profile: Profile,
    /// Longest wait for a connection and for each answer.
    pub timeout: Duration,
    /// Sent as `Authorization: Api-Key …`, if there is one.
    pub api_key: Option<String>,
    /// Set when the run must end.
    pub cancel: &'static AtomicBool,
}

/// The connections to one server: one for each episode that runs, kept for the next.
#[derive(Debug)]
pub struct PolicyConnections {
    server: PolicyServer,
    idle: Mutex<Vec<PolicyConnection>>,
}

/// An open connection.
#[derive(Debug)]
struct PolicyConnection {
    socket: Socket,
    /// Number of the last message (vla-eval).
    seq: u64,
}

impl PolicyConnections {
    /// None yet.
    pub fn new(server: PolicyServer) -> Self {
        Self { server, idle: Mutex::new(Vec::new()) }
    }

    /// What is spoken to.
    pub fn server(&self) -> &PolicyServer {
        &self.server
    }

    /// Opens a connection, if none is idle: the server is there and speaks the protocol.
    ///
    /// # Errors
    /// It is not or does not.
    pub fn check(&self) -> Result<(), PolicyError> {
        let connection = self.take()?;
        self.put(connection);
        Ok(())
    }

    /// A connection that still stands, an idle one if there is any: servers close those on which pings go unanswered for
    /// long, as while tasks are made ready.
    fn take(&self) -> Result<PolicyConnection, PolicyError> {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        while let Some(mut connection) = idle() {
            if connection.socket.is_open() {
                return Ok(connection);
            }
        }
        self.open()
    }

    fn open(&self) -> Result<PolicyConnection, PolicyError> {
        let mut connection = PolicyConnection { socket: Socket::connect(&self.server)?, seq: 0 };
        match self.server.protocol {
            Protocol::Openpi => openpi::greet(&mut connection.socket)?,
            Protocol::VlaEval => vla_eval::greet(&mut connection)?,
        }
        Ok(connection)
    }

    fn put(&self, connection: PolicyConnection) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(connection);
    }
}

/// A policy behind a connection.
#[derive(Debug)]
pub struct RemotePolicy {
    connections: Arc<PolicyConnections>,
    /// None before the first episode and after something went wrong.
    connection: Option<PolicyConnection>,
}

impl RemotePolicy {
    /// A policy on a connection of its own, opened when the episode begins.
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
            vla_eval::start(&mut connection, brief)?;
        }
        self.connection = Some(connection);
        Ok(())
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        let PolicyServer { profile, protocol, .. } = &self.connections.server;
        let mut kept = self.connection.take();
        // openpi's servers know of no episodes: the next question may come over another connection.
        if *protocol == Protocol::Openpi {
            kept = kept.and_then(|mut kept| kept.socket.is_open().then_some(kept));
        }
        let mut connection = kept.map_or_else(|| self.connections.take(), Ok)?;
        let answer = match protocol {
            Protocol::Openpi => openpi::infer(&mut connection.socket, observation, profile),
            Protocol::VlaEval => vla_eval::infer(&mut connection, observation, profile),
        };
        // After a failure an answer may still be under way: that connection is never used again.
        if matches!(answer, Ok(_) | Err(PolicyError::Action(_))) {
            self.connection = Some(connection);
        }
        answer
    }

    fn finish(&mut self) {
        let Some(mut connection) = self.connection.take() else { return };
        let well = match self.connections.server.protocol {
            Protocol::Openpi => true,
            Protocol::VlaEval => vla_eval::end(&mut connection).is_ok(),
        };
        if well {
            self.connections.put(connection);
        }
    }
}
