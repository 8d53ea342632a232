//! Declarations of the Lua interface: records (tables that scripts write), classes (objects that scripts hold) and
//! functions.
//!
//! Each is declared once, by [`record!`](convert), [`class!`](object), [`output!`] or [`functions!`](function). The
//! declaration gives the Rust struct or the accessors, the check of every value with its messages, the stubs for
//! language servers and the reference page. A key is therefore known everywhere or nowhere.

/// A [`ValidationError`] with a formatted message.
macro_rules! mismatch {
    ($($message:tt)+) => { $crate::schema::ValidationError::new(format_args!($($message)+)) };
}

pub(crate) mod check;
pub(crate) mod convert;
pub(crate) mod function;
pub(crate) mod object;
mod output;

use std::fmt::Display;

use mlua::{Lua, Table};

pub(crate) use softvt_common::range::Range;

pub(crate) use check::{UnusualNumbers, error_at_key, invalid, is_constructed, make, validate};
pub(crate) use convert::{
    Constructed, HasTable, LuaType, RecordType, Unchecked, choice, one_of, record, record_of,
};
pub(crate) use function::{Function, Signature, functions};
pub(crate) use object::{ApiObject, Class, FieldValue, class};
pub(crate) use output::{output, strict_table};

#[derive(Clone, Copy, Debug)]
pub(crate) enum Type {
    /// A finite number in a unit ("" for none).
    Number(&'static str, Range),
    Integer(Range),
    /// A string that is not empty.
    Text,
    Line,
    /// A string of letters, digits, `_` and `-`, so that it can be part of a path.
    Name,
    Boolean,
    /// A list of a fixed number of numbers in a unit, each within the range.
    Vector(usize, &'static str, Range),
    /// The lowest and the highest of two numbers in a unit, each within the range.
    Interval(&'static str, Range),
    /// A vector other than 0 in a frame, or the name of one.
    Direction(&'static [&'static str], &'static str),
    /// A quaternion w, x, y, z in a frame, of any positive length.
    Quaternion(&'static str),
    Choice(&'static [&'static str]),
    Function(&'static str),
    List(&'static Type),
    /// A list of at least `min` values that differ in the field `by`, or, if that is "", themselves.
    Distinct {
        of: &'static Type,
        by: &'static str,
        min: usize,
    },
    Map(&'static Type),
    /// A plain table, checked where it is written.
    Nested(&'static Record),
    /// A table made by the constructor of one of these records.
    Constructed(&'static [&'static Record]),
    /// A table that is checked elsewhere, with its LuaCATS type.
    Table(&'static str),
    Object(&'static str),
    /// The first of these types that accepts the value.
    OneOf(&'static [Type]),
    Any,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FieldDefault {
    Required,
    Optional,
    Number(f64),
    Integer(i64),
    Text(&'static str),
    Boolean(bool),
    /// A nested table with the defaults of its own fields.
    Empty,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Field {
    pub name: &'static str,
    pub ty: Type,
    pub presence: FieldDefault,
    pub doc: &'static str,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Record {
    /// Name in messages: `task.goal`.
    pub label: &'static str,
    /// Class name in stubs: `softvt.Goal`.
    pub class: &'static str,
    /// Unique registry key of its metatable; for a record with a constructor, the constructor's name (`softvt.on`).
    pub kind: &'static str,
    pub doc: &'static str,
    pub fields: &'static [Field],
    pub relation: Option<Relation>,
}

/// A relation between the fields of a table whose fields are valid.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Relation {
    /// Each of these numbers is above the one before it.
    Increasing(&'static [&'static str]),
    /// None of these numbers, of those that are given, is below the one before it.
    NotDecreasing(&'static [&'static str]),
    /// Another one, which the constructor checks.
    Checked(fn(&Lua, &Table) -> Result<(), ValidationError>),
}

impl Record {
    /// `suite` of `softvt.suite`.
    pub(crate) fn constructor(&self) -> &'static str {
        self.kind.rsplit('.').next().unwrap_or(self.kind)
    }

    /// [`FieldDefault::Empty`] if every field may be left out, else [`FieldDefault::Required`].
    pub(crate) const fn presence(&self) -> FieldDefault {
        let mut index = 0;
        while index < self.fields.len() {
            if matches!(self.fields[index].presence, FieldDefault::Required) {
                return FieldDefault::Required;
            }
            index += 1;
        }
        FieldDefault::Empty
    }

    fn names(&self) -> impl Iterator<Item = &'static str> + Clone + use<> {
        self.fields.iter().map(|field| field.name)
    }
}

impl Type {
    /// A list of numbers of any size.
    pub(crate) const fn vector(count: usize, unit: &'static str) -> Self {
        Self::Vector(count, unit, Range::ANY)
    }

    /// Linear RGB from 0 to `max`.
    pub(crate) const fn colour(max: f64) -> Self {
        Self::Vector(3, "linear RGB", Range::closed(0.0, max))
    }

    /// The expected value for a message: `seconds in 0..10`.
    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Number(unit, range) => format!("{}{}", unit_words(unit), range.describe()),
            Self::Integer(range) => format!("a whole number{}", range.describe()),
            Self::Text => "a string that is not empty".into(),
            Self::Line => "a string".into(),
            Self::Table(_) => "a table".into(),
            Self::Name => "a name of letters, digits, _ and -".into(),
            Self::Boolean => "true or false".into(),
            Self::Vector(count, "", range) => format!("a list of {count} numbers{}", range.describe()),
            Self::Vector(count, unit, range) => {
                format!("a list of {count} numbers{} ({unit})", range.describe())
            }
            Self::Interval(unit, range) => Self::Vector(2, unit, *range).describe(),
            Self::Direction([], frame) => Self::vector(3, frame).describe(),
            Self::Direction(names, frame) => {
                format!("{} or {}", Self::Choice(names).describe(), Self::vector(3, frame).describe())
            }
            Self::Quaternion("") => Self::vector(4, "w, x, y, z").describe(),
            Self::Quaternion(frame) => format!("a list of 4 numbers (w, x, y, z, {frame})"),
            Self::Choice(names) => {
                let quoted: Vec<_> = names.iter().map(|name| format!("{name:?}")).collect();
                format!("one of {}", quoted.join(", "))
            }
            Self::Function(signature) => format!("a function, {signature}"),
            Self::List(Self::Any) => "a list".into(),
            Self::List(of @ Self::Constructed(_)) => {
                format!("a list of {}", of.describe().replacen("the result", "results", 1))
            }
            Self::List(of) => format!("a list of {}", of.describe()),
            Self::Distinct { of, .. } => Self::List(of).describe(),
            Self::Map(of) => format!("a table from names to {}", of.describe()),
            Self::Nested(record) => format!("a table of {}", joined(record)),
            Self::Constructed(records) => {
                let separator = if records.len() > 3 { ", " } else { " or " };
                let made: Vec<_> = records.iter().map(|record| format!("{}{{…}}", record.kind)).collect();
                let which = if records.len() > 3 { "one of " } else { "" };
                format!("the result of {which}{}", made.join(separator))
            }
            Self::Object(class) => format!("a {class}"),
            Self::OneOf(types) => types.iter().map(Self::describe).collect::<Vec<_>>().join(" or "),
            Self::Any => "a value".into(),
        }
    }
}

/// Keys of a record for a message.
fn joined(record: &Record) -> String {
    record.names().collect::<Vec<_>>().join(", ")
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

/// An invalid value, and its place in a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ValidationError {
    /// Keys from the outermost table inwards; `[3]` for a place in a list.
    pub path: Vec<String>,
    pub message: String,
}

impl ValidationError {
    pub(crate) fn new(message: impl Display) -> Self {
        Self { path: Vec::new(), message: message.to_string() }
    }

    /// The same error seen from the table that holds the value as `key`.
    pub(crate) fn inside(mut self, key: impl Into<String>) -> Self {
        self.path.insert(0, key.into());
        self
    }

    /// The full message: `task.goal.hold_s: expected …`.
    pub(crate) fn describe(&self, label: &str) -> String {
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

impl From<mlua::Error> for ValidationError {
    fn from(error: mlua::Error) -> Self {
        Self::new(error.to_string())
    }
}
