//! Articulated objects: joints with limits, parts, and the start values of joints.

use std::{collections::BTreeMap, sync::Arc};

use mlua::{Lua, Table};

use super::{assets::DENSITY, pose::ANGLES, shapes::LuaShape, visuals::visuals_of};
use crate::{
    schema::{LuaType, Range, Record, RecordType, Type, ValidationError, error_at_key, one_of, record},
    vm::error::fail,
};
use softvt_common::text::unknown_name;
use softvt_geometry::{Pose, Vec3};
use softvt_physics::contact::Friction;
use softvt_scene::{Asset, Body, Joint, JointMotion, MovingPart, Visual, part_poses};

const TRAVEL: Type = Type::Number("m", Range::ANY.usually(-2.0, 2.0));

record! {
    /// A joint along which a part slides, such as that of a drawer. Values are in m.
    SliderSpec: "softvt.Slider" as "slider", constructor "softvt.slider", relation Increasing(&["lower", "upper"]) {
        /// Direction in which its value grows.
        axis: [f64; 3] = Type::Direction(&[], "object frame");
        /// Lowest value of the joint.
        lower: f64 = TRAVEL;
        /// Highest value, above the lowest.
        upper: f64 = TRAVEL;
        /// Viscous damping of the joint.
        damping: f64 = Type::Number("N s/m", Range::NOT_NEGATIVE.usually(0.0, 1000.0)) => Number(0.0);
        /// Dry friction of the joint.
        friction: f64 = Type::Number("N", Range::NOT_NEGATIVE.usually(0.0, 100.0)) => Number(0.0);
    }
    /// A joint about which a part turns, such as that of a door or a knob. Values are in rad.
    HingeSpec: "softvt.Hinge" as "hinge", constructor "softvt.hinge", relation Increasing(&["lower", "upper"]) {
        /// Axis about which its value grows, right-handed.
        axis: [f64; 3] = Type::Direction(&[], "object frame");
        /// A point of the axis, with all joints at 0.
        origin: [f64; 3] = Type::Vector(3, "m, object frame", Range::ANY.usually(-2.0, 2.0));
        /// Lowest value of the joint.
        lower: f64 = Type::Number("rad", ANGLES);
        /// Highest value, above the lowest.
        upper: f64 = Type::Number("rad", ANGLES);
        /// Viscous damping of the joint.
        damping: f64 = Type::Number("N m s/rad", Range::NOT_NEGATIVE.usually(0.0, 30.0)) => Number(0.0);
        /// Dry friction of the joint.
        friction: f64 = Type::Number("N m", Range::NOT_NEGATIVE.usually(0.0, 20.0)) => Number(0.0);
    }
    /// A part of an articulated object. Parts of one object never touch each other or its base.
    PartSpec: "softvt.Part" as "part" {
        /// Name, unique in the object. A scene names the part cabinet.top_drawer.
        name: String = Type::Name;
        /// Shape with all joints at 0, in the frame of the whole object. Walls must be at least 4 mm thick.
        shape: LuaShape;
        /// Density of the part.
        density: f64 = DENSITY;
        /// Joint that carries it; axes and origins are in the frame of the whole object.
        joint: JointSpec;
        /// Name of the part that carries it; the fixed base by default.
        parent: Option<String> = Type::Name;
        /// Visuals by material id of its shape, from 0; those of the asset by default.
        visuals: Vec<Visual> => Empty;
        /// Numbers for experts (handle height …).
        hints: BTreeMap<String, f64> => Empty;
    }
    /// Parts on joints. The asset's own shape is their base, which never moves.
    ArticulatedSpec: "softvt.Articulated" as "articulated", constructor "softvt.articulated", relation Checked(check_parts) {
        /// The parts, in any order.
        parts: Vec<PartSpec> = Type::Distinct { of: PartSpec::REFERENCE, by: "name", min: 1 };
    }
}

one_of! {
    /// A joint of a part.
    JointSpec { Slider(SliderSpec), Hinge(HingeSpec) }
}

pub(crate) static CONSTRUCTORS: &[&Record] =
    &[ArticulatedSpec::RECORD, SliderSpec::RECORD, HingeSpec::RECORD];

fn check_parts(lua: &Lua, body: &Table) -> Result<(), ValidationError> {
    let parts = Vec::<PartSpec>::from_checked(body.raw_get("parts")?, lua)?;
    order(&parts).map(drop).map_err(|error| error.inside("parts"))
}

/// Sorts the parts so that each comes after the one that carries it, and returns their indices.
fn order(parts: &[PartSpec]) -> Result<Vec<usize>, ValidationError> {
    let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
    let index_of = |parent: &String| names.iter().position(|name| name == parent);
    for PartSpec { name, parent, .. } in parts {
        if let Some(parent) = parent.as_ref().filter(|parent| index_of(parent).is_none()) {
            let message = unknown_name("part", parent, names.iter().copied());
            return Err(mismatch!("part {name:?}: parent: {message}"));
        }
    }
    let mut sorted: Vec<usize> = Vec::new();
    while sorted.len() < parts.len() {
        let is_ready = |i: &usize| {
            let parent = parts[*i].parent.as_ref().and_then(index_of);
            !sorted.contains(i) && parent.is_none_or(|parent| sorted.contains(&parent))
        };
        let Some(next) = (0..parts.len()).find(is_ready) else {
            let stuck = (0..parts.len()).filter(|i| !sorted.contains(i)).map(|i| names[i]);
            let stuck = stuck.collect::<Vec<_>>().join(", ");
            return Err(mismatch!("parts {stuck} carry each other in a circle"));
        };
        sorted.push(next);
    }
    Ok(sorted)
}

/// The parts of an articulated body. The asset gives their friction and, where a part has none, the visuals.
pub(crate) fn parts(
    lua: &Lua,
    body: &ArticulatedSpec,
    asset_visuals: &[Visual],
    friction: Friction,
) -> mlua::Result<Vec<MovingPart>> {
    let mut parts: Vec<MovingPart> = Vec::new();
    for index in order(&body.parts).map_err(|error| fail(lua, error.describe("articulated")))? {
        let PartSpec { name, shape, density, joint, parent, visuals, hints } = &body.parts[index];
        let visuals = if visuals.is_empty() { asset_visuals } else { visuals };
        let asset = Asset {
            name: name.clone(),
            visuals: visuals_of(lua, name, visuals, shape)?,
            shape: shape.copy(),
            body: Body::Rigid { density: *density },
            friction,
            hints: hints.clone(),
        };
        parts.push(MovingPart {
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
        macro_rules! joint {
            ($spec:ident, $motion:ident, $origin:expr) => {
                Joint {
                    motion: JointMotion::$motion,
                    axis_o: Vec3::from($spec.axis).normalize(),
                    origin_o: $origin,
                    lower: $spec.lower,
                    upper: $spec.upper,
                    damping: $spec.damping,
                    friction: $spec.friction,
                }
            };
        }
        match self {
            Self::Slider(slider) => joint!(slider, Slide, Vec3::zeros()),
            Self::Hinge(hinge) => joint!(hinge, Turn, Vec3::from(hinge.origin)),
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
    let wrong = |error: ValidationError| error_at_key(lua, "scene:add", &error.inside("joints"));
    if parts.is_empty() {
        return Err(wrong(mismatch!("asset {} has no joints", asset.name)));
    }
    for (name, value) in given {
        let Some(index) = parts.iter().position(|part| part.name == *name) else {
            let names = parts.iter().map(|part| part.name.as_str());
            return Err(wrong(ValidationError::new(unknown_name("part", name, names))));
        };
        let joint = &parts[index].joint;
        let range = Range::closed(joint.lower, joint.upper);
        if !range.contains(*value) {
            let (expected, got) = (range.expected("a value", joint.unit()), range.show_outside(*value));
            return Err(wrong(mismatch!("expected {expected}, got {got}").inside(name)));
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
