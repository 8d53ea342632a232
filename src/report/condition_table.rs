//! Results of a suite under several conditions: the rows of `conditions.json`, and their plain-text table.

use std::fmt::Write;

use serde::{Deserialize, Serialize};

use super::{
    comparison::{DeformationComparison, LEGEND, headings, measure_rows},
    text_table::{WIDTH, push_line, push_rule, shortened},
};
use crate::{
    evaluation::{
        paired_stats::{PairedComparison, d_over_tau, pair_episodes},
        record::EpisodeRecord,
        statistics::{Distribution, Rate},
        summary::Scores,
    },
    text::counted,
};

/// Width of a condition's name, columns.
const NAME_WIDTH: usize = 40;

/// Results under one condition.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConditionOutcome {
    /// Its run folder, relative to that of all conditions.
    pub folder: String,
    pub episodes: usize,
    pub invalid: usize,
    pub goal_success_rate: Rate,
    pub no_drop_rate: Rate,
    pub safety_success_rate: Rate,
    /// Peak D divided by τ, of valid episodes that have both.
    pub d_over_tau: Distribution,
    /// Paired comparison with the reference; null for the reference itself.
    pub paired: Option<PairedComparison>,
}

impl ConditionOutcome {
    /// Results of `records`, compared with those of the reference.
    pub fn new(folder: String, records: &[EpisodeRecord], reference: Option<&[EpisodeRecord]>) -> Self {
        let scores = Scores::of(&records.iter().collect::<Vec<_>>());
        Self {
            folder,
            episodes: scores.episodes,
            invalid: scores.invalid,
            goal_success_rate: scores.goal_success_rate,
            no_drop_rate: scores.no_drop_rate,
            safety_success_rate: scores.safety_success_rate,
            d_over_tau: Distribution::of(records.iter().filter_map(d_over_tau).collect()),
            paired: reference.map(|reference| PairedComparison::of(&pair_episodes(reference, records))),
        }
    }
}

/// One condition of a suite.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConditionRow {
    pub condition: String,
    pub shift: Vec<(String, f64)>,
    pub set: Vec<(String, String)>,
    /// Null if the condition could have no effect and was not run.
    pub outcome: Option<ConditionOutcome>,
    /// Reason for not running it; null if it was run.
    pub not_applicable: Option<String>,
}

/// A suite under all conditions, the reference first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConditionTable {
    pub suite: String,
    /// Policy name with its privileged inputs.
    pub policy: String,
    /// True if targets deform, so that D/τ is defined.
    pub deformable: bool,
    pub rows: Vec<ConditionRow>,
}

/// Plain-text tables of at most 100 columns: rates per condition, and paired change from the reference.
pub fn table(suite: &ConditionTable) -> String {
    let mut out = String::new();
    let conditions = suite.rows.len().saturating_sub(1);
    let episodes = suite.rows.iter().find_map(|row| row.outcome.as_ref()).map_or(0, |o| o.episodes);
    push_line(
        &mut out,
        &format!(
            "{} · policy {} · {} · {} each",
            suite.suite,
            suite.policy,
            counted(conditions, "condition"),
            counted(episodes, "episode")
        ),
    );
    push_rule(&mut out, WIDTH);
    let columns = ["Goal, %", "NoDrop, %", "Safety, %", "D peak/τ", "invalid"];
    push_line(&mut out, &cells("condition", columns.map(str::to_owned)));
    push_rule(&mut out, WIDTH);
    for row in &suite.rows {
        push_line(&mut out, &row_text(row, suite.deformable));
    }
    push_rule(&mut out, WIDTH);
    for row in &suite.rows {
        if let Some(why) = &row.not_applicable {
            push_line(&mut out, &format!("{}: N/A, {why}", row.condition));
        }
    }
    against_reference(&mut out, suite);
    out
}

fn against_reference(out: &mut String, suite: &ConditionTable) {
    let deformation =
        if suite.deformable { DeformationComparison::OverTau } else { DeformationComparison::None };
    push_line(out, &headings("change from the reference", ["ref.", "cond."]));
    push_rule(out, WIDTH);
    for row in &suite.rows {
        let paired = row.outcome.as_ref().and_then(|outcome| outcome.paired.as_ref());
        for text in paired.map(|paired| measure_rows(&row.condition, paired, deformation)).unwrap_or_default()
        {
            push_line(out, &text);
        }
    }
    push_rule(out, WIDTH);
    push_line(out, LEGEND);
}

fn row_text(row: &ConditionRow, deformable: bool) -> String {
    let Some(outcome) = &row.outcome else {
        return cells(&row.condition, std::array::from_fn(|_| "N/A".to_owned()));
    };
    let percent = |rate: &Rate| rate.rate.map_or_else(|| "–".to_owned(), |rate| format!("{rate:.1}"));
    let absent = if deformable { "–" } else { "N/A" };
    let ratio = outcome.d_over_tau.mean.map_or_else(|| absent.to_owned(), |mean| format!("{mean:.3}"));
    cells(
        &row.condition,
        [
            percent(&outcome.goal_success_rate),
            percent(&outcome.no_drop_rate),
            percent(&outcome.safety_success_rate),
            ratio,
            outcome.invalid.to_string(),
        ],
    )
}

fn cells(name: &str, cells: [String; 5]) -> String {
    let mut text = format!("{:<NAME_WIDTH$}", shortened(name, NAME_WIDTH));
    for cell in cells {
        // Writing to a String cannot fail.
        let _ = write!(text, "{cell:>11}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::record::tests::sample;

    fn row(condition: &str, outcome: Option<ConditionOutcome>) -> ConditionRow {
        let not_applicable = outcome.is_none().then(|| "nothing in it deforms".to_owned());
        ConditionRow {
            condition: condition.into(),
            shift: Vec::new(),
            set: Vec::new(),
            outcome,
            not_applicable,
        }
    }

    #[test]
    fn the_table_has_one_row_per_condition_and_at_most_100_columns() {
        let reference = [sample()];
        let mut worse = sample();
        (worse.verdict.safety, worse.verdict.d_peak) = (false, Some(1.5));
        let suite = ConditionTable {
            suite: "buns".into(),
            policy: "expert".into(),
            deformable: true,
            rows: vec![
                row("reference", Some(ConditionOutcome::new("reference".into(), &reference, None))),
                row("heavy", Some(ConditionOutcome::new("heavy".into(), &[worse], Some(&reference)))),
                row("a condition with a name that is very long", None),
            ],
        };
        let text = table(&suite);
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
        let words = |start: &str| -> Vec<&str> {
            text.lines().find(|line| line.starts_with(start)).unwrap().split_whitespace().collect()
        };
        assert_eq!(words("reference"), ["reference", "100.0", "100.0", "100.0", "0.333", "0"]);
        assert_eq!(words("heavy  "), ["heavy", "100.0", "100.0", "0.0", "1.500", "0"]);
        let (_, against) = text.split_once("change from the reference").unwrap();
        let rows: Vec<&str> = against.lines().skip_while(|line| !line.starts_with("heavy")).take(4).collect();
        let cell = |row: usize, columns: &[&str]| {
            assert!(columns.iter().all(|cell| rows[row].contains(cell)), "{columns:?} in {}", rows[row]);
        };
        cell(0, &["heavy", "Goal, %", "100.0   100.0", "+0.0 ", " 0     0 "]);
        cell(2, &["Safety, %", "100.0     0.0", "-100.0", " 0     1 ", "1.000"]);
        cell(3, &["D peak/τ", "0.33    1.50", "+1.17", " 0     1"]);
        assert!(
            text.contains("a condition with a name that is very lo…")
                && text.contains(": N/A, nothing in it deforms")
        );
    }
}
