//! The check of a script finds its errors without running it, with file and line.

use insta::assert_snapshot;

use crate::support::{Project, Small};

/// The message with which the check refuses a project.
fn refusal(project: &Project) -> String {
    project.message(project.run("x.lua").check())
}

fn of(small: Small) -> String {
    refusal(&small.project())
}

/// Warnings of the check, which come before an error, such as that an object does not come to rest.
fn warnings(project: &Project) -> String {
    project.run("x.lua").check_to_end().0.join("\n")
}

#[test]
fn errors_of_a_run_are_found_by_the_check() {
    let text = Small::default().text();
    let check = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        refusal(&Project::new(&[("x.lua", &text.replace(from, to))]))
    };
    assert_snapshot!(check("target = \"post\"", "target = \"cube\""), @r#"x.lua:10: task.goal.target: is "cube", which is the object itself; name what it must reach"#);
    assert_snapshot!(check("object = \"cube\"", "object = \"floor\""), @r#"x.lua:10: task.goal.object: "floor" never moves; name an object whose body is softvt.soft or softvt.rigid"#);
    assert_snapshot!(check("object = \"cube\"", "object = \"cub\""), @r#"x.lua:10: task.goal.object: unknown object "cub"; did you mean "cube"?"#);
    assert_snapshot!(check("(scene)\n", "(scene) scene.start_q[4] = 0\n"), @"x.lua:4: scene.start_q[4]: expected radians in -3.0718..-0.0698, the limits of panda_link4, got 0");
    assert_snapshot!(check("tasks = {", "shifts = { {} }, tasks = {"), @r#"x.lua:9: suite.shifts[1]: expected the result of softvt.shift{…}, got a table"#);
}

#[test]
fn invalid_scenes_are_found_without_settling() {
    assert_snapshot!(of(Small { at: "position = { 0, 0.1, -0.012 }", ..Small::default() }), @"x.lua:6: objects cube and floor (placed at x.lua:5) overlap by 12 mm at the start; move them apart");
    let thin = of(Small {
        shape: "softvt.shape.box { size = { 0.04, 0.04, 0.003 } }:grounded()",
        ..Small::default()
    });
    assert!(thin.starts_with("x.lua:6: asset cube: it is 3 mm thick, thinner than a voxel"), "{thin}");
    let inside = of(Small {
        at: "at = { 0, 0.1 } } scene:add_camera { name = \"in\", position = { 0, 0.1, 0.02 }, look_at = { 1, 0, 0 }",
        ..Small::default()
    });
    assert_snapshot!(inside, @"x.lua: task 0, episode 0: x.lua:6: camera in: position: it is inside cube; move it out");
    let beside = of(Small { at: "position = { 0, -1, 0 }", ..Small::default() });
    assert_snapshot!(beside, @"x.lua:6: object cube at (0, -1) m has nothing below it; place it above a support");
    let below = of(Small { at: "position = { 0, 0.1, -0.3 }", ..Small::default() });
    assert_snapshot!(below, @"x.lua:6: object cube at (0, 0.1) m has nothing below it; place it above a support");
    let base = of(Small { at: "position = { -0.6, 0, 0.05 }", ..Small::default() });
    assert_snapshot!(base, @"x.lua:6: object cube starts inside of the robot's base; move it away");
    let dust = of(Small {
        shape: "softvt.shape.box { size = { 4e-5, 4e-5, 4e-5 } }:grounded()",
        ..Small::default()
    });
    assert_snapshot!(dust, @"x.lua:6: asset cube: it is 4.0e-5 m long, expected at least 0.001 m; sizes are in metres (a mesh has a scale)");
    let slides = of(Small {
        at: "at = { 0, 0.1 } } scene:object(\"cube\").static_mu = 0.2 local _ = {",
        ..Small::default()
    });
    assert_snapshot!(slides, @"x.lua:6: asset cube: dynamic_mu is 0.5, above static_mu, 0.2; set both, the larger one as static_mu");
    let hand = of(Small { at: "position = { -0.187, 0.03, 0.29 }", ..Small::default() });
    assert!(hand.starts_with("x.lua:6: object cube starts inside of the robot's hand ("), "{hand}");
}

#[test]
fn thin_rigid_walls_are_refused() {
    let text = |size: &str| {
        let text = Small::default().text().replace(
            "body = softvt.soft { youngs_pa = 2e4, poisson = 0.3, density",
            "body = softvt.rigid { density",
        );
        text.replace("{ 0.04, 0.04, 0.04 } }", size)
    };
    let refused = |size: &str| refusal(&Project::new(&[("x.lua", &text(size))]));
    assert_snapshot!(refused("{ 0.04, 0.04, 0.0005 } }"), @"x.lua:6: asset cube: it is about 0.6 mm thick, or its walls are, expected at least 2 mm: other bodies may pass through thinner ones");
    assert!(refused("{ 0.06, 0.06, 0.04 } }:shell(0.001)").contains("its walls are, expected at least 2 mm"));
    warnings(&Project::new(&[("x.lua", &text("{ 0.04, 0.04, 0.003 } }"))]));
}

#[test]
fn rigid_suites_refuse_soft_targets() {
    let text = Small::default().text().replace("\"deformable\"", "\"rigid\"");
    let project = Project::new(&[("x.lua", &text)]);
    let expected = "x.lua:6: the target of task 0, cube, is soft, but suite one has object_type = \"rigid\"; set \"deformable\"";
    assert_eq!(refusal(&project), expected);
    assert_eq!(project.run("x.lua").error(), expected);
}

#[test]
fn a_soft_body_of_two_pieces_is_refused() {
    let ball = "softvt.shape.sphere { radius = 0.02 }";
    let shape = format!("{ball}:union({ball}:translate(0.08, 0, 0)):grounded()");
    let text = Small::default().text().replace(Small::default().shape, &shape);
    let message = refusal(&Project::new(&[("x.lua", &text)]));
    assert!(message.starts_with("x.lua:6: asset cube: its voxel mesh has 2 separate pieces, "), "{message}");
}

#[test]
fn a_soft_body_of_few_voxels_across_is_doubted() {
    let tube = |material: &'static str| {
        let shape = "softvt.shape.cylinder { radius = 0.03, height = 0.04 }\
                     :subtract(softvt.shape.cylinder { radius = 0.02, height = 0.1 }):grounded()";
        warnings(&Small { shape, material, ..Small::default() }.project())
    };
    let coarse = tube("youngs_pa = 4e4, poisson = 0.3, density = 300, resolution = 8");
    let expected = "asset cube: most of it is less than two voxels thick (10";
    assert!(coarse.contains(expected) && coarse.contains("a voxel is 7.5 mm"), "{coarse}");
    let fine = tube("youngs_pa = 4e4, poisson = 0.3, density = 300, resolution = 16");
    assert!(!fine.contains("voxels"), "{fine}");
}

#[test]
fn implausible_units_and_wide_objects_are_doubted() {
    let of = |small: Small| warnings(&small.project());
    let light = of(Small { material: "youngs_pa = 40, poisson = 0.3, density = 0.3", ..Small::default() });
    for expected in [
        "x.lua:3: asset.body.youngs_pa: 40 Pa is outside of the usual range 300..10000000 Pa; ×1000 would be inside",
        "x.lua:3: asset.body.density: 0.3 kg/m³ is outside of the usual range 5..23000 kg/m³; ×1000 would be inside",
    ] {
        assert!(light.contains(expected), "{light}");
    }
    let wide =
        of(Small { shape: "softvt.shape.box { size = { 0.12, 0.1, 0.04 } }:grounded()", ..Small::default() });
    assert!(wide.contains("asset cube: it is 100 mm wide, and the gripper opens 80 mm"), "{wide}");
    // The post, which no episode is to reach.
    assert!(of(Small::default()).starts_with("object post: it is at (0, 2) m, outside of the workspace"));
    assert_eq!(of(Small::default()).lines().count(), 1);
    let soft = of(Small { material: "youngs_pa = 600, poisson = 0.3, density = 900", ..Small::default() });
    assert!(soft.contains("asset cube: its own weight presses it down by 29 %: it is 40 mm high"), "{soft}");
    let off = of(Small {
        shape: "softvt.shape.box { size = { 0.04, 0.04, 0.04 } }:grounded():translate(0.03, 0, 0)",
        ..Small::default()
    });
    assert!(
        off.contains("asset cube: its centre is 30 mm off the z axis, and its lowest point at z = 0 mm"),
        "{off}"
    );
    let misspelt = Small::default().text().replace(
        "name = \"cube\", shape",
        "hints = { grasp_heigth_m = 0.01, grasp_width_m = 20, weight = 1 }, name = \"cube\", shape",
    );
    let misspelt = warnings(&Project::new(&[("x.lua", &misspelt)]));
    assert!(
        misspelt.contains(
            "asset cube: the standard experts do not read hints.grasp_heigth_m; did you mean grasp_height_m?"
        ),
        "{misspelt}"
    );
    assert!(!misspelt.contains("weight"), "{misspelt}");
    let beside = "asset cube: hints.grasp_width_m is 20000 mm, and the object is 40 × 40 × 40 mm; lengths are in metres";
    assert!(misspelt.contains(beside), "{misspelt}");
    for (hints, expected) in [
        ("grasp_width_m = 0.02", ""),
        ("grasp_offset_m = 0.03", "hints.grasp_offset_m is 30 mm, and the object is 40 × 40 × 40 mm"),
        ("surface_m = 20", "hints.surface_m is 20000 mm, and the object is 40 × 40 × 40 mm"),
        ("wall_m = -0.001", "hints.wall_m is -1 mm, and the object is 40 × 40 × 40 mm"),
    ] {
        let hinted = format!("hints = {{ {hints} }}, name = \"cube\", shape");
        let text = Small::default().text().replace("name = \"cube\", shape", &hinted);
        let warned = warnings(&Project::new(&[("x.lua", &text)]));
        assert!(warned.contains(expected), "{hints}: {warned}");
        assert_eq!(warned.contains("hints."), !expected.is_empty(), "{hints}: {warned}");
    }
    let ball = "softvt.shape.sphere { radius = 0.02 }";
    let text = Small::default()
        .text()
        .replace(Small::default().shape, &format!("{ball}:union({ball}:translate(0.06, 0, 0)):grounded()"))
        .replace("softvt.soft { youngs_pa = 2e4, poisson = 0.3,", "softvt.rigid {");
    let pieces = warnings(&Project::new(&[("x.lua", &text)]));
    assert!(pieces.contains("asset cube: its shape has 2 separate pieces, "), "{pieces}");
    let expected = "task 0: its goal moves no soft object, only cube: no deformation is judged";
    assert!(pieces.contains(expected), "{pieces}");
}

#[test]
fn joints_in_other_units_and_parts_away_from_their_object_are_doubted() {
    let of = |part: &str, joint: &str| {
        let chest = format!(
            "local slab = softvt.shape.box {{ size = {{ 0.1, 0.1, 0.02 }} }}\n\
             local chest = softvt.asset {{ name = 'chest', shape = slab:grounded(), body = softvt.articulated {{ parts = {{\n\
             {{ name = 'tray', shape = slab:translate({part}), density = 500, joint = {joint} }} }} }} }}\nlocal layout"
        );
        let text = Small::default().text().replacen("local layout", &chest, 1);
        let text = text.replace(
            "at = { 0, 0.1 } }",
            "at = { 0, 0.1 } } scene:add { name = 'chest', asset = chest, at = { 0.2, -0.2 } }",
        );
        warnings(&Project::new(&[("x.lua", &text)]))
    };
    let slider = |rest: &str| {
        of("0, 0, 0.04", &format!("softvt.slider {{ axis = {{ -1, 0, 0 }}, lower = 0, {rest} }}"))
    };
    assert!(!slider("upper = 0.1, friction = 1, damping = 6").contains("chest"));
    let long = slider("upper = 100, friction = 1e6");
    assert!(
        long.contains("slider.upper: 100 m is outside of the usual range -2..2 m; ×0.001 would be"),
        "{long}"
    );
    assert!(long.contains("slider.friction: 1000000 N is outside of the usual range 0..100 N"), "{long}");
    let hinge = of(
        "0, 0, 0.04",
        "softvt.hinge { axis = { 1, 0, 0 }, origin = { 0, 80, 0 }, lower = 0, upper = 1, damping = 1e9 }",
    );
    assert!(
        hinge.contains("hinge.origin: 80 m is outside of the usual range -2..2 m; ×0.001 would"),
        "{hinge}"
    );
    assert!(hinge.contains("hinge.damping: 1e9 N m s/rad is outside of the usual range 0..30"), "{hinge}");
    let away = of("0.6, 0, 0.04", "softvt.slider { axis = { -1, 0, 0 }, lower = 0, upper = 0.1 }");
    assert!(away.contains("part tray: it is 500"), "{away}");
}

#[test]
fn a_goal_held_for_longer_than_the_budget_is_doubted() {
    let text = Small::default().text().replacen(
        "local floor",
        "local opt = softvt.options { hold_s = { default = 9.99 } }\nlocal floor",
        1,
    );
    let text = text.replace("target = \"post\" }", "target = \"post\", hold_s = opt.hold_s }");
    let found = warnings(&Project::new(&[("x.lua", &text)]));
    assert!(found.contains("task 0: the goal must hold for 9.99 s, and the budget is 2 s"), "{found}");
}

/// A project whose task has this expert, in line 12, with the standard experts at hand.
fn with_expert(expert: &str) -> Project {
    let makers = ["drawer", "knob", "pick_place", "push", "sequence"];
    let text = Small::default().text().replacen(
        "local floor",
        &format!(
            "{} local floor",
            makers.map(|name| format!("local {name} = require 'experts.{name}'")).join(" ")
        ),
        1,
    );
    Project::new(&[(
        "x.lua",
        &text.replace("expert = function(arm, scene) arm:wait(1) end", &format!("expert = {expert}")),
    )])
}

#[test]
fn standard_experts_are_checked_where_they_are_made() {
    let refused = |expert: &str| refusal(&with_expert(expert));
    assert_snapshot!(refused("pick_place"), @"x.lua:12: task.expert: expected a function, fun(arm: softvt.Arm, scene: softvt.SceneState), got pick_place, which makes one; call it: pick_place { … }");
    assert_snapshot!(refused("sequence { pick_place }"), @"x.lua:12: sequence: [1]: expected an expert, a function, got pick_place, which makes one; call it: pick_place { … }");
    assert_snapshot!(refused("pick_place { object = 'cube', target = 'cube' }"), @r#"x.lua:12: pick_place: target: is "cube", the object itself; name another"#);
    assert_snapshot!(refused("push { object = 'cube', target = 'floor', distance = 135 }"), @"x.lua:12: push: distance: expected metres in 0..1, above 0, got 135");
    assert_snapshot!(refused("push { object = 'cube', target = 'floor', distance = -0.1 }"), @"x.lua:12: push: distance: expected metres in 0..1, above 0, got -0.1");
    assert_snapshot!(refused("knob { joint = 'cube.knob', angle = 36 }"), @"x.lua:12: knob: angle: expected radians up to a full turn, got 36; math.rad converts degrees");
    with_expert("pick_place { object = 'cube', target = 'post' }").run("x.lua").check().expect("valid");
}

#[test]
fn names_of_standard_experts_are_checked_in_the_scene() {
    let refused = |expert: &str| refusal(&with_expert(expert));
    assert_snapshot!(refused("pick_place { object = 'cub', target = 'post' }"), @r#"x.lua:12: pick_place.object: unknown object "cub"; did you mean "cube"?"#);
    assert_snapshot!(refused("sequence { push { object = 'cube', target = 'post' },\npick_place {\nobject = 'cube', target = 'pst' } }"), @r#"x.lua:14: pick_place.target: unknown object "pst"; did you mean "post"?"#);
    assert_snapshot!(refused("push { object = 'floor', target = 'post' }"), @r#"x.lua:12: push.object: "floor" never moves; name an object whose body is softvt.soft or softvt.rigid"#);
    assert_snapshot!(refused("knob { joint = 'cube.knob', angle = 1 }"), @r#"x.lua:12: knob.joint: unknown joint "cube.knob"; cube has no parts, which softvt.articulated has"#);
    let stove = |angle: &str| {
        let text = with_expert(&format!("knob {{ joint = 'stove.knob', angle = {angle} }}")).text("x.lua");
        let text = text.replacen("local floor", "local stove = require 'assets.flat_stove' local floor", 1);
        let add = "at = { 0, 0.1 } } scene:add { name = 'stove', asset = stove, at = { 0.2, -0.25 } }";
        Project::new(&[("x.lua", &text.replace("at = { 0, 0.1 } }", add))])
    };
    stove("1").run("x.lua").check().expect("valid");
    assert_snapshot!(refusal(&stove("-3")), @"x.lua:12: knob.angle: expected a value of stove.knob in 0..4.71239 (rad), got -3");
}

#[test]
fn a_first_step_that_holds_at_the_start_is_a_warning() {
    let on = "softvt.on { object = \"cube\", target = \"post\" }";
    let of = |steps: &str| {
        let text = Small::default().text().replace(on, &format!("softvt.sequence {{ {steps} }}"));
        warnings(&Project::new(&[("x.lua", &text)]))
    };
    let upright = "softvt.upright { object = \"cube\" }";
    let expected = "task 0: the first step of its sequence, cube upright, holds at the start, so that it asks for nothing";
    let found = of(&format!("{upright}, {on}"));
    assert!(found.contains(expected), "{found}");
    let found = of(&format!("softvt.all {{ {upright} }}, {on}"));
    assert!(found.contains("the first step of its sequence, "), "{found}");
    assert!(!of(&format!("{on}, {upright}")).contains("sequence"));
    assert!(!of(&format!("softvt.none {{ {on} }}, {on}")).contains("sequence"), "it may rest there");
}

#[test]
fn a_camera_that_shows_nothing_of_the_goal_is_a_warning() {
    let of = |change: &str| {
        let text = Small::default().text();
        let changed = text.replace("(scene)\n", &format!("(scene) scene:camera('third_person').{change}\n"));
        assert_ne!(text, changed);
        warnings(&Project::new(&[("x.lua", &changed)]))
    };
    let near_sighted = of("far = 0.3");
    let expected = "camera third_person: nothing of the goal (cube, post) is in its view; change where it is, its look_at, \
                    or its far, 0.3 m";
    assert!(near_sighted.contains(expected), "{near_sighted}");
    assert!(of("position = { 0.6, 0, -2 }").contains("nothing of the goal"));
    assert!(!of("far = 3").contains("in its view"));
}

#[test]
fn shifts_that_change_nothing_are_refused() {
    let of = |change: &str| {
        let shift = format!(
            "shifts = {{ softvt.shift {{ name = 'stiff', default = 1, min = 0.1, max = 3, apply = function(scene, value)\n\
             {change} end }} }},\ntasks = {{"
        );
        let text = Small::default().text();
        let shifted = text.replacen("tasks = {", &shift, 1);
        assert_ne!(text, shifted);
        Project::new(&[("x.lua", &shifted)])
    };
    let object = "scene.goal_object.youngs_pa = scene.goal_object.youngs_pa";
    let sound = of(&format!("{object} * value"));
    let with_value = |project: &Project| {
        project.run("x.lua").shift("stiff", 0.5).check().map_err(|error| project.relative(error))
    };
    assert!(with_value(&sound).is_ok());
    let message = with_value(&of("local y = scene.goal_object.youngs_pa * value")).unwrap_err();
    assert!(message.contains("changes nothing in suite") && message.contains("stiff=0.5"), "{message}");
}

#[test]
fn a_scene_of_too_many_nodes_is_refused_with_its_cost() {
    let of_resolution = |resolution: u32| {
        let material = format!(
            "resolution = {resolution}, grasp_spacing = 0.01, youngs_pa = 2e4, poisson = 0.3, density"
        );
        let text = Small::default().text().replace("youngs_pa = 2e4, poisson = 0.3, density", &material);
        Project::new(&[("x.lua", &text)])
    };
    let refused = refusal(&of_resolution(40));
    assert!(
        refused.starts_with("x.lua:6: asset cube: its voxel mesh has 68921 nodes, which need about ")
            && refused.ends_with(
                " s of processor time per simulated second, expected at most 40000; give a lower resolution"
            ),
        "{refused}"
    );
    let slow = warnings(&of_resolution(21));
    assert!(
        slow.contains("task 0: the soft bodies of the scene have 10648 nodes, which need about "),
        "{slow}"
    );
    assert!(!warnings(&of_resolution(12)).contains("nodes"));
    // Two bodies share the limit.
    let project = of_resolution(28);
    let pair = "scene:add { name = \"post\"";
    let text = project
        .text("x.lua")
        .replace(pair, &format!("scene:add {{ name = \"twin\", asset = cube, at = {{ 0, -0.1 }} }} {pair}"));
    project.write("x.lua", text.as_bytes());
    let both = refusal(&project);
    assert!(both.starts_with("x.lua:7: the soft bodies of the scene have 48778 nodes"), "{both}");
}

#[test]
fn scenes_of_later_episodes_are_checked_on_request() {
    let text = Small::default()
        .text()
        .replace("(scene)\n", "(scene, rng) assert(rng:uniform(0, 1) < 0.7, 'no place')\n");
    let project = Project::new(&[("x.lua", &text)]);
    assert!(project.run("x.lua").check().is_ok(), "the first scene is good");
    let message = project.message(project.run("x.lua").episodes(20).check());
    assert_snapshot!(message, @"x.lua:4: no place (task 0 episode 2)");
}

#[test]
fn near_sighted_cameras_and_tiny_budgets_are_doubted() {
    let of = |at| warnings(&Small { at, ..Small::default() }.project());
    let blind = of("at = { 0, 0.1 } } scene:add_camera { name = \"tip\", mount = \"hand\", \
         position = { 0.05, 0, 0 }, look_at = { 0.05, 0, 1 }, up = { 1, 0, 0 }, near = 0.001, far = 0.02 } local _ = {");
    let expected = "scene:add_camera.far: 0.02 m is outside of the usual range 0.15..1000 m";
    assert!(blind.contains(expected), "{blind}");
    let short = warnings(&Small { task: "budget_steps = 9", ..Small::default() }.project());
    assert!(short.contains("task.budget_steps: 9 is outside of the usual range 10..20000"), "{short}");
}

#[test]
fn a_variation_that_changes_nothing_is_doubted() {
    let project = Small::default().project();
    let warns = |light: &str| {
        let one = "{ 1, 1 }";
        let text = format!(
            "return softvt.variation {{ name = 'v', size = {one}, stiffness = {one}, density = {one}, \
             friction = {one}, colour = 0, light = {light}, camera_offset = 0, camera_rotation = 0 }}"
        );
        project.write("v.lua", text.as_bytes());
        let run = project.run("x.lua").with(|config| config.vary = Some(project.path("v.lua")));
        run.clone().check().expect("valid");
        run.messages
            .text()
            .contains("all its factors are 1 and its largest changes 0, so that nothing varies")
    };
    assert!(warns("{ 1, 1 }") && !warns("{ 1, 1.1 }"));
}

/// A variation of friction alone.
fn friction_variation(range: &str) -> String {
    let one = "{ 1, 1 }";
    format!(
        "return softvt.variation {{ name = 'v', size = {one}, stiffness = {one}, density = {one}, friction = {range}, \
         colour = 0, light = {one}, camera_offset = 0, camera_rotation = 0 }}"
    )
}

#[test]
fn friction_that_loosens_no_grip_is_told_with_what_set_it() {
    let shifted = Small::default().text().replace("tasks = {", "shifts = require('shifts').soft, tasks = {");
    let project = Project::new(&[("x.lua", &shifted)]);
    let reason = "a pair of surfaces takes the larger coefficient, which is at least";
    let run =
        |change: &str, value: f64| project.run("x.lua").policy("noop").shift(change, value).finish().messages;
    let told = format!("warning: object cube: its static_mu is 0.012, and {reason} 1.5 on pads; ");
    assert!(run("friction", 0.02).contains(&told), "{}", run("friction", 0.02));
    assert!(!run("friction", 3.0).contains(reason) && !run("mass", 2.0).contains(reason));
    let varied = |range: &str| {
        project.write("v.lua", friction_variation(range).as_bytes());
        project.run("x.lua").with(|config| config.vary = Some(project.path("v.lua")))
    };
    let least = format!("object cube: its static_mu is 0.066, and {reason} 0.6 on pads and tables");
    let messages = |range: &str| varied(range).policy("noop").finish().messages;
    assert!(messages("{ 0.1, 0.11 }").contains(&least), "{}", messages("{ 0.1, 0.11 }"));
    assert!(!messages("{ 0.7, 1.4 }").contains(reason), "a part of them changes how objects slide on tables");
    let checked = |range: &str| varied(range).check().expect("valid").join("\n");
    let told = checked("{ 0.1, 0.11 }");
    assert!(told.contains(&least), "{told}");
    assert!(!checked("{ 0.7, 1.4 }").contains(reason));
    let of_layout = |at| warnings(&Small { at, ..Small::default() }.project());
    let by_layout = of_layout("at = { 0, 0.1 } } scene:object('cube').static_mu = 0.5 local _ = {");
    assert!(by_layout.contains("object cube: its static_mu is 0.5, and a pair"), "{by_layout}");
    for change in [
        "at = { 0, 0.1 } } scene:object('cube').coating = 0.05 local _ = {",
        "at = { 0, 0.1 } } scene:object('cube').static_mu = 0.9 local _ = {",
    ] {
        let effective = of_layout(change);
        assert!(!effective.contains(reason), "{effective}");
    }
    // Sliding on a floor with less friction depends on it.
    let smooth = "at = { 0, 0.1 } } local f = scene:object('floor') f.dynamic_mu = 0.1 f.static_mu = 0.1 \
                  scene:object('cube').static_mu = 0.5 local _ = {";
    assert!(!of_layout(smooth).contains(reason), "{}", of_layout(smooth));
}

#[test]
fn a_prompt_without_paraphrases_is_told_with_those_that_have_them() {
    let text = Small::default().text().replace("tasks = {", "shifts = require('shifts').soft, tasks = {");
    let message = Project::new(&[("x.lua", &text)])
        .run("x.lua")
        .shift("prompt", 1.0)
        .check()
        .expect_err("no paraphrase");
    let expected =
        "there is no paraphrase of \"wait\"; it has those of \"pick up the … and place it in the …\"";
    assert!(message.contains(expected), "{message}");
}

#[test]
fn objects_of_a_kitchen_are_placed_in_mm() {
    let of = |entries: &str| {
        let text = format!(
            "local layouts = require 'layouts.household'\n\
             local layout = layouts.cabinet('c', 0, {entries})\n\
             return softvt.suite {{ name = 's', object_type = 'deformable', tasks_differ_in = 'object', tasks = {{ softvt.task {{\n\
             prompt = 'p', layout = layout, goal = softvt.on {{ object = 'roll', target = 'plate' }} }} }} }}"
        );
        Project::new(&[("x.lua", &text)])
    };
    let plate = "{ 'plate', 'plate', 60, 210 }";
    let with = |roll: &str| refusal(&of(&format!("{{ {plate}, {roll} }}")));
    assert_snapshot!(with("{ 'roll', 'small_ridged_roll', -0.2, 0.08 }"), @"x.lua:2: layouts.cabinet: objects[2]: x and y are in mm, got -0.2, 0.08; did you mean -200, 80?");
    assert_snapshot!(with("{ 'roll', 'small_ridged_roll', -200 }"), @r#"x.lua:2: layouts.cabinet: objects[2]: expected name, asset, x and y (mm) such as { "bun", "golden_bun", -90, 230 }"#);
    assert_snapshot!(with("{ 'roll', 'small_ridged_roll', -200, 80, yaw_range = 1 }"), @r#"x.lua:2: layouts.cabinet: objects[2]: unknown key yaw_range; an entry has name, asset, x and y (mm), yaw and on"#);
    assert_snapshot!(with("{ 'roll', 'small_ridged_roll', -200, 80, on = false }"), @r#"x.lua:2: layouts.cabinet: objects[2].on: expected a string, got boolean; an entry is such as { "bun", "golden_bun", -90, 230 }"#);
    assert_snapshot!(with("{ 'roll', 'small_ridged_roll', -200, 8000 }"), @"x.lua:2: layouts.cabinet: objects[2]: -200, 8000 mm is out of the scene");
    assert_snapshot!(refusal(&of("{ 'roll', 'small_ridged_roll', -200, 80 }")), @r#"x.lua:2: layouts.cabinet: objects[1]: expected a table; the list has a table for each object: { { "bun", "golden_bun", -90, 230 } }"#);
    let inside = "{ 'roll', 'small_ridged_roll', 0.5, 0, on = 'plate' }";
    assert!(
        of(&format!("{{ {plate}, {inside} }}"))
            .run("x.lua")
            .check()
            .is_err_and(|error| error.contains("already holds"))
    );
    let pair = "local _ = require('layouts.spatial_soft').pair('golden_bun', 0)";
    assert_snapshot!(refusal(&Project::new(&[("x.lua", pair)])), @"x.lua:1: layouts.pair: there are five arrangements, 1 to 5");
}

#[test]
fn a_wrong_name_is_told_of_the_file_that_makes_the_expert_by_a_module() {
    let expert = "expert = function(arm, scene) arm:wait(1) end";
    let text = Small::default().text();
    assert!(text.contains(expert));
    let module = "return function(spec)\n  local function run(arm) arm:wait(1) end\n  \
                  return softvt.check_names('mine', run, spec, { object = 'object' })\nend\n";
    let text = text.replace(expert, "expert = require 'mine' { object = 'cub' }");
    let refused = refusal(&Project::new(&[("x.lua", &text), ("mine.lua", module)]));
    assert_snapshot!(refused, @r#"x.lua:12: mine.object: unknown object "cub"; did you mean "cube"?"#);
}
