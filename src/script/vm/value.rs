//! Lua values in messages, and order that does not depend on hashes.

use std::collections::BTreeSet;

use mlua::{Table, Value};

use softvt_common::text::format_number;

/// A text in quotes, with control characters escaped and a long text cut off.
fn quoted(text: &str) -> String {
    const MAX_CHARS: usize = 60;
    if text.chars().count() <= MAX_CHARS {
        return format!("{text:?}");
    }
    let start: String = text.chars().take(MAX_CHARS).collect();
    format!("{start:?}… ({} bytes)", text.len())
}

/// An offending value in a message.
pub(crate) fn describe(value: &Value) -> String {
    match value {
        Value::String(text) => quoted(&text.to_string_lossy()),
        Value::Integer(number) => number.to_string(),
        Value::Number(number) if !number.is_finite() => {
            format!("{}, which is not a finite number", format_number(*number))
        }
        Value::Number(number) => format_number(*number),
        Value::Boolean(flag) => flag.to_string(),
        Value::Nil => "nil".into(),
        other => kind(other),
    }
}

/// The same, with the constructor of a table that a constructor made.
pub(crate) fn describe_constructed(value: &Value) -> String {
    let made = value.as_table().and_then(|table| table.metatable());
    match made.and_then(|meta| meta.get::<Option<String>>("__name").ok().flatten()) {
        Some(name) => format!("{name}{{…}}"),
        None => describe(value),
    }
}

/// `a table`; for an object of the host its class: `a softvt.Pose`.
fn kind(value: &Value) -> String {
    match value {
        Value::UserData(object) => match object.type_name() {
            Ok(name) => format!("a {}", name.to_string_lossy()),
            Err(_) => "an object".into(),
        },
        other => format!("a {}", other.type_name()),
    }
}

pub(crate) fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Integer(n) => Some(*n as f64),
        Value::Number(n) => Some(*n),
        _ => None,
    }
}

/// A measured number for scripts; nil if it is not finite.
pub(crate) fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

/// The entries of a table: integer keys, then strings, then the rest.
pub(crate) fn sorted_pairs(table: &Table) -> Vec<(Value, Value)> {
    let mut entries: Vec<_> = table.pairs::<Value, Value>().flatten().collect();
    entries.sort_by_key(|(key, _)| match key {
        Value::Integer(n) => (0, *n, String::new()),
        Value::String(text) => (1, 0, text.to_string_lossy()),
        other => (2, 0, describe(other)),
    });
    entries
}

/// A short text of a value as a Lua constant, with sorted keys and without addresses.
pub(crate) fn literal(value: &Value, depth: usize) -> String {
    match value {
        Value::String(text) => format!("{:?}", text.to_string_lossy()),
        Value::Integer(number) => number.to_string(),
        Value::Number(number) => number.to_string(),
        Value::Boolean(flag) => flag.to_string(),
        Value::Table(table) if depth < 2 => {
            let mut entries = BTreeSet::new();
            let mut list = Vec::new();
            for (key, value) in table.pairs::<Value, Value>().flatten().take(64) {
                let value = literal(&value, depth + 1);
                match key {
                    Value::Integer(index) if index >= 1 => list.push((index, value)),
                    Value::String(key) => {
                        entries.insert(format!("{} = {value}", key.to_string_lossy()));
                    }
                    _ => {}
                }
            }
            list.sort();
            let parts = list.into_iter().map(|(_, text)| text).chain(entries).take(8);
            format!("{{{}}}", parts.collect::<Vec<_>>().join(", "))
        }
        Value::Nil => "nil".into(),
        other => kind(other),
    }
}
