//! Sentences about the results of the runs of a page.

use maud::{Markup, html};

use crate::{condition_effects::ConditionEffects, run_summary::RunSummary, terminal::FEW_EPISODES};
use softvt_common::text::{counted, decimal};
use softvt_evaluation::category::EpisodeCategory;
use softvt_runs::record::EpisodeRecord;

/// One paragraph per suite, of the runs without a changed condition, and one per set of conditions.
pub(super) fn result_sentences(runs: &[RunSummary], effects: &[ConditionEffects]) -> Markup {
    let plain: Vec<&RunSummary> = runs.iter().filter(|run| run.run.condition().is_none()).collect();
    let suites = plain.chunk_by(|a, b| a.summary.suite == b.summary.suite).collect::<Vec<_>>();
    html! {
        @for of_suite in &suites {
            p.result { @if suites.len() > 1 { (of_suite[0].summary.suite) ": " } (results(of_suite)) }
        }
        @for suite in effects { p.result { (conditions(suite)) } }
    }
}

/// Sentences about the goal, the limit and drops.
fn results(runs: &[&RunSummary]) -> Markup {
    let valid: Vec<&&RunSummary> = runs.iter().filter(|run| run.summary.scores.episodes > 0).collect();
    if valid.is_empty() {
        return html! { "There is no episode yet." };
    }
    let goals: Vec<f64> = valid.iter().filter_map(|run| run.summary.scores.goal_success_rate.rate).collect();
    let (low, high) =
        goals.iter().fold((100.0_f64, 0.0_f64), |(low, high), goal| (low.min(*goal), high.max(*goal)));
    let [least, most] = [low, high].map(|percent| decimal(Some(percent), 0));
    let who = match valid[..] {
        [single] => single.run.manifest.policy.clone(),
        [_, _] => "Both policies".to_owned(),
        _ => format!("All {} policies", valid.len()),
    };
    let verb = if valid.len() == 1 { "brings" } else { "bring" };
    let over: Vec<&&&RunSummary> =
        valid.iter().filter(|run| run.summary.scores.count(EpisodeCategory::OverLimit) > 0).collect();
    let drops = valid.iter().filter_map(|run| dropped(run)).collect::<Vec<_>>();
    let is_soft = valid.iter().any(|run| run.is_soft());
    let within: Vec<&&&RunSummary> = valid.iter().filter(|run| is_within(run)).collect();
    html! {
        @if low > 99.99 { (who) " " (verb) " every object to its goal. " }
        @else if valid.len() == 1 { (who) " reaches the goal in " (most) " % of the episodes. " }
        @else if least == most { "Goal Success is " (least) " %. " }
        @else { "Goal Success is " (least) " to " (most) " %. " }
        @for run in &over { b.over { (over_limit(run)) } " " }
        @if is_soft && within.len() == valid.len() { b.safe { "No object is over its limit." } }
        @else if let (true, [single]) = (is_soft, &within[..]) { b.safe { (single.run.manifest.policy) } " stays within the limit." }
        @else if is_soft && !within.is_empty() {
            b.safe { @if within.len() + over.len() == valid.len() { "The other " } (within.len()) " policies" } " stay within the limit."
        }
        @for sentence in &drops { " " b.dropped { (sentence) } }
    }
}

/// True if the limit was exceeded in no episode, whether the goal was reached or not.
fn is_within(run: &RunSummary) -> bool {
    run.is_soft() && run.run.records.iter().all(|record| record.is_within_limits() != Some(false))
}

/// "tactile-servo drops 1 of 10."
fn dropped(run: &RunSummary) -> Option<String> {
    let is_dropped = |record: &&EpisodeRecord| record.outcome.is_valid() && !record.verdict.no_drop;
    let drops = run.run.records.iter().filter(is_dropped).count();
    let all = run.run.records.len();
    (drops > 0).then(|| format!("{} drops {drops} of {all}.", run.run.manifest.policy))
}

/// "expert-binary crushes the object in 10 of 10 episodes (67 % of the volume collapsed)."
fn over_limit(run: &RunSummary) -> Markup {
    let over: Vec<_> =
        run.run.records.iter().filter(|record| record.category() == EpisodeCategory::OverLimit).collect();
    let crushed = over.iter().filter(|record| record.crushed_volume_pct().is_some()).count();
    let policy = &run.run.manifest.policy;
    let all = counted(run.run.records.len(), "episode");
    let volumes: Vec<f64> = over.iter().filter_map(|record| record.collapsed_volume_pct()).collect();
    let mean = volumes.iter().sum::<f64>() / volumes.len().max(1) as f64;
    // Harm in episodes that another category names.
    let elsewhere = run.run.records.iter().filter(|record| {
        record.is_within_limits() == Some(false) && record.category() != EpisodeCategory::OverLimit
    });
    let (over, elsewhere) = (over.len(), elsewhere.count());
    html! {
        @if crushed == 0 { (policy) " is over the limit in " (over) " of " (all) "." }
        @else if crushed == over {
            (policy) " crushes the object in " (crushed) " of " (all) " (" (decimal(Some(mean), 0)) " % of the volume collapsed)."
        }
        @else { (policy) " is over the limit in " (over) " of " (all) ", and crushes the object in " (crushed) "." }
        @if elsewhere > 0 { " In " (elsewhere) " more it is over the limit, and misses the goal or drops the object." }
    }
}

/// The range of Safety and D/τ under the conditions of a suite.
fn conditions(suite: &ConditionEffects) -> Markup {
    let range = |values: Vec<f64>| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (low, high)
    };
    let (low, high) = range(suite.effects.iter().filter_map(|effect| effect.point.safety.rate).collect());
    let ratios: Vec<f64> =
        suite.effects.iter().filter_map(|effect| effect.differences.d_over_tau.second).collect();
    let has_ratios = !ratios.is_empty();
    let (least, most) = range(ratios);
    html! {
        (suite.name()) ": under " (counted(suite.effects.len(), "condition"))
        @if low.is_finite() && low < high { " Safety is " (format_args!("{low:.0}")) " to " (format_args!("{high:.0}")) " %" }
        @else if low.is_finite() { " Safety stays at " (format_args!("{low:.0}")) " %" }
        @if has_ratios { ", and mean D/limit goes from " (format_args!("{least:.2}")) " to " (format_args!("{most:.2}")) }
        "."
    }
}

/// Short caveats of the numbers.
pub(super) fn chips(runs: &[RunSummary]) -> Markup {
    let privileged: Vec<&RunSummary> = runs.iter().filter(|run| run.summary.privileged).collect();
    let episodes = || runs.iter().map(|run| run.summary.scores.episodes);
    let (few, most) = (episodes().min().unwrap_or(0), episodes().max().unwrap_or(0));
    let invalid: usize = runs.iter().map(|run| run.summary.scores.invalid).sum();
    html! {
        ul.chips {
            @if !privileged.is_empty() {
                li {
                    @if privileged.len() == runs.len() { "all privileged" } @else { (privileged.len()) " of " (runs.len()) " privileged" }
                    ": access to ground-truth state, which no robot has"
                }
            }
            @if runs.iter().any(|run| run.summary.replayed) { li { "replayed: actions of recorded runs" } }
            @if runs.iter().any(|run| run.summary.force_observed) { li { "force_observed: true forces at the pads, which no real sensor measures" } }
            @if most > 0 {
                li { "n = " (few) @if few < most { " to " (most) } " per run" @if few < FEW_EPISODES { ": intervals are wide" } }
            }
            li { @if invalid == 0 { "no invalid episode" } @else { (counted(invalid, "invalid episode")) ", counted as failed" } }
        }
    }
}
