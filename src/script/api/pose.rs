//! Poses in Lua: immutable, in the world frame.

use mlua::{Lua, Table, UserDataMethods, Value};

use crate::geometry::{Pose, Quat, Vec3};
use crate::script::{
    api::catalogue,
    api::catalogue_classes::{self as classes, Class},
    api::orientation as turn,
    schema,
    schema::userdata::{Hosted, Read, hosted, method},
    vm::fail,
};

/// `softvt.Pose`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LuaPose(pub Pose);

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
pub(crate) fn install(lua: &Lua, api: &Table) -> mlua::Result<()> {
    let make = lua.create_function(|lua, value: Value| {
        let checked = schema::checked(lua, &catalogue::POSE, &value)?;
        let xyz: [f64; 3] = checked.get("xyz")?;
        let turn = match checked.get::<Option<[f64; 4]>>("quat")? {
            None => downward(checked.get("yaw")?),
            Some(quat) => turn::turn(quat)
                .ok_or_else(|| fail(lua, "pose.quat: expected a quaternion other than 0".to_owned()))?,
        };
        Ok(LuaPose(Pose::from_parts(Vec3::from(xyz).into(), turn)))
    })?;
    api.set("pose", make)
}

impl Hosted for LuaPose {
    fn class() -> &'static Class {
        &classes::POSE
    }

    fn label(&self) -> String {
        "pose".into()
    }

    fn text(&self) -> String {
        let at = self.0.translation.vector;
        format!("pose({:.4}, {:.4}, {:.4})", at.x, at.y, at.z)
    }

    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Read> {
        const MEND: &str = "a pose never changes: make another with softvt.pose{…}, or with moved";
        let at = self.0.translation.vector;
        let q = self.0.rotation.quaternion();
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        Ok(match key {
            "x" => Read::number(at.x),
            "y" => Read::number(at.y),
            "z" => Read::number(at.z),
            "xyz" => Read::together(lua, at.as_slice(), MEND)?,
            _ => Read::together(lua, &[sign * q.w, sign * q.i, sign * q.j, sign * q.k], MEND)?,
        })
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "moved", |_, this: &Self, by: [f64; 3]| {
            let mut pose = this.0;
            pose.translation.vector += Vec3::from(by);
            Ok(Self(pose))
        });
        method(methods, "at", |_, this: &Self, xyz: [f64; 3]| {
            Ok(Self(Pose::from_parts(Vec3::from(xyz).into(), this.0.rotation)))
        });
        method(methods, "turned", |_, this: &Self, angle: f64| {
            let turn = Quat::from_axis_angle(&Vec3::z_axis(), angle);
            Ok(Self(Pose::from_parts(this.0.translation, turn * this.0.rotation)))
        });
        method(methods, "towards", |_, this: &Self, (other, share): (Self, f64)| {
            let at = this.0.translation.vector.lerp(&other.0.translation.vector, share);
            // The spherical mean of opposite orientations is not defined; any shortest way will do.
            let turn = this.0.rotation.try_slerp(&other.0.rotation, share, 1e-12);
            Ok(Self(Pose::from_parts(at.into(), turn.unwrap_or(other.0.rotation))))
        });
        method(methods, "distance", |_, this: &Self, other: Self| {
            let metres = (this.0.translation.vector - other.0.translation.vector).norm();
            Ok((metres, this.0.rotation.angle_to(&other.0.rotation)))
        });
    }
}

hosted!(LuaPose);
