//! Attempts of clients at the episodes that the server records.
//!
//! An episode is recorded at most once, and a client cannot choose among several results: only the attempt that
//! executes the first action of the episode on this server counts, and only if it steps the episode from its reset to
//! its end. Until then no other client can step the episode, so that none tries out actions for it.

use std::{
    collections::{BTreeMap, btree_map::Entry},
    fmt,
    sync::{Mutex, MutexGuard},
};

use super::config::{EpisodeRecorder, RequestError};
use softvt_common::episode_id::EpisodeId;
use softvt_common::parallel::lock;
use softvt_rollout::Episode;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AttemptState {
    InProgress,
    /// Recorded, or lost.
    Over,
}

pub(super) struct Attempts<'a> {
    recorder: Option<&'a EpisodeRecorder<'a>>,
    /// Episodes of the run in which an action was executed.
    states: Mutex<BTreeMap<EpisodeId, AttemptState>>,
}

/// The attempt at an episode that counts. An attempt that is dropped before its end is lost.
pub(super) struct Attempt<'a> {
    id: EpisodeId,
    recorder: &'a EpisodeRecorder<'a>,
    attempts: &'a Attempts<'a>,
}

impl<'a> Attempts<'a> {
    /// No attempt yet. Without a recorder none is ever begun.
    pub(super) fn new(recorder: Option<&'a EpisodeRecorder<'a>>) -> Self {
        Self { recorder, states: Mutex::default() }
    }

    /// The attempt at an episode whose first action was executed after a reset. `None` if an earlier one exists, or the
    /// episode is not one that the server records.
    pub(super) fn begin(&'a self, id: &EpisodeId) -> Result<Option<Attempt<'a>>, RequestError> {
        let Some(recorder) = self.recorder.filter(|recorder| (recorder.selects)(id)) else { return Ok(None) };
        match lock(&self.states).entry(id.clone()) {
            Entry::Occupied(_) => return Ok(None),
            Entry::Vacant(free) => free.insert(AttemptState::InProgress),
        };
        (recorder.begin)(id)?;
        Ok(Some(Attempt { id: id.clone(), recorder, attempts: self }))
    }

    /// True if an attempt at the episode can still be recorded.
    pub(super) fn is_open(&self, id: &EpisodeId) -> bool {
        self.recorder.is_some_and(|recorder| (recorder.selects)(id))
            && lock(&self.states).get(id) != Some(&AttemptState::Over)
    }

    /// The states, if no client but the owner of `own` has begun an attempt at the episode that is not over. The
    /// message of an error begins with the type of the `request`.
    pub(super) fn lock_free(
        &self,
        request: &str,
        id: &EpisodeId,
        own: Option<&Attempt<'_>>,
    ) -> Result<MutexGuard<'_, BTreeMap<EpisodeId, AttemptState>>, RequestError> {
        let is_own = own.is_some_and(|attempt| attempt.id == *id);
        let states = lock(&self.states);
        if states.get(id) == Some(&AttemptState::InProgress) && !is_own {
            let (task, episode) = (id.task, id.episode);
            bail!(
                "{request}: task {task}, episode {episode} is being recorded for another client; use it when that client \
                 is done, or another episode"
            );
        }
        Ok(states)
    }

    /// Ends the client's `own` attempt at an episode, or rules out a later one of any client, which
    /// counts as an attempt.
    pub(super) fn exclude(
        &self,
        request: &str,
        id: &EpisodeId,
        own: Option<&Attempt<'_>>,
        reason: &str,
    ) -> Result<(), RequestError> {
        let Some(recorder) = self.recorder.filter(|recorder| (recorder.selects)(id)) else { return Ok(()) };
        let before = self.lock_free(request, id, own)?.insert(id.clone(), AttemptState::Over);
        if before != Some(AttemptState::Over) {
            (recorder.report_lost)(id, reason);
        }
        if before.is_none() { (recorder.begin)(id) } else { Ok(()) }
    }

    /// Ends the attempt at an episode, and returns its state before.
    fn end(&self, id: &EpisodeId) -> Option<AttemptState> {
        lock(&self.states).insert(id.clone(), AttemptState::Over)
    }
}

impl Attempt<'_> {
    /// Records the episode, which is over. Returns false if the attempt was lost before.
    pub(super) fn record(self, episode: &Episode) -> Result<bool, RequestError> {
        if self.attempts.end(&self.id) != Some(AttemptState::InProgress) {
            return Ok(false);
        }
        (self.recorder.record)(episode.clone().finish(None))?;
        Ok(true)
    }
}

impl Drop for Attempt<'_> {
    fn drop(&mut self) {
        if self.attempts.end(&self.id) == Some(AttemptState::InProgress) {
            (self.recorder.report_lost)(&self.id, "its client left it before its end");
        }
    }
}

impl fmt::Debug for Attempt<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Attempt").field("id", &self.id).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_common::episode_id::EpisodeSplit;

    fn id(episode: u32) -> EpisodeId {
        EpisodeId { suite: "one".to_owned(), task: 0, episode, base_seed: 0, split: EpisodeSplit::Validation }
    }

    /// Runs `test` on the attempts of a server that records the episodes below 10; returns the reports of lost ones,
    /// and the episodes whose attempts were written.
    fn reports(test: impl Fn(&Attempts)) -> (Vec<String>, Vec<u32>) {
        let (lost, begun) = (Mutex::new(Vec::new()), Mutex::new(Vec::new()));
        let recorder = EpisodeRecorder {
            selects: Box::new(|id| id.episode < 10),
            begin: Box::new(|id| {
                begun.lock().unwrap().push(id.episode);
                Ok(())
            }),
            record: Box::new(|_| Ok(())),
            report_lost: Box::new(|id, reason| {
                lost.lock().unwrap().push(format!("{}: {reason}", id.episode));
            }),
        };
        test(&Attempts::new(Some(&recorder)));
        drop(recorder);
        (lost.into_inner().unwrap(), begun.into_inner().unwrap())
    }

    #[test]
    fn only_the_first_attempt_at_an_episode_counts() {
        let (lost, begun) = reports(|attempts| {
            let first = attempts.begin(&id(0)).unwrap();
            assert!(first.is_some());
            assert!(attempts.begin(&id(0)).unwrap().is_none(), "another client");
            assert!(attempts.begin(&id(1)).unwrap().is_some(), "another episode");
            assert!(attempts.begin(&id(10)).unwrap().is_none(), "an episode that is not recorded");
            drop(first);
            assert!(attempts.begin(&id(0)).unwrap().is_none(), "after an attempt that was left");
        });
        assert_eq!(lost, ["1: its client left it before its end", "0: its client left it before its end"]);
        assert_eq!(begun, [0, 1]);
    }

    #[test]
    fn no_other_client_steps_an_episode_during_an_attempt() {
        let (lost, begun) = reports(|attempts| {
            assert!(attempts.lock_free("step", &id(0), None).is_ok(), "before the attempt");
            let first = attempts.begin(&id(0)).unwrap();
            assert!(attempts.lock_free("step", &id(0), first.as_ref()).is_ok(), "its own client");
            assert!(attempts.lock_free("step", &id(0), None).is_err(), "another client");
            let other = attempts.begin(&id(1)).unwrap();
            let another = attempts.lock_free("step", &id(0), other.as_ref()).is_err();
            assert!(another, "a client with an attempt at another episode");
            assert!(attempts.lock_free("step", &id(2), None).is_ok(), "another episode");
            drop(first);
            assert!(attempts.lock_free("step", &id(0), None).is_ok(), "after the attempt");
        });
        assert_eq!((lost.len(), begun.len()), (2, 2));
    }

    #[test]
    fn an_episode_that_was_reached_by_a_state_is_not_recorded() {
        let (lost, begun) = reports(|attempts| {
            let first = attempts.begin(&id(0)).unwrap();
            let exclude = |episode, own| attempts.exclude("set_state", &id(episode), own, "restored");
            let error = exclude(0, None).expect_err("another client").to_string();
            assert!(error.starts_with("set_state: task 0, episode 0 is being recorded"), "{error}");
            for episode in [0, 0, 1, 10] {
                assert!(exclude(episode, first.as_ref()).is_ok());
            }
            drop(first);
            assert!(attempts.begin(&id(1)).unwrap().is_none());
        });
        assert_eq!(lost, ["0: restored", "1: restored"], "each is reported once");
        assert_eq!(begun, [0, 1], "a search is an attempt");
        assert!(Attempts::new(None).begin(&id(0)).unwrap().is_none(), "without a recorder");
    }
}
