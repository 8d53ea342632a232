//! A sandboxed virtual machine: what a script may reach, and how much memory and time it may use.

pub(crate) mod error;
pub(crate) mod json;
pub(crate) mod library;
pub(crate) mod list;
pub(crate) mod memory_budget;
pub(crate) mod random;
pub(crate) mod source_map;
pub(crate) mod value;
pub(crate) mod watchdog;

use std::{
    sync::{
        Arc, Mutex, OnceLock,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

use mlua::{
    FromLuaMulti, Function, IntoLuaMulti, Lua, LuaOptions, MultiValue, StdLib, Table, Value, chunk::ChunkMode,
};

use error::{Context, MainFile, RaisedObject, ScriptError, fail, here};
use library::Library;
use memory_budget::Budgets;
use random::MathRandom;
use value::{describe, literal};
use watchdog::{Clock, Deadline, OnStuck};

use crate::parallel::lock;

/// Bytes that a virtual machine may print; later output is dropped.
const MAX_PRINTED_BYTES: usize = 1 << 20;

/// Registry key of the base library as it was before scripts could change it.
const BASE_LIBRARY: &str = "softvt base library";

/// Destination of `print`: not standard output, which belongs to results.
pub type PrintSink = Arc<dyn Fn(&str) + Send + Sync>;

/// Resources of one virtual machine.
#[derive(Clone)]
pub struct Limits {
    /// Memory of Lua values, bytes.
    pub memory_bytes: usize,
    /// Lua time to load a script and make its plan.
    pub load: Duration,
    /// Lua time of one call: a layout, a shift, a control step of an expert. Physics that a binding runs is not counted.
    pub call: Duration,
    /// Lua time of one point of an experiment, likewise.
    pub point: Duration,
    /// Time after a limit during which the script may still stop by itself before it counts as stuck.
    pub grace: Duration,
    /// Called if a library function does not return.
    pub on_stuck: OnStuck,
    pub print: PrintSink,
}

static STUCK_HANDLER: OnceLock<OnStuck> = OnceLock::new();

/// Sets what happens if a library function of Lua (such as `string.find` with a hostile pattern) never returns. Nothing can
/// interrupt it, so a program should end. Without a handler a message is printed and the thread stays busy.
pub fn set_stuck_handler(handler: OnStuck) {
    // The first handler stays: there is one program per process.
    let _ = STUCK_HANDLER.set(handler);
}

impl Default for Limits {
    /// 256 MiB; 10 s to load, 5 s per call, 60 s per point; `print` to standard error.
    fn default() -> Self {
        Self {
            memory_bytes: 256 << 20,
            load: Duration::from_secs(10),
            call: Duration::from_secs(5),
            point: Duration::from_secs(60),
            grace: Duration::from_millis(1500),
            on_stuck: Arc::new(|message| match STUCK_HANDLER.get() {
                Some(handler) => handler(message),
                None => crate::text::eprint_line(message),
            }),
            print: Arc::new(|text| crate::text::eprint_line(&crate::text::escape_control(text))),
        }
    }
}

/// State that callbacks of a virtual machine share.
struct VmState {
    main: String,
    library: Arc<Mutex<Library>>,
    raised: Mutex<Option<RaisedObject>>,
    /// Bytes that `print` may still write.
    printable: AtomicUsize,
    limits: Limits,
}

/// A sandboxed virtual machine.
pub(crate) struct Vm {
    pub lua: Lua,
    pub random: MathRandom,
    /// The global table `softvt`.
    pub api: Table,
    clock: Clock,
    shared: Arc<VmState>,
}

impl Vm {
    /// A virtual machine that reads from `library`; errors without a position name the file `main`.
    pub(crate) fn new(main: &str, library: Library, limits: &Limits) -> Result<Self, ScriptError> {
        let shared = Arc::new(VmState {
            main: main.into(),
            library: Arc::new(Mutex::new(library)),
            raised: Mutex::new(None),
            printable: AtomicUsize::new(MAX_PRINTED_BYTES),
            limits: limits.clone(),
        });
        Self::build(&shared).map_err(|e| explain(&shared, &e))
    }

    fn build(shared: &Arc<VmState>) -> mlua::Result<Self> {
        let libs = StdLib::COROUTINE | StdLib::TABLE | StdLib::STRING | StdLib::UTF8 | StdLib::MATH;
        let lua = Lua::new_with(libs, LuaOptions::default())?;
        let clock = Clock::default();
        lua.set_memory_limit(shared.limits.memory_bytes)?;
        lua.set_app_data(shared.clone());
        lua.set_app_data(MainFile(shared.main.clone()));
        lua.set_app_data(shared.library.clone());
        lua.set_app_data(Budgets::default());
        lua.set_app_data(clock.clone());
        let api = lua.create_table()?;
        let host = lua.create_table()?;
        host.set("raised", lua.create_function(note_raised)?)?;
        host.set("words", lua.create_function(error_text)?)?;
        host.set("list", lua.create_function(iterable)?)?;
        lua.load(include_str!("prelude.lua"))
            .set_name("=softvt")
            .set_mode(ChunkMode::Text)
            .call::<()>(&host)?;
        api.set("sorted", host.get::<Function>("sorted")?)?;
        withhold(&lua)?;
        let tostring: Function = lua.globals().get("tostring")?;
        let print = lua.create_function(move |lua, values: MultiValue| print(lua, &tostring, values))?;
        lua.globals().set("print", print)?;
        keep_base_library(&lua)?;
        lua.globals().set("load", lua.create_function(load)?)?;
        let loaded = lua.create_table()?;
        let require = lua.create_function(move |lua, name: Value| require(lua, &loaded, &name))?;
        lua.globals().set("require", require)?;
        let random = MathRandom::install(&lua)?;
        lua.globals().set("softvt", &api)?;
        clock.install(&lua)?;
        Ok(Self { lua, clock, random, shared: shared.clone(), api })
    }

    /// The main file, as messages name it.
    pub(crate) fn main(&self) -> &str {
        &self.shared.main
    }

    pub(crate) fn library(&self) -> &Mutex<Library> {
        &self.shared.library
    }

    /// Runs the main file and returns its results.
    pub(crate) fn run_main(&self) -> Result<MultiValue, ScriptError> {
        let main = self.main();
        let text = lock(self.library()).text(main)?;
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
        let _deadline = self.call_deadline();
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

    /// Translates an error of the virtual machine for the author of the script.
    pub(crate) fn explain(&self, error: &mlua::Error) -> ScriptError {
        explain(&self.shared, error)
    }
}

fn explain(shared: &VmState, error: &mlua::Error) -> ScriptError {
    let files = lock(&shared.library).names();
    let raised = lock(&shared.raised).clone();
    let context =
        Context { main: &shared.main, files: &files, raised, memory_bytes: shared.limits.memory_bytes };
    context.explain(error)
}

fn shared(lua: &Lua) -> mlua::Result<Arc<VmState>> {
    let shared = lua.app_data_ref::<Arc<VmState>>().map(|shared| Arc::clone(&shared));
    shared.ok_or_else(|| mlua::Error::runtime("the virtual machine has no shared state"))
}

/// The clock of a virtual machine, which bindings pause while they work in Rust.
pub(crate) fn clock(lua: &Lua) -> Clock {
    lua.app_data_ref::<Clock>().map(|clock| clock.clone()).unwrap_or_default()
}

/// Removes functions that reach the outside or the machine's own state.
fn withhold(lua: &Lua) -> mlua::Result<()> {
    for name in ["dofile", "loadfile", "collectgarbage", "warn", "io", "os", "debug", "package", "loadstring"]
    {
        lua.globals().set(name, Value::Nil)?;
    }
    lua.globals().get::<Table>("string")?.set("dump", Value::Nil)
}

/// Stores a copy of the base library out of the reach of scripts, for the library's own Lua code.
fn keep_base_library(lua: &Lua) -> mlua::Result<()> {
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
    lua.set_named_registry_value(BASE_LIBRARY, base)
}

/// The base library as it was before scripts could change it.
pub(crate) fn base_library(lua: &Lua) -> mlua::Result<Table> {
    lua.named_registry_value(BASE_LIBRARY)
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
            MAX_PRINTED_BYTES >> 20
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
            return Err(fail(lua, format!("load: expected a string as name, got {}", describe(&other))));
        }
    };
    let env = match env {
        Value::Nil => None,
        Value::Table(env) => Some(env),
        other => {
            return Err(fail(lua, format!("load: expected a table as env, got {}", describe(&other))));
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
            return Err(fail(lua, format!("load: expected a string or function, got {}", describe(&other))));
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
    let name = name.to_string_lossy();
    let (file, text) = {
        let library = library::of(lua)?;
        let mut library = lock(&library);
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
            // A second attempt (inside a pcall) must fail in the same way, not as a circle.
            loaded.set(file.as_str(), Value::Nil)?;
            return Err(error);
        }
    };
    loaded.set(file.as_str(), &value)?;
    Ok(value)
}

/// The table that `pairs` and `softvt.sorted` iterate over: the value itself, or the entries of a list of the host.
fn iterable(lua: &Lua, (label, value): (String, Value)) -> mlua::Result<Value> {
    match list::plain(lua, &value)? {
        Value::Table(table) => Ok(Value::Table(table)),
        other => Err(fail(lua, format!("{label}: expected a table, got {}", describe(&other)))),
    }
}

/// The text of an error of the host; any other value as it is.
fn error_text(lua: &Lua, value: Value) -> mlua::Result<Value> {
    let Value::Error(error) = &value else { return Ok(value) };
    let text = explain(&*shared(lua)?, error).to_string();
    lua.create_string(text).map(Value::String)
}

/// Keeps a description of an error object, of which Lua would only keep the address.
fn note_raised(lua: &Lua, object: Value) -> mlua::Result<()> {
    let description = literal(&object, 0);
    *lock(&shared(lua)?.raised) = Some(RaisedObject { description, file: here(lua) });
    Ok(())
}
