//! The binding table of worlds and simulations: their methods.

use crate::script::{
    api::catalogue_classes::{Class, method},
    api::catalogue_world::{SEE, TEXT, WORLD_SOFT, WORLD_SOLID},
    schema::{Range, Type},
};

/// Largest edge of a picture that a script may make, pixels.
pub(crate) const MOST_EDGE: f64 = 8192.0;
const EDGE: Type = Type::Integer(Range::closed(1.0, MOST_EDGE));
const PIXEL: Type = Type::Integer(Range::closed(0.0, MOST_EDGE));
const REGION: Type = Type::Vector(4, "x, y, width, height in pixels");
/// Where a picture may be put on another, pixels.
const PLACE: Type = Type::Number("pixels", Range::closed(-1e5, 1e5));
const SOLID_VALUE: Type = Type::Object("softvt.Solid");

/// `softvt.World`.
pub(crate) static WORLD: Class = Class {
    name: "softvt.World",
    doc: "The mechanics alone: soft bodies among solids that stand still or move as prescribed.",
    fields: &[],
    written: &[],
    methods: &[
        method("soft", &[("spec", Type::Nested(&WORLD_SOFT))], &["softvt.Body"], "Adds a soft body."),
        method(
            "kinematic",
            &[("spec", Type::Nested(&WORLD_SOLID))],
            &["softvt.Solid"],
            "Adds a solid that move_to moves.",
        ),
        method(
            "static",
            &[("spec", Type::Nested(&WORLD_SOLID))],
            &["softvt.Solid"],
            "Adds a solid that never moves.",
        ),
        method("step", &[], &["boolean", "string?"], "One time step; false and why once the state is void."),
        method("time", &[], &["number"], "Time, s."),
        method("newton", &[], &["number", "integer"], "Mean and largest number of Newton iterations a step."),
        method("energy", &[], &["number"], "Kinetic, elastic and potential energy, J."),
        method("phase", &[("name", Type::Text)], &[], "From now on, CPU time goes to this phase."),
        method(
            "report_timing",
            &[],
            &[],
            "Prints CPU time per simulated time, by phase, to the standard error.",
        ),
    ],
};

/// `softvt.Body`.
pub(crate) static BODY: Class = Class {
    name: "softvt.Body",
    doc: "A soft body of a world.",
    fields: &[],
    written: &[],
    methods: &[
        method("centre", &[], &["number[]"], "Centre of mass, m."),
        method("velocity", &[], &["number[]"], "Velocity of the centre of mass, m/s."),
        method("speed", &[], &["number"], "Speed of the fastest node, m/s."),
        method("mass", &[], &["number"], "Mass, kg."),
        method(
            "min_det_f",
            &[],
            &["number?"],
            "Least det F of a filled element; 0 or less is inverted, nil where no element is filled.",
        ),
        method("asleep", &[], &["boolean"], "Whether it sleeps."),
        method(
            "deformation",
            &[],
            &["table"],
            "rms_pct, weighted_pct and max_pct against the reference shape.",
        ),
        method("extent", &[], &["number[]"], "Size of the bounding box of the nodes, m."),
        method(
            "set_reference",
            &[("which", Type::Choice(&["rest", "now"]))],
            &[],
            "Measures deformation from the rest shape (default) or from now.",
        ),
        method("force", &[("solid", SOLID_VALUE)], &["number"], "Normal force of a solid on the body, N."),
        method(
            "shear",
            &[("solid", SOLID_VALUE)],
            &["number"],
            "Tangential force of a solid on the body, N.",
        ),
        method(
            "travel",
            &[("solid", SOLID_VALUE)],
            &["number"],
            "How far the patch has slid on the solid, mm.",
        ),
        method(
            "slipping",
            &[("solid", SOLID_VALUE)],
            &["number"],
            "Share of the patch's samples that slip, 0..1.",
        ),
    ],
};

/// `softvt.Solid`.
pub(crate) static SOLID: Class = Class {
    name: "softvt.Solid",
    doc: "A solid of a world.",
    fields: &[],
    written: &[],
    methods: &[method(
        "move_to",
        &[("xyz", Type::Vector(3, "m")), ("turn?", Type::Vector(3, "rad"))],
        &[],
        "Where it will be after the next step: position, m, and axis-angle, rad.",
    )],
};

/// `softvt.Simulation`.
pub(crate) static SIMULATION: Class = Class {
    name: "softvt.Simulation",
    doc: "A settled scene with the robot.",
    fields: &[],
    written: &[],
    methods: &[
        method(
            "drive",
            &[("expert", Type::Function("fun(arm: softvt.Arm, scene: softvt.View)"))],
            &["boolean", "string?"],
            "Runs an expert to its end; false and why once it has given up or the physics has failed.",
        ),
        method(
            "wait",
            &[("seconds", Type::Number("s", Range::closed(0.0, 600.0)))],
            &["boolean", "string?"],
            "Holds the last command for a time.",
        ),
        method(
            "watch",
            &[("object", Type::Text)],
            &["table"],
            "width_m, height_m (rise of the centre), speed, asset; of a part joint, of what has parts joints by name; of a \
             movable object also pad_force (N) and slip_mm of \
             the left and right pad, and of a soft one d_pct, d_peak_pct, min_det_f, asleep.",
        ),
        method(
            "see",
            &[("see?", Type::Nested(&SEE))],
            &["softvt.Image"],
            "What a camera sees now; third_person if nothing else is said.",
        ),
        method(
            "feel",
            &[("side", Type::Choice(&["left", "right"]))],
            &["softvt.Felt"],
            "What a finger's tactile sensor sees now, and the true force on its gel.",
        ),
        method("time", &[], &["number"], "Time since settling, s."),
        method("tool", &[], &["number[]", "number[]"], "Tool position, m, and axis-angle, rad, world."),
    ],
};

/// `softvt.Felt`.
pub(crate) static FELT: Class = Class {
    name: "softvt.Felt",
    doc: "A finger's tactile sensor at one moment; docs/tactile.md draws its frames.",
    fields: &[
        ("picture", "softvt.Image", "The colour picture, 320 × 240."),
        ("dots", "softvt.Image", "The same with its markers as dots."),
        ("arrows", "softvt.Image", "The same with the motion of its markers as arrows, lengthened."),
        ("initial", "number[][]", "Places of the 99 markers without a touch, px, row by row."),
        ("present", "number[][]", "Their places now, px."),
        ("markers", "softvt.Markers", "The markers, with what their motion says."),
        ("force", "number[]", "True force on the gel, N, pad frame; a pressing body makes z negative."),
        ("depth_mm", "number", "Greatest depth of the dent, mm."),
    ],
    written: &[],
    methods: &[],
};

/// `softvt.Image`.
pub(crate) static IMAGE: Class = Class {
    name: "softvt.Image",
    doc: "A picture of 8-bit sRGB pixels. Regions are x, y, width, height in pixels from the top left.",
    fields: &[("width", "integer", "Width, pixels."), ("height", "integer", "Height, pixels.")],
    written: &[],
    methods: &[
        method("mean", &[("region?", REGION)], &["number[]"], "Mean red, green and blue, 0..255."),
        method(
            "pixel",
            &[("x", PIXEL), ("y", PIXEL)],
            &["number[]"],
            "Red, green and blue of a pixel, 0..255; the first is 0, 0.",
        ),
        method("crop", &[("region", REGION)], &["softvt.Image"], "A part as a picture of its own."),
        method(
            "resize",
            &[("width", EDGE), ("height", EDGE)],
            &["softvt.Image"],
            "The same in another size.",
        ),
        method(
            "paste",
            &[("other", Type::Object("softvt.Image")), ("x", PLACE), ("y", PLACE)],
            &[],
            "Puts another picture on this one.",
        ),
        method(
            "text",
            &[("text", Type::Line), ("how", Type::Nested(&TEXT))],
            &[],
            "Writes a line of text on it.",
        ),
    ],
};
