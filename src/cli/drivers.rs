//! Who drives: a policy that was chosen, made ready for many episodes.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use super::{Failure, code, recorded::RecordedRuns};
use crate::{
    benchmark::seed::RandomStream,
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
pub(super) enum Hand {
    /// As far as the expert says.
    Told,
    /// Only open or shut.
    Binary,
    /// Until it feels that it holds something.
    Servo,
}

impl Hand {
    /// What `--policy` calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Told => "expert",
            Self::Binary => "expert-binary",
            Self::Servo => "tactile-servo",
        }
    }
}

/// A policy's server and how it is spoken to.
#[derive(Debug)]
pub(super) struct Answering {
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
pub(super) enum Driver {
    /// The task's expert.
    Expert(Hand),
    /// Who holds still.
    Noop,
    /// Who wanders.
    Random,
    /// A policy in Lua, and how many actions of a list are carried out if that is said.
    Lua(Arc<PolicyFile>, Option<usize>),
    /// A server.
    Server(Arc<Answering>),
    /// Whatever was commanded in a run.
    Recorded(Arc<RecordedRuns>),
    /// Actions that somebody else hands over.
    Given,
}

/// Who drives, and how results call it.
#[derive(Clone, Debug)]
pub(super) struct Choice {
    driver: Driver,
    name: String,
}

impl Choice {
    /// A driver under a name.
    pub(super) fn new(driver: Driver, name: String) -> Self {
        Self { driver, name }
    }

    /// The tasks' experts.
    pub(super) fn expert() -> Self {
        Self::new(Driver::Expert(Hand::Told), Hand::Told.name().to_owned())
    }

    /// Recorded actions that somebody else hands over.
    pub(super) fn replay() -> Self {
        Self::new(Driver::Given, "replay".to_owned())
    }

    /// Whoever drove in another world.
    pub(super) fn import() -> Self {
        Self::new(Driver::Given, "import".to_owned())
    }

    /// A client of `softvt serve`.
    pub(super) fn client() -> Self {
        Self::new(Driver::Given, "client".to_owned())
    }

    /// How results call it.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// The hand of the tasks' experts, if they drive.
    pub(super) fn hand(&self) -> Option<Hand> {
        match self.driver {
            Driver::Expert(hand) => Some(hand),
            _ => None,
        }
    }

    /// Whether it sees the true state.
    pub(super) fn is_privileged(&self) -> bool {
        self.hand().is_some()
    }

    /// Whether it answers over a network.
    pub(super) fn is_remote(&self) -> bool {
        matches!(self.driver, Driver::Server(_))
    }

    /// The profile, if the policy has one.
    pub(super) fn profile(&self) -> Option<&Profile> {
        match &self.driver {
            Driver::Server(server) => Some(&server.profile),
            _ => None,
        }
    }

    /// What it looks at and where that is said, if it is known before it drives.
    pub(super) fn looks(&self) -> Option<(String, SensorStreams)> {
        match &self.driver {
            Driver::Server(server) => {
                Some((format!("--profile {}: inputs", server.profile_word), server.profile.streams()))
            }
            Driver::Lua(file, _) => Some((format!("{}: policy.looks", file.looks_at), file.streams.clone())),
            _ => None,
        }
    }

    /// Actions of each answer that are carried out, if anybody has a say in that.
    pub(super) fn replan(&self) -> Option<usize> {
        match &self.driver {
            Driver::Server(server) => Some(server.replan),
            Driver::Lua(_, replan) => *replan,
            _ => None,
        }
    }

    /// The file of a policy in Lua, as messages name it.
    pub(super) fn file(&self) -> Option<&str> {
        match &self.driver {
            Driver::Lua(file, _) => Some(&file.main),
            _ => None,
        }
    }

    /// SHA-256 of the files that the policy or its profile is made of, by name.
    pub(super) fn sources(&self) -> BTreeMap<String, String> {
        match &self.driver {
            Driver::Lua(file, _) => file.hashes(),
            Driver::Server(server) => server.sources.clone(),
            _ => BTreeMap::new(),
        }
    }

    /// The runs whose actions are carried out, if any are.
    pub(super) fn recorded(&self) -> Option<&RecordedRuns> {
        match &self.driver {
            Driver::Recorded(runs) => Some(runs),
            _ => None,
        }
    }
}

/// Makes whoever drives an episode.
pub(super) struct Drivers {
    choice: Choice,
    connections: Option<Arc<PolicyConnections>>,
    /// The script's name of the suite, and whether it is its twin.
    of: (String, bool),
}

impl Drivers {
    /// `suite` is the script's name of it, `twin` whether soft objects are rigid.
    pub(super) fn new(choice: &Choice, suite: &str, twin: bool) -> Self {
        let connections = match &choice.driver {
            Driver::Server(server) => Some(Arc::new(PolicyConnections::new(PolicyServer {
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
    pub(super) fn connect(&self) -> Result<(), Failure> {
        self.connections.as_ref().map_or(Ok(()), |connections| connections.check().map_err(policy_failure))
    }

    /// Whoever drives the episode `brief`.
    ///
    /// # Errors
    /// The task has no expert, or it does not start.
    pub(super) fn drive(
        &self,
        opened: script::Episode,
        brief: TaskBrief,
    ) -> Result<Box<dyn Controller>, Failure> {
        let chunked = |policy: Box<dyn Policy>, replan| -> Box<dyn Controller> {
            Box::new(ChunkedPolicy::new(policy, brief.clone(), replan))
        };
        Ok(match (&self.choice.driver, &self.connections) {
            (Driver::Server(server), Some(connections)) => {
                chunked(Box::new(RemotePolicy::new(connections.clone())), server.replan)
            }
            (Driver::Recorded(runs), _) => {
                let actions = runs.actions(&self.of.0, self.of.1, &brief)?;
                chunked(Box::new(RecordedPolicy::poses(&actions, None)), 1)
            }
            (Driver::Lua(file, replan), _) => {
                let policy = file.start(&opened.seed).map_err(Failure::input)?;
                chunked(Box::new(policy), replan.unwrap_or(usize::MAX))
            }
            (Driver::Noop, _) => chunked(Box::<builtin::NoopPolicy>::default(), 1),
            (Driver::Random, _) => {
                let seed = rand::RngCore::next_u64(&mut opened.seed.stream(RandomStream::Script));
                chunked(Box::new(builtin::RandomPolicy::new(seed)), 1)
            }
            (Driver::Expert(hand), _) => Box::new(expert(opened, *hand)?),
            // Nobody has handed any over yet.
            (Driver::Given | Driver::Server(_), _) => {
                chunked(Box::new(RecordedPolicy::new(Vec::new(), None)), 1)
            }
        })
    }
}

/// The task's expert with one of its hands.
///
/// # Errors
/// The task has none, or it does not start.
pub(super) fn expert(opened: script::Episode, hand: Hand) -> Result<ExpertController, Failure> {
    let expert = opened.expert().map_err(Failure::input)?;
    let expert = expert.ok_or_else(|| Failure::input("the task has no expert"))?;
    Ok(match hand {
        Hand::Servo => ExpertController::servo(expert),
        Hand::Told | Hand::Binary => ExpertController::new(expert, hand == Hand::Binary),
    })
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
