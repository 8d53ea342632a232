//! D/τ of every episode: one strip of marks per run.

use maud::{Markup, html};

use super::marks::{legend, mark, vertical_lines, x, y};
use crate::run_summary::RunSummary;
use softvt_common::text::decimal;
use softvt_evaluation::{category::EpisodeCategory, statistics::Distribution};
use softvt_media::d_axis::{D_TICKS, d_share};

/// Height of a strip, pixels.
const HEIGHT: f64 = 34.0;
/// Number of episodes from which a strip has a bar from P5 to P95.
const MIN_SPREAD: usize = 10;

/// Peak D over τ of each episode, by run.
pub(super) fn deformation_strips(runs: &[RunSummary]) -> Markup {
    let soft: Vec<&RunSummary> = runs.iter().filter(|run| run.is_soft()).collect();
    let occurs = |category| soft.iter().any(|run| run.summary.scores.count(category) > 0);
    let has_several = soft.iter().any(|run| run.summary.suite != soft[0].summary.suite);
    html! {
        div.chart {
            @for of_suite in soft.chunk_by(|a, b| a.summary.suite == b.summary.suite) {
                @if has_several { p.suite { (of_suite[0].summary.suite) } }
                @for run in of_suite { (strip(run)) }
            }
            div.row.axis {
                span.name {}
                svg width="100%" height="18" aria-hidden="true" {
                    @for tick in D_TICKS {
                        text.tick x=(x(d_share(tick))) y="13" text-anchor="middle" { @if tick == 1.0 { "limit τ" } @else { (tick) " ×" } }
                    }
                }
                span.value {}
            }
        }
        (legend(true, occurs))
    }
}

fn strip(run: &RunSummary) -> Markup {
    let dots: Vec<(f64, EpisodeCategory)> =
        run.run.records.iter().filter_map(|record| Some((record.d_over_tau()?, record.category()))).collect();
    let spread = Distribution::from_values(dots.iter().map(|(ratio, _)| *ratio).collect());
    let middle = y(0.5 * HEIGHT);
    html! {
        div.row {
            span.name { (run.method) }
            svg width="100%" height=(HEIGHT) aria-hidden="true" {
                rect.beyond x=(x(d_share(1.0))) width=(x(1.0 - d_share(1.0))) height="100%" {}
                (vertical_lines("grid", D_TICKS.into_iter().map(d_share)))
                (vertical_lines("limit", std::iter::once(d_share(1.0))))
                @if let (Some((low, high)), true) = (spread.p5.zip(spread.p95), spread.n >= MIN_SPREAD) {
                    line.spread x1=(x(d_share(low))) x2=(x(d_share(high))) y1=(middle) y2=(middle) {}
                }
                @if let Some(median) = spread.median.map(d_share) {
                    line.median x1=(x(median)) x2=(x(median)) y1="4" y2=(y(HEIGHT - 4.0)) {}
                }
                @for (k, (ratio, category)) in dots.iter().enumerate() { (dot(*ratio, *category, k)) }
            }
            span.value { @if spread.median.is_some() { "median " (decimal(spread.median, 2)) } @else { "no D" } br; "n " (spread.n) }
        }
    }
}

/// The k-th mark of a strip, offset vertically so that equal values stay apart. Beyond the axis it is an arrow.
fn dot(ratio: f64, category: EpisodeCategory, k: usize) -> Markup {
    let height = 0.5 * HEIGHT + (((k * 5) % 9) as f64 - 4.0) * 2.7;
    let at = d_share(ratio);
    html! {
        @if (0.0..=1.0).contains(&at) { (mark(category, at, height)) }
        @else if at > 1.0 { text.tick x="100%" y=(y(height + 4.0)) text-anchor="end" { "▶" } }
        @else { text.tick x="0" y=(y(height + 4.0)) { "◀" } }
    }
}
