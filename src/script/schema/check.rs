//! Checks values against their declared types, and reports the line of the offending key.

use std::{
    borrow::Cow,
    collections::BTreeSet,
    f64::consts::TAU,
    fmt::Display,
    sync::{Arc, Mutex},
};

use mlua::{Lua, Table, Value};

use super::{Field, FieldDefault, Range, Record, Relation, Type, ValidationError, joined};
use crate::vm::{
    error::{SourceLine, caller_line, current_line, fail_at},
    list::plain,
    source_map::{self, find_key},
    value::{describe, literal, number, sorted_pairs},
};
use softvt_common::{
    parallel::lock,
    text::{MAX_TEXT_BYTES, exact_number, format_number, suggest, unknown_name},
};

/// Numbers whose largest magnitude is smaller have no direction.
pub(crate) const MIN_LENGTH: f64 = 1e-9;

const MAX_KEPT: usize = 100;

/// Messages of `softvt check` about numbers of a virtual machine that are valid and outside of their usual range, each
/// with file and line.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnusualNumbers(Arc<Mutex<BTreeSet<String>>>);

impl UnusualNumbers {
    pub(crate) fn of(lua: &Lua) -> Vec<String> {
        lua.app_data_ref::<Self>().map_or_else(Vec::new, |found| lock(&found.0).iter().cloned().collect())
    }

    fn keep(lua: &Lua, label: &str, found: &ValidationError) {
        let Some(kept) = lua.app_data_ref::<Self>() else { return };
        let place = current_line(lua).map(|line| format!("{}: ", find_key(lua, line, &found.path)));
        let mut kept = lock(&kept.0);
        if kept.len() < MAX_KEPT {
            kept.insert(place.unwrap_or_default() + &found.describe(label));
        }
    }
}

/// Checks values, and collects the unusual numbers in them. Tables of constructors have been checked before.
pub(crate) struct Checker<'a> {
    lua: &'a Lua,
    /// Keys of the value that is checked, from the outermost table inwards.
    path: Vec<Cow<'static, str>>,
    pub unusual: Vec<ValidationError>,
}

/// Checks a value; messages about its unusual numbers are kept and name it `label`.
pub(crate) fn checked<T>(
    lua: &Lua,
    label: &str,
    check: impl FnOnce(&mut Checker<'_>) -> Result<T, ValidationError>,
) -> Result<T, ValidationError> {
    let mut checker = Checker::new(lua);
    let value = check(&mut checker)?;
    checker.unusual.iter().for_each(|found| UnusualNumbers::keep(lua, label, found));
    Ok(value)
}

impl<'a> Checker<'a> {
    pub(crate) fn new(lua: &'a Lua) -> Self {
        Self { lua, path: Vec::new(), unusual: Vec::new() }
    }

    /// Checks `value` and returns it as it is stored: numbers converted, lists of the host as plain tables, nested
    /// tables as copies with their defaults.
    pub(crate) fn value(&mut self, ty: &Type, value: &Value) -> Result<Value, ValidationError> {
        let value = &plain(self.lua, value)?;
        if let Value::String(text) = value
            && text.to_str().is_err()
        {
            return Err(mismatch!("expected UTF-8 text, got {}", describe(value)));
        }
        let wrong = || ty.mismatch(value);
        let kept = |accepted: bool| if accepted { Ok(value.clone()) } else { Err(wrong()) };
        match (ty, value) {
            (Type::Number(unit, range), _) => {
                let number = number(value).filter(|n| range.contains(*n)).ok_or_else(wrong)?;
                self.note_unusual(unit, *range, &[number]);
                Ok(Value::Number(number))
            }
            (Type::Integer(range), _) => {
                let number = whole(value).filter(|n| range.contains(*n as f64)).ok_or_else(wrong)?;
                self.note_unusual("", *range, &[number as f64]);
                Ok(Value::Integer(number))
            }
            (Type::Text, Value::String(text)) if text.as_bytes().len() > MAX_TEXT_BYTES => {
                Err(mismatch!("expected a text of at most {MAX_TEXT_BYTES} bytes, got {}", describe(value)))
            }
            (Type::Text, Value::String(text)) => kept(!text.as_bytes().is_empty()),
            (Type::Name, Value::String(text)) => kept(is_name(&text.to_string_lossy())),
            (Type::Line, Value::String(_)) | (Type::Table(_), Value::Table(_)) => kept(true),
            (Type::Boolean, Value::Boolean(_)) | (Type::Function(_), Value::Function(_)) => kept(true),
            (Type::Any, value) => kept(!value.is_nil()),
            (Type::Choice(names) | Type::Direction(names, _), Value::String(text)) => {
                let text = text.to_string_lossy();
                match suggest(&text, names.iter().copied()) {
                    _ if names.contains(&text.as_str()) => kept(true),
                    Some(close) => Err(mismatch!("{}; did you mean {close:?}?", wrong().message)),
                    None => Err(wrong()),
                }
            }
            (Type::Vector(count, unit, range), Value::Table(list)) => {
                self.numbers(ty, list, *count, unit, *range)
            }
            (Type::Interval(unit, range), Value::Table(list)) => self.numbers(ty, list, 2, unit, *range),
            (Type::Direction(..), Value::Table(list)) => self.numbers(ty, list, 3, "", Range::ANY),
            (Type::Quaternion(_), Value::Table(list)) => self.numbers(ty, list, 4, "", Range::ANY),
            (Type::List(of), Value::Table(list)) => self.list(ty, of, list),
            (Type::Distinct { of, by, min }, Value::Table(list)) => {
                let checked = self.list(ty, of, list)?;
                refuse_repeated(&checked, by, *min)?;
                Ok(checked)
            }
            (Type::Map(of), Value::Table(map)) => self.map(of, map),
            (Type::Nested(record), Value::Table(table)) => self.record(record, table).map(Value::Table),
            (Type::Constructed(records), Value::Table(table)) => {
                kept(records.iter().any(|record| is_constructed(self.lua, record, table)))
            }
            (Type::Object(class), Value::UserData(object)) => {
                kept(object.type_name().is_ok_and(|name| name.to_string_lossy() == *class))
            }
            (Type::OneOf(types), _) => {
                // An error inside of the value is more helpful than one about the whole value.
                let mut inner = None;
                for ty in *types {
                    let known = self.unusual.len();
                    match self.value(ty, value) {
                        Ok(value) => return Ok(value),
                        Err(error) if !error.path.is_empty() => inner = inner.or(Some(error)),
                        Err(_) => {}
                    }
                    self.unusual.truncate(known);
                }
                Err(inner.unwrap_or_else(wrong))
            }
            _ => Err(wrong()),
        }
    }

    fn inside<T>(
        &mut self,
        key: impl Into<Cow<'static, str>>,
        check: impl FnOnce(&mut Self) -> Result<T, ValidationError>,
    ) -> Result<T, ValidationError> {
        self.path.push(key.into());
        let checked = check(self);
        let key = self.path.pop().unwrap_or_default();
        checked.map_err(|error| error.inside(key))
    }

    /// Notes the first of the numbers that is outside of its usual range.
    fn note_unusual(&mut self, unit: &str, range: Range, numbers: &[f64]) {
        // The unit of a vector may name its frame as well.
        let unit = unit.split(',').next().unwrap_or_default();
        if let Some(message) = numbers.iter().find_map(|number| range.unusual(*number, unit)) {
            let path = self.path.iter().map(|key| key.to_string()).collect();
            self.unusual.push(ValidationError { path, message });
        }
    }

    /// Checks a list of exactly `count` finite numbers in `range`. The error is at the entry or at the list.
    fn numbers(
        &mut self,
        ty: &Type,
        list: &Table,
        count: usize,
        unit: &str,
        range: Range,
    ) -> Result<Value, ValidationError> {
        let entries = list.pairs::<Value, Value>().take(count + 1).count();
        let values = (1..=count).map(|place| list.raw_get::<Value>(place));
        let values: Vec<Value> = values.collect::<mlua::Result<_>>()?;
        if entries != count || values.iter().any(Value::is_nil) {
            let length = list.raw_len();
            let is_list = length > 0 && list.pairs::<Value, Value>().count() == length;
            let got = if is_list { format!("a list of {length}") } else { "a table".to_owned() };
            return Err(mismatch!("expected {}, got {got}", ty.describe()));
        }
        let is_angle = matches!(ty, Type::Vector(..)) && unit.starts_with("rad");
        let checked = values.iter().enumerate().map(|(index, value)| {
            number(value).filter(|number| range.contains(*number)).ok_or_else(|| {
                let hint = if is_angle { "; math.rad converts degrees" } else { "" };
                let ValidationError { message, .. } = Type::Number("", range).mismatch(value);
                mismatch!("{message}{hint}").inside(format!("[{}]", index + 1))
            })
        });
        let numbers: Vec<f64> = checked.collect::<Result<_, _>>()?;
        let has_length = || numbers.iter().any(|number| number.abs() >= MIN_LENGTH);
        let turn = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
        match (ty, &numbers[..]) {
            (Type::Vector(3, ..), _) if is_angle && turn > TAU => {
                let expected = "expected an axis-angle of at most a full turn, 2π rad";
                Err(mismatch!("{expected}, got {} rad; math.rad converts degrees", format_number(turn)))
            }
            (Type::Interval(..), [low, high]) if low > high => {
                let [low, high] = [*low, *high].map(exact_number);
                Err(mismatch!("the lowest value, {low}, is above the highest, {high}; swap them"))
            }
            (Type::Direction(..), _) if !has_length() => {
                Err(mismatch!("expected a direction, got one of length 0"))
            }
            (Type::Quaternion(_), _) if !has_length() => {
                Err(mismatch!("expected a quaternion, got one of length 0"))
            }
            _ => {
                self.note_unusual(unit, range, &numbers);
                Ok(Value::Table(self.lua.create_sequence_from(numbers)?))
            }
        }
    }

    fn list(&mut self, ty: &Type, of: &Type, list: &Table) -> Result<Value, ValidationError> {
        let (out, count) = (self.lua.create_table()?, list.raw_len());
        if list.pairs::<Value, Value>().count() != count {
            return Err(ty.mismatch(&Value::Table(list.clone())));
        }
        for index in 1..=count {
            let value: Value = list.raw_get(index)?;
            out.raw_set(index, self.inside(format!("[{index}]"), |checker| checker.value(of, &value))?)?;
        }
        Ok(Value::Table(out))
    }

    fn map(&mut self, of: &Type, map: &Table) -> Result<Value, ValidationError> {
        let out = self.lua.create_table()?;
        for (key, value) in sorted_pairs(map) {
            let Value::String(name) = &key else {
                return Err(mismatch!("expected names as keys, got {}", describe(&key)));
            };
            out.raw_set(name, self.inside(name.to_string_lossy(), |checker| checker.value(of, &value))?)?;
        }
        Ok(Value::Table(out))
    }

    /// Returns a copy of `table` with every field checked and every default filled in.
    pub(crate) fn record(&mut self, record: &Record, table: &Table) -> Result<Table, ValidationError> {
        for (key, _) in sorted_pairs(table) {
            match key.as_string().map(|name| name.to_string_lossy()) {
                Some(name) if record.names().any(|field| field == name) => {}
                Some(name) => return Err(ValidationError::new(unknown_name("key", &name, record.names()))),
                None => {
                    let (key, keys) = (describe(&key), joined(record));
                    return Err(mismatch!("unexpected entry [{key}]; the keys are {keys}"));
                }
            }
        }
        let out = self.lua.create_table()?;
        for field in record.fields {
            let given: Value = table.raw_get(field.name)?;
            let value = self.inside(field.name, |checker| match given {
                Value::Nil => checker.absent(record, table, field),
                given => checker.value(&field.ty, &given),
            });
            out.raw_set(field.name, value?)?;
        }
        if let Some(relation) = &record.relation {
            relation.check(&out)?;
        }
        Ok(out)
    }

    /// The value of a field that is not given. The error about a required one names all that `table` lacks.
    fn absent(&mut self, record: &Record, table: &Table, field: &Field) -> Result<Value, ValidationError> {
        Ok(match field.presence {
            FieldDefault::Required => {
                let is_missing = |other: &&Field| {
                    other.presence == FieldDefault::Required
                        && other.name != field.name
                        && matches!(table.raw_get(other.name), Ok(Value::Nil))
                };
                let others: Vec<_> =
                    record.fields.iter().filter(is_missing).map(|other| other.name).collect();
                let also = match others.len() {
                    0 => String::new(),
                    1 => format!(", as is {}", others[0]),
                    _ => format!(", as are {}", others.join(", ")),
                };
                return Err(mismatch!("missing{also}; expected {}", field.ty.describe()));
            }
            FieldDefault::Optional => Value::Nil,
            FieldDefault::Number(n) => Value::Number(n),
            FieldDefault::Integer(n) => Value::Integer(n),
            FieldDefault::Boolean(flag) => Value::Boolean(flag),
            FieldDefault::Text(text) => Value::String(self.lua.create_string(text)?),
            FieldDefault::Empty => self.value(&field.ty, &Value::Table(self.lua.create_table()?))?,
        })
    }
}

impl Type {
    /// Checks a value as [`Checker::value`] does, without notes of its unusual numbers.
    pub(crate) fn check(&self, lua: &Lua, value: &Value) -> Result<Value, ValidationError> {
        Checker::new(lua).value(self, value)
    }

    /// The error of a value that is not of this type.
    fn mismatch(&self, value: &Value) -> ValidationError {
        let expected = self.describe();
        match (self, number(value)) {
            (Self::Number(unit, range), Some(number)) => {
                let hint = if *unit == "rad" { "; math.rad converts degrees" } else { "" };
                let got = if number.is_finite() { range.show_outside(number) } else { describe(value) };
                mismatch!("expected {expected}, got {got}{hint}")
            }
            (Self::Function(_), _) if let Some(name) = maker_name(value) => {
                mismatch!("expected {expected}, got {name}, which makes one; call it: {name} {{ … }}")
            }
            _ => mismatch!("expected {expected}, got {}", describe(value)),
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
            let repeated = mismatch!("{} is there already; give each once", describe(&key));
            return Err(repeated.inside(format!("[{count}]")));
        }
    }
    if count < min { Err(mismatch!("expected at least {min}, got {count}")) } else { Ok(()) }
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
                return Err(mismatch!("expected {expected} {before}, {low}, got {high}").inside(*field));
            }
        }
        Ok(())
    }
}

/// Checks a table that a script gave for `record`; the error is at the line of the wrong key.
pub(crate) fn validate(lua: &Lua, record: &'static Record, value: &Value) -> mlua::Result<Table> {
    let label = record.label;
    match plain(lua, value)? {
        Value::Table(table) => checked(lua, label, |checker| checker.record(record, &table))
            .map_err(|error| error_at_key(lua, label, &error)),
        other => {
            let (keys, got) = (joined(record), describe(&other));
            Err(fail!(lua, "{label}: expected a table of {keys}, got {got}"))
        }
    }
}

/// The constructor of `record`: checks a table and marks it, so that it also refuses to be read by unknown keys.
pub(crate) fn make(lua: &Lua, record: &'static Record, value: &Value) -> mlua::Result<Table> {
    let made = validate(lua, record, value)?;
    if let Some(Relation::Checked(check)) = record.relation {
        check(lua, &made).map_err(|error| error_at_key(lua, record.label, &error))?;
    }
    made.set_metatable(Some(metatable(lua, record)?))?;
    source_map::record_origin(lua, &made)?;
    Ok(made)
}

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
            Err(fail!(lua, "{}: {message}", record.label))
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
    fail_at(lua, call.map(|call| find_key(lua, call, &error.path)), error.describe(label))
}

/// The error of a script about the field `key` of the table `label`, for what a single field's type does not express.
pub(crate) fn invalid(lua: &Lua, label: &str, key: &str, message: impl Display) -> mlua::Error {
    error_at_key(lua, label, &ValidationError::new(message).inside(key))
}
