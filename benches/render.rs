//! CPU time per image, in the first task of a suite as the expert solves it, with the complete robot, scene and soft
//! bodies.
//!
//! `cargo bench --bench render` prints milliseconds of CPU time per image next to the goals. Each of [`IMAGES`] states,
//! spread evenly over the episode, is drawn [`ROUNDS`] times; the result is the mean over the states of the fastest
//! time. The last column is the time of the first image, which fills the caches. Words after `--` select the lines that
//! contain one of them. `cargo bench --bench render -- --png DIR` also writes images to a folder, one scene per layout.

mod episode;

use std::path::PathBuf;

use cpu_time::ThreadTime;
use softvt::{
    geometry::Pose,
    physics::world::WorldSnapshot,
    rollout::{AssetCache, Controller, Episode, StateRecording},
    scene::{Camera, CameraMount},
    script::LoadedScript,
    sensing::camera::{Channels, Renderer},
};

/// Repetitions, of which the fastest counts.
const ROUNDS: usize = 8;
/// States drawn in turn.
const IMAGES: usize = 16;

/// Records all states of an episode.
fn record(loaded: &LoadedScript, task: usize) -> StateRecording {
    let (spec, mut expert) = episode::open(loaded, task, true);
    let started = Episode::start(spec, &AssetCache::default()).expect("it starts");
    started.run(&mut expert as &mut dyn Controller).expect("it runs").recording.expect("it was asked for")
}

/// States spread evenly over an episode.
fn select_states(recording: &StateRecording) -> Vec<WorldSnapshot> {
    let last = recording.frames.len() - 1;
    (0..IMAGES).map(|i| recording.frames[i * last / (IMAGES - 1)].clone()).collect()
}

fn report(recording: &mut StateRecording, name: &str, goal_ms: f64, camera: &Camera, is_cached: bool) {
    let filters: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let png = std::env::args().any(|word| word == "--png");
    if !(png || filters.is_empty() || filters.iter().any(|word| name.contains(word.as_str()))) {
        return;
    }
    let frames = select_states(recording);
    let mut views: Vec<_> = frames.iter().map(|frame| recording.sensors.view(frame)).collect();
    let (mut renderer, mut camera) = (Renderer::default(), camera.clone());
    if !is_cached && camera.mount == CameraMount::World {
        // Backgrounds of cameras on the hand are not cached.
        camera.mount = CameraMount::Hand;
        views.iter_mut().for_each(|view| view.hand_w = Some(Pose::identity()));
    }
    let scene = recording.sensors.render_scene().expect("everything can be drawn");
    let mut draw = |state: usize| {
        let start = ThreadTime::now();
        renderer
            .render_channels(scene, &views[state], &camera, Channels::Colours)
            .expect("the camera is good");
        1e3 * start.elapsed().as_secs_f64()
    };
    let first = draw(0);
    let mut fastest = [f64::INFINITY; IMAGES];
    for _ in 0..ROUNDS {
        fastest.iter_mut().enumerate().for_each(|(i, least)| *least = least.min(draw(i)));
    }
    let least = fastest.iter().sum::<f64>() / IMAGES as f64;
    let reached = if least <= goal_ms { "yes" } else { "no" };
    println!("{name:<28} {goal_ms:>6.0} {least:>9.2}   {reached:<5} {first:>8.1}");
}

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let folder = words.iter().position(|w| w == "--png").and_then(|i| words.get(i + 1)).map(PathBuf::from);
    let loaded = episode::load();
    let mut set = record(&loaded, 0);
    let (third, wrist) = (Camera::third_person_table(), Camera::wrist());
    let large = third.clone().with_edge(1024);
    println!("CPU milliseconds per image, one thread");
    println!("{:<28} {:>6} {:>9}   {:<5} {:>8}", "image", "goal", "measured", "met", "first");
    report(&mut set, "third person 224, cached", 2.0, &third, true);
    report(&mut set, "third person 224, uncached", 3.0, &third, false);
    report(&mut set, "wrist 224", 3.0, &wrist, true);
    report(&mut set, "third person 1024, cached", 20.0, &large, true);
    report(&mut set, "third person 1024, uncached", 45.0, &large, false);
    report(&mut set, "wrist 512", 12.0, &wrist.clone().with_edge(512), true);
    let Some(folder) = folder else { return };
    for task in [0, 2, 4, 6, 8] {
        let mut set = record(&loaded, task);
        let middle = set.frames[set.frames.len() / 2].clone();
        for (camera, edge) in [(&third, 1024), (&third, 224), (&wrist, 512), (&wrist, 224)] {
            let camera = camera.clone().with_edge(edge);
            let image = set.sensors.render(&middle, &camera).expect("an image");
            let path = folder.join(format!("{task}_{}_{edge}.png", camera.name));
            image.into_rgb_image().save(&path).expect("the folder can be written");
        }
    }
}
