//! [`ScenePool`]: interpreters that build scenes, kept between the scenes.

use std::sync::Mutex;

use softvt_common::parallel::lock;
use softvt_script::{LoadedScript, SceneBuilder, ScriptError};

/// Scene builders of a script that are not in use. Opening one runs the whole script.
pub(crate) struct ScenePool<'a> {
    script: &'a LoadedScript,
    idle: Mutex<Vec<SceneBuilder>>,
}

impl<'a> ScenePool<'a> {
    pub(crate) fn new(script: &'a LoadedScript) -> Self {
        Self { script, idle: Mutex::default() }
    }

    /// Calls `f` with an idle builder, or a new one, which then is idle.
    ///
    /// # Errors
    /// The script fails.
    pub(crate) fn with<T>(&self, f: impl FnOnce(&SceneBuilder) -> T) -> Result<T, ScriptError> {
        let taken = lock(&self.idle).pop();
        let builder = taken.map_or_else(|| SceneBuilder::open(self.script), Ok)?;
        let result = f(&builder);
        lock(&self.idle).push(builder);
        Ok(result)
    }
}
