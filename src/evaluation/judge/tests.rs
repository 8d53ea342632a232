use super::*;
use crate::{
    deformation::Deformation,
    evidence::{CrushedShares, GripEvidence, GripperEvidence, PadEvidence, TargetEvidence},
};
use softvt_geometry::{Aabb, Pose, Quat, Vec3};

pub(super) const DT: f64 = 1.0 / 60.0;
pub(super) const WEIGHT_N: f64 = 0.3;

pub(super) fn target(name: &str) -> JudgedBody {
    let limit = Some(DeformationLimit { d_ref_pct: 2.0, kappa: 0.5 });
    let name = name.into();
    JudgedBody { name, weight_n: WEIGHT_N, is_soft: true, is_goal: false, limit, lowest_z_w: 0.0 }
}

/// A target rests on the plate.
pub(super) fn on(target: usize) -> Predicate {
    let region = GoalRegion::On { radius_m: 0.08 };
    Predicate { name: "on plate".into(), rule: PredicateRule::Rests { target, region, hold_s: 0.4 } }
}

pub(super) fn config() -> JudgeConfig {
    JudgeConfig {
        criteria: SuccessCriteria::default(),
        workspace: Aabb { min: Vec3::new(-1.0, -1.0, -0.05), max: Vec3::new(1.0, 1.0, 1.0) },
        goal: GoalNode::Predicate(0),
        predicates: vec![on(0)],
        targets: vec![target("bun")],
        dt_s: DT,
        steps_per_control: 3,
        others: vec![JudgedBody {
            limit: Some(DeformationLimit { d_ref_pct: 3.0, kappa: 0.5 }),
            ..target("other")
        }],
        max_steps: 1000,
    }
}

pub(super) fn deformed(rms_pct: f64) -> Deformation {
    Deformation {
        rms_pct,
        v1_rms_pct: 1.1 * rms_pct,
        max_pct: 3.0 * rms_pct,
        rotation: Quat::identity(),
        bbox_m: Vec3::repeat(0.06),
    }
}

pub(super) fn lying(x: f64, d_pct: f64) -> BodyEvidence {
    BodyEvidence {
        centre_w: Vec3::new(x, 0.0, 0.03),
        lowest_z_w: 0.0,
        support_force_n: WEIGHT_N,
        robot_force_n: 0.0,
        deformation: Some(deformed(d_pct)),
    }
}

/// A target that nothing touches but what it lies on.
fn untouched(x: f64, d_pct: f64) -> TargetEvidence {
    TargetEvidence {
        body: lying(x, d_pct),
        pads: [PadEvidence::default(); 2],
        hand_force_n: 0.0,
        grip: GripEvidence { load_n: Vec3::zeros(), axis_w: Vec3::y(), dynamic_mu: 1.2 },
        crushed: CrushedShares::default(),
    }
}

/// One physics step with one target and one place.
struct Step {
    hand_w: Vec3,
    gripper: GripperEvidence,
    target: TargetEvidence,
    goal: PlaceEvidence,
}

/// Feeds an episode to a judge, step by step.
struct Replay {
    judge: Judge,
    other: BodyEvidence,
    step: u32,
}

impl Replay {
    fn new(config: JudgeConfig) -> Self {
        Self { judge: Judge::new(config), other: lying(0.3, 0.1), step: 0 }
    }

    fn steps(&mut self, n: u32, make: impl Fn(&mut Step)) {
        for _ in 0..n {
            self.step += 1;
            let mut step = Step {
                hand_w: Vec3::new(-0.2, 0.0, 0.1),
                gripper: GripperEvidence { width_m: 0.08, commanded_width_m: 0.08 },
                target: untouched(-0.2, 0.2),
                goal: PlaceEvidence { pose_w: Pose::identity(), support_force_n: 0.0 },
            };
            make(&mut step);
            let Step { hand_w, gripper, target, goal } = step;
            self.judge.observe(&Evidence {
                time_s: f64::from(self.step) * DT,
                hand_w,
                gripper,
                targets: &[target],
                others: &[self.other],
                predicates: &[PredicateEvidence::Place(goal)],
            });
        }
    }

    /// Grasped and carried at `x` with deformation `d_pct`.
    fn carry(&mut self, n: u32, x: f64, d_pct: f64) {
        self.steps(n, |e| {
            e.target.body = BodyEvidence {
                centre_w: Vec3::new(x, 0.0, 0.13),
                lowest_z_w: 0.1,
                support_force_n: 0.0,
                robot_force_n: 0.0,
                deformation: Some(deformed(d_pct)),
            };
            e.hand_w = Vec3::new(x, 0.0, 0.2);
            e.target.pads = [PadEvidence { normal_force_n: 1.2, slip_speed_m_s: 0.0 }; 2];
            e.target.grip.load_n = Vec3::z() * WEIGHT_N;
            e.gripper = GripperEvidence { width_m: 0.05, commanded_width_m: 0.045 };
        });
    }

    /// Carried over the plate by pads that press with a force (N) and slide at a speed (m/s).
    fn grip(&mut self, n: u32, force_n: f64, slip_speed_m_s: f64) {
        self.steps(n, |e| {
            e.target.body = BodyEvidence { lowest_z_w: 0.1, support_force_n: 0.0, ..lying(0.0, 0.2) };
            e.target.grip.load_n = Vec3::z() * WEIGHT_N;
            e.target.pads = [PadEvidence { normal_force_n: force_n, slip_speed_m_s }; 2];
            e.gripper = GripperEvidence { width_m: 0.05, commanded_width_m: 0.045 };
        });
    }

    /// Resting on the plate at `x`, hand open and away.
    fn rest(&mut self, n: u32, x: f64) {
        self.steps(n, |e| {
            e.target.body = lying(x, 0.2);
            e.goal.support_force_n = 0.6 * WEIGHT_N;
        });
    }

    fn verdict(self, outcome: Outcome) -> Verdict {
        self.judge.finish(&outcome)
    }
}

#[test]
fn a_gentle_placement_is_goal_and_safe() {
    let mut replay = Replay::new(config());
    replay.steps(10, |_| ());
    replay.carry(60, 0.0, 0.8);
    replay.rest(23, 0.01);
    assert!(!replay.judge.is_goal_reached());
    replay.rest(4, 0.01);
    assert!(replay.judge.is_goal_reached());
    let v = replay.verdict(Outcome::Completed);
    assert!(v.goal && v.goal_v1 && v.no_drop && v.no_slip && v.safety && v.safety_known, "{v:?}");
    assert_eq!(
        (v.object().d_peak, v.object().d_peak_max, v.d_peak_other),
        (Some(0.8), Some(3.0 * 0.8), Some(0.1))
    );
    assert_eq!((v.object().tau, v.object().deformation_ok, v.wrong_instance), (Some(1.0), Some(true), false));
    assert_eq!(v.kappas.iter().map(|k| k.safety).collect::<Vec<_>>(), [false, true, true]);
    assert!(
        (v.object().peak_pad_force_n - 1.2).abs() < 1e-12
            && (v.object().mean_pad_force_n - 1.2).abs() < 1e-12
    );
}

#[test]
fn the_grip_is_judged_beside_safety() {
    // The least force is 0.3 N / (2 × 1.2) = 0.125 N.
    let verdict = |force_n: f64, slip_m: f64, require_no_slip: bool| {
        let criteria = SuccessCriteria { require_no_slip, ..SuccessCriteria::default() };
        let mut replay = Replay::new(JudgeConfig { criteria, ..config() });
        replay.carry(1, 0.0, 0.2);
        replay.grip(60, force_n, slip_m / (60.0 * DT));
        replay.rest(30, 0.0);
        replay.verdict(Outcome::Completed)
    };
    let v = verdict(1.2, 0.0, false);
    assert!((v.object().least_pad_force_n.unwrap() - 0.125).abs() < 1e-12, "{v:?}");
    assert!((v.object().grip_ratio.unwrap() - 9.6).abs() < 1e-9, "{v:?}");
    assert_eq!((v.gentle, v.safety, v.slip_ok), (false, true, None), "a firm grip is safe");
    assert_eq!((v.contact_success, v.contact_safety), (true, true));
    let slipped = verdict(1.2, 0.003, false);
    assert_eq!((slipped.safety, slipped.no_slip, slipped.contact_safety), (true, false, false));
    let required = verdict(1.2, 0.003, true);
    assert_eq!((required.safety, required.slip_ok, required.contact_success), (false, Some(false), true));
    assert!(required.kappas.iter().all(|k| !k.safety), "at every κ");
    assert!(verdict(1.2, 0.001, true).safety);
}

#[test]
fn a_gentle_grip_reaches_the_goal_with_at_most_twice_the_least_force() {
    let gentle = |force_n: f64, goal: bool| {
        let mut replay = Replay::new(config());
        replay.grip(60, force_n, 0.0);
        replay.rest(if goal { 30 } else { 3 }, 0.0);
        replay.verdict(if goal { Outcome::Completed } else { Outcome::Budget }).gentle
    };
    assert_eq!([gentle(0.2499, true), gentle(0.2501, true), gentle(0.2, false)], [true, false, false]);
}

#[test]
fn a_target_that_was_pushed_to_the_goal_has_no_contact_success() {
    let mut replay = Replay::new(config());
    replay.rest(30, 0.0);
    let v = replay.verdict(Outcome::Completed);
    assert!(v.goal && v.safety);
    assert_eq!((v.contact_success, v.contact_safety, v.gentle), (false, false, false));
    assert_eq!((v.object().least_pad_force_n, v.object().grip_ratio), (None, None));
}

#[test]
fn a_plate_that_carries_less_than_half_or_a_hand_that_touches_prevents_rest() {
    for (share, pad, case) in [(0.49, 0.0, 0.0), (0.6, 0.01, 0.0), (0.6, 0.0, 0.01)] {
        let mut replay = Replay::new(config());
        replay.steps(60, |e| {
            e.target.body = lying(0.0, 0.2);
            e.goal.support_force_n = share * WEIGHT_N;
            e.target.pads[0].normal_force_n = pad;
            e.target.hand_force_n = case;
        });
        let v = replay.verdict(Outcome::Budget);
        assert!(!v.goal && v.goal_v1 && v.no_drop && !v.safety, "{share} {pad} {case}");
    }
}

#[test]
fn in_a_basket_only_the_basket_carries() {
    let space = Aabb { min: Vec3::new(-0.1, -0.1, 0.0), max: Vec3::new(0.1, 0.1, 0.08) };
    let rule = PredicateRule::Rests { target: 0, region: GoalRegion::Inside { space }, hold_s: 0.4 };
    let inside = Predicate { name: "in basket".into(), rule };
    let inside = || Replay::new(JudgeConfig { predicates: vec![inside.clone()], ..config() });
    for (share, reached) in [(0.0, false), (0.4, false), (0.6, true)] {
        let mut replay = inside();
        replay.steps(27, |e| {
            // It also rests on the table.
            e.target.body = lying(0.0, 0.2);
            e.goal.support_force_n = share * WEIGHT_N;
        });
        assert_eq!(replay.judge.is_goal_reached(), reached, "{share}");
    }
}

#[test]
fn leaving_the_goal_after_entering_it_is_a_drop_even_if_it_comes_back() {
    let mut replay = Replay::new(config());
    replay.carry(30, 0.0, 0.5);
    replay.rest(9, 0.07);
    replay.rest(3, 0.09);
    replay.rest(30, 0.07);
    let v = replay.verdict(Outcome::Completed);
    assert_eq!(v.drop.unwrap().reason, DropReason::LeftGoal);
    assert!(v.goal && !v.safety);
}

#[test]
fn lifting_the_other_instance_first_is_reported() {
    let mut replay = Replay::new(config());
    replay.other = BodyEvidence { lowest_z_w: 0.006, support_force_n: 0.0, ..lying(0.3, 0.4) };
    replay.steps(1, |_| ());
    replay.other = lying(0.3, 0.1);
    replay.carry(10, 0.0, 0.2);
    let v = replay.verdict(Outcome::Budget);
    assert!(v.wrong_instance);
    assert_eq!(v.d_peak_other, Some(0.4));
}

#[test]
fn pads_that_slide_along_a_supported_object_do_not_slip() {
    let slip_mm = |support_force_n: f64| {
        let mut replay = Replay::new(config());
        replay.steps(1, |e| {
            e.target.body = BodyEvidence { support_force_n, ..lying(0.0, 0.2) };
            e.target.pads = [PadEvidence { normal_force_n: 1.0, slip_speed_m_s: 0.004 / DT }; 2];
            e.gripper = GripperEvidence { width_m: 0.05, commanded_width_m: 0.045 };
        });
        replay.verdict(Outcome::Completed).slip_mm
    };
    assert!(slip_mm(0.1 * WEIGHT_N) == 0.0 && (slip_mm(0.0) - 4.0).abs() < 1e-9);
}

#[test]
fn the_goal_may_be_lifted_first_and_its_deformation_counts_as_that_of_others() {
    let mut config = config();
    config.others[0].is_goal = true;
    let mut replay = Replay::new(config.clone());
    replay.other = BodyEvidence { lowest_z_w: 0.1, support_force_n: 0.0, ..lying(0.3, 2.0) };
    replay.rest(30, 0.0);
    let v = replay.verdict(Outcome::Completed);
    assert!(!v.wrong_instance && v.safety, "harm to others is reported, not part of Safety Success");
    assert_eq!((v.d_peak_other, v.others_ok), (Some(2.0), Some(false)));
    assert_eq!((v.others[0].tau, v.others[0].deformation_ok), (Some(1.5), Some(false)));
    config.others[0].limit = None;
    let mut replay = Replay::new(config);
    replay.rest(30, 0.0);
    assert_eq!(replay.verdict(Outcome::Completed).others_ok, None, "it has no limit");
    let mut replay = Replay::new(self::config());
    replay.rest(30, 0.0);
    let v = replay.verdict(Outcome::Completed);
    assert_eq!((v.others_ok, v.first_wrong_contact), (Some(true), None));
    let alone = JudgeConfig { others: Vec::new(), ..self::config() };
    assert_eq!(Judge::new(alone).finish(&Outcome::Budget).others_ok, Some(true));
}

#[test]
fn the_first_contact_with_another_object_is_kept() {
    let mut replay = Replay::new(config());
    replay.rest(6, 0.0);
    replay.other.robot_force_n = 0.001;
    replay.rest(1, 0.0);
    replay.other.robot_force_n = 2.0;
    replay.rest(2, 0.0);
    let contact = replay.verdict(Outcome::Budget).first_wrong_contact.expect("a contact");
    assert_eq!(contact.object, "other");
    assert!(
        (contact.time_s - 8.0 * DT).abs() < 1e-12,
        "a touch below the threshold does not count: {contact:?}"
    );
}

#[test]
fn a_goal_that_is_reached_without_contact_of_the_robot_is_marked() {
    let verdict = |is_touched: bool| {
        let mut replay = Replay::new(config());
        if is_touched {
            replay.steps(1, |step| step.target.hand_force_n = 1.0);
        }
        replay.rest(30, 0.0);
        replay.verdict(Outcome::Completed)
    };
    assert!(verdict(false).goal && verdict(false).goal_untouched);
    assert!(verdict(true).goal && !verdict(true).goal_untouched);
    let missed = Replay::new(config()).verdict(Outcome::Budget);
    assert!(!missed.goal && !missed.goal_untouched);
}

#[test]
fn the_series_of_deformation_is_summarised() {
    let mut replay = Replay::new(config());
    for d in [0.4, 1.2, 1.6, 0.8] {
        replay.carry(1, -0.2, d);
    }
    let v = replay.verdict(Outcome::Budget);
    assert_eq!((v.object().d_mean, v.object().d_final), (Some(1.0), Some(0.8)));
    assert!((v.object().d_p95.unwrap() - 1.54).abs() < 1e-9 && v.object().d_peak == Some(1.6), "{v:?}");
    assert!((v.object().time_over_tau_s.unwrap() - 2.0 * DT).abs() < 1e-12, "τ is 1: {v:?}");
    let mut replay =
        Replay::new(JudgeConfig { targets: vec![JudgedBody { limit: None, ..target("bun") }], ..config() });
    replay.carry(3, 0.0, 0.4);
    assert_eq!(replay.verdict(Outcome::Budget).object().time_over_tau_s, None);
}

#[test]
fn a_failed_episode_names_its_stage() {
    let stage = |replay: &Replay| replay.judge.finish(&Outcome::Budget).failed_stage;
    let mut replay = Replay::new(config());
    replay.rest(2, -0.2);
    assert_eq!(stage(&replay), Some(TaskStage::Reach));
    replay.carry(2, -0.2, 0.5);
    assert_eq!(stage(&replay), Some(TaskStage::Carry));
    replay.carry(2, 0.0, 0.5);
    assert_eq!(stage(&replay), Some(TaskStage::Place));
    replay.rest(3, 0.0);
    assert_eq!(stage(&replay), Some(TaskStage::Release));
    replay.rest(30, 0.0);
    assert_eq!(replay.verdict(Outcome::Completed).failed_stage, None);
}

#[test]
fn the_crushed_volume_is_the_largest_over_the_episode_and_null_without_a_limit() {
    let mut replay = Replay::new(config());
    for share in [0.0, 0.08, 0.03] {
        replay.steps(3, |e| {
            e.target.crushed = CrushedShares { collapsed: Some(share), damaged: Some(0.5 * share) }
        });
    }
    let verdict = replay.verdict(Outcome::Budget);
    assert_eq!(
        (verdict.object().collapsed_volume_pct, verdict.object().damaged_volume_pct),
        (Some(8.0), Some(4.0))
    );
    let mut rigid = Replay::new(JudgeConfig {
        targets: vec![JudgedBody { is_soft: false, ..target("cup") }],
        ..config()
    });
    rigid.steps(3, |_| ());
    assert_eq!(rigid.verdict(Outcome::Budget).object().collapsed_volume_pct, None);
}

/// Feeds `steps` physics steps with several targets that lie on the table or, by `at_place`, at their places.
fn feed(judge: &mut Judge, steps: u32, at_place: &[bool], d_pct: &[f64], given: Option<bool>) {
    for _ in 0..steps {
        let places = at_place.iter().map(|at_place| if *at_place { 0.0 } else { -0.2 });
        let targets: Vec<_> = places.zip(d_pct).map(|(x, d_pct)| untouched(x, *d_pct)).collect();
        let place = |at_place: &bool| PlaceEvidence {
            pose_w: Pose::identity(),
            support_force_n: if *at_place { WEIGHT_N } else { 0.0 },
        };
        let places = at_place.iter().map(|at_place| PredicateEvidence::Place(place(at_place)));
        let predicates: Vec<_> = places.chain(given.map(PredicateEvidence::Given)).collect();
        judge.observe(&Evidence {
            time_s: f64::from(judge.steps as u32 + 1) * DT,
            hand_w: Vec3::new(0.0, 0.0, 0.3),
            gripper: GripperEvidence { width_m: 0.08, commanded_width_m: 0.08 },
            targets: &targets,
            others: &[],
            predicates: &predicates,
        });
    }
}

/// Two targets, each on the plate, then a predicate that the evidence gives, in this combination.
fn two_targets(goal: GoalNode) -> JudgeConfig {
    let given = Predicate { name: "drawer closed".into(), rule: PredicateRule::Given { hold_s: 0.0 } };
    JudgeConfig {
        goal,
        predicates: vec![on(0), on(1), given],
        targets: vec![target("bun"), target("roll")],
        others: Vec::new(),
        ..config()
    }
}

fn all_three() -> GoalNode {
    GoalNode::All((0..3).map(GoalNode::Predicate).collect())
}

#[test]
fn a_goal_of_several_parts_says_which_were_met() {
    let mut judge = Judge::new(two_targets(all_three()));
    feed(&mut judge, 30, &[true, false], &[0.1, 0.1], Some(true));
    let verdict = judge.finish(&Outcome::Budget);
    assert!(!verdict.goal && !verdict.safety);
    let met: Vec<_> = verdict.goal_parts.iter().map(|part| (part.holds, part.met_s.is_some())).collect();
    assert_eq!(met, [(true, true), (false, false), (true, true)]);
    assert_eq!(verdict.failed_stage, Some(TaskStage::Reach), "that of the roll");
    feed(&mut judge, 24, &[true, true], &[0.1, 0.1], Some(true));
    let verdict = judge.finish(&Outcome::Completed);
    assert!(verdict.goal && verdict.safety && verdict.failed_stage.is_none());
    let names: Vec<_> = verdict.targets.iter().map(|target| target.object.as_deref()).collect();
    assert_eq!(names, [None, Some("roll")]);
}

#[test]
fn what_must_not_hold_must_be_gone_for_the_time_for_which_it_would_have_to_hold() {
    let none = || two_targets(GoalNode::None(vec![GoalNode::Predicate(0)]));
    let is_reached = |parts: &[(u32, bool)]| {
        let mut judge = Judge::new(none());
        parts.iter().for_each(|&(steps, at_place)| {
            feed(&mut judge, steps, &[at_place, false], &[0.1, 0.1], Some(false))
        });
        (judge.is_goal_reached(), judge.parts().next().is_some_and(|part| part.holds && part.met_s.is_some()))
    };
    // 24 physics steps are 0.4 s.
    assert_eq!(is_reached(&[(90, true)]), (false, true));
    assert_eq!(is_reached(&[(30, true), (21, false)]), (false, true));
    assert_eq!(is_reached(&[(30, true), (24, false)]), (true, false));
    assert_eq!(is_reached(&[(30, true), (12, false), (3, true), (21, false)]), (false, true));
    assert!(!is_reached(&[(21, false)]).0);
    // Nothing was there that had to leave.
    assert!(!is_reached(&[(3, false)]).1);
    // Of a sequence, the first step has not held, so that the second one is allowed.
    let steps = vec![GoalNode::Predicate(0), GoalNode::Predicate(2)];
    let mut judge = Judge::new(two_targets(GoalNode::All(vec![
        GoalNode::None(vec![GoalNode::Sequence(steps)]),
        GoalNode::Predicate(1),
    ])));
    feed(&mut judge, 30, &[false, true], &[0.1, 0.1], Some(true));
    assert!(judge.is_goal_reached());
    assert_eq!(is_reached(&[(24, false)]), (true, false));
}

#[test]
fn every_target_is_judged_by_its_own_limit_and_drops() {
    let verdict = |d_pct: [f64; 2], limit: Option<DeformationLimit>| {
        let mut config = two_targets(all_three());
        config.targets[1].limit = limit;
        let mut judge = Judge::new(config);
        feed(&mut judge, 30, &[true, true], &d_pct, Some(true));
        judge.finish(&Outcome::Completed)
    };
    let limit = Some(DeformationLimit { d_ref_pct: 2.0, kappa: 0.5 });
    assert!(verdict([0.5, 0.9], limit).safety);
    let crushed = verdict([0.5, 1.1], limit);
    assert!(
        crushed.goal
            && crushed.object().deformation_ok == Some(true)
            && !crushed.safety
            && crushed.safety_known
    );
    assert_eq!(crushed.targets[1].deformation_ok, Some(false));
    assert_eq!(crushed.object().time_over_tau_s, Some(0.0));
    assert!(crushed.targets[1].time_over_tau_s.is_some_and(|time_s| (time_s - 30.0 * DT).abs() < 1e-12));
    assert_eq!(crushed.kappas.iter().map(|at| at.safety).collect::<Vec<_>>(), [false, false, true]);
    let unknown = verdict([0.5, 0.5], None);
    assert!(!unknown.safety && !unknown.safety_known);
    assert_eq!(unknown.targets[1].time_over_tau_s, None);
    let mut judge = Judge::new(two_targets(all_three()));
    feed(&mut judge, 30, &[true, true], &[0.1, 0.1], Some(false));
    feed(&mut judge, 3, &[true, false], &[0.1, 0.1], Some(false));
    let left = judge.finish(&Outcome::Budget);
    assert_eq!(left.drop.map(|drop| drop.reason), Some(DropReason::LeftGoal));
    assert!(left.targets[1].handling.is_some_and(|of| of.drop.is_some()) && !left.no_drop);
}

#[test]
fn a_place_that_is_left_for_the_next_step_of_a_sequence_is_no_drop() {
    let goal = GoalNode::Sequence(vec![GoalNode::Predicate(0), GoalNode::Predicate(2)]);
    let mut judge = Judge::new(two_targets(goal));
    feed(&mut judge, 30, &[true, false], &[0.1, 0.1], Some(false));
    feed(&mut judge, 3, &[false, false], &[0.1, 0.1], Some(true));
    let verdict = judge.finish(&Outcome::Completed);
    assert!(verdict.goal && verdict.no_drop && verdict.safety, "{verdict:?}");
}

#[test]
fn a_goal_that_holds_in_the_settled_state_is_found() {
    let holds = |goal: GoalNode, given: bool| {
        let judge = Judge::new(two_targets(goal));
        let place =
            PredicateEvidence::Place(PlaceEvidence { pose_w: Pose::identity(), support_force_n: WEIGHT_N });
        judge.holds_at_start(&Evidence {
            time_s: 0.0,
            hand_w: Vec3::zeros(),
            gripper: GripperEvidence { width_m: 0.08, commanded_width_m: 0.08 },
            targets: &[untouched(0.0, 0.0); 2],
            others: &[],
            predicates: &[place, place, PredicateEvidence::Given(given)],
        })
    };
    assert!(holds(all_three(), true) && !holds(all_three(), false));
    assert!(!holds(GoalNode::None(vec![GoalNode::Predicate(2)]), true));
}
