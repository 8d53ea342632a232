//! `softvt list`: what there is, in the working folder and in the binary.

use std::{collections::BTreeSet, path::Path};

use serde_json::{Value, json};

use crate::{
    benchmark::Plan,
    cli::{args::policy::POLICIES, error::CliError, output::print},
    policy::profile::PROFILES,
    script,
};

/// Lists suites, tasks, assets, policies or profiles.
///
/// # Errors
/// A suite in the working folder cannot be loaded.
pub(crate) fn run(what: &str, as_json: bool) -> Result<(), CliError> {
    let rows = match what {
        "policies" => named(&POLICIES, "scripts/policies"),
        "profiles" => named(&PROFILES, "scripts/profiles"),
        "assets" => {
            scripts("assets").iter().map(|path| json!({ "name": stem(path), "file": path })).collect()
        }
        "suites" => plans()?.iter().filter_map(|(path, plan)| row(path, plan)).collect(),
        _ => plans()?.iter().flat_map(|(path, plan)| tasks(path, plan)).collect::<Vec<_>>(),
    };
    if as_json {
        print(&format!("{:#}\n", Value::Array(rows)));
        return Ok(());
    }
    for row in &rows {
        let cells = row.as_object().map(|o| o.values().map(text).collect::<Vec<_>>()).unwrap_or_default();
        print(&format!("{}\n", cells.join("  ")));
    }
    Ok(())
}

/// What is known by a name, and what is in Lua, which is named by its file.
fn named(list: &[(&str, &str)], tree: &str) -> Vec<Value> {
    let own = list.iter().map(|(name, about)| json!({ "name": name, "about": about }));
    let files = scripts(tree).into_iter();
    own.chain(files.map(|path| json!({ "name": path, "about": first_comment(&path) }))).collect()
}

/// The first sentence of a Lua file, if it begins with one.
fn first_comment(path: &str) -> String {
    let text = std::fs::read_to_string(path).ok();
    let text = text.or_else(|| String::from_utf8(script::embedded(path)?.to_vec()).ok()).unwrap_or_default();
    let lines = text.lines().map_while(|line| line.strip_prefix("--"));
    let words: Vec<&str> = lines.map(str::trim).take_while(|line| !line.is_empty()).collect();
    let words = words.join(" ");
    words
        .split_once(". ")
        .map_or(words.clone(), |(first, _)| first.to_owned())
        .trim_end_matches('.')
        .to_owned()
}

fn text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// A suite, or a file of several; `suites` names those.
fn row(path: &str, plan: &Plan) -> Option<Value> {
    let suites = plan.suites();
    let tasks: usize = suites.iter().map(|suite| suite.tasks.len()).sum();
    let names: Vec<&str> = suites.iter().map(|suite| suite.name.as_str()).collect();
    let episodes = suites.first()?.episodes;
    let name = match plan {
        Plan::Suite(suite) => suite.name.clone(),
        Plan::Conditions { name, .. } => name.clone(),
        Plan::Suites { .. } | Plan::Experiment { .. } => stem(path),
    };
    let mut row = json!({ "name": name, "file": path, "tasks": tasks, "episodes": episodes });
    if !matches!(plan, Plan::Suite(_)) {
        row["suites"] = json!(names);
    }
    if let Plan::Conditions { conditions, .. } = plan {
        row["conditions"] = json!(conditions.len() + 1);
    }
    Some(row)
}

/// The tasks of a suite; those of a file of several are its suites'.
fn tasks(path: &str, plan: &Plan) -> Vec<Value> {
    let Plan::Suite(suite) = plan else { return Vec::new() };
    let row = |task: &crate::benchmark::Task| json!({ "suite": suite.name, "task": task.id, "file": path, "layout": task.layout, "prompt": task.prompt });
    suite.tasks.iter().map(row).collect()
}

fn stem(path: &str) -> String {
    Path::new(path).file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Lua files directly under `tree`, on disk and embedded, by name.
fn scripts(tree: &str) -> BTreeSet<String> {
    let mut found: BTreeSet<String> = script::embedded_scripts(tree).into_iter().collect();
    let entries = std::fs::read_dir(tree).into_iter().flatten().flatten();
    found.extend(
        entries
            .map(|entry| format!("{tree}/{}", entry.file_name().to_string_lossy()))
            .filter(|path| path.ends_with(".lua")),
    );
    found
}

fn plans() -> Result<Vec<(String, Plan)>, CliError> {
    let load = |path: String| {
        let loaded = script::load(Path::new(&path), &[]).map_err(CliError::input)?;
        Ok((path, loaded.plan))
    };
    scripts("suites").into_iter().map(load).collect()
}
