//! An episode that a client drives.

use super::{catalog::ServerConfig, request::Row, state::State};
use crate::{
    evaluation::record::Outcome,
    policy::{CommandResolver, Observation, SensorStreams, decode},
    rollout::{Episode, EpisodeError},
};

/// An episode that a client drives. A copy of it goes on as it would itself.
#[derive(Clone)]
pub(super) struct LiveEpisode {
    /// Where it stands.
    pub state: State,
    /// The episode.
    pub episode: Episode,
    follower: CommandResolver,
}

impl LiveEpisode {
    /// The settled start of an episode.
    ///
    /// # Errors
    /// It cannot be made; a message for people.
    pub(super) fn start(offer: &ServerConfig, state: State) -> Result<Self, String> {
        let mut episode = (offer.open)(&state.wanted)?;
        episode.begin(offer.profile.streams());
        Ok(Self { state, episode, follower: CommandResolver::default() })
    }

    /// What the client sees now.
    ///
    /// # Errors
    /// It cannot be sensed.
    pub(super) fn observe(&mut self, offer: &ServerConfig) -> Result<Observation, EpisodeError> {
        self.episode.observe(&offer.profile.streams())
    }

    /// Carries out one action of finite numbers; nothing once the episode has ended.
    ///
    /// # Errors
    /// The action is none; a message for people.
    pub(super) fn advance(&mut self, offer: &ServerConfig, row: &Row) -> Result<(), String> {
        if self.episode.outcome().is_some() {
            return Ok(());
        }
        let command = decode::command(row, &offer.profile.actions).map_err(|e| e.to_string())?;
        // A step away from where the tool is needs to know where that is, and no picture.
        let now = self.episode.observe(&SensorStreams::default()).map_err(|e| e.to_string())?;
        let action = self.follower.action(&now, command);
        self.episode.step(&action);
        self.state.actions.push(*row);
        Ok(())
    }

    /// Whether the goal was reached.
    pub(super) fn succeeded(&self) -> bool {
        self.episode.outcome() == Some(&Outcome::Completed)
    }
}
