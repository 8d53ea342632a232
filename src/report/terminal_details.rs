//! The figures of a run that the terminal shows with `--details`.

use super::{cells::percentile, styled_text::StyledText};
use softvt_common::{
    table::{Column, Table},
    text::{counted, decimal, significant},
};
use softvt_evaluation::{
    safety::KAPPAS,
    statistics::{Distribution, Rate},
};
use softvt_runs::{
    paired_tests::DetectableDifference,
    summary::{EpisodeDeformation, SuiteSummary},
};

/// Width of the names of figures, columns.
const NAME_WIDTH: usize = 21;

/// A figure: its name, empty for another line about the same, and its value.
type Figure = (&'static str, String);

pub(super) fn push_details(text: &mut StyledText, summary: &SuiteSummary) {
    let figures: Vec<Figure> =
        [rates(summary), deformation(summary), harm_and_stages(summary)].into_iter().flatten().collect();
    let name = Column::text("", |(name, _): &Figure| (*name).to_owned()).width(NAME_WIDTH);
    let table = Table::new(&figures, [name, Column::text("", |(_, value): &Figure| value.clone())]);
    // The headings are empty.
    text.plain(table.text());
    text.end();
}

/// Rates, the grip, and their intervals.
fn rates(summary: &SuiteSummary) -> Vec<Figure> {
    let scores = &summary.scores;
    let mut figures = Vec::new();
    for (name, rate) in [
        ("Goal Success (TSR)", Some(scores.goal_success_rate)),
        ("NoDrop", Some(scores.no_drop_rate)),
        ("Deformation within τ", scores.deformation_ok_rate),
        ("Safety Success", Some(scores.safety_success_rate)),
        ("DSR", scores.dsr),
    ] {
        let value = match rate.filter(|rate| rate.rate.is_some()) {
            Some(rate) => interval(rate),
            None if scores.not_judged > 0 => format!("   N/A  not judged: {}", scores.not_judged),
            None => "   N/A".to_owned(),
        };
        figures.push((name, value));
        if let Some([low, high]) = rate.and_then(|rate| rate.bootstrap95) {
            figures.push(("", format!("          [{low:.1}, {high:.1}] by the bootstrap within tasks")));
        }
    }
    if scores.is_soft() {
        figures.push(("Goal–safety gap", format!("{:>6} pp", decimal(scores.goal_safe_gap, 1))));
    }
    let safe = scores.contact_safety_rate.rate.map(|safe| format!("  safe, no slip: {safe:.1} %"));
    let contact = interval(scores.contact_success_rate) + &safe.unwrap_or_default();
    let Distribution { p5, median, p95, .. } = scores.grip_ratio;
    let [p5, median, p95] = [p5, median, p95].map(|ratio| decimal(ratio, 1));
    figures.extend([
        ("Contact success", contact),
        ("Gentle", interval(scores.gentle_rate)),
        ("Grip ratio", format!("P5 {p5}, median {median}, P95 {p95}")),
    ]);
    figures
}

/// Strictness of the limit, and D of all and within episodes.
fn deformation(summary: &SuiteSummary) -> Vec<Figure> {
    if summary.kappa.is_empty() {
        return Vec::new();
    }
    let at = KAPPAS.iter().filter_map(|kappa| summary.kappa.iter().find(|row| row.kappa == *kappa));
    let rates = at.map(|row| format!("κ={}: {} %", row.kappa, decimal(row.safety_success_rate.rate, 1)));
    let (all, goal) = (summary.scores.deformation, summary.scores.deformation_goal);
    let [mean, of_goal] = [all.mean, goal.mean].map(|value| decimal(value, 2));
    let [p5, median, p95] = [all.p5, all.median, all.p95].map(|value| percentile(&all, value));
    let peaks = format!("mean {mean}, P5 {p5}, median {median}, P95 {p95}; n {}", all.n);
    let mut figures = vec![
        ("Safety Success at", rates.collect::<Vec<_>>().join(" · ")),
        ("Peak D, % of diagonal", peaks),
        ("  at the goal", format!("mean {of_goal} of {}", counted(goal.n, "episode"))),
    ];
    if all.has_invalid() {
        let invalid = counted(all.invalid, "invalid episode");
        figures.push(("", format!("percentiles rank the {invalid} as worst (∞)")));
    }
    let EpisodeDeformation { d_mean, d_final, d_p95, time_over_tau_s } = summary.scores.within_episodes;
    if d_mean.is_some() {
        let [mean, last, p95, time] = [d_mean, d_final, d_p95, time_over_tau_s].map(|x| decimal(x, 2));
        let within = format!("mean {mean}, final {last}, P95 {p95}; over τ for {time} s");
        figures.push(("  within an episode", within));
    }
    figures
}

/// Harm to other objects, the stages at which episodes failed, and the difference that the episodes can detect.
fn harm_and_stages(summary: &SuiteSummary) -> Vec<Figure> {
    let scores = &summary.scores;
    let mut figures = Vec::new();
    if let Some(rate) = scores.others_ok_rate {
        let unknown = match scores.others_unknown {
            0 => String::new(),
            unknown => format!("  unknown: {unknown}"),
        };
        figures.push(("Others within their τ", interval(rate) + &unknown));
    }
    figures.push(("Touched other objects", interval(scores.wrong_contact_rate)));
    if !scores.failed_stages.is_empty() {
        let stages = scores.failed_stages.iter().map(|(stage, count)| format!("{} {count}", stage.name()));
        figures.push(("Failed while", stages.collect::<Vec<_>>().join(" · ")));
    }
    let count = scores.main_rate().count;
    if let Some(DetectableDifference { smallest, found }) = DetectableDifference::new(count, scores.episodes)
    {
        let [smallest, found] = [smallest, found].map(|points| significant(points, 2));
        let found = format!("{smallest} points; in 4 of 5 cases {found}");
        figures.push(("Detectable difference", found));
    }
    figures
}

fn interval(rate: Rate) -> String {
    let bounds = rate.wilson95.map(|[low, high]| format!("  [{low:.1}, {high:.1}]")).unwrap_or_default();
    format!("{:>6} %{bounds}", decimal(rate.rate, 1))
}
