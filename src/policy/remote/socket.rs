//! A websocket with time limits: every wait ends at a deadline or when the run does.

use std::{
    io::{self, ErrorKind},
    net::{TcpStream, ToSocketAddrs},
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, Instant},
};

use rmpv::Value;
use tungstenite::{
    ClientRequestBuilder, Error, HandshakeError, Message, WebSocket, client, http::Uri,
    protocol::WebSocketConfig,
};

use super::{PolicyError, PolicyServer};
use crate::policy::wire::unpack;

/// The longest message that is taken: a chunk of actions is some ten kilobytes.
const LARGEST: usize = 64 << 20;
/// Between two looks at the clock and at the wish to end.
const SLICE: Duration = Duration::from_millis(50);
/// Between two attempts to connect: doubled each time up to the longest.
const PAUSES: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(2)];
/// Most messages that a server sends without being asked, such as pings.
const UNASKED: usize = 1000;
/// Characters of a server's own text that are told.
const TOLD: usize = 2000;

/// An open connection.
#[derive(Debug)]
pub(super) struct Socket {
    url: String,
    socket: WebSocket<TcpStream>,
    timeout: Duration,
    cancel: &'static AtomicBool,
}

impl Socket {
    /// Connects; a server that is not there yet is waited for.
    ///
    /// # Errors
    /// A wrong address; nobody answers in time.
    pub(super) fn connect(server: &PolicyServer) -> Result<Self, PolicyError> {
        let request = request(server)?;
        let deadline = Instant::now() + server.timeout;
        let mut pause = PAUSES[0];
        loop {
            let refused = match attempt(&request, server, deadline) {
                Ok(socket) => {
                    let url = server.url.clone();
                    return Ok(Self { url, socket, timeout: server.timeout, cancel: server.cancel });
                }
                Err(Attempt::Final(error)) => return Err(error),
                Err(Attempt::Again(what)) => what,
            };
            if Instant::now() + pause > deadline {
                return Err(PolicyError::Transport(format!(
                    "no policy server at {}: {refused}; tried for {} s: start it, or raise --policy-timeout",
                    server.url,
                    server.timeout.as_secs_f64()
                )));
            }
            rest(pause, server.cancel)?;
            pause = (2 * pause).min(PAUSES[1]);
        }
    }

    /// Sends a message.
    ///
    /// # Errors
    /// The connection is gone, or the server does not take it in time.
    pub(super) fn send(&mut self, value: &Value) -> Result<(), PolicyError> {
        let mut bytes = Vec::new();
        rmpv::encode::write_value(&mut bytes, value)
            .map_err(|e| PolicyError::Transport(format!("cannot pack an observation: {e}")))?;
        let deadline = Instant::now() + self.timeout;
        let mut sent = self.socket.send(Message::binary(bytes));
        while let Err(Error::Io(error)) = &sent
            && is_wait(error)
        {
            self.wait(deadline, "did not take an observation")?;
            sent = self.socket.flush();
        }
        sent.map_err(|error| self.lost(&error))
    }

    /// The next message of the server.
    ///
    /// # Errors
    /// The connection is gone, the server answers with text or bytes that are no msgpack, too much, or not in time.
    pub(super) fn receive(&mut self) -> Result<Value, PolicyError> {
        let deadline = Instant::now() + self.timeout;
        loop {
            match self.socket.read() {
                Ok(Message::Binary(bytes)) => return self.unpack(&bytes),
                Ok(Message::Text(text)) => {
                    return Err(PolicyError::Transport(format!(
                        "the policy server {} failed; it says:\n{}",
                        self.url,
                        end_of(&text)
                    )));
                }
                Ok(Message::Close(_)) => return Err(self.lost(&Error::ConnectionClosed)),
                Ok(Message::Ping(_) | Message::Pong(_) | Message::Frame(_)) => {}
                Err(Error::Io(error)) if is_wait(&error) => self.wait(deadline, "did not answer")?,
                Err(error) => return Err(self.lost(&error)),
            }
        }
    }

    /// Takes what came while nobody listened, so that pings are answered; whether the connection still stands.
    pub(super) fn is_open(&mut self) -> bool {
        let waits =
            |socket: &WebSocket<TcpStream>, waits: bool| socket.get_ref().set_nonblocking(!waits).is_ok();
        if !waits(&self.socket, false) {
            return false;
        }
        for _ in 0..UNASKED {
            match self.socket.read() {
                Ok(Message::Ping(_) | Message::Pong(_)) => {}
                Err(Error::Io(error)) if is_wait(&error) => return waits(&self.socket, true),
                // Nothing was asked: whoever talks or hangs up then is spoken to anew.
                _ => return false,
            }
        }
        false
    }

    /// Tells what is wrong with what the server sent.
    pub(super) fn wrong(&self, what: &str) -> PolicyError {
        PolicyError::Transport(format!("the policy server {} {what}", self.url))
    }

    fn unpack(&self, bytes: &[u8]) -> Result<Value, PolicyError> {
        unpack(bytes).map_err(|what| self.wrong(&format!("sent bytes that are {what}")))
    }

    fn wait(&self, deadline: Instant, what: &str) -> Result<(), PolicyError> {
        if self.cancel.load(Ordering::Relaxed) {
            return Err(PolicyError::Interrupted);
        }
        if Instant::now() < deadline {
            return Ok(());
        }
        let seconds = self.timeout.as_secs_f64();
        Err(self.wrong(&format!("{what} within {seconds} s; raise --policy-timeout if it needs longer")))
    }

    fn lost(&self, error: &Error) -> PolicyError {
        match error {
            Error::ConnectionClosed | Error::AlreadyClosed => self.wrong("closed the connection"),
            Error::Capacity(_) => self.wrong(&format!(
                "sent more than {} MiB in one message: no chunk of actions is as long",
                LARGEST >> 20
            )),
            Error::Io(error) => self.wrong(&format!("is gone: {error}")),
            Error::Protocol(_) => self.wrong(&format!("is gone: {error}")),
            other => self.wrong(&format!("does not speak websocket: {other}")),
        }
    }
}

/// What became of an attempt to connect.
enum Attempt {
    Again(String),
    Final(PolicyError),
}

fn attempt(
    request: &ClientRequestBuilder,
    server: &PolicyServer,
    deadline: Instant,
) -> Result<WebSocket<TcpStream>, Attempt> {
    let again = |error: io::Error| Attempt::Again(error.to_string());
    let stream = open(&server.url, deadline).map_err(again)?;
    stream.set_nodelay(true).map_err(again)?;
    stream.set_read_timeout(Some(SLICE)).map_err(again)?;
    stream.set_write_timeout(Some(SLICE)).map_err(again)?;
    let config = WebSocketConfig::default().max_message_size(Some(LARGEST)).max_frame_size(Some(LARGEST));
    let mut shake = client::client_with_config(request.clone(), stream, Some(config));
    loop {
        match shake {
            Ok((socket, _)) => return Ok(socket),
            Err(HandshakeError::Interrupted(middle)) => {
                if server.cancel.load(Ordering::Relaxed) {
                    return Err(Attempt::Final(PolicyError::Interrupted));
                }
                if Instant::now() > deadline {
                    return Err(Attempt::Again("it accepts connections but says nothing".to_owned()));
                }
                shake = middle.handshake();
            }
            // A server that is being started may close connections at first.
            Err(HandshakeError::Failure(Error::Io(error))) => return Err(again(error)),
            Err(HandshakeError::Failure(Error::Http(response))) if response.status().as_u16() == 503 => {
                return Err(Attempt::Again("HTTP status 503".to_owned()));
            }
            Err(HandshakeError::Failure(error)) => {
                let message = format!("{} is no websocket server: {error}", server.url);
                return Err(Attempt::Final(PolicyError::Transport(message)));
            }
        }
    }
}

/// Opens a connection to the first address of a server that takes one.
fn open(url: &str, deadline: Instant) -> io::Result<TcpStream> {
    let uri: Uri = url.parse().map_err(io::Error::other)?;
    let host = uri.host().unwrap_or_default().trim_start_matches('[').trim_end_matches(']');
    let mut refused = io::Error::new(ErrorKind::NotFound, "its name has no address");
    for address in (host, uri.port_u16().unwrap_or(DEFAULT_PORT)).to_socket_addrs()? {
        let left = deadline.saturating_duration_since(Instant::now()).max(SLICE);
        match TcpStream::connect_timeout(&address, left) {
            Ok(stream) => return Ok(stream),
            Err(error) => refused = error,
        }
    }
    Err(refused)
}

/// openpi's, if the address names none.
const DEFAULT_PORT: u16 = 8000;

fn request(server: &PolicyServer) -> Result<ClientRequestBuilder, PolicyError> {
    let wrong = |what: &str| {
        PolicyError::Address(format!("--policy {}: {what}; expected ws://HOST:PORT", server.url))
    };
    let uri: Uri = server.url.parse().map_err(|_| wrong("not an address"))?;
    match uri.scheme_str() {
        Some("ws") => {}
        Some("wss") => {
            return Err(wrong("encrypted connections are not spoken: use a tunnel, such as ssh -L"));
        }
        _ => return Err(wrong("not a websocket address")),
    }
    if uri.host().is_none_or(str::is_empty) {
        return Err(wrong("no host"));
    }
    let authority = uri.authority().map_or("", |authority| authority.as_str());
    let port = authority.rsplit_once(':').map(|(_, port)| port).filter(|port| !port.ends_with(']'));
    if let Some(port) = port.filter(|port| !port.parse::<u16>().is_ok_and(|port| port > 0)) {
        return Err(wrong(&format!("{port:?} is no port, which is a whole number in 1..65535")));
    }
    let request = ClientRequestBuilder::new(uri);
    Ok(match &server.api_key {
        Some(key) => request.with_header("Authorization", format!("Api-Key {key}")),
        None => request,
    })
}

fn rest(pause: Duration, stop: &AtomicBool) -> Result<(), PolicyError> {
    let end = Instant::now() + pause;
    while Instant::now() < end {
        if stop.load(Ordering::Relaxed) {
            return Err(PolicyError::Interrupted);
        }
        thread::sleep(SLICE.min(end.saturating_duration_since(Instant::now())));
    }
    Ok(())
}

fn is_wait(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

/// The end of a text, which of a traceback says most.
fn end_of(text: &str) -> &str {
    let text = text.trim_end();
    let from = text.char_indices().rev().nth(TOLD).map_or(0, |(at, _)| at);
    &text[from..]
}
