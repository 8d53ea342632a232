use std::sync::Arc;

use super::*;
use crate::{
    ExpertController, ExpertGrip,
    api::expert_input::{ArmReach, ExpertCommand, ExpertView, ObjectView},
};
use softvt_benchmark::{Goal, Plan, ShiftValue};
use softvt_geometry::{Pose, Vec3, shape::Shape};
use softvt_robot::{GripperSpec, IkSpec};
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
        placed: None,
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
        gripper: GripperSpec::default(),
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
    let setup = open(&loaded, &episode_id(0, 1)).unwrap();
    (project, setup.expert(ExpertGrip::Commanded).unwrap())
}

/// The next command of an expert that sees [`view`].
pub(super) fn step(expert: &mut ExpertController) -> Result<Option<ExpertCommand>, ScriptError> {
    let vm = &expert.instance.vm;
    let _deadline = vm.call_deadline();
    expert.coroutine.step(&vm.lua, &view()).map_err(|e| vm.explain(&e))
}

fn run(body: &str) -> Result<Vec<ExpertCommand>, String> {
    let (project, mut expert) = expert(body);
    let mut commands = Vec::new();
    while commands.len() < 1000 {
        match step(&mut expert).map_err(|e| project.shorten(e))? {
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
        super::open(&loaded, &id).map(|e| e.scene.objects.len()).map_err(|e| (e.message, e.hint))
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
    let scene = |episode, seed| open(&loaded, &episode_id(episode, seed)).unwrap().scene;
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
    assert!(open(&loaded, &episode_id(0, 1)).is_ok());
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
fn an_episode_of_another_suite_than_that_of_the_plan_is_refused() {
    let text = format!("{SUITE}return suite()");
    let project = Project::new(&[("x.lua", &text)]);
    let mut loaded = project.load("x.lua", &[]).expect("a suite");
    let id = episode_id(0, 0);
    assert!(super::open(&loaded, &id).is_ok());
    let Plan::Suite(suite) = &mut loaded.plan else { panic!("a suite") };
    if let Goal::On(of) | Goal::Inside(of) = &mut suite.tasks[0].goal {
        of.target = "ball".into();
    }
    let Err(error) = super::open(&loaded, &id) else { panic!("another goal") };
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
