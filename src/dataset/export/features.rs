//! Features of a row, as every format stores them: what a policy observes at a step, and the action commanded then.

use serde_json::{Value, json};

use super::{ArmControl, ExportJob, selection::ImageSize};
use softvt_policy::{JOINT_NAMES, ROBOT_STREAMS, profile::GripCode};
use softvt_sensing::tactile::MARKER_COUNT;

/// Shape of the markers of a row: initial, previous and present positions; both fingers; x and y.
pub(super) const MARKER_SHAPE: [usize; 3] = [3, 2 * MARKER_COUNT, 2];
pub(super) const MARKER_ROW: usize = MARKER_SHAPE[0] * MARKER_SHAPE[1] * MARKER_SHAPE[2];

#[derive(Clone, Debug)]
pub(super) struct Feature {
    /// Name in the data of openpi and SoftVTBench, which is its key in LeRobot v2.1.
    pub name: &'static str,
    /// Key in LeRobot v3.0, for which LeRobot's own policies look. Empty for a feature that LeRobot's data do not have.
    pub lerobot: &'static str,
    pub content: Content,
    pub shape: Vec<usize>,
    /// Names of its components, or of its axes.
    pub components: Value,
    pub about: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    /// An image: 0 and 1 of the cameras, 2 for the mosaic of the fingers.
    Image(usize),
    Vector,
    Markers,
    Action,
}

/// Meaning of the joint positions that are observed in addition to the state.
const JOINT_STATE: &str = "measured positions of the seven joints of the arm (rad)";

pub(super) fn all(job: &ExportJob<'_>) -> Vec<Feature> {
    let control = job.config.control;
    let [third_person, wrist, mosaic] = job.selection.feature_sizes();
    let image = |name, lerobot, index, ImageSize { height, width }, about: &str| Feature {
        name,
        lerobot,
        content: Content::Image(index),
        shape: vec![height, width, 3],
        components: json!(["height", "width", "channel"]),
        about: about.to_owned(),
    };
    let vector = |name, lerobot, components: Vec<&str>, about: &str| Feature {
        name,
        lerobot,
        content: Content::Vector,
        shape: vec![components.len()],
        components: json!(components),
        about: about.to_owned(),
    };
    let arm_and = |last| [control.motion_names(), &[last]].concat();
    let mut features = vec![
        image("image", "observation.images.third_person", 0, third_person, "image of the third-person camera"),
        image("wrist_image", "observation.images.wrist", 1, wrist, "image of the wrist camera"),
        image(
            "tactile_image",
            "observation.images.tactile_image",
            2,
            mosaic,
            "4 × 4 cells: the last 8 images of the left finger above, of the right finger below",
        ),
        vector("state", "observation.state", arm_and("finger"), &state(control)),
        vector("joint_state", "", JOINT_NAMES.to_vec(), JOINT_STATE),
        Feature {
            content: Content::Action,
            ..vector("actions", "action", arm_and("closure"), &action(control, job.selection.gripper))
        },
        Feature {
            name: "tactile_marker_motion",
            lerobot: "observation.tactile_marker_motion",
            content: Content::Markers,
            shape: MARKER_SHAPE.to_vec(),
            components: json!(["time", "marker", "xy"]),
            about: "(3, 198, 2) px: initial marker positions, those of the previous step and of this one; left finger first"
                .to_owned(),
        },
    ];
    let has = |flag: &str| job.selection.streams.iter().any(|stream| stream.name() == flag);
    for stream in ROBOT_STREAMS {
        if let (Some(recorded), Some(exported)) = (&stream.recorded, &stream.exported)
            && recorded.flag.is_none_or(has)
        {
            features.push(vector(
                exported.name,
                exported.lerobot,
                exported.components.to_vec(),
                exported.about,
            ));
        }
    }
    features
}

/// The state of a row, in words.
fn state(control: ArmControl) -> String {
    let arm = match control {
        ArmControl::Pose => "tool position (m), axis-angle (rad) in the robot's base frame",
        ArmControl::Joints => "positions of the seven joints of the arm (rad)",
    };
    format!("{arm}; position of one finger, 0 closed to 0.04 m")
}

/// The action of a row, in words.
fn action(control: ArmControl, gripper: GripCode) -> String {
    let motion = match control {
        ArmControl::Pose => "absolute tool position and axis-angle",
        ArmControl::Joints => "commanded joint positions (rad)",
    };
    let gripper = match gripper {
        GripCode::Continuous => "the commanded closure, 0 open to 1 closed",
        GripCode::Binary => "1 while the gripper is commanded to hold, else 0",
        GripCode::TwoWidth => {
            "closure 0 while open, the median commanded closure of the demonstration while closed"
        }
        GripCode::Force => "grip force in N while closed, -1 while open",
    };
    format!("{motion}; {gripper}")
}
