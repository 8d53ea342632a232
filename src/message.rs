//! How numbers and names look in messages: short, and in one line.

use std::borrow::Cow;

/// A number as people read it: powers of ten where it is huge or tiny, so that it never fills lines with zeros.
pub fn number(x: f64) -> String {
    let plain = x == 0.0 || !x.is_finite() || (1e-6..1e9).contains(&x.abs());
    if plain { x.to_string() } else { format!("{x:e}") }
}

/// Text for a terminal: control characters are shown instead of obeyed, all but line ends and tabs.
pub fn plain(text: &str) -> Cow<'_, str> {
    let harmful = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !text.contains(harmful) {
        return Cow::Borrowed(text);
    }
    let escaped =
        text.chars().map(|c| if harmful(c) { c.escape_default().to_string() } else { c.to_string() });
    Cow::Owned(escaped.collect())
}

/// Writes a line to the standard error. Nobody may be reading there: that ends no run.
pub fn tell(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_short() {
        let shown = [0.0, -1.0, 0.25, 1234567.5, 1e300, -1e-9, f64::INFINITY].map(number);
        assert_eq!(shown, ["0", "-1", "0.25", "1234567.5", "1e300", "-1e-9", "inf"]);
    }

    #[test]
    fn control_characters_are_shown() {
        assert_eq!(plain("a\u{1b}[2J\rb\tc\nd"), "a\\u{1b}[2J\\rb\tc\nd");
        assert!(matches!(plain("µ = 0.5"), Cow::Borrowed(_)));
    }
}
