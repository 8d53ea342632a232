//! A suite under conditions: the rows of `conditions.json`, and the table of them against the reference.

use std::fmt::Write;

use serde::{Deserialize, Serialize};

use crate::evaluation::{
    paired::{Change, Paired, d_over_tau},
    record::EpisodeRecord,
    statistics::{Distribution, Rate},
    summary::Scores,
};

/// Columns of a condition's name.
const NAME: usize = 20;
/// Columns of the whole table.
const WIDTH: usize = 98;

/// What a run of one condition came to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Its run folder, from the folder of all.
    pub folder: String,
    /// Episodes.
    pub episodes: usize,
    /// Those that were invalid.
    pub invalid: usize,
    /// Goal Success.
    pub goal_success_rate: Rate,
    /// NoDrop.
    pub no_drop_rate: Rate,
    /// Safety Success.
    pub safety_success_rate: Rate,
    /// Peak D over τ of valid episodes that have both.
    pub d_over_tau: Distribution,
    /// Against the reference; null for the reference itself.
    pub paired: Option<Paired>,
}

impl Outcome {
    /// Of the episodes of a run, against those of its reference.
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
            paired: reference.map(|reference| Paired::of(reference, records)),
        }
    }
}

/// One row: a condition of one suite.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Its name.
    pub condition: String,
    /// Its shifts.
    pub shift: Vec<(String, f64)>,
    /// Its settings.
    pub set: Vec<(String, String)>,
    /// What came of it; null where it could change nothing and was not run.
    pub outcome: Option<Outcome>,
    /// Why it was not run; null where it was.
    pub not_applicable: Option<String>,
}

/// One suite under all conditions, the reference first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rows {
    /// Suite name.
    pub suite: String,
    /// Policy name.
    pub policy: String,
    /// Whether targets deform, so that D/τ says something.
    pub deformable: bool,
    /// The rows.
    pub rows: Vec<Row>,
}

/// The table of a suite, in plain text of at most 100 columns.
pub fn table(suite: &Rows) -> String {
    let mut out = String::new();
    let conditions = suite.rows.len().saturating_sub(1);
    let episodes = suite.rows.iter().find_map(|row| row.outcome.as_ref()).map_or(0, |o| o.episodes);
    line(
        &mut out,
        &format!(
            "{} · policy {} · {conditions} conditions against the reference · {episodes} episodes a condition",
            suite.suite, suite.policy
        ),
    );
    rule(&mut out);
    let heading =
        ["Goal", "NoDrop", "Safety", "D/τ", "inval.", "Goal +/-", "NoDrop +/-", "Safety +/-", "Δ D/τ +/-"];
    line(&mut out, &cells("condition", heading.map(str::to_owned)));
    rule(&mut out);
    for row in &suite.rows {
        line(&mut out, &row_text(row, suite.deformable));
    }
    rule(&mut out);
    line(&mut out, "+/-: episodes better / worse than the same one of the reference; of D/τ, less is better");
    for row in &suite.rows {
        if let Some(why) = &row.not_applicable {
            line(&mut out, &format!("{}: N/A, {why}", row.condition));
        }
    }
    out
}

fn row_text(row: &Row, deformable: bool) -> String {
    let Some(outcome) = &row.outcome else {
        return cells(&row.condition, std::array::from_fn(|_| "N/A".to_owned()));
    };
    let percent = |rate: &Rate| rate.rate.map_or_else(|| "–".to_owned(), |rate| format!("{rate:.1}"));
    let counts = |change: Change| format!("{}/{}", change.better, change.worse);
    let absent = || if deformable { "–" } else { "N/A" }.to_owned();
    let ratio = outcome.d_over_tau.mean.map_or_else(absent, |mean| format!("{mean:.3}"));
    let compared = match &outcome.paired {
        None => Default::default(),
        Some(paired) => [
            counts(paired.goal),
            counts(paired.no_drop),
            counts(paired.safety),
            paired
                .d_over_tau_mean
                .map_or_else(absent, |mean| format!("{mean:+.3} {}", counts(paired.d_over_tau))),
        ],
    };
    let [goal, no_drop, safety, deformation] = compared;
    cells(
        &row.condition,
        [
            percent(&outcome.goal_success_rate),
            percent(&outcome.no_drop_rate),
            percent(&outcome.safety_success_rate),
            ratio,
            outcome.invalid.to_string(),
            goal,
            no_drop,
            safety,
            deformation,
        ],
    )
}

fn cells(name: &str, cells: [String; 9]) -> String {
    let short: String = match name.chars().count() <= NAME {
        true => name.to_owned(),
        false => name.chars().take(NAME - 1).chain(['…']).collect(),
    };
    let mut text = format!("{short:<NAME$}");
    for (cell, width) in cells.iter().zip([6, 7, 7, 6, 7, 9, 11, 11, 14]) {
        // Writing to a String cannot fail.
        let _ = write!(text, "{cell:>width$}");
    }
    text
}

fn line(out: &mut String, text: &str) {
    out.push_str(text.trim_end());
    out.push('\n');
}

fn rule(out: &mut String) {
    line(out, &"─".repeat(WIDTH));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::record::tests::sample;

    fn row(condition: &str, outcome: Option<Outcome>) -> Row {
        let not_applicable = outcome.is_none().then(|| "nothing in it deforms".to_owned());
        Row { condition: condition.into(), shift: Vec::new(), set: Vec::new(), outcome, not_applicable }
    }

    #[test]
    fn a_table_has_a_row_a_condition_with_its_counts_and_fits_the_screen() {
        let reference = [sample()];
        let mut worse = sample();
        (worse.verdict.safety, worse.verdict.d_peak) = (false, Some(1.5));
        let suite = Rows {
            suite: "buns".into(),
            policy: "expert".into(),
            deformable: true,
            rows: vec![
                row("reference", Some(Outcome::new("reference".into(), &reference, None))),
                row("heavy", Some(Outcome::new("heavy".into(), &[worse], Some(&reference)))),
                row("a condition with a long name", None),
            ],
        };
        let text = table(&suite);
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
        let words = |start: &str| -> Vec<&str> {
            text.lines().find(|line| line.starts_with(start)).unwrap().split_whitespace().collect()
        };
        assert_eq!(words("reference"), ["reference", "100.0", "100.0", "100.0", "0.333", "0"]);
        let heavy = ["heavy", "100.0", "100.0", "0.0", "1.500", "0", "0/0", "0/0", "0/1", "+1.167", "0/1"];
        assert_eq!(words("heavy"), heavy);
        assert!(text.contains("a condition with a …   N/A") && text.contains("N/A, nothing in it deforms"));
    }
}
