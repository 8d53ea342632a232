//! The points of an experiment.

use std::collections::BTreeSet;

use mlua::{Lua, Table, Value};

use crate::{api::tasks::ExperimentSpec, schema::Constructed, vm::value::describe};
use softvt_common::text::{is_misspelt, unknown_name};

const MAX_POINTS: usize = 1_000_000;

pub(crate) enum Points {
    /// Results of a function, and the names of all of their fields.
    Listed { points: Vec<Table>, names: Vec<String> },
    /// Every combination of the values of a grid, the last parameter first.
    Grid(Vec<(String, Vec<Value>)>),
}

impl Points {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Listed { points, .. } => points.len(),
            Self::Grid(grid) => {
                grid.iter().fold(1, |count: usize, (_, values)| count.saturating_mul(values.len()))
            }
        }
    }

    fn names(&self) -> Vec<String> {
        match self {
            Self::Listed { names, .. } => names.clone(),
            Self::Grid(grid) => grid.iter().map(|(name, _)| name.clone()).collect(),
        }
    }

    /// Point `index`; nil beyond the last. Only this one is made, since each point of a run opens the script.
    pub(crate) fn get(&self, lua: &Lua, mut index: usize) -> mlua::Result<Value> {
        match self {
            _ if index >= self.len() => Ok(Value::Nil),
            Self::Listed { points, .. } if points[index].metatable().is_some() => {
                Ok(Value::Table(points[index].clone()))
            }
            Self::Listed { points, names } => {
                let point = lua.create_table()?;
                for entry in points[index].pairs::<Value, Value>() {
                    let (name, value) = entry?;
                    point.raw_set(name, value)?;
                }
                // A field may be absent from all points of a run.
                let fields = names.clone();
                // pos_x and pos_y, or seed and seed2, are different fields.
                let is_sibling = |a: &str, b: &str| {
                    let stem = |word: &str| word.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned();
                    let all_but_last =
                        |word: &str| word.as_bytes().split_last().map(|(_, rest)| rest.to_vec());
                    stem(a) == stem(b) || all_but_last(a) == all_but_last(b)
                };
                let refuses = move |key: &str| {
                    key.len() > 2
                        && fields.iter().any(|name| is_misspelt(key, name) && !is_sibling(key, name))
                };
                refuse_reads(lua, &point, names.clone(), refuses)?;
                Ok(Value::Table(point))
            }
            Self::Grid(grid) => {
                let point = lua.create_table()?;
                for (name, values) in grid {
                    point.raw_set(name.as_str(), &values[index % values.len()])?;
                    index /= values.len();
                }
                refuse_reads(lua, &point, self.names(), |_| true)?;
                Ok(Value::Table(point))
            }
        }
    }
}

/// The points of an experiment: those of its function, or every combination of its grid.
pub(crate) fn points(lua: &Lua, spec: &Constructed<ExperimentSpec>) -> mlua::Result<Points> {
    match (&spec.points, &spec.grid) {
        (Some(points), None) => {
            let list: Value = points.call(spec.options.clone())?;
            let Value::Table(list) = &list else {
                bail!(lua, "experiment.points: expected a list of tables, got {}", describe(&list));
            };
            let points: Vec<Value> = list.clone().sequence_values().collect::<mlua::Result<_>>()?;
            match (points.is_empty(), points.iter().all(Value::is_table)) {
                (true, _) => {
                    Err(fail!(lua, "experiment.points: expected a list of at least one table, got none"))
                }
                (false, true) => Ok(listed(points)),
                (false, false) => Err(fail!(lua, "experiment.points: every point is a table")),
            }
        }
        (None, Some(grid)) => {
            let grid = Points::Grid(
                grid.iter().rev().map(|(name, values)| (name.clone(), values.clone())).collect(),
            );
            if grid.len() > MAX_POINTS {
                bail!(lua, "experiment.grid: has more than a million points; give fewer values");
            }
            Ok(grid)
        }
        _ => Err(fail!(lua, "experiment: give either grid or points")),
    }
}

fn listed(points: Vec<Value>) -> Points {
    let points: Vec<Table> = points.into_iter().filter_map(|point| point.as_table().cloned()).collect();
    let keys = points.iter().flat_map(|point| point.pairs::<Value, Value>().flatten());
    let names = keys.filter_map(|(key, _)| Some(key.as_string()?.to_string_lossy().clone()));
    let names: BTreeSet<String> = names.collect();
    Points::Listed { points, names: names.into_iter().collect() }
}

/// Makes it an error to read a field that a point lacks, where `refuses` says so of its name.
fn refuse_reads(
    lua: &Lua,
    point: &Table,
    names: Vec<String>,
    refuses: impl Fn(&str) -> bool + Send + Sync + 'static,
) -> mlua::Result<()> {
    let read = lua.create_function(move |lua, (_, key): (Table, Value)| match &key {
        Value::String(key) if refuses(&key.to_string_lossy()) => {
            let known = names.iter().map(String::as_str);
            Err(fail!(lua, "point: {}", unknown_name("key", &key.to_string_lossy(), known)))
        }
        _ => Ok(Value::Nil),
    })?;
    let meta = lua.create_table()?;
    meta.set("__index", read)?;
    meta.set("__metatable", "point")?;
    meta.set("__tostring", lua.create_function(|_, _: Value| Ok("table"))?)?;
    point.set_metatable(Some(meta))
}
