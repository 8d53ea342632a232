//! Who drives: a policy that was select_tasks, made ready for many episodes.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use crate::{
    benchmark::seed::RandomStream,
    cli::{error::CliError, run::recorded_policy::RecordedRuns},
    policy::{
        ChunkedPolicy, Policy, PolicyError, SensorStreams, TaskBrief, builtin,
        profile::Profile,
        recorded::RecordedPolicy,
        remote::{PolicyConnections, PolicyServer, Protocol, RemotePolicy},
    },
    rollout::{Controller, cancel},
    script::{self, ExpertController, PolicyFile},
};

/// How an expert's hand closes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum GripMode {
    /// As far as the expert says.
    Told,
    /// Only open or shut.
    Binary,
    /// Until it feels that it holds something.
    Servo,
}

impl GripMode {
    /// What `--policy` calls it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Told => "expert",
            Self::Binary => "expert-binary",
            Self::Servo => "tactile-servo",
        }
    }
}

/// A policy's server and how it is spoken to.
#[derive(Debug)]
pub(crate) struct RemotePolicyConfig {
    /// Its address.
    pub url: String,
    /// How it talks.
    pub protocol: Protocol,
    /// What it gets and what its numbers mean.
    pub profile: Profile,
    /// What `--profile` said, or would have had to say.
    pub profile_word: String,
    /// SHA-256 of the files that the profile is made of.
    pub sources: BTreeMap<String, String>,
    /// Actions of each answer that are carried out.
    pub replan: usize,
    /// Longest wait for it and for each answer.
    pub patience: Duration,
}

/// Who drives.
#[derive(Clone, Debug)]
pub(crate) enum PolicyKind {
    /// The task's expert.
    Expert(GripMode),
    /// Who holds still.
    Noop,
    /// Who wanders.
    Random,
    /// A policy in Lua, and how many actions of a list are carried out if that is said.
    Lua(Arc<PolicyFile>, Option<usize>),
    /// A server.
    Server(Arc<RemotePolicyConfig>),
    /// Whatever was commanded in a run.
    Recorded(Arc<RecordedRuns>),
    /// Actions that somebody else hands over.
    Given,
}

/// Who drives, and how results call it.
#[derive(Clone, Debug)]
pub(crate) struct PolicyConfig {
    driver: PolicyKind,
    name: String,
}

impl PolicyConfig {
    /// A driver under a name.
    pub(crate) fn new(driver: PolicyKind, name: String) -> Self {
        Self { driver, name }
    }

    /// The tasks' experts.
    pub(crate) fn expert() -> Self {
        Self::new(PolicyKind::Expert(GripMode::Told), GripMode::Told.name().to_owned())
    }

    /// Recorded actions that somebody else hands over.
    pub(crate) fn replay() -> Self {
        Self::new(PolicyKind::Given, "replay".to_owned())
    }

    /// Whoever drove in another world.
    pub(crate) fn import() -> Self {
        Self::new(PolicyKind::Given, "import".to_owned())
    }

    /// A client of `softvt serve`.
    pub(crate) fn client() -> Self {
        Self::new(PolicyKind::Given, "client".to_owned())
    }

    /// How results call it.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// The hand of the tasks' experts, if they drive.
    pub(crate) fn hand(&self) -> Option<GripMode> {
        match self.driver {
            PolicyKind::Expert(hand) => Some(hand),
            _ => None,
        }
    }

    /// Whether it sees the true state.
    pub(crate) fn is_privileged(&self) -> bool {
        self.hand().is_some()
    }

    /// Whether it answers over a network.
    pub(crate) fn is_remote(&self) -> bool {
        matches!(self.driver, PolicyKind::Server(_))
    }

    /// The profile, if the policy has one.
    pub(crate) fn profile(&self) -> Option<&Profile> {
        match &self.driver {
            PolicyKind::Server(server) => Some(&server.profile),
            _ => None,
        }
    }

    /// What it looks at and where that is said, if it is known before it drives.
    pub(crate) fn looks(&self) -> Option<(String, SensorStreams)> {
        match &self.driver {
            PolicyKind::Server(server) => {
                Some((format!("--profile {}: inputs", server.profile_word), server.profile.streams()))
            }
            PolicyKind::Lua(file, _) => {
                Some((format!("{}: policy.looks", file.looks_at), file.streams.clone()))
            }
            _ => None,
        }
    }

    /// Actions of each answer that are carried out, if anybody has a say in that.
    pub(crate) fn replan(&self) -> Option<usize> {
        match &self.driver {
            PolicyKind::Server(server) => Some(server.replan),
            PolicyKind::Lua(_, replan) => *replan,
            _ => None,
        }
    }

    /// The file of a policy in Lua, as messages name it.
    pub(crate) fn file(&self) -> Option<&str> {
        match &self.driver {
            PolicyKind::Lua(file, _) => Some(&file.main),
            _ => None,
        }
    }

    /// SHA-256 of the files that the policy or its profile is made of, by name.
    pub(crate) fn sources(&self) -> BTreeMap<String, String> {
        match &self.driver {
            PolicyKind::Lua(file, _) => file.hashes(),
            PolicyKind::Server(server) => server.sources.clone(),
            _ => BTreeMap::new(),
        }
    }

    /// The runs whose actions are carried out, if any are.
    pub(crate) fn recorded(&self) -> Option<&RecordedRuns> {
        match &self.driver {
            PolicyKind::Recorded(runs) => Some(runs),
            _ => None,
        }
    }
}

/// Makes whoever drives an episode.
pub(crate) struct ControllerSource {
    choice: PolicyConfig,
    connections: Option<Arc<PolicyConnections>>,
    /// The script's name of the suite, and whether it is its twin.
    of: (String, bool),
}

impl ControllerSource {
    /// `suite` is the script's name of it, `twin` whether soft objects are rigid.
    pub(crate) fn new(choice: &PolicyConfig, suite: &str, twin: bool) -> Self {
        let connections = match &choice.driver {
            PolicyKind::Server(server) => Some(Arc::new(PolicyConnections::new(PolicyServer {
                url: server.url.clone(),
                protocol: server.protocol,
                profile: server.profile.clone(),
                timeout: server.patience,
                api_key: std::env::var(API_KEY).ok(),
                cancel: &cancel::FLAG,
            }))),
            _ => None,
        };
        Self { choice: choice.clone(), connections, of: (suite.to_owned(), twin) }
    }

    /// Connects, if there is anyone to connect to.
    ///
    /// # Errors
    /// The server cannot be reached.
    pub(crate) fn connect(&self) -> Result<(), CliError> {
        self.connections.as_ref().map_or(Ok(()), |connections| connections.check().map_err(policy_failure))
    }

    /// Whoever drives the episode `brief`.
    ///
    /// # Errors
    /// The task has no expert, or it does not start.
    pub(crate) fn drive(
        &self,
        opened: script::Episode,
        brief: TaskBrief,
    ) -> Result<Box<dyn Controller>, CliError> {
        let chunked = |policy: Box<dyn Policy>, replan| -> Box<dyn Controller> {
            Box::new(ChunkedPolicy::new(policy, brief.clone(), replan))
        };
        Ok(match (&self.choice.driver, &self.connections) {
            (PolicyKind::Server(server), Some(connections)) => {
                chunked(Box::new(RemotePolicy::new(connections.clone())), server.replan)
            }
            (PolicyKind::Recorded(runs), _) => {
                let actions = runs.actions(&self.of.0, self.of.1, &brief)?;
                chunked(Box::new(RecordedPolicy::poses(&actions, None)), 1)
            }
            (PolicyKind::Lua(file, replan), _) => {
                let policy = file.start(&opened.seed).map_err(CliError::input)?;
                chunked(Box::new(policy), replan.unwrap_or(usize::MAX))
            }
            (PolicyKind::Noop, _) => chunked(Box::<builtin::NoopPolicy>::default(), 1),
            (PolicyKind::Random, _) => {
                let seed = rand::RngCore::next_u64(&mut opened.seed.stream(RandomStream::Script));
                chunked(Box::new(builtin::RandomPolicy::new(seed)), 1)
            }
            (PolicyKind::Expert(hand), _) => Box::new(expert(opened, *hand)?),
            // Nobody has handed any over yet.
            (PolicyKind::Given | PolicyKind::Server(_), _) => {
                chunked(Box::new(RecordedPolicy::new(Vec::new(), None)), 1)
            }
        })
    }
}

/// The task's expert with one of its hands.
///
/// # Errors
/// The task has none, or it does not start.
pub(crate) fn expert(opened: script::Episode, hand: GripMode) -> Result<ExpertController, CliError> {
    let expert = opened.expert().map_err(CliError::input)?;
    let expert = expert.ok_or_else(|| CliError::input("the task has no expert"))?;
    Ok(match hand {
        GripMode::Servo => ExpertController::servo(expert),
        GripMode::Told | GripMode::Binary => ExpertController::new(expert, hand == GripMode::Binary),
    })
}

/// Where a server's key comes from: not from the command line, which others can read.
const API_KEY: &str = "SOFTVT_API_KEY";

fn policy_failure(error: PolicyError) -> CliError {
    match error {
        PolicyError::Interrupted => CliError::interrupted("interrupted"),
        PolicyError::Address(message) => CliError::input(message),
        other => CliError::policy(other),
    }
}
