//! Strict tables: what a table of the Lua surface may hold, said once and used for checking, stubs and reference.

pub(crate) mod numbers;
pub(crate) mod range;
pub(crate) mod userdata;

use mlua::{Lua, Table, Value};

pub use crate::script::schema::range::Range;
use crate::script::{
    vm::list as lists,
    vm::origin,
    vm::{fail, here},
};
use crate::text;

/// What a value may be.
#[derive(Clone, Copy, Debug)]
pub enum Type {
    /// A finite number in a unit ("" for none).
    Number(&'static str, Range),
    /// A whole number.
    Integer(Range),
    /// A string, not empty.
    Text,
    /// Any string.
    Line,
    /// A string that may name a file.
    Name,
    /// `true` or `false`.
    Boolean,
    /// A list of so many numbers in a unit.
    Vector(usize, &'static str),
    /// A list of three numbers in 0..1, linear RGB.
    Colour,
    /// One of these strings.
    Choice(&'static [&'static str]),
    /// A function, with its signature as LuaCATS writes it.
    Function(&'static str),
    /// A list.
    List(&'static Type),
    /// A table from strings.
    Map(&'static Type),
    /// A plain table, checked in place.
    Nested(&'static Record),
    /// A table made by the constructor of one of these records.
    Made(&'static [&'static Record]),
    /// A table that is checked elsewhere, as LuaCATS writes it.
    Table(&'static str),
    /// An object of the host, by class name.
    Object(&'static str),
    /// The first of these that fits.
    OneOf(&'static [Type]),
    /// Anything.
    Any,
}

/// What holds when a field is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Presence {
    /// It may not be left out.
    Required,
    /// Nothing.
    Optional,
    /// This number.
    Number(f64),
    /// This whole number.
    Integer(i64),
    /// This string.
    Text(&'static str),
    /// This flag.
    Boolean(bool),
    /// A table with its own defaults.
    Empty,
}

/// A field of a record.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Its key.
    pub name: &'static str,
    /// What it may be.
    pub ty: Type,
    /// What holds when it is left out.
    pub presence: Presence,
    /// One or two sentences.
    pub doc: &'static str,
}

/// A kind of table.
#[derive(Clone, Copy, Debug)]
pub struct Record {
    /// How messages name it: `task.goal`.
    pub label: &'static str,
    /// Class name in stubs: `softvt.Goal`.
    pub class: &'static str,
    /// Registry key of its metatable, unique.
    pub kind: &'static str,
    /// One or two sentences.
    pub doc: &'static str,
    /// What it may hold.
    pub fields: &'static [Field],
}

/// What is wrong with a value, and where in the table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Keys from the outermost table inwards.
    pub path: Vec<String>,
    /// A lower-case fragment.
    pub message: String,
}

impl Fault {
    pub(crate) fn new(message: String) -> Self {
        Self { path: Vec::new(), message }
    }

    pub(crate) fn inside(mut self, key: impl Into<String>) -> Self {
        self.path.insert(0, key.into());
        self
    }

    /// `task.goal.hold_s: expected …`.
    pub fn words(&self, label: &str) -> String {
        let mut text = label.to_string();
        for key in &self.path {
            if !key.starts_with('[') {
                text.push('.');
            }
            text.push_str(key);
        }
        format!("{text}: {}", self.message)
    }
}

/// `unknown key "promt"; did you mean "prompt"?`
pub fn unknown<'a>(what: &str, word: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    match text::suggest(word, known.clone()) {
        Some(close) => format!("unknown {what} {word:?}; did you mean {close:?}?"),
        None => format!("unknown {what} {word:?}; there are {}", known.collect::<Vec<_>>().join(", ")),
    }
}

/// A text in quotes, control characters escaped, its middle left out where it is long.
fn quoted(text: &str) -> String {
    const SHOWN: usize = 60;
    if text.chars().count() <= SHOWN {
        return format!("{text:?}");
    }
    let start: String = text.chars().take(SHOWN).collect();
    format!("{start:?}… ({} bytes)", text.len())
}

/// How a message shows an offending value.
pub(crate) fn got(value: &Value) -> String {
    match value {
        Value::String(text) => quoted(&text.to_string_lossy()),
        Value::Integer(number) => number.to_string(),
        Value::Number(number) if !number.is_finite() => {
            format!("{}, which is not a finite number", text::format_number(*number))
        }
        Value::Number(number) => text::format_number(*number),
        Value::Boolean(flag) => flag.to_string(),
        Value::Nil => "nil".into(),
        other => kind(other),
    }
}

/// The same, with the constructor of a table that one made.
pub(crate) fn got_made(value: &Value) -> String {
    let made = value.as_table().and_then(|table| table.metatable());
    match made.and_then(|meta| meta.get::<Option<String>>("__name").ok().flatten()) {
        Some(name) => format!("{name}{{…}}"),
        None => got(value),
    }
}

/// `a table`, or of an object of the host its class: `a softvt.Pose`.
pub(crate) fn kind(value: &Value) -> String {
    match value {
        Value::UserData(object) => match object.type_name() {
            Ok(name) => format!("a {}", name.to_string_lossy()),
            Err(_) => "an object".into(),
        },
        other => format!("a {}", other.type_name()),
    }
}

impl Type {
    /// What a message says was expected.
    pub fn words(&self) -> String {
        match self {
            Self::Number(unit, range) => format!("{}{}", unit_words(unit), range.words()),
            Self::Integer(range) => format!("a whole number{}", range.words()),
            Self::Text => "a string that is not empty".into(),
            Self::Line => "a string".into(),
            Self::Table(_) => "a table".into(),
            Self::Name => "a name of letters, digits, _ and -".into(),
            Self::Boolean => "true or false".into(),
            Self::Vector(count, "") => format!("a list of {count} numbers"),
            Self::Vector(count, unit) => format!("a list of {count} numbers ({unit})"),
            Self::Colour => "a list of 3 numbers in 0..1 (linear RGB)".into(),
            Self::Choice(names) => {
                let quoted: Vec<_> = names.iter().map(|name| format!("{name:?}")).collect();
                format!("one of {}", quoted.join(", "))
            }
            Self::Function(signature) => format!("a function, {signature}"),
            Self::List(Self::Any) => "a list".into(),
            Self::List(of) => format!("a list of {}", of.words()),
            Self::Map(of) => format!("a table from names to {}", of.words()),
            Self::Nested(record) => format!("a table of {}", names(record)),
            Self::Made(records) => {
                let made: Vec<_> = records.iter().map(|r| format!("{}{{…}}", r.kind)).collect();
                format!("what {} gives", made.join(" or "))
            }
            Self::Object(class) => format!("a {class}"),
            Self::OneOf(types) => types.iter().map(Self::words).collect::<Vec<_>>().join(" or "),
            Self::Any => "a value".into(),
        }
    }

    /// The value as it is stored, or what is wrong with it.
    pub(crate) fn check(&self, lua: &Lua, value: &Value) -> Result<Value, Fault> {
        let value = &lists::plain(lua, value).map_err(|e| Fault::new(e.to_string()))?;
        let wrong = || Fault::new(format!("expected {}, got {}", self.words(), got(value)));
        if let Value::String(text) = value
            && text.to_str().is_err()
        {
            return Err(Fault::new(format!("expected UTF-8 text, got {}", got(value))));
        }
        let kept = || Ok(value.clone());
        match (self, value) {
            (Self::Number(_, range), _) => match number(value) {
                Some(n) if range.holds(n) => Ok(Value::Number(n)),
                _ => Err(wrong()),
            },
            (Self::Integer(range), _) => match whole(value) {
                Some(n) if range.holds(n as f64) => Ok(Value::Integer(n)),
                _ => Err(wrong()),
            },
            (Self::Text, Value::String(text)) if !text.as_bytes().is_empty() => kept(),
            (Self::Name, Value::String(text)) if is_name(&text.to_string_lossy()) => kept(),
            (Self::Line, Value::String(_)) | (Self::Table(_), Value::Table(_)) => kept(),
            (Self::Boolean, Value::Boolean(_)) | (Self::Function(_), Value::Function(_)) => kept(),
            (Self::Any, value) if !value.is_nil() => kept(),
            (Self::Choice(names), Value::String(text)) => {
                let text = text.to_string_lossy();
                match (names.iter().any(|name| *name == text), text::suggest(&text, names.iter().copied())) {
                    (true, _) => kept(),
                    (false, Some(close)) => {
                        Err(Fault::new(format!("{}; did you mean {close:?}?", wrong().message)))
                    }
                    (false, None) => Err(wrong()),
                }
            }
            (Self::Colour, Value::Table(list)) => {
                numbers::check(lua, list, (3, Range::closed(0.0, 1.0)), &wrong)
            }
            (Self::Vector(count, _), Value::Table(list)) => {
                numbers::check(lua, list, (*count, Range::ANY), &wrong)
            }
            (Self::List(of), Value::Table(list)) => check_list(lua, of, list, &wrong),
            (Self::Map(of), Value::Table(map)) => check_map(lua, of, map),
            (Self::Nested(record), Value::Table(table)) => check(lua, record, table).map(Value::Table),
            (Self::Made(records), Value::Table(table)) => {
                match records.iter().any(|record| is_made(lua, record, table)) {
                    true => kept(),
                    false => Err(wrong()),
                }
            }
            (Self::Object(class), Value::UserData(object)) => match object.type_name() {
                Ok(name) if name.to_string_lossy() == *class => kept(),
                _ => Err(wrong()),
            },
            (Self::OneOf(types), _) => one_of(lua, types, value, &wrong),
            _ => Err(wrong()),
        }
    }
}

/// Whether a text can be part of a path and of a line without harm.
fn is_name(text: &str) -> bool {
    let fits = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
    (1..=100).contains(&text.len()) && text.chars().all(fits)
}

fn names(record: &Record) -> String {
    record.fields.iter().map(|field| field.name).collect::<Vec<_>>().join(", ")
}

fn unit_words(unit: &str) -> String {
    match unit {
        "" => "a number".into(),
        "s" => "seconds".into(),
        "m" => "metres".into(),
        "rad" => "radians".into(),
        "Pa" => "pascals".into(),
        other => format!("a number ({other})"),
    }
}

pub(crate) fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Integer(n) => Some(*n as f64),
        Value::Number(n) => Some(*n),
        _ => None,
    }
}

/// A measured number for scripts: none, which is nil, where there is nothing to measure.
pub(crate) fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

fn whole(value: &Value) -> Option<i64> {
    match value {
        Value::Integer(n) => Some(*n),
        Value::Number(n) if n.fract() == 0.0 && n.abs() < 9e15 => Some(*n as i64),
        _ => None,
    }
}

/// The first type that fits; a fault inside of the value says more than that none does.
fn one_of(lua: &Lua, types: &[Type], value: &Value, wrong: &dyn Fn() -> Fault) -> Result<Value, Fault> {
    let mut inner = None;
    for ty in types {
        match ty.check(lua, value) {
            Ok(value) => return Ok(value),
            Err(fault) if !fault.path.is_empty() => inner = inner.or(Some(fault)),
            Err(_) => {}
        }
    }
    Err(inner.unwrap_or_else(wrong))
}

fn check_list(lua: &Lua, of: &Type, list: &Table, wrong: &dyn Fn() -> Fault) -> Result<Value, Fault> {
    let out = lua.create_table().map_err(|e| Fault::new(e.to_string()))?;
    let count = list.raw_len();
    if list.pairs::<Value, Value>().count() != count {
        return Err(wrong());
    }
    for index in 1..=count {
        let value: Value = list.raw_get(index).map_err(|e| Fault::new(e.to_string()))?;
        let value = of.check(lua, &value).map_err(|fault| fault.inside(format!("[{index}]")))?;
        out.raw_set(index, value).map_err(|e| Fault::new(e.to_string()))?;
    }
    Ok(Value::Table(out))
}

fn check_map(lua: &Lua, of: &Type, map: &Table) -> Result<Value, Fault> {
    let out = lua.create_table().map_err(|e| Fault::new(e.to_string()))?;
    for (key, value) in sorted_pairs(map) {
        let Value::String(name) = &key else {
            return Err(Fault::new(format!("expected names as keys, got {}", got(&key))));
        };
        let name = name.to_string_lossy().to_string();
        let value = of.check(lua, &value).map_err(|fault| fault.inside(name.clone()))?;
        out.raw_set(name, value).map_err(|e| Fault::new(e.to_string()))?;
    }
    Ok(Value::Table(out))
}

/// Entries in an order that does not depend on hashes.
pub(crate) fn sorted_pairs(table: &Table) -> Vec<(Value, Value)> {
    let mut entries: Vec<_> = table.pairs::<Value, Value>().flatten().collect();
    entries.sort_by_key(|(key, _)| match key {
        Value::Integer(n) => (0, *n, String::new()),
        Value::String(text) => (1, 0, text.to_string_lossy().to_string()),
        other => (2, 0, got(other)),
    });
    entries
}

/// A copy of `table` with every field checked and every default filled in.
pub(crate) fn check(lua: &Lua, record: &Record, table: &Table) -> Result<Table, Fault> {
    for (key, _) in sorted_pairs(table) {
        let known = record.fields.iter().map(|field| field.name);
        match &key {
            Value::String(name) if known.clone().any(|field| field == name.to_string_lossy()) => {}
            Value::String(name) => return Err(Fault::new(unknown("key", &name.to_string_lossy(), known))),
            other => {
                return Err(Fault::new(format!(
                    "unexpected entry [{}]; the keys are {}",
                    got(other),
                    names(record)
                )));
            }
        }
    }
    let out = lua.create_table().map_err(|e| Fault::new(e.to_string()))?;
    for field in record.fields {
        let value: Value = table.raw_get(field.name).map_err(|e| Fault::new(e.to_string()))?;
        let value = match value {
            Value::Nil => absent(lua, field)?,
            value => field.ty.check(lua, &value).map_err(|fault| fault.inside(field.name))?,
        };
        out.raw_set(field.name, value).map_err(|e| Fault::new(e.to_string()))?;
    }
    Ok(out)
}

fn absent(lua: &Lua, field: &Field) -> Result<Value, Fault> {
    Ok(match field.presence {
        Presence::Required => {
            return Err(Fault::new(format!("missing; expected {}", field.ty.words())).inside(field.name));
        }
        Presence::Optional => Value::Nil,
        Presence::Number(n) => Value::Number(n),
        Presence::Integer(n) => Value::Integer(n),
        Presence::Boolean(flag) => Value::Boolean(flag),
        Presence::Text(text) => {
            Value::String(lua.create_string(text).map_err(|e| Fault::new(e.to_string()))?)
        }
        Presence::Empty => {
            let empty = lua.create_table().map_err(|e| Fault::new(e.to_string()))?;
            field.ty.check(lua, &Value::Table(empty)).map_err(|fault| fault.inside(field.name))?
        }
    })
}

/// What the constructor of `record` gives for `value`: a checked table that also refuses to be read by unknown keys.
pub(crate) fn make(lua: &Lua, record: &'static Record, value: &Value) -> mlua::Result<Table> {
    let made = checked(lua, record, value)?;
    made.set_metatable(Some(metatable(lua, record)?))?;
    origin::note(lua, &made)?;
    Ok(made)
}

/// A table that `record` describes, checked.
pub(crate) fn checked(lua: &Lua, record: &Record, value: &Value) -> mlua::Result<Table> {
    match lists::plain(lua, value)? {
        Value::Table(table) => {
            check(lua, record, &table).map_err(|fault| fault_here(lua, record.label, &fault))
        }
        other => {
            let message =
                format!("{}: expected a table of {}, got {}", record.label, names(record), got(&other));
            Err(fail(lua, message))
        }
    }
}

/// Checks a made table once more: a script may have written to it since.
pub(crate) fn still_sound(lua: &Lua, record: &Record, table: &Table) -> mlua::Result<()> {
    match check(lua, record, table) {
        Ok(_) => Ok(()),
        Err(fault) => Err(fail(lua, format!("{} (changed after it was made)", fault.words(record.label)))),
    }
}

/// Whether the constructor of `record` made `table`.
pub(crate) fn is_made(lua: &Lua, record: &Record, table: &Table) -> bool {
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
    let read = lua.create_function(|lua, (_, key): (Value, Value)| {
        let known = record.fields.iter().map(|field| field.name);
        match &key {
            Value::String(name) if known.clone().any(|field| field == name.to_string_lossy()) => {
                Ok(Value::Nil)
            }
            Value::String(name) => {
                let message = unknown("key", &name.to_string_lossy(), known);
                Err(fail(lua, format!("{}: {message}", record.label)))
            }
            _ => Ok(Value::Nil),
        }
    })?;
    meta.set("__index", read)?;
    lua.set_named_registry_value(record.kind, &meta)?;
    Ok(meta)
}

/// A fault as an error at the line of the offending key, as far as the text shows it.
pub(crate) fn fault_here(lua: &Lua, label: &str, fault: &Fault) -> mlua::Error {
    let message = fault.words(label);
    let Some((file, line)) = here(lua) else { return fail(lua, message) };
    let line = origin::line_of(lua, &file, line, &fault.path);
    mlua::Error::external(crate::script::ScriptError::new(file, message).at(Some(line)))
}
