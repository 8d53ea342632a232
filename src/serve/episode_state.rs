//! State of an episode as data: its id and all actions so far. The simulation is deterministic,
//! so they define it.

use rmpv::Value;

use super::catalog::ServerConfig;
use crate::evaluation::episode_id::EpisodeId;
use crate::npy::NpyArray;
use crate::policy::{
    msgpack::{map, pack_array},
    profile::ACTION_LEN,
};

/// The seven numbers of an action, in the encoding of the profile.
pub(super) type ActionRow = [f64; ACTION_LEN];

/// State of an episode.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EpisodeState {
    /// The episode.
    pub id: EpisodeId,
    /// Actions executed so far.
    pub actions: Vec<ActionRow>,
}

impl EpisodeState {
    /// Number of actions that lead from this state to `other`, `None` if `other` does not continue this state.
    pub(super) fn steps_to(&self, other: &Self) -> Option<usize> {
        let same = |(a, b): (&ActionRow, &ActionRow)| a.map(f64::to_bits) == b.map(f64::to_bits);
        let is_prefix = self.id == other.id
            && self.actions.len() <= other.actions.len()
            && self.actions.iter().zip(&other.actions).all(same);
        is_prefix.then(|| other.actions.len() - self.actions.len())
    }

    /// Converts to msgpack.
    pub(super) fn to_value(&self, config: &ServerConfig) -> Value {
        let EpisodeId { suite, task, episode, base_seed, split } = &self.id;
        let data = self.actions.iter().flatten().flat_map(|number| number.to_le_bytes()).collect();
        let actions = NpyArray { dtype: "<f8".to_owned(), shape: vec![self.actions.len(), ACTION_LEN], data };
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::episode_id::Split;

    fn state(episode: u32, actions: &[f64]) -> EpisodeState {
        let (suite, split) = ("one".to_owned(), Split::Validation);
        let id = EpisodeId { suite, task: 0, episode, base_seed: 0, split };
        EpisodeState { id, actions: actions.iter().map(|x| [*x; ACTION_LEN]).collect() }
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
