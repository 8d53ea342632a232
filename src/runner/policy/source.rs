//! Sources of policies, and the names of those that are built in.

use std::{
    path::{Path, PathBuf},
    str::FromStr,
};

use softvt_benchmark::Teacher;
use softvt_common::text;
use softvt_dataset::layout::is_dataset;
use softvt_script::{BlindGrip, ExpertGrip};

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PolicySource {
    /// A policy that needs no file.
    Builtin(BuiltinPolicy),
    Lua(PathBuf),
    /// The address of a policy server.
    Server(String),
    /// A run folder whose actions are repeated, or a folder that contains run folders.
    Run(PathBuf),
}

impl Default for PolicySource {
    fn default() -> Self {
        Self::Builtin(BuiltinPolicy::Expert)
    }
}

impl From<Teacher> for PolicySource {
    fn from(teacher: Teacher) -> Self {
        Self::Builtin(match teacher {
            Teacher::Expert => BuiltinPolicy::Expert,
            Teacher::TactileServo => BuiltinPolicy::TactileServo,
        })
    }
}

/// Policies that need no file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BuiltinPolicy {
    Expert,
    /// The expert with a hand that closes fully.
    ExpertBinary,
    /// The expert with a hand that feels how firmly it must hold.
    TactileServo,
    /// The expert with the grip of a controller that does not feel.
    Controlled(BlindGrip),
    /// A robot that holds still.
    Noop,
    Random,
}

/// The built-in policies in the order in which they are listed, with their descriptions; that of a controller continues
/// [`BuiltinPolicy::about`].
const DESCRIPTIONS: [(BuiltinPolicy, &str); 13] = {
    use BlindGrip::{
        ContactDepth, Drives, FixedClosure, LookRetry, OneForce, OneForceForAll, SizeSeen, Weigh,
    };
    use BuiltinPolicy::{Controlled, Expert, ExpertBinary, Noop, Random, TactileServo};
    [
        (Expert, "the scripted expert of the task (privileged: it has access to ground-truth state)"),
        (ExpertBinary, "the same expert with a gripper that is either open or closed (privileged)"),
        (
            TactileServo,
            "the same expert, feeling in the tactile markers how firmly it must hold (privileged)",
        ),
        (Controlled(FixedClosure), "one closure per kind of object"),
        (Controlled(SizeSeen), "the best closure for the size of the object"),
        (Controlled(ContactDepth), "the best indentation after first contact"),
        (Controlled(OneForce), "the best force per kind of object"),
        (Controlled(OneForceForAll), "the best force for all objects of the suite"),
        (Controlled(Drives), "reads the width and the force of the finger drives"),
        (Controlled(LookRetry), "lifts, looks whether the object follows, and closes further"),
        (Controlled(Weigh), "lifts, weighs the object by the droop of the arm, and closes further"),
        (Noop, "holds still with the gripper open"),
        (Random, "moves at random"),
    ]
};

impl BuiltinPolicy {
    /// All, in the order in which they are listed.
    pub fn all() -> impl Iterator<Item = Self> + Clone {
        DESCRIPTIONS.iter().map(|(policy, _)| *policy)
    }

    /// All names, separated by commas.
    pub(super) fn names() -> String {
        Self::all().map(Self::name).collect::<Vec<_>>().join(", ")
    }

    pub fn named(name: &str) -> Option<Self> {
        Self::all().find(|policy| policy.name() == name)
    }

    /// The name that `--policy` takes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Expert => "expert",
            Self::ExpertBinary => "expert-binary",
            Self::TactileServo => "tactile-servo",
            Self::Controlled(controller) => controller.name(),
            Self::Noop => "noop",
            Self::Random => "random",
        }
    }

    /// Description, in one line.
    pub fn about(self) -> String {
        let text = DESCRIPTIONS.iter().find(|(policy, _)| *policy == self).map_or("", |(_, about)| about);
        match self {
            Self::Controlled(grip) if grip.is_constant_number() => {
                format!("the same expert with one constant number: {text} (privileged)")
            }
            Self::Controlled(_) => format!("the same expert without touch: {text} (privileged)"),
            _ => text.to_owned(),
        }
    }

    /// Grip control of scripted experts, which have access to ground-truth state.
    pub(super) fn grip_mode(self) -> Option<ExpertGrip> {
        Some(match self {
            Self::Expert => ExpertGrip::Commanded,
            Self::ExpertBinary => ExpertGrip::Binary,
            Self::TactileServo => ExpertGrip::TactileServo,
            Self::Controlled(controller) => ExpertGrip::Blind(controller),
            Self::Noop | Self::Random => return None,
        })
    }
}

impl PolicySource {
    /// As it was typed.
    pub fn word(&self) -> String {
        match self {
            Self::Builtin(policy) => policy.name().to_owned(),
            Self::Lua(path) | Self::Run(path) => path.display().to_string(),
            Self::Server(url) => url.clone(),
        }
    }
}

impl FromStr for PolicySource {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        if let Some(policy) = BuiltinPolicy::named(word) {
            return Ok(Self::Builtin(policy));
        }
        Ok(match word {
            address if address.contains("://") => Self::Server(address.to_owned()),
            file if file.ends_with(".lua") => Self::Lua(file.into()),
            data if is_dataset(Path::new(data)) => {
                return Err(format!(
                    "{data} is a dataset, not a policy; a replay simulates its demonstrations again, and an import executes \
                     those of another simulator"
                ));
            }
            folder if Path::new(folder).is_dir() => Self::Run(folder.into()),
            other => {
                let is_address = other.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok());
                let hint = match is_address {
                    true => format!("; did you mean ws://{other}?"),
                    false => suggestion(other, BuiltinPolicy::all().map(BuiltinPolicy::name)),
                };
                return Err(format!(
                    "expected {}, a Lua file such as my_policy.lua, a server such as ws://host:8000, or a run folder{hint}",
                    BuiltinPolicy::names()
                ));
            }
        })
    }
}

/// Returns the end of a message that suggests the closest known name; empty if none is close.
pub(super) fn suggestion<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> String {
    text::suggest(word, known).map_or(String::new(), |name| format!("; did you mean {name}?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_form_of_a_word_decides_what_kind_of_policy_it_is() {
        assert_eq!("ws://x:1".parse(), Ok(PolicySource::Server("ws://x:1".into())));
        assert_eq!("a/b.lua".parse(), Ok(PolicySource::Lua("a/b.lua".into())));
        assert_eq!(".".parse(), Ok(PolicySource::Run(".".into())));
        assert!("exprt".parse::<PolicySource>().unwrap_err().ends_with("did you mean expert?"));
        for policy in BuiltinPolicy::all() {
            assert_eq!(policy.name().parse(), Ok(PolicySource::Builtin(policy)));
            assert_eq!(PolicySource::Builtin(policy).word(), policy.name());
        }
    }
}
