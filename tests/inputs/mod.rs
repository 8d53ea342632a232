//! Fixtures: files of small inputs, whose answers are compared with one snapshot per file.
//!
//! What is above the line `---` is common to the inputs below it, which blank lines separate. `...` in it stands for an
//! input; without it, an input follows. What is in front of an input is joined to one line, so that its own lines start
//! with 2, or with 1 without it. A line `-- NAME: VALUE` gives a property of the input, and a line `-- file: PATH`
//! starts another file, common or of the input.
//!
//! A new input is a new paragraph. `INSTA_UPDATE=always cargo test …` writes the snapshots; review what it changes.

use std::{
    collections::BTreeMap,
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
};

/// One input of a fixture.
pub(super) struct Input {
    /// The input as it is written.
    pub(super) shown: String,
    /// The input within what is common.
    pub(super) text: String,
    /// Value of each property.
    pub(super) properties: BTreeMap<String, String>,
    /// Path and content of further files.
    pub(super) files: Vec<(String, String)>,
}

/// Compares the answers to the inputs of every file in `folder` with the snapshot of the file. `answer` gets the name
/// of the file, too.
pub(super) fn check(folder: &Path, answer: impl Fn(&str, &Input) -> String) {
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path(folder);
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    let (snapshots, fixtures): (Vec<_>, Vec<_>) = names.iter().partition(|name| name.contains(".snap"));
    let stem = |name: &str| name.split_once('.').map_or(name, |(stem, _)| stem).to_owned();
    for snapshot in snapshots {
        assert!(fixtures.iter().any(|name| stem(name) == stem(snapshot)), "{snapshot}: its fixture is gone");
    }
    let differs = |name: &&&String| {
        let text = fs::read_to_string(folder.join(name)).expect("a fixture");
        let line = |input: Input| {
            format!("{}\n    → {}\n", input.shown, answer(&stem(name), &input).replace('\n', "\n      "))
        };
        let found: Vec<String> = inputs(&text).into_iter().map(line).collect();
        let compare = || settings.bind(|| insta::assert_snapshot!(stem(name), found.join("\n")));
        catch_unwind(AssertUnwindSafe(compare)).is_err()
    };
    let differing: Vec<_> = fixtures.iter().filter(differs).collect();
    assert!(differing.is_empty(), "snapshots of {differing:?} differ");
}

fn inputs(text: &str) -> Vec<Input> {
    let (common, inputs) = text.split_once("\n---\n").expect("a line ---");
    let common = parts(common);
    let template: Vec<&str> =
        common.text.lines().map(str::trim).filter(|line| !line.starts_with("--")).collect();
    let template = template.join(" ");
    let (before, after) = template.split_once("...").unwrap_or((&template, ""));
    let paragraphs = inputs.split("\n\n").map(str::trim_end).filter(|paragraph| !paragraph.is_empty());
    let before = if before.is_empty() { String::new() } else { format!("{before}\n") };
    let within = |paragraph| {
        let input = parts(paragraph);
        Input {
            text: format!("{before}{}{after}\n", input.text),
            files: common.files.iter().chain(&input.files).cloned().collect(),
            ..input
        }
    };
    paragraphs.map(within).collect()
}

/// Splits a paragraph into its text, its properties and its other files.
fn parts(paragraph: &str) -> Input {
    let mut input = Input {
        shown: paragraph.trim_start_matches('\n').to_owned(),
        text: String::new(),
        properties: BTreeMap::new(),
        files: Vec::new(),
    };
    for line in input.shown.lines() {
        let property = line.strip_prefix("-- ").and_then(|rest| rest.split_once(": "));
        match property.filter(|(name, _)| !name.contains(' ')) {
            Some(("file", path)) => input.files.push((path.to_owned(), String::new())),
            Some((name, value)) => drop(input.properties.insert(name.to_owned(), value.to_owned())),
            None => {
                let text = input.files.last_mut().map_or(&mut input.text, |(_, text)| text);
                *text += &format!("{line}\n");
            }
        }
    }
    input
}
