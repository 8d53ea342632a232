//! What can be wrong with a data set.

use std::{collections::BTreeMap, path::Path};

use super::{
    DatasetError, StreamValues, TaskFile,
    card::Card,
    demonstration_writer::frame_rate,
    layout::IMAGE_STREAMS,
    manifest::{self, ManifestEntry},
    video,
};
use crate::{
    benchmark::control::CONTROL_DT,
    geometry::{Quat, Vec3},
    robot::rotation,
    sensing::tactile::MARKERS,
};

/// What was looked at, and what is wrong with it.
#[derive(Debug, Default)]
pub struct Findings {
    /// Demonstrations looked at.
    pub demos: usize,
    /// Control steps in them.
    pub steps: usize,
    /// Videos looked at.
    pub videos: usize,
    /// What is wrong, each with its file and key.
    pub wrong: Vec<String>,
}

/// What every demonstration has, with the shape of a step.
const REQUIRED: [(&str, &[usize]); 13] = [
    ("actions", &[7]),
    ("actions_binary", &[7]),
    ("rewards", &[]),
    ("dones", &[]),
    ("timestamps", &[]),
    ("obs/eef_pose", &[7]),
    ("obs/state", &[7]),
    ("obs/arm_joint_pos", &[7]),
    ("obs/gripper_pos", &[2]),
    ("obs/gripper_width", &[1]),
    ("obs/gripper_close_norm", &[1]),
    ("obs/gripper_closure", &[1]),
    ("obs/gripper_marker_motion", &[2, 2, MARKERS, 2]),
];
/// How far two codes of one rotation may differ, and a quaternion's length from 1.
const SAME: f64 = 1e-6;

impl Findings {
    fn note(&mut self, error: &DatasetError) {
        self.wrong.push(error.to_string());
    }

    fn say(&mut self, path: &Path, key: &str, what: String) {
        self.note(&DatasetError::content(path, key, what));
    }

    /// What a step gives; an error is noted.
    fn take<T>(&mut self, result: Result<T, DatasetError>) -> Option<T> {
        result.map_err(|error| self.note(&error)).ok()
    }
}

/// Looks through a folder that `softvt record` finished.
///
/// # Errors
/// It has no card or no manifest: nothing can be said of it then.
pub fn folder(root: &Path) -> Result<Findings, DatasetError> {
    let (card, entries) = (Card::read(root)?, manifest::read(root)?);
    let mut findings = Findings::default();
    let mut files: BTreeMap<&str, Vec<&ManifestEntry>> = BTreeMap::new();
    for entry in &entries {
        files.entry(&entry.hdf5_path).or_default().push(entry);
        films(&mut findings, root, entry);
    }
    for task in &card.tasks {
        let of_task = |e: &&ManifestEntry| e.task_id == task.task && e.suite == task.suite;
        let listed = entries.iter().filter(of_task).count();
        if listed != task.demos {
            let what = format!(
                "{listed} lines of {} task {}, dataset.json says {}",
                task.suite, task.task, task.demos
            );
            findings.say(&root.join(super::layout::MANIFEST), "lines", what);
        }
    }
    for (path, entries) in files {
        let path = root.join(path);
        let opened = TaskFile::open(&path);
        let Some(file) = findings.take(opened) else { continue };
        if file.demos().len() != entries.len() {
            let what = format!("{} demonstrations, the manifest has {}", file.demos().len(), entries.len());
            findings.say(&path, "/data", what);
        }
        for entry in entries {
            let steps = file.steps(entry.demo_id);
            if let Some(steps) = findings.take(steps)
                && steps != entry.num_samples
            {
                let what = format!("{steps} steps, the manifest says {}", entry.num_samples);
                findings.say(&path, &format!("/data/demo_{}", entry.demo_id), what);
            }
        }
        contents(&mut findings, &file);
    }
    Ok(findings)
}

/// Looks through one file.
///
/// # Errors
/// It cannot be opened.
pub fn file(path: &Path) -> Result<Findings, DatasetError> {
    let file = TaskFile::open(path)?;
    let mut findings = Findings::default();
    if file.environment().is_ok_and(|environment| environment["env_name"] != "softvt") {
        let what = "softvt did not record it; softvt dataset import re-executes what others have recorded";
        findings.say(path, "/data, attribute env_args", what.to_owned());
        return Ok(findings);
    }
    contents(&mut findings, &file);
    Ok(findings)
}

/// Videos of a demonstration: as many pictures as steps, at the rate of control.
fn films(findings: &mut Findings, root: &Path, entry: &ManifestEntry) {
    for (stream, file) in &entry.video_files {
        let path = root.join(file);
        let length =
            std::fs::read(&path).map_err(DatasetError::io("read", &path)).map(|bytes| video::length(&bytes));
        let Some(length) = findings.take(length) else { continue };
        findings.videos += 1;
        match length {
            None => findings.say(&path, stream, "no MP4 file, or cut off".to_owned()),
            Some((frames, hertz)) => {
                if frames != entry.num_samples {
                    let what =
                        format!("{frames} pictures, the demonstration has {} steps", entry.num_samples);
                    findings.say(&path, stream, what);
                }
                if (hertz - f64::from(frame_rate())).abs() > 1e-9 {
                    findings.say(
                        &path,
                        stream,
                        format!("{hertz} pictures a second, expected {}", frame_rate()),
                    );
                }
            }
        }
    }
}

fn contents(findings: &mut Findings, file: &TaskFile) {
    let environment = file.environment();
    findings.take(environment);
    for &demo in file.demos() {
        findings.demos += 1;
        let (names, steps) = (file.names(demo), file.steps(demo));
        let (Some(names), Some(steps)) = (findings.take(names), findings.take(steps)) else { continue };
        findings.steps += steps;
        let mut whole = true;
        for (name, row) in REQUIRED {
            let shape = file.shape(demo, name);
            let Some(shape) = findings.take(shape) else {
                whole = false;
                continue;
            };
            if shape.get(1..) != Some(row) {
                whole = false;
                let expected: Vec<String> =
                    std::iter::once("steps".to_owned()).chain(row.iter().map(usize::to_string)).collect();
                let what = format!("expected the shape ({}), got {shape:?}", expected.join(", "));
                findings.say(file.path(), &format!("/data/demo_{demo}/{name}"), what);
            }
        }
        for name in &names {
            stream(findings, file, (demo, steps), name);
        }
        if whole {
            consistent(findings, file, demo);
        }
    }
}

/// One stream: its length, and that its numbers are some.
fn stream(findings: &mut Findings, file: &TaskFile, (demo, steps): (usize, usize), name: &str) {
    let key = format!("/data/demo_{demo}/{name}");
    let read = file.stream(demo, name);
    let Some(stream) = findings.take(read) else { return };
    let width: usize = stream.row_shape.iter().product();
    let count = match &stream.values {
        StreamValues::F64(numbers) => numbers.len(),
        StreamValues::F32(numbers) => numbers.len(),
        StreamValues::U8(numbers) => numbers.len(),
    };
    if count != steps * width {
        findings.say(file.path(), &key, format!("{} steps, the actions have {steps}", count / width.max(1)));
    }
    let bad = match &stream.values {
        StreamValues::F64(numbers) => numbers.iter().position(|x| !x.is_finite()),
        StreamValues::F32(numbers) => numbers.iter().position(|x| !x.is_finite()),
        StreamValues::U8(_) => None,
    };
    if let Some(at) = bad {
        findings.say(file.path(), &key, format!("step {}: a number that is not finite", at / width.max(1)));
    }
    if IMAGE_STREAMS.iter().any(|picture| name == format!("obs/{picture}"))
        && !matches!(stream.row_shape[..], [_, _, 3])
    {
        let what = format!("expected the shape (steps, height, width, 3), got {:?} a step", stream.row_shape);
        findings.say(file.path(), &key, what);
    }
    if name.ends_with("/root_pose_w") && width == 7 {
        quaternions(findings, file, &key, &stream.values);
    }
}

/// Quaternions of poses must be of length 1 and have w ≥ 0.
fn quaternions(findings: &mut Findings, file: &TaskFile, key: &str, numbers: &StreamValues) {
    let StreamValues::F64(numbers) = numbers else {
        return findings.say(file.path(), key, "expected float64".to_owned());
    };
    let bad = numbers.chunks_exact(7).position(|row| {
        let length = row[3..].iter().map(|x| x * x).sum::<f64>().sqrt();
        (length - 1.0).abs() > SAME || row[3] < 0.0
    });
    if let Some(step) = bad {
        let what = format!(
            "step {step}: no quaternion w x y z of length 1 with w >= 0: {:?}",
            &numbers[7 * step + 3..7 * step + 7]
        );
        findings.say(file.path(), key, what);
    }
}

/// What streams say of each other.
fn consistent(findings: &mut Findings, file: &TaskFile, demo: usize) {
    let mut get = |name: &str| {
        let read = file.doubles(demo, name);
        findings.take(read).map_or(Vec::new(), |(numbers, _)| numbers)
    };
    let (poses, states, times) = (get("obs/eef_pose"), get("obs/state"), get("timestamps"));
    let (actions, binary) = (get("actions"), get("actions_binary"));
    let key = |name: &str| format!("/data/demo_{demo}/{name}");
    quaternions(findings, file, &key("obs/eef_pose"), &StreamValues::F64(poses.clone()));
    let turned = poses.chunks_exact(7).zip(states.chunks_exact(7)).position(|(pose, state)| {
        let q = Quat::new_unchecked(nalgebra::Quaternion::new(pose[3], pose[4], pose[5], pose[6]));
        let other = rotation::from_axis_angle(&Vec3::new(state[3], state[4], state[5]));
        (q.coords - other.coords).norm().min((q.coords + other.coords).norm()) > SAME
    });
    if let Some(step) = turned {
        let what =
            format!("step {step}: the quaternion is not the rotation of obs/state: is its order w x y z?");
        findings.say(file.path(), &key("obs/eef_pose"), what);
    }
    let late = times.iter().enumerate().position(|(step, t)| (t - step as f64 * CONTROL_DT).abs() > SAME);
    if let Some(step) = late {
        let what = format!(
            "step {step}: {} s, expected {} at {} Hz",
            times[step],
            step as f64 * CONTROL_DT,
            frame_rate()
        );
        findings.say(file.path(), &key("timestamps"), what);
    }
    let both = actions.chunks_exact(7).zip(binary.chunks_exact(7));
    if let Some(step) = both.clone().position(|(a, b)| a[..6] != b[..6] || ![0.0, 1.0].contains(&b[6])) {
        let what = format!("step {step}: not the actions with a gripper of 0 or 1");
        findings.say(file.path(), &key("actions_binary"), what);
    }
}

#[cfg(test)]
mod tests;
