//! What an episode leaves beside its line: its actions, its log for other scorers, its trace, its video and still.

use crate::cli::run::config::RunConfig;
use std::path::{Path, PathBuf};

use crate::{
    cli::{
        args::VideoSelection,
        error::CliError,
        run::{calibration::make_folder, suite_run::folder_failure},
    },
    evaluation::record::{EpisodeRecord, Identity},
    report::{
        actions,
        softvtbench_files::{self, DebugFrame, DebugShape},
        video::{self, Caption, FilmError},
    },
    rollout::{FinishedEpisode, ScoreFrame, cancel},
};

/// Where they are, and which of them are wanted.
pub(crate) struct EpisodeArtifacts<'a> {
    dir: &'a Path,
    trace: bool,
    video: Option<&'a VideoSelection>,
}

impl<'a> EpisodeArtifacts<'a> {
    /// Those of a run in the folder `dir`.
    pub(crate) fn of(run: &'a RunConfig, dir: &'a Path) -> Self {
        Self { dir, trace: run.trace.is_some(), video: run.video.as_ref() }
    }

    /// Whether an episode may have to be drawn.
    pub(crate) fn may_show(&self, episode: u32) -> bool {
        match self.video {
            None => false,
            Some(VideoSelection::Episodes(chosen)) => chosen.contains(&episode),
            Some(VideoSelection::All | VideoSelection::Failed) => true,
        }
    }

    /// Whether a finished episode has to be drawn.
    fn shows(&self, record: &EpisodeRecord) -> bool {
        let safe = self.video == Some(&VideoSelection::Failed) && record.verdict.safety;
        self.may_show(record.identity.episode) && !safe
    }

    /// Those of a finished episode that are wanted and not there.
    pub(crate) fn lost(&self, record: &EpisodeRecord) -> Vec<PathBuf> {
        let id = &record.identity;
        let mut wanted = vec![
            actions::path(self.dir, id.task, id.episode),
            softvtbench_files::debug_log_path(self.dir, id.task, id.episode),
        ];
        if self.trace {
            wanted.push(self.trace_path(id));
        }
        if self.shows(record) {
            wanted.push(video::video_path(self.dir, id.task, id.episode));
            if !record.verdict.safety {
                wanted.push(video::still_path(self.dir, id.task, id.episode));
            }
        }
        wanted.retain(|path| !path.is_file());
        wanted
    }

    /// Writes all but the pictures.
    ///
    /// # Errors
    /// A file cannot be written.
    pub(crate) fn write(&self, finished: &FinishedEpisode) -> Result<(), CliError> {
        let id = &finished.record.identity;
        self.write_trace(finished)?;
        let path = softvtbench_files::debug_log_path(self.dir, id.task, id.episode);
        softvtbench_files::write_debug_log(&path, id, &debug_frames(finished)).map_err(folder_failure)?;
        let path = actions::path(self.dir, id.task, id.episode);
        actions::write(&path, &finished.actions).map_err(folder_failure)
    }

    /// Draws what is wanted of an episode: its video, and of one that is not safe a still of its worst moment.
    ///
    /// # Errors
    /// A picture cannot be made or written.
    pub(crate) fn draw(&self, finished: &mut FinishedEpisode) -> Result<(), CliError> {
        let (record, Some(mut film)) = (&finished.record, finished.recording.take()) else { return Ok(()) };
        if !self.shows(record) {
            return Ok(());
        }
        let (id, caption) = (&record.identity, Caption::of(record));
        let path = video::video_path(self.dir, id.task, id.episode);
        make_folder(path.parent().unwrap_or(self.dir))?;
        if !record.verdict.safety {
            let (worst, still) =
                (video::worst_moment(&film), video::still_path(self.dir, id.task, id.episode));
            video::write_panels(&mut film, &caption, worst, &still).map_err(film_failure)?;
        }
        video::write_video(&mut film, &caption, &path, cancel::requested).map_err(film_failure)
    }

    fn trace_path(&self, id: &Identity) -> PathBuf {
        self.dir.join(format!("trace/task_{:03}/episode_{:05}.jsonl", id.task, id.episode))
    }

    fn write_trace(&self, finished: &FinishedEpisode) -> Result<(), CliError> {
        if !self.trace {
            return Ok(());
        }
        let path = self.trace_path(&finished.record.identity);
        make_folder(path.parent().unwrap_or(self.dir))?;
        let mut text = String::new();
        for step in &finished.trace {
            text += &serde_json::to_string(step).map_err(CliError::input)?;
            text.push('\n');
        }
        crate::files::replace(&path, &text).map_err(CliError::input)
    }
}

/// SoftVTBench's log of every control step, which its own scorer reads.
fn debug_frames(finished: &FinishedEpisode) -> Vec<DebugFrame> {
    let identity = &finished.record.identity;
    let frame = |(step, frame): (usize, &ScoreFrame)| {
        let measured = finished.reference.as_ref().zip(frame.deformation.as_ref());
        let shape = DebugShape::new(&identity.asset, measured);
        DebugFrame::new(identity, step as u32, frame.success_now, shape)
    };
    let mut frames: Vec<DebugFrame> = finished.frames.iter().enumerate().map(frame).collect();
    if frames.len() < finished.record.stats.steps as usize {
        frames.push(broken_off(finished, frames.len()));
    }
    frames
}

/// The row of a control step in which the physics failed: if the rollout's peak is above that of all steps before, it is of
/// this one.
fn broken_off(finished: &FinishedEpisode, step: usize) -> DebugFrame {
    let (identity, verdict) = (&finished.record.identity, &finished.record.verdict);
    let before = finished.frames.iter().filter_map(|frame| Some(frame.deformation.as_ref()?.rms_pct));
    let before = before.fold(0.0, f64::max);
    let peak = verdict.d_peak.filter(|peak| *peak > before);
    let shape =
        DebugShape::broken_off(&identity.asset, finished.reference.as_ref(), peak, verdict.d_peak_max);
    DebugFrame::new(identity, step as u32, false, shape)
}

/// A film that could not be made.
pub(crate) fn film_failure(error: FilmError) -> CliError {
    match error {
        FilmError::Interrupted => CliError::interrupted("interrupted"),
        other => CliError::input(other),
    }
}
