//! One virtual machine: what a script may reach, how much memory and time it may use.

pub(crate) mod error;
pub(crate) mod json;
pub(crate) mod library;
pub(crate) mod list;
pub(crate) mod memory_budget;
pub(crate) mod origin;
pub(crate) mod position;
pub(crate) mod random;
pub(crate) mod watchdog;

use std::{
    collections::BTreeSet,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

use mlua::{
    FromLuaMulti, Function, IntoLuaMulti, Lua, LuaOptions, MultiValue, StdLib, Table, Value, chunk::ChunkMode,
};

use crate::script::{
    schema,
    vm::error::{Context, RaisedObject, ScriptError},
    vm::library::Library,
    vm::list as lists,
    vm::memory_budget::Budgets,
    vm::random::MathRandom,
    vm::watchdog::{Clock, Deadline, OnStuck, end_process},
};

/// Bytes that a machine may print; the rest of a flood is left out.
const MOST_PRINTED: usize = 1 << 20;

/// Registry key of the base library as it was before a script could change it.
const BASE: &str = "softvt base library";

/// Where `print` goes; not the standard output, which belongs to results.
pub type Print = Arc<dyn Fn(&str) + Send + Sync>;

/// What one virtual machine may use.
#[derive(Clone)]
pub struct Limits {
    /// Memory of Lua values, bytes.
    pub memory_bytes: usize,
    /// Time to load a script and make its plan.
    pub load: Duration,
    /// Lua time of one call: a layout, a shift, a control step of an expert (physics that a binding runs is not counted).
    pub call: Duration,
    /// Lua time of one point of an experiment, likewise.
    pub point: Duration,
    /// How long after a limit the script may still stop by itself before it counts as stuck.
    pub grace: Duration,
    /// What happens when a library function does not return.
    pub on_stuck: OnStuck,
    /// Where `print` goes.
    pub print: Print,
}

impl Default for Limits {
    /// 256 MiB, 10 s to load, 5 s a call, 60 s a point; a stuck function ends the process with code 2; `print` to standard error.
    fn default() -> Self {
        Self {
            memory_bytes: 256 << 20,
            load: Duration::from_secs(10),
            call: Duration::from_secs(5),
            point: Duration::from_secs(60),
            grace: Duration::from_millis(1500),
            on_stuck: end_process(),
            print: Arc::new(|text| crate::text::eprint_line(&crate::text::escape_control(text))),
        }
    }
}

/// What callbacks of a machine share.
pub(crate) struct Shared {
    pub main: String,
    pub library: Mutex<Library>,
    pub budgets: Budgets,
    raised: Mutex<Option<RaisedObject>>,
    /// Bytes that `print` may still write.
    printable: AtomicUsize,
    limits: Limits,
}

pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A sandboxed virtual machine.
pub(crate) struct Vm {
    pub lua: Lua,
    pub clock: Clock,
    pub random: MathRandom,
    pub shared: Arc<Shared>,
    /// The table that becomes the global `softvt`.
    pub api: Table,
}

impl Vm {
    /// A machine that reads from `library`; `main` is the file that messages fall back to.
    pub(crate) fn new(main: &str, library: Library, limits: &Limits) -> Result<Self, ScriptError> {
        let shared = Arc::new(Shared {
            main: main.into(),
            library: Mutex::new(library),
            budgets: Budgets::default(),
            raised: Mutex::new(None),
            printable: AtomicUsize::new(MOST_PRINTED),
            limits: limits.clone(),
        });
        Self::build(&shared).map_err(|e| explain(&shared, &e))
    }

    fn build(shared: &Arc<Shared>) -> mlua::Result<Self> {
        let libs = StdLib::COROUTINE | StdLib::TABLE | StdLib::STRING | StdLib::UTF8 | StdLib::MATH;
        let lua = Lua::new_with(libs, LuaOptions::default())?;
        lua.set_memory_limit(shared.limits.memory_bytes)?;
        lua.set_app_data(shared.clone());
        let api = lua.create_table()?;
        let host = lua.create_table()?;
        host.set("raised", lua.create_function(note_raised)?)?;
        host.set("words", lua.create_function(words)?)?;
        host.set("list", lua.create_function(to_go_through)?)?;
        lua.load(include_str!("prelude.lua"))
            .set_name("=softvt")
            .set_mode(ChunkMode::Text)
            .call::<()>(&host)?;
        api.set("sorted", host.get::<Function>("sorted")?)?;
        withhold(&lua)?;
        let tostring: Function = lua.globals().get("tostring")?;
        let print = lua.create_function(move |lua, values: MultiValue| print(lua, &tostring, values))?;
        lua.globals().set("print", print)?;
        keep_base(&lua)?;
        lua.globals().set("load", lua.create_function(load)?)?;
        let loaded = lua.create_table()?;
        let require = lua.create_function(move |lua, name: Value| require(lua, &loaded, &name))?;
        lua.globals().set("require", require)?;
        let random = MathRandom::install(&lua)?;
        lua.globals().set("softvt", &api)?;
        let clock = Clock::default();
        clock.install(&lua)?;
        Ok(Self { lua, clock, random, shared: shared.clone(), api })
    }

    /// Runs the main file and gives what it returns.
    pub(crate) fn run_main(&self) -> Result<MultiValue, ScriptError> {
        let main = &self.shared.main;
        let text = locked(&self.shared.library).text(main)?;
        let _deadline = self.deadline(self.shared.limits.load);
        let chunk = self.lua.load(text).set_name(format!("@{main}")).set_mode(ChunkMode::Text);
        // Not `eval`, which would first try the text as an expression and lose the frame of `error(…)` in a tail call.
        chunk.call(()).map_err(|e| self.explain(&e))
    }

    /// Calls a function of the script within the time of one call.
    pub(crate) fn call<R: FromLuaMulti>(
        &self,
        function: &Function,
        args: impl IntoLuaMulti,
    ) -> Result<R, ScriptError> {
        let _deadline = self.deadline(self.shared.limits.call);
        function.call(args).map_err(|e| self.explain(&e))
    }

    /// Calls a function of an experiment within the time of one point.
    pub(crate) fn call_point<R: FromLuaMulti>(
        &self,
        function: &Function,
        args: impl IntoLuaMulti,
    ) -> Result<R, ScriptError> {
        let _deadline = self.deadline(self.shared.limits.point);
        function.call(args).map_err(|e| self.explain(&e))
    }

    /// Starts the time of one call.
    pub(crate) fn call_deadline(&self) -> Deadline {
        self.deadline(self.shared.limits.call)
    }

    fn deadline(&self, limit: Duration) -> Deadline {
        let limits = &self.shared.limits;
        self.clock.start(limit, limits.grace, &self.shared.main, limits.on_stuck.clone())
    }

    /// An error of the machine for people.
    pub(crate) fn explain(&self, error: &mlua::Error) -> ScriptError {
        explain(&self.shared, error)
    }
}

fn explain(shared: &Shared, error: &mlua::Error) -> ScriptError {
    let files = locked(&shared.library).names();
    let raised = locked(&shared.raised).clone();
    let context =
        Context { main: &shared.main, files: &files, raised, memory_bytes: shared.limits.memory_bytes };
    context.explain(error)
}

/// What callbacks of `lua` share; an error only in a machine that this room did not make.
pub(crate) fn shared(lua: &Lua) -> mlua::Result<Arc<Shared>> {
    let shared = lua.app_data_ref::<Arc<Shared>>().map(|s| Arc::clone(&s));
    shared.ok_or_else(|| mlua::Error::runtime("the machine has no library"))
}

/// Takes away what reaches the outside or the machine's own state.
fn withhold(lua: &Lua) -> mlua::Result<()> {
    for name in ["dofile", "loadfile", "collectgarbage", "warn", "io", "os", "debug", "package", "loadstring"]
    {
        lua.globals().set(name, Value::Nil)?;
    }
    lua.globals().get::<Table>("string")?.set("dump", Value::Nil)
}

/// File and line of the innermost script on the stack: the call that a message is about.
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

/// An error at the script's call that is running now.
pub(crate) fn fail(lua: &Lua, message: impl Into<String>) -> mlua::Error {
    let error = match here(lua) {
        Some((file, line)) => ScriptError::new(file, message).at(Some(line)),
        None => {
            let main = shared(lua).map(|s| s.main.clone()).unwrap_or_else(|_| "script".into());
            ScriptError::new(main, message)
        }
    };
    mlua::Error::external(error)
}

/// Puts a copy of the base library where scripts do not reach it: the library's own Lua runs on that.
fn keep_base(lua: &Lua) -> mlua::Result<()> {
    let base = lua.create_table()?;
    for entry in lua.globals().pairs::<Value, Value>() {
        let (name, value) = entry?;
        let value = match &value {
            Value::Table(library) if name.as_string().is_some_and(|name| name != "_G") => {
                Value::Table(lua.create_table_from(library.pairs::<Value, Value>().flatten())?)
            }
            _ => value,
        };
        base.set(name, value)?;
    }
    lua.set_named_registry_value(BASE, base)
}

/// The base library as it was before a script could change it.
pub(crate) fn base(lua: &Lua) -> mlua::Result<Table> {
    lua.named_registry_value(BASE)
}

fn print(lua: &Lua, tostring: &Function, values: MultiValue) -> mlua::Result<()> {
    let shared = shared(lua)?;
    let mut line = String::new();
    for (index, value) in values.into_iter().enumerate() {
        if index > 0 {
            line.push('\t');
        }
        line.push_str(&tostring.call::<mlua::LuaString>(value)?.to_string_lossy());
    }
    let left = shared.printable.load(Ordering::Relaxed);
    if line.len() < left {
        shared.printable.store(left - line.len() - 1, Ordering::Relaxed);
        (shared.limits.print)(&line);
    } else if shared.printable.swap(0, Ordering::Relaxed) > 0 {
        (shared.limits.print)(&format!(
            "… the script prints more than {} MiB; the rest is left out",
            MOST_PRINTED >> 20
        ));
    }
    Ok(())
}

/// `load(chunk [, name [, mode [, env]]])` for text alone; as in Lua, a bad chunk gives nil and the message.
fn load(lua: &Lua, (chunk, name, _mode, env): (Value, Value, Value, Value)) -> mlua::Result<(Value, Value)> {
    let name = match name {
        Value::Nil => "=(load)".to_owned(),
        Value::String(name) => name.to_string_lossy(),
        other => {
            return Err(fail(lua, format!("load: expected a string as name, got {}", schema::got(&other))));
        }
    };
    let env = match env {
        Value::Nil => None,
        Value::Table(env) => Some(env),
        other => {
            return Err(fail(lua, format!("load: expected a table as env, got {}", schema::got(&other))));
        }
    };
    let mut bytes = Vec::new();
    match chunk {
        Value::String(text) => bytes.extend_from_slice(&text.as_bytes()),
        Value::Function(pieces) => loop {
            match pieces.call::<Value>(())? {
                Value::String(piece) if !piece.as_bytes().is_empty() => {
                    bytes.extend_from_slice(&piece.as_bytes())
                }
                _ => break,
            }
        },
        other => {
            return Err(fail(
                lua,
                format!("load: expected a string or function, got {}", schema::got(&other)),
            ));
        }
    }
    let refusal = |text: String| Ok((Value::Nil, Value::String(lua.create_string(text)?)));
    if bytes.first() == Some(&0x1b) {
        return refusal("load: compiled byte code is refused; only Lua source text is run".into());
    }
    let mut built = lua.load(bytes).set_name(name).set_mode(ChunkMode::Text);
    if let Some(env) = env {
        built = built.set_environment(env);
    }
    match built.into_function() {
        Ok(function) => Ok((Value::Function(function), Value::Nil)),
        Err(mlua::Error::SyntaxError { message, .. }) => refusal(message),
        Err(other) => Err(other),
    }
}

fn require(lua: &Lua, loaded: &Table, name: &Value) -> mlua::Result<Value> {
    let Value::String(name) = name else {
        return Err(fail(lua, format!("require: expected a module name, got a {}", name.type_name())));
    };
    let name = name.to_string_lossy().to_string();
    let shared = shared(lua)?;
    let (file, text) = {
        let mut library = locked(&shared.library);
        let file = library.module(&name).map_err(|message| fail(lua, message))?;
        let text = library.text(&file).map_err(mlua::Error::external)?;
        (file, text)
    };
    match loaded.get::<Value>(file.as_str())? {
        Value::Nil => {}
        Value::Boolean(false) => {
            return Err(fail(lua, format!("require {name:?}: the modules require each other in a circle")));
        }
        value => return Ok(value),
    }
    loaded.set(file.as_str(), false)?;
    let chunk = lua.load(text).set_name(format!("@{file}")).set_mode(ChunkMode::Text);
    let value = match chunk.call::<Value>(name) {
        Ok(Value::Nil | Value::Boolean(false)) => Value::Boolean(true),
        Ok(value) => value,
        Err(error) => {
            // Tried again (inside a pcall) it must fail the same way, not as a circle.
            loaded.set(file.as_str(), Value::Nil)?;
            return Err(error);
        }
    };
    loaded.set(file.as_str(), &value)?;
    Ok(value)
}

/// What `pairs` and its like go through: a table, or the entries of a list of the host.
fn to_go_through(lua: &Lua, (place, value): (String, Value)) -> mlua::Result<Value> {
    match lists::plain(lua, &value)? {
        Value::Table(table) => Ok(Value::Table(table)),
        other => Err(fail(lua, format!("{place}: expected a table, got {}", schema::got(&other)))),
    }
}

/// An error of the host as the text that people would read; any other value as it is.
fn words(lua: &Lua, value: Value) -> mlua::Result<Value> {
    let Value::Error(error) = &value else { return Ok(value) };
    let shared = shared(lua)?;
    let text = explain(&shared, error).to_string();
    lua.create_string(text).map(Value::String)
}

/// Keeps a description of an error object, since its address is all that would be left of it later.
fn note_raised(lua: &Lua, object: Value) -> mlua::Result<()> {
    let description = describe(&object, 0);
    *locked(&shared(lua)?.raised) = Some(RaisedObject { description, file: here(lua) });
    Ok(())
}

/// A short text of a value as a Lua constant, keys sorted, without addresses.
pub(crate) fn describe(value: &Value, depth: usize) -> String {
    match value {
        Value::String(text) => format!("{:?}", text.to_string_lossy()),
        Value::Integer(number) => number.to_string(),
        Value::Number(number) => number.to_string(),
        Value::Boolean(flag) => flag.to_string(),
        Value::Table(table) if depth < 2 => {
            let mut entries = BTreeSet::new();
            let mut list = Vec::new();
            for (key, value) in table.pairs::<Value, Value>().flatten().take(64) {
                match key {
                    Value::Integer(index) if index >= 1 => list.push((index, describe(&value, depth + 1))),
                    Value::String(key) => {
                        entries.insert(format!(
                            "{} = {}",
                            key.to_string_lossy(),
                            describe(&value, depth + 1)
                        ));
                    }
                    _ => {}
                }
            }
            list.sort();
            let parts = list.into_iter().map(|(_, text)| text).chain(entries).take(8);
            format!("{{{}}}", parts.collect::<Vec<_>>().join(", "))
        }
        Value::Nil => "nil".into(),
        other => schema::kind(other),
    }
}
