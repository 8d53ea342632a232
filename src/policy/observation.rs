//! Observations: the only data that reach a policy. Hidden state (poses and shapes of objects, deformation, drops,
//! limits) has no field here.

use std::sync::Arc;

use image::RgbImage;

use softvt_geometry::Vec3;
use softvt_sensing::tactile::{
    HISTORY_LENGTH, MARKER_COUNT, Markers, MosaicLayout, PadWrench, Taxels, mosaic, mosaic_cell,
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
}

/// Observation of a control step.
///
/// Proprioception and the prompt are always present; images, touch and forces if [`SensorStreams`] requests them.
/// Poses are in the robot base frame. All streams show the same instant, 20 times per second of simulated time.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Time since the start of the episode, s.
    pub time_s: f64,
    /// Tool position in the robot base frame, m.
    pub ee_position_b: Vec3,
    /// Tool orientation in the base frame as axis-angle, rad.
    pub ee_axis_angle_b: Vec3,
    /// Arm joint angles, rad.
    pub joints: [f64; 7],
    /// Measured gripper width, m: 0 to 0.08 between the apexes of the gels.
    pub gripper_width_m: f64,
    /// Closure last commanded, 0 (open) ..= 1 (closed).
    pub closure: f64,
    /// The instruction.
    pub prompt: String,
    /// Images of the requested cameras, in the order of [`SensorStreams::cameras`].
    pub cameras: Vec<CameraImage>,
    /// Tactile images and markers of the last control steps, if requested.
    pub tactile: Option<TactileHistory>,
    /// True forces at the left and right pad, if requested.
    pub forces: Option<[PadForce; 2]>,
    /// Forces on the left and the right gel in the last 1 to 8 control steps, oldest first, if requested: (x, y, z)
    /// of each, N, in the frame of the pad.
    pub force_history: Vec<[f64; 6]>,
}

/// A camera image: rows from the top, sRGB, 8 bits per channel. A camera that enters an object during an episode sees
/// the scene behind that object's surface; results count such steps as `camera_inside`.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraImage {
    /// Name of the camera.
    pub name: String,
    /// The image in the camera's size, by default 224 × 224.
    pub image: RgbImage,
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
}

impl TactileFrame {
    /// A frame from the output of a sensor. The cell is computed here, while the image is in the processor's cache.
    pub fn new(image: RgbImage, untouched: Arc<RgbImage>, markers: Markers) -> Self {
        Self { cell: mosaic_cell(&image), image, untouched, markers }
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
    /// Current frames of the left and right finger.
    pub fn now(&self) -> Option<&[TactileFrame; 2]> {
        self.frames.last().map(AsRef::as_ref)
    }

    /// The 4 × 4 mosaic of both fingers' images, 224 × 224.
    pub fn mosaic(&self, layout: MosaicLayout) -> RgbImage {
        let [left, right] =
            [0, 1].map(|side| self.frames.iter().map(|frame| &frame[side].cell).collect::<Vec<_>>());
        mosaic([&left, &right], layout)
    }

    /// Marker positions in the shape (1 + 8, 198, 2) of SoftVTBench's policies, px: initial positions of the
    /// left and right markers, then the positions in the last 8 control steps, oldest first. A short history
    /// repeats its oldest frame.
    pub fn marker_motion(&self) -> Vec<[[f32; 2]; 2 * MARKER_COUNT]> {
        let row = |frame: &[TactileFrame; 2], when: usize| -> [[f32; 2]; 2 * MARKER_COUNT] {
            std::array::from_fn(|m| frame[m / MARKER_COUNT].markers.to_array()[when][m % MARKER_COUNT])
        };
        let Some(first) = self.frames.first() else { return Vec::new() };
        let last = (0..HISTORY_LENGTH).filter_map(|place| {
            let frame = self.frames.get((place + self.frames.len()).saturating_sub(HISTORY_LENGTH))?;
            Some(row(frame, 1))
        });
        std::iter::once(row(first, 0)).chain(last).collect()
    }
}
