//! The rows of an episode: at step t what a policy is sent when it is asked at step t, and what was commanded then.

use std::ops::Range;

use image::{
    ExtendedColorType, ImageEncoder, RgbImage,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};

use super::{
    GripperCoding,
    features::{MARKER_SHAPE, PICTURES as KEYS, STATE},
    statistics::{FeatureStatistics, RunningMoments, ValueCounts, ValueStatistics},
};
use crate::{
    dataset::{DatasetError, TaskFile, layout::IMAGE_STREAMS},
    sensing::tactile::{HISTORY_LENGTH, IMAGE_SIZE, MARKER_COUNT, MosaicLayout, mosaic, mosaic_cell},
};

/// Pictures that are unpacked at once: whole chunks of the file.
const BLOCK: usize = 32;
/// Numbers of the markers in a row, and of one state of one finger.
const MARKER_ROW: usize = MARKER_SHAPE[0] * MARKER_SHAPE[1] * MARKER_SHAPE[2];
const PLACES: usize = 2 * MARKER_COUNT;
/// Quantiles of places of markers are taken to this, px, up to the second number.
const MARKER_STEP: f64 = 0.01;
const MARKER_RANGE: f64 = 400.0;

/// The rows of an episode.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EpisodeRows {
    /// How many.
    pub steps: usize,
    /// PNG files, by picture and step.
    pub pictures: [Vec<Vec<u8>>; 3],
    /// steps × 7.
    pub state: Vec<f32>,
    /// steps × 7.
    pub actions: Vec<f32>,
    /// steps × (3, 198, 2).
    pub markers: Vec<f32>,
    /// How often each value occurs in each channel of each picture.
    tallies: [[ValueCounts; 3]; 3],
}

/// Reads a demonstration of `steps` steps whose cameras' pictures have the `sizes` (height, width).
///
/// # Errors
/// A stream is missing, is of another length or shape, or holds what is no number; or the end was asked for.
pub(super) fn read(
    file: &TaskFile,
    (demo, steps): (usize, usize),
    sizes: [[usize; 2]; 2],
    gripper: GripperCoding,
    stop: &(impl Fn() -> bool + ?Sized),
) -> Result<EpisodeRows, DatasetError> {
    let actions = match gripper {
        GripperCoding::Continuous => "actions",
        GripperCoding::Binary => "actions_binary",
    };
    let mut rows = EpisodeRows {
        steps,
        pictures: Default::default(),
        state: numbers(file, (demo, steps), "obs/state", &[STATE])?,
        actions: numbers(file, (demo, steps), actions, &[STATE])?,
        markers: markers(&numbers(
            file,
            (demo, steps),
            "obs/gripper_marker_motion",
            &[2, 2, MARKER_COUNT, 2],
        )?),
        tallies: std::array::from_fn(|_| std::array::from_fn(|_| ValueCounts::new(1.0 / 255.0, 256))),
    };
    let mut felt: [Vec<RgbImage>; 2] = Default::default();
    for from in (0..steps).step_by(BLOCK) {
        if stop() {
            return Err(DatasetError::Interrupted);
        }
        let block = from..steps.min(from + BLOCK);
        let [third, wrist, left, right] = seen(file, (demo, steps), sizes, block.clone())?;
        for (at, ((third, wrist), fingers)) in
            third.into_iter().zip(wrist).zip(left.iter().zip(&right)).enumerate()
        {
            for (cells, picture) in felt.iter_mut().zip([fingers.0, fingers.1]) {
                if cells.len() == HISTORY_LENGTH {
                    cells.remove(0);
                }
                cells.push(mosaic_cell(picture));
            }
            let mosaic = mosaic([&felt[0], &felt[1]], MosaicLayout::Rows);
            for (key, picture) in [third, wrist, mosaic].iter().enumerate() {
                rows.push(key, picture).map_err(|what| {
                    DatasetError::content(
                        file.path(),
                        format!("/data/demo_{demo}, step {}", block.start + at),
                        what,
                    )
                })?;
            }
        }
    }
    Ok(rows)
}

/// What is wrong with the shape of a stream, if it is not of `steps` rows.
fn shaped(
    file: &TaskFile,
    (demo, steps): (usize, usize),
    name: &str,
    row: &[usize],
) -> Result<(), DatasetError> {
    let (found, expected) = (file.shape(demo, name)?, [&[steps], row].concat());
    if found == expected {
        return Ok(());
    }
    let what = format!("expected the shape {expected:?}, got {found:?}");
    Err(DatasetError::content(file.path(), format!("/data/demo_{demo}/{name}"), what))
}

fn numbers(
    file: &TaskFile,
    demo: (usize, usize),
    name: &str,
    row: &[usize],
) -> Result<Vec<f32>, DatasetError> {
    shaped(file, demo, name, row)?;
    let crate::dataset::hdf5::FloatRows { values: numbers, width } = file.float_rows(demo.0, name)?;
    if let Some(at) = numbers.iter().position(|x| !x.is_finite()) {
        let what = format!("step {}: {} is not finite", at / width.max(1), numbers[at]);
        return Err(DatasetError::content(file.path(), format!("/data/demo_{}/{name}", demo.0), what));
    }
    Ok(numbers.into_iter().map(|x| x as f32).collect())
}

/// The four pictures of some steps.
fn seen(
    file: &TaskFile,
    (demo, steps): (usize, usize),
    [third, wrist]: [[usize; 2]; 2],
    block: Range<usize>,
) -> Result<[Vec<RgbImage>; 4], DatasetError> {
    let mut all: [Vec<RgbImage>; 4] = Default::default();
    for (at, (pictures, name)) in all.iter_mut().zip(IMAGE_STREAMS).enumerate() {
        let name = format!("obs/{name}");
        let finger = [IMAGE_SIZE[1], IMAGE_SIZE[0]];
        let [height, width] = [third, wrist, finger, finger][at];
        shaped(file, (demo, steps), &name, &[height, width, 3])?;
        let crate::dataset::hdf5::ImageBlock { bytes, height, width } =
            file.images(demo, &name, block.clone())?;
        let each = bytes.chunks_exact((3 * height * width).max(1));
        *pictures =
            each.filter_map(|b| RgbImage::from_raw(width as u32, height as u32, b.to_vec())).collect();
        if pictures.len() != block.len() {
            let what = format!("{} pictures of steps {block:?}", pictures.len());
            return Err(DatasetError::content(file.path(), format!("/data/demo_{demo}/{name}"), what));
        }
    }
    Ok(all)
}

/// EpisodeRows of (3, 198, 2) out of those of the file: finger, initial and present, marker, (x, y).
fn markers(stored: &[f32]) -> Vec<f32> {
    let steps: Vec<&[f32]> = stored.chunks_exact(4 * PLACES).collect();
    let mut rows = Vec::with_capacity(steps.len() * MARKER_ROW);
    let mut push = |step: &[f32], when: usize| {
        for finger in step.chunks_exact(2 * PLACES) {
            rows.extend_from_slice(&finger[when * PLACES..][..PLACES]);
        }
    };
    for now in 0..steps.len() {
        // A policy's history reaches back so far, and begins with its oldest state.
        push(steps[(now + 1).saturating_sub(HISTORY_LENGTH)], 0);
        push(steps[now.saturating_sub(1)], 1);
        push(steps[now], 1);
    }
    rows
}

/// A picture as a PNG file.
fn png(picture: &RgbImage) -> Result<Vec<u8>, String> {
    let mut file = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Adaptive);
    let (width, height) = picture.dimensions();
    encoder.write_image(picture, width, height, ExtendedColorType::Rgb8).map_err(|e| e.to_string())?;
    Ok(file)
}

impl EpisodeRows {
    fn push(&mut self, key: usize, picture: &RgbImage) -> Result<(), String> {
        for pixel in picture.pixels() {
            for (tally, value) in self.tallies[key].iter_mut().zip(pixel.0) {
                tally.count(usize::from(value));
            }
        }
        self.pictures[key].push(png(picture)?);
        Ok(())
    }

    /// Pictures and vectors as a whole: of pictures each channel, of vectors each number.
    pub(super) fn summaries(&self) -> Vec<FeatureStatistics> {
        let pictures = KEYS.iter().zip(&self.tallies).map(|(name, channels)| {
            self.feature(name, &[3, 1, 1], channels.iter().cloned().map(ValueStatistics::counted).collect())
        });
        let vectors = [("state", &self.state), ("actions", &self.actions)];
        let vectors = vectors.map(|(name, numbers)| {
            let column = |i: usize| numbers.iter().skip(i).step_by(STATE).map(|x| f64::from(*x)).collect();
            self.feature(name, &[STATE], (0..STATE).map(|i| ValueStatistics::of(column(i))).collect())
        });
        pictures.chain(vectors).collect()
    }

    fn feature(&self, name: &'static str, shape: &[usize], parts: Vec<ValueStatistics>) -> FeatureStatistics {
        FeatureStatistics { name, shape: shape.to_vec(), steps: self.steps as u64, parts }
    }

    /// Each number of the markers as a whole, without quantiles.
    pub(super) fn every_marker(&self) -> FeatureStatistics {
        let parts = self.moments().into_iter().map(ValueStatistics::bare).collect();
        self.feature("tactile_marker_motion", &MARKER_SHAPE, parts)
    }

    /// x and y of all markers together.
    pub(super) fn markers_together(&self) -> FeatureStatistics {
        let each = self.moments();
        let parts = (0..2).map(|axis| {
            let mut tally = ValueCounts::new(MARKER_STEP, (MARKER_RANGE / MARKER_STEP) as usize + 1);
            self.markers.iter().skip(axis).step_by(2).for_each(|x| tally.count_nearest(f64::from(*x)));
            ValueStatistics::near(RunningMoments::together(each.iter().skip(axis).step_by(2)), tally)
        });
        self.feature("tactile_marker_motion", &[2], parts.collect())
    }

    fn moments(&self) -> Vec<RunningMoments> {
        let column = |i: usize| self.markers.iter().skip(i).step_by(MARKER_ROW).map(|x| f64::from(*x));
        (0..MARKER_ROW).map(|i| RunningMoments::of(column(i))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_stand_as_in_a_policys_history() {
        // Finger, when and step in one number.
        let step = |t: usize| {
            (0..4).flat_map(move |i| (0..PLACES).map(move |p| (1000 * i + 10 * t) as f32 + (p % 10) as f32))
        };
        let stored: Vec<f32> = (0..10).flat_map(step).collect();
        let rows = markers(&stored);
        assert_eq!(rows.len(), 10 * MARKER_ROW);
        let first = |t: usize, row: usize, finger: usize| rows[t * MARKER_ROW + (2 * row + finger) * PLACES];
        // Initial places are those of the oldest state in the history, seven steps ago.
        assert_eq!([first(0, 0, 0), first(9, 0, 0), first(9, 0, 1)], [0.0, 20.0, 2020.0]);
        assert_eq!([first(0, 1, 0), first(9, 1, 0), first(9, 1, 1)], [1000.0, 1080.0, 3080.0]);
        assert_eq!([first(0, 2, 0), first(9, 2, 0), first(9, 2, 1)], [1000.0, 1090.0, 3090.0]);
        assert_eq!(rows[9 * MARKER_ROW + 1], 21.0, "x and y stay side by side");
    }
}
