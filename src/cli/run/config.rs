//! Configuration of a run: the arguments of a command with their files read and their values checked.

use std::path::PathBuf;

use crate::{
    benchmark::{ShiftValue, Suite},
    cli::{
        args::{Requirement, RunArgs, ScriptArgs, Shard, TraceDetail, VideoSelection},
        error::CliError,
        run::policy::PolicyConfig,
    },
};

/// Configuration of a run: script, suites, policy, settings and output.
#[derive(Clone, Debug)]
pub(crate) struct RunConfig {
    /// The script.
    pub file: PathBuf,
    /// Values of the script's own options, as `--name=value`.
    pub script_options: Vec<String>,
    pub policy: PolicyConfig,
    /// Tasks to run: indices or parts of prompts. All if empty.
    pub tasks: Vec<String>,
    /// Episodes per task. `None` for the number that the suite sets.
    pub episodes: Option<u32>,
    /// Base seed.
    pub seed: u64,
    pub threads: usize,
    /// Shifts by name and value.
    pub shifts: Vec<ShiftValue>,
    /// True if soft objects are made rigid.
    pub is_rigid_twin: bool,
    /// Changed settings by path and value.
    pub settings: Vec<(String, String)>,
    pub trace: Option<TraceDetail>,
    pub video: Option<VideoSelection>,
    /// Output folder.
    pub out: Option<PathBuf>,
    /// True if an interrupted run in `out` is continued.
    pub resume: bool,
    /// The part of the run to execute. `None` for all of it.
    pub shard: Option<Shard>,
    pub requirements: Vec<Requirement>,
    /// Print JSON instead of tables.
    pub json: bool,
}

impl RunConfig {
    /// A script under a policy on one thread, with defaults for everything else.
    pub(crate) fn new(file: PathBuf, policy: PolicyConfig) -> Self {
        Self {
            file,
            policy,
            script_options: Vec::new(),
            tasks: Vec::new(),
            episodes: None,
            seed: 0,
            threads: 1,
            shifts: Vec::new(),
            is_rigid_twin: false,
            settings: Vec::new(),
            trace: None,
            video: None,
            out: None,
            resume: false,
            shard: None,
            requirements: Vec::new(),
            json: false,
        }
    }

    /// The scenes that the arguments ask for, under the expert.
    ///
    /// # Errors
    /// A shift or setting that is not `NAME=VALUE`.
    pub(crate) fn of_script(args: &ScriptArgs) -> Result<Self, CliError> {
        let in_file = |error: CliError| error.prefixed(args.file.display());
        let shifts = args.shifts.iter().map(|word| parse_shift(word)).collect::<Result<_, _>>();
        let settings = args.settings.iter().map(|word| parse_pair("--set", word)).collect::<Result<_, _>>();
        Ok(Self {
            script_options: args.options.clone(),
            seed: args.seed,
            shifts: shifts.map_err(in_file)?,
            is_rigid_twin: args.twin.is_some(),
            settings: settings.map_err(in_file)?,
            ..Self::new(args.file.clone(), PolicyConfig::expert())
        })
    }

    /// The run that `softvt FILE.lua` asks for.
    ///
    /// # Errors
    /// A value that is not valid, or a policy that cannot be loaded.
    pub(crate) fn of_run(args: &RunArgs) -> Result<Self, CliError> {
        let config = Self {
            tasks: args.tasks.clone(),
            episodes: args.episodes,
            threads: thread_count(args.threads),
            trace: args.trace,
            video: args.video.clone(),
            resume: args.resume,
            shard: args.shard,
            requirements: args.requirements.clone(),
            json: args.json,
            ..Self::of_script(&args.script)?
        };
        let config = config.with_out(args.out.clone());
        Ok(Self { policy: PolicyConfig::load(&args.policy)?, ..config })
    }

    /// Sets the output folder.
    pub(crate) fn with_out(self, out: Option<PathBuf>) -> Self {
        Self { out, ..self }
    }

    /// Name of a suite in results. A rigid twin has a name of its own, though its initial states are
    /// those of the suite.
    pub(crate) fn suite_name(&self, suite: &Suite) -> String {
        let twin = if self.is_rigid_twin { "_rigid_twin" } else { "" };
        format!("{}{twin}", suite.name)
    }
}

/// Number of threads: the requested one, or that of the processors.
pub(crate) fn thread_count(requested: Option<u16>) -> usize {
    let available = || std::thread::available_parallelism().map_or(1, |n| n.get());
    requested.map_or_else(available, usize::from)
}

fn parse_pair(flag: &str, word: &str) -> Result<(String, String), CliError> {
    let pair = word.split_once('=').filter(|(name, value)| !name.is_empty() && !value.is_empty());
    let (name, value) =
        pair.ok_or_else(|| CliError::input(format!("{flag}: expected NAME=VALUE, got {word:?}")))?;
    Ok((name.to_owned(), value.to_owned()))
}

fn parse_shift(word: &str) -> Result<ShiftValue, CliError> {
    let (name, value) = parse_pair("--shift", word)?;
    let number = value.parse::<f64>().ok().filter(|n| n.is_finite());
    let number =
        number.ok_or_else(|| CliError::input(format!("--shift {name}: expected a number, got {value:?}")))?;
    Ok(ShiftValue { name, value: number })
}
