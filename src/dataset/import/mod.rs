//! Import of demonstrations recorded by other programs, as commands and an initial state for softvt's simulation.
//!
//! `docs/data.md`, "Importing", lists what is read of each layout. A file is read and checked completely before
//! anything is simulated; errors name the file, the key and the step.

mod demo_reader;
mod foreign;
mod header;
mod libero;
mod mujoco;
mod object_matching;
mod softvt;
mod softvtbench;
mod tool_pose;

use std::path::Path;

use sha2::{Digest, Sha256};

use super::{DatasetError, TaskFile};
use demo_reader::DemoReader;

pub use foreign::{ForeignDemo, ForeignFile, ForeignObjectPose, ForeignTask, InitialCondition};
pub use header::ForeignLayout;
pub use object_matching::match_objects;

/// Reads all demonstrations of a file.
///
/// # Errors
/// Unknown layout, unsupported robot, controller or control rate, or missing or invalid streams.
pub fn read(path: &Path) -> Result<ForeignFile, DatasetError> {
    let file = TaskFile::open(path)?;
    let header = header::Header::read(&file)?;
    let demo = |&demo: &usize| {
        let reader = DemoReader { file: &file, demo };
        match header.layout {
            ForeignLayout::Softvt => softvt::demo(reader),
            ForeignLayout::SoftVtBench => softvtbench::demo(reader, &header),
            ForeignLayout::Libero => libero::demo(reader, &header),
        }
    };
    let demos = file.demos().iter().map(demo).collect::<Result<_, _>>()?;
    Ok(ForeignFile { path: path.to_owned(), sha256: sha256(path)?, layout: header.layout, demos })
}

/// SHA-256 of a file, hexadecimal.
fn sha256(path: &Path) -> Result<String, DatasetError> {
    let mut file = std::fs::File::open(path).map_err(DatasetError::io("read", path))?;
    let mut hash = Sha256::new();
    std::io::copy(&mut file, &mut hash).map_err(DatasetError::io("read", path))?;
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests;
