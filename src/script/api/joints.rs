//! Articulated objects in Lua: joints with limits, parts, and the values that joints start from.

use std::sync::Arc;

use mlua::{Lua, Table, Value};

use crate::script::{
    api::catalogue_joints::{ARTICULATED, HINGE, SLIDER},
    api::shapes::LuaShape,
    api::visuals,
    schema::{self, Fault, Record, unknown},
    vm::fail,
};
use crate::{
    geometry::Vec3,
    physics::contact::Friction,
    scene::{Asset, Body, Joint, JointMotion, Part, part_poses},
    text::format_number,
};

/// Installs `softvt.slider`, `softvt.hinge` and `softvt.articulated`, which check what no single field can say.
pub(crate) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    for (name, record) in [("slider", &SLIDER), ("hinge", &HINGE)] {
        api.set(name, lua.create_function(move |lua, value: Value| joint_table(lua, record, &value))?)?;
    }
    api.set("articulated", lua.create_function(articulated_table)?)
}

fn at_key(lua: &Lua, record: &Record, key: &str, message: String) -> mlua::Error {
    schema::fault_here(lua, record.label, &Fault { path: vec![key.to_owned()], message })
}

fn joint_table(lua: &Lua, record: &'static Record, value: &Value) -> mlua::Result<Table> {
    if let Value::Table(table) = value {
        for key in ["lower", "upper"] {
            if table.raw_get::<Value>(key)?.is_nil() {
                let message = "missing; every joint needs limits: give lower and upper".to_owned();
                return Err(at_key(lua, record, key, message));
            }
        }
    }
    let made = schema::make(lua, record, value)?;
    if Vec3::from(made.get::<[f64; 3]>("axis")?).norm() < 1e-9 {
        return Err(at_key(lua, record, "axis", "expected a direction, got one of length 0".into()));
    }
    let (lower, upper): (f64, f64) = (made.get("lower")?, made.get("upper")?);
    match lower < upper {
        true => Ok(made),
        false => {
            let message =
                format!("expected more than lower, {}, got {}", format_number(lower), format_number(upper));
            Err(at_key(lua, record, "upper", message))
        }
    }
}

fn articulated_table(lua: &Lua, value: Value) -> mlua::Result<Table> {
    let made = schema::make(lua, &ARTICULATED, &value)?;
    let parts: Vec<Table> = made.get("parts")?;
    order(&parts)?.map(|_| made).map_err(|message| at_key(lua, &ARTICULATED, "parts", message))
}

/// The parts so that each comes after the one that carries it, as indices; or why there is no such order.
fn order(parts: &[Table]) -> mlua::Result<Result<Vec<usize>, String>> {
    if parts.is_empty() {
        return Ok(Err("expected at least one part; without any it is softvt.static {}".into()));
    }
    let names: Vec<String> = parts.iter().map(|part| part.get("name")).collect::<mlua::Result<_>>()?;
    if let Some(twice) = (1..names.len()).find(|&i| names[..i].contains(&names[i])) {
        return Ok(Err(format!("there are two parts named {:?}; names must be unique", names[twice])));
    }
    let mut parents = Vec::new();
    for (part, name) in parts.iter().zip(&names) {
        let parent: Option<String> = part.get("parent")?;
        parents.push(match parent {
            None => None,
            Some(parent) => match names.iter().position(|known| *known == parent) {
                Some(index) => Some(index),
                None => {
                    let known = names.iter().map(String::as_str);
                    return Ok(Err(format!("part {name:?}: parent: {}", unknown("part", &parent, known))));
                }
            },
        });
    }
    let mut sorted: Vec<usize> = Vec::new();
    while sorted.len() < parts.len() {
        let ready = |&i: &usize| !sorted.contains(&i) && parents[i].is_none_or(|p| sorted.contains(&p));
        match (0..parts.len()).find(ready) {
            Some(next) => sorted.push(next),
            None => {
                let stuck: Vec<_> =
                    (0..parts.len()).filter(|i| !sorted.contains(i)).map(|i| names[i].as_str()).collect();
                let who = stuck.join(", ");
                return Ok(Err(format!(
                    "parts {who} carry each other in a circle; one must hang on the base"
                )));
            }
        }
    }
    Ok(Ok(sorted))
}

/// The parts of a checked articulated body; `asset` gives friction and, where a part has none, looks.
pub(crate) fn read(lua: &Lua, asset: &Table, body: &Table, friction: Friction) -> mlua::Result<Vec<Part>> {
    let tables: Vec<Table> = body.get("parts")?;
    let sorted = order(&tables)?.map_err(|message| fail(lua, message))?;
    let mut parts: Vec<Part> = Vec::new();
    for index in sorted {
        let table = &tables[index];
        let shape = table.get::<LuaShape>("shape")?.shape().clone();
        let (name, density): (String, f64) = (table.get("name")?, table.get("density")?);
        let own = !table.get::<Value>("visuals")?.is_nil();
        let parent: Option<String> = table.get("parent")?;
        let asset = Asset {
            name: name.clone(),
            visuals: visuals::read(lua, if own { table } else { asset }, &shape)?,
            shape,
            body: Body::Rigid { density },
            friction,
            hints: table.get::<Option<_>>("hints")?.unwrap_or_default(),
        };
        parts.push(Part {
            name,
            asset: Arc::new(asset),
            density,
            parent: parent.and_then(|parent| parts.iter().position(|part| part.name == parent)),
            joint: joint(lua, &table.get("joint")?)?,
        });
    }
    Ok(parts)
}

fn joint(lua: &Lua, table: &Table) -> mlua::Result<Joint> {
    let turns = schema::is_made(lua, &HINGE, table);
    let origin: [f64; 3] = if turns { table.get("origin")? } else { [0.0; 3] };
    Ok(Joint {
        motion: if turns { JointMotion::Turn } else { JointMotion::Slide },
        axis_o: Vec3::from(table.get::<[f64; 3]>("axis")?).normalize(),
        origin_o: Vec3::from(origin),
        lower: table.get("lower")?,
        upper: table.get("upper")?,
        damping: table.get("damping")?,
        friction: table.get("friction")?,
    })
}

/// Start values of the joints of `asset` as `scene:add` was given them, in the order of its parts.
pub(crate) fn start(lua: &Lua, asset: &Asset, given: Option<Table>) -> mlua::Result<Vec<f64>> {
    let parts = asset.parts();
    let mut values: Vec<f64> = parts.iter().map(|part| part.joint.rest()).collect();
    let Some(given) = given else { return Ok(values) };
    let wrong = |path: &[&str], message: String| {
        let path = path.iter().map(|key| (*key).to_owned()).collect();
        schema::fault_here(lua, "scene:add", &Fault { path, message })
    };
    if parts.is_empty() {
        return Err(wrong(&["joints"], format!("asset {} has no joints", asset.name)));
    }
    for (key, value) in schema::sorted_pairs(&given) {
        let (name, value) = (key.to_string()?, schema::number(&value).unwrap_or(f64::NAN));
        let Some(index) = parts.iter().position(|part| part.name == name) else {
            let names = parts.iter().map(|part| part.name.as_str());
            return Err(wrong(&["joints"], unknown("part", &name, names)));
        };
        let joint = &parts[index].joint;
        if !(joint.lower..=joint.upper).contains(&value) {
            let (low, high) = (format_number(joint.lower), format_number(joint.upper));
            let message =
                format!("expected a value in {low}..{high} ({}), got {}", joint.unit(), format_number(value));
            return Err(wrong(&["joints", &name], message));
        }
        values[index] = value;
    }
    Ok(values)
}

/// Where a downward ray meets an articulated object, or the part of it that `part` names: the least of what `ray` gives
/// for a shape and its frame in that of the object.
pub(crate) fn first_hit(
    asset: &Asset,
    joints: &[f64],
    part: Option<&str>,
    ray: impl Fn(&Asset, &crate::geometry::Pose) -> Option<f64>,
) -> Option<f64> {
    let parts = asset.parts();
    let poses = part_poses(parts, joints);
    let base = part.is_none().then(|| ray(asset, &crate::geometry::Pose::identity())).flatten();
    let wanted = parts.iter().zip(&poses).filter(|(p, _)| part.is_none_or(|part| p.name == part));
    wanted.filter_map(|(p, pose)| ray(&p.asset, pose)).chain(base).min_by(f64::total_cmp)
}
