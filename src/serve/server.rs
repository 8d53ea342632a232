//! The server: a bounded number of clients, and a thread per client.

use std::{
    net::TcpListener,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::atomic::AtomicUsize,
};

use rmpv::Value;
use tungstenite::http::{Method, StatusCode};

use super::{
    attempts::Attempts,
    config::ServerConfig,
    connection::{Connection, ReceiveError},
    render_budget::RenderBudget,
    request::Request,
    response,
    session::ClientSession,
};
use softvt_common::cancel::CancelFlag;
use softvt_policy::http::{self, HttpRequest, Refusal, SlotGuard};

/// Connections accepted above `max_clients` while the type of their request is still unknown.
const BACKLOG: usize = 64;

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
    http::serve(listener, max_clients + BACKLOG, cancel, |request| answer(request, &state));
}

/// Answers a health check, or serves a client to its end. Its failures affect no other connection.
fn answer(request: HttpRequest, state: &ServerState) {
    if request.head.method() == Method::GET && request.head.uri().path() == "/healthz" {
        return request.respond(StatusCode::OK, "OK\n");
    }
    if let Err(Refusal { status, reason }) = state.config.access.check(&request.head) {
        return request.respond(status, &reason);
    }
    let Some(_slot) = SlotGuard::acquire(&state.clients, state.max_clients) else {
        let reason = format!("the server has {} clients, its limit\n", state.max_clients);
        return request.respond(StatusCode::SERVICE_UNAVAILABLE, &reason);
    };
    if let Some(connection) = Connection::accept(request, state.cancel) {
        run_session(connection, state);
    }
}

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
