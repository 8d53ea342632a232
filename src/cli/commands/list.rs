//! `softvt list`: suites, tasks, assets, policies and profiles, in the working folder and in the binary, and settings.

use std::{collections::BTreeSet, path::Path};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use crate::{
    error::CliError,
    output::{print, print_json},
};
use softvt_benchmark::{Plan, Task, settings::Settings};
use softvt_common::{settings::Setting, text::TextTable};
use softvt_policy::profile::PROFILES;
use softvt_runner::BuiltinPolicy;

/// List suites, tasks, assets, policies, profiles or settings
#[derive(Args, Debug)]
pub(crate) struct ListArgs {
    /// Kind of items to list
    #[arg(value_name = "suites|tasks|assets|policies|profiles|settings")]
    what: ListKind,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ListKind {
    Suites,
    Tasks,
    Assets,
    Policies,
    Profiles,
    Settings,
}

/// Lists what the arguments ask for.
///
/// # Errors
/// A suite in the working folder cannot be loaded.
pub(super) fn run(args: &ListArgs) -> Result<(), CliError> {
    let rows = match args.what {
        ListKind::Policies => {
            let built_in = BuiltinPolicy::ALL
                .into_iter()
                .map(|policy| (policy.name().to_owned(), policy.about().to_owned()));
            named(built_in, "scripts/policies")
        }
        ListKind::Profiles => {
            let built_in = PROFILES.iter().map(|(name, about)| ((*name).to_owned(), (*about).to_owned()));
            named(built_in, "scripts/profiles")
        }
        ListKind::Settings => Settings::list().iter().map(setting_row).collect(),
        ListKind::Assets => {
            scripts("assets").iter().map(|path| json!({ "name": stem(path), "file": path })).collect()
        }
        ListKind::Suites => plans()?.iter().filter_map(|(path, plan)| suite_row(path, plan)).collect(),
        ListKind::Tasks => plans()?.iter().flat_map(|(path, plan)| task_rows(path, plan)).collect::<Vec<_>>(),
    };
    if args.json { print_json(&rows) } else { print(&table(&rows)) }
}

/// Formats rows as a table with the keys of all rows as headings. Numbers are right-aligned.
fn table(rows: &[Value]) -> String {
    let mut headings: Vec<&str> = Vec::new();
    for key in rows.iter().filter_map(Value::as_object).flat_map(|row| row.keys()) {
        if !headings.contains(&key.as_str()) {
            headings.push(key);
        }
    }
    let cell = |row: &Value, key: &str| match &row[key] {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        Value::Array(items) => {
            items.iter().map(|item| item.as_str().unwrap_or_default()).collect::<Vec<_>>().join(", ")
        }
        other => other.to_string(),
    };
    let heading = headings.iter().map(ToString::to_string).collect();
    let cells = rows.iter().map(|row| headings.iter().map(|key| cell(row, key)).collect());
    let lines: Vec<Vec<String>> = std::iter::once(heading).chain(cells).collect();
    TextTable::fitted(&lines, |column| {
        rows.iter().all(|row| row[headings[column]].is_number() || row[headings[column]].is_null())
    })
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

fn setting_row(setting: &Setting) -> Value {
    let Setting { path, values, about, .. } = setting;
    json!({ "name": path, "default": setting.default_text(), "values": values, "about": first_of(about) })
}

/// The first sentence of a text.
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

fn plans() -> Result<Vec<(String, Plan)>, CliError> {
    let load = |path: String| {
        let loaded = softvt_script::load(Path::new(&path), &[])?;
        Ok((path, loaded.plan))
    };
    scripts("suites").into_iter().map(load).collect()
}
