//! Suites, tasks, assets, policies, profiles and settings of the working folder and of the library of the binary, one
//! JSON object each.

use std::{collections::BTreeSet, convert::Infallible, path::Path};

use serde_json::{Value, json};

use crate::{config::thread_count, error::RunError, policy::BuiltinPolicy};
use softvt_benchmark::{Plan, Task, settings::Settings};
use softvt_common::{parallel, settings::Setting};
use softvt_policy::profile::PROFILES;
use softvt_script::{LoadedScript, ScriptError};

/// Rows of all files that can be loaded, and why the others cannot.
pub struct Listing {
    /// JSON objects, in the order of their files.
    pub rows: Vec<Value>,
    /// One error per file that cannot be loaded.
    pub errors: Vec<RunError>,
}

impl From<Vec<Value>> for Listing {
    fn from(rows: Vec<Value>) -> Self {
        Self { rows, errors: Vec::new() }
    }
}

/// Suites, with the numbers of their tasks and episodes.
pub fn suites() -> Listing {
    list_plans(|path, plan| suite_row(path, plan).into_iter().collect())
}

/// Tasks of suites, with their prompts.
pub fn tasks() -> Listing {
    list_plans(task_rows)
}

/// Assets, with their files.
pub fn assets() -> Vec<Value> {
    scripts("assets").iter().map(|path| json!({ "name": stem(path), "file": path })).collect()
}

/// Policies: built-in ones, and Lua files.
pub fn policies() -> Vec<Value> {
    let built_in = BuiltinPolicy::all().map(|policy| (policy.name().to_owned(), policy.about()));
    named(built_in, "scripts/policies")
}

/// Profiles: built-in ones, and Lua files.
pub fn profiles() -> Vec<Value> {
    let built_in = PROFILES.iter().map(|(name, about)| ((*name).to_owned(), (*about).to_owned()));
    named(built_in, "scripts/profiles")
}

/// Settings, with their defaults and values.
pub fn settings() -> Vec<Value> {
    let row = |setting: &Setting| {
        let Setting { path, values, about, .. } = setting;
        json!({ "name": path, "default": setting.default_text(), "values": values, "about": first_of(about) })
    };
    Settings::list().iter().map(row).collect()
}

/// Built-in entries, and Lua files, which are named by their paths.
fn named(built_in: impl Iterator<Item = (String, String)>, folder: &str) -> Vec<Value> {
    let files = scripts(folder).into_iter().map(|path| (path.clone(), first_sentence(&path)));
    built_in.chain(files).map(|(name, about)| json!({ "name": name, "about": about })).collect()
}

/// The first sentence of the comment at the top of a Lua file; empty without a comment.
fn first_sentence(path: &str) -> String {
    let text = std::fs::read_to_string(path).ok();
    let text =
        text.or_else(|| String::from_utf8(softvt_script::embedded(path)?.to_vec()).ok()).unwrap_or_default();
    let comment = text.lines().map_while(|line| line.strip_prefix("--")).map(str::trim);
    let comment: Vec<&str> = comment.take_while(|line| !line.is_empty()).collect();
    first_of(&comment.join(" ")).to_owned()
}

fn first_of(text: &str) -> &str {
    text.split_once(". ").map_or(text, |(first, _)| first).trim_end_matches('.')
}

/// A suite, or a file of several suites with their names.
fn suite_row(path: &str, plan: &Plan) -> Option<Value> {
    let suites = plan.suites();
    let tasks: usize = suites.iter().map(|suite| suite.tasks.len()).sum();
    let names: Vec<&str> = suites.iter().map(|suite| suite.name.as_str()).collect();
    let episodes = suites.first()?.episodes;
    let name = match plan {
        Plan::Suite(suite) => suite.name.clone(),
        Plan::Conditions { name, .. } => name.clone(),
        Plan::Suites { .. } | Plan::Experiment { .. } => stem(path),
    };
    let needs = if let Plan::Suite(suite) = plan { suite.needs } else { None };
    let mut row = json!({ "name": name, "file": path, "tasks": tasks, "episodes": episodes, "needs": needs });
    if !matches!(plan, Plan::Suite(_)) {
        row["suites"] = json!(names);
    }
    if let Plan::Conditions { conditions, .. } = plan {
        // The reference counts too.
        row["conditions"] = json!(conditions.len() + 1);
    }
    Some(row)
}

/// The tasks of a suite. A file of several suites has none of its own.
fn task_rows(path: &str, plan: &Plan) -> Vec<Value> {
    let Plan::Suite(suite) = plan else { return Vec::new() };
    let row = |task: &Task| {
        json!({
            "suite": suite.name,
            "task": task.id,
            "file": path,
            "layout": task.layout,
            "prompt": task.prompt,
        })
    };
    suite.tasks.iter().map(row).collect()
}

fn stem(path: &str) -> String {
    Path::new(path).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Lua files directly in a folder, on disk and embedded, in alphabetical order.
fn scripts(folder: &str) -> BTreeSet<String> {
    let mut found: BTreeSet<String> = softvt_script::embedded_scripts(folder).into_iter().collect();
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let paths = entries.map(|entry| format!("{folder}/{}", entry.file_name().to_string_lossy()));
    found.extend(paths.filter(|path| path.ends_with(".lua")));
    found
}

fn list_plans(rows_of: impl Fn(&str, &Plan) -> Vec<Value>) -> Listing {
    let paths: Vec<String> = scripts("suites").into_iter().collect();
    let mut listing = Listing::from(Vec::new());
    let load = |file: usize| Ok(softvt_script::load(Path::new(&paths[file]), &[]));
    let add = |file: usize, loaded: Result<LoadedScript, ScriptError>| {
        match loaded {
            Ok(loaded) => listing.rows.extend(rows_of(&paths[file], &loaded.plan)),
            Err(error) => listing.errors.push(error.into()),
        }
        Ok::<_, Infallible>(())
    };
    let Ok(()) = parallel::run_in_order(paths.len(), thread_count(None), || false, load, add);
    listing
}
