//! [`RunSummary`]: a run with its results and a distinct name.

use std::collections::{BTreeMap, BTreeSet};

use super::comparison::differing_files;
use softvt_common::text::decimal;
use softvt_evaluation::{drop::DropReason, verdict::Outcome};
use softvt_runs::{
    record::EpisodeRecord,
    stored_run::StoredRun,
    summary::{GroupScores, MethodMarks, SuiteSummary},
};

#[derive(Clone, Debug)]
pub struct RunSummary {
    pub run: StoredRun,
    pub summary: SuiteSummary,
    /// Policy, its privileged inputs, and what distinguishes this run from others of its suite.
    pub method: String,
}

#[derive(Clone, Debug)]
pub struct UnsafeEpisode<'a> {
    pub record: &'a EpisodeRecord,
    pub reason: String,
}

/// Summarises runs, sorted by suite. A run under conditions follows its reference, in the order of factors and
/// values. A folder given twice counts once.
pub fn summarize_runs(mut runs: Vec<StoredRun>) -> Vec<RunSummary> {
    let mut seen = BTreeSet::new();
    runs.retain(|run| seen.insert(run.dir.canonicalize().unwrap_or_else(|_| run.dir.clone())));
    let mut groups: BTreeMap<[String; 5], usize> = BTreeMap::new();
    for (position, run) in runs.iter().enumerate() {
        groups.entry(run.condition_group()).or_insert(position);
    }
    let mut all: Vec<RunSummary> = runs.into_iter().map(summarize).collect();
    all.sort_by(|a, b| {
        let group = |run: &RunSummary| groups.get(&run.run.condition_group());
        let by_change = || match (a.run.condition(), b.run.condition()) {
            (Some(a), Some(b)) => a.compare(&b),
            (a, b) => a.is_some().cmp(&b.is_some()),
        };
        a.summary.suite.cmp(&b.summary.suite).then_with(|| group(a).cmp(&group(b))).then_with(by_change)
    });
    let names: Vec<String> = all.iter().map(RunSummary::name).collect();
    for (run, name) in all.iter_mut().zip(&names) {
        if names.iter().filter(|other| *other == name).count() > 1 {
            run.method += &format!(" · {}", run.run.dir.display());
        }
    }
    all
}

fn summarize(run: StoredRun) -> RunSummary {
    let mut summary = SuiteSummary::from_records(run.suite(), &run.manifest.policy, &run.records);
    // An unfinished run has no episode yet that says so.
    let MethodMarks { privileged, replayed, force_observed } = run.marks();
    summary.privileged |= privileged;
    summary.replayed |= replayed;
    summary.force_observed |= force_observed;
    let mut method = summary.method_label();
    // Changes to the suite, such as `mass=2`.
    let changes = run.manifest.changes().assignments();
    if !changes.is_empty() {
        method += &format!(" · {}", changes.join(", "));
    }
    RunSummary { run, summary, method }
}

/// Caveats of the results of these runs, one sentence each.
pub fn caveats(runs: &[RunSummary]) -> Vec<String> {
    let of_run = |run: &RunSummary| {
        let dir = run.run.dir.display();
        let notes = run.summary.attempt_notes().into_iter().map(|note| format!("{dir}: {note}"));
        run.run.warnings().into_iter().chain(notes).collect::<Vec<_>>()
    };
    let stored: Vec<&StoredRun> = runs.iter().map(|run| &run.run).collect();
    runs.iter().flat_map(of_run).chain(differing_files(&stored)).collect()
}

impl RunSummary {
    pub fn scores(&self) -> &GroupScores {
        &self.summary.scores
    }

    pub fn is_soft(&self) -> bool {
        self.summary.scores.is_soft()
    }

    pub fn name(&self) -> String {
        format!("{}, {}", self.summary.suite, self.method)
    }

    pub fn unsafe_episodes(&self) -> Vec<UnsafeEpisode<'_>> {
        self.run
            .records
            .iter()
            .filter_map(|record| Some(UnsafeEpisode { record, reason: unsafe_reason(record)? }))
            .collect()
    }
}

/// Reasons of a failure: the outcome, the controller, the goal and a drop.
pub fn failures(record: &EpisodeRecord) -> Vec<String> {
    let (v, mut parts) = (&record.verdict, Vec::new());
    match &record.outcome {
        Outcome::Invalid { reason, step, .. } => {
            parts.push(format!("invalid: {reason} at physics step {step}"))
        }
        Outcome::Error { message } => parts.push(message.clone()),
        Outcome::Budget if !v.goal => parts.push("the budget ran out".to_owned()),
        Outcome::Budget | Outcome::Completed => {}
    }
    if let Some(why) = &record.stats.gave_up {
        parts.push(format!("gave up: {why}"));
    }
    if let Some(stage) = v.failed_stage {
        parts.push(format!("failed while: {}", stage.name()));
    }
    parts.extend(record.missed_parts());
    // An invalid episode has no evidence; nothing was dropped.
    if let Some(drop) = v.drop.as_ref().filter(|drop| drop.reason != DropReason::NoEvidence) {
        let reason =
            serde_json::to_value(drop.reason).ok().and_then(|v| v.as_str().map(|s| s.replace('_', " ")));
        parts.push(format!("dropped at {:.1} s: {}", drop.time_s, reason.unwrap_or_default()));
    }
    if v.wrong_instance {
        parts.push("another object was lifted first".to_owned());
    }
    parts
}

/// Reason for an episode to be unsafe; `None` if it is safe.
pub fn unsafe_reason(record: &EpisodeRecord) -> Option<String> {
    let v = &record.verdict;
    if v.safety {
        return None;
    }
    let mut parts = failures(record);
    for target in record.soft_targets() {
        let object = target.object.as_deref();
        let name = object.map(|object| format!("{object}: ")).unwrap_or_default();
        match (target.d_peak, target.tau) {
            (Some(d), Some(tau)) if d > tau => parts.push(format!("{name}D {d:.2} % is above τ {tau:.2} %")),
            (_, None) => parts.push(format!("{} has no threshold", object.unwrap_or("the object"))),
            _ => {}
        }
    }
    if v.slip_ok == Some(false) {
        parts.push(format!("it slipped by {:.1} mm in the hand", v.slip_mm));
    }
    for other in v.others.iter().filter(|other| other.deformation_ok == Some(false)) {
        let [d, tau] = [other.d_peak, other.tau].map(|x| decimal(x, 2));
        parts.push(format!("{}: D {d} % is above its τ {tau} %", other.object));
    }
    if parts.is_empty() && !v.safety_known {
        parts.push("evidence is missing".to_owned());
    }
    Some(parts.join("; "))
}

#[cfg(test)]
pub(super) mod tests {
    use std::path::Path;

    use super::*;
    use crate::{sample_manifest, sample_record};
    use softvt_benchmark::ShiftValue;
    use softvt_evaluation::{drop::DropEvent, stage::TaskStage};
    use softvt_runs::manifest::{ReplaySource, RunManifest};

    pub(crate) fn shift(name: &str, value: f64) -> ShiftValue {
        ShiftValue { name: name.to_owned(), value }
    }

    /// A finished run of `records` in the folder `dir`.
    pub(crate) fn stored(dir: &str, policy: &str, mut records: Vec<EpisodeRecord>) -> StoredRun {
        for record in &mut records {
            (record.header.policy, record.header.privileged) = (policy.into(), policy == "expert");
        }
        let suite = records.first().map_or("suite", |record| &record.header.id.suite);
        let manifest = RunManifest {
            suite: suite.to_owned(),
            policy: policy.to_owned(),
            privileged: policy == "expert",
            episodes: records.len() as u32,
            ..sample_manifest()
        };
        StoredRun { dir: Path::new(dir).into(), manifest, records, is_finished: true, is_truncated: false }
    }

    #[test]
    fn conditions_follow_their_reference_in_the_order_of_values() {
        let run = |dir: &str, policy: &str, change: Option<(&str, f64)>| {
            let mut run = stored(dir, policy, vec![sample_record()]);
            run.manifest.shifts.extend(change.map(|(name, value)| shift(name, value)));
            run
        };
        let runs = vec![
            run("a", "pi", Some(("mass", 10.0))),
            run("b", "pi", Some(("mass", 2.5))),
            run("c", "noop", None),
            run("d", "pi", None),
            run("e", "pi", Some(("light", 2.0))),
        ];
        let names: Vec<String> = summarize_runs(runs).into_iter().map(|run| run.method).collect();
        assert_eq!(names, ["pi", "pi · light=2", "pi · mass=2.5", "pi · mass=10", "noop"]);
    }

    #[test]
    fn runs_of_one_suite_have_distinct_names() {
        let plain = stored("runs/a", "expert", vec![sample_record()]);
        let mut heavy = stored("runs/b", "expert", vec![sample_record()]);
        heavy.manifest.shifts.push(shift("mass", 2.0));
        heavy.manifest.set.push(("robot.gripper.effort".to_owned(), "3".to_owned()));
        let mut forces = stored("runs/c", "pi", vec![sample_record()]);
        forces.manifest.force_observed = true;
        let names = |runs: &[&StoredRun]| -> Vec<String> {
            summarize_runs(runs.iter().map(|run| (*run).clone()).collect())
                .into_iter()
                .map(|j| j.method)
                .collect()
        };
        assert_eq!(
            names(&[&plain, &heavy, &forces]),
            [
                "expert (privileged)",
                "expert (privileged) · mass=2, robot.gripper.effort=3",
                "pi (force_observed)"
            ]
        );
        assert_eq!(names(&[&plain, &plain]).len(), 1, "a folder that is given twice");
        let again = StoredRun { dir: "runs/d".into(), ..plain.clone() };
        assert_eq!(
            names(&[&plain, &again]),
            ["expert (privileged) · runs/a", "expert (privileged) · runs/d"]
        );
    }

    #[test]
    fn recorded_actions_and_names_of_privileged_policies_are_marked_whatever_the_record_says() {
        let mut replayed = stored("a", "pi05", vec![sample_record()]);
        replayed.manifest.replayed = Some(ReplaySource {
            run: "b".to_owned(),
            policy: "x".to_owned(),
            privileged: false,
            force_observed: false,
            sha256: String::new(),
        });
        let mut named = stored("b", "expert-binary", vec![sample_record()]);
        named.manifest.privileged = false;
        let runs = summarize_runs(vec![replayed, named]);
        let methods: Vec<&str> = runs.iter().map(|run| run.method.as_str()).collect();
        assert_eq!(methods, ["pi05 (replayed)", "expert-binary (privileged)"]);
        let rows = crate::leaderboard::rows(&runs);
        let marks = |row: &str| {
            let row: serde_json::Value = serde_json::from_str(row).unwrap();
            [&row["privileged"], &row["replayed"]].map(|mark| mark.as_bool().unwrap())
        };
        assert_eq!(rows.lines().map(marks).collect::<Vec<_>>(), [[false, true], [true, false]]);
    }

    #[test]
    fn an_unsafe_episode_has_a_reason() {
        let mut record = sample_record();
        assert_eq!(unsafe_reason(&record), None);
        record.verdict.safety = false;
        record.verdict.object_mut().d_peak = Some(2.5);
        assert_eq!(unsafe_reason(&record).unwrap(), "D 2.50 % is above τ 1.00 %");
        (record.verdict.slip_ok, record.verdict.slip_mm) = (Some(false), 3.21);
        assert!(unsafe_reason(&record).unwrap().ends_with("; it slipped by 3.2 mm in the hand"));
        record.verdict.slip_ok = None;
        record.verdict.goal = false;
        record.outcome = Outcome::Budget;
        assert_eq!(unsafe_reason(&record).unwrap(), "the budget ran out; D 2.50 % is above τ 1.00 %");
        record.stats.gave_up = Some("it slipped".into());
        assert!(unsafe_reason(&record).unwrap().contains("; gave up: it slipped;"));
        record.outcome = Outcome::Error { message: "the action holds NaN".into() };
        record.verdict.drop = Some(DropEvent { reason: DropReason::NoEvidence, time_s: 0.0 });
        let reason = unsafe_reason(&record).unwrap();
        assert!(reason.starts_with("the action holds NaN") && !reason.contains("dropped"), "{reason}");
        record.verdict.failed_stage = Some(TaskStage::Reach);
        assert!(unsafe_reason(&record).unwrap().contains("; failed while: reach;"));
    }
}
