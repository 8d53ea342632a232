//! What the judge is shown after every physics step: plain numbers, world frame, hidden from policies.

use crate::geometry::{Pose, Vec3};

use super::deformation::Deformation;

/// One pad against the target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PadEvidence {
    /// Normal impulse between pad and target in this step, N s.
    pub normal_impulse_ns: f64,
    /// How far the touched patch has slid along the pad since this contact began, m.
    pub travel_m: f64,
}

/// The gripper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GripperEvidence {
    /// Measured apex-to-apex width, m.
    pub width_m: f64,
    /// Commanded apex-to-apex width, m.
    pub commanded_width_m: f64,
}

/// One movable body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyEvidence {
    /// Centre (mean of the nodes of a soft body, centre of mass of a rigid one), m.
    pub centre_w: Vec3,
    /// Height of its lowest point, m.
    pub lowest_z_w: f64,
    /// Upward impulse on it in this step from everything but the robot, N s. A sleeping body keeps that it fell
    /// asleep with.
    pub support_impulse_ns: f64,
    /// Its deformation; `None` for a rigid body, and for a soft one when it could not be measured.
    pub deformation: Option<Deformation>,
}

/// What the target must be placed on or in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaceEvidence {
    /// Its object frame in the world.
    pub pose_w: Pose,
    /// Upward impulse from it on the target in this step, N s.
    pub support_impulse_ns: f64,
}

/// One physics step, as it ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence<'a> {
    /// Time since the policy took over, s.
    pub time_s: f64,
    /// Hand frame origin, m.
    pub hand_w: Vec3,
    /// The gripper.
    pub gripper: GripperEvidence,
    /// Left and right pad against the target.
    pub pads: [PadEvidence; 2],
    /// Normal impulse in this step between the target and the rest of the robot (hand, fingers, sensor cases), N s.
    pub robot_impulse_ns: f64,
    /// The target.
    pub target: BodyEvidence,
    /// The other movable bodies, always in the same order.
    pub others: &'a [BodyEvidence],
    /// Where the target must go.
    pub place: PlaceEvidence,
}

impl BodyEvidence {
    fn is_finite(&self) -> bool {
        self.centre_w.iter().all(|v| v.is_finite())
            && self.lowest_z_w.is_finite()
            && self.support_impulse_ns.is_finite()
    }
}

impl Evidence<'_> {
    /// Whether every number that the rules read is finite. Deformations are looked at apart.
    pub fn is_finite(&self) -> bool {
        let pose = self.place.pose_w.to_homogeneous();
        self.time_s.is_finite()
            && self.hand_w.iter().chain(pose.iter()).all(|v| v.is_finite())
            && self.gripper.width_m.is_finite()
            && self.gripper.commanded_width_m.is_finite()
            && self.pads.iter().all(|pad| pad.normal_impulse_ns.is_finite() && pad.travel_m.is_finite())
            && self.robot_impulse_ns.is_finite()
            && self.target.is_finite()
            && self.others.iter().all(BodyEvidence::is_finite)
            && self.place.support_impulse_ns.is_finite()
    }
}
