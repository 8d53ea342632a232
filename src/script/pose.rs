//! Poses in Lua: immutable, in the world frame.

use mlua::{Lua, MetaMethod, Table, UserData, UserDataFields, UserDataMethods, Value};

use super::{
    catalogue,
    sandbox::fail,
    schema::{self, unknown},
};
use crate::geometry::{Pose, Quat, Vec3};

/// `softvt.Pose`.
#[derive(Clone, Copy, Debug)]
pub(super) struct LuaPose(pub Pose);

impl mlua::FromLua for LuaPose {
    fn from_lua(value: Value, lua: &Lua) -> mlua::Result<Self> {
        match value.as_userdata().and_then(|data| data.borrow::<Self>().ok()) {
            Some(pose) => Ok(*pose),
            None => {
                Err(fail(lua, format!("expected a pose (softvt.pose{{…}}), got {}", schema::got(&value))))
            }
        }
    }
}

/// The hand pointing straight down, turned by `yaw` (rad) about the vertical: its x axis lies along (cos yaw, sin yaw).
fn downward(yaw: f64) -> Quat {
    let turn = Quat::from_axis_angle(&Vec3::z_axis(), yaw);
    turn * Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI)
}

/// Installs `softvt.pose`.
pub(super) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    let make = lua.create_function(|lua, value: Value| {
        let Value::Table(table) = &value else {
            let message = format!("pose: expected a table of xyz, yaw, quat, got {}", schema::got(&value));
            return Err(fail(lua, message));
        };
        let checked = schema::check(lua, &catalogue::POSE, table)
            .map_err(|fault| schema::fault_here(lua, "pose", &fault))?;
        let xyz: [f64; 3] = checked.get("xyz")?;
        let turn = match checked.get::<Option<[f64; 4]>>("quat")? {
            None => downward(checked.get("yaw")?),
            Some([w, x, y, z]) => {
                let raw = nalgebra::Quaternion::new(w, x, y, z);
                Quat::try_new(raw, 1e-6)
                    .ok_or_else(|| fail(lua, "pose.quat: expected a quaternion other than 0"))?
            }
        };
        Ok(LuaPose(Pose::from_parts(Vec3::from(xyz).into(), turn)))
    })?;
    api.set("pose", make)
}

impl UserData for LuaPose {
    fn add_fields<F: UserDataFields<Self>>(fields: &mut F) {
        fields.add_meta_field(MetaMethod::Type, "softvt.Pose");
    }

    fn add_methods<M: UserDataMethods<Self>>(methods: &mut M) {
        methods.add_method("moved", |_, this, by: [f64; 3]| {
            let mut pose = this.0;
            pose.translation.vector += Vec3::from(by);
            Ok(Self(pose))
        });
        methods.add_method("at", |_, this, xyz: [f64; 3]| {
            Ok(Self(Pose::from_parts(Vec3::from(xyz).into(), this.0.rotation)))
        });
        methods.add_method("turned", |_, this, angle: f64| {
            let turn = Quat::from_axis_angle(&Vec3::z_axis(), angle);
            Ok(Self(Pose::from_parts(this.0.translation, turn * this.0.rotation)))
        });
        methods.add_method("towards", |_, this, (other, share): (Self, f64)| {
            let at = this.0.translation.vector.lerp(&other.0.translation.vector, share);
            // The spherical mean of opposite orientations is not defined; any shortest way will do.
            let turn = this.0.rotation.try_slerp(&other.0.rotation, share, 1e-12);
            Ok(Self(Pose::from_parts(at.into(), turn.unwrap_or(other.0.rotation))))
        });
        methods.add_method("distance", |_, this, other: Self| {
            let metres = (this.0.translation.vector - other.0.translation.vector).norm();
            Ok((metres, this.0.rotation.angle_to(&other.0.rotation)))
        });
        methods.add_meta_method(MetaMethod::ToString, |_, this, ()| {
            let at = this.0.translation.vector;
            Ok(format!("pose({:.4}, {:.4}, {:.4})", at.x, at.y, at.z))
        });
        methods.add_meta_method(MetaMethod::Index, |lua, this, key: String| {
            let at = this.0.translation.vector;
            let q = this.0.rotation.quaternion();
            let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
            let list = |values: &[f64]| lua.create_sequence_from(values.iter().copied()).map(Value::Table);
            match key.as_str() {
                "x" => Ok(Value::Number(at.x)),
                "y" => Ok(Value::Number(at.y)),
                "z" => Ok(Value::Number(at.z)),
                "xyz" => list(&[at.x, at.y, at.z]),
                "quat" => list(&[sign * q.w, sign * q.i, sign * q.j, sign * q.k]),
                _ => {
                    let known =
                        ["x", "y", "z", "xyz", "quat", "moved", "at", "turned", "towards", "distance"];
                    Err(fail(lua, format!("pose: {}", unknown("key", &key, known.into_iter()))))
                }
            }
        });
    }
}
