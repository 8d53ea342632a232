//! Loading a script: the value that it returns becomes a [`Plan`] of plain data.

pub(crate) mod options;
pub(crate) mod policy_file;
pub(crate) mod profile_file;

use std::{path::Path, sync::Arc};

use mlua::{Lua, MultiValue, Table, Value};

use crate::{
    benchmark::{Condition, Goal, GoalKind, Plan, Shift, ShiftValue, Suite, Task, Variation},
    parallel::lock,
    script::{
        api::{
            self,
            policy::{PolicySpec, ProfileSpec},
            simulation::settings,
            tasks::{
                ConditionSpec, ConditionsSpec, ExperimentSpec, GoalSpec, ShiftSpec, SuiteSpec, TaskSpec,
            },
        },
        schema::{Constructed, HasTable, RecordType, is_constructed, strict_table},
        vm::{
            Limits, Vm,
            error::{ScriptError, fail},
            json::to_json,
            library::{Bundle, Library},
            source_map::fail_at_key,
            value::{describe, describe_constructed, sorted_pairs},
        },
    },
    text::unknown_name,
};
use options::{OptionSession, OptionSpec, SharedOptions};

/// A loaded script.
#[derive(Clone)]
pub struct LoadedScript {
    /// The main file, as messages name it.
    pub main: String,
    pub plan: Plan,
    /// The declared options, with their values.
    pub options: Vec<OptionSpec>,
    /// Every file that was read; episodes run on these.
    pub bundle: Arc<Bundle>,
    argv: Vec<String>,
    limits: Limits,
}

impl std::fmt::Debug for LoadedScript {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LoadedScript")
            .field("main", &self.main)
            .field("plan", &self.plan)
            .finish_non_exhaustive()
    }
}

/// Loads the script at `path` with its own words of the command line, and makes its plan.
///
/// # Errors
/// If a file cannot be read, the script fails, or its options or its plan are invalid; the message names file and line.
pub fn load(path: &Path, argv: &[String]) -> Result<LoadedScript, ScriptError> {
    load_with(path, argv, &Limits::default())
}

/// [`load`] within other limits.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, argv: &[String], limits: &Limits) -> Result<LoadedScript, ScriptError> {
    let (library, main) = Library::open(path)?;
    let (instance, values) = open(&main, library, argv, limits)?;
    let options = lock(&instance.session).options.clone();
    let plan = instance.plan(&values).map_err(|e| instance.vm.explain(&e))?;
    let bundle = Arc::new(lock(instance.vm.library()).bundle().clone());
    Ok(LoadedScript { main, plan, options, bundle, argv: argv.to_vec(), limits: limits.clone() })
}

/// The options that the script at `path` declares, for `--help`. If the script fails, those declared before.
///
/// # Errors
/// If the file cannot be read or is not Lua.
pub fn declared_options(path: &Path) -> Result<Vec<OptionSpec>, ScriptError> {
    let (library, main) = Library::open(path)?;
    let instance = ScriptInstance::new(&main, library, &[], &Limits::default())?;
    let outcome = instance.vm.run_main();
    let declared = lock(&instance.session).options.clone();
    if declared.is_empty() { outcome.map(|_| declared) } else { Ok(declared) }
}

/// A virtual machine with the whole Lua interface.
pub(crate) struct ScriptInstance {
    pub vm: Vm,
    session: SharedOptions,
}

/// Runs the main file in a new virtual machine, and returns both with the results of the file.
pub(crate) fn open(
    main: &str,
    library: Library,
    argv: &[String],
    limits: &Limits,
) -> Result<(ScriptInstance, MultiValue), ScriptError> {
    let instance = ScriptInstance::new(main, library, argv, limits)?;
    let values = instance.vm.run_main()?;
    lock(&instance.session).check_all_consumed(main)?;
    Ok((instance, values))
}

/// Runs the sources of `loaded` in a new virtual machine.
pub(crate) fn reopen(loaded: &LoadedScript) -> Result<(ScriptInstance, MultiValue), ScriptError> {
    open(&loaded.main, Library::frozen((*loaded.bundle).clone()), &loaded.argv, &loaded.limits)
}

/// The table of the constructor of `T` that a file returned; `file` names the file in messages.
fn made<T: RecordType>(lua: &Lua, values: &MultiValue, file: &str) -> mlua::Result<Constructed<T>> {
    match values.front() {
        Some(Value::Table(table)) if is_constructed(lua, T::RECORD, table) => {
            lua.unpack(Value::Table(table.clone()))
        }
        other => {
            let got = other.map_or("nothing".to_owned(), describe_constructed);
            Err(fail(lua, format!("{file} returns {}{{…}}, got {got}", T::RECORD.kind)))
        }
    }
}

impl ScriptInstance {
    fn new(main: &str, library: Library, argv: &[String], limits: &Limits) -> Result<Self, ScriptError> {
        let vm = Vm::new(main, library, limits)?;
        let session = OptionSession::new(argv);
        install(&vm, &session).map_err(|e| vm.explain(&e))?;
        Ok(Self { vm, session })
    }

    fn plan(&self, values: &MultiValue) -> mlua::Result<Plan> {
        let lua = &self.vm.lua;
        let Some(Value::Table(table)) = values.front() else {
            return Err(no_plan(lua, values));
        };
        for (record, flag) in [(PolicySpec::RECORD, "--policy"), (ProfileSpec::RECORD, "--profile")] {
            if is_constructed(lua, record, table) {
                let message = format!(
                    "returns {}{{…}}, which is not a plan; run softvt SUITE.lua {flag} {}",
                    record.kind,
                    self.vm.main()
                );
                return Err(fail(lua, message));
            }
        }
        if is_constructed(lua, ExperimentSpec::RECORD, table) {
            let spec: Constructed<ExperimentSpec> = lua.unpack(Value::Table(table.clone()))?;
            let _deadline = self.vm.call_deadline();
            return Ok(Plan::Experiment {
                name: spec.name.clone(),
                points: points(lua, &spec)?.len(),
                columns: spec.columns.clone().unwrap_or_default(),
            });
        }
        let Some(specs) = suites(lua, table)? else { return Err(no_plan(lua, values)) };
        let mut suites: Vec<Suite> = Vec::new();
        for spec in &specs {
            let suite = suite(lua, spec)?;
            if suites.iter().any(|known| known.name == suite.name)
                && !is_constructed(lua, ConditionsSpec::RECORD, table)
            {
                let message = format!("two suites are named {:?}; rename one", suite.name);
                return Err(fail_at_key(lua, &spec.table, "name", message));
            }
            suites.push(suite);
        }
        if is_constructed(lua, ConditionsSpec::RECORD, table) {
            let spec: Constructed<ConditionsSpec> = lua.unpack(Value::Table(table.clone()))?;
            let conditions = spec.conditions.iter().map(|condition| self::condition(lua, condition));
            let conditions = conditions.collect::<mlua::Result<_>>()?;
            return Ok(Plan::Conditions { name: spec.name.clone(), suites, conditions });
        }
        if is_constructed(lua, SuiteSpec::RECORD, table) {
            return match suites.pop() {
                Some(suite) => Ok(Plan::Suite(Box::new(suite))),
                None => Err(no_plan(lua, values)),
            };
        }
        match suites.is_empty() {
            true => Err(no_plan(lua, values)),
            false => Ok(Plan::Suites { suites }),
        }
    }
}

/// The suites of a plan's table: one suite, conditions, or a list of suites. `None` if it is something else.
fn suites(lua: &Lua, table: &Table) -> mlua::Result<Option<Vec<Constructed<SuiteSpec>>>> {
    if is_constructed(lua, SuiteSpec::RECORD, table) {
        return Ok(Some(vec![lua.unpack(Value::Table(table.clone()))?]));
    }
    if is_constructed(lua, ConditionsSpec::RECORD, table) {
        let spec: Constructed<ConditionsSpec> = lua.unpack(Value::Table(table.clone()))?;
        return Ok(Some(spec.spec.suites));
    }
    let mut suites = Vec::new();
    for entry in table.clone().sequence_values::<Value>() {
        match entry? {
            Value::Table(table) if is_constructed(lua, SuiteSpec::RECORD, &table) => {
                suites.push(lua.unpack(Value::Table(table))?);
            }
            _ => return Ok(None),
        }
    }
    Ok(Some(suites))
}

fn no_plan(lua: &Lua, values: &MultiValue) -> mlua::Error {
    let got = values.front().map_or("nothing".to_string(), describe);
    let plans = "softvt.suite{…}, softvt.experiment{…} or a list of suites";
    fail(lua, format!("a script returns a plan ({plans}), got {got}"))
}

/// Adds the Lua interface to a new virtual machine.
fn install(vm: &Vm, session: &SharedOptions) -> mlua::Result<()> {
    let lua = &vm.lua;
    lua.set_app_data(session.clone());
    vm.api.set("version", env!("CARGO_PKG_VERSION"))?;
    api::install(lua, &vm.api)?;
    options::FUNCTIONS.iter().try_for_each(|function| function.install(lua, &vm.api, "softvt."))?;
    let names = sorted_pairs(&vm.api).iter().filter_map(|(key, _)| key.to_string().ok()).collect();
    strict_table(lua, "softvt", vm.api.clone(), names)?;
    Ok(())
}

fn suite(lua: &Lua, spec: &Constructed<SuiteSpec>) -> mlua::Result<Suite> {
    let name = spec.name.clone();
    if spec.tasks.is_empty() {
        let message = format!("suite.tasks: suite {name:?} has no tasks; give at least one");
        return Err(fail_at_key(lua, &spec.table, "tasks", message));
    }
    let budget = match spec.variation {
        Variation::Object => 700,
        Variation::Spatial => 500,
    };
    let mut tasks: Vec<Task> = Vec::new();
    for (id, task) in spec.tasks.iter().enumerate() {
        let table = &task.table;
        let task = self::task(lua, id, task, budget)?;
        let words = |task: &Task| task.prompt.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let is_same = |known: &&Task| words(known) == words(&task) && known.layout == task.layout;
        if let Some(twin) = tasks.iter().find(is_same) {
            let message = format!(
                "task.prompt: tasks {} and {id} of suite {name:?} are both {:?} in the layout {:?}; a policy could not \
                 distinguish them",
                twin.id, task.prompt, task.layout
            );
            return Err(fail_at_key(lua, table, "prompt", message));
        }
        tasks.push(task);
    }
    Ok(Suite {
        name,
        object_type: spec.object_type,
        variation: spec.variation,
        episodes: spec.episodes,
        tasks,
        shifts: spec.shifts.iter().flatten().map(|shift| self::shift(shift)).collect(),
        settings: settings(lua, "suite.settings", spec.settings.as_ref())?,
    })
}

fn task(lua: &Lua, id: usize, spec: &TaskSpec, budget: u32) -> mlua::Result<Task> {
    let (object, target) = (spec.goal.object().to_owned(), spec.goal.target().to_owned());
    if object == target {
        let message =
            format!("task.goal.target: is {target:?}, which is the object itself; name what it must reach");
        return Err(fail_at_key(lua, spec.goal.table(), "target", message));
    }
    Ok(Task {
        id,
        prompt: spec.prompt.clone(),
        layout: spec.layout.name.clone(),
        goal: match &spec.goal {
            GoalSpec::On(goal) => Goal { kind: GoalKind::On, object, target, hold_s: goal.hold_s },
            GoalSpec::Inside(goal) => Goal { kind: GoalKind::Inside, object, target, hold_s: goal.hold_s },
        },
        budget_steps: spec.budget_steps.unwrap_or(budget),
        expert: spec.expert.is_some(),
    })
}

fn shift(spec: &ShiftSpec) -> Shift {
    Shift {
        name: spec.name.clone(),
        unit: spec.unit.clone(),
        default: spec.default,
        min: spec.min,
        max: spec.max,
    }
}

fn condition(lua: &Lua, spec: &ConditionSpec) -> mlua::Result<Condition> {
    let shift = spec
        .shift
        .iter()
        .flatten()
        .map(|(name, value)| ShiftValue { name: name.clone(), value: *value })
        .collect();
    let mut set = Vec::new();
    for (key, value) in spec.set.iter().flat_map(sorted_pairs) {
        let text = match &value {
            Value::String(text) => text.to_string_lossy(),
            other => to_json(lua, other, "conditions.set")?.to_string(),
        };
        set.push((key.to_string()?, text));
    }
    Ok(Condition { name: spec.name.clone(), shift, set, only: spec.only })
}

/// The declarations of a suite and a task.
pub(crate) fn find_task(
    instance: &ScriptInstance,
    values: &MultiValue,
    name: &str,
    id: usize,
) -> Result<(Constructed<SuiteSpec>, Constructed<TaskSpec>), ScriptError> {
    let (vm, main) = (&instance.vm, instance.vm.main());
    let suites = match values.front() {
        Some(Value::Table(table)) => suites(&vm.lua, table).map_err(|e| vm.explain(&e))?,
        _ => None,
    };
    let Some(suites) = suites else {
        return Err(ScriptError::new(main, "the script did not return a suite"));
    };
    let Some(suite) = suites.iter().find(|suite| suite.name == name) else {
        let names = suites.iter().map(|suite| suite.name.as_str());
        return Err(ScriptError::new(main, unknown_name("suite", name, names)));
    };
    match suite.tasks.get(id) {
        Some(task) => Ok((suite.clone(), task.clone())),
        None => Err(ScriptError::new(main, format!("suite {name:?} has no task {id}"))
            .hint(format!("its tasks are 0 to {}", suite.tasks.len().saturating_sub(1)))),
    }
}

/// The points of an experiment: those of its function, or every combination of its grid.
pub(crate) fn points(lua: &Lua, spec: &ExperimentSpec) -> mlua::Result<Vec<Value>> {
    match (&spec.points, &spec.grid) {
        (Some(points), None) => {
            let list: Value = points.call(spec.options.clone())?;
            let Value::Table(list) = &list else {
                let message =
                    format!("experiment.points: expected a list of tables, got {}", describe(&list));
                return Err(fail(lua, message));
            };
            let points: Vec<Value> = list.clone().sequence_values().collect::<mlua::Result<_>>()?;
            match points.iter().all(Value::is_table) {
                true => Ok(points),
                false => Err(fail(lua, "experiment.points: every point is a table")),
            }
        }
        (None, Some(grid)) => {
            let mut points: Vec<Vec<(&str, &Value)>> = vec![Vec::new()];
            for (name, values) in grid {
                if points.len().saturating_mul(values.len()) > 1_000_000 {
                    let message = "experiment.grid: has more than a million points; give fewer values";
                    return Err(fail(lua, message));
                }
                let mut extended = Vec::new();
                for point in &points {
                    let with = |value| point.iter().copied().chain([(name.as_str(), value)]).collect();
                    extended.extend(values.iter().map(with));
                }
                points = extended;
            }
            let tables = points.into_iter().map(|point| lua.create_table_from(point).map(Value::Table));
            tables.collect()
        }
        _ => Err(fail(lua, "experiment: give either grid or points")),
    }
}
