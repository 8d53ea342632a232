//! Conditions: each suite as it is and under each condition, compared episode by episode.

use std::path::Path;

use serde_json::json;

use crate::support::{
    Project, Run, assert_contains, files,
    fixtures::{CONDITIONS, conditions_project},
};

/// The run of the conditions of a project into the folder `run`.
fn trial(project: &Project) -> Run<'_> {
    project.run("suites/trial.lua").policy("noop").out("run")
}

#[test]
fn each_condition_is_a_run_of_the_same_episodes_and_light_alone_changes_no_result() {
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
    project.run("suites/one.lua").policy("noop").shift("mass", 2.0).out("alone").finish();
    assert_eq!(project.text("run/heavy_x2/episodes.jsonl"), project.text("alone/episodes.jsonl"));
    let settings = |path: &str| project.json(path)["settings"]["robot"]["gripper"]["effort"].clone();
    assert_eq!(settings("run/weak/run.json"), 3.0);
    assert_ne!(settings("run/reference/run.json"), 3.0);
}

#[test]
fn a_folder_of_another_run_is_refused_before_anything_runs() {
    let project = conditions_project(CONDITIONS, "deformable");
    project.write("run/weak/summary.json", b"{}");
    assert_contains(project.message(trial(&project).conditions()), "run/weak already holds a run");
    assert!(!project.path("run/reference").exists());
}

/// The shipped files that return conditions, by their paths in the repository.
fn shipped() -> Vec<String> {
    let in_folder = |folder: &'static str| {
        let found = files(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)).into_iter();
        let has_conditions =
            |(_, bytes): &(String, Vec<u8>)| String::from_utf8_lossy(bytes).contains("softvt.conditions {");
        found.filter(has_conditions).map(move |(path, _)| format!("{folder}/{path}"))
    };
    ["suites", "scripts"].into_iter().flat_map(in_folder).filter(|path| path.ends_with(".lua")).collect()
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
        let checked = project.run(&file).options(&option).check_conditions();
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
    project.run("all.lua").load().expect("no other list");
}
