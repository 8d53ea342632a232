//! Plots of the calibrations of single assets.

use std::path::Path;

use softvt::script::envelope_plot;

use crate::calibration::{Calibrated, FOLDER, calibrations};

/// The plots, by their paths from the root of the repository.
pub fn plots(root: &Path) -> Result<Vec<(String, String)>, String> {
    let plot = |Calibrated { name, envelope, limit }: &Calibrated| {
        (format!("{FOLDER}/{name}.svg"), envelope_plot(name, envelope, Some(*limit)))
    };
    Ok(calibrations(root)?.iter().map(plot).collect())
}
