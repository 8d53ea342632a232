//! The web server: the page, the feed over websockets, and the requests of pages.
//!
//! Requests are answered only with the token, but for the scripts of the page; its address has the token, and under
//! the address of this machine, so that no other page and no other user of the machine can use the server.

use std::{
    io::{self, Read},
    net::{Ipv4Addr, SocketAddr, TcpListener},
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Sender, channel},
    },
    thread,
    time::Duration,
};

use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use tiny_http::{Header, Method, Request, Response, Server};
use tungstenite::{Message as WebsocketMessage, WebSocket, handshake::derive_accept_key, protocol::Role};

use crate::{
    feed::{Feed, Place},
    menu::Menu,
    page::{self, PageFile},
    stage::{Program, Selection, Stage},
    teleop::{Drive, DriveInput},
};
use softvt_common::cancel;

/// Longest wait for a request before the server looks whether the program ends.
const WAIT: Duration = Duration::from_millis(200);
/// Largest request of a page, bytes.
const MAX_REQUEST: u64 = 1 << 16;

/// A server cannot be started.
#[derive(Debug)]
pub struct WatchError(pub io::Error);

/// What requests read and change.
#[derive(Clone)]
struct Page {
    access: Arc<Access>,
    feed: Arc<Feed>,
    selections: Sender<Selection>,
    drive: Arc<DriveInput>,
    menu: Arc<Mutex<Menu>>,
}

/// Who may send requests.
struct Access {
    address: SocketAddr,
    token: String,
}

/// A page with the episodes of a program.
pub struct Watch {
    server: Server,
    access: Arc<Access>,
}

impl Watch {
    /// Listens at a port of this machine, 0 for any free one. Pages state `token`.
    ///
    /// # Errors
    /// The port cannot be used.
    pub fn listen(port: u16, token: String) -> Result<Self, WatchError> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(WatchError)?;
        let address = listener.local_addr().map_err(WatchError)?;
        let server = Server::from_listener(listener, None);
        let server = server.map_err(|error| WatchError(io::Error::other(error)))?;
        Ok(Self { server, access: Arc::new(Access { address, token }) })
    }

    /// Address of the page.
    pub fn url(&self) -> String {
        format!("http://{}/?token={}", self.access.address, self.access.token)
    }

    /// Simulates and answers pages until the program is cancelled.
    ///
    /// # Errors
    /// The server has failed.
    pub fn run(&self, program: Program) -> Result<(), WatchError> {
        let (selections, requests) = channel();
        let (feed, drive) = (Arc::new(Feed::default()), Arc::new(DriveInput::default()));
        let menu = Arc::new(Mutex::default());
        let page = Page {
            access: self.access.clone(),
            feed: feed.clone(),
            selections,
            drive: drive.clone(),
            menu: menu.clone(),
        };
        let files = Default::default();
        let stage = Stage { program, feed, requests, drive, menu, files, is_outdated: false, is_new: false };
        thread::scope(|scope| {
            scope.spawn(move || stage.run());
            while !cancel::requested() {
                let request = match self.server.recv_timeout(WAIT) {
                    Ok(Some(request)) => request,
                    Ok(None) => continue,
                    // No connection is accepted any more.
                    Err(error) => {
                        cancel::request();
                        return Err(WatchError(error));
                    }
                };
                let page = page.clone();
                // Not awaited at the end: a page that reads nothing would hold up the program.
                thread::spawn(move || page.answer(request));
            }
            Ok(())
        })
    }
}

impl Page {
    /// Answers one request.
    fn answer(&self, mut request: Request) {
        let url = request.url().to_owned();
        let (path, query) = url.split_once('?').unwrap_or((&url, ""));
        if !self.access.is_own_page(&request) {
            return respond(request, 403, "requests of other pages are refused\n");
        }
        // The scripts of the page are the same for everybody.
        if let Some(file) = page::file(path).filter(|_| path != "/" || self.access.has_token(query)) {
            return respond_with_file(request, file);
        }
        if !self.access.has_token(query) {
            let text = "open the address that softvt watch has printed; it ends with a token\n";
            return respond(request, 401, text);
        }
        match (request.method(), path) {
            (Method::Get, "/feed") => send_feed(request, &self.feed),
            (Method::Post, "/select") => {
                let selected = read_json(&mut request).and_then(|selection| self.select(selection));
                respond_to_post(request, selected);
            }
            (Method::Post, "/drive") => {
                let drive = read_json(&mut request).and_then(|drive: Drive| drive.check().map(|()| drive));
                respond_to_post(request, drive.map(|drive| self.drive.set(drive)));
            }
            _ => respond(request, 404, "there is no such page\n"),
        }
    }

    /// Selects an episode. All pages receive what is wrong with it, if anything is, as the error of its simulation.
    ///
    /// # Errors
    /// The script has no such suite or task, or there is no such policy.
    fn select(&self, selection: Selection) -> Result<(), String> {
        let checked = self.menu.lock().unwrap_or_else(PoisonError::into_inner).check(&selection);
        // The thread that simulates ends with the program only.
        let _ = self.selections.send(selection);
        checked
    }
}

impl Access {
    fn has_token(&self, query: &str) -> bool {
        let given = query.split('&').find_map(|pair| pair.strip_prefix("token="));
        // The time of the comparison does not depend on the first difference.
        given.is_some_and(|given| {
            given.len() == self.token.len()
                && given.bytes().zip(self.token.bytes()).fold(0, |bits, (a, b)| bits | (a ^ b)) == 0
        })
    }

    /// True if the request names this server as its host, and as its origin if it has one.
    fn is_own_page(&self, request: &Request) -> bool {
        let value = |name: &'static str| {
            let header = request.headers().iter().find(|header| header.field.equiv(name));
            header.map(|header| header.value.as_str().to_owned())
        };
        let port = self.address.port();
        let own = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{port}"));
        let is_own = |host: &str| own.iter().any(|name| name == host);
        let origin_is_own =
            value("Origin").is_none_or(|origin| origin.strip_prefix("http://").is_some_and(is_own));
        origin_is_own && value("Host").is_some_and(|host| is_own(&host))
    }
}

/// Sends the feed over a websocket until the page closes.
fn send_feed(request: Request, feed: &Feed) {
    let key = request.headers().iter().find(|header| header.field.equiv("Sec-WebSocket-Key"));
    let Some(key) = key.map(|header| header.value.as_str().to_owned()) else {
        return respond(request, 400, "expected a websocket\n");
    };
    let accept = derive_accept_key(key.as_bytes());
    let response = Response::empty(101)
        .with_header(header("Upgrade", "websocket"))
        .with_header(header("Connection", "Upgrade"))
        .with_header(header("Sec-WebSocket-Accept", &accept));
    let stream = request.upgrade("websocket", response);
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, None);
    let (mut place, _viewer) = (Place::default(), feed.enter());
    while !cancel::requested() {
        let message = match feed.next(place) {
            Some((message, next)) => {
                place = next;
                WebsocketMessage::binary(message.as_slice().to_vec())
            }
            // Shows whether the page is still open.
            None => WebsocketMessage::Ping(Default::default()),
        };
        if socket.send(message).is_err() {
            return;
        }
    }
}

/// The content of a request.
///
/// # Errors
/// It is too long, or no such JSON object.
fn read_json<T: DeserializeOwned>(request: &mut Request) -> Result<T, String> {
    let mut text = String::new();
    let read = request.as_reader().take(MAX_REQUEST).read_to_string(&mut text);
    read.map_err(|error| error.to_string())?;
    // A list would be read as the fields in their order.
    let object: Map<String, Value> = serde_json::from_str(&text).map_err(|error| error.to_string())?;
    serde_json::from_value(Value::Object(object)).map_err(|error| error.to_string())
}

fn header(name: &str, value: &str) -> Header {
    Header::from_bytes(name, value).unwrap_or_else(|()| unreachable!("the headers are ASCII"))
}

fn respond(request: Request, status: u16, text: &str) {
    // The page may have closed.
    let _ = request.respond(Response::from_string(text).with_status_code(status));
}

fn respond_to_post(request: Request, done: Result<(), String>) {
    match done {
        Ok(()) => respond(request, 200, ""),
        Err(problem) => respond(request, 400, &format!("{problem}\n")),
    }
}

fn respond_with_file(request: Request, file: PageFile) {
    let policy = "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'";
    let response = Response::from_data(file.content)
        .with_header(header("Content-Type", file.kind))
        .with_header(header("Content-Security-Policy", policy))
        .with_header(header("Cache-Control", "no-cache"));
    let _ = request.respond(response);
}
