//! Options that a script declares, and the command line that sets them.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use mlua::{Lua, LuaSerdeExt, Value};
use serde::{Deserialize, Serialize};

use crate::{
    schema::{LuaType, Range, RecordType, Type, Unchecked, error_at_key, functions, record, strict_table},
    vm::{
        error::{ScriptError, app_data, fail},
        value::{describe, sorted_pairs},
    },
};
use ScriptOptionValue::{Flag, Integer, Number, Numbers, Text, Texts};
use softvt_common::{parallel::lock, text::suggest};

record! {
    /// An option of the script: key gap_mm is --gap-mm on the command line. The default determines the type.
    OptionRecord: "softvt.Option" as "option", relation NotDecreasing(&["min", "max"]) {
        /// A number, string, boolean, or list of numbers or strings.
        default: Value;
        /// True if only whole numbers are allowed.
        integer: bool => Boolean(false);
        /// Unit of a number.
        unit: String => Text("");
        /// Lowest number that is accepted.
        min: Option<f64>;
        /// Highest number that is accepted.
        max: Option<f64>;
        /// The allowed strings; any by default.
        choices: Option<Vec<String>>;
        /// Description for --help.
        help: String => Text("");
        /// Values of other options without which this one does nothing, and is refused: { sweep_protocol = "hand" }. A
        /// list must contain the value.
        only_with: Option<BTreeMap<String, Value>>;
        /// True if files that are made with another value than the default must not replace those of the project: such
        /// a value then needs --out.
        needs_out: bool => Boolean(false);
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ScriptOptionValue {
    /// A number in the option's unit.
    Number(f64),
    Integer(i64),
    Text(String),
    Flag(bool),
    /// A list of numbers, `48,46`.
    Numbers(Vec<f64>),
    /// A list of strings, `a,b`.
    Texts(Vec<String>),
}

#[derive(Clone, Debug, PartialEq)]
pub struct OptionSpec {
    /// Its name in Lua, `gap_mm`; on the command line `--gap-mm`.
    pub name: String,
    /// Unit of a number, "" for none.
    pub unit: String,
    pub help: String,
    pub default: ScriptOptionValue,
    pub value: ScriptOptionValue,
    pub range: Range,
    /// Allowed strings; any if empty.
    pub choices: Vec<String>,
    /// Values of other options, as on the command line, without which this one does nothing; by name.
    pub only_with: BTreeMap<String, String>,
    /// True if files that are made with another value than the default must not replace those of the project.
    pub needs_out: bool,
}

impl OptionSpec {
    pub fn flag(&self) -> String {
        format!("--{}", self.name.replace('_', "-"))
    }

    /// The allowed values, for help and messages.
    pub fn expects(&self) -> String {
        let number = |noun: &str| self.range.expected(noun, &self.unit);
        match &self.default {
            Number(_) => number("a number"),
            Integer(_) => number("a whole number"),
            Numbers(_) => number("numbers joined by commas"),
            Text(_) | Texts(_) if !self.choices.is_empty() => format!("one of {}", self.choices.join(", ")),
            Text(_) => "a string".into(),
            Texts(_) => "strings joined by commas".into(),
            Flag(_) => "on or off".into(),
        }
    }

    /// The description, and the options without which this one does nothing: "pause, only with --mode slow".
    pub fn help_text(&self, options: &[Self]) -> String {
        let flag = |name: &str| options.iter().find(|o| o.name == name).map_or_else(String::new, Self::flag);
        let conditions =
            self.only_with.iter().map(|(name, value)| format!("only with {} {value}", flag(name)));
        let help = Some(self.help.clone()).filter(|help| !help.is_empty());
        help.into_iter().chain(conditions).collect::<Vec<_>>().join(", ")
    }

    fn parse(&self, text: &str) -> Option<ScriptOptionValue> {
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|n| self.range.contains(*n));
        let allowed = |text: &str| self.choices.is_empty() || self.choices.iter().any(|c| c == text);
        let entries = || text.split(',').map(str::trim);
        match &self.default {
            Number(_) => number(text).map(Number),
            Integer(_) => {
                text.trim().parse::<i64>().ok().filter(|n| self.range.contains(*n as f64)).map(Integer)
            }
            Text(_) => allowed(text).then(|| Text(text.to_owned())),
            Flag(_) => match text {
                "on" | "true" | "yes" | "1" => Some(Flag(true)),
                "off" | "false" | "no" | "0" => Some(Flag(false)),
                _ => None,
            },
            Numbers(_) => entries().map(number).collect::<Option<_>>().map(Numbers),
            Texts(_) => {
                let fit = entries().all(|entry| allowed(entry) && !entry.is_empty());
                fit.then(|| Texts(entries().map(str::to_owned).collect()))
            }
        }
    }
}

pub(crate) type SharedOptions = Arc<Mutex<OptionSession>>;

/// The arguments of a script, and the options declared so far.
#[derive(Debug)]
pub(crate) struct OptionSession {
    /// Words of the command line; `None` for those that an option has consumed.
    arguments: Vec<Option<String>>,
    pub declared: Vec<OptionSpec>,
    given: Vec<String>,
}

impl OptionSession {
    pub(crate) fn new(argv: &[String]) -> SharedOptions {
        let arguments = argv.iter().cloned().map(Some).collect();
        Arc::new(Mutex::new(Self { arguments, declared: Vec::new(), given: Vec::new() }))
    }

    /// Fails if there is an argument that no option has consumed.
    pub(crate) fn check_all_consumed(&self, main: &str) -> Result<(), ScriptError> {
        let Some(word) = self.arguments.iter().flatten().next() else { return Ok(()) };
        let name = word.split('=').next().unwrap_or(word);
        if !name.starts_with('-') {
            return Err(ScriptError::new(main, format!("unexpected argument {word:?}"))
                .hint("options are given as --name value"));
        }
        let flags: Vec<String> = self.declared.iter().map(OptionSpec::flag).collect();
        let error = ScriptError::new(main, format!("unknown option {name}"));
        Err(match suggest(name, flags.iter().map(String::as_str)) {
            Some(close) => error.hint(format!("did you mean {close}?")),
            None if flags.is_empty() => error.hint("the script declares no options of its own"),
            None => error.hint(format!("the script declares {}", flags.join(", "))),
        })
    }

    /// Fails if the command line sets an option that does nothing with the values of the others.
    fn check_effects(&self) -> Result<(), String> {
        let needs =
            self.declared.iter().flat_map(|option| option.only_with.iter().map(move |need| (option, need)));
        for (option, (name, needed)) in needs {
            let (place, flag) = (format!("options.{}.only_with", option.name), option.flag());
            let Some(other) = self.declared.iter().find(|other| other.name == *name) else {
                return Err(format!("{place}: {name} is not an option of the script"));
            };
            let Some(wanted) = other.parse(needed) else {
                return Err(format!("{place}.{name}: expected {}, got {needed:?}", other.expects()));
            };
            if !other.value.contains(&wanted) && self.given.contains(&option.name) {
                let (other, value) = (other.flag(), &other.value);
                return Err(format!(
                    "option {flag} does nothing with {other} {value}; leave it out, or give {other} {needed}"
                ));
            }
        }
        Ok(())
    }

    /// Consumes the arguments that set `spec` and returns its value, if any.
    fn consume(&mut self, spec: &OptionSpec) -> Result<Option<ScriptOptionValue>, String> {
        let flag = spec.flag();
        let (underscored, negated) = (format!("--{}", spec.name), format!("--no-{}", &flag[2..]));
        let is_flag = matches!(spec.default, Flag(_));
        let mut found = None;
        for at in 0..self.arguments.len() {
            let Some(word) = self.arguments[at].clone() else { continue };
            let (name, value) = match word.split_once('=') {
                Some((name, value)) => (name, Some(value.to_owned())),
                None => (word.as_str(), None),
            };
            let is_negated = is_flag && value.is_none() && name == negated;
            if name != flag && name != underscored && !is_negated {
                continue;
            }
            self.arguments[at] = None;
            let text = match value {
                Some(value) => Some(value),
                None if is_flag => Some(if is_negated { "off" } else { "on" }.to_owned()),
                None => self
                    .arguments
                    .get_mut(at + 1)
                    .and_then(Option::take)
                    .filter(|text| !text.starts_with("--")),
            };
            let expected = spec.expects();
            let text = text.ok_or_else(|| format!("option {flag}: expected {expected}, got nothing"))?;
            let value = spec.parse(&text);
            let value = value.ok_or_else(|| format!("option {flag}: expected {expected}, got {text:?}"))?;
            if found.replace(value).is_some() {
                return Err(format!("option {flag} is given twice; give it once"));
            }
        }
        Ok(found)
    }
}

functions! {
    FUNCTIONS {
        /// Declares the script's options and returns their values, from the command line or by default:
        /// `local opt = softvt.options { gap_mm = { default = 40, unit = "mm", min = 1 } }`.
        fn options(lua, options: Unchecked = Type::Map(&Type::Nested(OptionRecord::RECORD))) -> ["table<string, any>"] {
            let Value::Table(table) = &options.0 else {
                bail!(lua, "options: expected a table of options, got {}", describe(&options.0));
            };
            let session = app_data::<SharedOptions>(lua)?;
            let values = lua.create_table()?;
            let mut names = Vec::new();
            // No metatable, which a script could see.
            let serialize = mlua::serde::ser::Options::new().set_array_metatable(false);
            for (key, value) in sorted_pairs(table) {
                let spec = declare(lua, &mut lock(&session), &key, &value)?;
                values.raw_set(spec.name.as_str(), lua.to_value_with(&spec.value, serialize)?)?;
                names.push(spec.name.clone());
                lock(&session).declared.push(spec);
            }
            lock(&session).check_effects().map_err(|error| fail(lua, error))?;
            strict_table(lua, "options", values, names)?
        }
    }
}

/// Reads the declaration of an option and its value on the command line.
fn declare(lua: &Lua, session: &mut OptionSession, key: &Value, value: &Value) -> mlua::Result<OptionSpec> {
    let Value::String(name) = key else {
        bail!(lua, "options: expected names as keys, got {}", describe(key));
    };
    let name = name.to_string_lossy();
    let fits = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_';
    if !name.starts_with(|c: char| c.is_ascii_lowercase()) || !name.bytes().all(fits) {
        bail!(lua, "options: {name:?}: expected a name of lower-case letters, digits and underscores");
    }
    let checked = OptionRecord::TYPE.check(lua, value);
    let checked = checked.map_err(|error| error_at_key(lua, "options", &error.inside(name.clone())))?;
    let record = OptionRecord::from_checked(checked, lua)?;
    let default = match record.default {
        Value::Integer(n) if record.integer => Some(Integer(n)),
        Value::Integer(_) | Value::Number(_) if record.integer => None,
        default => lua.from_value(default).ok(),
    };
    let default = default.ok_or_else(|| {
        let expected = "a number, string, boolean or list of numbers or strings";
        fail!(lua, "options.{name}.default: expected {expected}")
    })?;
    let mut spec = OptionSpec {
        unit: record.unit,
        help: record.help,
        value: default.clone(),
        default,
        range: Range::between(record.min, record.max),
        choices: record.choices.unwrap_or_default(),
        only_with: needed_values(lua, &name, record.only_with.unwrap_or_default())?,
        needs_out: record.needs_out,
        name,
    };
    if spec.parse(&spec.default.to_string()).is_none() {
        bail!(lua, "options.{}.default: expected {}", spec.name, spec.expects());
    }
    if session.declared.iter().any(|known| known.name == spec.name) {
        bail!(lua, "options.{}: the option is declared twice", spec.name);
    }
    if let Some(value) = session.consume(&spec).map_err(|error| fail(lua, error))? {
        spec.value = value;
        session.given.push(spec.name.clone());
    }
    Ok(spec)
}

/// Values of `only_with` of the option `name`, as on the command line.
fn needed_values(
    lua: &Lua,
    name: &str,
    values: BTreeMap<String, Value>,
) -> mlua::Result<BTreeMap<String, String>> {
    let value = |(other, value): (String, Value)| {
        let value: ScriptOptionValue = lua.from_value(value).map_err(|_| {
            fail!(lua, "options.{name}.only_with.{other}: expected a number, string or boolean")
        })?;
        Ok((other, value.to_string()))
    };
    values.into_iter().map(value).collect()
}

impl ScriptOptionValue {
    /// True if this is `other`, or a list with all of its entries.
    fn contains(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Numbers(all), Self::Numbers(some)) => some.iter().all(|one| all.contains(one)),
            (Self::Texts(all), Self::Texts(some)) => some.iter().all(|one| all.contains(one)),
            _ => self == other,
        }
    }
}

impl std::fmt::Display for ScriptOptionValue {
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
