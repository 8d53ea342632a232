//! Equal runs give byte-identical results.

use softvt::runner::{EpisodeFilter, RunConfig};

use crate::support::{Project, SPATIAL_SOFT, Small, assert_contains, spatial_soft, spatial_soft_run};

#[test]
fn episodes_and_grasps_are_byte_identical_for_any_threads() {
    for policy in ["expert", "random"] {
        let (two, _) = spatial_soft(policy);
        let one = Project::new(&[]);
        spatial_soft_run(&one, policy).threads(1).out(policy).finish();
        for file in ["episodes.jsonl", "summary.json", "trace/task_000/episode_00000.jsonl"] {
            let file = format!("{policy}/{file}");
            assert_eq!(one.text(&file), two.text(&file), "{file}");
        }
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

#[test]
fn selected_episodes_are_those_of_a_whole_run() {
    let project = Small::default().project();
    let whole = project.run("x.lua").episodes(4).records();
    let selected =
        |numbers: &[u32]| project.run("x.lua").with(|config| config.selected_episodes = numbers.to_vec());
    let records = selected(&[3, 1, 3]).out("some").records();
    assert_eq!(records, [whole[1].clone(), whole[3].clone()]);
    assert!(!project.stored("some").expect("a run")[0].is_partial());
    let other = selected(&[1]).out("some").resume().error();
    assert_contains(&other, "belongs to another run: episodes: 2 before, 1 now");
    let video = |config: &mut RunConfig| config.video = Some(EpisodeFilter::Episodes(vec![0]));
    assert_contains(
        selected(&[1]).out("other").with(video).error(),
        "runs only the episodes [1] of each task",
    );
}

#[test]
fn limits_in_run_json_do_not_depend_on_threads() {
    let scene = "softvt.layout(\"one\", function(scene)\n";
    let counted = "count = count + 1 local cube = softvt.asset { name = \"cube\" .. count, shape = shape, \
                   body = softvt.soft { youngs_pa = 2e4, poisson = 0.3, density = 300 } }\n";
    let text = Small { task: "budget_steps = 2", ..Small::default() }.text();
    let text = format!("local count = 0\n{}", text.replace(scene, &format!("{scene}{counted}")));
    let wait = "local function wait(prompt) return softvt.task { prompt = prompt, layout = layout, budget_steps = 2,\n\
                goal = softvt.on { object = \"cube\", target = \"post\" } } end\nreturn softvt.suite";
    let text = text
        .replace("return softvt.suite", wait)
        .replace("tasks = {\n", "tasks = { wait 'a', wait 'b', wait 'c',\n");
    let project = Project::new(&[("x.lua", &text)]);
    for threads in [1, 2] {
        let run = project.run("x.lua").episodes(3).policy("noop").threads(threads);
        let records = run.out(&threads.to_string()).finish().records();
        assert!(records.iter().all(|record| record.header.asset == "cube1"), "{records:#?}");
        // The episodes of a task are scanned in one interpreter, in their order.
        let limits = &project.json(&format!("{threads}/run.json"))["thresholds"];
        let expected = serde_json::json!({ "cube1": null, "cube2": null, "cube3": null });
        assert_eq!(*limits, expected, "{threads} threads");
    }
}
