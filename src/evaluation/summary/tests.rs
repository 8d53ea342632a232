use super::*;
use crate::record::{Outcome, tests::sample};

fn episode(task: usize, index: u32, edit: impl Fn(&mut EpisodeRecord)) -> EpisodeRecord {
    let mut record = sample();
    (record.header.id.task, record.header.id.episode) = (task, index);
    edit(&mut record);
    record
}

/// Four episodes of two tasks: safe; too much deformation; goal missed; invalid.
fn records() -> Vec<EpisodeRecord> {
    vec![
        episode(0, 0, |r| r.verdict.d_peak = Some(0.5)),
        episode(0, 1, |r| {
            r.verdict.d_peak = Some(1.5);
            (r.verdict.deformation_ok, r.verdict.safety) = (Some(false), false);
        }),
        episode(1, 0, |r| {
            r.header.asset = "roll".into();
            r.outcome = Outcome::Timeout;
            (r.verdict.goal, r.verdict.safety, r.verdict.d_peak) = (false, false, Some(0.7));
        }),
        episode(1, 1, |r| {
            r.header.asset = "roll".into();
            r.outcome = Outcome::Invalid { reason: "inverted".into(), step: 9, node: Some(3) };
            // Even if a record claimed success, an invalid episode has none.
            r.verdict.d_peak = Some(99.0);
        }),
    ]
}

#[test]
fn rates_count_every_episode_and_deformation_only_the_valid_ones() {
    let s = SuiteSummary::from_records("suite", "expert", &records());
    assert_eq!((s.scores.episodes, s.scores.invalid, s.scores.safety_unknown), (4, 1, 0));
    assert_eq!(s.scores.goal_success_rate.rate, Some(50.0));
    assert_eq!(s.scores.no_drop_rate.rate, Some(75.0));
    assert_eq!(s.scores.deformation_ok_rate.unwrap().rate, Some(50.0));
    assert_eq!(s.scores.safety_success_rate.rate, Some(25.0));
    assert_eq!(s.scores.goal_safe_gap, Some(25.0));
    assert_eq!((s.scores.deformation.n, s.scores.deformation.median), (3, Some(0.7)));
    assert_eq!((s.scores.deformation_goal.n, s.scores.deformation_goal.mean), (2, Some(1.0)));
}

#[test]
fn groups_are_in_order_and_do_not_depend_on_the_order_of_episodes() {
    let mut shuffled = records();
    shuffled.reverse();
    let s = SuiteSummary::from_records("suite", "expert", &shuffled);
    assert_eq!(s, SuiteSummary::from_records("suite", "expert", &records()));
    assert_eq!(s.by_task.iter().map(|t| (t.task, t.scores.episodes)).collect::<Vec<_>>(), [(0, 2), (1, 2)]);
    assert_eq!(s.by_asset.keys().collect::<Vec<_>>(), ["bun", "roll"]);
    assert_eq!(s.by_asset["bun"].tau, Some(1.0));
}

#[test]
fn the_kappa_curve_rises_and_meets_the_nominal_rate_at_the_nominal_kappa() {
    let s = SuiteSummary::from_records("suite", "expert", &records());
    let at = |kappa: f64| s.kappa.iter().find(|row| row.kappa == kappa).unwrap().safety_success_rate.rate;
    assert_eq!((s.kappa.len(), at(0.0), at(1.0)), (21, Some(0.0), Some(50.0)));
    assert_eq!(at(0.5), s.scores.safety_success_rate.rate);
    // D_ref is 2: τ(0.3) = 0.6 admits 0.5, τ(0.7) = 1.4 not yet 1.5.
    assert_eq!((at(0.2), at(0.3), at(0.7), at(0.75)), (Some(0.0), Some(25.0), Some(25.0), Some(50.0)));
    assert!(s.kappa.windows(2).all(|w| w[0].safety_success_rate.rate <= w[1].safety_success_rate.rate));
}

#[test]
fn a_rigid_suite_has_no_deformation() {
    let rigid: Vec<_> = records()
        .into_iter()
        .map(|mut r| {
            r.header.soft = false;
            (r.verdict.d_peak, r.verdict.deformation_ok, r.verdict.d_ref) = (None, None, None);
            r
        })
        .collect();
    let s = SuiteSummary::from_records("suite", "expert", &rigid);
    assert_eq!((s.scores.deformation_ok_rate, s.scores.deformation.n), (None, 0));
    assert!(s.kappa.is_empty());
    let json = serde_json::to_value(&s).unwrap();
    assert!(json["deformation_ok_rate"].is_null());
}

#[test]
fn missing_thresholds_are_unknown_not_safe() {
    let unknown = episode(0, 0, |r| {
        (r.verdict.deformation_ok, r.verdict.d_ref, r.verdict.tau) = (None, None, None);
        (r.verdict.safety, r.verdict.safety_known) = (false, false);
    });
    let s = SuiteSummary::from_records("suite", "expert", &[unknown]);
    assert_eq!((s.scores.safety_unknown, s.scores.safety_success_rate.rate), (1, Some(0.0)));
    assert_eq!(s.scores.deformation_ok_rate.unwrap().rate, Some(0.0));
}

#[test]
fn the_file_has_the_documented_fields() {
    let json = serde_json::to_value(SuiteSummary::from_records("suite", "expert", &records())).unwrap();
    for field in [
        "suite",
        "policy",
        "episodes",
        "invalid",
        "goal_success_rate",
        "no_drop_rate",
        "deformation_ok_rate",
        "safety_success_rate",
        "goal_safe_gap",
        "deformation",
        "kappa",
        "by_task",
        "by_asset",
    ] {
        assert!(json.get(field).is_some(), "{field}");
    }
    assert_eq!(json["goal_success_rate"]["rate"], 50.0);
    assert_eq!(json["goal_success_rate"]["wilson95"].as_array().unwrap().len(), 2);
    assert_eq!(json["deformation"]["n"], 3);
    let back: SuiteSummary = serde_json::from_value(json).unwrap();
    assert_eq!(back, SuiteSummary::from_records("suite", "expert", &records()));
}

#[test]
fn no_episodes_give_nulls_not_numbers() {
    let s = SuiteSummary::from_records("suite", "expert", &[]);
    assert_eq!((s.scores.goal_success_rate.rate, s.scores.goal_safe_gap), (None, None));
    assert_eq!(s.scores.deformation, Distribution::default());
}
