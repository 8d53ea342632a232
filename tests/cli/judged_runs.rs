//! Flags of judged runs: a secret seed whose hash is all that results show.

use crate::support::Small;

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

#[test]
fn seed_files_that_are_no_secret_are_refused() {
    let project = Small { task: "budget_steps = 3", ..Small::default() }.project();
    project.write("secret", b"correct horse battery staple");
    project.write("empty", b"");
    project.write("short", b"7");
    for (words, expected) in [
        (
            "x.lua --seed-file none",
            "--seed-file none: there is no such file; write one, for example: head -c 32 ",
        ),
        (
            "x.lua --seed-file empty",
            "--seed-file empty: 0 bytes may be guessed from their hash in the results; write one",
        ),
        (
            "x.lua --seed-file short",
            "--seed-file short: 1 byte may be guessed from their hash in the results; write one",
        ),
        ("x.lua --seed-file .", "--seed-file .: "),
        ("x.lua --seed-file secret --seed 1", "cannot be used with"),
        ("record x.lua --seed-file secret --out d", "--seed-file: demonstrations are public"),
        ("replay x 0 --seed-file none", "--seed-file none: there is no such file"),
        ("scripts/rest_check.lua --seed-file secret", "--seed-file: has no effect on an experiment"),
    ] {
        let output = project.softvt(words);
        assert_eq!(output.code, 2, "{words}");
        assert!(output.err.contains(expected), "{words}: {}", output.err);
    }
}
