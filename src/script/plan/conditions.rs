//! Conditions in Lua: `softvt.conditions`, and what it made as plain data.

use mlua::{Lua, Table, Value};

use crate::benchmark::{Condition, ObjectType, REFERENCE};
use crate::script::{
    api::catalogue_conditions::CONDITIONS,
    schema::{self, Fault},
    vm::fail,
    vm::json::json,
};

/// Installs `softvt.conditions`, which checks what no single field can say.
pub(crate) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    api.set("conditions", lua.create_function(conditions)?)
}

fn conditions(lua: &Lua, value: Value) -> mlua::Result<Table> {
    let made = schema::make(lua, &CONDITIONS, &value)?;
    for key in ["suites", "conditions"] {
        if made.get::<Table>(key)?.raw_len() == 0 {
            return Err(fail(lua, format!("conditions.{key}: expected at least one, got an empty list")));
        }
    }
    let tables: Vec<Table> = made.get("conditions")?;
    let mut names: Vec<String> = vec![REFERENCE.to_owned()];
    for (index, table) in tables.iter().enumerate() {
        let name: String = table.get("name")?;
        if names.contains(&name) {
            let of = if name == REFERENCE { "the unchanged run" } else { "another condition" };
            let message = format!("{name:?} is the name of {of}; give another");
            let path = vec!["conditions".into(), format!("[{}]", index + 1), "name".into()];
            return Err(schema::fault_here(lua, CONDITIONS.label, &Fault { path, message }));
        }
        names.push(name);
    }
    Ok(made)
}

/// The conditions of a table that `softvt.conditions` made.
///
/// # Errors
/// The table was changed since.
pub(crate) fn read(lua: &Lua, table: &Table) -> mlua::Result<Vec<Condition>> {
    schema::still_sound(lua, &CONDITIONS, table)?;
    let tables: Vec<Table> = table.get("conditions")?;
    tables.iter().map(|table| condition(lua, table)).collect()
}

fn condition(lua: &Lua, table: &Table) -> mlua::Result<Condition> {
    let mut shift = Vec::new();
    for (key, value) in entries(table, "shift")? {
        shift.push((key, schema::number(&value).unwrap_or(f64::NAN)));
    }
    let mut set = Vec::new();
    for (key, value) in entries(table, "set")? {
        let text = match &value {
            Value::String(text) => text.to_string_lossy().to_string(),
            other => json(lua, other, "conditions.set")?.to_string(),
        };
        set.push((key, text));
    }
    let only = table.get::<Option<String>>("only")?.map(|kind| match kind.as_str() {
        "rigid" => ObjectType::Rigid,
        _ => ObjectType::Deformable,
    });
    Ok(Condition { name: table.get("name")?, shift, set, only })
}

/// The entries of a map that may be missing, in an order that does not depend on hashes.
fn entries(table: &Table, key: &str) -> mlua::Result<Vec<(String, Value)>> {
    let map: Option<Table> = table.get(key)?;
    let pairs = map.map(|map| schema::sorted_pairs(&map)).unwrap_or_default();
    pairs.into_iter().map(|(key, value)| Ok((key.to_string()?, value))).collect()
}
