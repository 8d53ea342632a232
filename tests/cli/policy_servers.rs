//! Policy servers: flags, exit codes, and what is printed of runs with them.

use std::{
    net::{TcpListener, TcpStream},
    thread,
};

use rmpv::Value;
use tungstenite::{Message, WebSocket, accept};

use crate::support::{Project, Small, client::array};

/// Starts a server that answers every observation with twelve actions of these numbers, and states its grip
/// code. Returns its address.
fn server(code: &'static str, action: [f64; 7]) -> String {
    quitting(code, action, 0)
}

/// As [`server`], but the first `quits` second observations on a connection end it.
fn quitting(code: &'static str, action: [f64; 7], mut quits: usize) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("ws://{}", listener.local_addr().expect("an address"));
    let packed = |value: &Value| {
        let mut bytes = Vec::new();
        rmpv::encode::write_value(&mut bytes, value).expect("packed");
        Message::binary(bytes)
    };
    let reply = Value::Map(vec![("actions".into(), array(&[12, 7], &action.repeat(12)))]);
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let Ok(mut socket): Result<WebSocket<TcpStream>, _> = accept(stream) else { continue };
            let _ = socket.send(packed(&Value::Map(vec![("gripper".into(), code.into())])));
            let mut seen = 0;
            while let Ok(message) = socket.read() {
                seen += usize::from(message.is_binary());
                if quits > 0 && seen == 2 {
                    quits -= 1;
                    break;
                }
                if message.is_binary() && socket.send(packed(&reply)).is_err() {
                    break;
                }
            }
        }
    });
    address
}

fn project() -> Project {
    Small { task: "budget_steps = 12", ..Small::default() }.project()
}

#[test]
fn failures_of_servers_have_their_exit_code() {
    let free = TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("an address");
    let project = project();
    let output = project.softvt(&format!("x.lua --policy ws://{free} --policy-timeout 0.3 --out run"));
    assert_eq!((output.code, output.out.as_str()), (3, ""), "{}", output.err);
    assert!(
        output.err.contains("no policy server at ws://127.0.0.1")
            && output.err.contains("allow it more time"),
        "{}",
        output.err
    );
    let address = server("continuous", [0.0; 7]);
    let output = project.softvt(&format!("x.lua --policy {address} --profile vision --out run"));
    assert_eq!(output.code, 3, "{}", output.err);
    assert!(output.err.contains("the grip code continuous") && output.err.contains("vision reads binary"));
    assert!(!project.path("run").exists(), "nothing was finished, so nothing is left");
}

#[test]
fn commands_out_of_reach_are_printed() {
    let project = project();
    let address = server("force", [50.0, 0.0, -3.0, 0.0, 9.0, 0.0, 7.0]);
    let words = "--profile vision --gripper force --threads 1 --out run";
    let output = project.softvt(&format!("x.lua --policy {address} {words}"));
    assert_eq!(output.code, 3, "no command could be executed: {}", output.err);
    assert!(output.err.contains("gripper: force (profile vision)"), "{}", output.err);
    assert!(output.err.contains("all 12 commands were out of reach, first: (50, 0, -3) m"), "{}", output.err);
    assert_eq!(project.lines("run/episodes.jsonl")[0]["outcome"]["kind"], "error");
    assert!(project.succeeds("replay run 0/0").out.contains("byte-identical"));
}

#[test]
fn attempts_that_a_server_breaks_off_are_counted() {
    let project = project();
    let address = quitting("binary", [0.4, 0.0, 0.3, 3.1, 0.0, 0.0, 0.0], 2);
    let words = "--profile vision --episodes 2 --threads 1 --policy-timeout 1 --out run";
    let softvt = |more: &str| project.softvt(&format!("x.lua --policy {address} {words}{more}"));
    let output = softvt("");
    assert_eq!(output.code, 3, "{}", output.err);
    assert!(output.err.contains("0 of 2 episodes are in run"), "{}", output.err);
    assert_eq!(
        project.lines("run/attempts.jsonl").len(),
        1,
        "nothing was finished, and an attempt was begun"
    );
    assert_eq!(softvt(" --resume").code, 3);
    assert_eq!(project.lines("run/attempts.jsonl").len(), 2);
    let output = softvt(" --resume");
    assert_eq!(output.code, 0, "{}", output.err);
    let told = "1 episode took more than one attempt (most: task 0 episode 0, 3)";
    assert!(output.out.contains(told), "{}", output.out);
    let lines = project.lines("run/episodes.jsonl");
    assert_eq!((&lines[0]["attempts"], &lines[1]["attempts"]), (&3.into(), &serde_json::Value::Null));
    assert!(!project.path("run/attempts.jsonl").exists(), "the records have the numbers");
    let warned = project.succeeds("report run --out page").err;
    assert!(warned.contains(&format!("run: {told}")), "{warned}");
    assert!(project.text("page/report.md").contains(told));
    assert_eq!(project.lines("page/report.jsonl")[0]["repeated_episodes"], 1);
    assert!(project.succeeds("replay run 0/0").out.contains("byte-identical"));
}
