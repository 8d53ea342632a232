//! What can be wrong with a data set.

use std::{fmt::Display, io, path::Path};

use rust_hdf5::Hdf5Error;

use super::video::VideoError;
use crate::{files::FileError, rollout::SensingError};

/// Why demonstrations cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    #[error(transparent)]
    File(#[from] FileError),
    /// There is no HDF5 file.
    #[error("{path} {what}")]
    NotHdf5 {
        /// What should be one.
        path: String,
        /// What it is instead.
        what: String,
    },
    /// The file is damaged, or what is looked for is not in it.
    #[error("{path}: {key}: {what}")]
    Hdf5 {
        /// The file.
        path: String,
        /// The group or data set in it.
        key: String,
        /// What is wrong.
        what: String,
    },
    /// The file is whole and does not hold what it should.
    #[error("{path}: {key}: {what}")]
    Content {
        /// The file.
        path: String,
        /// The group, data set or line in it.
        key: String,
        /// What is wrong, and what was expected.
        what: String,
    },
    /// Something else is where it should go.
    #[error("--out {out}: {what}")]
    OutputNotEmpty {
        /// The folder.
        out: String,
        /// What is there, and what to do.
        what: String,
    },
    /// A stream cannot be made.
    #[error(transparent)]
    Sense(#[from] SensingError),
    /// A video cannot be made.
    #[error(transparent)]
    Video(#[from] VideoError),
    /// The end was asked for.
    #[error("interrupted")]
    Interrupted,
}

impl DatasetError {
    /// Converts the `io::Error` of `action` on `path`, for `map_err`.
    pub(crate) fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self + use<> {
        let convert = FileError::io(action, path);
        move |source| Self::File(convert(source))
    }

    /// What the HDF5 library said of a key of a file.
    pub(super) fn hdf5(path: &Path, key: impl Display) -> impl FnOnce(Hdf5Error) -> Self {
        let (path, key) = (path.display().to_string(), key.to_string());
        move |error| match error {
            Hdf5Error::Io(source) => Self::File(FileError::Io { action: "read or write", path, source }),
            Hdf5Error::NotFound(_) => Self::Hdf5 { path, key, what: "it is not there".to_owned() },
            // Its layers name themselves before what the system said.
            other => {
                let what = other.to_string();
                let said = what.rsplit_once("I/O error: ").map(|(_, said)| said.to_owned());
                let (_, cause) = what.rsplit_once("error: ").unwrap_or(("", &what));
                let damaged = || format!("it cannot be read; is the file damaged? ({cause})");
                Self::Hdf5 { path, key, what: said.unwrap_or_else(damaged) }
            }
        }
    }

    /// Something is not as it should be.
    pub(super) fn content(path: &Path, key: impl Display, what: impl Into<String>) -> Self {
        Self::Content { path: path.display().to_string(), key: key.to_string(), what: what.into() }
    }
}
