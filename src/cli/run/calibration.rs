//! Calibration files of assets: next to the script, in the working folder, or embedded in the binary.

use std::path::{Path, PathBuf};

use crate::{
    cli::error::CliError,
    evaluation::{safety::DeformationLimit, thresholds::ThresholdFile},
    files,
    scene::Asset,
    script,
};

/// Folders above a script in which its calibration files are searched, the script's own included.
const MAX_PARENT_FOLDERS: usize = 3;

/// The calibration of an asset.
pub(crate) enum Calibration {
    Missing,
    /// The file was computed for an asset of this name with another shape, material or friction.
    OtherVersion {
        path: String,
    },
    Found {
        /// `None` if no squeeze of the sweep was stable.
        limit: Option<DeformationLimit>,
        file: Box<ThresholdFile>,
        /// Path from the root of the project.
        relative_path: String,
        /// The file as it was read.
        text: String,
    },
}

/// Finds the calibration of an asset.
///
/// # Errors
/// Its file cannot be read, or is not a threshold file.
pub(crate) fn find(script: &Path, asset: &Asset) -> Result<Calibration, CliError> {
    let name = &asset.name;
    let relative_path = format!("assets/calibration/{name}.json");
    let Some(ProjectFile { text, path }) = find_file(script, &relative_path)? else {
        return Ok(Calibration::Missing);
    };
    let file = ThresholdFile::parse(&text, &path).map_err(CliError::input)?;
    // The published files of SoftVTBench have no fingerprint; they are assumed to fit.
    if file.fingerprints.get(name).is_some_and(|calibrated| *calibrated != asset.fingerprint()) {
        return Ok(Calibration::OtherVersion { path });
    }
    Ok(Calibration::Found { limit: file.limit(name), file: Box::new(file), relative_path, text })
}

/// A file of a project, with its path as messages show it.
struct ProjectFile {
    text: String,
    path: String,
}

/// Reads a file from the folders above the script, the working folder or the embedded library, in this order.
fn find_file(script: &Path, relative_path: &str) -> Result<Option<ProjectFile>, CliError> {
    let parents = script.parent().into_iter().flat_map(Path::ancestors).take(MAX_PARENT_FOLDERS);
    for root in parents.map(Path::to_path_buf).chain([PathBuf::new()]) {
        let path = root.join(relative_path);
        if path.is_file() {
            let text = files::read_text(&path).map_err(CliError::input)?;
            return Ok(Some(ProjectFile { text, path: path.display().to_string() }));
        }
    }
    let embedded = script::embedded(relative_path).and_then(|bytes| std::str::from_utf8(bytes).ok());
    Ok(embedded
        .map(|text| ProjectFile { text: text.to_owned(), path: format!("{relative_path} (embedded)") }))
}
