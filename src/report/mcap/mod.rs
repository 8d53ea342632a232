//! Episodes as MCAP files with the schemas of Foxglove, which Foxglove and Rerun open.
//!
//! Times are simulated: 0 is the settled state, and there is one message of each topic per control step.
//!
//! | topic | schema | content |
//! |---|---|---|
//! | `/tf` | `foxglove.FrameTransforms` | `tool`, `pad_left`, `pad_right`, cameras, and each rigid object and link, in `world` |
//! | `/scene` | `foxglove.SceneUpdate` | triangles of all objects; soft bodies by strain, again whenever they move |
//! | `/nodes/NAME` | `foxglove.PointCloud` | nodes of a soft body with their strain over the stable strain |
//! | `/contacts/left`, `right` | `foxglove.PointCloud` | contact points of a pad in its frame, with their pressure, Pa |
//! | `/camera/NAME` | `foxglove.CompressedImage` | image of a camera; `/camera/NAME/calibration` has its matrices |
//! | `/tactile/left`, `right` | `foxglove.CompressedImage` | tactile image |
//! | `/joints` | `foxglove.JointStates` | arm, rad, and fingers, m |
//! | `/gripper` | `Gripper` | width and normal forces |
//! | `/deformation` | `Deformation` | D and τ of the target with the largest D/τ |
//! | `/log` | `foxglove.Log` | prompt at the start, verdict at the end |
//!
//! The attachment `episode.json` is the record of the episode.
//!
//! The frame of a camera has z along the view and y down, as `foxglove.CameraCalibration` wants it.

mod geometry;
mod messages;

use std::{
    borrow::Cow,
    io::Cursor,
    path::{Path, PathBuf},
};

use ::mcap::{Attachment, McapError, WriteOptions, Writer, records::MessageHeader};
use foxglove::{
    Encode,
    messages::{
        CameraCalibration, CompressedImage, FrameTransforms, JointStates, Log, PointCloud, SceneUpdate,
    },
};

use crate::video::SharedSensors;
use geometry::SceneGeometry;
use messages::{Deformation, Gripper};
use softvt_benchmark::CONTROL_DT;
use softvt_common::{
    episode_id::EpisodeIndex,
    files::{FileError, replace},
    parallel,
};
use softvt_physics::world::WorldSnapshot;
use softvt_robot::Side;
use softvt_rollout::{SensingError, Sensors, StateRecording};
use softvt_runs::record::EpisodeRecord;
use softvt_scene::Camera;

/// Edge of the camera images, pixels, as in the profiles.
const IMAGE_EDGE: usize = 224;

#[derive(Debug, thiserror::Error)]
pub enum EpisodeMcapError {
    #[error(transparent)]
    Sensing(#[from] SensingError),
    #[error("cannot encode a message: {0}")]
    Message(String),
    #[error("cannot write the MCAP records: {0}")]
    Mcap(#[from] McapError),
    #[error(transparent)]
    File(#[from] FileError),
    #[error("interrupted")]
    Interrupted,
}

struct EncodedMessage {
    topic: u16,
    bytes: Vec<u8>,
}

struct Topics {
    transforms: u16,
    scene: u16,
    joints: u16,
    gripper: u16,
    deformation: u16,
    log: u16,
    contacts: [u16; 2],
    tactile: [u16; 2],
    nodes: Vec<u16>,
    cameras: Vec<CameraTopics>,
}

struct CameraTopics {
    camera: Camera,
    image: u16,
    calibration: u16,
}

/// Writes the states of a recording, and what its sensors measure in each of them. States are drawn on up to `threads`
/// threads; `on_state` is called after each. The file is replaced at once, at the end.
///
/// # Errors
/// A state cannot be drawn, the file cannot be written, or the call was cancelled.
pub fn write_mcap(
    recording: &mut StateRecording,
    record: &EpisodeRecord,
    path: &Path,
    threads: usize,
    is_cancelled: impl Fn() -> bool + Sync,
    mut on_state: impl FnMut(),
) -> Result<(), EpisodeMcapError> {
    let geometry = SceneGeometry::new(&mut recording.sensors)?;
    let mut file = McapFile::new()?;
    let topics = file.add_topics(&geometry, recording.sensors.cameras())?;
    file.write(0, &encoded(topics.log, &messages::prompt(record))?)?;
    let shared = SharedSensors::new(&mut recording.sensors)?;
    let recording = &*recording;
    let state = StateMessages { recording, geometry: &geometry, topics: &topics };
    let draw = |index: usize| shared.lend(|sensors| state.at(sensors, index));
    let mut drawn = 0;
    parallel::run_in_order(recording.frames.len(), threads, &is_cancelled, draw, |index, messages| {
        for message in &messages {
            file.write(time_ns(index), message)?;
        }
        drawn += 1;
        on_state();
        Ok::<_, EpisodeMcapError>(())
    })?;
    // A request to stop ends the states early.
    if drawn < recording.frames.len() {
        return Err(EpisodeMcapError::Interrupted);
    }
    let last_ns = time_ns(recording.frames.len().saturating_sub(1));
    file.write(last_ns, &encoded(topics.log, &messages::verdict(record, last_ns))?)?;
    Ok(replace(path, file.finish(record, last_ns)?)?)
}

/// Path of an episode's MCAP file in a run folder.
pub fn mcap_path(dir: &Path, index: EpisodeIndex) -> PathBuf {
    let EpisodeIndex { task, episode } = index;
    dir.join(format!("mcap/task_{task:03}/episode_{episode:05}.mcap"))
}

/// Simulated time of a state, ns.
fn time_ns(index: usize) -> u64 {
    (index as f64 * CONTROL_DT * 1e9).round() as u64
}

fn encoded<T: Encode>(topic: u16, message: &T) -> Result<EncodedMessage, EpisodeMcapError> {
    let mut bytes = Vec::with_capacity(message.encoded_len().unwrap_or_default());
    message.encode(&mut bytes).map_err(|error| EpisodeMcapError::Message(error.to_string()))?;
    Ok(EncodedMessage { topic, bytes })
}

/// A file in memory, so that it is complete or absent on the disk.
struct McapFile {
    writer: Writer<Cursor<Vec<u8>>>,
    /// Number of messages so far, by topic.
    counts: Vec<u32>,
}

impl McapFile {
    fn new() -> Result<Self, McapError> {
        let library = concat!("softvt ", env!("CARGO_PKG_VERSION"));
        let options = WriteOptions::new().compression(None).library(library);
        Ok(Self { writer: options.create(Cursor::new(Vec::new()))?, counts: Vec::new() })
    }

    fn add_topics(&mut self, geometry: &SceneGeometry, cameras: &[Camera]) -> Result<Topics, McapError> {
        let sides = ["left", "right"];
        let camera = |file: &mut Self, camera: &Camera| {
            let topic = format!("/camera/{}", camera.name);
            Ok(CameraTopics {
                camera: camera.clone().with_edge(IMAGE_EDGE),
                image: file.add_topic::<CompressedImage>(&topic)?,
                calibration: file.add_topic::<CameraCalibration>(&format!("{topic}/calibration"))?,
            })
        };
        Ok(Topics {
            transforms: self.add_topic::<FrameTransforms>("/tf")?,
            scene: self.add_topic::<SceneUpdate>("/scene")?,
            joints: self.add_topic::<JointStates>("/joints")?,
            gripper: self.add_topic::<Gripper>("/gripper")?,
            deformation: self.add_topic::<Deformation>("/deformation")?,
            log: self.add_topic::<Log>("/log")?,
            contacts: self.add_pair::<PointCloud>(sides.map(|side| format!("/contacts/{side}")))?,
            tactile: self.add_pair::<CompressedImage>(sides.map(|side| format!("/tactile/{side}")))?,
            nodes: geometry
                .soft_names()
                .map(|name| self.add_topic::<PointCloud>(&format!("/nodes/{name}")))
                .collect::<Result<_, _>>()?,
            cameras: cameras.iter().map(|of| camera(self, of)).collect::<Result<_, McapError>>()?,
        })
    }

    fn add_pair<T: Encode>(&mut self, [left, right]: [String; 2]) -> Result<[u16; 2], McapError> {
        Ok([self.add_topic::<T>(&left)?, self.add_topic::<T>(&right)?])
    }

    fn add_topic<T: Encode>(&mut self, topic: &str) -> Result<u16, McapError> {
        let schema = match T::get_schema() {
            Some(schema) => self.writer.add_schema(&schema.name, &schema.encoding, &schema.data)?,
            None => 0,
        };
        self.writer.add_channel(schema, topic, &T::get_message_encoding(), &Default::default())
    }

    fn write(&mut self, time_ns: u64, message: &EncodedMessage) -> Result<(), McapError> {
        let topic = usize::from(message.topic);
        self.counts.resize(self.counts.len().max(topic + 1), 0);
        self.counts[topic] += 1;
        let header = MessageHeader {
            channel_id: message.topic,
            sequence: self.counts[topic],
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.writer.write_to_known_channel(&header, &message.bytes)
    }

    /// Adds the record, and returns the bytes of the file.
    fn finish(mut self, record: &EpisodeRecord, last_ns: u64) -> Result<Vec<u8>, EpisodeMcapError> {
        let json =
            serde_json::to_vec(record).map_err(|error| EpisodeMcapError::Message(error.to_string()))?;
        self.writer.attach(&Attachment {
            log_time: last_ns,
            create_time: last_ns,
            name: "episode.json".to_owned(),
            media_type: "application/json".to_owned(),
            data: Cow::Owned(json),
        })?;
        self.writer.finish()?;
        Ok(self.writer.into_inner().into_inner())
    }
}

/// Inputs of the messages of states.
struct StateMessages<'a> {
    recording: &'a StateRecording,
    geometry: &'a SceneGeometry,
    topics: &'a Topics,
}

impl StateMessages<'_> {
    fn at(&self, sensors: &mut Sensors, index: usize) -> Result<Vec<EncodedMessage>, EpisodeMcapError> {
        let (recording, topics, geometry) = (self.recording, self.topics, self.geometry);
        let (frame, time_ns) = (&recording.frames[index], time_ns(index));
        let before = index.checked_sub(1).map(|before| &recording.frames[before]);
        let robot = &recording.robot[index];
        let mut all = vec![
            encoded(topics.transforms, &geometry.transforms(sensors, frame, robot, time_ns))?,
            encoded(topics.joints, &messages::joints(robot, time_ns))?,
            encoded(topics.gripper, &Gripper::new(frame, robot))?,
        ];
        if let Some(update) = geometry.update(sensors, frame, before, time_ns) {
            all.push(encoded(topics.scene, &update)?);
        }
        if let Some(of) = recording.deformation.get(index).copied().flatten() {
            all.push(encoded(topics.deformation, &Deformation::from(of))?);
        }
        for (body, &topic) in topics.nodes.iter().enumerate() {
            all.push(encoded(topic, &geometry::node_cloud(sensors, frame, body, time_ns))?);
        }
        for (side, &topic) in topics.contacts.iter().enumerate() {
            all.push(encoded(topic, &geometry::contact_cloud(frame, side, time_ns))?);
        }
        self.add_images(sensors, frame, time_ns, &mut all)?;
        Ok(all)
    }

    fn add_images(
        &self,
        sensors: &mut Sensors,
        frame: &WorldSnapshot,
        time_ns: u64,
        all: &mut Vec<EncodedMessage>,
    ) -> Result<(), EpisodeMcapError> {
        for CameraTopics { camera, image, calibration } in &self.topics.cameras {
            let picture = sensors.render_rgb(frame, camera)?.into_rgb_image();
            all.push(encoded(*image, &messages::image(&picture, &camera.name, time_ns))?);
            all.push(encoded(*calibration, &messages::calibration(camera, time_ns))?);
        }
        for (side, &topic) in [Side::Left, Side::Right].into_iter().zip(&self.topics.tactile) {
            let picture = sensors.tactile_reading(frame, side)?.image;
            all.push(encoded(
                topic,
                &messages::image(&picture, geometry::PAD_FRAMES[side.index()], time_ns),
            )?);
        }
        Ok(())
    }
}
