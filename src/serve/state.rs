//! Where an episode stands, as something that can be kept, copied and sent: which episode it is and all that was done in it.

use rmpv::Value;

use super::{
    catalog::{EpisodeId, ServerConfig},
    request::Row,
};
use crate::{
    npy::NpyArray,
    policy::{profile::ACTION_LEN, wire::pack_array},
};

/// Where an episode stands.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct State {
    /// Which episode.
    pub wanted: EpisodeId,
    /// What was done in it, in the code of the profile.
    pub actions: Vec<Row>,
}

impl State {
    /// Whether one state lies on the way to another: how many actions are then left to do.
    pub(super) fn left_to(&self, other: &Self) -> Option<usize> {
        let same = |(a, b): (&Row, &Row)| a.map(f64::to_bits) == b.map(f64::to_bits);
        let on_the_way = self.wanted == other.wanted
            && self.actions.len() <= other.actions.len()
            && self.actions.iter().zip(&other.actions).all(same);
        on_the_way.then(|| other.actions.len() - self.actions.len())
    }

    /// As msgpack.
    pub(super) fn to_value(&self, offer: &ServerConfig) -> Value {
        let EpisodeId { suite, task, episode, seed, split } = &self.wanted;
        let shape = vec![self.actions.len(), ACTION_LEN];
        let actions = NpyArray::from_f64(shape, self.actions.iter().flatten().copied());
        let pair = |name: &str, value: Value| (Value::from(name), value);
        Value::Map(vec![
            pair("suite", suite.as_str().into()),
            pair("task", (*task).into()),
            pair("episode", (*episode).into()),
            pair("seed", (*seed).into()),
            pair("split", split.name().into()),
            pair("actions", pack_array(actions, true)),
            pair("code", offer.code().into()),
            pair("made_by", offer.made_by.as_str().into()),
        ])
    }
}

impl ServerConfig<'_> {
    /// What an action means, as text that tells it from others.
    pub fn code(&self) -> String {
        serde_json::to_string(&self.profile.actions).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::benchmark::seed::Split;

    fn state(episode: u32, actions: &[f64]) -> State {
        let suite = "one".to_owned();
        let wanted = EpisodeId { suite, task: 0, episode, seed: 0, split: Split::Validation };
        State { wanted, actions: actions.iter().map(|x| [*x; ACTION_LEN]).collect() }
    }

    #[test]
    fn a_state_lies_on_the_way_to_those_that_begin_with_it() {
        let far = state(0, &[0.0, 1.0, 2.0]);
        assert_eq!(state(0, &[]).left_to(&far), Some(3));
        assert_eq!(state(0, &[0.0, 1.0]).left_to(&far), Some(1));
        assert_eq!(far.left_to(&far), Some(0));
        assert_eq!(far.left_to(&state(0, &[0.0, 1.0])), None, "nobody goes back in time");
        assert_eq!(state(0, &[0.0, 1.5]).left_to(&far), None, "another way");
        assert_eq!(state(1, &[0.0]).left_to(&far), None, "another episode");
        assert_eq!(state(0, &[-0.0]).left_to(&far), None, "the same number, but not to the bit");
    }
}
