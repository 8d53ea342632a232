//! `softvt doctor`: versions, the machine, and a comparison of the physics with the published bits.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use serde::Deserialize;

use crate::{
    error::{CliError, Exit},
    output::{Console, print},
};
use softvt_benchmark::Plan;
use softvt_records::record::EpisodeRecord;
use softvt_runner::{ConfiguredScript, EpisodeJob, EpisodeList, RunConfig, SuiteRun, thread_count};

/// `assets/golden.json`: an episode whose final state is published.
#[derive(Deserialize)]
struct GoldenEpisode {
    script: String,
    task: usize,
    state_hash: String,
}

/// Prints versions and runs the golden episode.
///
/// # Errors
/// The golden episode cannot be run, or ends in another state than the published one.
pub(super) fn run() -> Result<(), CliError> {
    print(&format!(
        "softvt     {}\nplatform   {} {}, {} threads\nfeatures   {}\nlua        5.4, embedded\n",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::ARCH,
        std::env::consts::OS,
        thread_count(None),
        if cfg!(target_feature = "avx2") { "avx2" } else { "portable (slower; the same results)" },
    ))?;
    let Some(golden) = softvt_script::embedded("assets/golden.json") else {
        return print("golden     none in this build\n");
    };
    let golden: GoldenEpisode = serde_json::from_slice(golden)?;
    let hash = run_golden(&golden)?.stats.state_hash;
    let is_same = hash == golden.state_hash;
    let verdict = if is_same { "matches the published one" } else { "DIFFERS from the published one" };
    print(&format!("golden     {} task {}: {hash}, {verdict}\n", golden.script, golden.task))?;
    if is_same { Ok(()) } else { Err(mismatch(&golden)) }
}

/// Runs the golden episode and writes nothing.
fn run_golden(golden: &GoldenEpisode) -> Result<EpisodeRecord, CliError> {
    let config = RunConfig { observer: Arc::new(Console::default()), ..RunConfig::of(&golden.script) };
    let ConfiguredScript { config, script: loaded } = config.load()?;
    let Plan::Suite(suite) = &loaded.plan else {
        return Err(CliError::input(format!("{} is not a suite", golden.script)));
    };
    let task = suite.tasks.iter().find(|task| task.id == golden.task);
    let task =
        task.ok_or_else(|| CliError::input(format!("{} has no task {}", golden.script, golden.task)))?;
    let job = EpisodeJob { task, episode: 0 };
    let run = SuiteRun::new(&config, &loaded, suite, EpisodeList::listed(vec![job]), PathBuf::new())?;
    Ok(run.run_episode(job, false, &run.controllers)?.record)
}

fn mismatch(golden: &GoldenEpisode) -> CliError {
    let local = ["suites", "scripts", "assets"].into_iter().filter(|folder| Path::new(folder).is_dir());
    let local: Vec<&str> = local.collect();
    let cause = match local.is_empty() {
        true => "this machine or this build computes other results".to_owned(),
        false => format!(
            "files of the working folder ({}) take precedence over those of the release; run softvt doctor in an empty \
             folder to test the machine alone",
            local.join(", ")
        ),
    };
    CliError::new(
        Exit::Internal,
        format!(
            "the golden episode does not end in the published state {}: {cause}; results are not bitwise comparable with \
         published ones",
            golden.state_hash
        ),
    )
}
