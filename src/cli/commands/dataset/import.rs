//! `softvt dataset import`: demonstrations of other worlds, re-executed in ours under its physics and sensors, those kept that
//! are safe and reach the goal.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
};

use serde_json::json;

use crate::{
    benchmark::Task,
    cli::{
        commands::dataset::task_matching::{MatchedDemo, match_all},
        error::CliError,
        run::{
            grip_recorder::GripLog,
            recording::{self, AttemptPlan, RecordingConfig, SuiteRecording, suites_of},
            suite_run::SuiteRun,
        },
    },
    dataset::{
        card::Imported,
        import::{self, ForeignFile, InitialCondition},
    },
    evaluation::record::Origin,
    policy::{ChunkedPolicy, ToolCommand, recorded::RecordedPolicy},
    rollout::target_asset,
    scene::{Body, InitialState},
    script,
};

/// What to import.
#[derive(Clone, Debug)]
pub(crate) struct Import {
    /// What is kept, and where.
    pub output: RecordingConfig,
    /// Files of demonstrations.
    pub files: Vec<PathBuf>,
    /// Most demonstrations of a task.
    pub attempts: Option<u32>,
    /// Whether the suite's own layouts are kept, whatever a file says of objects.
    pub layout: bool,
}

/// Imports what the command line asks for.
///
/// # Errors
/// The script is no suite, a file is none or of nothing in it, the folder holds something else, an attempt or a file fails,
/// nothing is kept.
pub(crate) fn run(import: &Import) -> Result<(), CliError> {
    let Import { output, files, attempts, layout } = import;
    let run = &output.run;
    let loaded = script::load(&run.file, &run.script_words).map_err(CliError::input)?;
    let suites = suites_of("dataset import", run, &loaded.plan)?;
    let files: Vec<ForeignFile> =
        files.iter().map(|path| import::read(path).map_err(CliError::input)).collect::<Result<_, _>>()?;
    let sources = sources(&files)?;
    let matched = match_all(run, &suites, &files, attempts.unwrap_or(u32::MAX))?;
    let names: BTreeSet<String> = matched.iter().map(|one| run.name_of(suites[one.suite])).collect();
    let asked = json!({
        "softvt": env!("CARGO_PKG_VERSION"),
        "imported": sources,
        "attempts": attempts,
        "layout": layout,
        "task": run.tasks,
        "pictures": output.pictures,
        "privileged": output.privileged,
        "suites": names,
    });
    recording::record_all(output, &asked, || {
        for source in &sources {
            let Imported { file, layout, demos, commands, .. } = source;
            crate::text::eprint_line(&format!(
                "softvt: {file}: {layout}, {demos} demonstrations: {commands}"
            ));
        }
        let mut sessions = Vec::new();
        for (index, suite) in suites.iter().enumerate() {
            let own: Vec<&MatchedDemo> = matched.iter().filter(|one| one.suite == index).collect();
            let mut wanted: BTreeMap<usize, BTreeSet<u32>> = BTreeMap::new();
            own.iter().for_each(|one| _ = wanted.entry(one.task).or_default().insert(one.attempt));
            if own.is_empty() {
                continue;
            }
            let tasks = suite.tasks.iter().filter(|task| wanted.contains_key(&task.id)).collect();
            sessions.push(SuiteRecording::new(
                output,
                (&loaded, *suite),
                (tasks, AttemptPlan::All(wanted)),
                |batch, grips| fit(batch, grips, (&own, &sources), *layout),
            )?);
        }
        Ok(sessions)
    })
}

/// What is said of the files.
///
/// # Errors
/// Two of them are one.
fn sources(files: &[ForeignFile]) -> Result<Vec<Imported>, CliError> {
    let mut seen: BTreeMap<&str, &ForeignFile> = BTreeMap::new();
    for file in files {
        if let Some(twin) = seen.insert(&file.sha256, file) {
            return Err(CliError::input(format!(
                "{} and {} are the same to the byte; name one of them",
                twin.path.display(),
                file.path.display()
            )));
        }
    }
    let about = |file: &ForeignFile| Imported {
        file: base_name(file),
        sha256: file.sha256.clone(),
        layout: file.layout.name().to_owned(),
        demos: file.demos.len(),
        commands: file.demos.first().map_or(String::new(), |demo| demo.command_source.to_owned()),
    };
    Ok(files.iter().map(about).collect())
}

fn base_name(file: &ForeignFile) -> String {
    file.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Lets the demonstrations drive, each from its own start.
fn fit(
    batch: &mut SuiteRun,
    grips: &GripLog,
    (own, sources): (&[&MatchedDemo], &[Imported]),
    layout: bool,
) -> Result<(), CliError> {
    let mut commands: BTreeMap<(usize, u32), Vec<ToolCommand>> = BTreeMap::new();
    let (mut placed, mut elsewhere) = (0, 0);
    for one in own {
        let place = (one.task, one.attempt);
        let (start, demo) = begin(batch, one, layout)?;
        elsewhere += usize::from(matches!(demo.initial_condition, InitialCondition::OtherSimulator { .. }));
        placed += usize::from(!start.places.is_empty());
        let origin = Origin {
            file: base_name(one.file),
            sha256: one.file.sha256.clone(),
            demo: demo.name.clone(),
            layout: one.file.layout.name().to_owned(),
            start,
        };
        batch.origins.insert(place, origin);
        commands.insert(place, demo.commands);
        if let Ok(mut all) = grips.lock() {
            all.insert(place, demo.gripper_closed);
        }
    }
    batch.imported = sources.to_vec();
    batch.drive = Box::new(move |_, brief| {
        let commands = commands.get(&(brief.task, brief.episode)).cloned().unwrap_or_default();
        Ok(Box::new(ChunkedPolicy::new(Box::new(RecordedPolicy::new(commands, None)), brief, 1)))
    });
    if elsewhere > 0 {
        let name = &batch.suite.name;
        crate::text::eprint_line(&format!(
            "softvt: {name}: in {placed} of {elsewhere} demonstrations things stand where the file has them, in the others where the layout puts them"
        ));
    }
    Ok(())
}

/// What a demonstration starts from in our world, and the demonstration as it is carried out there.
fn begin(
    batch: &SuiteRun,
    one: &MatchedDemo,
    layout: bool,
) -> Result<(InitialState, import::ForeignDemo), CliError> {
    let mut demo = one.demo.clone();
    let (joints, objects) = match &one.demo.initial_condition {
        InitialCondition::SoftvtEpisode { start, .. } => {
            let places = if layout { Vec::new() } else { start.places.clone() };
            return Ok((InitialState { places, ..*start }, demo));
        }
        InitialCondition::OtherSimulator { joints, objects } => {
            (*joints, if layout { &[][..] } else { objects })
        }
    };
    let mut start = InitialState { joints, places: Vec::new() };
    if objects.is_empty() && !demo.is_stopped_by_object.contains(&true) {
        return Ok((start, demo));
    }
    let task: Option<&Task> = batch.suite.tasks.iter().find(|task| task.id == one.task);
    let task = task.ok_or_else(|| CliError::internal("a task that is none of the suite"))?;
    let opened = batch.open(&batch.request(task, one.attempt))?;
    start.places = import::match_objects(&opened.scene, task.goal.object(), objects);
    if target_asset(&opened.scene, task).is_some_and(|asset| matches!(asset.body, Body::Rigid { .. })) {
        demo.close_fully_on_rigid_object();
    }
    Ok((start, demo))
}
