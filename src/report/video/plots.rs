//! Plots against time below the pictures of a video: D over its limit, and the force on the pads, with a curve per
//! episode.

use super::{BACKGROUND, FAINT, HARM, SAFE, TEXT, pad_force, worst_state};
use crate::d_axis::{D_TICKS, d_share};
use softvt_benchmark::CONTROL_DT;
use softvt_common::text::shortened;
use softvt_media::{
    canvas::{Canvas, Rgb8},
    ticks::{linear_ticks, tick_label, tick_step},
};
use softvt_rollout::StateRecording;

/// Height of the plots with their titles and labels, units of the layout.
pub(super) const PLOTS_HEIGHT: f32 = 156.0;
/// Margins of a plot around its plotting area, units.
const PLOT_LEFT: f32 = 34.0;
const PLOT_RIGHT: f32 = 12.0;
const PLOT_TOP: f32 = 24.0;
const PLOT_BOTTOM: f32 = 20.0;
/// Width of the names between the two plots, units.
const LEGEND: f32 = 138.0;
/// Share of the width without names that the plot of D over τ has; the rest is that of the force.
const D_PLOT_SHARE: f32 = 0.56;
/// Dashes of the curves in turn, units; 0 is a solid line.
const DASHES: [f32; 4] = [0.0, 5.0, 1.5, 10.0];
/// Letters of a name between the plots.
const NAME_LETTERS: usize = 18;
/// Largest numbers of intervals of the axes.
const FORCE_TICKS: usize = 4;
const TIME_TICKS: usize = 5;
const TITLE_SIZE: f32 = 12.0;
const TICK_SIZE: f32 = 11.0;

/// Colour of D over τ.
pub(super) fn ratio_colour(ratio: f64) -> Rgb8 {
    if ratio > 1.0 { HARM } else { SAFE }
}

/// What is plotted of an episode, by state.
pub(super) struct EpisodeCurves {
    /// D over τ; empty for rigid targets and without a limit.
    pub(super) d_over_tau: Vec<f64>,
    /// The larger normal force of the two pads, N.
    pub(super) pad_force_n: Vec<f64>,
    /// Index of the [worst state](worst_state).
    pub(super) worst_state: usize,
    is_rigid: bool,
}

impl EpisodeCurves {
    pub(super) fn new(recording: &StateRecording) -> Self {
        let ratios = recording.deformation.iter().map(|of| of.as_ref()?.ratio());
        let forces = recording.frames.iter().map(|frame| pad_force(frame, 0).max(pad_force(frame, 1)));
        Self {
            d_over_tau: ratios.collect::<Option<_>>().unwrap_or_default(),
            pad_force_n: forces.collect(),
            worst_state: worst_state(recording),
            is_rigid: recording.deformation.contains(&None),
        }
    }

    /// The largest D over τ up to the state `index`.
    pub(super) fn peak_until(&self, index: usize) -> Option<f64> {
        self.d_over_tau.iter().take(index.saturating_add(1)).copied().reduce(f64::max)
    }

    /// Colour of the largest D over τ up to the state `index`.
    fn colour_until(&self, index: usize) -> Rgb8 {
        self.peak_until(index).map_or(TEXT, ratio_colour)
    }
}

/// An event of an episode, marked in the plot of D.
pub(super) struct EventMark {
    pub(super) name: &'static str,
    pub(super) time_s: f64,
}

/// The plots of one or several episodes.
pub(super) struct Plots<'a> {
    pub(super) episodes: &'a [EpisodeCurves],
    /// Names of the episodes, shown if there are several.
    pub(super) names: &'a [&'a str],
    /// Events, of which those up to the last state of the curves are shown.
    pub(super) events: &'a [EventMark],
    /// Control steps of the time axis.
    pub(super) steps: usize,
    /// Pixels of a unit of the layout.
    pub(super) unit: f32,
}

impl Plots<'_> {
    /// Draws the curves up to the state `index`. The plots begin at the height `top` and fill the width, pixels.
    pub(super) fn draw(&self, canvas: &mut Canvas, top: f32, width: f32, index: usize) {
        let px = |units: f32| units * self.unit;
        let has_names = self.episodes.len() > 1;
        let legend = if has_names { px(LEGEND) } else { 0.0 };
        let middle = D_PLOT_SHARE * (width - legend);
        let area = |from: f32, to: f32| PlotArea {
            left: from + px(PLOT_LEFT),
            right: to - px(PLOT_RIGHT),
            top: top + px(PLOT_TOP),
            bottom: top + px(PLOTS_HEIGHT - PLOT_BOTTOM),
            steps: self.steps.max(1),
            unit: self.unit,
        };
        self.draw_d_plot(canvas, &area(0.0, middle), index);
        if has_names {
            self.draw_names(canvas, [middle, top + px(PLOT_TOP + TITLE_SIZE)], index);
        }
        self.draw_force_plot(canvas, &area(middle + legend, width), index);
    }

    /// The names with the dashes of their curves, in the colour of the largest D so far.
    fn draw_names(&self, canvas: &mut Canvas, [left, top]: [f32; 2], index: usize) {
        let px = |units: f32| units * self.unit;
        for (number, (name, episode)) in self.names.iter().zip(self.episodes).enumerate() {
            let (y, colour) = (top + px(20.0) * number as f32, episode.colour_until(index));
            let (height, dash) = (y - px(4.0), px(DASHES[number % DASHES.len()]));
            canvas.line(&[[left, height], [left + px(26.0), height]], px(1.6), dash, colour);
            canvas.write(&shortened(name, NAME_LETTERS), left + px(30.0), y, px(TITLE_SIZE), colour);
        }
    }

    fn draw_d_plot(&self, canvas: &mut Canvas, area: &PlotArea, index: usize) {
        area.title(canvas, "D / limit τ");
        if self.episodes.iter().all(|episode| episode.d_over_tau.is_empty()) {
            let is_rigid = self.episodes.iter().all(|episode| episode.is_rigid);
            let text = if is_rigid { "rigid: no deformation" } else { "no limit τ" };
            area.axes(canvas);
            let [x, y] = [area.left + area.px(10.0), 0.5 * (area.top + area.bottom)];
            canvas.write(text, x, y, area.px(TITLE_SIZE), FAINT);
            return;
        }
        let limit = area.y(d_share(1.0));
        canvas.fill(area.left, area.top, area.right - area.left, limit - area.top, HARM, 0.12);
        area.axes(canvas);
        for tick in D_TICKS {
            let label = if tick == 1.0 { "τ".to_owned() } else { tick.to_string() };
            area.tick(canvas, d_share(tick), &label, if tick == 1.0 { HARM } else { FAINT });
        }
        canvas.line(&[[area.left, limit], [area.right, limit]], area.px(1.2), 0.0, HARM);
        let now_s = index as f64 * CONTROL_DT;
        for EventMark { name, time_s } in self.events.iter().filter(|event| event.time_s <= now_s) {
            let [x, _] = area.point((time_s / CONTROL_DT).round() as usize, 0.0);
            canvas.line(&[[x, area.top], [x, area.bottom]], area.px(0.8), area.px(2.0), FAINT);
            let width = canvas.text_width(name, area.px(TICK_SIZE));
            let right = (x + area.px(3.0)).min(area.right - width);
            canvas.fill(right, area.top, width, area.px(TICK_SIZE + 3.0), BACKGROUND, 0.6);
            canvas.write(name, right, area.top + area.px(TICK_SIZE), area.px(TICK_SIZE), TEXT);
        }
        let curve = |episode: &EpisodeCurves| {
            let point = |ratio: &f64| CurvePoint { share: d_share(*ratio), colour: ratio_colour(*ratio) };
            episode.d_over_tau.iter().take(index.saturating_add(1)).map(point).collect()
        };
        area.curves(canvas, self.episodes.iter().map(curve));
    }

    fn draw_force_plot(&self, canvas: &mut Canvas, area: &PlotArea, index: usize) {
        area.title(canvas, "pad force, N");
        area.axes(canvas);
        let forces = self.episodes.iter().flat_map(|episode| &episode.pad_force_n);
        let most = forces.copied().fold(1.0, f64::max);
        let step = tick_step(most, FORCE_TICKS);
        let top = step * (most / step).ceil();
        for tick in linear_ticks(0.0, top, FORCE_TICKS) {
            area.tick(canvas, tick / top, &tick_label(tick, step), FAINT);
        }
        let curve = |episode: &EpisodeCurves| {
            let point = |force: &f64| CurvePoint { share: force / top, colour: TEXT };
            episode.pad_force_n.iter().take(index.saturating_add(1)).map(point).collect()
        };
        area.curves(canvas, self.episodes.iter().map(curve));
    }
}

/// A point of a curve.
struct CurvePoint {
    /// Height between the ends of the axis, 0 to 1.
    share: f64,
    colour: Rgb8,
}

/// The area of a plot over time, pixels.
struct PlotArea {
    left: f32,
    right: f32,
    top: f32,
    bottom: f32,
    /// Control steps of the time axis.
    steps: usize,
    /// Pixels of a unit of the layout.
    unit: f32,
}

impl PlotArea {
    fn px(&self, units: f32) -> f32 {
        units * self.unit
    }

    /// Height of a share of the axis; values beyond are at its ends.
    fn y(&self, share: f64) -> f32 {
        self.bottom - share.clamp(0.0, 1.0) as f32 * (self.bottom - self.top)
    }

    /// Place of a value in the state `at`.
    fn point(&self, at: usize, share: f64) -> [f32; 2] {
        [self.left + (self.right - self.left) * at as f32 / self.steps as f32, self.y(share)]
    }

    fn title(&self, canvas: &mut Canvas, text: &str) {
        canvas.write(text, self.left, self.top - self.px(8.0), self.px(TITLE_SIZE), TEXT);
    }

    /// The axes, and the times below.
    fn axes(&self, canvas: &mut Canvas) {
        let corners = [[self.left, self.top], [self.left, self.bottom], [self.right, self.bottom]];
        canvas.line(&corners, self.px(0.8), 0.0, FAINT);
        let end = self.steps as f64 * CONTROL_DT;
        let step = tick_step(end, TIME_TICKS);
        for time in linear_ticks(0.0, end, TIME_TICKS) {
            let x = self.left + (self.right - self.left) * (time / end) as f32;
            let unit = if time == 0.0 { " s" } else { "" };
            let label = format!("{}{unit}", tick_label(time, step));
            let half = 0.5 * canvas.text_width(&label, self.px(TICK_SIZE));
            canvas.line(&[[x, self.bottom], [x, self.bottom + self.px(3.0)]], self.px(0.8), 0.0, FAINT);
            canvas.write(&label, x - half, self.bottom + self.px(14.0), self.px(TICK_SIZE), FAINT);
        }
    }

    /// A label of the vertical axis at a share of its height.
    fn tick(&self, canvas: &mut Canvas, share: f64, label: &str, colour: Rgb8) {
        let (size, y) = (self.px(TICK_SIZE), self.y(share));
        let width = canvas.text_width(label, size);
        canvas.line(&[[self.left - self.px(3.0), y], [self.left, y]], self.px(0.8), 0.0, FAINT);
        canvas.write(label, self.left - self.px(6.0) - width, y + 0.33 * size, size, colour);
    }

    /// Draws curves with their dashes.
    fn curves(&self, canvas: &mut Canvas, curves: impl Iterator<Item = Vec<CurvePoint>>) {
        for (number, points) in curves.enumerate() {
            let dash = self.px(DASHES[number % DASHES.len()]);
            // A part of the curve is as harmful as its worse end.
            let mut from = 0;
            for part in points.chunk_by(|a, b| a.colour == b.colour) {
                let (to, reach) = (from + part.len(), usize::from(part[0].colour == HARM));
                let states = from.saturating_sub(reach)..(to + reach).min(points.len());
                let line: Vec<[f32; 2]> = states.map(|at| self.point(at, points[at].share)).collect();
                canvas.line(&line, self.px(1.6), dash, part[0].colour);
                from = to;
            }
        }
    }
}
