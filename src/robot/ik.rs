//! Inverse kinematics of the arm: from tool poses to joint targets.
//!
//! Poses are absolute, in the robot base frame. Every control step takes one damped least-squares step (Wampler,
//! Manipulator inverse kinematic solutions based on vector formulations and damped least-squares methods, IEEE SMC
//! 1986; Nakamura and Hanafusa, Inverse kinematic solutions with singularity robustness, ASME JDSMC 1986): `Δq = Jᵀ
//! (J Jᵀ + λ² I)⁻¹ e`, with `e` the position error and the rotation vector of the orientation error. A joint that the
//! step would drive past its limit is set to the limit, and the step of the other joints is solved again.

use nalgebra::{SMatrix, SVector, Vector6};

use super::{
    panda::{self, ARM_DOFS},
    rotation,
    spec::IkSpec,
};
use softvt_geometry::{Pose, Vec3};
use softvt_physics::joints::{JointTree, Link, forward, point_jacobian};

/// Joint angles of the arm, rad.
pub type ArmAngles = [f64; ARM_DOFS];

type Joints = SVector<f64, ARM_DOFS>;
type Jacobian = SMatrix<f64, 6, ARM_DOFS>;

/// Bounds on the difference of two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseTolerance {
    /// Largest distance of the positions, m.
    pub distance: f64,
    /// Largest angle between the orientations, rad.
    pub angle: f64,
}

impl PoseTolerance {
    /// True if neither bound is exceeded.
    pub fn contains(&self, error: &PoseDifference) -> bool {
        error.distance() <= self.distance && error.angle() <= self.angle
    }
}

/// Difference of two poses, in the frame that both are given in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseDifference {
    /// From the first position to the second, m.
    pub translation: Vec3,
    /// Rotation vector from the first orientation to the second, rad.
    pub rotation: Vec3,
}

impl PoseDifference {
    /// The error that leads from pose `now` to pose `target`.
    pub fn between(now: &Pose, target: &Pose) -> Self {
        Self {
            translation: target.translation.vector - now.translation.vector,
            rotation: rotation::error(&now.rotation, &target.rotation),
        }
    }

    /// Distance of the positions, m.
    pub fn distance(&self) -> f64 {
        self.translation.norm()
    }

    /// Angle between the orientations, rad, 0..=π.
    pub fn angle(&self) -> f64 {
        self.rotation.norm()
    }
}

/// Largest error that a single step of [`DiffIk`] acts on; larger errors are scaled down to it. The kinematics are
/// linearised at the present joint angles, which is accurate only nearby.
pub const LINEARISATION_RANGE: PoseTolerance = PoseTolerance { distance: 0.2, angle: 0.6 };

/// Error up to which [`DiffIk::solve`] accepts a solution.
const CONVERGED: PoseTolerance = PoseTolerance { distance: 1e-4, angle: 1e-3 };

/// Steps that [`DiffIk::solve`] takes from each start.
const SOLVE_STEPS: usize = 100;

/// Further starts of [`DiffIk::solve`] if the seed does not converge.
const RESTARTS: u32 = 48;

/// Differential inverse kinematics of the arm: turns tool poses into joint targets, one control step at a time.
///
/// Remembers its last command, so that the commanded speed, not the lead over the measured joints, is limited.
///
/// ```
/// use softvt_geometry::Vec3;
/// use softvt_robot::{DiffIk, IkSpec, ik::PoseDifference};
///
/// let start = [0.0, -0.2, 0.0, -2.4, 0.0, 2.2, 0.8];
/// let mut ik = DiffIk::new(&IkSpec::default(), start, 0.05);
/// let mut target_b = ik.tool_pose(&start);
/// target_b.translation.vector += Vec3::new(0.03, 0.02, -0.05);
/// let mut q = start;
/// for _ in 0..40 {
///     // Ideal drives: the joints reach their targets.
///     q = ik.step(&q, &target_b);
/// }
/// assert!(PoseDifference::between(&ik.tool_pose(&q), &target_b).distance() < 1e-5);
/// ```
#[derive(Clone, Debug)]
pub struct DiffIk {
    chain: JointTree,
    tool: Pose,
    spec: IkSpec,
    dt: f64,
    posture: Joints,
    command: Option<Joints>,
}

impl DiffIk {
    /// Creates an instance for control steps of `dt` (s). `posture` is the rest posture to which the null space
    /// drifts if [`IkSpec::posture_gain`] is not 0.
    pub fn new(spec: &IkSpec, posture: ArmAngles, dt: f64) -> Self {
        Self {
            chain: panda::arm_chain(),
            tool: panda::tool_in_link(),
            spec: spec.clone(),
            dt,
            posture: posture.into(),
            command: None,
        }
    }

    /// Clears the last command, as at the start of an episode.
    pub fn reset(&mut self) {
        self.command = None;
    }

    /// Tool pose in the base frame at joint angles `q`.
    pub fn tool_pose(&self, q: &ArmAngles) -> Pose {
        forward(&self.chain, q)[ARM_DOFS - 1] * self.tool
    }

    /// Joint targets (rad) for the next control step, which move the tool from measured joint angles `q_now`
    /// towards `target_b` (base frame).
    ///
    /// The command continues from the last one (at first from `q_now`). If a joint would exceed its speed limit, the
    /// change of all joints is scaled down by one factor, which keeps the direction. The speed of the command is
    /// limited, not its lead over `q_now`, so that lagging drives still reach full speed. All numbers must be finite.
    pub fn step(&mut self, q_now: &ArmAngles, target_b: &Pose) -> ArmAngles {
        let command = self.preview(q_now, target_b);
        self.command = Some(command.into());
        command
    }

    /// Result of [`step`](Self::step), without the step.
    pub fn preview(&self, q_now: &ArmAngles, target_b: &Pose) -> ArmAngles {
        let q: Joints = (*q_now).into();
        let last = self.command.unwrap_or(q);
        let change = q + self.increment(&q, target_b) - last;
        self.clamp_to_limits(&(last + change * self.allowed_share(&change))).into()
    }

    /// Joint targets (rad) for the next control step towards the joint positions `joints`, from measured ones `q_now`,
    /// within the limits of position and speed as for [`step`](Self::step). The targets that `step` returned in the
    /// same states are reached bit for bit. All numbers must be finite.
    pub fn step_joints(&mut self, q_now: &ArmAngles, joints: &ArmAngles) -> ArmAngles {
        /// Excess over a speed limit that rounding explains.
        const ROUNDING: f64 = 1e-9;
        let wanted = self.clamp_to_limits(&(*joints).into());
        let last = self.command.unwrap_or_else(|| (*q_now).into());
        let change = wanted - last;
        let share = self.allowed_share(&change);
        let command = if share > 1.0 - ROUNDING { wanted } else { last + change * share };
        self.command = Some(command);
        command.into()
    }

    /// Joint positions (rad) whose tool pose is moved from that of `joints` as `target_b` is, by one damped step.
    pub fn moved(&self, joints: &ArmAngles, target_b: &Pose) -> ArmAngles {
        let q = self.clamp_to_limits(&(*joints).into());
        (q + self.increment(&q, target_b)).into()
    }

    /// The share of a change of the command that no joint's speed limit forbids, at most 1.
    fn allowed_share(&self, change: &Joints) -> f64 {
        let allowed =
            |(delta, link): (&f64, &Link)| link.velocity_limit * self.dt / delta.abs().max(f64::MIN_POSITIVE);
        change.iter().zip(&self.chain.links).map(allowed).fold(1.0, f64::min)
    }

    /// Joint angles (rad) with the tool at `target_b` (base frame), to 0.1 mm and 1 mrad.
    ///
    /// Iterates from `seed` and, if that does not converge, from postures spread over the joints' ranges.
    ///
    /// # Errors
    /// If no start converges; the error holds the distance of the nearest pose found.
    pub fn solve(&self, seed: &ArmAngles, target_b: &Pose) -> Result<ArmAngles, UnreachablePose> {
        let mut nearest: Option<UnreachablePose> = None;
        for start in std::iter::once((*seed).into()).chain(self.postures()) {
            let mut q = self.clamp_to_limits(&start);
            for _ in 0..SOLVE_STEPS {
                q += self.increment(&q, target_b);
                if CONVERGED.contains(&self.residual(&q, target_b)) {
                    return Ok(q.into());
                }
            }
            let miss = UnreachablePose::new(target_b, &self.residual(&q, target_b));
            if nearest.as_ref().is_none_or(|nearest| miss.cost() < nearest.cost()) {
                nearest = Some(miss);
            }
        }
        // The loop runs at least once, for the seed.
        Err(nearest
            .unwrap_or_else(|| UnreachablePose::new(target_b, &self.residual(&(*seed).into(), target_b))))
    }

    /// Start postures, spread evenly over the joints' ranges by the additive recurrence of the generalised golden ratio
    /// (Roberts, The unreasonable effectiveness of quasirandom sequences, 2018).
    fn postures(&self) -> impl Iterator<Item = Joints> {
        // The root above 1 of x⁸ = x + 1, for seven dimensions.
        const RATIO: f64 = 1.096_981_557_798_56;
        (1..=RESTARTS).map(|index| {
            Joints::from_fn(|i, _| {
                let share = (0.5 + f64::from(index) * RATIO.powi(-(i as i32 + 1))).fract();
                let link = &self.chain.links[i];
                link.lower + share * (link.upper - link.lower)
            })
        })
    }

    /// One damped step (rad) from `q` towards `target_b`. It ends within the joint limits if `q` lies within them.
    fn increment(&self, q: &Joints, target_b: &Pose) -> Joints {
        let (error, jacobian) = self.linearise(q, target_b);
        let mut free = [true; ARM_DOFS];
        let mut increment = Joints::zeros();
        for _ in 0..=ARM_DOFS {
            let step = self.damped_step(&jacobian, &error, q, &increment, &free);
            (0..ARM_DOFS).filter(|&i| free[i]).for_each(|i| increment[i] = step[i]);
            let Some((joint, to_limit)) = self.worst_violation(q, &increment, &free) else { break };
            free[joint] = false;
            increment[joint] = to_limit;
        }
        increment
    }

    /// The step of the free joints. The error is reduced by what the fixed part of `increment` already contributes.
    fn damped_step(
        &self,
        jacobian: &Jacobian,
        error: &Vector6<f64>,
        q: &Joints,
        increment: &Joints,
        free: &[bool; ARM_DOFS],
    ) -> Joints {
        let fixed = Joints::from_fn(|i, _| if free[i] { 0.0 } else { increment[i] });
        let mut free_jacobian = *jacobian;
        (0..ARM_DOFS).filter(|&i| !free[i]).for_each(|i| free_jacobian.column_mut(i).fill(0.0));
        let drift =
            Joints::from_fn(
                |i, _| {
                    if free[i] { self.spec.posture_gain * (self.posture[i] - q[i]) } else { 0.0 }
                },
            );
        let remaining = error - jacobian * fixed - free_jacobian * drift;
        let damped = free_jacobian * free_jacobian.transpose()
            + SMatrix::<f64, 6, 6>::identity() * self.spec.lambda.powi(2);
        // λ > 0 makes the matrix positive definite, so the factorisation fails only for numbers that are not finite.
        let Some(factor) = damped.cholesky() else { return Joints::zeros() };
        drift + free_jacobian.transpose() * factor.solve(&remaining)
    }

    /// The free joint that `increment` drives farthest past a limit, and the increment that ends at the limit.
    fn worst_violation(
        &self,
        q: &Joints,
        increment: &Joints,
        free: &[bool; ARM_DOFS],
    ) -> Option<(usize, f64)> {
        let violation = |i: usize| {
            let (link, end) = (&self.chain.links[i], q[i] + increment[i]);
            let clamped = end.clamp(link.lower, link.upper);
            (i, (end - clamped).abs(), clamped - q[i])
        };
        (0..ARM_DOFS)
            .filter(|&i| free[i])
            .map(violation)
            .filter(|(_, excess, _)| *excess > 0.0)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(i, _, to_limit)| (i, to_limit))
    }

    /// The pose error, scaled down to [`LINEARISATION_RANGE`], and the Jacobian of the tool.
    fn linearise(&self, q: &Joints, target_b: &Pose) -> (Vector6<f64>, Jacobian) {
        let poses = forward(&self.chain, q.as_slice());
        let tool = poses[ARM_DOFS - 1] * self.tool;
        let jacobian = point_jacobian(&self.chain, &poses, ARM_DOFS - 1, &tool.translation.vector);
        let error = PoseDifference::between(&tool, target_b);
        let range = LINEARISATION_RANGE;
        let share = (range.distance / error.distance()).min(range.angle / error.angle()).min(1.0);
        let (linear, angular) = (error.translation, error.rotation);
        let error = Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z) * share;
        (error, Jacobian::from_column_slice(jacobian.as_slice()))
    }

    fn residual(&self, q: &Joints, target_b: &Pose) -> PoseDifference {
        PoseDifference::between(&self.tool_pose(&(*q).into()), target_b)
    }

    fn clamp_to_limits(&self, q: &Joints) -> Joints {
        Joints::from_fn(|i, _| q[i].clamp(self.chain.links[i].lower, self.chain.links[i].upper))
    }
}

/// A tool pose outside of the arm's workspace.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "unreachable pose: the tool gets no nearer to ({:.3}, {:.3}, {:.3}) m (robot base frame) than {:.1} mm and \
     {:.1}°; move it towards the robot or turn it towards straight down",
    target_b.x, target_b.y, target_b.z, distance * 1e3, angle.to_degrees()
)]
pub struct UnreachablePose {
    /// Requested tool position, base frame, m.
    pub target_b: Vec3,
    /// Distance between the requested position and that of the nearest pose found, m.
    pub distance: f64,
    /// Angle between the requested orientation and that of the nearest pose found, rad.
    pub angle: f64,
}

impl UnreachablePose {
    fn new(target_b: &Pose, miss: &PoseDifference) -> Self {
        Self { target_b: target_b.translation.vector, distance: miss.distance(), angle: miss.angle() }
    }

    /// Ranks misses; a radian counts as a fifth of a metre, about the size of the hand.
    fn cost(&self) -> f64 {
        self.distance + 0.2 * self.angle
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use softvt_geometry::Quat;

    const START: ArmAngles = [-0.01988, -0.18734, 0.00767, -2.40340, 0.00496, 2.24534, 0.79485];
    const DT: f64 = 0.05;
    const NEAR: PoseTolerance = PoseTolerance { distance: 1e-5, angle: 1e-5 };

    fn ik() -> DiffIk {
        DiffIk::new(&IkSpec::default(), START, DT)
    }

    fn down(x: f64, y: f64, z: f64, yaw: f64) -> Pose {
        let turn = Quat::from_axis_angle(&Vec3::z_axis(), yaw)
            * Quat::new_unchecked(nalgebra::Quaternion::new(0.0, 1.0, 0.0, 0.0));
        Pose::from_parts(Vec3::new(x, y, z).into(), turn)
    }

    /// Follows `target` with joints that cover a share `follow` of the way to their target per control step.
    fn follow(ik: &mut DiffIk, mut q: ArmAngles, target: &Pose, steps: usize, follow: f64) -> ArmAngles {
        for _ in 0..steps {
            let command = ik.step(&q, target);
            q = std::array::from_fn(|i| q[i] + follow * (command[i] - q[i]));
        }
        q
    }

    #[test]
    fn the_tool_reaches_a_pose_and_stays_there_even_with_lagging_joints() {
        for lag in [1.0, 0.4] {
            let target = down(0.55, 0.2, 0.05, 0.6);
            let mut ik = ik();
            let q = follow(&mut ik, START, &target, 60, lag);
            let error = PoseDifference::between(&ik.tool_pose(&q), &target);
            assert!(NEAR.contains(&error), "{error:?}");
        }
    }

    #[test]
    fn joint_targets_are_reached_bit_for_bit_and_limited_in_position_and_speed() {
        let (mut by_pose, mut by_joints) = (ik(), ik());
        let target = down(0.4, -0.45, 0.3, -1.0);
        let mut q = START;
        for _ in 0..40 {
            assert_eq!(by_pose.preview(&q, &target), by_pose.clone().step(&q, &target));
            let command = by_pose.step(&q, &target);
            assert_eq!(by_joints.step_joints(&q, &command), command);
            q = std::array::from_fn(|i| q[i] + 0.4 * (command[i] - q[i]));
        }
        let mut ik = ik();
        let mut far = START;
        far[3] = 5.0;
        let first = ik.step_joints(&START, &far);
        assert!((first[3] - START[3] - 2.175 * DT).abs() < 1e-12, "{first:?}");
        let last = (0..60).fold(first, |q, _| ik.step_joints(&q, &far));
        assert_eq!(last[3], -0.0698);
    }

    #[test]
    fn moved_joints_follow_a_small_displacement_of_the_tool() {
        let ik = ik();
        let mut target = panda::tool_pose(&START);
        target.translation.vector += Vec3::new(0.003, -0.002, 0.001);
        let error = PoseDifference::between(&panda::tool_pose(&ik.moved(&START, &target)), &target);
        assert!(error.distance() < 1e-4 && error.angle() < 1e-3, "{error:?}");
    }

    #[test]
    fn commands_respect_the_speed_limits_of_the_joints() {
        let mut ik = ik();
        let target = down(0.4, -0.45, 0.3, -1.0);
        let (mut q, mut last, mut fastest) = (START, START, 0.0_f64);
        for _ in 0..40 {
            let command = ik.step(&q, &target);
            for (i, link) in ik.chain.links.iter().enumerate() {
                let share = (command[i] - last[i]).abs() / (link.velocity_limit * DT);
                assert!(share <= 1.0 + 1e-12);
                fastest = fastest.max(share);
            }
            (q, last) = (command, command);
        }
        assert!(fastest > 0.999, "a far target is approached at the limit: {fastest}");
    }

    #[test]
    fn a_joint_at_its_limit_stays_there_and_the_others_reach_the_pose() {
        let mut stopped = ik();
        // The first joint is at its stop, and the target requires it to turn farther.
        stopped.chain.links[0].upper = START[0];
        let target = down(0.45, 0.12, 0.25, 0.0);
        let free = ik().solve(&START, &target).expect("reachable");
        assert!(free[0] > START[0] + 0.1, "without the stop the joint passes it: {}", free[0]);
        let mut q = START;
        for _ in 0..100 {
            q = stopped.step(&q, &target);
            assert!(q[0] <= START[0]);
        }
        let error = PoseDifference::between(&stopped.tool_pose(&q), &target);
        assert!(NEAR.contains(&error), "{error:?}");
    }

    #[test]
    fn the_null_space_drifts_to_the_posture_without_moving_the_tool() {
        let spec = IkSpec { posture_gain: 0.2, ..IkSpec::default() };
        let mut bent = START;
        bent[2] += 0.5;
        let target = ik().tool_pose(&START);
        let away = ik().solve(&bent, &target).expect("reachable");
        let distance = |q: &ArmAngles| (Joints::from(*q) - Joints::from(START)).norm();
        assert!(distance(&away) > 0.2, "the search must end in another posture: {}", distance(&away));
        let mut drifting = DiffIk::new(&spec, START, DT);
        let back = follow(&mut drifting, away, &target, 100, 1.0);
        assert!(distance(&back) < 0.01 * distance(&away), "{}", distance(&back));
        let error = PoseDifference::between(&drifting.tool_pose(&back), &target);
        assert!(error.distance() < 1e-5 && error.angle() < 1e-4);
    }

    #[test]
    fn unreachable_poses_are_refused_with_the_distance_to_the_nearest() {
        let far = ik().solve(&START, &down(1.4, 0.0, 0.2, 0.0)).expect_err("too far");
        assert!(far.distance > 0.4, "{far}");
        assert!(
            far.to_string()
                .starts_with("unreachable pose: the tool gets no nearer to (1.400, 0.000, 0.200) m")
        );
        let inside = ik().solve(&START, &down(0.0, 0.0, 0.1, 0.0)).expect_err("inside the base");
        assert!(inside.distance > 0.01 || inside.angle > 0.1, "{inside}");
    }

    #[test]
    fn the_whole_table_in_front_of_the_arm_is_reachable() {
        let ik = ik();
        for ix in 0..5 {
            for iy in 0..7 {
                for (height, yaw) in [(0.02, 0.0), (0.02, 0.5), (0.25, -0.5)] {
                    let (x, y) = (0.35 + 0.1 * f64::from(ix), -0.35 + 0.35 * f64::from(iy) / 3.0);
                    let found = ik.solve(&START, &down(x, y, height, yaw));
                    assert!(
                        found.is_ok() || x.hypot(y) > 0.72,
                        "({x}, {y}, {height}): {}",
                        found.unwrap_err()
                    );
                }
            }
        }
    }

    #[test]
    fn every_pose_of_joint_angles_within_limits_is_found() {
        let ik = ik();
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        for _ in 0..2000 {
            let q: ArmAngles = std::array::from_fn(|i| {
                let link = &ik.chain.links[i];
                rng.random_range(link.lower..link.upper)
            });
            let target = ik.tool_pose(&q);
            let found = ik.solve(&START, &target).unwrap_or_else(|missed| panic!("{q:?}: {missed}"));
            assert!(CONVERGED.contains(&ik.residual(&found.into(), &target)));
            assert!(found.iter().zip(&ik.chain.links).all(|(q, link)| (link.lower..=link.upper).contains(q)));
        }
    }
}
