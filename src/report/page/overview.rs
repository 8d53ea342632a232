//! The first table of the page: Goal and Safety Success of each run, and the gap between them.

use maud::{Markup, html};

use super::{
    breakable,
    marks::{class, legend, vertical_lines, x},
};
use crate::run_summary::RunSummary;
use softvt_common::text::decimal;
use softvt_evaluation::{category::EpisodeCategory, statistics::Rate};

/// Height of the marks of a run, pixels, and of the numbers of the axis.
const HEIGHT: f64 = 26.0;
const AXIS_HEIGHT: f64 = 16.0;

pub(super) fn overview(runs: &[RunSummary]) -> Markup {
    let has_several = runs.iter().any(|run| run.summary.suite != runs[0].summary.suite);
    let count = |category| runs.iter().map(|run| run.summary.scores.count(category)).sum::<usize>();
    html! {
        figure.table {
            div.scroll tabindex="0" role="group" aria-labelledby="results-table" {
                table.cards.overview aria-labelledby="results-table" {
                    thead { (headings()) }
                    @for of_suite in runs.chunk_by(|a, b| a.summary.suite == b.summary.suite) {
                        tbody {
                            @if has_several { tr.suite { th scope="rowgroup" colspan="8" { (breakable(&of_suite[0].summary.suite)) } } }
                            @let bound = blind_bound(of_suite);
                            @for run in of_suite { (row(run, bound.as_ref())) }
                        }
                    }
                }
            }
            (legend(runs.iter().any(RunSummary::is_soft), |category| count(category) > 0))
            @for of_suite in runs.chunk_by(|a, b| a.summary.suite == b.summary.suite) {
                @if let Some(bound) = blind_bound(of_suite) {
                    p.note {
                        "Dashed in " (of_suite[0].summary.suite) ": Safety of the best controller here that keeps one number constant ("
                        (bound.policy) ", " (format_args!("{:.0}", bound.safety)) " %)."
                    }
                }
            }
            figcaption id="results-table" {
                "Goal Success (ring) and Safety Success (dot), % of episodes; the line between them is the gap, the band the 95 % Wilson interval of Safety. Safety needs the goal, no drop, and a peak deformation D within the limit τ of the object; it does not apply to rigid objects. Collapsed: mean of the largest share of the volume beyond the collapse strain of its material. D/limit: median of peak D over τ."
            }
        }
    }
}

/// The best of the controllers that keep one number constant.
struct BlindBound {
    policy: String,
    safety: f64,
}

/// The bound of a suite whose runs include such controllers.
fn blind_bound(runs: &[RunSummary]) -> Option<BlindBound> {
    let bounds = runs.iter().filter(|run| run.run.manifest.blind).filter_map(|run| {
        let safety = run.summary.scores.safety_success_rate.rate?;
        Some(BlindBound { policy: run.run.manifest.policy.clone(), safety })
    });
    bounds.reduce(|a, b| if b.safety > a.safety { b } else { a })
}

fn headings() -> Markup {
    let quarters = [0, 25, 50, 75, 100];
    html! {
        tr {
            th.text scope="col" { "Policy" }
            th.text scope="col" {
                "Goal ○ → Safety ●"
                svg.axis width="100%" height=(AXIS_HEIGHT) aria-hidden="true" {
                    @for quarter in quarters {
                        text.tick x=(x(f64::from(quarter) / 100.0)) y="12" text-anchor="middle" { (quarter) }
                    }
                }
            }
            @for name in ["Goal, %", "Safety, %", "Gap", "Collapsed", "D/limit"] { th.number scope="col" { (name) } }
            th.text scope="col" { "Episodes" }
        }
    }
}

fn row(run: &RunSummary, bound: Option<&BlindBound>) -> Markup {
    let scores = &run.summary.scores;
    let goal = scores.goal_success_rate;
    let safety = Some(scores.safety_success_rate).filter(|safety| safety.rate.is_some());
    let count = run.run.records.len();
    html! {
        tr {
            th.text scope="row" { (breakable(&run.method)) @if run.run.manifest.blind { span.interval { "one constant number" } } }
            td.text.chart data-head="Goal → Safety" { (dumbbell(goal, safety, scores.count(EpisodeCategory::OverLimit) > 0, bound)) }
            td.number data-head="Goal, %" { (rate(goal)) }
            td.number data-head="Safety, %" { @match safety { Some(safety) => b { (rate(safety)) }, None => "N/A" } }
            td.number data-head="Gap" { (decimal(scores.goal_safe_gap, 0)) }
            td.number data-head="Collapsed" { (collapsed(scores.collapsed_volume.mean)) }
            td.number data-head="D/limit" { (decimal(scores.d_over_tau.median, 2)) }
            td.text data-head="Episodes" {
                (outcome_bar(run))
                span.counts {
                    @if run.run.is_partial() { (count) " of " (run.run.manifest.requested_episodes()) ": " }
                    @for category in EpisodeCategory::ALL {
                        @if scores.count(category) > 0 { span.nobreak { (category.glyph()) " " (scores.count(category)) } " " }
                    }
                }
            }
        }
    }
}

/// A rate with its interval below.
fn rate(rate: Rate) -> Markup {
    html! {
        (decimal(rate.rate, 0))
        @if let Some([low, high]) = rate.wilson95 { span.interval { (format_args!("{low:.0}–{high:.0}")) } }
    }
}

fn collapsed(mean: Option<f64>) -> Markup {
    html! {
        @match mean {
            None => "–",
            Some(mean) => {
                (format_args!("{mean:.0}\u{a0}%"))
                svg.bar width="100%" height="6" aria-hidden="true" {
                    rect.empty width="100%" height="6" {}
                    rect.over width=(x(0.01 * mean)) height="6" {}
                }
            }
        }
    }
}

/// Goal and Safety, and the line between them.
fn dumbbell(goal: Rate, safety: Option<Rate>, is_over: bool, bound: Option<&BlindBound>) -> Markup {
    let middle = 0.5 * HEIGHT;
    let at = |rate: Rate| rate.rate.map(|value| 0.01 * value);
    let verdict = if is_over { "over" } else { "safe" };
    html! {
        svg width="100%" height=(HEIGHT) aria-hidden="true" {
            (vertical_lines("grid", (0..=4).map(|quarter| 0.25 * f64::from(quarter))))
            @if let Some(bound) = bound { (vertical_lines("bound", std::iter::once(0.01 * bound.safety))) }
            @if let Some([low, high]) = safety.and_then(|safety| safety.wilson95) {
                rect class={ "band " (verdict) } x=(x(0.01 * low)) width=(x(0.01 * (high - low))) y="5" height=(HEIGHT - 10.0) {}
            }
            @if let Some((goal, safety)) = at(goal).zip(safety.and_then(at)) {
                line class={ "gap " (verdict) } x1=(x(safety)) x2=(x(goal)) y1=(middle) y2=(middle) {}
            }
            @if let Some(goal) = at(goal) { circle.goal cx=(x(goal)) cy=(middle) r="6.5" {} }
            @if let Some(safety) = safety.and_then(at) { circle class=(verdict) cx=(x(safety)) cy=(middle) r="4" {} }
        }
    }
}

/// The share of each category of episodes.
fn outcome_bar(run: &RunSummary) -> Markup {
    let scores = &run.summary.scores;
    let all = scores.episodes.max(1) as f64;
    let mut left = 0.0;
    let parts: Vec<(&str, f64, f64)> = EpisodeCategory::ALL
        .into_iter()
        .map(|category| (class(category), scores.count(category) as f64 / all))
        .filter(|(_, share)| *share > 0.0)
        .map(|(class, share)| {
            left += share;
            (class, left - share, share)
        })
        .collect();
    html! {
        svg.outcomes width="100%" height="10" aria-hidden="true" {
            @for (class, from, share) in parts { rect class=(class) x=(x(from)) width=(x(share)) height="10" {} }
        }
    }
}
