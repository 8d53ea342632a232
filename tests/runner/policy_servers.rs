//! Policy servers that answer, fail, hang or die: errors are reported and finished episodes are kept.

use std::{
    collections::BTreeSet,
    fs,
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

use rmpv::Value;
use softvt::{
    evaluation::verdict::Outcome,
    policy::{profile::GripCode, remote::ServerProtocol},
    report::{styled_text::TerminalFormat, terminal},
    runner::RunErrorCause,
};
use tungstenite::{Message, WebSocket, accept};

use crate::support::{Project, Run, Small, assert_contains};

type Socket = WebSocket<TcpStream>;

/// Starts a server that handles `visits` connections with `serve`. Returns its address.
fn server(visits: usize, serve: impl Fn(Socket) + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("ws://{}", listener.local_addr().expect("an address"));
    thread::spawn(move || {
        for stream in listener.incoming().take(visits) {
            if let Ok(socket) = accept(stream.expect("a connection")) {
                serve(socket);
            }
        }
    });
    address
}

fn packed(value: &Value) -> Message {
    let mut bytes = Vec::new();
    rmpv::encode::write_value(&mut bytes, value).expect("packed");
    Message::binary(bytes)
}

fn text(name: &str) -> Value {
    Value::from(name)
}

/// An array with keys of type bin, as openpi encodes it.
fn array(dtype: &str, shape: &[usize], data: Vec<u8>) -> Value {
    let key = |name: &str| Value::Binary(name.as_bytes().to_vec());
    Value::Map(vec![
        (key("__ndarray__"), Value::Boolean(true)),
        (key("data"), Value::Binary(data)),
        (key("dtype"), text(dtype)),
        (key("shape"), Value::Array(shape.iter().map(|n| Value::from(*n)).collect())),
    ])
}

fn actions(rows: usize, row: [f32; 7]) -> Value {
    let numbers = (0..rows).flat_map(|_| row).flat_map(f32::to_le_bytes).collect();
    Value::Map(vec![(text("actions"), array("<f4", &[rows, 7], numbers))])
}

/// The robot state of an observation.
fn state(observation: &Value) -> Vec<f32> {
    let data = bytes(observation, "observation/state");
    data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
}

/// The next observation. The socket answers pings by itself.
fn observation(socket: &mut Socket) -> Option<Value> {
    loop {
        match socket.read() {
            Ok(Message::Binary(bytes)) => return rmpv::decode::read_value(&mut &bytes[..]).ok(),
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            _ => return None,
        }
    }
}

/// A server that sends the metadata of openpi and then does as `serve`.
fn greeting(serve: impl Fn(&mut Socket) + Send + 'static) -> String {
    server(9, move |mut socket| {
        let _ = socket.send(packed(&Value::Map(Vec::new())));
        serve(&mut socket);
    })
}

/// A server that replies to each observation of a connection with `reply` of its number and content.
fn answering(reply: impl Fn(usize, &Value) -> Option<Message> + Send + 'static) -> String {
    greeting(move |socket| answer(socket, &reply))
}

fn answer(socket: &mut Socket, reply: impl Fn(usize, &Value) -> Option<Message>) {
    let mut count = 0;
    while let Some(seen) = observation(socket) {
        let Some(message) = reply(count, &seen) else { return };
        if socket.send(message).is_err() {
            return;
        }
        count += 1;
    }
}

fn hold(seen: &Value, rows: usize) -> Message {
    let state = state(seen);
    let row = std::array::from_fn(|i| if i < 6 { state[i] } else { 0.0 });
    packed(&actions(rows, row))
}

fn project() -> Project {
    Small { task: "budget_steps = 12", ..Small::default() }.project()
}

/// A run of a server by the profile `vision` into the folder `run`.
fn run<'a>(project: &'a Project, address: &str) -> Run<'a> {
    let run = project.run("x.lua").policy(address).threads(1).out("run").profile("vision");
    run.timeout(Duration::from_secs(5))
}

/// The message of an episode that could not be run to its end.
fn error_of(outcome: &Outcome) -> &str {
    match outcome {
        Outcome::Error { message } => message,
        other => panic!("no error: {other:?}"),
    }
}

#[test]
fn one_request_is_sent_per_chunk() {
    let asked = Arc::new(AtomicUsize::new(0));
    let count = asked.clone();
    let address = answering(move |_, seen| {
        count.fetch_add(1, Ordering::Relaxed);
        Some(hold(seen, 50))
    });
    let project = project();
    run(&project, &address).episodes(2).replan(5).finish();
    // Twelve steps in chunks of five are three requests; two episodes use one connection.
    assert_eq!(asked.load(Ordering::Relaxed), 6);
    let info = project.json("run/run.json");
    assert_eq!((info["policy"].as_str(), info["replan"].as_u64()), (Some("vision"), Some(5)));
    assert_eq!(info["profile"]["actions"]["gripper"]["code"], "binary");
    assert!(project.is_reproduced("run", "0/1"));
}

#[test]
fn closed_idle_connections_are_reopened() {
    let pongs = Arc::new(AtomicUsize::new(0));
    let count = pongs.clone();
    let address = greeting(move |socket| {
        let first = observation(socket).expect("a question");
        // Both frames are received before the next request.
        let _ = socket.write(hold(&first, 50));
        let _ = socket.write(Message::Ping("still there?".into()));
        let _ = socket.flush();
        let answers = std::iter::from_fn(|| socket.read().ok());
        if answers.take(3).any(|message| matches!(&message, Message::Pong(_))) {
            count.fetch_add(1, Ordering::Relaxed);
        }
        let Some(second) = observation(socket) else { return };
        let _ = socket.write(hold(&second, 50));
        let _ = socket.write(Message::Close(None));
        let _ = socket.flush();
        let _ = socket.read();
    });
    let project = project();
    run(&project, &address).episodes(2).replan(5).finish();
    assert_eq!(pongs.load(Ordering::Relaxed), 3, "six questions over three connections");
}

#[test]
fn websockets_that_a_server_closes_are_reopened_although_it_keeps_their_tcp_connections() {
    let questions = Arc::new(AtomicUsize::new(0));
    let (count, kept) = (questions.clone(), Mutex::new(Vec::new()));
    let address = server(9, move |mut socket| {
        let _ = socket.send(packed(&Value::Map(Vec::new())));
        if let Some(question) = observation(&mut socket) {
            count.fetch_add(1, Ordering::Relaxed);
            let _ = socket.write(hold(&question, 50));
            let _ = socket.write(Message::Close(None));
            let _ = socket.flush();
        }
        kept.lock().expect("unpoisoned").push(socket);
    });
    run(&project(), &address).replan(5).finish();
    assert_eq!(questions.load(Ordering::Relaxed), 3);
}

#[test]
fn the_grip_code_of_a_run_is_stated_and_compared_with_that_of_the_server() {
    let stating = |code: &'static str| {
        server(9, move |mut socket| {
            let _ = socket.send(packed(&Value::Map(vec![(text("gripper"), text(code))])));
            while let Some(seen) = observation(&mut socket) {
                let state = state(&seen);
                let row = std::array::from_fn(|i| if i < 6 { state[i] } else { 2.5 });
                let _ = socket.send(packed(&actions(50, row)));
            }
        })
    };
    let project = project();
    assert_contains(
        run(&project, &stating("continuous")).policy_error(),
        "the grip code continuous in its metadata, and the profile vision reads binary",
    );
    run(&project, &stating("force")).gripper(GripCode::Force).finish();
    let info = project.json("run/run.json");
    assert_eq!(
        (&info["gripper"], &info["profile"]["actions"]["gripper"]["code"]),
        (&"force".into(), &"force".into())
    );
    assert!(project.is_reproduced("run", "0/0"), "the force is recorded");
    let strong = run(&project, &stating("force")).gripper(GripCode::Force).set("robot.gripper.effort", 2);
    let record = strong.out("strong").record();
    let message = error_of(&record.outcome);
    assert!(message.contains("2.5 N; expected 0 to 2 N"), "{message}");
}

/// A server that does as `serve` with each bare connection.
fn listening(serve: impl Fn(TcpStream) + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("ws://{}", listener.local_addr().expect("an address"));
    thread::spawn(move || listener.incoming().flatten().for_each(serve));
    address
}

#[test]
fn a_run_ends_with_what_its_server_did() {
    let ask = |seconds: f64, protocol: Option<ServerProtocol>, address: String| {
        let project = project();
        let run = run(&project, &address).timeout(Duration::from_secs_f64(seconds));
        let message = run.with_policy(|policy| policy.protocol = protocol).policy_error();
        assert!(!project.path("run").exists(), "nothing was finished, so nothing is left");
        message
    };
    let reply = |reply: Message| answering(move |_, _| Some(reply.clone()));
    let of = |value: Value| packed(&Value::Map(vec![(text("actions"), value)]));
    let twice = greeting(|socket| {
        while let Some(seen) = observation(socket) {
            let _ = socket.send(hold(&seen, 5));
            let _ = socket.send(hold(&seen, 5));
        }
    });
    let huge = greeting(|socket| {
        let _ = observation(socket);
        let _ = socket.get_mut().write_all(&[&[0x82, 127], &(1_u64 << 30).to_be_bytes()[..]].concat());
        while socket.get_mut().write_all(&[0; 1 << 20]).is_ok() {}
    });
    let web = listening(|mut stream| {
        let _ = stream.write_all(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n");
        // Until the client leaves.
        let _ = stream.read_to_end(&mut Vec::new());
    });
    let greets_by_7 = server(9, |mut socket| drop(socket.send(packed(&Value::from(7)))));
    for (address, words) in [
        (twice, "sent a message that was not requested"),
        (reply(Message::text("ValueError: bad key")), "reported an error:\nValueError: bad key"),
        (reply(of(array("<f4", &[10, 6], vec![0; 240]))), "[10, 6]: too few numbers"),
        (reply(of(array("<f4", &[10, 7], vec![0; 12]))), "with 12 bytes"),
        (reply(of(text("left"))), "has text as actions"),
        (reply(packed(&Value::Nil)), "is nil"),
        (reply(Message::binary(vec![0xDD, 0xFF, 0xFF, 0xFF, 0xFF])), "msgpack"),
        (reply(Message::binary(vec![0x91; 5000])), "msgpack"),
        (reply(Message::binary(Vec::new())), "msgpack"),
        (huge, "more than 8 MiB"),
        (greets_by_7, "sent a number first"),
        (web, "not a websocket server"),
    ] {
        let output = ask(5.0, None, address);
        assert_contains(&output, words);
    }
    let silent = greeting(|socket| while observation(socket).is_some() {});
    let pings = greeting(|socket| {
        let _ = observation(socket);
        while socket.send(Message::Ping("still there?".into())).is_ok() {
            thread::sleep(Duration::from_millis(10));
        }
    });
    let mute = listening(|mut stream| drop(stream.read_to_end(&mut Vec::new())));
    for (protocol, address, words) in [
        (None, silent, "did not answer within 0.5 s"),
        (None, pings, "did not answer within 0.5 s"),
        (None, mute, "says nothing"),
        (Some(ServerProtocol::VlaEval), answering(|_, seen| Some(packed(seen))), "vla-eval"),
    ] {
        let output = ask(0.5, protocol, address);
        assert_contains(&output, words);
    }
}

#[test]
fn nan_replies_fail_only_their_episode() {
    let address = answering(|count, seen| match count {
        1 => Some(packed(&actions(5, [f32::NAN; 7]))),
        _ => Some(hold(seen, 5)),
    });
    let project = project();
    let records = run(&project, &address).episodes(2).replan(5).records();
    assert_contains(error_of(&records[0].outcome), "not finite");
    assert_eq!((records[0].stats.steps, records[0].verdict.safety), (5, false));
    assert_eq!(records[1].outcome, Outcome::Budget);
    assert!(project.is_reproduced("run", "0/0"));
}

#[test]
fn commands_out_of_reach_are_counted_and_shown() {
    let far = || packed(&actions(9, [50.0, 0.0, -3.0, 0.0, 9.0, 0.0, 7.0]));
    let project = project();
    let record = run(&project, &answering(move |_, _| Some(far()))).record();
    assert_eq!((record.stats.far_commands, record.stats.clamped_grips), (12, 12));
    assert!(!record.verdict.safety);
    assert_contains(error_of(&record.outcome), "all 12 commands were out of reach, first: (50, 0, -3) m");
    assert!(project.is_reproduced("run", "0/0"));

    let address = answering(move |count, seen| if count == 0 { Some(hold(seen, 6)) } else { Some(far()) });
    let finished = run(&project, &address).replan(6).out("half").finish();
    assert_contains(&finished.messages, "; 6 of 12 commands were out of reach, first: (50, 0, -3) m, 49.");
    assert_contains(&finished.messages, "; 6 of 12 grip values were out of range");
    let summary = finished.result().summary;
    assert_eq!((summary.commands.far, summary.commands.clamped_grips), (6, 6));
    let table = terminal::table(&summary, TerminalFormat::PLAIN.with_details());
    assert_contains(&table, "6 of 12 commands were out of reach in 1 episode");
    let report = project.report(&["half"]);
    for text in [report.html, report.markdown] {
        assert_contains(&text, "Commands that were not executed as given");
        assert_contains(&text, "(50, 0, -3) m");
    }
}

#[test]
fn a_dying_server_loses_no_finished_episode() {
    let whole = project();
    let address = answering(|_, seen| Some(hold(seen, 50)));
    run(&whole, &address).episodes(3).finish();
    let broken = project();
    let dying = server(1, |mut socket| {
        let _ = socket.send(packed(&Value::Map(Vec::new())));
        answer(&mut socket, |count, seen| (count < 3).then(|| hold(seen, 50)));
    });
    let message = run(&broken, &dying).episodes(3).timeout(Duration::from_secs(1)).policy_error();
    assert_contains(&message, "1 of 3 episodes are in run");
    run(&broken, &address).episodes(3).resume().finish();
    assert_eq!(broken.lines("run/episodes.jsonl")[1]["attempts"], 2, "the server ended the first one");
    let told = "run: 1 episode took more than one attempt (most: task 0 episode 1, 2): the policy or the user broke off the others";
    assert_eq!(broken.report(&["run"]).warnings, [told]);
    let counted = broken.text("run/episodes.jsonl");
    let without_attempts = |project: &Project| {
        let mut lines = project.lines("run/episodes.jsonl");
        for record in lines.iter_mut().filter_map(|line| line.as_object_mut()) {
            record.retain(|key, _| !["attempts", "record_sha256"].contains(&key.as_str()));
        }
        lines
    };
    assert_eq!(without_attempts(&broken), without_attempts(&whole));
    let scores = "softvtbench/episodes.csv";
    assert_eq!(broken.text(&format!("run/{scores}")), whole.text(&format!("run/{scores}")));
    // The projects are in different folders.
    let manifest = |project: &Project| project.relative(project.text("run/run.json"));
    assert_eq!(manifest(&broken), manifest(&whole));
    let again = || run(&broken, &address).episodes(3).finish().messages;
    assert_contains(again(), "already complete");
    // Files of finished episodes are restored from the actions, without the policy; without actions they are reported
    // as lost.
    let log = "run/softvtbench/task_000/episode_00001/policy_action_debug.jsonl";
    let text = broken.text(log);
    fs::remove_file(broken.path(log)).expect("removed");
    assert_contains(again(), "restoring files of 1 finished episode");
    assert_eq!(broken.text(log), text);
    fs::remove_dir_all(broken.path("run/actions")).expect("removed");
    assert_contains(again(), "3 finished episodes lack their actions");
    assert_eq!(broken.text("run/episodes.jsonl"), counted);
}

#[test]
fn profiles_determine_the_inputs() {
    let entries = |profile: &str, gripper: Option<GripCode>| {
        let names = Arc::new(Mutex::new(Vec::new()));
        let kept = names.clone();
        let address = answering(move |_, seen| {
            let map = seen.as_map().expect("a map");
            *kept.lock().unwrap() = map.iter().map(|(k, _)| k.as_str().unwrap_or("").to_owned()).collect();
            Some(hold(seen, 50))
        });
        let project = project();
        let run = run(&project, &address).profile(profile);
        let summary = run.with_policy(|policy| policy.gripper = gripper).finish().result().summary;
        let names = names.lock().unwrap().clone();
        (names, summary, project.json("run/run.json"))
    };
    let (vision, summary, info) = entries("vision", None);
    assert!(vision.iter().any(|k| k == "image") && vision.iter().any(|k| k == "observation/wrist_image"));
    assert!(!vision.iter().any(|k| k.contains("tactile")));
    assert!(!summary.force_observed && info["force_observed"] == false);
    let (touch, _, info) = entries("visuo_tactile", Some(GripCode::Binary));
    assert!(touch.iter().any(|k| k == "observation/tactile_marker_motion"));
    assert_eq!(info["profile"]["actions"]["gripper"]["code"], "binary", "modality and gripper cross");
    let (released, summary, info) = entries("softvtbench", None);
    assert!(released.iter().any(|k| k == "tactile_gripper_force"));
    assert!(summary.force_observed && info["force_observed"] == true);
}

#[test]
fn a_judged_run_names_its_episodes_to_the_server_by_hashes_alone() {
    let identities = |is_judged: bool| {
        let seen = Arc::new(Mutex::new(Vec::new()));
        let kept = seen.clone();
        let address = answering(move |_, observation| {
            let sent = ["softvt", "__softvtbench_rng_seed"].map(|key| entry(observation, key).clone());
            kept.lock().unwrap().push(sent);
            Some(hold(observation, 4))
        });
        let project = project();
        project.write("secret", b"correct horse battery staple");
        let run = run(&project, &address).episodes(2).replan(4);
        if is_judged { run.secret("secret") } else { run }.finish();
        let seen = seen.lock().unwrap();
        seen.clone()
    };
    let judged = identities(true);
    assert_eq!(judged.len(), 6, "three requests in each of two episodes");
    let ids: BTreeSet<String> = judged.iter().map(|[id, _]| entry(id, "id").to_string()).collect();
    assert_eq!(ids.len(), 2, "a name per episode");
    let seeds: BTreeSet<String> = judged.iter().map(|[_, seed]| seed.to_string()).collect();
    assert_eq!(seeds.len(), 6, "a seed per request");
    for [identity, seed] in &judged {
        let names: Vec<_> =
            identity.as_map().expect("a map").iter().map(|(key, _)| key.as_str().unwrap()).collect();
        assert_eq!(names, ["id", "step", "query", "seed", "wants_actions"]);
        assert_eq!(entry(identity, "seed"), seed);
    }
    assert_eq!(judged, identities(true), "the same requests again");
    let [open, _] = &identities(false)[0];
    let names: Vec<_> = open.as_map().expect("a map").iter().filter_map(|(key, _)| key.as_str()).collect();
    assert!(names.contains(&"suite") && !names.contains(&"id"), "{names:?}");
}

/// The entry of a map.
fn entry<'a>(map: &'a Value, key: &str) -> &'a Value {
    let is = |name: &Value| name.as_str() == Some(key) || name.as_slice() == Some(key.as_bytes());
    &map.as_map().expect("a map").iter().find(|(name, _)| is(name)).unwrap_or_else(|| panic!("no {key}")).1
}

fn shape(observation: &Value, key: &str) -> Vec<u64> {
    let shape = entry(entry(observation, key), "shape").as_array().expect("a list");
    shape.iter().filter_map(Value::as_u64).collect()
}

fn bytes<'a>(observation: &'a Value, key: &str) -> &'a [u8] {
    entry(entry(observation, key), "data").as_slice().expect("bytes")
}

/// The messages that a server gets in an episode of 12 steps in chunks of 5, with the metadata `greeting`.
fn messages(
    greeting: Value,
    observes: bool,
    change: impl Fn(Run) -> Run,
) -> Result<Vec<Value>, (RunErrorCause, String)> {
    let seen = Arc::new(Mutex::new(Vec::new()));
    let kept = seen.clone();
    let address = server(9, move |mut socket| {
        let _ = socket.send(packed(&greeting));
        while let Some(message) = observation(&mut socket) {
            let wants = entry(entry(&message, "id"), "wants_actions").as_bool().expect("stated");
            let reply = if wants { hold(&message, 50) } else { packed(&Value::Map(Vec::new())) };
            kept.lock().expect("kept").push(message);
            if socket.send(reply).is_err() {
                return;
            }
        }
    });
    let project = project();
    project.write("history.lua", include_bytes!("../data/history.lua"));
    project.replace("history.lua", "step = false", &format!("step = {observes}"));
    let run = run(&project, &address).profile("history.lua").replan(5).timeout(Duration::from_secs(20));
    change(run.episodes(1)).attempt()?;
    let messages = seen.lock().expect("kept").clone();
    Ok(messages)
}

#[test]
fn entries_have_as_many_control_steps_as_the_profile_asks_for() {
    let messages = messages(Value::Map(Vec::new()), false, |run| run.seed(11)).expect("it answers");
    assert_eq!(messages.len(), 3);
    let edge = 224;
    for message in &messages {
        for (key, expected) in [
            ("two", vec![2, edge, edge, 3]),
            ("one", vec![1, edge, edge, 3]),
            ("depth", vec![edge, edge]),
            ("objects", vec![3, edge, edge]),
            ("arm", vec![4, 21]),
            ("markers", vec![3, 198, 2]),
            ("drawn", vec![2, 240, 320, 3]),
            ("mosaic", vec![edge, edge, 3]),
        ] {
            assert_eq!(shape(message, key), expected, "{key}");
        }
        let (two, one) = (bytes(message, "two"), bytes(message, "one"));
        assert_eq!(&two[one.len()..], one, "the present step is the last");
    }
    let two = bytes(&messages[0], "two");
    assert_eq!(two[..two.len() / 2], two[two.len() / 2..], "the first step is repeated");
    let ids: Vec<_> = messages.iter().map(|message| entry(message, "id")).collect();
    let numbers =
        |key: &str| ids.iter().map(|id| entry(id, key).as_u64().expect("a number")).collect::<Vec<_>>();
    assert_eq!((numbers("query"), numbers("step")), (vec![0, 1, 2], vec![0, 5, 10]));
    assert_eq!(
        (numbers("task"), numbers("episode"), numbers("run_seed")),
        (vec![0; 3], vec![0; 3], vec![11; 3])
    );
    let seeds: Vec<_> =
        messages.iter().map(|message| entry(message, "seed").as_u64().expect("a seed")).collect();
    assert_eq!(seeds, numbers("seed"));
    assert!(seeds[0] != seeds[1] && seeds.iter().all(|seed| *seed < 1 << 32), "{seeds:?}");
    assert_eq!(entry(ids[0], "suite"), &text("one"));
}

#[test]
fn a_server_or_a_profile_may_ask_for_an_observation_in_every_control_step() {
    let asks = Value::Map(vec![(text("observe_every_step"), Value::Boolean(true))]);
    let by_server = messages(asks, false, |run| run).expect("it answers");
    let by_profile = messages(Value::Map(Vec::new()), true, |run| run).expect("it answers");
    for messages in [&by_server, &by_profile] {
        assert_eq!(messages.len(), 12);
        let wants = |message: &Value| entry(entry(message, "id"), "wants_actions").as_bool();
        let asked: Vec<usize> = (0..12).filter(|step| wants(&messages[*step]) == Some(true)).collect();
        assert_eq!(asked, [0, 5, 10]);
        for step in 1..12 {
            let (before, now) = (bytes(&messages[step - 1], "one"), bytes(&messages[step], "two"));
            assert_eq!(&now[..before.len()], before, "step {step}");
            assert_eq!(entry(entry(&messages[step], "id"), "step").as_u64(), Some(step as u64));
        }
    }
    assert_eq!(by_server, by_profile);
    let wrong = Value::Map(vec![(text("observe_every_step"), text("yes"))]);
    let (cause, message) = messages(wrong, false, |run| run).expect_err("no truth value");
    assert_eq!(cause, RunErrorCause::Policy);
    assert!(message.contains("observe_every_step in its metadata; expected true or false"), "{message}");
    let refused = messages(Value::Map(Vec::new()), true, |run| {
        run.with_policy(|policy| policy.protocol = Some(ServerProtocol::VlaEval))
    });
    let (cause, message) = refused.expect_err("another protocol");
    assert_eq!(cause, RunErrorCause::Input);
    assert_contains(&message, "observe_every_step needs the protocol openpi");
}
