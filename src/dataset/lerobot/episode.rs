//! [`EpisodeData`]: the rows of an episode with their statistics, ready to be written.

use image::{ImageError, RgbImage};

use super::{
    config::{ArmControl, ExportConfig, LeRobotVersion},
    features::{IMAGE_FEATURES, INDEX_FEATURES, MARKER_SHAPE},
    parquet_table::{ColumnValues, EmbeddedImage},
    selection::{ImageSize, SelectedDemo, Selection},
    statistics::{FeatureStatistics, QuantileSource, ValueCounts, ValueMoments, ValueStatistics},
};
use crate::{
    DatasetError, ImageStack, TaskFile,
    demonstration::{JOINT_ACTIONS, JOINT_TORQUES, actions_stream_name},
    layout::IMAGE_STREAMS,
};
use softvt_benchmark::CONTROL_HZ;
use softvt_policy::profile::GripCode;
use softvt_robot::{panda::ARM_DOFS, tactile::IMAGE_SIZE};
use softvt_sensing::{
    camera::encode_png,
    tactile::{HISTORY_LENGTH, MARKER_COUNT, TactileMosaicLayout, mosaic, mosaic_cell},
};

/// Images decompressed at once: whole chunks of the file.
const IMAGES_PER_BLOCK: usize = 32;
/// Numbers of a row of `actions` and of `obs/state`: a pose, and one of the gripper.
const ACTION_ROW: usize = 7;
/// Numbers of the markers in a row, and of one state of one finger.
const MARKER_ROW: usize = MARKER_SHAPE[0] * MARKER_SHAPE[1] * MARKER_SHAPE[2];
const FINGER_COORDINATES: usize = 2 * MARKER_COUNT;
/// Resolution and range of the counts from which quantiles of marker positions are taken, px.
const MARKER_STEP: f64 = 0.01;
const MARKER_RANGE: f64 = 400.0;

/// Writes the files of a layout, episode by episode.
pub(super) trait EpisodeWriter: Send {
    fn add(&mut self, episode: EpisodeData<'_>) -> Result<(), DatasetError>;
    fn finish(self: Box<Self>) -> Result<(), DatasetError>;
}

/// An episode ready to be written.
pub(super) struct EpisodeData<'a> {
    pub index: usize,
    pub demo: &'a SelectedDemo,
    /// Columns of its table, in the order of the features.
    pub columns: Vec<ColumnValues>,
    /// Statistics of the columns.
    pub statistics: Vec<FeatureStatistics>,
}

impl<'a> EpisodeData<'a> {
    /// Reads episode `index`.
    ///
    /// # Errors
    /// A stream is missing, of unexpected shape or not finite; or the export was cancelled.
    pub(super) fn read(
        config: &ExportConfig,
        selection: &'a Selection,
        index: usize,
        is_cancelled: &impl Fn() -> bool,
    ) -> Result<Self, DatasetError> {
        let demo = &selection.demos[index];
        let steps = demo.entry.num_samples;
        let reader = DemoStreams { file: &TaskFile::open(&demo.path)?, demo: demo.entry.demo_id, steps };
        let length = config.control.vector_length();
        let [state, actions] = reader.vectors(config.control, selection.gripper)?;
        let torques = selection.has_joint_torques.then(|| reader.floats(JOINT_TORQUES, &[ARM_DOFS]));
        let torques = torques.transpose()?;
        let markers = marker_rows(&reader.floats("obs/gripper_marker_motion", &[2, 2, MARKER_COUNT, 2])?);
        let images = reader.image_columns(config.version, selection.image_sizes, is_cancelled)?;
        let timestamps: Vec<f32> =
            (0..steps).map(|step| (step as f64 / f64::from(CONTROL_HZ)) as f32).collect();
        let constant = |number: usize| vec![number as i64; steps];
        let counted = |from: usize| (from..from + steps).map(|i| i as i64).collect();
        let indices: [Vec<i64>; 4] =
            [counted(0), constant(index), counted(demo.first_frame), constant(demo.prompt)];

        let mut episode = Self { index, demo, columns: Vec::new(), statistics: Vec::new() };
        let key = |name| config.version.key(name);
        for (name, ImageColumn { images, counts }) in IMAGE_FEATURES.into_iter().zip(images) {
            let parts = counts.into_iter().map(ValueStatistics::counted).collect();
            episode.push(key(name), &[3, 1, 1], parts, ColumnValues::Images(images));
        }
        episode.push_vectors(key("state"), length, state);
        episode.push_vectors(key("actions"), length, actions);
        let (shape, parts) = match config.version {
            LeRobotVersion::V21 => (&MARKER_SHAPE[..], statistics_per_marker(&markers)),
            LeRobotVersion::V30 => (&[2][..], statistics_of_all_markers(&markers)),
        };
        episode.push(key("tactile_marker_motion"), shape, parts, ColumnValues::F32(markers));
        if let Some(torques) = torques {
            episode.push_vectors(key("joint_torques"), ARM_DOFS, torques);
        }
        let part = |numbers: Vec<f64>| vec![ValueStatistics::of(numbers)];
        let seconds = timestamps.iter().map(|time| f64::from(*time)).collect();
        episode.push("timestamp", &[1], part(seconds), ColumnValues::F32(timestamps));
        for (name, numbers) in INDEX_FEATURES.into_iter().zip(indices) {
            let parts = part(numbers.iter().map(|number| *number as f64).collect());
            episode.push(name, &[1], parts, ColumnValues::I64(numbers));
        }
        Ok(episode)
    }

    /// Adds a column of vectors, row by row.
    fn push_vectors(&mut self, name: &'static str, length: usize, rows: Vec<f32>) {
        let column = |i: usize| rows.iter().skip(i).step_by(length).map(|x| f64::from(*x));
        let parts = (0..length).map(|i| ValueStatistics::of(column(i).collect())).collect();
        self.push(name, &[length], parts, ColumnValues::F32(rows));
    }

    fn push(
        &mut self,
        name: &'static str,
        shape: &[usize],
        parts: Vec<ValueStatistics>,
        values: ColumnValues,
    ) {
        let steps = self.demo.entry.num_samples as u64;
        self.statistics.push(FeatureStatistics { name, shape: shape.to_vec(), steps, parts });
        self.columns.push(values);
    }
}

/// Images of a feature.
struct ImageColumn {
    images: Vec<EmbeddedImage>,
    /// Counts of the values of each channel.
    counts: [ValueCounts; 3],
}

impl ImageColumn {
    fn push(&mut self, image: &RgbImage, name: String) -> Result<(), ImageError> {
        for pixel in image.pixels() {
            for (counts, value) in self.counts.iter_mut().zip(pixel.0) {
                counts.count(usize::from(value));
            }
        }
        self.images.push(EmbeddedImage { png: encode_png(image)?, name });
        Ok(())
    }
}

/// Streams of a demonstration of known length.
struct DemoStreams<'a> {
    file: &'a TaskFile,
    demo: usize,
    steps: usize,
}

impl DemoStreams<'_> {
    /// Images of every image feature. `sizes` are those of the cameras.
    fn image_columns(
        &self,
        version: LeRobotVersion,
        sizes: [ImageSize; 2],
        is_cancelled: &impl Fn() -> bool,
    ) -> Result<[ImageColumn; 3], DatasetError> {
        let counts = || std::array::from_fn(|_| ValueCounts::new(1.0 / 255.0, 256));
        let mut columns = IMAGE_FEATURES.map(|_| ImageColumn { images: Vec::new(), counts: counts() });
        // The last images of each finger, scaled to cells of the mosaic.
        let mut history: [Vec<RgbImage>; 2] = Default::default();
        for from in (0..self.steps).step_by(IMAGES_PER_BLOCK) {
            if is_cancelled() {
                return Err(DatasetError::Interrupted);
            }
            let block = from..self.steps.min(from + IMAGES_PER_BLOCK);
            let [third, wrist, left, right] = self.image_block(sizes, block.clone())?;
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
                for (column, image) in columns.iter_mut().zip([third, wrist, mosaic]) {
                    column.push(&image, version.image_name(step)).map_err(|error| {
                        let key = format!("/data/demo_{}, step {step}", self.demo);
                        DatasetError::content(&self.file.path, key, error.to_string())
                    })?;
                }
            }
        }
        Ok(columns)
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
                let joints = self.floats("obs/arm_joint_pos", &[ARM_DOFS])?;
                (joints, commanded.into_iter().flatten().map(|x| x as f32).collect())
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
        steps: std::ops::Range<usize>,
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

fn marker_moments(rows: &[f32]) -> Vec<ValueMoments> {
    let column = |i: usize| rows.iter().skip(i).step_by(MARKER_ROW).map(|x| f64::from(*x));
    (0..MARKER_ROW).map(|i| ValueMoments::of(column(i))).collect()
}

/// Statistics of each marker coordinate, without quantiles.
fn statistics_per_marker(rows: &[f32]) -> Vec<ValueStatistics> {
    let part = |moments| ValueStatistics { moments, quantile_source: QuantileSource::None };
    marker_moments(rows).into_iter().map(part).collect()
}

/// Statistics of x and y over all markers.
fn statistics_of_all_markers(rows: &[f32]) -> Vec<ValueStatistics> {
    let moments = marker_moments(rows);
    let part = |axis| {
        let mut counts = ValueCounts::new(MARKER_STEP, (MARKER_RANGE / MARKER_STEP) as usize + 1);
        rows.iter().skip(axis).step_by(2).for_each(|x| counts.count_nearest(f64::from(*x)));
        let moments = ValueMoments::merged(moments.iter().skip(axis).step_by(2));
        ValueStatistics { moments, quantile_source: QuantileSource::Counts(counts) }
    };
    (0..2).map(part).collect()
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
