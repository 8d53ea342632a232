//! Appearances: visuals, the layers over them, and masks, which are immutable values with chained methods. Lengths are
//! in metres; points and directions in the object frame at rest.

use std::sync::{Arc, Mutex};

use mlua::{Lua, Value};

use super::{
    pose::{ANGLES, direction},
    shapes::LuaShape,
};
use crate::schema::{FieldDefault, LuaType, Range, Type, choice, class, functions, invalid, record_of};
use softvt_common::{parallel::lock, text::AXIS_NAMES};
use softvt_scene::{LabelLine, MAX_LETTERS, Mask, Scene, TextDecal, Typeface, Visual, VisualLayer};

/// Lengths of patterns. Finer ones cannot be seen, and their waves exceed the numbers of the renderer.
const LENGTHS: Range = Range::at_least(1e-6).usually(1e-6, 5.0);
const LENGTH: Type = Type::Number("m", LENGTHS);
const COORDINATE: Type = Type::Number("m", Range::ANY.usually(-5.0, 5.0));
const SHARE: Type = Type::Number("", Range::closed(0.0, 1.0));
const COSINE: Type = Type::Number("", Range::closed(-1.0, 1.0));
const NOISE_VALUE: Type = Type::Number("", Range::closed(-1.0, 2.0));
const ALBEDO: Type = Type::colour(1.0);

/// Masks that one mask may be made of: each is evaluated at every point that is drawn.
const MAX_PARTS: usize = 200;

record_of! {
    /// The appearance of a surface: a base material, and layers painted over it in order.
    Visual: "softvt.Visual" as "visual" {
        /// Colour of the base.
        albedo: [f64; 3] = ALBEDO;
        /// Roughness: 0 is a mirror, 1 is chalk.
        roughness: f64 = SHARE => Number(0.6);
        /// Metalness: 1 is bare metal.
        metalness: f64 = SHARE => Number(0.0);
        /// Layers painted over the base, in this order.
        layers: Vec<VisualLayer> => Empty;
    } by |_| Ok(Visual { layers, ..Visual::plain(albedo, roughness, metalness) });
    /// A colour laid over the layers below where a mask is not 0.
    VisualLayer: "softvt.Layer" as "layer" {
        /// Weight of the layer; 1 everywhere by default.
        mask: Mask;
        /// Colour of the layer.
        albedo: [f64; 3] = ALBEDO;
        /// Roughness: 0 is a mirror, 1 is chalk.
        roughness: f64 = SHARE => Number(0.6);
        /// Share of this layer where the mask is 1; with 0 only the relief shows.
        opacity: f64 = SHARE => Number(1.0);
        /// Height of the drawn surface where the mask is 1. It is drawn only: contact does not see it.
        relief_m: f64 = Type::Number("m", Range::closed(-0.005, 0.005)) => Number(0.0);
    }
}

choice! { Typeface { "sans" => Sans, "mono" => Mono } }

const AXIS: Type = Type::Direction(&AXIS_NAMES, "any length");
const FACING: Type = Type::Direction(&["+x", "-x", "+y", "-y", "+z", "-z"], "any length");

/// A direction given by the name of an axis or by a vector.
#[derive(Clone, Copy, Debug)]
struct Direction([f64; 3]);

impl LuaType for Direction {
    const TYPE: Type = AXIS;

    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        let Value::String(name) = &value else {
            let numbers = lua.unpack(value)?;
            return Ok(Self(direction(numbers).map_or(numbers, Into::into)));
        };
        let name = name.to_string_lossy();
        let length = if name.starts_with('-') { -1.0 } else { 1.0 };
        Ok(Self(AXIS_NAMES.map(|axis| if name.ends_with(axis) { length } else { 0.0 })))
    }
}

#[derive(Clone, Copy, Debug)]
struct Sizes([f64; 3]);

impl LuaType for Sizes {
    const TYPE: Type = Type::OneOf(&[LENGTH, Type::Vector(3, "m", LENGTHS)]);

    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        match value {
            Value::Table(_) => lua.unpack(value).map(Self),
            other => lua.unpack(other).map(|size| Self([size; 3])),
        }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct LuaMask(Arc<MaskNode>);

#[derive(Debug)]
struct MaskNode {
    mask: Arc<Mask>,
    /// Masks that it is made of, each as often as it occurs.
    parts: usize,
}

impl LuaMask {
    fn new(lua: &Lua, mask: Mask, parts: usize) -> mlua::Result<Self> {
        if parts > MAX_PARTS {
            bail!(lua, "mask: is made of {parts} masks, expected at most {MAX_PARTS}; use more layers");
        }
        Ok(Self(Arc::new(MaskNode { mask: Arc::new(mask), parts })))
    }

    fn simple(lua: &Lua, mask: Mask) -> mlua::Result<Self> {
        Self::new(lua, mask, 1)
    }
}

impl LuaType for Mask {
    const TYPE: Type = LuaMask::TYPE;
    const PRESENCE: FieldDefault = FieldDefault::Optional;

    fn from_checked(value: Value, lua: &Lua) -> mlua::Result<Self> {
        let mask: Option<LuaMask> = lua.unpack(value)?;
        Ok(mask.map_or(Self::Whole, |mask| (*mask.0.mask).clone()))
    }
}

class! {
    /// A weight between 0 and 1 at every point of a surface, for the layers of a visual. A mask never changes;
    /// methods return new masks.
    LuaMask: "softvt.Mask" {
        label(_) { "mask".to_owned() }
        methods {
            /// Returns the product of two masks: 1 where both are.
            fn intersect(lua, this, other: LuaMask) -> ["softvt.Mask"] {
                let (mut masks, own) = match &*this.0.mask {
                    Mask::Product { masks } => (masks.clone(), 0),
                    _ => (vec![this.0.mask.clone()], 1),
                };
                masks.push(other.0.mask.clone());
                LuaMask::new(lua, Mask::Product { masks }, this.0.parts + other.0.parts + own)?
            }
            /// Returns 1 minus the mask.
            fn inverted(lua, this) -> ["softvt.Mask"] {
                let MaskNode { mask, parts } = &*this.0;
                LuaMask::new(lua, Mask::Inverse { mask: mask.clone() }, parts + 1)?
            }
        }
    }
}

/// Checks that the ends of a ramp of the mask `label` differ; `keys` are theirs.
fn check_ramp(lua: &Lua, label: &str, [from, to]: [f64; 2], keys: [&str; 2]) -> mlua::Result<()> {
    if from != to {
        return Ok(());
    }
    Err(invalid(lua, label, keys[1], format_args!("expected a number other than {}, got the same", keys[0])))
}

functions! {
    MASKS {
        /// Cubes, every other one 1; one corner is at the origin.
        fn checker(lua) takes spec "softvt.CheckerMask" {
            /// Edge of a cube.
            size_m: f64 = LENGTH;
        } -> ["softvt.Mask"] { LuaMask::simple(lua, Mask::Checker { size_m })? }
        /// Slabs across an axis.
        fn stripes(lua) takes spec "softvt.StripesMask" {
            /// Direction in which they follow each other.
            axis: Direction;
            /// Distance from one to the next.
            pitch_m: f64 = LENGTH;
            /// Share of the pitch that is 1.
            share: f64 = SHARE => Number(0.5);
        } -> ["softvt.Mask"] { LuaMask::simple(lua, Mask::Stripes { axis: axis.0, pitch_m, share })? }
        /// Rises smoothly from 0 to 1 along an axis.
        fn gradient(lua) takes spec "softvt.GradientMask" {
            /// Direction of the gradient.
            axis: Direction => Text("z");
            /// Coordinate at which it is 0.
            from_m: f64 = COORDINATE;
            /// Coordinate at which it is 1; may be below from_m.
            to_m: f64 = COORDINATE;
        } -> ["softvt.Mask"] {
            check_ramp(lua, "mask.gradient", [from_m, to_m], ["from_m", "to_m"])?;
            LuaMask::simple(lua, Mask::Gradient { axis: axis.0, from_m, to_m })?
        }
        /// Cloudy noise with values around 0.5, few below 0.2 or above 0.8.
        fn noise(lua) takes spec "softvt.NoiseMask" {
            /// Size of the coarsest features: one number for all axes, or one for each of x, y and z.
            size_m: Sizes;
            /// Octaves, each half the size and half the weight of the one before.
            octaves: u32 = Type::Integer(Range::closed(1.0, 8.0)) => Integer(3);
            /// Value of the noise that becomes 0.
            from: f64 = NOISE_VALUE => Number(0.35);
            /// Value of the noise that becomes 1; may be below from.
            to: f64 = NOISE_VALUE => Number(0.65);
            /// Seed of the pattern.
            seed: u32 => Integer(0);
        } -> ["softvt.Mask"] {
            check_ramp(lua, "mask.noise", [from, to], ["from", "to"])?;
            LuaMask::simple(lua, Mask::Noise { size_m: size_m.0, octaves, from, to, seed })?
        }
        /// Annual rings of a trunk: cylinders about a line along z, distorted by noise.
        fn rings(lua) takes spec "softvt.RingsMask" {
            /// A point of the line.
            centre_m: [f64; 3] = Type::vector(3, "m");
            /// Distance from one ring to the next.
            pitch_m: f64 = LENGTH;
            /// Amplitude of the distortion.
            wobble_m: f64 = LENGTH => Number(0.01);
            /// Seed of the pattern.
            seed: u32 => Integer(0);
        } -> ["softvt.Mask"] { LuaMask::simple(lua, Mask::Rings { centre_m, pitch_m, wobble_m, seed })? }
        /// Boards along x, side by side in y, with one value per board.
        fn boards(lua) takes spec "softvt.BoardsMask" {
            /// Length of a board.
            length_m: f64 = LENGTH;
            /// Width of a board.
            width_m: f64 = LENGTH;
            /// Seed of the pattern.
            seed: u32 => Integer(0);
        } -> ["softvt.Mask"] { LuaMask::simple(lua, Mask::Boards { length_m, width_m, seed })? }
        /// The gaps between boards of these sizes.
        fn seams(lua) takes spec "softvt.SeamsMask" {
            /// Length of a board.
            length_m: f64 = LENGTH;
            /// Width of a board.
            width_m: f64 = LENGTH;
            /// Width of a gap.
            gap_m: f64 = LENGTH;
        } -> ["softvt.Mask"] { LuaMask::simple(lua, Mask::Seams { length_m, width_m, gap_m })? }
        /// Round specks, scattered in space.
        fn specks(lua) takes spec "softvt.SpecksMask" {
            /// Mean distance of the specks.
            spacing_m: f64 = LENGTH;
            /// Radius, at most half the spacing.
            radius_m: f64 = LENGTH;
            /// Seed of the pattern.
            seed: u32 => Integer(0);
        } -> ["softvt.Mask"] {
            if radius_m > 0.5 * spacing_m {
                return Err(invalid(lua, "mask.specks", "radius_m", "expected at most half of spacing_m"));
            }
            LuaMask::simple(lua, Mask::Specks { spacing_m, radius_m, seed })?
        }
        /// A plain weave in x and y: high in the middle of a thread.
        fn weave(lua) takes spec "softvt.WeaveMask" {
            /// Width of a thread.
            pitch_m: f64 = LENGTH;
        } -> ["softvt.Mask"] { LuaMask::simple(lua, Mask::Weave { pitch_m })? }
        /// Surfaces that face a direction, by the cosine between their normal and that direction.
        fn facing(lua) takes spec "softvt.FacingMask" {
            /// Direction that is compared with the normals.
            axis: Direction => Text("z");
            /// Cosine at which it is 0.
            from: f64 = COSINE => Number(0.0);
            /// Cosine at which it is 1; may be below from.
            to: f64 = COSINE => Number(1.0);
        } -> ["softvt.Mask"] {
            check_ramp(lua, "mask.facing", [from, to], ["from", "to"])?;
            LuaMask::simple(lua, Mask::Facing { axis: axis.0, from, to })?
        }
        /// The inside of a shape: a painted rim, the grooves between ridges.
        fn inside(lua) takes spec "softvt.InsideMask" {
            /// Shape whose inside is 1.
            shape: LuaShape;
            /// Width of the border, half of it on either side of the shape's surface.
            soft_m: f64 = Type::Number("m", Range::NOT_NEGATIVE) => Number(0.0);
        } -> ["softvt.Mask"] {
            LuaMask::simple(lua, Mask::Inside { shape: Arc::new(shape.copy()), soft_m })?
        }
        /// The letters of a line of text, printed on surfaces that face the reader. Surfaces with text are
        /// drawn in finer detail.
        fn text(lua) takes spec "softvt.TextMask" {
            /// At most 64 letters.
            text: String;
            /// Height of a capital letter.
            height_m: f64 = Type::Number("m", Range::closed(0.0005, 1.0));
            /// Middle of the line; of a wrapped line, only the height counts.
            at: [f64; 3] = Type::vector(3, "m");
            /// Direction that the printed surface faces. The top of the letters points to +y on top faces, else to +z.
            facing: Direction = FACING;
            /// Rotation of the line on its surface, counter-clockwise for the reader.
            angle: f64 = Type::Number("rad", ANGLES) => Number(0.0);
            /// Radius of the upright cylinder about the z axis that the line is wrapped around; flat by default.
            wrap_m: Option<f64> = LENGTH;
            /// Thickening of the strokes, in heights of a capital letter.
            weight: f64 = Type::Number("", Range::closed(0.0, 0.25)) => Number(0.08);
            /// Typeface of the letters.
            font: Typeface => Text("sans");
        } -> ["softvt.Mask"] {
            let facing = facing.0;
            let line = LabelLine { text, typeface: font, height_m, weight, at, facing, turn: angle, wrap_m };
            check_label(lua, &line)?;
            LuaMask::simple(lua, Mask::Text { decal: Arc::new(TextDecal::new(line)) })?
        }
    }
}

fn check_label(lua: &Lua, line: &LabelLine) -> mlua::Result<()> {
    let wrong = |key: &str, message: String| Err(invalid(lua, "mask.text", key, message));
    let count = line.text.chars().count();
    if count > MAX_LETTERS {
        return wrong("text", format!("expected at most {MAX_LETTERS} letters, got {count}"));
    }
    let [x, y, z] = line.facing;
    if line.wrap_m.is_some() && x.hypot(y) < 1e-3 * x.hypot(y).hypot(z) {
        let message = "expected a sideways direction, since the line is wrapped around the z axis";
        return wrong("facing", message.to_owned());
    }
    match line.unsupported_char() {
        Some(letter) => wrong(
            "text",
            format!("the typeface has no letter {letter:?}; expected Latin, Greek or Cyrillic ones"),
        ),
        None => Ok(()),
    }
}

/// The visuals of the asset or part `name` with a shape, one per material of the shape; plain grey if none are given.
pub(crate) fn visuals_of(
    lua: &Lua,
    name: &str,
    visuals: &[Visual],
    shape: &LuaShape,
) -> mlua::Result<Vec<Visual>> {
    let needed = usize::from(shape.shape().highest_material()) + 1;
    if visuals.is_empty() {
        let mut plain = vec![Visual::default(); needed];
        let own = shape.file_visual().map_err(|error| {
            let what = "the colours of its mesh cannot be read";
            fail!(lua, "asset {name}: visuals: {what}: {error}, or give the asset visuals")
        })?;
        plain[0] = own.unwrap_or_default();
        return Ok(plain);
    }
    if visuals.len() < needed {
        let (last, got) = (needed - 1, visuals.len());
        bail!(lua, "asset {name}: visuals: the shape has materials 0 to {last}, got {got} visuals");
    }
    Ok(visuals.to_vec())
}

/// `softvt.Material`: a visual of an object in a scene.
#[derive(Clone)]
pub(crate) struct LuaMaterial {
    scene: Arc<Mutex<Scene>>,
    object: usize,
    index: usize,
}

impl LuaMaterial {
    pub(crate) fn all(scene: &Arc<Mutex<Scene>>, object: usize) -> Vec<Self> {
        let count = lock(scene).objects[object].asset.visuals.len();
        (0..count).map(|index| Self { scene: scene.clone(), object, index }).collect()
    }

    fn read<T>(&self, read: impl FnOnce(&Visual) -> T) -> T {
        read(&lock(&self.scene).objects[self.object].asset.visuals[self.index])
    }

    fn change(&self, _: &Lua, change: impl FnOnce(&mut Visual)) {
        let mut scene = lock(&self.scene);
        change(&mut Arc::make_mut(&mut scene.objects[self.object].asset).visuals[self.index]);
    }
}

class! {
    /// The base material of a visual of a placed object. Its layers stay as they are.
    LuaMaterial: "softvt.Material" {
        label(_) { "material".to_owned() }
        writable {
            /// Colour of the base.
            albedo: ALBEDO => albedo;
            /// Roughness: 0 is a mirror, 1 is chalk.
            roughness: SHARE => roughness;
            /// Metalness: 1 is bare metal.
            metalness: SHARE => metalness;
        }
    }
}
