//! Monitors of one target: an object that the task moves.

use crate::{
    deformation::series::{DeformationSeries, WorstSteps},
    drop::{DropEvent, DropMonitor, DropSample, ReleaseMonitor},
    evidence::{CrushedShares, Evidence, TargetEvidence},
    grip::{GripMonitor, GripSample},
    slip::{SlipMonitor, SlipSample},
    stage::{StageEvidence, StageMonitor},
    verdict::{Handling, TargetVerdict},
};

use super::{JudgeConfig, JudgedBody};

/// Normal forces on the pads over the episode.
#[derive(Clone, Copy, Debug, Default)]
struct PadForceStats {
    peak_n: f64,
    /// Sum of the mean of both pads, over the steps in which both touched.
    sum_n: f64,
    steps: u64,
}

/// One physics step, as the monitors of all targets read it.
#[derive(Clone, Copy)]
pub(super) struct StepContext<'a> {
    pub(super) config: &'a JudgeConfig,
    pub(super) evidence: &'a Evidence<'a>,
    /// True if the hand is being opened.
    pub(super) is_opening: bool,
}

#[derive(Clone, Debug)]
pub(super) struct TargetMonitors {
    release: ReleaseMonitor,
    pub(super) drops: DropMonitor,
    slip: SlipMonitor,
    grip: GripMonitor,
    pad_forces: PadForceStats,
    series: DeformationSeries,
    crushed: CrushedShares,
    pub(super) stage: StageMonitor,
    /// Contacts of the pads and lift in the last physics step.
    touch: [bool; 2],
    is_lifted: bool,
    /// True if the robot has pressed on it in the present control step.
    pub(super) was_touched: bool,
    lowest_z_w: f64,
}

impl TargetMonitors {
    /// Monitors of a target that has not moved; the episode has at most `steps` physics steps.
    pub(super) fn new(target: &JudgedBody, steps: usize) -> Self {
        Self {
            release: ReleaseMonitor::default(),
            drops: DropMonitor::default(),
            slip: SlipMonitor::default(),
            grip: GripMonitor::default(),
            pad_forces: PadForceStats::default(),
            series: DeformationSeries::new(if target.is_soft { steps } else { 0 }),
            crushed: CrushedShares::default(),
            stage: StageMonitor::default(),
            touch: [false; 2],
            is_lifted: false,
            was_touched: false,
            lowest_z_w: target.lowest_z_w,
        }
    }

    pub(super) fn observe_deformation(&mut self, own: &TargetEvidence) {
        self.series.push(own.body.deformation);
        let larger = |peak: Option<f64>, now: Option<f64>| peak.into_iter().chain(now).reduce(f64::max);
        self.crushed = CrushedShares {
            collapsed: larger(self.crushed.collapsed, own.crushed.collapsed),
            damaged: larger(self.crushed.damaged, own.crushed.damaged),
        };
    }

    /// Deformation at the worst physics steps since the last call.
    pub(super) fn take_worst(&mut self) -> WorstSteps {
        self.series.take_worst()
    }

    /// Contacts, lift, release, slip, grip and drop.
    pub(super) fn observe(&mut self, step: &StepContext<'_>, own: &TargetEvidence) {
        let StepContext { config, evidence, is_opening } = *step;
        let criteria = &config.criteria;
        self.touch = self.observe_pads(config, own);
        self.is_lifted = config.is_lifted(&own.body, self.lowest_z_w);
        let both_pads_touch = self.touch[0] && self.touch[1];
        let is_released = self.release.update(criteria, &evidence.gripper, both_pads_touch);
        let is_supported = config.is_supported(&own.body);
        let is_held = both_pads_touch && !is_released;
        self.slip.update(config.dt_s, &SlipSample { pads: own.pads, is_held, is_supported, is_opening });
        let is_carried = self.is_lifted && !is_released;
        let grip = GripSample { is_carried, is_held: both_pads_touch, grip: own.grip };
        self.grip.update(criteria, config.dt_s, config.steps_per_control, &grip);
        let sample = DropSample {
            time_s: evidence.time_s,
            centre_z: own.body.centre_w.z,
            hand_z: evidence.hand_w.z,
            is_lifted: self.is_lifted,
            is_touched: self.touch[0] || self.touch[1],
            is_touched_by_body: own.hand_force_n > criteria.touch_force_n,
            is_supported,
            is_released,
            is_in_workspace: config.workspace.contains(&own.body.centre_w),
        };
        self.drops.update(criteria, config.dt_s, &sample);
        self.was_touched |= sample.is_touched || sample.is_touched_by_body;
    }

    pub(super) fn observe_stage(&mut self, is_over_goal: bool, is_placed: bool) {
        let Self { touch, is_lifted, .. } = *self;
        self.stage.update(&StageEvidence { touch, is_lifted, is_over_goal, is_placed });
    }

    /// Returns true for each pad that touches the target.
    fn observe_pads(&mut self, config: &JudgeConfig, own: &TargetEvidence) -> [bool; 2] {
        let forces = own.pads.map(|pad| pad.normal_force_n);
        let touch = forces.map(|force| force > config.criteria.touch_force_n);
        self.pad_forces.peak_n = forces.iter().fold(self.pad_forces.peak_n, |peak, force| peak.max(*force));
        if touch[0] && touch[1] {
            self.pad_forces.sum_n += 0.5 * (forces[0] + forces[1]);
            self.pad_forces.steps += 1;
        }
        touch
    }

    /// Findings if the episode ends here. The verdict on the *object*, the first target, has no name and no handling,
    /// and it alone has all statistics of D. `missing` is the drop of an episode that did not end validly.
    pub(super) fn finish(
        &self,
        config: &JudgeConfig,
        target: &JudgedBody,
        is_object: bool,
        missing: Option<DropEvent>,
    ) -> TargetResult {
        let limit = target.limit.filter(|_| target.is_soft);
        let (slip_m, drop) = (self.slip.slip_m(), self.drops.first.or(missing));
        let series = self.series.statistics(limit.map(|limit| limit.tau_pct()));
        let percent = |share: Option<f64>| share.map(|share| 100.0 * share);
        let of_object = |d_pct: Option<f64>| d_pct.filter(|_| is_object);
        let handling = Handling {
            no_drop: drop.is_none(),
            drop,
            no_slip: slip_m <= config.criteria.slip_m,
            slip_mm: 1e3 * slip_m,
        };
        let verdict = TargetVerdict {
            object: (!is_object).then(|| target.name.clone()),
            soft: target.is_soft,
            handling: (!is_object).then_some(handling),
            d_peak: series.peak.d_pct,
            d_peak_v1: of_object(series.peak_v1),
            d_peak_max: of_object(series.peak_max),
            d_mean: of_object(series.mean),
            d_final: of_object(series.last),
            d_p95: of_object(series.p95),
            time_over_tau_s: limit.map(|_| series.steps_over_tau as f64 * config.dt_s),
            missing_deformation: series.peak.missing,
            collapsed_volume_pct: percent(self.crushed.collapsed),
            damaged_volume_pct: percent(self.crushed.damaged),
            kappa: limit.map(|limit| limit.kappa),
            tau: limit.map(|limit| limit.tau_pct()),
            d_ref: limit.map(|limit| limit.d_ref_pct),
            deformation_ok: None,
            peak_pad_force_n: self.pad_forces.peak_n,
            mean_pad_force_n: self.pad_forces.sum_n / self.pad_forces.steps.max(1) as f64,
            least_pad_force_n: self.grip.least_n,
            grip_ratio: self.grip.ratio(self.pad_forces.peak_n),
        };
        let deformation_ok = verdict.is_within(None).filter(|_| target.is_soft && missing.is_none());
        TargetResult {
            verdict: TargetVerdict { deformation_ok, ..verdict },
            handling,
            was_in_contact: self.grip.was_carried && !self.grip.lost_contact,
        }
    }
}

/// Measurements of a target.
#[derive(Clone, Debug)]
pub(super) struct TargetResult {
    pub(super) verdict: TargetVerdict,
    pub(super) handling: Handling,
    /// True if both pads touched it throughout the carry.
    pub(super) was_in_contact: bool,
}
