//! Shapes in Lua: immutable values with chained methods.

use std::sync::Arc;

use mlua::{FromLua, Lua, Table, UserDataMethods, Value};

use crate::geometry::{
    Quat, Vec3,
    import::{ImportOptions, MeshFormat, import},
    mass::mass_properties,
    shape::{Axis, Bumps, Displacement, Ramp, Ridges, Shape, ShapeError, TreeSize},
};
use crate::script::{
    api::catalogue_classes::{Class, SHAPE},
    api::catalogue_shapes as table,
    schema::userdata::{self as host, Hosted, hosted, method},
    schema::{self, checked},
    vm::memory_budget::{Held, hold},
    vm::{fail, here, locked, shared},
};

/// Largest tree of a shape: every question about a point goes through all of it.
const MOST: TreeSize = TreeSize { nodes: 2000, depth: 100, work: 1e5 };

/// `softvt.Shape`.
#[derive(Clone, Debug)]
pub(crate) struct LuaShape(Arc<Node>);

#[derive(Debug)]
struct Node {
    shape: Shape,
    /// What it keeps in memory, bytes; what it shares with others counts for each of them.
    bytes: usize,
    _held: Held,
}

impl LuaShape {
    /// The shape.
    pub(crate) fn shape(&self) -> &Shape {
        &self.0.shape
    }

    /// What it keeps in memory, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.0.bytes
    }

    /// Takes a shape into the machine that keeps `more` bytes besides its own tree, if it can be and is not too large.
    fn new(lua: &Lua, shape: Shape, more: usize) -> mlua::Result<Self> {
        let TreeSize { nodes, depth, work } = shape.tree_size();
        if work > MOST.work {
            let message = "shape: too many cuts or unions stand in one another to be computed with; join the parts by union \
                           first (a:union(b):union(c)), and cut or join them at once";
            return Err(fail(lua, message));
        }
        if nodes > MOST.nodes || depth > MOST.depth {
            return Err(fail(
                lua,
                format!(
                    "shape: is made of {nodes} shapes, {depth} deep; at most {} and {} can be computed with; use fewer, or a mesh",
                    MOST.nodes, MOST.depth
                ),
            ));
        }
        shape.validate().map_err(|error| fail(lua, format!("shape.{error}")))?;
        let bytes = nodes * size_of::<Shape>() + more;
        Ok(Self(Arc::new(Node { shape, bytes, _held: hold(lua, bytes)? })))
    }

    /// A shape made of this one and `others`.
    fn derived(&self, lua: &Lua, shape: Shape, others: &[&Self]) -> mlua::Result<Self> {
        let own = |shape: &Self| shape.0.bytes - shape.0.shape.tree_size().nodes * size_of::<Shape>();
        let more = others.iter().map(|other| own(other)).sum::<usize>() + own(self);
        Self::new(lua, shape, more)
    }
}

impl FromLua for LuaShape {
    fn from_lua(value: Value, lua: &Lua) -> mlua::Result<Self> {
        match value.as_userdata().and_then(|data| data.borrow::<Self>().ok()) {
            Some(shape) => Ok(shape.clone()),
            None => {
                Err(fail(lua, format!("expected a shape (softvt.shape.…{{…}}), got {}", schema::got(&value))))
            }
        }
    }
}

/// A corner of a profile with its edge, bytes.
const BYTES_A_CORNER: usize = 128;
/// A solid takes about so many times the bytes of its file.
const MESH_TO_FILE: usize = 8;

/// Installs `softvt.shape`.
pub(crate) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    let shapes = lua.create_table()?;
    for (name, record) in table::SHAPES {
        let make = lua.create_function(move |lua, value: Value| {
            let spec = checked(lua, record, &value)?;
            let shape = build(name, &spec)?.map_err(|error| fail(lua, format!("shape.{error}")))?;
            let corners =
                spec.get::<Option<Table>>("corners").ok().flatten().map_or(0, |list| list.raw_len());
            LuaShape::new(lua, shape, corners * BYTES_A_CORNER)
        })?;
        shapes.set(*name, make)?;
    }
    api.set("shape", shapes)?;
    api.set("mesh", lua.create_function(|lua, value: Value| mesh(lua, &value))?)
}

/// `softvt.mesh{…}`: the file is read once, into the bundle; messages name it.
fn mesh(lua: &Lua, value: &Value) -> mlua::Result<LuaShape> {
    let spec = checked(lua, &table::MESH, value)?;
    let path: String = spec.get("file")?;
    let shared = shared(lua)?;
    let bytes = {
        let mut library = locked(&shared.library);
        let asker = here(lua).map(|(file, _)| file);
        let file = library.data(&path, asker.as_deref());
        let file = file.map_err(|message| fail(lua, format!("mesh.file: {message}")))?;
        library.bytes(&file).unwrap_or_default()
    };
    drop(hold(lua, MESH_TO_FILE * bytes.len())?);
    let extension = path.rsplit_once('.').map_or("", |(_, extension)| extension);
    let options = ImportOptions { scale: spec.get("scale")?, z_up: spec.get("z_up")? };
    let shape = MeshFormat::from_extension(extension)
        .and_then(|format| import(&bytes, format, &options))
        .and_then(|mesh| Ok(Shape::from_mesh(mesh)?));
    let shape = shape.map_err(|error| fail(lua, format!("mesh: {path}: {error}")))?;
    LuaShape::new(lua, shape, MESH_TO_FILE * bytes.len())
}

fn vec3(spec: &Table, key: &str) -> mlua::Result<Vec3> {
    spec.get::<[f64; 3]>(key).map(Vec3::from)
}

fn corners(spec: &Table) -> mlua::Result<Vec<[f64; 2]>> {
    spec.get("corners")
}

fn build(name: &str, spec: &Table) -> mlua::Result<Result<Shape, ShapeError>> {
    Ok(match name {
        "box" => Ok(Shape::cuboid(vec3(spec, "size")?)),
        "sphere" => Ok(Shape::Sphere { radius: spec.get("radius")? }),
        "ellipsoid" => Ok(Shape::Ellipsoid { radii: 0.5 * vec3(spec, "size")? }),
        "capsule" => {
            let (radius, length): (f64, f64) = (spec.get("radius")?, spec.get("length")?);
            Ok(Shape::Capsule { radius, half_length: 0.5 * length - radius })
        }
        "cylinder" => {
            Ok(Shape::Cylinder { radius: spec.get("radius")?, half_height: 0.5 * spec.get::<f64>("height")? })
        }
        "torus" => Ok(Shape::Torus { major: spec.get("major")?, minor: spec.get("minor")? }),
        "wedge" => Shape::wedge(vec3(spec, "size")?, spec.get("apex")?),
        "prism" => Shape::prism(corners(spec)?, spec.get("length")?),
        _ => Shape::lathe(corners(spec)?),
    })
}

fn axis(spec: &Table, key: &str) -> mlua::Result<Axis> {
    Ok(match spec.get::<String>(key)?.as_str() {
        "x" => Axis::X,
        "y" => Axis::Y,
        _ => Axis::Z,
    })
}

fn mask(spec: &Table) -> mlua::Result<Option<Ramp>> {
    let Some(mask) = spec.get::<Option<Table>>("mask")? else { return Ok(None) };
    Ok(Some(Ramp { axis: axis(&mask, "axis")?, from: mask.get("from")?, to: mask.get("to")? }))
}

fn ridges(spec: &Table) -> mlua::Result<Displacement> {
    let pitch = |key: &str| spec.get::<Option<f64>>(key).map(|pitch| pitch.unwrap_or(f64::INFINITY));
    Ok(Displacement::Ridges(Ridges {
        axis: axis(spec, "axis")?,
        height: spec.get("height")?,
        count: spec.get("count")?,
        pitch: pitch("pitch")?,
        radial_pitch: pitch("radial_pitch")?,
        phase: spec.get("phase")?,
        sharpness: spec.get("sharpness")?,
        mask: mask(spec)?,
    }))
}

fn bumps(spec: &Table) -> mlua::Result<Displacement> {
    Ok(Displacement::Bumps(Bumps {
        height: spec.get("height")?,
        radius: spec.get("radius")?,
        spacing: spec.get("spacing")?,
        seed: spec.get("seed")?,
        mask: mask(spec)?,
    }))
}

/// A method that takes one checked table.
fn change(shape: Shape, name: &str, spec: &Table) -> mlua::Result<Shape> {
    Ok(match name {
        "rotate" => {
            let about = nalgebra::Unit::new_unchecked(axis(spec, "axis")?.unit());
            shape.rotated(Quat::from_axis_angle(&about, spec.get("angle")?))
        }
        "twist" => shape.twisted(axis(spec, "axis")?, spec.get("rate")?),
        "bend" => shape.bent(axis(spec, "along")?, axis(spec, "towards")?, spec.get("curvature")?),
        "ridges" => shape.displaced(ridges(spec)?),
        "bumps" => shape.displaced(bumps(spec)?),
        _ => {
            let region: Option<LuaShape> = spec.get("region")?;
            shape.painted(spec.get("material")?, region.map(|region| region.shape().clone()))
        }
    })
}

impl Hosted for LuaShape {
    fn class() -> &'static Class {
        &SHAPE
    }

    fn label(&self) -> String {
        "shape".into()
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        for (name, record) in table::METHODS {
            host::changing(methods, name, record, move |lua, this: &Self, spec: Table| {
                let region: Option<Self> = if *name == "paint" { spec.get("region")? } else { None };
                let others: Vec<&Self> = region.iter().collect();
                this.derived(lua, change(this.shape().clone(), name, &spec)?, &others)
            });
        }
        method(methods, "translate", |lua, this: &Self, (x, y, z): (f64, f64, f64)| {
            this.derived(lua, this.shape().clone().translated(Vec3::new(x, y, z)), &[])
        });
        method(methods, "scale", |lua, this: &Self, (x, y, z): (f64, Option<f64>, Option<f64>)| {
            let (y, z) = (y.unwrap_or(x), z.unwrap_or(x));
            this.derived(lua, this.shape().clone().scaled(Vec3::new(x, y, z)), &[])
        });
        method(methods, "round", |lua, this: &Self, radius: f64| {
            this.derived(lua, this.shape().clone().rounded(radius), &[])
        });
        method(methods, "shell", |lua, this: &Self, wall: f64| {
            this.derived(lua, this.shape().clone().shell(wall), &[])
        });
        combinations(methods);
        method(methods, "bounds", |lua, this: &Self, ()| {
            let bounds = this.shape().bounds();
            let list = |v: Vec3| lua.create_sequence_from([v.x, v.y, v.z]);
            Ok((list(bounds.min)?, list(bounds.max)?))
        });
        method(methods, "volume", |_, this: &Self, ()| Ok(mass_properties(this.shape(), 1.0).mass));
        // A recipe ends with it: whatever the shape, its lowest point comes to z = 0 and its centre on the z axis.
        method(methods, "grounded", |lua, this: &Self, ()| {
            let bounds = this.shape().bounds();
            let centre = bounds.centre();
            let shape = this.shape().clone().translated(Vec3::new(-centre.x, -centre.y, -bounds.min.z));
            this.derived(lua, shape, &[])
        });
    }
}

/// Methods that join two shapes.
fn combinations<M: UserDataMethods<LuaShape>>(methods: &mut M) {
    let of = |shape: &LuaShape| shape.shape().clone();
    method(methods, "union", move |lua, this: &LuaShape, other: LuaShape| {
        this.derived(lua, of(this).union(of(&other)), &[&other])
    });
    method(methods, "intersect", move |lua, this: &LuaShape, other: LuaShape| {
        this.derived(lua, of(this).intersect(of(&other)), &[&other])
    });
    method(methods, "subtract", move |lua, this: &LuaShape, (cut, blend): (LuaShape, Option<f64>)| {
        let shape = match blend {
            None => of(this).subtract(of(&cut)),
            Some(blend) => of(this).smooth_subtract(of(&cut), blend),
        };
        this.derived(lua, shape, &[&cut])
    });
    method(methods, "smooth_union", move |lua, this: &LuaShape, (other, blend): (LuaShape, f64)| {
        this.derived(lua, of(this).smooth_union(of(&other), blend), &[&other])
    });
}

hosted!(LuaShape);
