//! Lines for messages about tables.
//!
//! Lua knows the line of a running call. The line of a single key, and the origin of a table whose call is over, are
//! recovered here: by a note at every constructor call, and by a search in the source text.

use mlua::{Lua, Table};

use super::{
    error::{ScriptError, fail, here},
    library,
};
use crate::parallel::lock;

/// Registry key of the weak table from constructed tables to `file:line`.
const ORIGINS: &str = "softvt origins";

/// Notes that the running call of the script makes `table`.
pub(crate) fn record_origin(lua: &Lua, table: &Table) -> mlua::Result<()> {
    let Some((file, line)) = here(lua) else { return Ok(()) };
    let origins = match lua.named_registry_value::<Table>(ORIGINS) {
        Ok(origins) => origins,
        Err(_) => {
            let (origins, weak) = (lua.create_table()?, lua.create_table()?);
            weak.set("__mode", "k")?;
            origins.set_metatable(Some(weak))?;
            lua.set_named_registry_value(ORIGINS, &origins)?;
            origins
        }
    };
    origins.raw_set(table, format!("{file}:{line}"))
}

/// File and line of the key at `path` in the call that made `table`, or of that call.
fn origin_of_key(lua: &Lua, table: &Table, path: &[&str]) -> Option<(String, usize)> {
    let origins = lua.named_registry_value::<Table>(ORIGINS).ok()?;
    let origin: String = origins.raw_get::<Option<String>>(table).ok()??;
    let (file, line) = origin.rsplit_once(':')?;
    let path: Vec<String> = path.iter().map(|&key| key.to_owned()).collect();
    Some((file.to_owned(), line_of_key(lua, file, line.parse().ok()?, &path)))
}

/// `file:line` of the key at `path` in the call that made `table`.
pub(crate) fn place_of_key(lua: &Lua, table: &Table, path: &[&str]) -> Option<String> {
    origin_of_key(lua, table, path).map(|(file, line)| format!("{file}:{line}"))
}

/// An error at the line of `key` in the call that made `table`.
pub(crate) fn fail_at_key(lua: &Lua, table: &Table, key: &str, message: impl Into<String>) -> mlua::Error {
    match origin_of_key(lua, table, &[key]) {
        Some((file, line)) => mlua::Error::external(ScriptError::new(&file, message).at(Some(line))),
        None => fail(lua, message),
    }
}

/// The line of the key at `path` in the table of the call on `line` of a file, or `line`.
pub(crate) fn line_of_key(lua: &Lua, file: &str, line: usize, path: &[String]) -> usize {
    let text = library::of(lua).ok().and_then(|library| lock(&library).text(file).ok());
    text.map_or(line, |text| find_key(&text, line, path))
}

/// The line of the last key of `path` that the table opening on or after `line` has; `line` if it has none.
fn find_key(text: &str, line: usize, path: &[String]) -> usize {
    let mut keys = path.iter().filter(|key| !key.starts_with('[')).peekable();
    let (mut depth, mut found) = (0usize, line);
    for (offset, row) in text.lines().skip(line.saturating_sub(1)).enumerate() {
        let row = without_strings(row);
        let mut at = 0;
        while at < row.len() {
            let rest = &row[at..];
            match rest.as_bytes()[0] {
                b'{' => depth += 1,
                b'}' if depth <= 1 => return found,
                b'}' => depth -= 1,
                _ => {}
            }
            let starts_word = !row[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
            if let Some(key) = keys.peek()
                && depth > 0
                && starts_word
                && rest.strip_prefix(key.as_str()).is_some_and(is_assignment)
            {
                found = line + offset;
                keys.next();
                if keys.peek().is_none() {
                    return found;
                }
            }
            at += rest.chars().next().map_or(1, char::len_utf8);
        }
    }
    found
}

fn is_assignment(rest: &str) -> bool {
    let rest = rest.trim_start();
    rest.starts_with('=') && !rest.starts_with("==")
}

/// The row with spaces for its strings, and without its comment, so that braces in them do not count.
fn without_strings(row: &str) -> String {
    let mut out = String::with_capacity(row.len());
    let (mut quote, mut escaped) = (None, false);
    let mut chars = row.chars().peekable();
    while let Some(c) = chars.next() {
        match quote {
            Some(_) if escaped => escaped = false,
            Some(_) if c == '\\' => escaped = true,
            Some(q) if c == q => quote = None,
            Some(_) => {}
            None if c == '"' || c == '\'' => quote = Some(c),
            None if c == '-' && chars.peek() == Some(&'-') => break,
            None => {
                out.push(c);
                continue;
            }
        }
        out.push(' ');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nested_keys_are_found_past_strings_and_comments() {
        let text =
            "local x = 1\nreturn f {\n  a = \"} b = 2\", -- } c = 3\n  b = {\n    c = 4,\n  },\n}\nc = 5\n";
        let path = |keys: &[&str]| keys.iter().map(|k| k.to_string()).collect::<Vec<_>>();
        assert_eq!(find_key(text, 2, &path(&["b", "c"])), 5);
        assert_eq!(find_key(text, 2, &path(&["a"])), 3);
        assert_eq!(find_key(text, 2, &path(&["missing"])), 2);
    }
}
