//! Checks values against their declared types, and reports the line of the offending key.

use std::{collections::BTreeSet, f64::consts::TAU};

use mlua::{Lua, Table, Value};

use super::{Field, FieldDefault, Range, Record, Relation, Type, ValidationError, joined, note_unusual};
use crate::vm::{
    error::{SourceLine, caller_line, current_line, fail, fail_at},
    list::plain,
    source_map,
    value::{describe, literal, number, sorted_pairs},
};
use softvt_common::text::{MAX_TEXT_BYTES, exact_number, format_number, suggest, unknown_name};

/// Numbers whose largest magnitude is smaller have no direction.
pub(crate) const MIN_LENGTH: f64 = 1e-9;

impl Type {
    /// Checks `value` and returns it as it is stored: numbers converted, lists of the host as plain tables, nested
    /// tables as copies with their defaults.
    pub(crate) fn check(&self, lua: &Lua, value: &Value) -> Result<Value, ValidationError> {
        let value = &plain(lua, value)?;
        if let Value::String(text) = value
            && text.to_str().is_err()
        {
            return Err(ValidationError::new(format!("expected UTF-8 text, got {}", describe(value))));
        }
        let wrong = || {
            let error = self.expected(&self.describe_wrong(value));
            match (self, number(value)) {
                (Self::Number("rad", _), Some(_)) => {
                    ValidationError::new(format!("{}; math.rad converts degrees", error.message))
                }
                (Self::Function(_), _) if let Some(name) = maker_name(value) => {
                    self.expected(&format!("{name}, which makes one; call it: {name} {{ … }}"))
                }
                _ => error,
            }
        };
        let kept = |accepted: bool| if accepted { Ok(value.clone()) } else { Err(wrong()) };
        match (self, value) {
            (Self::Number(_, range), _) => {
                number(value).filter(|n| range.contains(*n)).map(Value::Number).ok_or_else(wrong)
            }
            (Self::Integer(range), _) => {
                whole(value).filter(|n| range.contains(*n as f64)).map(Value::Integer).ok_or_else(wrong)
            }
            (Self::Text, Value::String(text)) if text.as_bytes().len() > MAX_TEXT_BYTES => {
                let message =
                    format!("expected a text of at most {MAX_TEXT_BYTES} bytes, got {}", describe(value));
                Err(ValidationError::new(message))
            }
            (Self::Text, Value::String(text)) => kept(!text.as_bytes().is_empty()),
            (Self::Name, Value::String(text)) => kept(is_name(&text.to_string_lossy())),
            (Self::Line, Value::String(_)) | (Self::Table(_), Value::Table(_)) => kept(true),
            (Self::Boolean, Value::Boolean(_)) | (Self::Function(_), Value::Function(_)) => kept(true),
            (Self::Any, value) => kept(!value.is_nil()),
            (Self::Choice(names) | Self::Direction(names, _), Value::String(text)) => {
                let text = text.to_string_lossy();
                match suggest(&text, names.iter().copied()) {
                    _ if names.contains(&text.as_str()) => kept(true),
                    Some(close) => {
                        Err(ValidationError::new(format!("{}; did you mean {close:?}?", wrong().message)))
                    }
                    None => Err(wrong()),
                }
            }
            (Self::Vector(count, unit, range), Value::Table(list)) => {
                let (list, numbers) = self.check_numbers(lua, list, *count, *range)?;
                let turn = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
                if *count == 3 && unit.starts_with("rad") && turn > TAU {
                    let expected = "expected an axis-angle of at most a full turn, 2π rad";
                    let got = format_number(turn);
                    return Err(ValidationError::new(format!(
                        "{expected}, got {got} rad; math.rad converts degrees"
                    )));
                }
                Ok(list)
            }
            (Self::Interval(_, range), Value::Table(list)) => {
                let (list, numbers) = self.check_numbers(lua, list, 2, *range)?;
                match numbers[..] {
                    [low, high] if low > high => {
                        let [low, high] = [low, high].map(exact_number);
                        let message =
                            format!("the lowest value, {low}, is above the highest, {high}; swap them");
                        Err(ValidationError::new(message))
                    }
                    _ => Ok(list),
                }
            }
            (Self::Direction(..), Value::Table(list)) => self.check_length(lua, list, 3, "a direction"),
            (Self::Quaternion(_), Value::Table(list)) => self.check_length(lua, list, 4, "a quaternion"),
            (Self::List(of), Value::Table(list)) => check_list(lua, of, list, &wrong),
            (Self::Distinct { of, by, min }, Value::Table(list)) => {
                let checked = check_list(lua, of, list, &wrong)?;
                refuse_repeated(&checked, by, *min)?;
                Ok(checked)
            }
            (Self::Map(of), Value::Table(map)) => check_map(lua, of, map),
            (Self::Nested(record), Value::Table(table)) => check(lua, record, table).map(Value::Table),
            (Self::Constructed(records), Value::Table(table)) => {
                kept(records.iter().any(|record| is_constructed(lua, record, table)))
            }
            (Self::Object(class), Value::UserData(object)) => {
                kept(object.type_name().is_ok_and(|name| name.to_string_lossy() == *class))
            }
            (Self::OneOf(types), _) => {
                // An error inside of the value is more helpful than one about the whole value.
                let mut inner = None;
                for ty in *types {
                    match ty.check(lua, value) {
                        Ok(value) => return Ok(value),
                        Err(error) if !error.path.is_empty() => inner = inner.or(Some(error)),
                        Err(_) => {}
                    }
                }
                Err(inner.unwrap_or_else(wrong))
            }
            _ => Err(wrong()),
        }
    }

    /// A value that the type refuses, in words.
    fn describe_wrong(&self, value: &Value) -> String {
        match (self, number(value)) {
            (Self::Number(_, range), Some(number)) if number.is_finite() => range.show_outside(number),
            _ => describe(value),
        }
    }

    fn expected(&self, got: &str) -> ValidationError {
        ValidationError::new(format!("expected {}, got {got}", self.describe()))
    }

    /// Checks a list of exactly `count` finite numbers in `range`. The error is at the wrong entry, or at the list
    /// itself if its length is wrong.
    fn check_numbers(
        &self,
        lua: &Lua,
        list: &Table,
        count: usize,
        range: Range,
    ) -> Result<(Value, Vec<f64>), ValidationError> {
        let entries = list.pairs::<Value, Value>().take(count + 1).count();
        let values = (1..=count).map(|place| list.raw_get::<Value>(place));
        let values: Vec<Value> = values.collect::<mlua::Result<_>>()?;
        if entries != count || values.iter().any(Value::is_nil) {
            let length = list.raw_len();
            let is_list = length > 0 && list.pairs::<Value, Value>().count() == length;
            let got = if is_list { format!("a list of {length}") } else { "a table".to_owned() };
            return Err(self.expected(&got));
        }
        let checked = values.iter().enumerate().map(|(index, value)| {
            let number = number(value).filter(|number| range.contains(*number));
            number.ok_or_else(|| {
                let is_angle = matches!(self, Self::Vector(_, unit, _) if unit.starts_with("rad"));
                let hint = if is_angle { "; math.rad converts degrees" } else { "" };
                let got = Self::Number("", range).describe_wrong(value);
                let message = format!("expected a number{}, got {got}{hint}", range.describe());
                ValidationError::new(message).inside(format!("[{}]", index + 1))
            })
        });
        let numbers: Vec<f64> = checked.collect::<Result<_, _>>()?;
        Ok((Value::Table(lua.create_sequence_from(numbers.iter().copied())?), numbers))
    }

    /// The same for numbers of any size that are not all 0.
    fn check_length(
        &self,
        lua: &Lua,
        list: &Table,
        count: usize,
        what: &str,
    ) -> Result<Value, ValidationError> {
        let (list, numbers) = self.check_numbers(lua, list, count, Range::ANY)?;
        match numbers.iter().any(|number| number.abs() >= MIN_LENGTH) {
            true => Ok(list),
            false => Err(ValidationError::new(format!("expected {what}, got one of length 0"))),
        }
    }
}

/// Name of a table that is called to make a value, such as `experts.pick_place`: the `__name` of its metatable.
fn maker_name(value: &Value) -> Option<String> {
    let meta = value.as_table()?.metatable()?;
    let is_called = meta.raw_get::<Value>("__call").is_ok_and(|call| call.is_function());
    meta.raw_get::<Option<String>>("__name").ok()?.filter(|_| is_called)
}

/// True if a text can be part of a path and of a line without harm.
fn is_name(text: &str) -> bool {
    let fits = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
    (1..=100).contains(&text.len()) && text.chars().all(fits)
}

fn whole(value: &Value) -> Option<i64> {
    match value {
        Value::Integer(n) => Some(*n),
        Value::Number(n) if n.fract() == 0.0 && n.abs() < 9e15 => Some(*n as i64),
        _ => None,
    }
}

fn check_list(
    lua: &Lua,
    of: &Type,
    list: &Table,
    wrong: &dyn Fn() -> ValidationError,
) -> Result<Value, ValidationError> {
    let out = lua.create_table()?;
    let count = list.raw_len();
    if list.pairs::<Value, Value>().count() != count {
        return Err(wrong());
    }
    for index in 1..=count {
        let value: Value = list.raw_get(index)?;
        let value = of.check(lua, &value).map_err(|error| error.inside(format!("[{index}]")))?;
        out.raw_set(index, value)?;
    }
    Ok(Value::Table(out))
}

/// Refuses a list with too few values, or with two texts, numbers or booleans that are the same in the field `by`.
fn refuse_repeated(list: &Value, by: &str, min: usize) -> Result<(), ValidationError> {
    let values = list.as_table().into_iter().flat_map(|list| list.sequence_values::<Value>()).flatten();
    let mut seen = BTreeSet::new();
    let mut count = 0;
    for value in values {
        count += 1;
        let key = match &value {
            Value::Table(table) if !by.is_empty() => table.raw_get(by)?,
            _ => value,
        };
        if !key.is_table() && !seen.insert(literal(&key, 0)) {
            let repeated =
                ValidationError::new(format!("{} is there already; give each once", describe(&key)));
            return Err(repeated.inside(format!("[{count}]")));
        }
    }
    match count < min {
        true => Err(ValidationError::new(format!("expected at least {min}, got {count}"))),
        false => Ok(()),
    }
}

fn check_map(lua: &Lua, of: &Type, map: &Table) -> Result<Value, ValidationError> {
    let out = lua.create_table()?;
    for (key, value) in sorted_pairs(map) {
        let Value::String(name) = &key else {
            return Err(ValidationError::new(format!("expected names as keys, got {}", describe(&key))));
        };
        let name = name.to_string_lossy();
        let value = of.check(lua, &value).map_err(|error| error.inside(name.clone()))?;
        out.raw_set(name, value)?;
    }
    Ok(Value::Table(out))
}

/// Returns a copy of `table` with every field checked and every default filled in.
pub(crate) fn check(lua: &Lua, record: &Record, table: &Table) -> Result<Table, ValidationError> {
    for (key, _) in sorted_pairs(table) {
        match &key {
            Value::String(name) if record.names().any(|field| field == name.to_string_lossy()) => {}
            Value::String(name) => {
                return Err(ValidationError::new(unknown_name(
                    "key",
                    &name.to_string_lossy(),
                    record.names(),
                )));
            }
            other => {
                let message =
                    format!("unexpected entry [{}]; the keys are {}", describe(other), joined(record));
                return Err(ValidationError::new(message));
            }
        }
    }
    let out = lua.create_table()?;
    for field in record.fields {
        let value = match table.raw_get(field.name)? {
            Value::Nil => absent(lua, record, table, field),
            value => field.ty.check(lua, &value),
        };
        out.raw_set(field.name, value.map_err(|error| error.inside(field.name))?)?;
    }
    if let Some(relation) = &record.relation {
        relation.check(&out)?;
    }
    Ok(out)
}

impl Relation {
    /// Checks the order of numbers in a table whose fields are valid.
    fn check(&self, table: &Table) -> Result<(), ValidationError> {
        let (fields, expected) = match self {
            Self::Increasing(fields) => (fields, "more than"),
            Self::NotDecreasing(fields) => (fields, "at least"),
            Self::Checked(_) => return Ok(()),
        };
        let given = fields.iter().map(|field| Ok((*field, table.raw_get::<Option<f64>>(*field)?)));
        let given = given.collect::<mlua::Result<Vec<_>>>()?;
        let given: Vec<_> = given.into_iter().filter_map(|(field, value)| Some((field, value?))).collect();
        for pair in given.windows(2) {
            let [(before, low), (field, high)] = pair else { continue };
            if low > high || (low == high && matches!(self, Self::Increasing(_))) {
                let [low, high] = [*low, *high].map(exact_number);
                let message = format!("expected {expected} {before}, {low}, got {high}");
                return Err(ValidationError::new(message).inside(*field));
            }
        }
        Ok(())
    }
}

/// The value of a field that is not given. The error about a required one names all that `table` lacks.
fn absent(lua: &Lua, record: &Record, table: &Table, field: &Field) -> Result<Value, ValidationError> {
    Ok(match field.presence {
        FieldDefault::Required => {
            let is_missing = |other: &&Field| {
                other.presence == FieldDefault::Required
                    && other.name != field.name
                    && matches!(table.raw_get(other.name), Ok(Value::Nil))
            };
            let others: Vec<_> = record.fields.iter().filter(is_missing).map(|other| other.name).collect();
            let also = match others.is_empty() {
                true => String::new(),
                false => {
                    format!(", as {} {}", if others.len() == 1 { "is" } else { "are" }, others.join(", "))
                }
            };
            return Err(ValidationError::new(format!("missing{also}; expected {}", field.ty.describe())));
        }
        FieldDefault::Optional => Value::Nil,
        FieldDefault::Number(n) => Value::Number(n),
        FieldDefault::Integer(n) => Value::Integer(n),
        FieldDefault::Boolean(flag) => Value::Boolean(flag),
        FieldDefault::Text(text) => Value::String(lua.create_string(text)?),
        FieldDefault::Empty => field.ty.check(lua, &Value::Table(lua.create_table()?))?,
    })
}

/// Checks a table that a script gave for `record`; the error is at the line of the wrong key.
pub(crate) fn validate(lua: &Lua, record: &'static Record, value: &Value) -> mlua::Result<Table> {
    match plain(lua, value)? {
        Value::Table(table) => {
            let checked = check(lua, record, &table);
            let checked = checked.map_err(|error| error_at_key(lua, record.label, &error))?;
            note_unusual(lua, record.label, &Type::Nested(record), &Value::Table(checked.clone()));
            Ok(checked)
        }
        other => {
            let message =
                format!("{}: expected a table of {}, got {}", record.label, joined(record), describe(&other));
            Err(fail(lua, message))
        }
    }
}

/// The constructor of `record`: checks a table and marks it, so that it also refuses to be read by unknown keys.
pub(crate) fn make(lua: &Lua, record: &'static Record, value: &Value) -> mlua::Result<Table> {
    let made = validate(lua, record, value)?;
    if let Some(Relation::Checked(check)) = record.relation {
        check(lua, record, &made)?;
    }
    made.set_metatable(Some(metatable(lua, record)?))?;
    source_map::record_origin(lua, &made)?;
    Ok(made)
}

/// True if the constructor of `record` made `table`.
pub(crate) fn is_constructed(lua: &Lua, record: &Record, table: &Table) -> bool {
    let own = lua.named_registry_value::<Table>(record.kind);
    own.is_ok_and(|own| table.metatable().is_some_and(|meta| meta.to_pointer() == own.to_pointer()))
}

fn metatable(lua: &Lua, record: &'static Record) -> mlua::Result<Table> {
    if let Ok(existing) = lua.named_registry_value::<Table>(record.kind) {
        return Ok(existing);
    }
    let meta = lua.create_table()?;
    meta.set("__name", record.kind)?;
    meta.set("__metatable", record.kind)?;
    meta.set("__tostring", lua.create_function(|_, _: Value| Ok(record.kind))?)?;
    let read = lua.create_function(|lua, (_, key): (Value, Value)| match &key {
        Value::String(name) if !record.names().any(|field| field == name.to_string_lossy()) => {
            let message = unknown_name("key", &name.to_string_lossy(), record.names());
            Err(fail(lua, format!("{}: {message}", record.label)))
        }
        _ => Ok(Value::Nil),
    })?;
    meta.set("__index", read)?;
    lua.set_named_registry_value(record.kind, &meta)?;
    Ok(meta)
}

/// The error of a script at the line of the offending key, as far as the source text shows it.
pub(crate) fn error_at_key(lua: &Lua, label: &str, error: &ValidationError) -> mlua::Error {
    error_at(lua, current_line(lua), label, error)
}

/// The error of a function of a script about a table that it was given, at the line of the file
/// that called the function.
pub(crate) fn error_of_caller(lua: &Lua, label: &str, error: &ValidationError) -> mlua::Error {
    error_at(lua, caller_line(lua), label, error)
}

fn error_at(lua: &Lua, call: Option<SourceLine>, label: &str, error: &ValidationError) -> mlua::Error {
    fail_at(lua, call.map(|call| source_map::find_key(lua, call, &error.path)), error.describe(label))
}

/// The error of a script about the field `key` of the table `label`, for what a single field's type does not express.
pub(crate) fn invalid(lua: &Lua, label: &str, key: &str, message: impl Into<String>) -> mlua::Error {
    error_at_key(lua, label, &ValidationError::new(message).inside(key))
}
