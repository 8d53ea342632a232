//! An episode that a client controls, and its state as data: its id and all actions so far. The simulation is
//! deterministic, so they define it.

use rmpv::Value;

use super::config::{RequestError, ServerConfig};
use softvt_common::episode_id::EpisodeId;
use softvt_common::npy::NpyArray;
use softvt_evaluation::verdict::Outcome;
use softvt_policy::{
    CommandResolver, Observation, SensorStreams, decode,
    msgpack::{map, pack_array},
};
use softvt_rollout::{Episode, EpisodeError};

/// The numbers of an action, in the encoding of the profile.
pub(super) type ActionRow = Vec<f64>;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct EpisodeState {
    pub id: EpisodeId,
    pub actions: Vec<ActionRow>,
}

impl EpisodeState {
    /// Number of actions that lead from this state to `other`, `None` if `other` does not continue this state.
    pub(super) fn steps_to(&self, other: &Self) -> Option<usize> {
        let bits = |row: &ActionRow| row.iter().map(|number| number.to_bits()).collect::<Vec<_>>();
        let same = |(a, b): (&ActionRow, &ActionRow)| bits(a) == bits(b);
        let is_prefix = self.id == other.id
            && self.actions.len() <= other.actions.len()
            && self.actions.iter().zip(&other.actions).all(same);
        is_prefix.then(|| other.actions.len() - self.actions.len())
    }

    pub(super) fn to_value(&self, config: &ServerConfig) -> Value {
        let EpisodeId { suite, task, episode, base_seed, split } = &self.id;
        let data = self.actions.iter().flatten().flat_map(|number| number.to_le_bytes()).collect();
        let shape = vec![self.actions.len(), config.profile.actions.numbers()];
        let actions = NpyArray { dtype: "<f8".to_owned(), shape, data };
        map([
            ("suite", suite.as_str().into()),
            ("task", (*task).into()),
            ("episode", (*episode).into()),
            ("seed", (*base_seed).into()),
            ("split", split.name().into()),
            ("actions", pack_array(actions, true)),
            ("code", config.action_code().into()),
            ("made_by", config.fingerprint.as_str().into()),
        ])
    }
}

/// An episode in progress. A clone continues independently and gives byte-identical results.
#[derive(Clone)]
pub(super) struct LiveEpisode {
    pub state: EpisodeState,
    pub episode: Episode,
    resolver: CommandResolver,
}

impl LiveEpisode {
    /// Starts the episode of `state`, without its actions.
    pub(super) fn start(config: &ServerConfig, state: &EpisodeState) -> Result<Self, RequestError> {
        let mut episode = (config.start_episode)(&state.id)?;
        episode.begin(config.profile.streams());
        let state = EpisodeState { id: state.id.clone(), actions: Vec::new() };
        Ok(Self { state, episode, resolver: CommandResolver::default() })
    }

    /// The observation of the profile in the current state.
    pub(super) fn observe(&mut self, config: &ServerConfig) -> Result<Observation, EpisodeError> {
        self.episode.observe(&config.profile.streams())
    }

    /// Executes an action of finite numbers. Does nothing once the episode has ended.
    pub(super) fn advance(&mut self, config: &ServerConfig, row: &ActionRow) -> Result<(), RequestError> {
        if self.episode.outcome().is_some() {
            return Ok(());
        }
        let command = decode::command(row, &config.profile.actions)?;
        // A displacement starts at the measured tool pose, which needs no images.
        let observation = self.episode.observe(&SensorStreams::default())?;
        let action = self.resolver.resolve(&observation, command);
        self.episode.step(&action);
        self.state.actions.push(row.clone());
        self.episode.take_metric_error().map_or(Ok(()), |message| Err(message.into()))
    }

    pub(super) fn has_succeeded(&self) -> bool {
        self.episode.outcome() == Some(&Outcome::Completed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_common::episode_id::EpisodeSplit;

    fn state(episode: u32, actions: &[f64]) -> EpisodeState {
        let (suite, split) = ("one".to_owned(), EpisodeSplit::Validation);
        let id = EpisodeId { suite, task: 0, episode, base_seed: 0, split };
        EpisodeState { id, actions: actions.iter().map(|x| vec![*x; 7]).collect() }
    }

    #[test]
    fn a_state_leads_to_the_states_that_begin_with_its_actions() {
        let far = state(0, &[0.0, 1.0, 2.0]);
        assert_eq!(state(0, &[]).steps_to(&far), Some(3));
        assert_eq!(state(0, &[0.0, 1.0]).steps_to(&far), Some(1));
        assert_eq!(far.steps_to(&far), Some(0));
        assert_eq!(far.steps_to(&state(0, &[0.0, 1.0])), None, "an earlier state");
        assert_eq!(state(0, &[0.0, 1.5]).steps_to(&far), None, "other actions");
        assert_eq!(state(1, &[0.0]).steps_to(&far), None, "another episode");
        assert_eq!(state(0, &[-0.0]).steps_to(&far), None, "an equal number with other bits");
    }
}
