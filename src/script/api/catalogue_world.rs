//! The binding table of worlds that experiments build by hand.

use crate::script::{
    api::catalogue::{FRICTION, LAYOUT},
    schema::{Field, Presence, Range, Record, Type},
};

use Presence::{Empty, Optional, Required};

const fn field(name: &'static str, ty: Type, presence: Presence, doc: &'static str) -> Field {
    Field { name, ty, presence, doc }
}

/// A world.
pub(crate) static WORLD: Record = Record {
    label: "softvt.world",
    class: "softvt.WorldSpec",
    kind: "softvt.WorldSpec",
    doc: "A world of soft bodies and prescribed or fixed solids, without a robot.",
    fields: &[
        field("dt", Type::Number("s", Range::closed(1e-5, 0.05)), Presence::Number(1.0 / 60.0), "Time step."),
        field(
            "alpha",
            Type::Number("1/s", Range::closed(0.0, 1e3)),
            Presence::Number(0.0),
            "Mass-proportional damping.",
        ),
        field(
            "beta_s",
            Type::Number("s", Range::closed(0.0, 1.0)),
            Presence::Number(5e-3),
            "Stiffness-proportional damping.",
        ),
        field("gravity", Type::Vector(3, "m/s²"), Optional, "Gravity; {0, 0, -9.81} by default."),
        field("sleeping", Type::Boolean, Presence::Boolean(true), "Whether bodies at rest fall asleep."),
    ],
};

/// A soft body of a world.
pub(crate) static WORLD_SOFT: Record = Record {
    label: "world:soft",
    class: "softvt.WorldSoft",
    kind: "softvt.WorldSoft",
    doc: "A finite-element soft body in a world.",
    fields: &[
        field("name", Type::Text, Presence::Text("body"), "Name, for messages."),
        field("shape", Type::Object("softvt.Shape"), Required, "Its shape."),
        field("youngs_pa", Type::Number("Pa", Range::POSITIVE), Required, "Young's modulus."),
        field("poisson", Type::Number("", Range::below(0.0, 0.5)), Required, "Poisson's ratio."),
        field("density", Type::Number("kg/m³", Range::POSITIVE), Required, "Density."),
        field(
            "resolution",
            Type::Integer(Range::closed(1.0, 64.0)),
            Presence::Integer(6),
            "Voxels along the longest edge.",
        ),
        field(
            "grasp_spacing",
            Type::Number("m", Range::closed(1e-4, 0.02)),
            Presence::Number(7.5e-4),
            "Spacing of contact samples on steep surfaces.",
        ),
        field("friction", Type::Nested(&FRICTION), Empty, "Friction of its surface."),
        field("xyz", Type::Vector(3, "m"), Required, "Where its frame is."),
        field("turn", Type::Vector(3, "rad"), Optional, "Its orientation as axis-angle."),
    ],
};

/// A prescribed or fixed solid of a world.
pub(crate) static WORLD_SOLID: Record = Record {
    label: "world:solid",
    class: "softvt.WorldSolid",
    kind: "softvt.WorldSolid",
    doc: "A solid whose motion is prescribed (kinematic) or that never moves (static).",
    fields: &[
        field("name", Type::Text, Presence::Text("solid"), "Name, for messages."),
        field("shape", Type::Object("softvt.Shape"), Required, "Its shape."),
        field("friction", Type::Nested(&FRICTION), Empty, "Friction of its surface."),
        field("xyz", Type::Vector(3, "m"), Required, "Where its frame is."),
        field("turn", Type::Vector(3, "rad"), Optional, "Its orientation as axis-angle."),
    ],
};

/// A settled scene with the robot.
pub(crate) static SIMULATE: Record = Record {
    label: "softvt.simulate",
    class: "softvt.SimulateSpec",
    kind: "softvt.SimulateSpec",
    doc: "A scene with the robot, built and settled. The settled shapes are the reference of deformation.",
    fields: &[
        field("layout", Type::Made(&[&LAYOUT]), Required, "Where things stand."),
        field("suite", Type::Text, Presence::Text("experiment"), "Part of the seed."),
        field("episode", Type::Integer(Range::closed(0.0, 1e9)), Presence::Integer(0), "Part of the seed."),
        field("seed", Type::Integer(Range::closed(0.0, 1e9)), Presence::Integer(0), "Part of the seed."),
        field(
            "settings",
            Type::Map(&Type::Map(&Type::Any)),
            Optional,
            "Changes of the mechanics, the robot and the judge: { physics = {…}, robot = {…}, criteria = {…} }.",
        ),
    ],
};

/// What an envelope is made of.
pub(crate) static ENVELOPE: Record = Record {
    label: "softvt.envelope",
    class: "softvt.EnvelopeSpec",
    kind: "softvt.EnvelopeSpec",
    doc: "The rows of a calibration.",
    fields: &[
        field("asset", Type::Name, Required, "Asset name."),
        field("kappa", Type::Number("", Range::closed(0.0, 1.0)), Presence::Number(0.5), "τ = κ D_ref."),
        field(
            "fingerprint",
            Type::Text,
            Optional,
            "What was calibrated, as simulation:watch tells it; another object of that name is then not taken for it.",
        ),
        field(
            "holds",
            Type::List(&Type::Map(&Type::Any)),
            Required,
            "Rows closure, trials, held, slip_mm, d_peak_pct of the lower-bound scan.",
        ),
        field(
            "sweep",
            Type::List(&Type::Map(&Type::Any)),
            Required,
            "Rows closure, gripper_width_mm, d_peak_pct, force_n, min_det_f, node_speed_m_s, both_pads, slip_mm, stable \
             of the compression sweep.",
        ),
    ],
};

/// What `softvt.image` takes.
pub(crate) static NEW_IMAGE: Record = Record {
    label: "softvt.image",
    class: "softvt.NewImage",
    kind: "softvt.NewImage",
    doc: "An empty picture.",
    fields: &[
        field("width", Type::Integer(Range::closed(1.0, 8192.0)), Required, "Width, pixels."),
        field("height", Type::Integer(Range::closed(1.0, 8192.0)), Required, "Height, pixels."),
        field("colour", Type::Vector(3, "sRGB of 0 to 255"), Required, "Colour all over."),
    ],
};

/// What `image:text` takes.
pub(crate) static TEXT: Record = Record {
    label: "image:text",
    class: "softvt.Text",
    kind: "softvt.Text",
    doc: "Where and how a line of text is written.",
    fields: &[
        field("at", Type::Vector(2, "pixels"), Required, "Left end of its baseline, from the top left."),
        field("size", Type::Number("pixels", Range::closed(4.0, 200.0)), Presence::Number(18.0), "Height."),
        field("colour", Type::Vector(3, "sRGB of 0 to 255"), Required, "Colour."),
    ],
};

/// What `simulation:see` takes.
pub(crate) static SEE: Record = Record {
    label: "simulation:see",
    class: "softvt.See",
    kind: "softvt.See",
    doc: "What is drawn.",
    fields: &[
        field("camera", Type::Name, Presence::Text("third_person"), "A camera of the scene."),
        field(
            "width",
            Type::Integer(Range::closed(1.0, 4096.0)),
            Optional,
            "Width, pixels; the camera's own.",
        ),
        field(
            "height",
            Type::Integer(Range::closed(1.0, 4096.0)),
            Optional,
            "Height, pixels; the camera's own.",
        ),
    ],
};

/// What `scene:add_camera` takes.
pub(crate) static NEW_CAMERA: Record = Record {
    label: "scene:add_camera",
    class: "softvt.NewCamera",
    kind: "softvt.NewCamera",
    doc: "A camera. Give look_at or quat.",
    fields: &[
        field("name", Type::Name, Required, "Its name, unique; the stream's."),
        field(
            "mount",
            Type::Choice(&["world", "hand"]),
            Presence::Text("world"),
            "What it is fixed to; hand is panda_hand.",
        ),
        field("position", Type::Vector(3, "m, frame of the mount"), Required, "Where it is."),
        field(
            "look_at",
            Type::Vector(3, "m, frame of the mount"),
            Optional,
            "A point in the middle of the picture.",
        ),
        field(
            "up",
            Type::Vector(3, "frame of the mount"),
            Optional,
            "Upwards in the picture (with look_at); z if left out.",
        ),
        field(
            "quat",
            Type::Vector(4, "w, x, y, z, frame of the mount"),
            Optional,
            "How it is turned: it looks along its −z, +y is up.",
        ),
        field(
            "fovy",
            Type::Number("rad", Range::closed(0.01, 2.8)),
            Presence::Number(0.8),
            "Vertical field of view.",
        ),
        field(
            "near",
            Type::Number("m", Range::closed(1e-4, 100.0)),
            Presence::Number(0.01),
            "Nothing nearer is seen.",
        ),
        field(
            "far",
            Type::Number("m", Range::closed(1e-3, 1e4)),
            Presence::Number(20.0),
            "Nothing farther is seen.",
        ),
        field(
            "width",
            Type::Integer(Range::closed(1.0, 4096.0)),
            Presence::Integer(224),
            "Width of the picture, pixels.",
        ),
        field(
            "height",
            Type::Integer(Range::closed(1.0, 4096.0)),
            Presence::Integer(224),
            "Height of the picture, pixels.",
        ),
    ],
};

/// All of them.
pub(crate) static RECORDS: &[&Record] =
    &[&NEW_CAMERA, &NEW_IMAGE, &TEXT, &SEE, &WORLD, &WORLD_SOFT, &WORLD_SOLID, &SIMULATE, &ENVELOPE];
