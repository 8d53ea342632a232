//! Input of the judge after every physics step: plain numbers in the world frame, hidden from policies.
//!
//! Forces are means over the step.

use softvt_geometry::{Pose, Vec3};

use super::deformation::Deformation;

/// Contact between one gripper pad and a target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PadEvidence {
    /// Normal force between pad and target, N.
    pub normal_force_n: f64,
    /// Speed at which the contact patch slides along the pad, m/s.
    pub slip_speed_m_s: f64,
}

/// Opening of the gripper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GripperEvidence {
    /// Measured distance between the apexes of the two gels, m.
    pub width_m: f64,
    /// Commanded distance between the apexes of the two gels, m.
    pub commanded_width_m: f64,
}

/// Shares of the volume (0..=1) of a soft body beyond two strains of its material; `None` where it does not state them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CrushedShares {
    /// Share that is beyond the collapse strain now.
    pub collapsed: Option<f64>,
    /// Share that has ever been beyond the damage strain.
    pub damaged: Option<f64>,
}

/// State of one movable body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyEvidence {
    /// Centre, m: mean of the nodes of a soft body, centre of mass of a rigid one.
    pub centre_w: Vec3,
    /// Height of the lowest point, m.
    pub lowest_z_w: f64,
    /// Sum of the upward forces on the body from everything but the robot, N. A sleeping body keeps
    /// the value with which it fell asleep.
    pub support_force_n: f64,
    /// Normal force on the body from all parts of the robot, pads included, N.
    pub robot_force_n: f64,
    /// Present deformation; `None` for a rigid body, and for a soft one when it could not be measured.
    pub deformation: Option<Deformation>,
}

/// Load of the grip on a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GripEvidence {
    /// Force of the whole robot on the target, N.
    pub load_n: Vec3,
    /// Unit vector along which the pads close.
    pub axis_w: Vec3,
    /// Dynamic friction of pad and target.
    pub dynamic_mu: f64,
}

/// State of an object that a target must be placed on or in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaceEvidence {
    /// Pose of its object frame (origin at the centre of its footprint).
    pub pose_w: Pose,
    /// Upward force on the target from it and, if the target must be placed inside, from objects in it that
    /// it carries, N.
    pub support_force_n: f64,
}

/// Evidence of one predicate of the goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PredicateEvidence {
    /// The object that must carry a target.
    Place(PlaceEvidence),
    /// True if a predicate holds that is not a placement; read at the end of control steps.
    Given(bool),
}

/// State of an object that the task moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetEvidence {
    /// State as of any body.
    pub body: BodyEvidence,
    /// Left and right pad against it.
    pub pads: [PadEvidence; 2],
    /// Normal force between it and the rest of the robot (hand, fingers, sensor cases), N.
    pub hand_force_n: f64,
    /// Load of the grip.
    pub grip: GripEvidence,
    /// Shares of its volume beyond the strain limits of its material.
    pub crushed: CrushedShares,
}

/// State at the end of one physics step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence<'a> {
    /// Time since the policy took over, s.
    pub time_s: f64,
    /// Origin of the hand frame, m.
    pub hand_w: Vec3,
    /// Opening of the gripper.
    pub gripper: GripperEvidence,
    /// States of the objects that the task moves, in the same order in every step.
    pub targets: &'a [TargetEvidence],
    /// States of the other movable bodies, those at a place included, in the same order in every step.
    pub others: &'a [BodyEvidence],
    /// Evidence of the predicates of the goal, in their order.
    pub predicates: &'a [PredicateEvidence],
}

impl Evidence<'_> {
    /// True if every number that the criteria read is finite. Deformations are not included: a missing
    /// one is counted apart.
    pub fn is_finite(&self) -> bool {
        let bodies = self.others.iter().chain(self.targets.iter().map(|target| &target.body));
        let bodies = bodies.flat_map(|body| {
            let centre = body.centre_w;
            [centre.x, centre.y, centre.z, body.lowest_z_w, body.support_force_n, body.robot_force_n]
        });
        let targets = self.targets.iter().flat_map(|target| {
            let [left, right] = target.pads;
            let pads = [left, right].into_iter().flat_map(|pad| [pad.normal_force_n, pad.slip_speed_m_s]);
            let (load, axis) = (target.grip.load_n, target.grip.axis_w);
            let grip = [load.x, load.y, load.z, axis.x, axis.y, axis.z, target.grip.dynamic_mu];
            pads.chain([target.hand_force_n]).chain(grip)
        });
        let places = self.predicates.iter().all(|predicate| match predicate {
            PredicateEvidence::Place(PlaceEvidence { pose_w, support_force_n }) => {
                support_force_n.is_finite() && pose_w.to_homogeneous().iter().all(|x| x.is_finite())
            }
            PredicateEvidence::Given(_) => true,
        });
        let rest = [self.time_s, self.gripper.width_m, self.gripper.commanded_width_m];
        places && bodies.chain(targets).chain(rest).chain(self.hand_w.iter().copied()).all(f64::is_finite)
    }
}
