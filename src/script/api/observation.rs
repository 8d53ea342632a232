//! What a policy in Lua sees: an observation as an object that is only read.

use std::sync::Arc;

use mlua::{Lua, Table, UserDataMethods, Value};

use crate::script::{
    api::catalogue_classes::Class,
    api::catalogue_policy::OBSERVATION,
    api::image::LuaImage,
    api::touch::fingers,
    plan::options::strict,
    schema::unknown,
    schema::userdata::{Hosted, Read, hosted, method},
    vm::fail,
};
use crate::{
    policy::{Observation, TaskBrief},
    robot::rotation,
};

const FINISHED: &str = "it is measured";

/// `softvt.Observation`.
#[derive(Clone)]
pub(crate) struct LuaObservation(Arc<Observation>);

impl LuaObservation {
    pub(crate) fn new(observation: &Observation) -> Self {
        Self(Arc::new(observation.clone()))
    }

    fn camera(&self, lua: &Lua, name: &str) -> mlua::Result<LuaImage> {
        let names = || self.0.cameras.iter().map(|camera| camera.name.as_str());
        match self.0.camera(name) {
            Some(picture) => LuaImage::new(lua, picture.clone()),
            None if self.0.cameras.is_empty() => Err(not_looked(lua, "camera", "cameras = { … }")),
            None => Err(fail(lua, format!("obs:camera: {}", unknown("camera", name, names())))),
        }
    }

    fn force(&self, lua: &Lua) -> mlua::Result<Table> {
        let Some(pads) = &self.0.forces else { return Err(not_looked(lua, "force", "force = true")) };
        let table = lua.create_table()?;
        for (pad, name) in pads.iter().zip(["left", "right"]) {
            table.set(name, lua.create_sequence_from(pad.wrench.force.iter().copied())?)?;
        }
        strict(lua, "force", table, ["left", "right"].map(str::to_owned).to_vec())
    }
}

/// What was never computed, since the policy does not say that it looks at it.
fn not_looked(lua: &Lua, key: &str, mend: &str) -> mlua::Error {
    let message = format!("obs.{key}: the policy does not look at it; say looks = {{ {mend} }}");
    fail(lua, message)
}

impl Hosted for LuaObservation {
    fn class() -> &'static Class {
        &OBSERVATION
    }

    fn label(&self) -> String {
        "obs".into()
    }

    fn read(&self, lua: &Lua, key: &str) -> mlua::Result<Read> {
        let o = &self.0;
        let felt = || o.touch.as_ref().ok_or_else(|| not_looked(lua, key, "touch = true"));
        let numbers = |numbers: &[f64]| Read::together(lua, numbers, FINISHED);
        match key {
            "time" => Ok(Read::number(o.time_s)),
            "position" => numbers(o.ee_position_b.as_slice()),
            "axis_angle" => numbers(o.ee_axis_angle_b.as_slice()),
            "rotation" => {
                let q = rotation::canonical(&rotation::from_axis_angle(&o.ee_axis_angle_b));
                numbers(&[q.w, q.i, q.j, q.k])
            }
            "joints" => numbers(&o.joints),
            "width" => Ok(Read::number(o.gripper_width_m)),
            "closure" => Ok(Read::number(o.closure)),
            "prompt" => Read::text(lua, &o.prompt),
            "force" => self.force(lua).map(|table| Read::Value(Value::Table(table))),
            "touch" => match felt()?.frames.last() {
                Some(now) => fingers(lua, now).map(|table| Read::Value(Value::Table(table))),
                None => Ok(Read::Value(Value::Nil)),
            },
            _ => {
                let frames = felt()?.frames.iter().map(|frame| fingers(lua, frame));
                let list = lua.create_sequence_from(frames.collect::<mlua::Result<Vec<_>>>()?)?;
                Ok(Read::Fixed(list, FINISHED.to_owned()))
            }
        }
    }

    fn methods<M: UserDataMethods<Self>>(methods: &mut M) {
        method(methods, "camera", |lua, this: &Self, name: String| this.camera(lua, &name));
    }
}

hosted!(LuaObservation);

/// What a policy is told of an episode.
pub(crate) fn brief(lua: &Lua, brief: &TaskBrief) -> mlua::Result<Table> {
    let table = lua.create_table()?;
    table.set("suite", brief.suite.as_str())?;
    table.set("task", brief.task)?;
    table.set("prompt", brief.prompt.as_str())?;
    table.set("episode", brief.episode)?;
    strict(lua, "task", table, ["suite", "task", "prompt", "episode"].map(str::to_owned).to_vec())
}
