//! Configuration of a run.

use std::path::PathBuf;

use crate::{
    benchmark::Suite,
    cli::{
        args::VideoSelection,
        commands::merge::Shard,
        run::{policy::PolicyConfig, requirements::Requirement},
    },
};

/// What to run and how.
#[derive(Clone, Debug)]
pub(crate) struct RunConfig {
    /// The script.
    pub file: PathBuf,
    /// Words for the script's own options.
    pub script_words: Vec<String>,
    /// Who drives.
    pub policy: PolicyConfig,
    /// Tasks to run: indices or parts of prompts; all if empty.
    pub tasks: Vec<String>,
    /// Episodes a task; the suite's own number if none.
    pub episodes: Option<u32>,
    /// Base seed.
    pub seed: u64,
    /// Threads.
    pub threads: usize,
    /// Shifts by name and value.
    pub shifts: Vec<(String, f64)>,
    /// Whether soft objects are made rigid.
    pub twin: bool,
    /// Settings by path and value.
    pub set: Vec<(String, String)>,
    /// Whether to write a trace, and whether with node positions.
    pub trace: Option<bool>,
    /// Which rollouts to draw.
    pub video: Option<VideoSelection>,
    /// Where to write.
    pub out: Option<PathBuf>,
    /// Whether to go on with a run that was broken off.
    pub resume: bool,
    /// The part of the run to do.
    pub shard: Option<Shard>,
    /// What the results must reach.
    pub require: Vec<Requirement>,
    /// Print JSON instead of tables.
    pub json: bool,
}

impl RunConfig {
    /// A script under a policy, one thread, all else as it is by default.
    pub(crate) fn of(file: PathBuf, policy: PolicyConfig) -> Self {
        Self {
            file,
            policy,
            script_words: Vec::new(),
            tasks: Vec::new(),
            episodes: None,
            seed: 0,
            threads: 1,
            shifts: Vec::new(),
            twin: false,
            set: Vec::new(),
            trace: None,
            video: None,
            out: None,
            resume: false,
            shard: None,
            require: Vec::new(),
            json: false,
        }
    }

    /// A suite's name in results: that of a twin is its own, though its episodes start as the suite's do.
    pub(crate) fn name_of(&self, suite: &Suite) -> String {
        let twin = if self.twin { "_rigid_twin" } else { "" };
        format!("{}{twin}", suite.name)
    }
}
