//! Light and cameras of a scene, for layouts and shifts.

use std::sync::{Arc, Mutex};

use mlua::Lua;

use super::{
    index_of,
    pose::{direction, rotation_from_wxyz, unit_direction, wxyz},
};
use crate::{
    schema::{Range, Type, choice, class, object::read_only_list, record},
    vm::error::current_line,
};
use softvt_common::parallel::lock;
use softvt_geometry::{Pose, Quat, Vec3};
use softvt_scene::{Camera, CameraMount, Lighting, MAX_CAMERAS, Scene};

/// Strengths and colours of lights, which may be brighter than white.
const BRIGHTNESS: Range = Range::closed(0.0, 1000.0).usually(0.0, 50.0);
const FIELD_OF_VIEW: Type = Type::Number("rad", Range::closed(0.01, 2.8));
const NEAR: Type = Type::Number("m", Range::closed(1e-4, 100.0));
const FAR: Type = Type::Number("m", Range::closed(1e-3, 1e4).usually(0.15, 1e3));
pub(crate) const IMAGE_EDGE: Type = Type::Integer(Range::closed(1.0, 4096.0));
const LIGHT_COLOUR: Type = Type::colour(20.0);
const POINT: Type =
    Type::Vector(3, "m, frame of the mount", Range::closed(-100.0, 100.0).usually(-10.0, 10.0));
const ORIENTATION: Type = Type::Quaternion("frame of the mount");

choice! { CameraMount { "world" => World, "hand" => Hand } }

record! {
    /// A camera. Give either look_at or quaternion.
    CameraSpec: "softvt.NewCamera" as "scene:add_camera" {
        /// Name, unique; also that of its image stream.
        name: String = Type::Name;
        /// Frame that the camera is fixed to; hand is panda_hand.
        mount: CameraMount => Text("world");
        /// Position of its centre.
        position: [f64; 3] = POINT;
        /// A point in the middle of the image.
        look_at: Option<[f64; 3]> = POINT;
        /// Upward direction in the image (with look_at); z by default.
        up: Option<[f64; 3]> = Type::vector(3, "frame of the mount");
        /// Orientation: the camera looks along its −z axis, and +y is up in the image.
        quaternion: Option<[f64; 4]> = ORIENTATION;
        /// Vertical field of view.
        fovy: f64 = FIELD_OF_VIEW => Number(0.8);
        /// Distance of the nearest visible point.
        near: f64 = NEAR => Number(0.01);
        /// Distance of the farthest visible point.
        far: f64 = FAR => Number(20.0);
        /// Width of the image, pixels.
        width: usize = IMAGE_EDGE => Integer(224);
        /// Height of the image, pixels.
        height: usize = IMAGE_EDGE => Integer(224);
    }
}

type SharedScene = Arc<Mutex<Scene>>;

#[derive(Clone)]
pub(crate) struct LuaLight(pub SharedScene);

impl LuaLight {
    fn read<T>(&self, read: impl FnOnce(&Lighting) -> T) -> T {
        read(&lock(&self.0).lighting)
    }

    fn change(&self, _: &Lua, change: impl FnOnce(&mut Lighting)) {
        change(&mut lock(&self.0).lighting);
    }
}

class! {
    /// The light of a scene: a key light and a sky.
    LuaLight: "softvt.Light" {
        label(_) { "scene.light".to_owned() }
        writable {
            /// Direction to the key light.
            direction: Type::Direction(&[], "world, any length") => {
                get(_, this) { this.read(|light| light.key.direction_w) }
                set(lua, this, numbers: [f64; 3]) {
                    this.change(lua, |light| light.key.direction_w = direction(numbers).unwrap_or(numbers.into()));
                }
            }
            /// Colour of the key light.
            colour: LIGHT_COLOUR => key.colour;
            /// Strength of the key light; 1 shows a white surface at full value.
            strength: Type::Number("", BRIGHTNESS) => key.strength;
            /// Half of the angle under which the key light is seen; larger values give softer shadows.
            softness: Type::Number("rad", Range::closed(0.0, 0.5)) => key.softness_rad;
            /// Light from straight above.
            sky_zenith: LIGHT_COLOUR => sky.zenith;
            /// Light from the horizon, and the background.
            sky_horizon: LIGHT_COLOUR => sky.horizon;
            /// Light from straight below.
            sky_ground: LIGHT_COLOUR => sky.ground;
            /// Factor on the sky.
            sky_strength: Type::Number("", BRIGHTNESS) => sky.strength;
            /// Factor on the whole image.
            exposure: Type::Number("", Range { max: 1000.0, ..Range::POSITIVE }.usually(0.01, 100.0)) => exposure;
        }
    }
}

/// `softvt.Camera`, by its index in the scene.
#[derive(Clone)]
pub(crate) struct LuaCamera {
    scene: SharedScene,
    index: usize,
}

/// The orientation of a camera at `from` that looks at `point`, with `up` (z by default) upwards in the image.
fn look_at(lua: &Lua, label: &str, from: &Vec3, point: [f64; 3], up: Option<[f64; 3]>) -> mlua::Result<Quat> {
    let ahead = Vec3::from(point) - from;
    let up = up.map_or(Some(Vec3::z()), unit_direction);
    match up.filter(|up| ahead.norm() > 1e-6 && ahead.cross(up).norm() > 1e-6 * ahead.norm()) {
        Some(up) => Ok(Quat::face_towards(&-ahead, &up)),
        None => {
            let message = "expected a point away from the camera, not straight along up; give another up";
            Err(fail!(lua, "{label}: {message}"))
        }
    }
}

impl LuaCamera {
    pub(crate) fn named(lua: &Lua, scene: &SharedScene, name: &str) -> mlua::Result<Self> {
        let inner = lock(scene);
        let names = inner.cameras.iter().map(|camera| camera.name.as_str());
        let index = index_of(lua, "scene:camera", "camera", names, name)?;
        Ok(Self { scene: scene.clone(), index })
    }

    pub(crate) fn add(lua: &Lua, scene: &SharedScene, spec: CameraSpec) -> mlua::Result<Self> {
        const LABEL: &str = "scene:add_camera";
        let position = Vec3::from(spec.position);
        let rotation = match (spec.look_at, spec.quaternion) {
            (Some(point), None) => look_at(lua, &format!("{LABEL}.look_at"), &position, point, spec.up)?,
            (None, Some(numbers)) => rotation_from_wxyz(numbers).unwrap_or_default(),
            _ => return Err(fail!(lua, "{LABEL}: give either look_at or quaternion")),
        };
        let mut inner = lock(scene);
        if inner.camera(&spec.name).is_some() {
            let name = &spec.name;
            bail!(lua, "{LABEL}: there is a camera {name:?} already; change it by scene:camera({name:?})");
        }
        if inner.cameras.len() >= MAX_CAMERAS {
            bail!(lua, "{LABEL}: a scene has at most {MAX_CAMERAS} cameras");
        }
        inner.cameras.push(Camera {
            name: spec.name,
            mount: spec.mount,
            pose: Pose::from_parts(position.into(), rotation),
            fovy_rad: spec.fovy,
            near_m: spec.near,
            far_m: spec.far,
            width: spec.width,
            height: spec.height,
            set_at: current_line(lua).map(|line| line.to_string()),
        });
        Ok(Self { scene: scene.clone(), index: inner.cameras.len() - 1 })
    }

    fn read<T>(&self, read: impl FnOnce(&Camera) -> T) -> T {
        read(&lock(&self.scene).cameras[self.index])
    }

    fn change(&self, lua: &Lua, change: impl FnOnce(&mut Camera)) {
        let mut scene = lock(&self.scene);
        let camera = &mut scene.cameras[self.index];
        camera.set_at = current_line(lua).map(|line| line.to_string());
        change(camera);
    }

    fn name(&self) -> String {
        format!("scene:camera({:?})", self.read(|camera| camera.name.clone()))
    }
}

class! {
    /// A pinhole camera of a scene.
    LuaCamera: "softvt.Camera" {
        label(this) { this.name() }
        fields {
            /// Name in the scene.
            name: "string" { get(_, this) { this.read(|camera| camera.name.clone()) } }
            /// Frame that the camera is fixed to.
            mount: "\"world\"|\"hand\"" { get(_, this) { this.read(|camera| camera.mount) } }
        }
        writable {
            /// Position of its centre.
            position: POINT => pose.translation.vector;
            /// Orientation: the camera looks along its −z axis, and +y is up in the image.
            quaternion: ORIENTATION => {
                get(lua, this) {
                    let numbers = this.read(|camera| wxyz(&camera.pose.rotation));
                    read_only_list(lua, numbers, "its numbers belong together: write camera.quaternion = { w, x, y, z }")?
                }
                set(lua, this, numbers: [f64; 4]) {
                    this.change(lua, |camera| camera.pose.rotation = rotation_from_wxyz(numbers).unwrap_or_default());
                }
            }
            /// Vertical field of view.
            fovy: FIELD_OF_VIEW => fovy_rad;
            /// Distance of the nearest visible point.
            near: NEAR => near_m;
            /// Distance of the farthest visible point.
            far: FAR => far_m;
            /// Width of the image, pixels.
            width: IMAGE_EDGE => width;
            /// Height of the image, pixels.
            height: IMAGE_EDGE => height;
        }
        methods {
            /// Turns the camera to a point; up (z by default) is the upward direction in the image. Both are in the
            /// frame of the mount.
            fn look_at(lua, this, point: [f64; 3] = POINT, up: Option<[f64; 3]>) -> [] {
                let from = this.read(|camera| camera.pose.translation.vector);
                let rotation = look_at(lua, &format!("{}:look_at", this.name()), &from, point, up)?;
                this.change(lua, |camera| camera.pose.rotation = rotation);
            }
        }
    }
}
