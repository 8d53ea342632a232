//! The figures of a report as SVG: colours come from the page, so that they follow light and dark.

use maud::{Markup, html};

use crate::{evaluation::summary::Summary, report::tables::Judged};

/// Size of a figure, its units.
const WIDTH: f64 = 720.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 16.0;

/// A plot's axes: a range of y, 0 at the bottom.
struct Axes {
    height: f64,
    most: f64,
}

impl Axes {
    fn y(&self, value: f64) -> f64 {
        TOP + self.height * (1.0 - value.clamp(0.0, self.most) / self.most)
    }

    /// Lines across at round values.
    fn grid(&self, step: f64, unit: &str) -> Markup {
        let lines = (0..).map(|i| f64::from(i) * step).take_while(|value| *value <= self.most + 1e-9);
        html! {
            @for value in lines {
                @let y = self.y(value);
                line.grid x1=(LEFT) x2=(WIDTH - RIGHT) y1=(n(y)) y2=(n(y)) {}
                text.tick x=(LEFT - 8.0) y=(n(y + 4.0)) text-anchor="end" { (short(value)) (unit) }
            }
        }
    }
}

/// A coordinate.
fn n(x: f64) -> String {
    format!("{x:.1}")
}

fn short(x: f64) -> String {
    let text = format!("{x:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Goal and Safety Success side by side, a pair a run, with their intervals.
pub fn goal_and_safety(runs: &[Judged]) -> Markup {
    let axes = Axes { height: 220.0, most: 100.0 };
    let slot = (WIDTH - LEFT - RIGHT) / runs.len().max(1) as f64;
    let bar = (0.36 * slot).min(46.0);
    let bars = |s: &Summary| {
        let soft = s.scores.deformation_ok_rate.is_some();
        [("goal", Some(s.scores.goal_success_rate)), ("safety", soft.then_some(s.scores.safety_success_rate))]
    };
    html! {
        svg viewBox=(format!("0 0 {WIDTH} 300")) role="img" aria-label="Goal and Safety Success by run" {
            (axes.grid(25.0, " %"))
            @for (i, judged) in runs.iter().enumerate() {
                @let middle = LEFT + slot * (i as f64 + 0.5);
                @for (k, (class, rate)) in bars(&judged.summary).into_iter().enumerate() {
                    @let x = middle + bar * (k as f64 - 1.0);
                    @if let Some((value, [low, high])) = rate.and_then(|rate| rate.rate.zip(rate.wilson95)) {
                        rect class=(class) x=(n(x + 1.0)) y=(n(axes.y(value))) width=(n(bar - 2.0)) height=(n(axes.y(0.0) - axes.y(value))) rx="2" {
                            title { (judged.method()) ", " (judged.summary.suite) ": " (class) " " (short(value)) " % [" (short(low)) ", " (short(high)) "]" }
                        }
                        line.interval x1=(n(x + 0.5 * bar)) x2=(n(x + 0.5 * bar)) y1=(n(axes.y(low))) y2=(n(axes.y(high))) {}
                    } @else {
                        text.tick x=(n(x + 0.5 * bar)) y=(n(axes.y(0.0) - 6.0)) text-anchor="middle" { "N/A" }
                    }
                }
                text.tick x=(n(middle)) y=(n(axes.y(0.0) + 18.0)) text-anchor="middle" { (judged.summary.suite) }
                text.label x=(n(middle)) y=(n(axes.y(0.0) + 34.0)) text-anchor="middle" { (judged.summary.policy) }
            }
            g.legend {
                rect.goal x=(LEFT) y="284" width="12" height="12" rx="2" {}
                text.tick x=(LEFT + 18.0) y="294" { "Goal Success" }
                rect.safety x=(LEFT + 120.0) y="284" width="12" height="12" rx="2" {}
                text.tick x=(LEFT + 138.0) y="294" { "Safety Success" }
            }
        }
    }
}

/// Peak deformation of every episode against its object's threshold, a row an asset.
pub fn distributions(judged: &Judged) -> Markup {
    let assets: Vec<(&String, f64)> =
        judged.summary.by_asset.iter().filter_map(|(name, scores)| Some((name, scores.tau?))).collect();
    let share = |asset: &str, tau: f64| -> Vec<(f64, bool)> {
        let own = judged.run.records.iter().filter(|r| r.identity.asset == asset && r.outcome.is_valid());
        own.filter_map(|r| Some((r.verdict.d_peak? / tau, r.verdict.goal))).collect()
    };
    let most = assets
        .iter()
        .flat_map(|(asset, tau)| share(asset, *tau))
        .map(|(d, _)| d)
        .fold(1.25, f64::max)
        .min(8.0)
        * 1.04;
    let (left, pitch) = (150.0, 22.0);
    let x = |value: f64| left + (WIDTH - left - RIGHT) * value.clamp(0.0, most) / most;
    let height = TOP + pitch * assets.len() as f64 + 34.0;
    let step = if most > 4.0 { 1.0 } else { 0.5 };
    let ticks = (0..).map(|i| f64::from(i) * step).take_while(|value| *value < most);
    html! {
        svg viewBox=(format!("0 0 {WIDTH} {height}")) role="img" aria-label="Peak deformation against the threshold" {
            @for value in ticks {
                line.grid x1=(n(x(value))) x2=(n(x(value))) y1=(TOP) y2=(n(height - 30.0)) {}
                text.tick x=(n(x(value))) y=(n(height - 14.0)) text-anchor="middle" { (short(value)) }
            }
            line.limit x1=(n(x(1.0))) x2=(n(x(1.0))) y1=(TOP) y2=(n(height - 30.0)) {}
            text.tick x=(n(x(1.0))) y=(TOP - 4.0) text-anchor="middle" { "τ" }
            @for (row, (asset, tau)) in assets.iter().enumerate() {
                @let y = TOP + pitch * (row as f64 + 0.5);
                text.tick x=(left - 10.0) y=(n(y + 4.0)) text-anchor="end" { (asset) }
                @for (k, (d, goal)) in share(asset, *tau).into_iter().enumerate() {
                    // Spread across the row so that equal ones stay apart.
                    @let up = f64::from((k as u32 * 5) % 9) - 4.0;
                    circle class=(if goal { "dot" } else { "dot failed" }) cx=(n(x(d))) cy=(n(y + up)) r="3" {
                        title { (asset) ": D/τ " (short(d)) @if !goal { ", goal missed" } }
                    }
                }
            }
            text.tick x=(n(x(0.5 * most))) y=(n(height)) text-anchor="middle" { "D peak over τ; hollow: goal missed" }
        }
    }
}

/// Safety over the strictness of the thresholds, a line a run.
pub fn kappa_curves(runs: &[Judged]) -> Markup {
    let axes = Axes { height: 220.0, most: 100.0 };
    let soft: Vec<&Judged> = runs.iter().filter(|judged| !judged.summary.kappa.is_empty()).collect();
    let x = |kappa: f64| LEFT + (WIDTH - LEFT - RIGHT) * kappa;
    let path = |judged: &Judged| {
        let points =
            judged.summary.kappa.iter().filter_map(|row| Some((row.kappa, row.safety_success_rate.rate?)));
        points.enumerate().fold(String::new(), |path, (i, (kappa, rate))| {
            format!("{path}{}{} {}", if i == 0 { "M" } else { " L" }, n(x(kappa)), n(axes.y(rate)))
        })
    };
    let height = 284.0 + 18.0 * soft.len() as f64;
    html! {
        svg viewBox=(format!("0 0 {WIDTH} {height}")) role="img" aria-label="Safety Success over kappa" {
            (axes.grid(25.0, " %"))
            @for tenth in (0_u8..=10).step_by(2) {
                text.tick x=(n(x(f64::from(tenth) / 10.0))) y=(n(axes.y(0.0) + 18.0)) text-anchor="middle" { (short(f64::from(tenth) / 10.0)) }
            }
            line.limit x1=(n(x(0.5))) x2=(n(x(0.5))) y1=(TOP) y2=(n(axes.y(0.0))) {}
            text.tick x=(n(x(0.5))) y=(n(axes.y(0.0) + 34.0)) text-anchor="middle" { "κ (nominal 0.5): the threshold is κ times the largest stable deformation" }
            @for (i, judged) in soft.iter().enumerate() {
                @let class = format!("curve c{}", i % 6);
                path class=(class) d=(path(judged)) {}
                @let y = 288.0 + 18.0 * i as f64;
                line class=(class) x1=(LEFT) x2=(LEFT + 22.0) y1=(n(y)) y2=(n(y)) {}
                text.tick x=(LEFT + 30.0) y=(n(y + 4.0)) { (judged.summary.suite) ", " (judged.method()) }
            }
        }
    }
}
