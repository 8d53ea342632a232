//! The closed loop with every stream at every control step: both cameras, both fingers' pictures and markers.
//!
//! `cargo bench --bench streams` runs the expert on the first task of a suite and prints CPU seconds a simulated second,
//! blind and looking, and how many times real time that is. One thread; settling and the making of models are apart.

mod episode;

use cpu_time::ThreadTime;
use softvt::{
    policy::{Action, Observation, SensorStreams},
    rollout::{AssetCache, ControlError, Controller, Episode, SensorAssets, Simulation},
    script::{ExpertController, Loaded},
};

/// Times real time with all streams.
const GOAL: f64 = 4.0;

/// An expert that also looks; time runs from its first action on.
struct Looking {
    expert: ExpertController,
    streams: SensorStreams,
    since: Option<ThreadTime>,
}

impl Controller for Looking {
    fn streams(&self) -> SensorStreams {
        self.streams.clone()
    }

    fn act(&mut self, sim: &Simulation, seen: &Observation) -> Result<Option<Action>, ControlError> {
        self.since.get_or_insert_with(ThreadTime::now);
        self.expert.act(sim, seen)
    }
}

/// Simulated seconds and CPU seconds of an episode.
fn episode(loaded: &Loaded, streams: &SensorStreams, shared: &(AssetCache, SensorAssets)) -> (f64, f64) {
    let (spec, expert) = episode::open(loaded, 0, false);
    let mut driver = Looking { expert, streams: streams.clone(), since: None };
    let started = Episode::start(spec, &shared.0, &shared.1).expect("it starts");
    let record = started.run(&mut driver).expect("it runs").record;
    let since = driver.since.expect("it acted");
    (record.stats.time_s, since.elapsed().as_secs_f64())
}

fn main() {
    let loaded = episode::load();
    let shared = (AssetCache::default(), SensorAssets::default());
    let cameras: Vec<String> = ["third_person", "wrist"].map(str::to_owned).into();
    let cases = [
        ("blind", SensorStreams::default()),
        ("cameras", SensorStreams { cameras: cameras.clone(), ..SensorStreams::default() }),
        ("touch", SensorStreams { touch: true, ..SensorStreams::default() }),
        ("all streams", SensorStreams { cameras, touch: true, force: true }),
    ];
    println!("{:<12} {:>10} {:>12} {:>12}", "case", "simulated", "CPU s / s", "× real time");
    for (name, streams) in cases {
        // The first one makes the models.
        episode(&loaded, &streams, &shared);
        let (simulated, spent) = episode(&loaded, &streams, &shared);
        println!("{name:<12} {simulated:>8.2} s {:>12.4} {:>12.1}", spent / simulated, simulated / spent);
    }
    println!("goal: all streams at {GOAL} × real time");
}
