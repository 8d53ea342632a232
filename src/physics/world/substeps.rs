//! Division of a step in which something moves far: an impact, a body that rolls, whips or springs back.
//!
//! A step linearises the elastic force and the place of each contact at its start, and an impact loses the energy of
//! what moves along within it. So the step is divided, into up to 32 parts, until no node moves by more than a fraction
//! of a voxel in a part: into a contact, relative to the centre of a body that touches, and relative to the rigid
//! motion of any body. The velocities at the start predict that. A part whose solved motion strains a body too far is
//! solved again, half as long. Average acceleration needs that; implicit Euler damps such motion.

use super::{JointDrive, StepFailure, World};
use crate::{
    fem::{FemModel, FemState, rigid_motion::RigidVelocity, system::StepCoefficients},
    params::PhysicsParams,
};
use softvt_geometry::{Pose, Vec3};

/// Largest way of a node in a part of a step, over the voxel edge: of its approach to what it will reach, and of its
/// motion relative to the centre of its body.
const LARGEST_WAY: f64 = 0.1;
/// Largest number of parts.
const MAX_PARTS: u32 = 32;
/// Time in which the parts of the steps may double in length, s: a body whose motion turns back is slow for a moment
/// only, and each change of the length adds an error.
const DOUBLING_TIME: f64 = 0.1;
/// Length of a step over that of the last one above which it is much longer.
const LONGER: f64 = 2.5;

impl World {
    /// Number of parts into which the step is divided, by its contact candidates and the velocities at its start.
    pub(super) fn step_parts(&mut self) -> u32 {
        if !self.params.average_acceleration {
            return 1;
        }
        let dt = self.params.dt;
        let parts = self.soft_ids().filter(|&id| !self.is_asleep(id)).map(|id| {
            let body = &self.soft(id).state;
            let FemState { model, v, .. } = body;
            let straining = dt * largest_straining(body, v) / largest_way(model);
            if !self.candidates.involves(id) {
                return straining;
            }
            straining.max(
                dt * largest_deviation(model, v).max(self.approach(id)) / (LARGEST_WAY * model.mesh.edge),
            )
        });
        let needed = dt / parts.fold(1.0, f64::max);
        let allowed = if self.part_dt > 0.0 { self.part_dt * libm::exp2(dt / DOUBLING_TIME) } else { dt };
        self.part_dt = needed.min(allowed).max(dt / f64::from(MAX_PARTS));
        // Rounding must not make a part of a whole step.
        ((dt / self.part_dt - 1e-9).ceil() as u32).next_power_of_two().min(MAX_PARTS)
    }

    /// Takes the step in equal parts, or shorter ones from where the solved motion is too long. Prescribed frames and
    /// the targets of drives move along lines.
    pub(super) fn step_in_parts(&mut self, parts: u32) -> Result<(), StepFailure> {
        let dt = self.params.dt;
        let ends: Vec<Pose> = self.kinematic.iter().map(|frame| frame.next).collect();
        let drives: Vec<_> = self.articulations.iter().map(|moved| moved.drives.clone()).collect();
        let taken = self.take_parts(MAX_PARTS / parts, &ends, &drives);
        self.kinematic.iter_mut().zip(ends).for_each(|(frame, end)| (frame.pose, frame.next) = (end, end));
        self.articulations.iter_mut().zip(drives).for_each(|(moved, drives)| moved.drives = drives);
        self.params.dt = dt;
        taken?;
        self.report_means();
        Ok(())
    }

    /// Takes the step in parts of `length`, in units of the shortest part.
    fn take_parts(
        &mut self,
        mut length: u32,
        ends: &[Pose],
        drives: &[Vec<Option<JointDrive>>],
    ) -> Result<(), StepFailure> {
        let (whole, mut left, mut has_candidates) = (self.params.dt, MAX_PARTS, true);
        while left > 0 {
            self.params.dt = whole * f64::from(length) / f64::from(MAX_PARTS);
            let share = f64::from(length) / f64::from(left);
            for (frame, end) in self.kinematic.iter_mut().zip(ends) {
                frame.next = frame.pose.lerp_slerp(end, share);
            }
            for (moved, ends) in self.articulations.iter_mut().zip(drives) {
                moved.move_targets(ends, share);
            }
            if has_candidates {
                self.shorten_candidates();
            } else {
                self.count_steps_awake();
                self.update_collider_motions();
                self.find_candidates();
            }
            // A part that is refused has found its candidates.
            has_candidates = !self.solve()?;
            if has_candidates {
                length /= 2;
                continue;
            }
            self.finish_step()?;
            self.add_part(f64::from(length) / f64::from(MAX_PARTS));
            left -= length;
        }
        Ok(())
    }

    /// True if the solved motion strains a soft body too far for the present part of the step; false for the shortest
    /// part, whatever its motion.
    pub(super) fn strains_too_far(&self) -> bool {
        let is_divisible = self.part_share() > 1.5 / f64::from(MAX_PARTS);
        self.params.average_acceleration
            && is_divisible
            && self.soft.iter().zip(&self.blocks.soft).any(|(soft, block)| {
                let body = &soft.state;
                block.is_some()
                    && largest_straining(body, soft.system.solved())
                        > largest_way(&body.model) / self.params.dt
            })
    }

    /// Share of the whole step for which the present part of it lasts.
    pub(super) fn part_share(&self) -> f64 {
        self.params.dt / self.inputs.0.dt
    }

    /// Length of this step over that of the last one, 1 for the first: the growth of an impulse if its force stays.
    pub(super) fn growth(&self) -> f64 {
        if self.last_dt > 0.0 { self.params.dt / self.last_dt } else { 1.0 }
    }
}

/// Largest difference between the velocity of a node and that of the centre, m/s.
fn largest_deviation(model: &FemModel, v: &[Vec3]) -> f64 {
    let momentum: Vec3 = v.iter().zip(&model.mass).map(|(v, m)| v * *m).sum();
    let centre = momentum / model.total_mass();
    v.iter().map(|v| (v - centre).norm_squared()).fold(0.0, f64::max).sqrt()
}

/// Largest difference between the velocity of a node and that of the rigid motion with the same momenta, m/s.
fn largest_straining(body: &FemState, v: &[Vec3]) -> f64 {
    let rigid = RigidVelocity::with_momenta(body, v.iter().zip(&body.model.mass).map(|(v, m)| v * *m));
    let straining = v.iter().zip(&body.x).map(|(v, x)| (v - rigid.at(x)).norm_squared());
    straining.fold(0.0, f64::max).sqrt()
}

/// Largest way of a node in a part of a step, relative to the rigid motion of its body, m. Linearised, a turn of a
/// voxel by an angle θ changes its volume by θ², which the Lamé parameter λ resists. So the limit falls above ν = 0.3,
/// to 0.061 of a voxel at 0.4 and 0.017 at 0.49.
fn largest_way(model: &FemModel) -> f64 {
    let ratio = model.material.shear_modulus() / model.material.lame_lambda();
    LARGEST_WAY * (1.5 * ratio).sqrt().min(1.0) * model.mesh.edge
}

/// Factor of all masses in a step that is not as long as the last one.
///
/// With average acceleration, the velocities are those of the middle of the steps, so forces change them for half
/// of the last step and half of this one: `M (v − v₀) = (dt₀ + dt)/2 f`. As forces act for `dt` in all that the
/// solver knows, masses change instead: `2 dt / (dt₀ + dt) M (v − v₀) = dt f`. In the first step `dt₀` is 0: the given
/// velocities are those at the start.
pub(super) fn mass_ratio(params: &PhysicsParams, last_dt: f64) -> f64 {
    if params.average_acceleration { 2.0 * params.dt / (last_dt + params.dt) } else { 1.0 }
}

/// The coefficients of a body of this model in a step after one of `last_dt`, s.
///
/// In a step that is much longer than the last one, average acceleration would take what the short steps resolved for
/// large amplitudes; implicit Euler damps it.
pub(super) fn step_coefficients(params: &PhysicsParams, last_dt: f64, model: &FemModel) -> StepCoefficients {
    let &PhysicsParams { dt, rayleigh_mass, rayleigh_stiffness, average_acceleration, .. } = params;
    let ratio = mass_ratio(params, last_dt);
    let mass = ratio + rayleigh_mass * dt;
    let beta = model.relaxation.map_or(rayleigh_stiffness, |law| law.dashpot / (1.0 + law.share));
    if average_acceleration && (last_dt == 0.0 || dt <= LONGER * last_dt) {
        // A step that is longer than the time for which forces act is stable with the masses of the whole step.
        StepCoefficients::average(dt, mass, ratio.max(1.0), beta)
    } else {
        StepCoefficients::euler(dt, mass, beta)
    }
}

#[cfg(test)]
mod tests;
