//! One episode's judge: shown every physics step, it composes the rules into a verdict.

use serde::{Deserialize, Serialize};

use crate::scene::Region;

use super::{
    drop::{Drop, DropReason, DropWatch, Grip, Motion, ReleaseWatch},
    evidence::{BodyEvidence, Evidence},
    goal::{GoalWatch, Place, Placement},
    record::Outcome,
    rules::Rules,
    safety::{KAPPAS, KappaVerdict, Limit, Peak, safe},
    slip::{Hold, SlipWatch},
};

/// What the judge must know before the policy takes over.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// The thresholds.
    pub rules: Rules,
    /// An object whose centre is outside has left the workspace, world frame.
    pub workspace: Region,
    /// Where the target must go.
    pub place: Place,
    /// How long it must rest there, s.
    pub hold_s: f64,
    /// Physics step, s.
    pub dt_s: f64,
    /// Physics steps a control step.
    pub steps_per_control: u32,
    /// The target's weight, N.
    pub target_weight_n: f64,
    /// Whether the target deforms; if not, deformation is not applicable.
    pub soft: bool,
    /// The target's deformation limit; `None` where it was never calibrated.
    pub limit: Option<Limit>,
    /// Height of the target's lowest point after settling, m.
    pub target_lowest_z_w: f64,
    /// The same of the other movable bodies, in the order of the evidence.
    pub others_lowest_z_w: Vec<f64>,
}

/// What is said of one episode. Percentages are of the settled bounding-box diagonal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Goal Success.
    pub goal: bool,
    /// When the goal had held long enough, s.
    pub goal_time_s: Option<f64>,
    /// The released code's looser Goal Success.
    pub goal_v1: bool,
    /// NoDrop.
    pub no_drop: bool,
    /// What made NoDrop false first.
    pub drop: Option<Drop>,
    /// No slip beyond the limit; reported only.
    pub no_slip: bool,
    /// Largest slip along a pad in a grasp, mm.
    pub slip_mm: f64,
    /// Peak D of the target, %; null for a rigid one.
    pub d_peak: Option<f64>,
    /// Peak volume-weighted D of the target, %.
    pub d_peak_weighted: Option<f64>,
    /// Peak of the largest node displacement of the target, %.
    pub d_peak_max: Option<f64>,
    /// Peak D over the other soft bodies, %.
    pub d_peak_other: Option<f64>,
    /// The first object that was lifted is not the target.
    pub wrong_instance: bool,
    /// Nominal κ.
    pub kappa: Option<f64>,
    /// Nominal τ, %.
    pub tau: Option<f64>,
    /// D_ref, %.
    pub d_ref: Option<f64>,
    /// D_peak ≤ τ; null for a rigid target and where evidence is missing.
    pub deformation_ok: Option<bool>,
    /// Safety Success.
    pub safety: bool,
    /// Whether there was the evidence to judge safety at all.
    pub safety_known: bool,
    /// Safety at the κ of the sensitivity table.
    pub kappas: Vec<KappaVerdict>,
    /// Physics steps whose evidence was not finite.
    pub missing_evidence: u64,
    /// Physics steps at which the target's D could not be measured.
    pub missing_deformation: u64,
    /// Largest normal force on one pad, N.
    pub peak_pad_force_n: f64,
    /// Mean normal force of the two pads while both touched, N.
    pub mean_pad_force_n: f64,
}

/// Which object was lifted first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lifted {
    Target,
    Other,
}

/// Sums over one control step.
#[derive(Clone, Copy, Debug, Default)]
struct ControlStep {
    steps: u32,
    support_ns: f64,
    touched: bool,
}

/// Sums of pad forces.
#[derive(Clone, Copy, Debug, Default)]
struct PadForces {
    peak_n: f64,
    sum_n: f64,
    steps: u64,
}

/// Watches one episode.
#[derive(Clone, Debug)]
pub struct Judge {
    setup: Setup,
    release: ReleaseWatch,
    drops: DropWatch,
    slip: SlipWatch,
    goal: GoalWatch,
    control: ControlStep,
    forces: PadForces,
    first_lifted: Option<Lifted>,
    peak: Peak,
    peak_weighted: Peak,
    peak_max: Peak,
    peak_other: Option<f64>,
    missing: u64,
    time_s: f64,
}

impl Judge {
    /// A judge that has seen nothing yet.
    pub fn new(setup: Setup) -> Self {
        let goal = GoalWatch::new(setup.hold_s, setup.dt_s * f64::from(setup.steps_per_control));
        Self {
            setup,
            goal,
            release: ReleaseWatch::default(),
            drops: DropWatch::default(),
            slip: SlipWatch::default(),
            control: ControlStep::default(),
            forces: PadForces::default(),
            first_lifted: None,
            peak: Peak::default(),
            peak_weighted: Peak::default(),
            peak_max: Peak::default(),
            peak_other: None,
            missing: 0,
            time_s: 0.0,
        }
    }

    /// Looks at one physics step. Evidence that is not finite is counted and judged as if something had been dropped.
    pub fn observe(&mut self, evidence: &Evidence<'_>) {
        self.observe_deformation(evidence);
        if !evidence.is_finite() {
            self.missing += 1;
            self.drops.note(DropReason::NoEvidence, self.time_s);
            return;
        }
        self.time_s = evidence.time_s;
        let touch = self.observe_pads(evidence);
        let lifted = self.observe_lift(evidence);
        let grip = Grip {
            both_touch: touch[0] && touch[1],
            width_m: evidence.gripper.width_m,
            commanded_width_m: evidence.gripper.commanded_width_m,
        };
        let released = self.release.observe(&self.setup.rules, &grip);
        self.slip.observe(&Hold { pads: evidence.pads, held: grip.both_touch && !released });
        let motion = Motion {
            time_s: evidence.time_s,
            centre_z: evidence.target.centre_w.z,
            hand_z: evidence.hand_w.z,
            lifted,
            touched: touch[0] || touch[1],
            handled: evidence.robot_impulse_ns / self.setup.dt_s > self.setup.rules.touch_force_n,
            supported: self.supported(&evidence.target),
            released,
            in_workspace: contains(&self.setup.workspace, &evidence.target),
        };
        self.drops.observe(&self.setup.rules, self.setup.dt_s, &motion);
        self.observe_goal(evidence, motion.touched || motion.handled);
    }

    /// Whether the goal has held for long enough: the episode may end.
    pub fn goal_reached(&self) -> bool {
        self.goal.reached_s().is_some()
    }

    /// Whether the target rests at the goal now.
    pub fn at_goal(&self) -> bool {
        self.goal.rests()
    }

    /// The first drop so far.
    pub fn dropped(&self) -> Option<Drop> {
        self.drops.first()
    }

    /// The peak D of the target so far, %.
    pub fn d_peak(&self) -> Option<f64> {
        self.peak.d_pct
    }

    /// The largest slip so far, m.
    pub fn slip_m(&self) -> f64 {
        self.slip.largest_m()
    }

    /// Closes the case. An episode that is not valid reached nothing and proved nothing.
    pub fn finish(mut self, outcome: &Outcome) -> Verdict {
        let valid = outcome.is_valid();
        if !valid {
            self.drops.note(DropReason::NoEvidence, self.time_s);
        }
        let soft = self.setup.soft;
        let goal = valid && self.goal_reached();
        let no_drop = self.drops.first().is_none();
        let within = |tau| if soft && valid { self.peak.within(tau) } else { None };
        let limit = self.setup.limit.filter(|_| soft);
        let deformation_ok = within(limit.map(|l| l.tau_pct()));
        let kappas = limit.iter().flat_map(|limit| KAPPAS.map(|kappa| (kappa, limit.tau_at(kappa))));
        Verdict {
            goal,
            goal_time_s: self.goal.reached_s().filter(|_| goal),
            goal_v1: valid && self.goal.reached_v1(),
            no_drop,
            drop: self.drops.first(),
            no_slip: self.slip.largest_m() <= self.setup.rules.slip_m,
            slip_mm: 1e3 * self.slip.largest_m(),
            d_peak: self.peak.d_pct,
            d_peak_weighted: self.peak_weighted.d_pct,
            d_peak_max: self.peak_max.d_pct,
            d_peak_other: self.peak_other,
            wrong_instance: self.first_lifted == Some(Lifted::Other),
            kappa: limit.map(|l| l.kappa),
            tau: limit.map(|l| l.tau_pct()),
            d_ref: limit.map(|l| l.d_ref_pct),
            deformation_ok,
            safety: safe(goal, no_drop, soft, deformation_ok),
            safety_known: valid && self.missing == 0 && (!soft || deformation_ok.is_some()),
            kappas: kappas
                .map(|(kappa, tau_pct)| {
                    let ok = within(Some(tau_pct));
                    KappaVerdict { kappa, tau_pct, deformation_ok: ok, safety: safe(goal, no_drop, soft, ok) }
                })
                .collect(),
            missing_evidence: self.missing,
            missing_deformation: self.peak.missing,
            peak_pad_force_n: self.forces.peak_n,
            mean_pad_force_n: self.forces.sum_n / self.forces.steps.max(1) as f64,
        }
    }

    fn observe_deformation(&mut self, evidence: &Evidence<'_>) {
        for other in evidence.others.iter().filter_map(|body| body.deformation) {
            self.peak_other = Some(self.peak_other.map_or(other.rms_pct, |peak| peak.max(other.rms_pct)));
        }
        if self.setup.soft {
            let d = evidence.target.deformation;
            self.peak.observe(d.map(|d| d.rms_pct));
            self.peak_weighted.observe(d.map(|d| d.weighted_pct));
            self.peak_max.observe(d.map(|d| d.max_pct));
        }
    }

    fn observe_pads(&mut self, evidence: &Evidence<'_>) -> [bool; 2] {
        let forces = evidence.pads.map(|pad| pad.normal_impulse_ns / self.setup.dt_s);
        let touch = forces.map(|force| force > self.setup.rules.touch_force_n);
        self.forces.peak_n = forces.iter().fold(self.forces.peak_n, |peak, force| peak.max(*force));
        if touch[0] && touch[1] {
            self.forces.sum_n += 0.5 * (forces[0] + forces[1]);
            self.forces.steps += 1;
        }
        touch
    }

    /// Whether the target is lifted; remembers which object was lifted first.
    fn observe_lift(&mut self, evidence: &Evidence<'_>) -> bool {
        let clear = |body: &BodyEvidence, rest_z: f64| {
            !self.supported(body) && body.lowest_z_w > rest_z + self.setup.rules.lift_height_m
        };
        let target = clear(&evidence.target, self.setup.target_lowest_z_w);
        let other = evidence.others.iter().zip(&self.setup.others_lowest_z_w).any(|(b, z)| clear(b, *z));
        if target {
            self.first_lifted.get_or_insert(Lifted::Target);
        } else if other {
            self.first_lifted.get_or_insert(Lifted::Other);
        }
        target
    }

    fn observe_goal(&mut self, evidence: &Evidence<'_>, touched: bool) {
        self.control.steps += 1;
        self.control.touched |= touched;
        self.control.support_ns += match self.setup.place {
            Place::On { .. } => evidence.place.support_impulse_ns,
            Place::In { .. } => evidence.target.support_impulse_ns,
        };
        if self.control.steps < self.setup.steps_per_control {
            return;
        }
        let control = std::mem::take(&mut self.control);
        let (rules, place) = (&self.setup.rules, &self.setup.place);
        let (pose, centre) = (&evidence.place.pose_w, &evidence.target.centre_w);
        let weight_ns = self.setup.target_weight_n * self.setup.dt_s * f64::from(control.steps);
        let left = self.goal.observe(&Placement {
            time_s: evidence.time_s,
            inside: place.holds(pose, centre, 0.0),
            inside_with_margin: place.holds(pose, centre, rules.leave_margin_m),
            supported: control.support_ns >= rules.support_share * weight_ns,
            touched: control.touched,
            v1: place.holds_v1(rules, pose, centre),
        });
        if left {
            self.drops.note(DropReason::LeftGoal, evidence.time_s);
        }
    }

    fn supported(&self, body: &BodyEvidence) -> bool {
        body.support_impulse_ns > self.setup.rules.touch_force_n * self.setup.dt_s
    }
}

fn contains(region: &Region, body: &BodyEvidence) -> bool {
    (0..3).all(|i| (region.min[i]..=region.max[i]).contains(&body.centre_w[i]))
}

#[cfg(test)]
#[path = "judge_tests.rs"]
mod tests;
