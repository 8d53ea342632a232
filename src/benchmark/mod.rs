//! What a script returns: suites, tasks, experiments and plans as plain data.

pub mod control;
pub mod seed;
pub mod settings;

use serde::{Deserialize, Serialize};

/// What the objects of a suite are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ObjectType {
    /// Finite-element soft bodies; deformation is judged.
    Deformable,
    /// Rigid bodies; deformation is not applicable.
    Rigid,
}

/// What varies between the tasks of a suite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Variation {
    /// The object.
    Object,
    /// The layout.
    Spatial,
}

/// When a task is done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Goal {
    /// `object` rests on `target`, released, for `hold_s`.
    On {
        /// Scene name of the object.
        object: String,
        /// Scene name of what it must rest on.
        target: String,
        /// How long it must stay, s.
        hold_s: f64,
    },
    /// `object` rests inside `target`'s walls, released, for `hold_s`.
    In {
        /// Scene name of the object.
        object: String,
        /// Scene name of the container.
        target: String,
        /// How long it must stay, s.
        hold_s: f64,
    },
}

impl Goal {
    /// Scene name of the object that must get somewhere.
    pub fn object(&self) -> &str {
        match self {
            Self::On { object, .. } | Self::In { object, .. } => object,
        }
    }
}

/// One task of a suite.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// Index in the suite.
    pub id: usize,
    /// What the policy is told.
    pub prompt: String,
    /// Name of the layout; tasks that share it share initial states.
    pub layout: String,
    /// When it is done.
    pub goal: Goal,
    /// Control steps the policy has.
    pub budget_steps: u32,
    /// Whether a scripted expert comes with it.
    pub expert: bool,
}

/// A change of the scene that a run may ask for by name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shift {
    /// Name on the command line.
    pub name: String,
    /// Unit of its value, "1" for none.
    pub unit: String,
    /// The value that changes nothing.
    pub default: f64,
    /// Lowest value.
    pub min: Option<f64>,
    /// Highest value.
    pub max: Option<f64>,
}

/// A set of tasks that are reported together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Suite {
    /// Name, as in results.
    pub name: String,
    /// What its objects are.
    pub object_type: ObjectType,
    /// What varies between its tasks.
    pub variation: Variation,
    /// Episodes a task by default.
    pub episodes: u32,
    /// The tasks, in order.
    pub tasks: Vec<Task>,
    /// The shifts that the suite declares.
    pub shifts: Vec<Shift>,
    /// What the suite changes of the mechanics, the robot and the judge.
    pub settings: settings::Settings,
}

/// What the unchanged run is called beside conditions.
pub const REFERENCE: &str = "reference";

/// Named changes under which suites are run beside their unchanged reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Condition {
    /// Name, as in results.
    pub name: String,
    /// Shifts by name and value, as `--shift` takes them.
    pub shift: Vec<(String, f64)>,
    /// Settings by dotted path and value, as `--set` takes them.
    pub set: Vec<(String, String)>,
    /// The kind of suites that it can change anything of; all if none.
    pub only: Option<ObjectType>,
}

/// What `softvt FILE.lua` does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Plan {
    /// Evaluate a policy on one suite.
    Suite(Box<Suite>),
    /// Evaluate a policy on several suites.
    Suites {
        /// In order.
        suites: Vec<Suite>,
    },
    /// Evaluate a policy on suites as they are and under each of several conditions.
    Conditions {
        /// Name, as in results.
        name: String,
        /// In order.
        suites: Vec<Suite>,
        /// In order.
        conditions: Vec<Condition>,
    },
    /// Run a scripted experiment: a function of a grid of parameters that yields rows.
    Experiment {
        /// Name, as in results.
        name: String,
        /// Number of points of the grid.
        points: usize,
        /// Columns of the table of rows, in order; all of them, sorted, if empty.
        columns: Vec<String>,
    },
}

impl Plan {
    /// The suites that it evaluates; none of an experiment.
    pub fn suites(&self) -> &[Suite] {
        match self {
            Self::Suite(suite) => std::slice::from_ref(suite),
            Self::Suites { suites } | Self::Conditions { suites, .. } => suites,
            Self::Experiment { .. } => &[],
        }
    }
}
