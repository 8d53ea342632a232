//! `softvt view`: one episode as a video and stills.

use crate::{
    benchmark::Plan,
    cli::{
        args::ViewArgs,
        error::CliError,
        output::print,
        run::{
            config::RunConfig,
            episode_artifacts::video_error,
            policy::PolicyConfig,
            selection::{EpisodeJob, select_tasks},
            suite_run::SuiteRun,
        },
    },
    files,
    report::video::{Caption, worst_state, write_stills, write_video, write_video_frame},
    rollout::cancel,
    script,
};

/// Runs one episode and writes `episode.mp4`, a frame of it as `episode.png`, and stills of the first, worst and last
/// state of every camera and tactile sensor. Existing files are replaced.
///
/// # Errors
/// The script is not a suite, the task or episode fails, or a file cannot be rendered or written.
pub(crate) fn run(args: &ViewArgs) -> Result<(), CliError> {
    let config = RunConfig::of_script(&args.script)?.with_out(Some(args.out.clone()));
    let tasks = vec![args.task.clone()];
    let config = RunConfig { tasks, policy: PolicyConfig::load(&args.policy)?, ..config };
    let refuse = |message: String| Err(CliError::input(message).prefixed(config.file.display()));
    let loaded = script::load(&config.file, &config.script_options).map_err(CliError::input)?;
    let Plan::Suite(suite) = &loaded.plan else {
        return refuse("softvt view needs a single suite; name a file that returns softvt.suite".to_owned());
    };
    let tasks = select_tasks(&config, suite)?;
    let [task] = tasks[..] else {
        let matches: Vec<String> = tasks.iter().map(|task| task.id.to_string()).collect();
        let matches = matches.join(", ");
        return refuse(format!(
            "--task {:?} matches the tasks {matches}; select one by its index",
            args.task
        ));
    };
    let dir = &args.out;
    let job = EpisodeJob { task, episode: args.episode };
    let mut run = SuiteRun::new(&config, &loaded, suite, vec![job], dir.clone())?;
    run.renders_episodes = true;
    run.prepare(&[task])?;
    files::create_folder(dir).map_err(CliError::input)?;
    let finished = run.run_episode(job, true, &run.controllers)?;
    let caption = Caption::new(&finished.record);
    let Some(mut states) = finished.recording else { return Ok(()) };
    let last = states.frames.len().saturating_sub(1);
    let worst = worst_state(&states);
    let moments = [("start", 0), ("worst", worst), ("end", last)];
    let mut written =
        write_stills(&mut states, &moments, args.native, dir, cancel::requested).map_err(video_error)?;
    let still = dir.join("episode.png");
    write_video_frame(&mut states, &caption, worst, &still).map_err(video_error)?;
    written.push(still);
    let video = dir.join("episode.mp4");
    write_video(&mut states, &caption, &video, cancel::requested).map_err(video_error)?;
    written.push(video);
    written.iter().for_each(|path| print(&format!("{}\n", path.display())));
    Ok(())
}
