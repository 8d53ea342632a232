//! Lists that belong to an object of the host. Reading `scene.base` gives such a list and no copy, whose changes would
//! be lost without an error.

use mlua::{Lua, MetaMethod, MultiValue, Table, UserData, UserDataFields, UserDataMethods, Value};

use super::value::{describe, literal, number};

type Get = Box<dyn Fn(&Lua) -> mlua::Result<Vec<f64>> + Send + Sync>;
type Set = Box<dyn Fn(&Lua, &Value) -> mlua::Result<()> + Send + Sync>;

enum ListContent {
    /// Numbers of the object, which checks them when they are written.
    Live { get: Get, set: Set },
    /// The entries at the time of reading, and how to change them instead.
    ReadOnly { entries: Table, hint: &'static str },
}

pub(crate) struct LuaList {
    /// Name in messages: `scene.base`.
    label: String,
    content: ListContent,
}

impl LuaList {
    pub(crate) const CLASS: &'static str = "softvt.List";

    /// Numbers read by `get`; `set` writes all of them.
    pub(crate) fn live(label: String, get: Get, set: Set) -> Self {
        Self { label, content: ListContent::Live { get, set } }
    }

    /// A list that cannot be written; `hint` says how to change it instead.
    pub(crate) fn read_only(label: String, entries: Table, hint: &'static str) -> Self {
        Self { label, content: ListContent::ReadOnly { entries, hint } }
    }

    fn entries(&self, lua: &Lua) -> mlua::Result<Table> {
        match &self.content {
            ListContent::Live { get, .. } => lua.create_sequence_from(get(lua)?),
            ListContent::ReadOnly { entries, .. } => {
                lua.create_sequence_from(entries.sequence_values::<Value>().flatten())
            }
        }
    }

    fn read(&self, lua: &Lua, key: &Value) -> mlua::Result<Value> {
        match key {
            Value::Integer(_) | Value::Number(_) => self.entries(lua)?.raw_get(key),
            other => Err(fail!(lua, "{}: expected a place in the list, got {}", self.label, describe(other))),
        }
    }

    fn write(&self, lua: &Lua, key: &Value, value: &Value) -> mlua::Result<()> {
        let label = &self.label;
        let (get, set) = match &self.content {
            ListContent::Live { get, set } => (get, set),
            ListContent::ReadOnly { hint, .. } => {
                bail!(lua, "{label}: cannot be written; {hint}");
            }
        };
        let mut numbers = get(lua)?;
        let count = numbers.len();
        let place = number(key).filter(|n| n.fract() == 0.0 && (1.0..=count as f64).contains(n));
        let Some(place) = place else {
            bail!(lua, "{label}: has places 1 to {count}, got {}", describe(key));
        };
        let Some(entry) = number(value).filter(|number| number.is_finite()) else {
            bail!(lua, "{label}[{place}]: expected a number, got {}", describe(value));
        };
        numbers[place as usize - 1] = entry;
        set(lua, &Value::Table(lua.create_sequence_from(numbers)?))
    }
}

/// The value itself; for a [`LuaList`] a plain list of its present entries.
pub(crate) fn plain(lua: &Lua, value: &Value) -> mlua::Result<Value> {
    match value.as_userdata().and_then(|data| data.borrow::<LuaList>().ok()) {
        Some(list) => list.entries(lua).map(Value::Table),
        None => Ok(value.clone()),
    }
}

impl UserData for LuaList {
    fn add_fields<F: UserDataFields<Self>>(fields: &mut F) {
        fields.add_meta_field(MetaMethod::Type, Self::CLASS);
    }

    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        methods.add_meta_method(MetaMethod::ToString, |lua, this, ()| {
            Ok(literal(&Value::Table(this.entries(lua)?), 0))
        });
        methods.add_meta_method(MetaMethod::Len, |lua, this, _: MultiValue| Ok(this.entries(lua)?.raw_len()));
        methods.add_meta_method(MetaMethod::Index, |lua, this, key: Value| this.read(lua, &key));
        methods.add_meta_method(MetaMethod::NewIndex, |lua, this, (key, value): (Value, Value)| {
            this.write(lua, &key, &value)
        });
    }
}
