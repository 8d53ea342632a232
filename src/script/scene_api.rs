//! The scene that layouts and shifts change.

use std::sync::{Arc, Mutex};

use mlua::{Lua, MetaMethod, Table, UserData, UserDataFields, UserDataMethods, Value};

use super::{
    articulated, catalogue,
    catalogue_joints::ARTICULATED,
    sandbox::{fail, here, locked},
    schema::{self, Fault, Field, Presence, Range, Type, unknown},
    shapes::LuaShape,
    view_api::{LuaCamera, LuaLight, LuaLook},
};
use crate::{
    geometry::{Pose, Quat, Vec3},
    scene::{Asset, Body, Camera, Friction, Lighting, Object, Region, Scene, SoftMaterial},
};

pub(super) const fn field(name: &'static str, ty: Type, doc: &'static str) -> Field {
    Field { name, ty, presence: Presence::Required, doc }
}

/// Fields of a scene that scripts may read and write.
pub(super) static SCENE: &[Field] = &[
    field("base", Type::Vector(3, "m, world"), "Place of the robot base."),
    field("start_q", Type::Vector(7, "rad"), "Joint angles of the arm at the start."),
    field("gravity", Type::Vector(3, "m/s², world"), "Gravity."),
    field("workspace_min", Type::Vector(3, "m, world"), "Lowest corner of the workspace."),
    field("workspace_max", Type::Vector(3, "m, world"), "Highest corner of the workspace."),
];

/// Fields of a placed object that scripts may read and write; those of soft bodies are nil for others.
pub(super) static OBJECT: &[Field] = &[
    field("xyz", Type::Vector(3, "m, world"), "Its origin: lowest point, on the centre line."),
    field("yaw", Type::Number("rad", Range::ANY), "Turn about the vertical."),
    field("density", Type::Number("kg/m³", Range::POSITIVE), "Density of a soft or rigid body."),
    field("youngs_pa", Type::Number("Pa", Range::POSITIVE), "Young's modulus of a soft body."),
    field("poisson", Type::Number("", Range::below(0.0, 0.5)), "Poisson's ratio of a soft body."),
    field("static_mu", Type::Number("", Range::closed(0.0, 10.0)), "Static friction coefficient."),
    field("dynamic_mu", Type::Number("", Range::closed(0.0, 10.0)), "Dynamic friction coefficient."),
];

/// Start pose of the arm as in SoftVTBench (facts of the released code): the hand over the table, pointing down.
const START_Q: [f64; 7] = [-0.01988, -0.18734, 0.00767, -2.40340, 0.00496, 2.24534, 0.79485];

/// A scene with nothing in it: robot base of the table scenes, workspace of the table.
pub(super) fn empty_scene() -> Scene {
    Scene {
        objects: Vec::new(),
        base_w: Pose::translation(-0.66, 0.0, 0.012),
        start_q: START_Q,
        gravity: Vec3::new(0.0, 0.0, -9.81),
        workspace: Region { min: Vec3::new(-0.5, -0.6, -0.05), max: Vec3::new(0.5, 0.6, 1.0) },
        lighting: Lighting::default(),
        cameras: vec![Camera::third_person_table(), Camera::wrist()],
    }
}

/// An asset's Lua table and what was read from it.
type Known = (Table, Arc<Asset>);

/// `softvt.Scene`.
#[derive(Clone)]
pub(super) struct LuaScene {
    pub scene: Arc<Mutex<Scene>>,
    /// Assets by the address of their Lua table, which the scene keeps alive: two objects of one asset share it.
    assets: Arc<Mutex<Vec<Known>>>,
}

impl LuaScene {
    pub fn new(scene: Scene) -> Self {
        Self { scene: Arc::new(Mutex::new(scene)), assets: Arc::default() }
    }

    fn asset(&self, lua: &Lua, table: &Table) -> mlua::Result<Arc<Asset>> {
        let mut assets = locked(&self.assets);
        if let Some((_, asset)) = assets.iter().find(|(known, _)| known.to_pointer() == table.to_pointer()) {
            return Ok(asset.clone());
        }
        let asset = Arc::new(read_asset(lua, table)?);
        assets.push((table.clone(), asset.clone()));
        Ok(asset)
    }

    fn add(&self, lua: &Lua, value: &Value) -> mlua::Result<()> {
        let Value::Table(table) = value else {
            return Err(fail(lua, format!("scene:add: expected a table, got {}", schema::got(value))));
        };
        let place = schema::check(lua, &catalogue::PLACE, table)
            .map_err(|fault| schema::fault_here(lua, "scene:add", &fault))?;
        let name: String = place.get("name")?;
        let asset = self.asset(lua, &place.get("asset")?)?;
        let mut scene = locked(&self.scene);
        if scene.objects.iter().any(|object| object.name == name) {
            return Err(fail(
                lua,
                format!("scene:add: there is an object {name:?} already; give another name"),
            ));
        }
        let at = position(lua, &scene, &place)?;
        let turn = Quat::from_axis_angle(&Vec3::z_axis(), place.get("yaw")?);
        let joints = articulated::start(lua, &asset, place.get("joints")?)?;
        let placed_at = here(lua).map_or(String::new(), |(file, line)| format!("{file}:{line}"));
        let pose_w = Pose::from_parts(at.into(), turn);
        scene.objects.push(Object { name, asset, pose_w, joints, placed_at });
        Ok(())
    }
}

fn position(lua: &Lua, scene: &Scene, place: &Table) -> mlua::Result<Vec3> {
    let at: Option<[f64; 2]> = place.get("at")?;
    let xyz: Option<[f64; 3]> = place.get("xyz")?;
    let on: Option<String> = place.get("on")?;
    match (at, xyz, on) {
        (None, Some(xyz), None) => Ok(Vec3::from(xyz)),
        (Some([x, y]), None, None) => Ok(Vec3::new(x, y, 0.0)),
        (Some([x, y]), None, Some(on)) => {
            let (object, part) = on.split_once('.').map_or((on.as_str(), None), |(o, p)| (o, Some(p)));
            let under = &scene.objects[find(lua, scene, object)?];
            let parts = under.asset.parts().iter().map(|part| part.name.as_str());
            if let Some(part) = part.filter(|part| !parts.clone().any(|known| known == *part)) {
                let message = format!("scene:add: on: object {object:?}: {}", unknown("part", part, parts));
                return Err(fail(lua, message));
            }
            Ok(Vec3::new(x, y, top(under, part, x, y).unwrap_or(0.0)))
        }
        _ => Err(fail(lua, "scene:add: give either at = { x, y } (with or without on) or xyz = { x, y, z }")),
    }
}

/// Height of the surface of an object, or of one of its parts, over the table at (x, y), m.
fn top(object: &Object, part: Option<&str>, x: f64, y: f64) -> Option<f64> {
    const ABOVE: f64 = 2.0;
    let length = articulated::first_hit(&object.asset, &object.joints, part, |asset, pose| {
        let pose_w = object.pose_w * pose;
        let start = pose_w.inverse_transform_point(&nalgebra::Point3::new(x, y, ABOVE)).coords;
        let down = pose_w.rotation.inverse_transform_vector(&-Vec3::z());
        asset.shape.ray(&start, &down, 2.0 * ABOVE)
    });
    length.map(|length| ABOVE - length)
}

fn find(lua: &Lua, scene: &Scene, name: &str) -> mlua::Result<usize> {
    let names = scene.objects.iter().map(|object| object.name.as_str());
    let index = scene.objects.iter().position(|object| object.name == name);
    index.ok_or_else(|| fail(lua, format!("scene: {}", unknown("object", name, names))))
}

fn read_asset(lua: &Lua, table: &Table) -> mlua::Result<Asset> {
    let friction: Table = table.get("friction")?;
    let friction =
        Friction { static_mu: friction.get("static_mu")?, dynamic_mu: friction.get("dynamic_mu")? };
    let body: Table = table.get("body")?;
    let kind: String = body.metatable().map_or(Ok(String::new()), |meta| meta.get("__name"))?;
    let body = match kind.as_str() {
        kind if kind == catalogue::SOFT.kind => Body::Soft(SoftMaterial {
            youngs_pa: body.get("youngs_pa")?,
            poisson: body.get("poisson")?,
            density: body.get("density")?,
            resolution: body.get("resolution")?,
            grasp_spacing: body.get("grasp_spacing")?,
        }),
        kind if kind == catalogue::RIGID.kind => Body::Rigid { density: body.get("density")? },
        kind if kind == ARTICULATED.kind => {
            Body::Articulated(articulated::read(lua, table, &body, friction)?)
        }
        kind if kind == catalogue::SCENERY.kind => Body::Scenery,
        _ => Body::Static,
    };
    let LuaShape(shape) = table.get("shape")?;
    Ok(Asset {
        name: table.get("name")?,
        visuals: super::visuals::read(lua, table, &shape)?,
        shape,
        body,
        friction,
        hints: table.get::<Option<_>>("hints")?.unwrap_or_default(),
    })
}

pub(super) fn numbers(lua: &Lua, values: &[f64]) -> mlua::Result<Value> {
    lua.create_sequence_from(values.iter().copied()).map(Value::Table)
}

/// The value to store, or an error that names the key.
pub(super) fn checked(
    lua: &Lua,
    label: &str,
    fields: &[Field],
    key: &str,
    value: &Value,
) -> mlua::Result<Value> {
    let Some(field) = fields.iter().find(|field| field.name == key) else {
        let known = fields.iter().map(|field| field.name);
        return Err(fail(lua, format!("{label}: {}", unknown("key", key, known))));
    };
    field.ty.check(lua, value).map_err(|fault: Fault| fail(lua, fault.words(&format!("{label}.{key}"))))
}

impl UserData for LuaScene {
    fn add_fields<F: UserDataFields<Self>>(fields: &mut F) {
        fields.add_meta_field(MetaMethod::Type, "softvt.Scene");
    }

    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        methods.add_method("add", |lua, this, value: Value| this.add(lua, &value));
        methods.add_method("object", |lua, this, name: String| {
            let index = find(lua, &locked(&this.scene), &name)?;
            Ok(LuaObject { scene: this.scene.clone(), index })
        });
        methods.add_method("camera", |lua, this, name: String| LuaCamera::named(lua, &this.scene, &name));
        methods.add_method("add_camera", |lua, this, value: Value| LuaCamera::add(lua, &this.scene, &value));
        methods.add_meta_method(MetaMethod::ToString, |_, _, ()| Ok("softvt.Scene"));
        methods.add_meta_method(MetaMethod::Index, |lua, this, key: String| {
            if key == "light" {
                return lua.create_userdata(LuaLight(this.scene.clone())).map(Value::UserData);
            }
            let scene = locked(&this.scene);
            match key.as_str() {
                "base" => numbers(lua, scene.base_w.translation.vector.as_slice()),
                "start_q" => numbers(lua, &scene.start_q),
                "gravity" => numbers(lua, scene.gravity.as_slice()),
                "workspace_min" => numbers(lua, scene.workspace.min.as_slice()),
                "workspace_max" => numbers(lua, scene.workspace.max.as_slice()),
                "objects" => {
                    let handles =
                        (0..scene.objects.len()).map(|index| LuaObject { scene: this.scene.clone(), index });
                    lua.create_sequence_from(handles).map(Value::Table)
                }
                _ => {
                    let known = SCENE.iter().map(|field| field.name).chain([
                        "objects",
                        "light",
                        "add",
                        "object",
                        "camera",
                        "add_camera",
                    ]);
                    Err(fail(lua, format!("scene: {}", unknown("key", &key, known))))
                }
            }
        });
        methods.add_meta_method(MetaMethod::NewIndex, |lua, this, (key, value): (String, Value)| {
            let value = checked(lua, "scene", SCENE, &key, &value)?;
            let list: Vec<f64> = lua.unpack(value)?;
            let mut scene = locked(&this.scene);
            if let Ok(q) = <[f64; 7]>::try_from(list.as_slice()) {
                scene.start_q = q;
                return Ok(());
            }
            let v = Vec3::from_column_slice(&list[..3]);
            match key.as_str() {
                "base" => scene.base_w.translation.vector = v,
                "gravity" => scene.gravity = v,
                "workspace_min" => scene.workspace.min = v,
                _ => scene.workspace.max = v,
            }
            Ok(())
        });
    }
}

/// A placed object, by its place in the scene.
#[derive(Clone)]
struct LuaObject {
    scene: Arc<Mutex<Scene>>,
    index: usize,
}

impl LuaObject {
    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Value> {
        if key == "looks" {
            let looks = LuaLook::all(&self.scene, self.index);
            return lua.create_sequence_from(looks).map(Value::Table);
        }
        let scene = locked(&self.scene);
        let object = &scene.objects[self.index];
        let asset = &object.asset;
        let soft = match &asset.body {
            Body::Soft(soft) => Some(soft),
            _ => None,
        };
        let optional = |value: Option<f64>| Ok(value.map_or(Value::Nil, Value::Number));
        match key {
            "name" => lua.create_string(&object.name).map(Value::String),
            "asset" => lua.create_string(&asset.name).map(Value::String),
            "xyz" => numbers(lua, object.pose_w.translation.vector.as_slice()),
            "yaw" => Ok(Value::Number(object.pose_w.rotation.euler_angles().2)),
            "density" => optional(match &asset.body {
                Body::Soft(soft) => Some(soft.density),
                Body::Rigid { density } => Some(*density),
                Body::Articulated(_) | Body::Static | Body::Scenery => None,
            }),
            "youngs_pa" => optional(soft.map(|soft| soft.youngs_pa)),
            "poisson" => optional(soft.map(|soft| soft.poisson)),
            "joints" => {
                let names = asset.parts().iter().map(|part| part.name.as_str());
                lua.create_table_from(names.zip(object.joints.iter().copied())).map(Value::Table)
            }
            "static_mu" => Ok(Value::Number(asset.friction.static_mu)),
            "dynamic_mu" => Ok(Value::Number(asset.friction.dynamic_mu)),
            _ => {
                let known = OBJECT.iter().map(|field| field.name).chain(["name", "asset", "looks", "joints"]);
                Err(fail(lua, format!("object: {}", unknown("key", key, known))))
            }
        }
    }

    fn write(&self, lua: &Lua, key: &str, value: &Value) -> mlua::Result<()> {
        let value = checked(lua, "object", OBJECT, key, value)?;
        let mut scene = locked(&self.scene);
        let object = &mut scene.objects[self.index];
        if key == "xyz" {
            object.pose_w.translation.vector = Vec3::from(lua.unpack::<[f64; 3]>(value)?);
            return Ok(());
        }
        let number: f64 = lua.unpack(value)?;
        if key == "yaw" {
            object.pose_w.rotation = Quat::from_axis_angle(&Vec3::z_axis(), number);
            return Ok(());
        }
        let name = object.name.clone();
        let asset = Arc::make_mut(&mut object.asset);
        match (key, &mut asset.body) {
            ("static_mu", _) => asset.friction.static_mu = number,
            ("dynamic_mu", _) => asset.friction.dynamic_mu = number,
            ("density", Body::Soft(soft)) => soft.density = number,
            ("density", Body::Rigid { density }) => *density = number,
            ("youngs_pa", Body::Soft(soft)) => soft.youngs_pa = number,
            ("poisson", Body::Soft(soft)) => soft.poisson = number,
            _ => return Err(fail(lua, format!("object.{key}: object {name:?} is a body without it"))),
        }
        // The parts of an object have the friction of the whole.
        if let Body::Articulated(parts) = &mut asset.body {
            parts.iter_mut().for_each(|part| Arc::make_mut(&mut part.asset).friction = asset.friction);
        }
        Ok(())
    }
}

impl UserData for LuaObject {
    fn add_fields<F: UserDataFields<Self>>(fields: &mut F) {
        fields.add_meta_field(MetaMethod::Type, "softvt.Object");
    }

    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        methods.add_meta_method(MetaMethod::ToString, |_, _, ()| Ok("softvt.Object"));
        methods.add_meta_method(MetaMethod::Index, |lua, this, key: String| this.read(lua, &key));
        methods.add_meta_method(MetaMethod::NewIndex, |lua, this, (key, value): (String, Value)| {
            this.write(lua, &key, &value)
        });
    }
}
