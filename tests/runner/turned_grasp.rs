//! A grasp that is turned for want of clearance stops by force: the width of the safe window is that of a straight
//! grasp.

use crate::support::Project;

/// An oval loaf between two posts that stand where the fingers of a straight grasp would be.
const SUITE: &str = r#"
local pick_place, table_top = require "experts.pick_place", require "assets.table"
local loaf, plate = require "assets.oval_loaf", require "assets.plate"
local post = softvt.asset {
  name = "post", shape = softvt.shape.box { size = { 0.004, 0.004, 0.08 } }:grounded(), body = softvt.static {},
}
local layout = softvt.layout("between_posts", function(scene)
  scene:add { name = "table", asset = table_top, position = { 0, 0, 0 } }
  scene:add { name = "loaf", asset = loaf, at = { -0.05, 0 } }
  scene:add { name = "plate", asset = plate, at = { -0.05, 0.22 } }
  for _, side in ipairs { -1, 1 } do
    scene:add { name = side < 0 and "near" or "far", asset = post, at = { -0.05 + side * POST_X, side * 0.056 } }
  end
end)
return softvt.suite {
  name = "turned", object_type = "deformable", tasks_differ_in = "object", episodes = 1,
  tasks = { softvt.task {
    prompt = "put the loaf on the plate", layout = layout,
    goal = softvt.on { object = "loaf", target = "plate", hold_s = 0.4 },
    expert = pick_place { object = "loaf", target = "plate", window = 0 },
  } },
}
"#;

#[test]
fn a_turned_grasp_is_as_gentle_as_a_straight_one() {
    let project = Project::new(&[]);
    let grasp = |name: &str, post_x: &str| {
        project.write(&format!("{name}.lua"), SUITE.replace("POST_X", post_x).as_bytes());
        let record = project.run(&format!("{name}.lua")).record();
        assert!(record.verdict.safety, "{record:?}");
        let share =
            record.verdict.object().d_peak.expect("measured") / record.verdict.object().tau.expect("a limit");
        (share, record.stats.notes["grip_width_mm"])
    };
    let (straight, turned) = (grasp("straight", "0.06"), grasp("turned", "0.022"));
    // The loaf is longer along the closing direction of the turned hand.
    assert!(turned.1 > straight.1 + 1.0, "widths {straight:?} {turned:?} mm");
    assert!(straight.0 < 0.8 && turned.0 < 0.9, "D/τ {straight:?} {turned:?}");
}
