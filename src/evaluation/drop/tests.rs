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

/// Released, then falling freely by `fall_m`, then lying.
fn fall(fall_m: f64) -> Vec<DropSample> {
    let ground = DropSample { is_supported: true, is_lifted: false, ..air(0.3 - fall_m) };
    vec![held(), air(0.3 - 0.5 * fall_m), air(0.3 - fall_m), ground, ground]
}

/// Released, at a height.
fn air(centre_z: f64) -> DropSample {
    DropSample { is_touched: false, is_released: true, centre_z, ..held() }
}

/// `samples` with changes from the step `from` on.
fn changed(mut samples: Vec<DropSample>, from: usize, change: fn(&mut DropSample)) -> Vec<DropSample> {
    samples[from..].iter_mut().for_each(change);
    samples
}

#[test]
fn a_drop_is_a_lost_grasp_or_a_free_fall() {
    use DropReason::{FreeFall, LostGrasp};
    let lowered = || (0..100).map(|i| air(0.3 - 0.001 * f64::from(i))).collect::<Vec<_>>();
    let regrasped = [lost(9, 0.025), vec![held(); 100]].concat();
    let lower = fall(0.03).into_iter().skip(1).map(|m| DropSample { centre_z: m.centre_z - 0.03, ..m });
    let mut commanded_late = changed(lost(9, 0.025), 9, |m| m.is_released = true);
    commanded_late.insert(9, DropSample { is_released: false, ..commanded_late[9] });
    let cases = [
        ("three control steps without contact", lost(9, 0.021), Some(LostGrasp)),
        ("contact came back in time", lost(8, 0.021), None),
        ("it stayed with the hand", lost(9, 0.019), None),
        ("grasped again after a drop", regrasped, Some(LostGrasp)),
        ("never lifted", changed(lost(30, 0.1), 0, |m| m.is_lifted = false), None),
        ("lowered by a finger", changed(lowered(), 0, |m| m.is_touched_by_body = true), None),
        ("falls", lowered(), Some(FreeFall)),
        ("release commanded", changed(lost(9, 0.025), 1, |m| m.is_released = true), None),
        (
            "release commanded before the third control step was over",
            changed(lost(9, 0.025), 9, |m| m.is_released = true),
            None,
        ),
        ("release commanded after it", commanded_late, Some(LostGrasp)),
        ("falls by 49 mm", fall(0.049), None),
        ("falls by 51 mm", fall(0.051), Some(FreeFall)),
        ("two short falls", fall(0.03).into_iter().chain(lower).collect(), None),
        ("thrown, 45 mm from its highest point", vec![held(), air(0.34), air(0.295)], None),
        ("thrown, 55 mm from its highest point", vec![held(), air(0.34), air(0.285)], Some(FreeFall)),
    ];
    for (case, samples, expected) in cases {
        assert_eq!(drop_of(samples), expected, "{case}");
    }
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
fn opening_is_a_release_and_loosening_is_not() {
    let opened_and_regrasped = [
        (false, 0.08, 0.08),
        (true, 0.050, 0.045),
        (true, 0.047, 0.045),
        (true, 0.047, 0.080),
        (false, 0.060, 0.080),
        (true, 0.050, 0.045),
    ];
    assert_eq!(released(&opened_and_regrasped), [false, false, false, true, true, false]);
    let loosened = [(true, 0.050, 0.040), (true, 0.046, 0.040), (true, 0.048, 0.047), (false, 0.047, 0.047)];
    assert_eq!(released(&loosened), [false; 4]);
    let opened = [(true, 0.050, 0.040), (true, 0.048, 0.047), (true, 0.049, 0.0495), (false, 0.0505, 0.051)];
    assert_eq!(released(&opened), [false, false, false, true]);
    // It turned wide in the hand, and is still squeezed.
    let turned = [(true, 0.050, 0.045), (true, 0.056, 0.052), (true, 0.056, 0.0525), (false, 0.06, 0.0601)];
    assert_eq!(released(&turned), [false, false, false, true]);
    // Contact is detected at 46 mm; the hold is loosened to 48 mm, wider than that, where 0.5 N still hold the object.
    // Then it slips out, and the pads close to the commanded width.
    let slipped = [
        (true, 0.046, 0.040),
        (true, 0.0425, 0.040),
        (true, 0.0485, 0.048),
        (true, 0.0485, 0.048),
        (false, 0.0482, 0.048),
        (false, 0.048, 0.048),
    ];
    assert_eq!(released(&slipped), [false; 6]);
}
