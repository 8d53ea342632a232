//! `softvt replay RUN EPISODE`: simulation of a recorded episode, compared with its record byte by byte.

use std::{path::PathBuf, sync::Arc};

use clap::Args;

use crate::{
    args::load_one_run,
    error::CliError,
    output::{Console, OutputFormat, Progress, check_output_file, report_replays},
};
use softvt_common::cancel;
use softvt_dataset::layout::is_dataset;
use softvt_report::mcap::write_mcap;
use softvt_runner::{
    Observer,
    episode_selector::EpisodeSelector,
    read_secret,
    replay::{EpisodeReplay, SecretFile, replay_episode, simulate_demos},
    stored_folder::{enter_for_dataset, enter_for_run},
    thread_count,
};
use softvt_runs::stored_run::StoredRun;

/// Simulate a recorded episode again; exit code 0 if the result is byte-identical
#[derive(Args, Debug)]
pub(crate) struct ReplayArgs {
    /// Run folder, or a dataset
    run: PathBuf,
    /// TASK/EPISODE, or the line number in episodes.jsonl, from 0
    episode: EpisodeSelector,
    /// Secret seed of a judged run
    #[arg(long, value_name = "FILE")]
    seed_file: Option<PathBuf>,
    /// Also write the episode as an MCAP file for Foxglove and Rerun
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
}

/// Simulates an episode of a run or a demonstration of a dataset again, by its recorded actions.
///
/// # Errors
/// The run cannot be read, its scripts have changed since, or (exit code 1) the result differs.
pub(super) fn run(args: &ReplayArgs) -> Result<(), CliError> {
    let dir = &args.run;
    let observer: Arc<dyn Observer> = Arc::new(Console::default());
    let secret = args
        .seed_file
        .as_ref()
        .map(|path| Ok::<_, CliError>(SecretFile { path: path.clone(), secret: read_secret(path)? }));
    let secret = secret.transpose()?;
    if is_dataset(dir) {
        if secret.is_some() {
            bail!("--seed-file: demonstrations have no secret seed; leave it out");
        }
        if args.mcap.is_some() {
            bail!("--mcap: demonstrations have no MCAP files; leave it out");
        }
        let demos = [args.episode.find_demo(&enter_for_dataset(dir, &*observer)?)?];
        return report_replays(&demos, &simulate_demos(&demos, &observer)?);
    }
    if let Some(path) = &args.mcap {
        check_output_file("--mcap", path, OutputFormat::MCAP)?;
    }
    let stored = load_one_run(dir)?;
    args.episode.find_record(&stored)?;
    let stored = StoredRun { dir: enter_for_run(&stored, &*observer)?, ..stored };
    let keeps_states = args.mcap.is_some();
    let EpisodeReplay { index, simulated, difference, recording } =
        replay_episode(&stored, args.episode, secret.as_ref(), keeps_states, observer)?;
    if let (Some(path), Some(mut states)) = (&args.mcap, recording) {
        let progress = Progress::new(states.frames.len(), "writing the MCAP file");
        let threads = thread_count(None);
        write_mcap(&mut states, &simulated, path, threads, cancel::requested, || progress.step())?;
    }
    match difference {
        None => out!("{index}: byte-identical, final state {}\n", simulated.stats.state_hash),
        Some(difference) => Err(CliError::other_result(format_args!("{index} differs: {difference}"))),
    }
}
