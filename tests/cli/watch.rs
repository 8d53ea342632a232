//! `softvt watch`: who may send requests, what a page receives, and how it ends.

use std::{
    fs,
    io::{Read, Write},
    net::TcpStream,
    process::Command,
};

use assert_cmd::cargo::cargo_bin;
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use crate::support::{Process, Project, Small, refusal};

/// A process of `softvt watch` and the address of its page.
struct Page {
    process: Process,
    /// `HOST:PORT`.
    address: String,
    token: String,
}

impl Page {
    fn start(project: &Project, words: &str) -> Self {
        Self::of(project.start(&format!("watch {words}")))
    }

    fn of(mut process: Process) -> Self {
        let line = process.line();
        let url = line.strip_prefix("http://").unwrap_or_else(|| panic!("no address: {line:?}"));
        let (address, token) = url.split_once("/?token=").expect("a token");
        Self { address: address.to_owned(), token: token.to_owned(), process }
    }

    /// The status and the text of the answer to a request.
    fn request(&self, method: &str, target: &str, headers: &str, body: &str) -> (u16, String) {
        let headers = format!("{headers}Content-Length: {}\r\nConnection: close\r\n", body.len());
        self.send(&format!("{method} {target} HTTP/1.1\r\n{headers}\r\n{body}"))
    }

    /// The status and the text of the answer to a request of these bytes.
    fn send(&self, request: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(&self.address).expect("connected");
        stream.write_all(request.as_bytes()).expect("sent");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("an answer");
        let answer = String::from_utf8_lossy(&answer).into_owned();
        let status = answer.split_whitespace().nth(1).and_then(|word| word.parse().ok()).expect("a status");
        (status, answer.split_once("\r\n\r\n").map_or(String::new(), |(_, body)| body.to_owned()))
    }

    /// The answer to a request of the page itself.
    fn post(&self, path: &str, body: &Value) -> (u16, String) {
        let target = format!("{path}?token={}", self.token);
        self.request("POST", &target, &format!("Host: {}\r\n", self.address), &body.to_string())
    }

    fn feed(&self) -> Feed {
        let stream = TcpStream::connect(&self.address).expect("connected");
        let url = format!("ws://{}/feed?token={}", self.address, self.token);
        Feed(tungstenite::client(url, stream).expect("accepted").0)
    }
}

/// Messages that a page receives.
struct Feed(WebSocket<TcpStream>);

impl Feed {
    /// The JSON object of the next message.
    fn next(&mut self) -> Value {
        loop {
            let Message::Binary(bytes) = self.0.read().expect("a message") else { continue };
            let length = u32::from_le_bytes(*bytes.first_chunk().expect("a length")) as usize;
            let content: Value = serde_json::from_slice(&bytes[4..4 + length]).expect("JSON");
            let blobs = content["blobs"].as_array().expect("lengths");
            let sizes = blobs.iter().map(|blob| blob.as_u64().expect("a length").next_multiple_of(4));
            assert_eq!(bytes.len() as u64, 4 + length as u64 + sizes.sum::<u64>(), "{content}");
            return content;
        }
    }

    /// The next message of a type, and the number of states before it.
    fn until(&mut self, kind: &str) -> (Value, usize) {
        let mut states = 0;
        loop {
            let content = self.next();
            if content["type"] == kind {
                return (content, states);
            }
            states += usize::from(content["type"] == "state");
        }
    }
}

fn project() -> Project {
    Small { task: "budget_steps = 6", expert: "arm:wait(1)", ..Small::default() }.project()
}

#[test]
fn a_page_receives_the_scene_and_every_state_and_selects_episodes() {
    let project = project();
    let page = Page::start(&project, "x.lua");
    let mut feed = page.feed();
    let opened = feed.next();
    assert_eq!((&opened["type"], &opened["suites"][0]["name"]), (&json!("open"), &json!("one")));
    assert_eq!(opened["selected"], json!({ "suite": "one", "task": 0, "episode": 0, "policy": "expert" }));
    let scene = feed.next();
    let target = scene["objects"].as_array().unwrap().iter().find(|object| object["target"] == true).unwrap();
    assert_eq!(
        (&scene["type"], &target["name"], &target["soft"]),
        (&json!("scene"), &json!("cube"), &json!(0))
    );
    let (end, states) = feed.until("end");
    assert_eq!(
        (states, &end["outcome"]["kind"], &end["verdict"]["goal"]),
        (7, &json!("budget"), &json!(false))
    );

    // A second page receives all of it, and a request of one is seen by both.
    let mut other = page.feed();
    let (state, _) = other.until("state");
    assert_eq!(state["measured"]["is_crushed"], false, "the judge decides, not the page: {state}");
    assert_eq!(other.until("end").1, 6);
    assert_eq!(page.post("/select", &json!({ "suite": "one", "episode": 3, "policy": "noop" })).0, 200);
    for feed in [&mut feed, &mut other] {
        assert_eq!(feed.until("open").0["selected"]["episode"], 3);
        assert_eq!(feed.until("end").1, 7);
    }
    for (selection, expected) in [
        (json!({ "task": 99 }), "one has no task 99; its tasks are 0 to 0"),
        (json!({ "suite": "two" }), "unknown suite \"two\"; there are one"),
        (json!({ "policy": "expret" }), "did you mean \"expert\"?"),
        (json!({ "policy": "nobody" }), "unknown policy \"nobody\"; there are "),
    ] {
        let (status, text) = page.post("/select", &selection);
        assert!(status == 400 && text.contains(expected), "{status}: {text}");
        let (error, _) = feed.until("error");
        assert!(error["message"].as_str().unwrap().contains(expected), "{error}");
    }
}

#[test]
fn a_saved_script_starts_anew_and_its_errors_are_told() {
    let project = project();
    let page = Page::start(&project, "x.lua");
    let mut feed = page.feed();
    feed.until("end");
    let script = fs::read_to_string(project.path("x.lua")).unwrap();
    fs::write(project.path("x.lua"), &script[..script.len() / 2]).unwrap();
    let (error, states) = feed.until("error");
    assert!(states == 0 && error["message"].as_str().unwrap().contains("x.lua:"), "{error}");
    fs::write(project.path("x.lua"), script.replace("budget_steps = 6", "budget_steps = 8")).unwrap();
    assert_eq!(feed.until("end").1, 9);
}

#[test]
fn an_episode_is_replaced_while_it_is_simulated() {
    let project = Small { task: "budget_steps = 400", expert: "arm:wait(30)", ..Small::default() }.project();
    let page = Page::start(&project, "x.lua");
    let mut feed = page.feed();
    feed.until("state");
    assert_eq!(page.post("/select", &json!({ "episode": 2 })).0, 200);
    let (opened, _) = feed.until("open");
    assert_eq!(opened["selected"]["episode"], 2);
    feed.until("state");
}

#[test]
fn only_the_own_page_is_answered() {
    let project = project();
    let page = Page::start(&project, "x.lua");
    let Page { address, token, .. } = &page;
    let own = format!("Host: {address}\r\n");
    let get = |target: &str, headers: &str| page.request("GET", target, headers, "").0;
    assert_eq!(get(&format!("/?token={token}"), &own), 200);
    for target in ["/", "/?token=0123456789abcdef0123456789abcdef", "/feed", "/nothing"] {
        assert_eq!(get(target, &own), 401, "{target}");
    }
    // The scripts of the page have no secrets; they need the name of the server all the same.
    assert_eq!((get("/watch.js", &own), get("/watch.js", "Host: evil.example\r\n")), (200, 403));
    let other_page = format!("{own}Origin: http://evil.example\r\n");
    assert_eq!(get(&format!("/?token={token}"), &other_page), 403);
    assert_eq!(get(&format!("/feed?token={token}"), &own), 400, "no websocket");
    for (path, body) in [
        ("/drive", json!({ "translate": [0, 0, 2], "turn": 0, "close": 0 })),
        ("/drive", json!({ "translate": [0, 0] })),
        ("/select", json!({ "tusk": 1 })),
        ("/select", json!([])),
    ] {
        assert_eq!(page.post(path, &body).0, 400, "{body}");
    }
    assert_eq!(page.post("/drive", &json!({ "translate": [0, 0, -1], "turn": 0, "close": 0.5 })).0, 200);
}

#[test]
fn a_request_of_any_stated_length_leaves_the_page_open() {
    let project = project();
    let page = Page::start(&project, "x.lua");
    let Page { address, token, .. } = &page;
    let own = format!("/drive?token={token} HTTP/1.1\r\nHost: {address}\r\n");
    for (head, expected) in [
        ("/x HTTP/1.1\r\nHost: a\r\nContent-Length: 99999999999999\r\n", 403),
        (&format!("/x HTTP/1.1\r\nHost: {address}\r\nContent-Length: 99999999999999\r\n"), 401),
        (&format!("{own}Content-Length: 99999999999999\r\n"), 413),
        (&format!("{own}Expect: 100-continue\r\nContent-Length: 99999999999\r\n"), 413),
        (&format!("{own}A: {}\r\n", "b".repeat(1 << 14)), 431),
    ] {
        assert_eq!(page.send(&format!("POST {head}\r\n{{}}")).0, expected, "{head:.80}");
    }
    assert_eq!(page.post("/drive", &json!({ "translate": [0, 0, -1], "turn": 0, "close": 0.5 })).0, 200);
}

#[cfg(unix)]
#[test]
fn connections_that_say_nothing_do_not_end_the_page() {
    let project = project();
    let mut limited = Command::new("sh");
    limited.args(["-c", "ulimit -n 64; exec \"$0\" \"$@\""]).arg(cargo_bin!("softvt"));
    let page = Page::of(Process::start(limited, &project, "watch x.lua"));
    page.feed().until("end");
    // More than the process has descriptors for. They are closed at the end of the time for a request.
    let _silent: Vec<TcpStream> =
        (0..70).map(|_| TcpStream::connect(&page.address).expect("connected")).collect();
    let own = format!("Host: {}\r\n", page.address);
    assert_eq!(page.request("GET", "/watch.js", &own, "").0, 200);
    page.feed().until("end");
}

#[test]
fn a_run_is_shown_by_its_actions_and_teleoperation_is_recorded() {
    let project = project();
    project.succeeds("x.lua --out run");
    let page = Page::start(&project, "run");
    let (end, states) = page.feed().until("end");
    let record = fs::read_to_string(project.path("run/episodes.jsonl")).unwrap();
    let record: Value = serde_json::from_str(record.lines().next().unwrap()).unwrap();
    assert_eq!(
        (states as u64, &end["verdict"]["d_peak"]),
        (1 + record["steps"].as_u64().unwrap(), &record["d_peak"])
    );

    let page = Page::start(&project, "x.lua --out driven");
    let mut feed = page.feed();
    feed.until("end");
    assert_eq!(page.post("/select", &json!({ "policy": "teleop" })).0, 200);
    feed.until("open");
    assert_eq!(feed.until("end").1, 7);
    let run: Value =
        serde_json::from_str(&fs::read_to_string(project.path("driven/run.json")).unwrap()).unwrap();
    assert_eq!(
        (&run["policy"], &run["split"], &run["privileged"]),
        (&json!("teleop"), &json!("demonstration"), &json!(true))
    );
    assert_eq!(fs::read_to_string(project.path("driven/episodes.jsonl")).unwrap().lines().count(), 1);
    // The same episode is there already.
    assert_eq!(page.post("/select", &json!({ "policy": "teleop" })).0, 200);
    let (error, _) = feed.until("error");
    assert!(
        error["message"].as_str().unwrap().contains("driven has task 0 episode 0 already; select"),
        "{error}"
    );
    // The run does not include this one.
    let episodes = run["episodes"].as_u64().unwrap();
    assert_eq!(page.post("/select", &json!({ "policy": "teleop", "episode": episodes })).0, 200);
    let (error, _) = feed.until("error");
    let expected =
        format!("driven has no task 0 episode {episodes}: select one of the episodes 0 to {}", episodes - 1);
    assert!(error["message"].as_str().unwrap().contains(&expected), "{error}");
    // Its actions fit the episodes of demonstrations only.
    let message = project.refusal("x.lua --policy driven --out again");
    assert!(message.contains("its split is demonstration, that of this run validation"), "{message}");
    let message =
        refusal(project.softvt("record x.lua --policy run --demos 1 --attempts 1 --out data"), "record");
    assert!(message.contains("its split is validation, that of this run demonstration"), "{message}");
    let message =
        refusal(project.softvt("record x.lua --policy driven --demos 1 --attempts 1 --out data"), "record");
    assert!(message.contains("0 of 1 demonstration after 1 attempt"), "{message}");
}

#[test]
fn a_drive_ends_with_its_page_and_goes_on_when_it_is_loaded_again() {
    let project = Small { task: "budget_steps = 100", expert: "arm:wait(1)", ..Small::default() }.project();
    let mut page = Page::start(&project, "x.lua --out driven");
    let mut feed = page.feed();
    feed.until("end");
    let start = |page: &Page, feed: &mut Feed| {
        assert_eq!(page.post("/select", &json!({ "policy": "teleop" })).0, 200);
        feed.until("open");
        feed.until("state");
    };
    start(&page, &mut feed);
    drop(feed);
    page.process.await_message("the drive of task 0 episode 0 was not finished and is not recorded", 1);
    let mut feed = page.feed();
    let (error, _) = feed.until("error");
    assert!(error["message"].as_str().unwrap().contains("the page was closed"), "{error}");
    assert!(!project.path("driven").exists());

    start(&page, &mut feed);
    drop(feed);
    assert_eq!(page.feed().until("end").1, 101);
    page.process.await_message("[1/", 1);
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_page_though_another_reads_nothing() {
    let project = Small { task: "budget_steps = 400", ..Small::default() }.project();
    let mut page = Page::start(&project, "x.lua");
    let mut feed = page.feed();
    feed.until("scene");
    page.process.signal("-INT");
    assert_eq!(page.process.wait().code, 130);
}
