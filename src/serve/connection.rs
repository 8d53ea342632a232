//! The server's end of a websocket. Every wait ends when the server is cancelled.

use std::{
    io::Read,
    time::{Duration, Instant},
};

use rmpv::Value;
use tungstenite::{
    Error, Message, WebSocket,
    protocol::{CloseFrame, frame::coding::CloseCode},
};

use softvt_common::cancel::CancelFlag;
use softvt_policy::{
    http::HttpRequest,
    msgpack::{pack, unpack},
    transport::{TimedStream, is_timeout},
};

/// Longest message that is accepted; a state of 50,000 actions has 2.7 MiB.
const MAX_MESSAGE_BYTES: usize = 4 << 20;
/// Time limit for sending a response. Generous, since the client may be paused in a debugger.
const WRITE_TIMEOUT: Duration = Duration::from_secs(60);
/// Time for which incoming data is discarded after the end, so that the client receives the last response.
const CLOSE_DRAIN_TIMEOUT: Duration = Duration::from_secs(3);
/// Idle time before a ping is sent; pings to a dead host eventually fail the connection.
const PING_INTERVAL: Duration = Duration::from_secs(60);

#[derive(Debug, thiserror::Error)]
pub(super) enum ReceiveError {
    #[error("the message is {0}")]
    Malformed(String),
    #[error("the message is a text frame; expected msgpack")]
    TextFrame,
    /// The connection cannot be used any more.
    #[error("the message is longer than {} MiB", MAX_MESSAGE_BYTES >> 20)]
    TooLong,
    #[error("the connection was closed, or the server is cancelled")]
    Closed,
}

#[derive(Debug)]
pub(super) struct Connection<'a> {
    socket: WebSocket<TimedStream<'a>>,
    cancel: &'a CancelFlag,
}

impl<'a> Connection<'a> {
    /// Accepts the websocket that a request asks for. `None` if it asks for none, to which the
    /// client receives an answer, or has gone.
    pub(super) fn accept(request: HttpRequest<'a>, cancel: &'a CancelFlag) -> Option<Self> {
        Some(Self { socket: request.upgrade(MAX_MESSAGE_BYTES)?, cancel })
    }

    /// Waits for the next message. Sends pings meanwhile.
    pub(super) fn recv(&mut self) -> Result<Value, ReceiveError> {
        loop {
            self.socket.get_mut().wait_until(Instant::now() + PING_INTERVAL);
            match self.socket.read() {
                Ok(Message::Binary(bytes)) => return unpack(&bytes).map_err(ReceiveError::Malformed),
                Ok(Message::Text(_)) => return Err(ReceiveError::TextFrame),
                Ok(Message::Close(_)) => {
                    let _ = self.socket.flush();
                    return Err(ReceiveError::Closed);
                }
                Ok(_) => {}
                Err(Error::Capacity(_)) => return Err(ReceiveError::TooLong),
                Err(error) if is_timeout(&error) && !self.cancel.requested() => {
                    self.socket.get_mut().wait_until(Instant::now() + WRITE_TIMEOUT);
                    let _ = self.socket.send(Message::Ping(Vec::new().into()));
                }
                Err(_) => return Err(ReceiveError::Closed),
            }
        }
    }

    /// Sends a message, also when the server is cancelled: it may be the reason of its end.
    pub(super) fn send(&mut self, value: &Value) -> Result<(), Error> {
        self.socket.get_mut().wait_until(Instant::now() + WRITE_TIMEOUT);
        self.socket.send(Message::binary(pack(value)))
    }

    /// Closes the connection after the client has received the last message.
    pub(super) fn close(mut self) {
        let code = if self.cancel.requested() { CloseCode::Away } else { CloseCode::Normal };
        self.socket.get_mut().wait_until(Instant::now() + CLOSE_DRAIN_TIMEOUT);
        let _ = self.socket.close(Some(CloseFrame { code, reason: "".into() }));
        // The system would discard the last message if data remained unread.
        let mut discarded = vec![0; 1 << 16];
        while matches!(self.socket.get_mut().read(&mut discarded), Ok(1..)) {}
    }
}
