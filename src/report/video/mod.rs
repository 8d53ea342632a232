//! Videos and still images of episodes: the third-person camera and the target from nearby on top, the wrist camera
//! and both fingers below them, and the deformation over its limit at the bottom. Those of one episode under several
//! policies are in [`side_by_side`].

pub mod side_by_side;

use std::{
    path::{Path, PathBuf},
    sync::Mutex,
};

use image::{ImageBuffer, ImageError, Luma, RgbImage};

use softvt_benchmark::{CONTROL_DT, CONTROL_HZ};
use softvt_common::episode_id::EpisodeIndex;
use softvt_common::{
    files::{FileError, replace},
    parallel::{self, lock},
};
use softvt_evaluation::category::EpisodeCategory;
use softvt_media::{
    animation::AnimationError,
    canvas::{Canvas, Rgb8},
    video::{VideoError, VideoWriter},
};
use softvt_physics::world::WorldSnapshot;
use softvt_records::record::EpisodeRecord;
use softvt_rollout::{
    CAMERA_IMAGE_SUFFIXES, CloseUp, SensingError, Sensors, StateRecording, TACTILE_IMAGE_SUFFIXES,
    TACTILE_IMAGES,
};
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
/// Size of the finger panels beside it, pixels: that of the sensors' images.
const FINGER_WIDTH: u32 = 320;
const FINGER_HEIGHT: u32 = 240;
/// Height of the caption at the bottom, pixels.
const CAPTION_HEIGHT: u32 = 160;
const WIDTH: u32 = 2 * TOP_PANEL;
const HEIGHT: u32 = TOP_PANEL + WRIST_PANEL + CAPTION_HEIGHT;
const MARGIN: f32 = 16.0;
/// Size of a still image, pixels.
pub(crate) const STILL_SIZE: [u32; 2] = [WIDTH, HEIGHT];
/// Left edge, upper edge and size of the panel that shows the target from nearby, pixels.
pub(crate) const TARGET_PANEL: [u32; 3] = [TOP_PANEL, 0, TOP_PANEL];
/// Time for which a video shows the last state, with the verdict, s.
const LAST_STATE_S: f64 = 1.5;
/// Edges of images in full size, pixels.
const THIRD_PERSON_FULL_SIZE: usize = 1024;
const OTHER_FULL_SIZE: usize = 512;

const BACKGROUND: Rgb8 = [22, 24, 28];
const TEXT: Rgb8 = [226, 229, 233];
const FAINT: Rgb8 = [122, 128, 138];
/// Blue and vermilion of Okabe and Ito's palette, which most people tell apart, lightened for the dark background.
const SAFE: Rgb8 = [86, 180, 233];
const HARM: Rgb8 = [255, 138, 61];

/// Why a video or still image cannot be written.
#[allow(missing_docs, reason = "the messages describe the variants")]
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

/// Text below the panels of a video.
#[derive(Clone, Debug)]
pub struct VideoCaption {
    prompt: String,
    episode: String,
    verdict: String,
    /// Limit τ on the deformation, %.
    tau_pct: Option<f64>,
    is_safe: bool,
}

impl VideoCaption {
    /// Describes a finished episode.
    pub fn new(record: &EpisodeRecord) -> Self {
        let (header, verdict) = (&record.header, &record.verdict);
        let id = &header.id;
        let category = record.category();
        let word = match category {
            EpisodeCategory::Safe if !header.soft => "placed without a drop",
            category => category.name(),
        };
        Self {
            prompt: header.prompt.clone(),
            episode: format!("{} · task {} · episode {} · {}", id.suite, id.task, id.episode, header.policy),
            verdict: word.to_owned(),
            tau_pct: verdict.tau,
            is_safe: verdict.safety,
        }
    }
}

/// Renders every state of a recording and writes the video, one frame per control step. The frames are drawn on up to
/// `threads` threads; `on_frame` is called after each.
///
/// If `is_cancelled` becomes true, no file is written.
///
/// # Errors
/// A state cannot be rendered, the file cannot be written, or the call was cancelled.
pub fn write_video(
    recording: &mut StateRecording,
    caption: &VideoCaption,
    path: &Path,
    threads: usize,
    is_cancelled: impl Fn() -> bool + Sync,
    on_frame: impl FnMut(),
) -> Result<(), EpisodeVideoError> {
    if is_cancelled() {
        return Err(EpisodeVideoError::Interrupted);
    }
    let shared = SharedSensors::new(&mut recording.sensors)?;
    let recording = &*recording;
    let draw = |index: usize| shared.lend(|sensors| video_frame(sensors, recording, caption, index));
    let frames = FrameList { size: [WIDTH, HEIGHT], count: recording.frames.len(), draw };
    frames.encode(path, threads, is_cancelled, on_frame)
}

/// The frames of a video, which are drawn one by one.
struct FrameList<D> {
    /// Width and height, pixels.
    size: [u32; 2],
    count: usize,
    /// Draws the frame of an index.
    draw: D,
}

impl<D: Fn(usize) -> Result<RgbImage, EpisodeVideoError> + Sync> FrameList<D> {
    /// Draws the frames on up to `threads` threads and writes the video, in which the last frame is held.
    fn encode(
        self,
        path: &Path,
        threads: usize,
        is_cancelled: impl Fn() -> bool + Sync,
        mut on_frame: impl FnMut(),
    ) -> Result<(), EpisodeVideoError> {
        let [width, height] = self.size.map(|edge| edge as usize);
        let (mut video, mut drawn) = (VideoWriter::new(width, height, CONTROL_HZ)?, 0);
        let held = (LAST_STATE_S * f64::from(CONTROL_HZ)) as usize;
        parallel::run_in_order(self.count, threads, &is_cancelled, &self.draw, |_, frame| {
            video.push(&frame)?;
            drawn += 1;
            if drawn == self.count {
                (0..held).try_for_each(|_| video.push(&frame))?;
            }
            on_frame();
            Ok::<_, EpisodeVideoError>(())
        })?;
        // A request to stop ends the frames early.
        if drawn < self.count { Err(EpisodeVideoError::Interrupted) } else { Ok(video.save(path)?) }
    }
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

/// Writes one frame of the video as a PNG file.
///
/// # Errors
/// The state cannot be rendered, or the file cannot be written.
pub fn write_video_frame(
    recording: &mut StateRecording,
    caption: &VideoCaption,
    index: usize,
    path: &Path,
) -> Result<(), EpisodeVideoError> {
    recording.sensors.render_scene()?;
    let frame = video_frame(&mut recording.sensors.clone(), recording, caption, index)?;
    Ok(replace(path, encode_png(&frame)?)?)
}

fn video_frame(
    sensors: &mut Sensors,
    recording: &StateRecording,
    caption: &VideoCaption,
    index: usize,
) -> Result<RgbImage, EpisodeVideoError> {
    let mut canvas = Canvas::new(WIDTH, HEIGHT, BACKGROUND);
    let frame = recording.frames.get(index).ok_or(EpisodeVideoError::Empty)?;
    let seen = |sensors: &mut Sensors, name: &str, edge: u32| -> Result<RgbImage, EpisodeVideoError> {
        let camera = sensors.camera(name)?.clone().with_edge(edge as usize);
        Ok(sensors.render_rgb(frame, &camera)?.into_rgb_image())
    };
    canvas.place(&seen(sensors, STANDARD_CAMERAS[0], TOP_PANEL)?, 0, 0);
    draw_label(&mut canvas, "third person", 0, 0, PANEL_NAME_SIZE);
    let close_up = sensors.close_up(
        frame,
        recording.target,
        CloseUp { edge: CLOSE_UP_EDGE, settled: &recording.frames[0] },
    )?;
    canvas.place(&resize(&close_up, TOP_PANEL, TOP_PANEL), TOP_PANEL, 0);
    draw_label(&mut canvas, "object by strain", TOP_PANEL, 0, PANEL_NAME_SIZE);
    canvas.place(&seen(sensors, STANDARD_CAMERAS[1], WRIST_PANEL)?, 0, TOP_PANEL);
    draw_label(&mut canvas, "wrist", 0, TOP_PANEL, PANEL_NAME_SIZE);
    for (side, reading) in sensors.tactile_readings(frame)?.iter().enumerate() {
        let image = reading.with_markers(MarkerStyle::Arrows);
        let x = WRIST_PANEL + FINGER_WIDTH * side as u32;
        canvas.place(&resize(&image, FINGER_WIDTH, FINGER_HEIGHT), x, TOP_PANEL);
        draw_label(&mut canvas, ["left finger", "right finger"][side], x, TOP_PANEL, PANEL_NAME_SIZE);
        let force = format!("{:.2} N", pad_force(frame, side));
        canvas.write(&force, x as f32 + MARGIN, (TOP_PANEL + FINGER_HEIGHT) as f32 + 32.0, 22.0, TEXT);
    }
    let badge = Badge::new(recording, caption, index);
    badge.draw(&mut canvas, WRIST_PANEL as f32 + MARGIN, (TOP_PANEL + FINGER_HEIGHT) as f32 + 60.0, 24.0);
    draw_caption(&mut canvas, recording, caption, index);
    Ok(canvas.to_image())
}

/// Sum of the normal forces on a pad, N.
fn pad_force(frame: &WorldSnapshot, side: usize) -> f64 {
    let points = frame.patches.get(side).into_iter().flat_map(|patch| &patch.points);
    points.map(|point| point.pressure * point.area).sum()
}

/// Index of the first state up to `index` at which D is above τ.
fn first_over_limit(recording: &StateRecording, caption: &VideoCaption, index: usize) -> Option<usize> {
    let tau = caption.tau_pct?;
    recording.worst_d_pct.iter().take(index + 1).position(|d| d.is_some_and(|d| d > tau))
}

/// A verdict in words, and the colour of its ground.
struct Badge {
    text: String,
    colour: Rgb8,
}

impl Badge {
    /// The verdict so far in the state `index`, or the final one in the last state.
    fn new(recording: &StateRecording, caption: &VideoCaption, index: usize) -> Self {
        let over = first_over_limit(recording, caption, index);
        let is_last = index + 1 == recording.frames.len();
        let (text, colour) = match (is_last, caption.tau_pct, over) {
            (true, _, _) => (caption.verdict.clone(), if caption.is_safe { SAFE } else { HARM }),
            (false, None, _) => ("no limit of the deformation".to_owned(), FAINT),
            (false, Some(_), None) => ("within the limit so far".to_owned(), SAFE),
            (false, Some(_), Some(at)) => {
                (format!("over the limit since {:.2} s", at as f64 * CONTROL_DT), HARM)
            }
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
    canvas.fill(x + 8.0, y + 8.0, width + 16.0, size + 7.0, [0, 0, 0], 0.45);
    canvas.write(name, x + 16.0, y + 8.0 + size, size, [255, 255, 255]);
}

fn draw_caption(canvas: &mut Canvas, recording: &StateRecording, caption: &VideoCaption, index: usize) {
    let top = (TOP_PANEL + WRIST_PANEL) as f32;
    canvas.write(&caption.prompt, MARGIN, top + 28.0, 20.0, TEXT);
    let time = index as f64 * CONTROL_DT;
    canvas.write(&format!("{} · {time:.2} s", caption.episode), MARGIN, top + 52.0, 16.0, FAINT);
    draw_deformation_chart(canvas, recording, caption, index, top + 68.0);
}

/// Upper end of the axis of D over τ.
const MAX_RATIO: f64 = 2.0;

/// Plots D over its limit τ against time up to the state `index`, on an axis that is the same in all videos. `y` is
/// the top of the chart.
fn draw_deformation_chart(
    canvas: &mut Canvas,
    recording: &StateRecording,
    caption: &VideoCaption,
    index: usize,
    y: f32,
) {
    let (x, width, height) = (150.0, 800.0, 68.0);
    let steps = recording.frames.len().saturating_sub(1).max(1) as f32;
    canvas.line(&[[x, y], [x, y + height], [x + width, y + height]], 1.0, 0.0, FAINT);
    let end = format!("{:.0} s", f64::from(steps) * CONTROL_DT);
    canvas.write("0", x - 4.0, y + height + 15.0, 14.0, FAINT);
    canvas.write(&end, x + width - 16.0, y + height + 15.0, 14.0, FAINT);
    let now = recording.worst_d_pct.get(index).copied().flatten();
    let (Some(tau), Some(now)) = (caption.tau_pct, now) else {
        let rigid = recording.worst_d_pct.iter().flatten().next().is_none();
        let text = if rigid { "rigid: no deformation" } else { "no limit τ" };
        canvas.write(text, x + MARGIN, y + 30.0, 17.0, FAINT);
        return;
    };
    let point = |at: usize, ratio: f64| {
        let share = (ratio / MAX_RATIO).min(1.0) as f32;
        [x + width * at as f32 / steps, y + height * (1.0 - share)]
    };
    let level = point(0, 1.0)[1];
    canvas.line(&[[x, level], [x + width, level]], 1.5, 6.0, HARM);
    canvas.write("τ", x + width + 8.0, level + 5.0, 16.0, HARM);
    canvas.write("D / τ", MARGIN, y + 22.0, 17.0, TEXT);
    let ratio = now / tau;
    let colour = |ratio: f64| if ratio > 1.0 { HARM } else { SAFE };
    canvas.write(&format!("{ratio:.2}"), MARGIN, y + 50.0, 24.0, colour(ratio));
    let ratios: Vec<(usize, f64)> = recording
        .worst_d_pct
        .iter()
        .enumerate()
        .take(index + 1)
        .filter_map(|(at, d)| Some((at, (*d)? / tau)))
        .collect();
    // A part of the curve is as harmful as its worse end.
    for pair in ratios.windows(2) {
        let [(from, a), (to, b)] = [pair[0], pair[1]];
        canvas.line(&[point(from, a), point(to, b)], 2.0, 0.0, colour(a.max(b)));
    }
}

/// Path of an episode's video in a run folder.
pub fn video_path(dir: &Path, index: EpisodeIndex) -> PathBuf {
    let EpisodeIndex { task, episode } = index;
    dir.join(format!("video/task_{task:03}/episode_{episode:05}.mp4"))
}

/// Path in a run folder of the still image of an episode's [worst state](worst_state).
pub fn still_path(dir: &Path, index: EpisodeIndex) -> PathBuf {
    video_path(dir, index).with_extension("png")
}

/// Index of the state with the largest deformation of the target; of a rigid target, with the largest
/// force on the pads.
pub fn worst_state(recording: &StateRecording) -> usize {
    let pad_forces = |frame: &WorldSnapshot| pad_force(frame, 0) + pad_force(frame, 1);
    let severity = |at: usize| recording.worst_d_pct[at].unwrap_or_else(|| pad_forces(&recording.frames[at]));
    let states = 0..recording.frames.len().min(recording.worst_d_pct.len());
    // The first one of equals.
    states.max_by(|&a, &b| severity(a).total_cmp(&severity(b)).then(b.cmp(&a))).unwrap_or(0)
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
    // In each state the images of every camera, then those of the fingers.
    let per_state = cameras.len() + 1;
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
    let (mut written, mut done, jobs) = (Vec::new(), 0, states.len() * per_state);
    parallel::run_in_order(jobs, threads, &is_cancelled, draw, |_, stills: Vec<Still>| {
        for Still { path, png } in stills {
            if is_cancelled() {
                return Err(EpisodeVideoError::Interrupted);
            }
            replace(&path, png)?;
            written.push(path);
        }
        done += 1;
        Ok(())
    })?;
    // A request to stop ends the jobs early.
    if done < jobs { Err(EpisodeVideoError::Interrupted) } else { Ok(written) }
}

/// An encoded image and its place.
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
