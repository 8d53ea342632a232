//! Lua values as plain data.

use mlua::{Lua, Value};
use serde::de::DeserializeOwned;
use serde_json::{Number, Value as Json};

use super::{
    list::plain,
    value::{describe, sorted_pairs},
};

const MAX_DEPTH: usize = 32;
/// Values in one piece of data. A table that occurs several times counts each time, since it is copied.
const MAX_VALUES: usize = 1_000_000;
/// Text in one piece of data, bytes. A text that occurs several times counts each time, like a table.
const MAX_TEXT_BYTES: usize = 64 << 20;

/// Converts a Lua value to JSON with sorted keys. Messages name the value as `label`.
pub(crate) fn to_json(lua: &Lua, value: &Value, label: &str) -> mlua::Result<Json> {
    read(lua, value, label, 0, &mut DataSize::default())
}

/// Converts a Lua value to a Rust type by way of JSON; messages speak of Lua's types.
pub(crate) fn deserialize<T: DeserializeOwned>(lua: &Lua, label: &str, value: &Value) -> mlua::Result<T> {
    serde_json::from_value(with_whole_numbers(to_json(lua, value, label)?)).map_err(|error| {
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
        fail!(lua, "{label}: {text}")
    })
}

/// The data with 2 for 2.0, since Lua does not distinguish them and integer fields do.
fn with_whole_numbers(data: Json) -> Json {
    match data {
        Json::Number(number) => match number.as_f64() {
            Some(float) if float.fract() == 0.0 && float.abs() < 9e15 => Json::Number((float as i64).into()),
            _ => Json::Number(number),
        },
        Json::Array(items) => items.into_iter().map(with_whole_numbers).collect(),
        Json::Object(entries) => {
            entries.into_iter().map(|(key, value)| (key, with_whole_numbers(value))).collect()
        }
        other => other,
    }
}

/// The size of a piece of data, as read so far.
#[derive(Default)]
struct DataSize {
    values: usize,
    text_bytes: usize,
}

fn read(lua: &Lua, value: &Value, label: &str, depth: usize, size: &mut DataSize) -> mlua::Result<Json> {
    let wrong = |message: String| fail!(lua, "{label}: {message}");
    if size.values == MAX_VALUES {
        return Err(wrong(format!("the data has more than {MAX_VALUES} values; give less")));
    }
    size.values += 1;
    let mut count_text = |text: &mlua::LuaString| {
        size.text_bytes += text.as_bytes().len();
        match size.text_bytes > MAX_TEXT_BYTES {
            true => {
                Err(wrong(format!("the data has more than {} MiB of text; give less", MAX_TEXT_BYTES >> 20)))
            }
            false => Ok(text.to_string_lossy()),
        }
    };
    let value = &plain(lua, value)?;
    let table = match value {
        Value::Nil => return Ok(Json::Null),
        Value::Boolean(flag) => return Ok(Json::Bool(*flag)),
        Value::Integer(n) => return Ok(Json::Number((*n).into())),
        Value::Number(n) => match Number::from_f64(*n) {
            Some(number) => return Ok(Json::Number(number)),
            None => return Err(wrong(format!("expected a finite number, got {}", describe(value)))),
        },
        Value::String(text) => return count_text(text).map(Json::String),
        Value::Table(table) if depth < MAX_DEPTH => table,
        Value::Table(_) => return Err(wrong("tables are nested too deeply".to_owned())),
        other => return Err(wrong(format!("expected data, got {}", describe(other)))),
    };
    let length = table.raw_len();
    if length > 0 && table.pairs::<Value, Value>().count() == length {
        let item = |index| read(lua, &table.raw_get(index)?, &format!("{label}[{index}]"), depth + 1, size);
        return (1..=length).map(item).collect::<mlua::Result<_>>().map(Json::Array);
    }
    let entries = sorted_pairs(table).into_iter().map(|(key, value)| match &key {
        Value::String(name) => {
            size.text_bytes += name.as_bytes().len();
            let name = name.to_string_lossy();
            Ok((name.clone(), read(lua, &value, &format!("{label}.{name}"), depth + 1, size)?))
        }
        key => Err(wrong(format!("expected names as keys, got {}", describe(key)))),
    });
    entries.collect::<mlua::Result<_>>().map(Json::Object)
}
