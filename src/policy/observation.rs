//! Observations: the only data that reach a policy. Hidden state (poses and shapes of objects, deformation, drops,
//! limits) has no field here.

use std::sync::Arc;

use image::RgbImage;

use super::RobotState;
use softvt_sensing::tactile::{
    HISTORY_LENGTH, MARKER_COUNT, MarkerStyle, Markers, PadWrench, TactileMosaicLayout, Taxels, mosaic,
    mosaic_cell,
};

/// Sensor streams of an observation. Streams that are not requested are never computed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SensorStreams {
    /// Names of the scene's cameras whose images are requested.
    pub cameras: Vec<String>,
    /// True to request images and markers of the tactile sensors.
    pub tactile: bool,
    /// True to request the true forces at the pads. No real sensor measures them, so
    /// results are marked `force_observed`.
    pub force: bool,
    /// True to request the depth of every pixel of the cameras.
    pub depth: bool,
    /// True to request the object at every pixel of the cameras.
    pub segmentation: bool,
    /// Number of earlier control steps whose robot state is requested.
    pub past_steps: usize,
    /// Number of earlier control steps whose camera images are requested, at most `past_steps`.
    pub past_images: usize,
}

/// Observation of a control step.
///
/// Proprioception and the prompt are always present; images, touch and forces if [`SensorStreams`] requests them.
/// Poses are in the robot base frame. All streams show the same instant, 20 times per second of simulated time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observation {
    /// Time since the start of the episode, s.
    pub time_s: f64,
    pub robot: RobotState,
    pub prompt: String,
    /// Images of the requested cameras, in the order of [`SensorStreams::cameras`].
    pub cameras: Vec<Arc<CameraImage>>,
    /// The last [`SensorStreams::past_steps`] control steps before this one, oldest first; fewer at the
    /// start of an episode.
    pub past: Vec<PastStep>,
    /// Tactile images and markers of the last control steps, if requested.
    pub tactile: Option<TactileHistory>,
    /// True forces at the left and right pad, if requested.
    pub forces: Option<[PadForce; 2]>,
    /// Forces on the left and the right gel in the last 1 to 8 control steps, oldest first, if requested: (x, y, z)
    /// of each, N, in the frame of the pad.
    pub force_history: Vec<[f64; 6]>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct PastStep {
    pub robot: RobotState,
    /// Images of the requested cameras; empty if only the state of this step was requested.
    pub cameras: Vec<Arc<CameraImage>>,
}

/// A camera image: rows from the top, sRGB, 8 bits per channel. A camera that enters an object during an episode sees
/// the scene behind that object's surface; results count such steps as `camera_inside`.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraImage {
    pub name: String,
    /// The image in the camera's size, by default 224 × 224.
    pub image: RgbImage,
    /// Depth along the optical axis, m, height × width, if requested; infinite in the background.
    pub depth: Option<Vec<f32>>,
    /// Object at each pixel, height × width, if requested: its number in the scene, from 1; 0 in the background,
    /// 1000 for the robot.
    pub segmentation: Option<Vec<u16>>,
}

/// One finger's sensor at one control step.
#[derive(Clone, Debug, PartialEq)]
pub struct TactileFrame {
    /// The colour image, 320 × 240; `docs/tactile.md` shows its frame.
    pub image: RgbImage,
    /// The image scaled to a cell of the mosaic, 56 × 56.
    pub cell: RgbImage,
    /// The image without contact.
    pub untouched: Arc<RgbImage>,
    /// Initial and current positions of the 11 × 9 markers, row by row, (x, y) px: the shape (2, 99, 2).
    pub markers: Markers,
}

/// Tactile data of both fingers in the last control steps.
#[derive(Clone, Debug, PartialEq)]
pub struct TactileHistory {
    /// Left and right finger; 1 to 8 frames, oldest first.
    pub frames: Vec<Arc<[TactileFrame; 2]>>,
}

/// True force on one gel.
#[derive(Clone, Debug, PartialEq)]
pub struct PadForce {
    /// Force (N) and moment about the apex (N m) on the gel, pad frame.
    pub wrench: PadWrench,
    /// Pressure and shear maps, Pa.
    pub taxels: Taxels,
}

impl Observation {
    /// Image of a camera by name, `None` if it was not requested.
    pub fn camera(&self, name: &str) -> Option<&RgbImage> {
        self.cameras.iter().find(|camera| camera.name == name).map(|camera| &camera.image)
    }

    /// The robot's state in the last `count` control steps, this one last. A short past repeats its oldest step.
    pub fn robot_states(&self, count: usize) -> Vec<&RobotState> {
        let all: Vec<_> = self.past.iter().map(|step| &step.robot).chain([&self.robot]).collect();
        last(&all, count)
    }

    /// A camera's image in the last `count` control steps, this one last. A short past, or one of which fewer images
    /// were requested ([`SensorStreams::past_images`]), repeats its oldest image. Empty if none was requested.
    pub fn camera_images(&self, name: &str, count: usize) -> Vec<&CameraImage> {
        let steps = self.past.iter().map(|step| &step.cameras).chain([&self.cameras]);
        let all: Vec<&CameraImage> = steps
            .filter_map(|cameras| cameras.iter().find(|camera| camera.name == name).map(Arc::as_ref))
            .collect();
        last(&all, count)
    }
}

impl TactileFrame {
    /// A frame from the output of a sensor. The cell is computed here, while the image is in the processor's cache.
    pub fn new(image: RgbImage, untouched: Arc<RgbImage>, markers: Markers) -> Self {
        Self { cell: mosaic_cell(&image), image, untouched, markers }
    }

    pub fn with_markers(&self, style: MarkerStyle) -> RgbImage {
        let mut image = self.image.clone();
        self.markers.draw(&mut image, style);
        image
    }

    /// Absolute difference from the image without contact, per pixel and channel.
    pub fn change(&self) -> RgbImage {
        let mut change = self.image.clone();
        for (value, rest) in change.iter_mut().zip(self.untouched.iter()) {
            *value = value.abs_diff(*rest);
        }
        change
    }
}

impl TactileHistory {
    pub fn now(&self) -> Option<&[TactileFrame; 2]> {
        self.frames.last().map(AsRef::as_ref)
    }

    /// The 4 × 4 mosaic of both fingers' images, 224 × 224, with the markers drawn in a style if there is one.
    pub fn mosaic(&self, layout: TactileMosaicLayout, markers: Option<MarkerStyle>) -> RgbImage {
        let frames = self.last(HISTORY_LENGTH);
        let drawn = markers.map(|style| {
            [0, 1].map(|side| {
                frames.iter().map(|frame| mosaic_cell(&frame[side].with_markers(style))).collect()
            })
        });
        let cells: [Vec<&RgbImage>; 2] = match &drawn {
            Some(drawn) => drawn.each_ref().map(|cells: &Vec<RgbImage>| cells.iter().collect()),
            None => [0, 1].map(|side| frames.iter().map(|frame| &frame[side].cell).collect()),
        };
        mosaic([&cells[0], &cells[1]], layout)
    }

    /// The frames of the last `count` control steps, oldest first. A short history repeats its oldest frame.
    pub fn last(&self, count: usize) -> Vec<&[TactileFrame; 2]> {
        last(&self.frames.iter().map(Arc::as_ref).collect::<Vec<_>>(), count)
    }

    /// Marker positions in the shape (1 + count, 198, 2) of SoftVTBench's policies, px: initial positions of the
    /// left and right markers, then the positions in the last `count` control steps, oldest first. A short history
    /// repeats its oldest frame.
    pub fn marker_motion(&self, count: usize) -> Vec<[[f32; 2]; 2 * MARKER_COUNT]> {
        let row = |frame: &[TactileFrame; 2], when: usize| -> [[f32; 2]; 2 * MARKER_COUNT] {
            std::array::from_fn(|m| frame[m / MARKER_COUNT].markers.to_array()[when][m % MARKER_COUNT])
        };
        let Some(first) = self.frames.first() else { return Vec::new() };
        let last = self.last(count).into_iter().map(|frame| row(frame, 1));
        std::iter::once(row(first, 0)).chain(last).collect()
    }
}

/// The last `count` entries. Too few begin with copies of the oldest.
pub(crate) fn last<T: Copy>(all: &[T], count: usize) -> Vec<T> {
    (0..count).filter_map(|place| all.get((place + all.len()).saturating_sub(count)).copied()).collect()
}
