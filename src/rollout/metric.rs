//! Metrics of a suite, measured in an episode.

use std::{fmt::Debug, sync::Arc};

use super::{simulation::Simulation, trace::StepTrace};
use softvt_benchmark::metric::{Metric, Reduction};

/// A function of the true state after a control step.
pub trait StateFunction: Debug + Send + Sync {
    /// Its value; `None` where it has none.
    fn value(&self, sim: &Simulation, step: &StepTrace) -> Result<Option<f64>, String>;
}

#[derive(Clone, Debug)]
pub struct MeasuredMetric {
    pub metric: Metric,
    /// The function that is called after each control step.
    pub function: Arc<dyn StateFunction>,
}

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MetricValues {
    count: u32,
    last: f64,
    max: f64,
    min: f64,
    sum: f64,
}

impl MetricValues {
    pub(super) fn add(&mut self, value: f64) {
        let is_first = self.count == 0;
        self.count += 1;
        self.last = value;
        self.max = if is_first { value } else { self.max.max(value) };
        self.min = if is_first { value } else { self.min.min(value) };
        self.sum += value;
    }

    /// One number for the episode; `None` without a value.
    pub(super) fn reduced(&self, over: Reduction) -> Option<f64> {
        (self.count > 0).then(|| match over {
            Reduction::Last => self.last,
            Reduction::Max => self.max,
            Reduction::Min => self.min,
            Reduction::Mean => self.sum / f64::from(self.count),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_become_one_number() {
        let mut values = MetricValues::default();
        assert_eq!(values.reduced(Reduction::Mean), None);
        [-2.0, -6.0, -1.0].into_iter().for_each(|value| values.add(value));
        let reduced =
            [Reduction::Last, Reduction::Max, Reduction::Min, Reduction::Mean].map(|r| values.reduced(r));
        assert_eq!(reduced, [-1.0, -1.0, -6.0, -3.0].map(Some));
    }
}
