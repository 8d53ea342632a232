//! Datasets in LeRobot's layouts: v2.1 and v3.0.

mod episode;
mod features;
mod meta;
mod parquet_table;
mod statistics;
mod v21;
mod v30;
mod version;

use self::{
    episode::{EpisodeData, EpisodeWriter},
    v21::EpisodeTableWriter,
    v30::SharedTableWriter,
};
use super::ExportJob;
use crate::DatasetError;

pub use version::LeRobotVersion;

/// Writes all files of a dataset.
///
/// # Errors
/// As [`export`](super::export).
pub(super) fn write(
    job: &ExportJob<'_>,
    version: LeRobotVersion,
    on_episode: &mut dyn FnMut(usize, &str),
) -> Result<(), DatasetError> {
    let features = features::all(job, version);
    let schema = features::schema(&features);
    let mut writer: Box<dyn EpisodeWriter> = match version {
        LeRobotVersion::V21 => Box::new(EpisodeTableWriter::create(job.dir, schema)?),
        LeRobotVersion::V30 => Box::new(SharedTableWriter::create(job.dir, schema)?),
    };
    job.for_each_episode(
        |index, demo| EpisodeData::read(job, version, index, demo),
        |episode| writer.add(episode),
        on_episode,
    )?;
    writer.finish()?;
    meta::write(job, version, &features)
}
