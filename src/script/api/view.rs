//! What is seen of a scene: its light, its cameras and the looks of its objects, for layouts and shifts.

use std::sync::{Arc, Mutex};

use mlua::{Lua, Table, UserDataMethods, Value};

use crate::script::{
    api::catalogue_classes::{self as classes, Class},
    api::orientation as turn,
    api::scene::field,
    schema::userdata::{Hosted, Read, hosted, method},
    schema::{Field, Range, Type, unknown},
    vm::{fail, here, locked},
};
use crate::{
    geometry::{Pose, Quat, Vec3},
    scene::{Camera, CameraMount, Scene, Visual},
    text,
};

/// Cameras of a scene; each draws its own pictures.
const MOST_CAMERAS: usize = 64;
const SHARE: Range = Range::closed(0.0, 1.0);
/// Colours of lights may be brighter than white.
const BRIGHT: Range = Range::closed(0.0, 1000.0);

/// Fields of the light.
pub(crate) static LIGHT: &[Field] = &[
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
pub(crate) static CAMERA: &[Field] = &[
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
pub(crate) static LOOK: &[Field] = &[
    field("albedo", Type::Vector(3, "linear RGB in 0..1"), "Base colour."),
    field("roughness", Type::Number("", SHARE), "Roughness, 0 a mirror."),
    field("metalness", Type::Number("", SHARE), "Metalness."),
];

type Shared = Arc<Mutex<Scene>>;

/// `softvt.Light`.
#[derive(Clone)]
pub(crate) struct LuaLight(pub Shared);

/// `softvt.Camera`, by its place in the scene.
#[derive(Clone)]
pub(crate) struct LuaCamera(Shared, usize);

/// `softvt.Look`: a material of an object, by their places.
#[derive(Clone)]
pub(crate) struct LuaLook(Shared, usize, usize);

/// Three numbers of a checked list, none below 0.
fn colour(lua: &Lua, label: &str, value: Value, most: f64) -> mlua::Result<[f64; 3]> {
    let colour: [f64; 3] = lua.unpack(value)?;
    if colour.iter().all(|c| (0.0..=most).contains(c)) {
        return Ok(colour);
    }
    Err(fail(lua, format!("{label}: expected linear RGB in 0..{most}, got {}", braced(&colour))))
}

impl Hosted for LuaLight {
    fn class() -> &'static Class {
        &classes::LIGHT
    }

    fn label(&self) -> String {
        "scene.light".into()
    }

    fn read(&self, _: &Lua, key: &str) -> mlua::Result<Read> {
        let scene = locked(&self.0);
        let (light, key_light, sky) = (&scene.lighting, &scene.lighting.key, &scene.lighting.sky);
        Ok(match key {
            "direction" => Read::Numbers(key_light.direction_w.as_slice().to_vec()),
            "colour" => Read::Numbers(key_light.colour.to_vec()),
            "strength" => Read::number(key_light.strength),
            "softness" => Read::number(key_light.softness_rad),
            "sky_zenith" => Read::Numbers(sky.zenith.to_vec()),
            "sky_horizon" => Read::Numbers(sky.horizon.to_vec()),
            "sky_ground" => Read::Numbers(sky.ground.to_vec()),
            "sky_strength" => Read::number(sky.strength),
            _ => Read::number(light.exposure),
        })
    }

    fn write(&self, lua: &Lua, key: &str, value: Value) -> mlua::Result<()> {
        let label = format!("scene.light.{key}");
        let mut scene = locked(&self.0);
        let light = &mut scene.lighting;
        match key {
            "direction" => light.key.direction_w = direction(lua, &label, lua.unpack(value)?)?,
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

    fn methods<M: UserDataMethods<Self>>(_: &mut M) {}
}

/// A direction of any length, which is kept: its numbers may be written one by one.
fn direction(lua: &Lua, label: &str, numbers: [f64; 3]) -> mlua::Result<Vec3> {
    let Some(unit) = turn::direction(numbers) else {
        return Err(fail(lua, format!("{label}: expected a direction, got {}", braced(&numbers))));
    };
    let most = numbers.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    Ok(if (1e-6..1e6).contains(&most) { Vec3::from(numbers) } else { unit })
}

/// `{0, 1e300, 0}`.
fn braced(numbers: &[f64]) -> String {
    format!("{{{}}}", numbers.iter().map(|x| text::format_number(*x)).collect::<Vec<_>>().join(", "))
}

/// File and line of the script that is at work, as messages name them.
fn place(lua: &Lua) -> Option<String> {
    here(lua).map(|(file, line)| format!("{file}:{line}"))
}

/// A turn from four numbers.
fn quat(lua: &Lua, label: &str, numbers: [f64; 4]) -> mlua::Result<Quat> {
    turn::turn(numbers).ok_or_else(|| {
        fail(lua, format!("{label}.quat: expected a quaternion other than 0, got {}", braced(&numbers)))
    })
}

/// The turn of a camera at `from` that looks at `to`, with `up` upwards in the picture.
fn look_at(lua: &Lua, label: &str, from: &Vec3, to: &Vec3, up: [f64; 3]) -> mlua::Result<Quat> {
    if from.amax().max(to.amax()) > 1e6 {
        let (from, to) = (braced(from.as_slice()), braced(to.as_slice()));
        return Err(fail(lua, format!("{label}: expected numbers within ±1e6, got {to} from {from}")));
    }
    let ahead = to - from;
    match turn::direction(up).filter(|up| ahead.norm() > 1e-6 && ahead.cross(up).norm() > 1e-6 * ahead.norm())
    {
        Some(up) => Ok(Quat::face_towards(&-ahead, &up)),
        None => {
            let message = "expected a point away from the camera, not straight along up; give another up";
            Err(fail(lua, format!("{label}: {message}")))
        }
    }
}

const UP: [f64; 3] = [0.0, 0.0, 1.0];

impl LuaCamera {
    /// The scene's camera of a name.
    pub(crate) fn named(lua: &Lua, scene: &Shared, name: &str) -> mlua::Result<Self> {
        let cameras = locked(scene);
        let names = cameras.cameras.iter().map(|camera| camera.name.as_str());
        match cameras.cameras.iter().position(|camera| camera.name == name) {
            Some(index) => Ok(Self(scene.clone(), index)),
            None => Err(fail(lua, format!("scene:camera: {}", unknown("camera", name, names)))),
        }
    }

    /// A new one from its checked table.
    pub(crate) fn add(lua: &Lua, scene: &Shared, spec: &Table) -> mlua::Result<Self> {
        const LABEL: &str = "scene:add_camera";
        let name: String = spec.get("name")?;
        let at = Vec3::from(spec.get::<[f64; 3]>("position")?);
        let up = spec.get::<Option<[f64; 3]>>("up")?.unwrap_or(UP);
        let turn = match (spec.get::<Option<[f64; 3]>>("look_at")?, spec.get::<Option<[f64; 4]>>("quat")?) {
            (Some(to), None) => look_at(lua, &format!("{LABEL}.look_at"), &at, &Vec3::from(to), up)?,
            (None, Some(numbers)) => quat(lua, LABEL, numbers)?,
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
        if inner.cameras.len() >= MOST_CAMERAS {
            return Err(fail(lua, format!("{LABEL}: a scene has at most {MOST_CAMERAS} cameras")));
        }
        inner.cameras.push(camera);
        Ok(Self(scene.clone(), inner.cameras.len() - 1))
    }
}

impl Hosted for LuaCamera {
    fn class() -> &'static Class {
        &classes::CAMERA
    }

    fn label(&self) -> String {
        format!("scene:camera({:?})", locked(&self.0).cameras[self.1].name)
    }

    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Read> {
        let scene = locked(&self.0);
        let camera = &scene.cameras[self.1];
        Ok(match key {
            "name" => Read::text(lua, &camera.name)?,
            "mount" => Read::text(lua, if camera.mount == CameraMount::Hand { "hand" } else { "world" })?,
            "position" => Read::Numbers(camera.pose.translation.vector.as_slice().to_vec()),
            "quat" => {
                let q = crate::robot::rotation::canonical(&camera.pose.rotation);
                Read::together(
                    lua,
                    &[q.w, q.i, q.j, q.k],
                    "its numbers belong together: write camera.quat = { w, x, y, z }",
                )?
            }
            "fovy" => Read::number(camera.fovy_rad),
            "near" => Read::number(camera.near_m),
            "far" => Read::number(camera.far_m),
            "width" => Read::Value(Value::Integer(camera.width as i64)),
            _ => Read::Value(Value::Integer(camera.height as i64)),
        })
    }

    fn write(&self, lua: &Lua, key: &str, value: Value) -> mlua::Result<()> {
        let label = self.label();
        let mut scene = locked(&self.0);
        let camera = &mut scene.cameras[self.1];
        camera.set_at = place(lua);
        match key {
            "position" => camera.pose.translation.vector = Vec3::from(lua.unpack::<[f64; 3]>(value)?),
            "quat" => camera.pose.rotation = quat(lua, &label, lua.unpack(value)?)?,
            "fovy" => camera.fovy_rad = lua.unpack(value)?,
            "near" => camera.near_m = lua.unpack(value)?,
            "far" => camera.far_m = lua.unpack(value)?,
            "width" => camera.width = lua.unpack(value)?,
            _ => camera.height = lua.unpack(value)?,
        }
        Ok(())
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "look_at", |lua, this: &Self, (to, up): ([f64; 3], Option<[f64; 3]>)| {
            let label = format!("{}:look_at", this.label());
            let mut scene = locked(&this.0);
            let camera = &mut scene.cameras[this.1];
            camera.set_at = place(lua);
            let pose = &mut camera.pose;
            pose.rotation =
                look_at(lua, &label, &pose.translation.vector, &Vec3::from(to), up.unwrap_or(UP))?;
            Ok(())
        });
    }
}

impl LuaLook {
    /// The looks of an object, by material id.
    pub(crate) fn all(scene: &Shared, object: usize) -> Vec<Self> {
        let count = locked(scene).objects[object].asset.visuals.len();
        (0..count).map(|index| Self(scene.clone(), object, index)).collect()
    }

    fn change<T>(&self, with: impl FnOnce(&mut Visual) -> T) -> T {
        let mut scene = locked(&self.0);
        with(&mut Arc::make_mut(&mut scene.objects[self.1].asset).visuals[self.2])
    }
}

impl Hosted for LuaLook {
    fn class() -> &'static Class {
        &classes::LOOK
    }

    fn label(&self) -> String {
        "look".into()
    }

    fn read(&self, _: &Lua, key: &str) -> mlua::Result<Read> {
        let scene = locked(&self.0);
        let look = &scene.objects[self.1].asset.visuals[self.2];
        Ok(match key {
            "albedo" => Read::Numbers(look.albedo.to_vec()),
            "roughness" => Read::number(look.roughness),
            _ => Read::number(look.metalness),
        })
    }

    fn write(&self, lua: &Lua, key: &str, value: Value) -> mlua::Result<()> {
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

    fn methods<M: UserDataMethods<Self>>(_: &mut M) {}
}

hosted!(LuaLight, LuaCamera, LuaLook);
