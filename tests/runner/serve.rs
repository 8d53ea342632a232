//! Servers of episodes: invalid or silent clients get an error or are dropped, and the others are served.

use std::{
    io::{Read, Write},
    net::{Shutdown, TcpStream},
    sync::{
        Arc,
        mpsc::{self, Receiver, RecvTimeoutError, Sender},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use rmpv::Value;
use softvt::{
    cancel::CancelFlag,
    episode_id::EpisodeSplit,
    runner::{PolicyConfig, PolicyOptions, RunConfig, RunError, SuiteServer},
    runs::summary::SuiteSummary,
    serve::{self, AccessRules},
};
use tungstenite::{Error, Message};

use crate::support::{
    Messages, Project, Run, Small, assert_contains,
    client::{Client, array, get, map, reset, stream, text},
};

/// Rules for the clients of a server.
#[derive(Clone)]
pub struct Access {
    pub split: EpisodeSplit,
    pub is_privileged: bool,
    pub max_clients: usize,
    pub token: Option<String>,
}

impl Default for Access {
    fn default() -> Self {
        Self { split: EpisodeSplit::Validation, is_privileged: false, max_clients: 8, token: None }
    }
}

/// A server on a thread, which ends with the test.
pub struct Server {
    pub address: String,
    /// The server ends when it is dropped.
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<Result<Vec<SuiteSummary>, RunError>>>,
    messages: Arc<Messages>,
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Server {
    /// Serves a run until its end.
    fn serve(
        config: RunConfig,
        policy: &PolicyOptions,
        access: Access,
        started: &Sender<String>,
        stop: Receiver<()>,
    ) -> Result<Vec<SuiteSummary>, RunError> {
        let policy = PolicyConfig::client(policy, access.is_privileged)?;
        let run = config.with_policy(policy).load()?;
        let listener = serve::listen("127.0.0.1", 0).expect("a port");
        let address = listener.local_addr().expect("an address");
        let cancel: Arc<CancelFlag> = Arc::default();
        let server = SuiteServer {
            listener,
            access: AccessRules::new("127.0.0.1", address, access.token),
            split: access.split,
            max_clients: access.max_clients,
            cancel: cancel.clone(),
        };
        let has_folder = run.config.out.is_some();
        let (summaries, outcome) = server.serve(&run, || -> Result<(), RunError> {
            started.send(address.to_string()).expect("awaited");
            thread::spawn(move || {
                let goes_on =
                    || stop.recv_timeout(Duration::from_millis(10)) == Err(RecvTimeoutError::Timeout);
                while !cancel.requested() && goes_on() {}
                cancel.request();
            });
            Ok(())
        })?;
        if has_folder { outcome.map(|()| summaries) } else { Ok(Vec::new()) }
    }

    /// A server of a run, or the message of its error.
    pub fn try_start(run: &Run, access: Access) -> Result<Self, String> {
        let (config, policy, messages) = (run.config.clone(), run.policy.clone(), run.messages.clone());
        let ((started, address), (stop, stopped)) = (mpsc::channel(), mpsc::channel());
        let thread = thread::spawn(move || Self::serve(config, &policy, access, &started, stopped));
        match address.recv() {
            Ok(address) => Ok(Self { address, stop: Some(stop), thread: Some(thread), messages }),
            Err(_) => Err(run.project.message(thread.join().expect("it ends"))),
        }
    }

    /// A server of the suite `x.lua` of a project by the profile `vision`.
    pub fn start(run: &Run) -> Self {
        Self::with(run, Access::default())
    }

    pub fn with(run: &Run, access: Access) -> Self {
        Self::try_start(run, access).unwrap_or_else(|message| panic!("{message}"))
    }

    /// A connected client, and the hello message.
    pub fn client(&self) -> (Client, Value) {
        Client::connect(&self.address)
    }

    /// Ends the server. Returns the results of the runs that it recorded, and its messages.
    pub fn finish(mut self) -> (Vec<SuiteSummary>, String) {
        self.stop = None;
        let thread = self.thread.take().expect("it runs");
        let summaries = thread.join().expect("it ends").unwrap_or_else(|error| panic!("{error}"));
        (summaries, self.messages.text())
    }

    /// Waits for a message of the server.
    pub fn wait_for(&self, message: &str) {
        wait_until(message, || self.messages.text().contains(message));
    }

    /// The answer to a health check.
    fn health(&self) -> String {
        let (mut stream, mut output) = (stream(&self.address), Vec::new());
        // A full server does not wait for the request, and resets the connection.
        let _ = stream.write_all(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n");
        let _ = stream.read_to_end(&mut output);
        String::from_utf8(output).expect("text")
    }

    fn is_healthy(&self) -> bool {
        let output = self.health();
        output.starts_with("HTTP/1.1 200 OK\r\n") && output.ends_with("\r\n\r\nOK\n")
    }
}

/// Waits until something holds.
fn wait_until(what: &str, holds: impl Fn() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while !holds() {
        assert!(Instant::now() < deadline, "{what}");
        thread::sleep(Duration::from_millis(10));
    }
}

pub fn of(kind: &str) -> Value {
    map(&[("type", kind.into())])
}

const ACTION: [f64; 7] = [0.45, 0.05, 0.3, 3.1, 0.0, 0.0, 0.3];

fn step(times: usize) -> Value {
    crate::support::client::step(&vec![ACTION; times])
}

fn keys(value: &Value) -> Vec<&str> {
    value.as_map().expect("a map").iter().filter_map(|(key, _)| key.as_str()).collect()
}

fn project() -> Project {
    Small { task: "budget_steps = 12", ..Small::default() }.project()
}

/// The suite of a project by the profile `vision`.
fn vision(project: &Project) -> Run<'_> {
    project.run("x.lua").profile("vision")
}

#[test]
fn a_client_runs_an_episode_to_its_end() {
    let project = project();
    let server = Server::start(&vision(&project));
    let (mut client, hello) = server.client();
    let task = &get(&get(&hello, "suites").as_array().expect("a list")[0], "tasks")[0];
    assert_eq!((text(task, "prompt"), get(task, "budget_steps").as_u64()), ("wait", Some(12)));
    assert_eq!(keys(get(&hello, "observation_space")), ["image", "wrist_image", "state", "prompt"]);
    assert_eq!(get(&hello, "privileged").as_bool(), Some(false));
    let start = client.reset(0);
    assert_eq!(keys(get(&start, "observation")), ["image", "wrist_image", "state", "prompt"]);
    let mut info = keys(get(&start, "info"));
    info.sort_unstable();
    assert_eq!(
        info,
        [
            "clamped_grips",
            "clamped_steps",
            "episode",
            "far_commands",
            "prompt",
            "step",
            "success",
            "task",
            "time_s"
        ]
    );
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
    assert_eq!(client.reset(0), start, "the same start again");
    assert_eq!(text(&client.ask(&of("close")), "type"), "close");
    assert!(client.0.read().is_ok_and(|m| m.is_close()));
}

#[test]
fn info_counts_commands_out_of_reach_and_grip_values_out_of_range() {
    let project = project();
    let server = Server::start(&vision(&project));
    let (mut client, _) = server.client();
    client.reset(0);
    client.ask(&step(2));
    let far = [500.0, 4.0, 260.0, 0.0, 0.0, 0.0, 255.0];
    let after = client.ask(&map(&[("type", "step".into()), ("actions", array(&[3, 7], &far.repeat(3)))]));
    let count = |name| get(get(&after, "info"), name).as_u64();
    assert_eq!((count("step"), count("far_commands"), count("clamped_grips")), (Some(5), Some(3), Some(3)));
}

#[test]
fn privileged_clients_receive_the_true_state() {
    let project = project();
    let access = Access { split: EpisodeSplit::Demonstration, is_privileged: true, ..Access::default() };
    let server = Server::with(&vision(&project).seed(3), access);
    let (mut client, hello) = server.client();
    assert_eq!((get(&hello, "seed").as_u64(), text(&hello, "split")), (Some(3), "demonstration"));
    let start = client.reset(0);
    let scene = get(get(&start, "info"), "scene");
    assert_eq!(text(get(scene, "goal"), "object"), "cube");
    let names: Vec<_> =
        get(scene, "objects").as_array().expect("a list").iter().filter_map(Value::as_str).collect();
    assert!(names.contains(&"cube"), "{names:?}");
    assert_eq!(get(scene, "base_quaternion_w").as_array().map(Vec::len), Some(4));
    let info = get(&client.ask(&step(12)), "info").clone();
    assert!(!keys(&info).contains(&"scene"), "only at the start");
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
    let server = Server::start(&vision(&project));
    let (mut client, _) = server.client();
    for kind in ["get_state", "render"] {
        assert!(client.refused(&of(kind)).contains("reset first"), "{kind}");
    }
    assert!(client.refused(&step(1)).contains("reset first"));
    let start = client.reset(0);
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
    assert_eq!(client.reset(0), start);
}

#[test]
fn malformed_messages_are_reported() {
    let project = project();
    let server = Server::start(&vision(&project));
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
    client.reset(0);
    // Ten megabytes are refused before they are read, and the connection is closed.
    let _ = client.0.send(Message::binary(vec![0; 10 << 20]));
    let answer = client.hear();
    assert!(text(&answer, "error").contains("longer than 4 MiB"), "{answer}");
    assert!(client.0.read().is_ok_and(|message| message.is_close()), "nothing behind it would be understood");
    server.client().0.reset(0);
}

#[test]
fn silent_clients_do_not_block_others() {
    let project = project();
    let server = Server::with(&vision(&project), Access { max_clients: 2, ..Access::default() });
    let mut silent: Vec<TcpStream> = (0..3).map(|_| stream(&server.address)).collect();
    silent[1].write_all(b"GET / HTTP/1.1\r\nUpgrade: webs").expect("half a greeting");
    silent[2].write_all(&[0x16, 0x03, 0x01, 0x00, 0xFF]).expect("another protocol's");
    assert!(server.is_healthy(), "while others are silent");
    for _ in 0..4 {
        let (mut client, _) = server.client();
        client.send(&reset(1));
        client.0.get_ref().shutdown(Shutdown::Both).expect("gone");
    }
    let (mut first, _) = server.client();
    first.reset(0);
    let (second, _) = server.client();
    assert!(server.is_healthy(), "with all seats taken");
    assert_eq!(handshake(&server, &[]), 503);
    drop(second);
    server.client().0.reset(0);
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
    match tungstenite::client(request, stream(&server.address)) {
        Ok((_, response)) => response.status().as_u16(),
        Err(tungstenite::HandshakeError::Failure(Error::Http(response))) => response.status().as_u16(),
        Err(other) => panic!("{other:?}"),
    }
}

#[test]
fn a_refused_client_takes_no_seat_and_releases_none() {
    let project = project();
    let server = Server::with(&vision(&project), Access { max_clients: 1, ..Access::default() });
    let (first, _) = server.client();
    for _ in 0..3 {
        assert_eq!(handshake(&server, &[]), 503, "the only seat is taken");
    }
    drop(first);
    let (mut second, _) = server.client();
    assert_eq!(handshake(&server, &[]), 503, "the limit still holds");
    second.reset(0);
    drop(second);
    // More connections than the server accepts at a time, none of which says anything.
    let silent: Vec<TcpStream> = (0..80).map(|_| stream(&server.address)).collect();
    wait_until("it is full", || server.health().starts_with("HTTP/1.1 503 "));
    drop(silent);
    wait_until("it has seats again", || server.is_healthy());
    for _ in 0..3 {
        assert!(server.is_healthy());
        server.client().0.reset(0);
    }
}

#[test]
fn web_pages_and_clients_without_the_token_are_refused() {
    let project = project();
    let server = Server::start(&vision(&project));
    assert_eq!(handshake(&server, &[]), 101);
    assert_eq!(handshake(&server, &[("origin", "https://evil.example")]), 403);
    assert_eq!(handshake(&server, &[("host", "evil.example")]), 403);
    let access = Access { token: Some("s3cret".to_owned()), ..Access::default() };
    let server = Server::with(&vision(&project), access);
    let token = ("authorization", "Bearer s3cret");
    assert_eq!(handshake(&server, &[("authorization", "Bearer other")]), 401);
    assert_eq!(handshake(&server, &[token]), 101);
    assert_eq!(handshake(&server, &[token, ("origin", "null")]), 403);
}

#[test]
fn restored_states_are_byte_identical() {
    let project = project();
    let access = Access { is_privileged: true, ..Access::default() };
    let visuo_tactile = || project.run("x.lua").profile("visuo_tactile");
    let server = Server::with(&visuo_tactile(), access);
    let (mut client, _) = server.client();
    client.reset(0);
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
    let changed = Server::start(&visuo_tactile().set("robot.gripper.effort", 20));
    assert_contains(changed.client().0.refused(&back), "settings or version differ");
    let changed = Server::start(&project.run("x.lua").profile("libero"));
    assert_contains(changed.client().0.refused(&back), "another profile or gripper");
}

/// The numbers of an array as clients receive it.
fn doubles(value: &Value) -> Vec<f64> {
    let entries = value.as_map().expect("an array");
    let data =
        entries.iter().find(|(key, _)| key.as_slice() == Some(b"data")).and_then(|(_, data)| data.as_slice());
    data.expect("data").as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()
}

#[test]
fn cameras_have_their_matrices() {
    let project = project();
    let server = Server::start(&vision(&project));
    let (mut client, _) = server.client();
    assert!(client.refused(&of("cameras")).contains("reset first"));
    client.reset(0);
    let found = client.ask(&of("cameras"));
    let cameras = get(&found, "cameras");
    assert_eq!(keys(cameras), ["third_person", "wrist"]);
    let camera = get(cameras, "third_person");
    // A lens of 18 before a picture of 15, both in the same unit.
    let focal = 224.0 * 18.0 / 15.0;
    let expected = [focal, 0.0, 112.0, 0.0, focal, 112.0, 0.0, 0.0, 1.0];
    for (number, expected) in doubles(get(camera, "intrinsic")).into_iter().zip(expected) {
        assert!((number - expected).abs() < 1e-9, "{number} instead of {expected}");
    }
    let before = doubles(get(get(cameras, "wrist"), "pose_b"));
    assert_eq!((before.len(), &before[12..]), (16, &[0.0, 0.0, 0.0, 1.0][..]));
    assert!(before[10] > 0.9, "the view is down, along -z: {before:?}");
    client.ask(&step(5));
    let after = client.ask(&of("cameras"));
    assert_eq!(get(get(&after, "cameras"), "third_person"), camera, "it stands still");
    assert_ne!(
        doubles(get(get(get(&after, "cameras"), "wrist"), "pose_b")),
        before,
        "it moves with the hand"
    );
}

#[test]
fn images_have_the_requested_size() {
    let project = project();
    let server = Server::start(&vision(&project));
    let (mut client, _) = server.client();
    client.reset(0);
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
