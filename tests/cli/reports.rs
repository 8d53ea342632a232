//! Comparisons, pages and tables of finished runs, and runs that cannot be read.

use std::fs;

use serde_json::{Value, json};

use crate::support::{Project, Small};

/// Two short runs of the same two episodes, and one of another seed.
fn project() -> Project {
    let project = Small { task: "budget_steps = 8", ..Small::default() }.project();
    for (policy, out) in [("noop", "a"), ("random", "b"), ("noop --seed 7", "other")] {
        project.succeeds(&format!("x.lua --episodes 2 --policy {policy} --out runs/{out}"));
    }
    project
}

/// Changes a JSON file of a project.
fn edit(project: &Project, path: &str, change: impl Fn(&mut Value)) {
    let mut document = project.json(path);
    change(&mut document);
    project.write(path, document.to_string().as_bytes());
}

#[test]
fn runs_are_paired_by_episode_and_task() {
    let project = project();
    let compared: Value =
        serde_json::from_str(&project.succeeds("compare runs/a runs/b --json").out).expect("JSON");
    assert_eq!((&compared["first"], &compared["second"]), (&json!("noop"), &json!("random")));
    let goal = &compared["all"]["goal"];
    assert_eq!(
        (&goal["n"], &goal["better"], &goal["worse"], &goal["same"]),
        (&2.into(), &0.into(), &0.into(), &2.into())
    );
    assert_eq!(goal["difference"], 0.0);
    assert_eq!(goal["interval95"].as_array().map(Vec::len), Some(2));
    assert_eq!(compared["by_task"][0]["no_drop"]["n"], 2);
    // The cube has no limit, so that its safety was never judged.
    assert_eq!((&compared["all"]["safety"]["n"], &compared["all"]["dsr"]["n"]), (&json!(0), &json!(0)));
    let text = project.succeeds("compare runs/a runs/b").out;
    assert!(text.starts_with("noop → random · 2 paired episodes\n"), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 100), "{text}");
    assert!(text.contains("95 % interval") && text.contains("better"), "{text}");
    // The expert is privileged, and every table marks it.
    project.succeeds("x.lua --episodes 2 --out runs/c");
    assert!(project.succeeds("compare runs/a runs/c").out.contains("noop → expert (privileged) · "));
    let output = project.succeeds("x.lua --episodes 2 --out runs/c");
    assert!(output.out.contains("policy expert (privileged) · 2 episodes"), "{}", output.out);
    assert_eq!(project.json("runs/c/summary.json")["privileged"], true);
}

#[test]
fn harm_and_stages_are_compared() {
    let project = project();
    let row = |text: &str, name: &str| -> Vec<String> {
        let line = text.lines().find(|line| line.starts_with(name)).unwrap_or_default();
        line[name.len().min(line.len())..].split_whitespace().map(str::to_owned).collect()
    };
    let text = project.succeeds("compare runs/a runs/b").out;
    // Neither policy touches anything within its 8 steps.
    assert_eq!(row(&text, "touched other objects")[..4], ["%", "0.0", "0.0", "+0.0"], "{text}");
    assert_eq!(row(&text, "failed at any stage"), ["episodes", "2", "2", "+0", "0", "0"], "{text}");
    assert_eq!(row(&text, "  reach"), ["episodes", "2", "2", "+0"], "{text}");
    assert_eq!(row(&text, "D mean")[0], "%", "{text}");
    let json = |path: &str| -> Value {
        serde_json::from_str(&project.succeeds(&format!("compare runs/a {path} --json")).out).expect("JSON")
    };
    let all = &json("runs/b")["all"];
    assert_eq!(
        (&all["d_mean"]["n"], &all["d_final"]["n"], &all["d_p95"]["n"]),
        (&json!(2), &json!(2), &json!(2))
    );
    assert_eq!(all["failed_stages"]["first"], json!({ "reach": 2 }));
    assert_eq!(all["invalid_pairs"], 0);
    assert_eq!(all["goal"]["n"], 2);
}

#[test]
fn two_runs_of_one_suite_are_not_compared() {
    let project = project();
    let message = project.refusal("compare runs runs/a");
    assert_eq!(
        message,
        "runs/a and runs/b both hold suite one task 0 episode 0: compare one run per suite; give its folder"
    );
    assert!(project.refusal("compare runs/a runs").contains("runs/a and runs/b both hold"));
}

#[test]
fn runs_of_different_seeds_share_no_episode() {
    let message = project().refusal("compare runs/a runs/other");
    assert_eq!(message, "runs/a and runs/other share no episode: seed 0 in the first, 7 in the second");
}

#[test]
fn folders_without_a_run_are_named() {
    let project = project();
    fs::create_dir(project.path("empty")).expect("made");
    let torn = project.text("runs/a/episodes.jsonl");
    for (dir, path, text) in [
        ("json", "run.json", "{\"softvt\": ".to_owned()),
        ("fields", "run.json", json!({ "softvt": env!("CARGO_PKG_VERSION"), "script": "x.lua" }).to_string()),
        ("line", "episodes.jsonl", format!("{}\n{torn}", &torn[..50])),
        ("none", "episodes.jsonl", String::new()),
    ] {
        for name in ["run.json", "episodes.jsonl"] {
            project.write(&format!("bad/{dir}/{name}"), project.text(&format!("runs/a/{name}")).as_bytes());
        }
        project.write(&format!("bad/{dir}/{path}"), text.as_bytes());
    }
    fs::remove_file(project.path("bad/none/episodes.jsonl")).expect("removed");
    for (dir, words) in [
        ("nowhere", "folder nowhere does not exist"),
        ("x.lua", "x.lua is a file; give the folder of a run"),
        (
            "empty",
            "empty holds no run: neither the folder nor any of its subfolders has run.json and episodes.jsonl",
        ),
        ("bad/json", "bad/json/run.json is not a valid run file: EOF while parsing"),
        ("bad/fields", "bad/fields/run.json is not a valid run file: it has no suite"),
        ("bad/line", "bad/line/episodes.jsonl:1: not an episode record"),
        ("bad/none", "cannot read bad/none/episodes.jsonl"),
    ] {
        for command in [format!("compare {dir} runs/a"), format!("report runs/a {dir} --out page")] {
            let message = project.refusal(&command);
            assert!(message.starts_with(words), "{command}: {message}");
            assert!(!message.contains("this is softvt"), "no other version: {message}");
            assert!(!project.path("page").exists(), "{command}");
        }
    }
}

#[test]
fn runs_of_other_versions_are_reported() {
    let project = project();
    edit(&project, "runs/a/run.json", |run| run["softvt"] = json!("0.0.1"));
    let output = project.succeeds("report runs/a --out page");
    assert!(output.err.contains("runs/a was written by softvt 0.0.1, and this is softvt"), "{}", output.err);
    assert!(project.text("page/report.html").contains("runs/a was written by softvt 0.0.1"));
    assert!(
        project.succeeds("compare runs/a runs/b").out.contains("the runs also differ in softvt (run.json)")
    );
    let lines = project.text("runs/a/episodes.jsonl").replace("\"no_drop\"", "\"drops\"");
    project.write("runs/a/episodes.jsonl", lines.as_bytes());
    let message = project.refusal("report runs/a --out page");
    assert!(
        message.starts_with("runs/a/episodes.jsonl:1: not an episode record: missing field"),
        "{message}"
    );
    let cause =
        format!("; this run was written by softvt 0.0.1, and this is softvt {}: ", env!("CARGO_PKG_VERSION"));
    assert!(message.contains(&cause), "{message}");
}

#[test]
fn unfinished_runs_can_be_reported() {
    let project = project();
    let lines = project.text("runs/a/episodes.jsonl");
    // The second line is incomplete, as after a crash; there is no summary yet.
    let whole = lines.find('\n').expect("a line") + 1;
    project.write("runs/a/episodes.jsonl", &lines.as_bytes()[..whole + 40]);
    fs::remove_file(project.path("runs/a/summary.json")).expect("removed");
    let warning = "runs/a is not finished: it has 1 of 2 episodes";
    let output = project.succeeds("report runs/a runs/b --out page");
    assert!(output.err.contains(warning), "{}", output.err);
    let torn = "the last line of runs/a/episodes.jsonl is truncated";
    assert!(output.err.contains(torn) && project.text("page/report.html").contains(torn), "{}", output.err);
    assert!(project.text("page/report.md").contains("| noop | 1 of 2 |"));
    let output = project.succeeds("compare runs/a runs/b");
    assert!(output.out.contains("1 paired episode") && output.out.contains(warning), "{}", output.out);
    assert!(output.out.contains("1 episode present in only one run was skipped"), "{}", output.out);
    project.write("runs/a/episodes.jsonl", b"");
    assert_eq!(project.refusal("compare runs/a runs/b"), "runs/a has no episode yet");
    project.succeeds("report runs/a --out page");
}

#[test]
fn commands_in_the_report_are_valid() {
    let project = project();
    project.succeeds("report runs --out page");
    let page = project.text("page/report.html");
    for file in ["report.md", "report.tex"] {
        assert!(project.text(&format!("page/{file}")).contains("noop"), "{file}");
    }
    let commands: Vec<&str> =
        page.split("<code>softvt ").skip(1).filter_map(|part| part.split("</code>").next()).collect();
    let of = |start: &str, part: &str| -> String {
        let fits = |command: &&&str| command.starts_with(start) && command.contains(part);
        (*commands.iter().find(fits).unwrap_or_else(|| panic!("{start} {part} in {commands:?}"))).to_owned()
    };
    assert!(project.succeeds(&of("replay", "runs/other 0/1")).out.contains("byte-identical"));
    let view = of("view", "--seed 7");
    assert_eq!(view, "view x.lua --task 0 --policy noop --seed 7 --out seen");
    project.succeeds(&view);
    assert!(project.path("seen/episode.mp4").exists());
}

#[test]
fn lost_files_are_restored_byte_identically() {
    let project = Small { task: "budget_steps = 8", expert: "arm:close_to(1)", ..Small::default() }.project();
    let line = "x.lua --episodes 3 --trace --out run";
    project.succeeds(line);
    let files = [
        "actions/task_000/episode_00000.npy",
        "softvtbench/task_000/episode_00001/policy_action_debug.jsonl",
        "trace/task_000/episode_00002.jsonl",
        "softvtbench/episodes.csv",
        "softvtbench/thresholds.json",
        "summary.json",
        "episodes.jsonl",
    ];
    let bytes = |file: &str| fs::read(project.path(&format!("run/{file}"))).unwrap_or_default();
    let before = files.map(bytes);
    files[..5]
        .iter()
        .for_each(|file| fs::remove_file(project.path(&format!("run/{file}"))).expect("removed"));
    let output = project.succeeds(line);
    let expected = "restoring files of 3 finished episodes (first: run/actions/task_000/episode_00000.npy)";
    assert!(output.err.contains(expected), "{}", output.err);
    assert!(files.map(bytes) == before);
    assert!(project.succeeds(line).err.contains("already complete"));
    // Without its summary the folder is unfinished and can be resumed.
    fs::remove_file(project.path("run/summary.json")).expect("removed");
    project.succeeds(&format!("{line} --resume"));
    assert!(files.map(bytes) == before);
    // Videos can be added later.
    project.succeeds(&format!("{line} --video=1"));
    let drawn =
        |e: u32, kind: &str| project.path(&format!("run/video/task_000/episode_0000{e}.{kind}")).exists();
    assert!(drawn(1, "mp4") && drawn(1, "png") && !drawn(0, "mp4"));
    assert!(files.map(bytes) == before);
    // A simulation that differs from its record is reported, and its files are not restored.
    let lines = project.text("run/episodes.jsonl").replacen("\"state_hash\":\"", "\"state_hash\":\"f", 1);
    project.write("run/episodes.jsonl", lines.as_bytes());
    fs::remove_file(project.path("run/actions/task_000/episode_00000.npy")).expect("removed");
    let output = project.succeeds(line);
    assert!(output.err.contains("the simulation differs from its record (state_hash:"), "{}", output.err);
    assert!(!project.path("run/actions/task_000/episode_00000.npy").exists());
    assert_eq!(project.text("run/episodes.jsonl"), lines);
}

#[test]
fn records_that_contradict_themselves_are_refused_by_name() {
    let project = Small { task: "budget_steps = 8", ..Small::default() }.project();
    let run = |shard: u32| format!("x.lua --episodes 2 --out part_{shard} --shard {shard}/2");
    (1..=2).for_each(|shard| drop(project.succeeds(&run(shard))));
    let (lines, manifest) = (project.text("part_1/episodes.jsonl"), project.text("part_1/run.json"));
    let readers = [
        "report part_1 --out page".to_owned(),
        "compare part_2 part_1".to_owned(),
        "merge all part_1 part_2".to_owned(),
        "replay part_1 0/0".to_owned(),
        format!("{} --resume", run(1)),
    ];
    for (from, to, problem) in [
        (r#""goal":false"#, r#""goal":true"#, "goal is true, and the outcome is not completed"),
        (r#""newton_mean":"#, r#""newton_mean":-"#, "newton_mean is -"),
        (r#""d_peak_other":"#, r#""d_peak_gther":"#, "unknown key d_peak_gther"),
    ] {
        let changed = lines.replacen(from, to, 1);
        assert_ne!(changed, lines);
        project.write("part_1/episodes.jsonl", changed.as_bytes());
        for reader in &readers {
            let refused = project.refusal(reader);
            assert!(refused.contains("part_1/episodes.jsonl:1: ") && refused.contains(problem), "{refused}");
        }
    }
    project.write("part_1/episodes.jsonl", lines.as_bytes());
    project.write("part_1/run.json", manifest.replace(r#""1/2""#, r#""99/2""#).as_bytes());
    let refused = project.refusal("merge all part_1 part_2");
    assert!(refused.contains("part_1/run.json") && refused.contains(r#"its shard is "99/2""#), "{refused}");
    // A merge that fails while it writes leaves nothing.
    project.write("part_1/run.json", manifest.as_bytes());
    project.write("part_1/softvtbench/thresholds.json", b"{");
    project.refusal("merge all part_1 part_2");
    assert!(!project.path("all.part").exists() && !project.path("all").exists());
}

#[test]
fn merged_shards_are_byte_identical_to_one_run() {
    let project = Small { task: "budget_steps = 8", ..Small::default() }.project();
    for (twin, name) in [("", "soft"), ("--twin rigid", "rigid")] {
        let line = format!("x.lua --episodes 3 {twin} --out {name}");
        project.succeeds(&line);
        (1..=2).for_each(|i| drop(project.succeeds(&format!("{line}_{i} --shard {i}/2"))));
        project.succeeds(&format!("merge {name}_all {name}_1 {name}_2"));
        for file in ["run.json", "episodes.jsonl", "summary.json", "softvtbench/summary.json"] {
            let [merged, whole] = ["_all", ""].map(|end| project.text(&format!("{name}{end}/{file}")));
            assert_eq!(merged, whole, "{name} {file}");
        }
        let summary = project.json(&format!("{name}_all/summary.json"));
        assert_eq!((&summary["episodes"], &summary["privileged"]), (&3.into(), &true.into()));
    }
}

#[test]
fn damaged_actions_are_found_by_merge_and_restored_by_resume() {
    let project = Small { task: "budget_steps = 8", expert: "arm:close_to(1)", ..Small::default() }.project();
    let line = |shard: u32| format!("x.lua --episodes 2 --out part_{shard} --shard {shard}/2");
    (1..=2).for_each(|shard| drop(project.succeeds(&line(shard))));
    let path = "part_1/actions/task_000/episode_00000.npy";
    let whole = fs::read(project.path(path)).expect("written");
    let mut changed = whole.clone();
    let last = changed.len() - 1;
    changed[last] ^= 1;
    for (bytes, problem) in
        [(&changed[..], "its SHA-256 differs"), (&whole[..whole.len() - 56], "do not fill the shape")]
    {
        project.write(path, bytes);
        let refused = project.refusal("merge all part_1 part_2");
        assert!(refused.starts_with(path) && refused.contains(problem), "{refused}");
        let resumed = project.succeeds(&format!("{} --resume", line(1)));
        assert!(resumed.err.contains(path) && resumed.err.contains(problem), "{}", resumed.err);
        assert!(fs::read(project.path(path)).expect("restored") == whole);
    }
    fs::remove_file(project.path(path)).expect("removed");
    assert!(project.refusal("merge all part_1 part_2").contains(path));
    let lines = project.text("part_2/episodes.jsonl");
    project.write("part_2/episodes.jsonl", lines.repeat(2).as_bytes());
    assert!(
        project
            .refusal("report part_2 --out page")
            .starts_with("part_2/episodes.jsonl:2: task 0 episode 1 occurs twice")
    );
}
