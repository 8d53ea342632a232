//! Errors of an episode.

use super::{build_error::SceneBuildError, sensors::SensingError, simulation::SettleError};
use softvt_benchmark::Goal;
use softvt_common::text::format_number;
use softvt_geometry::Vec3;
use softvt_policy::PolicyError;

/// An episode cannot be run: an error in the user's input, or a failure of the controller. Positions of joints are in
/// rad or m, gravity is in m/s². Places are `file:line`, empty if no script placed the object.
#[derive(Debug, thiserror::Error)]
pub enum EpisodeError {
    #[error(transparent)]
    Build(#[from] SceneBuildError),
    #[error("layout {layout}, episode {episode}: {source}")]
    Settle { layout: String, episode: u32, source: SettleError },
    #[error("task {task}: goal.{role} names {name:?}, but layout {layout} places {have}")]
    NoObject { task: usize, role: &'static str, name: String, layout: String, have: String },
    #[error(
        "task {task}: goal.target {target} has no cavity, and softvt.inside needs one: a floor and walls all around, \
         upright as the asset is declared; use softvt.on, or a container"
    )]
    NoCavity { task: usize, target: String, placed_at: String },
    #[error(
        "task {task}: goal.joint names {name:?}, which has no joint; name a part of a softvt.articulated, as \
         cabinet.top_drawer"
    )]
    NoJoint { task: usize, name: String, placed_at: String },
    #[error(
        "task {task}: goal.range is beyond the limits of {name}, {}..{}",
        format_number(*.lower), format_number(*.upper)
    )]
    JointRange { task: usize, name: String, lower: f64, upper: f64, placed_at: String },
    #[error(
        "task {task}: scene.gravity = {{ {}, {}, {} }} does not point down, and a goal judges what carries {object}; give it \
         a z below 0",
        format_number(.gravity.x), format_number(.gravity.y), format_number(.gravity.z)
    )]
    Gravity { task: usize, object: String, gravity: Vec3, placed_at: String },
    #[error(
        "task {task}, episode {episode}: the goal already holds at the start, before the robot moves: {}; change the layout or \
         the goal",
        .goal.describe()
    )]
    GoalHolds { task: usize, episode: u32, goal: Goal, placed_at: String },
    #[error("task {task}, episode {episode}: {source}")]
    Sense { task: usize, episode: u32, source: SensingError },
    #[error("task {task}, episode {episode}: {source}")]
    Control { task: usize, episode: u32, source: PolicyError },
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
