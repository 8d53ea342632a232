use super::*;
use crate::record::tests::sample;
use softvt_evaluation::{
    stage::TaskStage,
    statistics::Distribution,
    verdict::{InvalidReason, TargetVerdict, WrongObjectContact},
};

fn episode(task: usize, index: u32, edit: impl Fn(&mut EpisodeRecord)) -> EpisodeRecord {
    let mut record = sample();
    (record.header.id.task, record.header.id.episode) = (task, index);
    edit(&mut record);
    record
}

/// Four episodes of two tasks: safe; too much deformation; goal missed; invalid.
fn records() -> Vec<EpisodeRecord> {
    vec![
        episode(0, 0, |r| r.verdict.object_mut().d_peak = Some(0.5)),
        episode(0, 1, |r| {
            r.verdict.object_mut().d_peak = Some(1.5);
            (r.verdict.object_mut().deformation_ok, r.verdict.safety) = (Some(false), false);
        }),
        episode(1, 0, |r| {
            r.header.asset = "roll".into();
            r.outcome = Outcome::Budget;
            (r.verdict.goal, r.verdict.safety, r.verdict.object_mut().d_peak) = (false, false, Some(0.7));
        }),
        episode(1, 1, |r| {
            r.header.asset = "roll".into();
            r.outcome = Outcome::Invalid { reason: InvalidReason::Inverted, step: 9, node: Some(3) };
            // Even if a record claimed success, an invalid episode has none.
            r.verdict.object_mut().d_peak = Some(99.0);
        }),
    ]
}

#[test]
fn rates_count_every_episode_and_deformation_ranks_invalid_ones_as_worst() {
    let s = SuiteSummary::from_records("suite", "expert", &records());
    assert_eq!((s.scores.episodes, s.scores.invalid, s.scores.safety_unknown), (4, 1, 0));
    assert_eq!(s.scores.goal_success_rate.rate, Some(50.0));
    assert_eq!(s.scores.no_drop_rate.rate, Some(75.0));
    assert_eq!(s.scores.deformation_ok_rate.unwrap().rate, Some(50.0));
    assert_eq!(s.scores.safety_success_rate.rate, Some(25.0));
    assert_eq!(s.scores.goal_safe_gap, Some(25.0));
    // 0.5, 0.7, 1.5 and the invalid one, which ranks as worst.
    let d = s.scores.deformation;
    assert_eq!((d.n, d.invalid, d.median, d.p95), (3, 1, Some(1.1), None));
    assert_eq!(d.mean, Some(0.9), "of the valid ones");
    assert_eq!((s.scores.tsr.rate, s.scores.dsr.unwrap().rate), (Some(50.0), Some(25.0)));
    assert_eq!(s.invalid_episodes[0].reason, "inverted at physics step 9");
    assert_eq!(s.scores.tau_range, Some(TauRange { min: 1.0, max: 1.0 }));
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
fn a_rigid_suite_has_no_deformation() {
    let rigid: Vec<_> = records()
        .into_iter()
        .map(|mut r| {
            r.verdict.targets = vec![TargetVerdict::default()];
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
        (r.verdict.object_mut().deformation_ok, r.verdict.object_mut().d_ref, r.verdict.object_mut().tau) =
            (None, None, None);
        (r.verdict.safety, r.verdict.safety_known) = (false, false);
    });
    let s = SuiteSummary::from_records("suite", "expert", std::slice::from_ref(&unknown));
    assert_eq!((s.scores.safety_unknown, s.scores.not_judged), (1, 1));
    // Without a judged episode, a rate and its interval are absent.
    let none = Rate::not_judged();
    assert_eq!((s.scores.safety_success_rate, s.scores.deformation_ok_rate), (none, Some(none)));
    assert_eq!((s.scores.dsr, s.scores.goal_safe_gap, s.scores.tau_range), (Some(none), None, None));
    assert!(s.kappa.iter().all(|row| row.safety_success_rate == none));
    // Beside a judged one it counts as not safe.
    let s = SuiteSummary::from_records("suite", "expert", &[episode(0, 1, |_| ()), unknown]);
    assert_eq!((s.scores.not_judged, s.scores.safety_success_rate.rate), (1, Some(50.0)));
}

#[test]
fn harm_and_stages_are_counted() {
    let s = SuiteSummary::from_records(
        "suite",
        "expert",
        &[
            episode(0, 0, |r| r.verdict.others_ok = Some(true)),
            episode(0, 1, |r| {
                r.verdict.others_ok = Some(false);
                r.verdict.first_wrong_contact =
                    Some(WrongObjectContact { time_s: 1.0, object: "cube".into() });
            }),
            episode(0, 2, |r| (r.verdict.goal, r.verdict.failed_stage) = (false, Some(TaskStage::Lift))),
        ],
    );
    assert_eq!((s.scores.others_ok_rate.unwrap().rate, s.scores.others_unknown), (Some(50.0), 1));
    assert!((s.scores.wrong_contact_rate.rate.unwrap() - 100.0 / 3.0).abs() < 1e-9);
    assert_eq!(s.scores.failed_stages, [(TaskStage::Lift, 1)].into());
    let alone = SuiteSummary::from_records("suite", "expert", &[episode(0, 0, |_| ())]);
    assert_eq!((alone.scores.others_ok_rate, alone.scores.wrong_contact_rate.rate), (None, Some(0.0)));
    let many: Vec<_> =
        (0..20).map(|i| episode(i as usize % 2, i / 2, |r| r.verdict.goal = i % 4 != 0)).collect();
    let s = SuiteSummary::from_records("suite", "expert", &many);
    assert!(
        s.scores.tsr.bootstrap95.is_some_and(|[low, high]| low < 75.0 && 75.0 < high),
        "{:?}",
        s.scores.tsr
    );
    assert!(s.by_task[0].scores.tsr.bootstrap95.is_none());
}

#[test]
fn no_episodes_give_nulls_not_numbers() {
    let s = SuiteSummary::from_records("suite", "expert", &[]);
    assert_eq!((s.scores.goal_success_rate.rate, s.scores.goal_safe_gap), (None, None));
    assert_eq!(s.scores.deformation, Distribution::default());
}
