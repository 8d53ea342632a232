//! D of the target at every physics step of an episode, in a buffer of the size of the budget.

use crate::statistics::quantile;

/// Series of D, %. Adding a value does not allocate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeformationSeries {
    values: Box<[f64]>,
    count: usize,
    sum: f64,
    steps_over_tau: u64,
}

/// Statistics of a series.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SeriesStatistics {
    /// Mean, %.
    pub mean: Option<f64>,
    /// Last value, %.
    pub last: Option<f64>,
    /// 95th percentile, %.
    pub p95: Option<f64>,
    /// Number of steps above τ.
    pub steps_over_tau: u64,
}

impl DeformationSeries {
    /// Empty series of at most `max_steps` values; later ones do not enter.
    pub fn new(max_steps: usize) -> Self {
        Self { values: vec![0.0; max_steps].into(), ..Self::default() }
    }

    /// Adds the D of one step; values that are missing or not finite are left out.
    pub fn push(&mut self, d_pct: Option<f64>, tau_pct: Option<f64>) {
        let Some(d) = d_pct.filter(|d| d.is_finite()) else { return };
        let Some(slot) = self.values.get_mut(self.count) else { return };
        *slot = d;
        self.count += 1;
        self.sum += d;
        self.steps_over_tau += u64::from(tau_pct.is_some_and(|tau| d > tau));
    }

    /// Statistics so far. Reorders the values.
    pub fn finish(mut self) -> SeriesStatistics {
        let values = &mut self.values[..self.count];
        let last = values.last().copied();
        values.sort_unstable_by(f64::total_cmp);
        SeriesStatistics {
            mean: (self.count > 0).then(|| self.sum / self.count as f64),
            last,
            p95: quantile(values, 0.95),
            steps_over_tau: self.steps_over_tau,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_statistics_are_those_of_the_measured_steps() {
        let mut series = DeformationSeries::new(5);
        for d in [Some(1.0), None, Some(4.0), Some(f64::NAN), Some(2.0), Some(3.0)] {
            series.push(d, Some(2.5));
        }
        let of = series.clone().finish();
        assert_eq!((of.mean, of.last, of.steps_over_tau), (Some(2.5), Some(3.0), 2));
        assert!((of.p95.unwrap() - 3.85).abs() < 1e-12, "{of:?}");
        let buffer = series.values.as_ptr();
        (0..9).for_each(|_| series.push(Some(9.0), None));
        assert_eq!(
            (series.count, series.values.as_ptr()),
            (5, buffer),
            "the buffer has the size of the budget"
        );
        assert_eq!(DeformationSeries::new(3).finish(), SeriesStatistics::default());
    }
}
