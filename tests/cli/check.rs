//! `softvt check`: what is wrong with a script is found without running it, with file and line.

use insta::assert_snapshot;

use crate::support::{Project, Small};

fn of(small: Small) -> String {
    small.project().refusal("check x.lua")
}

#[test]
fn what_would_stop_a_run_stops_the_check() {
    let text = Small::default().text();
    let check = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        Project::new(&[("x.lua", &text.replace(from, to))]).refusal("check x.lua")
    };
    assert_snapshot!(check("target = \"post\"", "target = \"cube\""), @r#"x.lua:10: task.goal.target: is "cube", which is the object itself; name what it must reach"#);
    assert_snapshot!(check("object = \"cube\"", "object = \"floor\""), @r#"x.lua:10: task.goal.object: "floor" never moves; name an object whose body is softvt.soft or softvt.rigid"#);
    assert_snapshot!(check("object = \"cube\"", "object = \"cub\""), @r#"x.lua:10: task.goal.object: unknown object "cub"; did you mean "cube"?"#);
    assert_snapshot!(check("(scene)\n", "(scene) scene.start_q[4] = 0\n"), @"x.lua:4: scene.start_q[4]: expected radians in -3.0718..-0.0698, the limits of panda_link4, got 0");
    assert_snapshot!(check("tasks = {", "tasks = {}, shifts = {"), @r#"x.lua:9: suite.shifts[1]: expected what softvt.shift{…} gives, got a table"#);
}

#[test]
fn scenes_that_cannot_be_are_found_without_settling() {
    assert_snapshot!(of(Small { at: "xyz = { 0, 0.1, -0.012 }", ..Small::default() }), @"x.lua:6: objects cube and floor (placed at x.lua:5) overlap by 12 mm at the start; move them apart");
    let thin = of(Small {
        shape: "softvt.shape.box { size = { 0.04, 0.04, 0.003 } }:grounded()",
        ..Small::default()
    });
    assert!(thin.starts_with("x.lua:6: asset cube: it is 3 mm thick, thinner than a voxel"), "{thin}");
    let inside = of(Small {
        at: "at = { 0, 0.1 } } scene:add_camera { name = \"in\", position = { 0, 0.1, 0.02 }, look_at = { 1, 0, 0 }",
        ..Small::default()
    });
    assert_snapshot!(inside, @"x.lua: task 0, episode 0: x.lua:6: camera in: position: it stands inside of cube; move it out");
    let hand = of(Small { at: "xyz = { -0.187, 0.03, 0.29 }", ..Small::default() });
    assert!(hand.starts_with("x.lua:6: object cube starts inside of the robot's hand ("), "{hand}");
}

#[test]
fn a_suite_that_is_right_is_listed() {
    let said = Small::default().project().succeeds("check x.lua");
    assert_eq!(
        said.out,
        "suite one: 1 tasks, 1 episodes each\n   0 wait: cube on post\nx.lua: nothing is wrong with it\n"
    );
}

#[test]
fn all_suites_are_right() {
    let said = Project::new(&[]).succeeds("check suites/all.lua");
    assert_eq!(said.out.matches(" tasks, ").count(), 4);
}
