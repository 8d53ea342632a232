//! The benchmark as plain data, as scripts return it: suites, tasks, experiments and plans.
#![warn(unreachable_pub)]

pub mod goal;
pub mod goal_conflict;
pub mod metric;
pub mod run_changes;
pub mod seed;
pub mod settings;
pub mod variation;

use serde::{Deserialize, Serialize};

pub use self::goal::{Goal, Placement};
pub use self::settings::{CONTROL_DT, CONTROL_HZ, steps_per_control};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ObjectType {
    /// Finite-element soft bodies; deformation is judged.
    Deformable,
    /// Rigid bodies; deformation is not applicable.
    Rigid,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Teacher {
    #[default]
    Expert,
    /// The expert with a hand that feels how firmly it must hold.
    TactileServo,
}

impl Teacher {
    pub fn is_expert(&self) -> bool {
        *self == Self::Expert
    }
}

/// The factor that varies between the tasks of a suite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TaskDifference {
    Object,
    /// Tasks differ in the layout.
    Spatial,
}

/// Knowledge of an instance that a safe grip takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NeededKnowledge {
    /// Nothing but its kind: one closure per kind suffices.
    Nothing,
    Size,
    /// Stiffness, mass or friction, which do not show: the grip has to be found by trial.
    Trial,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Task {
    pub id: usize,
    /// The instruction to the policy, and the name of the task in results.
    pub prompt: String,
    /// True if each episode has a prompt of its own.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub prompt_varies: bool,
    /// Name of the layout; tasks that share it share initial states.
    pub layout: String,
    /// Condition of Goal Success, judged at every control step.
    pub goal: Goal,
    /// Scene name of *the object*: that whose deformation and grip the records hold.
    pub object: String,
    /// Maximum number of control steps.
    pub budget_steps: u32,
    /// True if the suite has a scripted expert for it.
    pub expert: bool,
}

/// A named change of the scene, for runs under shifted conditions (`--shift`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shift {
    pub name: String,
    /// Unit of its value, "1" for none.
    pub unit: String,
    /// Value that leaves the scene unchanged.
    pub default: f64,
    /// Smallest allowed value; `None` for no bound.
    pub min: Option<f64>,
    /// Largest allowed value; `None` for no bound.
    pub max: Option<f64>,
}

/// A set of tasks that are reported together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Suite {
    pub name: String,
    pub object_type: ObjectType,
    /// Factor that varies between its tasks.
    pub tasks_differ_in: TaskDifference,
    /// Knowledge that a safe grip takes, if the suite states it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub needs: Option<NeededKnowledge>,
    pub episodes: u32,
    pub tasks: Vec<Task>,
    pub shifts: Vec<Shift>,
    /// Ranges from which the soft objects, the light and the cameras of every episode are drawn, if they vary.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vary: Option<variation::VariationRanges>,
    /// Numbers of each episode that the suite measures in addition to the verdict.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub metrics: Vec<metric::Metric>,
    /// Settings of physics, robot, sensors and judge.
    pub settings: settings::Settings,
    /// The suite of soft objects whose rigid twin this is; its initial states are those of that suite.
    #[serde(default)]
    pub twin_of: Option<String>,
    #[serde(default, skip_serializing_if = "Teacher::is_expert")]
    pub teacher: Teacher,
}

/// Value of a [`Shift`] in a run; `[name, value]` in files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "(String, f64)", into = "(String, f64)")]
pub struct ShiftValue {
    pub name: String,
    /// Value, in the unit of the shift.
    pub value: f64,
}

impl From<(String, f64)> for ShiftValue {
    fn from((name, value): (String, f64)) -> Self {
        Self { name, value }
    }
}

impl From<ShiftValue> for (String, f64) {
    fn from(shift: ShiftValue) -> Self {
        (shift.name, shift.value)
    }
}

/// Name of the reference: the run of a suite as it is, next to those under conditions.
pub const REFERENCE: &str = "reference";

/// A named set of changes under which suites are run in addition to the reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    pub name: String,
    /// Shifts, as `--shift` takes them.
    pub shift: Vec<ShiftValue>,
    /// Settings by dotted path and value, as `--set` takes them.
    pub set: Vec<(String, String)>,
    /// Built-in policy in place of that of the run, as `--policy` takes it; `None` for the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub policy: Option<String>,
    /// True to repeat the actions of the reference in place of a policy.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub replay: bool,
    /// Kind of suites to which the condition applies; `None` for all.
    pub only: Option<ObjectType>,
    #[serde(default)]
    pub rigid_twin: bool,
}

/// The task of `softvt FILE.lua`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Plan {
    Suite(Box<Suite>),
    Suites {
        suites: Vec<Suite>,
    },
    /// Evaluate a policy on suites without changes and under each of several conditions.
    Conditions {
        name: String,
        suites: Vec<Suite>,
        conditions: Vec<Condition>,
    },
    /// Run a scripted experiment: a function of a grid of parameters that yields rows.
    Experiment {
        name: String,
        points: usize,
        /// Columns of the table of rows, in order; all of them, sorted, if empty.
        columns: Vec<String>,
        /// True if a function summarises the rows, which can return files to write.
        has_finish: bool,
    },
}

impl Plan {
    /// Suites to evaluate; empty for an experiment.
    pub fn suites(&self) -> &[Suite] {
        match self {
            Self::Suite(suite) => std::slice::from_ref(suite),
            Self::Suites { suites } | Self::Conditions { suites, .. } => suites,
            Self::Experiment { .. } => &[],
        }
    }
}

impl Task {
    /// Scene names of the objects that the task moves, each once: first the object, then the others of its goal.
    pub fn targets(&self) -> Vec<&str> {
        let mut names = vec![self.object.as_str()];
        for name in self.goal.predicates().into_iter().filter_map(Goal::object) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }
}
