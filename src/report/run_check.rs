//! Comparison of the records of a run with its `run.json`: suite, tasks and episodes, policy and seed, criteria and
//! limits.
//!
//! A run whose files were changed consistently passes. Only `softvt replay`, which simulates its episodes again, proves
//! a run.

use serde_json::{Value, json};

use softvt_benchmark::{CONTROL_DT, run_changes::RunChanges};
use softvt_common::episode_id::{EpisodeId, EpisodeSplit};
use softvt_evaluation::criteria::SuccessCriteria;
use softvt_runs::record::EpisodeRecord;

/// Differences that rounding explains, relative to 1.
const ROUNDING: f64 = 1e-6;

/// A record that contradicts the manifest of its run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordContradiction {
    /// Line of the record, from 1.
    pub line: usize,
    /// The fields that disagree, and their values.
    pub what: String,
}

/// The first of the records, in the order of their lines, that contradicts the manifest of their run.
pub fn first_contradiction(manifest: &Value, records: &[EpisodeRecord]) -> Option<RecordContradiction> {
    let run = StatedRun::new(manifest);
    let found =
        |(number, record)| Some(RecordContradiction { line: number + 1, what: contradiction(&run, record)? });
    records.iter().enumerate().find_map(found)
}

/// What the manifest of a run states, `None` where it states nothing.
struct StatedRun<'a> {
    manifest: &'a Value,
    /// Name of the suite as its records have it.
    suite: Option<String>,
    criteria: Option<SuccessCriteria>,
}

impl<'a> StatedRun<'a> {
    fn new(manifest: &'a Value) -> Self {
        let suite = RunChanges::of_manifest(manifest)
            .ok()
            .and_then(|changes| Some(changes.suite_name(manifest["suite"].as_str()?)));
        let criteria = serde_json::from_value(manifest["settings"]["criteria"].clone()).ok();
        Self { manifest, suite, criteria }
    }
}

/// Contradiction between a record and the manifest of its run; `None` if they agree. Skips what the manifest does not
/// state.
fn contradiction(run: &StatedRun, record: &EpisodeRecord) -> Option<String> {
    let manifest = run.manifest;
    let (v, s) = (&record.verdict, &record.stats);
    let is_valid = record.outcome.is_valid();
    if let Some(what) = other_run(run, record) {
        return Some(what);
    }
    if let Some(privileged) =
        manifest["privileged"].as_bool().filter(|known| *known != record.header.privileged)
    {
        return Some(format!("privileged is {}, and that of the run {privileged}", record.header.privileged));
    }
    if record.header.replayed && !manifest["replayed"].is_object() {
        return Some("replayed is true, and the run names no recorded run".to_owned());
    }
    let expected_s = f64::from(s.steps) * CONTROL_DT;
    if is_valid && (s.time_s - expected_s).abs() > ROUNDING {
        return Some(format!("time_s is {}, and {} steps take {expected_s} s", s.time_s, s.steps));
    }
    if let Some(tau) =
        nominal_tau(manifest, record).filter(|tau| v.object().tau.is_some_and(|own| differ(own, *tau)))
    {
        let own = v.object().tau.unwrap_or_default();
        return Some(format!("tau is {own}, and that of {} in the run {tau}", record.header.asset));
    }
    let criteria = run.criteria.as_ref()?;
    let slip_mm = 1e3 * criteria.slip_m;
    if v.no_slip != (v.slip_mm <= slip_mm) && differ(v.slip_mm, slip_mm) {
        return Some(format!(
            "no_slip is {}, and slip_mm {}; the run allows {slip_mm} mm",
            v.no_slip, v.slip_mm
        ));
    }
    if is_valid && v.slip_ok.is_some() != criteria.require_no_slip {
        let required = criteria.require_no_slip;
        let is_null = if v.slip_ok.is_none() { "null" } else { "not null" };
        return Some(format!("slip_ok is {is_null}, and criteria.require_no_slip of the run {required}"));
    }
    let ratio = v.object().grip_ratio.unwrap_or(f64::INFINITY);
    let is_gentle = v.goal && ratio <= criteria.gentle_ratio;
    if v.gentle != is_gentle && differ(ratio, criteria.gentle_ratio) {
        return Some(format!("gentle is {}, and goal is {}, grip_ratio {ratio}", !is_gentle, v.goal));
    }
    None
}

/// The first field of the header of a record that differs from its run.
fn other_run(run: &StatedRun, record: &EpisodeRecord) -> Option<String> {
    let manifest = run.manifest;
    let header = &record.header;
    let EpisodeId { suite, task, episode, base_seed, split } = &header.id;
    if let Some(of_run) = run.suite.as_ref().filter(|name| *name != suite) {
        return Some(format!("suite is {suite:?}, and that of the run {of_run:?}"));
    }
    let fields = [("policy", json!(header.policy)), ("seed", json!(base_seed)), ("split", json!(split))];
    let differs = |(name, own): &&(&str, Value)| !manifest[*name].is_null() && manifest[*name] != *own;
    if let Some((name, own)) = fields.iter().find(differs) {
        return Some(format!("{name} is {own}, and that of the run {}", manifest[*name]));
    }
    let lists = |field: &str, value: Value| manifest[field].as_array().is_none_or(|all| all.contains(&value));
    let is_episode = match manifest["selected_episodes"].is_null() {
        // A recording makes as many attempts as its demonstrations take.
        true if *split == EpisodeSplit::Demonstration => true,
        true => manifest["episodes"].as_u64().is_none_or(|count| u64::from(*episode) < count),
        false => lists("selected_episodes", json!(episode)),
    };
    let index = header.id.index();
    (!lists("tasks", json!(task)) || !is_episode).then(|| format!("the run does not have {index}"))
}

/// τ of the target's asset in the run. Instances with properties that do not show have limits of their own.
fn nominal_tau(manifest: &Value, record: &EpisodeRecord) -> Option<f64> {
    let drawn = record.header.variation.iter().flat_map(|variation| variation.objects.values());
    if drawn.into_iter().any(|object| object.hidden.is_some()) {
        return None;
    }
    manifest["thresholds"][&record.header.asset].as_f64()
}

fn differ(a: f64, b: f64) -> bool {
    (a - b).abs() > ROUNDING * (1.0 + b.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_record;

    fn contradiction(manifest: &Value, record: &EpisodeRecord) -> Option<String> {
        super::contradiction(&StatedRun::new(manifest), record)
    }

    #[test]
    fn records_must_agree_with_criteria_limits_and_inputs_of_their_run() {
        let record = {
            let mut record = sample_record();
            record.stats.time_s = f64::from(record.stats.steps) * CONTROL_DT;
            record
        };
        let criteria = SuccessCriteria {
            require_no_slip: record.verdict.slip_ok.is_some(),
            ..SuccessCriteria::default()
        };
        let manifest = json!({
            "privileged": record.header.privileged, "settings": { "criteria": criteria },
            "thresholds": { &record.header.asset: record.verdict.object().tau },
        });
        assert_eq!(contradiction(&manifest, &record), None);
        assert_eq!(contradiction(&json!({}), &record), None, "a manifest without settings");
        let header = &record.header;
        let of_run = json!({
            "suite": header.id.suite, "policy": header.policy, "seed": header.id.base_seed, "split": header.id.split,
            "tasks": [header.id.task], "episodes": header.id.episode + 1, "arguments": [], "shifts": [], "set": [],
        });
        assert_eq!(contradiction(&of_run, &record), None);
        for (field, other) in
            [("suite", json!("other")), ("policy", json!("mine")), ("seed", json!(5)), ("split", json!("x"))]
        {
            let mut changed = of_run.clone();
            changed[field] = other;
            let what = contradiction(&changed, &record).unwrap_or_default();
            assert!(what.starts_with(&format!("{field} is ")), "{what}");
        }
        for (field, other) in [("tasks", json!([])), ("episodes", json!(0)), ("selected_episodes", json!([]))]
        {
            let mut changed = of_run.clone();
            changed[field] = other;
            let what = contradiction(&changed, &record).unwrap_or_default();
            assert!(what.starts_with("the run does not have "), "{what}");
        }
        let of = |change: &dyn Fn(&mut EpisodeRecord)| {
            let mut changed = record.clone();
            change(&mut changed);
            contradiction(&manifest, &changed).unwrap_or_default()
        };
        assert!(of(&|r| r.verdict.slip_mm = 5.0).contains("no_slip is true, and slip_mm 5"));
        assert!(of(&|r| r.verdict.slip_ok = Some(true)).contains("slip_ok is not null"));
        assert!(of(&|r| r.stats.steps += 5).contains("steps take"));
        assert!(of(&|r| r.header.replayed = true).starts_with("replayed is true"));
        assert!(of(&|r| r.header.privileged = !r.header.privileged).starts_with("privileged is"));
        let of_gentle = of(&|r| (r.verdict.gentle, r.verdict.object_mut().grip_ratio) = (true, Some(9.0)));
        assert!(of_gentle.contains("gentle is true"), "{of_gentle}");
        let limit = of(&|r| r.verdict.object_mut().tau = r.verdict.object().tau.map(|tau| 100.0 * tau));
        assert!(limit.starts_with("tau is 100, and that of"), "{limit}");
    }
}
