//! The binding table of articulated objects: parts and the joints that carry them.

use crate::script::{
    api::catalogue_visuals::VISUAL,
    schema::{Field, Presence, Range, Record, Type},
};

use Presence::{Optional, Required};

const fn field(name: &'static str, ty: Type, presence: Presence, doc: &'static str) -> Field {
    Field { name, ty, presence, doc }
}

/// A joint that slides.
pub(crate) static SLIDER: Record = Record {
    label: "slider",
    class: "softvt.Slider",
    kind: "softvt.slider",
    doc: "A joint along which a part slides, as a drawer does.",
    fields: &[
        field("axis", Type::Vector(3, "object frame"), Required, "Direction in which its value grows."),
        field("lower", Type::Number("m", Range::ANY), Required, "Lowest value."),
        field("upper", Type::Number("m", Range::ANY), Required, "Highest value, above the lowest."),
        field(
            "damping",
            Type::Number("N s/m", Range::NOT_NEGATIVE),
            Presence::Number(0.0),
            "Viscous damping.",
        ),
        field("friction", Type::Number("N", Range::NOT_NEGATIVE), Presence::Number(0.0), "Dry friction."),
    ],
};

/// A joint that turns.
pub(crate) static HINGE: Record = Record {
    label: "hinge",
    class: "softvt.Hinge",
    kind: "softvt.hinge",
    doc: "A joint about which a part turns, as a door or a knob does.",
    fields: &[
        field(
            "axis",
            Type::Vector(3, "object frame"),
            Required,
            "Axis about which its value grows, by the right hand.",
        ),
        field(
            "origin",
            Type::Vector(3, "m, object frame"),
            Required,
            "A point of the axis, with all joints at 0.",
        ),
        field("lower", Type::Number("rad", Range::ANY), Required, "Lowest value."),
        field("upper", Type::Number("rad", Range::ANY), Required, "Highest value, above the lowest."),
        field(
            "damping",
            Type::Number("N m s/rad", Range::NOT_NEGATIVE),
            Presence::Number(0.0),
            "Viscous damping.",
        ),
        field("friction", Type::Number("N m", Range::NOT_NEGATIVE), Presence::Number(0.0), "Dry friction."),
    ],
};

/// A part on a joint.
pub(crate) static PART: Record = Record {
    label: "part",
    class: "softvt.Part",
    kind: "softvt.Part",
    doc: "A part of an articulated object. Parts of one object never touch each other or its base.",
    fields: &[
        field("name", Type::Name, Required, "Name, unique in the object: cabinet.top_drawer in a scene."),
        field(
            "shape",
            Type::Object("softvt.Shape"),
            Required,
            "Its shape where it is with all joints at 0, in the frame of the whole object; walls of 4 mm or more.",
        ),
        field("density", Type::Number("kg/m³", Range::POSITIVE), Required, "Density."),
        field(
            "joint",
            Type::Made(&[&SLIDER, &HINGE]),
            Required,
            "What carries it; axes and origins are in the frame of the whole object.",
        ),
        field("parent", Type::Name, Optional, "The part that carries it; the fixed base by default."),
        field(
            "visuals",
            Type::List(&Type::Nested(&VISUAL)),
            Optional,
            "Appearances by material id of its shape; the first is id 0. Those of the asset by default.",
        ),
        field(
            "hints",
            Type::Map(&Type::Number("", Range::ANY)),
            Optional,
            "Numbers for experts (handle height …).",
        ),
    ],
};

/// A thing of parts.
pub(crate) static ARTICULATED: Record = Record {
    label: "articulated",
    class: "softvt.Articulated",
    kind: "softvt.articulated",
    doc: "Parts on joints; the asset's own shape is their base, which never moves.",
    fields: &[field("parts", Type::List(&Type::Nested(&PART)), Required, "The parts, in any order.")],
};
