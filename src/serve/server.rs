//! Where clients come in: an address, a bounded number of seats, a thread for each client.

use std::{
    io::{self, Read, Write},
    net::{Shutdown, SocketAddr, TcpListener, TcpStream},
    panic::{AssertUnwindSafe, catch_unwind},
    sync::atomic::{AtomicBool, AtomicUsize, Ordering},
    thread,
    time::{Duration, Instant},
};

use rmpv::Value;

use super::{
    catalog::ServerConfig,
    connection::{Connection, HANDSHAKE_TIMEOUT, Incoming, POLL_INTERVAL, is_wait},
    request::Request,
    response,
    session::Session,
};

/// Between two looks whether somebody stands at the door.
const ACCEPT_POLL_INTERVAL: Duration = Duration::from_millis(10);
/// Connections beyond the seats, of which nobody knows yet what they want.
const BACKLOG: usize = 16;
/// What is asked to learn whether the server is there, and what it says.
const HEALTH: &[u8] = b"GET /healthz";
const HEALTHY: &[u8] =
    b"HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\nContent-Length: 3\r\nConnection: close\r\n\r\nOK\n";

/// An address where clients are heard.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
}

impl Server {
    /// Takes an address; port 0 is any that is free.
    ///
    /// # Errors
    /// It is none of this machine's, or somebody has it.
    pub fn open(host: &str, port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind((host, port))?;
        listener.set_nonblocking(true)?;
        Ok(Self { listener })
    }

    /// The address.
    ///
    /// # Errors
    /// The system does not say.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }
}

/// What all visitors share.
struct ServerState<'a> {
    offer: &'a ServerConfig<'a>,
    hello: Value,
    seats: usize,
    seated: AtomicUsize,
    stop: &'a AtomicBool,
}

/// Serves `seats` clients at once until `stop` is set; `hello` is what each is told first.
pub fn serve(door: &Server, offer: &ServerConfig, hello: Value, seats: usize, stop: &AtomicBool) {
    let house = ServerState { offer, hello, seats, seated: AtomicUsize::new(0), stop };
    let inside = AtomicUsize::new(0);
    thread::scope(|scope| {
        while !stop.load(Ordering::Relaxed) {
            // Whoever was at the door may be gone again, and the system may be short of handles: both pass.
            let Ok((stream, _)) = door.listener.accept() else {
                thread::sleep(ACCEPT_POLL_INTERVAL);
                continue;
            };
            let Some(counted) = SlotGuard::one_of(&inside, seats + BACKLOG) else { continue };
            let house = &house;
            let visit = move || {
                let _counted = counted;
                let _ = catch_unwind(AssertUnwindSafe(|| visit(stream, house)));
            };
            // Without a thread for it the connection closes.
            let _ = thread::Builder::new().name("client".to_owned()).spawn_scoped(scope, visit);
        }
    });
}

/// One of those that are counted, until it goes.
struct SlotGuard<'a>(&'a AtomicUsize);

impl<'a> SlotGuard<'a> {
    fn one_of(count: &'a AtomicUsize, most: usize) -> Option<Self> {
        let taken = count.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| (n < most).then_some(n + 1));
        taken.is_ok().then_some(Self(count))
    }
}

impl Drop for SlotGuard<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Everything between a connection's beginning and its end. What goes wrong with it is its own.
fn visit(stream: TcpStream, house: &ServerState) {
    let prepared = stream
        .set_nonblocking(false)
        .and_then(|()| stream.set_nodelay(true))
        .and_then(|()| stream.set_read_timeout(Some(POLL_INTERVAL)))
        .and_then(|()| stream.set_write_timeout(Some(POLL_INTERVAL)));
    if prepared.is_err() {
        return;
    }
    match asks_for_health(&stream, house.stop) {
        None => return,
        Some(true) => return say_healthy(stream),
        Some(false) => {}
    }
    let mut seat = None;
    let full = || {
        seat = SlotGuard::one_of(&house.seated, house.seats);
        let why = || format!("the server has {} clients, and no seat is free (--threads)\n", house.seats);
        seat.is_none().then(why)
    };
    if let Ok(link) = Connection::accept(stream, house.stop, full) {
        converse(link, house);
    }
}

/// Whether a connection begins with a question after health; `None` if nothing comes.
fn asks_for_health(stream: &TcpStream, stop: &AtomicBool) -> Option<bool> {
    let deadline = Instant::now() + HANDSHAKE_TIMEOUT;
    let mut begun = [0; HEALTH.len() + 1];
    while Instant::now() < deadline && !stop.load(Ordering::Relaxed) {
        match stream.peek(&mut begun) {
            Ok(0) => return None,
            Ok(count) if count == begun.len() => {
                return Some(begun.starts_with(HEALTH) && b" ?".contains(&begun[HEALTH.len()]));
            }
            // Another beginning is no question after health however it goes on.
            Ok(count) if !HEALTH.starts_with(&begun[..count.min(HEALTH.len())]) => return Some(false),
            Ok(_) => thread::sleep(ACCEPT_POLL_INTERVAL),
            Err(error) if is_wait(&error) => {}
            Err(_) => return None,
        }
    }
    None
}

fn say_healthy(mut stream: TcpStream) {
    let _ = stream.write_all(HEALTHY).and_then(|()| stream.shutdown(Shutdown::Write));
    // What has not been read would make the system throw the answer away.
    let deadline = Instant::now() + Duration::from_secs(1);
    let mut rest = [0; 1024];
    while Instant::now() < deadline && !matches!(stream.read(&mut rest), Ok(0)) {}
}

/// Answers one message after another.
fn converse(mut link: Connection, house: &ServerState) {
    if link.say(&house.hello).is_err() {
        return;
    }
    let mut session = Session::new(house.offer, house.stop);
    loop {
        let (answer, last) = match link.hear() {
            Incoming::Closed => return link.close(),
            Incoming::Lost(why) => (response::error(&why), true),
            Incoming::Nonsense(why) => (response::error(&why), false),
            Incoming::Message(message) => respond(&mut session, house.offer, &message),
        };
        if link.say(&answer).is_err() {
            return;
        }
        if last {
            return link.close();
        }
    }
}

/// The answer to a message, and whether it is the last.
fn respond(session: &mut Session, offer: &ServerConfig, message: &Value) -> (Value, bool) {
    let request = match Request::read(message, offer) {
        Ok(request) => request,
        Err(why) => return (response::error(&why), false),
    };
    let last = request == Request::Close;
    match catch_unwind(AssertUnwindSafe(|| session.answer(request))) {
        Ok(Ok(answer)) => (answer, last),
        Ok(Err(why)) => (response::error(&why), false),
        Err(_) => {
            session.forget();
            (response::error("internal error of the server; the episode is lost: reset"), false)
        }
    }
}
