//! Metadata of a foreign file: format, robot, control rate and task.

use serde_json::Value;

use super::{
    super::{DatasetError, TaskFile},
    foreign::{ForeignFormat, ForeignTask},
};
use softvt_benchmark::CONTROL_HZ;
use softvt_policy::stream_paths::POSES;

pub(super) struct Header {
    pub format: ForeignFormat,
    /// `env_args`; null if missing.
    pub environment: Value,
}

/// Observations that only robosuite's environments have, by the names of LIBERO and robomimic.
const ROBOSUITE: [&str; 6] = [
    "obs/ee_states",
    "obs/ee_pos",
    "obs/joint_states",
    "robot_states",
    "obs/robot0_eef_pos",
    "obs/robot0_joint_pos",
];
/// Substrings of robosuite's names of Panda robots.
const PANDA: [&str; 2] = ["panda", "franka"];

impl Header {
    pub(super) fn read(file: &TaskFile) -> Result<Self, DatasetError> {
        let environment = match file.file_attribute("env_args") {
            Some(_) => file.environment()?,
            None => Value::Null,
        };
        let header = Self { format: format_of(file, &environment)?, environment };
        header.check_robot(file)?;
        Ok(header)
    }

    /// Task named by a demonstration, its file name or the file's attributes.
    pub(super) fn task(&self, file: &TaskFile, demo: usize) -> ForeignTask {
        let attribute = |name| {
            file.text(demo, name).ok().or_else(|| file.file_attribute(name)).filter(|text| !text.is_empty())
        };
        let problem = attribute("problem_info").and_then(|text| serde_json::from_str::<Value>(&text).ok());
        let stated = problem.and_then(|problem| Some(problem["language_instruction"].as_str()?.to_owned()));
        let bddl = attribute("bddl_file_name").and_then(|name| sentence(&name, ".bddl"));
        let file_name = file.path.file_name().and_then(|name| sentence(name.to_str()?, "_demo.hdf5"));
        let stated = [attribute("language"), attribute("prompt"), stated].into_iter().flatten();
        ForeignTask {
            suite: attribute("task_suite"),
            id: file.text(demo, "task_id").ok().and_then(|text| whole_number(&text)),
            prompts: stated.chain(bddl).chain(file_name).collect(),
        }
    }

    /// Checks that robot, controller and rate are those of softvt.
    fn check_robot(&self, file: &TaskFile) -> Result<(), DatasetError> {
        let refuse = |key: &str, what: String| Err(DatasetError::content(&file.path, key, what));
        let kwargs = &self.environment["env_kwargs"];
        let listed = match &kwargs["robots"] {
            Value::String(name) => vec![name.clone()],
            Value::Array(all) => all.iter().filter_map(|name| Some(name.as_str()?.to_owned())).collect(),
            _ => Vec::new(),
        };
        let attributes = ["robot_type", "robot"].into_iter().filter_map(|name| file.file_attribute(name));
        let mut named = listed.into_iter().chain(attributes).filter(|name| !name.is_empty());
        let is_panda = |name: &String| PANDA.iter().any(|panda| name.to_lowercase().contains(panda));
        if let Some(other) = named.find(|name| !is_panda(name)) {
            let what =
                format!("the robot is {other}; only demonstrations of a Franka Panda can be re-executed");
            return refuse("/data, robot", what);
        }
        let controller = &kwargs["controller_configs"];
        let key = "/data, attribute env_args, controller_configs";
        if let Some(kind) = controller["type"].as_str().filter(|kind| *kind != "OSC_POSE") {
            let what =
                format!("the controller is {kind}; expected OSC_POSE with relative steps (control_delta)");
            return refuse(key, what);
        }
        if controller["control_delta"] == Value::Bool(false) {
            return refuse(key, "control_delta is false; expected steps relative to the tool".to_owned());
        }
        let stated = || file.file_attribute("fps").and_then(|text| rate(&text));
        match kwargs["control_freq"].as_f64().or_else(stated) {
            Some(rate) if rate != f64::from(CONTROL_HZ) => {
                refuse("/data", format!("{rate} control steps per second; expected {CONTROL_HZ}"))
            }
            _ => Ok(()),
        }
    }

    /// Translation and rotation of an action of 1.
    pub(super) fn step_scale(&self, file: &TaskFile) -> Result<StepScale, DatasetError> {
        let stated = &self.environment["env_kwargs"]["controller_configs"]["output_max"];
        let scales: Vec<f64> = match stated {
            Value::Number(one) => vec![one.as_f64().unwrap_or(f64::NAN); 6],
            Value::Array(six) => six.iter().filter_map(Value::as_f64).collect(),
            _ => return Ok(StepScale::ROBOSUITE),
        };
        match scales[..] {
            [x, y, z, a, b, c] if x == y && y == z && a == b && b == c && x > 0.0 && a > 0.0 => {
                Ok(StepScale { translation_m: x, rotation_rad: a })
            }
            _ => {
                let what = format!(
                    "expected one length (m) three times and one angle (rad) three times, got {stated}"
                );
                Err(DatasetError::content(&file.path, "/data, attribute env_args, output_max", what))
            }
        }
    }
}

/// Scale of the actions of robosuite's controller.
pub(super) struct StepScale {
    pub translation_m: f64,
    pub rotation_rad: f64,
}

impl StepScale {
    /// Default of robosuite, which LIBERO uses (controllers/config/osc_pose.json).
    const ROBOSUITE: Self = Self { translation_m: 0.05, rotation_rad: 0.5 };
}

fn format_of(file: &TaskFile, environment: &Value) -> Result<ForeignFormat, DatasetError> {
    let first = file.demos[0];
    if environment["env_name"] == "softvt" {
        return Ok(ForeignFormat::Softvt);
    }
    let shape = file.shape(first, "actions")?;
    let is_robosuite = || environment["type"] == 1 || ROBOSUITE.iter().any(|name| file.has(first, name));
    match shape[..] {
        [_, 7 | 13] if file.has(first, POSES) => Ok(ForeignFormat::SoftVtBench),
        [_, 7] if is_robosuite() => Ok(ForeignFormat::Libero),
        _ => {
            let what = format!(
                "unknown format: actions of shape {shape:?} and neither obs/eef_pose (SoftVTBench: 7 or 13 numbers per action) nor \
                 env_args of type 1, obs/ee_states, ee_pos or joint_states (robomimic, LIBERO: 7 numbers per action)"
            );
            Err(DatasetError::content(&file.path, format_args!("/data/demo_{first}"), what))
        }
    }
}

/// An integer attribute of a group. rust-hdf5 returns such attributes as text only: an integer as its first byte.
fn whole_number(text: &str) -> Option<usize> {
    match text.as_bytes() {
        [] => Some(0),
        [byte] if *byte < b' ' => Some(usize::from(*byte)),
        _ => text.trim().parse().ok(),
    }
}

/// A rate attribute of a group: text, or an integer as its first byte. Floating-point rates cannot be read.
fn rate(text: &str) -> Option<f64> {
    match text.as_bytes() {
        [byte] => Some(f64::from(*byte)),
        _ => text.trim().parse().ok(),
    }
}

/// The instruction in a file name, in which LIBERO writes spaces as underscores.
fn sentence(name: &str, ending: &str) -> Option<String> {
    let name = name.rsplit(['/', '\\']).next()?;
    Some(name.strip_suffix(ending)?.replace('_', " "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_and_rates_are_read_from_their_first_byte_or_from_text() {
        assert_eq!(
            ["", "\u{7}", "\u{14}", "3", "x"].map(whole_number),
            [Some(0), Some(7), Some(20), Some(3), None]
        );
        assert_eq!(
            ["", "\u{14}", "<", "2", "20", "12.5"].map(rate),
            [None, Some(20.0), Some(60.0), Some(50.0), Some(20.0), Some(12.5)]
        );
    }

    #[test]
    fn instructions_are_read_from_file_names() {
        let name = "a/b/lift_the_cup.bddl";
        assert_eq!(sentence(name, ".bddl").as_deref(), Some("lift the cup"));
        assert_eq!(sentence(name, "_demo.hdf5"), None);
    }
}
