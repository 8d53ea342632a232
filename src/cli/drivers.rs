//! Who drives: what `--policy` names, made ready for many episodes.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use super::{Failure, code};
use crate::{
    benchmark::seed::Stream,
    policy::{
        Action, Chunked, Policy, PolicyError, TaskBrief, builtin,
        profile::Profile,
        recorded::Recorded,
        remote::{Connections, Protocol, Remote, Server},
    },
    report::{
        actions,
        runs::{self, StoredRun},
    },
    rollout::{Controller, stop},
    script::{self, ExpertController},
};

/// Policies that need no server and no file.
pub const POLICIES: [(&str, &str); 4] = [
    ("expert", "the task's scripted expert (privileged: it sees the true state)"),
    ("expert-binary", "the same expert with a gripper that is only open or shut (privileged)"),
    ("noop", "holds still with the gripper open"),
    ("random", "wanders at random"),
];

/// The flags about a policy.
#[derive(Clone, Debug)]
pub struct Choice {
    /// What `--policy` says.
    pub word: String,
    /// How results call it, if `--name` says.
    pub name: Option<String>,
    /// `--profile`.
    pub profile: String,
    /// `--protocol`.
    pub protocol: Protocol,
    /// `--replan`.
    pub replan: usize,
    /// `--gripper`: whether the policy's gripper is only open or shut, if that is to differ from its profile.
    pub binary: Option<bool>,
    /// `--policy-timeout`.
    pub patience: Duration,
}

impl Choice {
    /// The tasks' experts.
    pub fn expert() -> Self {
        Self {
            word: "expert".to_owned(),
            name: None,
            profile: String::new(),
            protocol: Protocol::default(),
            replan: 1,
            binary: None,
            patience: Duration::ZERO,
        }
    }

    /// Recorded actions that somebody else hands over.
    pub fn replay() -> Self {
        Self { word: "noop".to_owned(), name: Some("replay".to_owned()), ..Self::expert() }
    }

    /// Whether it carries out what a run recorded.
    pub fn is_recorded(&self) -> bool {
        !is_built_in(&self.word) && is_run(&self.word)
    }

    /// How results call it.
    pub fn name(&self) -> &str {
        match &self.name {
            Some(name) => name,
            None if self.is_remote() => &self.profile,
            None if self.is_recorded() => "replay",
            None => &self.word,
        }
    }

    /// Whether it sees the true state.
    pub fn is_privileged(&self) -> bool {
        matches!(self.word.as_str(), "expert" | "expert-binary")
    }

    /// Whether it answers over a network.
    pub fn is_remote(&self) -> bool {
        self.word.contains("://")
    }

    /// The profile, if the policy has one.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn profile(&self) -> Result<Option<Profile>, Failure> {
        if !self.is_remote() {
            return Ok(None);
        }
        let mut profile = Profile::named(&self.profile)
            .ok_or_else(|| Failure::input(format!("--profile {}: there is none", self.profile)))?;
        if let Some(binary) = self.binary {
            profile.actions.gripper.binary = binary;
        }
        Ok(Some(profile))
    }
}

/// Makes whoever drives an episode.
pub struct Drivers {
    choice: Choice,
    connections: Option<Arc<Connections>>,
    recorded: Vec<StoredRun>,
}

impl Drivers {
    /// Connects, if there is anyone to connect to.
    ///
    /// # Errors
    /// The profile does not exist, the server cannot be reached.
    pub fn new(choice: &Choice) -> Result<Self, Failure> {
        let connections = match choice.profile()? {
            None => None,
            Some(profile) => {
                let connections = Connections::new(Server {
                    url: choice.word.clone(),
                    protocol: choice.protocol,
                    profile,
                    patience: choice.patience,
                    api_key: std::env::var(API_KEY).ok(),
                    stop: &stop::FLAG,
                });
                connections.try_out().map_err(policy_failure)?;
                Some(Arc::new(connections))
            }
        };
        let recorded = match choice.is_recorded() {
            true => runs::load(Path::new(&choice.word)).map_err(Failure::input)?,
            false => Vec::new(),
        };
        Ok(Self { choice: choice.clone(), connections, recorded })
    }

    /// Whoever drives the episode `brief`.
    ///
    /// # Errors
    /// The task has no expert, or it does not start.
    pub fn drive(&self, opened: script::Episode, brief: TaskBrief) -> Result<Box<dyn Controller>, Failure> {
        let chunked = |policy: Box<dyn Policy>, brief| -> Box<dyn Controller> {
            Box::new(Chunked::new(policy, brief, self.choice.replan))
        };
        if let Some(connections) = &self.connections {
            return Ok(chunked(Box::new(Remote::new(connections.clone())), brief));
        }
        if self.choice.is_recorded() {
            let actions = self.actions_of(&brief)?;
            return Ok(Box::new(Chunked::new(Box::new(Recorded::new(actions, None)), brief, 1)));
        }
        match self.choice.word.as_str() {
            "noop" => Ok(chunked(Box::<builtin::Noop>::default(), brief)),
            "random" => {
                let mut stream = opened.seed.stream(Stream::Script);
                Ok(chunked(Box::new(builtin::Random::new(rand::RngCore::next_u64(&mut stream))), brief))
            }
            policy => {
                let expert = opened.expert().map_err(Failure::input)?;
                let expert = expert.ok_or_else(|| Failure::input("the task has no expert"))?;
                Ok(Box::new(ExpertController::new(expert, policy == "expert-binary")))
            }
        }
    }
}

impl Drivers {
    /// What was recorded of an episode.
    fn actions_of(&self, brief: &TaskBrief) -> Result<Vec<Action>, Failure> {
        let run = self.recorded.iter().find(|run| run.text("suite") == brief.suite).or(self.recorded.first());
        let dir = run.map_or_else(|| PathBuf::from(&self.choice.word), |run| run.dir.clone());
        actions::read(&actions::path(&dir, brief.task, brief.episode)).map_err(Failure::input)
    }
}

fn is_built_in(word: &str) -> bool {
    POLICIES.iter().any(|(name, _)| *name == word)
}

/// Whether a folder holds a run, or runs.
fn is_run(word: &str) -> bool {
    Path::new(word).is_dir()
}

/// Where a server's key comes from: not from the command line, which others can read.
const API_KEY: &str = "SOFTVT_API_KEY";

fn policy_failure(error: PolicyError) -> Failure {
    match error {
        PolicyError::Interrupted => Failure::interrupted("interrupted"),
        PolicyError::Address(message) => Failure::input(message),
        other => Failure { code: code::POLICY, message: other.to_string() },
    }
}

/// What may stand behind `--policy`.
///
/// # Errors
/// A fragment for people.
pub fn policy_word(word: &str) -> Result<String, String> {
    if is_built_in(word) || word.contains("://") || is_run(word) {
        return Ok(word.to_owned());
    }
    let known = POLICIES.map(|(name, _)| name).join(", ");
    let near = POLICIES.iter().map(|(name, _)| (strsim::jaro_winkler(name, word), *name));
    let meant = near.filter(|(alike, _)| *alike > 0.8).max_by(|a, b| a.0.total_cmp(&b.0));
    let hint = meant.map_or(String::new(), |(_, name)| format!("; did you mean {name}?"));
    Err(format!("expected {known}, a server such as ws://host:8000, or the folder of a run{hint}"))
}
