//! Text in messages and tables: numbers, control characters, and suggestions for misspelt names.

use std::borrow::Cow;

/// Longest prompt, name or other short text of a script, bytes. Plans copy texts, which scripts may share.
pub const MAX_TEXT_BYTES: usize = 4096;

/// Names of the axes of a frame, by index.
pub const AXIS_NAMES: [&str; 3] = ["x", "y", "z"];

/// Formats a number for a message, in decimal, or in scientific notation if it is below 1e-6 or at least 1e9 in
/// magnitude. A number with more than nine digits is a computed one: six of them are kept.
pub fn format_number(x: f64) -> String {
    const WRITTEN_DIGITS: usize = 9;
    let exact = exact_number(x);
    let mantissa = exact.split('e').next().unwrap_or_default();
    let digits = mantissa.trim_start_matches(['-', '0', '.']).chars().filter(char::is_ascii_digit).count();
    if digits > WRITTEN_DIGITS { significant(x, 6) } else { exact }
}

/// Formats a number with all of its digits, as records keep it; the notation is that of [`format_number`].
pub fn exact_number(x: f64) -> String {
    let plain = x == 0.0 || !x.is_finite() || (1e-6..1e9).contains(&x.abs());
    if plain { x.to_string() } else { format!("{x:e}") }
}

/// Formats a number with at most `digits` significant digits and without trailing zeros: 4/3 as 1.33.
pub fn significant(x: f64, digits: usize) -> String {
    if x == 0.0 || !x.is_finite() {
        return exact_number(x);
    }
    let scale = 10f64.powi(digits as i32 - 1 - x.abs().log10().floor() as i32);
    // A division by a power of ten gives the nearest number; a product need not.
    let rounded =
        if scale >= 1.0 { (x * scale).round() / scale } else { (x * scale).round() * (1.0 / scale) };
    exact_number(if rounded.is_finite() { rounded } else { x })
}

/// True for control characters, also those that change the direction of a text (Unicode's property `Bidi_Control`).
pub fn is_control(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Escapes control characters other than newlines and tabs, so that untrusted text cannot control a terminal.
pub fn escape_control(text: &str) -> Cow<'_, str> {
    let harmful = |c: char| is_control(c) && c != '\n' && c != '\t';
    if !text.contains(harmful) {
        return Cow::Borrowed(text);
    }
    let escaped =
        text.chars().map(|c| if harmful(c) { c.escape_default().to_string() } else { c.to_string() });
    Cow::Owned(escaped.collect())
}

/// A text as a field of a CSV file: in quotation marks where it has to be (RFC 4180, one rule), and after an apostrophe
/// where a spreadsheet would take it for a formula.
pub fn csv_field(text: &str) -> String {
    let apostrophe = if text.starts_with(['=', '+', '-', '@', '\t', '\r']) { "'" } else { "" };
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{apostrophe}{}\"", text.replace('"', "\"\"")),
        false => format!("{apostrophe}{text}"),
    }
}

/// Writes a line to standard error. Ignores write errors, so that a closed pipe does not end a run.
pub fn eprint_line(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

/// The candidate that `word` most likely misspells or abbreviates, if any is close.
///
/// A candidate is close if it differs by at most one edit per three letters (Damerau–Levenshtein distance), or if one
/// word starts with the other. The two parts of a dotted name (`chest.top_drawer`) are compared separately. A word
/// without a dot is also compared with the part after the dot.
pub fn suggest<'a>(word: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let ranked = candidates.filter_map(|candidate| Some((rank_of_name(word, candidate)?, candidate)));
    ranked.min_by_key(|(rank, _)| *rank).map(|(_, candidate)| candidate)
}

/// True if one or two edits turn a word into another (Damerau–Levenshtein distance), as where one is misspelt.
pub fn is_misspelt(word: &str, meant: &str) -> bool {
    (1..=2).contains(&strsim::damerau_levenshtein(word, meant))
}

/// A message about an unknown name: `unknown key "promt"; did you mean "prompt"?`.
pub fn unknown_name<'a>(
    what: &str,
    word: &str,
    known: impl IntoIterator<Item = &'a str, IntoIter: Clone>,
) -> String {
    let known = known.into_iter();
    match suggest(word, known.clone()) {
        Some(close) => format!("unknown {what} {word:?}; did you mean {close:?}?"),
        None if known.clone().next().is_none() => format!("unknown {what} {word:?}; there is none"),
        None => format!("unknown {what} {word:?}; there are {}", known.collect::<Vec<_>>().join(", ")),
    }
}

/// Rank of a candidate; the best candidate has the smallest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Rank {
    difference: Difference,
    edits: usize,
    length: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Difference {
    Misspelt,
    Abbreviated,
    Extended,
}

fn rank_of_name(word: &str, candidate: &str) -> Option<Rank> {
    match (word.split_once('.'), candidate.split_once('.')) {
        (Some((object, part)), Some((known_object, known_part))) => {
            let both = rank_of_word(object, known_object).zip(rank_of_word(part, known_part));
            let of_parts = both.map(|(a, b)| Rank {
                difference: a.difference.max(b.difference),
                edits: a.edits + b.edits,
                length: candidate.len(),
            });
            // A correct object outweighs a part that matches nothing on its own.
            of_parts.or_else(|| rank_of_word(word, candidate))
        }
        (None, Some((_, known_part))) => {
            rank_of_word(word, candidate).or_else(|| rank_of_word(word, known_part))
        }
        _ => rank_of_word(word, candidate),
    }
}

fn rank_of_word(word: &str, candidate: &str) -> Option<Rank> {
    let edits = strsim::damerau_levenshtein(word, candidate);
    let allowed = (word.chars().count() / 3).max(1);
    let difference = if edits <= allowed {
        Difference::Misspelt
    } else if word.len() > 2 && candidate.starts_with(word) {
        Difference::Abbreviated
    } else if candidate.len() > 2 && word.starts_with(candidate) {
        Difference::Extended
    } else {
        return None;
    };
    Some(Rank { difference, edits, length: candidate.len() })
}

pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Formats a count with its noun: "1 task", "3 tasks".
pub fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Formats a number with a fixed number of decimals; a dash for `None`.
pub fn decimal(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
}

/// Puts `text` on one line of at most `width` characters. An ellipsis marks what is cut off.
pub fn shortened(text: &str, width: usize) -> String {
    let text = text.replace('\n', " ");
    if text.chars().count() <= width {
        return text;
    }
    text.chars().take(width.saturating_sub(1)).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_short() {
        let shown = [0.0, -1.0, 0.25, 1234567.5, 1e300, -1e-9, f64::INFINITY].map(format_number);
        assert_eq!(shown, ["0", "-1", "0.25", "1234567.5", "1e300", "-1e-9", "inf"]);
        let computed = [0.1 + 0.2, -1.0 / 3.0, 2.0 / 3.0 * 1e12, std::f64::consts::PI, 0.1234567];
        let shown = computed.map(format_number);
        assert_eq!(shown, ["0.3", "-0.333333", "6.66667e11", "3.14159", "0.1234567"]);
        assert_eq!(exact_number(0.1 + 0.2), "0.30000000000000004");
    }

    #[test]
    fn significant_digits_are_rounded_and_not_padded() {
        let shown = [4.0 / 3.0, 0.1 + 0.2, 2.0, 1234.5, 0.0, -0.0066667].map(|x| significant(x, 3));
        assert_eq!(shown, ["1.33", "0.3", "2", "1230", "0", "-0.00667"]);
    }

    #[test]
    fn control_characters_are_shown() {
        assert_eq!(escape_control("a\u{1b}[2J\rb\tc\nd"), "a\\u{1b}[2J\\rb\tc\nd");
        assert_eq!(escape_control("a\u{202e}b"), "a\\u{202e}b");
        assert!(matches!(escape_control("µ = 0.5"), Cow::Borrowed(_)));
    }

    #[test]
    fn a_field_of_a_table_is_no_formula() {
        let fields = ["a", "a,\"b\"", "=cmd|' /C calc'!A0", "+1", "-1", "@x", "=\"a\"", ""].map(csv_field);
        let expected =
            ["a", "\"a,\"\"b\"\"\"", "'=cmd|' /C calc'!A0", "'+1", "'-1", "'@x", "\"'=\"\"a\"\"\"", ""];
        assert_eq!(fields, expected);
    }

    #[test]
    fn suggestions_cover_misspelt_abbreviated_and_partial_names() {
        let known = ["c", "lid", "c.top_drawer", "c.middle_drawer", "chest.top_drawer"];
        for (word, meant) in [
            ("c.top", Some("c.top_drawer")),
            ("c.topdrawer", Some("c.top_drawer")),
            ("chset.top", Some("chest.top_drawer")),
            ("middle_drawer", Some("c.middle_drawer")),
            ("lidd", Some("lid")),
            ("lids", Some("lid")),
            ("c.handle", None),
            ("xyz", None),
        ] {
            assert_eq!(suggest(word, known.into_iter()), meant, "{word}");
        }
    }
}
