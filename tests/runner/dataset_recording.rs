//! Recordings: kept demonstrations, refused folders, and independence of threads and interruptions.

use std::{collections::BTreeSet, fs, path::Path, sync::Arc};

use softvt::{
    benchmark::Teacher,
    dataset::{
        OptionalStream, StreamValues, TaskFile,
        card::{DatasetCard, KeptOutcome},
        check, manifest, stats,
    },
    episode_id::EpisodeSplit,
    policy::profile::GripCode,
    runner::{
        BuiltinPolicy, DemoCount, PolicyOptions, PolicySource, SilentObserver,
        episode_selector::EpisodeSelector,
        record,
        recording::{RecordingOptions, RecordingSummary},
        replay::{DemoRef, DemoReplay, check_complete, demos_of, simulate_demos},
    },
};

use crate::support::{Project, Run, SOLIDS, assert_contains, files, fixtures::MISPLACED_CUBE};

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

    /// With other options.
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

/// Simulates demonstrations again.
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
    let few = Recording { attempts: Some(2), ..record("b", 3) }.refusal();
    assert!(few.contains("task 0:") && few.contains("of 3 demonstrations after 2 attempts"), "{few}");
    assert!(project.message(check_complete(&project.path("b"))).contains("was interrupted"));
    assert!(record("b", 3).refusal().contains("resume it"));
    record("b", 3).with(|options| options.resume = true).record();
    assert!(files(&project.path("a")) == files(&project.path("b")), "not the same bytes");
    assert!(record("b", 3).try_record().expect("a recording").is_none(), "already complete");
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
    assert_eq!(check::folder(&root, check::CheckScope::Whole).expect("a dataset").problems, [""; 0]);
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
    let checked = check::folder(&a, check::CheckScope::Whole).expect("a dataset");
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

#[test]
fn datasets_are_checked_and_reproduced() {
    let project = project();
    let recording = Recording::new(project.run("x.lua"), 2, "a");
    let recording = recording.with(|options| {
        (options.has_images, options.has_privileged) = (false, false);
        options.gripper = Some(GripCode::TwoWidth);
    });
    recording.record();
    let a = project.path("a");
    assert_eq!(DatasetCard::read(&a).expect("a card").gripper, Some(GripCode::TwoWidth));
    let checked = check::folder(&a, check::CheckScope::Whole).expect("a dataset");
    assert_eq!((checked.demos, checked.videos, checked.problems), (2, 8, Vec::new()));
    let demos = demos_of(&a).expect("demonstrations");
    assert_eq!(demos.len(), 2);
    assert!(is_reproduced(&a));
    let find = |path: &Path, word: &str| word.parse::<EpisodeSelector>().expect("valid").find_demo(path);
    let hdf5 = project.path("a/hdf5/one_task0_demo.hdf5");
    assert_eq!(find(&a, "0/1").expect("there"), demos[1]);
    assert_eq!(find(&hdf5, "0").expect("there"), demos[0]);
    assert!(project.message(find(&a, "0/2").map(|_| ())).contains("no such demonstration"));
    let columns = stats::column_statistics(&[&hdf5]).expect("numbers");
    assert!(stats::table(&columns).contains("length (steps)") && stats::svg(&columns).starts_with("<svg"));
    let stray = project.path("a/hdf5/copy.hdf5");
    fs::copy(&hdf5, &stray).expect("copied");
    let problems = check::folder(&a, check::CheckScope::Whole).expect("a dataset").problems;
    assert!(
        matches!(&problems[..], [one] if one.contains("copy.hdf5") && one.contains("remove it")),
        "{problems:?}"
    );
    fs::remove_file(stray).expect("removed");
    let manifest = project.text("a/manifest.jsonl");
    project
        .write("a/manifest.jsonl", manifest.replacen("\"language\":\"", "\"language\":\"now ", 1).as_bytes());
    let problems = check::folder(&a, check::CheckScope::Whole).expect("a dataset").problems;
    assert!(
        matches!(&problems[..], [one] if one.contains("/data/demo_0, attribute metadata_json: language is ")
            && one.contains("the manifest says \"now ")),
        "{problems:?}"
    );
    project
        .write("a/manifest.jsonl", manifest.replacen("\"success\":true", "\"success\":false", 1).as_bytes());
    let problems = check::folder(&a, check::CheckScope::Whole).expect("a dataset").problems;
    assert!(
        matches!(&problems[..], [one] if one.contains("attribute metadata_json: success is true, the manifest says false")),
        "{problems:?}"
    );
    project.write("a/manifest.jsonl", manifest.as_bytes());
    project.write("a/videos/one_task0/demo_0_eye_in_hand_rgb.mp4", b"not a video");
    let whole = fs::read(&hdf5).expect("read");
    fs::write(&hdf5, &whole[..whole.len() / 2]).expect("written");
    let problems = check::folder(&a, check::CheckScope::Whole).expect("a dataset").problems;
    assert_eq!(problems.len(), 2, "{problems:?}");
    for words in ["demo_0_eye_in_hand_rgb.mp4: eye_in_hand_rgb: not an MP4 file", "one_task0_demo.hdf5"] {
        assert!(problems.iter().any(|problem| problem.contains(words)), "{problems:?}");
    }
}

#[test]
fn folders_with_other_files_are_refused() {
    let project = project();
    project.write("mine/meta/info.json", b"{}");
    let resumed = |script: &str, out: &str| {
        Recording::new(project.run(script), 1, out).with(|options| options.resume = true).refusal()
    };
    assert_contains(resumed("x.lua", "mine"), "out mine: the folder contains meta but no softvt recording");
    assert_eq!(files(&project.path("mine")).len(), 1);
    project.write("other/recording.json", b"{\"softvt\":\"0.0.1\"}");
    assert_contains(
        resumed("x.lua", "other"),
        "the folder contains another recording (demos: null before, 1 now)",
    );
    project.write("wrong.lua", b"return nil + 1");
    assert!(resumed("wrong.lua", "new").contains("wrong.lua:1"));
    let stuck = MISPLACED_CUBE.replace("arm:wait(1)", "arm:wait(0.1) error 'lost'");
    project.write("stuck.lua", stuck.as_bytes());
    assert!(resumed("stuck.lua", "new").contains("lost"));
    assert!(!project.path("new").exists(), "nothing is left of a mistake");
}

#[test]
fn the_teacher_of_a_suite_demonstrates_unless_a_policy_is_given() {
    let taught = MISPLACED_CUBE.replace("episodes = 1,", "episodes = 1, teacher = \"tactile-servo\",");
    let project = Project::new(&[("x.lua", &taught), SOLIDS]);
    let record = |out: &str| Recording::new(project.run("x.lua").threads(1), 1, out);
    for (given, policy) in [(None, "tactile-servo"), (Some(Teacher::Expert.into()), "expert")] {
        Recording { policy: given, ..record(policy) }.record();
        let attempts = project.stored(&format!("{policy}/attempts")).expect("a run");
        assert_eq!(attempts[0].manifest.policy, policy);
    }
    // An evaluation is not taught.
    assert_eq!(project.run("x.lua").record().header.policy, "expert");
    project.write("x.lua", taught.replace("tactile-servo", "noop").as_bytes());
    assert_contains(
        record("none").refusal(),
        "suite.teacher: expected one of \"expert\", \"tactile-servo\", got \"noop\"",
    );
}
