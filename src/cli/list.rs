//! `softvt list`: what there is, in the working folder and in the binary.

use std::{collections::BTreeSet, path::Path};

use serde_json::{Value, json};

use super::{Failure, drivers::POLICIES, print};
use crate::{
    benchmark::{Plan, Suite},
    script,
};

/// Lists suites, tasks, assets or policies.
///
/// # Errors
/// A suite in the working folder cannot be loaded.
pub fn run(what: &str, as_json: bool) -> Result<(), Failure> {
    let rows = match what {
        "policies" => POLICIES.iter().map(|(name, about)| json!({ "name": name, "about": about })).collect(),
        "assets" => {
            scripts("assets").iter().map(|path| json!({ "name": stem(path), "file": path })).collect()
        }
        "suites" => suites()?.iter().map(|(path, suite)| suite_row(path, suite)).collect(),
        _ => suites()?.iter().flat_map(|(path, suite)| tasks(path, suite)).collect::<Vec<_>>(),
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

fn text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn suite_row(path: &str, suite: &Suite) -> Value {
    json!({ "name": suite.name, "file": path, "tasks": suite.tasks.len(), "episodes": suite.episodes })
}

fn tasks(path: &str, suite: &Suite) -> Vec<Value> {
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

fn suites() -> Result<Vec<(String, Suite)>, Failure> {
    let mut all = Vec::new();
    for path in scripts("suites") {
        let loaded = script::load(Path::new(&path), &[]).map_err(Failure::input)?;
        match loaded.plan {
            Plan::Suite(suite) => all.push((path, *suite)),
            Plan::Suites { .. } | Plan::Experiment { .. } => {}
        }
    }
    Ok(all)
}
