//! Results of a suite under several conditions: the rows of `conditions.json`, and their plain-text table.

use serde::Serialize;

use super::{
    cells::signed,
    comparison::ComparedRun,
    comparison_table::{LEGEND, condition_differences},
    styled_text::{StyledText, TerminalFormat},
};
use softvt_benchmark::ShiftValue;
use softvt_common::{
    table::{Column, Table},
    text::{counted, decimal, escape_control, shortened},
};
use softvt_evaluation::statistics::{Distribution, Rate};
use softvt_runs::{
    paired_stats::{PairedComparison, PairedDifference},
    record::EpisodeRecord,
    stored_run::records_as,
    summary::GroupScores,
};

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionOutcome {
    /// Its run folder, relative to the folder of all conditions.
    pub folder: String,
    pub episodes: usize,
    /// Number of invalid episodes, which count as failed.
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
    /// Results of `records`, compared with the reference.
    pub fn new(folder: String, records: &[EpisodeRecord], reference: Option<&[EpisodeRecord]>) -> Self {
        let paired = reference.map(|reference| {
            let name = reference.first().map_or("", |record| &record.header.id.suite);
            ComparedRun::new(reference, &records_as(records, name)).differences
        });
        let scores = GroupScores::from_records(&records.iter().collect::<Vec<_>>());
        Self {
            folder,
            episodes: scores.episodes,
            invalid: scores.invalid,
            goal_success_rate: scores.goal_success_rate,
            no_drop_rate: scores.no_drop_rate,
            safety_success_rate: scores.safety_success_rate,
            d_over_tau: scores.d_over_tau,
            paired,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionRow {
    pub condition: String,
    /// True for the rigid twin of the suite, paired with the reference by task and episode.
    pub rigid_twin: bool,
    pub shift: Vec<ShiftValue>,
    pub set: Vec<(String, String)>,
    /// Policy in place of the reference's; absent for the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub policy: Option<String>,
    /// True if the actions of the reference were repeated in place of a policy.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub replay: bool,
    /// True if the policy keeps one number constant, by what shows of an object.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub blind: bool,
    /// Null if the condition could have no effect and was not run.
    pub outcome: Option<ConditionOutcome>,
    /// Reason for not running it; null if it was run.
    pub not_applicable: Option<String>,
}

impl ConditionRow {
    fn paired(&self) -> Option<&PairedComparison> {
        self.outcome.as_ref()?.paired.as_ref()
    }
}

/// A suite under all conditions, the reference first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConditionTable {
    pub suite: String,
    /// Policy name with its privileged inputs.
    pub policy: String,
    /// True if targets deform, so that D/τ is defined.
    pub deformable: bool,
    pub rows: Vec<ConditionRow>,
}

/// A suite under conditions: one row per condition with its change from the reference. With details
/// also all paired differences.
pub fn table(suite: &ConditionTable, format: TerminalFormat) -> String {
    let mut text = StyledText::new(format);
    let conditions = counted(suite.rows.len().saturating_sub(1), "condition");
    let episodes = suite.rows.iter().find_map(|row| row.outcome.as_ref()).map_or(0, |o| o.episodes);
    let episodes = counted(episodes, "episode");
    text.title(format_args!("{} · {} · {conditions} · {episodes} each", suite.suite, suite.policy));
    let width = text.width().saturating_sub(59).clamp(16, 40);
    let number = |heading, width, cell: fn(&ConditionRow, &ConditionTable) -> String| {
        Column::number(heading, move |row: &ConditionRow| cell(row, suite)).width(width)
    };
    let columns = [
        Column::text("condition", |row: &ConditionRow| row.condition.clone()).width(width),
        number("Goal, %", 7, |row, _| outcome_cell(row, true, |of| decimal(of.goal_success_rate.rate, 1))),
        number("Safety, %", 9, |row, suite| {
            outcome_cell(row, suite.deformable, |of| match of.safety_success_rate.rate {
                Some(rate) => decimal(Some(rate), 1),
                None => "N/A".to_owned(),
            })
        }),
        number("Δ Safety", 9, |row, suite| {
            change(row.paired().filter(|_| suite.deformable), 1, |of| of.safety)
        }),
        number("turned", 7, |row, suite| {
            let paired =
                row.paired().map(|paired| if suite.deformable { &paired.safety } else { &paired.goal });
            paired.map_or_else(String::new, |of| (of.better + of.worse).to_string())
        }),
        number("D/limit", 10, |row, suite| {
            outcome_cell(row, suite.deformable, |of| decimal(of.d_over_tau.mean, 2))
        }),
        number("Δ D/limit", 11, |row, _| change(row.paired(), 2, |of| of.d_over_tau)),
    ];
    text.plain(Table::new(&suite.rows, columns).text());
    for ConditionRow { condition, not_applicable, outcome, .. } in &suite.rows {
        if let Some(why) = not_applicable {
            text.note(format_args!("{condition}: N/A, {why}"));
        }
        if let Some(outcome) = outcome.as_ref().filter(|outcome| outcome.invalid > 0) {
            let invalid = counted(outcome.invalid, "invalid episode");
            text.note(format_args!("{condition}: {invalid}, counted as failed"));
        }
    }
    text.note(
        "Δ: change from the reference on the same episodes · turned: episodes with another Safety (rigid: Goal) · D/limit: \
         mean of peak D over τ · *: p < 0.05 (paired tests)",
    );
    if format.has_details {
        for row in &suite.rows {
            let Some(paired) = row.paired() else { continue };
            text.end();
            text.title(&row.condition);
            text.plain(condition_differences(paired, suite.deformable));
        }
        text.end();
        text.note(LEGEND);
    }
    text.into_text()
}

/// Columns of the name of a policy in [`controllers_table`].
const POLICY_WIDTH: usize = 22;
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
    let outcomes = suites.iter().flat_map(|suite| &suite.rows).filter_map(|row| row.outcome.as_ref());
    let episodes = counted(outcomes.map(|outcome| outcome.episodes).max().unwrap_or(0), "episode");
    // The reference has the name of its policy.
    let name = |index: &usize| match (index, &suites[0].rows[*index]) {
        (0, _) => suites[0].policy.clone(),
        (_, ConditionRow { condition, blind: true, .. }) => format!("{condition} *"),
        (_, ConditionRow { condition, .. }) => condition.clone(),
    };
    let rates = |suite: &'_ ConditionTable| {
        let cells: Vec<String> = suite.rows.iter().map(|row| outcome_cell(row, true, both_rates)).collect();
        Column::number(shortened(&suite.suite, SUITE_WIDTH), move |index: &usize| cells[*index].clone())
            .width(SUITE_WIDTH)
    };
    let rows: Vec<usize> = (0..suites.first().map_or(0, |suite| suite.rows.len())).collect();
    let columns = std::iter::once(Column::text("controller", name).width(POLICY_WIDTH));
    let mut lines = Table::new(&rows, columns.chain(suites.iter().map(rates))).lines();
    let rule = "─".repeat(TerminalFormat::DEFAULT_WIDTH - 1);
    lines.insert(1, rule.clone());
    lines.insert(0, rule.clone());
    lines.insert(0, format!("Goal / Safety Success, % · {episodes} each"));
    lines.push(rule);
    if suites.iter().flat_map(|suite| &suite.rows).any(|row| row.blind) {
        let blind = "* one constant number, by what shows of an object and the statistics of suites";
        lines.push(blind.to_owned());
        let best = |suite: &ConditionTable| format!("best of *, {}: {}", suite.suite, best_blind(suite));
        lines.extend(suites.iter().map(best));
    }
    lines.join("\n") + "\n"
}

fn both_rates(outcome: &ConditionOutcome) -> String {
    let [goal, safety] = [outcome.goal_success_rate, outcome.safety_success_rate];
    format!("{} / {:>5}", decimal(goal.rate, 1), decimal(safety.rate, 1))
}

/// A cell about an outcome; N/A if it does not apply or the condition was not run.
fn outcome_cell(row: &ConditionRow, applies: bool, cell: impl Fn(&ConditionOutcome) -> String) -> String {
    row.outcome.as_ref().filter(|_| applies).map_or_else(|| "N/A".to_owned(), cell)
}

/// A difference from the reference, with a mark if it is significant; empty for the reference itself.
fn change(
    paired: Option<&PairedComparison>,
    digits: usize,
    of: fn(&PairedComparison) -> PairedDifference,
) -> String {
    let Some(difference) = paired.map(of).filter(|difference| difference.n > 0) else { return String::new() };
    let mark = if difference.p.is_some_and(|p| p < 0.05) { " *" } else { "" };
    format!("{}{mark}", signed(difference.difference, digits))
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
