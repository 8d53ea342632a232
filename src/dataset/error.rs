//! [`DatasetError`].

use std::{fmt::Display, path::Path};

use rust_hdf5::Hdf5Error;

use softvt_common::files::FileError;
use softvt_media::video::VideoError;
use softvt_rollout::SensingError;

/// Error of reading, writing or rendering demonstrations. Messages name the file and the key in it: a group, a dataset,
/// an attribute or a line.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error("{path} {what}")]
    NotHdf5 { path: String, what: String },
    #[error("{path}: {key}: {what}")]
    Content { path: String, key: String, what: String },
    #[error("{out}: {what}")]
    Output { out: String, what: String },
    #[error(transparent)]
    Sensing(#[from] SensingError),
    #[error(transparent)]
    Video(#[from] VideoError),
    #[error("interrupted")]
    Interrupted,
}

impl DatasetError {
    /// Converts errors of the HDF5 library about `key`, for `map_err`.
    pub(super) fn hdf5(path: &Path, key: impl Display) -> impl Fn(Hdf5Error) -> Self {
        let (path, key) = (path.display().to_string(), key.to_string());
        move |error| {
            let (path, key) = (path.clone(), key.clone());
            let what = match error {
                Hdf5Error::Io(source) => {
                    return Self::File(FileError::Io { action: "read or write", path, source });
                }
                Hdf5Error::NotFound(_) => "it is missing".to_owned(),
                // Each layer of the library prefixes its name; only the innermost message is useful.
                other => {
                    let text = other.to_string();
                    match text.rsplit_once("I/O error: ") {
                        Some((_, system_message)) => system_message.to_owned(),
                        None => {
                            let (_, cause) = text.rsplit_once("error: ").unwrap_or(("", &text));
                            format!("it cannot be read; is the file damaged? ({cause})")
                        }
                    }
                }
            };
            Self::Content { path, key, what }
        }
    }

    pub(super) fn content(path: &Path, key: impl Display, what: impl ToString) -> Self {
        Self::Content { path: path.display().to_string(), key: key.to_string(), what: what.to_string() }
    }

    pub(super) fn not_recorded_by_softvt(path: &Path, key: impl Display) -> Self {
        Self::content(path, key, "it was not recorded by softvt; an import re-executes such demonstrations")
    }
}
