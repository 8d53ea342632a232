//! The binding table of shapes: constructors `softvt.shape.…{…}` and methods of a shape, all lengths in metres.

use crate::script::schema::{Field, Presence, Range, Record, Type};

use Presence::{Optional, Required};

const LENGTH: Type = Type::Number("m", Range::POSITIVE);
const AXES: &[&str] = &["x", "y", "z"];

const fn field(name: &'static str, ty: Type, presence: Presence, doc: &'static str) -> Field {
    Field { name, ty, presence, doc }
}

macro_rules! record {
    ($name:ident, $label:literal, $class:literal, $doc:literal, $fields:expr) => {
        #[doc = $doc]
        pub(crate) static $name: Record =
            Record { label: $label, class: $class, kind: $class, doc: $doc, fields: $fields };
    };
}

record!(
    BOX,
    "shape.box",
    "softvt.BoxSpec",
    "A box centred on the origin.",
    &[field("size", Type::Vector(3, "m"), Required, "Edge lengths."),]
);
record!(
    SPHERE,
    "shape.sphere",
    "softvt.SphereSpec",
    "A sphere centred on the origin.",
    &[field("radius", LENGTH, Required, "Radius."),]
);
record!(
    ELLIPSOID,
    "shape.ellipsoid",
    "softvt.EllipsoidSpec",
    "An ellipsoid centred on the origin.",
    &[field("size", Type::Vector(3, "m"), Required, "Lengths of the axes (diameters)."),]
);
record!(
    CAPSULE,
    "shape.capsule",
    "softvt.CapsuleSpec",
    "A capsule about the z axis, centred on the origin.",
    &[
        field("radius", LENGTH, Required, "Radius."),
        field("length", LENGTH, Required, "Total length, caps included; at least twice the radius."),
    ]
);
record!(
    CYLINDER,
    "shape.cylinder",
    "softvt.CylinderSpec",
    "A cylinder about the z axis, centred on the origin.",
    &[field("radius", LENGTH, Required, "Radius."), field("height", LENGTH, Required, "Height."),]
);
record!(
    TORUS,
    "shape.torus",
    "softvt.TorusSpec",
    "A torus about the z axis, centred on the origin.",
    &[
        field("major", LENGTH, Required, "Radius of the middle of the tube."),
        field("minor", LENGTH, Required, "Radius of the tube, less than major."),
    ]
);
record!(
    WEDGE,
    "shape.wedge",
    "softvt.WedgeSpec",
    "A triangular prism along y in a box centred on the origin.",
    &[
        field("size", Type::Vector(3, "m"), Required, "Edge lengths of the box."),
        field(
            "apex",
            Type::Number("", Range::closed(-1.0, 1.0)),
            Presence::Number(0.0),
            "Where the top edge lies across the width: -1 and 1 are the sides, 0 the middle.",
        ),
    ]
);
record!(
    PRISM,
    "shape.prism",
    "softvt.PrismSpec",
    "A polygon in (x, z), drawn out along y, centred on y = 0.",
    &[
        field("corners", Type::List(&Type::Vector(2, "m")), Required, "Corners (x, z) in order."),
        field("length", LENGTH, Required, "Length along y."),
    ]
);
record!(
    LATHE,
    "shape.lathe",
    "softvt.LatheSpec",
    "A profile revolved about the z axis.",
    &[field(
        "corners",
        Type::List(&Type::Vector(2, "m")),
        Required,
        "Corners (r, z) in order, r of 0 or more."
    ),]
);
record!(
    ROTATE,
    "shape:rotate",
    "softvt.RotateSpec",
    "A turn about an axis through the origin.",
    &[
        field("axis", Type::Choice(AXES), Required, "The axis."),
        field("angle", Type::Number("rad", Range::ANY), Required, "Angle, right-handed."),
    ]
);
record!(
    TWIST,
    "shape:twist",
    "softvt.TwistSpec",
    "A twist about an axis through the origin.",
    &[
        field("axis", Type::Choice(AXES), Required, "The axis."),
        field("rate", Type::Number("rad/m", Range::ANY), Required, "Turn along the axis."),
    ]
);
record!(
    BEND,
    "shape:bend",
    "softvt.BendSpec",
    "A bend into an arc; the origin stays.",
    &[
        field("along", Type::Choice(AXES), Required, "The axis that becomes an arc."),
        field("towards", Type::Choice(AXES), Required, "The axis on which the centre of the arc lies."),
        field("curvature", Type::Number("1/m", Range::ANY), Required, "Curvature of the arc."),
    ]
);
record!(
    MASK,
    "mask",
    "softvt.MaskSpec",
    "A weight that rises smoothly from 0 to 1 along an axis.",
    &[
        field("axis", Type::Choice(AXES), Required, "The axis."),
        field("from", Type::Number("m", Range::ANY), Required, "Where it is 0."),
        field("to", Type::Number("m", Range::ANY), Required, "Where it is 1."),
    ]
);
record!(
    RIDGES,
    "shape:ridges",
    "softvt.RidgesSpec",
    "Regular ridges: rings, flutes, screws or spirals.",
    &[
        field("axis", Type::Choice(AXES), Presence::Text("z"), "The axis they go around or along."),
        field(
            "height",
            Type::Number("m", Range::ANY),
            Required,
            "From valley to crest; negative for grooves."
        ),
        field(
            "count",
            Type::Integer(Range::closed(-1000.0, 1000.0)),
            Presence::Integer(0),
            "Ridges around the axis."
        ),
        field("pitch", LENGTH, Optional, "Distance of ridges along the axis."),
        field("radial_pitch", LENGTH, Optional, "Distance of ridges away from the axis."),
        field("phase", Type::Number("rad", Range::ANY), Presence::Number(0.0), "Phase."),
        field(
            "sharpness",
            Type::Number("", Range::closed(1.0, 8.0)),
            Presence::Number(1.0),
            "1 is a sine; larger is narrower."
        ),
        field("mask", Type::Nested(&MASK), Optional, "Where they are."),
    ]
);
record!(
    BUMPS,
    "shape:bumps",
    "softvt.BumpsSpec",
    "Scattered bumps (seeds, raisins).",
    &[
        field("height", Type::Number("m", Range::ANY), Required, "Height; negative for pits."),
        field("radius", LENGTH, Required, "Radius of a bump, at most half the spacing."),
        field("spacing", LENGTH, Required, "Mean distance of bumps."),
        field("seed", Type::Integer(Range::NOT_NEGATIVE), Presence::Integer(0), "Selects where they are."),
        field("mask", Type::Nested(&MASK), Optional, "Where they are."),
    ]
);
record!(
    PAINT,
    "shape:paint",
    "softvt.PaintSpec",
    "Another material on all or part of the surface.",
    &[
        field(
            "material",
            Type::Integer(Range::closed(0.0, 65535.0)),
            Required,
            "Material id: index into visuals, from 0."
        ),
        field("region", Type::Object("softvt.Shape"), Optional, "Where; everywhere if left out."),
    ]
);

record!(
    MESH,
    "mesh",
    "softvt.MeshSpec",
    "A closed surface from an OBJ, STL or GLB file.",
    &[
        field("file", Type::Text, Required, "Path inside of the project."),
        field("scale", LENGTH, Presence::Number(1.0), "Metres in a unit of the file: 0.001 for millimetres."),
        field("z_up", Type::Boolean, Presence::Boolean(true), "Whether z is up in the file; otherwise y is."),
    ]
);

/// Constructors `softvt.shape.name{…}`.
pub(crate) static SHAPES: &[(&str, &Record)] = &[
    ("box", &BOX),
    ("sphere", &SPHERE),
    ("ellipsoid", &ELLIPSOID),
    ("capsule", &CAPSULE),
    ("cylinder", &CYLINDER),
    ("torus", &TORUS),
    ("wedge", &WEDGE),
    ("prism", &PRISM),
    ("lathe", &LATHE),
];

/// Methods of a shape that take one table.
pub(crate) static METHODS: &[(&str, &Record)] = &[
    ("rotate", &ROTATE),
    ("twist", &TWIST),
    ("bend", &BEND),
    ("ridges", &RIDGES),
    ("bumps", &BUMPS),
    ("paint", &PAINT),
];
