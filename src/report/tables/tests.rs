use super::*;
use crate::run_summary::{summarize_runs, tests::stored};
use crate::sample_record;
use softvt_evaluation::{stage::TaskStage, verdict::TargetVerdict};

#[test]
fn rigid_suites_have_no_safety_and_privileged_policies_are_marked_in_every_table() {
    let mut rigid = sample_record();
    rigid.header.id.suite = "rigid".into();
    rigid.verdict.targets = vec![TargetVerdict::default()];
    let runs = summarize_runs(vec![
        stored("a", "expert", vec![sample_record()]),
        stored("b", "expert", vec![rigid]),
    ]);
    let all = all_tables(&runs);
    assert_eq!(all.len(), 8);
    for table in &all {
        let marked = |text: &String| text.contains("expert (privileged)");
        assert!(marked(&table.caption) || table.rows.iter().all(|row| row.iter().any(marked)), "{table:?}");
        assert!(table.rows.iter().all(|row| row.len() == table.head.len()));
    }
    let [rigid, soft] = &all[0].rows[..] else { panic!("two rows") };
    assert_eq!((&rigid[5][..], &rigid[6][..]), ("N/A", "N/A"));
    assert_eq!((&soft[5][..], &soft[6][..]), ("100.0 [20.7, 100.0]", "0.0"));
    assert_eq!(
        all[1].rows,
        [strings([
            "suite",
            "expert (privileged)",
            "0.33",
            "0.33",
            "0.33",
            "0.33",
            "1",
            "0",
            "–",
            "–",
            "–",
            "–"
        ])]
    );
    let crushed = ["suite", "expert (privileged)", "1.25", "1.25", "1.25", "0.50", "0.50", "0.50", "1"];
    assert_eq!(all[2].rows, [strings(crushed)]);
}

#[test]
fn a_run_in_progress_shows_its_episode_count() {
    let mut run = stored("a", "noop", vec![sample_record()]);
    run.manifest.episodes = 20;
    let table = main_table(&summarize_runs(vec![run]));
    assert_eq!(table.rows[0][2], "1 of 20");
}

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

fn hostile() -> ResultTable {
    let long = "x".repeat(400);
    let rows =
        HOSTILE.iter().chain([&&long[..]]).map(|name| strings([name, name, "1.0 [0.0, 2.0]"])).collect();
    ResultTable { caption: HOSTILE.join(" "), head: strings(["a_b", "%", "n"]), rows }
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
    let text = hostile().latex();
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
    let text = hostile().markdown();
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

#[test]
fn harm_and_stages_have_a_table() {
    let mut record = sample_record();
    (record.verdict.others_ok, record.verdict.failed_stage) = (Some(false), Some(TaskStage::Carry));
    (record.verdict.object_mut().d_mean, record.verdict.object_mut().time_over_tau_s) =
        (Some(0.2), Some(0.25));
    let runs = summarize_runs(vec![stored("a", "pi", vec![record])]);
    let table = stage_table(&runs).expect("recorded");
    assert_eq!(
        table.rows[0][2..],
        strings(["0", "0.0 [0.0, 79.3]", "0.0 [0.0, 79.3]", "0.0 [0.0, 79.3]", "0", "0", "0", "1", "0", "0"])
    );
    let deformation = deformation_table(&runs).expect("soft");
    assert_eq!(deformation.rows[0][8..], strings(["0.20", "–", "–", "0.25"]));
    assert_eq!(bootstrap_table(&runs), None, "one episode");
}
