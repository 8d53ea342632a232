//! [`EpisodeData`]: the rows of an episode with their statistics, ready to be written.

use image::{ImageError, RgbImage};

use super::{
    features::INDEX_FEATURES,
    parquet_table::{ColumnValues, EmbeddedImage},
    statistics::{FeatureStatistics, QuantileSource, ValueCounts, ValueMoments, ValueStatistics},
    version::LeRobotVersion,
};
use crate::{
    DatasetError,
    export::{
        ExportJob,
        demo_reader::DemoReader,
        features::{Content, Feature, MARKER_ROW, MARKER_SHAPE},
        selection::SelectedDemo,
    },
};
use softvt_benchmark::CONTROL_HZ;
use softvt_sensing::camera::encode_png;

/// Resolution and range of the counts from which quantiles of marker positions are taken, px.
const MARKER_STEP: f64 = 0.01;
const MARKER_RANGE: f64 = 400.0;

/// Writes the files of a layout, episode by episode.
pub(super) trait LerobotEpisodeWriter: Send {
    fn add(&mut self, episode: EpisodeData<'_>) -> Result<(), DatasetError>;
    fn finish(self: Box<Self>) -> Result<(), DatasetError>;
}

pub(super) struct EpisodeData<'a> {
    pub index: usize,
    pub demo: &'a SelectedDemo,
    /// Columns of its table, in the order of the features.
    pub columns: Vec<ColumnValues>,
    pub statistics: Vec<FeatureStatistics>,
}

impl<'a> EpisodeData<'a> {
    pub(super) fn read(
        job: &ExportJob<'_>,
        features: &[Feature],
        version: LeRobotVersion,
        index: usize,
        demo: &'a SelectedDemo,
    ) -> Result<Self, DatasetError> {
        let steps = demo.entry.num_samples;
        let reader = DemoReader::open(demo)?;
        // Numbers first: what is wrong with them is known before the images are decompressed.
        let stored = features.iter().filter_map(|feature| Some((feature, version.key(feature)?)));
        let numbers =
            stored.clone().map(|(feature, _)| reader.numbers(job, feature)).collect::<Result<Vec<_>, _>>()?;
        let mut images = [(); 3].map(|()| Some(ImageColumn::new()));
        reader.for_each_step(job, |step, step_images| {
            let mut columns = images.iter_mut().flatten().zip(&step_images);
            columns.try_for_each(|(column, image)| column.push(image, version.image_name(step)))
        })?;
        let timestamps: Vec<f32> =
            (0..steps).map(|step| (step as f64 / f64::from(CONTROL_HZ)) as f32).collect();
        let constant = |number: usize| vec![number as i64; steps];
        let counted = |from: usize| (from..from + steps).map(|i| i as i64).collect();
        let indices: [Vec<i64>; 4] =
            [counted(0), constant(index), counted(demo.first_frame), constant(demo.prompt)];

        let mut episode = Self { index, demo, columns: Vec::new(), statistics: Vec::new() };
        for ((feature, key), numbers) in stored.zip(numbers) {
            match feature.content {
                Content::Image(index) => {
                    let Some(ImageColumn { images, counts }) = images[index].take() else { continue };
                    let parts = counts.into_iter().map(ValueStatistics::counted).collect();
                    episode.push(key, &[3, 1, 1], parts, ColumnValues::Images(images));
                }
                Content::Markers => {
                    let (shape, parts) = match version {
                        LeRobotVersion::V21 => (&MARKER_SHAPE[..], statistics_per_marker(&numbers)),
                        LeRobotVersion::V30 => (&[2][..], statistics_of_all_markers(&numbers)),
                    };
                    episode.push(key, shape, parts, ColumnValues::F32(numbers));
                }
                Content::Vector | Content::Action => {
                    let length = feature.shape[0];
                    let column = |i: usize| numbers.iter().skip(i).step_by(length).map(|x| f64::from(*x));
                    let parts = (0..length).map(|i| ValueStatistics::of(column(i).collect())).collect();
                    episode.push(key, &[length], parts, ColumnValues::F32(numbers));
                }
            }
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

struct ImageColumn {
    images: Vec<EmbeddedImage>,
    counts: [ValueCounts; 3],
}

impl ImageColumn {
    fn new() -> Self {
        let counts = std::array::from_fn(|_| ValueCounts::new(1.0 / 255.0, 256));
        Self { images: Vec::new(), counts }
    }

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
