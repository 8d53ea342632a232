//! Lua values as plain data.

use mlua::{Lua, Value};
use serde::de::DeserializeOwned;
use serde_json::{Number, Value as Json};

use super::{
    error::fail,
    list::plain,
    value::{describe, sorted_pairs},
};

/// Nesting depth of tables.
const MAX_DEPTH: usize = 32;
/// Values in one piece of data. A table that occurs several times counts each time, since it is copied.
const MAX_VALUES: usize = 1_000_000;

/// Converts a Lua value to JSON with sorted keys. Messages name the value as `label`.
///
/// # Errors
/// For values that are not data: functions, objects, non-finite numbers, keys that are not strings, endless tables.
pub(crate) fn to_json(lua: &Lua, value: &Value, label: &str) -> mlua::Result<Json> {
    read(lua, value, label, 0, &mut 0)
}

/// Converts a Lua value to a Rust type by way of JSON; messages speak of Lua's types.
pub(crate) fn deserialize<T: DeserializeOwned>(lua: &Lua, label: &str, value: &Value) -> mlua::Result<T> {
    serde_json::from_value(to_json(lua, value, label)?).map_err(|error| {
        let replacements = [
            ("floating point ", ""),
            ("expected f64", "expected a number"),
            ("expected u32", "expected a whole number"),
            ("expected u64", "expected a whole number"),
            ("expected usize", "expected a whole number"),
            ("expected a sequence", "expected a list"),
            ("expected a map", "expected a table"),
            ("invalid type: map", "invalid type: a table"),
            ("invalid type: sequence", "invalid type: a list"),
        ];
        let text = replacements.iter().fold(error.to_string(), |text, (from, to)| text.replace(from, to));
        let text = match text.split_once("expected struct ") {
            Some((before, _)) => format!("{before}expected a table"),
            None => text,
        };
        fail(lua, format!("{label}: {text}"))
    })
}

/// `count` is the number of values read so far.
fn read(lua: &Lua, value: &Value, label: &str, depth: usize, count: &mut usize) -> mlua::Result<Json> {
    let wrong = |message: String| fail(lua, format!("{label}: {message}"));
    if *count == MAX_VALUES {
        return Err(wrong(format!("the data has more than {MAX_VALUES} values; give less")));
    }
    *count += 1;
    let value = &plain(lua, value)?;
    let table = match value {
        Value::Nil => return Ok(Json::Null),
        Value::Boolean(flag) => return Ok(Json::Bool(*flag)),
        Value::Integer(n) => return Ok(Json::Number((*n).into())),
        Value::Number(n) => match Number::from_f64(*n) {
            Some(number) => return Ok(Json::Number(number)),
            None => return Err(wrong(format!("expected a finite number, got {}", describe(value)))),
        },
        Value::String(text) => return Ok(Json::String(text.to_string_lossy())),
        Value::Table(table) if depth < MAX_DEPTH => table,
        Value::Table(_) => return Err(wrong("tables are nested too deeply".to_owned())),
        other => return Err(wrong(format!("expected data, got {}", describe(other)))),
    };
    let length = table.raw_len();
    if length > 0 && table.pairs::<Value, Value>().count() == length {
        let item = |index| read(lua, &table.raw_get(index)?, &format!("{label}[{index}]"), depth + 1, count);
        return (1..=length).map(item).collect::<mlua::Result<_>>().map(Json::Array);
    }
    let entries = sorted_pairs(table).into_iter().map(|(key, value)| match &key {
        Value::String(name) => {
            let name = name.to_string_lossy();
            Ok((name.clone(), read(lua, &value, &format!("{label}.{name}"), depth + 1, count)?))
        }
        key => Err(wrong(format!("expected names as keys, got {}", describe(key)))),
    });
    entries.collect::<mlua::Result<_>>().map(Json::Object)
}
