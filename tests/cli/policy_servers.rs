//! Policy servers that answer, fail, hang or die: errors are reported and finished episodes are kept.

use std::{
    io::Write,
    net::{TcpListener, TcpStream},
    thread,
    time::Duration,
};

use rmpv::Value;
use tungstenite::{Message, WebSocket, accept};

use crate::support::{CliOutput, Project, Small};

type Socket = WebSocket<TcpStream>;

/// Starts a server that handles `visits` connections with `serve`, which gets their number. Returns its address.
fn server(visits: usize, serve: impl Fn(usize, Socket) + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("ws://{}", listener.local_addr().expect("an address"));
    thread::spawn(move || {
        for (number, stream) in listener.incoming().take(visits).enumerate() {
            if let Ok(socket) = accept(stream.expect("a connection")) {
                serve(number, socket);
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
    let of = |map: &Value, key: &[u8]| -> Value {
        let found = map.as_map().expect("a map").iter().find(|(k, _)| match k {
            Value::String(text) => text.as_bytes() == key,
            Value::Binary(bytes) => bytes == key,
            _ => false,
        });
        found.expect("an entry").1.clone()
    };
    let data = of(&of(observation, b"observation/state"), b"data");
    data.as_slice().expect("bytes").as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
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

/// Sends the metadata of openpi and replies to each observation with `reply` of its number and content.
fn answering(mut socket: Socket, reply: impl Fn(usize, &Value) -> Option<Message>) {
    let _ = socket.send(packed(&Value::Map(Vec::new())));
    let mut count = 0;
    while let Some(seen) = observation(&mut socket) {
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

fn run(project: &Project, address: &str, words: &str) -> CliOutput {
    let patience = if words.contains("--policy-timeout") { "" } else { "--policy-timeout 5" };
    project.softvt(&format!(
        "x.lua --policy {address} --profile vision --threads 1 --out run {patience} {words}"
    ))
}

/// The message of a run that must fail because of its server.
fn fails(address: &str, words: &str) -> String {
    let project = project();
    let output = run(&project, address, words);
    assert_eq!((output.code, output.out.as_str()), (3, ""), "{}", output.err);
    assert!(!output.err.contains("panicked") && !output.err.contains("internal error"), "{}", output.err);
    assert!(!project.path("run").exists(), "nothing was finished, so nothing is left");
    output.err
}

#[test]
fn one_request_is_sent_per_chunk() {
    let asked = std::sync::Arc::new(std::sync::atomic::AtomicUsize::new(0));
    let count = asked.clone();
    let address = server(9, move |_, socket| {
        answering(socket, |_, seen| {
            count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            Some(hold(seen, 50))
        });
    });
    let project = project();
    let output = run(&project, &address, "--episodes 2 --replan 5");
    assert_eq!(output.code, 0, "{}", output.err);
    // Twelve steps in chunks of five are three requests; two episodes use one connection.
    assert_eq!(asked.load(std::sync::atomic::Ordering::Relaxed), 6);
    let info = project.json("run/run.json");
    assert_eq!((info["policy"].as_str(), info["replan"].as_u64()), (Some("vision"), Some(5)));
    assert_eq!(info["profile"]["actions"]["gripper"]["binary"], true);
    let replayed = project.succeeds("replay run 0/1");
    assert!(replayed.out.contains("task 0 episode 1: byte-identical"), "{}", replayed.out);
}

#[test]
fn closed_idle_connections_are_reopened() {
    let pongs = std::sync::Arc::new(std::sync::atomic::AtomicUsize::new(0));
    let count = pongs.clone();
    let address = server(9, move |_, mut socket| {
        let _ = socket.send(packed(&Value::Map(Vec::new())));
        let first = observation(&mut socket).expect("a question");
        // Both frames are received before the next request.
        let _ = socket.write(hold(&first, 50));
        let _ = socket.write(Message::Ping("still there?".into()));
        let _ = socket.flush();
        let answers = std::iter::from_fn(|| socket.read().ok());
        if answers.take(3).any(|message| matches!(&message, Message::Pong(_))) {
            count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        }
        let Some(second) = observation(&mut socket) else { return };
        let _ = socket.write(hold(&second, 50));
        let _ = socket.write(Message::Close(None));
        let _ = socket.flush();
        let _ = socket.read();
    });
    let project = project();
    let output = run(&project, &address, "--episodes 2 --replan 5");
    assert_eq!(output.code, 0, "{}", output.err);
    assert_eq!(pongs.load(std::sync::atomic::Ordering::Relaxed), 3, "six questions over three connections");
}

/// Five actions that close the gripper: a reply that is wrong for an observation answered by `hold`.
fn shut() -> Message {
    packed(&actions(5, [0.4, 0.0, 0.3, 3.1, 0.0, 0.0, 1.0]))
}

#[test]
fn surplus_replies_end_the_run() {
    let address = server(9, |_, mut socket| {
        let _ = socket.send(packed(&Value::Map(Vec::new())));
        while let Some(seen) = observation(&mut socket) {
            let _ = socket.send(hold(&seen, 5));
            let _ = socket.send(shut());
        }
    });
    let output = fails(&address, "");
    assert!(output.contains("sent a message that was not requested"), "{output}");
}

#[test]
fn the_timeout_holds_while_pings_arrive() {
    let address = server(9, move |_, mut socket| {
        let _ = socket.send(packed(&Value::Map(Vec::new())));
        let _ = observation(&mut socket);
        while socket.send(Message::Ping("still there?".into())).is_ok() {
            thread::sleep(Duration::from_millis(10));
        }
    });
    let output = fails(&address, "--policy-timeout 2");
    assert!(output.contains("did not answer within 2 s"), "{output}");
}

#[test]
fn the_grip_code_of_a_run_is_stated_and_compared_with_that_of_the_server() {
    let stating = |code: &'static str| {
        server(9, move |_, mut socket| {
            let _ = socket.send(packed(&Value::Map(vec![(text("gripper"), text(code))])));
            while let Some(seen) = observation(&mut socket) {
                let state = state(&seen);
                let row = std::array::from_fn(|i| if i < 6 { state[i] } else { 2.5 });
                let _ = socket.send(packed(&actions(50, row)));
            }
        })
    };
    let output = fails(&stating("continuous"), "");
    assert!(
        output.contains("the grip code continuous") && output.contains("vision reads binary"),
        "{output}"
    );
    let project = project();
    let output = run(&project, &stating("force"), "--gripper force");
    assert_eq!(output.code, 0, "{}", output.err);
    assert!(output.err.contains("gripper: force (profile vision)"), "{}", output.err);
    let info = project.json("run/run.json");
    assert_eq!(
        (&info["gripper"], &info["profile"]["actions"]["gripper"]["code"]),
        (&"force".into(), &"force".into())
    );
    assert!(project.succeeds("replay run 0/0").out.contains("byte-identical"), "the force is recorded");
    let message = project.refusal("x.lua --out other --policy ws://127.0.0.1:9 --gripper wide");
    assert!(message.contains("[possible values: continuous, binary, two-width, force]"), "{message}");
    let message = project.refusal("x.lua --out other --policy noop --gripper force");
    assert!(message.contains("--gripper: applies to policy servers and Lua policies only"), "{message}");
    let address = stating("force");
    let words = "--profile vision --gripper force --set robot.gripper.effort=2 --out strong";
    assert_eq!(project.softvt(&format!("x.lua --policy {address} {words}")).code, 3, "no episode is valid");
    let outcome = project.lines("strong/episodes.jsonl")[0]["outcome"]["message"].clone();
    assert!(outcome.as_str().is_some_and(|text| text.contains("2.5 N; expected 0 to 2 N")), "{outcome}");
}

#[test]
fn missing_servers_are_reported() {
    let free = TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("an address");
    let output = fails(&format!("ws://{free}"), "--policy-timeout 0.3");
    assert!(
        output.contains("no policy server at ws://127.0.0.1") && output.contains("--policy-timeout"),
        "{output}"
    );
}

#[test]
fn invalid_addresses_are_input_errors() {
    let project = project();
    for (address, words) in [
        ("wss://host:1", "use a tunnel"),
        ("http://host:1", "expected ws://HOST:PORT"),
        ("ws://", "not an address"),
    ] {
        let message = project.refusal(&format!("x.lua --out run --policy {address}"));
        assert!(message.contains(words), "{message}");
    }
    let message = project.refusal("x.lua --out run --policy exprt");
    assert!(message.contains("did you mean expert"), "{message}");
    let message = project.refusal("x.lua --out run --policy ws://127.0.0.1:9 --profile pi");
    assert!(message.contains("possible values: vision, vision_drives"), "{message}");
}

#[test]
fn hanging_servers_time_out() {
    let address = server(9, |_, mut socket| {
        let _ = socket.send(packed(&Value::Map(Vec::new())));
        let _ = observation(&mut socket);
        thread::sleep(std::time::Duration::from_secs(60));
    });
    let output = fails(&address, "--policy-timeout 0.5");
    assert!(output.contains("did not answer within 0.5 s"), "{output}");
    // A server that accepts the connection and never responds.
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let silent = format!("ws://{}", listener.local_addr().expect("an address"));
    let output = fails(&silent, "--policy-timeout 0.5");
    assert!(output.contains("says nothing"), "{output}");
}

#[test]
fn error_messages_of_servers_are_shown() {
    let address = server(9, |_, socket| {
        answering(socket, |_, _| {
            Some(Message::text("Traceback (most recent call last):\nValueError: bad key"))
        });
    });
    let output = fails(&address, "");
    assert!(output.contains("reported an error:") && output.contains("ValueError: bad key"), "{output}");
}

#[test]
fn malformed_replies_are_reported() {
    let of = |value: Value| Value::Map(vec![(text("actions"), value)]);
    let floats = |n: usize| vec![0; 4 * n];
    for (reply, words) in [
        (packed(&of(array("<f4", &[10, 6], floats(60)))), "[10, 6]: too few numbers"),
        (packed(&of(array("<f4", &[0, 7], floats(0)))), "no action at all"),
        (packed(&of(array("<f4", &[10, 7], floats(3)))), "with 12 bytes"),
        (packed(&of(array("<U7", &[10, 7], floats(70)))), "dtype \"<U7\""),
        (packed(&of(text("left"))), "has text as actions"),
        (packed(&Value::Map(vec![(text("act"), Value::Nil)])), "no entry actions; it has act"),
        (packed(&Value::Nil), "is nil"),
        (Message::binary(vec![0xC1; 40]), "msgpack"),
        (Message::binary(vec![0xDD, 0xFF, 0xFF, 0xFF, 0xFF]), "msgpack"),
        (Message::binary(vec![0x91; 5000]), "msgpack"),
        (Message::binary(Vec::new()), "msgpack"),
        (
            Message::binary([&[0xDD, 0, 0x20, 0, 0][..], &[0xC0; 2 << 20]].concat()),
            "more than 1048576 values",
        ),
    ] {
        let address = server(9, move |_, socket| answering(socket, |_, _| Some(reply.clone())));
        let output = fails(&address, "");
        assert!(output.contains(words), "{words}: {output}");
    }
}

#[test]
fn huge_replies_are_refused_unread() {
    let address = server(9, |_, mut socket| {
        let _ = socket.send(packed(&Value::Map(Vec::new())));
        let _ = observation(&mut socket);
        let mut frame = vec![0x82, 127];
        frame.extend((1_u64 << 30).to_be_bytes());
        let _ = socket.get_mut().write_all(&frame);
        let megabyte = vec![0; 1 << 20];
        while socket.get_mut().write_all(&megabyte).is_ok() {}
    });
    let output = fails(&address, "");
    assert!(output.contains("more than 64 MiB"), "{output}");
}

#[test]
fn other_protocols_are_reported() {
    let address = server(9, |_, mut socket| {
        let _ = socket.send(packed(&Value::from(7)));
    });
    assert!(fails(&address, "").contains("sent a number first"), "a greeting that is not a map");
    let address = server(9, |_, socket| answering(socket, |_, seen| Some(packed(seen))));
    let output = fails(&address, "--protocol vla-eval --policy-timeout 1");
    assert!(output.contains("vla-eval"), "{output}");
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("ws://{}", listener.local_addr().expect("an address"));
    thread::spawn(move || {
        for stream in listener.incoming().flatten().take(2) {
            let mut stream = stream;
            let _ = stream.write_all(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n");
            thread::sleep(std::time::Duration::from_millis(300));
        }
    });
    assert!(fails(&address, "").contains("not a websocket server"), "a web server");
}

#[test]
fn nan_replies_fail_only_their_episode() {
    let address = server(9, |_, socket| {
        answering(socket, |count, seen| match count {
            1 => Some(packed(&actions(5, [f32::NAN; 7]))),
            _ => Some(hold(seen, 5)),
        });
    });
    let project = project();
    let output = run(&project, &address, "--episodes 2 --replan 5");
    assert_eq!(output.code, 0, "{}", output.err);
    let lines = project.lines("run/episodes.jsonl");
    assert_eq!(lines[0]["outcome"]["kind"], "error");
    assert!(
        lines[0]["outcome"]["message"].as_str().is_some_and(|m| m.contains("not finite")),
        "{}",
        lines[0]
    );
    assert_eq!((lines[0]["steps"].as_u64(), lines[0]["safety"].as_bool()), (Some(5), Some(false)));
    assert_eq!(lines[1]["outcome"]["kind"], "budget");
    assert!(project.succeeds("replay run 0/0").out.contains("byte-identical"));
}

#[test]
fn unreachable_poses_are_counted() {
    let address = server(9, |_, socket| {
        answering(socket, |_, _| Some(packed(&actions(9, [50.0, 0.0, -3.0, 0.0, 9.0, 0.0, 7.0]))))
    });
    let project = project();
    let output = run(&project, &address, "");
    assert_eq!(output.code, 3, "no command could be executed: {}", output.err);
    let record = &project.lines("run/episodes.jsonl")[0];
    assert_eq!((&record["far_commands"], &record["clamped_grips"]), (&12.into(), &12.into()));
    assert_eq!((&record["outcome"]["kind"], &record["safety"]), (&"error".into(), &false.into()));
    let message = "all 12 commands were out of reach, first: (50, 0, -3) m";
    assert!(record["outcome"]["message"].as_str().is_some_and(|text| text.starts_with(message)), "{record}");
    assert!(output.err.contains(message), "{}", output.err);
    assert!(project.succeeds("replay run 0/0").out.contains("byte-identical"));
}

#[test]
fn commands_that_are_not_executed_as_given_are_shown() {
    let address = server(9, |_, socket| {
        answering(socket, |count, seen| match count {
            0 => Some(hold(seen, 6)),
            _ => Some(packed(&actions(6, [50.0, 0.0, -3.0, 0.0, 0.0, 0.0, 255.0]))),
        });
    });
    let project = project();
    let output = run(&project, &address, "--replan 6");
    assert_eq!(output.code, 0, "{}", output.err);
    let far = "; 6 of 12 commands were out of reach, first: (50, 0, -3) m, 49.";
    assert!(output.err.contains(far), "{}", output.err);
    assert!(output.err.contains("; 6 of 12 grip values were out of range"), "{}", output.err);
    for line in [
        "6 of 12 commands were out of reach in 1 episode",
        "6 of 12 grip values were out of range in 1 episode",
    ] {
        assert!(output.out.contains(line), "{}", output.out);
    }
    project.succeeds("report run --out page");
    for page in ["page/report.md", "page/report.html"] {
        let text = project.text(page);
        assert!(
            text.contains("Commands that were not executed as given") && text.contains("(50, 0, -3) m"),
            "{page}"
        );
    }
}

#[test]
fn actions_of_eight_numbers_need_a_profile_that_states_their_length() {
    let eight = || Value::Map(vec![(text("actions"), array("<f4", &[5, 8], vec![0; 160]))]);
    let address = server(9, move |_, socket| answering(socket, |_, _| Some(packed(&eight()))));
    let refused = fails(&address, "");
    assert!(
        refused.contains("8 numbers per action are neither 7 nor the 32 of openpi's padding"),
        "{refused}"
    );
}

#[test]
fn a_dying_server_loses_no_finished_episode() {
    let whole = project();
    let address = server(9, |_, socket| answering(socket, |_, seen| Some(hold(seen, 50))));
    assert_eq!(run(&whole, &address, "--episodes 3").code, 0);
    let broken = project();
    let dying = server(1, |_, socket| answering(socket, |count, seen| (count < 3).then(|| hold(seen, 50))));
    let output = run(&broken, &dying, "--episodes 3 --policy-timeout 1");
    assert_eq!(output.code, 3, "{}", output.err);
    assert!(output.err.contains("1 of 3 episodes are in run"), "{}", output.err);
    let output = run(&broken, &address, "--episodes 3 --resume");
    assert_eq!(output.code, 0, "{}", output.err);
    for file in ["episodes.jsonl", "summary.json", "softvtbench/episodes.csv"] {
        assert_eq!(broken.text(&format!("run/{file}")), whole.text(&format!("run/{file}")), "{file}");
    }
    // The two commands ran in different folders.
    let manifest = |project: &Project| {
        let mut manifest = project.json("run/run.json");
        manifest["folder"].take();
        manifest
    };
    assert_eq!(manifest(&broken), manifest(&whole));
    let again = run(&broken, &address, "--episodes 3");
    assert!(again.code == 0 && again.err.contains("already complete"), "{}", again.err);
    // Files of finished episodes are restored from the actions, without the policy; without actions they are reported as lost.
    let log = "run/softvtbench/task_000/episode_00001/policy_action_debug.jsonl";
    let text = broken.text(log);
    std::fs::remove_file(broken.path(log)).expect("removed");
    let again = run(&broken, &address, "--episodes 3");
    assert!(again.code == 0 && again.err.contains("restoring files of 1 finished episode"), "{}", again.err);
    assert_eq!(broken.text(log), text);
    std::fs::remove_dir_all(broken.path("run/actions")).expect("removed");
    let again = run(&broken, &address, "--episodes 3");
    assert!(again.code == 0 && again.err.contains("3 finished episodes lack their actions"), "{}", again.err);
    assert_eq!(broken.text("run/episodes.jsonl"), whole.text("run/episodes.jsonl"));
}

#[test]
fn profiles_determine_the_inputs() {
    let entries = |profile: &str, words: &str| {
        let names = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
        let kept = names.clone();
        let address = server(9, move |_, socket| {
            answering(socket, |_, seen| {
                let map = seen.as_map().expect("a map");
                *kept.lock().unwrap() =
                    map.iter().map(|(k, _)| k.as_str().unwrap_or("").to_owned()).collect();
                Some(hold(seen, 50))
            });
        });
        let project = project();
        let words = format!("x.lua --policy {address} --profile {profile} --threads 1 --out run {words}");
        let output = project.softvt(&words);
        assert_eq!(output.code, 0, "{}", output.err);
        let names = names.lock().unwrap().clone();
        (names, project.json("run/summary.json"), project.json("run/run.json"))
    };
    let (vision, summary, _) = entries("vision", "");
    assert!(vision.iter().any(|k| k == "image") && vision.iter().any(|k| k == "observation/wrist_image"));
    assert!(!vision.iter().any(|k| k.contains("tactile")));
    assert_eq!(summary["force_observed"], false);
    let (touch, _, info) = entries("visuo_tactile", "--gripper binary");
    assert!(touch.iter().any(|k| k == "observation/tactile_marker_motion"));
    assert_eq!(info["profile"]["actions"]["gripper"]["binary"], true, "modality and gripper cross");
    let (released, summary, _) = entries("softvtbench", "");
    assert!(released.iter().any(|k| k == "tactile_gripper_force"));
    assert_eq!(summary["force_observed"], true);
}

#[test]
fn a_judged_run_names_its_episodes_to_the_server_by_hashes_alone() {
    let identities = |words: &str| {
        let seen = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
        let kept = seen.clone();
        let address = server(9, move |_, socket| {
            answering(socket, |_, observation| {
                let entries = observation.as_map().expect("a map").iter();
                let identity =
                    entries.clone().find(|(key, _)| key.as_str() == Some("softvt")).expect("it is sent");
                let seed = entries
                    .clone()
                    .find(|(key, _)| key.as_str() == Some("__softvtbench_rng_seed"))
                    .expect("sent");
                kept.lock().unwrap().push((identity.1.clone(), seed.1.clone()));
                Some(hold(observation, 4))
            });
        });
        let project = project();
        project.write("secret", b"correct horse battery staple");
        let output = run(&project, &address, &format!("--episodes 2 --replan 4 {words}"));
        assert_eq!(output.code, 0, "{}", output.err);
        let seen = seen.lock().unwrap();
        seen.clone()
    };
    let entry = |identity: &Value, name: &str| -> Option<Value> {
        let entries = identity.as_map().expect("a map");
        entries.iter().find(|(key, _)| key.as_str() == Some(name)).map(|(_, value)| value.clone())
    };
    let judged = identities("--seed-file secret");
    assert_eq!(judged.len(), 6, "three requests in each of two episodes");
    let ids: std::collections::BTreeSet<String> =
        judged.iter().map(|(identity, _)| entry(identity, "id").expect("a name").to_string()).collect();
    assert_eq!(ids.len(), 2, "a name per episode");
    let seeds: std::collections::BTreeSet<String> = judged.iter().map(|(_, seed)| seed.to_string()).collect();
    assert_eq!(seeds.len(), 6, "a seed per request");
    for (identity, seed) in &judged {
        let names: Vec<_> =
            identity.as_map().expect("a map").iter().map(|(key, _)| key.as_str().unwrap()).collect();
        assert_eq!(names, ["id", "step", "query", "seed", "wants_actions"]);
        assert_eq!(entry(identity, "seed").as_ref(), Some(seed));
    }
    assert_eq!(judged, identities("--seed-file secret"), "the same requests again");
    let open = identities("");
    assert!(entry(&open[0].0, "suite").is_some() && entry(&open[0].0, "id").is_none());
}

#[test]
fn lines_of_another_run_are_refused() {
    let project = project();
    let line = "x.lua --policy noop --episodes 2 --threads 1 --out run";
    project.succeeds(line);
    let (lines, info) = (project.text("run/episodes.jsonl"), project.text("run/run.json"));
    let refused = |text: &str, words: &str| {
        project.write("run/episodes.jsonl", text.as_bytes());
        let message = project.refusal(&format!("{line} --resume"));
        assert!(message.contains(words), "{message}");
    };
    refused(&format!("{lines}{lines}"), "run/episodes.jsonl:3: task 0 episode 0 occurs twice");
    refused(
        &lines.replace("\"noop\"", "\"other\""),
        "run/episodes.jsonl:1: task 0 episode 0 belongs to another run",
    );
    project.write("run/episodes.jsonl", lines.as_bytes());
    std::fs::remove_file(project.path("run/run.json")).expect("removed");
    assert!(project.refusal(&format!("{line} --resume")).contains("there is no run.json next to it"));
    project.write("run/run.json", info.as_bytes());
    assert!(project.succeeds(&format!("{line} --resume")).err.contains("already complete"));
    let message = project.refusal("x.lua --policy noop --require safety>=90");
    assert!(message.contains("a share of 1"), "{message}");
}

/// A profile with entries of several control steps, and of every kind of image.
const HISTORY: &str = r#"return softvt.profile {
  name = "history",
  inputs = {
    { keys = { "observation/state" }, source = "state", parts = { "position", "axis_angle", "closure" } },
    { keys = { "two" }, source = "camera", camera = "wrist", frames = 2 },
    { keys = { "one" }, source = "camera", camera = "wrist", frames = 1 },
    { keys = { "depth" }, source = "depth", camera = "wrist" },
    { keys = { "objects" }, source = "segmentation", camera = "wrist", frames = 3 },
    { keys = { "arm" }, source = "state", parts = { "joints", "joint_velocities", "joint_torques" }, frames = 4 },
    { keys = { "markers" }, source = "marker_motion", frames = 2 },
    { keys = { "drawn" }, source = "tactile", finger = "left", markers = "black_arrows", frames = 2 },
    { keys = { "mosaic" }, source = "tactile_image", markers = "dots" },
    { keys = { "id" }, source = "query" },
    { keys = { "seed" }, source = "query_seed" },
  },
  actions = { pose = "absolute", gripper = { open = 0, closed = 1 } },
OBSERVE}"#;

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
fn messages(greeting: Value, observe: &str, words: &str) -> (Vec<Value>, CliOutput) {
    let seen = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
    let kept = seen.clone();
    let address = server(9, move |_, mut socket| {
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
    project.write("history.lua", HISTORY.replace("OBSERVE", observe).as_bytes());
    let output = project.softvt(&format!(
        "x.lua --policy {address} --profile history.lua --threads 1 --replan 5 --policy-timeout 20 --out run --episodes 1 {words}"
    ));
    let messages = seen.lock().expect("kept").clone();
    (messages, output)
}

#[test]
fn entries_have_as_many_control_steps_as_the_profile_asks_for() {
    let (messages, output) = messages(Value::Map(Vec::new()), "", "--seed 11");
    assert_eq!((output.code, messages.len()), (0, 3), "{}", output.err);
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
    let by_server = messages(asks, "", "");
    let by_profile = messages(Value::Map(Vec::new()), "  observe_every_step = true,\n", "");
    for (messages, output) in [&by_server, &by_profile] {
        assert_eq!((output.code, messages.len()), (0, 12), "{}", output.err);
        let wants = |message: &Value| entry(entry(message, "id"), "wants_actions").as_bool();
        let asked: Vec<usize> = (0..12).filter(|step| wants(&messages[*step]) == Some(true)).collect();
        assert_eq!(asked, [0, 5, 10]);
        for step in 1..12 {
            let (before, now) = (bytes(&messages[step - 1], "one"), bytes(&messages[step], "two"));
            assert_eq!(&now[..before.len()], before, "step {step}");
            assert_eq!(entry(entry(&messages[step], "id"), "step").as_u64(), Some(step as u64));
        }
    }
    assert_eq!(by_server.0, by_profile.0);
    let wrong = Value::Map(vec![(text("observe_every_step"), text("yes"))]);
    let (_, output) = messages(wrong, "", "");
    assert_eq!(output.code, 3);
    assert!(
        output.err.contains("observe_every_step in its metadata; expected true or false"),
        "{}",
        output.err
    );
    let (_, output) =
        messages(Value::Map(Vec::new()), "  observe_every_step = true,\n", "--protocol vla-eval");
    assert_eq!(output.code, 2);
    assert!(output.err.contains("observe_every_step needs --protocol openpi"), "{}", output.err);
}
