//! The binding table of objects that the host hands to scripts and of plain functions: signatures and documentation.

/// A function or method.
#[derive(Clone, Copy, Debug)]
pub struct Signature {
    /// Name, without the object.
    pub name: &'static str,
    /// Parameters: name (with `?` if it may be left out) and LuaCATS type.
    pub params: &'static [(&'static str, &'static str)],
    /// LuaCATS types of what it returns.
    pub returns: &'static [&'static str],
    /// One or two sentences.
    pub doc: &'static str,
}

/// A class of objects.
#[derive(Clone, Copy, Debug)]
pub struct Class {
    /// Name, `softvt.Rng`.
    pub name: &'static str,
    /// One or two sentences.
    pub doc: &'static str,
    /// Fields that are only read: name, LuaCATS type, documentation.
    pub fields: &'static [(&'static str, &'static str, &'static str)],
    /// Methods.
    pub methods: &'static [Signature],
}

pub(super) const fn method(
    name: &'static str,
    params: &'static [(&'static str, &'static str)],
    returns: &'static [&'static str],
    doc: &'static str,
) -> Signature {
    Signature { name, params, returns, doc }
}

/// Functions of `softvt` that are not constructors of one table.
pub static FUNCTIONS: &[Signature] = &[
    method(
        "layout",
        &[("name", "string|softvt.Layout"), ("build?", "fun(scene: softvt.Scene, rng: softvt.Rng)")],
        &["softvt.Layout"],
        "A layout by name and function, or by a table of name and build.",
    ),
    method(
        "options",
        &[("options", "table<string, softvt.Option>")],
        &["table<string, any>"],
        "Declares the script's options; gives their values, from the command line or by default.",
    ),
    method("world", &[("world?", "softvt.WorldSpec")], &["softvt.World"], "An empty world without a robot."),
    method(
        "simulate",
        &[("simulate", "softvt.SimulateSpec")],
        &["softvt.Simulation"],
        "A settled scene with the robot.",
    ),
    method(
        "envelope",
        &[("envelope", "softvt.EnvelopeSpec")],
        &["table"],
        "What a calibration found: lower, closure_at_tau, safe_window, tau, d_ref, and as text: text (a plot), sweep \
         (JSON lines), json (a threshold file).",
    ),
    method(
        "stable",
        &[("row", "table")],
        &["boolean"],
        "Whether a row of a compression sweep is a stable squeeze.",
    ),
    method("image", &[("image", "softvt.NewImage")], &["softvt.Image"], "An empty picture."),
    method("pose", &[("pose", "softvt.PoseSpec")], &["softvt.Pose"], "A pose in the world frame."),
    method("mesh", &[("mesh", "softvt.MeshSpec")], &["softvt.Shape"], "A shape from a mesh file."),
    method(
        "sorted",
        &[("t", "table")],
        &["fun(): any, any"],
        "Iterates over keys and values in an order that does not depend on hashes: numbers, strings, booleans. In a \
         script, pairs does the same.",
    ),
];

/// Methods of a shape that do not take one table; the others come from the table of shapes.
pub static SHAPE: Class = Class {
    name: "softvt.Shape",
    doc: "A solid. Methods give a new shape and leave this one as it is.",
    fields: &[],
    methods: &[
        method(
            "translate",
            &[("x", "number"), ("y", "number"), ("z", "number")],
            &["softvt.Shape"],
            "Moved by an offset, m.",
        ),
        method(
            "scale",
            &[("x", "number"), ("y?", "number"), ("z?", "number")],
            &["softvt.Shape"],
            "Stretched by factors; one factor counts for all axes.",
        ),
        method(
            "round",
            &[("radius", "number")],
            &["softvt.Shape"],
            "Grown by a radius (m), which rounds convex edges.",
        ),
        method(
            "shell",
            &[("wall", "number")],
            &["softvt.Shape"],
            "The wall of this thickness (m) under the surface.",
        ),
        method("union", &[("other", "softvt.Shape")], &["softvt.Shape"], "This or the other."),
        method("intersect", &[("other", "softvt.Shape")], &["softvt.Shape"], "This and the other."),
        method(
            "subtract",
            &[("cut", "softvt.Shape"), ("blend?", "number")],
            &["softvt.Shape"],
            "This without the other; blend (m) rounds the edge.",
        ),
        method(
            "smooth_union",
            &[("other", "softvt.Shape"), ("blend", "number")],
            &["softvt.Shape"],
            "This or the other, with a fillet of width blend (m).",
        ),
        method("bounds", &[], &["number[]", "number[]"], "Lowest and highest corner of the bounding box, m."),
        method(
            "grounded",
            &[],
            &["softvt.Shape"],
            "Moved so that its lowest point is at z = 0 and its centre on the z axis.",
        ),
    ],
};

/// Objects that the host hands to scripts; a shape apart.
pub static CLASSES: &[Class] = &[
    super::classes_world::WORLD,
    super::classes_world::BODY,
    super::classes_world::SOLID,
    super::classes_world::SIMULATION,
    super::classes_world::FELT,
    super::classes_world::IMAGE,
    Class {
        name: "softvt.Pose",
        doc: "An immutable pose in the world frame.",
        fields: &[
            ("x", "number", "Position, m."),
            ("y", "number", "Position, m."),
            ("z", "number", "Position, m."),
            ("xyz", "number[]", "Position, m."),
            ("quat", "number[]", "Orientation w, x, y, z with w of 0 or more."),
        ],
        methods: &[
            method(
                "moved",
                &[("by", "number[]")],
                &["softvt.Pose"],
                "Moved by an offset in the world frame, m.",
            ),
            method(
                "at",
                &[("xyz", "number[]")],
                &["softvt.Pose"],
                "The same orientation at another place, m.",
            ),
            method(
                "turned",
                &[("angle", "number")],
                &["softvt.Pose"],
                "Turned where it is about the world's vertical, rad.",
            ),
            method(
                "towards",
                &[("other", "softvt.Pose"), ("share", "number")],
                &["softvt.Pose"],
                "Part of the way to another pose: 0 is here, 1 there.",
            ),
            method(
                "distance",
                &[("other", "softvt.Pose")],
                &["number", "number"],
                "Metres and radians to another pose.",
            ),
        ],
    },
    Class {
        name: "softvt.Rng",
        doc: "A named stream of random numbers, a function of suite, layout, episode, seed and split alone.",
        fields: &[],
        methods: &[
            method(
                "stream",
                &[(
                    "name",
                    "\"layout\"|\"arm\"|\"material\"|\"light\"|\"camera\"|\"sensor\"|\"expert\"|\"script\"",
                )],
                &["softvt.Rng"],
                "Another stream, from its start.",
            ),
            method("uniform", &[("a", "number"), ("b", "number")], &["number"], "Uniform from a to below b."),
            method(
                "normal",
                &[("mean", "number"), ("sigma", "number")],
                &["number"],
                "Normally distributed.",
            ),
            method(
                "int",
                &[("low", "integer"), ("high", "integer")],
                &["integer"],
                "Whole number, both ends included.",
            ),
            method("choice", &[("list", "any[]")], &["any"], "One of a list."),
            method("shuffle", &[("list", "any[]")], &["any[]"], "A copy in random order."),
        ],
    },
    Class {
        name: "softvt.Scene",
        doc: "The scene that a layout or a shift builds.",
        fields: &[
            ("objects", "softvt.Object[]", "The placed objects, in order."),
            ("light", "softvt.Light", "The light on them."),
        ],
        methods: &[
            method("add", &[("place", "softvt.Place")], &[], "Puts an asset somewhere."),
            method("object", &[("name", "string")], &["softvt.Object"], "A placed object."),
            method(
                "camera",
                &[("name", "string")],
                &["softvt.Camera"],
                "A camera; every scene has third_person and wrist.",
            ),
            method("add_camera", &[("camera", "softvt.NewCamera")], &["softvt.Camera"], "One more camera."),
        ],
    },
    Class {
        name: "softvt.Light",
        doc: "The light of a scene: one key light and a sky. Its numbers may be read and written.",
        fields: &[],
        methods: &[],
    },
    Class {
        name: "softvt.Camera",
        doc: "A pinhole camera; its numbers may be read and written.",
        fields: &[("name", "string", "Its name."), ("mount", "\"world\"|\"hand\"", "What it is fixed to.")],
        methods: &[method(
            "look_at",
            &[("point", "number[]"), ("up?", "number[]")],
            &[],
            "Turns it to a point (m, frame of the mount); up, z if left out, is upwards in the picture.",
        )],
    },
    Class {
        name: "softvt.Look",
        doc: "A material of a placed object; its numbers may be read and written, the layers over it stay.",
        fields: &[],
        methods: &[],
    },
    Class {
        name: "softvt.Object",
        doc: "A placed object; its numbers may be read and written.",
        fields: &[
            ("name", "string", "Name in the scene."),
            ("asset", "string", "Name of its asset."),
            ("looks", "softvt.Look[]", "Its materials, in the order of the asset's visuals."),
        ],
        methods: &[],
    },
    Class {
        name: "softvt.View",
        doc: "The true scene at this control step, as an expert sees it.",
        fields: &[],
        methods: &[
            method("object", &[("name", "string")], &["softvt.Seen"], "An object."),
            method("objects", &[], &["softvt.Seen[]"], "All objects, in the order of the scene."),
            method(
                "clearance",
                &[("pose", "softvt.Pose"), ("options?", "{width: number?, ignore: string[]?}")],
                &["number", "string?"],
                "Metres (at most 0.2) between a hand at pose, its fingers width (m, 0.08) apart, and the nearest object that \
                 is not to be ignored, and the name of that; negative inside.",
            ),
        ],
    },
    Class {
        name: "softvt.Seen",
        doc: "An object as an expert sees it, at one moment.",
        fields: &[
            ("name", "string", "Name in the scene."),
            ("asset", "string", "Name of its asset."),
            ("xyz", "number[]", "Middle of its bounding box, world, m."),
            ("size", "number[]", "Edge lengths of its bounding box at rest, m."),
            ("yaw", "number", "Turn about the vertical, rad."),
            ("hints", "table<string, number>", "Numbers that its asset gives to experts."),
        ],
        methods: &[],
    },
    Class {
        name: "softvt.Arm",
        doc: "What an expert drives. Each motion lasts as many control steps as it needs.",
        fields: &[
            ("pose", "softvt.Pose", "Measured pose of the tool centre point."),
            ("target", "softvt.Pose", "Pose commanded last."),
            ("closure", "number", "Closure commanded last, 0 open to 1 shut."),
            ("width", "number", "Measured distance of the pads, m."),
            ("force", "number[]", "Normal force on the left and right pad, N."),
            ("time", "number", "Time since the start, s."),
            ("dt", "number", "Length of a control step, s."),
        ],
        methods: &[
            method(
                "command",
                &[("pose", "softvt.Pose"), ("closure", "number")],
                &[],
                "Sends one command and comes back at the next control step.",
            ),
            method(
                "move_to",
                &[("pose", "softvt.Pose"), ("options?", "{speed: number?, turn: number?, closure: number?}")],
                &[],
                "Moves straight and smoothly, at most at speed (m/s, 0.25) and turn (rad/s, 1.5).",
            ),
            method(
                "move_by",
                &[("offset", "number[]"), ("options?", "{speed: number?, turn: number?, closure: number?}")],
                &[],
                "Moves by an offset in the world frame, m.",
            ),
            method(
                "close_to",
                &[("closure", "number"), ("options?", "{rate: number?}")],
                &[],
                "Closes or opens at a rate (1/s, 0.5; 1 is the whole stroke in a second).",
            ),
            method("open", &[("options?", "{rate: number?}")], &[], "Opens the gripper."),
            method("wait", &[("seconds", "number")], &[], "Holds still."),
        ],
    },
];
