//! Loading a script: the value that it returns becomes a [`Plan`] of plain data.

pub(crate) mod options;
mod points;
pub(crate) mod policy_file;
pub(crate) mod profile_file;
pub(crate) mod variation_file;

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Display,
    path::Path,
    sync::Arc,
};

use mlua::{Lua, Table, Value};

use crate::{
    api::{
        self,
        goals::DeclaredPredicate,
        policy::{PolicySpec, ProfileSpec},
        shapes::UnusedShapes,
        simulation::settings,
        tasks::{ConditionSpec, ConditionsSpec, ExperimentSpec, SuiteSpec, TaskSpec},
    },
    schema::{Constructed, LuaType, Record, RecordType, UnusualNumbers, is_constructed, strict_table},
    vm::{
        Vm, VmLimits,
        error::{ScriptError, fail_at},
        json::to_json,
        library::{Library, ScriptFiles},
        source_map::{fail_at_key, origin_of_key},
        value::{describe, describe_constructed, sorted_pairs},
    },
};
use options::{OptionSession, OptionSpec, SharedOptions};
pub(crate) use points::{Points, points};
use softvt_benchmark::{
    Condition, ObjectType, Plan, Shift, ShiftValue, Suite, Task, TaskDifference, goal_conflict::conflict,
    seed::SecretSeed, settings::Settings,
};
use softvt_common::{
    parallel::lock,
    text::{is_control, unknown_name},
};
use softvt_rollout::AssetCache;

/// The files of a script and the command line that they ran with: enough to run it again without the disk.
#[derive(Clone, Debug)]
pub struct ScriptSources {
    /// True for a policy, whose access to limits and materials depends on its declaration.
    is_policy: bool,
    pub main: String,
    pub bundle: Arc<ScriptFiles>,
    argv: Vec<String>,
    limits: VmLimits,
    /// Results derived from the shapes and assets that they make.
    pub assets: AssetCache,
}

impl ScriptSources {
    fn new(main: &str, bundle: ScriptFiles, argv: &[String], limits: &VmLimits) -> Self {
        Self {
            is_policy: false,
            main: main.to_owned(),
            bundle: Arc::new(bundle),
            argv: argv.to_vec(),
            limits: limits.clone(),
            assets: AssetCache::default(),
        }
    }

    /// Runs the main file at `path` and converts its result. The bundle holds the files that both have read: a result
    /// may contain functions that read further ones.
    fn read<T>(
        is_policy: bool,
        path: &Path,
        argv: &[String],
        limits: &VmLimits,
        convert: impl FnOnce(&ScriptInstance) -> mlua::Result<T>,
    ) -> Result<(Self, T), ScriptError> {
        let (library, main) = Library::open(path)?;
        let mut sources = Self { is_policy, ..Self::new(&main, ScriptFiles::default(), argv, limits) };
        let instance = sources.open(library, |_| ())?;
        let result = convert(&instance).map_err(|e| instance.vm.explain(&e))?;
        sources.bundle = Arc::new(lock(&instance.vm.library).bundle.clone());
        Ok((sources, result))
    }

    /// Runs the main file again in a new virtual machine.
    pub(crate) fn instance(&self) -> Result<ScriptInstance, ScriptError> {
        self.instance_with(|_| ())
    }

    /// As [`ScriptSources::instance`], with a virtual machine that `prepare` has changed before the main file runs.
    pub(crate) fn instance_with(&self, prepare: impl FnOnce(&Lua)) -> Result<ScriptInstance, ScriptError> {
        self.open(Library::frozen((*self.bundle).clone()), prepare)
    }

    /// A virtual machine with the whole Lua interface, in which the main file has not run yet.
    fn machine(&self, library: Library) -> Result<ScriptInstance, ScriptError> {
        let vm = Vm::new(&self.main, library, &self.limits)?;
        vm.lua.set_app_data(self.assets.clone());
        let options = OptionSession::new(&self.argv);
        install(&vm, &options).map_err(|e| vm.explain(&e))?;
        Ok(ScriptInstance { vm, options, result: None })
    }

    fn open(&self, library: Library, prepare: impl FnOnce(&Lua)) -> Result<ScriptInstance, ScriptError> {
        let mut instance = self.machine(library)?;
        prepare(&instance.vm.lua);
        if self.is_policy {
            instance.vm.privilege.expect_declaration();
        }
        instance.result = instance.vm.run_main()?;
        instance.check_result_size().map_err(|e| instance.vm.explain(&e))?;
        lock(&instance.options).check_all_consumed(&self.main)?;
        Ok(instance)
    }
}

/// A loaded script: its plan, its options, and the files of which its episodes are made.
#[derive(Clone, Debug)]
pub struct LoadedScript {
    /// The files; episodes run on these.
    pub sources: ScriptSources,
    /// Suites, conditions or an experiment.
    pub plan: Plan,
    pub options: Vec<OptionSpec>,
    /// Secret of a judged run, from which the draws of its episodes derive.
    pub secret: Option<SecretSeed>,
    /// SHA-256 of the files of a variation that replaced those of the suites, by name.
    pub variation_files: BTreeMap<String, String>,
}

impl LoadedScript {
    /// SHA-256 of every file that the episodes depend on, by name.
    pub fn file_hashes(&self) -> BTreeMap<String, String> {
        let mut hashes = self.sources.bundle.hashes();
        hashes.extend(self.variation_files.clone());
        hashes
    }

    /// Warnings about the script, with file and line: shapes that it makes and does not use, and numbers outside of
    /// their usual range. Runs the script again.
    pub fn warnings(&self) -> Result<Vec<String>, ScriptError> {
        // The result of the script stays alive, since shapes that its functions hold are not unused.
        let instance = self.sources.instance()?;
        let vm = &instance.vm;
        let unused = UnusedShapes::lines(&vm.lua).map_err(|e| vm.explain(&e))?.into_iter().map(|line| {
            format!("{line}: makes a shape that is not used; the methods of a shape return a new one: shape = shape:translate(…)")
        });
        Ok(unused.chain(UnusualNumbers::of(&vm.lua)).collect())
    }
}

/// Loads the script at `path` with its own arguments of the command line, and makes its plan. Standard scripts that are
/// not on the disk are read from the library inside the binary.
///
/// ```
/// use std::path::Path;
/// use softvt_benchmark::Plan;
///
/// let loaded = softvt_script::load(Path::new("suites/spatial_soft.lua"), &[])?;
/// let Plan::Suite(suite) = &loaded.plan else { panic!("the file returns a suite") };
/// assert_eq!(suite.tasks.len(), 10);
/// # Ok::<(), softvt_script::ScriptError>(())
/// ```
///
/// # Errors
/// If a file cannot be read, the script fails, or its options or its plan are invalid; the message names file and line.
pub fn load(path: &Path, argv: &[String]) -> Result<LoadedScript, ScriptError> {
    load_with(path, argv, &VmLimits::default())
}

/// [`load`] within other limits.
pub fn load_with(path: &Path, argv: &[String], limits: &VmLimits) -> Result<LoadedScript, ScriptError> {
    let (sources, (options, plan)) =
        ScriptSources::read(false, path, argv, limits, ScriptInstance::options_and_plan)?;
    Ok(LoadedScript { sources, plan, options, secret: None, variation_files: BTreeMap::new() })
}

/// Loads a script of which all files are known, such as that of a stored run, and makes its plan. `main` is the name of
/// its main file. Nothing is read from the disk.
///
/// # Errors
/// If a file is missing, the script fails, or its options or its plan are invalid.
pub fn load_files(main: &str, files: ScriptFiles, argv: &[String]) -> Result<LoadedScript, ScriptError> {
    let sources = ScriptSources::new(main, files, argv, &VmLimits::default());
    let instance = sources.instance()?;
    let (options, plan) = instance.options_and_plan().map_err(|e| instance.vm.explain(&e))?;
    Ok(LoadedScript { sources, plan, options, secret: None, variation_files: BTreeMap::new() })
}

/// The options that the script at `path` declares, for `--help`. If the script fails, those declared before.
///
/// # Errors
/// If the file cannot be read or is not Lua.
pub fn declared_options(path: &Path) -> Result<Vec<OptionSpec>, ScriptError> {
    let (library, main) = Library::open(path)?;
    let sources = ScriptSources::new(&main, ScriptFiles::default(), &[], &VmLimits::default());
    let instance = sources.machine(library)?;
    let outcome = instance.vm.run_main();
    let declared = lock(&instance.options).declared.clone();
    if declared.is_empty() { outcome.map(|_| declared) } else { Ok(declared) }
}

/// A virtual machine with the whole Lua interface, in which a main file has run.
pub(crate) struct ScriptInstance {
    pub vm: Vm,
    options: SharedOptions,
    result: Option<Value>,
}

impl ScriptInstance {
    /// Checks the size of the result before it is copied: tables and texts count each time that they are used.
    fn check_result_size(&self) -> mlua::Result<()> {
        let Some(Value::Table(result)) = &self.result else { return Ok(()) };
        let lua = &self.vm.lua;
        let mut size = ResultSize { left: MAX_RESULT_BYTES, path: Vec::new() };
        if size.take_table(result)? {
            return Ok(());
        }
        let place = size.path.iter().rev().find_map(|table| origin_of_key(lua, table, &[]));
        let limit = MAX_RESULT_BYTES >> 20;
        let message = format!(
            "the script returns more than {limit} MiB of tables and texts, where each counts as often as it is used; \
             return fewer or shorter ones"
        );
        Err(fail_at(lua, place, message))
    }

    /// True if the main file returned the result of the constructor of `record`.
    fn returned(&self, record: &Record) -> bool {
        let table = self.result.as_ref().and_then(Value::as_table);
        table.is_some_and(|table| is_constructed(&self.vm.lua, record, table))
    }

    /// The result of the main file if the constructor of `T` made it, checked again, since a script may
    /// have written to it.
    pub(crate) fn result<T: RecordType>(&self) -> mlua::Result<Option<Constructed<T>>> {
        match &self.result {
            Some(table) if self.returned(T::RECORD) => {
                Constructed::from_checked(table.clone(), &self.vm.lua).map(Some)
            }
            _ => Ok(None),
        }
    }

    /// The result of the main file, which must come from the constructor of `T`; `file` names the file in messages.
    fn expected_result<T: RecordType>(&self, file: &str) -> mlua::Result<Constructed<T>> {
        self.result()?.ok_or_else(|| {
            let got = self.result.as_ref().map_or("nothing".to_owned(), describe_constructed);
            fail!(&self.vm.lua, "{file} returns {}{{…}}, got {got}", T::RECORD.kind)
        })
    }

    fn options_and_plan(&self) -> mlua::Result<(Vec<OptionSpec>, Plan)> {
        let options = lock(&self.options).declared.clone();
        Ok((options, self.plan()?))
    }

    fn plan(&self) -> mlua::Result<Plan> {
        let lua = &self.vm.lua;
        for (record, role) in [(PolicySpec::RECORD, "policy"), (ProfileSpec::RECORD, "profile")] {
            if self.returned(record) {
                let kind = record.kind;
                bail!(
                    lua,
                    "returns {kind}{{…}}, which is not a plan; run a suite, and give this file as its {role}"
                );
            }
        }
        if let Some(spec) = self.result::<ExperimentSpec>()? {
            let _deadline = self.vm.call_deadline();
            let points = points(lua, &spec)?.len();
            let ExperimentSpec { name, columns, finish, .. } = spec.spec;
            return Ok(Plan::Experiment { name, points, columns, has_finish: finish.is_some() });
        }
        let specs = self.suites()?.filter(|specs| !specs.is_empty()).ok_or_else(|| {
            let got = self.result.as_ref().map_or("nothing".to_owned(), describe);
            let plans = "softvt.suite{…}, softvt.experiment{…} or a list of suites";
            fail!(lua, "a script returns a plan ({plans}), got {got}")
        })?;
        if self.result::<ConditionsSpec>()?.is_none() {
            let mut names = BTreeSet::new();
            for spec in &specs {
                if !names.insert(spec.name.as_str()) {
                    let message = format_args!("two suites are named {:?}; rename one", spec.name);
                    return Err(fail_at_key(lua, &spec.table, "name", message));
                }
            }
        }
        let mut suites = specs.iter().map(|spec| suite(lua, spec)).collect::<mlua::Result<Vec<_>>>()?;
        if let Some(spec) = self.result::<ConditionsSpec>()? {
            let condition = |condition| self::condition(lua, &spec.table, condition);
            let conditions = spec.conditions.iter().map(condition).collect::<mlua::Result<_>>()?;
            return Ok(Plan::Conditions { name: spec.spec.name, suites, conditions });
        }
        Ok(match self.returned(SuiteSpec::RECORD) {
            true => Plan::Suite(Box::new(suites.remove(0))),
            false => Plan::Suites { suites },
        })
    }

    /// The suites that the main file returned: one suite, conditions, or a list of suites. `None` if
    /// it is something else.
    fn suites(&self) -> mlua::Result<Option<Vec<Constructed<SuiteSpec>>>> {
        if let Some(suite) = self.result()? {
            return Ok(Some(vec![suite]));
        }
        if let Some(spec) = self.result::<ConditionsSpec>()? {
            return Ok(Some(spec.spec.suites));
        }
        let Some(Value::Table(list)) = &self.result else { return Ok(None) };
        let entries = list.sequence_values::<Value>().collect::<mlua::Result<Vec<_>>>()?;
        let is_suite = |entry: &Value| {
            entry.as_table().is_some_and(|table| is_constructed(&self.vm.lua, SuiteSpec::RECORD, table))
        };
        match entries.iter().all(is_suite) {
            true => entries
                .into_iter()
                .map(|entry| LuaType::from_checked(entry, &self.vm.lua))
                .collect::<mlua::Result<_>>()
                .map(Some),
            false => Ok(None),
        }
    }

    pub(crate) fn find_task(&self, name: &str, id: usize) -> mlua::Result<FoundTask> {
        let main = self.vm.main();
        let suites = self.suites()?;
        let suites = suites.ok_or_else(|| ScriptError::new(main, "the script did not return a suite"))?;
        let suite = suites.iter().find(|suite| suite.name == name).ok_or_else(|| {
            let names = suites.iter().map(|suite| suite.name.as_str());
            ScriptError::new(main, unknown_name("suite", name, names))
        })?;
        let task = suite.tasks.get(id).ok_or_else(|| {
            ScriptError::new(main, format!("suite {name:?} has no task {id}"))
                .hint(format!("its tasks are 0 to {}", suite.tasks.len().saturating_sub(1)))
        })?;
        Ok(FoundTask { suite: suite.clone(), task: task.clone() })
    }
}

/// Largest result of a main file, bytes.
const MAX_RESULT_BYTES: usize = 64 << 20;
/// Bytes that an entry of a table counts in addition to its texts.
const BYTES_PER_ENTRY: usize = 32;
/// Depth to which tables are counted; plans are less deep.
const MAX_RESULT_DEPTH: usize = 16;

/// The size that is left for the result of a main file.
struct ResultSize {
    left: usize,
    /// The table that is counted, after those that contain it.
    path: Vec<Table>,
}

impl ResultSize {
    /// Subtracts a table with all tables below it. False if it is too large; `path` then leads to the excess.
    fn take_table(&mut self, table: &Table) -> mlua::Result<bool> {
        self.path.push(table.clone());
        for entry in table.pairs::<Value, Value>() {
            let (key, value) = entry?;
            let text = |value: &Value| value.as_string().map_or(0, |text| text.as_bytes().len());
            let Some(left) = self.left.checked_sub(BYTES_PER_ENTRY + text(&key) + text(&value)) else {
                return Ok(false);
            };
            self.left = left;
            if let Value::Table(inner) = &value
                && self.path.len() < MAX_RESULT_DEPTH
                && !self.take_table(inner)?
            {
                return Ok(false);
            }
        }
        self.path.pop();
        Ok(true)
    }
}

pub(crate) struct FoundTask {
    pub suite: Constructed<SuiteSpec>,
    pub task: Constructed<TaskSpec>,
}

/// Adds the Lua interface to a new virtual machine.
fn install(vm: &Vm, options: &SharedOptions) -> mlua::Result<()> {
    let lua = &vm.lua;
    lua.set_app_data(options.clone());
    vm.api.set("version", env!("CARGO_PKG_VERSION"))?;
    api::install(lua, &vm.api)?;
    options::FUNCTIONS.iter().try_for_each(|function| function.install(lua, &vm.api, "softvt."))?;
    let names = sorted_pairs(&vm.api).iter().filter_map(|(key, _)| key.to_string().ok()).collect();
    strict_table(lua, "softvt", vm.api.clone(), names).map(|_| ())
}

pub(crate) fn suite(lua: &Lua, spec: &Constructed<SuiteSpec>) -> mlua::Result<Suite> {
    let name = spec.name.clone();
    let budget = match spec.tasks_differ_in {
        TaskDifference::Object => 700,
        TaskDifference::Spatial => 500,
    };
    let mut tasks: Vec<Task> = Vec::new();
    let mut known = BTreeMap::new();
    for (id, task) in spec.tasks.iter().enumerate() {
        let plain = self::task(lua, id, task, budget)?;
        let words: Vec<_> = task.prompt.split_whitespace().map(str::to_owned).collect();
        if let Some(twin) = known.insert((words, plain.layout.clone()), id) {
            let message = format!(
                "tasks {twin} and {id} of suite {name:?} are both {:?} in the layout {:?}; a policy could not distinguish \
                 them",
                plain.prompt, plain.layout
            );
            return Err(task.invalid(lua, "prompt", message));
        }
        tasks.push(plain);
    }
    let shifts = spec.shifts.iter().map(|shift| Shift {
        name: shift.name.clone(),
        unit: shift.unit.clone(),
        default: shift.default,
        min: shift.min,
        max: shift.max,
    });
    if let Some(vary) = spec.vary.as_ref().filter(|_| spec.object_type == ObjectType::Rigid) {
        return Err(spec.invalid(lua, "vary", variation_file::no_soft_objects(&name, &vary.name)));
    }
    let settings_at = origin_of_key(lua, &spec.table, &["settings"]);
    Ok(Suite {
        name,
        object_type: spec.object_type,
        tasks_differ_in: spec.tasks_differ_in,
        needs: spec.needs,
        episodes: spec.episodes,
        tasks,
        shifts: shifts.collect(),
        vary: spec.vary.as_deref().cloned(),
        metrics: spec.metrics.iter().map(|metric| metric.plain()).collect(),
        settings: settings(lua, "suite.settings", spec.settings.as_ref(), settings_at)?,
        twin_of: twin_of(lua, spec)?,
        teacher: spec.teacher.unwrap_or_default(),
    })
}

/// The suite whose rigid twin this one is, which must say that its objects are rigid.
fn twin_of(lua: &Lua, spec: &Constructed<SuiteSpec>) -> mlua::Result<Option<String>> {
    let Some(name) = &spec.twin_of else { return Ok(None) };
    match (spec.object_type, *name == spec.name) {
        (ObjectType::Deformable, _) => {
            Err(spec.invalid(lua, "twin_of", "a rigid twin has object_type = \"rigid\""))
        }
        (_, true) => Err(spec.invalid(lua, "twin_of", "is the suite itself; name the suite of soft objects")),
        _ => Ok(Some(name.clone())),
    }
}

fn task(lua: &Lua, id: usize, spec: &Constructed<TaskSpec>, budget: u32) -> mlua::Result<Task> {
    let (goal, predicates) = spec.goal.plain(lua)?;
    for DeclaredPredicate { goal, table, .. } in &predicates {
        // The objects of a stack differ.
        if let Some(target) = goal.target().filter(|target| Some(*target) == goal.object()) {
            let what = format!("is {target:?}, which is the object itself; name what it must reach");
            return Err(fail_at_key(lua, table, "target", format_args!("task.goal.target: {what}")));
        }
    }
    if spec.prompt.contains(is_control) || spec.prompt.trim().is_empty() {
        let message = format!("expected one line of text, got {:?}", spec.prompt);
        return Err(spec.invalid(lua, "prompt", message));
    }
    if let Some(conflict) = conflict(&goal) {
        return Err(spec.invalid(lua, "goal", format_args!("can never be met: {conflict}")));
    }
    Ok(Task {
        id,
        prompt: spec.prompt.clone(),
        prompt_varies: spec.episode_prompt.is_some(),
        layout: spec.layout.name.clone(),
        object: spec.object_name(lua)?,
        goal,
        budget_steps: spec.budget_steps.unwrap_or(budget),
        expert: spec.expert.is_some(),
    })
}

fn condition(lua: &Lua, list: &Table, spec: &ConditionSpec) -> mlua::Result<Condition> {
    let shift =
        spec.shift.iter().map(|(name, value)| ShiftValue { name: name.clone(), value: *value }).collect();
    let mut set = Vec::new();
    for (key, value) in spec.set.iter().flat_map(sorted_pairs) {
        let text = match &value {
            Value::String(text) => text.to_string_lossy(),
            // Counts must stay whole: JSON would write 2 as 2.0.
            Value::Number(number) if number.fract() == 0.0 && number.abs() < 9e15 => {
                (*number as i64).to_string()
            }
            other => to_json(lua, other, "conditions.set")?.to_string(),
        };
        set.push((key.to_string()?, text));
    }
    // Ranges may depend on the settings of the suite and are checked with them.
    let refused = |problem: &dyn Display| {
        fail_at_key(lua, list, "conditions", format_args!("condition {:?}: {problem}", spec.name))
    };
    Settings::default().check_fields(&set).map_err(|error| refused(&format_args!("set: {error}")))?;
    if spec.replay && (spec.policy.is_some() || spec.rigid_twin) {
        return Err(refused(&"replay repeats the actions of the reference; leave out policy and rigid_twin"));
    }
    Ok(Condition {
        name: spec.name.clone(),
        shift,
        set,
        policy: spec.policy.clone(),
        replay: spec.replay,
        only: spec.only,
        rigid_twin: spec.rigid_twin,
    })
}
