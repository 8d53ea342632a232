//! Demonstrations that were made elsewhere, as commands and a start for our world. What is read of a file, and what not, says
//! `docs/data.md`, "Importing".
//!
//! A file is read whole and checked before anything is simulated: what is wrong with it is told with its name, key and step.

mod header;
mod libero;
mod mujoco;
mod object_matching;
mod rows;
mod softvt;
mod softvtbench;
mod tool_pose;

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::{DatasetError, TaskFile};
use crate::{
    geometry::{Pose, Vec3},
    policy::ToolCommand,
    scene::InitialState,
};

pub use header::ForeignLayout;
pub use object_matching::match_objects;

/// A file of demonstrations.
#[derive(Clone, Debug)]
pub struct ForeignFile {
    /// Where it is.
    pub path: PathBuf,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
    /// How it is laid out.
    pub layout: ForeignLayout,
    /// Its demonstrations, in order.
    pub demos: Vec<ForeignDemo>,
}

/// One demonstration.
#[derive(Clone, Debug, PartialEq)]
pub struct ForeignDemo {
    /// Its group.
    pub name: String,
    /// What it says that it is of.
    pub task: ForeignTask,
    /// What is commanded in each control step.
    pub commands: Vec<ToolCommand>,
    /// Whether the gripper is meant to hold in each control step.
    pub shut: Vec<bool>,
    /// Whether, in each control step, the hand holds something and its closure is only where the thing has stopped it.
    pub held: Vec<bool>,
    /// What it starts from.
    pub begins: InitialCondition,
    /// Where its commands come from, for people.
    pub said: &'static str,
}

/// Which task a demonstration says that it is of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ForeignTask {
    /// Suite.
    pub suite: Option<String>,
    /// Index in it.
    pub id: Option<usize>,
    /// Instructions, the likeliest first; other spellings of one and the same.
    pub prompts: Vec<String>,
}

/// Where a demonstration begins.
#[derive(Clone, Debug, PartialEq)]
pub enum InitialCondition {
    /// In a world of its own: what it says of the arm (joint angles, rad) and of what stands around.
    OtherSimulator {
        /// Joint angles, rad.
        joints: Option<[f64; 7]>,
        /// What stands around.
        things: Vec<ForeignObjectPose>,
    },
    /// In an episode of a suite of softvt.
    SoftvtEpisode {
        /// Base seed.
        seed: u64,
        /// Index in the split of demonstrations.
        attempt: u32,
        /// What the layout is overruled with.
        start: InitialState,
    },
}

/// A thing of another world.
#[derive(Clone, Debug, PartialEq)]
pub struct ForeignObjectPose {
    /// Its name there.
    pub name: String,
    /// Place and orientation.
    pub pose: Pose,
    /// Whether the pose is in the frame of the robot's base; if not, in that world's, whose x and y are taken for ours.
    pub in_base: bool,
    /// Whether it is a soft body: its orientation is not known then.
    pub soft: bool,
}

impl ForeignDemo {
    /// Shuts the hand wherever its closure is only where a thing has stopped it: a soft thing is squeezed as it was by going
    /// there, one that gives way to nothing is not.
    pub fn hold_rigid(&mut self) {
        for (command, _) in self.commands.iter_mut().zip(&self.held).filter(|(_, held)| **held) {
            match command {
                ToolCommand::Pose(action) => action.closure = 1.0,
                ToolCommand::Step { closure, .. } => *closure = 1.0,
            }
        }
    }
}

/// Reads all demonstrations of a file.
///
/// # Errors
/// It is none of the layouts that are known, is of another robot or rate, or something in it is missing or wrong.
pub fn read(path: &Path) -> Result<ForeignFile, DatasetError> {
    let file = TaskFile::open(path)?;
    let header = header::Header::read(&file)?;
    let demo = |&demo: &usize| match header.layout {
        ForeignLayout::Softvt => softvt::demo(&file, &header, demo),
        ForeignLayout::SoftVtBench => softvtbench::demo(&file, &header, demo),
        ForeignLayout::Libero => libero::demo(&file, &header, demo),
    };
    let demos = file.demos().iter().map(demo).collect::<Result<_, _>>()?;
    Ok(ForeignFile { path: path.to_owned(), sha256: digest(path)?, layout: header.layout, demos })
}

/// SHA-256 of a file, hexadecimal.
fn digest(path: &Path) -> Result<String, DatasetError> {
    let mut file = std::fs::File::open(path).map_err(DatasetError::io("read", path))?;
    let mut hash = Sha256::new();
    std::io::copy(&mut file, &mut hash).map_err(DatasetError::io("read", path))?;
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// The place of a row of seven numbers: position (m), quaternion w x y z of any length but 0.
fn pose_of(row: &[f64]) -> Option<Pose> {
    let q = nalgebra::Quaternion::new(row[3], row[4], row[5], row[6]);
    let at = Vec3::new(row[0], row[1], row[2]);
    let sound = q.norm() > 1e-6 && row.iter().all(|x| x.is_finite());
    sound.then(|| Pose::from_parts(at.into(), crate::geometry::Quat::new_normalize(q)))
}

#[cfg(test)]
mod tests;
