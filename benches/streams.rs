//! Closed loop with every sensor stream at every control step: both cameras, images and markers of both fingers.
//!
//! `cargo bench --bench streams` runs the expert on the first task of a suite, on one thread. It prints CPU seconds per
//! simulated second without and with the streams, and the ratio to real time. Settling and the creation of the render meshes
//! are not included.

mod episode;

use cpu_time::ThreadTime;
use softvt::{
    policy::{Action, Observation, PolicyError, SensorStreams},
    rollout::{AssetCache, Controller, Episode, SensorAssets, Simulation},
    script::{ExpertController, LoadedScript},
};

/// Goal for all streams, times real time.
const GOAL: f64 = 4.0;

/// An expert with sensor streams that it ignores; time runs from its first action on.
struct ExpertWithStreams {
    expert: ExpertController,
    streams: SensorStreams,
    since: Option<ThreadTime>,
}

impl Controller for ExpertWithStreams {
    fn streams(&self) -> SensorStreams {
        self.streams.clone()
    }

    fn act(&mut self, sim: &Simulation, seen: &Observation) -> Result<Option<Action>, PolicyError> {
        self.since.get_or_insert_with(ThreadTime::now);
        self.expert.act(sim, seen)
    }
}

/// Caches shared by all episodes.
#[derive(Default)]
struct Caches {
    assets: AssetCache,
    sensors: SensorAssets,
}

/// Duration of an episode, s.
struct Timing {
    simulated: f64,
    cpu: f64,
}

fn time_episode(loaded: &LoadedScript, streams: &SensorStreams, caches: &Caches) -> Timing {
    let (spec, expert) = episode::open(loaded, 0, false);
    let mut controller = ExpertWithStreams { expert, streams: streams.clone(), since: None };
    let started = Episode::start(spec, &caches.assets, &caches.sensors).expect("it starts");
    let record = started.run(&mut controller).expect("it runs").record;
    let since = controller.since.expect("it acted");
    Timing { simulated: record.stats.time_s, cpu: since.elapsed().as_secs_f64() }
}

fn main() {
    let loaded = episode::load();
    let caches = Caches::default();
    let cameras: Vec<String> = ["third_person", "wrist"].map(str::to_owned).into();
    let cases = [
        ("no streams", SensorStreams::default()),
        ("cameras", SensorStreams { cameras: cameras.clone(), ..SensorStreams::default() }),
        ("touch", SensorStreams { tactile: true, ..SensorStreams::default() }),
        ("all streams", SensorStreams { cameras, tactile: true, force: true, ..SensorStreams::default() }),
    ];
    println!("{:<12} {:>10} {:>12} {:>12}", "case", "simulated", "CPU s / s", "× real time");
    for (name, streams) in cases {
        // The first episode creates the meshes.
        time_episode(&loaded, &streams, &caches);
        let Timing { simulated, cpu } = time_episode(&loaded, &streams, &caches);
        println!("{name:<12} {simulated:>8.2} s {:>12.4} {:>12.1}", cpu / simulated, simulated / cpu);
    }
    println!("goal: all streams at {GOAL} × real time");
}
