//! [`Hdf5Writer`]: writes the streams of demonstrations.

use std::{collections::BTreeSet, path::Path};

use rust_hdf5::{FilterPipeline, H5Dataset, H5File, H5Group};
use serde_json::{Value, json};

use super::super::{DataStream, DatasetError, StreamValues, stream::DIGEST};
use softvt_benchmark::CONTROL_HZ;
use softvt_common::files;
use softvt_policy::NumberType;
use softvt_runs::record::{EpisodeHeader, EpisodeRecord};

/// Largest chunk of numbers, bytes. Readers of one step decompress a whole chunk.
const MAX_CHUNK_BYTES: usize = 1 << 18;
/// Compression level (zlib): higher levels double the time for images and save a few percent.
const COMPRESSION_LEVEL: u32 = 4;

/// Length of a dataset and of its chunks, in steps.
#[derive(Clone, Copy)]
pub(crate) struct ChunkedSteps {
    pub steps: usize,
    pub per_chunk: usize,
}

/// Attributes of a demonstration, which repeat parts of its record.
pub(super) struct DemoAttributes<'a> {
    pub numbers: [(&'static str, i64); 5],
    pub texts: [(&'static str, &'a str); 4],
}

impl<'a> DemoAttributes<'a> {
    pub(super) fn new(demo: usize, record: &'a EpisodeRecord) -> Self {
        let EpisodeHeader { id, prompt, asset, .. } = &record.header;
        Self {
            numbers: [
                ("num_samples", i64::from(record.stats.steps)),
                ("task_id", id.task as i64),
                ("demo_id", demo as i64),
                ("attempt", i64::from(id.episode)),
                ("success", i64::from(record.verdict.safety)),
            ],
            texts: [
                ("task_suite", &id.suite),
                ("language", prompt),
                ("asset_name", asset),
                ("state_hash", &record.stats.state_hash),
            ],
        }
    }
}

/// Writes a file that appears complete or not at all. `total` is the number of steps in all `demos` demonstrations.
pub(crate) fn write_file(
    path: &Path,
    environment: &Value,
    total: usize,
    demos: usize,
    write: impl FnOnce(&mut Hdf5Writer) -> Result<(), DatasetError>,
) -> Result<(), DatasetError> {
    files::create_parent(path)?;
    let temp = files::temp_path(path);
    let written = Hdf5Writer::create(&temp, environment, total, demos).and_then(|mut writer| {
        let written = write(&mut writer);
        writer.close(written)
    });
    // On failure the space is freed, since the disk may be full.
    written.inspect_err(|_| drop(files::remove_if_present(&temp)))?;
    Ok(files::persist(&temp, path)?)
}

pub(crate) struct Hdf5Writer<'a> {
    file: H5File,
    pub path: &'a Path,
    /// Paths of the groups that exist.
    groups: BTreeSet<String>,
}

impl<'a> Hdf5Writer<'a> {
    /// Creates a file with the group `/data` and its attributes.
    fn create(path: &'a Path, environment: &Value, total: usize, demos: usize) -> Result<Self, DatasetError> {
        let failed = DatasetError::hdf5(path, "/data");
        let file = H5File::create(path).map_err(DatasetError::hdf5(path, "/"))?;
        let data = file.create_group("data").map_err(&failed)?;
        for (name, number) in [("total", total), ("num_demos", demos), ("fps", CONTROL_HZ as usize)] {
            data.set_attr_numeric(name, &(number as i64)).map_err(&failed)?;
        }
        data.set_attr_string("env_args", &environment.to_string()).map_err(&failed)?;
        data.set_attr_string("quaternions", "w x y z, w >= 0").map_err(&failed)?;
        Ok(Self { file, path, groups: ["data".to_owned()].into() })
    }

    /// The group at `path`, created with its parents if necessary.
    pub(crate) fn group(&mut self, path: &str) -> Result<H5Group, DatasetError> {
        let mut group = self.file.root_group();
        let mut end = 0;
        for name in path.split('/') {
            end += name.len();
            let is_new = self.groups.insert(path[..end].to_owned());
            let next = if is_new { group.create_group(name) } else { group.group(name) };
            group = next.map_err(DatasetError::hdf5(self.path, path))?;
            end += 1;
        }
        Ok(group)
    }

    pub(crate) fn write_attributes(
        &mut self,
        demo: usize,
        record: &EpisodeRecord,
    ) -> Result<(), DatasetError> {
        let key = format!("data/demo_{demo}");
        let group = self.group(&key)?;
        let failed = DatasetError::hdf5(self.path, &key);
        let DemoAttributes { numbers, texts } = DemoAttributes::new(demo, record);
        for (name, number) in numbers {
            group.set_attr_numeric(name, &number).map_err(&failed)?;
        }
        for (name, text) in texts {
            group.set_attr_string(name, text).map_err(&failed)?;
        }
        group.set_attr_string("metadata_json", &json!(record).to_string()).map_err(&failed)
    }

    /// Writes a stream of a demonstration with so many steps.
    pub(crate) fn write_stream(
        &mut self,
        demo: usize,
        steps: usize,
        stream: &DataStream,
    ) -> Result<(), DatasetError> {
        let key = format!("data/demo_{demo}/{}", stream.name);
        let number_type = stream.values.number_type();
        let size = number_type.bytes();
        let width = stream.row_shape.iter().product::<usize>() * size;
        let per_chunk = (MAX_CHUNK_BYTES / width.max(1)).clamp(1, steps.max(1));
        let length = ChunkedSteps { steps, per_chunk };
        let data = self.create_dataset(&key, number_type, length, &stream.row_shape, size)?;
        let written = match &stream.values {
            StreamValues::F64(values) => data.write_raw(values),
            StreamValues::F32(values) => data.write_raw(values),
            StreamValues::U8(values) => data.write_raw(values),
        };
        written.map_err(DatasetError::hdf5(self.path, &key))?;
        write_text_attributes(self.path, &key, &data, &stream.attributes)?;
        write_text_attributes(self.path, &key, &data, &[(DIGEST, stream.values.sha256())])
    }

    /// Creates a dataset. Before compression, HDF5's shuffle filter groups the bytes of a chunk that are
    /// `shuffle_stride` bytes apart; 1 disables it.
    pub(crate) fn create_dataset(
        &mut self,
        key: &str,
        number_type: NumberType,
        length: ChunkedSteps,
        row_shape: &[usize],
        shuffle_stride: usize,
    ) -> Result<H5Dataset, DatasetError> {
        let (group, name) = key.rsplit_once('/').unwrap_or(("", key));
        let group = self.group(group)?;
        let [shape, chunk] = [length.steps, length.per_chunk].map(|first| [&[first], row_shape].concat());
        let filters = match shuffle_stride {
            1 => FilterPipeline::deflate(COMPRESSION_LEVEL),
            _ => FilterPipeline::shuffle_deflate(shuffle_stride as u32, COMPRESSION_LEVEL),
        };
        let created = match number_type {
            NumberType::F64 => {
                group.new_dataset::<f64>().shape(shape).chunk(&chunk).filter_pipeline(filters).create(name)
            }
            NumberType::F32 => {
                group.new_dataset::<f32>().shape(shape).chunk(&chunk).filter_pipeline(filters).create(name)
            }
            NumberType::U8 => {
                group.new_dataset::<u8>().shape(shape).chunk(&chunk).filter_pipeline(filters).create(name)
            }
        };
        created.map_err(DatasetError::hdf5(self.path, key))
    }

    /// Closes the file. If `written` is an error, the file is closed without syncing and the error returned.
    fn close(self, written: Result<(), DatasetError>) -> Result<(), DatasetError> {
        if written.is_err() {
            // The first error is the one to report.
            let _ = self.file.close_no_sync();
            return written;
        }
        let path = self.path;
        self.file.close().map_err(DatasetError::hdf5(path, "/"))
    }
}

/// Writes text attributes of the dataset `key`.
pub(crate) fn write_text_attributes(
    path: &Path,
    key: &str,
    data: &H5Dataset,
    attributes: &[(impl AsRef<str>, impl AsRef<str>)],
) -> Result<(), DatasetError> {
    for (name, text) in attributes {
        let attribute = data.new_attr::<rust_hdf5::VarLenUnicode>().shape(()).create(name.as_ref());
        let written = attribute.and_then(|attribute| attribute.write_string(text.as_ref()));
        written.map_err(DatasetError::hdf5(path, key))?;
    }
    Ok(())
}
