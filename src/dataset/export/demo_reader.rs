//! [`DemoReader`]: what a policy observes and commands in a demonstration, as every format stores it.

use std::ops::Range;

use image::{ImageError, RgbImage};

use super::{
    ArmControl, ExportJob,
    selection::{ImageSize, SelectedDemo},
};
use crate::{
    DatasetError, ImageStack, TaskFile,
    demonstration::{JOINT_ACTIONS, JOINT_TORQUES, actions_stream_name},
    layout::IMAGE_STREAMS,
};
use softvt_policy::profile::GripCode;
use softvt_robot::{panda::ARM_DOFS, tactile::IMAGE_SIZE};
use softvt_sensing::tactile::{HISTORY_LENGTH, MARKER_COUNT, TactileMosaicLayout, mosaic, mosaic_cell};

/// Shape of the markers of a row: initial positions, those of the previous step and of this one; both fingers; x and y.
pub(super) const MARKER_SHAPE: [usize; 3] = [3, 2 * MARKER_COUNT, 2];
/// Images decompressed at once: whole chunks of the file.
const IMAGES_PER_BLOCK: usize = 32;
/// Numbers of a row of `actions` and of `obs/state`: a pose, and one of the gripper.
const ACTION_ROW: usize = 7;
/// Numbers of the markers in a row, and of one state of one finger.
pub(super) const MARKER_ROW: usize = MARKER_SHAPE[0] * MARKER_SHAPE[1] * MARKER_SHAPE[2];
const FINGER_COORDINATES: usize = 2 * MARKER_COUNT;

/// Numbers of a demonstration, row by row.
pub(super) struct DemoNumbers {
    /// Of the arm, and the sensed position of one finger.
    pub state: Vec<f32>,
    /// Motion, and one number of the gripper.
    pub actions: Vec<f32>,
    /// [`MARKER_SHAPE`] per row.
    pub markers: Vec<f32>,
    /// Torques of the arm's drives, if the recording has them.
    pub joint_torques: Option<Vec<f32>>,
}

/// Reads a demonstration.
pub(super) struct DemoReader {
    file: TaskFile,
    demo: usize,
    steps: usize,
}

impl DemoReader {
    /// # Errors
    /// The file cannot be opened.
    pub(super) fn open(demo: &SelectedDemo) -> Result<Self, DatasetError> {
        let file = TaskFile::open(&demo.path)?;
        Ok(Self { file, demo: demo.entry.demo_id, steps: demo.entry.num_samples })
    }

    /// Reads the numbers of all rows.
    ///
    /// # Errors
    /// A stream is missing, of unexpected shape or not finite.
    pub(super) fn numbers(&self, job: &ExportJob<'_>) -> Result<DemoNumbers, DatasetError> {
        let [state, actions] = self.vectors(job.config.control, job.selection.gripper)?;
        let torques = job.selection.has_joint_torques.then(|| self.floats(JOINT_TORQUES, &[ARM_DOFS]));
        let joint_torques = torques.transpose()?;
        let markers = marker_rows(&self.floats("obs/gripper_marker_motion", &[2, 2, MARKER_COUNT, 2])?);
        Ok(DemoNumbers { state, actions, markers, joint_torques })
    }

    /// Reads the measured joint positions, rad.
    ///
    /// # Errors
    /// As [`Self::numbers`].
    pub(super) fn joint_positions(&self) -> Result<Vec<f32>, DatasetError> {
        self.floats("obs/arm_joint_pos", &[ARM_DOFS])
    }

    /// Passes the images of every step to `each`: both cameras, and the mosaic of the last images of both fingers.
    ///
    /// # Errors
    /// As [`Self::numbers`]; the error of `each`; or the export was cancelled.
    pub(super) fn for_each_step(
        &self,
        job: &ExportJob<'_>,
        mut each: impl FnMut(usize, [RgbImage; 3]) -> Result<(), ImageError>,
    ) -> Result<(), DatasetError> {
        // The last images of each finger, scaled to cells of the mosaic.
        let mut history: [Vec<RgbImage>; 2] = Default::default();
        for from in (0..self.steps).step_by(IMAGES_PER_BLOCK) {
            if (job.is_cancelled)() {
                return Err(DatasetError::Interrupted);
            }
            let block = from..self.steps.min(from + IMAGES_PER_BLOCK);
            let [third, wrist, left, right] = self.image_block(job.selection.image_sizes, block.clone())?;
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
        Ok(())
    }

    fn check_shape(&self, name: &str, row_shape: &[usize]) -> Result<(), DatasetError> {
        let (found, expected) = (self.file.shape(self.demo, name)?, [&[self.steps], row_shape].concat());
        if found == expected {
            return Ok(());
        }
        Err(self.file.error(self.demo, name, format!("expected the shape {expected:?}, got {found:?}")))
    }

    fn floats(&self, name: &str, row_shape: &[usize]) -> Result<Vec<f32>, DatasetError> {
        self.check_shape(name, row_shape)?;
        let values = self.file.finite_array(self.demo, name)?.values;
        Ok(values.into_iter().map(|x| x as f32).collect())
    }

    /// States and actions, row by row: of the arm, and one number of the gripper.
    fn vectors(&self, control: ArmControl, gripper: GripCode) -> Result<[Vec<f32>; 2], DatasetError> {
        let states = self.floats("obs/state", &[ACTION_ROW])?;
        let widths = self.floats("obs/gripper_width_sensed", &[1])?;
        let actions = self.floats(actions_stream_name(gripper), &[ACTION_ROW])?;
        let (arm, motions) = match control {
            ArmControl::Pose => {
                let without_gripper = |rows: &[f32]| -> Vec<f32> {
                    rows.chunks_exact(ACTION_ROW).flat_map(|row| &row[..ACTION_ROW - 1]).copied().collect()
                };
                (without_gripper(&states), without_gripper(&actions))
            }
            ArmControl::Joints => {
                let commanded = self.file.joint_commands(self.demo)?;
                self.check_shape(JOINT_ACTIONS, &[ARM_DOFS])?;
                (self.joint_positions()?, commanded.into_iter().flatten().map(|x| x as f32).collect())
            }
        };
        let rows = |motion: Vec<f32>, grip: Vec<f32>| -> Vec<f32> {
            let width = control.vector_length() - 1;
            motion
                .chunks_exact(width)
                .zip(grip)
                .flat_map(|(row, grip)| row.iter().copied().chain([grip]))
                .collect()
        };
        let fingers = widths.into_iter().map(|width| 0.5 * width).collect();
        let grips = actions.chunks_exact(ACTION_ROW).map(|row| row[ACTION_ROW - 1]).collect();
        Ok([rows(arm, fingers), rows(motions, grips)])
    }

    /// The four image streams of some steps. `sizes` are those of the cameras.
    fn image_block(
        &self,
        [third, wrist]: [ImageSize; 2],
        steps: Range<usize>,
    ) -> Result<[Vec<RgbImage>; 4], DatasetError> {
        let finger = ImageSize { height: IMAGE_SIZE[1], width: IMAGE_SIZE[0] };
        let mut streams: [Vec<RgbImage>; 4] = Default::default();
        for ((images, name), size) in
            streams.iter_mut().zip(IMAGE_STREAMS).zip([third, wrist, finger, finger])
        {
            let name = format!("obs/{name}");
            self.check_shape(&name, &[size.height, size.width, 3])?;
            let ImageStack { bytes, height, width } = self.file.images(self.demo, &name, steps.clone())?;
            let each = bytes.chunks_exact((3 * height * width).max(1));
            *images =
                each.filter_map(|b| RgbImage::from_raw(width as u32, height as u32, b.to_vec())).collect();
            if images.len() != steps.len() {
                let what = format!("{} images of steps {steps:?}", images.len());
                return Err(self.file.error(self.demo, &name, what));
            }
        }
        Ok(streams)
    }
}

/// Rows of (3, 198, 2) from stored rows of (finger, initial and present, marker, (x, y)).
fn marker_rows(stored: &[f32]) -> Vec<f32> {
    let steps: Vec<&[f32]> = stored.chunks_exact(4 * FINGER_COORDINATES).collect();
    let mut rows = Vec::with_capacity(steps.len() * MARKER_ROW);
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
