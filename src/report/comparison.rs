//! Paired comparison of runs, episode by episode: of policies with each other, and of conditions with their reference.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use serde::Serialize;

use super::task_names::TaskName;
use softvt_common::{episode_id::EpisodeId, text::counted};
use softvt_runs::{
    paired_stats::{EpisodeKey, EpisodePair, PairedComparison, group_by_task, pair_episodes},
    record::{EpisodeHeader, EpisodeRecord},
    stored_run::{StoredRun, records_as},
    summary::{GroupScores, method_label},
};

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskDifferences {
    pub suite: String,
    pub task: usize,
    pub prompt: String,
    pub asset: String,
    /// The second run minus the first.
    #[serde(flatten)]
    pub differences: PairedComparison,
}

impl TaskDifferences {
    pub(super) fn name(&self) -> TaskName<'_> {
        TaskName { prompt: &self.prompt, asset: &self.asset }
    }
}

pub(super) struct ComparedRun<'a> {
    /// The episodes that both have.
    pub(super) pairs: Vec<EpisodePair<'a>>,
    /// The run minus the reference.
    pub(super) differences: PairedComparison,
}

impl<'a> ComparedRun<'a> {
    pub(super) fn new(
        reference: impl IntoIterator<Item = &'a EpisodeRecord>,
        records: impl IntoIterator<Item = &'a EpisodeRecord>,
    ) -> Self {
        let pairs = pair_episodes(reference, records);
        Self { differences: PairedComparison::from_pairs(&pairs), pairs }
    }

    /// Scores of the run in the episodes that the reference has as well.
    pub(super) fn scores(&self) -> GroupScores {
        GroupScores::from_records(&self.pairs.iter().map(|pair| pair.second).collect::<Vec<_>>())
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunComparison {
    /// Policy of the first run, with its privileged inputs.
    pub first: String,
    /// Policy of the second run.
    pub second: String,
    /// Headings of both runs: their policies, or their folders if the policies have one name.
    pub headings: Vec<String>,
    /// True if any target deforms.
    pub deformable: bool,
    /// Number of episodes present in only one run.
    pub unpaired: usize,
    /// Fields of `run.json`, other than the policy, in which the runs differ.
    pub differing_fields: Vec<String>,
    /// Pairs of a suite and its rigid twin, one sentence per pair; empty for runs of the same suites.
    pub pairing: Vec<String>,
    /// One sentence per run with missing episodes.
    pub incomplete: Vec<String>,
    /// Over all common episodes.
    pub all: PairedComparison,
    /// Per task, in order.
    pub by_task: Vec<TaskDifferences>,
}

/// Runs that have no episode in common, or one twice.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct CompareError(String);

/// Compares the episodes common to `first` and `second`, each the runs of one folder, one per suite.
///
/// # Errors
/// An episode occurs twice on one side, or there is no common episode.
pub fn compare(first: &[StoredRun], second: &[StoredRun]) -> Result<RunComparison, CompareError> {
    if let Some(error) = [first, second].into_iter().find_map(unusable) {
        return Err(error);
    }
    let (twins, mut pairing) = with_twins_paired(first, second);
    let [first, second] = &twins;
    let count = |runs: &[StoredRun]| -> usize { runs.iter().map(|run| run.records.len()).sum() };
    let ComparedRun { pairs, differences } = ComparedRun::new(records(first), records(second));
    // A public seed may equal the one in the results of a judged run, whose draws are others.
    let hashes = |runs: &[StoredRun]| runs.iter().map(seed_hash).collect::<BTreeSet<_>>();
    if pairs.is_empty() || hashes(first).is_disjoint(&hashes(second)) {
        return Err(no_common_episode(first, second));
    }
    pairing.extend(other_layouts(first, second));
    let task = |pairs: &[EpisodePair]| {
        let header @ EpisodeHeader { id, asset, .. } = &pairs[0].first.header;
        let differences = PairedComparison::from_pairs(pairs);
        let (suite, asset) = (id.suite.clone(), asset.clone());
        TaskDifferences { suite, task: id.task, prompt: header.task_prompt().to_owned(), asset, differences }
    };
    let all = || first.iter().chain(second);
    Ok(RunComparison {
        first: policies(first),
        second: policies(second),
        headings: names(&[first, second]),
        deformable: pairs.iter().any(|pair| pair.first.has_soft_target()),
        unpaired: count(first) + count(second) - 2 * pairs.len(),
        differing_fields: differing_fields(first, second).into_iter().collect(),
        pairing,
        incomplete: all()
            .filter(|run| run.is_partial())
            .flat_map(|run| run.warnings().into_iter().take(1))
            .collect(),
        all: differences,
        by_task: group_by_task(&pairs).map(task).collect(),
    })
}

/// A sentence about the episodes that both sides have in different layouts; they are not paired.
fn other_layouts(first: &[StoredRun], second: &[StoredRun]) -> Option<String> {
    let layouts: BTreeMap<_, _> =
        records(second).map(|record| (&record.header.id, record.header.layout.as_str())).collect();
    let mut differing = records(first).filter_map(|record| {
        let EpisodeHeader { id, layout, .. } = &record.header;
        let other = layouts.get(id).filter(|other| **other != layout.as_str())?;
        Some(format!("{} {}, {layout} and {other}", id.suite, id.index()))
    });
    let first = differing.next()?;
    let count = 1 + differing.count();
    let (episodes, are) = (counted(count, "episode"), if count == 1 { "is" } else { "are" });
    Some(format!("{episodes} that both runs have {are} not paired: the layouts differ (first: {first})"))
}

/// The runs, with the records of rigid twins under the name of the soft original if the other side has that: initial
/// states and prompts are the same. Also a sentence about each such pair.
fn with_twins_paired(first: &[StoredRun], second: &[StoredRun]) -> ([Vec<StoredRun>; 2], Vec<String>) {
    let mut sides = [first.to_vec(), second.to_vec()];
    let mut pairing = Vec::new();
    for (side, own, others) in [(0, first, second), (1, second, first)] {
        for run in sides[side].iter_mut().filter(|run| run.is_rigid_twin()) {
            let is_original =
                |other: &&StoredRun| !other.is_rigid_twin() && other.suite() == run.original_suite();
            // A folder with both has the original for the pair.
            if own.iter().any(|run| is_original(&run)) {
                continue;
            }
            let Some(original) = others.iter().find(is_original).map(|other| other.suite().to_owned()) else {
                continue;
            };
            pairing.push(format!(
                "{} is the rigid twin of {original}; their episodes are paired by task and episode",
                run.suite()
            ));
            run.records = records_as(&run.records, &original);
        }
    }
    (sides, pairing)
}

pub(super) fn records(runs: &[StoredRun]) -> impl Iterator<Item = &EpisodeRecord> {
    runs.iter().flat_map(|run| &run.records)
}

/// The error of a folder that has no episode, or one twice, of which one would be ignored.
pub(super) fn unusable(runs: &[StoredRun]) -> Option<CompareError> {
    let mut known = BTreeMap::new();
    for run in runs {
        let dir = run.dir.display();
        if run.records.is_empty() && runs.len() == 1 {
            return Some(CompareError(format!("{dir} has no episode yet")));
        }
        for record in &run.records {
            if let Some(other) = known.insert(EpisodeKey::new(record), run.dir.display()) {
                let EpisodeId { suite, task, episode, .. } = &record.header.id;
                return Some(CompareError(format!(
                    "{other} and {dir} both hold suite {suite} task {task} episode {episode}: compare one run per suite; give its folder"
                )));
            }
        }
    }
    None
}

/// Hash of the secret seed of a judged run.
fn seed_hash(run: &StoredRun) -> String {
    run.manifest.seed_hash.clone().unwrap_or_else(|| "none".to_owned())
}

/// The error about two runs without common episodes, with the property in which they differ.
pub(super) fn no_common_episode(first: &[StoredRun], second: &[StoredRun]) -> CompareError {
    type Property = fn(&StoredRun) -> String;
    let properties: [(&str, Property); 5] = [
        ("suite", |run| run.suite().to_owned()),
        ("seed hash", seed_hash),
        ("seed", |run| run.manifest.seed.to_string()),
        ("split", |run| run.manifest.split.name().to_owned()),
        ("tasks", |run| format!("{:?}", run.manifest.tasks)),
    ];
    let differing = properties.iter().find_map(|(name, property)| {
        let [a, b] = [first, second].map(|runs| runs.iter().map(property).collect::<BTreeSet<_>>());
        let describe = || format!("{name} {} in the first, {} in the second", joined(&a), joined(&b));
        a.is_disjoint(&b).then(describe)
    });
    let [first, second] = [first, second]
        .map(|runs| runs.first().map_or_else(String::new, |run| run.dir.display().to_string()));
    let reason = differing.unwrap_or_else(|| "their finished episodes do not overlap".to_owned());
    CompareError(format!("{first} and {second} share no episode: {reason}"))
}

fn joined(names: &BTreeSet<String>) -> String {
    names.iter().map(String::as_str).collect::<Vec<_>>().join(", ")
}

fn policies(runs: &[StoredRun]) -> String {
    let label = |run: &StoredRun| method_label(&run.manifest.policy, run.marks());
    joined(&runs.iter().map(label).collect())
}

/// Names of folders with runs that differ: their policies, or their own names.
pub(super) fn names(folders: &[impl AsRef<[StoredRun]>]) -> Vec<String> {
    let policy = |runs: &[StoredRun]| joined(&runs.iter().map(|run| run.manifest.policy.clone()).collect());
    let policies: Vec<String> = folders.iter().map(|runs| policy(runs.as_ref())).collect();
    let folder = |runs: &[StoredRun]| match runs {
        [run] => run.dir.clone(),
        // The runs of several suites are in one folder.
        _ => runs.first().and_then(|run| run.dir.parent()).map_or_else(PathBuf::new, Path::to_owned),
    };
    let name = |path: PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned());
    let own: Vec<String> =
        folders.iter().map(|runs| name(folder(runs.as_ref())).unwrap_or_default()).collect();
    let differ = |names: &&Vec<String>| names.iter().collect::<BTreeSet<_>>().len() == names.len();
    let numbered = || (1..=folders.len()).map(|number| format!("run {number}")).collect();
    [&policies, &own].into_iter().find(differ).cloned().unwrap_or_else(numbered)
}

/// Fields of `run.json` about the conditions of a run in which two runs of one suite differ.
pub(super) fn differing_fields(first: &[StoredRun], second: &[StoredRun]) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for a in first {
        let Some(b) = second.iter().find(|b| b.suite() == a.suite()) else { continue };
        found.extend(a.manifest.differing_conditions(&b.manifest));
    }
    found
}

/// One sentence for each run whose scripts or limits differ from the first run of its suite.
pub(super) fn differing_files(runs: &[&StoredRun]) -> Vec<String> {
    let sentence = |run: &&StoredRun| {
        let first = runs.iter().find(|first| first.suite() == run.suite())?;
        let fields = first.manifest.differing_files(&run.manifest).join(" and ");
        let [first, run] = [first.dir.display(), run.dir.display()];
        (!fields.is_empty()).then(|| format!("{first} and {run} have different {fields}"))
    };
    runs.iter().filter_map(sentence).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::policy_ranking::PolicyRanking;
    use crate::{run_summary::tests::stored, sample_record};

    fn run(dir: &str) -> StoredRun {
        let record = |episode: u32| {
            let mut record = sample_record();
            record.header.id.episode = episode;
            record
        };
        stored(dir, "pi", (0..3).map(record).collect())
    }

    fn compared(a: &StoredRun, b: &StoredRun) -> RunComparison {
        compare(std::slice::from_ref(a), std::slice::from_ref(b)).expect("common episodes")
    }

    #[test]
    fn differing_files_and_limits_of_runs_are_named() {
        let (whole, mut part) = (run("a"), run("b"));
        part.manifest.sources.insert("x.lua".to_owned(), "9".to_owned());
        part.manifest.thresholds.insert("bun".to_owned(), Some(1.5));
        let differing = ["sources (x.lua)", "thresholds (bun)"];
        assert_eq!(compared(&whole, &part).differing_fields, differing);
        let warnings = differing_files(&[&whole, &part, &whole]);
        assert_eq!(warnings, ["a and b have different sources (x.lua) and thresholds (bun)"]);
        let three = PolicyRanking::new(&[&whole, &whole, &part].map(|run| vec![run.clone()]));
        assert_eq!(three.expect("common episodes").differing_fields, differing);
    }

    #[test]
    fn episodes_of_other_layouts_are_said_not_to_be_paired() {
        let (a, mut b) = (run("a"), run("b"));
        let own = a.records[1].header.layout.clone();
        b.records[1].header.layout = "other".to_owned();
        let RunComparison { all, unpaired, pairing, .. } = compared(&a, &b);
        assert_eq!((all.pairs, unpaired), (2, 2));
        let sentence = "1 episode that both runs have is not paired: the layouts differ (first: ";
        assert!(pairing[0].starts_with(sentence), "{pairing:?}");
        assert!(pairing[0].ends_with(&format!(", {own} and other)")), "{pairing:?}");
        assert_eq!(compared(&a, &a).pairing, [""; 0]);
    }

    #[test]
    fn runs_have_the_names_of_their_policies_or_of_their_folders() {
        let (a, mut b) = (run("runs/a"), run("runs/b"));
        assert_eq!(compared(&a, &b).headings, ["a", "b"], "one policy in two folders");
        b.manifest.policy = "servo".to_owned();
        assert_eq!(compared(&a, &b).headings, ["pi", "servo"]);
    }
}
