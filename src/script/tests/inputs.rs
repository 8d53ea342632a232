//! The messages about invalid scripts, policies and profiles: `bad/`.

use std::path::Path;

#[path = "../../../tests/inputs/mod.rs"]
mod fixtures;

use self::fixtures::Input;
use super::{Project, episode_id, episodes::step, policies};
use crate::{EpisodeSetup, Experiment, ExpertGrip, LoadedScript, SceneChanges, ScriptError, load_profile};
use softvt_benchmark::{Plan, ShiftValue};
use softvt_common::text::counted;
use softvt_policy::{Policy, profile::GripCode};

/// Path of the file of an input in its project.
fn main(input: &Input) -> &str {
    input.properties.get("main").map_or("x.lua", String::as_str)
}

fn check(folder: &str, answer: impl Fn(&Project, &Input) -> Result<String, String>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad").join(folder);
    fixtures::check(&folder, |_, input| {
        let project =
            Project::new(&[("small.lua", include_str!("bad/small.lua")), (main(input), &input.text)]);
        input.files.iter().for_each(|(path, text)| project.write(path, text.as_bytes()));
        let answer = answer(&project, input).unwrap_or_else(|message| message);
        let folder = project.path("").display().to_string();
        let above = project.path("..").canonicalize().expect("a folder").display().to_string();
        answer
            .replace(&folder, "")
            .replace(folder.trim_end_matches('/'), "PROJECT")
            .replace(&format!("{above:?}"), "\"ABOVE\"")
    });
}

#[test]
fn scripts() {
    check_scripts("scripts");
}

#[test]
fn scripts_without_end() {
    check_scripts("endless");
}

fn check_scripts(folder: &str) {
    check(folder, |project, input| {
        let argv = input.properties.get("argv").map_or("", String::as_str);
        let loaded = project
            .load(main(input), &argv.split_whitespace().collect::<Vec<_>>())
            .map_err(|error| error.to_string())?;
        first_result(&loaded, input).map_err(|error| error.to_string())
    });
}

/// The rows of the first point of an experiment, or the number of commands in the first episode of a suite.
fn first_result(loaded: &LoadedScript, input: &Input) -> Result<String, ScriptError> {
    if let Plan::Experiment { .. } = loaded.plan {
        let rows = Experiment::open(loaded)?.run(0)?;
        return Ok(serde_json::to_string(&rows).expect("JSON"));
    }
    let shift = |text: &String| {
        let (name, value) = text.split_once('=').expect("NAME=VALUE");
        ShiftValue { name: name.into(), value: value.parse().expect("a number") }
    };
    let shifts = input.properties.get("shift").into_iter().map(shift).collect();
    let changes = SceneChanges { shifts, ..SceneChanges::default() };
    let setup = EpisodeSetup::open(loaded, &episode_id(0, 1), &changes)?;
    let objects = setup.scene.objects.len();
    let Some(mut expert) = setup.expert(ExpertGrip::Commanded) else {
        return Ok(format!("a scene of {objects} objects"));
    };
    let mut commands = 0;
    while commands < 1000 && step(&mut expert)?.is_some() {
        commands += 1;
    }
    Ok(format!("{} of an expert", counted(commands, "command")))
}

#[test]
fn policies() {
    check("policies", |project, input| {
        let file = policies::load(project, "x.lua").map_err(|error| error.to_string())?;
        let gripper = input.properties.get("gripper").and_then(|code| GripCode::named(code));
        let mut policy = file.start(&policies::seed(0), gripper).map_err(|error| error.to_string())?;
        let chunk = policy.act(&policies::observation()).map_err(|error| error.to_string())?;
        let shown =
            chunk.commands.iter().map(|command| format!("{:.3?}, {:.3?}", command.motion, command.grip));
        Ok(shown.collect::<Vec<_>>().join("\n"))
    });
}

#[test]
fn profiles() {
    check("profiles", |project, _| {
        load_profile(&project.path("x.lua"))
            .map(|profile| profile.name.to_string())
            .map_err(|error| error.to_string())
    });
}
