//! Plans: layouts, goals, tasks, shifts, suites, conditions and experiments.

use std::collections::BTreeMap;

use mlua::{Function, Lua, Table, Value};

use super::goals::GoalSpec;
use crate::{
    schema::{
        Constructed, LuaType, Range, Record, RecordType, Type, Unchecked, ValidationError, choice, functions,
        make, record, record_of,
    },
    vm::{source_map::fail_at_key, value::describe},
};
use softvt_benchmark::{
    NeededKnowledge, ObjectType, REFERENCE, TaskDifference, Teacher,
    metric::{Metric, Reduction},
    variation::{FactorRange, HiddenRanges, VariationRanges},
};
use softvt_runs::record::is_record_key;

const BUILD: Type = Type::Function("fun(scene: softvt.Scene, rng: softvt.Rng)");
/// Type of a function that gives the prompts of the episodes of a task.
const EPISODE_PROMPT: Type = Type::Function("fun(scene: softvt.Scene, rng: softvt.Rng): string");
pub(crate) const EXPERT: Type = Type::Function("fun(arm: softvt.Arm, scene: softvt.SceneState)");
const COATINGS: Type = Type::Interval("", Range::above(0.0, 10.0));
pub(crate) const SETTINGS: Type = Type::Map(&Type::Map(&Type::Any));
/// Class of the settings in the editor stubs, which list them group by group.
pub(crate) const SETTINGS_CLASS: &str = "softvt.Settings";

choice! { ObjectType { "deformable" => Deformable, "rigid" => Rigid } }
choice! { NeededKnowledge { "nothing" => Nothing, "size" => Size, "trial" => Trial } }
choice! { Reduction { "last" => Last, "max" => Max, "min" => Min, "mean" => Mean } }
choice! { Teacher { "expert" => Expert, "tactile-servo" => TactileServo } }
choice! { TaskDifference { "object" => Object, "spatial" => Spatial } }

record! {
    /// The layout of a scene. Tasks with the same layout name share their initial states.
    LayoutSpec: "softvt.Layout" as "layout", constructor "softvt.layout" {
        /// Name; part of the seed.
        name: String;
        /// Adds the objects to the scene.
        build: Function = BUILD;
    }
    /// A task of a suite.
    TaskSpec: "softvt.Task" as "task", constructor "softvt.task" {
        /// Instruction for the policy, and name of the task in results.
        prompt: String;
        /// Returns the prompt of an episode, given its initial scene: for prompts that name what was drawn, as the
        /// larger of two objects or the side of the plate. It must not change the scene. Shifts come after it.
        episode_prompt: Option<Function> = EPISODE_PROMPT;
        /// Layout of the initial scene.
        layout: Constructed<LayoutSpec>;
        /// Success criterion of the task.
        goal: GoalSpec;
        /// Scene name of the object whose deformation and grip the records hold; by default the first that the goal
        /// names. A goal of joints or functions alone needs it.
        object: Option<String>;
        /// A coroutine that solves the task with privileged state.
        expert: Option<Function> = EXPERT;
        /// Control steps (20 Hz) that the policy has; by default 500 in suites that vary layouts, 700 in
        /// those that vary objects.
        budget_steps: Option<u32> = Type::Integer(Range::closed(1.0, 100_000.0).usually(10.0, 20_000.0));
    }
    /// A change of the scene that a run can request with --shift name=value. Limits of D stay those of the assets.
    ShiftSpec: "softvt.Shift" as "shift", constructor "softvt.shift", relation NotDecreasing(&["min", "default", "max"]) {
        /// Name on the command line.
        name: String;
        /// Unit of the value.
        unit: String => Text("1");
        /// Value that changes nothing.
        default: f64;
        /// Lowest value that is accepted.
        min: Option<f64>;
        /// Highest value that is accepted.
        max: Option<f64>;
        /// Changes the scene; may return another one. scene.goal_object is the object of the task's goal and
        /// scene.prompt the instruction. Draw from rng:stream "camera", "light", "material" or "sensor",
        /// whichever the shift changes.
        apply: Function = Type::Function("fun(scene: softvt.Scene, value: number, rng: softvt.Rng): softvt.Scene?");
    }
    /// A number of each episode in addition to its verdict, from the true state, which policies do not see.
    MetricSpec: "softvt.Metric" as "metric", constructor "softvt.metric", relation Checked(check_metric) {
        /// Name in records and tables, with its unit, as tilt_deg; none that records have already, as safety.
        name: String = Type::Name;
        /// Returns the value after a control step, or nil where it has none. `step` is a row of the trace
        /// (docs/results.md): forces of the pads, D of each object, what touches what.
        of: Function = Type::Function("fun(scene: softvt.SceneState, step: table): number?");
        /// Reduction of the values of an episode: "last", "max", "min" or "mean".
        over: Reduction => Text("last");
    }
    /// A set of tasks that are reported together.
    SuiteSpec: "softvt.Suite" as "suite", constructor "softvt.suite" {
        /// Name in results; part of the seed.
        name: String = Type::Name;
        /// Mechanics of the objects.
        object_type: ObjectType;
        /// Difference between the tasks.
        tasks_differ_in: TaskDifference;
        /// Knowledge of an instance that a safe grip needs, as softvt list suites prints it: "nothing"
        /// but its kind, its "size", or what only a "trial" tells. softvt scripts/blind_bounds.lua estimates it.
        needs: Option<NeededKnowledge>;
        /// Default number of episodes per task.
        episodes: u32 = Type::Integer(Range::closed(1.0, 1e6)) => Integer(5);
        /// The tasks, in order.
        tasks: Vec<Constructed<TaskSpec>> = Type::Distinct { of: Constructed::<TaskSpec>::REFERENCE, by: "", min: 1 };
        /// Changes of the scene that a run can request.
        shifts: Vec<Constructed<ShiftSpec>>
            = Type::Distinct { of: Constructed::<ShiftSpec>::REFERENCE, by: "name", min: 0 } => Empty;
        /// Numbers of each episode that records and tables show in addition to the verdict.
        metrics: Vec<Constructed<MetricSpec>>
            = Type::Distinct { of: Constructed::<MetricSpec>::REFERENCE, by: "name", min: 0 } => Empty;
        /// Ranges from which the soft objects, the light and the cameras of every episode are drawn.
        vary: Option<Constructed<VariationRanges>>;
        /// Changed settings (docs/settings.md): { physics = {…}, robot = {…}, criteria = {…}, tactile = {…}, cameras =
        /// {…} }.
        settings: Option<Table> = SETTINGS;
        /// Name of the suite of soft objects whose rigid twin this is. All soft bodies become rigid, with the same
        /// shape, mass and looks; initial states are those of that suite, so tasks and layouts must be its own.
        twin_of: Option<String> = Type::Name;
        /// Policy whose demonstrations softvt record keeps unless --policy names another: that of the hidden suites is
        /// "tactile-servo", which shows how a grip is found. By default the expert.
        teacher: Option<Teacher>;
    }
    /// A difference between a run and its reference: other shifts, settings or another policy, with the same tasks,
    /// initial states and seeds.
    ConditionSpec: "softvt.Condition" as "conditions.conditions" {
        /// Name in the table of results and of the run folder.
        name: String;
        /// Shifts by name, as for --shift: { mass = 1.25 }.
        shift: BTreeMap<String, f64> => Empty;
        /// Settings by path, as for --set: { ["robot.gripper.effort"] = 20 }.
        set: Option<Table> = Type::Map(&Type::OneOf(&[Type::Number("", Range::ANY), Type::Boolean, Type::Text]));
        /// Built-in policy in place of that of the run: "tactile-servo" (softvt list policies).
        policy: Option<String>;
        /// True to repeat the actions of the reference, so that only their effect differs.
        replay: bool => Boolean(false);
        /// object_type of the suites that it applies to; others are not run, and their row says N/A.
        only: Option<ObjectType>;
        /// True to run the rigid twin of the suites: shapes, masses, looks, layouts and prompts stay.
        rigid_twin: bool => Boolean(false);
    }
    /// Runs suites as they are, then under each condition, and compares them episode by episode.
    ConditionsSpec: "softvt.Conditions" as "conditions", constructor "softvt.conditions", relation Checked(check_conditions) {
        /// Name of the plan in results.
        name: String = Type::Name;
        /// The suites, in order.
        suites: Vec<Constructed<SuiteSpec>> = Type::Distinct { of: Constructed::<SuiteSpec>::REFERENCE, by: "", min: 1 };
        /// The conditions, in order.
        conditions: Vec<ConditionSpec> = Type::Distinct { of: ConditionSpec::REFERENCE, by: "name", min: 1 };
    }
    /// A function that is evaluated at points and returns rows of results. Give either grid or points.
    ExperimentSpec: "softvt.Experiment" as "experiment", constructor "softvt.experiment" {
        /// Name of the experiment in results.
        name: String = Type::Name;
        /// Result of softvt.options, passed to the functions below as opt.
        options: Option<Value>;
        /// Values of each parameter. Every combination is run, names in alphabetical order, the last one fastest.
        grid: Option<BTreeMap<String, Vec<Value>>>
            = Type::Map(&Type::Distinct { of: &Type::Any, by: "", min: 1 });
        /// Returns the points instead of a grid.
        points: Option<Function> = Type::Function("fun(opt: table): table[]");
        /// Returns a row, or a list of rows, for one point. Points run in any order and on several threads, each in a
        /// new run of the script: variables that one changes are not seen by others. Reading a field of the point that
        /// is no parameter of the grid, or a misspelt one of `points`, is an error.
        run: Function = Type::Function("fun(point: table, opt: table): table|table[]");
        /// Summarizes the rows of all points.
        finish: Option<Function> = Type::Function("fun(rows: table[], opt: table): softvt.Finish?");
        /// Columns of the table, in order; by default all, sorted.
        columns: Vec<String> = Type::Distinct { of: &Type::Text, by: "", min: 0 } => Empty;
    }
    /// Summary of an experiment.
    FinishSpec: "softvt.Finish" as "finish" {
        /// Printed after the rows.
        text: Option<String> = Type::Line;
        /// Files to write, by relative path: text as it is, images as PNG, tables as JSON with sorted keys.
        files: BTreeMap<String, Value> = Type::Map(&Type::OneOf(&[
            Type::Line,
            Type::Object("softvt.Image"),
            Type::Map(&Type::Any),
            Type::List(&Type::Any),
        ])) => Empty;
        /// Fault of the results. The files are written, then the command fails with this message.
        problem: Option<String> = Type::Line;
    }
}

record_of! {
    /// Ranges from which every episode of a suite draws: factors on size, stiffness, density and friction of each
    /// soft object, its colour, the light and the poses of the cameras. The policy sees none of the drawn
    /// numbers; records do.
    VariationRanges: "softvt.Variation" as "variation", constructor "softvt.variation" {
        /// Name of the variation in results.
        name: String = Type::Name;
        /// Smallest and largest factor on the size of a soft object, uniform.
        size: FactorRange;
        /// Factors on Young's modulus, log-uniform.
        stiffness: FactorRange;
        /// Factors on the density, log-uniform.
        density: FactorRange;
        /// Factors on the coefficients of friction, log-uniform. A pair of surfaces takes the larger coefficient.
        friction: FactorRange;
        /// Largest relative change of each colour channel of a soft object.
        colour: f64 = Type::Number("", Range::closed(0.0, 0.9));
        /// Factors on the strength of lamp and sky, log-uniform.
        light: FactorRange;
        /// Largest displacement along each axis of the cameras that are fixed to the world.
        camera_offset: f64 = Type::Number("m", Range::closed(0.0, 1.0));
        /// Largest rotation of these cameras about each of their axes.
        camera_rotation: f64 = Type::Number("rad", Range::closed(0.0, 1.0));
        /// Properties of the soft objects that do not show.
        hidden: Option<HiddenRanges>;
    }
    /// Ranges of properties that do not show, drawn log-uniform for each soft object. Size, colour and looks do not
    /// depend on them. An instance is drawn again until the ratio of its largest to its smallest safe grip force is
    /// within window_ratio by the draw reference of the asset, which its first calibration writes and later ones keep.
    /// Policies never see these numbers; records have them, with the ratio by the present calibration.
    HiddenRanges: "softvt.Hidden" as "variation.hidden" {
        /// Relative density of the foam: a factor on the density, and by its square on Young's modulus.
        aeration: FactorRange;
        /// Age: a factor on Young's modulus; the collapse and damage strains shrink by its power 0.7, and τ of
        /// the instance with them.
        staling: FactorRange;
        /// Factor on the mass.
        filling: FactorRange;
        /// Static friction of a coating (flour, oil, glaze), which acts between the object and
        /// everything that it touches.
        coating: FactorRange = COATINGS;
        /// Largest over smallest safe grip force of the instances that are kept, at least 1.
        window_ratio: FactorRange = Type::Interval("", Range::closed(1.0, 1000.0));
    }
}

impl LuaType for FactorRange {
    const TYPE: Type = Type::Interval("", Range::closed(0.1, 10.0));

    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        lua.unpack(value).map(|[min, max]: [f64; 2]| Self { min, max })
    }
}

/// Constructors of plans and their parts; that of layouts is a function.
pub(crate) static CONSTRUCTORS: &[&Record] = &[
    SuiteSpec::RECORD,
    TaskSpec::RECORD,
    ShiftSpec::RECORD,
    MetricSpec::RECORD,
    VariationRanges::RECORD,
    ConditionsSpec::RECORD,
    ExperimentSpec::RECORD,
];

impl MetricSpec {
    pub(crate) fn plain(&self) -> Metric {
        Metric { name: self.name.clone(), over: self.over }
    }
}

impl Constructed<TaskSpec> {
    /// Scene name of the object whose deformation and grip the records hold.
    pub(crate) fn object_name(&self, lua: &Lua) -> mlua::Result<String> {
        if let Some(name) = &self.object {
            return Ok(name.clone());
        }
        let (_, predicates) = self.goal.plain(lua)?;
        let named = predicates.iter().find_map(|predicate| predicate.goal.object());
        named.map(str::to_owned).ok_or_else(|| {
            let message = "task.object: missing; the goal names no object, and the deformation and grip of one are judged: give \
                           its scene name";
            fail_at_key(lua, &self.table, "goal", message.to_owned())
        })
    }
}

functions! {
    FUNCTIONS {
        /// Returns a layout, given by name and function or by a table of name and build:
        /// `softvt.layout("table", function(scene, rng) … end)`.
        fn layout(
            lua,
            name: Unchecked = Type::OneOf(&[Type::Text, Type::Nested(LayoutSpec::RECORD)]),
            build: Unchecked = BUILD
        ) -> ["softvt.Layout"] {
            match (&name.0, build.0) {
                (Value::String(name), build) => {
                    let table = lua.create_table()?;
                    table.set("name", name)?;
                    table.set("build", build)?;
                    make(lua, LayoutSpec::RECORD, &Value::Table(table))?
                }
                (_, Value::Nil) => make(lua, LayoutSpec::RECORD, &name.0)?,
                (name, _) => {
                    bail!(lua, "layout: expected a name and a function, got {}", describe(name));
                }
            }
        }
    }
}

/// Refuses the name of a measure of the verdict, which tables show too.
fn check_metric(_: &Lua, table: &Table) -> Result<(), ValidationError> {
    match table.raw_get::<String>("name")? {
        name if is_record_key(&name) => {
            Err(mismatch!("{name:?} is a field of every record; give another name").inside("name"))
        }
        _ => Ok(()),
    }
}

/// Refuses a condition with the name of the run without changes.
fn check_conditions(lua: &Lua, table: &Table) -> Result<(), ValidationError> {
    let conditions = Vec::<ConditionSpec>::from_checked(table.raw_get("conditions")?, lua)?;
    let Some(at) = conditions.iter().position(|condition| condition.name == REFERENCE) else { return Ok(()) };
    let error = mismatch!("{REFERENCE:?} is the name of the run without changes; give another");
    Err(error.inside("name").inside(format!("[{}]", at + 1)).inside("conditions"))
}
