//! Formatting of numbers and text in messages.

use std::borrow::Cow;

/// Formats a number in decimal, or in scientific notation if it is below 1e-6 or at least 1e9 in magnitude.
pub fn format_number(x: f64) -> String {
    let plain = x == 0.0 || !x.is_finite() || (1e-6..1e9).contains(&x.abs());
    if plain { x.to_string() } else { format!("{x:e}") }
}

/// Escapes control characters other than newlines and tabs, so that untrusted text cannot control a terminal.
pub fn escape_control(text: &str) -> Cow<'_, str> {
    let harmful = |c: char| c.is_control() && c != '\n' && c != '\t';
    if !text.contains(harmful) {
        return Cow::Borrowed(text);
    }
    let escaped =
        text.chars().map(|c| if harmful(c) { c.escape_default().to_string() } else { c.to_string() });
    Cow::Owned(escaped.collect())
}

/// Writes a line to standard error. Ignores write errors, so that a closed pipe does not end a run.
pub fn eprint_line(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_short() {
        let shown = [0.0, -1.0, 0.25, 1234567.5, 1e300, -1e-9, f64::INFINITY].map(format_number);
        assert_eq!(shown, ["0", "-1", "0.25", "1234567.5", "1e300", "-1e-9", "inf"]);
    }

    #[test]
    fn control_characters_are_shown() {
        assert_eq!(escape_control("a\u{1b}[2J\rb\tc\nd"), "a\\u{1b}[2J\\rb\tc\nd");
        assert!(matches!(escape_control("µ = 0.5"), Cow::Borrowed(_)));
    }
}
