//! The figures of a run that the terminal shows with `--details`.

use super::{
    cells::percentile,
    styled_text::{Emphasis, StyledText},
};
use softvt_common::text::{counted, decimal, significant};
use softvt_evaluation::{
    safety::KAPPAS,
    statistics::{Distribution, Rate},
};
use softvt_runs::{
    paired_tests::DetectableDifference,
    summary::{EpisodeDeformation, GroupScores, SuiteSummary},
};

/// Appends all rates and distributions.
pub(super) fn push_details(text: &mut StyledText, summary: &SuiteSummary) {
    let scores = &summary.scores;
    text.end();
    push_rates(text, summary);
    push_grip(text, scores);
    push_deformation(text, summary);
    push_harm_and_stages(text, scores);
    let safe = scores.safety_success_rate.count;
    if let Some(DetectableDifference { smallest, found }) = DetectableDifference::new(safe, scores.episodes) {
        let [smallest, found] = [smallest, found].map(|points| significant(points, 2));
        let found = format!("{smallest} points; in 4 of 5 cases {found}");
        push_named(text, "Detectable difference", &found);
    }
    text.end();
}

fn push_rates(text: &mut StyledText, summary: &SuiteSummary) {
    let scores = &summary.scores;
    let safety = scores.is_soft().then_some(scores.safety_success_rate);
    for (name, rate) in [
        ("Goal Success (TSR)", Some(scores.goal_success_rate)),
        ("NoDrop", Some(scores.no_drop_rate)),
        ("Deformation within τ", scores.deformation_ok_rate),
        ("Safety Success", safety),
        ("DSR", scores.dsr),
    ] {
        let cell = match rate.filter(|rate| rate.rate.is_some()) {
            Some(rate) => interval(rate),
            None if scores.not_judged > 0 => format!("   N/A  not judged: {}", scores.not_judged),
            None => "   N/A".to_owned(),
        };
        push_named(text, name, &cell);
        if let Some([low, high]) = rate.and_then(|rate| rate.bootstrap95) {
            push_named(text, "", &format!("          [{low:.1}, {high:.1}] by the bootstrap within tasks"));
        }
    }
    if scores.is_soft() {
        push_named(text, "Goal–safety gap", &format!("{:>6} pp", decimal(scores.goal_safe_gap, 1)));
    }
}

/// Contact success and the grip ratio.
fn push_grip(text: &mut StyledText, scores: &GroupScores) {
    let safe = decimal(scores.contact_safety_rate.rate, 1);
    let contact = format!("{}  safe, no slip: {safe} %", interval(scores.contact_success_rate));
    push_named(text, "Contact success", &contact);
    let Distribution { p5, median, p95, .. } = scores.grip_ratio;
    let [p5, median, p95] = [p5, median, p95].map(|ratio| decimal(ratio, 1));
    push_named(text, "Gentle", &interval(scores.gentle_rate));
    push_named(text, "Grip ratio", &format!("P5 {p5}, median {median}, P95 {p95}"));
}

/// Strictness of the limit, and D of all and within episodes.
fn push_deformation(text: &mut StyledText, summary: &SuiteSummary) {
    if summary.kappa.is_empty() {
        return;
    }
    let at = KAPPAS.iter().filter_map(|kappa| summary.kappa.iter().find(|row| row.kappa == *kappa));
    let rates = at.map(|row| format!("κ={}: {} %", row.kappa, decimal(row.safety_success_rate.rate, 1)));
    push_named(text, "Safety Success at", &rates.collect::<Vec<_>>().join(" · "));
    let (all, goal) = (summary.scores.deformation, summary.scores.deformation_goal);
    let [mean, of_goal] = [all.mean, goal.mean].map(|value| decimal(value, 2));
    let [p5, median, p95] = [all.p5, all.median, all.p95].map(|value| percentile(&all, value));
    let peaks = format!("mean {mean}, P5 {p5}, median {median}, P95 {p95}; n {}", all.n);
    push_named(text, "Peak D, % of diagonal", &peaks);
    push_named(text, "  at the goal", &format!("mean {of_goal} of {}", counted(goal.n, "episode")));
    if all.has_invalid() {
        let ranked = format!("percentiles rank the {} as worst (∞)", counted(all.invalid, "invalid episode"));
        push_named(text, "", &ranked);
    }
    let EpisodeDeformation { d_mean, d_final, d_p95, time_over_tau_s } = summary.scores.within_episodes;
    if d_mean.is_some() {
        let [mean, last, p95, time] = [d_mean, d_final, d_p95, time_over_tau_s].map(|x| decimal(x, 2));
        let within = format!("mean {mean}, final {last}, P95 {p95}; over τ for {time} s");
        push_named(text, "  within an episode", &within);
    }
}

/// Harm to other objects, and the stages at which episodes failed.
fn push_harm_and_stages(text: &mut StyledText, scores: &GroupScores) {
    if let Some(rate) = scores.others_ok_rate {
        let unknown = match scores.others_unknown {
            0 => String::new(),
            unknown => format!("  unknown: {unknown}"),
        };
        push_named(text, "Others within their τ", &format!("{}{unknown}", interval(rate)));
    }
    push_named(text, "Touched other objects", &interval(scores.wrong_contact_rate));
    if !scores.failed_stages.is_empty() {
        let stages = scores.failed_stages.iter().map(|(stage, count)| format!("{} {count}", stage.name()));
        push_named(text, "Failed while", &stages.collect::<Vec<_>>().join(" · "));
    }
}

/// Appends a line of a figure.
fn push_named(text: &mut StyledText, name: &str, value: &str) {
    text.line(Emphasis::None, format!("{name:<22}{value}"));
}

fn interval(rate: Rate) -> String {
    let bounds = rate.wilson95.map(|[low, high]| format!("  [{low:.1}, {high:.1}]")).unwrap_or_default();
    format!("{:>6} %{bounds}", decimal(rate.rate, 1))
}
