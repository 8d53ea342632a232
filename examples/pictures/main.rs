//! Draws the pictures of `docs/images/` and `assets/calibration/` that follow from committed results or from the
//! library alone: `cargo run --release --example pictures`

mod asset_plots;
mod calibration;
#[path = "../../tests/validation/gel.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod gel;
#[path = "../../tests/validation/pad.rs"]
#[allow(dead_code, reason = "shared with the tests")]
mod pad;
mod partial_slip;
mod results;
mod validation;

use std::{fs, path::Path};

fn main() -> Result<(), String> {
    let root = Path::new(".");
    write(calibration::IMAGE, &calibration::svg(root)?)?;
    asset_plots::plots(root)?.iter().try_for_each(|(path, plot)| write(path, plot))?;
    write(results::IMAGE, &results::svg(root)?)?;
    write(validation::IMAGE, &validation::svg(root)?)?;
    write(partial_slip::IMAGE, partial_slip::png().map_err(|error| error.to_string())?)
}

fn write(path: &str, content: impl AsRef<[u8]>) -> Result<(), String> {
    fs::write(path, content).map_err(|error| format!("{path}: {error}"))
}
