//! Demonstrations of other simulators, re-executed in a suite. Those that are safe and reach the goal are recorded.

mod task_matching;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
};

use serde_json::json;

use crate::{
    config::ConfiguredScript,
    episode_list::{EpisodeJob, EpisodeList},
    error::RunError,
    policy::{ControllerFactory, PolicyConfig},
    recording::{HoldingLog, RecordingOptions, RecordingSummary, SuiteRecording, record_all},
    suite_run::{ImportedDemos, SuiteRun},
    suite_selection::select_suites,
};
use softvt_common::{episode_id::EpisodeIndex, parallel, text::counted};
use softvt_dataset::import::{self, ForeignDemo, ForeignFile, InitialCondition};
use softvt_policy::{ToolCommand, builtin::RecordedPolicy};
use softvt_rollout::{ChunkedPolicy, target_asset};
use softvt_runs::{manifest::ImportedFile, record::DemonstrationOrigin};
use softvt_scene::{Body, InitialStateOverride};
use task_matching::{MatchedDemo, match_demos};

#[derive(Clone, Copy, Debug, Default)]
pub struct ImportOptions {
    /// Maximum number of demonstrations per task, in order; by default all.
    pub attempts: Option<u32>,
    /// True to start objects where the layouts of the suite put them, not where the files do.
    pub ignore_recorded_poses: bool,
}

/// Re-executes the demonstrations of `files` in the suites of a script, and records those that are safe and reach the
/// goal. Returns `None` if the output folder contains this very dataset already.
///
/// # Errors
/// The script has no suite, a file is not valid or matches no task, the folder contains something else, an attempt or a
/// file fails, or no demonstration is kept.
pub fn import(
    run: &ConfiguredScript,
    files: &[PathBuf],
    options: ImportOptions,
    recording: &RecordingOptions,
) -> Result<Option<RecordingSummary>, RunError> {
    // The name of the policy in the records; the actions are those of the files.
    let config = &run.config.clone().with_policy(PolicyConfig::external("import"));
    let loaded = &run.script;
    let suites = select_suites(config, &loaded.plan)?;
    let files: Vec<ForeignFile> = files.iter().map(|path| import::read(path)).collect::<Result<_, _>>()?;
    let sources = describe_files(&files)?;
    let matched = match_demos(config, suites, &files, options.attempts.unwrap_or(u32::MAX))?;
    let names: BTreeSet<String> =
        matched.iter().map(|demo| config.suite_name(&suites[demo.task.suite])).collect();
    let mut request = json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "imported": sources,
        "attempts": options.attempts,
        "ignore_recorded_poses": options.ignore_recorded_poses,
        "task": config.tasks,
        "pictures": recording.has_images,
        "privileged": recording.has_privileged,
        "suites": names,
    });
    recording.describe(&mut request);
    record_all(recording, &request, || {
        for ImportedFile { file, format, demos, commands, .. } in &sources {
            config.notice(format_args!("{file}: {format}, {}: {commands}", counted(*demos, "demonstration")));
        }
        let mut recordings = Vec::new();
        for (index, suite) in suites.iter().enumerate() {
            let demos: Vec<&MatchedDemo> = matched.iter().filter(|demo| demo.task.suite == index).collect();
            if demos.is_empty() {
                continue;
            }
            let mut jobs: Vec<EpisodeJob> =
                demos.iter().map(|demo| EpisodeJob { task: demo.task.task, episode: demo.attempt }).collect();
            jobs.sort_by_key(|job| (suite.tasks.iter().position(|task| task.id == job.task.id), job.episode));
            recordings.push(SuiteRecording::new(
                config,
                recording,
                loaded,
                suite,
                EpisodeList::listed(jobs),
                None,
                |run, log| replay_demos(run, log, &demos, options.ignore_recorded_poses, sources.clone()),
            )?);
        }
        Ok(recordings)
    })
}

/// Describes the files for `recording.json` and the dataset card.
fn describe_files(files: &[ForeignFile]) -> Result<Vec<ImportedFile>, RunError> {
    let mut seen: BTreeMap<&str, &ForeignFile> = BTreeMap::new();
    for file in files {
        if let Some(twin) = seen.insert(&file.sha256, file) {
            return Err(RunError::input(format_args!(
                "{} and {} are byte-identical; name one of them",
                twin.path.display(),
                file.path.display()
            )));
        }
    }
    let describe = |file: &ForeignFile| ImportedFile {
        file: file_name(file),
        sha256: file.sha256.clone(),
        format: file.format.name().to_owned(),
        demos: file.demos.len(),
        commands: file.demos.first().map_or(String::new(), |demo| demo.command_source.to_owned()),
    };
    Ok(files.iter().map(describe).collect())
}

fn file_name(file: &ForeignFile) -> String {
    file.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Makes the episodes of a run re-execute the demonstrations, each from its own initial state. With
/// `ignore_recorded_poses` objects start where the layout puts them.
fn replay_demos<'a>(
    run: SuiteRun<'a>,
    grip_log: &HoldingLog,
    demos: &[&MatchedDemo],
    ignore_recorded_poses: bool,
    files: Vec<ImportedFile>,
) -> Result<SuiteRun<'a>, RunError> {
    let mut origins = BTreeMap::new();
    let mut commands: BTreeMap<EpisodeIndex, Vec<ToolCommand>> = BTreeMap::new();
    let (mut placed, mut foreign) = (0, 0);
    for matched in demos {
        let index = EpisodeIndex { task: matched.task.task.id, episode: matched.attempt };
        let (start, demo) = initial_state(&run, matched, ignore_recorded_poses)?;
        foreign += usize::from(matches!(demo.initial_condition, InitialCondition::OtherSimulator { .. }));
        placed += usize::from(!start.places.is_empty());
        let origin = DemonstrationOrigin {
            file: file_name(matched.file),
            sha256: matched.file.sha256.clone(),
            demo: demo.name.clone(),
            format: matched.file.format.name().to_owned(),
            start,
        };
        origins.insert(index, origin);
        commands.insert(index, demo.commands);
        parallel::lock(grip_log).insert(index, demo.gripper_closed);
    }
    let controllers: ControllerFactory = Box::new(move |_, brief| {
        let index = brief.index();
        let commands = commands.get(&index).cloned().unwrap_or_default();
        Ok(Box::new(ChunkedPolicy::new(Box::new(RecordedPolicy::new(commands, None)), brief, 1)))
    });
    if foreign > 0 {
        run.config.notice(format_args!(
            "{}: in {placed} of {foreign} demonstrations objects start where the file has them, in the others where the \
             layout puts them",
            run.suite.name
        ));
    }
    Ok(SuiteRun { import: ImportedDemos { origins, files }, controllers, ..run })
}

/// The initial state of a demonstration in the suite, and the demonstration adapted to the suite.
fn initial_state(
    run: &SuiteRun,
    matched: &MatchedDemo,
    ignore_recorded_poses: bool,
) -> Result<(InitialStateOverride, ForeignDemo), RunError> {
    let mut demo = matched.demo.clone();
    let (joints, poses) = match &matched.demo.initial_condition {
        InitialCondition::SoftvtEpisode { start, .. } => {
            let places = if ignore_recorded_poses { Vec::new() } else { start.places.clone() };
            return Ok((InitialStateOverride { places, ..*start }, demo));
        }
        InitialCondition::OtherSimulator { joints, objects } => {
            (*joints, if ignore_recorded_poses { &[][..] } else { objects })
        }
    };
    let mut start = InitialStateOverride { joints, places: Vec::new() };
    if poses.is_empty() && !demo.is_stopped_by_object.contains(&true) {
        return Ok((start, demo));
    }
    let task = matched.task.task;
    let opened = run.open_episode(&run.episode_id(task, matched.attempt))?;
    start.places = import::match_objects(&opened.scene, &task.object, poses);
    if target_asset(&opened.scene, task).is_some_and(|asset| matches!(asset.body, Body::Rigid { .. })) {
        demo.close_fully_on_rigid_object();
    }
    Ok((start, demo))
}
