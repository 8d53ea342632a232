//! Experiments: points in, rows out.

use std::sync::Arc;

use mlua::{Lua, LuaSerdeExt, Value};
use serde_json::{Map, Value as Json};

use crate::{
    api::{
        experiment_input::ExperimentInput,
        image::image_of,
        tasks::{ExperimentSpec, FinishSpec},
    },
    plan::{LoadedScript, Points, ScriptInstance, points},
    schema::{Constructed, LuaType, RecordType, validate},
    vm::{error::ScriptError, json::to_json, library::is_inside, value::describe},
};
use softvt_sensing::camera::encode_png;

pub use softvt_runs::experiment_folder::ExperimentRow;

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExperimentSummary {
    /// Printed after the rows.
    pub text: Option<String>,
    /// Files to write: relative path without `..`, and bytes.
    pub files: Vec<(String, Vec<u8>)>,
    /// Fault of the results; the files are valid.
    pub problem: Option<String>,
}

/// A virtual machine that runs points of an experiment. Variables that a point changes stay changed for later ones.
pub struct Experiment {
    instance: ScriptInstance,
    points: Points,
    input: Arc<ExperimentInput>,
}

impl Experiment {
    /// Runs the sources of `loaded` in a new virtual machine.
    ///
    /// # Errors
    /// If the script fails or does not return an experiment.
    pub fn open(loaded: &LoadedScript) -> Result<Self, ScriptError> {
        Self::open_with(loaded, &Arc::default())
    }

    /// As [`Experiment::open`], with simulations that take the settings and seed of `input`.
    pub fn open_with(loaded: &LoadedScript, input: &Arc<ExperimentInput>) -> Result<Self, ScriptError> {
        let input = Arc::clone(input);
        let instance = loaded.sources.instance_with(|lua| {
            lua.set_app_data(Arc::clone(&input));
        })?;
        let mut experiment = Self { instance, points: Points::Grid(Vec::new()), input };
        let vm = &experiment.instance.vm;
        let points = {
            let _deadline = vm.call_deadline();
            let spec = experiment.spec()?;
            points(&vm.lua, &spec).map_err(|e| vm.explain(&e))?
        };
        experiment.points = points;
        Ok(experiment)
    }

    pub fn len(&self) -> usize {
        self.points.len()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The parameters of a point: its fields that are data, such as numbers and texts.
    pub fn parameters(&self, index: usize) -> Map<String, Json> {
        let lua = &self.instance.vm.lua;
        let Ok(Value::Table(point)) = self.points.get(lua, index) else { return Map::new() };
        let mut parameters = Map::new();
        for (key, value) in point.pairs::<String, Value>().filter_map(Result::ok) {
            if let Ok(value) = to_json(lua, &value, "point") {
                parameters.insert(key, value);
            }
        }
        parameters.sort_keys();
        parameters
    }

    /// The declaration, checked again: the script may have changed its table.
    fn spec(&self) -> Result<Constructed<ExperimentSpec>, ScriptError> {
        let vm = &self.instance.vm;
        let spec = self.instance.result().map_err(|e| vm.explain(&e))?;
        spec.ok_or_else(|| ScriptError::new(vm.main(), "the script did not return an experiment"))
    }

    /// The rows of point `index`. `math.random` is seeded by the index and the base seed, so that the order of
    /// points does not matter.
    ///
    /// # Errors
    /// If the script fails, takes too long, or returns something other than rows.
    pub fn run(&self, index: usize) -> Result<Vec<ExperimentRow>, ScriptError> {
        let vm = &self.instance.vm;
        let [index_key, seed_key] = self.input.point_key(index);
        vm.random.reseed(softvt_benchmark::seed::keyed_rng(&["softvt point", &index_key, &seed_key]));
        let spec = self.spec()?;
        let _deadline = vm.point_deadline();
        let point = self.points.get(&vm.lua, index).map_err(|e| vm.explain(&e))?;
        let result = vm.call(&spec.run, (point, spec.options.clone()))?;
        if vm.random.has_drawn() {
            self.input.record_random();
        }
        rows(&vm.lua, &result, &self.input).map_err(|e| vm.explain(&e))
    }

    /// Passes all rows, in the order of points, to the experiment's `finish`.
    ///
    /// # Errors
    /// If the script fails or returns something other than a summary.
    pub fn finish(&self, rows: &[ExperimentRow]) -> Result<ExperimentSummary, ScriptError> {
        let vm = &self.instance.vm;
        let spec = self.spec()?;
        let Some(finish) = &spec.finish else { return Ok(ExperimentSummary::default()) };
        let rows = rows.iter().map(|row| vm.lua.to_value(row)).collect::<mlua::Result<Vec<_>>>();
        let rows = rows.and_then(|rows| vm.lua.create_sequence_from(rows)).map_err(|e| vm.explain(&e))?;
        let value = vm.call(finish, (rows, spec.options.clone()))?;
        read_summary(&vm.lua, &value).map_err(|e| vm.explain(&e))
    }
}

/// Text of a row, with its keys, bytes.
fn text_bytes(row: &ExperimentRow) -> usize {
    fn of(value: &Json) -> usize {
        match value {
            Json::String(text) => text.len(),
            Json::Array(items) => items.iter().map(of).sum(),
            Json::Object(entries) => text_bytes(entries),
            _ => 0,
        }
    }
    row.iter().map(|(key, value)| key.len() + of(value)).sum()
}

fn read_summary(lua: &Lua, value: &Value) -> mlua::Result<ExperimentSummary> {
    if value.is_nil() {
        return Ok(ExperimentSummary::default());
    }
    let spec = FinishSpec::from_checked(Value::Table(validate(lua, FinishSpec::RECORD, value)?), lua)?;
    let (mut files, mut bytes) = (Vec::new(), 0);
    for (path, content) in spec.files {
        if path.contains(char::is_control) {
            bail!(lua, "finish.files: {path:?} holds a control character; leave it out");
        }
        if !is_inside(&path) {
            bail!(
                lua,
                "finish.files: {path:?} is no path within the folder; give one such as \"plots/d.svg\", without \"..\", \
                 \":\" and \"\\\", and no \"/\" at its beginning"
            );
        }
        let content = file_content(lua, &content)?;
        bytes += content.len();
        if bytes > MAX_FILES_BYTES {
            let limit = MAX_FILES_BYTES >> 20;
            bail!(lua, "finish.files: take more than {limit} MiB; write fewer or smaller ones");
        }
        files.push((path, content));
    }
    Ok(ExperimentSummary { text: spec.text, files, problem: spec.problem })
}

/// The bytes of a file: text as it is, images as PNG, other data as JSON.
fn file_content(lua: &Lua, content: &Value) -> mlua::Result<Vec<u8>> {
    if let Value::String(text) = content {
        return Ok(text.to_string_lossy().into_bytes());
    }
    if let Some(image) = image_of(content) {
        return encode_png(&image).map_err(mlua::Error::external);
    }
    let json = to_json(lua, content, "finish.files")?;
    let text = serde_json::to_string_pretty(&json).map_err(mlua::Error::external)?;
    Ok((text + "\n").into_bytes())
}

/// Text in one row, bytes.
const MAX_ROW_TEXT: usize = 1 << 20;
/// Text in all rows of an experiment, bytes; they are kept until its end.
const MAX_ROWS_TEXT: usize = 256 << 20;
/// All files of an experiment together, bytes.
const MAX_FILES_BYTES: usize = 256 << 20;

fn rows(lua: &Lua, result: &Value, input: &ExperimentInput) -> mlua::Result<Vec<ExperimentRow>> {
    let row = |value: &Value| match to_json(lua, value, "experiment.run: row")? {
        Json::Object(map) => {
            let bytes = text_bytes(&map);
            let too_much = |what: &str, limit: usize| {
                let limit = limit >> 20;
                Err(fail!(
                    lua,
                    "experiment.run: {what} more than {limit} MiB of text; return long texts as finish.files"
                ))
            };
            if bytes > MAX_ROW_TEXT {
                return too_much("a row has", MAX_ROW_TEXT);
            }
            if input.count_row_text(bytes) > MAX_ROWS_TEXT {
                return too_much("the rows have", MAX_ROWS_TEXT);
            }
            Ok(map)
        }
        _ => Err(fail!(lua, "experiment.run: expected a row or a list of rows, got {}", describe(value))),
    };
    match result {
        Value::Table(table) if table.raw_len() > 0 => {
            table.clone().sequence_values::<Value>().map(|value| row(&value?)).collect()
        }
        Value::Table(table) if table.is_empty() => Ok(Vec::new()),
        other => Ok(vec![row(other)?]),
    }
}
