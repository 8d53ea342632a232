//! Which line of a table constructor a key stands on: the machine only knows where the call began.

/// The line of the key that `path` leads to, in the table that opens on or after `line`; the last key found, or `line`.
pub(crate) fn line_of_key(text: &str, line: usize, path: &[String]) -> usize {
    let mut wanted = path.iter().filter(|key| !key.starts_with('[')).peekable();
    let (mut depth, mut found) = (0usize, line);
    for (offset, row) in text.lines().skip(line.saturating_sub(1)).enumerate() {
        let row = blank_strings(row);
        let mut at = 0;
        while at < row.len() {
            let rest = &row[at..];
            match rest.as_bytes()[0] {
                b'{' => depth += 1,
                b'}' if depth <= 1 => return found,
                b'}' => depth -= 1,
                _ => {}
            }
            let starts_word = !row[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
            if let Some(key) = wanted.peek()
                && depth > 0
                && starts_word
                && rest.strip_prefix(key.as_str()).is_some_and(is_assignment)
            {
                found = line + offset;
                wanted.next();
                if wanted.peek().is_none() {
                    return found;
                }
            }
            at += rest.chars().next().map_or(1, char::len_utf8);
        }
    }
    found
}

fn is_assignment(rest: &str) -> bool {
    let rest = rest.trim_start();
    rest.starts_with('=') && !rest.starts_with("==")
}

/// The row with its strings and its comment replaced by spaces, so that braces in them do not count.
fn blank_strings(row: &str) -> String {
    let mut out = String::with_capacity(row.len());
    let (mut quote, mut escaped) = (None, false);
    let mut chars = row.chars().peekable();
    while let Some(c) = chars.next() {
        match quote {
            Some(_) if escaped => escaped = false,
            Some(_) if c == '\\' => escaped = true,
            Some(q) if c == q => quote = None,
            Some(_) => {}
            None if c == '"' || c == '\'' => quote = Some(c),
            None if c == '-' && chars.peek() == Some(&'-') => break,
            None => {
                out.push(c);
                continue;
            }
        }
        out.push(' ');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nested_key_is_found_past_strings_and_comments() {
        let text =
            "local x = 1\nreturn f {\n  a = \"} b = 2\", -- } c = 3\n  b = {\n    c = 4,\n  },\n}\nc = 5\n";
        let path = |keys: &[&str]| keys.iter().map(|k| k.to_string()).collect::<Vec<_>>();
        assert_eq!(line_of_key(text, 2, &path(&["b", "c"])), 5);
        assert_eq!(line_of_key(text, 2, &path(&["a"])), 3);
        assert_eq!(line_of_key(text, 2, &path(&["missing"])), 2);
    }
}
