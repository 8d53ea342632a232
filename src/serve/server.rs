//! The server: its address, a bounded number of clients, and a thread per client.

use std::{
    io::{self, Read, Write},
    net::{Shutdown, TcpListener, TcpStream},
    panic::{AssertUnwindSafe, catch_unwind},
    sync::atomic::{AtomicUsize, Ordering},
    thread,
    time::{Duration, Instant},
};

use rmpv::Value;

use tungstenite::http::StatusCode;

use super::{
    access::Refusal,
    attempts::Attempts,
    config::ServerConfig,
    connection::{Connection, HANDSHAKE_TIMEOUT, ReceiveError},
    render_budget::RenderBudget,
    request::Request,
    response,
    session::ClientSession,
};
use softvt_common::cancel::CancelFlag;
use softvt_policy::transport::{POLL_INTERVAL, would_block};

/// Accept-loop polling interval.
const ACCEPT_POLL_INTERVAL: Duration = Duration::from_millis(10);
/// Connections accepted above `max_clients` while the type of their request is still unknown.
const BACKLOG: usize = 64;
/// Beginning of a health check, and the response.
const HEALTH_REQUEST: &[u8] = b"GET /healthz";
const HEALTH_RESPONSE: &[u8] =
    b"HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\nContent-Length: 3\r\nConnection: close\r\n\r\nOK\n";
/// Response to connections above the limit, health checks included.
const OVERLOAD_RESPONSE: &[u8] =
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain\r\nContent-Length: 21\r\nConnection: close\r\n\r\ntoo many connections\n";
/// Time for which incoming data is discarded after a health check.
const HEALTH_DRAIN_TIMEOUT: Duration = Duration::from_secs(1);

/// Listens at an address; port 0 means any free port.
///
/// # Errors
/// The address is not local, or the port is in use.
pub fn listen(host: &str, port: u16) -> io::Result<TcpListener> {
    let listener = TcpListener::bind((host, port))?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

/// Data that the threads of all clients share.
struct ServerState<'a> {
    config: &'a ServerConfig<'a>,
    hello: Value,
    max_clients: usize,
    clients: AtomicUsize,
    render_budget: RenderBudget,
    attempts: Attempts<'a>,
    cancel: &'a CancelFlag,
}

/// Serves up to `max_clients` clients at a time until `cancel` is set. `hello` is the first message to each.
pub fn serve(
    listener: &TcpListener,
    config: &ServerConfig,
    hello: Value,
    max_clients: usize,
    cancel: &CancelFlag,
) {
    let (clients, render_budget) = (AtomicUsize::new(0), RenderBudget::default());
    let attempts = Attempts::new(config.recorder.as_ref());
    let state = ServerState { config, hello, max_clients, clients, render_budget, attempts, cancel };
    let connections = AtomicUsize::new(0);
    thread::scope(|scope| {
        while !cancel.requested() {
            // Errors are transient: the client has gone, or the process has too many open files.
            let Ok((stream, _)) = listener.accept() else {
                thread::sleep(ACCEPT_POLL_INTERVAL);
                continue;
            };
            let Some(slot) = SlotGuard::acquire(&connections, max_clients + BACKLOG) else {
                refuse_connection(stream);
                continue;
            };
            let state = &state;
            let handle = move || {
                let _slot = slot;
                let _ = catch_unwind(AssertUnwindSafe(|| handle_connection(stream, state)));
            };
            // If no thread can be started, the connection closes.
            let _ = thread::Builder::new().name("client".to_owned()).spawn_scoped(scope, handle);
        }
    });
}

/// One of a limited number of slots, released on drop.
#[derive(Debug)]
struct SlotGuard<'a>(&'a AtomicUsize);

impl<'a> SlotGuard<'a> {
    fn acquire(count: &'a AtomicUsize, limit: usize) -> Option<Self> {
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

/// Answers a connection above the limit without waiting.
fn refuse_connection(mut stream: TcpStream) {
    if stream.set_nonblocking(true).is_ok() {
        let _ = stream.write(OVERLOAD_RESPONSE).and_then(|_| stream.shutdown(Shutdown::Write));
        // Unread data would make the system discard the response.
        let _ = stream.read(&mut [0; 1024]);
    }
}

/// Handles a connection from its first byte to its end. Its failures affect no other connection.
fn handle_connection(stream: TcpStream, state: &ServerState) {
    let wait = Some(POLL_INTERVAL);
    if stream.set_nonblocking(false).and_then(|()| stream.set_read_timeout(wait)).is_err() {
        return;
    }
    match is_health_check(&stream, state.cancel) {
        None => return,
        Some(true) => return answer_health_check(stream),
        Some(false) => {}
    }
    let mut slot = None;
    let check = |request: &_| {
        state.config.access.check(request)?;
        slot = SlotGuard::acquire(&state.clients, state.max_clients);
        let reason = || format!("the server has {} clients, its limit\n", state.max_clients);
        match slot {
            Some(_) => Ok(()),
            None => Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, reason())),
        }
    };
    if let Ok(connection) = Connection::accept(stream, state.cancel, check) {
        run_session(connection, state);
    }
}

/// True if the connection starts with a health-check request. `None` if nothing arrives.
fn is_health_check(stream: &TcpStream, cancel: &CancelFlag) -> Option<bool> {
    let deadline = Instant::now() + HANDSHAKE_TIMEOUT;
    let mut start = [0; HEALTH_REQUEST.len() + 1];
    while Instant::now() < deadline && !cancel.requested() {
        match stream.peek(&mut start) {
            Ok(0) => return None,
            Ok(count) if count == start.len() => {
                return Some(
                    start.starts_with(HEALTH_REQUEST) && b" ?".contains(&start[HEALTH_REQUEST.len()]),
                );
            }
            Ok(count) if !HEALTH_REQUEST.starts_with(&start[..count.min(HEALTH_REQUEST.len())]) => {
                return Some(false);
            }
            Ok(_) => thread::sleep(ACCEPT_POLL_INTERVAL),
            Err(error) if would_block(&error) => {}
            Err(_) => return None,
        }
    }
    None
}

fn answer_health_check(mut stream: TcpStream) {
    let _ = stream.write_all(HEALTH_RESPONSE).and_then(|()| stream.shutdown(Shutdown::Write));
    // The system would discard the response if data remained unread.
    let deadline = Instant::now() + HEALTH_DRAIN_TIMEOUT;
    let mut discarded = [0; 1024];
    while Instant::now() < deadline && !matches!(stream.read(&mut discarded), Ok(0)) {}
}

/// Responds to one message after another.
fn run_session(mut connection: Connection, state: &ServerState) {
    if connection.send(&state.hello).is_err() {
        return;
    }
    let mut session = ClientSession::new(state.config, &state.render_budget, &state.attempts, state.cancel);
    loop {
        let (response, is_last) = match connection.recv() {
            Ok(message) => respond(&mut session, state.config, &message),
            Err(ReceiveError::Closed) => return connection.close(),
            Err(error) => (response::error(&error), matches!(error, ReceiveError::TooLong)),
        };
        if connection.send(&response).is_err() {
            return;
        }
        if is_last {
            return connection.close();
        }
    }
}

/// Response to a message. True if it is the last one.
fn respond(session: &mut ClientSession, config: &ServerConfig, message: &Value) -> (Value, bool) {
    let request = match Request::read(message, config) {
        Ok(request) => request,
        Err(error) => return (response::error(&error), false),
    };
    let is_last = request == Request::Close;
    match catch_unwind(AssertUnwindSafe(|| session.execute(request))) {
        Ok(Ok(response)) => (response, is_last),
        Ok(Err(error)) => (response::error(&error), false),
        Err(_) => {
            session.discard_episode();
            (response::error(&"internal error of the server; the episode was discarded; send reset"), false)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
