//! softvt's own files: the recorded commands, from the initial state of the same episode.

use super::{DatasetError, DemoReader, ForeignDemo, ForeignTask, InitialCondition};
use crate::{evaluation::episode_id::Split, policy::ToolCommand};

/// # Errors
/// A stream is missing, or the file is not of the split of demonstrations.
pub(super) fn demo(reader: DemoReader) -> Result<ForeignDemo, DatasetError> {
    let record = reader.file.record(reader.demo)?;
    let header = &record.header;
    let id = &header.id;
    if id.split != Split::Demonstration {
        let what = format!("its split is {}; expected demonstration", id.split.name());
        return Err(reader.error("metadata_json", what));
    }
    let commands: Vec<ToolCommand> =
        reader.file.actions(reader.demo)?.into_iter().map(ToolCommand::Pose).collect();
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
