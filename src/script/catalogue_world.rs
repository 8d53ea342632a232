//! The binding table of worlds that experiments build by hand.

use super::{
    catalogue::{FRICTION, LAYOUT},
    schema::{Field, Presence, Range, Record, Type},
};

use Presence::{Empty, Optional, Required};

const fn field(name: &'static str, ty: Type, presence: Presence, doc: &'static str) -> Field {
    Field { name, ty, presence, doc }
}

/// A world.
pub static WORLD: Record = Record {
    label: "world",
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
pub static WORLD_SOFT: Record = Record {
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
pub static WORLD_SOLID: Record = Record {
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
pub static SIMULATE: Record = Record {
    label: "simulate",
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
            "Changes of the mechanics, the robot and the judge: { physics = {…}, robot = {…}, rules = {…} }.",
        ),
    ],
};

/// What an envelope is made of.
pub static ENVELOPE: Record = Record {
    label: "envelope",
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

/// All of them.
pub static RECORDS: &[&Record] = &[&WORLD, &WORLD_SOFT, &WORLD_SOLID, &SIMULATE, &ENVELOPE];
