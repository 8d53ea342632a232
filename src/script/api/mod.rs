//! Everything a script can reach as `softvt.…`, one file per domain. A further function or class is declared in its
//! file and listed here.

pub(crate) mod assets;
pub(crate) mod cameras;
pub(crate) mod envelope;
pub(crate) mod envelope_plot;
pub(crate) mod experiment_input;
pub(crate) mod expert;
pub(crate) mod expert_input;
pub(crate) mod goals;
pub(crate) mod image;
pub(crate) mod joints;
mod mesh_colours;
pub(crate) mod observation;
pub(crate) mod plots;
pub(crate) mod policy;
pub(crate) mod pose;
pub(crate) mod random;
pub(crate) mod scene;
pub(crate) mod scene_names;
pub(crate) mod shapes;
pub(crate) mod simulation;
pub(crate) mod tasks;
pub(crate) mod visuals;
pub(crate) mod world;

use std::collections::BTreeMap;

use mlua::{Lua, Table, Value};

use super::{
    schema::{
        ApiObject, Class, Function, Record, RecordType, Signature, Type, Unchecked, UnusualNumbers,
        ValidationError, check::error_of_caller, function::signature, functions, make,
    },
    vm::{
        list::{LuaList, plain},
        privilege::check_privilege,
        value::{describe, sorted_pairs},
    },
};
use softvt_common::text::unknown_name;
use softvt_scene::SoftMaterial;

/// `softvt.List` for stubs and reference; its behaviour is in [`LuaList`].
static LIST: Class = Class {
    name: LuaList::CLASS,
    doc: "A list that belongs to an object: scene.base, material.albedo, scene.objects. #, [i], ipairs, pairs, table.unpack \
          and table.concat work on it, and it is accepted wherever a list is expected. Numbers of a writable field can be \
          written one by one: scene.base[1] = 0.1 has the effect of scene.base = { 0.1, 0, 0 }. Any other list is read-only.",
    fields: Vec::new,
    methods: &[],
};

/// `softvt.sorted`, which the virtual machine's own Lua code implements.
pub(crate) static SORTED: Signature = signature!(
    ["Iterates over keys and values in an order that does not depend on hashes: numbers, strings, booleans. In a script, "
     "pairs does the same."]
    sorted(t: Table) -> ["fun(): any, any"]
);

functions! {
    FUNCTIONS {
        /// Checks a table that a function of a script takes, and returns it: `softvt.check_fields("pick_place", spec, {
        /// object = "string", speed = "number?" })`. Each key has the name of a Lua type, with ? if it may be absent.
        /// The error is at the line of the file that called the function.
        fn check_fields(
            lua,
            label: String,
            value: Unchecked = Type::Table("table"),
            fields: BTreeMap<String, String>
        ) -> ["table"] {
            let checked = check_fields(lua, &value.0, &fields);
            checked.map_err(|error| error_of_caller(lua, &label, &error))?
        }
    }
}

fn check_fields(
    lua: &Lua,
    value: &Value,
    fields: &BTreeMap<String, String>,
) -> Result<Table, ValidationError> {
    let Value::Table(table) = plain(lua, value)? else {
        return Err(mismatch!("expected a table, got {}", describe(value)));
    };
    for (key, _) in sorted_pairs(&table) {
        if !key.as_string().is_some_and(|key| fields.contains_key(&key.to_string_lossy())) {
            let key = key.to_string()?;
            return Err(ValidationError::new(unknown_name("key", &key, fields.keys().map(String::as_str))));
        }
    }
    for (name, ty) in fields {
        let value: Value = table.raw_get(name.as_str())?;
        let kind = if value.is_integer() { "number" } else { value.type_name() };
        if kind != ty.trim_end_matches('?') && !(value.is_nil() && ty.ends_with('?')) {
            return Err(
                mismatch!("expected a {}, got {}", ty.trim_end_matches('?'), describe(&value)).inside(name)
            );
        }
    }
    Ok(table)
}

pub(crate) fn constructors() -> impl Iterator<Item = &'static Record> {
    [
        tasks::CONSTRUCTORS,
        goals::CONSTRUCTORS,
        assets::CONSTRUCTORS,
        joints::CONSTRUCTORS,
        policy::CONSTRUCTORS,
    ]
    .into_iter()
    .flatten()
    .copied()
}

pub(crate) fn functions() -> impl Iterator<Item = &'static Function> {
    [
        FUNCTIONS,
        goals::FUNCTIONS,
        tasks::FUNCTIONS,
        world::FUNCTIONS,
        assets::FUNCTIONS,
        simulation::FUNCTIONS,
        envelope::FUNCTIONS,
        expert::FUNCTIONS,
        image::FUNCTIONS,
        plots::FUNCTIONS,
        pose::FUNCTIONS,
        scene_names::FUNCTIONS,
        shapes::FUNCTIONS,
    ]
    .into_iter()
    .flatten()
}

/// The index of the one of `names` that is `name`; `label` and `what` name the place and the kind in the error.
fn index_of<'a>(
    lua: &Lua,
    label: &str,
    what: &str,
    names: impl Iterator<Item = &'a str> + Clone,
    name: &str,
) -> mlua::Result<usize> {
    let index = names.clone().position(|known| known == name);
    index.ok_or_else(|| fail!(lua, "{label}: {}", unknown_name(what, name, names)))
}

/// Records of tables that functions of scripts return.
pub(crate) static RETURNED_RECORDS: &[&Record] = &[tasks::FinishSpec::RECORD, policy::ActionSpec::RECORD];

/// Classes of objects and of tables that scripts receive.
pub(crate) static CLASSES: &[&Class] = &[
    shapes::LuaShape::CLASS,
    visuals::LuaMask::CLASS,
    world::LuaWorld::CLASS,
    world::LuaBody::CLASS,
    world::LuaSolid::CLASS,
    world::LuaAttachment::CLASS,
    &world::deformation_table::CLASS,
    simulation::LuaSimulation::CLASS,
    &simulation::measurements::CLASS,
    &simulation::tactile_table::CLASS,
    &world::lying_table::CLASS,
    &envelope::window_end_table::CLASS,
    &envelope::window_table::CLASS,
    &envelope::envelope_table::CLASS,
    &envelope::grip_table::CLASS,
    &envelope::instance_window_table::CLASS,
    &envelope::instance_state::CLASS,
    image::LuaImage::CLASS,
    pose::LuaPose::CLASS,
    random::LuaRng::CLASS,
    scene::LuaScene::CLASS,
    cameras::LuaLight::CLASS,
    cameras::LuaCamera::CLASS,
    visuals::LuaMaterial::CLASS,
    scene::LuaObject::CLASS,
    expert::SceneState::CLASS,
    &expert::object_state::CLASS,
    expert::LuaInstances::CLASS,
    expert::MeasuredArm::CLASS,
    &LIST,
    &observation::task_brief::CLASS,
    observation::LuaObservation::CLASS,
    &observation::fingers::CLASS,
    observation::LuaTactileFrame::CLASS,
    observation::LuaMarkers::CLASS,
    &observation::forces::CLASS,
];

pub(crate) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    for record in constructors() {
        let constructor = lua.create_function(move |lua, value: Value| {
            // A policy that ran the files of assets would learn their materials.
            if record.constructor() == SoftMaterial::RECORD.constructor() {
                check_privilege(lua, "softvt.soft")?;
            }
            make(lua, record, &value)
        })?;
        api.set(record.constructor(), constructor)?;
    }
    functions().try_for_each(|function| function.install(lua, api, "softvt."))?;
    lua.set_app_data(shapes::UnusedShapes::default());
    lua.set_app_data(UnusualNumbers::default());
    lua.set_app_data(envelope::CalibratedAssets::default());
    let shapes = lua.create_table()?;
    shapes::SHAPES.iter().try_for_each(|function| function.install(lua, &shapes, "shape."))?;
    api.set("shape", shapes)?;
    let masks = lua.create_table()?;
    visuals::MASKS.iter().try_for_each(|function| function.install(lua, &masks, "mask."))?;
    api.set("mask", masks)
}
