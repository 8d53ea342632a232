//! `softvt report`, `compare`, `merge` and `replay`: what they print, write and refuse.

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

#[test]
fn comparisons_are_printed_as_a_table_and_as_json() {
    let project = project();
    let compared: Value =
        serde_json::from_str(&project.succeeds("compare runs/a runs/b --json").out).expect("JSON");
    assert_eq!((&compared["first"], &compared["second"]), (&json!("noop"), &json!("random")));
    assert_eq!(compared["all"]["goal"]["n"], 2);
    let text = project.succeeds("compare runs/a runs/b").out;
    assert!(text.starts_with("noop → random · 2 paired episodes\n"), "{text}");
    let message = project.refusal("compare runs/a runs/other");
    assert_eq!(message, "runs/a and runs/other share no episode: seed 0 in the first, 7 in the second");
}

#[test]
fn warnings_of_reports_are_printed_and_damaged_runs_refused() {
    let project = project();
    let lines = project.text("runs/a/episodes.jsonl");
    project.write("runs/a/episodes.jsonl", &lines.as_bytes()[..lines.len() - 40]);
    std::fs::remove_file(project.path("runs/a/summary.json")).expect("removed");
    let output = project.succeeds("report runs/a runs/b --out page");
    for warning in ["runs/a is not finished: it has 1 of 2 episodes", "runs/a/episodes.jsonl is truncated"] {
        assert!(output.err.contains(warning), "{}", output.err);
        assert!(project.text("page/report.html").contains(warning));
    }
    assert!(project.text("page/report.md").contains("| noop | 1 of 2 |"));
    project.write("runs/a/episodes.jsonl", lines.replace(r#""goal":false"#, r#""goal":true"#).as_bytes());
    let readers =
        ["report runs/a --out no", "compare runs/b runs/a", "merge no runs/a runs/b", "replay runs/a 0/0"];
    for reader in readers {
        let message = project.refusal(reader);
        let problem = "its SHA-256 is not the record_sha256 at its end";
        assert!(message.contains("runs/a/episodes.jsonl:1: ") && message.contains(problem), "{message}");
    }
    for (dir, words) in [("nowhere", "folder nowhere does not exist"), ("x.lua", "x.lua is a file")] {
        let message = project.refusal(&format!("report runs/b {dir} --out no"));
        assert!(message.starts_with(words), "{message}");
    }
    assert!(!project.path("no").exists());
}

#[test]
fn a_report_replaces_only_an_earlier_report() {
    let project = project();
    project.write("mine/report.md", b"my own words");
    assert_eq!(
        project.refusal("report runs/b --out mine"),
        "--out: mine/report.md exists and is not of an earlier report; give another folder"
    );
    assert_eq!(project.text("mine/report.md"), "my own words");
    for _ in 0..2 {
        project.succeeds("report runs/b --out page");
    }
}

#[test]
fn merged_shards_are_printed() {
    let project = Small { task: "budget_steps = 8", ..Small::default() }.project();
    for shard in 1..=2 {
        project.succeeds(&format!("x.lua --episodes 2 --shard {shard}/2 --out part_{shard}"));
    }
    let whole = project.succeeds("x.lua --episodes 2 --out whole").out;
    assert_eq!(project.succeeds("merge all part_1 part_2").out, whole);
    for file in ["run.json", "episodes.jsonl", "summary.json"] {
        assert_eq!(project.text(&format!("all/{file}")), project.text(&format!("whole/{file}")), "{file}");
    }
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
fn a_report_has_pictures_of_the_objects_of_runs_with_their_scripts() {
    let project = Small { task: "budget_steps = 4", ..Small::default() }.project();
    project.succeeds("x.lua --policy noop --out run");
    let pictures = |out: &str| {
        project.succeeds(&format!("report run --out {out}"));
        project.text(&format!("{out}/report.html")).matches("<img src=\"data:image/jpeg;base64,").count()
    };
    assert_eq!(pictures("with"), 1, "of the cube");
    assert!(
        project.text("with/report.html") == {
            pictures("again");
            project.text("again/report.html")
        }
    );
    std::fs::remove_file(project.path("run/scripts.zip")).expect("removed");
    assert_eq!(pictures("without"), 0);
}

#[test]
fn a_run_with_a_seed_file_is_repeated_with_it_alone() {
    let project = Small { task: "budget_steps = 3", ..Small::default() }.project();
    project.write("secret", b"correct horse battery staple");
    project.succeeds("x.lua --policy noop --seed-file secret --out run");
    let hash = project.json("run/run.json")["seed_hash"].as_str().expect("a hash").to_owned();
    assert!(project.succeeds("replay run 0/0 --seed-file secret").out.contains("byte-identical"));
    assert!(project.refusal("replay run 0/0").contains("give the file with that seed"));
    project.succeeds("report run --out page");
    assert!(project.text("page/report.html").contains(&format!("secret, SHA-256 {hash}")));
}
