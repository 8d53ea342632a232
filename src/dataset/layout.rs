//! Where everything of a data set is.

use std::path::{Path, PathBuf};

/// One line a demonstration.
pub const MANIFEST: &str = "manifest.jsonl";
/// For people.
pub const CARD: &str = "README.md";
/// What was asked for, written at the start.
pub const RECORDING: &str = "recording.json";
/// What there is, written at the end: whoever has it is finished.
pub const DATASET: &str = "dataset.json";
/// All attempts, those that were not kept too: a run folder a suite.
pub const ATTEMPTS: &str = "attempts";
/// Finished demonstrations of tasks that are not.
pub const PARTS: &str = ".parts";

/// Pictures of a step in order: third person, wrist, left and right finger.
pub const IMAGE_STREAMS: [&str; 4] =
    ["agentview_rgb", "eye_in_hand_rgb", "gsmini_left_tactile_rgb", "gsmini_right_tactile_rgb"];
/// Their videos; the fingers' with markers.
pub const VIDEO_STREAMS: [&str; 4] =
    ["agentview_rgb", "eye_in_hand_rgb", "gsmini_left_markers_rgb", "gsmini_right_markers_rgb"];

/// A task of a suite in a data set.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TaskPaths {
    /// Folder of the data set.
    pub root: PathBuf,
    /// Name of the suite, as part of a path.
    pub suite: String,
    /// Index of the task.
    pub task: usize,
}

impl TaskPaths {
    /// What the names of its files begin with.
    pub fn name(&self) -> String {
        format!("{}_task{}", self.suite, self.task)
    }

    /// Its HDF5 file, from the folder of the data set.
    pub fn hdf5_relative(&self) -> String {
        format!("hdf5/{}_demo.hdf5", self.name())
    }

    /// Its HDF5 file.
    pub fn hdf5(&self) -> PathBuf {
        self.root.join(self.hdf5_relative())
    }

    /// A demonstration's video of a stream (an index of [`VIDEO_STREAMS`]), from the folder of the data set.
    pub fn video_relative(&self, demo: usize, stream: usize) -> String {
        format!("videos/{}/demo_{demo}_{}.mp4", self.name(), VIDEO_STREAMS[stream])
    }

    /// A demonstration's preview.
    pub fn preview(&self, demo: usize) -> PathBuf {
        self.root.join(format!("previews/{}/demo_{demo}.mp4", self.name()))
    }

    /// Where the finished parts of an attempt are: `kind` is `hdf5`, one of [`VIDEO_STREAMS`] with `mp4`, or `preview.mp4`.
    pub fn part(&self, attempt: u32, kind: &str) -> PathBuf {
        self.parts().join(format!("attempt_{attempt:05}.{kind}"))
    }

    /// Folder of the parts.
    pub fn parts(&self) -> PathBuf {
        self.root.join(PARTS).join(self.name())
    }

    /// Every file of an attempt but its HDF5, with its place in the finished data set as demonstration `demo`.
    pub fn films(&self, attempt: u32, demo: usize) -> Vec<(PathBuf, PathBuf)> {
        let video = |stream: usize| {
            let part = self.part(attempt, &format!("{}.mp4", VIDEO_STREAMS[stream]));
            (part, self.root.join(self.video_relative(demo, stream)))
        };
        let preview = (self.part(attempt, "preview.mp4"), self.preview(demo));
        (0..VIDEO_STREAMS.len()).map(video).chain([preview]).collect()
    }
}

/// The run folder with the attempts at a suite.
pub fn attempts(root: &Path, suite: &str) -> PathBuf {
    root.join(ATTEMPTS).join(suite)
}
