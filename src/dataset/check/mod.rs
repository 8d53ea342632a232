//! Checks of a dataset for what the digests of its streams cannot show: that its files belong together and are
//! complete.
//!
//! Reading a stream verifies its digest, and so that its numbers are those of the recording. That they follow from the
//! commands, a re-simulation shows.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use serde_json::json;

use super::{
    DataStream, DatasetError, TaskFile,
    card::DatasetCard,
    layout::{CARD, MANIFEST, TaskPaths},
    manifest::{self, ManifestEntry},
    streams::{self, Presence, StreamSpec},
};
use softvt_benchmark::CONTROL_HZ;
use softvt_common::{files::FileError, text::counted};
use softvt_media::video;

#[derive(Debug, Default)]
pub struct CheckReport {
    pub demos: usize,
    pub steps: usize,
    pub videos: usize,
    /// One message per problem, with file and key.
    pub problems: Vec<String>,
}

/// Checks the folder of a finished `softvt record`.
///
/// # Errors
/// `dataset.json` or the manifest is missing or unreadable.
pub fn folder(root: &Path) -> Result<CheckReport, DatasetError> {
    // The manifest says of other folders what they are.
    let (entries, card) = (manifest::read(root)?, DatasetCard::read(root)?);
    let mut report = CheckReport::default();
    report.compare(&root.join(CARD), "fps", &card.fps, &CONTROL_HZ);
    let mut files: BTreeMap<&str, Vec<&ManifestEntry>> = BTreeMap::new();
    for entry in &entries {
        files.entry(&entry.hdf5_path).or_default().push(entry);
        report.videos(root, entry);
    }
    report.take(card.one_recording(root, &entries));
    for task in &card.tasks {
        let of_task = |e: &&ManifestEntry| e.task_id == task.task && e.suite == task.suite;
        let listed: Vec<usize> = entries.iter().filter(of_task).map(|entry| entry.num_samples).collect();
        let key = |name: &str| format!("{name} of {} task {}", task.suite, task.task);
        report.compare(&root.join(MANIFEST), &key("lines"), &listed.len(), &task.demos);
        report.compare(&root.join(MANIFEST), &key("num_samples"), &listed.iter().sum(), &task.samples);
    }
    for path in stray_files(root, &files) {
        report.add(&path, "/data", "the manifest has no line of this file; remove it");
    }
    for (path, entries) in files {
        let Some(file) = report.take(TaskFile::open(&root.join(path))) else { continue };
        report.compare(&file.path, "/data, demonstrations", &file.demos.len(), &entries.len());
        entries.into_iter().for_each(|entry| report.entry(&file, entry));
        report.demonstrations(&file);
    }
    Ok(report)
}

pub fn file(path: &Path) -> Result<CheckReport, DatasetError> {
    let mut report = CheckReport::default();
    report.demonstrations(&TaskFile::open(path)?);
    Ok(report)
}

/// The first declared stream without a digest in HDF5 files, with their number; `None` if all have one.
pub fn without_digest(paths: &[PathBuf]) -> Result<Option<String>, DatasetError> {
    let (mut first, mut count) = (None, 0);
    for path in paths {
        let file = TaskFile::open(path)?;
        for &demo in &file.demos {
            for name in file.names(demo)?.iter().filter(|name| lacks_digest(&file, demo, name)) {
                count += 1;
                first = first.or_else(|| Some(file.error(demo, name, NO_DIGEST).to_string()));
            }
        }
    }
    Ok(first.map(|first| format!("{first} ({} in all)", counted(count, "stream"))))
}

const NO_DIGEST: &str = "it has no sha256: an earlier version or another program has written it";

fn lacks_digest(file: &TaskFile, demo: usize, name: &str) -> bool {
    streams::named(name).is_some() && !file.has_digest(demo, name)
}

/// The declared type and shape of a stream, if it has others.
fn declaration_mismatch(spec: &StreamSpec, stream: &DataStream) -> Option<String> {
    let (expected, got) = (&spec.row, &stream.row_shape);
    let fits = expected.len() == got.len()
        && expected.iter().zip(got).all(|(expected, got)| expected.is_none_or(|expected| expected == *got));
    if fits && stream.values.number_type() == spec.number_type {
        return None;
    }
    let (expected, number_type) = (spec.shape_text(), spec.number_type.name());
    Some(format!(
        "expected {number_type} of shape {expected}, got {} with {got:?} per step",
        stream.values.number_type().name()
    ))
}

/// HDF5 files that the manifest does not name.
fn stray_files(root: &Path, named: &BTreeMap<&str, Vec<&ManifestEntry>>) -> Vec<PathBuf> {
    let known: BTreeSet<PathBuf> = named.keys().map(|path| root.join(path)).collect();
    let folders: BTreeSet<&Path> = known.iter().filter_map(|path| path.parent()).collect();
    let entries = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten();
    let files =
        entries.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|end| end == "hdf5"));
    let mut stray: Vec<PathBuf> = files.filter(|path| !known.contains(path)).collect();
    stray.sort();
    stray
}

impl CheckReport {
    fn add(&mut self, path: &Path, key: &str, what: impl ToString) {
        self.problems.push(DatasetError::content(path, key, what).to_string());
    }

    /// The value of `result`; an error is added to the problems.
    fn take<T, E: ToString>(&mut self, result: Result<T, E>) -> Option<T> {
        result.map_err(|error| self.problems.push(error.to_string())).ok()
    }

    /// Adds a problem if a value is not the expected one.
    fn compare<T: PartialEq + ToString>(&mut self, path: &Path, key: &str, found: &T, expected: &T) {
        if found != expected {
            self.add(path, key, format!("{}, expected {}", found.to_string(), expected.to_string()));
        }
    }

    /// Checks that a demonstration is the one that its line of the manifest describes.
    fn entry(&mut self, file: &TaskFile, entry: &ManifestEntry) {
        let Some(record) = self.take(file.record(entry.demo_id)) else { return };
        let paths = TaskPaths { root: PathBuf::new(), suite: String::new(), task: entry.task_id };
        let (hdf5_path, video_files) = (entry.hdf5_path.clone(), entry.video_files.clone());
        let own = ManifestEntry::new(&paths, entry.demo_id, &record);
        let (own, listed) = (json!(ManifestEntry { hdf5_path, video_files, ..own }), json!(entry));
        let key = format!("/data/demo_{}, attribute metadata_json", entry.demo_id);
        for (name, listed) in
            listed.as_object().into_iter().flatten().filter(|(name, listed)| own[*name] != **listed)
        {
            self.add(&file.path, &key, format!("{name} is {}, the manifest says {listed}", own[name]));
        }
    }

    /// Checks that the videos of a demonstration have one frame per step, at the control rate.
    fn videos(&mut self, root: &Path, entry: &ManifestEntry) {
        for (stream, file) in &entry.video_files {
            let path = root.join(file);
            let bytes = std::fs::read(&path).map_err(FileError::io("read", &path));
            let Some(bytes) = self.take(bytes) else { continue };
            self.videos += 1;
            match video::VideoInfo::read(&bytes) {
                None => self.add(&path, stream, "not an MP4 file, or truncated"),
                Some(video) => {
                    self.compare(&path, &format!("{stream}, frames"), &video.frames, &entry.num_samples);
                    let rate = video.frame_rate.round() as u32;
                    self.compare(&path, &format!("{stream}, frames per second"), &rate, &CONTROL_HZ);
                }
            }
        }
    }

    fn demonstrations(&mut self, file: &TaskFile) {
        let Some(environment) = self.take(file.environment()) else { return };
        if environment["env_name"] != "softvt" {
            let error = DatasetError::not_recorded_by_softvt(&file.path, "/data, attribute env_args");
            return self.problems.push(error.to_string());
        }
        let steps_before = self.steps;
        for &demo in &file.demos {
            self.demos += 1;
            self.demonstration(file, demo);
        }
        let (steps, demos) = (self.steps - steps_before, file.demos.len());
        for (name, count) in [("total", steps), ("num_demos", demos), ("fps", CONTROL_HZ as usize)] {
            if !file.has_count(name, count) {
                self.add(&file.path, &format!("/data, attribute {name}"), format!("expected {count}"));
            }
        }
    }

    /// Checks that a demonstration has all streams, with their digests and as many rows as its record has steps.
    fn demonstration(&mut self, file: &TaskFile, demo: usize) {
        let Some(record) = self.take(file.record(demo)) else { return };
        for (name, what) in file.contradictions(demo, &record) {
            self.add(&file.path, &format!("/data/demo_{demo}, attribute {name}"), what);
        }
        let steps = record.stats.steps as usize;
        self.steps += steps;
        let Some(names) = self.take(file.names(demo)) else { return };
        for spec in streams::all().iter().filter(|spec| spec.presence == Presence::Always) {
            if !names.iter().any(|name| spec.is_at(name)) && self.take(file.shape(demo, spec.path)).is_some()
            {
                self.problems.push(file.error(demo, spec.path, "its group does not list it").to_string());
            }
        }
        for name in &names {
            let Some(stream) = self.take(file.stream(demo, name)) else { continue };
            let rows = stream.values.len() / stream.row_shape.iter().product::<usize>().max(1);
            self.compare(&file.path, &format!("/data/demo_{demo}/{name}, steps"), &rows, &steps);
            if let Some(what) = streams::named(name).and_then(|spec| declaration_mismatch(&spec, &stream)) {
                self.problems.push(file.error(demo, name, what).to_string());
            }
            if lacks_digest(file, demo, name) {
                self.problems.push(file.error(demo, name, NO_DIGEST).to_string());
            }
        }
    }
}

#[cfg(test)]
mod tests;
