//! Options that a script declares for itself and the command line that sets them.

use std::sync::{Arc, Mutex};

use mlua::{Lua, Table, Value};

use crate::script::{
    ScriptError,
    api::catalogue::OPTION,
    schema::{self, Range, Type},
    vm::{fail, locked},
};
use crate::text::suggest;

/// The value of an option.
#[derive(Clone, Debug, PartialEq)]
pub enum OptionValue {
    /// A number in the option's unit.
    Number(f64),
    /// A whole number.
    Integer(i64),
    /// A string.
    Text(String),
    /// On or off.
    Flag(bool),
    /// A list of numbers, `48,46`.
    Numbers(Vec<f64>),
    /// A list of strings, `a,b`.
    Texts(Vec<String>),
}

/// An option that a script declares.
#[derive(Clone, Debug, PartialEq)]
pub struct OptionSpec {
    /// Its name in Lua, `gap_mm`; on the command line `--gap-mm`.
    pub name: String,
    /// Unit of a number, "" for none.
    pub unit: String,
    /// What it does.
    pub help: String,
    /// What it is unless set.
    pub default: OptionValue,
    /// What it is now.
    pub value: OptionValue,
    /// Allowed numbers.
    pub range: Range,
    /// Allowed strings; any if empty.
    pub choices: Vec<String>,
}

impl OptionSpec {
    /// `--gap-mm`.
    pub fn flag(&self) -> String {
        format!("--{}", self.name.replace('_', "-"))
    }

    /// What may be given, for help and messages.
    pub fn expects(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" ({})", self.unit) };
        match &self.default {
            OptionValue::Number(_) => format!("a number{}{unit}", self.range.words()),
            OptionValue::Integer(_) => format!("a whole number{}{unit}", self.range.words()),
            OptionValue::Text(_) | OptionValue::Texts(_) if !self.choices.is_empty() => {
                format!("one of {}", self.choices.join(", "))
            }
            OptionValue::Text(_) => "a string".into(),
            OptionValue::Flag(_) => "on or off".into(),
            OptionValue::Numbers(_) => format!("numbers joined by commas{}{unit}", self.range.words()),
            OptionValue::Texts(_) => "strings joined by commas".into(),
        }
    }

    /// Reads a value as the command line gives it.
    fn parse(&self, text: &str) -> Option<OptionValue> {
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|n| self.range.holds(*n));
        let allowed = |text: &str| self.choices.is_empty() || self.choices.iter().any(|c| c == text);
        Some(match &self.default {
            OptionValue::Number(_) => OptionValue::Number(number(text)?),
            OptionValue::Integer(_) => {
                let n = text.trim().parse::<i64>().ok()?;
                self.range.holds(n as f64).then_some(OptionValue::Integer(n))?
            }
            OptionValue::Text(_) => OptionValue::Text(allowed(text).then(|| text.to_string())?),
            OptionValue::Flag(_) => match text {
                "on" | "true" | "yes" | "1" => OptionValue::Flag(true),
                "off" | "false" | "no" | "0" => OptionValue::Flag(false),
                _ => return None,
            },
            OptionValue::Numbers(_) => {
                OptionValue::Numbers(text.split(',').map(number).collect::<Option<_>>()?)
            }
            OptionValue::Texts(_) => {
                let parts = text.split(',').map(str::trim);
                let kept = parts.map(|part| (allowed(part) && !part.is_empty()).then(|| part.to_string()));
                OptionValue::Texts(kept.collect::<Option<_>>()?)
            }
        })
    }
}

/// The command line of a script and what the script has declared so far.
#[derive(Debug, Default)]
pub(crate) struct Session {
    /// Words of the command line; none where an option has taken them.
    words: Vec<Option<String>>,
    pub options: Vec<OptionSpec>,
}

impl Session {
    pub(crate) fn new(argv: &[String]) -> Arc<Mutex<Self>> {
        Arc::new(Mutex::new(Self { words: argv.iter().cloned().map(Some).collect(), options: Vec::new() }))
    }

    /// An error for the first word that no option took.
    pub(crate) fn leftover(&self, main: &str) -> Result<(), ScriptError> {
        let Some(word) = self.words.iter().flatten().next() else { return Ok(()) };
        let name = word.split('=').next().unwrap_or(word);
        if !name.starts_with('-') {
            return Err(ScriptError::new(main, format!("unexpected argument {word:?}"))
                .hint("options are given as --name value"));
        }
        let flags: Vec<String> = self.options.iter().map(OptionSpec::flag).collect();
        let error = ScriptError::new(main, format!("unknown option {name}"));
        Err(match suggest(name, flags.iter().map(String::as_str)) {
            Some(close) => error.hint(format!("did you mean {close}?")),
            None if flags.is_empty() => error.hint("the script declares no options of its own"),
            None => error.hint(format!("the script declares {}", flags.join(", "))),
        })
    }

    /// Takes the words that set `spec`; the text of its value, if any.
    fn take(&mut self, spec: &OptionSpec) -> Result<Option<OptionValue>, String> {
        let flag = spec.flag();
        let underscored = format!("--{}", spec.name);
        let is_flag = matches!(spec.default, OptionValue::Flag(_));
        let mut found = None;
        let mut at = 0;
        while at < self.words.len() {
            let Some(word) = self.words[at].clone() else {
                at += 1;
                continue;
            };
            let (name, inline) = match word.split_once('=') {
                Some((name, value)) => (name.to_string(), Some(value.to_string())),
                None => (word, None),
            };
            let off = is_flag && inline.is_none() && name == format!("--no-{}", &flag[2..]);
            if name == flag || name == underscored || off {
                self.words[at] = None;
                let text = match inline {
                    Some(text) => text,
                    None if is_flag => (if off { "off" } else { "on" }).into(),
                    None => {
                        at += 1;
                        let next = self.words.get_mut(at).and_then(Option::take);
                        let next = next.filter(|next| !next.starts_with("--"));
                        next.ok_or_else(|| {
                            format!("option {flag}: expected {}, got nothing", spec.expects())
                        })?
                    }
                };
                let wrong = || format!("option {flag}: expected {}, got {text:?}", spec.expects());
                let value = spec.parse(&text).ok_or_else(wrong)?;
                if found.replace(value).is_some() {
                    return Err(format!("option {flag} is given twice; give it once"));
                }
            }
            at += 1;
        }
        Ok(found)
    }
}

/// Installs `softvt.options`.
pub(crate) fn install(lua: &Lua, api: &Table, session: &Arc<Mutex<Session>>) -> mlua::Result<()> {
    let session = session.clone();
    let declare = lua.create_function(move |lua, table: Value| {
        let Value::Table(table) = table else {
            let message = format!("options: expected a table of options, got {}", schema::got(&table));
            return Err(fail(lua, message));
        };
        let values = lua.create_table()?;
        let mut names = Vec::new();
        for (key, value) in schema::sorted_pairs(&table) {
            let spec = declare_one(lua, &session, &key, &value)?;
            values.raw_set(spec.name.as_str(), to_lua(lua, &spec.value)?)?;
            names.push(spec.name.clone());
            locked(&session).options.push(spec);
        }
        strict(lua, "options", values, names)
    })?;
    api.set("options", declare)
}

fn declare_one(
    lua: &Lua,
    session: &Arc<Mutex<Session>>,
    key: &Value,
    value: &Value,
) -> mlua::Result<OptionSpec> {
    let mut spec = read_spec(lua, key, value)?;
    let mut session = locked(session);
    if session.options.iter().any(|known| known.name == spec.name) {
        return Err(fail(lua, format!("options.{}: the option is declared twice", spec.name)));
    }
    if let Some(value) = session.take(&spec).map_err(|message| fail(lua, message))? {
        spec.value = value;
    }
    Ok(spec)
}

fn read_spec(lua: &Lua, key: &Value, value: &Value) -> mlua::Result<OptionSpec> {
    let name = match key {
        Value::String(name) => name.to_string_lossy().to_string(),
        other => {
            return Err(fail(lua, format!("options: expected names as keys, got {}", schema::got(other))));
        }
    };
    let fits = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_';
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) || !name.bytes().all(fits) {
        let message = format!(
            "options: {}: a name begins with a letter and has lower-case letters, digits and underscores",
            schema::got(key)
        );
        return Err(fail(lua, message));
    }
    let fault = |fault: schema::Fault| {
        let mut fault = fault;
        fault.path.insert(0, name.clone());
        schema::fault_here(lua, "options", &fault)
    };
    let Value::Table(table) = Type::Nested(&OPTION).check(lua, value).map_err(fault)? else {
        return Err(fail(lua, format!("options.{name}: expected a table")));
    };
    let choices: Option<Vec<String>> = table.get("choices")?;
    let default =
        read_default(&table.get::<Value>("default")?, table.get::<bool>("integer")?).ok_or_else(|| {
            fail(
                lua,
                format!(
                    "options.{name}.default: expected a number, string, boolean or list of numbers or strings"
                ),
            )
        })?;
    let range = Range {
        min: table.get::<Option<f64>>("min")?.unwrap_or(f64::NEG_INFINITY),
        max: table.get::<Option<f64>>("max")?.unwrap_or(f64::INFINITY),
        ..Range::ANY
    };
    let spec = OptionSpec {
        unit: table.get("unit")?,
        help: table.get("help")?,
        value: default.clone(),
        default,
        range,
        choices: choices.unwrap_or_default(),
        name,
    };
    match spec.parse(&spec.default.to_string()) {
        Some(_) => Ok(spec),
        None => Err(fail(lua, format!("options.{}.default: expected {}", spec.name, spec.expects()))),
    }
}

fn read_default(value: &Value, integer: bool) -> Option<OptionValue> {
    Some(match value {
        Value::Boolean(flag) => OptionValue::Flag(*flag),
        Value::String(text) => OptionValue::Text(text.to_string_lossy().to_string()),
        Value::Integer(n) if integer => OptionValue::Integer(*n),
        Value::Integer(_) | Value::Number(_) if !integer => OptionValue::Number(schema::number(value)?),
        Value::Table(list) => {
            let items: Vec<Value> = list.clone().sequence_values().collect::<mlua::Result<_>>().ok()?;
            match items.first()? {
                Value::String(_) => {
                    let texts = items.iter().map(|item| match item {
                        Value::String(text) => Some(text.to_string_lossy().to_string()),
                        _ => None,
                    });
                    OptionValue::Texts(texts.collect::<Option<_>>()?)
                }
                _ => OptionValue::Numbers(items.iter().map(schema::number).collect::<Option<_>>()?),
            }
        }
        _ => return None,
    })
}

impl std::fmt::Display for OptionValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(n) => write!(f, "{n}"),
            Self::Integer(n) => write!(f, "{n}"),
            Self::Text(text) => write!(f, "{text}"),
            Self::Flag(flag) => write!(f, "{}", if *flag { "on" } else { "off" }),
            Self::Numbers(list) => {
                write!(f, "{}", list.iter().map(f64::to_string).collect::<Vec<_>>().join(","))
            }
            Self::Texts(list) => write!(f, "{}", list.join(",")),
        }
    }
}

fn to_lua(lua: &Lua, value: &OptionValue) -> mlua::Result<Value> {
    Ok(match value {
        OptionValue::Number(n) => Value::Number(*n),
        OptionValue::Integer(n) => Value::Integer(*n),
        OptionValue::Text(text) => Value::String(lua.create_string(text)?),
        OptionValue::Flag(flag) => Value::Boolean(*flag),
        OptionValue::Numbers(list) => Value::Table(lua.create_sequence_from(list.iter().copied())?),
        OptionValue::Texts(list) => Value::Table(lua.create_sequence_from(list.iter().map(String::as_str))?),
    })
}

/// `table`, made to refuse reading and writing of keys other than `names`.
pub(crate) fn strict(lua: &Lua, label: &str, table: Table, names: Vec<String>) -> mlua::Result<Table> {
    let meta = lua.create_table()?;
    let name = label.to_owned();
    let refuse = lua.create_function(move |lua, (table, key, value): (Table, Value, Value)| match &key {
        Value::String(key) if names.iter().any(|name| *name == key.to_string_lossy()) => {
            table.raw_set(key, value)?;
            Ok(Value::Nil)
        }
        Value::String(key) => {
            let known = names.iter().map(String::as_str);
            Err(fail(lua, format!("{name}: {}", schema::unknown("key", &key.to_string_lossy(), known))))
        }
        key => Err(fail(lua, format!("{name}: expected a name as key, got {}", schema::got(key)))),
    })?;
    // Only keys without a value come here; reading one that is known gives nil, and stores that.
    meta.set("__index", &refuse)?;
    meta.set("__newindex", refuse)?;
    meta.set("__metatable", label)?;
    table.set_metatable(Some(meta))?;
    Ok(table)
}
