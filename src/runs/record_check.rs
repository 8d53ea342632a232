//! Reading of an episode record: a line that contradicts itself, or holds a key that no record has, is refused.

use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Value, json};

use super::record::{EpisodeRecord, RolloutStats};
use softvt_evaluation::{
    safety::{DeformationLimit, PeakDeformation},
    verdict::{OtherObjectDeformation, Outcome, TargetVerdict, Verdict},
};

/// A text is not the record of an episode.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages describe the variants")]
pub enum RecordError {
    #[error("not an episode record: {0}")]
    Json(#[from] serde_json::Error),
    #[error("not an episode record: unknown key {0}")]
    UnknownKey(String),
    #[error("the record contradicts itself: {0}; it was changed after the episode, or damaged")]
    Contradiction(String),
}

/// True for a field of the header, the outcome, the verdict or the counters of records.
pub fn is_record_key(name: &str) -> bool {
    /// True if a field of a `T` reads the key: none takes lists of empty lists.
    fn is_read<T: Serialize + DeserializeOwned>(part: &T, name: &str) -> bool {
        let mut part = json!(part);
        part[name] = json!([[[]]]);
        serde_json::from_value::<T>(part).is_err()
    }
    #[rustfmt::skip]
    const HEADER: [&str; 16] = [
        "suite", "task", "prompt", "task_prompt", "layout", "episode", "seed", "split", "policy", "privileged",
        "replayed", "asset", "soft", "variation", "origin", "outcome",
    ];
    let verdict = Verdict { targets: vec![TargetVerdict::default()], ..Verdict::default() };
    HEADER.contains(&name) || is_read(&verdict, name) || is_read(&RolloutStats::default(), name)
}

/// Tolerance of sums and means, relative to 1.
const TOLERANCE: f64 = 1e-9;

impl EpisodeRecord {
    /// Reads a record from its JSON, such as a line of `episodes.jsonl`.
    ///
    /// # Errors
    /// The text is not a record, has an unknown key, or contradicts itself.
    pub fn from_json(text: &[u8]) -> Result<Self, RecordError> {
        let record: Self = serde_json::from_slice(text)?;
        // serde cannot refuse unknown keys in flattened structs.
        if let Some(path) = unknown_key(&serde_json::from_slice(text)?, "", &serde_json::to_value(&record)?) {
            return Err(RecordError::UnknownKey(path[1..].replace('/', ".")));
        }
        record.check().map_err(RecordError::Contradiction)?;
        Ok(record)
    }

    /// Checks that the numbers are in their ranges, and that what follows from other fields does.
    ///
    /// # Errors
    /// A contradiction, in words.
    pub fn check(&self) -> Result<(), String> {
        self.check_ranges()?;
        self.check_goal()?;
        self.check_deformation()?;
        self.check_grip()?;
        self.check_targets()?;
        self.check_others()
    }

    fn check_ranges(&self) -> Result<(), String> {
        let (v, s) = (&self.verdict, &self.stats);
        let not_negative = [
            ("time_s", Some(s.time_s)),
            ("newton_mean", Some(s.newton_mean)),
            ("slip_mm", Some(v.slip_mm)),
            ("peak_pad_force_n", Some(v.object().peak_pad_force_n)),
            ("mean_pad_force_n", Some(v.object().mean_pad_force_n)),
            ("least_pad_force_n", v.object().least_pad_force_n),
            ("goal_time_s", v.goal_time_s),
            ("d_peak", v.object().d_peak),
            ("d_peak_v1", v.object().d_peak_v1),
            ("d_peak_max", v.object().d_peak_max),
            ("d_mean", v.object().d_mean),
            ("d_final", v.object().d_final),
            ("d_p95", v.object().d_p95),
            ("d_peak_other", v.d_peak_other),
            ("time_over_tau_s", v.object().time_over_tau_s),
            ("collapsed_volume_pct", v.object().collapsed_volume_pct),
            ("damaged_volume_pct", v.object().damaged_volume_pct),
            ("kappa", v.object().kappa),
            ("tau", v.object().tau),
            ("d_ref", v.object().d_ref),
        ];
        for (name, number) in not_negative {
            if let Some(x) = number.filter(|x| !(x.is_finite() && *x >= 0.0)) {
                return Err(format!("{name} is {x}, and no such number is below 0"));
            }
        }
        let is_above = |a: f64, b: f64| a > b + TOLERANCE * (1.0 + b.abs());
        let ordered = [
            (
                "mean_pad_force_n",
                Some(v.object().mean_pad_force_n),
                "peak_pad_force_n",
                Some(v.object().peak_pad_force_n),
            ),
            ("goal_time_s", v.goal_time_s, "time_s", Some(s.time_s)),
            ("time_over_tau_s", v.object().time_over_tau_s, "time_s", Some(s.time_s)),
            ("drop.time_s", v.drop.map(|drop| drop.time_s), "time_s", Some(s.time_s)),
            ("d_mean", v.object().d_mean, "d_peak", v.object().d_peak),
            ("d_final", v.object().d_final, "d_peak", v.object().d_peak),
            ("d_p95", v.object().d_p95, "d_peak", v.object().d_peak),
            ("d_peak", v.object().d_peak, "d_peak_max", v.object().d_peak_max),
            ("collapsed_volume_pct", v.object().collapsed_volume_pct, "100", Some(100.0)),
            ("damaged_volume_pct", v.object().damaged_volume_pct, "100", Some(100.0)),
            ("kappa", v.object().kappa, "1", Some(1.0)),
            ("far_commands", Some(f64::from(s.far_commands)), "steps", Some(f64::from(s.steps))),
            ("clamped_grips", Some(f64::from(s.clamped_grips)), "steps", Some(f64::from(s.steps))),
            ("clamped_steps", Some(f64::from(s.clamped_steps)), "steps", Some(f64::from(s.steps))),
        ];
        for (low_name, low, high_name, high) in ordered {
            if let Some((low, high)) = low.zip(high).filter(|(low, high)| is_above(*low, *high)) {
                let high = if high_name.parse() == Ok(high) { String::new() } else { format!(" {high}") };
                return Err(format!("{low_name} {low} is above {high_name}{high}"));
            }
        }
        Ok(())
    }

    fn check_goal(&self) -> Result<(), String> {
        let v = &self.verdict;
        let is_completed = self.outcome == Outcome::Completed;
        match (v.goal, is_completed) {
            (true, false) => return Err("goal is true, and the outcome is not completed".to_owned()),
            (false, true) => return Err("goal is false, and the outcome is completed".to_owned()),
            _ => {}
        }
        if v.goal != v.goal_time_s.is_some() {
            return Err(format!("goal is {}, and goal_time_s is {}", v.goal, or_null(v.goal_time_s)));
        }
        if v.goal_untouched && !v.goal {
            return Err("goal_untouched is true, and goal is false".to_owned());
        }
        if let Some(attempts) = self.stats.attempts.filter(|attempts| *attempts < 2) {
            return Err(format!("attempts is {attempts}, and a record has those of several alone"));
        }
        if let Some(stage) = v.failed_stage.filter(|_| v.goal) {
            return Err(format!("goal is true, and failed_stage is {}", stage.name()));
        }
        if v.no_drop == v.drop.is_some() {
            let drop = if v.drop.is_some() { "an event" } else { "null" };
            return Err(format!("no_drop is {}, and drop is {drop}", v.no_drop));
        }
        if v.no_drop && !self.outcome.is_valid() {
            return Err("no_drop is true, and the episode did not end validly".to_owned());
        }
        Ok(())
    }

    /// Checks the limits, and that Safety Success at each κ follows from Goal, NoDrop and D.
    fn check_deformation(&self) -> Result<(), String> {
        let (v, soft) = (&self.verdict, self.verdict.object().soft);
        let object = v.object();
        let peak = PeakDeformation { d_pct: object.d_peak, missing: object.missing_deformation };
        let ok = |tau: Option<f64>| peak.is_within(tau).filter(|_| soft && self.outcome.is_valid());
        if !soft && (v.object().d_peak.is_some() || v.object().tau.is_some()) {
            return Err("the target is rigid, and d_peak or tau is a number".to_owned());
        }
        let limit = match (v.object().kappa, v.object().tau, v.object().d_ref) {
            (None, None, None) => None,
            (Some(kappa), Some(tau), Some(d_ref_pct)) => {
                check_tau("tau", tau, &DeformationLimit { d_ref_pct, kappa }, kappa)?;
                Some(DeformationLimit { d_ref_pct, kappa })
            }
            _ => return Err("some of kappa, tau and d_ref are null, and some are numbers".to_owned()),
        };
        let (d, tau) = (or_null(v.object().d_peak), or_null(v.object().tau));
        if let Some(over) = v.object().time_over_tau_s.filter(|over| *over > 0.0)
            && let (Some(peak), Some(limit)) = (v.object().d_peak, v.object().tau)
            && peak <= limit
        {
            return Err(format!("time_over_tau_s is {over}, and d_peak {d} is not above tau {tau}"));
        }
        if v.object().deformation_ok != ok(v.object().tau) {
            return Err(not_within(v.object().deformation_ok, v.object().d_peak, v.object().tau));
        }
        let parts = format!("goal is {}, no_drop {}", v.goal, v.no_drop);
        if v.safety != v.is_safe(None) {
            let got = or_null(v.object().deformation_ok);
            return Err(format!("safety is {}, and {parts}, deformation_ok {got}", v.safety));
        }
        let is_known = self.outcome.is_valid() && v.missing_evidence == 0;
        let is_judged = v.is_within(None).is_some();
        if v.safety_known != (is_known && is_judged) {
            return Err(format!("safety_known is {}, which the evidence does not show", v.safety_known));
        }
        for at in &v.kappas {
            let name = format!("the tau_pct of kappa {}", at.kappa);
            let Some(limit) = &limit else { return Err(format!("{name} is a number, and tau is null")) };
            check_tau(&name, at.tau_pct, limit, at.kappa)?;
            let safe = v.is_safe(Some(at.kappa));
            if at.deformation_ok != ok(Some(at.tau_pct)) || at.safety != safe {
                let (ok, tau) = (or_null(at.deformation_ok), at.tau_pct);
                return Err(format!(
                    "at kappa {} deformation_ok is {ok} and safety {}, and {parts}, d_peak {d}, tau_pct {tau}",
                    at.kappa, at.safety
                ));
            }
        }
        Ok(())
    }

    /// Checks the grip ratio, and the verdicts that follow from Goal, Safety and NoSlip.
    fn check_grip(&self) -> Result<(), String> {
        let v = &self.verdict;
        let ratio = v
            .object()
            .least_pad_force_n
            .filter(|least| *least > 0.0)
            .map(|least| v.object().peak_pad_force_n / least);
        let is_equal = match (v.object().grip_ratio, ratio) {
            (Some(a), Some(b)) => (a - b).abs() <= TOLERANCE * (1.0 + b),
            (a, b) => a.is_none() && b.is_none(),
        };
        if !is_equal {
            let (got, least) = (or_null(v.object().grip_ratio), or_null(v.object().least_pad_force_n));
            let peak = v.object().peak_pad_force_n;
            return Err(format!(
                "grip_ratio is {got}, and peak_pad_force_n is {peak}, least_pad_force_n {least}"
            ));
        }
        if let Some(slip_ok) = v.slip_ok.filter(|ok| *ok != v.no_slip || !self.outcome.is_valid()) {
            return Err(format!("slip_ok is {slip_ok}, and no_slip is {}", v.no_slip));
        }
        if v.gentle && !(v.goal && v.object().grip_ratio.is_some()) {
            return Err(format!(
                "gentle is true, and goal is {}, grip_ratio {}",
                v.goal,
                or_null(v.object().grip_ratio)
            ));
        }
        if v.contact_success && !v.goal {
            return Err("contact_success is true, and goal is false".to_owned());
        }
        if v.contact_safety != (v.contact_success && v.safety && v.no_slip) {
            return Err(format!(
                "contact_safety is {}, and contact_success is {}, safety {}, no_slip {}",
                v.contact_safety, v.contact_success, v.safety, v.no_slip
            ));
        }
        Ok(())
    }

    /// Checks that the other targets agree with their limits, and NoDrop and slip with all targets.
    fn check_targets(&self) -> Result<(), String> {
        let v = &self.verdict;
        for target in &v.targets[1..] {
            let TargetVerdict { d_peak, tau, deformation_ok, .. } = target;
            let object = target.object.as_deref().unwrap_or_default();
            let ok = target.is_within(None).filter(|_| target.soft && self.outcome.is_valid());
            if *deformation_ok != ok {
                return Err(format!("{object}: {}", not_within(*deformation_ok, *d_peak, *tau)));
            }
            if let (Some(tau), Some(d_ref_pct), Some(kappa)) = (target.tau, target.d_ref, target.kappa) {
                check_tau(
                    &format!("the tau of {object}"),
                    tau,
                    &DeformationLimit { d_ref_pct, kappa },
                    kappa,
                )?;
            }
            let own = target.handling.unwrap_or_default();
            if own.no_drop == own.drop.is_some() || (v.no_drop && !own.no_drop) {
                let drop = if own.drop.is_some() { "an event" } else { "null" };
                let all = v.no_drop;
                return Err(format!(
                    "{object}: no_drop is {}, and drop is {drop}, no_drop of all {all}",
                    own.no_drop
                ));
            }
            if own.slip_mm > v.slip_mm + TOLERANCE * (1.0 + v.slip_mm) {
                return Err(format!("{object}: slip_mm {} is above that of all, {}", own.slip_mm, v.slip_mm));
            }
        }
        for part in &v.goal_parts {
            if part.holds && part.met_s.is_none() {
                return Err(format!("the part {:?} of the goal holds, and its met_s is null", part.name));
            }
        }
        Ok(())
    }

    fn check_others(&self) -> Result<(), String> {
        let v = &self.verdict;
        for other in &v.others {
            let OtherObjectDeformation { object, d_peak, tau, deformation_ok } = other;
            let is_above = d_peak.zip(*tau).map(|(d, tau)| d > tau);
            let is_contradiction = match deformation_ok {
                Some(ok) => is_above != Some(!ok),
                // Steps without evidence leave it open; a limit that was exceeded does not.
                None => is_above == Some(true) && self.outcome.is_valid(),
            };
            if is_contradiction {
                return Err(format!("{object}: {}", not_within(*deformation_ok, *d_peak, *tau)));
            }
        }
        let peak = v.others.iter().filter_map(|other| other.d_peak).reduce(f64::max);
        if !v.others.is_empty() && peak != v.d_peak_other {
            let got = or_null(v.d_peak_other);
            return Err(format!("d_peak_other is {got}, and the largest of others is {}", or_null(peak)));
        }
        let has = |ok: Option<bool>| v.others.iter().any(|other| other.deformation_ok == ok);
        match v.others_ok {
            Some(true) if has(Some(false)) || has(None) => {}
            Some(false) if !has(Some(false)) => {}
            _ => return Ok(()),
        }
        Err(format!("others_ok is {}, which the list of others does not show", or_null(v.others_ok)))
    }
}

/// Checks that τ is κ·D_ref.
fn check_tau(name: &str, tau: f64, limit: &DeformationLimit, kappa: f64) -> Result<(), String> {
    if (tau - limit.tau_at(kappa)).abs() <= TOLERANCE * (1.0 + tau) {
        return Ok(());
    }
    Err(format!("{name} is {tau}, and {kappa} of d_ref {} is {}", limit.d_ref_pct, limit.tau_at(kappa)))
}

/// The contradiction of a `deformation_ok` with D and τ.
fn not_within(got: Option<bool>, d_peak: Option<f64>, tau: Option<f64>) -> String {
    let ([d, tau], got) = ([d_peak, tau].map(or_null), or_null(got));
    format!("deformation_ok is {got}, and d_peak is {d}, tau {tau}")
}

/// The value, or the word of JSON for none.
fn or_null(value: Option<impl ToString>) -> String {
    value.map_or("null".to_owned(), |value| value.to_string())
}

/// JSON pointer of the first key at or below `path` of `record` that is no field. `known` is what the fields at `path`
/// write, which leave out some defaults.
fn unknown_key(record: &Value, path: &str, known: &Value) -> Option<String> {
    match (record.pointer(path)?, known) {
        (Value::Object(read), Value::Object(known)) => read.keys().find_map(|key| {
            let path = format!("{path}/{}", key.replace('~', "~0").replace('/', "~1"));
            match known.get(key) {
                Some(own) => unknown_key(record, &path, own),
                None => (!is_field(record.clone(), &path)).then_some(path),
            }
        }),
        (Value::Array(_), Value::Array(known)) => (0..)
            .zip(known)
            .find_map(|(at, own): (usize, _)| unknown_key(record, &format!("{path}/{at}"), own)),
        _ => None,
    }
}

/// True if a field reads the value at a JSON pointer: none takes lists of empty lists.
fn is_field(mut record: Value, path: &str) -> bool {
    record.pointer_mut(path).into_iter().for_each(|value| *value = json!([[[]]]));
    serde_json::from_value::<EpisodeRecord>(record).is_err()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::tests::sample;

    /// The error of the sample record with `changes`.
    fn refusal(changes: &[(&str, Value)]) -> String {
        let mut line = serde_json::to_value(sample()).unwrap();
        for (key, value) in changes {
            line[*key] = value.clone();
        }
        EpisodeRecord::from_json(line.to_string().as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn the_record_as_written_is_accepted() {
        let line = serde_json::to_string(&sample()).unwrap();
        assert_eq!(EpisodeRecord::from_json(line.as_bytes()).unwrap(), sample());
        // As other programs may write it.
        let mut whole = serde_json::to_value(sample()).unwrap();
        (whole["gave_up"], whole["variation"]) = (Value::Null, Value::Null);
        assert_eq!(EpisodeRecord::from_json(whole.to_string().as_bytes()).unwrap(), sample());
    }

    #[test]
    fn a_record_may_state_every_default() {
        let mut line = serde_json::to_value(sample()).unwrap();
        let part = json!({ "name": "bun on plate", "negated": false, "holds": true, "met_s": 1.0 });
        line["goal_parts"] = json!([part]);
        for key in ["task_prompt", "variation", "origin", "first_far_command", "gave_up"] {
            line[key] = Value::Null;
        }
        (line["privileged"], line["clamped_steps"]) = (json!(false), json!(0));
        (line["others"], line["targets"]) = (json!([]), json!([]));
        (line["notes"], line["metrics"]) = (json!({}), json!({}));
        let record = EpisodeRecord::from_json(line.to_string().as_bytes()).unwrap();
        assert_eq!(record.verdict.goal_parts[0].name, "bun on plate");
        line["goal_parts"][0]["colour"] = json!("red");
        let unknown = EpisodeRecord::from_json(line.to_string().as_bytes()).unwrap_err().to_string();
        assert!(unknown.ends_with("unknown key goal_parts.0.colour"), "{unknown}");
    }

    #[test]
    fn safety_follows_from_goal_drop_and_deformation() {
        let far = ("d_peak", json!(0.8));
        assert!(refusal(&[("safety", json!(false))]).contains("safety is false, and goal is true"));
        let unsafe_d = [("d_peak", json!(1.5)), ("d_peak_max", json!(3.0))];
        let claimed = refusal(&unsafe_d);
        assert!(claimed.contains("deformation_ok is true, and d_peak is 1.5, tau 1"), "{claimed}");
        let both = [&unsafe_d[..], &[("deformation_ok", json!(false))]].concat();
        assert!(
            refusal(&both).contains("safety is true, and goal is true, no_drop true, deformation_ok false")
        );
        assert!(refusal(&[("d_peak", Value::Null)]).contains("d_peak is null, tau 1"));
        assert!(refusal(&[("tau", Value::Null)]).contains("some of kappa, tau and d_ref are null"));
        assert!(refusal(&[("tau", json!(9.0))]).contains("tau is 9, and 0.5 of d_ref 2 is 1"));
        let swapped = [("kappa", json!(1.25)), ("collapsed_volume_pct", json!(0.5))];
        let refused = refusal(&swapped);
        assert!(refused.contains("kappa 1.25 is above 1") && !refused.contains("above 1 1"), "{refused}");
        let at = json!([{ "kappa": 0.3, "tau_pct": 0.6, "deformation_ok": true, "safety": true }]);
        let kappas = refusal(&[("kappas", at), far]);
        assert!(kappas.contains("at kappa 0.3 deformation_ok is true"), "{kappas}");
        assert!(refusal(&[("safety_known", json!(false))]).contains("safety_known is false"));
        let over = refusal(&[("time_over_tau_s", json!(0.25))]);
        assert!(over.contains("time_over_tau_s is 0.25, and d_peak 0.33"), "{over}");
    }

    #[test]
    fn goal_and_drop_agree_with_their_events() {
        assert!(refusal(&[("goal", json!(false))]).contains("goal is false, and the outcome is completed"));
        assert!(
            refusal(&[("outcome", json!({ "kind": "budget" }))]).contains("the outcome is not completed")
        );
        assert!(refusal(&[("goal_time_s", Value::Null)]).contains("goal_time_s is null"));
        assert!(refusal(&[("no_drop", json!(false))]).contains("no_drop is false, and drop is null"));
    }

    #[test]
    fn numbers_have_their_ranges() {
        assert!(refusal(&[("time_s", json!(-1.0))]).contains("time_s is -1"));
        assert!(refusal(&[("newton_mean", json!(-1.0))]).contains("newton_mean is -1"));
        assert!(
            refusal(&[("d_peak_max", json!(0.1))])
                .contains("d_peak 0.3333333333333333 is above d_peak_max 0.1")
        );
        assert!(refusal(&[("mean_pad_force_n", json!(2.0))]).contains("is above peak_pad_force_n 1.5"));
    }

    #[test]
    fn verdicts_on_the_grip_follow_from_forces_goal_and_slip() {
        let claimed = refusal(&[("grip_ratio", json!(1.01))]);
        assert!(claimed.contains("grip_ratio is 1.01, and peak_pad_force_n is 1.5"), "{claimed}");
        assert!(refusal(&[("least_pad_force_n", json!(-1.0))]).contains("least_pad_force_n is -1"));
        let missed = [("goal", json!(false)), ("outcome", json!({ "kind": "budget" }))];
        let missed = [&missed[..], &[("goal_time_s", Value::Null), ("safety", json!(false))]].concat();
        let of =
            |changes: &[(&str, Value)]| refusal(&[&missed[..], &[("kappas", json!([]))], changes].concat());
        let gentle = of(&[
            ("gentle", json!(true)),
            ("contact_success", json!(false)),
            ("contact_safety", json!(false)),
        ]);
        assert!(gentle.contains("gentle is true, and goal is false"), "{gentle}");
        let contact = of(&[("gentle", json!(false)), ("contact_success", json!(true))]);
        assert!(contact.contains("contact_success is true, and goal is false"), "{contact}");
        let safe = refusal(&[("contact_success", json!(true)), ("contact_safety", json!(false))]);
        assert!(safe.contains("contact_safety is false, and contact_success is true"), "{safe}");
        let slip = refusal(&[("slip_ok", json!(false))]);
        assert!(slip.contains("slip_ok is false") || slip.contains("safety is true"), "{slip}");
    }

    #[test]
    fn harm_to_others_follows_from_their_limits() {
        let other =
            |d: f64, ok: bool| json!([{ "object": "pie", "d_peak": d, "tau": 1.0, "deformation_ok": ok }]);
        let claimed = refusal(&[("others", other(2.0, true)), ("d_peak_other", json!(2.0))]);
        assert!(claimed.contains("pie: deformation_ok is true, and d_peak is 2, tau 1"), "{claimed}");
        let summary =
            [("others", other(2.0, false)), ("d_peak_other", json!(2.0)), ("others_ok", json!(true))];
        assert!(refusal(&summary).contains("others_ok is true"));
        assert!(
            refusal(&[("others", other(0.5, true))])
                .contains("d_peak_other is 0, and the largest of others is 0.5")
        );
    }

    #[test]
    fn the_other_targets_agree_with_their_limits_and_with_safety() {
        let target = |d: f64, ok: Option<bool>| {
            json!([{
                "object": "roll", "soft": true, "no_drop": true, "drop": null, "no_slip": true, "slip_mm": 0.0,
                "d_peak": d, "missing_deformation": 0, "collapsed_volume_pct": null, "damaged_volume_pct": null,
                "kappa": 0.5, "tau": 1.0, "d_ref": 2.0, "deformation_ok": ok, "peak_pad_force_n": 1.0,
                "mean_pad_force_n": 0.5, "least_pad_force_n": null, "grip_ratio": null
            }])
        };
        let claimed = refusal(&[("targets", target(1.5, Some(true)))]);
        assert!(
            claimed.contains("safety is true") || claimed.contains("roll: deformation_ok is true"),
            "{claimed}"
        );
        let crushed = refusal(&[("targets", target(1.5, Some(false)))]);
        assert!(crushed.contains("safety is true, and goal is true"), "{crushed}");
        let mut line = serde_json::to_value(sample()).unwrap();
        line["targets"] = target(0.5, Some(true));
        line["kappas"] = json!([]);
        line["goal_parts"] = json!([{ "name": "roll on plate", "holds": true, "met_s": 1.0 }]);
        let record = EpisodeRecord::from_json(line.to_string().as_bytes()).unwrap();
        assert_eq!(record.verdict.targets[1].object.as_deref(), Some("roll"));
        line["targets"][0]["colour"] = json!("red");
        let unknown = EpisodeRecord::from_json(line.to_string().as_bytes()).unwrap_err().to_string();
        assert!(unknown.contains("colour"), "{unknown}");
    }

    #[test]
    fn unknown_keys_are_refused_by_name() {
        assert!(refusal(&[("d_peak_gther", json!(0.0))]).ends_with("unknown key d_peak_gther"));
        let drop = json!({ "reason": "free_fall", "time_s": 1.0, "height": 3 });
        assert!(refusal(&[("drop", drop)]).ends_with("unknown key drop.height"));
    }
}
