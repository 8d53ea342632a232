//! openpi's protocol: the server speaks first, with its metadata; then each observation is answered by a chunk.

use super::socket::Socket;
use crate::policy::{ActionChunk, Observation, PolicyError, decode, encode, profile::Profile, wire::kind};

/// Takes the server's metadata.
pub(super) fn greet(socket: &mut Socket) -> Result<(), PolicyError> {
    let metadata = socket.receive()?;
    if metadata.as_map().is_none() {
        return Err(
            socket.wrong(&format!("sent {} first; openpi servers send a map of metadata", kind(&metadata)))
        );
    }
    Ok(())
}

/// Asks for a chunk.
pub(super) fn infer(
    socket: &mut Socket,
    observation: &Observation,
    profile: &Profile,
) -> Result<ActionChunk, PolicyError> {
    socket.send(&encode::openpi(observation, profile))?;
    let reply = socket.receive()?;
    decode::chunk(&reply, &profile.actions)
}
