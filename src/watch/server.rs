//! The web server: the page, the feed over websockets, and the requests of pages.
//!
//! Requests are answered only with the token, but for the scripts of the page; its address has the token, and under
//! the address of this machine, so that no other page and no other user of the machine can use the server.

use std::{
    io,
    net::{Ipv4Addr, SocketAddr, TcpListener},
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Sender, channel},
    },
    thread,
};

use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use tungstenite::{
    Message as WebsocketMessage,
    http::{Method, StatusCode},
};

use crate::{
    feed::{Feed, Place},
    menu::Menu,
    page::{self, PageFile},
    stage::{Program, Selection, Stage},
    teleop::{Drive, DriveInput},
};
use softvt_common::cancel;
use softvt_policy::{
    access::{AccessRules, is_same_secret},
    http::{self, HttpRequest, Refusal},
};

/// Connections at a time, open pages included.
const MAX_CONNECTIONS: usize = 128;
/// Longest message of a page over the websocket, bytes; it sends none.
const MAX_MESSAGE_BYTES: usize = 1 << 10;

/// Shared state of the request handlers.
struct Page<'a> {
    access: &'a Access,
    feed: Arc<Feed>,
    selections: Sender<Selection>,
    drive: Arc<DriveInput>,
    menu: Arc<Mutex<Menu>>,
}

/// The rules of requests.
struct Access {
    address: SocketAddr,
    rules: AccessRules,
    token: String,
}

/// A page with the episodes of a program.
pub struct Watch {
    listener: TcpListener,
    access: Access,
}

impl Watch {
    /// Listens at a port of this machine, 0 for any free one. Pages state `token`.
    pub fn listen(port: u16, token: String) -> io::Result<Self> {
        let listener = http::listen(&Ipv4Addr::LOCALHOST.to_string(), port)?;
        let address = listener.local_addr()?;
        let rules = AccessRules::new("localhost", address, None);
        Ok(Self { listener, access: Access { address, rules, token } })
    }

    pub fn url(&self) -> String {
        format!("http://{}/?token={}", self.access.address, self.access.token)
    }

    /// Simulates and answers pages until the program is cancelled.
    pub fn run(&self, program: Program) {
        let (selections, requests) = channel();
        let (feed, drive) = (Arc::new(Feed::default()), Arc::new(DriveInput::default()));
        let menu = Arc::new(Mutex::default());
        let page = Page {
            access: &self.access,
            feed: feed.clone(),
            selections,
            drive: drive.clone(),
            menu: menu.clone(),
        };
        let files = Default::default();
        let stage = Stage { program, feed, requests, drive, menu, files, is_outdated: false, is_new: false };
        thread::scope(|scope| {
            scope.spawn(move || stage.run());
            http::serve(&self.listener, MAX_CONNECTIONS, &cancel::WITH_PROCESS, |request| {
                page.answer(request)
            });
        });
    }
}

impl Page<'_> {
    fn answer(&self, mut request: HttpRequest) {
        let (method, url) = (request.head.method().clone(), request.head.uri().clone());
        let (path, query) = (url.path(), url.query().unwrap_or_default());
        if let Err(Refusal { status, reason }) = self.access.rules.check(&request.head) {
            return request.respond(status, &reason);
        }
        // The scripts of the page are the same for everybody.
        if let Some(file) = page::file(path).filter(|_| path != "/" || self.access.has_token(query)) {
            return respond_with_file(request, file);
        }
        if !self.access.has_token(query) {
            let text = "open the address that softvt watch has printed; it ends with a token\n";
            return request.respond(StatusCode::UNAUTHORIZED, text);
        }
        let done = match (method, path) {
            (Method::GET, "/feed") => return send_feed(request, &self.feed),
            (Method::POST, "/select") => read_json(&mut request).and_then(|selection| self.select(selection)),
            (Method::POST, "/drive") => self.set_drive(&mut request),
            _ => Err(Refusal::new(StatusCode::NOT_FOUND, "there is no such page\n")),
        };
        match done {
            Ok(()) => request.respond(StatusCode::OK, ""),
            Err(Refusal { status, reason }) => request.respond(status, &reason),
        }
    }

    /// Selects an episode. All pages receive what is wrong with it, if anything is, as the error of its simulation.
    fn select(&self, selection: Selection) -> Result<(), Refusal> {
        let problem = self.menu.lock().unwrap_or_else(PoisonError::into_inner).problem(&selection);
        // The thread that simulates ends with the program only.
        let _ = self.selections.send(selection);
        problem.map_or(Ok(()), |problem| Err(bad_request(problem)))
    }

    /// Sets what the page drives the arm by.
    fn set_drive(&self, request: &mut HttpRequest) -> Result<(), Refusal> {
        let drive: Drive = read_json(request)?;
        drive.check().map_err(bad_request)?;
        self.drive.set(drive);
        Ok(())
    }
}

impl Access {
    fn has_token(&self, query: &str) -> bool {
        let given = query.split('&').find_map(|pair| pair.strip_prefix("token="));
        given.is_some_and(|given| is_same_secret(given.as_bytes(), self.token.as_bytes()))
    }
}

/// Sends the feed over a websocket until the page closes.
fn send_feed(request: HttpRequest, feed: &Feed) {
    let Some(mut socket) = request.upgrade(MAX_MESSAGE_BYTES) else { return };
    socket.get_mut().wait_until(None);
    let (mut place, _viewer) = (Place::default(), feed.enter());
    loop {
        let message = match feed.next(place) {
            Some((message, next)) => {
                place = next;
                WebsocketMessage::binary(message.as_slice().to_vec())
            }
            // Shows whether the page is still open.
            None => WebsocketMessage::Ping(Default::default()),
        };
        if cancel::requested() || socket.send(message).is_err() {
            return;
        }
    }
}

/// The content of a request.
fn read_json<T: DeserializeOwned>(request: &mut HttpRequest) -> Result<T, Refusal> {
    let body = request.read_body()?;
    // A list would be read as the fields in their order.
    let object: Map<String, Value> = serde_json::from_slice(&body).map_err(bad_request)?;
    serde_json::from_value(Value::Object(object)).map_err(bad_request)
}

fn bad_request(problem: impl std::fmt::Display) -> Refusal {
    Refusal::new(StatusCode::BAD_REQUEST, format!("{problem}\n"))
}

fn respond_with_file(request: HttpRequest, file: PageFile) {
    let policy = "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'";
    let headers =
        [("Content-Type", file.kind), ("Content-Security-Policy", policy), ("Cache-Control", "no-cache")];
    request.respond_with(StatusCode::OK, &headers, file.content);
}
