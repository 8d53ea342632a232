//! A sandboxed virtual machine: what a script may reach, and how much memory and time it may use.

#[macro_use]
pub(crate) mod error;
pub(crate) mod json;
pub(crate) mod library;
pub(crate) mod list;
pub(crate) mod memory_budget;
pub(crate) mod privilege;
pub(crate) mod source_map;
pub(crate) mod value;
pub(crate) mod watchdog;

use std::{
    collections::BTreeSet,
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

use mlua::{
    FromLuaMulti, Function, IntoLuaMulti, Lua, LuaOptions, LuaString, MultiValue, StdLib, Table, Value,
    chunk::ChunkMode,
};
use rand_chacha::{ChaCha8Rng, rand_core::RngCore};

use error::{MainFile, RaisedObject, ScriptError, app_data, current_line, fail};
use library::{Library, SharedLibrary, lua_text};
use memory_budget::MemoryUse;
use privilege::{PrivilegedAccess, check_module};
use value::{describe, literal, sorted_pairs};
use watchdog::{Clock, ClockGuard, StuckHandler};

use softvt_benchmark::seed;
use softvt_common::{
    parallel::lock,
    text::{eprint_line, escape_control, suggest, unknown_name},
};

/// Bytes that a virtual machine may print; later output is dropped.
const MAX_PRINTED_BYTES: usize = 1 << 20;

/// Registry key of the base library as it was before scripts could change it.
const BASE_LIBRARY: &str = "softvt base library";

/// Destination of `print`: not standard output, which belongs to results.
pub type PrintSink = Arc<dyn Fn(&str) + Send + Sync>;

#[derive(Clone)]
pub struct VmLimits {
    pub memory_bytes: usize,
    /// Lua time to load a script and make its plan.
    pub load: Duration,
    /// Lua time of one call: a layout, a shift, a control step of an expert. Physics that a binding
    /// runs is not counted.
    pub call: Duration,
    /// Lua time of one point of an experiment, likewise.
    pub point: Duration,
    /// Time after a limit during which the script may still stop by itself before it counts as stuck.
    pub grace: Duration,
    pub on_stuck: StuckHandler,
    pub print: PrintSink,
}

impl std::fmt::Debug for VmLimits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("VmLimits").field("memory_bytes", &self.memory_bytes).finish_non_exhaustive()
    }
}

impl Default for VmLimits {
    /// 256 MiB; 10 s to load, 5 s per call, 60 s per point; `print` to standard error. A library function that does not
    /// return ends the process, since nothing can interrupt it.
    fn default() -> Self {
        Self {
            memory_bytes: 256 << 20,
            load: Duration::from_secs(10),
            call: Duration::from_secs(5),
            point: Duration::from_secs(60),
            grace: Duration::from_millis(1500),
            on_stuck: Arc::new(|message| {
                eprint_line(&escape_control(&format!("softvt: {message}")));
                std::process::exit(2);
            }),
            print: Arc::new(|text| eprint_line(&escape_control(text))),
        }
    }
}

/// Names of Lua's library that scripts do not have.
const UNAVAILABLE: [&str; 6] = ["os", "io", "debug", "package", "dofile", "loadfile"];

/// The keywords of Lua (Lua 5.4 Reference Manual, 3.1).
const KEYWORDS: [&str; 22] = [
    "and", "break", "do", "else", "elseif", "end", "false", "for", "function", "goto", "if", "in", "local",
    "nil", "not", "or", "repeat", "return", "then", "true", "until", "while",
];

/// The name in an error of [`refuse_undefined_variables`].
fn undefined_variable(message: &str) -> Option<&str> {
    message.strip_prefix("the variable \"")?.strip_suffix("\" is not defined")
}

struct VmState {
    main: String,
    library: SharedLibrary,
    raised: Mutex<Option<RaisedObject>>,
    /// Bytes that `print` may still write.
    printable: AtomicUsize,
    limits: VmLimits,
}

impl VmState {
    /// Translates an error of the virtual machine for the author of the script.
    fn explain(&self, error: &mlua::Error) -> ScriptError {
        let error = self.translate(error);
        if let Some(name) = undefined_variable(&error.message).filter(|name| UNAVAILABLE.contains(name)) {
            let message =
                format!("{name} is not available to scripts, which reach neither files nor the clock");
            return ScriptError { message, ..error };
        }
        match self.close_name(&error) {
            Some(close) if error.hint.is_none() => error.hint(format!("did you mean {close:?}?")),
            _ => error,
        }
    }

    /// A word of the file that is close to the unknown global name of an error.
    fn close_name(&self, error: &ScriptError) -> Option<String> {
        let unknown = undefined_variable(&error.message)?;
        let text = lock(&self.library).text(&error.file).ok()?;
        let words: BTreeSet<&str> = text
            .split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
            .filter(|word| !word.is_empty() && *word != unknown && !KEYWORDS.contains(word))
            .collect();
        suggest(unknown, words.into_iter()).map(str::to_owned)
    }
}

pub(crate) struct Vm {
    pub lua: Lua,
    pub random: MathRandom,
    /// The global table `softvt`.
    pub api: Table,
    pub library: SharedLibrary,
    pub privilege: PrivilegedAccess,
    clock: Clock,
    state: Arc<VmState>,
}

impl Vm {
    /// A virtual machine that reads from `library`; errors without a position name the file `main`.
    pub(crate) fn new(main: &str, library: Library, limits: &VmLimits) -> Result<Self, ScriptError> {
        let state = Arc::new(VmState {
            main: main.into(),
            library: Arc::new(Mutex::new(library)),
            raised: Mutex::new(None),
            printable: AtomicUsize::new(MAX_PRINTED_BYTES),
            limits: limits.clone(),
        });
        Self::build(&state).map_err(|e| state.explain(&e))
    }

    fn build(state: &Arc<VmState>) -> mlua::Result<Self> {
        let libs = StdLib::COROUTINE | StdLib::TABLE | StdLib::STRING | StdLib::UTF8 | StdLib::MATH;
        let lua = Lua::new_with(libs, LuaOptions::default())?;
        let VmState { main, library, limits, .. } = &**state;
        let clock = Clock::new(main, limits.grace, limits.on_stuck.clone());
        lua.set_memory_limit(limits.memory_bytes)?;
        lua.set_app_data(state.clone());
        lua.set_app_data(MainFile(main.clone()));
        lua.set_app_data(library.clone());
        lua.set_app_data(MemoryUse::default());
        lua.set_app_data(clock.clone());
        let privilege = PrivilegedAccess::granted();
        lua.set_app_data(privilege.clone());
        let (api, host, globals) = (lua.create_table()?, lua.create_table()?, lua.globals());
        host.set("raised", lua.create_function(record_raised_object)?)?;
        host.set("error_text", lua.create_function(error_text)?)?;
        host.set("list", lua.create_function(iterable)?)?;
        let prelude = lua.load(include_str!("prelude.lua")).set_name("=softvt").set_mode(ChunkMode::Text);
        prelude.call::<()>(&host)?;
        api.set("sorted", host.get::<Function>("sorted")?)?;
        remove_unsafe_functions(&lua)?;
        let tostring: Function = globals.get("tostring")?;
        globals.set("print", lua.create_function(move |lua, values| print(lua, &tostring, values))?)?;
        store_base_library(&lua)?;
        let loaded = lua.create_table()?;
        globals.set("require", lua.create_function(move |lua, name| require(lua, &loaded, &name))?)?;
        let random = MathRandom::install(&lua)?;
        globals.set("softvt", &api)?;
        clock.install(&lua)?;
        refuse_undefined_variables(&lua)?;
        Ok(Self { lua, clock, random, library: library.clone(), privilege, state: state.clone(), api })
    }

    pub(crate) fn main(&self) -> &str {
        &self.state.main
    }

    pub(crate) fn run_main(&self) -> Result<Option<Value>, ScriptError> {
        let main = self.main();
        let text = lock(&self.library).text(main)?;
        let _deadline = self.clock.start(self.state.limits.load);
        let chunk = self.lua.load(text).set_name(format!("@{main}")).set_mode(ChunkMode::Text);
        // Not `eval`, which would first try the text as an expression and lose the frame of `error(…)` in a tail call.
        let results = chunk.call::<MultiValue>(()).map_err(|e| self.explain(&e))?;
        Ok(results.into_iter().next())
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

    pub(crate) fn call_deadline(&self) -> ClockGuard {
        self.clock.start(self.state.limits.call)
    }

    pub(crate) fn point_deadline(&self) -> ClockGuard {
        self.clock.start(self.state.limits.point)
    }

    /// Translates an error of the virtual machine for the author of the script.
    pub(crate) fn explain(&self, error: &mlua::Error) -> ScriptError {
        self.state.explain(error)
    }
}

/// Translates an error of the virtual machine for the author of the script, from within one of its functions.
pub(crate) fn explain(lua: &Lua, error: &mlua::Error) -> mlua::Result<ScriptError> {
    Ok(app_data::<Arc<VmState>>(lua)?.explain(error))
}

/// The table in the registry under a key, which does not keep its own keys alive.
pub(crate) fn weak_table(lua: &Lua, key: &str) -> mlua::Result<Table> {
    if let Ok(known) = lua.named_registry_value::<Table>(key) {
        return Ok(known);
    }
    let (known, weak) = (lua.create_table()?, lua.create_table()?);
    weak.set("__mode", "k")?;
    known.set_metatable(Some(weak))?;
    lua.set_named_registry_value(key, &known)?;
    Ok(known)
}

/// Removes functions that reach the outside or the machine's own state.
fn remove_unsafe_functions(lua: &Lua) -> mlua::Result<()> {
    for name in ["dofile", "loadfile", "collectgarbage", "warn", "io", "os", "debug", "package", "loadstring"]
    {
        lua.globals().set(name, Value::Nil)?;
    }
    lua.globals().get::<Table>("string")?.set("dump", Value::Nil)
}

/// Makes reading a global variable that was never set an error: a misspelt name would be `nil`, and an option that is
/// `nil` has its default.
fn refuse_undefined_variables(lua: &Lua) -> mlua::Result<()> {
    let refuse = lua.create_function(|lua, (_, name): (Value, Value)| -> mlua::Result<Value> {
        let name = name.as_string().map_or_else(|| describe(&name), |name| name.to_string_lossy());
        Err(fail!(lua, "the variable {name:?} is not defined"))
    })?;
    let meta = lua.create_table()?;
    meta.set("__index", refuse)?;
    lua.globals().set_metatable(Some(meta))
}

/// Stores a copy of the base library out of the reach of scripts, for the library's own Lua code.
fn store_base_library(lua: &Lua) -> mlua::Result<()> {
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
    let state = app_data::<Arc<VmState>>(lua)?;
    let texts = values.into_iter().map(|value| Ok(tostring.call::<LuaString>(value)?.to_string_lossy()));
    let line = texts.collect::<mlua::Result<Vec<_>>>()?.join("\t");
    let left = state.printable.load(Ordering::Relaxed);
    if line.len() < left {
        state.printable.store(left - line.len() - 1, Ordering::Relaxed);
        (state.limits.print)(&line);
    } else if state.printable.swap(0, Ordering::Relaxed) > 0 {
        (state.limits.print)("… the script prints more than 1 MiB; the rest is left out");
    }
    Ok(())
}

fn require(lua: &Lua, loaded: &Table, name: &Value) -> mlua::Result<Value> {
    let Value::String(name) = name else {
        bail!(lua, "require: expected a module name, got a {}", name.type_name());
    };
    let name = name.to_string_lossy();
    let library = app_data::<SharedLibrary>(lua)?;
    let file = lock(&library).module(&name).map_err(|error| fail(lua, error.to_string()))?;
    check_module(lua, &name, &file)?;
    let text = lua_text(&file.name, &file.bytes).map_err(mlua::Error::external)?;
    let is_standard = library::embedded(&file.name).is_some_and(|bytes| *bytes == *file.bytes);
    let file = file.name.as_str();
    match loaded.get::<Value>(file)? {
        Value::Nil => {}
        Value::Boolean(false) => {
            bail!(lua, "require {name:?}: the modules require each other in a circle");
        }
        value => return Ok(value),
    }
    loaded.set(file, false)?;
    let chunk = lua.load(text).set_name(format!("@{file}")).set_mode(ChunkMode::Text);
    let value = match chunk.call::<Value>(name.as_str()) {
        Ok(Value::Nil | Value::Boolean(false)) => Value::Boolean(true),
        Ok(value) => value,
        Err(error) => {
            // A second attempt (inside a pcall) must fail in the same way, not as a circle.
            loaded.set(file, Value::Nil)?;
            return Err(error);
        }
    };
    if is_standard {
        refuse_unknown_fields(lua, &name, &value)?;
    }
    loaded.set(file, &value)?;
    Ok(value)
}

/// Makes it an error to read a field that the table of a module does not have.
fn refuse_unknown_fields(lua: &Lua, module: &str, value: &Value) -> mlua::Result<()> {
    let Some(table) = value.as_table().filter(|table| table.metatable().is_none()) else { return Ok(()) };
    let module = module.to_owned();
    let refuse = lua.create_function(move |lua, (table, key): (Table, Value)| {
        let Some(key) = key.as_string().map(LuaString::to_string_lossy) else { return Ok(Value::Nil) };
        let known: Vec<String> = sorted_pairs(&table)
            .iter()
            .filter_map(|(key, _)| Some(key.as_string()?.to_string_lossy()))
            .collect();
        let message = unknown_name("field", &key, known.iter().map(String::as_str));
        Err(fail!(lua, "{module}: {message}"))
    })?;
    let meta = lua.create_table()?;
    meta.set("__index", refuse)?;
    table.set_metatable(Some(meta))
}

/// The table that `pairs` and `softvt.sorted` iterate over: the value itself, or the entries of a list of the host.
fn iterable(lua: &Lua, (label, value): (String, Value)) -> mlua::Result<Value> {
    match list::plain(lua, &value)? {
        Value::Table(table) => Ok(Value::Table(table)),
        other => Err(fail!(lua, "{label}: expected a table, got {}", describe(&other))),
    }
}

/// The text of an error of the host; any other value as it is.
fn error_text(lua: &Lua, value: Value) -> mlua::Result<Value> {
    let Value::Error(error) = &value else { return Ok(value) };
    let text = explain(lua, error)?.to_string();
    lua.create_string(text).map(Value::String)
}

/// Keeps a description of an error object, of which Lua would only keep the address.
fn record_raised_object(lua: &Lua, object: Value) -> mlua::Result<()> {
    let raised = RaisedObject { description: literal(&object, 0), place: current_line(lua) };
    *lock(&app_data::<Arc<VmState>>(lua)?.raised) = Some(raised);
    Ok(())
}

/// The generator of `math.random`, which the host reseeds between phases.
#[derive(Clone)]
pub(crate) struct MathRandom(Arc<Mutex<ChaCha8Rng>>);

impl MathRandom {
    /// Installs `math.random` with the same seed in every virtual machine, so that loading a script twice
    /// gives the same plan.
    pub(crate) fn install(lua: &Lua) -> mlua::Result<Self> {
        let generator = Self(Arc::new(Mutex::new(seed::keyed_rng(&["softvt load"]))));
        let rng = generator.clone();
        let random = lua.create_function(move |lua, args: MultiValue| {
            let mut rng = lock(&rng.0);
            draw(lua, &mut rng, &args)
        })?;
        lua.globals().get::<Table>("math")?.set("random", random)?;
        Ok(generator)
    }

    /// Continues with the numbers of `rng`.
    pub(crate) fn reseed(&self, rng: ChaCha8Rng) {
        *lock(&self.0) = rng;
    }

    /// Continues with the numbers of `rng`; returns those that would have followed.
    pub(crate) fn replace(&self, rng: ChaCha8Rng) -> ChaCha8Rng {
        std::mem::replace(&mut lock(&self.0), rng)
    }

    /// True if a number was drawn since the generator was seeded.
    pub(crate) fn has_drawn(&self) -> bool {
        lock(&self.0).get_word_pos() > 0
    }
}

/// `math.random()`, `math.random(m)`, `math.random(m, n)` as in Lua 5.4.
fn draw(lua: &Lua, rng: &mut ChaCha8Rng, args: &MultiValue) -> mlua::Result<Value> {
    let bound = |value: &Value| {
        lua.coerce_integer(value.clone())?.ok_or_else(|| fail!(lua, "math.random: bounds are integers"))
    };
    let (low, high) = match (args.front(), args.get(1)) {
        (None, _) => return Ok(Value::Number(seed::uniform(rng))),
        (Some(high), None) => (1, bound(high)?),
        (Some(low), Some(high)) => (bound(low)?, bound(high)?),
    };
    if args.len() == 1 && high == 0 {
        return Ok(Value::Integer(rng.next_u64() as i64));
    }
    if low > high {
        bail!(lua, "math.random: the range {low}..{high} is empty");
    }
    Ok(Value::Integer(seed::uniform_integer(rng, low, high)))
}
