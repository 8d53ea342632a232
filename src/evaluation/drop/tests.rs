use super::*;

const DT: f64 = 1.0 / 60.0;

/// Held in mid-air, 100 mm below the hand.
fn held() -> DropSample {
    DropSample {
        time_s: 0.0,
        centre_z: 0.3,
        hand_z: 0.4,
        is_lifted: true,
        is_touched: true,
        is_touched_by_body: false,
        is_supported: false,
        is_released: false,
        is_in_workspace: true,
    }
}

fn drop_of(samples: impl IntoIterator<Item = DropSample>) -> Option<DropReason> {
    let mut monitor = DropMonitor::default();
    samples.into_iter().for_each(|m| monitor.update(&SuccessCriteria::default(), DT, &m));
    monitor.first.map(|drop| drop.reason)
}

/// One step held, then `steps` without contact, during which it falls `fall_m` relative to a hand that moves up.
fn lost(steps: u32, fall_m: f64) -> Vec<DropSample> {
    let free = (1..=steps).map(|i| DropSample {
        is_touched: false,
        is_supported: true,
        is_lifted: false,
        hand_z: 0.4 + fall_m * f64::from(i) / f64::from(steps),
        ..held()
    });
    [held()].into_iter().chain(free).collect()
}

#[test]
fn a_lost_grasp_needs_three_control_steps_and_a_fall_of_more_than_20_mm() {
    assert_eq!(drop_of(lost(9, 0.021)), Some(DropReason::LostGrasp));
    assert_eq!(drop_of(lost(8, 0.021)), None, "contact came back in time");
    assert_eq!(drop_of(lost(9, 0.019)), None, "it stayed with the hand");
}

#[test]
fn a_transient_drop_still_counts_after_a_regrasp() {
    let mut samples = lost(9, 0.025);
    samples.extend(std::iter::repeat_n(held(), 100));
    assert_eq!(drop_of(samples), Some(DropReason::LostGrasp));
}

#[test]
fn an_object_that_was_not_lifted_cannot_be_lost() {
    let mut samples = lost(30, 0.1);
    samples[0].is_lifted = false;
    assert_eq!(drop_of(samples), None);
}

#[test]
fn an_object_on_a_finger_does_not_fall_freely() {
    let lowered = |body_touches| {
        let at = |i: u32| 0.3 - 0.001 * f64::from(i);
        drop_of((0..100).map(|i| DropSample {
            is_touched: false,
            is_touched_by_body: body_touches,
            is_released: true,
            centre_z: at(i),
            ..held()
        }))
    };
    assert_eq!(lowered(false), Some(DropReason::FreeFall));
    assert_eq!(lowered(true), None);
}

#[test]
fn a_release_command_ends_the_grasp_before_it_is_lost() {
    let mut samples = lost(9, 0.025);
    samples[1..].iter_mut().for_each(|m| m.is_released = true);
    assert_eq!(drop_of(samples), None);
    let mut late = lost(9, 0.025);
    late[9].is_released = true;
    assert_eq!(drop_of(late.clone()), None, "commanded before the third control step was over");
    late.insert(9, DropSample { is_released: false, ..late[9] });
    assert_eq!(drop_of(late), Some(DropReason::LostGrasp), "commanded after it");
}

/// Released, then falling freely by `fall_m`, then lying.
fn fall(fall_m: f64) -> Vec<DropSample> {
    let air = |z: f64| DropSample { is_touched: false, is_released: true, centre_z: z, ..held() };
    let ground = DropSample { is_supported: true, is_lifted: false, ..air(0.3 - fall_m) };
    vec![held(), air(0.3 - 0.5 * fall_m), air(0.3 - fall_m), ground, ground]
}

#[test]
fn a_released_object_may_fall_49_mm_and_not_51() {
    assert_eq!(drop_of(fall(0.049)), None);
    assert_eq!(drop_of(fall(0.051)), Some(DropReason::FreeFall));
}

#[test]
fn two_short_falls_are_not_a_long_one() {
    let mut samples = fall(0.03);
    samples.extend(fall(0.03).into_iter().skip(1).map(|m| DropSample { centre_z: m.centre_z - 0.03, ..m }));
    assert_eq!(drop_of(samples), None);
}

#[test]
fn a_thrown_object_falls_from_its_highest_point() {
    let air = |z: f64| DropSample { is_touched: false, is_released: true, centre_z: z, ..held() };
    assert_eq!(drop_of([held(), air(0.34), air(0.295)]), None);
    assert_eq!(drop_of([held(), air(0.34), air(0.285)]), Some(DropReason::FreeFall));
}

#[test]
fn leaving_the_workspace_is_a_drop_and_the_first_reason_stays() {
    let out = DropSample { is_in_workspace: false, time_s: 1.5, ..held() };
    let mut monitor = DropMonitor::default();
    monitor.update(&SuccessCriteria::default(), DT, &held());
    monitor.update(&SuccessCriteria::default(), DT, &out);
    monitor.record(DropReason::LeftGoal, 2.0);
    assert_eq!(monitor.first, Some(DropEvent { reason: DropReason::LeftWorkspace, time_s: 1.5 }));
}

fn released(grips: &[(bool, f64, f64)]) -> Vec<bool> {
    let mut monitor = ReleaseMonitor::default();
    grips
        .iter()
        .map(|&(both_pads_touch, width_m, commanded_width_m)| {
            let gripper = GripperEvidence { width_m, commanded_width_m };
            monitor.update(&SuccessCriteria::default(), &gripper, both_pads_touch)
        })
        .collect()
}

#[test]
fn commanding_the_hand_open_is_a_release_and_a_regrasp_ends_it() {
    let steps = [
        (false, 0.08, 0.08),
        (true, 0.050, 0.045),
        (true, 0.047, 0.045),
        (true, 0.047, 0.080),
        (false, 0.060, 0.080),
        (true, 0.050, 0.045),
    ];
    assert_eq!(released(&steps), [false, false, false, true, true, false]);
}

#[test]
fn loosening_the_grip_is_not_a_release_but_opening_in_small_steps_is() {
    let loosened = [(true, 0.050, 0.040), (true, 0.046, 0.040), (true, 0.048, 0.047), (false, 0.047, 0.047)];
    assert_eq!(released(&loosened), [false; 4]);
    let opened = [(true, 0.050, 0.040), (true, 0.048, 0.047), (true, 0.049, 0.0495), (false, 0.0505, 0.051)];
    assert_eq!(released(&opened), [false, false, false, true]);
}

/// The gripper opens by `step` per physics step from 40 mm around an object that is 50 mm wide and lies on something:
/// its pads stay on the object while they are pressed, a little wider than commanded.
fn opened_by(step: f64, detected_at: f64) -> Vec<(bool, f64, f64)> {
    let mut grips = vec![(false, 0.08, 0.08), (true, detected_at, 0.04), (true, 0.0425, 0.04)];
    let mut commanded: f64 = 0.04;
    while commanded < 0.06 {
        commanded += step;
        // The object takes up half of the travel left to the spring of the drive.
        let width = if commanded < 0.05 { commanded + 0.25 * (0.05 - commanded) } else { commanded };
        grips.push((commanded < 0.05, width, commanded));
    }
    grips
}

#[test]
fn opening_by_steps_of_any_size_is_a_release_once_the_object_is_no_longer_squeezed() {
    for (step, detected_at) in [(1e-4, 0.050), (5e-4, 0.050), (2e-3, 0.050), (1e-4, 0.046), (5e-4, 0.044)] {
        let grips = opened_by(step, detected_at);
        let at = released(&grips).iter().position(|released| *released).expect("released in the end");
        let (_, width, commanded) = grips[at];
        assert!((0.0499..0.0521).contains(&commanded), "{step} m steps: at {commanded} m, {width} m wide");
    }
}

#[test]
fn a_hold_loosened_until_the_object_slips_out_is_a_lost_grasp_and_not_a_release() {
    // Contact is detected at 46 mm; the hold is loosened to 48 mm, wider than that, where 0.5 N still hold the object.
    let loosened =
        [(true, 0.046, 0.040), (true, 0.0425, 0.040), (true, 0.0485, 0.048), (true, 0.0485, 0.048)];
    // Then it slips out, and the pads close to the commanded width.
    let slipped = [(false, 0.0482, 0.048), (false, 0.048, 0.048)];
    assert_eq!(released(&[&loosened[..], &slipped[..]].concat()), [false; 6]);
}

#[test]
fn an_object_that_turned_wide_in_the_hand_is_not_released_while_it_is_squeezed() {
    let turned = [(true, 0.050, 0.045), (true, 0.056, 0.052), (true, 0.056, 0.0525), (false, 0.06, 0.0601)];
    assert_eq!(released(&turned), [false, false, false, true]);
}
