//! The fields of a request, read one by one.

use rmpv::Value;

use crate::policy::wire::{kind, numbers};

/// Letters of a client's own text that an answer repeats.
const REPEATED: usize = 80;
/// Above, not every whole number has a float of its own.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// The fields of one request.
pub(super) struct Fields<'a> {
    /// What kind of request it is, for messages.
    pub kind: &'a str,
    map: &'a [(Value, Value)],
}

impl<'a> Fields<'a> {
    /// The fields of a map, of which only `known` may be there.
    ///
    /// # Errors
    /// A field that is not known.
    pub(super) fn new(kind: &'a str, map: &'a [(Value, Value)], known: &[&str]) -> Result<Self, String> {
        let fields = Self { kind, map };
        let unknown = map.iter().map(|(key, _)| text(key)).find(|name| match name {
            Some(name) => !known.contains(&name.as_str()),
            None => true,
        });
        match unknown {
            None => Ok(fields),
            Some(name) => {
                let name = short(&name.unwrap_or_else(|| "that is no text".to_owned()));
                Err(fields.wrong(&format!("there is no field {name:?}; it takes {}", known.join(", "))))
            }
        }
    }

    /// A message about this request.
    pub(super) fn wrong(&self, what: &str) -> String {
        format!("{}: {what}", self.kind)
    }

    /// A field, unless it is absent or nil.
    pub(super) fn get(&self, name: &str) -> Option<&'a Value> {
        let found = self.map.iter().find(|(key, _)| text(key).as_deref() == Some(name));
        found.map(|(_, value)| value).filter(|value| !value.is_nil())
    }

    /// A field that must be there.
    ///
    /// # Errors
    /// It is not.
    pub(super) fn need<T>(&self, name: &str, value: Option<T>) -> Result<T, String> {
        value.ok_or_else(|| self.wrong(&format!("it has no field {name}")))
    }

    /// Text.
    ///
    /// # Errors
    /// It is something else.
    pub(super) fn text(&self, name: &str) -> Result<Option<String>, String> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let found = text(value);
        found.map(Some).ok_or_else(|| self.wrong(&format!("{name} is {}; expected text", kind(value))))
    }

    /// A whole number from 0 to `most`.
    ///
    /// # Errors
    /// It is something else.
    pub(super) fn whole(&self, name: &str, most: u64) -> Result<Option<u64>, String> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let found = value.as_u64().or_else(|| {
            let (shape, found) = numbers(value).ok()?;
            let number = *found.first()?;
            let fits = shape.is_empty() && number.fract() == 0.0 && (0.0..EXACT).contains(&number);
            fits.then_some(number as u64)
        });
        let fits = found.filter(|number| *number <= most);
        let message =
            || self.wrong(&format!("{name} is {}; expected a whole number in 0..{most}", shown(value)));
        fits.map(Some).ok_or_else(message)
    }
}

/// Text, whichever of the two types msgpack has for it.
pub(super) fn text(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => text.as_str().map(str::to_owned),
        Value::Binary(bytes) => String::from_utf8(bytes.clone()).ok(),
        _ => None,
    }
}

/// The beginning of a client's own text.
pub(super) fn short(text: &str) -> String {
    let cut = text.char_indices().nth(REPEATED);
    cut.map_or_else(|| text.to_owned(), |(at, _)| format!("{}…", &text[..at]))
}

/// A value in a message.
fn shown(value: &Value) -> String {
    match value {
        Value::Integer(_) | Value::F32(_) | Value::F64(_) | Value::Boolean(_) => value.to_string(),
        Value::String(_) | Value::Binary(_) => format!("{:?}", short(&text(value).unwrap_or_default())),
        other => kind(other).to_owned(),
    }
}
