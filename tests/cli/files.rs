//! What is listed and what is written.

use serde_json::Value;

use crate::support::{Project, SPATIAL_SOFT, Small};

fn has(value: &Value, keys: &[&str]) {
    for key in keys {
        assert!(value.get(key).is_some(), "{key} is missing in {value:#}");
    }
}

#[test]
fn what_there_is_is_listed_as_text_and_as_json_in_any_folder() {
    let project = Project::new(&[]);
    let json = |what: &str| -> Vec<Value> {
        serde_json::from_str(&project.succeeds(&format!("list {what} --json")).out).expect("JSON")
    };
    let suites = json("suites");
    assert!(suites.iter().any(|s| s["name"] == "spatial_soft" && s["tasks"] == 10 && s["episodes"] == 5));
    let tasks = json("tasks");
    let of_suite: Vec<_> = tasks.iter().filter(|t| t["suite"] == "spatial_soft").collect();
    assert_eq!(of_suite.len(), 10);
    assert!(of_suite[1]["prompt"].as_str().is_some_and(|p| p.starts_with("pick up the left white spiral")));
    assert!(json("assets").iter().filter(|a| a["name"] == "plate" || a["name"] == "sesame_bun").count() == 2);
    let policies: Vec<Value> = json("policies").iter().map(|p| p["name"].clone()).collect();
    assert_eq!(policies, ["expert", "expert-binary", "noop", "random"]);
    for what in ["suites", "tasks", "assets", "policies"] {
        assert_eq!(project.succeeds(&format!("list {what}")).out.lines().count(), json(what).len());
    }
    assert!(project.refusal("list robots").contains("[possible values: suites, tasks, assets, policies]"));
}

#[test]
fn init_writes_stubs_and_leaves_a_settings_file_of_ones_own_alone() {
    let project = Project::new(&[]);
    project.succeeds("init new/folder");
    assert!(project.text("new/folder/library/softvt.d.lua").starts_with("---@meta softvt"));
    assert!(project.json("new/folder/.luarc.json").is_object());
    project.write("new/folder/.luarc.json", b"{\"mine\":1}");
    project.write("new/folder/library/softvt.d.lua", b"old");
    let again = project.succeeds("init new/folder").out;
    assert!(again.contains("left new/folder/.luarc.json as it is"), "{again}");
    assert_eq!(project.text("new/folder/.luarc.json"), "{\"mine\":1}");
    assert!(project.text("new/folder/library/softvt.d.lua").starts_with("---@meta softvt"));
    project.write("file", b"");
    assert!(project.refusal("init file").starts_with("cannot make the folder file/library"));
}

#[test]
fn a_run_writes_all_that_is_needed_to_repeat_and_to_read_it() {
    let project = Small { expert: "arm:wait(5)", ..Small::default() }.project();
    let said = project.succeeds("x.lua --out run --episodes 2 --seed 7 --json");
    let run = project.json("run/run.json");
    has(&run, &["softvt", "script", "suite", "policy", "split", "tasks", "shifts", "options", "settings"]);
    assert_eq!((&run["seed"], &run["episodes"], &run["privileged"]), (&7.into(), &2.into(), &true.into()));
    assert_eq!(run["sources"]["x.lua"].as_str().map(str::len), Some(64), "SHA-256 of the script");
    let episodes = project.lines("run/episodes.jsonl");
    assert_eq!(episodes.iter().map(|e| &e["episode"]).collect::<Vec<_>>(), [0, 1]);
    let fields = "suite task prompt layout episode seed split policy asset soft outcome goal no_drop no_slip d_peak tau \
                  deformation_ok safety steps time_s min_det_f newton_mean newton_max state_hash";
    has(&episodes[0], &fields.split_whitespace().collect::<Vec<_>>());
    assert_eq!((&episodes[0]["steps"], &episodes[0]["outcome"]["kind"]), (&40.into(), &"timeout".into()));
    let summary = project.json("run/summary.json");
    let printed: Value = serde_json::from_str(&said.out).expect("JSON and nothing else");
    assert_eq!(printed, summary);
    let fields = "suite policy episodes invalid goal_success_rate no_drop_rate deformation_ok_rate safety_success_rate \
                  goal_safe_gap deformation kappa by_task by_asset";
    has(&summary, &fields.split_whitespace().collect::<Vec<_>>());
    has(&summary["deformation"], &["mean", "p5", "median", "p95", "n"]);
    assert_eq!(summary["goal_success_rate"]["rate"], 0.0);
    assert_eq!(summary["goal_success_rate"]["wilson95"][0], 0.0);
    // Wilson's bound for 0 of 2: z²/(n + z²).
    let upper = summary["goal_success_rate"]["wilson95"][1].as_f64().expect("a number");
    let z2 = 1.959_963_984_540_054_f64.powi(2);
    assert!((upper - 100.0 * z2 / (2.0 + z2)).abs() < 1e-6, "{upper}");
}

#[test]
fn a_run_is_also_written_in_the_fields_of_softvtbench() {
    let project = Small::default().project();
    project.succeeds("x.lua --out run --policy noop");
    let csv = project.text("run/softvtbench/episodes.csv");
    let mut lines = csv.lines();
    assert!(
        lines.next().is_some_and(|head| head.starts_with("source,task,episode,asset,goal_success,d_peak"))
    );
    assert_eq!(lines.count(), 1);
    has(&project.json("run/softvtbench/thresholds.json"), &["schema_version", "metric_id", "thresholds"]);
    assert!(project.json("run/softvtbench/summary.json").is_object());
}

#[test]
fn a_trace_has_a_line_for_every_control_step_and_nodes_if_asked_for() {
    let project = Small::default().project();
    project.succeeds("x.lua --out plain");
    assert!(!project.path("plain/trace").exists());
    project.succeeds("x.lua --out state --trace");
    project.succeeds("x.lua --out nodes --trace=nodes");
    let state = project.lines("state/trace/task_000/episode_00000.jsonl");
    let nodes = project.lines("nodes/trace/task_000/episode_00000.jsonl");
    assert_eq!((state.len(), nodes.len()), (40, 40));
    let fields = "step time_s ee_position_b ee_axis_angle_b joints gripper_width_m closure pad_force_n \
                  friction_utilisation slip_mm dropped energy_j newton objects";
    has(&state[39], &fields.split_whitespace().collect::<Vec<_>>());
    has(&state[39]["objects"][0], &["name", "position_w", "quaternion_w", "d_pct", "min_det_f", "touches"]);
    assert!(state[39]["objects"][0].get("nodes").is_none());
    let count = nodes[0]["objects"][0]["nodes"].as_array().map(Vec::len);
    assert_eq!(count, Some(7 * 7 * 7), "a cube of six voxels an edge");
    assert_eq!(
        project.text("state/episodes.jsonl"),
        project.text("nodes/episodes.jsonl"),
        "watching changes nothing"
    );
}

#[test]
fn a_folder_that_cannot_be_written_or_holds_a_run_is_refused_and_left_alone() {
    let project = Small::default().project();
    project.write("file", b"mine");
    assert!(project.refusal("x.lua --out file").starts_with("cannot make the folder file: "));
    assert!(project.refusal("x.lua --out file/run").starts_with("cannot make the folder file/run: "));
    assert_eq!(project.text("file"), "mine");
    project.succeeds("x.lua --out run");
    let before = (project.text("run/run.json"), project.text("run/episodes.jsonl"));
    assert_eq!(
        project.refusal("x.lua --out run --policy noop"),
        "run already holds a run (run.json): give another folder with --out, or remove it"
    );
    assert_eq!((project.text("run/run.json"), project.text("run/episodes.jsonl")), before);
}

#[test]
fn without_out_runs_are_numbered() {
    let project = Small { task: "budget_steps = 1", ..Small::default() }.project();
    project.succeeds("x.lua --policy noop");
    project.succeeds("x.lua --policy noop");
    assert!(project.path("runs/one-noop-001/summary.json").exists());
    assert!(project.path("runs/one-noop-002/summary.json").exists());
}

#[test]
fn the_standard_suite_says_which_sources_and_thresholds_it_ran_with() {
    let project = Project::new(&[]);
    project.succeeds(&format!("{SPATIAL_SOFT} --policy noop --task 8 --episodes 1 --out run"));
    let run = project.json("run/run.json");
    has(
        &run["sources"],
        &["suites/spatial_soft.lua", "scripts/experts/pick_place.lua", "assets/sesame_bun.lua"],
    );
    assert!(run["thresholds"]["sesame_bun"].as_f64().is_some_and(|tau| tau > 0.0));
}
