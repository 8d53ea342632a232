//! Arguments that several commands take, and the configuration of a run that they state.
//!
//! The doc comments of the fields are the help text that `--help` prints.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    str::FromStr,
    sync::Arc,
    time::Duration,
};

use clap::{Args, ValueEnum, value_parser};

use crate::{error::CliError, output::Console, parse::ScriptOptions};
use softvt_benchmark::{Plan, ShiftValue, Suite, Task, Teacher};
use softvt_common::text::is_control;
use softvt_dataset::{OptionalStream, card::KeptOutcome};
use softvt_policy::{profile::GripCode, remote::ServerProtocol};
use softvt_runner::{
    ConfiguredScript, EpisodeFilter, PolicyConfig, PolicyOptions, PolicySource, RunConfig, Shard,
    TraceDetail, parse_profile, read_secret, recording::RecordingOptions, suite_selection::select_tasks,
};
use softvt_runs::{
    requirement::Requirement,
    stored_run::{self, StoredRun},
};
use softvt_script::STANDARD_VARIATION;

// The script, and changes of its scenes and their physics. A doc comment would replace the description of the commands
// that this struct is flattened into.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct ScriptArgs {
    /// Script that returns the plan: a suite, a list of suites, conditions or an experiment
    #[arg(value_name = "FILE.lua")]
    pub file: PathBuf,
    #[command(flatten)]
    pub options: ScriptOptions,
    /// Base seed
    #[arg(long, value_name = "S", default_value = "0", allow_hyphen_values = true, value_parser = parse_seed)]
    pub seed: u64,
    /// File with the secret base seed of a judged run: docs/policies.md#judged-runs
    #[arg(long = "seed-file", value_name = "FILE", conflicts_with = "seed")]
    pub secret: Option<PathBuf>,
    /// Scene changes that the suite declares, such as stiffness=0.5
    #[arg(long = "shift", value_name = "NAME=VALUE", value_delimiter = ',')]
    pub shifts: Vec<String>,
    /// Make every soft object rigid, with the same shape, mass and appearance
    #[arg(long)]
    pub rigid_twin: bool,
    /// Vary objects, light and cameras from episode to episode, within the ranges of a Lua file or the standard ones
    #[arg(long, value_name = "FILE.lua", num_args = 0..=1, require_equals = true, default_missing_value = STANDARD_VARIATION)]
    pub vary: Option<PathBuf>,
    /// Change a setting, such as robot.gripper.effort=20
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub settings: Vec<String>,
}

// The episodes of a run, and its output.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct RunFlags {
    /// Run only these tasks: indices or parts of prompts, separated by commas
    #[arg(long = "task", value_name = "TASK", value_delimiter = ',')]
    pub tasks: Vec<String>,
    /// Episodes per task [default: set by the suite]
    #[arg(long, value_name = "N", value_parser = parse_count::<u32>)]
    pub episodes: Option<u32>,
    /// Run only these episodes of each task, counted from 0, separated by commas
    #[arg(long = "episode", value_name = "K", value_delimiter = ',', value_parser = parse_episode, conflicts_with_all = ["episodes", "shard"])]
    pub selected_episodes: Vec<u32>,
    /// Number of threads; results do not depend on it [default: number of processors]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Record every control step; =nodes adds node positions
    #[arg(long, value_name = "DETAIL", num_args = 0..=1, require_equals = true, default_missing_value = "state")]
    pub trace: Option<TraceDetail>,
    /// Render videos of unsafe episodes; =all for all, =0,3 for these episodes of each task
    #[arg(long, value_name = "WHICH", num_args = 0..=1, require_equals = true, default_missing_value = "failed")]
    pub video: Option<EpisodeFilter>,
    /// Write unsafe episodes as MCAP files for Foxglove and Rerun; =all for all, =0,3 for these episodes of each task
    #[arg(long, value_name = "WHICH", num_args = 0..=1, require_equals = true, default_missing_value = "failed")]
    pub mcap: Option<EpisodeFilter>,
    /// Output folder; must not already contain a run [default: the next runs/<suite>-<policy>-NNN]
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    pub out: Option<PathBuf>,
    /// Continue the interrupted run in --out, if there is one
    #[arg(long, requires = "out")]
    pub resume: bool,
    /// Run the I-th of N parts; softvt merge combines them
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Condition on each suite, such as "safety>=0.9"; exit code 99 if it does not hold
    #[arg(long = "require", value_name = "CONDITION")]
    pub requirements: Vec<Requirement>,
    /// Print all tasks and figures, not only tasks that failed; of an experiment all rows, not only up to 40
    #[arg(long, conflicts_with = "json")]
    pub details: bool,
    /// Print JSON; an array for a list of suites, a line per row for an experiment
    #[arg(long)]
    pub json: bool,
}

impl RunFlags {
    /// Adds the episodes and the output to a configuration.
    pub(crate) fn apply(self, config: RunConfig) -> RunConfig {
        let selected: BTreeSet<u32> = self.selected_episodes.into_iter().collect();
        RunConfig {
            tasks: self.tasks,
            episodes: self.episodes,
            selected_episodes: selected.into_iter().collect(),
            shard: self.shard,
            threads: self.threads,
            trace: self.trace,
            video: self.video,
            mcap: self.mcap,
            out: self.out,
            resume: self.resume,
            ..config
        }
    }
}

impl ScriptArgs {
    /// The configuration of the script and the changes of its scenes.
    pub(crate) fn config(self) -> Result<RunConfig, CliError> {
        let secret = self.secret.as_deref().map(read_secret).transpose()?;
        let in_file = |error: CliError| error.prefixed(self.file.display());
        Ok(RunConfig {
            shifts: parse_shifts(&self.shifts).map_err(in_file)?,
            settings: parse_pairs("--set", &self.settings).map_err(in_file)?,
            seed: self.seed,
            secret,
            rigid_twin: self.rigid_twin,
            file: self.file,
            options: self.options.words,
            vary: self.vary,
            observer: Arc::new(Console::default()),
            ..RunConfig::default()
        })
    }
}

// The policy, and how it is connected. A doc comment would replace the description of the commands.
#[derive(Args, Clone, Debug)]
pub(crate) struct PolicyArgs {
    /// Policy: a name (softvt list policies), Lua file, server such as ws://host:8000 or run [default: expert or
    /// teacher]
    #[arg(long, value_name = "POLICY")]
    policy: Option<PolicySource>,
    #[command(flatten)]
    pub connection: ConnectionArgs,
}

// The policies of a command that shows several at once. A doc comment would replace the description of the command.
#[derive(Args, Clone, Debug)]
pub(crate) struct ComparedPolicyArgs {
    /// Policy: a name, Lua file, server or run; repeated, up to four are shown side by side [default: expert]
    #[arg(id = "policy", long = "policy", value_name = "POLICY")]
    policies: Vec<PolicySource>,
    #[command(flatten)]
    connection: ConnectionArgs,
}

// Connection of policies. A doc comment would replace the description of the commands.
#[derive(Args, Clone, Debug)]
pub(crate) struct ConnectionArgs {
    #[command(flatten)]
    pub profile: ProfileArgs,
    /// Protocol of a policy server [default: openpi]
    #[arg(long, value_name = "PROTOCOL")]
    protocol: Option<ServerProtocol>,
    /// Most actions to execute of each answer [default: 10 for servers]
    #[arg(long, value_name = "N", value_parser = parse_count::<u16>)]
    replan: Option<u16>,
    /// Timeout in seconds, for connecting and for each reply [default: 60]
    #[arg(long = "policy-timeout", value_name = "SECONDS", value_parser = parse_timeout)]
    timeout: Option<Duration>,
}

// Observations and answers of a policy, wherever it runs. A doc comment would replace the description of the commands.
#[derive(Args, Clone, Debug)]
pub(crate) struct ProfileArgs {
    /// What a server observes and answers: a name (softvt list profiles) or a Lua file [default: visuo_tactile]
    #[arg(long, value_name = "PROFILE", value_parser = parse_profile)]
    profile: Option<String>,
    /// Grip code in place of that of the profile or the Lua policy: docs/policies.md
    #[arg(long, value_name = "CODE")]
    gripper: Option<GripCode>,
    /// Policy name shown in the results
    #[arg(long, value_name = "NAME", value_parser = parse_name)]
    name: Option<String>,
}

impl ProfileArgs {
    pub(crate) fn options(&self) -> PolicyOptions {
        let Self { profile, gripper, name } = self.clone();
        PolicyOptions { profile, gripper, name, ..PolicyOptions::default() }
    }
}

impl ConnectionArgs {
    fn options(&self) -> PolicyOptions {
        PolicyOptions {
            protocol: self.protocol,
            replan: self.replan,
            timeout: self.timeout,
            ..self.profile.options()
        }
    }
}

/// Largest number of policies that are shown side by side.
const MAX_POLICIES: usize = 4;

impl ComparedPolicyArgs {
    /// Loads the policies; the expert if none is named. Policies of one name get the number of their flag.
    pub(crate) fn load(&self) -> Result<Vec<PolicyConfig>, CliError> {
        let (options, count) = (self.connection.options(), self.policies.len());
        if count > MAX_POLICIES {
            bail!(
                "--policy: expected at most {MAX_POLICIES} policies side by side, got {count}; leave some out"
            );
        }
        if let Some(again) = (1..count).find(|at| self.policies[..*at].contains(&self.policies[*at])) {
            let word = self.policies[again].word();
            bail!("--policy {word}: named twice; name each policy once");
        }
        if count > 1 && options.name.is_some() {
            bail!("--name: applies to one policy; leave it out, and each is shown under its own name");
        }
        let policies = if count == 0 { &[PolicySource::default()][..] } else { &self.policies };
        let load = |options| Ok(PolicyConfig::load(&options)?);
        let mut loaded: Vec<PolicyConfig> =
            options.shared_by(policies)?.into_iter().map(load).collect::<Result<_, CliError>>()?;
        let names: Vec<String> = loaded.iter().map(|policy| policy.name.clone()).collect();
        for (number, policy) in (1..).zip(&mut loaded) {
            if names.iter().filter(|name| **name == policy.name).count() > 1 {
                policy.name = format!("{} {number}", policy.name);
            }
        }
        Ok(loaded)
    }
}

impl PolicyArgs {
    pub(crate) fn is_given(&self) -> bool {
        self.policy.is_some()
    }

    pub(crate) fn options(&self) -> PolicyOptions {
        PolicyOptions { policy: self.policy.clone().unwrap_or_default(), ..self.connection.options() }
    }

    /// The script with the policy of a check, which needs no server for its profile.
    pub(crate) fn checked(&self, run: ConfiguredScript) -> Result<ConfiguredScript, CliError> {
        let of_profile = self.connection.profile.options();
        if self.policy.is_some()
            || of_profile.profile.is_none()
            || matches!(run.script.plan, Plan::Experiment { .. })
        {
            return Ok(run.with_policy(&self.options())?);
        }
        // Options that act on servers only.
        let others = PolicyOptions { profile: None, gripper: None, name: None, ..self.options() };
        let run = run.with_policy(&others)?;
        Ok(ConfiguredScript {
            config: run.config.with_policy(PolicyConfig::client(&of_profile, false)?),
            ..run
        })
    }

    /// The options for a suite of a teacher, which `--policy` replaces.
    pub(crate) fn taught_by(&self, teacher: Teacher) -> PolicyOptions {
        let policy = self.policy.clone().unwrap_or_else(|| teacher.into());
        PolicyOptions { policy, ..self.options() }
    }

    /// The grip code that exports of a recording use. Policies that are neither servers nor in Lua have
    /// none of their own.
    pub(crate) fn take_export_code(&mut self) -> Option<GripCode> {
        let has_code = matches!(self.policy, Some(PolicySource::Server(_) | PolicySource::Lua(_)));
        let gripper = &mut self.connection.profile.gripper;
        if has_code { *gripper } else { gripper.take() }
    }
}

// Flags of all commands that create datasets.
#[derive(Args, Clone, Debug)]
pub(crate) struct RecordingArgs {
    /// Output folder: a new one, or with --resume that of an interrupted recording
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    pub out: PathBuf,
    /// Storage of images: in the HDF5 files and as videos, or only as videos
    #[arg(long, value_name = "WHERE", default_value = "hdf5")]
    pub images: ImageStorage,
    /// Leave out the true state: node positions, deformation, contacts, forces
    #[arg(long)]
    pub no_privileged: bool,
    /// Further streams of the HDF5 files, separated by commas: depth of both cameras, torques of the arm's drives
    #[arg(long, value_name = "STREAM", value_delimiter = ',')]
    pub streams: Vec<OptionalStream>,
    /// Attempts to keep: those that are safe, or all that reach the goal
    #[arg(long, value_name = "OUTCOME", default_value = "safe", hide_possible_values = true)]
    pub keep: KeptOutcome,
    /// Number of threads; the dataset does not depend on it [default: number of processors]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Continue the interrupted recording in --out, if there is one
    #[arg(long)]
    pub resume: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ImageStorage {
    Hdf5,
    Video,
}

impl RecordingArgs {
    /// The configuration of the attempts under the expert.
    pub(crate) fn config(&self, script: ScriptArgs, tasks: Vec<String>) -> Result<RunConfig, CliError> {
        if script.secret.is_some() {
            bail!("--seed-file: demonstrations are public, and so need no secret seed; use --seed");
        }
        Ok(RunConfig { tasks, threads: self.threads, ..script.config()? })
    }

    /// The recording, with the grip code of exports that name none.
    pub(crate) fn options(&self, gripper: Option<GripCode>) -> RecordingOptions {
        RecordingOptions {
            out: self.out.clone(),
            has_images: self.images == ImageStorage::Hdf5,
            has_privileged: !self.no_privileged,
            streams: self.streams.iter().copied().collect(),
            keep: self.keep,
            resume: self.resume,
            gripper,
        }
    }
}

pub(crate) fn parse_folder(word: &str) -> Result<PathBuf, String> {
    if word.trim().is_empty() {
        return Err("expected a folder; \".\" is the working folder".to_owned());
    }
    Ok(word.into())
}

pub(crate) fn parse_count<T: FromStr + From<u8> + PartialOrd>(word: &str) -> Result<T, String> {
    let count = word.parse().ok().filter(|count| *count >= T::from(1));
    count.ok_or_else(|| "expected a whole number of 1 or more".to_owned())
}

fn parse_episode(word: &str) -> Result<u32, String> {
    word.parse().map_err(|_| "expected numbers of episodes, separated by commas, as in 0,1,2".to_owned())
}

fn parse_seed(word: &str) -> Result<u64, String> {
    word.parse().map_err(|_| format!("expected a whole number in 0..{}", u64::MAX))
}

/// Names with their values. Of a name that is given twice, only the last value would count.
fn parse_pairs(flag: &str, words: &[String]) -> Result<Vec<(String, String)>, CliError> {
    let mut pairs: Vec<(String, String)> = Vec::new();
    for word in words {
        match word.split_once('=') {
            Some((name, _)) if pairs.iter().any(|(known, _)| known == name) => {
                bail!("{flag} {name}: is given twice; give it once")
            }
            Some((name, value)) if !name.is_empty() && !value.is_empty() => {
                pairs.push((name.to_owned(), value.to_owned()));
            }
            _ => bail!("{flag}: expected NAME=VALUE, got {word:?}"),
        }
    }
    Ok(pairs)
}

fn parse_shifts(words: &[String]) -> Result<Vec<ShiftValue>, CliError> {
    let shift = |(name, value): (String, String)| match value.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(ShiftValue { name, value: number }),
        _ => bail!("--shift {name}: expected a number, got {value:?}"),
    };
    parse_pairs("--shift", words)?.into_iter().map(shift).collect()
}

fn parse_timeout(word: &str) -> Result<Duration, String> {
    let seconds = word.parse().ok().filter(|seconds| (0.01..=86_400.0).contains(seconds));
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "expected seconds in 0.01..86400".to_owned())
}

fn parse_name(word: &str) -> Result<String, String> {
    let is_valid = !word.trim().is_empty() && word.len() <= 80 && !word.chars().any(is_control);
    if is_valid { Ok(word.to_owned()) } else { Err("expected a name of 1 to 80 characters".to_owned()) }
}
/// The only task that the configuration selects.
pub(crate) fn select_one_task<'a>(config: &RunConfig, suite: &'a Suite) -> Result<&'a Task, CliError> {
    let tasks = select_tasks(config, suite)?;
    let [task] = tasks[..] else {
        let ids = tasks.iter().map(|task| task.id.to_string()).collect::<Vec<_>>().join(", ");
        let word = config.tasks.join(",");
        let message = format!("--task {word:?} matches the tasks {ids}; select one by its index");
        return Err(config.error(message).into());
    };
    Ok(task)
}

/// The only run in a folder.
pub(crate) fn load_one_run(dir: &Path) -> Result<StoredRun, CliError> {
    let mut runs = stored_run::load(dir)?;
    if runs.len() > 1 {
        let names = runs.iter().map(|run| run.dir.display().to_string()).collect::<Vec<_>>().join(", ");
        bail!("{} contains several runs; select one of {names}", dir.display());
    }
    Ok(runs.remove(0))
}
