//! Files that belong to a script: beside it, in the working folder, or embedded in the binary.

use std::path::{Path, PathBuf};

use super::Failure;
use crate::{
    evaluation::{safety::Limit, thresholds::Thresholds},
    script,
};

/// The text of `relative` (such as `assets/calibration/x.json`) and how messages name it: from the folders above the
/// script, the working folder, or the embedded library, in this order.
///
/// # Errors
/// The file exists but cannot be read.
pub fn find(script: &Path, relative: &str) -> Result<Option<(String, String)>, Failure> {
    let mut roots: Vec<PathBuf> =
        script.parent().into_iter().flat_map(Path::ancestors).take(3).map(Path::to_path_buf).collect();
    roots.push(PathBuf::new());
    for root in roots {
        let path = root.join(relative);
        if path.is_file() {
            let text = std::fs::read_to_string(&path)
                .map_err(|e| Failure::input(format!("cannot read {}: {e}", path.display())))?;
            return Ok(Some((text, path.display().to_string())));
        }
    }
    let embedded = script::embedded(relative).and_then(|bytes| std::str::from_utf8(bytes).ok());
    Ok(embedded.map(|text| (text.to_owned(), format!("{relative} (embedded)"))))
}

/// The calibrated limit of an asset; `None` if it was never calibrated.
///
/// # Errors
/// Its file cannot be read or is not a threshold file.
pub fn limit(script: &Path, asset: &str) -> Result<Option<Limit>, Failure> {
    let Some((text, path)) = find(script, &format!("assets/calibration/{asset}.json"))? else {
        return Ok(None);
    };
    let file = Thresholds::parse(&text, &path).map_err(Failure::input)?;
    Ok(file.limit(asset))
}
