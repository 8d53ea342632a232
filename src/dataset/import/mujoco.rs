//! Object poses in a flat MuJoCo state, by the model stored with it.
//!
//! A state holds the time, the positions of all joints and their velocities. Joints are in the order of their bodies,
//! parents before children (MuJoCo, XML reference, "body"): a free joint has seven positions (position, quaternion w
//! x y z) and six velocities, a ball joint four and three, any other joint one and one.

use quick_xml::{
    Reader,
    events::{BytesStart, Event},
};

use super::{demo_reader::pose_from_row, foreign::ForeignObjectPose};
use softvt_geometry::Pose;

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MujocoModel {
    bodies: Vec<MujocoBody>,
    /// Pose of the robot's base, world.
    pub base_w: Option<Pose>,
}

#[derive(Clone, Debug, PartialEq)]
struct MujocoBody {
    name: String,
    parent: Option<usize>,
    /// Pose in the parent; `None` if it is given by other attributes than `pos` and `quat`.
    pose: Option<Pose>,
    joints: Vec<MujocoJoint>,
}

/// Numbers of a joint in a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct MujocoJoint {
    positions: usize,
    velocities: usize,
}

impl MujocoJoint {
    const FREE: Self = Self { positions: 7, velocities: 6 };
    const BALL: Self = Self { positions: 4, velocities: 3 };
    const SINGLE: Self = Self { positions: 1, velocities: 1 };
}

/// Name of the base of robosuite's robots.
const BASE: &str = "robot0_base";

impl MujocoModel {
    /// Reads the bodies of an XML model; `None` if it has none.
    pub(super) fn read(xml: &str) -> Option<Self> {
        let mut model = Self::default();
        let mut reader = Reader::from_str(xml);
        reader.config_mut().check_end_names = false;
        // The open elements, with the index of each that is a body, and how many are outside of the worldbody.
        let (mut open, mut outside): (Vec<Option<usize>>, _) = (Vec::new(), usize::MAX);
        loop {
            let (tag, is_empty) = match reader.read_event().ok()? {
                Event::Start(tag) => (tag, false),
                Event::Empty(tag) => (tag, true),
                Event::End(_) => {
                    open.pop();
                    outside = if open.len() > outside { outside } else { usize::MAX };
                    continue;
                }
                Event::Eof => break,
                _ => continue,
            };
            let mut body = None;
            match (tag.name().as_ref(), open.last().copied().flatten()) {
                (b"worldbody", _) if !is_empty => outside = outside.min(open.len()),
                (b"body", _) if open.len() > outside => {
                    body = Some(model.bodies.len());
                    let parent = open.iter().rev().find_map(|body| *body);
                    model.bodies.push(MujocoBody::from_tag(&tag, parent));
                }
                (b"freejoint", Some(at)) => model.bodies[at].joints.push(MujocoJoint::FREE),
                (b"joint", Some(at)) => {
                    model.bodies[at].joints.push(match attribute(&tag, "type").as_deref() {
                        Some("free") => MujocoJoint::FREE,
                        Some("ball") => MujocoJoint::BALL,
                        _ => MujocoJoint::SINGLE,
                    })
                }
                _ => {}
            }
            if !is_empty {
                open.push(body);
            }
        }
        let base = model.bodies.iter().position(|body| body.name == BASE);
        model.base_w = base.and_then(|base| model.pose(base));
        (!model.bodies.is_empty()).then_some(model)
    }

    /// World pose of a body at zero joint positions.
    fn pose(&self, body: usize) -> Option<Pose> {
        // Iterative: foreign files may nest deeply enough to overflow the stack.
        let outwards = std::iter::successors(Some(body), |body| self.bodies[*body].parent);
        outwards
            .map(|body| self.bodies[body].pose)
            .try_fold(Pose::identity(), |inner, pose| Some(pose? * inner))
    }

    pub(super) fn state_width(&self) -> usize {
        let joints = self.bodies.iter().flat_map(|body| &body.joints);
        1 + joints.map(|joint| joint.positions + joint.velocities).sum::<usize>()
    }

    /// Object poses in a state: free bodies at their positions in the state, bodies fixed to the world at theirs in
    /// the model. `None` if the state does not fit the model.
    pub(super) fn object_poses(&self, state: &[f64]) -> Option<Vec<ForeignObjectPose>> {
        if state.len() != self.state_width() {
            return None;
        }
        let (mut at, mut objects) = (1, Vec::new());
        for (index, body) in self.bodies.iter().enumerate() {
            let first = at;
            at += body.joints.iter().map(|joint| joint.positions).sum::<usize>();
            let pose_w = match body.joints[..] {
                [MujocoJoint::FREE] => pose_from_row(&state[first..first + 7]),
                [] if body.parent.is_none() => self.pose(index),
                _ => None,
            };
            let Some(pose_w) = pose_w else { continue };
            let pose = self.base_w.map_or(pose_w, |base| base.inverse() * pose_w);
            let name = body.name.trim_end_matches("_main").to_owned();
            objects.push(ForeignObjectPose { name, pose, in_base: self.base_w.is_some(), is_soft: false });
        }
        Some(objects)
    }
}

impl MujocoBody {
    fn from_tag(tag: &BytesStart, parent: Option<usize>) -> Self {
        let numbers = |name, default: &[f64]| -> Option<Vec<f64>> {
            let Some(text) = attribute(tag, name) else { return Some(default.to_vec()) };
            let read: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
            read.filter(|read| read.len() == default.len())
        };
        let (position, quaternion) = (numbers("pos", &[0.0; 3]), numbers("quat", &[1.0, 0.0, 0.0, 0.0]));
        let has_other_rotation =
            ["euler", "axisangle", "xyaxes", "zaxis"].iter().any(|name| attribute(tag, name).is_some());
        let row = position.zip(quaternion).filter(|_| !has_other_rotation);
        let pose = row.and_then(|(position, quaternion)| pose_from_row(&[position, quaternion].concat()));
        Self { name: attribute(tag, "name").unwrap_or_default(), parent, pose, joints: Vec::new() }
    }
}

fn attribute(tag: &BytesStart, name: &str) -> Option<String> {
    Some(tag.try_get_attribute(name).ok()??.unescape_value().ok()?.into_owned())
}
