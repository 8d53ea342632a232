//! The binding table of objects that the host hands to scripts and of plain functions: signatures and documentation.

use crate::script::{
    api::catalogue as tables,
    api::catalogue_shapes::MESH,
    api::catalogue_world::{ENVELOPE, NEW_CAMERA, NEW_IMAGE, SIMULATE, WORLD},
    schema::{Field, Range, Type},
};

/// A function or method.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Signature {
    /// Name, without the object.
    pub name: &'static str,
    /// Parameters: name (with `?` if it may be left out) and type; arguments are checked by them.
    pub params: &'static [(&'static str, Type)],
    /// LuaCATS types of what it returns.
    pub returns: &'static [&'static str],
    /// One or two sentences.
    pub doc: &'static str,
}

/// A class of objects.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Class {
    /// Name, `softvt.Rng`.
    pub name: &'static str,
    /// One or two sentences.
    pub doc: &'static str,
    /// Fields that are only read: name, LuaCATS type, documentation.
    pub fields: &'static [(&'static str, &'static str, &'static str)],
    /// Fields that are read and written.
    pub written: &'static [Field],
    /// Methods.
    pub methods: &'static [Signature],
}

pub(crate) const fn method(
    name: &'static str,
    params: &'static [(&'static str, Type)],
    returns: &'static [&'static str],
    doc: &'static str,
) -> Signature {
    Signature { name, params, returns, doc }
}

const NUMBER: Type = Type::Number("", Range::ANY);
const METRES: Type = Type::Number("m", Range::ANY);
const MOTION: Type = Type::Table("{speed: number?, turn: number?, closure: number?}");
const RATE: Type = Type::Table("{rate: number?}");
const CLOSURE: Type = Type::Number("", Range::closed(0.0, 1.0));
const SHAPE_VALUE: Type = Type::Object("softvt.Shape");
const POSE_VALUE: Type = Type::Object("softvt.Pose");

/// Functions of `softvt` that are not constructors of one table.
pub(crate) static FUNCTIONS: &[Signature] = &[
    method(
        "layout",
        &[
            ("name", Type::OneOf(&[Type::Text, Type::Nested(&tables::LAYOUT)])),
            ("build?", Type::Function("fun(scene: softvt.Scene, rng: softvt.Rng)")),
        ],
        &["softvt.Layout"],
        "A layout by name and function, or by a table of name and build.",
    ),
    method(
        "options",
        &[("options", Type::Map(&Type::Nested(&tables::OPTION)))],
        &["table<string, any>"],
        "Declares the script's options; gives their values, from the command line or by default.",
    ),
    method(
        "world",
        &[("world?", Type::Nested(&WORLD))],
        &["softvt.World"],
        "An empty world without a robot.",
    ),
    method(
        "simulate",
        &[("simulate", Type::Nested(&SIMULATE))],
        &["softvt.Simulation"],
        "A settled scene with the robot.",
    ),
    method(
        "envelope",
        &[("envelope", Type::Nested(&ENVELOPE))],
        &["table"],
        "What a calibration found: lower, closure_at_tau, safe_window, tau, d_ref, and as text: text (a plot), sweep \
         (JSON lines), json (a threshold file).",
    ),
    method(
        "calibration",
        &[("asset", Type::Name)],
        &["table?"],
        "What assets/calibration/<asset>.json says, as softvt.envelope gives it; nil if there is no such file.",
    ),
    method(
        "stable",
        &[("row", Type::Table("table"))],
        &["boolean"],
        "Whether a row of a compression sweep is a stable squeeze.",
    ),
    method("image", &[("image", Type::Nested(&NEW_IMAGE))], &["softvt.Image"], "An empty picture."),
    method("pose", &[("pose", Type::Nested(&tables::POSE))], &["softvt.Pose"], "A pose in the world frame."),
    method("mesh", &[("mesh", Type::Nested(&MESH))], &["softvt.Shape"], "A shape from a mesh file."),
    method(
        "sorted",
        &[("t", Type::Table("table"))],
        &["fun(): any, any"],
        "Iterates over keys and values in an order that does not depend on hashes: numbers, strings, booleans. In a \
         script, pairs does the same.",
    ),
];

/// Methods of a shape that do not take one table; the others come from the table of shapes.
pub(crate) static SHAPE: Class = Class {
    name: "softvt.Shape",
    doc: "A solid. Methods give a new shape and leave this one as it is.",
    fields: &[],
    written: &[],
    methods: &[
        method(
            "translate",
            &[("x", METRES), ("y", METRES), ("z", METRES)],
            &["softvt.Shape"],
            "Moved by an offset, m.",
        ),
        method(
            "scale",
            &[("x", NUMBER), ("y?", NUMBER), ("z?", NUMBER)],
            &["softvt.Shape"],
            "Stretched by factors; one factor counts for all axes.",
        ),
        method(
            "round",
            &[("radius", METRES)],
            &["softvt.Shape"],
            "Grown by a radius (m), which rounds convex edges.",
        ),
        method(
            "shell",
            &[("wall", METRES)],
            &["softvt.Shape"],
            "The wall of this thickness (m) under the surface.",
        ),
        method("union", &[("other", SHAPE_VALUE)], &["softvt.Shape"], "This or the other."),
        method("intersect", &[("other", SHAPE_VALUE)], &["softvt.Shape"], "This and the other."),
        method(
            "subtract",
            &[("cut", SHAPE_VALUE), ("blend?", METRES)],
            &["softvt.Shape"],
            "This without the other; blend (m) rounds the edge.",
        ),
        method(
            "smooth_union",
            &[("other", SHAPE_VALUE), ("blend", METRES)],
            &["softvt.Shape"],
            "This or the other, with a fillet of width blend (m).",
        ),
        method("bounds", &[], &["number[]", "number[]"], "Lowest and highest corner of the bounding box, m."),
        method("volume", &[], &["number"], "Its volume, m³."),
        method(
            "grounded",
            &[],
            &["softvt.Shape"],
            "Moved so that its lowest point is at z = 0 and its centre on the z axis.",
        ),
    ],
};

/// `softvt.Pose`.
pub(crate) static POSE: Class = Class {
    name: "softvt.Pose",
    doc: "An immutable pose in the world frame.",
    fields: &[
        ("x", "number", "Position, m."),
        ("y", "number", "Position, m."),
        ("z", "number", "Position, m."),
        ("xyz", "number[]", "Position, m."),
        ("quat", "number[]", "Orientation w, x, y, z with w of 0 or more."),
    ],
    written: &[],
    methods: &[
        method(
            "moved",
            &[("by", Type::Vector(3, "m"))],
            &["softvt.Pose"],
            "Moved by an offset in the world frame, m.",
        ),
        method(
            "at",
            &[("xyz", Type::Vector(3, "m"))],
            &["softvt.Pose"],
            "The same orientation at another place, m.",
        ),
        method(
            "turned",
            &[("angle", NUMBER)],
            &["softvt.Pose"],
            "Turned where it is about the world's vertical, rad.",
        ),
        method(
            "towards",
            &[("other", POSE_VALUE), ("share", NUMBER)],
            &["softvt.Pose"],
            "Part of the way to another pose: 0 is here, 1 there.",
        ),
        method(
            "distance",
            &[("other", POSE_VALUE)],
            &["number", "number"],
            "Metres and radians to another pose.",
        ),
    ],
};

/// `softvt.Rng`.
pub(crate) static RNG: Class = Class {
    name: "softvt.Rng",
    doc: "A named stream of random numbers, a function of suite, layout, episode, seed and split alone.",
    fields: &[],
    written: &[],
    methods: &[
        method(
            "stream",
            &[(
                "name",
                Type::Choice(&[
                    "layout", "arm", "material", "light", "camera", "sensor", "expert", "script", "policy",
                ]),
            )],
            &["softvt.Rng"],
            "Another stream, from its start.",
        ),
        method("uniform", &[("a", NUMBER), ("b", NUMBER)], &["number"], "Uniform from a to below b."),
        method("normal", &[("mean", NUMBER), ("sigma", NUMBER)], &["number"], "Normally distributed."),
        method(
            "int",
            &[("low", Type::Integer(Range::ANY)), ("high", Type::Integer(Range::ANY))],
            &["integer"],
            "Whole number, both ends included.",
        ),
        method("choice", &[("list", Type::List(&Type::Any))], &["any"], "One of a list."),
        method("shuffle", &[("list", Type::List(&Type::Any))], &["any[]"], "A copy in random order."),
    ],
};

/// `softvt.Scene`.
pub(crate) static SCENE: Class = Class {
    name: "softvt.Scene",
    doc: "The scene that a layout or a shift builds.",
    fields: &[
        ("objects", "softvt.Object[]", "The placed objects, in order."),
        ("light", "softvt.Light", "The light on them."),
    ],
    written: crate::script::api::scene::SCENE,
    methods: &[
        method("add", &[("place", Type::Nested(&tables::PLACE))], &[], "Puts an asset somewhere."),
        method("object", &[("name", Type::Text)], &["softvt.Object"], "A placed object."),
        method(
            "camera",
            &[("name", Type::Text)],
            &["softvt.Camera"],
            "A camera; every scene has third_person and wrist.",
        ),
        method(
            "add_camera",
            &[("camera", Type::Nested(&NEW_CAMERA))],
            &["softvt.Camera"],
            "One more camera.",
        ),
    ],
};

/// `softvt.Light`.
pub(crate) static LIGHT: Class = Class {
    name: "softvt.Light",
    doc: "The light of a scene: one key light and a sky. Its numbers may be read and written.",
    fields: &[],
    written: crate::script::api::view::LIGHT,
    methods: &[],
};

/// `softvt.Camera`.
pub(crate) static CAMERA: Class = Class {
    name: "softvt.Camera",
    doc: "A pinhole camera; its numbers may be read and written.",
    fields: &[("name", "string", "Its name."), ("mount", "\"world\"|\"hand\"", "What it is fixed to.")],
    written: crate::script::api::view::CAMERA,
    methods: &[method(
        "look_at",
        &[("point", Type::Vector(3, "m, frame of the mount")), ("up?", Type::Vector(3, ""))],
        &[],
        "Turns it to a point (m, frame of the mount); up, z if left out, is upwards in the picture.",
    )],
};

/// `softvt.Look`.
pub(crate) static LOOK: Class = Class {
    name: "softvt.Look",
    doc: "A material of a placed object; its numbers may be read and written, the layers over it stay.",
    fields: &[],
    written: crate::script::api::view::LOOK,
    methods: &[],
};

/// `softvt.Object`.
pub(crate) static OBJECT: Class = Class {
    name: "softvt.Object",
    doc: "A placed object; its numbers may be read and written.",
    fields: &[
        ("name", "string", "Name in the scene."),
        ("asset", "string", "Name of its asset."),
        ("looks", "softvt.Look[]", "Its materials, in the order of the asset's visuals."),
        ("joints", "table<string, number>", "Start values of its joints by part, m or rad."),
    ],
    written: crate::script::api::scene::OBJECT,
    methods: &[
        method(
            "mass",
            &[("part?", Type::Text)],
            &["number?"],
            "Mass of a soft or rigid body, of one moving part of an articulated object, or of all of them, kg; nil for what \
             never moves.",
        ),
        method(
            "scale_mass",
            &[("factor", Type::Number("", Range::closed(1e-6, 1e6)))],
            &[],
            "Multiplies the density of a soft or rigid body, or of every moving part; what never moves stays as it is.",
        ),
    ],
};

/// `softvt.View`.
pub(crate) static VIEW: Class = Class {
    name: "softvt.View",
    doc: "The true scene at this control step, as an expert sees it.",
    fields: &[],
    written: &[],
    methods: &[
        method("object", &[("name", Type::Text)], &["softvt.Seen"], "An object."),
        method(
            "part",
            &[("object", Type::Text), ("part", Type::Text)],
            &["softvt.Seen"],
            "A part of an articulated object.",
        ),
        method("objects", &[], &["softvt.Seen[]"], "All objects, in the order of the scene."),
        method(
            "clearance",
            &[("pose", POSE_VALUE), ("options?", Type::Nested(&tables::CLEARANCE))],
            &["number", "string?"],
            "Metres (at most 0.2) between a hand at pose and the nearest object, and the name of that; negative inside.",
        ),
    ],
};

/// `softvt.Seen`.
pub(crate) static SEEN: Class = Class {
    name: "softvt.Seen",
    doc: "An object as an expert sees it, at one moment.",
    fields: &[
        ("name", "string", "Name in the scene."),
        ("asset", "string", "Name of its asset."),
        ("xyz", "number[]", "Middle of its bounding box, world, m."),
        ("size", "number[]", "Edge lengths of its bounding box at rest, m."),
        ("yaw", "number", "Turn about the vertical, rad."),
        ("hints", "table<string, number>", "Numbers that its asset gives to experts."),
        ("joint", "number?", "Joint value of a part, m or rad."),
        ("joints", "table<string, number>", "Joint values of an articulated object by part, m or rad."),
        ("parts", "table<string, softvt.Seen>", "The parts of an articulated object by name."),
    ],
    written: &[],
    methods: &[],
};

/// `softvt.Arm`.
pub(crate) static ARM: Class = Class {
    name: "softvt.Arm",
    doc: "What an expert drives. Each motion lasts as many control steps as it needs.",
    fields: &[
        ("pose", "softvt.Pose", "Measured pose of the tool centre point."),
        ("target", "softvt.Pose", "Pose commanded last."),
        ("closure", "number", "Closure commanded last, 0 open to 1 shut."),
        ("gripping", "boolean", "Whether grasp was called last, not release or open."),
        ("width", "number", "Measured distance of the pads, m."),
        ("force", "number[]", "Normal force on the left and right pad, N."),
        ("time", "number", "Time since the start, s."),
        ("dt", "number", "Length of a control step, s."),
    ],
    written: &[],
    methods: &[
        method(
            "command",
            &[("pose", POSE_VALUE), ("closure", CLOSURE)],
            &[],
            "Sends one command and comes back at the next control step.",
        ),
        method(
            "move_to",
            &[("pose", POSE_VALUE), ("options?", MOTION)],
            &[],
            "Moves straight and smoothly, at most at speed (m/s, 0.25) and turn (rad/s, 1.5).",
        ),
        method(
            "move_by",
            &[("offset", Type::Vector(3, "m")), ("options?", MOTION)],
            &[],
            "Moves by an offset in the world frame, m.",
        ),
        method(
            "close_to",
            &[("closure", CLOSURE), ("options?", RATE)],
            &[],
            "Closes or opens at a rate (1/s, 0.5; 1 is the whole stroke in a second).",
        ),
        method(
            "grasp",
            &[("closure", CLOSURE), ("options?", RATE)],
            &[],
            "Closes on an object; a binary gripper, which knows only open and shut, shuts here and not in close_to, and a \
             tactile servo closes until both fingers feel that they hold something, whatever closure says.",
        ),
        method(
            "release",
            &[("options?", Type::Table("{rate: number?, closure: number?}"))],
            &[],
            "Lets go of an object, opening to a closure or wide.",
        ),
        method("open", &[("options?", RATE)], &[], "Opens the gripper."),
        method(
            "feel",
            &[],
            &["{left: softvt.Touch, right: softvt.Touch}"],
            "What the fingers feel now; the first time it waits for a control step. In simulation:drive and under --policy \
             tactile-servo.",
        ),
        method("wait", &[("seconds", Type::Number("s", Range::closed(0.0, 600.0)))], &[], "Holds still."),
        method(
            "give_up",
            &[("reason", Type::Text)],
            &[],
            "Ends the expert: the last command stays, and the episode's record and the results say why.",
        ),
    ],
};

/// `softvt.List`.
pub(crate) static LIST: Class = Class {
    name: "softvt.List",
    doc: "A list that belongs to an object: scene.base, look.albedo, scene.objects. #, [i], ipairs, pairs, table.unpack and \
          table.concat work on it, and it may be given wherever a list is expected. Numbers that may be written one by one \
          go to the object at once: scene.base[1] = 0.1 is as good as scene.base = { 0.1, 0, 0 }. Any other list refuses to \
          be written.",
    fields: &[],
    written: &[],
    methods: &[],
};

/// Objects that the host hands to scripts; a shape apart.
pub(crate) static CLASSES: &[&Class] = &[
    &crate::script::api::classes_world::WORLD,
    &crate::script::api::classes_world::BODY,
    &crate::script::api::classes_world::SOLID,
    &crate::script::api::classes_world::SIMULATION,
    &crate::script::api::classes_world::FELT,
    &crate::script::api::classes_world::IMAGE,
    &POSE,
    &RNG,
    &SCENE,
    &LIGHT,
    &CAMERA,
    &LOOK,
    &OBJECT,
    &VIEW,
    &SEEN,
    &ARM,
    &LIST,
    &crate::script::api::catalogue_policy::BRIEF,
    &crate::script::api::catalogue_policy::OBSERVATION,
    &crate::script::api::catalogue_policy::TOUCH,
    &crate::script::api::catalogue_policy::MARKERS,
];
