//! The scene that layouts and shifts change.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use mlua::{IntoLua, Lua, Table};

use super::{
    assets::{AssetSpec, COEFFICIENT, DENSITY, PASCALS, POISSON},
    cameras::{CameraSpec, LuaCamera, LuaLight},
    index_of, joints,
    pose::ANGLES,
    visuals::LuaMaterial,
};
use crate::{
    schema::{Constructed, Range, Type, class, object::read_only_list, record},
    vm::error::{app_data, author_line, fail},
};
use softvt_common::{parallel::lock, range::RangeError, text::is_control};
use softvt_geometry::{Aabb, Pose, Quat, Vec3};
use softvt_physics::{STANDARD_GRAVITY, contact::Friction, fem::ElasticMaterial};
use softvt_robot::panda::{self, ARM_DOFS};
use softvt_rollout::AssetCache;
use softvt_scene::{Asset, Body, Camera, Lighting, MAX_OBJECTS, Object, Scene};

/// Start pose of the arm as in SoftVTBench (from the released code): the hand above the table, pointing down.
const START_Q: [f64; ARM_DOFS] = [-0.01988, -0.18734, 0.00767, -2.40340, 0.00496, 2.24534, 0.79485];

/// Largest coordinate, m: beyond it floating-point positions are too coarse for a grasp.
const MAX_COORDINATE: f64 = 1e3;

const POSITION: Type = Type::Vector(3, "m, world", COORDINATE);
const COORDINATE: Range = Range::closed(-MAX_COORDINATE, MAX_COORDINATE).usually(-3.0, 3.0);
pub(crate) const COATING: Type = Type::Number("", Range::above(0.0, 10.0));
/// Rotation about the vertical.
pub(crate) const YAW: Type = Type::Number("rad", ANGLES);
const SCALE: Type = Type::Number("", Range::closed(0.1, 10.0));
const CORNER: Type = Type::Vector(3, "m, world", Range::ANY.usually(-5.0, 5.0));

/// A scene without objects: robot base and workspace of the table scenes.
pub(crate) fn empty_scene() -> Scene {
    Scene {
        objects: Vec::new(),
        base_w: Pose::translation(-0.66, 0.0, 0.012),
        start_q: START_Q,
        gravity: STANDARD_GRAVITY,
        workspace: Aabb { min: Vec3::new(-0.5, -0.6, -0.05), max: Vec3::new(0.5, 0.6, 1.0) },
        lighting: Lighting::default(),
        cameras: vec![Camera::third_person_table(), Camera::wrist()],
    }
}

record! {
    /// Placement of an asset. Give either at or position.
    PlacementSpec: "softvt.Place" as "scene:add" {
        /// Name in the scene, unique.
        name: String = Type::Name;
        /// Asset of the object.
        asset: Constructed<AssetSpec>;
        /// Position x, y; the object rests on the table, or on the object that `on` names.
        at: Option<[f64; 2]> = Type::Vector(2, "m, world", COORDINATE);
        /// Position of its origin: its lowest point, on the centre line.
        position: Option<[f64; 3]> = POSITION;
        /// Rotation about the vertical.
        yaw: f64 = YAW => Number(0.0);
        /// Scene name of the object or part (cabinet.top_drawer) that it rests on (with at).
        on: Option<String>;
        /// Size relative to that of the asset. Its material stays, and its mass follows as the cube.
        scale: f64 = SCALE => Number(1.0);
        /// Start values of an articulated object's joints by part; 0, or the nearest limit, by default.
        joints: Option<BTreeMap<String, f64>> = Type::Map(&Type::Number("m or rad", Range::ANY));
    }
}

/// Checks joint angles against the limits of the arm, rad.
fn check_joint_limits(lua: &Lua, q: &[f64; ARM_DOFS]) -> mlua::Result<()> {
    for (at, (link, q)) in (1..).zip(panda::arm_chain().links.iter().zip(q)) {
        let limits = Range::closed(link.lower, link.upper);
        let checked = limits.check(&format!("scene.start_q[{at}]"), *q, "rad");
        checked.map_err(|error| fail(lua, error))?;
    }
    Ok(())
}

#[derive(Clone)]
pub(crate) struct LuaScene {
    pub scene: Arc<Mutex<Scene>>,
    /// The task, for shifts; `None` for layouts, which several tasks may share.
    task: Option<Arc<Mutex<SceneTask>>>,
    /// Assets by their tables: two objects of one table share an asset.
    assets: Arc<Mutex<Vec<ReadAsset>>>,
}

/// The task as a shift sees and changes it.
struct SceneTask {
    object: String,
    prompt: String,
}

/// An asset with the Lua table that it was read from.
struct ReadAsset {
    table: Table,
    asset: Arc<Asset>,
}

impl LuaScene {
    pub(crate) fn new(scene: Scene) -> Self {
        Self { scene: Arc::new(Mutex::new(scene)), task: None, assets: Arc::default() }
    }

    pub(crate) fn for_task(self, object: &str, prompt: &str) -> Self {
        let task = SceneTask { object: object.to_owned(), prompt: prompt.to_owned() };
        Self { task: Some(Arc::new(Mutex::new(task))), ..self }
    }

    /// The instruction of the task; `None` in layouts.
    pub(crate) fn prompt(&self) -> Option<String> {
        self.task.as_ref().map(|task| lock(task).prompt.clone())
    }

    fn goal_object(&self) -> Option<LuaObject> {
        let name = lock(self.task.as_ref()?).object.clone();
        let index = self.read(|scene| scene.objects.iter().position(|object| object.name == name))?;
        Some(LuaObject { scene: self.scene.clone(), index })
    }

    fn set_prompt(&self, lua: &Lua, prompt: String) -> mlua::Result<()> {
        let Some(task) = &self.task else {
            bail!(lua, "scene.prompt: a layout has no prompt; set it in softvt.task or in a shift");
        };
        if prompt.trim().is_empty() || prompt.contains(is_control) {
            bail!(lua, "scene.prompt: expected one line of text, got {prompt:?}");
        }
        lock(task).prompt = prompt;
        Ok(())
    }

    fn read<T>(&self, read: impl FnOnce(&Scene) -> T) -> T {
        read(&lock(&self.scene))
    }

    fn change(&self, _: &Lua, change: impl FnOnce(&mut Scene)) {
        change(&mut lock(&self.scene));
    }

    fn asset(&self, lua: &Lua, made: &Constructed<AssetSpec>) -> mlua::Result<Arc<Asset>> {
        let mut assets = lock(&self.assets);
        let pointer = made.table.to_pointer();
        if let Some(ReadAsset { asset, .. }) = assets.iter().find(|known| known.table.to_pointer() == pointer)
        {
            return Ok(asset.clone());
        }
        let asset = Arc::new(made.asset(lua)?);
        assets.push(ReadAsset { table: made.table.clone(), asset: asset.clone() });
        Ok(asset)
    }

    fn add(&self, lua: &Lua, spec: PlacementSpec) -> mlua::Result<()> {
        let asset = self.asset(lua, &spec.asset)?;
        let mut scene = lock(&self.scene);
        let name = spec.name.clone();
        if scene.objects.iter().any(|object| object.name == name) {
            bail!(lua, "scene:add: there is an object {name:?} already; give another name");
        }
        // A layout that adds more contains an endless loop.
        if scene.objects.len() >= MAX_OBJECTS {
            bail!(lua, "scene:add: a scene holds at most {MAX_OBJECTS} objects");
        }
        let at = position(lua, &scene, &spec)?;
        let rotation = Quat::from_axis_angle(&Vec3::z_axis(), spec.yaw);
        let joints = joints::start_values(lua, &asset, spec.joints.as_ref())?;
        let placed_at = author_line(lua).map(|line| line.to_string()).unwrap_or_default();
        let pose_w = Pose::from_parts(at.into(), rotation);
        let mut object = Object { joints, placed_at, ..Object::new(&name, asset, pose_w) };
        if spec.scale != 1.0 {
            rescale(lua, "scene:add: scale", &mut object, spec.scale)?;
        }
        scene.objects.push(object);
        Ok(())
    }
}

/// Gives an object another size. `label` names the value in the message for one that cannot have it.
fn rescale(lua: &Lua, label: &str, object: &mut Object, scale: f64) -> mlua::Result<()> {
    if !object.is_scalable() {
        bail!(lua, "{label}: object {:?} is articulated; declare an asset of that size", object.name);
    }
    object.set_scale(scale);
    Ok(())
}

/// The position of an object that is added to the scene.
fn position(lua: &Lua, scene: &Scene, spec: &PlacementSpec) -> mlua::Result<Vec3> {
    match (spec.at, spec.position, &spec.on) {
        (None, Some(position), None) => Ok(position.into()),
        (Some([x, y]), None, on) => {
            let Some(on) = on else { return Ok(Vec3::new(x, y, 0.0)) };
            let (object, part) = on.split_once('.').map_or((on.as_str(), None), |(o, p)| (o, Some(p)));
            let support = &scene.objects[find(lua, scene, object)?];
            if let Some(part) = part {
                let parts = support.asset.parts().iter().map(|part| part.name.as_str());
                index_of(lua, &format!("scene:add: on: object {object:?}"), "part", parts, part)?;
            }
            let height = top(support, part, x, y)
                .ok_or_else(|| fail!(lua, "scene:add: on: nothing of {on:?} is below ({x}, {y}) m"))?;
            Ok(Vec3::new(x, y, height))
        }
        _ => Err(fail!(lua, "scene:add: give either at = {{ x, y }} or position = {{ x, y, z }}")),
    }
}

/// Horizontal distance from a point to the nearest circle around the frame of an object that encloses the object, m.
/// Scenery and surfaces at or below z = 0 do not count. Infinite in an empty scene.
fn distance_to_objects(scene: &Scene, assets: &AssetCache, x: f64, y: f64) -> f64 {
    /// Height below which an object is a support, m.
    const SUPPORT: f64 = 1e-3;
    let distance = |object: &Object, bounds: &Aabb| {
        let centre = object.pose_w.translation.vector;
        if centre.z + bounds.max.z <= SUPPORT {
            return f64::INFINITY;
        }
        let reach = |low: f64, high: f64| low.abs().max(high.abs());
        let radius = reach(bounds.min.x, bounds.max.x).hypot(reach(bounds.min.y, bounds.max.y));
        (centre.x - x).hypot(centre.y - y) - radius
    };
    let mut nearest = f64::INFINITY;
    for object in scene.objects.iter().filter(|object| !matches!(object.asset.body, Body::Scenery)) {
        // Tight bounds take a hundred times as long and are farther away.
        if distance(object, &object.asset.shape.loose_bounds()) < nearest {
            nearest = nearest.min(distance(object, &assets.bounds(&object.asset.shape)));
        }
    }
    nearest
}

/// Height of the surface of an object, or of one of its parts, at (x, y) of the world, m.
fn top(object: &Object, part: Option<&str>, x: f64, y: f64) -> Option<f64> {
    /// Start of the ray, above everything that can be placed on a table, m.
    const START: f64 = 2.0;
    let length = joints::first_hit(&object.asset, &object.joints, part, |asset, pose| {
        let pose_w = object.pose_w * pose;
        let start = pose_w.inverse_transform_point(&nalgebra::Point3::new(x, y, START)).coords;
        let down = pose_w.rotation.inverse_transform_vector(&-Vec3::z());
        asset.shape.ray(&start, &down, 2.0 * START)
    });
    length.map(|length| START - length)
}

fn find(lua: &Lua, scene: &Scene, name: &str) -> mlua::Result<usize> {
    index_of(lua, "scene", "object", scene.objects.iter().map(|object| object.name.as_str()), name)
}

class! {
    /// The scene that a layout or a shift builds.
    LuaScene: "softvt.Scene" {
        label(_) { "scene".to_owned() }
        fields {
            /// The placed objects, in order.
            objects: "softvt.Object[]" {
                get(lua, this) {
                    let count = this.read(|scene| scene.objects.len());
                    let handles = (0..count).map(|index| LuaObject { scene: this.scene.clone(), index });
                    read_only_list(lua, handles, "scene:add{…} adds an object")?
                }
            }
            /// The object of the task's goal, in shifts; nil in layouts, which several tasks may share.
            goal_object: "softvt.Object?" { get(lua, this) { this.goal_object().into_lua(lua)? } }
            /// Key light and sky.
            light: "softvt.Light" or "its numbers are written one by one, as in scene.light.strength = …" {
                get(_, this) { LuaLight(this.scene.clone()) }
            }
        }
        writable {
            /// Position of the robot base.
            base: POSITION => base_w.translation.vector;
            /// Joint angles of the arm at the start, within its limits.
            start_q: Type::vector(7, "rad") => {
                get(_, this) { this.read(|scene| scene.start_q) }
                set(lua, this, q: [f64; ARM_DOFS]) {
                    check_joint_limits(lua, &q)?;
                    this.change(lua, |scene| scene.start_q = q);
                }
            }
            /// The instruction of the task, in shifts; nil in layouts.
            prompt: Type::Text => {
                get(_, this) { this.prompt() }
                set(lua, this, prompt: String) { this.set_prompt(lua, prompt)?; }
            }
            /// Acceleration of gravity.
            gravity: Type::Vector(3, "m/s², world", Range::closed(-100.0, 100.0)) => gravity;
            /// Lowest corner of the workspace.
            workspace_min: CORNER => workspace.min;
            /// Highest corner of the workspace.
            workspace_max: CORNER => workspace.max;
        }
        methods {
            /// Adds an object: `scene:add { name = "left", asset = bun, at = { 0.1, -0.2 }, yaw = 0.5 }`.
            fn add(lua, this, spec: PlacementSpec) -> [] { this.add(lua, spec)? }
            /// Returns a placed object by name.
            fn object(lua, this, name: String) -> ["softvt.Object"] {
                let index = find(lua, &lock(&this.scene), &name)?;
                LuaObject { scene: this.scene.clone(), index }
            }
            /// Returns the horizontal distance from a point to the nearest object, taken as an upright cylinder about
            /// its origin, m; negative inside of one. Surfaces at or below z = 0 and scenery do not count.
            fn distance_to_objects(lua, this, x: f64, y: f64) -> ["number"] {
                let assets = app_data::<AssetCache>(lua)?;
                this.read(|scene| distance_to_objects(scene, &assets, x, y))
            }
            /// Returns a camera by name; every scene has third_person and wrist.
            fn camera(lua, this, name: String) -> ["softvt.Camera"] { LuaCamera::named(lua, &this.scene, &name)? }
            /// Adds a camera and returns it.
            fn add_camera(lua, this, spec: CameraSpec) -> ["softvt.Camera"] {
                LuaCamera::add(lua, &this.scene, spec)?
            }
        }
    }
}

#[derive(Clone)]
pub(crate) struct LuaObject {
    scene: Arc<Mutex<Scene>>,
    index: usize,
}

impl LuaObject {
    fn read<T>(&self, read: impl FnOnce(&Object) -> T) -> T {
        read(&lock(&self.scene).objects[self.index])
    }

    fn change(&self, _: &Lua, change: impl FnOnce(&mut Object)) {
        change(&mut lock(&self.scene).objects[self.index]);
    }

    /// Changes the body. `change` returns `None` if the body has no `key`.
    fn change_body(
        &self,
        lua: &Lua,
        key: &str,
        change: impl FnOnce(&mut Body) -> Option<Result<(), RangeError>>,
    ) -> mlua::Result<()> {
        let mut scene = lock(&self.scene);
        let object = &mut scene.objects[self.index];
        let problem = match change(&mut Arc::make_mut(&mut object.asset).body) {
            Some(Ok(())) => return Ok(()),
            Some(Err(error)) => format!("object.{error}"),
            None => format!("object.{key}: the body of object {:?} has no {key}", object.name),
        };
        Err(fail(lua, problem))
    }

    fn change_elastic(
        &self,
        lua: &Lua,
        key: &str,
        change: impl FnOnce(ElasticMaterial) -> Result<ElasticMaterial, RangeError>,
    ) -> mlua::Result<()> {
        self.change_body(lua, key, |body| match body {
            Body::Soft(soft) => Some(change(soft.elastic).map(|elastic| soft.elastic = elastic)),
            _ => None,
        })
    }

    fn change_friction(&self, lua: &Lua, change: impl FnOnce(&mut Friction)) {
        self.change(lua, |object| {
            let asset = Arc::make_mut(&mut object.asset);
            change(&mut asset.friction);
            // The parts of an object have the friction of the whole.
            if let Body::Articulated(parts) = &mut asset.body {
                let friction = asset.friction;
                parts.iter_mut().for_each(|part| Arc::make_mut(&mut part.asset).friction = friction);
            }
        });
    }
}

class! {
    /// A placed object. Numbers of its material are nil where the body has none: youngs_pa and poisson belong to soft
    /// bodies, density to soft and rigid ones.
    LuaObject: "softvt.Object" {
        label(_) { "object".to_owned() }
        fields {
            /// Name in the scene.
            name: "string" { get(_, this) { this.read(|object| object.name.clone()) } }
            /// Name of its asset.
            asset: "string" { get(_, this) { this.read(|object| object.asset.name.clone()) } }
            /// The base materials of its visuals, by material id.
            materials: "softvt.Material[]" {
                get(lua, this) {
                    let hint = "write the numbers of a material, as in materials[1].roughness = 0.5";
                    read_only_list(lua, LuaMaterial::all(&this.scene, this.index), hint)?
                }
            }
            /// Start values of its joints by part, m or rad.
            joints: "table<string, number>" {
                get(lua, this) {
                    this.read(|object| {
                        let names = object.asset.parts().iter().map(|part| part.name.as_str());
                        lua.create_table_from(names.zip(object.joints.iter().copied()))
                    })?
                }
            }
        }
        writable {
            /// Position of its origin: its lowest point, on the centre line.
            position: POSITION => pose_w.translation.vector;
            /// Rotation about the vertical.
            yaw: YAW => {
                get(_, this) { this.read(|object| object.pose_w.rotation.euler_angles().2) }
                set(lua, this, yaw: f64) {
                    let rotation = Quat::from_axis_angle(&Vec3::z_axis(), yaw);
                    this.change(lua, |object| object.pose_w.rotation = rotation);
                }
            }
            /// Size relative to that of its asset. Material numbers stay, and the mass follows as the cube.
            scale: SCALE => {
                get(_, this) { this.read(|object| object.scale) }
                set(lua, this, scale: f64) {
                    rescale(lua, "object.scale", &mut lock(&this.scene).objects[this.index], scale)?;
                }
            }
            /// Density of a soft or rigid body.
            density: DENSITY => {
                get(_, this) { this.read(|object| object.asset.density()) }
                set(lua, this, value: f64) {
                    this.change_body(lua, "density", |body| match body {
                        Body::Soft(soft) => {
                            Some(soft.elastic.with_density(value).map(|elastic| soft.elastic = elastic))
                        }
                        Body::Rigid { density } => {
                            *density = value;
                            Some(Ok(()))
                        }
                        _ => None,
                    })?
                }
            }
            /// Young's modulus of a soft body.
            youngs_pa: PASCALS => {
                get(_, this) { this.read(|object| object.asset.elastic().map(|elastic| elastic.youngs_pa())) }
                set(lua, this, value: f64) {
                    this.change_elastic(lua, "youngs_pa", |elastic| elastic.with_youngs_pa(value))?
                }
            }
            /// Poisson's ratio of a soft body.
            poisson: POISSON => {
                get(_, this) { this.read(|object| object.asset.elastic().map(|elastic| elastic.poisson())) }
                set(lua, this, value: f64) {
                    this.change_elastic(lua, "poisson", |elastic| elastic.with_poisson(value))?
                }
            }
            /// Static coefficient of friction.
            static_mu: COEFFICIENT => {
                get(_, this) { this.read(|object| object.asset.friction.static_mu) }
                set(lua, this, value: f64) { this.change_friction(lua, |friction| friction.static_mu = value); }
            }
            /// Dynamic coefficient of friction.
            dynamic_mu: COEFFICIENT => {
                get(_, this) { this.read(|object| object.asset.friction.dynamic_mu) }
                set(lua, this, value: f64) { this.change_friction(lua, |friction| friction.dynamic_mu = value); }
            }
            /// Static coefficient of a coating (flour, oil, glaze), which is that of every pair with this object; the
            /// dynamic one is 0.8 of it. Nil without a coating.
            coating: COATING => {
                get(_, this) { this.read(|object| object.coating()) }
                set(lua, this, value: f64) { this.change_friction(lua, |friction| *friction = Friction::coated(value)); }
            }
        }
        methods {
            /// Returns the mass of a soft or rigid body, of one moving part of an articulated object, or of all its
            /// moving parts, kg; nil for what never moves.
            fn mass(lua, this, part: Option<String>) -> ["number?"] {
                let scene = lock(&this.scene);
                let object = &scene.objects[this.index];
                let parts = object.asset.parts();
                match part {
                    None => object.asset.mass(),
                    Some(_) if parts.is_empty() => {
                        bail!(lua, "object:mass: object {:?} has no parts", object.name);
                    }
                    Some(name) => {
                        let names = parts.iter().map(|part| part.name.as_str());
                        Some(parts[index_of(lua, "object:mass", "part", names, &name)?].mass())
                    }
                }
            }
            /// Multiplies the density of a soft or rigid body, or of every moving part. Static objects are unchanged.
            fn scale_mass(lua, this, factor: f64 = Type::Number("", Range::closed(1e-6, 1e6))) -> [] {
                let scaled = Arc::make_mut(&mut lock(&this.scene).objects[this.index].asset).scale_mass(factor);
                scaled.map_err(|error| fail!(lua, "object:scale_mass: {error}"))?
            }
        }
    }
}
