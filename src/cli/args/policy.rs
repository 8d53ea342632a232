//! Arguments that select the policy.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use clap::{Args, ValueEnum, value_parser};

use crate::{dataset::layout::is_dataset, policy::profile::PROFILES, text};

/// Profile of a policy server unless `--profile` names another.
pub(crate) const DEFAULT_PROFILE: &str = "visuo_tactile";

/// Built-in policies with a line about each.
pub(crate) const POLICIES: [(&str, &str); 5] = [
    ("expert", "the scripted expert of the task (privileged: it has access to ground-truth state)"),
    ("expert-binary", "the same expert with a gripper that is either open or closed (privileged)"),
    ("tactile-servo", "the same expert, closing until the tactile markers show a firm grasp (privileged)"),
    ("noop", "holds still with the gripper open"),
    ("random", "moves at random"),
];

// The policy, and how it is connected.
#[derive(Args, Clone, Debug)]
pub(crate) struct PolicyArgs {
    /// Policy that controls the robot: a name (softvt list policies), a Lua file, a server such as ws://host:8000, or a run folder whose actions are repeated
    #[arg(long, value_name = "POLICY", default_value = "expert", value_parser = parse_policy)]
    pub policy: PolicyArg,
    /// Observations and action encoding of a policy server: a name (softvt list profiles) or a Lua file [default: visuo_tactile]
    #[arg(long, value_name = "PROFILE", value_parser = parse_profile)]
    pub profile: Option<String>,
    /// Protocol of a policy server [default: openpi]
    #[arg(long, value_name = "PROTOCOL")]
    pub protocol: Option<ProtocolArg>,
    /// Override the gripper mode of the profile
    #[arg(long, value_name = "MODE")]
    pub gripper: Option<GripperArg>,
    /// Actions executed from each predicted chunk [default: 10 for servers]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..))]
    pub replan: Option<u16>,
    /// Timeout in seconds, for connecting and for each reply [default: 60]
    #[arg(long, value_name = "SECONDS", value_parser = parse_timeout)]
    pub policy_timeout: Option<Duration>,
    /// Policy name shown in the results
    #[arg(long, value_name = "NAME", value_parser = parse_name)]
    pub name: Option<String>,
}

/// Value of `--policy`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum PolicyArg {
    Expert(GripMode),
    Noop,
    Random,
    /// A policy in Lua.
    Lua(PathBuf),
    /// The address of a policy server.
    Server(String),
    /// A run folder, or a folder that contains run folders.
    Run(PathBuf),
}

/// Gripper control of the scripted experts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum GripMode {
    /// The closure that the expert commands.
    Commanded,
    /// Either open or closed.
    Binary,
    /// Closes until the tactile sensors show a firm grasp.
    TactileServo,
}

impl GripMode {
    /// Name of the expert with this gripper control, as `--policy` takes it.
    pub(crate) fn policy_name(self) -> &'static str {
        match self {
            Self::Commanded => "expert",
            Self::Binary => "expert-binary",
            Self::TactileServo => "tactile-servo",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ProtocolArg {
    Openpi,
    VlaEval,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum GripperArg {
    Binary,
    Continuous,
}

impl PolicyArg {
    /// As it was typed.
    pub(crate) fn word(&self) -> String {
        match self {
            Self::Expert(mode) => mode.policy_name().to_owned(),
            Self::Noop => "noop".to_owned(),
            Self::Random => "random".to_owned(),
            Self::Lua(path) | Self::Run(path) => path.display().to_string(),
            Self::Server(url) => url.clone(),
        }
    }
}

fn parse_policy(word: &str) -> Result<PolicyArg, String> {
    Ok(match word {
        "expert" => PolicyArg::Expert(GripMode::Commanded),
        "expert-binary" => PolicyArg::Expert(GripMode::Binary),
        "tactile-servo" => PolicyArg::Expert(GripMode::TactileServo),
        "noop" => PolicyArg::Noop,
        "random" => PolicyArg::Random,
        address if address.contains("://") => PolicyArg::Server(address.to_owned()),
        file if file.ends_with(".lua") => PolicyArg::Lua(file.into()),
        data if is_dataset(Path::new(data)) => {
            return Err(format!(
                "{data} is a dataset, not a policy; to simulate its demonstrations again: softvt replay {data} 0/0 for \
                 one, softvt dataset check {data} --replay all for all; for demonstrations of another simulator: softvt \
                 dataset import SUITE.lua FILE.hdf5 --out DIR"
            ));
        }
        folder if Path::new(folder).is_dir() => PolicyArg::Run(folder.into()),
        other => {
            let known = POLICIES.map(|(name, _)| name).join(", ");
            let hint = suggestion(other, &POLICIES);
            return Err(format!(
                "expected {known}, a Lua file such as my_policy.lua, a server such as ws://host:8000, or a run folder{hint}"
            ));
        }
    })
}

fn parse_profile(word: &str) -> Result<String, String> {
    if word.ends_with(".lua") || PROFILES.iter().any(|(name, _)| *name == word) {
        return Ok(word.to_owned());
    }
    let known = PROFILES.map(|(name, _)| name).join(", ");
    let hint = suggestion(word, &PROFILES);
    Err(format!("[possible values: {known}, or a Lua file such as my_profile.lua]{hint}"))
}

/// Returns the end of a message that suggests the closest known name; empty if none is close.
fn suggestion(word: &str, known: &[(&str, &str)]) -> String {
    let close = text::suggest(word, known.iter().map(|(name, _)| *name));
    close.map_or(String::new(), |name| format!("; did you mean {name}?"))
}

fn parse_timeout(word: &str) -> Result<Duration, String> {
    let seconds = word.parse().ok().filter(|seconds| (0.01..=86_400.0).contains(seconds));
    seconds.map(Duration::from_secs_f64).ok_or_else(|| "expected seconds in 0.01..86400".to_owned())
}

fn parse_name(word: &str) -> Result<String, String> {
    let is_valid = !word.trim().is_empty() && word.len() <= 80 && !word.chars().any(char::is_control);
    if is_valid { Ok(word.to_owned()) } else { Err("expected a name of 1 to 80 characters".to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_form_of_a_word_decides_what_kind_of_policy_it_is() {
        assert_eq!(parse_policy("ws://x:1"), Ok(PolicyArg::Server("ws://x:1".into())));
        assert_eq!(parse_policy("a/b.lua"), Ok(PolicyArg::Lua("a/b.lua".into())));
        assert_eq!(parse_policy("."), Ok(PolicyArg::Run(".".into())));
        assert!(parse_policy("exprt").unwrap_err().ends_with("did you mean expert?"));
        assert!(parse_profile("visoin").unwrap_err().ends_with("did you mean vision?"));
        for (name, _) in POLICIES {
            assert_eq!(parse_policy(name).unwrap().word(), name);
        }
    }
}
