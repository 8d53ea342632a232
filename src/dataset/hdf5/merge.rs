//! Merges files of single demonstrations into the file of a task. Compressed chunks are
//! copied without decompressing them.

use std::path::{Path, PathBuf};

use rust_hdf5::{H5Dataset, H5File, H5Group, H5Type};
use serde_json::Value;

use super::{
    super::DatasetError,
    NumberType,
    read::TaskFile,
    write::{ChunkedSteps, Hdf5Writer, write_text_attributes},
};
use crate::files;

/// Writes the file of a task; demonstration k is `/data/demo_0` of part k. The file appears complete or not at all.
///
/// # Errors
/// A part cannot be read, or the file not written.
pub fn merge_parts(parts: &[PathBuf], into: &Path, environment: &Value) -> Result<(), DatasetError> {
    files::create_folder(into.parent().unwrap_or(into))?;
    let temp = files::temp_path(into);
    // On failure the space is freed, since the disk may be full; the parts stay.
    write_all(parts, &temp, environment).inspect_err(|_| drop(files::remove_if_present(&temp)))?;
    Ok(files::persist(&temp, into)?)
}

fn write_all(parts: &[PathBuf], temp: &Path, environment: &Value) -> Result<(), DatasetError> {
    let steps = parts.iter().map(|part| TaskFile::open(part)?.steps(0)).collect::<Result<Vec<_>, _>>()?;
    let mut writer = Hdf5Writer::create(temp, environment, steps.iter().sum(), parts.len())?;
    // One part is open at a time: there may be more of them than file descriptors.
    let copied = parts.iter().zip(steps).enumerate().try_for_each(|(demo, (part, steps))| {
        let source = TaskFile::open(part)?;
        writer.write_attributes(demo, &source.record(0)?, steps)?;
        let mut copier = Copier { source: &source.file, source_path: source.path(), writer: &mut writer };
        let group = copier.open("data/demo_0")?;
        copier.copy_group(&group, "data/demo_0", &format!("data/demo_{demo}"))
    });
    writer.close(copied)
}

/// Identifier of HDF5's shuffle filter.
const SHUFFLE_FILTER: u16 = 2;

struct Copier<'a, 'b> {
    source: &'a H5File,
    source_path: &'a Path,
    writer: &'a mut Hdf5Writer<'b>,
}

impl Copier<'_, '_> {
    fn open(&self, key: &str) -> Result<H5Group, DatasetError> {
        let failed = |error| DatasetError::hdf5(self.source_path, key)(error);
        let mut group = self.source.root_group();
        for name in key.split('/') {
            group = group.group(name).map_err(failed)?;
        }
        Ok(group)
    }

    fn copy_group(&mut self, group: &H5Group, from: &str, to: &str) -> Result<(), DatasetError> {
        let source_path = self.source_path;
        let failed = |error| DatasetError::hdf5(source_path, from)(error);
        for name in group.dataset_names().map_err(failed)? {
            let key = format!("{from}/{name}");
            let data = self.source.dataset(&key).map_err(|e| DatasetError::hdf5(source_path, &key)(e))?;
            let to = format!("{to}/{name}");
            match NumberType::of(source_path, &key, &data)? {
                NumberType::F64 => self.copy_dataset::<f64>(&data, &key, &to)?,
                NumberType::F32 => self.copy_dataset::<f32>(&data, &key, &to)?,
                _ => self.copy_dataset::<u8>(&data, &key, &to)?,
            }
        }
        for name in group.group_names().map_err(failed)? {
            let inner = group.group(&name).map_err(failed)?;
            self.copy_group(&inner, &format!("{from}/{name}"), &format!("{to}/{name}"))?;
        }
        Ok(())
    }

    fn copy_dataset<T: H5Type>(
        &mut self,
        data: &H5Dataset,
        from: &str,
        to: &str,
    ) -> Result<(), DatasetError> {
        let failed = |error| DatasetError::hdf5(self.source_path, from)(error);
        let shape = data.shape();
        let per_chunk = data.chunk_dims().and_then(|chunk| chunk.first().copied()).unwrap_or(1).max(1);
        let filters = data.filters().map_err(failed)?;
        let shuffle = filters.iter().find(|filter| filter.id == SHUFFLE_FILTER);
        let shuffle_stride =
            shuffle.and_then(|filter| filter.cd_values.first()).map_or(1, |bytes| *bytes as usize);
        let length = ChunkedSteps { steps: shape[0], per_chunk };
        let copy = self.writer.create_dataset::<T>(to, length, &shape[1..], shuffle_stride)?;
        let mut offset = vec![0; shape.len()];
        for index in 0..shape[0].div_ceil(per_chunk) {
            offset[0] = index;
            let (bytes, mask) = data.read_chunk_raw_at(&offset).map_err(failed)?;
            copy.write_chunk_raw(index, &bytes, mask)
                .map_err(|e| DatasetError::hdf5(self.writer.path, to)(e))?;
        }
        let mut attributes = Vec::new();
        for name in data.attr_names().map_err(failed)? {
            let text = data.attr(&name).and_then(|attr| attr.read_string()).map_err(failed)?;
            attributes.push((name, text));
        }
        write_text_attributes(&copy, &attributes).map_err(|e| DatasetError::hdf5(self.writer.path, to)(e))
    }
}
