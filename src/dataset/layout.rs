//! Names and paths of the files of a dataset.

use std::path::{Path, PathBuf};

/// One line per demonstration.
pub const MANIFEST: &str = "manifest.jsonl";
/// Human-readable description.
pub const CARD: &str = "README.md";
/// The requested recording, written at its start.
pub const RECORDING: &str = "recording.json";
/// Contents, written last: its presence marks a complete dataset.
pub const DATASET: &str = "dataset.json";
/// Run folders of all attempts, including rejected ones, one per suite.
pub const ATTEMPTS: &str = "attempts";
/// Demonstrations of tasks that are still being recorded.
pub const PARTS: &str = ".parts";

/// Videos: third-person camera, wrist camera, left and right finger, those of the fingers with markers.
pub const VIDEO_STREAMS: [&str; 4] =
    ["agentview_rgb", "eye_in_hand_rgb", "gsmini_left_markers_rgb", "gsmini_right_markers_rgb"];

/// A file of an attempt and its place in the finished dataset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttemptFile {
    /// Path of the file among the attempts.
    pub part: PathBuf,
    /// Path in the finished dataset.
    pub target: PathBuf,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TaskPaths {
    pub root: PathBuf,
    /// Name of the suite, as part of a path.
    pub suite: String,
    pub task: usize,
}

impl TaskPaths {
    /// Common prefix of the task's file names.
    pub fn name(&self) -> String {
        format!("{}_task{}", self.suite, self.task)
    }

    /// HDF5 file, relative to the dataset.
    pub fn hdf5_relative(&self) -> String {
        format!("hdf5/{}_demo.hdf5", self.name())
    }

    pub fn hdf5(&self) -> PathBuf {
        self.root.join(self.hdf5_relative())
    }

    /// Video of a demonstration, relative to the dataset. `stream` is an index of [`VIDEO_STREAMS`].
    pub fn video_relative(&self, demo: usize, stream: usize) -> String {
        format!("videos/{}/demo_{demo}_{}.mp4", self.name(), VIDEO_STREAMS[stream])
    }

    pub fn preview(&self, demo: usize) -> PathBuf {
        self.root.join(format!("previews/{}/demo_{demo}.mp4", self.name()))
    }

    /// A file of an attempt while the task is being recorded. `kind` is `hdf5`, one of [`VIDEO_STREAMS`]
    /// with `.mp4`, or `preview.mp4`.
    pub fn part(&self, attempt: u32, kind: &str) -> PathBuf {
        self.parts().join(format!("attempt_{attempt:05}.{kind}"))
    }

    pub fn parts(&self) -> PathBuf {
        self.root.join(PARTS).join(self.name())
    }

    /// Videos and preview of an attempt that becomes demonstration `demo`.
    pub fn video_moves(&self, attempt: u32, demo: usize) -> Vec<AttemptFile> {
        let video = |stream: usize| AttemptFile {
            part: self.part(attempt, &format!("{}.mp4", VIDEO_STREAMS[stream])),
            target: self.root.join(self.video_relative(demo, stream)),
        };
        let preview = AttemptFile { part: self.part(attempt, "preview.mp4"), target: self.preview(demo) };
        (0..VIDEO_STREAMS.len()).map(video).chain([preview]).collect()
    }
}

/// True for an HDF5 file and for the folder of a recording, finished or not.
pub fn is_dataset(path: &Path) -> bool {
    let is_hdf5 = path.extension().is_some_and(|extension| extension == "hdf5" || extension == "h5");
    is_hdf5 || path.join(DATASET).is_file() || path.join(RECORDING).is_file()
}

/// Run folder of the attempts at a suite.
pub fn attempts(root: &Path, suite: &str) -> PathBuf {
    root.join(ATTEMPTS).join(suite)
}
