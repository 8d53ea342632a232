//! Arguments of the commands that run a script's plan.

use std::path::PathBuf;

use clap::{Args, Parser, ValueEnum, value_parser};

use super::{
    policy::PolicyArgs,
    values::{Requirement, Shard, TraceDetail, VideoSelection, parse_count, parse_folder, parse_seed},
};
use crate::evaluation::episode_id::Split;

// The script, and changes of its scenes and their physics.
#[derive(Args, Clone, Debug)]
pub(crate) struct ScriptArgs {
    /// Script that returns the plan: a suite, a list of suites, conditions or an experiment
    #[arg(value_name = "FILE.lua")]
    pub file: PathBuf,
    /// Values of the options that the script declares, as `--name=value`. Filled in after parsing.
    #[arg(skip)]
    pub options: Vec<String>,
    /// Base seed
    #[arg(long, value_name = "S", default_value = "0", allow_hyphen_values = true, value_parser = parse_seed)]
    pub seed: u64,
    /// Scene changes that the suite declares, such as stiffness=0.5
    #[arg(long = "shift", value_name = "NAME=VALUE", value_delimiter = ',')]
    pub shifts: Vec<String>,
    /// Make every soft object rigid, with the same shape, mass and appearance
    #[arg(long, value_name = "KIND")]
    pub twin: Option<Twin>,
    /// Change a setting, such as robot.gripper.effort=20
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub settings: Vec<String>,
}

/// Variants of a suite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Twin {
    Rigid,
}

/// A safety-aware visuo-tactile manipulation benchmark for soft objects, on an ordinary CPU
#[derive(Clone, Debug, Parser)]
#[command(
    name = "softvt",
    version,
    override_usage = "softvt [OPTIONS] <FILE.lua>\n       softvt <COMMAND>",
    subcommand_negates_reqs = true,
    args_conflicts_with_subcommands = true,
    after_help = "softvt FILE.lua --help also lists the options of that script. docs/cli.md is the reference.\n\
                  Exit codes: 0 success, 1 internal error (bug), 2 invalid input, 3 policy or connection failed, \
                  99 --require not met, 130 interrupted."
)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub script: ScriptArgs,
    #[command(flatten)]
    pub policy: PolicyArgs,
    /// Run only these tasks: indices or parts of prompts, separated by commas
    #[arg(long = "task", value_name = "TASK", value_delimiter = ',')]
    pub tasks: Vec<String>,
    /// Episodes per task [default: set by the suite]
    #[arg(long, value_name = "N", value_parser = parse_count)]
    pub episodes: Option<u32>,
    /// Number of threads; results do not depend on it [default: number of processors]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Record every control step; =nodes adds node positions
    #[arg(long, value_name = "DETAIL", num_args = 0..=1, require_equals = true, default_missing_value = "state")]
    pub trace: Option<TraceDetail>,
    /// Render videos of unsafe episodes; =all for all, =0,3 for these episodes of each task
    #[arg(long, value_name = "WHICH", num_args = 0..=1, require_equals = true, default_missing_value = "failed")]
    pub video: Option<VideoSelection>,
    /// Output folder; must not already contain a run [default: the next runs/<suite>-<policy>-NNN]
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    pub out: Option<PathBuf>,
    /// Continue the interrupted run in --out, if there is one
    #[arg(long, requires = "out")]
    pub resume: bool,
    /// Run the I-th of N parts; softvt merge combines them
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Condition on the results of each suite, such as "safety>=0.9"; exit code 99 if it does not hold
    #[arg(long = "require", value_name = "CONDITION")]
    pub requirements: Vec<Requirement>,
    /// Print JSON: an object for a suite or for conditions, an array for a list of suites, one line per row of an experiment
    #[arg(long)]
    pub json: bool,
}

/// Check a script without running it
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt check [OPTIONS] <FILE.lua>")]
pub(crate) struct CheckArgs {
    #[command(flatten)]
    pub script: ScriptArgs,
    #[command(flatten)]
    pub policy: PolicyArgs,
}

/// Render one episode: a video, and stills of every camera and tactile sensor
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt view [OPTIONS] --out <DIR> <FILE.lua>")]
pub(crate) struct ViewArgs {
    #[command(flatten)]
    pub script: ScriptArgs,
    #[command(flatten)]
    pub policy: PolicyArgs,
    /// The task: its index or part of its prompt
    #[arg(long, value_name = "TASK", default_value = "0")]
    pub task: String,
    /// Episode of the task
    #[arg(long, value_name = "N", default_value = "0")]
    pub episode: u32,
    /// Stills at the native size of the cameras: 1024 and 512 pixels instead of 224
    #[arg(long)]
    pub native: bool,
    /// Output folder
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    pub out: PathBuf,
}

/// Serve episodes over a websocket for an external client: docs/serve.md
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt serve [OPTIONS] <FILE.lua>")]
pub(crate) struct ServeArgs {
    #[command(flatten)]
    pub script: ScriptArgs,
    /// Local address to listen on
    #[arg(long, value_name = "HOST", default_value = "127.0.0.1")]
    pub host: String,
    /// Port to listen on; 0 for any free port, which the first line of output names
    #[arg(long, value_name = "PORT", default_value = "8765")]
    pub port: u16,
    /// Maximum number of clients; each has a thread and an episode of its own
    #[arg(long, value_name = "N", default_value = "8", value_parser = value_parser!(u16).range(1..=1024))]
    pub threads: u16,
    /// List of episodes for clients that do not name one
    #[arg(long, value_name = "SPLIT", default_value = "validation")]
    pub split: Split,
    /// Send clients the true state: poses, deformation, contact forces, limits, verdict
    #[arg(long)]
    pub privileged: bool,
    // Only the profile and the gripper mode apply: the client is the policy. The other flags are hidden and refused.
    #[command(flatten)]
    pub policy: PolicyArgs,
}
