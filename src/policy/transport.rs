//! TCP connections whose operations end at a deadline, or when what they belong to is cancelled.
//!
//! The timeouts of the operating system interrupt only operations that make no progress. A peer that sends a byte now
//! and then would keep a websocket in its loop of reads until a message is complete.

use std::{
    io::{self, ErrorKind, Read, Write},
    net::{Shutdown, TcpStream},
    time::{Duration, Instant},
};

use softvt_common::cancel::CancelFlag;
use tungstenite::{Error, protocol::WebSocketConfig};

/// Longest time between two checks of the deadline and the cancellation.
pub const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Time for writing after the cancellation: a message may be the reason of the end.
const CANCELLED_TIMEOUT: Duration = Duration::from_secs(1);

/// A TCP stream whose operations fail with [`ErrorKind::TimedOut`] after a deadline or a cancellation, even while bytes
/// arrive.
#[derive(Debug)]
pub struct TimedStream<'a> {
    stream: TcpStream,
    cancel: &'a CancelFlag,
    /// `None` for no limit.
    deadline: Option<Instant>,
    /// End of writing once cancelled.
    last_write: Option<Instant>,
    /// False to fail with [`ErrorKind::WouldBlock`] instead of waiting.
    waits: bool,
}

impl<'a> TimedStream<'a> {
    /// A stream without a deadline, which sends small packets at once.
    pub fn new(stream: TcpStream, cancel: &'a CancelFlag) -> io::Result<Self> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(POLL_INTERVAL))?;
        stream.set_write_timeout(Some(POLL_INTERVAL))?;
        Ok(Self { stream, cancel, deadline: None, last_write: None, waits: true })
    }

    /// Sets the end of the operations that follow; `None` for no limit.
    pub fn wait_until(&mut self, deadline: impl Into<Option<Instant>>) {
        self.deadline = deadline.into();
        if !self.waits {
            self.waits = self.stream.set_nonblocking(false).is_ok();
        }
    }

    /// Makes operations fail with [`ErrorKind::WouldBlock`] where they would wait.
    pub fn wait_never(&mut self) -> io::Result<()> {
        self.waits = false;
        self.stream.set_nonblocking(true)
    }

    /// Tells the other side that nothing more will be sent.
    pub fn end_output(&self) -> io::Result<()> {
        self.stream.shutdown(Shutdown::Write)
    }

    /// Repeats an operation that the system interrupts, until a deadline.
    fn repeat<T>(
        &mut self,
        is_over: impl Fn(&mut Self) -> bool,
        mut operation: impl FnMut(&mut TcpStream) -> io::Result<T>,
    ) -> io::Result<T> {
        loop {
            if self.waits && (self.deadline.is_some_and(|end| Instant::now() > end) || is_over(self)) {
                return Err(ErrorKind::TimedOut.into());
            }
            match operation(&mut self.stream) {
                Err(error) if self.waits && is_interruption(&error) => {}
                done => return done,
            }
        }
    }
}

fn is_interruption(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

impl Read for TimedStream<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.repeat(|this| this.cancel.requested(), |stream| stream.read(buffer))
    }
}

impl Write for TimedStream<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let is_over = |this: &mut Self| {
            let end = || Instant::now() + CANCELLED_TIMEOUT;
            this.cancel.requested() && Instant::now() > *this.last_write.get_or_insert_with(end)
        };
        self.repeat(is_over, |stream| stream.write(bytes))
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

/// True if an operation on a [`TimedStream`] ended at its deadline or by the cancellation.
pub fn is_timeout(error: &Error) -> bool {
    matches!(error, Error::Io(error) if error.kind() == ErrorKind::TimedOut)
}
