//! The suites and settings of a server.

use crate::{
    benchmark::{Suite, Task},
    evaluation::episode_id::{EpisodeId, Split},
    policy::profile::Profile,
    rollout::Episode,
};

/// A request cannot be executed. The message is sent to the client.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RequestError(pub String);

impl From<String> for RequestError {
    fn from(message: String) -> Self {
        Self(message)
    }
}

/// A suite with the name under which it is served.
#[derive(Clone, Debug)]
pub struct ServedSuite<'a> {
    /// Name, as in results.
    pub name: String,
    /// The suite.
    pub suite: &'a Suite,
}

/// Starts an episode: builds its scene and lets it settle.
pub(super) type StartEpisode<'a> = Box<dyn Fn(&EpisodeId) -> Result<Episode, RequestError> + Sync + 'a>;

/// Suites and settings of a server.
pub struct ServerConfig<'a> {
    /// The suites. Requests without a suite mean the first one.
    pub suites: Vec<ServedSuite<'a>>,
    /// Encoding of observations and actions.
    pub profile: Profile,
    /// True if clients receive the true state.
    pub privileged: bool,
    /// Base seed of requests without one.
    pub seed: u64,
    /// Split of requests without one.
    pub split: Split,
    /// Hash of the scripts, shifts, settings and version. States of servers with another hash are refused.
    pub fingerprint: String,
    /// Starts an episode.
    pub start_episode: StartEpisode<'a>,
}

impl ServerConfig<'_> {
    /// A suite by name, or the first suite.
    pub(super) fn suite(&self, name: Option<&str>) -> Result<&ServedSuite<'_>, RequestError> {
        let found = match name {
            None => self.suites.first(),
            Some(name) => self.suites.iter().find(|suite| suite.name == name),
        };
        let names = || self.suites.iter().map(|suite| suite.name.as_str()).collect::<Vec<_>>().join(", ");
        found.ok_or_else(|| {
            format!("suite {:?} is not served; available: {}", name.unwrap_or(""), names()).into()
        })
    }

    /// The task of an episode.
    pub(super) fn task(&self, id: &EpisodeId) -> Result<&Task, RequestError> {
        let ServedSuite { suite, name } = self.suite(Some(&id.suite))?;
        let found = suite.tasks.iter().find(|task| task.id == id.task);
        found.ok_or_else(|| {
            let last = suite.tasks.len().saturating_sub(1);
            format!("task {}: suite {name} has the tasks 0 to {last}", id.task).into()
        })
    }

    /// The encoding of actions as text. Equal texts mean equal encodings.
    pub(super) fn action_code(&self) -> String {
        serde_json::to_string(&self.profile.actions).unwrap_or_default()
    }
}
