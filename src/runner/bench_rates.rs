//! Rates: how many observations this machine makes per second.
//!
//! The expert of a suite solves its first task again and again, without sensor streams and with them. Rates count
//! control steps from the first action to the last; the scene settles and its appearance is made before.

use std::time::Instant;

use cpu_time::ThreadTime;
use serde::{Deserialize, Serialize};

use crate::{config::RunConfig, error::RunError};
use softvt_benchmark::{CONTROL_HZ, Plan, Suite};
use softvt_common::{
    cancel,
    disk_cache::DiskCache,
    episode_id::{EpisodeId, EpisodeSplit},
    parallel,
    table::{Column, Table},
    text::{counted, decimal},
};
use softvt_policy::{Action, Observation, PolicyError, SensorStreams};
use softvt_rollout::{AssetCache, Controller, Episode, EpisodeSpec, Simulation};
use softvt_scene::STANDARD_CAMERAS;
use softvt_script::{EpisodeSetup, ExpertController, ExpertGrip, LoadedScript, SceneChanges};

/// Number of episodes of which the fastest counts: other work on the machine only makes them slower.
const EPISODES: usize = 5;
/// Contents of an observation, in the order of [`MachineRates::streams`].
const STREAMS: [&str; 4] = ["state", "state, cameras", "state, touch", "all streams"];

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MachineRates {
    pub softvt: String,
    /// Suite whose first task is run.
    pub script: String,
    /// Processor, as the system names it.
    pub machine: String,
    /// CPU time from nothing to the first observation with all streams, without a cache on disk, s.
    pub first_observation_s: f64,
    /// The same with what an earlier process left in the cache of the process, s; `None` without such a cache.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cached_first_observation_s: Option<f64>,
    /// Rates on one thread.
    pub streams: Vec<StreamRate>,
    /// Number of threads that run episodes at the same time.
    pub threads: usize,
    /// Observations per second (wall time) with all streams, of all threads together.
    pub observations_per_s: f64,
}

impl MachineRates {
    /// These rates and published ones as text, one column for each machine.
    pub fn table_beside(&self, published: &Self) -> String {
        let here = self;
        let row = |name: &str, value: &dyn Fn(&MachineRates) -> String| {
            [name.to_owned(), value(here), value(published)]
        };
        let mut rows = vec![
            row("CPU s to the first observation", &|rates| decimal(Some(rates.first_observation_s), 2)),
            row("the same with the cache", &|rates| decimal(rates.cached_first_observation_s, 2)),
        ];
        for (index, of_streams) in here.streams.iter().enumerate() {
            let value = |rates: &MachineRates| {
                rates.streams.get(index).map_or_else(String::new, |rate| {
                    format!("{:.0} ({:.1} ×)", rate.observations_per_s, rate.times_real_time())
                })
            };
            rows.push(row(&format!("{}, one core", of_streams.streams), &value));
        }
        let machine = |rates: &MachineRates| {
            format!("{:.0} ({})", rates.observations_per_s, counted(rates.threads, "thread"))
        };
        rows.push(row("all streams, machine", &machine));
        let names = [("here", here), ("published", published)]
            .map(|(which, rates)| format!("{which}: softvt {}, {}\n", rates.softvt, rates.machine));
        let cell = |at: usize| move |row: &[String; 3]| row[at].clone();
        let [own, other] = [("here", 1), ("published", 2)].map(|(name, at)| Column::number(name, cell(at)));
        format!(
            "Observations per second, and the multiple of real time, in {} task 0: the fastest of {EPISODES} episodes\n\n{}\n{}",
            here.script,
            Table::new(&rows, [Column::text("", cell(0)), own, other]).text(),
            names.concat()
        )
    }
}

/// Rate of observations with some of the streams, on one thread.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StreamRate {
    pub streams: String,
    /// Observations per second of CPU time.
    pub observations_per_s: f64,
}

impl StreamRate {
    /// Simulated time per CPU time.
    pub fn times_real_time(&self) -> f64 {
        self.observations_per_s / f64::from(CONTROL_HZ)
    }
}

/// Measures the rates of this machine in the suite `script`, with up to `threads` episodes at a time. `on_stage` is
/// told what is measured next.
///
/// # Errors
/// The suite cannot be loaded or run, e.g. because a file of the working folder replaces one of it.
pub fn measure(
    script: &str,
    threads: usize,
    mut on_stage: impl FnMut(&str),
) -> Result<MachineRates, RunError> {
    let loaded = RunConfig::of(script).load()?.script;
    on_stage("the first observation");
    let first = time_episode(&loaded, &all_streams(), &AssetCache::stored_in(DiskCache::DISABLED))?;
    // The first time fills the cache on disk.
    time_episode(&loaded, &all_streams(), &AssetCache::default())?;
    let assets = AssetCache::default();
    let cached = time_episode(&loaded, &all_streams(), &assets)?;
    let has_cache = DiskCache::default().is_in_use();
    let mut streams = Vec::new();
    for (index, name) in STREAMS.into_iter().enumerate() {
        on_stage(name);
        let rate = || {
            let timing = time_episode(&loaded, &streams_of(index), &assets)?;
            Ok(timing.steps / timing.cpu_s)
        };
        streams.push(StreamRate { streams: name.to_owned(), observations_per_s: fastest(rate)? });
    }
    on_stage("all threads");
    let observations_per_s = fastest(|| observations_per_s(&loaded, threads, &assets))?;
    Ok(MachineRates {
        softvt: env!("CARGO_PKG_VERSION").to_owned(),
        script: script.to_owned(),
        machine: processor(),
        first_observation_s: first.until_action_s,
        cached_first_observation_s: has_cache.then_some(cached.until_action_s),
        streams,
        threads,
        observations_per_s,
    })
}

/// The highest of the rates of [`EPISODES`] episodes.
pub(crate) fn fastest(mut rate: impl FnMut() -> Result<f64, RunError>) -> Result<f64, RunError> {
    (0..EPISODES).try_fold(0.0, |most: f64, _| Ok(most.max(rate()?)))
}

/// Observations per second of wall time with all streams, with `threads` episodes at the same time.
pub(crate) fn observations_per_s(
    loaded: &LoadedScript,
    threads: usize,
    assets: &AssetCache,
) -> Result<f64, RunError> {
    let mut rate = 0.0;
    let run = |_| time_episode(loaded, &all_streams(), assets);
    parallel::run(threads, threads, cancel::requested, run, |_, timing| {
        rate += timing.steps / timing.wall_s;
        Ok(())
    })?;
    Ok(rate)
}

/// All streams: those of the last row of [`STREAMS`].
pub(crate) fn all_streams() -> SensorStreams {
    streams_of(STREAMS.len() - 1)
}

fn streams_of(row: usize) -> SensorStreams {
    let cameras = STANDARD_CAMERAS.map(str::to_owned).into();
    match row {
        0 => SensorStreams::default(),
        1 => SensorStreams { cameras, ..SensorStreams::default() },
        2 => SensorStreams { tactile: true, ..SensorStreams::default() },
        _ => SensorStreams { cameras, tactile: true, force: true, ..SensorStreams::default() },
    }
}

pub(crate) struct EpisodeTiming {
    steps: f64,
    /// CPU time before the first action, s.
    until_action_s: f64,
    /// CPU time of this thread from the first action on, s.
    cpu_s: f64,
    /// Wall time from the first action on, s.
    wall_s: f64,
}

/// An expert with sensor streams that it ignores, and the times of its first action.
struct ObservedExpert {
    expert: ExpertController,
    streams: SensorStreams,
    first_action: Option<FirstAction>,
}

struct FirstAction {
    cpu: ThreadTime,
    wall: Instant,
}

impl Controller for ObservedExpert {
    fn streams(&self) -> SensorStreams {
        self.streams.clone()
    }

    fn act(&mut self, sim: &Simulation, seen: &Observation) -> Result<Option<Action>, PolicyError> {
        self.first_action.get_or_insert_with(|| FirstAction { cpu: ThreadTime::now(), wall: Instant::now() });
        self.expert.act(sim, seen)
    }
}

/// Runs the first episode of a suite with sensor streams.
pub(crate) fn time_episode(
    loaded: &LoadedScript,
    streams: &SensorStreams,
    assets: &AssetCache,
) -> Result<EpisodeTiming, RunError> {
    let begin = ThreadTime::now();
    let suite = suite_of(loaded)?;
    let id = first_episode(suite);
    let opened = EpisodeSetup::open(loaded, &id, &SceneChanges::default()).map_err(RunError::input)?;
    let (task, settings) = (&suite.tasks[0], &suite.settings);
    let spec = EpisodeSpec::new(id, "expert", task, &opened.nominal, opened.scene.clone(), settings);
    let spec = EpisodeSpec { predicates: opened.predicates.clone(), ..spec };
    let expert =
        opened.expert(ExpertGrip::Commanded).ok_or_else(|| RunError::input("the suite has no expert"))?;
    let mut controller = ObservedExpert { expert, streams: streams.clone(), first_action: None };
    let episode = Episode::start(spec, assets).map_err(RunError::input)?;
    let record = episode.run(&mut controller).map_err(RunError::input)?.record;
    let first = controller.first_action.ok_or_else(|| RunError::input("the expert never acted"))?;
    let cpu_s = first.cpu.elapsed().as_secs_f64();
    Ok(EpisodeTiming {
        steps: record.stats.time_s * f64::from(CONTROL_HZ),
        until_action_s: begin.elapsed().as_secs_f64() - cpu_s,
        cpu_s,
        wall_s: first.wall.elapsed().as_secs_f64(),
    })
}

pub(crate) fn suite_of(loaded: &LoadedScript) -> Result<&Suite, RunError> {
    match &loaded.plan {
        Plan::Suite(suite) => Ok(suite),
        _ => Err(RunError::input("the script is not a suite")),
    }
}

/// The first episode of the first task of a suite.
pub(crate) fn first_episode(suite: &Suite) -> EpisodeId {
    EpisodeId {
        suite: suite.name.clone(),
        task: 0,
        episode: 0,
        base_seed: 0,
        split: EpisodeSplit::Validation,
    }
}

/// Name of the processor; without one, the architecture and the system.
fn processor() -> String {
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = cpuinfo.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let unknown = || format!("{} {}", std::env::consts::ARCH, std::env::consts::OS);
    name.map_or_else(unknown, |(_, name)| name.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_the_rates_of_both_machines_and_the_multiples_of_real_time() {
        let rates = |machine: &str, observations_per_s: f64| MachineRates {
            softvt: "0.1.0".to_owned(),
            script: "suites/some.lua".to_owned(),
            machine: machine.to_owned(),
            first_observation_s: 1.5,
            cached_first_observation_s: None,
            streams: vec![StreamRate { streams: "state".to_owned(), observations_per_s }],
            threads: 4,
            observations_per_s: 4.0 * observations_per_s,
        };
        let text = rates("mine", 30.0).table_beside(&rates("theirs", 60.0));
        for expected in
            ["suites/some.lua", "30 (1.5 ×)", "60 (3.0 ×)", "120 (4 threads)", "here: softvt 0.1.0, mine"]
        {
            assert!(text.contains(expected), "{expected} in\n{text}");
        }
    }
}
