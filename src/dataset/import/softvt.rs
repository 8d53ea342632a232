//! softvt's own files: the same commands, from the start of the same episode.

use super::{
    super::{DatasetError, TaskFile},
    ForeignDemo, ForeignTask, InitialCondition,
    header::Header,
    rows::{key, rows},
};
use crate::{benchmark::seed::Split, policy::ToolCommand};

/// A demonstration of softvt's.
///
/// # Errors
/// It lacks something, or is none of those that are recorded.
pub(super) fn demo(file: &TaskFile, _: &Header, demo: usize) -> Result<ForeignDemo, DatasetError> {
    let record = file.record(demo)?;
    let id = &record.identity;
    if id.split != Split::Demonstration.name() {
        let what = format!("it is of the split {}, no recorded demonstration", id.split);
        return Err(DatasetError::content(file.path(), key(demo, "metadata_json"), what));
    }
    let commands: Vec<ToolCommand> = file.actions(demo)?.into_iter().map(ToolCommand::Pose).collect();
    let binary = rows::<7>(file, demo, "actions_binary", Some(commands.len()))?;
    Ok(ForeignDemo {
        name: format!("demo_{demo}"),
        task: ForeignTask {
            suite: Some(id.suite.clone()),
            id: Some(id.task),
            prompts: vec![id.prompt.clone()],
        },
        held: vec![false; commands.len()],
        shut: binary.iter().map(|row| row[6] > 0.5).collect(),
        commands,
        begins: InitialCondition::SoftvtEpisode {
            seed: id.seed,
            attempt: id.episode,
            start: id.origin.as_ref().map(|origin| origin.start.clone()).unwrap_or_default(),
        },
        said: "its actions, from the start of its own episode",
    })
}
