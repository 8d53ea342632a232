//! The file of a task from those of its demonstrations: compressed chunks are copied as they are.

use std::path::{Path, PathBuf};

use rust_hdf5::{H5Dataset, H5File, H5Group, H5Type};
use serde_json::Value;

use super::{
    super::DatasetError,
    NumberType,
    read::TaskFile,
    write::{Hdf5Writer, annotate},
};
use crate::files;

/// Makes the file of a task: demonstration k from `/data/demo_0` of part k. It appears whole or not at all.
///
/// # Errors
/// A part cannot be read, or the file not written.
pub fn merge_parts(parts: &[PathBuf], into: &Path, environment: &Value) -> Result<(), DatasetError> {
    files::create_folder(into.parent().unwrap_or(into))?;
    let aside = files::temp_path(into);
    let written = write_all(parts, &aside, environment);
    if written.is_err() {
        // On a full disk its room is needed; the parts stay.
        let _ = files::remove_if_present(&aside);
    }
    written?;
    Ok(files::persist(&aside, into)?)
}

fn write_all(parts: &[PathBuf], aside: &Path, environment: &Value) -> Result<(), DatasetError> {
    let steps = parts.iter().map(|part| TaskFile::open(part)?.steps(0)).collect::<Result<Vec<_>, _>>()?;
    let mut writer = Hdf5Writer::create(aside, environment, steps.iter().sum(), parts.len())?;
    // One at a time: there may be more of them than files that may be open.
    let copied = parts.iter().zip(steps).enumerate().try_for_each(|(demo, (part, steps))| {
        let source = TaskFile::open(part)?;
        writer.describe(demo, &source.record(0)?, steps)?;
        let mut copy = Copy { source: &source.file, from: source.path(), writer: &mut writer };
        let group = copy.open("data/demo_0")?;
        copy.group(&group, "data/demo_0", &format!("data/demo_{demo}"))
    });
    writer.close(copied)
}

/// Number of HDF5's shuffle filter.
const SHUFFLE: u16 = 2;

struct Copy<'a, 'b> {
    source: &'a H5File,
    from: &'a Path,
    writer: &'a mut Hdf5Writer<'b>,
}

impl Copy<'_, '_> {
    fn open(&self, key: &str) -> Result<H5Group, DatasetError> {
        let failed = |error| DatasetError::hdf5(self.from, key)(error);
        let mut group = self.source.root_group();
        for name in key.split('/') {
            group = group.group(name).map_err(failed)?;
        }
        Ok(group)
    }

    fn group(&mut self, group: &H5Group, key: &str, into: &str) -> Result<(), DatasetError> {
        let failed = |error| DatasetError::hdf5(self.from, key)(error);
        for name in group.dataset_names().map_err(failed)? {
            let from = format!("{key}/{name}");
            let data = self.source.dataset(&from).map_err(|e| DatasetError::hdf5(self.from, &from)(e))?;
            self.dataset(&data, &from, &format!("{into}/{name}"))?;
        }
        for name in group.group_names().map_err(|e| DatasetError::hdf5(self.from, key)(e))? {
            let inner = group.group(&name).map_err(|e| DatasetError::hdf5(self.from, key)(e))?;
            self.group(&inner, &format!("{key}/{name}"), &format!("{into}/{name}"))?;
        }
        Ok(())
    }

    fn dataset(&mut self, data: &H5Dataset, from: &str, into: &str) -> Result<(), DatasetError> {
        match NumberType::of(self.from, from, data)? {
            NumberType::F64 => self.chunks::<f64>(data, from, into),
            NumberType::F32 => self.chunks::<f32>(data, from, into),
            _ => self.chunks::<u8>(data, from, into),
        }
    }

    fn chunks<T: H5Type>(&mut self, data: &H5Dataset, from: &str, into: &str) -> Result<(), DatasetError> {
        let failed = |error| DatasetError::hdf5(self.from, from)(error);
        let shape = data.shape();
        let rows = data.chunk_dims().and_then(|chunk| chunk.first().copied()).unwrap_or(1).max(1);
        let filters = data.filters().map_err(failed)?;
        let shuffle = filters.iter().find(|filter| filter.id == SHUFFLE);
        let together = shuffle.and_then(|filter| filter.cd_values.first()).map_or(1, |bytes| *bytes as usize);
        let copy = self.writer.dataset::<T>(into, (shape[0], rows), &shape[1..], together)?;
        let mut place = vec![0; shape.len()];
        for index in 0..shape[0].div_ceil(rows) {
            place[0] = index;
            let (bytes, mask) = data.read_chunk_raw_at(&place).map_err(failed)?;
            copy.write_chunk_raw(index, &bytes, mask)
                .map_err(|e| DatasetError::hdf5(self.writer.path, into)(e))?;
        }
        let mut notes = Vec::new();
        for name in data.attr_names().map_err(failed)? {
            let text = data.attr(&name).and_then(|attr| attr.read_string()).map_err(failed)?;
            notes.push((name, text));
        }
        annotate(&copy, &notes).map_err(|e| DatasetError::hdf5(self.writer.path, into)(e))
    }
}
