//! Equal commands give byte-identical results.

use crate::support::{Project, SPATIAL_SOFT};

#[test]
fn episodes_are_byte_identical_for_any_threads() {
    let project = Project::new(&[]);
    for (out, threads) in [("one", 1), ("two", 2), ("again", 2)] {
        project.succeeds(&format!(
            "{SPATIAL_SOFT} --task 0,1 --episodes 2 --policy random --threads {threads} --out {out}"
        ));
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
        project.succeeds(&format!(
            "{SPATIAL_SOFT} --task 2,5 --episodes 1 --threads {threads} --out {threads} --trace"
        ));
    }
    for file in ["episodes.jsonl", "trace/task_002/episode_00000.jsonl", "trace/task_005/episode_00000.jsonl"]
    {
        assert_eq!(project.text(&format!("1/{file}")), project.text(&format!("2/{file}")), "{file}");
    }
}

#[test]
fn another_seed_gives_other_episodes() {
    let project = Project::new(&[]);
    for seed in [0, 1] {
        project.succeeds(&format!(
            "{SPATIAL_SOFT} --task 4 --episodes 1 --policy noop --seed {seed} --out {seed}"
        ));
    }
    let hash = |out: &str| project.lines(&format!("{out}/episodes.jsonl"))[0]["state_hash"].clone();
    assert_ne!(hash("0"), hash("1"));
}
