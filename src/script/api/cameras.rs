//! Light and cameras of a scene, for layouts and shifts.

use std::sync::{Arc, Mutex};

use mlua::Lua;

use super::{
    pose::{direction, rotation_from_wxyz, unit_direction, wxyz},
    visuals::{braced, colour},
};
use crate::{
    geometry::{Pose, Quat, Vec3},
    parallel::lock,
    scene::{Camera, CameraMount, Lighting, Scene},
    script::{
        schema::{Range, Type, choice, class, object::fixed_list, record},
        vm::error::{current_line, fail},
    },
    text::unknown_name,
};

/// Cameras of a scene; each renders its own images.
const MAX_CAMERAS: usize = 64;
/// Strengths and colours of lights, which may be brighter than white.
const BRIGHTNESS: Range = Range::closed(0.0, 1000.0);
const FIELD_OF_VIEW: Type = Type::Number("rad", Range::closed(0.01, 2.8));
const NEAR: Type = Type::Number("m", Range::closed(1e-4, 100.0));
const FAR: Type = Type::Number("m", Range::closed(1e-3, 1e4));
/// Width or height of a camera's image.
pub(crate) const IMAGE_EDGE: Type = Type::Integer(Range::closed(1.0, 4096.0));
const LINEAR_RGB: Type = Type::Vector(3, "linear RGB");
const POINT: Type = Type::Vector(3, "m, frame of the mount");
const ORIENTATION: Type = Type::Vector(4, "w, x, y, z, frame of the mount");

choice! { CameraMount { "world" => CameraMount::World, "hand" => CameraMount::Hand } }

record! {
    /// A camera. Give either look_at or quat.
    CameraSpec: "softvt.NewCamera" as "scene:add_camera" {
        /// Name, unique; also that of its image stream.
        name: String = Type::Name;
        /// Frame that the camera is fixed to; hand is panda_hand.
        mount: CameraMount => Text("world");
        /// Position.
        position: [f64; 3] = POINT;
        /// A point in the middle of the image.
        look_at: Option<[f64; 3]> = POINT;
        /// Upward direction in the image (with look_at); z by default.
        up: Option<[f64; 3]> = Type::Vector(3, "frame of the mount");
        /// Orientation: the camera looks along its −z axis, and +y is up in the image.
        quat: Option<[f64; 4]> = ORIENTATION;
        /// Vertical field of view.
        fovy: f64 = FIELD_OF_VIEW => Number(0.8);
        /// Nearest visible distance.
        near: f64 = NEAR => Number(0.01);
        /// Farthest visible distance.
        far: f64 = FAR => Number(20.0);
        /// Width of the image, pixels.
        width: usize = IMAGE_EDGE => Integer(224);
        /// Height of the image, pixels.
        height: usize = IMAGE_EDGE => Integer(224);
    }
}

type SharedScene = Arc<Mutex<Scene>>;

/// `softvt.Light`.
#[derive(Clone)]
pub(crate) struct LuaLight(pub SharedScene);

impl LuaLight {
    fn read<T>(&self, read: impl FnOnce(&Lighting) -> T) -> T {
        read(&lock(&self.0).lighting)
    }

    fn change(&self, change: impl FnOnce(&mut Lighting)) {
        change(&mut lock(&self.0).lighting);
    }
}

/// Checks the colour that is written to the field `key` of the light.
fn light_colour(lua: &Lua, key: &str, rgb: [f64; 3]) -> mlua::Result<[f64; 3]> {
    colour(lua, &format!("scene.light.{key}"), rgb, BRIGHTNESS.max)
}

class! {
    /// The light of a scene: a key light and a sky.
    LuaLight: "softvt.Light" {
        label(_) { "scene.light".to_owned() }
        writable {
            /// Direction to the key light.
            direction: Type::Vector(3, "world, any length") => {
                get(_, this) { this.read(|light| light.key.direction_w) }
                set(lua, this, numbers: [f64; 3]) {
                    let Some(direction) = direction(numbers) else {
                        let got = braced(&numbers);
                        return Err(fail(lua, format!("scene.light.direction: expected a direction, got {got}")));
                    };
                    this.change(|light| light.key.direction_w = direction);
                }
            }
            /// Colour of the key light.
            colour: LINEAR_RGB => {
                get(_, this) { this.read(|light| light.key.colour) }
                set(lua, this, rgb: [f64; 3]) {
                    let rgb = light_colour(lua, "colour", rgb)?;
                    this.change(|light| light.key.colour = rgb);
                }
            }
            /// Strength of the key light; 1 shows a white surface at full value.
            strength: Type::Number("", BRIGHTNESS) => {
                get(_, this) { this.read(|light| light.key.strength) }
                set(_, this, value: f64) { this.change(|light| light.key.strength = value); }
            }
            /// Half of the angle under which the key light is seen; larger values give softer shadows.
            softness: Type::Number("rad", Range::closed(0.0, 0.5)) => {
                get(_, this) { this.read(|light| light.key.softness_rad) }
                set(_, this, value: f64) { this.change(|light| light.key.softness_rad = value); }
            }
            /// Light from straight above.
            sky_zenith: LINEAR_RGB => {
                get(_, this) { this.read(|light| light.sky.zenith) }
                set(lua, this, rgb: [f64; 3]) {
                    let rgb = light_colour(lua, "sky_zenith", rgb)?;
                    this.change(|light| light.sky.zenith = rgb);
                }
            }
            /// Light from the horizon, and the background.
            sky_horizon: LINEAR_RGB => {
                get(_, this) { this.read(|light| light.sky.horizon) }
                set(lua, this, rgb: [f64; 3]) {
                    let rgb = light_colour(lua, "sky_horizon", rgb)?;
                    this.change(|light| light.sky.horizon = rgb);
                }
            }
            /// Light from straight below.
            sky_ground: LINEAR_RGB => {
                get(_, this) { this.read(|light| light.sky.ground) }
                set(lua, this, rgb: [f64; 3]) {
                    let rgb = light_colour(lua, "sky_ground", rgb)?;
                    this.change(|light| light.sky.ground = rgb);
                }
            }
            /// Factor on the sky.
            sky_strength: Type::Number("", BRIGHTNESS) => {
                get(_, this) { this.read(|light| light.sky.strength) }
                set(_, this, value: f64) { this.change(|light| light.sky.strength = value); }
            }
            /// Factor on the whole image.
            exposure: Type::Number("", Range { max: 1000.0, ..Range::POSITIVE }) => {
                get(_, this) { this.read(|light| light.exposure) }
                set(_, this, value: f64) { this.change(|light| light.exposure = value); }
            }
        }
    }
}

/// `softvt.Camera`, by its index in the scene.
#[derive(Clone)]
pub(crate) struct LuaCamera {
    scene: SharedScene,
    index: usize,
}

fn orientation(lua: &Lua, label: &str, numbers: [f64; 4]) -> mlua::Result<Quat> {
    rotation_from_wxyz(numbers).ok_or_else(|| {
        fail(lua, format!("{label}.quat: expected a quaternion other than 0, got {}", braced(&numbers)))
    })
}

const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// The orientation of a camera at `from` that looks at `to`, with `up` upwards in the image.
fn look_at(lua: &Lua, label: &str, from: &Vec3, to: &Vec3, up: [f64; 3]) -> mlua::Result<Quat> {
    if from.amax().max(to.amax()) > 1e6 {
        let (from, to) = (braced(from.as_slice()), braced(to.as_slice()));
        return Err(fail(lua, format!("{label}: expected numbers within ±1e6, got {to} from {from}")));
    }
    let ahead = to - from;
    let up = unit_direction(up);
    match up.filter(|up| ahead.norm() > 1e-6 && ahead.cross(up).norm() > 1e-6 * ahead.norm()) {
        Some(up) => Ok(Quat::face_towards(&-ahead, &up)),
        None => {
            let message = "expected a point away from the camera, not straight along up; give another up";
            Err(fail(lua, format!("{label}: {message}")))
        }
    }
}

impl LuaCamera {
    /// The scene's camera of a name.
    pub(crate) fn named(lua: &Lua, scene: &SharedScene, name: &str) -> mlua::Result<Self> {
        let cameras = lock(scene);
        let names = cameras.cameras.iter().map(|camera| camera.name.as_str());
        match cameras.cameras.iter().position(|camera| camera.name == name) {
            Some(index) => Ok(Self { scene: scene.clone(), index }),
            None => Err(fail(lua, format!("scene:camera: {}", unknown_name("camera", name, names)))),
        }
    }

    /// Adds a camera to the scene.
    pub(crate) fn add(lua: &Lua, scene: &SharedScene, spec: CameraSpec) -> mlua::Result<Self> {
        const LABEL: &str = "scene:add_camera";
        let position = Vec3::from(spec.position);
        let rotation = match (spec.look_at, spec.quat) {
            (Some(point), None) => {
                let label = format!("{LABEL}.look_at");
                look_at(lua, &label, &position, &Vec3::from(point), spec.up.unwrap_or(UP))?
            }
            (None, Some(numbers)) => orientation(lua, LABEL, numbers)?,
            _ => return Err(fail(lua, format!("{LABEL}: give either look_at or quat"))),
        };
        let mut inner = lock(scene);
        if inner.camera(&spec.name).is_some() {
            let name = &spec.name;
            let message =
                format!("{LABEL}: there is a camera {name:?} already; change it by scene:camera({name:?})");
            return Err(fail(lua, message));
        }
        if inner.cameras.len() >= MAX_CAMERAS {
            return Err(fail(lua, format!("{LABEL}: a scene has at most {MAX_CAMERAS} cameras")));
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
            /// Name.
            name: "string" { get(_, this) { this.read(|camera| camera.name.clone()) } }
            /// Frame that the camera is fixed to.
            mount: "\"world\"|\"hand\"" {
                get(_, this) {
                    match this.read(|camera| camera.mount) {
                        CameraMount::World => "world",
                        CameraMount::Hand => "hand",
                    }
                }
            }
        }
        writable {
            /// Position.
            position: POINT => {
                get(_, this) { this.read(|camera| camera.pose.translation.vector) }
                set(lua, this, xyz: [f64; 3]) {
                    this.change(lua, |camera| camera.pose.translation.vector = xyz.into());
                }
            }
            /// Orientation: the camera looks along its −z axis, and +y is up in the image.
            quat: ORIENTATION => {
                get(lua, this) {
                    let quat = this.read(|camera| wxyz(&camera.pose.rotation));
                    fixed_list(lua, quat, "its numbers belong together: write camera.quat = { w, x, y, z }")?
                }
                set(lua, this, numbers: [f64; 4]) {
                    let rotation = orientation(lua, &this.name(), numbers)?;
                    this.change(lua, |camera| camera.pose.rotation = rotation);
                }
            }
            /// Vertical field of view.
            fovy: FIELD_OF_VIEW => {
                get(_, this) { this.read(|camera| camera.fovy_rad) }
                set(lua, this, value: f64) { this.change(lua, |camera| camera.fovy_rad = value); }
            }
            /// Nearest visible distance.
            near: NEAR => {
                get(_, this) { this.read(|camera| camera.near_m) }
                set(lua, this, value: f64) { this.change(lua, |camera| camera.near_m = value); }
            }
            /// Farthest visible distance.
            far: FAR => {
                get(_, this) { this.read(|camera| camera.far_m) }
                set(lua, this, value: f64) { this.change(lua, |camera| camera.far_m = value); }
            }
            /// Width of the image, pixels.
            width: IMAGE_EDGE => {
                get(_, this) { this.read(|camera| camera.width) }
                set(lua, this, value: usize) { this.change(lua, |camera| camera.width = value); }
            }
            /// Height of the image, pixels.
            height: IMAGE_EDGE => {
                get(_, this) { this.read(|camera| camera.height) }
                set(lua, this, value: usize) { this.change(lua, |camera| camera.height = value); }
            }
        }
        methods {
            /// Turns the camera to a point; up (z by default) is the upward direction in the image. Both are in the frame
            /// of the mount.
            fn look_at(lua, this, point: [f64; 3] = POINT, up: Option<[f64; 3]>) -> [] {
                let from = this.read(|camera| camera.pose.translation.vector);
                let label = format!("{}:look_at", this.name());
                let rotation = look_at(lua, &label, &from, &point.into(), up.unwrap_or(UP))?;
                this.change(lua, |camera| camera.pose.rotation = rotation);
            }
        }
    }
}
