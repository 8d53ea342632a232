//! A connection to a policy server. Every wait ends at a deadline or when the run is cancelled, whatever arrives.

use std::{
    fmt::Display,
    io::{self, ErrorKind},
    net::{TcpStream, ToSocketAddrs},
    sync::mpsc::{self, RecvTimeoutError},
    thread,
    time::{Duration, Instant},
};

use rmpv::Value;
use tungstenite::{
    ClientRequestBuilder, Error, HandshakeError, Message, WebSocket, client,
    error::ProtocolError,
    http::Uri,
    protocol::{CloseFrame, frame::coding::CloseCode},
};

use softvt_common::cancel::CancelFlag;

use crate::{
    PolicyError,
    msgpack::{pack, unpack},
    profile::Profile,
    transport::{POLL_INTERVAL, TimedStream, is_timeout, websocket_config},
};

/// Longest message that is accepted; an action chunk is about 10 kB.
const MAX_MESSAGE_BYTES: usize = 8 << 20;
/// Pause before the second attempt to connect; it doubles with every further attempt.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
/// Longest pause between two attempts to connect.
const MAX_PAUSE: Duration = Duration::from_secs(2);
/// Maximum number of pings and pongs that an idle connection may have received.
const MAX_IDLE_MESSAGES: usize = 1000;
/// Longest wait for the server's answer to a close frame.
const CLOSE_TIMEOUT: Duration = Duration::from_millis(500);
/// Length to which a server's error text is cut, characters.
const MAX_ERROR_CHARS: usize = 2000;
/// Port of an address without one, as of openpi's servers.
const DEFAULT_PORT: u16 = 8000;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum ServerProtocol {
    /// openpi: the server sends metadata first, then a chunk of actions per observation.
    #[default]
    #[value(help = None::<&str>)]
    Openpi,
    /// The evaluation harness vla-eval: typed and numbered messages.
    #[value(help = None::<&str>)]
    VlaEval,
}

#[derive(Clone, Debug)]
pub struct PolicyServer {
    /// `ws://host:port`, optionally with a path.
    pub url: String,
    pub protocol: ServerProtocol,
    /// Keys and units of observations and actions.
    pub profile: Profile,
    /// Time limit for connecting, greeting included, and for each response.
    pub timeout: Duration,
    /// Sent as `Authorization: Api-Key …`, if present.
    pub api_key: Option<String>,
    pub cancel: &'static CancelFlag,
}

impl PolicyServer {
    /// A failure of this server; `what` continues "the policy server URL …".
    pub(super) fn error(&self, what: impl Display) -> PolicyError {
        PolicyError::Server { url: self.url.clone(), problem: what.to_string() }
    }

    /// End of an operation that begins now.
    pub(super) fn deadline(&self) -> Instant {
        Instant::now() + self.timeout
    }

    fn unrequested(&self) -> PolicyError {
        self.error(
            "sent a message that was not requested. Replies have no numbers, so a surplus reply would be taken as that \
             to a later observation; the server must send its metadata once and one reply per observation",
        )
    }

    fn proceed(&self) -> Result<(), PolicyError> {
        if self.cancel.requested() { Err(PolicyError::Interrupted) } else { Ok(()) }
    }

    /// The failure of an operation on the socket; `what` says what the server did not do in time.
    fn failure(&self, error: &Error, what: &str) -> PolicyError {
        match error {
            _ if is_timeout(error) && self.cancel.requested() => PolicyError::Interrupted,
            _ if is_timeout(error) => {
                let seconds = self.timeout.as_secs_f64();
                let longer = "raise the timeout of the policy if it needs longer";
                self.error(format_args!("{what} within {seconds} s; {longer}"))
            }
            Error::ConnectionClosed
            | Error::AlreadyClosed
            | Error::Protocol(ProtocolError::SendAfterClosing) => self.error("closed the connection"),
            Error::Capacity(_) => {
                let most = MAX_MESSAGE_BYTES >> 20;
                self.error(format_args!(
                    "sent more than {most} MiB in one message: no chunk of actions is as long"
                ))
            }
            Error::Io(error) => self.error(format_args!("cannot be reached any more: {error}")),
            Error::Protocol(_) => self.error(format_args!("broke the websocket protocol: {error}")),
            other => self.error(format_args!("is not a websocket server: {other}")),
        }
    }
}

/// An open connection, before or after the greeting of the protocol. Dropping it closes it with a close frame.
#[derive(Debug)]
pub(super) struct PolicyConnection {
    pub(super) server: PolicyServer,
    socket: WebSocket<TimedStream<'static>>,
    /// Number of the last message sent (vla-eval).
    pub(super) seq: u64,
    /// True if the server asked for an observation in every control step.
    pub(super) observes_every_step: bool,
    pings: u64,
}

impl PolicyConnection {
    /// Connects. Retries while the server cannot be reached, until `deadline`.
    pub(super) fn open(server: &PolicyServer, deadline: Instant) -> Result<Self, PolicyError> {
        let request = request(server)?;
        let mut pause = FIRST_PAUSE;
        loop {
            let reason = match connect(&request, server, deadline) {
                Ok(socket) => {
                    let server = server.clone();
                    return Ok(Self { server, socket, seq: 0, observes_every_step: false, pings: 0 });
                }
                Err(ConnectError::Final(error)) => return Err(error),
                Err(ConnectError::Retry(reason)) => reason,
            };
            if Instant::now() + pause > deadline {
                let (url, seconds) = (server.url.clone(), server.timeout.as_secs_f64().to_string());
                return Err(PolicyError::Unreachable { url, reason, seconds });
            }
            sleep(pause, server)?;
            pause = (2 * pause).min(MAX_PAUSE);
        }
    }

    /// Sends a message until `deadline`.
    pub(super) fn send(&mut self, value: &Value, deadline: Instant) -> Result<(), PolicyError> {
        self.socket.get_mut().wait_until(deadline);
        let sent = self.socket.send(Message::binary(pack(value)));
        sent.map_err(|error| self.server.failure(&error, "did not accept an observation"))
    }

    /// Receives the next message until `deadline`. `what` says what the server did not do, such as "did not answer".
    ///
    /// # Errors
    /// The connection fails, or the server sends text (its error message), an invalid message, or nothing in time.
    pub(super) fn receive(&mut self, deadline: Instant, what: &str) -> Result<Value, PolicyError> {
        self.socket.get_mut().wait_until(deadline);
        loop {
            match self.socket.read() {
                Ok(Message::Binary(bytes)) => {
                    return unpack(&bytes).map_err(|error| self.server.error(format_args!("sent {error}")));
                }
                Ok(Message::Text(text)) => return Err(self.reported_error(&text)),
                Ok(Message::Close(_)) => return Err(self.server.failure(&Error::ConnectionClosed, what)),
                Ok(Message::Ping(_) | Message::Pong(_) | Message::Frame(_)) => {}
                Err(error) => return Err(self.server.failure(&error, what)),
            }
        }
    }

    /// Checks that the server sent nothing after its last reply: sends a ping and waits for its pong.
    /// Frames keep their order, so a message sent before the pong arrives before it. A connection that the
    /// server closed meanwhile passes.
    pub(super) fn expect_silence(&mut self, deadline: Instant) -> Result<(), PolicyError> {
        self.pings += 1;
        let own = self.pings.to_be_bytes();
        self.socket.get_mut().wait_until(deadline);
        match self.socket.send(Message::Ping(own.to_vec().into())) {
            Err(error) if is_timeout(&error) => {
                return Err(self.server.failure(&error, "did not accept a ping"));
            }
            Err(_) => return Ok(()),
            Ok(()) => {}
        }
        loop {
            match self.socket.read() {
                Ok(Message::Pong(payload)) if *payload == own => return Ok(()),
                Ok(Message::Binary(_)) => return Err(self.server.unrequested()),
                Ok(Message::Text(text)) => return Err(self.reported_error(&text)),
                Err(error) if is_timeout(&error) => {
                    return Err(self.server.failure(&error, "did not answer a ping"));
                }
                Ok(Message::Close(_)) | Err(_) => return Ok(()),
                Ok(Message::Ping(_) | Message::Pong(_) | Message::Frame(_)) => {}
            }
        }
    }

    /// Reads what was received while the connection was idle, and answers pings. Returns true if it can still be used.
    pub(super) fn is_open(&mut self) -> Result<bool, PolicyError> {
        if self.socket.get_mut().wait_never().is_err() {
            return Ok(false);
        }
        for _ in 0..MAX_IDLE_MESSAGES {
            match self.socket.read() {
                Ok(Message::Ping(_) | Message::Pong(_)) => {}
                Ok(Message::Binary(_)) => return Err(self.server.unrequested()),
                Ok(Message::Text(text)) => return Err(self.reported_error(&text)),
                // The server may have closed the websocket, but not yet its TCP connection.
                Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => {
                    return Ok(self.socket.can_write());
                }
                // The end: a new connection is needed.
                _ => return Ok(false),
            }
        }
        Ok(false)
    }

    fn reported_error(&self, text: &str) -> PolicyError {
        self.server.error(format_args!("reported an error:\n{}", end_of(text)))
    }
}

impl Drop for PolicyConnection {
    /// Sends a close frame and waits for the server's, so that its log shows a regular end.
    fn drop(&mut self) {
        self.socket.get_mut().wait_until(Instant::now() + CLOSE_TIMEOUT);
        let frame = CloseFrame { code: CloseCode::Normal, reason: "".into() };
        let is_sent = self.socket.close(Some(frame)).is_ok();
        // The socket reports the end of the closing handshake as an error.
        while is_sent && self.socket.read().is_ok() {}
    }
}

enum ConnectError {
    Retry(String),
    Final(PolicyError),
}

impl From<io::Error> for ConnectError {
    fn from(error: io::Error) -> Self {
        Self::Retry(error.to_string())
    }
}

fn connect(
    request: &ClientRequestBuilder,
    server: &PolicyServer,
    deadline: Instant,
) -> Result<WebSocket<TimedStream<'static>>, ConnectError> {
    let mut stream = TimedStream::new(connect_tcp(server, deadline)?, server.cancel)?;
    stream.wait_until(deadline);
    let config = websocket_config(MAX_MESSAGE_BYTES);
    let error = match client::client_with_config(request.clone(), stream, Some(config)) {
        Ok((socket, _)) => return Ok(socket),
        Err(HandshakeError::Failure(error)) => error,
        Err(HandshakeError::Interrupted(_)) => Error::Io(ErrorKind::WouldBlock.into()),
    };
    Err(match error {
        _ if is_timeout(&error) => match server.proceed() {
            Err(interrupted) => ConnectError::Final(interrupted),
            Ok(()) => ConnectError::Retry("it accepts connections but says nothing".to_owned()),
        },
        // A server that is being started may close connections at first.
        Error::Io(error) => error.into(),
        Error::Http(response) if response.status().as_u16() == 503 => {
            ConnectError::Retry("HTTP status 503".to_owned())
        }
        error => {
            let (url, reason) = (server.url.clone(), error.to_string());
            ConnectError::Final(PolicyError::NotWebsocket { url, reason })
        }
    })
}

/// Connects in a thread, since neither a name's resolution nor a connection attempt can be interrupted. The
/// thread ends by itself.
fn connect_tcp(server: &PolicyServer, deadline: Instant) -> Result<TcpStream, ConnectError> {
    let (sender, receiver) = mpsc::channel();
    let url = server.url.clone();
    thread::Builder::new().name("connect".to_owned()).spawn(move || {
        let _ = sender.send(connect_to_any(&url, deadline));
    })?;
    loop {
        match receiver.recv_timeout(POLL_INTERVAL) {
            Ok(connected) => return Ok(connected?),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(ConnectError::Retry("the connection attempt ended early".to_owned()));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        server.proceed().map_err(ConnectError::Final)?;
        if Instant::now() > deadline {
            return Err(ConnectError::Retry("it does not accept connections".to_owned()));
        }
    }
}

/// Connects to the first address of the host that accepts a connection.
fn connect_to_any(url: &str, deadline: Instant) -> io::Result<TcpStream> {
    let uri: Uri = url.parse().map_err(io::Error::other)?;
    let host = uri.host().unwrap_or_default().trim_start_matches('[').trim_end_matches(']');
    let mut refused = io::Error::new(ErrorKind::NotFound, "the host name does not resolve");
    for address in (host, uri.port_u16().unwrap_or(DEFAULT_PORT)).to_socket_addrs()? {
        let left = deadline.saturating_duration_since(Instant::now()).max(POLL_INTERVAL);
        match TcpStream::connect_timeout(&address, left) {
            Ok(stream) => return Ok(stream),
            Err(error) => refused = error,
        }
    }
    Err(refused)
}

fn request(server: &PolicyServer) -> Result<ClientRequestBuilder, PolicyError> {
    let wrong = |problem: &str| PolicyError::Address { url: server.url.clone(), problem: problem.to_owned() };
    let uri: Uri = server.url.parse().map_err(|_| wrong("not an address"))?;
    match uri.scheme_str() {
        Some("ws") => {}
        Some("wss") => {
            return Err(wrong("TLS is not supported: use a tunnel, such as ssh -L"));
        }
        _ => return Err(wrong("not a websocket address")),
    }
    if uri.host().is_none_or(str::is_empty) {
        return Err(wrong("no host"));
    }
    let authority = uri.authority().map_or("", |authority| authority.as_str());
    let port = authority.rsplit_once(':').map(|(_, port)| port).filter(|port| !port.ends_with(']'));
    if let Some(port) = port.filter(|port| !port.parse::<u16>().is_ok_and(|port| port > 0)) {
        return Err(wrong(&format!("{port:?} is not a port, a whole number in 1..65535")));
    }
    let request = ClientRequestBuilder::new(uri);
    Ok(match &server.api_key {
        Some(key) => request.with_header("Authorization", format!("Api-Key {key}")),
        None => request,
    })
}

fn sleep(pause: Duration, server: &PolicyServer) -> Result<(), PolicyError> {
    let end = Instant::now() + pause;
    while Instant::now() < end {
        server.proceed()?;
        thread::sleep(POLL_INTERVAL.min(end.saturating_duration_since(Instant::now())));
    }
    Ok(())
}

/// The last characters of a text. In a Python traceback they hold the error.
fn end_of(text: &str) -> &str {
    let text = text.trim_end();
    let from = text.char_indices().rev().nth(MAX_ERROR_CHARS).map_or(0, |(at, _)| at);
    &text[from..]
}
