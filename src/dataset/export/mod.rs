//! Export of recorded demonstrations as datasets for training: LeRobot v2.1 and v3.0, and RLDS.
//!
//! A row holds what a policy of the profile `visuo_tactile` (or `visuo_tactile_joints`) observes at that step, and the
//! action commanded then; its numbers are the same in every format. Of the eight past marker states only the last two
//! are stored, as in SoftVTBench. `docs/data.md` describes the files. Demonstrations are read and their images encoded
//! on several threads, and written in order; each thread holds one demonstration.

mod config;
mod demo_reader;
mod description;
mod features;
mod lerobot;
mod rlds;
mod selection;
mod staged_dir;

use std::path::Path;

use self::{
    selection::{SelectedDemo, Selection},
    staged_dir::StagedDir,
};
use super::DatasetError;
use softvt_common::parallel;

pub use config::{ArmControl, ExportConfig, ExportFormat, ExportSummary};
pub use lerobot::LeRobotVersion;

/// Exports a recording. `config.out` is complete afterwards, or unchanged.
///
/// `is_cancelled` ends the export early. `on_episode` is called after each written episode, with the number of all
/// episodes and a label.
///
/// # Errors
/// The recording is missing, unfinished, without images or damaged; a word matches no task; `config.out` is not
/// empty; a file cannot be written; or the export was cancelled.
pub fn export(
    config: &ExportConfig,
    is_cancelled: impl Fn() -> bool + Sync,
    mut on_episode: impl FnMut(usize, &str),
) -> Result<ExportSummary, DatasetError> {
    // Not generic below, so that it is compiled, and optimised, in this crate.
    let staged = StagedDir::create(&config.out)?;
    match write(config, staged.path(), &is_cancelled, &mut on_episode) {
        Ok(summary) => staged.commit().map(|()| summary),
        Err(error) => {
            staged.abort();
            Err(error)
        }
    }
}

fn write(
    config: &ExportConfig,
    dir: &Path,
    is_cancelled: &(dyn Fn() -> bool + Sync),
    on_episode: &mut dyn FnMut(usize, &str),
) -> Result<ExportSummary, DatasetError> {
    let selection = selection::select(config)?;
    let job = ExportJob { config, selection: &selection, dir, is_cancelled };
    match config.format {
        ExportFormat::LeRobot(version) => lerobot::write(&job, version, on_episode)?,
        ExportFormat::Rlds => rlds::write(&job, on_episode)?,
    }
    Ok(selection.summary())
}

#[derive(Clone, Copy)]
struct ExportJob<'a> {
    config: &'a ExportConfig,
    selection: &'a Selection,
    dir: &'a Path,
    is_cancelled: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> ExportJob<'a> {
    /// Reads episodes by their index, on several threads, and passes them to `write` in order.
    fn for_each_episode<E: Send>(
        &self,
        read: impl Fn(usize, &'a SelectedDemo) -> Result<E, DatasetError> + Sync,
        mut write: impl FnMut(E) -> Result<(), DatasetError>,
        on_episode: &mut dyn FnMut(usize, &str),
    ) -> Result<(), DatasetError> {
        let demos = &self.selection.demos;
        parallel::run_in_order(
            demos.len(),
            self.config.threads,
            || false,
            |index| read(index, &demos[index]),
            |index, episode| {
                write(episode)?;
                let id = &demos[index].entry;
                on_episode(demos.len(), &format!("{} task {} demo {}", id.suite, id.task_id, id.demo_id));
                Ok(())
            },
        )
    }
}
