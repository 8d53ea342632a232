//! Safety Success over the strictness of the limit: one plot per suite, one line per run.

use maud::{Markup, html};

use super::marks::{x, y};
use crate::run_summary::RunSummary;
use softvt_common::text::shortened;
use softvt_evaluation::statistics::Rate;
use softvt_runs::record::EpisodeRecord;

/// Height of the plot, pixels, and the margin above its highest line.
const HEIGHT: f64 = 200.0;
const TOP: f64 = 8.0;
/// Distance of the names at the ends of lines, pixels, and their largest length.
const LABEL_PITCH: f64 = 14.0;
const MAX_NAME: usize = 24;

/// Plots of the suites in which Safety Success depends on κ.
pub(super) fn strictness_plots(runs: &[RunSummary]) -> Markup {
    let soft: Vec<&RunSummary> = runs.iter().filter(|run| run.is_soft()).collect();
    let is_flat = |run: &&RunSummary| curve_corners(run).iter().all(|corner| corner.percent == 0.0);
    html! {
        @for runs in soft.chunk_by(|a, b| a.summary.suite == b.summary.suite) {
            @if !runs.iter().all(is_flat) {
                p.suite { (runs[0].summary.suite) }
                (plot(&runs[0].summary.suite, runs))
            }
        }
    }
}

fn plot(suite: &str, runs: &[&RunSummary]) -> Markup {
    let label = format!("Safety Success over kappa, {suite}; the numbers are in the table above");
    html! {
        div.axes.named role="img" aria-label=(label) {
            svg width="100%" height=(HEIGHT + 22.0) aria-hidden="true" {
                @for percent in [0, 25, 50, 75, 100] {
                    text.tick x="100%" y=(y(level(f64::from(percent)) + 4.0)) text-anchor="end" { (percent) " %" }
                }
            }
            svg.plot width="100%" height=(HEIGHT + 22.0) aria-hidden="true" {
                @for quarter in 0..=4 {
                    @let height = y(level(25.0 * f64::from(quarter)));
                    line.grid x1="0" x2="100%" y1=(height) y2=(height) {}
                }
                line.limit x1="50%" x2="50%" y1=(y(level(100.0))) y2=(y(level(0.0))) {}
                text.tick x="50%" y=(y(level(100.0) + 12.0)) dx="4" { "nominal" }
                @for (i, run) in runs.iter().enumerate() { (curve(run, i)) }
                @for (i, label) in ["κ = 0", "0.2", "0.4", "0.6", "0.8", "1"].iter().enumerate() {
                    @let anchor = match i { 0 => "start", 5 => "end", _ => "middle" };
                    text.tick x=(x(0.2 * i as f64)) y=(y(HEIGHT + 16.0)) text-anchor=(anchor) { (label) }
                }
            }
            (names(runs))
        }
    }
}

/// Names of the runs at the ends of their lines, moved apart.
fn names(runs: &[&RunSummary]) -> Markup {
    let mut ends: Vec<(f64, usize)> = runs
        .iter()
        .enumerate()
        .map(|(i, run)| (level(curve_corners(run).last().map_or(0.0, |corner| corner.percent)), i))
        .collect();
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut lowest = f64::NEG_INFINITY;
    for (height, _) in &mut ends {
        *height = height.max(lowest + LABEL_PITCH);
        lowest = *height;
    }
    html! {
        svg width="100%" height=((HEIGHT + 22.0).max(lowest + 8.0)) aria-hidden="true" {
            @for (height, i) in ends {
                line class=(style(i)) x1="0" x2="18" y1=(y(height)) y2=(y(height)) {}
                text.tick x="24" y=(y(height + 4.0)) { (shortened(&runs[i].method, MAX_NAME)) }
            }
        }
    }
}

fn level(percent: f64) -> f64 {
    TOP + (HEIGHT - TOP) * (1.0 - 0.01 * percent)
}

/// Lines differ in their dashes; colours belong to verdicts.
fn style(index: usize) -> String {
    format!("curve d{}", index % 6)
}

/// A point of the curve of Safety Success over κ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CurvePoint {
    pub(crate) kappa: f64,
    pub(crate) percent: f64,
    /// 95 % Wilson interval, %.
    interval: [f64; 2],
}

/// The corners of the curve. Safety Success is a step function of κ: it rises at [`EpisodeRecord::safe_from`] of an
/// episode. Empty if nothing was judged.
pub(crate) fn curve_corners(run: &RunSummary) -> Vec<CurvePoint> {
    if run.summary.kappa.iter().all(|row| row.safety_success_rate.rate.is_none()) {
        return Vec::new();
    }
    let records = &run.run.records;
    let steps = records.iter().filter_map(EpisodeRecord::safe_from);
    let mut steps: Vec<f64> = steps.filter(|kappa| *kappa <= 1.0).collect();
    steps.sort_by(f64::total_cmp);
    let corner = |kappa: f64, count: usize| {
        let rate = Rate::new(count, records.len());
        CurvePoint {
            kappa,
            percent: rate.rate.unwrap_or(0.0),
            interval: rate.wilson95.unwrap_or([0.0, 100.0]),
        }
    };
    let mut corners = vec![corner(0.0, 0)];
    for (count, kappa) in steps.into_iter().enumerate() {
        corners.extend([count, count + 1].map(|count| corner(kappa, count)));
    }
    let last = corners[corners.len() - 1];
    corners.push(CurvePoint { kappa: 1.0, ..last });
    corners
}

fn curve(run: &RunSummary, index: usize) -> Markup {
    let corners = curve_corners(run);
    // Separates coinciding lines.
    let offset = 1.5 * ((index % 5) as f64 - 2.0);
    html! {
        @for pair in corners.windows(2).filter(|pair| pair[1].kappa > pair[0].kappa) {
            @let [low, high] = pair[0].interval;
            rect.uncertain x=(x(pair[0].kappa)) width=(x(pair[1].kappa - pair[0].kappa)) y=(y(level(high))) height=(y(level(low) - level(high))) {}
        }
        g class=(style(index)) {
            @for pair in corners.windows(2) {
                line x1=(x(pair[0].kappa)) x2=(x(pair[1].kappa)) y1=(y(level(pair[0].percent) + offset)) y2=(y(level(pair[1].percent) + offset)) {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        run_summary::{summarize_runs, tests::stored},
        sample_record,
    };

    #[test]
    fn the_curve_of_strictness_is_a_step_function() {
        // D_ref is 2: safe from κ 0.225 and from κ 0.8.
        let records = [0.45, 1.6, 9.0].map(|d| {
            let mut record = sample_record();
            record.header.id.episode = (10.0 * d) as u32;
            record.verdict.object_mut().d_peak = Some(d);
            record
        });
        let runs = summarize_runs(vec![stored("a", "pi", records.to_vec())]);
        let corners = curve_corners(&runs[0]);
        let level = |step: usize| 100.0 * step as f64 / 3.0;
        let expected = [(0.0, 0), (0.225, 0), (0.225, 1), (0.8, 1), (0.8, 2), (1.0, 2)]
            .map(|(kappa, step)| (kappa, level(step)));
        let found: Vec<(f64, f64)> = corners.iter().map(|corner| (corner.kappa, corner.percent)).collect();
        assert_eq!(found, expected);
        assert_eq!(Some(corners[2].interval), Rate::new(1, 3).wilson95);
        let plot = strictness_plots(&runs).into_string();
        assert_eq!(plot.matches("<rect class=\"uncertain\"").count(), 3, "a band between the steps: {plot}");
        let rises = |pair: &[CurvePoint]| pair[0].percent != pair[1].percent;
        assert!(corners.windows(2).filter(|pair| rises(pair)).all(|pair| pair[0].kappa == pair[1].kappa));
    }
}
