//! What a foreign file says of itself: its layout, its robot, its rate, its task.

use serde_json::Value;

use super::{
    super::{DatasetError, TaskFile},
    ForeignTask,
};
use crate::benchmark::control::CONTROL_DT;

/// How a file is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForeignLayout {
    /// robosuite's controller driven by steps, as robomimic and LIBERO keep it.
    Libero,
    /// Absolute poses, as SoftVTBench keeps them.
    SoftVtBench,
    /// softvt's own.
    Softvt,
}

impl ForeignLayout {
    /// Its name in messages and records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Libero => "robomimic/LIBERO",
            Self::SoftVtBench => "SoftVTBench",
            Self::Softvt => "softvt",
        }
    }
}

/// What a file says of itself.
pub(super) struct Header {
    pub layout: ForeignLayout,
    /// `env_args`; null if there is none.
    pub environment: Value,
}

/// Observations that only robosuite's worlds have, by LIBERO's names and by robomimic's.
const ROBOSUITE: [&str; 6] = [
    "obs/ee_states",
    "obs/ee_pos",
    "obs/joint_states",
    "robot_states",
    "obs/robot0_eef_pos",
    "obs/robot0_joint_pos",
];
/// What robosuite calls the robots that are a Panda.
const PANDA: [&str; 2] = ["panda", "franka"];

impl Header {
    /// Recognises a file.
    ///
    /// # Errors
    /// It is none of the layouts, or of another robot, controller or rate.
    pub(super) fn read(file: &TaskFile) -> Result<Self, DatasetError> {
        let environment = match file.about("env_args") {
            Some(_) => file.environment()?,
            None => Value::Null,
        };
        let header = Self { layout: layout(file, &environment)?, environment };
        header.check_robot(file)?;
        header.check_rate(file)?;
        Ok(header)
    }

    /// Which task a demonstration is of.
    pub(super) fn task(&self, file: &TaskFile, demo: usize) -> ForeignTask {
        let own =
            |name| file.text(demo, name).ok().or_else(|| file.about(name)).filter(|text| !text.is_empty());
        let problem = own("problem_info").and_then(|text| serde_json::from_str::<Value>(&text).ok());
        let stated = problem.and_then(|problem| Some(problem["language_instruction"].as_str()?.to_owned()));
        let bddl = own("bddl_file_name").and_then(|name| sentence(&name, ".bddl"));
        let file_name = file.path().file_name().and_then(|name| sentence(name.to_str()?, "_demo.hdf5"));
        let spoken = [own("language"), own("prompt"), stated].into_iter().flatten();
        ForeignTask {
            suite: own("task_suite"),
            id: file.text(demo, "task_id").ok().and_then(|text| whole_number(&text)),
            prompts: spoken.chain(bddl).chain(file_name).collect(),
        }
    }

    fn wrong(file: &TaskFile, key: &str, what: String) -> DatasetError {
        DatasetError::content(file.path(), key, what)
    }

    fn check_robot(&self, file: &TaskFile) -> Result<(), DatasetError> {
        let kwargs = &self.environment["env_kwargs"];
        let listed = match &kwargs["robots"] {
            Value::String(name) => vec![name.clone()],
            Value::Array(all) => all.iter().filter_map(|name| Some(name.as_str()?.to_owned())).collect(),
            _ => Vec::new(),
        };
        let count = listed.len();
        let noted = ["robot_type", "robot"].into_iter().filter_map(|name| file.about(name));
        let named: Vec<String> = listed.into_iter().chain(noted).filter(|name| !name.is_empty()).collect();
        let known = |name: &&String| PANDA.iter().any(|panda| name.to_lowercase().contains(panda));
        if let Some(other) = named.iter().find(|name| !known(name)) {
            let what =
                format!("the robot is {other}; only demonstrations of a Franka Panda can be re-executed");
            return Err(Self::wrong(file, "/data, robot", what));
        }
        if count > 1 {
            let what = format!("there are {count} robots; expected one");
            return Err(Self::wrong(file, "/data, attribute env_args, robots", what));
        }
        let kind = kwargs["controller_configs"]["type"].as_str();
        if let Some(kind) = kind.filter(|kind| *kind != "OSC_POSE") {
            let what = format!("the controller is {kind}; expected OSC_POSE with steps (control_delta)");
            return Err(Self::wrong(file, "/data, attribute env_args, controller_configs", what));
        }
        if kwargs["controller_configs"]["control_delta"] == Value::Bool(false) {
            let what = "control_delta is false; expected steps away from where the tool is".to_owned();
            return Err(Self::wrong(file, "/data, attribute env_args, controller_configs", what));
        }
        Ok(())
    }

    fn check_rate(&self, file: &TaskFile) -> Result<(), DatasetError> {
        let own = (1.0 / CONTROL_DT).round();
        let stated = self.environment["env_kwargs"]["control_freq"].as_f64();
        let (key, rate) = match stated {
            Some(rate) => ("/data, attribute env_args, control_freq", rate),
            None => match file.about("fps").and_then(|text| rate(&text)) {
                Some(rate) => ("/data, attribute fps", rate),
                None => return Ok(()),
            },
        };
        if rate == own {
            return Ok(());
        }
        Err(Self::wrong(file, key, format!("it is of {rate} control steps a second; expected {own}")))
    }

    /// The longest step of robosuite's controller: m and rad.
    ///
    /// # Errors
    /// It is not the same along all axes.
    pub(super) fn longest_step(&self, file: &TaskFile) -> Result<[f64; 2], DatasetError> {
        let stated = &self.environment["env_kwargs"]["controller_configs"]["output_max"];
        let most: Vec<f64> = match stated {
            Value::Number(one) => vec![one.as_f64().unwrap_or(f64::NAN); 6],
            Value::Array(six) => six.iter().filter_map(Value::as_f64).collect(),
            _ => return Ok(LONGEST_STEP),
        };
        match most[..] {
            [x, y, z, a, b, c] if x == y && y == z && a == b && b == c && x > 0.0 && a > 0.0 => Ok([x, a]),
            _ => {
                let what = format!(
                    "expected one length (m) three times and one angle (rad) three times, got {stated}"
                );
                Err(Self::wrong(file, "/data, attribute env_args, output_max", what))
            }
        }
    }
}

/// robosuite's own, which LIBERO keeps (controllers/config/osc_pose.json).
const LONGEST_STEP: [f64; 2] = [0.05, 0.5];

fn layout(file: &TaskFile, environment: &Value) -> Result<ForeignLayout, DatasetError> {
    let first = file.demos()[0];
    if environment["env_name"] == "softvt" {
        return Ok(ForeignLayout::Softvt);
    }
    let shape = file.shape(first, "actions")?;
    let width = match shape[..] {
        [_, width] => width,
        _ => 0,
    };
    let robosuite = ROBOSUITE.iter().any(|name| file.has(first, name));
    match width {
        7 | 13 if file.has(first, "obs/eef_pose") => Ok(ForeignLayout::SoftVtBench),
        7 if robosuite || environment["type"] == 1 => Ok(ForeignLayout::Libero),
        _ => {
            let what = format!(
                "of no layout that is known: actions of shape {shape:?} and neither obs/eef_pose (SoftVTBench: 7 or 13 numbers an \
                 action) nor env_args of type 1 or obs/ee_states, ee_pos or joint_states (robomimic, LIBERO: 7 numbers an action)"
            );
            Err(DatasetError::content(file.path(), format!("/data/demo_{first}"), what))
        }
    }
}

/// A number as an attribute of a group. The library gives those as text only: of an integer, its first byte.
fn whole_number(text: &str) -> Option<usize> {
    let mut letters = text.chars();
    match (letters.next(), letters.next()) {
        (None, _) => Some(0),
        (Some(byte), None) if byte < ' ' => Some(byte as usize),
        _ => text.trim().parse().ok(),
    }
}

/// A rate as an attribute of a group: text, or an integer by its byte. Of one in floating point nothing is known.
fn rate(text: &str) -> Option<f64> {
    let mut letters = text.chars();
    match (letters.next(), letters.next()) {
        (Some(byte), None) if byte.is_ascii() => Some(f64::from(u32::from(byte))),
        _ => text.trim().parse().ok(),
    }
}

/// The sentence that a file is named by: LIBERO writes blanks as underscores.
fn sentence(name: &str, ending: &str) -> Option<String> {
    let name = name.rsplit(['/', '\\']).next()?;
    Some(name.strip_suffix(ending)?.replace('_', " "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_groups_are_read_from_their_first_byte_or_from_text() {
        assert_eq!(
            ["", "\u{7}", "\u{14}", "3", "x"].map(whole_number),
            [Some(0), Some(7), Some(20), Some(3), None]
        );
    }

    #[test]
    fn rates_are_read_from_their_first_byte_or_from_text() {
        assert_eq!(
            ["", "\u{14}", "<", "2", "20", "12.5"].map(rate),
            [None, Some(20.0), Some(60.0), Some(50.0), Some(20.0), Some(12.5)]
        );
    }

    #[test]
    fn files_are_named_by_what_is_said() {
        let name = "a/b/lift_the_cup.bddl";
        assert_eq!(sentence(name, ".bddl").as_deref(), Some("lift the cup"));
        assert_eq!(sentence(name, "_demo.hdf5"), None);
    }
}
