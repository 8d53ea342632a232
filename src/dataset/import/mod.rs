//! Import of demonstrations recorded by other programs, as commands and an initial state for softvt's simulation.
//!
//! `docs/data.md`, "Importing", lists what is read of each format. A file is read and checked completely before
//! anything is simulated; errors name the file, the key and the step.

mod demo_reader;
mod foreign;
mod header;
mod libero;
mod mujoco;
mod object_matching;
mod softvtbench;
mod tool_pose;

use std::path::Path;

use sha2::{Digest, Sha256};

use self::demo_reader::DemoReader;
use super::{DatasetError, TaskFile};
use softvt_benchmark::CONTROL_DT;
use softvt_common::episode_id::EpisodeSplit;
use softvt_common::files::FileError;
use softvt_common::text::hex;
use softvt_policy::ToolCommand;
use softvt_runs::record::EpisodeRecord;

pub use foreign::{
    ForeignDemo, ForeignFile, ForeignFormat, ForeignObjectPose, ForeignTask, InitialCondition,
};
pub use object_matching::match_objects;

/// Reads all demonstrations of a file.
///
/// # Errors
/// Unknown format, unsupported robot, controller or control rate, or missing or invalid streams.
pub fn read(path: &Path) -> Result<ForeignFile, DatasetError> {
    let file = TaskFile::open(path)?;
    let header = header::Header::read(&file)?;
    let demo = |&demo: &usize| {
        let reader = DemoReader { file: &file, demo };
        match header.format {
            ForeignFormat::Softvt => softvt_demo(reader),
            ForeignFormat::SoftVtBench => softvtbench::demo(reader, &header),
            ForeignFormat::Libero => libero::demo(reader, &header),
        }
    };
    let demos = file.demos.iter().map(demo).collect::<Result<_, _>>()?;
    Ok(ForeignFile { path: path.to_owned(), sha256: sha256(path)?, format: header.format, demos })
}

/// A demonstration of softvt itself: the recorded commands, from the initial state of the same episode.
///
/// # Errors
/// A stream is missing, or the file is not of the split of demonstrations.
fn softvt_demo(reader: DemoReader) -> Result<ForeignDemo, DatasetError> {
    let record = reader.file.record(reader.demo)?;
    let header = &record.header;
    let id = &header.id;
    if id.split != EpisodeSplit::Demonstration {
        let what = format!("its split is {}; expected demonstration", id.split.name());
        return Err(reader.error("metadata_json", what));
    }
    check_attributes(reader, &record)?;
    let commands: Vec<ToolCommand> =
        reader.file.actions(reader.demo)?.into_iter().map(ToolCommand::from).collect();
    let binary = reader.rows::<7>("actions_binary", Some(commands.len()))?;
    Ok(ForeignDemo {
        name: format!("demo_{}", reader.demo),
        task: ForeignTask {
            suite: Some(id.suite.clone()),
            id: Some(id.task),
            prompts: vec![header.prompt.clone()],
        },
        is_stopped_by_object: vec![false; commands.len()],
        gripper_closed: binary.iter().map(|row| row[6] > 0.5).collect(),
        commands,
        initial_condition: InitialCondition::SoftvtEpisode {
            seed: id.base_seed,
            attempt: id.episode,
            start: header.origin.as_ref().map(|origin| origin.start.clone()).unwrap_or_default(),
        },
        command_source: "its actions, from the start of its own episode",
    })
}

/// Checks that the attributes and times of a demonstration are those of its record, which decides what is imported.
///
/// # Errors
/// An attribute or a time differs from the record.
fn check_attributes(reader: DemoReader, record: &EpisodeRecord) -> Result<(), DatasetError> {
    let DemoReader { file, demo } = reader;
    // A demonstration may have been copied to another place in a file.
    let other = file.contradictions(demo, record).into_iter().find(|(name, _)| *name != "demo_id");
    if let Some((name, what)) = other {
        let what = format!("{what}; the record decides: relabel the imported demonstrations instead");
        return Err(DatasetError::content(&file.path, format!("/data/demo_{demo}, attribute {name}"), what));
    }
    if !reader.has("timestamps") {
        return Ok(());
    }
    let times = reader.array("timestamps")?.values;
    let is_late = |(step, time): &(usize, &f64)| (*time - *step as f64 * CONTROL_DT).abs() > TIME_TOLERANCE;
    match times.iter().enumerate().find(is_late) {
        Some((step, time)) => {
            let expected = step as f64 * CONTROL_DT;
            Err(reader.error(
                "timestamps",
                format!("step {step}: {time} s, expected {expected} s: control steps are 0.05 s"),
            ))
        }
        None => Ok(()),
    }
}

/// Largest error of times, s.
const TIME_TOLERANCE: f64 = 1e-6;

/// SHA-256 of a file, hexadecimal.
fn sha256(path: &Path) -> Result<String, DatasetError> {
    let mut file = std::fs::File::open(path).map_err(FileError::io("read", path))?;
    let mut hash = Sha256::new();
    std::io::copy(&mut file, &mut hash).map_err(FileError::io("read", path))?;
    Ok(hex(&hash.finalize()))
}

#[cfg(test)]
mod tests;
