//! Recorded actions of an episode as a `.npy` file: float64 of shape (steps, 7) with the tool's position (m) and
//! axis-angle (rad) in the base frame, and the gripper closure. If any action commands a grip force, an eighth column
//! has it in N, and −1 in the rows of actions that command a closure. If any action commands joint positions, there are
//! seven more columns: these (rad), and NaN in the rows of actions that command a pose.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{record::EpisodeRecord, run_folder::RunFolderError};
use softvt_common::{
    digest::sha256_hex,
    episode_id::EpisodeIndex,
    files::{FileError, replace},
    npy::NpyArray,
};
use softvt_policy::{Action, GripTarget};
use softvt_robot::panda::ARM_DOFS;

/// Numbers per action: of the pose and the closure, with a grip force, with joint positions.
const WIDTH: usize = 7;
const WIDTH_WITH_FORCE: usize = 8;
const WIDTH_WITH_JOINTS: usize = WIDTH_WITH_FORCE + ARM_DOFS;
/// Grip force of an action that commands a closure.
const NO_FORCE: f64 = -1.0;

/// SHA-256 of the numbers of actions as little-endian float64, hexadecimal.
pub fn sha256(actions: &[Action]) -> String {
    let numbers = actions.iter().flat_map(|action| action.numbers());
    sha256_hex(numbers.flat_map(f64::to_le_bytes).collect::<Vec<u8>>())
}

/// Path of the actions of an episode in the run folder `dir`.
pub fn path(dir: &Path, index: EpisodeIndex) -> PathBuf {
    let EpisodeIndex { task, episode } = index;
    dir.join(format!("actions/task_{task:03}/episode_{episode:05}.npy"))
}

pub fn write(path: &Path, actions: &[Action]) -> Result<(), FileError> {
    let width = match actions {
        _ if actions.iter().any(|action| action.joints.is_some()) => WIDTH_WITH_JOINTS,
        _ if actions.iter().any(|action| action.force_n().is_some()) => WIDTH_WITH_FORCE,
        _ => WIDTH,
    };
    let row = |action: &Action| {
        let force = action.force_n().unwrap_or(NO_FORCE);
        let joints = action.joints.unwrap_or([f64::NAN; ARM_DOFS]);
        action.to_array().into_iter().chain([force]).chain(joints).take(width)
    };
    let numbers = actions.iter().flat_map(row);
    replace(path, NpyArray::from_f64(vec![actions.len(), width], numbers).to_npy())
}

/// # Errors
/// The file cannot be read or is not such an array.
pub fn read(path: &Path) -> Result<Vec<Action>, RunFolderError> {
    const EXPECTED: &str = "expected float64 numbers of shape (steps, 7)";
    let bytes = fs::read(path).map_err(FileError::io("read", path))?;
    let path = path.display();
    let array = NpyArray::parse(&bytes).map_err(|error| {
        RunFolderError::new(format_args!("{path}: {error}; {EXPECTED}, as softvt writes them"))
    })?;
    let width = match array.shape[..] {
        [_, width @ (WIDTH | WIDTH_WITH_FORCE | WIDTH_WITH_JOINTS)] if array.dtype == "<f8" => width,
        _ => {
            let (dtype, shape) = (&array.dtype, &array.shape);
            let found = format_args!("{path}: an array of type {dtype} and shape {shape:?}; {EXPECTED}");
            return Err(RunFolderError::new(found));
        }
    };
    let action = |row: &[f64]| {
        let closing = Action::from_array(std::array::from_fn(|i| row[i]));
        let force = row.get(WIDTH).copied().filter(|force| *force >= 0.0);
        let joints = row.get(WIDTH_WITH_FORCE..).and_then(<[f64]>::first_chunk).copied();
        let action = Action {
            grip: force.map_or(closing.grip, GripTarget::Force),
            joints: joints.filter(|joints| !joints.iter().all(|x| x.is_nan())),
            ..closing
        };
        action.numbers().all(f64::is_finite).then_some(action)
    };
    let actions: Option<Vec<Action>> = array.values().chunks_exact(width).map(action).collect();
    actions.ok_or_else(|| RunFolderError::new(format_args!("{path}: it holds a number that is not finite")))
}

/// Reads the actions of an episode below the run folder `dir`, which must be those of its record.
///
/// # Errors
/// The file is missing, cut or changed.
pub fn read_checked(dir: &Path, record: &EpisodeRecord) -> Result<Vec<Action>, RunFolderError> {
    let path = path(dir, record.header.id.index());
    let actions = read(&path)?;
    match record.stats.actions_sha256 == sha256(&actions) {
        true => Ok(actions),
        false => Err(RunFolderError::new(format_args!(
            "{}: its SHA-256 differs from that in the record of the episode: the file was changed or damaged",
            path.display()
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_record;
    use softvt_geometry::Vec3;

    #[test]
    fn a_changed_file_is_found_by_its_digest() {
        let root = tempfile::tempdir().unwrap();
        let actions = [Action::new(Vec3::x(), Vec3::z(), 0.5); 3];
        let mut record = sample_record();
        record.stats.actions_sha256 = sha256(&actions);
        let at = path(root.path(), record.header.id.index());
        let problem = |record: &EpisodeRecord| read_checked(root.path(), record).unwrap_err().to_string();
        assert!(problem(&record).contains("episode_00000.npy"), "a missing file is named");
        write(&at, &actions).unwrap();
        assert_eq!(read_checked(root.path(), &record).unwrap(), actions);
        let mut changed = actions;
        changed[1].grip = GripTarget::Closure(0.25);
        write(&at, &changed).unwrap();
        assert!(problem(&record).contains("episode_00000.npy: its SHA-256 differs"), "{}", problem(&record));
        write(&at, &actions[..2]).unwrap();
        assert!(problem(&record).contains("its SHA-256 differs"), "{}", problem(&record));
    }

    #[test]
    fn actions_are_read_back_exactly_and_damaged_files_are_named() {
        let root = tempfile::tempdir().unwrap();
        let at = path(root.path(), EpisodeIndex { task: 3, episode: 12 });
        let one = |i: i32| {
            let position_b = Vec3::new(0.1 * f64::from(i), -0.3, 1e-17);
            Action::new(position_b, Vec3::new(3.1, 0.0, 1.0 / 3.0), 0.55)
        };
        let actions: Vec<Action> = (0..5).map(one).collect();
        write(&at, &actions).unwrap();
        assert!(at.ends_with("actions/task_003/episode_00012.npy"));
        assert_eq!(read(&at).unwrap(), actions);
        fs::write(&at, b"hello").unwrap();
        let error = read(&at).unwrap_err().to_string();
        assert!(error.contains("not an .npy array") && error.contains("episode_00012.npy"), "{error}");
        write(&at, &[]).unwrap();
        assert_eq!(read(&at).unwrap(), []);
        let forces = [GripTarget::Closure(1.0), GripTarget::Force(0.0), GripTarget::Force(3.5)]
            .map(|grip| Action { grip, ..one(1) });
        write(&at, &forces).unwrap();
        assert_eq!(read(&at).unwrap(), forces);
        let joints = [0.1, -0.2, 0.3, -2.4, 0.5, 2.2, 1.0 / 3.0];
        let mixed = [Action::of_joints(joints, GripTarget::Force(2.0)), forces[0], forces[2]];
        write(&at, &mixed).unwrap();
        assert_eq!(read(&at).unwrap(), mixed);
        let array = NpyArray::parse(&fs::read(&at).unwrap()).unwrap();
        assert_eq!(array.shape, [3, 15]);
        let mut numbers = array.values();
        numbers[9] = f64::NAN;
        fs::write(&at, NpyArray::from_f64(vec![3, 15], numbers).to_npy()).unwrap();
        assert!(read(&at).unwrap_err().to_string().contains("not finite"));
    }
}
