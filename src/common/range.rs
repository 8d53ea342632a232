//! Ranges of numbers: what a parameter may be, in settings, materials and scripts.

use super::text::{exact_number, format_number};

/// Bounds of a finite number, of which either end may be excluded, and the usual values within them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    pub min: f64,
    pub max: f64,
    /// True if `min` itself is refused.
    pub above_min: bool,
    /// True if `max` itself is refused.
    pub below_max: bool,
    pub usual_min: f64,
    pub usual_max: f64,
}

#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path}: expected {expected}, got {value}")]
pub struct RangeError {
    /// Dotted path of the parameter, for example `robot.arm.kp`.
    pub path: String,
    /// Description of the valid range, with its unit.
    pub expected: String,
    /// Value given, as text.
    pub value: String,
}

impl Range {
    pub const ANY: Self = Self {
        min: f64::NEG_INFINITY,
        max: f64::INFINITY,
        above_min: false,
        below_max: false,
        usual_min: f64::NEG_INFINITY,
        usual_max: f64::INFINITY,
    };
    pub const POSITIVE: Self = Self { min: 0.0, above_min: true, ..Self::ANY };
    pub const NOT_NEGATIVE: Self = Self::at_least(0.0);

    /// From `min`, included.
    pub const fn at_least(min: f64) -> Self {
        Self { min, ..Self::ANY }
    }

    /// From `min` to `max`, both included.
    pub const fn closed(min: f64, max: f64) -> Self {
        Self { min, max, ..Self::ANY }
    }

    /// From `min` (included) to `max` (excluded).
    pub const fn below(min: f64, max: f64) -> Self {
        Self { min, max, below_max: true, ..Self::ANY }
    }

    /// From `min` (excluded) to `max` (included).
    pub const fn above(min: f64, max: f64) -> Self {
        Self { min, max, above_min: true, ..Self::ANY }
    }

    /// From `min` to `max`, both included; an end that is `None` is open.
    pub fn between(min: Option<f64>, max: Option<f64>) -> Self {
        Self::closed(min.unwrap_or(f64::NEG_INFINITY), max.unwrap_or(f64::INFINITY))
    }

    /// The same bounds, with the usual values from `min` to `max`. Others are valid, and most likely in another unit.
    pub const fn usually(self, min: f64, max: f64) -> Self {
        Self { usual_min: min, usual_max: max, ..self }
    }

    /// Describes a value outside of the usual range, and the unit prefix that would bring it inside. `None`
    /// for a usual value.
    pub fn unusual(&self, value: f64, unit: &str) -> Option<String> {
        /// Kilo and milli, centimetres and percent.
        const FACTORS: [f64; 4] = [1e3, 1e-3, 1e-2, 1e2];
        let usual = Self::closed(self.usual_min, self.usual_max);
        if usual.contains(value) || !value.is_finite() {
            return None;
        }
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let inside = FACTORS.iter().find(|factor| usual.contains(value * **factor));
        let hint = inside.map_or(String::new(), |factor| format!("; ×{factor} would be inside"));
        let [value, min, max] = [value, self.usual_min, self.usual_max].map(format_number);
        Some(format!("{value}{unit} is outside of the usual range {min}..{max}{unit}{hint}"))
    }

    /// True if `value` is finite and within the bounds.
    pub fn contains(&self, value: f64) -> bool {
        let low = if self.above_min { value > self.min } else { value >= self.min };
        let high = if self.below_max { value < self.max } else { value <= self.max };
        value.is_finite() && low && high
    }

    /// Checks a value of the parameter at `path`, which has this unit; "" for none.
    ///
    /// # Errors
    /// The value is outside of the range.
    pub fn check(&self, path: &str, value: f64, unit: &str) -> Result<(), RangeError> {
        if self.contains(value) {
            return Ok(());
        }
        let expected = self.expected("a number", unit);
        Err(RangeError { path: path.to_owned(), expected, value: self.show_outside(value) })
    }

    /// A value outside of the range for a message: all of its digits where a rounded one would be inside.
    pub fn show_outside(&self, value: f64) -> String {
        let shown = format_number(value);
        let is_inside = shown.parse().is_ok_and(|shown| self.contains(shown));
        if is_inside { exact_number(value) } else { shown }
    }

    /// A value of this range in words, where `noun` says what it is: `a number in 0..0.5 (rad)`.
    pub fn expected(&self, noun: &str, unit: &str) -> String {
        let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
        format!("{noun}{}{unit}", self.describe())
    }

    /// The bounds for a message: ` in 0..10`, ` above 0`, …; empty for any number.
    pub fn describe(&self) -> String {
        let [min, max] = [self.min, self.max]
            .map(|end| if end.fract() == 0.0 { end.to_string() } else { format_number(end) });
        match (self.min.is_finite(), self.max.is_finite()) {
            (false, false) => String::new(),
            (true, false) if self.above_min => format!(" above {min}"),
            (true, false) => format!(" of {min} or more"),
            (false, true) => format!(" of {max} or less"),
            (true, true) => {
                let low = if self.above_min { "above " } else { "" };
                let high = if self.below_max { "below " } else { "" };
                format!(" in {low}{min}..{high}{max}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_count_as_declared_and_numbers_that_are_not_finite_lie_in_no_range() {
        let ends = |range: Range| [0.0, 0.25, 0.5].map(|value| range.contains(value));
        assert_eq!(ends(Range::closed(0.0, 0.5)), [true, true, true]);
        assert_eq!(ends(Range::below(0.0, 0.5)), [true, true, false]);
        assert_eq!(ends(Range::above(0.0, 0.5)), [false, true, true]);
        assert_eq!(ends(Range::between(Some(0.25), None)), [false, true, true]);
        assert_eq!(ends(Range::POSITIVE), [false, true, true]);
        let not_finite = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        assert!(not_finite.iter().all(|value| !Range::ANY.contains(*value)));
    }

    #[test]
    fn a_value_outside_of_a_range_is_not_rounded_into_it() {
        let shown = |value| Range::closed(0.0, 1.0).show_outside(value);
        assert_eq!([1.0 + 1e-15, 1.0 + 0.1 + 0.2].map(shown), ["1.000000000000001", "1.3"]);
    }

    #[test]
    fn a_value_in_another_unit_is_unusual_and_the_factor_is_named() {
        let youngs = Range::POSITIVE.usually(300.0, 1e7);
        assert_eq!([300.0, 2e4, 1e7].map(|value| youngs.unusual(value, "Pa")), [None, None, None]);
        let doubted = youngs.unusual(40.0, "Pa").expect("40 kPa");
        assert_eq!(doubted, "40 Pa is outside of the usual range 300..10000000 Pa; ×1000 would be inside");
        let percent = Range::above(0.0, 1.0).usually(0.002, 0.8).unusual(1.0, "").expect("1 %");
        assert_eq!(percent, "1 is outside of the usual range 0.002..0.8; ×0.01 would be inside");
        let far = Range::ANY.usually(-3.0, 3.0).unusual(-1e9, "m").expect("far");
        assert_eq!(far, "-1e9 m is outside of the usual range -3..3 m");
    }

    #[test]
    fn an_error_names_parameter_range_unit_and_value() {
        let message =
            |range: Range, unit| range.check("arm.kp", f64::NAN, unit).expect_err("no number").to_string();
        assert_eq!(message(Range::POSITIVE, "N/m"), "arm.kp: expected a number above 0 (N/m), got NaN");
        assert_eq!(message(Range::NOT_NEGATIVE, ""), "arm.kp: expected a number of 0 or more, got NaN");
        assert_eq!(
            message(Range::below(1e-9, 0.5), ""),
            "arm.kp: expected a number in 1e-9..below 0.5, got NaN"
        );
        assert_eq!(
            message(Range::between(None, Some(2.0)), ""),
            "arm.kp: expected a number of 2 or less, got NaN"
        );
    }
}
