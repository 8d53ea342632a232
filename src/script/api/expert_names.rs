//! Names of objects and joints that experts use, so that they are checked in every scene before an episode begins.

use std::collections::BTreeMap;

use mlua::{AnyUserData, Function, Lua, Table, Value};

use super::tasks::EXPERT;
use crate::{
    schema::{Type, functions},
    vm::{
        error::{SourceLine, caller_line, fail, fail_at},
        source_map::find_key,
        value::{number, sorted_pairs},
    },
};
use softvt_common::text::{format_number, unknown_name};
use softvt_scene::{Body, Joint, Object, Scene};

/// Registry key of the weak table from experts to [`ExpertNames`].
const NAMES: &str = "softvt expert names";
/// Largest depth of experts within experts.
const MAX_DEPTH: usize = 8;

/// The names that an expert uses.
struct ExpertNames {
    /// Name of the function that made the expert.
    label: String,
    made_at: Option<SourceLine>,
    fields: Vec<NamedField>,
    /// Experts that it runs.
    parts: Vec<Function>,
}

/// A field of the table from which an expert was made.
struct NamedField {
    key: String,
    content: FieldContent,
}

/// What a field names.
enum FieldContent {
    /// An object that can be moved.
    Object(String),
    /// An object or a part of one.
    Place(String),
    /// A part on a joint.
    Joint(String),
    /// A value of a joint, m or rad.
    JointValue { joint: String, value: f64 },
}

/// Kinds of fields that `softvt.check_names` takes; that of a value is followed by the key of its joint.
const OBJECT: &str = "object";
const PLACE: &str = "place";
const JOINT: &str = "joint";
const VALUE_OF: &str = "value of ";

functions! {
    FUNCTIONS {
        /// Has the objects that an expert names checked in every scene in which its task runs, and returns the expert:
        /// `return softvt.check_names("nudge", run, spec, { object = "object" })`. The kinds of the fields of `spec`
        /// are "object" (one that moves), "place" (an object or a part), "joint" (a part, cabinet.top_drawer) and
        /// "value of joint" (a number in the range of the joint that the field `joint` names). Experts in `spec` are
        /// checked as well. softvt check reports a wrong name at the line of the file that called the function which
        /// makes the expert.
        fn check_names(
            lua,
            label: String,
            expert: Function = EXPERT,
            spec: Table = Type::Table("table"),
            kinds: BTreeMap<String, String>
        ) -> ["fun(arm: softvt.Arm, scene: softvt.SceneState)"] {
            let names = ExpertNames::new(lua, label, &spec, &kinds)?;
            registry(lua)?.raw_set(&expert, lua.create_any_userdata(names)?)?;
            expert
        }
    }
}

/// The weak table from experts to their names.
fn registry(lua: &Lua) -> mlua::Result<Table> {
    if let Ok(known) = lua.named_registry_value::<Table>(NAMES) {
        return Ok(known);
    }
    let (known, weak) = (lua.create_table()?, lua.create_table()?);
    weak.set("__mode", "k")?;
    known.set_metatable(Some(weak))?;
    lua.set_named_registry_value(NAMES, &known)?;
    Ok(known)
}

impl ExpertNames {
    fn new(lua: &Lua, label: String, spec: &Table, kinds: &BTreeMap<String, String>) -> mlua::Result<Self> {
        let text = |key: &str| {
            spec.raw_get::<Value>(key).ok()?.as_string().map(|text| text.to_string_lossy().clone())
        };
        let mut fields = Vec::new();
        for (key, kind) in kinds {
            let content = match (kind.as_str(), kind.strip_prefix(VALUE_OF)) {
                (OBJECT, _) => text(key).map(FieldContent::Object),
                (PLACE, _) => text(key).map(FieldContent::Place),
                (JOINT, _) => text(key).map(FieldContent::Joint),
                (_, Some(joint)) => text(joint)
                    .zip(number(&spec.raw_get(key.as_str())?))
                    .map(|(joint, value)| FieldContent::JointValue { joint, value }),
                _ => {
                    let known = [OBJECT, PLACE, JOINT, "value of joint"];
                    let message = unknown_name("kind", kind, known);
                    return Err(fail(lua, format!("softvt.check_names: kinds.{key}: {message}")));
                }
            };
            fields.extend(content.map(|content| NamedField { key: key.clone(), content }));
        }
        let parts = sorted_pairs(spec).into_iter().filter_map(|(_, value)| value.as_function().cloned());
        Ok(Self { label, made_at: caller_line(lua), fields, parts: parts.collect() })
    }
}

/// Checks that a scene has the objects and joints that an expert names. Experts that state none pass.
///
/// # Errors
/// A wrong name, at the line where the expert was made.
pub(crate) fn check_expert(lua: &Lua, expert: &Function, scene: &Scene) -> mlua::Result<()> {
    check_to_depth(lua, expert, scene, MAX_DEPTH)
}

fn check_to_depth(lua: &Lua, expert: &Function, scene: &Scene, depth: usize) -> mlua::Result<()> {
    let Some(names) = registry(lua)?.raw_get::<Option<AnyUserData>>(expert)? else { return Ok(()) };
    let names = names.borrow::<ExpertNames>()?;
    for NamedField { key, content } in &names.fields {
        if let Err(what) = check_content(scene, content) {
            let place = names.made_at.clone().map(|line| find_key(lua, line, &[key]));
            return Err(fail_at(lua, place, format!("{}.{key}: {what}", names.label)));
        }
    }
    match depth {
        0 => Ok(()),
        _ => names.parts.iter().try_for_each(|part| check_to_depth(lua, part, scene, depth - 1)),
    }
}

fn check_content(scene: &Scene, content: &FieldContent) -> Result<(), String> {
    match content {
        FieldContent::Object(name) => movable_object(scene, name),
        FieldContent::Place(name) => {
            let known = scene.names();
            match known.contains(name) {
                true => Ok(()),
                false => Err(unknown_name("object", name, known.iter().map(String::as_str))),
            }
        }
        FieldContent::Joint(name) => joint_range(scene, name).map(drop),
        FieldContent::JointValue { joint, value } => {
            // A wrong name is told of the field of the joint.
            let Ok(range) = joint_range(scene, joint) else { return Ok(()) };
            let [low, high] = range.limits;
            match (low - Joint::TOLERANCE..=high + Joint::TOLERANCE).contains(value) {
                true => Ok(()),
                false => Err(format!(
                    "expected a value of {joint} in {}..{} ({}), got {}",
                    format_number(low),
                    format_number(high),
                    range.unit,
                    format_number(*value)
                )),
            }
        }
    }
}

/// Values of a joint.
pub(crate) struct JointRange {
    /// Lowest and highest value.
    pub limits: [f64; 2],
    /// "m" or "rad".
    pub unit: &'static str,
}

/// The range of the joint of a part such as `cabinet.top_drawer`.
///
/// # Errors
/// A fragment: the scene has no such part.
pub(crate) fn joint_range(scene: &Scene, name: &str) -> Result<JointRange, String> {
    let names = scene.names();
    let parts = names.iter().map(String::as_str).filter(|name| name.contains('.'));
    let (object_name, part_name) = name.split_once('.').unwrap_or((name, ""));
    let object = scene.objects.iter().find(|object| object.name == object_name);
    if let Some(part) =
        object.and_then(|object| object.asset.parts().iter().find(|part| part.name == part_name))
    {
        return Ok(JointRange { limits: [part.joint.lower, part.joint.upper], unit: part.joint.unit() });
    }
    Err(match object {
        Some(object) if object.asset.parts().is_empty() => {
            format!("unknown joint {name:?}; {object_name} has no parts, which softvt.articulated has")
        }
        _ if parts.clone().next().is_none() => {
            format!("unknown joint {name:?}; the scene has no softvt.articulated")
        }
        _ => unknown_name("joint", name, parts),
    })
}

/// Checks that an object exists and can move.
///
/// # Errors
/// A fragment.
pub(crate) fn movable_object(scene: &Scene, name: &str) -> Result<(), String> {
    let moves =
        |object: &&Object| !matches!(object.asset.body, Body::Static | Body::Articulated(_) | Body::Scenery);
    const FIX: &str = "name an object whose body is softvt.soft or softvt.rigid";
    match scene.objects.iter().find(|object| object.name == name) {
        Some(object) if moves(&object) => Ok(()),
        Some(_) => Err(format!("{name:?} never moves; {FIX}")),
        None if scene.names().iter().any(|known| known == name) => {
            let whole = name.split('.').next().unwrap_or(name);
            Err(format!("{name:?} is a part of {whole}, which stays on its joint; {FIX}"))
        }
        None => {
            let known = scene.objects.iter().filter(moves).map(|object| object.name.as_str());
            Err(unknown_name("object", name, known))
        }
    }
}
