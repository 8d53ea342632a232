//! What went wrong in a script, said for the person who wrote it.

use std::fmt;

/// A failure caused by a script or by what was asked of it; always names the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScriptError {
    /// What is wrong, a lower-case fragment.
    pub message: String,
    /// The file, as the user names it.
    pub file: String,
    /// Line in the file, from 1, where known.
    pub line: Option<usize>,
    /// How to mend it.
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

    /// The same error with advice on how to mend it.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// The same error in the file and on the line where it was found, if they are known.
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

/// The last error object that a script raised which is not a string: Lua itself would only print its address.
#[derive(Clone, Debug)]
pub(crate) struct RaisedObject {
    pub description: String,
    pub file: Option<(String, usize)>,
}

/// What is needed to turn an error of the virtual machine into one for people.
pub(crate) struct Context<'a> {
    /// The script that was started.
    pub main: &'a str,
    /// Every loaded file.
    pub files: &'a [String],
    /// See [`RaisedObject`].
    pub raised: Option<RaisedObject>,
    /// Memory limit, bytes.
    pub memory_bytes: usize,
}

impl Context<'_> {
    /// Strips what only an implementer of the virtual machine would want to read.
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
            Some((file, line, mut said)) => {
                // A coroutine in a coroutine puts its place before that of the inner one.
                while let Some((_, _, inner)) =
                    self.position(said.trim()).filter(|(f, l, _)| *f == file && *l == line)
                {
                    said = inner;
                }
                ScriptError::new(file, format!("{prefix}{}", said.trim())).at(Some(line))
            }
            None => self.traced(format!("{prefix}{}", message.trim()), &format!("{inner_trace}\n{trace}")),
        }
    }

    /// An error without a position of its own is put where the innermost loaded file of the trace stands.
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

    /// Lua shortens long names to `...tail`; the loaded file is the one that ends so.
    fn file(&self, name: &str) -> Option<String> {
        let tail = name.strip_prefix("...");
        let known = self.files.iter().find(|file| match tail {
            Some(tail) => file.ends_with(tail),
            None => *file == name,
        });
        known.cloned()
    }
}

/// The message without the line of this room's own Lua, where that failed for what a script gave it.
fn without_own_position(message: &str) -> &str {
    let inner = ["softvt:", "softvt.arm:"].iter().find_map(|name| message.strip_prefix(name));
    let said = inner.and_then(|rest| rest.split_once(": ")).filter(|(line, _)| line.parse::<usize>().is_ok());
    said.map_or(message, |(_, said)| said)
}

/// Whether Lua could only print an address for the error value.
fn is_address(message: &str) -> bool {
    let first = message.lines().next().unwrap_or("");
    first == "<unprintable error>"
        || ["table", "function", "userdata", "thread", "nil", "boolean"].iter().any(|kind| {
            first.strip_prefix(kind).is_some_and(|rest| rest.is_empty() || rest.starts_with(": 0x"))
        })
}

/// An error that this room raised itself, however deep it is wrapped.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn explain(error: mlua::Error) -> String {
        let files = ["suites/x.lua".to_string(), "/a/very/long/way/down/lib.lua".to_string()];
        let context = Context { main: "suites/x.lua", files: &files, raised: None, memory_bytes: 1 << 20 };
        context.explain(&error).to_string()
    }

    #[test]
    fn a_runtime_error_keeps_its_position_and_loses_its_traceback() {
        let raw = "suites/x.lua:3: attempt to index a nil value\nstack traceback:\n\t[C]: in ?";
        assert_eq!(
            explain(mlua::Error::RuntimeError(raw.into())),
            "suites/x.lua:3: attempt to index a nil value"
        );
    }

    #[test]
    fn a_shortened_name_is_restored() {
        let raw = "...way/down/lib.lua:7: oh";
        assert_eq!(explain(mlua::Error::RuntimeError(raw.into())), "/a/very/long/way/down/lib.lua:7: oh");
    }

    #[test]
    fn a_place_that_is_said_again_is_said_once() {
        let raw = "suites/x.lua:3: suites/x.lua:3: suites/x.lua:3: oh";
        assert_eq!(explain(mlua::Error::RuntimeError(raw.into())), "suites/x.lua:3: oh");
        let raw = "suites/x.lua:3: suites/x.lua:5: oh";
        assert_eq!(explain(mlua::Error::RuntimeError(raw.into())), raw);
    }

    #[test]
    fn an_error_without_position_is_placed_by_the_traceback() {
        let raw = "oh\nstack traceback:\n\t[C]: in ?\n\tsuites/x.lua:9: in main chunk";
        assert_eq!(explain(mlua::Error::RuntimeError(raw.into())), "suites/x.lua:9: oh");
    }
}
