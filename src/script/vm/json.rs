//! Lua values as plain data.

use mlua::{Lua, Table, Value};
use serde::de::DeserializeOwned;
use serde_json::{Map, Number, Value as Json};

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
    let mut left = MAX_VALUES;
    JsonReader { lua, left: &mut left }.read(value, label, 0)
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

struct JsonReader<'a> {
    lua: &'a Lua,
    left: &'a mut usize,
}

impl JsonReader<'_> {
    fn wrong<T>(&self, label: &str, what: &str) -> mlua::Result<T> {
        Err(fail(self.lua, format!("{label}: {what}")))
    }

    fn read(&mut self, value: &Value, label: &str, depth: usize) -> mlua::Result<Json> {
        if *self.left == 0 {
            return self.wrong(label, &format!("the data has more than {MAX_VALUES} values; give less"));
        }
        *self.left -= 1;
        let value = &plain(self.lua, value)?;
        Ok(match value {
            Value::Nil => Json::Null,
            Value::Boolean(flag) => Json::Bool(*flag),
            Value::Integer(n) => Json::Number((*n).into()),
            Value::Number(n) => match Number::from_f64(*n) {
                Some(number) => Json::Number(number),
                None => {
                    return self.wrong(label, &format!("expected a finite number, got {}", describe(value)));
                }
            },
            Value::String(text) => Json::String(text.to_string_lossy()),
            Value::Table(table) if depth < MAX_DEPTH => return self.table(table, label, depth),
            Value::Table(_) => return self.wrong(label, "tables are nested too deeply"),
            other => return self.wrong(label, &format!("expected data, got {}", describe(other))),
        })
    }

    fn table(&mut self, table: &Table, label: &str, depth: usize) -> mlua::Result<Json> {
        let count = table.raw_len();
        if count > 0 && table.pairs::<Value, Value>().count() == count {
            let items = (1..=count)
                .map(|index| self.read(&table.raw_get(index)?, &format!("{label}[{index}]"), depth + 1));
            return items.collect::<mlua::Result<_>>().map(Json::Array);
        }
        let mut map = Map::new();
        for (key, value) in sorted_pairs(table) {
            let Value::String(name) = &key else {
                return self.wrong(label, &format!("expected names as keys, got {}", describe(&key)));
            };
            let name = name.to_string_lossy();
            let inner = self.read(&value, &format!("{label}.{name}"), depth + 1)?;
            map.insert(name, inner);
        }
        Ok(Json::Object(map))
    }
}
