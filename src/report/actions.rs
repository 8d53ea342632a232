//! What was commanded in an episode, as an array of numpy's format 1.0 (numpy.lib.format): float64 (steps, 7), the tool's
//! position (m) and axis-angle (rad) in the base frame, and the closure.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::{
    files::{FileError, replace},
    geometry::Vec3,
    policy::Action,
};

const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
/// The data begin at a multiple of this.
const ALIGNED: usize = 64;
const WIDTH: usize = 7;

/// Why recorded actions cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ActionsError {
    /// The system refused.
    #[error(transparent)]
    Io(#[from] FileError),
    /// It is no such array.
    #[error("{path}: {what}; expected float64 numbers of shape (steps, 7), as softvt writes them")]
    Format {
        /// The file.
        path: String,
        /// What is wrong.
        what: String,
    },
}

/// Where the actions of an episode are in a run folder.
pub fn path(dir: &Path, task: usize, episode: u32) -> PathBuf {
    dir.join(format!("actions/task_{task:03}/episode_{episode:05}.npy"))
}

/// Writes the actions of an episode.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, actions: &[Action]) -> Result<(), FileError> {
    let mut header =
        format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {WIDTH}), }}", actions.len());
    let length = MAGIC.len() + 2 + header.len() + 1;
    header.extend(std::iter::repeat_n(' ', length.next_multiple_of(ALIGNED) - length));
    header.push('\n');
    let mut bytes = MAGIC.to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    let numbers =
        actions.iter().flat_map(|a| a.position_b.iter().chain(a.axis_angle_b.iter()).chain([&a.closure]));
    bytes.extend(numbers.flat_map(|x| x.to_le_bytes()));
    replace(path, bytes)
}

/// Reads the actions of an episode.
///
/// # Errors
/// The file cannot be read or is no such array.
pub fn read(path: &Path) -> Result<Vec<Action>, ActionsError> {
    let bytes = fs::read(path).map_err(FileError::io("read", path))?;
    parse(&bytes)
        .map_err(|what| ActionsError::Format { path: path.display().to_string(), what: what.to_owned() })
}

fn parse(bytes: &[u8]) -> Result<Vec<Action>, &'static str> {
    let rest = bytes.strip_prefix(MAGIC).ok_or("not an array of numpy's format 1.0")?;
    let (length, rest) = rest.split_first_chunk::<2>().ok_or("its header is cut off")?;
    let length = usize::from(u16::from_le_bytes(*length));
    let (header, data) = rest.split_at_checked(length).ok_or("its header is cut off")?;
    let header = std::str::from_utf8(header).map_err(|_| "its header is no text")?;
    if !header.contains("'descr': '<f8'") || !header.contains("'fortran_order': False") {
        return Err("its numbers are not float64 in rows");
    }
    let shape = header.split_once("'shape': (").and_then(|(_, rest)| rest.split_once(')'));
    let (rows, width) =
        shape.and_then(|(shape, _)| shape.split_once(',')).ok_or("its shape is not of two axes")?;
    let rows: usize = rows.trim().parse().map_err(|_| "its shape is not of whole numbers")?;
    if width.trim().trim_end_matches(',') != WIDTH.to_string() {
        return Err("its rows are not of 7 numbers");
    }
    let numbers: Vec<f64> = data.as_chunks::<8>().0.iter().map(|word| f64::from_le_bytes(*word)).collect();
    if rows.checked_mul(8 * WIDTH) != Some(data.len()) {
        return Err("it is cut off");
    }
    if !numbers.iter().all(|x| x.is_finite()) {
        return Err("it holds a number that is not finite");
    }
    Ok(numbers
        .as_chunks::<WIDTH>()
        .0
        .iter()
        .map(|&[x, y, z, rx, ry, rz, closure]| Action {
            position_b: Vec3::new(x, y, z),
            axis_angle_b: Vec3::new(rx, ry, rz),
            closure,
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn actions_come_back_to_the_bit_and_what_is_no_array_is_named() {
        let root = tempfile::tempdir().unwrap();
        let at = path(root.path(), 3, 12);
        let one = |i: i32| Action {
            position_b: Vec3::new(0.1 * f64::from(i), -0.3, 1e-17),
            axis_angle_b: Vec3::new(3.1, 0.0, 1.0 / 3.0),
            closure: 0.55,
        };
        let actions: Vec<Action> = (0..5).map(one).collect();
        write(&at, &actions).unwrap();
        assert!(at.ends_with("actions/task_003/episode_00012.npy"));
        assert_eq!(read(&at).unwrap(), actions);
        let whole = fs::read(&at).unwrap();
        assert_eq!((whole.len() - 5 * 56) % ALIGNED, 0);
        for (bytes, words) in [
            (&whole[..whole.len() - 1], "cut off"),
            (&whole[..9], "header is cut off"),
            (b"hello", "not an array"),
        ] {
            fs::write(&at, bytes).unwrap();
            let error = read(&at).unwrap_err().to_string();
            assert!(error.contains(words) && error.contains("episode_00012.npy"), "{error}");
        }
        write(&at, &[]).unwrap();
        assert_eq!(read(&at).unwrap(), []);
    }
}
