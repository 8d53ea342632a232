//! Inverse kinematics of the arm: from tool poses to joint targets.
//!
//! Poses are absolute, in the robot base frame. One damped least-squares step is taken each control step (Wampler,
//! Manipulator inverse kinematic solutions based on vector formulations and damped least-squares methods, IEEE SMC
//! 1986; Nakamura and Hanafusa, Inverse kinematic solutions with singularity robustness, ASME JDSMC 1986):
//! `Δq = Jᵀ (J Jᵀ + λ² I)⁻¹ e`, with `e` the position error and the rotation vector of the orientation error. A
//! joint that the step would drive past its limit is put on the limit and the others make up for it.

use nalgebra::{DMatrix, SMatrix, SVector, Vector6};

use super::{IkSpec, panda, panda::ARM_DOFS, rotation};
use crate::{
    geometry::{Pose, Vec3},
    physics::joints::{JointTree, forward, forward_into, point_jacobian_into},
};

/// Joint angles of the arm, rad.
pub type ArmAngles = [f64; ARM_DOFS];

type Joints = SVector<f64, ARM_DOFS>;
type Jacobian = SMatrix<f64, 6, ARM_DOFS>;

/// A single step looks no farther than this: a linearisation holds only nearby, m and rad.
pub const REACH: (f64, f64) = (0.2, 0.6);

/// Closer than this a pose counts as reached, m and rad.
const REACHED: (f64, f64) = (1e-4, 1e-3);

/// Steps that [`DiffIk::solve`] takes from each start.
const SOLVE_STEPS: usize = 100;

/// Further starts of [`DiffIk::solve`] when the first fails.
const POSTURES: u32 = 48;

/// Differential inverse kinematics with its last command.
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
    /// For control steps of `dt` (s); `posture` is where the null space drifts to if the gain is not 0.
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

    /// Forgets the last command, as at the start of an episode.
    pub fn reset(&mut self) {
        self.command = None;
    }

    /// Tool pose in the base frame at joint angles `q`.
    pub fn tool_pose(&self, q: &ArmAngles) -> Pose {
        forward(&self.chain, q)[ARM_DOFS - 1] * self.tool
    }

    /// Joint targets for the coming control step that lead the tool from `q_now` towards `target_b`.
    ///
    /// The command moves on from the last one (from `q_now` at first) no faster than the slowest joint's speed limit
    /// allows, all joints scaled alike so that the direction stays. Limiting the command and not its lead over
    /// `q_now` keeps the full speed in spite of the drives' lag. All numbers must be finite: a policy's are checked
    /// where they enter.
    pub fn step(&mut self, q_now: &ArmAngles, target_b: &Pose) -> ArmAngles {
        let q: Joints = (*q_now).into();
        let last = self.command.unwrap_or(q);
        let wanted = q + self.increment(&q, target_b) - last;
        let pace = |(delta, link): (&f64, &crate::physics::joints::Link)| {
            link.velocity_limit * self.dt / delta.abs().max(f64::MIN_POSITIVE)
        };
        let share = wanted.iter().zip(&self.chain.links).map(pace).fold(1.0, f64::min);
        let command = self.within_limits(&(last + wanted * share));
        self.command = Some(command);
        command.into()
    }

    /// Joint angles that put the tool at `target_b`, searched from `seed` and then from postures all over the joints' ranges.
    ///
    /// # Errors
    /// The pose is out of reach: says by how much the nearest pose found misses it.
    pub fn solve(&self, seed: &ArmAngles, target_b: &Pose) -> Result<ArmAngles, UnreachablePose> {
        let mut nearest: Option<UnreachablePose> = None;
        for start in std::iter::once((*seed).into()).chain(self.postures()) {
            let mut q = self.within_limits(&start);
            for _ in 0..SOLVE_STEPS {
                q += self.increment(&q, target_b);
                if self.residual(&q, target_b).is_reached() {
                    return Ok(q.into());
                }
            }
            let miss = self.residual(&q, target_b);
            if nearest.as_ref().is_none_or(|nearest| miss.cost() < nearest.cost()) {
                nearest = Some(miss);
            }
        }
        // The seed itself always gives one.
        Err(nearest.unwrap_or_else(|| self.residual(&(*seed).into(), target_b)))
    }

    /// Starts for a search, spread evenly over the joints' ranges by the additive recurrence of the generalised golden
    /// ratio (Roberts, The unreasonable effectiveness of quasirandom sequences, 2018).
    fn postures(&self) -> impl Iterator<Item = Joints> {
        // The root above 1 of x⁸ = x + 1, for seven dimensions.
        const RATIO: f64 = 1.096_981_557_798_56;
        (1..=POSTURES).map(|turn| {
            Joints::from_fn(|i, _| {
                let share = (0.5 + f64::from(turn) * RATIO.powi(-(i as i32 + 1))).fract();
                let link = &self.chain.links[i];
                link.lower + share * (link.upper - link.lower)
            })
        })
    }

    /// One damped step from `q` towards `target_b`, rad; it ends within the joint limits if `q` lies within them.
    fn increment(&self, q: &Joints, target_b: &Pose) -> Joints {
        let (error, jacobian) = self.linearise(q, target_b);
        let mut free = [true; ARM_DOFS];
        let mut increment = Joints::zeros();
        for _ in 0..=ARM_DOFS {
            let moved = self.damped_step(&jacobian, &error, q, &increment, &free);
            (0..ARM_DOFS).filter(|&i| free[i]).for_each(|i| increment[i] = moved[i]);
            let Some((worst, held)) = self.worst_breach(q, &increment, &free) else { break };
            free[worst] = false;
            increment[worst] = held;
        }
        increment
    }

    /// The step of the free joints; the others' part of `increment` stands and is taken off the error.
    fn damped_step(
        &self,
        jacobian: &Jacobian,
        error: &Vector6<f64>,
        q: &Joints,
        increment: &Joints,
        free: &[bool; ARM_DOFS],
    ) -> Joints {
        let held = Joints::from_fn(|i, _| if free[i] { 0.0 } else { increment[i] });
        let mut open = *jacobian;
        (0..ARM_DOFS).filter(|&i| !free[i]).for_each(|i| open.column_mut(i).fill(0.0));
        let drift =
            Joints::from_fn(
                |i, _| {
                    if free[i] { self.spec.posture_gain * (self.posture[i] - q[i]) } else { 0.0 }
                },
            );
        let left = error - jacobian * held - open * drift;
        let damped = open * open.transpose() + SMatrix::<f64, 6, 6>::identity() * self.spec.lambda.powi(2);
        // λ > 0 makes the matrix positive definite; without a factor the arm stays where it is.
        let Some(factor) = damped.cholesky() else { return Joints::zeros() };
        drift + open.transpose() * factor.solve(&left)
    }

    /// The free joint that `increment` drives farthest past a limit, and the increment that ends on the limit.
    fn worst_breach(&self, q: &Joints, increment: &Joints, free: &[bool; ARM_DOFS]) -> Option<(usize, f64)> {
        let breach = |i: usize| {
            let (link, end) = (&self.chain.links[i], q[i] + increment[i]);
            let held = end.clamp(link.lower, link.upper);
            (i, (end - held).abs(), held - q[i])
        };
        (0..ARM_DOFS)
            .filter(|&i| free[i])
            .map(breach)
            .filter(|(_, excess, _)| *excess > 0.0)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(i, _, held)| (i, held))
    }

    /// The error that the step is to remove, cut to what a linearisation can bear, and the tool's Jacobian.
    fn linearise(&self, q: &Joints, target_b: &Pose) -> (Vector6<f64>, Jacobian) {
        let mut poses = Vec::with_capacity(ARM_DOFS);
        forward_into(&self.chain, q.as_slice(), &mut poses);
        let tool = poses[ARM_DOFS - 1] * self.tool;
        let mut jacobian = DMatrix::zeros(6, ARM_DOFS);
        point_jacobian_into(&self.chain, &poses, ARM_DOFS - 1, &tool.translation.vector, &mut jacobian);
        let (linear, angular) = pose_error(&tool, target_b);
        let share = (REACH.0 / linear.norm()).min(REACH.1 / angular.norm()).min(1.0);
        let error = Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z) * share;
        (error, Jacobian::from_column_slice(jacobian.as_slice()))
    }

    fn residual(&self, q: &Joints, target_b: &Pose) -> UnreachablePose {
        let tool = self.tool_pose(&(*q).into());
        let (linear, angular) = pose_error(&tool, target_b);
        UnreachablePose {
            target_b: target_b.translation.vector,
            distance: linear.norm(),
            angle: angular.norm(),
        }
    }

    fn within_limits(&self, q: &Joints) -> Joints {
        Joints::from_fn(|i, _| q[i].clamp(self.chain.links[i].lower, self.chain.links[i].upper))
    }
}

/// Position error (m) and rotation vector (rad) from `now` to `target`, both in the frame they are given in.
pub fn pose_error(now: &Pose, target: &Pose) -> (Vec3, Vec3) {
    let linear = target.translation.vector - now.translation.vector;
    (linear, rotation::error(&now.rotation, &target.rotation))
}

/// A tool pose that the arm cannot take.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "unreachable pose: the tool gets no nearer to ({:.3}, {:.3}, {:.3}) m (robot base frame) than {:.1} mm and \
     {:.1}°; move it towards the robot or turn it towards straight down",
    target_b.x, target_b.y, target_b.z, distance * 1e3, angle.to_degrees()
)]
pub struct UnreachablePose {
    /// Where the tool should be, base frame, m.
    pub target_b: Vec3,
    /// How far the nearest pose found is away, m.
    pub distance: f64,
    /// How far it is turned away, rad.
    pub angle: f64,
}

impl UnreachablePose {
    fn is_reached(&self) -> bool {
        self.distance <= REACHED.0 && self.angle <= REACHED.1
    }

    /// Ranks misses: a radian counts as a fifth of a metre, about the hand's own size.
    fn cost(&self) -> f64 {
        self.distance + 0.2 * self.angle
    }
}

#[cfg(test)]
mod tests;
