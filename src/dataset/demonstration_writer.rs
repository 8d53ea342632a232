//! [`DemonstrationWriter`]: renders a recorded rollout into the files of one demonstration.

use std::path::{Path, PathBuf};

use image::RgbImage;
use rust_hdf5::H5Dataset;
use serde_json::Value;

use super::{
    DatasetError, Demonstration,
    hdf5::{ChunkedSteps, Hdf5Writer, write_file},
    layout::IMAGE_STREAMS,
    step_images::{StepImages, StepRenderer},
    video::VideoWriter,
};
use crate::{benchmark::CONTROL_HZ, rollout::StateRecording};

/// Output files of a demonstration. Each appears complete or not at all.
pub struct DemonstrationWriter<'a> {
    /// The HDF5 file, which holds `/data/demo_0`.
    pub hdf5: PathBuf,
    /// Videos, in the order of [`super::layout::VIDEO_STREAMS`].
    pub videos: [PathBuf; 4],
    /// The 2 × 2 preview.
    pub preview: PathBuf,
    /// True to store images in the HDF5 file as well.
    pub store_images: bool,
    /// `env_args` of the HDF5 file.
    pub environment: &'a Value,
}

impl DemonstrationWriter<'_> {
    /// Renders the state before each action and writes all files. The HDF5 file is written last: its presence
    /// marks a complete demonstration.
    ///
    /// # Errors
    /// A sensor cannot be simulated, a file not written, or `is_cancelled` returned true. There is no HDF5 file then.
    pub fn write(
        &self,
        recording: &mut StateRecording,
        mut demonstration: Demonstration,
        is_cancelled: impl Fn() -> bool,
    ) -> Result<(), DatasetError> {
        write_file(&self.hdf5, self.environment, demonstration.steps(), 1, |writer| {
            self.write_contents(writer, recording, &mut demonstration, is_cancelled)
        })
    }

    fn write_contents(
        &self,
        writer: &mut Hdf5Writer,
        recording: &mut StateRecording,
        demonstration: &mut Demonstration,
        is_cancelled: impl Fn() -> bool,
    ) -> Result<(), DatasetError> {
        let (steps, path) = (demonstration.steps(), writer.path);
        writer.write_attributes(0, &demonstration.record, steps)?;
        let mut renderer = StepRenderer::new(recording)?;
        let mut outputs: Option<ImageOutputs> = None;
        let mut markers = Vec::with_capacity(steps);
        for step in 0..steps {
            if is_cancelled() {
                return Err(DatasetError::Interrupted);
            }
            let Some(images) = renderer.render(step)? else { break };
            let outputs = match &mut outputs {
                Some(outputs) => outputs,
                // The sizes of the images are known from the first step on.
                none => none.insert(ImageOutputs::new(&images, writer, steps, self.store_images)?),
            };
            outputs.push(path, &images, step + 1 == steps)?;
            markers.push(images.markers);
        }
        demonstration.set_markers(&markers);
        writer.write_streams(0, demonstration)?;
        outputs.map_or(Ok(()), |outputs| outputs.finish(self))
    }
}

/// Images per chunk, in the order of [`IMAGE_STREAMS`]. Images of the static camera and of the fingers hardly change
/// within four steps and compress better together; those of the wrist camera change in every step.
const IMAGES_PER_CHUNK: [usize; 4] = [4, 1, 4, 4];

/// Writes an image stream to HDF5, chunk by chunk.
struct ImageStreamWriter {
    dataset: H5Dataset,
    name: &'static str,
    images_per_chunk: usize,
    /// Images of the current chunk.
    bytes: Vec<u8>,
    chunks_written: usize,
}

impl ImageStreamWriter {
    fn push(&mut self, path: &Path, image: &RgbImage) -> Result<(), DatasetError> {
        self.bytes.extend_from_slice(image);
        if self.bytes.len() < self.images_per_chunk * image.len() {
            return Ok(());
        }
        self.write_chunk(path)
    }

    fn write_chunk(&mut self, path: &Path) -> Result<(), DatasetError> {
        let written = self.dataset.write_chunk(self.chunks_written, &self.bytes);
        written.map_err(DatasetError::hdf5(path, self.name))?;
        self.chunks_written += 1;
        self.bytes.clear();
        Ok(())
    }

    /// Writes the last chunk, padded with its last image: HDF5 chunks are always full.
    fn finish(&mut self, path: &Path, image_bytes: usize) -> Result<(), DatasetError> {
        while !self.bytes.is_empty() && self.bytes.len() < self.images_per_chunk * image_bytes {
            let last = self.bytes.len() - image_bytes;
            self.bytes.extend_from_within(last..);
        }
        if self.bytes.is_empty() { Ok(()) } else { self.write_chunk(path) }
    }
}

/// Writers that take one image per step.
struct ImageOutputs {
    streams: Vec<ImageStreamWriter>,
    videos: Vec<VideoWriter>,
    preview: VideoWriter,
}

impl ImageOutputs {
    fn new(
        first: &StepImages,
        writer: &mut Hdf5Writer,
        steps: usize,
        store_images: bool,
    ) -> Result<Self, DatasetError> {
        let video =
            |image: &RgbImage| VideoWriter::new(image.width() as usize, image.height() as usize, CONTROL_HZ);
        let mut streams = Vec::new();
        let named = IMAGE_STREAMS.into_iter().zip(&first.images).zip(IMAGES_PER_CHUNK);
        for ((name, image), images_per_chunk) in named.filter(|_| store_images) {
            let images_per_chunk = images_per_chunk.min(steps);
            let length = ChunkedSteps { steps, per_chunk: images_per_chunk };
            let dataset = writer.create_image_dataset(0, name, length, image.width(), image.height())?;
            let bytes = Vec::with_capacity(images_per_chunk * image.len());
            streams.push(ImageStreamWriter { dataset, name, images_per_chunk, bytes, chunks_written: 0 });
        }
        Ok(Self {
            streams,
            videos: first.video_frames.iter().map(video).collect::<Result<_, _>>()?,
            preview: video(&first.preview())?,
        })
    }

    fn push(&mut self, path: &Path, images: &StepImages, is_last: bool) -> Result<(), DatasetError> {
        for (stream, image) in self.streams.iter_mut().zip(&images.images) {
            stream.push(path, image)?;
            if is_last {
                stream.finish(path, image.len())?;
            }
        }
        for (video, frame) in self.videos.iter_mut().zip(&images.video_frames) {
            video.push(frame)?;
        }
        Ok(self.preview.push(&images.preview())?)
    }

    fn finish(self, files: &DemonstrationWriter) -> Result<(), DatasetError> {
        for (video, path) in self.videos.into_iter().zip(&files.videos) {
            video.save(path)?;
        }
        Ok(self.preview.save(&files.preview)?)
    }
}
