//! Flags of runs, and the configuration of a run: its flags with their values checked and its policy loaded.

use std::{
    fmt,
    io::{ErrorKind, Read},
    path::{Path, PathBuf},
    str::FromStr,
};

use clap::{Args, ValueEnum, value_parser};

use crate::{
    error::CliError,
    output::eprint_notice,
    run::{
        episode_artifacts::VideoSelection,
        plan_flags::{self, GivenFlag},
        policy::{PolicyArgs, PolicyConfig},
        requirement::Requirement,
    },
};
use softvt_benchmark::{ShiftValue, Suite, seed::SecretSeed};
use softvt_script::{LoadedScript, STANDARD_VARIATION};

// The script, and changes of its scenes and their physics. A doc comment would replace the description of the commands
// that this struct is flattened into.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct ScriptArgs {
    /// Script that returns the plan: a suite, a list of suites, conditions or an experiment
    #[arg(value_name = "FILE.lua")]
    pub file: PathBuf,
    /// Values of the options that the script declares, as `--name=value`. Filled in after parsing.
    #[arg(skip)]
    pub options: Vec<String>,
    /// Flags of the command that are given. Filled in after parsing.
    #[arg(skip)]
    pub given: Vec<GivenFlag>,
    /// Base seed
    #[arg(long, value_name = "S", default_value = "0", allow_hyphen_values = true, value_parser = parse_seed)]
    pub seed: u64,
    /// Secret base seed of a judged run: any file, such as 32 random bytes. Results hold its hash: docs/policies.md#judged-runs
    #[arg(long, value_name = "FILE", conflicts_with = "seed")]
    pub seed_file: Option<PathBuf>,
    /// Scene changes that the suite declares, such as stiffness=0.5
    #[arg(long = "shift", value_name = "NAME=VALUE", value_delimiter = ',')]
    pub shifts: Vec<String>,
    /// Make every soft object rigid, with the same shape, mass and appearance
    #[arg(long, value_name = "KIND")]
    pub twin: Option<Twin>,
    /// Vary the soft objects, the light and the cameras from episode to episode: by a Lua file, or by the standard ranges (scripts/variations/standard.lua)
    #[arg(long, value_name = "FILE.lua", num_args = 0..=1, require_equals = true, default_missing_value = STANDARD_VARIATION)]
    pub vary: Option<PathBuf>,
    /// Change a setting, such as robot.gripper.effort=20
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub settings: Vec<String>,
}

/// Variants of a suite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Twin {
    Rigid,
}

// The episodes of a run, and its output.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct RunFlags {
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

/// Detail of `--trace`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum TraceDetail {
    State,
    Nodes,
}

/// One of `count` parts of a run, numbered from 1: every `count`-th episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    /// True if the shard contains the `job`-th episode of the whole run, counted from 0.
    pub(crate) fn contains(&self, job: usize) -> bool {
        job % self.count == self.index - 1
    }

    /// Number of episodes of the shard, of `all` in the whole run.
    pub(crate) fn len(&self, all: usize) -> usize {
        (all + self.count - self.index) / self.count
    }

    /// Number in the whole run of the episode at a position in the shard, both from 0.
    pub(crate) fn number(&self, position: usize) -> usize {
        position * self.count + self.index - 1
    }

    /// Position in the shard of one of its episodes by its number in the whole run.
    pub(crate) fn position(&self, number: usize) -> usize {
        number / self.count
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let parts = word.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, count)) if (1..=count).contains(&index) => Ok(Self { index, count }),
            _ => Err("expected I/N with I in 1..N, such as 2/8".to_owned()),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// Configuration of a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct RunConfig {
    pub script: ScriptArgs,
    pub policy: PolicyConfig,
    pub flags: RunFlags,
    /// Shifts by name and value.
    pub shifts: Vec<ShiftValue>,
    /// Changed settings by path and value.
    pub settings: Vec<(String, String)>,
    /// Secret of a judged run. `script.seed` is then its public seed.
    pub secret: Option<SecretSeed>,
}

impl RunConfig {
    /// A run under the expert.
    ///
    /// # Errors
    /// A shift or setting that is not `NAME=VALUE`, or a seed file that cannot be read.
    pub(crate) fn new(mut script: ScriptArgs, flags: RunFlags) -> Result<Self, CliError> {
        let secret = script.seed_file.as_deref().map(read_secret).transpose()?;
        if let Some(secret) = &secret {
            script.seed = secret.public_seed();
        }
        let in_file = |error: CliError| error.prefixed(script.file.display());
        let shifts = script.shifts.iter().map(|word| parse_shift(word)).collect::<Result<_, _>>();
        let shifts = shifts.map_err(in_file)?;
        let settings = script.settings.iter().map(|word| parse_pair("--set", word)).collect::<Result<_, _>>();
        let settings = settings.map_err(in_file)?;
        Ok(Self { script, policy: PolicyConfig::default(), flags, shifts, settings, secret })
    }

    pub(crate) fn with_policy(self, policy: PolicyConfig) -> Self {
        Self { policy, ..self }
    }

    /// Loads the script, refuses flags of `command` that would do nothing for its plan, and then loads the policy.
    ///
    /// # Errors
    /// The script fails or returns no plan; a flag without effect; a policy that cannot be loaded.
    pub(crate) fn load_plan(
        self,
        command: &str,
        policy: &PolicyArgs,
    ) -> Result<(Self, LoadedScript), CliError> {
        let loaded = self.load_checked(command)?;
        Ok((self.with_policy(PolicyConfig::load(policy)?), loaded))
    }

    /// Loads the script and refuses flags of `command` that would do nothing for its plan.
    ///
    /// # Errors
    /// The script fails or returns no plan; a flag without effect.
    pub(crate) fn load_checked(&self, command: &str) -> Result<LoadedScript, CliError> {
        let mut loaded = softvt_script::load(&self.script.file, &self.script.options)?;
        plan_flags::check(command, self, &loaded.plan)?;
        self.apply_variation(&mut loaded)?;
        loaded.secret.clone_from(&self.secret);
        Ok(loaded)
    }

    /// Loads the script with its options.
    ///
    /// # Errors
    /// The script fails or returns no plan.
    pub(crate) fn load_script(&self) -> Result<LoadedScript, CliError> {
        let mut loaded = softvt_script::load(&self.script.file, &self.script.options)?;
        self.apply_variation(&mut loaded)?;
        loaded.secret.clone_from(&self.secret);
        Ok(loaded)
    }

    /// Makes the suites vary as `--vary` says.
    fn apply_variation(&self, loaded: &mut LoadedScript) -> Result<(), CliError> {
        let Some(file) = &self.script.vary else { return Ok(()) };
        let (ranges, _) =
            softvt_script::load_variation(file).map_err(|error| CliError::from(error).prefixed("--vary"))?;
        loaded.vary(&ranges).map_err(|error| self.error(format!("--vary: {error}")))
    }

    /// An error about the script.
    pub(crate) fn error(&self, message: impl fmt::Display) -> CliError {
        CliError::input(message).prefixed(self.script.file.display())
    }

    /// True if soft objects are made rigid.
    pub(crate) fn is_rigid_twin(&self) -> bool {
        self.script.twin.is_some()
    }

    pub(crate) fn threads(&self) -> usize {
        thread_count(self.flags.threads)
    }

    /// Name of a suite in results. A suite that `--vary` varies and a rigid twin have names of their own, though the
    /// places of their objects are those of the suite.
    pub(crate) fn suite_name(&self, suite: &Suite) -> String {
        let varied = if self.script.vary.is_some() { "_varied" } else { "" };
        let twin = if self.is_rigid_twin() { "_rigid_twin" } else { "" };
        format!("{}{varied}{twin}", suite.name)
    }
}

/// Shortest seed file that is not easily guessed from its hash, bytes.
const MIN_SECRET_BYTES: usize = 16;
/// Largest size of the file.
const MAX_SECRET_BYTES: u64 = 1 << 20;

/// The secret in a seed file.
///
/// # Errors
/// The file cannot be read, or is empty.
pub(crate) fn read_secret(path: &Path) -> Result<SecretSeed, CliError> {
    let refuse = |what: String| CliError::input(format!("--seed-file {}: {what}", path.display()));
    let make = "write one, for example: head -c 32 /dev/urandom > FILE";
    let mut content = Vec::new();
    // Devices such as /dev/urandom have no end.
    let read =
        std::fs::File::open(path).and_then(|file| file.take(MAX_SECRET_BYTES + 1).read_to_end(&mut content));
    read.map_err(|error| match error.kind() {
        ErrorKind::NotFound => refuse(format!("there is no such file; {make}")),
        _ => refuse(error.to_string()),
    })?;
    if content.len() as u64 > MAX_SECRET_BYTES {
        return Err(refuse(format!("it has more than {MAX_SECRET_BYTES} bytes; {make}")));
    }
    if content.is_empty() {
        return Err(refuse(format!("the file is empty; {make}")));
    }
    if content.len() < MIN_SECRET_BYTES {
        eprint_notice(format!(
            "warning: --seed-file {}: {} bytes may be guessed from their hash in the results; {make}",
            path.display(),
            content.len()
        ));
    }
    Ok(SecretSeed::new(&content))
}

/// Number of threads: the requested one, or that of the processors.
pub(crate) fn thread_count(requested: Option<u16>) -> usize {
    let available = || std::thread::available_parallelism().map_or(1, |n| n.get());
    requested.map_or_else(available, usize::from)
}

/// Parses the path of an output folder.
pub(crate) fn parse_folder(word: &str) -> Result<PathBuf, String> {
    if word.trim().is_empty() {
        return Err("expected a folder; \".\" is the working folder".to_owned());
    }
    Ok(word.into())
}

/// Parses a count of at least one.
pub(crate) fn parse_count(word: &str) -> Result<u32, String> {
    let count = word.parse().ok().filter(|count| *count > 0);
    count.ok_or_else(|| format!("expected a whole number of at least 1 and at most {}", u32::MAX))
}

fn parse_seed(word: &str) -> Result<u64, String> {
    word.parse().map_err(|_| format!("expected a whole number in 0..{}", u64::MAX))
}

fn parse_pair(flag: &str, word: &str) -> Result<(String, String), CliError> {
    match word.split_once('=') {
        Some((name, value)) if !name.is_empty() && !value.is_empty() => {
            Ok((name.to_owned(), value.to_owned()))
        }
        _ => Err(CliError::input(format!("{flag}: expected NAME=VALUE, got {word:?}"))),
    }
}

fn parse_shift(word: &str) -> Result<ShiftValue, CliError> {
    let (name, value) = parse_pair("--shift", word)?;
    match value.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(ShiftValue { name, value: number }),
        _ => Err(CliError::input(format!("--shift {name}: expected a number, got {value:?}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_partition_the_episodes() {
        let shards: Vec<Shard> = (1..=3).map(|i| format!("{i}/3").parse().unwrap()).collect();
        for job in 0..20 {
            assert_eq!(shards.iter().filter(|shard| shard.contains(job)).count(), 1);
        }
        for word in ["0/3", "4/3", "1", "a/b", "1/0", "-1/3"] {
            assert!(word.parse::<Shard>().is_err(), "{word}");
        }
        assert_eq!(shards[1].to_string(), "2/3");
    }
}
