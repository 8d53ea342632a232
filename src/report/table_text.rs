//! Tables as markdown and as LaTeX with booktabs. Names come from scripts, and must not break out of their cells.

use std::fmt::Write;

use super::tables::Table;

/// Letters of the longest cell that stays on one line in LaTeX.
const ONE_LINE: usize = 44;

impl Table {
    /// As a table of markdown.
    pub fn markdown(&self) -> String {
        let row = |cells: &[String]| {
            format!("| {} |\n", cells.iter().map(|cell| markdown(cell)).collect::<Vec<_>>().join(" | "))
        };
        let rule: Vec<&str> =
            (0..self.head.len()).map(|i| if i < self.texts { "---" } else { "---:" }).collect();
        let body: String = self.rows.iter().map(|cells| row(cells)).collect();
        format!("{}\n\n{}| {} |\n{body}\n", markdown(&self.caption), row(&self.head), rule.join(" | "))
    }

    /// As a table of LaTeX with booktabs.
    pub fn latex(&self) -> String {
        let row = |cells: &[String]| {
            format!("    {} \\\\\n", cells.iter().map(|cell| latex(cell)).collect::<Vec<_>>().join(" & "))
        };
        let columns: String = (0..self.head.len()).map(|column| self.latex_column(column)).collect();
        let mut out = String::new();
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "\\begin{{table*}}\n  \\centering\n  \\footnotesize\n  \\caption{{{}}}",
            latex(&self.caption)
        );
        let _ = writeln!(out, "  \\begin{{tabular}}{{{columns}}}\n    \\toprule");
        out += &row(&self.head);
        out += "    \\midrule\n";
        out.extend(self.rows.iter().map(|cells| row(cells)));
        out += "    \\bottomrule\n  \\end{tabular}\n\\end{table*}\n";
        out
    }

    /// Long texts are broken into lines.
    fn latex_column(&self, column: usize) -> &'static str {
        let long = self.rows.iter().any(|row| row[column].chars().count() > ONE_LINE);
        match (column < self.texts, long) {
            (true, true) => "p{0.28\\textwidth}",
            (true, false) => "l",
            _ => "r",
        }
    }
}

/// Text for markdown.
fn markdown(text: &str) -> String {
    let letters: Vec<char> = text.chars().collect();
    let mut out = String::with_capacity(text.len());
    for (i, &c) in letters.iter().enumerate() {
        // Inside of a word an underscore is no emphasis.
        let beside =
            |at: Option<usize>| at.and_then(|at| letters.get(at)).is_some_and(|c| c.is_alphanumeric());
        match c {
            '_' if beside(i.checked_sub(1)) && beside(Some(i + 1)) => out.push(c),
            '\\' | '|' | '`' | '*' | '_' | '~' | '$' | '#' => out.extend(['\\', c]),
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '&' => out += "&amp;",
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    // Brackets are those of intervals; only with an address behind them would they be a link.
    out.replace("](", "]\\(")
}

/// Text for LaTeX.
fn latex(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    // Behind the end of a row a bracket would be a length.
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
            '–' => out += "--",
            '…' => out += "\\ldots{}",
            c if c.is_control() => out.push(' '),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
#[path = "table_text_tests.rs"]
mod tests;
