use std::sync::Arc;

use super::*;
use crate::{
    EpisodeSetup, ExpertController, ExpertGrip, SceneChanges,
    api::expert_input::{ArmReach, ExpertCommand, ExpertView, ObjectView},
    check_shift,
};
use softvt_benchmark::{Goal, Plan, ShiftValue};
use softvt_geometry::{Pose, Vec3, shape::Shape};
use softvt_robot::IkSpec;
use softvt_rollout::Controller;
use softvt_scene::{Asset, Body};

fn project(rest: &str) -> Project {
    Project::new(&[("x.lua", &format!("{SUITE}{rest}"))])
}

fn ball() -> ObjectView {
    let shape = Shape::Sphere { radius: 0.03 }.translated(Vec3::z() * 0.03);
    ObjectView {
        name: "ball".into(),
        bounds: shape.bounds(),
        size: shape.bounds().size(),
        asset: Arc::new(Asset {
            name: "ball".into(),
            shape,
            body: Body::Static,
            friction: Default::default(),
            visuals: Vec::new(),
            hints: Default::default(),
        }),
        scale: 1.0,
        youngs_factor: None,
        density_factor: None,
        strain_factor: None,
        coating: None,
        nominal: None,
        pose_w: Pose::translation(0.1, 0.0, 0.0),
        centre_w: Vec3::new(0.1, 0.0, 0.03),
        yaw: 0.0,
        joint: None,
        parts: Vec::new(),
    }
}

fn view() -> ExpertView {
    ExpertView {
        time_s: 0.0,
        dt_s: 0.05,
        reach: ArmReach { ik: IkSpec::default(), joints: [0.0, -0.2, 0.0, -2.4, 0.0, 2.2, 0.8] },
        base_w: Pose::translation(-0.66, 0.0, 0.012),
        tcp_b: Pose::translation(0.66, 0.0, 0.288),
        width_m: 0.08,
        finger_stiffness: 2000.0,
        closure: 0.0,
        pad_force_n: [0.0; 2],
        grip_controller: None,
        instances: None,
        objects: vec![ball()],
    }
}

/// An expert that can call functions of the library's `places`.
fn expert(body: &str) -> (Project, ExpertController) {
    let places = "local places = require 'experts.places'";
    let project = project(&format!("{places} return suite(function(arm, scene) {body} end)"));
    let loaded = project.load("x.lua", &[]).unwrap();
    let setup = EpisodeSetup::open(&loaded, &episode_id(0, 1), &SceneChanges::default()).unwrap();
    (project, setup.expert(ExpertGrip::Commanded).unwrap())
}

/// The next command of an expert that sees [`view`].
fn step(expert: &mut ExpertController) -> Result<Option<ExpertCommand>, ScriptError> {
    let vm = &expert.instance.vm;
    let _deadline = vm.call_deadline();
    expert.coroutine.step(&vm.lua, &view()).map_err(|e| vm.explain(&e))
}

fn run(body: &str) -> Result<Vec<ExpertCommand>, String> {
    let (project, mut expert) = expert(body);
    let folder = format!("{}/", project.path("").display()).replace("//", "/");
    let mut commands = Vec::new();
    while commands.len() < 1000 {
        match step(&mut expert).map_err(|e| e.to_string().replace(&folder, ""))? {
            Some(command) => commands.push(command),
            None => break,
        }
    }
    Ok(commands)
}

#[test]
fn a_suite_becomes_plain_data() {
    let loaded = project("return suite()").load("x.lua", &[]).unwrap();
    let Plan::Suite(suite) = &loaded.plan else { panic!("{:?}", loaded.plan) };
    assert_eq!((suite.name.as_str(), suite.episodes, suite.tasks.len()), ("test", 5, 1));
    assert_eq!((suite.tasks[0].budget_steps, suite.tasks[0].expert), (500, false));
    assert_eq!(loaded.sources.bundle.files.len(), 1);
}

#[test]
fn a_list_of_suites_is_a_plan_and_tasks_are_found_by_name() {
    let loaded = project("return { suite() }").load("x.lua", &[]).unwrap();
    assert!(matches!(&loaded.plan, Plan::Suites { suites } if suites.len() == 1));
    let open = |suite: &str, task| {
        let id = EpisodeId { suite: suite.into(), task, ..episode_id(0, 1) };
        EpisodeSetup::open(&loaded, &id, &SceneChanges::default())
            .map(|e| e.scene.objects.len())
            .map_err(|e| (e.message, e.hint))
    };
    assert_eq!(open("test", 0), Ok(2));
    assert_eq!(open("tst", 0), Err(("unknown suite \"tst\"; did you mean \"test\"?".into(), None)));
    assert_eq!(
        open("test", 3),
        Err(("suite \"test\" has no task 3".into(), Some("its tasks are 0 to 0".into())))
    );
}

#[test]
fn an_episode_depends_on_its_seed_alone() {
    let loaded = project("return suite()").load("x.lua", &[]).unwrap();
    let scene = |episode, seed| {
        EpisodeSetup::open(&loaded, &episode_id(episode, seed), &SceneChanges::default()).unwrap().scene
    };
    assert_eq!(scene(0, 1), scene(0, 1));
    assert_ne!(scene(0, 1).objects[0].pose_w, scene(1, 1).objects[0].pose_w);
    assert_ne!(scene(0, 1).objects[0].pose_w, scene(0, 2).objects[0].pose_w);
    let xs: Vec<f64> = (0..64).map(|e| scene(e, 1).objects[0].pose_w.translation.x).collect();
    let (low, high) = xs.iter().fold((1.0, -1.0), |(l, h), x| (x.min(l), x.max(h)));
    assert!(low < -0.015 && high > 0.015 && xs.iter().all(|x| x.abs() <= 0.02), "{low} {high}");
}

#[test]
fn an_episode_runs_on_the_files_of_its_plan() {
    let project = project("return suite()");
    let loaded = project.load("x.lua", &[]).unwrap();
    project.write("x.lua", b"error('changed')");
    assert!(EpisodeSetup::open(&loaded, &episode_id(0, 1), &SceneChanges::default()).is_ok());
}

#[test]
fn shifts_change_the_scene_and_are_strict() {
    let shift = |body: &str| {
        project(&format!(
            "return suite(nil, {{ softvt.shift {{ name = 'stiffness', default = 1, min = 0.1, apply = function(scene, value)\n{body}\nend }} }})"
        ))
    };
    let open = |body: &str, name: &str| {
        let project = shift(body);
        let loaded = project.load("x.lua", &[]).unwrap();
        let shifts = [ShiftValue { name: name.into(), value: 0.5 }];
        EpisodeSetup::open(
            &loaded,
            &episode_id(0, 1),
            &SceneChanges { shifts: shifts.into(), ..SceneChanges::default() },
        )
        .map(|e| e.scene)
        .map_err(|e| e.message)
    };
    let soften = "local o = scene:object 'ball' o.youngs_pa = o.youngs_pa * value return scene";
    let scene = open(soften, "stiffness").unwrap();
    let Body::Soft(soft) = &scene.objects[0].asset.body else { panic!("the ball is soft") };
    assert_eq!(soft.elastic.youngs_pa(), 20e3);
    assert_eq!(
        open(soften, "stifness").unwrap_err(),
        "unknown shift \"stifness\"; did you mean \"stiffness\"?"
    );
    assert_eq!(
        open("scene:object('ball').youngs = 1", "stiffness").unwrap_err(),
        "object: unknown key \"youngs\"; did you mean \"youngs_pa\"?"
    );
    assert_eq!(
        open("scene:object('ball').poisson = value", "stiffness").unwrap_err(),
        "object.poisson: expected a number in 0..below 0.5, got 0.5"
    );
    assert_eq!(
        open("scene.gravty = { 0, 0, 0 }", "stiffness").unwrap_err(),
        "scene: unknown key \"gravty\"; did you mean \"gravity\"?"
    );
}

#[test]
fn the_library_scales_stiffness_and_mass() {
    let project =
        project("local shifts = require 'shifts'\nreturn suite(nil, { shifts.stiffness, shifts.mass })");
    let loaded = project.load("x.lua", &[]).unwrap();
    assert!(loaded.sources.bundle.files.contains_key("scripts/shifts.lua"));
    let shifts = [("stiffness", 0.5), ("mass", 2.0)].map(|(name, value)| (name.to_owned(), value).into());
    let scene = EpisodeSetup::open(
        &loaded,
        &episode_id(0, 1),
        &SceneChanges { shifts: shifts.into(), ..SceneChanges::default() },
    )
    .unwrap()
    .scene;
    let Body::Soft(soft) = &scene.objects[0].asset.body else { panic!("the ball is soft") };
    assert_eq!((soft.elastic.youngs_pa(), soft.elastic.density()), (20e3, 400.0));
    let Plan::Suite(suite) = &loaded.plan else { panic!("{:?}", loaded.plan) };
    assert!(check_shift(&suite.shifts, "mass", 2.0).is_ok());
    assert_eq!(
        check_shift(&suite.shifts, "mass", 0.0).map_err(|error| error.to_string()),
        Err("shift mass: expected a number in 0.01..100 (1), got 0".to_owned())
    );
}

#[test]
fn unreachable_goals_are_reported_at_their_line() {
    let open = |object: &str, target: &str| {
        let text = format!(
            "local chest = softvt.asset {{ name = 'chest', shape = mat.shape, body = softvt.articulated {{ parts = {{ {{ name = 'top_drawer',\n\
             shape = mat.shape:translate(0, 0, 0.05), density = 500, joint = softvt.slider {{ axis = {{ 0, 1, 0 }}, lower = 0, upper = 0.1 }} }} }} }} }}\n\
             local sky = softvt.asset {{ name = 'sky', shape = mat.shape, body = softvt.scenery {{}} }}\n\
             local all = softvt.layout('all', function(scene) for i, asset in ipairs {{ ball, mat, chest, sky }} do\n\
             scene:add {{ name = asset.name, asset = asset, at = {{ i, 0 }} }} end end)\n\
             return softvt.suite {{ name = 'test', object_type = 'rigid', tasks_differ_in = 'object', tasks = {{ softvt.task {{\n\
             prompt = 'p', layout = all, goal = softvt.on {{ -- a comment\n object = '{object}',\n target = '{target}' }} }} }} }}"
        );
        let project = project(&text);
        let loaded = project.load("x.lua", &[]).unwrap();
        let folder = format!("{}/", project.path("").display()).replace("//", "/");
        let opened = EpisodeSetup::open(&loaded, &episode_id(0, 1), &SceneChanges::default()).map(|_| ());
        opened.map_err(|e| e.to_string().replace(&folder, ""))
    };
    let line = SUITE.lines().count() + 8;
    let wrong = |object: &str, target: &str| open(object, target).unwrap_err();
    assert_eq!(open("ball", "chest.top_drawer"), Ok(()));
    assert_eq!(
        wrong("bal", "mat"),
        format!("x.lua:{line}: task.goal.object: unknown object \"bal\"; did you mean \"ball\"?")
    );
    assert_eq!(
        wrong("ball", "chest.top"),
        format!(
            "x.lua:{}: task.goal.target: unknown object \"chest.top\"; did you mean \"chest.top_drawer\"?",
            line + 1
        )
    );
    for fixed in ["mat", "chest", "sky"] {
        assert_eq!(
            wrong(fixed, "ball"),
            format!(
                "x.lua:{line}: task.goal.object: \"{fixed}\" never moves; name an object whose body is softvt.soft or \
                 softvt.rigid"
            )
        );
    }
    assert_eq!(
        wrong("ball", "sky"),
        format!(
            "x.lua:{}: task.goal.target: \"sky\" is softvt.scenery, which has no contact; name an object that has",
            line + 1
        )
    );
}

#[test]
fn the_arm_starts_within_its_joint_limits() {
    let open = |set: &str| {
        let project = Project::new(&[(
            "x.lua",
            &(SUITE.replace("scene:add {", &format!("{set} scene:add {{")) + "return suite()"),
        )]);
        let loaded = project.load("x.lua", &[]).unwrap();
        let folder = format!("{}/", project.path("").display()).replace("//", "/");
        EpisodeSetup::open(&loaded, &episode_id(0, 1), &SceneChanges::default())
            .map(|e| e.scene.start_q)
            .map_err(|e| e.to_string().replace(&folder, ""))
    };
    let line = SUITE.lines().position(|line| line.contains("scene:add")).unwrap() + 1;
    assert_eq!(
        open("scene.start_q = { 0, 0, 0, 0.5, 0, 2, 0 }"),
        Err(format!(
            "x.lua:{line}: scene.start_q[4]: expected radians in -3.0718..-0.0698, the limits of panda_link4, got 0.5"
        ))
    );
    assert!(
        open("scene.start_q[2] = 1.8")
            .is_err_and(|e| e.contains("scene.start_q[2]: expected radians in -1.7628..1.7628"))
    );
    assert_eq!(open("scene.start_q = { 0, 0, 0, -2, 0, 2, 0 }"), Ok([0.0, 0.0, 0.0, -2.0, 0.0, 2.0, 0.0]));
}

#[test]
fn an_expert_that_gives_up_is_done_and_its_reason_is_kept() {
    let (_project, mut expert) = expert("arm:wait(0.1) pcall(arm.give_up, arm, 'too slippery') arm:wait(1)");
    let mut commands = 0;
    while step(&mut expert).unwrap().is_some() {
        assert_eq!(expert.gave_up(), None);
        commands += 1;
    }
    assert_eq!((commands, expert.gave_up()), (2, Some("too slippery")));
    assert_eq!(step(&mut expert).unwrap(), None, "it is not resumed");
    let message = run("arm:give_up()").unwrap_err();
    assert!(
        message.ends_with("arm:give_up: reason: expected a string that is not empty, got nil"),
        "{message}"
    );
}

#[test]
fn an_object_can_stand_on_another() {
    let text = "return softvt.suite { name = 'test', object_type = 'rigid', tasks_differ_in = 'object', tasks = { softvt.task {\n\
        prompt = 'p', goal = softvt.on { object = 'a', target = 'b' }, layout = softvt.layout('two', function(scene)\n\
        scene:add { name = 'b', asset = ball, at = { 0.1, 0 } }\n\
        scene:add { name = 'a', asset = ball, at = { 0.1, 0 }, on = 'b' }\nend) } } }";
    let loaded = project(text).load("x.lua", &[]).unwrap();
    let scene = EpisodeSetup::open(&loaded, &episode_id(0, 1), &SceneChanges::default()).unwrap().scene;
    assert!((scene.objects[1].pose_w.translation.z - 0.06).abs() < 1e-6);
    assert!(std::sync::Arc::ptr_eq(&scene.objects[0].asset, &scene.objects[1].asset));
    let beside =
        project(&text.replace("at = { 0.1, 0 }, on", "at = { 0.3, 0 }, on")).load("x.lua", &[]).unwrap();
    let error =
        EpisodeSetup::open(&beside, &episode_id(0, 1), &SceneChanges::default()).err().expect("an error");
    let expected = "scene:add: on: nothing of \"b\" is below (0.3, 0) m; give `at` a point above it";
    assert_eq!(error.message, expected);
}

#[test]
fn a_motion_is_straight_and_never_faster_than_requested() {
    let commands = run(
        "local ball = scene:object 'ball'\n\
         arm:move_to(softvt.pose { position = ball.centre }, { speed = 0.2, angular_speed = 10 })\narm:close_to(0.5, { rate = 1 })",
    )
    .unwrap();
    let at = |c: &ExpertCommand| c.pose_b.translation.vector;
    let start = view().tcp_b.translation.vector;
    let goal = Vec3::new(0.1 + 0.66, 0.0, 0.03 - 0.012);
    let moves = commands.len() - 10;
    assert!((at(&commands[moves - 1]) - goal).norm() < 1e-12);
    let direction = (goal - start).normalize();
    let mut last = start;
    for command in &commands[..moves] {
        let off = at(command) - start;
        assert!((off - direction * off.dot(&direction)).norm() < 1e-12);
        assert!((at(command) - last).norm() / 0.05 <= 0.2 + 1e-9);
        last = at(command);
    }
    assert_eq!(commands.last().unwrap().closure, 0.5);
    assert_eq!(run("arm:wait(0.2)").unwrap().len(), 4);
}

#[test]
fn an_expert_that_fails_is_reported_with_its_line() {
    let line = SUITE.lines().count() + 1;
    let error = |body: &str| run(body).unwrap_err();
    assert_eq!(error("local x = nil .. 1"), format!("x.lua:{line}: attempt to concatenate a nil value"));
    assert_eq!(
        error("coroutine.yield(3)"),
        format!(
            "x.lua:{line}: the expert yielded something that is not a command; use arm:command, arm:move_to, arm:wait … \
             instead of coroutine.yield"
        )
    );
    assert_eq!(
        error("return arm:move_by({ 0, 0, 0.01 }, { speed = 100 })"),
        format!("x.lua:{line}: arm:move_by.speed: expected a number (m/s) in above 0..6.8, got 100"),
        "a tail call"
    );
    assert_eq!(
        error("arm:open { rate = 1e9 }"),
        format!("x.lua:{line}: arm:open.rate: expected a number (1/s) in 0.001..5, got 1e9")
    );
    assert_eq!(
        error("arm:grasp(0.2, { width = 0.03 })"),
        format!(
            "x.lua:{line}: arm:grasp: closing ends at a closure of 0.2, 64 mm wide, and never reaches options.width, 30 mm; \
             close to 0.625 or more"
        )
    );
    assert_eq!(
        error("softvt.pose { position = { 0, 0, 0.2 }, yaw = 1, quaternion = { 0, 1, 0, 0 } }"),
        format!(
            "x.lua:{line}: softvt.pose: quaternion gives the whole orientation, also the yaw; give one of them"
        )
    );
    assert_eq!(
        error("scene:part('ball', 'knob')"),
        format!("x.lua:{line}: scene: ball has no parts, which softvt.articulated has")
    );
    assert_eq!(
        error("local _ = places.state(scene, 'bal')"),
        format!("x.lua:{line}: scene: unknown object \"bal\"; did you mean \"ball\"?"),
        "not at a line of the library"
    );
    assert_eq!(
        error("while true do end"),
        format!("x.lua:{line}: the script ran for more than 0.3 s; look for an endless loop")
    );
    assert_eq!(
        error("scene:object 'bal'"),
        format!("x.lua:{line}: scene: unknown object \"bal\"; did you mean \"ball\"?")
    );
    assert_eq!(
        error("arm:move_to(arm.pose, { sped = 1 })"),
        format!("x.lua:{line}: arm:move_to: unknown key \"sped\"; did you mean \"speed\"?")
    );
    assert_eq!(
        error("arm:close_to(2)"),
        format!("x.lua:{line}: arm:close_to: closure: expected a number in 0..1, got 2")
    );
    assert_eq!(
        error("arm:mov_to(1)"),
        format!("x.lua:{line}: arm: unknown key \"mov_to\"; did you mean \"move_to\"?")
    );
}

#[test]
fn an_expert_can_query_the_clearance_of_a_hand() {
    let found = run("local over = softvt.pose { position = { 0.1, 0, 0.5 }, yaw = 0 }
         local on = softvt.pose { position = { 0.1, 0, 0.06 }, yaw = 0 }
         local far, none = scene:clearance(over)
         local near, ball = scene:clearance(on, { width = 0.02 })
         assert(far == 0.2 and none == nil, tostring(far))
         assert(near < 0 and ball == 'ball', tostring(near))
         assert(scene:clearance(on, { ignore = { 'ball' } }) == 0.2)
         scene:clearance(on, { ignore = { 'bal' } })");
    let message = found.unwrap_err();
    assert!(
        message.contains("scene:clearance: ignore: unknown object \"bal\"; did you mean \"ball\"?"),
        "{message}"
    );
}

#[test]
fn the_workspace_is_a_box_within_reach_of_the_arm() {
    let open = |set: &str| {
        let project = Project::new(&[(
            "x.lua",
            &(SUITE.replace("scene:add {", &format!("{set} scene:add {{")) + "return suite()"),
        )]);
        let loaded = project.load("x.lua", &[]).unwrap();
        let opened = EpisodeSetup::open(&loaded, &episode_id(0, 1), &SceneChanges::default());
        opened.map(|_| ()).map_err(|e| e.to_string().rsplit('/').next().unwrap_or_default().to_owned())
    };
    let line = SUITE.lines().position(|line| line.contains("softvt.layout")).unwrap() + 1;
    assert_eq!(open("scene.workspace_min = { -0.5, -0.6, -0.05 }"), Ok(()));
    assert_eq!(
        open("scene.workspace_min = { 0, 0.7, 0 }"),
        Err(format!(
            "x.lua:{line}: scene.workspace_min {{ 0, 0.7, 0 }} is not below scene.workspace_max {{ 0.5, 0.6, 1 }} along y"
        ))
    );
    assert_eq!(
        open("scene.base = { 999, 0, 0 }"),
        Err(format!(
            "x.lua:{line}: scene.base {{ 999, 0, 0 }} is 998.5 m from the workspace, and the arm reaches 1.188 m; move \
             the base, or scene.workspace_min and scene.workspace_max"
        ))
    );
}

#[test]
fn an_episode_of_another_suite_than_that_of_the_plan_is_refused() {
    let text = format!("{SUITE}return suite()");
    let project = Project::new(&[("x.lua", &text)]);
    let mut loaded = project.load("x.lua", &[]).expect("a suite");
    let id = EpisodeId {
        suite: "test".into(),
        task: 0,
        episode: 0,
        base_seed: 0,
        split: EpisodeSplit::Validation,
    };
    assert!(EpisodeSetup::open(&loaded, &id, &SceneChanges::default()).is_ok());
    let Plan::Suite(suite) = &mut loaded.plan else { panic!("a suite") };
    if let Goal::On(of) | Goal::Inside(of) = &mut suite.tasks[0].goal {
        of.target = "ball".into();
    }
    let Err(error) = EpisodeSetup::open(&loaded, &id, &SceneChanges::default()) else {
        panic!("another goal")
    };
    assert!(error.message.starts_with("suite \"test\" differs from that of the plan"), "{error}");
    assert!(error.line.is_some(), "{error}");
}

/// The setup of an episode of a suite whose task has this `episode_prompt` and a shift of the prompt.
fn with_episode_prompt(function: &str, episode: u32, shifts: &[ShiftValue]) -> Result<EpisodeSetup, String> {
    let shift = "softvt.shift { name = 'shout', default = 0, apply = function(scene) scene.prompt = scene.prompt .. '!' end }";
    let rest = format!(
        "local s = suite(nil, {{ {shift} }})\ns.tasks[1].episode_prompt = function(scene, rng) {function} end\nreturn s"
    );
    let project = project(&rest);
    let loaded = project.load("x.lua", &[]).map_err(|error| error.to_string())?;
    let changes = SceneChanges { shifts: shifts.into(), ..SceneChanges::default() };
    EpisodeSetup::open(&loaded, &episode_id(episode, 0), &changes)
        .map_err(|error| error.to_string().rsplit_once("x.lua:").expect("a line").1.to_owned())
}

#[test]
fn a_prompt_may_depend_on_what_was_drawn() {
    let function = "local y = scene:object('ball').position[2] return ('%s the ball at %.4f'):format(rng:choice { 'lift', 'raise' }, y)";
    let setup =
        |episode, shifts: &[ShiftValue]| with_episode_prompt(function, episode, shifts).expect("it opens");
    let prompts: Vec<String> = (0..8).map(|episode| setup(episode, &[]).prompt).collect();
    for (episode, prompt) in (0..).zip(&prompts) {
        let setup = setup(episode, &[]);
        let y = setup.scene.objects[0].pose_w.translation.vector.y;
        assert!(prompt.ends_with(&format!(" the ball at {y:.4}")), "{prompt}, {y}");
        assert_eq!((&setup.prompt, &setup.nominal_prompt), (prompt, prompt), "it is reproducible");
    }
    assert!(prompts.iter().any(|p| p.starts_with("lift")) && prompts.iter().any(|p| p.starts_with("raise")));
    let shouted = setup(0, &[ShiftValue { name: "shout".into(), value: 1.0 }]);
    assert_eq!((shouted.prompt, shouted.nominal_prompt), (format!("{}!", prompts[0]), prompts[0].clone()));
}

#[test]
fn the_function_of_a_prompt_returns_a_text_and_leaves_the_scene() {
    let error = |function| with_episode_prompt(function, 0, &[]).err().expect("an error");
    let lines: Vec<&str> = SUITE.lines().collect();
    let of_task = lines.iter().position(|line| line.contains("softvt.task {")).expect("a task") + 1;
    let label = format!("{of_task}: task.episode_prompt: ");
    assert_eq!(error(""), format!("{label}what it returned: expected a string that is not empty, got nil"));
    assert_eq!(
        error("return ''"),
        format!("{label}what it returned: expected a string that is not empty, got \"\"")
    );
    assert!(
        error("return ('x'):rep(5000)")
            .starts_with(&format!("{label}what it returned: expected a text of at most 4096"))
    );
    assert_eq!(
        error("scene:object('ball').yaw = 1 return 'lift'"),
        format!("{label}changed the scene; change it in the layout")
    );
    assert_eq!(error("error('no')"), format!("{}: no", lines.len() + 2));
    assert_eq!(error("return '  '"), format!("{label}returned a blank text"));
    assert_eq!(
        error("return 'lift \\t'"),
        format!(
            "{label}returned \"lift \\t\", whose '\\t' is no printable character of ASCII, and in no prompt of the suite"
        )
    );
    assert!(error("while true do end").contains("ran for more than 0.3 s"));
}

#[test]
fn an_expert_learns_what_the_arm_reaches() {
    let (_project, mut expert) = expert(
        "local down = softvt.pose { position = { -0.15, 0.1, 0.2 }, quaternion = { 0, 1, 0, 0 } }
         local near, none = arm:reaches(down)
         local far, miss = arm:reaches(down:at { 1.2, 0, 0.2 })
         arm:note('near', near and none == 0 and 1 or 0) arm:note('far', far and 1 or 0) arm:note('miss_m', miss)
         arm:wait(1)",
    );
    step(&mut expert).expect("a command");
    let notes = expert.notes();
    assert_eq!((notes["near"], notes["far"]), (1.0, 0.0));
    assert!((0.5..1.5).contains(&notes["miss_m"]), "{notes:?}");
}
