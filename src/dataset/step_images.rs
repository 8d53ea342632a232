//! Images of one step of a rollout, and the 2 × 2 preview of them.

use image::{RgbImage, imageops};

use super::DatasetError;
use crate::{
    rollout::StateRecording,
    scene::Camera,
    sensing::tactile::{MarkerStyle, Markers},
};

/// Cameras that every scene has.
const CAMERAS: [&str; 2] = ["third_person", "wrist"];
/// Cell of a preview, pixels: the size of a tactile image.
const CELL_WIDTH: u32 = 320;
const CELL_HEIGHT: u32 = 240;

/// Camera and tactile images of one state.
#[derive(Clone, Debug)]
pub struct StepImages {
    /// In the order of [`super::layout::IMAGE_STREAMS`].
    pub images: [RgbImage; 4],
    /// In the order of [`super::layout::VIDEO_STREAMS`].
    pub video_frames: [RgbImage; 4],
    /// Marker positions of the left and right finger, px.
    pub markers: [Markers; 2],
}

/// Renders the states of a recording.
pub struct StepRenderer<'a> {
    recording: &'a mut StateRecording,
    cameras: Vec<Camera>,
}

impl<'a> StepRenderer<'a> {
    /// # Errors
    /// The scene lacks the camera `third_person` or `wrist`.
    pub fn new(recording: &'a mut StateRecording) -> Result<Self, DatasetError> {
        let camera = |name: &str| Ok(recording.sensors.camera(name)?.clone());
        let cameras = CAMERAS.into_iter().map(camera).collect::<Result<_, DatasetError>>()?;
        Ok(Self { recording, cameras })
    }

    /// Renders state `step`; `None` after the last state.
    ///
    /// # Errors
    /// A sensor cannot be simulated.
    pub fn render(&mut self, step: usize) -> Result<Option<StepImages>, DatasetError> {
        let Some(frame) = self.recording.frames.get(step) else { return Ok(None) };
        let sensors = &mut self.recording.sensors;
        let third_person = sensors.render(frame, &self.cameras[0])?.into_rgb_image();
        let wrist = sensors.render(frame, &self.cameras[1])?.into_rgb_image();
        let tactile = sensors.tactile_readings(frame)?;
        let [left, right] = [0, 1].map(|side: usize| tactile[side].image.clone());
        let [left_markers, right_markers] =
            [0, 1].map(|side: usize| tactile[side].with_markers(MarkerStyle::Dots));
        Ok(Some(StepImages {
            video_frames: [third_person.clone(), wrist.clone(), left_markers, right_markers],
            images: [third_person, wrist, left, right],
            markers: [0, 1].map(|side: usize| tactile[side].markers),
        }))
    }
}

impl StepImages {
    /// The four video frames in one image, scaled down where they are larger than a cell.
    pub fn preview(&self) -> RgbImage {
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
                resized = imageops::resize(image, edge(w), edge(h), imageops::FilterType::Triangle);
                &resized
            };
            let (w, h) = cell.dimensions();
            let x = at % 2 * CELL_WIDTH + (CELL_WIDTH - w) / 2;
            let y = at / 2 * CELL_HEIGHT + (CELL_HEIGHT - h) / 2;
            imageops::replace(&mut preview, cell, i64::from(x), i64::from(y));
        }
        preview
    }
}
