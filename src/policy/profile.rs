//! Profiles: which data a policy receives under which keys, and how its actions are encoded.

use serde::{Deserialize, Serialize};

use super::{EncodedGrip, GripHysteresis, JOINT_NAMES, SensorStreams, StatePart};
use softvt_robot::{GripTarget, Side};
use softvt_scene::STANDARD_CAMERAS;
use softvt_sensing::tactile::{HISTORY_LENGTH, MarkerStyle, TactileMosaicLayout};

/// Interface of a policy: the entries of its observations and the encoding of its actions.
///
/// Plain data: it comes from [`Profile::named`] or a Lua file and is written to the results of a run.
/// [`encode`](super::encode) builds the observation of a profile, [`decode`](super::decode) reads its actions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    pub name: String,
    /// Entries of an observation, in order.
    pub inputs: Vec<ProfileInput>,
    pub actions: ActionEncoding,
    /// True to send an observation in every control step, also in those in which no action is needed.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub observe_every_step: bool,
}

/// Maximum number of control steps of an input.
pub const MAX_FRAMES: usize = 32;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProfileInput {
    /// Keys under which it is sent.
    pub keys: Vec<String>,
    pub source: ObservationSource,
    /// Number of control steps in the entry, the present one last, along its first axis. `None`: the present step
    /// alone without that axis, or all 8 steps of markers and forces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<usize>,
}

impl ProfileInput {
    pub fn new(keys: Vec<String>, source: ObservationSource) -> Self {
        Self { keys, source, frames: None }
    }

    pub fn steps(&self) -> usize {
        let default = match self.source {
            ObservationSource::MarkerMotion | ObservationSource::Force => HISTORY_LENGTH,
            _ => 1,
        };
        self.frames.unwrap_or(default)
    }

    pub fn shortest_key(&self) -> &str {
        self.keys.iter().min_by_key(|key| key.len()).map_or("", String::as_str)
    }
}

/// Content of an entry: its source, numpy type and shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum ObservationSource {
    /// A camera image, uint8 (height, width, 3).
    Camera {
        camera: String,
        /// True to rotate the image by 180°, as in LIBERO's data.
        half_turn: bool,
    },
    /// Depth of a camera image along the optical axis, m, float32 (height, width); infinite in the background.
    Depth { camera: String, half_turn: bool },
    /// Object at each pixel of a camera image, uint16 (height, width): its number in the scene, from 1; 0 in the
    /// background, [`ROBOT_SEGMENTATION_ID`](softvt_scene::ROBOT_SEGMENTATION_ID) for the robot.
    Segmentation { camera: String, half_turn: bool },
    /// State of the robot, float32 (n).
    State {
        /// Parts of the vector, in order.
        parts: Vec<StatePart>,
    },
    /// The instruction, text.
    Prompt,
    /// The 4 × 4 mosaic of the last 8 tactile images of both fingers, uint8 (224, 224, 3).
    TactileImage {
        layout: TactileMosaicLayout,
        /// Style in which the markers are drawn into the images; `None` for images without markers.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        markers: Option<MarkerStyle>,
    },
    /// The last tactile image of one finger, uint8 (240, 320, 3).
    Tactile {
        finger: Side,
        /// Style in which the markers are drawn into the image; `None` for an image without markers.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        markers: Option<MarkerStyle>,
    },
    /// Initial and last positions of the markers of both fingers, float32 (1 + frames, 198, 2), px.
    MarkerMotion,
    /// True forces on the left and the right gel in the last control steps, float32 (frames, 6), N, pad frame. No
    /// real sensor measures them.
    Force,
    /// Identity of the request, a map; see [`QueryId`](super::QueryId).
    Query,
    /// Seed of the request for policies that draw random numbers, an integer below 2³²; see
    /// [`QueryId::seed`](super::QueryId::seed).
    QuerySeed,
}

/// Encoding of an action: numbers for the motion of the arm and one for the gripper. Further numbers are padding.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActionEncoding {
    /// Meaning of the numbers before the gripper's.
    pub pose: PoseEncoding,
    pub gripper: GripperValues,
    /// Conversion of the first numbers to the units of `pose`, if they differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<ActionUnits>,
    /// Required length of an action including padding. `None` accepts that without padding, and 32 as
    /// openpi's models pad them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<usize>,
}

/// Affine conversion `scale · number + offset` of the numbers of an action before the gripper's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActionUnits {
    pub scale: Vec<f64>,
    /// Offsets, m and rad.
    pub offset: Vec<f64>,
}

impl ActionUnits {
    pub fn to_si(&self, index: usize, number: f64) -> f64 {
        self.factor(index) * number + self.origin(index)
    }

    pub fn from_si(&self, index: usize, value: f64) -> f64 {
        (value - self.origin(index)) / self.factor(index)
    }

    // Numbers that a file leaves out are not converted.
    fn factor(&self, index: usize) -> f64 {
        self.scale.get(index).copied().unwrap_or(1.0)
    }

    fn origin(&self, index: usize) -> f64 {
        self.offset.get(index).copied().unwrap_or(0.0)
    }
}

impl ActionEncoding {
    /// An encoding in SI units without a fixed length.
    pub fn new(pose: PoseEncoding, gripper: GripperValues) -> Self {
        Self { pose, gripper, units: None, length: None }
    }

    /// Numbers of an action without padding: the motion's, and one of the gripper.
    pub fn numbers(&self) -> usize {
        self.pose.numbers() + 1
    }

    /// Names of the numbers of an action without padding.
    pub fn names(&self) -> Vec<&'static str> {
        let motion = match self.pose {
            PoseEncoding::Joints => JOINT_NAMES.as_slice(),
            _ => POSE_NAMES.as_slice(),
        };
        let grip = if self.gripper.code == GripCode::Force { "grip_force" } else { "gripper" };
        motion.iter().copied().chain([grip]).collect()
    }
}

/// Names of the numbers of an action that give a pose or a displacement.
pub const POSE_NAMES: [&str; 6] = ["x", "y", "z", "axis_angle_x", "axis_angle_y", "axis_angle_z"];

/// Meaning of the numbers of an action before the gripper's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum PoseEncoding {
    /// Tool pose in the base frame: position, m, and axis-angle, rad.
    Absolute,
    /// Positions of the seven arm joints, rad.
    Joints,
    /// Displacement from the measured tool pose, each number −1..=1 times the limit of its axis. The displaced
    /// pose is commanded; the drives cover a part of the way within the step.
    Delta {
        /// Largest translation along each axis, m.
        translation_m: f64,
        /// Largest rotation about each axis, rad.
        rotation_rad: f64,
    },
    /// The same displacement, executed as robosuite's operational-space controller does; see [`osc`](super::osc).
    DeltaOsc {
        /// Largest translation along each axis, m.
        translation_m: f64,
        /// Largest rotation about each axis, rad.
        rotation_rad: f64,
    },
}

impl PoseEncoding {
    /// All names, in the order of the documentation.
    pub const NAMES: [&str; 4] = ["absolute", "delta", "delta_osc", "joints"];

    pub fn numbers(self) -> usize {
        match self {
            Self::Joints => JOINT_NAMES.len(),
            Self::Absolute | Self::Delta { .. } | Self::DeltaOsc { .. } => POSE_NAMES.len(),
        }
    }

    /// Name in files and in the metadata of servers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Absolute => "absolute",
            Self::Joints => "joints",
            Self::Delta { .. } => "delta",
            Self::DeltaOsc { .. } => "delta_osc",
        }
    }
}

/// Grip code: what the last number of an action commands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum GripCode {
    /// Closure, 0 open to 1 closed.
    #[default]
    #[value(help = None::<&str>)]
    Continuous,
    /// Open, or closed with the whole effort of the hand.
    #[value(help = None::<&str>)]
    Binary,
    /// Open, or the closure of the answers just after closing, held until an answer opens.
    #[value(help = None::<&str>)]
    TwoWidth,
    /// Grip force, N, at which closing stops; opens below 0.
    #[value(help = None::<&str>)]
    Force,
}

impl GripCode {
    /// All codes, in the order of the documentation.
    pub const ALL: [Self; 4] = [Self::Continuous, Self::Binary, Self::TwoWidth, Self::Force];

    pub fn name(self) -> &'static str {
        match self {
            Self::Continuous => "continuous",
            Self::Binary => "binary",
            Self::TwoWidth => "two-width",
            Self::Force => "force",
        }
    }

    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|code| code.name() == name)
    }
}

/// Meaning of the gripper's number: the grip code, and the values for open and closed. Values in between mean
/// proportional closures, unless the code is binary.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GripperValues {
    /// Value of the open gripper. For [`GripCode::Force`] any value below 0 opens.
    pub open: f64,
    /// Value of the closed gripper. For [`GripCode::Force`] values are forces, N.
    pub closed: f64,
    pub code: GripCode,
    /// For [`GripCode::Binary`]: hysteresis, instead of the middle between both values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latch: Option<GripHysteresis>,
}

/// Share of its range by which a grip value may lie outside: answers of learned policies overshoot a little.
const GRIP_OVERSHOOT: f64 = 0.1;
/// Largest magnitude of a closure outside of 0..=1.
const MAX_CLOSURE: f64 = 1e3;

impl GripperValues {
    /// Grip forces in N; below 0 opens.
    pub const FORCE: Self = Self { open: -1.0, closed: 1.0, code: GripCode::Force, latch: None };

    /// Closures between the values of the open and the closed gripper.
    pub const fn new(open: f64, closed: f64) -> Self {
        Self { open, closed, code: GripCode::Continuous, latch: None }
    }

    pub fn command(&self, value: f64) -> EncodedGrip {
        if let (GripCode::Binary, Some(GripHysteresis { close, open, hold_steps })) = (self.code, self.latch)
        {
            let towards_closed = |limit: f64| (value - limit) * (self.closed - self.open) >= 0.0;
            let towards_open = |limit: f64| (value - limit) * (self.closed - self.open) <= 0.0;
            let closes = match (towards_closed(close), towards_open(open)) {
                (true, _) => Some(true),
                (false, true) => Some(false),
                (false, false) => None,
            };
            return EncodedGrip::Latched { closes, hold_steps };
        }
        match self.code {
            GripCode::TwoWidth => EncodedGrip::TwoWidth(self.closure(value)),
            GripCode::Force if value >= 0.0 => EncodedGrip::Target(GripTarget::Force(value)),
            _ => EncodedGrip::Target(GripTarget::Closure(self.closure(value))),
        }
    }

    /// Closure of a value, 0 (open) ..= 1 (closed). A value is clamped to its range, but one that is beyond it
    /// by more than a tenth is likely a mistake: its closure is outside of 0..=1, the episode counts it, and
    /// the hand clamps it.
    pub fn closure(&self, value: f64) -> f64 {
        let share = (value - self.open) / (self.closed - self.open);
        let is_mistake = !(-GRIP_OVERSHOOT..=1.0 + GRIP_OVERSHOOT).contains(&share);
        if is_mistake && self.code != GripCode::Force {
            return share.clamp(-MAX_CLOSURE, MAX_CLOSURE);
        }
        // Adding 0.0 turns −0.0 into 0.0.
        let share = share.clamp(0.0, 1.0) + 0.0;
        match self.code {
            GripCode::Binary => f64::from(u8::from(share > 0.5)),
            GripCode::Force => f64::from(u8::from(value >= 0.0)),
            GripCode::Continuous | GripCode::TwoWidth => share,
        }
    }

    /// The same values in another code. `None` if the codes have no values in common: a force says
    /// nothing about a closure.
    pub fn with_code(self, code: GripCode) -> Option<Self> {
        match (self.code, code) {
            (own, code) if own == code => Some(self),
            (_, GripCode::Force) => Some(Self::FORCE),
            (GripCode::Force, _) => None,
            _ => Some(Self { code, latch: None, ..self }),
        }
    }
}

pub const PROFILES: [(&str, &str); 9] = [
    ("vision", "both cameras, state, prompt; absolute pose; gripper open or closed (binary)"),
    (
        "vision_drives",
        "vision with the exact finger position and the commanded closure, whose gap is the grip force; continuous gripper",
    ),
    ("visuo_tactile", "vision plus tactile images and markers of 8 frames; continuous gripper"),
    ("vision_joints", "vision with joint positions in state and actions; continuous gripper"),
    ("visuo_tactile_joints", "visuo_tactile with joint positions in state and actions"),
    ("softvtbench", "keys and units of the released SoftVTBench client, with true forces (force_observed)"),
    (
        "softvtbench_v02",
        "those of SoftVTBench's release v0.2: markers of 2 steps, drawn into the tactile images",
    ),
    ("softvtbench_v02_latched", "the same with its gripper: open or closed fully, with hysteresis"),
    ("libero", "LIBERO's interface: images rotated by 180°, 8 state numbers, delta poses"),
];

impl Profile {
    pub fn named(name: &str) -> Option<Self> {
        let both = |name: &str| vec![format!("observation/{name}"), name.to_owned()];
        let plain = |camera: &str| ObservationSource::Camera { camera: camera.to_owned(), half_turn: false };
        let state = |names: &[&str]| ObservationSource::State {
            parts: names.iter().filter_map(|name| StatePart::named(name)).collect(),
        };
        let pose_and = |hand: &[&'static str]| state(&[&["position", "axis_angle"], hand].concat());
        // SoftVTBench's interfaces and LIBERO's have the exact position of the fingers.
        let finger = match name {
            "vision" | "visuo_tactile" | "vision_joints" | "visuo_tactile_joints" => "sensed_finger_position",
            _ => "finger_position",
        };
        let input = ProfileInput::new;
        let mut inputs = vec![
            input(both("image"), plain(STANDARD_CAMERAS[0])),
            input(both("wrist_image"), plain(STANDARD_CAMERAS[1])),
            input(both("state"), pose_and(&[finger])),
            input(vec!["prompt".to_owned()], ObservationSource::Prompt),
        ];
        let mosaic = |markers| ObservationSource::TactileImage { layout: TactileMosaicLayout::Rows, markers };
        let tactile = [
            input(both("tactile_image"), mosaic(None)),
            input(both("tactile_marker_motion"), ObservationSource::MarkerMotion),
        ];
        let force = || input(both("tactile_gripper_force"), ObservationSource::Force);
        // Finger positions, m.
        let fingers = |code| GripperValues { code, ..GripperValues::new(0.04, 0.0) };
        let closure = GripperValues::new(0.0, 1.0);
        let absolute = |gripper| ActionEncoding::new(PoseEncoding::Absolute, gripper);
        let actions = match name {
            "vision" => absolute(GripperValues { code: GripCode::Binary, ..closure }),
            "vision_drives" => {
                inputs[2].source = pose_and(&["finger_position", "closure"]);
                absolute(closure)
            }
            "visuo_tactile" => {
                inputs.extend(tactile);
                absolute(closure)
            }
            "vision_joints" | "visuo_tactile_joints" => {
                inputs[2].source = state(&["joints", finger]);
                if name == "visuo_tactile_joints" {
                    inputs.extend(tactile);
                }
                ActionEncoding::new(PoseEncoding::Joints, closure)
            }
            "softvtbench" => {
                inputs.extend(tactile);
                inputs.push(force());
                inputs[3].keys.push("observation/prompt".to_owned());
                absolute(fingers(GripCode::Continuous))
            }
            "softvtbench_v02" | "softvtbench_v02_latched" => {
                inputs.push(input(both("tactile_image"), mosaic(Some(MarkerStyle::BlackArrows))));
                let motion = input(both("tactile_marker_motion"), ObservationSource::MarkerMotion);
                inputs.push(ProfileInput { frames: Some(2), ..motion });
                inputs.push(force());
                let latch = GripHysteresis { close: 0.0398, open: 0.03995, hold_steps: 10 };
                absolute(match name {
                    "softvtbench_v02" => fingers(GripCode::Continuous),
                    _ => GripperValues { latch: Some(latch), ..fingers(GripCode::Binary) },
                })
            }
            "libero" => {
                let turned =
                    |camera: &str| ObservationSource::Camera { camera: camera.to_owned(), half_turn: true };
                inputs[0].source = turned(STANDARD_CAMERAS[0]);
                inputs[1].source = turned(STANDARD_CAMERAS[1]);
                inputs[2].source = pose_and(&["finger_pair"]);
                inputs[..3].iter_mut().for_each(|input| input.keys.truncate(1));
                ActionEncoding::new(
                    PoseEncoding::DeltaOsc { translation_m: 0.05, rotation_rad: 0.5 },
                    GripperValues { code: GripCode::Binary, ..GripperValues::new(-1.0, 1.0) },
                )
            }
            _ => return None,
        };
        inputs.push(input(vec!["softvt".to_owned()], ObservationSource::Query));
        inputs.push(input(vec!["__softvtbench_rng_seed".to_owned()], ObservationSource::QuerySeed));
        Some(Self { name: name.to_owned(), inputs, actions, observe_every_step: false })
    }

    pub fn streams(&self) -> SensorStreams {
        let mut streams = SensorStreams::default();
        for input in &self.inputs {
            let past_steps = input.steps() - 1;
            streams.past_steps = streams.past_steps.max(past_steps);
            match &input.source {
                ObservationSource::Camera { camera, .. }
                | ObservationSource::Depth { camera, .. }
                | ObservationSource::Segmentation { camera, .. } => {
                    streams.past_images = streams.past_images.max(past_steps);
                    if !streams.cameras.contains(camera) {
                        streams.cameras.push(camera.clone());
                    }
                    streams.depth |= matches!(input.source, ObservationSource::Depth { .. });
                    streams.segmentation |= matches!(input.source, ObservationSource::Segmentation { .. });
                }
                ObservationSource::TactileImage { .. }
                | ObservationSource::Tactile { .. }
                | ObservationSource::MarkerMotion => {
                    streams.tactile = true;
                }
                ObservationSource::Force => streams.force = true,
                ObservationSource::State { .. }
                | ObservationSource::Prompt
                | ObservationSource::Query
                | ObservationSource::QuerySeed => {}
            }
        }
        streams
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_profile_has_its_name() {
        for (name, _) in PROFILES {
            assert_eq!(Profile::named(name).map(|p| p.name), Some(name.to_owned()));
        }
        assert_eq!(Profile::named("pi"), None);
    }

    #[test]
    fn actions_in_joint_positions_have_eight_named_numbers() {
        for name in ["vision_joints", "visuo_tactile_joints"] {
            let Profile { inputs, actions, .. } = Profile::named(name).unwrap();
            assert_eq!((actions.numbers(), actions.names().len()), (8, 8));
            assert_eq!(actions.names()[6..], ["joint_7", "gripper"]);
            let ObservationSource::State { parts } = &inputs[2].source else { panic!("{inputs:?}") };
            assert_eq!(
                parts.iter().map(|part| part.name()).collect::<Vec<_>>(),
                ["joints", "sensed_finger_position"]
            );
        }
        assert_eq!(Profile::named("libero").unwrap().actions.numbers(), 7);
    }

    #[test]
    fn streams_are_those_of_the_inputs() {
        let streams = |name| Profile::named(name).unwrap().streams();
        assert_eq!(streams("vision").cameras, STANDARD_CAMERAS);
        assert!(!streams("vision").tactile && !streams("visuo_tactile").force);
        assert!(streams("visuo_tactile").tactile && streams("softvtbench").force);
        let visuo_tactile = streams("visuo_tactile");
        assert_eq!((visuo_tactile.past_steps, visuo_tactile.past_images), (7, 0));
    }

    #[test]
    fn grippers_open_and_close_at_the_ends_of_their_ranges() {
        let fingers = Profile::named("softvtbench").unwrap().actions.gripper;
        assert_eq!((fingers.closure(0.04), fingers.closure(0.0), fingers.closure(0.02)), (0.0, 1.0, 0.5));
        assert!(fingers.closure(0.04).is_sign_positive());
        assert_eq!((fingers.closure(0.042), fingers.closure(-0.001)), (0.0, 1.0), "an overshoot");
        let libero = Profile::named("libero").unwrap().actions.gripper;
        assert_eq!((libero.closure(-0.2), libero.closure(0.2)), (0.0, 1.0));
        let closure = Profile::named("visuo_tactile").unwrap().actions.gripper;
        assert_eq!(closure.closure(0.37), 0.37);
    }

    #[test]
    fn values_far_outside_of_their_range_give_closures_outside() {
        let closure = Profile::named("visuo_tactile").unwrap().actions.gripper;
        assert_eq!([255.0, -3.0, 1.05, -0.05].map(|x| closure.closure(x)), [255.0, -3.0, 1.0, 0.0]);
        let binary = Profile::named("vision").unwrap().actions.gripper;
        assert_eq!([255.0, -3.0, 0.7].map(|x| binary.closure(x)), [255.0, -3.0, 1.0]);
        assert_eq!(closure.closure(1e300), 1e3);
        assert_eq!(GripperValues::FORCE.command(9.0), EncodedGrip::Target(GripTarget::Force(9.0)));
    }

    #[test]
    fn files_name_the_grip_code_and_those_without_it_are_read() {
        let binary = Profile::named("vision").unwrap().actions.gripper;
        let text = serde_json::to_string(&binary).unwrap();
        assert_eq!(text, r#"{"open":0.0,"closed":1.0,"code":"binary"}"#);
        assert_eq!(serde_json::from_str::<GripperValues>(&text).unwrap(), binary);
        let widths = binary.with_code(GripCode::TwoWidth).unwrap();
        let text = serde_json::to_string(&widths).unwrap();
        assert_eq!(serde_json::from_str::<GripperValues>(&text).unwrap(), widths);
        assert_eq!(GripCode::named("two-width"), Some(GripCode::TwoWidth));
        assert_eq!(GripCode::named("twowidth"), None);
    }

    #[test]
    fn a_latched_gripper_has_two_limits() {
        let gripper = Profile::named("softvtbench_v02_latched").unwrap().actions.gripper;
        let closes = |value| match gripper.command(value) {
            EncodedGrip::Latched { closes, hold_steps: 10 } => closes,
            other => panic!("{other:?}"),
        };
        assert_eq!(
            [0.0, 0.0398, 0.0399, 0.03995, 0.04].map(closes),
            [Some(true), Some(true), None, Some(false), Some(false)]
        );
        let text = serde_json::to_string(&gripper).unwrap();
        assert_eq!(serde_json::from_str::<GripperValues>(&text).unwrap(), gripper);
        assert_eq!(gripper.with_code(GripCode::Binary), Some(gripper));
        assert_eq!(gripper.with_code(GripCode::Continuous).unwrap().latch, None);
    }

    #[test]
    fn every_code_reads_its_own_values() {
        let fingers = Profile::named("softvtbench").unwrap().actions.gripper;
        let of = |code, value| fingers.with_code(code).unwrap().command(value);
        assert_eq!(of(GripCode::Continuous, 0.01), EncodedGrip::Target(GripTarget::Closure(0.75)));
        assert_eq!(of(GripCode::Binary, 0.01), EncodedGrip::Target(GripTarget::Closure(1.0)));
        assert_eq!(of(GripCode::TwoWidth, 0.01), EncodedGrip::TwoWidth(0.75));
        assert_eq!(of(GripCode::Force, 4.5), EncodedGrip::Target(GripTarget::Force(4.5)));
        assert_eq!(GripperValues::FORCE.with_code(GripCode::Continuous), None);
    }
}
