//! Streams into HDF5.

use std::{collections::BTreeSet, path::Path};

use rust_hdf5::{FilterPipeline, H5Dataset, H5File, H5Group, H5Type};
use serde_json::{Value, json};

use super::super::{DataStream, DatasetError, Demonstration, StreamValues};
use crate::{benchmark::control::CONTROL_DT, evaluation::record::EpisodeRecord};

/// Bytes of a chunk of numbers, at most: a reader of one step reads no more.
const CHUNK: usize = 1 << 18;
/// Compression (zlib): beyond this, pictures cost twice the time for a few percent less.
const LEVEL: u32 = 4;

/// A file that is being written.
pub(in crate::dataset) struct Hdf5Writer<'a> {
    pub file: H5File,
    pub path: &'a Path,
    made: BTreeSet<String>,
}

impl<'a> Hdf5Writer<'a> {
    /// A new file with `/data` and its attributes.
    pub(in crate::dataset) fn create(
        path: &'a Path,
        environment: &Value,
        total: usize,
        demos: usize,
    ) -> Result<Self, DatasetError> {
        let failed = |error| DatasetError::hdf5(path, "/data")(error);
        let file = H5File::create(path).map_err(|e| DatasetError::hdf5(path, "/")(e))?;
        let data = file.create_group("data").map_err(failed)?;
        let put = |name: &str, number: i64| data.set_attr_numeric(name, &number).map_err(failed);
        put("total", total as i64)?;
        put("num_demos", demos as i64)?;
        put("fps", (1.0 / CONTROL_DT).round() as i64)?;
        data.set_attr_string("env_args", &environment.to_string()).map_err(failed)?;
        data.set_attr_string("quaternions", "w x y z, w >= 0").map_err(failed)?;
        Ok(Self { file, path, made: ["data".to_owned()].into() })
    }

    /// The group of a path, made with those above it if need be.
    pub(in crate::dataset) fn group(&mut self, path: &str) -> Result<H5Group, DatasetError> {
        let failed = |error| DatasetError::hdf5(self.path, path)(error);
        let mut group = self.file.root_group();
        let mut so_far = String::new();
        for name in path.split('/') {
            so_far = if so_far.is_empty() { name.to_owned() } else { format!("{so_far}/{name}") };
            group = match self.made.insert(so_far.clone()) {
                true => group.create_group(name).map_err(failed)?,
                false => group.group(name).map_err(failed)?,
            };
        }
        Ok(group)
    }

    /// Attributes of a demonstration.
    pub(in crate::dataset) fn describe(
        &mut self,
        demo: usize,
        record: &EpisodeRecord,
        steps: usize,
    ) -> Result<(), DatasetError> {
        let key = format!("data/demo_{demo}");
        let group = self.group(&key)?;
        let failed = |error| DatasetError::hdf5(self.path, &key)(error);
        let id = &record.identity;
        for (name, number) in [
            ("num_samples", steps as i64),
            ("task_id", id.task as i64),
            ("demo_id", demo as i64),
            ("attempt", i64::from(id.episode)),
            ("success", i64::from(record.verdict.safety)),
        ] {
            group.set_attr_numeric(name, &number).map_err(failed)?;
        }
        let metadata = json!(record).to_string();
        for (name, text) in [
            ("task_suite", id.suite.as_str()),
            ("language", &id.prompt),
            ("asset_name", &id.asset),
            ("state_hash", &record.stats.state_hash),
            ("metadata_json", &metadata),
        ] {
            group.set_attr_string(name, text).map_err(failed)?;
        }
        Ok(())
    }

    /// All numbers of a demonstration.
    pub(in crate::dataset) fn numbers(
        &mut self,
        demo: usize,
        demonstration: &Demonstration,
    ) -> Result<(), DatasetError> {
        let outer = demonstration.top_level_streams();
        for stream in outer.iter().chain(&demonstration.observed).chain(&demonstration.privileged) {
            self.stream(&format!("data/demo_{demo}/{}", stream.name), stream, demonstration.steps())?;
        }
        Ok(())
    }

    fn stream(&mut self, key: &str, stream: &DataStream, steps: usize) -> Result<(), DatasetError> {
        match &stream.values {
            StreamValues::F64(numbers) => self.array(key, stream, steps, numbers),
            StreamValues::F32(numbers) => self.array(key, stream, steps, numbers),
            StreamValues::U8(numbers) => self.array(key, stream, steps, numbers),
        }
    }

    fn array<T: H5Type>(
        &mut self,
        key: &str,
        stream: &DataStream,
        steps: usize,
        numbers: &[T],
    ) -> Result<(), DatasetError> {
        let width = stream.row_shape.iter().product::<usize>() * size_of::<T>();
        let rows = (CHUNK / width.max(1)).clamp(1, steps.max(1));
        let data = self.dataset::<T>(key, (steps, rows), &stream.row_shape, size_of::<T>())?;
        let failed = |error| DatasetError::hdf5(self.path, key)(error);
        data.write_raw(numbers).map_err(failed)?;
        annotate(&data, &stream.attributes).map_err(failed)
    }

    /// A data set of `steps` rows in chunks of `rows`. Before compression the bytes of a chunk are put side by side that are
    /// `together` bytes apart (HDF5's shuffle filter).
    pub(in crate::dataset) fn dataset<T: H5Type>(
        &mut self,
        key: &str,
        (steps, rows): (usize, usize),
        row: &[usize],
        together: usize,
    ) -> Result<H5Dataset, DatasetError> {
        let (group, name) = key.rsplit_once('/').unwrap_or(("", key));
        let group = self.group(group)?;
        let [shape, chunk] = [steps, rows].map(|first| [&[first], row].concat());
        let builder = group.new_dataset::<T>().shape(shape).chunk(&chunk);
        let filters = match together {
            1 => FilterPipeline::deflate(LEVEL),
            _ => FilterPipeline::shuffle_deflate(together as u32, LEVEL),
        };
        builder.filter_pipeline(filters).create(name).map_err(|e| DatasetError::hdf5(self.path, key)(e))
    }

    /// Room for the pictures of a stream, `rows` in a chunk. The values of one pixel in all pictures of a chunk are stored side by
    /// side: what does not move takes little room then.
    pub(in crate::dataset) fn pictures(
        &mut self,
        demo: usize,
        name: &str,
        (steps, rows): (usize, usize),
        (width, height): (u32, u32),
    ) -> Result<H5Dataset, DatasetError> {
        let key = format!("data/demo_{demo}/obs/{name}");
        let row = [height as usize, width as usize, 3];
        let together = if rows > 1 { row.iter().product() } else { 1 };
        let data = self.dataset::<u8>(&key, (steps, rows), &row, together)?;
        let notes = [("axes".to_owned(), "step, row from the top, column, RGB (sRGB)".to_owned())];
        annotate(&data, &notes).map_err(|e| DatasetError::hdf5(self.path, &key)(e))?;
        Ok(data)
    }

    /// Ends the file, or gives it up if what was to be `written` into it could not be.
    pub(in crate::dataset) fn close(self, written: Result<(), DatasetError>) -> Result<(), DatasetError> {
        if written.is_err() {
            // What is wrong is known already.
            let _ = self.file.close_no_sync();
            return written;
        }
        let path = self.path;
        self.file.close().map_err(|e| DatasetError::hdf5(path, "/")(e))
    }
}

/// Puts notes at a data set.
pub(in crate::dataset) fn annotate(data: &H5Dataset, notes: &[(String, String)]) -> rust_hdf5::Result<()> {
    for (name, text) in notes {
        data.new_attr::<rust_hdf5::VarLenUnicode>().shape(()).create(name)?.write_string(text)?;
    }
    Ok(())
}
