//! Which demonstrations of a data set become episodes.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use crate::dataset::{
    DatasetError, TaskFile,
    card::Card,
    layout::{DATASET, IMAGE_STREAMS, MANIFEST},
    manifest::{self, ManifestEntry},
};

/// A demonstration that becomes an episode.
#[derive(Clone, Debug)]
pub(super) struct SelectedDemo {
    /// Its HDF5 file.
    pub path: PathBuf,
    /// Its line of the manifest.
    pub entry: ManifestEntry,
    /// Index of its instruction among [`Selection::prompts`].
    pub task: usize,
    /// Steps of the episodes before it.
    pub first: usize,
}

/// What is exported.
#[derive(Clone, Debug)]
pub(super) struct Selection {
    /// The demonstrations, in the order of the manifest.
    pub sources: Vec<SelectedDemo>,
    /// Their instructions, each once, in the order in which they come.
    pub prompts: Vec<String>,
    /// Height and width of the pictures of both cameras in the first of them.
    pub sizes: [[usize; 2]; 2],
}

/// Chooses the demonstrations of a finished recording whose task fits one of the words: an index, or part of a prompt. All if
/// there are no words.
///
/// # Errors
/// It is none, has no pictures, or a word fits no task.
pub(super) fn choose(root: &Path, words: &[String]) -> Result<Selection, DatasetError> {
    let card_path = root.join(DATASET);
    if !card_path.is_file() {
        let what = "it is not there; expected the folder of a finished softvt record";
        return Err(DatasetError::content(root, DATASET, what));
    }
    let card = Card::read(root)?;
    if !card.has_images {
        let what = "its pictures are only videos, which have lost something; record it with --images hdf5";
        return Err(DatasetError::content(&card_path, "pictures", what));
    }
    let entries = fitting(root, manifest::read(root)?, words)?;
    let mut seen = BTreeSet::new();
    if let Some(twice) = entries.iter().find(|entry| !seen.insert((&entry.hdf5_path, entry.demo_id))) {
        let what = format!("{} demo_{} is there twice", twice.hdf5_path, twice.demo_id);
        return Err(DatasetError::content(&root.join(MANIFEST), "lines", what));
    }
    drop(seen);
    let (mut sources, mut prompts, mut first) = (Vec::new(), Vec::<String>::new(), 0);
    for entry in entries {
        let known = prompts.iter().position(|prompt| *prompt == entry.language);
        let task = known.unwrap_or(prompts.len());
        if known.is_none() {
            prompts.push(entry.language.clone());
        }
        let steps = entry.num_samples;
        sources.push(SelectedDemo { path: root.join(&entry.hdf5_path), entry, task, first });
        first += steps;
    }
    let Some(one) = sources.first() else {
        return Err(DatasetError::content(&root.join(MANIFEST), "lines", "there are none"));
    };
    let sizes = sizes(one)?;
    Ok(Selection { sources, prompts, sizes })
}

fn fitting(
    root: &Path,
    entries: Vec<ManifestEntry>,
    words: &[String],
) -> Result<Vec<ManifestEntry>, DatasetError> {
    let fits = |entry: &ManifestEntry, word: &str| match word.parse::<usize>() {
        Ok(index) => entry.task_id == index,
        Err(_) => entry.language.contains(word),
    };
    for word in words {
        if word.trim().is_empty() || !entries.iter().any(|entry| fits(entry, word)) {
            let mut known: Vec<usize> = entries.iter().map(|entry| entry.task_id).collect();
            known.sort_unstable();
            known.dedup();
            let known: Vec<String> = known.iter().map(usize::to_string).collect();
            let what = format!(
                "no task fits --task {word:?}: expected an index or part of a prompt; there are {}",
                known.join(", ")
            );
            return Err(DatasetError::content(root, MANIFEST, what));
        }
    }
    let wanted = |entry: &ManifestEntry| words.is_empty() || words.iter().any(|word| fits(entry, word));
    Ok(entries.into_iter().filter(wanted).collect())
}

/// Height and width of the pictures of both cameras.
fn sizes(source: &SelectedDemo) -> Result<[[usize; 2]; 2], DatasetError> {
    let file = TaskFile::open(&source.path)?;
    let mut sizes = [[0; 2]; 2];
    for (size, name) in sizes.iter_mut().zip(IMAGE_STREAMS) {
        let block = file.images(source.entry.demo_id, &format!("obs/{name}"), 0..1)?;
        *size = [block.height, block.width];
    }
    Ok(sizes)
}
