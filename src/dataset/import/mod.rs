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
use softvt_benchmark::settings::CONTROL_DT;
use softvt_common::{episode_id::EpisodeSplit, files::FileError, text::hex};
use softvt_policy::ToolCommand;

pub use foreign::{
    ForeignDemo, ForeignFile, ForeignFormat, ForeignObjectPose, ForeignTask, InitialCondition,
};
pub use object_matching::match_objects;

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
fn softvt_demo(reader: DemoReader) -> Result<ForeignDemo, DatasetError> {
    let record = reader.file.record(reader.demo)?;
    // A demonstration may have been copied to another place in a file.
    let contradictions = reader.file.contradictions(reader.demo, &record);
    if let Some((name, what)) = contradictions.into_iter().find(|(name, _)| *name != "demo_id") {
        let key = format!("/data/demo_{}, attribute {name}", reader.demo);
        let what = format!("{what}; the record decides: relabel the imported demonstrations instead");
        return Err(DatasetError::content(&reader.file.path, key, what));
    }
    let header = &record.header;
    let id = &header.id;
    if id.split != EpisodeSplit::Demonstration {
        let what = format!("its split is {}; expected demonstration", id.split.name());
        return Err(reader.error("metadata_json", what));
    }
    let commands: Vec<ToolCommand> =
        reader.file.actions(reader.demo)?.into_iter().map(ToolCommand::from).collect();
    let binary = reader.rows::<7>("actions_binary", Some(commands.len()))?;
    check_times(&reader)?;
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

/// Finds times that are not those of control steps: the commands of another rate would be repeated at the wrong one.
fn check_times(reader: &DemoReader) -> Result<(), DatasetError> {
    if !reader.has("timestamps") {
        return Ok(());
    }
    let times = reader.array("timestamps")?.values;
    let is_late = |(step, time): &(usize, &f64)| (*time - *step as f64 * CONTROL_DT).abs() > 1e-6;
    let late = times.iter().enumerate().find(is_late);
    let wrong = |(step, time)| format!("step {step}: {time} s, expected multiples of {CONTROL_DT} s");
    late.map_or(Ok(()), |late| Err(reader.error("timestamps", wrong(late))))
}

fn sha256(path: &Path) -> Result<String, DatasetError> {
    let mut file = std::fs::File::open(path).map_err(FileError::io("read", path))?;
    let mut hash = Sha256::new();
    std::io::copy(&mut file, &mut hash).map_err(FileError::io("read", path))?;
    Ok(hex(&hash.finalize()))
}

#[cfg(test)]
mod tests;
