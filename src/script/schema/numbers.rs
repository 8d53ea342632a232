//! Lists of so many numbers: which of them is wrong, and how.

use mlua::{Lua, Table, Value};

use crate::script::{
    schema::range::Range,
    schema::{Fault, got, number},
};

/// `list` as a plain list of `count` finite numbers in `range`; `wrong` says what is expected of the whole.
///
/// # Errors
/// At the entry that is no such number; at the list itself if it has not `count` entries.
pub(crate) fn check(
    lua: &Lua,
    list: &Table,
    (count, range): (usize, Range),
    wrong: &dyn Fn() -> Fault,
) -> Result<Value, Fault> {
    let entries: Vec<Value> =
        list.pairs::<Value, Value>().take(count + 1).flatten().map(|(_, v)| v).collect();
    let values = (1..=count).map(|place| list.raw_get::<Value>(place));
    let values: Vec<Value> = values.collect::<mlua::Result<_>>().map_err(|e| Fault::new(e.to_string()))?;
    if entries.len() != count || values.iter().any(Value::is_nil) {
        return Err(counted(list, wrong()));
    }
    let checked = values.iter().enumerate().map(|(index, value)| {
        entry(value, range).map_err(|message| Fault::new(message).inside(format!("[{}]", index + 1)))
    });
    let numbers: Vec<f64> = checked.collect::<Result<_, _>>()?;
    lua.create_sequence_from(numbers).map(Value::Table).map_err(|e| Fault::new(e.to_string()))
}

/// `a list of 2` for `a table`, where it is one.
fn counted(list: &Table, fault: Fault) -> Fault {
    let length = list.raw_len();
    let plain = length > 0 && list.pairs::<Value, Value>().count() == length;
    match fault.message.strip_suffix(&got(&Value::Table(list.clone()))).filter(|_| plain) {
        Some(before) => Fault { message: format!("{before}a list of {length}"), ..fault },
        None => fault,
    }
}

/// One entry; the message is a fragment.
///
/// # Errors
/// What was expected instead.
pub(crate) fn entry(value: &Value, range: Range) -> Result<f64, String> {
    match number(value) {
        Some(number) if range.holds(number) => Ok(number),
        _ => Err(format!("expected a number{}, got {}", range.words(), got(value))),
    }
}
