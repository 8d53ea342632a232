//! The judge of one episode: reads the evidence of every physics step and returns the verdict.
//!
//! Order of evaluation in one physics step ([`Judge::observe`]); names of thresholds are those of [`SuccessCriteria`]:
//!
//! 1. **Deformation.** Peaks of D of the target and of the other soft bodies. A step without a measured D of a soft
//!    target is counted in `missing_deformation`. Peaks of the target's shares of volume beyond the collapse and the
//!    damage strain of its material; they do not enter the success criteria.
//! 2. **Missing evidence.** If another number is not finite, the step is counted in `missing_evidence`, NoDrop becomes
//!    false, and the rest is skipped.
//! 3. **Contact.** A pad touches if its normal force on the target exceeds `touch_force_n`; the rest of the robot
//!    likewise. A body is supported if the upward force on it from everything but the robot exceeds `touch_force_n`.
//! 4. **Lift.** A body is lifted if it is not supported and its lowest point is more than `lift_height_m` above its
//!    settled height. The first body that is lifted decides `wrong_instance`; the target, if several are lifted in one
//!    step.
//! 5. **Release** and **slip**: [`ReleaseMonitor`], [`SlipMonitor`]. The pads carry the target while both touch it, it
//!    is not supported and no release was commanded.
//! 6. **Drop**: [`DropMonitor`].
//! 7. **Goal**, at the last physics step of each control step: [`GoalMonitor`].
//! 8. **Stage** of the episode: [`StageMonitor`].
//! 9. **Grip** while the target is lifted and no release was commanded: [`GripMonitor`].
//!
//! Harm to others is judged in addition: their peaks of D against their own τ, and the first contact of the robot with
//! one of them.
//!
//! At the end ([`Judge::finish`]): Safety Success = Goal ∧ NoDrop ∧ D_peak ≤ τ, and NoSlip if the criteria require it
//! ([`super::safety`]). Reported beside it: *gentle*, Goal with a grip ratio of at most `gentle_ratio`, and the nested
//! successes of the SoftTacWorld challenge. Contact success is Goal with contact of both pads throughout the carry;
//! contact safety is contact success with Safety and NoSlip.
//!
//! # Example
//!
//! A target rests on a plate, released, for nine control steps of 50 ms; the goal asks for 0.4 s.
//!
//! ```
//! use softvt_evaluation::{
//!     criteria::SuccessCriteria,
//!     deformation::ReferenceShape,
//!     evidence::{
//!         BodyEvidence, CrushedShares, Evidence, GoalEvidence, GripEvidence, GripperEvidence, PadEvidence,
//!     },
//!     goal::GoalRegion,
//!     judge::{Judge, JudgeConfig},
//!     safety::DeformationLimit,
//!     verdict::Outcome,
//! };
//! use softvt_geometry::{Aabb, Pose, Vec3};
//!
//! let (dt_s, weight_n) = (1.0 / 60.0, 0.3);
//! let mut judge = Judge::new(JudgeConfig {
//!     criteria: SuccessCriteria::default(),
//!     workspace: Aabb { min: Vec3::new(-1.0, -1.0, -0.1), max: Vec3::new(1.0, 1.0, 1.0) },
//!     goal: GoalRegion::On { radius_m: 0.08 },
//!     hold_s: 0.4,
//!     dt_s,
//!     steps_per_control: 3,
//!     target_weight_n: weight_n,
//!     is_target_soft: true,
//!     limit: Some(DeformationLimit { d_ref_pct: 2.0, kappa: 0.5 }),
//!     target_lowest_z_w: 0.0,
//!     others: Vec::new(),
//!     max_steps: 27,
//! });
//! // Settled nodes, and the same stretched by 0.5 % along x.
//! let settled = [Vec3::zeros(), Vec3::x() * 0.06, Vec3::y() * 0.06, Vec3::z() * 0.06];
//! let stretched = settled.map(|x| Vec3::new(1.005 * x.x, x.y, x.z));
//! let reference = ReferenceShape::new(&settled, &[1.0; 4])?;
//! for step in 1..=27 {
//!     judge.observe(&Evidence {
//!         time_s: f64::from(step) * dt_s,
//!         hand_w: Vec3::new(0.0, 0.0, 0.3),
//!         gripper: GripperEvidence { width_m: 0.08, commanded_width_m: 0.08 },
//!         pads: [PadEvidence::default(); 2],
//!         robot_force_n: 0.0,
//!         grip: GripEvidence { load_n: Vec3::zeros(), axis_w: Vec3::y(), dynamic_mu: 1.2 },
//!         target: BodyEvidence {
//!             centre_w: Vec3::new(0.02, 0.0, 0.03),
//!             lowest_z_w: 0.0,
//!             support_force_n: weight_n,
//!             robot_force_n: 0.0,
//!             deformation: reference.measure(&stretched).ok(),
//!         },
//!         crushed: CrushedShares { collapsed: Some(0.0), damaged: None },
//!         others: &[],
//!         goal: GoalEvidence { pose_w: Pose::identity(), support_force_n: weight_n },
//!     });
//! }
//! let verdict = judge.finish(&Outcome::Completed);
//! assert!(verdict.goal && verdict.no_drop && verdict.safety);
//! assert_eq!(verdict.tau, Some(1.0));
//! assert!(verdict.d_peak.is_some_and(|d| d > 0.0 && d < 0.5));
//! # Ok::<(), softvt_evaluation::deformation::DeformationError>(())
//! ```

use softvt_geometry::Aabb;

use super::{
    criteria::SuccessCriteria,
    deformation::series::{DeformationSeries, WorstSteps},
    drop::{DropEvent, DropMonitor, DropReason, DropSample, ReleaseMonitor},
    evidence::{BodyEvidence, CrushedShares, Evidence},
    goal::{GoalMonitor, GoalRegion, GoalSample},
    grip::{GripMonitor, GripSample},
    safety::{DeformationLimit, KAPPAS, KappaVerdict, SafetyParts},
    slip::{OpeningMonitor, SlipMonitor, SlipSample},
    stage::{StageEvidence, StageMonitor},
    verdict::{OtherObjectDeformation, Outcome, Verdict, WrongObjectContact},
};

/// Parameters of a [`Judge`], known once the scene has settled.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgeConfig {
    /// Thresholds that decide on contact, lift, drop, slip and goal.
    pub criteria: SuccessCriteria,
    /// Workspace, world frame. A target whose centre is outside has left it.
    pub workspace: Aabb,
    /// Region in which the target must come to rest.
    pub goal: GoalRegion,
    /// Time for which it must rest there, s.
    pub hold_s: f64,
    /// Physics step, s.
    pub dt_s: f64,
    /// Physics steps per control step.
    pub steps_per_control: u32,
    /// Weight of the target, N.
    pub target_weight_n: f64,
    /// True if the target is a soft body; for a rigid one deformation does not apply.
    pub is_target_soft: bool,
    /// Deformation limit of the target; `None` if its asset was never calibrated.
    pub limit: Option<DeformationLimit>,
    /// Height of the target's lowest point after settling, m.
    pub target_lowest_z_w: f64,
    /// The other movable bodies, in the order of the evidence.
    pub others: Vec<OtherBody>,
    /// Physics steps of the budget.
    pub max_steps: usize,
}

/// A movable body that is not the target, once the scene has settled.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherBody {
    /// Name in the scene.
    pub name: String,
    /// True for the object that the target must be placed on or in, which may be lifted first.
    pub is_goal: bool,
    /// True if it is a soft body.
    pub is_soft: bool,
    /// Its deformation limit; `None` if its asset was never calibrated.
    pub limit: Option<DeformationLimit>,
    /// Height of its lowest point after settling, m.
    pub lowest_z_w: f64,
}

/// The first contact with a body that is not the target.
#[derive(Clone, Copy, Debug)]
struct FirstContact {
    time_s: f64,
    /// Index in the evidence.
    other: usize,
}

/// Success and deformation of the target at a control step, as other scoring rules use them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlStepScore {
    /// True if the goal had been reached and held for long enough.
    pub success_now: bool,
    /// Deformation at the worst physics steps of the control step.
    pub worst: WorstSteps,
}

/// Sums over the physics steps of one control step.
#[derive(Clone, Copy, Debug, Default)]
struct ControlStepSums {
    steps: u32,
    support_n: f64,
    is_touched: bool,
}

/// Normal forces on the pads over the episode.
#[derive(Clone, Copy, Debug, Default)]
struct PadForceStats {
    peak_n: f64,
    /// Sum of the mean of both pads, over the steps in which both touched.
    sum_n: f64,
    steps: u64,
}

/// Judges one episode from the evidence of its physics steps; see the [module](self) for the definition of the score.
#[derive(Clone, Debug)]
pub struct Judge {
    config: JudgeConfig,
    release: ReleaseMonitor,
    drops: DropMonitor,
    slip: SlipMonitor,
    opening: OpeningMonitor,
    grip: GripMonitor,
    goal: GoalMonitor,
    control_step: ControlStepSums,
    pad_forces: PadForceStats,
    /// True if another object than the target was lifted first; `None` before.
    is_other_first: Option<bool>,
    /// Deformation of the target.
    series: DeformationSeries,
    scores: Vec<ControlStepScore>,
    /// Physics steps so far.
    steps: u64,
    /// Deformations of the other bodies, in the order of the evidence.
    series_other: Vec<DeformationSeries>,
    first_wrong_contact: Option<FirstContact>,
    stage: StageMonitor,
    crushed: CrushedShares,
    missing_evidence: u64,
    time_s: f64,
}

impl Judge {
    /// Judge of an episode that has not started.
    pub fn new(config: JudgeConfig) -> Self {
        let goal = GoalMonitor::new(config.hold_s, config.dt_s * f64::from(config.steps_per_control));
        Self {
            series: DeformationSeries::new(if config.is_target_soft { config.max_steps } else { 0 }),
            scores: Vec::with_capacity(config.max_steps / config.steps_per_control as usize),
            steps: 0,
            series_other: vec![DeformationSeries::new(0); config.others.len()],
            first_wrong_contact: None,
            stage: StageMonitor::default(),
            config,
            goal,
            release: ReleaseMonitor::default(),
            drops: DropMonitor::default(),
            slip: SlipMonitor::default(),
            opening: OpeningMonitor::default(),
            grip: GripMonitor::default(),
            control_step: ControlStepSums::default(),
            pad_forces: PadForceStats::default(),
            is_other_first: None,
            crushed: CrushedShares::default(),
            missing_evidence: 0,
            time_s: 0.0,
        }
    }

    /// Takes in one physics step; steps must come in order and without gaps. Evidence that is not finite is counted and
    /// judged as if the target had been dropped.
    pub fn observe(&mut self, evidence: &Evidence<'_>) {
        self.observe_deformation(evidence);
        if evidence.is_finite() {
            self.observe_handling(evidence);
        } else {
            self.missing_evidence += 1;
            self.drops.record(DropReason::NoEvidence, self.time_s);
        }
        self.steps += 1;
        if self.steps.is_multiple_of(u64::from(self.config.steps_per_control)) {
            let worst = self.series.take_worst();
            self.scores.push(ControlStepScore { success_now: self.is_goal_reached(), worst });
        }
    }

    /// Contacts, lift, release, slip, grip, drop and goal.
    fn observe_handling(&mut self, evidence: &Evidence<'_>) {
        self.time_s = evidence.time_s;
        self.observe_wrong_contact(evidence);
        let touch = self.observe_pads(evidence);
        let is_lifted = self.observe_lift(evidence);
        let both_pads_touch = touch[0] && touch[1];
        let is_released = self.release.update(&self.config.criteria, &evidence.gripper, both_pads_touch);
        let is_opening =
            self.opening.update(evidence.gripper.commanded_width_m, self.config.steps_per_control);
        let is_supported = self.is_supported(&evidence.target);
        let is_held = both_pads_touch && !is_released;
        let slip = SlipSample { pads: evidence.pads, is_held, is_supported, is_opening };
        self.slip.update(self.config.dt_s, &slip);
        let is_carried = is_lifted && !is_released;
        let grip = GripSample { is_carried, is_held: both_pads_touch, grip: evidence.grip };
        let config = &self.config;
        self.grip.update(&config.criteria, config.dt_s, config.steps_per_control, &grip);
        let sample = DropSample {
            time_s: evidence.time_s,
            centre_z: evidence.target.centre_w.z,
            hand_z: evidence.hand_w.z,
            is_lifted,
            is_touched: touch[0] || touch[1],
            is_touched_by_body: evidence.robot_force_n > self.config.criteria.touch_force_n,
            is_supported,
            is_released,
            is_in_workspace: self.config.workspace.contains(&evidence.target.centre_w),
        };
        self.drops.update(&self.config.criteria, self.config.dt_s, &sample);
        let is_placed = self.observe_goal(evidence, sample.is_touched || sample.is_touched_by_body);
        let is_over_goal = self.config.goal.is_over(&evidence.goal.pose_w, &evidence.target.centre_w);
        self.stage.update(&StageEvidence { touch, is_lifted, is_over_goal, is_placed });
    }

    /// True if the goal has held for long enough: the episode may end.
    pub fn is_goal_reached(&self) -> bool {
        self.goal.reached_s.is_some()
    }

    /// The scores of all complete control steps so far.
    pub fn scores(&self) -> &[ControlStepScore] {
        &self.scores
    }

    /// True if the target rests at the goal: in its region, and carried. For a state that has settled before the
    /// episode.
    pub fn rests_at_goal(&self, evidence: &Evidence<'_>) -> bool {
        let config = &self.config;
        let needed_n = config.criteria.support_share * config.target_weight_n;
        config.goal.contains(&evidence.goal.pose_w, &evidence.target.centre_w, 0.0)
            && evidence.goal.support_force_n >= needed_n
    }

    /// The first drop so far.
    pub fn first_drop(&self) -> Option<DropEvent> {
        self.drops.first
    }

    /// Verdict on the episode. One that did not end validly has neither Goal Success nor NoDrop, and
    /// its safety is unknown.
    pub fn finish(mut self, outcome: &Outcome) -> Verdict {
        let valid = outcome.is_valid();
        if !valid {
            self.drops.record(DropReason::NoEvidence, self.time_s);
        }
        let soft = self.config.is_target_soft;
        let goal = valid && self.is_goal_reached();
        let no_drop = self.drops.first.is_none();
        let others = self.others(valid);
        let limit = self.config.limit.filter(|_| soft);
        let series = self.series.finish(limit.map(|limit| limit.tau_pct()));
        let within = |tau| if soft && valid { series.peak.is_within(tau) } else { None };
        let deformation_ok = within(limit.map(|l| l.tau_pct()));
        let no_slip = self.slip.slip_m() <= self.config.criteria.slip_m;
        let slip_ok = (self.config.criteria.require_no_slip && valid).then_some(no_slip);
        let parts = SafetyParts { goal, no_drop, slip_ok };
        let safety = parts.is_safe(soft, deformation_ok);
        let contact_success = goal && self.grip.was_carried && !self.grip.lost_contact;
        let grip_ratio = self.grip.ratio(self.pad_forces.peak_n);
        let kappa_verdict = |limit: &DeformationLimit, kappa| {
            let tau_pct = limit.tau_at(kappa);
            let deformation_ok = within(Some(tau_pct));
            let safety = parts.is_safe(soft, deformation_ok);
            KappaVerdict { kappa, tau_pct, deformation_ok, safety }
        };
        let others_ok = match valid {
            true if others.iter().any(|other| other.deformation_ok == Some(false)) => Some(false),
            true if others.iter().all(|other| other.deformation_ok == Some(true)) => Some(true),
            _ => None,
        };
        let first_wrong_contact = self.first_wrong_contact.map(|contact| WrongObjectContact {
            time_s: contact.time_s,
            object: self.config.others[contact.other].name.clone(),
        });
        Verdict {
            goal,
            goal_time_s: self.goal.reached_s.filter(|_| goal),
            goal_v1: valid && self.goal.is_reached_v1,
            no_drop,
            drop: self.drops.first,
            no_slip,
            slip_mm: 1e3 * self.slip.slip_m(),
            d_peak: series.peak.d_pct,
            d_peak_v1: series.peak_v1,
            d_peak_max: series.peak_max,
            d_mean: series.mean,
            d_final: series.last,
            d_p95: series.p95,
            time_over_tau_s: limit.map(|_| series.steps_over_tau as f64 * self.config.dt_s),
            d_peak_other: others.iter().filter_map(|other| other.d_peak).reduce(f64::max),
            others,
            others_ok,
            first_wrong_contact,
            failed_stage: (!goal).then_some(self.stage.stage),
            collapsed_volume_pct: self.crushed.collapsed.map(|share| 100.0 * share),
            damaged_volume_pct: self.crushed.damaged.map(|share| 100.0 * share),
            wrong_instance: self.is_other_first == Some(true),
            kappa: limit.map(|l| l.kappa),
            tau: limit.map(|l| l.tau_pct()),
            d_ref: limit.map(|l| l.d_ref_pct),
            deformation_ok,
            slip_ok,
            safety,
            safety_known: valid && self.missing_evidence == 0 && (!soft || deformation_ok.is_some()),
            kappas: limit.iter().flat_map(|limit| KAPPAS.map(|kappa| kappa_verdict(limit, kappa))).collect(),
            missing_evidence: self.missing_evidence,
            missing_deformation: series.peak.missing,
            contact_success,
            contact_safety: contact_success && safety && no_slip,
            peak_pad_force_n: self.pad_forces.peak_n,
            mean_pad_force_n: self.pad_forces.sum_n / self.pad_forces.steps.max(1) as f64,
            least_pad_force_n: self.grip.least_n,
            grip_ratio,
            gentle: goal && grip_ratio.is_some_and(|ratio| ratio <= self.config.criteria.gentle_ratio),
        }
    }

    fn observe_deformation(&mut self, evidence: &Evidence<'_>) {
        let others = self.config.others.iter().zip(evidence.others).zip(&mut self.series_other);
        for ((_, body), series) in others.filter(|((other, _), _)| other.is_soft) {
            series.push(body.deformation);
        }
        if self.config.is_target_soft {
            self.series.push(evidence.target.deformation);
            let larger = |peak: Option<f64>, now: Option<f64>| peak.into_iter().chain(now).reduce(f64::max);
            self.crushed = CrushedShares {
                collapsed: larger(self.crushed.collapsed, evidence.crushed.collapsed),
                damaged: larger(self.crushed.damaged, evidence.crushed.damaged),
            };
        }
    }

    /// Deformation of the other soft bodies, judged if the episode ended validly.
    fn others(&self, valid: bool) -> Vec<OtherObjectDeformation> {
        let soft = self.config.others.iter().zip(&self.series_other).filter(|(other, _)| other.is_soft);
        soft.map(|(other, series)| {
            let (peak, tau) = (series.peak(), other.limit.map(|limit| limit.tau_pct()));
            OtherObjectDeformation {
                object: other.name.clone(),
                d_peak: peak.d_pct,
                tau,
                deformation_ok: peak.is_within(tau).filter(|_| valid),
            }
        })
        .collect()
    }

    fn observe_wrong_contact(&mut self, evidence: &Evidence<'_>) {
        let least_n = self.config.criteria.touch_force_n;
        if self.first_wrong_contact.is_none() {
            let touched = evidence.others.iter().position(|body| body.robot_force_n > least_n);
            self.first_wrong_contact = touched.map(|other| FirstContact { time_s: evidence.time_s, other });
        }
    }

    /// Returns true for each pad that touches the target.
    fn observe_pads(&mut self, evidence: &Evidence<'_>) -> [bool; 2] {
        let forces = evidence.pads.map(|pad| pad.normal_force_n);
        let touch = forces.map(|force| force > self.config.criteria.touch_force_n);
        self.pad_forces.peak_n = forces.iter().fold(self.pad_forces.peak_n, |peak, force| peak.max(*force));
        if touch[0] && touch[1] {
            self.pad_forces.sum_n += 0.5 * (forces[0] + forces[1]);
            self.pad_forces.steps += 1;
        }
        touch
    }

    /// Returns true if the target is lifted, and keeps which object was lifted first.
    fn observe_lift(&mut self, evidence: &Evidence<'_>) -> bool {
        let is_lifted = |body: &BodyEvidence, settled_z: f64| {
            !self.is_supported(body) && body.lowest_z_w > settled_z + self.config.criteria.lift_height_m
        };
        let target = is_lifted(&evidence.target, self.config.target_lowest_z_w);
        let others = evidence.others.iter().zip(&self.config.others).filter(|(_, other)| !other.is_goal);
        let other = others.into_iter().any(|(body, other)| is_lifted(body, other.lowest_z_w));
        if target || other {
            self.is_other_first.get_or_insert(!target);
        }
        target
    }

    /// Returns true at the end of a control step if the target is in the goal region and supported.
    fn observe_goal(&mut self, evidence: &Evidence<'_>, is_touched: bool) -> bool {
        self.control_step.steps += 1;
        self.control_step.is_touched |= is_touched;
        self.control_step.support_n += evidence.goal.support_force_n;
        if self.control_step.steps < self.config.steps_per_control {
            return false;
        }
        let sums = std::mem::take(&mut self.control_step);
        let (criteria, region) = (&self.config.criteria, &self.config.goal);
        let (pose, centre) = (&evidence.goal.pose_w, &evidence.target.centre_w);
        let weight_n = self.config.target_weight_n * f64::from(sums.steps);
        let sample = GoalSample {
            time_s: evidence.time_s,
            is_inside: region.contains(pose, centre, 0.0),
            is_inside_with_margin: region.contains(pose, centre, criteria.leave_margin_m),
            is_supported: sums.support_n >= criteria.support_share * weight_n,
            is_touched: sums.is_touched,
            is_inside_v1: region.contains_v1(criteria, pose, centre),
        };
        if self.goal.update(&sample) {
            self.drops.record(DropReason::LeftGoal, evidence.time_s);
        }
        sample.is_inside && sample.is_supported
    }

    fn is_supported(&self, body: &BodyEvidence) -> bool {
        body.support_force_n > self.config.criteria.touch_force_n
    }
}

#[cfg(test)]
mod tests;
