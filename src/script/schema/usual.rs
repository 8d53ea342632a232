//! Numbers of scripts that are valid and outside of their usual range, which `softvt check` reports.

use std::{
    collections::BTreeSet,
    sync::{Arc, Mutex},
};

use mlua::{Lua, Table, Value};

use super::{Record, Type, ValidationError};
use crate::vm::{
    error::current_line,
    source_map::find_key,
    value::{number, sorted_pairs},
};
use softvt_common::parallel::lock;

/// Largest number of messages that are kept.
const MAX_KEPT: usize = 100;

/// Messages about the unusual numbers of a virtual machine, each with file and line.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnusualNumbers(Arc<Mutex<BTreeSet<String>>>);

impl UnusualNumbers {
    /// The messages so far.
    pub(crate) fn of(lua: &Lua) -> Vec<String> {
        lua.app_data_ref::<Self>().map_or_else(Vec::new, |found| lock(&found.0).iter().cloned().collect())
    }
}

/// Keeps messages about the unusual numbers of a value that was checked as `ty`; `label` names it.
pub(crate) fn note_unusual(lua: &Lua, label: &str, ty: &Type, value: &Value) {
    for found in ty.unusual(value) {
        let Some(kept) = lua.app_data_ref::<UnusualNumbers>() else { return };
        let place = current_line(lua).map(|line| format!("{}: ", find_key(lua, line, &found.path)));
        let mut kept = lock(&kept.0);
        if kept.len() < MAX_KEPT {
            kept.insert(place.unwrap_or_default() + &found.describe(label));
        }
    }
}

impl Type {
    /// Describes the numbers in a checked value that are outside of their usual range. Tables that constructors
    /// made are left out.
    fn unusual(&self, value: &Value) -> Vec<ValidationError> {
        let one = |unit: &str, range: &super::Range, value: &Value| {
            // The unit of a vector may name its frame as well.
            let unit = unit.split(',').next().unwrap_or_default();
            Some(ValidationError::new(range.unusual(number(value)?, unit)?))
        };
        let inside = |key: String, of: &Self, value: &Value| {
            of.unusual(value).into_iter().map(move |found| found.inside(key.clone())).collect::<Vec<_>>()
        };
        match (self, value) {
            _ if !self.has_usual() => Vec::new(),
            (Self::Number(unit, range), value) => Vec::from_iter(one(unit, range, value)),
            (Self::Integer(range), value) => Vec::from_iter(one("", range, value)),
            (Self::Vector(_, unit, range) | Self::Interval(unit, range), Value::Table(list)) => {
                Vec::from_iter(
                    list.sequence_values::<Value>().flatten().find_map(|value| one(unit, range, &value)),
                )
            }
            (Self::List(of) | Self::Distinct { of, .. }, Value::Table(list)) => {
                let values = (1..).zip(list.sequence_values::<Value>().flatten());
                values.flat_map(|(at, value)| inside(format!("[{at}]"), of, &value)).collect()
            }
            (Self::Map(of), Value::Table(map)) => {
                let entries = sorted_pairs(map).into_iter();
                entries
                    .flat_map(|(key, value)| inside(key.to_string().unwrap_or_default(), of, &value))
                    .collect()
            }
            (Self::Nested(record), Value::Table(table)) => record.unusual(table),
            (Self::OneOf(types), value) => types.iter().flat_map(|ty| ty.unusual(value)).collect(),
            _ => Vec::new(),
        }
    }

    /// True if a number in a value may be unusual.
    fn has_usual(&self) -> bool {
        match self {
            Self::Number(_, range)
            | Self::Integer(range)
            | Self::Vector(_, _, range)
            | Self::Interval(_, range) => range.has_usual(),
            Self::List(of) | Self::Distinct { of, .. } | Self::Map(of) => of.has_usual(),
            Self::OneOf(types) => types.iter().any(Self::has_usual),
            Self::Nested(_) => true,
            _ => false,
        }
    }
}

impl Record {
    /// Describes the unusual numbers in a table whose fields were checked.
    pub(crate) fn unusual(&self, table: &Table) -> Vec<ValidationError> {
        let of_field = |field: &super::Field| {
            let value = table.raw_get::<Value>(field.name).unwrap_or(Value::Nil);
            field.ty.unusual(&value).into_iter().map(|found| found.inside(field.name)).collect::<Vec<_>>()
        };
        self.fields.iter().flat_map(of_field).collect()
    }
}
