//! Where tables of the Lua surface were made: some of what is wrong with them shows only after the script is over, when no
//! line of it is running any more.

use mlua::{Lua, Table};

use crate::script::{
    ScriptError,
    vm::position,
    vm::{fail, here, locked, shared},
};

/// Registry key of the table from made tables, which it does not keep alive, to `file:line`.
const MADE_AT: &str = "softvt made at";

/// Notes that `table` is made by the script's call that is running now.
pub(crate) fn note(lua: &Lua, table: &Table) -> mlua::Result<()> {
    let Some((file, line)) = here(lua) else { return Ok(()) };
    let places = match lua.named_registry_value::<Table>(MADE_AT) {
        Ok(places) => places,
        Err(_) => {
            let (places, weak) = (lua.create_table()?, lua.create_table()?);
            weak.set("__mode", "k")?;
            places.set_metatable(Some(weak))?;
            lua.set_named_registry_value(MADE_AT, &places)?;
            places
        }
    };
    places.raw_set(table, format!("{file}:{line}"))
}

/// File and line of the call that made `table`.
fn made_at(lua: &Lua, table: &Table) -> Option<(String, usize)> {
    let places = lua.named_registry_value::<Table>(MADE_AT).ok()?;
    let place: String = places.raw_get::<Option<String>>(table).ok()??;
    let (file, line) = place.rsplit_once(':')?;
    Some((file.to_owned(), line.parse().ok()?))
}

/// File and line of the key that `path` leads to in the call that made `table`, as messages name them.
pub(crate) fn place(lua: &Lua, table: &Table, path: &[&str]) -> Option<String> {
    let (file, line) = made_at(lua, table)?;
    let path: Vec<String> = path.iter().map(|&key| key.to_owned()).collect();
    let line = line_of(lua, &file, line, &path);
    Some(format!("{file}:{line}"))
}

/// An error at the line of `key` in the call that made `table`, as far as the text shows it.
pub(crate) fn fail_at(lua: &Lua, table: &Table, key: &str, message: impl Into<String>) -> mlua::Error {
    let Some((file, line)) = made_at(lua, table) else { return fail(lua, message) };
    mlua::Error::external(ScriptError::new(&file, message).at(Some(line_of(
        lua,
        &file,
        line,
        &[key.to_owned()],
    ))))
}

/// The line of the key that `path` leads to in the call on `line`, or that line.
pub(crate) fn line_of(lua: &Lua, file: &str, line: usize, path: &[String]) -> usize {
    let text = shared(lua).ok().and_then(|shared| locked(&shared.library).text(file).ok());
    text.map_or(line, |text| position::line_of_key(&text, line, path))
}
