//! Articulated objects: joints with limits, parts, and the start values of joints.

use std::{collections::BTreeMap, sync::Arc};

use mlua::{Lua, Table, Value};

use super::{
    shapes::LuaShape,
    visuals::{VisualSpec, visuals_of},
};
use crate::{
    geometry::{Pose, Vec3},
    physics::contact::Friction,
    scene::{Asset, Body, Joint, JointMotion, Part, part_poses},
    script::{
        schema::{
            Constructed, Range, Record, RecordType, Type, ValidationError, error_at_key, invalid, make,
            object::LuaConstructor, one_of, record,
        },
        vm::error::fail,
    },
    text::{format_number, unknown_name},
};

record! {
    /// A joint along which a part slides, such as that of a drawer. Values are in m.
    SliderSpec: "softvt.Slider" as "slider", constructor "softvt.slider" {
        /// Direction in which its value grows.
        axis: [f64; 3] = Type::Vector(3, "object frame");
        /// Lowest value.
        lower: f64 = Type::Number("m", Range::ANY);
        /// Highest value, above the lowest.
        upper: f64 = Type::Number("m", Range::ANY);
        /// Viscous damping.
        damping: f64 = Type::Number("N s/m", Range::NOT_NEGATIVE) => Number(0.0);
        /// Dry friction.
        friction: f64 = Type::Number("N", Range::NOT_NEGATIVE) => Number(0.0);
    }
    /// A joint about which a part turns, such as that of a door or a knob. Values are in rad.
    HingeSpec: "softvt.Hinge" as "hinge", constructor "softvt.hinge" {
        /// Axis about which its value grows, right-handed.
        axis: [f64; 3] = Type::Vector(3, "object frame");
        /// A point of the axis, with all joints at 0.
        origin: [f64; 3] = Type::Vector(3, "m, object frame");
        /// Lowest value.
        lower: f64 = Type::Number("rad", Range::ANY);
        /// Highest value, above the lowest.
        upper: f64 = Type::Number("rad", Range::ANY);
        /// Viscous damping.
        damping: f64 = Type::Number("N m s/rad", Range::NOT_NEGATIVE) => Number(0.0);
        /// Dry friction.
        friction: f64 = Type::Number("N m", Range::NOT_NEGATIVE) => Number(0.0);
    }
    /// A part of an articulated object. Parts of one object never touch each other or its base.
    PartSpec: "softvt.Part" as "part" {
        /// Name, unique in the object. A scene names the part cabinet.top_drawer.
        name: String = Type::Name;
        /// Shape with all joints at 0, in the frame of the whole object. Walls must be at least 4 mm thick.
        shape: LuaShape;
        /// Density.
        density: f64 = Type::Number("kg/m³", Range::POSITIVE);
        /// Joint that carries it; axes and origins are in the frame of the whole object.
        joint: JointSpec;
        /// Name of the part that carries it; the fixed base by default.
        parent: Option<String> = Type::Name;
        /// Visuals by material id of its shape, from 0; those of the asset by default.
        visuals: Option<Vec<VisualSpec>>;
        /// Numbers for experts (handle height …).
        hints: Option<BTreeMap<String, f64>>;
    }
    /// Parts on joints. The asset's own shape is their base, which never moves.
    ArticulatedSpec: "softvt.Articulated" as "articulated", constructor "softvt.articulated" {
        /// The parts, in any order.
        parts: Vec<PartSpec>;
    }
}

one_of! {
    /// A joint of a part.
    JointSpec { Slider(SliderSpec), Hinge(HingeSpec) }
}

/// Constructors that check more than single fields.
pub(crate) static CONSTRUCTORS: &[LuaConstructor] = &[
    LuaConstructor::with(ArticulatedSpec::RECORD, make_articulated),
    LuaConstructor::with(SliderSpec::RECORD, make_joint),
    LuaConstructor::with(HingeSpec::RECORD, make_joint),
];

fn make_joint(lua: &Lua, record: &'static Record, value: &Value) -> mlua::Result<Table> {
    if let Value::Table(table) = value {
        for key in ["lower", "upper"] {
            if table.raw_get::<Value>(key)?.is_nil() {
                let message = "missing; every joint needs limits: give lower and upper";
                return Err(invalid(lua, record, key, message));
            }
        }
    }
    let made = make(lua, record, value)?;
    if Vec3::from(made.raw_get::<[f64; 3]>("axis")?).norm() < 1e-9 {
        return Err(invalid(lua, record, "axis", "expected a direction, got one of length 0"));
    }
    let (lower, upper): (f64, f64) = (made.raw_get("lower")?, made.raw_get("upper")?);
    match lower < upper {
        true => Ok(made),
        false => {
            let (lower, upper) = (format_number(lower), format_number(upper));
            Err(invalid(lua, record, "upper", format!("expected more than lower, {lower}, got {upper}")))
        }
    }
}

fn make_articulated(lua: &Lua, record: &'static Record, value: &Value) -> mlua::Result<Table> {
    let made = make(lua, record, value)?;
    let parts: Vec<PartSpec> = made.raw_get("parts")?;
    match order(&parts) {
        Ok(_) => Ok(made),
        Err(message) => Err(invalid(lua, record, "parts", message)),
    }
}

/// Sorts the parts so that each comes after the one that carries it, and returns their indices; or the reason why there is
/// no such order.
fn order(parts: &[PartSpec]) -> Result<Vec<usize>, String> {
    if parts.is_empty() {
        return Err("expected at least one part; without any it is softvt.static {}".into());
    }
    let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
    if let Some(duplicate) = (1..names.len()).find(|&i| names[..i].contains(&names[i])) {
        return Err(format!("there are two parts named {:?}; names must be unique", names[duplicate]));
    }
    let mut parents = Vec::new();
    for part in parts {
        let parent = part.parent.as_deref().map(|parent| {
            names.iter().position(|known| *known == parent).ok_or_else(|| {
                format!(
                    "part {:?}: parent: {}",
                    part.name,
                    unknown_name("part", parent, names.iter().copied())
                )
            })
        });
        parents.push(parent.transpose()?);
    }
    let mut sorted: Vec<usize> = Vec::new();
    while sorted.len() < parts.len() {
        let ready = |&i: &usize| !sorted.contains(&i) && parents[i].is_none_or(|p| sorted.contains(&p));
        match (0..parts.len()).find(ready) {
            Some(next) => sorted.push(next),
            None => {
                let stuck = (0..parts.len()).filter(|i| !sorted.contains(i)).map(|i| names[i]);
                let stuck = stuck.collect::<Vec<_>>().join(", ");
                return Err(format!(
                    "parts {stuck} carry each other in a circle; one must be carried by the base"
                ));
            }
        }
    }
    Ok(sorted)
}

/// The parts of an articulated body. The asset gives their friction and, where a part has none, the visuals.
pub(crate) fn parts(
    lua: &Lua,
    body: &ArticulatedSpec,
    asset_visuals: Option<&[VisualSpec]>,
    friction: Friction,
) -> mlua::Result<Vec<Part>> {
    let mut parts: Vec<Part> = Vec::new();
    for index in order(&body.parts).map_err(|message| fail(lua, message))? {
        let PartSpec { name, shape, density, joint, parent, visuals, hints } = &body.parts[index];
        let shape = shape.copy();
        let asset = Asset {
            name: name.clone(),
            visuals: visuals_of(lua, name, visuals.as_deref().or(asset_visuals), &shape)?,
            shape,
            body: Body::Rigid { density: *density },
            friction,
            hints: hints.clone().unwrap_or_default(),
        };
        parts.push(Part {
            name: name.clone(),
            asset: Arc::new(asset),
            density: *density,
            parent: parent.as_ref().and_then(|parent| parts.iter().position(|part| part.name == *parent)),
            joint: joint.joint(),
        });
    }
    Ok(parts)
}

impl JointSpec {
    fn joint(&self) -> Joint {
        match self {
            Self::Slider(Constructed { spec, .. }) => Joint {
                motion: JointMotion::Slide,
                axis_o: Vec3::from(spec.axis).normalize(),
                origin_o: Vec3::zeros(),
                lower: spec.lower,
                upper: spec.upper,
                damping: spec.damping,
                friction: spec.friction,
            },
            Self::Hinge(Constructed { spec, .. }) => Joint {
                motion: JointMotion::Turn,
                axis_o: Vec3::from(spec.axis).normalize(),
                origin_o: Vec3::from(spec.origin),
                lower: spec.lower,
                upper: spec.upper,
                damping: spec.damping,
                friction: spec.friction,
            },
        }
    }
}

/// Start values of the joints of `asset` as given to `scene:add`, in the order of its parts.
pub(crate) fn start_values(
    lua: &Lua,
    asset: &Asset,
    given: Option<&BTreeMap<String, f64>>,
) -> mlua::Result<Vec<f64>> {
    let parts = asset.parts();
    let mut values: Vec<f64> = parts.iter().map(|part| part.joint.rest()).collect();
    let Some(given) = given else { return Ok(values) };
    let wrong = |path: &[&str], message: String| {
        let path = path.iter().map(|key| (*key).to_owned()).collect();
        error_at_key(lua, "scene:add", &ValidationError { path, message })
    };
    if parts.is_empty() {
        return Err(wrong(&["joints"], format!("asset {} has no joints", asset.name)));
    }
    for (name, value) in given {
        let Some(index) = parts.iter().position(|part| part.name == *name) else {
            let names = parts.iter().map(|part| part.name.as_str());
            return Err(wrong(&["joints"], unknown_name("part", name, names)));
        };
        let joint = &parts[index].joint;
        if !(joint.lower..=joint.upper).contains(value) {
            let (low, high) = (format_number(joint.lower), format_number(joint.upper));
            let message = format!(
                "expected a value in {low}..{high} ({}), got {}",
                joint.unit(),
                format_number(*value)
            );
            return Err(wrong(&["joints", name], message));
        }
        values[index] = *value;
    }
    Ok(values)
}

/// Smallest distance at which a ray meets an articulated object, or only its part `part`. `ray` gets each shape and its
/// frame in that of the object.
pub(crate) fn first_hit(
    asset: &Asset,
    joints: &[f64],
    part: Option<&str>,
    ray: impl Fn(&Asset, &Pose) -> Option<f64>,
) -> Option<f64> {
    let parts = asset.parts();
    let poses = part_poses(parts, joints);
    let base = part.is_none().then(|| ray(asset, &Pose::identity())).flatten();
    let named = parts.iter().zip(&poses).filter(|(p, _)| part.is_none_or(|part| p.name == part));
    named.filter_map(|(p, pose)| ray(&p.asset, pose)).chain(base).min_by(f64::total_cmp)
}
