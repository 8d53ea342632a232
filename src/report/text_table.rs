//! Lines of plain-text tables.

/// Width of comparison tables, columns.
pub(super) const WIDTH: usize = 99;

/// `text` on one line of at most `width` characters.
pub(super) fn shortened(text: &str, width: usize) -> String {
    let text = text.replace('\n', " ");
    if text.chars().count() <= width {
        return text;
    }
    text.chars().take(width.saturating_sub(1)).chain(['…']).collect()
}

/// Appends `text` and a line break, without trailing spaces.
pub(super) fn push_line(out: &mut String, text: &str) {
    out.push_str(text.trim_end());
    out.push('\n');
}

/// Appends a horizontal rule.
pub(super) fn push_rule(out: &mut String, width: usize) {
    push_line(out, &"─".repeat(width));
}
