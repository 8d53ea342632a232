//! `softvt dataset import`: demonstrations of other simulators, re-executed in a suite. Those that are safe and reach
//! the goal are recorded.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::json;

use super::task_matching::{MatchedDemo, match_demos};
use crate::{
    benchmark::Task,
    cli::{
        args::ImportArgs,
        error::CliError,
        output::notice,
        run::{
            grip_recorder::GripLog,
            policy::PolicyConfig,
            recording::{self, AttemptPlan, RecordingConfig, SuiteRecording},
            selection::select_suites,
            suite_run::SuiteRun,
        },
    },
    dataset::{
        card::Imported,
        import::{self, ForeignDemo, ForeignFile, InitialCondition},
    },
    evaluation::{episode_id::EpisodeIndex, record::Origin},
    parallel,
    policy::{ChunkedPolicy, ToolCommand, builtin::RecordedPolicy},
    rollout::target_asset,
    scene::{Body, InitialState},
    script,
    text::counted,
};

/// Imports the demonstrations that the arguments name.
///
/// # Errors
/// The script has no suite, a file is not valid or matches no task, the folder contains something else, an attempt or a
/// file fails, or no demonstration is kept.
pub(super) fn run(args: &ImportArgs) -> Result<(), CliError> {
    let config = RecordingConfig::new(&args.script, &args.recording, &args.tasks)?
        .with_policy(PolicyConfig::external("import"));
    let run = &config.run;
    let loaded = script::load(&run.file, &run.script_options).map_err(CliError::input)?;
    let suites = select_suites("dataset import", run, &loaded.plan)?;
    let files: Vec<ForeignFile> = args
        .files
        .iter()
        .map(|path| import::read(path).map_err(CliError::input))
        .collect::<Result<_, _>>()?;
    let sources = describe_files(&files)?;
    let matched = match_demos(run, &suites, &files, args.attempts.unwrap_or(u32::MAX))?;
    let names: BTreeSet<String> = matched.iter().map(|demo| run.suite_name(suites[demo.suite])).collect();
    let request = json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "imported": sources,
        "attempts": args.attempts,
        "layout": args.layout,
        "task": run.tasks,
        "pictures": config.images_in_hdf5,
        "privileged": config.with_privileged,
        "suites": names,
    });
    recording::record_all(&config, &request, || {
        for Imported { file, layout, demos, commands, .. } in &sources {
            notice(format!("{file}: {layout}, {}: {commands}", counted(*demos, "demonstration")));
        }
        let mut recordings = Vec::new();
        for (index, suite) in suites.iter().copied().enumerate() {
            let demos: Vec<&MatchedDemo> = matched.iter().filter(|demo| demo.suite == index).collect();
            if demos.is_empty() {
                continue;
            }
            let mut attempts: BTreeMap<usize, BTreeSet<u32>> = BTreeMap::new();
            for demo in &demos {
                attempts.entry(demo.task).or_default().insert(demo.attempt);
            }
            let tasks = suite.tasks.iter().filter(|task| attempts.contains_key(&task.id)).collect();
            let plan = AttemptPlan::All(attempts);
            recordings.push(SuiteRecording::new(
                &config,
                &loaded,
                suite,
                tasks,
                plan,
                |suite_run, grip_log| {
                    suite_run.imported = sources.clone();
                    replay_demos(suite_run, grip_log, &demos, args.layout)
                },
            )?);
        }
        Ok(recordings)
    })
}

/// Describes the files for `recording.json` and the dataset card.
///
/// # Errors
/// Two files have the same content.
fn describe_files(files: &[ForeignFile]) -> Result<Vec<Imported>, CliError> {
    let mut seen: BTreeMap<&str, &ForeignFile> = BTreeMap::new();
    for file in files {
        if let Some(twin) = seen.insert(&file.sha256, file) {
            return Err(CliError::input(format!(
                "{} and {} are byte-identical; name one of them",
                twin.path.display(),
                file.path.display()
            )));
        }
    }
    let describe = |file: &ForeignFile| Imported {
        file: file_name(file),
        sha256: file.sha256.clone(),
        layout: file.layout.name().to_owned(),
        demos: file.demos.len(),
        commands: file.demos.first().map_or(String::new(), |demo| demo.command_source.to_owned()),
    };
    Ok(files.iter().map(describe).collect())
}

fn file_name(file: &ForeignFile) -> String {
    file.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Makes the episodes of a run re-execute the demonstrations, each from its own initial state. With `use_layout`
/// objects start where the layout puts them.
fn replay_demos(
    run: &mut SuiteRun,
    grip_log: &GripLog,
    demos: &[&MatchedDemo],
    use_layout: bool,
) -> Result<(), CliError> {
    let mut commands: BTreeMap<EpisodeIndex, Vec<ToolCommand>> = BTreeMap::new();
    let (mut placed, mut foreign) = (0, 0);
    for matched in demos {
        let index = EpisodeIndex { task: matched.task, episode: matched.attempt };
        let (start, demo) = initial_state(run, matched, use_layout)?;
        foreign += usize::from(matches!(demo.initial_condition, InitialCondition::OtherSimulator { .. }));
        placed += usize::from(!start.places.is_empty());
        let origin = Origin {
            file: file_name(matched.file),
            sha256: matched.file.sha256.clone(),
            demo: demo.name.clone(),
            layout: matched.file.layout.name().to_owned(),
            start,
        };
        run.origins.insert(index, origin);
        commands.insert(index, demo.commands);
        parallel::lock(grip_log).insert(index, demo.gripper_closed);
    }
    run.controllers = Box::new(move |_, brief| {
        let index = brief.index();
        let commands = commands.get(&index).cloned().unwrap_or_default();
        Ok(Box::new(ChunkedPolicy::new(Box::new(RecordedPolicy::new(commands, None)), brief, 1)))
    });
    if foreign > 0 {
        notice(format!(
            "{}: in {placed} of {foreign} demonstrations objects start where the file has them, in the others where the \
             layout puts them",
            run.suite.name
        ));
    }
    Ok(())
}

/// The initial state of a demonstration in the suite, and the demonstration adapted to the suite.
fn initial_state(
    run: &SuiteRun,
    matched: &MatchedDemo,
    use_layout: bool,
) -> Result<(InitialState, ForeignDemo), CliError> {
    let mut demo = matched.demo.clone();
    let (joints, poses) = match &matched.demo.initial_condition {
        InitialCondition::SoftvtEpisode { start, .. } => {
            let places = if use_layout { Vec::new() } else { start.places.clone() };
            return Ok((InitialState { places, ..*start }, demo));
        }
        InitialCondition::OtherSimulator { joints, objects } => {
            (*joints, if use_layout { &[][..] } else { objects })
        }
    };
    let mut start = InitialState { joints, places: Vec::new() };
    if poses.is_empty() && !demo.is_stopped_by_object.contains(&true) {
        return Ok((start, demo));
    }
    let task: Option<&Task> = run.suite.tasks.iter().find(|task| task.id == matched.task);
    let task = task.ok_or_else(|| CliError::internal("matched a task that is not in the suite"))?;
    let opened = run.open_episode(&run.episode_id(task, matched.attempt))?;
    start.places = import::match_objects(&opened.scene, &task.goal.object, poses);
    if target_asset(&opened.scene, task).is_some_and(|asset| matches!(asset.body, Body::Rigid { .. })) {
        demo.close_fully_on_rigid_object();
    }
    Ok((start, demo))
}
