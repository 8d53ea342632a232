//! [`DemonstrationWriter`]: renders a recorded rollout into the files of one demonstration.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use image::RgbImage;
use rust_hdf5::H5Dataset;
use serde_json::Value;

use super::{
    DatasetError, Demonstration, OptionalStream,
    hdf5::{ChunkedSteps, Hdf5Writer, write_file},
    layout::{DEPTH_STREAMS, IMAGE_STREAMS},
};
use softvt_benchmark::CONTROL_HZ;
use softvt_media::video::VideoWriter;
use softvt_robot::tactile::IMAGE_SIZE;
use softvt_rollout::StateRecording;
use softvt_scene::{Camera, STANDARD_CAMERAS};
use softvt_sensing::{
    camera::{RenderedImage, resize},
    tactile::{MarkerStyle, Markers},
};

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
    /// Further streams of the HDF5 file.
    pub streams: &'a BTreeSet<OptionalStream>,
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
        let mut renderer = StepRenderer::new(recording, self.streams.contains(&OptionalStream::Depth))?;
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
                none => none.insert(ImageOutputs::new(&images, writer, steps, self)?),
            };
            outputs.push(path, &images, step + 1 == steps)?;
            markers.push(images.markers);
        }
        demonstration.set_markers(&markers);
        if self.streams.contains(&OptionalStream::JointTorques) {
            demonstration.set_joint_torques(&renderer.recording.joint_torques);
        }
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
    /// Images of the current chunk; numbers are little-endian.
    bytes: Vec<u8>,
    chunks_written: usize,
}

impl ImageStreamWriter {
    fn push(&mut self, path: &Path, image: &[u8], is_last: bool) -> Result<(), DatasetError> {
        self.bytes.extend_from_slice(image);
        let chunk_bytes = self.images_per_chunk * image.len();
        // HDF5 chunks are always full: the last one is padded with its last image.
        while is_last && self.bytes.len() < chunk_bytes {
            self.bytes.extend_from_slice(image);
        }
        if self.bytes.len() == chunk_bytes {
            let written = self.dataset.write_chunk(self.chunks_written, &self.bytes);
            written.map_err(DatasetError::hdf5(path, self.name))?;
            self.chunks_written += 1;
            self.bytes.clear();
        }
        Ok(())
    }
}

/// Writers that take one image per step.
struct ImageOutputs {
    streams: Vec<ImageStreamWriter>,
    depths: Vec<ImageStreamWriter>,
    videos: Vec<VideoWriter>,
    preview: VideoWriter,
}

impl ImageOutputs {
    fn new(
        first: &StepImages,
        writer: &mut Hdf5Writer,
        steps: usize,
        files: &DemonstrationWriter,
    ) -> Result<Self, DatasetError> {
        let video =
            |image: &RgbImage| VideoWriter::new(image.width() as usize, image.height() as usize, CONTROL_HZ);
        let mut streams = Vec::new();
        let named = IMAGE_STREAMS.into_iter().zip(&first.images).zip(IMAGES_PER_CHUNK);
        for ((name, image), images_per_chunk) in named.filter(|_| files.store_images) {
            let images_per_chunk = images_per_chunk.min(steps);
            let length = ChunkedSteps { steps, per_chunk: images_per_chunk };
            let dataset = writer.create_image_dataset(0, name, length, image.width(), image.height())?;
            let bytes = Vec::with_capacity(images_per_chunk * image.len());
            streams.push(ImageStreamWriter { dataset, name, images_per_chunk, bytes, chunks_written: 0 });
        }
        let mut depths = Vec::new();
        let named = DEPTH_STREAMS.into_iter().zip(&first.images).zip(IMAGES_PER_CHUNK);
        let has_depth = files.streams.contains(&OptionalStream::Depth);
        for ((name, image), images_per_chunk) in named.filter(|_| has_depth) {
            let images_per_chunk = images_per_chunk.min(steps);
            let length = ChunkedSteps { steps, per_chunk: images_per_chunk };
            let dataset = writer.create_depth_dataset(0, name, length, image.width(), image.height())?;
            depths.push(ImageStreamWriter {
                dataset,
                name,
                images_per_chunk,
                bytes: Vec::new(),
                chunks_written: 0,
            });
        }
        Ok(Self {
            streams,
            depths,
            videos: first.video_frames.iter().map(video).collect::<Result<_, _>>()?,
            preview: video(&first.preview())?,
        })
    }

    fn push(&mut self, path: &Path, images: &StepImages, is_last: bool) -> Result<(), DatasetError> {
        for (stream, image) in self.streams.iter_mut().zip(&images.images) {
            stream.push(path, image, is_last)?;
        }
        for (stream, depth) in self.depths.iter_mut().zip(&images.depths) {
            let bytes: Vec<u8> = depth.iter().flat_map(|metres| metres.to_le_bytes()).collect();
            stream.push(path, &bytes, is_last)?;
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

/// Cell of a preview, pixels: the size of a tactile image.
const CELL_WIDTH: u32 = IMAGE_SIZE[0] as u32;
const CELL_HEIGHT: u32 = IMAGE_SIZE[1] as u32;

/// Camera and tactile images of one state.
#[derive(Clone, Debug)]
struct StepImages {
    /// In the order of [`IMAGE_STREAMS`].
    images: [RgbImage; 4],
    /// In the order of [`DEPTH_STREAMS`], m; empty if depth is not asked for.
    depths: [Vec<f32>; 2],
    /// In the order of [`super::layout::VIDEO_STREAMS`].
    video_frames: [RgbImage; 4],
    /// Marker positions of the left and right finger, px.
    markers: [Markers; 2],
}

/// Renders the states of a recording.
struct StepRenderer<'a> {
    recording: &'a mut StateRecording,
    cameras: Vec<Camera>,
    has_depth: bool,
}

impl<'a> StepRenderer<'a> {
    /// # Errors
    /// The scene lacks the camera `third_person` or `wrist`.
    fn new(recording: &'a mut StateRecording, has_depth: bool) -> Result<Self, DatasetError> {
        let camera = |name: &str| Ok(recording.sensors.camera(name)?.clone());
        let cameras = STANDARD_CAMERAS.into_iter().map(camera).collect::<Result<_, DatasetError>>()?;
        Ok(Self { recording, cameras, has_depth })
    }

    /// Renders state `step`; `None` after the last state.
    ///
    /// # Errors
    /// A sensor cannot be simulated.
    fn render(&mut self, step: usize) -> Result<Option<StepImages>, DatasetError> {
        let Some(frame) = self.recording.frames.get(step) else { return Ok(None) };
        let sensors = &mut self.recording.sensors;
        let mut rendered = match self.has_depth {
            true => [sensors.render(frame, &self.cameras[0])?, sensors.render(frame, &self.cameras[1])?],
            false => {
                [sensors.render_rgb(frame, &self.cameras[0])?, sensors.render_rgb(frame, &self.cameras[1])?]
            }
        };
        let depths = rendered.each_mut().map(|image| std::mem::take(&mut image.depth));
        let [third_person, wrist] = rendered.map(RenderedImage::into_rgb_image);
        let tactile = sensors.tactile_readings(frame)?;
        let [left, right] = [0, 1].map(|side: usize| tactile[side].image.clone());
        let [left_markers, right_markers] =
            [0, 1].map(|side: usize| tactile[side].with_markers(MarkerStyle::Dots));
        Ok(Some(StepImages {
            video_frames: [third_person.clone(), wrist.clone(), left_markers, right_markers],
            images: [third_person, wrist, left, right],
            depths,
            markers: [0, 1].map(|side: usize| tactile[side].markers),
        }))
    }
}

impl StepImages {
    /// The four video frames in one image, scaled down where they are larger than a cell.
    fn preview(&self) -> RgbImage {
        let mut preview = RgbImage::new(2 * CELL_WIDTH, 2 * CELL_HEIGHT);
        for (at, image) in (0_u32..).zip(&self.video_frames) {
            let (w, h) = image.dimensions();
            let resized;
            let cell = if w <= CELL_WIDTH && h <= CELL_HEIGHT {
                image
            } else {
                let scale =
                    f64::min(f64::from(CELL_WIDTH) / f64::from(w), f64::from(CELL_HEIGHT) / f64::from(h));
                let edge = |pixels: u32| ((scale * f64::from(pixels)) as u32).max(1);
                resized = resize(image, edge(w), edge(h));
                &resized
            };
            let (w, h) = cell.dimensions();
            let x = at % 2 * CELL_WIDTH + (CELL_WIDTH - w) / 2;
            let y = at / 2 * CELL_HEIGHT + (CELL_HEIGHT - h) / 2;
            let (stride, width, first) = (6 * CELL_WIDTH as usize, 3 * w as usize, 3 * x as usize);
            let rows = preview.chunks_exact_mut(stride).skip(y as usize).zip(cell.chunks_exact(width.max(1)));
            rows.for_each(|(to, from)| to[first..first + width].copy_from_slice(from));
        }
        preview
    }
}
