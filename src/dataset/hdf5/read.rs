//! Reading of HDF5 files of demonstrations, softvt's and others in robomimic's layout.

use std::{
    fs::File,
    ops::Range,
    path::{Path, PathBuf},
};

use rust_hdf5::{DatatypeMessage, H5Dataset, H5File, H5Group, Hdf5Error, LinkClass, StorageLayout};
use serde_json::Value;

use super::{
    super::{
        DataStream, DatasetError, Demonstration, StreamValues,
        stream::DIGEST,
        streams::{self, COMMANDED_ROTATIONS, COMMANDS_JOINTS, JOINT_ACTIONS},
    },
    write::DemoAttributes,
};
use softvt_common::files::FileError;
use softvt_geometry::Vec3;
use softvt_policy::{Action, NumberType};
use softvt_robot::ik::ArmAngles;
use softvt_runs::record::EpisodeRecord;

/// Largest number of groups and datasets of a demonstration, size of an array in memory, and number of its chunks: a
/// crafted file of a few kilobytes can state more.
const MAX_NAMES: usize = 4096;
const MAX_BYTES: usize = 1 << 31;
const MAX_CHUNKS: usize = 1 << 20;

/// The HDF5 file of a task, with the demonstrations `/data/demo_0`, `/data/demo_1`, …
pub struct TaskFile {
    pub path: PathBuf,
    /// Indices of the demonstrations, ascending.
    pub demos: Vec<usize>,
    file: H5File,
    data: H5Group,
}

/// Values of a stream as `f64`, in row-major order. The first axis is the step.
#[derive(Clone, Debug, PartialEq)]
pub struct FloatArray {
    pub values: Vec<f64>,
    pub shape: Vec<usize>,
}

impl FloatArray {
    pub fn width(&self) -> usize {
        self.shape.iter().skip(1).product()
    }
}

/// RGB images of equal size, 8 bits per channel, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageStack {
    /// Rows from the top, pixels from the left, channels last.
    pub bytes: Vec<u8>,
    /// Height of an image, px.
    pub height: usize,
    /// Width of an image, px.
    pub width: usize,
}

impl TaskFile {
    /// # Errors
    /// The file is unreadable, not HDF5, truncated, or has no group `/data/demo_0`.
    pub fn open(path: &Path) -> Result<Self, DatasetError> {
        File::open(path).map_err(FileError::io("read", path))?;
        let file = H5File::open(path).map_err(|error| DatasetError::NotHdf5 {
            path: path.display().to_string(),
            what: format!("is not a whole HDF5 file: {error}"),
        })?;
        let data = file.root_group().group("data").map_err(DatasetError::hdf5(path, "/data"))?;
        let names = data.group_names().map_err(DatasetError::hdf5(path, "/data"))?;
        let mut demos = Vec::new();
        for name in &names {
            match name.strip_prefix("demo_").and_then(|number| number.parse::<usize>().ok()) {
                Some(number) if *name == format!("demo_{number}") => demos.push(number),
                _ => {
                    let what = "expected only groups demo_0, demo_1, …, without leading zeros";
                    return Err(DatasetError::content(path, format_args!("/data/{name}"), what));
                }
            }
        }
        demos.sort_unstable();
        if demos.is_empty() {
            let what = "it has no demonstrations; expected groups demo_0, demo_1, …";
            return Err(DatasetError::content(path, "/data", what));
        }
        Ok(Self { path: path.to_owned(), demos, file, data })
    }

    /// An error about the dataset or group `name` of a demonstration.
    pub(crate) fn error(&self, demo: usize, name: &str, what: impl ToString) -> DatasetError {
        DatasetError::content(&self.path, format_args!("/data/demo_{demo}/{name}"), what)
    }

    /// Converts errors of the HDF5 library about the dataset `name` of a demonstration, for `map_err`.
    pub(super) fn failed(&self, demo: usize, name: &str) -> impl Fn(Hdf5Error) -> DatasetError {
        DatasetError::hdf5(&self.path, format!("/data/demo_{demo}/{name}"))
    }

    /// `env_args`: the environment in which the demonstrations were recorded.
    ///
    /// # Errors
    /// The attribute is missing or not JSON.
    pub fn environment(&self) -> Result<Value, DatasetError> {
        let key = "/data, attribute env_args";
        let text = self.data.attr_string("env_args").map_err(DatasetError::hdf5(&self.path, key))?;
        serde_json::from_str(&text)
            .map_err(|e| DatasetError::content(&self.path, key, format_args!("not JSON: {e}")))
    }

    fn group(&self, demo: usize) -> Result<H5Group, DatasetError> {
        if !self.demos.contains(&demo) {
            let what = format!("there is no demo_{demo}; there are {} demonstrations", self.demos.len());
            return Err(DatasetError::content(&self.path, "/data", what));
        }
        let name = format!("demo_{demo}");
        if let Some(what) = link(&self.data, &name) {
            return Err(DatasetError::content(&self.path, format_args!("/data/{name}"), what));
        }
        self.data.group(&name).map_err(DatasetError::hdf5(&self.path, format!("/data/{name}")))
    }

    /// # Errors
    /// The attribute is missing or not text.
    pub fn text(&self, demo: usize, attribute: &str) -> Result<String, DatasetError> {
        let key = format!("/data/demo_{demo}, attribute {attribute}");
        self.group(demo)?.attr_string(attribute).map_err(DatasetError::hdf5(&self.path, key))
    }

    /// # Errors
    /// The demonstration was not recorded by softvt.
    pub fn record(&self, demo: usize) -> Result<EpisodeRecord, DatasetError> {
        let key = format!("/data/demo_{demo}, attribute metadata_json");
        let text = self.text(demo, "metadata_json").map_err(|error| match self.environment() {
            Ok(environment) if environment["env_name"] == "softvt" => error,
            _ => DatasetError::not_recorded_by_softvt(&self.path, format!("/data/demo_{demo}")),
        })?;
        serde_json::from_str(&text).map_err(|error| DatasetError::content(&self.path, key, error.to_string()))
    }

    pub fn steps(&self, demo: usize) -> Result<usize, DatasetError> {
        Ok(self.dataset(demo, "actions")?.shape().first().copied().unwrap_or(0))
    }

    /// Text attribute of `/data`, if present.
    pub(crate) fn file_attribute(&self, name: &str) -> Option<String> {
        self.data.attr_string(name).ok()
    }

    /// True if the attribute of `/data` of this name is the integer `expected`.
    pub(crate) fn has_count(&self, name: &str, expected: usize) -> bool {
        self.file_attribute(name).is_some_and(|text| is_number(&text, expected as u64))
    }

    /// Names of the attributes of a demonstration that are not those of its record, and what they are.
    pub(crate) fn contradictions(&self, demo: usize, record: &EpisodeRecord) -> Vec<(&'static str, String)> {
        let DemoAttributes { numbers, texts } = DemoAttributes::new(demo, record);
        let numbers = numbers.into_iter().filter_map(|(name, expected)| {
            let is_other = self.text(demo, name).is_ok_and(|text| !is_number(&text, expected as u64));
            is_other.then(|| (name, format!("not {expected}, as metadata_json says")))
        });
        let texts = texts.into_iter().filter_map(|(name, expected)| {
            let stated = self.text(demo, name).ok().filter(|stated| stated != expected)?;
            Some((name, format!("{stated:?}, and metadata_json says {expected:?}")))
        });
        numbers.chain(texts).collect()
    }

    /// True if a demonstration has a dataset of this name, readable or not.
    pub(crate) fn has(&self, demo: usize, name: &str) -> bool {
        self.dataset(demo, name).is_ok() || self.is_listed(demo, name)
    }

    /// True if the parent group lists a dataset of this name.
    fn is_listed(&self, demo: usize, name: &str) -> bool {
        let (parent, last) =
            name.rsplit_once('/').map_or((None, name), |(parent, last)| (Some(parent), last));
        let listed = self.subgroup(demo, parent).and_then(|group| group.dataset_names().ok());
        listed.is_some_and(|names| names.iter().any(|known| known == last))
    }

    /// The group at `path` below a demonstration, or the demonstration's own.
    fn subgroup(&self, demo: usize, path: Option<&str>) -> Option<H5Group> {
        let mut names = path.into_iter().flat_map(|path| path.split('/'));
        names.try_fold(self.group(demo).ok()?, |group, name| group.group(name).ok())
    }

    /// Names of the groups in a group of a demonstration; empty if that is missing.
    #[cfg(feature = "import")]
    pub(crate) fn groups(&self, demo: usize, path: &str) -> Vec<String> {
        self.subgroup(demo, Some(path)).and_then(|group| group.group_names().ok()).unwrap_or_default()
    }

    /// Opens a dataset of a demonstration, which must lie in the file itself and not be too large to be read.
    pub(crate) fn dataset(&self, demo: usize, name: &str) -> Result<H5Dataset, DatasetError> {
        let mut group = self.group(demo)?;
        for (at, _) in name.match_indices('/').chain([(name.len(), "")]) {
            let last = name[..at].rsplit('/').next().unwrap_or(name);
            if let Some(what) = link(&group, last) {
                return Err(self.error(demo, &name[..at], what));
            }
            let Ok(inner) = group.group(last) else { break };
            group = inner;
        }
        let key = format!("data/demo_{demo}/{name}");
        let data = self.file.dataset(&key).map_err(|error| {
            // The library's error for a missing name depends on the program that wrote the group.
            let is_listed = self.is_listed(demo, name);
            self.failed(demo, name)(if is_listed { error } else { Hdf5Error::NotFound(key.clone()) })
        })?;
        let failed = self.failed(demo, name);
        if data.storage_layout().map_err(&failed)? == StorageLayout::Virtual
            || !data.external_files().map_err(&failed)?.is_empty()
        {
            return Err(self.error(demo, name, "its numbers lie in other files; expected the data itself"));
        }
        let (shape, chunk) = (data.shape(), data.chunk_dims().unwrap_or_default());
        self.limit_size(demo, name, &shape, data.element_size())?;
        self.limit_size(demo, name, &chunk, data.element_size())?;
        let chunks = shape.iter().zip(&chunk).map(|(length, per_chunk)| length.div_ceil((*per_chunk).max(1)));
        match chunks.fold(1, usize::saturating_mul) {
            0..=MAX_CHUNKS => Ok(data),
            count => Err(self.error(
                demo,
                name,
                format_args!("it has {count} chunks; at most {MAX_CHUNKS} are read"),
            )),
        }
    }

    /// Refuses an array above [`MAX_BYTES`] before memory is allocated for it.
    fn limit_size(&self, demo: usize, name: &str, shape: &[usize], bytes: usize) -> Result<(), DatasetError> {
        match shape.iter().copied().fold(bytes.max(1), usize::saturating_mul) <= MAX_BYTES {
            true => Ok(()),
            false => Err(self.error(demo, name, format_args!("its shape {shape:?} is above 2 GiB"))),
        }
    }

    pub fn shape(&self, demo: usize, name: &str) -> Result<Vec<usize>, DatasetError> {
        Ok(self.dataset(demo, name)?.shape())
    }

    /// Paths of all datasets of a demonstration, relative to it.
    ///
    /// # Errors
    /// The file is damaged, or its groups are too deep, too many, or links.
    pub fn names(&self, demo: usize) -> Result<Vec<String>, DatasetError> {
        let (mut names, mut visited) = (Vec::new(), 0);
        let mut open = vec![(String::new(), self.group(demo)?)];
        while let Some((above, group)) = open.pop() {
            let failed = self.failed(demo, &above);
            let (datasets, groups) =
                (group.dataset_names().map_err(&failed)?, group.group_names().map_err(&failed)?);
            visited += datasets.len() + groups.len();
            if visited > MAX_NAMES {
                let what = format!("the demonstration has more than {MAX_NAMES} groups and datasets");
                return Err(self.error(demo, "", what));
            }
            for name in group.link_names().map_err(&failed)? {
                if let Some(what) = link(&group, &name) {
                    return Err(self.error(demo, &format!("{above}{name}"), what));
                }
            }
            names.extend(datasets.iter().map(|name| format!("{above}{name}")));
            for name in groups.iter().rev() {
                open.push((format!("{above}{name}/"), group.group(name).map_err(&failed)?));
            }
        }
        Ok(names)
    }

    /// Reads a stream of a demonstration with its attributes.
    pub fn stream(&self, demo: usize, name: &str) -> Result<DataStream, DatasetError> {
        let data = self.dataset(demo, name)?;
        let failed = self.failed(demo, name);
        let values = match self.number_type(demo, name, &data)? {
            Some(NumberType::F32) => data.read_raw().map(StreamValues::F32).map_err(&failed),
            Some(NumberType::U8) => data.read_raw().map(StreamValues::U8).map_err(&failed),
            Some(NumberType::F64) | None => self.read_f64(demo, name, &data).map(StreamValues::F64),
        };
        let values = values?;
        let mut attributes = Vec::new();
        for attribute in data.attr_names().map_err(&failed)? {
            // Other programs may store numbers here.
            let Ok(text) = data.attr(&attribute).and_then(|attr| attr.read_string()) else { continue };
            if attribute != DIGEST {
                attributes.push((attribute, text));
            }
        }
        self.verify_digest(demo, name, || values.sha256())?;
        let row_shape = data.shape().get(1..).unwrap_or_default().to_vec();
        Ok(DataStream { name: name.to_owned(), row_shape, values, attributes })
    }

    /// Checks that the digest of a stream, if it has one, is this one of its numbers.
    pub(crate) fn verify_digest(
        &self,
        demo: usize,
        name: &str,
        digest: impl FnOnce() -> String,
    ) -> Result<(), DatasetError> {
        let data = self.dataset(demo, name)?;
        let recorded = data.attr(DIGEST).and_then(|attribute| attribute.read_string());
        match recorded.is_ok_and(|recorded| recorded != digest()) {
            true => Err(self.error(
                demo,
                name,
                "it was changed after the recording: its sha256 is of other numbers",
            )),
            false => Ok(()),
        }
    }

    pub(crate) fn has_digest(&self, demo: usize, name: &str) -> bool {
        self.dataset(demo, name).is_ok_and(|data| data.attr(DIGEST).is_ok())
    }

    /// Type of the numbers of a dataset; `None` for one that softvt does not write.
    pub(crate) fn number_type(
        &self,
        demo: usize,
        name: &str,
        data: &H5Dataset,
    ) -> Result<Option<NumberType>, DatasetError> {
        Ok(match data.datatype().map_err(self.failed(demo, name))? {
            DatatypeMessage::FloatingPoint { size: 8, .. } => Some(NumberType::F64),
            DatatypeMessage::FloatingPoint { size: 4, .. } => Some(NumberType::F32),
            DatatypeMessage::FixedPoint { size: 1, signed: false, .. } => Some(NumberType::U8),
            _ => None,
        })
    }

    /// Reads all numbers of an array as `f64`.
    fn read_f64(&self, demo: usize, name: &str, data: &H5Dataset) -> Result<Vec<f64>, DatasetError> {
        if let Ok(DatatypeMessage::FixedPoint { size: 8, .. }) = data.datatype() {
            let what = "expected numbers of type float32 or float64, got integers of 64 bits";
            return Err(self.error(demo, name, what));
        }
        self.limit_size(demo, name, &data.shape(), size_of::<f64>())?;
        data.read_numeric_as().map_err(self.failed(demo, name))
    }

    /// Reads a stream as `f64`.
    pub fn array(&self, demo: usize, name: &str) -> Result<FloatArray, DatasetError> {
        let values = self.stream(demo, name)?.values.into_f64();
        Ok(FloatArray { values, shape: self.shape(demo, name)? })
    }

    /// As [`Self::array`], of finite values.
    pub fn finite_array(&self, demo: usize, name: &str) -> Result<FloatArray, DatasetError> {
        let array = self.array(demo, name)?;
        if let Some(at) = array.values.iter().position(|x| !x.is_finite()) {
            let width = array.width().max(1);
            let (step, number, value) = (at / width, at % width, array.values[at]);
            let what = format!("step {step}, number {number}: {value} is not finite");
            return Err(self.error(demo, name, what));
        }
        Ok(array)
    }

    /// # Errors
    /// A step is missing, or the stream does not hold 8-bit RGB images.
    pub fn images(&self, demo: usize, name: &str, steps: Range<usize>) -> Result<ImageStack, DatasetError> {
        let data = self.dataset(demo, name)?;
        let &[_, height, width, 3] = &data.shape()[..] else {
            let what = format!("expected the shape (steps, height, width, 3), got {:?}", data.shape());
            return Err(self.error(demo, name, what));
        };
        let bytes = data.read_slice(&[steps.start, 0, 0, 0], &[steps.len(), height, width, 3]);
        Ok(ImageStack { bytes: bytes.map_err(self.failed(demo, name))?, height, width })
    }

    /// Reads the actions of a demonstration as they were commanded, bit for bit: absolute tool poses in the base frame,
    /// or joint positions where the recorded policy commanded these, and continuous gripper closure. Their rotation
    /// vectors may change sign at half a turn, where those of the stream `actions` are continuous.
    ///
    /// # Errors
    /// The demonstration is missing, or its actions are not finite numbers of shape (steps, 7 or more).
    pub fn actions(&self, demo: usize) -> Result<Vec<Action>, DatasetError> {
        let shape = self.shape(demo, "actions")?;
        if shape.len() != 2 || shape[1] < 7 {
            let what = format!("expected the shape (steps, 7), got {shape:?}");
            return Err(self.error(demo, "actions", what));
        }
        let rows = self.finite_array(demo, "actions")?.values;
        let action = |row: &[f64]| Action::from_array(std::array::from_fn(|i| row[i]));
        let mut actions: Vec<Action> = rows.chunks_exact(shape[1]).map(action).collect();
        if self.has(demo, COMMANDED_ROTATIONS) {
            let vectors = self.rows::<3>(demo, COMMANDED_ROTATIONS, Some(actions.len()))?;
            for (action, vector) in actions.iter_mut().zip(vectors) {
                action.axis_angle_b = Vec3::from(vector);
            }
        }
        if self.has(demo, COMMANDS_JOINTS) {
            let StreamValues::U8(are_joints) = self.stream(demo, COMMANDS_JOINTS)?.values else {
                return Err(self.error(demo, COMMANDS_JOINTS, "expected uint8"));
            };
            let joint_commands = self.joint_commands(demo)?;
            if [joint_commands.len(), are_joints.len()] != [actions.len(); 2] {
                let (steps, joints, flags) = (actions.len(), joint_commands.len(), are_joints.len());
                let what = format!("{flags} values and {joints} joint positions for {steps} actions");
                return Err(self.error(demo, COMMANDS_JOINTS, what));
            }
            for ((action, joints), are_joints) in actions.iter_mut().zip(joint_commands).zip(are_joints) {
                action.joints = (are_joints == 1).then_some(joints);
            }
        }
        Ok(actions)
    }

    /// Reads the joint positions that the actions of a demonstration mean, rad.
    ///
    /// # Errors
    /// There are none, or they are not finite numbers of shape (steps, 7).
    pub fn joint_commands(&self, demo: usize) -> Result<Vec<ArmAngles>, DatasetError> {
        if !self.has(demo, JOINT_ACTIONS) {
            let what = "the recording has no joint positions of its actions: it is of an earlier version; record it again";
            return Err(self.error(demo, JOINT_ACTIONS, what));
        }
        self.rows(demo, JOINT_ACTIONS, None)
    }

    /// Rows of an array of finite numbers of shape (`steps`, N), or (any number of steps, N).
    pub(crate) fn rows<const N: usize>(
        &self,
        demo: usize,
        name: &str,
        steps: Option<usize>,
    ) -> Result<Vec<[f64; N]>, DatasetError> {
        let shape = self.shape(demo, name)?;
        let is_expected = |rows: usize| rows > 0 && steps.is_none_or(|steps| steps == rows);
        if !matches!(shape[..], [rows, width] if width == N && is_expected(rows)) {
            let first = steps.map_or("steps".to_owned(), |steps| steps.to_string());
            let what = format!("expected the shape ({first}, {N}), got {shape:?}");
            return Err(self.error(demo, name, what));
        }
        Ok(self.finite_array(demo, name)?.values.as_chunks::<N>().0.to_vec())
    }

    /// Reads a demonstration without its images.
    ///
    /// # Errors
    /// The demonstration was not recorded by softvt, or the file is damaged.
    pub fn read(&self, demo: usize) -> Result<Demonstration, DatasetError> {
        let is_rendered = |name: &String| streams::named(name).is_some_and(|spec| spec.is_rendered());
        let names = self.names(demo)?.into_iter().filter(|name| !is_rendered(name));
        let streams = names.map(|name| self.stream(demo, &name)).collect::<Result<_, _>>()?;
        Ok(Demonstration { record: self.record(demo)?, streams })
    }
}

/// The object that `name` is a link to, as an error; `None` if it lies in `group` itself or is missing.
fn link(group: &H5Group, name: &str) -> Option<String> {
    let target = match group.link_class(name) {
        Ok(LinkClass::Soft { path }) => path,
        Ok(LinkClass::External { file, path }) => format!("{path} in the file {file}"),
        Ok(LinkClass::UserDefined { link_type }) => {
            format!("an object of the user-defined class {link_type}")
        }
        // The library opens a group under the first path that leads to it.
        Ok(LinkClass::Hard) | Err(_) => {
            let opened = group.group(name).ok()?.name().to_owned();
            let own = format!("{}/{name}", group.name().trim_end_matches('/'));
            (opened != own).then_some(opened)?
        }
    };
    Some(format!("it is a link to {target}; expected the data itself"))
}

/// True if the text that rust-hdf5 returns for the integer of a group is `expected`: its bytes up to the first zero.
fn is_number(text: &str, expected: u64) -> bool {
    let bytes = expected.to_le_bytes();
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    text == String::from_utf8_lossy(&bytes[..end])
}
