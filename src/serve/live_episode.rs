//! An episode that a client controls.

use super::{
    catalog::{RequestError, ServerConfig},
    episode_state::{ActionRow, EpisodeState},
};
use crate::{
    evaluation::record::Outcome,
    policy::{CommandResolver, Observation, SensorStreams, decode},
    rollout::{Episode, EpisodeError},
};

/// An episode in progress. A clone continues independently and gives byte-identical results.
#[derive(Clone)]
pub(super) struct LiveEpisode {
    /// Its id and the actions so far.
    pub state: EpisodeState,
    /// The simulation.
    pub episode: Episode,
    resolver: CommandResolver,
}

impl LiveEpisode {
    /// Starts the episode of `state`, without its actions.
    ///
    /// # Errors
    /// The episode cannot be started.
    pub(super) fn start(config: &ServerConfig, state: &EpisodeState) -> Result<Self, RequestError> {
        let mut episode = (config.start_episode)(&state.id)?;
        episode.begin(config.profile.streams());
        let state = EpisodeState { id: state.id.clone(), actions: Vec::new() };
        Ok(Self { state, episode, resolver: CommandResolver::default() })
    }

    /// The observation of the profile in the current state.
    ///
    /// # Errors
    /// A sensor stream cannot be computed.
    pub(super) fn observe(&mut self, config: &ServerConfig) -> Result<Observation, EpisodeError> {
        self.episode.observe(&config.profile.streams())
    }

    /// Executes an action of finite numbers. Does nothing once the episode has ended.
    ///
    /// # Errors
    /// The action cannot be decoded.
    pub(super) fn advance(&mut self, config: &ServerConfig, row: &ActionRow) -> Result<(), RequestError> {
        if self.episode.outcome().is_some() {
            return Ok(());
        }
        let command =
            decode::command(row, &config.profile.actions).map_err(|e| RequestError(e.to_string()))?;
        // A displacement starts at the measured tool pose, which needs no images.
        let observation =
            self.episode.observe(&SensorStreams::default()).map_err(|e| RequestError(e.to_string()))?;
        let action = self.resolver.resolve(&observation, command);
        self.episode.step(&action);
        self.state.actions.push(*row);
        Ok(())
    }

    /// True if the goal was reached.
    pub(super) fn has_succeeded(&self) -> bool {
        self.episode.outcome() == Some(&Outcome::Completed)
    }
}
