//! [`DemoReader`]: what a policy observes and commands in a demonstration, as every format stores it.

use std::ops::Range;

use image::{ImageError, RgbImage};
use sha2::{Digest, Sha256};

use super::{
    ArmControl, ExportJob,
    features::{self, Content, Feature},
    selection::{ImageSize, SelectedDemo},
};
use crate::{
    DatasetError, ImageStack, TaskFile,
    streams::{IMAGES, JOINT_ACTIONS, MARKER_MOTION, MARKER_ROW, actions_in},
};
use softvt_common::text::hex;
use softvt_policy::{
    ROBOT_STREAMS, RobotStream,
    profile::GripCode,
    stream_paths::{JOINTS, SENSED_WIDTHS, STATES},
};
use softvt_robot::{panda::ARM_DOFS, tactile::IMAGE_SIZE};
use softvt_sensing::tactile::{HISTORY_LENGTH, MARKER_COUNT, TactileMosaicLayout, mosaic, mosaic_cell};

/// Images decompressed at once: whole chunks of the file.
const IMAGES_PER_BLOCK: usize = 32;
/// Numbers of a row of `actions` and of `obs/state`: a pose, and one of the gripper.
const ACTION_ROW: usize = 7;
/// Numbers of the markers in one state of one finger.
const FINGER_COORDINATES: usize = 2 * MARKER_COUNT;

pub(super) struct DemoReader {
    file: TaskFile,
    demo: usize,
    steps: usize,
}

impl DemoReader {
    pub(super) fn open(demo: &SelectedDemo) -> Result<Self, DatasetError> {
        let file = TaskFile::open(&demo.path)?;
        Ok(Self { file, demo: demo.entry.demo_id, steps: demo.entry.num_samples })
    }

    /// Reads the numbers of a feature, row by row.
    pub(super) fn numbers(&self, job: &ExportJob<'_>, feature: &Feature) -> Result<Vec<f32>, DatasetError> {
        let control = job.config.control;
        match (feature.content, feature.name) {
            (Content::Image(_), _) => Ok(Vec::new()),
            (Content::Markers, _) => Ok(marker_rows(&self.floats(MARKER_MOTION, &MARKER_ROW)?)),
            (Content::Action, _) => self.actions(control, job.selection.gripper),
            (Content::Vector, "state") => self.states(control),
            (Content::Vector, "joint_state") => self.floats(JOINTS, &[ARM_DOFS]),
            (Content::Vector, name) => {
                let is_named =
                    |stream: &&RobotStream| stream.exported.as_ref().is_some_and(|of| of.name == name);
                let stream = ROBOT_STREAMS.iter().find(is_named);
                let path = stream.and_then(|stream| Some(stream.recorded.as_ref()?.path));
                self.floats(path.unwrap_or(name), &feature.shape)
            }
        }
    }

    /// Passes the images of every step to `each`: both cameras, and the mosaic of the last images of both fingers.
    pub(super) fn for_each_step(
        &self,
        job: &ExportJob<'_>,
        mut each: impl FnMut(usize, [RgbImage; 3]) -> Result<(), ImageError>,
    ) -> Result<(), DatasetError> {
        // The last images of each finger, scaled to cells of the mosaic.
        let mut history: [Vec<RgbImage>; 2] = Default::default();
        let mut hashes = IMAGES.map(|_| Sha256::new());
        for from in (0..self.steps).step_by(IMAGES_PER_BLOCK) {
            if (job.is_cancelled)() {
                return Err(DatasetError::Interrupted);
            }
            let block = from..self.steps.min(from + IMAGES_PER_BLOCK);
            let images = self.image_block(job.selection.image_sizes, block.clone())?;
            for (hash, images) in hashes.iter_mut().zip(&images) {
                images.iter().for_each(|image| hash.update(image.as_raw()));
            }
            let [third, wrist, left, right] = images;
            let cameras = third.into_iter().zip(wrist);
            let fingers = left.iter().zip(&right);
            for (step, ((third, wrist), (left, right))) in block.zip(cameras.zip(fingers)) {
                for (cells, image) in history.iter_mut().zip([left, right]) {
                    if cells.len() == HISTORY_LENGTH {
                        cells.remove(0);
                    }
                    cells.push(mosaic_cell(image));
                }
                let mosaic = mosaic([&history[0], &history[1]], TactileMosaicLayout::Rows);
                each(step, [third, wrist, mosaic]).map_err(|error| {
                    let key = format!("/data/demo_{}, step {step}", self.demo);
                    DatasetError::content(&self.file.path, key, error.to_string())
                })?;
            }
        }
        IMAGES
            .into_iter()
            .zip(hashes)
            .try_for_each(|(name, hash)| self.file.verify_digest(self.demo, name, || hex(&hash.finalize())))
    }

    fn check_shape(&self, name: &str, row_shape: &[usize]) -> Result<(), DatasetError> {
        let (found, expected) = (self.file.shape(self.demo, name)?, [&[self.steps], row_shape].concat());
        if found == expected {
            return Ok(());
        }
        Err(self.file.error(self.demo, name, format_args!("expected the shape {expected:?}, got {found:?}")))
    }

    fn floats(&self, name: &str, row_shape: &[usize]) -> Result<Vec<f32>, DatasetError> {
        self.check_shape(name, row_shape)?;
        let values = self.file.finite_array(self.demo, name)?.values;
        Ok(values.into_iter().map(|x| x as f32).collect())
    }

    /// States, row by row: of the arm, and the sensed position of one finger.
    fn states(&self, control: ArmControl) -> Result<Vec<f32>, DatasetError> {
        let arm = match control {
            ArmControl::Pose => without_last(&self.floats(STATES, &[ACTION_ROW])?),
            ArmControl::Joints => self.floats(JOINTS, &[ARM_DOFS])?,
        };
        let widths = self.floats(SENSED_WIDTHS, &[1])?;
        Ok(with_last(control, &arm, widths.into_iter().map(|width| 0.5 * width)))
    }

    /// Actions, row by row: the motion of the arm, and one number of the gripper.
    fn actions(&self, control: ArmControl, gripper: GripCode) -> Result<Vec<f32>, DatasetError> {
        let actions = self.floats(actions_in(gripper), &[ACTION_ROW])?;
        let motion = match control {
            ArmControl::Pose => without_last(&actions),
            ArmControl::Joints => {
                let commanded = self.file.joint_commands(self.demo)?;
                self.check_shape(JOINT_ACTIONS, &[ARM_DOFS])?;
                commanded.into_iter().flatten().map(|x| x as f32).collect()
            }
        };
        Ok(with_last(control, &motion, actions.chunks_exact(ACTION_ROW).map(|row| row[ACTION_ROW - 1])))
    }

    /// The four image streams of some steps. `sizes` are those of the cameras.
    fn image_block(
        &self,
        [third, wrist]: [ImageSize; 2],
        steps: Range<usize>,
    ) -> Result<[Vec<RgbImage>; 4], DatasetError> {
        let finger = ImageSize { height: IMAGE_SIZE[1], width: IMAGE_SIZE[0] };
        let mut streams: [Vec<RgbImage>; 4] = Default::default();
        for ((images, name), size) in streams.iter_mut().zip(IMAGES).zip([third, wrist, finger, finger]) {
            self.check_shape(name, &[size.height, size.width, 3])?;
            let ImageStack { bytes, height, width } = self.file.images(self.demo, name, steps.clone())?;
            let each = bytes.chunks_exact((3 * height * width).max(1));
            *images =
                each.filter_map(|b| RgbImage::from_raw(width as u32, height as u32, b.to_vec())).collect();
            if images.len() != steps.len() {
                let what = format!("{} images of steps {steps:?}", images.len());
                return Err(self.file.error(self.demo, name, what));
            }
        }
        Ok(streams)
    }
}

/// Rows of actions without their last number.
fn without_last(rows: &[f32]) -> Vec<f32> {
    rows.chunks_exact(ACTION_ROW).flat_map(|row| &row[..ACTION_ROW - 1]).copied().collect()
}

/// Rows of the arm with one number of the gripper each.
fn with_last(control: ArmControl, arm: &[f32], grips: impl Iterator<Item = f32>) -> Vec<f32> {
    let rows = arm.chunks_exact(control.motion_names().len()).zip(grips);
    rows.flat_map(|(row, grip)| row.iter().copied().chain([grip])).collect()
}

/// Rows of (3, 198, 2) from stored rows of (finger, initial and present, marker, (x, y)).
fn marker_rows(stored: &[f32]) -> Vec<f32> {
    let steps: Vec<&[f32]> = stored.chunks_exact(4 * FINGER_COORDINATES).collect();
    let mut rows = Vec::with_capacity(steps.len() * features::MARKER_ROW);
    let mut push = |step: &[f32], state: usize| {
        for finger in step.chunks_exact(2 * FINGER_COORDINATES) {
            rows.extend_from_slice(&finger[state * FINGER_COORDINATES..][..FINGER_COORDINATES]);
        }
    };
    for now in 0..steps.len() {
        // The initial positions are those of the oldest state in a policy's history.
        push(steps[(now + 1).saturating_sub(HISTORY_LENGTH)], 0);
        push(steps[now.saturating_sub(1)], 1);
        push(steps[now], 1);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    const MARKER_ROW: usize = features::MARKER_ROW;

    #[test]
    fn markers_are_arranged_as_in_a_policys_history() {
        // Finger, state and step encoded in one number.
        let step = |t: usize| {
            (0..4).flat_map(move |i| {
                (0..FINGER_COORDINATES).map(move |p| (1000 * i + 10 * t) as f32 + (p % 10) as f32)
            })
        };
        let stored: Vec<f32> = (0..10).flat_map(step).collect();
        let rows = marker_rows(&stored);
        assert_eq!(rows.len(), 10 * MARKER_ROW);
        let first = |t: usize, row: usize, finger: usize| {
            rows[t * MARKER_ROW + (2 * row + finger) * FINGER_COORDINATES]
        };
        // Initial positions are those of the oldest state in the history, seven steps ago.
        assert_eq!([first(0, 0, 0), first(9, 0, 0), first(9, 0, 1)], [0.0, 20.0, 2020.0]);
        assert_eq!([first(0, 1, 0), first(9, 1, 0), first(9, 1, 1)], [1000.0, 1080.0, 3080.0]);
        assert_eq!([first(0, 2, 0), first(9, 2, 0), first(9, 2, 1)], [1000.0, 1090.0, 3090.0]);
        assert_eq!(rows[9 * MARKER_ROW + 1], 21.0, "x and y stay adjacent");
    }
}
