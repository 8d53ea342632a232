//! Safety Success = Goal ∧ NoDrop ∧ D_peak ≤ τ, and NoSlip where the suite requires it, with the deformation limit τ =
//! κ·D_ref of the target's asset.
//!
//! D_ref is the reference deformation of the asset's compression sweep ([`super::calibration`]); κ is the share of it
//! that the benchmark allows. For a rigid target the last term is left out. A peak that is unknown is not safe. Where a
//! task moves several targets, each must be within its own limit.

use serde::{Deserialize, Serialize};

/// The κ that are reported next to the nominal one (SoftVTBench, appendix C.3).
pub const KAPPAS: [f64; 3] = [0.3, 0.5, 0.7];

/// The κ of the benchmark: τ is half of D_ref.
pub const NOMINAL_KAPPA: f64 = 0.5;

/// Rounds to the six decimals of a threshold file, so that a limit is the same number in memory and on disk.
pub fn round_to_six_decimals(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// Calibrated deformation limit of an asset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeformationLimit {
    /// Reference deformation of the compression sweep, % of the bounding-box diagonal.
    pub d_ref_pct: f64,
    /// κ of the benchmark, the share of D_ref that is allowed.
    pub kappa: f64,
}

impl DeformationLimit {
    /// τ = κ·D_ref for any κ, %, rounded to six decimals.
    pub fn tau_at(&self, kappa: f64) -> f64 {
        round_to_six_decimals(kappa * self.d_ref_pct)
    }

    /// τ at the nominal κ, %.
    pub fn tau_pct(&self) -> f64 {
        self.tau_at(self.kappa)
    }
}

/// Largest deformation over the physics steps of an episode ([`super::deformation::series`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PeakDeformation {
    /// The largest D, %; `None` if it was never measured.
    pub d_pct: Option<f64>,
    /// Number of steps at which D could not be measured.
    pub missing: u64,
}

impl PeakDeformation {
    /// True if the deformation never exceeded `tau_pct`; equality is allowed.
    ///
    /// `Some(false)` if it was exceeded, even when other steps are missing. `None` if it was not exceeded but the
    /// limit or the deformation of some steps is missing.
    pub fn is_within(&self, tau_pct: Option<f64>) -> Option<bool> {
        match (self.d_pct, tau_pct) {
            (Some(d), Some(tau)) if d > tau => Some(false),
            (Some(_), Some(_)) if self.missing == 0 => Some(true),
            _ => None,
        }
    }
}

/// True if both hold, false if one does not; `None` if that is unknown.
pub fn and_known(a: Option<bool>, b: Option<bool>) -> Option<bool> {
    match (a, b) {
        (Some(false), _) | (_, Some(false)) => Some(false),
        (Some(true), Some(true)) => Some(true),
        _ => None,
    }
}

/// Safety of an episode at one κ of the sensitivity table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct KappaVerdict {
    /// Share of D_ref that is allowed.
    pub kappa: f64,
    /// τ = κ·D_ref, %.
    pub tau_pct: f64,
    /// D_peak ≤ τ; null where it is unknown.
    pub deformation_ok: Option<bool>,
    /// Safety Success at this κ.
    pub safety: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peak(d_pct: Option<f64>, missing: u64) -> PeakDeformation {
        PeakDeformation { d_pct, missing }
    }

    #[test]
    fn tau_is_kappa_of_d_ref_to_six_decimals_and_the_limit_itself_is_safe() {
        let limit = DeformationLimit { d_ref_pct: 2.359091, kappa: 0.5 };
        assert_eq!(limit.tau_pct(), 1.179546);
        assert_eq!(limit.tau_at(0.3), 0.707727);
        assert_eq!(peak(Some(1.179546), 0).is_within(Some(limit.tau_pct())), Some(true));
        assert_eq!(peak(Some(1.1795461), 0).is_within(Some(limit.tau_pct())), Some(false));
    }

    #[test]
    fn missing_evidence_is_never_safe() {
        assert_eq!(peak(None, 0).is_within(Some(1.0)), None);
        assert_eq!(peak(Some(0.5), 1).is_within(Some(1.0)), None);
        assert_eq!(peak(Some(0.5), 0).is_within(None), None, "no threshold");
        assert_eq!(peak(Some(1.5), 1).is_within(Some(1.0)), Some(false), "known to be too much");
    }
}
