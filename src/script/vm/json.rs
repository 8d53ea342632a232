//! Lua values as plain data.

use mlua::{Lua, Table, Value};
use serde_json::{Map, Number, Value as Json};

use crate::script::{
    schema::{got, sorted_pairs},
    vm::fail,
    vm::list as lists,
};

/// Tables in one another.
const MOST_DEEP: usize = 32;
/// Values in a piece of data. A table that stands in many places counts as often: as data it is copied.
const MOST_VALUES: usize = 1_000_000;

/// A Lua value as JSON, keys sorted; `place` is how messages name it.
///
/// # Errors
/// For what is no data: functions, objects, numbers that are not finite, keys that are no names, tables without end.
pub(crate) fn json(lua: &Lua, value: &Value, place: &str) -> mlua::Result<Json> {
    let mut left = MOST_VALUES;
    Reader { lua, left: &mut left }.read(value, place, 0)
}

struct Reader<'a> {
    lua: &'a Lua,
    left: &'a mut usize,
}

impl Reader<'_> {
    fn wrong<T>(&self, place: &str, what: &str) -> mlua::Result<T> {
        Err(fail(self.lua, format!("{place}: {what}")))
    }

    fn read(&mut self, value: &Value, place: &str, depth: usize) -> mlua::Result<Json> {
        if *self.left == 0 {
            return self.wrong(place, &format!("the data has more than {MOST_VALUES} values; give less"));
        }
        *self.left -= 1;
        let value = &lists::plain(self.lua, value)?;
        Ok(match value {
            Value::Nil => Json::Null,
            Value::Boolean(flag) => Json::Bool(*flag),
            Value::Integer(n) => Json::Number((*n).into()),
            Value::Number(n) => match Number::from_f64(*n) {
                Some(number) => Json::Number(number),
                None => return self.wrong(place, &format!("expected a finite number, got {}", got(value))),
            },
            Value::String(text) => Json::String(text.to_string_lossy().to_string()),
            Value::Table(table) if depth < MOST_DEEP => return self.table(table, place, depth),
            Value::Table(_) => return self.wrong(place, "tables are nested too deeply"),
            other => return self.wrong(place, &format!("expected data, got {}", got(other))),
        })
    }

    fn table(&mut self, table: &Table, place: &str, depth: usize) -> mlua::Result<Json> {
        let count = table.raw_len();
        if count > 0 && table.pairs::<Value, Value>().count() == count {
            let items = (1..=count)
                .map(|index| self.read(&table.raw_get(index)?, &format!("{place}[{index}]"), depth + 1));
            return items.collect::<mlua::Result<_>>().map(Json::Array);
        }
        let mut map = Map::new();
        for (key, value) in sorted_pairs(table) {
            let Value::String(name) = &key else {
                return self.wrong(place, &format!("expected names as keys, got {}", got(&key)));
            };
            let name = name.to_string_lossy().to_string();
            let inner = self.read(&value, &format!("{place}.{name}"), depth + 1)?;
            map.insert(name, inner);
        }
        Ok(Json::Object(map))
    }
}
