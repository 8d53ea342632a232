//! Export of recorded demonstrations as LeRobot datasets, in the versions used for training: v2.1 and v3.0.
//!
//! A row holds what a policy of the profile `visuo_tactile` (or `visuo_tactile_joints`) observes at that step, and the
//! action commanded then. Of the eight past marker states only the last two are stored, as in SoftVTBench.
//! `docs/data.md` describes the files. Demonstrations are read and their images encoded on several threads, and written
//! in order; each thread holds one demonstration.

mod config;
mod episode;
mod features;
mod meta;
mod parquet_table;
mod selection;
mod staged_dir;
mod statistics;
mod v21;
mod v30;

use self::{
    episode::{EpisodeData, EpisodeWriter},
    features::Feature,
    selection::Selection,
    staged_dir::StagedDir,
    v21::EpisodeTableWriter,
    v30::SharedTableWriter,
};
use super::DatasetError;
use softvt_common::parallel;

pub use config::{ArmControl, ExportConfig, ExportSummary, LeRobotVersion};

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
    on_episode: impl FnMut(usize, &str),
) -> Result<ExportSummary, DatasetError> {
    staged_dir::check_empty(&config.out)?;
    let selection = selection::select(config)?;
    let features = features::all(config, &selection);
    let staged = StagedDir::create(&config.out)?;
    match write(config, &selection, &features, &staged, is_cancelled, on_episode) {
        Ok(summary) => staged.commit().map(|()| summary),
        Err(error) => {
            staged.abort();
            Err(error)
        }
    }
}

fn write(
    config: &ExportConfig,
    selection: &Selection,
    features: &[Feature],
    staged: &StagedDir,
    is_cancelled: impl Fn() -> bool + Sync,
    mut on_episode: impl FnMut(usize, &str),
) -> Result<ExportSummary, DatasetError> {
    let (demos, dir) = (&selection.demos, staged.path());
    let mut writer: Box<dyn EpisodeWriter> = match config.version {
        LeRobotVersion::V21 => Box::new(EpisodeTableWriter::create(dir, features::schema(features))?),
        LeRobotVersion::V30 => Box::new(SharedTableWriter::create(dir, features::schema(features))?),
    };
    parallel::run_in_order(
        demos.len(),
        config.threads,
        || false,
        |index| EpisodeData::read(config, selection, index, &is_cancelled),
        |index, episode| {
            writer.add(episode)?;
            let id = &demos[index].entry;
            on_episode(demos.len(), &format!("{} task {} demo {}", id.suite, id.task_id, id.demo_id));
            Ok(())
        },
    )?;
    writer.finish()?;
    let frames = demos.iter().map(|demo| demo.entry.num_samples).sum();
    let summary = ExportSummary { episodes: demos.len(), frames, tasks: selection.prompts.len() };
    meta::write(dir, config, selection, features, summary)?;
    Ok(summary)
}
