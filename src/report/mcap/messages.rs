//! Messages of one record each: images, joints, numbers and log lines.

use foxglove::{
    Encode,
    messages::{
        CameraCalibration, CompressedImage, JointState, JointStates, Log, Pose as PoseMessage, Quaternion,
        Timestamp, Vector3, log::Level,
    },
};
use image::RgbImage;

use softvt_geometry::Pose;
use softvt_media::jpeg::encode_jpeg;
use softvt_physics::world::WorldSnapshot;
use softvt_policy::RobotState;
use softvt_rollout::{Sensors, StateDeformation};
use softvt_runs::record::EpisodeRecord;
use softvt_scene::Camera;

/// Quality of the images, 1 to 100.
const JPEG_QUALITY: u8 = 90;

#[derive(Encode)]
pub(super) struct Gripper {
    /// True width, m.
    width_m: f64,
    /// Normal force on the left pad, N.
    left_force_n: f64,
    /// Normal force on the right pad, N.
    right_force_n: f64,
}

impl Gripper {
    pub(super) fn new(frame: &WorldSnapshot, robot: &RobotState) -> Self {
        let [left, right] = Sensors::pad_forces(frame).map(|force| force.wrench.normal());
        Self { width_m: robot.gripper_width_m, left_force_n: left, right_force_n: right }
    }
}

/// Deformation of the target whose D is the largest share of its limit.
#[derive(Encode)]
pub(super) struct Deformation {
    /// Largest D in the control step, % of the settled diagonal.
    d_pct: f64,
    /// Its limit τ, %; not a number without a limit.
    tau_pct: f64,
    d_over_tau: f64,
}

impl From<StateDeformation> for Deformation {
    fn from(StateDeformation { d_pct, tau_pct }: StateDeformation) -> Self {
        let tau_pct = tau_pct.unwrap_or(f64::NAN);
        Self { d_pct, tau_pct, d_over_tau: d_pct / tau_pct }
    }
}

pub(super) fn timestamp(time_ns: u64) -> Option<Timestamp> {
    Some(Timestamp::new((time_ns / 1_000_000_000) as u32, (time_ns % 1_000_000_000) as u32))
}

pub(super) fn translation(pose: &Pose) -> Vector3 {
    let t = pose.translation.vector;
    Vector3 { x: t.x, y: t.y, z: t.z }
}

pub(super) fn rotation(pose: &Pose) -> Quaternion {
    let q = pose.rotation;
    Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }
}

pub(super) fn pose(pose: &Pose) -> Option<PoseMessage> {
    Some(PoseMessage { position: Some(translation(pose)), orientation: Some(rotation(pose)) })
}

/// A compressed image seen from the frame `frame_id`.
pub(super) fn image(image: &RgbImage, frame_id: &str, time_ns: u64) -> CompressedImage {
    CompressedImage {
        timestamp: timestamp(time_ns),
        frame_id: frame_id.to_owned(),
        data: encode_jpeg(image, JPEG_QUALITY).unwrap_or_default().into(),
        format: "jpeg".to_owned(),
    }
}

/// The matrices of a camera without distortion.
pub(super) fn calibration(camera: &Camera, time_ns: u64) -> CameraCalibration {
    let k = camera.intrinsic();
    CameraCalibration {
        timestamp: timestamp(time_ns),
        frame_id: camera.name.clone(),
        width: camera.width as u32,
        height: camera.height as u32,
        k: k.as_flattened().to_vec(),
        r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: k.iter().flat_map(|row| row.iter().copied().chain([0.0])).collect(),
        ..CameraCalibration::default()
    }
}

/// Angles of the arm, and displacements of the fingers.
pub(super) fn joints(robot: &RobotState, time_ns: u64) -> JointStates {
    let fingers = ["finger_left", "finger_right"].map(str::to_owned);
    let names = (1..=robot.joints.len()).map(|joint| format!("joint_{joint}")).chain(fingers);
    let positions = robot.joints.iter().chain(&robot.fingers_m);
    let joint = |(name, position): (String, &f64)| JointState {
        name,
        position: Some(*position),
        ..Default::default()
    };
    JointStates { timestamp: timestamp(time_ns), joints: names.zip(positions).map(joint).collect() }
}

pub(super) fn prompt(record: &EpisodeRecord) -> Log {
    log_line(record, 0, Level::Info, record.header.prompt.clone())
}

pub(super) fn verdict(record: &EpisodeRecord, time_ns: u64) -> Log {
    let level = if record.verdict.safety { Level::Info } else { Level::Warning };
    log_line(record, time_ns, level, record.outcome_name().to_owned())
}

fn log_line(record: &EpisodeRecord, time_ns: u64, level: Level, message: String) -> Log {
    let header = &record.header;
    let name = format!(
        "{} task {} episode {} · {}",
        header.id.suite, header.id.task, header.id.episode, header.policy
    );
    Log { timestamp: timestamp(time_ns), level: level.into(), message, name, ..Log::default() }
}
