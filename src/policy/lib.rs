//! Policies: their interface, their observations, the encodings of observations and actions, and policy servers.
#![warn(unreachable_pub)]

pub mod access;
pub mod builtin;
mod command_resolver;
pub mod decode;
pub mod encode;
mod grip_hysteresis;
pub mod http;
mod interface;
pub mod msgpack;
mod observation;
pub mod osc;
pub mod profile;
pub mod remote;
mod robot_state;
pub mod transport;

pub use command_resolver::CommandResolver;
pub use grip_hysteresis::{GripHysteresis, GripLatch};
pub use interface::{
    Action, ActionChunk, EncodedAction, EncodedGrip, EpisodeBrief, Policy, PolicyError, QueryId, ToolCommand,
    ToolMotion,
};
pub use observation::{
    CameraImage, Observation, PadForce, PastStep, SensorStreams, TactileFrame, TactileHistory,
};
pub use robot_state::{
    ExportedStream, JOINT_NAMES, MAX_ANGLE, MAX_POSITION_M, NumberType, ROBOT_STREAMS, RecordedStream,
    RobotState, RobotStream, StatePart, pose_row, stream_paths,
};
pub use softvt_robot::GripTarget;
