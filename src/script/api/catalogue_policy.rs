//! The binding table of policies and profiles: what their files return, and what a policy sees.

use crate::policy::decode::MAX_CHUNK_LEN;
use crate::script::{
    api::catalogue_classes::{Class, method},
    schema::{Field, Presence, Range, Record, Type},
};

use Presence::{Boolean, Empty, Optional, Required};

const fn field(name: &'static str, ty: Type, presence: Presence, doc: &'static str) -> Field {
    Field { name, ty, presence, doc }
}

const NUMBER: Type = Type::Number("", Range::ANY);
const STEP: Type = Type::Number("", Range { max: 10.0, ..Range::POSITIVE });
const PIXELS: Type = Type::Number("px", Range::closed(0.0, 1e3));

/// What a policy looks at.
pub(crate) static LOOKS: Record = Record {
    label: "policy.looks",
    class: "softvt.SensorAssets",
    kind: "softvt.SensorAssets",
    doc: "What a policy looks at; nothing else is computed.",
    fields: &[
        field("cameras", Type::List(&Type::Name), Optional, "Cameras of the scene, by name."),
        field("touch", Type::Boolean, Boolean(false), "Whether it feels what the fingers feel."),
        field(
            "force",
            Type::Boolean,
            Boolean(false),
            "Whether it gets the true forces on the gels, which no real sensor gives: results say force_observed.",
        ),
    ],
};

/// A policy.
pub(crate) static POLICY: Record = Record {
    label: "policy",
    class: "softvt.Policy",
    kind: "softvt.policy",
    doc: "A policy, which the file behind --policy returns. Every episode has a machine of its own, in which the file is run \
          anew; math.random is seeded by the episode.",
    fields: &[
        field("name", Type::Name, Required, "Its name in results, unless --name says otherwise."),
        field("looks", Type::Nested(&LOOKS), Empty, "What it looks at."),
        field(
            "reset",
            Type::Function("fun(task: softvt.Brief)"),
            Optional,
            "Called when the episode begins.",
        ),
        field(
            "act",
            Type::Function("fun(obs: softvt.Observation): softvt.Action|softvt.Action[]"),
            Required,
            "Gives the action of this control step, or a list of them for the next ones.",
        ),
        field(
            "replan",
            Type::Integer(Range::closed(1.0, MAX_CHUNK_LEN as f64)),
            Optional,
            "How many actions of a list are carried out, unless --replan says otherwise; all of them if left out.",
        ),
    ],
};

/// What a policy commands.
pub(crate) static ACTION: Record = Record {
    label: "action",
    class: "softvt.Action",
    kind: "softvt.Action",
    doc: "A command for one control step (0.05 s): a pose of the tool centre point in the robot's base frame and a closure. \
          Give axis_angle or rotation.",
    fields: &[
        field("position", Type::Vector(3, "m, base frame"), Required, "Position."),
        field("axis_angle", Type::Vector(3, "rad, base frame"), Optional, "Orientation as axis-angle."),
        field("rotation", Type::Vector(4, "w, x, y, z, base frame"), Optional, "Orientation as quaternion."),
        field("closure", Type::Number("", Range::closed(0.0, 1.0)), Required, "Gripper, 0 open to 1 shut."),
    ],
};

/// An entry of an observation that is sent.
pub(crate) static INPUT: Record = Record {
    label: "profile.inputs",
    class: "softvt.Input",
    kind: "softvt.Input",
    doc: "One entry of the observations that a server gets.",
    fields: &[
        field("keys", Type::List(&Type::Text), Required, "Keys it is sent under."),
        field(
            "source",
            Type::Choice(&[
                "camera",
                "state",
                "prompt",
                "tactile_image",
                "tactile",
                "marker_motion",
                "force",
            ]),
            Required,
            "What it is: a camera's picture; numbers of the robot; the instruction; the mosaic of 8 tactile pictures of both \
             fingers; the last picture of one finger; the markers' first and last 8 places; the last 8 true forces on the gels.",
        ),
        field("camera", Type::Name, Optional, "With camera: its name in the scene."),
        field(
            "half_turn",
            Type::Boolean,
            Optional,
            "With camera: whether the picture is turned by half a turn.",
        ),
        field(
            "parts",
            Type::List(&Type::Choice(&[
                "position",
                "axis_angle",
                "quaternion_wxyz",
                "quaternion_xyzw",
                "joints",
                "gripper_width",
                "finger_position",
                "finger_pair",
                "closure",
            ])),
            Optional,
            "With state: its parts in order, of 3, 3, 4, 4, 7, 1, 1, 2 and 1 numbers, in m and rad in the base frame.",
        ),
        field(
            "layout",
            Type::Choice(&["rows", "columns"]),
            Optional,
            "With tactile_image: the left finger above (rows, if left out) or at the left.",
        ),
        field("finger", Type::Choice(&["left", "right"]), Optional, "With tactile: which."),
    ],
};

/// The gripper's number of an action.
pub(crate) static GRIPPER: Record = Record {
    label: "profile.actions.gripper",
    class: "softvt.GripperValues",
    kind: "softvt.GripperValues",
    doc: "The seventh number of an action: one value opens, one shuts, those between in proportion.",
    fields: &[
        field("open", NUMBER, Required, "The value that opens."),
        field("shut", NUMBER, Required, "The value that shuts."),
        field(
            "binary",
            Type::Boolean,
            Boolean(false),
            "Whether all beyond the middle shuts and all else opens.",
        ),
    ],
};

/// How replies are read.
pub(crate) static ACTIONS: Record = Record {
    label: "profile.actions",
    class: "softvt.ActionEncoding",
    kind: "softvt.ActionEncoding",
    doc: "How the numbers of an action are read: three of position, three of orientation (axis-angle), one of the gripper; \
          more are padding.",
    fields: &[
        field(
            "pose",
            Type::Choice(&["absolute", "delta", "delta_osc"]),
            Required,
            "absolute: a pose in the base frame. delta: shares -1 to 1 of a step away from where the tool is. delta_osc: the \
             same, as far as robosuite's controller gets within a control step.",
        ),
        field("translation_m", STEP, Optional, "With delta and delta_osc: the step that 1 means, m."),
        field("rotation_rad", STEP, Optional, "With delta and delta_osc: the turn that 1 means, rad."),
        field("scale", Type::Vector(6, ""), Optional, "The first six numbers are multiplied by these first."),
        field("offset", Type::Vector(6, ""), Optional, "Then these are added."),
        field(
            "length",
            Type::Integer(Range::closed(7.0, 4096.0)),
            Optional,
            "How many numbers an action must have, padding included; any from 7 on if left out.",
        ),
        field("gripper", Type::Nested(&GRIPPER), Required, "The seventh number."),
    ],
};

/// A profile.
pub(crate) static PROFILE: Record = Record {
    label: "profile",
    class: "softvt.Profile",
    kind: "softvt.profile",
    doc: "What a policy's server gets and what its numbers mean; the file behind --profile returns one.",
    fields: &[
        field("name", Type::Name, Required, "Its name in results, unless --name says otherwise."),
        field("inputs", Type::List(&Type::Nested(&INPUT)), Required, "What is sent, in order."),
        field("actions", Type::Nested(&ACTIONS), Required, "How replies are read."),
    ],
};

/// Constructors.
pub(crate) static CONSTRUCTORS: &[(&str, &Record)] = &[("policy", &POLICY), ("profile", &PROFILE)];

/// Tables that no constructor makes.
pub(crate) static PLAIN: &[&Record] = &[&LOOKS, &ACTION, &INPUT, &ACTIONS, &GRIPPER];

/// What a policy is told of an episode; a plain table.
pub(crate) static BRIEF: Class = Class {
    name: "softvt.Brief",
    doc: "Which episode begins: what a policy is told of it.",
    fields: &[
        ("suite", "string", "Name of the suite."),
        ("task", "integer", "Index of the task, from 0."),
        ("prompt", "string", "The instruction."),
        ("episode", "integer", "Index of the episode, from 0."),
    ],
    written: &[],
    methods: &[],
};

/// `softvt.Observation`.
pub(crate) static OBSERVATION: Class = Class {
    name: "softvt.Observation",
    doc: "What a policy sees at a control step. Poses are of the tool centre point in the robot's base frame; hidden state has \
          no field here.",
    fields: &[
        ("time", "number", "Time since the policy took over, s."),
        ("position", "number[]", "Tool position, m."),
        ("axis_angle", "number[]", "Tool orientation as axis-angle, rad."),
        ("rotation", "number[]", "The same as quaternion w, x, y, z with w of 0 or more."),
        ("joints", "number[]", "The seven joint angles of the arm, rad."),
        ("width", "number", "Measured distance of the gels, 0 to 0.08 m."),
        ("closure", "number", "Closure commanded last, 0 open to 1 shut."),
        ("prompt", "string", "The instruction."),
        ("touch", "{left: softvt.Touch, right: softvt.Touch}", "What the fingers feel; with looks.touch."),
        (
            "touch_history",
            "{left: softvt.Touch, right: softvt.Touch}[]",
            "The same of the last 1 to 8 control steps, oldest first; with looks.touch.",
        ),
        (
            "force",
            "{left: number[], right: number[]}",
            "True forces on the gels, N, pad frame: a pressing body makes z negative; with looks.force.",
        ),
    ],
    written: &[],
    methods: &[method(
        "camera",
        &[("name", Type::Text)],
        &["softvt.Image"],
        "What a camera of looks.cameras sees, 224 × 224 unless the scene says otherwise.",
    )],
};

/// `softvt.Touch`.
pub(crate) static TOUCH: Class = Class {
    name: "softvt.Touch",
    doc: "A finger's tactile sensor at one control step; docs/tactile.md draws its frames.",
    fields: &[
        ("picture", "softvt.Image", "The colour picture, 320 × 240."),
        ("change", "softvt.Image", "How far each channel of each pixel is from the untouched gel's picture."),
        ("markers", "softvt.Markers", "The 11 × 9 markers."),
    ],
    written: &[],
    methods: &[],
};

/// `softvt.Markers`.
pub(crate) static MARKERS: Class = Class {
    name: "softvt.Markers",
    doc: "The 99 markers of a finger, row by row, in px of its picture: x to the right (to the hand), y down. 1 px is 0.063 mm.",
    fields: &[
        ("initial", "number[][]", "Their places without a touch."),
        ("present", "number[][]", "Their places now."),
        ("motion", "number[][]", "How far each has moved."),
    ],
    written: &[],
    methods: &[
        method(
            "mean",
            &[],
            &["number[]"],
            "Mean motion along x and y: the gel is dragged along its surface.",
        ),
        method("largest", &[], &["number"], "The longest motion."),
        method(
            "press",
            &[],
            &["number"],
            "How hard the gel is pressed: root mean square of the motion that is neither mean nor twist. It grows with the \
             normal force, about 0.3 px a newton on round dough and rigid things and less on what is flat and soft.",
        ),
        method(
            "drag",
            &[],
            &["number"],
            "How hard something is on its way out of the grasp: mean motion to the fingertip or across, 0 if it is pushed in.",
        ),
        method(
            "divergence",
            &[],
            &["number"],
            "Trace of the motion's gradient: positive where a dent pushes the markers outwards.",
        ),
        method("twist", &[], &["number"], "Turn of the markers, rad: positive is clockwise in the picture."),
        method(
            "shear",
            &[],
            &["number[]"],
            "Pure shear of the markers: stretch along x against y, and along the diagonal x = y.",
        ),
        method(
            "moved",
            &[("px", PIXELS)],
            &["boolean[]"],
            "Contact mask: which markers moved by more than px.",
        ),
        method(
            "area",
            &[("px", PIXELS)],
            &["number"],
            "Share of the markers that moved by more than px; all of the picture is 20.3 × 15.2 mm.",
        ),
    ],
};
