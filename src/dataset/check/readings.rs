//! Checks of readings: units, what one stream says of another, and readings that say nothing.

use super::{DemoCheck, TOLERANCE, joint_beyond_limits};
use crate::{StreamValues, demonstration::CAMERA_POSES, layout::IMAGE_STREAMS};
use softvt_geometry::{Pose, Quat, Vec3};
use softvt_robot::{
    gripper::MAX_WIDTH,
    panda::{self, ARM_DOFS},
    tactile::IMAGE_SIZE,
};
use softvt_sensing::tactile::MARKER_COUNT;

/// Excess over the stroke of a finger that contact and inertia explain, m.
const STROKE_MARGIN: f64 = 1e-3;
/// Largest difference between the width and that of the sensor of a real hand, m.
const SENSOR_ERROR: f64 = 2e-3;
/// Largest distance of an object from the origin, m: another one is in another unit.
const MAX_DISTANCE_M: f64 = 20.0;

/// Distance of markers from the picture that shear explains, as a share of its edge.
const MARKER_MARGIN: f64 = 0.1;

/// Share of the peak of D that some control step before the last has at least.
const MIN_SHARE_OF_PEAK: f64 = 0.5;

/// The pose of a row: position, and quaternion w x y z.
fn pose(row: &[f64; 7]) -> Pose {
    let [x, y, z, w, i, j, k] = *row;
    Pose::from_parts(Vec3::new(x, y, z).into(), Quat::new_unchecked(nalgebra::Quaternion::new(w, i, j, k)))
}

/// Index of the first pose that differs from the one at the start.
fn first_moved(poses: &[Pose]) -> Option<usize> {
    let first = poses.first()?;
    poses.iter().position(|pose| {
        let turn = (pose.rotation.coords - first.rotation.coords).norm();
        let opposite = (pose.rotation.coords + first.rotation.coords).norm();
        (pose.translation.vector - first.translation.vector).norm() > TOLERANCE
            || turn.min(opposite) > TOLERANCE
    })
}

impl DemoCheck<'_> {
    /// The numbers of a stream; none if it is missing, which is a problem only of required streams.
    fn values(&mut self, name: &str) -> Vec<f64> {
        if !self.file.has(self.demo, name) {
            return Vec::new();
        }
        match self.report.take(self.file.stream(self.demo, name)).map(|stream| stream.values) {
            Some(StreamValues::F64(values)) => values,
            Some(StreamValues::F32(values)) => values.into_iter().map(f64::from).collect(),
            Some(StreamValues::U8(values)) => values.into_iter().map(f64::from).collect(),
            None => Vec::new(),
        }
    }

    /// Adds a problem at the first of `rows` for which `is_wrong` holds.
    fn add_first<T>(
        &mut self,
        name: &str,
        rows: impl IntoIterator<Item = T>,
        is_wrong: impl Fn(&T) -> bool,
        what: &str,
    ) {
        if let Some(step) = rows.into_iter().position(|row| is_wrong(&row)) {
            self.add(name, format!("step {step}: {what}"));
        }
    }

    pub(super) fn check_readings(&mut self) {
        self.check_arm();
        self.check_gripper();
        self.check_ends();
        self.check_markers();
        self.check_cameras();
        self.check_forces();
        self.check_shapes();
    }

    /// Checks that measured joint positions are within the limits of the joints and put the tool where it is.
    fn check_arm(&mut self) {
        let (joints, poses) = (self.values("obs/arm_joint_pos"), self.values("obs/eef_pose"));
        let rows = || joints.as_chunks::<ARM_DOFS>().0.iter();
        if rows().any(|row| joint_beyond_limits(row).is_some()) {
            let what = "beyond the limits of the joints: are they in rad?";
            return self.add_first(
                "obs/arm_joint_pos",
                rows(),
                |row| joint_beyond_limits(row).is_some(),
                what,
            );
        }
        let is_elsewhere = |(row, pose): &(&[f64; ARM_DOFS], &[f64; 7])| {
            let tool = panda::tool_pose(row).translation.vector;
            (0..3).any(|axis| (tool[axis] - pose[axis]).abs() > TOLERANCE)
        };
        let pairs = rows().zip(poses.as_chunks::<7>().0);
        let what = "not the joint positions at obs/eef_pose";
        self.add_first("obs/arm_joint_pos", pairs, is_elsewhere, what);
    }

    /// Checks units of the readings of the gripper, and that they agree with each other.
    fn check_gripper(&mut self) {
        let stroke = 0.5 * MAX_WIDTH;
        let fingers = self.values("obs/gripper_pos");
        let is_beyond = |x: &&f64| **x < -STROKE_MARGIN || **x > stroke + STROKE_MARGIN;
        if fingers.iter().any(|x| is_beyond(&x)) {
            let rows = fingers.as_chunks::<2>().0;
            let is_wrong = |row: &&[f64; 2]| row.iter().any(|x| is_beyond(&x));
            return self.add_first(
                "obs/gripper_pos",
                rows,
                is_wrong,
                "expected positions of the fingers in 0..0.04 m",
            );
        }
        let widths: Vec<f64> = fingers.as_chunks::<2>().0.iter().map(|[left, right]| left + right).collect();
        let mut check = |name: &str, tolerance: f64, what: &str, expected: &dyn Fn(f64) -> f64| {
            let values = self.values(name);
            let is_wrong = |(value, width): &(&f64, &f64)| (*value - expected(**width)).abs() > tolerance;
            self.add_first(name, values.iter().zip(&widths), is_wrong, what);
        };
        check("obs/gripper_width", TOLERANCE, "not the sum of obs/gripper_pos", &|width| width);
        let far = "not near obs/gripper_width: is it in m?";
        check("obs/gripper_width_sensed", SENSOR_ERROR, far, &|width| width);
        let not_norm = "not 1 - width / 0.08 m";
        check("obs/gripper_close_norm", TOLERANCE, not_norm, &|width| 1.0 - width / MAX_WIDTH);
        let states = self.values("obs/state");
        let fingers = states.as_chunks::<7>().0.iter().map(|row| row[6]).zip(&widths);
        let is_wrong = |(finger, width): &(f64, &f64)| (finger - 0.5 * *width).abs() > 0.5 * SENSOR_ERROR;
        self.add_first(
            "obs/state",
            fingers,
            is_wrong,
            "its last number is not half of obs/gripper_width, in m",
        );
        let closures = self.values("obs/gripper_closure");
        let is_wrong = |closure: &&f64| !(-TOLERANCE..=1.0 + TOLERANCE).contains(*closure);
        if closures.iter().any(|closure| is_wrong(&closure)) {
            let what = "expected a closure in 0..1";
            return self.add_first("obs/gripper_closure", &closures, is_wrong, what);
        }
        let actions = self.values("actions");
        let commanded = actions.as_chunks::<7>().0.iter().map(|row| row[6].clamp(0.0, 1.0));
        let pairs = closures.iter().zip(std::iter::once(0.0).chain(commanded));
        let is_wrong = |(closure, expected): &(&f64, f64)| (*closure - expected).abs() > TOLERANCE;
        let what = "not the closure that the action before commands, and 0 in the first step";
        self.add_first("obs/gripper_closure", pairs, is_wrong, what);
    }

    /// Checks that the cameras stand still, in the room or on the hand, and that their matrices are of their images.
    fn check_cameras(&mut self) {
        let tools = self.values("obs/eef_pose");
        let tools: Vec<Pose> = tools.as_chunks::<7>().0.iter().map(pose).collect();
        for (name, images) in CAMERA_POSES.into_iter().zip(IMAGE_STREAMS) {
            let cameras = self.values(name);
            let cameras: Vec<Pose> = cameras.as_chunks::<7>().0.iter().map(pose).collect();
            let on_hand: Vec<Pose> =
                tools.iter().zip(&cameras).map(|(tool, camera)| tool.inverse() * camera).collect();
            if first_moved(&cameras).is_some()
                && let Some(step) = first_moved(&on_hand)
            {
                let what = "the camera moves, both in the room and with the hand";
                self.add(name, format!("step {step}: {what}"));
            }
            self.check_intrinsic(name, &format!("obs/{images}"));
        }
    }

    /// Checks the attribute `intrinsic` of the poses of a camera: square pixels, and the centre that of its images.
    fn check_intrinsic(&mut self, name: &str, images: &str) {
        if !self.file.has(self.demo, name) {
            return;
        }
        let Some(stream) = self.report.take(self.file.stream(self.demo, name)) else { return };
        let text = stream.attributes.iter().find(|(name, _)| name == "intrinsic").map(|(_, text)| text);
        let matrix = text.and_then(|text| serde_json::from_str::<[[f64; 3]; 3]>(text).ok());
        let shape = self.file.shape(self.demo, images).ok().filter(|_| self.file.has(self.demo, images));
        let is_right = matrix.is_some_and(|[[fx, skew, cx], [zero, fy, cy], last]| {
            let is_centre = shape.as_ref().is_none_or(|shape| match shape[..] {
                [_, height, width, _] => [2.0 * cx, 2.0 * cy] == [width as f64, height as f64],
                _ => true,
            });
            [skew, zero] == [0.0; 2]
                && last == [0.0, 0.0, 1.0]
                && fx == fy
                && fx > 0.0
                && cx > 0.0
                && cy > 0.0
                && is_centre
        });
        if !is_right {
            let found = text.map_or("missing", String::as_str);
            let what = format!(
                "attribute intrinsic: expected one focal length and the centre of the images, in pixels: {found}"
            );
            self.add(name, what);
        }
    }

    /// Checks that the reward is 1 in the last step alone, which is the end.
    fn check_ends(&mut self) {
        let last = self.steps.saturating_sub(1);
        for name in ["rewards", "dones"] {
            let values = self.values(name);
            let is_wrong = |(step, value): &(usize, &f64)| **value != f64::from(u8::from(*step == last));
            let what = "expected 1 in the last step and 0 before: demonstrations end at the goal";
            self.add_first(name, values.iter().enumerate(), is_wrong, what);
        }
    }

    /// Checks that no picture is of one colour, as of a camera that was not read.
    pub(super) fn check_pictures(&mut self, name: &str, pixels: &StreamValues, size: usize) {
        let StreamValues::U8(pixels) = pixels else { return self.add(name, "expected uint8") };
        let is_plain =
            |picture: &&[u8]| picture.iter().skip(3).zip(*picture).all(|(after, pixel)| after == pixel);
        self.add_first(name, pixels.chunks_exact(size.max(1)), is_plain, "a picture of one colour");
    }

    /// Checks that the markers of a finger are at different places.
    fn check_markers(&mut self) {
        let name = "obs/gripper_marker_motion";
        let values = self.values(name);
        let is_point = |row: &&[f64]| {
            row.chunks_exact(2 * MARKER_COUNT)
                .any(|markers| markers.as_chunks::<2>().0.windows(2).all(|pair| pair[0] == pair[1]))
        };
        let rows = values.chunks_exact(8 * MARKER_COUNT);
        self.add_first(name, rows.clone(), is_point, "all markers of a finger are at one place");
        let is_outside = |row: &&[f64]| {
            row.as_chunks::<2>().0.iter().any(|[x, y]| {
                let is_beyond =
                    |at: f64, edge: f64| at < -MARKER_MARGIN * edge || at > (1.0 + MARKER_MARGIN) * edge;
                is_beyond(*x, IMAGE_SIZE[0] as f64) || is_beyond(*y, IMAGE_SIZE[1] as f64)
            })
        };
        self.add_first(
            name,
            rows.clone(),
            is_outside,
            "a marker outside of the tactile picture: is it x, y in px?",
        );
        let initial =
            |row: &[f64]| [0, 4 * MARKER_COUNT].map(|finger| row[finger..finger + 2 * MARKER_COUNT].to_vec());
        let first = rows.clone().next().map(initial);
        let is_other = |row: &&[f64]| Some(initial(row)) != first;
        self.add_first(
            name,
            rows,
            is_other,
            "initial positions of markers that are not those of the first step",
        );
    }

    /// Checks that contacts, forces and the actions beside them agree.
    fn check_forces(&mut self) {
        let pads = self.values("privileged/pad_force");
        self.add_first("privileged/pad_force", &pads, |force| **force < 0.0, "a normal force below 0");
        let contacts = self.values("privileged/contact");
        let is_wrong = |(contact, force): &(&f64, &f64)| (**contact != 0.0) != (**force > 0.0);
        if let Some(at) = contacts.iter().zip(&pads).position(|pair| is_wrong(&pair)) {
            let what = format!("step {}: not where privileged/pad_force is above 0", at / 2);
            self.add("privileged/contact", what);
        }
        let (both, actions) = (self.values("privileged/actions_with_force"), self.values("actions"));
        let net = self.values("privileged/gripper_net_force");
        let parts =
            both.as_chunks::<13>().0.iter().zip(actions.as_chunks::<7>().0).zip(net.as_chunks::<6>().0);
        let is_wrong = |((both, action), net): &((&[f64; 13], &[f64; 7]), &[f64; 6])| {
            both[..7] != action[..] || both[7..] != net[..]
        };
        let what = "not the action and privileged/gripper_net_force";
        self.add_first("privileged/actions_with_force", parts, is_wrong, what);
    }

    /// Checks true deformations and places.
    fn check_shapes(&mut self) {
        let (rms, most) = (self.values("privileged/d"), self.values("privileged/d_max"));
        let is_wrong = |(rms, most): &(&f64, &f64)| **rms < 0.0 || **rms > **most + TOLERANCE;
        let what = "expected 0 or more and at most privileged/d_max";
        self.add_first("privileged/d", rms.iter().zip(&most), is_wrong, what);
        // Demonstrations of other programs have no record.
        let peak = self.file.record(self.demo).ok().and_then(|record| record.verdict.object().d_peak);
        if let Some(peak) = peak.filter(|_| !rms.is_empty()) {
            let own = rms.iter().copied().fold(0.0, f64::max);
            // The stream lacks the last control step.
            if own > peak + TOLERANCE || own < MIN_SHARE_OF_PEAK * peak {
                self.add("privileged/d", format!("its largest is {own}, and d_peak of the record {peak}"));
            }
        }
        let Some(names) = self.report.take(self.file.names(self.demo)) else { return };
        for name in names.iter().filter(|name| name.starts_with("privileged/states/")) {
            let values = self.values(name);
            let width = values.len() / self.steps.max(1);
            let (rows, numbers) =
                (values.chunks_exact(width.max(1)), if name.ends_with("nodal_pos_w") { width } else { 3 });
            let is_far = |row: &&[f64]| row.iter().take(numbers).any(|x| x.abs() > MAX_DISTANCE_M);
            self.add_first(name, rows.clone(), is_far, "a place more than 20 m away: is it in m?");
            if numbers == width {
                let is_point =
                    |row: &&[f64]| row.as_chunks::<3>().0.windows(2).all(|pair| pair[0] == pair[1]);
                self.add_first(name, rows, is_point, "all nodes are at one place");
            }
        }
    }
}
