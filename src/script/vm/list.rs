//! Lists that belong to an object of the host: reading gives no copy whose changes would be lost in silence.

use mlua::{Lua, MetaMethod, MultiValue, Table, UserData, UserDataFields, UserDataMethods, Value};

use crate::script::{
    api::catalogue_classes::LIST,
    schema::numbers,
    schema::{self, number},
    vm::{describe, fail},
};

type Get = Box<dyn Fn(&Lua) -> mlua::Result<Vec<f64>> + Send + Sync>;
type Set = Box<dyn Fn(&Lua, &Value) -> mlua::Result<()> + Send + Sync>;

enum Content {
    /// Numbers of the object, written through, and checked there.
    Live { get: Get, set: Set },
    /// What was there when it was read, and how it is changed instead.
    Fixed { entries: Table, mend: String },
}

/// `softvt.List`.
pub(crate) struct LuaList {
    /// How messages name it: `scene.base`.
    label: String,
    content: Content,
}

impl LuaList {
    /// Numbers that are read by `get` and, all of them, written by `set`.
    pub(crate) fn live(label: String, get: Get, set: Set) -> Self {
        Self { label, content: Content::Live { get, set } }
    }

    /// A list that refuses to be written; `mend` says what to do instead.
    pub(crate) fn fixed(label: String, entries: Table, mend: &str) -> Self {
        Self { label, content: Content::Fixed { entries, mend: mend.to_owned() } }
    }

    /// Its entries as a plain list.
    fn entries(&self, lua: &Lua) -> mlua::Result<Table> {
        match &self.content {
            Content::Live { get, .. } => lua.create_sequence_from(get(lua)?),
            Content::Fixed { entries, .. } => {
                lua.create_sequence_from(entries.sequence_values::<Value>().flatten())
            }
        }
    }

    fn read(&self, lua: &Lua, key: &Value) -> mlua::Result<Value> {
        match key {
            Value::Integer(_) | Value::Number(_) => self.entries(lua)?.raw_get(key),
            other => Err(fail(
                lua,
                format!(
                    "{}: expected a place in the list, 1 or more, got {}",
                    self.label,
                    schema::got(other)
                ),
            )),
        }
    }

    fn write(&self, lua: &Lua, key: &Value, value: &Value) -> mlua::Result<()> {
        let label = &self.label;
        let (get, set) = match &self.content {
            Content::Live { get, set } => (get, set),
            Content::Fixed { mend, .. } => {
                return Err(fail(lua, format!("{label}: cannot be written; {mend}")));
            }
        };
        let mut numbers = get(lua)?;
        let count = numbers.len();
        let place = number(key).filter(|n| n.fract() == 0.0 && (1.0..=count as f64).contains(n));
        let Some(place) = place else {
            return Err(fail(lua, format!("{label}: has places 1 to {count}, got {}", schema::got(key))));
        };
        let entry = numbers::entry(value, schema::Range::ANY);
        let entry = entry.map_err(|message| fail(lua, format!("{label}[{place}]: {message}")))?;
        numbers[place as usize - 1] = entry;
        set(lua, &Value::Table(lua.create_sequence_from(numbers)?))
    }
}

/// The value itself; of a [`LuaList`] its entries now, as a plain list.
pub(crate) fn plain(lua: &Lua, value: &Value) -> mlua::Result<Value> {
    match value.as_userdata().and_then(|data| data.borrow::<LuaList>().ok()) {
        Some(list) => list.entries(lua).map(Value::Table),
        None => Ok(value.clone()),
    }
}

impl UserData for LuaList {
    fn add_fields<F: UserDataFields<Self>>(fields: &mut F) {
        fields.add_meta_field(MetaMethod::Type, LIST.name);
    }

    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        methods.add_meta_method(MetaMethod::ToString, |lua, this, ()| {
            Ok(describe(&Value::Table(this.entries(lua)?), 0))
        });
        methods.add_meta_method(MetaMethod::Len, |lua, this, _: MultiValue| Ok(this.entries(lua)?.raw_len()));
        methods.add_meta_method(MetaMethod::Index, |lua, this, key: Value| this.read(lua, &key));
        methods.add_meta_method(MetaMethod::NewIndex, |lua, this, (key, value): (Value, Value)| {
            this.write(lua, &key, &value)
        });
    }
}
