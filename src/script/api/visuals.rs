//! Appearances: visuals, the layers over them, and masks, which are immutable values with chained methods. Lengths are in
//! metres; points and directions in the object frame at rest.

use std::sync::{Arc, Mutex};

use mlua::{FromLua, Lua, Value};

use super::{pose::direction, shapes::LuaShape};
use crate::{
    geometry::shape::Shape,
    parallel::lock,
    scene::{LabelLine, MAX_LETTERS, Mask, Scene, TextDecal, Typeface, Visual, VisualLayer},
    script::{
        schema::{LuaType, Range, RecordType, Type, choice, class, functions, invalid, record},
        vm::{
            error::fail,
            memory_budget::{Reservation, reserve},
            value::describe,
        },
    },
};

const LENGTH: Type = Type::Number("m", Range::POSITIVE);
const SHARE: Type = Type::Number("", Range::closed(0.0, 1.0));
const COSINE: Type = Type::Number("", Range::closed(-1.0, 1.0));
const NOISE_VALUE: Type = Type::Number("", Range::closed(-1.0, 2.0));

/// Masks that one mask may be made of: each is evaluated at every point that is drawn.
const MAX_PARTS: usize = 200;

record! {
    /// The appearance of a surface: a base material, and layers painted over it in order.
    VisualSpec: "softvt.Visual" as "visual" {
        /// Base colour.
        albedo: [f64; 3] = Type::Colour;
        /// Roughness: 0 is a mirror, 1 is chalk.
        roughness: f64 = SHARE => Number(0.6);
        /// Metalness: 1 is bare metal.
        metalness: f64 = SHARE => Number(0.0);
        /// Layers painted over the base, in this order.
        layers: Option<Vec<LayerSpec>>;
    }
    /// A colour laid over the layers below where a mask is not 0.
    LayerSpec: "softvt.Layer" as "layer" {
        /// Weight of the layer; 1 everywhere by default.
        mask: Option<LuaMask>;
        /// Colour.
        albedo: [f64; 3] = Type::Colour;
        /// Roughness: 0 is a mirror, 1 is chalk.
        roughness: f64 = SHARE => Number(0.6);
        /// Share of this layer where the mask is 1; with 0 only the relief shows.
        opacity: f64 = SHARE => Number(1.0);
        /// Height of the drawn surface where the mask is 1. It is drawn only: contact does not see it.
        relief_m: f64 = Type::Number("m", Range::closed(-0.005, 0.005)) => Number(0.0);
    }
    /// Cubes, every other one 1; one corner is at the origin.
    CheckerSpec: "softvt.CheckerMask" as "mask.checker" {
        /// Edge of a cube.
        size_m: f64 = LENGTH;
    }
    /// Slabs across an axis.
    StripesSpec: "softvt.StripesMask" as "mask.stripes" {
        /// Direction in which they follow each other.
        axis: Direction;
        /// Distance from one to the next.
        pitch_m: f64 = LENGTH;
        /// Share of the pitch that is 1.
        share: f64 = SHARE => Number(0.5);
    }
    /// Rises smoothly from 0 to 1 along an axis.
    GradientSpec: "softvt.GradientMask" as "mask.gradient" {
        /// Direction.
        axis: Direction => Text("z");
        /// Coordinate at which it is 0.
        from_m: f64 = Type::Number("m", Range::ANY);
        /// Coordinate at which it is 1; may be below from_m.
        to_m: f64 = Type::Number("m", Range::ANY);
    }
    /// Cloudy noise with values around 0.5, few below 0.2 or above 0.8.
    NoiseSpec: "softvt.NoiseMask" as "mask.noise" {
        /// Size of the coarsest features: one number for all axes, or one for each of x, y and z.
        size_m: Sizes;
        /// Octaves, each half the size and half the weight of the one before.
        octaves: u32 = Type::Integer(Range::closed(1.0, 8.0)) => Integer(3);
        /// Value of the noise that becomes 0.
        from: f64 = NOISE_VALUE => Number(0.35);
        /// Value of the noise that becomes 1; may be below from.
        to: f64 = NOISE_VALUE => Number(0.65);
        /// Selects the pattern.
        seed: u32 => Integer(0);
    }
    /// Annual rings of a trunk: cylinders about a line along z, distorted by noise.
    RingsSpec: "softvt.RingsMask" as "mask.rings" {
        /// A point of the line.
        centre_m: [f64; 3] = Type::Vector(3, "m");
        /// Distance from one ring to the next.
        pitch_m: f64 = LENGTH;
        /// Amplitude of the distortion.
        wobble_m: f64 = LENGTH => Number(0.01);
        /// Selects the pattern.
        seed: u32 => Integer(0);
    }
    /// Boards along x, side by side in y, with one value per board.
    BoardsSpec: "softvt.BoardsMask" as "mask.boards" {
        /// Length of a board.
        length_m: f64 = LENGTH;
        /// Width of a board.
        width_m: f64 = LENGTH;
        /// Selects the pattern.
        seed: u32 => Integer(0);
    }
    /// The gaps between boards of these sizes.
    SeamsSpec: "softvt.SeamsMask" as "mask.seams" {
        /// Length of a board.
        length_m: f64 = LENGTH;
        /// Width of a board.
        width_m: f64 = LENGTH;
        /// Width of a gap.
        gap_m: f64 = LENGTH;
    }
    /// Scattered round specks.
    SpecksSpec: "softvt.SpecksMask" as "mask.specks" {
        /// Mean distance.
        spacing_m: f64 = LENGTH;
        /// Radius, at most half the spacing.
        radius_m: f64 = LENGTH;
        /// Selects the pattern.
        seed: u32 => Integer(0);
    }
    /// A plain weave in x and y: high in the middle of a thread.
    WeaveSpec: "softvt.WeaveMask" as "mask.weave" {
        /// Width of a thread.
        pitch_m: f64 = LENGTH;
    }
    /// Surfaces that face a direction, by the cosine between their normal and that direction.
    FacingSpec: "softvt.FacingMask" as "mask.facing" {
        /// Direction.
        axis: Direction => Text("z");
        /// Cosine at which it is 0.
        from: f64 = COSINE => Number(0.0);
        /// Cosine at which it is 1; may be below from.
        to: f64 = COSINE => Number(1.0);
    }
    /// The inside of a shape: a painted rim, the grooves between ridges.
    InsideMaskSpec: "softvt.InsideMask" as "mask.inside" {
        /// The shape.
        shape: LuaShape;
        /// Width of the border, half of it on either side of the shape's surface.
        soft_m: f64 = Type::Number("m", Range::NOT_NEGATIVE) => Number(0.0);
    }
    /// The letters of a line of text, printed on surfaces that face the reader. Surfaces with text are drawn in finer
    /// detail.
    TextMaskSpec: "softvt.TextMask" as "mask.text" {
        /// At most 64 letters.
        text: String;
        /// Height of a capital letter.
        height_m: f64 = Type::Number("m", Range::closed(0.0005, 1.0));
        /// Middle of the line; of a wrapped line, only the height counts.
        at: [f64; 3] = Type::Vector(3, "m");
        /// Direction that the printed surface faces. The top of the letters points to +y on top faces, else to +z.
        facing: Facing;
        /// Rotation of the line on its surface, counter-clockwise for the reader.
        turn: f64 = Type::Number("rad", Range::ANY) => Number(0.0);
        /// Radius of the upright cylinder about the z axis that the line is wrapped around; flat by default.
        wrap_m: Option<f64> = LENGTH;
        /// Thickening of the strokes, in heights of a capital letter.
        weight: f64 = Type::Number("", Range::closed(0.0, 0.25)) => Number(0.08);
        /// Typeface.
        font: Typeface => Text("sans");
    }
}

choice! { Typeface { "sans" => Typeface::Sans, "mono" => Typeface::Mono } }

/// The components of a direction given by the name of an axis or by a vector.
macro_rules! named_direction {
    ($(#[doc = $doc:literal])+ $name:ident { $($text:literal => $vector:expr),+ }) => {
        $(#[doc = $doc])+
        #[derive(Clone, Copy, Debug)]
        pub(crate) struct $name([f64; 3]);

        impl FromLua for $name {
            fn from_lua(value: Value, lua: &Lua) -> mlua::Result<Self> {
                let Value::String(name) = &value else { return lua.unpack(value).map(Self) };
                match name.to_string_lossy().as_str() {
                    $($text => Ok(Self($vector)),)+
                    other => Err(fail(lua, format!("unexpected {other:?}"))),
                }
            }
        }

        impl LuaType for $name {
            const TYPE: Type = Type::OneOf(&[Type::Choice(&[$($text),+]), Type::Vector(3, "any length")]);
        }
    };
}

named_direction! {
    /// An axis, or a vector of any length.
    Direction { "x" => [1.0, 0.0, 0.0], "y" => [0.0, 1.0, 0.0], "z" => [0.0, 0.0, 1.0] }
}

named_direction! {
    /// A signed axis, or a vector of any length.
    Facing {
        "+x" => [1.0, 0.0, 0.0], "-x" => [-1.0, 0.0, 0.0],
        "+y" => [0.0, 1.0, 0.0], "-y" => [0.0, -1.0, 0.0],
        "+z" => [0.0, 0.0, 1.0], "-z" => [0.0, 0.0, -1.0]
    }
}

/// One size for all axes, or one for each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sizes([f64; 3]);

impl FromLua for Sizes {
    fn from_lua(value: Value, lua: &Lua) -> mlua::Result<Self> {
        match value {
            Value::Table(_) => lua.unpack(value).map(Self),
            other => lua.unpack(other).map(|size| Self([size; 3])),
        }
    }
}

impl LuaType for Sizes {
    const TYPE: Type = Type::OneOf(&[LENGTH, Type::Vector(3, "m, each above 0")]);
}

/// `softvt.Mask`.
#[derive(Clone, Debug)]
pub(crate) struct LuaMask(Arc<MaskNode>);

#[derive(Debug)]
struct MaskNode {
    mask: Arc<Mask>,
    /// Masks that it is made of, each as often as it occurs.
    parts: usize,
    /// Memory it keeps, bytes; parts shared with other masks count for each of them.
    bytes: usize,
    _reserved: Reservation,
}

impl LuaMask {
    fn new(lua: &Lua, mask: Mask, parts: usize, bytes: usize) -> mlua::Result<Self> {
        if parts > MAX_PARTS {
            let message = format!(
                "mask: is made of {parts} masks; at most {MAX_PARTS} can be drawn; use fewer, or more layers"
            );
            return Err(fail(lua, message));
        }
        Ok(Self(Arc::new(MaskNode { mask: Arc::new(mask), parts, bytes, _reserved: reserve(lua, bytes)? })))
    }

    /// A mask that is not made of others.
    fn simple(lua: &Lua, mask: Mask) -> mlua::Result<Self> {
        Self::new(lua, mask, 1, size_of::<Mask>())
    }
}

impl FromLua for LuaMask {
    fn from_lua(value: Value, lua: &Lua) -> mlua::Result<Self> {
        let mask = value.as_userdata().and_then(|data| data.borrow::<Self>().ok().map(|mask| mask.clone()));
        mask.ok_or_else(|| {
            fail(lua, format!("expected a mask (softvt.mask.…{{…}}), got {}", describe(&value)))
        })
    }
}

impl LuaType for LuaMask {
    const TYPE: Type = Type::Object("softvt.Mask");
}

class! {
    /// A weight between 0 and 1 at every point of a surface, for the layers of a visual. A mask never changes; methods
    /// return new masks.
    LuaMask: "softvt.Mask" {
        label(_) { "mask".to_owned() }
        methods {
            /// Returns the product of two masks: 1 where both are.
            fn both(lua, this, other: LuaMask) -> ["softvt.Mask"] {
                let (mut masks, own) = match &*this.0.mask {
                    Mask::Product { masks } => (masks.clone(), 0),
                    _ => (vec![this.0.mask.clone()], 1),
                };
                masks.push(other.0.mask.clone());
                let bytes = this.0.bytes + other.0.bytes + size_of::<Mask>();
                LuaMask::new(lua, Mask::Product { masks }, this.0.parts + other.0.parts + own, bytes)?
            }
            /// Returns 1 minus the mask.
            fn inverted(lua, this) -> ["softvt.Mask"] {
                let MaskNode { mask, parts, bytes, .. } = &*this.0;
                LuaMask::new(lua, Mask::Inverse { mask: mask.clone() }, parts + 1, bytes + size_of::<Mask>())?
            }
        }
    }
}

/// The error about a field of the record `T`.
fn wrong<T: RecordType>(lua: &Lua, key: &str, message: impl Into<String>) -> mlua::Error {
    invalid(lua, T::RECORD, key, message)
}

/// The components of the field `axis`.
fn axis<T: RecordType>(lua: &Lua, axis: Direction) -> mlua::Result<[f64; 3]> {
    let direction = direction(axis.0).map(Into::into);
    direction.ok_or_else(|| wrong::<T>(lua, "axis", "expected a direction, got one of length 0"))
}

/// Checks that the ends of a ramp differ.
fn check_ramp<T: RecordType>(lua: &Lua, [from, to]: [f64; 2], keys: [&str; 2]) -> mlua::Result<()> {
    match from == to {
        true => {
            let message = format!("expected a number other than {}, got the same", keys[0]);
            Err(wrong::<T>(lua, keys[1], message))
        }
        false => Ok(()),
    }
}

functions! {
    MASKS {
        fn checker(lua, spec: CheckerSpec) -> ["softvt.Mask"] {
            LuaMask::simple(lua, Mask::Checker { size_m: spec.size_m })?
        }
        fn stripes(lua, spec: StripesSpec) -> ["softvt.Mask"] {
            let StripesSpec { pitch_m, share, .. } = spec;
            LuaMask::simple(lua, Mask::Stripes { axis: axis::<StripesSpec>(lua, spec.axis)?, pitch_m, share })?
        }
        fn gradient(lua, spec: GradientSpec) -> ["softvt.Mask"] {
            let GradientSpec { from_m, to_m, .. } = spec;
            let axis = axis::<GradientSpec>(lua, spec.axis)?;
            check_ramp::<GradientSpec>(lua, [from_m, to_m], ["from_m", "to_m"])?;
            LuaMask::simple(lua, Mask::Gradient { axis, from_m, to_m })?
        }
        fn noise(lua, spec: NoiseSpec) -> ["softvt.Mask"] {
            let NoiseSpec { size_m: Sizes(size_m), octaves, from, to, seed } = spec;
            check_ramp::<NoiseSpec>(lua, [from, to], ["from", "to"])?;
            if size_m.iter().any(|&size| size <= 0.0) {
                let message = "expected metres above 0 for each of x, y and z";
                return Err(wrong::<NoiseSpec>(lua, "size_m", message));
            }
            LuaMask::simple(lua, Mask::Noise { size_m, octaves, from, to, seed })?
        }
        fn rings(lua, spec: RingsSpec) -> ["softvt.Mask"] {
            let RingsSpec { centre_m, pitch_m, wobble_m, seed } = spec;
            LuaMask::simple(lua, Mask::Rings { centre_m, pitch_m, wobble_m, seed })?
        }
        fn boards(lua, spec: BoardsSpec) -> ["softvt.Mask"] {
            let BoardsSpec { length_m, width_m, seed } = spec;
            LuaMask::simple(lua, Mask::Boards { length_m, width_m, seed })?
        }
        fn seams(lua, spec: SeamsSpec) -> ["softvt.Mask"] {
            let SeamsSpec { length_m, width_m, gap_m } = spec;
            LuaMask::simple(lua, Mask::Seams { length_m, width_m, gap_m })?
        }
        fn specks(lua, spec: SpecksSpec) -> ["softvt.Mask"] {
            let SpecksSpec { spacing_m, radius_m, seed } = spec;
            if radius_m > 0.5 * spacing_m {
                return Err(wrong::<SpecksSpec>(lua, "radius_m", "expected at most half of spacing_m"));
            }
            LuaMask::simple(lua, Mask::Specks { spacing_m, radius_m, seed })?
        }
        fn weave(lua, spec: WeaveSpec) -> ["softvt.Mask"] {
            LuaMask::simple(lua, Mask::Weave { pitch_m: spec.pitch_m })?
        }
        fn facing(lua, spec: FacingSpec) -> ["softvt.Mask"] {
            let FacingSpec { from, to, .. } = spec;
            let axis = axis::<FacingSpec>(lua, spec.axis)?;
            check_ramp::<FacingSpec>(lua, [from, to], ["from", "to"])?;
            LuaMask::simple(lua, Mask::Facing { axis, from, to })?
        }
        fn inside(lua, spec: InsideMaskSpec) -> ["softvt.Mask"] {
            let bytes = size_of::<Mask>() + spec.shape.bytes();
            let mask = Mask::Inside { shape: Arc::new(spec.shape.copy()), soft_m: spec.soft_m };
            LuaMask::new(lua, mask, 1, bytes)?
        }
        fn text(lua, spec: TextMaskSpec) -> ["softvt.Mask"] {
            let decal = TextDecal::new(text_line(lua, spec)?);
            let bytes = decal.bytes();
            LuaMask::new(lua, Mask::Text { decal: Arc::new(decal) }, 1, bytes)?
        }
    }
}

/// A line of text that can be printed.
fn text_line(lua: &Lua, spec: TextMaskSpec) -> mlua::Result<LabelLine> {
    let wrong = |key: &str, message: &str| Err(wrong::<TextMaskSpec>(lua, key, message));
    let count = spec.text.chars().count();
    if count > MAX_LETTERS {
        return wrong("text", &format!("expected at most {MAX_LETTERS} letters, got {count}"));
    }
    let Facing(facing) = spec.facing;
    let length = facing.iter().map(|x| x * x).sum::<f64>().sqrt();
    if !(length > 1e-6 && length < 1e6) {
        return wrong("facing", "expected a direction, its length between 1e-6 and 1e6");
    }
    if spec.wrap_m.is_some() && facing[0].hypot(facing[1]) < 1e-3 * length {
        return wrong("facing", "expected a sideways direction, since the line is wrapped around the z axis");
    }
    let line = LabelLine {
        text: spec.text,
        typeface: spec.font,
        height_m: spec.height_m,
        weight: spec.weight,
        at: spec.at,
        facing,
        turn: spec.turn,
        wrap_m: spec.wrap_m,
    };
    match line.unsupported_char() {
        Some(letter) => wrong(
            "text",
            &format!("the typeface has no letter {letter:?}; expected Latin, Greek or Cyrillic ones"),
        ),
        None => Ok(line),
    }
}

impl From<&VisualSpec> for Visual {
    fn from(spec: &VisualSpec) -> Self {
        let layers = spec.layers.as_deref().unwrap_or_default().iter().map(|layer| VisualLayer {
            mask: layer.mask.as_ref().map_or(Mask::Whole, |mask| (*mask.0.mask).clone()),
            albedo: layer.albedo,
            roughness: layer.roughness,
            opacity: layer.opacity,
            relief_m: layer.relief_m,
        });
        Self {
            albedo: spec.albedo,
            roughness: spec.roughness,
            metalness: spec.metalness,
            layers: layers.collect(),
        }
    }
}

/// The visuals of the asset or part `name` with a shape, one per material of the shape; plain grey if none are given.
pub(crate) fn visuals_of(
    lua: &Lua,
    name: &str,
    specs: Option<&[VisualSpec]>,
    shape: &Shape,
) -> mlua::Result<Vec<Visual>> {
    let needed = usize::from(shape.highest_material()) + 1;
    match specs.unwrap_or_default() {
        [] => Ok(vec![Visual::default(); needed]),
        specs if specs.len() < needed => {
            let message = format!(
                "asset {name}: visuals: the shape is painted with material {}, expected {needed} visuals, got {}; \
                 the first is that of material 0",
                needed - 1,
                specs.len()
            );
            Err(fail(lua, message))
        }
        specs => Ok(specs.iter().map(Visual::from).collect()),
    }
}

/// Checks the components of a colour; `label` names it in the message.
pub(crate) fn colour(lua: &Lua, label: &str, colour: [f64; 3], max: f64) -> mlua::Result<[f64; 3]> {
    match colour.iter().all(|c| (0.0..=max).contains(c)) {
        true => Ok(colour),
        false => Err(fail(lua, format!("{label}: expected linear RGB in 0..{max}, got {}", braced(&colour)))),
    }
}

/// Numbers as a Lua list: `{0, 1e300, 0}`.
pub(crate) fn braced(numbers: &[f64]) -> String {
    let numbers = numbers.iter().map(|x| crate::text::format_number(*x));
    format!("{{{}}}", numbers.collect::<Vec<_>>().join(", "))
}

/// `softvt.Material`: a visual of an object in a scene.
#[derive(Clone)]
pub(crate) struct LuaMaterial {
    scene: Arc<Mutex<Scene>>,
    object: usize,
    index: usize,
}

impl LuaMaterial {
    /// The materials of an object, by material id.
    pub(crate) fn all(scene: &Arc<Mutex<Scene>>, object: usize) -> Vec<Self> {
        let count = lock(scene).objects[object].asset.visuals.len();
        (0..count).map(|index| Self { scene: scene.clone(), object, index }).collect()
    }

    fn read<T>(&self, read: impl FnOnce(&Visual) -> T) -> T {
        read(&lock(&self.scene).objects[self.object].asset.visuals[self.index])
    }

    fn change(&self, change: impl FnOnce(&mut Visual)) {
        let mut scene = lock(&self.scene);
        change(&mut Arc::make_mut(&mut scene.objects[self.object].asset).visuals[self.index]);
    }
}

class! {
    /// The base material of a visual of a placed object. Its layers stay as they are.
    LuaMaterial: "softvt.Material" {
        label(_) { "material".to_owned() }
        writable {
            /// Base colour.
            albedo: Type::Vector(3, "linear RGB in 0..1") => {
                get(_, this) { this.read(|visual| visual.albedo) }
                set(lua, this, albedo: [f64; 3]) {
                    let albedo = colour(lua, "material.albedo", albedo, 1.0)?;
                    this.change(|visual| visual.albedo = albedo);
                }
            }
            /// Roughness: 0 is a mirror, 1 is chalk.
            roughness: SHARE => {
                get(_, this) { this.read(|visual| visual.roughness) }
                set(_, this, roughness: f64) { this.change(|visual| visual.roughness = roughness); }
            }
            /// Metalness: 1 is bare metal.
            metalness: SHARE => {
                get(_, this) { this.read(|visual| visual.metalness) }
                set(_, this, metalness: f64) { this.change(|visual| visual.metalness = metalness); }
            }
        }
    }
}
