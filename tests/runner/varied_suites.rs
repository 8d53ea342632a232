//! Suites whose objects vary from episode to episode: records, names, reproducibility, and what is refused.

use softvt::{
    runner::TraceDetail, runs::record::EpisodeRecord, scene::ObjectVariation, script::STANDARD_VARIATION,
};

use crate::support::{Project, Small};

fn project() -> Project {
    Small::default().project()
}

/// Numbers drawn for the cube.
fn drawn(episode: &EpisodeRecord) -> &ObjectVariation {
    &episode.header.variation.as_ref().expect("it varies").objects["cube"]
}

#[test]
fn records_have_the_drawn_numbers_and_the_suite_a_name_of_its_own() {
    let project = project();
    let [episodes, _] = [("one", 1), ("two", 2)].map(|(out, threads)| {
        project.run("x.lua").vary(STANDARD_VARIATION).episodes(3).threads(threads).out(out).records()
    });
    assert_eq!(project.text("one/episodes.jsonl"), project.text("two/episodes.jsonl"));
    let scales: Vec<f64> = episodes.iter().map(|episode| drawn(episode).scale).collect();
    assert!(scales.iter().all(|scale| (0.88..=1.12).contains(scale)), "{scales:?}");
    assert!(scales[0] != scales[1] && scales[1] != scales[2], "{scales:?}");
    assert!(episodes.iter().all(|episode| episode.header.id.suite == "one_varied"));
    let manifest = project.json("one/run.json");
    assert_eq!(manifest["variation"]["size"]["max"], 1.12);
    assert_eq!(manifest["suite"], "one");
    assert!(project.is_reproduced("one", "0/1"));
}

#[test]
fn varied_suites_are_traced_and_twins_have_names_of_their_own() {
    let project = Small { task: "budget_steps = 3", ..Small::default() }.project();
    let run = || project.run("x.lua").policy("noop").trace(TraceDetail::State);
    assert!(run().vary(STANDARD_VARIATION).out("varied").record().header.variation.is_some());
    assert_eq!(project.lines("varied/trace/task_000/episode_00000.jsonl").len(), 3);
    let header = run().twin().out("twin").record().header;
    assert_eq!((header.id.suite.as_str(), header.soft), ("one_rigid_twin", false));
}

#[test]
fn a_suite_without_variation_has_no_drawn_numbers() {
    let project = project();
    assert_eq!(project.run("x.lua").out("run").record().header.variation, None);
    let text = project.text("run/episodes.jsonl");
    assert!(text.contains(r#""suite":"one""#) && !text.contains("variation"), "{text}");
    assert!(project.json("run/run.json")["variation"].is_null());
}

#[test]
fn a_variation_in_a_file_replaces_the_standard_one() {
    let project = project();
    let ranges = r#"return softvt.variation { name = "small", size = { 0.5, 0.5 }, stiffness = { 2, 2 }, density = { 1, 1 },
        friction = { 1, 1 }, colour = 0, light = { 1, 1 }, camera_offset = 0, camera_rotation = 0 }"#;
    project.write("small.lua", ranges.as_bytes());
    let episode = project.run("x.lua").vary("small.lua").record();
    assert_eq!((drawn(&episode).scale, drawn(&episode).youngs_factor), (0.5, 2.0));
}

#[test]
fn an_expert_reads_the_name_of_the_controller() {
    let expert = "local name = arm.grip_controller arm:note(\"length\", #name) arm:grasp(0.5)";
    let project = Small { expert, ..Small::default() }.project();
    let record = project.run("x.lua").policy("contact-depth").out("run").record();
    assert_eq!(record.stats.notes["length"], 13.0);
    let manifest = project.json("run/run.json");
    assert_eq!((&manifest["privileged"], &manifest["policy"]), (&true.into(), &"contact-depth".into()));
}
