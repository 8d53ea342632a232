//! Safety Success over κ, the strictness of the limit: one chart per suite, one curve per run.

use maud::{Markup, html};

use super::fluid_chart::{fluid_chart, percent_axis};
use crate::run_summary::RunSummary;
use softvt_common::text::shortened;
use softvt_evaluation::{safety::NOMINAL_KAPPA, statistics::Rate};
use softvt_media::{
    axis::Axis,
    chart::{Chart, ChartPoint, Curve, Mark},
    drawing::{Stroke, Tone},
};
use softvt_runs::record::EpisodeRecord;

/// Height of a chart, pixels.
const HEIGHT: f32 = 192.0;
const MAX_NAME: usize = 24;
/// Dashes of curves, which differ in them; colours belong to verdicts.
const DASHES: usize = 6;
/// Distance of curves that coincide, %.
const OFFSET: f64 = 0.8;

/// Charts of the suites in which Safety Success depends on κ.
pub(super) fn kappa_charts(runs: &[RunSummary]) -> Markup {
    let soft: Vec<&RunSummary> = runs.iter().filter(|run| run.is_soft()).collect();
    let is_flat = |run: &&RunSummary| curve_corners(run).iter().all(|corner| corner.percent == 0.0);
    html! {
        @for runs in soft.chunk_by(|a, b| a.summary.suite == b.summary.suite) {
            @if !runs.iter().all(is_flat) {
                @let suite = &runs[0].summary.suite;
                p.suite { (suite) }
                div.axes.named role="img" aria-label={ "Safety Success over kappa, " (suite) "; the numbers are in the table above" } {
                    (fluid_chart(&chart(runs), HEIGHT))
                }
            }
        }
    }
}

fn chart(runs: &[&RunSummary]) -> Chart {
    let mut marks = vec![Mark::Event { x: NOMINAL_KAPPA, label: "nominal".to_owned() }];
    for (index, run) in runs.iter().enumerate() {
        let corners = curve_corners(run);
        // Separates coinciding lines.
        let offset = OFFSET * ((index % 5) as f64 - 2.0);
        let steps = corners.windows(2).filter(|pair| pair[1].kappa > pair[0].kappa);
        marks.extend(
            steps.map(|pair| Mark::Interval { x: [pair[0].kappa, pair[1].kappa], y: pair[0].interval }),
        );
        let point =
            |corner: &CurvePoint| ChartPoint { x: corner.kappa, y: corner.percent + offset, symbol: None };
        marks.push(Mark::Curve(Curve {
            name: shortened(&run.method, MAX_NAME),
            points: corners.iter().map(point).collect(),
            stroke: Some(Stroke::Curve { tone: Tone::Ink, dash: index % DASHES }),
        }));
    }
    Chart { title: String::new(), x: Axis::linear("κ", 0.0, 1.0, 5), y: percent_axis(5), marks }
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
        let plot = kappa_charts(&runs).into_string();
        assert_eq!(plot.matches("<rect class=\"interval\"").count(), 3, "a band between the steps: {plot}");
        let rises = |pair: &[CurvePoint]| pair[0].percent != pair[1].percent;
        assert!(corners.windows(2).filter(|pair| rises(pair)).all(|pair| pair[0].kappa == pair[1].kappa));
    }
}
