//! Profiles in Lua: a file that returns `softvt.profile{…}`, as the plain data by which policy servers are addressed.

use std::{
    collections::BTreeSet,
    fmt::{self, Display},
    path::Path,
};

use mlua::Lua;

use super::ScriptSources;
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
use softvt_robot::Side;

/// # Errors
/// If the file cannot be read or does not return a valid profile; the message names file and line.
pub fn load_profile(path: &Path) -> Result<Profile, ScriptError> {
    let (_, profile) = ScriptSources::read(false, path, &[], &VmLimits::default(), |instance| {
        let spec = instance.expected_result("a profile's file")?;
        ProfileReader { lua: &instance.vm.lua, spec: &spec }.profile()
    })?;
    Ok(profile)
}

/// Reads a profile and checks the relations between its fields.
struct ProfileReader<'a> {
    lua: &'a Lua,
    spec: &'a Constructed<ProfileSpec>,
}

impl ProfileReader<'_> {
    fn wrong(&self, key: &str, message: impl Display) -> mlua::Error {
        fail_at_key(self.lua, &self.spec.table, key, format_args!("profile.{message}"))
    }

    fn profile(&self) -> mlua::Result<Profile> {
        let ProfileSpec { name, inputs, actions, observe_every_step } = &self.spec.spec;
        let read = |(index, entry)| self.input(&format!("inputs[{}]", index + 1), entry);
        let inputs = inputs.iter().enumerate().map(read).collect::<mlua::Result<Vec<_>>>()?;
        let mut keys = BTreeSet::new();
        for (place, key) in
            (1..).zip(&inputs).flat_map(|(at, input)| input.keys.iter().map(move |key| (at, key)))
        {
            if !keys.insert(key) {
                return Err(self.wrong("keys", format_args!("inputs[{place}].keys: {key:?} is sent twice")));
            }
        }
        let actions = self.actions(actions)?;
        Ok(Profile { name: name.clone(), inputs, actions, observe_every_step: *observe_every_step })
    }

    fn input(&self, place: &str, entry: &InputSpec) -> mlua::Result<ProfileInput> {
        const IMAGE: [&str; 2] = ["half_turn", "frames"];
        let InputSpec { keys, source, half_turn, parts, layout, finger, markers, frames, .. } = entry;
        let (camera, half_turn) = (entry.camera.clone().unwrap_or_default(), half_turn.unwrap_or(false));
        let (needed, optional, content): (_, &[&str], _) = match source {
            InputKind::Camera => (Some("camera"), &IMAGE, ObservationSource::Camera { camera, half_turn }),
            InputKind::Depth => (Some("camera"), &IMAGE, ObservationSource::Depth { camera, half_turn }),
            InputKind::Segmentation => {
                (Some("camera"), &IMAGE, ObservationSource::Segmentation { camera, half_turn })
            }
            InputKind::State => {
                let parts = parts.clone().unwrap_or_default();
                (Some("parts"), &["frames"], ObservationSource::State { parts })
            }
            InputKind::Prompt => (None, &[], ObservationSource::Prompt),
            InputKind::TactileImage => {
                let (layout, markers) = (layout.unwrap_or_default(), *markers);
                (None, &["layout", "markers"], ObservationSource::TactileImage { layout, markers })
            }
            InputKind::Tactile => {
                let (finger, markers) = (finger.unwrap_or(Side::Left), *markers);
                (Some("finger"), &["markers", "frames"], ObservationSource::Tactile { finger, markers })
            }
            InputKind::MarkerMotion => (None, &["frames"], ObservationSource::MarkerMotion),
            InputKind::Force => (None, &["frames"], ObservationSource::Force),
            InputKind::Query => (None, &[], ObservationSource::Query),
            InputKind::QuerySeed => (None, &[], ObservationSource::QuerySeed),
        };
        let given = [
            ("camera", entry.camera.is_some()),
            ("half_turn", entry.half_turn.is_some()),
            ("parts", parts.is_some()),
            ("layout", layout.is_some()),
            ("finger", finger.is_some()),
            ("markers", markers.is_some()),
            ("frames", frames.is_some()),
        ];
        for (key, is_given) in given {
            let what = match (is_given, needed == Some(key)) {
                (true, false) if !optional.contains(&key) => "has none; leave it out",
                (false, true) => "needs it",
                _ => continue,
            };
            let at = if is_given { key } else { "source" };
            return Err(self.wrong(at, format_args!("{place}.{key}: a source {:?} {what}", source.name())));
        }
        Ok(ProfileInput { keys: keys.clone(), source: content, frames: *frames })
    }

    fn actions(&self, spec: &ActionEncodingSpec) -> mlua::Result<ActionEncoding> {
        let wrong =
            |key: &str, what: fmt::Arguments<'_>| self.wrong(key, format_args!("actions.{key}: {what}"));
        let (has_steps, name) = (matches!(spec.pose, PoseKind::Delta | PoseKind::DeltaOsc), spec.pose.name());
        for (key, step) in [("translation_m", spec.translation_m), ("rotation_rad", spec.rotation_rad)] {
            if step.is_some() != has_steps {
                let what = if has_steps { "needs it" } else { "has no steps; leave it out" };
                let at = if has_steps { "pose" } else { key };
                return Err(self.wrong(at, format_args!("actions.{key}: pose = {name:?} {what}")));
            }
        }
        let translation_m = spec.translation_m.unwrap_or_default();
        let rotation_rad = spec.rotation_rad.unwrap_or_default();
        let pose = match spec.pose {
            PoseKind::Absolute => PoseEncoding::Absolute,
            PoseKind::Joints => PoseEncoding::Joints,
            PoseKind::Delta => PoseEncoding::Delta { translation_m, rotation_rad },
            PoseKind::DeltaOsc => PoseEncoding::DeltaOsc { translation_m, rotation_rad },
        };
        let (scale, offset, count) = (&spec.scale, &spec.offset, pose.numbers());
        for (key, numbers) in [("scale", scale), ("offset", offset)] {
            if let Some(numbers) = numbers.as_ref().filter(|numbers| numbers.len() != count) {
                let got = numbers.len();
                let what = format_args!("expected {count} numbers with pose = {name:?}, got {got}");
                return Err(wrong(key, what));
            }
        }
        if scale.as_ref().is_some_and(|scale| scale.contains(&0.0)) {
            return Err(wrong("scale", format_args!("expected numbers other than 0")));
        }
        if let Some(length) = spec.length.filter(|length| *length <= count) {
            let least = count + 1;
            let what = format_args!("expected at least {least} numbers with pose = {name:?}, got {length}");
            return Err(wrong("length", what));
        }
        let units = (scale.is_some() || offset.is_some()).then(|| ActionUnits {
            scale: scale.clone().unwrap_or_else(|| vec![1.0; count]),
            offset: offset.clone().unwrap_or_else(|| vec![0.0; count]),
        });
        Ok(ActionEncoding { pose, gripper: self.gripper(&spec.gripper)?, units, length: spec.length })
    }

    fn gripper(&self, spec: &GripperValuesSpec) -> mlua::Result<GripperValues> {
        let wrong = |key: &str, what: fmt::Arguments<'_>| {
            Err(self.wrong(key, format_args!("actions.gripper.{key}: {what}")))
        };
        let (code, latch) = (spec.code.unwrap_or_default(), spec.latch);
        let is_force = code == GripCode::Force;
        for (key, value) in [("open", spec.open), ("closed", spec.closed)] {
            match value {
                Some(_) if is_force => {
                    let what =
                        "code = \"force\" has none: a force in N closes, less than 0 opens; leave it out";
                    return wrong(key, format_args!("{what}"));
                }
                None if !is_force => {
                    return wrong(key, format_args!("missing; code = {:?} needs it", code.name()));
                }
                _ => {}
            }
        }
        if latch.is_some() && code != GripCode::Binary {
            return wrong("latch", format_args!("only code = \"binary\" has one; leave it out"));
        }
        if is_force {
            return Ok(GripperValues::FORCE);
        }
        let (open, closed) = (spec.open.unwrap_or_default(), spec.closed.unwrap_or_default());
        if open == closed {
            return wrong("closed", format_args!("is {closed} like open; nothing could close"));
        }
        if let Some(GripHysteresis { close, open: opens, .. }) = latch {
            let [from, to] = [opens, close].map(|value| (value - open) / (closed - open));
            if !(0.0 <= from && from < to && to <= 1.0) {
                let order = format!("open {open}, latch.open, latch.close, closed {closed}");
                return wrong(
                    "latch",
                    format_args!("expected {order} in this order, got {opens} and {close}"),
                );
            }
        }
        Ok(GripperValues { code, latch, ..GripperValues::new(open, closed) })
    }
}
