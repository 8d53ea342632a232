//! Videos and still images of episodes: of one, the third-person camera and the target from nearby on top, the wrist
//! camera and both fingers below them, and at the bottom plots of the deformation over its limit and of the force; of
//! one under several policies, a column per policy.

mod plots;
mod side_by_side;

use std::{
    path::{Path, PathBuf},
    sync::Mutex,
    time::Duration,
};

use image::{ImageBuffer, ImageError, Luma, RgbImage};

use plots::{EpisodeCurves, EventMark, PLOTS_HEIGHT, Plots, ratio_colour};
use side_by_side::Columns;
use softvt_benchmark::{CONTROL_DT, CONTROL_HZ};
use softvt_common::episode_id::EpisodeIndex;
use softvt_common::{
    files::{FileError, replace},
    parallel::{self, lock},
};
use softvt_evaluation::category::EpisodeCategory;
use softvt_media::{
    animation::{self, AnimationError},
    canvas::{Canvas, CanvasColours, Rgb8},
    video::{VideoError, VideoWriter},
};
use softvt_physics::world::WorldSnapshot;
use softvt_rollout::{
    CAMERA_IMAGE_SUFFIXES, CloseUp, SensingError, Sensors, StateRecording, TACTILE_IMAGE_SUFFIXES,
    TACTILE_IMAGES,
};
use softvt_runs::record::EpisodeRecord;
use softvt_scene::{Camera, STANDARD_CAMERAS};
use softvt_sensing::{
    camera::{RenderedImage, encode_png, resize},
    tactile::{MarkerStyle, TactileReading},
};

/// Edge of the panels on top, pixels: the third-person camera, and the target from nearby.
const TOP_PANEL: u32 = 512;
/// Edge of the image of the target, which is drawn larger: it costs as much as the other two.
const CLOSE_UP_EDGE: usize = 384;
/// Edge of the panel of the wrist camera, pixels.
const WRIST_PANEL: u32 = 384;
/// Size of the finger panels, pixels, as of the sensors' images.
const FINGER_WIDTH: u32 = 320;
const FINGER_HEIGHT: u32 = 240;
/// Size of the panels with the change of the fingers' images, pixels.
const CHANGE_WIDTH: u32 = 148;
const CHANGE_HEIGHT: u32 = 111;
/// Height of the lines of text above the plots, pixels.
const CAPTION_HEIGHT: u32 = 60;
/// Pixels of a unit of the plots.
const PLOT_UNIT: f32 = 1.25;
const WIDTH: u32 = 2 * TOP_PANEL;
const HEIGHT: u32 =
    (TOP_PANEL + WRIST_PANEL + CAPTION_HEIGHT + (PLOT_UNIT * PLOTS_HEIGHT) as u32).next_multiple_of(2);
const MARGIN: f32 = 16.0;
/// Size of a still image, pixels.
pub(crate) const STILL_SIZE: [u32; 2] = [WIDTH, HEIGHT];
/// Left edge, upper edge and size of the panel that shows the target from nearby, pixels.
pub(crate) const TARGET_PANEL: [u32; 3] = [TOP_PANEL, 0, TOP_PANEL];
/// Time after a drop at which the object is seen on its way, s.
const AFTER_DROP_S: f64 = 0.2;
/// Time for which a video shows the last state, with the verdict, s.
const LAST_STATE_S: f64 = 1.5;
/// Name of a still of the target from nearby.
pub(crate) const CLOSE_UP_STILL: &str = "object";
/// Edges of images in full size, pixels.
const THIRD_PERSON_FULL_SIZE: usize = 1024;
const OTHER_FULL_SIZE: usize = 512;

const BACKGROUND: Rgb8 = [22, 24, 28];
const TEXT: Rgb8 = [226, 229, 233];
const FAINT: Rgb8 = [122, 128, 138];
// Colours of the palette in docs/looks.md on dark ground.
const SAFE: Rgb8 = [86, 180, 233];
const HARM: Rgb8 = [255, 138, 61];
const DROPPED: Rgb8 = [204, 121, 167];
const MISSED: Rgb8 = [154, 161, 171];
const COLOURS: CanvasColours =
    CanvasColours { ink: TEXT, faint: FAINT, safe: SAFE, harm: HARM, ground: BACKGROUND };

/// Why a video or still image cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum EpisodeVideoError {
    #[error(transparent)]
    Sensing(#[from] SensingError),
    #[error(transparent)]
    Video(#[from] VideoError),
    #[error(transparent)]
    Animation(#[from] AnimationError),
    #[error("cannot encode the image: {0}")]
    Png(#[from] ImageError),
    #[error(transparent)]
    File(#[from] FileError),
    #[error("the rollout has no states to be drawn")]
    Empty,
    #[error("interrupted")]
    Interrupted,
}

/// An episode to be drawn.
pub struct FilmedEpisode<'a> {
    pub record: &'a EpisodeRecord,
    pub states: &'a mut StateRecording,
}

/// An episode with what its frames need.
struct Film<'a> {
    record: &'a EpisodeRecord,
    recording: &'a StateRecording,
    sensors: SharedSensors,
    curves: EpisodeCurves,
}

impl<'a> Film<'a> {
    fn new(FilmedEpisode { record, states }: &'a mut FilmedEpisode) -> Result<Self, EpisodeVideoError> {
        let sensors = SharedSensors::new(&mut states.sensors)?;
        Ok(Self { record, curves: EpisodeCurves::new(states), recording: states, sensors })
    }

    fn state(&self, index: usize) -> Result<&'a WorldSnapshot, EpisodeVideoError> {
        self.recording.frames.get(index).ok_or(EpisodeVideoError::Empty)
    }

    /// The target from nearby.
    fn close_up(
        &self,
        sensors: &mut Sensors,
        frame: &WorldSnapshot,
        edge: usize,
    ) -> Result<RgbImage, EpisodeVideoError> {
        let seen = CloseUp { edge, settled: self.state(0)? };
        Ok(sensors.close_up(frame, self.recording.target, seen)?)
    }

    /// Name of the panel that shows the target from nearby.
    fn close_up_name(&self) -> &'static str {
        if self.record.verdict.object().soft { "object, red: beyond stable strain" } else { "object" }
    }

    fn is_crushed(&self) -> bool {
        self.record.crushed_volume_pct().is_some()
    }

    /// Time of the drop, s.
    fn drop_s(&self) -> Option<f64> {
        self.record.verdict.drop.map(|event| event.time_s)
    }

    /// The state that shows the result best: the drop, the end of a goal that was missed, or the worst one.
    fn decisive_moment(&self) -> Moment {
        let last = self.recording.frames.len().saturating_sub(1);
        let state = match self.record.category() {
            EpisodeCategory::Dropped => {
                let seconds = self.drop_s().unwrap_or(f64::MAX) + AFTER_DROP_S;
                ((seconds / CONTROL_DT).round() as usize).min(last)
            }
            EpisodeCategory::GoalMissed => last,
            _ => self.curves.worst_state,
        };
        Moment { state, is_final: true }
    }
}

/// Content of a frame: a state of the episode with the verdict until then, or with the final one.
#[derive(Clone, Copy, Debug)]
struct Moment {
    state: usize,
    is_final: bool,
}

impl Moment {
    /// The state `index`; the last one, with the final verdict, if the episode has ended before.
    fn at(recording: &StateRecording, index: usize) -> Self {
        let last = recording.frames.len().saturating_sub(1);
        Self { state: index.min(last), is_final: index >= last }
    }

    /// The state up to which curves are drawn.
    fn end_of_curves(self) -> usize {
        if self.is_final { usize::MAX } else { self.state }
    }

    /// D over its limit in words, with its colour: the state's, or the largest one with the final verdict and
    /// once that is above the limit and D is not.
    fn ratio(self, curves: &EpisodeCurves) -> Option<(String, Rgb8)> {
        let now = *curves.d_over_tau.get(self.state)?;
        let peak = curves.peak_until(self.end_of_curves())?;
        let (word, ratio) =
            if self.is_final || peak > 1.0 && now <= 1.0 { ("peak D", peak) } else { ("D", now) };
        Some((format!("{word} {ratio:.2} × limit"), ratio_colour(ratio)))
    }
}

/// The frames of a video, which are drawn one by one.
trait FrameSource: Sync {
    /// Width and height, pixels.
    fn size(&self) -> [u32; 2];

    /// Number of frames: the states of the longest episode.
    fn count(&self) -> usize;

    fn frame_at(&self, index: usize) -> Result<RgbImage, EpisodeVideoError>;

    /// The frame with each episode in the state that shows its result best, the final verdict and the whole curves.
    fn decisive_frame(&self) -> Result<RgbImage, EpisodeVideoError>;
}

/// The frames of one episode, or of several side by side.
fn frame_source<'a>(
    episodes: &'a mut [FilmedEpisode],
) -> Result<Box<dyn FrameSource + 'a>, EpisodeVideoError> {
    if episodes.len() == 1 {
        return Ok(Box::new(Panels::new(Film::new(&mut episodes[0])?)?));
    }
    let column = side_by_side::video_column(episodes.len());
    Ok(Box::new(Columns::new(episodes, column)?))
}

/// Renders every state of the longest episode and writes the video, one frame per control step. The shorter episodes
/// hold their last state. The frames are drawn on up to `threads` threads; `on_frame` is called after each.
///
/// If `is_cancelled` becomes true, no file is written.
///
/// # Errors
/// A state cannot be rendered, the file cannot be written, or the call was cancelled.
pub fn write_video(
    episodes: &mut [FilmedEpisode],
    path: &Path,
    threads: usize,
    is_cancelled: impl Fn() -> bool + Sync,
    mut on_frame: impl FnMut(),
) -> Result<(), EpisodeVideoError> {
    if is_cancelled() {
        return Err(EpisodeVideoError::Interrupted);
    }
    let source = frame_source(episodes)?;
    let ([width, height], count) = (source.size().map(|edge| edge as usize), source.count());
    let (mut video, mut drawn) = (VideoWriter::new(width, height, CONTROL_HZ)?, 0);
    let held = (LAST_STATE_S * f64::from(CONTROL_HZ)) as usize;
    draw_in_order(
        count,
        threads,
        is_cancelled,
        |index| source.frame_at(index),
        |frame| {
            drawn += 1;
            let copies = if drawn == count { 1 + held } else { 1 };
            (0..copies).try_for_each(|_| video.push(&frame))?;
            on_frame();
            Ok(())
        },
    )?;
    Ok(video.save(path)?)
}

/// Writes a picture of the episodes as a PNG file: each in the state that shows its result best, with the final verdict
/// and the whole curves.
///
/// # Errors
/// The state cannot be rendered, or the file cannot be written.
pub fn write_decisive_frame(episodes: &mut [FilmedEpisode], path: &Path) -> Result<(), EpisodeVideoError> {
    let frame = frame_source(episodes)?.decisive_frame()?;
    Ok(replace(path, encode_png(&frame)?)?)
}

/// Width of a column of an animation, pixels, and the control steps between two of its frames.
const ANIMATION_COLUMN: u32 = 320;
const ANIMATION_STEPS: usize = 4;
/// Speed of an animation over the episode's.
const ANIMATION_SPEED: f64 = 2.0;

/// Renders the episodes side by side as an animated PNG file for web pages, at twice their speed, in which the last
/// state is held. Programs without animations show the picture of [`write_decisive_frame`]. Other arguments are those
/// of [`write_video`].
pub fn write_animation(
    episodes: &mut [FilmedEpisode],
    path: &Path,
    threads: usize,
    is_cancelled: impl Fn() -> bool + Sync,
) -> Result<(), EpisodeVideoError> {
    let source = Columns::new(episodes, ANIMATION_COLUMN)?;
    let last = source.count().saturating_sub(1);
    let indices: Vec<usize> = (0..last).step_by(ANIMATION_STEPS).chain([last]).collect();
    let mut frames = Vec::new();
    draw_in_order(
        indices.len(),
        threads,
        is_cancelled,
        |number| source.frame_at(indices[number]),
        |frame| {
            frames.push(frame);
            Ok(())
        },
    )?;
    let each = Duration::from_secs_f64(ANIMATION_STEPS as f64 * CONTROL_DT / ANIMATION_SPEED);
    let still = source.decisive_frame()?;
    Ok(replace(path, animation::encode(&still, &frames, each, Duration::from_secs_f64(LAST_STATE_S))?)?)
}

/// Draws numbered images on up to `threads` threads, and passes them to `take` in their order.
fn draw_in_order<T: Send>(
    count: usize,
    threads: usize,
    is_cancelled: impl Fn() -> bool + Sync,
    draw: impl Fn(usize) -> Result<T, EpisodeVideoError> + Sync,
    mut take: impl FnMut(T) -> Result<(), EpisodeVideoError>,
) -> Result<(), EpisodeVideoError> {
    let mut taken = 0;
    parallel::run_in_order(count, threads, is_cancelled, draw, |_, image| {
        taken += 1;
        take(image)
    })?;
    // A request to stop ends the images early.
    if taken < count { Err(EpisodeVideoError::Interrupted) } else { Ok(()) }
}

/// Sensors of several threads, which share their meshes and have their own working memory.
pub(crate) struct SharedSensors {
    original: Sensors,
    idle: Mutex<Vec<Sensors>>,
}

impl SharedSensors {
    pub(crate) fn new(sensors: &mut Sensors) -> Result<Self, SensingError> {
        // The copies share the meshes from here on.
        sensors.render_scene()?;
        Ok(Self { original: sensors.clone(), idle: Mutex::default() })
    }

    /// Lends sensors that no other thread uses to `work`.
    pub(crate) fn lend<T>(&self, work: impl FnOnce(&mut Sensors) -> T) -> T {
        let taken = lock(&self.idle).pop();
        let mut sensors = taken.unwrap_or_else(|| self.original.clone());
        let result = work(&mut sensors);
        lock(&self.idle).push(sensors);
        result
    }
}

/// The frames of one episode.
struct Panels<'a> {
    film: Film<'a>,
    events: Vec<EventMark>,
    /// The images of the fingers in the settled state.
    fingers_at_rest: Vec<RgbImage>,
}

impl FrameSource for Panels<'_> {
    fn size(&self) -> [u32; 2] {
        STILL_SIZE
    }

    fn count(&self) -> usize {
        self.film.recording.frames.len()
    }

    fn frame_at(&self, index: usize) -> Result<RgbImage, EpisodeVideoError> {
        self.frame(Moment::at(self.film.recording, index))
    }

    fn decisive_frame(&self) -> Result<RgbImage, EpisodeVideoError> {
        self.frame(self.film.decisive_moment())
    }
}

impl<'a> Panels<'a> {
    fn new(film: Film<'a>) -> Result<Self, EpisodeVideoError> {
        let settled = film.state(0)?;
        let at_rest = film.sensors.lend(|sensors| sensors.tactile_readings(settled))?;
        let fingers_at_rest = at_rest.into_iter().map(|reading| reading.image).collect();
        Ok(Self { events: events(&film), film, fingers_at_rest })
    }

    fn frame(&self, moment: Moment) -> Result<RgbImage, EpisodeVideoError> {
        let Film { recording, sensors, curves, .. } = &self.film;
        let mut canvas = Canvas::new(WIDTH, HEIGHT, BACKGROUND);
        let frame = self.film.state(moment.state)?;
        sensors.lend(|sensors| {
            self.draw_cameras(&mut canvas, sensors, frame)?;
            self.draw_fingers(&mut canvas, sensors, frame)
        })?;
        let (x, y) = (WRIST_PANEL as f32 + MARGIN, (TOP_PANEL + FINGER_HEIGHT) as f32);
        Badge::new(&self.film, moment).draw(&mut canvas, x, y + 20.0, 16.0);
        if let Some((text, colour)) = moment.ratio(curves) {
            canvas.write(&text, x, y + 92.0, 24.0, colour);
        }
        draw_caption(&mut canvas, self.film.record, moment);
        let plots = Plots {
            episodes: vec![curves],
            names: &[],
            events: &self.events,
            steps: recording.frames.len().saturating_sub(1),
            unit: PLOT_UNIT,
        };
        let top = TOP_PANEL + WRIST_PANEL + CAPTION_HEIGHT;
        plots.draw(&mut canvas, top as f32, WIDTH as f32, moment.end_of_curves());
        Ok(canvas.to_image())
    }

    fn draw_cameras(
        &self,
        canvas: &mut Canvas,
        sensors: &mut Sensors,
        frame: &WorldSnapshot,
    ) -> Result<(), EpisodeVideoError> {
        let seen = |sensors: &mut Sensors, name: &str, edge: u32| -> Result<RgbImage, EpisodeVideoError> {
            let camera = sensors.camera(name)?.clone().with_edge(edge as usize);
            Ok(sensors.render_rgb(frame, &camera)?.into_rgb_image())
        };
        canvas.place(&seen(sensors, STANDARD_CAMERAS[0], TOP_PANEL)?, 0, 0);
        draw_label(canvas, "third person", 0, 0, PANEL_NAME_SIZE);
        let close_up = self.film.close_up(sensors, frame, CLOSE_UP_EDGE)?;
        canvas.place(&resize(&close_up, TOP_PANEL, TOP_PANEL), TOP_PANEL, 0);
        draw_label(canvas, self.film.close_up_name(), TOP_PANEL, 0, PANEL_NAME_SIZE);
        canvas.place(&seen(sensors, STANDARD_CAMERAS[1], WRIST_PANEL)?, 0, TOP_PANEL);
        draw_label(canvas, "wrist", 0, TOP_PANEL, PANEL_NAME_SIZE);
        Ok(())
    }

    /// Draws the images of the fingers with the motion of their markers, and below them the change
    /// since the settled state.
    fn draw_fingers(
        &self,
        canvas: &mut Canvas,
        sensors: &mut Sensors,
        frame: &WorldSnapshot,
    ) -> Result<(), EpisodeVideoError> {
        let (gap, top) = (8, TOP_PANEL + FINGER_HEIGHT + 12);
        let left = WIDTH - 2 * (CHANGE_WIDTH + gap);
        let readings = sensors.tactile_readings(frame)?;
        for (side, (reading, at_rest)) in readings.iter().zip(&self.fingers_at_rest).enumerate() {
            let name = format!("{} finger, {:.2} N", ["left", "right"][side], pad_force(frame, side));
            let (image, x) =
                (reading.with_markers(MarkerStyle::Arrows), WRIST_PANEL + FINGER_WIDTH * side as u32);
            canvas.place(&resize(&image, FINGER_WIDTH, FINGER_HEIGHT), x, TOP_PANEL);
            draw_label(canvas, &name, x, TOP_PANEL, PANEL_NAME_SIZE);
            let change = amplified_change(&reading.image, at_rest);
            let x = left + (CHANGE_WIDTH + gap) * side as u32;
            canvas.place(&resize(&change, CHANGE_WIDTH, CHANGE_HEIGHT), x, top);
        }
        let below = (top + CHANGE_HEIGHT) as f32 + 16.0;
        canvas.write("change of the images since the start, × 4", left as f32, below, 13.0, FAINT);
        Ok(())
    }
}

/// The difference of two images, four times as large, around medium grey.
fn amplified_change(image: &RgbImage, at_rest: &RgbImage) -> RgbImage {
    let mut change = image.clone();
    for (now, before) in change.iter_mut().zip(at_rest.iter()) {
        *now = (128 + 4 * (i32::from(*now) - i32::from(*before))).clamp(0, 255) as u8;
    }
    change
}

/// Sum of the normal forces on a pad, N.
fn pad_force(frame: &WorldSnapshot, side: usize) -> f64 {
    let points = frame.patches.get(side).into_iter().flat_map(|patch| &patch.points);
    // Without the negative zero of an empty sum.
    points.map(|point| point.pressure * point.area).sum::<f64>() + 0.0
}

/// Index of the first state up to `index` at which D is above τ.
fn first_over_limit(recording: &StateRecording, index: usize) -> Option<usize> {
    recording.deformation.iter().take(index + 1).position(|of| of.is_some_and(|of| of.is_over()))
}

/// Times at which the object was grasped, released and dropped.
fn events(film: &Film) -> Vec<EventMark> {
    let recording = film.recording;
    let is_held = |frame: &WorldSnapshot| (0..2).all(|side| pad_force(frame, side) > 0.0);
    let held = recording.frames.iter().position(is_held);
    let released = recording.frames.iter().rposition(is_held).map(|last| last + 1);
    let is_kept = released == Some(recording.frames.len());
    let time = |state: usize| state as f64 * CONTROL_DT;
    let all = [
        ("grasp", held.map(time)),
        ("release", released.filter(|_| !is_kept && film.drop_s().is_none()).map(time)),
        ("drop", film.drop_s()),
    ];
    all.into_iter().filter_map(|(name, time_s)| Some(EventMark { name, time_s: time_s? })).collect()
}

/// A verdict in words, and the colour of its ground.
struct Badge {
    text: String,
    colour: Rgb8,
}

impl Badge {
    fn new(film: &Film, moment: Moment) -> Self {
        let Film { record, recording, curves, .. } = film;
        if moment.is_final {
            let colour = match record.category() {
                _ if film.is_crushed() => HARM,
                EpisodeCategory::Safe => SAFE,
                EpisodeCategory::OverLimit => HARM,
                EpisodeCategory::Dropped | EpisodeCategory::Slipped => DROPPED,
                EpisodeCategory::GoalMissed | EpisodeCategory::NotJudged | EpisodeCategory::Invalid => MISSED,
            };
            let collapsed = record.crushed_volume_pct().map(|pct| format!(": {pct:.0} % collapsed"));
            return Self { text: record.result_and_harm() + &collapsed.unwrap_or_default(), colour };
        }
        let now_s = moment.state as f64 * CONTROL_DT;
        let is_crushed = film.is_crushed() && moment.state >= curves.worst_state;
        let over = first_over_limit(recording, moment.state).map(|at| match is_crushed {
            true => "crushed".to_owned(),
            false => format!("over the limit at {:.2} s", at as f64 * CONTROL_DT),
        });
        let dropped = film.drop_s().filter(|at| *at <= now_s).map(|at| format!("dropped at {at:.2} s"));
        let has_limit = recording.deformation.iter().flatten().any(|of| of.tau_pct.is_some());
        let (text, colour) = match (over, dropped) {
            (Some(over), Some(dropped)) => {
                (format!("{over}, {dropped}"), if is_crushed { HARM } else { DROPPED })
            }
            (Some(over), None) => (over, HARM),
            (None, Some(dropped)) => (dropped, DROPPED),
            (None, None) if !record.has_soft_target() => ("not dropped so far".to_owned(), SAFE),
            (None, None) if !has_limit => ("no limit of the deformation".to_owned(), FAINT),
            (None, None) => ("within the limit so far".to_owned(), SAFE),
        };
        Self { text, colour }
    }

    /// Draws the badge with text of this size; (x, y) is its upper left corner.
    fn draw(&self, canvas: &mut Canvas, x: f32, y: f32, size: f32) {
        let width = canvas.text_width(&self.text, size);
        canvas.fill(x, y, width + size * 4.0 / 3.0, 2.0 * size, self.colour, 1.0);
        canvas.write(&self.text, x + size * 2.0 / 3.0, y + 1.375 * size, size, BACKGROUND);
    }
}

/// Size of the names of panels, pixels.
const PANEL_NAME_SIZE: f32 = 19.0;

/// Draws the name of a panel in its corner, with letters of this size.
fn draw_label(canvas: &mut Canvas, name: &str, x: u32, y: u32, size: f32) {
    let (x, y) = (x as f32, y as f32);
    let width = canvas.text_width(name, size);
    canvas.fill(x + 8.0, y + 8.0, width + 16.0, size + 7.0, [0, 0, 0], 0.8);
    canvas.write(name, x + 16.0, y + 8.0 + size, size, [255, 255, 255]);
}

fn draw_caption(canvas: &mut Canvas, record: &EpisodeRecord, moment: Moment) {
    let top = (TOP_PANEL + WRIST_PANEL) as f32;
    canvas.write(&record.header.prompt, MARGIN, top + 28.0, 20.0, TEXT);
    let (place, policy) = (place(record), &record.header.policy);
    let time_s = moment.state as f64 * CONTROL_DT;
    canvas.write(&format!("{place} · {policy} · {time_s:.2} s"), MARGIN, top + 52.0, 16.0, FAINT);
}

/// Suite, task and episode.
pub(crate) fn place(record: &EpisodeRecord) -> String {
    let id = &record.header.id;
    format!("{} · task {} · episode {}", id.suite, id.task, id.episode)
}

/// Path of an episode's video in a run folder.
pub fn video_path(dir: &Path, index: EpisodeIndex) -> PathBuf {
    let EpisodeIndex { task, episode } = index;
    dir.join(format!("video/task_{task:03}/episode_{episode:05}.mp4"))
}

/// Path in a run folder of the picture of an episode that [`write_decisive_frame`] writes.
pub fn still_path(dir: &Path, index: EpisodeIndex) -> PathBuf {
    video_path(dir, index).with_extension("png")
}

/// Index of the state with the largest deformation of a target; of rigid targets, with the largest force on the pads.
pub fn worst_state(recording: &StateRecording) -> usize {
    let pad_forces = |frame: &WorldSnapshot| pad_force(frame, 0) + pad_force(frame, 1);
    let severity = |at: usize| match recording.deformation[at] {
        Some(of) => [of.ratio().unwrap_or_default(), of.d_pct],
        None => [0.0, pad_forces(&recording.frames[at])],
    };
    let compare = |[a, d]: [f64; 2], [b, e]: [f64; 2]| a.total_cmp(&b).then(d.total_cmp(&e));
    let states = 0..recording.frames.len().min(recording.deformation.len());
    // The first one of equals.
    states.max_by(|&a, &b| compare(severity(a), severity(b)).then(b.cmp(&a))).unwrap_or(0)
}

fn full_size(camera: &Camera) -> usize {
    if camera.name == STANDARD_CAMERAS[0] { THIRD_PERSON_FULL_SIZE } else { OTHER_FULL_SIZE }
}

/// Writes every image of selected states as PNG files in `dir`; `states` are names and indices of states.
///
/// Cameras also get depth (16 bits, units of 0.1 mm along the optical axis, 65535 beyond the range and in the
/// background) and segmentation (16 bits: objects from 1 in the order of the scene,
/// [`softvt_scene::ROBOT_SEGMENTATION_ID`], 0 in the background). They are drawn on up to `threads` threads. Files are
/// written atomically. Returns their paths.
///
/// # Errors
/// A state cannot be rendered, a file cannot be written, or `is_cancelled` became true between two files.
pub fn write_stills(
    recording: &mut StateRecording,
    states: &[(&str, usize)],
    is_full_size: bool,
    dir: &Path,
    threads: usize,
    is_cancelled: impl Fn() -> bool + Sync,
) -> Result<Vec<PathBuf>, EpisodeVideoError> {
    let shared = SharedSensors::new(&mut recording.sensors)?;
    let (recording, cameras) = (&*recording, shared.original.cameras().to_vec());
    // In each state the images of every camera, then the target from nearby, then the images of the fingers.
    let per_state = cameras.len() + 2;
    let close_up_edge = if is_full_size { OTHER_FULL_SIZE } else { CLOSE_UP_EDGE };
    let draw = |job: usize| {
        let (state, index) = states[job / per_state];
        let frame = recording.frames.get(index).ok_or(EpisodeVideoError::Empty)?;
        let named = |source: &str, suffix: &str| dir.join(format!("{state}_{source}{suffix}.png"));
        let mut drawn = Vec::new();
        match cameras.get(job % per_state) {
            Some(camera) => {
                let edge = full_size(camera);
                let seen = if is_full_size { camera.clone().with_edge(edge) } else { camera.clone() };
                let image = shared.lend(|sensors| sensors.render(frame, &seen))?;
                for (suffix, png) in CAMERA_IMAGE_SUFFIXES.into_iter().zip(encode_camera_image(image)?) {
                    drawn.push(Still { path: named(&camera.name, suffix), png });
                }
            }
            None if job % per_state == cameras.len() => {
                let seen = CloseUp { edge: close_up_edge, settled: &recording.frames[0] };
                let image = shared.lend(|sensors| sensors.close_up(frame, recording.target, seen))?;
                drawn.push(Still { path: named(CLOSE_UP_STILL, ""), png: encode_png(&image)? });
            }
            None => {
                let readings = shared.lend(|sensors| sensors.tactile_readings(frame))?;
                for (name, reading) in TACTILE_IMAGES.into_iter().zip(&readings) {
                    for (suffix, image) in TACTILE_IMAGE_SUFFIXES.into_iter().zip(tactile_images(reading)) {
                        drawn.push(Still { path: named(name, suffix), png: encode_png(&image)? });
                    }
                }
            }
        }
        Ok(drawn)
    };
    let mut written = Vec::new();
    draw_in_order(states.len() * per_state, threads, &is_cancelled, draw, |stills| {
        for Still { path, png } in stills {
            if is_cancelled() {
                return Err(EpisodeVideoError::Interrupted);
            }
            replace(&path, png)?;
            written.push(path);
        }
        Ok(())
    })?;
    Ok(written)
}

struct Still {
    path: PathBuf,
    png: Vec<u8>,
}

/// Encodes colour, depth and segmentation, in the order of [`CAMERA_IMAGE_SUFFIXES`].
fn encode_camera_image(mut image: RenderedImage) -> Result<[Vec<u8>; 3], EpisodeVideoError> {
    let luma = |values: Vec<u16>| {
        ImageBuffer::<Luma<u16>, _>::from_raw(image.width as u32, image.height as u32, values)
            .unwrap_or_default()
    };
    let tenths_of_mm = |depth: &f32| (1e4 * depth).min(f32::from(u16::MAX)).round() as u16;
    let depth = encode_png(&luma(image.depth.iter().map(tenths_of_mm).collect()))?;
    let segmentation = encode_png(&luma(std::mem::take(&mut image.segmentation)))?;
    Ok([encode_png(&image.into_rgb_image())?, depth, segmentation])
}

/// The images of a finger without markers, with dots and with arrows, in the order of [`TACTILE_IMAGE_SUFFIXES`].
fn tactile_images(reading: &TactileReading) -> [RgbImage; 3] {
    let drawn = |style| reading.with_markers(style);
    [reading.image.clone(), drawn(MarkerStyle::Dots), drawn(MarkerStyle::Arrows)]
}
