//! Loading a script: what it returns becomes a [`Plan`] of plain data.

pub(crate) mod conditions;
pub(crate) mod options;
pub(crate) mod policy_file;
pub(crate) mod profile_file;

use std::{
    path::Path,
    sync::{Arc, Mutex},
};

use mlua::{Function, Lua, MultiValue, Table, Value};

use crate::benchmark::{Goal, ObjectType, Plan, Shift, Suite, Task, Variation};
use crate::script::{
    Bundle, OptionSpec, ScriptError,
    api::catalogue,
    api::catalogue_conditions::CONDITIONS,
    api::catalogue_policy::{self, POLICY, PROFILE},
    api::pose,
    api::shapes,
    plan::options::Session,
    run::experiment::points,
    schema::{self, unknown},
    vm::library::Library,
    vm::origin::fail_at,
    vm::{Limits, Vm, fail, locked},
};

/// A script that was read and understood.
#[derive(Clone)]
pub struct Loaded {
    /// The main file, as messages name it.
    pub main: String,
    /// What it asks for.
    pub plan: Plan,
    /// The options that it declares, with their values.
    pub options: Vec<OptionSpec>,
    /// Everything that was read; episodes run on this.
    pub bundle: Arc<Bundle>,
    pub(crate) argv: Vec<String>,
    pub(crate) limits: Limits,
}

impl std::fmt::Debug for Loaded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Loaded").field("main", &self.main).field("plan", &self.plan).finish_non_exhaustive()
    }
}

/// Reads the script at `path` with the words of the command line that are its own, and makes its plan.
///
/// # Errors
/// Anything that is wrong with the file, what it requires, its options or its plan; the message names file and line.
pub fn load(path: &Path, argv: &[String]) -> Result<Loaded, ScriptError> {
    load_with(path, argv, &Limits::default())
}

/// [`load`] within other limits.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, argv: &[String], limits: &Limits) -> Result<Loaded, ScriptError> {
    let (library, main) = Library::open(path)?;
    let (machine, values) = open(&main, library, argv, limits)?;
    let options = locked(&machine.session).options.clone();
    let plan = machine.plan(&values).map_err(|e| machine.vm.explain(&e))?;
    let bundle = Arc::new(locked(&machine.vm.shared.library).bundle().clone());
    Ok(Loaded { main, plan, options, bundle, argv: argv.to_vec(), limits: limits.clone() })
}

/// The options that the script at `path` declares, for `--help`; those that it declares before an error, if any.
///
/// # Errors
/// If the file cannot be read or is not Lua.
pub fn declared_options(path: &Path) -> Result<Vec<OptionSpec>, ScriptError> {
    let (library, main) = Library::open(path)?;
    let machine = Machine::new(&main, library, &[], &Limits::default())?;
    let outcome = machine.vm.run_main();
    let declared = locked(&machine.session).options.clone();
    if declared.is_empty() { outcome.map(|_| declared) } else { Ok(declared) }
}

/// A virtual machine with the whole Lua surface.
pub(crate) struct Machine {
    pub vm: Vm,
    session: Arc<Mutex<Session>>,
}

/// A machine that has run the main file, and what the file returned.
pub(crate) fn open(
    main: &str,
    library: Library,
    argv: &[String],
    limits: &Limits,
) -> Result<(Machine, MultiValue), ScriptError> {
    let machine = Machine::new(main, library, argv, limits)?;
    let values = machine.vm.run_main()?;
    locked(&machine.session).leftover(main)?;
    Ok((machine, values))
}

/// A fresh machine on the very sources of `loaded`, and what the main file returned in it.
pub(crate) fn reopen(loaded: &Loaded) -> Result<(Machine, MultiValue), ScriptError> {
    open(&loaded.main, Library::frozen((*loaded.bundle).clone()), &loaded.argv, &loaded.limits)
}

impl Machine {
    fn new(main: &str, library: Library, argv: &[String], limits: &Limits) -> Result<Self, ScriptError> {
        let vm = Vm::new(main, library, limits)?;
        let session = Session::new(argv);
        install(&vm, &session).map_err(|e| vm.explain(&e))?;
        Ok(Self { vm, session })
    }

    fn plan(&self, values: &MultiValue) -> mlua::Result<Plan> {
        let lua = &self.vm.lua;
        let Some(Value::Table(table)) = values.front() else {
            return Err(no_plan(lua, values));
        };
        for (record, flag) in [(&POLICY, "--policy"), (&PROFILE, "--profile")] {
            if schema::is_made(lua, record, table) {
                let message = format!(
                    "is no plan but what {flag} takes: softvt SUITE.lua {flag} {}",
                    self.vm.shared.main
                );
                return Err(fail(lua, message));
            }
        }
        if schema::is_made(lua, &catalogue::SUITE, table) {
            return Ok(Plan::Suite(Box::new(suite(lua, table)?)));
        }
        if schema::is_made(lua, &catalogue::EXPERIMENT, table) {
            schema::still_sound(lua, &catalogue::EXPERIMENT, table)?;
            let _deadline = self.vm.call_deadline();
            return Ok(Plan::Experiment {
                name: table.get("name")?,
                points: points(lua, table)?.len(),
                columns: table.get::<Option<Vec<String>>>("columns")?.unwrap_or_default(),
            });
        }
        if schema::is_made(lua, &CONDITIONS, table) {
            let conditions = conditions::read(lua, table)?;
            let suites: Vec<Table> = table.get("suites")?;
            let suites = suites.iter().map(|table| suite(lua, table)).collect::<mlua::Result<_>>()?;
            return Ok(Plan::Conditions { name: table.get("name")?, suites, conditions });
        }
        let mut suites = Vec::new();
        for entry in table.clone().sequence_values::<Value>() {
            match entry? {
                Value::Table(table) if schema::is_made(lua, &catalogue::SUITE, &table) => {
                    let suite = suite(lua, &table)?;
                    if suites.iter().any(|known: &Suite| known.name == suite.name) {
                        let message = format!("two suites are named {:?}; rename one", suite.name);
                        return Err(fail_at(lua, &table, "name", message));
                    }
                    suites.push(suite);
                }
                _ => return Err(no_plan(lua, values)),
            }
        }
        match suites.is_empty() {
            true => Err(no_plan(lua, values)),
            false => Ok(Plan::Suites { suites }),
        }
    }
}

fn no_plan(lua: &Lua, values: &MultiValue) -> mlua::Error {
    let value = values.front().map_or("nothing".to_string(), schema::got);
    fail(
        lua,
        format!(
            "a script returns a plan (softvt.suite{{…}}, softvt.experiment{{…}} or a list of suites), got {value}"
        ),
    )
}

/// Puts the Lua surface into a new machine. A further binding is one more line here.
fn install(vm: &Vm, session: &Arc<Mutex<Session>>) -> mlua::Result<()> {
    let lua = &vm.lua;
    vm.api.set("version", env!("CARGO_PKG_VERSION"))?;
    for (name, record) in catalogue::CONSTRUCTORS.iter().chain(catalogue_policy::CONSTRUCTORS) {
        let make = lua.create_function(move |lua, value: Value| schema::make(lua, record, &value))?;
        vm.api.set(*name, make)?;
    }
    vm.api.set("asset", lua.create_function(asset)?)?;
    vm.api.set("layout", lua.create_function(layout)?)?;
    crate::script::api::joints::install(lua, &vm.api)?;
    conditions::install(lua, &vm.api)?;
    options::install(lua, &vm.api, session)?;
    shapes::install(lua, &vm.api)?;
    crate::script::api::visuals::install(lua, &vm.api)?;
    pose::install(lua, &vm.api)?;
    crate::script::api::world::install(lua, &vm.api, &vm.clock)?;
    crate::script::api::sim::install(lua, &vm.api, &vm.clock)?;
    crate::script::api::envelope::install(lua, &vm.api)?;
    crate::script::api::image::install(lua, &vm.api)?;
    let names = schema::sorted_pairs(&vm.api).iter().filter_map(|(key, _)| key.to_string().ok()).collect();
    options::strict(lua, "softvt", vm.api.clone(), names)?;
    Ok(())
}

/// `softvt.asset{…}`, with what no single field can say.
fn asset(lua: &Lua, value: Value) -> mlua::Result<Table> {
    let made = schema::make(lua, &catalogue::ASSET, &value)?;
    let friction: Table = made.get("friction")?;
    let (most, least): (f64, f64) = (friction.get("static_mu")?, friction.get("dynamic_mu")?);
    match least <= most {
        true => Ok(made),
        false => Err(fail(
            lua,
            format!(
                "asset.friction: dynamic_mu {least} is above static_mu {most}; give the larger one to static_mu"
            ),
        )),
    }
}

/// `softvt.layout(name, build)` or `softvt.layout{ name = …, build = … }`.
fn layout(lua: &Lua, (first, build): (Value, Value)) -> mlua::Result<Table> {
    match (&first, build) {
        (Value::String(name), build) => {
            let table = lua.create_table()?;
            table.set("name", name)?;
            table.set("build", build)?;
            schema::make(lua, &catalogue::LAYOUT, &Value::Table(table))
        }
        (_, Value::Nil) => schema::make(lua, &catalogue::LAYOUT, &first),
        _ => Err(fail(lua, format!("layout: expected a name and a function, got {}", schema::got(&first)))),
    }
}

fn suite(lua: &Lua, table: &Table) -> mlua::Result<Suite> {
    schema::still_sound(lua, &catalogue::SUITE, table)?;
    let variation = match table.get::<String>("variation")?.as_str() {
        "object" => Variation::Object,
        _ => Variation::Spatial,
    };
    let object_type = match table.get::<String>("object_type")?.as_str() {
        "rigid" => ObjectType::Rigid,
        _ => ObjectType::Deformable,
    };
    let name: String = table.get("name")?;
    let tables: Vec<Table> = table.get("tasks")?;
    if tables.is_empty() {
        let message = format!("suite.tasks: suite {name:?} has no tasks; give at least one");
        return Err(fail_at(lua, table, "tasks", message));
    }
    let budget = if variation == Variation::Object { 700 } else { 500 };
    let mut tasks: Vec<Task> = Vec::new();
    for (id, table) in tables.iter().enumerate() {
        let task = task(lua, id, table, budget)?;
        let words = |task: &Task| task.prompt.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let same = |known: &&Task| words(known) == words(&task) && known.layout == task.layout;
        if let Some(twin) = tasks.iter().find(same) {
            let message = format!(
                "task.prompt: tasks {} and {id} of suite {name:?} are both {:?} in the layout {:?}; nobody could tell them \
                 apart",
                twin.id, task.prompt, task.layout
            );
            return Err(fail_at(lua, table, "prompt", message));
        }
        tasks.push(task);
    }
    let shifts: Option<Vec<Table>> = table.get("shifts")?;
    let shifts =
        shifts.unwrap_or_default().iter().map(|table| shift(lua, table)).collect::<mlua::Result<_>>()?;
    let settings = crate::script::api::sim::settings(lua, "suite.settings", table.get("settings")?)?;
    Ok(Suite { name, object_type, variation, episodes: table.get("episodes")?, tasks, shifts, settings })
}

fn task(lua: &Lua, id: usize, table: &Table, budget: u32) -> mlua::Result<Task> {
    sound_task(lua, table)?;
    let goal: Table = table.get("goal")?;
    let (object, target): (String, String) = (goal.get("object")?, goal.get("target")?);
    let hold_s = goal.get("hold_s")?;
    if object == target {
        let message =
            format!("task.goal.target: is {target:?}, which is the object itself; name what it must reach");
        return Err(fail_at(lua, &goal, "target", message));
    }
    let kind: Value = goal.metatable().map_or(Ok(Value::Nil), |meta| meta.get("__name"))?;
    let inside = kind.as_string().is_some_and(|kind| kind.to_string_lossy() == catalogue::INSIDE.kind);
    Ok(Task {
        id,
        prompt: table.get("prompt")?,
        layout: table.get::<Table>("layout")?.get("name")?,
        goal: match inside {
            true => Goal::In { object, target, hold_s },
            false => Goal::On { object, target, hold_s },
        },
        budget_steps: table.get::<Option<u32>>("budget_steps")?.unwrap_or(budget),
        expert: table.get::<Option<Function>>("expert")?.is_some(),
    })
}

/// A task and what it is made of are still what their constructors made.
pub(crate) fn sound_task(lua: &Lua, task: &Table) -> mlua::Result<()> {
    schema::still_sound(lua, &catalogue::TASK, task)?;
    schema::still_sound(lua, &catalogue::LAYOUT, &task.get("layout")?)?;
    schema::still_sound(lua, &catalogue::ON, &task.get("goal")?)
}

fn shift(lua: &Lua, table: &Table) -> mlua::Result<Shift> {
    schema::still_sound(lua, &catalogue::SHIFT, table)?;
    Ok(Shift {
        name: table.get("name")?,
        unit: table.get("unit")?,
        default: table.get("default")?,
        min: table.get("min")?,
        max: table.get("max")?,
    })
}

/// The tables of the suite and the task that an episode is of.
pub(crate) fn find_task(
    machine: &Machine,
    values: &MultiValue,
    suite: &str,
    id: usize,
) -> Result<(Table, Table), ScriptError> {
    let main = &machine.vm.shared.main;
    let explain = |e: mlua::Error| machine.vm.explain(&e);
    let Some(Value::Table(table)) = values.front() else {
        return Err(ScriptError::new(main, "the script returned no suite"));
    };
    let suites = suite_tables(&machine.vm.lua, table).map_err(explain)?;
    let mut names = Vec::new();
    for table in suites {
        let name: String = table.get("name").map_err(explain)?;
        if name == suite {
            let tasks: Vec<Table> = table.get("tasks").map_err(explain)?;
            let count = tasks.len();
            let task = tasks.into_iter().nth(id);
            return task.map(|task| (table, task)).ok_or_else(|| {
                ScriptError::new(main, format!("suite {suite:?} has no task {id}"))
                    .hint(format!("its tasks are 0 to {}", count.saturating_sub(1)))
            });
        }
        names.push(name);
    }
    Err(ScriptError::new(main, unknown("suite", suite, names.iter().map(String::as_str))))
}

/// The suites of a plan's table.
fn suite_tables(lua: &Lua, table: &Table) -> mlua::Result<Vec<Table>> {
    if schema::is_made(lua, &catalogue::SUITE, table) {
        return Ok(vec![table.clone()]);
    }
    match schema::is_made(lua, &CONDITIONS, table) {
        true => table.get("suites"),
        false => table.clone().sequence_values().collect(),
    }
}
