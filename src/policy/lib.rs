//! Policies: their interface, their observations, the encodings of observations and actions, and policy servers.
#![warn(missing_docs, unreachable_pub)]

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
pub mod transport;

pub use command_resolver::CommandResolver;
pub use grip_hysteresis::{GripHysteresis, GripSwitch, WidthLatch};
pub use interface::{
    Action, ActionChunk, EncodedGrip, EpisodeBrief, Policy, PolicyError, QueryId, ToolCommand, ToolMotion,
};
pub use observation::{
    CameraImage, Observation, PadForce, PastStep, RobotState, SensorStreams, TactileFrame, TactileHistory,
};
pub use softvt_robot::GripTarget;
