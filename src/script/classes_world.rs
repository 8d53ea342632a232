//! The binding table of worlds and simulations: their methods.

use super::catalogue_classes::{Class, method};

/// `softvt.World`.
pub const WORLD: Class = Class {
    name: "softvt.World",
    doc: "The mechanics alone: soft bodies among solids that stand still or move as prescribed.",
    fields: &[],
    methods: &[
        method("soft", &[("spec", "softvt.WorldSoft")], &["softvt.Body"], "Adds a soft body."),
        method(
            "kinematic",
            &[("spec", "softvt.WorldSolid")],
            &["softvt.Solid"],
            "Adds a solid that move_to moves.",
        ),
        method(
            "static",
            &[("spec", "softvt.WorldSolid")],
            &["softvt.Solid"],
            "Adds a solid that never moves.",
        ),
        method("step", &[], &["boolean", "string?"], "One time step; false and why once the state is void."),
        method("time", &[], &["number"], "Time, s."),
        method("newton", &[], &["number", "integer"], "Mean and largest number of Newton iterations a step."),
        method("energy", &[], &["number"], "Kinetic, elastic and potential energy, J."),
        method("phase", &[("name", "string")], &[], "From now on, CPU time goes to this phase."),
        method(
            "report_timing",
            &[],
            &[],
            "Prints CPU time per simulated time, by phase, to the standard error.",
        ),
    ],
};

/// `softvt.Body`.
pub const BODY: Class = Class {
    name: "softvt.Body",
    doc: "A soft body of a world.",
    fields: &[],
    methods: &[
        method("centre", &[], &["number[]"], "Centre of mass, m."),
        method("velocity", &[], &["number[]"], "Velocity of the centre of mass, m/s."),
        method("speed", &[], &["number"], "Speed of the fastest node, m/s."),
        method("mass", &[], &["number"], "Mass, kg."),
        method("min_det_f", &[], &["number"], "Least det F of a filled element; 0 or less is inverted."),
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
            &[("which", "\"rest\"|\"now\"")],
            &[],
            "Measures deformation from the rest shape (default) or from now.",
        ),
        method("force", &[("solid", "softvt.Solid")], &["number"], "Normal force of a solid on the body, N."),
        method(
            "shear",
            &[("solid", "softvt.Solid")],
            &["number"],
            "Tangential force of a solid on the body, N.",
        ),
        method(
            "travel",
            &[("solid", "softvt.Solid")],
            &["number"],
            "How far the patch has slid on the solid, mm.",
        ),
        method(
            "slipping",
            &[("solid", "softvt.Solid")],
            &["number"],
            "Share of the patch's samples that slip, 0..1.",
        ),
    ],
};

/// `softvt.Solid`.
pub const SOLID: Class = Class {
    name: "softvt.Solid",
    doc: "A solid of a world.",
    fields: &[],
    methods: &[method(
        "move_to",
        &[("xyz", "number[]"), ("turn?", "number[]")],
        &[],
        "Where it will be after the next step: position, m, and axis-angle, rad.",
    )],
};

/// `softvt.Simulation`.
pub const SIMULATION: Class = Class {
    name: "softvt.Simulation",
    doc: "A settled scene with the robot.",
    fields: &[],
    methods: &[
        method(
            "drive",
            &[("expert", "fun(arm: softvt.Arm, scene: softvt.View)")],
            &["boolean", "string?"],
            "Runs an expert to its end; false and why once the physics has failed.",
        ),
        method(
            "wait",
            &[("seconds", "number")],
            &["boolean", "string?"],
            "Holds the last command for a time.",
        ),
        method(
            "watch",
            &[("object", "string")],
            &["table"],
            "width_m, height_m (rise of the centre), speed, asset; of a part joint, of what has parts joints by name; of a \
             movable object also pad_force (N) and slip_mm of \
             the left and right pad, and of a soft one d_pct, d_peak_pct, min_det_f, asleep.",
        ),
        method(
            "see",
            &[("see?", "softvt.See")],
            &["softvt.Image"],
            "What a camera sees now; third_person if nothing else is said.",
        ),
        method(
            "feel",
            &[("side", "\"left\"|\"right\"")],
            &["softvt.Felt"],
            "What a finger's tactile sensor sees now, and the true force on its gel.",
        ),
        method("time", &[], &["number"], "Time since settling, s."),
        method("tool", &[], &["number[]", "number[]"], "Tool position, m, and axis-angle, rad, world."),
    ],
};

/// `softvt.Felt`.
pub const FELT: Class = Class {
    name: "softvt.Felt",
    doc: "A finger's tactile sensor at one moment; docs/tactile.md draws its frames.",
    fields: &[
        ("picture", "softvt.Image", "The colour picture, 320 × 240."),
        ("dots", "softvt.Image", "The same with its markers as dots."),
        ("arrows", "softvt.Image", "The same with the motion of its markers as arrows, lengthened."),
        ("initial", "number[][]", "Places of the 99 markers without a touch, px, row by row."),
        ("present", "number[][]", "Their places now, px."),
        ("force", "number[]", "True force on the gel, N, pad frame; a pressing body makes z negative."),
        ("depth_mm", "number", "Greatest depth of the dent, mm."),
    ],
    methods: &[],
};

/// `softvt.Image`.
pub const IMAGE: Class = Class {
    name: "softvt.Image",
    doc: "A picture of 8-bit sRGB pixels. Regions are x, y, width, height in pixels from the top left.",
    fields: &[("width", "integer", "Width, pixels."), ("height", "integer", "Height, pixels.")],
    methods: &[
        method("mean", &[("region?", "number[]")], &["number[]"], "Mean red, green and blue, 0..255."),
        method("crop", &[("region", "number[]")], &["softvt.Image"], "A part as a picture of its own."),
        method(
            "resize",
            &[("width", "integer"), ("height", "integer")],
            &["softvt.Image"],
            "The same in another size.",
        ),
        method(
            "paste",
            &[("other", "softvt.Image"), ("x", "integer"), ("y", "integer")],
            &[],
            "Puts another picture on this one.",
        ),
        method("text", &[("text", "string"), ("how", "softvt.Text")], &[], "Writes a line of text on it."),
    ],
};
