//! Recordings: kept demonstrations, their streams, and independence of threads and interruptions.

use std::{collections::BTreeSet, path::Path, sync::Arc};

use softvt::{
    benchmark::Teacher,
    dataset::{
        OptionalStream, StreamValues, TaskFile,
        card::{DatasetCard, KeptOutcome},
        check, manifest,
    },
    episode_id::EpisodeSplit,
    runner::{
        BuiltinPolicy, DemoCount, PolicyOptions, PolicySource, SilentObserver, record,
        recording::{RecordingOptions, RecordingSummary},
        replay::{DemoRef, DemoReplay, demos_of, simulate_demos},
    },
};

use crate::support::{MISPLACED_CUBE, Project, Run, SOLIDS, assert_contains, files};

/// A recording that is to be made.
#[derive(Clone)]
pub struct Recording<'a> {
    pub run: Run<'a>,
    /// The policy; by default the teacher of the suite.
    pub policy: Option<PolicySource>,
    pub options: RecordingOptions,
    pub demos: u32,
    pub attempts: Option<u32>,
}

impl<'a> Recording<'a> {
    /// A recording with images and the true state.
    pub fn new(run: Run<'a>, demos: u32, out: &str) -> Self {
        let options = RecordingOptions {
            out: run.project.path(out),
            has_images: true,
            has_privileged: true,
            streams: BTreeSet::new(),
            keep: KeptOutcome::Safe,
            resume: false,
            gripper: None,
        };
        Self { run, policy: None, options, demos, attempts: None }
    }

    pub fn with(mut self, change: impl FnOnce(&mut RecordingOptions)) -> Self {
        change(&mut self.options);
        self
    }

    /// Makes it. Returns `None` if it is complete already.
    pub fn try_record(&self) -> Result<Option<RecordingSummary>, String> {
        let count = DemoCount { demos: self.demos, attempts: self.attempts };
        let policy_of =
            |teacher: Teacher| PolicyOptions::new(self.policy.clone().unwrap_or_else(|| teacher.into()));
        let loaded = self.run.load();
        let recorded = loaded.and_then(|loaded| record(&loaded, policy_of, count, &self.options));
        recorded.map_err(|error| self.run.project.relative(error))
    }

    /// Makes it. It must succeed.
    pub fn record(&self) -> RecordingSummary {
        self.try_record().unwrap_or_else(|message| panic!("{message}")).expect("a new recording")
    }

    fn refusal(&self) -> String {
        self.try_record().err().expect("it is refused")
    }
}

/// Simulates demonstrations by their actions.
fn replay(demos: &[DemoRef]) -> Vec<DemoReplay> {
    simulate_demos(demos, &(Arc::new(SilentObserver) as _)).unwrap_or_else(|error| panic!("{error}"))
}

/// True if the re-simulation of every demonstration of a dataset is byte-identical and reaches the goal.
pub fn is_reproduced(dataset: &Path) -> bool {
    let demos = demos_of(dataset).expect("a dataset");
    replay(&demos).iter().all(|replay| replay.difference.is_none() && replay.goal_reached)
}

fn project() -> Project {
    Project::new(&[("x.lua", MISPLACED_CUBE), SOLIDS])
}

#[test]
fn demonstrations_do_not_show_the_episodes_of_a_judged_run() {
    let project = project();
    project.write("secret", b"correct horse battery staple");
    let recording = Recording::new(project.run("x.lua").secret("secret"), 1, "judged");
    assert_eq!(
        recording.refusal(),
        "x.lua: a recording has no secret seed: demonstrations would show the episodes of a judged run"
    );
}

#[test]
fn the_first_good_attempts_are_kept() {
    let project = project();
    let record = |out: &str, threads| Recording::new(project.run("x.lua").threads(threads), 3, out);
    let summary = record("a", 1).record();
    let task = &summary.tasks[0];
    let rejected = *task.rejected.get("goal not reached").expect("some start on the floor");
    assert_eq!((task.demos, task.attempts), (3, 3 + rejected), "{task:?}");
    assert_eq!(DatasetCard::read(&project.path("a")).expect("a card").tasks, summary.tasks);
    let attempts = project.stored("a/attempts").expect("a run").swap_remove(0).records;
    assert_eq!(attempts.len(), task.attempts, "those not kept are there too");
    assert!(attempts.iter().all(|attempt| attempt.header.id.split == EpisodeSplit::Demonstration));
    let good = attempts.iter().filter(|attempt| attempt.verdict.safety);
    let good: Vec<u32> = good.map(|attempt| attempt.header.id.episode).collect();
    let entries = manifest::read(&project.path("a")).expect("a manifest");
    assert_eq!(entries.iter().map(|entry| entry.episode).collect::<Vec<_>>(), good);
    // With too few attempts the recording fails; with more it continues.
    Recording { attempts: Some(2), ..record("b", 3) }.refusal();
    record("b", 3).with(|options| options.resume = true).record();
    assert!(files(&project.path("a")) == files(&project.path("b")), "not the same bytes");
}

#[test]
fn unsafe_demonstrations_are_kept_on_request() {
    let project = Project::new(&[]);
    let run = || {
        project.run("suites/object_soft.lua").tasks(&[3]).set("cameras.width", 40).set("cameras.height", 30)
    };
    let by_binary_hand = |out: &str| Recording {
        policy: Some(PolicySource::Builtin(BuiltinPolicy::ExpertBinary)),
        attempts: Some(1),
        ..Recording::new(run(), 1, out)
    };
    assert_contains(
        by_binary_hand("safe").refusal(),
        "0 of 1 demonstration after 1 attempt (1 deformed too much)",
    );
    let summary = by_binary_hand("goal").with(|options| options.keep = KeptOutcome::Goal).record();
    assert_eq!((summary.tasks[0].demos, summary.tasks[0].attempts), (1, 1));
    let root = project.path("goal");
    assert!(!manifest::read(&root).expect("a manifest")[0].success);
    assert_eq!(DatasetCard::read(&root).expect("a card").keep, KeptOutcome::Goal);
    assert_eq!(project.json("goal/recording.json")["keep"], "goal");
    assert_eq!(check::folder(&root).expect("a dataset").problems, [""; 0]);
    // The label of the grip is that of the closed hand.
    let path = root.join(&manifest::read(&root).expect("a manifest")[0].hdf5_path);
    let file = TaskFile::open(&path).expect("a file");
    let labels = file.array(0, "actions_binary").expect("labels").values;
    let closures = file.array(0, "actions").expect("actions").values;
    assert!(
        labels
            .chunks(7)
            .zip(closures.chunks(7))
            .filter(|(_, action)| action[6] > 0.5)
            .all(|(label, _)| label[6] == 1.0)
    );
}

#[test]
fn depth_is_recorded_as_policies_observe_it() {
    let project = project();
    let run = project.run("x.lua").set("cameras.width", 40).set("cameras.height", 30);
    let recording = Recording::new(run, 1, "a");
    let recording = recording.with(|options| {
        options.streams =
            ["depth", "joint-torques"].map(|name| OptionalStream::named(name).expect("a stream")).into();
    });
    recording.record();
    let a = project.path("a");
    assert_eq!(DatasetCard::read(&a).expect("a card").streams, recording.options.streams);
    assert!(project.text("a/README.md").contains("| further streams | depth, joint-torques |"));
    let checked = check::folder(&a).expect("a dataset");
    assert_eq!(checked.problems, [""; 0]);
    let file = TaskFile::open(&project.path("a/hdf5/one_task0_demo.hdf5")).expect("a file");
    let steps = file.steps(0).expect("steps");
    for name in ["obs/agentview_depth", "obs/eye_in_hand_depth"] {
        let stream = file.stream(0, name).expect("a stream");
        assert_eq!(stream.row_shape, [30, 40]);
        let StreamValues::F32(metres) = stream.values else { panic!("{name}") };
        assert_eq!(metres.len(), steps * 30 * 40);
        let nearest = metres.iter().copied().fold(f32::INFINITY, f32::min);
        assert!((0.02..2.0).contains(&nearest), "{name}: {nearest} m");
    }
    assert_eq!(file.stream(0, "obs/joint_torques").expect("a stream").row_shape, [7]);
    let read = file.read(0).expect("a demonstration");
    assert!(read.streams.iter().all(|stream| !stream.name.ends_with("_depth")), "images are not read");
    // With other streams it is another recording.
    let other = recording.with(|options| options.streams.clear());
    assert!(other.refusal().contains("another recording"), "{}", other.refusal());
}
