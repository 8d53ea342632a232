//! The published tables of results and rates are those of the committed files.

#[path = "../examples/results/collected.rs"]
mod collected;
#[path = "../examples/results/tables.rs"]
mod tables;

use std::{fs, path::Path};

use serde_json::json;

/// Root of the repository.
const ROOT: &str = env!("CARGO_MANIFEST_DIR");

#[test]
fn the_published_tables_are_those_of_the_summaries() {
    let root = Path::new(ROOT);
    let (results, labels) =
        (collected::read(root).expect("summaries"), collected::labels(root).expect("labels"));
    let physics = collected::physics(root).expect("a golden state");
    let readme = fs::read_to_string(root.join("README.md")).expect("a README");
    let rates = collected::rates(root).expect("rates");
    let expected = tables::written(&readme, &results, &labels, &physics, &rates);
    let expected = expected.expect("a place for the tables");
    assert_eq!(readme, expected, "run .ci/regenerate results");
    let page = fs::read_to_string(root.join(tables::PAGE)).expect("a page");
    assert_eq!(page, tables::page(&results, &labels, &physics), "run .ci/regenerate results");
}

#[test]
fn the_first_screen_shows_the_best_constant_number() {
    let cell = |name: &str, safety: f64| {
        let rate = |rate: f64| json!({ "rate": rate, "wilson95": [rate, rate] });
        json!({
            "name": name, "goal_success_rate": rate(90.0), "safety_success_rate": rate(safety), "d_over_tau_median": 1.0,
        })
    };
    let controllers =
        [cell("expert", 99.0), cell("look-retry", 60.0), cell("drives", 30.0), cell("one-force", 40.0)];
    let suites = vec![json!({ "name": "object_hidden", "controllers": controllers })];
    let hidden = collected::Results { script: "suites/hidden.lua".to_owned(), has_conditions: false, suites };
    let table = tables::first_screen(&[hidden], &json!({ "expert": "knows the object" }));
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
fn run(folder: &Path, script: &str, suite: &str, policy: &str) {
    fs::create_dir_all(folder).expect("a folder");
    let rate = |rate: f64| json!({ "rate": rate, "wilson95": [rate / 2.0, rate] });
    let files = [
        ("run.json", json!({ "softvt": "1", "seed": 3, "script": script, "suite": suite }).to_string()),
        (
            "summary.json",
            json!({
                "suite": suite, "policy": policy, "privileged": true, "episodes": 2, "invalid": 0, "by_task": [{}],
                "goal_success_rate": rate(100.0), "no_drop_rate": rate(100.0), "safety_success_rate": rate(50.0),
            })
            .to_string(),
        ),
        (
            "episodes.jsonl",
            [(0.1, 4.0, 1.5), (0.4, 6.0, 2.5)]
                .map(|(d, time, grip)| {
                    json!({ "d_peak": d, "tau": 0.2, "goal_time_s": time, "grip_ratio": grip }).to_string() + "\n"
                })
                .concat(),
        ),
    ];
    for (name, text) in files {
        fs::write(folder.join(name), text).expect("a file");
    }
}

#[test]
fn rows_and_columns_follow_the_runs() {
    let home = tempfile::tempdir().expect("a folder");
    let root = home.path();
    fs::create_dir_all(root.join("assets")).expect("a folder");
    fs::write(root.join("assets/golden.json"), json!({ "state_hash": "abc" }).to_string()).expect("a file");
    let out = root.join("controllers");
    let suites = ["one_varied", "two"].map(|suite| {
        let rows = [("reference", None), ("size-seen", Some("size-seen"))].map(|(condition, policy)| {
            let folder = format!("{suite}/{condition}");
            run(&out.join(&folder), "suites/controllers.lua", suite, policy.unwrap_or("expert"));
            json!({ "condition": condition, "policy": policy, "outcome": { "folder": folder } })
        });
        json!({ "suite": suite, "rows": rows })
    });
    fs::write(out.join("conditions.json"), json!({ "suites": suites }).to_string()).expect("a file");
    for policy in ["expert", "binary"] {
        run(&root.join(policy).join("one"), "suites/all.lua", "one", policy);
        collected::add(root, &root.join(policy)).expect("runs of a list of suites");
    }
    collected::add(root, &out).expect("runs of conditions");
    // Adding them again replaces them.
    collected::add(root, &out).expect("runs of conditions");
    let results = collected::read(root).expect("summaries");
    let labels = json!({ "size-seen": "sees the size" });
    let overview = tables::overview(&results, &labels, "abc");
    assert_eq!(
        overview,
        "`softvt suites/controllers.lua --episodes 2`: 2 episodes per row and suite; the brackets are the 95 % interval of Safety. No episode was invalid. \
         All controllers plan from ground-truth state (*privileged*).\n\n\
         |  | One-Varied: Goal % | Safety % | Two: Goal % | Safety % |\n|---|---:|---:|---:|---:|\n\
         | `expert` | 100.0 | 50.0\u{a0}[25.0,\u{a0}50.0] | 100.0 | 50.0\u{a0}[25.0,\u{a0}50.0] |\n\
         | `size-seen`: sees the size | 100.0 | 50.0\u{a0}[25.0,\u{a0}50.0] | 100.0 | 50.0\u{a0}[25.0,\u{a0}50.0] |\n\n\
         `softvt suites/all.lua --episodes 2 --policy NAME` for each controller: 2 episodes per row and suite; the brackets are the 95 % interval of Safety. No episode was invalid. All controllers \
         plan from ground-truth state (*privileged*).\n\n\
         |  | One: Goal % | Safety % |\n|---|---:|---:|\n\
         | `expert` | 100.0 | 50.0\u{a0}[25.0,\u{a0}50.0] |\n| `binary` | 100.0 | 50.0\u{a0}[25.0,\u{a0}50.0] |\n"
    );
    assert!(
        tables::overview(&results, &labels, "abcd")
            .starts_with("Rows that were not run again with this version")
    );
    // Medians of D/τ 0.5 and 2, of grip ratios 1.5 and 2.5, and of times 4 and 6 s.
    let page = tables::page(&results, &labels, "abcd");
    assert!(page.contains("| 50.0\u{a0}[25.0,\u{a0}50.0] | 1.25 | 2.00 | 5.0 | `abc` |"), "{page}");
    let error = collected::add(root, &root.join("docs")).expect_err("no run");
    assert!(error.contains("no finished run"), "{error}");
}
