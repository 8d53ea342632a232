//! Files that belong to a script: beside it, in the working folder, or embedded in the binary; and folders to write to.

use std::path::{Path, PathBuf};

use crate::{
    cli::error::CliError,
    evaluation::{safety::DeformationLimit, thresholds::ThresholdFile},
    scene::Asset,
    script,
};

/// Makes a folder and those above it.
///
/// # Errors
/// The system refuses.
pub(crate) fn make_folder(dir: &Path) -> Result<(), CliError> {
    std::fs::create_dir_all(dir)
        .map_err(|e| CliError::input(format!("cannot make the folder {}: {e}", dir.display())))
}

/// The text of `relative` (such as `assets/calibration/x.json`) and how messages name it: from the folders above the
/// script, the working folder, or the embedded library, in this order.
///
/// # Errors
/// The file exists but cannot be read.
pub(crate) fn find(script: &Path, relative: &str) -> Result<Option<(String, String)>, CliError> {
    let mut roots: Vec<PathBuf> =
        script.parent().into_iter().flat_map(Path::ancestors).take(3).map(Path::to_path_buf).collect();
    roots.push(PathBuf::new());
    for root in roots {
        let path = root.join(relative);
        if path.is_file() {
            let text = std::fs::read_to_string(&path)
                .map_err(|e| CliError::input(format!("cannot read {}: {e}", path.display())))?;
            return Ok(Some((text, path.display().to_string())));
        }
    }
    let embedded = script::embedded(relative).and_then(|bytes| std::str::from_utf8(bytes).ok());
    Ok(embedded.map(|text| (text.to_owned(), format!("{relative} (embedded)"))))
}

/// What is known of an asset's limit.
pub(crate) enum Calibrated {
    /// Nothing.
    Never,
    /// The file (as messages name it) is about another object of that name.
    Another(String),
    /// The limit, its file, and the file's text.
    Yes {
        /// The limit; none if no squeeze of the sweep was stable.
        limit: Option<DeformationLimit>,
        /// All that the file says.
        file: Box<ThresholdFile>,
        /// Path from the project's root.
        path: String,
        /// The file's text.
        text: String,
    },
}

/// The calibrated limit of an asset, if it was calibrated as it is now.
///
/// # Errors
/// Its file cannot be read or is not a threshold file.
pub(crate) fn calibrated(script: &Path, asset: &Asset) -> Result<Calibrated, CliError> {
    let name = &asset.name;
    let relative = format!("assets/calibration/{name}.json");
    let Some((text, path)) = find(script, &relative)? else {
        return Ok(Calibrated::Never);
    };
    let file = ThresholdFile::parse(&text, &path).map_err(CliError::input)?;
    // Released files carry no fingerprint and are taken at their word.
    if file.fingerprints.get(name).is_some_and(|known| *known != asset.fingerprint()) {
        return Ok(Calibrated::Another(path));
    }
    Ok(Calibrated::Yes { limit: file.limit(name), file: Box::new(file), path: relative, text })
}
