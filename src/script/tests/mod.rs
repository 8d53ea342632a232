//! The Lua interface as scripts use it, and the messages of its errors.

mod episodes;
mod files_and_limits;
mod inputs;
mod joints;
mod options;
mod policies;
mod shifts;
mod surface;
mod variation;
mod visuals;

use std::{fs, path::PathBuf, sync::Arc, time::Duration};

use super::{EpisodeSetup, LoadedScript, SceneChanges, ScriptError, VmLimits, load_with};
use softvt_common::episode_id::{EpisodeId, EpisodeSplit};

/// An episode of the first task of the suite "test".
pub(super) fn episode_id(episode: u32, base_seed: u64) -> EpisodeId {
    EpisodeId { suite: "test".into(), task: 0, episode, base_seed, split: EpisodeSplit::Validation }
}

pub(super) fn open(loaded: &LoadedScript, id: &EpisodeId) -> Result<EpisodeSetup, ScriptError> {
    EpisodeSetup::open(loaded, id, &SceneChanges::default())
}

pub(super) struct Project(tempfile::TempDir);

impl Project {
    pub(super) fn new(files: &[(&str, &str)]) -> Self {
        let project = Self(tempfile::tempdir().unwrap());
        files.iter().for_each(|(path, text)| project.write(path, text.as_bytes()));
        project
    }

    pub(super) fn write(&self, path: &str, bytes: &[u8]) {
        let path = self.path(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    pub(super) fn path(&self, path: &str) -> PathBuf {
        self.0.path().join(path)
    }

    pub(super) fn load(&self, path: &str, argv: &[&str]) -> Result<LoadedScript, ScriptError> {
        self.load_with(path, argv, &limits())
    }

    pub(super) fn load_with(
        &self,
        path: &str,
        argv: &[&str],
        limits: &VmLimits,
    ) -> Result<LoadedScript, ScriptError> {
        let argv: Vec<String> = argv.iter().map(|word| word.to_string()).collect();
        load_with(&self.path(path), &argv, limits)
    }

    /// The message of a script that must fail, without the folder's name.
    pub(super) fn error(&self, path: &str, argv: &[&str]) -> String {
        self.shorten(self.load(path, argv).expect_err("the script must fail"))
    }

    /// A message without the folder's name.
    pub(super) fn shorten(&self, message: impl ToString) -> String {
        message.to_string().replace(&format!("{}/", self.0.path().display()), "")
    }
}

/// Short limits, and a watchdog without effect.
pub(super) fn limits() -> VmLimits {
    VmLimits {
        memory_bytes: 16 << 20,
        load: Duration::from_millis(300),
        call: Duration::from_millis(300),
        point: Duration::from_millis(300),
        grace: Duration::from_millis(50),
        on_stuck: Arc::new(|_| {}),
        print: Arc::new(|_| {}),
    }
}

pub(super) fn error_of(text: &str) -> String {
    Project::new(&[("suites/x.lua", text)]).error("suites/x.lua", &[])
}

/// The common part of a suite, to which a test adds its own.
pub(super) const SUITE: &str = include_str!("lua/suite.lua");
