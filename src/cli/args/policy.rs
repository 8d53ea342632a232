//! Who is to drive, from what was typed: `--policy` and the flags that go with it, read once and checked.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use crate::{
    cli::{
        commands::dataset::is_dataset,
        error::CliError,
        run::{
            policy::{GripMode, PolicyConfig, PolicyKind, RemotePolicyConfig},
            recorded_policy::RecordedRuns,
        },
    },
    policy::{
        profile::{PROFILES, Profile},
        remote::Protocol,
    },
    script::{PolicyFile, load_profile},
    text,
};

/// Policies that need no server and no file.
pub(crate) const POLICIES: [(&str, &str); 5] = [
    ("expert", "the task's scripted expert (privileged: it sees the true state)"),
    ("expert-binary", "the same expert with a gripper that is only open or shut (privileged)"),
    ("tactile-servo", "the same expert, closing until its fingers feel that the grasp holds (privileged)"),
    ("noop", "holds still with the gripper open"),
    ("random", "wanders at random"),
];

/// What `--policy` names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum PolicySpec {
    /// The task's expert.
    Expert(GripMode),
    /// Who holds still.
    Noop,
    /// Who wanders.
    Random,
    /// A policy in Lua.
    Lua(PathBuf),
    /// An address.
    Server(String),
    /// The folder of a run, or of several.
    Run(PathBuf),
}

/// What was typed about a policy; what was not is none.
#[derive(Clone, Debug)]
pub(crate) struct PolicyArgs {
    /// `--policy`.
    pub word: PolicySpec,
    /// `--name`.
    pub name: Option<String>,
    /// `--profile`.
    pub profile: Option<String>,
    /// `--protocol`.
    pub protocol: Option<Protocol>,
    /// `--replan`.
    pub replan: Option<usize>,
    /// `--gripper`: whether it is only open or shut.
    pub binary: Option<bool>,
    /// `--policy-timeout`.
    pub patience: Option<Duration>,
}

/// Actions of a server's answers that are carried out, unless somebody says otherwise.
pub(crate) const REPLAN: usize = 10;
/// The profile that a server gets, unless somebody says otherwise.
pub(crate) const PROFILE: &str = "visuo_tactile";
/// Longest wait for a server, unless somebody says otherwise.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// What stands behind `--policy`.
///
/// # Errors
/// A fragment for people.
pub(crate) fn policy_word(word: &str) -> Result<PolicySpec, String> {
    Ok(match word {
        "expert" => PolicySpec::Expert(GripMode::Told),
        "expert-binary" => PolicySpec::Expert(GripMode::Binary),
        "tactile-servo" => PolicySpec::Expert(GripMode::Servo),
        "noop" => PolicySpec::Noop,
        "random" => PolicySpec::Random,
        address if address.contains("://") => PolicySpec::Server(address.to_owned()),
        file if file.ends_with(".lua") => PolicySpec::Lua(file.into()),
        data if is_dataset(Path::new(data)) => return Err(no_driver(data)),
        folder if Path::new(folder).is_dir() => PolicySpec::Run(folder.into()),
        other => return Err(no_policy(other)),
    })
}

/// What to do with demonstrations instead of letting them drive: they begin in episodes that no run has.
fn no_driver(data: &str) -> String {
    format!(
        "{data} holds demonstrations, which drive in the episodes that they were recorded in: softvt replay {data} 0/0 simulates one \
         again, softvt dataset check {data} --replay all all of them, softvt dataset import SUITE.lua FILE.hdf5 --out DIR those \
         of another world"
    )
}

fn no_policy(word: &str) -> String {
    let known = POLICIES.map(|(name, _)| name).join(", ");
    let hint = suggestion(word, &POLICIES);
    format!(
        "expected {known}, a Lua file such as my_policy.lua, a server such as ws://host:8000, or the folder of a run{hint}"
    )
}

/// The end of a message that suggests the closest known name; empty if none is close.
fn suggestion(word: &str, known: &[(&str, &str)]) -> String {
    let close = text::suggest(word, known.iter().map(|(name, _)| *name));
    close.map_or(String::new(), |name| format!("; did you mean {name}?"))
}

/// What stands behind `--profile`: a name that is known, or a Lua file.
///
/// # Errors
/// A fragment for people.
pub(crate) fn profile_word(word: &str) -> Result<String, String> {
    if word.ends_with(".lua") || PROFILES.iter().any(|(name, _)| *name == word) {
        return Ok(word.to_owned());
    }
    let known = PROFILES.map(|(name, _)| name);
    let hint = suggestion(word, &PROFILES);
    Err(format!("[possible values: {}, or a Lua file such as my_profile.lua]{hint}", known.join(", ")))
}

/// Makes what was typed ready: reads the files that it names.
///
/// # Errors
/// A file that is wrong, a folder that holds no run, or a flag that this policy has no use for.
pub(crate) fn choose(typed: PolicyArgs) -> Result<PolicyConfig, CliError> {
    typed.refuse_unused()?;
    let PolicyArgs { word, name, .. } = &typed;
    let (driver, own) = match word {
        PolicySpec::Expert(hand) => (PolicyKind::Expert(*hand), hand.name().to_owned()),
        PolicySpec::Noop => (PolicyKind::Noop, "noop".to_owned()),
        PolicySpec::Random => (PolicyKind::Random, "random".to_owned()),
        PolicySpec::Lua(path) => {
            let file = PolicyFile::load(path).map_err(CliError::input)?;
            let replan = typed.replan.or(file.replan);
            let name = file.name.clone();
            (PolicyKind::Lua(Arc::new(file), replan), name)
        }
        PolicySpec::Server(url) => {
            let answering = typed.answering(url)?;
            let name = answering.profile.name.clone();
            (PolicyKind::Server(Arc::new(answering)), name)
        }
        PolicySpec::Run(dir) => {
            (PolicyKind::Recorded(Arc::new(RecordedRuns::load(dir)?)), "replay".to_owned())
        }
    };
    Ok(PolicyConfig::new(driver, name.clone().unwrap_or(own)))
}

impl PolicyArgs {
    /// Refuses flags that would be silently without effect.
    fn refuse_unused(&self) -> Result<(), CliError> {
        let (server, lua) =
            (matches!(self.word, PolicySpec::Server(_)), matches!(self.word, PolicySpec::Lua(_)));
        let flags = [
            ("--profile", self.profile.is_some() && !server),
            ("--protocol", self.protocol.is_some() && !server),
            ("--gripper", self.binary.is_some() && !server),
            ("--policy-timeout", self.patience.is_some() && !server),
            ("--replan", self.replan.is_some() && !server && !lua),
        ];
        let Some((flag, _)) = flags.into_iter().find(|(_, useless)| *useless) else { return Ok(()) };
        let who = match flag {
            "--replan" => "servers and Lua policies",
            _ => "policies that answer over a network",
        };
        Err(CliError::input(format!(
            "{flag}: is for {who}; --policy {} has no use for it",
            self.word.typed()
        )))
    }

    /// What is shown to whoever is not of this process, and SHA-256 of the files that say so, by name.
    ///
    /// # Errors
    /// A file that is wrong.
    pub(crate) fn profile(&self) -> Result<(Profile, BTreeMap<String, String>), CliError> {
        let word = self.profile.as_deref().unwrap_or(PROFILE);
        let (mut profile, sources) = match Profile::named(word) {
            Some(profile) => (profile, BTreeMap::new()),
            None => load_profile(Path::new(word)).map_err(CliError::input)?,
        };
        if let Some(binary) = self.binary {
            profile.actions.gripper.binary = binary;
        }
        Ok((profile, sources))
    }

    /// How a server is spoken to.
    fn answering(&self, url: &str) -> Result<RemotePolicyConfig, CliError> {
        let (profile, sources) = self.profile()?;
        Ok(RemotePolicyConfig {
            url: url.to_owned(),
            protocol: self.protocol.unwrap_or_default(),
            profile,
            profile_word: self.profile.clone().unwrap_or_else(|| PROFILE.to_owned()),
            sources,
            replan: self.replan.unwrap_or(REPLAN),
            patience: self.patience.unwrap_or(PATIENCE),
        })
    }
}

impl PolicySpec {
    /// How it was typed.
    fn typed(&self) -> String {
        match self {
            Self::Expert(hand) => hand.name().to_owned(),
            Self::Noop => "noop".to_owned(),
            Self::Random => "random".to_owned(),
            Self::Lua(path) | Self::Run(path) => path.display().to_string(),
            Self::Server(url) => url.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn typed(word: PolicySpec) -> PolicyArgs {
        PolicyArgs {
            word,
            name: None,
            profile: None,
            protocol: None,
            replan: None,
            binary: None,
            patience: None,
        }
    }

    #[test]
    fn every_policy_that_is_listed_is_known_by_its_name() {
        for (name, _) in POLICIES {
            let choice = choose(typed(policy_word(name).unwrap())).unwrap();
            assert_eq!(choice.name(), name);
            assert_eq!(choice.is_privileged(), name.starts_with("expert") || name == "tactile-servo");
        }
    }

    #[test]
    fn words_are_told_apart_by_their_form() {
        assert_eq!(policy_word("ws://x:1"), Ok(PolicySpec::Server("ws://x:1".into())));
        assert_eq!(policy_word("a/b.lua"), Ok(PolicySpec::Lua("a/b.lua".into())));
        assert_eq!(policy_word("."), Ok(PolicySpec::Run(".".into())));
        assert!(policy_word("exprt").unwrap_err().ends_with("did you mean expert?"));
        assert!(profile_word("visoin").unwrap_err().ends_with("did you mean vision?"));
    }

    #[test]
    fn a_flag_that_would_do_nothing_is_refused() {
        let said = |typed: PolicyArgs| choose(typed).unwrap_err().message;
        let noop = || typed(PolicySpec::Noop);
        assert_eq!(
            said(PolicyArgs { replan: Some(3), ..noop() }),
            "--replan: is for servers and Lua policies; --policy noop has no use for it"
        );
        for (flag, typed) in [
            ("--profile", PolicyArgs { profile: Some("vision".into()), ..noop() }),
            ("--protocol", PolicyArgs { protocol: Some(Protocol::VlaEval), ..noop() }),
            ("--gripper", PolicyArgs { binary: Some(true), ..typed(PolicySpec::Lua("x.lua".into())) }),
            (
                "--policy-timeout",
                PolicyArgs { patience: Some(PATIENCE), ..typed(PolicySpec::Expert(GripMode::Servo)) },
            ),
        ] {
            assert!(said(typed).starts_with(&format!("{flag}: is for policies that answer")));
        }
    }
}
