//! Writes the tables of results: `cargo run --release --example results -- FOLDER...`
//!
//! Each folder is the output of `softvt SCRIPT --out FOLDER`: of conditions (`suites/controllers.lua`), of a list of
//! suites (`suites/all.lua`), or of one suite. The results of its runs replace those of the same script, suite and
//! controller in `docs/results/results.jsonl`. Then the table and the rates in README.md and the tables in
//! `docs/results/README.md` are rewritten, also without any folder.

mod collected;
mod rows;
mod tables;

use std::{fs, path::Path};

fn main() -> Result<(), String> {
    let root = Path::new(".");
    let folders: Vec<_> = std::env::args_os().skip(1).collect();
    for folder in &folders {
        collected::add(root, Path::new(folder))?;
    }
    let (table, labels) = (rows::read(root)?, rows::labels(root)?);
    let readme = fs::read_to_string("README.md").map_err(|error| format!("README.md: {error}"))?;
    write("README.md", &tables::written(&readme, &table, &labels, &collected::rates(root)?)?)?;
    write(tables::PAGE, &tables::page(&table, &labels, &collected::physics(root)?))
}

fn write(path: &str, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|error| format!("{path}: {error}"))
}
