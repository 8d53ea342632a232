//! Re-simulation of finished episodes: comparison with their records, and restoration of lost files.

use crate::{
    cli::{
        error::CliError,
        output::notice,
        run::{
            episode_artifacts::EpisodeArtifacts,
            policy::ControllerFactory,
            run_manifest,
            suite_run::{SuiteRun, report_unrendered},
        },
    },
    evaluation::record::{EpisodeRecord, Outcome},
    parallel,
    policy::{Action, ChunkedPolicy, builtin::RecordedPolicy},
    report::actions,
    rollout::{FinishedEpisode, cancel},
    text::counted,
};

/// A controller factory that repeats the actions of a recorded episode, and its error if it ended with one.
pub(crate) fn replay_factory(recorded: Vec<Action>, record: &EpisodeRecord) -> ControllerFactory {
    let ending = match &record.outcome {
        Outcome::Error { message } => Some(message.clone()),
        _ => None,
    };
    Box::new(move |_, brief| {
        let policy = RecordedPolicy::from_actions(&recorded, ending.clone());
        Ok(Box::new(ChunkedPolicy::new(Box::new(policy), brief, 1)))
    })
}

/// Copies from `record` what a re-simulation does not produce: the policy, what it observed, and why it gave up.
pub(crate) fn with_policy_fields(mut simulated: EpisodeRecord, record: &EpisodeRecord) -> EpisodeRecord {
    simulated.header.policy.clone_from(&record.header.policy);
    simulated.header.privileged = record.header.privileged;
    simulated.stats.force_observed = record.stats.force_observed;
    simulated.stats.camera_inside = record.stats.camera_inside;
    simulated.stats.gave_up.clone_from(&record.stats.gave_up);
    simulated
}

/// Describes the first difference of two records. `None` if they are byte-identical.
///
/// # Errors
/// A record cannot be written as JSON.
pub(crate) fn difference(
    recorded: &EpisodeRecord,
    simulated: &EpisodeRecord,
) -> Result<Option<String>, CliError> {
    let bytes = |record: &EpisodeRecord| serde_json::to_string(record).map_err(CliError::input);
    if bytes(recorded)? == bytes(simulated)? {
        return Ok(None);
    }
    let json = |record: &EpisodeRecord| serde_json::json!(record);
    Ok(Some(run_manifest::difference(&json(recorded), &json(simulated)).unwrap_or_default()))
}

/// Restores requested files of finished episodes that are missing: by the recorded actions, or without these by the
/// policy unless it is a server. Files that cannot be restored are reported; the results of their episodes stay.
///
/// # Errors
/// An episode cannot be run, or a file cannot be written.
pub(crate) fn restore_artifacts(run: &SuiteRun, records: &[EpisodeRecord]) -> Result<(), CliError> {
    let artifacts = run.artifacts();
    let incomplete = records.iter().filter(|record| !artifacts.missing(record).is_empty());
    let has_actions = |record: &EpisodeRecord| actions::path(&run.out, record.header.id.index()).is_file();
    let (restorable, lost): (Vec<_>, Vec<_>) =
        incomplete.partition(|record| has_actions(record) || !run.config.policy.is_remote());
    if let Some(first) = lost.first() {
        notice(format!(
            "{} finished episodes lack their actions, so their files cannot be restored (first: {}); their results stay",
            lost.len(),
            first.header.id.index()
        ));
    }
    if let Some(path) = restorable.first().and_then(|record| artifacts.missing(record).into_iter().next()) {
        notice(format!(
            "restoring files of {} (first: {})",
            counted(restorable.len(), "finished episode"),
            path.display()
        ));
    }
    parallel::run(
        restorable.len(),
        run.config.threads,
        cancel::requested,
        |index| {
            let record = restorable[index];
            simulate(run, record, has_actions(record), &artifacts)
        },
        |_, simulated| {
            let Some(SimulatedEpisode { finished, rendered }) = simulated else { return Ok(()) };
            artifacts.write(&finished)?;
            report_unrendered(&finished, rendered);
            Ok(())
        },
    )
}

/// A simulated episode, and the result of rendering it.
struct SimulatedEpisode {
    finished: FinishedEpisode,
    rendered: Result<(), CliError>,
}

/// Simulates a finished episode again. Returns `None`, after a notice, if the result differs from its record.
fn simulate(
    run: &SuiteRun,
    record: &EpisodeRecord,
    has_actions: bool,
    artifacts: &EpisodeArtifacts,
) -> Result<Option<SimulatedEpisode>, CliError> {
    let index = record.header.id.index();
    let Some(job) = run.jobs.iter().find(|job| job.index() == index).copied() else { return Ok(None) };
    let keep_states = artifacts.may_render(index.episode);
    let mut finished = if has_actions {
        let path = actions::path(&run.out, index);
        let recorded = actions::read(&path).map_err(CliError::input)?;
        run.run_episode(job, keep_states, &replay_factory(recorded, record))?
    } else {
        run.run_episode(job, keep_states, &run.controllers)?
    };
    finished.record = with_policy_fields(finished.record, record);
    if let Some(difference) = difference(record, &finished.record)? {
        notice(format!(
            "files of {index} are not restored: the simulation differs from its record ({difference}); its results stay"
        ));
        return Ok(None);
    }
    let rendered = artifacts.render(&mut finished);
    Ok(Some(SimulatedEpisode { finished, rendered }))
}
