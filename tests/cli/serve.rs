//! `softvt serve` as a process: its end, its memory, and its flags.

use std::net::TcpListener;

use rmpv::Value;

use crate::support::{
    CliOutput, Process, Project, Small,
    client::{Client, map, text},
};

/// A server of episodes.
pub struct Server {
    pub process: Process,
    address: String,
}

impl Server {
    pub fn start(project: &Project, words: &str) -> Self {
        let mut process = project.start(&format!("serve x.lua --port 0 {words}"));
        let line = process.line();
        let address = line.strip_prefix("ws://").unwrap_or_else(|| panic!("no address: {line:?}")).to_owned();
        Self { process, address }
    }

    /// A connected client, and the hello message.
    pub fn client(&self) -> (Client, Value) {
        Client::connect(&self.address)
    }

    /// Ends the server by Ctrl-C, and returns what it printed after its address.
    #[cfg(unix)]
    pub fn interrupt(mut self) -> CliOutput {
        self.process.signal("-INT");
        self.process.wait()
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
    server.process.close_stdin();
    let output = server.process.wait();
    assert_eq!((output.code, output.out.as_str()), (0, ""), "{}", output.err);
    assert!(!output.err.contains("interrupt"), "{}", output.err);

    let mut other = Server::start(&project, "--profile vision");
    let (mut client, _) = other.client();
    other.process.close_stdin();
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
            std::fs::read_to_string(format!("/proc/{}/status", server.process.id())).expect("a process");
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
fn addresses_that_cannot_be_used_are_refused() {
    let project = project();
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address").port();
    for (words, expected) in [
        (format!("serve x.lua --port {port}"), "already in use at 127.0.0.1"),
        ("serve x.lua --host 192.0.2.7 --port 0".to_owned(), "cannot listen on this address"),
        (format!("watch x.lua --port {port}"), "choose another, or 0 for any free port"),
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
    server.process.signal("-INT");
    assert!(client.0.read().is_ok_and(|m| m.is_close()), "clients get a close frame");
    let CliOutput { code, err, .. } = server.process.wait();
    assert_eq!(code, 130, "{err}");
    assert!(!err.contains("panicked") && !err.contains("did not finish"), "{err}");
    assert!(!err.contains("interrupted") && !err.contains("finishing"), "nothing is lost: {err}");
}
