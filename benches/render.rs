//! CPU time of a picture: the first task of a suite as the expert plays it, with the true robot, room and soft bodies.
//!
//! `cargo bench --bench render` prints milliseconds of this thread a picture beside the goals: each of [`PICTURES`] states,
//! spread evenly over the episode, is drawn [`ROUNDS`] times, its fastest time on the processor counts, and the mean over
//! the states is printed; beside it the first picture's time, which fills the caches. Words after `--` choose lines that
//! contain one of them. `cargo bench --bench render -- --png DIR` also writes pictures there, one scene a layout.

mod episode;

use std::path::PathBuf;

use cpu_time::ThreadTime;
use softvt::{
    physics::world::Frame,
    rollout::{AssetCache, Controller, Episode, SensorAssets, StateRecording},
    scene::Camera,
    script::Loaded,
    sensing::camera::Renderer,
};

/// Runs of which the fastest counts, and pictures of a run: the states that are drawn in turn.
const ROUNDS: usize = 8;
const PICTURES: usize = 16;

/// All states of an episode, and what draws them.
fn film(loaded: &Loaded, task: usize) -> StateRecording {
    let (spec, mut expert) = episode::open(loaded, task, true);
    let started = Episode::start(spec, &AssetCache::default(), &SensorAssets::default()).expect("it starts");
    started.run(&mut expert as &mut dyn Controller).expect("it runs").recording.expect("it was asked for")
}

/// States spread evenly over an episode.
fn chosen(film: &StateRecording) -> Vec<Frame> {
    let last = film.frames.len() - 1;
    (0..PICTURES).map(|i| film.frames[i * last / (PICTURES - 1)].clone()).collect()
}

fn report(film: &mut StateRecording, name: &str, goal_ms: f64, camera: &Camera, mut scratch: Renderer) {
    let chosen_words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let png = std::env::args().any(|word| word == "--png");
    if !(png || chosen_words.is_empty() || chosen_words.iter().any(|word| name.contains(word.as_str()))) {
        return;
    }
    let frames = chosen(film);
    let views: Vec<_> = frames.iter().map(|frame| film.sensors.view(frame)).collect();
    let stage = film.sensors.render_scene().expect("everything can be drawn");
    let mut shoot = |picture: usize| {
        let start = ThreadTime::now();
        scratch.render(stage, &views[picture], camera).expect("the camera is good");
        1e3 * start.elapsed().as_secs_f64()
    };
    let first = shoot(0);
    let mut fastest = [f64::INFINITY; PICTURES];
    for _ in 0..ROUNDS {
        fastest.iter_mut().enumerate().for_each(|(i, least)| *least = least.min(shoot(i)));
    }
    let least = fastest.iter().sum::<f64>() / PICTURES as f64;
    let reached = if least <= goal_ms { "yes" } else { "no" };
    println!("{name:<28} {goal_ms:>6.0} {least:>9.2}   {reached:<5} {first:>8.1}");
}

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let folder = words.iter().position(|w| w == "--png").and_then(|i| words.get(i + 1)).map(PathBuf::from);
    let loaded = episode::load();
    let mut set = film(&loaded, 0);
    let (third, wrist) = (Camera::third_person_table(), Camera::wrist());
    let large = third.clone().with_edge(1024);
    println!("CPU milliseconds a picture, one thread");
    println!("{:<28} {:>6} {:>9}   {:<5} {:>8}", "picture", "goal", "measured", "met", "first");
    report(&mut set, "third person 224, cached", 3.0, &third, Renderer::default());
    report(&mut set, "third person 224, uncached", 4.0, &third, Renderer::without_cache());
    report(&mut set, "wrist 224", 4.0, &wrist, Renderer::default());
    report(&mut set, "third person 1024, cached", 25.0, &large, Renderer::default());
    report(&mut set, "third person 1024, uncached", 60.0, &large, Renderer::without_cache());
    report(&mut set, "wrist 512", 20.0, &wrist.clone().with_edge(512), Renderer::default());
    let Some(folder) = folder else { return };
    for task in [0, 2, 4, 6, 8] {
        let mut set = film(&loaded, task);
        let middle = set.frames[set.frames.len() / 2].clone();
        for (camera, edge) in [(&third, 1024), (&third, 224), (&wrist, 512), (&wrist, 224)] {
            let camera = camera.clone().with_edge(edge);
            let picture = set.sensors.render(&middle, &camera).expect("a picture");
            let path = folder.join(format!("{task}_{}_{edge}.png", camera.name));
            picture.into_rgb_image().save(&path).expect("the folder can be written");
        }
    }
}
