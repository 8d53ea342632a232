//! HTTP/1.1 servers of local pages and programs, with bounds on what strangers can use up: one request per connection,
//! which is answered or becomes a websocket.
//!
//! The small servers among the crates read request lines, headers and unread bodies of any length; hyper needs an
//! asynchronous runtime.

use std::{
    fmt::Write as _,
    io::{self, ErrorKind, Read, Write},
    net::{Shutdown, TcpListener, TcpStream},
    panic::{AssertUnwindSafe, catch_unwind},
    sync::atomic::{AtomicUsize, Ordering},
    thread,
    time::{Duration, Instant},
};

use tungstenite::{
    WebSocket,
    handshake::server::{Request, create_response, write_response},
    http::{StatusCode, Version, header},
    protocol::Role,
};

use super::transport::{TimedStream, websocket_config};
use softvt_common::cancel::CancelFlag;

const MAX_HEAD_BYTES: usize = 16 << 10;
const MAX_HEADERS: usize = 64;
const MAX_BODY_BYTES: usize = 64 << 10;
/// Time limit for a request, and for the response.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(10);
/// Time for which incoming data is discarded after a response.
const DRAIN_TIMEOUT: Duration = Duration::from_secs(1);
/// Interval at which new connections are looked for.
const ACCEPT_INTERVAL: Duration = Duration::from_millis(10);
/// Response to connections above the limit.
const OVERLOAD_RESPONSE: &[u8] =
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain\r\nContent-Length: 21\r\nConnection: close\r\n\r\ntoo many connections\n";

/// Listens at an address; port 0 means any free port.
///
/// # Errors
/// The address is not local, or the port is in use.
pub fn listen(host: &str, port: u16) -> io::Result<TcpListener> {
    let listener = TcpListener::bind((host, port))?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

/// Reads the requests of up to `limit` connections at a time and has them handled, each in a thread, until `cancel` is
/// set. Further connections get the status 503, and malformed requests 400 and the like.
pub fn serve(
    listener: &TcpListener,
    limit: usize,
    cancel: &CancelFlag,
    handle: impl Fn(HttpRequest<'_>) + Sync,
) {
    let (connections, handle) = (AtomicUsize::new(0), &handle);
    thread::scope(|scope| {
        while !cancel.requested() {
            // Errors are transient: the client has gone, or the process has too many open files.
            let Ok((mut stream, _)) = listener.accept() else {
                thread::sleep(ACCEPT_INTERVAL);
                continue;
            };
            let Some(slot) = SlotGuard::acquire(&connections, limit) else {
                // Answered without waiting. Unread data would make the system discard the response.
                if stream.set_nonblocking(true).is_ok() {
                    let _ = stream.write(OVERLOAD_RESPONSE).and_then(|_| stream.shutdown(Shutdown::Write));
                    let _ = stream.read(&mut [0; 1024]);
                }
                continue;
            };
            let handle = move || {
                let _slot = slot;
                let _ = catch_unwind(AssertUnwindSafe(|| HttpRequest::read(stream, cancel).map(handle)));
            };
            // If no thread can be started, the connection closes.
            let _ = thread::Builder::new().name("client".to_owned()).spawn_scoped(scope, handle);
        }
    });
}

/// One of a limited number of slots, released on drop.
#[derive(Debug)]
pub struct SlotGuard<'a>(&'a AtomicUsize);

impl<'a> SlotGuard<'a> {
    /// Takes a slot, if fewer than `limit` are taken.
    pub fn acquire(count: &'a AtomicUsize, limit: usize) -> Option<Self> {
        let taken =
            count.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| (n < limit).then_some(n + 1));
        // A guard that is only constructed and dropped would release a slot that was not taken.
        taken.ok().map(|_| Self(count))
    }
}

impl Drop for SlotGuard<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A request is refused with an HTTP status and a reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    pub status: StatusCode,
    pub reason: String,
}

impl Refusal {
    /// A refusal for a reason, a line of text.
    pub fn new(status: StatusCode, reason: impl Into<String>) -> Self {
        Self { status, reason: reason.into() }
    }
}

#[derive(Debug)]
pub struct HttpRequest<'a> {
    /// Method, target and headers.
    pub head: Request,
    connection: Connection<'a>,
}

#[derive(Debug)]
struct Connection<'a> {
    stream: TimedStream<'a>,
    /// Bytes that were received and not used yet.
    received: Vec<u8>,
}

impl<'a> HttpRequest<'a> {
    /// Reads the line and the headers of a request. `None` if the client does not send them; malformed
    /// ones are answered here.
    fn read(stream: TcpStream, cancel: &'a CancelFlag) -> Option<Self> {
        let mut stream = TimedStream::new(stream, cancel).ok()?;
        stream.wait_until(Instant::now() + REQUEST_TIMEOUT);
        let mut connection = Connection { stream, received: Vec::new() };
        loop {
            match parse_head(&connection.received) {
                Ok(Some((length, head))) => {
                    connection.received.drain(..length);
                    return Some(Self { head, connection });
                }
                Ok(None) => connection.receive().ok()?,
                Err(Refusal { status, reason }) => {
                    connection.respond(status, &[], reason.as_bytes());
                    return None;
                }
            }
        }
    }

    /// Reads the content of the request.
    ///
    /// # Errors
    /// Its length is not stated or above 64 KiB, or it does not arrive in time.
    pub fn read_body(&mut self) -> Result<Vec<u8>, Refusal> {
        let Self { head, connection } = self;
        let headers = head.headers();
        if headers.contains_key(header::TRANSFER_ENCODING) {
            return Err(Refusal::new(StatusCode::LENGTH_REQUIRED, "expected a Content-Length\n"));
        }
        let length = headers.get(header::CONTENT_LENGTH).map_or(Some("0"), |length| length.to_str().ok());
        let Some(length) = length.and_then(|length| length.parse::<u64>().ok()) else {
            return Err(Refusal::new(StatusCode::BAD_REQUEST, "the Content-Length is not a number\n"));
        };
        let length = usize::try_from(length).ok().filter(|length| *length <= MAX_BODY_BYTES);
        let Some(length) = length else {
            let reason = format!("the request is longer than {} KiB\n", MAX_BODY_BYTES >> 10);
            return Err(Refusal::new(StatusCode::PAYLOAD_TOO_LARGE, reason));
        };
        let mut receive = || {
            if connection.received.len() < length && headers.contains_key(header::EXPECT) {
                connection.stream.write_all(b"HTTP/1.1 100 Continue\r\n\r\n")?;
            }
            while connection.received.len() < length {
                connection.receive()?;
            }
            Ok(())
        };
        receive()
            .map_err(|error: io::Error| Refusal::new(StatusCode::REQUEST_TIMEOUT, format!("{error}\n")))?;
        Ok(connection.received.drain(..length).collect())
    }

    /// Answers the request with a text, and closes the connection.
    pub fn respond(self, status: StatusCode, text: &str) {
        self.respond_with(status, &[("Content-Type", "text/plain; charset=utf-8")], text.as_bytes());
    }

    /// Answers the request with these headers, and closes the connection.
    pub fn respond_with(mut self, status: StatusCode, headers: &[(&str, &str)], body: &[u8]) {
        self.connection.respond(status, headers, body);
    }

    /// Makes the connection a websocket that accepts messages of up to so many bytes. `None` if the client has not
    /// asked for one, which it receives as an answer, or has gone.
    pub fn upgrade(mut self, max_message_bytes: usize) -> Option<WebSocket<TimedStream<'a>>> {
        let Ok(response) = create_response(&self.head) else {
            self.respond(StatusCode::BAD_REQUEST, "expected a websocket\n");
            return None;
        };
        let mut bytes = Vec::new();
        write_response(&mut bytes, &response).ok()?;
        self.connection.stream.write_all(&bytes).ok()?;
        let Connection { stream, received, .. } = self.connection;
        let config = websocket_config(max_message_bytes);
        Some(WebSocket::from_partially_read(stream, received, Role::Server, Some(config)))
    }
}

impl Connection<'_> {
    fn receive(&mut self) -> io::Result<()> {
        let mut buffer = [0; 4096];
        match self.stream.read(&mut buffer)? {
            0 => Err(ErrorKind::UnexpectedEof.into()),
            count => {
                self.received.extend_from_slice(&buffer[..count]);
                Ok(())
            }
        }
    }

    /// Sends a response and closes the connection, once the client has received it.
    fn respond(&mut self, status: StatusCode, headers: &[(&str, &str)], body: &[u8]) {
        self.stream.wait_until(Instant::now() + REQUEST_TIMEOUT);
        let mut head =
            format!("HTTP/1.1 {status}\r\nContent-Length: {}\r\nConnection: close\r\n", body.len());
        for (name, value) in headers {
            let _ = write!(head, "{name}: {value}\r\n");
        }
        head.push_str("\r\n");
        let sent = self.stream.write_all(head.as_bytes()).and_then(|()| self.stream.write_all(body));
        if sent.and_then(|()| self.stream.end_output()).is_err() {
            return;
        }
        // The system would discard the response if data remained unread.
        self.stream.wait_until(Instant::now() + DRAIN_TIMEOUT);
        let mut discarded = [0; 4096];
        while matches!(self.stream.read(&mut discarded), Ok(1..)) {}
    }
}

/// The head of a request and its length. `None` if it is not complete.
fn parse_head(received: &[u8]) -> Result<Option<(usize, Request)>, Refusal> {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    let too_large = || {
        Refusal::new(
            StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE,
            format!(
                "the request line and headers are longer than {} KiB, or there are more than {MAX_HEADERS} headers\n",
                MAX_HEAD_BYTES >> 10
            ),
        )
    };
    let malformed = |error: &dyn std::error::Error| {
        Refusal::new(StatusCode::BAD_REQUEST, format!("the request is malformed: {error}\n"))
    };
    let length = match parsed.parse(received) {
        Ok(httparse::Status::Complete(length)) if length <= MAX_HEAD_BYTES => length,
        Ok(httparse::Status::Partial) if received.len() < MAX_HEAD_BYTES => return Ok(None),
        Ok(_) | Err(httparse::Error::TooManyHeaders) => return Err(too_large()),
        Err(error) => return Err(malformed(&error)),
    };
    let version = if parsed.version == Some(1) { Version::HTTP_11 } else { Version::HTTP_10 };
    let mut head = Request::builder()
        .method(parsed.method.unwrap_or_default())
        .uri(parsed.path.unwrap_or_default())
        .version(version);
    for header in parsed.headers.iter() {
        head = head.header(header.name, header.value);
    }
    let head = head.body(()).map_err(|error| malformed(&error))?;
    // RFC 9112, 3.2; the first header would say nothing about the second.
    if head.headers().get_all(header::HOST).iter().nth(1).is_some() {
        return Err(Refusal::new(StatusCode::BAD_REQUEST, "the request has several Host headers\n"));
    }
    Ok(Some((length, head)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The answer of a server that returns what it receives.
    fn answer(request: &[u8]) -> String {
        let (listener, cancel) = (listen("127.0.0.1", 0).unwrap(), CancelFlag::default());
        let echo = |mut request: HttpRequest<'_>| match request.read_body() {
            Ok(body) => request.respond_with(StatusCode::OK, &[], &body),
            Err(Refusal { status, reason }) => request.respond(status, &reason),
        };
        thread::scope(|scope| {
            scope.spawn(|| serve(&listener, 1, &cancel, echo));
            let mut client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
            // The server may refuse it before its end.
            let _ = client.write_all(request).and_then(|()| client.shutdown(Shutdown::Write));
            let mut answer = Vec::new();
            let _ = client.read_to_end(&mut answer);
            cancel.request();
            String::from_utf8(answer).unwrap()
        })
    }

    #[test]
    fn requests_are_read_within_bounds() {
        let post = |rest: &str| answer(format!("POST / HTTP/1.1\r\nHost: a\r\n{rest}").as_bytes());
        let status = |answer: String| answer.split(' ').nth(1).map(str::to_owned).unwrap_or_default();
        assert!(post("Content-Length: 2\r\n\r\n{}").ends_with("\r\n\r\n{}"));
        let longest = "x".repeat(MAX_BODY_BYTES);
        assert!(post(&format!("Content-Length: {MAX_BODY_BYTES}\r\n\r\n{longest}")).ends_with(&longest));
        let expecting = post("Expect: 100-continue\r\nContent-Length: 2\r\n\r\n");
        assert!(expecting.starts_with("HTTP/1.1 100 Continue\r\n\r\n"), "{expecting}");
        let header = |count: usize| "A: b\r\n".repeat(count);
        for (rest, expected) in [
            ("Content-Length: 99999999999999\r\n\r\n{}".to_owned(), "413"),
            ("Expect: 100-continue\r\nContent-Length: 99999999999\r\n\r\n".to_owned(), "413"),
            ("Content-Length: 65537\r\n\r\n".to_owned(), "413"),
            ("Content-Length: 99999999999999999999\r\n\r\n".to_owned(), "400"),
            ("Content-Length: -1\r\n\r\n".to_owned(), "400"),
            ("Transfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n\r\n".to_owned(), "411"),
            (format!("{}\r\n", header(MAX_HEADERS)), "431"),
            (format!("{}\r\n", header(MAX_HEADERS - 1)), "200"),
            (format!("A: {}\r\n\r\n", "b".repeat(MAX_HEAD_BYTES)), "431"),
            // Without an end.
            (format!("A: {}", "b".repeat(10 * MAX_HEAD_BYTES)), "431"),
            ("Host: b\r\n\r\n".to_owned(), "400"),
            ("A b\r\n\r\n".to_owned(), "400"),
        ] {
            assert_eq!(status(post(&rest)), expected, "{rest:.80}");
        }
        assert_eq!(status(answer(&vec![b'a'; 10 * MAX_HEAD_BYTES])), "431");
        assert_eq!(status(answer(b"\x16\x03\x01\x00\xff")), "400");
        assert_eq!(answer(b"GET / HTT"), "");
    }

    #[test]
    fn a_refused_slot_is_not_released() {
        let count = AtomicUsize::new(0);
        let first = SlotGuard::acquire(&count, 1);
        assert!(first.is_some());
        for _ in 0..3 {
            assert!(SlotGuard::acquire(&count, 1).is_none());
        }
        assert_eq!(count.load(Ordering::Relaxed), 1);
        drop(first);
        assert_eq!(count.load(Ordering::Relaxed), 0);
        assert!(SlotGuard::acquire(&count, 1).is_some());
    }
}
