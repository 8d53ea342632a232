//! Looks in Lua: masks are immutable values with chained methods; layers and visuals are checked tables.

use std::sync::Arc;

use mlua::{FromLua, Lua, Table, UserDataMethods, Value};

use crate::script::{
    api::catalogue_classes::Class,
    api::catalogue_visuals::{MASK_CLASS, MASKS},
    api::orientation as turn,
    api::shapes::LuaShape,
    schema::userdata::{Hosted, hosted, method},
    schema::{self, Fault, Record, checked},
    vm::fail,
    vm::memory_budget::{Held, hold},
};
use crate::{
    geometry::shape::Shape,
    scene::{MAX_LETTERS, Mask, TextDecal, TextLine, Typeface, Visual, VisualLayer},
};

/// Masks that one may be made of: each is computed at every point that is drawn.
const MOST_PARTS: usize = 200;

/// `softvt.Mask`.
#[derive(Clone, Debug)]
struct LuaMask(Arc<Node>);

#[derive(Debug)]
struct Node {
    mask: Arc<Mask>,
    /// Masks that it is made of, each as often as it occurs.
    parts: usize,
    /// What it keeps in memory, bytes; what it shares with others counts for each of them.
    bytes: usize,
    _held: Held,
}

impl LuaMask {
    fn new(lua: &Lua, mask: Mask, parts: usize, bytes: usize) -> mlua::Result<Self> {
        if parts > MOST_PARTS {
            let message = format!(
                "mask: is made of {parts} masks; at most {MOST_PARTS} can be drawn; use fewer, or more layers"
            );
            return Err(fail(lua, message));
        }
        Ok(Self(Arc::new(Node { mask: Arc::new(mask), parts, bytes, _held: hold(lua, bytes)? })))
    }

    fn both(&self, lua: &Lua, other: &Self) -> mlua::Result<Self> {
        let (mut masks, own) = match &*self.0.mask {
            Mask::Both { masks } => (masks.clone(), 0),
            _ => (vec![self.0.mask.clone()], 1),
        };
        masks.push(other.0.mask.clone());
        let bytes = self.0.bytes + other.0.bytes + size_of::<Mask>();
        Self::new(lua, Mask::Both { masks }, self.0.parts + other.0.parts + own, bytes)
    }
}

impl FromLua for LuaMask {
    fn from_lua(value: Value, lua: &Lua) -> mlua::Result<Self> {
        match value.as_userdata().and_then(|data| data.borrow::<Self>().ok()) {
            Some(mask) => Ok(mask.clone()),
            None => {
                Err(fail(lua, format!("expected a mask (softvt.mask.…{{…}}), got {}", schema::got(&value))))
            }
        }
    }
}

impl Hosted for LuaMask {
    fn class() -> &'static Class {
        &MASK_CLASS
    }

    fn label(&self) -> String {
        "mask".into()
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "both", |lua, this: &Self, other: Self| this.both(lua, &other));
        method(methods, "inverted", |lua, this: &Self, ()| {
            let Node { mask, parts, bytes, .. } = &*this.0;
            Self::new(lua, Mask::Inverse { mask: mask.clone() }, parts + 1, bytes + size_of::<Mask>())
        });
    }
}

hosted!(LuaMask);

/// Installs `softvt.mask`.
pub(crate) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    let masks = lua.create_table()?;
    for (name, record) in MASKS {
        let make = lua.create_function(move |lua, value: Value| {
            let spec = checked(lua, record, &value)?;
            let wrong = |key: &str, message: &str| {
                let fault = Fault { path: vec![key.to_owned()], message: message.to_owned() };
                schema::fault_here(lua, record.label, &fault)
            };
            sound(record, &spec, &wrong)?;
            if *name == "text" {
                let print = TextDecal::new(line(&spec, &wrong)?);
                let bytes = print.bytes();
                return LuaMask::new(lua, Mask::Text { decal: Arc::new(print) }, 1, bytes);
            }
            let shape = if *name == "inside" { spec.get::<LuaShape>("shape")?.bytes() } else { 0 };
            LuaMask::new(lua, mask(name, &spec)?, 1, size_of::<Mask>() + shape)
        })?;
        masks.set(*name, make)?;
    }
    api.set("mask", masks)
}

/// What the types of single fields do not say.
fn sound(record: &Record, spec: &Table, wrong: &dyn Fn(&str, &str) -> mlua::Error) -> mlua::Result<()> {
    let has = |key: &str| record.fields.iter().any(|field| field.name == key);
    if has("axis") && turn::direction(axis(spec)?).is_none() {
        return Err(wrong("axis", "expected a direction, got one of length 0"));
    }
    for (from, to) in [("from", "to"), ("from_m", "to_m")] {
        if has(from) && spec.get::<f64>(from)? == spec.get::<f64>(to)? {
            return Err(wrong(to, &format!("expected a number other than {from}, got the same")));
        }
    }
    if has("size_m")
        && let Value::Table(_) = spec.get("size_m")?
        && spec.get::<[f64; 3]>("size_m")?.iter().any(|&size| size <= 0.0)
    {
        return Err(wrong("size_m", "expected metres above 0 for each of x, y and z"));
    }
    if has("radius_m") && spec.get::<f64>("radius_m")? > 0.5 * spec.get::<f64>("spacing_m")? {
        return Err(wrong("radius_m", "expected at most half of spacing_m"));
    }
    Ok(())
}

/// A direction as it is written.
fn axis(spec: &Table) -> mlua::Result<[f64; 3]> {
    Ok(match spec.get::<Value>("axis")? {
        Value::String(name) => match name.as_bytes().first() {
            Some(b'x') => [1.0, 0.0, 0.0],
            Some(b'y') => [0.0, 1.0, 0.0],
            _ => [0.0, 0.0, 1.0],
        },
        _ => spec.get("axis")?,
    })
}

/// The same of a length that can be computed with.
fn direction(spec: &Table) -> mlua::Result<[f64; 3]> {
    let axis = axis(spec)?;
    let plain = axis.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let unit = turn::direction(axis).filter(|_| !(1e-6..1e6).contains(&plain));
    Ok(unit.map_or(axis, Into::into))
}

/// A line of text that can be printed.
fn line(spec: &Table, wrong: &dyn Fn(&str, &str) -> mlua::Error) -> mlua::Result<TextLine> {
    let Ok(text) = spec.get::<String>("text") else {
        return Err(wrong("text", "expected letters in UTF-8"));
    };
    let count = text.chars().count();
    if count > MAX_LETTERS {
        return Err(wrong("text", &format!("expected at most {MAX_LETTERS} letters, got {count}")));
    }
    let facing = match spec.get::<Value>("facing")? {
        Value::String(name) => facing_of(&name.to_string_lossy()),
        _ => spec.get("facing")?,
    };
    let wrap_m: Option<f64> = spec.get("wrap_m")?;
    let length = facing.iter().map(|x| x * x).sum::<f64>().sqrt();
    if !(length > 1e-6 && length < 1e6) {
        return Err(wrong("facing", "expected a direction, its length between 1e-6 and 1e6"));
    }
    if wrap_m.is_some() && facing[0].hypot(facing[1]) < 1e-3 * length {
        return Err(wrong(
            "facing",
            "expected a direction to a side, since the line is laid round the z axis",
        ));
    }
    let typeface = if spec.get::<String>("font")? == "mono" { Typeface::Mono } else { Typeface::Sans };
    let line = TextLine {
        text,
        typeface,
        height_m: spec.get("height_m")?,
        weight: spec.get("weight")?,
        at: spec.get("at")?,
        facing,
        turn: spec.get("turn")?,
        wrap_m,
    };
    match line.missing() {
        Some(letter) => {
            let what =
                format!("the typeface has no letter {letter:?}; expected Latin, Greek or Cyrillic ones");
            Err(wrong("text", &what))
        }
        None => Ok(line),
    }
}

/// The direction of "+x" and its like.
fn facing_of(name: &str) -> [f64; 3] {
    let sign = if name.starts_with('-') { -1.0 } else { 1.0 };
    ["x", "y", "z"].map(|axis| if name.ends_with(axis) { sign } else { 0.0 })
}

/// One size for all axes or one for each.
fn sizes(spec: &Table) -> mlua::Result<[f64; 3]> {
    Ok(match spec.get::<Value>("size_m")? {
        Value::Table(_) => spec.get("size_m")?,
        _ => [spec.get("size_m")?; 3],
    })
}

fn mask(name: &str, s: &Table) -> mlua::Result<Mask> {
    Ok(match name {
        "checker" => Mask::Checker { size_m: s.get("size_m")? },
        "stripes" => {
            Mask::Stripes { axis: direction(s)?, pitch_m: s.get("pitch_m")?, share: s.get("share")? }
        }
        "gradient" => Mask::Gradient { axis: direction(s)?, from_m: s.get("from_m")?, to_m: s.get("to_m")? },
        "noise" => Mask::Noise {
            size_m: sizes(s)?,
            octaves: s.get("octaves")?,
            from: s.get("from")?,
            to: s.get("to")?,
            seed: s.get("seed")?,
        },
        "rings" => Mask::Rings {
            centre_m: s.get("centre_m")?,
            pitch_m: s.get("pitch_m")?,
            wobble_m: s.get("wobble_m")?,
            seed: s.get("seed")?,
        },
        "boards" => {
            Mask::Boards { length_m: s.get("length_m")?, width_m: s.get("width_m")?, seed: s.get("seed")? }
        }
        "seams" => {
            Mask::Seams { length_m: s.get("length_m")?, width_m: s.get("width_m")?, gap_m: s.get("gap_m")? }
        }
        "specks" => Mask::Specks {
            spacing_m: s.get("spacing_m")?,
            radius_m: s.get("radius_m")?,
            seed: s.get("seed")?,
        },
        "weave" => Mask::Weave { pitch_m: s.get("pitch_m")? },
        "facing" => Mask::Facing { axis: direction(s)?, from: s.get("from")?, to: s.get("to")? },
        _ => Mask::Inside {
            shape: Arc::new(s.get::<LuaShape>("shape")?.shape().clone()),
            soft_m: s.get("soft_m")?,
        },
    })
}

/// The looks of a checked asset table, whose shape is `shape`; plain grey all over if it names none.
pub(crate) fn read(lua: &Lua, asset: &Table, shape: &Shape) -> mlua::Result<Vec<Visual>> {
    let needed = usize::from(shape.highest_material()) + 1;
    let visuals: Option<Vec<Table>> = asset.get("visuals")?;
    match visuals.unwrap_or_default().iter().map(visual).collect::<mlua::Result<Vec<_>>>()? {
        none if none.is_empty() => Ok(vec![Visual::default(); needed]),
        visuals if visuals.len() < needed => {
            let (name, count): (String, usize) = (asset.get("name")?, visuals.len());
            let what = format!(
                "asset {name}: visuals: the shape is painted with material {}, expected {needed} looks, got {count}; \
                 the first is that of material 0",
                needed - 1
            );
            Err(fail(lua, what))
        }
        visuals => Ok(visuals),
    }
}

fn visual(table: &Table) -> mlua::Result<Visual> {
    let layers: Option<Vec<Table>> = table.get("layers")?;
    Ok(Visual {
        albedo: table.get("albedo")?,
        roughness: table.get("roughness")?,
        metalness: table.get("metalness")?,
        layers: layers.unwrap_or_default().iter().map(layer).collect::<mlua::Result<_>>()?,
    })
}

fn layer(table: &Table) -> mlua::Result<VisualLayer> {
    Ok(VisualLayer {
        mask: table.get::<Option<LuaMask>>("mask")?.map_or(Mask::Whole, |mask| (*mask.0.mask).clone()),
        albedo: table.get("albedo")?,
        roughness: table.get("roughness")?,
        opacity: table.get("opacity")?,
        relief_m: table.get("relief_m")?,
    })
}
