//! A grasp that is turned for want of clearance stops by force: the width of the safe window is that of a straight
//! grasp.

use crate::support::Project;

#[test]
fn a_turned_grasp_is_as_gentle_as_a_straight_one() {
    let grasp = |post_x: &str| {
        let project = Project::of("between_posts.lua");
        project.replace("x.lua", "POST_X", post_x);
        let record = project.run("x.lua").record();
        assert!(record.verdict.safety, "{record:?}");
        let share =
            record.verdict.object().d_peak.expect("measured") / record.verdict.object().tau.expect("a limit");
        (share, record.stats.notes["grip_width_mm"])
    };
    let (straight, turned) = (grasp("0.06"), grasp("0.022"));
    // The loaf is longer along the closing direction of the turned hand.
    assert!(turned.1 > straight.1 + 1.0, "widths {straight:?} {turned:?} mm");
    assert!(straight.0 < 0.8 && turned.0 < 0.9, "D/τ {straight:?} {turned:?}");
}
