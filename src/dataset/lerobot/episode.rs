//! [`EpisodeData`]: the rows of an episode with their statistics, ready to be written.

use image::{ImageError, RgbImage};

use super::{
    ExportConfig, GripperCoding, LeRobotVersion,
    features::{IMAGE_FEATURES, INDEX_FEATURES, MARKER_SHAPE, VECTOR_LENGTH},
    parquet_table::{ColumnValues, EmbeddedImage},
    selection::{ImageSize, SelectedDemo, Selection},
    statistics::{FeatureStatistics, QuantileSource, ValueCounts, ValueMoments, ValueStatistics},
};
use crate::{
    benchmark::CONTROL_HZ,
    dataset::{DatasetError, ImageBlock, TaskFile, layout::IMAGE_STREAMS},
    sensing::{
        camera::encode_png,
        tactile::{HISTORY_LENGTH, IMAGE_SIZE, MARKER_COUNT, MosaicLayout, mosaic, mosaic_cell},
    },
};

/// Images decompressed at once: whole chunks of the file.
const IMAGES_PER_BLOCK: usize = 32;
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
    pub rows: EpisodeRows,
    pub statistics: Vec<FeatureStatistics>,
}

/// Rows of an episode.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EpisodeRows {
    pub steps: usize,
    /// PNG files, by image feature and step.
    pub images: [Vec<Vec<u8>>; 3],
    /// `steps` × 7.
    pub state: Vec<f32>,
    /// `steps` × 7.
    pub actions: Vec<f32>,
    /// `steps` × (3, 198, 2).
    pub markers: Vec<f32>,
    /// Counts of the values of each channel, by image feature.
    image_counts: [[ValueCounts; 3]; 3],
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
        let reader = DemoStreams {
            file: &TaskFile::open(&demo.path)?,
            demo: demo.entry.demo_id,
            steps: demo.entry.num_samples,
        };
        let rows = reader.rows(selection.image_sizes, config.gripper, is_cancelled)?;
        let mut statistics = rows.statistics();
        statistics.push(match config.version {
            LeRobotVersion::V21 => rows.statistics_per_marker(),
            LeRobotVersion::V30 => rows.statistics_of_all_markers(),
        });
        let timestamps = (0..rows.steps).map(|step| f64::from(timestamp(step))).collect();
        statistics.push(rows.feature("timestamp", &[1], vec![ValueStatistics::of(timestamps)]));
        for (name, numbers) in INDEX_FEATURES.into_iter().zip(index_columns(index, demo)) {
            let numbers = numbers.into_iter().map(|number| number as f64).collect();
            statistics.push(rows.feature(name, &[1], vec![ValueStatistics::of(numbers)]));
        }
        Ok(Self { index, demo, rows, statistics })
    }

    /// The columns of its table, in the order of the features. `image_name` names the image of a step.
    pub(super) fn into_columns(self, image_name: fn(usize) -> String) -> Vec<ColumnValues> {
        let Self { index, demo, rows, .. } = self;
        let images = rows.images.into_iter().map(|files| {
            let image = |(step, png)| EmbeddedImage { png, name: image_name(step) };
            ColumnValues::Images(files.into_iter().enumerate().map(image).collect())
        });
        let rest = [
            ColumnValues::F32(rows.state),
            ColumnValues::F32(rows.actions),
            ColumnValues::F32(rows.markers),
            ColumnValues::F32((0..rows.steps).map(timestamp).collect()),
        ];
        images.chain(rest).chain(index_columns(index, demo).map(ColumnValues::I64)).collect()
    }
}

/// Time of a step, s.
fn timestamp(step: usize) -> f32 {
    (step as f64 / f64::from(CONTROL_HZ)) as f32
}

/// Values of [`INDEX_FEATURES`] in every row of an episode.
fn index_columns(index: usize, demo: &SelectedDemo) -> [Vec<i64>; 4] {
    let steps = demo.entry.num_samples;
    let constant = |number: usize| vec![number as i64; steps];
    let counted = |from: usize| (from..from + steps).map(|i| i as i64).collect();
    [counted(0), constant(index), counted(demo.first_frame), constant(demo.prompt)]
}

/// Streams of a demonstration of known length.
struct DemoStreams<'a> {
    file: &'a TaskFile,
    demo: usize,
    steps: usize,
}

impl DemoStreams<'_> {
    fn error(&self, name: &str, what: String) -> DatasetError {
        self.file.error(self.demo, name, what)
    }

    fn rows(
        &self,
        sizes: [ImageSize; 2],
        gripper: GripperCoding,
        is_cancelled: &impl Fn() -> bool,
    ) -> Result<EpisodeRows, DatasetError> {
        let actions = match gripper {
            GripperCoding::Continuous => "actions",
            GripperCoding::Binary => "actions_binary",
        };
        let mut rows = EpisodeRows {
            steps: self.steps,
            images: Default::default(),
            state: self.floats("obs/state", &[VECTOR_LENGTH])?,
            actions: self.floats(actions, &[VECTOR_LENGTH])?,
            markers: marker_rows(&self.floats("obs/gripper_marker_motion", &[2, 2, MARKER_COUNT, 2])?),
            image_counts: std::array::from_fn(|_| {
                std::array::from_fn(|_| ValueCounts::new(1.0 / 255.0, 256))
            }),
        };
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
                let mosaic = mosaic([&history[0], &history[1]], MosaicLayout::Rows);
                for (feature, image) in [third, wrist, mosaic].iter().enumerate() {
                    rows.push_image(feature, image).map_err(|error| {
                        let key = format!("/data/demo_{}, step {step}", self.demo);
                        DatasetError::content(&self.file.path, key, error.to_string())
                    })?;
                }
            }
        }
        Ok(rows)
    }

    fn check_shape(&self, name: &str, row_shape: &[usize]) -> Result<(), DatasetError> {
        let (found, expected) = (self.file.shape(self.demo, name)?, [&[self.steps], row_shape].concat());
        if found == expected {
            return Ok(());
        }
        Err(self.error(name, format!("expected the shape {expected:?}, got {found:?}")))
    }

    fn floats(&self, name: &str, row_shape: &[usize]) -> Result<Vec<f32>, DatasetError> {
        self.check_shape(name, row_shape)?;
        let values = self.file.finite_array(self.demo, name)?.values;
        Ok(values.into_iter().map(|x| x as f32).collect())
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
            let ImageBlock { bytes, height, width } = self.file.images(self.demo, &name, steps.clone())?;
            let each = bytes.chunks_exact((3 * height * width).max(1));
            *images =
                each.filter_map(|b| RgbImage::from_raw(width as u32, height as u32, b.to_vec())).collect();
            if images.len() != steps.len() {
                return Err(self.error(&name, format!("{} images of steps {steps:?}", images.len())));
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

impl EpisodeRows {
    fn push_image(&mut self, feature: usize, image: &RgbImage) -> Result<(), ImageError> {
        for pixel in image.pixels() {
            for (counts, value) in self.image_counts[feature].iter_mut().zip(pixel.0) {
                counts.count(usize::from(value));
            }
        }
        self.images[feature].push(encode_png(image)?);
        Ok(())
    }

    fn feature(&self, name: &'static str, shape: &[usize], parts: Vec<ValueStatistics>) -> FeatureStatistics {
        FeatureStatistics { name, shape: shape.to_vec(), steps: self.steps as u64, parts }
    }

    /// Statistics of images, per channel, and of vectors, per number.
    fn statistics(&self) -> Vec<FeatureStatistics> {
        let images = IMAGE_FEATURES.iter().zip(&self.image_counts).map(|(name, channels)| {
            self.feature(name, &[3, 1, 1], channels.iter().cloned().map(ValueStatistics::counted).collect())
        });
        let vectors = [("state", &self.state), ("actions", &self.actions)].map(|(name, values)| {
            let column =
                |i: usize| values.iter().skip(i).step_by(VECTOR_LENGTH).map(|x| f64::from(*x)).collect();
            let parts = (0..VECTOR_LENGTH).map(|i| ValueStatistics::of(column(i))).collect();
            self.feature(name, &[VECTOR_LENGTH], parts)
        });
        images.chain(vectors).collect()
    }

    /// Statistics of each marker coordinate, without quantiles.
    fn statistics_per_marker(&self) -> FeatureStatistics {
        let part = |moments| ValueStatistics { moments, quantile_source: QuantileSource::None };
        let parts = self.marker_moments().into_iter().map(part).collect();
        self.feature("tactile_marker_motion", &MARKER_SHAPE, parts)
    }

    /// Statistics of x and y over all markers.
    fn statistics_of_all_markers(&self) -> FeatureStatistics {
        let moments = self.marker_moments();
        let parts = (0..2).map(|axis| {
            let mut counts = ValueCounts::new(MARKER_STEP, (MARKER_RANGE / MARKER_STEP) as usize + 1);
            self.markers.iter().skip(axis).step_by(2).for_each(|x| counts.count_nearest(f64::from(*x)));
            let moments = ValueMoments::merged(moments.iter().skip(axis).step_by(2));
            ValueStatistics { moments, quantile_source: QuantileSource::Counts(counts) }
        });
        self.feature("tactile_marker_motion", &[2], parts.collect())
    }

    fn marker_moments(&self) -> Vec<ValueMoments> {
        let column = |i: usize| self.markers.iter().skip(i).step_by(MARKER_ROW).map(|x| f64::from(*x));
        (0..MARKER_ROW).map(|i| ValueMoments::of(column(i))).collect()
    }
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
