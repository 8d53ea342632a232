//! Videos of one episode under several policies, on one clock: a column per policy with its verdict and the target
//! from nearby, and below them D over its limit and the force of the pads, a curve per policy.
//!
//! The shorter episodes hold their last state until the longest ends.

use image::RgbImage;

use super::{
    BACKGROUND, Badge, CLOSE_UP_EDGE, EpisodeVideoError, FAINT, Film, FilmedEpisode, FrameSource, Moment,
    TEXT, draw_label, place,
    plots::{PLOTS_HEIGHT, Plots},
};
use softvt_benchmark::CONTROL_DT;
use softvt_common::text::shortened;
use softvt_media::canvas::Canvas;
use softvt_sensing::camera::resize;

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

pub(super) fn video_column(policies: usize) -> u32 {
    match policies {
        0..=2 => 512,
        3 => 432,
        _ => 384,
    }
}

/// The frames of one episode under several policies.
pub(super) struct Columns<'a> {
    films: Vec<Film<'a>>,
    layout: Layout,
}

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

impl FrameSource for Columns<'_> {
    fn size(&self) -> [u32; 2] {
        self.layout.size()
    }

    fn count(&self) -> usize {
        self.films.iter().map(|film| film.recording.frames.len()).max().unwrap_or(0)
    }

    fn frame_at(&self, index: usize) -> Result<RgbImage, EpisodeVideoError> {
        let at = |film: &Film| Moment::at(film.recording, index);
        self.frame(at, index, &format!("{:.2} s", index as f64 * CONTROL_DT))
    }

    fn decisive_frame(&self) -> Result<RgbImage, EpisodeVideoError> {
        self.frame(|film| film.decisive_moment(), usize::MAX, "the moment of the result")
    }
}

impl<'a> Columns<'a> {
    /// Columns of this width, pixels.
    pub(super) fn new(episodes: &'a mut [FilmedEpisode], column: u32) -> Result<Self, EpisodeVideoError> {
        let films: Vec<Film> = episodes.iter_mut().map(Film::new).collect::<Result<_, _>>()?;
        Ok(Self { layout: Layout { columns: films.len() as u32, column }, films })
    }

    /// Draws a moment of each episode, and the curves up to the state `index`.
    fn frame(
        &self,
        moment: impl Fn(&Film) -> Moment,
        index: usize,
        when: &str,
    ) -> Result<RgbImage, EpisodeVideoError> {
        let [width, height] = self.layout.size();
        let mut canvas = Canvas::new(width, height, BACKGROUND);
        for (column, film) in self.films.iter().enumerate() {
            self.draw_column(&mut canvas, column, film, moment(film))?;
        }
        let names: Vec<&str> = self.films.iter().map(|film| film.record.header.policy.as_str()).collect();
        let plots = Plots {
            episodes: self.films.iter().map(|film| &film.curves).collect(),
            names: &names,
            events: &[],
            steps: self.count().saturating_sub(1),
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
        film: &Film,
        moment: Moment,
    ) -> Result<(), EpisodeVideoError> {
        let frame = film.state(moment.state)?;
        let (layout, edge) = (self.layout, self.layout.column);
        let left = column as u32 * edge;
        let (x, px) = (left as f32 + layout.px(10.0), |units| layout.px(units));
        canvas.write(&shortened(&film.record.header.policy, 34), x, px(20.0), px(NAME_SIZE), TEXT);
        Badge::new(film, moment).draw(canvas, x, px(28.0), px(BADGE_SIZE));
        let seen_edge = CLOSE_UP_EDGE.min(edge as usize);
        let close_up = film.sensors.lend(|sensors| film.close_up(sensors, frame, seen_edge))?;
        canvas.place(&resize(&close_up, edge, edge), left, layout.panel_top());
        if column == 0 {
            draw_label(canvas, film.close_up_name(), left, layout.panel_top(), px(PANEL_NAME_SIZE));
        }
        let force = film.curves.pad_force_n.get(moment.state).copied().unwrap_or(0.0);
        let y = layout.reading_top() + px(19.0);
        let end = canvas.write(&format!("pad force {force:.2} N"), x, y, px(TEXT_SIZE), TEXT);
        if let Some((text, colour)) = moment.ratio(&film.curves) {
            canvas.write(&text, end + px(18.0), y, px(TEXT_SIZE), colour);
        }
        Ok(())
    }

    fn draw_caption(&self, canvas: &mut Canvas, when: &str) {
        let Some(Film { record, .. }) = self.films.first() else { return };
        let px = |units| self.layout.px(units);
        let top = self.layout.plots_top() + px(PLOTS_HEIGHT);
        canvas.write(&record.header.prompt, px(10.0), top + px(16.0), px(TEXT_SIZE), TEXT);
        // A single column is too narrow for it.
        let red = if self.films.len() > 1 { " · red: beyond the stable strain of the material" } else { "" };
        let text = format!("{} · {when}{red}", place(record));
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
