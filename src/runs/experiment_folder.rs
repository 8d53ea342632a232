//! The folder of an experiment: `run.json`, and `points.jsonl` with the parameters and the rows of each finished point,
//! from which an interrupted experiment continues; at the end `rows.jsonl` and `rows.csv`, and the files of the script.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::{
    manifest::ExperimentManifest,
    run_folder::{RUN, RunFolder, RunFolderError, of_folder},
};
use softvt_common::{
    files::{self, json_lines, replace},
    journal::{Journal, whole_lines},
    text::csv_field,
};

/// The finished points, one JSON object per line.
const POINTS: &str = "points.jsonl";
/// The rows of all points, one JSON object per line.
pub const ROWS: &str = "rows.jsonl";
/// The same as a table, with the parameters of the points.
const TABLE: &str = "rows.csv";

/// Files that softvt writes: the script cannot.
pub const RESERVED: [&str; 4] = [RUN, POINTS, ROWS, TABLE];

/// A row of results, with sorted keys; or the fields of a point that are data.
pub type ExperimentRow = Map<String, Value>;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FinishedPoint {
    pub point: usize,
    /// Its fields that are data.
    pub parameters: ExperimentRow,
    pub rows: Vec<ExperimentRow>,
}

pub struct ExperimentFolder {
    dir: PathBuf,
    points: Journal,
}

impl ExperimentFolder {
    /// Creates the folder, or with `resume` opens that of the same experiment, and returns its
    /// finished points by number.
    ///
    /// # Errors
    /// It holds another experiment or something else, another process uses it, a line is not a point,
    /// or the system refuses.
    pub fn open(
        dir: &Path,
        manifest: &ExperimentManifest,
        resume: bool,
    ) -> Result<(Self, BTreeMap<usize, FinishedPoint>), RunFolderError> {
        let path = dir.join(POINTS);
        if !(resume && path.exists()) {
            RunFolder::check_new(dir)?;
            files::create_folder(dir)?;
            let points = Journal::create(&path).map_err(of_folder(dir, POINTS))?;
            manifest.write_or_compare(dir)?;
            return Ok((Self { dir: dir.into(), points }, BTreeMap::new()));
        }
        let (mut points, bytes) = Journal::resume(&path).map_err(of_folder(dir, POINTS))?;
        manifest.write_or_compare(dir)?;
        let finished = whole_lines(&bytes).map(|(line, text)| {
            let point: FinishedPoint = serde_json::from_slice(text).map_err(|error| {
                RunFolderError::in_line(&path, line, format_args!("not a point: {error}"))
            })?;
            Ok((point.point, point))
        });
        let finished = finished.collect::<Result<_, RunFolderError>>()?;
        points.keep_whole_lines(&bytes)?;
        Ok((Self { dir: dir.into(), points }, finished))
    }

    pub fn add(&mut self, point: &FinishedPoint) -> Result<(), RunFolderError> {
        Ok(self.points.append(&json_lines(&self.dir.join(POINTS), [point])?)?)
    }

    /// Removes the files of an experiment without a finished point, and the folder if it is empty then.
    pub fn discard(self) -> Result<(), RunFolderError> {
        for name in [RUN, POINTS] {
            files::remove_if_present(&self.dir.join(name))?;
        }
        files::remove_empty_folders(&[self.dir]);
        Ok(())
    }

    /// Writes the rows of all points, in their order.
    pub fn write_rows(&mut self, points: &[FinishedPoint], columns: &[String]) -> Result<(), RunFolderError> {
        self.points.replace(&json_lines(&self.dir.join(POINTS), points)?)?;
        let rows = points.iter().flat_map(|point| &point.rows);
        files::write_json_lines(&self.dir.join(ROWS), rows)?;
        Ok(replace(&self.dir.join(TABLE), csv(points, columns))?)
    }
}

/// The rows as CSV: the parameters of the points, but those of which rows have a value of the same name, then the
/// columns, in the given order or sorted, and the others.
fn csv(points: &[FinishedPoint], columns: &[String]) -> String {
    let rows = || points.iter().flat_map(|point| &point.rows);
    let of_rows: BTreeSet<&String> = rows().flat_map(|row| row.keys()).collect();
    let parameters = points.iter().flat_map(|point| point.parameters.keys());
    let parameters: BTreeSet<&String> = parameters.filter(|name| !of_rows.contains(name)).collect();
    let mut named: Vec<&String> = Vec::new();
    for name in columns.iter().filter(|name| of_rows.contains(name)) {
        if !named.contains(&name) {
            named.push(name);
        }
    }
    let others = of_rows.iter().copied().filter(|name| !named.contains(name));
    let names: Vec<&String> = parameters.iter().copied().chain(named.iter().copied()).chain(others).collect();
    let line = |fields: Vec<String>| fields.join(",") + "\n";
    let mut text = line(names.iter().map(|name| csv_field(name)).collect());
    for point in points {
        for row in &point.rows {
            let value = |name: &&String| {
                if parameters.contains(*name) { point.parameters.get(*name) } else { row.get(*name) }
            };
            text += &line(names.iter().map(|name| field(value(name))).collect());
        }
    }
    text
}

/// A value as a field: text and numbers as they are, nothing for null, and lists and tables as JSON.
fn field(value: Option<&Value>) -> String {
    match value {
        None | Some(Value::Null) => String::new(),
        Some(Value::String(text)) => csv_field(text),
        Some(Value::Number(number)) => number.to_string(),
        Some(other) => csv_field(&other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn point(number: usize, parameters: Value, rows: Value) -> FinishedPoint {
        let point = json!({ "point": number, "parameters": parameters, "rows": rows });
        serde_json::from_value(point).expect("a point")
    }

    #[test]
    fn a_table_has_the_parameters_of_the_points_and_quotes_what_it_must() {
        let points = [
            point(0, json!({ "gap": 42, "kind": "a" }), json!([{ "d": 0.5, "kind": "a, b" }])),
            point(
                1,
                json!({ "gap": 48, "kind": "b" }),
                json!([{ "d": 1.5, "note": "5 \"mm\"" }, { "list": [1, 2] }]),
            ),
        ];
        let text = "gap,d,kind,list,note\n42,0.5,\"a, b\",,\n48,1.5,,,\"5 \"\"mm\"\"\"\n48,,,\"[1,2]\",\n";
        assert_eq!(csv(&points, &[]), text);
        let formula = [point(0, json!({}), json!([{ "=1": "=cmd|' /C calc'!A0", "change": -0.5 }]))];
        assert_eq!(csv(&formula, &[]), "'=1,change\n'=cmd|' /C calc'!A0,-0.5\n");
        let ordered = csv(&points, &["note".to_owned(), "absent".to_owned(), "d".to_owned()]);
        assert!(ordered.starts_with("gap,note,d,kind,list\n"), "{ordered}");
    }

    #[test]
    fn an_interrupted_experiment_keeps_its_points() {
        let dir = tempfile::tempdir().expect("a folder");
        let manifest: ExperimentManifest = serde_json::from_value(json!({
            "softvt": "0", "script": "e.lua", "experiment": "e", "points": 2, "seed": 0, "options": {}, "arguments": [],
            "set": [], "sources": {}, "folder": "/here",
        }))
        .expect("a manifest");
        let dir = dir.path().join("e");
        let second = point(1, json!({ "gap": 1 }), json!([{ "d": 2 }]));
        let (mut folder, _) = ExperimentFolder::open(&dir, &manifest, false).expect("created");
        folder.add(&second).expect("written");
        assert!(ExperimentFolder::open(&dir, &manifest, true).is_err(), "another process uses it");
        drop(folder);
        assert!(ExperimentFolder::open(&dir, &manifest, false).is_err());
        let other = ExperimentFolder::open(&dir, &ExperimentManifest { seed: 1, ..manifest.clone() }, true);
        assert!(other.err().expect("refused").to_string().contains("seed: 0 before, 1 now"));
        let path = dir.join(POINTS);
        let whole = std::fs::read(&path).expect("read");
        std::fs::write(&path, [&whole[..], b"{\"poi"].concat()).expect("written");
        let (mut folder, finished) = ExperimentFolder::open(&dir, &manifest, true).expect("resumed");
        assert_eq!(finished, BTreeMap::from([(1, second.clone())]));
        let first = point(0, json!({ "gap": 0 }), json!([]));
        folder.add(&first).expect("written");
        folder.write_rows(&[first, second], &[]).expect("written");
        let text = |name: &str| std::fs::read_to_string(dir.join(name)).expect("read");
        assert!(text(POINTS).starts_with("{\"point\":0,") && text(POINTS).lines().count() == 2);
        assert_eq!((text(ROWS).as_str(), text(TABLE).as_str()), ("{\"d\":2}\n", "gap,d\n1,2\n"));
    }
}
