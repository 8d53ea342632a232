//! The server's end of a websocket. Every wait ends when the server is cancelled.

use std::{
    io::Read,
    time::{Duration, Instant},
};

use rmpv::Value;
use tungstenite::{Message, WebSocket, protocol::frame::coding::CloseCode};

use softvt_common::cancel::CancelFlag;
use softvt_policy::{
    http::HttpRequest,
    msgpack::{MsgpackError, unpack},
    transport::{self, PollingStream, TransportError, would_block},
};

/// Longest message that is accepted; a state of 50,000 actions has 2.7 MiB.
const MAX_MESSAGE_BYTES: usize = 4 << 20;
/// Time limit for sending a response. Generous, since the client may be paused in a debugger.
const WRITE_TIMEOUT: Duration = Duration::from_secs(60);
/// Time for a message to a client once the server is cancelled.
const CANCELLED_TIMEOUT: Duration = Duration::from_secs(1);
/// Time for which incoming data is discarded after the end, so that the client receives the last response.
const CLOSE_DRAIN_TIMEOUT: Duration = Duration::from_secs(3);
/// Idle time before a ping is sent; pings to a dead host eventually fail the connection.
const PING_INTERVAL: Duration = Duration::from_secs(60);

/// No message was received.
#[derive(Debug, thiserror::Error)]
pub(super) enum ReceiveError {
    #[error("the message is {0}")]
    Malformed(#[from] MsgpackError),
    #[error("the message is a text frame; expected msgpack")]
    TextFrame,
    /// The connection cannot be used any more.
    #[error("the message is longer than {} MiB", MAX_MESSAGE_BYTES >> 20)]
    TooLong,
    #[error("the connection was closed, or the server is cancelled")]
    Closed,
}

/// The server is cancelled, or a time limit has passed.
#[derive(Debug)]
pub(super) struct Aborted;

/// A connection to a client.
#[derive(Debug)]
pub(super) struct Connection<'a> {
    socket: WebSocket<PollingStream>,
    cancel: &'a CancelFlag,
}

impl<'a> Connection<'a> {
    /// Accepts the websocket that a request asks for. `None` if it asks for none, as the client is told, or has gone.
    pub(super) fn accept(request: HttpRequest, cancel: &'a CancelFlag) -> Option<Self> {
        Some(Self { socket: request.upgrade(MAX_MESSAGE_BYTES)?, cancel })
    }

    /// Waits for the next message. Sends pings meanwhile.
    ///
    /// # Errors
    /// The message is invalid, or there will be no further one.
    pub(super) fn recv(&mut self) -> Result<Value, ReceiveError> {
        let mut idle_since = Instant::now();
        loop {
            let message = transport::receive(&mut self.socket, |socket| {
                if self.cancel.requested() {
                    return Err(Aborted);
                }
                if idle_since.elapsed() > PING_INTERVAL {
                    idle_since = Instant::now();
                    let _ = socket.send(Message::Ping(Vec::new().into()));
                }
                Ok(())
            });
            match message {
                Ok(Message::Binary(bytes)) => return Ok(unpack(&bytes)?),
                Ok(Message::Text(_)) => return Err(ReceiveError::TextFrame),
                Ok(Message::Close(_)) => {
                    let _ = self.socket.flush();
                    return Err(ReceiveError::Closed);
                }
                Ok(_) => idle_since = Instant::now(),
                Err(TransportError::Socket(tungstenite::Error::Capacity(_))) => {
                    return Err(ReceiveError::TooLong);
                }
                Err(_) => return Err(ReceiveError::Closed),
            }
        }
    }

    /// Sends a message, also when the server is cancelled: it may be the reason of its end.
    ///
    /// # Errors
    /// The connection failed, or the client does not accept the message in time.
    pub(super) fn send(&mut self, value: &Value) -> Result<(), TransportError<Aborted>> {
        let cancel = self.cancel;
        let mut deadline = Instant::now() + WRITE_TIMEOUT;
        let mut was_cancelled = false;
        transport::send(&mut self.socket, value, || {
            if cancel.requested() && !was_cancelled {
                was_cancelled = true;
                deadline = deadline.min(Instant::now() + CANCELLED_TIMEOUT);
            }
            if Instant::now() > deadline { Err(Aborted) } else { Ok(()) }
        })
    }

    /// Closes the connection after the client has received the last message.
    pub(super) fn close(mut self) {
        let cancelled = || self.cancel.requested();
        let code = if cancelled() { CloseCode::Away } else { CloseCode::Normal };
        let deadline = Instant::now() + CLOSE_DRAIN_TIMEOUT;
        let _ = transport::close(&mut self.socket, code, || Instant::now() < deadline);
        // The system would discard the last message if data remained unread.
        let stream = self.socket.get_mut();
        let mut discarded = vec![0; 1 << 16];
        while Instant::now() < deadline && !cancelled() {
            match stream.read(&mut discarded) {
                Ok(0) => return,
                Err(error) if !would_block(&error) => return,
                _ => {}
            }
        }
    }
}
