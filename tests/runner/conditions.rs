//! Conditions: each suite as it is and under each condition, compared episode by episode.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::json;
use softvt::report::{condition_table, styled_text::TerminalFormat};

use crate::support::{
    Project, Run,
    fixtures::{CONDITIONS, conditions_project},
};

/// The run of the conditions of a project into the folder `run`.
fn trial(project: &Project) -> Run<'_> {
    project.run("suites/trial.lua").policy("noop").out("run")
}

#[test]
fn each_condition_is_a_run_of_the_same_episodes() {
    let project = conditions_project(CONDITIONS, "deformable");
    let tables = trial(&project).conditions().expect("valid");
    let table = condition_table::table(&tables[0], TerminalFormat::PLAIN.with_details());
    let rows: Vec<&str> = table.lines().collect();
    let starts: Vec<&str> = rows.iter().map(|row| row.split("  ").next().unwrap_or_default()).collect();
    assert_eq!(starts[1..7], ["condition", "reference", "heavy x2", "same", "hard", "weak"], "{table}");
    assert!(table.lines().all(|line| line.chars().count() < 80), "{table}");
    let (_, against) = table.split_once("Δ: change from the reference").expect("details");
    assert!(against.contains("95 % interval") && against.contains("\nheavy x2"), "{table}");
    project.run("suites/one.lua").policy("noop").shift("mass", 2.0).out("alone").finish();
    assert_eq!(project.text("run/heavy_x2/episodes.jsonl"), project.text("alone/episodes.jsonl"));
    let settings = |path: &str| project.json(path)["settings"]["robot"]["gripper"]["effort"].clone();
    assert_eq!(settings("run/weak/run.json"), 3.0);
    assert_ne!(settings("run/reference/run.json"), 3.0);
}

#[test]
fn the_comparison_is_written_and_light_alone_changes_no_result() {
    let project = conditions_project(CONDITIONS, "deformable");
    let tables = trial(&project).conditions().expect("valid");
    let document = project.json("run/conditions.json");
    assert_eq!((&document["suites"], &document["policy"]), (&json!(tables), &"noop".into()));
    assert_eq!(tables[0].suite, "one");
    let rows = &tables[0].rows;
    let names: Vec<&str> = rows.iter().map(|row| row.condition.as_str()).collect();
    assert_eq!(names, ["reference", "heavy x2", "same", "hard", "weak"]);
    assert!(rows[0].outcome.as_ref().is_some_and(|outcome| outcome.paired.is_none()));
    let same = rows[2].outcome.as_ref().expect("it was run");
    let goal = &same.paired.as_ref().expect("compared").goal;
    assert_eq!((goal.better, goal.worse, goal.same), (0, 0, 2));
    assert_eq!(goal.difference, Some(0.0));
    assert!(goal.interval95.is_some());
    assert_eq!(project.text("run/same/episodes.jsonl"), project.text("run/reference/episodes.jsonl"));
    assert_ne!(project.text("run/heavy_x2/episodes.jsonl"), project.text("run/reference/episodes.jsonl"));
}

#[test]
fn conditions_without_effect_are_reported_and_not_run() {
    let project = conditions_project(CONDITIONS, "rigid");
    let tables = trial(&project).conditions().expect("valid");
    let hard = &tables[0].rows[3];
    assert!(hard.outcome.is_none());
    assert_eq!(hard.not_applicable.as_deref(), Some("it applies to suites of deformable objects only"));
    let table = condition_table::table(&tables[0], TerminalFormat::PLAIN.with_details());
    let row = table.lines().find(|line| line.starts_with("hard  ")).expect("a row");
    assert!(row.split_whitespace().skip(1).all(|cell| cell == "N/A"), "{row}");
    assert!(table.contains("hard: N/A, it applies to suites of deformable objects only"), "{table}");
    assert!(!project.path("run/hard").exists() && project.path("run/weak/summary.json").exists());
    let twin = conditions_project(CONDITIONS, "deformable");
    trial(&twin).twin().conditions().expect("valid");
    assert!(!twin.path("run/hard").exists());
}

#[test]
fn invalid_conditions_are_reported_before_anything_runs() {
    let refused = |conditions: &str| {
        let project = conditions_project(conditions, "deformable");
        let message = project.message(trial(&project).conditions());
        assert!(!project.path("run").exists(), "{message}");
        message
    };
    for (conditions, expected) in [
        ("", "suites/trial.lua:1: conditions.conditions: expected at least 1, got 0"),
        (
            "{ name = \"a\", shift = { mas = 2 } }",
            "suites/trial.lua: shifts: unknown shift \"mas\"; did you mean \"mass\"? (suite one, condition \"a\")",
        ),
        (
            "{ name = \"a\", set = { [\"robot.gripper.efort\"] = 2 } }",
            "suites/trial.lua:1: condition \"a\": set: no setting \"robot.gripper.efort\"",
        ),
        ("{ name = \"a\", shift = { mass = -1 } }", "shift mass: expected a number in 0.01..100"),
        ("{ name = \"a\" },\n{ name = \"a\" }", "conditions[2]: \"a\" is there already; give each once"),
        ("{ name = \"reference\" }", "\"reference\" is the name of the run without changes; give another"),
        (
            "{ name = \"a b\", shift = { mass = 2 } },\n{ name = \"a_b\", shift = { mass = 3 } }",
            "share the folder a_b; rename one",
        ),
        (
            "{ name = \"a\" }",
            "the condition \"a\" sets what the suite has without it; leave it out, or give other values",
        ),
        (
            "{ name = \"a\", shift = { mass = 1 }, set = { [\"robot.latency\"] = 0 } }",
            "the condition \"a\" sets what the suite has without it; leave it out, or give other values",
        ),
        ("{ name = \"a\", policy = \"noop\" }", "the condition \"a\" sets what the suite has without it"),
        ("{ name = \"a\", mass = 2 }", "unknown key \"mass\""),
    ] {
        let message = refused(conditions);
        assert!(message.contains(expected), "{message}");
    }
    let project = conditions_project(CONDITIONS, "deformable");
    project.write("run/weak/summary.json", b"{}");
    let message = project.message(trial(&project).conditions());
    assert!(message.contains("run/weak already holds a run"), "{message}");
    assert!(!project.path("run/reference").exists());
}

/// The shipped files that return conditions, by their paths in the repository.
fn shipped() -> Vec<String> {
    fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            match path.is_dir() {
                true => collect(&path, found),
                false => found.push(path),
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    ["suites", "scripts"].iter().for_each(|folder| collect(&root.join(folder), &mut files));
    let has_conditions = |path: &PathBuf| {
        path.extension().is_some_and(|extension| extension == "lua")
            && fs::read_to_string(path).is_ok_and(|text| text.contains("softvt.conditions {"))
    };
    let relative = |path: &PathBuf| path.strip_prefix(root).expect("below").display().to_string();
    files.iter().filter(|path| has_conditions(path)).map(relative).collect()
}

#[test]
fn every_shipped_list_of_conditions_can_be_checked() {
    let files = shipped();
    assert!(files.len() >= 2 && files.contains(&"suites/shifts.lua".to_owned()), "{files:?}");
    let project = Project::new(&[]);
    for file in files {
        // The names of all lists that the file knows.
        let declared = project.run(&file).load().expect("valid").script.options;
        let lists = declared.iter().find(|option| option.name == "conditions");
        let option = lists.map_or(String::new(), |lists| format!("--conditions={}", lists.choices.join(",")));
        assert!(file != "suites/shifts.lua" || option.contains("perturbations"), "{option}");
        let checked = project.run(&file).options(&option).check();
        checked.unwrap_or_else(|message| panic!("{file} {option}\n{message}"));
    }
    // The option of suites/shifts.lua names all lists of scripts/shifts.lua.
    project.write(
        "all.lua",
        b"for key, list in pairs(require 'shifts') do
  local is_list = #list > 0 and not rawget(list[1], 'apply')
  assert(not is_list or key == 'conditions' or key == 'all_objects' or key == 'perturbations', key)
end
return softvt.experiment { name = 'all', grid = { a = { 1 } }, run = function() return {} end }",
    );
    project.run("all.lua").check().expect("no other list");
}

#[test]
fn whole_numbers_of_settings_are_named_by_their_field() {
    let project =
        conditions_project("{ name = \"late\", set = { [\"robot.latency\"] = 4 / 2 } }", "deformable");
    project.run("suites/trial.lua").check().expect("valid");
    let trial = project.text("suites/trial.lua");
    let refused = |value: &str| {
        project.write("suites/trial.lua", trial.replace("4 / 2", value).as_bytes());
        project.message(project.run("suites/trial.lua").check())
    };
    assert_eq!(
        refused("2.5"),
        "suites/trial.lua:1: condition \"late\": set: robot.latency: expected a whole number of control steps, got \"2.5\""
    );
    let suite = project.text("suites/one.lua");
    let settings = |value: &str| {
        let declared = format!("settings = {{ robot = {{ latency = {value} }} }}, episodes = 2,");
        project.write("suites/one.lua", suite.replacen("episodes = 2,", &declared, 1).as_bytes());
    };
    settings("6 / 3");
    project.run("suites/one.lua").check().expect("valid");
    settings("2.5");
    let message = project.message(project.run("suites/one.lua").check());
    assert!(
        message
            .contains("suite.settings.robot.latency: expected a whole number of control steps, got \"2.5\""),
        "{message}"
    );
}
