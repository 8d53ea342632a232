//! Websocket messages over connections with short time slices, for both sides.
//!
//! Reads and writes of the underlying stream time out after [`POLL_INTERVAL`], so that every wait can
//! check a deadline or a cancellation. The functions here repeat an interrupted operation as long as the
//! caller's `on_wait` returns `Ok`.

use std::{
    io::{self, ErrorKind},
    net::TcpStream,
    time::Duration,
};

use rmpv::Value;
use tungstenite::{
    Error, HandshakeError, Message, WebSocket, handshake::HandshakeRole, protocol::WebSocketConfig,
};

use super::msgpack::pack;

/// Longest time that a read or write blocks.
pub const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Failure of an operation: that of the websocket, or the reason of the caller to wait no longer.
#[derive(Debug)]
pub enum TransportError<E> {
    /// The connection failed.
    Socket(Error),
    /// `on_wait` returned this error.
    Aborted(E),
}

/// Sets the timeouts of a stream and sends small packets at once.
///
/// # Errors
/// The operating system refuses.
pub fn configure(stream: &TcpStream) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(POLL_INTERVAL))?;
    stream.set_write_timeout(Some(POLL_INTERVAL))
}

/// Configuration of a websocket that accepts messages of up to so many bytes.
pub fn websocket_config(max_message_bytes: usize) -> WebSocketConfig {
    WebSocketConfig::default()
        .max_message_size(Some(max_message_bytes))
        .max_frame_size(Some(max_message_bytes))
}

/// True if an operation ended because of a timeout, and can be repeated.
pub fn is_wait(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

/// Completes a handshake.
///
/// # Errors
/// The handshake fails, or `on_wait` does.
pub fn complete_handshake<R: HandshakeRole, E>(
    mut handshake: Result<R::FinalResult, HandshakeError<R>>,
    mut on_wait: impl FnMut() -> Result<(), E>,
) -> Result<R::FinalResult, TransportError<E>> {
    loop {
        match handshake {
            Ok(result) => return Ok(result),
            Err(HandshakeError::Failure(error)) => return Err(TransportError::Socket(error)),
            Err(HandshakeError::Interrupted(interrupted)) => {
                on_wait().map_err(TransportError::Aborted)?;
                handshake = interrupted.handshake();
            }
        }
    }
}

/// Sends a value as a binary message.
///
/// # Errors
/// The connection fails, or `on_wait` does.
pub fn send<E>(
    socket: &mut WebSocket<TcpStream>,
    value: &Value,
    mut on_wait: impl FnMut() -> Result<(), E>,
) -> Result<(), TransportError<E>> {
    let mut sent = socket.send(Message::binary(pack(value)));
    while let Err(Error::Io(error)) = &sent
        && is_wait(error)
    {
        on_wait().map_err(TransportError::Aborted)?;
        sent = socket.flush();
    }
    sent.map_err(TransportError::Socket)
}

/// Receives the next message of any kind, pings and pongs included. `on_wait` may send pings.
///
/// # Errors
/// The connection fails, or `on_wait` does.
pub fn receive<E>(
    socket: &mut WebSocket<TcpStream>,
    mut on_wait: impl FnMut(&mut WebSocket<TcpStream>) -> Result<(), E>,
) -> Result<Message, TransportError<E>> {
    loop {
        match socket.read() {
            Err(Error::Io(error)) if is_wait(&error) => on_wait(socket).map_err(TransportError::Aborted)?,
            read => return read.map_err(TransportError::Socket),
        }
    }
}
