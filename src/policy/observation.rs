//! What a policy may see: the only type that reaches it. Hidden state (poses and shapes of objects, deformation, drops,
//! thresholds) has no field here.

use std::sync::Arc;

use image::RgbImage;

use crate::{
    geometry::Vec3,
    sensing::tactile::{
        HISTORY_LENGTH, MARKER_COUNT, Markers, MosaicLayout, PadWrench, Taxels, mosaic, mosaic_cell,
    },
};

/// The streams that somebody looks at; others are never computed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SensorStreams {
    /// Cameras of the scene, by name.
    pub cameras: Vec<String>,
    /// The tactile sensors.
    pub touch: bool,
    /// True forces at the pads. No real sensor gives them: results of whoever asks are marked `force_observed`.
    pub force: bool,
}

/// What a policy sees at a control step.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Time since the policy took over, s.
    pub time_s: f64,
    /// Tool position in the robot base frame, m.
    pub ee_position_b: Vec3,
    /// Tool orientation in the base frame as axis-angle, rad.
    pub ee_axis_angle_b: Vec3,
    /// Arm joint angles, rad.
    pub joints: [f64; 7],
    /// Measured gripper width, m: 0 to 0.08 between the apexes of the gels.
    pub gripper_width_m: f64,
    /// Closure last commanded, 0 (open) ..= 1 (shut).
    pub closure: f64,
    /// The instruction.
    pub prompt: String,
    /// Pictures of the cameras asked for, in the order of [`SensorStreams::cameras`].
    pub cameras: Vec<CameraImage>,
    /// What the fingers felt, if asked for.
    pub touch: Option<TactileHistory>,
    /// True forces at the left and right pad, if asked for.
    pub forces: Option<[PadForce; 2]>,
    /// Resultants of the last control steps, oldest first, 1 to 8, if asked for: force on the left and the right gel, N, in the
    /// frame of the pad.
    pub force_history: Vec<[f64; 6]>,
}

/// A camera's picture: rows from the top, RGB, 8 bits a channel, sRGB. A camera that gets inside of something during an
/// episode, on the hand or in the world, sees what is beyond that thing; results count such steps as `camera_inside`.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraImage {
    /// Name of the camera.
    pub name: String,
    /// The picture; its size is the camera's, 224 × 224 unless the scene says otherwise.
    pub image: RgbImage,
}

/// One finger's sensor at one control step.
#[derive(Clone, Debug, PartialEq)]
pub struct TactileFrame {
    /// The colour picture, 320 × 240; `docs/tactile.md` draws its frame.
    pub image: RgbImage,
    /// The same as it stands in the mosaic, 56 × 56.
    pub cell: RgbImage,
    /// The picture of the untouched gel.
    pub untouched: Arc<RgbImage>,
    /// Initial and present places of the 11 × 9 markers, row by row, (x, y) px: the shape (2, 99, 2).
    pub markers: Markers,
}

/// The last control steps of both fingers.
#[derive(Clone, Debug, PartialEq)]
pub struct TactileHistory {
    /// Left and right finger, oldest first; 1 to 8 frames.
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
    /// A camera's picture by name.
    pub fn camera(&self, name: &str) -> Option<&RgbImage> {
        self.cameras.iter().find(|camera| camera.name == name).map(|camera| &camera.image)
    }
}

impl TactileFrame {
    /// What a sensor gives. The cell is made here, while the picture is still in the processor's cache.
    pub fn new(image: RgbImage, untouched: Arc<RgbImage>, markers: Markers) -> Self {
        Self { cell: mosaic_cell(&image), image, untouched, markers }
    }

    /// How far each channel of each pixel is from the untouched picture, 0 to 255.
    pub fn change(&self) -> RgbImage {
        let mut change = self.image.clone();
        for (value, rest) in change.iter_mut().zip(self.untouched.iter()) {
            *value = value.abs_diff(*rest);
        }
        change
    }
}

impl TactileHistory {
    /// Left and right finger now.
    pub fn now(&self) -> Option<&[TactileFrame; 2]> {
        self.frames.last().map(AsRef::as_ref)
    }

    /// The 4 × 4 mosaic of both fingers' pictures, 224 × 224.
    pub fn mosaic(&self, layout: MosaicLayout) -> RgbImage {
        let [left, right] =
            [0, 1].map(|side| self.frames.iter().map(|frame| &frame[side].cell).collect::<Vec<_>>());
        mosaic([&left, &right], layout)
    }

    /// The shape (1 + 8, 198, 2) of SoftVTBench's policies: initial places of the left and right markers, then the
    /// present ones of the last 8 control steps, oldest first; a short history starts with its oldest frame.
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
