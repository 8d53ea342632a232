//! What there is in a data set: `dataset.json` for programs, `README.md` for people.

use std::{collections::BTreeMap, fmt::Write, path::Path};

use serde::{Deserialize, Serialize};

use super::{
    DatasetError,
    layout::{CARD, DATASET},
};
use crate::files;

/// A task and how it went.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaskCount {
    /// Suite.
    pub suite: String,
    /// Index.
    pub task: usize,
    /// The instruction.
    pub prompt: String,
    /// Asset of the target.
    pub asset: String,
    /// Demonstrations kept.
    pub demos: usize,
    /// Control steps in them.
    pub samples: usize,
    /// Attempts.
    pub attempts: usize,
    /// Attempts that were not kept, by reason.
    pub rejected: BTreeMap<String, usize>,
    /// Bytes of the HDF5 file.
    pub hdf5_bytes: u64,
    /// Bytes of the videos.
    pub video_bytes: u64,
}

/// A file of foreign demonstrations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Imported {
    /// Its name, without the folders above.
    pub file: String,
    /// SHA-256, hexadecimal.
    pub sha256: String,
    /// How it is laid out.
    pub layout: String,
    /// Its demonstrations.
    pub demos: usize,
    /// What was carried out of them.
    pub commands: String,
}

/// A data set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Card {
    /// Version of softvt that recorded it.
    pub softvt: String,
    /// Control steps a second.
    pub fps: u32,
    /// Whether pictures are in the HDF5 files.
    pub pictures: bool,
    /// Whether the privileged streams are there.
    pub privileged: bool,
    /// The files of foreign demonstrations that were re-executed, if it was made of such.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub imported: Vec<Imported>,
    /// Its tasks.
    pub tasks: Vec<TaskCount>,
}

impl Card {
    /// Demonstrations.
    pub fn demos(&self) -> usize {
        self.tasks.iter().map(|task| task.demos).sum()
    }

    /// Control steps.
    pub fn samples(&self) -> usize {
        self.tasks.iter().map(|task| task.samples).sum()
    }

    /// Writes both files, `dataset.json` last: whoever has it is finished.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, root: &Path) -> Result<(), DatasetError> {
        files::replace(&root.join(CARD), self.page().as_bytes())?;
        let path = root.join(DATASET);
        let text = serde_json::to_string_pretty(self)
            .map_err(|e| DatasetError::content(&path, "JSON", e.to_string()))?;
        Ok(files::replace(&path, (text + "\n").as_bytes())?)
    }

    /// Reads `dataset.json`.
    ///
    /// # Errors
    /// It is not there, or no such file.
    pub fn read(root: &Path) -> Result<Self, DatasetError> {
        let path = root.join(DATASET);
        let text = files::read_text(&path)?;
        serde_json::from_str(&text).map_err(|e| DatasetError::content(&path, "JSON", e.to_string()))
    }

    /// The page for people.
    fn page(&self) -> String {
        let bytes = |of: fn(&TaskCount) -> u64| megabytes(self.tasks.iter().map(of).sum());
        let yes = |is: bool| if is { "yes" } else { "no" };
        let hours = self.samples() as f64 / f64::from(self.fps) / 3600.0;
        let mut page = format!(
            "---\nlicense: apache-2.0\ntask_categories:\n- robotics\n---\n\
             # Demonstrations of soft-object manipulation\n\n\
             Recorded by softvt {} in simulation; every demonstration reaches its goal and is safe by softvt's evaluator.\n\n\
             | | |\n|---|---|\n| demonstrations | {} |\n| control steps | {} ({hours:.2} h at {} Hz) |\n\
             | HDF5 | {} MB |\n| videos | {} MB |\n| pictures in HDF5 | {} |\n| privileged streams | {} |\n\n",
            self.softvt,
            self.demos(),
            self.samples(),
            self.fps,
            bytes(|task| task.hdf5_bytes),
            bytes(|task| task.video_bytes),
            yes(self.pictures),
            yes(self.privileged),
        );
        page += "| suite | task | prompt | target | demos | steps | attempts | not kept |\n|---|---|---|---|---|---|---|---|\n";
        for task in &self.tasks {
            let TaskCount { suite, task: id, prompt, asset, demos, samples, attempts, .. } = task;
            let reasons = reasons(&task.rejected);
            // Writing into a string cannot fail.
            let _ = writeln!(
                page,
                "| {suite} | {id} | {prompt} | {asset} | {demos} | {samples} | {attempts} | {reasons} |"
            );
        }
        page += &self.sources();
        page += PAGE;
        page
    }

    /// Where imported demonstrations are from.
    fn sources(&self) -> String {
        if self.imported.is_empty() {
            return String::new();
        }
        let mut text = "\nImported: demonstrations of other worlds, re-executed in this one under its physics and sensors and judged anew.\n\n\
                        | file | SHA-256 | layout | demos | carried out |\n|---|---|---|---|---|\n"
            .to_owned();
        for Imported { file, sha256, layout, demos, commands } in &self.imported {
            // Writing into a string cannot fail.
            let _ = writeln!(text, "| {file} | {sha256} | {layout} | {demos} | {commands} |");
        }
        text
    }
}

/// Reasons with their counts.
pub fn reasons(rejected: &BTreeMap<String, usize>) -> String {
    let told: Vec<String> = rejected.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
    if told.is_empty() { "none".to_owned() } else { told.join(", ") }
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1}", bytes as f64 / 1e6)
}

const PAGE: &str = "
`hdf5/` has one file a task in robomimic's layout, `videos/` four films a demonstration (third person, wrist, left and right
finger with markers), `previews/` the four in one for looking at, `attempts/` a run folder of all attempts, those not kept too,
and `manifest.jsonl` a line a demonstration. Row i of a stream is the state before action i. Units and frames are attributes of
the data sets: SI, actions and tool poses in the robot's base frame, quaternions w x y z with w >= 0. Everything below
`privileged/` is the true state, which no real robot has.

Licence: the scenes and the simulator are softvt's own, under MIT or Apache-2.0; so are these data, unless whoever publishes
them says otherwise.
";
