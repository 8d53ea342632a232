//! Errors of scripts: raised by the host at the script's line, and translated from what the virtual machine reports.

use std::fmt;

use mlua::{Lua, debug::Debug};

use super::{VmState, library::embedded};
use softvt_common::parallel::lock;

/// An error with a formatted message at the line that is running; see [`fail`].
macro_rules! fail {
    ($lua:expr, $($message:tt)+) => { $crate::vm::error::fail($lua, format_args!($($message)+)) };
}

macro_rules! bail {
    ($lua:expr, $($message:tt)+) => { return Err(fail!($lua, $($message)+)) };
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct SourceLine {
    pub file: String,
    pub line: usize,
}

impl fmt::Display for SourceLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file, self.line)
    }
}

impl SourceLine {
    /// The current line of a function on the stack, if it is a script's.
    pub(crate) fn running(function: &Debug<'_>) -> Option<Self> {
        let file = function.source().source?.strip_prefix('@')?.to_owned();
        Some(Self { file, line: function.current_line()? })
    }
}

/// An error in a script or in its use; always names the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScriptError {
    pub message: String,
    /// The file, as the user names it.
    pub file: String,
    /// Line in the file, from 1, where known.
    pub line: Option<usize>,
    pub hint: Option<String>,
}

impl std::error::Error for ScriptError {}

impl From<ScriptError> for mlua::Error {
    fn from(error: ScriptError) -> Self {
        Self::external(error)
    }
}

impl fmt::Display for ScriptError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.file)?;
        if let Some(line) = self.line {
            write!(f, "{line}:")?;
        }
        write!(f, " {}", self.message)?;
        match &self.hint {
            Some(hint) => write!(f, "; {hint}"),
            None => Ok(()),
        }
    }
}

impl ScriptError {
    pub fn new(file: impl Into<String>, message: impl Into<String>) -> Self {
        Self { message: message.into(), file: file.into(), line: None, hint: None }
    }

    /// The same error with advice on how to fix it.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    pub(crate) fn at(mut self, place: Option<SourceLine>) -> Self {
        if let Some(SourceLine { file, line }) = place {
            (self.file, self.line) = (file, Some(line));
        }
        self
    }
}

/// The last error object other than a string that a script raised. Lua itself would only print its address.
#[derive(Clone, Debug)]
pub(crate) struct RaisedObject {
    pub description: String,
    pub place: Option<SourceLine>,
}

impl VmState {
    /// The error as a script author should read it: file, line and message, without the machine's internals.
    pub(super) fn translate(&self, error: &mlua::Error) -> ScriptError {
        let trace = match error {
            mlua::Error::CallbackError { traceback, .. } => traceback.as_str(),
            _ => "",
        };
        match root(error) {
            mlua::Error::ExternalError(inner) if let Some(raised) = inner.downcast_ref::<ScriptError>() => {
                raised.clone()
            }
            mlua::Error::MemoryError(_) => {
                let mib = self.limits.memory_bytes >> 20;
                self.traced(format!("the script used more than its {mib} MiB of memory"), trace)
                    .hint("build smaller tables and strings, or keep fewer of them")
            }
            mlua::Error::SyntaxError { message, .. } => self.located("syntax error: ", message, ""),
            mlua::Error::RuntimeError(message) if is_address(message) => match &*lock(&self.raised) {
                Some(RaisedObject { description, place }) => {
                    self.traced(format!("error object {description}"), trace).at(place.clone())
                }
                None => self.traced("a value that is not a string was raised as an error".into(), trace),
            },
            mlua::Error::RuntimeError(message) => self.located("", message, trace),
            other => self.located("", &other.to_string(), trace),
        }
    }

    /// Reads `file:line: message` as Lua writes it.
    fn located(&self, prefix: &str, text: &str, trace: &str) -> ScriptError {
        let text = without_own_position(text);
        let (message, inner_trace) = text.split_once("\nstack traceback:").unwrap_or((text, ""));
        let Some((place, mut text)) = self.split_position(message) else {
            return self.traced(format!("{prefix}{}", message.trim()), &format!("{inner_trace}\n{trace}"));
        };
        // Every nested coroutine prepends its position.
        while let Some((inner, rest)) = self.split_position(text.trim())
            && inner == place
        {
            text = rest;
        }
        ScriptError::new(self.main.as_str(), format!("{prefix}{}", text.trim())).at(Some(place))
    }

    /// An error without a position of its own gets that of the innermost loaded file in the traceback.
    fn traced(&self, message: String, trace: &str) -> ScriptError {
        let place = trace.lines().find_map(|frame| self.split_position(frame.trim()));
        ScriptError::new(self.main.as_str(), message).at(place.map(|(place, _)| place))
    }

    /// Splits `file:line: rest` if the file is a loaded one.
    fn split_position<'t>(&self, text: &'t str) -> Option<(SourceLine, &'t str)> {
        let (at, _) = text.match_indices(':').find(|(at, _)| {
            let digits = text[at + 1..].bytes().take_while(u8::is_ascii_digit).count();
            digits > 0 && text[at + 1 + digits..].starts_with(':')
        })?;
        let (line, rest) = text[at + 1..].split_once(':')?;
        Some((SourceLine { file: self.file(&text[..at])?, line: line.parse().ok()? }, rest))
    }

    /// The loaded file of a name, which Lua shortens to `...tail` if it is long.
    fn file(&self, name: &str) -> Option<String> {
        let is_file = |file: &&String| match name.strip_prefix("...") {
            Some(tail) => file.ends_with(tail),
            None => *file == name,
        };
        lock(&self.library).bundle.files.keys().find(is_file).cloned()
    }
}

/// The message without the position in this module's own Lua code.
fn without_own_position(message: &str) -> &str {
    let inner = ["softvt:", "softvt.arm:"].iter().find_map(|name| message.strip_prefix(name));
    let split =
        inner.and_then(|rest| rest.split_once(": ")).filter(|(line, _)| line.parse::<usize>().is_ok());
    split.map_or(message, |(_, rest)| rest)
}

/// True if Lua could only print an address for the error value.
fn is_address(message: &str) -> bool {
    let first = message.lines().next().unwrap_or("");
    first == "<unprintable error>"
        || ["table", "function", "userdata", "thread", "nil", "boolean"].iter().any(|kind| {
            first.strip_prefix(kind).is_some_and(|rest| rest.is_empty() || rest.starts_with(": 0x"))
        })
}

/// The error itself, however deeply it is wrapped.
fn root(error: &mlua::Error) -> &mlua::Error {
    match error {
        mlua::Error::CallbackError { cause, .. } | mlua::Error::WithContext { cause, .. } => root(cause),
        mlua::Error::BadArgument { cause, .. } if matches!(root(cause), mlua::Error::ExternalError(_)) => {
            root(cause)
        }
        other => other,
    }
}

/// Main file of a virtual machine: the place of errors that no script line raised.
#[derive(Clone)]
pub(crate) struct MainFile(pub String);

/// Data of a virtual machine that was stored by `Lua::set_app_data`.
pub(crate) fn app_data<T: Clone + 'static>(lua: &Lua) -> mlua::Result<T> {
    let data = lua.app_data_ref::<T>().map(|data| data.clone());
    data.ok_or_else(|| mlua::Error::runtime("the virtual machine is incomplete"))
}

/// Line of the innermost script function on the stack.
pub(crate) fn current_line(lua: &Lua) -> Option<SourceLine> {
    running_lines(lua).next()
}

/// Line of the innermost function on the stack that is the author's own, and not of the embedded library below
/// `scripts/`. Without one, the outermost.
pub(crate) fn author_line(lua: &Lua) -> Option<SourceLine> {
    own_line(lua).or_else(|| running_lines(lua).last())
}

/// Line of the author's that called, from another file, the innermost script function on the stack. Without one, that
/// of [`author_line`].
pub(crate) fn caller_line(lua: &Lua) -> Option<SourceLine> {
    let own = current_line(lua)?;
    let mut lines = running_lines(lua);
    let caller = lines.find(|line| line.file != own.file && !is_library(lua, &line.file));
    caller.or_else(|| author_line(lua))
}

/// Line of the innermost function on the stack that is the author's own.
fn own_line(lua: &Lua) -> Option<SourceLine> {
    running_lines(lua).find(|line| !is_library(lua, &line.file))
}

/// True if the innermost script function on the stack is of the embedded library below `scripts/`.
pub(crate) fn library_is_running(lua: &Lua) -> bool {
    current_line(lua).is_some_and(|line| is_library(lua, &line.file))
}

/// True for a file of the embedded library below `scripts/`, other than the main file.
fn is_library(lua: &Lua, file: &str) -> bool {
    let main = app_data::<MainFile>(lua).map(|main| main.0).unwrap_or_default();
    let path = file.rfind("scripts/").map(|at| &file[at..]);
    file != main && path.is_some_and(|path| embedded(path).is_some())
}

/// Lines of the script functions on the stack, from the innermost.
fn running_lines(lua: &Lua) -> impl Iterator<Item = SourceLine> {
    (0..).map_while(|level| lua.inspect_stack(level, SourceLine::running)).flatten()
}

/// The error, at `place` if it is one of the host without a line: a tail call leaves no line on the stack.
pub(crate) fn placed(error: mlua::Error, place: Option<SourceLine>) -> mlua::Error {
    let host_error = match root(&error) {
        mlua::Error::ExternalError(inner) => inner.downcast_ref::<ScriptError>(),
        _ => None,
    };
    match host_error.filter(|raised| raised.line.is_none()) {
        Some(raised) => mlua::Error::external(raised.clone().at(place)),
        None => error,
    }
}

/// An error at the line that is running: the author's, if the library was called from there.
pub(crate) fn fail(lua: &Lua, message: impl fmt::Display) -> mlua::Error {
    fail_at(lua, own_line(lua).or_else(|| current_line(lua)), message)
}

/// An error at a line, or about the main file if the line is unknown.
pub(crate) fn fail_at(lua: &Lua, place: Option<SourceLine>, message: impl fmt::Display) -> mlua::Error {
    let main = app_data::<MainFile>(lua).map_or("script".into(), |main| main.0);
    mlua::Error::external(ScriptError::new(main, message.to_string()).at(place))
}
