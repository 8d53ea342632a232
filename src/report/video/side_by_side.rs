//! Videos of one episode under several policies, on one clock: a column per policy with its verdict and the target
//! from nearby, and below them D over its limit and the force of the pads, a curve per policy.
//!
//! The shorter episodes hold their last state until the longest ends.

use std::{path::Path, time::Duration};

use image::RgbImage;

use super::{
    BACKGROUND, Badge, CLOSE_UP_EDGE, EpisodeVideoError, FAINT, FrameList, HARM, LAST_STATE_S, SAFE,
    SharedSensors, TEXT, VideoCaption, draw_label, pad_force, worst_state,
};
use crate::d_axis::{D_TICKS, d_share};
use softvt_benchmark::CONTROL_DT;
use softvt_common::{files::replace, parallel, text::shortened};
use softvt_media::{
    animation,
    canvas::{Canvas, Rgb8},
    labels::spread,
    ticks::{linear_ticks, tick_label, tick_step},
};
use softvt_records::record::EpisodeRecord;
use softvt_rollout::{CloseUp, StateRecording};
use softvt_sensing::camera::{encode_png, resize};

/// Width of a column in units of the layout, in which the sizes of texts and plots are stated.
const COLUMN: f32 = 320.0;
/// Heights in units of the layout: the heading of a column, the line below its panel, the plots, and the caption.
const HEADING: f32 = 60.0;
const READING: f32 = 28.0;
const PLOTS: f32 = 156.0;
const CAPTION: f32 = 44.0;
/// Margins of a plot around its plotting area, units.
const PLOT_LEFT: f32 = 34.0;
const PLOT_RIGHT: f32 = 96.0;
const PLOT_TOP: f32 = 24.0;
const PLOT_BOTTOM: f32 = 20.0;
/// Share of the width that the plot of D over τ has; the rest is that of the force.
const D_PLOT_SHARE: f32 = 0.56;
/// Sizes of texts, units.
const NAME_SIZE: f32 = 17.0;
const BADGE_SIZE: f32 = 14.0;
const TEXT_SIZE: f32 = 13.0;
const PANEL_NAME_SIZE: f32 = 12.0;
/// Dashes of the curves of the policies in turn, units; 0 is a solid line.
const DASHES: [f32; 4] = [0.0, 5.0, 1.5, 10.0];
/// Letters of a policy's name at the end of its curve.
const LABEL_LETTERS: usize = 15;
/// Largest numbers of intervals of the axes.
const FORCE_TICKS: usize = 4;
const TIME_TICKS: usize = 5;

/// One episode under one of several policies.
pub struct PolicyEpisode {
    policy: String,
    /// Suite, task and episode.
    place: String,
    caption: VideoCaption,
    recording: StateRecording,
}

impl PolicyEpisode {
    /// A finished episode with its states.
    pub fn new(record: &EpisodeRecord, recording: StateRecording) -> Self {
        let id = &record.header.id;
        Self {
            policy: record.header.policy.clone(),
            place: format!("{} · task {} · episode {}", id.suite, id.task, id.episode),
            caption: VideoCaption::new(record),
            recording,
        }
    }

    /// D over τ in every state; none for a rigid target or without a limit.
    fn d_over_tau(&self) -> Vec<f64> {
        let tau = self.caption.tau_pct.filter(|tau| *tau > 0.0);
        let ratios = self.recording.worst_d_pct.iter().map(|d| Some((*d)? / tau?));
        ratios.collect::<Option<_>>().unwrap_or_default()
    }

    /// The larger normal force of the two pads in every state, N.
    fn pad_forces(&self) -> Vec<f64> {
        let frames = self.recording.frames.iter();
        // Without the negative zero of an empty sum.
        frames.map(|frame| pad_force(frame, 0).max(pad_force(frame, 1)) + 0.0).collect()
    }
}

/// Number of states of the longest episode, each of which is a frame of the video.
pub fn state_count(episodes: &[PolicyEpisode]) -> usize {
    episodes.iter().map(|episode| episode.recording.frames.len()).max().unwrap_or(0)
}

/// Index of the worst state of all episodes, as [`worst_state`] defines it for one.
pub fn worst_moment(episodes: &[PolicyEpisode]) -> usize {
    let worst = episodes.iter().map(|episode| {
        let (at, ratios) = (worst_state(&episode.recording), episode.d_over_tau());
        (at, ratios.get(at).copied().unwrap_or_else(|| episode.pad_forces().get(at).copied().unwrap_or(0.0)))
    });
    // The first one of equals.
    worst.reduce(|a, b| if b.1 > a.1 { b } else { a }).map_or(0, |(at, _)| at)
}

/// Renders every state of the longest episode and writes the video, one frame per control step. The frames are drawn on
/// up to `threads` threads; `on_frame` is called after each.
///
/// If `is_cancelled` becomes true, no file is written.
///
/// # Errors
/// A state cannot be rendered, the file cannot be written, or the call was cancelled.
pub fn write_video(
    episodes: &mut [PolicyEpisode],
    path: &Path,
    threads: usize,
    is_cancelled: impl Fn() -> bool + Sync,
    on_frame: impl FnMut(),
) -> Result<(), EpisodeVideoError> {
    let count = state_count(episodes);
    let context = FrameContext::new(episodes, video_column(episodes.len()))?;
    let frames = FrameList { size: context.layout.size(), count, draw: |index| context.frame(index) };
    frames.encode(path, threads, is_cancelled, on_frame)
}

/// Writes one frame of the video as a PNG file.
///
/// # Errors
/// The state cannot be rendered, or the file cannot be written.
pub fn write_video_frame(
    episodes: &mut [PolicyEpisode],
    index: usize,
    path: &Path,
) -> Result<(), EpisodeVideoError> {
    let column = video_column(episodes.len());
    let frame = FrameContext::new(episodes, column)?.frame(index)?;
    Ok(replace(path, encode_png(&frame)?)?)
}

/// Width of a column of an animation, pixels, and the control steps between two of its frames.
const ANIMATION_COLUMN: u32 = 320;
const ANIMATION_STEPS: usize = 4;
/// Speed of an animation over that of the episode.
const ANIMATION_SPEED: f64 = 2.0;

/// Renders the episodes as an animated PNG file for web pages, at twice their speed, in which the last state is held.
/// Other arguments and errors are those of [`write_video`].
///
/// # Errors
/// As [`write_video`].
pub fn write_animation(
    episodes: &mut [PolicyEpisode],
    path: &Path,
    threads: usize,
    is_cancelled: impl Fn() -> bool + Sync,
) -> Result<(), EpisodeVideoError> {
    let last = state_count(episodes).saturating_sub(1);
    let indices: Vec<usize> = (0..last).step_by(ANIMATION_STEPS).chain([last]).collect();
    let context = FrameContext::new(episodes, ANIMATION_COLUMN)?;
    let mut frames = Vec::new();
    let draw = |number: usize| context.frame(indices[number]);
    parallel::run_in_order(indices.len(), threads, &is_cancelled, draw, |_, frame| {
        frames.push(frame);
        Ok::<_, EpisodeVideoError>(())
    })?;
    // A request to stop ends the frames early.
    if frames.len() < indices.len() {
        return Err(EpisodeVideoError::Interrupted);
    }
    let each = Duration::from_secs_f64(ANIMATION_STEPS as f64 * CONTROL_DT / ANIMATION_SPEED);
    Ok(replace(path, animation::encode(&frames, each, Duration::from_secs_f64(LAST_STATE_S))?)?)
}

/// Width of a column of a video, pixels.
fn video_column(policies: usize) -> u32 {
    match policies {
        0..=2 => 512,
        3 => 432,
        _ => 384,
    }
}

/// Everything that all frames share.
struct FrameContext<'a> {
    episodes: &'a [PolicyEpisode],
    sensors: Vec<SharedSensors>,
    layout: Layout,
    d_over_tau: Vec<Vec<f64>>,
    pad_force_n: Vec<Vec<f64>>,
}

/// Sizes of a frame.
#[derive(Clone, Copy)]
struct Layout {
    columns: u32,
    /// Width of a column, pixels.
    column: u32,
}

impl Layout {
    /// Pixels of a length in units.
    fn px(self, units: f32) -> f32 {
        units * self.column as f32 / COLUMN
    }

    /// Top of the line below the panels, pixels.
    fn reading_top(self) -> f32 {
        self.panel_top() as f32 + self.column as f32
    }

    fn panel_top(self) -> u32 {
        self.px(HEADING).round() as u32
    }

    fn plots_top(self) -> f32 {
        self.reading_top() + self.px(READING)
    }

    /// Width and height, pixels; even, as videos must be.
    fn size(self) -> [u32; 2] {
        let height = self.plots_top() + self.px(PLOTS + CAPTION);
        [self.columns * self.column, height.round() as u32].map(|edge| edge.next_multiple_of(2))
    }
}

impl<'a> FrameContext<'a> {
    fn new(episodes: &'a mut [PolicyEpisode], column: u32) -> Result<Self, EpisodeVideoError> {
        let sensors = episodes.iter_mut().map(|episode| SharedSensors::new(&mut episode.recording.sensors));
        let sensors = sensors.collect::<Result<_, _>>()?;
        let episodes = &*episodes;
        Ok(Self {
            layout: Layout { columns: episodes.len() as u32, column },
            d_over_tau: episodes.iter().map(PolicyEpisode::d_over_tau).collect(),
            pad_force_n: episodes.iter().map(PolicyEpisode::pad_forces).collect(),
            episodes,
            sensors,
        })
    }

    fn frame(&self, index: usize) -> Result<RgbImage, EpisodeVideoError> {
        let [width, height] = self.layout.size();
        let mut canvas = Canvas::new(width, height, BACKGROUND);
        for column in 0..self.episodes.len() {
            self.draw_column(&mut canvas, column, index)?;
        }
        self.draw_plots(&mut canvas, index);
        self.draw_caption(&mut canvas, index);
        Ok(canvas.to_image())
    }

    fn draw_column(&self, canvas: &mut Canvas, column: usize, index: usize) -> Result<(), EpisodeVideoError> {
        let PolicyEpisode { recording, caption, policy, .. } = &self.episodes[column];
        let index = index.min(recording.frames.len().saturating_sub(1));
        let frame = recording.frames.get(index).ok_or(EpisodeVideoError::Empty)?;
        let (layout, edge) = (self.layout, self.layout.column);
        let left = column as u32 * edge;
        let (x, px) = (left as f32 + layout.px(10.0), |units| layout.px(units));
        canvas.write(&shortened(policy, 34), x, px(20.0), px(NAME_SIZE), TEXT);
        Badge::new(recording, caption, index).draw(canvas, x, px(28.0), px(BADGE_SIZE));
        let settled = recording.frames.first().ok_or(EpisodeVideoError::Empty)?;
        let seen = CloseUp { edge: CLOSE_UP_EDGE.min(edge as usize), settled };
        let close_up =
            self.sensors[column].lend(|sensors| sensors.close_up(frame, recording.target, seen))?;
        canvas.place(&resize(&close_up, edge, edge), left, layout.panel_top());
        if column == 0 {
            let name = "object by strain";
            draw_label(canvas, name, left, layout.panel_top(), px(PANEL_NAME_SIZE));
        }
        let force = self.pad_force_n[column].get(index).copied().unwrap_or(0.0);
        let y = layout.reading_top() + px(19.0);
        let end = canvas.write(&format!("pad force {force:.2} N"), x, y, px(TEXT_SIZE), TEXT);
        if let Some(ratio) = self.d_over_tau[column].get(index) {
            let text = format!("D {ratio:.2} × limit");
            canvas.write(&text, end + px(18.0), y, px(TEXT_SIZE), colour(*ratio));
        }
        Ok(())
    }

    fn draw_plots(&self, canvas: &mut Canvas, index: usize) {
        let (px, width) = (|units| self.layout.px(units), self.layout.size()[0] as f32);
        let top = self.layout.plots_top();
        let area = |from: f32, to: f32| PlotArea {
            left: from + px(PLOT_LEFT),
            right: to - px(PLOT_RIGHT),
            top: top + px(PLOT_TOP),
            bottom: top + px(PLOTS - PLOT_BOTTOM),
            steps: state_count(self.episodes).saturating_sub(1).max(1),
            layout: self.layout,
        };
        let middle = D_PLOT_SHARE * width;
        self.draw_d_plot(canvas, &area(0.0, middle), index);
        self.draw_force_plot(canvas, &area(middle, width), index);
    }

    fn draw_d_plot(&self, canvas: &mut Canvas, area: &PlotArea, index: usize) {
        area.title(canvas, "D / limit τ");
        if self.d_over_tau.iter().all(Vec::is_empty) {
            let rigid = self.episodes.iter().all(|episode| episode.recording.worst_d_pct.contains(&None));
            let text = if rigid { "rigid: no deformation" } else { "no limit τ" };
            area.axes(canvas);
            area.write(canvas, text, [area.left + area.layout.px(10.0), 0.5 * (area.top + area.bottom)]);
            return;
        }
        let limit = area.y(d_share(1.0));
        canvas.fill(area.left, area.top, area.right - area.left, limit - area.top, HARM, 0.12);
        area.axes(canvas);
        for tick in D_TICKS {
            let label = if tick == 1.0 { "τ".to_owned() } else { tick.to_string() };
            area.tick(canvas, d_share(tick), &label, if tick == 1.0 { HARM } else { FAINT });
        }
        canvas.line(&[[area.left, limit], [area.right, limit]], area.layout.px(1.2), 0.0, HARM);
        let curve = |ratios: &Vec<f64>| {
            ratios.iter().map(|ratio| CurvePoint { share: d_share(*ratio), colour: colour(*ratio) }).collect()
        };
        let curves: Vec<Vec<CurvePoint>> = self.d_over_tau.iter().map(curve).collect();
        self.draw_curves(canvas, area, index, &curves);
    }

    fn draw_force_plot(&self, canvas: &mut Canvas, area: &PlotArea, index: usize) {
        area.title(canvas, "pad force, N");
        area.axes(canvas);
        let most = self.pad_force_n.iter().flatten().copied().fold(1.0, f64::max);
        let step = tick_step(most, FORCE_TICKS);
        let top = step * (most / step).ceil();
        for tick in linear_ticks(0.0, top, FORCE_TICKS) {
            area.tick(canvas, tick / top, &tick_label(tick, step), FAINT);
        }
        let curve = |forces: &Vec<f64>| {
            forces.iter().map(|force| CurvePoint { share: force / top, colour: TEXT }).collect()
        };
        let curves: Vec<Vec<CurvePoint>> = self.pad_force_n.iter().map(curve).collect();
        self.draw_curves(canvas, area, index, &curves);
    }

    /// Draws a curve per policy up to the state `index`, with the policy's name at its end.
    fn draw_curves(&self, canvas: &mut Canvas, area: &PlotArea, index: usize, curves: &[Vec<CurvePoint>]) {
        let mut labels = Vec::new();
        for (column, points) in curves.iter().enumerate() {
            let shown = &points[..points.len().min(index + 1)];
            let dash = area.layout.px(DASHES[column % DASHES.len()]);
            // A part of the curve is as harmful as its worse end.
            let mut from = 0;
            for part in shown.chunk_by(|a, b| a.colour == b.colour) {
                let (to, reach) = (from + part.len(), usize::from(part[0].colour == HARM));
                let states = from.saturating_sub(reach)..(to + reach).min(shown.len());
                let line: Vec<[f32; 2]> = states.map(|at| area.point(at, shown[at].share)).collect();
                canvas.line(&line, area.layout.px(1.6), dash, part[0].colour);
                from = to;
            }
            if let Some(end) = shown.last() {
                let [x, y] = area.point(shown.len() - 1, end.share);
                labels.push(Label { policy: column, x, y, colour: end.colour });
            }
        }
        labels.sort_by(|a, b| a.y.total_cmp(&b.y));
        let mut heights: Vec<&mut f32> = labels.iter_mut().map(|label| &mut label.y).collect();
        spread(&mut heights, area.layout.px(14.0), [area.top, area.bottom - area.layout.px(6.0)]);
        for Label { policy, x, y, colour } in labels {
            let name = shortened(&self.episodes[policy].policy, LABEL_LETTERS);
            let (size, gap) = (area.layout.px(12.0), area.layout.px(4.0));
            canvas.write(&name, x + gap, y + 0.33 * size, size, colour);
        }
    }

    fn draw_caption(&self, canvas: &mut Canvas, index: usize) {
        let Some(PolicyEpisode { caption, place, .. }) = self.episodes.first() else { return };
        let px = |units| self.layout.px(units);
        let top = self.layout.plots_top() + px(PLOTS);
        canvas.write(&caption.prompt, px(10.0), top + px(16.0), px(TEXT_SIZE), TEXT);
        let time = index as f64 * CONTROL_DT;
        let text = format!("{place} · {time:.2} s · red: beyond the stable strain of the material");
        canvas.write(&text, px(10.0), top + px(34.0), px(12.0), FAINT);
    }
}

/// Colour of D over τ.
fn colour(ratio: f64) -> Rgb8 {
    if ratio > 1.0 { HARM } else { SAFE }
}

/// A point of a curve.
struct CurvePoint {
    /// Height between the ends of the axis, 0 to 1.
    share: f64,
    colour: Rgb8,
}

/// The name of a policy at the end of its curve, pixels.
struct Label {
    policy: usize,
    x: f32,
    y: f32,
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
    layout: Layout,
}

impl PlotArea {
    /// Height of a share of the axis; values beyond are at its ends.
    fn y(&self, share: f64) -> f32 {
        self.bottom - share.clamp(0.0, 1.0) as f32 * (self.bottom - self.top)
    }

    /// Place of a value in the state `at`.
    fn point(&self, at: usize, share: f64) -> [f32; 2] {
        [self.left + (self.right - self.left) * at as f32 / self.steps as f32, self.y(share)]
    }

    fn title(&self, canvas: &mut Canvas, text: &str) {
        let px = |units| self.layout.px(units);
        canvas.write(text, self.left, self.top - px(8.0), px(12.0), TEXT);
    }

    fn write(&self, canvas: &mut Canvas, text: &str, [x, y]: [f32; 2]) {
        canvas.write(text, x, y, self.layout.px(12.0), FAINT);
    }

    /// The axes, and the times below.
    fn axes(&self, canvas: &mut Canvas) {
        let px = |units| self.layout.px(units);
        let corners = [[self.left, self.top], [self.left, self.bottom], [self.right, self.bottom]];
        canvas.line(&corners, px(0.8), 0.0, FAINT);
        let end = self.steps as f64 * CONTROL_DT;
        let step = tick_step(end, TIME_TICKS);
        for time in linear_ticks(0.0, end, TIME_TICKS) {
            let x = self.left + (self.right - self.left) * (time / end) as f32;
            let unit = if time == 0.0 { " s" } else { "" };
            let label = format!("{}{unit}", tick_label(time, step));
            let half = 0.5 * canvas.text_width(&label, px(11.0));
            canvas.line(&[[x, self.bottom], [x, self.bottom + px(3.0)]], px(0.8), 0.0, FAINT);
            canvas.write(&label, x - half, self.bottom + px(14.0), px(11.0), FAINT);
        }
    }

    /// A label of the vertical axis at a share of its height.
    fn tick(&self, canvas: &mut Canvas, share: f64, label: &str, colour: Rgb8) {
        let (size, y) = (self.layout.px(11.0), self.y(share));
        let width = canvas.text_width(label, size);
        canvas.line(&[[self.left - self.layout.px(3.0), y], [self.left, y]], self.layout.px(0.8), 0.0, FAINT);
        canvas.write(label, self.left - self.layout.px(6.0) - width, y + 0.33 * size, size, colour);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_even_sizes_that_videos_can_have() {
        for columns in 1..=4 {
            let layout = Layout { columns, column: video_column(columns as usize) };
            let [width, height] = layout.size();
            assert!(width.is_multiple_of(2) && height.is_multiple_of(2) && width <= 1536 && height <= 1200);
            assert!(layout.plots_top() + layout.px(PLOTS + CAPTION) <= height as f32 + 1.0);
        }
    }
}
