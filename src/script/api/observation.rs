//! The observation of a policy, as a read-only object.

use std::sync::Arc;

use mlua::{Lua, Table, Value};

use super::{image::LuaImage, pose::wxyz, touch::fingers};
use crate::{
    policy::{Observation, TactileHistory, TaskBrief},
    robot::rotation,
    script::{
        schema::{
            class,
            object::{MEASURED, fixed_list},
            output,
        },
        vm::error::fail,
    },
    text::unknown_name,
};

/// `softvt.Observation`.
#[derive(Clone)]
pub(crate) struct LuaObservation(Arc<Observation>);

impl LuaObservation {
    pub(crate) fn new(observation: &Observation) -> Self {
        Self(Arc::new(observation.clone()))
    }

    fn touch(&self, lua: &Lua, key: &str) -> mlua::Result<&TactileHistory> {
        self.0.tactile.as_ref().ok_or_else(|| not_observed(lua, key, "touch = true"))
    }
}

/// The error for data that was not computed, since the policy does not declare it.
fn not_observed(lua: &Lua, key: &str, declaration: &str) -> mlua::Error {
    let message =
        format!("obs.{key}: the policy does not observe it; declare observes = {{ {declaration} }}");
    fail(lua, message)
}

output! {
    /// True forces on the gels, N, pad frame: a pressing body makes z negative.
    fn forces(lua, left: Table, right: Table) -> "softvt.Forces" as "force" {
        /// Force on the left gel.
        left: "number[]" = left;
        /// Force on the right gel.
        right: "number[]" = right;
    }
}

output! {
    /// The episode that begins.
    fn task_brief(lua, brief: &TaskBrief) -> "softvt.Brief" as "task" {
        /// Name of the suite.
        suite: "string" = brief.suite.as_str();
        /// Index of the task, from 0.
        task: "integer" = brief.task;
        /// The instruction.
        prompt: "string" = brief.prompt.as_str();
        /// Index of the episode, from 0.
        episode: "integer" = brief.episode;
    }
}

class! {
    /// The observation of a policy at a control step. Poses are of the tool centre point in the robot's base frame. The true
    /// state of the scene is not part of it.
    LuaObservation: "softvt.Observation" {
        label(_) { "obs".to_owned() }
        fields {
            /// Time since the policy took over, s.
            time: "number" { get(_, this) { this.0.time_s } }
            /// Tool position, m.
            position: "number[]" {
                get(lua, this) { fixed_list(lua, this.0.ee_position_b.iter().copied(), MEASURED)? }
            }
            /// Tool orientation as axis-angle, rad.
            axis_angle: "number[]" {
                get(lua, this) { fixed_list(lua, this.0.ee_axis_angle_b.iter().copied(), MEASURED)? }
            }
            /// Tool orientation as quaternion w, x, y, z with w ≥ 0.
            rotation: "number[]" {
                get(lua, this) {
                    let rotation = rotation::from_axis_angle(&this.0.ee_axis_angle_b);
                    fixed_list(lua, wxyz(&rotation), MEASURED)?
                }
            }
            /// The seven joint angles of the arm, rad.
            joints: "number[]" { get(lua, this) { fixed_list(lua, this.0.joints, MEASURED)? } }
            /// Measured distance of the gels, 0 to 0.08 m.
            width: "number" { get(_, this) { this.0.gripper_width_m } }
            /// Last commanded closure: 0 is open, 1 is closed.
            closure: "number" { get(_, this) { this.0.closure } }
            /// The instruction.
            prompt: "string" { get(_, this) { this.0.prompt.clone() } }
            /// Tactile sensors; requires observes.touch.
            touch: "softvt.Fingers" {
                get(lua, this) {
                    let now = this.touch(lua, "touch")?.frames.last();
                    now.map(|now| fingers(lua, now)).transpose()?.map_or(Value::Nil, Value::Table)
                }
            }
            /// Tactile sensors in the last 1 to 8 control steps, oldest first; requires observes.touch.
            touch_history: "softvt.Fingers[]" {
                get(lua, this) {
                    let frames = this.touch(lua, "touch_history")?.frames.iter().map(|frame| fingers(lua, frame));
                    fixed_list(lua, frames.collect::<mlua::Result<Vec<_>>>()?, MEASURED)?
                }
            }
            /// True forces on the gels; requires observes.force.
            force: "softvt.Forces" {
                get(lua, this) {
                    let pads = this.0.forces.as_ref().ok_or_else(|| not_observed(lua, "force", "force = true"))?;
                    let [left, right] = [&pads[0], &pads[1]].map(|pad| pad.wrench.force);
                    let list = |force: crate::geometry::Vec3| lua.create_sequence_from(force.iter().copied());
                    forces(lua, list(left)?, list(right)?)?
                }
            }
        }
        methods {
            /// Returns the image of a camera in observes.cameras, 224 × 224 unless the scene defines another size.
            fn camera(lua, this, name: String) -> ["softvt.Image"] {
                let names = this.0.cameras.iter().map(|camera| camera.name.as_str());
                match this.0.camera(&name) {
                    Some(image) => LuaImage::new(lua, image.clone())?,
                    None if this.0.cameras.is_empty() => {
                        return Err(not_observed(lua, "camera", "cameras = { … }"));
                    }
                    None => return Err(fail(lua, format!("obs:camera: {}", unknown_name("camera", &name, names)))),
                }
            }
        }
    }
}
