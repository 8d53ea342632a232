//! Recorded demonstrations as data sets of LeRobot, in the versions that are trained from: v2.1 and v3.0.
//!
//! A row holds what a policy of the profile `visuo_tactile` is sent at that step, and what was commanded then; of the eight past
//! states of the markers only the last two, as SoftVTBench has it. `docs/data.md` says what is in the folder. Demonstrations are
//! read and their pictures packed on several threads, and written in order; each thread holds one of them.

mod features;
mod meta;
mod place;
mod rows;
mod source;
mod summary;
mod table;
mod turns;
mod v21;
mod v30;

use std::path::PathBuf;

use self::{
    features::Feature,
    place::Place,
    rows::Rows,
    source::{Chosen, Source},
    summary::FeatureSummary,
    table::Values,
};
use super::{DatasetError, TaskFile, recorder::rate};

/// A version of LeRobot's layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// A table an episode: what openpi and SoftVTBench train from.
    V21,
    /// Many episodes a table: LeRobot's own since 0.4.
    V30,
}

/// Which code of the gripper becomes the seventh number of the actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gripper {
    /// Closure, 0 open to 1 shut.
    Continuous,
    /// 1 while the expert means to hold, else 0.
    Binary,
}

/// What to export, and how.
#[derive(Clone, Debug)]
pub struct Export {
    /// Folder of a finished recording.
    pub data: PathBuf,
    /// New folder.
    pub out: PathBuf,
    /// Layout.
    pub version: Version,
    /// Code of the gripper.
    pub gripper: Gripper,
    /// Only the tasks that fit one of these: indices, or parts of prompts; all if there are none.
    pub tasks: Vec<String>,
    /// Threads; the files do not depend on it.
    pub threads: usize,
}

/// What was exported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exported {
    /// Episodes.
    pub episodes: usize,
    /// Rows of all.
    pub frames: usize,
    /// Different prompts.
    pub tasks: usize,
}

impl Version {
    /// As `info.json` has it.
    fn code(self) -> &'static str {
        match self {
            Self::V21 => "v2.1",
            Self::V30 => "v3.0",
        }
    }
}

/// An episode on its way into the files.
struct Episode<'a> {
    /// Its number.
    index: usize,
    source: &'a Source,
    rows: Rows,
    /// Every feature as a whole.
    summaries: Vec<FeatureSummary>,
}

/// Writes the files of a version, episode by episode.
trait Form: Send {
    /// Adds the next episode.
    fn add(&mut self, episode: Episode<'_>) -> Result<(), DatasetError>;
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
    export: &Export,
    stop: impl Fn() -> bool + Sync,
    mut told: impl FnMut(usize, &str) + Send,
) -> Result<Exported, DatasetError> {
    place::free(&export.out)?;
    let chosen = source::choose(&export.data, &export.tasks)?;
    let features = features::all(chosen.sizes);
    let place = Place::claim(&export.out)?;
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
    export: &Export,
    chosen: &Chosen,
    features: &[Feature],
    place: &Place,
    stop: &(impl Fn() -> bool + Sync),
    told: &mut (impl FnMut(usize, &str) + Send),
) -> Result<Exported, DatasetError> {
    let (sources, dir) = (&chosen.sources, place.dir());
    let mut form: Box<dyn Form> = match export.version {
        Version::V21 => Box::new(v21::Writer::begin(dir, features)?),
        Version::V30 => Box::new(v30::Writer::begin(dir, features)?),
    };
    turns::in_order(
        sources.len(),
        export.threads,
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
    let exported = Exported { episodes: sources.len(), frames, tasks: chosen.prompts.len() };
    meta::write(dir, export, chosen, features, exported)?;
    Ok(exported)
}

/// One episode, ready to be written.
fn read<'a>(
    export: &Export,
    chosen: &'a Chosen,
    index: usize,
    stop: &(impl Fn() -> bool + Sync),
) -> Result<Episode<'a>, DatasetError> {
    let source = &chosen.sources[index];
    let file = TaskFile::open(&source.path)?;
    let (demo, steps) = (source.entry.demo_id, source.entry.num_samples);
    let rows = rows::read(&file, (demo, steps), chosen.sizes, export.gripper, stop)?;
    let mut summaries = rows.summaries();
    summaries.push(match export.version {
        Version::V21 => rows.every_marker(),
        Version::V30 => rows.markers_together(),
    });
    summaries.extend(meta::numbered(index, source));
    Ok(Episode { index, source, rows, summaries })
}

/// Time of a step, s.
fn timestamp(step: usize) -> f32 {
    (step as f64 / f64::from(rate())) as f32
}

impl Episode<'_> {
    /// The columns of its table, in the order of the features; `name` is what the picture of a step is called.
    fn columns(rows: Rows, (index, source): (usize, &Source), name: fn(usize) -> String) -> Vec<Values> {
        let steps = rows.steps;
        let same = |number: usize| Values::I64(vec![number as i64; steps]);
        let counted = |from: usize| Values::I64((from..from + steps).map(|i| i as i64).collect());
        let pictures = rows.pictures.into_iter().map(|files| {
            Values::Pictures(files.into_iter().enumerate().map(|(step, file)| (file, name(step))).collect())
        });
        let rest = [
            Values::F32(rows.state),
            Values::F32(rows.actions),
            Values::F32(rows.markers),
            Values::F32((0..steps).map(timestamp).collect()),
            counted(0),
            same(index),
            counted(source.first),
            same(source.task),
        ];
        pictures.chain(rest).collect()
    }
}
