//! Profiles in Lua: a file that returns `softvt.profile{…}`, as the plain data by which policy servers are addressed.

use std::{collections::BTreeSet, path::Path};

use mlua::Lua;

use super::{ScriptKind, ScriptSources};
use crate::{
    api::policy::{ActionEncodingSpec, GripperValuesSpec, InputKind, InputSpec, PoseKind, ProfileSpec},
    schema::Constructed,
    vm::{VmLimits, error::ScriptError, source_map::fail_at_key},
};
use softvt_policy::{
    GripHysteresis,
    profile::{
        ActionEncoding, ActionUnits, GripCode, GripperValues, ObservationSource, PoseEncoding, Profile,
        ProfileInput,
    },
};

/// Reads the profile at `path`.
///
/// # Errors
/// If the file cannot be read or does not return a valid profile; the message names file and line.
pub fn load_profile(path: &Path) -> Result<Profile, ScriptError> {
    let (_, profile) = ScriptSources::read(ScriptKind::Plan, path, &[], &VmLimits::default(), |instance| {
        let spec = instance.expected_result("a profile's file");
        let profile = spec.and_then(|spec| ProfileReader { lua: &instance.vm.lua, spec: &spec }.profile());
        profile.map_err(|e| instance.vm.explain(&e))
    })?;
    Ok(profile)
}

/// Reads a profile and checks the relations between its fields.
struct ProfileReader<'a> {
    lua: &'a Lua,
    spec: &'a Constructed<ProfileSpec>,
}

impl ProfileReader<'_> {
    fn wrong(&self, key: &str, message: String) -> mlua::Error {
        fail_at_key(self.lua, &self.spec.table, key, format!("profile.{message}"))
    }

    fn profile(&self) -> mlua::Result<Profile> {
        let (mut keys, mut inputs) = (BTreeSet::new(), Vec::new());
        for (index, entry) in self.spec.inputs.iter().enumerate() {
            let place = format!("inputs[{}]", index + 1);
            let input = self.input(&place, entry)?;
            if let Some(key) = input.keys.iter().find(|key| !keys.insert((*key).clone())) {
                return Err(self.wrong("keys", format!("{place}.keys: {key:?} is sent twice")));
            }
            inputs.push(input);
        }
        if inputs.is_empty() {
            return Err(self.wrong("inputs", "inputs: nothing would be sent; give at least one".to_owned()));
        }
        Ok(Profile {
            name: self.spec.name.clone(),
            inputs,
            actions: self.actions(&self.spec.actions)?,
            observe_every_step: self.spec.observe_every_step,
        })
    }

    fn input(&self, place: &str, entry: &InputSpec) -> mlua::Result<ProfileInput> {
        let InputSpec { keys, source, camera, half_turn, parts, layout, finger, markers, frames } = entry;
        if keys.is_empty() {
            return Err(self.wrong("keys", format!("{place}.keys: give at least one")));
        }
        let (name, own): (_, &[&str]) = match source {
            InputKind::Camera => ("camera", &["camera", "half_turn", "frames"]),
            InputKind::Depth => ("depth", &["camera", "half_turn", "frames"]),
            InputKind::Segmentation => ("segmentation", &["camera", "half_turn", "frames"]),
            InputKind::State => ("state", &["parts", "frames"]),
            InputKind::Prompt => ("prompt", &[]),
            InputKind::TactileImage => ("tactile_image", &["layout", "markers"]),
            InputKind::Tactile => ("tactile", &["finger", "markers", "frames"]),
            InputKind::MarkerMotion => ("marker_motion", &["frames"]),
            InputKind::Force => ("force", &["frames"]),
            InputKind::Query => ("query", &[]),
            InputKind::QuerySeed => ("query_seed", &[]),
        };
        let given = [
            ("camera", camera.is_some()),
            ("half_turn", half_turn.is_some()),
            ("parts", parts.is_some()),
            ("layout", layout.is_some()),
            ("finger", finger.is_some()),
            ("markers", markers.is_some()),
            ("frames", frames.is_some()),
        ];
        if let Some((key, _)) = given.iter().find(|(key, is_given)| *is_given && !own.contains(key)) {
            let message = format!("{place}.{key}: a source {name:?} has none; leave it out");
            return Err(self.wrong(key, message));
        }
        let missing =
            |key: &str| self.wrong("source", format!("{place}.{key}: missing; a source {name:?} needs it"));
        let (camera, half_turn) =
            (|| camera.clone().ok_or_else(|| missing("camera")), half_turn.unwrap_or(false));
        let source = match source {
            InputKind::Camera => ObservationSource::Camera { camera: camera()?, half_turn },
            InputKind::Depth => ObservationSource::Depth { camera: camera()?, half_turn },
            InputKind::Segmentation => ObservationSource::Segmentation { camera: camera()?, half_turn },
            InputKind::State => {
                let parts =
                    parts.clone().filter(|parts| !parts.is_empty()).ok_or_else(|| missing("parts"))?;
                if let Some(at) = (1..parts.len()).find(|&at| parts[..at].contains(&parts[at])) {
                    let message = format!("{place}.parts[{}]: is given before; leave it out", at + 1);
                    return Err(self.wrong("parts", message));
                }
                ObservationSource::State { parts }
            }
            InputKind::Prompt => ObservationSource::Prompt,
            InputKind::TactileImage => {
                ObservationSource::TactileImage { layout: layout.unwrap_or_default(), markers: *markers }
            }
            InputKind::Tactile => {
                let finger = finger.ok_or_else(|| missing("finger"))?;
                ObservationSource::Tactile { finger, markers: *markers }
            }
            InputKind::MarkerMotion => ObservationSource::MarkerMotion,
            InputKind::Force => ObservationSource::Force,
            InputKind::Query => ObservationSource::Query,
            InputKind::QuerySeed => ObservationSource::QuerySeed,
        };
        Ok(ProfileInput { keys: keys.clone(), source, frames: *frames })
    }

    fn actions(&self, spec: &ActionEncodingSpec) -> mlua::Result<ActionEncoding> {
        let missing = |key: &str, pose: &str| {
            self.wrong("pose", format!("actions.{key}: missing; pose = {pose:?} needs it"))
        };
        let translation_m = |pose| spec.translation_m.ok_or_else(|| missing("translation_m", pose));
        let rotation_rad = |pose| spec.rotation_rad.ok_or_else(|| missing("rotation_rad", pose));
        let stepless = |name: &str, pose: PoseEncoding| {
            let given = [("translation_m", spec.translation_m), ("rotation_rad", spec.rotation_rad)];
            match given.iter().find(|(_, step)| step.is_some()) {
                Some((key, _)) => {
                    let message = format!("actions.{key}: pose = {name:?} has no steps; leave it out");
                    Err(self.wrong(key, message))
                }
                None => Ok(pose),
            }
        };
        let pose = match spec.pose {
            PoseKind::Absolute => stepless("absolute", PoseEncoding::Absolute)?,
            PoseKind::Joints => stepless("joints", PoseEncoding::Joints)?,
            PoseKind::Delta => PoseEncoding::Delta {
                translation_m: translation_m("delta")?,
                rotation_rad: rotation_rad("delta")?,
            },
            PoseKind::DeltaOsc => PoseEncoding::DeltaOsc {
                translation_m: translation_m("delta_osc")?,
                rotation_rad: rotation_rad("delta_osc")?,
            },
        };
        let (scale, offset) = (&spec.scale, &spec.offset);
        let count = pose.numbers();
        for (key, numbers) in [("scale", scale), ("offset", offset)] {
            if let Some(numbers) = numbers.as_ref().filter(|numbers| numbers.len() != count) {
                let (name, got) = (pose.name(), numbers.len());
                let message =
                    format!("actions.{key}: expected {count} numbers with pose = {name:?}, got {got}");
                return Err(self.wrong(key, message));
            }
        }
        if let Some(at) = scale.as_ref().and_then(|scale| scale.iter().position(|factor| *factor == 0.0)) {
            let message = format!("actions.scale[{}]: expected a number other than 0, got 0", at + 1);
            return Err(self.wrong("scale", message));
        }
        if let Some(length) = spec.length.filter(|length| *length <= count) {
            let least = count + 1;
            let message = format!(
                "actions.length: expected at least {least} numbers with pose = {:?}, got {length}",
                pose.name()
            );
            return Err(self.wrong("length", message));
        }
        let units = (scale.is_some() || offset.is_some()).then(|| ActionUnits {
            scale: scale.clone().unwrap_or_else(|| vec![1.0; count]),
            offset: offset.clone().unwrap_or_else(|| vec![0.0; count]),
        });
        Ok(ActionEncoding { pose, gripper: self.gripper(&spec.gripper)?, units, length: spec.length })
    }

    /// The hysteresis of a binary gripper, if the profile states one.
    fn latch(
        &self,
        spec: &GripperValuesSpec,
        open: f64,
        closed: f64,
        code: GripCode,
    ) -> mlua::Result<Option<GripHysteresis>> {
        let Some(latch) = spec.latch else { return Ok(None) };
        let wrong = |what: String| self.wrong("latch", format!("actions.gripper.latch: {what}"));
        if code != GripCode::Binary {
            return Err(wrong("only code = \"binary\" has one; leave it out".to_owned()));
        }
        let along = |value: f64| (value - open) / (closed - open);
        let is_ordered =
            0.0 <= along(latch.open) && along(latch.open) < along(latch.close) && along(latch.close) <= 1.0;
        if !is_ordered {
            let (first, second) = (latch.open, latch.close);
            let what = format!(
                "expected open {open}, latch.open, latch.close, closed {closed} in this order, got {first} and {second}"
            );
            return Err(wrong(what));
        }
        Ok(Some(latch))
    }

    fn gripper(&self, spec: &GripperValuesSpec) -> mlua::Result<GripperValues> {
        let wrong = |key: &str, what: &str| self.wrong(key, format!("actions.gripper.{key}: {what}"));
        let code = spec.code.unwrap_or_default();
        if code == GripCode::Force {
            let given = [("open", spec.open), ("closed", spec.closed)];
            let what = "code = \"force\" has none: a force in N closes, less than 0 opens; leave it out";
            return match given.iter().find(|(_, value)| value.is_some()) {
                Some((key, _)) => Err(wrong(key, what)),
                None => Ok(GripperValues::FORCE),
            };
        }
        let missing = |key: &str| wrong(key, &format!("missing; code = {:?} needs it", code.name()));
        let open = spec.open.ok_or_else(|| missing("open"))?;
        let closed = spec.closed.ok_or_else(|| missing("closed"))?;
        if open == closed {
            return Err(wrong("closed", &format!("is {closed} like open; nothing could close")));
        }
        Ok(GripperValues {
            code,
            latch: self.latch(spec, open, closed, code)?,
            ..GripperValues::new(open, closed)
        })
    }
}
