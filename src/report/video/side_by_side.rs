//! Videos of one episode under several policies, on one clock: a column per policy with its verdict and the target
//! from nearby, and below them D over its limit and the force of the pads, a curve per policy.
//!
//! The shorter episodes hold their last state until the longest ends.

use std::{path::Path, time::Duration};

use image::RgbImage;

use super::{
    BACKGROUND, Badge, CLOSE_UP_EDGE, EpisodeVideoError, FAINT, FrameList, LAST_STATE_S, Moment,
    SharedSensors, TEXT, VideoCaption, draw_label,
    plots::{EpisodeCurves, PLOTS_HEIGHT, Plots},
};
use softvt_benchmark::CONTROL_DT;
use softvt_common::{files::replace, parallel, text::shortened};
use softvt_media::{animation, canvas::Canvas};
use softvt_rollout::{CloseUp, StateRecording};
use softvt_runs::record::EpisodeRecord;
use softvt_sensing::camera::{encode_png, resize};

/// Width of a column in units of the layout, in which the sizes of texts and plots are stated.
const COLUMN: f32 = 320.0;
/// Heights in units of the layout: the heading of a column, the line below its panel, and the caption.
const HEADING: f32 = 60.0;
const READING: f32 = 28.0;
const CAPTION: f32 = 44.0;
/// Sizes of texts, units.
const NAME_SIZE: f32 = 17.0;
const BADGE_SIZE: f32 = 14.0;
const TEXT_SIZE: f32 = 13.0;
const PANEL_NAME_SIZE: f32 = 12.0;
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

    fn curves(&self) -> EpisodeCurves {
        EpisodeCurves::new(&self.recording)
    }
}

/// Number of states of the longest episode, each of which is a frame of the video.
pub fn state_count(episodes: &[PolicyEpisode]) -> usize {
    episodes.iter().map(|episode| episode.recording.frames.len()).max().unwrap_or(0)
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
    let frames = FrameList { size: context.layout.size(), count, draw: |index| context.frame_at(index) };
    frames.encode(path, threads, is_cancelled, on_frame)
}

/// Writes a picture of the episodes as a PNG file: each in the state that shows its result best, with the final verdict
/// and the whole curves.
///
/// # Errors
/// A state cannot be rendered, or the file cannot be written.
pub fn write_decisive_frame(episodes: &mut [PolicyEpisode], path: &Path) -> Result<(), EpisodeVideoError> {
    let column = video_column(episodes.len());
    let frame = FrameContext::new(episodes, column)?.decisive_frame()?;
    Ok(replace(path, encode_png(&frame)?)?)
}

/// Width of a column of an animation, pixels, and the control steps between two of its frames.
const ANIMATION_COLUMN: u32 = 320;
const ANIMATION_STEPS: usize = 4;
/// Speed of an animation over that of the episode.
const ANIMATION_SPEED: f64 = 2.0;

/// Renders the episodes as an animated PNG file for web pages, at twice their speed, in which the last state is held.
/// Where pictures do not move, the file shows the picture of [`write_decisive_frame`]. Other arguments and errors are
/// those of [`write_video`].
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
    let draw = |number: usize| context.frame_at(indices[number]);
    parallel::run_in_order(indices.len(), threads, &is_cancelled, draw, |_, frame| {
        frames.push(frame);
        Ok::<_, EpisodeVideoError>(())
    })?;
    // A request to stop ends the frames early.
    if frames.len() < indices.len() {
        return Err(EpisodeVideoError::Interrupted);
    }
    let each = Duration::from_secs_f64(ANIMATION_STEPS as f64 * CONTROL_DT / ANIMATION_SPEED);
    let still = context.decisive_frame()?;
    Ok(replace(path, animation::encode(&still, &frames, each, Duration::from_secs_f64(LAST_STATE_S))?)?)
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
    curves: Vec<EpisodeCurves>,
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
        let height = self.plots_top() + self.px(PLOTS_HEIGHT + CAPTION);
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
            curves: episodes.iter().map(PolicyEpisode::curves).collect(),
            episodes,
            sensors,
        })
    }

    /// The frame of the state `index` of the longest episode.
    fn frame_at(&self, index: usize) -> Result<RgbImage, EpisodeVideoError> {
        let moments: Vec<Moment> =
            self.episodes.iter().map(|episode| Moment::at(&episode.recording, index)).collect();
        self.frame(&moments, index, &format!("{:.2} s", index as f64 * CONTROL_DT))
    }

    fn decisive_frame(&self) -> Result<RgbImage, EpisodeVideoError> {
        let decisive = |PolicyEpisode { recording, caption, .. }: &_| Moment::decisive(recording, caption);
        let moments: Vec<Moment> = self.episodes.iter().map(decisive).collect();
        self.frame(&moments, usize::MAX, "the moment of the result")
    }

    /// Draws a moment of each episode, and the curves up to the state `index`.
    fn frame(&self, moments: &[Moment], index: usize, when: &str) -> Result<RgbImage, EpisodeVideoError> {
        let [width, height] = self.layout.size();
        let mut canvas = Canvas::new(width, height, BACKGROUND);
        for (column, moment) in moments.iter().enumerate() {
            self.draw_column(&mut canvas, column, *moment)?;
        }
        let names: Vec<&str> = self.episodes.iter().map(|episode| episode.policy.as_str()).collect();
        let plots = Plots {
            episodes: &self.curves,
            names: &names,
            events: &[],
            steps: state_count(self.episodes).saturating_sub(1),
            unit: self.layout.px(1.0),
        };
        plots.draw(&mut canvas, self.layout.plots_top(), width as f32, index);
        self.draw_caption(&mut canvas, when);
        Ok(canvas.to_image())
    }

    fn draw_column(
        &self,
        canvas: &mut Canvas,
        column: usize,
        moment: Moment,
    ) -> Result<(), EpisodeVideoError> {
        let PolicyEpisode { recording, caption, policy, .. } = &self.episodes[column];
        let frame = recording.frames.get(moment.state).ok_or(EpisodeVideoError::Empty)?;
        let (layout, edge) = (self.layout, self.layout.column);
        let left = column as u32 * edge;
        let (x, px) = (left as f32 + layout.px(10.0), |units| layout.px(units));
        canvas.write(&shortened(policy, 34), x, px(20.0), px(NAME_SIZE), TEXT);
        Badge::new(recording, caption, &self.curves[column], moment).draw(
            canvas,
            x,
            px(28.0),
            px(BADGE_SIZE),
        );
        let settled = recording.frames.first().ok_or(EpisodeVideoError::Empty)?;
        let seen = CloseUp { edge: CLOSE_UP_EDGE.min(edge as usize), settled };
        let close_up =
            self.sensors[column].lend(|sensors| sensors.close_up(frame, recording.target, seen))?;
        canvas.place(&resize(&close_up, edge, edge), left, layout.panel_top());
        if column == 0 {
            draw_label(canvas, caption.close_up_name(), left, layout.panel_top(), px(PANEL_NAME_SIZE));
        }
        let force = self.curves[column].pad_force_n.get(moment.state).copied().unwrap_or(0.0);
        let y = layout.reading_top() + px(19.0);
        let end = canvas.write(&format!("pad force {force:.2} N"), x, y, px(TEXT_SIZE), TEXT);
        if let Some((text, colour)) = moment.ratio(&self.curves[column]) {
            canvas.write(&text, end + px(18.0), y, px(TEXT_SIZE), colour);
        }
        Ok(())
    }

    fn draw_caption(&self, canvas: &mut Canvas, when: &str) {
        let Some(PolicyEpisode { caption, place, .. }) = self.episodes.first() else { return };
        let px = |units| self.layout.px(units);
        let top = self.layout.plots_top() + px(PLOTS_HEIGHT);
        canvas.write(&caption.prompt, px(10.0), top + px(16.0), px(TEXT_SIZE), TEXT);
        // A single column is too narrow for it.
        let red =
            if self.episodes.len() > 1 { " · red: beyond the stable strain of the material" } else { "" };
        let text = format!("{place} · {when}{red}");
        canvas.write(&text, px(10.0), top + px(34.0), px(12.0), FAINT);
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
            assert!(layout.plots_top() + layout.px(PLOTS_HEIGHT + CAPTION) <= height as f32 + 1.0);
        }
    }
}
