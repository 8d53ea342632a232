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
//! 5. **Release** and **slip**: [`ReleaseMonitor`](super::drop::ReleaseMonitor),
//!    [`SlipMonitor`](super::slip::SlipMonitor). The pads carry the target while both touch it, it
//!    is not supported and no release was commanded.
//! 6. **Drop**: [`DropMonitor`](super::drop::DropMonitor).
//! 7. **Goal**, at the last physics step of each control step: [`PlacementMonitor`] for each placement, [`GoalMonitor`]
//!    for the whole.
//! 8. **Stage** of the episode: [`StageMonitor`](super::stage::StageMonitor).
//! 9. **Grip** while the target is lifted and no release was commanded: [`GripMonitor`](super::grip::GripMonitor).
//!
//! A goal may move several targets. Each has monitors and a verdict of its own; the first is *the object*. NoDrop,
//! NoSlip and Safety Success are of all targets; contact success and *gentle* of the object.
//!
//! Harm to others is judged in addition: their peaks of D against their own τ, and the first contact of the robot with
//! one of them.
//!
//! At the end ([`Judge::finish`]): Safety Success = Goal ∧ NoDrop ∧ D_peak ≤ τ for each target, and NoSlip if the
//! criteria require it ([`super::safety`]). Reported in addition: *gentle*, Goal with a grip ratio of at most
//! `gentle_ratio`, and the nested successes of the SoftTacWorld challenge. Contact success is Goal with contact of both
//! pads throughout the carry; contact safety is contact success with Safety and NoSlip.
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
//!         BodyEvidence, CrushedShares, Evidence, GripEvidence, GripperEvidence, PadEvidence, PlaceEvidence,
//!         PredicateEvidence, TargetEvidence,
//!     },
//!     goal::GoalRegion,
//!     goal_tree::GoalNode,
//!     judge::{Judge, JudgeConfig, JudgedBody, Predicate, PredicateRule},
//!     safety::DeformationLimit,
//!     verdict::Outcome,
//! };
//! use softvt_geometry::{Aabb, Pose, Vec3};
//!
//! let (dt_s, weight_n) = (1.0 / 60.0, 0.3);
//! let region = GoalRegion::On { radius_m: 0.08 };
//! let mut judge = Judge::new(JudgeConfig {
//!     criteria: SuccessCriteria::default(),
//!     workspace: Aabb { min: Vec3::new(-1.0, -1.0, -0.1), max: Vec3::new(1.0, 1.0, 1.0) },
//!     goal: GoalNode::Predicate(0),
//!     predicates: vec![Predicate {
//!         name: "bun on plate".into(),
//!         rule: PredicateRule::Rests { target: 0, region, hold_s: 0.4 },
//!     }],
//!     targets: vec![JudgedBody {
//!         name: "bun".into(),
//!         weight_n,
//!         is_soft: true,
//!         is_goal: false,
//!         limit: Some(DeformationLimit { d_ref_pct: 2.0, kappa: 0.5 }),
//!         lowest_z_w: 0.0,
//!     }],
//!     others: Vec::new(),
//!     dt_s,
//!     steps_per_control: 3,
//!     max_steps: 27,
//! });
//! // Settled nodes, and the same stretched by 0.5 % along x.
//! let settled = [Vec3::zeros(), Vec3::x() * 0.06, Vec3::y() * 0.06, Vec3::z() * 0.06];
//! let stretched = settled.map(|x| Vec3::new(1.005 * x.x, x.y, x.z));
//! let reference = ReferenceShape::new(&settled, &[1.0; 4])?;
//! let bun = TargetEvidence {
//!     body: BodyEvidence {
//!         centre_w: Vec3::new(0.02, 0.0, 0.03),
//!         lowest_z_w: 0.0,
//!         support_force_n: weight_n,
//!         robot_force_n: 0.0,
//!         deformation: reference.measure(&stretched).ok(),
//!     },
//!     pads: [PadEvidence::default(); 2],
//!     hand_force_n: 0.0,
//!     grip: GripEvidence { load_n: Vec3::zeros(), axis_w: Vec3::y(), dynamic_mu: 1.2 },
//!     crushed: CrushedShares { collapsed: Some(0.0), damaged: None },
//! };
//! let plate = PlaceEvidence { pose_w: Pose::identity(), support_force_n: weight_n };
//! for step in 1..=27 {
//!     judge.observe(&Evidence {
//!         time_s: f64::from(step) * dt_s,
//!         hand_w: Vec3::new(0.0, 0.0, 0.3),
//!         gripper: GripperEvidence { width_m: 0.08, commanded_width_m: 0.08 },
//!         targets: &[bun],
//!         others: &[],
//!         predicates: &[PredicateEvidence::Place(plate)],
//!     });
//! }
//! let verdict = judge.finish(&Outcome::Completed);
//! assert!(verdict.goal && verdict.no_drop && verdict.safety);
//! assert_eq!(verdict.object().tau, Some(1.0));
//! assert!(verdict.object().d_peak.is_some_and(|d| d > 0.0 && d < 0.5));
//! # Ok::<(), softvt_evaluation::deformation::DeformationError>(())
//! ```

mod target;

use softvt_geometry::Aabb;

use super::{
    criteria::SuccessCriteria,
    deformation::series::{DeformationSeries, WorstSteps},
    drop::{DropEvent, DropReason},
    evidence::{BodyEvidence, Evidence, PlaceEvidence, PredicateEvidence},
    goal::{GoalRegion, PlacementMonitor, PlacementSample},
    goal_tree::{GoalMonitor, GoalNode},
    safety::{DeformationLimit, KAPPAS, KappaVerdict, and_known},
    slip::OpeningMonitor,
    stage::TaskStage,
    verdict::{GoalPart, OtherObjectDeformation, Outcome, TargetVerdict, Verdict, WrongObjectContact},
};
use target::{StepContext, TargetMonitors, TargetResult};

/// Parameters of a [`Judge`], known once the scene has settled.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgeConfig {
    /// Thresholds that decide on contact, lift, drop, slip and goal.
    pub criteria: SuccessCriteria,
    /// Workspace, world frame. A target whose centre is outside has left it.
    pub workspace: Aabb,
    /// The goal; its numbers are places in `predicates`.
    pub goal: GoalNode,
    /// Predicates of the goal, in the order of the evidence.
    pub predicates: Vec<Predicate>,
    /// The objects that the task moves, in the order of the evidence; the first is *the object*.
    pub targets: Vec<JudgedBody>,
    /// The other movable bodies, in the order of the evidence.
    pub others: Vec<JudgedBody>,
    /// Physics step, s.
    pub dt_s: f64,
    /// Physics steps per control step.
    pub steps_per_control: u32,
    /// Physics steps of the budget.
    pub max_steps: usize,
}

/// A predicate of a goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Predicate {
    /// Description in words: "bun on plate".
    pub name: String,
    /// Condition under which it holds.
    pub rule: PredicateRule,
}

/// When a [`Predicate`] holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PredicateRule {
    /// A target rests in a region, released, for a time.
    Rests {
        /// Place in `targets`.
        target: usize,
        /// Region in the frame of the object that must carry it.
        region: GoalRegion,
        /// Time for which it must rest there, s.
        hold_s: f64,
    },
    /// The evidence has said for a time that it holds.
    Given {
        /// Time for which it must hold, s.
        hold_s: f64,
    },
}

/// A movable body, once the scene has settled.
#[derive(Clone, Debug, PartialEq)]
pub struct JudgedBody {
    /// Name in the scene.
    pub name: String,
    /// Weight, N; used for targets alone.
    pub weight_n: f64,
    /// True if it is a soft body; for a rigid one deformation does not apply.
    pub is_soft: bool,
    /// True for an object that a target must be placed on or in, which may be lifted first.
    pub is_goal: bool,
    /// Its deformation limit; `None` if its asset was never calibrated.
    pub limit: Option<DeformationLimit>,
    /// Height of its lowest point after settling, m.
    pub lowest_z_w: f64,
}

/// The first contact with a body that is not a target.
#[derive(Clone, Copy, Debug)]
struct FirstContact {
    time_s: f64,
    /// Index in the evidence.
    other: usize,
}

/// Success and deformation of the targets at a control step, as other scoring rules use them.
#[derive(Clone, Debug, PartialEq)]
pub struct ControlStepScore {
    /// True if the goal had been reached and held for long enough.
    pub success_now: bool,
    /// Deformation of each target at the worst physics steps of the control step, the object first.
    pub targets: Vec<WorstSteps>,
}

/// State of a predicate up to the present step.
#[derive(Clone, Copy, Debug)]
struct PredicateState {
    placement: PlacementMonitor,
    /// Support of a target by its place: the sum over the physics steps of the control step, N.
    support_n: f64,
    holds: bool,
    /// Time at which it held first, s.
    met_s: Option<f64>,
    /// True if its target must not leave the place again.
    is_final: bool,
    /// True if it must not hold.
    is_negated: bool,
    /// True if the last step ended a control step, and its target was in the region and supported.
    is_placed: bool,
}

/// Judges one episode from the evidence of its physics steps; see the [module](self) for the definition of the score.
#[derive(Clone, Debug)]
pub struct Judge {
    config: JudgeConfig,
    targets: Vec<TargetMonitors>,
    predicates: Vec<PredicateState>,
    goal: GoalMonitor,
    /// The goal, with the placements of the released code.
    goal_v1: GoalMonitor,
    /// Which predicates hold, and which hold by the released code.
    holds: [Vec<bool>; 2],
    reached_s: Option<f64>,
    is_reached_v1: bool,
    /// True if the robot has pressed on a target.
    is_touched: bool,
    opening: OpeningMonitor,
    /// True if another object than a target was lifted first; `None` before.
    is_other_first: Option<bool>,
    scores: Vec<ControlStepScore>,
    /// Physics steps so far.
    steps: u64,
    /// Deformations of the other bodies, in the order of the evidence.
    series_other: Vec<DeformationSeries>,
    first_wrong_contact: Option<FirstContact>,
    missing_evidence: u64,
    time_s: f64,
}

impl Judge {
    /// Judge of an episode that has not started.
    pub fn new(config: JudgeConfig) -> Self {
        let control_s = config.dt_s * f64::from(config.steps_per_control);
        let mut predicates: Vec<_> =
            config.predicates.iter().map(|predicate| predicate.rule.state(control_s)).collect();
        config.goal.for_each_final(&mut |number| predicates[number].is_final = true);
        config.goal.for_each_negated(&mut |number| predicates[number].is_negated = true);
        let targets = config.targets.iter();
        Self {
            targets: targets.map(|target| TargetMonitors::new(target, config.max_steps)).collect(),
            goal: GoalMonitor::new(config.goal.clone()),
            goal_v1: GoalMonitor::new(config.goal.clone()),
            holds: [0; 2].map(|_| vec![false; predicates.len()]),
            predicates,
            reached_s: None,
            is_reached_v1: false,
            is_touched: false,
            opening: OpeningMonitor::default(),
            scores: Vec::with_capacity(config.max_steps / config.steps_per_control as usize),
            steps: 0,
            series_other: vec![DeformationSeries::new(0); config.others.len()],
            first_wrong_contact: None,
            config,
            is_other_first: None,
            missing_evidence: 0,
            time_s: 0.0,
        }
    }

    /// Takes in one physics step; steps must come in order and without gaps. Evidence that is not finite is counted and
    /// judged as if the targets had been dropped.
    pub fn observe(&mut self, evidence: &Evidence<'_>) {
        self.observe_deformation(evidence);
        self.steps += 1;
        let is_last = self.steps.is_multiple_of(u64::from(self.config.steps_per_control));
        if evidence.is_finite() {
            self.observe_handling(evidence, is_last);
        } else {
            self.missing_evidence += 1;
            let time_s = self.time_s;
            self.targets.iter_mut().for_each(|target| target.drops.record(DropReason::NoEvidence, time_s));
        }
        if is_last {
            self.targets.iter_mut().for_each(|target| target.was_touched = false);
            self.predicates.iter_mut().for_each(|predicate| predicate.support_n = 0.0);
            let targets = self.targets.iter_mut().map(TargetMonitors::take_worst).collect();
            self.scores.push(ControlStepScore { success_now: self.is_goal_reached(), targets });
        }
    }

    /// Contacts, lift, release, slip, grip, drop and goal. `is_last` at the last physics step of a control step.
    fn observe_handling(&mut self, evidence: &Evidence<'_>, is_last: bool) {
        self.time_s = evidence.time_s;
        if self.first_wrong_contact.is_none() {
            let least_n = self.config.criteria.touch_force_n;
            let touched = evidence.others.iter().position(|body| body.robot_force_n > least_n);
            self.first_wrong_contact = touched.map(|other| FirstContact { time_s: evidence.time_s, other });
        }
        self.observe_lift(evidence);
        let config = &self.config;
        let is_opening = self.opening.update(evidence.gripper.commanded_width_m, config.steps_per_control);
        let step = StepContext { config, evidence, is_opening };
        for (target, own) in self.targets.iter_mut().zip(evidence.targets) {
            target.observe(&step, own);
            self.is_touched |= target.was_touched;
        }
        self.observe_goal(evidence, is_last);
    }

    /// True if the goal has held for long enough: the episode may end.
    pub fn is_goal_reached(&self) -> bool {
        self.reached_s.is_some()
    }

    /// The scores of all complete control steps so far.
    pub fn scores(&self) -> &[ControlStepScore] {
        &self.scores
    }

    /// The predicates of the goal, and what has been met so far.
    pub fn parts(&self) -> impl Iterator<Item = GoalPart> + '_ {
        self.config.predicates.iter().zip(&self.predicates).map(|(predicate, state)| GoalPart {
            name: predicate.name.clone(),
            negated: state.is_negated,
            // A negated predicate counts as true for the goal until it has been absent for its time.
            holds: state.holds && state.met_s.is_some(),
            met_s: state.met_s,
        })
    }

    /// True if the goal holds. For a state that has settled before the episode: a placement holds if the target is in
    /// its region, and carried.
    pub fn holds_at_start(&self, evidence: &Evidence<'_>) -> bool {
        let criteria = &self.config.criteria;
        let holds =
            |(predicate, evidence_of): (&Predicate, &PredicateEvidence)| match (&predicate.rule, evidence_of)
            {
                (PredicateRule::Rests { target, region, .. }, PredicateEvidence::Place(place)) => {
                    let needed_n = criteria.support_share * self.config.targets[*target].weight_n;
                    region.contains(&place.pose_w, &evidence.targets[*target].body.centre_w, 0.0)
                        && place.support_force_n >= needed_n
                }
                (_, evidence) => *evidence == PredicateEvidence::Given(true),
            };
        let holds: Vec<bool> = self.config.predicates.iter().zip(evidence.predicates).map(holds).collect();
        self.goal.clone().update(&holds)
    }

    /// The first drop so far, of any target.
    pub fn first_drop(&self) -> Option<DropEvent> {
        earliest(self.targets.iter().filter_map(|target| target.drops.first))
    }

    /// Verdict on an episode that ends here. One that did not end validly has neither Goal Success nor NoDrop, and
    /// its safety is unknown.
    pub fn finish(&self, outcome: &Outcome) -> Verdict {
        let valid = outcome.is_valid();
        let missing = (!valid).then_some(DropEvent { reason: DropReason::NoEvidence, time_s: self.time_s });
        let goal = valid && self.is_goal_reached();
        let (others, failed_stage) = (self.others(valid), self.stage());
        let parts: Vec<GoalPart> = self.parts().collect();
        let (config, targets) = (&self.config, self.targets.iter().zip(&self.config.targets));
        let results =
            targets.enumerate().map(|(index, (target, of))| target.finish(config, of, index == 0, missing));
        let results: Vec<TargetResult> = results.collect();
        let drop = earliest(results.iter().filter_map(|target| target.handling.drop));
        let slip_mm = results.iter().fold(0.0, |most: f64, target| most.max(target.handling.slip_mm));
        let contact_success = goal && results[0].was_in_contact;
        let targets: Vec<TargetVerdict> = results.into_iter().map(|target| target.verdict).collect();
        let no_slip = slip_mm <= 1e3 * config.criteria.slip_m;
        let others_ok = others.iter().map(|other| other.deformation_ok).fold(Some(true), and_known);
        let first_wrong_contact = self.first_wrong_contact.map(|contact| WrongObjectContact {
            time_s: contact.time_s,
            object: config.others[contact.other].name.clone(),
        });
        let is_gentle = |ratio| ratio <= config.criteria.gentle_ratio;
        let mut verdict = Verdict {
            goal,
            goal_time_s: self.reached_s.filter(|_| goal),
            goal_untouched: goal && !self.is_touched,
            goal_v1: valid && self.is_reached_v1,
            goal_parts: if parts.len() > 1 { parts } else { Vec::new() },
            no_drop: drop.is_none(),
            drop,
            no_slip,
            slip_mm,
            d_peak_other: others.iter().filter_map(|other| other.d_peak).reduce(f64::max),
            others,
            others_ok: others_ok.filter(|_| valid),
            first_wrong_contact,
            failed_stage: failed_stage.filter(|_| !goal),
            wrong_instance: self.is_other_first == Some(true),
            slip_ok: (config.criteria.require_no_slip && valid).then_some(no_slip),
            safety: false,
            safety_known: false,
            kappas: Vec::new(),
            gentle: goal && targets[0].grip_ratio.is_some_and(is_gentle),
            targets,
            missing_evidence: self.missing_evidence,
            contact_success,
            contact_safety: false,
        };
        verdict.safety = verdict.is_safe(None);
        verdict.safety_known = valid && self.missing_evidence == 0 && verdict.is_within(None).is_some();
        verdict.contact_safety = contact_success && verdict.safety && no_slip;
        let limit = config.targets[0].limit.filter(|_| config.targets[0].is_soft);
        verdict.kappas = limit
            .iter()
            .flat_map(|limit| {
                KAPPAS.map(|kappa| KappaVerdict {
                    kappa,
                    tau_pct: limit.tau_at(kappa),
                    deformation_ok: verdict.object().is_within(Some(kappa)).filter(|_| valid),
                    safety: verdict.is_safe(Some(kappa)),
                })
            })
            .collect();
        verdict
    }

    /// The stage of the first target that has not been placed yet; `None` if all placements have been met.
    pub fn stage(&self) -> Option<TaskStage> {
        let unmet =
            self.predicates.iter().zip(&self.config.predicates).find_map(
                |(state, predicate)| match predicate.rule {
                    PredicateRule::Rests { target, .. } if state.met_s.is_none() && !state.is_negated => {
                        Some(target)
                    }
                    _ => None,
                },
            );
        unmet.map(|target| self.targets[target].stage.stage)
    }

    fn observe_deformation(&mut self, evidence: &Evidence<'_>) {
        let others = self.config.others.iter().zip(evidence.others).zip(&mut self.series_other);
        for ((_, body), series) in others.filter(|((other, _), _)| other.is_soft) {
            series.push(body.deformation);
        }
        let targets = self.targets.iter_mut().zip(evidence.targets).zip(&self.config.targets);
        for ((target, own), _) in targets.filter(|(_, of)| of.is_soft) {
            target.observe_deformation(own);
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

    /// Keeps whether a target was lifted before any other object.
    fn observe_lift(&mut self, evidence: &Evidence<'_>) {
        let is_lifted = |body: &BodyEvidence, settled_z| self.config.is_lifted(body, settled_z);
        let mut targets = evidence.targets.iter().zip(&self.config.targets);
        let target = targets.any(|(own, target)| is_lifted(&own.body, target.lowest_z_w));
        let others = evidence.others.iter().zip(&self.config.others).filter(|(_, other)| !other.is_goal);
        let other = others.into_iter().any(|(body, other)| is_lifted(body, other.lowest_z_w));
        if target || other {
            self.is_other_first.get_or_insert(!target);
        }
    }

    /// Predicates and goal at the end of a control step, and the stages of the targets.
    fn observe_goal(&mut self, evidence: &Evidence<'_>, is_last: bool) {
        let config = &self.config;
        for (number, predicate) in config.predicates.iter().enumerate() {
            let state = &mut self.predicates[number];
            state.is_placed = false;
            if let PredicateEvidence::Place(place) = &evidence.predicates[number] {
                state.support_n += place.support_force_n;
            }
            if !is_last {
                continue;
            }
            let sample = match (&predicate.rule, &evidence.predicates[number]) {
                (PredicateRule::Rests { target, region, .. }, PredicateEvidence::Place(place)) => {
                    let (criteria, support_n) = (&config.criteria, state.support_n);
                    let centre = &evidence.targets[*target].body.centre_w;
                    let weight_n = config.targets[*target].weight_n * f64::from(config.steps_per_control);
                    PlacementSample {
                        is_inside: region.contains(&place.pose_w, centre, 0.0),
                        is_inside_with_margin: region.contains(
                            &place.pose_w,
                            centre,
                            criteria.leave_margin_m,
                        ),
                        is_supported: support_n >= criteria.support_share * weight_n,
                        is_touched: self.targets[*target].was_touched,
                        is_inside_v1: region.contains_v1(criteria, &place.pose_w, centre),
                    }
                }
                (_, given) => PlacementSample::given(*given == PredicateEvidence::Given(true)),
            };
            let applies = sample.is_inside && sample.is_supported;
            if state.is_negated {
                // Its absence must last as long as it would have to.
                let absent = PlacementSample {
                    is_inside_v1: !sample.is_inside_v1,
                    ..PlacementSample::given(!applies)
                };
                state.placement.update(&absent);
                state.holds = !state.placement.holds();
                [self.holds[0][number], self.holds[1][number]] = [state.holds, !state.placement.holds_v1()];
                if applies {
                    state.met_s.get_or_insert(evidence.time_s);
                }
                continue;
            }
            let has_left = state.placement.update(&sample);
            if let PredicateRule::Rests { target, .. } = predicate.rule {
                state.is_placed = applies;
                if has_left && state.is_final {
                    self.targets[target].drops.record(DropReason::LeftGoal, evidence.time_s);
                }
            }
            state.holds = state.placement.holds();
            [self.holds[0][number], self.holds[1][number]] = [state.holds, state.placement.holds_v1()];
        }
        self.observe_stages(evidence);
        if is_last {
            for state in self.predicates.iter_mut().filter(|state| state.holds && !state.is_negated) {
                state.met_s.get_or_insert(evidence.time_s);
            }
            if self.goal.update(&self.holds[0]) {
                self.reached_s.get_or_insert(evidence.time_s);
            }
            self.is_reached_v1 |= self.goal_v1.update(&self.holds[1]);
        }
    }

    /// Stages of the targets: each is on its way to the first of its places that it has not reached, else to the last.
    fn observe_stages(&mut self, evidence: &Evidence<'_>) {
        let Self { config, targets, predicates, .. } = self;
        for (index, target) in targets.iter_mut().enumerate() {
            let mut next: Option<(usize, &GoalRegion, &PlaceEvidence)> = None;
            for (number, predicate) in config.predicates.iter().enumerate() {
                if let PredicateRule::Rests { target, region, .. } = &predicate.rule
                    && let PredicateEvidence::Place(place) = &evidence.predicates[number]
                    && *target == index
                    && !predicates[number].is_negated
                    && next.is_none_or(|(before, ..)| predicates[before].met_s.is_some())
                {
                    next = Some((number, region, place));
                }
            }
            let centre = &evidence.targets[index].body.centre_w;
            let is_over = next.is_some_and(|(_, region, place)| region.is_over(&place.pose_w, centre));
            target.observe_stage(is_over, next.is_some_and(|(number, ..)| predicates[number].is_placed));
        }
    }
}

fn earliest(drops: impl Iterator<Item = DropEvent>) -> Option<DropEvent> {
    drops.reduce(|first, other| if other.time_s < first.time_s { other } else { first })
}

impl PredicateRule {
    fn state(&self, control_s: f64) -> PredicateState {
        let (Self::Rests { hold_s, .. } | Self::Given { hold_s }) = self;
        let placement = PlacementMonitor::new(*hold_s, control_s);
        PredicateState {
            placement,
            support_n: 0.0,
            holds: false,
            met_s: None,
            is_final: false,
            is_negated: false,
            is_placed: false,
        }
    }
}

impl JudgeConfig {
    /// True if anything but the robot presses on a body from below.
    fn is_supported(&self, body: &BodyEvidence) -> bool {
        body.support_force_n > self.criteria.touch_force_n
    }

    /// True if a body is clear of its settled height, and nothing but the robot carries it.
    fn is_lifted(&self, body: &BodyEvidence, settled_z: f64) -> bool {
        !self.is_supported(body) && body.lowest_z_w > settled_z + self.criteria.lift_height_m
    }
}

#[cfg(test)]
mod property;
#[cfg(test)]
mod tests;
