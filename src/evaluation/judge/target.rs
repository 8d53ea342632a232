//! Monitors of one target: an object that the task moves.

use crate::{
    deformation::series::{DeformationSeries, SeriesStatistics, WorstSteps},
    drop::{DropEvent, DropMonitor, DropSample, ReleaseMonitor},
    evidence::{CrushedShares, Evidence, TargetEvidence},
    grip::{GripMonitor, GripSample},
    safety::DeformationLimit,
    slip::{SlipMonitor, SlipSample},
    stage::{StageEvidence, StageMonitor},
    verdict::TargetVerdict,
};

use super::{JudgeConfig, Target};

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
    pub(super) fn new(target: &Target, steps: usize) -> Self {
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

    /// What was found, once the episode has ended.
    pub(super) fn finish(self, config: &JudgeConfig, target: &Target, valid: bool) -> TargetResult {
        let limit = target.limit.filter(|_| target.is_soft);
        let slip_m = self.slip.slip_m();
        TargetResult {
            name: target.name.clone(),
            is_soft: target.is_soft,
            valid,
            limit,
            series: self.series.finish(limit.map(|limit| limit.tau_pct())),
            crushed: self.crushed,
            drop: self.drops.first,
            slip_mm: 1e3 * slip_m,
            no_slip: slip_m <= config.criteria.slip_m,
            peak_pad_force_n: self.pad_forces.peak_n,
            mean_pad_force_n: self.pad_forces.sum_n / self.pad_forces.steps.max(1) as f64,
            grip_ratio: self.grip.ratio(self.pad_forces.peak_n),
            grip: self.grip,
        }
    }
}

/// What was found of a target.
#[derive(Clone, Debug, Default)]
pub(super) struct TargetResult {
    name: String,
    pub(super) is_soft: bool,
    /// True if the episode ended validly.
    valid: bool,
    pub(super) limit: Option<DeformationLimit>,
    pub(super) series: SeriesStatistics,
    pub(super) crushed: CrushedShares,
    drop: Option<DropEvent>,
    pub(super) slip_mm: f64,
    no_slip: bool,
    pub(super) peak_pad_force_n: f64,
    pub(super) mean_pad_force_n: f64,
    pub(super) grip_ratio: Option<f64>,
    pub(super) grip: GripMonitor,
}

impl TargetResult {
    /// True if D stayed within κ·D_ref, with the κ of the limit if none is given; `None` for a rigid target and where
    /// evidence is missing.
    pub(super) fn is_within(&self, kappa: Option<f64>) -> Option<bool> {
        let tau = self.limit.map(|limit| kappa.map_or_else(|| limit.tau_pct(), |kappa| limit.tau_at(kappa)));
        if self.is_soft && self.valid { self.series.peak.is_within(tau) } else { None }
    }

    /// Time for which D exceeded τ in physics steps of `dt_s`, s; `None` without a limit.
    pub(super) fn time_over_tau(&self, dt_s: f64) -> Option<f64> {
        self.limit.map(|_| self.series.steps_over_tau as f64 * dt_s)
    }

    /// Its part of the verdict.
    pub(super) fn verdict(&self, dt_s: f64) -> TargetVerdict {
        TargetVerdict {
            object: self.name.clone(),
            soft: self.is_soft,
            no_drop: self.drop.is_none(),
            drop: self.drop,
            no_slip: self.no_slip,
            slip_mm: self.slip_mm,
            d_peak: self.series.peak.d_pct,
            time_over_tau_s: self.time_over_tau(dt_s),
            missing_deformation: self.series.peak.missing,
            collapsed_volume_pct: self.crushed.collapsed.map(|share| 100.0 * share),
            damaged_volume_pct: self.crushed.damaged.map(|share| 100.0 * share),
            kappa: self.limit.map(|limit| limit.kappa),
            tau: self.limit.map(|limit| limit.tau_pct()),
            d_ref: self.limit.map(|limit| limit.d_ref_pct),
            deformation_ok: self.is_within(None),
            peak_pad_force_n: self.peak_pad_force_n,
            mean_pad_force_n: self.mean_pad_force_n,
            least_pad_force_n: self.grip.least_n,
            grip_ratio: self.grip_ratio,
        }
    }
}
