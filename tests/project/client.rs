//! A client of a server of episodes, and the messages that it sends.

use std::{
    net::TcpStream,
    time::{Duration, Instant},
};

use rmpv::Value;
use tungstenite::{Error, HandshakeError, Message, WebSocket, http::StatusCode};

/// A client with a connection to a server.
pub struct Client(pub WebSocket<TcpStream>);

impl Client {
    /// Connects to `HOST:PORT` once there is a seat, and returns the hello message too.
    pub fn connect(address: &str) -> (Self, Value) {
        let deadline = Instant::now() + Duration::from_secs(60);
        loop {
            match tungstenite::client(format!("ws://{address}"), stream(address)) {
                Ok((socket, _)) => {
                    let mut client = Self(socket);
                    let hello = client.hear();
                    assert_eq!(text(&hello, "type"), "hello");
                    return (client, hello);
                }
                // The seat of a lost client is free when its last request is finished.
                Err(HandshakeError::Failure(Error::Http(response)))
                    if response.status() == StatusCode::SERVICE_UNAVAILABLE && Instant::now() < deadline =>
                {
                    std::thread::sleep(Duration::from_millis(10));
                }
                Err(other) => panic!("{other:?}"),
            }
        }
    }

    pub fn hear(&mut self) -> Value {
        match self.0.read().expect("an answer") {
            Message::Binary(bytes) => rmpv::decode::read_value(&mut &bytes[..]).expect("msgpack"),
            other => panic!("not a message: {other:?}"),
        }
    }

    pub fn send(&mut self, value: &Value) {
        let mut bytes = Vec::new();
        rmpv::encode::write_value(&mut bytes, value).expect("packed");
        self.0.send(Message::binary(bytes)).expect("sent");
    }

    pub fn ask(&mut self, value: &Value) -> Value {
        self.send(value);
        self.hear()
    }

    /// The error message of a response.
    pub fn refused(&mut self, value: &Value) -> String {
        let answer = self.ask(value);
        assert_eq!(text(&answer, "type"), "error", "{value} is answered");
        text(&answer, "error").to_owned()
    }

    /// Starts an episode of the first task.
    pub fn reset(&mut self, episode: u64) -> Value {
        let answer = self.ask(&reset(episode));
        assert_eq!(text(&answer, "type"), "reset", "{answer}");
        answer
    }

    /// Executes actions, and returns the answer.
    pub fn step(&mut self, actions: &[[f64; 7]]) -> Value {
        let answer = self.ask(&step(actions));
        assert_eq!(text(&answer, "type"), "step", "{answer}");
        answer
    }

    /// True if the episode that these actions end was recorded.
    pub fn is_recorded(&mut self, actions: &[[f64; 7]]) -> bool {
        get(get(&self.step(actions), "info"), "recorded").as_bool().expect("the episode is over")
    }
}

/// A connection to `HOST:PORT`.
pub fn stream(address: &str) -> TcpStream {
    let stream = TcpStream::connect(address).expect("connected");
    stream.set_read_timeout(Some(Duration::from_secs(60))).expect("set");
    stream
}

pub fn map(entries: &[(&str, Value)]) -> Value {
    Value::Map(entries.iter().map(|(key, value)| (Value::from(*key), value.clone())).collect())
}

/// The request for the start of an episode of the first task.
pub fn reset(episode: u64) -> Value {
    map(&[("type", "reset".into()), ("task", 0.into()), ("episode", episode.into())])
}

/// The request for the execution of actions.
pub fn step(actions: &[[f64; 7]]) -> Value {
    map(&[("type", "step".into()), ("actions", array(&[actions.len(), 7], &actions.concat()))])
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

pub fn get<'a>(value: &'a Value, name: &str) -> &'a Value {
    let entries = value.as_map().unwrap_or_else(|| panic!("no map: {value}"));
    let found = entries.iter().find(|(key, _)| key.as_str() == Some(name));
    &found.unwrap_or_else(|| panic!("no {name} in {value}")).1
}

pub fn text<'a>(value: &'a Value, name: &str) -> &'a str {
    get(value, name).as_str().expect("text")
}
