//! The suites and settings of a server.

use softvt_benchmark::Suite;
use softvt_common::episode_id::{EpisodeId, EpisodeSplit};
use softvt_policy::{PolicyError, access::AccessRules, profile::Profile};
use softvt_rollout::{Episode, EpisodeError, FinishedEpisode};

/// A request cannot be executed. The message is sent to the client.
#[derive(Debug, thiserror::Error)]
pub enum RequestError {
    /// The request is malformed, or does not fit the server or the episode.
    #[error("{0}")]
    Invalid(String),
    /// An action cannot be decoded.
    #[error(transparent)]
    Action(#[from] PolicyError),
    /// The episode cannot be simulated or observed.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// A finished episode cannot be recorded.
    #[error("the episode is over, but it cannot be recorded: {0}")]
    Record(String),
}

impl From<String> for RequestError {
    fn from(message: String) -> Self {
        Self::Invalid(message)
    }
}

/// Starts an episode: builds its scene and lets it settle.
pub(super) type StartEpisode<'a> = Box<dyn Fn(&EpisodeId) -> Result<Episode, RequestError> + Sync + 'a>;

/// Notes that an attempt at an episode has begun.
type BeginAttempt<'a> = Box<dyn Fn(&EpisodeId) -> Result<(), RequestError> + Sync + 'a>;

/// Reports an episode that can no longer be recorded, with the reason.
type ReportLost<'a> = Box<dyn Fn(&EpisodeId, &str) + Sync + 'a>;

/// Records episodes of a run that clients step to their end. `docs/serve.md` says which ones.
pub struct EpisodeRecorder<'a> {
    /// True if an episode belongs to the run and had no record when the server started.
    pub selects: Box<dyn Fn(&EpisodeId) -> bool + Sync + 'a>,
    /// Writes that an attempt at a selected episode has begun.
    pub begin: BeginAttempt<'a>,
    /// Records a selected episode; it is called at most once for each.
    pub record: Box<dyn Fn(FinishedEpisode) -> Result<(), RequestError> + Sync + 'a>,
    /// Reports a selected episode that can no longer be recorded, with the reason.
    pub report_lost: ReportLost<'a>,
}

pub struct ServerConfig<'a> {
    /// The suites. Requests without a suite mean the first one.
    pub suites: Vec<Suite>,
    pub profile: Profile,
    /// Effort of the gripper, N.
    pub effort_n: f64,
    pub privileged: bool,
    /// Base seed of requests without one.
    pub seed: u64,
    /// True if draws derive from a secret seed; requests then cannot name another.
    pub has_secret_seed: bool,
    /// Split of requests without one.
    pub split: EpisodeSplit,
    /// Hash of the scripts, shifts, settings and version. States of servers with another hash are refused.
    pub fingerprint: String,
    pub access: AccessRules,
    pub start_episode: StartEpisode<'a>,
    /// Records finished episodes; `None` if nothing is recorded.
    pub recorder: Option<EpisodeRecorder<'a>>,
}

impl ServerConfig<'_> {
    /// A suite by name, or the first suite.
    pub(super) fn suite(&self, name: Option<&str>) -> Result<&Suite, RequestError> {
        let found = match name {
            None => self.suites.first(),
            Some(name) => self.suites.iter().find(|suite| suite.name == name),
        };
        found.ok_or_else(|| {
            let names: Vec<&str> = self.suites.iter().map(|suite| suite.name.as_str()).collect();
            let name = name.unwrap_or_default();
            format!("suite {name:?} is not served; available: {}", names.join(", ")).into()
        })
    }

    /// The encoding of actions as text. Equal texts mean equal encodings.
    pub(super) fn action_code(&self) -> String {
        serde_json::to_string(&self.profile.actions).unwrap_or_default()
    }
}
