//! Small pictures of the objects of stored runs, for their report.

use std::{collections::BTreeMap, sync::Arc};

use crate::{
    config::{ConfiguredScript, RunConfig},
    episode_list::EpisodeList,
    error::RunError,
    observer::Observer,
    replay::StoredManifest,
    suite_run::SuiteRun,
};
use softvt_report::page::Thumbnails;
use softvt_rollout::{Sensors, Simulation};
use softvt_runs::{record::EpisodeRecord, stored_run::StoredRun};

/// Edge of a picture, pixels.
const EDGE: usize = 128;

/// Pictures of the targets of some runs by asset, in the scene of the first episode with each. Runs whose folders lack
/// the scripts, of another version or with a secret seed have none; a report is complete without.
pub fn thumbnails<'a>(
    runs: impl IntoIterator<Item = &'a StoredRun>,
    observer: &Arc<dyn Observer>,
) -> Thumbnails {
    let mut pictures = Thumbnails::new();
    for run in runs {
        let mut first: BTreeMap<&str, &EpisodeRecord> = BTreeMap::new();
        for record in run.records.iter().filter(|record| !pictures.contains_key(&record.header.asset)) {
            first.entry(&record.header.asset).or_insert(record);
        }
        if !first.is_empty() {
            pictures.extend(of_run(run, &first, observer).unwrap_or_default());
        }
    }
    pictures
}

/// Pictures of the targets of some episodes of a run, by asset.
fn of_run(
    run: &StoredRun,
    episodes: &BTreeMap<&str, &EpisodeRecord>,
    observer: &Arc<dyn Observer>,
) -> Result<Thumbnails, RunError> {
    let stored =
        StoredManifest { path: &run.dir, manifest: &run.manifest, secret: None, observer: observer.clone() };
    let config = RunConfig { tasks: Vec::new(), ..stored.config(0)? };
    if config.stored_scripts.is_none() {
        return Ok(Thumbnails::new());
    }
    let ConfiguredScript { config, script } = config.load()?;
    let suite = stored.suite(&script)?;
    let none = EpisodeList::listed(Vec::new());
    let scenes = SuiteRun::new(&config, &script, suite, none, run.manifest.split)?;
    let mut pictures = Thumbnails::new();
    for (asset, record) in episodes {
        let index = record.header.id.index();
        let Some(task) = suite.tasks.iter().find(|task| task.id == index.task) else { continue };
        let scene = Arc::new(scenes.open_episode(&scenes.episode_id(task, index.episode))?.scene);
        let sim = Simulation::new(scene, &scenes.settings, &scenes.assets).map_err(RunError::input)?;
        let Some(target) = sim.objects.iter().position(|object| object.name == task.object) else { continue };
        let mut sensors = Sensors::new(&sim, &scenes.settings.tactile, &scenes.assets);
        let picture = sensors.portrait(&Sensors::frame(&sim), target, EDGE).map_err(RunError::input)?;
        pictures.insert((*asset).to_owned(), picture);
    }
    Ok(pictures)
}
