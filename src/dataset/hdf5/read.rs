//! HDF5 files of demonstrations, ours and others of robomimic's layout.

use std::{
    fs::File,
    io::{Read, Seek, SeekFrom},
    ops::Range,
    path::{Path, PathBuf},
};

use rust_hdf5::{H5Dataset, H5File, H5Group, Hdf5Error};
use serde_json::Value;

use super::{
    super::{DataStream, DatasetError, Demonstration, StreamValues},
    NumberType,
};
use crate::{evaluation::record::EpisodeRecord, geometry::Vec3, policy::Action};

/// The file of a task: `/data/demo_0` and so on.
pub struct TaskFile {
    pub(in crate::dataset) file: H5File,
    path: PathBuf,
    data: H5Group,
    demos: Vec<usize>,
}

/// The actions of a demonstration, absolute as softvt records them, with the continuous code of the gripper.
///
/// # Errors
/// The file is no HDF5 of this layout, has no such demonstration, or its actions are not `(steps, 7)` finite numbers, or more
/// a step.
pub fn actions(path: &Path, demo: usize) -> Result<Vec<Action>, DatasetError> {
    TaskFile::open(path)?.actions(demo)
}

impl TaskFile {
    /// Opens a file and lists its demonstrations.
    ///
    /// # Errors
    /// It cannot be read, is no HDF5, is cut off, or has no `/data/demo_0`.
    pub fn open(path: &Path) -> Result<Self, DatasetError> {
        let about = std::fs::metadata(path).map_err(DatasetError::io("read", path))?;
        let file = || path.display().to_string();
        if about.is_dir() {
            return Err(DatasetError::NotHdf5 { path: file(), what: "is a folder, no HDF5 file".to_owned() });
        }
        match end_of(path) {
            None => {
                let what = "is no HDF5 file: it does not begin as one".to_owned();
                return Err(DatasetError::NotHdf5 { path: file(), what });
            }
            Some(end) if end > about.len() => {
                let what = cut_short(about.len(), end);
                return Err(DatasetError::NotHdf5 { path: file(), what });
            }
            Some(_) => {}
        }
        let file = H5File::open(path).map_err(|e| DatasetError::hdf5(path, "/")(e))?;
        let data = file.root_group().group("data").map_err(|e| DatasetError::hdf5(path, "/data")(e))?;
        let names = data.group_names().map_err(|e| DatasetError::hdf5(path, "/data")(e))?;
        let mut demos = Vec::new();
        for name in names.iter().filter(|name| name.starts_with("demo_")) {
            match name["demo_".len()..].parse::<usize>() {
                Ok(number) if *name == format!("demo_{number}") => demos.push(number),
                _ => {
                    let what = "expected the names demo_0, demo_1, …, without zeros in front";
                    return Err(DatasetError::content(path, format!("/data/{name}"), what));
                }
            }
        }
        demos.sort_unstable();
        if demos.is_empty() {
            let what = "it has no demonstrations; expected groups demo_0, demo_1, …";
            return Err(DatasetError::content(path, "/data", what));
        }
        Ok(Self { file, path: path.to_owned(), data, demos })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// StreamValues of its demonstrations, in order.
    pub fn demos(&self) -> &[usize] {
        &self.demos
    }

    /// `env_args`: the world in which they were made, and how.
    ///
    /// # Errors
    /// It is not there or no JSON.
    pub fn environment(&self) -> Result<Value, DatasetError> {
        let key = "/data, attribute env_args";
        let text = self.data.attr_string("env_args").map_err(|e| DatasetError::hdf5(&self.path, key)(e))?;
        serde_json::from_str(&text)
            .map_err(|e| DatasetError::content(&self.path, key, format!("no JSON: {e}")))
    }

    fn group(&self, demo: usize) -> Result<H5Group, DatasetError> {
        if !self.demos.contains(&demo) {
            let what = format!("there is no demo_{demo}; there are {} demonstrations", self.demos.len());
            return Err(DatasetError::content(&self.path, "/data", what));
        }
        let name = format!("demo_{demo}");
        self.data.group(&name).map_err(|e| DatasetError::hdf5(&self.path, format!("/data/{name}"))(e))
    }

    /// Text of an attribute of a demonstration.
    ///
    /// # Errors
    /// It is not there or no text.
    pub fn text(&self, demo: usize, attribute: &str) -> Result<String, DatasetError> {
        let key = format!("/data/demo_{demo}, attribute {attribute}");
        self.group(demo)?.attr_string(attribute).map_err(|e| DatasetError::hdf5(&self.path, key)(e))
    }

    /// How a demonstration was judged.
    ///
    /// # Errors
    /// It was not recorded by softvt.
    pub fn record(&self, demo: usize) -> Result<EpisodeRecord, DatasetError> {
        let key = format!("/data/demo_{demo}, attribute metadata_json");
        let text = self.text(demo, "metadata_json").map_err(|error| match self.environment() {
            Ok(environment) if environment["env_name"] == "softvt" => error,
            _ => {
                let what =
                    "softvt did not record it; softvt dataset import re-executes what others have recorded";
                DatasetError::content(&self.path, format!("/data/demo_{demo}"), what)
            }
        })?;
        serde_json::from_str(&text)
            .map_err(|e| DatasetError::content(&self.path, key, format!("no record of softvt: {e}")))
    }

    /// Control steps of a demonstration.
    ///
    /// # Errors
    /// It has no actions.
    pub fn steps(&self, demo: usize) -> Result<usize, DatasetError> {
        Ok(self.dataset(demo, "actions")?.shape().first().copied().unwrap_or(0))
    }

    /// Text of an attribute of `/data`, if it has such.
    pub(in crate::dataset) fn about(&self, attribute: &str) -> Option<String> {
        self.data.attr_string(attribute).ok()
    }

    /// Whether a demonstration has a data set, be it one that cannot be read.
    pub(in crate::dataset) fn has(&self, demo: usize, name: &str) -> bool {
        self.dataset(demo, name).is_ok() || self.lists(demo, name)
    }

    /// Whether the group above it lists a data set.
    fn lists(&self, demo: usize, name: &str) -> bool {
        let (above, last) = name.rsplit_once('/').map_or((None, name), |(above, last)| (Some(above), last));
        let listed = self.inner(demo, above).and_then(|group| group.dataset_names().ok());
        listed.is_some_and(|names| names.iter().any(|known| known == last))
    }

    /// A group of a demonstration by its path below it, or the demonstration's own.
    fn inner(&self, demo: usize, path: Option<&str>) -> Option<H5Group> {
        let mut names = path.into_iter().flat_map(|path| path.split('/'));
        names.try_fold(self.group(demo).ok()?, |group, name| group.group(name).ok())
    }

    /// Names of the groups in a group of a demonstration; none if it is not there.
    pub(in crate::dataset) fn groups(&self, demo: usize, path: &str) -> Vec<String> {
        self.inner(demo, Some(path)).and_then(|group| group.group_names().ok()).unwrap_or_default()
    }

    pub(in crate::dataset) fn dataset(&self, demo: usize, name: &str) -> Result<H5Dataset, DatasetError> {
        self.group(demo)?;
        let key = format!("data/demo_{demo}/{name}");
        self.file.dataset(&key).map_err(|error| {
            // What the library says of names that are not there depends on who wrote the group.
            let error = if self.lists(demo, name) { error } else { Hdf5Error::NotFound(key.clone()) };
            DatasetError::hdf5(&self.path, format!("/{key}"))(error)
        })
    }

    /// Shape of a data set of a demonstration.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn shape(&self, demo: usize, name: &str) -> Result<Vec<usize>, DatasetError> {
        Ok(self.dataset(demo, name)?.shape())
    }

    /// Every data set of a demonstration, by its path below it.
    ///
    /// # Errors
    /// The file is broken.
    pub fn names(&self, demo: usize) -> Result<Vec<String>, DatasetError> {
        let mut names = Vec::new();
        collect(&self.group(demo)?, "", &mut names)
            .map_err(|e| DatasetError::hdf5(&self.path, format!("/data/demo_{demo}"))(e))?;
        Ok(names)
    }

    /// A stream of a demonstration.
    ///
    /// # Errors
    /// There is none of that name, or it cannot be read.
    pub fn stream(&self, demo: usize, name: &str) -> Result<DataStream, DatasetError> {
        let data = self.dataset(demo, name)?;
        let key = format!("/data/demo_{demo}/{name}");
        let failed = |error| DatasetError::hdf5(&self.path, &key)(error);
        let values = match NumberType::of(&self.path, &key, &data)? {
            NumberType::F32 => data.read_raw().map(StreamValues::F32),
            NumberType::U8 => data.read_raw().map(StreamValues::U8),
            _ => data.read_numeric_as().map(StreamValues::F64),
        };
        let mut attributes = Vec::new();
        for name in data.attr_names().map_err(failed)? {
            // Others may keep numbers there.
            if let Ok(text) = data.attr(&name).and_then(|attr| attr.read_string()) {
                attributes.push((name, text));
            }
        }
        let row_shape = data.shape().get(1..).unwrap_or_default().to_vec();
        Ok(DataStream { name: name.to_owned(), row_shape, values: values.map_err(failed)?, attributes })
    }

    /// StreamValues of a stream as doubles, with its width a step.
    ///
    /// # Errors
    /// As [`TaskFile::stream`].
    pub fn doubles(&self, demo: usize, name: &str) -> Result<(Vec<f64>, usize), DatasetError> {
        let data = self.dataset(demo, name)?;
        let key = format!("/data/demo_{demo}/{name}");
        let numbers = data.read_numeric_as().map_err(|e| DatasetError::hdf5(&self.path, &key)(e))?;
        Ok((numbers, data.shape().iter().skip(1).product()))
    }

    /// One picture of a stream: its bytes, and its height and width.
    ///
    /// # Errors
    /// There is no such picture, or it is none of 8 bits and three channels.
    pub fn picture(
        &self,
        demo: usize,
        name: &str,
        step: usize,
    ) -> Result<(Vec<u8>, [usize; 2]), DatasetError> {
        self.pictures(demo, name, step..step + 1)
    }

    /// Pictures of a stream: the bytes of all, one after the other, and the height and width of each.
    ///
    /// # Errors
    /// As [`TaskFile::picture`].
    pub fn pictures(
        &self,
        demo: usize,
        name: &str,
        steps: Range<usize>,
    ) -> Result<(Vec<u8>, [usize; 2]), DatasetError> {
        let data = self.dataset(demo, name)?;
        let key = format!("/data/demo_{demo}/{name}");
        let &[_, height, width, 3] = &data.shape()[..] else {
            let what = format!("expected the shape (steps, height, width, 3), got {:?}", data.shape());
            return Err(DatasetError::content(&self.path, key, what));
        };
        let bytes = data.read_slice(&[steps.start, 0, 0, 0], &[steps.len(), height, width, 3]);
        Ok((bytes.map_err(|e| DatasetError::hdf5(&self.path, key)(e))?, [height, width]))
    }

    /// See [`actions`].
    ///
    /// # Errors
    /// As there.
    pub fn actions(&self, demo: usize) -> Result<Vec<Action>, DatasetError> {
        let shape = self.shape(demo, "actions")?;
        let wrong =
            |what: String| DatasetError::content(&self.path, format!("/data/demo_{demo}/actions"), what);
        if shape.len() != 2 || shape[1] < 7 {
            return Err(wrong(format!("expected the shape (steps, 7), got {shape:?}")));
        }
        let (numbers, width) = self.doubles(demo, "actions")?;
        if let Some(at) = numbers.iter().position(|x| !x.is_finite()) {
            return Err(wrong(format!(
                "step {}, number {}: {} is not finite",
                at / width,
                at % width,
                numbers[at]
            )));
        }
        let action = |row: &[f64]| Action {
            position_b: Vec3::new(row[0], row[1], row[2]),
            axis_angle_b: Vec3::new(row[3], row[4], row[5]),
            closure: row[6],
        };
        Ok(numbers.chunks_exact(width).map(action).collect())
    }

    /// A demonstration without its pictures.
    ///
    /// # Errors
    /// It was not recorded by softvt, or is broken.
    pub fn read(&self, demo: usize) -> Result<Demonstration, DatasetError> {
        let gripper_closed =
            self.doubles(demo, "actions_binary")?.0.chunks(7).map(|row| row[6] > 0.5).collect();
        let mut read = Demonstration {
            record: self.record(demo)?,
            actions: self.actions(demo)?,
            gripper_closed,
            observed: Vec::new(),
            privileged: Vec::new(),
        };
        for name in self.names(demo)? {
            let is_privileged = name.starts_with("privileged/");
            if !is_privileged && (!name.starts_with("obs/") || name.ends_with("_rgb")) {
                continue;
            }
            let stream = self.stream(demo, &name)?;
            if is_privileged { read.privileged.push(stream) } else { read.observed.push(stream) }
        }
        Ok(read)
    }
}

fn cut_short(size: u64, end: u64) -> String {
    match end {
        u64::MAX => format!("is cut short: only {size} bytes are there"),
        end => format!("is cut short: {size} of {end} bytes are there"),
    }
}

/// What HDF5 files begin with.
const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Where a file says that it ends, 0 if that is not known; none if it does not begin as such files do. Something else may
/// stand in front of it, as long as 512 bytes or a multiple of them by a power of two (HDF5 file format, II.A).
fn end_of(path: &Path) -> Option<u64> {
    let mut file = File::open(path).ok()?;
    let mut head = |from: u64| -> Option<Vec<u8>> {
        let mut head = Vec::new();
        file.seek(SeekFrom::Start(from)).ok()?;
        file.by_ref().take(64).read_to_end(&mut head).ok()?;
        (!head.is_empty()).then_some(head)
    };
    let first = head(0)?;
    if first.starts_with(SIGNATURE) {
        return Some(stated_end(&first).unwrap_or(u64::MAX));
    }
    let mut heads = (9..63).map_while(|power| head(1 << power));
    heads.any(|head| head.starts_with(SIGNATURE)).then_some(0)
}

/// The end that a superblock states, 0 if its numbers are not of 8 bytes; none if it is cut short itself.
fn stated_end(head: &[u8]) -> Option<u64> {
    // Behind signature and versions, sizes and flags come base address, extension or free space, and the end; 8 bytes each.
    let (width, at) = match head.get(8)? {
        0 => (13, 40),
        1 => (13, 44),
        _ => (9, 28),
    };
    if *head.get(width)? != 8 {
        return Some(0);
    }
    Some(u64::from_le_bytes(head.get(at..at + 8)?.try_into().ok()?))
}

fn collect(group: &H5Group, above: &str, names: &mut Vec<String>) -> rust_hdf5::Result<()> {
    names.extend(group.dataset_names()?.iter().map(|name| format!("{above}{name}")));
    for inner in group.group_names()? {
        collect(&group.group(&inner)?, &format!("{above}{inner}/"), names)?;
    }
    Ok(())
}
