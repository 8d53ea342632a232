//! The server's side of a websocket: waits that end when the run does, and clients that vanish.

use std::{
    io::{self, ErrorKind, Read},
    net::TcpStream,
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, Instant},
};

use rmpv::Value;
use tungstenite::{
    Error, HandshakeError, Message, WebSocket, accept_hdr_with_config,
    handshake::server::{ErrorResponse, Request, Response},
    protocol::{CloseFrame, WebSocketConfig, frame::coding::CloseCode},
};

use crate::policy::wire::unpack;

/// The longest message that is taken: a state of 50,000 actions is 2.7 MiB.
pub(super) const LARGEST: usize = 4 << 20;
/// Between two looks at the clock and at the wish to end.
pub(super) const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// How long a client may take to say what it wants when it comes.
pub(super) const HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(10);
/// How long it may take to take an answer: somebody may have stopped it for a while.
const WRITE_TIMEOUT: Duration = Duration::from_secs(60);
/// How long what a client still sends is listened to after the end, so that it hears what was said last.
const CLOSE_DRAIN_TIMEOUT: Duration = Duration::from_secs(3);
/// Silence after which a client is asked whether it is there: to a machine that is gone that fails in the end.
const PING_INTERVAL: Duration = Duration::from_secs(60);

/// What came from a client.
#[derive(Debug)]
pub(super) enum Incoming {
    /// A message.
    Message(Value),
    /// Something that is none; a message for people.
    Nonsense(String),
    /// Something after which nothing can be understood any more; a message for people.
    Lost(String),
    /// The end.
    Closed,
}

/// A connection to a client.
#[derive(Debug)]
pub(super) struct Connection<'a> {
    socket: WebSocket<TcpStream>,
    stop: &'a AtomicBool,
}

impl<'a> Connection<'a> {
    /// Shakes hands, unless `full` says why there is no room.
    ///
    /// # Errors
    /// The client speaks no websocket, is too slow, or there is no room for it.
    pub(super) fn accept(
        stream: TcpStream,
        stop: &'a AtomicBool,
        full: impl FnOnce() -> Option<String>,
    ) -> Result<Self, Error> {
        let config = WebSocketConfig::default().max_message_size(Some(LARGEST)).max_frame_size(Some(LARGEST));
        // The type of the refusal is tungstenite's.
        #[allow(clippy::result_large_err)]
        let callback = |_: &Request, response: Response| match full() {
            None => Ok(response),
            Some(why) => {
                let mut refusal = ErrorResponse::new(Some(why));
                *refusal.status_mut() = tungstenite::http::StatusCode::SERVICE_UNAVAILABLE;
                Err(refusal)
            }
        };
        let deadline = Instant::now() + HANDSHAKE_TIMEOUT;
        let mut shake = accept_hdr_with_config(stream, callback, Some(config));
        loop {
            match shake {
                Ok(socket) => return Ok(Self { socket, stop }),
                Err(HandshakeError::Failure(error)) => return Err(error),
                Err(HandshakeError::Interrupted(_)) if Instant::now() > deadline || is_set(stop) => {
                    return Err(Error::ConnectionClosed);
                }
                Err(HandshakeError::Interrupted(middle)) => shake = middle.handshake(),
            }
        }
    }

    /// The next message. An end of the run counts as the end of the connection.
    pub(super) fn hear(&mut self) -> Incoming {
        let mut quiet_since = Instant::now();
        loop {
            match self.socket.read() {
                Ok(Message::Binary(bytes)) => {
                    return unpack(&bytes).map_or_else(
                        |what| Incoming::Nonsense(format!("the message is {what}")),
                        Incoming::Message,
                    );
                }
                Ok(Message::Text(_)) => {
                    return Incoming::Nonsense("the message is a text frame; expected msgpack".to_owned());
                }
                Ok(Message::Close(_)) => {
                    let _ = self.socket.flush();
                    return Incoming::Closed;
                }
                Ok(_) => quiet_since = Instant::now(),
                Err(Error::Io(error)) if is_wait(&error) => {
                    if is_set(self.stop) {
                        return Incoming::Closed;
                    }
                    if quiet_since.elapsed() > PING_INTERVAL {
                        quiet_since = Instant::now();
                        let _ = self.socket.send(Message::Ping(Vec::new().into()));
                    }
                }
                Err(Error::Capacity(_)) => {
                    return Incoming::Lost(format!("the message is longer than {} MiB", LARGEST >> 20));
                }
                Err(_) => return Incoming::Closed,
            }
        }
    }

    /// Sends a message.
    ///
    /// # Errors
    /// The client is gone or does not take it.
    pub(super) fn say(&mut self, value: &Value) -> Result<(), Error> {
        let mut bytes = Vec::new();
        rmpv::encode::write_value(&mut bytes, value).map_err(io::Error::from)?;
        let deadline = Instant::now() + WRITE_TIMEOUT;
        let mut sent = self.socket.send(Message::binary(bytes));
        while let Err(Error::Io(error)) = &sent
            && is_wait(error)
            && Instant::now() < deadline
            && !is_set(self.stop)
        {
            sent = self.socket.flush();
        }
        sent
    }

    /// Ends the connection in order, as far as the client lets it.
    pub(super) fn close(mut self) {
        let code = if is_set(self.stop) { CloseCode::Away } else { CloseCode::Normal };
        let _ = self.socket.close(Some(CloseFrame { code, reason: "".into() }));
        // What has not been read yet would make the system throw away what was said last.
        let (deadline, stream) = (Instant::now() + CLOSE_DRAIN_TIMEOUT, self.socket.get_mut());
        let mut rest = vec![0; 1 << 16];
        while Instant::now() < deadline && !is_set(self.stop) {
            match stream.read(&mut rest) {
                Ok(0) => return,
                Err(error) if !is_wait(&error) => return,
                _ => {}
            }
        }
    }
}

fn is_set(stop: &AtomicBool) -> bool {
    stop.load(Ordering::Relaxed)
}

/// Whether a wait ended without anything having happened.
pub(super) fn is_wait(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
