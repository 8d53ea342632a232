//! Consistency checks of a dataset: files, shapes, values, and relations between streams.

mod readings;

use std::{
    collections::{BTreeMap, BTreeSet},
    f64::consts::PI,
    path::{Component, Path, PathBuf},
};

use serde_json::{Value, json};

use super::{
    DatasetError, StreamValues, TaskFile,
    card::DatasetCard,
    demonstration::{CAMERA_POSES, JOINT_ACTIONS, JOINT_TORQUES, actions_stream_name},
    grip_labels::{self, OPEN_FORCE},
    layout::{CARD, DEPTH_STREAMS, IMAGE_STREAMS, MANIFEST, is_image_stream},
    manifest::{self, ManifestEntry},
};
use softvt_benchmark::{CONTROL_DT, CONTROL_HZ};
use softvt_common::{files::FileError, text::counted};
use softvt_geometry::{Quat, Vec3};
use softvt_media::video;
use softvt_policy::{Action, profile::GripCode};
use softvt_robot::{
    ik::ArmAngles,
    panda::{self, ARM_DOFS, JointRange},
    rotation,
};
use softvt_sensing::tactile::MARKER_COUNT;

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

/// Streams of every demonstration, with their shape per step.
const REQUIRED_STREAMS: [(&str, &[usize]); 15] = [
    ("actions", &[7]),
    ("actions_binary", &[7]),
    (JOINT_ACTIONS, &[ARM_DOFS]),
    ("rewards", &[]),
    ("dones", &[]),
    ("timestamps", &[]),
    ("obs/eef_pose", &[7]),
    ("obs/state", &[7]),
    ("obs/arm_joint_pos", &[7]),
    ("obs/gripper_pos", &[2]),
    ("obs/gripper_width", &[1]),
    ("obs/gripper_width_sensed", &[1]),
    ("obs/gripper_close_norm", &[1]),
    ("obs/gripper_closure", &[1]),
    ("obs/gripper_marker_motion", &[2, 2, MARKER_COUNT, 2]),
];
/// Tolerance of rotations, quaternion lengths and timestamps.
const TOLERANCE: f64 = 1e-6;
/// Excess over the limits of a joint up to which a commanded position is likely meant, rad.
const JOINT_MARGIN: f64 = 0.05;
/// Largest distance between the place of an action and that of its joint positions in half of the steps, m.
const MAX_JOINT_TARGET_ERROR_M: f64 = 0.02;
/// Distance in half of the steps up to which joint positions are not taken for those of another step, m.
const MIN_SHIFT_ERROR_M: f64 = 0.001;
/// Greatest depth that a camera can see, m: another one is in another unit.
const MAX_DEPTH_M: f32 = 100.0;

/// What is read for a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckScope {
    /// All files and streams.
    Whole,
    /// All but images, depth and videos, which are most of the bytes.
    Numbers,
}

/// Index of the first joint whose position is beyond its limits.
fn joint_beyond_limits(row: &[f64; ARM_DOFS]) -> Option<usize> {
    let is_beyond =
        |(q, range): (&f64, &JointRange)| *q < range.lower - JOINT_MARGIN || *q > range.upper + JOINT_MARGIN;
    row.iter().zip(&panda::joint_ranges()).position(is_beyond)
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
    let demo = entry.demo_id;
    let Some(steps) = report.take(file.steps(demo)) else { return };
    let key = format!("/data/demo_{demo}");
    if steps != entry.num_samples {
        let what = format!("{steps} steps, the manifest says {}", entry.num_samples);
        report.add(&file.path, &key, what);
    }
    let attributes = [
        ("task_suite", &entry.task_suite),
        ("language", &entry.language),
        ("asset_name", &entry.asset_name),
        ("state_hash", &entry.state_hash),
    ];
    for (name, expected) in attributes {
        if let Some(found) = report.take(file.text(demo, name))
            && found != *expected
        {
            let what = format!("{found:?}, the manifest says {expected:?}");
            report.add(&file.path, &format!("{key}, attribute {name}"), what);
        }
    }
    // The HDF5 library does not read numeric attributes of groups; the record has the same values.
    let Some(record) = report.take(file.record(demo)) else { return };
    let id = &record.header.id;
    for (name, found, listed) in [
        ("task", json!(id.task), json!(entry.task_id)),
        ("episode", json!(id.episode), json!(entry.episode)),
        ("safety", json!(record.verdict.safety), json!(entry.success)),
        ("d_peak", json!(record.d_peak()), json!(entry.d_peak)),
        ("seed", json!(id.base_seed), json!(entry.seed)),
        ("notes", json!(record.stats.notes), json!(entry.notes)),
        ("metrics", json!(record.stats.metrics), json!(entry.metrics)),
    ] {
        if found != listed {
            let what = format!("{name} is {found}, the manifest says {listed}");
            report.add(&file.path, &format!("{key}, attribute metadata_json"), what);
        }
    }
}

/// HDF5 files beside those that the manifest names.
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
        let mut has_required_shapes = true;
        for (name, row_shape) in REQUIRED_STREAMS {
            let shape = match name {
                // Says that recordings of earlier versions lack them.
                JOINT_ACTIONS => file.joint_commands(demo).map(|joints| vec![joints.len(), ARM_DOFS]),
                _ => file.shape(demo, name),
            };
            let shape = check.report.take(shape);
            if shape.as_ref().is_some_and(|shape| shape.get(1..) == Some(row_shape)) {
                continue;
            }
            has_required_shapes = false;
            if let Some(shape) = shape {
                let lengths = row_shape.iter().map(usize::to_string);
                let expected: Vec<String> = std::iter::once("steps".to_owned()).chain(lengths).collect();
                check.add(name, format!("expected the shape ({}), got {shape:?}", expected.join(", ")));
            }
        }
        let is_read = |name: &&String| scope == CheckScope::Whole || !is_image_stream(name);
        names.iter().filter(is_read).for_each(|name| check.check_stream(name));
        check.check_attributes();
        if has_required_shapes {
            check.check_relations();
        }
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

    /// Checks that the numeric attributes of the demonstration are those of its record.
    fn check_attributes(&mut self) {
        let Some(record) = self.report.take(self.file.record(self.demo)) else { return };
        let id = &record.header.id;
        for (name, expected) in [
            ("num_samples", self.steps as u64),
            ("task_id", id.task as u64),
            ("demo_id", self.demo as u64),
            ("attempt", u64::from(id.episode)),
            ("success", u64::from(record.verdict.safety)),
        ] {
            if self.file.contradicts(self.demo, name, expected) {
                let source = if name == "num_samples" { "the actions" } else { "its record and place" };
                let key = format!("/data/demo_{}, attribute {name}", self.demo);
                self.report.add(&self.file.path, &key, format!("expected {expected}, by {source}"));
            }
        }
    }

    /// Checks the length of a stream, and that its values are finite.
    fn check_stream(&mut self, name: &str) {
        let Some(stream) = self.report.take(self.file.stream(self.demo, name)) else { return };
        let width: usize = stream.row_shape.iter().product();
        let (count, steps) = (stream.values.len(), self.steps);
        if count != steps * width {
            self.add(name, format!("{} steps, the actions have {steps}", count / width.max(1)));
        }
        let is_depth = DEPTH_STREAMS.iter().any(|depth| name == format!("obs/{depth}"));
        let not_finite = match &stream.values {
            StreamValues::F64(values) => values.iter().position(|x| !x.is_finite()),
            // Depth is infinite in the background.
            StreamValues::F32(values) if is_depth => {
                let is_depth_m = |x: &f32| *x > 0.0 && (*x <= MAX_DEPTH_M || x.is_infinite());
                values.iter().position(|x| !is_depth_m(x))
            }
            StreamValues::F32(values) => values.iter().position(|x| !x.is_finite()),
            StreamValues::U8(_) => None,
        };
        if let Some(at) = not_finite {
            let step = at / width.max(1);
            let what = match is_depth {
                true => format!(
                    "step {step}: a depth that is neither infinite nor above 0 and up to {MAX_DEPTH_M} m"
                ),
                false => format!("step {step}: a number that is not finite"),
            };
            self.add(name, what);
        }
        if is_depth && (stream.row_shape.len() != 2 || !matches!(stream.values, StreamValues::F32(_))) {
            let got = &stream.row_shape;
            self.add(name, format!("expected float32 of shape (steps, height, width), got {got:?} per step"));
        }
        let is_image = IMAGE_STREAMS.iter().any(|image| name == format!("obs/{image}"));
        if is_image {
            if !matches!(stream.row_shape[..], [_, _, 3]) {
                let got = &stream.row_shape;
                self.add(name, format!("expected the shape (steps, height, width, 3), got {got:?} per step"));
            }
            self.check_pictures(name, &stream.values, width);
        }
        let is_pose = name.ends_with("/root_pose_w") || CAMERA_POSES.contains(&name);
        if is_pose && width == 7 {
            match &stream.values {
                StreamValues::F64(poses) => self.check_quaternions(name, poses),
                _ => self.add(name, "expected float64"),
            }
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

    /// Checks that commanded joint positions are within the limits of the joints, and lead to the pose of the action
    /// where they are the action.
    fn check_joint_actions(&mut self) {
        let Some(joints) = self.report.take(self.file.joint_commands(self.demo)) else { return };
        let beyond =
            joints.iter().enumerate().find_map(|(step, row)| Some((step, joint_beyond_limits(row)?)));
        if let Some((step, joint)) = beyond {
            let q = joints[step][joint];
            let what = format!("step {step}: joint {} at {q} rad is outside of its limits", joint + 1);
            return self.add(JOINT_ACTIONS, what);
        }
        let Some(actions) = self.report.take(self.file.actions(self.demo)) else { return };
        let mut differs = actions.iter().map(|action| {
            let reached = action.joints.map(|joints| panda::tool_pose(&joints).translation.vector);
            reached.is_some_and(|reached| (reached - action.position_b).norm() > TOLERANCE)
        });
        if let Some(step) = differs.position(|differs| differs) {
            self.add(
                JOINT_ACTIONS,
                format!("step {step}: not the joint positions at the pose of the action"),
            );
        }
        self.check_joint_targets(&joints, &actions);
    }

    /// Checks that commanded joint positions lead near the commanded poses. They are one step of inverse kinematics,
    /// which differs by millimetres in motions of 20 mm per control step, by the square of that in faster ones, and by
    /// more where a pose is out of reach.
    fn check_joint_targets(&mut self, joints: &[ArmAngles], actions: &[Action]) {
        let Some(record) = self.report.take(self.file.record(self.demo)) else { return };
        if record.stats.far_commands > 0 {
            return;
        }
        let reached: Vec<Vec3> = joints.iter().map(|row| panda::tool_pose(row).translation.vector).collect();
        let typical_error = |first: usize, first_action: usize| {
            let pairs = reached.iter().skip(first).zip(actions.iter().skip(first_action));
            let mut errors: Vec<f64> =
                pairs.map(|(place, action)| (place - action.position_b).norm()).collect();
            errors.sort_by(f64::total_cmp);
            errors.get(errors.len() / 2).copied().unwrap_or(0.0)
        };
        let own = typical_error(0, 0);
        if own > MAX_JOINT_TARGET_ERROR_M {
            let what = format!("{:.1} mm from the poses of the actions in half of the steps", 1e3 * own);
            return self.add(JOINT_ACTIONS, what);
        }
        let neighbour = typical_error(1, 0).min(typical_error(0, 1));
        if own > MIN_SHIFT_ERROR_M && neighbour < 0.25 * own {
            self.add(JOINT_ACTIONS, "they are one control step earlier or later than the actions");
        }
    }

    /// Checks that the arm's drives hold it: they are never without torque after the first action.
    fn check_joint_torques(&mut self) {
        if !self.file.has(self.demo, JOINT_TORQUES) {
            return;
        }
        let Some(torques) = self.report.take(self.file.array(self.demo, JOINT_TORQUES)) else { return };
        let mut rows = torques.values.chunks_exact(ARM_DOFS).skip(1);
        if let Some(after_first) = rows.position(|row| row.iter().all(|torque| *torque == 0.0)) {
            let what = format!("step {}: no torque, which lets the arm fall", after_first + 1);
            self.add(JOINT_TORQUES, what);
        }
    }

    /// Checks the actions in a grip code against the closures.
    fn check_grip_labels(&mut self, code: GripCode, actions: &[f64], binary: &[f64]) {
        let name = actions_stream_name(code);
        let Some(labels) = self.report.take(self.file.array(self.demo, name)) else { return };
        let labels = labels.values;
        if labels.len() != actions.len() {
            return self.add(name, format!("{} numbers, expected {}", labels.len(), actions.len()));
        }
        let rows = labels.chunks_exact(7).zip(actions.chunks_exact(7)).zip(binary.chunks_exact(7));
        let is_label = |label: f64, is_closed: bool| match code {
            GripCode::Force if is_closed => label >= 0.0 && label.is_finite(),
            GripCode::Force => label == OPEN_FORCE,
            _ => (0.0..=1.0).contains(&label) && (is_closed || label == 0.0),
        };
        let is_closed: Vec<bool> = binary.as_chunks::<7>().0.iter().map(|row| row[6] > 0.5).collect();
        let closures: Vec<f64> = actions.as_chunks::<7>().0.iter().map(|row| row[6]).collect();
        let is_other_width = |(label, expected): (&[f64; 7], f64)| (label[6] - expected).abs() > TOLERANCE;
        let mut widths = labels.as_chunks::<7>().0.iter().zip(grip_labels::two_widths(&closures, &is_closed));
        let mut bad =
            rows.map(|((row, action), binary)| row[..6] != action[..6] || !is_label(row[6], binary[6] > 0.5));
        if let Some(step) = bad.position(|is_bad| is_bad) {
            self.add(name, format!("step {step}: not the actions in the grip code {}", code.name()));
        } else if code == GripCode::TwoWidth
            && let Some(step) = widths.position(is_other_width)
        {
            let what = "not 0 while open, and the median commanded closure while closed";
            self.add(name, format!("step {step}: {what}"));
        }
    }

    /// Checks relations between streams.
    fn check_relations(&mut self) {
        let (file, demo) = (self.file, self.demo);
        let mut get =
            |name: &str| self.report.take(file.array(demo, name)).map_or(Vec::new(), |array| array.values);
        let (poses, states, times) = (get("obs/eef_pose"), get("obs/state"), get("timestamps"));
        let (actions, binary) = (get("actions"), get("actions_binary"));
        self.check_quaternions("obs/eef_pose", &poses);
        let differs = poses.chunks_exact(7).zip(states.chunks_exact(7)).position(|(pose, state)| {
            let q = Quat::new_unchecked(nalgebra::Quaternion::new(pose[3], pose[4], pose[5], pose[6]));
            let other = rotation::from_axis_angle(&Vec3::new(state[3], state[4], state[5]));
            (q.coords - other.coords).norm().min((q.coords + other.coords).norm()) > TOLERANCE
        });
        if let Some(step) = differs {
            let what = format!(
                "step {step}: the quaternion is not the rotation of obs/state: is its order w x y z?"
            );
            self.add("obs/eef_pose", what);
        }
        let same_place = |(pose, state): (&[f64], &[f64])| {
            (0..3).all(|axis| (pose[axis] - state[axis]).abs() <= TOLERANCE)
        };
        let mut places = poses.chunks_exact(7).zip(states.chunks_exact(7));
        if let Some(step) = places.position(|pair| !same_place(pair)) {
            self.add("obs/state", format!("step {step}: not the position of obs/eef_pose: is it in m?"));
        }
        let expected = |step: usize| step as f64 * CONTROL_DT;
        let is_late = |(step, t): (usize, &f64)| (t - expected(step)).abs() > TOLERANCE;
        if let Some(step) = times.iter().enumerate().position(is_late) {
            let (time, expected) = (times[step], expected(step));
            self.add("timestamps", format!("step {step}: {time} s, expected {expected} at {CONTROL_HZ} Hz"));
        }
        self.check_rotation_vectors("obs/state", &states);
        self.check_rotation_vectors("actions", &actions);
        let is_binary_of = |(a, b): (&[f64], &[f64])| a[..6] == b[..6] && [0.0, 1.0].contains(&b[6]);
        let mut both = actions.chunks_exact(7).zip(binary.chunks_exact(7));
        if let Some(step) = both.position(|pair| !is_binary_of(pair)) {
            self.add("actions_binary", format!("step {step}: not the actions with a gripper of 0 or 1"));
        }
        self.check_readings();
        self.check_joint_actions();
        self.check_joint_torques();
        for code in [GripCode::TwoWidth, GripCode::Force] {
            self.check_grip_labels(code, &actions, &binary);
        }
    }
}

#[cfg(test)]
mod tests;
