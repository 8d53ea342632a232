//! Light grasps: whether friction carries the weight through the lift.

use crate::{
    rows::rows,
    support::{GRAVITY, Outcome, Squeeze, run},
};

/// Largest acceleration of the lift, m/s².
const LIFT_ACCELERATION: f64 = 0.577;

/// Gaps, mm: the reference's light ones, and two close on either side of the limit.
pub const GAPS: [f64; 12] = [49.9, 49.8, 49.775, 49.75, 49.7, 49.6, 49.5, 49.4, 49.3, 49.2, 49.0, 48.0];

/// Static friction capacity off the table over what the lift needs, by the reference (linear between its rows).
pub fn capacity_ratio(gap_mm: f64) -> f64 {
    let points: Vec<(f64, f64)> =
        rows("cube").iter().map(|r| (r.number("gap_mm"), r.number("capacity_over_weight"))).collect();
    let pair = points.windows(2).find(|p| p[0].0 >= gap_mm && p[1].0 <= gap_mm).expect("a gap of the rows");
    let share = (pair[0].0 - gap_mm) / (pair[0].0 - pair[1].0);
    let capacity = pair[0].1 + share * (pair[1].1 - pair[0].1);
    capacity * GRAVITY / (GRAVITY + LIFT_ACCELERATION)
}

/// The squeeze at one gap and step.
pub fn grasp(gap_mm: f64, dt: f64) -> Outcome {
    run(&Squeeze { dt, ..Squeeze::default() }.gap_mm(gap_mm))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_grasp_holds_exactly_when_static_friction_can_and_then_neither_overshoots_nor_chatters() {
        for (gap, dt) in GAPS.into_iter().flat_map(|gap| [(gap, 1.0 / 60.0), (gap, 1.0 / 120.0)]) {
            let (ratio, ours) = (capacity_ratio(gap), grasp(gap, dt));
            assert!(ours.failure.is_none(), "gap {gap}, dt {dt}: {:?}", ours.failure);
            if (ratio - 1.0).abs() > 0.03 {
                assert_eq!(ours.holds, ratio > 1.0, "gap {gap}, dt {dt}: capacity ratio {ratio:.3}");
            }
            if ours.holds {
                // A load that comes at once swings by as much as it changes D, if nothing damps it; slip adds to that.
                let change = (ours.d_hold_pct - ours.d_grip_pct).abs();
                let peak = (ours.d_peak_pct - ours.d_hold_pct) / change.max(0.05 * ours.d_hold_pct);
                assert!(peak <= 1.25, "gap {gap}, dt {dt}: D overshoots by {peak:.3} of its change");
                assert!(ours.ripple < 1e-3, "gap {gap}, dt {dt}: force ripples by {:.1e}", ours.ripple);
            }
        }
    }
}
