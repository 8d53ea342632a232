//! Labelled values of axes.

/// Multiples of 1, 2 or 5 times a power of ten between two values, about `count` of them, ascending.
pub fn linear_ticks(low: f64, high: f64, count: usize) -> Vec<f64> {
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
pub fn tick_label(tick: f64, step: f64) -> String {
    let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{tick:.decimals$}");
    // No negative zero; minus signs as in text.
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
        return text.trim_start_matches('-').to_owned();
    }
    text.replace('-', "−")
}

/// The range of whole powers of ten around values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decades {
    low: f64,
    high: f64,
}

impl Decades {
    /// The range around positive values; from 1 to 10 without any.
    pub fn around(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values
            .map(|value| value.max(f64::MIN_POSITIVE).log10())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let (low, high) = ((low + 1e-9).floor(), (high - 1e-9).ceil());
        Self { low, high: high.max(low + 1.0) }
    }

    /// Position of a value between the ends, 0..=1.
    pub fn share(&self, value: f64) -> f64 {
        (value.max(f64::MIN_POSITIVE).log10() - self.low) / (self.high - self.low)
    }

    /// The powers of ten in the range.
    pub fn ticks(&self) -> impl Iterator<Item = f64> {
        (self.low as i32..=self.high as i32).map(|power| 10f64.powi(power))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers_and_their_labels_have_equal_decimals() {
        assert_eq!(linear_ticks(26.0, 30.8, 5), [26.0, 27.0, 28.0, 29.0, 30.0]);
        assert_eq!(linear_ticks(-0.252, 0.264, 4), [-0.2, 0.0, 0.2]);
        let step = tick_step(0.6, 5);
        let labels: Vec<String> = linear_ticks(0.0, 0.6, 5).iter().map(|t| tick_label(*t, step)).collect();
        assert_eq!(labels, ["0.0", "0.2", "0.4", "0.6"]);
        assert_eq!((tick_label(-0.2, 0.2), tick_label(-1e-17, 0.2)), ("−0.2".to_owned(), "0.0".to_owned()));
        assert_eq!(linear_ticks(1.0, 1.0, 4), [1.0], "an empty range has one");
        assert_eq!((tick_step(100.0, 4), tick_label(50.0, 50.0)), (50.0, "50".to_owned()));
    }
}
