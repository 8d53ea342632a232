//! [`Hdf5Writer`]: writes the streams of demonstrations.

use std::{collections::BTreeSet, path::Path};

use rust_hdf5::{FilterPipeline, H5Dataset, H5File, H5Group, H5Type};
use serde_json::{Value, json};

use super::super::{DataStream, DatasetError, Demonstration, StreamValues};
use softvt_benchmark::CONTROL_HZ;
use softvt_common::files;
use softvt_runs::record::EpisodeRecord;

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

/// Writes a file that appears complete or not at all. `total` is the number of steps in all `demos` demonstrations.
///
/// # Errors
/// The file cannot be written, or `write` fails.
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

/// A file that is being written.
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

    /// Writes the attributes of a demonstration.
    pub(crate) fn write_attributes(
        &mut self,
        demo: usize,
        record: &EpisodeRecord,
        steps: usize,
    ) -> Result<(), DatasetError> {
        let key = format!("data/demo_{demo}");
        let group = self.group(&key)?;
        let failed = DatasetError::hdf5(self.path, &key);
        let header = &record.header;
        let id = &header.id;
        for (name, number) in [
            ("num_samples", steps as i64),
            ("task_id", id.task as i64),
            ("demo_id", demo as i64),
            ("attempt", i64::from(id.episode)),
            ("success", i64::from(record.verdict.safety)),
        ] {
            group.set_attr_numeric(name, &number).map_err(&failed)?;
        }
        let metadata = json!(record).to_string();
        for (name, text) in [
            ("task_suite", id.suite.as_str()),
            ("language", &header.prompt),
            ("asset_name", &header.asset),
            ("state_hash", &record.stats.state_hash),
            ("metadata_json", &metadata),
        ] {
            group.set_attr_string(name, text).map_err(&failed)?;
        }
        Ok(())
    }

    /// Writes all streams of a demonstration other than images.
    pub(crate) fn write_streams(
        &mut self,
        demo: usize,
        demonstration: &Demonstration,
    ) -> Result<(), DatasetError> {
        let top_level = demonstration.top_level_streams();
        for stream in top_level.iter().chain(&demonstration.observed).chain(&demonstration.privileged) {
            let (key, steps) = (format!("data/demo_{demo}/{}", stream.name), demonstration.steps());
            match &stream.values {
                StreamValues::F64(values) => self.write_stream(&key, stream, steps, values)?,
                StreamValues::F32(values) => self.write_stream(&key, stream, steps, values)?,
                StreamValues::U8(values) => self.write_stream(&key, stream, steps, values)?,
            }
        }
        Ok(())
    }

    fn write_stream<T: H5Type>(
        &mut self,
        key: &str,
        stream: &DataStream,
        steps: usize,
        values: &[T],
    ) -> Result<(), DatasetError> {
        let width = stream.row_shape.iter().product::<usize>() * size_of::<T>();
        let per_chunk = (MAX_CHUNK_BYTES / width.max(1)).clamp(1, steps.max(1));
        let length = ChunkedSteps { steps, per_chunk };
        let data = self.create_dataset::<T>(key, length, &stream.row_shape, size_of::<T>())?;
        data.write_raw(values).map_err(DatasetError::hdf5(self.path, key))?;
        self.write_text_attributes(key, &data, &stream.attributes)
    }

    /// Creates a dataset. Before compression, HDF5's shuffle filter groups the bytes of a chunk that are
    /// `shuffle_stride` bytes apart; 1 disables it.
    pub(crate) fn create_dataset<T: H5Type>(
        &mut self,
        key: &str,
        length: ChunkedSteps,
        row_shape: &[usize],
        shuffle_stride: usize,
    ) -> Result<H5Dataset, DatasetError> {
        let (group, name) = key.rsplit_once('/').unwrap_or(("", key));
        let group = self.group(group)?;
        let [shape, chunk] = [length.steps, length.per_chunk].map(|first| [&[first], row_shape].concat());
        let builder = group.new_dataset::<T>().shape(shape).chunk(&chunk);
        let filters = match shuffle_stride {
            1 => FilterPipeline::deflate(COMPRESSION_LEVEL),
            _ => FilterPipeline::shuffle_deflate(shuffle_stride as u32, COMPRESSION_LEVEL),
        };
        builder.filter_pipeline(filters).create(name).map_err(DatasetError::hdf5(self.path, key))
    }

    /// Creates the dataset of an image stream. Within a chunk the values of one pixel in successive images are stored
    /// next to each other, so that static parts of the image compress well.
    pub(crate) fn create_image_dataset(
        &mut self,
        demo: usize,
        name: &str,
        length: ChunkedSteps,
        width: u32,
        height: u32,
    ) -> Result<H5Dataset, DatasetError> {
        let key = format!("data/demo_{demo}/obs/{name}");
        let row_shape = [height as usize, width as usize, 3];
        let shuffle_stride = if length.per_chunk > 1 { row_shape.iter().product() } else { 1 };
        let data = self.create_dataset::<u8>(&key, length, &row_shape, shuffle_stride)?;
        let axes = [("axes".to_owned(), "step, row from the top, column, RGB (sRGB)".to_owned())];
        self.write_text_attributes(&key, &data, &axes)?;
        Ok(data)
    }

    /// Creates the dataset of a stream of depth images, float32.
    pub(crate) fn create_depth_dataset(
        &mut self,
        demo: usize,
        name: &str,
        length: ChunkedSteps,
        width: u32,
        height: u32,
    ) -> Result<H5Dataset, DatasetError> {
        let key = format!("data/demo_{demo}/obs/{name}");
        let row_shape = [height as usize, width as usize];
        let data = self.create_dataset::<f32>(&key, length, &row_shape, size_of::<f32>())?;
        let attributes = [
            ("unit", "m"),
            ("axes", "step, row from the top, column"),
            ("meaning", "depth along the optical axis; infinite in the background"),
        ];
        let attributes = attributes.map(|(name, text)| (name.to_owned(), text.to_owned()));
        self.write_text_attributes(&key, &data, &attributes)?;
        Ok(data)
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

    /// Writes text attributes of the dataset `key`.
    pub(super) fn write_text_attributes(
        &self,
        key: &str,
        data: &H5Dataset,
        attributes: &[(String, String)],
    ) -> Result<(), DatasetError> {
        for (name, text) in attributes {
            let attribute = data.new_attr::<rust_hdf5::VarLenUnicode>().shape(()).create(name);
            let written = attribute.and_then(|attribute| attribute.write_string(text));
            written.map_err(DatasetError::hdf5(self.path, key))?;
        }
        Ok(())
    }
}
