//! Axes of charts: the place of a value, and labelled values.

use super::drawing::Tone;

/// Number of labelled powers of ten, at most.
const MOST_POWERS: usize = 8;
/// Largest and smallest extent of a linear axis whose ticks are written as decimals.
const DECIMALS: std::ops::Range<f64> = 1e-4..1e6;
/// Share of the extent of the values that a linear axis around them adds at both ends.
const PADDING: f64 = 0.04;

#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Title, with the unit; empty for none.
    pub label: String,
    pub scale: Scale,
    pub ticks: Vec<Tick>,
    /// True for a line across the chart at each tick.
    pub has_grid: bool,
}

/// Place of a value on an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Equal steps are equal differences, in either direction.
    Linear {
        /// Value at the first end.
        from: f64,
        /// Value at the other end, another one.
        to: f64,
    },
    /// Equal steps are equal factors.
    Logarithmic {
        /// Value at the first end, positive.
        from: f64,
        /// Value at the other end, positive.
        to: f64,
    },
}

#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    pub value: f64,
    pub label: String,
    pub tone: Tone,
}

impl Tick {
    fn new(value: f64, label: String) -> Self {
        Self { value, label, tone: Tone::Ink }
    }
}

impl Scale {
    /// Place of a value, 0 to 1 between the ends.
    pub fn share(self, value: f64) -> f64 {
        match self {
            Self::Linear { from, to } => (value - from) / (to - from),
            Self::Logarithmic { from, to } => (value.max(f64::MIN_POSITIVE) / from).ln() / (to / from).ln(),
        }
    }
}

impl Axis {
    pub fn linear(label: &str, from: f64, to: f64, intervals: usize) -> Self {
        let step = tick_step((to - from).abs(), intervals);
        let is_decimal = from.abs().max(to.abs()) == 0.0 || DECIMALS.contains(&from.abs().max(to.abs()));
        let label_of = |tick: f64| match is_decimal {
            true => tick_label(tick, step),
            // Rounded, since multiples of the step are not exact.
            false => format!("{:e}", format!("{tick:.3e}").parse::<f64>().unwrap_or(tick)),
        };
        let ticks = linear_ticks(from, to, intervals).into_iter().map(|tick| Tick::new(tick, label_of(tick)));
        Self {
            label: label.to_owned(),
            scale: Scale::Linear { from, to },
            ticks: ticks.collect(),
            has_grid: false,
        }
    }

    /// A linear axis around values. An axis of values that are not negative begins at 0 or above.
    pub fn around(label: &str, values: impl Iterator<Item = f64>, intervals: usize) -> Self {
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (low, high) = values.fold(ends, |(low, high), x| (low.min(x), high.max(x)));
        if low > high {
            return Self::linear(label, 0.0, 1.0, intervals);
        }
        let padding = if low == high { 0.5 * low.abs().max(1.0) } else { PADDING * (high - low) };
        let from = if low >= 0.0 { (low - padding).max(0.0) } else { low - padding };
        Self::linear(label, from, high + padding, intervals)
    }

    /// A logarithmic axis of whole powers of ten around positive values; from 1 to 10 without any.
    pub fn decades(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values
            .map(|value| value.max(f64::MIN_POSITIVE).log10())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let (low, high) = if low > high { (0.0, 1.0) } else { ((low + 1e-9).floor(), (high - 1e-9).ceil()) };
        let high = high.max(low + 1.0);
        let powers: Vec<i32> = (low as i32..=high as i32).collect();
        let label_of = |value: f64| match (DECIMALS.start..1e4).contains(&value) {
            true => tick_label(value, value.min(1.0)),
            false => format!("{value:e}"),
        };
        let ticks = powers.iter().step_by(powers.len().div_ceil(MOST_POWERS)).map(|power| {
            let value = 10f64.powi(*power);
            Tick::new(value, label_of(value))
        });
        Self {
            label: label.to_owned(),
            scale: Scale::Logarithmic { from: 10f64.powf(low), to: 10f64.powf(high) },
            ticks: ticks.collect(),
            has_grid: false,
        }
    }

    /// An axis of counts, logarithmic if rare ones would not be visible next to frequent ones.
    pub fn counts(counts: &[usize], intervals: usize) -> Self {
        /// Ratio of the largest to the smallest count from which the axis is logarithmic.
        const LOG_RATIO: f64 = 50.0;
        let largest = counts.iter().copied().max().unwrap_or(1).max(1) as f64;
        let least = counts.iter().copied().filter(|count| *count > 0).min().unwrap_or(1) as f64;
        if largest / least < LOG_RATIO {
            let mut axis = Self::linear("count", 0.0, largest, intervals);
            axis.ticks.retain(|tick| tick.value.fract() == 0.0);
            return axis;
        }
        let mut axis = Self::decades("count, log", [1.0, largest].into_iter());
        axis.ticks.retain(|tick| tick.value <= largest);
        // A count of 1 has some height.
        Self { scale: Scale::Logarithmic { from: 0.5, to: largest }, ..axis }
    }

    /// The same axis with a line across the chart at each tick.
    pub fn with_grid(self) -> Self {
        Self { has_grid: true, ..self }
    }

    /// Place of a value on the axis; values beyond its ends are at them.
    pub fn share(&self, value: f64) -> f64 {
        self.scale.share(value).clamp(0.0, 1.0)
    }
}

/// Multiples of 1, 2 or 5 times a power of ten between two values, about `count` of them, ascending.
fn linear_ticks(low: f64, high: f64, count: usize) -> Vec<f64> {
    let (low, high) = (low.min(high), low.max(high));
    if low == high {
        return vec![low];
    }
    let step = tick_step(high - low, count);
    let at = |index: i64| index as f64 * step;
    let first = (low / step - 1e-9).ceil() as i64;
    (first..).map(at).take_while(|tick| *tick <= high + 1e-9 * step).take(10 * count.max(1)).collect()
}

/// The smallest of 1, 2 and 5 times a power of ten of which at most `count` fit into `extent`.
pub fn tick_step(extent: f64, count: usize) -> f64 {
    let least = extent.max(f64::MIN_POSITIVE.sqrt()) / count.max(1) as f64;
    let power = 10f64.powi(least.log10().floor() as i32);
    let fits = |factor: &f64| factor * power >= least * (1.0 - 1e-9);
    [1.0, 2.0, 5.0].into_iter().find(fits).unwrap_or(10.0) * power
}

/// A tick with the decimals that its step needs.
fn tick_label(tick: f64, step: f64) -> String {
    let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{tick:.decimals$}");
    // No negative zero; minus signs as in text.
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
        return text.trim_start_matches('-').to_owned();
    }
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<&str> {
        axis.ticks.iter().map(|tick| tick.label.as_str()).collect()
    }

    #[test]
    fn ticks_are_round_numbers_and_their_labels_have_equal_decimals() {
        assert_eq!(linear_ticks(26.0, 30.8, 5), [26.0, 27.0, 28.0, 29.0, 30.0]);
        assert_eq!(labels(&Axis::linear("", 0.0, 0.6, 5)), ["0.0", "0.2", "0.4", "0.6"]);
        assert_eq!(labels(&Axis::linear("", -0.252, 0.264, 4)), ["−0.2", "0.0", "0.2"]);
        assert_eq!(labels(&Axis::linear("", 0.0, 3e9, 3)), ["0e0", "1e9", "2e9", "3e9"]);
        assert_eq!((tick_label(-1e-17, 0.2), tick_step(100.0, 4)), ("0.0".to_owned(), 50.0));
        assert_eq!(linear_ticks(1.0, 1.0, 4), [1.0], "an empty range has one");
    }

    #[test]
    fn axes_fit_any_values() {
        let decades = Axis::decades("", [0.01, 1000.0].into_iter());
        assert_eq!(labels(&decades), ["0.01", "0.1", "1", "10", "100", "1000"]);
        assert!(decades.share(0.01).abs() < 1e-12 && (decades.share(1.0) - 0.4).abs() < 1e-12);
        let wide = Axis::decades("", [1e-9, 1e12].into_iter());
        assert!(labels(&wide).contains(&"1e12") && wide.ticks.len() <= MOST_POWERS, "{wide:?}");
        for axis in [
            Axis::around("", [].into_iter(), 4),
            Axis::around("", [3.0].into_iter(), 4),
            Axis::around("", [-5.0, 5.0].into_iter(), 4),
            Axis::decades("", [].into_iter()),
            Axis::decades("", [7.0].into_iter()),
        ] {
            assert!([3.0, 7.0].iter().all(|value| axis.share(*value).is_finite()), "{axis:?}");
            assert!(axis.ticks.len() > 1, "{axis:?}");
        }
        assert_eq!(Axis::around("", [0.1, 5.0].into_iter(), 4).scale.share(0.0), 0.0, "it begins at 0");
    }

    #[test]
    fn rare_counts_beside_frequent_ones_are_seen() {
        assert_eq!(labels(&Axis::counts(&[1, 2, 4], 3)), ["0", "2", "4"]);
        let skewed = Axis::counts(&[10_000, 0, 1], 3);
        assert_eq!(labels(&skewed), ["1", "10", "100", "1000", "1e4"]);
        assert!(skewed.share(1.0) > 0.06 && skewed.share(0.0) == 0.0);
    }
}
