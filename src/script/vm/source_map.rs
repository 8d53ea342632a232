//! Lines for messages about tables.
//!
//! Lua knows the line of a running call. The line of a single key, and the origin of a table whose call is over, are
//! recovered here: by a note at every constructor call, and by a search in the source text.

use std::{
    fmt::Display,
    sync::{Arc, Mutex},
};

use mlua::{Lua, Table};

use super::{
    error::{SourceLine, app_data, current_line, fail_at},
    library::Library,
    weak_table,
};
use softvt_common::parallel::lock;

/// Registry key of the weak table from constructed tables to `file:line`.
const ORIGINS: &str = "softvt origins";

/// Notes that the running call of the script makes `table`.
pub(crate) fn record_origin(lua: &Lua, table: &Table) -> mlua::Result<()> {
    let Some(line) = current_line(lua) else { return Ok(()) };
    weak_table(lua, ORIGINS)?.raw_set(table, line.to_string())
}

/// Line of the key at `path` in the call that made `table`, or of that call.
pub(crate) fn origin_of_key(lua: &Lua, table: &Table, path: &[&str]) -> Option<SourceLine> {
    let origins = lua.named_registry_value::<Table>(ORIGINS).ok()?;
    let origin: String = origins.raw_get::<Option<String>>(table).ok()??;
    let (file, line) = origin.rsplit_once(':')?;
    Some(find_key(lua, SourceLine { file: file.to_owned(), line: line.parse().ok()? }, path))
}

/// An error at the line of `key` in the call that made `table`.
pub(crate) fn fail_at_key(lua: &Lua, table: &Table, key: &str, message: impl Display) -> mlua::Error {
    fail_at(lua, origin_of_key(lua, table, &[key]).or_else(|| current_line(lua)), message)
}

/// The line of the key at `path` in the table of the call on `call`, or that line.
pub(crate) fn find_key(lua: &Lua, call: SourceLine, path: &[impl AsRef<str>]) -> SourceLine {
    let library = app_data::<Arc<Mutex<Library>>>(lua).ok();
    match library.and_then(|library| lock(&library).text(&call.file).ok()) {
        Some(text) => SourceLine { line: find_key_in_text(&text, call.line, path), ..call },
        None => call,
    }
}

/// The line of the last key of `path` that the table opening on or after `line` has; `line` if it has none.
fn find_key_in_text(text: &str, line: usize, path: &[impl AsRef<str>]) -> usize {
    let mut keys = path.iter().map(AsRef::as_ref).filter(|key: &&str| !key.starts_with('[')).peekable();
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
                && rest.strip_prefix(*key).is_some_and(is_assignment)
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
        assert_eq!(find_key_in_text(text, 2, &["b", "c"]), 5);
        assert_eq!(find_key_in_text(text, 2, &["a"]), 3);
        assert_eq!(find_key_in_text(text, 2, &["missing"]), 2);
    }
}
