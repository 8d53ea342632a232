//! The published tables of results and rates are those of the committed files.

#[path = "../examples/results/collected.rs"]
mod collected;
#[path = "../examples/results/rows.rs"]
mod rows;
#[path = "../examples/results/tables.rs"]
mod tables;

use std::{fs, path::Path};

use rows::{Rate, Row};
use serde_json::{Value, json};

/// Root of the repository.
const ROOT: &str = env!("CARGO_MANIFEST_DIR");

#[test]
fn the_published_tables_are_those_of_the_rows() {
    let root = Path::new(ROOT);
    let (table, labels) = (rows::read(root).expect("rows"), rows::labels(root).expect("labels"));
    let physics = collected::physics(root).expect("a golden state");
    let readme = fs::read_to_string(root.join("README.md")).expect("a README");
    let rates = collected::rates(root).expect("rates");
    let expected = tables::written(&readme, &table, &labels, &rates).expect("a place for the tables");
    assert_eq!(readme, expected, "run .ci/regenerate results");
    let page = fs::read_to_string(root.join(tables::PAGE)).expect("a page");
    assert_eq!(page, tables::page(&table, &labels, &physics), "run .ci/regenerate results");
}

#[test]
fn the_first_screen_shows_the_best_constant_number() {
    let row = |name: &str, safety: f64| {
        let rate = |rate: f64| Rate { rate: Some(rate), wilson95: Some([rate, rate]) };
        Row {
            script: "suites/hidden.lua".to_owned(),
            suite: "object_hidden".to_owned(),
            controller: name.to_owned(),
            tasks: 1,
            episodes: 1,
            invalid: 0,
            goal: rate(90.0),
            no_drop: rate(90.0),
            safety: rate(safety),
            d_over_tau: Some(1.0),
            grip_ratio: None,
            goal_time_s: None,
            softvt: String::new(),
            seed: 0,
            physics: String::new(),
        }
    };
    let rows = [row("expert", 99.0), row("look-retry", 60.0), row("drives", 30.0), row("one-force", 40.0)];
    let table = tables::first_screen(&rows, &[("expert".to_owned(), "knows the object".to_owned())].into());
    assert_eq!(
        table,
        "|  | Object-Hidden: Goal % | Safety % |\n|---|---:|---:|\n\
         | `expert`: knows the object | 90.0 | 99.0\u{a0}[99.0,\u{a0}99.0] |\n| `tactile-servo` | – | – |\n\
         | `look-retry` | 90.0 | 60.0\u{a0}[60.0,\u{a0}60.0] |\n| `weigh` | – | – |\n\
         | [best constant number](docs/touch.md): `one-force` | 90.0 | 40.0\u{a0}[40.0,\u{a0}40.0] |\n| `expert-binary` | – | – |\n",
        "look-retry finds its grip by trial, so it keeps no number constant"
    );
}

/// Writes a run of `suite` with two episodes, of which one is safe.
fn write_run(folder: &Path, script: &str, suite: &str, policy: &str) {
    fs::create_dir_all(folder).expect("a folder");
    let mut manifest: Value = serde_json::from_str(include_str!("data/run.json")).expect("a manifest");
    (manifest["script"], manifest["suite"], manifest["policy"]) =
        (script.into(), suite.into(), policy.into());
    let record = |(episode, d, time, grip): (u32, f64, f64, f64)| {
        let mut record: Value =
            serde_json::from_str(include_str!("data/episode_record.json")).expect("a record");
        (record["suite"], record["episode"], record["safety"]) =
            (suite.into(), episode.into(), (d < 0.2).into());
        (record["d_peak"], record["tau"]) = (d.into(), 0.2.into());
        (record["goal_time_s"], record["grip_ratio"]) = (time.into(), grip.into());
        format!("{record}\n")
    };
    let episodes = [(0, 0.1, 4.0, 1.5), (1, 0.4, 6.0, 2.5)].map(record).concat();
    for (name, text) in
        [("run.json", manifest.to_string()), ("summary.json", "{}".to_owned()), ("episodes.jsonl", episodes)]
    {
        fs::write(folder.join(name), text).expect("a file");
    }
}

#[test]
fn rows_follow_the_runs_and_replace_earlier_ones() {
    let home = tempfile::tempdir().expect("a folder");
    let root = home.path();
    fs::create_dir_all(root.join("assets")).expect("a folder");
    fs::write(root.join("assets/golden.json"), json!({ "state_hash": "abc" }).to_string()).expect("a file");
    let out = root.join("controllers");
    let suites = ["one_varied", "two"].map(|suite| {
        let rows = [("reference", None), ("size-seen", Some("size-seen"))].map(|(condition, policy)| {
            let folder = format!("{suite}/{condition}");
            write_run(&out.join(&folder), "suites/controllers.lua", suite, policy.unwrap_or("expert"));
            json!({ "condition": condition, "policy": policy, "outcome": { "folder": folder } })
        });
        json!({ "suite": suite, "rows": rows })
    });
    fs::write(out.join("conditions.json"), json!({ "suites": suites }).to_string()).expect("a file");
    collected::add(root, &out).expect("runs of conditions");
    for policy in ["expert", "binary"] {
        write_run(&root.join(policy).join("one"), "suites/all.lua", "one", policy);
        collected::add(root, &root.join(policy)).expect("runs of a list of suites");
    }
    collected::add(root, &out).expect("runs of conditions");
    let table = rows::read(root).expect("rows");
    let names: Vec<_> = table.iter().map(|row| (row.suite.as_str(), row.controller.as_str())).collect();
    let expected = ["expert", "size-seen"].map(|name| [("one_varied", name), ("two", name)]);
    let [[a, b], [c, d]] = expected;
    assert_eq!(names, [a, c, b, d, ("one", "expert"), ("one", "binary")]);
    // Medians of D/τ 0.5 and 2, of grip ratios 1.5 and 2.5, and of times 4 and 6 s.
    let page = tables::page(&table, &[("size-seen".to_owned(), "sees the size".to_owned())].into(), "abcd");
    let cells = "| 2 | 0 | 100.0\u{a0}[34.2,\u{a0}100.0] | 100.0\u{a0}[34.2,\u{a0}100.0] | 50.0\u{a0}[9.5,\u{a0}90.5] | 1.25 | 2.00 | 5.0 | `abc` |";
    assert!(page.contains(&format!("| `size-seen`: sees the size {cells}")), "{page}");
    assert!(page.contains("## `softvt suites/controllers.lua --episodes 2`\n\n### One-Varied\n"), "{page}");
    assert!(page.contains("## `softvt suites/all.lua --episodes 2 --policy NAME`\n"), "{page}");
    let error = collected::add(root, &root.join("docs")).expect_err("no run");
    assert!(error.contains("no finished run"), "{error}");
}
