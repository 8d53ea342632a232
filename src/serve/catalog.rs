//! What is served.

use crate::{
    benchmark::{Suite, Task, seed::Split},
    policy::profile::Profile,
    rollout::Episode,
};

/// Which episode a client wants.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EpisodeId {
    /// Name of the suite.
    pub suite: String,
    /// Index of the task in it.
    pub task: usize,
    /// Index of the episode in its split.
    pub episode: u32,
    /// Base seed.
    pub seed: u64,
    /// Which list of episodes.
    pub split: Split,
}

/// A suite that is served.
#[derive(Clone, Debug)]
pub struct ServedSuite<'a> {
    /// Its name, as in results.
    pub name: String,
    /// The suite.
    pub suite: &'a Suite,
}

/// Makes the settled start of an episode.
///
/// # Errors
/// Why it cannot be made; a message for people.
pub(super) type Open<'a> = Box<dyn Fn(&EpisodeId) -> Result<Episode, String> + Sync + 'a>;

/// All that a server offers.
pub struct ServerConfig<'a> {
    /// The suites, the first of which is meant where a client names none.
    pub suites: Vec<ServedSuite<'a>>,
    /// What clients see and what their numbers mean.
    pub profile: Profile,
    /// Whether clients are told the true state too.
    pub privileged: bool,
    /// Base seed where a client names none.
    pub seed: u64,
    /// Split where a client names none.
    pub split: Split,
    /// Tells this server's scripts, shifts and settings from those of another.
    pub made_by: String,
    /// Makes the start of an episode.
    pub open: Open<'a>,
}

impl ServerConfig<'_> {
    /// A suite by name; the first if none is named.
    ///
    /// # Errors
    /// There is none of that name; a fragment for people.
    pub fn suite(&self, name: Option<&str>) -> Result<&ServedSuite<'_>, String> {
        let found = match name {
            None => self.suites.first(),
            Some(name) => self.suites.iter().find(|suite| suite.name == name),
        };
        let names = || self.suites.iter().map(|suite| suite.name.as_str()).collect::<Vec<_>>().join(", ");
        found.ok_or_else(|| format!("suite {:?}: there is none; served are {}", name.unwrap_or(""), names()))
    }

    /// A task of a suite.
    ///
    /// # Errors
    /// There is none of that index; a fragment for people.
    pub fn task(&self, wanted: &EpisodeId) -> Result<&Task, String> {
        let ServedSuite { suite, name } = self.suite(Some(&wanted.suite))?;
        let found = suite.tasks.iter().find(|task| task.id == wanted.task);
        found.ok_or_else(|| {
            let last = suite.tasks.len().saturating_sub(1);
            format!("task {}: suite {name} has the tasks 0 to {last}", wanted.task)
        })
    }
}

/// A split by its name in results.
///
/// # Errors
/// There is none of that name; a fragment for people.
pub fn split_named(name: &str) -> Result<Split, String> {
    let all = [Split::Validation, Split::Demonstration, Split::Experiment];
    let found = all.into_iter().find(|split| split.name() == name);
    found.ok_or_else(|| format!("expected {}", all.map(Split::name).join(", ")))
}
