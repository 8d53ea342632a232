//! The binding table of looks: visuals, the layers painted over them, and the masks that say where; lengths in metres,
//! points and directions in the object frame at rest.

use crate::script::{
    api::catalogue_classes::{Class, method},
    schema::{Field, Presence, Range, Record, Type},
};

use Presence::{Optional, Required};

const LENGTH: Type = Type::Number("m", Range::POSITIVE);
const SHARE: Type = Type::Number("", Range::closed(0.0, 1.0));
const SEED: Type = Type::Integer(Range::closed(0.0, 4_294_967_295.0));
const DIRECTION: Type = Type::OneOf(&[Type::Choice(&["x", "y", "z"]), Type::Vector(3, "any length")]);
const SEED_DOC: &str = "Selects the pattern.";

const fn field(name: &'static str, ty: Type, presence: Presence, doc: &'static str) -> Field {
    Field { name, ty, presence, doc }
}

/// What a surface looks like.
pub(crate) static VISUAL: Record = Record {
    label: "visual",
    class: "softvt.Visual",
    kind: "softvt.Visual",
    doc: "What a surface looks like: a base, and layers painted over it one after the other.",
    fields: &[
        field("albedo", Type::Colour, Required, "Base colour."),
        field("roughness", SHARE, Presence::Number(0.6), "Roughness: 0 is a mirror, 1 is chalk."),
        field("metalness", SHARE, Presence::Number(0.0), "Metalness: 1 is bare metal."),
        field("layers", Type::List(&Type::Nested(&LAYER)), Optional, "Painted over the base, in this order."),
    ],
};

/// A layer of a visual.
pub(crate) static LAYER: Record = Record {
    label: "layer",
    class: "softvt.Layer",
    kind: "softvt.Layer",
    doc: "A colour laid over what is below where a mask says so.",
    fields: &[
        field("mask", Type::Object("softvt.Mask"), Optional, "Where; everywhere if left out."),
        field("albedo", Type::Colour, Required, "Colour."),
        field("roughness", SHARE, Presence::Number(0.6), "Roughness."),
        field(
            "opacity",
            SHARE,
            Presence::Number(1.0),
            "Share of this layer where the mask is 1; 0 leaves the relief alone.",
        ),
        field(
            "relief_m",
            Type::Number("m", Range::closed(-0.005, 0.005)),
            Presence::Number(0.0),
            "Height of the drawn surface where the mask is 1; it is drawn only, nothing touches it.",
        ),
    ],
};

macro_rules! mask {
    ($name:ident, $label:literal, $class:literal, $doc:literal, $fields:expr) => {
        #[doc = $doc]
        pub(crate) static $name: Record =
            Record { label: $label, class: $class, kind: $class, doc: $doc, fields: $fields };
    };
}

mask!(
    CHECKER,
    "mask.checker",
    "softvt.CheckerMask",
    "Cubes, every other one 1; a corner lies at the origin.",
    &[field("size_m", LENGTH, Required, "Edge of a cube.")]
);
mask!(
    STRIPES,
    "mask.stripes",
    "softvt.StripesMask",
    "Slabs across an axis.",
    &[
        field("axis", DIRECTION, Required, "Direction in which they follow each other."),
        field("pitch_m", LENGTH, Required, "Distance from one to the next."),
        field("share", SHARE, Presence::Number(0.5), "Share of it that is 1."),
    ]
);
mask!(
    GRADIENT,
    "mask.gradient",
    "softvt.GradientMask",
    "Rises smoothly from 0 to 1 along an axis.",
    &[
        field("axis", DIRECTION, Presence::Text("z"), "Direction."),
        field("from_m", Type::Number("m", Range::ANY), Required, "Where it is 0."),
        field("to_m", Type::Number("m", Range::ANY), Required, "Where it is 1; may lie below from_m."),
    ]
);
mask!(
    NOISE,
    "mask.noise",
    "softvt.NoiseMask",
    "Cloudy noise; its values lie about 0.5, few below 0.2 or above 0.8.",
    &[
        field(
            "size_m",
            Type::OneOf(&[LENGTH, Type::Vector(3, "m, each above 0")]),
            Required,
            "Size of the coarsest features, one for all or one for each of x, y and z."
        ),
        field(
            "octaves",
            Type::Integer(Range::closed(1.0, 8.0)),
            Presence::Integer(3),
            "Octaves, each half the size and half the weight of the one before."
        ),
        field(
            "from",
            Type::Number("", Range::closed(-1.0, 2.0)),
            Presence::Number(0.35),
            "Value of the noise that becomes 0."
        ),
        field(
            "to",
            Type::Number("", Range::closed(-1.0, 2.0)),
            Presence::Number(0.65),
            "Value that becomes 1; may lie below from."
        ),
        field("seed", SEED, Presence::Integer(0), SEED_DOC),
    ]
);
mask!(
    RINGS,
    "mask.rings",
    "softvt.RingsMask",
    "Year rings of a trunk: cylinders about a line along z, bent by noise.",
    &[
        field("centre_m", Type::Vector(3, "m"), Required, "A point of the line."),
        field("pitch_m", LENGTH, Required, "Distance from one ring to the next."),
        field("wobble_m", LENGTH, Presence::Number(0.01), "How far noise bends them."),
        field("seed", SEED, Presence::Integer(0), SEED_DOC),
    ]
);
mask!(
    BOARDS,
    "mask.boards",
    "softvt.BoardsMask",
    "Boards that lie along x, side by side in y: one value a board.",
    &[
        field("length_m", LENGTH, Required, "Length of a board."),
        field("width_m", LENGTH, Required, "Width of a board."),
        field("seed", SEED, Presence::Integer(0), SEED_DOC),
    ]
);
mask!(
    SEAMS,
    "mask.seams",
    "softvt.SeamsMask",
    "The gaps between boards of these sizes.",
    &[
        field("length_m", LENGTH, Required, "Length of a board."),
        field("width_m", LENGTH, Required, "Width of a board."),
        field("gap_m", LENGTH, Required, "Width of a gap."),
    ]
);
mask!(
    SPECKS,
    "mask.specks",
    "softvt.SpecksMask",
    "Round specks, strewn about.",
    &[
        field("spacing_m", LENGTH, Required, "Mean distance."),
        field("radius_m", LENGTH, Required, "Radius, at most half the spacing."),
        field("seed", SEED, Presence::Integer(0), SEED_DOC),
    ]
);
mask!(
    WEAVE,
    "mask.weave",
    "softvt.WeaveMask",
    "A plain weave in x and y: high in the middle of a thread.",
    &[field("pitch_m", LENGTH, Required, "Width of a thread.")]
);
mask!(
    FACING,
    "mask.facing",
    "softvt.FacingMask",
    "Where the surface faces a direction, by the cosine between its normal and that.",
    &[
        field("axis", DIRECTION, Presence::Text("z"), "Direction."),
        field(
            "from",
            Type::Number("", Range::closed(-1.0, 1.0)),
            Presence::Number(0.0),
            "Cosine at which it is 0."
        ),
        field(
            "to",
            Type::Number("", Range::closed(-1.0, 1.0)),
            Presence::Number(1.0),
            "Cosine at which it is 1; may lie below from."
        ),
    ]
);
mask!(
    INSIDE,
    "mask.inside",
    "softvt.InsideMask",
    "Where a shape is: a painted rim, the grooves between ridges.",
    &[
        field("shape", Type::Object("softvt.Shape"), Required, "The shape."),
        field(
            "soft_m",
            Type::Number("m", Range::NOT_NEGATIVE),
            Presence::Number(0.0),
            "Width of the border, half of it on either side of the shape's surface."
        ),
    ]
);

mask!(
    TEXT,
    "mask.text",
    "softvt.TextMask",
    "The letters of a line of text, printed on what faces who reads it. Surfaces with text are drawn with finer detail than others.",
    &[
        field("text", Type::Text, Required, "What it says: at most 64 letters."),
        field(
            "height_m",
            Type::Number("m", Range::closed(0.0005, 1.0)),
            Required,
            "Height of a capital letter."
        ),
        field(
            "at",
            Type::Vector(3, "m"),
            Required,
            "Where the middle of the line is; of a line that is wrapped, only its height counts."
        ),
        field(
            "facing",
            Type::OneOf(&[
                Type::Choice(&["+x", "-x", "+y", "-y", "+z", "-z"]),
                Type::Vector(3, "any length")
            ]),
            Required,
            "Where the printed surface looks. Lines on top have their head towards +y, others towards +z."
        ),
        field(
            "turn",
            Type::Number("rad", Range::ANY),
            Presence::Number(0.0),
            "Turn of the line on its surface, counter-clockwise to who reads it."
        ),
        field(
            "wrap_m",
            LENGTH,
            Optional,
            "Radius of the upright cylinder about the z axis that the line is laid round; flat if left out."
        ),
        field(
            "weight",
            Type::Number("", Range::closed(0.0, 0.25)),
            Presence::Number(0.08),
            "How much strokes are thickened, in heights of a capital letter."
        ),
        field("font", Type::Choice(&["sans", "mono"]), Presence::Text("sans"), "Typeface."),
    ]
);

/// Constructors `softvt.mask.name{…}`.
pub(crate) static MASKS: &[(&str, &Record)] = &[
    ("checker", &CHECKER),
    ("stripes", &STRIPES),
    ("gradient", &GRADIENT),
    ("noise", &NOISE),
    ("rings", &RINGS),
    ("boards", &BOARDS),
    ("seams", &SEAMS),
    ("specks", &SPECKS),
    ("weave", &WEAVE),
    ("facing", &FACING),
    ("inside", &INSIDE),
    ("text", &TEXT),
];

/// `softvt.Mask`.
pub(crate) static MASK_CLASS: Class = Class {
    name: "softvt.Mask",
    doc: "A number between 0 and 1 at every point of a surface: where a layer is. It never changes; methods give new masks.",
    fields: &[],
    written: &[],
    methods: &[
        method(
            "both",
            &[("other", Type::Object("softvt.Mask"))],
            &["softvt.Mask"],
            "Where this and the other are: their product.",
        ),
        method("inverted", &[], &["softvt.Mask"], "Where this is not."),
    ],
};
