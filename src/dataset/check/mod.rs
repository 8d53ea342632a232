//! Checks of a dataset: that its files belong together, and that streams are as they were recorded, or at least as they
//! are declared.
//!
//! The digest of a stream shows every change after the recording. Streams without one, of earlier versions or written
//! by other programs, are checked for type, shape and range. What a digest cannot show, that the numbers follow from
//! the commands, a re-simulation does.

use std::{
    collections::{BTreeMap, BTreeSet},
    f64::consts::PI,
    path::{Component, Path, PathBuf},
};

use serde_json::{Value, json};

use super::{
    DataStream, DatasetError, TaskFile,
    card::DatasetCard,
    layout::{CARD, MANIFEST, TaskPaths},
    manifest::{self, ManifestEntry},
    streams::{self, Presence, StreamSpec},
};
use softvt_benchmark::CONTROL_HZ;
use softvt_common::{files::FileError, text::counted};
use softvt_geometry::{Quat, Vec3};
use softvt_media::video;
use softvt_robot::rotation;

/// Result of a check.
#[derive(Debug, Default)]
pub struct CheckReport {
    /// Demonstrations checked.
    pub demos: usize,
    /// Control steps in them.
    pub steps: usize,
    /// Videos checked.
    pub videos: usize,
    /// One message per problem, with file and key.
    pub problems: Vec<String>,
}

/// Tolerance of rotations and of the lengths of quaternions.
const TOLERANCE: f64 = 1e-6;

/// Extent of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckScope {
    /// All files and streams.
    Whole,
    /// All but images, depth and videos, which are most of the bytes.
    Numbers,
}

impl CheckReport {
    fn add(&mut self, path: &Path, key: &str, what: impl Into<String>) {
        self.problems.push(DatasetError::content(path, key, what).to_string());
    }

    /// The value of `result`; an error is added to the problems.
    fn take<T, E: ToString>(&mut self, result: Result<T, E>) -> Option<T> {
        result.map_err(|error| self.problems.push(error.to_string())).ok()
    }
}

/// Checks the folder of a finished `softvt record`.
///
/// # Errors
/// `dataset.json` or the manifest is missing or unreadable.
pub fn folder(root: &Path, scope: CheckScope) -> Result<CheckReport, DatasetError> {
    // The manifest says of other folders what they are.
    let (entries, card) = (manifest::read(root)?, DatasetCard::read(root)?);
    let mut report = CheckReport::default();
    if card.fps != CONTROL_HZ {
        let what = format!("fps is {}, and softvt records {CONTROL_HZ} control steps per second", card.fps);
        report.add(&root.join(CARD), "fps", what);
    }
    let mut files: BTreeMap<&str, Vec<&ManifestEntry>> = BTreeMap::new();
    for entry in &entries {
        files.entry(&entry.hdf5_path).or_default().push(entry);
        if scope == CheckScope::Whole {
            check_videos(&mut report, root, entry);
        }
    }
    report.take(card.check_entries(root, &entries));
    for task in &card.tasks {
        let of_task = |e: &&ManifestEntry| e.task_id == task.task && e.suite == task.suite;
        let listed: Vec<&ManifestEntry> = entries.iter().filter(of_task).collect();
        let samples: usize = listed.iter().map(|entry| entry.num_samples).sum();
        for (name, listed, stated) in
            [("lines", listed.len(), task.demos), ("num_samples", samples, task.samples)]
        {
            if listed != stated {
                let what = format!(
                    "{listed} in all of {} task {}, dataset.json says {stated}",
                    task.suite, task.task
                );
                report.add(&root.join(MANIFEST), name, what);
            }
        }
    }
    for path in stray_files(root, &files) {
        report.add(&path, "/data", "the manifest has no line of this file; remove it");
    }
    for (path, entries) in files {
        let path = root.join(path);
        let Some(file) = report.take(TaskFile::open(&path)) else { continue };
        if file.demos.len() != entries.len() {
            let what = format!("{} demonstrations, the manifest has {}", file.demos.len(), entries.len());
            report.add(&path, "/data", what);
        }
        for entry in entries {
            check_entry(&mut report, &file, entry);
        }
        check_demonstrations(&mut report, &file, scope);
    }
    Ok(report)
}

/// Checks that a demonstration is the one that its line of the manifest describes.
fn check_entry(report: &mut CheckReport, file: &TaskFile, entry: &ManifestEntry) {
    let Some(record) = report.take(file.record(entry.demo_id)) else { return };
    let paths = TaskPaths { root: PathBuf::new(), suite: String::new(), task: entry.task_id };
    let (hdf5_path, video_files) = (entry.hdf5_path.clone(), entry.video_files.clone());
    let own = ManifestEntry::new(&paths, entry.demo_id, &record);
    let (own, listed) = (json!(ManifestEntry { hdf5_path, video_files, ..own }), json!(entry));
    for (name, listed) in
        listed.as_object().into_iter().flatten().filter(|(name, listed)| own[*name] != **listed)
    {
        let what = format!("{name} is {}, the manifest says {listed}", own[name]);
        report.add(&file.path, &format!("/data/demo_{}, attribute metadata_json", entry.demo_id), what);
    }
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

/// Checks one HDF5 file.
///
/// # Errors
/// The file cannot be opened.
pub fn file(path: &Path) -> Result<CheckReport, DatasetError> {
    let file = TaskFile::open(path)?;
    let mut report = CheckReport::default();
    let has_record = file.demos.first().is_some_and(|demo| file.text(*demo, "metadata_json").is_ok());
    if !has_record && file.environment().is_ok_and(|environment| environment["env_name"] != "softvt") {
        let error = DatasetError::not_recorded_by_softvt(path, "/data, attribute env_args");
        report.problems.push(error.to_string());
        return Ok(report);
    }
    check_demonstrations(&mut report, &file, CheckScope::Whole);
    Ok(report)
}

/// Checks that the videos of a demonstration have one frame per step, at the control rate.
fn check_videos(report: &mut CheckReport, root: &Path, entry: &ManifestEntry) {
    for (stream, file) in &entry.video_files {
        let path = root.join(file);
        let bytes = std::fs::read(&path).map_err(FileError::io("read", &path));
        let Some(bytes) = report.take(bytes) else { continue };
        report.videos += 1;
        let Some(video) = video::VideoInfo::read(&bytes) else {
            report.add(&path, stream, "not an MP4 file, or truncated");
            continue;
        };
        if video.frames != entry.num_samples {
            let what = format!("{} frames, the demonstration has {} steps", video.frames, entry.num_samples);
            report.add(&path, stream, what);
        }
        if (video.frame_rate - f64::from(CONTROL_HZ)).abs() > 1e-9 {
            let what = format!("{} frames per second, expected {}", video.frame_rate, CONTROL_HZ);
            report.add(&path, stream, what);
        }
    }
}

fn check_demonstrations(report: &mut CheckReport, file: &TaskFile, scope: CheckScope) {
    if let Some(environment) = report.take(file.environment()) {
        check_script(report, file, &environment);
    }
    if !file.has_count("fps", CONTROL_HZ as usize) {
        let what = format!("expected {CONTROL_HZ} control steps per second");
        report.add(&file.path, "/data, attribute fps", what);
    }
    let steps_before = report.steps;
    for &demo in &file.demos {
        report.demos += 1;
        let (names, steps) = (file.names(demo), file.steps(demo));
        let (Some(names), Some(steps)) = (report.take(names), report.take(steps)) else { continue };
        report.steps += steps;
        let mut check = DemoCheck { report, file, demo, steps };
        for spec in streams::all().iter().filter(|spec| spec.presence == Presence::Always) {
            if !names.iter().any(|name| spec.is_at(name)) {
                // Links are not listed.
                check.report.take(file.shape(demo, spec.path));
            }
        }
        for name in &names {
            let spec = streams::named(name);
            if scope == CheckScope::Whole || !spec.as_ref().is_some_and(StreamSpec::is_rendered) {
                check.check_stream(name, spec.as_ref());
            }
        }
        check.check_attributes();
        check.check_rotations();
    }
    let (steps, demos) = (report.steps - steps_before, file.demos.len());
    for (name, count, unit) in [("total", steps, "step"), ("num_demos", demos, "demonstration")] {
        if !file.has_count(name, count) {
            let what = format!("another number than the {} of the file", counted(count, unit));
            report.add(&file.path, &format!("/data, attribute {name}"), what);
        }
    }
}

/// Checks the environment, and the path of the script that a replay of the file runs.
fn check_script(report: &mut CheckReport, file: &TaskFile, environment: &Value) {
    if environment["env_name"] != "softvt" {
        let what = format!("env_name is {}, and softvt records \"softvt\"", environment["env_name"]);
        report.add(&file.path, "/data, attribute env_args", what);
    }
    let script = environment["env_kwargs"]["script"].as_str().unwrap_or_default();
    let key = "/data, attribute env_args, script";
    if !is_script_path(script) {
        let what = format!("{script:?} leads out of the folder; expected a path without \"..\"");
        report.add(&file.path, key, what);
    }
}

/// True for a path that does not leave its folder through `..`: a recording can name a script by it.
pub fn is_script_path(script: &str) -> bool {
    Path::new(script).components().all(|part| part != Component::ParentDir)
}

/// A demonstration that is being checked.
struct DemoCheck<'a> {
    report: &'a mut CheckReport,
    file: &'a TaskFile,
    demo: usize,
    steps: usize,
}

impl DemoCheck<'_> {
    fn add(&mut self, name: &str, what: impl Into<String>) {
        self.report.problems.push(self.file.error(self.demo, name, what).to_string());
    }

    /// Checks the attributes and the length of the demonstration against its record.
    fn check_attributes(&mut self) {
        let (file, demo) = (self.file, self.demo);
        let Some(record) = self.report.take(file.record(demo)) else { return };
        for (name, what) in file.contradictions(demo, &record) {
            self.report.add(&file.path, &format!("/data/demo_{demo}, attribute {name}"), what);
        }
        if record.stats.steps as usize != self.steps {
            self.add("actions", format!("{} steps, metadata_json says {}", self.steps, record.stats.steps));
        }
    }

    /// Checks length, type, shape and range of a stream. Reading it verifies its digest.
    fn check_stream(&mut self, name: &str, spec: Option<&StreamSpec>) {
        let Some(stream) = self.report.take(self.file.stream(self.demo, name)) else { return };
        let width: usize = stream.row_shape.iter().product();
        let (count, steps) = (stream.values.len(), self.steps);
        if count != steps * width {
            self.add(name, format!("{} steps, the actions have {steps}", count / width.max(1)));
        }
        if let Some(expected) = spec.and_then(|spec| declaration_mismatch(spec, &stream)) {
            return self.add(name, expected);
        }
        let is_possible = |x: f64| match spec {
            // Depth is infinite in the background.
            Some(spec) if spec.is_depth() => x > 0.0 && (x <= spec.bound || x.is_infinite()),
            Some(spec) => x.is_finite() && x.abs() <= spec.bound,
            None => x.is_finite(),
        };
        let has_quaternion = name.ends_with("_pose") || name.ends_with("/root_pose_w");
        let numbers = stream.values.into_f64();
        if let Some(at) = numbers.iter().position(|x| !is_possible(*x)) {
            let (step, x) = (at / width.max(1), numbers[at]);
            let bound = spec.map_or(f64::INFINITY, |spec| spec.bound);
            let what = match x.is_finite() {
                true => {
                    format!("step {step}: {x}; expected at most {bound} in magnitude: is it in another unit?")
                }
                false => format!("step {step}: {x} is not a finite number"),
            };
            self.add(name, what);
        } else if has_quaternion && width == 7 {
            self.check_quaternions(name, &numbers);
        }
    }

    /// Checks that the quaternions of poses have length 1 and w ≥ 0.
    fn check_quaternions(&mut self, name: &str, poses: &[f64]) {
        let bad = poses.chunks_exact(7).position(|row| {
            let length = row[3..].iter().map(|x| x * x).sum::<f64>().sqrt();
            (length - 1.0).abs() > TOLERANCE || row[3] < 0.0
        });
        if let Some(step) = bad {
            let q = &poses[7 * step + 3..7 * step + 7];
            self.add(name, format!("step {step}: not a unit quaternion w x y z with w >= 0: {q:?}"));
        }
    }

    /// Checks the rotation vectors of actions and states, and that the quaternions of the tool are the same rotations.
    fn check_rotations(&mut self) {
        let rows = |name: &str| match self.file.array(self.demo, name) {
            Ok(array) if array.width() == 7 => array.values,
            _ => Vec::new(),
        };
        let (actions, states, poses) = (rows("actions"), rows("obs/state"), rows("obs/eef_pose"));
        self.check_rotation_vectors("obs/state", &states);
        self.check_rotation_vectors("actions", &actions);
        let differs = poses.chunks_exact(7).zip(states.chunks_exact(7)).position(|(pose, state)| {
            let q = Quat::new_unchecked(nalgebra::Quaternion::new(pose[3], pose[4], pose[5], pose[6]));
            let other = rotation::from_axis_angle(&Vec3::from_column_slice(&state[3..6]));
            (q.coords - other.coords).norm().min((q.coords + other.coords).norm()) > TOLERANCE
        });
        if let Some(step) = differs {
            let what = "the quaternion is not the rotation of obs/state: is its order w x y z?";
            self.add("obs/eef_pose", format!("step {step}: {what}"));
        }
    }

    /// Counts the jumps of the rotation vectors of poses by a full turn about their axis, as recordings of earlier
    /// versions have them: at half a turn, and from one demonstration to another.
    fn check_rotation_vectors(&mut self, name: &str, rows: &[f64]) {
        let vectors: Vec<Vec3> =
            rows.chunks_exact(7).map(|row| Vec3::from_column_slice(&row[3..6])).collect();
        let continuous = rotation::continuous(vectors.iter().copied());
        let turned = vectors.iter().zip(continuous).map(|(vector, near)| (vector - near).norm() > PI);
        let (jumps, _) =
            turned.fold((0, false), |(jumps, before), now| (jumps + usize::from(now != before), now));
        if jumps > 0 {
            let what = format!(
                "{} of the rotation vector by a full turn, to another vector of nearly the same rotation: a policy cannot learn \
                 them; record again with this version, or import the file, which writes continuous vectors",
                counted(jumps, "jump")
            );
            self.add(name, what);
        }
    }
}

/// Type and shape that a stream should have, if it has others.
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

#[cfg(test)]
mod tests;
