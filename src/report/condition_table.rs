//! Results of a suite under several conditions: the rows of `conditions.json`, and their plain-text table.

use serde::Serialize;

use super::{
    comparison::{self, signed},
    styled_text::{Emphasis, StyledText, TerminalFormat},
};
use softvt_benchmark::ShiftValue;
use softvt_common::text::{TextColumn, TextTable, counted, decimal, escape_control, shortened};
use softvt_evaluation::statistics::{Distribution, Rate};
use softvt_runs::{
    paired_stats::{PairedComparison, PairedDifference, pair_episodes},
    record::EpisodeRecord,
    stored_run::records_as,
    summary::GroupScores,
};

/// Results under one condition.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionOutcome {
    /// Its run folder, relative to that of all conditions.
    pub folder: String,
    /// Number of episodes.
    pub episodes: usize,
    /// Number of invalid episodes, which count as failed.
    pub invalid: usize,
    /// Goal Success.
    pub goal_success_rate: Rate,
    /// NoDrop.
    pub no_drop_rate: Rate,
    /// Safety Success.
    pub safety_success_rate: Rate,
    /// Peak D divided by τ, of valid episodes that have both.
    pub d_over_tau: Distribution,
    /// Paired comparison with the reference; null for the reference itself.
    pub paired: Option<PairedComparison>,
}

impl ConditionOutcome {
    /// Results of `records`, compared with those of the reference.
    pub fn new(folder: String, records: &[EpisodeRecord], reference: Option<&[EpisodeRecord]>) -> Self {
        let paired = reference.map(|reference| {
            let name = reference.first().map_or("", |record| &record.header.id.suite);
            PairedComparison::from_pairs(&pair_episodes(reference, &records_as(records, name)))
        });
        let scores = GroupScores::from_records(&records.iter().collect::<Vec<_>>());
        Self {
            folder,
            episodes: scores.episodes,
            invalid: scores.invalid,
            goal_success_rate: scores.goal_success_rate,
            no_drop_rate: scores.no_drop_rate,
            safety_success_rate: scores.soft_safety_rate(),
            d_over_tau: scores.d_over_tau,
            paired,
        }
    }
}

/// One condition of a suite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionRow {
    /// Name of the condition.
    pub condition: String,
    /// True for the rigid twin of the suite, paired with the reference by task and episode.
    pub rigid_twin: bool,
    /// Shifts by name and value.
    pub shift: Vec<ShiftValue>,
    /// Changed settings by path and value.
    pub set: Vec<(String, String)>,
    /// Policy in place of that of the reference; absent for the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub policy: Option<String>,
    /// True if the policy keeps one number constant, by what shows of an object.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub blind: bool,
    /// Null if the condition could have no effect and was not run.
    pub outcome: Option<ConditionOutcome>,
    /// Reason for not running it; null if it was run.
    pub not_applicable: Option<String>,
}

/// A suite under all conditions, the reference first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionTable {
    /// Name of the suite in results.
    pub suite: String,
    /// Policy name with its privileged inputs.
    pub policy: String,
    /// True if targets deform, so that D/τ is defined.
    pub deformable: bool,
    /// One row per condition.
    pub rows: Vec<ConditionRow>,
}

/// A suite under conditions: one row per condition with its change from the reference. With details also all paired
/// differences.
pub fn table(suite: &ConditionTable, format: TerminalFormat) -> String {
    let mut text = StyledText::new(format);
    let conditions = counted(suite.rows.len().saturating_sub(1), "condition");
    let episodes = suite.rows.iter().find_map(|row| row.outcome.as_ref()).map_or(0, |o| o.episodes);
    let title =
        format!("{} · {} · {conditions} · {} each", suite.suite, suite.policy, counted(episodes, "episode"));
    text.line(Emphasis::Bold, shortened(&title, format.width - 1));
    let mut table = TextTable::new([
        TextColumn::Left(format.width.saturating_sub(1 + 51).clamp(16, 40)),
        TextColumn::Right(7),
        TextColumn::Right(9),
        TextColumn::Right(9),
        TextColumn::Right(10),
        TextColumn::Right(11),
    ]);
    table.row(["condition", "Goal, %", "Safety, %", "Δ Safety", "D/limit", "Δ D/limit"]);
    suite.rows.iter().for_each(|row| table.row(cells(row, suite.deformable)));
    text.plain(&table.text);
    let mut note = |sentence: &str| text.wrapped(sentence, format.width - 1);
    for row in &suite.rows {
        if let Some(why) = &row.not_applicable {
            note(&format!("{}: N/A, {why}", row.condition));
        }
        if let Some(outcome) = row.outcome.as_ref().filter(|outcome| outcome.invalid > 0) {
            let invalid = counted(outcome.invalid, "invalid episode");
            note(&format!("{}: {invalid}, counted as failed", row.condition));
        }
    }
    note(
        "Δ: change from the reference on the same episodes · D/limit: mean of peak D over τ · *: p < 0.05 (paired tests)",
    );
    if format.has_details {
        push_details(&mut text, suite, format);
    }
    text.into_text()
}

/// All paired differences, one block per condition.
fn push_details(text: &mut StyledText, suite: &ConditionTable, format: TerminalFormat) {
    for row in &suite.rows {
        let Some(paired) = row.outcome.as_ref().and_then(|outcome| outcome.paired.as_ref()) else { continue };
        text.end();
        text.line(Emphasis::Bold, shortened(&row.condition, format.width - 1));
        let mut changes = TextTable::new(comparison::COLUMNS);
        comparison::push_headings(&mut changes, "", "ref.", "cond.");
        comparison::push_rates(&mut changes, paired);
        if suite.deformable {
            comparison::push_difference(&mut changes, "D/limit", &paired.d_over_tau, 2);
        }
        text.plain(&changes.text);
    }
    text.end();
    text.wrapped(comparison::LEGEND, format.width - 1);
}

/// Columns of the name of a policy in [`controllers_table`].
const POLICY_WIDTH: usize = 22;
/// Characters of the column of a suite.
const SUITE_WIDTH: usize = 18;

/// True if the conditions differ from the reference in the policy alone.
pub fn compares_policies(tables: &[ConditionTable]) -> bool {
    let others = || tables.iter().flat_map(|table| table.rows.iter().skip(1));
    others().next().is_some()
        && others()
            .all(|row| row.policy.is_some() && row.shift.is_empty() && row.set.is_empty() && !row.rigid_twin)
}

/// Tables of policies by suite, for conditions that differ in the policy alone. All suites have the same rows. Under
/// each the best of those that keep one number constant.
pub fn controllers_table(tables: &[ConditionTable], format: TerminalFormat) -> String {
    let per_table = (format.width.saturating_sub(1 + POLICY_WIDTH) / (SUITE_WIDTH + 1)).clamp(1, 4);
    let text: String = tables.chunks(per_table).map(controllers_of_suites).collect();
    escape_control(&text).into_owned()
}

fn controllers_of_suites(suites: &[ConditionTable]) -> String {
    let mut columns = vec![TextColumn::Left(POLICY_WIDTH)];
    columns.resize(1 + suites.len(), TextColumn::Right(SUITE_WIDTH));
    let mut table = TextTable::new(columns);
    let episodes = suites.iter().flat_map(|suite| &suite.rows).filter_map(|row| row.outcome.as_ref());
    let episodes = counted(episodes.map(|outcome| outcome.episodes).max().unwrap_or(0), "episode");
    table.line(format!("Goal / Safety Success, % · {episodes} each"));
    table.rule();
    let names = suites.iter().map(|suite| shortened(&suite.suite, SUITE_WIDTH));
    table.row(std::iter::once("controller".to_owned()).chain(names));
    table.rule();
    let rows = suites.first().map_or(0, |suite| suite.rows.len());
    for index in 0..rows {
        let name = |row: &ConditionRow, policy: &str| match (index, row.blind) {
            (0, _) => policy.to_owned(),
            (_, true) => format!("{} *", row.condition),
            (_, false) => row.condition.clone(),
        };
        let first = name(&suites[0].rows[index], &suites[0].policy);
        let cells = suites.iter().map(|suite| {
            suite.rows[index].outcome.as_ref().map_or_else(
                || "N/A".to_owned(),
                |outcome| {
                    let [goal, safety] = [outcome.goal_success_rate, outcome.safety_success_rate];
                    format!("{} / {:>5}", decimal(goal.rate, 1), decimal(safety.rate, 1))
                },
            )
        });
        table.row(std::iter::once(first).chain(cells));
    }
    table.rule();
    if suites.iter().flat_map(|suite| &suite.rows).any(|row| row.blind) {
        table.line("* one constant number, by what shows of an object and the statistics of suites");
        for suite in suites {
            table.line(format!("best of *, {}: {}", suite.suite, best_blind(suite)));
        }
    }
    table.text
}

/// The policy with a constant number that is safe most often, with the interval of its Safety Success.
fn best_blind(suite: &ConditionTable) -> String {
    let safety =
        |row: &ConditionRow| row.outcome.as_ref().and_then(|outcome| outcome.safety_success_rate.rate);
    let blind = suite.rows.iter().filter(|row| row.blind);
    let best = blind.max_by(|a, b| safety(a).unwrap_or(-1.0).total_cmp(&safety(b).unwrap_or(-1.0)));
    let Some((row, outcome)) = best.and_then(|row| Some((row, row.outcome.as_ref()?))) else {
        return "N/A".to_owned();
    };
    let Rate { rate, wilson95, .. } = outcome.safety_success_rate;
    let interval = wilson95.map_or(String::new(), |[low, high]| format!(" [{low:.1}, {high:.1}]"));
    format!("{}, Safety {} %{interval}", row.condition, decimal(rate, 1))
}

fn cells(row: &ConditionRow, deformable: bool) -> [String; 6] {
    let Some(outcome) = &row.outcome else {
        return [&row.condition, "N/A", "N/A", "", "N/A", ""].map(str::to_owned);
    };
    let paired = outcome.paired.as_ref();
    let change = |difference: Option<PairedDifference>, digits: usize| {
        let Some(difference) = difference.filter(|difference| difference.n > 0) else { return String::new() };
        let mark = if difference.p.is_some_and(|p| p < 0.05) { " *" } else { "" };
        format!("{}{mark}", signed(difference.difference, digits))
    };
    let not_applicable = || "N/A".to_owned();
    let safety = outcome.safety_success_rate.rate.filter(|_| deformable);
    [
        row.condition.clone(),
        decimal(outcome.goal_success_rate.rate, 1),
        safety.map_or_else(not_applicable, |rate| decimal(Some(rate), 1)),
        change(paired.filter(|_| deformable).map(|paired| paired.safety), 1),
        if deformable { decimal(outcome.d_over_tau.mean, 2) } else { not_applicable() },
        change(paired.map(|paired| paired.d_over_tau), 2),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_record;

    fn row(condition: &str, outcome: Option<ConditionOutcome>) -> ConditionRow {
        let not_applicable = outcome.is_none().then(|| "nothing in it deforms".to_owned());
        ConditionRow {
            rigid_twin: false,
            condition: condition.into(),
            shift: Vec::new(),
            set: Vec::new(),
            policy: None,
            blind: false,
            outcome,
            not_applicable,
        }
    }

    #[test]
    fn the_table_has_one_row_per_condition_and_at_most_100_columns() {
        let reference = [sample_record()];
        let mut worse = sample_record();
        (worse.verdict.safety, worse.verdict.object_mut().d_peak) = (false, Some(1.5));
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
        let text = table(&suite, TerminalFormat::PLAIN);
        assert!(text.lines().all(|line| line.chars().count() < 80), "{text}");
        let words = |text: &str, start: &str| -> Vec<String> {
            let line = text.lines().find(|line| line.starts_with(start)).expect("a row");
            line.split_whitespace().map(str::to_owned).collect()
        };
        assert_eq!(words(&text, "reference"), ["reference", "100.0", "100.0", "0.33"]);
        assert_eq!(words(&text, "heavy"), ["heavy", "100.0", "0.0", "−100.0", "1.50", "+1.17"]);
        assert!(
            text.contains("a condition with a name tha…") && text.contains(": N/A, nothing in it deforms"),
            "{text}"
        );
        assert!(!text.contains("better"), "{text}");
        assert!(!compares_policies(std::slice::from_ref(&suite)));
        let details = table(&suite, TerminalFormat::PLAIN.with_details());
        assert!(details.lines().all(|line| line.chars().count() < 80), "{details}");
        assert_eq!(
            words(&details, "Safety, %"),
            ["Safety,", "%", "100.0", "0.0", "−100.0", "0", "1", "–", "1"]
        );
        assert_eq!(words(&details, "D/limit  ")[1..4], ["0.33", "1.50", "+1.17"]);
    }

    #[test]
    fn policies_are_one_row_each_and_the_best_without_touch_is_named() {
        let outcome = |safe: &[bool]| {
            let records = safe.iter().map(|safe| {
                let mut record = sample_record();
                record.verdict.safety = *safe;
                record
            });
            ConditionOutcome::new("x".into(), &records.collect::<Vec<_>>(), None)
        };
        let suite = |name: &str| {
            let policy = |condition: &str, blind, safe: &[bool]| ConditionRow {
                policy: Some(condition.into()),
                blind,
                ..row(condition, Some(outcome(safe)))
            };
            ConditionTable {
                suite: name.into(),
                policy: "expert".into(),
                deformable: true,
                rows: vec![
                    row("reference", Some(outcome(&[true, true]))),
                    policy("servo", false, &[true, true]),
                    policy("loose", true, &[false, false]),
                    policy("middle", true, &[true, false]),
                ],
            }
        };
        let suites = ["buns", "rolls", "cubes", "a suite with a long name", "loaves"].map(suite);
        assert!(compares_policies(&suites));
        let text = controllers_table(&suites, TerminalFormat::PLAIN);
        assert!(text.lines().all(|line| line.chars().count() < 80), "{text}");
        let lines = |start: &str| text.lines().filter(|line| line.starts_with(start)).collect::<Vec<_>>();
        assert_eq!(lines("expert").len(), 2, "five suites take two tables: {text}");
        let words: Vec<&str> = lines("middle *")[1].split_whitespace().collect();
        assert_eq!(words, ["middle", "*", "100.0", "/", "50.0", "100.0", "/", "50.0"]);
        assert_eq!(lines("best of *, rolls"), ["best of *, rolls: middle, Safety 50.0 % [9.5, 90.5]"]);
        assert!(lines("reference").is_empty(), "{text}");
    }
}
