//! A finished rollout into the files of one demonstration, each of which appears whole or not at all.

use std::path::{Path, PathBuf};

use image::RgbImage;
use rust_hdf5::H5Dataset;
use serde_json::Value;

use super::{
    DatasetError, Demonstration,
    hdf5::Hdf5Writer,
    layout::{IMAGE_STREAMS, VIDEO_STREAMS},
    step_images::{StepImages, StepRenderer},
    video::VideoWriter,
};
use crate::{benchmark::control::CONTROL_DT, files, rollout::StateRecording};

/// What is written of a demonstration, and where.
pub struct DemonstrationWriter<'a> {
    /// The HDF5 file: it holds `/data/demo_0`.
    pub hdf5: PathBuf,
    /// Videos, as [`VIDEO_STREAMS`].
    pub videos: [PathBuf; 4],
    /// The 2 × 2 preview.
    pub preview: PathBuf,
    /// Whether pictures go into the HDF5 file too.
    pub pictures: bool,
    /// `env_args` of the HDF5 file.
    pub environment: &'a Value,
}

/// Pictures a second: one a control step.
pub fn frame_rate() -> u32 {
    (1.0 / CONTROL_DT).round() as u32
}

impl DemonstrationWriter<'_> {
    /// Draws every state before an action and writes all files; the HDF5 last, so that whoever has it has all.
    ///
    /// # Errors
    /// A stream cannot be made, a file not written, or the end was asked for; the HDF5 file is not there then.
    pub fn write(
        &self,
        film: &mut StateRecording,
        mut demonstration: Demonstration,
        stop: impl Fn() -> bool,
    ) -> Result<(), DatasetError> {
        files::create_folder(self.hdf5.parent().unwrap_or(&self.hdf5))?;
        let aside = files::temp_path(&self.hdf5);
        let written = self.draw(&aside, film, &mut demonstration, stop);
        if written.is_err() {
            // A torn file is of no use, and on a full disk its room is.
            let _ = files::remove_if_present(&aside);
        }
        written?;
        Ok(files::persist(&aside, &self.hdf5)?)
    }

    fn draw(
        &self,
        aside: &Path,
        film: &mut StateRecording,
        demonstration: &mut Demonstration,
        stop: impl Fn() -> bool,
    ) -> Result<(), DatasetError> {
        let mut writer = Hdf5Writer::create(aside, self.environment, demonstration.steps(), 1)?;
        let written = self.fill(&mut writer, film, demonstration, stop);
        writer.close(written)
    }

    fn fill(
        &self,
        writer: &mut Hdf5Writer,
        film: &mut StateRecording,
        demonstration: &mut Demonstration,
        stop: impl Fn() -> bool,
    ) -> Result<(), DatasetError> {
        let (steps, path) = (demonstration.steps(), writer.path);
        writer.describe(0, &demonstration.record, steps)?;
        let mut easel = StepRenderer::new(film)?;
        let mut reels: Option<Reels> = None;
        let mut felt = Vec::with_capacity(steps);
        for step in 0..steps {
            if stop() {
                return Err(DatasetError::Interrupted);
            }
            let Some(scenery) = easel.draw(step)? else { break };
            let reels = match &mut reels {
                Some(reels) => reels,
                none => none.insert(Reels::new(&scenery, writer, steps, self.pictures)?),
            };
            reels.push(path, &scenery, step + 1 == steps)?;
            felt.push(scenery.markers);
        }
        demonstration.set_markers(&felt);
        writer.numbers(0, demonstration)?;
        reels.map_or(Ok(()), |reels| reels.save(self))
    }
}

/// Pictures of a chunk, as [`IMAGE_STREAMS`]: what a resting camera sees, and what a finger feels, hardly changes in four steps; a
/// camera on the hand sees something else in every one.
const ROWS: [usize; 4] = [4, 1, 4, 4];

/// Pictures on their way into an array, chunk by chunk.
struct Roll {
    array: H5Dataset,
    name: &'static str,
    rows: usize,
    bytes: Vec<u8>,
    done: usize,
}

impl Roll {
    fn push(&mut self, path: &Path, picture: &RgbImage) -> Result<(), DatasetError> {
        self.bytes.extend_from_slice(picture);
        if self.bytes.len() < self.rows * picture.len() {
            return Ok(());
        }
        self.flush(path)
    }

    fn flush(&mut self, path: &Path) -> Result<(), DatasetError> {
        self.array.write_chunk(self.done, &self.bytes).map_err(|e| DatasetError::hdf5(path, self.name)(e))?;
        self.done += 1;
        self.bytes.clear();
        Ok(())
    }

    /// Fills the last chunk up with its last picture: HDF5 has none that are not full.
    fn end(&mut self, path: &Path, picture: usize) -> Result<(), DatasetError> {
        while !self.bytes.is_empty() && self.bytes.len() < self.rows * picture {
            let last = self.bytes.len() - picture;
            self.bytes.extend_from_within(last..);
        }
        if self.bytes.is_empty() { Ok(()) } else { self.flush(path) }
    }
}

/// Everything that takes a picture a step.
struct Reels {
    rolls: Vec<Roll>,
    videos: Vec<VideoWriter>,
    preview: VideoWriter,
}

impl Reels {
    fn new(
        scenery: &StepImages,
        writer: &mut Hdf5Writer,
        steps: usize,
        pictures: bool,
    ) -> Result<Self, DatasetError> {
        let video = |picture: &RgbImage| {
            VideoWriter::new(picture.width() as usize, picture.height() as usize, frame_rate())
        };
        let named = IMAGE_STREAMS.into_iter().zip(&scenery.pictures).take(if pictures {
            IMAGE_STREAMS.len()
        } else {
            0
        });
        let roll = |((name, picture), rows): ((&'static str, &RgbImage), usize)| {
            let rows = rows.min(steps);
            let array = writer.pictures(0, name, (steps, rows), picture.dimensions())?;
            Ok(Roll { array, name, rows, bytes: Vec::with_capacity(rows * picture.len()), done: 0 })
        };
        Ok(Self {
            rolls: named.zip(ROWS).map(roll).collect::<Result<_, DatasetError>>()?,
            videos: scenery.shown.iter().map(video).collect::<Result<_, _>>()?,
            preview: video(&scenery.preview())?,
        })
    }

    fn push(&mut self, path: &Path, scenery: &StepImages, last: bool) -> Result<(), DatasetError> {
        for (roll, picture) in self.rolls.iter_mut().zip(&scenery.pictures) {
            roll.push(path, picture)?;
            if last {
                roll.end(path, picture.len())?;
            }
        }
        for (video, picture) in self.videos.iter_mut().zip(&scenery.shown) {
            video.push(picture)?;
        }
        Ok(self.preview.push(&scenery.preview())?)
    }

    fn save(self, to: &DemonstrationWriter) -> Result<(), DatasetError> {
        debug_assert_eq!(self.videos.len(), VIDEO_STREAMS.len());
        for (video, path) in self.videos.into_iter().zip(&to.videos) {
            files::replace(path, &video.finish()?)?;
        }
        Ok(files::replace(&to.preview, &self.preview.finish()?)?)
    }
}
