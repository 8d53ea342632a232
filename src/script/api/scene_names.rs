//! Names of objects and joints in a scene: those of goals, and those of experts, which are checked in every scene
//! before an episode begins.

use std::collections::BTreeMap;

use mlua::{AnyUserData, Function, Lua, Table, Value};

use super::tasks::EXPERT;
use crate::{
    schema::{Type, functions},
    vm::{
        error::{SourceLine, caller_line, fail_at},
        source_map::find_key,
        value::{number, sorted_pairs},
        weak_table,
    },
};
use softvt_common::{range::Range, text::unknown_name};
use softvt_scene::{Body, Joint, Object, Scene};

/// Registry key of the weak table from experts to [`ExpertNames`].
const NAMES: &str = "softvt expert names";
/// Largest depth of experts within experts.
const MAX_DEPTH: usize = 8;

/// The table from which an expert was made, in which it names objects and joints.
struct ExpertNames {
    label: String,
    made_at: Option<SourceLine>,
    spec: Table,
    kinds: BTreeMap<String, String>,
}

functions! {
    FUNCTIONS {
        /// Has the objects that an expert names checked in every scene in which its task runs, and returns the expert:
        /// `return softvt.check_names("nudge", run, spec, { object = "object" })`. The kinds of the fields of `spec`
        /// are "object" (one that moves), "place" (an object or a part), "joint" (a part, cabinet.top_drawer) and
        /// "value of joint" (a number in the range of the joint that the field `joint` names). Experts in `spec`
        /// are checked as well. softvt check reports a wrong name at the line of the file that called the function
        /// which makes the expert.
        fn check_names(
            lua,
            label: String,
            expert: Function = EXPERT,
            spec: Table = Type::Table("table"),
            kinds: BTreeMap<String, String> = Type::Map(&Type::Choice(&["object", "place", "joint", "value of joint"]))
        ) -> ["fun(arm: softvt.Arm, scene: softvt.SceneState)"] {
            let names = ExpertNames { label, made_at: caller_line(lua), spec, kinds };
            weak_table(lua, NAMES)?.raw_set(&expert, lua.create_any_userdata(names)?)?;
            expert
        }
    }
}

/// Checks that a scene has the objects and joints that an expert names. Experts that state none pass.
pub(crate) fn check_expert(lua: &Lua, expert: &Function, scene: &Scene) -> mlua::Result<()> {
    check_to_depth(lua, expert, scene, MAX_DEPTH)
}

fn check_to_depth(lua: &Lua, expert: &Function, scene: &Scene, depth: usize) -> mlua::Result<()> {
    let Some(names) = weak_table(lua, NAMES)?.raw_get::<Option<AnyUserData>>(expert)? else { return Ok(()) };
    let ExpertNames { label, made_at, spec, kinds } = &*names.borrow::<ExpertNames>()?;
    let text = |key: &str| Some(spec.raw_get::<Value>(key).ok()?.as_string()?.to_string_lossy());
    for (key, kind) in kinds {
        let checked = match (kind.as_str(), text(key)) {
            ("object", Some(name)) => movable_object(scene, &name),
            ("place", Some(name)) => place(scene, &name),
            ("joint", Some(name)) => joint(scene, &name).map(drop),
            ("value of joint", _) => match (text("joint"), number(&spec.raw_get(key.as_str())?)) {
                (Some(name), Some(value)) => joint_value(scene, &name, value),
                _ => Ok(()),
            },
            _ => Ok(()),
        };
        if let Err(what) = checked {
            let place = made_at.clone().map(|line| find_key(lua, line, &[key]));
            return Err(fail_at(lua, place, format_args!("{label}.{key}: {what}")));
        }
    }
    let mut parts = sorted_pairs(spec).into_iter().filter_map(|(_, value)| value.as_function().cloned());
    if depth == 0 { Ok(()) } else { parts.try_for_each(|part| check_to_depth(lua, &part, scene, depth - 1)) }
}

/// Checks a value of a joint. A wrong name is an error of the field with the name.
fn joint_value(scene: &Scene, name: &str, value: f64) -> Result<(), String> {
    let Ok(joint) = joint(scene, name) else { return Ok(()) };
    let range = Range::closed(joint.lower - Joint::TOLERANCE, joint.upper + Joint::TOLERANCE);
    match range.contains(value) {
        true => Ok(()),
        false => {
            let expected =
                Range::closed(joint.lower, joint.upper).expected(&format!("a value of {name}"), joint.unit());
            Err(format!("expected {expected}, got {}", range.show_outside(value)))
        }
    }
}

/// The joint of a part such as `cabinet.top_drawer`.
/// The error is a fragment.
pub(crate) fn joint<'a>(scene: &'a Scene, name: &str) -> Result<&'a Joint, String> {
    let names = scene.names();
    let parts = names.iter().map(String::as_str).filter(|name| name.contains('.'));
    let (object_name, part_name) = name.split_once('.').unwrap_or((name, ""));
    let object = scene.objects.iter().find(|object| object.name == object_name);
    let part = object.and_then(|object| object.asset.parts().iter().find(|part| part.name == part_name));
    part.map(|part| &part.joint).ok_or_else(|| match object {
        Some(object) if object.asset.parts().is_empty() => {
            format!("unknown joint {name:?}; {object_name} has no parts, which softvt.articulated has")
        }
        _ if parts.clone().next().is_none() => {
            format!("unknown joint {name:?}; the scene has no softvt.articulated")
        }
        _ => unknown_name("joint", name, parts),
    })
}

/// Checks that a scene has an object, or a part of one.
fn place(scene: &Scene, name: &str) -> Result<(), String> {
    let known = scene.names();
    match known.iter().any(|known| known == name) {
        true => Ok(()),
        false => Err(unknown_name("object", name, known.iter().map(String::as_str))),
    }
}

/// Checks that a scene has an object, or a part of one, that others can touch.
pub(crate) fn touchable(scene: &Scene, name: &str) -> Result<(), String> {
    place(scene, name)?;
    match scene.objects.iter().find(|object| object.name == name).map(|object| &object.asset.body) {
        Some(Body::Scenery) => {
            Err(format!("{name:?} is softvt.scenery, which has no contact; name an object that has"))
        }
        _ => Ok(()),
    }
}

pub(crate) fn movable_object(scene: &Scene, name: &str) -> Result<(), String> {
    let moves =
        |object: &&Object| !matches!(object.asset.body, Body::Static | Body::Articulated(_) | Body::Scenery);
    const FIX: &str = "name an object whose body is softvt.soft or softvt.rigid";
    match scene.objects.iter().find(|object| object.name == name) {
        Some(object) if moves(&object) => Ok(()),
        Some(_) => Err(format!("{name:?} never moves; {FIX}")),
        None if place(scene, name).is_ok() => {
            let whole = name.split('.').next().unwrap_or(name);
            Err(format!("{name:?} is a part of {whole}, which stays on its joint; {FIX}"))
        }
        None => {
            let known = scene.objects.iter().filter(moves).map(|object| object.name.as_str());
            Err(unknown_name("object", name, known))
        }
    }
}
