//! `softvt view`: one episode as a video and stills.

use crate::{
    benchmark::Plan,
    cli::{
        args::View,
        error::CliError,
        output::print,
        run::selection::select_tasks,
        run::{calibration::make_folder, episode_artifacts::film_failure, suite_run::SuiteRun},
    },
    report::video::{Caption, worst_moment, write_panels, write_stills, write_video},
    rollout::cancel,
    script,
};

/// Runs one episode and writes into the folder: `episode.mp4`, one of its pictures as `episode.png`, and stills of its
/// first, worst and last states. Files of the same name are replaced.
///
/// # Errors
/// The script is no suite, the task or episode fails, a stream cannot be made or a file not written.
pub(crate) fn run(view: &View) -> Result<(), CliError> {
    let run = &view.run;
    let loaded = script::load(&run.file, &run.script_words).map_err(CliError::input)?;
    let Plan::Suite(suite) = &loaded.plan else {
        let message = format!(
            "{}: softvt view draws an episode of a suite, and this is none; name a file that returns softvt.suite",
            run.file.display()
        );
        return Err(CliError::input(message));
    };
    let tasks = select_tasks(run, suite)?;
    let [task] = tasks[..] else {
        let fits: Vec<String> = tasks.iter().map(|task| task.id.to_string()).collect();
        let message = format!(
            "{}: --task {:?} fits the tasks {}; name one by its index",
            run.file.display(),
            run.tasks[0],
            fits.join(", ")
        );
        return Err(CliError::input(message));
    };
    let dir = run.out.clone().unwrap_or_default();
    let mut batch = SuiteRun::new(run, &loaded, suite, (vec![(task, view.episode)], dir.clone()))?;
    batch.films = true;
    batch.prepare(&[task])?;
    make_folder(&dir)?;
    let finished = batch.episode(0, true, &batch.drive)?;
    let caption = Caption::of(&finished.record);
    let Some(mut film) = finished.recording else { return Ok(()) };
    let last = film.frames.len().saturating_sub(1);
    let worst = worst_moment(&film);
    let moments = [("start", 0), ("worst", worst), ("end", last)];
    let mut written =
        write_stills(&mut film, &moments, view.native, &dir, cancel::requested).map_err(film_failure)?;
    written.push(dir.join("episode.png"));
    write_panels(&mut film, &caption, worst, &dir.join("episode.png")).map_err(film_failure)?;
    let video = dir.join("episode.mp4");
    write_video(&mut film, &caption, &video, cancel::requested).map_err(film_failure)?;
    written.push(video);
    written.iter().for_each(|path| print(&format!("{}\n", path.display())));
    Ok(())
}
