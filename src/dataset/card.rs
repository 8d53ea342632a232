//! [`DatasetCard`]: contents of a dataset, as `dataset.json` and as a human-readable `README.md`.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use serde::{Deserialize, Serialize};

use super::{
    DatasetError, OptionalStream,
    layout::{CARD, DATASET, MANIFEST},
    manifest::ManifestEntry,
};
use softvt_common::files;
use softvt_policy::profile::GripCode;
use softvt_runs::manifest::ImportedFile;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaskCount {
    pub suite: String,
    /// Task index in the suite.
    pub task: usize,
    pub prompt: String,
    pub asset: String,
    pub demos: usize,
    pub samples: usize,
    /// Attempts, kept or not.
    pub attempts: usize,
    /// Rejected attempts, by reason.
    pub rejected: BTreeMap<String, usize>,
    pub hdf5_bytes: u64,
    pub video_bytes: u64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DatasetCard {
    /// Version of softvt that recorded it.
    pub softvt: String,
    /// Control steps per second.
    pub fps: u32,
    /// True if images are stored in the HDF5 files.
    #[serde(rename = "pictures")]
    pub has_images: bool,
    /// True if privileged streams are stored.
    #[serde(rename = "privileged")]
    pub has_privileged: bool,
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    pub streams: BTreeSet<OptionalStream>,
    /// Outcome of all demonstrations.
    #[serde(default, skip_serializing_if = "KeptOutcome::is_safe")]
    pub keep: KeptOutcome,
    /// Grip code of exports that name none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gripper: Option<GripCode>,
    /// Source files, if the demonstrations were imported.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub imported: Vec<ImportedFile>,
    pub tasks: Vec<TaskCount>,
}

/// Outcome that an attempt must have to become a demonstration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum KeptOutcome {
    /// Safety Success: the goal without a drop, within the deformation limit.
    #[default]
    Safe,
    /// Goal Success, also if the object was dropped or deformed too much.
    Goal,
}

impl KeptOutcome {
    pub fn is_safe(&self) -> bool {
        *self == Self::Safe
    }

    /// The outcome of every demonstration, in words.
    fn words(self) -> &'static str {
        match self {
            Self::Safe => "reaches its goal and is safe by softvt's evaluator",
            Self::Goal => {
                "reaches its goal by softvt's evaluator; some are not safe (`success` of manifest.jsonl is false)"
            }
        }
    }
}

impl DatasetCard {
    pub fn demos(&self) -> usize {
        self.tasks.iter().map(|task| task.demos).sum()
    }

    pub fn samples(&self) -> usize {
        self.tasks.iter().map(|task| task.samples).sum()
    }

    /// Checks that the lines of the manifest are of one recording, and of the tasks of this card.
    pub fn one_recording(&self, root: &Path, entries: &[ManifestEntry]) -> Result<(), DatasetError> {
        let (mut seen, mut attempts) = (BTreeSet::new(), BTreeSet::new());
        let foreign = entries.iter().position(|entry| {
            let is_known =
                self.tasks.iter().any(|task| task.task == entry.task_id && task.suite == entry.suite);
            let is_new = seen.insert((&entry.hdf5_path, entry.demo_id));
            // Several imported demonstrations may be of one attempt.
            let is_new_attempt =
                entry.origin.is_some() || attempts.insert((&entry.suite, entry.task_id, entry.episode));
            !is_known || !is_new || !is_new_attempt || entry.seed != entries[0].seed
        });
        let Some(index) = foreign else { return Ok(()) };
        let what = "files of several recordings are in one folder; record their tasks together (softvt record --task), \
                    or use each recording by itself";
        Err(DatasetError::content(&root.join(MANIFEST), format!("line {}", index + 1), what))
    }

    /// Writes both files, `dataset.json` last: its presence marks a complete dataset.
    pub fn write(&self, root: &Path) -> Result<(), DatasetError> {
        files::replace(&root.join(CARD), self.page().as_bytes())?;
        Ok(files::write_json(&root.join(DATASET), self)?)
    }

    pub fn read(root: &Path) -> Result<Self, DatasetError> {
        let path = root.join(DATASET);
        let text = files::read_text(&path)?;
        serde_json::from_str(&text).map_err(|e| DatasetError::content(&path, "JSON", e.to_string()))
    }

    /// The text of `README.md`.
    fn page(&self) -> String {
        let megabytes =
            |of: fn(&TaskCount) -> u64| format!("{:.1}", self.tasks.iter().map(of).sum::<u64>() as f64 / 1e6);
        let yes = |is: bool| if is { "yes" } else { "no" };
        let hours = self.samples() as f64 / f64::from(self.fps) / 3600.0;
        let task = |task: &TaskCount| {
            let TaskCount { suite, task: id, prompt, asset, demos, samples, attempts, rejected, .. } = task;
            let reasons = rejection_counts(rejected);
            format!(
                "| {suite} | {id} | {prompt} | {asset} | {demos} | {samples} | {attempts} | {reasons} |\n"
            )
        };
        let source = |source: &ImportedFile| {
            let ImportedFile { file, sha256, format, demos, commands } = source;
            format!("| {file} | {sha256} | {format} | {demos} | {commands} |\n")
        };
        let streams: Vec<&str> = self.streams.iter().map(|stream| stream.name()).collect();
        let streams = match &streams[..] {
            [] => String::new(),
            some => format!("| further streams | {} |\n", some.join(", ")),
        };
        let mut page = format!(
            "---\nlicense: apache-2.0\ntask_categories:\n- robotics\n---\n\
             # Demonstrations of soft-object manipulation\n\n\
             Recorded by softvt {} in simulation; every demonstration {}.\n\n\
             | | |\n|---|---|\n| demonstrations | {} |\n| control steps | {} ({hours:.2} h at {} Hz) |\n\
             | HDF5 | {} MB |\n| videos | {} MB |\n| images in HDF5 | {} |\n| privileged streams | {} |\n{streams}\n",
            self.softvt,
            self.keep.words(),
            self.demos(),
            self.samples(),
            self.fps,
            megabytes(|task| task.hdf5_bytes),
            megabytes(|task| task.video_bytes),
            yes(self.has_images),
            yes(self.has_privileged),
        );
        page += "| suite | task | prompt | target | demos | steps | attempts | rejected |\n|---|---|---|---|---|---|---|---|\n";
        page.extend(self.tasks.iter().map(task));
        if !self.imported.is_empty() {
            page += "\nImported: demonstrations from other simulators, re-executed with softvt's physics and sensors and judged again.\n\n";
            page += "| file | SHA-256 | format | demos | executed |\n|---|---|---|---|---|\n";
            page.extend(self.imported.iter().map(source));
        }
        page + PAGE
    }
}

/// Reasons of rejection with their counts, as text.
pub fn rejection_counts(rejected: &BTreeMap<String, usize>) -> String {
    let counts: Vec<String> = rejected.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
    if counts.is_empty() { "none".to_owned() } else { counts.join(", ") }
}

const PAGE: &str = "
`hdf5/` has one file per task in robomimic's layout. `videos/` has four videos per demonstration: third person, wrist, and left
and right finger with markers; `previews/` shows the four in one. `attempts/` has a run folder of all attempts, including
rejected ones, and `manifest.jsonl` one line per demonstration. Row i of a stream is the state before action i. Units and frames
are attributes of the HDF5 datasets: SI, actions and tool poses in the robot's base frame, quaternions w x y z with w >= 0.
Everything below `privileged/` is ground truth that no real robot has.

Licence: the scenes and the simulator are softvt's own, under MIT or Apache-2.0, and so are these data unless their publisher
states otherwise.
";
