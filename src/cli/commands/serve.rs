//! `softvt serve`: episodes of suites for external clients.

use std::{
    io::{self, ErrorKind},
    net::TcpListener,
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

use clap::{Args, value_parser};

use crate::{
    QUIET_INTERRUPT,
    args::{ProfileArgs, ScriptArgs, parse_count, parse_folder},
    error::{CliError, Exit},
    output::{eprint_notice, print_table, terminal_format},
};
use softvt_common::{cancel, episode_id::EpisodeSplit};
use softvt_report::terminal;
use softvt_runner::{PolicyConfig, RunConfig, Shard, SuiteServer};
use softvt_serve::AccessRules;

/// Environment variable with the token of the server. A flag shows it to other users of the machine.
const TOKEN: &str = "SOFTVT_TOKEN";

/// Serve episodes over a websocket for an external client: docs/serve.md
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt serve [OPTIONS] <FILE.lua>")]
pub(crate) struct ServeArgs {
    #[command(flatten)]
    pub(super) script: ScriptArgs,
    /// Local address to listen on
    #[arg(long, value_name = "HOST", default_value = "127.0.0.1")]
    host: String,
    /// Port to listen on; 0 for any free port, which the first line of output names
    #[arg(long, value_name = "PORT", default_value = "8765")]
    port: u16,
    /// Maximum number of clients; each has a thread and an episode of its own
    #[arg(long, value_name = "N", default_value = "8", value_parser = value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// List of episodes for clients that do not name one
    #[arg(long, value_name = "SPLIT", default_value = "validation")]
    split: EpisodeSplit,
    /// Token that clients send as Authorization: Bearer TOKEN [default: the variable SOFTVT_TOKEN, if set]
    #[arg(long, value_name = "TOKEN", value_parser = parse_token)]
    token: Option<String>,
    /// Send clients the true state: poses, deformation, contact forces, limits, verdict
    #[arg(long)]
    privileged: bool,
    /// End when standard input closes, as a pipe does when the process that started the server ends
    #[arg(long)]
    until_stdin_closes: bool,
    /// Serve only these tasks: indices or parts of prompts, separated by commas
    #[arg(long = "task", value_name = "TASK", value_delimiter = ',')]
    tasks: Vec<String>,
    /// Run folder of the episodes that clients step to their end; one inside per suite of a list
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    out: Option<PathBuf>,
    /// Continue the run in --out, if there is one
    #[arg(long, requires = "out")]
    resume: bool,
    /// Episodes per task of the run in --out [default: set by the suite]
    #[arg(long, value_name = "N", requires = "out", value_parser = parse_count::<u32>)]
    episodes: Option<u32>,
    /// Record only the I-th of N parts of the run; softvt merge combines them
    #[arg(long, value_name = "I/N", requires = "out")]
    shard: Option<Shard>,
    // The client is the policy.
    #[command(flatten)]
    profile: ProfileArgs,
}

/// True once standard input has closed under `--until-stdin-closes`.
static STDIN_CLOSED: AtomicBool = AtomicBool::new(false);

/// Serves the suites of a script until the process is interrupted, or its standard input closes.
pub(super) fn run(args: ServeArgs) -> Result<(), CliError> {
    match serve(args) {
        Err(end) if end.exit == Exit::Interrupted && STDIN_CLOSED.load(Ordering::Relaxed) => {
            // Without recorded episodes there is nothing to say: the client ended the server.
            end.message.strip_prefix("interrupted; ").into_iter().for_each(eprint_notice);
            Ok(())
        }
        other => other,
    }
}

/// Requests the end of the server once standard input has closed.
fn watch_stdin() -> Result<(), CliError> {
    let watch = || {
        let _ = io::copy(&mut io::stdin().lock(), &mut io::sink());
        STDIN_CLOSED.store(true, Ordering::Relaxed);
        cancel::request();
    };
    let started = thread::Builder::new().name("stdin".to_owned()).spawn(watch);
    started.map(drop).map_err(|error| CliError::input(error).prefixed("--until-stdin-closes"))
}

fn serve(args: ServeArgs) -> Result<(), CliError> {
    let run = RunConfig {
        policy: PolicyConfig::client(&args.profile.options(), args.privileged)?,
        tasks: args.tasks.clone(),
        episodes: args.episodes,
        out: args.out.clone(),
        resume: args.resume,
        shard: args.shard,
        ..args.script.clone().config()?
    }
    .load()?;
    if args.until_stdin_closes {
        watch_stdin()?;
    }
    let listener = listen(&args)?;
    let address = listener.local_addr().map_err(|error| CliError::input(error).prefixed(&args.host))?;
    let server = SuiteServer {
        listener,
        access: AccessRules::new(&args.host, address, token(&args)?),
        split: args.split,
        max_clients: usize::from(args.threads),
        cancel: Arc::default(),
    };
    let (summaries, outcome) = server.serve(&run, || -> Result<(), CliError> {
        // Without results to keep, the end of a server is no event.
        QUIET_INTERRUPT.store(run.config.out.is_none(), Ordering::Relaxed);
        out!("ws://{address}\n")
    })?;
    let format = terminal_format(false);
    summaries.iter().try_for_each(|summary| print_table(&terminal::table(summary, format)))?;
    Ok(outcome?)
}

fn token(args: &ServeArgs) -> Result<Option<String>, CliError> {
    let from_environment = || std::env::var(TOKEN).ok().filter(|token| !token.is_empty());
    let Some(token) = args.token.clone().or_else(from_environment) else { return Ok(None) };
    let valid = parse_token(&token).map_err(|error| CliError::input(format_args!("{TOKEN}: {error}")))?;
    Ok(Some(valid))
}

fn parse_token(word: &str) -> Result<String, String> {
    let is_valid = !word.is_empty() && word.len() <= 256 && word.chars().all(|c| c.is_ascii_graphic());
    let expected = "expected 1 to 256 visible ASCII characters without spaces";
    if is_valid { Ok(word.to_owned()) } else { Err(expected.to_owned()) }
}

fn listen(args: &ServeArgs) -> Result<TcpListener, CliError> {
    let ServeArgs { host, port, .. } = args;
    let bare = host.trim_start_matches('[').trim_end_matches(']');
    softvt_serve::listen(bare, *port).map_err(|error| {
        CliError::input(match error.kind() {
            ErrorKind::AddrInUse => {
                format!("--port {port}: already in use at {host}; choose another, or 0 for any free port")
            }
            ErrorKind::PermissionDenied => {
                format!("--port {port}: reserved by the system; choose one above 1023")
            }
            _ => format!("--host {host}: cannot listen on this address: {error}"),
        })
    })
}
