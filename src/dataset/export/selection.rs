//! Selection of the demonstrations that become episodes.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use super::{ExportConfig, ExportSummary};
use crate::{
    DatasetError, OptionalStream, TaskFile,
    card::DatasetCard,
    layout::{DATASET, MANIFEST},
    manifest::{self, ManifestEntry},
    streams::IMAGES,
};
use softvt_policy::profile::GripCode;

/// Size of an image, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ImageSize {
    pub height: usize,
    pub width: usize,
}

const MOSAIC_SIZE: ImageSize = ImageSize { height: 224, width: 224 };

#[derive(Clone, Debug)]
pub(super) struct SelectedDemo {
    pub path: PathBuf,
    pub entry: ManifestEntry,
    /// Index of its instruction in [`Selection::prompts`].
    pub prompt: usize,
    /// Number of steps in the episodes before it.
    pub first_frame: usize,
}

#[derive(Clone, Debug)]
pub(super) struct Selection {
    /// In the order of the manifest.
    pub demos: Vec<SelectedDemo>,
    /// Distinct instructions in order of appearance.
    pub prompts: Vec<String>,
    /// Image sizes of both cameras in the first demonstration.
    pub image_sizes: [ImageSize; 2],
    /// Code of the last number of an action.
    pub gripper: GripCode,
    pub streams: BTreeSet<OptionalStream>,
    /// True if each demonstration is safe, and does not only reach its goal.
    pub is_safe: bool,
}

impl Selection {
    /// Sizes of the images of a row: both cameras, and the mosaic of the fingers.
    pub(super) fn feature_sizes(&self) -> [ImageSize; 3] {
        let [third_person, wrist] = self.image_sizes;
        [third_person, wrist, MOSAIC_SIZE]
    }

    pub(super) fn summary(&self) -> ExportSummary {
        let frames = self.demos.iter().map(|demo| demo.entry.num_samples).sum();
        ExportSummary { episodes: self.demos.len(), frames, tasks: self.prompts.len() }
    }
}

/// Selects the demonstrations of the tasks that the configuration names.
pub(super) fn select(config: &ExportConfig) -> Result<Selection, DatasetError> {
    let root = &config.data;
    let (entries, card) = (manifest::read(root)?, DatasetCard::read(root)?);
    if !card.has_images {
        let what =
            "images are stored only as videos, whose compression is lossy; record them in the HDF5 files";
        return Err(DatasetError::content(&root.join(DATASET), "pictures", what));
    }
    card.one_recording(root, &entries)?;
    let entries = matching_entries(root, entries, &config.tasks)?;
    let (mut demos, mut prompts, mut first_frame) = (Vec::new(), Vec::<String>::new(), 0);
    for entry in entries {
        let known = prompts.iter().position(|prompt| *prompt == entry.language);
        let prompt = known.unwrap_or(prompts.len());
        if known.is_none() {
            prompts.push(entry.language.clone());
        }
        let steps = entry.num_samples;
        demos.push(SelectedDemo { path: root.join(&entry.hdf5_path), entry, prompt, first_frame });
        first_frame += steps;
    }
    let Some(first) = demos.first() else {
        return Err(DatasetError::content(&root.join(MANIFEST), "lines", "it is empty"));
    };
    let image_sizes = image_sizes(first)?;
    let gripper = config.gripper.or(card.gripper).unwrap_or_default();
    let is_safe = card.keep.is_safe();
    Ok(Selection { demos, prompts, image_sizes, gripper, streams: card.streams, is_safe })
}

fn matching_entries(
    root: &Path,
    entries: Vec<ManifestEntry>,
    words: &[String],
) -> Result<Vec<ManifestEntry>, DatasetError> {
    let matches = |entry: &ManifestEntry, word: &str| match word.parse::<usize>() {
        Ok(index) => entry.task_id == index,
        Err(_) => entry.language.contains(word),
    };
    for word in words {
        if word.trim().is_empty() || !entries.iter().any(|entry| matches(entry, word)) {
            let known: BTreeSet<usize> = entries.iter().map(|entry| entry.task_id).collect();
            let known: Vec<String> = known.iter().map(usize::to_string).collect();
            let what = format!(
                "no task matches {word:?}: expected an index or part of a prompt; the recording has the tasks {}",
                known.join(", ")
            );
            return Err(DatasetError::content(root, MANIFEST, what));
        }
    }
    let is_selected =
        |entry: &ManifestEntry| words.is_empty() || words.iter().any(|word| matches(entry, word));
    Ok(entries.into_iter().filter(is_selected).collect())
}

fn image_sizes(demo: &SelectedDemo) -> Result<[ImageSize; 2], DatasetError> {
    let file = TaskFile::open(&demo.path)?;
    let size = |name: &str| -> Result<ImageSize, DatasetError> {
        let block = file.images(demo.entry.demo_id, name, 0..1)?;
        Ok(ImageSize { height: block.height, width: block.width })
    };
    Ok([size(IMAGES[0])?, size(IMAGES[1])?])
}
