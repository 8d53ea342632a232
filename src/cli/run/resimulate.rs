//! Episodes that are simulated again by their recorded actions.

use crate::{
    cli::{
        error::CliError,
        run::{
            episode_artifacts::EpisodeArtifacts,
            suite_run::{ControllerFactory, SuiteRun, line, tell_undrawn},
        },
    },
    evaluation::record::{EpisodeRecord, Outcome},
    parallel,
    policy::{Action, ChunkedPolicy, recorded::RecordedPolicy},
    report::actions,
    rollout::{FinishedEpisode, cancel},
};

/// Whoever drove the episode of `record`, as its actions say.
pub(crate) fn drive(recorded: Vec<Action>, record: &EpisodeRecord) -> ControllerFactory {
    let ending = match &record.outcome {
        Outcome::Error { message } => Some(message.clone()),
        _ => None,
    };
    Box::new(move |_, brief| {
        Ok(Box::new(ChunkedPolicy::new(Box::new(RecordedPolicy::poses(&recorded, ending.clone())), brief, 1)))
    })
}

/// What came out when an episode was simulated again, with what is not simulated again: who drove, what it said, and what
/// was looked at.
pub(crate) fn known(mut again: EpisodeRecord, record: &EpisodeRecord) -> EpisodeRecord {
    again.identity.policy.clone_from(&record.identity.policy);
    again.identity.privileged = record.identity.privileged;
    again.stats.force_observed = record.stats.force_observed;
    again.stats.camera_inside = record.stats.camera_inside;
    again.stats.gave_up.clone_from(&record.stats.gave_up);
    again
}

/// In what they differ, if they do: the record of an episode is the same to the byte.
///
/// # Errors
/// A record is no JSON.
pub(crate) fn difference(known: &EpisodeRecord, again: &EpisodeRecord) -> Result<Option<String>, CliError> {
    let bytes = |record: &EpisodeRecord| serde_json::to_string(record).map_err(CliError::input);
    if bytes(known)? == bytes(again)? {
        return Ok(None);
    }
    let json = |record: &EpisodeRecord| serde_json::json!(record);
    Ok(Some(crate::cli::run::run_manifest::difference(&json(known), &json(again)).unwrap_or_default()))
}

/// Makes the files of finished episodes again that are wanted and not there: by their recorded actions, or by whoever drove
/// them unless that is behind a network. What cannot be made again is told; its results stay.
///
/// # Errors
/// An episode cannot be run, or a file not written.
pub(crate) fn make_lost_files(batch: &SuiteRun, done: &[EpisodeRecord]) -> Result<(), CliError> {
    let files = batch.files();
    let lost: Vec<&EpisodeRecord> = done.iter().filter(|record| !files.lost(record).is_empty()).collect();
    let has_actions = |record: &EpisodeRecord| {
        actions::path(&batch.out, record.identity.task, record.identity.episode).is_file()
    };
    let (can, cannot): (Vec<_>, Vec<_>) =
        lost.into_iter().partition(|record| has_actions(record) || !batch.run.policy.is_remote());
    if let Some(first) = cannot.first() {
        crate::text::eprint_line(&format!(
            "softvt: {} finished episodes lack their actions, so that their files cannot be made again, first: {}; their results stay",
            cannot.len(),
            line(first)
        ));
    }
    if let Some(path) = can.first().and_then(|record| files.lost(record).into_iter().next()) {
        crate::text::eprint_line(&format!(
            "softvt: {} finished episodes lack files, first {}: they are made again",
            can.len(),
            path.display()
        ));
    }
    parallel::run(
        can.len(),
        batch.run.threads,
        cancel::requested,
        |index| simulate(batch, can[index], has_actions(can[index]), &files),
        |_, made| {
            let Some((finished, drawn)) = made else { return Ok(()) };
            files.write(&finished)?;
            tell_undrawn(&finished, drawn);
            Ok(())
        },
    )
}

/// An episode, and whether it could be drawn.
type Made = (FinishedEpisode, Result<(), CliError>);

/// A finished episode once more; nothing, and a word about it, if it does not come out as its record says.
fn simulate(
    batch: &SuiteRun,
    record: &EpisodeRecord,
    recorded: bool,
    files: &EpisodeArtifacts,
) -> Result<Option<Made>, CliError> {
    let id = &record.identity;
    let place = (id.task, id.episode);
    let job = batch.jobs.iter().position(|(task, episode)| (task.id, *episode) == place);
    let Some(job) = job else { return Ok(None) };
    let film = files.may_show(id.episode);
    let mut finished = match recorded {
        true => {
            let path = actions::path(&batch.out, id.task, id.episode);
            let recorded = actions::read(&path).map_err(CliError::input)?;
            batch.episode(job, film, &drive(recorded, record))?
        }
        false => batch.episode(job, film, &batch.drive)?,
    };
    finished.record = known(finished.record, record);
    if let Some(what) = difference(record, &finished.record)? {
        crate::text::eprint_line(&format!(
            "softvt: no files of {}: it does not come out as recorded ({what}); its results stay",
            line(record)
        ));
        return Ok(None);
    }
    let drawn = files.draw(&mut finished);
    Ok(Some((finished, drawn)))
}
