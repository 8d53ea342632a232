//! Servers that break the protocol, on the loopback interface, and what a policy reports.

use std::{
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    sync::mpsc,
    thread,
    time::{Duration, Instant},
};

use rmpv::Value;
use tungstenite::{Message, WebSocket, accept};

use super::*;
use softvt_common::cancel::CancelFlag;

use crate::{
    EncodedGrip, GripTarget, StatePart,
    msgpack::{map, pack},
    profile::{ActionEncoding, GripperValues, ObservationSource, PoseEncoding, ProfileInput},
};

type Socket = WebSocket<TcpStream>;

static CANCEL: CancelFlag = CancelFlag::new();

/// Starts a server that handles each connection in a thread of its own. Returns its address.
fn server(serve: impl Fn(Socket) + Send + Sync + 'static) -> String {
    let serve = Arc::new(serve);
    tcp_server(move |stream| {
        if let Ok(socket) = accept(stream) {
            serve(socket);
        }
    })
}

fn tcp_server(serve: impl Fn(TcpStream) + Send + Sync + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("ws://{}", listener.local_addr().unwrap());
    let serve = Arc::new(serve);
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let serve = serve.clone();
            thread::spawn(move || serve(stream));
        }
    });
    url
}

fn send(socket: &mut Socket, value: &Value) {
    let _ = socket.send(Message::binary(pack(value)));
}

fn metadata() -> Value {
    Value::Map(Vec::new())
}

/// Waits for the next observation. The socket answers pings by itself.
fn observe(socket: &mut Socket) -> bool {
    loop {
        match socket.read() {
            Ok(Message::Binary(_)) => return true,
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            _ => return false,
        }
    }
}

fn chunk(closure: f64) -> Value {
    let row = [0.4, 0.0, 0.3, 3.0, 0.0, 0.0, closure].map(Value::F64).to_vec();
    map([("actions", Value::Array(vec![Value::Array(row)]))])
}

fn policy_server(url: String, code: GripCode, timeout: Duration) -> PolicyServer {
    let state = ObservationSource::State { parts: StatePart::named("position").into_iter().collect() };
    let gripper = GripperValues { code, ..GripperValues::new(0.0, 1.0) };
    let profile = Profile {
        name: "state".to_owned(),
        inputs: vec![ProfileInput::new(vec!["state".to_owned()], state)],
        actions: ActionEncoding::new(PoseEncoding::Absolute, gripper),
        observe_every_step: false,
    };
    PolicyServer { url, protocol: ServerProtocol::Openpi, profile, timeout, api_key: None, cancel: &CANCEL }
}

/// Closures of the chunks of an episode of so many questions, with a pause after each chunk.
fn episode(
    connections: &Arc<PolicyConnections>,
    questions: usize,
    pause: Duration,
) -> Result<Vec<f64>, String> {
    let mut policy = RemotePolicy::new(connections.clone());
    let brief = EpisodeBrief { suite: "one".to_owned(), ..EpisodeBrief::default() };
    let mut run = || {
        policy.reset(&brief)?;
        let mut closures = Vec::new();
        for _ in 0..questions {
            match policy.act(&Observation::default())?.commands[0].grip {
                EncodedGrip::Target(GripTarget::Closure(closure)) => closures.push(closure),
                other => panic!("{other:?}"),
            }
            thread::sleep(pause);
        }
        policy.finish()?;
        Ok(closures)
    };
    run().map_err(|error: PolicyError| {
        assert!(error.is_server_fault(), "{error}");
        error.to_string()
    })
}

fn connections(url: String, timeout: f64) -> Arc<PolicyConnections> {
    let timeout = Duration::from_secs_f64(timeout);
    Arc::new(PolicyConnections::new(policy_server(url, GripCode::Continuous, timeout)))
}

#[test]
fn a_regular_server_is_asked_over_one_connection_that_ends_with_a_close_frame() {
    let (sender, closed) = mpsc::channel();
    let url = server(move |mut socket| {
        send(&mut socket, &metadata());
        while let Ok(message) = socket.read() {
            match message {
                Message::Binary(_) => send(&mut socket, &chunk(0.25)),
                Message::Close(frame) => {
                    let _ = socket.flush();
                    let _ = sender.send(frame.map(|frame| u16::from(frame.code)));
                }
                _ => {}
            }
        }
    });
    let connections = connections(url, 20.0);
    for _ in 0..2 {
        assert_eq!(episode(&connections, 3, Duration::ZERO), Ok(vec![0.25; 3]));
    }
    drop(connections);
    assert_eq!(closed.recv_timeout(Duration::from_secs(10)), Ok(Some(1000)));
    assert!(closed.recv_timeout(Duration::from_millis(100)).is_err(), "there was a single connection");
}

#[test]
fn a_message_that_was_not_requested_is_an_error() {
    let twice = server(|mut socket| {
        send(&mut socket, &metadata());
        while observe(&mut socket) {
            send(&mut socket, &chunk(0.25));
            send(&mut socket, &chunk(0.75));
        }
    });
    let early = server(|mut socket| {
        send(&mut socket, &metadata());
        send(&mut socket, &chunk(0.75));
        while observe(&mut socket) {
            send(&mut socket, &chunk(0.25));
        }
    });
    // Leaves after the pong, when the client no longer waits.
    let late = || {
        server(|mut socket| {
            send(&mut socket, &metadata());
            while observe(&mut socket) {
                send(&mut socket, &chunk(0.25));
                // The ping, whose pong is sent with the next message.
                let _ = socket.read();
                let _ = socket.flush();
                thread::sleep(Duration::from_millis(20));
                send(&mut socket, &chunk(0.75));
            }
        })
    };
    // Leaves so late that it is taken as the next reply: then one more reply is outstanding.
    let stale = server(|mut socket| {
        send(&mut socket, &metadata());
        if !observe(&mut socket) {
            return;
        }
        send(&mut socket, &chunk(0.25));
        if observe(&mut socket) {
            send(&mut socket, &chunk(0.75));
            send(&mut socket, &chunk(0.5));
            let _ = observe(&mut socket);
        }
    });
    let pause = Duration::from_millis(300);
    for (url, questions) in [(twice, 3), (early, 1), (late(), 2), (late(), 1), (stale, 2)] {
        let error = episode(&connections(url, 20.0), questions, pause).unwrap_err();
        assert!(error.contains("sent a message that was not requested"), "{error}");
    }
}

#[test]
fn the_timeout_holds_while_bytes_arrive() {
    let pings = |pause: Duration| {
        server(move |mut socket| {
            send(&mut socket, &metadata());
            let _ = observe(&mut socket);
            while socket.send(Message::Ping("still there?".into())).is_ok() {
                thread::sleep(pause);
            }
        })
    };
    fn trickle(stream: &mut TcpStream, start: &[u8]) {
        let _ = stream.write_all(start);
        while stream.write_all(b"a").is_ok() {
            // At a higher rate tungstenite takes the handshake for an attack.
            thread::sleep(Duration::from_millis(40));
        }
    }
    let reply = server(|mut socket| {
        send(&mut socket, &metadata());
        let _ = observe(&mut socket);
        trickle(socket.get_mut(), &[0x82, 126, 0xFF, 0xFF]);
    });
    let greeting = server(|mut socket| trickle(socket.get_mut(), &[0x82, 126, 0xFF, 0xFF]));
    let handshake = tcp_server(|mut stream| {
        let _ = stream.read(&mut [0; 2048]);
        trickle(&mut stream, b"HTTP/1.1 101 Switching Protocols\r\nX-Long: ");
    });
    let no_pong = server(|mut socket| {
        send(&mut socket, &metadata());
        let _ = observe(&mut socket);
        send(&mut socket, &chunk(0.25));
        thread::sleep(Duration::from_secs(60));
    });
    for (url, words) in [
        (pings(Duration::from_millis(10)), "did not answer within 1 s"),
        (pings(Duration::ZERO), "did not answer within 1 s"),
        (reply, "did not answer within 1 s"),
        (greeting, "did not send its first message, the metadata, within 1 s"),
        (handshake, "tried for 1 s"),
        (no_pong, "did not answer a ping within 1 s"),
    ] {
        let start = Instant::now();
        let error = episode(&connections(url, 1.0), 1, Duration::ZERO).unwrap_err();
        assert!(error.contains(words), "{words}: {error}");
        assert!(start.elapsed() < Duration::from_secs(5), "{words}: {:?}", start.elapsed());
    }
}

#[test]
fn a_server_may_state_the_meaning_of_its_actions() {
    let stating = |key: &'static str, code: Value| {
        server(move |mut socket| {
            send(&mut socket, &map([(key, code.clone())]));
            while observe(&mut socket) {
                send(&mut socket, &chunk(0.25));
            }
        })
    };
    let check_entry = |key, code: Value| {
        let own = policy_server(stating(key, code), GripCode::TwoWidth, Duration::from_secs(20));
        PolicyConnections::new(own).check().map_err(|error| error.to_string())
    };
    let check = |code| check_entry("gripper", code);
    assert_eq!(check("two-width".into()), Ok(()));
    assert_eq!(check(Value::Binary(b"two-width".to_vec())), Ok(()));
    let error = check("binary".into()).unwrap_err();
    assert!(
        error.contains("the grip code binary") && error.contains("the profile state reads two-width"),
        "{error}"
    );
    for other in ["wide".into(), Value::from(3)] {
        let error = check(other).unwrap_err();
        assert!(error.contains("expected one of continuous, binary, two-width, force"), "{error}");
    }
    assert_eq!(check_entry("pose", "absolute".into()), Ok(()));
    let error = check_entry("pose", "joints".into()).unwrap_err();
    assert!(error.contains("actions of pose joints") && error.contains("state reads absolute"), "{error}");
    let error = check_entry("pose", "tool".into()).unwrap_err();
    assert!(error.contains("expected one of absolute, delta, delta_osc, joints"), "{error}");
    assert_eq!(check_entry("units", "m".into()), Ok(()));
    assert_eq!(check_entry("rotation", "axis_angle".into()), Ok(()));
    for (key, other) in
        [("units", "mm"), ("units", "Degrees"), ("rotation", "euler_xyz"), ("rotation", "quat ")]
    {
        let error = check_entry(key, other.into()).unwrap_err();
        assert!(error.contains(&format!("states {other:?} in the entry {key}")), "{error}");
    }
    let bytes = check_entry("rotation", Value::Binary(b"euler".to_vec())).unwrap_err();
    assert!(bytes.contains("softvt reads axis_angle, in rad"), "{bytes}");
}

#[test]
fn a_vla_eval_server_that_states_other_actions_is_refused() {
    let part = |format: &str, range: [f64; 2]| {
        map([("format", Value::from(format)), ("range", Value::Array(range.map(Value::F64).to_vec()))])
    };
    let check = |profile: &str, [position, rotation, gripper]: [&str; 3], range: [f64; 2]| {
        let mut server = policy_server(String::new(), GripCode::Binary, Duration::from_secs(1));
        server.profile = Profile::named(profile).unwrap();
        let spec = map([
            ("position", part(position, [-1.0, 1.0])),
            ("rotation", part(rotation, [-3.15, 3.15])),
            ("gripper", part(gripper, range)),
        ]);
        vla_eval::expect_action_spec(&server, &map([("action_spec", spec)]))
            .map_err(|error| error.to_string())
    };
    let delta = ["delta_xyz", "axis_angle", "binary_close_positive"];
    assert_eq!(check("libero", delta, [-1.0, 1.0]), Ok(()));
    assert_eq!(check("libero", ["delta_xyz", "euler_xyz", "raw"], [-1.0, 1.0]), Ok(()));
    let absolute = ["absolute_xyz", "axis_angle", "continuous_01"];
    assert_eq!(check("vision", absolute, [0.0, 1.0]), Ok(()));
    for (profile, stated, range, expected) in [
        (
            "vision",
            delta,
            [0.0, 1.0],
            "positions as delta_xyz, and the profile vision reads actions of pose absolute",
        ),
        ("libero", absolute, [-1.0, 1.0], "choose a profile with pose = \"absolute\""),
        ("vision", ["absolute_xyz", "euler_xyz", "raw"], [0.0, 1.0], "rotations as euler_xyz"),
        ("libero", ["delta_xyz", "quaternion_xyzw", "raw"], [-1.0, 1.0], "rotations as quaternion_xyzw"),
        (
            "libero",
            ["delta_xyz", "axis_angle", "binary_close_negative"],
            [-1.0, 1.0],
            "reads -1 as open and 1 as closed",
        ),
        ("libero", ["delta_xyz", "axis_angle", "continuous_01"], [0.0, 1.0], "continuous_01 from 0 to 1"),
    ] {
        let error = check(profile, stated, range).unwrap_err();
        assert!(error.contains(expected) && error.contains("action_spec"), "{error}");
    }
}
