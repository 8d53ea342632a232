//! Safe interaction envelope of an asset: from the closure that just holds it to the closure that deforms it by τ.
//!
//! - Lower bound: the smallest closure at which every grasp–lift–hold trial held.
//! - Upper bound: the closure at which D reaches τ = κ·D_ref in the compression sweep. D_ref is the largest deformation
//!   of a *stable* squeeze ([`SweepRow::meets_criteria`]; SoftVTBench, appendix C.3).
//!
//! Closure is 0 with the gripper open (80 mm) and 1 with the gels in contact. `softvt
//! scripts/calibrate.lua` runs both scans.

use serde::{Deserialize, Serialize};

use super::safety::{DeformationLimit, round_to_six_decimals};

/// Exclusive lower bound of det F in a stable squeeze.
const MIN_DET_F: f64 = 0.1;
/// Exclusive upper bound of the node speed at rest after a stable squeeze, m/s.
const MAX_NODE_SPEED_M_S: f64 = 0.005;
/// Exclusive upper bound of the slip in a stable squeeze, mm.
const MAX_SLIP_MM: f64 = 2.0;

/// Trials at one closure of the lower-bound scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HoldRow {
    /// Commanded closure, 0 (open) to 1 (closed).
    pub closure: f64,
    /// Number of trials at this closure.
    pub trials: u32,
    /// Number of trials that held without slip or drop.
    pub held: u32,
    /// Largest slip over the trials, mm.
    pub slip_mm: f64,
    /// Largest peak D over the trials, %.
    pub d_peak_pct: f64,
}

/// Squeeze at one closure of the compression sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepRow {
    /// Commanded closure, 0 (open) to 1 (closed).
    pub closure: f64,
    /// Measured apex-to-apex width, mm.
    pub gripper_width_mm: f64,
    /// Peak D while squeezing, %.
    pub d_peak_pct: f64,
    /// Mean normal force per pad at rest, N.
    pub force_n: f64,
    /// Smallest det F over all Gauss points and steps.
    pub min_det_f: f64,
    /// Largest node speed over the observation window at rest, m/s.
    pub node_speed_m_s: f64,
    /// True if both pads touched at rest.
    pub both_pads: bool,
    /// Slip while squeezing, mm.
    pub slip_mm: f64,
    /// True if the squeeze counts for D_ref.
    pub stable: bool,
}

impl SweepRow {
    /// True if the squeeze is stable: both pads touch, no element is nearly inverted, no node moves at rest and the
    /// object does not slip, within the bounds of this module. `stable` is not read. A squeeze with a number that is not
    /// finite is not stable.
    pub fn meets_criteria(&self) -> bool {
        self.both_pads
            && self.d_peak_pct.is_finite()
            && self.min_det_f > MIN_DET_F
            && self.node_speed_m_s < MAX_NODE_SPEED_M_S
            && self.slip_mm < MAX_SLIP_MM
    }
}

/// Envelope of an asset, with the rows it was computed from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Envelope {
    /// Smallest closure at which every trial held; null without one.
    pub closure_lower: Option<f64>,
    /// Closure at which D reaches τ; null if the sweep does not reach it.
    pub closure_at_tau: Option<f64>,
    /// Closure of the row that gave D_ref; null without a stable squeeze.
    pub closure_at_d_ref: Option<f64>,
    /// Lower-bound scan, by increasing closure.
    pub holds: Vec<HoldRow>,
    /// Compression sweep, by increasing closure.
    pub sweep: Vec<SweepRow>,
}

impl Envelope {
    /// Sorts the rows by closure and computes the bounds.
    pub fn new(mut holds: Vec<HoldRow>, mut sweep: Vec<SweepRow>, kappa: f64) -> Self {
        holds.sort_by(|a, b| a.closure.total_cmp(&b.closure));
        sweep.sort_by(|a, b| a.closure.total_cmp(&b.closure));
        let limit = deformation_limit(&sweep, kappa);
        let reference = limit.and_then(|l| {
            sweep.iter().find(|row| row.stable && round_to_six_decimals(row.d_peak_pct) == l.d_ref_pct)
        });
        Self {
            closure_lower: holds
                .iter()
                .find(|row| row.trials > 0 && row.held == row.trials)
                .map(|row| row.closure),
            closure_at_tau: limit.and_then(|l| closure_at(&sweep, l.tau_pct())),
            closure_at_d_ref: reference.map(|row| row.closure),
            holds,
            sweep,
        }
    }

    /// True if some closure both holds the object and stays below τ.
    pub fn has_safe_window(&self) -> bool {
        match (self.closure_lower, self.closure_at_tau) {
            (Some(lower), Some(upper)) => lower < upper,
            _ => false,
        }
    }
}

/// Deformation limit of a sweep: D_ref is the largest D of a stable row, rounded to six decimals. `None` if no stable
/// row has a deformation above zero.
pub fn deformation_limit(sweep: &[SweepRow], kappa: f64) -> Option<DeformationLimit> {
    let stable = sweep.iter().filter(|row| row.stable && row.d_peak_pct.is_finite());
    let largest = stable.map(|row| row.d_peak_pct).fold(0.0_f64, f64::max);
    (largest > 0.0).then_some(DeformationLimit { d_ref_pct: round_to_six_decimals(largest), kappa })
}

/// Closure at which D first reaches `d_pct`, linear between the rows; `sweep` by increasing closure. `None` if the
/// first row is above it or no row reaches it.
fn closure_at(sweep: &[SweepRow], d_pct: f64) -> Option<f64> {
    sweep.windows(2).find(|pair| pair[0].d_peak_pct <= d_pct && pair[1].d_peak_pct >= d_pct).map(|pair| {
        let rise = pair[1].d_peak_pct - pair[0].d_peak_pct;
        let share = if rise > 0.0 { (d_pct - pair[0].d_peak_pct) / rise } else { 0.0 };
        pair[0].closure + share * (pair[1].closure - pair[0].closure)
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn hold(closure: f64, held: u32) -> HoldRow {
        HoldRow { closure, trials: 5, held, slip_mm: 0.1, d_peak_pct: 0.5 }
    }

    pub(crate) fn squeeze(closure: f64, d: f64, stable: bool) -> SweepRow {
        SweepRow {
            closure,
            gripper_width_mm: 80.0 * (1.0 - closure),
            d_peak_pct: d,
            force_n: 2.0,
            min_det_f: 0.6,
            node_speed_m_s: 1e-4,
            both_pads: true,
            slip_mm: 0.0,
            stable,
        }
    }

    #[test]
    fn the_envelope_is_from_the_loosest_reliable_hold_to_the_closure_at_tau() {
        let holds = vec![hold(0.34, 5), hold(0.30, 0), hold(0.32, 4)];
        let sweep = vec![
            squeeze(0.3, 0.0, true),
            squeeze(0.4, 1.0, true),
            squeeze(0.5, 3.0, true),
            squeeze(0.6, 9.0, false),
        ];
        let envelope = Envelope::new(holds, sweep, 0.5);
        assert_eq!(envelope.closure_lower, Some(0.34));
        assert_eq!(envelope.closure_at_d_ref, Some(0.5));
        assert!(
            (envelope.closure_at_tau.unwrap() - 0.425).abs() < 1e-12,
            "D = 1.5 lies a quarter of the way"
        );
        assert!(envelope.has_safe_window());
        assert_eq!(
            deformation_limit(&envelope.sweep, 0.5),
            Some(DeformationLimit { d_ref_pct: 3.0, kappa: 0.5 })
        );
    }

    #[test]
    fn without_a_stable_squeeze_or_a_reliable_hold_there_is_no_window() {
        let envelope = Envelope::new(vec![hold(0.3, 4)], vec![squeeze(0.3, 1.0, false)], 0.5);
        assert_eq!((envelope.closure_lower, envelope.closure_at_tau), (None, None));
        assert!(!envelope.has_safe_window());
        assert_eq!(deformation_limit(&envelope.sweep, 0.5), None);
        let late =
            Envelope::new(vec![hold(0.5, 5)], vec![squeeze(0.3, 0.0, true), squeeze(0.4, 2.0, true)], 0.5);
        assert!(!late.has_safe_window(), "it holds only beyond the limit");
    }

    #[test]
    fn every_criterion_of_stability_counts() {
        let row = squeeze(0.3, 1.0, false);
        assert!(row.meets_criteria());
        for bad in [
            SweepRow { min_det_f: 0.1, ..row.clone() },
            SweepRow { node_speed_m_s: 0.005, ..row.clone() },
            SweepRow { both_pads: false, ..row.clone() },
            SweepRow { slip_mm: 2.0, ..row.clone() },
            SweepRow { d_peak_pct: f64::NAN, ..row.clone() },
        ] {
            assert!(!bad.meets_criteria(), "{bad:?}");
        }
    }
}
