//! The [`RunManifest`] of a prepared run.

use std::collections::{BTreeMap, BTreeSet};

use crate::suite_run::PreparedRun;
use softvt_benchmark::{Plan, run_changes::RunChanges};
use softvt_common::digest::sha256_hex;
use softvt_evaluation::deformation::METRIC_ID;
use softvt_runs::manifest::{RunManifest, VERSION, in_project, working_folder};

impl PreparedRun<'_> {
    /// The manifest of the run, with `episodes` per task.
    pub(crate) fn manifest(&self, episodes: u32) -> RunManifest {
        let (config, policy) = (self.config, &self.config.policy);
        let RunChanges { arguments, shifts, set, twin, vary, seed, seed_hash } = config.changes();
        let options = self.loaded.options.iter();
        RunManifest {
            softvt: VERSION.to_owned(),
            script: self.loaded.sources.main.clone(),
            suite: self.suite.name.clone(),
            several_suites: !matches!(self.loaded.plan, Plan::Suite(_)),
            variation: self.suite.vary.clone(),
            // Of the suite as it is: neither of its twin, nor with another variation.
            needs: self.suite.needs.filter(|_| vary.is_none() && twin.is_none()),
            twin,
            vary,
            twin_of: self.suite.twin_of.clone(),
            policy: policy.name.clone(),
            profile: policy.profile().cloned(),
            gripper: policy.gripper,
            served: policy.is_client(),
            policy_file: policy.file.clone(),
            replayed: self.replay_source.clone(),
            imported: self.import.files.clone(),
            replan: policy.replan,
            privileged: self.is_privileged(),
            blind: policy.is_blind_bound(),
            seed,
            seed_hash,
            split: self.split,
            tasks: self.jobs.tasks().iter().map(|task| task.id).collect(),
            episodes,
            selected_episodes: config.selected_episodes.clone(),
            shard: config.shard,
            shifts,
            options: options.map(|option| (option.name.clone(), format!("{:?}", option.value))).collect(),
            arguments,
            set,
            settings: self.settings.clone(),
            sources: self.sources.clone(),
            modified: modified(&self.sources),
            metric_id: METRIC_ID.to_owned(),
            thresholds: self.calibrations.tau_pct.clone(),
            force_observed: self.force_observed,
            folder: Some(working_folder()),
        }
    }
}

/// The files that the library of the binary has in another version, by their path there.
fn modified(sources: &BTreeMap<String, String>) -> BTreeSet<String> {
    let is_other = |(name, hash): &(&str, &String)| {
        softvt_script::embedded(name).is_some_and(|own| sha256_hex(own) != **hash)
    };
    let sources = sources.iter().map(|(name, hash)| (in_project(name), hash));
    sources.filter(is_other).map(|(name, _)| name.to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_differ_from_those_of_the_binary_are_named() {
        let own = |path: &str| sha256_hex(softvt_script::embedded(path).unwrap());
        let other = "0".repeat(64);
        let sources = [
            ("/home/me/softvt/scripts/shifts.lua", own("scripts/shifts.lua")),
            ("../scripts/layouts/floor.lua", other.clone()),
            ("assets/calibration/cube.json", other.clone()),
            ("mine.lua", other),
        ];
        let sources = sources.map(|(name, hash)| (name.to_owned(), hash)).into();
        let named: Vec<String> = modified(&sources).into_iter().collect();
        assert_eq!(named, ["assets/calibration/cube.json", "scripts/layouts/floor.lua"]);
    }
}
