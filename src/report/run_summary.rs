//! Runs with their results, each with a name that tells it from the others.

use std::collections::BTreeMap;

use super::stored_run::StoredRun;
use crate::evaluation::{
    record::{EpisodeRecord, Outcome},
    summary::SuiteSummary,
};

/// A run with its results.
#[derive(Clone, Debug)]
pub struct RunSummary {
    /// What was run.
    pub run: StoredRun,
    /// What came out.
    pub summary: SuiteSummary,
    /// The policy, what of it no robot has, and what tells this run from the others of its suite.
    pub method: String,
}

/// Sums runs up, in the order of their suites. A folder that is given twice counts once.
pub fn summarize_runs(mut runs: Vec<StoredRun>) -> Vec<RunSummary> {
    let place = |run: &StoredRun| run.dir.canonicalize().unwrap_or_else(|_| run.dir.clone());
    let mut seen = Vec::new();
    runs.retain(|run| {
        let place = place(run);
        let new = !seen.contains(&place);
        seen.push(place);
        new
    });
    let mut all: Vec<RunSummary> = runs.into_iter().map(summed_up).collect();
    all.sort_by(|a, b| a.summary.suite.cmp(&b.summary.suite));
    let mut count: BTreeMap<(String, String), usize> = BTreeMap::new();
    for judged in &all {
        *count.entry((judged.summary.suite.clone(), judged.method.clone())).or_default() += 1;
    }
    for judged in &mut all {
        if count[&(judged.summary.suite.clone(), judged.method.clone())] > 1 {
            judged.method += &format!(" · {}", judged.run.dir.display());
        }
    }
    all
}

fn summed_up(run: StoredRun) -> RunSummary {
    let mut summary = SuiteSummary::of(run.suite(), run.text("policy"), &run.records);
    summary.force_observed |= run.sees_forces();
    let method = [summary.method_label()].into_iter().chain(changes(&run)).collect::<Vec<_>>().join(" · ");
    RunSummary { run, summary, method }
}

/// What was changed of the suite, such as `mass=2`.
fn changes(run: &StoredRun) -> Option<String> {
    let pairs =
        ["shifts", "set"].into_iter().flat_map(|field| run.info[field].as_array().into_iter().flatten());
    let words: Vec<String> = pairs
        .map(|pair| {
            let value = pair[1].as_str().map_or_else(|| pair[1].to_string(), str::to_owned);
            format!("{}={value}", pair[0].as_str().unwrap_or_default())
        })
        .collect();
    (!words.is_empty()).then(|| words.join(", "))
}

impl RunSummary {
    /// Whether its targets deform.
    pub fn soft(&self) -> bool {
        self.summary.scores.deformation_ok_rate.is_some()
    }

    /// Its suite and method.
    pub fn name(&self) -> String {
        format!("{}, {}", self.summary.suite, self.method)
    }

    /// Its episodes that are not safe, with their reasons.
    pub fn unsafe_episodes(&self) -> Vec<(&EpisodeRecord, String)> {
        self.run.records.iter().filter_map(|record| Some((record, reason(record)?))).collect()
    }
}

/// Why an episode is not safe; `None` if it is.
pub fn reason(record: &EpisodeRecord) -> Option<String> {
    let v = &record.verdict;
    if v.safety {
        return None;
    }
    let mut parts = Vec::new();
    match &record.outcome {
        Outcome::Invalid { reason, step, .. } => {
            parts.push(format!("invalid: {reason} at physics step {step}"))
        }
        Outcome::Error { message } => parts.push(message.clone()),
        Outcome::Timeout if !v.goal => parts.push("the budget ran out".to_owned()),
        Outcome::Timeout | Outcome::Completed => {}
    }
    if let Some(why) = &record.stats.gave_up {
        parts.push(format!("gave up: {why}"));
    }
    if let Some(drop) = &v.drop {
        let what =
            serde_json::to_value(drop.reason).ok().and_then(|v| v.as_str().map(|s| s.replace('_', " ")));
        parts.push(format!("dropped at {:.1} s: {}", drop.time_s, what.unwrap_or_default()));
    }
    if v.wrong_instance {
        parts.push("another object was lifted first".to_owned());
    }
    match (v.d_peak, v.tau) {
        (Some(d), Some(tau)) if d > tau => parts.push(format!("D {d:.2} % is above τ {tau:.2} %")),
        (_, None) if record.identity.soft => parts.push("the object has no threshold".to_owned()),
        _ => {}
    }
    if parts.is_empty() && !v.safety_known {
        parts.push("evidence is missing".to_owned());
    }
    Some(parts.join("; "))
}

#[cfg(test)]
pub(super) mod tests {
    use std::path::Path;

    use serde_json::json;

    use super::*;
    use crate::evaluation::record::tests::sample;

    /// A finished run of `records` in the folder `dir`.
    pub(in crate::report) fn stored(dir: &str, policy: &str, mut records: Vec<EpisodeRecord>) -> StoredRun {
        for record in &mut records {
            (record.identity.policy, record.identity.privileged) = (policy.into(), policy == "expert");
        }
        let suite = records.first().map_or("suite", |record| &record.identity.suite);
        let info = json!({
            "softvt": env!("CARGO_PKG_VERSION"), "script": "x.lua", "suite": suite, "policy": policy,
            "privileged": policy == "expert", "seed": 11, "split": "eval", "tasks": [0], "force_observed": false,
            "episodes": records.len(), "shifts": [], "set": [], "arguments": [],
        });
        StoredRun { dir: Path::new(dir).into(), info, records, finished: true, torn: false }
    }

    #[test]
    fn runs_of_one_suite_are_told_apart() {
        let plain = stored("runs/a", "expert", vec![sample()]);
        let mut heavy = stored("runs/b", "expert", vec![sample()]);
        heavy.info["shifts"] = json!([["mass", 2.0]]);
        heavy.info["set"] = json!([["robot.gripper.effort", "3"]]);
        let mut felt = stored("runs/c", "pi", vec![sample()]);
        felt.info["force_observed"] = json!(true);
        let names = |runs: &[&StoredRun]| -> Vec<String> {
            summarize_runs(runs.iter().map(|run| (*run).clone()).collect())
                .into_iter()
                .map(|j| j.method)
                .collect()
        };
        assert_eq!(
            names(&[&plain, &heavy, &felt]),
            [
                "expert (privileged)",
                "expert (privileged) · mass=2.0, robot.gripper.effort=3",
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
    fn an_unsafe_episode_says_why() {
        let mut record = sample();
        assert_eq!(reason(&record), None);
        record.verdict.safety = false;
        record.verdict.d_peak = Some(2.5);
        assert_eq!(reason(&record).unwrap(), "D 2.50 % is above τ 1.00 %");
        record.verdict.goal = false;
        record.outcome = Outcome::Timeout;
        assert_eq!(reason(&record).unwrap(), "the budget ran out; D 2.50 % is above τ 1.00 %");
        record.stats.gave_up = Some("it slipped".into());
        assert!(reason(&record).unwrap().contains("; gave up: it slipped;"));
        record.outcome = Outcome::Error { message: "the action holds NaN".into() };
        assert!(reason(&record).unwrap().starts_with("the action holds NaN"));
    }
}
