//! `softvt view`: one episode as a video and stills.

use std::path::PathBuf;

use clap::Args;

use crate::{
    args::{PolicyArgs, Request, ScriptArgs, parse_folder, select_one_task},
    error::CliError,
    output::{Progress, print},
};
use softvt_benchmark::{CONTROL_DT, Plan};
use softvt_common::cancel;
use softvt_common::files;
use softvt_report::{
    episode_page,
    video::{VideoCaption, worst_state, write_stills, write_video, write_video_frame},
};
use softvt_runner::{ConfiguredScript, EpisodeJob, EpisodeList, RunConfig, SuiteRun};

/// Render one episode: a video, and stills of every camera and tactile sensor
#[derive(Args, Clone, Debug)]
#[command(override_usage = "softvt view [OPTIONS] --out <DIR> <FILE.lua>")]
pub(crate) struct ViewArgs {
    #[command(flatten)]
    pub(super) script: ScriptArgs,
    #[command(flatten)]
    policy: PolicyArgs,
    /// The task: its index or part of its prompt
    #[arg(long, value_name = "TASK", default_value = "0")]
    task: String,
    /// Episode of the task
    #[arg(long, value_name = "N", default_value = "0")]
    episode: u32,
    /// Stills at the full size of the cameras: 1024 and 512 pixels instead of 224
    #[arg(long)]
    full_size: bool,
    /// Output folder
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    out: PathBuf,
}

/// Runs one episode and writes `episode.mp4`, a frame of it as `episode.png`, stills of the first, worst and last state
/// of every camera and tactile sensor, and a page that shows them. Existing files are replaced.
///
/// # Errors
/// The script is not a suite, the task or episode fails, or a file cannot be rendered or written.
pub(super) fn run(args: ViewArgs) -> Result<(), CliError> {
    let tasks = vec![args.task.clone()];
    let request = Request::new(args.script)?.with(|config| RunConfig { tasks, ..config });
    let ConfiguredScript { config, script: loaded } = request.load_plan("view", &args.policy)?;
    let Plan::Suite(suite) = &loaded.plan else {
        let message = "expected a single suite; name a file that returns softvt.suite";
        return Err(config.error(message).into());
    };
    let task = select_one_task(&config, suite)?;
    let dir = &args.out;
    let job = EpisodeJob { task, episode: args.episode };
    let run = SuiteRun::new(&config, &loaded, suite, EpisodeList::listed(vec![job]), dir.clone())?;
    let run = run.rendered().prepare()?;
    files::create_folder(dir)?;
    config.observer.work("simulating the episode");
    let finished = run.run_episode(job, true, &run.controllers)?;
    config.observer.end();
    let caption = VideoCaption::new(&finished.record);
    let Some(mut states) = finished.recording else { return Ok(()) };
    let last = states.frames.len().saturating_sub(1);
    let worst = worst_state(&states);
    let moments = [("start", 0), ("worst", worst), ("end", last)];
    config.observer.work("drawing the stills");
    let threads = config.thread_count();
    write_stills(&mut states, &moments, args.full_size, dir, threads, cancel::requested)?;
    let still = dir.join("episode.png");
    write_video_frame(&mut states, &caption, worst, &still)?;
    config.observer.end();
    let video = dir.join("episode.mp4");
    let progress = Progress::new(states.frames.len(), "rendering the video");
    write_video(&mut states, &caption, &video, threads, cancel::requested, || progress.step())?;
    drop(progress);
    let worst_time_s = worst as f64 * CONTROL_DT;
    episode_page::write(&finished.record, worst_time_s, dir)?;
    print(&format!(
        "{}\n{}\n{}\n",
        episode_page::sentence(&finished.record, worst_time_s),
        dir.join(episode_page::PAGE).display(),
        video.display()
    ))
}
