//! Where things are in a flat state of MuJoCo's, by the model that was kept with it.
//!
//! A state is the time, the positions of all joints and their velocities. Joints stand in the order of their bodies, a body
//! before those in it, as the model names them (MuJoCo, XML reference, "body"): a free joint has seven positions (place,
//! quaternion w x y z) and six velocities, a ball four and three, any other one and one.

use super::{ForeignObjectPose, pose_of};
use crate::geometry::Pose;

/// Bodies of a model, in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MujocoModel {
    bodies: Vec<MujocoBody>,
    /// Where the robot stands, world.
    pub base_w: Option<Pose>,
}

#[derive(Clone, Debug, PartialEq)]
struct MujocoBody {
    name: String,
    /// What it is in.
    above: Option<usize>,
    /// In that body; none if it is told in another way than by `pos` and `quat`.
    pose: Option<Pose>,
    joints: Vec<MujocoJoint>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MujocoJoint {
    Free,
    Ball,
    Single,
}

impl MujocoJoint {
    /// Positions and velocities.
    fn size(self) -> [usize; 2] {
        match self {
            Self::Free => [7, 6],
            Self::Ball => [4, 3],
            Self::Single => [1, 1],
        }
    }
}

/// MujocoBody that robosuite's robot stands on.
const BASE: &str = "robot0_base";

impl MujocoModel {
    /// Reads the bodies of a model; none if it has none.
    pub(super) fn read(xml: &str) -> Option<Self> {
        let mut model = Self::default();
        let mut open: Vec<(String, Option<usize>)> = Vec::new();
        for tag in tags(xml) {
            if let Some(name) = tag.strip_prefix('/') {
                while open.pop().is_some_and(|(known, _)| known != name.trim()) {}
                continue;
            }
            let name = tag.split(|c: char| c.is_whitespace() || c == '/').next().unwrap_or_default();
            let above = open.iter().rev().find_map(|(_, body)| *body);
            let direct = open.last().and_then(|(_, body)| *body);
            let in_world = open.iter().any(|(name, _)| name == "worldbody");
            let mut body = None;
            match (name, direct) {
                ("body", _) if in_world => {
                    body = Some(model.bodies.len());
                    model.bodies.push(MujocoBody::of(tag, above));
                }
                ("freejoint", Some(at)) => model.bodies[at].joints.push(MujocoJoint::Free),
                ("joint", Some(at)) => model.bodies[at].joints.push(match attribute(tag, "type") {
                    Some("free") => MujocoJoint::Free,
                    Some("ball") => MujocoJoint::Ball,
                    _ => MujocoJoint::Single,
                }),
                _ => {}
            }
            if !tag.ends_with('/') {
                open.push((name.to_owned(), body));
            }
        }
        let base = model.bodies.iter().position(|body| body.name == BASE);
        model.base_w = base.and_then(|base| model.pose(base));
        (!model.bodies.is_empty()).then_some(model)
    }

    /// A body's pose in the world while nothing moves.
    fn pose(&self, body: usize) -> Option<Pose> {
        // Step by step, and not by calling itself: files of others may nest as deep as they like.
        let outwards = std::iter::successors(Some(body), |body| self.bodies[*body].above);
        outwards
            .map(|body| self.bodies[body].pose)
            .try_fold(Pose::identity(), |inner, pose| Some(pose? * inner))
    }

    /// Numbers of a state of this model.
    pub(super) fn width(&self) -> usize {
        let joints = self.bodies.iter().flat_map(|body| &body.joints);
        1 + joints.map(|joint| joint.size().iter().sum::<usize>()).sum::<usize>()
    }

    /// What stands around in a state: free bodies where the state has them, and those that are fixed to the world where the
    /// model has them. None if the state is not of this model.
    pub(super) fn standing(&self, state: &[f64]) -> Option<Vec<ForeignObjectPose>> {
        if state.len() != self.width() {
            return None;
        }
        let (mut at, mut things) = (1, Vec::new());
        for (index, body) in self.bodies.iter().enumerate() {
            let first = at;
            at += body.joints.iter().map(|joint| joint.size()[0]).sum::<usize>();
            let pose_w = match body.joints[..] {
                [MujocoJoint::Free] => pose_of(&state[first..first + 7]),
                [] if body.above.is_none() => self.pose(index),
                _ => None,
            };
            let Some(pose_w) = pose_w else { continue };
            let pose = self.base_w.map_or(pose_w, |base| base.inverse() * pose_w);
            let name = body.name.trim_end_matches("_main").to_owned();
            things.push(ForeignObjectPose { name, pose, in_base: self.base_w.is_some(), soft: false });
        }
        Some(things)
    }
}

impl MujocoBody {
    fn of(tag: &str, above: Option<usize>) -> Self {
        let numbers = |name, or: &[f64]| -> Option<Vec<f64>> {
            let Some(text) = attribute(tag, name) else { return Some(or.to_vec()) };
            let read: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
            read.filter(|read| read.len() == or.len())
        };
        let (at, turn) = (numbers("pos", &[0.0; 3]), numbers("quat", &[1.0, 0.0, 0.0, 0.0]));
        let other =
            ["euler", "axisangle", "xyaxes", "zaxis"].iter().any(|name| attribute(tag, name).is_some());
        let pose = at.zip(turn).filter(|_| !other).and_then(|(at, turn)| pose_of(&[at, turn].concat()));
        Self { name: attribute(tag, "name").unwrap_or_default().to_owned(), above, pose, joints: Vec::new() }
    }
}

/// The insides of a document's tags, comments left out.
fn tags(xml: &str) -> impl Iterator<Item = &str> {
    let mut rest = xml;
    std::iter::from_fn(move || {
        loop {
            rest = &rest[rest.find('<')? + 1..];
            let (inside, end) = match rest.strip_prefix("!--") {
                Some(_) => (None, rest.find("-->")?),
                None => (Some(()), rest.find('>')?),
            };
            let tag = &rest[..end];
            rest = &rest[end..];
            if inside.is_some() {
                return Some(tag);
            }
        }
    })
}

/// An attribute of a tag.
fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let mut rest = tag;
    loop {
        let (before, after) = rest.split_once('=')?;
        let after = after.trim_start();
        let quote = after.chars().next().filter(|c| matches!(c, '"' | '\''))?;
        let (value, next) = after[1..].split_once(quote)?;
        if before.split_whitespace().next_back() == Some(name) {
            return Some(value);
        }
        rest = next;
    }
}
