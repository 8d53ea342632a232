//! Kinematics, limits and mass properties of the Franka Emika Panda with its hand, as a joint tree.

use std::sync::LazyLock;

use softvt_geometry::{Mat3, Pose, Quat, Vec3};
use softvt_physics::joints::{JointKind, JointTree, Link, forward};

use super::{
    gripper::MAX_WIDTH,
    pads::{self, CollisionBox},
    spec::{GripperSpec, Side},
};

/// Distance from the origin of the base that the tool reaches at most, m: 0.855 m (data sheet) from the shoulder, which
/// is 0.333 m above the base.
pub const REACH: f64 = 1.188;

/// Degrees of freedom of the arm; those of the fingers follow in the tree.
pub const ARM_DOFS: usize = 7;

/// Index of the link that includes the hand.
pub const HAND_LINK: usize = 6;

/// Height of the finger frames above the hand frame, m (Franka's description, `franka_hand.xacro`).
const FINGER_Z: f64 = 0.0584;

/// Half extents of the hand's body, hand axes, m (bounding box of Franka's hand without its camera mount).
const HAND_HALF: Vec3 = Vec3::new(0.0316, 0.1025, 0.033);

/// Modified Denavit–Hartenberg parameters of a joint (Craig, Introduction to Robotics, 1986, §3.4).
struct DenavitHartenberg {
    /// Length of the link, m.
    a: f64,
    /// α in quarter turns, which are exact.
    quarter_turns: f64,
    /// Offset along the joint axis, m.
    d: f64,
}

/// Values: Franka Control Interface documentation, "Denavit–Hartenberg parameters".
const DH: [DenavitHartenberg; ARM_DOFS] = [
    DenavitHartenberg { a: 0.0, quarter_turns: 0.0, d: 0.333 },
    DenavitHartenberg { a: 0.0, quarter_turns: -1.0, d: 0.0 },
    DenavitHartenberg { a: 0.0, quarter_turns: 1.0, d: 0.316 },
    DenavitHartenberg { a: 0.0825, quarter_turns: 1.0, d: 0.0 },
    DenavitHartenberg { a: -0.0825, quarter_turns: -1.0, d: 0.384 },
    DenavitHartenberg { a: 0.0, quarter_turns: 1.0, d: 0.0 },
    DenavitHartenberg { a: 0.088, quarter_turns: 1.0, d: 0.0 },
];

/// Distance of the flange from the last joint frame, m.
const FLANGE_Z: f64 = 0.107;

/// Limits of a joint.
struct JointLimits {
    /// Least angle, rad.
    lower: f64,
    /// Largest angle, rad.
    upper: f64,
    /// Largest speed, rad/s.
    speed: f64,
    /// Largest torque, N m.
    torque: f64,
}

/// Values: Franka Control Interface documentation, "Limits for Panda".
const LIMITS: [JointLimits; ARM_DOFS] = [
    JointLimits { lower: -2.8973, upper: 2.8973, speed: 2.175, torque: 87.0 },
    JointLimits { lower: -1.7628, upper: 1.7628, speed: 2.175, torque: 87.0 },
    JointLimits { lower: -2.8973, upper: 2.8973, speed: 2.175, torque: 87.0 },
    JointLimits { lower: -3.0718, upper: -0.0698, speed: 2.175, torque: 87.0 },
    JointLimits { lower: -2.8973, upper: 2.8973, speed: 2.61, torque: 12.0 },
    JointLimits { lower: -0.0175, upper: 3.7525, speed: 2.61, torque: 12.0 },
    JointLimits { lower: -2.8973, upper: 2.8973, speed: 2.61, torque: 12.0 },
];

/// Mass properties of a link, in its link frame.
struct LinkInertia {
    /// Mass of the link, kg.
    mass: f64,
    /// Centre of mass, m.
    com: [f64; 3],
    /// xx, yy, zz, xy, xz, yz about the centre of mass, kg m².
    inertia: [f64; 6],
}

impl LinkInertia {
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
/// 2019, rounded and unadjusted as in Franka's own description (`franka_description`, `inertial.yaml`). Torques
/// determine only combinations of these parameters: the split of mass between links is one feasible choice of many.
const LINK_INERTIAS: [LinkInertia; ARM_DOFS] = [
    LinkInertia {
        mass: 4.970684,
        com: [0.003875, 0.002081, -0.04762],
        inertia: [0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169],
    },
    LinkInertia {
        mass: 0.646926,
        com: [-0.003141, -0.02872, 0.003495],
        inertia: [0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704],
    },
    LinkInertia {
        mass: 3.228604,
        com: [0.027518, 0.039252, -0.066502],
        inertia: [0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805],
    },
    LinkInertia {
        mass: 3.587895,
        com: [-0.05317, 0.104419, 0.027454],
        inertia: [0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641],
    },
    LinkInertia {
        mass: 1.225946,
        com: [-0.011953, 0.041065, -0.038437],
        inertia: [0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229],
    },
    LinkInertia {
        mass: 1.666555,
        com: [0.060149, -0.014117, -0.010517],
        inertia: [0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341],
    },
    LinkInertia {
        mass: 0.735522,
        com: [0.010517, -0.004252, 0.061597],
        inertia: [0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741],
    },
];

/// Hand without fingers, in the hand frame (Franka's description, `franka_hand/inertials.yaml`).
const HAND: LinkInertia =
    LinkInertia { mass: 0.73, com: [-0.01, 0.0, 0.03], inertia: [0.001, 0.0025, 0.0017, 0.0, 0.0, 0.0] };

/// Index of the link of a finger.
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

/// Tool frame in the hand frame: at the nominal midpoint of the gel apexes, 103.4 mm along z. Franka's own finger tips
/// have the same tool point, so that tool poses are comparable.
pub fn tool_in_hand() -> Pose {
    Pose::translation(0.0, 0.0, FINGER_Z + pads::APEX_Z)
}

/// Link frame of a finger in the hand frame, with its gel apex at distance `q` (m) from the middle plane of the hand.
pub fn finger_in_hand(side: Side, q: f64) -> Pose {
    Pose::translation(0.0, pads::outward(side) * q, FINGER_Z)
}

/// Tool frame in the frame of [`HAND_LINK`].
pub fn tool_in_link() -> Pose {
    hand_in_link() * tool_in_hand()
}

/// Collision boxes of the hand's body, in the frame of [`HAND_LINK`].
pub fn hand_boxes() -> [CollisionBox; 1] {
    [CollisionBox { half: HAND_HALF, pose: hand_in_link() * Pose::translation(0.0, 0.0, HAND_HALF.z) }]
}

/// The joint tree of arm, hand and fingers, with its base at `base_w` (world): joints 1 to 7 (rad), left
/// finger, right finger (m).
///
/// The coordinate of a finger is the distance of its gel apex from the middle plane of the hand; the width between the
/// apexes is the sum of both. The model has no joint friction, since the torque control of the real arm compensates it.
///
/// ```
/// use softvt_geometry::Pose;
/// use softvt_physics::joints::forward;
/// use softvt_robot::{GripperSpec, panda};
///
/// let tree = panda::tree(Pose::identity(), &GripperSpec::default());
/// let q = [0.0, -0.569, 0.0, -2.810, 0.0, 3.037, 0.741, 0.04, 0.04];
/// let tool = forward(&tree, &q)[panda::HAND_LINK] * panda::tool_in_link();
/// assert!((tool.translation.x - 0.4633).abs() < 1e-4 && (tool.translation.z - 0.3855).abs() < 1e-4);
/// ```
pub fn tree(base_w: Pose, gripper: &GripperSpec) -> JointTree {
    let mut links: Vec<Link> = (0..ARM_DOFS).map(arm_link).collect();
    links[HAND_LINK].weld(HAND.mass, &HAND.com(), &HAND.inertia(), &hand_in_link());
    links.extend(Side::BOTH.map(|side| finger(side, gripper)));
    JointTree { links, base_w }
}

/// Range of an arm joint, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointRange {
    /// Least angle, rad.
    pub lower: f64,
    /// Largest angle, rad.
    pub upper: f64,
}

impl JointRange {
    /// Excess over a limit that rounding to single precision explains, rad.
    const ROUNDING: f64 = 1e-6;

    /// True for a joint position within the limits, but for rounding.
    pub fn contains(&self, position: f64) -> bool {
        (self.lower - Self::ROUNDING..=self.upper + Self::ROUNDING).contains(&position)
    }
}

/// Ranges of the arm joints.
pub fn joint_ranges() -> [JointRange; ARM_DOFS] {
    LIMITS.each_ref().map(|limits| JointRange { lower: limits.lower, upper: limits.upper })
}

/// Pose of the tool in the base frame at arm joint positions `q` (rad).
pub fn tool_pose(q: &[f64; ARM_DOFS]) -> Pose {
    static CHAIN: LazyLock<JointTree> = LazyLock::new(arm_chain);
    forward(&CHAIN, q)[HAND_LINK] * tool_in_link()
}

/// The joint tree of the seven arm links without hand and fingers, in the base frame, for kinematics.
pub fn arm_chain() -> JointTree {
    JointTree { links: (0..ARM_DOFS).map(arm_link).collect(), base_w: Pose::identity() }
}

fn arm_link(index: usize) -> Link {
    let (DenavitHartenberg { a, quarter_turns, d }, limits) = (&DH[index], &LIMITS[index]);
    let twist = Quat::from_axis_angle(&Vec3::x_axis(), quarter_turns * std::f64::consts::FRAC_PI_2);
    Link {
        name: format!("panda_link{}", index + 1),
        parent: index.checked_sub(1),
        placement: Pose::from_parts((twist * Vec3::new(*a, 0.0, *d)).into(), twist),
        kind: JointKind::Revolute(Vec3::z_axis()),
        mass: LINK_INERTIAS[index].mass,
        com: LINK_INERTIAS[index].com(),
        inertia: LINK_INERTIAS[index].inertia(),
        lower: limits.lower,
        upper: limits.upper,
        velocity_limit: limits.speed,
        effort_limit: limits.torque,
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
    use softvt_physics::joints::{bias, mass_matrix};

    /// Start pose of the SoftVTBench release, fingers open.
    const START: [f64; ARM_DOFS + 2] =
        [-0.01988, -0.18734, 0.00767, -2.40340, 0.00496, 2.24534, 0.79485, 0.04, 0.04];

    fn whole() -> JointTree {
        tree(Pose::identity(), &GripperSpec::default())
    }

    fn tool(q: &[f64]) -> Pose {
        forward(&whole(), q)[HAND_LINK] * tool_in_link()
    }

    #[test]
    fn forward_kinematics_match_two_published_tool_poses() {
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
    fn every_link_is_physically_feasible_and_masses_add_up() {
        let tree = whole();
        tree.validate().expect("a feasible mechanism");
        let arm: f64 = LINK_INERTIAS.iter().map(|body| body.mass).sum();
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
    fn drives_hold_the_arm_and_the_mass_matrix_includes_the_fingers() {
        let tree = whole();
        let poses = forward(&tree, &START);
        let weight = bias(&tree, &poses, &[0.0; START.len()], &Vec3::new(0.0, 0.0, -9.81));
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
