//! The scene that layouts and shifts change.

use std::sync::{Arc, Mutex};

use mlua::{Lua, Table, UserDataMethods, Value};

use crate::script::{
    api::catalogue,
    api::catalogue_classes::{self as classes, Class},
    api::catalogue_joints::ARTICULATED,
    api::joints as articulated,
    api::shapes::LuaShape,
    api::view::{LuaCamera, LuaLight, LuaLook},
    schema::userdata::{Hosted, Read, hosted, method},
    schema::{self, Field, Presence, Range, Type, unknown},
    vm::{fail, here, locked},
};
use crate::{
    geometry::{Aabb, Pose, Quat, Vec3},
    physics::contact::Friction,
    robot::panda::{self, ARM_DOFS},
    scene::{Asset, Body, Camera, Lighting, Object, Scene, SoftMaterial},
    text::format_number,
};

pub(crate) const fn field(name: &'static str, ty: Type, doc: &'static str) -> Field {
    Field { name, ty, presence: Presence::Required, doc }
}

/// Fields of a scene that scripts may read and write.
pub(crate) static SCENE: &[Field] = &[
    field("base", Type::Vector(3, "m, world"), "Place of the robot base."),
    field("start_q", Type::Vector(7, "rad"), "Joint angles of the arm at the start."),
    field("gravity", Type::Vector(3, "m/s², world"), "Gravity."),
    field("workspace_min", Type::Vector(3, "m, world"), "Lowest corner of the workspace."),
    field("workspace_max", Type::Vector(3, "m, world"), "Highest corner of the workspace."),
];

/// Fields of a placed object that scripts may read and write; those of soft bodies are nil for others.
pub(crate) static OBJECT: &[Field] = &[
    field("xyz", Type::Vector(3, "m, world"), "Its origin: lowest point, on the centre line."),
    field("yaw", Type::Number("rad", Range::ANY), "Turn about the vertical."),
    field("density", Type::Number("kg/m³", Range::POSITIVE), "Density of a soft or rigid body."),
    field("youngs_pa", Type::Number("Pa", Range::POSITIVE), "Young's modulus of a soft body."),
    field("poisson", Type::Number("", Range::below(0.0, 0.5)), "Poisson's ratio of a soft body."),
    field("static_mu", Type::Number("", Range::closed(0.0, 10.0)), "Static friction coefficient."),
    field("dynamic_mu", Type::Number("", Range::closed(0.0, 10.0)), "Dynamic friction coefficient."),
];

/// Start pose of the arm as in SoftVTBench (facts of the released code): the hand over the table, pointing down.
const START_Q: [f64; ARM_DOFS] = [-0.01988, -0.18734, 0.00767, -2.40340, 0.00496, 2.24534, 0.79485];

/// A scene with nothing in it: robot base of the table scenes, workspace of the table.
pub(crate) fn empty_scene() -> Scene {
    Scene {
        objects: Vec::new(),
        base_w: Pose::translation(-0.66, 0.0, 0.012),
        start_q: START_Q,
        gravity: Vec3::new(0.0, 0.0, -9.81),
        workspace: Aabb { min: Vec3::new(-0.5, -0.6, -0.05), max: Vec3::new(0.5, 0.6, 1.0) },
        lighting: Lighting::default(),
        cameras: vec![Camera::third_person_table(), Camera::wrist()],
    }
}

/// Objects in a scene; a layout that adds more has run away.
const MOST_OBJECTS: usize = 1000;

/// Farther from the origin than this nothing can be computed with the exactness of a grasp, m.
const FARTHEST: f64 = 1e3;

/// A place in the world that can be.
fn place_at(lua: &Lua, label: &str, xyz: Vec3) -> mlua::Result<Vec3> {
    if xyz.amax() <= FARTHEST {
        return Ok(xyz);
    }
    let [x, y, z] = [xyz.x, xyz.y, xyz.z].map(format_number);
    Err(fail(
        lua,
        format!("{label}: expected a place within {FARTHEST} m of the origin, got {{{x}, {y}, {z}}}"),
    ))
}

/// Joint angles that the arm can have, rad.
fn within_limits(lua: &Lua, q: [f64; ARM_DOFS]) -> mlua::Result<[f64; ARM_DOFS]> {
    for (index, (link, q)) in panda::arm_chain().links.iter().zip(q).enumerate() {
        if !(link.lower..=link.upper).contains(&q) {
            let (lower, upper) = (link.lower, link.upper);
            let message = format!(
                "scene.start_q[{}]: expected radians in {lower}..{upper}, the limits of {}, got {}",
                index + 1,
                link.name,
                format_number(q)
            );
            return Err(fail(lua, message));
        }
    }
    Ok(q)
}

/// An asset's Lua table and what was read from it.
type Known = (Table, Arc<Asset>);

/// `softvt.Scene`.
#[derive(Clone)]
pub(crate) struct LuaScene {
    pub scene: Arc<Mutex<Scene>>,
    /// Assets by the address of their Lua table, which the scene keeps alive: two objects of one asset share it.
    assets: Arc<Mutex<Vec<Known>>>,
}

impl LuaScene {
    pub(crate) fn new(scene: Scene) -> Self {
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

    fn add(&self, lua: &Lua, place: &Table) -> mlua::Result<()> {
        let name: String = place.get("name")?;
        let asset = self.asset(lua, &place.get("asset")?)?;
        let mut scene = locked(&self.scene);
        if scene.objects.iter().any(|object| object.name == name) {
            return Err(fail(
                lua,
                format!("scene:add: there is an object {name:?} already; give another name"),
            ));
        }
        if scene.objects.len() >= MOST_OBJECTS {
            return Err(fail(lua, format!("scene:add: a scene holds at most {MOST_OBJECTS} objects")));
        }
        let at = position(lua, &scene, place)?;
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
        (None, Some(xyz), None) => place_at(lua, "scene:add.xyz", Vec3::from(xyz)),
        (Some([x, y]), None, on) => {
            let at = place_at(lua, "scene:add.at", Vec3::new(x, y, 0.0))?;
            let Some(on) = on else { return Ok(at) };
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
    schema::still_sound(lua, &catalogue::ASSET, table)?;
    let body: Table = table.get("body")?;
    let kinds = [&catalogue::SOFT, &catalogue::RIGID, &ARTICULATED, &catalogue::STATIC, &catalogue::SCENERY];
    if let Some(record) = kinds.into_iter().find(|record| schema::is_made(lua, record, &body)) {
        schema::still_sound(lua, record, &body)?;
    }
    let friction: Table = table.get("friction")?;
    let friction =
        Friction { static_mu: friction.get("static_mu")?, dynamic_mu: friction.get("dynamic_mu")? };
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
    let shape = table.get::<LuaShape>("shape")?.shape().clone();
    Ok(Asset {
        name: table.get("name")?,
        visuals: crate::script::api::visuals::read(lua, table, &shape)?,
        shape,
        body,
        friction,
        hints: table.get::<Option<_>>("hints")?.unwrap_or_default(),
    })
}

impl Hosted for LuaScene {
    fn class() -> &'static Class {
        &classes::SCENE
    }

    fn label(&self) -> String {
        "scene".into()
    }

    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Read> {
        if key == "light" {
            return lua
                .create_userdata(LuaLight(self.scene.clone()))
                .map(|light| Read::Value(Value::UserData(light)));
        }
        let scene = locked(&self.scene);
        let numbers = |v: &[f64]| Ok(Read::Numbers(v.to_vec()));
        match key {
            "base" => numbers(scene.base_w.translation.vector.as_slice()),
            "start_q" => numbers(&scene.start_q),
            "gravity" => numbers(scene.gravity.as_slice()),
            "workspace_min" => numbers(scene.workspace.min.as_slice()),
            "workspace_max" => numbers(scene.workspace.max.as_slice()),
            _ => {
                let handles =
                    (0..scene.objects.len()).map(|index| LuaObject { scene: self.scene.clone(), index });
                let list = lua.create_sequence_from(handles)?;
                Ok(Read::Fixed(list, "scene:add{…} puts one more there".into()))
            }
        }
    }

    fn write(&self, lua: &Lua, key: &str, value: Value) -> mlua::Result<()> {
        let list: Vec<f64> = lua.unpack(value)?;
        let mut scene = locked(&self.scene);
        if let Ok(q) = <[f64; ARM_DOFS]>::try_from(list.as_slice()) {
            scene.start_q = within_limits(lua, q)?;
            return Ok(());
        }
        let v = Vec3::from_column_slice(&list[..3]);
        match key {
            "base" => scene.base_w.translation.vector = place_at(lua, "scene.base", v)?,
            "gravity" => scene.gravity = v,
            "workspace_min" => scene.workspace.min = v,
            _ => scene.workspace.max = v,
        }
        Ok(())
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "add", |lua, this: &Self, place: Table| this.add(lua, &place));
        method(methods, "object", |lua, this: &Self, name: String| {
            let index = find(lua, &locked(&this.scene), &name)?;
            Ok(LuaObject { scene: this.scene.clone(), index })
        });
        method(methods, "camera", |lua, this: &Self, name: String| LuaCamera::named(lua, &this.scene, &name));
        method(methods, "add_camera", |lua, this: &Self, camera: Table| {
            LuaCamera::add(lua, &this.scene, &camera)
        });
    }
}

/// A placed object, by its place in the scene.
#[derive(Clone)]
struct LuaObject {
    scene: Arc<Mutex<Scene>>,
    index: usize,
}

impl Hosted for LuaObject {
    fn class() -> &'static Class {
        &classes::OBJECT
    }

    fn label(&self) -> String {
        "object".into()
    }

    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Read> {
        if key == "looks" {
            let looks = lua.create_sequence_from(LuaLook::all(&self.scene, self.index))?;
            return Ok(Read::Fixed(
                looks,
                "write the numbers of a look, as in looks[1].roughness = 0.5".into(),
            ));
        }
        let scene = locked(&self.scene);
        let object = &scene.objects[self.index];
        let asset = &object.asset;
        let soft = match &asset.body {
            Body::Soft(soft) => Some(soft),
            _ => None,
        };
        Ok(match key {
            "name" => Read::text(lua, &object.name)?,
            "asset" => Read::text(lua, &asset.name)?,
            "xyz" => Read::Numbers(object.pose_w.translation.vector.as_slice().to_vec()),
            "yaw" => Read::number(object.pose_w.rotation.euler_angles().2),
            "density" => Read::optional(match &asset.body {
                Body::Soft(soft) => Some(soft.density),
                Body::Rigid { density } => Some(*density),
                Body::Articulated(_) | Body::Static | Body::Scenery => None,
            }),
            "youngs_pa" => Read::optional(soft.map(|soft| soft.youngs_pa)),
            "poisson" => Read::optional(soft.map(|soft| soft.poisson)),
            "joints" => {
                let names = asset.parts().iter().map(|part| part.name.as_str());
                Read::Value(Value::Table(lua.create_table_from(names.zip(object.joints.iter().copied()))?))
            }
            "static_mu" => Read::number(asset.friction.static_mu),
            _ => Read::number(asset.friction.dynamic_mu),
        })
    }

    fn write(&self, lua: &Lua, key: &str, value: Value) -> mlua::Result<()> {
        let mut scene = locked(&self.scene);
        let object = &mut scene.objects[self.index];
        if key == "xyz" {
            let xyz = Vec3::from(lua.unpack::<[f64; 3]>(value)?);
            object.pose_w.translation.vector = place_at(lua, "object.xyz", xyz)?;
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

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "mass", |lua, this: &Self, part: Option<String>| {
            let scene = locked(&this.scene);
            let object = &scene.objects[this.index];
            let Some(name) = part else { return Ok(object.asset.mass()) };
            let parts = object.asset.parts();
            let names = parts.iter().map(|part| part.name.as_str());
            match parts.iter().find(|part| part.name == name) {
                Some(part) => Ok(Some(part.mass())),
                None if parts.is_empty() => {
                    Err(fail(lua, format!("object:mass: object {:?} has no parts", object.name)))
                }
                None => Err(fail(lua, format!("object:mass: {}", unknown("part", &name, names)))),
            }
        });
        method(methods, "scale_mass", |_, this: &Self, factor: f64| {
            let mut scene = locked(&this.scene);
            Arc::make_mut(&mut scene.objects[this.index].asset).scale_mass(factor);
            Ok(())
        });
    }
}

hosted!(LuaScene, LuaObject);
