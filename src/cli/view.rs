//! `softvt view`: one episode as a video and stills.

use super::{
    Failure, args::View, batch::Batch, evaluate::chosen, files::make_folder, print, side_files::film_failure,
};
use crate::{
    benchmark::Plan,
    report::video::{Caption, worst_moment, write_panels, write_stills, write_video},
    rollout::cancel,
    script,
};

/// Runs one episode and writes into the folder: `episode.mp4`, one of its pictures as `episode.png`, and stills of its
/// first, worst and last states. Files of the same name are replaced.
///
/// # Errors
/// The script is no suite, the task or episode fails, a stream cannot be made or a file not written.
pub(super) fn run(view: &View) -> Result<(), Failure> {
    let run = &view.run;
    let loaded = script::load(&run.file, &run.script_words).map_err(Failure::input)?;
    let Plan::Suite(suite) = &loaded.plan else {
        let message = format!(
            "{}: softvt view draws an episode of a suite, and this is none; name a file that returns softvt.suite",
            run.file.display()
        );
        return Err(Failure::input(message));
    };
    let tasks = chosen(run, suite)?;
    let [task] = tasks[..] else {
        let fits: Vec<String> = tasks.iter().map(|task| task.id.to_string()).collect();
        let message = format!(
            "{}: --task {:?} fits the tasks {}; name one by its index",
            run.file.display(),
            run.tasks[0],
            fits.join(", ")
        );
        return Err(Failure::input(message));
    };
    let dir = run.out.clone().unwrap_or_default();
    let mut batch = Batch::new(run, &loaded, suite, (vec![(task, view.episode)], dir.clone()))?;
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
