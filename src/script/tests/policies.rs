//! Policies and profiles in Lua: loading, observations, actions and malformed results.

use std::{sync::Arc, time::Duration};

use image::{Rgb, RgbImage};

use super::*;
use crate::{PolicyFile, load_profile};
use softvt_benchmark::seed::EpisodeSeed;
use softvt_geometry::Vec3;
use softvt_policy::{
    ActionChunk, CameraImage, EncodedGrip, EpisodeBrief, GripTarget, Observation, Policy, PolicyError,
    RobotState, SensorStreams, TactileFrame, TactileHistory, ToolCommand, ToolMotion,
    profile::{GripCode, Profile},
};
use softvt_sensing::tactile::Markers;

pub(super) fn seed(episode: u32) -> EpisodeSeed {
    EpisodeSeed::new(&episode_id(episode, 0), "one")
}

/// A finger whose markers have all moved by `by` px, with an image that is `lit` brighter than the untouched one.
fn finger(by: [f32; 2], lit: u8) -> TactileFrame {
    let rest = RgbImage::from_pixel(320, 240, Rgb([100, 100, 100]));
    let image = RgbImage::from_pixel(320, 240, Rgb([100 + lit, 100, 100 - lit]));
    let initial = Markers::at_rest().initial;
    let markers = Markers { initial, current: initial.map(|[x, y]| [x + by[0], y + by[1]]) };
    TactileFrame::new(image, Arc::new(rest), markers)
}

pub(super) fn observation() -> Observation {
    let mut image = RgbImage::from_pixel(8, 6, Rgb([0, 0, 0]));
    image.put_pixel(2, 1, Rgb([10, 20, 30]));
    let before = Arc::new([finger([0.0, 0.0], 0), finger([0.0, 0.0], 0)]);
    let now = Arc::new([finger([-0.5, 0.25], 40), finger([0.5, 0.0], 0)]);
    Observation {
        time_s: 1.5,
        robot: RobotState {
            ee_position_b: Vec3::new(0.5, -0.125, 0.25),
            ee_axis_angle_b: Vec3::new(std::f64::consts::PI, 0.0, 0.0),
            joints: [0.0, 0.5, 0.0, -2.0, 0.0, 2.5, 0.75],
            gripper_width_m: 0.0625,
            sensed_width_m: 0.0624,
            closure: 0.25,
            ..RobotState::default()
        },
        prompt: "take it".into(),
        cameras: vec![Arc::new(CameraImage { name: "wrist".into(), image, depth: None, segmentation: None })],
        tactile: Some(TactileHistory { frames: vec![before, now] }),
        ..Observation::default()
    }
}

fn brief() -> EpisodeBrief {
    EpisodeBrief { suite: "one".into(), task: 3, prompt: "take it".into(), episode: 7, seed: 0, alias: None }
}

const OBSERVES: &str = "observes = { cameras = { 'wrist' }, tactile = true, drives = true }";
const POSE: &str = "position = { 0.5, 0, 0.25 }, axis_angle = { 3, 0, 0 }";

/// Loads `p.lua` of a project. Modules of the library take longer than the usual limit on a busy machine.
pub(super) fn load(project: &Project, file: &str) -> Result<PolicyFile, ScriptError> {
    PolicyFile::load_with(&project.path(file), &VmLimits { load: Duration::from_secs(10), ..limits() })
}

fn policy_file(text: &str) -> PolicyFile {
    load(&Project::new(&[("p.lua", text)]), "p.lua").unwrap_or_else(|error| panic!("{error}"))
}

/// The answer of a policy whose `act` is `body`.
fn act(body: &str) -> Result<ActionChunk, PolicyError> {
    let text = format!("return softvt.policy {{ name = 'p', {OBSERVES}, act = function(obs)\n{body}\nend }}");
    policy_file(&text).start(&seed(0), None).unwrap().act(&observation())
}

#[test]
fn non_finite_actions_fail_only_the_episode() {
    let nan = act("return { position = { 0/0, 0, 0 }, axis_angle = { 0, 0, 0 }, closure = 0 }");
    assert!(matches!(nan, Err(PolicyError::Action(message)) if message.contains("not finite")));
}

#[test]
fn an_episode_is_a_function_of_its_seed_and_no_other_episode() {
    let text = format!(
        "local count, task = 0\nreturn softvt.policy {{ name = 'p', reset = function(t) task = t end,\n\
         act = function() count = count + 1 assert(task.task == 3 and task.episode == 7 and task.suite == 'one')\n\
         return {{ {POSE}, closure = count * math.random() / 8 }} end }}"
    );
    let file = policy_file(&text);
    let episode = |number: u32| -> Vec<ToolCommand> {
        let mut policy = file.start(&seed(number), None).unwrap();
        policy.reset(&brief()).unwrap();
        (0..3).flat_map(|_| policy.act(&observation()).unwrap().commands).collect()
    };
    assert_eq!(episode(1), episode(1));
    assert_ne!(episode(1), episode(2));
}

#[test]
fn the_shipped_policies_act() {
    for name in ["hold", "touch_and_close", "feel_and_lift"] {
        let path = format!("{}/../../scripts/policies/{name}.lua", env!("CARGO_MANIFEST_DIR"));
        let file = PolicyFile::load(path.as_ref()).unwrap();
        assert_eq!(file.name, name);
        let mut policy = file.start(&seed(0), None).unwrap();
        policy.reset(&brief()).unwrap();
        let chunk = policy.act(&observation()).unwrap();
        let ToolMotion::Pose { position_b, .. } = chunk.commands[0].motion else { panic!("a pose") };
        assert_eq!(
            (position_b.x, chunk.commands[0].grip),
            (0.5, EncodedGrip::Target(GripTarget::Closure(0.0)))
        );
    }
}

fn profile(text: &str) -> Result<Profile, String> {
    let project = Project::new(&[("p.lua", text)]);
    load_profile(&project.path("p.lua")).map_err(|error| project.shorten(error))
}

fn changed(name: &str, changes: &[(&str, &str)]) -> String {
    let path = format!("{}/../../scripts/profiles/{name}.lua", env!("CARGO_MANIFEST_DIR"));
    changes.iter().fold(fs::read_to_string(path).unwrap(), |text, (from, to)| {
        assert!(text.contains(from), "{name}: {from}");
        text.replace(from, to)
    })
}

#[test]
fn the_built_in_profiles_can_be_written_in_lua() {
    let tactile = "{ keys = both \"tactile_image\", source = \"tactile_image\" },\n    { keys = both \"tactile_marker_motion\", source = \"marker_motion\" },";
    let vision = [
        ("name = \"visuo_tactile\"", "name = \"vision\""),
        (tactile, ""),
        ("closed = 1 }", "closed = 1, code = 'binary' }"),
    ];
    let drives = [
        ("name = \"visuo_tactile\"", "name = \"vision_drives\""),
        (tactile, ""),
        ("\"sensed_finger_position\"", "\"finger_position\", \"closure\""),
    ];
    let joints = [
        ("name = \"visuo_tactile\"", "name = \"visuo_tactile_joints\""),
        ("\"position\", \"axis_angle\"", "\"joints\""),
        ("\"absolute\"", "\"joints\""),
    ];
    let force = format!("{tactile}\n{{ keys = both \"tactile_gripper_force\", source = \"force\" }},");
    let released = [
        ("name = \"visuo_tactile\"", "name = \"softvtbench\""),
        ("{ \"prompt\" }", "{ \"prompt\", \"observation/prompt\" }"),
        (tactile, force.as_str()),
        ("open = 0, closed = 1", "open = 0.04, closed = 0"),
        ("\"sensed_finger_position\"", "\"finger_position\""),
    ];
    for (name, text) in [
        ("libero", changed("libero", &[])),
        ("visuo_tactile", changed("visuo_tactile", &[])),
        ("vision", changed("visuo_tactile", &vision)),
        ("vision_drives", changed("visuo_tactile", &drives)),
        ("softvtbench", changed("visuo_tactile", &released)),
        ("visuo_tactile_joints", changed("visuo_tactile", &joints)),
    ] {
        assert_eq!(profile(&text).unwrap(), Profile::named(name).unwrap());
    }
}

#[test]
fn a_profile_may_name_other_cameras_units_and_paddings() {
    let changes = [
        ("camera = \"wrist\", half_turn = true", "camera = \"side\""),
        ("pose = \"delta_osc\"", "pose = \"delta\", length = 32, scale = { 2, 2, 2, 1, 1, 1 }"),
    ];
    for (code, gripper) in [
        (GripCode::TwoWidth, "{ open = -1, closed = 1, code = \"two-width\" }"),
        (GripCode::Force, "{ code = \"force\" }"),
    ] {
        let own = ("{ open = -1, closed = 1, code = \"binary\" }", gripper);
        assert_eq!(profile(&changed("libero", &[own])).unwrap().actions.gripper.code, code);
    }
    let profile = profile(&changed("libero", &changes)).unwrap();
    assert_eq!(profile.streams().cameras, ["third_person", "side"]);
    let units = profile.actions.units.unwrap();
    assert_eq!((profile.actions.length, units.scale[0], units.offset), (Some(32), 2.0, vec![0.0; 6]));
}

#[test]
fn a_copy_of_a_hidden_module_is_refused_under_any_name() {
    let hidden = |path: &str| std::str::from_utf8(crate::embedded(path).expect("embedded")).expect("text");
    let own = "return { strains = { 0.1, 0.2 } }";
    let policy = |module: &str| {
        format!("local x = require '{module}'\nreturn softvt.policy {{ name = 'p', act = function() end }}")
    };
    let load = |module: &str| {
        let project = Project::new(&[
            ("p.lua", &policy(module)),
            ("strains.lua", hidden("scripts/strain_sources.lua")),
            ("bun.lua", hidden("assets/steamed_bun.lua")),
            ("scripts/strain_sources.lua", own),
            ("copied.lua", own),
            ("other.lua", "return { strains = { 0.1, 0.3 } }"),
        ]);
        #[cfg(unix)]
        std::os::unix::fs::symlink(project.path("scripts/strain_sources.lua"), project.path("link.lua"))
            .unwrap();
        self::load(&project, "p.lua").map(|file| file.privileged).map_err(|error| error.to_string())
    };
    for module in [
        "strains",
        "bun",
        "copied",
        "strain_sources",
        #[cfg(unix)]
        "link",
    ] {
        let message = load(module).expect_err(module);
        let expected = format!("p.lua:1: require \"{module}\": a policy has no access to limits");
        assert!(message.contains(&expected), "{message}");
    }
    assert_eq!(load("other"), Ok(false));
}

#[test]
fn a_policy_declares_the_same_in_every_episode() {
    let text = "return softvt.policy { name = 'p',\nprivileged = false, act = function() end }";
    let file = policy_file(text);
    assert!(file.start(&seed(0), None).is_ok());
    for (loaded, key, line) in [
        (PolicyFile { privileged: true, ..file.clone() }, "privileged", 2),
        (PolicyFile { name: "q".into(), ..file.clone() }, "name", 1),
        (PolicyFile { replan: Some(2), ..file.clone() }, "replan", 1),
        (PolicyFile { gripper: Some(GripCode::Binary), ..file.clone() }, "gripper", 1),
        (
            PolicyFile { streams: SensorStreams { force: true, ..SensorStreams::default() }, ..file.clone() },
            "observes",
            1,
        ),
    ] {
        let Err(error) = loaded.start(&seed(0), None) else { panic!("{key} has changed") };
        let expected = format!("policy.{key}: the file gave another value when it was loaded");
        assert!(error.message.starts_with(&expected) && error.line == Some(line), "{error}");
    }
}

#[test]
fn a_policy_cannot_tell_an_episode_from_its_loading() {
    // The texts of errors are all that a file learns about the disk.
    let text = "local said = ''
for _, request in ipairs { 'no_such_module', '../p', 'broken' } do said = said .. select(2, pcall(require, request)) end
said = said .. select(2, pcall(softvt.mesh, { file = 'no_such_mesh.stl' })) .. select(2, pcall(softvt.mesh, { file = 'folder/cut.stl' }))
return softvt.policy { name = ('p_%d'):format(#said), act = function() error(said) end }";
    let project = Project::new(&[("p.lua", text), ("broken.lua", "x = = 1"), ("folder/cut.stl", "solid")]);
    let file = load(&project, "p.lua").unwrap();
    let mut policy = file.start(&seed(0), None).expect("the same texts, of the same length");
    let said = policy.act(&observation()).expect_err("it ends in an error").to_string();
    assert!(said.contains("no no_such_module.lua in") && !said.contains("was not read"), "{said}");
}
