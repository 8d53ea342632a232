//! A connection to a policy server. Every wait ends at a deadline or when the run is cancelled, whatever arrives.

use std::{
    io::{self, ErrorKind},
    net::{TcpStream, ToSocketAddrs},
    sync::mpsc::{self, RecvTimeoutError},
    thread,
    time::{Duration, Instant},
};

use rmpv::Value;
use tungstenite::{
    ClientRequestBuilder, Error, Message, WebSocket, client, error::ProtocolError, http::Uri,
    protocol::frame::coding::CloseCode,
};

use softvt_common::cancel::CancelFlag;

use crate::{
    PolicyError,
    msgpack::unpack,
    profile::Profile,
    transport::{
        self, POLL_INTERVAL, PollingStream, TransportError, complete_handshake, websocket_config, would_block,
    },
};

/// Longest message that is accepted; an action chunk is about 10 kB.
const MAX_MESSAGE_BYTES: usize = 64 << 20;
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
/// Port of an address without one: that of openpi's servers.
const DEFAULT_PORT: u16 = 8000;

/// Protocol of a policy server.
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

/// Address and protocol of a policy server.
#[derive(Clone, Debug)]
pub struct PolicyServer {
    /// `ws://host:port`, optionally with a path.
    pub url: String,
    /// Protocol.
    pub protocol: ServerProtocol,
    /// Keys and units of observations and actions.
    pub profile: Profile,
    /// Time limit for connecting, greeting included, and for each response.
    pub timeout: Duration,
    /// Sent as `Authorization: Api-Key …`, if present.
    pub api_key: Option<String>,
    /// Flag that cancels the run.
    pub cancel: &'static CancelFlag,
}

impl PolicyServer {
    /// A failure of this server; `what` continues "the policy server URL …".
    pub(super) fn error(&self, what: &str) -> PolicyError {
        PolicyError::Server { url: self.url.clone(), problem: what.to_owned() }
    }

    fn check_cancel(&self) -> Result<(), PolicyError> {
        if self.cancel.requested() { Err(PolicyError::Interrupted) } else { Ok(()) }
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

    fn check_deadline(&self, deadline: Instant, what: &str) -> Result<(), PolicyError> {
        self.check_cancel()?;
        if Instant::now() < deadline {
            return Ok(());
        }
        let seconds = self.timeout.as_secs_f64();
        Err(self
            .error(&format!("{what} within {seconds} s; raise the timeout of the policy if it needs longer")))
    }

    fn socket_error(&self, error: &Error) -> PolicyError {
        match error {
            Error::ConnectionClosed
            | Error::AlreadyClosed
            | Error::Protocol(ProtocolError::SendAfterClosing) => self.error("closed the connection"),
            Error::Capacity(_) => self.error(&format!(
                "sent more than {} MiB in one message: no chunk of actions is as long",
                MAX_MESSAGE_BYTES >> 20
            )),
            Error::Io(error) => self.error(&format!("cannot be reached any more: {error}")),
            Error::Protocol(_) => self.error(&format!("broke the websocket protocol: {error}")),
            other => self.error(&format!("is not a websocket server: {other}")),
        }
    }

    fn transport_error(&self, error: TransportError<PolicyError>) -> PolicyError {
        match error {
            TransportError::Socket(error) => self.socket_error(&error),
            TransportError::Aborted(error) => error,
        }
    }
}

/// An open connection, before or after the greeting of the protocol. Dropping it closes it with a close frame.
#[derive(Debug)]
pub(super) struct PolicyConnection {
    pub(super) server: PolicyServer,
    socket: WebSocket<PollingStream>,
    /// Number of the last message sent (vla-eval).
    pub(super) seq: u64,
    /// True if the server asked for an observation in every control step.
    pub(super) observes_every_step: bool,
    /// Number of the last ping sent.
    pings: u64,
}

impl PolicyConnection {
    /// Connects. Retries while the server cannot be reached, until `deadline`.
    ///
    /// # Errors
    /// The address is invalid, or no connection was made in time.
    pub(super) fn open(server: &PolicyServer, deadline: Instant) -> Result<Self, PolicyError> {
        let request = request(server)?;
        let mut pause = FIRST_PAUSE;
        loop {
            let reason = match connect(&request, server, deadline) {
                Ok(socket) => {
                    return Ok(Self {
                        server: server.clone(),
                        socket,
                        seq: 0,
                        observes_every_step: false,
                        pings: 0,
                    });
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
    ///
    /// # Errors
    /// The connection fails, or the server does not accept the message in time.
    pub(super) fn send(&mut self, value: &Value, deadline: Instant) -> Result<(), PolicyError> {
        let server = &self.server;
        let on_wait = || server.check_deadline(deadline, "did not accept an observation");
        transport::send(&mut self.socket, value, on_wait).map_err(|error| server.transport_error(error))
    }

    /// Receives the next message until `deadline`. `what` says what the server did not do, such as "did not answer".
    ///
    /// # Errors
    /// The connection fails, or the server sends text (its error message), an invalid message, or nothing in time.
    pub(super) fn receive(&mut self, deadline: Instant, what: &str) -> Result<Value, PolicyError> {
        loop {
            match self.receive_frame(deadline, what)? {
                Message::Binary(bytes) => {
                    return unpack(&bytes).map_err(|error| self.server.error(&format!("sent {error}")));
                }
                Message::Text(text) => return Err(self.reported_error(&text)),
                Message::Close(_) => return Err(self.server.socket_error(&Error::ConnectionClosed)),
                Message::Ping(_) | Message::Pong(_) | Message::Frame(_) => {}
            }
        }
    }

    /// Checks that the server sent nothing after its last reply: sends a ping and waits for its pong.
    /// Frames keep their order, so a message sent before the pong arrives before it. A connection that the
    /// server closed meanwhile passes.
    ///
    /// # Errors
    /// The server sent a message, or no pong until `deadline`.
    pub(super) fn check_silence(&mut self, deadline: Instant) -> Result<(), PolicyError> {
        self.pings += 1;
        let own = self.pings.to_be_bytes();
        let ping = Message::Ping(own.to_vec().into());
        let server = &self.server;
        let on_wait = || server.check_deadline(deadline, "did not accept a ping");
        match transport::send_frame(&mut self.socket, ping, on_wait) {
            Ok(()) => {}
            Err(TransportError::Aborted(error)) => return Err(error),
            Err(TransportError::Socket(_)) => return Ok(()),
        }
        loop {
            let server = &self.server;
            let on_wait = |_: &mut _| server.check_deadline(deadline, "did not answer a ping");
            match transport::receive(&mut self.socket, on_wait) {
                Ok(Message::Pong(payload)) if *payload == own => return Ok(()),
                Ok(Message::Binary(_)) => return Err(server.unrequested()),
                Ok(Message::Text(text)) => return Err(self.reported_error(&text)),
                Ok(Message::Close(_)) | Err(TransportError::Socket(_)) => return Ok(()),
                Ok(Message::Ping(_) | Message::Pong(_) | Message::Frame(_)) => {
                    server.check_deadline(deadline, "did not answer a ping")?;
                }
                Err(TransportError::Aborted(error)) => return Err(error),
            }
        }
    }

    /// Reads what was received while the connection was idle, and answers pings. Returns true if it can still be used.
    ///
    /// # Errors
    /// The server sent a message.
    pub(super) fn is_open(&mut self) -> Result<bool, PolicyError> {
        if self.socket.get_mut().set_nonblocking(true).is_err() {
            return Ok(false);
        }
        for _ in 0..MAX_IDLE_MESSAGES {
            match self.socket.read() {
                Ok(Message::Ping(_) | Message::Pong(_)) => {}
                Ok(Message::Binary(_)) => return Err(self.server.unrequested()),
                Ok(Message::Text(text)) => return Err(self.reported_error(&text)),
                Err(Error::Io(error)) if would_block(&error) => {
                    // The server may have closed the websocket, but not yet its TCP connection.
                    return Ok(
                        self.socket.can_write() && self.socket.get_mut().set_nonblocking(false).is_ok()
                    );
                }
                // The end: a new connection is needed.
                _ => return Ok(false),
            }
        }
        Ok(false)
    }

    fn receive_frame(&mut self, deadline: Instant, what: &str) -> Result<Message, PolicyError> {
        let server = &self.server;
        // A server that sends pings without a pause never makes a read wait.
        server.check_deadline(deadline, what)?;
        let message = transport::receive(&mut self.socket, |_| server.check_deadline(deadline, what));
        message.map_err(|error| server.transport_error(error))
    }

    fn reported_error(&self, text: &str) -> PolicyError {
        self.server.error(&format!("reported an error:\n{}", end_of(text)))
    }
}

impl Drop for PolicyConnection {
    /// Sends a close frame and waits for that of the server, so that its log shows a regular end.
    fn drop(&mut self) {
        let _ = self.socket.get_mut().set_nonblocking(false);
        let deadline = Instant::now() + CLOSE_TIMEOUT;
        let may_wait = || Instant::now() <= deadline && !self.server.cancel.requested();
        let on_wait = |_: &mut _| if may_wait() { Ok(()) } else { Err(()) };
        let is_sent = transport::close(&mut self.socket, CloseCode::Normal, may_wait).is_ok();
        // The socket reports the end of the closing handshake as an error.
        while is_sent && may_wait() && transport::receive(&mut self.socket, on_wait).is_ok() {}
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
) -> Result<WebSocket<PollingStream>, ConnectError> {
    let stream = PollingStream::new(connect_tcp(server, deadline)?)?;
    let handshake =
        client::client_with_config(request.clone(), stream, Some(websocket_config(MAX_MESSAGE_BYTES)));
    let on_wait = || {
        server.check_cancel().map_err(ConnectError::Final)?;
        match Instant::now() > deadline {
            true => Err(ConnectError::Retry("it accepts connections but says nothing".to_owned())),
            false => Ok(()),
        }
    };
    match complete_handshake(handshake, on_wait) {
        Ok((socket, _)) => Ok(socket),
        Err(TransportError::Aborted(error)) => Err(error),
        // A server that is being started may close connections at first.
        Err(TransportError::Socket(Error::Io(error))) => Err(error.into()),
        Err(TransportError::Socket(Error::Http(response))) if response.status().as_u16() == 503 => {
            Err(ConnectError::Retry("HTTP status 503".to_owned()))
        }
        Err(TransportError::Socket(error)) => {
            let (url, reason) = (server.url.clone(), error.to_string());
            Err(ConnectError::Final(PolicyError::NotWebsocket { url, reason }))
        }
    }
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
        server.check_cancel().map_err(ConnectError::Final)?;
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
        server.check_cancel()?;
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
