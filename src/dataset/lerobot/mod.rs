//! Recorded demonstrations as data sets of LeRobot, in the versions that are trained from: v2.1 and v3.0.
//!
//! A row holds what a policy of the profile `visuo_tactile` is sent at that step, and what was commanded then; of the eight past
//! states of the markers only the last two, as SoftVTBench has it. `docs/data.md` says what is in the folder. Demonstrations are
//! read and their pictures packed on several threads, and written in order; each thread holds one of them.

mod episode;
mod features;
mod meta;
mod parquet_table;
mod selection;
mod staged_dir;
mod statistics;
mod v21;
mod v30;

use std::path::PathBuf;

use self::{
    episode::EpisodeRows,
    features::Feature,
    parquet_table::ColumnValues,
    selection::{SelectedDemo, Selection},
    staged_dir::StagedDir,
    statistics::FeatureStatistics,
};
use super::{DatasetError, TaskFile, demonstration_writer::frame_rate};

/// A version of LeRobot's layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeRobotVersion {
    /// A table an episode: what openpi and SoftVTBench train from.
    V21,
    /// Many episodes a table: LeRobot's own since 0.4.
    V30,
}

/// Which code of the gripper becomes the seventh number of the actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GripperCoding {
    /// Closure, 0 open to 1 shut.
    Continuous,
    /// 1 while the expert means to hold, else 0.
    Binary,
}

/// What to export, and how.
#[derive(Clone, Debug)]
pub struct ExportConfig {
    /// Folder of a finished recording.
    pub data: PathBuf,
    /// New folder.
    pub out: PathBuf,
    /// Layout.
    pub version: LeRobotVersion,
    /// Code of the gripper.
    pub gripper: GripperCoding,
    /// Only the tasks that fit one of these: indices, or parts of prompts; all if there are none.
    pub tasks: Vec<String>,
    /// Threads; the files do not depend on it.
    pub threads: usize,
}

/// What was exported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExportSummary {
    /// Episodes.
    pub episodes: usize,
    /// EpisodeRows of all.
    pub frames: usize,
    /// Different prompts.
    pub tasks: usize,
}

impl LeRobotVersion {
    /// As `info.json` has it.
    fn code(self) -> &'static str {
        match self {
            Self::V21 => "v2.1",
            Self::V30 => "v3.0",
        }
    }
}

/// An episode on its way into the files.
struct ExportedEpisode<'a> {
    /// Its number.
    index: usize,
    source: &'a SelectedDemo,
    rows: EpisodeRows,
    /// Every feature as a whole.
    summaries: Vec<FeatureStatistics>,
}

/// Writes the files of a version, episode by episode.
trait FormatWriter: Send {
    /// Adds the next episode.
    fn add(&mut self, episode: ExportedEpisode<'_>) -> Result<(), DatasetError>;
    /// Ends all files.
    fn finish(self: Box<Self>) -> Result<(), DatasetError>;
}

/// Exports a recording: `out` is there and whole afterwards, or not at all. `stop` ends it early; `told` hears of each episode
/// that is written, with the number of all.
///
/// # Errors
/// The recording is none, unfinished, without pictures or broken; a word fits no task; something is at `out`; a file cannot be
/// written; or the end was asked for.
pub fn export(
    export: &ExportConfig,
    stop: impl Fn() -> bool + Sync,
    mut told: impl FnMut(usize, &str) + Send,
) -> Result<ExportSummary, DatasetError> {
    staged_dir::free(&export.out)?;
    let chosen = selection::choose(&export.data, &export.tasks)?;
    let features = features::all(chosen.sizes);
    let place = StagedDir::claim(&export.out)?;
    let written = write(export, &chosen, &features, &place, &stop, &mut told);
    match written {
        Ok(exported) => place.settle().map(|()| exported),
        Err(error) => {
            place.give_up();
            Err(error)
        }
    }
}

fn write(
    export: &ExportConfig,
    chosen: &Selection,
    features: &[Feature],
    place: &StagedDir,
    stop: &(impl Fn() -> bool + Sync),
    told: &mut (impl FnMut(usize, &str) + Send),
) -> Result<ExportSummary, DatasetError> {
    let (sources, dir) = (&chosen.sources, place.dir());
    let mut form: Box<dyn FormatWriter> = match export.version {
        LeRobotVersion::V21 => Box::new(v21::Writer::begin(dir, features)?),
        LeRobotVersion::V30 => Box::new(v30::Writer::begin(dir, features)?),
    };
    crate::parallel::run_in_order(
        sources.len(),
        export.threads,
        || false,
        |index| read(export, chosen, index, stop),
        |index, episode| {
            form.add(episode)?;
            let id = &sources[index].entry;
            told(sources.len(), &format!("{} task {} demo {}", id.suite, id.task_id, id.demo_id));
            Ok(())
        },
    )?;
    form.finish()?;
    let frames = sources.iter().map(|source| source.entry.num_samples).sum();
    let exported = ExportSummary { episodes: sources.len(), frames, tasks: chosen.prompts.len() };
    meta::write(dir, export, chosen, features, exported)?;
    Ok(exported)
}

/// One episode, ready to be written.
fn read<'a>(
    export: &ExportConfig,
    chosen: &'a Selection,
    index: usize,
    stop: &(impl Fn() -> bool + Sync),
) -> Result<ExportedEpisode<'a>, DatasetError> {
    let source = &chosen.sources[index];
    let file = TaskFile::open(&source.path)?;
    let (demo, steps) = (source.entry.demo_id, source.entry.num_samples);
    let rows = episode::read(&file, (demo, steps), chosen.sizes, export.gripper, stop)?;
    let mut summaries = rows.summaries();
    summaries.push(match export.version {
        LeRobotVersion::V21 => rows.every_marker(),
        LeRobotVersion::V30 => rows.markers_together(),
    });
    summaries.extend(meta::numbered(index, source));
    Ok(ExportedEpisode { index, source, rows, summaries })
}

/// Time of a step, s.
fn timestamp(step: usize) -> f32 {
    (step as f64 / f64::from(frame_rate())) as f32
}

impl ExportedEpisode<'_> {
    /// The columns of its table, in the order of the features; `name` is what the picture of a step is called.
    fn columns(
        rows: EpisodeRows,
        (index, source): (usize, &SelectedDemo),
        name: fn(usize) -> String,
    ) -> Vec<ColumnValues> {
        let steps = rows.steps;
        let same = |number: usize| ColumnValues::I64(vec![number as i64; steps]);
        let counted = |from: usize| ColumnValues::I64((from..from + steps).map(|i| i as i64).collect());
        let pictures = rows.pictures.into_iter().map(|files| {
            ColumnValues::Pictures(
                files.into_iter().enumerate().map(|(step, file)| (file, name(step))).collect(),
            )
        });
        let rest = [
            ColumnValues::F32(rows.state),
            ColumnValues::F32(rows.actions),
            ColumnValues::F32(rows.markers),
            ColumnValues::F32((0..steps).map(timestamp).collect()),
            counted(0),
            same(index),
            counted(source.first),
            same(source.task),
        ];
        pictures.chain(rest).collect()
    }
}
