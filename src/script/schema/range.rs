//! Which numbers a field takes.

/// Bounds of a number; an end may be excluded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Lowest value.
    pub min: f64,
    /// Highest value.
    pub max: f64,
    /// Whether `min` itself is refused.
    pub above_min: bool,
    /// Whether `max` itself is refused.
    pub below_max: bool,
}

impl Range {
    /// Any finite number.
    pub const ANY: Self =
        Self { min: f64::NEG_INFINITY, max: f64::INFINITY, above_min: false, below_max: false };
    /// Greater than zero.
    pub const POSITIVE: Self = Self { min: 0.0, above_min: true, ..Self::ANY };
    /// Zero or greater.
    pub const NOT_NEGATIVE: Self = Self { min: 0.0, ..Self::ANY };

    /// From `min` to `max`, both allowed.
    pub const fn closed(min: f64, max: f64) -> Self {
        Self { min, max, above_min: false, below_max: false }
    }

    /// From `min` (allowed) to `max` (refused).
    pub const fn below(min: f64, max: f64) -> Self {
        Self { min, max, above_min: false, below_max: true }
    }

    /// Whether `value` is allowed; never for NaN or an infinity.
    pub fn holds(&self, value: f64) -> bool {
        let low = if self.above_min { value > self.min } else { value >= self.min };
        let high = if self.below_max { value < self.max } else { value <= self.max };
        value.is_finite() && low && high
    }

    /// ` in 0..10`, ` above 0`, …; empty for any number.
    pub fn words(&self) -> String {
        match (self.min.is_finite(), self.max.is_finite()) {
            (false, false) => String::new(),
            (true, false) if self.above_min => format!(" above {}", self.min),
            (true, false) => format!(" of {} or more", self.min),
            (false, true) => format!(" of {} or less", self.max),
            (true, true) => {
                let low = if self.above_min { "above " } else { "" };
                let high = if self.below_max { "below " } else { "" };
                format!(" in {low}{}..{high}{}", self.min, self.max)
            }
        }
    }
}
