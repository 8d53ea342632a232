//! A rollout as a video: both cameras above, both fingers below, and the deformation against its limit beneath them.

mod canvas;

use std::{
    io::Cursor,
    path::{Path, PathBuf},
};

pub use canvas::{Canvas, Ink};
use image::{EncodableLayout, ImageBuffer, ImageError, ImageFormat, Luma, PixelWithColorType, RgbImage};

use crate::{
    benchmark::control::CONTROL_DT,
    dataset::video::{VideoError, VideoWriter},
    evaluation::record::EpisodeRecord,
    files::{FileError, replace},
    physics::world::Frame,
    rollout::{CAMERA_IMAGE_SUFFIXES, SensingError, StateRecording, TACTILE_IMAGE_SUFFIXES, TACTILE_IMAGES},
    scene::Camera,
    sensing::{
        camera::RenderedImage,
        tactile::{MarkerStyle, TactileReading},
    },
    text::format_number,
};

/// Edge of a camera's panel, height of a finger's and of the strip below, pixels.
const PANEL: u32 = 512;
const FINGER: u32 = 384;
const STRIP: u32 = 160;
/// Cameras of the panels.
const CAMERAS: [&str; 2] = ["third_person", "wrist"];

const GROUND: Ink = [22, 24, 28];
const WORDS: Ink = [226, 229, 233];
const FAINT: Ink = [122, 128, 138];
const SAFE: Ink = [94, 201, 140];
const HARM: Ink = [240, 96, 84];

/// Why a film cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    /// A stream cannot be made.
    #[error(transparent)]
    Sense(#[from] SensingError),
    /// The video cannot be encoded or written.
    #[error(transparent)]
    Video(#[from] VideoError),
    /// A picture cannot be encoded.
    #[error("cannot encode the picture: {0}")]
    RenderedImage(#[from] ImageError),
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// There is nothing to be drawn.
    #[error("the rollout has no states to be drawn")]
    Empty,
    /// The run is to end.
    #[error("interrupted")]
    Interrupted,
}

/// What the strip beneath a film says.
#[derive(Clone, Debug)]
pub struct Caption {
    prompt: String,
    who: String,
    verdict: String,
    /// Largest deformation that counts as safe, %.
    tau_pct: Option<f64>,
    good: bool,
}

impl Caption {
    /// That of a finished episode.
    pub fn of(record: &EpisodeRecord) -> Self {
        let (id, verdict) = (&record.identity, &record.verdict);
        let word = match (verdict.safety, verdict.goal) {
            (true, _) => "safe",
            (false, true) => "goal reached, not safe",
            _ => "failed",
        };
        Self {
            prompt: id.prompt.clone(),
            who: format!("{} · task {} · episode {} · {}", id.suite, id.task, id.episode, id.policy),
            verdict: word.to_owned(),
            tau_pct: verdict.tau,
            good: verdict.safety,
        }
    }
}

/// Draws every state of `film` and writes the video; `stop` ends it early and leaves no file.
///
/// # Errors
/// A stream cannot be made, or the file not written.
pub fn write_video(
    film: &mut StateRecording,
    caption: &Caption,
    path: &Path,
    stop: impl Fn() -> bool,
) -> Result<(), FilmError> {
    let mut video = VideoWriter::new(2 * PANEL as usize, (PANEL + FINGER + STRIP) as usize, rate())?;
    for index in 0..film.frames.len() {
        if stop() {
            return Err(FilmError::Interrupted);
        }
        video.push(&panels(film, caption, index)?)?;
    }
    Ok(video.save(path)?)
}

/// Pictures a second: one a control step.
fn rate() -> u32 {
    (1.0 / CONTROL_DT).round() as u32
}

/// One picture of the video.
fn panels(film: &mut StateRecording, caption: &Caption, index: usize) -> Result<RgbImage, FilmError> {
    let mut canvas = Canvas::new(2 * PANEL, PANEL + FINGER + STRIP, GROUND);
    let frame = film.frames.get(index).ok_or(FilmError::Empty)?;
    for (side, name) in CAMERAS.into_iter().enumerate() {
        let camera = film.sensors.camera(name)?.clone().with_edge(PANEL as usize);
        let picture = film.sensors.render(frame, &camera)?.into_rgb_image();
        canvas.place(&picture, PANEL * side as u32, 0);
        label(&mut canvas, ["third person", "wrist"][side], PANEL * side as u32, 0);
    }
    for (side, reading) in film.sensors.tactile_readings(frame)?.iter().enumerate() {
        let picture = reading.with_markers(MarkerStyle::Dots);
        let x = PANEL * side as u32;
        canvas.place_resized(&picture, (x, PANEL), (PANEL, FINGER));
        label(&mut canvas, ["left finger", "right finger"][side], x, PANEL);
    }
    strip(&mut canvas, film, caption, index);
    Ok(canvas.picture())
}

/// The name of a panel in its corner.
fn label(canvas: &mut Canvas, name: &str, x: u32, y: u32) {
    let width = canvas.width_of(name, 19.0);
    canvas.fill([x as f32 + 8.0, y as f32 + 8.0, width + 16.0, 26.0], [0, 0, 0], 0.45);
    canvas.write(name, (x as f32 + 16.0, y as f32 + 27.0), 19.0, [255, 255, 255]);
}

/// Words and the deformation so far.
fn strip(canvas: &mut Canvas, film: &StateRecording, caption: &Caption, index: usize) {
    let top = (PANEL + FINGER) as f32;
    canvas.write(&caption.prompt, (16.0, top + 28.0), 20.0, WORDS);
    let time = index as f64 * CONTROL_DT;
    canvas.write(&format!("{} · {time:.2} s", caption.who), (16.0, top + 52.0), 16.0, FAINT);
    let last = index + 1 == film.frames.len();
    if last {
        let width = canvas.width_of(&caption.verdict, 20.0);
        let ink = if caption.good { SAFE } else { HARM };
        canvas.write(&caption.verdict, (1008.0 - width, top + 28.0), 20.0, ink);
    }
    chart(canvas, film, caption, index, [150.0, top + 68.0, 800.0, 76.0]);
}

/// D against time with τ, in the box `[x, y, width, height]`.
fn chart(
    canvas: &mut Canvas,
    film: &StateRecording,
    caption: &Caption,
    index: usize,
    [x, y, width, height]: [f32; 4],
) {
    let worst = film.d_pct.iter().flatten().fold(0.0, |a: f64, b| a.max(*b));
    let scale = 1.15 * worst.max(caption.tau_pct.unwrap_or(0.0)).max(0.1);
    let steps = film.frames.len().saturating_sub(1).max(1) as f32;
    let place = |at: usize, d: f64| [x + width * at as f32 / steps, y + height * (1.0 - (d / scale) as f32)];
    canvas.line(&[[x, y], [x, y + height], [x + width, y + height]], 1.0, 0.0, FAINT);
    canvas.write("deformation", (16.0, y + 22.0), 17.0, WORDS);
    if let Some(tau) = caption.tau_pct {
        let level = place(0, tau)[1];
        canvas.line(&[[x, level], [x + width, level]], 1.5, 6.0, HARM);
        canvas.write(
            &format!("τ {} %", format_number(round(tau))),
            (x + width + 8.0, level + 5.0),
            16.0,
            HARM,
        );
    }
    let known: Vec<[f32; 2]> =
        film.d_pct.iter().enumerate().take(index + 1).filter_map(|(at, d)| Some(place(at, (*d)?))).collect();
    let Some(now) = film.d_pct.get(index).copied().flatten() else {
        let words = if worst > 0.0 { "" } else { "none: a rigid body" };
        canvas.write(words, (16.0, y + 46.0), 16.0, FAINT);
        return;
    };
    let ink = if caption.tau_pct.is_some_and(|tau| now > tau) { HARM } else { SAFE };
    canvas.line(&known, 2.0, 0.0, SAFE);
    canvas.write(&format!("{now:.2} %"), (16.0, y + 48.0), 20.0, ink);
}

fn round(x: f64) -> f64 {
    (100.0 * x).round() / 100.0
}

/// Where the video of an episode is in a run folder.
pub fn video_path(dir: &Path, task: usize, episode: u32) -> PathBuf {
    dir.join(format!("video/task_{task:03}/episode_{episode:05}.mp4"))
}

/// Where the still of an episode's worst moment is in a run folder.
pub fn still_path(dir: &Path, task: usize, episode: u32) -> PathBuf {
    video_path(dir, task, episode).with_extension("png")
}

/// The state in which the target is deformed most; where it does not deform, in which the pads are pressed on most.
pub fn worst_moment(film: &StateRecording) -> usize {
    // Forces on the pads, N.
    let press = |frame: &Frame| -> f64 {
        frame.patches.iter().flat_map(|patch| &patch.points).map(|point| point.pressure * point.area).sum()
    };
    let hard = |at: usize| film.d_pct[at].unwrap_or_else(|| press(&film.frames[at]));
    let all = 0..film.frames.len().min(film.d_pct.len());
    all.max_by(|&a, &b| hard(a).total_cmp(&hard(b)).then(b.cmp(&a))).unwrap_or(0)
}

/// Writes one picture of the video as a PNG file.
///
/// # Errors
/// A stream cannot be made, or the file not written.
pub fn write_panels(
    film: &mut StateRecording,
    caption: &Caption,
    index: usize,
    path: &Path,
) -> Result<(), FilmError> {
    Ok(replace(path, png(&panels(film, caption, index)?)?)?)
}

/// Edges of the cameras' own pictures, pixels.
fn native(camera: &Camera) -> usize {
    if camera.name == CAMERAS[0] { 1024 } else { 512 }
}

/// Stills of a film: `moments` are indices of states by name. Writes each stream of each moment into `dir`; of cameras also
/// depth (16 bits, 0.1 mm along the optical axis, 65535 where it is farther or nothing is) and segmentation (16 bits, objects
/// from 1 in the order of the scene, [`crate::rollout::senses::ROBOT`], 0 where nothing is). Each file is whole or not there;
/// `stop` ends the work between two of them.
///
/// # Errors
/// A stream cannot be made, or a file not written.
pub fn write_stills(
    film: &mut StateRecording,
    moments: &[(&str, usize)],
    full_size: bool,
    dir: &Path,
    stop: impl Fn() -> bool,
) -> Result<Vec<PathBuf>, FilmError> {
    let mut written = Vec::new();
    for &(moment, index) in moments {
        let frame = film.frames.get(index).ok_or(FilmError::Empty)?;
        let mut put = |of: &str, kind: &str, bytes: Vec<u8>| {
            if stop() {
                return Err(FilmError::Interrupted);
            }
            let path = dir.join(format!("{moment}_{of}{kind}.png"));
            replace(&path, bytes)?;
            written.push(path);
            Ok(())
        };
        for camera in film.sensors.cameras().to_vec() {
            let camera = if full_size { camera.clone().with_edge(native(&camera)) } else { camera };
            let seen = film.sensors.render(frame, &camera)?;
            for (kind, bytes) in CAMERA_IMAGE_SUFFIXES.into_iter().zip(camera_pictures(seen)?) {
                put(&camera.name, kind, bytes)?;
            }
        }
        for (name, reading) in TACTILE_IMAGES.into_iter().zip(&film.sensors.tactile_readings(frame)?) {
            for (kind, picture) in TACTILE_IMAGE_SUFFIXES.into_iter().zip(tactile(reading)) {
                put(name, kind, png(&picture)?)?;
            }
        }
    }
    Ok(written)
}

/// Colour, depth and segmentation of what a camera sees, as files.
fn camera_pictures(mut seen: RenderedImage) -> Result<[Vec<u8>; 3], FilmError> {
    let numbers = |values: Vec<u16>| {
        ImageBuffer::<Luma<u16>, _>::from_raw(seen.width as u32, seen.height as u32, values)
            .unwrap_or_default()
    };
    let tenths = |depth: &f32| (1e4 * depth).min(f32::from(u16::MAX)).round() as u16;
    let depth = png(&numbers(seen.depth.iter().map(tenths).collect()))?;
    let segmentation = png(&numbers(std::mem::take(&mut seen.segmentation)))?;
    Ok([png(&seen.into_rgb_image())?, depth, segmentation])
}

/// A finger's picture, plain, with dots and with arrows.
fn tactile(reading: &TactileReading) -> [RgbImage; 3] {
    let drawn = |style| reading.with_markers(style);
    [reading.image.clone(), drawn(MarkerStyle::Dots), drawn(MarkerStyle::Arrows)]
}

/// A picture as a PNG file.
fn png<P: PixelWithColorType>(picture: &ImageBuffer<P, Vec<P::Subpixel>>) -> Result<Vec<u8>, FilmError>
where
    [P::Subpixel]: EncodableLayout,
{
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}
