//! The arm itself: geometry, limits and mass properties of the Franka Emika Panda with its hand.

use crate::{
    geometry::{Mat3, Pose, Quat, Vec3},
    physics::joints::{JointKind, JointTree, Link},
};

use super::{GripperSpec, Side, gripper::MAX_WIDTH, pads};

/// Degrees of freedom of the arm; the fingers follow in the tree.
pub const ARM_DOFS: usize = 7;

/// Degrees of freedom of the whole tree.
pub const DOFS: usize = ARM_DOFS + 2;

/// The link that the hand is part of.
pub const HAND_LINK: usize = 6;

/// Height of the finger frames above the hand frame, m (Franka's description, `franka_hand.xacro`).
const FINGER_Z: f64 = 0.0584;

/// Modified Denavit–Hartenberg parameters (a, α, d) of each joint (Craig, Introduction to Robotics, 1986, §3.4;
/// values: Franka Control Interface documentation, "Denavit–Hartenberg parameters"), m and quarter turns.
const DH: [(f64, f64, f64); ARM_DOFS] = [
    (0.0, 0.0, 0.333),
    (0.0, -1.0, 0.0),
    (0.0, 1.0, 0.316),
    (0.0825, 1.0, 0.0),
    (-0.0825, -1.0, 0.384),
    (0.0, 1.0, 0.0),
    (0.088, 1.0, 0.0),
];

/// Distance of the flange from the last joint frame, m.
const FLANGE_Z: f64 = 0.107;

/// Joint limits: lower and upper position, rad; speed, rad/s; torque, N m (Franka Control Interface documentation,
/// "Limits for Panda").
const LIMITS: [(f64, f64, f64, f64); ARM_DOFS] = [
    (-2.8973, 2.8973, 2.175, 87.0),
    (-1.7628, 1.7628, 2.175, 87.0),
    (-2.8973, 2.8973, 2.175, 87.0),
    (-3.0718, -0.0698, 2.175, 87.0),
    (-2.8973, 2.8973, 2.61, 12.0),
    (-0.0175, 3.7525, 2.61, 12.0),
    (-2.8973, 2.8973, 2.61, 12.0),
];

/// Mass properties of a body in its link frame.
struct Body {
    /// kg.
    mass: f64,
    /// m.
    com: [f64; 3],
    /// xx, yy, zz, xy, xz, yz about the centre of mass, kg m².
    inertia: [f64; 6],
}

impl Body {
    fn com(&self) -> Vec3 {
        self.com.into()
    }

    fn inertia(&self) -> Mat3 {
        let [xx, yy, zz, xy, xz, yz] = self.inertia;
        Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}

/// Links 1 to 7 as identified by Gaz, Cognetti, Oliva, Robuffo Giordano and De Luca, Dynamic Identification of the
/// Franka Emika Panda Robot With Retrieval of Feasible Parameters Using Penalty-Based Optimization, IEEE RA-L 4(4),
/// 2019, in the rounding of Franka's own description (`franka_description`, `inertial.yaml`); none is adjusted. The
/// identification finds what the torques show: the split of mass between links is one feasible choice of many.
const BODIES: [Body; ARM_DOFS] = [
    Body {
        mass: 4.970684,
        com: [0.003875, 0.002081, -0.04762],
        inertia: [0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169],
    },
    Body {
        mass: 0.646926,
        com: [-0.003141, -0.02872, 0.003495],
        inertia: [0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704],
    },
    Body {
        mass: 3.228604,
        com: [0.027518, 0.039252, -0.066502],
        inertia: [0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805],
    },
    Body {
        mass: 3.587895,
        com: [-0.05317, 0.104419, 0.027454],
        inertia: [0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641],
    },
    Body {
        mass: 1.225946,
        com: [-0.011953, 0.041065, -0.038437],
        inertia: [0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229],
    },
    Body {
        mass: 1.666555,
        com: [0.060149, -0.014117, -0.010517],
        inertia: [0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341],
    },
    Body {
        mass: 0.735522,
        com: [0.010517, -0.004252, 0.061597],
        inertia: [0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741],
    },
];

/// The hand without fingers, in the hand frame (Franka's description, `franka_hand/inertials.yaml`).
const HAND: Body =
    Body { mass: 0.73, com: [-0.01, 0.0, 0.03], inertia: [0.001, 0.0025, 0.0017, 0.0, 0.0, 0.0] };

/// Index of a finger's link.
pub fn finger_link(side: Side) -> usize {
    ARM_DOFS + side.index()
}

/// Hand frame in the frame of [`HAND_LINK`].
pub fn hand_in_link() -> Pose {
    Pose::from_parts(
        Vec3::new(0.0, 0.0, FLANGE_Z).into(),
        Quat::from_axis_angle(&Vec3::z_axis(), -std::f64::consts::FRAC_PI_4),
    )
}

/// Tool frame in the hand frame: the nominal midpoint of the gel apexes, 103.4 mm out, where Franka's own tips have
/// theirs, so that tool poses mean the same with either.
pub fn tool_in_hand() -> Pose {
    Pose::translation(0.0, 0.0, FINGER_Z + pads::APEX_Z)
}

/// A finger's link in the hand frame, its gel's apex `q` (m) from the hand's middle plane.
pub fn finger_in_hand(side: Side, q: f64) -> Pose {
    Pose::translation(0.0, pads::outward(side) * q, FINGER_Z)
}

/// Tool frame in the frame of [`HAND_LINK`].
pub fn tool_in_link() -> Pose {
    hand_in_link() * tool_in_hand()
}

/// The arm, hand and both fingers as a joint tree: joints 1 to 7, left finger, right finger. A finger's coordinate
/// is the distance of its gel apex from the hand's middle plane, so that the width between the apexes is their sum.
///
/// Joint friction is left out, as the arm's own torque control compensates it.
pub fn tree(base_w: Pose, gripper: &GripperSpec) -> JointTree {
    let mut links: Vec<Link> = (0..ARM_DOFS).map(arm_link).collect();
    links[HAND_LINK].weld(HAND.mass, &HAND.com(), &HAND.inertia(), &hand_in_link());
    links.extend(Side::BOTH.map(|side| finger(side, gripper)));
    JointTree { links, base_w }
}

/// The seven arm links alone, in the base frame, for kinematics.
pub fn arm_chain() -> JointTree {
    JointTree { links: (0..ARM_DOFS).map(arm_link).collect(), base_w: Pose::identity() }
}

fn arm_link(index: usize) -> Link {
    let ((a, quarter_turns, d), (lower, upper, speed, torque)) = (DH[index], LIMITS[index]);
    let twist = Quat::from_axis_angle(&Vec3::x_axis(), quarter_turns * std::f64::consts::FRAC_PI_2);
    Link {
        name: format!("panda_link{}", index + 1),
        parent: index.checked_sub(1),
        placement: Pose::from_parts((twist * Vec3::new(a, 0.0, d)).into(), twist),
        kind: JointKind::Revolute(Vec3::z_axis()),
        mass: BODIES[index].mass,
        com: BODIES[index].com(),
        inertia: BODIES[index].inertia(),
        lower,
        upper,
        velocity_limit: speed,
        effort_limit: torque,
        friction: 0.0,
        damping: 0.0,
    }
}

fn finger(side: Side, gripper: &GripperSpec) -> Link {
    let (com, inertia) = pads::finger_mass(side, gripper.finger_mass);
    let axis = Vec3::y_axis();
    let (name, axis) = match side {
        Side::Left => ("panda_leftfinger", axis),
        Side::Right => ("panda_rightfinger", -axis),
    };
    Link {
        name: name.into(),
        parent: Some(HAND_LINK),
        placement: hand_in_link() * Pose::translation(0.0, 0.0, FINGER_Z),
        kind: JointKind::Prismatic(axis),
        mass: gripper.finger_mass,
        com,
        inertia,
        lower: 0.0,
        upper: MAX_WIDTH / 2.0,
        velocity_limit: gripper.speed,
        effort_limit: gripper.effort,
        friction: 0.0,
        damping: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::joints::{bias, forward, mass_matrix};

    /// Start pose of the SoftVTBench release, fingers open.
    const START: [f64; DOFS] = [-0.01988, -0.18734, 0.00767, -2.40340, 0.00496, 2.24534, 0.79485, 0.04, 0.04];

    fn whole() -> JointTree {
        tree(Pose::identity(), &GripperSpec::default())
    }

    fn tool(q: &[f64]) -> Pose {
        forward(&whole(), q)[HAND_LINK] * tool_in_link()
    }

    #[test]
    fn the_tool_is_where_two_published_poses_put_it() {
        let start = tool(&START);
        assert!((start.translation.vector - Vec3::new(0.4727, -0.0054, 0.2861)).amax() < 5e-5, "{start}");
        let down = start.rotation * Vec3::z();
        assert!(down.z < -0.999, "the tool points down: {down}");
        let default = tool(&[0.0, -0.569, 0.0, -2.810, 0.0, 3.037, 0.741, 0.04, 0.04]);
        assert!((default.translation.vector - Vec3::new(0.4633, 0.0, 0.3855)).amax() < 5e-5, "{default}");
        let tilt = (default.rotation * Vec3::z()).z.acos().to_degrees();
        assert!((tilt - 135.0).abs() < 1.0, "tilted by 45° from straight down: {tilt}°");
    }

    #[test]
    fn every_link_is_a_possible_body_and_the_arm_weighs_what_was_identified() {
        let tree = whole();
        tree.validate().expect("a possible mechanism");
        let arm: f64 = BODIES.iter().map(|body| body.mass).sum();
        assert!((arm - 16.062132).abs() < 1e-9);
        let total: f64 = tree.links.iter().map(|link| link.mass).sum();
        assert!((total - arm - 0.73 - 0.2).abs() < 1e-12);
    }

    #[test]
    fn fingers_open_symmetrically_and_the_tool_is_midway_between_the_apexes() {
        let poses = forward(&whole(), &START);
        let apex = |side| (poses[finger_link(side)] * pads::pad_pose_in_finger(side)).translation.vector;
        let (left, right) = (apex(Side::Left), apex(Side::Right));
        let tool = poses[HAND_LINK] * tool_in_link();
        assert!(((left - right).norm() - 0.08).abs() < 1e-12);
        assert!(((left + right) / 2.0 - tool.translation.vector).norm() < 1e-12);
        assert!((tool.rotation.inverse() * (left - right)).y > 0.0, "the left finger is on the hand's +y");
    }

    #[test]
    fn the_drives_can_hold_the_arm_and_every_mass_is_felt() {
        let tree = whole();
        let poses = forward(&tree, &START);
        let weight = bias(&tree, &poses, &[0.0; DOFS], &Vec3::new(0.0, 0.0, -9.81));
        for (link, torque) in tree.links.iter().zip(weight.iter()) {
            assert!(torque.abs() < 0.5 * link.effort_limit, "{}: {torque}", link.name);
        }
        let mass = mass_matrix(&tree, &poses);
        assert!(mass.clone().cholesky().is_some());
        assert!((mass[(7, 7)] - 0.1).abs() < 1e-12 && mass[(7, 8)].abs() < 0.1);
    }

    #[test]
    fn moving_the_base_moves_everything() {
        let base_w = Pose::translation(-0.66, 0.0, 0.012);
        let moved = forward(&tree(base_w, &GripperSpec::default()), &START);
        for (link, still) in moved.iter().zip(forward(&whole(), &START)) {
            assert!((link.translation.vector - (base_w * still).translation.vector).norm() < 1e-15);
        }
    }
}
