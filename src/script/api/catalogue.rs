//! The binding table: every table that the Lua surface takes, with types, units, ranges, defaults and documentation.
//!
//! Checking, stubs and the reference are all made from it.

use crate::script::{
    api::catalogue_conditions::{CONDITION, CONDITIONS},
    api::catalogue_joints::{ARTICULATED, HINGE, PART, SLIDER},
    api::catalogue_visuals::{LAYER, VISUAL},
    schema::{Field, Presence, Range, Record, Type},
};

use crate::scene::SoftMaterial;

use Presence::{Empty, Optional, Required};

const fn field(name: &'static str, ty: Type, presence: Presence, doc: &'static str) -> Field {
    Field { name, ty, presence, doc }
}

/// Coulomb friction of a surface.
pub(crate) static FRICTION: Record = Record {
    label: "friction",
    class: "softvt.Friction",
    kind: "softvt.Friction",
    doc: "Coulomb friction of a surface; a pair of surfaces takes the larger of each coefficient.",
    fields: &[
        field(
            "static_mu",
            Type::Number("", Range::closed(0.0, 10.0)),
            Presence::Number(0.6),
            "Static coefficient.",
        ),
        field(
            "dynamic_mu",
            Type::Number("", Range::closed(0.0, 10.0)),
            Presence::Number(0.5),
            "Dynamic coefficient, not above the static one.",
        ),
    ],
};

/// A finite-element soft body.
pub(crate) static SOFT: Record = Record {
    label: "asset.body",
    class: "softvt.Soft",
    kind: "softvt.soft",
    doc: "A finite-element soft body of linear-elastic, isotropic material.",
    fields: &[
        field("youngs_pa", Type::Number("Pa", Range::POSITIVE), Required, "Young's modulus."),
        field(
            "poisson",
            Type::Number("", Range::below(0.0, 0.5)),
            Required,
            "Poisson's ratio; 0.5 would be incompressible.",
        ),
        field("density", Type::Number("kg/m³", Range::POSITIVE), Required, "Density."),
        field(
            "resolution",
            Type::Integer(Range::closed(1.0, SoftMaterial::MAX_RESOLUTION as f64)),
            Presence::Integer(6),
            "Voxels along the longest edge of the bounding box.",
        ),
        field(
            "grasp_spacing",
            Type::Number("m", Range::closed(0.0001, 0.02)),
            Presence::Number(0.00075),
            "Spacing of contact samples where a gripper can reach.",
        ),
    ],
};

/// A free rigid body.
pub(crate) static RIGID: Record = Record {
    label: "asset.body",
    class: "softvt.Rigid",
    kind: "softvt.rigid",
    doc: "A free rigid body of uniform density.",
    fields: &[field("density", Type::Number("kg/m³", Range::POSITIVE), Required, "Density.")],
};

/// A part of the world.
pub(crate) static STATIC: Record = Record {
    label: "asset.body",
    class: "softvt.Static",
    kind: "softvt.static",
    doc: "A part of the world that never moves.",
    fields: &[],
};

/// What is only seen.
pub(crate) static SCENERY: Record = Record {
    label: "asset.body",
    class: "softvt.Scenery",
    kind: "softvt.scenery",
    doc: "Part of the picture only: it is drawn, casts shadows, and nothing touches it.",
    fields: &[],
};

/// A kind of object.
pub(crate) static ASSET: Record = Record {
    label: "asset",
    class: "softvt.Asset",
    kind: "softvt.asset",
    doc: "A kind of object: its shape at rest with its lowest point at z = 0 and its centre on the z axis.",
    fields: &[
        field("name", Type::Name, Required, "Name, as in results and calibration files."),
        field("shape", Type::Object("softvt.Shape"), Required, "Its shape, in metres."),
        field(
            "body",
            Type::Made(&[&SOFT, &RIGID, &ARTICULATED, &STATIC, &SCENERY]),
            Required,
            "How it moves.",
        ),
        field("friction", Type::Nested(&FRICTION), Empty, "Friction of its surface."),
        field(
            "visuals",
            Type::List(&Type::Nested(&VISUAL)),
            Optional,
            "Appearances by material id of the shape; the first is id 0.",
        ),
        field(
            "hints",
            Type::Map(&Type::Number("", Range::ANY)),
            Optional,
            "Numbers for experts (grasp height, closure …).",
        ),
    ],
};

/// Where things stand.
pub(crate) static LAYOUT: Record = Record {
    label: "layout",
    class: "softvt.Layout",
    kind: "softvt.layout",
    doc: "How a scene is laid out. Tasks with the same layout name share their initial states.",
    fields: &[
        field("name", Type::Text, Required, "Name; part of the seed."),
        field(
            "build",
            Type::Function("fun(scene: softvt.Scene, rng: softvt.Rng)"),
            Required,
            "Puts the objects into the scene.",
        ),
    ],
};

/// Rest on a target.
pub(crate) static ON: Record = Record {
    label: "task.goal",
    class: "softvt.On",
    kind: "softvt.on",
    doc: "The object rests on the target, released, for a time.",
    fields: GOAL_FIELDS,
};

/// Rest inside a target.
pub(crate) static INSIDE: Record = Record {
    label: "task.goal",
    class: "softvt.Inside",
    kind: "softvt.inside",
    doc: "The object rests inside the target's walls, released, for a time.",
    fields: GOAL_FIELDS,
};

const GOAL_FIELDS: &[Field] = &[
    field("object", Type::Text, Required, "Scene name of the object."),
    field(
        "target",
        Type::Text,
        Required,
        "Scene name of what it must reach, or of a part of it (cabinet.top_drawer).",
    ),
    field(
        "hold_s",
        Type::Number("s", Range::closed(0.0, 10.0)),
        Presence::Number(0.4),
        "How long it must stay.",
    ),
];

/// One task.
pub(crate) static TASK: Record = Record {
    label: "task",
    class: "softvt.Task",
    kind: "softvt.task",
    doc: "One task of a suite.",
    fields: &[
        field("prompt", Type::Text, Required, "What the policy is told."),
        field("layout", Type::Made(&[&LAYOUT]), Required, "Where things stand at the start."),
        field("goal", Type::Made(&[&ON, &INSIDE]), Required, "When it is done."),
        field(
            "expert",
            Type::Function("fun(arm: softvt.Arm, scene: softvt.View)"),
            Optional,
            "A coroutine that does the task, with privileged state.",
        ),
        field(
            "budget_steps",
            Type::Integer(Range::closed(1.0, 100_000.0)),
            Optional,
            "Control steps (20 Hz) that the policy has; 500 where a suite varies layouts, 700 where it varies objects.",
        ),
    ],
};

/// A change of the scene that a run may ask for.
pub(crate) static SHIFT: Record = Record {
    label: "shift",
    class: "softvt.Shift",
    kind: "softvt.shift",
    doc: "A change of the scene that a run may ask for with --shift name=value. Thresholds stay nominal.",
    fields: &[
        field("name", Type::Text, Required, "Name on the command line."),
        field("unit", Type::Text, Presence::Text("1"), "Unit of the value."),
        field("default", Type::Number("", Range::ANY), Required, "The value that changes nothing."),
        field("min", Type::Number("", Range::ANY), Optional, "Lowest value."),
        field("max", Type::Number("", Range::ANY), Optional, "Highest value."),
        field(
            "apply",
            Type::Function("fun(scene: softvt.Scene, value: number): softvt.Scene?"),
            Required,
            "Changes the scene.",
        ),
    ],
};

/// Tasks reported together.
pub(crate) static SUITE: Record = Record {
    label: "suite",
    class: "softvt.Suite",
    kind: "softvt.suite",
    doc: "A set of tasks that are reported together.",
    fields: &[
        field("name", Type::Name, Required, "Name, as in results; part of the seed."),
        field("object_type", Type::Choice(&["deformable", "rigid"]), Required, "What the objects are."),
        field("variation", Type::Choice(&["object", "spatial"]), Required, "What varies between tasks."),
        field(
            "episodes",
            Type::Integer(Range::closed(1.0, 1e6)),
            Presence::Integer(5),
            "Episodes a task by default.",
        ),
        field("tasks", Type::List(&Type::Made(&[&TASK])), Required, "The tasks, in order."),
        field("shifts", Type::List(&Type::Made(&[&SHIFT])), Optional, "Changes that a run may ask for."),
        field(
            "settings",
            Type::Map(&Type::Map(&Type::Any)),
            Optional,
            "What it changes of the mechanics, the robot and the judge: { physics = {…}, robot = {…}, criteria = {…} }.",
        ),
    ],
};

/// A scripted run over a grid.
pub(crate) static EXPERIMENT: Record = Record {
    label: "experiment",
    class: "softvt.Experiment",
    kind: "softvt.experiment",
    doc: "A function of a grid of parameters that yields rows. Give grid or points.",
    fields: &[
        field("name", Type::Name, Required, "Name, as in results."),
        field(
            "options",
            Type::Any,
            Optional,
            "What softvt.options gave; handed to the functions below as opt.",
        ),
        field(
            "grid",
            Type::Map(&Type::List(&Type::Any)),
            Optional,
            "Values of each parameter; every combination is run, names in alphabetical order, the last one fastest.",
        ),
        field(
            "points",
            Type::Function("fun(opt: table): table[]"),
            Optional,
            "Gives the points instead of a grid.",
        ),
        field(
            "run",
            Type::Function("fun(point: table, opt: table): table|table[]"),
            Required,
            "Gives a row or a list of rows for one point; points run in any order and on several threads.",
        ),
        field(
            "finish",
            Type::Function("fun(rows: table[], opt: table): softvt.Finish?"),
            Optional,
            "Sums up all rows.",
        ),
        field(
            "columns",
            Type::List(&Type::Text),
            Optional,
            "Columns of the table, in order; by default all, sorted.",
        ),
    ],
};

/// What an experiment's `finish` may return.
pub(crate) static FINISH: Record = Record {
    label: "finish",
    class: "softvt.Finish",
    kind: "softvt.Finish",
    doc: "What an experiment leaves behind besides its rows.",
    fields: &[
        field("text", Type::Text, Optional, "Printed after the rows."),
        field(
            "files",
            Type::Map(&Type::OneOf(&[
                Type::Text,
                Type::Object("softvt.Image"),
                Type::Map(&Type::Any),
                Type::List(&Type::Any),
            ])),
            Optional,
            "Files to write, by relative path: text as it is, pictures as PNG, tables as JSON with sorted keys.",
        ),
    ],
};

/// An option of a script.
pub(crate) static OPTION: Record = Record {
    label: "option",
    class: "softvt.Option",
    kind: "softvt.Option",
    doc: "An option of the script: key gap_mm is --gap-mm on the command line. The default gives the type.",
    fields: &[
        field("default", Type::Any, Required, "A number, string, boolean, or list of numbers or strings."),
        field("integer", Type::Boolean, Presence::Boolean(false), "Whether only whole numbers are taken."),
        field("unit", Type::Text, Presence::Text(""), "Unit of a number."),
        field("min", Type::Number("", Range::ANY), Optional, "Lowest number."),
        field("max", Type::Number("", Range::ANY), Optional, "Highest number."),
        field("choices", Type::List(&Type::Text), Optional, "The only strings allowed."),
        field("help", Type::Text, Presence::Text(""), "What it does, for --help."),
    ],
};

/// How far a hand would be from things.
pub(crate) static CLEARANCE: Record = Record {
    label: "scene:clearance",
    class: "softvt.Clearance",
    kind: "softvt.Clearance",
    doc: "How a hand would be held, and what it may touch.",
    fields: &[
        field(
            "width",
            Type::Number("m", Range::closed(0.0, 0.08)),
            Presence::Number(0.08),
            "Distance of the pads.",
        ),
        field("ignore", Type::List(&Type::Text), Optional, "Scene names of what it may touch."),
    ],
};

/// What `scene:add` takes.
pub(crate) static PLACE: Record = Record {
    label: "scene:add",
    class: "softvt.Place",
    kind: "softvt.Place",
    doc: "An asset put somewhere. Give at or xyz.",
    fields: &[
        field("name", Type::Name, Required, "Name in the scene, unique."),
        field("asset", Type::Made(&[&ASSET]), Required, "What it is."),
        field(
            "at",
            Type::Vector(2, "m, world"),
            Optional,
            "x, y; it stands on the table, or on what `on` names.",
        ),
        field("xyz", Type::Vector(3, "m, world"), Optional, "Its origin: lowest point, on the centre line."),
        field("yaw", Type::Number("rad", Range::ANY), Presence::Number(0.0), "Turn about the vertical."),
        field(
            "on",
            Type::Text,
            Optional,
            "Scene name of an object or part (cabinet.top_drawer) that it stands on (with at).",
        ),
        field(
            "joints",
            Type::Map(&Type::Number("m or rad", Range::ANY)),
            Optional,
            "Start values of an articulated object's joints by part; 0, or the nearest limit, by default.",
        ),
    ],
};

/// Where a pose is.
pub(crate) static POSE: Record = Record {
    label: "pose",
    class: "softvt.PoseSpec",
    kind: "softvt.PoseSpec",
    doc: "A pose in the world frame. Without a quaternion the hand points straight down.",
    fields: &[
        field("xyz", Type::Vector(3, "m, world"), Required, "Position."),
        field(
            "yaw",
            Type::Number("rad", Range::ANY),
            Presence::Number(0.0),
            "Turn of the downward hand about the vertical.",
        ),
        field("quat", Type::Vector(4, "w, x, y, z"), Optional, "Orientation instead of yaw."),
    ],
};

/// Constructors of the form `softvt.name{…}` that only check their table, by name.
pub(crate) static CONSTRUCTORS: &[(&str, &Record)] = &[
    ("suite", &SUITE),
    ("task", &TASK),
    ("on", &ON),
    ("inside", &INSIDE),
    ("asset", &ASSET),
    ("soft", &SOFT),
    ("rigid", &RIGID),
    ("articulated", &ARTICULATED),
    ("slider", &SLIDER),
    ("hinge", &HINGE),
    ("static", &STATIC),
    ("scenery", &SCENERY),
    ("shift", &SHIFT),
    ("conditions", &CONDITIONS),
    ("experiment", &EXPERIMENT),
];

/// Tables that functions take but no constructor makes.
pub(crate) static PLAIN: &[&Record] =
    &[&FRICTION, &PART, &VISUAL, &LAYER, &CONDITION, &FINISH, &OPTION, &PLACE, &POSE, &CLEARANCE];
