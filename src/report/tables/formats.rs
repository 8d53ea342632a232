//! Tables as Markdown and as LaTeX with booktabs. Names come from scripts and are escaped.

use softvt_common::table::{Heading, Table};

/// Longest cell, in characters, that stays on one line in LaTeX.
const MAX_ONE_LINE: usize = 44;

pub fn markdown(table: &Table) -> String {
    let row = |cells: &[String]| format!("| {} |\n", join(cells, escape_markdown, " | "));
    let rule = |column: &Heading| if column.is_number { " ---: |" } else { " --- |" };
    let rule: String = table.columns.iter().map(rule).collect();
    let body: String = table.rows.iter().map(|cells| row(cells)).collect();
    format!("{}\n\n{}|{rule}\n{body}\n", escape_markdown(&table.caption), row(&headings(table)))
}

pub fn latex(table: &Table) -> String {
    let row = |cells: &[String]| format!("    {} \\\\\n", join(cells, escape_latex, " & "));
    let columns: String = (0..table.columns.len()).map(|column| latex_column(table, column)).collect();
    let (caption, head) = (escape_latex(&table.caption), row(&headings(table)));
    let body: String = table.rows.iter().map(|cells| row(cells)).collect();
    format!(
        "\\begin{{table*}}\n  \\centering\n  \\footnotesize\n  \\caption{{{caption}}}\n  \
         \\begin{{tabular}}{{{columns}}}\n    \\toprule\n{head}    \\midrule\n{body}    \\bottomrule\n  \
         \\end{{tabular}}\n\\end{{table*}}\n"
    )
}

fn headings(table: &Table) -> Vec<String> {
    table.columns.iter().map(|column| column.text.clone()).collect()
}

/// Column type; columns of long texts wrap.
fn latex_column(table: &Table, column: usize) -> &'static str {
    let is_long = table.rows.iter().any(|row| row[column].chars().count() > MAX_ONE_LINE);
    match (table.columns[column].is_number, is_long) {
        (true, _) => "r",
        (false, true) => "p{0.28\\textwidth}",
        (false, false) => "l",
    }
}

fn join(cells: &[String], escape: fn(&str) -> String, separator: &str) -> String {
    cells.iter().map(|cell| escape(cell)).collect::<Vec<_>>().join(separator)
}

pub(crate) fn escape_markdown(text: &str) -> String {
    let letters: Vec<char> = text.chars().collect();
    let mut out = String::with_capacity(text.len());
    for (i, &c) in letters.iter().enumerate() {
        // Within a word an underscore is not emphasis.
        let is_word =
            |at: Option<usize>| at.and_then(|at| letters.get(at)).is_some_and(|c| c.is_alphanumeric());
        match c {
            '_' if is_word(i.checked_sub(1)) && is_word(Some(i + 1)) => out.push(c),
            '\\' | '|' | '`' | '*' | '_' | '~' | '$' | '#' => out.extend(['\\', c]),
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '&' => out += "&amp;",
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    // Brackets around intervals are links only if a parenthesis follows.
    out.replace("](", "]\\(")
}

fn escape_latex(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    // After the end of a row, a bracket would be read as a length.
    if text.starts_with(['[', '*']) {
        out += "{}";
    }
    for c in text.chars() {
        match c {
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => out.extend(['\\', c]),
            '\\' => out += "\\textbackslash{}",
            '~' => out += "\\textasciitilde{}",
            '^' => out += "\\textasciicircum{}",
            '<' => out += "\\textless{}",
            '>' => out += "\\textgreater{}",
            '|' => out += "\\textbar{}",
            'τ' => out += "$\\tau$",
            'κ' => out += "$\\kappa$",
            'π' => out += "$\\pi$",
            '≤' => out += "$\\leq$",
            '≥' => out += "$\\geq$",
            '→' => out += "$\\rightarrow$",
            '×' => out += "$\\times$",
            '·' => out += "$\\cdot$",
            '−' => out += "$-$",
            '–' => out += "--",
            '…' => out += "\\ldots{}",
            '∞' => out += "$\\infty$",
            c if c.is_control() => out.push(' '),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use softvt_common::table::Column;

    use super::*;

    /// Names that would break out of a table or a page.
    const HOSTILE: [&str; 9] = [
        "a_b | c & \\z",
        "<script>alert('x')</script>",
        "100 % $x^2$ #1 ~ {unbalanced \\end{tabular}",
        "[4pt] *starred* `code`",
        "![x](http://x.example/y.png)",
        "two\nlines\tand \u{7} more",
        "\\\\[9cm] \\input{/etc/passwd}",
        "}}}{{",
        "τ ≤ κ · D – … „ü“",
    ];

    fn hostile() -> Table {
        let long = "x".repeat(400);
        let names: Vec<&str> = HOSTILE.into_iter().chain([&long[..]]).collect();
        let columns = [
            Column::text("a_b", |name: &&str| (*name).to_owned()),
            Column::text("%", |name: &&str| (*name).to_owned()),
            Column::number("n", |_| "1.0 [0.0, 2.0]".to_owned()),
        ];
        Table::new(&names, columns).with_caption(HOSTILE.join(" "))
    }

    /// Depth of braces at the end of a LaTeX line, and its number of `&`. Panics at unescaped special characters.
    fn read_latex(line: &str) -> (i32, usize) {
        let (mut depth, mut parts, mut math) = (0, 0, false);
        let mut letters = line.chars().peekable();
        while let Some(c) = letters.next() {
            match c {
                '\\' => {
                    let next = letters.peek().copied().unwrap_or(' ');
                    if next.is_alphabetic() {
                        let mut name = String::new();
                        while let Some(c) = letters.next_if(|c| c.is_alphabetic()) {
                            name.push(c);
                        }
                        let known = "textbackslash textasciitilde textasciicircum textless textgreater textbar ldots tau kappa pi leq geq rightarrow times cdot \
                                     infty begin end centering footnotesize caption toprule midrule bottomrule textwidth";
                        assert!(known.split_whitespace().any(|k| k == name), "\\{name} in {line}");
                    } else {
                        letters.next();
                    }
                }
                '{' => depth += 1,
                '}' => depth -= 1,
                '$' => math = !math,
                '&' => parts += 1,
                '%' | '#' | '_' | '^' | '~' => panic!("a bare {c} in {line}"),
                _ => {}
            }
            assert!(depth >= 0, "a brace too many in {line}");
        }
        assert!(!math, "a formula without an end in {line}");
        (depth, parts)
    }

    #[test]
    fn hostile_names_are_escaped_in_latex() {
        let text = latex(&hostile());
        assert_eq!(text.matches("\\begin{").count(), 2);
        assert_eq!(text.matches("\\end{").count(), 2);
        let mut rows = 0;
        for line in text.lines() {
            let (depth, parts) = read_latex(line);
            assert_eq!(depth, 0, "{line}");
            if line.ends_with(" \\\\") {
                rows += 1;
                assert_eq!(parts, 2, "{line}");
                assert!(!line.trim_start().starts_with(['[', '*']), "a length: {line}");
            }
        }
        assert_eq!(rows, 1 + HOSTILE.len() + 1);
        assert!(text.contains("a\\_b \\textbar{} c \\& \\textbackslash{}z & "), "{text}");
        assert!(text.contains("{p{0.28\\textwidth}p{0.28\\textwidth}r}"), "{text}");
        assert!(text.contains("$\\tau$ $\\leq$ $\\kappa$ $\\cdot$ D -- \\ldots{}"), "{text}");
    }

    #[test]
    fn hostile_names_are_escaped_in_markdown() {
        let text = markdown(&hostile());
        let rows: Vec<&str> = text.lines().filter(|line| line.starts_with("| ")).collect();
        assert_eq!(rows.len(), 2 + HOSTILE.len() + 1);
        for row in rows {
            let bars = row.char_indices().filter(|(i, c)| *c == '|' && !row[..*i].ends_with('\\')).count();
            assert_eq!(bars, 4, "{row}");
            assert!(!row.contains('<') && !row.contains("]("), "{row}");
        }
        assert!(text.contains("| a_b \\| c &amp; \\\\z |"), "{text}");
        assert!(text.contains("1.0 [0.0, 2.0] |"), "{text}");
    }
}
