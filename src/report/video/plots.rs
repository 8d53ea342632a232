//! Plots against time below the pictures of a video: D over its limit, and the force on the pads, with a curve per
//! episode.

use super::{COLOURS, pad_force, worst_state};
use softvt_benchmark::CONTROL_DT;
use softvt_common::text::shortened;
use softvt_media::{
    axis::{Axis, tick_step},
    canvas::{Canvas, Rgb8},
    chart::{Chart, ChartPoint, Curve, Frame, Mark},
    d_axis::d_axis,
    drawing::{Anchor, Area, Element, Font, Stroke, Tone, at, line, styled_text},
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
/// Share of the width without names that the plot of D over τ has; the force has the rest.
const D_PLOT_SHARE: f32 = 0.56;
/// Letters of a name between the plots.
const NAME_LETTERS: usize = 18;
/// Largest numbers of intervals of the axes.
const FORCE_TICKS: usize = 4;
const TIME_TICKS: usize = 5;
fn ratio_tone(ratio: f64) -> Tone {
    if ratio > 1.0 { Tone::Harm } else { Tone::Safe }
}

pub(super) fn ratio_colour(ratio: f64) -> Rgb8 {
    COLOURS.of(ratio_tone(ratio))
}

/// Values of the plots of an episode, by state.
pub(super) struct EpisodeCurves {
    /// D over τ; empty for rigid targets and without a limit.
    pub(super) d_over_tau: Vec<f64>,
    /// The larger normal force of the two pads, N.
    pub(super) pad_force_n: Vec<f64>,
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
    fn tone_until(&self, index: usize) -> Tone {
        self.peak_until(index).map_or(Tone::Ink, ratio_tone)
    }
}

/// An event of an episode, marked in the plot of D.
pub(super) struct EventMark {
    pub(super) name: &'static str,
    pub(super) time_s: f64,
}

pub(super) struct Plots<'a> {
    pub(super) episodes: Vec<&'a EpisodeCurves>,
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
        let frame = |from: f32, to: f32| Frame {
            area: Area {
                left: from + px(PLOT_LEFT),
                right: to - px(PLOT_RIGHT),
                top: top + px(PLOT_TOP),
                bottom: top + px(PLOTS_HEIGHT - PLOT_BOTTOM),
            },
            unit: self.unit,
        };
        let mut drawn = self.d_plot(&frame(0.0, middle), index);
        if has_names {
            drawn.extend(self.names([middle, top + px(PLOT_TOP + 12.0)], index));
        }
        drawn.extend(self.force_plot(&frame(middle + legend, width), index));
        canvas.draw(&drawn, self.unit, &COLOURS);
    }

    /// The names with the dashes of their curves, in the colour of the largest D so far.
    fn names(&self, [left, top]: [f32; 2], index: usize) -> Vec<Element> {
        let px = |units: f32| units * self.unit;
        let name = |(dash, (name, episode)): (usize, (&&str, &&EpisodeCurves))| {
            let (y, tone) = (top + px(20.0) * dash as f32, episode.tone_until(index));
            let (from, to) = (at(left, y - px(4.0)), at(left + px(26.0), y - px(4.0)));
            let (place, font) = (at(left + px(30.0), y), Font::Name(tone));
            let name = styled_text(place, Anchor::Start, font, shortened(name, NAME_LETTERS));
            [line(from, to, Stroke::Curve { tone, dash }), name]
        };
        self.names.iter().zip(&self.episodes).enumerate().flat_map(name).collect()
    }

    fn d_plot(&self, frame: &Frame, index: usize) -> Vec<Element> {
        let now_s = index as f64 * CONTROL_DT;
        let has_limit = self.episodes.iter().any(|episode| !episode.d_over_tau.is_empty());
        let mut marks = Vec::new();
        if has_limit {
            marks.extend([Mark::Above(1.0), Mark::Level { y: 1.0, label: String::new() }]);
            let events = self.events.iter().filter(|event| event.time_s <= now_s);
            marks.extend(events.map(|EventMark { name, time_s }| Mark::Event {
                x: (time_s / CONTROL_DT).round() * CONTROL_DT,
                label: (*name).to_owned(),
            }));
            marks.extend(self.curves(index, |episode| &episode.d_over_tau, ratio_tone));
        }
        let mut y = d_axis();
        y.ticks.retain(|_| has_limit);
        let mut drawn =
            Chart { title: "D / limit τ".to_owned(), x: self.time_axis(), y, marks }.elements(frame);
        if !has_limit {
            let is_rigid = self.episodes.iter().all(|episode| episode.is_rigid);
            let text = if is_rigid { "rigid: no deformation" } else { "no limit τ" };
            let Area { left, top, bottom, .. } = frame.area;
            let place = at(left + frame.px(10.0), 0.5 * (top + bottom));
            drawn.push(styled_text(place, Anchor::Start, Font::Name(Tone::Faint), text));
        }
        drawn
    }

    fn force_plot(&self, frame: &Frame, index: usize) -> Vec<Element> {
        let forces = self.episodes.iter().flat_map(|episode| &episode.pad_force_n);
        let most = forces.copied().fold(1.0, f64::max);
        let step = tick_step(most, FORCE_TICKS);
        let mut y = Axis::linear("", 0.0, step * (most / step).ceil(), FORCE_TICKS);
        y.ticks.iter_mut().for_each(|tick| tick.tone = Tone::Faint);
        let marks = self.curves(index, |episode| &episode.pad_force_n, |_| Tone::Ink);
        Chart { title: "pad force, N".to_owned(), x: self.time_axis(), y, marks }.elements(frame)
    }

    fn time_axis(&self) -> Axis {
        let mut axis = Axis::linear("", 0.0, self.steps.max(1) as f64 * CONTROL_DT, TIME_TICKS);
        axis.ticks.iter_mut().for_each(|tick| tick.tone = Tone::Faint);
        axis.ticks.iter_mut().take(1).for_each(|tick| tick.label += " s");
        axis
    }

    /// A curve with dashes of its own for each episode up to the state `index`, in parts of one colour.
    fn curves(
        &self,
        index: usize,
        values: impl Fn(&EpisodeCurves) -> &[f64],
        tone: impl Fn(f64) -> Tone,
    ) -> Vec<Mark> {
        let mut curves = Vec::new();
        for (dash, episode) in self.episodes.iter().enumerate() {
            let values = values(episode);
            let values = &values[..values.len().min(index.saturating_add(1))];
            let point =
                |state: usize| ChartPoint { x: state as f64 * CONTROL_DT, y: values[state], symbol: None };
            let mut from = 0;
            for part in values.chunk_by(|a, b| tone(*a) == tone(*b)) {
                let tone = tone(part[0]);
                // A part of the curve is as harmful as its worse end.
                let (to, reach) = (from + part.len(), usize::from(tone == Tone::Harm));
                let states = from.saturating_sub(reach)..(to + reach).min(values.len());
                let (name, stroke) = (String::new(), Some(Stroke::Curve { tone, dash }));
                curves.push(Mark::Curve(Curve { name, points: states.map(point).collect(), stroke }));
                from = to;
            }
        }
        curves
    }
}
