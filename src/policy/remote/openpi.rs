//! openpi's protocol: the server sends its metadata, then answers each observation with a chunk of actions.

use super::connection::PolicyConnection;
use crate::policy::{ActionChunk, Observation, PolicyError, decode, encode, msgpack::kind};

/// Receives the server's metadata.
pub(super) fn greet(connection: &mut PolicyConnection) -> Result<(), PolicyError> {
    let metadata = connection.receive()?;
    if metadata.as_map().is_none() {
        let what = format!("sent {} first; openpi servers send a map of metadata", kind(&metadata));
        return Err(connection.server.error(&what));
    }
    Ok(())
}

/// Requests a chunk.
pub(super) fn infer(
    connection: &mut PolicyConnection,
    observation: &Observation,
) -> Result<ActionChunk, PolicyError> {
    connection.send(&encode::openpi(observation, &connection.server.profile))?;
    let reply = connection.receive()?;
    decode::chunk(&reply, &connection.server.profile.actions)
}
