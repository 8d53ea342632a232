//! [`DemonstrationWriter`]: renders a recorded rollout into the files of one demonstration.

use std::{
    borrow::Cow,
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use image::RgbImage;
use rust_hdf5::H5Dataset;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::{
    DatasetError, OptionalStream,
    hdf5::{ChunkedSteps, Hdf5Writer, write_file, write_text_attributes},
    stream::DIGEST,
    streams::{self, DEPTH_FLAG, DEPTHS, IMAGES, Rollout, StreamSpec},
};
use softvt_benchmark::CONTROL_HZ;
use softvt_common::text::hex;
use softvt_media::video::VideoWriter;
use softvt_policy::NumberType;
use softvt_robot::tactile::IMAGE_SIZE;
use softvt_rollout::{FinishedEpisode, StateRecording};
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
    /// True to store the true state.
    pub has_privileged: bool,
    pub streams: &'a BTreeSet<OptionalStream>,
    /// `env_args` of the HDF5 file.
    pub environment: &'a Value,
}

impl DemonstrationWriter<'_> {
    /// Renders the state before each action of a rollout with a state recording and a trace, and writes all files.
    /// `is_closed` has one entry per control step: true if the gripper is commanded to hold. The HDF5 file is written
    /// last: its presence marks a complete demonstration.
    ///
    /// # Errors
    /// A sensor cannot be simulated, a file not written, or `is_cancelled` returned true. There is no HDF5 file then.
    pub fn write(
        &self,
        finished: &FinishedEpisode,
        recording: &mut StateRecording,
        is_closed: &[bool],
        is_cancelled: impl Fn() -> bool,
    ) -> Result<(), DatasetError> {
        write_file(&self.hdf5, self.environment, finished.actions.len(), 1, |writer| {
            self.write_contents(writer, finished, recording, is_closed, is_cancelled)
        })
    }

    fn write_contents(
        &self,
        writer: &mut Hdf5Writer,
        finished: &FinishedEpisode,
        recording: &mut StateRecording,
        is_closed: &[bool],
        is_cancelled: impl Fn() -> bool,
    ) -> Result<(), DatasetError> {
        let (steps, path) = (finished.actions.len(), writer.path);
        writer.write_attributes(0, &finished.record)?;
        let mut renderer = StepRenderer::new(recording, self.has_stream(DEPTH_FLAG))?;
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
        let rollout = Rollout::new(finished, recording, is_closed, &markers);
        for stream in rollout.streams(self.has_privileged, |flag| self.has_stream(flag)) {
            writer.write_stream(0, steps, &stream)?;
        }
        outputs.map_or(Ok(()), |outputs| outputs.finish(self))
    }

    fn has_stream(&self, flag: &str) -> bool {
        self.streams.iter().any(|stream| stream.name() == flag)
    }
}

/// Images per chunk, in the order of [`IMAGES`]. Images of the static camera and of the fingers hardly change
/// within four steps and compress better together; those of the wrist camera change in every step.
const IMAGES_PER_CHUNK: [usize; 4] = [4, 1, 4, 4];

/// Writes a stream of images or depth to HDF5, chunk by chunk.
struct ImageStreamWriter {
    dataset: H5Dataset,
    name: &'static str,
    images_per_chunk: usize,
    /// Images of the current chunk; numbers are little-endian.
    bytes: Vec<u8>,
    chunks_written: usize,
    /// Of all images so far.
    hash: Sha256,
}

impl ImageStreamWriter {
    /// A stream of images, or of depth, of the size of `image`.
    fn create(
        writer: &mut Hdf5Writer,
        spec: &StreamSpec,
        image: &RgbImage,
        length: ChunkedSteps,
    ) -> Result<Self, DatasetError> {
        let size = [image.height() as usize, image.width() as usize];
        let (row_shape, shuffle_stride) = match spec.number_type {
            // Within a chunk the values of one pixel in successive images are stored next to each other, so that static
            // parts of the image compress well.
            NumberType::U8 if length.per_chunk > 1 => (vec![size[0], size[1], 3], image.len()),
            NumberType::U8 => (vec![size[0], size[1], 3], 1),
            NumberType::F32 | NumberType::F64 => (size.to_vec(), size_of::<f32>()),
        };
        let key = format!("data/demo_0/{}", spec.path);
        let dataset = writer.create_dataset(&key, spec.number_type, length, &row_shape, shuffle_stride)?;
        write_text_attributes(writer.path, &key, &dataset, &spec.attributes)?;
        let images_per_chunk = length.per_chunk;
        let hash = Sha256::new();
        Ok(Self { dataset, name: spec.path, images_per_chunk, bytes: Vec::new(), chunks_written: 0, hash })
    }

    fn push(&mut self, path: &Path, image: &[u8], is_last: bool) -> Result<(), DatasetError> {
        self.hash.update(image);
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
        if is_last {
            let digest = hex(&self.hash.finalize_reset());
            write_text_attributes(path, self.name, &self.dataset, &[(DIGEST, digest)])?;
        }
        Ok(())
    }
}

/// Writers that take one image per step.
struct ImageOutputs {
    /// Images, if they are stored, then depth.
    streams: Vec<ImageStreamWriter>,
    stores_images: bool,
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
        let images = IMAGES.into_iter().zip(&first.images).zip(IMAGES_PER_CHUNK);
        let depths = DEPTHS.into_iter().zip(&first.images).zip(IMAGES_PER_CHUNK);
        let images = images.filter(|_| files.store_images);
        let mut streams = Vec::new();
        for ((name, image), per_chunk) in images.chain(depths.filter(|_| files.has_stream(DEPTH_FLAG))) {
            let Some(spec) = streams::named(name) else { continue };
            let length = ChunkedSteps { steps, per_chunk: per_chunk.min(steps) };
            streams.push(ImageStreamWriter::create(writer, &spec, image, length)?);
        }
        Ok(Self {
            streams,
            stores_images: files.store_images,
            videos: first.video_frames.iter().map(video).collect::<Result<_, _>>()?,
            preview: video(&first.preview())?,
        })
    }

    fn push(&mut self, path: &Path, images: &StepImages, is_last: bool) -> Result<(), DatasetError> {
        let stored = images.images.iter().filter(|_| self.stores_images);
        let stored = stored.map(|image| Cow::Borrowed(image.as_raw().as_slice()));
        let depths = images.depths.iter().map(|depth| depth.iter().flat_map(|m| m.to_le_bytes()).collect());
        for (stream, bytes) in self.streams.iter_mut().zip(stored.chain(depths)) {
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
    /// In the order of [`IMAGES`].
    images: [RgbImage; 4],
    /// In the order of [`DEPTHS`], m; empty if depth is not asked for.
    depths: [Vec<f32>; 2],
    /// In the order of [`super::layout::VIDEO_STREAMS`].
    video_frames: [RgbImage; 4],
    /// Marker positions of the left and right finger, px.
    markers: [Markers; 2],
}

struct StepRenderer<'a> {
    recording: &'a mut StateRecording,
    cameras: Vec<Camera>,
    has_depth: bool,
}

impl<'a> StepRenderer<'a> {
    fn new(recording: &'a mut StateRecording, has_depth: bool) -> Result<Self, DatasetError> {
        let camera = |name: &str| Ok(recording.sensors.camera(name)?.clone());
        let cameras = STANDARD_CAMERAS.into_iter().map(camera).collect::<Result<_, DatasetError>>()?;
        Ok(Self { recording, cameras, has_depth })
    }

    /// Renders state `step`; `None` after the last state.
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
