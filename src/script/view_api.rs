//! What is seen of a scene: its light, its cameras and the looks of its objects, for layouts and shifts.

use std::sync::{Arc, Mutex};

use mlua::{Lua, MetaMethod, UserData, UserDataFields, UserDataMethods, Value};
use nalgebra::Quaternion;

use super::{
    catalogue_world::NEW_CAMERA,
    sandbox::{fail, here, locked},
    scene_api::{checked, field, numbers},
    schema::{self, Field, Range, Type, unknown},
};
use crate::{
    geometry::{Pose, Quat, Vec3},
    scene::{Camera, CameraMount, Scene, Visual},
};

const SHARE: Range = Range::closed(0.0, 1.0);
/// Colours of lights may be brighter than white.
const BRIGHT: Range = Range::closed(0.0, 1000.0);

/// Fields of the light.
pub(super) static LIGHT: &[Field] = &[
    field("direction", Type::Vector(3, "world, any length"), "Direction to the key light."),
    field("colour", Type::Vector(3, "linear RGB"), "Colour of the key light."),
    field("strength", Type::Number("", BRIGHT), "Strength of the key light; 1 shows white at full value."),
    field("softness", Type::Number("rad", Range::closed(0.0, 0.5)), "Half the angle under which it is seen."),
    field("sky_zenith", Type::Vector(3, "linear RGB"), "Light from straight above."),
    field("sky_horizon", Type::Vector(3, "linear RGB"), "Light from the horizon, and the backdrop."),
    field("sky_ground", Type::Vector(3, "linear RGB"), "Light from straight below."),
    field("sky_strength", Type::Number("", BRIGHT), "Factor on the sky."),
    field("exposure", Type::Number("", Range { max: 1000.0, ..Range::POSITIVE }), "Factor on the picture."),
];

/// Fields of a camera.
pub(super) static CAMERA: &[Field] = &[
    field("position", Type::Vector(3, "m, frame of the mount"), "Where it is."),
    field(
        "quat",
        Type::Vector(4, "w, x, y, z, frame of the mount"),
        "How it is turned: it looks along its −z, +y is up.",
    ),
    field("fovy", Type::Number("rad", Range::closed(0.01, 2.8)), "Vertical field of view."),
    field("near", Type::Number("m", Range::closed(1e-4, 100.0)), "Nothing nearer is seen."),
    field("far", Type::Number("m", Range::closed(1e-3, 1e4)), "Nothing farther is seen."),
    field("width", Type::Integer(Range::closed(1.0, 4096.0)), "Width of the picture, pixels."),
    field("height", Type::Integer(Range::closed(1.0, 4096.0)), "Height of the picture, pixels."),
];

/// Fields of a look.
pub(super) static LOOK: &[Field] = &[
    field("albedo", Type::Vector(3, "linear RGB in 0..1"), "Base colour."),
    field("roughness", Type::Number("", SHARE), "Roughness, 0 a mirror."),
    field("metalness", Type::Number("", SHARE), "Metalness."),
];

type Shared = Arc<Mutex<Scene>>;

/// `softvt.Light`.
#[derive(Clone)]
pub(super) struct LuaLight(pub Shared);

/// `softvt.Camera`, by its place in the scene.
#[derive(Clone)]
pub(super) struct LuaCamera(Shared, usize);

/// `softvt.Look`: a material of an object, by their places.
#[derive(Clone)]
pub(super) struct LuaLook(Shared, usize, usize);

/// A key that is not there.
fn missing(lua: &Lua, label: &str, fields: &[Field], key: &str) -> mlua::Error {
    fail(lua, format!("{label}: {}", unknown("key", key, fields.iter().map(|field| field.name))))
}

/// Three numbers of a checked list, none below 0.
fn colour(lua: &Lua, label: &str, value: Value, most: f64) -> mlua::Result<[f64; 3]> {
    let colour: [f64; 3] = lua.unpack(value)?;
    if colour.iter().all(|c| (0.0..=most).contains(c)) {
        return Ok(colour);
    }
    Err(fail(lua, format!("{label}: expected linear RGB in 0..{most}, got {colour:?}")))
}

impl LuaLight {
    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Value> {
        let scene = locked(&self.0);
        let (light, key_light, sky) = (&scene.lighting, &scene.lighting.key, &scene.lighting.sky);
        match key {
            "direction" => numbers(lua, key_light.direction_w.as_slice()),
            "colour" => numbers(lua, &key_light.colour),
            "strength" => Ok(Value::Number(key_light.strength)),
            "softness" => Ok(Value::Number(key_light.softness_rad)),
            "sky_zenith" => numbers(lua, &sky.zenith),
            "sky_horizon" => numbers(lua, &sky.horizon),
            "sky_ground" => numbers(lua, &sky.ground),
            "sky_strength" => Ok(Value::Number(sky.strength)),
            "exposure" => Ok(Value::Number(light.exposure)),
            _ => Err(missing(lua, "scene.light", LIGHT, key)),
        }
    }

    fn write(&self, lua: &Lua, key: &str, value: &Value) -> mlua::Result<()> {
        let value = checked(lua, "scene.light", LIGHT, key, value)?;
        let label = format!("scene.light.{key}");
        let mut scene = locked(&self.0);
        let light = &mut scene.lighting;
        match key {
            "direction" => {
                let direction = Vec3::from(lua.unpack::<[f64; 3]>(value)?);
                if direction.norm() < 1e-9 {
                    return Err(fail(lua, format!("{label}: expected a direction, got {{0, 0, 0}}")));
                }
                light.key.direction_w = direction;
            }
            "colour" => light.key.colour = colour(lua, &label, value, BRIGHT.max)?,
            "strength" => light.key.strength = lua.unpack(value)?,
            "softness" => light.key.softness_rad = lua.unpack(value)?,
            "sky_zenith" => light.sky.zenith = colour(lua, &label, value, BRIGHT.max)?,
            "sky_horizon" => light.sky.horizon = colour(lua, &label, value, BRIGHT.max)?,
            "sky_ground" => light.sky.ground = colour(lua, &label, value, BRIGHT.max)?,
            "sky_strength" => light.sky.strength = lua.unpack(value)?,
            _ => light.exposure = lua.unpack(value)?,
        }
        Ok(())
    }
}

/// File and line of the script that is at work, as messages name them.
fn place(lua: &Lua) -> Option<String> {
    here(lua).map(|(file, line)| format!("{file}:{line}"))
}

/// A turn from four numbers.
fn turn(lua: &Lua, label: &str, [w, x, y, z]: [f64; 4]) -> mlua::Result<Quat> {
    let turn = Quat::try_new(Quaternion::new(w, x, y, z), 1e-6);
    turn.ok_or_else(|| fail(lua, format!("{label}.quat: expected a quaternion other than 0")))
}

/// The turn of a camera at `from` that looks at `to`, with `up` upwards in the picture.
fn look_at(lua: &Lua, label: &str, from: &Vec3, to: &Vec3, up: &Vec3) -> mlua::Result<Quat> {
    if !from.iter().chain(to).chain(up).all(|x| x.abs() < 1e6) {
        return Err(fail(
            lua,
            format!("{label}.look_at: expected numbers within ±1e6, got {to:?} with up {up:?}"),
        ));
    }
    let ahead = to - from;
    if up.norm() < 1e-9 || ahead.norm() < 1e-6 || ahead.cross(up).norm() < 1e-6 * ahead.norm() * up.norm() {
        let message = "expected a point away from the camera, not straight along up; give another up";
        return Err(fail(lua, format!("{label}.look_at: {message}")));
    }
    Ok(Quat::face_towards(&-ahead, up))
}

impl LuaCamera {
    /// The scene's camera of a name.
    pub fn named(lua: &Lua, scene: &Shared, name: &str) -> mlua::Result<Self> {
        let cameras = locked(scene);
        let names = cameras.cameras.iter().map(|camera| camera.name.as_str());
        match cameras.cameras.iter().position(|camera| camera.name == name) {
            Some(index) => Ok(Self(scene.clone(), index)),
            None => Err(fail(lua, format!("scene:camera: {}", unknown("camera", name, names)))),
        }
    }

    /// A new one from its table.
    pub fn add(lua: &Lua, scene: &Shared, value: &Value) -> mlua::Result<Self> {
        const LABEL: &str = "scene:add_camera";
        let Value::Table(table) = value else {
            return Err(fail(lua, format!("{LABEL}: expected a table, got {}", schema::got(value))));
        };
        let spec =
            schema::check(lua, &NEW_CAMERA, table).map_err(|fault| schema::fault_here(lua, LABEL, &fault))?;
        let name: String = spec.get("name")?;
        let at = Vec3::from(spec.get::<[f64; 3]>("position")?);
        let up = Vec3::from(spec.get::<Option<[f64; 3]>>("up")?.unwrap_or([0.0, 0.0, 1.0]));
        let turn = match (spec.get::<Option<[f64; 3]>>("look_at")?, spec.get::<Option<[f64; 4]>>("quat")?) {
            (Some(to), None) => look_at(lua, LABEL, &at, &Vec3::from(to), &up)?,
            (None, Some(quat)) => turn(lua, LABEL, quat)?,
            _ => return Err(fail(lua, format!("{LABEL}: give either look_at or quat"))),
        };
        let hand = spec.get::<String>("mount")? == "hand";
        let camera = Camera {
            name: name.clone(),
            mount: if hand { CameraMount::Hand } else { CameraMount::World },
            pose: Pose::from_parts(at.into(), turn),
            fovy_rad: spec.get("fovy")?,
            near_m: spec.get("near")?,
            far_m: spec.get("far")?,
            width: spec.get("width")?,
            height: spec.get("height")?,
            set_at: place(lua),
        };
        let mut inner = locked(scene);
        if inner.camera(&name).is_some() {
            let message =
                format!("{LABEL}: there is a camera {name:?} already; change it by scene:camera({name:?})");
            return Err(fail(lua, message));
        }
        inner.cameras.push(camera);
        Ok(Self(scene.clone(), inner.cameras.len() - 1))
    }

    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Value> {
        let scene = locked(&self.0);
        let camera = &scene.cameras[self.1];
        match key {
            "name" => lua.create_string(&camera.name).map(Value::String),
            "mount" => {
                let mount = if camera.mount == CameraMount::Hand { "hand" } else { "world" };
                lua.create_string(mount).map(Value::String)
            }
            "position" => numbers(lua, camera.pose.translation.vector.as_slice()),
            "quat" => {
                let q = crate::robot::rotation::canonical(&camera.pose.rotation);
                numbers(lua, &[q.w, q.i, q.j, q.k])
            }
            "fovy" => Ok(Value::Number(camera.fovy_rad)),
            "near" => Ok(Value::Number(camera.near_m)),
            "far" => Ok(Value::Number(camera.far_m)),
            "width" => Ok(Value::Integer(camera.width as i64)),
            "height" => Ok(Value::Integer(camera.height as i64)),
            _ => Err(missing(lua, "camera", CAMERA, key)),
        }
    }

    fn write(&self, lua: &Lua, key: &str, value: &Value) -> mlua::Result<()> {
        let value = checked(lua, "camera", CAMERA, key, value)?;
        let mut scene = locked(&self.0);
        let camera = &mut scene.cameras[self.1];
        camera.set_at = place(lua);
        match key {
            "position" => camera.pose.translation.vector = Vec3::from(lua.unpack::<[f64; 3]>(value)?),
            "quat" => camera.pose.rotation = turn(lua, "camera", lua.unpack(value)?)?,
            "fovy" => camera.fovy_rad = lua.unpack(value)?,
            "near" => camera.near_m = lua.unpack(value)?,
            "far" => camera.far_m = lua.unpack(value)?,
            "width" => camera.width = lua.unpack(value)?,
            _ => camera.height = lua.unpack(value)?,
        }
        Ok(())
    }

    fn turn_to(&self, lua: &Lua, to: [f64; 3], up: Option<[f64; 3]>) -> mlua::Result<()> {
        let mut scene = locked(&self.0);
        let camera = &mut scene.cameras[self.1];
        camera.set_at = place(lua);
        let pose = &mut camera.pose;
        let up = Vec3::from(up.unwrap_or([0.0, 0.0, 1.0]));
        pose.rotation = look_at(lua, "camera", &pose.translation.vector, &Vec3::from(to), &up)?;
        Ok(())
    }
}

impl LuaLook {
    /// The looks of an object, by material id.
    pub fn all(scene: &Shared, object: usize) -> Vec<Self> {
        let count = locked(scene).objects[object].asset.visuals.len();
        (0..count).map(|index| Self(scene.clone(), object, index)).collect()
    }

    fn change<T>(&self, with: impl FnOnce(&mut Visual) -> T) -> T {
        let mut scene = locked(&self.0);
        with(&mut Arc::make_mut(&mut scene.objects[self.1].asset).visuals[self.2])
    }

    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Value> {
        let scene = locked(&self.0);
        let look = &scene.objects[self.1].asset.visuals[self.2];
        match key {
            "albedo" => numbers(lua, &look.albedo),
            "roughness" => Ok(Value::Number(look.roughness)),
            "metalness" => Ok(Value::Number(look.metalness)),
            _ => Err(missing(lua, "look", LOOK, key)),
        }
    }

    fn write(&self, lua: &Lua, key: &str, value: &Value) -> mlua::Result<()> {
        let value = checked(lua, "look", LOOK, key, value)?;
        if key == "albedo" {
            let albedo = colour(lua, "look.albedo", value, 1.0)?;
            self.change(|look| look.albedo = albedo);
            return Ok(());
        }
        let number: f64 = lua.unpack(value)?;
        self.change(|look| match key {
            "roughness" => look.roughness = number,
            _ => look.metalness = number,
        });
        Ok(())
    }
}

/// The same few lines for each of the three: fields that are read and written by name.
macro_rules! fields_by_name {
    ($type:ty, $name:literal, |$methods:ident| $more:expr) => {
        impl UserData for $type {
            fn add_fields<F: UserDataFields<Self>>(fields: &mut F) {
                fields.add_meta_field(MetaMethod::Type, $name);
            }

            fn add_methods<M: UserDataMethods<Self>>($methods: &mut M) {
                $methods.add_meta_method(MetaMethod::ToString, |_, _, ()| Ok($name));
                $methods.add_meta_method(MetaMethod::Index, |lua, this, key: String| this.read(lua, &key));
                $methods.add_meta_method(MetaMethod::NewIndex, |lua, this, (key, value): (String, Value)| {
                    this.write(lua, &key, &value)
                });
                $more
            }
        }
    };
}

fields_by_name!(LuaLight, "softvt.Light", |methods| ());
fields_by_name!(LuaLook, "softvt.Look", |methods| ());
fields_by_name!(LuaCamera, "softvt.Camera", |methods| {
    methods
        .add_method("look_at", |lua, this, (to, up): ([f64; 3], Option<[f64; 3]>)| this.turn_to(lua, to, up));
});
