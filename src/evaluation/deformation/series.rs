//! D of one body over the physics steps of an episode: its peak, its statistics and the steps at which it is missing.

use super::Deformation;
use crate::{safety::PeakDeformation, statistics::quantile};

/// Deformations of a body, one per physics step. Adding one does not allocate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeformationSeries {
    /// D of the measured steps, %, in a buffer of the size of the budget.
    values: Box<[f64]>,
    count: usize,
    sum: f64,
    peak: PeakDeformation,
    peak_v1: Option<f64>,
    peak_max: Option<f64>,
    worst: WorstSteps,
}

/// The physics steps of a control step at which a body was deformed most.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WorstSteps {
    /// Deformation at the step with the largest D; `None` if it is unknown.
    pub deformation: Option<Deformation>,
    /// Deformation at the step with the largest D of SoftVTBench's definition.
    pub deformation_v1: Option<Deformation>,
}

/// Statistics of a series.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SeriesStatistics {
    /// Peak of D, and the number of steps at which it is missing.
    pub peak: PeakDeformation,
    /// Peak of D as SoftVTBench defines it, %.
    pub peak_v1: Option<f64>,
    /// Peak of the largest node displacement, %.
    pub peak_max: Option<f64>,
    /// Mean of D, %.
    pub mean: Option<f64>,
    /// Last D, %.
    pub last: Option<f64>,
    /// 95th percentile of D, %.
    pub p95: Option<f64>,
    /// Number of steps at which D is above τ.
    pub steps_over_tau: u64,
}

impl DeformationSeries {
    /// Empty series whose mean, last value, percentile and steps above τ are those of the first `max_steps` measured
    /// steps; peaks are of all.
    pub fn new(max_steps: usize) -> Self {
        Self { values: vec![0.0; max_steps].into(), ..Self::default() }
    }

    /// Takes in one physics step. A deformation that is not finite is missing.
    pub fn push(&mut self, deformation: Option<Deformation>) {
        let is_finite = |d: &Deformation| [d.rms_pct, d.max_pct, d.v1_rms_pct].iter().all(|x| x.is_finite());
        let Some(now) = deformation.filter(is_finite) else {
            self.peak.missing += 1;
            return;
        };
        let larger = |peak: &mut Option<f64>, d: f64| *peak = Some(peak.map_or(d, |peak| peak.max(d)));
        larger(&mut self.peak.d_pct, now.rms_pct);
        larger(&mut self.peak_v1, now.v1_rms_pct);
        larger(&mut self.peak_max, now.max_pct);
        let worse = |worst: &mut Option<Deformation>, d: fn(&Deformation) -> f64| {
            if worst.is_none_or(|worst| d(&now) >= d(&worst)) {
                *worst = Some(now);
            }
        };
        worse(&mut self.worst.deformation, |d| d.rms_pct);
        worse(&mut self.worst.deformation_v1, |d| d.v1_rms_pct);
        if let Some(slot) = self.values.get_mut(self.count) {
            *slot = now.rms_pct;
            self.count += 1;
            self.sum += now.rms_pct;
        }
    }

    /// Peak of D so far.
    pub fn peak(&self) -> PeakDeformation {
        self.peak
    }

    /// The worst steps since the last call.
    pub fn take_worst(&mut self) -> WorstSteps {
        std::mem::take(&mut self.worst)
    }

    /// Statistics of the steps so far, with those above `tau_pct`; none are without a limit.
    pub fn statistics(&self, tau_pct: Option<f64>) -> SeriesStatistics {
        let mut values = self.values[..self.count].to_vec();
        let last = values.last().copied();
        values.sort_unstable_by(f64::total_cmp);
        let is_over = |d: &&f64| tau_pct.is_some_and(|tau| **d > tau);
        SeriesStatistics {
            peak: self.peak,
            peak_v1: self.peak_v1,
            peak_max: self.peak_max,
            mean: (self.count > 0).then(|| self.sum / self.count as f64),
            last,
            p95: quantile(&values, 0.95),
            steps_over_tau: values.iter().filter(is_over).count() as u64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softvt_geometry::{Quat, Vec3};

    fn deformation(d: f64) -> Option<Deformation> {
        let (rotation, bbox_m) = (Quat::identity(), Vec3::zeros());
        Some(Deformation { rms_pct: d, max_pct: 2.0 * d, v1_rms_pct: 5.0 - d, rotation, bbox_m })
    }

    fn series(max_steps: usize, ds: &[Option<f64>]) -> DeformationSeries {
        let mut series = DeformationSeries::new(max_steps);
        ds.iter().for_each(|d| series.push(d.and_then(deformation)));
        series
    }

    #[test]
    fn the_statistics_are_those_of_the_measured_steps() {
        let ds = [Some(1.0), None, Some(4.0), Some(f64::NAN), Some(2.0), Some(3.0)];
        let mut series = series(5, &ds);
        let of = series.statistics(Some(2.5));
        assert_eq!((of.mean, of.last, of.steps_over_tau), (Some(2.5), Some(3.0), 2));
        assert_eq!(of.peak, PeakDeformation { d_pct: Some(4.0), missing: 2 });
        assert_eq!((of.peak_v1, of.peak_max), (Some(4.0), Some(8.0)));
        assert!((of.p95.unwrap() - 3.85).abs() < 1e-12, "{of:?}");
        assert_eq!(series.statistics(None).steps_over_tau, 0);
        let buffer = series.values.as_ptr();
        (0..9).for_each(|_| series.push(deformation(9.0)));
        assert_eq!(
            (series.count, series.values.as_ptr()),
            (5, buffer),
            "the buffer has the size of the budget"
        );
        assert_eq!(series.peak().d_pct, Some(9.0), "the peak is of all steps");
        assert_eq!(DeformationSeries::new(3).statistics(Some(1.0)), SeriesStatistics::default());
    }

    #[test]
    fn the_worst_steps_are_those_since_the_last_call() {
        let mut series = series(0, &[Some(1.0), Some(4.0), None, Some(2.0)]);
        let worst = series.take_worst();
        assert_eq!((worst.deformation, worst.deformation_v1), (deformation(4.0), deformation(1.0)));
        assert_eq!(series.take_worst(), WorstSteps::default());
        assert_eq!(series.peak().d_pct, Some(4.0));
    }
}
