//! Websocket messages over connections with short time slices, for both sides.
//!
//! An operation on a [`PollingStream`] is interrupted after [`POLL_INTERVAL`], also while bytes arrive, so that every
//! wait can check a deadline or a cancellation. The functions here repeat an interrupted operation as long as the
//! caller's `on_wait` returns `Ok`.

use std::{
    io::{self, ErrorKind, Read, Write},
    net::{Shutdown, TcpStream},
    time::{Duration, Instant},
};

use rmpv::Value;
use tungstenite::{
    Error, HandshakeError, Message, WebSocket,
    handshake::HandshakeRole,
    protocol::{CloseFrame, WebSocketConfig, frame::coding::CloseCode},
};

use super::msgpack::pack;

/// Longest time between two interruptions of a read or write.
pub const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Failure of an operation: that of the websocket, or the reason of the caller to wait no longer.
#[derive(Debug)]
pub enum TransportError<E> {
    /// Reading from or writing to the socket failed.
    Socket(Error),
    /// `on_wait` returned this error.
    Aborted(E),
}

/// A TCP stream whose operations fail with [`ErrorKind::WouldBlock`] at least once per [`POLL_INTERVAL`].
///
/// The timeouts of the operating system interrupt only operations that make no progress. A peer that sends a byte now
/// and then would keep a websocket in its loop of reads until a message is complete.
#[derive(Debug)]
pub struct PollingStream {
    stream: TcpStream,
    /// Time of the last interruption; `None` if the stream never waits.
    interrupted: Option<Instant>,
}

impl PollingStream {
    /// Sets the timeouts of a stream and sends small packets at once.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn new(stream: TcpStream) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(POLL_INTERVAL))?;
        stream.set_write_timeout(Some(POLL_INTERVAL))?;
        Ok(Self { stream, interrupted: Some(Instant::now()) })
    }

    /// Makes operations fail with [`ErrorKind::WouldBlock`] where they would wait and not otherwise, or wait again.
    ///
    /// # Errors
    /// The operating system refuses.
    pub fn set_nonblocking(&mut self, nonblocking: bool) -> io::Result<()> {
        self.interrupted = (!nonblocking).then(Instant::now);
        self.stream.set_nonblocking(nonblocking)
    }

    /// Tells the other side that nothing more will be sent.
    ///
    /// # Errors
    /// The connection is gone.
    pub fn end_output(&self) -> io::Result<()> {
        self.stream.shutdown(Shutdown::Write)
    }

    fn interrupt(&mut self) -> io::Result<()> {
        match &mut self.interrupted {
            Some(last) if last.elapsed() >= POLL_INTERVAL => {
                *last = Instant::now();
                Err(ErrorKind::WouldBlock.into())
            }
            _ => Ok(()),
        }
    }
}

impl Read for PollingStream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.interrupt()?;
        self.stream.read(buffer)
    }
}

impl Write for PollingStream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.interrupt()?;
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// Configuration of a websocket that accepts messages of up to so many bytes.
pub fn websocket_config(max_message_bytes: usize) -> WebSocketConfig {
    WebSocketConfig::default()
        .max_message_size(Some(max_message_bytes))
        .max_frame_size(Some(max_message_bytes))
}

/// True if an operation ended because of a timeout, and can be repeated.
pub fn would_block(error: &io::Error) -> bool {
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
    socket: &mut WebSocket<PollingStream>,
    value: &Value,
    on_wait: impl FnMut() -> Result<(), E>,
) -> Result<(), TransportError<E>> {
    send_frame(socket, Message::binary(pack(value)), on_wait)
}

/// Sends a message of any kind.
///
/// # Errors
/// The connection fails, or `on_wait` does.
pub fn send_frame<E>(
    socket: &mut WebSocket<PollingStream>,
    message: Message,
    mut on_wait: impl FnMut() -> Result<(), E>,
) -> Result<(), TransportError<E>> {
    let mut sent = socket.send(message);
    while let Err(Error::Io(error)) = &sent
        && would_block(error)
    {
        on_wait().map_err(TransportError::Aborted)?;
        sent = socket.flush();
    }
    sent.map_err(TransportError::Socket)
}

/// Sends a close frame. A write that was interrupted is repeated while `may_wait`.
///
/// # Errors
/// The connection fails.
pub fn close(
    socket: &mut WebSocket<PollingStream>,
    code: CloseCode,
    may_wait: impl Fn() -> bool,
) -> Result<(), Error> {
    let mut sent = socket.close(Some(CloseFrame { code, reason: "".into() }));
    while matches!(&sent, Err(Error::Io(error)) if would_block(error)) && may_wait() {
        sent = socket.flush();
    }
    sent
}

/// Receives the next message of any kind, pings and pongs included. `on_wait` may send pings.
///
/// # Errors
/// The connection fails, or `on_wait` does.
pub fn receive<E>(
    socket: &mut WebSocket<PollingStream>,
    mut on_wait: impl FnMut(&mut WebSocket<PollingStream>) -> Result<(), E>,
) -> Result<Message, TransportError<E>> {
    loop {
        match socket.read() {
            Err(Error::Io(error)) if would_block(&error) => {
                on_wait(socket).map_err(TransportError::Aborted)?
            }
            read => return read.map_err(TransportError::Socket),
        }
    }
}
