//! Writes the tables of results: `cargo run --release --example results -- FOLDER...`
//!
//! Each folder is the output of `softvt SCRIPT --out FOLDER`: of conditions (`suites/controllers.lua`), of a list of
//! suites (`suites/all.lua`), or of one suite. The results of its runs replace those of the same suites and controllers
//! in `docs/results/SCRIPT.json`, which are committed; to drop others, delete that file first. Then the tables in
//! README.md and `docs/results/README.md` are written anew from these files, also without any folder, and the rates in
//! README.md from `assets/rates.json`.

mod collected;
mod tables;

use std::{fs, path::Path};

fn main() -> Result<(), String> {
    let root = Path::new(".");
    let folders: Vec<_> = std::env::args_os().skip(1).collect();
    for folder in &folders {
        collected::add(root, Path::new(folder))?;
    }
    let (results, labels, physics) =
        (collected::read(root)?, collected::labels(root)?, collected::physics(root)?);
    let readme = fs::read_to_string("README.md").map_err(|error| format!("README.md: {error}"))?;
    let rates = collected::rates(root)?;
    write("README.md", &tables::written(&readme, &results, &labels, &physics, &rates)?)?;
    write(tables::PAGE, &tables::page(&results, &labels, &physics))
}

fn write(path: &str, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|error| format!("{path}: {error}"))
}
