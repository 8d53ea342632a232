//! What a policy gets and what its numbers mean: plain data that fixes the keys of an observation and the code of an action.

use serde::{Deserialize, Serialize};

use super::SensorStreams;
use crate::sensing::tactile::MosaicLayout;

/// Names of the cameras that every scene has.
const CAMERAS: [&str; 2] = ["third_person", "wrist"];

/// A policy's interface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Name, as in results.
    pub name: String,
    /// What is sent, in order.
    pub inputs: Vec<ProfileInput>,
    /// How replies are read.
    pub actions: ActionEncoding,
}

/// One entry of an observation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProfileInput {
    /// Keys it is sent under.
    pub keys: Vec<String>,
    /// What it is.
    pub source: InputSource,
}

/// Where an entry comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum InputSource {
    /// A camera's picture, uint8 (height, width, 3).
    Camera {
        /// Name of the camera.
        camera: String,
        /// Turned by half a turn in the image, as LIBERO's pictures come.
        half_turn: bool,
    },
    /// Numbers of the robot, float32 (n).
    State {
        /// Its parts, in order.
        parts: Vec<StatePart>,
    },
    /// The instruction, text.
    Prompt,
    /// The 4 × 4 mosaic of the last 8 tactile pictures of both fingers, uint8 (224, 224, 3).
    TactileImage {
        /// Which cells are whose.
        layout: Mosaic,
    },
    /// The last tactile picture of one finger, uint8 (240, 320, 3).
    Tactile {
        /// Which finger.
        finger: Finger,
    },
    /// Initial and last 8 places of the markers of both fingers, float32 (9, 198, 2), px.
    MarkerMotion,
    /// True forces on the left and the right gel in the last 8 control steps, float32 (8, 6), N, pad frame. No real sensor
    /// gives them.
    Force,
}

/// A finger.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Finger {
    /// panda_leftfinger.
    Left,
    /// panda_rightfinger.
    Right,
}

/// [`MosaicLayout`] as data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mosaic {
    /// Left finger above.
    #[default]
    Rows,
    /// Left finger at the left.
    Columns,
}

impl From<Mosaic> for MosaicLayout {
    fn from(layout: Mosaic) -> Self {
        match layout {
            Mosaic::Rows => Self::Rows,
            Mosaic::Columns => Self::Columns,
        }
    }
}

/// A part of a state vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StatePart {
    /// Tool position in the base frame, m (3).
    Position,
    /// Tool orientation in the base frame as axis-angle, rad (3).
    AxisAngle,
    /// The same as a quaternion w, x, y, z with w ≥ 0 (4).
    QuaternionWxyz,
    /// The same as x, y, z, w with w ≥ 0 (4).
    QuaternionXyzw,
    /// Arm joint angles, rad (7).
    Joints,
    /// Distance between the gels, m: 0 to 0.08 (1).
    GripperWidth,
    /// Half of it, the position of one finger, m: 0 to 0.04 (1).
    FingerPosition,
    /// Positions of both fingers as robosuite gives them, m: half the width, and its negative (2).
    FingerPair,
    /// Closure last commanded, 0 to 1 (1).
    Closure,
}

impl StatePart {
    /// How many numbers it is.
    pub fn count(self) -> usize {
        match self {
            Self::Position | Self::AxisAngle => 3,
            Self::QuaternionWxyz | Self::QuaternionXyzw => 4,
            Self::Joints => 7,
            Self::FingerPair => 2,
            Self::GripperWidth | Self::FingerPosition | Self::Closure => 1,
        }
    }
}

/// How an action is coded: three numbers of position, three of orientation, one of the gripper; more are padding.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActionEncoding {
    /// What the first six are.
    pub pose: PoseEncoding,
    /// What the seventh is.
    pub gripper: GripperEncoding,
    /// How an actor's own units become those of `pose`, if they differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<ActionUnits>,
    /// How many numbers an action must have, padding included; any from seven on if none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<usize>,
}

/// `scale · number + offset`, for each of the first six numbers of an action.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActionUnits {
    /// Factors.
    pub scale: [f64; 6],
    /// What is added then, m and rad.
    pub offset: [f64; 6],
}

impl ActionUnits {
    /// Numbers as they are.
    pub const SAME: Self = Self { scale: [1.0; 6], offset: [0.0; 6] };
}

impl ActionEncoding {
    /// A code without units and padding of its own.
    pub fn plain(pose: PoseEncoding, gripper: GripperEncoding) -> Self {
        Self { pose, gripper, units: None, length: None }
    }
}

/// Numbers of an action that are used.
pub const ACTION_LEN: usize = 7;

/// What the first six numbers of an action are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum PoseEncoding {
    /// Tool pose in the base frame: m, and axis-angle in rad.
    Absolute,
    /// Shares −1..=1 of a step away from where the tool is when the action's turn comes, taken in full.
    Delta {
        /// Longest step along each axis, m.
        translation_m: f64,
        /// Longest turn about each axis, rad.
        rotation_rad: f64,
    },
    /// What robosuite's operational-space controller gets: shares −1..=1 of a step away from where the tool is.
    DeltaOsc {
        /// Longest step along each axis, m.
        translation_m: f64,
        /// Longest turn about each axis, rad.
        rotation_rad: f64,
    },
}

/// The gripper's number: one value opens, one shuts, those between do in proportion unless the code is binary.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GripperEncoding {
    /// The value that opens.
    pub open: f64,
    /// The value that shuts.
    pub shut: f64,
    /// Whether anything beyond the middle shuts, and all else opens.
    pub binary: bool,
}

impl GripperEncoding {
    /// The closure that a number means.
    pub fn closure(&self, number: f64) -> f64 {
        // Never −0.
        let share = ((number - self.open) / (self.shut - self.open)).clamp(0.0, 1.0) + 0.0;
        if self.binary { f64::from(u8::from(share > 0.5)) } else { share }
    }

    /// The number that means a closure.
    pub fn number(&self, closure: f64) -> f64 {
        let share = if self.binary { f64::from(u8::from(closure > 0.5)) } else { closure };
        self.open + share * (self.shut - self.open)
    }
}

/// The profiles that come with softvt, with what each is for.
pub const PROFILES: [(&str, &str); 4] = [
    ("vision", "both cameras, state, prompt; absolute pose; gripper open or shut"),
    ("visuo_tactile", "the same with tactile pictures and markers of 8 frames; continuous gripper"),
    ("softvtbench", "the released SoftVTBench client's keys and units, with true forces (force_observed)"),
    ("libero", "LIBERO's: pictures turned by half a turn, 8 numbers of state, delta poses"),
];

impl Profile {
    /// A profile by name.
    pub fn named(name: &str) -> Option<Self> {
        let both = |name: &str| vec![format!("observation/{name}"), name.to_owned()];
        let plain = |camera: &str| InputSource::Camera { camera: camera.to_owned(), half_turn: false };
        let finger = vec![StatePart::Position, StatePart::AxisAngle, StatePart::FingerPosition];
        let input = |keys: Vec<String>, source| ProfileInput { keys, source };
        let mut inputs = vec![
            input(both("image"), plain(CAMERAS[0])),
            input(both("wrist_image"), plain(CAMERAS[1])),
            input(both("state"), InputSource::State { parts: finger }),
            input(vec!["prompt".to_owned()], InputSource::Prompt),
        ];
        let touch = [
            input(both("tactile_image"), InputSource::TactileImage { layout: Mosaic::Rows }),
            input(both("tactile_marker_motion"), InputSource::MarkerMotion),
        ];
        let closure = GripperEncoding { open: 0.0, shut: 1.0, binary: false };
        let absolute = |gripper| ActionEncoding::plain(PoseEncoding::Absolute, gripper);
        let actions = match name {
            "vision" => absolute(GripperEncoding { binary: true, ..closure }),
            "visuo_tactile" => {
                inputs.extend(touch);
                absolute(closure)
            }
            "softvtbench" => {
                inputs.extend(touch);
                inputs.push(input(both("tactile_gripper_force"), InputSource::Force));
                inputs[3].keys.push("observation/prompt".to_owned());
                // The commanded position of either finger.
                absolute(GripperEncoding { open: 0.04, shut: 0.0, binary: false })
            }
            "libero" => {
                let turned =
                    |camera: &str| InputSource::Camera { camera: camera.to_owned(), half_turn: true };
                inputs[0].source = turned(CAMERAS[0]);
                inputs[1].source = turned(CAMERAS[1]);
                let parts = vec![StatePart::Position, StatePart::AxisAngle, StatePart::FingerPair];
                inputs[2].source = InputSource::State { parts };
                inputs[..3].iter_mut().for_each(|input| input.keys.truncate(1));
                ActionEncoding::plain(
                    PoseEncoding::DeltaOsc { translation_m: 0.05, rotation_rad: 0.5 },
                    GripperEncoding { open: -1.0, shut: 1.0, binary: true },
                )
            }
            _ => return None,
        };
        Some(Self { name: name.to_owned(), inputs, actions })
    }

    /// What has to be sensed for it.
    pub fn streams(&self) -> SensorStreams {
        let mut streams = SensorStreams::default();
        for input in &self.inputs {
            match &input.source {
                InputSource::Camera { camera, .. } if !streams.cameras.contains(camera) => {
                    streams.cameras.push(camera.clone());
                }
                InputSource::TactileImage { .. }
                | InputSource::Tactile { .. }
                | InputSource::MarkerMotion => {
                    streams.touch = true;
                }
                InputSource::Force => streams.force = true,
                InputSource::Camera { .. } | InputSource::State { .. } | InputSource::Prompt => {}
            }
        }
        streams
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_profile_exists_under_its_name() {
        for (name, _) in PROFILES {
            assert_eq!(Profile::named(name).map(|p| p.name), Some(name.to_owned()));
        }
        assert_eq!(Profile::named("pi"), None);
    }

    #[test]
    fn only_what_a_profile_sends_is_sensed() {
        let streams = |name| Profile::named(name).unwrap().streams();
        assert_eq!(streams("vision").cameras, CAMERAS);
        assert!(!streams("vision").touch && !streams("visuo_tactile").force);
        assert!(streams("visuo_tactile").touch && streams("softvtbench").force);
    }

    #[test]
    fn grippers_open_and_shut_at_the_ends_of_their_codes() {
        let fingers = Profile::named("softvtbench").unwrap().actions.gripper;
        assert_eq!((fingers.closure(0.04), fingers.closure(0.0), fingers.closure(0.02)), (0.0, 1.0, 0.5));
        assert!(fingers.closure(0.04).is_sign_positive());
        assert_eq!((fingers.closure(0.3), fingers.closure(-1.0)), (0.0, 1.0));
        let libero = Profile::named("libero").unwrap().actions.gripper;
        assert_eq!((libero.closure(-0.2), libero.closure(0.2)), (0.0, 1.0));
        let closure = Profile::named("visuo_tactile").unwrap().actions.gripper;
        assert_eq!(closure.closure(0.37), 0.37);
        for code in [fingers, closure] {
            assert!((code.closure(code.number(0.62)) - 0.62).abs() < 1e-12);
        }
    }
}
