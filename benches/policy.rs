//! Round trips to a policy server on the loopback interface.
//!
//! `cargo bench --bench policy` prints, for each profile, the latency of a response beyond the server's own time:
//! encoding, sending, receiving and decoding, over the replans of an episode in which the server holds the robot still.
//! It also evaluates a slow server (200 ms per response, one at a time) with two workers, and prints the share of time
//! in which that server was busy.

mod episode;

use std::{
    net::{TcpListener, TcpStream},
    process::{Command, Stdio},
    sync::{Arc, Mutex},
    thread,
    time::{Duration, Instant},
};

use rmpv::Value;
use softvt::{
    cancel::CancelFlag,
    policy::{
        ActionChunk, EpisodeBrief, Observation, Policy, PolicyError, SensorStreams,
        profile::Profile,
        remote::{PolicyConnections, PolicyServer, RemotePolicy, ServerProtocol},
    },
    rollout::{AssetCache, ChunkedPolicy, Episode},
};
use tungstenite::{Bytes, Message, WebSocket, accept};

/// Largest latency beyond the server's own time, ms.
const GOAL_MS: f64 = 2.0;
/// Least share of time in which a slow server is busy.
const GOAL_BUSY: f64 = 0.9;
const SLOW: Duration = Duration::from_millis(200);

/// Start and end of the computation of each response.
type Answers = Arc<Mutex<Vec<(Instant, Instant)>>>;

/// Starts a server that computes each response for a time, one at a time. Returns its address.
fn serve(delay: Duration) -> (String, Answers) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let url = format!("ws://{}", listener.local_addr().expect("an address"));
    let (answers, model) = (Answers::default(), Arc::new(Mutex::new(())));
    let kept = answers.clone();
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let (answers, model) = (answers.clone(), model.clone());
            thread::spawn(move || answer(stream, delay, &answers, &model));
        }
    });
    (url, kept)
}

fn answer(stream: TcpStream, delay: Duration, answers: &Answers, model: &Mutex<()>) {
    stream.set_nodelay(true).expect("a socket");
    let Ok(mut socket) = accept(stream) else { return };
    let _ = socket.send(packed(&Value::Map(Vec::new())));
    while let Some(bytes) = observation(&mut socket) {
        let turn = model.lock().expect("the model");
        let begun = Instant::now();
        let seen = rmpv::decode::read_value(&mut &bytes[..]).expect("msgpack");
        thread::sleep(delay);
        let message = packed(&hold(&seen));
        answers.lock().expect("answers").push((begun, Instant::now()));
        drop(turn);
        if socket.send(message).is_err() {
            return;
        }
    }
}

/// The next observation. The socket answers pings by itself.
fn observation(socket: &mut WebSocket<TcpStream>) -> Option<Bytes> {
    loop {
        match socket.read() {
            Ok(Message::Binary(bytes)) => return Some(bytes),
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            _ => return None,
        }
    }
}

fn packed(value: &Value) -> Message {
    let mut bytes = Vec::new();
    rmpv::encode::write_value(&mut bytes, value).expect("packed");
    Message::binary(bytes)
}

fn entry<'a>(map: &'a Value, wanted: &str) -> &'a Value {
    let is = |key: &Value| key.as_str() == Some(wanted) || key.as_slice() == Some(wanted.as_bytes());
    &map.as_map().expect("a map").iter().find(|(key, _)| is(key)).expect("an entry").1
}

/// Fifty actions that hold the tool.
fn hold(seen: &Value) -> Value {
    let state = entry(entry(seen, "observation/state"), "data").as_slice().expect("bytes");
    let row: Vec<u8> = state[..24].iter().copied().chain([0; 4]).collect();
    let key = |name: &str| Value::Binary(name.as_bytes().to_vec());
    let actions = Value::Map(vec![
        (key("__ndarray__"), Value::Boolean(true)),
        (key("data"), Value::Binary(row.repeat(50))),
        (key("dtype"), Value::from("<f4")),
        (key("shape"), Value::Array(vec![Value::from(50), Value::from(7)])),
    ]);
    Value::Map(vec![(Value::from("actions"), actions)])
}

/// A policy that measures the time of each response.
struct Timed<'a> {
    inner: RemotePolicy,
    took: &'a mut Vec<Duration>,
}

impl Policy for Timed<'_> {
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn streams(&self) -> SensorStreams {
        self.inner.streams()
    }

    fn reset(&mut self, brief: &EpisodeBrief) -> Result<(), PolicyError> {
        self.inner.reset(brief)
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        let start = Instant::now();
        let chunk = self.inner.act(observation);
        self.took.push(start.elapsed());
        chunk
    }
}

/// Latencies of an episode's responses beyond the server's own time, sorted, ms.
fn overheads(profile: &str) -> Vec<f64> {
    static STOP: CancelFlag = CancelFlag::new();
    let (url, answers) = serve(Duration::ZERO);
    let remote = RemotePolicy::new(Arc::new(PolicyConnections::new(PolicyServer {
        url,
        protocol: ServerProtocol::Openpi,
        profile: Profile::named(profile).expect("a profile"),
        timeout: Duration::from_secs(60),
        api_key: None,
        cancel: &STOP,
    })));
    let (spec, _) = episode::open(&episode::load(), 0, false);
    let (suite, prompt) = (spec.header.id.suite.clone(), spec.task.prompt.clone());
    let mut took = Vec::new();
    let policy = Timed { inner: remote, took: &mut took };
    let mut driver = ChunkedPolicy::new(
        Box::new(policy),
        EpisodeBrief { suite, task: 0, prompt, episode: 0, seed: 0, alias: None },
        10,
    );
    let started = Episode::start(spec, &AssetCache::default()).expect("it starts");
    started.run(&mut driver).expect("it runs");
    drop(driver);
    let answers = answers.lock().expect("answers");
    let own = answers.iter().map(|(begun, sent)| *sent - *begun);
    let mut beyond: Vec<f64> =
        took.iter().zip(own).map(|(all, own)| 1e3 * (all.saturating_sub(own)).as_secs_f64()).collect();
    beyond.sort_by(f64::total_cmp);
    beyond
}

/// Share of the time between its first and last response in which a slow server was busy, with two workers.
fn busy() -> f64 {
    let (url, answers) = serve(SLOW);
    let out = std::env::temp_dir().join(format!("softvt-bench-{}", std::process::id()));
    let status = Command::new(env!("CARGO_BIN_EXE_softvt"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args([episode::SUITE, "--task", "0", "--episodes", "4", "--threads", "2", "--policy", &url, "--out"])
        .arg(&out)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .expect("softvt runs");
    assert!(status.success(), "{status}");
    std::fs::remove_dir_all(out).expect("the run's folder");
    let answers = answers.lock().expect("answers");
    let thought: Duration = answers.iter().map(|(begun, sent)| *sent - *begun).sum();
    let (first, last) = (answers.first().expect("answers").0, answers.last().expect("answers").1);
    thought.as_secs_f64() / (last - first).as_secs_f64()
}

fn main() {
    println!("{:<16} {:>8} {:>10} {:>10} {:>10}", "profile", "replans", "median ms", "95 % ms", "most ms");
    for profile in ["vision", "visuo_tactile", "softvtbench", "libero"] {
        let ms = overheads(profile);
        let at = |share: f64| ms[((ms.len() - 1) as f64 * share).round() as usize];
        println!("{profile:<16} {:>8} {:>10.2} {:>10.2} {:>10.2}", ms.len(), at(0.5), at(0.95), at(1.0));
    }
    println!("goal: {GOAL_MS} ms");
    println!(
        "a server of {} ms per response, two workers: busy {:.1} % of the time (goal {:.0} %)",
        SLOW.as_millis(),
        1e2 * busy(),
        1e2 * GOAL_BUSY
    );
}
