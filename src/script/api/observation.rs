//! The observation of a policy, and tactile sensors with their markers, as read-only objects.

use std::sync::Arc;

use mlua::{Lua, Table, Value};

use super::image::LuaImage;
use crate::schema::{
    FieldValue, Range, Type, class,
    object::{Access, IntoFieldValue, LuaField, MEASURED, read_only_list},
    output,
};
use softvt_common::text::unknown_name;
use softvt_policy::{
    EpisodeBrief, Observation, PadForce, ROBOT_STREAMS, RobotStream, TactileFrame, TactileHistory,
};
use softvt_sensing::tactile::{MarkerFlow, MarkerPositions, Markers};

#[derive(Clone)]
pub(crate) struct LuaObservation {
    observation: Arc<Observation>,
    drives: bool,
}

impl LuaObservation {
    pub(crate) fn new(observation: &Observation, drives: bool) -> Self {
        Self { observation: Arc::new(observation.clone()), drives }
    }

    fn tactile(&self, lua: &Lua, key: &str) -> mlua::Result<&TactileHistory> {
        self.observation.tactile.as_ref().ok_or_else(|| not_observed(lua, key, "tactile = true"))
    }
}

impl LuaObservation {
    /// Numbers of a stream of the robot by the name of its field.
    fn robot_stream(&self, lua: &Lua, name: &str) -> mlua::Result<Option<FieldValue>> {
        let Some((stream, field)) = robot_fields().find(|(_, field)| *field == name) else {
            return Ok(None);
        };
        if stream.is_drive && !self.drives {
            return Err(not_observed(lua, field, "drives = true"));
        }
        match &(stream.read)(&self.observation.robot)[..] {
            [number] => (*number).into_field_value(lua).map(Some),
            numbers => Ok(Some(FieldValue::Numbers(numbers.to_vec()))),
        }
    }
}

/// The streams of the robot that are fields of observations, with the names of the fields.
fn robot_fields() -> impl Iterator<Item = (&'static RobotStream, &'static str)> {
    ROBOT_STREAMS.iter().filter_map(|stream| Some((stream, stream.field?)))
}

fn robot_field_list() -> Vec<LuaField> {
    let field = |(stream, name): (&RobotStream, _)| {
        let lua_type = if stream.width == 1 { "number" } else { "number[]" };
        LuaField { name, access: Access::Read(lua_type, None), doc: stream.about }
    };
    robot_fields().map(field).collect()
}

/// The error for data that was not computed, since the policy does not declare it.
fn not_observed(lua: &Lua, key: &str, declaration: &str) -> mlua::Error {
    fail!(lua, "obs.{key}: the policy does not observe it; declare observes = {{ {declaration} }}")
}

output! {
    /// True forces on the gels, N, pad frame: a pressing body makes z negative.
    fn forces(lua, pads: &[PadForce; 2]) -> "softvt.Forces" as "force" {
        /// Force on the left gel.
        left: "number[]" = lua.create_sequence_from(pads[0].wrench.force.iter().copied())?;
        /// Force on the right gel.
        right: "number[]" = lua.create_sequence_from(pads[1].wrench.force.iter().copied())?;
    }
    /// The episode that begins.
    fn task_brief(lua, brief: &EpisodeBrief) -> "softvt.EpisodeBrief" as "task" {
        /// Name of the suite; nil in a judged run.
        suite: "string?" = brief.alias.is_none().then_some(brief.suite.as_str());
        /// Index of the task, from 0; nil in a judged run.
        task: "integer?" = brief.alias.is_none().then_some(brief.task);
        /// Instruction of the task.
        prompt: "string" = brief.prompt.as_str();
        /// Index of the episode, from 0; nil in a judged run.
        episode: "integer?" = brief.alias.is_none().then_some(brief.episode);
        /// Name of the episode in a judged run (--seed-file), from which its draws cannot be computed.
        id: "string?" = brief.alias.as_deref();
    }
}

class! {
    /// The observation of a policy at a control step. Poses are of the tool centre point in the robot's base frame. The
    /// true state of the scene is not part of it. Its closure requires observes.drives.
    LuaObservation: "softvt.Observation" {
        label(_) { "obs".to_owned() }
        fields {
            /// Time since the policy took over, s.
            time: "number" { get(_, this) { this.observation.time_s } }
            /// Measured distance of the gels, 0 to 0.08 m, with the steps and the offset of a real hand; exact with
            /// observes.drives.
            width: "number" {
                get(_, this) {
                    let robot = &this.observation.robot;
                    if this.drives { robot.gripper_width_m } else { robot.sensed_width_m }
                }
            }
            /// Instruction of the task.
            prompt: "string" { get(_, this) { this.observation.prompt.clone() } }
            /// Tactile sensors; requires observes.tactile.
            tactile: "softvt.Fingers" {
                get(lua, this) {
                    let now = this.tactile(lua, "tactile")?.frames.last();
                    now.map(|now| fingers(lua, now)).transpose()?.map_or(Value::Nil, Value::Table)
                }
            }
            /// Tactile sensors in the last 1 to 8 control steps, oldest first; requires observes.tactile.
            tactile_history: "softvt.Fingers[]" {
                get(lua, this) {
                    let frames = this.tactile(lua, "tactile_history")?.frames.iter().map(|frame| fingers(lua, frame));
                    read_only_list(lua, frames.collect::<mlua::Result<Vec<_>>>()?, MEASURED)?
                }
            }
            /// True forces on the gels; requires observes.force.
            force: "softvt.Forces" {
                get(lua, this) {
                    let pads = this.observation.forces.as_ref().ok_or_else(|| not_observed(lua, "force", "force = true"))?;
                    forces(lua, pads)?
                }
            }
        }
        declared robot_field_list { get(lua, this, name) { this.robot_stream(lua, name)? } }
        methods {
            /// Returns the image of a camera in observes.cameras, 224 × 224 unless the scene defines another size.
            fn camera(lua, this, name: String) -> ["softvt.Image"] {
                let names = this.observation.cameras.iter().map(|camera| camera.name.as_str());
                match this.observation.camera(&name) {
                    Some(image) => LuaImage::new(lua, image.clone())?,
                    None if this.observation.cameras.is_empty() => {
                        return Err(not_observed(lua, "camera", "cameras = { … }"));
                    }
                    None => return Err(fail!(lua, "obs:camera: {}", unknown_name("camera", &name, names))),
                }
            }
        }
    }
}

/// Tactile frames of the left and the right finger at one control step.
pub(crate) type FingerReadings = Arc<[TactileFrame; 2]>;

const PIXELS: Type = Type::Number("px", Range::closed(0.0, 1e3));

/// `softvt.TactileFrame`: a finger at one control step.
#[derive(Clone)]
pub(crate) struct LuaTactileFrame {
    readings: FingerReadings,
    finger: usize,
}

#[derive(Clone)]
pub(crate) struct LuaMarkers {
    markers: Arc<Markers>,
    flow: Arc<MarkerFlow>,
}

impl LuaMarkers {
    pub(crate) fn new(markers: Markers) -> Self {
        Self { flow: Arc::new(MarkerFlow::new(&markers)), markers: Arc::new(markers) }
    }
}

output! {
    /// The tactile sensors of both fingers at one control step.
    fn fingers(lua, readings: &FingerReadings) -> "softvt.Fingers" as "tactile" {
        /// Frame of the left finger.
        left: "softvt.TactileFrame" = LuaTactileFrame { readings: readings.clone(), finger: 0 };
        /// Frame of the right finger.
        right: "softvt.TactileFrame" = LuaTactileFrame { readings: readings.clone(), finger: 1 };
    }
}

class! {
    /// The tactile sensor of a finger at one control step; docs/tactile.md draws its frames.
    LuaTactileFrame: "softvt.TactileFrame" {
        label(_) { "tactile".to_owned() }
        fields {
            /// Colour image, 320 × 240.
            image: "softvt.Image" {
                get(lua, this) { LuaImage::new(lua, this.readings[this.finger].image.clone())? }
            }
            /// Absolute difference of every channel from the image of the untouched gel.
            difference: "softvt.Image" {
                get(lua, this) { LuaImage::new(lua, this.readings[this.finger].change())? }
            }
            /// The 11 × 9 markers.
            markers: "softvt.Markers" { get(_, this) { LuaMarkers::new(this.readings[this.finger].markers) } }
        }
    }
}

pub(crate) fn positions(lua: &Lua, places: &MarkerPositions) -> mlua::Result<Table> {
    lua.create_sequence_from(places.iter().map(|place| place.map(f64::from).to_vec()))
}

class! {
    /// The 99 markers of a finger, row by row, in px of its image: x to the right (towards the hand), y down. 1 px is
    /// 0.063 mm.
    LuaMarkers: "softvt.Markers" {
        label(_) { "markers".to_owned() }
        fields {
            /// Positions on the untouched gel.
            initial: "number[][]" { get(lua, this) { FieldValue::ReadOnly(positions(lua, &this.markers.initial)?, MEASURED) } }
            /// Present positions of the markers.
            present: "number[][]" { get(lua, this) { FieldValue::ReadOnly(positions(lua, &this.markers.current)?, MEASURED) } }
            /// Displacements of the markers from rest.
            motion: "number[][]" {
                get(lua, this) { read_only_list(lua, this.flow.displacements.iter().map(|u| vec![u.x, u.y]), MEASURED)? }
            }
        }
        methods {
            /// Returns the mean displacement along x and y, which grows with shear along the gel's surface.
            fn mean(lua, this) -> ["number[]"] { lua.create_sequence_from(this.flow.mean())? }
            /// Returns the length of the longest displacement.
            fn max_displacement(_, this) -> ["number"] { this.flow.max_displacement() }
            /// Returns the root mean square of the displacements without their mean and twist. It grows with the normal
            /// force: about 0.3 px per newton on round dough and rigid objects, less on flat and soft ones.
            fn rms_residual(_, this) -> ["number"] { this.flow.press() }
            /// Returns the mean displacement towards the fingertip or across, as of an object that slips out of the
            /// grasp; 0 if it is pushed in.
            fn outward_shear(_, this) -> ["number"] { this.flow.drag() }
            /// Returns the trace of the displacement gradient; positive where an indentation pushes the markers
            /// outwards, negative where a soft flat body draws them together.
            fn divergence(_, this) -> ["number"] { this.flow.divergence() }
            /// Returns the rotation of the markers, rad; positive is clockwise in the image.
            fn twist(_, this) -> ["number"] { this.flow.twist() }
            /// Returns the pure shear of the markers: stretch along x against y, and along the diagonal x = y.
            fn shear(lua, this) -> ["number[]"] { lua.create_sequence_from(this.flow.shear())? }
            /// Returns the contact mask: true for markers displaced by more than px.
            fn contact_mask(lua, this, px: f64 = PIXELS) -> ["boolean[]"] { lua.create_sequence_from(this.flow.moved(px))? }
            /// Returns the share of markers displaced by more than px; the whole image is 20.3 × 15.2 mm.
            fn contact_share(_, this, px: f64 = PIXELS) -> ["number"] { this.flow.moved_share(px) }
        }
    }
}
