//! `softvt doctor`: versions, the machine, and whether physics gives the published bits here.

use crate::benchmark::Plan;
use crate::cli::run::suite_run::SuiteRun;
use crate::evaluation::record::EpisodeRecord;
use std::path::Path;
use std::path::PathBuf;

use serde::Deserialize;

use crate::{
    cli::{error::CliError, output::print, run::config::RunConfig, run::policy::PolicyConfig},
    script,
};

/// The episode whose final state is published, `assets/golden.json`.
#[derive(Deserialize)]
struct Golden {
    script: String,
    task: usize,
    state_hash: String,
}

/// Checks the installation.
///
/// # Errors
/// The golden episode cannot be run, or ends otherwise than the published one.
pub(crate) fn run() -> Result<(), CliError> {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    print(&format!(
        "softvt     {}\nplatform   {} {}, {threads} threads\nfeatures   {}\nlua        5.4, embedded\n",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::ARCH,
        std::env::consts::OS,
        if cfg!(target_feature = "avx2") { "avx2" } else { "portable (slower; the same results)" },
    ));
    let Some(golden) = script::embedded("assets/golden.json") else {
        print("golden     none in this build\n");
        return Ok(());
    };
    let golden: Golden = serde_json::from_slice(golden).map_err(CliError::input)?;
    let record = single(&golden_run(&golden), golden.task)?;
    let hash = &record.stats.state_hash;
    let same = *hash == golden.state_hash;
    let verdict = if same { "matches the published one" } else { "DIFFERS from the published one" };
    print(&format!("golden     {} task {}: {hash}, {verdict}\n", golden.script, golden.task));
    if same { Ok(()) } else { Err(CliError::internal(mismatch(&golden))) }
}

/// What a state other than the published one can come from.
fn mismatch(golden: &Golden) -> String {
    let own = ["suites", "scripts", "assets"].iter().filter(|tree| Path::new(tree).is_dir());
    let own: Vec<&str> = own.copied().collect();
    let cause = match own.is_empty() {
        true => "this machine or this build computes otherwise".to_owned(),
        false => format!(
            "files of this folder ({}) come before those of the release; run softvt doctor in an empty folder to test \
             the machine alone",
            own.join(", ")
        ),
    };
    format!(
        "the golden episode does not end in the published state {}: {cause}; results are not comparable bit for bit \
         with published ones",
        golden.state_hash
    )
}

fn golden_run(golden: &Golden) -> RunConfig {
    RunConfig {
        tasks: vec![golden.task.to_string()],
        episodes: Some(1),
        ..RunConfig::of(golden.script.clone().into(), PolicyConfig::expert())
    }
}

/// Runs the first episode of one task of a suite and writes nothing.
///
/// # Errors
/// The script is no suite, or the episode cannot be run.
pub(crate) fn single(run: &RunConfig, task: usize) -> Result<EpisodeRecord, CliError> {
    let loaded = script::load(&run.file, &run.script_words).map_err(CliError::input)?;
    let Plan::Suite(suite) = &loaded.plan else {
        return Err(CliError::input(format!("{} is not a suite", run.file.display())));
    };
    let tasks = suite.tasks.iter().filter(|t| t.id == task);
    let jobs = tasks.map(|task| (task, 0)).collect();
    let batch = SuiteRun::new(run, &loaded, suite, (jobs, PathBuf::new()))?;
    batch.episode(0, false, &batch.drive).map(|finished| finished.record)
}
