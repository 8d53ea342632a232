//! Files of an episode other than its line: actions, the log for SoftVTBench's scorer, trace, video, still and MCAP
//! file.

use std::{
    fs::File,
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    str::FromStr,
};

use crate::{config::TraceDetail, error::RunError};
use softvt_common::{cancel, episode_id::EpisodeIndex, files};
use softvt_evaluation::judge::ControlStepScore;
use softvt_report::{
    mcap,
    video::{self, FilmedEpisode},
};
use softvt_rollout::FinishedEpisode;
use softvt_runs::{
    actions,
    record::EpisodeRecord,
    softvtbench_files::{self, DebugFrame, DebugShape},
};

/// Episodes of a run that become videos or MCAP files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EpisodeFilter {
    /// All that are not safe.
    Failed,
    All,
    /// These episodes of each task.
    Episodes(Vec<u32>),
}

impl EpisodeFilter {
    /// True if the episode may be selected, before its outcome is known.
    fn may_select(&self, episode: u32) -> bool {
        match self {
            Self::Episodes(selected) => selected.contains(&episode),
            Self::All | Self::Failed => true,
        }
    }

    fn selects(&self, record: &EpisodeRecord) -> bool {
        let is_excluded = *self == Self::Failed && record.verdict.safety;
        self.may_select(record.header.id.episode) && !is_excluded
    }
}

impl FromStr for EpisodeFilter {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        Ok(match word {
            "failed" => Self::Failed,
            "all" => Self::All,
            list => {
                let episodes: Result<_, _> = list.split(',').map(str::parse).collect();
                Self::Episodes(
                    episodes.map_err(|_| "expected failed, all, or episodes such as 0,3".to_owned())?,
                )
            }
        })
    }
}

/// Paths of the files in a run folder, and which of them are requested.
pub(crate) struct EpisodeArtifacts<'a> {
    pub dir: &'a Path,
    pub trace: Option<TraceDetail>,
    pub video: Option<&'a EpisodeFilter>,
    pub mcap: Option<&'a EpisodeFilter>,
}

impl EpisodeArtifacts<'_> {
    /// True if a file that is made of the states of the episode may be requested, before its outcome is known.
    pub(crate) fn may_render(&self, episode: u32) -> bool {
        [self.video, self.mcap].into_iter().flatten().any(|filter| filter.may_select(episode))
    }

    /// True if a video of the finished episode is requested.
    fn has_video(&self, record: &EpisodeRecord) -> bool {
        self.video.is_some_and(|filter| filter.selects(record))
    }

    /// True if an MCAP file of the finished episode is requested.
    fn has_mcap(&self, record: &EpisodeRecord) -> bool {
        self.mcap.is_some_and(|filter| filter.selects(record))
    }

    /// The requested files of a finished episode that do not exist, and its actions if they are damaged.
    pub(crate) fn missing(&self, record: &EpisodeRecord) -> Vec<PathBuf> {
        let index = record.header.id.index();
        let mut requested =
            vec![actions::path(self.dir, index), softvtbench_files::debug_log_path(self.dir, index)];
        if self.trace.is_some() {
            requested.push(self.trace_path(index));
        }
        if self.has_mcap(record) {
            requested.push(mcap::mcap_path(self.dir, index));
        }
        if self.has_video(record) {
            requested.push(video::video_path(self.dir, index));
            if !record.verdict.safety {
                requested.push(video::still_path(self.dir, index));
            }
        }
        let (actions_path, trace_path) = (actions::path(self.dir, index), self.trace_path(index));
        let needs_nodes = self.trace == Some(TraceDetail::Nodes) && record.has_soft_target();
        let is_intact = |path: &PathBuf| match path {
            path if *path == actions_path => self.has_actions(record),
            path if *path == trace_path && needs_nodes => has_nodes(path),
            path => path.is_file(),
        };
        requested.retain(|path| !is_intact(path));
        requested
    }

    /// True if the actions of a finished episode are those of its record.
    pub(crate) fn has_actions(&self, record: &EpisodeRecord) -> bool {
        actions::read_checked(self.dir, record).is_ok()
    }

    /// Writes all files that are not made of the states.
    pub(crate) fn write(&self, finished: &FinishedEpisode) -> Result<(), RunError> {
        let header = &finished.record.header;
        let index = header.id.index();
        if self.trace.is_some() {
            files::write_json_lines(&self.trace_path(index), &finished.trace)?;
        }
        let path = softvtbench_files::debug_log_path(self.dir, index);
        softvtbench_files::write_debug_log(&path, header, &debug_frames(finished))?;
        let path = actions::path(self.dir, index);
        Ok(actions::write(&path, &finished.actions)?)
    }

    /// Writes the requested MCAP file and renders the requested video, and for an unsafe episode a still of the
    /// moment that shows its result. Consumes the recorded states.
    pub(crate) fn render(&self, finished: &mut FinishedEpisode) -> Result<(), RunError> {
        let (record, Some(mut states)) = (&finished.record, finished.recording.take()) else { return Ok(()) };
        let index = record.header.id.index();
        let mut written = Ok(());
        if self.has_mcap(record) {
            let path = mcap::mcap_path(self.dir, index);
            written = mcap::write_mcap(&mut states, record, &path, 1, cancel::requested, || ());
        }
        if !self.has_video(record) {
            return Ok(written?);
        }
        let episode = &mut [FilmedEpisode { record, states: &mut states }];
        let path = video::video_path(self.dir, index);
        files::create_folder(path.parent().unwrap_or(self.dir))?;
        if !record.verdict.safety {
            let still = video::still_path(self.dir, index);
            video::write_decisive_frame(episode, &still)?;
        }
        video::write_video(episode, &path, 1, cancel::requested, || ())?;
        Ok(written?)
    }

    fn trace_path(&self, index: EpisodeIndex) -> PathBuf {
        let EpisodeIndex { task, episode } = index;
        self.dir.join(format!("trace/task_{task:03}/episode_{episode:05}.jsonl"))
    }
}

/// True if a trace has the positions of nodes.
fn has_nodes(path: &Path) -> bool {
    let mut line = String::new();
    let is_read = File::open(path).and_then(|file| BufReader::new(file).read_line(&mut line)).is_ok();
    is_read && line.contains("\"nodes\":")
}

/// The log of every control step that the scorer of SoftVTBench reads.
fn debug_frames(finished: &FinishedEpisode) -> Vec<DebugFrame> {
    let header = &finished.record.header;
    let frame = |(step, score): (usize, &ControlStepScore)| {
        let (d, reference) = (score.targets[0].deformation_v1.as_ref(), finished.reference.as_ref());
        let (rms, max, bbox) = (d.map(|d| d.v1_rms_pct), d.map(|d| d.max_pct), d.map(|d| d.bbox_m));
        let shape = DebugShape::new(&header.asset, reference, rms, max, bbox);
        DebugFrame::new(&header.id, step as u32, score.success_now, shape)
    };
    let mut frames: Vec<DebugFrame> = finished.scores.iter().enumerate().map(frame).collect();
    if frames.len() < finished.record.stats.steps as usize {
        frames.push(aborted_frame(finished, frames.len()));
    }
    frames
}

/// The row of a control step in which the physics failed. A peak of the rollout above that of all complete steps
/// belongs to this step.
fn aborted_frame(finished: &FinishedEpisode, step: usize) -> DebugFrame {
    let (header, verdict) = (&finished.record.header, &finished.record.verdict);
    let before =
        finished.scores.iter().filter_map(|score| Some(score.targets[0].deformation_v1.as_ref()?.v1_rms_pct));
    let before = before.fold(0.0, f64::max);
    let peak = verdict.object().d_peak_v1.filter(|peak| *peak > before);
    let reference = finished.reference.as_ref();
    let shape = DebugShape::new(&header.asset, reference, peak, verdict.object().d_peak_max, None);
    DebugFrame::new(&header.id, step as u32, false, shape)
}
