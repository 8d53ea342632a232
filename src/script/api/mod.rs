//! Everything a script can reach as `softvt.…`, one file per domain. A further function or class is declared in its file
//! and listed here.

pub(crate) mod assets;
pub(crate) mod cameras;
pub(crate) mod envelope;
pub(crate) mod expert;
pub(crate) mod expert_input;
pub(crate) mod image;
pub(crate) mod joints;
pub(crate) mod observation;
pub(crate) mod policy;
pub(crate) mod pose;
pub(crate) mod random;
pub(crate) mod scene;
pub(crate) mod shapes;
pub(crate) mod simulation;
pub(crate) mod tasks;
pub(crate) mod touch;
pub(crate) mod visuals;
pub(crate) mod world;

use mlua::{Lua, Table};

use super::{
    schema::{
        ApiObject, Class, Function, Record, RecordType, Signature,
        object::{LuaConstructor, signature},
    },
    vm::list::LuaList,
};

/// `softvt.List` for stubs and reference; its behaviour is in [`LuaList`].
static LIST: Class = Class {
    name: LuaList::CLASS,
    doc: "A list that belongs to an object: scene.base, material.albedo, scene.objects. #, [i], ipairs, pairs, table.unpack \
          and table.concat work on it, and it is accepted wherever a list is expected. Numbers of a writable field can be \
          written one by one: scene.base[1] = 0.1 has the effect of scene.base = { 0.1, 0, 0 }. Any other list is read-only.",
    fields: &[],
    methods: &[],
};

/// `softvt.sorted`, which the virtual machine's own Lua code implements.
pub(crate) static SORTED: Signature = signature!(
    ["Iterates over keys and values in an order that does not depend on hashes: numbers, strings, booleans. In a script, "
     "pairs does the same."]
    sorted(t: Table) -> ["fun(): any, any"]
);

/// Constructors `softvt.name{…}`.
pub(crate) fn constructors() -> impl Iterator<Item = &'static LuaConstructor> {
    [tasks::CONSTRUCTORS, assets::CONSTRUCTORS, joints::CONSTRUCTORS, policy::CONSTRUCTORS]
        .into_iter()
        .flatten()
}

/// Functions `softvt.name(…)`.
pub(crate) fn functions() -> impl Iterator<Item = &'static Function> {
    [
        tasks::FUNCTIONS,
        world::FUNCTIONS,
        simulation::FUNCTIONS,
        envelope::FUNCTIONS,
        image::FUNCTIONS,
        pose::FUNCTIONS,
        shapes::FUNCTIONS,
    ]
    .into_iter()
    .flatten()
}

/// Records that are neither made by a constructor nor taken as the only argument of a function or method.
pub(crate) static NESTED_RECORDS: &[&Record] = &[
    assets::FrictionSpec::RECORD,
    joints::PartSpec::RECORD,
    visuals::VisualSpec::RECORD,
    visuals::LayerSpec::RECORD,
    shapes::MaskSpec::RECORD,
    tasks::LayoutSpec::RECORD,
    tasks::ConditionSpec::RECORD,
    tasks::FinishSpec::RECORD,
    expert::ClearanceSpec::RECORD,
    image::TextSpec::RECORD,
    policy::ObservesSpec::RECORD,
    policy::ActionSpec::RECORD,
    policy::InputSpec::RECORD,
    policy::ActionEncodingSpec::RECORD,
    policy::GripperValuesSpec::RECORD,
];

/// Classes of objects and of tables that scripts receive.
pub(crate) static CLASSES: &[&Class] = &[
    shapes::LuaShape::CLASS,
    visuals::LuaMask::CLASS,
    world::LuaWorld::CLASS,
    world::LuaBody::CLASS,
    world::LuaSolid::CLASS,
    &world::deformation_table::CLASS,
    simulation::LuaSimulation::CLASS,
    &simulation::measurements::CLASS,
    &simulation::tactile_table::CLASS,
    &envelope::envelope_table::CLASS,
    image::LuaImage::CLASS,
    pose::LuaPose::CLASS,
    random::LuaRng::CLASS,
    scene::LuaScene::CLASS,
    cameras::LuaLight::CLASS,
    cameras::LuaCamera::CLASS,
    visuals::LuaMaterial::CLASS,
    scene::LuaObject::CLASS,
    expert::LuaView::CLASS,
    &expert::object_state::CLASS,
    expert::MeasuredArm::CLASS,
    &LIST,
    &observation::task_brief::CLASS,
    observation::LuaObservation::CLASS,
    &touch::fingers::CLASS,
    touch::LuaTouch::CLASS,
    touch::LuaMarkers::CLASS,
    &observation::forces::CLASS,
];

/// Adds everything to the table `softvt`.
pub(crate) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    constructors().try_for_each(|constructor| constructor.install(lua, api))?;
    functions().try_for_each(|function| function.install(lua, api, "softvt."))?;
    for (name, functions) in [("shape", shapes::SHAPES), ("mask", visuals::MASKS)] {
        let table = lua.create_table()?;
        functions.iter().try_for_each(|function| function.install(lua, &table, "softvt."))?;
        api.set(name, table)?;
    }
    Ok(())
}
