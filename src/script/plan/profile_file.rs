//! Profiles in Lua: a file that returns `softvt.profile{…}`, as the plain data that servers are spoken to by.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use mlua::{Lua, MultiValue, Table, Value};

use crate::policy::profile::{
    ActionEncoding, ActionUnits, GripperValues, InputSource, PoseEncoding, Profile, ProfileInput, StatePart,
};
use crate::robot::Side;
use crate::script::{
    ScriptError,
    api::catalogue_policy::PROFILE,
    plan::open,
    schema,
    vm::library::Library,
    vm::origin::fail_at,
    vm::{Limits, fail, locked},
};

/// Reads the profile at `path`; also gives the SHA-256 of every file that it is made of, by name.
///
/// # Errors
/// Anything that is wrong with the file; the message names file and line.
pub fn load_profile(path: &Path) -> Result<(Profile, BTreeMap<String, String>), ScriptError> {
    let (library, main) = Library::open(path)?;
    let (machine, values) = open(&main, library, &[], &Limits::default())?;
    let profile = read(&machine.vm.lua, &values).map_err(|e| machine.vm.explain(&e))?;
    let hashes = locked(&machine.vm.shared.library).bundle().hashes();
    Ok((profile, hashes))
}

fn read(lua: &Lua, values: &MultiValue) -> mlua::Result<Profile> {
    let table = match values.front() {
        Some(Value::Table(table)) if schema::is_made(lua, &PROFILE, table) => table,
        other => {
            let got = other.map_or("nothing".to_owned(), schema::got_made);
            return Err(fail(lua, format!("a profile's file returns softvt.profile{{…}}, got {got}")));
        }
    };
    schema::still_sound(lua, &PROFILE, table)?;
    let whole = Whole { lua, table };
    let inputs: Vec<Table> = table.get("inputs")?;
    let (mut seen, mut all) = (BTreeSet::new(), Vec::new());
    for (index, entry) in inputs.iter().enumerate() {
        let input = whole.input(index + 1, entry)?;
        if let Some(key) = input.keys.iter().find(|key| !seen.insert((*key).clone())) {
            return Err(whole.wrong("keys", format!("inputs[{}].keys: {key:?} is sent twice", index + 1)));
        }
        all.push(input);
    }
    if all.is_empty() {
        return Err(whole.wrong("inputs", "inputs: nothing would be sent; give at least one".to_owned()));
    }
    Ok(Profile { name: table.get("name")?, inputs: all, actions: whole.actions(&table.get("actions")?)? })
}

/// A profile's table, for what no single field can say.
struct Whole<'a> {
    lua: &'a Lua,
    table: &'a Table,
}

impl Whole<'_> {
    fn wrong(&self, key: &str, message: String) -> mlua::Error {
        fail_at(self.lua, self.table, key, format!("profile.{message}"))
    }

    fn input(&self, index: usize, entry: &Table) -> mlua::Result<ProfileInput> {
        let keys: Vec<String> = entry.get("keys")?;
        if keys.is_empty() {
            return Err(self.wrong("keys", format!("inputs[{index}].keys: give at least one")));
        }
        let source: String = entry.get("source")?;
        let own = match source.as_str() {
            "camera" => ["camera", "half_turn"].as_slice(),
            "state" => &["parts"],
            "tactile_image" => &["layout"],
            "tactile" => &["finger"],
            _ => &[],
        };
        for key in ["camera", "half_turn", "parts", "layout", "finger"] {
            if !own.contains(&key) && !entry.get::<Value>(key)?.is_nil() {
                let message = format!("inputs[{index}].{key}: a source {source:?} has none; leave it out");
                return Err(self.wrong(key, message));
            }
        }
        let needed = |key: &str| {
            self.wrong("source", format!("inputs[{index}].{key}: missing; a source {source:?} needs it"))
        };
        let source = match source.as_str() {
            "camera" => InputSource::Camera {
                camera: entry.get::<Option<_>>("camera")?.ok_or_else(|| needed("camera"))?,
                half_turn: entry.get::<Option<_>>("half_turn")?.unwrap_or(false),
            },
            "state" => {
                let parts: Option<Vec<String>> = entry.get("parts")?;
                let parts = parts.filter(|parts| !parts.is_empty()).ok_or_else(|| needed("parts"))?;
                InputSource::State {
                    parts: parts.iter().filter_map(|part| word::<StatePart>(part)).collect(),
                }
            }
            "prompt" => InputSource::Prompt,
            "tactile_image" => {
                let layout = entry.get::<Option<String>>("layout")?;
                InputSource::TactileImage {
                    layout: layout.and_then(|layout| word(&layout)).unwrap_or_default(),
                }
            }
            "tactile" => {
                let finger: Option<String> = entry.get("finger")?;
                let finger = finger.and_then(|finger| word::<Side>(&finger));
                InputSource::Tactile { finger: finger.ok_or_else(|| needed("finger"))? }
            }
            "marker_motion" => InputSource::MarkerMotion,
            _ => InputSource::Force,
        };
        Ok(ProfileInput { keys, source })
    }

    fn actions(&self, table: &Table) -> mlua::Result<ActionEncoding> {
        let gripper: Table = table.get("gripper")?;
        let gripper = GripperValues {
            open: gripper.get("open")?,
            closed: gripper.get("shut")?,
            binary: gripper.get("binary")?,
        };
        if gripper.open == gripper.closed {
            let message =
                format!("actions.gripper.shut: is {} like open; nothing could shut", gripper.closed);
            return Err(self.wrong("shut", message));
        }
        let pose: String = table.get("pose")?;
        let step = |key: &str| -> mlua::Result<f64> {
            table.get::<Option<f64>>(key)?.ok_or_else(|| {
                self.wrong("pose", format!("actions.{key}: missing; pose = {pose:?} needs it"))
            })
        };
        let pose = match pose.as_str() {
            "absolute" => {
                for key in ["translation_m", "rotation_rad"] {
                    if !table.get::<Value>(key)?.is_nil() {
                        let message =
                            format!("actions.{key}: pose = \"absolute\" has no steps; leave it out");
                        return Err(self.wrong(key, message));
                    }
                }
                PoseEncoding::Absolute
            }
            "delta" => PoseEncoding::Delta {
                translation_m: step("translation_m")?,
                rotation_rad: step("rotation_rad")?,
            },
            _ => PoseEncoding::DeltaOsc {
                translation_m: step("translation_m")?,
                rotation_rad: step("rotation_rad")?,
            },
        };
        let (scale, offset): (Option<[f64; 6]>, Option<[f64; 6]>) =
            (table.get("scale")?, table.get("offset")?);
        if let Some(at) = scale.and_then(|scale| scale.iter().position(|factor| *factor == 0.0)) {
            let message = format!("actions.scale[{}]: expected a number other than 0, got 0", at + 1);
            return Err(self.wrong("scale", message));
        }
        let units = (scale.is_some() || offset.is_some()).then(|| ActionUnits {
            scale: scale.unwrap_or(ActionUnits::IDENTITY.scale),
            offset: offset.unwrap_or(ActionUnits::IDENTITY.offset),
        });
        Ok(ActionEncoding { pose, gripper, units, length: table.get("length")? })
    }
}

/// A word of the surface as the value that it stands for; the binding table names no other words.
fn word<T: serde::de::DeserializeOwned>(text: &str) -> Option<T> {
    serde_json::from_value(serde_json::Value::String(text.to_owned())).ok()
}
