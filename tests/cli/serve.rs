//! `softvt serve`: invalid or silent clients get an error or are dropped, and the others are served.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::{Shutdown, TcpListener, TcpStream},
    process::{Child, ChildStdout, Command, Stdio},
    time::Duration,
};

use assert_cmd::cargo::cargo_bin;
use rmpv::Value;
use tungstenite::{Error, Message, WebSocket};

use crate::support::{CliOutput, Project, Small};

/// A server that ends with the test.
pub struct Server {
    child: Child,
    output: BufReader<ChildStdout>,
    address: String,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Server {
    pub fn start(project: &Project, words: &str) -> Self {
        let mut child = Command::new(cargo_bin!("softvt"))
            .current_dir(project.path(""))
            .args(["serve", "x.lua", "--port", "0"])
            .args(words.split_whitespace())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("started");
        let mut line = String::new();
        let mut output = BufReader::new(child.stdout.take().expect("an output"));
        output.read_line(&mut line).expect("a line");
        let address = line.trim().strip_prefix("ws://").unwrap_or_else(|| panic!("no address: {line:?}"));
        Self { address: address.to_owned(), child, output }
    }

    fn stream(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.address).expect("connected");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("set");
        stream
    }

    /// A connected client, and the hello message.
    pub fn client(&self) -> (Client, Value) {
        let (socket, _) =
            tungstenite::client(format!("ws://{}", self.address), self.stream()).expect("shaken hands");
        let mut client = Client(socket);
        let hello = client.hear();
        assert_eq!(text(&hello, "type"), "hello");
        (client, hello)
    }

    /// Closes the standard input of the server.
    pub fn close_stdin(&mut self) {
        drop(self.child.stdin.take());
    }

    /// Ends the server by Ctrl-C, and returns what it printed after its address.
    #[cfg(unix)]
    pub fn interrupt(self) -> CliOutput {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill runs").success());
        self.wait()
    }

    /// Waits until the server has ended, and returns what it printed after its address.
    pub fn wait(mut self) -> CliOutput {
        let (mut out, mut err) = (String::new(), String::new());
        self.output.read_to_string(&mut out).expect("text");
        self.child.stderr.take().expect("messages").read_to_string(&mut err).expect("text");
        let code = self.child.wait().expect("ended").code().unwrap_or(-1);
        CliOutput { code, out, err }
    }

    fn healthy(&self) -> bool {
        let mut stream = self.stream();
        stream.write_all(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n").expect("asked");
        let mut output = String::new();
        stream.read_to_string(&mut output).expect("answered");
        output.starts_with("HTTP/1.1 200 OK\r\n") && output.ends_with("\r\n\r\nOK\n")
    }
}

pub struct Client(WebSocket<TcpStream>);

impl Client {
    fn hear(&mut self) -> Value {
        match self.0.read().expect("an answer") {
            Message::Binary(bytes) => rmpv::decode::read_value(&mut &bytes[..]).expect("msgpack"),
            other => panic!("not a message: {other:?}"),
        }
    }

    fn send(&mut self, value: &Value) {
        let mut bytes = Vec::new();
        rmpv::encode::write_value(&mut bytes, value).expect("packed");
        self.0.send(Message::binary(bytes)).expect("sent");
    }

    pub fn ask(&mut self, value: &Value) -> Value {
        self.send(value);
        self.hear()
    }

    /// The error message of a response.
    fn refused(&mut self, value: &Value) -> String {
        let answer = self.ask(value);
        assert_eq!(text(&answer, "type"), "error", "{value} is answered");
        text(&answer, "error").to_owned()
    }

    fn reset(&mut self) -> Value {
        let answer = self.ask(&reset(0));
        assert_eq!(text(&answer, "type"), "reset", "{answer}");
        answer
    }
}

pub fn map(entries: &[(&str, Value)]) -> Value {
    Value::Map(entries.iter().map(|(key, value)| (Value::from(*key), value.clone())).collect())
}

pub fn of(kind: &str) -> Value {
    map(&[("type", kind.into())])
}

fn reset(episode: u64) -> Value {
    map(&[("type", "reset".into()), ("task", 0.into()), ("episode", episode.into())])
}

/// An array as Python clients encode it.
pub fn array(shape: &[usize], numbers: &[f64]) -> Value {
    let key = |name: &str| Value::Binary(name.as_bytes().to_vec());
    Value::Map(vec![
        (key("__ndarray__"), true.into()),
        (key("data"), Value::Binary(numbers.iter().flat_map(|x| x.to_le_bytes()).collect())),
        (key("dtype"), "<f8".into()),
        (key("shape"), Value::Array(shape.iter().map(|n| Value::from(*n)).collect())),
    ])
}

const ACTION: [f64; 7] = [0.45, 0.05, 0.3, 3.1, 0.0, 0.0, 0.3];

fn step(times: usize) -> Value {
    map(&[("type", "step".into()), ("actions", array(&[times, 7], &ACTION.repeat(times)))])
}

pub fn get<'a>(value: &'a Value, name: &str) -> &'a Value {
    let entries = value.as_map().unwrap_or_else(|| panic!("no map: {value}"));
    let found = entries.iter().find(|(key, _)| key.as_str() == Some(name));
    &found.unwrap_or_else(|| panic!("no {name} in {value}")).1
}

fn text<'a>(value: &'a Value, name: &str) -> &'a str {
    get(value, name).as_str().expect("text")
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_map().expect("a map").iter().filter_map(|(key, _)| key.as_str()).collect()
}

fn project() -> Project {
    Small { task: "budget_steps = 12", ..Small::default() }.project()
}

#[test]
fn a_client_runs_an_episode_to_its_end() {
    let project = project();
    let server = Server::start(&project, "--profile vision");
    let (mut client, hello) = server.client();
    let task = &get(&get(&hello, "suites").as_array().expect("a list")[0], "tasks")[0];
    assert_eq!((text(task, "prompt"), get(task, "budget_steps").as_u64()), ("wait", Some(12)));
    assert_eq!(keys(get(&hello, "observation_space")), ["image", "wrist_image", "state", "prompt"]);
    assert_eq!(get(&hello, "privileged").as_bool(), Some(false));
    let start = client.reset();
    assert_eq!(keys(get(&start, "observation")), ["image", "wrist_image", "state", "prompt"]);
    let mut info = keys(get(&start, "info"));
    info.sort_unstable();
    assert_eq!(info, ["clamped_grips", "episode", "far_commands", "step", "success", "task", "time_s"]);
    let middle = client.ask(&step(11));
    assert_eq!(get(&middle, "truncated").as_bool(), Some(false));
    assert_eq!(get(get(&middle, "info"), "carried_out").as_u64(), Some(11));
    let end = client.ask(&step(5));
    assert_eq!(get(get(&end, "info"), "carried_out").as_u64(), Some(1), "the budget ends it");
    assert_eq!(
        (get(&end, "truncated").as_bool(), get(&end, "terminated").as_bool()),
        (Some(true), Some(false))
    );
    assert_eq!(get(&end, "reward").as_f64(), Some(0.0));
    let record = get(get(&end, "info"), "record");
    assert_eq!(keys(record), ["goal", "outcome", "steps"], "no hidden state is sent");
    assert!(client.refused(&step(1)).contains("the episode is over"));
    assert_eq!(client.reset(), start, "the same start again");
    assert_eq!(text(&client.ask(&of("close")), "type"), "close");
    assert!(client.0.read().is_ok_and(|m| m.is_close()));
}

#[test]
fn a_server_ends_with_its_standard_input_if_asked_to() {
    let project = project();
    let mut server = Server::start(&project, "--profile vision --until-stdin-closes");
    server.client().0.reset();
    server.close_stdin();
    let output = server.wait();
    assert_eq!((output.code, output.out.as_str()), (0, ""), "{}", output.err);
    assert!(!output.err.contains("interrupt"), "{}", output.err);

    let mut other = Server::start(&project, "--profile vision");
    other.close_stdin();
    std::thread::sleep(Duration::from_millis(300));
    other.client().0.reset();
}

#[test]
fn info_counts_commands_out_of_reach_and_grip_values_out_of_range() {
    let project = project();
    let server = Server::start(&project, "--profile vision");
    let (mut client, _) = server.client();
    client.reset();
    client.ask(&step(2));
    let far = [500.0, 4.0, 260.0, 0.0, 0.0, 0.0, 255.0];
    let after = client.ask(&map(&[("type", "step".into()), ("actions", array(&[3, 7], &far.repeat(3)))]));
    let count = |name| get(get(&after, "info"), name).as_u64();
    assert_eq!((count("step"), count("far_commands"), count("clamped_grips")), (Some(5), Some(3), Some(3)));
}

#[test]
fn privileged_clients_receive_the_true_state() {
    let project = project();
    let server = Server::start(&project, "--profile vision --privileged --seed 3 --split demonstration");
    let (mut client, hello) = server.client();
    assert_eq!((get(&hello, "seed").as_u64(), text(&hello, "split")), (Some(3), "demonstration"));
    client.reset();
    let info = get(&client.ask(&step(12)), "info").clone();
    let objects = get(get(&info, "state"), "objects").as_array().expect("a list").clone();
    assert_eq!(text(&objects[0], "name"), "cube");
    assert!(get(get(&info, "state"), "pad_force_n").is_array());
    assert!(get(get(&info, "verdict"), "d_peak").is_f64());
    let record = get(&info, "record");
    assert_eq!((text(record, "split"), text(get(record, "outcome"), "kind")), ("demonstration", "budget"));
    assert_eq!(get(record, "seed").as_u64(), Some(3));
}

#[test]
fn invalid_requests_keep_the_connection_open() {
    let project = project();
    let server = Server::start(&project, "--profile vision");
    let (mut client, _) = server.client();
    for kind in ["get_state", "render"] {
        assert!(client.refused(&of(kind)).contains("reset first"), "{kind}");
    }
    assert!(client.refused(&step(1)).contains("reset first"));
    let start = client.reset();
    let stepping = |value: Value| map(&[("type", "step".into()), ("action", value)]);
    let resetting = |name: &str, value: Value| {
        let all = [("type", "reset".into()), ("task", 0.into()), ("episode", 0.into())];
        let mut all: Vec<(&str, Value)> = all.into_iter().filter(|(key, _)| *key != name).collect();
        all.push((name, value));
        map(&all)
    };
    let mut nan = ACTION;
    nan[2] = f64::NAN;
    let long = "x".repeat(100_000);
    for (request, words) in [
        (Value::from(7), "is a number; expected a map"),
        (map(&[]), "has no type"),
        (map(&[("type", 5.into())]), "the type is a number"),
        (of("fly"), "type \"fly\" is unknown"),
        (of(&long), "is unknown"),
        (stepping(array(&[6], &ACTION[..6])), "shape [6]"),
        (stepping(array(&[2, 3, 7], &ACTION.repeat(6))), "shape [2, 3, 7]"),
        (stepping(array(&[0, 7], &[])), "empty"),
        (stepping(array(&[1001, 7], &ACTION.repeat(1001))), "up to 1000"),
        (stepping(array(&[7], &nan)), "not finite"),
        (stepping(array(&[7], &[f64::INFINITY; 7])), "not finite"),
        (stepping(array(&[9], &ACTION)), "with 56 bytes"),
        (stepping("left".into()), "are text"),
        (of("step"), "neither action nor actions"),
        (resetting("task", 5.into()), "has the tasks 0 to 0"),
        (resetting("task", "x".into()), "task is \"x\"; expected a whole number"),
        (resetting("task", Value::Nil), "missing field task"),
        (resetting("episode", (-1).into()), "episode is -1"),
        (resetting("episode", 1.5.into()), "episode is 1.5"),
        (resetting("suite", "two".into()), "suite \"two\" is not served; available: one"),
        (resetting("split", "test".into()), "expected validation, demonstration, experiment"),
        (resetting("epsiode", 1.into()), "no field \"epsiode\""),
        (map(&[("type", "render".into()), ("camera", "nose".into())]), "there is no camera \"nose\""),
        (map(&[("type", "render".into()), ("width", 60_000.into())]), "width"),
        (map(&[("type", "render".into()), ("camera", "left".into()), ("width", 5.into())]), "one size"),
        (map(&[("type", "set_state".into()), ("state", Value::Nil)]), "missing field state"),
        (
            map(&[("type", "set_state".into()), ("state", map(&[("task", 0.into())]))]),
            "missing field actions",
        ),
    ] {
        let output = client.refused(&request);
        assert!(output.contains(words) && output.len() < 500, "{words}: {output}");
    }
    let after = client.ask(&step(1));
    assert_eq!(get(get(&after, "info"), "step").as_u64(), Some(1), "nothing was carried out before");
    assert_eq!(client.reset(), start);
}

#[test]
fn malformed_messages_are_reported() {
    let project = project();
    let server = Server::start(&project, "--profile vision");
    let (mut client, _) = server.client();
    let mut behind = Vec::new();
    rmpv::encode::write_value(&mut behind, &of("get_state")).expect("packed");
    behind.push(0);
    for (message, words) in [
        (Message::text("{\"type\": \"reset\"}"), "text frame"),
        (Message::binary(vec![0xC1; 40]), "39 bytes follow"),
        (Message::binary(vec![0xDD, 0xFF, 0xFF, 0xFF, 0xFF]), "not msgpack"),
        (Message::binary(vec![0x91; 5000]), "not msgpack"),
        (Message::binary(Vec::new()), "not msgpack"),
        (Message::binary(behind), "1 bytes follow"),
    ] {
        client.0.send(message).expect("sent");
        let answer = client.hear();
        assert!(text(&answer, "error").contains(words), "{words}: {answer}");
    }
    client.reset();
    // Ten megabytes are refused before they are read, and the connection is closed.
    let _ = client.0.send(Message::binary(vec![0; 10 << 20]));
    let answer = client.hear();
    assert!(text(&answer, "error").contains("longer than 4 MiB"), "{answer}");
    assert!(client.0.read().is_ok_and(|message| message.is_close()), "nothing behind it would be understood");
    server.client().0.reset();
}

#[test]
fn silent_clients_do_not_block_others() {
    let project = project();
    let server = Server::start(&project, "--profile vision --threads 2");
    let mut silent: Vec<TcpStream> = (0..3).map(|_| server.stream()).collect();
    silent[1].write_all(b"GET / HTTP/1.1\r\nUpgrade: webs").expect("half a greeting");
    silent[2].write_all(&[0x16, 0x03, 0x01, 0x00, 0xFF]).expect("another protocol's");
    assert!(server.healthy(), "while others are silent");
    for _ in 0..4 {
        let (mut client, _) = server.client();
        client.send(&reset(1));
        client.0.get_ref().shutdown(Shutdown::Both).expect("gone");
        // The slot of a lost client is released when its last request is finished.
        std::thread::sleep(Duration::from_millis(1500));
    }
    let (mut first, _) = server.client();
    first.reset();
    let (second, _) = server.client();
    assert!(server.healthy(), "with all seats taken");
    let full = tungstenite::client(format!("ws://{}", server.address), server.stream());
    match full {
        Err(tungstenite::HandshakeError::Failure(Error::Http(response))) => {
            assert_eq!(response.status().as_u16(), 503);
        }
        other => panic!("{other:?}"),
    }
    drop(second);
    std::thread::sleep(Duration::from_millis(500));
    server.client().0.reset();
    assert_eq!(get(get(&first.ask(&step(2)), "info"), "step").as_u64(), Some(2), "the first did not notice");
}

/// Status of a handshake with these headers besides those of every websocket.
fn handshake(server: &Server, headers: &[(&str, &str)]) -> u16 {
    let uri = format!("ws://{}", server.address).parse().expect("an address");
    let mut request = tungstenite::client::IntoClientRequest::into_client_request(
        tungstenite::ClientRequestBuilder::new(uri),
    )
    .expect("a request");
    for (name, value) in headers {
        let name = tungstenite::http::HeaderName::try_from(*name).expect("a name");
        request.headers_mut().insert(name, value.parse().expect("a value"));
    }
    match tungstenite::client(request, server.stream()) {
        Ok((_, response)) => response.status().as_u16(),
        Err(tungstenite::HandshakeError::Failure(Error::Http(response))) => response.status().as_u16(),
        Err(other) => panic!("{other:?}"),
    }
}

#[test]
fn a_refused_client_takes_no_seat_and_releases_none() {
    let project = project();
    let server = Server::start(&project, "--profile vision --threads 1");
    let (first, _) = server.client();
    for _ in 0..3 {
        assert_eq!(handshake(&server, &[]), 503, "the only seat is taken");
    }
    drop(first);
    std::thread::sleep(Duration::from_millis(500));
    let (mut second, _) = server.client();
    assert_eq!(handshake(&server, &[]), 503, "the limit still holds");
    second.reset();
    drop(second);
    std::thread::sleep(Duration::from_millis(500));
    // More connections than the server accepts at a time, none of which says anything.
    let silent: Vec<TcpStream> = (0..80).map(|_| server.stream()).collect();
    std::thread::sleep(Duration::from_millis(500));
    let (mut refused, mut output) = (server.stream(), Vec::new());
    // The server does not wait for the request, and resets the connection.
    let _ = refused.write_all(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n");
    let _ = refused.read_to_end(&mut output);
    assert!(output.starts_with(b"HTTP/1.1 503 "), "{:?}", String::from_utf8_lossy(&output));
    drop(silent);
    std::thread::sleep(Duration::from_millis(500));
    for _ in 0..3 {
        assert!(server.healthy());
        server.client().0.reset();
        std::thread::sleep(Duration::from_millis(300));
    }
}

#[test]
fn web_pages_and_clients_without_the_token_are_refused() {
    let project = project();
    let server = Server::start(&project, "--profile vision");
    let own = format!("http://{}", server.address);
    for (headers, status) in [
        (vec![], 101),
        (vec![("origin", own.as_str())], 101),
        (vec![("origin", "https://evil.example")], 403),
        (vec![("origin", "null")], 403),
        (vec![("origin", "http://localhost:3000")], 403),
        (vec![("host", "evil.example")], 403),
        (vec![("host", "evil.example"), ("origin", "http://evil.example")], 403),
    ] {
        assert_eq!(handshake(&server, &headers), status, "{headers:?}");
    }
    let server = Server::start(&project, "--profile vision --token s3cret");
    for (headers, status) in [
        (vec![], 401),
        (vec![("authorization", "Bearer other")], 401),
        (vec![("authorization", "Bearer s3cret")], 101),
        (vec![("authorization", "Bearer s3cret"), ("origin", "null")], 403),
    ] {
        assert_eq!(handshake(&server, &headers), status, "{headers:?}");
    }
    assert!(project.refusal("serve x.lua --token").contains("--token"));
}

#[cfg(target_os = "linux")]
#[test]
fn images_of_any_size_do_not_fill_the_memory() {
    let project = project();
    let server = Server::start(&project, "--profile vision");
    let resident_mib = || {
        let status =
            std::fs::read_to_string(format!("/proc/{}/status", server.child.id())).expect("a process");
        let line = status.lines().find(|line| line.starts_with("VmHWM:")).expect("a line");
        line.split_whitespace().nth(1).and_then(|kib| kib.parse::<u64>().ok()).expect("a number") >> 10
    };
    let (mut client, _) = server.client();
    client.reset();
    let render = |width: u64, height: u64| {
        map(&[("type", "render".into()), ("width", width.into()), ("height", height.into())])
    };
    for (width, height) in [(4096, 4096), (1920, 1081), (60_000, 1), (1, 60_000)] {
        let message = client.refused(&render(width, height));
        assert!(message.contains("render"), "{message}");
    }
    assert_eq!(text(&client.ask(&render(300, 300)), "type"), "render");
    let before = resident_mib();
    for size in 301..321 {
        assert_eq!(text(&client.ask(&render(size, 300)), "type"), "render");
    }
    // The backgrounds of twenty sizes would take 230 MiB.
    assert!(resident_mib() < before + 60, "{before} MiB before, {} MiB after", resident_mib());
}

#[test]
fn restored_states_are_byte_identical() {
    let project = project();
    let server = Server::start(&project, "--profile visuo_tactile --privileged");
    let (mut client, _) = server.client();
    client.reset();
    client.ask(&step(3));
    let state = get(&client.ask(&of("get_state")), "state").clone();
    assert_eq!(get(&state, "episode").as_u64(), Some(0));
    let straight = client.ask(&step(4));
    let back = map(&[("type", "set_state".into()), ("state", state)]);
    let copied = client.ask(&back);
    assert_eq!(get(get(&copied, "info"), "step").as_u64(), Some(3));
    assert_eq!(client.ask(&step(4)), straight, "by a copy");
    let (mut other, _) = server.client();
    assert_eq!(other.ask(&back), copied, "by simulating again");
    assert_eq!(other.ask(&step(4)), straight, "what follows");
    let changed = Server::start(&project, "--profile visuo_tactile --set robot.gripper.effort=20");
    let output = changed.client().0.refused(&back);
    assert!(output.contains("settings or version differ"), "{output}");
    let changed = Server::start(&project, "--profile libero");
    let output = changed.client().0.refused(&back);
    assert!(output.contains("another profile or gripper"), "{output}");
}

#[test]
fn images_have_the_requested_size() {
    let project = project();
    let server = Server::start(&project, "--profile vision");
    let (mut client, _) = server.client();
    client.reset();
    let mut shape = |entries: &[(&str, Value)]| {
        let all: Vec<_> = [("type", Value::from("render"))].into_iter().chain(entries.to_vec()).collect();
        let answer = client.ask(&map(&all));
        let image = get(&answer, "image").as_map().expect("an array").to_vec();
        let found = image.iter().find(|(key, _)| key.as_slice() == Some(b"shape")).expect("a shape");
        found.1.as_array().expect("a list").iter().filter_map(Value::as_u64).collect::<Vec<_>>()
    };
    assert_eq!(shape(&[]), [224, 224, 3]);
    assert_eq!(
        shape(&[("camera", "wrist".into()), ("width", 64.into()), ("height", 48.into())]),
        [48, 64, 3]
    );
    assert_eq!(shape(&[("camera", "right".into())]), [240, 320, 3]);
}

#[test]
fn invalid_servers_are_refused() {
    let project = project();
    project.write(
        "e.lua",
        b"return softvt.experiment { name = \"e\", points = function() return {} end, run = function() end }",
    );
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port();
    for (words, expected) in [
        (format!("serve x.lua --port {port}"), "already in use at 127.0.0.1"),
        ("serve e.lua".to_owned(), "softvt serve needs a suite"),
        ("serve x.lua --policy noop".to_owned(), "--policy: the client of softvt serve is the policy"),
        ("serve x.lua --port 70000".to_owned(), "70000"),
        ("serve x.lua --host 192.0.2.7 --port 0".to_owned(), "cannot listen on this address"),
        ("serve x.lua --split test".to_owned(), "expected validation"),
        ("serve x.lua --shift warp=1 --port 0".to_owned(), "unknown shift \"warp\""),
        ("serve x.lua --profile pi".to_owned(), "visuo_tactile"),
    ] {
        let message = project.refusal(&words);
        assert!(message.contains(expected), "{words}: {message}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_closes_the_server() {
    let project = project();
    let mut server = Server::start(&project, "--profile vision");
    let (mut client, _) = server.client();
    client.reset();
    let id = server.child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill runs").success());
    assert!(client.0.read().is_ok_and(|m| m.is_close()), "clients get a close frame");
    let code = server.child.wait().expect("ended").code();
    let mut err = String::new();
    server.child.stderr.take().expect("messages").read_to_string(&mut err).expect("text");
    assert_eq!(code, Some(130), "{err}");
    assert!(!err.contains("panicked") && !err.contains("did not finish"), "{err}");
    assert!(!err.contains("interrupted") && !err.contains("finishing"), "nothing is lost: {err}");
}
