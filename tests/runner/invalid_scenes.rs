//! Errors of scenes and experts during a run are reported with their file.

use insta::assert_snapshot;

use crate::support::{Project, Small};

/// The message with which the check refuses a project.
fn check(project: &Project) -> String {
    project.message(project.run("x.lua").check().map(drop))
}

fn expert(expert: &'static str) -> String {
    Small { expert, task: "budget_steps = 200", ..Small::default() }.project().run("x.lua").error()
}

#[test]
fn empty_shapes_are_reported_with_their_asset() {
    let shape = "softvt.shape.sphere { radius = 0.02 }:subtract(softvt.shape.sphere { radius = 0.03 })";
    let project = Small { shape, ..Small::default() }.project();
    assert_snapshot!(project.run("x.lua").error(), @"x.lua:6: asset cube: the shape is empty; check its subtractions and intersections");
}

#[test]
fn shapes_thinner_than_a_voxel_are_refused() {
    let refusal = |shape| Small { shape, ..Small::default() }.project().run("x.lua").error();
    assert_snapshot!(refusal("softvt.shape.box { size = { 0.04, 0.04, 0.0001 } }:grounded()"), @"x.lua:6: asset cube: it is 0.1 mm thick, thinner than a voxel: at resolution 6 they are 6.67 mm; no resolution up to 64 is fine enough; make it at least 0.63 mm thick");
    assert_snapshot!(refusal("softvt.shape.box { size = { 0.04, 0.04, 0.003 } }:grounded()"), @"x.lua:6: asset cube: it is 3 mm thick, thinner than a voxel: at resolution 6 they are 6.67 mm; give resolution = 14");
    let project = Small {
        shape: "softvt.mesh { file = 'm.obj' }:grounded()",
        material: "youngs_pa = 2e4, poisson = 0.3, density = 300, resolution = 5",
        ..Small::default()
    }
    .project();
    project
        .write("m.obj", b"v 0 0 0\nv .05 0 0\nv 0 .05 0\nv 0 0 .004\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    assert_snapshot!(project.run("x.lua").error(), @"x.lua:6: asset cube: it is 4 mm thick, thinner than a voxel: at resolution 5 they are 10 mm; give resolution = 13");
}

/// A small scene of a floor and the objects that `add` places on it, from line 4 on.
fn placed(body: &str, add: &str) -> String {
    let text = format!(
        "local floor = softvt.asset {{ name = 'floor', shape = softvt.shape.box {{ size = {{ 1, 1, 0.05 }} }}:translate(0, 0, -0.025), body = softvt.static {{}} }}\n\
         local block = softvt.asset {{ name = 'block', shape = softvt.shape.box {{ size = {{ 0.04, 0.04, 0.04 }} }}:grounded(), body = {body} }}\n\
         local layout = softvt.layout('one', function(scene)\n{add}\nend)\n\
         return softvt.suite {{ name = 'one', object_type = 'deformable', tasks_differ_in = 'spatial', episodes = 1, tasks = {{\n\
         softvt.task {{ prompt = 'wait', layout = layout, budget_steps = 1, goal = softvt.on {{ object = 'a', target = 'floor' }}, expert = function(arm) arm:wait(0.1) end }} }} }}"
    );
    Project::new(&[("x.lua", &text)]).run("x.lua").error()
}

#[test]
fn overlaps_are_reported_with_depth_and_place() {
    let (rigid, soft) =
        ("softvt.rigid { density = 500 }", "softvt.soft { youngs_pa = 2e4, poisson = 0.3, density = 300 }");
    let floor = "scene:add { name = 'floor', asset = floor, position = { 0, 0, 0 } }\n";
    let add = |a: &str, b: &str| {
        format!(
            "{floor}scene:add {{ name = 'a', asset = block, {a} }}\nscene:add {{ name = 'b', asset = block, {b} }}"
        )
    };
    let beside = add("at = { 0, 0.1 }", "at = { 0.03, 0.1 }");
    assert_snapshot!(placed(rigid, &beside), @"x.lua:6: objects b and a (placed at x.lua:5) overlap by 10 mm at the start; move them apart");
    assert_snapshot!(placed(soft, &beside), @"x.lua:6: objects b and a (placed at x.lua:5) overlap by 10 mm at the start; move them apart");
    for body in [rigid, soft] {
        let sunk = add("position = { 0, 0.1, -0.012 }", "at = { 0.2, 0.1 }");
        assert_eq!(
            placed(body, &sunk),
            "x.lua:5: objects a and floor (placed at x.lua:4) overlap by 12 mm at the start; move them apart"
        );
    }
    let ball = "scene:add { name = 'c', at = { 0.02, 0.1 }, asset = softvt.asset { name = 'ball', body = softvt.soft { youngs_pa = 2e4, poisson = 0.3, density = 300 },\n\
                shape = softvt.shape.sphere { radius = 0.02 }:grounded() } }";
    let mixed = placed(rigid, &format!("{}\n{ball}", add("at = { 0, 0.1 }", "at = { 0.2, 0.1 }")));
    assert!(mixed.starts_with("x.lua:7: objects c and a (placed at x.lua:5) overlap by "), "{mixed}");
}

#[test]
fn sizes_in_millimetres_are_recognized() {
    let shape = "softvt.shape.box { size = { 40, 40, 40 } }:grounded()";
    let message = Small { shape, ..Small::default() }.project().run("x.lua").error();
    assert_snapshot!(message, @"x.lua:3: asset.shape: is 40 × 40 × 40 m, expected at most 10 m; lengths are in metres (softvt.mesh takes scale = 0.001 for mm)");
}

#[test]
fn mistakes_of_a_layout_are_reported_at_its_own_line() {
    let refused_call = |call: &str| {
        let text = Small::default()
            .text()
            .replace("scene:add { name = \"cube\", asset = cube, at = { 0, 0.1 } }", call);
        let text = text.replace("function(scene)", "function(scene, rng)");
        let text = text.replacen("local floor", "local arrange = require 'layouts.arrange' local floor", 1);
        check(&Project::new(&[("x.lua", &text)]))
    };
    let refused = |arguments: &str| refused_call(&format!("arrange.add(scene, rng, {arguments})"));
    assert_snapshot!(refused("{ { name = 'cube', asset = cube, at = { 0, 0.1 } } }"), @"x.lua:6: arrange.add.clearance: expected a number, got nil");
    assert_snapshot!(refused("{ { nam = 'cube', asset = cube, at = { 0, 0.1 } } }, 0.02"), @r#"x.lua:6: arrange.add: objects[1]: unknown key "nam"; did you mean "name"?"#);
    assert_snapshot!(refused("{ { name = 'cube', asset = cube, at = { 40, 140 } } }, 0.02"), @"x.lua:6: arrange.add: objects[1].at: (40, 140) m is out of the scene; lengths are in metres");
    assert_snapshot!(refused("{ { name = 'cube', asset = cube, at = { 0, 0.1 }, yaw_range = 60 } }, 0.02"), @"x.lua:6: arrange.add: objects[1].yaw_range: expected radians up to a full turn, got 60; math.rad converts degrees");
    assert_snapshot!(refused("{ { name = 'cube', asset = cube, at = { 0.9, 0.9 } } }, 0.02"), @"x.lua:6: object cube at (0.9, 0.9) m has nothing below it; place it above a support");
    let far = refused_call("scene:add { name = 'cube', asset = cube, at = { 40, 140 } }");
    assert_snapshot!(far, @"x.lua:6: object cube at (40, 140) m has nothing below it; place it above a support; lengths are in metres");
    let turned = refused_call("scene:add { name = 'cube', asset = cube, at = { 0, 0.1 }, yaw = 60 }");
    assert_snapshot!(turned, @"x.lua:6: scene:add.yaw: expected radians in -6.2832..6.2832, got 60; math.rad converts degrees");
    let sunk = Small { shape: "softvt.shape.box { size = { 0.04, 0.04, 0.04 } }", ..Small::default() };
    assert_snapshot!(check(&sunk.project()), @"x.lua:6: objects cube and floor (placed at x.lua:5) overlap by 20 mm at the start; the shape of cube reaches 20 mm below its origin: end it with :grounded(), or move the objects apart");
    let unknown = Small { at: "at = plac(0)", ..Small::default() };
    let text = format!("local function place(x) return {{ x, 0 }} end {}", unknown.text());
    let message = check(&Project::new(&[("x.lua", &text)]));
    assert_snapshot!(message, @r#"x.lua:6: the variable "plac" is not defined; did you mean "place"?"#);
}

#[test]
fn a_layout_keeps_materials_near_those_of_the_assets() {
    let refused = |change: &str| {
        let at = "at = { 0, 0.1 } }";
        let text = Small::default().text().replace(at, &format!("{at} {change}"));
        Project::new(&[("x.lua", &text)])
    };
    let cube = "scene:object 'cube'";
    assert_snapshot!(check(&refused(&format!("{cube}.youngs_pa = 1e9"))), @r#"x.lua:6: object.youngs_pa: the layout gives "cube" 50000 times the youngs_pa of its asset "cube", expected in 0.1..10; declare an asset of that material, or a shift"#);
    assert_snapshot!(refused(&format!("{cube}:scale_mass(0.01)")).run("x.lua").error(), @r#"x.lua:6: object.density: the layout gives "cube" 0.01 times the density of its asset "cube", expected in 0.1..10; declare an asset of that material, or a shift"#);
    refused(&format!("{cube}.youngs_pa = 2e5 {cube}.density = 30")).run("x.lua").check().expect("valid");
}

#[test]
fn unsettled_objects_are_reported() {
    let slope = "softvt.rigid { density = 500 }";
    let add = "local ramp = softvt.asset { name = 'ramp', shape = softvt.shape.box { size = { 9, 1, 0.05 } }:rotate { axis = 'y', angle = 0.1 }, body = softvt.static {} }\n\
               scene:add { name = 'floor', asset = ramp, position = { 0, 0, 0 } }\n\
               local ball = softvt.asset { name = 'ball', shape = softvt.shape.sphere { radius = 0.02 }:grounded(), body = softvt.rigid { density = 500 } }\n\
               scene:add { name = 'a', asset = ball, at = { 0, 0.1 }, on = 'floor' }";
    let message = placed(slope, add);
    assert!(message.starts_with("x.lua:7: layout one, episode 0: object a still moves at "), "{message}");
    assert!(
        message.ends_with(
            "mm/s after 3 s of settling; put it nearer to what it rests on, or make it lie stably"
        ),
        "{message}"
    );
}

#[test]
fn falling_objects_are_reported() {
    let project = Small { at: "position = { 0, 0.8, 0.1 }", ..Small::default() }.project();
    let message = project.run("x.lua").error();
    assert_snapshot!(message, @"x.lua:6: layout one, episode 0: object cube fell out of the world: there was nothing below it, and after 3 s of settling it is 44.9 m lower; place it above a support");
}

#[test]
fn objects_inside_of_the_hand_are_reported() {
    let message =
        Small { at: "position = { -0.187, 0.03, 0.29 }", ..Small::default() }.project().run("x.lua").error();
    assert!(message.starts_with("x.lua:6: object cube starts inside of the robot's hand ("), "{message}");
    assert!(message.ends_with(" mm deep; move it away, or the arm (scene.start_q)"), "{message}");
}

#[test]
fn a_failed_first_episode_leaves_no_folder() {
    let project = Small { at: "position = { 0, 0.8, 0.1 }", ..Small::default() }.project();
    project.run("x.lua").out("run").error();
    assert!(!project.path("run").exists());
    project.write("x.lua", Small::default().text().as_bytes());
    project.run("x.lua").out("run").record();
}

/// The reason with which the expert of a run of two episodes gave up in both.
fn gave_up(text: &'static str) -> String {
    let project = Small { expert: text, ..Small::default() }.project();
    let records = project.run("x.lua").episodes(2).records();
    let reasons: Vec<&str> =
        records.iter().map(|record| record.stats.gave_up.as_deref().expect("a reason")).collect();
    assert!(reasons.len() == 2 && reasons[0] == reasons[1], "{reasons:?}");
    assert!(!records[0].verdict.goal);
    project.relative(reasons[0])
}

#[test]
fn an_unreachable_pose_fails_its_episode_and_names_the_pose_that_was_asked_for() {
    let reason = gave_up("\n  arm:move_to(softvt.pose { position = { 2, 0, 0.3 } }, { speed = 1 })");
    // The tool stops on the way, at the reach of the arm: 0.855 m from the shoulder.
    let (asked, miss) = reason.split_once(" than ").expect("a distance");
    assert_eq!(asked, "x.lua:13: unreachable pose: the tool gets no nearer to (2.000, 0.000, 0.300) m");
    let (miss, _) = miss.split_once(" mm").expect("a unit");
    let miss: f64 = miss.parse().expect("a number");
    assert!((1000.0..2600.0).contains(&miss), "{reason}");
}

#[test]
fn an_expert_may_catch_an_unreachable_pose() {
    let sent = gave_up("arm:command(softvt.pose { position = { 2, 0, 0.3 } }, 0)");
    assert!(sent.starts_with("x.lua:12: unreachable pose: the tool gets no nearer to (2.000,"), "{sent}");
    let expert = "pcall(arm.move_to, arm, softvt.pose { position = { 2, 0, 0.3 } }) arm:wait(5)";
    let project = Small { expert, ..Small::default() }.project();
    let record = project.run("x.lua").record();
    assert!(record.stats.gave_up.is_none() && !record.verdict.goal, "{record:#?}");
    assert_eq!(record.stats.far_commands, 0, "nothing out of reach was sent");
}

#[test]
fn fast_motions_within_reach_are_accepted() {
    let way = "for _, y in ipairs { -0.3, 0.3, -0.3 } do\n\
               arm:move_to(softvt.pose { position = { 0.05, y, 0.2 }, yaw = y }, { speed = 3, angular_speed = 6 })\nend";
    let project = Small { expert: way, task: "budget_steps = 120", ..Small::default() }.project();
    project.run("x.lua").record();
}

#[test]
fn errors_of_experts_have_their_line() {
    assert_snapshot!(expert("\n  arm:move_too()"), @r#"x.lua: task 0, episode 0: x.lua:13: arm: unknown key "move_too"; did you mean "move_to"?"#);
    assert_snapshot!(expert("\n  arm:close_to(2)"), @"x.lua: task 0, episode 0: x.lua:13: arm:close_to: closure: expected a number in 0..1, got 2");
    assert_snapshot!(expert("\n\n  scene:object 'cub'"), @r#"x.lua: task 0, episode 0: x.lua:14: scene: unknown object "cub"; did you mean "cube"?"#);
}

#[test]
fn huge_numbers_are_printed_briefly() {
    let message = Small { material: "youngs_pa = -1e300, poisson = 0.3, density = 300", ..Small::default() };
    assert!(message.project().run("x.lua").error().ends_with("got -1e300"));
    let setting = Small::default().project().run("x.lua").set("physics.dt", "1e300").error();
    assert!(setting.ends_with("got 1e300"), "{setting}");
}
