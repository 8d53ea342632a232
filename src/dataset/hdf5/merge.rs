//! Merges files of single demonstrations into the file of a task. Compressed chunks are
//! copied without decompressing them.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::{
    super::DatasetError,
    read::TaskFile,
    write::{ChunkedSteps, Hdf5Writer, write_file, write_text_attributes},
};
use softvt_policy::NumberType;

/// Writes the file of a task; demonstration k is `/data/demo_0` of part k. The file appears complete or not at all.
///
/// # Errors
/// A part cannot be read, or the file not written. The parts stay.
pub fn merge_parts(parts: &[PathBuf], path: &Path, environment: &Value) -> Result<(), DatasetError> {
    let steps = parts.iter().map(|part| TaskFile::open(part)?.steps(0)).collect::<Result<Vec<_>, _>>()?;
    write_file(path, environment, steps.iter().sum(), parts.len(), |writer| {
        // One part is open at a time: there may be more of them than file descriptors.
        for (demo, part) in parts.iter().enumerate() {
            let source = TaskFile::open(part)?;
            writer.write_attributes(demo, &source.record(0)?)?;
            for name in source.names(0)? {
                copy_dataset(&source, &name, writer, demo)?;
            }
        }
        Ok(())
    })
}

/// Identifier of HDF5's shuffle filter.
const SHUFFLE_FILTER: u16 = 2;

fn copy_dataset(
    source: &TaskFile,
    name: &str,
    writer: &mut Hdf5Writer,
    demo: usize,
) -> Result<(), DatasetError> {
    let failed = source.failed(0, name);
    let data = source.dataset(0, name)?;
    let (shape, number_type) = (data.shape(), source.number_type(0, name, &data)?.unwrap_or(NumberType::U8));
    let per_chunk = data.chunk_dims().and_then(|chunk| chunk.first().copied()).unwrap_or(1).max(1);
    let filters = data.filters().map_err(&failed)?;
    let shuffle = filters.iter().find(|filter| filter.id == SHUFFLE_FILTER);
    let shuffle_stride =
        shuffle.and_then(|filter| filter.cd_values.first()).map_or(1, |bytes| *bytes as usize);
    let length = ChunkedSteps { steps: shape[0], per_chunk };
    let key = format!("data/demo_{demo}/{name}");
    let copy = writer.create_dataset(&key, number_type, length, &shape[1..], shuffle_stride)?;
    let mut offset = vec![0; shape.len()];
    for index in 0..shape[0].div_ceil(per_chunk) {
        offset[0] = index;
        let (bytes, mask) = data.read_chunk_raw_at(&offset).map_err(&failed)?;
        copy.write_chunk_raw(index, &bytes, mask).map_err(DatasetError::hdf5(writer.path, &key))?;
    }
    let mut attributes = Vec::new();
    for name in data.attr_names().map_err(&failed)? {
        let text = data.attr(&name).and_then(|attr| attr.read_string()).map_err(&failed)?;
        attributes.push((name, text));
    }
    write_text_attributes(writer.path, &key, &copy, &attributes)
}
