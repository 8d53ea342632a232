//! Shapes in Lua: immutable values with chained methods.

use mlua::{FromLua, Lua, MetaMethod, Table, UserData, UserDataFields, UserDataMethods, Value};

use super::{
    catalogue_shapes as table,
    sandbox::{fail, locked, shared},
    schema::{self, Record},
};
use crate::geometry::{
    Quat, Vec3,
    import::{ImportOptions, MeshFormat, import},
    shape::{Axis, Bumps, Mask, Relief, Ridges, Shape, ShapeError},
};

/// `softvt.Shape`.
#[derive(Clone, Debug)]
pub(super) struct LuaShape(pub Shape);

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

/// Installs `softvt.shape`.
pub(super) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    let shapes = lua.create_table()?;
    for (name, record) in table::SHAPES {
        let make = lua.create_function(move |lua, value: Value| {
            let spec = checked(lua, record, &value)?;
            finished(lua, build(name, &spec)?)
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
        let file = library.data(&path).map_err(|message| fail(lua, format!("mesh.file: {message}")))?;
        library.bytes(&file).unwrap_or_default()
    };
    let extension = path.rsplit_once('.').map_or("", |(_, extension)| extension);
    let options = ImportOptions { scale: spec.get("scale")?, z_up: spec.get("z_up")? };
    let shape = MeshFormat::of_extension(extension)
        .and_then(|format| import(&bytes, format, &options))
        .and_then(|mesh| Ok(mesh.into_shape()?));
    shape.map(LuaShape).map_err(|error| fail(lua, format!("mesh: {path}: {error}")))
}

pub(super) fn checked(lua: &Lua, record: &'static Record, value: &Value) -> mlua::Result<Table> {
    let Value::Table(spec) = value else {
        let fields: Vec<_> = record.fields.iter().map(|field| field.name).collect();
        let message = format!(
            "{}: expected a table of {}, got {}",
            record.label,
            fields.join(", "),
            schema::got(value)
        );
        return Err(fail(lua, message));
    };
    schema::check(lua, record, spec).map_err(|fault| schema::fault_here(lua, record.label, &fault))
}

/// What can be, at the script's line.
fn finished(lua: &Lua, shape: Result<Shape, ShapeError>) -> mlua::Result<LuaShape> {
    match shape.and_then(|shape| shape.check().map(|()| shape)) {
        Ok(shape) => Ok(LuaShape(shape)),
        Err(error) => Err(fail(lua, format!("shape.{error}"))),
    }
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

fn mask(spec: &Table) -> mlua::Result<Option<Mask>> {
    let Some(mask) = spec.get::<Option<Table>>("mask")? else { return Ok(None) };
    Ok(Some(Mask { axis: axis(&mask, "axis")?, from: mask.get("from")?, to: mask.get("to")? }))
}

fn ridges(spec: &Table) -> mlua::Result<Relief> {
    let pitch = |key: &str| spec.get::<Option<f64>>(key).map(|pitch| pitch.unwrap_or(f64::INFINITY));
    Ok(Relief::Ridges(Ridges {
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

fn bumps(spec: &Table) -> mlua::Result<Relief> {
    Ok(Relief::Bumps(Bumps {
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
            let region: Option<LuaShape> = match spec.get::<Value>("region")? {
                Value::Nil => None,
                value => Some(value.as_userdata().map_or_else(
                    || Err(mlua::Error::runtime("shape:paint: region is no shape")),
                    |data| Ok(data.borrow::<LuaShape>()?.clone()),
                )?),
            };
            shape.painted(spec.get("material")?, region.map(|region| region.0))
        }
    })
}

impl UserData for LuaShape {
    fn add_fields<F: UserDataFields<Self>>(fields: &mut F) {
        fields.add_meta_field(MetaMethod::Type, "softvt.Shape");
    }

    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        methods.add_meta_method(MetaMethod::ToString, |_, _, ()| Ok("softvt.Shape"));
        for (name, record) in table::METHODS {
            methods.add_method(*name, move |lua, this, value: Value| {
                let spec = checked(lua, record, &value)?;
                finished(lua, Ok(change(this.0.clone(), name, &spec)?))
            });
        }
        methods.add_method("translate", |lua, this, (x, y, z): (f64, f64, f64)| {
            finished(lua, Ok(this.0.clone().translated(Vec3::new(x, y, z))))
        });
        methods.add_method("scale", |lua, this, (x, y, z): (f64, Option<f64>, Option<f64>)| {
            let (y, z) = (y.unwrap_or(x), z.unwrap_or(x));
            finished(lua, Ok(this.0.clone().scaled(Vec3::new(x, y, z))))
        });
        methods
            .add_method("round", |lua, this, radius: f64| finished(lua, Ok(this.0.clone().rounded(radius))));
        methods.add_method("shell", |lua, this, wall: f64| finished(lua, Ok(this.0.clone().shell(wall))));
        methods
            .add_method("union", |lua, this, other: Self| finished(lua, Ok(this.0.clone().union(other.0))));
        methods.add_method("intersect", |lua, this, other: Self| {
            finished(lua, Ok(this.0.clone().intersect(other.0)))
        });
        methods.add_method("subtract", |lua, this, (cut, blend): (Self, Option<f64>)| {
            let shape = this.0.clone();
            finished(
                lua,
                Ok(match blend {
                    None => shape.subtract(cut.0),
                    Some(blend) => shape.smooth_subtract(cut.0, blend),
                }),
            )
        });
        methods.add_method("smooth_union", |lua, this, (other, blend): (Self, f64)| {
            finished(lua, Ok(this.0.clone().smooth_union(other.0, blend)))
        });
        methods.add_method("bounds", |lua, this, ()| {
            let bounds = this.0.bounds();
            let list = |v: Vec3| lua.create_sequence_from([v.x, v.y, v.z]);
            Ok((list(bounds.min)?, list(bounds.max)?))
        });
        // A recipe ends with it: whatever the shape, its lowest point comes to z = 0 and its centre on the z axis.
        methods.add_method("grounded", |_, this, ()| {
            let bounds = this.0.bounds();
            let centre = bounds.centre();
            Ok(Self(this.0.clone().translated(Vec3::new(-centre.x, -centre.y, -bounds.min.z))))
        });
    }
}
