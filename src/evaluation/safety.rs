//! Safety Success = Goal ∧ NoDrop ∧ D_peak ≤ τ, and the deformation limit τ = κ·D_ref.

use serde::{Deserialize, Serialize};

/// The κ reported beside the nominal one (SoftVTBench, appendix C.3).
pub const KAPPAS: [f64; 3] = [0.3, 0.5, 0.7];

/// The nominal κ.
pub const NOMINAL_KAPPA: f64 = 0.5;

/// Rounds to the six decimals of a threshold file, so that a limit is the same number in memory and on disk.
pub fn six_decimals(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// The calibrated deformation limit of an asset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// Largest stable deformation of the compression sweep, %.
    pub d_ref_pct: f64,
    /// Nominal κ.
    pub kappa: f64,
}

impl Limit {
    /// τ at `kappa`, %, to six decimals.
    pub fn tau_at(&self, kappa: f64) -> f64 {
        six_decimals(kappa * self.d_ref_pct)
    }

    /// The nominal τ, %.
    pub fn tau_pct(&self) -> f64 {
        self.tau_at(self.kappa)
    }
}

/// Peak deformation as evidence.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peak {
    /// The largest D seen, %; `None` if none was.
    pub d_pct: Option<f64>,
    /// Steps at which D could not be measured.
    pub missing: u64,
}

impl Peak {
    /// Takes in the D of one step.
    pub fn observe(&mut self, d_pct: Option<f64>) {
        match d_pct.filter(|d| d.is_finite()) {
            Some(d) => self.d_pct = Some(self.d_pct.map_or(d, |peak| peak.max(d))),
            None => self.missing += 1,
        }
    }

    /// Whether the deformation stayed within `tau_pct`: `Some(false)` once it was above, whatever is missing; `None`
    /// where it was not and evidence or the limit is missing.
    pub fn within(&self, tau_pct: Option<f64>) -> Option<bool> {
        match (self.d_pct, tau_pct) {
            (Some(d), Some(tau)) if d > tau => Some(false),
            (Some(_), Some(_)) if self.missing == 0 => Some(true),
            _ => None,
        }
    }
}

/// Safety Success. Deformation that is unknown is not safe; for a rigid object it does not apply.
pub fn safe(goal: bool, no_drop: bool, soft: bool, deformation_ok: Option<bool>) -> bool {
    goal && no_drop && (!soft || deformation_ok == Some(true))
}

/// One row of the κ sensitivity of an episode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct KappaVerdict {
    /// κ.
    pub kappa: f64,
    /// τ = κ·D_ref, %.
    pub tau_pct: f64,
    /// D_peak ≤ τ.
    pub deformation_ok: Option<bool>,
    /// Safety Success at this κ.
    pub safety: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peak(ds: &[Option<f64>]) -> Peak {
        let mut peak = Peak::default();
        ds.iter().for_each(|d| peak.observe(*d));
        peak
    }

    #[test]
    fn tau_is_kappa_of_d_ref_to_six_decimals_and_the_limit_itself_is_safe() {
        let limit = Limit { d_ref_pct: 2.359091, kappa: 0.5 };
        assert_eq!(limit.tau_pct(), 1.179546);
        assert_eq!(limit.tau_at(0.3), 0.707727);
        assert_eq!(peak(&[Some(1.179546)]).within(Some(limit.tau_pct())), Some(true));
        assert_eq!(peak(&[Some(1.1795461)]).within(Some(limit.tau_pct())), Some(false));
    }

    #[test]
    fn missing_evidence_is_never_safe() {
        assert_eq!(peak(&[]).within(Some(1.0)), None);
        assert_eq!(peak(&[Some(0.5), None]).within(Some(1.0)), None);
        assert_eq!(peak(&[Some(0.5), Some(f64::NAN)]).within(Some(1.0)), None);
        assert_eq!(peak(&[Some(0.5)]).within(None), None, "no threshold");
        assert_eq!(peak(&[Some(1.5), None]).within(Some(1.0)), Some(false), "known to be too much");
        assert!(!safe(true, true, true, None));
    }

    #[test]
    fn safety_needs_every_part_and_deformation_only_for_soft_objects() {
        assert!(safe(true, true, true, Some(true)));
        assert!(!safe(false, true, true, Some(true)));
        assert!(!safe(true, false, true, Some(true)));
        assert!(!safe(true, true, true, Some(false)));
        assert!(safe(true, true, false, None));
    }
}
