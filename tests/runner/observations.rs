//! Observations of policies.

use softvt::{
    benchmark::Plan,
    episode_id::{EpisodeId, EpisodeSplit},
    policy::{
        Action, ActionChunk, EpisodeBrief, Observation, Policy, PolicyError, RobotState, SensorStreams,
    },
    report::{styled_text::TerminalFormat, terminal},
    rollout::{AssetCache, ChunkedPolicy, Episode, EpisodeSpec},
    runs::{record::EpisodeRecord, summary::SuiteSummary},
    script,
    sensing::tactile::TactileMosaicLayout,
};

use crate::support::{Project, Small, assert_contains};

fn episode_id(suite: &str, task: usize) -> EpisodeId {
    EpisodeId { suite: suite.to_owned(), task, episode: 0, base_seed: 0, split: EpisodeSplit::Validation }
}

/// Holds the pose, and stores its observations.
struct RecordingPolicy {
    streams: SensorStreams,
    seen: Vec<Observation>,
}

impl Policy for &mut RecordingPolicy {
    fn name(&self) -> &str {
        "witness"
    }

    fn streams(&self) -> SensorStreams {
        self.streams.clone()
    }

    fn act(&mut self, observation: &Observation) -> Result<ActionChunk, PolicyError> {
        self.seen.push(observation.clone());
        let (position_b, axis_angle_b) = (observation.robot.ee_position_b, observation.robot.ee_axis_angle_b);
        Ok(Action::new(position_b, axis_angle_b, 0.0).into())
    }
}

/// Observations of a policy with `streams` in a short episode of a project, and the record, or the error.
fn played(project: &Project, streams: SensorStreams) -> Result<(Vec<Observation>, EpisodeRecord), String> {
    let loaded = script::load(&project.path("x.lua"), &[]).expect("it loads");
    let Plan::Suite(suite) = &loaded.plan else { panic!("a suite") };
    let opened = script::EpisodeSetup::open(&loaded, &episode_id("one", 0), &script::SceneChanges::default())
        .expect("it opens");
    let (id, scene) = (episode_id(&suite.name, 0), opened.scene.clone());
    let spec = EpisodeSpec::new(id, "witness", &suite.tasks[0], &opened.nominal, scene, &suite.settings);
    assert_eq!((spec.header.asset.as_str(), spec.header.soft), ("cube", true));
    let episode = Episode::start(spec, &AssetCache::default()).map_err(|e| e.to_string())?;
    let mut witness = RecordingPolicy { streams, seen: Vec::new() };
    let brief = EpisodeBrief {
        suite: "one".into(),
        task: 0,
        prompt: "wait".into(),
        episode: 0,
        seed: 0,
        alias: None,
    };
    let mut driver = ChunkedPolicy::new(Box::new(&mut witness), brief, 1);
    let outcome = episode.run(&mut driver).map_err(|e| e.to_string());
    drop(driver);
    outcome.map(|finished| (witness.seen, finished.record))
}

fn short() -> Small {
    Small { task: "budget_steps = 10", ..Small::default() }
}

/// Observations of a policy with `streams`, or the error.
fn shown(streams: SensorStreams) -> Result<Vec<Observation>, String> {
    played(&short().project(), streams).map(|(seen, _)| seen)
}

#[test]
fn policies_get_the_requested_streams_only() {
    let all = SensorStreams {
        cameras: vec!["wrist".into(), "third_person".into()],
        tactile: true,
        force: true,
        ..SensorStreams::default()
    };
    let seen = shown(all.clone()).expect("shown");
    assert_eq!(seen.len(), 10);
    for (step, observation) in seen.iter().enumerate() {
        let names: Vec<&str> = observation.cameras.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["wrist", "third_person"]);
        assert!(observation.cameras.iter().all(|c| c.image.dimensions() == (224, 224)));
        let tactile = observation.tactile.as_ref().expect("asked for");
        assert_eq!(tactile.frames.len(), (step + 1).min(8));
        assert_eq!(tactile.now().expect("a frame")[0].image.dimensions(), (320, 240));
        assert_eq!(tactile.mosaic(TactileMosaicLayout::Rows, None).dimensions(), (224, 224));
        assert_eq!(tactile.marker_motion(8).len(), 9);
        assert_eq!(
            tactile.marker_motion(8)[0][99..],
            tactile.marker_motion(8)[0][..99],
            "both fingers start alike"
        );
        let forces = observation.forces.as_ref().expect("asked for");
        assert_eq!((forces[0].wrench.normal(), forces[1].taxels.shape), (0.0, [25, 21]));
        assert!((0.0..=0.0805).contains(&observation.robot.gripper_width_m));
        assert_eq!(observation.prompt, "wait");
    }
    assert_eq!(seen, shown(all).expect("shown"), "the same bytes again");
    let blind = shown(SensorStreams::default()).expect("shown");
    assert!(blind.iter().all(|o| o.cameras.is_empty() && o.tactile.is_none() && o.forces.is_none()));
    assert_eq!(blind[9].robot.joints, seen[9].robot.joints, "looking changes nothing");
}

#[test]
fn earlier_steps_are_those_that_were_observed_then() {
    let streams = SensorStreams {
        cameras: vec!["wrist".into()],
        past_steps: 3,
        past_images: 2,
        depth: true,
        segmentation: true,
        ..SensorStreams::default()
    };
    let seen = shown(streams).expect("shown");
    for (step, observation) in seen.iter().enumerate() {
        assert_eq!(observation.past.len(), step.min(3));
        for (back, past) in observation.past.iter().rev().enumerate() {
            let then = &seen[step - 1 - back];
            let cameras = if back < 2 { then.cameras.as_slice() } else { &[] };
            assert_eq!((&past.robot, past.cameras.as_slice()), (&then.robot, cameras));
        }
        let camera = &observation.cameras[0];
        let (depth, objects) =
            (camera.depth.as_ref().expect("depth"), camera.segmentation.as_ref().expect("objects"));
        assert_eq!((depth.len(), objects.len()), (224 * 224, 224 * 224));
        assert!(
            depth.iter().zip(objects).all(|(depth, object)| (*depth < 5.0) == (*object > 0)),
            "step {step}"
        );
    }
    let now = &seen[9];
    let widths = |count| now.robot_states(count).iter().map(|robot| robot.joints[1]).collect::<Vec<_>>();
    assert_eq!(widths(3), [7, 8, 9].map(|step| seen[step].robot.joints[1]));
    assert_eq!(seen[0].robot_states(3), [&seen[0].robot; 3], "the first step is repeated");
    let blind = shown(SensorStreams { past_steps: 2, ..SensorStreams::default() }).expect("shown");
    assert_eq!((blind[9].past.len(), &blind[9].past[0].robot), (2, &seen[7].robot));
}

#[test]
fn sensor_noise_is_the_same_whenever_a_step_is_observed() {
    let with = |wear: &str| {
        let text = short().text().replace("episodes = 1,", &format!("episodes = 1, {wear}"));
        let project = Project::new(&[("x.lua", &text)]);
        let streams = SensorStreams { tactile: true, past_steps: 3, ..SensorStreams::default() };
        played(&project, streams).expect("played").0
    };
    let noisy = with("settings = { tactile = { wear = { noise_px = 0.1, image_noise = 1 } } },");
    let exact = with("");
    for (step, observation) in noisy.iter().enumerate() {
        let history = &observation.tactile.as_ref().expect("asked for").frames;
        for (back, frame) in history.iter().rev().enumerate() {
            let then = noisy[step - back].tactile.as_ref().expect("asked for");
            assert_eq!(Some(frame.as_ref()), then.now(), "step {step}, {back} steps back");
        }
        for (back, past) in observation.past.iter().rev().enumerate() {
            assert_eq!(past.robot, noisy[step - 1 - back].robot);
        }
        let plain = exact[step].tactile.as_ref().expect("asked for").now().expect("a frame");
        let [left, right] = history.last().expect("a frame").as_ref();
        assert_eq!(plain[0].markers.initial, plain[0].markers.current, "off: nothing touches");
        assert_eq!(plain[0].image, *plain[0].untouched);
        assert_ne!(left.markers.current, right.markers.current);
        assert_ne!(left.image, plain[0].image);
        assert_eq!(observation.robot, exact[step].robot, "noise of one sensor moves no other");
        let RobotState { sensed_width_m, gripper_width_m, .. } = observation.robot;
        let steps = sensed_width_m / 4e-4;
        assert!((steps - steps.round()).abs() < 1e-6 && (sensed_width_m - gripper_width_m).abs() < 2e-3);
    }
    assert_eq!(noisy, with("settings = { tactile = { wear = { noise_px = 0.1, image_noise = 1 } } },"));
}

#[test]
fn results_record_whether_true_forces_were_observed() {
    for force in [false, true] {
        let streams = SensorStreams { force, ..SensorStreams::default() };
        let (seen, record) = played(&short().project(), streams).expect("played");
        assert_eq!(seen[0].forces.is_some(), force);
        assert_eq!(record.stats.force_observed, force);
        assert_contains(
            serde_json::to_string(&record).expect("JSON"),
            &format!("\"force_observed\":{force},"),
        );
        let summary = SuiteSummary::from_records("one", "witness", &[record]);
        assert_eq!(summary.force_observed, force);
        assert_eq!(
            terminal::table(&summary, TerminalFormat::PLAIN.with_details())
                .contains("force_observed: it reads"),
            force
        );
    }
}

/// The small suite with lines in its layout.
fn with(lines: &str) -> Project {
    let text = short().text();
    let text =
        text.replace("  scene:add { name = \"post\"", &format!("  {lines}\n  scene:add {{ name = \"post\""));
    Project::new(&[("x.lua", &text)])
}

#[test]
fn steps_with_an_enclosed_camera_are_counted() {
    // Inside of the cube, with the floor and the robot behind it. A run of `softvt` refuses such a scene.
    let camera =
        "scene:add_camera { name = \"mole\", position = { 0, 0.1, 0.02 }, look_at = { -1, 0.1, 0.2 } }";
    let streams = SensorStreams { cameras: vec!["mole".into(), "wrist".into()], ..SensorStreams::default() };
    let (seen, record) = played(&with(camera), streams.clone()).expect("an episode is never ended by that");
    assert_eq!((seen.len(), record.stats.camera_inside), (10, 10));
    let picture = seen[9].camera("mole").expect("asked for");
    let bright = picture.pixels().filter(|p| p.0.iter().any(|c| *c > 40)).count();
    assert!(2 * bright > 224 * 224, "{bright} pixels show something");
    let outside = camera.replace("0.02 }, look", "0.2 }, look");
    let (_, record) = played(&with(&outside), streams).expect("played");
    assert_eq!(record.stats.camera_inside, 0);
}

#[test]
fn an_observation_has_no_field_for_hidden_state() {
    let observation = shown(SensorStreams::default()).expect("shown").swap_remove(0);
    // Every field by name, so that a new one must be added here; none may be hidden state.
    let Observation { time_s: _, robot, prompt: _, cameras: _, past, tactile: _, forces, force_history } =
        observation;
    let RobotState {
        ee_position_b: _,
        ee_rotation_b: _,
        ee_axis_angle_b: _,
        joints: _,
        joint_velocities: _,
        joint_torques: _,
        fingers_m: _,
        gripper_width_m: _,
        sensed_width_m: _,
        closure: _,
    } = robot;
    assert!(past.is_empty());
    assert!(
        forces.is_none() && force_history.is_empty(),
        "true forces only for those who ask, and their results say so"
    );
}
