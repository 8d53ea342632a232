//! Pictures of a step, and the 2 × 2 preview of them.

use image::{RgbImage, imageops};

use super::DatasetError;
use crate::{
    rollout::StateRecording,
    scene::Camera,
    sensing::tactile::{MarkerStyle, Markers},
};

/// Names of the cameras that every scene has.
const CAMERAS: [&str; 2] = ["third_person", "wrist"];
/// Size of a cell of a preview: a finger's picture fits.
const CELL: [u32; 2] = [320, 240];

/// All that is seen and felt before an action.
#[derive(Clone, Debug)]
pub struct StepImages {
    /// As [`super::layout::IMAGE_STREAMS`].
    pub pictures: [RgbImage; 4],
    /// As [`super::layout::VIDEO_STREAMS`].
    pub shown: [RgbImage; 4],
    /// Places of the left and right finger's markers, px.
    pub markers: [Markers; 2],
}

/// Draws the states of a film.
pub struct StepRenderer<'a> {
    film: &'a mut StateRecording,
    cameras: Vec<Camera>,
}

impl<'a> StepRenderer<'a> {
    /// For a film whose scene has the cameras `third_person` and `wrist`.
    ///
    /// # Errors
    /// It has not.
    pub fn new(film: &'a mut StateRecording) -> Result<Self, DatasetError> {
        let camera = |name: &str| Ok(film.sensors.camera(name)?.clone());
        let cameras = CAMERAS.into_iter().map(camera).collect::<Result<_, DatasetError>>()?;
        Ok(Self { film, cameras })
    }

    /// What is seen and felt in state `step`; none behind the last.
    ///
    /// # Errors
    /// A stream cannot be made.
    pub fn draw(&mut self, step: usize) -> Result<Option<StepImages>, DatasetError> {
        let Some(frame) = self.film.frames.get(step) else { return Ok(None) };
        let senses = &mut self.film.sensors;
        let third = senses.render(frame, &self.cameras[0])?.into_rgb_image();
        let wrist = senses.render(frame, &self.cameras[1])?.into_rgb_image();
        let touched = senses.tactile_readings(frame)?;
        let [left, right] = [0, 1].map(|side: usize| touched[side].with_markers(MarkerStyle::Dots));
        let [bare_left, bare_right] = [0, 1].map(|side: usize| touched[side].picture.clone());
        Ok(Some(StepImages {
            shown: [third.clone(), wrist.clone(), left, right],
            pictures: [third, wrist, bare_left, bare_right],
            markers: [0, 1].map(|side: usize| touched[side].markers),
        }))
    }
}

impl StepImages {
    /// The four pictures of the videos in one.
    pub fn preview(&self) -> RgbImage {
        let [width, height] = CELL;
        let mut sheet = RgbImage::new(2 * width, 2 * height);
        for (at, picture) in (0_u32..).zip(&self.shown) {
            let (w, h) = picture.dimensions();
            let small;
            let cell = if w <= width && h <= height {
                picture
            } else {
                let scale = f64::min(f64::from(width) / f64::from(w), f64::from(height) / f64::from(h));
                let edge = |pixels: u32| ((scale * f64::from(pixels)) as u32).max(1);
                small = imageops::resize(picture, edge(w), edge(h), imageops::FilterType::Triangle);
                &small
            };
            let (w, h) = cell.dimensions();
            let (x, y) = (at % 2 * width + (width - w) / 2, at / 2 * height + (height - h) / 2);
            imageops::replace(&mut sheet, cell, i64::from(x), i64::from(y));
        }
        sheet
    }
}
