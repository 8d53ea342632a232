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
    episode::{EpisodeData, LerobotEpisodeWriter},
    v21::EpisodeTableWriter,
    v30::SharedTableWriter,
};
use super::{ExportJob, features as export_features};
use crate::DatasetError;

pub use version::LeRobotVersion;

pub(super) fn write(
    job: &ExportJob<'_>,
    version: LeRobotVersion,
    on_episode: &mut dyn FnMut(usize, &str),
) -> Result<(), DatasetError> {
    let features = export_features::all(job);
    let columns = features::all(&features, version);
    let schema = features::schema(&columns);
    let mut writer: Box<dyn LerobotEpisodeWriter> = match version {
        LeRobotVersion::V21 => Box::new(EpisodeTableWriter::create(job.dir, schema)?),
        LeRobotVersion::V30 => Box::new(SharedTableWriter::create(job.dir, schema)?),
    };
    job.for_each_episode(
        |index, demo| EpisodeData::read(job, &features, version, index, demo),
        |episode| writer.add(episode),
        on_episode,
    )?;
    writer.finish()?;
    meta::write(job, version, &columns)
}
