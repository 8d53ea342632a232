//! Errors of scripts: raised by the host at the script's line, and translated from what the virtual machine reports.

use std::fmt;

use mlua::Lua;

/// An error in a script or in its use; always names the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScriptError {
    /// A lower-case fragment.
    pub message: String,
    /// The file, as the user names it.
    pub file: String,
    /// Line in the file, from 1, where known.
    pub line: Option<usize>,
    /// Suggestion for a fix.
    pub hint: Option<String>,
}

impl std::error::Error for ScriptError {}

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
    /// An error about `file` as a whole.
    pub fn new(file: impl Into<String>, message: impl Into<String>) -> Self {
        Self { message: message.into(), file: file.into(), line: None, hint: None }
    }

    /// The same error with advice on how to fix it.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// The same error at another file and line, if they are known.
    pub(crate) fn found_at(mut self, place: Option<(String, usize)>) -> Self {
        if let Some((file, line)) = place {
            (self.file, self.line) = (file, Some(line));
        }
        self
    }

    /// The same error at `line` (from 1).
    pub fn at(mut self, line: Option<usize>) -> Self {
        self.line = line;
        self
    }
}

/// The last error object other than a string that a script raised. Lua itself would only print its address.
#[derive(Clone, Debug)]
pub(crate) struct RaisedObject {
    pub description: String,
    pub file: Option<(String, usize)>,
}

/// Translates errors of the virtual machine.
pub(crate) struct Context<'a> {
    /// The main file.
    pub main: &'a str,
    /// Every loaded file.
    pub files: &'a [String],
    pub raised: Option<RaisedObject>,
    /// Memory limit, bytes.
    pub memory_bytes: usize,
}

impl Context<'_> {
    /// The error as a script author should read it: file, line and message, without the machine's internals.
    pub(crate) fn explain(&self, error: &mlua::Error) -> ScriptError {
        if let Some(own) = own(error) {
            return own;
        }
        let trace = traceback(error);
        match root(error) {
            mlua::Error::MemoryError(_) => self.memory(&trace),
            mlua::Error::SyntaxError { message, .. } => self.located(&format!("syntax error: {message}"), ""),
            mlua::Error::RuntimeError(message) if is_address(message) => self.object(&trace),
            mlua::Error::RuntimeError(message) => self.located(message, &trace),
            other => self.located(&other.to_string(), &trace),
        }
    }

    fn memory(&self, trace: &str) -> ScriptError {
        let mib = self.memory_bytes >> 20;
        self.traced(format!("the script used more than its {mib} MiB of memory"), trace)
            .hint("build smaller tables and strings, or keep fewer of them")
    }

    fn object(&self, trace: &str) -> ScriptError {
        let Some(raised) = &self.raised else {
            return self.traced("a value that is not a string was raised as an error".into(), trace);
        };
        let message = format!("error object {}", raised.description);
        match &raised.file {
            Some((file, line)) => ScriptError::new(file.clone(), message).at(Some(*line)),
            None => self.traced(message, trace),
        }
    }

    /// Reads `file:line: message` (after an optional `syntax error: `) as Lua writes it.
    fn located(&self, text: &str, trace: &str) -> ScriptError {
        let (prefix, rest) = match text.strip_prefix("syntax error: ") {
            Some(rest) => ("syntax error: ", rest),
            None => ("", text),
        };
        let rest = without_own_position(rest);
        let (message, inner_trace) = rest.split_once("\nstack traceback:").unwrap_or((rest, ""));
        match self.position(message) {
            Some((file, line, mut text)) => {
                // Every nested coroutine prepends its position.
                while let Some((_, _, inner)) =
                    self.position(text.trim()).filter(|(f, l, _)| *f == file && *l == line)
                {
                    text = inner;
                }
                ScriptError::new(file, format!("{prefix}{}", text.trim())).at(Some(line))
            }
            None => self.traced(format!("{prefix}{}", message.trim()), &format!("{inner_trace}\n{trace}")),
        }
    }

    /// An error without a position of its own gets that of the innermost loaded file in the traceback.
    fn traced(&self, message: String, trace: &str) -> ScriptError {
        let place = trace.lines().find_map(|frame| self.position(frame.trim()));
        match place {
            Some((file, line, _)) => ScriptError::new(file, message).at(Some(line)),
            None => ScriptError::new(self.main, message),
        }
    }

    fn position<'t>(&self, text: &'t str) -> Option<(String, usize, &'t str)> {
        let (at, _) = text.match_indices(':').find(|(at, _)| {
            let digits = text[at + 1..].bytes().take_while(u8::is_ascii_digit).count();
            digits > 0 && text[at + 1 + digits..].starts_with(':')
        })?;
        let (line, said) = text[at + 1..].split_once(':')?;
        Some((self.file(&text[..at])?, line.parse().ok()?, said))
    }

    /// The loaded file of a name, which Lua shortens to `...tail` if it is long.
    fn file(&self, name: &str) -> Option<String> {
        let tail = name.strip_prefix("...");
        let known = self.files.iter().find(|file| match tail {
            Some(tail) => file.ends_with(tail),
            None => *file == name,
        });
        known.cloned()
    }
}

/// The message without the position in this module's own Lua code.
fn without_own_position(message: &str) -> &str {
    let inner = ["softvt:", "softvt.arm:"].iter().find_map(|name| message.strip_prefix(name));
    let said = inner.and_then(|rest| rest.split_once(": ")).filter(|(line, _)| line.parse::<usize>().is_ok());
    said.map_or(message, |(_, said)| said)
}

/// True if Lua could only print an address for the error value.
fn is_address(message: &str) -> bool {
    let first = message.lines().next().unwrap_or("");
    first == "<unprintable error>"
        || ["table", "function", "userdata", "thread", "nil", "boolean"].iter().any(|kind| {
            first.strip_prefix(kind).is_some_and(|rest| rest.is_empty() || rest.starts_with(": 0x"))
        })
}

/// An error raised by the host, however deeply it is wrapped.
fn own(error: &mlua::Error) -> Option<ScriptError> {
    match root(error) {
        mlua::Error::ExternalError(inner) => inner.downcast_ref::<ScriptError>().cloned(),
        _ => None,
    }
}

fn root(error: &mlua::Error) -> &mlua::Error {
    match error {
        mlua::Error::CallbackError { cause, .. } | mlua::Error::WithContext { cause, .. } => root(cause),
        mlua::Error::BadArgument { cause, .. } if matches!(root(cause), mlua::Error::ExternalError(_)) => {
            root(cause)
        }
        other => other,
    }
}

fn traceback(error: &mlua::Error) -> String {
    match error {
        mlua::Error::CallbackError { traceback, .. } => traceback.clone(),
        _ => String::new(),
    }
}

/// Main file of a virtual machine: the place of errors that no script line raised.
pub(crate) struct MainFile(pub String);

/// File and line of the innermost script function on the stack.
pub(crate) fn here(lua: &Lua) -> Option<(String, usize)> {
    let mut level = 0;
    loop {
        let frame = lua.inspect_stack(level, |frame| {
            let source = frame.source().source?.strip_prefix('@')?.to_string();
            Some((source, frame.current_line()?))
        })?;
        if frame.is_some() {
            return frame;
        }
        level += 1;
    }
}

/// [`here`] as messages name it: `file:line`.
pub(crate) fn here_text(lua: &Lua) -> Option<String> {
    here(lua).map(|(file, line)| format!("{file}:{line}"))
}

/// An error at the line of the script that is running.
pub(crate) fn fail(lua: &Lua, message: impl Into<String>) -> mlua::Error {
    let error = match here(lua) {
        Some((file, line)) => ScriptError::new(file, message).at(Some(line)),
        None => {
            let main = lua.app_data_ref::<MainFile>().map(|main| main.0.clone());
            ScriptError::new(main.unwrap_or_else(|| "script".into()), message)
        }
    };
    mlua::Error::external(error)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn explain(error: mlua::Error) -> String {
        let files = ["suites/x.lua".to_string(), "/a/very/long/way/down/lib.lua".to_string()];
        let context = Context { main: "suites/x.lua", files: &files, raised: None, memory_bytes: 1 << 20 };
        context.explain(&error).to_string()
    }

    #[test]
    fn runtime_errors_keep_their_position_and_lose_their_traceback() {
        let raw = "suites/x.lua:3: attempt to index a nil value\nstack traceback:\n\t[C]: in ?";
        assert_eq!(
            explain(mlua::Error::RuntimeError(raw.into())),
            "suites/x.lua:3: attempt to index a nil value"
        );
    }

    #[test]
    fn shortened_file_names_are_restored() {
        let raw = "...way/down/lib.lua:7: oh";
        assert_eq!(explain(mlua::Error::RuntimeError(raw.into())), "/a/very/long/way/down/lib.lua:7: oh");
    }

    #[test]
    fn repeated_positions_are_shown_once() {
        let raw = "suites/x.lua:3: suites/x.lua:3: suites/x.lua:3: oh";
        assert_eq!(explain(mlua::Error::RuntimeError(raw.into())), "suites/x.lua:3: oh");
        let raw = "suites/x.lua:3: suites/x.lua:5: oh";
        assert_eq!(explain(mlua::Error::RuntimeError(raw.into())), raw);
    }

    #[test]
    fn errors_without_position_are_placed_by_the_traceback() {
        let raw = "oh\nstack traceback:\n\t[C]: in ?\n\tsuites/x.lua:9: in main chunk";
        assert_eq!(explain(mlua::Error::RuntimeError(raw.into())), "suites/x.lua:9: oh");
    }
}
