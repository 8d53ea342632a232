//! Errors of an episode.

use super::{build_error::SceneBuildError, sensors::SensingError, simulation::SettleError};
use softvt_benchmark::Goal;
use softvt_common::text::format_number;
use softvt_geometry::Vec3;
use softvt_policy::PolicyError;

/// An episode cannot be run: an error in the user's input, or a failure of the controller.
#[derive(Debug, thiserror::Error)]
pub enum EpisodeError {
    /// The scene cannot be built.
    #[error(transparent)]
    Build(#[from] SceneBuildError),
    /// The scene does not come to rest.
    #[error("layout {layout}, episode {episode}: {source}")]
    Settle {
        /// Layout name.
        layout: String,
        /// Episode index.
        episode: u32,
        /// The cause.
        source: SettleError,
    },
    /// The goal names an object that is not in the scene.
    #[error("task {task}: goal.{role} names {name:?}, but layout {layout} places {have}")]
    NoObject {
        /// Task index.
        task: usize,
        /// "object", "target" or "joint".
        role: &'static str,
        /// Name in the goal.
        name: String,
        /// Layout name.
        layout: String,
        /// Names in the scene.
        have: String,
    },
    /// The goal is inside an object that holds nothing.
    #[error(
        "task {task}: goal.target {target} has no cavity, and softvt.inside needs one: a floor and walls all around, \
         upright as the asset is declared; use softvt.on, or a container"
    )]
    NoCavity {
        /// Task index.
        task: usize,
        /// Name in the goal.
        target: String,
        /// `file:line` where the object was placed; empty if no script placed it.
        placed_at: String,
    },
    /// The goal is about the joint of an object that has none.
    #[error(
        "task {task}: goal.joint names {name:?}, which has no joint; name a part of a softvt.articulated, as \
         cabinet.top_drawer"
    )]
    NoJoint {
        /// Task index.
        task: usize,
        /// Name in the goal.
        name: String,
        /// `file:line` where the object was placed; empty if no script placed it.
        placed_at: String,
    },
    /// The goal asks for positions of a joint that are beyond its limits.
    #[error(
        "task {task}: goal.range is beyond the limits of {name}, {}..{}",
        format_number(*.lower), format_number(*.upper)
    )]
    JointRange {
        /// Task index.
        task: usize,
        /// Name in the goal.
        name: String,
        /// Least position, rad of a hinge and m of a slider.
        lower: f64,
        /// Greatest position.
        upper: f64,
        /// `file:line` where the object was placed; empty if no script placed it.
        placed_at: String,
    },
    /// Nothing has to carry the object of the goal.
    #[error(
        "task {task}: scene.gravity = {{ {}, {}, {} }} does not point down, and a goal judges what carries {object}; give it \
         a z below 0",
        format_number(.gravity.x), format_number(.gravity.y), format_number(.gravity.z)
    )]
    Gravity {
        /// Task index.
        task: usize,
        /// Object of the goal.
        object: String,
        /// Gravity of the scene, m/s².
        gravity: Vec3,
        /// `file:line` where the object was placed; empty if no script placed it.
        placed_at: String,
    },
    /// The goal holds before the robot moves.
    #[error(
        "task {task}, episode {episode}: the goal already holds at the start, before the robot moves: {}; change the layout or \
         the goal",
        .goal.describe()
    )]
    GoalHolds {
        /// Task index.
        task: usize,
        /// Episode index.
        episode: u32,
        /// The goal.
        goal: Goal,
        /// `file:line` where its object was placed; empty if no script placed it.
        placed_at: String,
    },
    /// Data of a sensor cannot be computed.
    #[error("task {task}, episode {episode}: {source}")]
    Sense {
        /// Task index.
        task: usize,
        /// Episode index.
        episode: u32,
        /// The cause.
        source: SensingError,
    },
    /// The controller or its connection failed.
    #[error("task {task}, episode {episode}: {source}")]
    Control {
        /// Task index.
        task: usize,
        /// Episode index.
        episode: u32,
        /// The cause.
        source: PolicyError,
    },
}

impl EpisodeError {
    /// `file:line` of the error, if it is known and the message does not contain it.
    pub fn place(&self) -> Option<&str> {
        match self {
            Self::Settle { source, .. } => source.place(),
            Self::NoCavity { placed_at, .. }
            | Self::NoJoint { placed_at, .. }
            | Self::JointRange { placed_at, .. }
            | Self::Gravity { placed_at, .. }
            | Self::GoalHolds { placed_at, .. } => Some(placed_at.as_str()).filter(|place| !place.is_empty()),
            _ => None,
        }
    }
}
