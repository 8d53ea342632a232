//! Draws the pictures of `docs/images/` and `assets/calibration/` that follow from committed results:
//! `cargo run --release --example pictures`

mod asset_plots;
mod calibration;
mod results;
mod validation;

use std::{fs, path::Path};

fn main() -> Result<(), String> {
    let root = Path::new(".");
    write(calibration::IMAGE, &calibration::svg(root)?)?;
    asset_plots::plots(root)?.iter().try_for_each(|(path, plot)| write(path, plot))?;
    write(results::IMAGE, &results::svg(root)?)?;
    write(validation::IMAGE, &validation::svg(root)?)
}

fn write(path: &str, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|error| format!("{path}: {error}"))
}
