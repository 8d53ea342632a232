//! Equal runs give byte-identical results.

use softvt::runner::TraceDetail;

use crate::support::{Project, SPATIAL_SOFT};

#[test]
fn episodes_are_byte_identical_for_any_threads() {
    let project = Project::new(&[]);
    for (out, threads) in [("one", 1), ("two", 2), ("again", 2)] {
        let run = project.run(SPATIAL_SOFT).tasks(&[0, 1]).episodes(2).policy("random");
        run.threads(threads).out(out).finish();
    }
    let one = project.text("one/episodes.jsonl");
    assert_eq!(one.lines().count(), 4);
    assert_eq!(one, project.text("two/episodes.jsonl"));
    assert_eq!(one, project.text("again/episodes.jsonl"));
    assert_eq!(project.text("one/summary.json"), project.text("two/summary.json"));
}

#[test]
fn grasps_are_byte_identical_for_any_threads() {
    let project = Project::new(&[]);
    for threads in [1, 2] {
        let run = project.run(SPATIAL_SOFT).tasks(&[2, 5]).episodes(1).trace(TraceDetail::State);
        run.threads(threads).out(&threads.to_string()).finish();
    }
    for file in ["episodes.jsonl", "trace/task_002/episode_00000.jsonl", "trace/task_005/episode_00000.jsonl"]
    {
        assert_eq!(project.text(&format!("1/{file}")), project.text(&format!("2/{file}")), "{file}");
    }
}

#[test]
fn another_seed_gives_other_episodes() {
    let project = Project::new(&[]);
    let hash = |seed: u64| {
        let run = project.run(SPATIAL_SOFT).tasks(&[4]).episodes(1).policy("noop");
        run.seed(seed).record().stats.state_hash
    };
    assert_ne!(hash(0), hash(1));
}
