//! Running an experiment: points in, rows out.

use mlua::{Function, Lua, LuaSerdeExt, Table, Value};
use serde_json::{Map, Value as Json};

use crate::script::{
    Loaded, ScriptError,
    api::catalogue,
    api::image::picture,
    plan::{Machine, reopen},
    schema::{self, sorted_pairs},
    vm::fail,
    vm::json::json,
};
use crate::sensing::camera::encode_png;

/// One row of results; keys sorted.
pub type Row = Map<String, Json>;

/// What an experiment leaves behind besides its rows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Finish {
    /// Printed after the rows.
    pub text: Option<String>,
    /// Files to write: relative path without `..`, and bytes.
    pub files: Vec<(String, Vec<u8>)>,
}

/// A machine that runs points of an experiment; open one a thread.
pub struct Experiment {
    machine: Machine,
    table: Table,
    points: Vec<Value>,
}

impl Experiment {
    /// A fresh machine on the sources of `loaded`.
    ///
    /// # Errors
    /// If the script fails now, or is no experiment.
    pub fn open(loaded: &Loaded) -> Result<Self, ScriptError> {
        let (machine, values) = reopen(loaded)?;
        let Some(Value::Table(table)) = values.front().cloned() else {
            return Err(ScriptError::new(&loaded.main, "the script returned no experiment"));
        };
        if !schema::is_made(&machine.vm.lua, &catalogue::EXPERIMENT, &table) {
            return Err(ScriptError::new(&loaded.main, "the script returned no experiment"));
        }
        let points = {
            let _deadline = machine.vm.call_deadline();
            points(&machine.vm.lua, &table).map_err(|e| machine.vm.explain(&e))?
        };
        Ok(Self { machine, table, points })
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// A point as data.
    ///
    /// # Errors
    /// If it holds something that is not data.
    pub fn point(&self, index: usize) -> Result<Json, ScriptError> {
        let lua = &self.machine.vm.lua;
        let point = self.points.get(index).cloned().unwrap_or(Value::Nil);
        json(lua, &point, "point").map_err(|e| self.machine.vm.explain(&e))
    }

    /// The rows of point `index`. `math.random` starts afresh for each point, so that the order does not matter.
    ///
    /// # Errors
    /// If the script fails, takes too long, or gives something that is no row.
    pub fn run(&self, index: usize) -> Result<Vec<Row>, ScriptError> {
        let vm = &self.machine.vm;
        vm.random.reseed(crate::benchmark::seed::keyed_rng(&["softvt point", &index.to_string()]));
        let fetch = || -> mlua::Result<_> {
            schema::still_sound(&vm.lua, &catalogue::EXPERIMENT, &self.table)?;
            Ok((self.table.get::<Function>("run")?, self.table.get::<Value>("options")?))
        };
        let (run, options) = fetch().map_err(|e| vm.explain(&e))?;
        let point = self.points.get(index).cloned().unwrap_or(Value::Nil);
        let result: Value = vm.call_point(&run, (point, options))?;
        rows(&vm.lua, &result).map_err(|e| vm.explain(&e))
    }

    /// Hands all rows, in the order of points, to the experiment's `finish`.
    ///
    /// # Errors
    /// If the script fails or gives something else than it may.
    pub fn finish(&self, rows: &[Row]) -> Result<Finish, ScriptError> {
        let vm = &self.machine.vm;
        self.call_finish(rows).unwrap_or_else(|e| Err(vm.explain(&e)))
    }

    fn call_finish(&self, rows: &[Row]) -> mlua::Result<Result<Finish, ScriptError>> {
        let vm = &self.machine.vm;
        schema::still_sound(&vm.lua, &catalogue::EXPERIMENT, &self.table)?;
        let Some(finish) = self.table.get::<Option<Function>>("finish")? else {
            return Ok(Ok(Finish::default()));
        };
        let options: Value = self.table.get("options")?;
        let list = vm.lua.create_table()?;
        for row in rows {
            list.push(vm.lua.to_value(row)?)?;
        }
        match vm.call::<Value>(&finish, (list, options)) {
            Ok(value) => read_finish(&vm.lua, &value).map(Ok),
            Err(error) => Ok(Err(error)),
        }
    }
}

fn read_finish(lua: &Lua, value: &Value) -> mlua::Result<Finish> {
    let table = match value {
        Value::Nil => return Ok(Finish::default()),
        Value::Table(table) => table,
        other => {
            return Err(fail(
                lua,
                format!("finish: expected a table of text, files, got {}", schema::got(other)),
            ));
        }
    };
    let checked = schema::check(lua, &catalogue::FINISH, table)
        .map_err(|fault| schema::fault_here(lua, "finish", &fault))?;
    let mut files = Vec::new();
    if let Some(map) = checked.get::<Option<Table>>("files")? {
        for (path, content) in sorted_pairs(&map) {
            let path = path.to_string()?;
            let inside = |part: &str| {
                !part.is_empty() && part != "." && part != ".." && !part.contains(['\\', ':', '\0'])
            };
            if !path.split('/').all(inside) {
                return Err(fail(
                    lua,
                    format!("finish.files: {path:?} leads out of the folder; give a path without \"..\""),
                ));
            }
            files.push((path, bytes(lua, &content)?));
        }
    }
    Ok(Finish { text: checked.get("text")?, files })
}

/// A file's content: text as it is, a picture as PNG, other data as JSON.
fn bytes(lua: &Lua, content: &Value) -> mlua::Result<Vec<u8>> {
    if let Value::String(text) = content {
        return Ok(text.to_string_lossy().into_bytes());
    }
    if let Some(picture) = picture(content) {
        return encode_png(&picture).map_err(mlua::Error::external);
    }
    let json = json(lua, content, "finish.files")?;
    let text = serde_json::to_string_pretty(&json).map_err(mlua::Error::external)?;
    Ok((text + "\n").into_bytes())
}

/// The points of an experiment: those it gives, or every combination of its grid.
pub(crate) fn points(lua: &Lua, table: &Table) -> mlua::Result<Vec<Value>> {
    let options: Value = table.get("options")?;
    let given: Option<Function> = table.get("points")?;
    let grid: Option<Table> = table.get("grid")?;
    match (given, grid) {
        (Some(given), None) => {
            let list: Value = given.call(options)?;
            let Value::Table(list) = &list else {
                return Err(fail(
                    lua,
                    format!("experiment.points: expected a list of tables, got {}", schema::got(&list)),
                ));
            };
            let points: Vec<Value> = list.clone().sequence_values().collect::<mlua::Result<_>>()?;
            match points.iter().all(Value::is_table) {
                true => Ok(points),
                false => Err(fail(lua, "experiment.points: every point is a table")),
            }
        }
        (None, Some(grid)) => product(lua, &grid),
        _ => Err(fail(lua, "experiment: give either grid or points")),
    }
}

fn product(lua: &Lua, grid: &Table) -> mlua::Result<Vec<Value>> {
    let mut points: Vec<Vec<(Value, Value)>> = vec![Vec::new()];
    for (name, values) in sorted_pairs(grid) {
        let values: Vec<Value> = match values {
            Value::Table(list) => list.sequence_values().collect::<mlua::Result<_>>()?,
            _ => Vec::new(),
        };
        if points.len().saturating_mul(values.len()) > 1_000_000 {
            return Err(fail(lua, "experiment.grid: has more than a million points; give fewer values"));
        }
        points = points
            .iter()
            .flat_map(|point| {
                values.iter().map(|value| {
                    let mut longer = point.clone();
                    longer.push((name.clone(), value.clone()));
                    longer
                })
            })
            .collect();
    }
    points.into_iter().map(|point| lua.create_table_from(point).map(Value::Table)).collect()
}

fn rows(lua: &Lua, result: &Value) -> mlua::Result<Vec<Row>> {
    let row = |value: &Value| match json(lua, value, "experiment.run: row")? {
        Json::Object(map) => Ok(map),
        _ => Err(fail(
            lua,
            format!("experiment.run: expected a row or a list of rows, got {}", schema::got(value)),
        )),
    };
    match result {
        Value::Table(table) if table.raw_len() > 0 => {
            table.clone().sequence_values::<Value>().map(|value| row(&value?)).collect()
        }
        Value::Table(table) if table.is_empty() => Ok(Vec::new()),
        other => Ok(vec![row(other)?]),
    }
}
