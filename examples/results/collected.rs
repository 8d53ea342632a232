//! Summaries of runs that are kept in `docs/results/`, one file per script.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::{Map, Value, json};

/// Folder of the summaries.
const FOLDER: &str = "docs/results";

/// The results of a script: of each controller in each suite.
#[derive(Debug)]
pub struct Results {
    /// The script, such as `suites/all.lua`.
    pub script: String,
    /// True if the script runs all controllers, as conditions; otherwise each has a run of its own.
    pub has_conditions: bool,
    /// Suites in the order of the script, as objects with `name` and `controllers`: objects with `name` and the fields
    /// of [`cell`].
    pub suites: Vec<Value>,
}

/// Words about the controllers by name, which the tables show: `docs/results/labels.json`.
const LABELS: &str = "labels.json";

/// Reads all summaries: those of varied suites, then the standard suites.
pub fn read(root: &Path) -> Result<Vec<Results>, String> {
    let folder = root.join(FOLDER);
    let mut all = Vec::new();
    let entries = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for path in entries.filter_map(Result::ok).map(|entry| entry.path()) {
        if path.extension().is_some_and(|end| end == "json") && !path.ends_with(LABELS) {
            let value = json_of(&path)?;
            let script = text(&value, "script", &path)?;
            let suites = value["suites"].as_array().cloned().unwrap_or_default();
            let has_conditions = value["has_conditions"] == true;
            all.push(Results { script, has_conditions, suites });
        }
    }
    all.sort_by_key(|results| (results.script.ends_with("all.lua"), results.script.clone()));
    Ok(all)
}

/// The words about the controllers.
pub fn labels(root: &Path) -> Result<Value, String> {
    json_of(&root.join(FOLDER).join(LABELS))
}

/// The final state of the golden episode, which stands for the physics of this version: `softvt doctor` computes it.
pub fn physics(root: &Path) -> Result<String, String> {
    let path = root.join("assets/golden.json");
    text(&json_of(&path)?, "state_hash", &path)
}

/// The published rates, as `softvt bench --out` writes them.
pub fn rates(root: &Path) -> Result<Value, String> {
    json_of(&root.join("assets/rates.json"))
}

/// Adds the runs of a folder, made with the physics of this version, to the summaries of its script.
///
/// # Errors
/// If the folder has no finished run, or a file cannot be read or written.
pub fn add(root: &Path, folder: &Path) -> Result<(), String> {
    let (runs, physics) = (runs(folder)?, physics(root)?);
    if runs.is_empty() {
        return Err(format!(
            "{}: no finished run: neither conditions.json nor summary.json",
            folder.display()
        ));
    }
    for run in runs {
        let manifest = json_of(&run.folder.join("run.json"))?;
        let script = text(&manifest, "script", &run.folder)?;
        let stem = Path::new(&script).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let path = root.join(FOLDER).join(format!("{stem}.json"));
        let mut file = if path.is_file() { json_of(&path)? } else { json!({}) };
        file["script"] = script.into();
        file["has_conditions"] = run.is_condition.into();
        if file["suites"].is_null() {
            file["suites"] = json!([]);
        }
        let summary = json_of(&run.folder.join("summary.json"))?;
        let suite = text(&summary, "suite", &run.folder)?;
        let name = run.name.map_or_else(|| text(&summary, "policy", &run.folder), Ok)?;
        let suites = file["suites"].as_array_mut().ok_or_else(|| format!("{}: no suites", path.display()))?;
        let at = named(suites, &suite);
        if at["controllers"].is_null() {
            at["controllers"] = json!([]);
        }
        let controllers =
            at["controllers"].as_array_mut().ok_or_else(|| format!("{}: no controllers", path.display()))?;
        *named(controllers, &name) = cell(&name, &summary, &manifest, &run.folder, &physics)?;
        let text = serde_json::to_string_pretty(&file).map_err(|error| error.to_string())?;
        fs::create_dir_all(root.join(FOLDER)).map_err(|error| error.to_string())?;
        fs::write(&path, text + "\n").map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(())
}

/// A run, with the name of its controller if its condition states one.
struct Run {
    folder: PathBuf,
    name: Option<String>,
    is_condition: bool,
}

/// The finished runs of a folder: those of conditions, in their order, or those in it and one folder below.
fn runs(folder: &Path) -> Result<Vec<Run>, String> {
    let conditions = folder.join("conditions.json");
    if !conditions.is_file() {
        let mut found: Vec<PathBuf> = vec![folder.to_owned()];
        found.extend(
            fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok).map(|entry| entry.path()),
        );
        found.retain(|path| path.join("summary.json").is_file() && path.join("run.json").is_file());
        found.sort();
        return Ok(found.into_iter().map(|folder| Run { folder, name: None, is_condition: false }).collect());
    }
    let file = json_of(&conditions)?;
    let rows = file["suites"]
        .as_array()
        .into_iter()
        .flatten()
        .flat_map(|suite| suite["rows"].as_array().into_iter().flatten());
    let run = |row: &Value| {
        let inside = row["outcome"]["folder"].as_str()?;
        // The reference is the policy of the command.
        let name = row["condition"].as_str().filter(|_| row["policy"].is_string()).map(str::to_owned);
        Some(Run { folder: folder.join(inside), name, is_condition: true })
    };
    Ok(rows.filter_map(run).collect())
}

/// The object of this name in a list, which is added if it is not there.
fn named<'a>(list: &'a mut Vec<Value>, name: &str) -> &'a mut Value {
    let index = list.iter().position(|one| one["name"] == name).unwrap_or_else(|| {
        list.push(json!({ "name": name }));
        list.len() - 1
    });
    &mut list[index]
}

/// The numbers of a run that are kept.
fn cell(
    name: &str,
    summary: &Value,
    manifest: &Value,
    folder: &Path,
    physics: &str,
) -> Result<Value, String> {
    let path = folder.join("episodes.jsonl");
    let lines = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let records: Vec<Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).map_err(|error| format!("{}: {error}", path.display())))
        .collect::<Result<_, _>>()?;
    let ratio = |record: &Value| Some(record["d_peak"].as_f64()? / record["tau"].as_f64()?);
    let field = |key: &'static str| move |record: &Value| record[key].as_f64();
    let mut cell = Map::new();
    cell.insert("name".into(), name.into());
    cell.insert("privileged".into(), summary["privileged"].clone());
    for key in ["episodes", "invalid"] {
        cell.insert(key.into(), summary[key].clone());
    }
    cell.insert("tasks".into(), summary["by_task"].as_array().map_or(0, Vec::len).into());
    for key in ["goal_success_rate", "no_drop_rate", "safety_success_rate"] {
        let (rate, interval) = (&summary[key]["rate"], &summary[key]["wilson95"]);
        cell.insert(key.into(), json!({ "rate": rounded(rate), "wilson95": interval.as_array().map(|ends| ends.iter().map(rounded).collect::<Vec<_>>()) }));
    }
    cell.insert("d_over_tau_median".into(), median(&records, ratio));
    cell.insert("grip_ratio_median".into(), median(&records, field("grip_ratio")));
    cell.insert("goal_time_s_median".into(), median(&records, field("goal_time_s")));
    for key in ["softvt", "seed"] {
        cell.insert(key.into(), manifest[key].clone());
    }
    cell.insert("physics".into(), physics.into());
    Ok(cell.into())
}

/// A number to four digits, which is enough for the tables; null stays null.
fn rounded(value: &Value) -> Value {
    value.as_f64().map_or(Value::Null, |value| ((1e4 * value).round() / 1e4).into())
}

/// Median of a quantity over the records that have it, or null.
fn median(records: &[Value], value: impl Fn(&Value) -> Option<f64>) -> Value {
    let mut found: Vec<f64> = records.iter().filter_map(value).filter(|value| value.is_finite()).collect();
    found.sort_by(f64::total_cmp);
    let middle = found.len() / 2;
    match found.len() {
        0 => Value::Null,
        n if n % 2 == 1 => rounded(&found[middle].into()),
        _ => rounded(&(0.5 * (found[middle - 1] + found[middle])).into()),
    }
}

fn json_of(path: &Path) -> Result<Value, String> {
    let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))
}

fn text(value: &Value, key: &str, at: &Path) -> Result<String, String> {
    value[key].as_str().map(str::to_owned).ok_or_else(|| format!("{}: no {key}", at.display()))
}
