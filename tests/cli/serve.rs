//! `softvt serve` as a process: its end, its memory, and its flags.

use std::{
    io::{BufRead, BufReader, Read},
    net::TcpListener,
    process::{Child, ChildStdout, Command, Stdio},
};

use assert_cmd::cargo::cargo_bin;
use rmpv::Value;

use crate::support::{
    CliOutput, Project, Small,
    client::{Client, map, text},
};

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

    /// A connected client, and the hello message.
    pub fn client(&self) -> (Client, Value) {
        Client::connect(&self.address)
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
}

fn project() -> Project {
    Small { task: "budget_steps = 12", ..Small::default() }.project()
}

#[test]
fn a_server_ends_with_its_standard_input_if_asked_to() {
    let project = project();
    let mut server = Server::start(&project, "--profile vision --until-stdin-closes");
    server.client().0.reset(0);
    server.close_stdin();
    let output = server.wait();
    assert_eq!((output.code, output.out.as_str()), (0, ""), "{}", output.err);
    assert!(!output.err.contains("interrupt"), "{}", output.err);

    let mut other = Server::start(&project, "--profile vision");
    let (mut client, _) = other.client();
    other.close_stdin();
    // It is there for several episodes more.
    for episode in 0..3 {
        client.reset(episode);
        other.client().0.reset(episode);
    }
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
    client.reset(0);
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
fn invalid_servers_are_refused() {
    let project = project();
    project.write(
        "e.lua",
        b"return softvt.experiment { name = \"e\", grid = { a = { 1 } }, run = function() end }",
    );
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port();
    for (words, expected) in [
        (format!("serve x.lua --port {port}"), "already in use at 127.0.0.1"),
        ("serve e.lua".to_owned(), "expected a suite or a list of suites"),
        ("serve x.lua --policy noop".to_owned(), "unexpected argument '--policy'"),
        ("serve x.lua --port 70000".to_owned(), "70000"),
        ("serve x.lua --host 192.0.2.7 --port 0".to_owned(), "cannot listen on this address"),
        ("serve x.lua --split test".to_owned(), "expected validation"),
        ("serve x.lua --shift warp=1 --port 0".to_owned(), "unknown shift \"warp\""),
        ("serve x.lua --profile pi".to_owned(), "visuo_tactile"),
        ("serve x.lua --token".to_owned(), "--token"),
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
    client.reset(0);
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
